/* simplify/state.h: the data of one run: points, wedges, corners, edges and their quadrics.
 *
 *          corner 3f+2          Point: a place. Input vertices at one place share a point (weld.c).
 *              /\               Wedge: an attribute value at a point. A smooth point has one wedge, a point
 *             /  \              on a crease or a texture seam has several. The wedges of a point move
 *            /  f \             together, so seams cannot crack. A mesh without attributes has exactly one
 *           /______\            wedge per point, with the same number.
 *    corner 3f   corner 3f+1    Side c: from corner c to the next corner of the face.
 *
 * A contraction moves the corners of one point to another. A removed face has triangles[3f] == FCT_NONE; its
 * corners stay in the rings until fct_simplify_gather drops them. The longest side of the bounds is 1.
 */
#ifndef FCT_SIMPLIFY_STATE_H
#define FCT_SIMPLIFY_STATE_H

#include <float.h>
#include <string.h>

#include "base/env.h"
#include "base/math/vec.h"
#include "base/union_find.h"
#include "facetree/simplifier.h"
#include "simplify/cost/quadric.h"
#include "simplify/queue.h"
#include "simplify/streams.h"
#include "simplify/topology/curve.h"

enum {
    SIMPLIFY_MAX_CHANNELS = STREAM_FLOATS + 2, /* with u and v */
    SIMPLIFY_MAX_WEDGES = 64, /* at both ends of an edge together; edges with more are not contracted */
    SIMPLIFY_HUB = 512,       /* a point with more faces is a hub: it does not move */
};

enum { EDGE_BOUNDARY = 1, EDGE_BORDER = 2 };

/* Whether the body of a point is closed, and whether its volume lies behind the faces or before them. */
enum { SOLID_NONE, SOLID, SOLID_INSIDE_OUT };

/* One float of an attribute. value * factor is its coordinate in the space of the quadrics. */
typedef struct fct_channel {
    enum { CHANNEL_COLOR, CHANNEL_NORMAL, CHANNEL_TEXCOORD, CHANNEL_LIGHT, CHANNEL_SOURCES } source;
    uint32_t stream; /* of streams.h; unused if it is a texture coordinate */
    uint32_t component;
    double factor;
    double unit;         /* the difference of value * factor that a whole range makes */
    double lower, upper; /* range of value * factor in the input; results are clamped to it */
} fct_channel;

/* A face that remains after a move of a point. */
typedef struct fct_remaining {
    uint32_t corner, x, y; /* the corner at the point that moves, and the next two points */
    bool turned;           /* its normal turns so far that it can fold onto the face across x-y */
    v3 normal;             /* after the move, of any length; 0 if the area is a rounding error */
    double norm2;          /* of `normal` */
} fct_remaining;

/* The freedom of a held point: planes pull it towards its curve; it stays on its line; it stays where it is;
 * its attributes stay, too. */
enum { HOLD_PLANES, HOLD_LINE, HOLD_POINT, HOLD_LOCK };

/* The rules for a point of a boundary, a border or a seam, and for a locked point (cost/constraint.h). */
typedef struct fct_constraint {
    double planes[POSITION_QUADRIC]; /* of the held sides; [10] is the sum of their lengths */
    uint32_t line;                   /* of HOLD_LINE */
    uint8_t hold;
} fct_constraint;

/* A straight part of such a curve. */
typedef struct fct_line {
    v3 origin, direction; /* of unit length */
} fct_line;

/* The faces of an edge from the moved point. */
typedef struct fct_side_mark {
    uint32_t epoch;
    uint32_t first; /* the only face so far, as an index of `remaining`; FCT_NONE after the second */
} fct_side_mark;

/* A point: two lines of the cache. */
typedef struct fct_point {
    v3 at;
    uint32_t source; /* input vertex with exactly this position; FCT_NONE after a move */
    uint32_t valence, first_corner, last_corner;
    double quadric[POSITION_QUADRIC]; /* of the planes of its faces, without attributes */
} fct_point;

/* A contour edge or a point constraint of the caller. */
typedef struct fct_mark {
    double weight;
    double at[3];       /* of a point constraint, in the unit cube */
    uint32_t points[2]; /* of the input; a point constraint has FCT_NONE as the second */
} fct_mark;

/* What one thread needs for the contraction of an edge. */
typedef struct fct_scratch {
    fct_queue queue;
    uint32_t ring_a[SIMPLIFY_HUB], ring_b[SIMPLIFY_HUB]; /* corners around the ends of the current edge */
    fct_remaining remaining[2 * SIMPLIFY_HUB];           /* the faces after the current move */
} fct_scratch;

struct fct_simplifier {
    const fct_env *env;
    const fct_mesh *mesh;
    const fct_simplify_def *def;
    v3 center;
    double extent; /* longest side of the bounds, 1 if that is 0 */
    double step;   /* between floats at the largest coordinate, in units of the mesh */

    uint32_t point_count, wedge_count, edge_count;
    uint32_t face_count, live_faces; /* faces with three distinct points: at the start, and now */
    uint32_t *point_of;              /* vertex -> point; FCT_NONE if no face uses the vertex */

    /* Per point. */
    fct_point *points;
    uint32_t *point_parents; /* the point that this one was contracted to; itself while alive */
    uint32_t *first_wedges;  /* NULL without attributes */

    /* Per corner. */
    uint32_t *triangles;    /* points */
    uint32_t *next_corners; /* next corner at the same point */
    uint32_t *side_edges;
    uint32_t *corner_wedges; /* NULL without attributes; resolve with corner_wedge */

    fct_edge *edges;
    uint8_t *edge_flags; /* per edge: EDGE_BOUNDARY, EDGE_BORDER; valid until the constraints are made */

    /* Pairs of points without a common face (pairs/candidates.h): the edges from first_pair on. Entry
     * 2 (e - first_pair) + k of a list stands for end k of the pair e. NULL without pair_distance. */
    uint32_t first_pair;
    uint32_t *first_pairs, *last_pairs; /* per point: its list of pairs */
    uint32_t *next_pairs;               /* per entry */
    uint8_t *solids;                    /* per point of the input: SOLID_NONE and so on */
    uint8_t *walled;                    /* per point: 1 if a face there vanished as an inner wall */
    uint32_t pairs_joined;
    bool released;            /* planes of walls left quadrics, so costs in the queue may be too high */
    uint32_t released_bucket; /* `current` of the queue at that time */

    /* Per wedge. The first `steering` channels are dimensions of the quadrics; the others are interpolated.
     */
    uint32_t steering, channel_count, quadric_size;
    fct_channel channels[SIMPLIFY_MAX_CHANNELS];
    double *quadrics;   /* x quadric_size, of the faces alone; NULL if no attribute steers */
    double *attributes; /* x channel_count; NULL without attributes */
    uint32_t *wedge_parents, *next_wedges, *wedge_uses;
    uint32_t *wedge_classes; /* wedges of one class are one output vertex: a wedge's number (classes.h) */

    /* NULL if boundary_weight is 0 and nothing is locked. */
    uint32_t *constraint_of; /* per point: its constraint; FCT_NONE if nothing holds it */
    fct_constraint *constraints;
    fct_line *lines;
    uint32_t constraint_count, line_count;

    /* What the caller asks for between runs (handle/paint.h, handle/mark.h). */
    float *paint;                     /* per point of the input: its weight; NULL: all 1 */
    float *weights;                   /* per point: the largest of those it was contracted from; NULL */
    double (*pins)[POSITION_QUADRIC]; /* per point: the sum of its point constraints; NULL: none */
    struct fct_mark *marks;
    size_t mark_count, mark_capacity;

    fct_scratch *scratches; /* one per thread */
    uint32_t scratch_count;
    /* The scratch in use. */
    fct_queue *queue;
    uint32_t *ring_a, *ring_b;
    fct_remaining *remaining;
    uint32_t remaining_count, open_sides; /* of the last move: faces, and edges with one face */
    bool level;                           /* no face turned by more than 25 degrees */
    /* In a sweep (sweep.h), a copy of the simplifier works on one block of points. */
    const uint32_t *blocks;      /* per point: its block; NULL outside of sweeps */
    uint32_t block, least_faces; /* the block, and live_faces at which it stops */
    uint32_t wedge_room;         /* the wedges that contractions of the block may still write */
    uint32_t wall_room;          /* the inner walls that may still vanish in the block */
    double least_height;  /* a face with a smaller height may lose its area when its corners become floats */
    uint8_t *refused;     /* per point: 1 if an edge at the point may be refused */
    uint32_t *link_marks; /* per point; only with keep_topology */
    uint32_t link_epoch;
    fct_side_mark *side_marks; /* per point */
    uint32_t side_epoch;
    double max_error2;   /* largest squared error of a contraction that was made */
    bool priced;         /* the edges have their first costs */
    struct fct_log *log; /* log.h; NULL: nothing is recorded */

    /* Only of a handle (handle/): the sorted input, the options as given, and the snapshots for undo. */
    fct_sorted sorted;
    fct_simplify_def own, given;
    double last_error; /* max_error of the run before */
    struct fct_history *history;
};

static inline void use_scratch(fct_simplifier *s, fct_scratch *scratch) {
    s->queue = &scratch->queue;
    s->ring_a = scratch->ring_a, s->ring_b = scratch->ring_b;
    s->remaining = scratch->remaining;
}
static inline uint32_t edge_root(fct_edge *edges, uint32_t e) {
    while (edges[e].parent != e) {
        edges[e].parent = edges[edges[e].parent].parent;
        e = edges[e].parent;
    }
    return e;
}
static inline uint32_t corner_next(uint32_t c) {
    return c % 3 == 2 ? c - 2 : c + 1;
}
static inline uint32_t corner_previous(uint32_t c) {
    return c % 3 == 0 ? c + 2 : c - 1;
}
static inline bool corner_dead(const fct_simplifier *s, uint32_t c) {
    return s->triangles[c - c % 3] == FCT_NONE;
}
static inline fct_point *point_at(const fct_simplifier *s, uint32_t p) {
    return &s->points[p];
}
static inline v3 point_position(const fct_simplifier *s, uint32_t p) {
    return point_at(s, p)->at;
}
/* The kind of body that the face of a corner belonged to in the input. Only with pair_distance. */
static inline uint8_t find_solid(const fct_simplifier *s, uint32_t corner) {
    return s->solids[s->point_of[s->mesh->triangles[corner]]];
}
/* Without attributes a wedge is its point. Not for meshes whose attributes do not steer. */
static inline double *wedge_quadric(const fct_simplifier *s, uint32_t w) {
    return s->quadrics ? s->quadrics + (size_t)s->quadric_size * w : point_at(s, w)->quadric;
}
/* The floats of a position. Those of a point outside of the range end at its limit. */
static inline void store_written(const fct_simplifier *s, v3 at, float out[3]) {
    v3 p = v3_mad(s->center, s->extent, at);
    const double most = (double)FLT_MAX;
    v3_store(out, (v3){fct_max(-most, fct_min(p.x, most)), fct_max(-most, fct_min(p.y, most)),
                       fct_max(-most, fct_min(p.z, most))});
}
/* The floats of a point's position. A point that never moved keeps the bits of its input vertex. */
static inline void write_point(const fct_simplifier *s, uint32_t point, float out[3]) {
    uint32_t source = point_at(s, point)->source;
    if (source != FCT_NONE)
        memcpy(out, s->mesh->positions + 3 * (size_t)source, 3 * sizeof *out);
    else
        store_written(s, point_position(s, point), out);
}
/* The factor of the cost of contracting a and b. */
static inline double paint_factor(const fct_simplifier *s, uint32_t a, uint32_t b) {
    return s->weights ? fct_max(s->weights[a], s->weights[b]) : 1;
}
static inline bool point_is_pinned(const fct_simplifier *s, uint32_t point) {
    return s->pins && s->pins[point][0] > 0;
}
static inline uint32_t corner_wedge(fct_simplifier *s, uint32_t c) {
    return s->corner_wedges ? fct_sets_find(s->wedge_parents, s->corner_wedges[c]) : s->triangles[c];
}

#endif
