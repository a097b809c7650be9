/* Trees built from file to file in parts: check_tree.h, the counts and quality of a build in memory, the same
 * bytes for every thread count, and an unchanged old file after every error. */
#define _GNU_SOURCE
#include "check_tree.h"
#include "folder.h"

#include <dirent.h>
#include <unistd.h>

/* One thread, because parts of a few faces are too small for a second one. */
static fct_env single(void) {
    fct_env env = fct_env_default();
    env.thread_count = 1;
    return env;
}

static uint32_t hash_of(uint32_t x) {
    x ^= x >> 16, x *= 0x7FEB352Du, x ^= x >> 15, x *= 0x846CA68Bu;
    return x ^ x >> 16;
}

static float unit_hash(uint32_t x) {
    return (float)(hash_of(x) >> 8) / (float)(1 << 24);
}

/* A grid of 2 n^2 faces with hills, and with bumps that are smaller than a cluster. */
static fct_mesh make_hills(const fct_env *env, uint32_t n) {
    fct_mesh mesh = make_grid(env, n);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * (size_t)v;
        p[2] = .1f * sinf(9 * p[0]) * cosf(7 * p[1]) + .2f / (float)n * unit_hash(v);
    }
    return mesh;
}

static fct_mesh empty_mesh(const fct_env *env, uint32_t vertices, uint32_t faces) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, vertices, faces, 0, &mesh), FCT_OK);
    memset(mesh.positions, 0, 12 * (size_t)vertices);
    memset(mesh.triangles, 0, 12 * (size_t)faces);
    return mesh;
}

static fct_large_def parts_of(uint32_t faces) {
    fct_large_def large = fct_large_def_default();
    large.part_faces = faces;
    return large;
}

static void save(const fct_env *env, const fct_mesh *mesh) {
    assert_int_equal(fct_mesh_save(env, mesh_path, mesh, NULL), FCT_OK);
}

static fct_tree *open_tree(const fct_env *env) {
    fct_tree *tree;
    assert_int_equal(fct_tree_open(env, tree_path, &tree), FCT_OK);
    assert_int_equal(fct_tree_verify(env, tree), FCT_OK);
    return tree;
}

/* Clusters the mesh in parts of `part_faces` faces and checks the tree. The caller destroys it. */
static fct_tree *build(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def, uint32_t part_faces,
                       fct_large_stats *stats) {
    fct_large_def large = parts_of(part_faces);
    save(env, mesh);
    assert_int_equal(fct_tree_build_file(env, mesh_path, tree_path, def, &large, stats), FCT_OK);
    fct_tree *tree = open_tree(env);
    check_tree(tree, mesh);
    fct_tree_view view = fct_tree_get(tree);
    assert_int_equal(stats->face_count, mesh->face_count);
    assert_int_equal(stats->vertex_count, mesh->vertex_count);
    assert_int_equal(stats->depth, view.depth);
    assert_int_equal(stats->root_count, view.root_count);
    for (uint32_t i = 0; i < view.node_count; ++i) /* ids are in the order of falling costs */
        assert_true(i == 0 || tree->nodes[i].cost <= tree->nodes[i - 1].cost);
    return tree;
}

/* The counts of edges are those of a build in memory. */
static void check_counts(const fct_env *env, const fct_mesh *mesh, const fct_tree_def *def,
                         const fct_tree *tree) {
    fct_tree *whole;
    fct_tree_def options = def ? *def : fct_tree_def_default();
    assert_int_equal(fct_tree_build(env, mesh, &options, NULL, &whole), FCT_OK);
    fct_tree_view a = fct_tree_get(tree), b = fct_tree_get(whole);
    assert_int_equal(a.boundary_edges, b.boundary_edges);
    assert_int_equal(a.nonmanifold_edges, b.nonmanifold_edges);
    assert_int_equal(a.component_count, b.component_count);
    assert_memory_equal(&a.bounds, &b.bounds, sizeof a.bounds);
    assert_true(a.def.fit_weight == b.def.fit_weight && a.def.shape_weight == b.def.shape_weight);
    fct_tree_destroy(whole);
}

static void check_parts(const fct_env *env, fct_mesh *mesh, uint32_t part_faces) {
    fct_large_stats stats;
    fct_tree *tree = build(env, mesh, NULL, part_faces, &stats);
    assert_true(stats.part_count >= mesh->face_count / (part_faces + part_faces / 4 + 1));
    check_counts(env, mesh, NULL, tree);
    fct_tree_destroy(tree);
    fct_mesh_release(env, mesh);
}

static void options_and_sizes(void **state) {
    (void)state;
    fct_env env = single();
    for (int option = 0; option < 8; ++option) {
        fct_tree_def def = fct_tree_def_default();
        def.method = option & 1 ? FCT_CLUSTER_GREEDY : FCT_CLUSTER_ROUNDS;
        def.cost = option & 2 ? FCT_COST_MEAN : FCT_COST_INCREMENT;
        def.fit_measure = option & 4 ? FCT_FIT_POINTS : FCT_FIT_AREA;
        def.source = "hills";
        fct_mesh mesh = make_hills(&env, SANITIZED ? 30 : 50);
        fct_large_stats stats;
        fct_tree *tree = build(&env, &mesh, &def, 700, &stats);
        fct_tree_view view = fct_tree_get(tree);
        assert_true(stats.part_count >= 2 && stats.top_count >= stats.part_count);
        assert_true(view.def.method == def.method && view.def.cost == def.cost);
        assert_string_equal(view.source, "hills");
        check_counts(&env, &mesh, &def, tree);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
    for (uint32_t part = 1; part < 2000; part = 3 * part + 1) {
        fct_mesh mesh = make_sphere(&env, 12);
        check_parts(&env, &mesh, part);
    }
}

static double larger_ratio(double a, double b, double worst) {
    double ratio = b > 0 ? a / b : 1;
    return ratio > worst ? ratio : worst;
}

/* No figure shows the seams, at any number k of clusters: all are within 1 / sqrt(k) of a build in memory. */
static void seams_do_not_show(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh mesh = make_hills(&env, SANITIZED ? 60 : 140);
    fct_large_stats stats;
    fct_tree *whole, *tree = build(&env, &mesh, NULL, mesh.face_count / 16, &stats);
    assert_true(stats.part_count >= 12);
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &whole), FCT_OK);
    uint32_t *nodes = malloc(4 * (size_t)mesh.face_count), count;
    const uint32_t parts[3] = {10, 50, 256};
    for (int i = 0; i < 3; ++i) {
        uint32_t k = mesh.face_count / parts[i];
        fct_partition_quality ours, theirs;
        assert_int_equal(fct_tree_partition(&env, tree, k, nodes, &count), FCT_OK);
        assert_int_equal(fct_tree_quality(&env, tree, nodes, count, &ours), FCT_OK);
        assert_int_equal(fct_tree_partition(&env, whole, k, nodes, &count), FCT_OK);
        assert_int_equal(fct_tree_quality(&env, whole, nodes, count, &theirs), FCT_OK);
        assert_true(ours.connected);
        double worst = 0;
        worst = larger_ratio(ours.mean_normal_deviation, theirs.mean_normal_deviation, worst);
        worst = larger_ratio(ours.mean_fit, theirs.mean_fit, worst);
        worst = larger_ratio(ours.mean_irregularity, theirs.mean_irregularity, worst);
        worst = larger_ratio(ours.box_area, theirs.box_area, worst);
        if (!SANITIZED) assert_true(worst < 1 + 1 / sqrt(k));
    }
    free(nodes);
    fct_tree_destroy(tree);
    fct_tree_destroy(whole);
    fct_mesh_release(&env, &mesh);
}

/* The tree has the colours and materials. Merges within a material come before merges across materials. */
static void colors_and_materials(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh plain = make_hills(&env, 40), mesh;
    assert_int_equal(fct_mesh_create(&env, plain.vertex_count, plain.face_count,
                                     FCT_MESH_COLORS | FCT_MESH_MATERIALS, &mesh),
                     FCT_OK);
    memcpy(mesh.positions, plain.positions, 12 * (size_t)plain.vertex_count);
    memcpy(mesh.triangles, plain.triangles, 12 * (size_t)plain.face_count);
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i) mesh.colors[i] = unit_hash((uint32_t)i);
    for (uint32_t f = 0; f < mesh.face_count; ++f)
        mesh.materials[f] = plain.positions[3 * (size_t)plain.triangles[3 * (size_t)f]] < .37f ? 1 : 4;
    mesh.material_count = 5;
    fct_large_stats stats;
    fct_tree *tree = build(&env, &mesh, NULL, 500, &stats);
    fct_tree_view view = fct_tree_get(tree);
    fct_mesh back;
    assert_int_equal(view.material_count, 5);
    assert_int_equal(fct_tree_mesh(&env, tree, &back), FCT_OK);
    assert_memory_equal(back.colors, mesh.colors, 12 * (size_t)mesh.vertex_count);
    assert_memory_equal(back.materials, mesh.materials, 4 * (size_t)mesh.face_count);
    const fct_cluster *first = &tree->nodes[0];
    for (int k = 0; k < 2; ++k) /* only the last merge crosses materials */
        for (uint32_t p = tree->nodes[first->child[k]].first, i = 0; i < tree->nodes[first->child[k]].count;
             ++i)
            assert_int_equal(view.materials[p + i], view.materials[p]);
    fct_mesh_release(&env, &back);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &plain);
}

static void several_roots(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh mesh = make_hills(&env, 30);
    fct_large_stats stats;
    fct_tree *one = build(&env, &mesh, NULL, 300, &stats);
    uint32_t *nodes = malloc(4 * (size_t)mesh.face_count), *labels = malloc(4 * (size_t)mesh.face_count),
             *others = malloc(4 * (size_t)mesh.face_count);
    const uint32_t roots[] = {2, 7, 100, 900, 1799, 1800};
    for (size_t i = 0; i < sizeof roots / sizeof *roots; ++i) {
        fct_tree_def def = fct_tree_def_default();
        def.root_count = roots[i];
        one = (fct_tree_destroy(one), build(&env, &mesh, NULL, 300, &stats));
        uint32_t count;
        assert_int_equal(fct_tree_partition(&env, one, roots[i], nodes, &count), FCT_OK);
        assert_int_equal(fct_tree_labels(&env, one, nodes, count, labels), FCT_OK);
        double cost = count < 1800 ? (double)one->nodes[count - 1].cost : -1;
        fct_tree *tree = build(&env, &mesh, &def, 300, &stats);
        fct_tree_view view = fct_tree_get(tree);
        assert_int_equal(view.root_count, roots[i]);
        assert_int_equal(view.node_count, mesh.face_count - roots[i]);
        assert_int_equal(fct_tree_partition(&env, tree, 1, nodes, &count), FCT_OK);
        assert_int_equal(count, roots[i]);
        assert_int_equal(fct_tree_labels(&env, tree, nodes, count, others), FCT_OK);
        for (uint32_t f = 1; f < mesh.face_count; ++f) /* both are the same partition */
            assert_int_equal(labels[f] == labels[f - 1], others[f] == others[f - 1]);
        fct_tree_destroy(tree);
        if (count == 1800) continue;
        def.root_count = 1; /* the same by the cost of the last merge */
        def.max_cost = cost;
        tree = build(&env, &mesh, &def, 300, &stats);
        view = fct_tree_get(tree);
        assert_true(view.root_count <= roots[i] && (double)tree->nodes[0].cost == cost); /* not one less */
        fct_tree_destroy(tree);
    }
    free(nodes);
    free(labels);
    free(others);
    fct_tree_destroy(one);
    fct_mesh_release(&env, &mesh);
}

static double sum_of_boxes(const fct_tree *tree) {
    fct_tree_view view = fct_tree_get(tree);
    double sum = 0;
    for (uint32_t i = 0; i < view.node_count; ++i) {
        const float *h = tree->nodes[i].box_half;
        sum += (double)h[0] * (double)h[1] + (double)h[1] * (double)h[2] + (double)h[2] * (double)h[0];
    }
    return sum;
}

/* n loose triangles of size .01 in the unit cube. */
static fct_mesh make_loose(const fct_env *env, uint32_t n) {
    fct_mesh mesh = empty_mesh(env, 3 * n, n);
    for (uint32_t v = 0; v < 3 * n; ++v) {
        for (uint32_t k = 0; k < 3; ++k)
            mesh.positions[3 * v + k] = unit_hash(v / 3 * 3 + k) + .01f * unit_hash(9 * v + k);
        mesh.triangles[v] = v;
    }
    return mesh;
}

/* Loose triangles are joined by proximity: across parts, or first within parts if memory is short. The boxes
 * are about as small as those of a build in memory. */
static void loose_triangles(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh mesh = make_loose(&env, 3000);
    fct_tree *whole, *tree;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &whole), FCT_OK);
    for (int press = 0; press < 2; ++press) {
        fct_large_def large = parts_of(400);
        fct_large_stats stats;
        uint64_t least = fct_tree_build_need(mesh.face_count, mesh.vertex_count, NULL).in_parts;
        if (press) large.max_memory = least;
        save(&env, &mesh);
        assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, &stats), FCT_OK);
        tree = open_tree(&env);
        check_tree(tree, &mesh);
        assert_true(press ? stats.top_count < 1500 : stats.top_count == 3000);
        assert_int_equal(fct_tree_get(tree).component_count, 3000);
        assert_true(sum_of_boxes(tree) < (press ? 1.3 : 1.02) * sum_of_boxes(whole));
        fct_tree_destroy(tree);
    }
    fct_tree_destroy(whole);
    fct_mesh_release(&env, &mesh);
}

/* An edge of 60 faces, a fan of one vertex, duplicates, faces without area, faces that touch nothing. */
static void odd_shapes(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh book = empty_mesh(&env, 62, 60), fan = empty_mesh(&env, 202, 200), twins = make_grid(&env, 8);
    book.positions[3 + 2] = 1;
    for (uint32_t f = 0; f < 60; ++f) {
        float *p = book.positions + 3 * (f + 2);
        p[0] = cosf((float)f), p[1] = sinf((float)f), p[2] = .5f;
        uint32_t page[3] = {0, 1, f + 2};
        memcpy(book.triangles + 3 * (size_t)f, page, sizeof page);
    }
    check_parts(&env, &book, 7);
    for (uint32_t f = 0; f < 200; ++f) {
        float *p = fan.positions + 3 * (f + 1);
        p[0] = cosf((float)f * .03f), p[1] = sinf((float)f * .03f);
        uint32_t leaf[3] = {0, f + 1, f + 2};
        memcpy(fan.triangles + 3 * (size_t)f, leaf, sizeof leaf);
    }
    fan.positions[3 * 201] = 2;
    check_parts(&env, &fan, 30);
    for (uint32_t f = 0; f < twins.face_count / 2; ++f)
        memcpy(twins.triangles + 3 * (size_t)(2 * f + 1), twins.triangles + 6 * (size_t)f, 12);
    check_parts(&env, &twins, 10);
    fct_mesh points = empty_mesh(&env, 30, 50);
    for (uint32_t i = 0; i < 150; ++i) points.triangles[i] = hash_of(i) % 30;
    check_parts(&env, &points, 8);
    fct_mesh loose = make_loose(&env, 1000);
    check_parts(&env, &loose, 90);
    for (int scale = -30; scale <= 30; scale += 60) {
        fct_mesh mesh = make_sphere(&env, 10);
        for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
            mesh.positions[i] = (float)((double)mesh.positions[i] * pow(10, scale));
        check_parts(&env, &mesh, 50);
    }
}

static void one_and_two_faces(void **state) {
    (void)state;
    fct_env env = single();
    for (uint32_t faces = 1; faces <= 2; ++faces) {
        fct_mesh mesh = make_grid(&env, 1);
        mesh.face_count = faces;
        fct_large_stats stats;
        fct_tree *tree = build(&env, &mesh, NULL, 1, &stats);
        assert_int_equal(stats.part_count, faces);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
}

/* A shuffled file with the least memory: parts must merge more than they should, and the tree is still valid.
 */
static void little_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    env.thread_count = 1;
    fct_mesh mesh = make_hills(&env, 60);
    uint32_t faces = mesh.face_count;
    for (uint32_t f = faces; f-- > 1;) {
        uint32_t other = hash_of(f) % (f + 1);
        for (int k = 0; k < 3; ++k) {
            uint32_t t = mesh.triangles[3 * f + (uint32_t)k];
            mesh.triangles[3 * f + (uint32_t)k] = mesh.triangles[3 * other + (uint32_t)k];
            mesh.triangles[3 * other + (uint32_t)k] = t;
        }
    }
    save(&env, &mesh);
    fct_large_def large = parts_of(100);
    uint64_t least = fct_tree_build_need(faces, mesh.vertex_count, NULL).in_parts;
    large.max_memory = least - 1;
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, NULL), FCT_ERROR_MEMORY);
    assert_non_null(strstr(r.text, "at least"));
    large.max_memory = UINT64_C(1) << 30;
    fct_large_stats stats, plenty;
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, &plenty), FCT_OK);
    large.max_memory = least;
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, &stats), FCT_OK);
    assert_true(2 * stats.top_count < plenty.top_count);
    fct_tree *tree = open_tree(&env);
    check_tree(tree, &mesh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

static unsigned char *read_tree(size_t *size) {
    FILE *file = fopen(tree_path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    unsigned char *bytes = malloc(*size + 1);
    rewind(file);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static void same_bytes_for_every_thread_count(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh mesh = make_hills(&env, 70);
    save(&env, &mesh);
    unsigned char *first = NULL;
    size_t first_size = 0;
    for (uint32_t threads = 1; threads <= 7; threads += 3) {
        fct_large_def large = parts_of(1500);
        env.thread_count = threads;
        size_t size;
        assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, NULL), FCT_OK);
        unsigned char *bytes = read_tree(&size);
        if (first) {
            assert_int_equal(size, first_size);
            assert_memory_equal(bytes, first, size);
            free(bytes);
        } else {
            first = bytes, first_size = size;
        }
    }
    free(first);
    fct_mesh_release(&env, &mesh);
}

static int count_entries(void) {
    DIR *entries = opendir(folder);
    int count = 0;
    assert_non_null(entries);
    while (readdir(entries)) ++count;
    closedir(entries);
    return count - 2;
}

/* The folder has only the mesh and the old tree file with its old text. */
static void check_untouched(void) {
    size_t size;
    unsigned char *bytes = read_tree(&size);
    assert_int_equal(size, 3);
    assert_memory_equal(bytes, "old", 3);
    free(bytes);
    assert_int_equal(count_entries(), 2);
}

static void write_old(void) {
    FILE *file = fopen(tree_path, "wb");
    assert_non_null(file);
    fputs("old", file);
    fclose(file);
}

static void no_memory_anywhere(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    env.thread_count = 1;
    fct_mesh mesh = make_hills(&env, 7);
    save(&env, &mesh);
    fct_mesh_release(&env, &mesh);
    fct_large_def large = parts_of(30);
    write_old();
    for (long n = 1;; ++n) {
        r = (recorder){.fail_at = n};
        fct_result result = fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, NULL);
        assert_int_equal(r.alive, 0);
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_MEMORY);
        assert_true(r.messages > 0);
        if (n % 16 == 0) check_untouched();
    }
    r.fail_at = 0;
    fct_tree_destroy(open_tree(&env));
}

static bool stop_at(void *user, const char *phase, double done) {
    int *left = user;
    assert_true(phase && done >= 0 && done <= 1);
    return --*left > 0;
}

static void can_be_cancelled_anywhere(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    env.thread_count = 1;
    fct_mesh mesh = make_hills(&env, 20);
    save(&env, &mesh);
    fct_mesh_release(&env, &mesh);
    fct_large_def large = parts_of(300);
    write_old();
    int left, limit = 1;
    env.progress = stop_at, env.progress_user = &left;
    for (;; ++limit) {
        left = limit;
        fct_result result = fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, NULL);
        assert_int_equal(r.alive, 0);
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_CANCELLED);
        check_untouched();
    }
    assert_true(limit > 8);
}

/* The share of the last phase. It never falls within a phase, and that of the 8 parts begins near 0. */
typedef struct share {
    char phase[32];
    double done;
    uint32_t calls;
} share;

static bool note_share(void *user, const char *phase, double done) {
    share *s = user;
    bool same = !strcmp(s->phase, phase);
    if (done < 0 || done > 1 || (same && done < s->done)) fail_msg("%s: %g after %g", phase, done, s->done);
    if (!same && !strcmp(phase, "parts") && done > 0.02) fail_msg("the parts begin at %g", done);
    snprintf(s->phase, sizeof s->phase, "%s", phase);
    s->done = done;
    ++s->calls;
    return true;
}

static void progress_never_falls(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh mesh = make_hills(&env, 40);
    for (int method = 0; method < 2; ++method)
        for (int press = 0; press < 2; ++press) {
            share s = {0};
            fct_tree_def def = fct_tree_def_default();
            fct_large_def large = parts_of(400);
            def.method = method ? FCT_CLUSTER_GREEDY : FCT_CLUSTER_ROUNDS;
            if (press)
                large.max_memory = fct_tree_build_need(mesh.face_count, mesh.vertex_count, &def).in_parts;
            save(&env, &mesh);
            env.progress = note_share, env.progress_user = &s;
            assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, &def, &large, NULL), FCT_OK);
            env.progress = NULL;
            assert_true(s.calls > 20);
        }
    fct_mesh_release(&env, &mesh);
}

static void errors_are_told(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_large_def large = parts_of(100);
    fct_mesh mesh = make_hills(&env, 10), none = empty_mesh(&env, 3, 0);
    assert_int_equal(fct_tree_build_file(&env, "missing.ply", tree_path, NULL, &large, NULL),
                     FCT_ERROR_INPUT);
    save(&env, &none);
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, NULL), FCT_ERROR_DATA);
    save(&env, &mesh);
    large.temporary_folder = "/nowhere/at/all";
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, NULL), FCT_ERROR_OUTPUT);
    assert_non_null(strstr(r.text, "/nowhere/at/all"));
    large.temporary_folder = folder;
    assert_int_equal(fct_tree_build_file(&env, mesh_path, "/nowhere/tree.fct", NULL, &large, NULL),
                     FCT_ERROR_OUTPUT);
    large.size = 1;
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, NULL, &large, NULL), FCT_ERROR_DATA);
    fct_tree_def def = fct_tree_def_default();
    def.fit_weight = INFINITY;
    assert_int_equal(fct_tree_build_file(&env, mesh_path, tree_path, &def, NULL, NULL), FCT_ERROR_DATA);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &none);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(options_and_sizes),
                                       cmocka_unit_test(seams_do_not_show),
                                       cmocka_unit_test(colors_and_materials),
                                       cmocka_unit_test(several_roots),
                                       cmocka_unit_test(loose_triangles),
                                       cmocka_unit_test(odd_shapes),
                                       cmocka_unit_test(one_and_two_faces),
                                       cmocka_unit_test(little_memory),
                                       cmocka_unit_test(same_bytes_for_every_thread_count),
                                       cmocka_unit_test(no_memory_anywhere),
                                       cmocka_unit_test(can_be_cancelled_anywhere),
                                       cmocka_unit_test(progress_never_falls),
                                       cmocka_unit_test(errors_are_told)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
