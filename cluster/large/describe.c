/* cluster/large/describe.c: attributes and boxes of the upper nodes of a large mesh.
 *
 * Sums are added from the tops upwards. A cluster of at most FCT_BLOCK faces is described from its faces. For
 * a larger one, a search finds the extents along each axis and the widest normal: it starts with a sample of
 * faces and opens only clusters whose box or cone reaches beyond the result so far. It skips a box that adds
 * less than the resolution of floats, and a cone that adds less than 1/1000 radian. The final box and cone
 * grow by the same amount, so they contain every vertex and every normal.
 */
#include <string.h>

#include "base/math/elementary.h"
#include "cluster/large/lookup.h"
#include "cluster/shape/box.h"
#include "cluster/shape/cone.h"

enum {
    SAMPLES = 64,   /* faces per large cluster */
    STACK = 512,    /* clusters waiting in a search; beyond that, boxes and cones count as they are */
    MOST = 1 << 18, /* opened clusters per search; beyond that, boxes count as they are */
    HARD = 1 << 11, /* opened clusters from which on fit_box tries two frames only */
    FRAMES = 4      /* candidates: principal axes of the samples, the world's, the two children's */
};

typedef struct block_faces {
    fct_octet_row corners[3 * FCT_BLOCK];
    float normals[FCT_BLOCK][4];
} block_faces;

typedef struct describer {
    fct_large *large;
    fct_lookup lookup;
    fct_sums *tops, *upper; /* per top, per upper node */
    block_faces *faces;
} describer;

/* An upper node, or a node of a part. */
typedef struct place {
    const fct_part *part; /* NULL for an upper node */
    uint32_t node;
} place;

static place child_of_upper(const describer *d, uint32_t child) {
    const fct_large *l = d->large;
    if (child < l->upper_count) return (place){NULL, child};
    const fct_top *top = &l->all_tops[child - l->upper_count];
    return (place){&l->parts[top->part], top->node};
}

/* The cluster's record. NULL for a face and after an error. */
static const fct_cluster *cluster_at(describer *d, place p) {
    if (!p.part) return &d->large->upper[p.node];
    return p.node < p.part->node_count ? fct_lookup_node(&d->lookup, p.part, p.node) : NULL;
}

static bool is_face(place p) {
    return p.part && p.node >= p.part->node_count;
}

static void push_children(const describer *d, place p, const uint32_t child[2], place *stack, uint32_t *top) {
    for (int k = 1; k >= 0; --k)
        stack[(*top)++] = p.part ? (place){p.part, child[k]} : child_of_upper(d, child[k]);
}

/* Index in top_order of the top whose range contains the place. */
static uint32_t top_at(const fct_large *l, uint32_t at) {
    uint32_t low = 0, high = l->top_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (l->top_places[middle] <= at)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Corners of the face at a place of the whole tree. */
static bool face_at(describer *d, uint32_t at, float corners[9]) {
    const fct_large *l = d->large;
    uint32_t i = top_at(l, at);
    const fct_top *top = &l->all_tops[l->top_order[i]];
    return fct_lookup_face(&d->lookup, &l->parts[top->part], top->first + (at - l->top_places[i]), corners);
}

/* --- Small clusters --- */

static bool load_block(describer *d, uint32_t first, uint32_t count) {
    static const uint32_t triangle[3] = {0, 1, 2};
    for (uint32_t i = 0; i < count; ++i) {
        float corners[9], normal[3];
        if (!face_at(d, first + i, corners)) return false;
        for (uint32_t k = 0; k < 3; ++k) fct_octet_row_fill(&d->faces->corners[3 * i + k], corners + 3 * k);
        fct_unit_normal(corners, triangle, normal);
        memcpy(d->faces->normals[i], normal, sizeof normal);
    }
    return true;
}

static bool describe_block(describer *d, uint32_t root) {
    fct_large *l = d->large;
    uint32_t stack[FCT_BLOCK], top = 0, first = l->upper[root].first;
    const block_faces *f = d->faces;
    if (!load_block(d, first, l->upper[root].count)) return false;
    stack[top++] = root;
    while (top > 0) {
        uint32_t node = stack[--top];
        fct_cluster *c = &l->upper[node];
        fct_points_describe(f->corners + 3 * (c->first - first), 3 * c->count, f->normals[c->first - first],
                            c->count, &d->upper[node], c);
        for (int k = 0; k < 2; ++k)
            if (c->child[k] < l->upper_count) stack[top++] = c->child[k];
    }
    return true;
}

/* --- Extents of large clusters --- */

typedef struct search {
    fct_extents extents;
    double axes[3][3];
    double slack; /* rounding of floats of this size */
} search;

/* Extends the extents by a vertex. */
static void take_corner(search *s, const float *p) {
    for (int k = 0; k < 3; ++k) {
        double x = (double)p[0] * s->axes[k][0] + (double)p[1] * s->axes[k][1] + (double)p[2] * s->axes[k][2];
        if (x < s->extents.low[k]) s->extents.low[k] = x;
        if (x > s->extents.high[k]) s->extents.high[k] = x;
    }
}

/* Whether the cluster's box reaches beyond the extents. If `take`, also extends them by the box. */
static bool reaches(search *s, const fct_cluster *c, bool take) {
    fct_box box;
    bool beyond = false;
    fct_cluster_box(c, &box);
    for (int k = 0; k < 3; ++k) {
        const double *a = s->axes[k];
        double middle = 0, reach = 0;
        for (int i = 0; i < 3; ++i) {
            middle += (double)box.center[i] * a[i];
            reach +=
                (double)box.half[i] * fabs((double)box.axes[i][0] * a[0] + (double)box.axes[i][1] * a[1] +
                                           (double)box.axes[i][2] * a[2]);
        }
        beyond |=
            middle + reach > s->extents.high[k] + s->slack || middle - reach < s->extents.low[k] - s->slack;
        if (!take) continue;
        s->extents.low[k] = fmin(s->extents.low[k], middle - reach);
        s->extents.high[k] = fmax(s->extents.high[k], middle + reach);
    }
    return beyond;
}

static bool find_extents(describer *d, uint32_t node, const float samples[][9], const float axes[3][3],
                         fct_extents *out, bool *hard) {
    search s = {.extents = fct_extents_none()};
    place stack[STACK];
    uint32_t top = 0, opened = 0;
    double size = 0;
    for (int k = 0; k < 9; ++k) s.axes[k / 3][k % 3] = (double)axes[k / 3][k % 3];
    for (int i = 0; i < SAMPLES; ++i)
        for (int k = 0; k < 3; ++k) take_corner(&s, samples[i] + 3 * k);
    for (int k = 0; k < 3; ++k) size = fmax(size, fmax(fabs(s.extents.low[k]), fabs(s.extents.high[k])));
    s.slack = 0x1p-22 * size;
    push_children(d, (place){NULL, node}, d->large->upper[node].child, stack, &top);
    while (top > 0) {
        place p = stack[--top];
        if (is_face(p)) {
            float corners[9];
            if (!fct_lookup_face(&d->lookup, p.part, p.node - p.part->node_count, corners)) return false;
            for (int k = 0; k < 3; ++k) take_corner(&s, corners + 3 * k);
            continue;
        }
        const fct_cluster *c = cluster_at(d, p);
        if (!c) return false;
        bool close = opened >= MOST || top + 2 > STACK;
        if (!reaches(&s, c, close) || close) continue;
        ++opened;
        uint32_t child[2] = {c->child[0], c->child[1]};
        push_children(d, p, child, stack, &top);
    }
    for (int k = 0; k < 3; ++k) s.extents.low[k] -= s.slack, s.extents.high[k] += s.slack;
    *out = s.extents;
    *hard |= opened > HARD;
    return true;
}

static void rotation_of(describer *d, place p, float rotation[4]) {
    static const float world[4] = {0, 0, 0, 1};
    const fct_cluster *c = is_face(p) ? NULL : cluster_at(d, p);
    memcpy(rotation, c ? c->box_rotation : world, sizeof world);
}

static bool fit_box(describer *d, uint32_t node, const float samples[][9]) {
    static const float world[4] = {0, 0, 0, 1};
    fct_cluster *c = &d->large->upper[node];
    float rotations[FRAMES][4], axes[FRAMES][3][3];
    fct_extents extents[FRAMES];
    int best = 0;
    memcpy(rotations[0], c->box_rotation, sizeof rotations[0]);
    memcpy(rotations[1], world, sizeof world);
    for (int k = 0; k < 2; ++k) rotation_of(d, child_of_upper(d, c->child[k]), rotations[2 + k]);
    bool hard = false; /* thousands of clusters tie for the farthest point, so try two frames only */
    for (int f = 0; f < FRAMES && !(hard && f > 1); ++f) {
        fct_box_axes(rotations[f], axes[f]);
        if (!find_extents(d, node, samples, (const float(*)[3])axes[f], &extents[f], &hard)) return false;
        if (fct_box_area(&extents[f]) < fct_box_area(&extents[best])) best = f;
    }
    v3 point = v3_load(samples[0]);
    memcpy(c->box_rotation, rotations[best], sizeof c->box_rotation);
    if (fct_box_set(&extents[best], (const float(*)[3])axes[best], point, c)) return true;
    memcpy(c->box_rotation, world, sizeof world);
    fct_box_set(&extents[1], (const float(*)[3])axes[1], point, c);
    return true;
}

/* --- Cones of large clusters --- */

static double angle_between(v3 a, v3 b) {
    return 2 * fct_asin(fmin(0.5 * v3_norm(v3_sub(a, b)), 1));
}

static bool find_cone(describer *d, uint32_t node, const float samples[][9]) {
    enum { FEW = 1 << 12 };
    const double pi = 3.14159265358979, slack = 1e-3;
    static const uint32_t triangle[3] = {0, 1, 2};
    fct_cluster *c = &d->large->upper[node];
    v3 axis = v3_unit(v3_load(c->area_vector));
    double widest = 0;
    uint32_t top = 0, opened = 0;
    place stack[STACK];
    c->cone_angle = fct_cone_angle(4);
    if (v3_norm2(axis) == 0) return true;
    float normal[3];
    for (int i = 0; i < SAMPLES; ++i) {
        fct_unit_normal(samples[i], triangle, normal);
        if (!isnan(normal[0])) widest = fmax(widest, angle_between(v3_load(normal), axis));
    }
    push_children(d, (place){NULL, node}, c->child, stack, &top);
    while (top > 0) {
        place p = stack[--top];
        if (is_face(p)) {
            float corners[9];
            if (!fct_lookup_face(&d->lookup, p.part, p.node - p.part->node_count, corners)) return false;
            fct_unit_normal(corners, triangle, normal);
            if (!isnan(normal[0])) widest = fmax(widest, angle_between(v3_load(normal), axis));
            continue;
        }
        const fct_cluster *below = cluster_at(d, p);
        if (!below) return false;
        v3 own = v3_unit(v3_load(below->area_vector));
        double reach = angle_between(own, axis) + (double)below->cone_angle; /* above pi where S is 0 */
        if (fmin(reach, pi) <= widest + slack) continue;
        if (++opened > FEW || top + 2 > STACK) {
            widest = fmin(reach, pi);
            continue;
        }
        uint32_t child[2] = {below->child[0], below->child[1]};
        push_children(d, p, child, stack, &top);
    }
    widest = fmin(widest + slack, pi);
    double chord = 2 * fct_sin(0.5 * widest);
    c->cone_angle = fct_cone_angle(nextafterf((float)(chord * chord), 5));
    return true;
}

/* --- All --- */

/* Sets all attributes from sums and samples, then replaces box and cone by those of the whole cluster. */
static bool describe_large(describer *d, uint32_t node) {
    static const uint32_t triangle[3] = {0, 1, 2};
    fct_cluster *c = &d->large->upper[node];
    fct_octet_row corners[SAMPLES];
    float samples[SAMPLES][9], normals[SAMPLES][4];
    for (uint32_t i = 0; i < SAMPLES; ++i) {
        uint32_t at = c->first + (uint32_t)((uint64_t)i * c->count / SAMPLES);
        if (!face_at(d, at, samples[i])) return false;
        fct_octet_row_fill(&corners[i], samples[i] + 3 * (i % 3));
        fct_unit_normal(samples[i], triangle, normals[i]);
        normals[i][3] = 0;
    }
    fct_points_describe(corners, SAMPLES, normals[0], SAMPLES, &d->upper[node], c);
    return fit_box(d, node, (const float(*)[9])samples) && find_cone(d, node, (const float(*)[9])samples);
}

static void sum_up(describer *d) {
    const fct_large *l = d->large;
    for (uint32_t i = l->upper_count; i-- > 0;) {
        const fct_sums *parts[2];
        for (int k = 0; k < 2; ++k) {
            uint32_t child = l->upper[i].child[k];
            parts[k] = child < l->upper_count ? &d->upper[child] : &d->tops[child - l->upper_count];
        }
        fct_sums_join(parts[0], parts[1], &d->upper[i]);
    }
}

/* Lists all nodes larger than a block, and the topmost node of each block, in preorder. Returns their number.
 */
static uint32_t list_nodes(const fct_large *l, uint32_t *order, uint32_t *stack) {
    uint32_t count = 0, top = 0;
    if (l->upper_count > 0) stack[top++] = 0;
    while (top > 0) {
        uint32_t node = stack[--top];
        const fct_cluster *c = &l->upper[node];
        order[count++] = node;
        for (int k = 1; k >= 0 && c->count > FCT_BLOCK; --k)
            if (c->child[k] < l->upper_count) stack[top++] = c->child[k];
    }
    return count;
}

/* In reverse preorder, so that parents find in the caches what their children have read. */
static fct_result describe_all(describer *d, uint32_t *order, uint32_t *stack) {
    fct_large *l = d->large;
    sum_up(d);
    uint32_t count = list_nodes(l, order, stack);
    for (uint32_t i = count; i-- > 0;) {
        bool small = l->upper[order[i]].count <= FCT_BLOCK;
        if (!(small ? describe_block(d, order[i]) : describe_large(d, order[i])))
            return fct_lookup_result(&d->lookup);
        if (i % 1024 == 0) {
            fct_result result = fct_progress(l->env, "boxes of joins", 1 - (double)i / count);
            if (result != FCT_OK) return result;
        }
    }
    return FCT_OK;
}

fct_result fct_large_describe(fct_large *large) {
    const fct_env *env = large->env;
    double start = fct_seconds();
    describer d = {.large = large};
    d.tops = fct_allocate(env, large->top_count, sizeof *d.tops);
    d.upper = fct_allocate(env, large->upper_count, sizeof *d.upper);
    d.faces = fct_allocate(env, 1, sizeof *d.faces);
    uint32_t *order = fct_allocate(env, large->upper_count, sizeof *order);
    uint32_t *stack = fct_allocate(env, large->upper_count, sizeof *stack);
    size_t used = (size_t)large->top_count * 600; /* bytes per top: tops, upper nodes and their sums */
    fct_result result;
    if (!d.tops || !d.upper || !d.faces || !order || !stack)
        result = fct_fail_memory(env, "boxes");
    else
        result = fct_lookup_open(large, large->budget > used ? (large->budget - used) / 2 : 0, &d.lookup);
    if (result == FCT_OK) result = fct_spool_read(&large->sums, 0, d.tops, large->top_count * sizeof *d.tops);
    if (result == FCT_OK) result = describe_all(&d, order, stack);
    fct_lookup_close(&d.lookup);
    fct_release(env, d.tops);
    fct_release(env, d.upper);
    fct_release(env, d.faces);
    fct_release(env, order);
    fct_release(env, stack);
    fct_spool_close(&large->sums);
    large->seconds_boxes += fct_seconds() - start;
    return result;
}
