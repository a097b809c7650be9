/* Refinement of partitions: the deviation of normals falls, clusters keep a face and do not fall into more
 * pieces, borders stay short. On generated shapes, on odd meshes, and with failing allocations. */
#include "cluster/check_tree.h"

#include "base/math/vec.h"
#include "facetree/dual.h"
#include "facetree/partition.h"

static const double pi = 3.14159265358979323846;

static v3 area_vector(const fct_mesh *mesh, uint32_t face) {
    v3 p[3];
    for (int k = 0; k < 3; ++k)
        p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + (size_t)k]);
    return v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
}

static uint32_t root_of(uint32_t *parents, uint32_t i) {
    while (parents[i] != i) i = parents[i] = parents[parents[i]];
    return i;
}

/* Measures of a partition by direct sums. */
typedef struct account {
    double area, deviation, squares; /* squares: of the clusters' perimeters */
    uint32_t filled, pieces;         /* clusters with faces; connected pieces of all clusters */
} account;

static account account_of(const fct_mesh *mesh, const uint32_t *labels, uint32_t count) {
    fct_env env = fct_env_default();
    account out = {0};
    fct_dual dual;
    assert_int_equal(fct_dual_build(&env, mesh, &dual), FCT_OK);
    double *sums = calloc(count, 5 * sizeof *sums); /* area vector, area, perimeter */
    uint32_t *parents = malloc(4 * (size_t)mesh->face_count);
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        assert_true(labels[f] < count);
        double *s = sums + 5 * (size_t)labels[f];
        v3 a = area_vector(mesh, f);
        s[0] += a.x, s[1] += a.y, s[2] += a.z, s[3] += v3_norm(a), s[4] += (double)dual.perimeters[f];
        parents[f] = f;
    }
    out.pieces = mesh->face_count;
    for (uint32_t e = 0; e < dual.edge_count; ++e) {
        uint32_t a = dual.edges[2 * e], b = dual.edges[2 * e + 1];
        if (labels[a] != labels[b]) continue;
        sums[5 * (size_t)labels[a] + 4] -= 2 * (double)dual.lengths[e];
        a = root_of(parents, a), b = root_of(parents, b);
        if (a != b) parents[a] = b, --out.pieces;
    }
    for (uint32_t i = 0; i < count; ++i) {
        const double *s = sums + 5 * (size_t)i;
        out.area += s[3];
        out.deviation += 2 * (s[3] - sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]));
        out.squares += s[4] * s[4];
    }
    memset(sums, 0, count * sizeof *sums);
    for (uint32_t f = 0; f < mesh->face_count; ++f) sums[labels[f]] = 1;
    for (uint32_t i = 0; i < count; ++i) out.filled += sums[i] > 0;
    free(sums);
    free(parents);
    fct_dual_release(&env, &dual);
    return out;
}

/* Counts the connected pieces of each cluster. */
static uint32_t *pieces_of(const fct_mesh *mesh, const uint32_t *labels, uint32_t count) {
    fct_env env = fct_env_default();
    fct_dual dual;
    assert_int_equal(fct_dual_build(&env, mesh, &dual), FCT_OK);
    uint32_t *parents = malloc(4 * (size_t)mesh->face_count), *pieces = calloc(count, 4);
    for (uint32_t f = 0; f < mesh->face_count; ++f) parents[f] = f, ++pieces[labels[f]];
    for (uint32_t e = 0; e < dual.edge_count; ++e) {
        uint32_t a = dual.edges[2 * e], b = dual.edges[2 * e + 1], label = labels[a];
        if (label != labels[b]) continue;
        a = root_of(parents, a), b = root_of(parents, b);
        if (a != b) parents[a] = b, --pieces[label];
    }
    free(parents);
    fct_dual_release(&env, &dual);
    return pieces;
}

/* Checks the guarantees for every mesh. Returns the relative decrease of the deviation. */
static double check_refined(const fct_mesh *mesh, const uint32_t *old_labels, const uint32_t *labels,
                            uint32_t count, const fct_refine_def *def) {
    fct_refine_def used = def ? *def : fct_refine_def_default();
    account old = account_of(mesh, old_labels, count), after = account_of(mesh, labels, count);
    const account *before = &old;
    uint32_t *old_pieces = pieces_of(mesh, old_labels, count), *pieces = pieces_of(mesh, labels, count);
    for (uint32_t i = 0; i < count; ++i) {
        assert_true(pieces[i] <= old_pieces[i]);
        assert_true((pieces[i] > 0) == (old_pieces[i] > 0));
    }
    free(old_pieces);
    free(pieces);
    if (used.irregularity_limit < INFINITY)
        assert_true(after.squares <= before->squares * used.irregularity_limit * (1 + 1e-9) + 1e-30);
    double weight = used.perimeter_weight * before->deviation / before->squares;
    if (before->deviation > 1e-5 * before->area)
        assert_true(after.deviation + weight * after.squares <=
                    (before->deviation + weight * before->squares) * (1 + 1e-9));
    return 1 - after.deviation / before->deviation;
}

static uint32_t *copy_labels(const fct_mesh *mesh, const uint32_t *labels) {
    uint32_t *copy = malloc(4 * (size_t)mesh->face_count);
    memcpy(copy, labels, 4 * (size_t)mesh->face_count);
    return copy;
}

static double refine(const fct_mesh *mesh, uint32_t *labels, uint32_t count, const fct_refine_def *def) {
    fct_env env = fct_env_default();
    fct_refine_stats stats;
    uint32_t *before = copy_labels(mesh, labels);
    assert_int_equal(fct_partition_refine(&env, mesh, count, def, labels, &stats), FCT_OK);
    assert_true(stats.sweeps <= (def ? def->sweep_count : 4));
    double fall = check_refined(mesh, before, labels, count, def);
    free(before);
    return fall;
}

static void fill_labels(const fct_mesh *mesh, uint32_t count, uint32_t *labels) {
    fct_env env = fct_env_default();
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, mesh, NULL, NULL, &tree), FCT_OK);
    uint32_t *nodes = malloc(4 * (size_t)count);
    assert_int_equal(cut_tree(tree, count, nodes), count);
    assert_int_equal(fct_tree_labels(&env, tree, nodes, count, labels), FCT_OK);
    free(nodes);
    fct_tree_destroy(tree);
}

/* Refines a cut of the mesh's tree. labels receives the result. */
static double refine_tree(const fct_mesh *mesh, uint32_t count, const fct_refine_def *def, uint32_t *labels) {
    fct_env env = fct_env_default();
    fct_tree *tree;
    fct_refine_stats stats;
    assert_int_equal(fct_tree_build(&env, mesh, NULL, NULL, &tree), FCT_OK);
    uint32_t *nodes = malloc(4 * (size_t)count);
    assert_int_equal(cut_tree(tree, count, nodes), count);
    assert_int_equal(fct_tree_labels(&env, tree, nodes, count, labels), FCT_OK);
    uint32_t *before = copy_labels(mesh, labels);
    assert_int_equal(fct_tree_refine(&env, tree, nodes, count, def, labels, &stats), FCT_OK);
    assert_true(stats.sweeps >= 1);
    free(nodes);
    fct_tree_destroy(tree);
    double fall = check_refined(mesh, before, labels, count, def);
    free(before);
    return fall;
}

/* Two flat halves that meet at a right angle at x = 1/2. The border of the labels is ragged and one column
 * beside the fold:
 *
 *    0 0 0|0 1 1     the fold is at |, where the border must move to
 *    0 0 1|1 1 1
 */
static void border_finds_the_fold(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    enum { N = 16 };
    fct_mesh mesh = make_grid(&env, N);
    uint32_t labels[2 * N * N];
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * v;
        if (p[0] > 0.5f) p[2] = p[0] - 0.5f, p[0] = 0.5f;
    }
    for (uint32_t f = 0; f < 2 * N * N; ++f) {
        uint32_t column = f / 2 % N, row = f / 2 / N;
        labels[f] = column >= N / 2 - 1 + (row % 3);
    }
    fct_refine_def def = fct_refine_def_default();
    def.sweep_count = 100;
    assert_true(refine(&mesh, labels, 2, &def) > 1 - 1e-9);
    for (uint32_t f = 0; f < 2 * N * N; ++f) assert_int_equal(labels[f], f / 2 % N >= N / 2);
    fct_mesh_release(&env, &mesh);
}

/* On flat ground only borders count: a ragged one is straightened, a straight one stays. */
static void flat_borders_are_straightened(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    enum { N = 12 };
    fct_mesh mesh = make_grid(&env, N);
    uint32_t labels[2 * N * N], kept[2 * N * N];
    for (uint32_t f = 0; f < 2 * N * N; ++f) kept[f] = labels[f] = f / 2 % N >= N / 2;
    fct_refine_stats stats;
    assert_int_equal(fct_partition_refine(&env, &mesh, 2, NULL, labels, &stats), FCT_OK);
    assert_int_equal(stats.moves, 0);
    assert_int_equal(stats.sweeps, 1);
    assert_memory_equal(labels, kept, sizeof labels);
    for (uint32_t f = 0; f < 2 * N * N; ++f) labels[f] = f / 2 % N + (f / 2 / N % 2) >= N / 2;
    account before = account_of(&mesh, labels, 2);
    fct_refine_def def = fct_refine_def_default();
    def.sweep_count = 50;
    refine(&mesh, labels, 2, &def);
    assert_true(account_of(&mesh, labels, 2).squares < 0.7 * before.squares);
    fct_mesh_release(&env, &mesh);
}

static void spheres_and_counts(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 30);
    uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
    for (uint32_t k = 1; k <= mesh.face_count; k = 2 * k + 3) {
        fill_labels(&mesh, k, labels);
        double fall = refine(&mesh, labels, k, NULL);
        if (k > 10 && k < 200) assert_true(fall > 0.02);
        fct_refine_def def = fct_refine_def_default();
        fill_labels(&mesh, k, labels);
        def.perimeter_weight = 0, def.irregularity_limit = INFINITY;
        if (k > 1 && k < mesh.face_count) assert_true(refine(&mesh, labels, k, &def) >= 0);
    }
    fill_labels(&mesh, mesh.face_count - 1, labels);
    refine(&mesh, labels, mesh.face_count - 1, NULL);
    free(labels);
    fct_mesh_release(&env, &mesh);
}

static uint32_t next(uint32_t *seed) {
    return (*seed = *seed * 1664525u + 1013904223u) >> 8;
}

/* Connected clusters of ragged shape: from one face each, neighbours of labelled faces join at random. */
static void grow_labels(const fct_mesh *mesh, uint32_t count, uint32_t *seed, uint32_t *labels) {
    fct_env env = fct_env_default();
    fct_dual dual;
    assert_int_equal(fct_dual_build(&env, mesh, &dual), FCT_OK);
    memset(labels, 0xFF, 4 * (size_t)mesh->face_count);
    for (uint32_t i = 0; i < count;) {
        uint32_t f = next(seed) % mesh->face_count;
        if (labels[f] == FCT_NONE) labels[f] = i++;
    }
    for (uint32_t left = mesh->face_count - count; left > 0;) {
        const uint32_t *e = dual.edges + 2 * (size_t)(next(seed) % dual.edge_count);
        if ((labels[e[0]] == FCT_NONE) == (labels[e[1]] == FCT_NONE)) continue;
        labels[e[labels[e[0]] != FCT_NONE]] = labels[e[labels[e[0]] == FCT_NONE]];
        --left;
    }
    fct_dual_release(&env, &dual);
}

/* Crumpled paper with no weight on borders: clusters grow arms and close rings, but none falls apart. */
static void clusters_stay_in_one_piece(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t seed = 3;
    for (uint32_t round = 0; round < 100; ++round) {
        uint32_t n = 4 + round % 9, count = 2 + next(&seed) % n;
        fct_mesh mesh = make_grid(&env, n);
        uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v)
            mesh.positions[3 * v + 2] = (float)(next(&seed) % 100) * 0.01f / (float)n;
        grow_labels(&mesh, count, &seed, labels);
        assert_int_equal(account_of(&mesh, labels, count).pieces, count);
        fct_refine_def def = fct_refine_def_default();
        def.perimeter_weight = 0, def.irregularity_limit = INFINITY, def.sweep_count = 20;
        refine(&mesh, labels, count, &def);
        assert_int_equal(account_of(&mesh, labels, count).pieces, count);
        free(labels);
        fct_mesh_release(&env, &mesh);
    }
}

/* A lid on a pipe of one row of faces. A face may leave the pipe's ring, because the rest of the ring stays
 * connected the other way round. */
static void rings_may_be_opened(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh;
    enum { N = 12 };
    assert_int_equal(fct_mesh_create(&env, 2 * N + 1, 3 * N, 0, &mesh), FCT_OK);
    memset(mesh.positions + 6 * N, 0, 3 * sizeof(float));
    uint32_t labels[3 * N];
    for (uint32_t i = 0; i < N; ++i) {
        uint32_t k = (i + 1) % N, three[9] = {2 * N, i, k, i, N + i, N + k, i, N + k, k};
        for (uint32_t j = 0; j < 2; ++j) {
            float *p = mesh.positions + 3 * (j * N + i);
            p[0] = (float)cos(2 * pi * i / N), p[1] = (float)sin(2 * pi * i / N), p[2] = -(float)j;
        }
        memcpy(mesh.triangles + 9 * i, three, sizeof three);
        labels[3 * i] = 0, labels[3 * i + 1] = labels[3 * i + 2] = 1;
    }
    fct_refine_def def = fct_refine_def_default();
    def.perimeter_weight = 0, def.irregularity_limit = INFINITY;
    assert_true(refine(&mesh, labels, 2, &def) > 0.1);
    assert_int_equal(account_of(&mesh, labels, 2).pieces, 2);
    fct_mesh_release(&env, &mesh);
}

/* Random triangles over few vertices: edges with many faces, duplicates, faces without area. */
static void odd_meshes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t seed = 1;
    for (int round = 0; round < 300; ++round) {
        uint32_t vertices = 3 + next(&seed) % 20, faces = 1 + next(&seed) % 60, count = 1 + next(&seed) % 8;
        fct_mesh mesh;
        assert_int_equal(fct_mesh_create(&env, vertices, faces, FCT_MESH_MATERIALS, &mesh), FCT_OK);
        float scale = round % 3 == 0 ? 1e-30f : round % 3 == 1 ? 1 : 1e18f;
        for (uint32_t i = 0; i < 3 * vertices; ++i) mesh.positions[i] = (float)(next(&seed) % 8) * scale;
        for (uint32_t i = 0; i < 3 * faces; ++i) mesh.triangles[i] = next(&seed) % vertices;
        uint32_t labels[64], firsts[8], seen = 0;
        for (uint32_t f = 0; f < faces; ++f)
            labels[f] = next(&seed) % count, mesh.materials[f] = labels[f] / 2;
        mesh.material_count = 4;
        uint32_t *materials = mesh.materials;
        if (round % 2) mesh.materials = NULL;
        fct_refine_def def = fct_refine_def_default();
        def.perimeter_weight = (round % 4) * 0.1;
        def.irregularity_limit = round % 5 ? 1 + 0.1 * (round % 7) : INFINITY;
        def.sweep_count = 1 + (uint32_t)round % 6;
        refine(&mesh, labels, count, &def);
        for (uint32_t f = 0; mesh.materials && f < faces; ++f) {
            if (!(seen >> labels[f] & 1)) seen |= 1u << labels[f], firsts[labels[f]] = materials[f];
            assert_int_equal(materials[f],
                             firsts[labels[f]]); /* a cluster of one material keeps its material */
        }
        mesh.materials = materials;
        fct_mesh_release(&env, &mesh);
    }
}

/* On a fine sphere with few clusters, single faces improve little, and clusters of finer cuts much. */
static void finer_cuts_move_first(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 90);
    uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
    fill_labels(&mesh, 30, labels);
    double fine = refine(&mesh, labels, 30, NULL), both = refine_tree(&mesh, 30, NULL, labels);
    assert_true(both > 2 * fine && both > 0.05);
    for (uint32_t k = 1; k <= mesh.face_count; k = 5 * k + 1) refine_tree(&mesh, k, NULL, labels);
    refine_tree(&mesh, mesh.face_count, NULL, labels);
    free(labels);
    fct_mesh_release(&env, &mesh);
}

static bool is_mixed(const uint32_t *labels, const uint32_t *materials, uint32_t faces, uint32_t label) {
    bool seen[2] = {false, false};
    for (uint32_t f = 0; f < faces; ++f)
        if (labels[f] == label) seen[materials[f]] = true;
    return seen[0] && seen[1];
}

/* Crumpled, torn paper with doubled faces: several parts, edges with three or more faces, two materials in
 * patches. In cuts with few clusters a cluster has several parts. */
static void torn_and_doubled_sheets(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t seed = 11;
    for (uint32_t round = 0; round < 24; round += 3) {
        fct_mesh grid = make_grid(&env, 14), mesh;
        uint32_t *kept = malloc(4 * (size_t)grid.face_count), count = 0;
        uint32_t *labels = malloc(4 * (size_t)grid.face_count);
        for (uint32_t f = 0; f < grid.face_count; ++f)
            if (next(&seed) % 16 >= round % 8) kept[count++] = f;
        assert_int_equal(fct_mesh_extract(&env, &grid, kept, count, &mesh, NULL), FCT_OK);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v)
            mesh.positions[3 * v + 2] = (float)(next(&seed) % 100) * 0.002f;
        for (uint32_t i = 0; i < 3 * round; ++i) /* double */
            memcpy(mesh.triangles + 3 * (next(&seed) % count), mesh.triangles + 3 * (next(&seed) % count),
                   12);
        fct_refine_def def = fct_refine_def_default();
        if (round % 2 == 0) def.perimeter_weight = 0, def.irregularity_limit = INFINITY;
        uint32_t *materials = malloc(4 * (size_t)count);
        for (uint32_t f = 0; f < count; ++f) materials[f] = (kept[f] / 2 % 14 / 3 + kept[f] / 84) % 2;
        for (uint32_t k = 1; k < count; k = k < 8 ? k + 1 : 5 * k) {
            refine_tree(&mesh, k, &def, labels);
            mesh.materials = materials, mesh.material_count = 2;
            uint32_t mixed_before = 0, mixed = 0;
            fill_labels(&mesh, k, labels);
            for (uint32_t i = 0; i < k; ++i) mixed_before += is_mixed(labels, materials, count, i);
            refine_tree(&mesh, k, &def, labels);
            for (uint32_t i = 0; i < k; ++i) mixed += is_mixed(labels, materials, count, i);
            assert_true(mixed <= mixed_before);
            mesh.materials = NULL, mesh.material_count = 0;
        }
        free(materials);
        free(labels);
        free(kept);
        fct_mesh_release(&env, &mesh);
        fct_mesh_release(&env, &grid);
    }
}

static void same_for_every_thread_count(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 50);
    size_t bytes = 4 * (size_t)mesh.face_count;
    uint32_t *start = malloc(bytes), *one = malloc(bytes), *more = malloc(bytes);
    fill_labels(&mesh, 60, start);
    memcpy(one, start, bytes);
    env.thread_count = 1;
    assert_int_equal(fct_partition_refine(&env, &mesh, 60, NULL, one, NULL), FCT_OK);
    assert_memory_not_equal(one, start, bytes);
    for (uint32_t threads = 2; threads < 6; ++threads) {
        env.thread_count = threads;
        memcpy(more, start, bytes);
        assert_int_equal(fct_partition_refine(&env, &mesh, 60, NULL, more, NULL), FCT_OK);
        assert_memory_equal(one, more, bytes);
        fct_partition_quality a, b;
        assert_int_equal(fct_labels_quality(&env, &mesh, more, 60, &a), FCT_OK);
        env.thread_count = 1;
        assert_int_equal(fct_labels_quality(&env, &mesh, one, 60, &b), FCT_OK);
        assert_memory_equal(&a, &b, offsetof(fct_partition_quality, connected));
        assert_int_equal(a.connected, b.connected);
    }
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    uint32_t nodes[60];
    assert_int_equal(cut_tree(tree, 60, nodes), 60);
    for (uint32_t threads = 1; threads < 5; ++threads) {
        env.thread_count = threads;
        uint32_t *out = threads == 1 ? one : more;
        assert_int_equal(fct_tree_refine(&env, tree, nodes, 60, NULL, out, NULL), FCT_OK);
        assert_memory_equal(one, out, bytes);
    }
    fct_tree_destroy(tree);
    free(start);
    free(one);
    free(more);
    fct_mesh_release(&env, &mesh);
}

static void bad_options_and_labels(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh = make_grid(&env, 2);
    uint32_t labels[8] = {0, 1, 0, 1, 0, 1, 0, 2};
    fct_partition_quality q;
    assert_int_equal(fct_partition_refine(&env, &mesh, 2, NULL, labels, NULL), FCT_ERROR_DATA);
    assert_string_equal(r.text, "face 7: label 2 is out of range, of 2 clusters");
    assert_int_equal(fct_labels_quality(&env, &mesh, labels, 2, &q), FCT_ERROR_DATA);
    assert_int_equal(fct_labels_quality(&env, &mesh, labels, 4, &q), FCT_OK); /* cluster 3 is empty */
    assert_false(q.connected);
    fct_refine_def good = fct_refine_def_default(), def;
    const double weights[] = {-1, 2e6, NAN}, limits[] = {0.5, -INFINITY, NAN};
    for (int i = 0; i < 3; ++i) {
        def = good, def.perimeter_weight = weights[i];
        assert_int_equal(fct_partition_refine(&env, &mesh, 3, &def, labels, NULL), FCT_ERROR_DATA);
        def = good, def.irregularity_limit = limits[i];
        assert_int_equal(fct_partition_refine(&env, &mesh, 3, &def, labels, NULL), FCT_ERROR_DATA);
    }
    fct_tree *tree;
    uint32_t node = 0;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    def = good, def.perimeter_weight = -1;
    assert_int_equal(fct_tree_refine(&env, tree, &node, 1, &def, labels, NULL), FCT_ERROR_DATA);
    assert_int_equal(labels[7], 2);
    fct_tree_destroy(tree);
    def = good, def.size = 4;
    assert_int_equal(fct_partition_refine(&env, &mesh, 3, &def, labels, NULL), FCT_ERROR_DATA);
    mesh.positions[5] = NAN;
    assert_int_equal(fct_partition_refine(&env, &mesh, 3, &good, labels, NULL), FCT_ERROR_DATA);
    fct_mesh_release(&env, &mesh);
    fct_mesh none = {0};
    assert_int_equal(fct_partition_refine(&env, &none, 0, NULL, NULL, NULL), FCT_OK);
    assert_int_equal(fct_labels_quality(&env, &none, NULL, 0, &q), FCT_OK);
    assert_true(q.connected && q.mean_fit == 0);
    assert_int_equal(r.alive, 0);
}

static bool cancel(void *user, const char *phase, double done) {
    (void)phase, (void)done;
    return --*(long *)user > 0;
}

static void failures_leave_the_labels(void **state) {
    (void)state;
    fct_env plain = fct_env_default();
    fct_mesh mesh = make_sphere(&plain, 8);
    uint32_t labels[256], start[256];
    fill_labels(&mesh, 12, start);
    fct_result result = FCT_ERROR_MEMORY;
    for (long nth = 1; result != FCT_OK; ++nth) {
        recorder r = {.fail_at = nth};
        fct_env env = recorder_env(&r);
        memcpy(labels, start, 4 * (size_t)mesh.face_count);
        result = fct_partition_refine(&env, &mesh, 12, NULL, labels, NULL);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
        if (result != FCT_OK) assert_memory_equal(labels, start, 4 * (size_t)mesh.face_count);
        assert_int_equal(r.alive, 0);
        if (result == FCT_OK) assert_true(nth > 12);
        r = (recorder){.fail_at = nth};
        fct_partition_quality q;
        fct_result measured = fct_labels_quality(&env, &mesh, labels, 12, &q);
        assert_true(measured == FCT_OK || measured == FCT_ERROR_MEMORY);
        float planes[48];
        r.allocations = 0;
        measured = fct_labels_planes(&env, &mesh, labels, 12, planes);
        assert_true(nth > 2 ? measured == FCT_OK : measured == FCT_ERROR_MEMORY);
        assert_int_equal(r.alive, 0);
    }
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&plain, &mesh, NULL, NULL, &tree), FCT_OK);
    uint32_t nodes[12];
    assert_int_equal(cut_tree(tree, 12, nodes), 12);
    result = FCT_ERROR_MEMORY;
    for (long nth = 1; result != FCT_OK; ++nth) {
        recorder r = {.fail_at = nth};
        fct_env env = recorder_env(&r);
        memcpy(labels, start, 4 * (size_t)mesh.face_count);
        result = fct_tree_refine(&env, tree, nodes, 12, NULL, labels, NULL);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
        assert_true(result == FCT_OK ? nth > 30 : r.text[0] != 0);
        if (result != FCT_OK) assert_memory_equal(labels, start, 4 * (size_t)mesh.face_count);
        assert_int_equal(r.alive, 0);
    }
    result = FCT_ERROR_CANCELLED;
    for (long calls = 1; result != FCT_OK; ++calls) {
        long left = calls;
        fct_env env = fct_env_default();
        env.progress = cancel;
        env.progress_user = &left;
        memcpy(labels, start, 4 * (size_t)mesh.face_count);
        result = fct_tree_refine(&env, tree, nodes, 12, NULL, labels, NULL);
        assert_true(result == FCT_OK ? calls > 5 : result == FCT_ERROR_CANCELLED);
        if (result != FCT_OK) assert_memory_equal(labels, start, 4 * (size_t)mesh.face_count);
    }
    fct_tree_destroy(tree);
    result = FCT_ERROR_CANCELLED;
    for (long calls = 1; result != FCT_OK; ++calls) {
        long left = calls;
        fct_env env = fct_env_default();
        env.progress = cancel;
        env.progress_user = &left;
        memcpy(labels, start, 4 * (size_t)mesh.face_count);
        result = fct_partition_refine(&env, &mesh, 12, NULL, labels, NULL);
        assert_true(result == FCT_OK || result == FCT_ERROR_CANCELLED);
        if (result != FCT_OK) assert_memory_equal(labels, start, 4 * (size_t)mesh.face_count);
    }
    fct_mesh_release(&plain, &mesh);
}

/* Labels of a cut give the same numbers as the cut. */
static void quality_is_that_of_the_cut(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_sphere(&env, 20);
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    uint32_t nodes[50], *labels = malloc(4 * (size_t)mesh.face_count);
    for (uint32_t k = 1; k <= 50; k += 7) {
        fct_partition_quality a, b;
        assert_int_equal(cut_tree(tree, k, nodes), k);
        assert_int_equal(fct_tree_labels(&env, tree, nodes, k, labels), FCT_OK);
        assert_int_equal(fct_tree_quality(&env, tree, nodes, k, &a), FCT_OK);
        assert_int_equal(fct_labels_quality(&env, &mesh, labels, k, &b), FCT_OK);
        assert_true(fabs(a.mean_fit - b.mean_fit) <= 1e-9 * a.mean_fit);
        assert_true(fabs(a.mean_direction - b.mean_direction) <= 1e-9 * a.mean_direction);
        assert_true(fabs(a.mean_normal_deviation - b.mean_normal_deviation) <=
                    1e-9 * a.mean_normal_deviation);
        assert_true(fabs(a.mean_irregularity - b.mean_irregularity) <= 1e-6 * a.mean_irregularity);
        assert_true(b.box_area <= 1.01 * a.box_area && b.box_area >= 0.94 * a.box_area);
        assert_int_equal(a.connected, b.connected);
        float planes[4 * 50];
        assert_int_equal(fct_labels_planes(&env, &mesh, labels, k, planes), FCT_OK);
        for (uint32_t i = 0; i < k && k > 1; ++i) {
            fct_cluster cluster;
            fct_tree_cluster(tree, nodes[i], &cluster);
            for (int c = 0; c < 4; ++c)
                assert_true(fabs((double)(planes[4 * i + (uint32_t)c] - cluster.plane[c])) < 1e-5);
        }
        account sums = account_of(&mesh, labels, k);
        assert_true(fabs(b.mean_normal_deviation - sums.deviation / sums.area) <= 1e-9);
        assert_true(fabs(b.mean_irregularity - sums.squares / (4 * pi * sums.area)) <= 1e-6);
    }
    free(labels);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

/* Two triangles of a strip of four make a cluster in one piece only if they are neighbours. */
static void a_torn_cluster_is_not_connected(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    float positions[18] = {0, 0, 0, 1, 1, 0, 2, 0, 0, 3, 1, 0, 4, 0, 0, 5, 1, 0};
    uint32_t triangles[12] = {0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5},
             labels[3][4] = {{0, 0, 1, 1}, {0, 1, 1, 0}, {0, 1, 0, 1}};
    fct_mesh mesh = {.vertex_count = 6, .face_count = 4, .positions = positions, .triangles = triangles};
    for (int i = 0; i < 3; ++i) {
        fct_partition_quality quality;
        assert_int_equal(fct_labels_quality(&env, &mesh, labels[i], 2, &quality), FCT_OK);
        assert_int_equal(quality.connected, i == 0);
    }
}

static void real_meshes(void **state) {
    (void)state;
    const struct {
        const char *name;
        uint32_t count;
        double fall, tree_fall;
    } models[] = {
        {"stanford-bunny", 1000, 0.09, 0.11}, {"cow", 50, 0.10, 0.14}, {"fandisk", 1000, 0.07, 0.08}};
    if (!file_exists(FACETREE_DATA "/cow.obj")) skip();
    for (size_t i = 0; i < sizeof models / sizeof *models; ++i) {
        char path[512];
        snprintf(path, sizeof path, "%s/%s.obj", FACETREE_DATA, models[i].name);
        if (!file_exists(path) || (SANITIZED && i == 0)) continue;
        fct_env env = fct_env_default();
        fct_mesh mesh;
        assert_int_equal(fct_mesh_load(&env, path, &mesh), FCT_OK);
        uint32_t *labels = malloc(4 * (size_t)mesh.face_count);
        fill_labels(&mesh, models[i].count, labels);
        assert_true(refine(&mesh, labels, models[i].count, NULL) >= models[i].fall);
        assert_true(refine_tree(&mesh, models[i].count, NULL, labels) >= models[i].tree_fall);
        free(labels);
        fct_mesh_release(&env, &mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(border_finds_the_fold),
                                       cmocka_unit_test(flat_borders_are_straightened),
                                       cmocka_unit_test(spheres_and_counts),
                                       cmocka_unit_test(clusters_stay_in_one_piece),
                                       cmocka_unit_test(rings_may_be_opened),
                                       cmocka_unit_test(odd_meshes),
                                       cmocka_unit_test(finer_cuts_move_first),
                                       cmocka_unit_test(torn_and_doubled_sheets),
                                       cmocka_unit_test(same_for_every_thread_count),
                                       cmocka_unit_test(bad_options_and_labels),
                                       cmocka_unit_test(failures_leave_the_labels),
                                       cmocka_unit_test(quality_is_that_of_the_cut),
                                       cmocka_unit_test(a_torn_cluster_is_not_connected),
                                       cmocka_unit_test(real_meshes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
