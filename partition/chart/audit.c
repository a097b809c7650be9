/* partition/chart/audit.c: measures of finished charts, from labels and triangles alone.
 *
 * Sorts the faces by chart, names each mesh edge by its first side, then walks every chart and stamps the
 * vertices and edges that it uses. Shares no count with the code that makes charts. O(F).
 */
#include "partition/chart/audit.h"

#include "base/parallel.h"
#include "base/union_find.h"

enum { SEEN_ONCE = 1, SEEN_TWICE = 2, SEEN_MORE = 3 };

typedef struct auditor {
    const fct_charter *charter;
    uint32_t *places;                    /* faces in order of charts */
    uint32_t *first;                     /* count + 1: first index in `places` per chart */
    uint32_t *edges;                     /* per side: the first side on its mesh edge */
    uint32_t *parents;                   /* disjoint sets of places */
    uint32_t *vertex_chart, *edge_chart; /* the last chart that used it */
    uint32_t *edge_face;                 /* per first side: the last face that used it */
    uint8_t *edge_uses;                  /* per first side: faces of that chart */
} auditor;

static void sort_by_chart(auditor *a) {
    const fct_charter *c = a->charter;
    uint32_t total = 0;
    for (uint32_t i = 0; i <= c->count; ++i) a->first[i] = 0;
    for (uint32_t p = 0; p < c->view->face_count; ++p) ++a->first[c->labels[p]];
    for (uint32_t i = 0; i <= c->count; ++i) {
        uint32_t faces = a->first[i];
        a->first[i] = total;
        total += faces;
    }
    for (uint32_t p = 0; p < c->view->face_count; ++p) a->places[a->first[c->labels[p]]++] = p;
    for (uint32_t i = c->count; i > 0; --i) a->first[i] = a->first[i - 1];
    a->first[0] = 0;
}

static void name_edges(auditor *a, fct_chart_stats *stats) {
    const fct_charter *c = a->charter;
    size_t sides = 3 * (size_t)c->view->face_count;
    for (size_t i = 0; i < sides; ++i) {
        uint32_t before = c->sides.before[i];
        a->edges[i] = before == FCT_NONE ? (uint32_t)i : a->edges[before];
        a->edge_uses[i] = 0, a->edge_chart[i] = FCT_NONE;
        if (before != FCT_NONE && c->labels[before / 3] != c->labels[i / 3]) a->edge_uses[a->edges[i]] = 1;
    }
    for (size_t i = 0; i < sides; ++i) {
        if (a->edges[i] != i) continue;
        if (a->edge_uses[i])
            stats->seam_length += fct_side_length(c->view, i);
        else if (c->sides.after[i] == FCT_NONE)
            stats->boundary_length += fct_side_length(c->view, i);
        a->edge_uses[i] = 0;
    }
}

static bool is_chart_disk(auditor *a, uint32_t chart) {
    const fct_tree_view *view = a->charter->view;
    uint64_t vertices = 0, edges = 0, faces = a->first[chart + 1] - a->first[chart], joins = 0;
    bool clean = true;
    for (uint32_t i = a->first[chart]; i < a->first[chart + 1]; ++i) a->parents[a->places[i]] = a->places[i];
    for (uint32_t i = a->first[chart]; i < a->first[chart + 1]; ++i) {
        uint32_t place = a->places[i];
        clean = clean && !fct_face_repeats(view, place);
        for (size_t side = 3 * (size_t)place; side < 3 * (size_t)place + 3; ++side) {
            uint32_t vertex = view->triangles[side], edge = a->edges[side];
            vertices += a->vertex_chart[vertex] != chart;
            a->vertex_chart[vertex] = chart;
            if (a->edge_chart[edge] != chart) {
                a->edge_chart[edge] = chart, a->edge_uses[edge] = SEEN_ONCE;
                ++edges;
            } else {
                if (a->edge_uses[edge] < SEEN_MORE) ++a->edge_uses[edge];
                clean = clean && a->edge_uses[edge] <= SEEN_TWICE;
                joins += fct_sets_join(a->parents, place, a->edge_face[edge]);
            }
            a->edge_face[edge] = place;
        }
    }
    return clean && joins + 1 == faces && 2 * edges > 3 * faces && vertices + faces == edges + 1;
}

static double find_chart_angle(const auditor *a, uint32_t chart) {
    const fct_tree_view *view = a->charter->view;
    v3 s = {0, 0, 0};
    double largest = 0;
    for (uint32_t i = a->first[chart]; i < a->first[chart + 1]; ++i)
        s = v3_add(s, fct_face_vector(view, a->places[i]));
    for (uint32_t i = a->first[chart]; i < a->first[chart + 1]; ++i)
        largest = fmax(largest, fct_angle(fct_face_vector(view, a->places[i]), s));
    return largest;
}

static void audit_charts(auditor *a, fct_chart_stats *stats) {
    sort_by_chart(a);
    name_edges(a, stats);
    for (uint32_t v = 0; v < a->charter->view->vertex_count; ++v) a->vertex_chart[v] = FCT_NONE;
    stats->charts = a->charter->count;
    for (uint32_t i = 0; i < a->charter->count; ++i) {
        uint32_t faces = a->first[i + 1] - a->first[i];
        if (faces > stats->largest_faces) stats->largest_faces = faces;
        stats->non_disks += !is_chart_disk(a, i);
        stats->largest_angle = fmax(stats->largest_angle, find_chart_angle(a, i));
    }
}

fct_result fct_charts_audit(const fct_env *env, const fct_charter *c, fct_chart_stats *stats) {
    size_t faces = c->view->face_count;
    auditor a = {.charter = c};
    const fct_array arrays[] = {FCT_ARRAY(a.places, faces),
                                FCT_ARRAY(a.first, (size_t)c->count + 1),
                                FCT_ARRAY(a.edges, 3 * (size_t)faces),
                                FCT_ARRAY(a.parents, faces),
                                FCT_ARRAY(a.vertex_chart, c->view->vertex_count),
                                FCT_ARRAY(a.edge_chart, 3 * (size_t)faces),
                                FCT_ARRAY(a.edge_face, 3 * (size_t)faces),
                                FCT_ARRAY(a.edge_uses, 3 * (size_t)faces)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "charts");
    if (result == FCT_OK) audit_charts(&a, stats);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
