/* bvh/near/sign/moments.c: see moments.h.
 *
 * Moments of triangles are exact integrals. They are summed in double about the centre of the model, so that
 * those of a node are the sums of those of its children, and move to the centre of the child when they are
 * stored. The records of clusters (cluster.h) cannot serve: they have no moments of position, and a node is
 * no cluster. Leaves are summed in parallel, nodes from the last to the first. O(F). 672 bytes per node, 24
 * per triangle of a scan.
 */
#include "bvh/near/sign/moments.h"

#include "base/math/round.h"
#include "base/parallel.h"
#include "bvh/near/sign/crossings.h"

enum { NODE_CHUNK = 64 }; /* nodes per task */

/* Integrals about the centre of the model. */
typedef struct moments {
    double area;
    v3 first;         /* of x */
    v3 dipole;        /* of n */
    double second[6]; /* of n x, symmetric part: xx xy xz yy yz zz */
    double third[10]; /* of n x x, symmetric part: xxx yyy zzz xxy xxz xyy yyz xzz yzz xyz */
    v3 lower, upper;  /* bounds */
} moments;

/* The symmetric part of n x m over i, j, k, where m is symmetric: added to third. */
static void add_symmetric_product(double third[10], double s, v3 n, const double m[6]) {
    third[0] += s * n.x * m[0], third[1] += s * n.y * m[3], third[2] += s * n.z * m[5];
    third[3] += s / 3 * (2 * n.x * m[1] + n.y * m[0]), third[4] += s / 3 * (2 * n.x * m[2] + n.z * m[0]);
    third[5] += s / 3 * (2 * n.y * m[1] + n.x * m[3]), third[6] += s / 3 * (2 * n.y * m[4] + n.z * m[3]);
    third[7] += s / 3 * (2 * n.z * m[2] + n.x * m[5]), third[8] += s / 3 * (2 * n.z * m[4] + n.y * m[5]);
    third[9] += s / 3 * (n.x * m[4] + n.y * m[2] + n.z * m[1]);
}

/* The symmetric part of the outer product of a and b. */
static void add_symmetric_outer(double m[6], double s, v3 a, v3 b) {
    m[0] += s * a.x * b.x, m[3] += s * a.y * b.y, m[5] += s * a.z * b.z;
    m[1] += s / 2 * (a.x * b.y + a.y * b.x);
    m[2] += s / 2 * (a.x * b.z + a.z * b.x);
    m[4] += s / 2 * (a.y * b.z + a.z * b.y);
}

static moments make_empty(void) {
    return (moments){.lower = {INFINITY, INFINITY, INFINITY}, .upper = {-INFINITY, -INFINITY, -INFINITY}};
}

static void widen_bounds(moments *m, v3 lower, v3 upper) {
    m->lower = v3_make(fmin(m->lower.x, lower.x), fmin(m->lower.y, lower.y), fmin(m->lower.z, lower.z));
    m->upper = v3_make(fmax(m->upper.x, upper.x), fmax(m->upper.y, upper.y), fmax(m->upper.z, upper.z));
}

static void add_triangle(moments *m, const v3 p[3]) {
    v3 n = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5);
    v3 middle = v3_scale(v3_add(p[0], v3_add(p[1], p[2])), 1. / 3);
    double area = v3_norm(n), xx[6] = {0}; /* the mean of x x^T */
    sym3_add_outer(xx, .75, middle);
    for (int c = 0; c < 3; ++c) {
        sym3_add_outer(xx, 1. / 12, p[c]);
        widen_bounds(m, p[c], p[c]);
    }
    m->area += area;
    m->first = v3_mad(m->first, area, middle);
    m->dipole = v3_add(m->dipole, n);
    add_symmetric_outer(m->second, 1, n, middle);
    add_symmetric_product(m->third, 1, n, xx);
}

static void add_moments(moments *m, const moments *other) {
    m->area += other->area;
    m->first = v3_add(m->first, other->first);
    m->dipole = v3_add(m->dipole, other->dipole);
    for (int i = 0; i < 6; ++i) m->second[i] += other->second[i];
    for (int i = 0; i < 10; ++i) m->third[i] += other->third[i];
    widen_bounds(m, other->lower, other->upper);
}

/* The centre of the surface, or the middle of the bounds if there is no area, relative to the centre of the
 * model. Its scaled position is a float, which the node stores. */
static v3 choose_center(const fct_bvh *bvh, const moments *m) {
    v3 c = v3_scale(v3_add(m->lower, m->upper), .5), middle = v3_load(bvh->center);
    if (m->area > 0) c = v3_scale(m->first, 1 / m->area);
    return v3_sub(v3_round(v3_add(c, middle)), middle);
}

/* Moves the moments to the centre c, removes the traces, and stores the child. */
static void store_child(const fct_bvh *bvh, const moments *m, v3 c, double radius, uint32_t i,
                        fct_moment_node *out) {
    double q[6], s[10], cc[6] = {0};
    for (int k = 0; k < 6; ++k) q[k] = m->second[k];
    for (int k = 0; k < 10; ++k) s[k] = m->third[k];
    /* (x - c)(x - c) = x x - 2 sym(x c) + c c */
    sym3_add_outer(cc, 1, c);
    add_symmetric_product(s, -2, c, q);
    add_symmetric_product(s, 1, m->dipole, cc);
    add_symmetric_outer(q, -1, m->dipole, c);
    double trace = (q[0] + q[3] + q[5]) / 3;
    double x = (s[0] + s[5] + s[7]) / 5, y = (s[1] + s[3] + s[8]) / 5, z = (s[2] + s[4] + s[6]) / 5;
    double quadrupole[5] = {q[0] - trace, q[3] - trace, q[1], q[2], q[4]};
    double octupole[7] = {s[0] - 3 * x, s[1] - 3 * y, s[3] - y, s[5] - x, s[4] - z, s[6] - z, s[9]};
    v3 at = v3_add(c, v3_load(bvh->center));
    out->center[0][i] = (float)at.x, out->center[1][i] = (float)at.y, out->center[2][i] = (float)at.z;
    out->radius2[i] = (float)(radius * radius * (1 + 0x1p-20));
    out->dipole[0][i] = (float)m->dipole.x, out->dipole[1][i] = (float)m->dipole.y;
    out->dipole[2][i] = (float)m->dipole.z;
    for (int k = 0; k < 5; ++k) out->quadrupole[k][i] = (float)quadrupole[k];
    for (int k = 0; k < 7; ++k) out->octupole[k][i] = (float)octupole[k];
}

static void sum_leaf(const fct_bvh *bvh, const fct_leaf *leaf, uint32_t slot, moments *sum,
                     fct_moment_node *out) {
    moments m = make_empty();
    v3 middle = v3_load(bvh->center), p[3];
    for (uint32_t i = 0; i < leaf->count; ++i) {
        fct_leaf_triangle(leaf, i, p);
        for (int c = 0; c < 3; ++c) p[c] = v3_sub(p[c], middle);
        add_triangle(&m, p);
    }
    v3 center = choose_center(bvh, &m);
    double radius2 = 0;
    for (uint32_t i = 0; i < leaf->count; ++i) {
        fct_leaf_triangle(leaf, i, p);
        for (int c = 0; c < 3; ++c) radius2 = fmax(radius2, v3_norm2(v3_sub(v3_sub(p[c], middle), center)));
    }
    store_child(bvh, &m, center, sqrt(radius2), slot, out);
    add_moments(sum, &m);
}

/* The radius of a node about a centre: that of the spheres of its children, or of its bounds. */
static double bound_radius(const fct_bvh *bvh, const fct_moment_node *node, const moments *m, v3 center) {
    double spheres = 0;
    v3 at = v3_add(center, v3_load(bvh->center));
    for (uint32_t i = 0; i < 8; ++i) {
        if (!(node->present >> i & 1)) continue;
        v3 c = v3_make((double)node->center[0][i], (double)node->center[1][i], (double)node->center[2][i]);
        spheres = fmax(spheres, v3_norm(v3_sub(c, at)) + sqrt((double)node->radius2[i]));
    }
    v3 below = v3_sub(center, m->lower), above = v3_sub(m->upper, center);
    v3 far = {fmax(below.x, above.x), fmax(below.y, above.y), fmax(below.z, above.z)};
    return fmin(spheres, v3_norm(far));
}

typedef struct moment_job {
    const fct_bvh *bvh;
    fct_moment_node *nodes;
    moments *sums; /* per node */
} moment_job;

static void sum_leaves(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const moment_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        fct_moment_node *node = &job->nodes[i];
        job->sums[i] = make_empty();
        for (uint32_t k = 0; k < 8; ++k)
            if (node->present >> k & 1 && node->child[k] & FCT_REF_LEAF)
                sum_leaf(job->bvh, fct_bvh_leaf(job->bvh, node->child[k]), k, &job->sums[i], node);
    }
}

static void sum_nodes(const moment_job *job, uint32_t count) {
    for (uint32_t i = count; i-- > 0;) {
        fct_moment_node *node = &job->nodes[i];
        for (uint32_t k = 0; k < 8; ++k) {
            uint32_t child = node->child[k];
            if (!(node->present >> k & 1) || child & FCT_REF_LEAF) continue;
            v3 center = choose_center(job->bvh, &job->sums[child]);
            double radius = bound_radius(job->bvh, &job->nodes[child], &job->sums[child], center);
            store_child(job->bvh, &job->sums[child], center, radius, k, node);
            add_moments(&job->sums[i], &job->sums[child]);
        }
    }
}

/* Numbers the nodes, parents first, and returns their count. Sets children and presence if nodes is not NULL.
 */
static uint32_t number_nodes(const fct_bvh *bvh, fct_moment_node *nodes) {
    struct {
        uint32_t ref, parent, slot;
    } stack[FCT_STACK_SIZE];
    uint32_t height = 0, count = 0;
    stack[height].ref = bvh->root, stack[height].parent = FCT_NONE, stack[height++].slot = 0;
    while (height) {
        uint32_t ref = stack[--height].ref, parent = stack[height].parent, slot = stack[height].slot;
        uint32_t present, number = count++;
        const uint32_t *child = fct_bvh_children(bvh, ref, &present);
        if (nodes) {
            if (parent != FCT_NONE) nodes[parent].child[slot] = number;
            nodes[number] = (fct_moment_node){.present = present};
        }
        for (uint32_t k = 8; k-- > 0;) {
            if (!(present >> k & 1)) continue;
            if (nodes) nodes[number].child[k] = child[k];
            if (child[k] & FCT_REF_LEAF) continue;
            stack[height].ref = child[k], stack[height].parent = number, stack[height++].slot = k;
        }
    }
    return count;
}

fct_result fct_moments_build(fct_bvh *bvh) {
    const fct_env *env = bvh->env;
    bvh->has_sign = true;
    fct_result result = fct_crossings_prepare(bvh);
    if (result != FCT_OK || bvh->root & FCT_REF_LEAF) return result;
    uint32_t count = number_nodes(bvh, NULL);
    moment_job job = {.bvh = bvh};
    job.nodes = fct_allocate(env, count, sizeof *job.nodes);
    job.sums = fct_allocate(env, count, sizeof *job.sums);
    if (!job.nodes || !job.sums) {
        fct_release(env, job.nodes);
        fct_release(env, job.sums);
        return fct_fail_memory(env, "winding numbers");
    }
    number_nodes(bvh, job.nodes);
    fct_parallel_for(env, count, NODE_CHUNK, sum_leaves, &job);
    sum_nodes(&job, count);
    fct_release(env, job.sums);
    bvh->moments = job.nodes;
    bvh->moment_bytes = (size_t)count * sizeof *job.nodes;
    return FCT_OK;
}
