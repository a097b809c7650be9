/* simplify/state.h: what one run of the simplifier holds.
 *
 * Topology lives on points: places in space, which input vertices with equal coordinates share where their
 * faces meet along a side. Attributes
 * live on wedges: the distinct attribute values that meet at a point. A point with one value has one wedge;
 * on a crease or a texture seam it has several, which move together, so that a seam cannot open into a crack.
 * A mesh without attributes has exactly one wedge a point, of the same number.
 *
 * Corner c = 3 f + k. Side c runs from corner c to the next corner of its face. A contraction moves all
 * corners of one point to another; a removed face has triangles[3 f] == FCT_NONE and leaves the rings when
 * these are walked next. Coordinates are in the unit cube around the origin.
 */
#ifndef FCT_SIMPLIFY_STATE_H
#define FCT_SIMPLIFY_STATE_H

#include "base/env.h"
#include "base/math/vec.h"
#include "base/union_find.h"
#include "facetree/simplify.h"
#include "simplify/queue.h"

enum {
    SIMPLIFY_MAX_CHANNELS = 8, /* r g b, u v, and the normal */
    SIMPLIFY_MAX_WEDGES = 64,  /* at both ends of an edge; more are not contracted */
    SIMPLIFY_HUB = 512,        /* a point of more faces than this stays where it is */
};

enum { EDGE_BOUNDARY = 1, EDGE_BORDER = 2 };

/* One float of an attribute: value * factor is its coordinate beside the position. */
typedef struct fct_channel {
    enum { CHANNEL_COLOR, CHANNEL_NORMAL, CHANNEL_TEXCOORD } source;
    uint32_t component;
    double factor;
    double lower, upper; /* of value * factor in the input; results are clamped */
} fct_channel;

typedef struct fct_simplifier {
    const fct_env *env;
    const fct_mesh *mesh;
    const fct_simplify_def *def;
    v3 center;
    double extent; /* of the longest side of the bounds; 1 where that is 0 */

    uint32_t point_count, wedge_count, edge_count;
    uint32_t face_count, live_faces; /* at the start, without degenerate ones, and now */
    uint32_t *point_of;              /* vertex -> point; FCT_NONE when no face uses it */

    /* By point. */
    double *positions;       /* x 3 */
    uint32_t *sources;       /* input vertex whose position it is, FCT_NONE once moved elsewhere */
    uint32_t *point_parents; /* what it was contracted to, itself while alive */
    uint32_t *first_corners, *last_corners, *valences;
    uint32_t *first_wedges; /* NULL without attributes */

    /* By corner. */
    uint32_t *triangles; /* points */
    uint32_t *next_corners;
    uint32_t *side_edges;
    uint32_t *corner_wedges; /* NULL without attributes; resolve with fct_wedge_find */

    fct_edge *edges;
    uint8_t *edge_flags; /* by edge, until the quadrics are made */

    /* By wedge. The first `steering` of `channels` are dimensions of the quadrics. */
    uint32_t steering, channel_count, quadric_size;
    fct_channel channels[SIMPLIFY_MAX_CHANNELS];
    double *quadrics;   /* x quadric_size */
    double *attributes; /* x channel_count, NULL without attributes */
    uint32_t *wedge_parents, *next_wedges, *wedge_uses;
    uint32_t *wedge_classes; /* wedges of one class are one output vertex; resolve with class_parents */
    uint32_t *class_parents;
    uint32_t class_count;

    fct_queue queue;
    uint32_t ring_a[SIMPLIFY_HUB]; /* corners around the ends of the edge at hand */
    uint32_t *ring_b;              /* x face_count */
    uint8_t *refused;              /* by point: an edge there may be refused */
    uint32_t *link_marks;          /* by point, with keep_topology */
    uint32_t link_epoch;
    double max_error2; /* largest squared error of a contraction made */
} fct_simplifier;

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
static inline v3 point_position(const fct_simplifier *s, uint32_t p) {
    return (v3){s->positions[3 * (size_t)p], s->positions[3 * (size_t)p + 1],
                s->positions[3 * (size_t)p + 2]};
}
static inline uint32_t corner_wedge(fct_simplifier *s, uint32_t c) {
    return s->corner_wedges ? fct_sets_find(s->wedge_parents, s->corner_wedges[c]) : s->triangles[c];
}

/* topology.c: points, wedges, rings and edges of the mesh. */
fct_result fct_simplify_topology(fct_simplifier *s);
/* weld.c: point_of, by place on entry, becomes the points; point_count with it. */
fct_result fct_simplify_weld(fct_simplifier *s);
/* channels.c: which attributes there are, their scales, and the wedges' values. */
void fct_simplify_channels(fct_simplifier *s);
fct_result fct_simplify_attributes(fct_simplifier *s);
/* quadric.c: the quadric of every wedge. */
fct_result fct_simplify_quadrics(fct_simplifier *s);
/* link.c: whether contracting b into a keeps the topology, by their rings. */
bool fct_simplify_link_holds(fct_simplifier *s, uint32_t a, uint32_t b, uint32_t count_a, uint32_t count_b);
/* contract.c: whether moving the point of these corners from `from` to `at` turns a face over that does not
 * also touch `other`. */
bool fct_simplify_folds_over(const fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other,
                             v3 from, v3 at);
/* Collects the live corners at a point that is no hub, and drops the dead ones from its list. */
uint32_t fct_simplify_gather(fct_simplifier *s, uint32_t point, uint32_t *ring);
/* Contracts until a stop. */
fct_result fct_simplify_contract(fct_simplifier *s, fct_stop *stop);
/* refit.c: moves the points that are left closer to the input. */
fct_result fct_simplify_refit(fct_simplifier *s);

#endif
