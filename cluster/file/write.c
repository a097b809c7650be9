/* cluster/file/write.c: writes the hierarchy file section by section; fct_tree_save.
 *
 * The places of the sections follow from the counts, so any section can grow at any time. Blocks are hashed
 * as they come. The cut, the checksums and the head come last, from what was written. Memory: the hashes (8
 * bytes per MiB) and half a megabyte for the cut.
 */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#define XXH_STATIC_LINKING_ONLY
#include <xxhash.h>

#include "base/io/output.h"
#include "cluster/file/format.h"
#include "cluster/tree/describe/single.h"

enum { PORTION = 64 * FCT_FORMAT_BLOCK };

/* How much of a section is written. */
typedef struct section_state {
    uint64_t written;
    uint64_t *hashes;
    XXH3_state_t block; /* of the incomplete block */
} section_state;

struct fct_tree_writer {
    section_state sections[FCT_SECTION_COUNT];
    fct_format_header header;
    char *head; /* header, source and names */
    const fct_env *env;
    fct_output output;
};

static fct_format_header make_header(const fct_tree_view *view, unsigned arrays) {
    const fct_tree_def *def = &view->def;
    fct_format_header h = {.version = FCT_FORMAT_VERSION,
                           .order_mark = FCT_FORMAT_ORDER_MARK,
                           .face_count = view->face_count,
                           .vertex_count = view->vertex_count,
                           .node_count = view->node_count,
                           .root_count = view->root_count,
                           .material_count = view->material_count,
                           .source_hash = view->source_hash,
                           .method = def->method,
                           .cost = def->cost,
                           .fit_measure = def->fit_measure,
                           .wanted_roots = def->root_count,
                           .fit_weight = def->fit_weight,
                           .direction_weight = def->direction_weight,
                           .shape_weight = def->shape_weight,
                           .max_cost = def->max_cost,
                           .source_size = strlen(view->source) + 1};
    memcpy(h.magic, fct_format_magic, sizeof h.magic);
    memcpy(h.origin, view->origin, sizeof h.origin);
    if (arrays & FCT_MESH_COLORS) h.flags |= FCT_FORMAT_COLORS;
    if (arrays & FCT_MESH_MATERIALS) h.flags |= FCT_FORMAT_MATERIALS;
    if (view->material_names) h.flags |= FCT_FORMAT_NAMES;
    if (def->weld) h.flags |= FCT_FORMAT_WELD;
    for (uint32_t i = 0; view->material_names && i < view->material_count; ++i)
        h.names_size += strlen(view->material_names[i]) + 1;
    uint32_t cut = view->face_count / 16 < FCT_FORMAT_CUT ? view->face_count / 16 : FCT_FORMAT_CUT;
    h.cut_count = cut >= view->root_count ? cut : 0;
    fct_format_place(&h);
    return h;
}

static fct_result allocate(const fct_env *env, const fct_tree_view *view, fct_tree_writer *writer) {
    const fct_format_header *h = &writer->header;
    writer->head = fct_allocate_zero(env, h->head_size, 1);
    bool complete = writer->head != NULL;
    for (int i = 0; i < FCT_SECTION_COUNT; ++i) {
        section_state *s = &writer->sections[i];
        s->hashes = fct_allocate(env, fct_format_block_count(h->sections[i].size), sizeof *s->hashes);
        complete = complete && s->hashes;
    }
    if (!complete) return fct_fail_memory(env, "writing a hierarchy file");
    char *to = writer->head + sizeof *h;
    memcpy(to, view->source, h->source_size);
    to += h->source_size;
    for (uint32_t i = 0; view->material_names && i < view->material_count; ++i) {
        size_t length = strlen(view->material_names[i]) + 1;
        memcpy(to, view->material_names[i], length);
        to += length;
    }
    return FCT_OK;
}

fct_result fct_tree_writer_open(const fct_env *env, const char *path, const fct_tree_view *view,
                                unsigned arrays, fct_tree_writer **out) {
    *out = NULL;
    fct_tree_writer *writer = fct_allocate_zero(env, 1, sizeof *writer);
    if (!writer) return fct_fail_memory(env, "writing a hierarchy file");
    writer->env = env;
    writer->output.descriptor = -1;
    writer->header = make_header(view, arrays);
    fct_result result = allocate(env, view, writer);
    if (result == FCT_OK) result = fct_output_open(env, path, writer->header.file_size, &writer->output);
    if (result == FCT_OK)
        *out = writer;
    else
        fct_tree_writer_abandon(writer);
    return result;
}

void fct_tree_writer_abandon(fct_tree_writer *writer) {
    if (!writer) return;
    const fct_env *env = writer->env;
    fct_output_abandon(&writer->output);
    for (int i = 0; i < FCT_SECTION_COUNT; ++i) fct_release(env, writer->sections[i].hashes);
    fct_release(env, writer->head);
    fct_release(env, writer);
}

/* Adds the next bytes of a section to its hashes: whole blocks in parallel, the rest piece by piece. */
static void hash_bytes(const fct_env *env, section_state *s, uint64_t whole, const char *data, size_t size) {
    while (size > 0) {
        size_t inside = s->written % FCT_FORMAT_BLOCK, take = FCT_FORMAT_BLOCK - inside;
        uint64_t *to = s->hashes + s->written / FCT_FORMAT_BLOCK;
        if (!inside && size >= FCT_FORMAT_BLOCK) {
            take = size / FCT_FORMAT_BLOCK * FCT_FORMAT_BLOCK;
            fct_format_hash_blocks(env, data, take, to);
        } else {
            take = take < size ? take : size;
            if (!inside) XXH3_64bits_reset(&s->block);
            XXH3_64bits_update(&s->block, data, take);
            if (inside + take == FCT_FORMAT_BLOCK || s->written + take == whole)
                *to = XXH3_64bits_digest(&s->block);
        }
        s->written += take, data += take, size -= take;
    }
}

fct_result fct_tree_writer_put(fct_tree_writer *writer, fct_section section, const void *data, size_t size) {
    section_state *s = &writer->sections[section];
    const fct_format_section *place = &writer->header.sections[section];
    const char *from = data;
    assert(size <= place->size - s->written);
    while (size > 0) {
        size_t take = size < PORTION ? size : PORTION;
        fct_result result = fct_output_write(&writer->output, place->offset + s->written, from, take);
        if (result != FCT_OK) return result;
        hash_bytes(writer->env, s, place->size, from, take);
        from += take, size -= take;
    }
    return FCT_OK;
}

/* --- The cut --- */

static fct_result read_back(const fct_tree_writer *writer, fct_section section, uint64_t first,
                            uint64_t count, size_t size, void *out) {
    return fct_output_read(&writer->output, writer->header.sections[section].offset + first * size, out,
                           (size_t)count * size);
}

static int compare_ids(const void *a, const void *b) {
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static fct_result describe_face(const fct_tree_writer *writer, uint32_t place, fct_cluster *out) {
    static const uint32_t corners[3] = {0, 1, 2};
    uint32_t triangle[3];
    float positions[9];
    fct_result result = read_back(writer, FCT_SECTION_TRIANGLES, place, 1, sizeof triangle, triangle);
    for (int k = 0; k < 3 && result == FCT_OK; ++k)
        result = read_back(writer, FCT_SECTION_POSITIONS, triangle[k], 1, 12, positions + 3 * k);
    if (result != FCT_OK) return result;
    const fct_tree_view view = {
        .face_count = 1, .vertex_count = 3, .positions = positions, .triangles = corners};
    fct_leaf_describe(&view, 0, out);
    out->first = place;
    return FCT_OK;
}

/* Lists the roots and children with ids from `opened` on, whose parents have smaller ids: the partition that
 * opens all nodes below `opened`. Returns their number, at most room + 1. */
static uint32_t list_cut(const fct_cluster *top, uint32_t opened, uint32_t *ids, uint32_t roots,
                         uint32_t room) {
    uint32_t count = 0;
    for (uint32_t r = 0; r < roots; ++r)
        if (ids[r] >= opened) ids[count++] = ids[r];
    for (uint32_t i = 0; i < opened; ++i)
        for (int k = 0; k < 2 && count <= room; ++k)
            if (top[i].child[k] >= opened && count++ < room) ids[count - 1] = top[i].child[k];
    return count;
}

static fct_result put_cut(fct_tree_writer *writer, fct_cluster *top, fct_cluster *records, uint32_t *ids) {
    const fct_format_header *h = &writer->header;
    uint32_t count = h->cut_count, opened = count - h->root_count;
    fct_result result = read_back(writer, FCT_SECTION_ROOTS, 0, h->root_count, sizeof *ids, ids);
    if (result == FCT_OK) result = read_back(writer, FCT_SECTION_NODES, 0, opened, sizeof *top, top);
    if (result != FCT_OK) return result;
    if (list_cut(top, opened, ids, h->root_count, count) != count)
        return fct_fail(writer->env, FCT_ERROR_INTERNAL, "the nodes of a hierarchy are not in order");
    qsort(ids, count, sizeof *ids, compare_ids);
    for (uint32_t i = 0; i < count && result == FCT_OK; ++i)
        result = ids[i] < h->node_count
                     ? read_back(writer, FCT_SECTION_NODES, ids[i], 1, sizeof *records, &records[i])
                     : describe_face(writer, ids[i] - h->node_count, &records[i]);
    if (result == FCT_OK) result = fct_tree_writer_put(writer, FCT_SECTION_CUT_IDS, ids, count * sizeof *ids);
    if (result == FCT_OK)
        result = fct_tree_writer_put(writer, FCT_SECTION_CUT, records, count * sizeof *records);
    return result;
}

static fct_result write_cut(fct_tree_writer *writer) {
    const fct_env *env = writer->env;
    uint32_t count = writer->header.cut_count;
    if (!count) return FCT_OK;
    fct_cluster *top;
    fct_cluster *records;
    uint32_t *ids;
    const fct_array arrays[] = {FCT_ARRAY(top, count), FCT_ARRAY(records, count), FCT_ARRAY(ids, count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "writing a hierarchy file");
    if (result == FCT_OK) result = put_cut(writer, top, records, ids);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

/* --- The end --- */

static fct_result write_head(fct_tree_writer *writer, const fct_tree_view *view) {
    fct_format_header *h = &writer->header;
    h->depth = view->depth, h->mean_depth = view->mean_depth;
    h->boundary_edges = view->boundary_edges, h->nonmanifold_edges = view->nonmanifold_edges;
    h->component_count = view->component_count;
    if (view->inward) h->flags |= FCT_FORMAT_INWARD;
    h->bounds = view->bounds;
    for (int i = 0; i < FCT_SECTION_COUNT; ++i) {
        assert(writer->sections[i].written == h->sections[i].size);
        h->sections[i].checksum =
            fct_format_fold(writer->sections[i].hashes, fct_format_block_count(h->sections[i].size));
    }
    memcpy(writer->head, h, sizeof *h);
    h->checksum = fct_format_head_checksum(writer->head, h->head_size);
    memcpy(writer->head, h, sizeof *h);
    return fct_output_write(&writer->output, 0, writer->head, h->head_size);
}

fct_result fct_tree_writer_finish(fct_tree_writer *writer, const fct_tree_view *view) {
    fct_result result = write_cut(writer);
    if (result == FCT_OK) result = write_head(writer, view);
    if (result == FCT_OK) result = fct_output_finish(&writer->output);
    fct_tree_writer_abandon(writer);
    return result;
}

/* --- A whole tree --- */

/* Writes a section in pieces, between which the caller can cancel. */
static fct_result put_section(fct_tree_writer *writer, int section, const void *data) {
    const fct_format_section *place = &writer->header.sections[section];
    const char *from = data;
    for (uint64_t done = 0; data && done < place->size;) {
        uint64_t left = place->size - done, take = left < PORTION ? left : PORTION;
        fct_result result = fct_progress(writer->env, "write",
                                         (double)(place->offset + done) / (double)writer->header.file_size);
        if (result == FCT_OK)
            result = fct_tree_writer_put(writer, (fct_section)section, from + done, (size_t)take);
        if (result != FCT_OK) return result;
        done += take;
    }
    return FCT_OK;
}

fct_result fct_tree_save(const fct_env *env, const fct_tree *tree, const char *path) {
    const fct_tree_view *view = &tree->view;
    const void *data[FCT_SECTION_COUNT] = {
        [FCT_SECTION_ROOTS] = view->roots,         [FCT_SECTION_NODES] = tree->nodes,
        [FCT_SECTION_FACE_IDS] = view->face_ids,   [FCT_SECTION_VERTEX_IDS] = view->vertex_ids,
        [FCT_SECTION_TRIANGLES] = view->triangles, [FCT_SECTION_POSITIONS] = view->positions,
        [FCT_SECTION_COLORS] = view->colors,       [FCT_SECTION_MATERIALS] = view->materials};
    fct_tree_writer *writer;
    fct_result result = fct_tree_check(env, tree);
    if (result != FCT_OK) return result;
    result = fct_tree_writer_open(
        env, path, view, (view->colors ? FCT_MESH_COLORS : 0u) | (view->materials ? FCT_MESH_MATERIALS : 0u),
        &writer);
    if (result != FCT_OK) return result;
    for (int i = 0; i < FCT_SECTION_COUNT && result == FCT_OK; ++i) result = put_section(writer, i, data[i]);
    if (result == FCT_OK) return fct_tree_writer_finish(writer, view);
    fct_tree_writer_abandon(writer);
    return result;
}
