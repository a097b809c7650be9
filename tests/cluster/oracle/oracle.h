/* tests/cluster/oracle/oracle.h: clusters and their costs by direct sums over faces, in double.
 *
 * Source: Garland 1999, chapter 8, and the formula of the INCREMENT cost in facetree/cluster.h. Every value
 * is a sum over the faces of the cluster, never a combination of the values of its parts. No code of the
 * library is used. The model is scaled to a bounding-box diagonal of 1. O(faces) per cluster.
 */
#ifndef FCT_TESTS_ORACLE_H
#define FCT_TESTS_ORACLE_H

#include "support.h"

#include "facetree/cluster.h"

/* Tolerance of a cost relative to its terms: MEAN is computed in double, INCREMENT in float. */
static const double oracle_mean_slack = 1e-9, oracle_increment_slack = 1e-3;

typedef struct oracle_face {
    double corner[3][3];
    double vector[3], area; /* area vector A n */
    double sides;           /* sum of the lengths of its three sides */
} oracle_face;

/* Two neighbours in the chain of faces around a mesh edge, and the length of their border there. */
typedef struct oracle_link {
    uint32_t a, b;
    double length;
} oracle_link;

typedef struct oracle {
    uint32_t face_count, link_count;
    oracle_face *faces;
    oracle_link *links;
    uint32_t *link_starts, *links_of; /* first link of each face, with an end; numbers of links */
    const uint32_t *materials;        /* or NULL */
    uint8_t *inside;                  /* per face: scratch */
    fct_cluster_cost cost;
    fct_fit_measure measure;
    double fit_weight, direction_weight, shape_weight; /* a1, a2, a3 of (8.18) */
} oracle;

/* The values of chapter 8 for a cluster. */
typedef struct oracle_cluster {
    double area, vector[3];
    double normal[3];               /* of the best plane, along the area vector */
    double spread[3];               /* eigenvalues of Z (8.6), ascending */
    double fit;                     /* (8.1) */
    double direction;               /* (8.12) */
    double perimeter, irregularity; /* (8.16) */
} oracle_cluster;

/* The cost of a union, and the tolerance. */
typedef struct oracle_price {
    double cost, slack;
} oracle_price;

/* --- Vectors --- */

static inline double oracle_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline double oracle_norm(const double a[3]) {
    return sqrt(oracle_dot(a, a));
}
static inline double oracle_distance(const double a[3], const double b[3]) {
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return oracle_norm(d);
}
/* Half the cross product of two sides of a triangle: its area vector. */
static inline void oracle_area_vector(const double p[3][3], double out[3]) {
    double u[3], v[3];
    for (int k = 0; k < 3; ++k) u[k] = p[1][k] - p[0][k], v[k] = p[2][k] - p[0][k];
    for (int k = 0; k < 3; ++k) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        out[k] = (u[i] * v[j] - u[j] * v[i]) / 2;
    }
}

/* Eigenvalues, ascending, and unit eigenvectors (rows) of a symmetric matrix, by Jacobi rotations. */
static inline void oracle_eigen(const double matrix[3][3], double values[3], double vectors[3][3]) {
    double a[3][3], v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    memcpy(a, matrix, sizeof a);
    for (int sweep = 0; sweep < 12; ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0) continue;
                double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; ++k) { /* columns, then rows */
                    double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < 3; ++k) {
                    double x = a[p][k], y = a[q][k], m = v[p][k], n = v[q][k];
                    a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
                    v[p][k] = c * m - s * n, v[q][k] = s * m + c * n;
                }
            }
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; ++i)
        for (int k = 0; k < 2; ++k)
            if (a[order[k]][order[k]] > a[order[k + 1]][order[k + 1]]) {
                int swap = order[k];
                order[k] = order[k + 1], order[k + 1] = swap;
            }
    for (int i = 0; i < 3; ++i) {
        values[i] = a[order[i]][order[i]];
        memcpy(vectors[i], v[order[i]], sizeof vectors[i]);
    }
}

/* --- The dual graph --- */

typedef struct oracle_side {
    uint32_t low, high, face;
    double length;
} oracle_side;

static inline int oracle_compare_sides(const void *p, const void *q) {
    const oracle_side *a = p, *b = q;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return a->face < b->face ? -1 : a->face > b->face;
}

/* Links the faces around the mesh edge with sides [begin, end) to a chain in the order of faces. A face
 * inside the chain divides its border between its two neighbours. A degenerate face may have two sides on the
 * edge. */
static inline void oracle_link_edge(oracle *o, const oracle_side *sides, size_t begin, size_t end) {
    for (size_t i = begin, k, next; i < end; i = k) {
        for (k = i; k < end && sides[k].face == sides[i].face;) ++k;
        if (k == end) return;
        for (next = k; next < end && sides[next].face == sides[k].face;) ++next;
        double first = (double)(k - i) / (i == begin ? 1 : 2),
               second = (double)(next - k) / (next == end ? 1 : 2);
        o->links[o->link_count++] =
            (oracle_link){sides[i].face, sides[k].face, sides[i].length * fmin(first, second)};
    }
}

static inline void oracle_link_faces(oracle *o, const fct_mesh *mesh) {
    size_t count = 0, faces = mesh->face_count;
    oracle_side *sides = calloc(3 * faces, sizeof *sides);
    o->links = calloc(3 * faces, sizeof *o->links);
    for (uint32_t f = 0; f < faces; ++f)
        for (int k = 0; k < 3; ++k) {
            uint32_t u = mesh->triangles[3 * (size_t)f + (size_t)k];
            uint32_t v = mesh->triangles[3 * (size_t)f + (size_t)((k + 1) % 3)];
            double length = oracle_distance(o->faces[f].corner[k], o->faces[f].corner[(k + 1) % 3]);
            o->faces[f].sides += length;
            if (u != v) sides[count++] = (oracle_side){u < v ? u : v, u < v ? v : u, f, length};
        }
    qsort(sides, count, sizeof *sides, oracle_compare_sides);
    for (size_t i = 0, k; i < count; i = k) {
        for (k = i; k < count && sides[k].low == sides[i].low && sides[k].high == sides[i].high;) ++k;
        oracle_link_edge(o, sides, i, k);
    }
    free(sides);
}

/* Lists each link at its lower face. */
static inline void oracle_list_links(oracle *o) {
    o->link_starts = calloc(o->face_count + 2, sizeof *o->link_starts);
    o->links_of = calloc(o->link_count + 1, sizeof *o->links_of);
    for (uint32_t l = 0; l < o->link_count; ++l) ++o->link_starts[o->links[l].a + 2];
    for (uint32_t f = 0; f < o->face_count; ++f) o->link_starts[f + 2] += o->link_starts[f + 1];
    for (uint32_t l = 0; l < o->link_count; ++l) o->links_of[o->link_starts[o->links[l].a + 1]++] = l;
}

/* The mesh scaled to a unit diagonal of the box around its used vertices, with the cost of def. Negative
 * weights in def are not allowed here. */
static inline oracle oracle_create(const fct_mesh *mesh, const fct_tree_def *def) {
    oracle o = {.face_count = mesh->face_count, .materials = mesh->materials};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * (size_t)mesh->face_count; ++i)
        for (size_t k = 0; k < 3; ++k) {
            double x = (double)mesh->positions[3 * (size_t)mesh->triangles[i] + k];
            low[k] = fmin(low[k], x), high[k] = fmax(high[k], x);
        }
    double diagonal = oracle_distance(low, high);
    if (diagonal == 0) diagonal = 1;
    o.faces = calloc(mesh->face_count, sizeof *o.faces);
    o.inside = calloc(mesh->face_count, 1);
    for (size_t f = 0; f < mesh->face_count; ++f) {
        oracle_face *face = &o.faces[f];
        for (size_t c = 0; c < 3; ++c)
            for (size_t k = 0; k < 3; ++k) {
                double x = (double)mesh->positions[3 * (size_t)mesh->triangles[3 * f + c] + k];
                face->corner[c][k] = (x - (low[k] + high[k]) / 2) / diagonal;
            }
        oracle_area_vector(face->corner, face->vector);
        face->area = oracle_norm(face->vector);
    }
    oracle_link_faces(&o, mesh);
    oracle_list_links(&o);
    o.cost = def->cost, o.measure = def->fit_measure;
    o.fit_weight = def->fit_weight, o.direction_weight = def->direction_weight,
    o.shape_weight = def->shape_weight;
    assert_true(o.fit_weight >= 0 && o.direction_weight >= 0 && o.shape_weight >= 0);
    return o;
}

static inline void oracle_destroy(oracle *o) {
    free(o->faces);
    free(o->links);
    free(o->link_starts);
    free(o->links_of);
    free(o->inside);
}

/* --- Clusters --- */

/* The points that (8.1) sums over, and their weight: the corners of each face (POINTS), or the middles of its
 * sides, a third of the area each, which integrate a quadratic function over the triangle exactly (AREA). */
static inline double oracle_point(const oracle *o, const oracle_face *face, int i, double out[3]) {
    for (int k = 0; k < 3; ++k)
        out[k] = o->measure == FCT_FIT_POINTS ? face->corner[i][k]
                                              : (face->corner[i][k] + face->corner[(i + 1) % 3][k]) / 2;
    return o->measure == FCT_FIT_POINTS ? 1 : face->area / 3;
}

/* Z (8.6) and the number of points, or the area. */
static inline double oracle_scatter(const oracle *o, const uint32_t *faces, uint32_t count, double z[3][3]) {
    double weight = 0, mean[3] = {0}, p[3];
    memset(z, 0, 9 * sizeof(double));
    for (uint32_t i = 0; i < 3 * count; ++i) {
        double w = oracle_point(o, &o->faces[faces[i / 3]], (int)(i % 3), p);
        weight += w;
        for (int k = 0; k < 3; ++k) mean[k] += w * p[k];
    }
    if (weight <= 0) return 0;
    for (int k = 0; k < 3; ++k) mean[k] /= weight;
    for (uint32_t i = 0; i < 3 * count; ++i) {
        double w = oracle_point(o, &o->faces[faces[i / 3]], (int)(i % 3), p);
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l < 3; ++l) z[k][l] += w * (p[k] - mean[k]) * (p[l] - mean[l]);
    }
    return weight;
}

/* The perimeter of a set of faces: the sum of all sides, minus twice every border inside the set. */
static inline double oracle_perimeter(const oracle *o, const uint32_t *faces, uint32_t count) {
    double perimeter = 0;
    for (uint32_t i = 0; i < count; ++i) o->inside[faces[i]] = 1, perimeter += o->faces[faces[i]].sides;
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t l = o->link_starts[faces[i]]; l < o->link_starts[faces[i] + 1]; ++l) {
            const oracle_link *link = &o->links[o->links_of[l]];
            if (o->inside[link->b]) perimeter -= 2 * link->length;
        }
    for (uint32_t i = 0; i < count; ++i) o->inside[faces[i]] = 0;
    return perimeter > 1e-12 ? perimeter : 0;
}

static inline oracle_cluster oracle_measure(const oracle *o, const uint32_t *faces, uint32_t count) {
    oracle_cluster c = {0};
    double z[3][3], axes[3][3];
    double points = oracle_scatter(o, faces, count, z);
    oracle_eigen(z, c.spread, axes);
    for (uint32_t i = 0; i < count; ++i) {
        c.area += o->faces[faces[i]].area;
        for (int k = 0; k < 3; ++k) c.vector[k] += o->faces[faces[i]].vector[k];
    }
    double side = oracle_dot(axes[0], c.vector) < 0 ? -1 : 1;
    for (int k = 0; k < 3; ++k) c.normal[k] = side * axes[0][k];
    if (points > 0) c.fit = fmax(c.spread[0], 0) / points;
    for (uint32_t i = 0; i < count; ++i) { /* (8.12) */
        const oracle_face *face = &o->faces[faces[i]];
        if (face->area <= 0) continue;
        double away = 1 - oracle_dot(c.normal, face->vector) / face->area;
        c.direction += face->area * away * away;
    }
    if (c.area > 0) c.direction /= c.area;
    c.perimeter = oracle_perimeter(o, faces, count);
    c.irregularity = c.area > 0        ? c.perimeter * c.perimeter / (4 * 3.14159265358979323846 * c.area)
                     : c.perimeter > 0 ? INFINITY
                                       : 0;
    return c;
}

/* --- Costs --- */

/* (8.17). At least -1000, which a closed union has. 1/2 if the union has no area or both parts are closed. */
static inline double oracle_shape(const oracle_cluster *a, const oracle_cluster *b, const oracle_cluster *u) {
    double worst = fmax(a->irregularity, b->irregularity);
    if (u->area == 0 || worst == 0) return 0.5;
    return fmax(1 - worst / (2 * u->irregularity), -1000);
}

/* (8.18). The slack is 1e-9 of the terms. If the two smallest spreads of the union are equal, its normal and
 * so E_dir are arbitrary. */
static inline oracle_price oracle_mean(const oracle *o, const oracle_cluster *u, double shape) {
    double gap = u->spread[1] - u->spread[0];
    double loose = gap > 0 ? fmin(1e-12 * u->spread[2] / gap, 4) : u->area > 0 ? 4 : 0;
    double fit = o->fit_weight * u->fit, direction = o->direction_weight * u->direction;
    shape *= o->shape_weight;
    return (oracle_price){fit + direction + shape, oracle_mean_slack * (fit + direction + fabs(shape)) +
                                                       o->fit_weight * 1e-14 +
                                                       o->direction_weight * (1e-12 + loose)};
}

/* The share of the shape weight of INCREMENT: a twentieth for a flat union, 1 where 1 - |S| / w is .001 or
 * more. */
static inline double oracle_shape_share(const oracle_cluster *u) {
    return u->area > 0 ? fmin(fmax((1 - oracle_norm(u->vector) / u->area) / 0.001, 0.05), 1) : 0.05;
}

/* a1 D(w E_fit) + a2 2 (|Sa| + |Sb| - |Sa + Sb|) + a3 w E_shape f. The slack is that of float records. */
static inline oracle_price oracle_increment(const oracle *o, const oracle_cluster *a, const oracle_cluster *b,
                                            const oracle_cluster *u, double shape) {
    double fit = fmax(u->area * u->fit - a->area * a->fit - b->area * b->fit, 0),
           share = oracle_shape_share(u);
    double direction = 2 * (oracle_norm(a->vector) + oracle_norm(b->vector) - oracle_norm(u->vector));
    double points = u->fit > 0 ? u->area * u->fit / u->spread[0] : 1; /* factor from a spread to w E_fit */
    double share_slack = share > 0.05 && share < 1 ? 3e-4 : 0;
    double floor = o->fit_weight * (1e-6 * u->area * u->fit + 1e-7 * u->spread[2] * points) +
                   o->direction_weight * 1e-7 * u->area +
                   o->shape_weight * u->area * (1e-5 * share + share_slack * fabs(shape));
    fit *= o->fit_weight, direction *= o->direction_weight, shape *= o->shape_weight * u->area * share;
    return (oracle_price){fit + direction + shape,
                          oracle_increment_slack * (fabs(fit) + fabs(direction) + fabs(shape)) + floor};
}

/* The cost of merging two clusters with these faces and the values a and b. */
static inline oracle_price oracle_merge_price(const oracle *o, const oracle_cluster *a,
                                              const uint32_t *a_faces, uint32_t a_count,
                                              const oracle_cluster *b, const uint32_t *b_faces,
                                              uint32_t b_count) {
    uint32_t *both = malloc((a_count + b_count) * sizeof *both);
    memcpy(both, a_faces, a_count * sizeof *both);
    memcpy(both + a_count, b_faces, b_count * sizeof *both);
    oracle_cluster u = oracle_measure(o, both, a_count + b_count);
    free(both);
    double shape = oracle_shape(a, b, &u);
    return o->cost == FCT_COST_MEAN ? oracle_mean(o, &u, shape) : oracle_increment(o, a, b, &u, shape);
}

/* The height rule of facetree/cluster.h's depth bound: a union of height 8 or less is always allowed, a
 * taller one up to 3 log2 n - 1, and while `mild` up to 2 log2 n + 8. */
static inline bool oracle_allows(uint32_t tallest_part, uint32_t count, bool mild) {
    double steep = 3 * log2(count) - 1, gentle = 2 * log2(count) + 8;
    return tallest_part < 8 || tallest_part + 1 <= floor(mild && gentle < steep ? gentle : steep);
}

#endif
