/* tools/make/statues.c: the statues of the museum. Five are fields: a torso and a bust from smooth unions of
 * ellipsoids, a trefoil knot of rope, a ball of gyroid and a spiral shell. The vase is a surface of
 * revolution. All stand on y = 0, are about one unit high, and have fine seeded relief.
 */
#include "tools/make/parts.h"

#include <math.h>

#define TURN 6.28318530717958647692

const char *const make_statue_names[] = {"torso", "knot", "gyroid", "shell", "bust", NULL};

typedef struct ellipsoid {
    double x, y, z, rx, ry, rz, tilt; /* tilt: about the z axis, radians */
    double blend;
} ellipsoid;

/* An ellipsoid, prepared for evaluation. */
typedef struct blob {
    double center[3], inverse[3], cosine, sine, least, largest, blend;
} blob;

enum { MAX_BLOBS = 24 };

typedef struct sculpture {
    uint64_t seed;
    blob blobs[MAX_BLOBS];
    int blob_count;
} sculpture;

/* The smooth union of two fields: a polynomial minimum, which blends values that differ by less than k. */
static double unite_fields(double a, double b, double k) {
    double h = fmax(k - fabs(a - b), 0);
    return fmin(a, b) - h * h / (4 * k);
}

static double intersect_fields(double a, double b, double k) {
    return -unite_fields(-a, -b, k);
}

static void add_blobs(sculpture *s, const ellipsoid *list, int count) {
    for (int k = 0; k < count; ++k) {
        const ellipsoid *e = list + k;
        s->blobs[s->blob_count++] = (blob){{e->x, e->y, e->z},
                                           {1 / e->rx, 1 / e->ry, 1 / e->rz},
                                           cos(e->tilt),
                                           sin(e->tilt),
                                           fmin(e->rx, fmin(e->ry, e->rz)),
                                           fmax(e->rx, fmax(e->ry, e->rz)),
                                           e->blend};
    }
}

/* (|p / r| - 1) min r, or `far` if the value is surely larger. */
static double measure_blob(const blob *e, make_point p, double far) {
    double x = p.x - e->center[0], y = p.y - e->center[1], z = p.z - e->center[2];
    double reach = e->largest * (far + e->least);
    if (reach > 0 && (x * x + y * y + z * z) * e->least * e->least > reach * reach) return far;
    double turned = e->cosine * x + e->sine * y;
    y = (e->cosine * y - e->sine * x) * e->inverse[1], x = turned * e->inverse[0], z *= e->inverse[2];
    return (sqrt(x * x + y * y + z * z) - 1) * e->least;
}

static double unite_all_blobs(const blob *list, int count, make_point p) {
    double f = measure_blob(list, p, INFINITY);
    for (int k = 1; k < count; ++k)
        f = unite_fields(f, measure_blob(list + k, p, f + list[k].blend), list[k].blend);
    return f;
}

/* A cylinder about the y axis with rounded rims, from y = lower to y = upper. */
static double measure_drum(make_point p, double radius, double lower, double upper, double round) {
    double side = sqrt(p.x * p.x + p.z * p.z) - radius, end = fmax(lower - p.y, p.y - upper);
    return intersect_fields(side, end, round);
}

static make_point scale_point(make_point p, double s) {
    return make_p(p.x * s, p.y * s, p.z * s);
}

/* Relief like chiselled stone: broad bumps with finer marks. */
static double carve_stone(make_point p, uint64_t seed, double amount) {
    return amount * (make_noise(scale_point(p, 13), seed) + .4 * make_noise(scale_point(p, 45), seed + 1) +
                     .16 * make_noise(make_p(p.x * 110, p.y * 40, p.z * 110), seed + 2));
}

static const ellipsoid torso[] = {
    {0, .40, 0, .155, .105, .115, 0, 0},
    {-.1, .2, .02, .088, .24, .1, -.05, .045},
    {.1, .19, -.015, .088, .24, .1, .08, .045},
    {.01, .52, 0, .118, .13, .088, 0, .08},
    {0, .665, -.005, .148, .155, .102, -.08, .07},
    {-.07, .70, .068, .068, .055, .05, .1, .045},
    {.07, .71, .068, .068, .055, .05, -.1, .045},
    {-.175, .785, -.01, .075, .062, .07, 0, .055},
    {.175, .765, -.01, .075, .062, .07, 0, .055},
    {-.235, .69, -.03, .048, .14, .052, -.18, .045},
    {.225, .71, .02, .05, .1, .054, .3, .045},
    {.005, .865, .005, .045, .12, .048, -.06, .05},
    {-.075, .355, -.07, .085, .085, .068, 0, .035},
    {.075, .345, -.07, .085, .085, .068, 0, .035},
};

static double evaluate_torso(const void *user, make_point p) {
    const sculpture *r = user;
    double twist = .7 * (p.y - .4), c = cos(twist), s = sin(twist);
    make_point q = make_p(c * p.x + s * p.z - .03 * sin(5 * p.y), p.y, c * p.z - s * p.x);
    double f = unite_all_blobs(r->blobs, r->blob_count, q);
    f = intersect_fields(f, p.y - .945, .015);
    f = unite_fields(f, measure_drum(p, .25, -.06, .07, .03), .03);
    if (fabs(f) < .02) f -= carve_stone(p, r->seed, .0028);
    return intersect_fields(f, -p.y, .01);
}

/* A trefoil: two strands cross every half-plane about the axis. Each strand is a twisted rope. */
static double evaluate_knot(const void *user, make_point p) {
    const sculpture *r = user;
    double x = p.x, y = p.y - .56, z = p.z, ring = .285, wind = .115, tube = .082;
    double rho = fmax(sqrt(x * x + y * y), .05), phi = atan2(y, x) + TURN / 4, best = 1;
    for (int strand = 0; strand < 2; ++strand) {
        double theta = 1.5 * phi + .5 * TURN * strand, u = rho - ring - wind * cos(theta),
               v = z - wind * sin(theta), around = atan2(v, u), distance = sqrt(u * u + v * v);
        double rope = .0075 * cos(7 * around + 15 * phi);
        double rings = .0013 * cos(108 * phi);
        double fade = distance < tube ? distance / tube : 1;
        best = unite_fields(best, distance - tube - fade * fade * (rope + rings), .012);
    }
    best *= .8;
    if (fabs(best) < .01) best -= .0012 * make_noise(scale_point(p, 70), r->seed);
    best = unite_fields(best, measure_drum(p, .17, -.06, .09, .03), .05);
    return intersect_fields(best, -p.y, .01);
}

static double evaluate_gyroid(const void *user, make_point p) {
    const sculpture *r = user;
    double k = TURN / .34, y = p.y - .52, radius = sqrt(p.x * p.x + y * y + p.z * p.z);
    double a = k * p.x + .4, b = k * y + .9, c = k * p.z;
    double g = sin(a) * cos(b) + sin(b) * cos(c) + sin(c) * cos(a);
    double wall = sqrt(g * g + .01) / (1.5 * k) - (.022 + .012 * make_noise(scale_point(p, 3), r->seed + 5));
    double f = intersect_fields(wall, radius - .44, .02);
    f = unite_fields(f, radius - .16, .04);
    if (fabs(f) < .01) f -= .0012 * make_noise(scale_point(p, 60), r->seed);
    f = unite_fields(f, measure_drum(p, .16, -.06, .13, .03), .05);
    return intersect_fields(f, -p.y, .01);
}

/* A ribbed spiral cone that grows by `growth` per turn. The mouth is at the end of the largest turn. */
static double evaluate_shell(const void *user, make_point p) {
    const sculpture *r = user;
    const double growth = 1.32, rate = log(growth) / TURN, largest = .235, top = 1.03, slope = 2.85;
    double rho = sqrt(p.x * p.x + p.z * p.z), phi = atan2(p.z, p.x), f = 1;
    double end = log(largest) / rate,
           ends[3] = {largest * cos(end), top - slope * largest, largest * sin(end)};
    double guess = log(fmin(fmax((top - p.y) / slope, .012), largest)) / rate;
    double first = phi + TURN * (floor((guess - phi) / TURN) - 1);
    double s = exp(rate * first);
    for (int k = 0; k < 4; ++k, first += TURN, s *= growth) {
        if (first > end || s < .008) continue;
        double u = rho - s, v = p.y - (top - slope * s), around = atan2(v, u);
        double rib = 1 + .045 * cos(14 * first) + .02 * cos(9 * around);
        f = unite_fields(f, (sqrt(u * u + v * v) - .62 * s * rib), .06 * s);
    }
    double dx = p.x - ends[0], dy = p.y - ends[1], dz = p.z - ends[2];
    double mouth = sqrt(dx * dx + dy * dy + dz * dz);
    f = fmin(f, mouth - .61 * largest);
    f = intersect_fields(f, .47 * largest - sqrt(pow(dx + .05, 2) + dy * dy + pow(dz - .09, 2)), .03);
    f *= .75;
    if (fabs(f) < .01) f -= .0018 * make_noise(scale_point(p, 55), r->seed);
    f = unite_fields(
        f, unite_fields(measure_drum(p, .21, -.06, .08, .03), measure_drum(p, .075, 0, .34, .02), .08), .05);
    return intersect_fields(f, -p.y, .01);
}

enum { HEAD = 16 };
static const ellipsoid bust[] = {{0, .765, -.02, .118, .14, .15, 0, 0},        /* skull */
                                 {0, .66, .045, .082, .105, .09, 0, .05},      /* face and jaw */
                                 {0, .585, .085, .04, .035, .038, 0, .035},    /* chin */
                                 {0, .775, .09, .082, .035, .04, 0, .03},      /* brow */
                                 {-.055, .69, .085, .034, .035, .034, 0, .03}, /* cheeks */
                                 {.055, .69, .085, .034, .035, .034, 0, .03},
                                 {0, .715, .145, .017, .05, .022, 0, .022}, /* nose */
                                 {0, .69, .158, .023, .017, .02, 0, .016},
                                 {0, .637, .118, .033, .0095, .02, 0, .012}, /* lips */
                                 {0, .618, .115, .027, .01, .02, 0, .012},
                                 {-.118, .7, -.015, .016, .042, .03, .1, .012}, /* ears */
                                 {.118, .7, -.015, .016, .042, .03, -.1, .012},
                                 {0, .5, -.02, .07, .17, .075, 0, .05}, /* neck */
                                 {-.14, .33, -.02, .16, .1, .1, -.2, .07},
                                 {.14, .33, -.02, .16, .1, .1, .2, .07},
                                 {0, .25, .02, .19, .17, .12, 0, .08},
                                 /* HEAD: sockets, eyes */
                                 {-.042, .735, .128, .027, .017, .03, 0, 0},
                                 {.042, .735, .128, .027, .017, .03, 0, 0},
                                 {-.042, .735, .102, .022, .019, .02, 0, 0},
                                 {.042, .735, .102, .022, .019, .02, 0, 0}};

static double evaluate_bust(const void *user, make_point p) {
    const sculpture *r = user;
    double turn = .35 * fmax(0, fmin(1, (p.y - .4) * 5)), c = cos(turn), s = sin(turn);
    make_point q = make_p(c * p.x - s * p.z, p.y, c * p.z + s * p.x);
    double f = unite_all_blobs(r->blobs, HEAD, q);
    for (int k = 0; k < 2; ++k)
        f = intersect_fields(f, -measure_blob(r->blobs + HEAD + k, q, .022 - f), .022);
    for (int k = 0; k < 2; ++k) f = unite_fields(f, measure_blob(r->blobs + HEAD + 2 + k, q, f + .006), .006);
    /* Hair covers the skull, but not the face. */
    double hair = fmax(0, fmin(1, (q.y - .69 - .75 * fmax(0, q.z)) * 14)) * (q.z < .11 ? 1 : 0);
    if (hair > 0 && fabs(f) < .04) {
        double curl = sin(58 * q.y + 6 * make_noise(scale_point(q, 11), r->seed) + 26 * q.z) *
                      cos(46 * q.x + 5 * make_noise(scale_point(q, 9), r->seed + 3));
        f -= hair * (.011 + .0075 * curl);
    }
    f = intersect_fields(f, .155 - p.y, .03);
    f = unite_fields(f, measure_drum(p, .1, .03, .2, .02), .03);
    f = unite_fields(f, measure_drum(p, .15, -.06, .05, .02), .03);
    if (fabs(f) < .01) f -= carve_stone(p, r->seed, .0012);
    return intersect_fields(f, -p.y, .01);
}

int make_statue_mesh(make_mesh *m, make_statue statue, uint32_t triangles, uint64_t seed) {
    sculpture r = {.seed = seed};
    if (statue == MAKE_TORSO) add_blobs(&r, torso, sizeof torso / sizeof *torso);
    if (statue == MAKE_BUST) add_blobs(&r, bust, sizeof bust / sizeof *bust);
    const make_field fields[MAKE_STATUES] = {
        {evaluate_torso, &r, 1.6, {-.40, 0, -.32}, {.40, 1.0, .32}},
        {evaluate_knot, &r, 2.4, {-.52, 0, -.24}, {.52, 1.1, .24}},
        {evaluate_gyroid, &r, 1.7, {-.47, 0, -.47}, {.47, 1.0, .47}},
        {evaluate_shell, &r, 1.9, {-.48, 0, -.48}, {.48, 1.06, .48}},
        {evaluate_bust, &r, 2.2, {-.36, 0, -.22}, {.36, .96, .24}},
    };
    return make_surface(m, fields + statue, triangles);
}

/* --- The vase --- */

/* Radius and height of the vase at s in [0, 1]: from the middle of the foot up the outside, over the lip,
 * down the inside. */
static void find_vase_profile(double s, double *radius, double *height, double *flute) {
    static const double knots[][2] = {
        {0, 0},       {.13, 0},    {.155, .012}, {.15, .035}, {.085, .07}, {.075, .1},  {.12, .17},
        {.21, .32},   {.245, .47}, {.225, .62},  {.15, .76},  {.095, .84}, {.09, .89},  {.13, .95},
        {.165, .985}, {.17, 1},    {.155, 1},    {.12, .955}, {.075, .89}, {.075, .84}, {.13, .76},
        {.2, .62},    {.22, .47},  {.19, .33},   {.1, .2},    {0, .16}};
    enum { KNOTS = sizeof knots / sizeof *knots };
    double at = s * (KNOTS - 1), value[2];
    int k = (int)fmin(floor(at), KNOTS - 2);
    double t = at - k;
    for (int c = 0; c < 2; ++c) { /* Catmull-Rom */
        double p0 = knots[k > 0 ? k - 1 : 0][c], p1 = knots[k][c], p2 = knots[k + 1][c],
               p3 = knots[k + 2 < KNOTS ? k + 2 : k + 1][c];
        value[c] =
            p1 + .5 * t * (p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)));
    }
    *radius = fmax(0, value[0]);
    *height = fmax(0, value[1]);
    double belly = fmin(1, fmax(0, (*height - .12) * 8)) * fmin(1, fmax(0, (.78 - *height) * 6));
    *flute = s < .6 ? belly : 0;
}

void make_vase(make_mesh *m, uint32_t triangles) {
    /* Choose segments and rows so that the number of triangles is as close as possible. */
    uint32_t best_segments = 24, best_rows = 8;
    double best = INFINITY, ideal = sqrt(.4 * triangles);
    for (uint32_t segments = (uint32_t)fmax(12, .75 * ideal); segments <= fmax(16, 1.3 * ideal); ++segments) {
        uint32_t rows = (uint32_t)fmax(4, lround(triangles / (2. * segments)));
        double off = fabs(2. * segments * rows - triangles);
        if (off < best) best = off, best_segments = segments, best_rows = rows;
    }
    uint32_t segments = best_segments, rows = best_rows + 1, first = (uint32_t)m->vertex_count;
    make_reserve(m, (size_t)segments * rows, (size_t)2 * segments * rows);
    for (uint32_t j = 0; j <= rows; ++j) {
        double radius, height, flute;
        find_vase_profile((double)j / rows, &radius, &height, &flute);
        bool pole = j == 0 || j == rows;
        for (uint32_t i = 0; i < (pole ? 1 : segments); ++i) {
            double angle = TURN * i / segments, wave = cos(18 * angle + 7 * height);
            double out = radius + flute * .011 * (fabs(wave) - .6 + .25 * cos(40 * TURN * height));
            make_vertex(m, make_p(pole ? 0 : out * cos(angle), height, pole ? 0 : out * sin(angle)));
        }
    }
    for (uint32_t j = 0; j < rows; ++j)
        for (uint32_t i = 0; i < segments; ++i) {
            uint32_t next = (i + 1) % segments, low = first + 1 + (j - 1) * segments, high = low + segments;
            uint32_t top = first + 1 + (rows - 1) * segments;
            if (j == 0)
                make_triangle(m, first, first + 1 + i, first + 1 + next);
            else if (j == rows - 1)
                make_triangle(m, low + i, top, low + next);
            else
                make_quad(m, low + i, high + i, high + next, low + next);
        }
}
