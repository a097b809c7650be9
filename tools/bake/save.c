/* tools/bake/save.c: see save.h. */
#include "tools/bake/save.h"

#include <string.h>

#include "tools/kit/file.h"
#include "tools/kit/model.h"

static bool stores_face_colors(const char *path) {
    static const char *const others[] = {"glb", "obj", "om", "stl"};
    for (size_t i = 0; i < sizeof others / sizeof *others; ++i)
        if (tool_ends(path, others[i])) return false;
    return true;
}

/* A mesh whose faces share no vertices, with the colours of the faces. */
static int spread_faces(tool *t, const fct_mesh *mesh, fct_mesh *out) {
    const size_t corners = 3 * (size_t)mesh->face_count;
    if (corners > INT32_MAX - 1)
        return tool_fail(t, TOOL_DATA, "%u faces with three vertices each are too many", mesh->face_count);
    const unsigned arrays = FCT_MESH_COLORS | (mesh->normals ? FCT_MESH_NORMALS : 0);
    int code = tool_result(t, fct_mesh_create(&t->env, (uint32_t)corners, mesh->face_count, arrays, out));
    if (code != TOOL_DONE) return code;
    memcpy(out->origin, mesh->origin, sizeof out->origin);
    for (size_t c = 0; c < corners; ++c) {
        out->triangles[c] = (uint32_t)c;
        const size_t v = 3 * (size_t)mesh->triangles[c];
        memcpy(out->positions + 3 * c, mesh->positions + v, 3 * sizeof(float));
        if (mesh->normals) memcpy(out->normals + 3 * c, mesh->normals + v, 3 * sizeof(float));
        memcpy(out->colors + 3 * c, mesh->face_colors + c / 3 * 3, 3 * sizeof(float));
    }
    return TOOL_DONE;
}

int bake_save_mesh(tool *t, const char *path, const fct_mesh *mesh, const fct_mesh_save_def *def) {
    if (!mesh->face_colors || stores_face_colors(path)) return tool_save_mesh_as(t, path, mesh, def);
    fct_mesh spread = {0};
    int code = spread_faces(t, mesh, &spread);
    if (code == TOOL_DONE) code = tool_save_mesh_as(t, path, &spread, def);
    fct_mesh_release(&t->env, &spread);
    return code;
}
