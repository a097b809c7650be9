/* bvh/near/nearest.c: the nearest point of the surface. A kernel file.
 *
 * 1. The search opens the nearest box first. A plane excludes most leaves whose faces are all too far. In the
 *    others, it bounds the distances of eight triangles at a time in float (measure.h), and the upper bounds
 *    shrink the search at once.
 * 2. Triangles whose lower bound is within reach wait in a short list.
 * 3. At the end, the triangles of the list that are still within reach are measured in double. On most
 *    searches these are one or two, so the answer is exact up to double rounding at the price of float.
 *    Equal distances: the lower face id.
 */
#include "bvh/near/nearest.h"

#include "base/math/simd.h"
#include "bvh/near/descend.h"
#include "bvh/near/triangle.h"

/* Triangles that wait for their measurement in double. Most searches keep fewer than ten. */
enum { WAITING_MAX = 32 };

/* Searches of a batch that go on in turns. While one waits for memory, the others compute. With four, a point
 * near a torso of a million triangles takes 1.13 times as long, with sixteen the same time. */
enum { LANES = 8 };

typedef struct waiting_triangle {
    float lower2; /* square of the lower bound of its distance */
    uint32_t number;
    const fct_leaf *leaf;
} waiting_triangle;

typedef struct search {
    const fct_bvh *bvh;
    v3 point; /* scaled */
    fct_at at;
    double bound; /* the distance of the answer is at most this, or there is no answer */
    float reach2; /* a triangle whose lower bound, squared, is greater is not the answer */
    float limit2; /* a box farther than this, squared, has no better face */
    double best2; /* squared distance of the best face, or of the maximum distance */
    double u, v;
    uint32_t place;
    const fct_leaf *leaf; /* triangle `number` of this leaf is at the place */
    uint32_t number;
    fct_visits visits;
    /* If `normal` is set, best2 stays the maximum distance, and faces compete by their cosine to it. */
    const v3 *normal;
    double agreement, facing2; /* cosine and squared distance of the best face */
    uint32_t waiting_count;
    waiting_triangle waiting[WAITING_MAX];
} search;

static void set_bound(search *s, double bound) {
    s->bound = bound;
    s->limit2 = fct_box_limit2(&s->at, bound);
    s->reach2 = fct_triangle_limit2(&s->at, bound);
}

/* Takes the face if it is in reach and its normal is closer to the wanted one than that of the best face. */
static void consider_facing(search *s, const v3 p[3], double d2, double u, double v, const fct_leaf *leaf,
                            uint32_t number, uint32_t place) {
    if (!(d2 <= s->best2)) return;
    v3 n = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    double agreement = v3_norm2(n) > 0 ? v3_dot(n, *s->normal) : -2;
    const uint32_t *ids = s->bvh->view.face_ids;
    if (s->place != FCT_NONE) {
        if (agreement < s->agreement) return;
        bool tie = agreement == s->agreement;
        if (tie && (d2 > s->facing2 || (d2 == s->facing2 && ids[place] > ids[s->place]))) return;
    }
    s->agreement = agreement, s->facing2 = d2;
    s->u = u, s->v = v, s->place = place, s->leaf = leaf, s->number = number;
}

static void measure_triangle(search *s, const fct_leaf *leaf, uint32_t number) {
    v3 p[3];
    double u, v;
    fct_leaf_triangle(leaf, number, p);
    v3 q = fct_triangle_closest(s->point, p[0], p[1], p[2], &u, &v);
    double d2 = v3_norm2(v3_sub(q, s->point));
    uint32_t place = fct_leaf_place(s->bvh, leaf, number);
    ++s->visits.triangles;
    if (s->normal) {
        consider_facing(s, p, d2, u, v, leaf, number, place);
        return;
    }
    const uint32_t *ids = s->bvh->view.face_ids;
    if (!(d2 < s->best2 || (d2 == s->best2 && (s->place == FCT_NONE || ids[place] < ids[s->place])))) return;
    s->u = u, s->v = v, s->place = place, s->leaf = leaf, s->number = number, s->best2 = d2;
    double distance = sqrt(d2);
    if (distance < s->bound) set_bound(s, distance);
}

/* Measures the waiting triangles that are within reach, and empties the list. */
static void measure_waiting(search *s) {
    for (uint32_t i = 0; i < s->waiting_count; ++i)
        if (!(s->waiting[i].lower2 > s->reach2))
            measure_triangle(s, s->waiting[i].leaf, s->waiting[i].number);
    s->waiting_count = 0;
}

/* Drops the waiting triangles that are out of reach. If that leaves more than half of the list, it measures
 * all, so that the list is rarely full. */
static void make_room(search *s) {
    uint32_t kept = 0;
    for (uint32_t i = 0; i < s->waiting_count; ++i)
        if (!(s->waiting[i].lower2 > s->reach2)) s->waiting[kept++] = s->waiting[i];
    s->waiting_count = kept;
    if (kept > WAITING_MAX / 2) measure_waiting(s);
}

/* Takes the upper bounds of triangles whose bit is set. */
static void shrink_bound(search *s, f8 upper2, uint32_t lanes) {
    float d2[8], least = s->reach2;
    lanes &= f8_lt(upper2, f8_set(least));
    if (!lanes) return;
    f8_store(d2, upper2);
    for (; lanes; lanes &= lanes - 1) {
        float lane2 = d2[__builtin_ctz(lanes)];
        if (lane2 < least) least = lane2;
    }
    double bound = sqrt((double)least) + s->at.margin + s->at.rounding;
    if (bound < s->bound) set_bound(s, bound);
}

/* Bounds the distances of the triangles of a leaf; those within reach join the waiting list. */
static void search_leaf(void *user, uint32_t ref) {
    search *s = user;
    const fct_leaf *leaf = fct_bvh_leaf(s->bvh, ref);
    fct_near_vertices vertices;
    fct_near_vertices_load(leaf, &s->at, &vertices);
    if (!fct_leaf_within(&vertices, leaf->vertex_octets, s->reach2)) return;
    const uint8_t *corners = fct_leaf_corners(leaf);
    for (uint32_t first = 0; first < leaf->count; first += 8, corners += 24) {
        fct_eight_near near = fct_measure_triangles(&vertices, leaf->vertex_octets, corners);
        uint32_t left = leaf->count - first, lanes = left < 8 ? (1u << left) - 1 : 0xffu;
        if (!s->normal) shrink_bound(s, near.upper2, lanes);
        lanes &= fct_triangles_within(&near, s->reach2);
        if (!lanes) continue;
        float upper2[8], plane[8];
        f8_store(upper2, near.upper2), f8_store(plane, near.plane);
        for (; lanes; lanes &= lanes - 1) {
            uint32_t i = (uint32_t)__builtin_ctz(lanes);
            if (s->waiting_count == WAITING_MAX) make_room(s);
            float lower2 = plane[i] > 0 ? plane[i] * (plane[i] / upper2[i]) : 0;
            s->waiting[s->waiting_count++] = (waiting_triangle){lower2, first + i, leaf};
        }
    }
}

/* The corners come from the leaf, which is in the cache: unscaling them is exact. */
static void report_face(const search *s, double distance2, fct_near *out) {
    v3 p[3];
    double scale = s->bvh->scale;
    fct_leaf_triangle(s->leaf, s->number, p);
    *out = (fct_near){.distance2 = distance2 / scale / scale, .u = s->u, .v = s->v, .place = s->place};
    v3 scaled = v3_add(v3_scale(p[0], 1 - s->u - s->v), v3_add(v3_scale(p[1], s->u), v3_scale(p[2], s->v)));
    out->point = fct_bvh_from_scaled(s->bvh, scaled);
}

/* Returns false if there is nothing to search for. */
static inline bool begin_search(search *s, const fct_bvh *bvh, v3 point, const v3 *normal,
                                double max_distance) {
    double size = fabs(point.x) + fabs(point.y) + fabs(point.z);
    if (bvh->embree || !(size < INFINITY) || !(max_distance >= 0)) return false;
    s->bvh = bvh, s->point = fct_bvh_to_scaled(bvh, point), s->normal = normal;
    s->at = fct_at_make(bvh, s->point);
    s->place = FCT_NONE, s->waiting_count = 0;
    s->visits = (fct_visits){0, 0, 0};
    double reach = max_distance * bvh->scale;
    s->best2 = reach * reach;
    set_bound(s, sqrt(s->best2));
    return true;
}

static inline bool end_search(search *s, fct_near *out) {
    measure_waiting(s);
    if (s->place == FCT_NONE) return false;
    report_face(s, s->normal ? s->facing2 : s->best2, out);
    return true;
}

bool fct_nearest_search(const fct_bvh *bvh, v3 point, const v3 *normal, double max_distance, fct_near *out,
                        fct_visits *visits) {
    search s;
    if (!begin_search(&s, bvh, point, normal, max_distance)) return false;
    fct_descend(bvh, fct_measure_children, &s.at, &s.limit2, search_leaf, &s, &s.visits);
    bool found = end_search(&s, out);
    fct_visits_add(visits, &s.visits);
    return found;
}

/* A search on its way. */
typedef struct lane {
    search s;
    fct_descent at;
    fct_near *out;
} lane;

/* Gives the lane the next point that can be searched for. Returns false if there is none. */
static bool start_lane(lane *l, const fct_bvh *bvh, const float *points, size_t count, size_t *next,
                       double max_distance, fct_near *out) {
    while (*next < count) {
        size_t i = (*next)++;
        l->out = &out[i];
        l->out->place = FCT_NONE;
        if (!begin_search(&l->s, bvh, v3_load(points + 3 * i), NULL, max_distance)) continue;
        fct_descent_begin(bvh, &l->at);
        return true;
    }
    return false;
}

void fct_nearest_many(const fct_bvh *bvh, size_t count, const float *points, double max_distance,
                      fct_near *out) {
    lane lanes[LANES], *running[LANES];
    size_t next = 0, active = 0;
    while (active < LANES && start_lane(&lanes[active], bvh, points, count, &next, max_distance, out)) {
        running[active] = &lanes[active];
        ++active;
    }
    while (active) {
        for (size_t i = 0; i < active; ++i) {
            lane *l = running[i];
            search *s = &l->s;
            if (fct_descent_step(bvh, &l->at, fct_measure_children, &s->at, &s->limit2, search_leaf, s,
                                 &s->visits, true))
                continue;
            end_search(s, l->out);
            if (!start_lane(l, bvh, points, count, &next, max_distance, out)) running[i] = running[--active];
        }
    }
}
