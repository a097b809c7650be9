/* cluster/file/open.c: opening and verifying hierarchy files.
 *
 * Opening reads the head (header, source, names of materials): its checksum, the counts, and the places of
 * the sections, which follow from the counts. Its time does not depend on the number of faces. Sections are
 * checked when they are used (walk.c, structure.c), their checksums by fct_tree_verify.
 */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "cluster/file/format.h"
#include "cluster/tree/check/verify.h"

static const char *find_counts_fault(const fct_format_header *h) {
    if (h->face_count == 0 || h->face_count >= INT32_MAX || h->vertex_count == 0 ||
        h->vertex_count >= INT32_MAX)
        return "bad counts";
    if (h->root_count == 0 || h->root_count > h->face_count || h->node_count != h->face_count - h->root_count)
        return "counts of nodes and roots do not fit the faces";
    if (h->cut_count && (h->cut_count < h->root_count || h->cut_count > h->face_count))
        return "the cut's size does not fit the faces";
    if (h->depth > h->node_count || (h->face_count > 1 && h->depth > 3 * log2(h->face_count)) ||
        !(h->mean_depth >= 0 && h->mean_depth <= h->depth))
        return "bad depth";
    for (int k = 0; k < 3; ++k)
        if (!isfinite(h->bounds.lower[k]) || !isfinite(h->bounds.upper[k]) ||
            h->bounds.lower[k] > h->bounds.upper[k])
            return "bad bounds";
    if (!isfinite(h->origin[0]) || !isfinite(h->origin[1]) || !isfinite(h->origin[2])) return "bad origin";
    if (h->method > FCT_CLUSTER_ROUNDS || h->cost > FCT_COST_MEAN || h->fit_measure > FCT_FIT_POINTS)
        return "unknown options";
    return NULL;
}

/* Describes the first fault in the head of a file of `size` bytes at `data`; NULL: none. Copies the header
 * to *h. */
static const char *find_head_fault(const fct_format_header *h, const void *data, size_t size) {
    if (h->order_mark != FCT_FORMAT_ORDER_MARK) return "written with another byte order, or damaged";
    if (h->file_size != size) return "truncated, with something appended, or damaged";
    if (h->head_size < sizeof *h || h->head_size > size) return "damaged header";
    if (h->checksum != fct_format_head_checksum(data, h->head_size)) return "damaged header";
    const char *fault = find_counts_fault(h);
    if (fault) return fault;
    if (h->source_size > size || h->names_size > size) return "bad sizes of names";
    fct_format_header expected = *h;
    fct_format_place(&expected);
    for (int i = 0; i < FCT_SECTION_COUNT; ++i) expected.sections[i].checksum = h->sections[i].checksum;
    return memcmp(h, &expected, sizeof expected) ? "bad section table" : NULL;
}

/* Sets the source and pointers to the names; the head must hold as many strings. */
static fct_result read_names(const fct_env *env, const char *name, const fct_format_header *h,
                             fct_tree *tree) {
    const char *source = (const char *)tree->file.data + sizeof *h, *text = source + h->source_size;
    const char *end = text + h->names_size;
    if (h->source_size == 0 || source[h->source_size - 1])
        return fct_fail(env, FCT_ERROR_DATA, "%s: the source's name has no end", name);
    tree->view.source = source;
    if (!(h->flags & FCT_FORMAT_NAMES)) return FCT_OK;
    if (h->material_count > h->names_size)
        return fct_fail(env, FCT_ERROR_DATA, "%s: names are missing", name);
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

static const void *find_section(const fct_tree *tree, const fct_format_header *h, fct_section section) {
    return tree->file.data + h->sections[section].offset;
}

static void fill_view(const fct_format_header *h, fct_tree *tree) {
    fct_tree_view *view = &tree->view;
    view->face_count = h->face_count, view->vertex_count = h->vertex_count;
    view->node_count = h->node_count, view->root_count = h->root_count;
    view->depth = h->depth, view->mean_depth = h->mean_depth;
    view->boundary_edges = h->boundary_edges, view->nonmanifold_edges = h->nonmanifold_edges;
    view->component_count = h->component_count;
    view->inward = h->flags & FCT_FORMAT_INWARD;
    view->bounds = h->bounds;
    memcpy(view->origin, h->origin, sizeof view->origin);
    view->material_count = h->material_count;
    view->roots = find_section(tree, h, FCT_SECTION_ROOTS);
    tree->nodes = find_section(tree, h, FCT_SECTION_NODES);
    view->face_ids = find_section(tree, h, FCT_SECTION_FACE_IDS);
    view->vertex_ids = find_section(tree, h, FCT_SECTION_VERTEX_IDS);
    view->triangles = find_section(tree, h, FCT_SECTION_TRIANGLES);
    view->positions = find_section(tree, h, FCT_SECTION_POSITIONS);
    if (h->flags & FCT_FORMAT_COLORS) view->colors = find_section(tree, h, FCT_SECTION_COLORS);
    if (h->flags & FCT_FORMAT_MATERIALS) view->materials = find_section(tree, h, FCT_SECTION_MATERIALS);
    view->source_hash = h->source_hash;
    view->def = (fct_tree_def){.size = sizeof(fct_tree_def),
                               .method = (fct_cluster_method)h->method,
                               .cost = (fct_cluster_cost)h->cost,
                               .fit_measure = (fct_fit_measure)h->fit_measure,
                               .fit_weight = h->fit_weight,
                               .direction_weight = h->direction_weight,
                               .shape_weight = h->shape_weight,
                               .root_count = h->wanted_roots,
                               .weld = h->flags & FCT_FORMAT_WELD,
                               .max_cost = h->max_cost,
                               .source_hash = h->source_hash};
    tree->cut_ids = find_section(tree, h, FCT_SECTION_CUT_IDS);
    tree->cut = find_section(tree, h, FCT_SECTION_CUT);
    tree->cut_count = h->cut_count;
    atomic_init(&tree->unchecked, true);
}

static fct_result keep_path(const fct_env *env, const char *name, fct_tree *tree) {
    tree->path = fct_allocate(env, strlen(name) + 1, 1);
    if (!tree->path) return fct_fail_memory(env, "a hierarchy");
    strcpy(tree->path, name);
    return FCT_OK;
}

/* Reads the head of the bytes in tree->file. */
static fct_result read_file(const fct_env *env, const char *name, fct_tree *tree) {
    const unsigned char *data = tree->file.data;
    size_t size = tree->file.size;
    fct_file_advise(&tree->file, 0, size, FCT_FILE_SPARSE);
    if (size < sizeof fct_format_magic || memcmp(data, fct_format_magic, sizeof fct_format_magic))
        return fct_fail(env, FCT_ERROR_DATA, "%s: no hierarchy file", name);
    fct_format_header h = {0};
    memcpy(&h, data, size < sizeof h ? size : sizeof h);
    if (h.order_mark == FCT_FORMAT_ORDER_MARK && h.version != FCT_FORMAT_VERSION)
        return fct_fail(env, FCT_ERROR_DATA,
                        "%s: version %u of the hierarchy file, expected %d: build it anew from its mesh",
                        name, h.version, FCT_FORMAT_VERSION);
    if (size < sizeof h) return fct_fail(env, FCT_ERROR_DATA, "%s: truncated in the header", name);
    const char *fault = find_head_fault(&h, data, size);
    if (fault) return fct_fail(env, FCT_ERROR_DATA, "%s: %s", name, fault);
    fill_view(&h, tree);
    fct_result result = read_names(env, name, &h, tree);
    return result == FCT_OK ? keep_path(env, name, tree) : result;
}

static fct_result finish_tree(fct_tree *tree, fct_result result, fct_tree **out) {
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
        return finish_tree(tree, fct_fail_memory(env, "a hierarchy"), out);
    }
    if (size) memcpy(copy, data, size);
    tree->file = (fct_file){.data = copy, .size = size};
    return finish_tree(tree, read_file(env, name, tree), out);
}

fct_result fct_tree_open(const fct_env *env, const char *path, fct_tree **out) {
    *out = NULL;
    fct_tree *tree = fct_tree_new(env);
    if (!tree) return fct_fail_memory(env, "a hierarchy");
    fct_result result = fct_file_open(env, path, &tree->file);
    if (result == FCT_OK) result = read_file(env, path, tree);
    return finish_tree(tree, result, out);
}

static fct_result check_gap(const fct_env *env, const fct_tree *tree, const char *after, uint64_t begin,
                            uint64_t end) {
    for (uint64_t at = begin; at < end; ++at)
        if (tree->file.data[at])
            return fct_fail(env, FCT_ERROR_DATA, "%s: byte %" PRIu64 ", after the %s, is not zero",
                            tree->path, at, after);
    return FCT_OK;
}

/* The checksums of all sections and the zeros between them, if the tree came from a file. */
static fct_result check_sums(const fct_env *env, const fct_tree *tree) {
    if (!tree->file.data) return FCT_OK;
    fct_format_header header;
    const fct_format_header *h = &header;
    memcpy(&header, tree->file.data, sizeof header);
    if (find_head_fault(h, tree->file.data, tree->file.size))
        return fct_fail(env, FCT_ERROR_DATA, "%s: changed since it was opened", tree->path);
    uint64_t *hashes = fct_allocate(env, fct_format_block_count(h->file_size), sizeof *hashes);
    if (!hashes) return fct_fail_memory(env, "verifying");
    fct_file_advise(&tree->file, 0, tree->file.size, FCT_FILE_WHOLE);
    fct_result result = check_gap(env, tree, "head", h->head_size, h->sections[0].offset);
    for (int i = 0; i < FCT_SECTION_COUNT && result == FCT_OK; ++i) {
        const fct_format_section *s = &h->sections[i];
        const char *name = fct_format_section_name(i);
        fct_format_hash_blocks(env, tree->file.data + s->offset, s->size, hashes);
        if (fct_format_fold(hashes, fct_format_block_count(s->size)) != s->checksum)
            result = fct_fail(env, FCT_ERROR_DATA, "%s: the checksum of the section of %s is wrong",
                              tree->path, name);
        else
            result = check_gap(env, tree, name, s->offset + s->size,
                               i + 1 < FCT_SECTION_COUNT ? h->sections[i + 1].offset : h->file_size);
    }
    fct_release(env, hashes);
    return result;
}

fct_result fct_tree_verify(const fct_env *env, const fct_tree *tree) {
    fct_result result = check_sums(env, tree);
    return result == FCT_OK ? fct_tree_verify_contents(env, tree) : result;
}
