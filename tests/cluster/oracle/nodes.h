/* tests/cluster/oracle/nodes.h: every node of a tree, leaves included, against direct sums over its faces:
 * area, area vector, moment, centroid, plane, cone and box. The box must contain all vertices, end at them,
 * and have about the least area of the documented frames. */
#ifndef FCT_TESTS_ORACLE_NODES_H
#define FCT_TESTS_ORACLE_NODES_H

#include "meshes.h"
#include "oracle.h"

enum { ANGLES = 8, BLOCK = 1024, SAMPLES = 64 };

/* A node's faces in the mesh's own coordinates. */
typedef struct node {
    const char *name;
    uint32_t id, count;
    const fct_tree_view *view;
    fct_cluster record;
    double (*corners)[3][3]; /* per face */
    double low[3], high[3];  /* of all corners */
    double size;             /* largest coordinate and extent, which set the rounding of floats */
    double area, vector[3], moment[6], centroid[3], spread[3], axes[3][3];
    double cone_slack; /* radians by which the cone of a large cluster may be wider */
} node;

static inline void expect(const node *n, const char *what, double found, double wanted, double slack) {
    if (!(fabs(found - wanted) <= slack))
        fail_msg("%s: node %u of %u faces: %s is %.9g, should be %.9g (off by %.3g, slack %.3g)", n->name,
                 n->id, n->count, what, found, wanted, found - wanted, slack);
}

static inline void load_corners(node *n) {
    n->corners = malloc(n->count * sizeof *n->corners);
    for (int k = 0; k < 3; ++k) n->low[k] = INFINITY, n->high[k] = -INFINITY;
    for (uint32_t f = 0; f < n->count; ++f)
        for (size_t c = 0; c < 3; ++c)
            for (size_t k = 0; k < 3; ++k) {
                uint32_t v = n->view->triangles[3 * (size_t)(n->record.first + f) + c];
                double x = (double)n->view->positions[3 * (size_t)v + k];
                n->corners[f][c][k] = x;
                n->low[k] = fmin(n->low[k], x), n->high[k] = fmax(n->high[k], x);
            }
    n->size = oracle_distance(n->low, n->high) + oracle_norm(n->low) + oracle_norm(n->high);
}

/* A face without area weighs 1e-20 of its longest squared side, so that clusters of such faces have a
 * centroid. */
static inline double weigh_face(const double p[3][3], double area) {
    double longest =
        fmax(oracle_distance(p[0], p[1]), fmax(oracle_distance(p[1], p[2]), oracle_distance(p[2], p[0])));
    return area > 0 ? area : 1e-20 * longest * longest;
}

static inline void sum_faces(node *n) {
    double weight = 0, z[3][3] = {{0}};
    for (uint32_t f = 0; f < n->count; ++f) {
        const double(*p)[3] = (const double(*)[3])n->corners[f];
        double s[3];
        oracle_area_vector(p, s);
        double area = oracle_norm(s), w = weigh_face(p, area);
        n->area += area, weight += w;
        for (int k = 0, i = 0; k < 3; ++k) {
            n->vector[k] += s[k];
            n->centroid[k] += w * (p[0][k] + p[1][k] + p[2][k]) / 3;
            for (int l = k; l < 3; ++l, ++i) n->moment[i] += area > 0 ? s[k] * s[l] / area : 0;
        }
    }
    for (int k = 0; k < 3 && weight > 0; ++k) n->centroid[k] /= weight;
    for (int k = 0; k < 3 && weight <= 0; ++k) n->centroid[k] = n->low[k];
    for (uint32_t f = 0; f < n->count; ++f) { /* the rule of side midpoints is exact for squares */
        const double(*p)[3] = (const double(*)[3])n->corners[f];
        double s[3];
        oracle_area_vector(p, s);
        double w = weigh_face(p, oracle_norm(s)) / 3;
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k)
                for (int l = 0; l < 3; ++l)
                    z[k][l] += w * ((p[c][k] + p[(c + 1) % 3][k]) / 2 - n->centroid[k]) *
                               ((p[c][l] + p[(c + 1) % 3][l]) / 2 - n->centroid[l]);
    }
    for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3 && weight > 0; ++l) z[k][l] /= weight;
    oracle_eigen((const double(*)[3])z, n->spread, n->axes);
}

static inline void check_sums(const node *n) {
    const fct_cluster *c = &n->record;
    expect(n, "area", (double)c->area, n->area, 3e-7 * n->area);
    for (int k = 0; k < 3; ++k) {
        expect(n, "area vector", (double)c->area_vector[k], n->vector[k], 3e-7 * n->area);
        expect(n, "centroid", (double)c->centroid[k], n->centroid[k], 2e-7 * n->size);
    }
    for (int i = 0; i < 6; ++i) expect(n, "moment", (double)c->moment[i], n->moment[i], 3e-7 * n->area);
}

/* Compares the spread along the normal, because equal eigenvalues allow several normals. */
static inline void check_plane(const node *n) {
    const float *plane = n->record.plane;
    double normal[3] = {(double)plane[0], (double)plane[1], (double)plane[2]}, along = 0;
    expect(n, "normal's length", oracle_norm(normal), 1, 3e-7);
    for (int i = 0; i < 3; ++i) along += n->spread[i] * pow(oracle_dot(normal, n->axes[i]), 2);
    along /= oracle_dot(normal, normal);
    expect(n, "spread along the normal", along, n->spread[0],
           1e-12 * n->spread[2] + 1e-14 * n->size * n->size);
    if (oracle_dot(normal, n->vector) < -1e-6 * n->area) expect(n, "normal's side", -1, 1, 0);
    expect(n, "offset", (double)plane[3], -oracle_dot(normal, n->centroid), 3e-7 * n->size);
}

/* The cone is about the stored area vector. It is at most a millionth wider than its normals, by half chords;
 * a large cluster whose normals go nearly everywhere may have all directions. */
static inline void check_cone(const node *n) {
    double axis[3], widest = 0, angle = (double)n->record.cone_angle;
    for (int k = 0; k < 3; ++k) axis[k] = (double)n->record.area_vector[k];
    double length = oracle_norm(axis);
    if (length == 0) {
        expect(n, "cone's angle", angle, pi, 1e-6);
        return;
    }
    for (int k = 0; k < 3; ++k) axis[k] /= length;
    for (uint32_t f = 0; f < n->count; ++f) {
        double s[3], away[3];
        oracle_area_vector((const double(*)[3])n->corners[f], s);
        double area = oracle_norm(s);
        for (int k = 0; k < 3; ++k) away[k] = s[k] / area - axis[k];
        if (area > 0) widest = fmax(widest, oracle_norm(away) / 2);
    }
    double least = 2 * asin(fmin(widest, 1));
    double most = n->count > BLOCK && widest > 0.99 ? pi : 2 * asin(fmin(widest + 1e-6, 1));
    if (n->count > BLOCK) most = fmin(most + n->cone_slack, pi);
    if (angle < least - 1e-7 || angle > most + 2e-6) expect(n, "cone's angle", angle, least, most - least);
}

/* --- Boxes --- */

static inline double box_area(const double e[3]) {
    return 2 * (e[0] * e[1] + e[1] * e[2] + e[2] * e[0]);
}

static inline void project_faces(const node *n, const double axes[3][3], double low[3], double high[3]) {
    for (int k = 0; k < 3; ++k) low[k] = INFINITY, high[k] = -INFINITY;
    for (uint32_t f = 0; f < n->count; ++f)
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k) {
                double x = oracle_dot(n->corners[f][c], axes[k]);
                low[k] = fmin(low[k], x), high[k] = fmax(high[k], x);
            }
}

static inline double area_along(const node *n, const double axes[3][3]) {
    double low[3], high[3];
    project_faces(n, axes, low, high);
    const double extents[3] = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
    return box_area(extents);
}

/* The least area of the frame turned about its first axis by i / count of a right angle. */
static inline double least_turned_area(const node *n, const double frame[3][3], int count) {
    double least = INFINITY;
    for (int i = 0; i < count; ++i) {
        double c = cos(pi / 2 * i / count), s = sin(pi / 2 * i / count), axes[3][3];
        for (int k = 0; k < 3; ++k) {
            axes[0][k] = frame[0][k];
            axes[1][k] = c * frame[2][k] + s * frame[1][k];
            axes[2][k] = c * frame[1][k] - s * frame[2][k];
        }
        least = fmin(least, area_along(n, (const double(*)[3])axes));
    }
    return least;
}

/* Areas of boxes over the least area of other frames. */
typedef struct excess {
    double worst, sum;
    uint32_t count;
} excess;

/* exact: of clusters with at most 64 vertices, to the eight angles. sampled: the same of larger ones. fine:
 * to 90 angles. world, own: of clusters with more than 1024 faces, to the axes of the world and to the eight
 * angles. */
typedef struct excesses {
    excess exact, sampled, fine, world, own;
} excesses;

static inline void add_excess(excess *to, double area, double least) {
    double factor = least > 0 ? area / least : 1;
    to->worst = fmax(to->worst, factor), to->sum += factor, ++to->count;
}

static inline void check_extents(const node *n, const fct_box *box, const double axes[3][3], double half[3]) {
    double low[3], high[3], center[3];
    for (int i = 0; i < 3; ++i) center[i] = (double)box->center[i], half[i] = (double)box->half[i];
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            expect(n, "product of two axes", oracle_dot(axes[i], axes[k]), i == k, 5e-7);
    project_faces(n, axes, low, high);
    for (int i = 0; i < 3; ++i) {
        double middle = oracle_dot(center, axes[i]), reach = fmax(high[i] - middle, middle - low[i]);
        if (!(half[i] >= reach)) expect(n, "half extent that misses a vertex", half[i], reach, 0);
        expect(n, "half extent", half[i], (high[i] - low[i]) / 2, 3e-7 * n->size);
    }
}

static inline bool has_certain_axes(const node *n) {
    double unsure = 1e-5 * n->spread[2];
    return n->spread[1] - n->spread[0] > unsure && n->spread[2] - n->spread[1] > unsure;
}

static inline void check_box(const node *n, excesses *out) {
    fct_box box;
    double axes[3][3], half[3];
    fct_cluster_box(&n->record, &box);
    for (int i = 0; i < 9; ++i) axes[i / 3][i % 3] = (double)box.axes[i / 3][i % 3];
    check_extents(n, &box, (const double(*)[3])axes, half);
    double area = area_along(n, (const double(*)[3])axes);
    static const double world[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double(*own)[3] = (const double(*)[3])n->axes;
    if (n->count > BLOCK) {
        add_excess(&out->world, area, area_along(n, world));
        if (has_certain_axes(n)) add_excess(&out->own, area, least_turned_area(n, own, ANGLES));
    } else if (has_certain_axes(n)) {
        if (1 - fabs(oracle_dot(axes[2], n->axes[0])) > 1e-6)
            expect(n, "box's third axis along the normal", 0, 1, 0);
        double turned = least_turned_area(n, own, ANGLES);
        bool all_points = 3 * n->count <= SAMPLES;
        if (all_points && area > (1 + 1e-4) * turned)
            expect(n, "area of the box", area, turned, 1e-4 * turned);
        add_excess(all_points ? &out->exact : &out->sampled, area, turned);
        add_excess(&out->fine, area, least_turned_area(n, own, 90));
    }
}

/* --- Trees --- */

/* Depths of all leaves, from the roots down, because the id of a child is larger than that of its parent. */
static inline void check_depth(const char *name, const fct_tree *tree) {
    fct_tree_view view = fct_tree_get(tree);
    uint32_t all = view.node_count + view.face_count, deepest = 0, *depths = calloc(all, sizeof *depths);
    double sum = 0;
    for (uint32_t id = 0; id < all; ++id) {
        fct_cluster c;
        assert_int_equal(fct_tree_cluster(tree, id, &c), FCT_OK);
        for (int k = 0; k < 2 && c.count > 1; ++k) depths[c.child[k]] = depths[id] + 1;
        if (c.count > 1) continue;
        sum += depths[id];
        deepest = depths[id] > deepest ? depths[id] : deepest;
    }
    if (view.depth != deepest || fabs(view.mean_depth - sum / view.face_count) > 1e-9 * view.mean_depth)
        fail_msg("%s: depths are %u and %g in the mean, should be %u and %g", name, view.depth,
                 view.mean_depth, deepest, sum / view.face_count);
    if (deepest > 3 * log2(view.face_count))
        fail_msg("%s: %u faces are %u deep", name, view.face_count, deepest);
    free(depths);
}

static inline void check_nodes(const char *name, const fct_tree *tree, double cone_slack, excesses *out) {
    fct_tree_view view = fct_tree_get(tree);
    for (uint32_t id = 0; id < view.node_count + view.face_count; ++id) {
        node n = {.name = name, .id = id, .view = &view, .cone_slack = cone_slack};
        assert_int_equal(fct_tree_cluster(tree, id, &n.record), FCT_OK);
        n.count = n.record.count;
        load_corners(&n);
        sum_faces(&n);
        check_sums(&n);
        check_plane(&n);
        check_cone(&n);
        check_box(&n, out);
        free(n.corners);
    }
    check_depth(name, tree);
}

static inline void check_excess(const char *what, const excess *e, double worst, double mean) {
    double found = e->sum / e->count;
    print_message("%s: box areas are %.6f of the least at worst, %.5f in the mean\n", what, e->worst, found);
    if (e->worst > worst || !(found <= mean)) fail_msg("%s: expected at most %g and %g", what, worst, mean);
}

#endif
