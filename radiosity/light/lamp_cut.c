/* radiosity/light/lamp_cut.c: see lamp_cut.h.
 *
 * w is the unit vector from the receiver to the node, n the receiver's normal.
 * 1. A node that wholly faces the receiver and lies wholly above its horizon sends (n.w) (-w.S) / (pi r^2),
 * with a relative error of about rms^2 / r^2 (1 / cos + 1 / cos').
 * 2. Any other node is known between two bounds only: max(0, -w.S) and, by Cauchy-Schwarz on the moments,
 *    (sqrt(A w.M w) - w.S) / 2.
 * 3. Nodes are opened until the error is small against their own light or against the lamp's.
 * 4. A far bent lamp needs no cut: a table holds its projected area over all directions.
 */
#include "radiosity/light/lamp_cut.h"

#include "base/parallel.h"
#include "cluster/tree/node.h"
#include "facetree/partition.h"
#include "radiosity/light/polygon.h"
#include "scene/transform.h"

#include <string.h>

/* Error allowed to a node: a share of its own light, or SHARE_ERROR of the lamp's. With these two values,
 * test_lamp.c finds the light of dense lamps within .6 % of the sum over their triangles. */
#define RELATIVE_ERROR .02
#define SHARE_ERROR    7e-4
/* rms^2 / r^2 (1 + 1 / cos) below which a table of projected areas replaces the cut. */
#define FAR_ERROR .02
/* Error of a bent node per radian of its normal cone and per rms / r. Smaller: bumpy lamps close by are
 * coarse. */
#define BEND_ERROR .2
/* Expected error as a share of the distance between the bounds. Smaller: nodes across the horizon stay
 * closed. */
#define BOUND_ERROR .35
/* Variance of a plate along its side over the squared half side: 1/3 for a rectangle, 1/4 for an ellipse. A
 * cluster's outline lies between the two. */
#define PLATE_VARIANCE .29
/* A receiver that sees a face at an angle below this, in radians, lies in its plane. Cones of flat nodes are
 * up to 6e-7 too wide. */
#define PLANE_ANGLE 2e-6
/* Cosines are at least this in error bounds, which would be infinite otherwise. */
#define LEAST_COSINE .05
/* A triangle larger than its distance is cut into quarters if it sends more than this share of the lamp's
 * light. Otherwise shadow rays would go too rarely to its near part, which sends most of its light. */
#define BRIGHT_PART .05
#define MAX_PART    (1u << 12) /* quarters down to 4^-6 of a triangle */
/* Clusters whose projected areas the table sums. */
#define TABLE_CLUSTERS 2048
#define STACK_SIZE     256

/* Light of a node: estimate, upper bound, expected error. */
typedef struct outlook {
    double light, upper, error;
    bool whole; /* the node wholly faces the receiver and lies wholly above its horizon */
} outlook;

static v3 transform_vector(const double m[12], v3 p) {
    return v3_make(m[0] * p.x + m[1] * p.y + m[2] * p.z, m[4] * p.x + m[5] * p.y + m[6] * p.z,
                   m[8] * p.x + m[9] * p.y + m[10] * p.z);
}

static void load_triangle(const fct_tree_view *view, uint32_t place, v3 out[3]) {
    const uint32_t *t = view->triangles + 3 * (size_t)place;
    for (int k = 0; k < 3; ++k) out[k] = v3_load(view->positions + 3 * (size_t)t[k]);
}

/* Shrinks the corners to the quarter that the base-4 digits of `part` name, after the leading 1:
 *           2
 *          / \
 *        m2 - m1        digit k: the quarter at corner k; digit 3: the middle one
 *        / \ / \
 *       0 - m0 - 1
 */
static void shrink_to_part(uint32_t part, v3 p[3]) {
    int shift = 0;
    while (part >> (shift + 2)) shift += 2;
    for (shift -= 2; shift >= 0; shift -= 2) {
        v3 m[3];
        for (int k = 0; k < 3; ++k) m[k] = v3_scale(v3_add(p[k], p[k == 2 ? 0 : k + 1]), .5);
        uint32_t digit = part >> shift & 3;
        if (digit == 3) {
            memcpy(p, m, sizeof m);
            continue;
        }
        v3 q[3] = {digit == 0   ? p[0]
                   : digit == 1 ? m[0]
                                : m[2],
                   digit == 0   ? m[0]
                   : digit == 1 ? p[1]
                                : m[1],
                   digit == 0   ? m[2]
                   : digit == 1 ? m[1]
                                : p[2]};
        memcpy(p, q, sizeof q);
    }
}

/* The side of the node that the receiver sees: 1 front, -1 back, 0 both or unknown. Directions to the node
 * are within the angle with sine `spread` of w. */
static int find_visible_side(const fct_cluster *c, v3 w, double spread) {
    v3 s = v3_load(c->area_vector);
    double length = v3_norm(s);
    if (!(c->cone_angle < 1.6) || length == 0 || spread > .9) return 0;
    /* sin(x) <= x makes the test a little too wide, and saves an arc cosine. */
    double cosine = -v3_dot(s, w) / length, margin = c->cone_angle + 1.25 * spread;
    return cosine > margin ? 1 : cosine < -margin ? -1 : 0;
}

/* The mean of max(0, x) over x uniform in [c - s, c + s]. */
static double average_above_zero(double c, double s) {
    return c >= s ? c : c <= -s ? 0 : (c + s) * (c + s) / (4 * s);
}

/* True if the receiver lies in the planes of all faces of the node or behind them, for a lamp of two sides in
 * them. `middle` is the center of the node's box relative to the receiver; no point of the node is farther
 * away than `reach`. */
static bool cluster_turns_away(const fct_lamp *lamp, const fct_cluster *c, v3 middle, double reach,
                               double slack) {
    v3 s = v3_unit(v3_load(c->area_vector));
    double height = -v3_dot(middle, s);
    if (lamp->two_sided) height = fabs(height);
    double room = slack + (PLANE_ANGLE - c->cone_angle) * reach - height;
    if (!(room >= 0)) return false;
    fct_box box;
    fct_cluster_box(c, &box);
    for (int k = 0; k < 3; ++k) room -= box.half[k] * fabs(v3_dot(v3_load(box.axes[k]), s));
    return room >= 0;
}

static outlook estimate_cluster(const fct_lamp *lamp, const fct_receiver *rec, const fct_cluster *c) {
    v3 middle = v3_sub(v3_load(c->box_center), rec->x), d = v3_sub(v3_load(c->centroid), rec->x);
    double half2 = v3_norm2(v3_load(c->box_half)), shift2 = v3_norm2(v3_sub(d, middle));
    double radius = sqrt(half2) + sqrt(shift2), r2 = v3_norm2(d), height = v3_dot(d, rec->n);
    if (height <= -radius) return (outlook){0};
    double r = sqrt(r2);
    if (cluster_turns_away(lamp, c, middle, r + radius, rec->slack)) return (outlook){0};
    double floor2 = r2 > radius * radius ? r2 : radius * radius;
    double spread = radius < r ? radius / r : 1, cosx = r > 0 ? height / r : 0;
    v3 w = r > 0 ? v3_scale(d, 1 / r) : rec->n;
    int side = find_visible_side(c, w, spread);
    if (side < 0 && !lamp->two_sided) return (outlook){0};
    double toward = -v3_dot(v3_load(c->area_vector), w), kernel = 1 / (FCT_PI * floor2);
    double cross =
        sqrt((double)c->area * fct_max(sym3_form((double[6]){c->moment[0], c->moment[1], c->moment[2],
                                                             c->moment[3], c->moment[4], c->moment[5]},
                                                 w, w),
                                       0));
    double upper = lamp->two_sided ? cross : .5 * (cross + toward);
    double lower = lamp->two_sided ? fabs(toward) : fct_max(toward, 0);
    if (upper < lower) upper = lower;
    double top = fct_min(cosx + spread, 1) * kernel, bottom = fct_max(cosx - spread, 0) * kernel;
    /* The direction to x turns by up to asin(spread) over the node, so x may see a face edge-on to w. */
    double widest = fct_min(c->area, upper + (side ? 0 : spread * (c->area - upper)));
    if (side && cosx >= spread && spread < .5) {
        double light = fabs(toward) * cosx * kernel, cosy = fct_max(fabs(toward) / c->area, LEAST_COSINE);
        double rms = sqrt(half2 / 3 + shift2) / r, bend = fct_min(c->cone_angle, 1);
        double error =
            rms * rms * (1 / fct_max(cosx, LEAST_COSINE) + 1 / cosy) + BEND_ERROR * rms * bend / cosy;
        return (outlook){light, widest * top, light * error, true};
    }
    double light = (.5 * (lower + upper)) * average_above_zero(cosx, spread) * kernel;
    return (outlook){light, widest * top, BOUND_ERROR * (widest * top - (side ? lower * bottom : 0)), false};
}

/* Second-order correction of the kernel K(y) = (n.y) (s.y) / |y|^4 over a surface with centroid d: mean of K
 * over K(d), minus 1. The surface's covariance is sum_k axis_k axis_k^T, so the value is the trace of
 * covariance times Hessian of K, over 2 K(d). */
static double correct_kernel(v3 d, v3 n, v3 s, const v3 axes[3]) {
    double a = v3_dot(n, d), b = v3_dot(s, d), r2 = v3_norm2(d), sum = 0;
    for (int k = 0; k < 3; ++k) {
        double na = v3_dot(n, axes[k]), sa = v3_dot(s, axes[k]), da = v3_dot(d, axes[k]) / r2;
        sum += na * sa / (a * b) - 4 * da * (sa / b + na / a) - 2 * v3_norm2(axes[k]) / r2 + 12 * da * da;
    }
    return sum;
}

/* The same for a cluster, as a flat plate that fills its box. */
static double correct_cluster(const fct_receiver *rec, const fct_cluster *c) {
    fct_box box;
    v3 axes[3];
    fct_cluster_box(c, &box);
    for (int k = 0; k < 3; ++k) axes[k] = v3_scale(v3_load(box.axes[k]), box.half[k] * sqrt(PLATE_VARIANCE));
    return correct_kernel(v3_sub(v3_load(c->centroid), rec->x), rec->n, v3_load(c->area_vector), axes);
}

/* Light of a triangle with corners relative to x: the far formula if its error is small, else Lambert's.
 * *near: the triangle is larger than its distance. The covariance of a triangle is sum e_k e_k^T / 36 over
 * its sides. */
static double light_triangle(const fct_lamp *lamp, const fct_receiver *rec, const v3 p[3], bool *near) {
    v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), e = v3_sub(p[2], p[1]);
    double length = v3_norm(cross), height = -v3_dot(cross, p[0]);
    *near = false;
    if (length == 0 || fabs(height) <= rec->slack * length || (height < 0 && !lamp->two_sided)) return 0;
    v3 d = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3);
    double size2 = v3_norm2(v3_sub(p[1], p[0])) + v3_norm2(v3_sub(p[2], p[0])) + v3_norm2(e),
           r2 = v3_norm2(d);
    double r = sqrt(r2), cosx = v3_dot(d, rec->n) / r, cosy = fabs(height) / (length * r);
    double low = fct_min(v3_dot(p[0], rec->n), fct_min(v3_dot(p[1], rec->n), v3_dot(p[2], rec->n)));
    if (low > 0 && size2 / 36 * (cosx + cosy) < RELATIVE_ERROR * r2 * cosx * cosy) {
        v3 axes[3] = {v3_scale(v3_sub(p[1], p[0]), 1. / 6), v3_scale(v3_sub(p[2], p[0]), 1. / 6),
                      v3_scale(e, 1. / 6)};
        return .5 * length * cosx * cosy / (FCT_PI * r2) * (1 + correct_kernel(d, rec->n, cross, axes));
    }
    *near = size2 > r2;
    return fct_triangle_irradiance(p, rec->n);
}

/* Adds an item; false if the cut is full, and the last item takes its light. */
static bool append_item(fct_cut *cut, uint32_t node, uint32_t part, double light) {
    cut->light += light;
    if (cut->count < FCT_CUT_SIZE) {
        if (light > 0) cut->items[cut->count++] = (fct_cut_item){node, part, light};
        return true;
    }
    cut->items[FCT_CUT_SIZE - 1].light += light;
    return false;
}

/* Adds a leaf, in quarters where it is near and bright. */
static bool append_leaf(const fct_lamp *lamp, const fct_receiver *rec, uint32_t node, double reference,
                        fct_cut *cut) {
    uint32_t parts[32], count = 1;
    bool fits = true;
    parts[0] = 1;
    v3 whole[3];
    load_triangle(&lamp->view, node - lamp->view.node_count, whole);
    for (int k = 0; k < 3; ++k) whole[k] = v3_sub(whole[k], rec->x);
    while (count) {
        uint32_t part = parts[--count];
        v3 p[3] = {whole[0], whole[1], whole[2]};
        bool near;
        shrink_to_part(part, p);
        double light = light_triangle(lamp, rec, p, &near);
        if (near && part < MAX_PART && light > BRIGHT_PART * reference && cut->count + 32 < FCT_CUT_SIZE)
            for (uint32_t digit = 4; digit-- > 0;) parts[count++] = part << 2 | digit;
        else
            fits = append_item(cut, node, part, light) && fits;
    }
    return fits;
}

/* Adds the cut of the tree below `node` whose nodes have errors below `share`. Sets *coarse if clusters are
 * among them. False: the cut became too large. */
static bool cut_tree(const fct_lamp *lamp, const fct_receiver *rec, uint32_t node, double share,
                     double reference, fct_cut *cut, bool *coarse) {
    uint32_t stack[STACK_SIZE], depth = 1;
    bool fits = true;
    stack[0] = node;
    while (depth) {
        node = stack[--depth];
        if (node >= lamp->view.node_count) {
            fits = append_leaf(lamp, rec, node, reference, cut) && fits;
            continue;
        }
        fct_cluster room;
        const fct_cluster *c = fct_node_cluster(lamp->tree, node, &room);
        outlook o = estimate_cluster(lamp, rec, c);
        if (o.upper <= 0) continue;
        bool full = depth + 2 > STACK_SIZE || cut->count + depth + 1 > FCT_CUT_SIZE;
        if (full || o.error <= share || o.error <= RELATIVE_ERROR * o.light) {
            if (o.whole) o.light *= 1 + fct_min(fct_max(correct_cluster(rec, c), -.1), .1);
            fits = append_item(cut, node, 1, o.light) && !full && fits;
            *coarse = true;
        } else {
            stack[depth++] = fct_node_child(lamp->tree, node, 1);
            stack[depth++] = fct_node_child(lamp->tree, node, 0);
        }
    }
    return fits;
}

/* Projected area in the direction of the unit vector w, bilinear on the cube. */
static double look_up_area(const double *table, v3 w) {
    double a[3] = {w.x, w.y, w.z};
    int axis = fabs(a[0]) >= fabs(a[1])   ? (fabs(a[0]) >= fabs(a[2]) ? 0 : 2)
               : fabs(a[1]) >= fabs(a[2]) ? 1
                                          : 2;
    double s = 1 / fabs(a[axis]);
    double u = (a[(axis + 1) % 3] * s + 1) * (FCT_LAMP_CELLS / 2.),
           v = (a[(axis + 2) % 3] * s + 1) * (FCT_LAMP_CELLS / 2.);
    int i = (int)u < FCT_LAMP_CELLS ? (int)u : FCT_LAMP_CELLS - 1;
    int j = (int)v < FCT_LAMP_CELLS ? (int)v : FCT_LAMP_CELLS - 1;
    const double *t =
        table + ((2 * axis + (a[axis] < 0)) * (FCT_LAMP_CELLS + 1) + j) * (FCT_LAMP_CELLS + 1) + i;
    double x = u - i, y = v - j;
    return ((t[0] * (1 - x) + t[1] * x) * (1 - y) +
            (t[FCT_LAMP_CELLS + 1] * (1 - x) + t[FCT_LAMP_CELLS + 2] * x) * y) /
           s;
}

/* Light of the whole lamp by its table. False if the lamp is too near or crosses the horizon. */
static bool light_far_lamp(const fct_lamp *lamp, const fct_receiver *rec, double *light) {
    v3 d = v3_sub(lamp->center, rec->x);
    double r2 = v3_norm2(d), height = v3_dot(d, rec->n);
    *light = 0;
    if (height <= -lamp->radius) return true;
    if (!lamp->table || height < lamp->radius) return false;
    double r = sqrt(r2), cosx = height / r;
    if (lamp->rms2 * (1 + 1 / cosx) > FAR_ERROR * r2) return false;
    *light = look_up_area(lamp->table, v3_scale(d, -1 / r)) * cosx / (FCT_PI * r2);
    return true;
}

double fct_lamp_estimate(const fct_lamp *lamp, const fct_receiver *rec) {
    v3 d = v3_sub(lamp->center, rec->x);
    double r2 = v3_norm2(d), height = v3_dot(d, rec->n), radius = lamp->radius;
    if (height <= -radius) return 0;
    double toward = -v3_dot(lamp->vector, d);
    /* A plane lights only the side of its front. */
    if (!lamp->table && !lamp->two_sided && toward <= -2e-3 * radius * lamp->area) return 0;
    if (r2 < .25 * radius * radius) return 1;
    /* A disk that faces the receiver gives A / (A + pi r^2) on its axis. */
    double r = sqrt(r2), cosx = fct_min((height + radius) / r, 1);
    double area = lamp->table ? look_up_area(lamp->table, v3_scale(d, -1 / r)) : fabs(toward) / r;
    area += .1 * lamp->area * fct_min(radius / r, 1);
    return area * cosx / (area + FCT_PI * r2);
}

void fct_lamp_cut(const fct_lamp *lamp, const fct_receiver *rec, fct_cut *cut) {
    const fct_tree_view *view = &lamp->view;
    double light, reference = fct_lamp_estimate(lamp, rec), share = SHARE_ERROR;
    cut->count = 0, cut->light = 0;
    if (view->root_count == 1 && light_far_lamp(lamp, rec, &light)) {
        if (light > 0) append_item(cut, view->roots[0], 1, light);
        return;
    }
    /* The estimate is the first reference. A cut with clusters that finds much less light repeats with a
     * smaller one. */
    for (int round = 0; round < 8 && reference > 0; ++round) {
        bool fits = true, coarse = false;
        cut->count = 0, cut->light = 0;
        for (uint32_t i = 0; i < view->root_count; ++i)
            fits = cut_tree(lamp, rec, view->roots[i], share * reference, reference, cut, &coarse) && fits;
        if (!fits) share *= 4;
        if (fits && (!coarse || cut->light >= .3 * reference)) break;
        if (fits) reference = cut->light < .2 * reference ? .2 * reference : cut->light;
    }
}

/* Weight of a cluster for shadow points: projected area, at least a tenth of the area, times the largest
 * cosine at the receiver over the squared distance. */
static double weigh_cluster(const fct_lamp *lamp, const fct_receiver *rec, const fct_cluster *c) {
    v3 d = v3_sub(v3_load(c->centroid), rec->x), half = v3_load(c->box_half);
    double radius = half.x + half.y + half.z, r2 = v3_norm2(d) + radius * radius;
    double top = v3_dot(d, rec->n) + radius;
    if (top <= 0) return 0;
    double r = sqrt(r2), toward = -v3_dot(v3_load(c->area_vector), d);
    double seen = lamp->two_sided ? fabs(toward) : fct_max(toward, 0);
    return (seen + .1 * c->area * r) * fct_min(top, r) / (r2 * r2);
}

/* Rough light of a node, for the choice between two children; positive unless the node sends nothing. */
static double weigh_node(const fct_lamp *lamp, const fct_receiver *rec, uint32_t node) {
    if (node < lamp->view.node_count) {
        fct_cluster room;
        return weigh_cluster(lamp, rec, fct_node_cluster(lamp->tree, node, &room));
    }
    v3 p[3];
    load_triangle(&lamp->view, node - lamp->view.node_count, p);
    for (int k = 0; k < 3; ++k) p[k] = v3_sub(p[k], rec->x);
    v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    double length = v3_norm(cross), height = -v3_dot(cross, p[0]);
    if (length == 0 || (height <= 0 && !lamp->two_sided)) return 0;
    v3 d = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3);
    double size2 = .5 * length, r2 = v3_norm2(d) + size2, top = -INFINITY;
    for (int k = 0; k < 3; ++k) top = fct_max(top, v3_dot(p[k], rec->n));
    return top > 0 ? .5 * fabs(height) * (top + .1 * sqrt(size2)) / (FCT_PI * r2 * r2) : 0;
}

/* Walks down to a leaf by the children's weights. *u in [0, 1) chooses and is stretched to [0, 1) again;
 * *chance is multiplied by the probability. Returns FCT_NONE if no child sends light. */
static uint32_t descend_to_leaf(const fct_lamp *lamp, const fct_receiver *rec, uint32_t node, double *u,
                                double *chance) {
    while (node < lamp->view.node_count) {
        const uint32_t child[2] = {fct_node_child(lamp->tree, node, 0), fct_node_child(lamp->tree, node, 1)};
        double left = weigh_node(lamp, rec, child[0]), right = weigh_node(lamp, rec, child[1]);
        if (!(left + right > 0)) return FCT_NONE;
        double p = left / (left + right);
        if (*u < p) {
            node = child[0], *u /= p, *chance *= p;
        } else {
            node = child[1], *u = (*u - p) / (1 - p), *chance *= 1 - p;
        }
        if (*u >= 1) *u = 0x1.fffffffffffffp-1;
    }
    return node;
}

/* Chooses an item in proportion to its light; u and chance as in descend_to_leaf. */
static uint32_t choose_item(const fct_cut *cut, double *u, double *chance) {
    double target = *u * cut->light, sum = 0;
    uint32_t i = 0;
    while (i + 1 < cut->count && sum + cut->items[i].light <= target) sum += cut->items[i++].light;
    *u = (target - sum) / cut->items[i].light;
    if (*u >= 1) *u = 0x1.fffffffffffffp-1;
    *chance = cut->items[i].light / cut->light;
    return i;
}

fct_lamp_point fct_cut_point(const fct_lamp *lamp, const fct_receiver *rec, const fct_cut *cut, double u,
                             double v) {
    fct_lamp_point out = {.place = FCT_NONE};
    if (cut->count == 0) return out;
    double chance;
    uint32_t i = choose_item(cut, &u, &chance);
    uint32_t leaf = descend_to_leaf(lamp, rec, cut->items[i].node, &u, &chance);
    if (leaf == FCT_NONE) return out;
    out.place = leaf - lamp->view.node_count;
    v3 p[3];
    load_triangle(&lamp->view, out.place, p);
    shrink_to_part(cut->items[i].part, p);
    /* The choice of the triangle has used up u. So v, which is still stratified, runs along the triangle,
     * from the corner opposite its shortest side. */
    double b[2], sides[3];
    for (int k = 0; k < 3; ++k) sides[k] = v3_norm2(v3_sub(p[(k + 2) % 3], p[(k + 1) % 3]));
    int tip = sides[0] <= sides[1] && sides[0] <= sides[2] ? 0 : sides[1] <= sides[2] ? 1 : 2;
    v3 e1 = v3_sub(p[(tip + 1) % 3], p[tip]), e2 = v3_sub(p[(tip + 2) % 3], p[tip]), cross = v3_cross(e1, e2);
    fct_triangle_point(v, u, b);
    out.y = v3_mad(v3_mad(p[tip], b[0], e1), b[1], e2);
    v3 d = v3_sub(out.y, rec->x);
    double r2 = v3_norm2(d), height = v3_dot(d, rec->n), toward = -v3_dot(cross, d);
    if (lamp->two_sided) toward = fabs(toward);
    if (height > 0 && toward > rec->slack * v3_norm(cross))
        out.weight = .5 * toward * height / (FCT_PI * r2 * r2 * chance);
    return out;
}

fct_receiver fct_lamp_receiver(const fct_lamp *lamp, const double point[3], const double normal[3]) {
    v3 x = v3_make(point[0], point[1], point[2]);
    fct_receiver rec = {.slack = lamp->rounding};
    double largest = fct_max(fabs(x.x), fct_max(fabs(x.y), fabs(x.z)));
    rec.slack += 4e-7 * largest / lamp->scale;
    const double *m = lamp->to_model;
    rec.x = v3_add(transform_vector(m, x), v3_make(m[3], m[7], m[11]));
    rec.n = v3_unit(transform_vector(m, v3_make(normal[0], normal[1], normal[2])));
    return rec;
}

/* A cluster of the table. */
typedef struct facet {
    v3 vector;
    double area, moment[6];
} facet;

typedef struct table_work {
    const fct_lamp *lamp;
    const facet *facets;
    uint32_t count;
} table_work;

/* Fills entries [begin, end): the mean of both bounds of the projected area, summed over clusters, in the
 * direction of an entry's point on the cube. */
static void fill_table(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const table_work *work = user;
    const int side = FCT_LAMP_CELLS + 1;
    for (size_t k = begin; k < end; ++k) {
        int face = (int)k / (side * side), j = (int)k / side % side, i = (int)k % side, axis = face / 2;
        double d[3], sum = 0;
        d[axis] = face & 1 ? -1 : 1;
        d[(axis + 1) % 3] = 2. * i / FCT_LAMP_CELLS - 1;
        d[(axis + 2) % 3] = 2. * j / FCT_LAMP_CELLS - 1;
        v3 w = v3_make(d[0], d[1], d[2]);
        for (uint32_t n = 0; n < work->count; ++n) {
            const facet *f = work->facets + n;
            double toward = v3_dot(f->vector, w),
                   cross = sqrt(fct_max(sym3_form(f->moment, w, w), 0) * f->area);
            double upper = work->lamp->two_sided ? cross : fct_max(.5 * (cross + toward), 0);
            double lower = work->lamp->two_sided ? fabs(toward) : fct_max(toward, 0);
            sum += .5 * (lower + upper);
        }
        work->lamp->table[k] = sum;
    }
}

static fct_result make_table(const fct_env *env, fct_lamp *lamp) {
    fct_result result = FCT_OK;
    uint32_t count = lamp->view.face_count < TABLE_CLUSTERS ? lamp->view.face_count : TABLE_CLUSTERS;
    if (count < lamp->view.root_count) count = lamp->view.root_count;
    uint32_t *nodes = fct_allocate(env, count, sizeof *nodes);
    facet *facets = fct_allocate(env, count, sizeof *facets);
    lamp->table = fct_allocate(env, FCT_LAMP_TABLE, sizeof *lamp->table);
    if (!nodes || !facets || !lamp->table) {
        result = fct_fail_memory(env, "a lamp's projected areas");
        goto done;
    }
    table_work work = {.lamp = lamp, .facets = facets};
    result = fct_tree_partition(env, lamp->tree, count, nodes, &work.count);
    if (result != FCT_OK) goto done;
    for (uint32_t i = 0; i < work.count; ++i) {
        fct_cluster room;
        const fct_cluster *c = fct_node_cluster(lamp->tree, nodes[i], &room);
        facets[i] = (facet){.vector = v3_load(c->area_vector), .area = c->area};
        for (int k = 0; k < 6; ++k) facets[i].moment[k] = c->moment[k];
    }
    fct_parallel_for(env, FCT_LAMP_TABLE, 8, fill_table, &work);
done:
    fct_release(env, nodes);
    fct_release(env, facets);
    return result;
}

/* Area, area vector, centroid, radius and rounding, from the roots. */
static void measure_lamp(fct_lamp *lamp) {
    double area = 0, largest = 0;
    v3 center = {0, 0, 0}, vector = {0, 0, 0};
    fct_cluster room;
    for (uint32_t i = 0; i < lamp->view.root_count; ++i) {
        const fct_cluster *c = fct_node_cluster(lamp->tree, lamp->view.roots[i], &room);
        area += c->area;
        center = v3_mad(center, c->area, v3_load(c->centroid));
        vector = v3_add(vector, v3_load(c->area_vector));
    }
    lamp->area = area;
    lamp->vector = vector;
    lamp->center = area > 0 ? v3_scale(center, 1 / area) : center;
    for (uint32_t i = 0; i < lamp->view.root_count; ++i) {
        const fct_cluster *c = fct_node_cluster(lamp->tree, lamp->view.roots[i], &room);
        v3 middle = v3_load(c->box_center);
        double half2 = v3_norm2(v3_load(c->box_half)), away2 = v3_norm2(v3_sub(middle, lamp->center));
        lamp->radius = fct_max(lamp->radius, sqrt(half2) + sqrt(away2));
        lamp->rms2 += area > 0 ? c->area / area * (half2 / 3 + away2) : 0;
        largest = fct_max(largest, v3_norm(middle) + sqrt(half2));
    }
    lamp->rounding = 4e-7 * largest;
    const double *t = lamp->to_world;
    lamp->rounding += 4e-7 * fct_max(fabs(t[3]), fct_max(fabs(t[7]), fabs(t[11]))) / lamp->scale;
}

/* Builds a tree of the lamp in world space. */
static fct_result make_own_tree(const fct_env *env, const fct_instance *placed, fct_lamp *lamp) {
    fct_mesh mesh;
    fct_result result = fct_tree_mesh(env, lamp->tree, &mesh);
    if (result != FCT_OK) return result;
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * v;
        v3_store(p, fct_transform_point(placed->to_world, v3_load(p)));
    }
    for (size_t f = 0; placed->mirrored && f < mesh.face_count; ++f) {
        uint32_t *t = mesh.triangles + 3 * f, swap = t[1];
        t[1] = t[2], t[2] = swap;
    }
    fct_tree_def def = fct_tree_def_default();
    result = fct_tree_build(env, &mesh, &def, NULL, &lamp->own);
    fct_mesh_release(env, &mesh);
    lamp->tree = lamp->own;
    return result;
}

fct_result fct_lamp_init(const fct_env *env, const fct_scene_view *scene, uint32_t instance, fct_lamp *out) {
    const fct_instance *placed = scene->instances + instance;
    const fct_material *material = scene->materials + placed->material;
    fct_result result = FCT_OK;
    *out = (fct_lamp){.instance = instance,
                      .two_sided = material->two_sided,
                      .tree = scene->models[placed->model].tree,
                      .to_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                      .to_model = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                      .scale = 1};
    for (int k = 0; k < 3; ++k) out->strength += out->emission[k] = material->emission[k];
    if (placed->uniform_scale > 0) {
        fct_instance unused;
        for (int k = 0; k < 12; ++k) out->to_world[k] = placed->to_world[k];
        fct_transform_set(placed->to_world, &unused, out->to_model);
        out->scale = placed->uniform_scale;
    } else {
        result = make_own_tree(env, placed, out);
    }
    if (result != FCT_OK) return result;
    out->view = fct_tree_get(out->tree);
    measure_lamp(out);
    bool planar = v3_norm(out->vector) > (1 - 1e-6) * out->area;
    if (!planar && out->area > 0) result = make_table(env, out);
    if (result != FCT_OK) fct_lamp_release(env, out);
    return result;
}

void fct_lamp_release(const fct_env *env, fct_lamp *lamp) {
    fct_tree_destroy(lamp->own);
    fct_release(env, lamp->table);
    *lamp = (fct_lamp){0};
}
