/* Measures, neighbours, refinement, seams and culling bounds of partitions against direct sums over triangles
 * in double. Meshes are rough terrains whose faces all differ. The labels do not come from a tree. */
#include "cluster/oracle/meshes.h"
#include "cluster/oracle/oracle.h"

#include "facetree/partition.h"

static const double turn_angle = 6.283185307179586;

static uint32_t next_random(uint32_t *state) {
    return *state = *state * 1664525u + 1013904223u;
}

static void load_triangle(const fct_mesh *mesh, uint32_t face, double p[3][3]) {
    for (size_t c = 0; c < 3; ++c)
        for (size_t k = 0; k < 3; ++k)
            p[c][k] = (double)mesh->positions[3 * (size_t)mesh->triangles[3 * (size_t)face + c] + k];
}

/* Labels that grow from random faces over shared edges. */
static uint32_t *grow_labels(const fct_mesh *mesh, uint32_t count, uint32_t seed) {
    uint32_t *labels = malloc(mesh->face_count * sizeof *labels), left = mesh->face_count - count;
    for (uint32_t f = 0; f < mesh->face_count; ++f) labels[f] = FCT_NONE;
    for (uint32_t i = 0; i < count;) {
        uint32_t f = (next_random(&seed) >> 8) % mesh->face_count;
        if (labels[f] == FCT_NONE) labels[f] = i++;
    }
    while (left) {
        uint32_t f = (next_random(&seed) >> 8) % mesh->face_count;
        if (labels[f] != FCT_NONE) continue;
        for (uint32_t g = 0; g < mesh->face_count && labels[f] == FCT_NONE; ++g) {
            int shared = 0;
            if (labels[g] == FCT_NONE) continue;
            for (int i = 0; i < 9; ++i)
                shared += mesh->triangles[3 * (size_t)f + (size_t)(i / 3)] ==
                          mesh->triangles[3 * (size_t)g + (size_t)(i % 3)];
            if (shared == 2) labels[f] = labels[g], --left;
        }
    }
    return labels;
}

/* --- Borders: sides of faces, compared pair by pair. Every edge of these meshes has one or two faces. --- */

static double measure_side(const fct_mesh *mesh, uint32_t side) {
    double p[3][3];
    load_triangle(mesh, side / 3, p);
    return oracle_distance(p[side % 3], p[(side % 3 + 1) % 3]);
}

/* The other face at a side, or FCT_NONE. */
static uint32_t find_mate(const fct_mesh *mesh, uint32_t side) {
    const uint32_t *t = mesh->triangles;
    uint32_t a = t[side], b = t[side / 3 * 3 + (side % 3 + 1) % 3];
    for (uint32_t other = 0; other < 3 * mesh->face_count; ++other)
        if (other / 3 != side / 3) {
            uint32_t c = t[other], d = t[other / 3 * 3 + (other % 3 + 1) % 3];
            if ((a == c && b == d) || (a == d && b == c)) return other / 3;
        }
    return FCT_NONE;
}

static uint32_t *find_mates(const fct_mesh *mesh) {
    uint32_t *mates = malloc(3 * (size_t)mesh->face_count * sizeof *mates);
    for (uint32_t side = 0; side < 3 * mesh->face_count; ++side) mates[side] = find_mate(mesh, side);
    return mates;
}

/* --- Sums of one label --- */

typedef struct sums {
    uint32_t faces;
    double area, vector[3], centroid[3], scatter[3][3], perimeter;
    double fit, direction, deviation; /* times area */
    double normal[3], offset;
} sums;

/* Second moments by the rule of side midpoints, which is exact for squares. */
static sums sum_label(const fct_mesh *mesh, const uint32_t *mates, const uint32_t *labels, uint32_t label) {
    sums s = {0};
    double p[3][3], v[3], values[3], axes[3][3], dot = 0;
    for (int pass = 0; pass < 2; ++pass) {
        for (uint32_t f = 0; f < mesh->face_count; ++f) {
            if (labels[f] != label) continue;
            load_triangle(mesh, f, p);
            oracle_area_vector((const double(*)[3])p, v);
            double area = oracle_norm(v);
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 3; ++k) {
                    double x = (p[c][k] + p[(c + 1) % 3][k]) / 2;
                    if (pass == 0) s.centroid[k] += area / 3 * x;
                    for (int l = 0; l < 3 && pass == 1; ++l)
                        s.scatter[k][l] += area / 3 * (x - s.centroid[k]) *
                                           ((p[c][l] + p[(c + 1) % 3][l]) / 2 - s.centroid[l]);
                }
            if (pass == 1) continue;
            ++s.faces, s.area += area;
            for (int k = 0; k < 3; ++k) s.vector[k] += v[k];
            for (uint32_t side = 3 * f; side < 3 * f + 3; ++side)
                if (mates[side] == FCT_NONE || labels[mates[side]] != label)
                    s.perimeter += measure_side(mesh, side);
        }
        for (int k = 0; k < 3 && pass == 0 && s.area > 0; ++k) s.centroid[k] /= s.area;
    }
    oracle_eigen((const double(*)[3])s.scatter, values, axes);
    s.fit = values[0];
    for (int k = 0; k < 3; ++k) dot += axes[0][k] * s.vector[k];
    for (int k = 0; k < 3; ++k) s.normal[k] = dot < 0 ? -axes[0][k] : axes[0][k];
    for (int k = 0; k < 3; ++k) s.offset -= s.normal[k] * s.centroid[k];
    for (uint32_t f = 0; f < mesh->face_count; ++f) { /* (8.12), and the distance to the mean normal */
        if (labels[f] != label) continue;
        load_triangle(mesh, f, p);
        oracle_area_vector((const double(*)[3])p, v);
        double area = oracle_norm(v), length = oracle_norm(s.vector), away = 0;
        double miss = 1 - oracle_dot(s.normal, v) / area;
        for (int k = 0; k < 3; ++k) away += pow(v[k] / area - s.vector[k] / length, 2);
        s.direction += area * miss * miss, s.deviation += area * away;
    }
    return s;
}

static void expect(const char *what, uint32_t which, double found, double wanted, double slack) {
    if (!(fabs(found - wanted) <= slack))
        fail_msg("%s of %u is %.12g, should be %.12g", what, which, found, wanted);
}

static double measure_diagonal(const fct_mesh *mesh) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i) {
        low[i % 3] = fmin(low[i % 3], (double)mesh->positions[i]);
        high[i % 3] = fmax(high[i % 3], (double)mesh->positions[i]);
    }
    return oracle_distance(low, high);
}

static void quality_and_planes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (uint32_t count = 1; count <= 41; count += 8) {
        fct_mesh mesh = make_terrain(&env, 14, .5, count);
        uint32_t *mates = find_mates(&mesh), *labels = grow_labels(&mesh, count, 7 * count);
        fct_partition_quality q;
        float *planes = malloc(4 * (size_t)count * sizeof *planes);
        double area = 0, fit = 0, direction = 0, deviation = 0, irregularity = 0;
        assert_int_equal(fct_labels_quality(&env, &mesh, labels, count, &q), FCT_OK);
        assert_int_equal(fct_labels_planes(&env, &mesh, labels, count, planes), FCT_OK);
        for (uint32_t i = 0; i < count; ++i) {
            sums s = sum_label(&mesh, mates, labels, i);
            double gamma = s.perimeter * s.perimeter / (2 * turn_angle * s.area); /* (8.16) */
            area += s.area, fit += s.fit, direction += s.direction, deviation += s.deviation;
            irregularity += s.area * gamma;
            for (uint32_t k = 0; k < 3 && s.faces > 1; ++k)
                expect("the normal", i, (double)planes[4 * i + k], s.normal[k], 1e-6);
            if (s.faces > 1) expect("the offset", i, (double)planes[4 * i + 3], s.offset, 1e-6);
        }
        double squared = pow(measure_diagonal(&mesh), 2);
        expect("mean_fit", count, q.mean_fit, fit / area / squared, 1e-9 * fit);
        expect("mean_direction", count, q.mean_direction, direction / area, 1e-9);
        expect("mean_normal_deviation", count, q.mean_normal_deviation, deviation / area, 1e-9);
        expect("mean_irregularity", count, q.mean_irregularity, irregularity / area, 1e-6 * irregularity);
        assert_true(q.connected);
        free(planes), free(labels), free(mates);
        fct_mesh_release(&env, &mesh);
    }
}

/* The box of the surface of a rotated box is that box. Two faces without a common edge are not connected. */
static void boxes_of_labels(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_box(&env, 3, 2, 1);
    turn(&mesh);
    uint32_t labels[12];
    fct_partition_quality q;
    for (uint32_t f = 0; f < 12; ++f) labels[f] = 0;
    assert_int_equal(fct_labels_quality(&env, &mesh, labels, 1, &q), FCT_OK);
    expect("box_area", 1, q.box_area, 2 * (3 * 2 + 2 * 1 + 3 * 1) / pow(measure_diagonal(&mesh), 2), 1e-5);
    assert_true(q.connected);
    labels[0] = 1, labels[7] = 1;
    assert_int_equal(fct_labels_quality(&env, &mesh, labels, 2, &q), FCT_OK);
    uint32_t *mates = find_mates(&mesh), touching = 0;
    for (uint32_t side = 0; side < 3; ++side) touching += mates[side] == 7;
    assert_int_equal(q.connected, touching > 0);
    free(mates);
    fct_mesh_release(&env, &mesh);
}

static void neighbours(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 12, .4, 3);
    enum { COUNT = 17 };
    uint32_t *mates = find_mates(&mesh), *labels = grow_labels(&mesh, COUNT, 5), pairs = 0;
    double lengths[COUNT][COUNT] = {{0}};
    uint32_t edges[COUNT][COUNT] = {{0}};
    for (uint32_t side = 0; side < 3 * mesh.face_count; ++side)
        if (mates[side] != FCT_NONE && labels[side / 3] < labels[mates[side]]) {
            lengths[labels[side / 3]][labels[mates[side]]] += measure_side(&mesh, side);
            ++edges[labels[side / 3]][labels[mates[side]]];
        }
    fct_adjacency found;
    assert_int_equal(fct_labels_adjacency(&env, &mesh, labels, COUNT, &found), FCT_OK);
    for (uint32_t i = 0; i < COUNT; ++i)
        for (uint32_t k = 0; k < COUNT; ++k) pairs += edges[i][k] > 0;
    assert_int_equal(found.pair_count, pairs);
    for (uint32_t i = 0; i < pairs; ++i) {
        uint32_t a = found.pairs[2 * i], b = found.pairs[2 * i + 1];
        assert_true(a < b);
        assert_int_equal(found.edges[i], edges[a][b]);
        expect("the length", i, found.lengths[i], lengths[a][b], 1e-9);
    }
    fct_adjacency_release(&env, &found);
    free(labels), free(mates);
    fct_mesh_release(&env, &mesh);
}

/* --- Refinement --- */

typedef struct state_of_labels {
    double deviation, squares; /* 2 sum (A - |S|) and sum P^2 */
} state_of_labels;

static state_of_labels measure_labels(const fct_mesh *mesh, const uint32_t *mates, const uint32_t *labels,
                                      uint32_t count) {
    state_of_labels total = {0, 0};
    for (uint32_t i = 0; i < count; ++i) {
        sums s = sum_label(mesh, mates, labels, i);
        total.deviation += 2 * (s.area - oracle_norm(s.vector));
        total.squares += s.perimeter * s.perimeter;
    }
    return total;
}

/* Whether the faces of a label are connected without one face. */
static bool stays_connected(const fct_mesh *mesh, const uint32_t *mates, const uint32_t *labels,
                            uint32_t without) {
    uint32_t label = labels[without], *queue = malloc(mesh->face_count * sizeof *queue), head = 0, tail = 0;
    uint32_t wanted = 0;
    bool *seen = calloc(mesh->face_count, sizeof *seen);
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        if (labels[f] != label || f == without) continue;
        if (wanted++ == 0) seen[f] = true, queue[tail++] = f;
    }
    while (head < tail) {
        uint32_t f = queue[head++];
        for (uint32_t side = 3 * f; side < 3 * f + 3; ++side) {
            uint32_t g = mates[side];
            if (g == FCT_NONE || g == without || labels[g] != label || seen[g]) continue;
            seen[g] = true, queue[tail++] = g;
        }
    }
    free(queue), free(seen);
    return tail == wanted && wanted > 0;
}

/* Without a limit, sweeps end in a partition from which no single face can move and lower the energy
 * 2 sum (A - |S|) + w sum P^2, where w is fixed by the start. */
static void refinement_ends_in_a_minimum(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (uint32_t run = 0; run < 6; ++run) {
        fct_mesh mesh = make_terrain(&env, 9, .5, 20 + run);
        uint32_t count = 4 + 3 * run, *mates = find_mates(&mesh),
                 *labels = grow_labels(&mesh, count, run + 1);
        state_of_labels start = measure_labels(&mesh, mates, labels, count);
        fct_refine_def def = fct_refine_def_default();
        fct_refine_stats stats;
        def.sweep_count = 1000, def.perimeter_weight = run % 2 ? .1 : .7, def.irregularity_limit = INFINITY;
        double weight = def.perimeter_weight * start.deviation / start.squares;
        assert_int_equal(fct_partition_refine(&env, &mesh, count, &def, labels, &stats), FCT_OK);
        assert_true(stats.moves > 0 && stats.sweeps < 1000);
        state_of_labels end = measure_labels(&mesh, mates, labels, count);
        double energy = end.deviation + weight * end.squares;
        assert_true(energy < start.deviation + weight * start.squares);
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            uint32_t own = labels[f];
            if (!stays_connected(&mesh, mates, labels, f)) continue;
            for (uint32_t side = 3 * f; side < 3 * f + 3; ++side) {
                if (mates[side] == FCT_NONE || labels[mates[side]] == own) continue;
                labels[f] = labels[mates[side]];
                state_of_labels moved = measure_labels(&mesh, mates, labels, count);
                labels[f] = own;
                double change = moved.deviation + weight * moved.squares - energy;
                if (change < -2e-6 * weight * end.squares)
                    fail_msg("run %u: face %u can still lower the energy by %.3g", run, f, -change);
            }
        }
        free(labels), free(mates);
        fct_mesh_release(&env, &mesh);
    }
}

static void the_limit_holds_for_squared_perimeters(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 12, .8, 9);
    uint32_t *mates = find_mates(&mesh);
    for (int step = 0; step < 3; ++step) {
        const double limits[3] = {1, 1.05, INFINITY};
        uint32_t *fresh = grow_labels(&mesh, 12, 4);
        state_of_labels start = measure_labels(&mesh, mates, fresh, 12);
        fct_refine_def def = fct_refine_def_default();
        def.sweep_count = 100, def.perimeter_weight = 0, def.irregularity_limit = limits[step];
        assert_int_equal(fct_partition_refine(&env, &mesh, 12, &def, fresh, NULL), FCT_OK);
        state_of_labels end = measure_labels(&mesh, mates, fresh, 12);
        assert_true(end.deviation < start.deviation);
        if (step < 2) assert_true(end.squares <= start.squares * limits[step] * (1 + 1e-6));
        if (step == 1) assert_true(end.squares > start.squares); /* the weight alone would let it grow */
        free(fresh);
    }
    free(mates);
    fct_mesh_release(&env, &mesh);
}

/* --- Charts --- */

static void seams_and_angles_of_charts(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 16, .6, 2);
    uint32_t *mates = find_mates(&mesh), *labels = malloc(mesh.face_count * sizeof *labels);
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    for (int step = 0; step < 4; ++step) {
        fct_chart_def def = fct_chart_def_default();
        fct_chart_stats stats;
        def.max_angle = .3 + .2 * step, def.max_faces = step == 2 ? 25 : FCT_NONE;
        def.max_area = step == 3 ? .06 : INFINITY;
        assert_int_equal(fct_tree_charts(&env, tree, &def, labels, &stats), FCT_OK);
        double seam = 0, boundary = 0, widest = 0;
        uint32_t largest = 0;
        for (uint32_t side = 0; side < 3 * mesh.face_count; ++side) {
            if (mates[side] == FCT_NONE)
                boundary += measure_side(&mesh, side);
            else if (labels[mates[side]] != labels[side / 3])
                seam += measure_side(&mesh, side) / 2;
        }
        for (uint32_t i = 0; i < stats.charts; ++i) {
            sums s = sum_label(&mesh, mates, labels, i);
            assert_true(s.faces <= def.max_faces && (s.faces == 1 || s.area <= def.max_area * (1 + 1e-6)));
            if (s.faces > largest) largest = s.faces;
            for (uint32_t f = 0; f < mesh.face_count; ++f) {
                double p[3][3], v[3];
                if (labels[f] != i) continue;
                load_triangle(&mesh, f, p);
                oracle_area_vector((const double(*)[3])p, v);
                widest = fmax(
                    widest, acos(fmin(oracle_dot(v, s.vector) / oracle_norm(v) / oracle_norm(s.vector), 1)));
            }
        }
        assert_int_equal(stats.largest_faces, largest);
        expect("seam_length", (uint32_t)step, stats.seam_length, seam, 1e-9 * seam);
        expect("boundary_length", (uint32_t)step, stats.boundary_length, boundary, 1e-9 * boundary);
        expect("largest_angle", (uint32_t)step, stats.largest_angle, widest, 1e-7);
        assert_true(widest <= def.max_angle + 1e-7);
        assert_true(widest > .8 * def.max_angle || step > 1); /* charts use the allowed angle */
    }
    fct_tree_destroy(tree);
    free(labels), free(mates);
    fct_mesh_release(&env, &mesh);
}

/* --- Meshlets --- */

/* The cone is as narrow as the best of a search over axes. Its apex cannot move forward along the axis
 * without passing the plane of a triangle. The box is as small as the best frame around the mean normal in
 * fine steps, up to the 11 degrees between the angles that the library tries. */
static void cones_and_boxes_are_tight(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_terrain(&env, 20, .3, 6);
    turn(&mesh);
    fct_tree *tree;
    fct_meshlets m;
    uint32_t cones = 0;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_meshlets(&env, tree, NULL, &m), FCT_OK);
    for (uint32_t i = 0; i < m.count; ++i) {
        const fct_meshlet_bounds *b = &m.bounds[i];
        uint32_t faces = m.meshlets[i].triangle_count;
        double axis[3], apex[3], best, s[3] = {0, 0, 0}, back = -INFINITY, p[3][3], v[3];
        for (int k = 0; k < 3; ++k) axis[k] = (double)b->cone_axis[k], apex[k] = (double)b->cone_apex[k];
        for (uint32_t f = 0; f < faces; ++f) {
            load_triangle(&mesh, m.faces[m.first_face[i] + f], p);
            oracle_area_vector((const double(*)[3])p, v);
            for (int k = 0; k < 3; ++k) s[k] += v[k];
        }
        if (b->cone_cutoff < 1) {
            double least = 1;
            for (int trial = -1; trial < 1000; ++trial) { /* the axis, then random axes around it */
                uint32_t seed = (uint32_t)trial * 7919u + 1;
                double other[3], worst = 1, spread = pow(10, -4.0 * (trial % 50) / 50);
                for (int k = 0; k < 3; ++k)
                    other[k] =
                        axis[k] + (trial < 0 ? 0 : spread * ((double)next_random(&seed) / 4294967296.0 - .5));
                double length = oracle_norm(other);
                for (uint32_t f = 0; f < faces; ++f) {
                    load_triangle(&mesh, m.faces[m.first_face[i] + f], p);
                    oracle_area_vector((const double(*)[3])p, v);
                    worst = fmin(worst, oracle_dot(v, other) / oracle_norm(v) / length);
                    double d[3];
                    for (int k = 0; k < 3; ++k) d[k] = apex[k] - p[0][k];
                    if (trial < 0) back = fmax(back, oracle_dot(v, d) / oracle_norm(v));
                }
                if (trial < 0) {
                    least = worst;
                    expect("the cutoff", i, (double)b->cone_cutoff, sqrt(1 - worst * worst), 3e-5);
                    assert_true((double)b->cone_cutoff >= sqrt(1 - worst * worst));
                }
                assert_true(worst <= least + 1e-4);
            }
            assert_true(back <= 1e-9 && back > -1e-4);
            ++cones;
        }
        best = INFINITY;
        for (int step = 0; step < 180; ++step) {
            double n[3], u[3], w[3], extent[3];
            for (int k = 0; k < 3; ++k) n[k] = s[k] / oracle_norm(s);
            double pick[3] = {fabs(n[0]) < .6, fabs(n[0]) >= .6, 0}, flat[3][3];
            for (int k = 0; k < 3; ++k)
                u[k] = n[(k + 1) % 3] * pick[(k + 2) % 3] - n[(k + 2) % 3] * pick[(k + 1) % 3];
            double length = oracle_norm(u);
            for (int k = 0; k < 3; ++k) u[k] /= length;
            for (int k = 0; k < 3; ++k)
                w[k] = n[(k + 1) % 3] * u[(k + 2) % 3] - n[(k + 2) % 3] * u[(k + 1) % 3];
            double c = cos(turn_angle / 720 * step), sine = sin(turn_angle / 720 * step);
            for (int k = 0; k < 3; ++k)
                flat[0][k] = c * u[k] + sine * w[k], flat[1][k] = c * w[k] - sine * u[k], flat[2][k] = n[k];
            for (int a = 0; a < 3; ++a) {
                double low = INFINITY, high = -INFINITY;
                for (uint32_t j = 0; j < m.meshlets[i].vertex_count; ++j) {
                    const float *at =
                        mesh.positions + 3 * (size_t)m.vertices[m.meshlets[i].vertex_offset + j];
                    double x = 0;
                    for (int k = 0; k < 3; ++k) x += (double)at[k] * flat[a][k];
                    low = fmin(low, x), high = fmax(high, x);
                }
                extent[a] = high - low;
            }
            best = fmin(best, extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0]);
        }
        const float *h = b->box.half;
        double own =
            4 * ((double)h[0] * (double)h[1] + (double)h[1] * (double)h[2] + (double)h[2] * (double)h[0]);
        if (own > 1.12 * best) fail_msg("meshlet %u: a box of area %.6g, should be near %.6g", i, own, best);
    }
    assert_true(cones > m.count / 2);
    fct_meshlets_release(&env, &m);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(quality_and_planes),
                                       cmocka_unit_test(boxes_of_labels),
                                       cmocka_unit_test(neighbours),
                                       cmocka_unit_test(refinement_ends_in_a_minimum),
                                       cmocka_unit_test(the_limit_holds_for_squared_perimeters),
                                       cmocka_unit_test(seams_and_angles_of_charts),
                                       cmocka_unit_test(cones_and_boxes_are_tight)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
