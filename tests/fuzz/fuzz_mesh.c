/* Whatever the bytes are: an error, or a mesh that keeps its promises and can be inspected and clustered. */
#include <string.h>

#include "facetree/cluster.h"
#include "fuzz/fuzz.h"
#include "mesh/load.h"

static void use(const fct_env *env, const fct_mesh *mesh) {
    fuzz_require(fct_mesh_validate(env, mesh) == FCT_OK, "a mesh that was read is valid");
    fct_mesh_report report;
    fuzz_require(fct_mesh_inspect(env, mesh, &report) == FCT_OK, "a valid mesh can be inspected");
    fuzz_require(report.faces == mesh->face_count && report.vertices == mesh->vertex_count, "counts agree");
    for (uint32_t f = 1; mesh->source_faces && f < mesh->face_count; ++f)
        fuzz_require(mesh->source_faces[f - 1] <= mesh->source_faces[f], "faces come in the file's order");
    for (uint32_t f = 0; mesh->materials && f < mesh->face_count; ++f)
        fuzz_require(mesh->materials[f] < mesh->material_count, "material ids are in range");
    if (!mesh->face_count) return;
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree;
    fuzz_require(fct_tree_build(env, mesh, &def, NULL, &tree) == FCT_OK, "a valid mesh can be clustered");
    fuzz_require(fct_tree_verify(env, tree) == FCT_OK, "its tree holds");
    fct_tree_destroy(tree);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    fct_mesh mesh, empty = {0};
    if (fct_mesh_parse(&env, "input", data, size, FUZZ_FORMAT, &mesh) == FCT_OK) {
        use(&env, &mesh);
        fct_mesh_release(&env, &mesh);
    }
    fuzz_require(memcmp(&mesh, &empty, sizeof mesh) == 0, "a failed read leaves nothing behind");
    fuzz_end();
    return 0;
}
