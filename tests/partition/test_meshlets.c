/* Meshlets have every face once, within the limits, with the corners of the input. Spheres and boxes contain
 * the vertices, and no cone culls a triangle that faces the eye. The smallest ball against all balls through
 * two to four points. */
#include "cluster/shapes.h"

#include "base/math/eigen.h"
#include "base/math/vec.h"
#include "facetree/partition.h"
#include "partition/meshlet/ball.h"
#include "partition/meshlet/bounds.h"

static fct_meshlets meshlets_of(const fct_env *env, const fct_mesh *mesh, const fct_meshlet_def *def) {
    fct_tree *tree = tree_of(env, mesh, 1);
    fct_meshlets m;
    assert_int_equal(fct_tree_meshlets(env, tree, def, &m), FCT_OK);
    fct_tree_destroy(tree);
    return m;
}

static void check_layout(const fct_mesh *mesh, const fct_meshlet_def *def, const fct_meshlets *m) {
    uint32_t *meshlet_of_vertex = malloc(4 * (size_t)mesh->vertex_count), vertices = 0, bytes = 0;
    bool *seen = calloc(mesh->face_count, 1);
    memset(meshlet_of_vertex, 0xFF, 4 * (size_t)mesh->vertex_count);
    assert_int_equal(m->first_face[0], 0);
    for (uint32_t i = 0; i < m->count; ++i) {
        const fct_meshlet *x = &m->meshlets[i];
        uint32_t used = 0;
        assert_in_range(x->vertex_count, 1, def->max_vertices);
        assert_in_range(x->triangle_count, 1, def->max_triangles);
        assert_int_equal(x->vertex_offset, vertices);
        assert_int_equal(x->triangle_offset, bytes);
        assert_int_equal(m->first_face[i + 1] - m->first_face[i], x->triangle_count);
        for (uint32_t v = 0; v < x->vertex_count; ++v) {
            assert_true(m->vertices[x->vertex_offset + v] < mesh->vertex_count);
            assert_int_not_equal(meshlet_of_vertex[m->vertices[x->vertex_offset + v]], i);
            meshlet_of_vertex[m->vertices[x->vertex_offset + v]] = i;
        }
        for (uint32_t t = 0; t < x->triangle_count; ++t) {
            uint32_t face = m->faces[m->first_face[i] + t];
            assert_false(seen[face]);
            seen[face] = true;
            for (uint32_t k = 0; k < 3; ++k) {
                uint8_t local = m->triangles[x->triangle_offset + 3 * t + k];
                assert_true(local <= used && local < x->vertex_count); /* numbered by first use */
                if (local == used) ++used;
                assert_int_equal(m->vertices[x->vertex_offset + local],
                                 mesh->triangles[3 * (size_t)face + k]);
            }
        }
        assert_int_equal(used, x->vertex_count);
        vertices += x->vertex_count;
        bytes += (3 * x->triangle_count + 3) / 4 * 4;
    }
    assert_int_equal(vertices, m->vertex_count);
    assert_int_equal(bytes, m->triangle_bytes);
    assert_int_equal(m->first_face[m->count], mesh->face_count);
    free(seen), free(meshlet_of_vertex);
}

static void check_boxes(const fct_mesh *mesh, const fct_meshlets *m) {
    for (uint32_t i = 0; i < m->count; ++i) {
        const fct_meshlet_bounds *b = &m->bounds[i];
        double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY},
               widest = 0;
        for (uint32_t v = 0; v < m->meshlets[i].vertex_count; ++v) {
            const float *p = mesh->positions + 3 * (size_t)m->vertices[m->meshlets[i].vertex_offset + v];
            double away = v3_norm(v3_sub(v3_load(p), v3_load(b->center)));
            assert_true(away <= (double)b->radius);
            widest = fmax(widest, away);
            for (int k = 0; k < 3; ++k) {
                double along = v3_dot(v3_sub(v3_load(p), v3_load(b->box.center)), v3_load(b->box.axes[k]));
                assert_true(fabs(along) <= (double)b->box.half[k]);
                low[k] = fmin(low[k], (double)p[k]), high[k] = fmax(high[k], (double)p[k]);
            }
        }
        double least = 0, own = 0;
        for (int k = 0; k < 3; ++k) {
            assert_true((double)b->bounds.lower[k] == low[k] && (double)b->bounds.upper[k] == high[k]);
            int l = (k + 1) % 3;
            least += (high[k] - low[k]) * (high[l] - low[l]);
            own += 4 * (double)b->box.half[k] * (double)b->box.half[l];
            for (int j = 0; j < 3; ++j)
                assert_true(fabs(v3_dot(v3_load(b->box.axes[k]), v3_load(b->box.axes[j])) - (j == k)) < 1e-6);
        }
        assert_true((double)b->radius <= widest * (1 + 1e-6));
        /* no larger than the axis-aligned box, up to rounding of the center */
        assert_true(own <=
                    least * (1 + 1e-5) + 4e-6 * widest * (widest + v3_norm(v3_load(b->box.center))) + 1e-20);
    }
}

/* In floats, as in a shader. */
static bool is_culled(const fct_meshlet_bounds *b, const float eye[3]) {
    float d[3], squared = 0, dot = 0;
    for (int k = 0; k < 3; ++k) d[k] = b->cone_apex[k] - eye[k], squared += d[k] * d[k];
    float length = sqrtf(squared);
    for (int k = 0; k < 3; ++k) dot += d[k] / length * b->cone_axis[k];
    return dot >= b->cone_cutoff;
}

/* For random eyes near and far, no culled meshlet has a triangle that faces the eye. Returns the culled ones.
 */
static uint32_t check_cones(const fct_mesh *mesh, const fct_meshlets *m, uint32_t eyes) {
    uint32_t state = 11, culled = 0;
    for (uint32_t i = 0; i < m->count; ++i) {
        const fct_meshlet *x = &m->meshlets[i];
        const fct_meshlet_bounds *b = &m->bounds[i];
        for (uint32_t e = 0; e < eyes; ++e) {
            double far = pow(10, 4 * shape_random(&state) - 1) * (double)b->radius;
            float eye[3];
            for (int k = 0; k < 3; ++k)
                eye[k] = (float)((double)b->center[k] + far * (2 * shape_random(&state) - 1));
            if (!is_culled(b, eye)) continue;
            ++culled;
            for (uint32_t t = 0; t < x->triangle_count; ++t) {
                v3 p[3];
                for (uint32_t k = 0; k < 3; ++k)
                    p[k] = v3_load(
                        mesh->positions +
                        3 * (size_t)
                                m->vertices[x->vertex_offset + m->triangles[x->triangle_offset + 3 * t + k]]);
                v3 normal = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
                assert_true(v3_dot(normal, v3_sub(v3_load(eye), p[0])) <= 0);
            }
        }
    }
    return culled;
}

static void every_face_once_within_limits_and_bounds(void **state) {
    (void)state;
    static const uint32_t limits[][2] = {{64, 124}, {3, 1}, {4, 512}, {32, 32}, {256, 512}, {128, 16}};
    fct_env env = fct_env_default();
    for (int shape = 0; shape < SHAPES; ++shape)
        for (size_t i = 0; i < sizeof limits / sizeof *limits; ++i) {
            fct_mesh mesh = make_shape(&env, shape);
            fct_meshlet_def def = fct_meshlet_def_default();
            def.max_vertices = limits[i][0], def.max_triangles = limits[i][1];
            fct_meshlets m = meshlets_of(&env, &mesh, &def);
            check_layout(&mesh, &def, &m);
            check_boxes(&mesh, &m);
            check_cones(&mesh, &m, SANITIZED ? 4 : 40);
            fct_meshlets_release(&env, &m);
            fct_mesh_release(&env, &mesh);
        }
}

/* Far from the origin and at the ends of the range of floats. */
static void bounds_hold_at_every_scale(void **state) {
    (void)state;
    static const double scales[] = {1e-30, 1e-6, 1, 1e6, 1e30};
    fct_env env = fct_env_default();
    for (size_t i = 0; i < sizeof scales / sizeof *scales; ++i)
        for (int moved = 0; moved < 2; ++moved) {
            fct_mesh mesh = make_sphere(&env, 16);
            for (size_t k = 0; k < 3 * (size_t)mesh.vertex_count; ++k)
                mesh.positions[k] = (float)(scales[i] * ((double)mesh.positions[k] + 1000 * moved));
            fct_meshlet_def def = fct_meshlet_def_default();
            fct_meshlets m = meshlets_of(&env, &mesh, &def);
            check_layout(&mesh, &def, &m);
            check_boxes(&mesh, &m);
            if (scales[i] < 1e15 && scales[i] > 1e-15)
                check_cones(&mesh, &m, 100); /* the test squares in floats */
            fct_meshlets_release(&env, &m);
            fct_mesh_release(&env, &mesh);
        }
}

static void meshlets_are_full_and_cones_cull(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 60);
    fct_meshlet_def def = fct_meshlet_def_default();
    fct_meshlets m = meshlets_of(&env, &mesh, &def);
    assert_true((double)m.vertex_count > 0.95 * 64 * m.count);
    assert_true((double)mesh.face_count > 89.0 * m.count);
    assert_true(check_cones(&mesh, &m, 100) > 35 * m.count);
    fct_meshlets_release(&env, &m);
    def.flatness = 0;
    m = meshlets_of(&env, &mesh, &def);
    check_layout(&mesh, &def, &m);
    fct_meshlets_release(&env, &m);
    fct_mesh_release(&env, &mesh);
    mesh = make_soup(&env, 21 * 20, false); /* 21 loose triangles have 63 corners */
    def = fct_meshlet_def_default();
    m = meshlets_of(&env, &mesh, &def);
    assert_in_range(m.count, 20, 23);
    fct_meshlets_release(&env, &m);
    fct_mesh_release(&env, &mesh);
}

/* Mean over the faces of 1 - cosine of the angle to the mean normal of their meshlet, and of the squared
 * distance to its mean centroid. */
static void measure_spread(const fct_mesh *mesh, const fct_meshlets *m, double *angle, double *distance) {
    *angle = *distance = 0;
    for (uint32_t i = 0; i < m->count; ++i) {
        v3 normal = {0, 0, 0}, middle = {0, 0, 0};
        double squares = 0, count = m->first_face[i + 1] - m->first_face[i];
        for (uint32_t at = m->first_face[i]; at < m->first_face[i + 1]; ++at) {
            v3 p[3];
            for (size_t k = 0; k < 3; ++k)
                p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)m->faces[at] + k]);
            v3 centroid = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1.0 / 3);
            normal = v3_add(normal, v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))));
            middle = v3_add(middle, centroid), squares += v3_norm2(centroid);
        }
        *angle += (count - v3_norm(normal)) / mesh->face_count;
        *distance += (squares - v3_norm2(middle) / count) / mesh->face_count;
    }
}

/* The more the weight of normals, the narrower and the longer are meshlets of sheets with folds. */
static void flatness_trades_shape_for_cones(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int run = 0; run < 6; ++run) {
        fct_mesh mesh = make_grid(&env, 40);
        const double slope = 0.2 + 0.2 * run, folds = 5 + run;
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
            float *p = mesh.positions + 3 * (size_t)v;
            double x = (double)p[run % 2] * folds;
            p[2] = (float)(slope / folds * fabs(x - 2 * floor(x / 2) - 1));
        }
        double angles[3], distances[3];
        for (int i = 0; i < 3; ++i) {
            fct_meshlet_def def = fct_meshlet_def_default();
            def.flatness = i == 0 ? 0 : i == 1 ? 1 : 100;
            fct_meshlets m = meshlets_of(&env, &mesh, &def);
            measure_spread(&mesh, &m, &angles[i], &distances[i]);
            fct_meshlets_release(&env, &m);
        }
        assert_true(angles[2] <= angles[1] && angles[1] < 0.95 * angles[0]);
        assert_true(distances[2] > 0.99 * distances[0]);
        fct_mesh_release(&env, &mesh);
    }
}

static void materials_do_not_mix(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 24);
    mesh.materials = fct_allocate(&env, mesh.face_count, sizeof *mesh.materials);
    mesh.material_count = 3;
    for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f / 2 % 24 / 8;
    fct_meshlet_def def = fct_meshlet_def_default();
    fct_meshlets m = meshlets_of(&env, &mesh, &def);
    check_layout(&mesh, &def, &m);
    for (uint32_t i = 0; i < m.count; ++i)
        for (uint32_t f = m.first_face[i]; f < m.first_face[i + 1]; ++f)
            assert_int_equal(mesh.materials[m.faces[f]], mesh.materials[m.faces[m.first_face[i]]]);
    fct_meshlets_release(&env, &m);
    fct_mesh_release(&env, &mesh);
}

/* Center and radius by trying every ball through two, three or four of the points. */
static double smallest_radius(const v3 *points, uint32_t count) {
    double best = INFINITY;
    for (uint32_t set = 1; set < 1u << count; ++set) {
        if (__builtin_popcount(set) > 4) continue;
        v3 chosen[4], center;
        uint32_t size = 0;
        double radius;
        for (uint32_t i = 0; i < count; ++i)
            if (set >> i & 1) chosen[size++] = points[i];
        fct_smallest_ball(chosen, size, &center, &radius);
        for (uint32_t i = 0; i < count; ++i)
            if (v3_norm(v3_sub(points[i], center)) > radius * (1 + 1e-9) + 1e-12) radius = INFINITY;
        best = fmin(best, radius);
    }
    return best;
}

static void the_smallest_ball(void **state) {
    (void)state;
    uint32_t random = 5;
    v3 points[64], center;
    double radius;
    for (int run = 0; run < (SANITIZED ? 30 : 300); ++run) {
        uint32_t count = 1 + (uint32_t)(9 * shape_random(&random));
        for (uint32_t i = 0; i < count; ++i) {
            points[i] = (v3){shape_random(&random), shape_random(&random), shape_random(&random)};
            if (run % 3 == 1) points[i].z = 0;
            if (run % 3 == 2) points[i] = v3_unit(v3_sub(points[i], (v3){0.5, 0.5, 0.5}));
        }
        fct_smallest_ball(points, count, &center, &radius);
        for (uint32_t i = 0; i < count; ++i)
            assert_true(v3_norm(v3_sub(points[i], center)) <= radius * (1 + 1e-15));
        assert_true(radius <= smallest_radius(points, count) * (1 + 1e-9) + 1e-12);
    }
    v3 square[5] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 1, 0}};
    fct_smallest_ball(square, 5, &center, &radius);
    assert_true(fabs(radius - sqrt(2)) < 1e-12 && v3_norm(v3_sub(center, square[4])) < 1e-12);
    v3 tetrahedron[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    fct_smallest_ball(tetrahedron, 4, &center, &radius);
    assert_true(fabs(radius - sqrt(3)) < 1e-12 && v3_norm(center) < 1e-12);
    fct_smallest_ball(square, 3, &center, &radius); /* right angle: the longest side alone holds it */
    assert_true(fabs(radius - sqrt(2)) < 1e-12);
}

/* The area of the points' box along two unit vectors at a right angle and their product. */
static double area_along(const v3 *points, uint32_t count, v3 a, v3 b) {
    const v3 axes[3] = {a, b, v3_cross(a, b)};
    double e[3];
    for (int k = 0; k < 3; ++k) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t i = 0; i < count; ++i) {
            double x = v3_dot(points[i], axes[k]);
            low = fmin(low, x), high = fmax(high, x);
        }
        e[k] = high - low;
    }
    return 2 * (e[0] * e[1] + e[1] * e[2] + e[2] * e[0]);
}

/* Turns a box about the normal in eight steps of 11.25 degrees and takes the least area. Returns the largest
 * of these areas over all first angles. */
static double worst_turned_area(const v3 *points, uint32_t count, v3 normal) {
    enum { TURNS = 8, STARTS = 40 };
    v3 t = v3_unit(v3_cross(normal, fabs(normal.x) < 0.6 ? (v3){1, 0, 0} : (v3){0, 1, 0})),
       b = v3_cross(normal, t);
    double worst = 0;
    for (int start = 0; start < STARTS; ++start) {
        double least = INFINITY;
        for (int turn = 0; turn < TURNS; ++turn) {
            double angle = pi / 2 * (turn + (double)start / STARTS) / TURNS;
            v3 u = v3_add(v3_scale(t, cos(angle)), v3_scale(b, sin(angle)));
            least = fmin(least, area_along(points, count, normal, u));
        }
        worst = fmax(worst, least);
    }
    return worst;
}

/* Random points and triangles, turned by any angles: sheets with bumps, or points in a box. */
static void boxes_are_the_least_of_their_frames(void **state) {
    (void)state;
    enum { POINTS = 24, FACES = 8 };
    uint32_t random = 3;
    for (int run = 0; run < 400; ++run) {
        float positions[3 * POINTS];
        uint8_t triangles[3 * FACES];
        v3 points[POINTS], axes[3], mean = {0, 0, 0}, vector = {0, 0, 0}, turn[3];
        double covariance[6] = {0}, values[3];
        for (int k = 0; k < 3; ++k)
            turn[k] =
                (v3){shape_random(&random) - 0.5, shape_random(&random) - 0.5, shape_random(&random) - 0.5};
        turn[0] = v3_unit(turn[0]), turn[1] = v3_unit(v3_cross(turn[0], turn[1]));
        turn[2] = v3_cross(turn[0], turn[1]);
        for (uint32_t i = 0; i < POINTS; ++i) {
            double thick = run % 2 ? 0.8 : 0.05, x[3] = {shape_random(&random), shape_random(&random), 0};
            if (run % 4 == 0) x[0] = i % 4 / 3.0, x[1] = i / 4 / 5.0; /* a rectangle */
            x[2] = thick * shape_random(&random);
            points[i] = v3_add(v3_add(v3_scale(turn[0], x[0]), v3_scale(turn[1], 0.7 * x[1])),
                               v3_scale(turn[2], x[2]));
            v3_store(positions + 3 * (size_t)i, points[i]);
            points[i] = v3_load(positions + 3 * (size_t)i);
            mean = v3_add(mean, v3_scale(points[i], 1.0 / POINTS));
        }
        for (uint32_t i = 0; i < 3 * FACES; ++i) triangles[i] = (uint8_t)i;
        for (uint32_t f = 0; f < FACES; ++f)
            vector = v3_add(vector, v3_cross(v3_sub(points[3 * f + 1], points[3 * f]),
                                             v3_sub(points[3 * f + 2], points[3 * f])));
        for (uint32_t i = 0; i < POINTS; ++i) sym3_add_outer(covariance, 1, v3_sub(points[i], mean));
        fct_eigen3(covariance, values, axes);
        fct_meshlet_bounds bounds;
        fct_meshlet_bound(positions, POINTS, triangles, FACES, &bounds);
        const float *h = bounds.box.half;
        double found =
            8 * ((double)h[0] * (double)h[1] + (double)h[1] * (double)h[2] + (double)h[2] * (double)h[0]);
        double least = fmin(worst_turned_area(points, POINTS, axes[0]),
                            worst_turned_area(points, POINTS, v3_unit(vector)));
        least = fmin(least, area_along(points, POINTS, (v3){1, 0, 0}, (v3){0, 1, 0}));
        if (found > 1.002 * least) fail_msg("run %d: the box has the area %g, not %g", run, found, least);
    }
}

static void bad_options_are_refused(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 2);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    for (int bad = 0; bad < 7; ++bad) {
        fct_meshlet_def def = fct_meshlet_def_default();
        fct_meshlets m;
        if (bad == 0) def.size = 4;
        if (bad == 1) def.max_vertices = 2;
        if (bad == 2) def.max_vertices = 257;
        if (bad == 3) def.max_triangles = 0;
        if (bad == 4) def.max_triangles = 513;
        if (bad == 5) def.flatness = -1;
        if (bad == 6) def.flatness = NAN;
        r.text[0] = 0;
        assert_int_equal(fct_tree_meshlets(&env, tree, &def, &m), FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, "expected"));
        assert_null(m.meshlets);
    }
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

/* A mesh with several regions that grow in parallel. */
static void same_for_every_thread_count(void **state) {
    (void)state;
    fct_env env = fct_env_default(), envs[3];
    fct_mesh mesh = make_sphere(&env, SANITIZED ? 30 : 190);
    roughen(&mesh, 0.001);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    fct_meshlet_def def = fct_meshlet_def_default();
    fct_meshlets m[3];
    for (uint32_t t = 0; t < 3; ++t) {
        envs[t] = env;
        envs[t].thread_count = t + 1;
        assert_int_equal(fct_tree_meshlets(&envs[t], tree, &def, &m[t]), FCT_OK);
        assert_int_equal(m[t].count, m[0].count);
        assert_memory_equal(m[t].meshlets, m[0].meshlets, m[0].count * sizeof *m[0].meshlets);
        assert_memory_equal(m[t].bounds, m[0].bounds, m[0].count * sizeof *m[0].bounds);
        assert_memory_equal(m[t].vertices, m[0].vertices, 4 * (size_t)m[0].vertex_count);
        assert_memory_equal(m[t].triangles, m[0].triangles, m[0].triangle_bytes);
        assert_memory_equal(m[t].faces, m[0].faces, 4 * (size_t)mesh.face_count);
    }
    check_layout(&mesh, &def, &m[0]);
    assert_true((double)m[0].vertex_count > 0.94 * 64 * m[0].count);
    for (int t = 0; t < 3; ++t) fct_meshlets_release(&envs[t], &m[t]);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void survives_no_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_sphere(&env, 10);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    fct_meshlet_def def = fct_meshlet_def_default();
    def.max_vertices = 4, def.max_triangles = 2; /* many meshlets, so that their arrays grow */
    long before = r.alive;
    fct_result result = FCT_ERROR_MEMORY;
    for (r.fail_at = 1; result != FCT_OK; ++r.fail_at) {
        fct_meshlets m;
        r.allocations = 0;
        result = fct_tree_meshlets(&env, tree, &def, &m);
        if (result == FCT_OK) {
            fct_meshlets_release(&env, &m);
        } else {
            assert_int_equal(result, FCT_ERROR_MEMORY);
            assert_null(m.meshlets);
        }
        assert_int_equal(r.alive, before);
    }
    assert_true(r.fail_at > 30);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_face_once_within_limits_and_bounds),
                                       cmocka_unit_test(bounds_hold_at_every_scale),
                                       cmocka_unit_test(meshlets_are_full_and_cones_cull),
                                       cmocka_unit_test(flatness_trades_shape_for_cones),
                                       cmocka_unit_test(materials_do_not_mix),
                                       cmocka_unit_test(the_smallest_ball),
                                       cmocka_unit_test(boxes_are_the_least_of_their_frames),
                                       cmocka_unit_test(bad_options_are_refused),
                                       cmocka_unit_test(same_for_every_thread_count),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
