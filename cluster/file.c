/* cluster/file.c: the hierarchy file, byte by byte in docs/hierarchy-file.md.
 *
 * A header of 448 bytes with counts, options and a table of ten sections; the sections follow in the table's
 * order, each at a multiple of 64. Nodes come first, root first, so that a coarse computation touches the
 * beginning of the file. Opening checks the header's checksum, bounds and the tree's structure, but not the
 * sections' checksums: those are fct_tree_verify's.
 */
#include "cluster/file.h"

#include <inttypes.h>
#include <string.h>

#include <xxhash.h>

enum {
    VERSION = 1,
    ORDER_MARK = 0x01020304,
    ALIGNMENT = 64,
};

typedef enum section_kind {
    NODES,
    ROOTS,
    FACE_IDS,
    VERTEX_IDS,
    TRIANGLES,
    POSITIONS,
    COLORS,
    MATERIALS,
    MATERIAL_NAMES,
    SOURCE,
    SECTIONS
} section_kind;

static const char *const section_names[SECTIONS] = {"nodes",     "roots",     "face ids", "vertex ids",
                                                    "triangles", "positions", "colors",   "materials",
                                                    "names",     "source"};

typedef struct section {
    uint32_t kind, reserved;
    uint64_t offset, size, checksum;
} section;

typedef struct header {
    unsigned char magic[8];
    uint32_t version, order_mark;
    uint64_t file_size;
    uint64_t checksum; /* XXH3-64 of the header with this field zero */
    uint32_t face_count, vertex_count, node_count, root_count, depth, material_count;
    double mean_depth;
    uint64_t source_hash;
    uint32_t method, cost, fit_measure, wanted_roots;
    double fit_weight, direction_weight, shape_weight, max_cost;
    uint32_t section_count, flags;
    section sections[SECTIONS];
} header;

enum { HAS_COLORS = 1, HAS_MATERIALS = 2, HAS_NAMES = 4 };

_Static_assert(sizeof(header) == 448 && sizeof(fct_cluster) == 132, "the file's layout is these structs'");

static const unsigned char magic[8] = {0x89, 'F', 'C', 'T', '\r', '\n', 0x1A, '\n'};

static uint64_t header_checksum(const header *h) {
    header copy = *h;
    copy.checksum = 0;
    return XXH3_64bits(&copy, sizeof copy);
}

/* Sizes of the sections that follow from the counts; names and source are free. */
static void expected_sizes(const header *h, uint64_t sizes[SECTIONS]) {
    uint64_t faces = h->face_count, vertices = h->vertex_count;
    sizes[NODES] = (uint64_t)h->node_count * sizeof(fct_cluster);
    sizes[ROOTS] = 4 * (uint64_t)h->root_count;
    sizes[FACE_IDS] = 4 * faces;
    sizes[VERTEX_IDS] = 4 * vertices;
    sizes[TRIANGLES] = 12 * faces;
    sizes[POSITIONS] = 12 * vertices;
    sizes[COLORS] = h->flags & HAS_COLORS ? 12 * vertices : 0;
    sizes[MATERIALS] = h->flags & HAS_MATERIALS ? 4 * faces : 0;
}

typedef struct saver {
    const fct_tree_view *view;
    header h;
    const void *data[SECTIONS];
    char *names;
} saver;

static fct_result gather_names(const fct_env *env, saver *s, uint64_t *size) {
    *size = 0;
    for (uint32_t i = 0; s->view->material_names && i < s->view->material_count; ++i)
        *size += strlen(s->view->material_names[i]) + 1;
    char *to = s->names = fct_allocate(env, *size, 1);
    if (!to) return fct_fail_memory(env, "a hierarchy file");
    for (uint32_t i = 0; s->view->material_names && i < s->view->material_count; ++i) {
        size_t length = strlen(s->view->material_names[i]) + 1;
        memcpy(to, s->view->material_names[i], length);
        to += length;
    }
    return FCT_OK;
}

static void fill_header(saver *s, uint64_t names_size) {
    const fct_tree_view *view = s->view;
    header *h = &s->h;
    *h = (header){.version = VERSION,
                  .order_mark = ORDER_MARK,
                  .face_count = view->face_count,
                  .vertex_count = view->vertex_count,
                  .node_count = view->node_count,
                  .root_count = view->root_count,
                  .depth = view->depth,
                  .material_count = view->material_count,
                  .mean_depth = view->mean_depth,
                  .source_hash = view->source_hash,
                  .method = view->def.method,
                  .cost = view->def.cost,
                  .fit_measure = view->def.fit_measure,
                  .wanted_roots = view->def.root_count,
                  .fit_weight = view->def.fit_weight,
                  .direction_weight = view->def.direction_weight,
                  .shape_weight = view->def.shape_weight,
                  .max_cost = view->def.max_cost,
                  .section_count = SECTIONS};
    memcpy(h->magic, magic, sizeof magic);
    h->flags = (view->colors ? HAS_COLORS : 0u) | (view->materials ? HAS_MATERIALS : 0u) |
               (view->material_names ? HAS_NAMES : 0u);
    uint64_t sizes[SECTIONS], offset = sizeof *h;
    expected_sizes(h, sizes);
    sizes[MATERIAL_NAMES] = names_size;
    sizes[SOURCE] = strlen(view->source) + 1;
    const void *data[SECTIONS] = {view->clusters,  view->roots,     view->face_ids, view->vertex_ids,
                                  view->triangles, view->positions, view->colors,   view->materials,
                                  s->names,        view->source};
    for (uint32_t i = 0; i < SECTIONS; ++i) {
        s->data[i] = data[i];
        h->sections[i] = (section){i, 0, offset, sizes[i], XXH3_64bits(sizes[i] ? data[i] : "", sizes[i])};
        offset = (offset + sizes[i] + ALIGNMENT - 1) & ~(uint64_t)(ALIGNMENT - 1);
    }
    h->file_size = offset;
    h->checksum = header_checksum(h);
}

static fct_result write_sections(void *user, FILE *stream) {
    static const char zeros[ALIGNMENT];
    const saver *s = user;
    fwrite(&s->h, sizeof s->h, 1, stream);
    for (uint32_t i = 0; i < SECTIONS; ++i) {
        uint64_t size = s->h.sections[i].size;
        if (size) fwrite(s->data[i], 1, size, stream);
        fwrite(zeros, 1, -size & (ALIGNMENT - 1), stream);
    }
    return FCT_OK;
}

fct_result fct_tree_save(const fct_env *env, const fct_tree *tree, const char *path) {
    saver s = {.view = &tree->view};
    uint64_t names_size = 0;
    fct_result result = gather_names(env, &s, &names_size);
    if (result != FCT_OK) return result;
    fill_header(&s, names_size);
    result = fct_file_write_atomic(env, path, write_sections, &s);
    fct_release(env, s.names);
    return result;
}

/* NULL, or what is wrong with the header of a file of `size` bytes. */
static const char *header_fault(const header *h, size_t size) {
    if (h->order_mark != ORDER_MARK) return "written with another byte order, or damaged";
    if (h->version != VERSION) return "a version this library does not read";
    if (h->checksum != header_checksum(h)) return "damaged header";
    if (h->file_size != size) return "truncated or with something appended";
    if (h->section_count != SECTIONS) return "wrong number of sections";
    if (h->face_count == 0 || h->face_count >= INT32_MAX || h->vertex_count >= INT32_MAX) return "bad counts";
    if (h->root_count == 0 || h->root_count > h->face_count || h->node_count != h->face_count - h->root_count)
        return "counts of nodes and roots do not fit the faces";
    if (h->method > FCT_CLUSTER_ROUNDS || h->cost > FCT_COST_MEAN || h->fit_measure > FCT_FIT_POINTS)
        return "unknown options";
    uint64_t sizes[SECTIONS], offset = sizeof *h;
    expected_sizes(h, sizes);
    for (uint32_t i = 0; i < SECTIONS; ++i) {
        const section *s = &h->sections[i];
        if (s->kind != i || s->offset != offset || s->size > size - offset) return "bad section table";
        if (i < MATERIAL_NAMES && s->size != sizes[i]) return "section sizes do not fit the counts";
        offset = (offset + s->size + ALIGNMENT - 1) & ~(uint64_t)(ALIGNMENT - 1);
        if (offset > size) return "bad section table";
    }
    return NULL;
}

/* Pointers to the names in their section, which must hold exactly as many strings. */
static fct_result read_names(const fct_env *env, const char *name, const header *h, const char *data,
                             fct_tree *tree) {
    if (!(h->flags & HAS_NAMES)) return FCT_OK;
    const section *s = &h->sections[MATERIAL_NAMES];
    const char *text = data + s->offset, *end = text + s->size;
    if (h->material_count > s->size) return fct_fail(env, FCT_ERROR_DATA, "%s: names are missing", name);
    const char **names = fct_allocate(env, h->material_count, sizeof *names);
    if (!names) return fct_fail_memory(env, "material names");
    tree->names = (char **)names;
    tree->view.material_names = names;
    for (uint32_t i = 0; i < h->material_count; ++i) {
        const char *nul = memchr(text, 0, (size_t)(end - text));
        if (!nul) return fct_fail(env, FCT_ERROR_DATA, "%s: material name %u is missing", name, i);
        names[i] = text;
        text = nul + 1;
    }
    return FCT_OK;
}

static void fill_view(const header *h, const char *data, fct_tree *tree) {
    fct_tree_view *view = &tree->view;
    view->face_count = h->face_count, view->vertex_count = h->vertex_count;
    view->node_count = h->node_count, view->root_count = h->root_count;
    view->material_count = h->material_count;
    view->clusters = (const fct_cluster *)(data + h->sections[NODES].offset);
    view->roots = (const uint32_t *)(data + h->sections[ROOTS].offset);
    view->face_ids = (const uint32_t *)(data + h->sections[FACE_IDS].offset);
    view->vertex_ids = (const uint32_t *)(data + h->sections[VERTEX_IDS].offset);
    view->triangles = (const uint32_t *)(data + h->sections[TRIANGLES].offset);
    view->positions = (const float *)(data + h->sections[POSITIONS].offset);
    if (h->flags & HAS_COLORS) view->colors = (const float *)(data + h->sections[COLORS].offset);
    if (h->flags & HAS_MATERIALS) view->materials = (const uint32_t *)(data + h->sections[MATERIALS].offset);
    view->source_hash = h->source_hash;
    view->def = (fct_tree_def){.size = sizeof(fct_tree_def),
                               .method = (fct_cluster_method)h->method,
                               .cost = (fct_cluster_cost)h->cost,
                               .fit_measure = (fct_fit_measure)h->fit_measure,
                               .fit_weight = h->fit_weight,
                               .direction_weight = h->direction_weight,
                               .shape_weight = h->shape_weight,
                               .root_count = h->wanted_roots,
                               .max_cost = h->max_cost,
                               .source_hash = h->source_hash};
}

/* tree->file holds the bytes. */
static fct_result read_file(const fct_env *env, const char *name, fct_tree *tree) {
    const char *data = (const char *)tree->file.data;
    if (tree->file.size < sizeof magic || memcmp(data, magic, sizeof magic))
        return fct_fail(env, FCT_ERROR_DATA, "%s: no hierarchy file", name);
    if (tree->file.size < sizeof(header))
        return fct_fail(env, FCT_ERROR_DATA, "%s: truncated in the header", name);
    header h;
    memcpy(&h, data, sizeof h);
    const char *fault = header_fault(&h, tree->file.size);
    if (fault) return fct_fail(env, FCT_ERROR_DATA, "%s: %s", name, fault);
    fill_view(&h, data, tree);
    const section *source = &h.sections[SOURCE];
    if (source->size == 0 || data[source->offset + source->size - 1])
        return fct_fail(env, FCT_ERROR_DATA, "%s: the source's name has no end", name);
    tree->view.source = data + source->offset;
    fct_result result = read_names(env, name, &h, data, tree);
    return result == FCT_OK ? fct_tree_check_structure(env, name, tree) : result;
}

static fct_result finish(fct_tree *tree, fct_result result, fct_tree **out) {
    if (result == FCT_OK)
        *out = tree;
    else
        fct_tree_destroy(tree);
    return result;
}

fct_result fct_tree_parse(const fct_env *env, const char *name, const void *data, size_t size,
                          fct_tree **out) {
    *out = NULL;
    fct_tree *tree = fct_tree_new(env);
    unsigned char *copy = fct_allocate(env, size, 1);
    if (!tree || !copy) {
        fct_release(env, copy);
        return finish(tree, fct_fail_memory(env, "a hierarchy"), out);
    }
    if (size) memcpy(copy, data, size);
    tree->file = (fct_file){.data = copy, .size = size};
    return finish(tree, read_file(env, name, tree), out);
}

fct_result fct_tree_open(const fct_env *env, const char *path, fct_tree **out) {
    *out = NULL;
    fct_tree *tree = fct_tree_new(env);
    if (!tree) return fct_fail_memory(env, "a hierarchy");
    fct_result result = fct_file_open(env, path, &tree->file);
    if (result == FCT_OK) result = read_file(env, path, tree);
    return finish(tree, result, out);
}

fct_result fct_tree_check_sums(const fct_env *env, const fct_tree *tree) {
    if (!tree->file.data) return FCT_OK;
    const header *h = (const header *)tree->file.data;
    for (uint32_t i = 0; i < SECTIONS; ++i) {
        const section *s = &h->sections[i];
        if (XXH3_64bits(tree->file.data + s->offset, s->size) != s->checksum)
            return fct_fail(env, FCT_ERROR_DATA, "the checksum of the section of %s is wrong",
                            section_names[i]);
        uint64_t end = i + 1 < SECTIONS ? h->sections[i + 1].offset : h->file_size;
        for (uint64_t at = s->offset + s->size; at < end; ++at)
            if (tree->file.data[at])
                return fct_fail(env, FCT_ERROR_DATA, "byte %" PRIu64 ", after the section of %s, is not zero",
                                at, section_names[i]);
    }
    return FCT_OK;
}
