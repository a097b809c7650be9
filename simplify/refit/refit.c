/* simplify/refit/refit.c: see refit.h. Each pass:
 *
 * 1. Samples are the corners (1/12 of the face's area) and centroids (3/4) of the input's faces, or an even
 *    part of them: those at equal steps along the curve on which the input is sorted. Each finds
 *    the nearest point of the faces around the points that its corners were contracted to.
 * 2. Each point takes one damped least-squares step along the directions to its samples. Each attribute takes
 *    a step towards their values. Steps that would fold a face over are left out, and those that would take
 *    the point too far from the input are made shorter.
 * The search is parallel. The sums run in the order of the samples, so the result does not depend on the
 * threads. Cost of a pass: O(samples * valence).
 */
#include "simplify/refit/refit.h"

#include "base/parallel.h"
#include "simplify/cost/constraint.h"
#include "simplify/cost/nearest.h"
#include "simplify/refit/measure.h"
#include "simplify/refit/search.h"
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
enum {
    CHUNK = 1024,     /* samples per parallel task */
    MAX_HALVINGS = 3, /* of a step that goes too far */
};
/* Samples per point: all of them up to FEW, and one of RARE beyond, up to MOST. At a tenth of the faces these
 * are half of all samples; with all, E_avg is 1.5 % smaller. At a hundredth, more than MOST make nothing
 * better. */
#define FEW_SAMPLES  12.
#define RARE_SAMPLES 8.
#define MOST_SAMPLES 32.
/* Fewer than these in all save no time. */
#define LEAST_SAMPLES 8192.

/* Samples [begin, end): the first pass searches the face; later passes keep it, because points move little.
 */
static void land_samples(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const fct_refit *r = user;
    const fct_simplifier *s = r->s;
    if (r->pass == 0) {
        fct_refit_search(r, begin, end);
        return;
    }
    for (size_t i = begin; i < end; ++i) {
        fct_landing *out = &r->landings[i];
        if (out->face == FCT_NONE) continue;
        const uint32_t *t = s->triangles + 3 * (size_t)out->face;
        triangle shape =
            triangle_make(point_position(s, t[0]), point_position(s, t[1]), point_position(s, t[2]));
        foot best = triangle_nearest(&shape, r->samples[i].at);
        out->u = (float)best.u, out->v = (float)best.v;
    }
}

/* Adds the residual of the sample's attributes to the wedges of its target, with barycentric weights b. */
static void add_attribute_residual(fct_refit *r, size_t sample, const double b[3]) {
    const fct_simplifier *s = r->s;
    uint32_t face = r->landings[sample].face, n = s->channel_count, wedges[3];
    uint32_t corners[3] = {0}, count = find_sample_corners(r, sample, corners);
    double weight = r->samples[sample].weight;
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

static void add_near_face(const fct_refit *r, uint32_t point, uint32_t f, v3 centroid) {
    double distance2 = v3_norm2(v3_sub(centroid, point_position(r->s, point)));
    fct_near_face *near = &r->near[point];
    if (distance2 < near->distance2) *near = (fct_near_face){distance2, f};
}

/* Adds a sample to the systems of the corners of its face. */
static void add_sample(fct_refit *r, size_t sample) {
    const fct_simplifier *s = r->s;
    const fct_landing *at = &r->landings[sample];
    if (at->face == FCT_NONE) return;
    v3 p = r->samples[sample].at;
    double weight = r->samples[sample].weight;
    const uint32_t *t = s->triangles + 3 * (size_t)at->face;
    v3 a = point_position(s, t[0]), ab = v3_sub(point_position(s, t[1]), a),
       ac = v3_sub(point_position(s, t[2]), a);
    double b[3] = {1 - (double)at->u - at->v, at->u, at->v};
    v3 rest = v3_sub(v3_sub(p, a), v3_add(v3_scale(ab, b[1]), v3_scale(ac, b[2])));
    double residual2 = v3_norm2(rest), residual = sqrt(residual2);
    v3 n = v3_scale(rest, 1 / residual);
    if (!(residual > NOISE)) n = v3_unit(v3_cross(ab, ac)), rest = (v3){0, 0, 0};
    const double squares[6] = {n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z};
    const double others[6] = {rest.x, rest.y, rest.z, residual2, 1, 0};
    for (size_t k = 0; k < 3; ++k) {
        double *row = r->systems[t[k]].matrix, share = weight * b[k], square = share * b[k];
        for (size_t i = 0; i < 6; ++i) row[i] += square * squares[i], row[6 + i] += share * others[i];
        if (r->pass == 0 && sample >= r->wedge_samples)
            add_near_face(r, t[k], (uint32_t)(sample - r->wedge_samples) * r->stride, p);
    }
    if (at->attributes) add_attribute_residual(r, sample, b);
}

/* Solves (A + DAMPING trace(A) I) d = g. The damping keeps the determinant away from 0. */
static v3 solve_damped(const fct_system *system) {
    const double *q = system->matrix, *g = system->side;
    v3 step = {0, 0, 0};
    sym3_solve(q, DAMPING * (q[0] + q[3] + q[5]), (v3){g[0], g[1], g[2]}, &step);
    return step;
}

/* Adds the planes that hold a point. */
static void add_planes(const fct_simplifier *s, const fct_constraint *held, v3 at, fct_system *system) {
    double *q = system->matrix, weight = PLANES * constraint_weight(s, held, q[0] + q[3] + q[5]);
    v3 g = quadric_gradient(held->planes, at);
    for (int k = 0; k < 6; ++k) q[k] += weight * held->planes[k];
    system->side[0] -= weight * g.x, system->side[1] -= weight * g.y, system->side[2] -= weight * g.z;
}

/* Adds the point constraints of a point. */
static void add_pins(const double pins[10], v3 at, fct_system *system) {
    v3 g = quadric_gradient(pins, at);
    for (int k = 0; k < 6; ++k) system->matrix[k] += pins[k];
    system->side[0] -= g.x, system->side[1] -= g.y, system->side[2] -= g.z;
}

/* The step of a point, as far as its constraint allows it. */
static v3 find_step(const fct_refit *r, uint32_t point) {
    const fct_simplifier *s = r->s;
    const fct_constraint *held = constraint_at(s, point);
    fct_system *system = &r->systems[point];
    if (point_is_pinned(s, point)) add_pins(s->pins[point], point_position(s, point), system);
    if (!held) return v3_scale(solve_damped(system), STEP);
    if (held->hold >= HOLD_POINT) return (v3){0, 0, 0};
    if (held->hold == HOLD_LINE) {
        v3 d = s->lines[held->line].direction;
        const double *q = system->matrix;
        double curvature = sym3_form(q, d, d) + DAMPING * (q[0] + q[3] + q[5]);
        double slope = v3_dot(d, (v3){system->side[0], system->side[1], system->side[2]});
        return curvature > 0 ? v3_scale(d, STEP * slope / curvature) : (v3){0, 0, 0};
    }
    add_planes(s, held, point_position(s, point), system);
    return v3_scale(solve_damped(system), STEP);
}

/* The squared distance from the face of the input near the point; 0 if there is none. */
static double find_distance2(const fct_refit *r, uint32_t point, v3 at) {
    uint32_t f = r->near[point].face;
    if (f == FCT_NONE) return 0;
    triangle t = triangle_make(find_input_position(r->s, 3 * f), find_input_position(r->s, 3 * f + 1),
                               find_input_position(r->s, 3 * f + 2));
    return triangle_nearest(&t, at).distance2;
}

static double find_farthest_point2(const fct_refit *r) {
    double most2 = 0;
    for (uint32_t p = 0; p < r->s->point_count; ++p)
        if (point_at(r->s, p)->valence > 0)
            most2 = fct_max(most2, find_distance2(r, p, point_position(r->s, p)));
    return most2;
}

/* Halves a step until the point stays near the input, or is no farther from it than before. */
static v3 limit_step(const fct_refit *r, uint32_t point, v3 step, double most2) {
    v3 from = point_position(r->s, point);
    const fct_system *own = &r->systems[point];
    most2 = fct_max(most2, find_distance2(r, point, from));
    if (own->weight > 0) most2 = fct_max(most2, OWN_REACH * OWN_REACH * own->residual2 / own->weight);
    for (int i = 0; i <= MAX_HALVINGS; ++i, step = v3_scale(step, .5))
        if (find_distance2(r, point, v3_add(from, step)) <= most2) return step;
    return (v3){0, 0, 0};
}

/* Moves each point by its step, in the order of the points. Hubs and steps that would fold a face over are
 * left out. */
static void move_points(fct_refit *r) {
    fct_simplifier *s = r->s;
    double most_away2 = POINT_REACH * POINT_REACH * find_farthest_point2(r);
    for (uint32_t p = 0; p < s->point_count; ++p) {
        if (point_at(s, p)->valence == 0 || point_at(s, p)->valence > SIMPLIFY_HUB) continue;
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
        point_at(s, p)->at = at;
        point_at(s, p)->source = FCT_NONE;
    }
}

/* The first wedge of a live point; FCT_NONE if the point has no faces. */
static uint32_t find_first_wedge(const fct_simplifier *s, uint32_t point) {
    return point_at(s, point)->valence > 0 ? s->first_wedges[point] : FCT_NONE;
}

/* Adds the residuals of the wedges of each class at the class's number, except those of texture coordinates.
 */
static void sum_classes(fct_refit *r) {
    fct_simplifier *s = r->s;
    uint32_t n = s->channel_count;
    for (uint32_t p = 0; p < s->point_count; ++p)
        for (uint32_t w = find_first_wedge(s, p); w != FCT_NONE; w = s->next_wedges[w]) {
            uint32_t class = s->wedge_classes[w];
            if (class == w) continue;
            r->weights[class] += r->weights[w];
            for (uint32_t i = 0; i < n; ++i)
                if (s->channels[i].source != CHANNEL_TEXCOORD)
                    r->sums[(size_t)n * class + i] += r->sums[(size_t)n * w + i];
        }
}

/* Moves the texture coordinates, or else the other attributes, of all wedges. */
static void move_channels(fct_refit *r, bool texcoords) {
    fct_simplifier *s = r->s;
    uint32_t n = s->channel_count;
    for (uint32_t p = 0; p < s->point_count; ++p)
        for (uint32_t w = find_first_wedge(s, p); w != FCT_NONE; w = s->next_wedges[w]) {
            uint32_t from = texcoords ? w : s->wedge_classes[w];
            for (uint32_t i = 0; i < n && r->weights[from] > 0; ++i) {
                if ((s->channels[i].source == CHANNEL_TEXCOORD) != texcoords) continue;
                double *a = &s->attributes[(size_t)n * w + i];
                double moved = *a + r->sums[(size_t)n * from + i] / r->weights[from];
                *a = fct_min(fct_max(moved, s->channels[i].lower), s->channels[i].upper);
            }
        }
}

/* Each attribute takes the full step, the mean residual, clamped to the input's range. Those of locked points
 * stay. The wedges of a class share a step, so they stay equal. */
static void move_attributes(fct_refit *r) {
    fct_simplifier *s = r->s;
    if (!s->channel_count) return;
    for (uint32_t p = 0; p < s->point_count && s->constraint_of; ++p)
        for (uint32_t w = find_first_wedge(s, p); point_is_locked(s, p) && w != FCT_NONE;
             w = s->next_wedges[w])
            r->weights[w] = 0;
    move_channels(r, true);
    sum_classes(r);
    move_channels(r, false);
}

/* The corners of face f of the input were contracted to these points. */
static void add_own_centroid(fct_refit *r, uint32_t f, v3 centroid) {
    const fct_simplifier *s = r->s;
    for (uint32_t c = 3 * f, last = FCT_NONE; c < 3 * f + 3; ++c) {
        uint32_t p = s->point_parents[s->point_of[s->mesh->triangles[c]]];
        if (p == last) continue;
        last = p;
        add_near_face(r, p, f, centroid);
    }
}

/* Resolves the parents of points and wedges. */
static void resolve_parents(fct_simplifier *s) {
    for (uint32_t p = 0; p < s->point_count; ++p) s->point_parents[p] = fct_sets_find(s->point_parents, p);
    for (uint32_t w = 0; w < s->wedge_count && s->wedge_parents; ++w)
        s->wedge_parents[w] = fct_sets_find(s->wedge_parents, w);
}

/* Each sample, and the first near face of each point. */
static void make_samples(fct_refit *r) {
    const fct_simplifier *s = r->s;
    for (uint32_t p = 0; p < s->point_count; ++p) r->near[p] = (fct_near_face){INFINITY, FCT_NONE};
    memset(r->corners, 0xff, r->wedge_samples * sizeof *r->corners);
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        if (is_degenerate(s, f)) continue;
        v3 ends[3];
        for (uint32_t k = 0; k < 3; ++k) ends[k] = find_input_position(s, 3 * f + k);
        v3 centroid = v3_scale(v3_add(v3_add(ends[0], ends[1]), ends[2]), 1. / 3);
        double area = find_area(ends);
        add_own_centroid(r, f, centroid);
        if (f % r->stride == 0)
            r->samples[r->wedge_samples + f / r->stride] = (fct_sample){centroid, CENTROID_WEIGHT * area};
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t w = find_input_wedge(s, 3 * f + k), i = w / r->stride;
            if (w % r->stride) continue;
            if (r->corners[i] == FCT_NONE) r->corners[i] = 3 * f + k, r->samples[i].at = ends[k];
            r->samples[i].weight += area / CORNER_DIVISOR;
        }
    }
}

static fct_result run_pass(fct_refit *r, uint32_t pass, size_t samples) {
    fct_simplifier *s = r->s;
    memset(r->systems, 0, s->point_count * sizeof *r->systems);
    memset(r->sums, 0, (size_t)s->wedge_count * s->channel_count * sizeof *r->sums);
    if (s->channel_count) memset(r->weights, 0, s->wedge_count * sizeof *r->weights);
    fct_result result = fct_progress(s->env, "refit", (double)pass / s->def->refit_passes);
    if (result != FCT_OK) return result;
    r->pass = pass;
    fct_parallel_for(s->env, samples, CHUNK, land_samples, r);
    for (size_t i = 0; i < samples; ++i) add_sample(r, i);
    move_points(r);
    move_attributes(r);
    return FCT_OK;
}

/* One of how many wedges and faces of the input has a sample. */
static uint32_t find_stride(const fct_simplifier *s) {
    /* A closed mesh has half as many points as faces. */
    double all = (double)s->wedge_count + s->mesh->face_count, points = .5 * s->live_faces;
    double few = FEW_SAMPLES * points,
           wanted = fct_min(few + (all - few) / RARE_SAMPLES, MOST_SAMPLES * points);
    return (uint32_t)fct_max(all / fct_max(wanted, LEAST_SAMPLES), 1);
}

fct_result fct_simplify_refit(fct_simplifier *s, fct_fit *fit) {
    fct_refit r = {.s = s};
    /* Subset placement promises vertices of the input, so nothing may move. */
    uint32_t passes = s->def->placement == FCT_PLACE_SUBSET ? 0 : s->def->refit_passes;
    if (fit) *fit = (fct_fit){0};
    if (passes == 0 && !fit) return FCT_OK;
    r.stride = find_stride(s);
    r.wedge_samples = (s->wedge_count + r.stride - 1) / r.stride;
    size_t samples = r.wedge_samples + (size_t)(s->mesh->face_count + r.stride - 1) / r.stride;
    const fct_array arrays[] = {FCT_ARRAY(r.corners, r.wedge_samples),
                                FCT_ARRAY_ZERO(r.samples, samples),
                                FCT_ARRAY(r.landings, samples),
                                FCT_ARRAY(r.systems, s->point_count),
                                FCT_ARRAY(r.sums, (size_t)s->wedge_count * s->channel_count),
                                FCT_ARRAY(r.weights, s->channel_count ? s->wedge_count : 0),
                                FCT_ARRAY(r.near, s->point_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the refit");
    if (result != FCT_OK) return result;
    resolve_parents(s);
    make_samples(&r);
    for (size_t i = 0; i < samples; ++i) r.landings[i] = (fct_landing){.face = FCT_NONE};
    for (uint32_t pass = 0; pass < passes && result == FCT_OK; ++pass) result = run_pass(&r, pass, samples);
    if (result == FCT_OK && fit) {
        r.pass = passes;
        fct_parallel_for(s->env, samples, CHUNK, land_samples, &r);
        result = fct_refit_measure(&r, samples, fit);
    }
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}
