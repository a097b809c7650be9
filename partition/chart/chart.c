/* partition/chart/chart.c: charts from the roots of the tree down.
 *
 * To test whether the faces [first, end) are a disk, each corner knows the previous face at its vertex and
 * each side the previous side on its mesh edge. A vertex or edge is new to the range if that face lies before
 * `first`. The faces are a disk if they are connected, have at most two faces per edge, V - E + F = 1 and a
 * border. A vertex where fans or borders only touch lowers the characteristic below 1. O(faces) per tested
 * node; nodes with too wide a cone are opened without a test.
 */
#include <float.h>

#include "base/parallel.h"
#include "base/union_find.h"
#include "cluster/tree/welded.h"
#include "partition/chart/audit.h"
#include "partition/chart/charter.h"
#include "partition/chart/merge.h"
#include "partition/cut.h"

enum { GRAIN = 1 << 15 };

typedef struct counts {
    uint64_t angle, limit, topology;
    uint64_t pad[5]; /* a cache line per thread */
} counts;

typedef struct opener {
    const fct_charter *charter;
    uint32_t *vertex_before; /* per corner: the previous face at its vertex, or FCT_NONE */
    uint32_t *parents;       /* disjoint sets of places */
    counts *opened;          /* per thread */
} opener;

fct_chart_def fct_chart_def_default(void) {
    return (fct_chart_def){.size = sizeof(fct_chart_def),
                           .max_angle = FCT_HALF_TURN / 4,
                           .max_faces = FCT_NONE,
                           .max_area = INFINITY};
}

/* The area of a cluster. If the stored float is 0 or infinite, its faces give the area. */
static double find_area(const fct_tree_view *view, const fct_cluster *c) {
    double area = 0;
    if (c->area >= FLT_MIN && c->area < FLT_MAX) return (double)c->area;
    for (size_t p = c->first; p < (size_t)c->first + c->count; ++p) area += v3_norm(fct_face_vector(view, p));
    return area;
}

/* Compares the stored cone, which is rounded up; compares the faces where that does not decide. */
static bool is_within_angle(const fct_tree_view *view, const fct_cluster *c, double limit) {
    const double rounding = 4e-6;
    double cone = (double)c->cone_angle;
    if (cone <= limit || limit >= FCT_HALF_TURN) return true;
    if (cone > limit + rounding && c->area > 0) return false;
    v3 s = {0, 0, 0};
    for (size_t p = c->first; p < (size_t)c->first + c->count; ++p) s = v3_add(s, fct_face_vector(view, p));
    for (size_t p = c->first; p < (size_t)c->first + c->count; ++p)
        if (fct_angle(fct_face_vector(view, p), s) > limit) return false;
    return v3_norm2(s) > 0 || find_area(view, c) == 0;
}

static bool has_one_material(const fct_tree_view *view, const fct_cluster *c) {
    if (!view->materials) return true;
    for (size_t p = c->first; p < (size_t)c->first + c->count; ++p)
        if (view->materials[p] != view->materials[c->first]) return false;
    return true;
}

static bool is_disk(const opener *o, const fct_cluster *c) {
    const fct_tree_view *view = o->charter->view;
    const uint32_t *before = o->charter->sides.before;
    uint32_t first = c->first, end = first + c->count, parts = c->count;
    uint64_t vertices = 0, edges = 0;
    for (uint32_t f = first; f < end; ++f) {
        if (fct_face_repeats(view, f)) return false;
        o->parents[f] = f;
        for (size_t side = 3 * (size_t)f; side < 3 * (size_t)f + 3; ++side) {
            vertices += o->vertex_before[side] == FCT_NONE || o->vertex_before[side] < first;
            uint32_t other = before[side];
            if (other == FCT_NONE || other / 3 < first) {
                ++edges;
                continue;
            }
            if (before[other] != FCT_NONE && before[other] / 3 >= first) return false;
            parts -= fct_sets_join(o->parents, f, other / 3);
        }
    }
    bool bordered = 2 * edges > 3 * (uint64_t)c->count;
    return parts == 1 && bordered && vertices + c->count == edges + 1;
}

static bool is_chart(void *user, uint32_t node, uint32_t thread) {
    const opener *o = user;
    const fct_charter *charter = o->charter;
    fct_cluster room;
    const fct_cluster *c = fct_node_cluster(charter->tree, node, &room);
    if (!is_within_angle(charter->view, c, charter->def.max_angle)) {
        ++o->opened[thread].angle;
        return false;
    }
    if (c->count > charter->def.max_faces ||
        (charter->def.max_area < INFINITY && find_area(charter->view, c) > charter->def.max_area) ||
        !has_one_material(charter->view, c)) {
        ++o->opened[thread].limit;
        return false;
    }
    if (charter->def.any_topology || is_disk(o, c)) return true;
    ++o->opened[thread].topology;
    return false;
}

static void link_corners(const fct_tree_view *view, uint32_t *last, uint32_t *vertex_before) {
    for (uint32_t v = 0; v < view->vertex_count; ++v) last[v] = FCT_NONE;
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) {
        vertex_before[i] = last[view->triangles[i]];
        last[view->triangles[i]] = (uint32_t)(i / 3);
    }
}

/* Cuts the tree and sets the labels. */
static fct_result open_nodes(const fct_env *env, const fct_tree *tree, fct_charter *c,
                             fct_chart_stats *stats) {
    const fct_tree_view *view = c->view;
    uint32_t threads = fct_env_threads(env);
    opener o = {.charter = c};
    uint32_t *nodes;
    const fct_array arrays[] = {
        FCT_ARRAY(o.vertex_before, 3 * (size_t)view->face_count),
        FCT_ARRAY(o.parents, view->face_count > view->vertex_count ? view->face_count : view->vertex_count),
        FCT_ARRAY_ZERO(o.opened, threads), FCT_ARRAY(nodes, view->face_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "charts");
    if (result == FCT_OK) {
        link_corners(view, o.parents, o.vertex_before);
        result = fct_cut_tree(env, tree, "charts", is_chart, &o, nodes, &c->count);
    }
    if (result == FCT_OK) {
        for (uint32_t i = 0; i < c->count; ++i) {
            uint32_t first = fct_node_first(tree, nodes[i]), faces = fct_node_faces(tree, nodes[i]);
            for (uint32_t p = first; p < first + faces; ++p) c->labels[p] = i;
        }
        for (uint32_t t = 0; t < threads; ++t) {
            stats->opened_angle += (uint32_t)o.opened[t].angle;
            stats->opened_limit += (uint32_t)o.opened[t].limit;
            stats->opened_topology += (uint32_t)o.opened[t].topology;
        }
    }
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

static fct_result check_def(const fct_env *env, const fct_chart_def *def) {
    if (def->size != sizeof *def)
        return fct_fail(env, FCT_ERROR_DATA, "fct_chart_def: expected size %zu, found %u", sizeof *def,
                        def->size);
    if (!(def->max_angle >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "charts: expected an angle of at least 0, found %g",
                        def->max_angle);
    if (def->max_faces < 1)
        return fct_fail(env, FCT_ERROR_DATA, "charts: expected at least 1 face per chart");
    if (!(def->max_area >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "charts: expected an area of at least 0, found %g",
                        def->max_area);
    return FCT_OK;
}

fct_result fct_tree_charts(const fct_env *env, const fct_tree *tree, const fct_chart_def *def,
                           uint32_t *labels, fct_chart_stats *stats) {
    fct_tree_view welded;
    const fct_tree_view *view = &welded;
    fct_charter c = {.tree = tree, .view = view, .def = def ? *def : fct_chart_def_default()};
    fct_chart_stats found = {0};
    fct_weld weld = {0};
    fct_result result = check_def(env, &c.def);
    if (result == FCT_OK) result = fct_tree_check(env, tree);
    if (result == FCT_OK) result = fct_tree_view_weld(env, &tree->view, &welded, &weld);
    if (result != FCT_OK) return result;
    c.labels = fct_allocate(env, view->face_count, sizeof *c.labels);
    if (!c.labels) result = fct_fail_memory(env, "charts");
    if (result == FCT_OK)
        result = fct_sides_build(env, view->triangles, view->face_count, view->vertex_count, &c.sides);
    if (result == FCT_OK) result = open_nodes(env, tree, &c, &found);
    uint32_t cut = c.count;
    if (result == FCT_OK && !c.def.keep_cuts) result = fct_charts_merge(env, &c);
    found.merged = cut - c.count;
    if (result == FCT_OK && stats) result = fct_charts_audit(env, &c, &found);
    if (result == FCT_OK) {
        for (uint32_t p = 0; p < view->face_count; ++p) labels[view->face_ids[p]] = c.labels[p];
        if (stats) *stats = found;
    }
    fct_sides_release(env, &c.sides);
    fct_weld_release(env, &weld);
    fct_release(env, c.labels);
    return result;
}
