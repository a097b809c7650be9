/* tools/labels.c: see labels.h. Cost: linear in the faces. */
#include "tools/labels.h"

#include <math.h>
#include <string.h>

#include "tools/kit/file.h"
#include "tools/kit/model.h"

/* Walks through the 192^3 colours with bytes from 64 to 255. The step has no common divisor with their
 * number, so no colour repeats; it is near the golden section of it, so neighbouring indices are far apart.
 */
void tool_palette(uint32_t index, float color[3]) {
    const uint64_t side = 192, count = side * side * side, step = 4373987;
    uint64_t place = ((index + 1) * step) % count;
    for (int c = 0; c < 3; ++c, place /= side) {
        double s = (double)(64 + place % side) / 255;
        color[c] = (float)pow((s + 0.055) / 1.055, 2.4);
    }
}

static int write_labels(tool *t, const char *path, const uint32_t *labels, uint32_t count) {
    tool_writer writer;
    int code = tool_writer_open(t, path, &writer);
    if (code != TOOL_DONE) return code;
    for (uint32_t f = 0; f < count; ++f) fprintf(writer.stream, "%u\n", labels[f]);
    return tool_writer_close(t, &writer, TOOL_DONE);
}

/* A colour per face, for formats that store one. */
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

/* Gives each label its own copy of the vertices it uses. Labels do not decrease along face_ids, so one stamp
 * per vertex tells whether the current label has its copy. Returns the number of copies. */
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

/* A colour per vertex, with doubled vertices on borders, for formats without face colours. */
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

/* The faces in the order of their labels. NULL after a recorded error. */
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
