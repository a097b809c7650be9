/* cluster/large/large.c: fct_tree_build_file: divides the allowed memory between the steps, then runs them.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cluster/large/large.h"

#include "cluster/tree/build.h"

/* Peak memory, measured, in bytes. */
enum {
    PART_BYTES = 235,        /* per face of a part */
    VERTEX_BYTES = 32,       /* per vertex of a part */
    MEAN_BYTES = 168,        /* more per face with the cost MEAN: an fct_mean_record */
    CORNER_BYTES = 12,       /* more per face where vertices are joined */
    TOP_BYTES = 640,         /* per top */
    BUFFER_BYTES = 12 << 20, /* of all buffers */
    LEAST_PART = 1 << 16     /* faces of the smallest part that least_bytes plans for */
};

fct_large_def fct_large_def_default(void) {
    return (fct_large_def){.size = sizeof(fct_large_def), .max_memory = UINT64_C(4) << 30};
}

static uint64_t larger(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

/* Bytes that every step needs, whatever the size of the parts: buffers, and three bits per vertex (the shared
 * vertices, and the used ones with their counts while a part is loaded). */
static uint64_t fixed_bytes(uint64_t vertices) {
    return BUFFER_BYTES + 3 * vertices / 8;
}

static uint64_t face_bytes(uint64_t faces, uint64_t vertices, bool mean) {
    return PART_BYTES + (mean ? MEAN_BYTES : 0) + (faces ? VERTEX_BYTES * vertices / faces : 0);
}

static uint64_t least_bytes(uint64_t faces, uint64_t vertices, bool mean) {
    uint64_t part = faces < LEAST_PART ? faces : LEAST_PART;
    uint64_t piece = part * face_bytes(faces, vertices, mean);
    /* cut.c takes 6 bytes per vertex, write.c 5 per face and then mesh.c 4 per vertex, besides buffers and
     * tops */
    uint64_t whole = larger(faces, vertices) * 15 / 2;
    return (fixed_bytes(vertices) + larger(whole, piece)) / 7 * 8;
}

fct_build_need fct_tree_build_need(uint32_t face_count, uint32_t vertex_count, const fct_tree_def *def) {
    bool mean = def && def->cost == FCT_COST_MEAN;
    uint64_t faces = face_count, vertices = vertex_count, direction = mean ? MEAN_BYTES : 0;
    uint64_t contracting = (212 + direction) * faces + 24 * vertices,
             describing = 184 * faces + 40 * vertices;
    return (fct_build_need){.in_memory = contracting > describing ? contracting : describing,
                            .in_parts = least_bytes(face_count, vertex_count, mean)};
}

static fct_result plan(fct_large *l, const fct_large_def *def) {
    uint64_t faces = l->info.face_count, vertices = l->info.vertex_count;
    bool mean = l->def->cost == FCT_COST_MEAN;
    uint64_t least = least_bytes(faces, vertices, mean), limit = def->max_memory;
    if (limit < least)
        return fct_fail(l->env, FCT_ERROR_MEMORY,
                        "%llu MB are too little for a tree of %llu faces, which takes at least %llu MB",
                        (unsigned long long)limit >> 20, (unsigned long long)faces,
                        (unsigned long long)(least >> 20) + 1);
    uint64_t room = limit / 8 * 7 - fixed_bytes(vertices);
    l->budget = (size_t)room;
    uint64_t part = room / (face_bytes(faces, vertices, mean) + (l->joined ? CORNER_BYTES : 0));
    part = part / 5 * 4; /* because cut.c lets a part have a quarter more */
    l->part_faces = (uint32_t)(def->part_faces ? def->part_faces : part < INT32_MAX ? part : INT32_MAX);
    uint64_t tops = room / 2 / TOP_BYTES;
    l->top_limit = (uint32_t)(tops < INT32_MAX ? tops : INT32_MAX);
    return FCT_OK;
}

static void release(fct_large *l) {
    fct_spool *spools[] = {&l->faces,     &l->nodes,  &l->costs,  &l->face_ids, &l->triangles,
                           &l->materials, &l->tops,   &l->sums,   &l->means,    &l->edges,
                           &l->sides,     &l->welded, &l->corners};
    for (size_t i = 0; i < sizeof spools / sizeof *spools; ++i) fct_spool_close(spools[i]);
    fct_stream_close(l->stream);
    fct_release(l->env, l->shared);
    fct_release(l->env, l->runs);
    fct_release(l->env, l->parts);
    fct_release(l->env, l->all_tops);
    fct_release(l->env, l->upper);
    fct_release(l->env, l->top_order);
    fct_release(l->env, l->top_places);
}

static fct_result build(fct_large *l, const char *mesh_path, const fct_large_def *def, fct_large_stats *stats,
                        fct_tree_view *view) {
    double start = fct_seconds();
    fct_result result = fct_stream_open(l->env, mesh_path, l->folder, l->path, &l->stream);
    if (result != FCT_OK) return result;
    l->info = fct_stream_get(l->stream);
    if (l->info.face_count == 0)
        return fct_fail(l->env, FCT_ERROR_DATA, "%s: expected at least one face, found none", mesh_path);
    result = plan(l, def);
    if (result == FCT_OK && l->def->weld) result = fct_large_weld(l);
    l->joined = l->welded.env != NULL;
    if (result == FCT_OK && l->joined) result = plan(l, def);
    if (result == FCT_OK) result = fct_large_cut(l);
    stats->seconds_read = fct_seconds() - start;
    if (result == FCT_OK) result = fct_large_pieces(l);
    fct_release(l->env, l->shared);
    l->shared = NULL;
    if (result == FCT_OK) result = fct_large_seams(l);
    if (result == FCT_OK) result = fct_large_contract(l);
    if (result == FCT_OK) result = fct_large_describe(l);
    double described = fct_seconds();
    if (result == FCT_OK) result = fct_large_write(l, view);
    stats->seconds_write = fct_seconds() - described;
    return result;
}

fct_result fct_tree_build_file(const fct_env *env, const char *mesh_path, const char *tree_path,
                               const fct_tree_def *def, const fct_large_def *large_def,
                               fct_large_stats *stats) {
    fct_tree_def options = def ? *def : fct_tree_def_default();
    fct_large_def limits = large_def ? *large_def : fct_large_def_default();
    fct_large_stats unused;
    if (!stats) stats = &unused;
    *stats = (fct_large_stats){0};
    if (limits.size != sizeof limits)
        return fct_fail(env, FCT_ERROR_DATA, "fct_large_def has size %u, this library's is %zu", limits.size,
                        sizeof limits);
    fct_result result = fct_tree_check_def(env, &options);
    if (result != FCT_OK) return result;
    fct_large l = {.env = env, .def = &options, .folder = limits.temporary_folder, .path = tree_path};
    fct_tree_view view = {0};
    result = build(&l, mesh_path, &limits, stats, &view);
    stats->face_count = l.info.face_count, stats->vertex_count = l.info.vertex_count;
    stats->root_count = view.root_count, stats->depth = view.depth, stats->mean_depth = view.mean_depth;
    stats->inward = view.inward;
    stats->part_count = (uint32_t)l.part_count, stats->top_count = l.top_count;
    stats->seconds_dual = l.seconds_dual, stats->seconds_contract = l.seconds_contract;
    stats->seconds_boxes = l.seconds_boxes;
    release(&l);
    return result;
}
