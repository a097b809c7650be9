/* tools/kit/labels.c: a number for each face, written as text or as a mesh of many colours. */
#include "tools/kit/tool.h"

#include <string.h>

static int write_labels(tool *t, const char *path, const uint32_t *labels, uint32_t count) {
    tool_writer writer;
    int code = tool_writer_open(t, path, &writer);
    if (code != TOOL_DONE) return code;
    for (uint32_t f = 0; f < count; ++f) fprintf(writer.stream, "%u\n", labels[f]);
    return tool_writer_close(t, &writer, TOOL_DONE);
}

/* A colour per face, where the format has one. */
static int write_face_colors(tool *t, const char *path, fct_mesh mesh, const uint32_t *labels) {
    float *colors = tool_allocate(t, mesh.face_count, 3 * sizeof *colors);
    if (!colors) return TOOL_MEMORY;
    for (uint32_t f = 0; f < mesh.face_count; ++f) tool_palette(labels[f], colors + 3 * (size_t)f);
    mesh.face_colors = colors;
    mesh.colors = NULL;
    int code = tool_save_mesh(t, path, &mesh, 1);
    tool_release(t, colors);
    return code;
}

/* Numbers the vertices of each cluster for itself: labels do not decrease along face_ids, so one stamp a
 * vertex tells whether it has its copy. Returns how many there are. */
static uint32_t split_vertices(const fct_mesh *mesh, const uint32_t *face_ids, const uint32_t *labels,
                               uint32_t *stamps, uint32_t *copies, uint32_t *triangles, uint32_t *originals) {
    uint32_t count = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) stamps[v] = FCT_NONE;
    for (uint32_t p = 0; p < mesh->face_count; ++p) {
        const size_t face = face_ids[p];
        for (size_t c = 3 * face; c < 3 * face + 3; ++c) {
            uint32_t v = mesh->triangles[c];
            if (stamps[v] != labels[face]) {
                stamps[v] = labels[face];
                originals[count] = v;
                copies[v] = count++;
            }
            triangles[c] = copies[v];
        }
    }
    return count;
}

/* A colour per vertex, with the vertices on borders doubled, for formats without colours of faces. */
static int write_vertex_colors(tool *t, const char *path, const fct_mesh *mesh, const uint32_t *face_ids,
                               const uint32_t *labels) {
    const size_t corners = 3 * (size_t)mesh->face_count;
    uint32_t *ids = tool_allocate(t, 2 * ((size_t)mesh->vertex_count + corners), sizeof *ids);
    float *values = tool_allocate(t, corners, 6 * sizeof *values);
    int code = TOOL_MEMORY;
    if (!ids || !values) goto done;
    uint32_t *stamps = ids, *copies = ids + mesh->vertex_count, *triangles = copies + mesh->vertex_count,
             *originals = triangles + corners;
    fct_mesh split = {.face_count = mesh->face_count, .triangles = triangles, .positions = values};
    split.vertex_count = split_vertices(mesh, face_ids, labels, stamps, copies, triangles, originals);
    split.colors = values + 3 * corners;
    for (size_t c = 0; c < corners; ++c) tool_palette(labels[c / 3], split.colors + 3 * (size_t)triangles[c]);
    for (size_t v = 0; v < split.vertex_count; ++v)
        memcpy(values + 3 * v, mesh->positions + 3 * (size_t)originals[v], 3 * sizeof *values);
    code = tool_save_mesh(t, path, &split, 1);
done:
    tool_release(t, ids);
    tool_release(t, values);
    return code;
}

/* The faces grouped by label, in order of label. */
static uint32_t *group_faces(tool *t, const uint32_t *labels, uint32_t faces, uint32_t count) {
    uint32_t *order = tool_allocate(t, faces, sizeof *order);
    uint32_t *ends = tool_allocate(t, (size_t)count + 1, sizeof *ends);
    if (order && ends) {
        memset(ends, 0, ((size_t)count + 1) * sizeof *ends);
        for (uint32_t f = 0; f < faces; ++f) ++ends[labels[f] + 1];
        for (uint32_t i = 0; i < count; ++i) ends[i + 1] += ends[i];
        for (uint32_t f = 0; f < faces; ++f) order[ends[labels[f]]++] = f;
    } else {
        tool_release(t, order);
        order = NULL;
    }
    tool_release(t, ends);
    return order;
}

int tool_save_labels(tool *t, const char *path, const fct_tree *tree, const uint32_t *labels,
                     uint32_t count) {
    uint32_t faces = fct_tree_get(tree).face_count;
    if (!tool_is_mesh_name(path)) return write_labels(t, path, labels, faces);
    fct_mesh mesh;
    int code = tool_result(t, fct_tree_mesh(&t->env, tree, &mesh));
    if (code != TOOL_DONE) return code;
    if (tool_ends(path, "ply") || tool_ends(path, "off")) {
        code = write_face_colors(t, path, mesh, labels);
    } else {
        uint32_t *order = group_faces(t, labels, faces, count);
        code = order ? write_vertex_colors(t, path, &mesh, order, labels) : TOOL_MEMORY;
        tool_release(t, order);
    }
    fct_mesh_release(&t->env, &mesh);
    return code;
}
