/* Contractions of faces: costs against sums over the input's faces, and which corners move where. */
#include "levels.h"
#include "oracle.h"
#include "simplify/contract.h"
#include "simplify/cost/constraint.h"
#include "simplify/cost/face.h"
#include "simplify/log.h"

static fct_env env;

static fct_simplify_def faces_def(void) {
    fct_simplify_def def = fct_simplify_def_default();
    def.primitive = FCT_PRIMITIVE_FACE;
    return def;
}

/* A closed surface without symmetry. */
static fct_mesh make_rough(uint32_t n, double noise) {
    fct_mesh mesh = make_sphere(&env, n);
    uint64_t seed = 11;
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i)
        mesh.positions[i] += (float)between(&seed, -noise, noise) / (float)n;
    return mesh;
}

static fct_mesh make_lumps(uint32_t n) {
    return make_rough(n, .2);
}

/* What the contraction of three vertices minimises, as a dense system A p = b with the constant c. Each of
 * the vertices adds its faces. A face adds the squared distance from its plane (3.10), times a third of its
 * area.
 */
typedef struct dense {
    double a[9], b[3], c;
} dense;

static dense add_faces(const fct_mesh *mesh, const uint32_t *vertices) {
    dense sum = {0};
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        v3 p[3];
        for (int k = 0; k < 3; ++k) p[k] = scaled_vertex(mesh, mesh->triangles[3 * f + (uint32_t)k]);
        v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        double n[3], area = .5 * v3_norm(cross), offset;
        v3_to_array(v3_unit(cross), n);
        offset = n[0] * p[0].x + n[1] * p[0].y + n[2] * p[0].z;
        for (int k = 0; k < 9; ++k) {
            if (mesh->triangles[3 * f + (uint32_t)k / 3] != vertices[k % 3]) continue;
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 3; ++j) sum.a[3 * i + j] += area / 3 * n[i] * n[j];
                sum.b[i] += area / 3 * n[i] * offset;
            }
            sum.c += area / 3 * offset * offset;
        }
    }
    return sum;
}

static double dense_value(const dense *d, const double p[3]) {
    double value = d->c;
    for (int i = 0; i < 3; ++i) {
        value -= 2 * d->b[i] * p[i];
        for (int j = 0; j < 3; ++j) value += d->a[3 * i + j] * p[i] * p[j];
    }
    return value;
}

/* The minimum about the middle of the corners, with the ridge gamma trace(A), and its cost with the energy.
 */
static double dense_minimum(const dense *d, double gamma, const v3 corners[3], double at[3]) {
    double a[9], ridge = gamma * (d->a[0] + d->a[4] + d->a[8]), energy = 0, middle[3];
    v3_to_array(v3_scale(v3_add(v3_add(corners[0], corners[1]), corners[2]), 1. / 3), middle);
    memcpy(a, d->a, sizeof a);
    for (int i = 0; i < 3; ++i) a[4 * i] += ridge, at[i] = d->b[i] + ridge * middle[i];
    solve_dense(3, a, at);
    for (int k = 0; k < 3; ++k)
        energy += .5 * ridge * v3_norm2(v3_sub((v3){at[0], at[1], at[2]}, corners[k]));
    return dense_value(d, at) + energy;
}

/* The least value, with its energy, at the corners and, if `middles`, at the middles of the sides and of the
 * face. */
static double least_of_places(const dense *d, const v3 corners[3], bool middles, double gamma) {
    double least = INFINITY, cost = 0, ridge = gamma * (d->a[0] + d->a[4] + d->a[8]);
    for (int i = 0; i < 27; ++i) { /* weights of the corners, in sixths; the first place is the middle */
        const int w[3] = {i == 0 ? 2 : i % 3 * 3, i == 0 ? 2 : i / 3 % 3 * 3, i == 0 ? 2 : i / 9 * 3};
        if (w[0] + w[1] + w[2] != 6 || (!middles && w[0] != 6 && w[1] != 6 && w[2] != 6)) continue;
        v3 p = {0, 0, 0};
        double energy = 0;
        for (int k = 0; k < 3; ++k) p = v3_mad(p, w[k] / 6., corners[k]);
        for (int k = 0; k < 3; ++k) energy += .5 * ridge * v3_norm2(v3_sub(p, corners[k]));
        double value = dense_value(d, (double[3]){p.x, p.y, p.z});
        if (value < least) least = value, cost = value + energy;
    }
    return cost;
}

static double cost_of_side(fct_simplifier *s, uint32_t f, uint32_t side) {
    const uint32_t *t = s->triangles + 3 * (size_t)f;
    fct_candidate edge;
    assert_true(fct_place(s, t[side], t[(side + 1) % 3], false, &edge));
    return edge.key;
}

/* A rough part of a cone. Its planes nearly meet in the apex, which is far from most faces. */
static fct_mesh make_cone(void) {
    fct_mesh mesh = make_grid(&env, 14);
    uint64_t seed = 5;
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * v;
        double turn = 1.5 * (double)p[0], height = .1 + (double)p[1] + between(&seed, 0, .0005);
        p[0] = (float)(height * cos(turn)), p[1] = (float)(height * sin(turn));
        p[2] = (float)(height + between(&seed, 0, .0005));
    }
    return mesh;
}

/* Without attributes the price is the minimum over all faces at the three corners, and more than that of each
 * edge. If it is more than two sides away, the best of seven places counts. The sides are in the order of
 * their costs. */
static void prices_are_minima_of_three_quadrics(void **state) {
    (void)state;
    uint32_t near = 0, beyond = 0, far = 0;
    for (int kind = 0; kind < 3; ++kind) {
        fct_mesh mesh = kind < 2 ? make_lumps(9) : make_cone();
        fct_simplify_def def = faces_def();
        def.boundary_weight = 0;
        if (kind == 1) def.regularization = .01;
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        uint32_t exact = 0;
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            const uint32_t *t = s->mesh->triangles + 3 * f;
            v3 corners[3];
            double at[3], most = 0, last = 0, longest = 0;
            for (int k = 0; k < 3; ++k) corners[k] = scaled_vertex(s->mesh, t[k]);
            for (int k = 0; k < 3; ++k)
                longest = fmax(longest, v3_norm(v3_sub(corners[k], corners[(k + 1) % 3])));
            dense d = add_faces(s->mesh, t);
            double want = dense_minimum(&d, def.regularization, corners, at);
            v3 middle = v3_scale(v3_add(v3_add(corners[0], corners[1]), corners[2]), 1. / 3);
            double reach = v3_norm(v3_sub((v3){at[0], at[1], at[2]}, middle)) / longest;
            ++*(reach < 1 ? &near : reach < 2 ? &beyond : &far);
            if (reach > 2) want = least_of_places(&d, corners, true, def.regularization);
            fct_face_price price;
            assert_true(fct_price_face(s, s->triangles + 3 * f, &price));
            uint32_t seen = 0;
            for (int k = 0; k < 3; ++k) {
                double key = cost_of_side(s, f, price.order[k]);
                assert_true(key >= last);
                last = key, most = fmax(most, key), seen |= 1u << price.order[k];
            }
            assert_int_equal(seen, 7);
            assert_ratio(price.key, fmax(want, most), kind < 2 ? 1e-6 : 1e-4);
            exact += want > most;
        }
        assert_true(exact > .6 * mesh.face_count);
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(near > 100 && beyond > 10 && far > 10);
}

/* By the other policies the price is the least value at their places. */
static void prices_follow_the_placement(void **state) {
    (void)state;
    fct_mesh mesh = make_lumps(9);
    for (fct_placement policy = FCT_PLACE_SEGMENT; policy <= FCT_PLACE_SUBSET; ++policy) {
        fct_simplify_def def = faces_def();
        def.placement = policy;
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        uint32_t exact = 0;
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            const uint32_t *t = s->mesh->triangles + 3 * f;
            dense d = add_faces(s->mesh, t);
            v3 corners[3];
            for (int k = 0; k < 3; ++k) corners[k] = scaled_vertex(s->mesh, t[k]);
            double least = least_of_places(&d, corners, policy != FCT_PLACE_SUBSET, 0), most = 0;
            for (uint32_t k = 0; k < 3; ++k) most = fmax(most, cost_of_side(s, f, k));
            fct_face_price price;
            assert_true(fct_price_face(s, s->triangles + 3 * f, &price));
            assert_ratio(price.key, fmax(least, most), 1e-5);
            exact += least > most;
        }
        assert_true(exact > .5 * mesh.face_count);
        fct_simplifier_destroy(s);
    }
    fct_mesh_release(&env, &mesh);
}

/* The first contraction is that of a face whose price is at most an eighth above the least one. Its corners
 * become one vertex at the minimum of the three quadrics, and four faces vanish. */
static void the_cheapest_face_becomes_its_minimum(void **state) {
    (void)state;
    fct_mesh mesh = make_lumps(9);
    fct_simplify_def def = faces_def();
    def.target_faces = mesh.face_count - 4;
    def.refit_passes = 0;
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    double least = INFINITY;
    for (uint32_t f = 0; f < mesh.face_count; ++f) {
        fct_face_price price;
        assert_true(fct_price_face(s, s->triangles + 3 * f, &price));
        least = fmin(least, price.key);
    }
    fct_stop stop;
    assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
    assert_int_equal(s->live_faces, def.target_faces);
    uint32_t moved = FCT_NONE, corners[3], count = 0;
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        uint32_t p = s->point_of[v];
        if (point_at(s, fct_sets_find(s->point_parents, p))->source != FCT_NONE) continue;
        assert_true(count < 3);
        corners[count++] = v, moved = fct_sets_find(s->point_parents, p);
    }
    assert_int_equal(count, 3);
    uint32_t faces = 0;
    for (uint32_t f = 0; f < mesh.face_count; ++f) {
        const uint32_t *t = s->mesh->triangles + 3 * f;
        uint32_t found = 0;
        for (int k = 0; k < 9; ++k) found += t[k / 3] == corners[k % 3];
        faces += found == 3;
    }
    assert_int_equal(faces, 1);
    dense d = add_faces(s->mesh, corners);
    v3 from[3], got = point_position(s, moved);
    double at[3];
    for (int k = 0; k < 3; ++k) from[k] = scaled_vertex(s->mesh, corners[k]);
    assert_true(dense_minimum(&d, def.regularization, from, at) < 1.13 * least);
    assert_true(v3_norm(v3_sub(got, (v3){at[0], at[1], at[2]})) < 1e-6);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

/* Nearly all contractions come in twos: the second one begins at the point of the first. On the rough mesh
 * this is so because refused faces return. */
static void faces_are_contracted_as_a_whole(void **state) {
    (void)state;
    fct_mesh lumps = make_lumps(30), other = make_lumps(30),
             colored = with_arrays(&env, &other, FCT_MESH_COLORS);
    uint64_t seed = 3;
    for (uint32_t v = 0; v < colored.vertex_count; ++v)
        for (int k = 0; k < 3; ++k)
            colored.colors[3 * v + (uint32_t)k] =
                (float)(.5 + .4 * sin(3 * (double)colored.positions[3 * v + (uint32_t)k]) +
                        .1 * uniform(&seed));
    fct_mesh rough = make_rough(30, .9), *meshes[] = {&lumps, &colored, &rough};
    for (int i = 0; i < 3; ++i) {
        fct_simplify_def def = faces_def();
        def.target_faces = meshes[i]->face_count / (i < 2 ? 10 : 87);
        fct_simplifier *s = open_simplifier(&env, meshes[i], &def);
        assert_int_equal(fct_log_create(s), FCT_OK);
        fct_stop stop;
        assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
        assert_int_equal(stop, FCT_STOP_FACES);
        assert_true(s->live_faces <= def.target_faces && s->live_faces + 3 > def.target_faces);
        uint32_t whole = 0, count = s->log->count;
        for (uint32_t r = 0; r + 1 < count; ++r) {
            const fct_record *first = &s->log->records[r], *second = first + 1;
            if (second->kept != first->kept && second->gone != first->kept) continue;
            ++whole, ++r;
        }
        assert_true(2 * whole > (i < 2 ? .98 : .96) * count);
        fct_simplifier_destroy(s);
    }
    for (int i = 0; i < 3; ++i) fct_mesh_release(&env, meshes[i]);
}

/* Errors: larger than those of edges, but of the same order; max_error is obeyed. */
static void errors_are_near_those_of_edges(void **state) {
    (void)state;
    fct_mesh mesh = make_lumps(40);
    double rms[2];
    for (int kind = 0; kind < 2; ++kind) {
        fct_simplify_def def = fct_simplify_def_default();
        def.primitive = kind ? FCT_PRIMITIVE_FACE : FCT_PRIMITIVE_EDGE;
        def.target_faces = 400;
        fct_simplify_stats stats;
        fct_mesh out = simplified(&env, &mesh, &def, &stats);
        assert_true(out.face_count <= 400 && open_sides(&out, NULL) == 0);
        assert_ratio(mesh_volume(&out), mesh_volume(&mesh), .02);
        rms[kind] = stats.distance_rms;
        fct_mesh_release(&env, &out);
        def.target_faces = 0, def.max_error = .5 * stats.max_cost;
        out = simplified(&env, &mesh, &def, &stats);
        assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
        assert_true(stats.max_cost <= def.max_error && stats.max_cost > .7 * def.max_error);
        fct_mesh_release(&env, &out);
    }
    assert_true(rms[1] > rms[0] && rms[1] < 1.5 * rms[0]);
    fct_mesh_release(&env, &mesh);
}

/* Locks, borders, seams and creases hold, levels repeat the contractions, and threads change nothing. */
static void rules_hold_for_faces(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_grid(&env, 20), make_torus(&env, 20, true, true)};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        fct_mesh *mesh = &meshes[i];
        uint8_t *locks = calloc(mesh->vertex_count, 1);
        for (uint32_t v = 0; v < mesh->vertex_count; v += 31) locks[v] = 1;
        fct_simplify_def def = faces_def();
        def.locks = locks, def.target_faces = mesh->face_count / 8;
        fct_mesh outs[2];
        for (uint32_t threads = 0; threads < 2; ++threads) {
            fct_env own = env;
            own.thread_count = 1 + 3 * threads;
            outs[threads] = simplified(&own, mesh, &def, NULL);
        }
        assert_true(same_mesh(&outs[0], &outs[1]));
        for (uint32_t v = 0; v < mesh->vertex_count; v += 31) {
            bool found = false;
            for (uint32_t w = 0; w < outs[0].vertex_count && !found; ++w)
                found = !memcmp(mesh->positions + 3 * v, outs[0].positions + 3 * w, 3 * sizeof(float));
            assert_true(found);
        }
        if (i == 1) assert_int_equal(open_sides(&outs[0], NULL), 0);
        for (uint32_t v = 0; v < outs[0].vertex_count && i == 0; ++v)
            for (int k = 0; k < 2; ++k) {
                double x = (double)outs[0].positions[3 * v + (uint32_t)k];
                assert_true(x >= -1e-6 && x <= 1 + 1e-6);
            }
        if (i == 0) assert_ratio(mesh_area(&outs[0]), 1, 1e-6);
        def.refit_passes = 0;
        fct_progressive *m = progressive_of(&env, mesh, def, def.target_faces);
        fct_mesh base = level_mesh(m, 0), finest = level_mesh(m, FCT_NONE),
                 plain = simplified(&env, mesh, &def, NULL);
        assert_true(same_faces(&base, &plain));
        assert_int_equal(finest.face_count, mesh->face_count);
        fct_mesh *all[] = {&base, &finest, &plain, &outs[0], &outs[1], mesh};
        for (size_t k = 0; k < FCT_LENGTH(all); ++k) fct_mesh_release(&env, all[k]);
        fct_progressive_destroy(m);
        free(locks);
    }
}

/* Later levels price faces whose wedges were joined before; threads change nothing there, either. */
static void levels_are_the_same_for_all_threads(void **state) {
    (void)state;
    fct_mesh mesh = make_torus(&env, SANITIZED ? 40 : 60, true, true), outs[2][2];
    const uint32_t targets[2] = {mesh.face_count / 2, mesh.face_count / 20};
    for (uint32_t threads = 0; threads < 2; ++threads) {
        fct_env own = env;
        own.thread_count = 1 + 3 * threads;
        fct_simplify_def def = faces_def();
        assert_int_equal(fct_simplify_levels(&own, &mesh, &def, targets, 2, outs[threads], NULL), FCT_OK);
    }
    for (int i = 0; i < 2; ++i) {
        assert_true(same_mesh(&outs[0][i], &outs[1][i]));
        for (int k = 0; k < 2; ++k) fct_mesh_release(&env, &outs[k][i]);
    }
    fct_mesh_release(&env, &mesh);
}

/* A flat sheet loses no area while contractions without an error are left. */
static void flat_sheets_keep_their_area(void **state) {
    (void)state;
    fct_mesh mesh = make_grid(&env, 12);
    for (uint32_t target = 20; target <= 40; target += 20) {
        fct_simplify_def def = faces_def();
        def.target_faces = target;
        fct_simplify_stats stats;
        fct_mesh out = simplified(&env, &mesh, &def, &stats);
        assert_int_equal(stats.stopped_because, FCT_STOP_FACES);
        assert_true(out.face_count <= target && out.face_count + 3 > target);
        assert_ratio(mesh_area(&out), 1, 1e-6);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &mesh);
}

/* Two triangles on a line of locked vertices have no face that may be contracted, but an edge. */
static void edges_follow_when_no_face_is_left(void **state) {
    (void)state;
    fct_mesh mesh = make_grid(&env, 2);
    uint8_t locks[9] = {1, 0, 1, 1, 0, 1, 1, 0, 1}; /* each face has two locked corners */
    fct_simplify_def def = faces_def();
    def.locks = locks, def.target_faces = 4;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_int_equal(stats.stopped_because, FCT_STOP_FACES);
    assert_int_equal(out.face_count, 4);
    assert_ratio(mesh_area(&out), 1, 1e-6);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

static void wrong_options_are_refused(void **state) {
    (void)state;
    fct_mesh mesh = make_grid(&env, 2), out;
    fct_simplify_def def = faces_def();
    def.pair_distance = 1;
    assert_int_equal(fct_simplify(&env, &mesh, &def, &out, NULL), FCT_ERROR_DATA);
    def.pair_distance = 0, def.refit_passes = 101;
    assert_int_equal(fct_simplify(&env, &mesh, &def, &out, NULL), FCT_ERROR_DATA);
    def.refit_passes = 100, def.primitive = (fct_primitive)2;
    assert_int_equal(fct_simplify(&env, &mesh, &def, &out, NULL), FCT_ERROR_DATA);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(prices_are_minima_of_three_quadrics),
        cmocka_unit_test(prices_follow_the_placement),
        cmocka_unit_test(the_cheapest_face_becomes_its_minimum),
        cmocka_unit_test(faces_are_contracted_as_a_whole),
        cmocka_unit_test(errors_are_near_those_of_edges),
        cmocka_unit_test(rules_hold_for_faces),
        cmocka_unit_test(levels_are_the_same_for_all_threads),
        cmocka_unit_test(flat_sheets_keep_their_area),
        cmocka_unit_test(edges_follow_when_no_face_is_left),
        cmocka_unit_test(wrong_options_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
