/* simplify/view/cut.c: see cut.h.
 *
 * 1. From the root of the tree down, mark the steps that the view wants. If it does not want a step, it wants
 *    none below it, because their bounds are inside.
 * 2. Mark what marked steps need.
 * 3. Split and contract. Mark what faces need that fold over, and repeat until none does.
 */
#include "simplify/view/cut.h"

#include <math.h>
#include <string.h>

/* Cosine of 45 degrees: faces that turn less from the finest level never count as folded over. */
#define MOST_TURN  .7071
#define TURN_SLACK 1e-6

static bool is_outside(const fct_cut_view *view, v3 center, double radius) {
    double z = v3_dot(view->forward, center);
    const double places[2] = {fabs(v3_dot(view->right, center)), fabs(v3_dot(view->up, center))};
    bool outside = z < -radius;
    for (int i = 0; i < 2; ++i) {
        double slope = view->slopes[i];
        outside |= places[i] - slope * z > radius * sqrt(1 + slope * slope);
    }
    return outside;
}

/* The sign of n . (x - eye) for all normals n and all points x of the sphere: 1: all faces are seen from
 * behind, -1: all from the front, 0: neither, a silhouette. */
static int find_side(const fct_bound *bound, v3 center) {
    const double c[3] = {center.x, center.y, center.z};
    double least = 0, most = 0; /* n . (center - eye) */
    for (int k = 0; k < 3; ++k) {
        double a = (double)bound->low[k] * c[k], b = (double)bound->high[k] * c[k];
        least += fct_min(a, b), most += fct_max(a, b);
    }
    double radius = (double)bound->radius;
    return least > radius ? 1 : most < -radius ? -1 : 0;
}

/* The most pixels per length anywhere in the sphere and in the picture: at depth z, seen at angle a from the
 * middle, a length has up to focal / (z cos a) pixels. */
static double find_scale(const fct_cut_view *view, const fct_bound *bound, v3 center, double distance) {
    double radius = (double)bound->radius, z = v3_dot(view->forward, center), near = distance - radius;
    double depth = fct_max(z - radius, near / view->secant);
    double sine = radius / distance, cosine = fct_min(z / distance, 1);
    double farthest =
        cosine * sqrt(1 - sine * sine) - sine * sqrt(fct_max(1 - cosine * cosine, 0)); /* its cosine */
    double secant = farthest * view->secant > 1 ? 1 / farthest : view->secant;
    return view->focal * secant / depth;
}

fct_cut_error fct_cut_measure(const fct_cut_view *view, const fct_bound *bound) {
    v3 center = v3_sub(v3_load(bound->center), view->eye);
    double radius = (double)bound->radius, distance = v3_norm(center), scale = INFINITY;
    bool near = !(distance > radius), outside = is_outside(view, center, radius);
    int side = find_side(bound, center);
    fct_cut_error e = {.limit = side == 0 ? view->silhouette_tolerance : view->tolerance};
    if (side > 0) e.limit *= view->back_factor;
    if (outside) e.limit *= view->outside_factor;
    if (!(e.limit >= 0)) e.limit = 0; /* 0 times infinity */
    if (!near)
        scale = outside ? view->focal / (distance - radius) : find_scale(view, bound, center, distance);
    e.pixels = bound->error > 0 ? scale * (double)bound->error : 0;
    e.extent = radius > 0 ? 2 * scale * radius : 0;
    e.hidden = outside || side > 0;
    return e;
}

static bool exceeds_limit(const fct_cut_view *view, const fct_bound *bound, const fct_cut_error *e) {
    if (!(e->limit < INFINITY)) return false;
    return !(e->pixels < e->limit) || ((double)bound->color > view->color_tolerance && e->extent > e->limit);
}

bool fct_cut_wants(const fct_cut_view *view, const fct_bound *bound) {
    fct_cut_error e = fct_cut_measure(view, bound);
    return exceeds_limit(view, bound, &e);
}

static bool has_step(const uint64_t *bits, uint32_t step) {
    return bits[step / 64] >> step % 64 & 1;
}

static void add_step(uint64_t *bits, uint32_t step) {
    bits[step / 64] |= (uint64_t)1 << step % 64;
}

typedef struct marker {
    const fct_progressive *m;
    fct_hierarchy *h;
    const fct_cut_view *view;
    fct_view_stats *stats;
    uint32_t stack_count, tested_count;
} marker;

static void mark_step(marker *k, uint32_t step) {
    add_step(k->h->wanted, step);
    ++k->stats->splits;
}

/* Marks a step that is not wanted itself. */
static void force_step(marker *k, uint32_t step) {
    fct_hierarchy *h = k->h;
    mark_step(k, step);
    add_step(h->forced, step);
    ++k->stats->forced;
    for (uint32_t c = h->first_children[step]; c != FCT_NONE; c = h->siblings[c])
        h->tested[k->tested_count++] = c;
}

static void push_step(marker *k, uint32_t step) {
    k->h->stack[k->stack_count++] = step;
}

/* Marks what the view wants, and lists the tested steps that it does not want. */
static void mark_wanted(marker *k) {
    fct_hierarchy *h = k->h;
    size_t size = (h->step_count / 64 + 1) * sizeof *h->wanted;
    memset(h->wanted, 0, size);
    memset(h->forced, 0, size);
    memset(h->strict, 0, size);
    add_step(h->wanted, 0);
    add_step(h->strict, 0);
    push_step(k, 0);
    while (k->stack_count) {
        uint32_t step = h->stack[--k->stack_count];
        for (uint32_t c = h->first_children[step]; c != FCT_NONE; c = h->siblings[c]) {
            ++k->stats->tested;
            if (fct_cut_wants(k->view, &h->bounds[c])) {
                mark_step(k, c);
                push_step(k, c);
            } else
                h->tested[k->tested_count++] = c;
        }
    }
}

/* Marks what marked steps need: earlier ones, so one pass from the last step to the first is enough. */
static void mark_needs(marker *k) {
    const fct_hierarchy *h = k->h;
    for (uint32_t i = h->step_count / 64 + 1; i-- > 0;)
        for (uint64_t left = h->wanted[i], below; left; left = h->wanted[i] & below) {
            uint32_t bit = 63 - (uint32_t)__builtin_clzll(left), step = 64 * i + bit;
            below = ((uint64_t)1 << bit) - 1;
            if (step == 0) break;
            for (uint32_t n = h->first_needs[step]; n < h->first_strict[step]; ++n)
                if (!has_step(h->wanted, h->needs[n])) force_step(k, h->needs[n]);
        }
}

/* Contracts from the last step to the first, then splits from the first to the last: steps that others need
 * are done before them and undone after them. */
static void move_cut(const marker *k) {
    fct_hierarchy *h = k->h;
    uint32_t words = h->step_count / 64 + 1;
    for (uint32_t i = words; i-- > 0;)
        for (uint64_t left = h->done[i] & ~h->wanted[i]; left; ++k->stats->undone) {
            uint32_t bit = 63 - (uint32_t)__builtin_clzll(left);
            left ^= (uint64_t)1 << bit;
            fct_progressive_contract(k->m, 64 * i + bit, h->triangles, h->nodes);
        }
    for (uint32_t i = 0; i < words; ++i) {
        for (uint64_t left = h->wanted[i] & ~h->done[i]; left; left &= left - 1, ++k->stats->done)
            fct_progressive_split(k->m, 64 * i + (uint32_t)__builtin_ctzll(left), h->triangles, h->nodes);
        h->done[i] = h->wanted[i];
    }
}

/* Whether a face turns further from its direction at the finest level than at all levels, and by more than
 * MOST_TURN. */
static bool folds_over(const marker *k, uint32_t f) {
    const fct_face_turn *turn = &k->h->turns[f];
    v3 p[3], normal = v3_load(turn->normal);
    for (uint32_t i = 0; i < 3; ++i)
        p[i] = v3_load(k->m->positions + 3 * (size_t)k->h->nodes[k->h->triangles[3 * (size_t)f + i]]);
    v3 cross = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    double least = fct_min((double)turn->cosine - TURN_SLACK, MOST_TURN);
    return !(v3_dot(cross, normal) >= least * v3_norm(cross)) || (least > 0 && v3_norm2(cross) == 0);
}

/* The last step that has changed a face: the one that made its latest node. */
static uint32_t find_last_change(const marker *k, uint32_t f) {
    uint32_t latest = 0, low = 0, high = k->m->step_count - 1;
    for (uint32_t i = 0; i < 3; ++i) {
        uint32_t node = k->h->nodes[k->h->triangles[3 * (size_t)f + i]];
        latest = node > latest ? node : latest;
    }
    while (low < high) {
        uint32_t middle = high - (high - low) / 2;
        if (k->m->step_nodes[middle] <= latest)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

/* Marks all that a step strictly needs. Returns whether something was not marked. */
static bool mark_strictly(marker *k, uint32_t step) {
    fct_hierarchy *h = k->h;
    uint32_t before = k->stats->splits;
    if (has_step(h->strict, step)) return false;
    add_step(h->strict, step);
    push_step(k, step);
    while (k->stack_count) {
        uint32_t s = h->stack[--k->stack_count];
        for (uint32_t i = h->first_needs[s]; i < h->first_needs[s + 1]; ++i) {
            uint32_t needed = h->needs[i];
            if (has_step(h->strict, needed)) continue;
            add_step(h->strict, needed);
            push_step(k, needed);
            if (!has_step(h->wanted, needed)) force_step(k, needed);
        }
    }
    return k->stats->splits > before;
}

/* Marks what the faces need that fold over. Returns whether something was not marked. */
static bool mark_folds(marker *k) {
    const fct_progressive *m = k->m;
    bool more = false;
    for (uint32_t i = 0; i < k->h->step_count / 64 + 1; ++i)
        for (uint64_t left = k->h->done[i]; left; left &= left - 1) {
            uint32_t step = 64 * i + (uint32_t)__builtin_ctzll(left);
            for (uint32_t f = m->step_faces[step]; f < m->step_faces[step + 1]; ++f)
                if (folds_over(k, f)) more |= mark_strictly(k, find_last_change(k, f));
        }
    return more;
}

/* The largest errors of steps that are not done. Each is inside the bounds of its ancestors, so those that
 * the view does not want limit it as well. */
static void find_errors(const marker *k) {
    const fct_hierarchy *h = k->h;
    for (uint32_t i = 0; i < k->tested_count; ++i) {
        uint32_t step = h->tested[i];
        if (has_step(h->wanted, step)) continue;
        k->stats->error = fct_max((double)h->bounds[step].error, k->stats->error);
        fct_cut_error e = fct_cut_measure(k->view, &h->bounds[step]);
        for (step = h->parents[step]; has_step(h->forced, step) && !e.hidden; step = h->parents[step]) {
            fct_cut_error above = fct_cut_measure(k->view, &h->bounds[step]);
            e.pixels = fct_min(e.pixels, above.pixels);
            e.hidden = above.hidden;
        }
        if (!e.hidden) k->stats->pixels = fct_max(e.pixels, k->stats->pixels);
    }
}

void fct_cut_move(const fct_progressive *m, fct_hierarchy *h, const fct_cut_view *view,
                  fct_view_stats *stats) {
    marker k = {.m = m, .h = h, .view = view, .stats = stats};
    mark_wanted(&k);
    mark_needs(&k);
    do move_cut(&k);
    while (mark_folds(&k));
    find_errors(&k);
}
