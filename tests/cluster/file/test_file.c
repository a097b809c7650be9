/* The hierarchy file: a saved tree opens with the same content, each truncated file is refused, each flipped
 * byte is found or harmless, and a failed write leaves the old file. */
#include "../check_tree.h"

#include <unistd.h>

#include "base/io/file.h"
#include "cluster/file/format.h"

static const char *const path = "test_file.fct";

static fct_tree *build_small(const fct_env *env, uint32_t n, fct_mesh *mesh) {
    *mesh = make_sphere(env, n);
    mesh->materials = fct_allocate(env, mesh->face_count, sizeof *mesh->materials);
    mesh->colors = fct_allocate(env, mesh->vertex_count, 3 * sizeof *mesh->colors);
    mesh->material_names = fct_allocate_zero(env, 2, sizeof *mesh->material_names);
    mesh->material_count = 2;
    for (int i = 0; i < 2; ++i) {
        mesh->material_names[i] = fct_allocate(env, 16, 1);
        snprintf(mesh->material_names[i], 16, "name %d", i);
    }
    for (uint32_t f = 0; f < mesh->face_count; ++f) mesh->materials[f] = f % 7 == 0;
    for (uint32_t v = 0; v < 3 * mesh->vertex_count; ++v) mesh->colors[v] = (float)v;
    fct_tree_def def = fct_tree_def_default();
    def.source = "a sphere";
    def.source_hash = 42;
    fct_tree *tree = NULL;
    assert_int_equal(fct_tree_build(env, mesh, &def, NULL, &tree), FCT_OK);
    return tree;
}

static void same_trees(const fct_tree *a, const fct_tree *b) {
    fct_tree_view p = fct_tree_get(a), q = fct_tree_get(b);
    assert_int_equal(p.face_count, q.face_count);
    assert_int_equal(p.vertex_count, q.vertex_count);
    assert_int_equal(p.node_count, q.node_count);
    assert_int_equal(p.root_count, q.root_count);
    assert_int_equal(p.depth, q.depth);
    assert_int_equal(p.boundary_edges, q.boundary_edges);
    assert_int_equal(p.nonmanifold_edges, q.nonmanifold_edges);
    assert_int_equal(p.component_count, q.component_count);
    assert_memory_equal(&p.bounds, &q.bounds, sizeof p.bounds);
    assert_true(p.mean_depth == q.mean_depth);
    assert_memory_equal(a->nodes, b->nodes, p.node_count * sizeof *a->nodes);
    assert_memory_equal(p.roots, q.roots, 4 * p.root_count);
    assert_memory_equal(p.face_ids, q.face_ids, 4 * p.face_count);
    assert_memory_equal(p.vertex_ids, q.vertex_ids, 4 * p.vertex_count);
    assert_memory_equal(p.triangles, q.triangles, 12 * p.face_count);
    assert_memory_equal(p.positions, q.positions, 12 * p.vertex_count);
    assert_memory_equal(p.colors, q.colors, 12 * p.vertex_count);
    assert_memory_equal(p.materials, q.materials, 4 * p.face_count);
    assert_int_equal(p.material_count, q.material_count);
    for (uint32_t i = 0; i < p.material_count; ++i)
        assert_string_equal(p.material_names[i], q.material_names[i]);
    assert_string_equal(p.source, q.source);
    assert_true(p.source_hash == q.source_hash);
    assert_memory_equal(&p.def, &q.def, offsetof(fct_tree_def, source));
}

static void comes_back(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh mesh;
    fct_tree *tree = build_small(&env, 8, &mesh), *back;
    check_tree(tree, &mesh);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    assert_int_equal(fct_tree_open(&env, path, &back), FCT_OK);
    same_trees(tree, back);
    assert_int_equal(fct_tree_verify(&env, tree), FCT_OK);
    assert_int_equal(fct_tree_verify(&env, back), FCT_OK);
    fct_mesh copy;
    assert_int_equal(fct_tree_mesh(&env, back, &copy), FCT_OK);
    assert_memory_equal(copy.triangles, mesh.triangles, 12 * mesh.face_count);
    assert_memory_equal(copy.positions, mesh.positions, 12 * mesh.vertex_count);
    assert_memory_equal(copy.colors, mesh.colors, 12 * mesh.vertex_count);
    assert_memory_equal(copy.materials, mesh.materials, 4 * mesh.face_count);
    assert_string_equal(copy.material_names[1], "name 1");
    fct_mesh_release(&env, &copy);
    fct_tree_destroy(back);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
    unlink(path);
}

static void sections_have_their_documented_sizes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh;
    fct_tree *tree = build_small(&env, 8, &mesh);
    fct_tree_view view = fct_tree_get(tree);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    fct_file file;
    assert_int_equal(fct_file_open(&env, path, &file), FCT_OK);
    fct_format_header header;
    memcpy(&header, file.data, sizeof header);
    const uint64_t faces = view.face_count, vertices = view.vertex_count;
    const uint64_t sizes[FCT_SECTION_COUNT] = {[FCT_SECTION_ROOTS] = 4 * (uint64_t)view.root_count,
                                               [FCT_SECTION_CUT_IDS] = 4 * (uint64_t)header.cut_count,
                                               [FCT_SECTION_CUT] = 132 * (uint64_t)header.cut_count,
                                               [FCT_SECTION_NODES] = 132 * (uint64_t)view.node_count,
                                               [FCT_SECTION_FACE_IDS] = 4 * faces,
                                               [FCT_SECTION_VERTEX_IDS] = 4 * vertices,
                                               [FCT_SECTION_TRIANGLES] = 12 * faces,
                                               [FCT_SECTION_POSITIONS] = 12 * vertices,
                                               [FCT_SECTION_COLORS] = 12 * vertices,
                                               [FCT_SECTION_MATERIALS] = 4 * faces};
    for (int i = 0; i < FCT_SECTION_COUNT; ++i) assert_int_equal(header.sections[i].size, sizes[i]);
    assert_int_equal(header.file_size, file.size);
    fct_file_close(&env, &file);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    unlink(path);
}

static void one_face_comes_back(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    uint32_t triangle[3] = {0, 1, 2};
    fct_mesh mesh = {.vertex_count = 3, .face_count = 1, .positions = positions, .triangles = triangle};
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree, *back;
    assert_int_equal(fct_tree_build(&env, &mesh, &def, NULL, &tree), FCT_OK);
    check_tree(tree, &mesh);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    assert_int_equal(fct_tree_open(&env, path, &back), FCT_OK);
    check_tree(back, &mesh);
    assert_int_equal(fct_tree_get(back).roots[0], 0);
    fct_tree_destroy(back);
    fct_tree_destroy(tree);
    unlink(path);
}

/* Walks an unchecked tree by its children, and opens each node at most once. */
static void walk_down(const fct_tree *tree) {
    fct_tree_view view = fct_tree_get(tree);
    uint32_t *stack = malloc(4 * ((size_t)view.face_count + view.root_count + 1)), height = 0, opened = 0;
    for (uint32_t r = 0; r < view.root_count; ++r)
        if (view.roots[r] < view.node_count) stack[height++] = view.roots[r];
    while (height > 0) {
        uint32_t node = stack[--height];
        fct_cluster own, child[2];
        assert_true(opened++ <= view.node_count * (view.root_count + 1));
        if (fct_tree_cluster(tree, node, &own) != FCT_OK || fct_tree_children(tree, node, child) != FCT_OK)
            continue;
        for (int k = 0; k < 2; ++k) {
            assert_in_range(own.child[k], node + 1, view.node_count + view.face_count - 1);
            assert_true(child[k].first + child[k].count <= view.face_count);
            if (own.child[k] < view.node_count) stack[height++] = own.child[k];
        }
    }
    free(stack);
}

/* Runs all queries. Each gives a valid result or DATA. */
static void walk(const fct_env *env, const fct_tree *tree) {
    fct_tree_view view = fct_tree_get(tree);
    uint32_t *nodes = malloc(4 * (size_t)view.face_count), *labels = malloc(4 * (size_t)view.face_count);
    fct_cluster cluster;
    for (uint32_t count = 0; count <= view.face_count; count += 1 + view.face_count / 5) {
        uint32_t written, places = 0;
        fct_result result = fct_tree_partition(env, tree, count, nodes, &written);
        assert_true(result == (written ? FCT_OK : FCT_ERROR_DATA));
        for (uint32_t i = 0; i < written && result == FCT_OK; ++i) {
            result = fct_tree_cluster(tree, nodes[i], &cluster);
            if (result == FCT_OK) assert_int_equal(cluster.first, places);
            places += cluster.count;
        }
        if (result == FCT_OK) assert_int_equal(places, view.face_count);
    }
    walk_down(tree);
    for (uint32_t p = 0; p < view.face_count; ++p) fct_tree_cluster(tree, view.node_count + p, &cluster);
    assert_in_range(fct_tree_count_at_cost(tree, 1e-3), view.root_count, view.face_count);
    for (uint32_t i = 0; i < view.material_count && view.material_names; ++i)
        assert_true(strlen(view.material_names[i]) < 1000);
    fct_mesh mesh;
    fct_result checked = fct_tree_check(env, tree);
    assert_int_equal(fct_tree_labels(env, tree, view.roots, view.root_count, labels), checked);
    assert_int_equal(fct_tree_mesh(env, tree, &mesh), checked);
    fct_mesh_release(env, &mesh);
    free(nodes);
    free(labels);
}

/* The bytes of a saved tree. */
static unsigned char *read_bytes(const fct_env *env, size_t *size) {
    fct_file file;
    assert_int_equal(fct_file_open(env, path, &file), FCT_OK);
    unsigned char *bytes = malloc(file.size + 64);
    memcpy(bytes, file.data, file.size);
    *size = file.size;
    fct_file_close(env, &file);
    return bytes;
}

static unsigned char *save_small(const fct_env *env, uint32_t n, size_t *size) {
    fct_mesh mesh;
    fct_tree *tree = build_small(env, n, &mesh);
    assert_int_equal(fct_tree_save(env, tree, path), FCT_OK);
    fct_tree_destroy(tree);
    fct_mesh_release(env, &mesh);
    unsigned char *bytes = read_bytes(env, size);
    unlink(path);
    return bytes;
}

static void every_cut_is_refused(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    fct_tree *back;
    size_t size;
    unsigned char *bytes = save_small(&env, 3, &size);
    for (size_t cut = 0; cut < size; ++cut) {
        assert_int_equal(fct_tree_parse(&env, "cut", bytes, cut, &back), FCT_ERROR_DATA);
        assert_null(back);
    }
    memset(bytes + size, 0, 64);
    assert_int_equal(fct_tree_parse(&env, "long", bytes, size + 64, &back), FCT_ERROR_DATA);
    free(bytes);
    assert_int_equal(quiet.alive, 0);
}

/* A flipped byte of the head prevents opening. Any other is harmless to queries, and fct_tree_verify finds
 * it. */
static void every_flipped_byte_is_found(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    env.thread_count = 1;
    for (uint32_t n = 3; n < 9; n += 5) {
        fct_tree *back;
        size_t size, refused = 0;
        unsigned char *bytes = save_small(&env, n, &size);
        for (size_t i = 0; i < size; i += n == 3 || i < 704 ? 1 : 61) {
            unsigned char old = bytes[i];
            bytes[i] = (unsigned char)(old ^ (i % 3 ? 0x81 : 0xFF));
            if (fct_tree_parse(&env, "flipped", bytes, size, &back) == FCT_OK) {
                walk(&env, back);
                assert_int_equal(fct_tree_verify(&env, back), FCT_ERROR_DATA);
                fct_tree_destroy(back);
            } else {
                ++refused;
            }
            bytes[i] = old;
        }
        assert_int_equal(refused, 536 + strlen("a sphere") + 1 + 2 * strlen("name 0") + 2);
        free(bytes);
    }
    assert_int_equal(quiet.alive, 0);
}

/* Random wrong links, ranges and indices: no query reads outside of the arrays or runs in circles. */
static void no_damage_leads_astray(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    env.thread_count = 1;
    size_t size, head = 576, refused = 0;
    unsigned char *bytes = save_small(&env, 8, &size), *damaged = malloc(size);
    fct_tree *back;
    assert_int_equal(fct_tree_parse(&env, "whole", bytes, size, &back), FCT_OK);
    fct_tree_view view = fct_tree_get(back);
    const uint32_t nodes = view.node_count, faces = view.face_count;
    const uint32_t wrong[] = {0, 1, 2, nodes - 1, nodes, nodes + faces - 1, nodes + faces, faces, FCT_NONE};
    const size_t count = sizeof wrong / sizeof *wrong;
    fct_tree_destroy(back);
    uint32_t random = 12345;
    for (int round = 0; round < (SANITIZED ? 100 : 1000); ++round) {
        memcpy(damaged, bytes, size);
        for (int i = 0; i <= round % 5; ++i) {
            random = random * 1664525 + 1013904223;
            size_t at = (head + random % (size - head)) / 4 * 4;
            random = random * 1664525 + 1013904223;
            uint32_t value = random >> 28 < count ? wrong[random >> 28] : random % (nodes + faces);
            memcpy(damaged + at, &value, 4);
        }
        if (fct_tree_parse(&env, "damaged", damaged, size, &back) == FCT_OK) {
            walk(&env, back);
            fct_tree_destroy(back);
        } else {
            ++refused;
        }
    }
    assert_int_equal(refused, 0);
    free(bytes), free(damaged);
    assert_int_equal(quiet.alive, 0);
}

/* Both children of each node are the next node. A walk that trusts the links would visit 2^(F - 1) nodes. */
static void shared_children_end(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    size_t size;
    unsigned char *bytes = save_small(&env, 8, &size);
    fct_tree *back;
    fct_mesh mesh;
    fct_tree *tree = build_small(&env, 8, &mesh);
    fct_tree_view view = fct_tree_get(tree);
    unsigned char *at = bytes;
    while (memcmp(at, tree->nodes, view.node_count * sizeof *tree->nodes) != 0) ++at;
    for (uint32_t i = 0; i < view.node_count; ++i) {
        const uint32_t links[4] = {i + 1, i + 1, 0, view.face_count};
        memcpy(at + i * sizeof(fct_cluster) + offsetof(fct_cluster, child), links, sizeof links);
    }
    uint32_t *nodes = malloc(4 * (size_t)view.face_count), count;
    assert_int_equal(fct_tree_parse(&env, "shared", bytes, size, &back), FCT_OK);
    assert_int_equal(fct_tree_partition(&env, back, view.face_count, nodes, &count), FCT_ERROR_DATA);
    assert_int_equal(count, 0);
    assert_non_null(strstr(quiet.text, "shared: node 0: child's range"));
    walk(&env, back);
    assert_int_equal(fct_tree_check(&env, back), FCT_ERROR_DATA);
    fct_tree_destroy(back);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    free(nodes), free(bytes);
    assert_int_equal(quiet.alive, 0);
}

/* Sets 4 bytes of a record in a section of records. */
static void set_word(unsigned char *bytes, fct_section section, uint32_t entry, size_t offset,
                     uint32_t value) {
    fct_format_header h;
    memcpy(&h, bytes, sizeof h);
    memcpy(bytes + h.sections[section].offset + entry * sizeof(fct_cluster) + offset, &value, 4);
}

static void a_node_is_no_child_of_its_own(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    size_t size;
    unsigned char *bytes = save_small(&env, 3, &size);
    fct_tree *back;
    fct_cluster c, children[2];
    set_word(bytes, FCT_SECTION_NODES, 3, offsetof(fct_cluster, child), 3);
    assert_int_equal(fct_tree_parse(&env, "circle", bytes, size, &back), FCT_OK);
    assert_int_equal(fct_tree_cluster(back, 3, &c), FCT_ERROR_DATA);
    assert_non_null(strstr(quiet.text, "circle: node 3: child out of order"));
    assert_true(c.count == 0 && c.child[0] == FCT_NONE);
    assert_int_equal(fct_tree_children(back, 3, children), FCT_ERROR_DATA);
    assert_int_equal(fct_tree_cluster(back, 4, &c), FCT_OK);
    fct_tree_destroy(back);
    free(bytes);
    assert_int_equal(quiet.alive, 0);
}

static void a_head_that_changes_under_a_tree_is_found(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    fct_mesh mesh;
    fct_tree *tree = build_small(&env, 3, &mesh), *back;
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    assert_int_equal(fct_tree_open(&env, path, &back), FCT_OK);
    FILE *file = fopen(path, "r+b");
    fseek(file, offsetof(fct_format_header, sections) + offsetof(fct_format_section, offset) + 7, SEEK_SET);
    fputc(0x7F, file);
    fclose(file);
    assert_int_equal(fct_tree_verify(&env, back), FCT_ERROR_DATA);
    assert_non_null(strstr(quiet.text, "changed since it was opened"));
    fct_tree_destroy(back);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    unlink(path);
    assert_int_equal(quiet.alive, 0);
}

static void the_cut_is_that_of_the_nodes(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    size_t size;
    unsigned char *bytes = save_small(&env, 8, &size);
    fct_tree *back;
    const float other = 2;
    uint32_t value;
    memcpy(&value, &other, 4);
    set_word(bytes, FCT_SECTION_CUT, 0, offsetof(fct_cluster, area), value);
    assert_int_equal(fct_tree_parse(&env, "other", bytes, size, &back), FCT_OK);
    assert_int_equal(fct_tree_check(&env, back), FCT_ERROR_DATA);
    assert_non_null(strstr(quiet.text, "other: entry 0 of the cut"));
    fct_tree_destroy(back);
    free(bytes);
    assert_int_equal(quiet.alive, 0);
}

/* Finds a section in the bytes of a saved tree by its content. */
static unsigned char *find_bytes(unsigned char *bytes, size_t size, const void *what, size_t length) {
    for (size_t i = 536; i + length <= size; ++i)
        if (!memcmp(bytes + i, what, length)) return bytes + i;
    return NULL;
}

static void endless_numbers_do_not_pass(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env env = recorder_env(&quiet);
    fct_mesh mesh;
    fct_tree *tree = build_small(&env, 3, &mesh), *back;
    fct_tree_view view = fct_tree_get(tree);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    fct_file file;
    assert_int_equal(fct_file_open(&env, path, &file), FCT_OK);
    unsigned char *bytes = malloc(file.size);
    memcpy(bytes, file.data, file.size);
    const void *section[2] = {tree->nodes, view.positions};
    size_t floats[2] = {view.node_count * sizeof(fct_cluster) / 4, 3 * (size_t)view.vertex_count};
    const float wrong[3] = {NAN, INFINITY, -INFINITY};
    for (size_t s = 0; s < 2; ++s) {
        unsigned char *at = find_bytes(bytes, file.size, section[s], 4 * floats[s]);
        assert_non_null(at);
        for (size_t i = 0; i < floats[s]; ++i) {
            if (s == 0 && i % 33 >= 29) continue; /* children and range */
            unsigned char old[4];
            memcpy(old, at + 4 * i, 4);
            memcpy(at + 4 * i, &wrong[i % 3], 4);
            assert_int_equal(fct_tree_parse(&env, "file", bytes, file.size, &back), FCT_OK);
            assert_int_equal(fct_tree_check(&env, back), FCT_ERROR_DATA);
            assert_non_null(strstr(quiet.text, "not finite"));
            fct_tree_destroy(back);
            memcpy(at + 4 * i, old, 4);
        }
    }
    assert_int_equal(fct_tree_parse(&env, "file", bytes, file.size, &back), FCT_OK);
    fct_tree_destroy(back);
    free(bytes);
    fct_file_close(&env, &file);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    unlink(path);
    assert_int_equal(quiet.alive, 0);
}

static void errors_are_told(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_tree *tree = NULL;
    assert_int_equal(fct_tree_open(&env, "there-is-no-such-file.fct", &tree), FCT_ERROR_INPUT);
    assert_null(tree);
    assert_non_null(strstr(r.text, "there-is-no-such-file.fct"));
    assert_int_equal(fct_tree_parse(&env, "ply", "ply\nformat ascii 1.0", 20, &tree), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "no hierarchy file"));
    unsigned char old[536] = {0x89, 'F', 'C', 'T', '\r', '\n', 0x1A, '\n', 1, 0, 0, 0, 4, 3, 2, 1};
    assert_int_equal(fct_tree_parse(&env, "old.fct", old, sizeof old, &tree), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "old.fct: version 1 of the hierarchy file, expected 3"));
    fct_mesh mesh;
    tree = build_small(&env, 2, &mesh);
    assert_int_equal(fct_tree_save(&env, tree, "/nowhere/at/all.fct"), FCT_ERROR_OUTPUT);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
}

static void survives_no_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    env.thread_count = 1;
    fct_mesh mesh;
    fct_tree *tree = build_small(&env, 3, &mesh), *back;
    long before = r.alive;
    for (r.fail_at = 1;; ++r.fail_at) {
        r.allocations = 0;
        fct_result result = fct_tree_save(&env, tree, path);
        if (result == FCT_OK) result = fct_tree_open(&env, path, &back);
        if (result == FCT_OK) {
            result = fct_tree_verify(&env, back);
            fct_tree_destroy(back);
        }
        assert_int_equal(r.alive, before);
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_MEMORY);
    }
    assert_true(r.fail_at > 5);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
    unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(comes_back),
                                       cmocka_unit_test(sections_have_their_documented_sizes),
                                       cmocka_unit_test(one_face_comes_back),
                                       cmocka_unit_test(every_cut_is_refused),
                                       cmocka_unit_test(every_flipped_byte_is_found),
                                       cmocka_unit_test(no_damage_leads_astray),
                                       cmocka_unit_test(shared_children_end),
                                       cmocka_unit_test(a_node_is_no_child_of_its_own),
                                       cmocka_unit_test(a_head_that_changes_under_a_tree_is_found),
                                       cmocka_unit_test(the_cut_is_that_of_the_nodes),
                                       cmocka_unit_test(endless_numbers_do_not_pass),
                                       cmocka_unit_test(errors_are_told),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
