/* simplify/refit.c: see refit.h. Each pass:
 *
 * 1. Samples are the corners (1/12 of the face's area) and centroids (3/4) of the input's faces. Each finds
 *    the nearest point of the faces around the points that its corners were contracted to.
 * 2. Each point takes one damped least-squares step along the directions to its samples. Each attribute takes
 *    a step towards their values. Steps that would fold a face over are left out, and those that would take
 *    the point too far from the input are made shorter.
 * The search is parallel. The sums run in the order of the samples, so the result does not depend on the
 * threads. Cost of a pass: O(samples * valence).
 */
#include "simplify/refit.h"

#include "base/parallel.h"
#include "simplify/cost/constraint.h"
#include "simplify/cost/nearest.h"
#include "simplify/topology/remain.h"
#include "simplify/topology/ring.h"

/* The fraction of a least-squares step that a point takes: half, because its neighbours move too. */
#define STEP .5
/* Added to the diagonal of a point's system, times its trace, so that no point slides along the surface. With
 * a far smaller value points move far away from it. */
#define DAMPING .1
/* The weight of the planes that hold a point, relative to their weight in a contraction. With 1, E_avg is 3 %
 * larger at a hundredth of the faces, and boundaries are as close. */
#define PLANES .1
/* The longest step, in lengths of the shortest edge at the point. */
#define MAX_STEP .5
/* A point may be as far from the input as this times the root mean square distance of its own samples, or as
 * this part of the distance of the farthest point. With 2 and 3, E_max is up to 1.08 and 1.20 times as large
 * as without a refit, and E_avg .67 and .65 times. */
#define OWN_REACH   2.5
#define POINT_REACH .5
/* Shorter distances, in the unit cube, are rounding errors of the input's floats. */
#define NOISE 1e-7
/* A barycentric weight above this counts as positive. */
#define RIM 1e-6
/* Quadrature over a face, exact for polynomials of degree 2: the centroid weighs 3/4 of the area, each corner
 * 1/12. */
#define CENTROID_WEIGHT .75
#define CORNER_DIVISOR  12

enum {
    CHUNK = 1024,    /* items per parallel task */
    MAX_WALK = 4,    /* steps from ring to ring */
    MAX_HALVINGS = 3 /* of a step that goes too far */
};

/* The nearest point of a sample: a + u ab + v ac of the target. */
typedef struct landing {
    uint32_t target; /* FCT_NONE: there is none */
    bool attributes; /* the target is on the sample's side of a seam, so its attributes count */
    float u, v;
} landing;

typedef struct ring_entry {
    uint32_t corner, target;
} ring_entry;

/* A live face, prepared for the search. */
typedef struct target {
    triangle shape;
    v3 n; /* unit normal */
    uint32_t face;
} target;

/* What limits the step of a point. */
typedef struct reach {
    double residual2; /* the mean squared distance of its samples from the surface, times `weight` */
    double weight;
    double nearest2;  /* the smallest squared distance of the point from a centroid among its samples */
    uint32_t nearest; /* the face of this centroid in the input; it stands for the input near the point */
} reach;

typedef struct refit {
    fct_simplifier *s;
    uint32_t *corners;      /* per wedge of the input: one of its corners, or FCT_NONE */
    double *corner_weights; /* per wedge of the input */
    landing *landings;      /* per sample: first the wedges of the input, then its faces */
    target *targets;        /* the live faces */
    ring_entry *rings;      /* the corners at each point, point after point */
    uint32_t *ring_ends;    /* per point: end of its part of `rings`, which holds `valence` entries */
    double (*systems)[9];   /* per point: xx xy xz yy yz zz of the matrix, then the right side */
    double *sums;           /* per wedge and channel: weighted residuals */
    double *weights;        /* per wedge */
    reach *reaches;         /* per point */
} refit;

/* Updates *best and *out by the faces around a point. Faces on the wedge's side of a seam take precedence
 * over nearer faces on another side. Hubs are skipped. */
static void search_ring(const refit *r, uint32_t point, uint32_t wedge, v3 p, foot *best, landing *out) {
    const fct_simplifier *s = r->s;
    if (s->valences[point] > SIMPLIFY_HUB) return;
    uint32_t end = r->ring_ends[point];
    for (uint32_t i = end - s->valences[point]; i < end; ++i) {
        const target *t = &r->targets[r->rings[i].target];
        bool same_side = s->corner_wedges && s->wedge_parents[s->corner_wedges[r->rings[i].corner]] == wedge;
        if (out->attributes && !same_side) continue;
        double height = v3_dot(t->n, v3_sub(p, t->shape.a));
        if (same_side == out->attributes && height * height >= best->distance2) continue;
        foot found = triangle_nearest(&t->shape, p);
        if (same_side == out->attributes && found.distance2 >= best->distance2) continue;
        *best = found;
        out->target = r->rings[i].target;
        out->attributes = same_side;
    }
}

/* A corner of the input in the unit cube. */
static v3 find_input_position(const fct_simplifier *s, uint32_t corner) {
    v3 p = v3_load(s->mesh->positions + 3 * (size_t)s->mesh->triangles[corner]);
    return v3_scale(v3_sub(p, s->center), 1 / s->extent);
}

/* Whether two corners of a face of the input share a point. */
static bool is_degenerate(const fct_simplifier *s, uint32_t f) {
    const uint32_t *t = s->mesh->triangles + 3 * (size_t)f;
    uint32_t a = s->point_of[t[0]], b = s->point_of[t[1]], c = s->point_of[t[2]];
    return a == b || b == c || c == a;
}

static double find_area(const v3 p[3]) {
    return .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
}

static uint32_t find_input_wedge(const fct_simplifier *s, uint32_t corner) {
    return s->corner_wedges ? s->corner_wedges[corner] : s->point_of[s->mesh->triangles[corner]];
}

/* A sample is the mean of these corners: one for a wedge, three for a face. Returns their number; 0 if the
 * sample does not count. */
static uint32_t find_sample_corners(const refit *r, size_t sample, uint32_t corners[3]) {
    const fct_simplifier *s = r->s;
    if (sample < s->wedge_count) {
        corners[0] = r->corners[sample];
        return corners[0] != FCT_NONE;
    }
    uint32_t f = (uint32_t)(sample - s->wedge_count);
    for (uint32_t k = 0; k < 3; ++k) corners[k] = 3 * f + k;
    return is_degenerate(s, f) ? 0 : 3;
}

/* The position of a sample; p receives those of its corners. */
static inline v3 find_sample_position(const fct_simplifier *s, const uint32_t *corners, uint32_t count,
                                      v3 p[3]) {
    p[0] = find_input_position(s, corners[0]);
    if (count == 1) return p[0];
    p[1] = find_input_position(s, corners[1]), p[2] = find_input_position(s, corners[2]);
    return v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1. / 3);
}

/* If the nearest point lies on the rim of the searched rings, searches the rings of the points of that rim,
 * and so on while the distance decreases. */
static void walk_rings(const refit *r, const uint32_t *points, uint32_t count, v3 p, foot *best,
                       landing *out) {
    const fct_simplifier *s = r->s;
    uint32_t searched[3 + 2 * MAX_WALK], number = count;
    memcpy(searched, points, count * sizeof *points);
    for (uint32_t step = 0; step < MAX_WALK && out->target != FCT_NONE; ++step) {
        uint32_t from = out->target, first = 3 * r->targets[from].face, fresh = number;
        double b[3] = {1 - best->u - best->v, best->u, best->v};
        for (uint32_t k = 0; k < 3; ++k) {
            bool met = false;
            for (uint32_t j = 0; j < number; ++j) met |= searched[j] == s->triangles[first + k];
            if (met && b[k] > RIM) return;
            if (!met && b[k] > RIM) searched[fresh++] = s->triangles[first + k];
        }
        if (fresh == number + 3) return; /* inside the face: no rim */
        for (; number < fresh; ++number) {
            uint32_t wedge = FCT_NONE;
            for (uint32_t k = 0; k < 3 && s->corner_wedges; ++k)
                if (s->triangles[first + k] == searched[number])
                    wedge = s->wedge_parents[s->corner_wedges[first + k]];
            search_ring(r, searched[number], wedge, p, best, out);
        }
        if (out->target == from) return;
    }
}

/* Samples [begin, end): the first pass searches the target; later passes keep it, because points move little.
 */
static void land_samples(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    refit *r = user;
    const fct_simplifier *s = r->s;
    for (size_t i = begin; i < end; ++i) {
        landing *out = &r->landings[i];
        uint32_t corners[3], points[3], count = find_sample_corners(r, i, corners);
        if (count == 0) continue;
        v3 ends[3], p = find_sample_position(s, corners, count, ends);
        foot best = {0, 0, INFINITY};
        if (out->target != FCT_NONE)
            best = triangle_nearest(&r->targets[out->target].shape, p);
        else {
            for (uint32_t k = 0; k < count; ++k) {
                uint32_t input = find_input_wedge(s, corners[k]);
                points[k] = s->point_parents[s->point_of[s->mesh->triangles[corners[k]]]];
                if ((k > 0 && points[k] == points[0]) || (k > 1 && points[k] == points[1])) continue;
                search_ring(r, points[k], s->corner_wedges ? s->wedge_parents[input] : FCT_NONE, p, &best,
                            out);
            }
            walk_rings(r, points, count, p, &best, out);
        }
        out->u = (float)best.u, out->v = (float)best.v;
    }
}

/* The scaled value of a channel at a corner of the input. */
static double find_input_value(const fct_simplifier *s, const fct_channel *channel, uint32_t corner) {
    const fct_mesh *mesh = s->mesh;
    size_t v = mesh->triangles[corner], i = channel->component;
    double value = channel->source == CHANNEL_COLOR    ? mesh->colors[3 * v + i]
                   : channel->source == CHANNEL_NORMAL ? mesh->normals[3 * v + i]
                                                       : mesh->texcoords[2 * (size_t)corner + i];
    return value * channel->factor;
}

/* Adds the residual of the sample's attributes to the wedges of its target, with barycentric weights b. */
static void add_attribute_residual(refit *r, const uint32_t *corners, uint32_t count, uint32_t face,
                                   const double b[3], double weight) {
    const fct_simplifier *s = r->s;
    uint32_t n = s->channel_count, wedges[3];
    for (uint32_t k = 0; k < 3; ++k) {
        wedges[k] = s->wedge_parents[s->corner_wedges[3 * (size_t)face + k]];
        r->weights[wedges[k]] += weight * b[k];
    }
    for (uint32_t i = 0; i < n; ++i) {
        double rest = 0;
        for (uint32_t k = 0; k < count; ++k) rest += find_input_value(s, &s->channels[i], corners[k]);
        rest /= count;
        for (uint32_t k = 0; k < 3; ++k) rest -= b[k] * s->attributes[(size_t)n * wedges[k] + i];
        for (uint32_t k = 0; k < 3; ++k) r->sums[(size_t)n * wedges[k] + i] += weight * b[k] * rest;
    }
}

static void add_reach(reach *own, v3 point, v3 sample, double weight, double residual, uint32_t face) {
    own->residual2 += weight * residual * residual, own->weight += weight;
    double distance2 = v3_norm2(v3_sub(sample, point));
    if (face != FCT_NONE && distance2 < own->nearest2) own->nearest2 = distance2, own->nearest = face;
}

/* Adds weight * b^2 n n^T and weight * b * residual * n to the system of each corner of the target, where n
 * points from the target to the sample. */
static void add_sample(refit *r, size_t sample, const landing *at) {
    const fct_simplifier *s = r->s;
    if (at->target == FCT_NONE) return;
    uint32_t corners[3], count = find_sample_corners(r, sample, corners);
    v3 ends[3], p = find_sample_position(s, corners, count, ends);
    double weight = count == 1 ? r->corner_weights[sample] : CENTROID_WEIGHT * find_area(ends);
    const target *face = &r->targets[at->target];
    const triangle *shape = &face->shape;
    double b[3] = {1 - (double)at->u - at->v, at->u, at->v};
    v3 rest = v3_sub(p, shape->a);
    rest = v3_sub(rest, v3_add(v3_scale(shape->ab, b[1]), v3_scale(shape->ac, b[2])));
    double residual = v3_norm(rest);
    v3 n = residual > NOISE ? v3_scale(rest, 1 / residual) : face->n;
    for (size_t k = 0; k < 3; ++k) {
        uint32_t point = s->triangles[3 * (size_t)face->face + k];
        double *system = r->systems[point];
        add_reach(&r->reaches[point], point_position(s, point), p, weight * b[k], residual,
                  count == 3 ? (uint32_t)(sample - s->wedge_count) : FCT_NONE);
        sym3_add_outer(system, weight * b[k] * b[k], n);
        double g = residual > NOISE ? weight * b[k] * residual : 0;
        system[6] += g * n.x, system[7] += g * n.y, system[8] += g * n.z;
    }
    if (at->attributes) add_attribute_residual(r, corners, count, face->face, b, weight);
}

/* Solves (A + DAMPING trace(A) I) d = g by Cramer's rule. The damping keeps the determinant away from 0. */
static v3 solve_damped(const double q[9]) {
    double ridge = DAMPING * (q[0] + q[3] + q[5]);
    double xx = q[0] + ridge, yy = q[3] + ridge, zz = q[5] + ridge, xy = q[1], xz = q[2], yz = q[4];
    double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
    double det = xx * a + xy * b + xz * c;
    if (!(det > 0)) return (v3){0, 0, 0};
    double d = xx * zz - xz * xz, e = xy * xz - xx * yz, f = xx * yy - xy * xy;
    return (v3){(a * q[6] + b * q[7] + c * q[8]) / det, (b * q[6] + d * q[7] + e * q[8]) / det,
                (c * q[6] + e * q[7] + f * q[8]) / det};
}

/* Adds the planes that hold a point. */
static void add_planes(const fct_simplifier *s, const fct_constraint *held, v3 at, double system[9]) {
    double weight = PLANES * constraint_weight(s, held, system[0] + system[3] + system[5]);
    v3 g = quadric_gradient(held->planes, at);
    for (int k = 0; k < 6; ++k) system[k] += weight * held->planes[k];
    system[6] -= weight * g.x, system[7] -= weight * g.y, system[8] -= weight * g.z;
}

/* The step of a point, as far as its constraint allows it. */
static v3 find_step(const refit *r, uint32_t point) {
    const fct_simplifier *s = r->s;
    const fct_constraint *held = constraint_at(s, point);
    double *q = r->systems[point];
    if (!held) return v3_scale(solve_damped(q), STEP);
    if (held->hold >= HOLD_POINT) return (v3){0, 0, 0};
    if (held->hold == HOLD_LINE) {
        v3 d = s->lines[held->line].direction;
        double curvature = sym3_form(q, d, d) + DAMPING * (q[0] + q[3] + q[5]);
        double slope = d.x * q[6] + d.y * q[7] + d.z * q[8];
        return curvature > 0 ? v3_scale(d, STEP * slope / curvature) : (v3){0, 0, 0};
    }
    add_planes(s, held, point_position(s, point), q);
    return v3_scale(solve_damped(q), STEP);
}

/* The squared distance from the face of the input near the point; 0 if there is none. */
static double find_distance2(const refit *r, uint32_t point, v3 at) {
    uint32_t f = r->reaches[point].nearest;
    if (f == FCT_NONE) return 0;
    triangle t = triangle_make(find_input_position(r->s, 3 * f), find_input_position(r->s, 3 * f + 1),
                               find_input_position(r->s, 3 * f + 2));
    return triangle_nearest(&t, at).distance2;
}

static double find_farthest_point2(const refit *r) {
    double most2 = 0;
    for (uint32_t p = 0; p < r->s->point_count; ++p)
        if (r->s->valences[p] > 0) most2 = fct_max(most2, find_distance2(r, p, point_position(r->s, p)));
    return most2;
}

/* Halves a step until the point stays near the input, or is no farther from it than before. */
static v3 limit_step(const refit *r, uint32_t point, v3 step, double most2) {
    v3 from = point_position(r->s, point);
    const reach *own = &r->reaches[point];
    most2 = fct_max(most2, find_distance2(r, point, from));
    if (own->weight > 0) most2 = fct_max(most2, OWN_REACH * OWN_REACH * own->residual2 / own->weight);
    for (int i = 0; i <= MAX_HALVINGS; ++i, step = v3_scale(step, .5))
        if (find_distance2(r, point, v3_add(from, step)) <= most2) return step;
    return (v3){0, 0, 0};
}

/* Moves each point by its step, in the order of the points. Hubs and steps that would fold a face over are
 * left out. */
static void move_points(refit *r) {
    fct_simplifier *s = r->s;
    double most_away2 = POINT_REACH * POINT_REACH * find_farthest_point2(r);
    for (uint32_t p = 0; p < s->point_count; ++p) {
        if (s->valences[p] == 0 || s->valences[p] > SIMPLIFY_HUB) continue;
        v3 step = find_step(r, p);
        double length2 = v3_norm2(step), shortest2 = INFINITY;
        if (!(length2 > NOISE * NOISE)) continue;
        v3 from = point_position(s, p);
        uint32_t count = fct_simplify_gather(s, p, s->ring_a);
        for (uint32_t i = 0; i < count; ++i) {
            uint32_t x = s->triangles[corner_next(s->ring_a[i])];
            uint32_t y = s->triangles[corner_previous(s->ring_a[i])];
            shortest2 = fct_min(shortest2, v3_norm2(v3_sub(point_position(s, x), from)));
            shortest2 = fct_min(shortest2, v3_norm2(v3_sub(point_position(s, y), from)));
        }
        double most2 = MAX_STEP * MAX_STEP * shortest2;
        if (length2 > most2) step = v3_scale(step, sqrt(most2 / length2));
        step = limit_step(r, p, step, most_away2);
        if (v3_norm2(step) == 0) continue;
        v3 at = v3_add(from, step);
        const fct_move move = {.a = p, .b = FCT_NONE, .count_a = count, .at = at};
        if (!fct_simplify_remains_good(s, &move)) continue;
        double *position = s->positions + 3 * (size_t)p;
        position[0] = at.x, position[1] = at.y, position[2] = at.z;
        s->sources[p] = FCT_NONE;
    }
}

/* Each attribute takes the full step, the mean residual, clamped to the input's range. Those of locked points
 * stay. */
static void move_attributes(refit *r) {
    fct_simplifier *s = r->s;
    uint32_t n = s->channel_count;
    for (uint32_t p = 0; p < s->point_count && n && s->constraint_of; ++p)
        for (uint32_t w = s->first_wedges[p]; s->valences[p] > 0 && point_is_locked(s, p) && w != FCT_NONE;
             w = s->next_wedges[w])
            r->weights[w] = 0;
    for (uint32_t w = 0; w < s->wedge_count && n; ++w) {
        if (!(r->weights[w] > 0)) continue;
        for (uint32_t i = 0; i < n; ++i) {
            double *a = &s->attributes[(size_t)n * w + i];
            double moved = *a + r->sums[(size_t)n * w + i] / r->weights[w];
            *a = fct_min(fct_max(moved, s->channels[i].lower), s->channels[i].upper);
        }
    }
}

/* Numbers the live faces and lists them at their points. */
static void number_targets(refit *r) {
    fct_simplifier *s = r->s;
    uint32_t end = 0, live = 0;
    for (uint32_t p = 0; p < s->point_count; ++p) {
        r->ring_ends[p] = end;
        end += s->valences[p];
    }
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        if (corner_dead(s, 3 * f)) continue;
        for (uint32_t c = 3 * f; c < 3 * f + 3; ++c)
            r->rings[r->ring_ends[s->triangles[c]]++] = (ring_entry){c, live};
        r->targets[live++].face = f;
    }
}

static void set_targets(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    refit *r = user;
    for (size_t i = begin; i < end; ++i) {
        target *t = &r->targets[i];
        const uint32_t *points = r->s->triangles + 3 * (size_t)t->face;
        t->shape = triangle_make(point_position(r->s, points[0]), point_position(r->s, points[1]),
                                 point_position(r->s, points[2]));
        t->n = v3_unit(v3_cross(t->shape.ab, t->shape.ac));
    }
}

/* Resolves the parents of points and wedges, lists the targets, and sums the weight of each wedge of the
 * input. */
static void prepare_samples(refit *r) {
    fct_simplifier *s = r->s;
    for (uint32_t p = 0; p < s->point_count; ++p) s->point_parents[p] = fct_sets_find(s->point_parents, p);
    for (uint32_t w = 0; w < s->wedge_count && s->wedge_parents; ++w)
        s->wedge_parents[w] = fct_sets_find(s->wedge_parents, w);
    number_targets(r);
    memset(r->corners, 0xff, s->wedge_count * sizeof *r->corners);
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        if (is_degenerate(s, f)) continue;
        v3 ends[3];
        for (uint32_t k = 0; k < 3; ++k) ends[k] = find_input_position(s, 3 * f + k);
        double area = find_area(ends);
        for (uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
            uint32_t w = find_input_wedge(s, c);
            if (r->corners[w] == FCT_NONE) r->corners[w] = c;
            r->corner_weights[w] += area / CORNER_DIVISOR;
        }
    }
}

static fct_result run_pass(refit *r, uint32_t pass, size_t samples) {
    fct_simplifier *s = r->s;
    memset(r->systems, 0, s->point_count * sizeof *r->systems);
    memset(r->sums, 0, (size_t)s->wedge_count * s->channel_count * sizeof *r->sums);
    for (uint32_t p = 0; p < s->point_count; ++p) r->reaches[p] = (reach){0, 0, INFINITY, FCT_NONE};
    if (s->channel_count) memset(r->weights, 0, s->wedge_count * sizeof *r->weights);
    fct_result result = fct_progress(s->env, "refit", (double)pass / s->def->refit_passes);
    if (result != FCT_OK) return result;
    fct_parallel_for(s->env, s->live_faces, CHUNK, set_targets, r);
    fct_parallel_for(s->env, samples, CHUNK, land_samples, r);
    for (size_t i = 0; i < samples; ++i) add_sample(r, i, &r->landings[i]);
    move_points(r);
    move_attributes(r);
    return FCT_OK;
}

fct_result fct_simplify_refit(fct_simplifier *s) {
    refit r = {.s = s};
    size_t samples = (size_t)s->wedge_count + s->mesh->face_count;
    const fct_array arrays[] = {FCT_ARRAY(r.corners, s->wedge_count),
                                FCT_ARRAY_ZERO(r.corner_weights, s->wedge_count),
                                FCT_ARRAY(r.landings, samples),
                                FCT_ARRAY(r.targets, s->live_faces),
                                FCT_ARRAY(r.rings, 3 * (size_t)s->live_faces),
                                FCT_ARRAY(r.ring_ends, s->point_count),
                                FCT_ARRAY(r.systems, s->point_count),
                                FCT_ARRAY(r.sums, (size_t)s->wedge_count * s->channel_count),
                                FCT_ARRAY(r.weights, s->channel_count ? s->wedge_count : 0),
                                FCT_ARRAY(r.reaches, s->point_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the refit");
    if (result != FCT_OK) return result;
    prepare_samples(&r);
    for (size_t i = 0; i < samples; ++i) r.landings[i] = (landing){.target = FCT_NONE};
    for (uint32_t pass = 0; pass < s->def->refit_passes && result == FCT_OK; ++pass)
        result = run_pass(&r, pass, samples);
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}
