/* A bake equals its steps: the test makes the solution, the meshes and the probes from the parts of the
 * library, whose own tests compare them with plain evaluations, and finds the same numbers in the bake. */
#include "mesh/mesh.h"
#include "place.h"
#include "radiosity/output/anchor.h"
#include "radiosity/output/blend.h"
#include "radiosity/output/output.h"
#include "radiosity/output/probe.h"
#include "radiosity/output/smooth.h"
#include "radiosity/rivals/reference.h"
#include "radiosity/surface/cover.h"
#include "radiosity/surface/refine.h"
#include "radiosity/surface/tessellate.h"
#include "refining.h"
#include "soup.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static uint32_t add_colour(fct_scene *scene, double r, double g, double b, double emission, bool two_sided) {
    const fct_material m = {.reflectance = {(float)r, (float)g, (float)b},
                            .emission = {(float)emission, (float)(.7 * emission), (float)(.3 * emission)},
                            .two_sided = two_sided};
    uint32_t id;
    assert_int_equal(fct_scene_add_material(scene, &m, &id), FCT_OK);
    return id;
}

/* A floor, a two-sided lamp, a two-sided sheet that both sides of the lamp light, a stretched egg, a
 * sheet whose back is dark, and with `sunk` a ball in the floor. */
static fct_scene *make_scene(bool sunk) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    uint32_t floor = add_colour(scene, .7, .5, .3, 0, false), both = add_colour(scene, .3, .8, .5, 0, true);
    place_sheet(&plain, scene, floor, 2, v3_make(0, 0, 0), v3_make(3, 0, 0), v3_make(0, 3, 0));
    place_sheet(&plain, scene, add_colour(scene, .1, .2, .3, 4, true), 1, v3_make(1, 1, 1.5),
                v3_make(0, .6, 0), v3_make(.6, 0, 0));
    place_sheet(&plain, scene, both, 1, v3_make(1.9, .2, .4), v3_make(0, 2, 0), v3_make(.2, 0, 2));
    fct_mesh ball = make_sphere(&plain, 5);
    const float egg[12] = {.3F, 0, 0, .6F, 0, .4F, 0, 2, .1F, 0, .5F, .6F};
    place_mesh(scene, &ball, floor, egg);
    const float low[12] = {.5F, 0, 0, .9F, 0, .5F, 0, 1, 0, 0, .45F, .23F};
    if (sunk) place_mesh(scene, &ball, floor, low);
    fct_mesh_release(&plain, &ball);
    place_sheet(&plain, scene, both, 1, v3_make(0, 0, 2.5), v3_make(0, 3, 0), v3_make(3, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static double measure_absorption(const fct_elements *set) {
    double power = 0;
    for (size_t id = 0; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        for (int c = 0; c < 3 && e->child_count == 0 && e->kind != FCT_ELEMENT_VOLUME; ++c)
            power += (1 - (double)e->reflectance[c]) * e->irradiance[c] * e->area;
    }
    return power;
}

/* Five passes of refinement, whose epsilon halves down to error times the power, with 4 sweeps each and 100
 * in the last; then rays. The power is the emitted one in the first pass, then the absorbed one of the pass
 * before. */
static fct_solution solve_by_steps(const fct_scene *scene, const fct_bake_def *def, fct_bake_stats *stats) {
    fct_solution s = {.env = &plain, .scene = scene, .def = *def};
    fct_scene_view view = fct_scene_get(scene);
    s.max_edge = def->max_edge;
    s.longest_reach = 9 * fct_surface_default_edge(scene);
    s.fineness = fmin(fmax(sqrt(2e-5 / def->error), .25), 16);
    assert_int_equal(fct_lamps_create(&plain, scene, &s.lamps), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, scene, s.max_edge / 4, &s.elements), FCT_OK);
    soup all = list_triangles(scene);
    double power = 0;
    size_t triangle = 0;
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        const fct_material *m = &view.materials[view.instances[i].material];
        uint32_t faces = fct_tree_get(view.models[view.instances[i].model].tree).face_count;
        for (uint32_t f = 0; f < faces; ++f, ++triangle) {
            const v3 *p = all.corners + 3 * triangle;
            double area = .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
            for (int c = 0; c < 3; ++c) power += (m->two_sided ? 2 : 1) * area * m->emission[c];
        }
    }
    free(all.corners);
    *stats = (fct_bake_stats){0};
    assert_int_equal(fct_links_create(&plain, &s.links), FCT_OK);
    const double emitted = power;
    for (int pass = 0; pass < 5 && emitted > 0; ++pass) {
        if (pass > 0) power = fmax(fmin(measure_absorption(&s.elements), emitted), power / 8);
        double epsilon = def->error * power * pow(2, 4 - pass);
        assert_int_equal(refine_links(&s.elements, &s.links, epsilon), FCT_OK);
        assert_int_equal(fct_links_solve(&s.elements, &s.links, 1e-3, pass < 4 ? 4 : 100, &stats->passes),
                         FCT_OK);
    }
    const fct_transport_def t = {
        .seed = def->seed, .epsilon = 4 * def->error * power, .tolerance = 1e-4, .fineness = s.fineness};
    assert_int_equal(fct_transport_solve(&s.elements, s.lamps, &t, &s.transport), FCT_OK);
    stats->passes += s.transport.sweeps;
    for (size_t id = 0; id < s.elements.count; ++id) {
        const fct_element *e = &s.elements.items[id];
        for (int c = 0; c < 3 && e->child_count == 0; ++c)
            s.mean_radiosity +=
                e->area * (e->radiosity[c] - (double)e->emission[c]) / 3 / s.elements.items[0].area;
    }
    return s;
}

static void release_solution(fct_solution *s) {
    fct_guides_release(&plain, &s->guides);
    fct_transport_release(&plain, &s->transport);
    fct_links_release(&plain, &s->links);
    fct_elements_release(&s->elements);
    fct_lamps_destroy(s->lamps);
}

/* The mesh of one side as it grows. */
typedef struct side {
    const fct_solution *s;
    uint32_t instance;
    bool back;
    fct_surface f;
    fct_anchors anchors;
    float *direct, *indirect,
        *nearest;            /* per vertex: irradiance x 3 each, distance of the test of the cover */
    uint8_t *covered, *made; /* made: by a cut */
    uint32_t *doubt;         /* per vertex: lamps of which it and its neighbours see different parts */
    fct_sight *sights;       /* per vertex */
    uint64_t *crossed;       /* edges that the current cut has looked at, as pairs */
    size_t crossed_count;
    double usual_area; /* mean over the vertices before any cut */
    uint32_t usual_count;
    uint32_t known, cut,
        lit; /* lower vertices have these; are older than the cuts before covers; have light */
    uint64_t rays;
    int borders, covers, shadows;
} side;

static const fct_material *find_material(const fct_solution *s, uint32_t instance) {
    fct_scene_view view = fct_scene_get(s->scene);
    return &view.materials[view.instances[instance].material];
}

/* The leaf with a surface point, from the barycentrics of the world-space face. */
static uint32_t find_leaf(const side *x, uint32_t place, v3 point) {
    fct_scene_view view = fct_scene_get(x->s->scene);
    const fct_instance *in = &view.instances[x->instance];
    fct_tree_view t = fct_tree_get(view.models[in->model].tree);
    v3 p[3];
    for (int k = 0; k < 3; ++k) {
        const float *q = t.positions + 3 * (size_t)t.triangles[3 * (size_t)place + (size_t)k],
                    *m = in->to_world;
        double w[3];
        for (int r = 0; r < 3; ++r)
            w[r] = (double)m[4 * r] * q[0] + (double)m[4 * r + 1] * q[1] + (double)m[4 * r + 2] * q[2] +
                   m[4 * r + 3];
        p[k] = v3_make(w[0], w[1], w[2]);
    }
    double area = v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    double u = v3_norm(v3_cross(v3_sub(p[2], point), v3_sub(p[0], point))) / area,
           v = v3_norm(v3_cross(v3_sub(p[0], point), v3_sub(p[1], point))) / area;
    return fct_elements_locate(&x->s->elements, x->instance, x->back, place, (float)u, (float)v);
}

static v3 find_normal(const side *x, uint32_t v) {
    return v3_scale(v3_load(x->f.normals + 3 * (size_t)v), x->back ? -1 : 1);
}

/* Room for the new vertices, which are covered as given. */
static void grow_side(side *x, bool covered, bool made) {
    const size_t count = x->f.mesh.vertex_count;
    x->direct = realloc(x->direct, 12 * count), x->indirect = realloc(x->indirect, 12 * count);
    x->nearest = realloc(x->nearest, 4 * count), x->covered = realloc(x->covered, count);
    x->made = realloc(x->made, count), x->doubt = realloc(x->doubt, 4 * count);
    x->sights = realloc(x->sights, count * sizeof *x->sights);
    for (size_t v = x->known; v < count; ++v) {
        x->nearest[v] = INFINITY, x->covered[v] = covered, x->made[v] = made, x->doubt[v] = 0;
        x->sights[v] = (fct_sight){0};
    }
    x->known = (uint32_t)count;
}

/* Cuts may leave a vertex whose faces have no area. It is black. */
static bool has_faces(const side *x, uint32_t v) {
    return x->f.places[v] != FCT_NONE && v3_norm2(v3_load(x->f.normals + 3 * (size_t)v)) > 0;
}

/* Which of the new vertices are covered. */
static void cover_by_steps(side *x) {
    uint32_t first = x->known;
    grow_side(x, false, false);
    for (uint32_t v = first; v < x->known; ++v) {
        float n[3];
        v3_store(n, find_normal(x, v));
        x->covered[v] =
            has_faces(x, v) &&
            fct_point_is_covered(x->s->scene, x->f.sample_points + 3 * (size_t)v, n, x->f.offsets[v],
                                 fct_hash3(x->s->def.seed + 3, x->instance, v), &x->nearest[v], &x->rays);
        x->covers += x->covered[v];
    }
}

/* Above the edge: the share of the way to the first surface, or 2. */
static double meet_wall(side *x, v3 p, v3 q, v3 normal, v3 end_normal, float offset) {
    const v3 from = v3_mad(p, offset, normal);
    fct_ray ray = {.t_max = 1};
    fct_scene_hit hit;
    v3_store(ray.origin, from), v3_store(ray.direction, v3_sub(v3_mad(q, offset, end_normal), from));
    ++x->rays;
    return fct_scene_closest_hit(x->s->scene, &ray, &hit, NULL) ? hit.t : 2;
}

/* Looks behind and before the first surface, and then halves the edge until the border of the cover is known
 * to a 256th of it. The rays of an edge count once, for its first face. */
static double find_border(void *user, uint32_t a, uint32_t b) {
    side *x = user;
    const uint32_t from = x->covered[a] ? b : a, to = x->covered[a] ? a : b;
    if (x->covered[a] == x->covered[b] || x->made[to] || (a < x->lit && b < x->lit)) return 0;
    const uint64_t rays = x->rays, edge = (uint64_t)a << 32 | b;
    bool again = false;
    for (size_t i = 0; i < x->crossed_count && !again; ++i) again = x->crossed[i] == edge;
    if (!again) {
        x->crossed = realloc(x->crossed, 8 * (x->crossed_count + 1));
        x->crossed[x->crossed_count++] = edge;
    }
    const float *p = x->f.mesh.positions + 3 * (size_t)from, *q = x->f.mesh.positions + 3 * (size_t)to;
    const float offset = fmaxf(x->f.offsets[a], x->f.offsets[b]);
    const double wall =
        meet_wall(x, v3_load(p), v3_load(q), find_normal(x, from), find_normal(x, to), offset);
    double low = 0, high = 1;
    for (int k = 0; high - low > 1 / 256.; ++k) {
        double w = wall + (k == 0 ? .4 : -.4) / 256;
        if (k > 1 || w <= low || w >= high) w = (low + high) / 2;
        float point[3], n[3];
        v3_store(n, v3_unit(v3_add(v3_scale(find_normal(x, from), 1 - w), v3_scale(find_normal(x, to), w))));
        v3_store(point, v3_add(v3_load(p), v3_scale(v3_sub(v3_load(q), v3_load(p)), w)));
        bool hidden = fct_point_is_covered(x->s->scene, point, n, offset,
                                           fct_hash3(x->s->def.seed + 4, x->instance, from), NULL, &x->rays);
        if (hidden)
            high = w;
        else
            low = w;
    }
    if (again) x->rays = rays;
    if (low < 1 / 256.) return 0;
    return from == a ? low : 1 - low;
}

static double pass_border(void *user, uint32_t a, uint32_t b) {
    const side *x = user;
    const float *p = x->f.mesh.positions + 3 * (size_t)a, *q = x->f.mesh.positions + 3 * (size_t)b;
    if (v3_norm(v3_sub(v3_load(p), v3_load(q))) <= x->s->max_edge / 256) return 0;
    return a < x->cut && b >= x->cut && x->covered[a] && !x->covered[b] ? 1 - 2 / 256. : 0;
}

static void cut_by_steps(side *x) {
    x->cut = x->known, x->crossed_count = 0;
    assert_int_equal(fct_surface_refine(&plain, &x->f, find_border, x, NULL), FCT_OK);
    grow_side(x, false, true);
    assert_int_equal(fct_surface_refine(&plain, &x->f, pass_border, x, NULL), FCT_OK);
    grow_side(x, true, true);
}

/* Direct irradiance of a vertex with known indirect light from two rays per lamp or more; with lamps in
 * doubt, more to these. */
static void light_directly(side *x, uint32_t v, uint32_t doubt, double e[3]) {
    const fct_solution *s = x->s;
    const float *point = x->f.sample_points + 3 * (size_t)v;
    const v3 n = find_normal(x, v);
    const double p[3] = {point[0], point[1], point[2]}, normal[3] = {n.x, n.y, n.z};
    /* Twice the error on a fourth of the usual area. */
    fct_lamp_goal goal = {.slack = x->f.flat[v] ? 1.5 : 1, .doubt = doubt};
    if (v >= x->usual_count) goal.slack = fmin(goal.slack * fmax(sqrt(x->usual_area / x->f.areas[v]), 1), 2);
    for (size_t c = 0; c < 3; ++c) {
        e[c] = doubt ? x->direct[3 * (size_t)v + c] : 0;
        goal.other += (double)x->indirect[3 * (size_t)v + c];
    }
    if (s->def.indirect_only) return;
    fct_lamps_direct(s->lamps, s->scene, p, normal, x->f.offsets[v],
                     fct_hash3(s->def.seed + 1, x->instance, v), (uint32_t)fmin(fmax(2 * s->fineness, 2), 64),
                     &goal, &x->sights[v], e, &x->rays);
}

/* Twice: a vertex takes more rays to the lamps that it has looked at with rays that agree, if those of a
 * neighbour disagree with them; once per lamp. */
static void settle_doubts(side *x) {
    const fct_mesh *m = &x->f.mesh;
    for (int round = 0; round < 2; ++round) {
        uint32_t *more = calloc(m->vertex_count, sizeof *more);
        for (size_t c = 0; c < 3 * (size_t)m->face_count; ++c)
            for (int turn = 0; turn < 2; ++turn) {
                const uint32_t next = m->triangles[c % 3 == 2 ? c - 2 : c + 1];
                const uint32_t v = turn ? next : m->triangles[c], w = turn ? m->triangles[c] : next;
                const fct_sight a = x->sights[v], b = x->sights[w];
                more[v] |= (a.open & ~a.blocked & b.blocked) | (a.blocked & ~a.open & b.open);
            }
        for (uint32_t v = 0; v < m->vertex_count; ++v) {
            double e[3];
            const uint32_t fresh = more[v] & ~x->doubt[v];
            if (fresh == 0) continue;
            x->doubt[v] |= fresh;
            light_directly(x, v, fresh, e);
            for (size_t k = 0; k < 3; ++k) x->direct[3 * (size_t)v + k] = (float)e[k];
            ++x->shadows;
        }
        free(more);
    }
}

static void color_side(side *x) {
    const fct_material *m = find_material(x->s, x->instance);
    for (size_t i = 0; i < 3 * (size_t)x->known; ++i)
        x->f.mesh.colors[i] =
            !has_faces(x, (uint32_t)(i / 3))
                ? 0
                : (float)((x->s->def.indirect_only ? 0 : (double)m->emission[i % 3]) +
                          (double)m->reflectance[i % 3] * ((double)x->direct[i] + (double)x->indirect[i]));
}

static void light_by_steps(side *x, uint32_t first) {
    const fct_solution *s = x->s;
    for (uint32_t v = first; v < x->f.mesh.vertex_count; ++v) {
        float normal[3];
        double e[3] = {0, 0, 0}, indirect[3] = {0, 0, 0};
        const float *point = x->f.sample_points + 3 * (size_t)v;
        v3_store(normal, find_normal(x, v));
        const bool lit = !x->covered[v] && has_faces(x, v);
        if (s->def.final == FCT_FINAL_NONE && lit) {
            uint32_t leaf = find_leaf(x, x->f.places[v], v3_load(point));
            fct_links_irradiance(&s->elements, &s->links, leaf, v3_load(point), v3_load(normal), indirect);
        } else if (lit) {
            fct_anchors_irradiance(&x->anchors, &s->elements, point, normal, x->f.offsets[v], x->f.flat[v],
                                   indirect, &x->rays);
        }
        for (size_t c = 0; c < 3; ++c) x->indirect[3 * (size_t)v + c] = (float)indirect[c];
        if (s->def.final != FCT_FINAL_NONE && lit) light_directly(x, v, 0, e);
        for (size_t c = 0; c < 3; ++c) x->direct[3 * (size_t)v + c] = (float)e[c];
    }
    settle_doubts(x);
    x->lit = x->known;
    color_side(x);
}

/* Edges not shorter than a 24th of max_edge whose ends differ by a tenth of their sum and 4 % of the scene's
 * mean, and are not covered. */
static double has_border(void *user, uint32_t a, uint32_t b) {
    side *x = user;
    const float *p = x->f.mesh.positions + 3 * (size_t)a, *q = x->f.mesh.positions + 3 * (size_t)b;
    const float *y = x->f.mesh.colors + 3 * (size_t)a, *z = x->f.mesh.colors + 3 * (size_t)b;
    double difference = 0, sum = 0;
    for (int c = 0; c < 3; ++c) difference += fabs((double)y[c] - z[c]), sum += (double)y[c] + z[c];
    const double length = v3_norm(v3_sub(v3_load(p), v3_load(q)));
    const double least = .1 * sum + .04 * x->s->mean_radiosity;
    bool result = difference > (length > x->s->max_edge / 5 ? .6 : 1) * least &&
                  length >= x->s->max_edge / 24 && !x->covered[a] && !x->covered[b];
    x->borders += result;
    return result ? .5 : 0;
}

/* Anchors for the vertices that have no light yet. */
static void anchor_by_steps(side *x) {
    const fct_solution *s = x->s;
    if (s->def.final == FCT_FINAL_NONE) return;
    fct_anchors_def def = {.rays = s->def.samples ? s->def.samples : (uint32_t)(20 * s->fineness),
                           .tolerance =
                               (s->def.final == FCT_FINAL_GATHER ? .4 : .9) / sqrt(fmax(s->fineness, .5)),
                           .side = x->back ? -1 : 1,
                           .instance = x->instance,
                           .first = x->lit,
                           .covered = x->covered,
                           .nearest = x->nearest,
                           .seed = fct_hash2(s->def.seed, x->instance)};
    const fct_source source = fct_solution_source(s);
    const uint64_t before = x->anchors.rays;
    assert_int_equal(fct_anchors_extend(&plain, &source, &x->f, &def, &x->anchors), FCT_OK);
    x->rays += x->anchors.rays - before;
}

static side make_side(const fct_solution *s, uint32_t instance, bool back) {
    side x = {.s = s, .instance = instance, .back = back};
    uint32_t added = 0;
    assert_int_equal(fct_surface_build(&plain, SHADE(s->scene, instance), s->max_edge, &x.f), FCT_OK);
    x.usual_count = x.f.mesh.vertex_count;
    for (uint32_t v = 0; v < x.f.mesh.vertex_count; ++v)
        x.usual_area += (double)x.f.areas[v] / x.f.mesh.vertex_count;
    cover_by_steps(&x);
    cut_by_steps(&x);
    anchor_by_steps(&x);
    light_by_steps(&x, 0);
    for (int round = 0; round < 4; ++round) {
        uint32_t old = x.f.mesh.vertex_count;
        assert_int_equal(fct_surface_refine(&plain, &x.f, has_border, &x, &added), FCT_OK);
        if (added == 0) break;
        cover_by_steps(&x);
        cut_by_steps(&x);
        anchor_by_steps(&x);
        light_by_steps(&x, old);
    }
    if (s->def.final != FCT_FINAL_NONE)
        assert_int_equal(fct_light_smooth(&plain, &x.f, x.covered, x.indirect), FCT_OK);
    if (s->def.final != FCT_FINAL_NONE)
        assert_int_equal(fct_direct_smooth(&plain, &x.f, x.covered, x.sights, x.direct), FCT_OK);
    color_side(&x);
    return x;
}

static void release_side(side *x) {
    free(x->direct), free(x->indirect), free(x->nearest), free(x->covered), free(x->made), free(x->doubt);
    free(x->sights), free(x->crossed);
    fct_surface_release(&plain, &x->f);
    fct_anchors_release(&plain, &x->anchors);
}

/* Compares the vertices and faces of a part of a mesh with a side. */
static void compare_side(const fct_mesh *mesh, uint32_t vertex, uint32_t face, const side *x) {
    const fct_mesh *m = &x->f.mesh;
    for (size_t i = 0; i < 3 * (size_t)m->vertex_count; ++i) {
        assert_near(mesh->positions[3 * (size_t)vertex + i], m->positions[i], 0);
        assert_near(mesh->colors[3 * (size_t)vertex + i], m->colors[i], 1e-6);
    }
    for (size_t f = 0; f < m->face_count; ++f) {
        const uint32_t *a = mesh->triangles + 3 * (face + f), *b = m->triangles + 3 * f;
        v3 p[6];
        for (int k = 0; k < 3; ++k)
            p[k] = v3_load(mesh->positions + 3 * (size_t)a[k]),
            p[k + 3] = v3_load(m->positions + 3 * (size_t)b[k]);
        v3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])),
           o = v3_cross(v3_sub(p[4], p[3]), v3_sub(p[5], p[3]));
        assert_true(v3_norm(v3_sub(n, v3_scale(o, x->back ? -1 : 1))) <= 1e-6 * v3_norm(o));
        uint32_t sums[2] = {a[0] + a[1] + a[2] - 3 * vertex, b[0] + b[1] + b[2]};
        assert_int_equal(sums[0], sums[1]);
        assert_int_equal(mesh->source_faces[face + f], m->source_faces[f]);
    }
}

typedef struct watcher {
    double values[16];
    int count;
} watcher;

static bool watch(void *user, const char *phase, double done) {
    watcher *w = user;
    if (strcmp(phase, "objects") == 0) w->values[w->count++] = done;
    return true;
}

/* Work of an instance: its faces, and 12 per square of max_edge of its area, where a transform counts by the
 * root mean square of its cofactors. */
static double measure_work(const fct_scene_view *view, uint32_t i, double max_edge) {
    const fct_instance *in = &view->instances[i];
    const float *m = in->to_world;
    fct_tree_view t = fct_tree_get(view->models[in->model].tree);
    double area = 0, square = 0;
    for (size_t f = 0; f < t.face_count; ++f) {
        v3 p[3];
        for (size_t k = 0; k < 3; ++k) p[k] = v3_load(t.positions + 3 * (size_t)t.triangles[3 * f + k]);
        area += .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    }
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            square +=
                pow((double)m[4 * r1 + c1] * m[4 * r2 + c2] - (double)m[4 * r1 + c2] * m[4 * r2 + c1], 2);
        }
    return t.face_count + 12 * area * sqrt(square / 3) / (max_edge * max_edge);
}

static void bakes_equal_their_steps(void **state) {
    (void)state;
    int borders = 0, second_sides = 0, covers = 0, shadows = 0;
    static const fct_bake_def defs[] = {
        {.final = FCT_FINAL_GATHER, .error = 2e-3, .seed = 5, .max_edge = .8},
        {.final = FCT_FINAL_NONE, .error = 5e-4, .seed = 2, .max_edge = .5},
        {.final = FCT_FINAL_DIRECT, .error = 1e-4, .seed = 3, .max_edge = 1, .samples = 30},
        {.final = FCT_FINAL_GATHER, .error = 1e-5, .seed = 4, .max_edge = 2, .indirect_only = true},
    };
    for (size_t d = 0; d < sizeof defs / sizeof *defs; ++d) {
        fct_bake_def def = fct_bake_def_default(), other = defs[d];
        /* Over links alone, a vertex of the ball between two leaves has the light of either. */
        fct_scene *scene = make_scene(other.final != FCT_FINAL_NONE);
        fct_scene_view view = fct_scene_get(scene);
        assert_true(def.method == FCT_BAKE_FACE && def.final == FCT_FINAL_GATHER && def.error == 2e-5 &&
                    def.seed == 1);
        assert_true(def.size == sizeof def && def.samples == 0 && !def.indirect_only && def.max_edge == 0);
        other.size = def.size, other.crease = def.crease;
        fct_bake *b;
        fct_bake_stats expected;
        watcher w = {.count = 0};
        fct_env env = plain;
        env.progress = watch, env.progress_user = &w;
        assert_int_equal(fct_bake_create(&env, scene, &other, &b), FCT_OK);
        fct_solution s = solve_by_steps(scene, &other, &expected);
        assert_int_equal(fct_guides_create(&s.elements, &s.links, s.transport.stored, &s.guides), FCT_OK);
        fct_bake_stats stats = fct_bake_get_stats(b);
        assert_true(stats.converged);
        assert_int_equal(stats.passes, expected.passes);
        assert_int_equal(stats.elements, s.elements.count), assert_int_equal(stats.links, s.links.count);
        assert_int_equal(stats.rays, s.links.rays + s.transport.rays);
        assert_int_equal(stats.touched_bytes, fct_elements_touched(&s.elements));
        assert_near(stats.power_emitted, s.transport.emitted, 0),
            assert_near(stats.power_absorbed, s.transport.absorbed, 0);
        assert_near(stats.power_escaped, s.transport.escaped, 0);
        assert_near(stats.error_estimate, s.transport.noise + s.transport.change, 1e-12);
        assert_true(stats.seconds_total >= stats.seconds_open + stats.seconds_solve &&
                    stats.seconds_open > 0);
        uint64_t vertices = 0, faces = 0, rays = 0;
        double works[8], whole = 0, done = 0;
        for (uint32_t i = 0; i < view.instance_count; ++i)
            whole += works[i] = measure_work(&view, i, other.max_edge);
        for (uint32_t i = 0; i < view.instance_count; ++i) {
            fct_mesh mesh;
            bool back[2];
            assert_int_equal(fct_bake_instance(b, i, &mesh), FCT_OK);
            uint32_t vertex = 0, face = 0, count = fct_output_sides(&s, i, back);
            for (uint32_t k = 0; k < count; ++k) {
                side x = make_side(&s, i, back[k]);
                assert_true(vertex + x.f.mesh.vertex_count <= mesh.vertex_count &&
                            face + x.f.mesh.face_count <= mesh.face_count);
                compare_side(&mesh, vertex, face, &x);
                vertex += x.f.mesh.vertex_count, face += x.f.mesh.face_count, rays += x.rays,
                    borders += x.borders, covers += x.covers, shadows += x.shadows;
                release_side(&x);
            }
            second_sides += count == 2;
            assert_true(vertex == mesh.vertex_count && face == mesh.face_count);
            vertices += vertex, faces += face;
            fct_mesh_release(&plain, &mesh);
            assert_int_equal(w.count, i + 1);
            done += works[i];
            assert_near(w.values[i], done / whole, 1e-5);
        }
        stats = fct_bake_get_stats(b);
        assert_true(stats.vertices == vertices && stats.faces == faces && stats.output_rays == rays);
        enum { PROBES = 40 };
        float points[3 * PROBES], normals[3 * PROBES];
        fct_probe probes[PROBES];
        for (uint64_t k = 0; k < PROBES; ++k) {
            for (uint64_t c = 0; c < 3; ++c) {
                points[3 * k + c] = (float)(3 * fct_uniform(fct_hash3(k, c, 1)));
                normals[3 * k + c] = (float)(fct_uniform(fct_hash3(k, c, 2)) - .5);
            }
            if (k % 4 == 0) points[3 * k + 2] = 0, normals[3 * k + 2] = 1; /* the floor */
            if (k % 4 == 1)
                v3_store(points + 3 * k, v3_mad(v3_mad(v3_make(1.9, .2, .4), .4, v3_make(0, 2, 0)),
                                                .01 * (double)k, v3_make(.2, 0, 2)));
        }
        assert_int_equal(fct_bake_probe(b, PROBES, points, normals, probes), FCT_OK);
        uint64_t probe_rays = 0;
        for (uint64_t k = 0; k < PROBES; ++k) {
            float n[3];
            double e[3] = {0, 0, 0};
            v3_store(n, v3_unit(v3_load(normals + 3 * k)));
            fct_site site = fct_probe_site(scene, points + 3 * k, n);
            if (other.final == FCT_FINAL_NONE && site.instance != FCT_NONE) {
                uint32_t leaf =
                    fct_elements_locate(&s.elements, site.instance, site.back, site.place, site.u, site.v);
                fct_links_irradiance(&s.elements, &s.links, leaf, v3_load(site.point), v3_load(n), e);
            } else {
                uint64_t seed = fct_hash3(other.seed + 2, k, 0);
                const double p[3] = {site.point[0], site.point[1], site.point[2]}, m[3] = {n[0], n[1], n[2]};
                if (!other.indirect_only)
                    fct_lamps_direct(s.lamps, scene, p, m, site.offset, seed,
                                     (uint32_t)fmin(fmax(16 * s.fineness, 16), 64), NULL, NULL, e,
                                     &probe_rays);
                fct_anchor a = {.offset = site.offset};
                memcpy(a.position, site.point, 12), memcpy(a.normal, n, 12);
                uint32_t count = (uint32_t)(1024 * fmax(s.fineness, 1));
                const fct_source source = fct_solution_source(&s);
                probe_rays += fct_anchor_gather(&source, NULL, count, fct_hash(seed), &a);
                for (int c = 0; c < 3; ++c) e[c] += (double)a.irradiance[c];
            }
            assert_true(probes[k].instance == site.instance && probes[k].face == site.face);
            for (int c = 0; c < 3; ++c) {
                assert_near(probes[k].irradiance[c], e[c], 1e-6);
                const fct_material *m = site.instance == FCT_NONE ? NULL : find_material(&s, site.instance);
                double emitted = m && !other.indirect_only ? (double)m->emission[c] : 0;
                assert_near(probes[k].radiosity[c], m ? emitted + (double)m->reflectance[c] * e[c] : 0, 1e-6);
            }
        }
        assert_int_equal(fct_bake_get_stats(b).output_rays, rays + probe_rays);
        fct_bake_destroy(b);
        release_solution(&s);
        fct_scene_destroy(scene);
    }
    printf("    %d borders, %d instances with two sides, %d vertices covered, %d at shadows\n", borders,
           second_sides, covers, shadows);
    assert_true(borders > 50 && second_sides > 2 && covers > 50 && shadows > 500);
}

/* The reference: paths at the vertices of the surface and at probes. Power is counted per vertex, and the
 * brighter side comes first. */
static void references_equal_their_steps(void **state) {
    (void)state;
    fct_scene *scene = make_scene(false);
    fct_scene_view view = fct_scene_get(scene);
    for (int indirect = 0; indirect < 2; ++indirect) {
        fct_bake_def def = fct_bake_def_default();
        def.method = FCT_BAKE_REFERENCE, def.max_edge = .9, def.seed = 7, def.indirect_only = indirect;
        def.samples = indirect ? 0 : 20;
        uint32_t samples = indirect ? 256 : 20;
        fct_bake *b;
        assert_int_equal(fct_bake_create(&plain, scene, &def, &b), FCT_OK);
        double emitted = 0, absorbed = 0, escaped = 0;
        uint64_t rays = 0;
        for (uint32_t i = 0; i < view.instance_count; ++i) {
            const fct_material *m = &view.materials[view.instances[i].material];
            fct_mesh mesh;
            side sides[2] = {{.instance = i}, {.instance = i, .back = true}};
            double power[2] = {0, 0};
            assert_int_equal(fct_bake_instance(b, i, &mesh), FCT_OK);
            for (int k = 0; k < (m->two_sided ? 2 : 1); ++k) {
                fct_surface *f = &sides[k].f;
                assert_int_equal(fct_surface_build(&plain, SHADE(scene, i), def.max_edge, f), FCT_OK);
                float *normals = malloc(12 * (size_t)f->mesh.vertex_count),
                      *lost = malloc(4 * (size_t)f->mesh.vertex_count);
                for (size_t v = 0; v < 3 * (size_t)f->mesh.vertex_count; ++v)
                    normals[v] = k ? -f->normals[v] : f->normals[v];
                assert_int_equal(fct_reference_estimate(&plain, scene, f->mesh.vertex_count, f->sample_points,
                                                        normals, f->offsets, samples, fct_hash2(7, i),
                                                        indirect, f->mesh.colors, lost, &rays),
                                 FCT_OK);
                for (size_t v = 0; v < f->mesh.vertex_count; ++v)
                    for (size_t c = 0; c < 3; ++c) {
                        double e = f->mesh.colors[3 * v + c], own = m->emission[c], rho = m->reflectance[c];
                        emitted += f->areas[v] * own, absorbed += f->areas[v] * (1 - rho) * e;
                        escaped += f->areas[v] * (own + rho * e) * lost[v];
                        double radiosity = (indirect ? 0 : own) + rho * e;
                        f->mesh.colors[3 * v + c] = (float)radiosity, power[k] += f->areas[v] * radiosity;
                    }
                free(normals), free(lost);
            }
            uint32_t first = power[1] > power[0],
                     count = fmin(power[0], power[1]) > 1e-4 * fmax(power[0], power[1]) ? 2 : 1;
            compare_side(&mesh, 0, 0, &sides[first]);
            if (count == 2)
                compare_side(&mesh, sides[first].f.mesh.vertex_count, sides[first].f.mesh.face_count,
                             &sides[!first]);
            assert_int_equal(mesh.vertex_count, sides[first].f.mesh.vertex_count +
                                                    (count == 2 ? sides[!first].f.mesh.vertex_count : 0));
            for (int k = 0; k < 2; ++k) release_side(&sides[k]);
            fct_mesh_release(&plain, &mesh);
        }
        fct_bake_stats stats = fct_bake_get_stats(b);
        assert_near(stats.power_emitted, indirect ? 0 : emitted, 1e-6 * emitted);
        assert_near(stats.power_absorbed, indirect ? 0 : absorbed, 1e-6 * absorbed);
        assert_near(stats.power_escaped, indirect ? 0 : escaped, 1e-6 * escaped);
        const float points[9] = {.4F, .5F, 0, 1.2F, 1.3F, 1.5F, .2F, 2.5F, 1},
                    normals[9] = {0, 0, 3, 0, 0, -2, 1, 1, 0};
        float units[9], e[9], offsets[3];
        fct_probe probes[3];
        assert_int_equal(fct_bake_probe(b, 3, points, normals, probes), FCT_OK);
        for (int k = 0; k < 3; ++k) {
            v3_store(units + 3 * k, v3_unit(v3_load(normals + 3 * k)));
            offsets[k] = fct_probe_site(scene, points + 3 * k, units + 3 * k).offset;
        }
        assert_int_equal(fct_reference_estimate(&plain, scene, 3, points, units, offsets, samples, 7,
                                                indirect, e, NULL, &rays),
                         FCT_OK);
        for (int k = 0; k < 3; ++k) {
            assert_int_equal(probes[k].instance, k == 2 ? FCT_NONE : (uint32_t)k);
            for (int c = 0; c < 3; ++c) {
                const fct_material *m = &view.materials[view.instances[k].material];
                assert_near(probes[k].irradiance[c], e[3 * k + c], 1e-3 * e[3 * k + c]);
                double own = indirect ? 0 : (double)m->emission[c];
                double expected = k == 2 ? 0 : own + (double)m->reflectance[c] * probes[k].irradiance[c];
                assert_near(probes[k].radiosity[c], expected, 1e-6);
            }
        }
        assert_int_equal(fct_bake_get_stats(b).output_rays, rays);
        fct_bake_destroy(b);
    }
    fct_scene_destroy(scene);
}

/* Without light there are no links, and rays alone depend on the error: 512 per leaf times sqrt(2e-5 /
 * error), in [1/4, 16]. */
static void rays_grow_with_accuracy(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    place_sheet(&plain, scene, place_material(scene, .5, 0, false), 1, v3_make(0, 0, 0), v3_make(1, 0, 0),
                v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    const double errors[5] = {1, 1.25e-6, 2e-5, 5e-6, 1e-9}, factors[5] = {.25, 4, 1, 2, 16};
    for (int k = 0; k < 5; ++k) {
        fct_bake_def def = fct_bake_def_default();
        def.error = errors[k];
        fct_bake *b;
        assert_int_equal(fct_bake_create(&plain, scene, &def, &b), FCT_OK);
        assert_int_equal(fct_bake_get_stats(b).rays, (uint64_t)(512 * factors[k] + .5));
        fct_bake_destroy(b);
    }
    fct_scene_destroy(scene);
}

/* All instances in one mesh: the parts follow each other. */
static void meshes_join_their_instances(void **state) {
    (void)state;
    fct_scene *scene = make_scene(false);
    fct_bake_def def = fct_bake_def_default();
    def.method = FCT_BAKE_REFERENCE, def.samples = 1, def.max_edge = 1;
    fct_bake *b;
    fct_mesh whole, part;
    uint32_t counts[5], vertex = 0, face = 0;
    assert_int_equal(fct_bake_create(&plain, scene, &def, &b), FCT_OK);
    assert_int_equal(fct_bake_mesh(b, &whole, counts), FCT_OK);
    for (uint32_t i = 0; i < 5; ++i) {
        assert_int_equal(fct_bake_instance(b, i, &part), FCT_OK);
        assert_int_equal(counts[i], part.face_count);
        assert_memory_equal(whole.positions + 3 * (size_t)vertex, part.positions,
                            12 * (size_t)part.vertex_count);
        assert_memory_equal(whole.colors + 3 * (size_t)vertex, part.colors, 12 * (size_t)part.vertex_count);
        for (size_t k = 0; k < 3 * (size_t)part.face_count; ++k)
            assert_int_equal(whole.triangles[3 * (size_t)face + k], part.triangles[k] + vertex);
        vertex += part.vertex_count, face += part.face_count;
        fct_mesh_release(&plain, &part);
    }
    assert_true(whole.vertex_count == vertex && whole.face_count == face);
    fct_mesh_release(&plain, &whole);
    fct_bake_destroy(b);
    fct_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bakes_equal_their_steps),
        cmocka_unit_test(references_equal_their_steps),
        cmocka_unit_test(rays_grow_with_accuracy),
        cmocka_unit_test(meshes_join_their_instances),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
