/* cluster/quality.c: how good a partition is, measured from the triangles alone.
 *
 * Everything is summed in double per cluster over its contiguous faces; borders and connectedness come from
 * the dual graph of the mesh in the tree's order. Area weights; a cluster without area weighs nothing.
 * O(F log F), parallel over clusters.
 */
#include <string.h>

#include "base/eigen.h"
#include "base/parallel.h"
#include "cluster/tree.h"
#include "facetree/dual.h"

typedef struct piece {
    double area, fit, direction, deviation, box_area; /* fit, direction, deviation times area */
    double perimeter;
} piece;

typedef struct judge {
    const fct_tree *tree;
    const uint32_t *nodes;
    piece *pieces;
    uint32_t *labels;  /* by place */
    uint32_t *parents; /* union-find over places */
} judge;

static uint32_t first_of(const fct_tree_view *view, uint32_t node) {
    return node < view->node_count ? view->clusters[node].first : node - view->node_count;
}

static uint32_t count_of(const fct_tree_view *view, uint32_t node) {
    return node < view->node_count ? view->clusters[node].count : 1;
}

static void load_triangle(const fct_tree_view *view, size_t place, v3 origin, v3 p[3], v3 *vector) {
    for (size_t k = 0; k < 3; ++k)
        p[k] = v3_sub(v3_load(view->positions + 3 * (size_t)view->triangles[3 * place + k]), origin);
    *vector = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
}

/* Sums over the surface of places [first, end); covariance about the centroid. */
static void sum_surface(const fct_tree_view *view, size_t first, size_t end, piece *out, v3 *s,
                        double covariance[6], double moment[6]) {
    v3 origin = v3_load(view->positions + 3 * (size_t)view->triangles[3 * first]), center = {0, 0, 0}, p[3],
       a;
    for (size_t place = first; place < end; ++place) {
        load_triangle(view, place, origin, p, &a);
        double area = v3_norm(a);
        if (!(area > 0)) continue;
        out->area += area;
        *s = v3_add(*s, a);
        center = v3_mad(center, area / 3, v3_add(v3_add(p[0], p[1]), p[2]));
        sym3_add_outer(moment, 1 / area, a);
    }
    if (!(out->area > 0)) return;
    origin = v3_mad(origin, 1 / out->area, center);
    for (size_t place = first; place < end; ++place) {
        load_triangle(view, place, origin, p, &a);
        double area = v3_norm(a);
        for (int k = 0; k < 3; ++k) sym3_add_outer(covariance, area / 12, p[k]);
        sym3_add_outer(covariance, area / 12, v3_add(v3_add(p[0], p[1]), p[2]));
    }
}

static void judge_piece(const judge *j, uint32_t i) {
    const fct_tree_view *view = &j->tree->view;
    uint32_t node = j->nodes[i], first = first_of(view, node), count = count_of(view, node);
    piece *out = &j->pieces[i];
    *out = (piece){0};
    double covariance[6] = {0}, moment[6] = {0}, values[3];
    v3 s = {0, 0, 0}, axes[3];
    sum_surface(view, first, (size_t)first + count, out, &s, covariance, moment);
    fct_eigen3(covariance, values, axes);
    v3 n = v3_dot(axes[0], s) < 0 ? v3_scale(axes[0], -1) : axes[0];
    out->fit = fmax(values[0], 0);
    out->direction = fmax(sym3_form(moment, n, n) - 2 * v3_dot(n, s) + out->area, 0);
    out->deviation = 2 * fmax(out->area - v3_norm(s), 0);
    fct_cluster cluster;
    fct_tree_cluster(j->tree, node, &cluster);
    const float *h = cluster.box_half;
    out->box_area =
        8 * ((double)h[0] * (double)h[1] + (double)h[1] * (double)h[2] + (double)h[2] * (double)h[0]);
    for (uint32_t place = first; place < first + count; ++place) j->labels[place] = i;
}

static void judge_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    for (size_t i = begin; i < end; ++i) judge_piece(user, (uint32_t)i);
}

static uint32_t find(uint32_t *parents, uint32_t i) {
    while (parents[i] != i) {
        parents[i] = parents[parents[i]];
        i = parents[i];
    }
    return i;
}

/* Borders of the clusters, and whether the faces of each hang together. */
static void walk_dual(const judge *j, const fct_dual *dual, bool *connected, uint32_t count) {
    uint32_t joined = 0;
    for (uint32_t f = 0; f < dual->face_count; ++f) {
        j->pieces[j->labels[f]].perimeter += (double)dual->perimeters[f];
        j->parents[f] = f;
    }
    for (uint32_t e = 0; e < dual->edge_count; ++e) {
        uint32_t a = dual->edges[2 * (size_t)e], b = dual->edges[2 * (size_t)e + 1];
        if (j->labels[a] != j->labels[b]) continue;
        j->pieces[j->labels[a]].perimeter -= 2 * (double)dual->lengths[e];
        a = find(j->parents, a), b = find(j->parents, b);
        if (a == b) continue;
        ++joined;
        if (a < b)
            j->parents[b] = a;
        else
            j->parents[a] = b;
    }
    *connected = joined == dual->face_count - count;
}

static double squared_diagonal(const fct_tree_view *view) {
    v3 lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) {
        v3 p = v3_load(view->positions + 3 * (size_t)view->triangles[i]);
        lower = (v3){fmin(lower.x, p.x), fmin(lower.y, p.y), fmin(lower.z, p.z)};
        upper = (v3){fmax(upper.x, p.x), fmax(upper.y, p.y), fmax(upper.z, p.z)};
    }
    double squared = v3_norm2(v3_sub(upper, lower));
    return squared > 0 ? squared : 1;
}

static fct_partition_quality mean_of(const judge *j, uint32_t count, bool connected) {
    double area = 0, unit = squared_diagonal(&j->tree->view);
    fct_partition_quality q = {.connected = connected};
    for (uint32_t i = 0; i < count; ++i) {
        const piece *p = &j->pieces[i];
        area += p->area;
        q.mean_fit += p->fit / unit;
        q.mean_direction += p->direction;
        q.mean_normal_deviation += p->deviation;
        q.mean_irregularity += fmax(p->perimeter, 0) * fmax(p->perimeter, 0) / (4 * 3.14159265358979323846);
        q.box_area += p->box_area / unit;
    }
    if (!(area > 0)) return (fct_partition_quality){.box_area = q.box_area, .connected = connected};
    q.mean_fit /= area;
    q.mean_direction /= area;
    q.mean_irregularity /= area; /* area times perimeter^2 / (4 pi area) */
    q.mean_normal_deviation /= area;
    return q;
}

fct_result fct_tree_quality(const fct_env *env, const fct_tree *tree, const uint32_t *nodes, uint32_t count,
                            fct_partition_quality *out) {
    const fct_tree_view *view = &tree->view;
    fct_mesh mesh = {.vertex_count = view->vertex_count,
                     .face_count = view->face_count,
                     .positions = (float *)view->positions,
                     .triangles = (uint32_t *)view->triangles};
    judge j = {.tree = tree, .nodes = nodes};
    fct_dual dual = {0};
    j.pieces = fct_allocate(env, count, sizeof *j.pieces);
    j.labels = fct_allocate(env, view->face_count, sizeof *j.labels);
    j.parents = fct_allocate(env, view->face_count, sizeof *j.parents);
    fct_result result;
    if (!j.pieces || !j.labels || !j.parents)
        result = fct_fail_memory(env, "measuring a partition");
    else
        result = fct_dual_build(env, &mesh, &dual);
    if (result == FCT_OK) {
        fct_parallel_for(env, count, 64, judge_chunk, &j);
        bool connected;
        walk_dual(&j, &dual, &connected, count);
        *out = mean_of(&j, count, connected);
    }
    fct_dual_release(env, &dual);
    fct_release(env, j.pieces);
    fct_release(env, j.labels);
    fct_release(env, j.parents);
    return result;
}
