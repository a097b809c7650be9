/* Winding numbers and signed distances against closed forms and the sum of all solid angles. */
#include "packed.h"

#include "base/math/round.h"
#include "bvh/near/sign/crossings.h"
#include "bvh/near/sign/moments.h"
#include "bvh/near/sign/winding.h"

#define PI 3.14159265358979324

static model make_signed(const fct_env *env, fct_mesh mesh) {
    model m = {.mesh = mesh};
    fct_tree_def tree_def = fct_tree_def_default();
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_SIGN;
    assert_int_equal(fct_tree_build(env, &mesh, &tree_def, NULL, &m.tree), FCT_OK);
    assert_int_equal(fct_bvh_build(env, m.tree, &def, &m.bvh), FCT_OK);
    return m;
}

/* The solid angle of a triangle from its dihedral angles (Girard), another way than the library's. */
static double brute_angle(const v3 t[3], v3 p) {
    v3 d[3], n[3];
    double sum = -PI;
    for (int i = 0; i < 3; ++i) d[i] = v3_unit(v3_sub(t[i], p));
    for (int i = 0; i < 3; ++i) n[i] = v3_cross(d[i], d[(i + 1) % 3]);
    for (int i = 0; i < 3; ++i) {
        v3 a = v3_scale(n[(i + 2) % 3], -1), b = n[i];
        sum += atan2(v3_norm(v3_cross(a, b)), v3_dot(a, b));
    }
    return v3_dot(d[0], v3_cross(d[1], d[2])) < 0 ? -sum : sum;
}

static double brute_winding(const fct_mesh *mesh, v3 p) {
    double sum = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        v3 t[3];
        face_corners(mesh, f, t);
        if (v3_norm(v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0]))) > 1e-14) sum += brute_angle(t, p);
    }
    return sum / (4 * PI);
}

/* Removes a tenth of the faces. */
static fct_mesh make_holes(fct_mesh mesh) {
    uint32_t kept = 0;
    for (uint32_t f = 0; f < mesh.face_count; ++f)
        if (f % 10) memmove(mesh.triangles + 3 * kept++, mesh.triangles + 3 * f, 12);
    mesh.face_count = kept;
    return mesh;
}

static void flip_faces(fct_mesh *mesh) {
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        uint32_t kept = mesh->triangles[3 * f];
        mesh->triangles[3 * f] = mesh->triangles[3 * f + 1];
        mesh->triangles[3 * f + 1] = kept;
    }
}

static void agrees_with_all_faces(const fct_env *env, fct_mesh mesh, v3 offset, double size) {
    for (uint32_t v = 0; v < mesh.vertex_count; ++v)
        v3_store(mesh.positions + 3 * v, v3_add(offset, v3_scale(v3_load(mesh.positions + 3 * v), size)));
    model m = make_signed(env, mesh);
    uint64_t seed = 6;
    double worst = 0, worst_exact = 0, squares = 0;
    fct_visits visits = {0};
    uint32_t count = 400, negative = 0, checked = 0;
    for (uint32_t i = 0; i < count; ++i) {
        float point[3];
        v3_store(point, v3_mad(offset, size * 1.4 * random_unit(&seed), random_direction(&seed)));
        FCT_KEEP_STORED(point);
        double expected = brute_winding(&mesh, v3_load(point));
        double error = fabs(fct_bvh_winding_number(m.bvh, point, &visits) - expected);
        worst = fmax(worst, error), squares += error * error;
        double sum = fct_winding_sum(m.bvh, v3_load(point), INFINITY, NULL);
        worst_exact = fmax(worst_exact, fabs(sum - expected));
        fct_closest plain, with_sign;
        assert_true(fct_bvh_closest_point(m.bvh, point, INFINITY, &plain, NULL));
        assert_true(fct_bvh_signed_distance(m.bvh, point, INFINITY, &with_sign, NULL));
        if (fabs(fabs(expected) - .5) > 1e-5)
            ++checked, assert_int_equal(with_sign.distance<0, fabs(expected)> .5);
        negative += with_sign.distance < 0;
        with_sign.distance = fabsf(with_sign.distance);
        assert_memory_equal(&plain, &with_sign, sizeof plain);
    }
    assert_true(worst < 6e-4 && sqrt(squares / count) < 2.5e-4 && worst_exact < 1e-5);
    assert_true(checked > count - 5 && negative < count);
    assert_true(visits.nodes > count && visits.triangles < count * (uint64_t)mesh.face_count * 2 / 3);
    model_release(env, &m);
}

static void winding_numbers_agree_with_all_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    v3 zero = {0, 0, 0}, far = {300, -500, 200};
    fct_mesh inward = make_pebble(&env, 30, 5);
    flip_faces(&inward);
    agrees_with_all_faces(&env, make_pebble(&env, 30, 3), zero, 1);
    agrees_with_all_faces(&env, make_holes(make_pebble(&env, 30, 4)), zero, 1);
    agrees_with_all_faces(&env, inward, zero, 1e-3);
    agrees_with_all_faces(&env, make_bars(&env, 8, 3), zero, 1);
    agrees_with_all_faces(&env, make_soup(&env, 1500, 3), zero, 1);
    agrees_with_all_faces(&env, make_pebble(&env, 30, 6), far, 8);
}

/* Integrals over the faces under a child, about its centre. */
typedef struct integrals {
    v3 center;
    double area, n[3], nx[3][3], nxx[3][3][3], radius2;
} integrals;

/* The middles of the sides, with a third of the area each, integrate quadratic functions exactly. */
static void integrate_face(const v3 t[3], integrals *out) {
    v3 cross = v3_scale(v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0])), .5);
    double n[3] = {cross.x, cross.y, cross.z};
    out->area += v3_norm(cross);
    for (int c = 0; c < 3; ++c) {
        v3 middle = v3_sub(v3_scale(v3_add(t[c], t[(c + 1) % 3]), .5), out->center);
        double x[3] = {middle.x, middle.y, middle.z};
        out->radius2 = fmax(out->radius2, v3_norm2(v3_sub(t[c], out->center)));
        for (int i = 0; i < 3; ++i) {
            out->n[i] += n[i] / 3;
            for (int j = 0; j < 3; ++j) {
                out->nx[i][j] += n[i] * x[j] / 3;
                for (int k = 0; k < 3; ++k) out->nxx[i][j][k] += n[i] * x[j] * x[k] / 3;
            }
        }
    }
}

static void integrate_child(const fct_bvh *bvh, uint32_t child, integrals *out) {
    if (is_leaf(child)) {
        const fct_leaf *leaf = fct_bvh_leaf(bvh, child);
        for (uint32_t i = 0; i < leaf->count; ++i) {
            v3 t[3];
            fct_leaf_triangle(leaf, i, t);
            integrate_face(t, out);
        }
        return;
    }
    for (uint32_t i = 0; i < 8; ++i)
        if (bvh->moments[child].present >> i & 1) integrate_child(bvh, bvh->moments[child].child[i], out);
}

/* The traceless symmetric part of nx. */
static double second_moment(const integrals *m, int i, int j) {
    double trace = m->nx[0][0] + m->nx[1][1] + m->nx[2][2];
    return (m->nx[i][j] + m->nx[j][i]) / 2 - (i == j ? trace / 3 : 0);
}

static double symmetric_third(const integrals *m, int i, int j, int k) {
    return (m->nxx[i][j][k] + m->nxx[j][i][k] + m->nxx[k][i][j]) / 3;
}

static double third_moment(const integrals *m, int i, int j, int k) {
    double trace[3] = {0};
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) trace[a] += symmetric_third(m, a, b, b);
    return symmetric_third(m, i, j, k) -
           ((i == j ? trace[k] : 0) + (i == k ? trace[j] : 0) + (j == k ? trace[i] : 0)) / 5;
}

static void moments_are_integrals_over_the_surface(void **state) {
    (void)state;
    static const int second[5][2] = {{0, 0}, {1, 1}, {0, 1}, {0, 2}, {1, 2}};
    static const int third[7][3] = {{0, 0, 0}, {1, 1, 1}, {0, 0, 1}, {0, 1, 1},
                                    {0, 0, 2}, {1, 1, 2}, {0, 1, 2}};
    fct_env env = fct_env_default();
    model m = make_signed(&env, make_holes(make_pebble(&env, 24, 3)));
    size_t count = m.bvh->moment_bytes / sizeof(fct_moment_node);
    assert_true(count > 20);
    for (size_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < 8; ++k) {
            const fct_moment_node *node = &m.bvh->moments[i];
            if (!(node->present >> k & 1)) continue;
            integrals sum = {.center = {node->center[0][k], node->center[1][k], node->center[2][k]}};
            integrate_child(m.bvh, node->child[k], &sum);
            double radius2 = (double)node->radius2[k], radius = sqrt(radius2);
            assert_true(sum.radius2 <= radius2 && radius2 < 2.5 * sum.radius2);
            for (int a = 0; a < 3; ++a)
                assert_true(fabs((double)node->dipole[a][k] - sum.n[a]) < 1e-6 * sum.area);
            for (int a = 0; a < 5; ++a)
                assert_true(fabs((double)node->quadrupole[a][k] -
                                 second_moment(&sum, second[a][0], second[a][1])) < 1e-6 * sum.area * radius);
            for (int a = 0; a < 7; ++a)
                assert_true(fabs((double)node->octupole[a][k] -
                                 third_moment(&sum, third[a][0], third[a][1], third[a][2])) <
                            1e-6 * sum.area * radius2);
        }
    model_release(&env, &m);
}

/* The moments alone, without faces: a point far from everything. The next term is smaller by the third power
 * of radius over distance, against the solid angle of the model. */
static void moments_carry_the_far_field(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_soup(&env, 1200, 9);
    model m = make_signed(&env, mesh);
    uint64_t seed = 8;
    for (int i = 0; i < 60; ++i) {
        v3 p = v3_mad(v3_make(.5, .5, .5), 6, random_direction(&seed));
        fct_visits visits = {0};
        double expected = brute_winding(&mesh, p), got = fct_winding_sum(m.bvh, p, 3, &visits);
        assert_int_equal(visits.triangles, 0);
        assert_true(fabs(got - expected) < 2e-4 * .08 + .01 * fabs(expected));
    }
    model_release(&env, &m);
}

static void closed_forms_hold(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    /* The unit square from a height over its middle: 4 atan(1 / (4 h sqrt(h^2 + 1/2))). */
    model square = make_signed(&env, make_grid(&env, 24));
    for (int i = 0; i < 40; ++i) {
        double h = .01 * pow(1.2, i), expected = atan(1 / (4 * h * sqrt(h * h + .5))) / PI;
        float above[3] = {.5f, .5f, (float)h}, below[3] = {.5f, .5f, (float)-h};
        double up = fct_bvh_winding_number(square.bvh, above, NULL),
               down = fct_bvh_winding_number(square.bvh, below, NULL);
        assert_true(fabs(fabs(up) - expected) < 1e-4 + 1e-3 * expected && fabs(up + down) < 1e-5);
    }
    model_release(&env, &square);
    /* A sphere of radius 1: all points but those very near have the exact distance within the sagitta. */
    model sphere = make_signed(&env, make_sphere(&env, 60));
    uint64_t seed = 2;
    for (int i = 0; i < 500; ++i) {
        double radius = 2 * random_unit(&seed);
        float point[3];
        fct_closest near;
        v3_store(point, v3_scale(random_direction(&seed), radius));
        assert_true(fct_bvh_signed_distance(sphere.bvh, point, INFINITY, &near, NULL));
        assert_true(fabs((double)near.distance - (radius - 1)) < 2e-3);
        double w = fct_bvh_winding_number(sphere.bvh, point, NULL);
        if (fabs(radius - 1) > 2e-3) assert_true(fabs(w - (radius < 1)) < 1e-3);
    }
    model_release(&env, &sphere);
}

/* Points on both sides of each face, at a small fraction of its size. */
static void signs_are_right_near_the_surface(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pebble(&env, 24, 7);
    model m = make_signed(&env, mesh);
    uint64_t seed = 3;
    for (uint32_t f = 0; f < mesh.face_count; ++f) {
        v3 t[3];
        face_corners(&mesh, f, t);
        v3 n = v3_unit(v3_cross(v3_sub(t[1], t[0]), v3_sub(t[2], t[0])));
        double u = .1 + .3 * random_unit(&seed), v = .1 + .3 * random_unit(&seed);
        v3 at = v3_add(v3_scale(t[0], 1 - u - v), v3_add(v3_scale(t[1], u), v3_scale(t[2], v)));
        for (int side = -1; side <= 1; side += 2)
            for (double height = 1e-6; height < 1e-3; height *= 30) {
                float point[3];
                fct_closest near;
                v3_store(point, v3_mad(at, side * height, n));
                FCT_KEEP_STORED(point);
                double sum = fct_winding_sum(m.bvh, v3_load(point), INFINITY, NULL);
                if (f % 20 == 0) assert_true(fabs(sum - brute_winding(&mesh, v3_load(point))) < 2e-5);
                assert_true(fct_bvh_signed_distance(m.bvh, point, INFINITY, &near, NULL));
                if (fabs((double)near.distance) < height / 2) continue; /* another face is nearer */
                assert_true((double)near.distance * side > 0);
            }
        fct_closest on;
        assert_true(fct_bvh_signed_distance(m.bvh, mesh.positions + 3 * (size_t)mesh.triangles[3 * f],
                                            INFINITY, &on, NULL));
        assert_true(on.distance == 0 && !signbit(on.distance));
    }
    model_release(&env, &m);
}

/* Close to a side of a face both terms of its fraction vanish, and float would lose the angle. */
static void sums_are_right_near_sides(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_holes(make_pebble(&env, 16, 7));
    model m = make_signed(&env, mesh);
    uint64_t seed = 3;
    for (uint32_t f = 0; f < mesh.face_count; f += 2) {
        v3 t[3];
        float point[3];
        face_corners(&mesh, f, t);
        v3 side = v3_mad(t[0], random_unit(&seed), v3_sub(t[1], t[0]));
        v3_store(point, v3_mad(side, pow(10, -2 - 4 * random_unit(&seed)), random_direction(&seed)));
        FCT_KEEP_STORED(point);
        double sum = fct_winding_sum(m.bvh, v3_load(point), INFINITY, NULL);
        assert_true(fabs(sum - brute_winding(&mesh, v3_load(point))) < 2e-5);
    }
    model_release(&env, &m);
}

/* Over an open bowl |w| = .5 is a surface in the air. Next to it moments give wrong signs, and the sum of all
 * faces must decide. */
static void all_faces_decide_near_one_half(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 24);
    uint32_t kept = 0, misled = 0;
    for (uint32_t f = 0; f < mesh.face_count; ++f)
        if (mesh.positions[3 * (size_t)mesh.triangles[3 * f] + 2] < .3f)
            memmove(mesh.triangles + 3 * kept++, mesh.triangles + 3 * f, 12);
    mesh.face_count = kept;
    model m = make_signed(&env, mesh);
    uint64_t seed = 4;
    for (int i = 0; i < 60; ++i) {
        v3 in = {0, 0, -.5}, out = {random_unit(&seed) - .5, random_unit(&seed) - .5, 2};
        double low = 0, high = 1;
        for (int round = 0; round < 24; ++round) {
            double middle = (low + high) / 2;
            bool inside = brute_winding(&mesh, v3_mad(in, middle, v3_sub(out, in))) > .5;
            *(inside ? &low : &high) = middle;
        }
        for (int side = -1; side <= 1; side += 2) {
            float point[3];
            fct_closest near;
            v3_store(point, v3_mad(in, low + side * 2e-5, v3_sub(out, in)));
            FCT_KEEP_STORED(point);
            assert_true(fct_bvh_signed_distance(m.bvh, point, INFINITY, &near, NULL));
            assert_int_equal(near.distance < 0, side < 0);
            misled += (fct_bvh_winding_number(m.bvh, point, NULL) > .5) != (side < 0);
        }
    }
    assert_true(misled > 5);
    model_release(&env, &m);
}

/* Two overlapping spheres: inside of both the number is 2, and their inner walls are inside too. */
static void overlaps_count_twice(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh parts[2] = {make_sphere(&env, 20), make_sphere(&env, 20)}, mesh;
    for (uint32_t v = 0; v < parts[1].vertex_count; ++v) parts[1].positions[3 * v] += 1;
    assert_int_equal(fct_mesh_join(&env, parts, 2, &mesh), FCT_OK);
    fct_mesh_release(&env, &parts[0]);
    fct_mesh_release(&env, &parts[1]);
    model m = make_signed(&env, mesh);
    float both[3] = {.5f, .1f, 0}, wall[3] = {.02f, .02f, 0}, one[3] = {-.5f, 0, 0}, none[3] = {.5f, 1.2f, 0};
    fct_closest near;
    assert_true(fabs(fct_bvh_winding_number(m.bvh, both, NULL) - 2) < 1e-3);
    assert_true(fabs(fct_bvh_winding_number(m.bvh, one, NULL) - 1) < 1e-3);
    assert_true(fabs(fct_bvh_winding_number(m.bvh, none, NULL)) < 1e-3);
    assert_true(fct_bvh_signed_distance(m.bvh, wall, INFINITY, &near, NULL) && near.distance < 0);
    assert_true(fct_bvh_signed_distance(m.bvh, none, INFINITY, &near, NULL) && near.distance > 0);
    model_release(&env, &m);
}

/* The same bytes on any number of threads and from both variants. */
static void batches_agree_with_single_points(void **state) {
    (void)state;
    enum { COUNT = 2000 };
    fct_env env = fct_env_default();
    model m = make_signed(&env, make_holes(make_pebble(&env, 30, 3)));
    float *points = malloc(3 * COUNT * sizeof *points);
    fct_closest *out = malloc(COUNT * sizeof *out), single;
    uint64_t seed = 2;
    for (size_t i = 0; i < COUNT; ++i)
        v3_store(points + 3 * i, v3_scale(random_direction(&seed), 1.5 * random_unit(&seed)));
    for (env.thread_count = 1; env.thread_count < 4; ++env.thread_count) {
        fct_bvh_signed_distances(m.bvh, COUNT, points, .4f, out);
        for (size_t i = 0; i < COUNT; ++i) {
            fct_bvh_signed_distance(m.bvh, points + 3 * i, .4f, &single, NULL);
            assert_memory_equal(&single, &out[i], sizeof single);
        }
    }
#ifdef FCT_HAS_AVX2
    for (size_t i = 0; i < COUNT && fct_use_avx2; ++i) {
        v3 p = v3_load(points + 3 * i);
        double a = fct_winding_sum_baseline(m.bvh, p, 3, NULL), b = fct_winding_sum_avx2(m.bvh, p, 3, NULL);
        assert_memory_equal(&a, &b, sizeof a);
    }
#endif
    free(points), free(out);
    model_release(&env, &m);
}

static void without_the_part_there_is_no_answer(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model plain = model_make(&env, make_sphere(&env, 8), FCT_BACKEND_OBB),
          with_sign = make_signed(&env, make_sphere(&env, 8)), one = make_signed(&env, make_grid(&env, 1));
    float point[3] = {.1f, .2f, .3f}, bad[3] = {0, NAN, 0}, endless[3] = {0, INFINITY, 0};
    fct_closest near;
    assert_true(isnan(fct_bvh_winding_number(plain.bvh, point, NULL)));
    assert_false(fct_bvh_signed_distance(plain.bvh, point, INFINITY, &near, NULL));
    assert_true(near.face == FCT_NONE && near.distance == INFINITY);
    assert_true(isnan(fct_bvh_winding_number(with_sign.bvh, bad, NULL)));
    assert_true(isnan(fct_bvh_winding_number(with_sign.bvh, endless, NULL)));
    assert_false(fct_bvh_signed_distance(with_sign.bvh, bad, INFINITY, &near, NULL));
    assert_false(fct_bvh_signed_distance(with_sign.bvh, point, .01f, &near, NULL));
    assert_true(fct_bvh_bytes(with_sign.bvh) > fct_bvh_bytes(plain.bvh) + 600);
    fct_bvh_def def = fct_bvh_def_default();
    fct_bvh *embree;
    def.backend = FCT_BACKEND_EMBREE, def.parts = FCT_BVH_SIGN;
    assert_int_equal(fct_bvh_build(&env, plain.tree, &def, &embree), FCT_OK);
    assert_true(isnan(fct_bvh_winding_number(embree, point, NULL)));
    fct_bvh_destroy(embree);
    /* A model of one leaf, with a point above each face. */
    for (float h = 1e-4f; h < 1; h *= 10) {
        float above[3] = {.5f, .25f, h};
        double w = fct_bvh_winding_number(one.bvh, above, NULL);
        assert_true(fabs(w - brute_winding(&one.mesh, v3_load(above))) < 1e-6);
    }
    model_release(&env, &plain);
    model_release(&env, &with_sign);
    model_release(&env, &one);
}

/* Points above and below the insides of faces, nearer than a float resolves. */
static void signs_close_to_faces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pebble(&env, 12, 90);
    fct_tree *tree;
    fct_bvh *bvh;
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_SIGN;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    assert_int_equal(fct_bvh_build(&env, tree, &def, &bvh), FCT_OK);
    uint64_t seed = 91;
    for (uint32_t f = 0; f < mesh.face_count; ++f)
        for (double height = 1e-5; height > 1e-12; height /= 2.7) {
            v3 p[3];
            face_corners(&mesh, f, p);
            double u = .2 + .3 * random_unit(&seed), v = .2 + .3 * random_unit(&seed);
            v3 n = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
            v3 q = v3_add(v3_scale(p[0], 1 - u - v), v3_add(v3_scale(p[1], u), v3_scale(p[2], v)));
            assert_false(fct_winding_is_inside(bvh, v3_mad(q, height, n), NULL));
            assert_true(fct_winding_is_inside(bvh, v3_mad(q, -height, n), NULL));
        }
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

/* Turns over one face in so many. */
static fct_mesh turn_faces(fct_mesh mesh, uint32_t step) {
    for (uint32_t f = 0; f < mesh.face_count; f += step) {
        uint32_t kept = mesh.triangles[3 * f];
        mesh.triangles[3 * f] = mesh.triangles[3 * f + 1], mesh.triangles[3 * f + 1] = kept;
    }
    return mesh;
}

/* Each corner gets a vertex of its own; those at 0 get one of both signs. */
static fct_mesh split_vertices(const fct_env *env, fct_mesh mesh) {
    fct_mesh out;
    assert_int_equal(fct_mesh_create(env, 3 * mesh.face_count, mesh.face_count, 0, &out), FCT_OK);
    for (uint32_t c = 0; c < 3 * mesh.face_count; ++c) {
        out.triangles[c] = c;
        for (uint32_t k = 0; k < 3; ++k) {
            float x = mesh.positions[3 * mesh.triangles[c] + k];
            out.positions[3 * c + k] = x == 0 && c % 2 ? -x : x;
        }
    }
    fct_mesh_release(env, &mesh);
    return out;
}

static fct_mesh join_two(const fct_env *env, fct_mesh a, fct_mesh b) {
    fct_mesh parts[2] = {a, b}, mesh;
    assert_int_equal(fct_mesh_join(env, parts, 2, &mesh), FCT_OK);
    for (int i = 0; i < 2; ++i) fct_mesh_release(env, &parts[i]);
    return mesh;
}

/* A whole winding number from one ray, and an answer where no ray can tell. Points in rows hit many vertices.
 */
static void ray_tells(const fct_env *env, fct_mesh mesh, bool closed, bool winds) {
    model m = make_signed(env, mesh);
    assert_int_equal(m.bvh->is_closed, closed);
    uint64_t seed = 8;
    uint32_t inside = 0, told = 0, count = 700;
    float *points = malloc(12 * (size_t)count);
    uint64_t bits[11];
    for (uint32_t i = 0; i < count; ++i) {
        float *p = points + 3 * i;
        for (int k = 0; k < 3; ++k)
            p[k] = i % 2 ? (float)(2.4 * random_unit(&seed) - 1.2) : .25f * (float)((i / 2 >> 3 * k) % 8) - 1;
        double expected = brute_winding(&mesh, v3_load(p));
        int64_t number = 7;
        bool tells = fct_crossings_count(m.bvh, v3_load(p), &number, NULL);
        assert_true(closed || !tells);
        if (tells) assert_true(fabs(expected - (double)number) < 1e-5);
        told += tells;
        fct_closest near;
        assert_true(fct_bvh_closest_point(m.bvh, p, INFINITY, &near, NULL));
        if (near.distance > 1e-6f && fabs(fabs(expected) - .5) > 1e-5)
            assert_int_equal(fct_bvh_inside(m.bvh, p, NULL), fabs(expected) > .5);
        inside += fct_bvh_inside(m.bvh, p, NULL);
    }
    fct_bvh_inside_points(m.bvh, count, points, bits);
    for (uint32_t i = 0; i < count; ++i)
        assert_int_equal(bits[i / 64] >> i % 64 & 1, fct_bvh_inside(m.bvh, points + 3 * i, NULL));
    assert_true(inside < count && (inside > count / 20 || !winds));
    assert_true(told > (closed ? count * 3 / 4 : 0) || !closed);
    free(points);
    model_release(env, &m);
}

static void rays_count_crossings_of_closed_surfaces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh moved = make_sphere(&env, 16), above = make_grid(&env, 6);
    for (uint32_t v = 0; v < above.vertex_count; ++v) above.positions[3 * v + 2] += .1f; /* beside the rows */
    for (uint32_t v = 0; v < moved.vertex_count; ++v) moved.positions[3 * v] += .5f;
    ray_tells(&env, make_sphere(&env, 16), true, true);
    ray_tells(&env, turn_faces(make_sphere(&env, 16), 1), true, true);
    ray_tells(&env, split_vertices(&env, make_sphere(&env, 16)), true, true);
    ray_tells(&env, join_two(&env, make_sphere(&env, 16), moved), true, true);
    /* Twice, and once each way: windings of 2 and 0. */
    ray_tells(&env, join_two(&env, make_pebble(&env, 9, 2), make_pebble(&env, 9, 2)), true, true);
    ray_tells(&env, join_two(&env, make_pebble(&env, 9, 2), turn_faces(make_pebble(&env, 9, 2), 1)), true,
              false);
    ray_tells(&env, turn_faces(make_pebble(&env, 9, 2), 50), false, true);
    ray_tells(&env, make_holes(make_pebble(&env, 9, 2)), false, true);
    ray_tells(&env, above, false, false);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_count_crossings_of_closed_surfaces),
        cmocka_unit_test(signs_close_to_faces),
        cmocka_unit_test(winding_numbers_agree_with_all_faces),
        cmocka_unit_test(moments_are_integrals_over_the_surface),
        cmocka_unit_test(moments_carry_the_far_field),
        cmocka_unit_test(closed_forms_hold),
        cmocka_unit_test(signs_are_right_near_the_surface),
        cmocka_unit_test(sums_are_right_near_sides),
        cmocka_unit_test(all_faces_decide_near_one_half),
        cmocka_unit_test(overlaps_count_twice),
        cmocka_unit_test(batches_agree_with_single_points),
        cmocka_unit_test(without_the_part_there_is_no_answer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
