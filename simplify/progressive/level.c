/* simplify/progressive/level.c: goes to a level and writes its mesh. */
#include <math.h>
#include <string.h>

#include "base/math/vec.h"
#include "mesh/mesh.h"
#include "simplify/progressive/progressive.h"
#include "simplify/view/hierarchy.h"

void fct_progressive_split(const fct_progressive *m, uint32_t step, uint32_t *triangles, uint32_t *nodes) {
    for (uint32_t n = m->step_nodes[step]; n < m->step_nodes[step + 1]; ++n) {
        uint32_t h = m->handles[n];
        nodes[h] = n;
        for (uint32_t i = m->first_corners[n]; i < m->first_corners[n + 1]; ++i) triangles[m->corners[i]] = h;
    }
}

void fct_progressive_contract(const fct_progressive *m, uint32_t step, uint32_t *triangles, uint32_t *nodes) {
    for (uint32_t n = m->step_nodes[step]; n < m->step_nodes[step + 1]; ++n) {
        uint32_t parent = m->parents[n];
        if (parent == FCT_NONE) continue;
        uint32_t h = m->handles[parent];
        nodes[h] = parent;
        for (uint32_t i = m->first_corners[n]; i < m->first_corners[n + 1]; ++i) triangles[m->corners[i]] = h;
    }
}

void fct_progressive_forward(fct_progressive *m) {
    fct_progressive_split(m, m->level++, m->triangles, m->nodes);
}

void fct_progressive_backward(fct_progressive *m) {
    fct_progressive_contract(m, --m->level, m->triangles, m->nodes);
}

fct_result fct_progressive_begin(fct_progressive *m) {
    const fct_array arrays[] = {FCT_ARRAY(m->vertices, m->handle_count),
                                FCT_ARRAY(m->point_vertices, m->texcoord == FCT_NONE ? 0 : m->point_count)};
    fct_result result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a progressive mesh");
    if (result != FCT_OK) return result;
    memset(m->vertices, 0xff, m->handle_count * sizeof *m->vertices);
    if (m->texcoord != FCT_NONE) memset(m->point_vertices, 0xff, m->point_count * sizeof *m->point_vertices);
    while (m->level < 1) fct_progressive_forward(m);
    while (m->level > 1) fct_progressive_backward(m);
    return FCT_OK;
}

void fct_progressive_destroy(fct_progressive *m) {
    if (!m) return;
    fct_hierarchy_destroy(m->env, m->hierarchy);
    fct_names_release(m->env, m->material_names, m->material_count);
    void *arrays[] = {m->step_nodes, m->step_faces,    m->walls,     m->errors,    m->parents,
                      m->handles,    m->points,        m->corners,   m->positions, m->first_corners,
                      m->values,     m->triangles,     m->materials, m->nodes,     m->face_colors,
                      m->vertices,   m->point_vertices};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(m->env, arrays[i]);
    fct_release(m->env, m);
}

void fct_progressive_inspect(const fct_progressive *m, fct_progressive_info *out) {
    *out = (fct_progressive_info){.least_faces = m->step_faces[1],
                                  .most_faces = m->face_count,
                                  .split_count = m->step_count - 1,
                                  .total_faces = m->total_faces,
                                  .faces = m->step_faces[m->level],
                                  .error = (double)m->errors[m->level - 1]};
}

/* The finest level of at most `faces` faces, or 1. */
static uint32_t find_level(const fct_progressive *m, uint32_t faces) {
    uint32_t low = 1, high = m->step_count;
    while (low < high) {
        uint32_t middle = high - (high - low) / 2;
        if (m->step_faces[middle] <= faces)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

static uint32_t go_to_level(fct_progressive *m, uint32_t level) {
    while (level > 1 && m->walls[level - 1]) --level;
    while (m->level < level) fct_progressive_forward(m);
    while (m->level > level) fct_progressive_backward(m);
    return m->step_faces[level];
}

uint32_t fct_progressive_go(fct_progressive *m, uint32_t faces) {
    return go_to_level(m, find_level(m, faces));
}

uint32_t fct_progressive_go_error(fct_progressive *m, double error) {
    uint32_t low = 1, high = m->step_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if ((double)m->errors[middle - 1] <= error)
            high = middle;
        else
            low = middle + 1;
    }
    return go_to_level(m, low);
}

/* A mesh of a level, as it is written. */
typedef struct level_mesh {
    fct_progressive *m;
    fct_progressive_faces from;
    fct_mesh *out;
    uint32_t vertex_count;
    uint32_t *nodes;     /* per vertex */
    uint32_t *next;      /* per vertex: the vertex before it at the same point */
    uint32_t *ancestors; /* of a geomorph: per node that of the coarser level; else NULL */
    double t;            /* 1: no geomorph */
} level_mesh;

static bool same_floats(const float *a, const float *b) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Whether two nodes of one point differ at most in texture coordinates. */
static bool share_vertex(const fct_progressive *m, uint32_t a, uint32_t b) {
    const float *x = m->values + (size_t)m->value_count * a, *y = m->values + (size_t)m->value_count * b;
    return (m->color == FCT_NONE || same_floats(x + m->color, y + m->color)) &&
           (m->normal == FCT_NONE || same_floats(x + m->normal, y + m->normal));
}

/* The corner that is written as corner c. */
static size_t find_corner(const level_mesh *l, size_t c) {
    return l->from.faces ? 3 * (size_t)l->from.faces[c / 3] + c % 3 : c;
}

static uint32_t find_vertex(level_mesh *l, uint32_t handle) {
    const fct_progressive *m = l->m;
    uint32_t node = l->from.nodes[handle], first = FCT_NONE;
    if (m->texcoord != FCT_NONE) {
        first = m->point_vertices[m->points[node]];
        for (uint32_t v = first; v != FCT_NONE; v = l->next[v])
            if (share_vertex(m, l->nodes[v], node)) return v;
        l->next[l->vertex_count] = first;
        m->point_vertices[m->points[node]] = l->vertex_count;
    }
    l->nodes[l->vertex_count] = node;
    return l->vertex_count++;
}

/* Numbers the vertices in the order of their first use. vertices[handle] receives the vertex. */
static void number_vertices(level_mesh *l) {
    const fct_progressive *m = l->m;
    for (size_t c = 0; c < 3 * (size_t)l->from.count; ++c) {
        uint32_t h = l->from.triangles[find_corner(l, c)];
        if (m->vertices[h] == FCT_NONE) m->vertices[h] = find_vertex(l, h);
    }
}

/* The nodes of the coarser level that nodes belong to. Those below `least` exist there. A parent comes before
 * its children. */
static void find_ancestors(level_mesh *l, uint32_t least) {
    const fct_progressive *m = l->m;
    for (uint32_t n = 0; n < m->step_nodes[m->level]; ++n) {
        uint32_t parent = m->parents[n];
        l->ancestors[n] = n < least || parent == FCT_NONE ? n : l->ancestors[parent];
    }
}

static uint32_t find_ancestor(const level_mesh *l, uint32_t node) {
    return l->ancestors ? l->ancestors[node] : node;
}

static void blend_floats(const level_mesh *l, const float *a, const float *b, size_t count, float *out) {
    for (size_t i = 0; i < count; ++i)
        out[i] = l->t < 1 ? (float)((1 - l->t) * (double)a[i] + l->t * (double)b[i]) : b[i];
}

static void write_vertex(level_mesh *l, uint32_t v) {
    const fct_progressive *m = l->m;
    size_t b = l->nodes[v], a = find_ancestor(l, l->nodes[v]), n = m->value_count;
    blend_floats(l, m->positions + 3 * a, m->positions + 3 * b, 3, l->out->positions + 3 * (size_t)v);
    if (l->out->colors)
        blend_floats(l, m->values + n * a + m->color, m->values + n * b + m->color, 3,
                     l->out->colors + 3 * (size_t)v);
    if (!l->out->normals) return;
    float *normal = l->out->normals + 3 * (size_t)v;
    blend_floats(l, m->values + n * a + m->normal, m->values + n * b + m->normal, 3, normal);
    v3 unit = v3_unit(v3_load(normal));
    if (l->t < 1 && v3_norm2(unit) > 0) v3_store(normal, unit);
}

static void write_corner(level_mesh *l, size_t c) {
    const fct_progressive *m = l->m;
    uint32_t handle = l->from.triangles[find_corner(l, c)];
    l->out->triangles[c] = m->vertices[handle];
    if (!l->out->texcoords) return;
    size_t b = l->from.nodes[handle], a = find_ancestor(l, (uint32_t)b), n = m->value_count;
    blend_floats(l, m->values + n * a + m->texcoord, m->values + n * b + m->texcoord, 2,
                 l->out->texcoords + 2 * c);
}

static void write_face(level_mesh *l, uint32_t f) {
    const fct_progressive *m = l->m;
    size_t from = l->from.faces ? l->from.faces[f] : f;
    if (m->materials) l->out->materials[f] = m->materials[from];
    if (m->face_colors)
        memcpy(l->out->face_colors + 3 * (size_t)f, m->face_colors + 3 * from, 3 * sizeof *m->face_colors);
}

static fct_result fill_mesh(level_mesh *l) {
    const fct_progressive *m = l->m;
    uint32_t faces = l->from.count;
    unsigned kinds = (m->color != FCT_NONE ? FCT_MESH_COLORS : 0) |
                     (m->normal != FCT_NONE ? FCT_MESH_NORMALS : 0) |
                     (m->texcoord != FCT_NONE ? FCT_MESH_TEXCOORDS : 0) |
                     (m->face_colors ? FCT_MESH_FACE_COLORS : 0) | (m->materials ? FCT_MESH_MATERIALS : 0);
    fct_result result = fct_mesh_create(m->env, l->vertex_count, faces, kinds, l->out);
    if (result == FCT_OK)
        result = fct_names_copy(m->env, m->material_names, m->material_count, &l->out->material_names);
    if (result != FCT_OK) return result;
    l->out->material_count = m->material_count;
    memcpy(l->out->origin, m->origin, sizeof l->out->origin);
    for (uint32_t v = 0; v < l->vertex_count; ++v) write_vertex(l, v);
    for (size_t c = 0; c < 3 * (size_t)faces; ++c) write_corner(l, c);
    for (uint32_t f = 0; f < faces; ++f) write_face(l, f);
    return FCT_OK;
}

static fct_result make_mesh(fct_progressive *m, const fct_progressive_faces *from, uint32_t least, double t,
                            fct_mesh *out) {
    level_mesh l = {.m = m, .from = *from, .out = out, .t = t};
    size_t corners = 3 * (size_t)from->count;
    const fct_array arrays[] = {FCT_ARRAY(l.nodes, corners),
                                FCT_ARRAY(l.next, m->texcoord == FCT_NONE ? 0 : corners),
                                FCT_ARRAY_IF(t < 1, l.ancestors, m->step_nodes[m->level])};
    *out = (fct_mesh){0};
    fct_result result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a level");
    if (result != FCT_OK) return result;
    number_vertices(&l);
    if (l.ancestors) find_ancestors(&l, least);
    result = fill_mesh(&l);
    for (size_t c = 0; c < corners; ++c) {
        uint32_t h = from->triangles[find_corner(&l, c)];
        m->vertices[h] = FCT_NONE;
        if (m->texcoord != FCT_NONE) m->point_vertices[m->points[from->nodes[h]]] = FCT_NONE;
    }
    if (result != FCT_OK) fct_mesh_release(m->env, out);
    fct_release_all(m->env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_progressive_write_faces(fct_progressive *m, const fct_progressive_faces *from, fct_mesh *out) {
    return make_mesh(m, from, 0, 1, out);
}

/* The faces of the current level. */
static fct_progressive_faces find_faces(const fct_progressive *m) {
    return (fct_progressive_faces){m->triangles, m->nodes, NULL, m->step_faces[m->level]};
}

fct_result fct_progressive_mesh(fct_progressive *m, fct_mesh *out) {
    fct_progressive_faces from = find_faces(m);
    return make_mesh(m, &from, 0, 1, out);
}

fct_result fct_progressive_morph(fct_progressive *m, uint32_t faces, double t, fct_mesh *out) {
    *out = (fct_mesh){0};
    if (!(t >= 0 && t <= 1)) return fct_fail(m->env, FCT_ERROR_DATA, "t is %g, expected 0 to 1", t);
    fct_progressive_faces from = find_faces(m);
    return make_mesh(m, &from, m->step_nodes[find_level(m, faces)], t, out);
}
