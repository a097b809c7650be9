/* cluster/tree/check/edges.c: counts boundary edges, non-manifold edges and components as the dual graph
 * defines them (dual.h), but in less memory.
 *
 * A hash of a side's vertex pair chooses its lot, so all faces of a pair are in the same lot. The sides of
 * one lot after another are sorted by vertex pair. This works for 10^8 triangles, whose dual graph would not
 * fit. Memory: 4 bytes per face and 24 per side of a lot.
 */
#include "cluster/tree/check/edges.h"

#include "base/key.h"
#include "base/sort.h"
#include "base/union_find.h"
#include "cluster/tree/welded.h"

typedef struct side_list {
    const fct_tree_view *view;
    uint64_t *keys;
    uint32_t *faces;
    uint32_t *parents; /* disjoint sets of faces */
    uint32_t lots;
} side_list;

/* The vertex pair of a side. 0, which is no pair, if both ends are the same vertex. */
static uint64_t make_side_key(const uint32_t triangle[3], int k) {
    uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
    if (a == b) return 0;
    return fct_pair_key(a, b);
}

static uint32_t choose_lot(uint64_t key, uint32_t lots) {
    return (uint32_t)((key * 0x9E3779B97F4A7C15u >> 32) * lots >> 32);
}

/* Lists the sides of a lot, or only counts them while there is no list. */
static size_t list_sides(const side_list *list, uint32_t lot) {
    size_t count = 0;
    for (uint32_t f = 0; f < list->view->face_count; ++f)
        for (int k = 0; k < 3; ++k) {
            uint64_t key = make_side_key(list->view->triangles + 3 * (size_t)f, k);
            if (!key || (list->lots > 1 && choose_lot(key, list->lots) != lot)) continue;
            if (list->keys) list->keys[count] = key, list->faces[count] = f;
            ++count;
        }
    return count;
}

/* Counts the faces of each vertex pair; a face that has the pair twice counts once. */
static void count_runs(side_list *list, size_t count, fct_edge_counts *out) {
    for (size_t i = 0, end; i < count; i = end) {
        uint32_t faces = 1;
        for (end = i + 1; end < count && list->keys[end] == list->keys[i]; ++end) {
            if (list->faces[end] == list->faces[end - 1]) continue;
            ++faces;
            out->components -= fct_sets_join(list->parents, list->faces[end - 1], list->faces[end]);
        }
        out->boundary += faces == 1, out->nonmanifold += faces >= 3;
    }
}

static fct_result count_lots(const fct_env *env, side_list *list, size_t most, fct_edge_counts *out) {
    const fct_array arrays[] = {FCT_ARRAY(list->keys, most), FCT_ARRAY(list->faces, most),
                                FCT_ARRAY(list->parents, list->view->face_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "counting edges");
    if (result == FCT_OK) fct_sets_create(list->parents, list->view->face_count);
    for (uint32_t lot = 0; result == FCT_OK && lot < list->lots; ++lot) {
        size_t count = list_sides(list, lot);
        result = fct_progress(env, "edges", (double)lot / list->lots);
        if (result == FCT_OK) result = fct_sort_pairs(env, list->keys, list->faces, count);
        if (result == FCT_OK) count_runs(list, count, out);
    }
    return result;
}

fct_result fct_tree_count_edges(const fct_env *env, const fct_tree_view *view, uint32_t portion,
                                fct_edge_counts *out) {
    uint64_t sides = 3 * (uint64_t)view->face_count;
    fct_tree_view welded;
    fct_weld weld;
    fct_result result = fct_tree_view_weld(env, view, &welded, &weld);
    if (result != FCT_OK) return result;
    side_list list = {.view = &welded, .lots = (uint32_t)(sides / portion + 1)};
    size_t most = 0;
    for (uint32_t lot = 0; lot < list.lots; ++lot) {
        size_t count = list_sides(&list, lot);
        if (count > most) most = count;
    }
    *out = (fct_edge_counts){.components = view->face_count};
    result = count_lots(env, &list, most, out);
    fct_weld_release(env, &weld);
    fct_release(env, list.keys);
    fct_release(env, list.faces);
    fct_release(env, list.parents);
    return result;
}
