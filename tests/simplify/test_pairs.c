/* Pairs of near points: the candidates against brute force, the order of contractions and their errors,
 * bodies that join or stay apart, inner walls, attributes, threads. */
#include <time.h>

#include "bodies.h"
#include "simplify/contract.h"
#include "simplify/log.h"
#include "simplify/pairs/candidates.h"
#include "simplify/pairs/release.h"

static fct_env env;

static fct_simplify_def with_pairs(double distance, uint32_t faces) {
    fct_simplify_def def = fct_simplify_def_default();
    def.pair_distance = distance;
    def.target_faces = faces;
    return def;
}

/* ---- Candidates ---- */

static v3 input_vertex(const fct_simplifier *s, uint32_t point) {
    uint32_t v = 0;
    while (s->point_of[v] != point) ++v;
    return vertex(s->mesh, v);
}

/* The nearest points of the nearest other bodies, from all points. Returns their number. */
static uint32_t list_nearest(const fct_simplifier *s, const v3 *at, uint32_t *bodies, uint32_t p,
                             double distance, uint32_t found[PAIR_BODIES]) {
    uint32_t *best = malloc(s->point_count * sizeof *best), count = 0;
    for (uint32_t b = 0; b < s->point_count; ++b) best[b] = FCT_NONE;
    for (uint32_t q = 0; q < s->point_count; ++q) {
        uint32_t b = fct_sets_find(bodies, q);
        double d2 = v3_norm2(v3_sub(at[p], at[q]));
        if (b == fct_sets_find(bodies, p) || d2 > distance * distance) continue;
        if (best[b] == FCT_NONE || d2 < v3_norm2(v3_sub(at[p], at[best[b]]))) best[b] = q;
    }
    while (count < PAIR_BODIES) {
        uint32_t next = FCT_NONE;
        for (uint32_t b = 0; b < s->point_count; ++b) {
            if (best[b] == FCT_NONE) continue;
            double d2 = v3_norm2(v3_sub(at[p], at[best[b]]));
            double least2 = next == FCT_NONE ? INFINITY : v3_norm2(v3_sub(at[p], at[best[next]]));
            if (d2 < least2 || (d2 == least2 && (next == FCT_NONE || best[b] < best[next]))) next = b;
        }
        if (next == FCT_NONE) break;
        found[count++] = best[next];
        best[next] = FCT_NONE;
    }
    free(best);
    return count;
}

/* Compares the candidates of a mesh with those by brute force. */
static uint32_t check_candidates(const fct_mesh *mesh, double distance) {
    fct_simplify_def def = with_pairs(distance, 0);
    fct_simplifier *s = open_simplifier(&env, mesh, &def);
    uint32_t n = s->point_count, *bodies = malloc(n * sizeof *bodies), wanted = 0, got = 0;
    bool *pairs = calloc((size_t)n * n, 1);
    v3 *at = malloc(n * sizeof *at);
    fct_sets_create(bodies, n);
    for (uint32_t p = 0; p < n; ++p) at[p] = input_vertex(s, p);
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; c += 3)
        for (size_t k = 1; k < 3; ++k)
            fct_sets_join(bodies, s->point_of[mesh->triangles[c]], s->point_of[mesh->triangles[c + k]]);
    for (uint32_t p = 0; p < n; ++p) {
        uint32_t found[PAIR_BODIES], count = list_nearest(s, at, bodies, p, distance, found);
        for (uint32_t i = 0; i < count; ++i) {
            uint32_t low = p < found[i] ? p : found[i], high = p < found[i] ? found[i] : p;
            wanted += !pairs[(size_t)n * low + high];
            pairs[(size_t)n * low + high] = true;
        }
    }
    for (uint32_t e = s->first_pair; e < s->edge_count; ++e) {
        const uint32_t *ends = s->edges[e].ends;
        uint32_t low = ends[0] < ends[1] ? ends[0] : ends[1], high = ends[0] < ends[1] ? ends[1] : ends[0];
        assert_true(pairs[(size_t)n * low + high]);
        pairs[(size_t)n * low + high] = false; /* each once */
        ++got;
    }
    assert_int_equal(got, wanted);
    assert_true(got <= PAIR_BODIES * n);
    free(at), free(pairs), free(bodies);
    fct_simplifier_destroy(s);
    return got;
}

static void candidates_are_those_of_brute_force(void **state) {
    (void)state;
    uint64_t seed = 5;
    uint32_t found = 0;
    for (uint32_t round = 0; round < 12; ++round) {
        v3 places[40];
        uint32_t count = 2 + round * 3;
        /* On a grid, so that many distances are equal; apart by quarters, which floats hold exactly. */
        for (uint32_t i = 0; i < count; ++i)
            places[i] = (v3){.25 * floor(between(&seed, 0, 16)), .25 * floor(between(&seed, 0, 16)),
                             round % 2 ? .25 * floor(between(&seed, 0, 16)) : between(&seed, 0, 4)};
        fct_mesh mesh = make_boxes(&env, places, count, (v3){.5, .5, .5}, 1 + round % 2, 0);
        const double distances[] = {.05, .25, .5, .8, 2, 100, INFINITY};
        for (size_t i = 0; i < FCT_LENGTH(distances); ++i) found += check_candidates(&mesh, distances[i]);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(found > 10000);
}

/* Processor seconds to set up two boxes of n x n squares per side with pairs at any distance. */
static double time_search(uint32_t n) {
    fct_env own = env;
    own.thread_count = 1;
    fct_mesh mesh = make_row(&env, 2, .25, n, 0);
    fct_simplify_def def = with_pairs(INFINITY, 0);
    clock_t start = clock();
    fct_simplifier *s = open_simplifier(&own, &mesh, &def);
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    assert_in_range(s->edge_count - s->first_pair, s->point_count / 2, 2 * s->point_count);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
    return seconds;
}

/* The work for each point stays about the same at any distance, because insides of bodies are skipped: 16
 * times the points take far less than 16^2 times as long. */
static void far_distances_are_searched_fast(void **state) {
    (void)state;
    assert_true(time_search(80) < 80 * time_search(20) + .1);
}

/* ---- Contractions ---- */

static void boxes_join_at_their_distance(void **state) {
    (void)state;
    for (double gap = 1. / 64; gap <= .5; gap *= 2)
        for (uint32_t n = 1; n <= 3; ++n) {
            fct_mesh mesh = make_row(&env, 2, gap, n, 0);
            const struct {
                double distance;
                uint32_t bodies;
            } cases[] = {{0, 2}, {.5 * gap, 2}, {.999 * gap, 2}, {gap, 1}, {1.001 * gap, 1}, {3 * gap, 1}};
            for (size_t i = 0; i < FCT_LENGTH(cases); ++i) {
                fct_simplify_stats stats;
                fct_simplify_def def = with_pairs(cases[i].distance, 23); /* flat parts first */
                def.max_error = .51 * gap;
                def.refit_passes = 0;
                fct_mesh out = simplified(&env, &mesh, &def, &stats);
                assert_int_equal(count_bodies(&out), cases[i].bodies);
                assert_int_equal(stats.pairs_found > 0, cases[i].bodies == 1);
                assert_true(stats.pairs_joined <= stats.pairs_found);
                fct_mesh_release(&env, &out);
            }
            fct_mesh_release(&env, &mesh);
        }
}

/* The planes of the faces at a point, from the input: its quadric as a list. */
typedef struct plane_list {
    uint32_t count;
    struct {
        v3 normal, at;
        double weight;
    } planes[256];
} plane_list;

static void list_planes(const fct_mesh *mesh, uint32_t v, plane_list *out) {
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) {
        if (mesh->triangles[c] != v) continue;
        v3 cross = face_cross(mesh, (uint32_t)(c / 3));
        out->planes[out->count].normal = v3_unit(cross);
        out->planes[out->count].at = vertex(mesh, v);
        out->planes[out->count++].weight = v3_norm(cross) / 6; /* a third of the area */
    }
}

/* The weighted squared distance of p from the planes of two points. */
static double sum_planes(const plane_list *a, const plane_list *b, v3 p) {
    double sum = 0;
    for (uint32_t i = 0; i < a->count + b->count; ++i) {
        const plane_list *l = i < a->count ? a : b;
        uint32_t k = i < a->count ? i : i - a->count;
        double d = v3_dot(l->planes[k].normal, v3_sub(p, l->planes[k].at));
        sum += l->planes[k].weight * d * d;
    }
    return sum;
}

static double sum_weights(const plane_list *a) {
    double sum = 0;
    for (uint32_t i = 0; i < a->count; ++i) sum += a->planes[i].weight;
    return sum;
}

/* The best of both ends and the midpoint. */
static v3 find_best(const plane_list *lists, const v3 *at, uint32_t a, uint32_t b, double *cost) {
    const v3 tries[3] = {at[a], at[b], v3_scale(v3_add(at[a], at[b]), .5)};
    v3 best = at[a];
    *cost = INFINITY;
    for (int i = 0; i < 3; ++i) {
        double sum = sum_planes(&lists[a], &lists[b], tries[i]);
        if (sum < *cost) *cost = sum, best = tries[i];
    }
    return best;
}

/* Tetrahedra, each with its tip near that of the next one. Pairs are far cheaper than edges. */
static fct_mesh make_chain(uint32_t count, uint64_t seed) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 4 * count, 4 * count, 0, &mesh), FCT_OK);
    static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    for (uint32_t i = 0; i < count; ++i) {
        for (uint32_t v = 0; v < 4; ++v) {
            v3 p = v3_add((v3){2. * i, v == 1, v == 2}, v3_scale(random_vector(&seed), .2));
            if (v == 3) p = (v3){2. * i + 1.6 + .1 * uniform(&seed), .2 * uniform(&seed), 0};
            v3_store(mesh.positions + 3 * (4 * (size_t)i + v), p);
        }
        for (uint32_t c = 0; c < 12; ++c) mesh.triangles[12 * i + c] = 4 * i + faces[c];
    }
    return mesh;
}

/* Repeats the log with planes from the input: each pair is the cheapest one that is left, within a bucket of
 * the queue (1/8), and its position and error are those of the definition. */
static uint32_t check_order(const fct_mesh *mesh, double distance) {
    fct_simplify_def def = with_pairs(distance, 0);
    def.placement = FCT_PLACE_ENDS;
    def.check_foldover = false;
    def.regularization = 0;
    def.max_error = .25; /* edges cost more */
    fct_simplifier *s = open_simplifier(&env, mesh, &def);
    assert_int_equal(fct_log_create(s), FCT_OK);
    uint32_t n = s->point_count, pairs = s->edge_count - s->first_pair, made = 0;
    plane_list *lists = calloc(n, sizeof *lists);
    v3 *at = malloc(n * sizeof *at);
    uint32_t *parents = malloc(n * sizeof *parents), (*ends)[2] = malloc((pairs + 1) * sizeof *ends);
    fct_sets_create(parents, n);
    for (uint32_t v = 0; v < n; ++v) {
        assert_int_equal(s->point_of[v], v);
        at[v] = vertex(mesh, v);
        list_planes(mesh, v, &lists[v]);
    }
    for (uint32_t i = 0; i < pairs; ++i) memcpy(ends[i], s->edges[s->first_pair + i].ends, sizeof *ends);
    fct_stop stop;
    assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
    for (uint32_t r = 0; r < s->log->count; ++r) {
        const fct_record *record = &s->log->records[r];
        uint32_t a = record->kept, b = record->gone;
        if (record->wall) continue;
        double least = INFINITY, cost, own;
        bool listed = false;
        for (uint32_t i = 0; i < pairs; ++i) {
            uint32_t x = fct_sets_find(parents, ends[i][0]), y = fct_sets_find(parents, ends[i][1]);
            if (x == y) continue;
            listed |= (x == a && y == b) || (x == b && y == a);
            find_best(lists, at, x, y, &cost);
            least = fmin(least, cost);
        }
        v3 best = find_best(lists, at, a, b, &own);
        if (!listed) break; /* an edge: the planes of its loss are not listed */
        assert_true(own <= 1.126 * least);
        assert_ratio((double)record->error, sqrt(own / (sum_weights(&lists[a]) + sum_weights(&lists[b]))),
                     1e-5);
        for (int k = 0; k < 3; ++k) {
            double p[3];
            v3_to_array(best, p);
            assert_close((double)record->at[k], p[k], 1e-6);
        }
        for (uint32_t i = 0; i < lists[b].count; ++i) lists[a].planes[lists[a].count++] = lists[b].planes[i];
        at[a] = best;
        parents[b] = a;
        ++made;
    }
    free(lists), free(at), free(parents), free(ends);
    fct_simplifier_destroy(s);
    return made;
}

static void the_cheapest_pair_goes_first(void **state) {
    (void)state;
    uint32_t made = 0;
    for (uint64_t seed = 1; seed <= 20; ++seed) {
        fct_mesh mesh = make_chain(8, seed);
        made += check_order(&mesh, .8);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(made > 100);
}

/* ---- Walls ---- */

static bool any_edge(v3 a, v3 b) {
    (void)a, (void)b;
    return true;
}

/* Boxes in a row become one closed body without walls inside. */
static void walls_vanish_between_closed_bodies(void **state) {
    (void)state;
    for (uint32_t count = 2; count <= 5; ++count) {
        fct_mesh mesh = make_row(&env, count, .01, 1, 0);
        uint32_t left = 12 * count - 4 * (count - 1);
        fct_simplify_stats stats;
        fct_simplify_def def = with_pairs(.01, left);
        def.max_error = .01;
        fct_mesh out = simplified(&env, &mesh, &def, &stats);
        assert_int_equal(out.face_count, left);
        assert_int_equal(stats.pairs_joined, 4 * (count - 1));
        assert_int_equal(open_sides(&out, any_edge), 0);
        assert_int_equal(count_bodies(&out), 1);
        assert_close(mesh_volume(&out), count + .01 * (count - 1), .002);
        assert_true(stats.distance_max < .0051); /* samples of walls do not count, nor pull */
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &mesh);
    }
}

/* Two grids at nearly one place: `turned`, they are the two sides of one sheet. */
static fct_mesh make_sheets(uint32_t n, bool turned) {
    fct_mesh mesh;
    uint32_t m = n + 1, squares = n * n;
    assert_int_equal(fct_mesh_create(&env, 2 * m * m, 4 * squares, 0, &mesh), FCT_OK);
    for (uint32_t v = 0; v < 2 * m * m; ++v) {
        float *p = mesh.positions + 3 * (size_t)v;
        p[0] = (float)(v % m), p[1] = (float)(v / m % m), p[2] = v < m * m ? 0 : .01f;
    }
    for (uint32_t f = 0; f < 4 * squares; ++f) {
        uint32_t q = f / 2 % squares, layer = f / (2 * squares) * m * m, a = layer + q % n + m * (q / n);
        uint32_t lower[3] = {a, a + 1, a + m + 1}, upper[3] = {a, a + m + 1, a + m},
                 *t = mesh.triangles + 3 * f;
        memcpy(t, f % 2 ? upper : lower, 12);
        if (turned && layer) {
            uint32_t swap = t[1];
            t[1] = t[2], t[2] = swap;
        }
    }
    return mesh;
}

/* The sides of a sheet do not cancel each other out. Of two equal sheets one is left. */
static void sheets_stay(void **state) {
    (void)state;
    fct_mesh turned = make_sheets(3, true), equal = make_sheets(3, false);
    fct_simplify_def def = with_pairs(.5, 0);
    def.max_error = .01;
    fct_simplify_stats stats;
    fct_mesh out = simplified(&env, &turned, &def, &stats);
    assert_true(mesh_area(&out) > 17.9 && stats.pairs_joined > 0);
    fct_mesh_release(&env, &out);
    out = simplified(&env, &equal, &def, &stats);
    assert_int_equal(out.face_count, 2);
    assert_close(mesh_area(&out), 9, 1e-6);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &turned);
    fct_mesh_release(&env, &equal);
}

/* Of two equal bodies one is left, and its points keep their floats. */
static void copies_become_one(void **state) {
    (void)state;
    const v3 places[2] = {{.1, 1. / 3, 7.7}, {.1, 1. / 3, 7.7}};
    fct_mesh mesh = make_boxes(&env, places, 2, (v3){.3, .7, 1.1}, 1, 0);
    fct_simplify_stats stats;
    fct_simplify_def def = with_pairs(1e-6, 12);
    def.max_error = 1e-6;
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_int_equal(stats.pairs_joined, 8);
    assert_int_equal(out.face_count, 12);
    assert_int_equal(out.vertex_count, 8);
    for (uint32_t v = 0; v < 8; ++v) {
        bool met = false;
        for (uint32_t w = 0; w < 8; ++w) met |= !memcmp(out.positions + 3 * v, mesh.positions + 3 * w, 12);
        assert_true(met);
    }
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* Open boxes keep the faces between them. */
static void walls_of_open_bodies_stay(void **state) {
    (void)state;
    fct_mesh mesh = make_row(&env, 2, .01, 1, 0);
    uint32_t count = 0;
    for (uint32_t f = 0; f < mesh.face_count; ++f) {
        v3 n = v3_unit(face_cross(&mesh, f));
        if (n.z < .5) memmove(mesh.triangles + 3 * (size_t)count++, mesh.triangles + 3 * (size_t)f, 12);
    }
    assert_int_equal(count, 20);
    mesh.face_count = count;
    fct_simplify_stats stats;
    fct_simplify_def def = with_pairs(.02, 0);
    def.max_error = .01;
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_true(stats.pairs_joined > 0 && mesh_area(&out) > 9.9);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* A body and its inside-out copy do not cancel each other out. */
static void bodies_inside_out_stay(void **state) {
    (void)state;
    const v3 places[2] = {{0, 0, 0}, {0, 0, 0}};
    fct_mesh mesh = make_boxes(&env, places, 2, (v3){1, 1, 1}, 2, 0);
    for (uint32_t f = mesh.face_count / 2; f < mesh.face_count; ++f) {
        uint32_t *t = mesh.triangles + 3 * (size_t)f, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
    fct_simplify_def def = with_pairs(.5, 0);
    def.max_error = 1e-6;
    fct_mesh out = simplified(&env, &mesh, &def, NULL);
    assert_true(mesh_area(&out) > 11.9);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* A thin plate is one body: its sides have no pairs. */
static void a_plate_stays(void **state) {
    (void)state;
    const v3 place = {0, 0, 0};
    fct_mesh mesh = make_boxes(&env, &place, 1, (v3){1, 1, .001}, 8, 0);
    fct_simplify_stats stats;
    fct_simplify_def def = with_pairs(1, 12);
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_int_equal(stats.pairs_found, 0);
    assert_close(mesh_volume(&out), .001, 1e-6);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* Planes that stand across the others leave a quadric as if they had never been there. From others no more is
 * taken than leaves it at least 0, and the minimum stays where it is. */
static void planes_of_walls_leave_the_quadrics(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int round = 0; round < 200; ++round) {
        double with[POSITION_QUADRIC] = {0}, without[POSITION_QUADRIC] = {0};
        v3 at = random_vector(&seed), n = v3_unit(random_vector(&seed));
        double weight = between(&seed, .1, 2);
        for (int k = 0; k < 2; ++k) {
            v3 side = v3_unit(v3_cross(n, random_vector(&seed)));
            quadric_add_plane(with, side, at, 1 + k), quadric_add_plane(without, side, at, 1 + k);
        }
        quadric_add_plane(with, n, at, weight);
        with[10] = 3 + weight;
        fct_simplify_release_plane(with, with, n, weight * (round % 2 ? 1 : 1.5));
        for (int k = 0; k < 10; ++k) assert_float_equal(with[k], without[k], 1e-6);
        assert_float_equal(with[10], 3, 1e-6);

        double half[POSITION_QUADRIC] = {0};
        for (int k = 0; k < 3; ++k)
            quadric_add_plane(half, (v3){k == 0, k == 1, k == 2}, random_vector(&seed), .1);
        for (int k = 0; k < 4; ++k)
            quadric_add_plane(half, v3_unit(random_vector(&seed)), random_vector(&seed),
                              between(&seed, .1, 1));
        half[10] = 5;
        double before[POSITION_QUADRIC], rows[9], x[3] = {-half[6], -half[7], -half[8]};
        memcpy(before, half, sizeof before);
        const int place[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
        for (int k = 0; k < 9; ++k) rows[k] = half[place[k]];
        solve_dense(3, rows, x);
        v3 least = {x[0], x[1], x[2]};
        fct_simplify_release_plane(half, half, n, round % 2 ? .01 : 100);
        assert_float_equal(quadric_at(half, least), quadric_at(before, least), 1e-5);
        if (round % 2) assert_float_equal(before[10] - half[10], .01, 1e-9);
        for (int k = 0; k < 20; ++k) {
            v3 p = v3_scale(random_vector(&seed), 3);
            double height = v3_dot(n, v3_sub(p, least)), taken = quadric_at(before, p) - quadric_at(half, p);
            assert_true(quadric_at(half, p) > -1e-5);
            if (round % 2) assert_float_equal(taken, .01 * height * height, 1e-5);
        }
    }
}

/* The seams between boxes and between cylinders disappear, with and without attributes in the error. */
static void seams_disappear(void **state) {
    (void)state;
    for (int colored = 0; colored < 2; ++colored) {
        fct_mesh mesh = make_row(&env, 4, .01, 1, colored ? FCT_MESH_COLORS : 0);
        for (uint32_t c = 0; c < 3 * mesh.vertex_count && colored; ++c) mesh.colors[c] = .5f;
        fct_simplify_stats stats;
        fct_simplify_def def = with_pairs(.01, 12);
        def.color_weight = .1;
        fct_mesh out = simplified(&env, &mesh, &def, &stats);
        assert_int_equal(out.face_count, 12);
        assert_close(mesh_volume(&out), 4.03, 1e-4);
        assert_true(stats.max_cost < .006);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &mesh);
    }
}

/* ---- Attributes and locks ---- */

/* A red and a blue body join without a mixture of their colours. */
static void both_sides_keep_their_attributes(void **state) {
    (void)state;
    for (int weighs = 0; weighs < 2; ++weighs) {
        fct_mesh mesh = make_row(&env, 2, .01, 1, FCT_MESH_COLORS | FCT_MESH_NORMALS);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
            bool second = v >= mesh.vertex_count / 2;
            const float rgb[3] = {!second, 0, second}, up[3] = {0, 0, 1};
            memcpy(mesh.colors + 3 * v, rgb, 12), memcpy(mesh.normals + 3 * v, up, 12);
        }
        fct_simplify_stats stats;
        fct_simplify_def def = with_pairs(.01, 20);
        def.color_weight = weighs ? .1 : 0, def.normal_weight = 0;
        fct_mesh out = simplified(&env, &mesh, &def, &stats);
        assert_int_equal(stats.pairs_joined, 4);
        assert_int_equal(out.face_count, 20);
        assert_int_equal(out.vertex_count, 16);
        assert_int_equal(count_bodies(&out), 1);
        uint32_t reds = 0;
        for (uint32_t v = 0; v < out.vertex_count; ++v) {
            const float *c = out.colors + 3 * v;
            assert_true(fabsf(c[0] + c[2] - 1) < 1e-6f && fabsf(c[0] - roundf(c[0])) < 1e-6f);
            reds += c[0] > .5f;
        }
        assert_int_equal(reds, 8);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &mesh);
    }
}

static void locked_points_make_no_pairs(void **state) {
    (void)state;
    fct_mesh mesh = make_row(&env, 2, .25, 1, 0);
    uint8_t locks[16] = {0};
    uint32_t locked = 0;
    for (uint32_t v = 0; v < 8; ++v)
        if (mesh.positions[3 * v] == 1 && locked < 3) locks[v] = 1, ++locked;
    fct_simplify_stats stats;
    fct_simplify_def def = with_pairs(.25, 0);
    def.locks = locks;
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_int_equal(stats.pairs_found, 1);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

static void options_are_checked(void **state) {
    (void)state;
    fct_mesh mesh = make_row(&env, 2, .25, 1, 0), out;
    const double bad[] = {-1, (double)NAN};
    for (size_t i = 0; i < 2; ++i) {
        fct_simplify_def def = with_pairs(bad[i], 0);
        assert_int_equal(fct_simplify(&env, &mesh, &def, &out, NULL), FCT_ERROR_DATA);
    }
    fct_simplify_def def = with_pairs(.1, 0);
    def.keep_topology = true;
    assert_int_equal(fct_simplify(&env, &mesh, &def, &out, NULL), FCT_ERROR_DATA);
    assert_true(!out.positions);
    fct_mesh_release(&env, &mesh);
}

/* ---- Large meshes ---- */

/* A block of boxes, which takes sweeps. */
static fct_mesh make_city(uint32_t side, uint32_t n, unsigned arrays) {
    v3 *places = malloc((size_t)side * side * sizeof *places);
    for (uint32_t i = 0; i < side * side; ++i) places[i] = (v3){1.05 * (i % side), 1.05 * (i / side), 0};
    fct_mesh mesh = make_boxes(&env, places, side * side, (v3){1, 1, 1}, n, arrays);
    free(places);
    return mesh;
}

/* 100 cubes become one box: all pairs of a wall are contracted before its seams are. */
static void a_hundred_cubes_become_a_box(void **state) {
    (void)state;
    fct_mesh mesh = make_city(10, 1, 0);
    fct_simplify_stats stats;
    fct_simplify_def def = with_pairs(.06, 12);
    fct_mesh out = simplified(&env, &mesh, &def, &stats);
    assert_int_equal(out.face_count, 12);
    assert_int_equal(stats.pairs_joined, 558); /* 3 at each of 162 places inside, 1 at each of 72 outside */
    assert_close(mesh_volume(&out), 10.45 * 10.45, 1e-5);
    assert_close(mesh_area(&out), 2 * 10.45 * 10.45 + 4 * 10.45, 1e-5);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

static void every_thread_count_gives_the_same_bits(void **state) {
    (void)state;
    for (unsigned arrays = 0; arrays <= FCT_MESH_COLORS; arrays += FCT_MESH_COLORS) {
        fct_mesh mesh = make_city(24, 3, arrays), out[3];
        for (uint32_t v = 0; v < mesh.vertex_count && arrays; ++v) {
            const float rgb[3] = {.1f * (float)(v / 56 % 10), .5f, .2f};
            memcpy(mesh.colors + 3 * (size_t)v, rgb, 12);
        }
        fct_simplify_stats stats[3];
        fct_simplify_def def = with_pairs(.1, 3000);
        for (uint32_t i = 0; i < 3; ++i) {
            fct_env own = env;
            own.thread_count = i + 1;
            assert_int_equal(fct_simplify(&own, &mesh, &def, &out[i], &stats[i]), FCT_OK);
            assert_int_equal(out[i].face_count, out[0].face_count);
            assert_int_equal(out[i].vertex_count, out[0].vertex_count);
            assert_int_equal(stats[i].pairs_joined, stats[0].pairs_joined);
            assert_memory_equal(out[i].positions, out[0].positions, 12 * (size_t)out[0].vertex_count);
            assert_memory_equal(out[i].triangles, out[0].triangles, 12 * (size_t)out[0].face_count);
        }
        assert_true(out[0].face_count > 2900 && stats[0].pairs_joined > 2000);
        assert_in_range(count_bodies(&out[0]), 1, 60);
        for (uint32_t i = 0; i < 3; ++i) fct_mesh_release(&env, &out[i]);
        fct_mesh_release(&env, &mesh);
    }
}

/* Two boxes side by side, whose common side is cut along other diagonals: contractions of edges make its
 * faces equal, and they vanish as an inner wall. */
static void walls_of_other_diagonals_vanish(void **state) {
    (void)state;
    fct_mesh mesh = make_row(&env, 2, 0, 6, 0), out;
    for (uint32_t v = mesh.vertex_count / 2; v < mesh.vertex_count; ++v)
        mesh.positions[3 * v + 1] = 1 - mesh.positions[3 * v + 1];
    for (uint32_t f = mesh.face_count / 2; f < mesh.face_count; ++f) {
        uint32_t kept = mesh.triangles[3 * f];
        mesh.triangles[3 * f] = mesh.triangles[3 * f + 1], mesh.triangles[3 * f + 1] = kept;
    }
    out = simplified(&env, &mesh, (fct_simplify_def[1]){with_pairs(1e-6, 12)}, NULL);
    assert_int_equal(out.face_count, 12);
    assert_int_equal(count_bodies(&out), 1);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(candidates_are_those_of_brute_force),
        cmocka_unit_test(far_distances_are_searched_fast),
        cmocka_unit_test(boxes_join_at_their_distance),
        cmocka_unit_test(the_cheapest_pair_goes_first),
        cmocka_unit_test(walls_vanish_between_closed_bodies),
        cmocka_unit_test(planes_of_walls_leave_the_quadrics),
        cmocka_unit_test(seams_disappear),
        cmocka_unit_test(sheets_stay),
        cmocka_unit_test(copies_become_one),
        cmocka_unit_test(walls_of_open_bodies_stay),
        cmocka_unit_test(bodies_inside_out_stay),
        cmocka_unit_test(a_plate_stays),
        cmocka_unit_test(both_sides_keep_their_attributes),
        cmocka_unit_test(locked_points_make_no_pairs),
        cmocka_unit_test(options_are_checked),
        cmocka_unit_test(a_hundred_cubes_become_a_box),
        cmocka_unit_test(walls_of_other_diagonals_vanish),
        cmocka_unit_test(every_thread_count_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
