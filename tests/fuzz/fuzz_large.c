/* A mesh file built into a hierarchy file in parts: an error, or a file whose tree holds. The bytes are the
 * file if they begin as a PLY, else they describe a mesh, which is written as one. */
#include <unistd.h>

#include "fuzz/fuzz_bytes.h"

static char folder[] = "/dev/shm/facetree-fuzz-XXXXXX", mesh_path[64], tree_path[64];

static void remove_files(void) {
    unlink(mesh_path);
    unlink(tree_path);
    rmdir(folder);
}

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerInitialize(int *argc, char ***argv) {
    (void)argc, (void)argv;
    fuzz_require(mkdtemp(folder) != NULL, "a folder in memory");
    snprintf(mesh_path, sizeof mesh_path, "%s/mesh.ply", folder);
    snprintf(tree_path, sizeof tree_path, "%s/tree.fct", folder);
    return atexit(remove_files);
}

static void write_bytes(const uint8_t *data, size_t size) {
    FILE *file = fopen(mesh_path, "wb");
    fuzz_require(file && fwrite(data, 1, size, file) == size && !fclose(file), "a written file");
}

/* Both ways to read a file agree on the mesh. */
static void check_file(const fct_env *env, const fct_large_stats *stats, const fct_tree_def *def) {
    fct_mesh mesh, stored;
    fct_tree *tree;
    fuzz_require(fct_mesh_load(env, mesh_path, &mesh) == FCT_OK, "a mesh that was clustered can be loaded");
    fuzz_require(fct_tree_open(env, tree_path, &tree) == FCT_OK, "a file that was built can be opened");
    fuzz_require(fct_tree_verify(env, tree) == FCT_OK, "its tree holds");
    fct_tree_view view = fct_tree_get(tree);
    fuzz_require(view.face_count == stats->face_count && view.vertex_count == stats->vertex_count &&
                     view.root_count == stats->root_count && view.depth == stats->depth,
                 "the counts agree");
    fuzz_require(def->max_cost < INFINITY || view.root_count <= (def->root_count ? def->root_count : 1) ||
                     view.root_count == view.face_count,
                 "no more roots than wanted");
    fuzz_require(fct_tree_mesh(env, tree, &stored) == FCT_OK, "the tree holds a mesh");
    fuzz_require(stored.face_count == mesh.face_count && stored.vertex_count == mesh.vertex_count &&
                     !memcmp(stored.triangles, mesh.triangles, 12 * (size_t)mesh.face_count) &&
                     !memcmp(stored.positions, mesh.positions, 12 * (size_t)mesh.vertex_count),
                 "the mesh of the file");
    fct_mesh_release(env, &stored);
    fct_mesh_release(env, &mesh);
    fct_tree_destroy(tree);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    fuzz_bytes b = fuzz_begin(data, size);
    fct_tree_def def = fct_tree_def_default();
    fct_large_def large = fct_large_def_default();
    fct_large_stats stats;
    large.max_memory = 2 * fct_tree_build_need(1000, 1000, NULL).in_parts;
    limit.largest = large.max_memory;
    bool file = size > 3 && !memcmp(data, "ply", 3);
    if (file) {
        large.part_faces = 1 + data[size - 1] % 16;
        write_bytes(data, size);
    } else {
        uint32_t options = fuzz_byte(&b);
        large.part_faces = options & 1 ? fuzz_byte(&b) : 1 + fuzz_below(&b, 40);
        if (options & 2) def.method = FCT_CLUSTER_GREEDY;
        if (options & 4) def.cost = FCT_COST_MEAN;
        if (options & 8) def.fit_measure = FCT_FIT_POINTS;
        if (options & 16)
            def.root_count = options >> 5;
        else if (options & 32)
            def.max_cost = options >> 6;
        fct_mesh mesh = fuzz_make_mesh(&env, &b);
        bool valid = fuzz_check_mesh(&env, &mesh);
        if (valid) fuzz_require(fct_mesh_save(&env, mesh_path, &mesh, NULL) == FCT_OK, "a saved mesh");
        fct_mesh_release(&env, &mesh);
        if (!valid) {
            fuzz_end();
            return 0;
        }
    }
    fct_result result = fct_tree_build_file(&env, mesh_path, tree_path, &def, &large, &stats);
    bool excused = fuzz_full ? result == FCT_ERROR_MEMORY : file && result != FCT_ERROR_INTERNAL;
    fuzz_require(result == FCT_OK || excused, "a valid mesh has a tree");
    fuzz_end();
    if (result == FCT_OK) check_file(&env, &stats, &def);
    unlink(tree_path);
    fuzz_end();
    return 0;
}
