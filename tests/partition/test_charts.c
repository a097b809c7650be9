/* Charts against the definition of a disk: one fan at every vertex and one simple loop around. */
#include "cluster/shapes.h"

#include "base/math/vec.h"
#include "facetree/partition.h"

typedef struct side {
    uint32_t low, high, face;
} side;

static int compare_sides(const void *a, const void *b) {
    const side *p = a, *q = b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return p->face < q->face ? -1 : p->face > q->face;
}

static uint32_t root_of(const uint32_t *parents, uint32_t i) {
    while (parents[i] != i) i = parents[i];
    return i;
}

static void join(uint32_t *parents, uint32_t a, uint32_t b) {
    parents[root_of(parents, a)] = root_of(parents, b);
}

static uint32_t count_roots(const uint32_t *parents, const bool *used, uint32_t count) {
    uint32_t roots = 0;
    for (uint32_t i = 0; i < count; ++i) roots += used[i] && parents[i] == i;
    return roots;
}

/* Counts of a mesh: parts by edges, fans (corners joined through edges at a vertex), loops of the border.
 */
typedef struct topology {
    uint32_t faces, vertices, edges, parts, fans, loops, crowded, repeated;
    bool loops_simple; /* each border vertex has two border edges */
} topology;

static topology look_at(const fct_mesh *mesh) {
    topology t = {.loops_simple = true};
    uint32_t corners = 3 * mesh->face_count, sides = 0;
    side *list = malloc(corners * sizeof *list);
    uint32_t *faces = malloc(4 * (size_t)corners), *fans = malloc(4 * (size_t)corners),
             *rim = malloc(4 * (size_t)mesh->vertex_count), *degree = calloc(mesh->vertex_count, 4);
    bool *face_used = calloc(corners, 1), *corner_used = calloc(corners, 1),
         *seen = calloc(mesh->vertex_count, 1), *rim_used = calloc(mesh->vertex_count, 1);
    for (uint32_t i = 0; i < corners; ++i) faces[i] = fans[i] = i;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) rim[v] = v;
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *v = mesh->triangles + 3 * (size_t)f;
        ++t.faces;
        face_used[f] = true;
        t.repeated += v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t a = v[k], b = v[(k + 1) % 3];
            corner_used[3 * f + k] = true;
            t.vertices += !seen[a];
            seen[a] = true;
            list[sides++] = (side){a < b ? a : b, a < b ? b : a, f};
        }
    }
    qsort(list, sides, sizeof *list, compare_sides);
    for (uint32_t i = 0, end; i < sides; i = end) {
        for (end = i + 1; end < sides && list[end].low == list[i].low && list[end].high == list[i].high;)
            ++end;
        ++t.edges;
        t.crowded += end - i > 2;
        if (end - i == 1) {
            ++degree[list[i].low], ++degree[list[i].high];
            rim_used[list[i].low] = rim_used[list[i].high] = true;
            join(rim, list[i].low, list[i].high);
        }
        for (uint32_t j = i + 1; j < end; ++j) {
            uint32_t f = list[i].face, g = list[j].face;
            join(faces, f, g);
            for (uint32_t k = 0; k < 3; ++k)
                for (uint32_t l = 0; l < 3; ++l) {
                    uint32_t v = mesh->triangles[3 * (size_t)f + k];
                    if (v == mesh->triangles[3 * (size_t)g + l] && (v == list[i].low || v == list[i].high))
                        join(fans, 3 * f + k, 3 * g + l);
                }
        }
    }
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        t.loops_simple = t.loops_simple && degree[v] % 3 != 1 && degree[v] <= 2;
    t.parts = count_roots(faces, face_used, mesh->face_count);
    t.fans = count_roots(fans, corner_used, corners);
    t.loops = count_roots(rim, rim_used, mesh->vertex_count);
    free(list), free(faces), free(fans), free(rim), free(degree);
    free(face_used), free(corner_used), free(seen), free(rim_used);
    return t;
}

static bool is_disk(const topology *t) {
    return !t->repeated && !t->crowded && t->parts == 1 && t->fans == t->vertices && t->loops == 1 &&
           t->loops_simple && t->vertices + t->faces == t->edges + 1;
}

static v3 vector_of(const fct_mesh *mesh, uint32_t f) {
    const uint32_t *t = mesh->triangles + 3 * (size_t)f;
    v3 p = v3_load(mesh->positions + 3 * (size_t)t[0]);
    return v3_cross(v3_sub(v3_load(mesh->positions + 3 * (size_t)t[1]), p),
                    v3_sub(v3_load(mesh->positions + 3 * (size_t)t[2]), p));
}

static double widest_angle(const fct_mesh *mesh) {
    v3 sum = {0, 0, 0};
    double widest = 0, area = 0;
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        sum = v3_add(sum, vector_of(mesh, f)), area += v3_norm(vector_of(mesh, f));
    if (v3_norm(sum) < 1e-9 * area) return NAN; /* the normals cancel, so there is no direction */
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        v3 n = vector_of(mesh, f);
        if (!(v3_norm(n) > 0)) continue;
        widest = fmax(widest, atan2(v3_norm(v3_cross(n, sum)), v3_dot(n, sum)));
    }
    return widest;
}

/* Checks the guarantees of one chart, which is a mesh of its own. */
static bool check_chart(const fct_mesh *chart, const fct_chart_def *def, double *widest) {
    topology t = look_at(chart);
    *widest = widest_angle(chart);
    assert_true(t.faces <= def->max_faces || t.faces == 1);
    if (!def->any_topology) assert_true(is_disk(&t) || (t.faces == 1 && t.repeated));
    if (t.faces > 1 && !isnan(*widest)) assert_true(*widest <= def->max_angle + 1e-9);
    return is_disk(&t);
}

/* Also compares the reported figures. */
static void check_charts(const fct_mesh *mesh, const uint32_t *labels, const fct_chart_def *def,
                         const fct_chart_stats *stats) {
    fct_env env = fct_env_default();
    uint32_t disks = 0, largest = 0, seen = 0, *faces = malloc(4 * (size_t)mesh->face_count);
    double angle = 0;
    bool cancelled = false;
    for (uint32_t f = 0; f < mesh->face_count; ++f) assert_true(labels[f] < stats->charts);
    for (uint32_t i = 0; i < stats->charts; ++i) {
        uint32_t count = 0;
        double widest;
        fct_mesh chart;
        for (uint32_t f = 0; f < mesh->face_count; ++f)
            if (labels[f] == i) faces[count++] = f;
        assert_true(count > 0);
        assert_int_equal(fct_mesh_extract(&env, mesh, faces, count, &chart, NULL), FCT_OK);
        disks += check_chart(&chart, def, &widest);
        fct_mesh_release(&env, &chart);
        cancelled = cancelled || isnan(widest);
        if (widest > angle) angle = widest;
        if (count > largest) largest = count;
        seen += count;
    }
    assert_int_equal(seen, mesh->face_count);
    assert_int_equal(stats->non_disks, stats->charts - disks);
    assert_int_equal(stats->largest_faces, largest);
    if (!cancelled) assert_true(fabs(stats->largest_angle - angle) < 1e-6);
    free(faces);
}

static void charts_are_disks_within_the_angle(void **state) {
    (void)state;
    static const double angles[] = {0, 0.1, 0.5, 1.2, 3.15};
    fct_env env = fct_env_default();
    for (int shape = 0; shape < SHAPES; ++shape) {
        fct_mesh mesh = make_shape(&env, shape);
        fct_tree *tree = tree_of(&env, &mesh, 1);
        uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
        for (size_t i = 0; i < sizeof angles / sizeof *angles; i += SANITIZED ? 2 : 1)
            for (int kind = 0; kind < 4; ++kind) {
                fct_chart_def def = fct_chart_def_default();
                fct_chart_stats stats;
                def.max_angle = angles[i], def.any_topology = kind == 1, def.keep_cuts = kind == 2;
                if (kind == 3) def.max_faces = 10;
                assert_int_equal(fct_tree_charts(&env, tree, &def, labels, &stats), FCT_OK);
                check_charts(&mesh, labels, &def, &stats);
                if (kind == 2) assert_int_equal(stats.merged, 0);
            }
        free(labels);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
}

static fct_chart_stats charts_of(const fct_env *env, const fct_mesh *mesh, double angle, bool keep_cuts) {
    fct_chart_def def = fct_chart_def_default();
    fct_chart_stats stats;
    uint32_t *labels = malloc(4 * (size_t)mesh->face_count);
    fct_tree *tree = tree_of(env, mesh, 1);
    def.max_angle = angle, def.keep_cuts = keep_cuts;
    assert_int_equal(fct_tree_charts(env, tree, &def, labels, &stats), FCT_OK);
    check_charts(mesh, labels, &def, &stats);
    fct_tree_destroy(tree);
    free(labels);
    return stats;
}

/* Shapes that need few charts get few. */
static void known_surfaces(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh grid = make_grid(&env, 20), sphere = make_sphere(&env, 16),
             tube = make_ring(&env, 40, 6, false, false), bowtie = make_bowtie(&env);
    fct_chart_stats s = charts_of(&env, &grid, 0, false);
    assert_int_equal(s.charts, 1);
    assert_true(s.seam_length == 0 && fabs(s.boundary_length - 4) < 1e-6 && s.largest_angle == 0);
    s = charts_of(&env, &sphere, 3.2, false); /* every angle is allowed, but a sphere is no disk */
    assert_in_range(s.charts, 2, 3);
    assert_true(s.opened_topology >= 1 && s.opened_angle == 0);
    s = charts_of(&env, &tube, pi, false);
    assert_int_equal(s.charts, 2);
    s = charts_of(&env, &bowtie, 0.1, false); /* the squares share only a vertex */
    assert_int_equal(s.charts, 2);
    assert_true(s.seam_length == 0);
    fct_mesh_release(&env, &grid);
    fct_mesh_release(&env, &sphere);
    fct_mesh_release(&env, &tube);
    fct_mesh_release(&env, &bowtie);
}

/* A roof of two squares at right angles: one chart if 45 degrees are allowed, else two with the ridge as
 * seam. */
static void the_angle_decides(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 8);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * (size_t)v;
        p[2] = -fabsf(p[0] - 0.5f);
    }
    fct_chart_stats s = charts_of(&env, &mesh, 45.1 * pi / 180, false);
    assert_int_equal(s.charts, 1);
    assert_true(fabs(s.largest_angle - pi / 4) < 1e-6);
    s = charts_of(&env, &mesh, 44.9 * pi / 180, false);
    assert_int_equal(s.charts, 2);
    assert_int_equal(s.opened_angle, 1);
    assert_true(fabs(s.seam_length - 1) < 1e-6);
    fct_mesh_release(&env, &mesh);
}

/* Two faces of opposite windings are two charts, also where their areas are below the smallest float. */
static void opposite_faces_are_apart_at_every_scale(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int power = 0; power <= 40; power += 10) {
        fct_mesh mesh = make_grid(&env, 1);
        uint32_t swap = mesh.triangles[4];
        mesh.triangles[4] = mesh.triangles[5], mesh.triangles[5] = swap;
        for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
            mesh.positions[i] *= (float)pow(10, -power);
        for (int keep = 0; keep < 2; ++keep) assert_int_equal(charts_of(&env, &mesh, pi / 4, keep).charts, 2);
        fct_mesh_release(&env, &mesh);
    }
}

static void merging_leaves_fewer_charts_and_shorter_seams(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 24);
    roughen(&mesh, 0.04);
    fct_chart_stats cut = charts_of(&env, &mesh, 0.4, true), merged = charts_of(&env, &mesh, 0.4, false);
    assert_int_equal(merged.charts + merged.merged, cut.charts);
    assert_true(merged.charts < 0.9 * cut.charts);
    assert_true(merged.seam_length < 0.95 * cut.seam_length);
    fct_mesh_release(&env, &mesh);
}

static void materials_and_areas_are_kept_apart(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 12);
    mesh.materials = fct_allocate(&env, mesh.face_count, sizeof *mesh.materials);
    mesh.material_count = 2;
    for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f / 2 % 12 < 5;
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
    fct_chart_def def = fct_chart_def_default();
    fct_chart_stats stats;
    assert_int_equal(fct_tree_charts(&env, tree, &def, labels, &stats), FCT_OK);
    assert_int_equal(stats.charts, 2);
    for (uint32_t f = 0; f < mesh.face_count; ++f)
        assert_true((labels[f] == labels[0]) == (mesh.materials[f] == mesh.materials[0]));
    def.max_area = 0.1;
    assert_int_equal(fct_tree_charts(&env, tree, &def, labels, &stats), FCT_OK);
    check_charts(&mesh, labels, &def, &stats);
    assert_in_range(stats.charts, 10, 30);
    assert_true(stats.opened_limit > 0);
    free(labels);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

/* The limits of faces and of area are exact. */
static void limits_are_kept(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_grid(&env, 8);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
    for (uint32_t most = 1; most <= 128; ++most) {
        fct_chart_def def = fct_chart_def_default();
        fct_chart_stats stats;
        uint32_t counts[128] = {0}, largest = 0;
        def.max_faces = most, def.keep_cuts = most % 2;
        assert_int_equal(fct_tree_charts(&env, tree, &def, labels, &stats), FCT_OK);
        for (uint32_t f = 0; f < mesh.face_count; ++f) ++counts[labels[f]];
        for (uint32_t c = 0; c < stats.charts; ++c) largest = counts[c] > largest ? counts[c] : largest;
        assert_in_range(largest, (most + 3) / 4, most);
    }
    free(labels);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

/* Thousands of sheets on one edge, and sheets on the rims of others: no chart has such an edge twice inside.
 */
static void crowded_edges(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh book = make_book(&env, 5000), doubled = make_doubled(&env, 10);
    fct_tree *tree = tree_of(&env, &book, 1);
    uint32_t *labels = malloc(4 * (size_t)book.face_count);
    fct_chart_def def = fct_chart_def_default();
    fct_chart_stats stats;
    assert_int_equal(fct_tree_charts(&env, tree, &def, labels, &stats), FCT_OK);
    assert_int_equal(stats.non_disks, 0);
    assert_true(stats.largest_faces <= 2 && stats.charts >= 2500);
    stats = charts_of(&env, &doubled, 0.1, false);
    assert_true(stats.charts >= 2 && stats.non_disks == 0);
    free(labels);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &book);
    fct_mesh_release(&env, &doubled);
}

static void bad_options_are_refused(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 2);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t labels[8];
    for (int bad = 0; bad < 5; ++bad) {
        fct_chart_def def = fct_chart_def_default();
        if (bad == 0) def.size = 4;
        if (bad == 1) def.max_angle = -1;
        if (bad == 2) def.max_angle = NAN;
        if (bad == 3) def.max_faces = 0;
        if (bad == 4) def.max_area = NAN;
        r.text[0] = 0;
        assert_int_equal(fct_tree_charts(&env, tree, &def, labels, NULL), FCT_ERROR_DATA);
        assert_non_null(strstr(r.text, "expected"));
    }
    assert_int_equal(fct_tree_charts(&env, tree, NULL, labels, NULL), FCT_OK);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void same_for_every_thread_count(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, SANITIZED ? 40 : 100);
    roughen(&mesh, 0.01);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t *labels[3];
    fct_chart_stats stats[3];
    for (uint32_t t = 0; t < 3; ++t) {
        fct_env some = env;
        some.thread_count = t + 1;
        labels[t] = malloc(4 * (size_t)mesh.face_count);
        memset(&stats[t], 0, sizeof stats[t]);
        assert_int_equal(fct_tree_charts(&some, tree, NULL, labels[t], &stats[t]), FCT_OK);
        assert_memory_equal(labels[t], labels[0], 4 * (size_t)mesh.face_count);
        assert_memory_equal(&stats[t], &stats[0], sizeof *stats);
    }
    for (int t = 0; t < 3; ++t) free(labels[t]);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void survives_no_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_sphere(&env, 10);
    fct_tree *tree = tree_of(&env, &mesh, 1);
    uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
    fct_chart_stats stats;
    long before = r.alive;
    fct_result result = FCT_ERROR_MEMORY;
    for (r.fail_at = 1; result != FCT_OK; ++r.fail_at) {
        r.allocations = 0;
        result = fct_tree_charts(&env, tree, NULL, labels, &stats);
        assert_int_equal(r.alive, before);
        if (result != FCT_OK) assert_int_equal(result, FCT_ERROR_MEMORY);
    }
    assert_true(r.fail_at > 30);
    free(labels);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(charts_are_disks_within_the_angle),
                                       cmocka_unit_test(known_surfaces),
                                       cmocka_unit_test(the_angle_decides),
                                       cmocka_unit_test(opposite_faces_are_apart_at_every_scale),
                                       cmocka_unit_test(merging_leaves_fewer_charts_and_shorter_seams),
                                       cmocka_unit_test(materials_and_areas_are_kept_apart),
                                       cmocka_unit_test(limits_are_kept),
                                       cmocka_unit_test(crowded_edges),
                                       cmocka_unit_test(bad_options_are_refused),
                                       cmocka_unit_test(same_for_every_thread_count),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
