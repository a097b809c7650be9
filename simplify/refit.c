/* simplify/refit.c: moves the points that are left closer to the input.
 *
 * Every input face asks, at its centroid and corners (weights 3/4 and 1/12 of its area, the rule exact to
 * second degree), for the nearest point of the faces around the points it was contracted to. Each point then
 * takes one damped least-squares step along the directions to its samples, and each attribute one towards
 * their values: half the way for points, whose neighbours move too, with a tenth of the trace on the diagonal
 * so that nothing slides along the surface. Steps that would turn a face over are not made. O(samples x
 * valence) a pass; the search is parallel, the sums run in the order of the samples.
 */
#include "base/parallel.h"
#include "simplify/quadric.h"

#define STEP    .5
#define DAMPING .1
/* The longest step, in lengths of the shortest edge at the point. */
#define MAX_STEP .5
/* Distances below this, in the unit cube, are rounding of the input's floats. */
#define NOISE 1e-7

enum { SAMPLES_AT_ONCE = 1 << 16, MAX_STEPS = 4 };

/* Where a sample came to lie: a face of the result, and barycentrics of its second and third corner. */
typedef struct landing {
    uint32_t face;   /* FCT_NONE: nowhere */
    bool attributes; /* on its own side of a seam, so that its attributes count */
    float u, v;
} landing;

typedef struct refit {
    fct_simplifier *s;
    uint32_t *corners;      /* by wedge of the input, which is a sample: a corner of it, or FCT_NONE */
    double *corner_weights; /* by wedge of the input */
    size_t first;           /* sample number of landings[0]; samples after the wedges are the faces */
    landing *landings;
    double (*systems)[9];   /* by point: xx xy xz yy yz zz, then the right side */
    double *sums, *weights; /* by wedge and channel; by wedge */
} refit;

typedef struct foot {
    double u, v, distance2;
} foot;

/* The nearest point of a + u ab + v ac to p, by the regions of the triangle's corners and sides. */
static foot nearest_on_triangle(v3 p, v3 a, v3 ab, v3 ac) {
    v3 ap = v3_sub(p, a);
    double d1 = v3_dot(ab, ap), d2 = v3_dot(ac, ap);
    double aa = v3_norm2(ab), cc = v3_norm2(ac), b = v3_dot(ab, ac);
    double det = aa * cc - b * b, u = cc * d1 - b * d2, v = aa * d2 - b * d1;
    if (det > 0 && u >= 0 && v >= 0 && u + v <= det)
        u /= det, v /= det;
    else {
        double on_ab = aa > 0 ? fmin(fmax(d1 / aa, 0), 1) : 0;
        double on_ac = cc > 0 ? fmin(fmax(d2 / cc, 0), 1) : 0;
        double bc2 = aa + cc - 2 * b, along = d2 - d1 + aa - b; /* (p - b).(c - b) */
        double on_bc = bc2 > 0 ? fmin(fmax(along / bc2, 0), 1) : 0;
        double e_ab = on_ab * (on_ab * aa - 2 * d1), e_ac = on_ac * (on_ac * cc - 2 * d2);
        double x = 1 - on_bc, y = on_bc;
        double e_bc = x * x * aa + y * y * cc + 2 * x * y * b - 2 * (x * d1 + y * d2);
        u = on_ab, v = 0;
        if (e_ac < e_ab) u = 0, v = on_ac;
        if (e_bc < fmin(e_ab, e_ac)) u = x, v = y;
    }
    v3 rest = v3_sub(ap, v3_add(v3_scale(ab, u), v3_scale(ac, v)));
    return (foot){u, v, v3_norm2(rest)};
}

/* Looks for the nearest face around a point, among those on the wedge's side of a seam if there are any. */
static void search_ring(const fct_simplifier *s, uint32_t point, uint32_t wedge, v3 p, foot *best,
                        landing *out) {
    if (s->valences[point] > SIMPLIFY_HUB) return;
    for (uint32_t c = s->first_corners[point]; c != FCT_NONE; c = s->next_corners[c]) {
        bool same_side = s->corner_wedges && s->wedge_parents[s->corner_wedges[c]] == wedge;
        if (out->attributes && !same_side) continue;
        const uint32_t *t = s->triangles + (c - c % 3);
        v3 a = point_position(s, t[0]);
        foot found =
            nearest_on_triangle(p, a, v3_sub(point_position(s, t[1]), a), v3_sub(point_position(s, t[2]), a));
        if (same_side == out->attributes && found.distance2 >= best->distance2) continue;
        *best = found;
        out->face = c / 3;
        out->attributes = same_side;
    }
}

static v3 input_position(const fct_simplifier *s, uint32_t corner) {
    v3 p = v3_load(s->mesh->positions + 3 * (size_t)s->mesh->triangles[corner]);
    return v3_scale(v3_sub(p, s->center), 1 / s->extent);
}

static bool input_degenerate(const fct_simplifier *s, uint32_t f) {
    const uint32_t *t = s->mesh->triangles + 3 * (size_t)f;
    uint32_t a = s->point_of[t[0]], b = s->point_of[t[1]], c = s->point_of[t[2]];
    return a == b || b == c || c == a;
}

static double input_area(const fct_simplifier *s, uint32_t f) {
    v3 a = input_position(s, 3 * f);
    return .5 * v3_norm(v3_cross(v3_sub(input_position(s, 3 * f + 1), a),
                                 v3_sub(input_position(s, 3 * f + 2), a)));
}

static uint32_t input_wedge(const fct_simplifier *s, uint32_t corner) {
    return s->corner_wedges ? s->corner_wedges[corner] : s->point_of[s->mesh->triangles[corner]];
}

/* The corners whose mean a sample is: one of a wedge, all three of a face. Returns how many, 0 for a sample
 * that does not count. */
static uint32_t sample_corners(const refit *r, size_t sample, uint32_t corners[3]) {
    const fct_simplifier *s = r->s;
    if (sample < s->wedge_count) {
        corners[0] = r->corners[sample];
        return corners[0] != FCT_NONE;
    }
    uint32_t f = (uint32_t)(sample - s->wedge_count);
    for (uint32_t k = 0; k < 3; ++k) corners[k] = 3 * f + k;
    return input_degenerate(s, f) ? 0 : 3;
}

static v3 sample_position(const fct_simplifier *s, const uint32_t *corners, uint32_t count) {
    v3 sum = {0, 0, 0};
    for (uint32_t i = 0; i < count; ++i) sum = v3_add(sum, input_position(s, corners[i]));
    return count == 1 ? sum : v3_scale(sum, 1. / 3);
}

/* Goes on from a foot on the rim of the rings searched to the rings of that side's ends, while it gets
 * nearer. */
static void walk(const fct_simplifier *s, const uint32_t *points, uint32_t count, v3 p, foot *best,
                 landing *out) {
    uint32_t searched[3 + 2 * MAX_STEPS], number = count;
    memcpy(searched, points, count * sizeof *points);
    for (uint32_t step = 0; step < MAX_STEPS && out->face != FCT_NONE; ++step) {
        const uint32_t *t = s->triangles + 3 * (size_t)out->face;
        double b[3] = {1 - best->u - best->v, best->u, best->v};
        uint32_t fresh = number, face = out->face;
        bool inside = true, met[3];
        for (uint32_t k = 0; k < 3; ++k) {
            met[k] = false;
            for (uint32_t j = 0; j < number; ++j) met[k] |= searched[j] == t[k];
            if (met[k] && b[k] > 1e-6) return;
            inside &= b[k] > 1e-6;
        }
        if (inside) return;
        for (uint32_t k = 0; k < 3; ++k)
            if (!met[k] && b[k] > 1e-6) searched[fresh++] = t[k];
        for (; number < fresh; ++number) {
            uint32_t wedge = FCT_NONE;
            for (uint32_t k = 0; k < 3 && s->corner_wedges; ++k)
                if (s->triangles[3 * (size_t)face + k] == searched[number])
                    wedge = s->wedge_parents[s->corner_wedges[3 * (size_t)face + k]];
            search_ring(s, searched[number], wedge, p, best, out);
        }
        if (out->face == face) return;
    }
}

static void land_samples(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    refit *r = user;
    const fct_simplifier *s = r->s;
    for (size_t i = begin; i < end; ++i) {
        landing *out = &r->landings[i];
        *out = (landing){.face = FCT_NONE};
        uint32_t corners[3], points[3], count = sample_corners(r, r->first + i, corners);
        v3 p = sample_position(s, corners, count);
        foot best = {0, 0, INFINITY};
        for (uint32_t k = 0; k < count; ++k) {
            uint32_t input = input_wedge(s, corners[k]);
            points[k] = s->point_parents[s->point_of[s->mesh->triangles[corners[k]]]];
            if ((k > 0 && points[k] == points[0]) || (k > 1 && points[k] == points[1])) continue;
            search_ring(s, points[k], s->corner_wedges ? s->wedge_parents[input] : FCT_NONE, p, &best, out);
        }
        walk(s, points, count, p, &best, out);
        out->u = (float)best.u, out->v = (float)best.v;
    }
}

/* Value of a channel at a corner of the input, scaled. */
static double input_value(const fct_simplifier *s, const fct_channel *channel, uint32_t corner) {
    const fct_mesh *mesh = s->mesh;
    size_t v = mesh->triangles[corner], i = channel->component;
    double value = channel->source == CHANNEL_COLOR    ? mesh->colors[3 * v + i]
                   : channel->source == CHANNEL_NORMAL ? mesh->normals[3 * v + i]
                                                       : mesh->texcoords[2 * (size_t)corner + i];
    return value * channel->factor;
}

static void add_attributes(refit *r, const uint32_t *corners, uint32_t count, const landing *at,
                           const double b[3], double weight) {
    const fct_simplifier *s = r->s;
    uint32_t n = s->channel_count, wedges[3];
    for (uint32_t k = 0; k < 3; ++k) {
        wedges[k] = s->wedge_parents[s->corner_wedges[3 * (size_t)at->face + k]];
        r->weights[wedges[k]] += weight * b[k];
    }
    for (uint32_t i = 0; i < n; ++i) {
        double rest = 0;
        for (uint32_t k = 0; k < count; ++k) rest += input_value(s, &s->channels[i], corners[k]);
        rest /= count;
        for (uint32_t k = 0; k < 3; ++k) rest -= b[k] * s->attributes[(size_t)n * wedges[k] + i];
        for (uint32_t k = 0; k < 3; ++k) r->sums[(size_t)n * wedges[k] + i] += weight * b[k] * rest;
    }
}

static void add_sample(refit *r, size_t sample, const landing *at) {
    const fct_simplifier *s = r->s;
    if (at->face == FCT_NONE) return;
    uint32_t corners[3], count = sample_corners(r, sample, corners);
    double weight = count == 1 ? r->corner_weights[sample] : .75 * input_area(s, corners[0] / 3);
    const uint32_t *t = s->triangles + 3 * (size_t)at->face;
    v3 a = point_position(s, t[0]), ab = v3_sub(point_position(s, t[1]), a);
    v3 ac = v3_sub(point_position(s, t[2]), a);
    double b[3] = {1 - (double)at->u - at->v, at->u, at->v};
    v3 rest = v3_sub(sample_position(s, corners, count), a);
    rest = v3_sub(rest, v3_add(v3_scale(ab, b[1]), v3_scale(ac, b[2])));
    double residual = v3_norm(rest);
    v3 n = residual > NOISE ? v3_scale(rest, 1 / residual) : v3_unit(v3_cross(ab, ac));
    for (int k = 0; k < 3; ++k) {
        double *system = r->systems[t[k]];
        sym3_add_outer(system, weight * b[k] * b[k], n);
        double g = residual > NOISE ? weight * b[k] * residual : 0;
        system[6] += g * n.x, system[7] += g * n.y, system[8] += g * n.z;
    }
    if (at->attributes) add_attributes(r, corners, count, at, b, weight);
}

/* Solves (A + ridge I) d = g by Cramer's rule; the ridge keeps the determinant away from 0. */
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

static void move_points(refit *r) {
    fct_simplifier *s = r->s;
    for (uint32_t p = 0; p < s->point_count; ++p) {
        if (s->valences[p] == 0 || s->valences[p] > SIMPLIFY_HUB) continue;
        v3 step = v3_scale(solve_damped(r->systems[p]), STEP);
        double length2 = v3_norm2(step), shortest2 = INFINITY;
        if (!(length2 > NOISE * NOISE)) continue;
        v3 from = point_position(s, p);
        uint32_t count = fct_simplify_gather(s, p, s->ring_a);
        for (uint32_t i = 0; i < count; ++i) {
            uint32_t x = s->triangles[corner_next(s->ring_a[i])];
            uint32_t y = s->triangles[corner_previous(s->ring_a[i])];
            shortest2 = fmin(shortest2, v3_norm2(v3_sub(point_position(s, x), from)));
            shortest2 = fmin(shortest2, v3_norm2(v3_sub(point_position(s, y), from)));
        }
        double most2 = MAX_STEP * MAX_STEP * shortest2;
        if (length2 > most2) step = v3_scale(step, sqrt(most2 / length2));
        v3 at = v3_add(from, step);
        if (fct_simplify_folds_over(s, s->ring_a, count, FCT_NONE, from, at)) continue;
        double *position = s->positions + 3 * (size_t)p;
        position[0] = at.x, position[1] = at.y, position[2] = at.z;
        s->sources[p] = FCT_NONE;
    }
}

static void move_attributes(refit *r) {
    fct_simplifier *s = r->s;
    uint32_t n = s->channel_count;
    for (uint32_t w = 0; w < s->wedge_count && n; ++w) {
        if (!(r->weights[w] > 0)) continue;
        for (uint32_t i = 0; i < n; ++i) {
            double *a = &s->attributes[(size_t)n * w + i];
            double moved = *a + r->sums[(size_t)n * w + i] / r->weights[w];
            *a = fmin(fmax(moved, s->channels[i].lower), s->channels[i].upper);
        }
    }
}

/* Resolves parents, drops dead corners from the rings, and gives each wedge of the input its weight. */
static void prepare(refit *r) {
    fct_simplifier *s = r->s;
    for (uint32_t p = 0; p < s->point_count; ++p) s->point_parents[p] = find_root(s->point_parents, p);
    for (uint32_t w = 0; w < s->wedge_count && s->wedge_parents; ++w)
        s->wedge_parents[w] = find_root(s->wedge_parents, w);
    for (uint32_t p = 0; p < s->point_count; ++p)
        if (s->valences[p] <= SIMPLIFY_HUB) fct_simplify_gather(s, p, s->ring_a);
    memset(r->corners, 0xff, s->wedge_count * sizeof *r->corners);
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        if (input_degenerate(s, f)) continue;
        double area = input_area(s, f);
        for (uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
            uint32_t w = input_wedge(s, c);
            if (r->corners[w] == FCT_NONE) r->corners[w] = c;
            r->corner_weights[w] += area / 12;
        }
    }
}

static fct_result run_pass(refit *r, uint32_t pass) {
    fct_simplifier *s = r->s;
    size_t samples = (size_t)s->wedge_count + s->mesh->face_count;
    memset(r->systems, 0, s->point_count * sizeof *r->systems);
    memset(r->sums, 0, (size_t)s->wedge_count * s->channel_count * sizeof *r->sums);
    if (s->channel_count) memset(r->weights, 0, s->wedge_count * sizeof *r->weights);
    for (r->first = 0; r->first < samples; r->first += SAMPLES_AT_ONCE) {
        size_t count = samples - r->first < SAMPLES_AT_ONCE ? samples - r->first : SAMPLES_AT_ONCE;
        double done = (pass + (double)r->first / (double)samples) / s->def->refit_passes;
        fct_result result = fct_progress(s->env, "refit", done);
        if (result != FCT_OK) return result;
        fct_parallel_for(s->env, count, 1024, land_samples, r);
        for (size_t i = 0; i < count; ++i) add_sample(r, r->first + i, &r->landings[i]);
    }
    move_points(r);
    move_attributes(r);
    return FCT_OK;
}

fct_result fct_simplify_refit(fct_simplifier *s) {
    refit r = {.s = s};
    r.corners = fct_allocate(s->env, s->wedge_count, sizeof *r.corners);
    r.corner_weights = fct_allocate_zero(s->env, s->wedge_count, sizeof *r.corner_weights);
    r.landings = fct_allocate(s->env, SAMPLES_AT_ONCE, sizeof *r.landings);
    r.systems = fct_allocate(s->env, s->point_count, sizeof *r.systems);
    r.sums = fct_allocate(s->env, (size_t)s->wedge_count * s->channel_count, sizeof *r.sums);
    r.weights = fct_allocate(s->env, s->channel_count ? s->wedge_count : 0, sizeof *r.weights);
    fct_result result = FCT_OK;
    if (!r.corners || !r.corner_weights || !r.landings || !r.systems || !r.sums || !r.weights)
        result = fct_fail_memory(s->env, "the refit");
    else
        prepare(&r);
    for (uint32_t pass = 0; pass < s->def->refit_passes && result == FCT_OK; ++pass)
        result = run_pass(&r, pass);
    fct_release(s->env, r.corners);
    fct_release(s->env, r.corner_weights);
    fct_release(s->env, r.landings);
    fct_release(s->env, r.systems);
    fct_release(s->env, r.sums);
    fct_release(s->env, r.weights);
    return result;
}
