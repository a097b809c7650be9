/* bench/cluster/boxes/boxquery.c: plain queries of a tree of boxes: rays, and contact with a copy.
 *
 * All arithmetic is in double. Boxes are enlarged by a millionth of their size, so that rounding never
 * excludes a point on a side of a box. So every tree finds the same hits. The program ends
 * with an error if a stack needs more than 4096 entries.
 */
#include <float.h>
#include <stdlib.h>

#include "bench/cluster/bench.h"
#include "bench/cluster/boxes/boxtree.h"

static v3 corner(const fct_mesh *mesh, uint32_t face, uint32_t k) {
    return v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + k]);
}

static double swell(const fct_box *box) {
    return 1e-6 * ((double)box->half[0] + (double)box->half[1] + (double)box->half[2]);
}

/* --- Rays --- */

/* t where the ray enters the box; INFINITY if it misses the box before `limit`. */
static double enter(const fct_box *box, v3 origin, v3 direction, double limit) {
    v3 o = v3_sub(origin, v3_load(box->center));
    double first = 0, last = limit, margin = swell(box);
    for (int k = 0; k < 3; ++k) {
        v3 axis = v3_load(box->axes[k]);
        double half = (double)box->half[k] + margin, p = v3_dot(axis, o), d = v3_dot(axis, direction);
        if (fabs(d) < DBL_MIN) {
            if (fabs(p) > half) return INFINITY;
            continue;
        }
        double a = (-half - p) / d, b = (half - p) / d;
        first = fmax(first, fmin(a, b)), last = fmin(last, fmax(a, b));
    }
    return first <= last ? first : INFINITY;
}

static double meet(const fct_mesh *mesh, uint32_t face, v3 origin, v3 direction) {
    v3 a = corner(mesh, face, 0), u = v3_sub(corner(mesh, face, 1), a), v = v3_sub(corner(mesh, face, 2), a);
    v3 p = v3_cross(direction, v);
    double det = v3_dot(u, p);
    if (det == 0) return INFINITY;
    v3 o = v3_sub(origin, a), q = v3_cross(o, u);
    double s = v3_dot(o, p) / det, r = v3_dot(direction, q) / det, t = v3_dot(v, q) / det;
    return s >= 0 && r >= 0 && s + r <= 1 && t >= 0 ? t : INFINITY;
}

double box_tree_ray(const box_tree *tree, v3 origin, v3 direction, box_visits *visits) {
    typedef struct entry {
        uint32_t node;
        double t;
    } entry;
    enum { HIGHEST = 4096 };
    entry stack[HIGHEST];
    uint32_t top = 0;
    double best = INFINITY;
    ++visits->boxes;
    stack[top++] = (entry){tree->root, enter(&tree->boxes[tree->root], origin, direction, best)};
    while (top > 0) {
        entry e = stack[--top], inner[2];
        int count = 0;
        if (!(e.t < best)) continue;
        for (int c = 0; c < 2; ++c) {
            uint32_t child = tree->child[e.node][c];
            if (child >= tree->inner_count) {
                ++visits->triangles;
                best = fmin(best, meet(tree->mesh, child - tree->inner_count, origin, direction));
                continue;
            }
            ++visits->boxes;
            double t = enter(&tree->boxes[child], origin, direction, best);
            if (t < INFINITY) inner[count++] = (entry){child, t};
        }
        if (top + 2 > HIGHEST) bench_fail("a tree higher than %d", HIGHEST);
        if (count == 2 && inner[0].t < inner[1].t) {
            entry nearer = inner[0];
            inner[0] = inner[1], inner[1] = nearer;
        }
        for (int i = 0; i < count; ++i) stack[top++] = inner[i];
    }
    return best;
}

/* --- Contact with a copy --- */

static v3 turn(const box_pose *pose, v3 p) {
    return (v3){v3_dot(pose->axes[0], p), v3_dot(pose->axes[1], p), v3_dot(pose->axes[2], p)};
}

static v3 place(const box_pose *pose, v3 p) {
    return v3_add(turn(pose, p), pose->shift);
}

/* Separating axis test of two boxes, with fifteen axes; the pose moves the second box. */
static bool boxes_overlap(const fct_box *first, const fct_box *second, const box_pose *pose) {
    double r[3][3], size[3][3], a[3], b[3], t[3];
    v3 ax[3], between = v3_sub(place(pose, v3_load(second->center)), v3_load(first->center));
    for (int i = 0; i < 3; ++i) {
        a[i] = (double)first->half[i] + swell(first), b[i] = (double)second->half[i] + swell(second);
        ax[i] = v3_load(first->axes[i]);
        t[i] = v3_dot(ax[i], between);
    }
    for (int j = 0; j < 3; ++j) {
        v3 bx = turn(pose, v3_load(second->axes[j]));
        for (int i = 0; i < 3; ++i) r[i][j] = v3_dot(ax[i], bx), size[i][j] = fabs(r[i][j]) + 1e-7;
    }
    for (int i = 0; i < 3; ++i)
        if (fabs(t[i]) > a[i] + b[0] * size[i][0] + b[1] * size[i][1] + b[2] * size[i][2]) return false;
    for (int j = 0; j < 3; ++j)
        if (fabs(t[0] * r[0][j] + t[1] * r[1][j] + t[2] * r[2][j]) >
            b[j] + a[0] * size[0][j] + a[1] * size[1][j] + a[2] * size[2][j])
            return false;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            double reach =
                a[i1] * size[i2][j] + a[i2] * size[i1][j] + b[j1] * size[i][j2] + b[j2] * size[i][j1];
            if (fabs(t[i2] * r[i1][j] - t[i1] * r[i2][j]) > reach) return false;
        }
    return true;
}

static bool parted_along(v3 axis, const v3 p[3], const v3 q[3]) {
    if (v3_norm2(axis) == 0) return false;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 3; ++k) {
        low[0] = fmin(low[0], v3_dot(axis, p[k])), high[0] = fmax(high[0], v3_dot(axis, p[k]));
        low[1] = fmin(low[1], v3_dot(axis, q[k])), high[1] = fmax(high[1], v3_dot(axis, q[k]));
    }
    return low[0] > high[1] || low[1] > high[0];
}

/* Separating axes: both normals, cross products of sides, and for coplanar triangles the normals of the sides
 * in the plane. */
static bool triangles_touch(const v3 p[3], const v3 q[3]) {
    v3 pe[3], qe[3], origin = p[0], a[3], b[3];
    for (int k = 0; k < 3; ++k) {
        a[k] = v3_sub(p[k], origin), b[k] = v3_sub(q[k], origin);
        pe[k] = v3_sub(p[(k + 1) % 3], p[k]), qe[k] = v3_sub(q[(k + 1) % 3], q[k]);
    }
    v3 pn = v3_cross(pe[0], pe[1]), qn = v3_cross(qe[0], qe[1]);
    if (parted_along(pn, a, b) || parted_along(qn, a, b)) return false;
    for (int i = 0; i < 3; ++i) {
        if (parted_along(v3_cross(pn, pe[i]), a, b) || parted_along(v3_cross(qn, qe[i]), a, b)) return false;
        for (int j = 0; j < 3; ++j)
            if (parted_along(v3_cross(pe[i], qe[j]), a, b)) return false;
    }
    return true;
}

bool box_tree_touches(const box_tree *tree, const box_pose *pose, box_visits *visits) {
    enum { HIGHEST = 4096 };
    uint32_t stack[HIGHEST][2], top = 0;
    stack[top][0] = stack[top][1] = tree->root, ++top;
    while (top > 0) {
        uint32_t a = stack[--top][0], b = stack[top][1];
        ++visits->boxes;
        if (!boxes_overlap(&tree->boxes[a], &tree->boxes[b], pose)) continue;
        bool leaf_a = a >= tree->inner_count, leaf_b = b >= tree->inner_count;
        if (leaf_a && leaf_b) {
            v3 p[3], q[3];
            for (uint32_t k = 0; k < 3; ++k) {
                p[k] = corner(tree->mesh, a - tree->inner_count, k);
                q[k] = place(pose, corner(tree->mesh, b - tree->inner_count, k));
            }
            ++visits->triangles;
            if (triangles_touch(p, q)) return true;
            continue;
        }
        bool first = leaf_b || (!leaf_a && box_surface(&tree->boxes[a]) >= box_surface(&tree->boxes[b]));
        if (top + 2 > HIGHEST) bench_fail("a tree higher than %d", HIGHEST);
        for (int c = 1; c >= 0; --c, ++top) {
            stack[top][0] = first ? tree->child[a][c] : a;
            stack[top][1] = first ? b : tree->child[b][c];
        }
    }
    return false;
}
