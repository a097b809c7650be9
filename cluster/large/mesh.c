/* cluster/large/mesh.c: writes the faces and vertices of a large mesh to its hierarchy file.
 *
 * Faces are in the order of the roots, and within a root in the order of the tops. A vertex is numbered and
 * written with the first face that uses it; unused vertices come last, and so do those that others replace.
 * Memory: 4 bytes per vertex.
 */
#include <string.h>

#include "cluster/large/lookup.h"

enum { ROWS = 1 << 14 }; /* faces or vertices per read and write */

typedef struct mesh_writer {
    fct_large *large;
    fct_tree_writer *out;
    const fct_large_root *roots;
    uint32_t root_count;
} mesh_writer;

/* Reads a spool with one row per face in the order of the file, some rows at a time. */
typedef struct face_order {
    const mesh_writer *w;
    const fct_spool *spool;
    size_t size;       /* bytes per row */
    uint32_t root, at; /* of the next row: root, and place in the tree with one root */
    uint32_t top;      /* index in top_order; FCT_NONE: not yet known */
} face_order;

static face_order open_order(const mesh_writer *w, const fct_spool *spool, size_t size) {
    return (face_order){w, spool, size, 0, w->roots[0].first, FCT_NONE};
}

static uint32_t find_top(const fct_large *l, uint32_t at) {
    uint32_t low = 0, high = l->top_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (l->top_places[middle] <= at)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Reads up to `count` rows; *got is smaller only at the end. */
static fct_result read_rows(face_order *o, void *rows, uint32_t count, uint32_t *got) {
    const mesh_writer *w = o->w;
    const fct_large *l = w->large;
    for (*got = 0; *got < count && o->root < w->root_count;) {
        const fct_large_root *r = &w->roots[o->root];
        if (o->at == r->first + r->count) {
            if (++o->root < w->root_count) o->at = w->roots[o->root].first, o->top = FCT_NONE;
            continue;
        }
        if (o->top == FCT_NONE)
            o->top = find_top(l, o->at);
        else if (o->at == l->top_places[o->top + 1])
            ++o->top;
        uint32_t end = l->top_places[o->top + 1], last = r->first + r->count;
        uint32_t take = (end < last ? end : last) - o->at;
        if (take > count - *got) take = count - *got;
        const fct_top *top = &l->all_tops[l->top_order[o->top]];
        uint64_t at = l->parts[top->part].first_face + top->first + (o->at - l->top_places[o->top]);
        fct_result result =
            fct_spool_read(o->spool, at * o->size, (char *)rows + *got * o->size, take * o->size);
        if (result != FCT_OK) return result;
        *got += take, o->at += take;
    }
    return FCT_OK;
}

static fct_result copy_section(const mesh_writer *w, const fct_spool *spool, fct_section section) {
    uint32_t *rows = fct_allocate(w->large->env, ROWS, sizeof *rows), got = ROWS;
    face_order o = open_order(w, spool, sizeof *rows);
    fct_result result = rows ? FCT_OK : fct_fail_memory(w->large->env, "a hierarchy file");
    while (result == FCT_OK && got == ROWS) {
        result = read_rows(&o, rows, ROWS, &got);
        if (result == FCT_OK) result = fct_tree_writer_put(w->out, section, rows, got * sizeof *rows);
    }
    fct_release(w->large->env, rows);
    return result;
}

typedef struct vertex_writer {
    const mesh_writer *mesh;
    fct_lookup lookup;
    uint32_t *renamed; /* per input vertex: number in the file; FCT_NONE: none yet */
    uint32_t used, waiting, ids[ROWS];
    float positions[3 * ROWS], colors[3 * ROWS];
} vertex_writer;

static fct_result flush_vertices(vertex_writer *w) {
    fct_tree_writer *out = w->mesh->out;
    fct_large *l = w->mesh->large;
    fct_result result = FCT_OK;
    for (uint32_t i = 0; i < w->waiting && result == FCT_OK; ++i) {
        const float *p = fct_lookup_vertex(&w->lookup, w->ids[i]);
        if (!p) return fct_lookup_result(&w->lookup);
        memcpy(w->positions + 3 * (size_t)i, p, 3 * sizeof *p);
        float unused[3];
        if (l->info.colors)
            result = fct_stream_vertices(l->stream, w->ids[i], 1, unused, w->colors + 3 * (size_t)i);
    }
    if (result == FCT_OK)
        result = fct_tree_writer_put(out, FCT_SECTION_VERTEX_IDS, w->ids, w->waiting * sizeof *w->ids);
    if (result == FCT_OK)
        result = fct_tree_writer_put(out, FCT_SECTION_POSITIONS, w->positions, w->waiting * 12);
    if (result == FCT_OK && l->info.colors)
        result = fct_tree_writer_put(out, FCT_SECTION_COLORS, w->colors, w->waiting * 12);
    w->waiting = 0;
    return result;
}

static fct_result name_vertex(vertex_writer *w, uint32_t vertex) {
    w->renamed[vertex] = w->used++;
    w->ids[w->waiting++] = vertex;
    return w->waiting == ROWS ? flush_vertices(w) : FCT_OK;
}

/* Names the vertices of the triangles in a spool. put: writes the triangles too. */
static fct_result visit_triangles(vertex_writer *w, const fct_spool *spool, bool put, uint32_t *rows) {
    const mesh_writer *m = w->mesh;
    uint32_t got = ROWS, done = 0;
    face_order o = open_order(m, spool, 12);
    while (got == ROWS) {
        fct_result result = read_rows(&o, rows, ROWS, &got);
        if (result == FCT_OK)
            result = fct_progress(m->large->env, "write", 0.7 + 0.3 * done / m->large->info.face_count);
        for (size_t i = 0; i < 3 * (size_t)got && result == FCT_OK; ++i) {
            if (w->renamed[rows[i]] == FCT_NONE) result = name_vertex(w, rows[i]);
            rows[i] = w->renamed[rows[i]];
        }
        if (result == FCT_OK && put)
            result = fct_tree_writer_put(m->out, FCT_SECTION_TRIANGLES, rows, (size_t)got * 12);
        if (result != FCT_OK) return result;
        done += got;
    }
    return FCT_OK;
}

static fct_result write_triangles(vertex_writer *w, uint32_t *rows) {
    const fct_large *l = w->mesh->large;
    fct_result result = visit_triangles(w, &l->triangles, !l->joined, rows);
    for (uint32_t v = 0; v < l->info.vertex_count && result == FCT_OK; ++v)
        if (w->renamed[v] == FCT_NONE) result = name_vertex(w, v);
    if (result == FCT_OK && l->joined) result = visit_triangles(w, &l->corners, true, rows);
    return result == FCT_OK ? flush_vertices(w) : result;
}

static fct_result write_vertices(const mesh_writer *m) {
    const fct_env *env = m->large->env;
    size_t vertices = m->large->info.vertex_count;
    vertex_writer *w = fct_allocate(env, 1, sizeof *w);
    uint32_t *rows = fct_allocate(env, ROWS, 3 * sizeof *rows);
    uint32_t *renamed = fct_allocate(env, vertices, sizeof *renamed);
    fct_result result = FCT_OK;
    if (!w || !rows || !renamed) {
        result = fct_fail_memory(env, "a hierarchy file");
    } else {
        w->mesh = m, w->renamed = renamed;
        w->used = w->waiting = 0;
        memset(renamed, 0xFF, vertices * sizeof *renamed);
        result = fct_lookup_open(m->large, m->large->budget / 4, &w->lookup);
        if (result == FCT_OK) result = write_triangles(w, rows);
        fct_lookup_close(&w->lookup);
    }
    fct_release(env, w);
    fct_release(env, rows);
    fct_release(env, renamed);
    return result;
}

fct_result fct_large_write_mesh(fct_large *large, fct_tree_writer *out, const fct_large_root *roots,
                                uint32_t root_count) {
    mesh_writer m = {large, out, roots, root_count};
    fct_result result = copy_section(&m, &large->face_ids, FCT_SECTION_FACE_IDS);
    if (result == FCT_OK && large->info.materials)
        result = copy_section(&m, &large->materials, FCT_SECTION_MATERIALS);
    return result == FCT_OK ? write_vertices(&m) : result;
}
