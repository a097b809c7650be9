/* The error at each vertex: by its formula, against the check, and against the light of many rays. */
#include "../place.h"
#include "radiosity/output/blend.h"
#include "radiosity/output/error_map.h"
#include "radiosity/surface/tessellate.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static double pick(uint64_t a, uint64_t b, uint64_t c) {
    return fct_uniform(fct_hash3(a, b, c));
}

/* ---- The formula ---- */

/* A bumpy sheet with anchors of random light, and random light at its vertices. */
typedef struct bumps {
    fct_scene *scene;
    fct_solution s;
    fct_surface f;
    fct_anchors anchors;
    float *light;
    uint8_t *covered;
} bumps;

static const double reflectance[3] = {.2, .5, .9};

static void make_bumps(uint64_t seed, bool back, bumps *b) {
    const float at[12] = {1, 0, 0, 3, 0, 2, 0, -1, 0, 0, 1, 0};
    *b = (bumps){0};
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &b->scene), FCT_OK);
    fct_material paint = {.two_sided = true};
    for (int c = 0; c < 3; ++c) paint.reflectance[c] = (float)reflectance[c];
    uint32_t id;
    assert_int_equal(fct_scene_add_material(b->scene, &paint, &id), FCT_OK);
    fct_mesh mesh = make_bumpy(&plain, 9, .2);
    place_mesh(b->scene, &mesh, id, at);
    fct_mesh_release(&plain, &mesh);
    assert_int_equal(fct_scene_commit(b->scene), FCT_OK);
    b->s = (fct_solution){.env = &plain, .scene = b->scene, .def = fct_bake_def_default()};
    assert_int_equal(fct_elements_create(&plain, b->scene, 1, &b->s.elements), FCT_OK);
    assert_int_equal(fct_surface_build(&plain, SHADE(b->scene, 0), 10, &b->f), FCT_OK);
    const size_t vertices = b->f.mesh.vertex_count;
    b->light = malloc(3 * vertices * sizeof *b->light);
    b->covered = malloc(vertices);
    for (size_t v = 0; v < vertices; ++v) {
        b->covered[v] = pick(seed, v, 1) < .15;
        for (size_t c = 0; c < 3; ++c) b->light[3 * v + c] = (float)(2 + pick(seed, v, 2 + c));
    }
    b->anchors = (fct_anchors){.count = 40, .turn = .3};
    b->anchors.items = fct_allocate_zero(&plain, 40, sizeof *b->anchors.items);
    b->anchors.axes = fct_allocate_zero(&plain, 40, 1);
    for (uint32_t i = 0; i < 40; ++i) {
        fct_anchor *a = b->anchors.items + i;
        memcpy(a->position, b->f.sample_points + 3 * (size_t)(i * 7 % vertices), sizeof a->position);
        fct_surface_normal(&b->f, i * 7 % vertices, back, a->normal);
        a->reach = .5F, a->offset = 1e-3F;
        for (size_t c = 0; c < 3; ++c) a->irradiance[c] = (float)(1 + pick(seed, i, 10 + c));
    }
    fct_anchors_order(&b->anchors);
}

static void end_bumps(bumps *b) {
    free(b->light), free(b->covered);
    fct_anchors_release(&plain, &b->anchors);
    fct_surface_release(&plain, &b->f);
    fct_elements_release(&b->s.elements);
    fct_scene_destroy(b->scene);
}

/* Coordinates of a corner in the plane of a face with the edge p q as first axis, by Heron's formula. */
static void lay_flat(v3 p, v3 q, v3 r, double out[2]) {
    const double a = v3_norm(v3_sub(q, p)), b = v3_norm(v3_sub(r, p)), c = v3_norm(v3_sub(r, q));
    const double h = (a + b + c) / 2, area = sqrt(h * (h - a) * (h - b) * (h - c));
    out[0] = (a * a + b * b - c * c) / (2 * a), out[1] = 2 * area / a;
}

/* The squared tent over the edge: both faces laid flat, the light where the line between the corners meets
 * the edge. */
static void pitch_tent(const bumps *b, const uint32_t ids[4], double squares[3]) {
    v3 p[4];
    double c[2], d[2];
    for (int k = 0; k < 4; ++k) p[k] = v3_load(b->f.mesh.positions + 3 * (size_t)ids[k]);
    lay_flat(p[0], p[1], p[2], c), lay_flat(p[0], p[1], p[3], d);
    const double way = c[1] / (c[1] + d[1]),
                 along = (c[0] + way * (d[0] - c[0])) / v3_norm(v3_sub(p[1], p[0]));
    for (size_t k = 0; k < 3; ++k) {
        double e[4];
        for (int i = 0; i < 4; ++i) e[i] = b->light[3 * (size_t)ids[i] + k];
        squares[k] = pow(e[2] + way * (e[3] - e[2]) - (e[0] + along * (e[1] - e[0])), 2);
    }
}

/* The mean squared tent of the edges at a vertex that have two faces, by a search over all pairs of faces. */
static void mean_tents(const bumps *b, uint32_t v, double mean[3]) {
    const fct_mesh *m = &b->f.mesh;
    int count = 0;
    mean[0] = mean[1] = mean[2] = 0;
    for (uint32_t f = 0; f < m->face_count; ++f)
        for (uint32_t g = f + 1; g < m->face_count; ++g) {
            uint32_t shared[3], ids[4] = {0}, n = 0;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (m->triangles[3 * f + i] == m->triangles[3 * g + j])
                        shared[n++] = m->triangles[3 * f + i];
            if (n != 2 || (shared[0] != v && shared[1] != v)) continue;
            ids[0] = shared[0], ids[1] = shared[1];
            for (int i = 0; i < 3; ++i) {
                const uint32_t x = m->triangles[3 * f + i], y = m->triangles[3 * g + i];
                if (x != shared[0] && x != shared[1]) ids[2] = x;
                if (y != shared[0] && y != shared[1]) ids[3] = y;
            }
            if (b->covered[ids[0]] || b->covered[ids[1]] || b->covered[ids[2]] || b->covered[ids[3]])
                continue;
            double squares[3];
            pitch_tent(b, ids, squares);
            for (int k = 0; k < 3; ++k) mean[k] += squares[k];
            ++count;
        }
    for (int k = 0; k < 3 && count; ++k) mean[k] /= count;
}

/* The mean square over the faces that are not covered, from the middles of their edges. *area: of these. */
static double mean_square(const fct_mesh *m, const uint8_t *covered, const float *error, double *area) {
    double sum = 0;
    *area = 0;
    for (size_t f = 0; f < m->face_count; ++f) {
        const uint32_t *t = m->triangles + 3 * f;
        if (covered && covered[t[0]] && covered[t[1]] && covered[t[2]]) continue;
        const v3 a = v3_load(m->positions + 3 * (size_t)t[0]);
        const double part = .5 * v3_norm(v3_cross(v3_sub(v3_load(m->positions + 3 * (size_t)t[1]), a),
                                                  v3_sub(v3_load(m->positions + 3 * (size_t)t[2]), a)));
        for (int k = 0; k < 3; ++k)
            sum += part / 3 * pow(.5 * ((double)error[t[k]] + (double)error[t[(k + 1) % 3]]), 2);
        *area += part;
    }
    return sum / *area;
}

/* Without a check the map is the formula. A check scales it: 32 points of its own against the check's. */
static void maps_follow_the_formula(void **state) {
    (void)state;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        const bool back = seed % 2;
        bumps b;
        make_bumps(seed, back, &b);
        fct_mesh *m = &b.f.mesh;
        fct_check check = {0};
        const fct_error_map_def def = {&b.s, &b.f, 0, back, &b.anchors, b.light, b.covered, &check};
        uint64_t rays = 0, expected_rays = 0;
        double area, least = INFINITY, most = 0;
        assert_int_equal(fct_error_map_add(&def, m, &rays), FCT_OK);
        for (uint32_t v = 0; v < m->vertex_count; ++v) {
            double tents[3], variance[3], square = 0;
            float normal[3];
            if (b.covered[v]) {
                assert_true(m->error[v] == 0);
                continue;
            }
            fct_surface_normal(&b.f, v, back, normal);
            fct_anchors_variance(&b.anchors, &b.s.elements, b.f.sample_points + 3 * (size_t)v, normal,
                                 b.f.offsets[v], b.f.flat[v], variance, &expected_rays);
            mean_tents(&b, v, tents);
            for (int c = 0; c < 3; ++c)
                square +=
                    pow(reflectance[c], 2) / 3 *
                    (2 * variance[c] + .5 * tents[c] + pow(.003 * b.light[3 * (size_t)v + (size_t)c], 2));
            assert_near(m->error[v], sqrt(square), 1e-5 * sqrt(square));
            least = fmin(least, m->error[v]), most = fmax(most, m->error[v]);
        }
        assert_int_equal(rays, expected_rays);
        assert_true(most > 2 * least);
        const double own = mean_square(m, b.covered, m->error, &area);
        float *error = m->error;
        static const struct {
            double share; /* the measured square over the pattern's */
            uint64_t points;
            double factor; /* expected, on the square */
        } cases[] = {
            {4, 512, (4 * 512 + 32) / 544.}, {4, 16, (4 * 16 + 32) / 48.}, {0, 32, .5}, {-5, 512, 1 / 9.}};
        for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
            check =
                (fct_check){.area = area, .square = cases[i].share * own * area, .points = cases[i].points};
            assert_int_equal(fct_error_map_add(&def, m, &rays), FCT_OK);
            const double scaled = mean_square(m, b.covered, m->error, &area);
            assert_near(scaled / own, cases[i].factor, 1e-4 * cases[i].factor);
            for (uint32_t v = 0; v < m->vertex_count; ++v)
                assert_near(m->error[v], sqrt(cases[i].factor) * error[v], 1e-4 * error[v]);
            fct_memory_release(&plain, m->error);
        }
        m->error = error;
        end_bumps(&b);
    }
}

/* ---- Bakes ---- */

/* A room with a block on its floor, and a lamp below the ceiling. */
static fct_scene *make_room(const fct_env *env) {
    fct_scene *scene;
    assert_int_equal(fct_scene_create(env, FCT_BACKEND_OBB, &scene), FCT_OK);
    const uint32_t grey = place_material(scene, .6, 0, false);
    const v3 o = {0, 0, 0}, x = {2, 0, 0}, y = {0, 2, 0}, z = {0, 0, 2};
    place_sheet(env, scene, grey, 1, o, x, y);
    place_sheet(env, scene, grey, 1, o, y, z);
    place_sheet(env, scene, grey, 1, v3_add(o, y), x, v3_scale(z, 1));
    place_sheet(env, scene, place_material(scene, .5, 0, true), 1, v3_make(1, .3, 0), v3_make(.3, .6, 0),
                v3_make(0, 0, .8));
    place_sheet(env, scene, place_material(scene, 0, 20, false), 1, v3_make(.4, .4, 1.9), v3_make(0, .4, 0),
                v3_make(.4, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static fct_bake *start_bake(const fct_env *env, const fct_scene *scene, uint64_t seed) {
    fct_bake_def def = fct_bake_def_default();
    fct_bake *bake;
    def.outputs = FCT_MESH_ERROR, def.max_edge = .06, def.seed = seed;
    assert_int_equal(fct_bake_create(env, scene, &def, &bake), FCT_OK);
    return bake;
}

/* Over surfaces with many points, the RMS of the map is the error that the bake reports: 32 of 544 points are
 * the map's own. */
static void maps_agree_with_the_check(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene = make_room(&plain);
    double maps[3] = {0, 0, 0}, checks[3] = {0, 0, 0};
    for (uint64_t seed = 1; seed < 4; ++seed) {
        fct_bake *bake = start_bake(&plain, scene, seed);
        for (uint32_t object = 0; object < 3; ++object) {
            fct_mesh mesh;
            double area;
            assert_int_equal(fct_bake_object(bake, object, &mesh), FCT_OK);
            const fct_bake_error e = fct_bake_get_error(bake, object);
            maps[object] += mean_square(&mesh, NULL, mesh.error, &area);
            checks[object] += pow(e.error * e.light, 2);
            assert_near(area, e.area, .03 * area);
            fct_mesh_release(&plain, &mesh);
        }
        fct_bake_destroy(bake);
    }
    for (int k = 0; k < 3; ++k) {
        printf("    object %d: map %.5f, check %.5f\n", k, sqrt(maps[k] / 3), sqrt(checks[k] / 3));
        assert_near(sqrt(maps[k]), sqrt(checks[k]), .2 * sqrt(checks[k]));
    }
    fct_scene_destroy(scene);
}

typedef struct guess {
    double predicted, square;
} guess;

static int compare_guesses(const void *a, const void *b) {
    const double x = ((const guess *)a)->predicted, y = ((const guess *)b)->predicted;
    return (x > y) - (x < y);
}

/* Adds what the map of an object predicts in the middle of every other face, and the squared error there: the
 * product of the differences from probes of two bakes, whose noise is independent. */
static void guess_errors(fct_bake *bake, fct_bake *other, uint32_t object, guess **guesses, size_t *count) {
    static const float up[3][3] = {{0, 0, 1}, {1, 0, 0}, {0, -1, 0}};
    fct_mesh mesh;
    assert_int_equal(fct_bake_object(bake, object, &mesh), FCT_OK);
    const size_t faces = mesh.face_count / 2;
    float *points = calloc(3 * faces, sizeof *points), *normals = malloc(3 * faces * sizeof *normals);
    for (size_t f = 0; f < faces; ++f) {
        memcpy(normals + 3 * f, up[object], sizeof up[object]);
        for (size_t k = 0; k < 9; ++k)
            points[3 * f + k % 3] += mesh.positions[3 * (size_t)mesh.triangles[6 * f + k / 3] + k % 3] / 3;
    }
    fct_probe *truth = malloc(faces * sizeof *truth), *again = malloc(faces * sizeof *again);
    assert_int_equal(fct_bake_probe(bake, faces, points, normals, truth), FCT_OK);
    assert_int_equal(fct_bake_probe(other, faces, points, normals, again), FCT_OK);
    *guesses = realloc(*guesses, (*count + faces) * sizeof **guesses);
    for (size_t f = 0; f < faces; ++f) {
        guess g = {0, 0};
        for (size_t k = 0; k < 3; ++k) g.predicted += (double)mesh.error[mesh.triangles[6 * f + k]] / 3;
        for (size_t c = 0; c < 3; ++c) {
            double light = 0;
            for (size_t k = 0; k < 3; ++k)
                light += (double)mesh.colors[3 * (size_t)mesh.triangles[6 * f + k] + c] / 3;
            g.square += (light - (double)truth[f].radiosity[c]) * (light - (double)again[f].radiosity[c]) / 3;
        }
        if (truth[f].instance == object && g.predicted > 0) (*guesses)[(*count)++] = g;
    }
    free(points), free(normals), free(truth), free(again);
    fct_mesh_release(&plain, &mesh);
}

/* The light of probes, of many rays each, tells the true error in the middle of faces: where the map is
 * large, the error is. */
static void maps_predict_errors(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene = make_room(&plain);
    fct_bake *bake = start_bake(&plain, scene, 1), *other = start_bake(&plain, scene, 2);
    guess *guesses = NULL;
    size_t count = 0;
    for (uint32_t object = 0; object < 3; ++object) guess_errors(bake, other, object, &guesses, &count);
    qsort(guesses, count, sizeof *guesses, compare_guesses);
    enum { GROUPS = 5 };
    double found[GROUPS], predicted[GROUPS];
    for (size_t g = 0; g < GROUPS; ++g) {
        const size_t first = g * count / GROUPS, end = (g + 1) * count / GROUPS;
        found[g] = predicted[g] = 0;
        for (size_t i = first; i < end; ++i)
            found[g] += guesses[i].square, predicted[g] += pow(guesses[i].predicted, 2);
        found[g] = sqrt(fmax(found[g], 0) / (double)(end - first));
        predicted[g] = sqrt(predicted[g] / (double)(end - first));
        printf("    %zu faces: predicted %.5f, found %.5f\n", end - first, predicted[g], found[g]);
        assert_true(found[g] > .7 * predicted[g] && found[g] < 2.5 * predicted[g]);
        /* Of the smoothed light of penumbrae, the map sees the noise that is left, but not all of the error.
         * Measured: 1.8, 1.5, 1.2, 1.0, 1.6 times the prediction; each 1.1 times the group before or more. */
        if (g) assert_true(found[g] > 1.05 * found[g - 1]);
    }
    assert_true(found[GROUPS - 1] > 5 * found[0]);
    free(guesses);
    fct_bake_destroy(bake), fct_bake_destroy(other);
    fct_scene_destroy(scene);
}

static void threads_give_the_same_bytes(void **state) {
    (void)state;
    fct_mesh meshes[2];
    for (uint32_t k = 0; k < 2; ++k) {
        plain = fct_env_default();
        plain.thread_count = 1 + 2 * k;
        fct_scene *scene = make_room(&plain);
        fct_bake *bake = start_bake(&plain, scene, 1);
        assert_int_equal(fct_bake_mesh(bake, &meshes[k], NULL), FCT_OK);
        fct_bake_destroy(bake);
        fct_scene_destroy(scene);
    }
    assert_int_equal(meshes[0].vertex_count, meshes[1].vertex_count);
    assert_memory_equal(meshes[0].error, meshes[1].error, 4 * (size_t)meshes[0].vertex_count);
    for (int k = 0; k < 2; ++k) fct_mesh_release(&plain, &meshes[k]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(maps_follow_the_formula),
        cmocka_unit_test(maps_agree_with_the_check),
        cmocka_unit_test(maps_predict_errors),
        cmocka_unit_test(threads_give_the_same_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
