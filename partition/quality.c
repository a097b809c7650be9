/* partition/quality.c: measures of a partition, from the triangles alone.
 *
 * A piece is a range of a list of faces: for nodes of a tree the places themselves, for labels a counting
 * sort of the faces. Sums are in double. The least-squares plane (8.1) has the eigenvector of the covariance
 * (8.5), here the surface integral; E_dir (8.12) follows from the sums of (8.14) and (8.15); borders and
 * connectedness come from the dual graph. Means weigh pieces by area. Boxes are those of the tree, or for
 * labels along the principal axes of the surface, turned about the normal to the best of TURNS angles. O(F
 * log F), parallel over pieces.
 */
#include <float.h>
#include <string.h>

#include "base/math/eigen.h"
#include "base/math/elementary.h"
#include "base/parallel.h"
#include "base/union_find.h"
#include "cluster/tree/node.h"
#include "cluster/tree/welded.h"
#include "facetree/partition.h"
#include "partition/labels.h"
#include "partition/units.h"

enum { TURNS = 8 };
static const double pi = 3.14159265358979323846;

typedef struct piece {
    uint32_t first, count;                            /* range of the list */
    double area, fit, direction, deviation, box_area; /* fit, direction and deviation are times area */
    double perimeter;
} piece;

typedef struct judge {
    const fct_mesh *mesh;
    const fct_tree *tree;   /* NULL: boxes are fitted */
    const uint32_t *nodes;  /* of the tree */
    const uint32_t *labels; /* per face of the mesh */
    uint32_t *faces;        /* the list; NULL: face i is entry i */
    uint32_t *parents;      /* disjoint sets of faces */
    piece *pieces;
    uint32_t count;
    float *planes; /* count x 4, or NULL */
} judge;

static void load_triangle(const judge *j, size_t place, v3 origin, v3 p[3]) {
    size_t face = j->faces ? j->faces[place] : place;
    for (size_t k = 0; k < 3; ++k)
        p[k] = v3_sub(v3_load(j->mesh->positions + 3 * (size_t)j->mesh->triangles[3 * face + k]), origin);
}

static v3 find_area_vector(const v3 p[3]) {
    return v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), 0.5);
}

/* Sums over the surface of a piece: area, S, moment M (D of (8.14), by area) and the covariance about the
 * centroid. Returns the centroid, or the first corner of a piece without area. The covariance of a triangle
 * is area / 12 times the sum of p p^T over its corners and their sum. */
static v3 sum_surface(const judge *j, piece *out, v3 *s, double covariance[6], double moment[6]) {
    const size_t first = out->first, end = first + out->count;
    v3 origin = {0, 0, 0}, center = {0, 0, 0}, p[3];
    load_triangle(j, first, origin, p);
    origin = p[0];
    for (size_t place = first; place < end; ++place) {
        load_triangle(j, place, origin, p);
        v3 a = find_area_vector(p);
        double area = v3_norm(a);
        if (!(area > 0)) continue;
        out->area += area;
        *s = v3_add(*s, a);
        center = v3_mad(center, area / 3, v3_add(v3_add(p[0], p[1]), p[2]));
        sym3_add_outer(moment, 1 / area, a);
    }
    if (!(out->area > 0)) return origin;
    origin = v3_mad(origin, 1 / out->area, center);
    for (size_t place = first; place < end; ++place) {
        load_triangle(j, place, origin, p);
        double area = v3_norm(find_area_vector(p));
        for (int k = 0; k < 3; ++k) sym3_add_outer(covariance, area / 12, p[k]);
        sym3_add_outer(covariance, area / 12, v3_add(v3_add(p[0], p[1]), p[2]));
    }
    return origin;
}

/* Least-squares planes of pieces, n.S >= 0. */
static void judge_planes(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const judge *j = user;
    for (size_t i = begin; i < end; ++i) {
        float *plane = j->planes + 4 * i;
        piece sums = j->pieces[i];
        memset(plane, 0, 4 * sizeof *plane);
        if (sums.count == 0) continue;
        double covariance[6] = {0}, moment[6] = {0}, values[3];
        v3 s = {0, 0, 0}, axes[3], center = sum_surface(j, &sums, &s, covariance, moment);
        fct_eigen3(covariance, values, axes);
        v3 n = v3_dot(axes[0], s) < 0 ? v3_scale(axes[0], -1) : axes[0];
        v3_store(plane, n);
        plane[3] = (float)fmax(fmin(-v3_dot(n, center), (double)FLT_MAX), -(double)FLT_MAX);
    }
}

/* The least surface area of a box around the piece with one axis along axes[0]. */
static double fit_box(const judge *j, const piece *range, const v3 axes[3]) {
    double low[2 * TURNS + 1], high[2 * TURNS + 1], best = INFINITY;
    v3 along[2 * TURNS + 1], p[3];
    for (int t = 0; t < TURNS; ++t) {
        double c = fct_cos(pi * t / (2 * TURNS)), s = fct_sin(pi * t / (2 * TURNS));
        along[2 * t] = v3_mad(v3_scale(axes[2], c), s, axes[1]);
        along[2 * t + 1] = v3_mad(v3_scale(axes[1], c), -s, axes[2]);
    }
    along[2 * TURNS] = axes[0];
    for (int i = 0; i <= 2 * TURNS; ++i) low[i] = INFINITY, high[i] = -INFINITY;
    for (size_t place = range->first; place < (size_t)range->first + range->count; ++place) {
        load_triangle(j, place, (v3){0, 0, 0}, p);
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i <= 2 * TURNS; ++i) {
                double x = v3_dot(p[k], along[i]);
                low[i] = x < low[i] ? x : low[i], high[i] = x > high[i] ? x : high[i];
            }
    }
    double height = high[2 * TURNS] - low[2 * TURNS];
    for (int t = 0; t < TURNS; ++t) {
        double x = high[2 * t] - low[2 * t], y = high[2 * t + 1] - low[2 * t + 1];
        best = fmin(best, 2 * (x * y + height * (x + y)));
    }
    return best;
}

static void judge_piece(const judge *j, uint32_t i) {
    piece *out = &j->pieces[i];
    if (out->count == 0) return;
    double covariance[6] = {0}, moment[6] = {0}, values[3];
    v3 s = {0, 0, 0}, axes[3];
    sum_surface(j, out, &s, covariance, moment);
    fct_eigen3(covariance, values, axes);
    v3 n = v3_dot(axes[0], s) < 0 ? v3_scale(axes[0], -1) : axes[0];
    out->fit = fmax(values[0], 0);
    out->direction = fmax(sym3_form(moment, n, n) - 2 * v3_dot(n, s) + out->area, 0);
    out->deviation = 2 * fmax(out->area - v3_norm(s), 0);
    if (!j->tree) {
        out->box_area = fit_box(j, out, axes);
        return;
    }
    fct_cluster room;
    const float *h = fct_node_cluster(j->tree, j->nodes[i], &room)->box_half;
    out->box_area =
        8 * ((double)h[0] * (double)h[1] + (double)h[1] * (double)h[2] + (double)h[2] * (double)h[0]);
}

static void judge_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    for (size_t i = begin; i < end; ++i) judge_piece(user, (uint32_t)i);
}

/* Sums the perimeters of the pieces. unit: of the lengths. Returns whether edges connect the faces of each
 * piece. */
static bool walk_dual(const judge *j, const fct_dual *dual, double unit) {
    uint32_t joined = 0, filled = 0;
    for (uint32_t i = 0; i < j->count; ++i) filled += j->pieces[i].count > 0;
    for (uint32_t f = 0; f < dual->face_count; ++f) {
        j->pieces[j->labels[f]].perimeter += unit * (double)dual->perimeters[f];
        j->parents[f] = f;
    }
    for (uint32_t e = 0; e < dual->edge_count; ++e) {
        uint32_t a = dual->edges[2 * (size_t)e], b = dual->edges[2 * (size_t)e + 1];
        if (j->labels[a] != j->labels[b]) continue;
        j->pieces[j->labels[a]].perimeter -= 2 * unit * (double)dual->lengths[e];
        joined += fct_sets_join(j->parents, a, b);
    }
    return joined == dual->face_count - filled;
}

static double squared_diagonal(const fct_mesh *mesh) {
    v3 lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * (size_t)mesh->face_count; ++i) {
        v3 p = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[i]);
        lower = (v3){fmin(lower.x, p.x), fmin(lower.y, p.y), fmin(lower.z, p.z)};
        upper = (v3){fmax(upper.x, p.x), fmax(upper.y, p.y), fmax(upper.z, p.z)};
    }
    double squared = v3_norm2(v3_sub(upper, lower));
    return squared > 0 ? squared : 1;
}

static fct_partition_quality average_pieces(const judge *j, bool connected) {
    double area = 0, unit = squared_diagonal(j->mesh);
    fct_partition_quality q = {.connected = connected};
    for (uint32_t i = 0; i < j->count; ++i) {
        const piece *p = &j->pieces[i];
        area += p->area;
        q.mean_fit += p->fit / unit;
        q.mean_direction += p->direction;
        q.mean_normal_deviation += p->deviation;
        q.mean_irregularity += fmax(p->perimeter, 0) * fmax(p->perimeter, 0) / (4 * pi);
        q.box_area += p->box_area / unit;
    }
    if (!(area > 0)) return (fct_partition_quality){.box_area = q.box_area, .connected = connected};
    q.mean_fit /= area;
    q.mean_direction /= area;
    q.mean_irregularity /= area; /* (8.16) times area is perimeter^2 / (4 pi) */
    q.mean_normal_deviation /= area;
    return q;
}

/* Measures the pieces of a judge. All of its members except `parents` must be set. */
static fct_result measure_pieces(const fct_env *env, judge *j, fct_partition_quality *out) {
    fct_dual dual = {0};
    double unit;
    j->parents = fct_allocate(env, j->mesh->face_count, sizeof *j->parents);
    fct_result result;
    if (!j->parents)
        result = fct_fail_memory(env, "measuring a partition");
    else
        result = fct_units_dual(env, j->mesh, &dual, &unit);
    if (result == FCT_OK) {
        fct_parallel_for(env, j->count, 64, judge_chunk, j);
        *out = average_pieces(j, walk_dual(j, &dual, unit));
    }
    fct_dual_release(env, &dual);
    fct_release(env, j->parents);
    return result;
}

fct_result fct_tree_quality(const fct_env *env, const fct_tree *tree, const uint32_t *nodes, uint32_t count,
                            fct_partition_quality *out) {
    fct_tree_view welded, *view = &welded;
    fct_weld weld;
    fct_result result = fct_tree_check(env, tree);
    if (result == FCT_OK) result = fct_tree_view_weld(env, &tree->view, view, &weld);
    if (result != FCT_OK) return result;
    fct_mesh mesh = {.vertex_count = view->vertex_count,
                     .face_count = view->face_count,
                     .positions = (float *)view->positions,
                     .triangles = (uint32_t *)view->triangles};
    judge j = {.mesh = &mesh, .tree = tree, .nodes = nodes, .count = count};
    uint32_t *labels;
    const fct_array arrays[] = {FCT_ARRAY(labels, view->face_count), FCT_ARRAY_ZERO(j.pieces, count)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "measuring a partition");
    if (result == FCT_OK) {
        for (uint32_t i = 0; i < count; ++i) {
            piece *p = &j.pieces[i];
            p->first = fct_node_first(tree, nodes[i]);
            p->count = fct_node_faces(tree, nodes[i]);
            for (uint32_t place = p->first; place < p->first + p->count; ++place) labels[place] = i;
        }
        j.labels = labels;
        result = measure_pieces(env, &j, out);
    }
    fct_weld_release(env, &weld);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}

/* Groups the faces of a judge that has mesh, labels and count. Errors: MEMORY. */
static fct_result group_faces(const fct_env *env, judge *j) {
    const fct_array arrays[] = {FCT_ARRAY(j->faces, j->mesh->face_count),
                                FCT_ARRAY_ZERO(j->pieces, j->count)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "measuring a partition") != FCT_OK)
        return FCT_ERROR_MEMORY;
    uint32_t end = 0;
    for (uint32_t f = 0; f < j->mesh->face_count; ++f) ++j->pieces[j->labels[f]].count;
    for (uint32_t i = 0; i < j->count; ++i) {
        j->pieces[i].first = end;
        end += j->pieces[i].count;
        j->pieces[i].count = 0;
    }
    for (uint32_t f = 0; f < j->mesh->face_count; ++f) {
        piece *p = &j->pieces[j->labels[f]];
        j->faces[p->first + p->count++] = f;
    }
    return FCT_OK;
}

fct_result fct_labels_quality(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels,
                              uint32_t count, fct_partition_quality *out) {
    fct_result result = fct_labels_check(env, mesh, labels, count);
    if (result != FCT_OK) return result;
    judge j = {.mesh = mesh, .labels = labels, .count = count};
    result = group_faces(env, &j);
    if (result == FCT_OK) result = measure_pieces(env, &j, out);
    fct_release(env, j.faces);
    fct_release(env, j.pieces);
    return result;
}

fct_result fct_labels_planes(const fct_env *env, const fct_mesh *mesh, const uint32_t *labels, uint32_t count,
                             float *planes) {
    fct_result result = fct_labels_check(env, mesh, labels, count);
    if (result != FCT_OK) return result;
    judge j = {.mesh = mesh, .labels = labels, .count = count, .planes = planes};
    result = group_faces(env, &j);
    if (result == FCT_OK) fct_parallel_for(env, count, 64, judge_planes, &j);
    fct_release(env, j.faces);
    fct_release(env, j.pieces);
    return result;
}
