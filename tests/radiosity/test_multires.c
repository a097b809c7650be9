/* Bakes of scenes of several resolutions: closed forms, the output of exact rays, and work that does not grow
 * with the models. */
#include "support.h"

#include "base/math/vec.h"
#include "cluster/tree/node.h"
#include "facetree/radiosity.h"
#include "radiosity/bake.h"
#include "radiosity/output/solution.h"
#include "radiosity/solve/transport.h"
#include "scene/coarse.h"

static uint32_t add_material(fct_scene *scene, double reflectance, double emission) {
    fct_material m = {.name = "grey"};
    uint32_t id;
    for (int c = 0; c < 3; ++c) m.reflectance[c] = (float)reflectance, m.emission[c] = (float)emission;
    assert_int_equal(fct_scene_add_material(scene, &m, &id), FCT_OK);
    return id;
}

static double measure_face(const fct_mesh *mesh, uint32_t face) {
    v3 p[3];
    for (size_t k = 0; k < 3; ++k)
        p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + k]);
    return v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))) / 2;
}

static void turn_inside_out(fct_mesh *mesh) {
    for (size_t f = 0; f < mesh->face_count; ++f) {
        uint32_t *t = mesh->triangles + 3 * f, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
}

/* The inside of a sphere whose cap emits 1: the light elsewhere is rho ebar / (1 - rho) everywhere, because a
 * patch of a sphere lights all of the sphere alike. */
static void light_in_a_sphere_is_even(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&env, FCT_BACKEND_MULTIRES, &scene), FCT_OK);
    scene->patches = 1500;
    const uint32_t dark = add_material(scene, .5, 0), lamp = add_material(scene, .5, 1);
    fct_mesh ball = make_sphere(&env, 60);
    turn_inside_out(&ball);
    uint32_t *materials = calloc(ball.face_count, sizeof *materials);
    double lit = 0, all = 0;
    for (uint32_t f = 0; f < ball.face_count; ++f) {
        double z = 0;
        for (size_t k = 0; k < 3; ++k)
            z += (double)ball.positions[3 * (size_t)ball.triangles[3 * (size_t)f + k] + 2] / 3;
        materials[f] = z > .8 ? lamp : dark;
        lit += z > .8 ? measure_face(&ball, f) : 0, all += measure_face(&ball, f);
    }
    assert_int_equal(fct_scene_add_object(scene, "ball", &ball, NULL, NULL, 0, materials), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_ptr_not_equal(fct_scene_coarse(scene), scene);
    const double expected = .5 * (lit / all) / (1 - .5);

    fct_bake *bake;
    fct_bake_def def = fct_bake_def_default();
    assert_int_equal(fct_bake_create(&env, scene, &def, &bake), FCT_OK);
    const fct_bake_stats s = fct_bake_get_stats(bake);
    assert_true(s.converged);
    const double lost = s.power_emitted - s.power_absorbed - s.power_escaped;
    if (fabs(lost) > .005 * s.power_emitted) fail_msg("power lost: %g of %g", lost, s.power_emitted);
    double sum = 0, weight = 0, square = 0;
    for (uint32_t i = 0; i < fct_scene_get(scene).instance_count; ++i) {
        fct_mesh mesh;
        assert_int_equal(fct_bake_instance(bake, i, &mesh), FCT_OK);
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            const double area = measure_face(&mesh, f);
            for (size_t k = 0; k < 3; ++k) {
                const double b = (double)mesh.colors[3 * (size_t)mesh.triangles[3 * (size_t)f + k]];
                if (b > .9) continue; /* of the lamp, or between it and the rest */
                sum += area * b, weight += area, square += area * (b - expected) * (b - expected);
            }
        }
        fct_mesh_release(&env, &mesh);
    }
    if (fabs(sum / weight / expected - 1) > .01 || sqrt(square / weight) > .03 * expected)
        fail_msg("light %g (rms %g), expected %g", sum / weight, sqrt(square / weight), expected);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
    fct_mesh_release(&env, &ball);
    free(materials);
}

/* A room with a lamp and a bumpy body, which comes from a file. */
static fct_scene *make_room(const fct_env *env, uint32_t n, fct_backend backend) {
    fct_scene *scene;
    assert_int_equal(fct_scene_create(env, backend, &scene), FCT_OK);
    scene->patches = 2000;
    const uint32_t grey = add_material(scene, .6, 0), lamp = add_material(scene, 0, 20);
    fct_mesh room = make_sphere(env, 8), body = make_sphere(env, n), bulb = make_sphere(env, 4);
    fct_tree *tree, *open;
    turn_inside_out(&room);
    for (size_t v = 0; v < body.vertex_count; ++v) {
        float *p = body.positions + 3 * v;
        const double r = 1 + .1 * sin(6 * (double)p[0]) * sin(7 * (double)p[1]) * cos(5 * (double)p[2]);
        for (int k = 0; k < 3; ++k) p[k] = (float)(r * (double)p[k]);
    }
    assert_int_equal(fct_tree_build(env, &body, NULL, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_save(env, tree, "body.fct"), FCT_OK);
    assert_int_equal(fct_tree_open(env, "body.fct", &open), FCT_OK);
    fct_tree_destroy(tree);
    const float wide[12] = {3, 0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 0};
    const float high[12] = {.3F, 0, 0, 0, 0, .3F, 0, 0, 0, 0, .3F, 2};
    assert_int_equal(fct_scene_add_object(scene, "room", &room, NULL, wide, grey, NULL), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "body", NULL, open, NULL, grey, NULL), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "bulb", &bulb, NULL, high, lamp, NULL), FCT_OK);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_mesh_release(env, &room), fct_mesh_release(env, &body), fct_mesh_release(env, &bulb);
    return scene;
}

/* Points of a patch lie within the outline: evenly over the rectangle, shrunk to the area of the cluster's
 * outline about its middle. Rays start four half heights above it. */
static void points_lie_within_the_outline(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_scene *scene = make_room(&env, 40, FCT_BACKEND_MULTIRES);
    const fct_scene *coarse = fct_scene_coarse(scene);
    const fct_coarse *c = fct_scene_coarse_model(coarse, 1);
    assert_non_null(c);
    const fct_tree_view view = fct_tree_get(c->tree);
    fct_elements set;
    assert_int_equal(fct_elements_create(&env, coarse, 100, &set), FCT_OK);
    for (uint32_t id = 0; id < set.count && set.count < 3000; ++id)
        if (set.items[id].kind != FCT_ELEMENT_VOLUME && fct_elements_can_split(&set, id))
            assert_int_equal(fct_elements_split(&set, id), FCT_OK);
    int tested = 0;
    for (uint32_t id = 0; id < set.count; ++id) {
        const fct_element *e = &set.items[id];
        if (e->instance != 1 || e->kind != FCT_ELEMENT_CLUSTER || e->node < c->top_count) continue;
        assert_false(fct_elements_can_split(&set, id));
        const uint32_t place = fct_node_first(c->tree, e->node), patch = c->patches[place];
        const uint32_t *t = view.triangles + 3 * (size_t)place;
        v3 q[3], mean = {0, 0, 0};
        for (int k = 0; k < 3; ++k) q[k] = v3_load(view.positions + 3 * (size_t)t[k]);
        const v3 u = v3_sub(q[1], q[0]), v = v3_sub(q[2], q[1]), middle = v3_scale(v3_add(q[0], q[2]), .5);
        const double shrink = sqrt((double)c->fill[patch]), n = 400;
        double widest[2] = {0, 0};
        for (int k = 0; k < n; ++k) {
            fct_element_point p;
            fct_element_sample(&set, id, (k + .5) / n, fmod(.618034 * k, 1), fmod(.754878 * k, 1), &p);
            const v3 d = v3_sub(v3_load(p.position), middle);
            mean = v3_mad(mean, 1 / n, d);
            widest[0] = fmax(widest[0], fabs(v3_dot(d, u)) / v3_norm2(u));
            widest[1] = fmax(widest[1], fabs(v3_dot(d, v)) / v3_norm2(v));
            const double above = 4 * (double)c->height[patch];
            assert_true(p.offset >= above && p.offset < above * 1.001 + 2e-4 * v3_norm(u) + 1e-5);
        }
        for (int k = 0; k < 2; ++k) /* shares of the sides, u and v are at right angles */
            if (widest[k] > .5 * shrink + 1e-3 || widest[k] < .45 * shrink)
                fail_msg("%g, %g", widest[k], shrink);
        assert_true(v3_norm(mean) < .03 * shrink * (v3_norm(u) + v3_norm(v)));
        ++tested;
    }
    assert_true(tested > 300);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* A ray that slips between the patches of a closed body finds the front of a patch, not a black back; so do
 * all rays from the middle of the body. */
static void a_closed_body_has_no_black_back(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_scene *scene = make_room(&env, 40, FCT_BACKEND_MULTIRES);
    fct_elements set;
    assert_int_equal(fct_elements_create(&env, fct_scene_coarse(scene), 100, &set), FCT_OK);
    float *stored = calloc(3 * set.count, sizeof *stored);
    const float middle[3] = {0, 0, 0};
    for (int k = 0; k < 200; ++k) {
        const double z = (k + .5) / 100 - 1, r = sqrt(1 - z * z);
        float direction[3];
        v3_store(direction, v3_make(r * cos(2.4 * k), r * sin(2.4 * k), z));
        const fct_found found = fct_transport_look(&set, stored, middle, direction);
        assert_true(!found.black && found.leaf < set.count);
        assert_int_equal(set.items[found.leaf].instance, 1);
    }
    free(stored);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

static fct_bake *solve(const fct_env *env, const fct_scene *scene, fct_bake_stats *stats) {
    fct_bake *bake;
    const fct_bake_def def = fct_bake_def_default();
    assert_int_equal(fct_bake_create(env, scene, &def, &bake), FCT_OK);
    *stats = fct_bake_get_stats(bake);
    printf("    %u patches: %llu elements, %llu rays, %.0f KiB read; power %g emitted, %g absorbed, %g "
           "escaped\n",
           scene->patches, (unsigned long long)stats->elements, (unsigned long long)stats->rays,
           (double)stats->touched_bytes / 1024, stats->power_emitted, stats->power_absorbed,
           stats->power_escaped);
    return bake;
}

/* Four times the faces: the same elements, rays and pages, within 5 %. The exact solution reads more. */
static void work_does_not_grow(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_bake_stats small, large, exact;
    const uint32_t n = SANITIZED ? 40 : 70;
    fct_scene *a = make_room(&env, n, FCT_BACKEND_MULTIRES),
              *b = make_room(&env, 2 * n, FCT_BACKEND_MULTIRES), *c = make_room(&env, 2 * n, FCT_BACKEND_OBB);
    fct_bake_destroy(solve(&env, a, &small));
    fct_bake_destroy(solve(&env, b, &large));
    fct_bake_destroy(solve(&env, c, &exact));
    assert_true(fabs((double)large.elements / (double)small.elements - 1) < .05);
    assert_true(fabs((double)large.rays / (double)small.rays - 1) < .05);
    /* The smaller file of the sanitized test is read nearly as a whole. */
    assert_true((double)large.touched_bytes < (SANITIZED ? 1.5 : 1.1) * (double)small.touched_bytes);
    assert_true(exact.touched_bytes > 3 * large.touched_bytes / 2);
    fct_scene_destroy(a), fct_scene_destroy(b), fct_scene_destroy(c);
}

/* After the solution, elements refer to nodes and places of the model, and none of them is a part of a patch.
 */
static void elements_refer_to_the_model(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_bake_stats stats;
    fct_scene *scene = make_room(&env, 40, FCT_BACKEND_MULTIRES);
    const fct_coarse *c = fct_scene_coarse_model(fct_scene_coarse(scene), 1);
    fct_bake *bake = solve(&env, scene, &stats);
    const fct_elements *set = &fct_bake_solution(bake)->elements;
    for (size_t id = 0; id < set->count; ++id)
        if (set->items[id].instance == 1 && set->items[id].kind == FCT_ELEMENT_CLUSTER &&
            set->items[id].node >= c->top_count)
            assert_int_equal(set->items[id].child_count, 0);
    uint32_t *before = calloc(set->count, sizeof *before);
    for (size_t id = 0; id < set->count; ++id) before[id] = set->items[id].node;
    fct_mesh mesh;
    assert_int_equal(fct_bake_instance(bake, 0, &mesh), FCT_OK);
    fct_mesh_release(&env, &mesh);
    assert_ptr_equal(set->scene, scene);
    int patches = 0;
    for (size_t id = 0; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->instance != 1) continue;
        const fct_tree *tree = set->view.models[1].tree;
        assert_int_equal(e->node, fct_coarse_origin(c, before[id]));
        assert_int_equal(set->ranges[id].first, fct_node_first(tree, e->node));
        assert_int_equal(set->ranges[id].count, fct_node_faces(tree, e->node));
        patches += before[id] >= c->top_count;
    }
    assert_true(patches > 100);
    free(before);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
}

/* Output and probes use the models themselves: light differs from that of an exact solution as little as two
 * seeds of it do. Every vertex has a leaf, so none is black. */
static void output_is_that_of_exact_rays(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    fct_bake_stats stats;
    fct_scene *scenes[2] = {make_room(&env, 40, FCT_BACKEND_OBB), make_room(&env, 40, FCT_BACKEND_MULTIRES)};
    double light[2][400][3];
    float points[400 * 3], normals[400 * 3];
    for (size_t i = 0; i < 400; ++i) { /* on the room and on the body */
        const double z = 2 * (i + .5) / 400 - 1, a = 2.4 * (double)i, r = sqrt(1 - z * z);
        const v3 d = v3_make(r * cos(a), r * sin(a), z);
        v3_store(points + 3 * i, v3_scale(d, i % 2 ? 2.9 : 1.2));
        v3_store(normals + 3 * i, v3_scale(d, i % 2 ? -1 : 1));
    }
    for (int k = 0; k < 2; ++k) {
        fct_bake *bake = solve(&env, scenes[k], &stats);
        fct_probe found[400];
        assert_int_equal(fct_bake_probe(bake, 400, points, normals, found), FCT_OK);
        for (size_t i = 0; i < 400; ++i)
            for (int c = 0; c < 3; ++c) light[k][i][c] = (double)found[i].irradiance[c];
        fct_mesh mesh;
        assert_int_equal(fct_bake_instance(bake, 1, &mesh), FCT_OK);
        for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i) assert_true(mesh.colors[i] > 0);
        fct_mesh_release(&env, &mesh);
        fct_bake_destroy(bake);
    }
    double square = 0, mean = 0, bias = 0;
    for (size_t i = 0; i < 400; ++i) {
        square += (light[0][i][0] - light[1][i][0]) * (light[0][i][0] - light[1][i][0]) / 400;
        bias += (light[1][i][0] - light[0][i][0]) / 400, mean += light[0][i][0] / 400;
    }
    if (fabs(bias) > .004 * mean || sqrt(square) > .02 * mean)
        fail_msg("bias %g, rms %g of %g", bias, sqrt(square), mean);
    fct_scene_destroy(scenes[0]), fct_scene_destroy(scenes[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_in_a_sphere_is_even),    cmocka_unit_test(points_lie_within_the_outline),
        cmocka_unit_test(elements_refer_to_the_model),  cmocka_unit_test(work_does_not_grow),
        cmocka_unit_test(output_is_that_of_exact_rays), cmocka_unit_test(a_closed_body_has_no_black_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
