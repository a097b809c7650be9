/* tools/make/mesh.c: a mesh that grows, and the files of a scene. */
#include "tools/make/parts.h"

#include <limits.h>
#include <string.h>

#include "tools/kit/file.h"

static bool grow_array(make_mesh *m, void **array, size_t *capacity, size_t needed, size_t size) {
    if (needed <= *capacity) return true;
    size_t larger = *capacity + *capacity / 2 + 1024;
    if (larger < needed) larger = needed;
    void *memory = needed < FCT_NONE / 3 ? tool_allocate(m->t, larger, size) : NULL;
    if (!memory) {
        m->failed = true;
        return false;
    }
    if (*array) memcpy(memory, *array, *capacity * size);
    tool_release(m->t, *array);
    *array = memory;
    *capacity = larger;
    return true;
}

void make_reserve(make_mesh *m, size_t vertices, size_t faces) {
    grow_array(m, (void **)&m->positions, &m->vertex_capacity, m->vertex_count + vertices, 3 * sizeof(float));
    grow_array(m, (void **)&m->triangles, &m->face_capacity, m->face_count + faces, 3 * sizeof(uint32_t));
}

uint32_t make_vertex(make_mesh *m, make_point p) {
    if (!grow_array(m, (void **)&m->positions, &m->vertex_capacity, m->vertex_count + 1, 3 * sizeof(float)))
        return 0;
    float *to = m->positions + 3 * m->vertex_count;
    to[0] = (float)p.x, to[1] = (float)p.y, to[2] = (float)p.z;
    return (uint32_t)m->vertex_count++;
}

void make_triangle(make_mesh *m, uint32_t a, uint32_t b, uint32_t c) {
    if (!grow_array(m, (void **)&m->triangles, &m->face_capacity, m->face_count + 1, 3 * sizeof(uint32_t)))
        return;
    uint32_t *to = m->triangles + 3 * m->face_count++;
    to[0] = a, to[1] = b, to[2] = c;
}

void make_quad(make_mesh *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    make_triangle(m, a, b, c);
    make_triangle(m, a, c, d);
}

void make_patch(make_mesh *m, make_point a, make_point b, make_point c, make_point d) {
    uint32_t first = make_vertex(m, a);
    make_vertex(m, b), make_vertex(m, c), make_vertex(m, d);
    make_quad(m, first, first + 1, first + 2, first + 3);
}

void make_turn(make_mesh *m) {
    for (size_t f = 0; f < m->face_count; ++f) {
        uint32_t *t = m->triangles + 3 * f, b = t[1];
        t[1] = t[2], t[2] = b;
    }
}

void make_clear(make_mesh *m) {
    tool_release(m->t, m->positions);
    tool_release(m->t, m->triangles);
    *m = (make_mesh){.t = m->t};
}

int make_save(make_mesh *m, const char *path) {
    fct_mesh mesh = {.vertex_count = (uint32_t)m->vertex_count,
                     .face_count = (uint32_t)m->face_count,
                     .positions = m->positions,
                     .triangles = m->triangles};
    fct_mesh_save_def def = fct_mesh_save_def_default();
    int code = m->failed ? tool_fail(m->t, TOOL_MEMORY, "%s: out of memory for the mesh", path)
                         : tool_result(m->t, fct_mesh_save(&m->t->env, path, &mesh, &def));
    make_clear(m);
    return code;
}

int make_scene_part(make_mesh *m, const char *folder, const char *name, make_result *result) {
    char path[PATH_MAX];
    if ((size_t)snprintf(path, sizeof path, "%s/%s", folder, name) >= sizeof path)
        return tool_fail(m->t, TOOL_OUTPUT, "%s: the name is too long", folder);
    json_array_append_new(result->files, json_string(path));
    return make_save(m, path);
}

int make_scene_file(tool *t, const char *folder, json_t *document, make_result *result) {
    char path[PATH_MAX];
    tool_writer writer;
    int code = TOOL_DONE;
    if (!document) code = tool_fail(t, TOOL_MEMORY, "out of memory for the scene file");
    if (code == TOOL_DONE && (size_t)snprintf(path, sizeof path, "%s/scene.json", folder) >= sizeof path)
        code = tool_fail(t, TOOL_OUTPUT, "%s: the name is too long", folder);
    if (code == TOOL_DONE) code = tool_writer_open(t, path, &writer);
    if (code == TOOL_DONE) {
        bool bad = json_dumpf(document, writer.stream, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) != 0;
        fputc('\n', writer.stream);
        if (bad) code = tool_fail(t, TOOL_OUTPUT, "%s: cannot be written", path);
        code = tool_writer_close(t, &writer, code);
    }
    json_decref(document);
    if (code == TOOL_DONE) json_array_append_new(result->files, json_string(path));
    return code;
}
