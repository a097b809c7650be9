/* The parts of a large mesh: the curve that cuts it, the borders between clusters of different parts, and
 * nodes that hold whole components where no edge leads from one of their children to the other.
 */
#define _GNU_SOURCE
#include "check_tree.h"
#include "shapes.h"

#include <unistd.h>

#include "cluster/large/large.h"
#include "facetree/dual.h"

enum { CELLS = 1 << FCT_CURVE_BITS };

static uint32_t code_of(uint32_t x, uint32_t y, uint32_t z) {
    uint32_t cell[3] = {x, y, z};
    return fct_curve_code(cell);
}

/* The cells of an aligned cube of 2^levels cells per side have consecutive numbers, and consecutive cells
 * have a common side. */
static void check_cube(const uint32_t corner[3], uint32_t levels) {
    uint32_t side = 1u << levels, count = 1u << 3 * levels, first = UINT32_MAX;
    uint32_t *cells = malloc(4 * (size_t)count);
    memset(cells, 0xFF, 4 * (size_t)count);
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t code =
            code_of(corner[0] + i % side, corner[1] + i / side % side, corner[2] + i / side / side);
        first = code < first ? code : first;
    }
    assert_int_equal(first % count, 0);
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t code =
            code_of(corner[0] + i % side, corner[1] + i / side % side, corner[2] + i / side / side);
        assert_true(code - first < count && cells[code - first] == UINT32_MAX);
        cells[code - first] = i;
    }
    for (uint32_t i = 1; i < count; ++i) {
        uint32_t a = cells[i - 1], b = cells[i];
        int steps = abs((int)(a % side) - (int)(b % side)) +
                    abs((int)(a / side % side) - (int)(b / side % side)) +
                    abs((int)(a / side / side) - (int)(b / side / side));
        assert_int_equal(steps, 1);
    }
    free(cells);
}

static void the_curve_visits_neighbours(void **state) {
    (void)state;
    srand(5);
    check_cube((const uint32_t[3]){0, 0, 0}, 6);
    for (int run = 0; run < 200; ++run)
        for (uint32_t levels = 1; levels < 4; ++levels) {
            uint32_t corner[3];
            for (int k = 0; k < 3; ++k) corner[k] = (uint32_t)rand() % (CELLS >> levels) << levels;
            check_cube(corner, levels);
        }
    assert_int_equal(code_of(0, 0, 0), 0);
}

/* --- Borders --- */

static void release_large(fct_large *l) {
    fct_spool *spools[] = {&l->nodes, &l->costs, &l->face_ids, &l->triangles, &l->materials,
                           &l->tops,  &l->sums,  &l->means,    &l->edges,     &l->sides};
    for (size_t i = 0; i < sizeof spools / sizeof *spools; ++i) fct_spool_close(spools[i]);
    fct_stream_close(l->stream);
    fct_release(l->env, l->shared), fct_release(l->env, l->runs), fct_release(l->env, l->parts);
}

/* The top of each face. */
static void find_tops(const fct_large *l, uint32_t *top_of) {
    fct_top *tops = malloc(l->top_count * sizeof *tops);
    uint32_t *ids = malloc(4 * (size_t)l->info.face_count);
    assert_int_equal(fct_spool_read(&l->tops, 0, tops, l->top_count * sizeof *tops), FCT_OK);
    assert_int_equal(fct_spool_read(&l->face_ids, 0, ids, 4 * (size_t)l->info.face_count), FCT_OK);
    for (uint32_t i = 0; i < l->top_count; ++i)
        for (uint32_t k = 0; k < tops[i].count; ++k)
            top_of[ids[l->parts[tops[i].part].first_face + tops[i].first + k]] = i;
    free(tops), free(ids);
}

/* The lengths of all edges between two tops add up to the border between their faces in the whole mesh. */
static void check_borders(const fct_env *env, const fct_mesh *mesh, uint32_t part_faces) {
    char path[] = "/tmp/facetree-borders-XXXXXX.ply";
    int file = mkstemps(path, 4);
    fct_tree_def def = fct_tree_def_default();
    fct_large l = {.env = env, .def = &def, .path = path, .part_faces = part_faces};
    fct_dual dual;
    assert_true(file >= 0 && close(file) == 0);
    def.weld = false;
    assert_int_equal(fct_mesh_save(env, path, mesh, NULL), FCT_OK);
    assert_int_equal(fct_dual_build(env, mesh, &dual), FCT_OK);
    assert_int_equal(fct_stream_open(env, path, NULL, path, &l.stream), FCT_OK);
    l.info = fct_stream_get(l.stream);
    l.budget = 1 << 28, l.top_limit = INT32_MAX;
    assert_int_equal(fct_large_cut(&l), FCT_OK);
    assert_int_equal(fct_large_pieces(&l), FCT_OK);
    assert_int_equal(fct_large_seams(&l), FCT_OK);
    uint32_t n = l.top_count, *top_of = malloc(4 * (size_t)mesh->face_count);
    double *sums = calloc((size_t)n * n, sizeof *sums), all = 0;
    find_tops(&l, top_of);
    double scale = fct_metric_make(&def, &l.bounds).scale;
    for (uint32_t e = 0; e < dual.edge_count; ++e) {
        uint32_t a = top_of[dual.edges[2 * e]], b = top_of[dual.edges[2 * e + 1]];
        double length = (double)dual.lengths[e] * scale;
        sums[a < b ? a * n + b : b * n + a] += length;
        all += length;
    }
    size_t count = l.edges.size / sizeof(fct_top_edge);
    fct_top_edge *edges = malloc(l.edges.size + 1);
    assert_int_equal(fct_spool_read(&l.edges, 0, edges, l.edges.size), FCT_OK);
    for (size_t e = 0; e < count; ++e) {
        uint32_t a = edges[e].a, b = edges[e].b;
        assert_true(a != b && a < n && b < n);
        sums[a < b ? a * n + b : b * n + a] -= (double)edges[e].shared;
    }
    for (uint32_t a = 0; a < n; ++a)
        for (uint32_t b = a + 1; b < n; ++b)
            if (!(fabs(sums[a * n + b]) <= 1e-6 * all)) fail_msg("tops %u and %u: %g", a, b, sums[a * n + b]);
    free(top_of), free(sums), free(edges);
    release_large(&l);
    fct_dual_release(env, &dual);
    unlink(path);
}

static void borders_are_those_of_the_whole_mesh(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    env.thread_count = 1;
    srand(1);
    for (int run = 0; run < 24; ++run) {
        fct_mesh mesh = make_shape(&env, run % 12);
        if (mesh.face_count > 1500) mesh.face_count = 1500;
        if (run % 12 == 5) /* every edge has several faces */
            for (size_t i = 0; i < 3 * (size_t)mesh.face_count; ++i)
                mesh.triangles[i] = (uint32_t)rand() % (mesh.vertex_count < 25 ? mesh.vertex_count : 25);
        check_borders(&env, &mesh, run < 12 ? 1 + mesh.face_count / 5 : 1 + mesh.face_count / 50);
        fct_mesh_release(&env, &mesh);
    }
}

/* --- Components --- */

/* Strips of 1 to 16 triangles, all over the unit cube. components: per face. */
static fct_mesh make_strips(const fct_env *env, uint32_t count, uint32_t *components) {
    fct_mesh mesh;
    uint32_t vertices = 0, faces = 0;
    assert_int_equal(fct_mesh_create(env, 18 * count, 16 * count, 0, &mesh), FCT_OK);
    for (uint32_t c = 0; c < count; ++c) {
        uint32_t length = c % 4 ? 1 : 1 + (uint32_t)rand() % 16;
        float at[3];
        for (int k = 0; k < 3; ++k) at[k] = (float)rand() / (float)RAND_MAX;
        for (uint32_t f = 0; f < length; ++f, ++faces) {
            components[faces] = c;
            for (uint32_t k = 0; k < 3; ++k) mesh.triangles[3 * (size_t)faces + k] = vertices + f + k;
        }
        for (uint32_t v = 0; v < length + 2; ++v, ++vertices)
            for (int k = 0; k < 3; ++k)
                mesh.positions[3 * (size_t)vertices + (size_t)k] =
                    at[k] + 0.02f * (float)(v % 2 ? k == 1 : 0) + 0.02f * (float)(k == 0 ? v : 0);
    }
    mesh.vertex_count = vertices, mesh.face_count = faces;
    return mesh;
}

/* A node lies within one component or consists of whole ones. */
static void check_components(const fct_tree *tree, const uint32_t *components, uint32_t count) {
    fct_tree_view view = fct_tree_get(tree);
    uint32_t *sizes = calloc(count, sizeof *sizes), *found = calloc(count, sizeof *found);
    for (uint32_t f = 0; f < view.face_count; ++f) ++sizes[components[f]];
    for (uint32_t n = 0; n < view.node_count; ++n) {
        const fct_cluster *node = &tree->nodes[n];
        const uint32_t *ids = view.face_ids + node->first;
        uint32_t whole = 0;
        for (uint32_t i = 0; i < node->count; ++i) {
            uint32_t c = components[ids[i]];
            whole += ++found[c] == sizes[c] ? sizes[c] : 0;
        }
        if (whole != node->count && found[components[ids[0]]] != node->count)
            fail_msg("node %u of %u faces has parts of components", n, node->count);
        for (uint32_t i = 0; i < node->count; ++i) found[components[ids[i]]] = 0;
    }
    free(sizes), free(found);
}

static void components_stay_whole_with_little_memory(void **state) {
    (void)state;
    enum { COUNT = 3000 };
    fct_env env = fct_env_default();
    env.thread_count = 1;
    char folder[] = "/tmp/facetree-parts-XXXXXX", mesh_path[64], tree_path[64];
    uint32_t *components = malloc(16 * COUNT * sizeof *components);
    assert_non_null(mkdtemp(folder));
    snprintf(mesh_path, sizeof mesh_path, "%s/mesh.ply", folder);
    snprintf(tree_path, sizeof tree_path, "%s/tree.fct", folder);
    fct_mesh mesh = make_strips(&env, COUNT, components);
    assert_int_equal(fct_mesh_save(&env, mesh_path, &mesh, NULL), FCT_OK);
    for (int option = 0; option < 4; ++option) {
        fct_tree *tree;
        fct_large_stats stats;
        fct_large_def large = fct_large_def_default();
        fct_tree_def def = fct_tree_def_default();
        def.method = option & 1 ? FCT_CLUSTER_GREEDY : FCT_CLUSTER_ROUNDS;
        large.part_faces = 400;
        if (option & 2)
            large.max_memory = fct_tree_build_need(mesh.face_count, mesh.vertex_count, NULL).in_parts;
        assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, &def, &large, &stats), FCT_OK);
        assert_true(option & 2 ? stats.top_count < COUNT / 2 : stats.top_count > COUNT);
        assert_int_equal(fct_tree_open(&env, tree_path, &tree), FCT_OK);
        check_components(tree, components, COUNT);
        fct_tree_destroy(tree);
    }
    unlink(mesh_path), unlink(tree_path), rmdir(folder);
    free(components);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_curve_visits_neighbours),
                                       cmocka_unit_test(borders_are_those_of_the_whole_mesh),
                                       cmocka_unit_test(components_stay_whole_with_little_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
