/* Surfaces of random meshes against their rules by brute force: which corners share a vertex, which edges are
 * split, and what each vertex stores. */
#include "../place.h"
#include "base/math/round.h"
#include "cluster/tree/node.h"
#include "radiosity/surface/creases.h"
#include "radiosity/surface/refine.h"
#include "radiosity/surface/split.h"
#include "radiosity/surface/tessellate.h"
#include "scene/transform.h"

/* Of a mesh without a scene, with creases of 40 degrees. */
#define SHADELESS ((const fct_shading[]){{.rule = FCT_NORMALS_CREASE, .crease_cosine = .766}})

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static v3 at(const float *array, uint32_t v) {
    return v3_load(array + 3 * (size_t)v);
}

static bool same_place(const float *positions, uint32_t a, uint32_t b) {
    const float *p = positions + 3 * (size_t)a, *q = positions + 3 * (size_t)b;
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

/* A bumpy ball whose vertices are partly doubled, with faces that are turned over, doubled, degenerate or
 * missing. */
static fct_mesh make_odd(uint64_t seed) {
    fct_mesh ball = make_bumpy(&plain, 5, seed % 3 ? .5 : .2), mesh;
    uint32_t n = ball.vertex_count, faces = ball.face_count;
    assert_int_equal(fct_mesh_create(&plain, 2 * n, faces + 6, 0, &mesh), FCT_OK);
    for (int k = 0; k < 2; ++k)
        memcpy(mesh.positions + 3 * (size_t)n * (k ? 1 : 0), ball.positions, 12 * (size_t)n);
    for (uint32_t f = 0; f < faces + 6; ++f) {
        uint64_t luck = fct_hash2(seed, f) % 40;
        for (uint32_t k = 0; k < 3; ++k)
            mesh.triangles[3 * (size_t)f + k] =
                ball.triangles[3 * (size_t)(f % faces) + k] + (fct_hash3(seed, f, k) % 6 == 0 ? n : 0);
        uint32_t *t = mesh.triangles + 3 * (size_t)f, swap = t[1];
        if (luck == 0) t[1] = t[2], t[2] = swap;
        if (luck == 1) t[2] = t[1];
        if (luck == 2) t[0] = t[1] = t[2];
        if (luck == 3) t[0] = t[2] = t[1], t[1] = 0;
    }
    fct_mesh_release(&plain, &ball);
    return mesh;
}

/* A steep screw or a closed needle around vertex 0: no direction is in front of all its faces. */
static fct_mesh make_needle(bool closed) {
    uint32_t n = closed ? 24 : 14;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&plain, n + 2, n, 0, &mesh), FCT_OK);
    v3_store(mesh.positions, v3_make(0, 0, 0));
    for (uint32_t i = 0; i <= n; ++i) {
        double angle = closed ? FCT_PI / 12 * i : FCT_PI / 9 * i;
        v3_store(mesh.positions + 3 * (size_t)(i + 1), v3_make(.001 * cos(angle), .001 * sin(angle), -5));
    }
    for (uint32_t i = 0; i < n; ++i) {
        const uint32_t t[3] = {0, i + 1, closed && i + 1 == n ? 1 : i + 2};
        memcpy(mesh.triangles + 3 * (size_t)i, t, sizeof t);
    }
    return mesh;
}

static v3 face_cross(const fct_corners *m, uint32_t face) {
    const uint32_t *t = m->triangles + 3 * (size_t)face;
    v3 a = at(m->positions, t[0]);
    return v3_cross(v3_sub(at(m->positions, t[1]), a), v3_sub(at(m->positions, t[2]), a));
}

/* The corner that follows corner c in its face after k steps. */
static uint32_t next_corner(uint32_t c, uint32_t k) {
    return c / 3 * 3 + (c + k) % 3;
}

/* Labels corners that are joined across smooth edges; open[c]: a side of the corner is not joined. */
static void label_corners(const fct_corners *m, uint32_t *label, bool *open) {
    uint32_t corners = 3 * m->face_count;
    for (uint32_t c = 0; c < corners; ++c) label[c] = c, open[c] = false;
    bool *joined = calloc(2 * corners, 1);
    for (uint32_t c = 0; c < corners; ++c)
        for (uint32_t k = 1; k < 3; ++k) {
            uint32_t end = m->triangles[next_corner(c, k)], slots = 0, other = FCT_NONE, side = 0;
            for (uint32_t d = 0; d < corners; ++d)
                for (uint32_t j = 1; j < 3; ++j) {
                    if (!same_place(m->positions, m->triangles[c], m->triangles[d])) continue;
                    if (!same_place(m->positions, end, m->triangles[next_corner(d, j)])) continue;
                    ++slots;
                    if (d != c || j != k) other = d, side = j;
                }
            if (slots != 2 || side == k) continue;
            v3 a = v3_unit(face_cross(m, c / 3)), b = v3_unit(face_cross(m, other / 3));
            if (v3_norm2(a) > 0 && v3_norm2(b) > 0 && v3_dot(a, b) <= .766) continue;
            joined[2 * c + k - 1] = true;
            uint32_t from = label[c] > label[other] ? label[c] : label[other],
                     to = label[c] < label[other] ? label[c] : label[other];
            for (uint32_t d = 0; d < corners; ++d)
                if (label[d] == from) label[d] = to;
        }
    for (uint32_t c = 0; c < corners; ++c)
        for (uint32_t d = 0; d < corners; ++d)
            open[c] |= label[c] == label[d] && !(joined[2 * d] && joined[2 * d + 1]);
    free(joined);
}

static void assert_foothold(const fct_surface *s, uint32_t v, const fct_foothold *e) {
    assert_true(v3_norm(v3_sub(at(s->normals, v), e->normal)) < 1e-5);
    assert_true(v3_norm(v3_sub(at(s->sample_points, v), e->sample)) < 1e-6 + 6e-8 * v3_norm(e->sample));
    assert_near(s->offsets[v], e->offset, 1e-5 * e->offset);
    assert_int_equal(s->flat[v], e->flat);
    assert_int_equal(s->places[v], s->face_places[e->face]);
}

static void corners_share_vertices_by_the_rules(void **state) {
    (void)state;
    plain = fct_env_default();
    int broken = 0, rims = 0, added = 0;
    for (uint64_t seed = 0; seed < 12; ++seed) {
        fct_mesh mesh = seed < 10 ? make_odd(seed) : make_needle(seed == 11);
        const fct_corners m = {mesh.vertex_count, mesh.face_count, mesh.positions, mesh.triangles};
        uint32_t corners = 3 * m.face_count, *label = malloc(corners * sizeof *label),
                 *sources = malloc(corners * sizeof *sources), *places = malloc(corners * sizeof *places),
                 *group = malloc(corners * sizeof *group), pairs = 0, used = 0;
        bool *open = malloc(corners), *done = calloc(corners, 1);
        for (uint32_t f = 0; f < m.face_count; ++f) sources[f] = 7 * f + 3, places[f] = 5 * f + 1;
        float *uv = malloc(6 * m.face_count * sizeof *uv);
        for (uint32_t i = 0; i < 6 * m.face_count; ++i) uv[i] = (float)i;
        fct_surface s;
        assert_int_equal(fct_surface_vertices(&plain, &m, sources, uv, places, SHADELESS, &s), FCT_OK);
        assert_memory_equal(s.mesh.source_uv, uv, 24 * (size_t)m.face_count);
        free(uv);
        assert_memory_equal(s.mesh.source_faces, sources, 4 * (size_t)m.face_count);
        assert_memory_equal(s.face_places, places, 4 * (size_t)m.face_count);
        assert_memory_equal(s.mesh.positions, m.positions, 12 * (size_t)m.vertex_count);
        label_corners(&m, label, open);
        for (uint32_t v = 0; v < m.vertex_count; ++v) {
            bool any = false;
            for (uint32_t c = 0; c < corners; ++c) any |= m.triangles[c] == v;
            used += any;
        }
        for (uint32_t c = 0; c < corners; ++c) {
            uint32_t count = 0, mine = s.mesh.triangles[c];
            assert_true(same_place(s.mesh.positions, mine, m.triangles[c]));
            assert_true(mine >= m.vertex_count || mine == m.triangles[c]);
            /* by vertex, then by corner */
            for (uint32_t v = 0; v < m.vertex_count; ++v)
                for (uint32_t d = 0; d < corners; ++d)
                    if (label[d] == label[c] && m.triangles[d] == v) group[count++] = d;
            v3 normal;
            bool whole = fct_corner_normal(&m, group, count, &normal), rim = open[c] || !whole;
            if (!whole) group[0] = c, count = 1, fct_corner_normal(&m, group, 1, &normal), ++broken;
            fct_foothold expected = fct_corner_foothold(&m, group, count, normal, rim);
            assert_foothold(&s, mine, &expected);
            double area = 0;
            for (uint32_t d = 0; d < corners; ++d) {
                bool together = whole ? label[d] == label[c] && m.triangles[d] == m.triangles[c] : d == c;
                assert_int_equal(s.mesh.triangles[d] == mine, together);
                if (together) area += v3_norm(face_cross(&m, d / 3)) / 6;
                if (together && d < c) done[c] = true;
            }
            assert_near(s.areas[mine], area, 1e-6);
            pairs += !done[c], rims += rim;
        }
        assert_int_equal(s.mesh.vertex_count, m.vertex_count + pairs - used);
        added += (int)(pairs - used);
        free(label), free(sources), free(places), free(group), free(open), free(done);
        fct_surface_release(&plain, &s);
        fct_mesh_release(&plain, &mesh);
    }
    printf("    %d corners alone, %d on a rim, %d vertices added\n", broken, rims, added);
    assert_true(broken > 5 && rims > 100 && added > 100);
}

/* Chooses edges and the place of their cuts by their end positions. */
typedef struct chooser {
    const fct_surface *s;
    double share; /* from the end with the lower x + 2 y + 3 z */
} chooser;

static double choose_edge(void *user, uint32_t a, uint32_t b) {
    const chooser *x = user;
    v3 p = at(x->s->mesh.positions, a), q = at(x->s->mesh.positions, b), sum = v3_add(p, q);
    assert_true(a < b);
    if (fmod(fabs(1000 * (sum.x + 2 * sum.y + 3 * sum.z)), 1) >= .4) return 0;
    return p.x + 2 * p.y + 3 * p.z < q.x + 2 * q.y + 3 * q.z ? x->share : 1 - x->share;
}

/* One round on surfaces with creases: which vertices are new, the parts of each face, and the data of all. */
static void refinement_splits_the_chosen_edges(void **state) {
    (void)state;
    plain = fct_env_default();
    int cut[4] = {0}, rims = 0;
    for (uint64_t seed = 0; seed < 11; ++seed) {
        fct_mesh mesh = make_odd(seed);
        if (seed >= 8) /* as small as the rounding of its coordinates, so that midpoints turn faces over */
            for (size_t k = 0; k < 3 * (size_t)mesh.vertex_count; ++k)
                mesh.positions[k] = 100 + (seed == 8 ? 3e-5F : 1e-4F) * mesh.positions[k];
        const fct_corners m = {mesh.vertex_count, mesh.face_count, mesh.positions, mesh.triangles};
        uint32_t *numbers = malloc(m.face_count * sizeof *numbers), added, face = 0, seen = 0;
        for (uint32_t f = 0; f < m.face_count; ++f) numbers[f] = f + 9;
        float *uv = calloc(6 * m.face_count, sizeof *uv);
        fct_surface s, old;
        assert_int_equal(fct_surface_vertices(&plain, &m, numbers, uv, numbers, SHADELESS, &s), FCT_OK);
        assert_int_equal(fct_surface_vertices(&plain, &m, numbers, uv, numbers, SHADELESS, &old), FCT_OK);
        free(uv);
        uint32_t n = s.mesh.vertex_count;
        for (size_t i = 0; i < 3 * (size_t)n; ++i)
            s.mesh.colors[i] = old.mesh.colors[i] = (float)fct_uniform(fct_hash2(seed, i));
        const double share = seed % 2 && seed < 8 ? .3 : .5;
        chooser now = {&s, share}, before = {&old, share};
        assert_int_equal(fct_surface_refine(&plain, &s, choose_edge, &now, &added), FCT_OK);
        assert_int_equal(s.mesh.vertex_count, n + added);
        assert_memory_equal(s.mesh.positions, old.mesh.positions, 12 * (size_t)n);
        assert_memory_equal(s.mesh.colors, old.mesh.colors, 12 * (size_t)n);
        assert_memory_equal(s.normals, old.normals, 12 * (size_t)n);
        assert_memory_equal(s.sample_points, old.sample_points, 12 * (size_t)n);
        assert_memory_equal(s.offsets, old.offsets, 4 * (size_t)n);
        assert_memory_equal(s.places, old.places, 4 * (size_t)n);
        assert_memory_equal(s.flat, old.flat, n);
        uint32_t *parents = malloc(s.mesh.face_count * sizeof *parents),
                 (*ends)[2] = malloc((added + 1) * sizeof *ends);
        for (uint32_t f = 0; f < m.face_count; ++f) {
            const uint32_t *t = old.mesh.triangles + 3 * (size_t)f;
            uint32_t middles[3], marks = 0, mark[3], parts = 1;
            for (uint32_t k = 0; k < 3; ++k) {
                uint32_t a = t[k], b = t[(k + 1) % 3];
                mark[k] = !same_place(old.mesh.positions, a, b) &&
                          choose_edge(&before, a < b ? a : b, a < b ? b : a) > 0;
                marks += mark[k], parts += mark[k];
            }
            ++cut[marks];
            double area = 0;
            for (uint32_t p = face; p < face + parts; ++p) {
                const uint32_t *q = s.mesh.triangles + 3 * (size_t)p;
                v3 x = v3_cross(v3_sub(at(s.mesh.positions, q[1]), at(s.mesh.positions, q[0])),
                                v3_sub(at(s.mesh.positions, q[2]), at(s.mesh.positions, q[0])));
                v3 own = v3_cross(v3_sub(at(s.mesh.positions, t[1]), at(s.mesh.positions, t[0])),
                                  v3_sub(at(s.mesh.positions, t[2]), at(s.mesh.positions, t[0])));
                area += v3_norm(x) / v3_norm(own);
                if (v3_norm(own) > 1e-6) assert_true(v3_dot(x, own) > 0);
                assert_true(s.mesh.source_faces[p] == f + 9 && s.face_places[p] == f + 9);
                parents[p] = f;
            }
            v3 own = v3_cross(v3_sub(at(s.mesh.positions, t[1]), at(s.mesh.positions, t[0])),
                              v3_sub(at(s.mesh.positions, t[2]), at(s.mesh.positions, t[0])));
            if (v3_norm(own) > 1e-6) assert_near(area, 1, 1e-5);
            /* New vertices are numbered in the order of faces and sides. */
            for (uint32_t k = 0; k < 3; ++k) {
                uint32_t a = t[k], b = t[(k + 1) % 3], i = 0;
                if (!mark[k]) continue;
                while (i < seen &&
                       !((ends[i][0] == a && ends[i][1] == b) || (ends[i][0] == b && ends[i][1] == a)))
                    ++i;
                if (i == seen) ends[i][0] = a, ends[i][1] = b, ++seen;
                middles[k] = n + i;
                int uses = 0;
                for (size_t c = 3 * (size_t)face; c < 3 * (size_t)(face + parts); ++c)
                    uses += s.mesh.triangles[c] == middles[k];
                assert_true(uses >= 2);
            }
            if (marks == 2) { /* the shorter diagonal of the quadrilateral */
                uint32_t lone = !mark[0]   ? 0
                                : !mark[1] ? 1
                                           : 2; /* the side that stays whole, from corner `lone` */
                uint32_t a = t[lone], c = t[(lone + 1) % 3], bc = middles[(lone + 1) % 3],
                         ab = middles[(lone + 2) % 3];
                double first = v3_norm(v3_sub(at(s.mesh.positions, a), at(s.mesh.positions, bc)));
                double second = v3_norm(v3_sub(at(s.mesh.positions, c), at(s.mesh.positions, ab)));
                bool with_first = false;
                for (uint32_t p = face; p < face + parts; ++p)
                    for (int k = 0; k < 3; ++k) {
                        uint32_t x = s.mesh.triangles[3 * (size_t)p + (size_t)k],
                                 y = s.mesh.triangles[3 * (size_t)p + (size_t)(k + 1) % 3];
                        with_first |= (x == a && y == bc) || (x == bc && y == a);
                    }
                if (share == .5 && fabs(first - second) > 1e-5) assert_int_equal(with_first, first < second);
            }
            face += parts;
        }
        assert_int_equal(face, s.mesh.face_count);
        assert_int_equal(seen, added);
        const fct_corners fine = {s.mesh.vertex_count, s.mesh.face_count, s.mesh.positions, s.mesh.triangles};
        for (uint32_t v = 0; v < s.mesh.vertex_count; ++v) {
            uint32_t around[256], count = 0;
            double area = 0;
            bool rim = true;
            for (uint32_t c = 0; c < 3 * fine.face_count; ++c) {
                if (fine.triangles[c] != v) continue;
                area += v3_norm(face_cross(&fine, c / 3)) / 6;
                rim &= count == 0 || parents[c / 3] == parents[around[0] / 3];
                around[count++] = c;
            }
            assert_near(s.areas[v], area, 1e-5 * (1e-3 + area));
            if (v < n) continue;
            const uint32_t *e = ends[v - n];
            v3 normal, p = at(old.mesh.positions, e[0]), q = at(old.mesh.positions, e[1]);
            fct_corner_normal(&fine, around, count, &normal);
            fct_foothold expected = fct_corner_foothold(&fine, around, count, normal, rim);
            assert_foothold(&s, v, &expected);
            const double w = p.x + 2 * p.y + 3 * p.z < q.x + 2 * q.y + 3 * q.z ? share : 1 - share;
            v3 middle = v3_add(v3_scale(p, 1 - w), v3_scale(q, w));
            assert_true(v3_norm(v3_sub(middle, at(s.mesh.positions, v))) < 1e-6 + 6e-8 * v3_norm(middle));
            for (size_t c = 0; c < 3; ++c)
                assert_near(s.mesh.colors[3 * (size_t)v + c],
                            (1 - w) * (double)old.mesh.colors[3 * (size_t)e[0] + c] +
                                w * (double)old.mesh.colors[3 * (size_t)e[1] + c],
                            1e-6);
            rims += rim;
        }
        free(numbers), free(parents), free(ends);
        fct_surface_release(&plain, &s), fct_surface_release(&plain, &old);
        fct_mesh_release(&plain, &mesh);
    }
    printf("    faces cut %d %d %d %d times, %d on a rim\n", cut[0], cut[1], cut[2], cut[3], rims);
    assert_true(cut[0] > 20 && cut[1] > 20 && cut[2] > 20 && cut[3] > 5 && rims > 20);
}

/* True if the part of a tree below `node` counts as within d of p (model space): a box within d that is a
 * face or has a half diagonal below .35 d, below boxes within d. */
static bool comes_near(const fct_tree *tree, uint32_t node, v3 p, double d) {
    fct_cluster room;
    fct_box box;
    const fct_cluster *c = fct_node_cluster(tree, node, &room);
    fct_cluster_box(c, &box);
    double away = 0, half = 0;
    for (int k = 0; k < 3; ++k) {
        double x = fabs(v3_dot(v3_sub(p, v3_load(box.center)), v3_load(box.axes[k])));
        away += pow(fmax(x - (double)box.half[k], 0), 2), half += pow(box.half[k], 2);
    }
    if (away > d * d) return false;
    if (node >= fct_tree_get(tree).node_count || half < .35 * .35 * d * d) return true;
    return comes_near(tree, fct_node_child(tree, node, 0), p, d) ||
           comes_near(tree, fct_node_child(tree, node, 1), p, d);
}

static bool must_split(const fct_scene *scene, uint32_t instance, v3 a, v3 b, double longest, int met[3]) {
    double length = v3_norm(v3_sub(b, a));
    if (length <= longest / 4) return false;
    if (length > longest) return true;
    fct_scene_view view = fct_scene_get(scene);
    v3 m = v3_scale(v3_add(a, b), .5);
    const double x[3] = {m.x, m.y, m.z};
    for (uint32_t i = 0; i < view.volume_count; ++i) {
        const fct_volume *volume = &view.volumes[i];
        if (volume->instance == FCT_NONE || volume->instance == instance) continue;
        double away = 0;
        for (int k = 0; k < 3; ++k)
            away += pow(
                fmax(fmax((double)volume->bounds.lower[k] - x[k], x[k] - (double)volume->bounds.upper[k]), 0),
                2);
        if (away > length * length) continue;
        const fct_instance *in = &view.instances[volume->instance];
        const fct_tree *tree = view.models[in->model].tree;
        fct_tree_view t = fct_tree_get(tree);
        for (uint32_t r = 0; r < t.root_count; ++r)
            if (comes_near(tree, t.roots[r], fct_transform_point(in->to_model, m),
                           length / fct_transform_shrink(in)))
                return ++met[1], true;
    }
    return ++met[0], false;
}

static bool has_vertex(const fct_surface *s, v3 p) {
    float x[3];
    v3_store(x, p);
    for (size_t v = 0; v < s->mesh.vertex_count; ++v)
        if (s->mesh.positions[3 * v] == x[0] && s->mesh.positions[3 * v + 1] == x[1] &&
            s->mesh.positions[3 * v + 2] == x[2])
            return true;
    return false;
}

/* A side of the model is split down to edges that need no split. */
static void follow_edge(const fct_scene *scene, uint32_t instance, const fct_surface *s, v3 a, v3 b,
                        double longest, int met[3]) {
    v3 m = v3_round(v3_scale(v3_add(a, b), .5));
    bool splits = must_split(scene, instance, a, b, longest, met);
    assert_int_equal(has_vertex(s, m), splits);
    if (!splits) return;
    ++met[2];
    follow_edge(scene, instance, s, a, m, longest, met), follow_edge(scene, instance, s, m, b, longest, met);
}

static void long_edges_are_split_and_no_others(void **state) {
    (void)state;
    plain = fct_env_default();
    int met[3] = {0};
    for (uint64_t seed = 0; seed < 30; ++seed) {
        fct_scene *scene;
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        uint32_t grey = place_material(scene, .5, 0, false);
        double scale = seed % 2 ? 1 : 20, r[12];
        for (uint64_t k = 0; k < 12; ++k) r[k] = fct_uniform(fct_hash2(seed, k));
        place_sheet(&plain, scene, grey, 1 + (uint32_t)seed % 2, v3_make(0, 0, 0), v3_make(4 * scale, 0, 0),
                    v3_make(scale, 3 * scale, 0));
        fct_mesh ball = make_bumpy(&plain, 7, .3),
                 sheet = make_sheet(&plain, 3, v3_make(0, 0, 0), v3_make(1, 0, .3), v3_make(0, 1, .2));
        const float turned[12] = {0,
                                  (float)(.4 * scale),
                                  0,
                                  (float)(4 * r[0] * scale),
                                  (float)(.4 * scale),
                                  0,
                                  0,
                                  (float)(3 * r[1] * scale),
                                  0,
                                  0,
                                  (float)(.4 * scale),
                                  (float)((.2 + r[2]) * scale)};
        const float sheared[12] = {(float)(.9 * scale),
                                   (float)(.3 * scale),
                                   0,
                                   (float)(3 * r[3] * scale),
                                   0,
                                   (float)(.3 * scale),
                                   0,
                                   (float)(3 * r[4] * scale),
                                   (float)(.2 * scale),
                                   0,
                                   (float)scale,
                                   (float)(r[5] * scale)};
        place_mesh(scene, &ball, grey, turned);
        place_mesh(scene, seed % 3 ? &sheet : &ball, grey, sheared);
        fct_mesh_release(&plain, &ball), fct_mesh_release(&plain, &sheet);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_scene_view view = fct_scene_get(scene);
        for (uint32_t i = 0; i < view.instance_count; ++i) {
            double longest = scale * (.5 + .5 * r[6 + i]);
            fct_surface s;
            assert_int_equal(fct_surface_build(&plain, SHADE(scene, i), longest, &s), FCT_OK);
            for (size_t c = 0; c < 3 * (size_t)s.mesh.face_count; ++c) {
                v3 a = at(s.mesh.positions, s.mesh.triangles[c]),
                   b = at(s.mesh.positions, s.mesh.triangles[c % 3 == 2 ? c - 2 : c + 1]);
                assert_false(must_split(scene, i, a, b, longest, met));
            }
            const fct_instance *in = &view.instances[i];
            fct_tree_view t = fct_tree_get(view.models[in->model].tree);
            for (size_t c = 0; c < 3 * (size_t)t.face_count; ++c) {
                v3 a = fct_transform_point(in->to_world, at(t.positions, t.triangles[c]));
                v3 b = fct_transform_point(in->to_world,
                                           at(t.positions, t.triangles[c % 3 == 2 ? c - 2 : c + 1]));
                follow_edge(scene, i, &s, v3_round(a), v3_round(b), longest, met);
            }
            /* Sample points lie on the face at their place. */
            for (uint32_t v = 0; v < s.mesh.vertex_count; ++v) {
                v3 p[3], x = at(s.sample_points, v);
                for (size_t k = 0; k < 3; ++k)
                    p[k] = fct_transform_point(in->to_world,
                                               at(t.positions, t.triangles[3 * (size_t)s.places[v] + k]));
                v3 n = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
                double area = 0;
                for (int k = 0; k < 3; ++k)
                    area += v3_norm(v3_cross(v3_sub(p[k], x), v3_sub(p[(k + 1) % 3], x)));
                assert_near(v3_dot(v3_sub(x, p[0]), n), 0, 1e-5 * scale);
                assert_near(area, v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))),
                            1e-5 * scale * scale);
            }
            fct_surface_release(&plain, &s);
        }
        v3 diagonal = v3_sub(v3_load(view.bounds.upper), v3_load(view.bounds.lower));
        assert_near(fct_surface_default_edge(scene), v3_norm(diagonal) / 72, 1e-9 * scale);
        fct_scene_destroy(scene);
    }
    printf("    %d edges stay, %d are near others, %d sides split\n", met[0], met[1], met[2]);
    assert_true(met[0] > 1000 && met[1] > 100 && met[2] > 100);
}

/* first[v]: the lowest vertex at a position; zeros of either sign are equal. */
static void positions_are_welded(void **state) {
    (void)state;
    plain = fct_env_default();
    enum { N = 700 };
    float p[3 * N];
    uint32_t first[N];
    for (uint64_t i = 0; i < 3 * N; ++i) {
        uint64_t luck = fct_hash(i) % 9;
        p[i] = luck == 0 ? -0.F : luck == 1 ? 0.F : (float)luck - 4;
    }
    assert_int_equal(fct_weld(&plain, N, p, first), FCT_OK);
    for (uint32_t v = 0; v < N; ++v) {
        uint32_t least = 0;
        while (!same_place(p, least, v)) ++least;
        assert_int_equal(first[v], least);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(corners_share_vertices_by_the_rules),
        cmocka_unit_test(refinement_splits_the_chosen_edges),
        cmocka_unit_test(long_edges_are_split_and_no_others),
        cmocka_unit_test(positions_are_welded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
