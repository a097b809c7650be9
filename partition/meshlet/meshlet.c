/* partition/meshlet/meshlet.c: fct_tree_meshlets.
 *
 * 1. Read from the tree which places are near each other and how large a meshlet is there.
 * 2. Grow pieces (grow.c) and pack them (pack.c).
 * 3. Write each piece as a meshlet, in order of the tree: faces in order of places, vertices by first use.
 * A range of places has a new vertex for each corner whose vertex has no earlier face in the range. O(F log
 * F).
 */
#include <string.h>

#include "base/math/vec.h"
#include "base/parallel.h"
#include "cluster/tree/welded.h"
#include "partition/cut.h"
#include "partition/meshlet/bounds.h"
#include "partition/meshlet/grow.h"
#include "partition/meshlet/pack.h"

enum {
    GRAIN = 256,
    NEARBY = 16,     /* meshlets per home */
    REGION = 1 << 17 /* faces per region that grows independently */
};

fct_meshlet_def fct_meshlet_def_default(void) {
    return (fct_meshlet_def){
        .size = sizeof(fct_meshlet_def), .max_vertices = 64, .max_triangles = 124, .flatness = 1};
}

static bool fits_meshlet(void *user, uint32_t node, uint32_t thread) {
    (void)thread;
    const fct_packer *p = user;
    uint32_t first = fct_node_first(p->tree, node), count = fct_node_faces(p->tree, node), vertices = 0;
    if (count > p->def.max_triangles) return false;
    for (uint32_t f = first; f < first + count; ++f) {
        const uint32_t *before = p->vertex_before + 3 * (size_t)f, *t = p->view->triangles + 3 * (size_t)f;
        for (int k = 0; k < 3; ++k) {
            bool repeated = (k > 0 && t[k] == t[0]) || (k > 1 && t[k] == t[1]);
            vertices += !repeated && (before[k] == FCT_NONE || before[k] < first);
        }
        if (p->view->materials && p->view->materials[f] != p->view->materials[first]) return false;
    }
    return vertices <= p->def.max_vertices;
}

typedef struct size_test {
    const fct_tree *tree;
    uint32_t most;
} size_test;

static bool is_small(void *user, uint32_t node, uint32_t thread) {
    (void)thread;
    const size_test *test = user;
    return fct_node_faces(test->tree, node) <= test->most;
}

static void link_corners(const fct_tree_view *view, uint32_t *last, uint32_t *vertex_before) {
    for (uint32_t v = 0; v < view->vertex_count; ++v) last[v] = FCT_NONE;
    for (size_t f = 0; f < view->face_count; ++f) {
        const uint32_t *t = view->triangles + 3 * f;
        for (size_t k = 0; k < 3; ++k) vertex_before[3 * f + k] = last[t[k]];
        for (size_t k = 0; k < 3; ++k) last[t[k]] = (uint32_t)f;
    }
}

/* --- Pieces --- */

static void release_packer(const fct_env *env, fct_packer *p) {
    fct_sides_release(env, &p->sides);
    fct_release(env, p->vertex_before);
    fct_release(env, p->reach);
    fct_release(env, p->home);
    fct_release(env, p->owner);
    fct_release(env, p->faces);
    fct_release(env, p->vertices);
    fct_release(env, p->uses);
    fct_release(env, p->face_counts);
    fct_release(env, p->vertex_counts);
}

/* Cuts the places into runs of successive subtrees with at most `most` faces. `bounds` holds face_count + 1
 * and receives *count places from 0 to face_count. */
static fct_result cut_runs(const fct_env *env, const fct_tree *tree, uint32_t most, uint32_t *bounds,
                           uint32_t *count) {
    const fct_tree_view *view = &tree->view;
    size_test test = {tree, most};
    uint32_t nodes, place = 0, runs = 0;
    fct_result result = fct_cut_tree(env, tree, "meshlets", is_small, &test, bounds, &nodes);
    if (result != FCT_OK) return result;
    for (uint32_t i = 0, begin = 0; i < nodes; ++i) { /* writing never overtakes reading */
        uint32_t faces = fct_node_faces(tree, bounds[i]);
        if (place > begin && place + faces - begin > most) {
            bounds[runs++] = begin;
            begin = place;
        }
        place += faces;
        if (i + 1 == nodes) bounds[runs++] = begin;
    }
    bounds[runs++] = view->face_count;
    *count = runs;
    return FCT_OK;
}

/* Sets home and reach of each place. */
static fct_result read_scales(const fct_env *env, const fct_tree *tree, fct_packer *p, uint32_t *scratch) {
    uint32_t count;
    fct_result result = cut_runs(env, tree, NEARBY * p->def.max_triangles, scratch, &count);
    for (uint32_t i = 0; i + 1 < count && result == FCT_OK; ++i)
        for (uint32_t f = scratch[i]; f < scratch[i + 1]; ++f) p->home[f] = i;
    if (result == FCT_OK) result = fct_cut_tree(env, tree, "meshlets", fits_meshlet, p, scratch, &count);
    for (uint32_t i = 0; i < count && result == FCT_OK; ++i) {
        fct_cluster room;
        const fct_cluster *c = fct_node_cluster(tree, scratch[i], &room);
        float reach = (float)v3_norm(v3_load(c->box_half));
        for (uint32_t f = c->first; f < c->first + c->count; ++f) p->reach[f] = reach;
    }
    return result;
}

typedef struct piece_run {
    fct_packer *packer;
    const uint32_t *bounds;
} piece_run;

static void fill_pieces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const piece_run *run = user;
    for (uint32_t f = run->bounds[begin]; f < run->bounds[end]; ++f)
        fct_packer_add(run->packer, run->packer->owner[f], f);
}

/* Fills the lists of the pieces from `owner`. No piece crosses a bound, so runs are independent. */
static fct_result fill_lists(const fct_env *env, fct_packer *p, const uint32_t *bounds, uint32_t count) {
    size_t faces = (size_t)p->count * p->def.max_triangles, vertices = (size_t)p->count * p->def.max_vertices;
    const fct_array arrays[] = {FCT_ARRAY(p->faces, faces), FCT_ARRAY(p->vertices, vertices),
                                FCT_ARRAY(p->uses, vertices), FCT_ARRAY_ZERO(p->face_counts, p->count),
                                FCT_ARRAY_ZERO(p->vertex_counts, p->count)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "meshlets") != FCT_OK) return FCT_ERROR_MEMORY;
    piece_run run = {p, bounds};
    fct_parallel_for(env, count - 1, 1, fill_pieces, &run);
    return FCT_OK;
}

static fct_result make_pieces(const fct_env *env, const fct_tree *tree, fct_packer *p) {
    const fct_tree_view *view = p->view;
    uint32_t most = view->face_count > view->vertex_count ? view->face_count : view->vertex_count, count;
    uint32_t *scratch;
    const fct_array arrays[] = {FCT_ARRAY(scratch, (size_t)most + 1),
                                FCT_ARRAY(p->vertex_before, 3 * (size_t)view->face_count),
                                FCT_ARRAY(p->reach, view->face_count), FCT_ARRAY(p->home, view->face_count),
                                FCT_ARRAY(p->owner, view->face_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "meshlets");
    if (result == FCT_OK) {
        link_corners(view, scratch, p->vertex_before);
        result = read_scales(env, tree, p, scratch);
    }
    if (result == FCT_OK)
        result = fct_sides_build(env, view->triangles, view->face_count, view->vertex_count, &p->sides);
    if (result == FCT_OK) result = cut_runs(env, tree, REGION, scratch, &count);
    if (result == FCT_OK) result = fct_meshlets_grow(env, p, scratch, count);
    if (result == FCT_OK) result = fill_lists(env, p, scratch, count);
    if (result == FCT_OK) result = fct_meshlets_pack(env, p);
    fct_release(env, scratch);
    return result;
}

/* --- Output --- */

typedef struct writer {
    const fct_packer *packer;
    const uint32_t *pieces; /* per meshlet */
    fct_meshlets *out;
} writer;

/* Writes vertices by first use and replaces the places in out->faces by input faces. */
static void write_meshlet(const writer *w, uint32_t m) {
    const fct_tree_view *view = w->packer->view;
    fct_meshlets *out = w->out;
    const fct_meshlet *meshlet = &out->meshlets[m];
    float positions[3 * FCT_MESHLET_VERTICES];
    uint32_t local[FCT_MESHLET_VERTICES], vertices = 0, *faces = out->faces + out->first_face[m];
    uint8_t *triangles = out->triangles + meshlet->triangle_offset;
    for (uint32_t t = 0; t < meshlet->triangle_count; ++t) {
        for (size_t k = 0; k < 3; ++k) {
            uint32_t vertex = view->triangles[3 * (size_t)faces[t] + k], i = vertices;
            while (i > 0 && local[i - 1] != vertex) --i;
            if (i == 0) {
                memcpy(positions + 3 * (size_t)vertices, view->positions + 3 * (size_t)vertex,
                       3 * sizeof *positions);
                out->vertices[meshlet->vertex_offset + vertices] = view->vertex_ids[vertex];
                local[vertices++] = vertex, i = vertices;
            }
            triangles[3 * (size_t)t + k] = (uint8_t)(i - 1);
        }
        faces[t] = view->face_ids[faces[t]];
    }
    for (size_t i = 3 * (size_t)meshlet->triangle_count; i % 4 != 0; ++i) triangles[i] = 0;
    fct_meshlet_bound(positions, vertices, triangles, meshlet->triangle_count, &out->bounds[m]);
}

static void write_meshlets(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    for (size_t i = begin; i < end; ++i) write_meshlet(user, (uint32_t)i);
}

/* Numbers the pieces that are not empty, by their first face. `numbers` holds one per piece. */
static void number_pieces(const fct_packer *p, uint32_t *numbers, uint32_t *pieces) {
    uint32_t count = 0;
    memset(numbers, 0xFF, p->count * sizeof *numbers);
    for (uint32_t f = 0; f < p->view->face_count; ++f)
        if (numbers[p->owner[f]] == FCT_NONE) {
            pieces[count] = p->owner[f];
            numbers[p->owner[f]] = count++;
        }
}

static void place_meshlets(const fct_packer *p, const uint32_t *pieces, fct_meshlets *out) {
    uint32_t faces = 0;
    out->vertex_count = 0, out->triangle_bytes = 0;
    for (uint32_t m = 0; m < out->count; ++m) {
        uint32_t piece = pieces[m];
        out->meshlets[m] = (fct_meshlet){out->vertex_count, out->triangle_bytes, p->vertex_counts[piece],
                                         p->face_counts[piece]};
        out->first_face[m] = faces;
        faces += p->face_counts[piece];
        out->vertex_count += p->vertex_counts[piece];
        out->triangle_bytes += (3 * (uint32_t)p->face_counts[piece] + 3) & ~3u;
    }
    out->first_face[out->count] = faces;
}

static fct_result write_pieces(const fct_env *env, const fct_packer *p, uint32_t *numbers, uint32_t *pieces,
                               fct_meshlets *out) {
    for (uint32_t i = 0; i < p->count; ++i) out->count += p->face_counts[i] > 0;
    const fct_array arrays[] = {FCT_ARRAY(out->meshlets, out->count), FCT_ARRAY(out->bounds, out->count),
                                FCT_ARRAY(out->first_face, (size_t)out->count + 1),
                                FCT_ARRAY(out->faces, p->view->face_count)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "meshlets") != FCT_OK) return FCT_ERROR_MEMORY;
    number_pieces(p, numbers, pieces);
    place_meshlets(p, pieces, out);
    const fct_array lists[] = {FCT_ARRAY(out->vertices, out->vertex_count),
                               FCT_ARRAY(out->triangles, out->triangle_bytes)};
    if (fct_allocate_all(env, lists, FCT_LENGTH(lists), "meshlets") != FCT_OK) return FCT_ERROR_MEMORY;
    for (uint32_t f = 0; f < p->view->face_count; ++f)
        out->faces[out->first_face[numbers[p->owner[f]]]++] = f;
    for (uint32_t m = out->count; m > 0; --m) out->first_face[m] = out->first_face[m - 1];
    out->first_face[0] = 0;
    writer w = {p, pieces, out};
    return fct_parallel_for_progress(env, "bounds", out->count, GRAIN, write_meshlets, &w);
}

static fct_result check_def(const fct_env *env, const fct_meshlet_def *def) {
    if (def->size != sizeof *def)
        return fct_fail(env, FCT_ERROR_DATA, "fct_meshlet_def: expected size %zu, found %u", sizeof *def,
                        def->size);
    if (def->max_vertices < 3 || def->max_vertices > FCT_MESHLET_VERTICES || def->max_triangles < 1 ||
        def->max_triangles > FCT_MESHLET_TRIANGLES)
        return fct_fail(env, FCT_ERROR_DATA,
                        "meshlets: expected 3 to %d vertices and 1 to %d triangles, found %u and %u",
                        FCT_MESHLET_VERTICES, FCT_MESHLET_TRIANGLES, def->max_vertices, def->max_triangles);
    if (!(def->flatness >= 0 && def->flatness <= 1e6))
        return fct_fail(env, FCT_ERROR_DATA, "meshlets: expected a flatness of 0 to 1e6, found %g",
                        def->flatness);
    return FCT_OK;
}

fct_result fct_tree_meshlets(const fct_env *env, const fct_tree *tree, const fct_meshlet_def *def,
                             fct_meshlets *out) {
    fct_tree_view welded = {0};
    fct_packer p = {.tree = tree, .view = &welded, .def = def ? *def : fct_meshlet_def_default()};
    fct_weld weld = {0};
    *out = (fct_meshlets){0};
    fct_result result = check_def(env, &p.def);
    if (result == FCT_OK) result = fct_tree_check(env, tree);
    if (result == FCT_OK) result = fct_tree_view_weld(env, &tree->view, &welded, &weld);
    if (weld.joined)
        fct_note(
            env, FCT_MESSAGE_WARNING,
            "%u vertices have the position of another one; meshlets name one vertex per position, unless the "
            "tree is built without a weld",
            weld.joined);
    if (result == FCT_OK) result = make_pieces(env, tree, &p);
    uint32_t *numbers = result == FCT_OK ? fct_allocate(env, p.count, 2 * sizeof *numbers) : NULL;
    if (result == FCT_OK && !numbers) result = fct_fail_memory(env, "meshlets");
    if (result == FCT_OK) result = write_pieces(env, &p, numbers, numbers + p.count, out);
    fct_release(env, numbers);
    release_packer(env, &p);
    fct_weld_release(env, &weld);
    if (result != FCT_OK) fct_meshlets_release(env, out);
    return result;
}

void fct_meshlets_release(const fct_env *env, fct_meshlets *meshlets) {
    fct_release(env, meshlets->meshlets);
    fct_release(env, meshlets->bounds);
    fct_release(env, meshlets->first_face);
    fct_release(env, meshlets->vertices);
    fct_release(env, meshlets->triangles);
    fct_release(env, meshlets->faces);
    *meshlets = (fct_meshlets){0};
}
