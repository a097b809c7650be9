/* scene/rays.c: closest hit, any hit and all hits through the instances.
 *
 * A plain loop tests the eight children of a node, so that compilers vectorise it. The traversal visits the
 * nearest child first. At an instance it transforms the ray to the model without normalising the direction,
 * so t means the same in both spaces; an instance without a transform gets the ray unchanged.
 *
 * No box loses a hit: the box test allows for the rounding of its products, and instance boxes have slack for
 * the rounding of the transformed ray (transform.c). Equal t: the lower instance.
 */
#include "scene/rays.h"

#include <float.h>
#include <math.h>

#include "base/sift.h"
#include "bvh/ray/ray.h"
#include "scene/scene.h"
#include "scene/transform.h"

enum { STACK = FCT_SCENE_DEPTH * (FCT_SCENE_WIDTH - 1) + 1 };
#define ROUNDING    4e-7f
#define COINCIDENCE 1e-6f

typedef struct slabs {
    float origin[3], inverse[3];
    int near[3]; /* row of fct_scene_node.bounds where the ray enters a slab; it leaves at row near ^ 1 */
} slabs;

/* Returns false for a ray that hits nothing: a component that is not finite, no direction, or t_min > t_max.
 */
static inline bool prepare_slabs(const fct_ray *ray, slabs *s) {
    bool moving = false;
    for (int c = 0; c < 3; ++c) {
        float o = ray->origin[c], d = ray->direction[c];
        if (!isfinite(o) || !isfinite(d)) return false;
        moving |= d != 0;
        s->origin[c] = o;
        s->inverse[c] = fabsf(d) > FLT_MIN ? 1 / d : copysignf(1 / FLT_MIN, d);
        s->near[c] = 2 * c + (signbit(d) ? 1 : 0);
    }
    return moving && ray->t_min <= ray->t_max;
}

/* Entry distances of the eight children, or INFINITY for a child that the ray misses. */
static inline void meet_children(const fct_scene_node *node, const slabs *s, float t_min, float t_max,
                                 float entry[FCT_SCENE_WIDTH]) {
    const float *x0 = node->bounds[s->near[0]], *x1 = node->bounds[s->near[0] ^ 1];
    const float *y0 = node->bounds[s->near[1]], *y1 = node->bounds[s->near[1] ^ 1];
    const float *z0 = node->bounds[s->near[2]], *z1 = node->bounds[s->near[2] ^ 1];
    float ox = s->origin[0], oy = s->origin[1], oz = s->origin[2];
    float ix = s->inverse[0], iy = s->inverse[1], iz = s->inverse[2];
    for (int k = 0; k < FCT_SCENE_WIDTH; ++k) {
        float nx = (x0[k] - ox) * ix, ny = (y0[k] - oy) * iy, nz = (z0[k] - oz) * iz;
        float fx = (x1[k] - ox) * ix, fy = (y1[k] - oy) * iy, fz = (z1[k] - oz) * iz;
        float near = nx > ny ? nx : ny, far = fx < fy ? fx : fy;
        near = nz > near ? nz : near, far = fz < far ? fz : far;
        /* Each distance has three roundings, below ROUNDING together. A product keeps the infinities of an
         * empty child. */
        near *= near > 0 ? 1 - ROUNDING : 1 + ROUNDING, far *= far > 0 ? 1 + ROUNDING : 1 - ROUNDING;
        near = near > t_min ? near : t_min, far = far < t_max ? far : t_max;
        entry[k] = near <= far ? near : INFINITY;
    }
}

static inline void move_ray_to_model(const fct_scene_frame *frame, const fct_ray *ray, float t_max,
                                     fct_ray *out) {
    const double *m = frame->to_model;
    const float *l = frame->linear, *d = ray->direction;
    double x = ray->origin[0], y = ray->origin[1], z = ray->origin[2];
    for (int i = 0; i < 3; ++i) {
        out->origin[i] = (float)(m[4 * i] * x + m[4 * i + 1] * y + m[4 * i + 2] * z + m[4 * i + 3]);
        out->direction[i] = l[3 * i] * d[0] + l[3 * i + 1] * d[1] + l[3 * i + 2] * d[2];
    }
    out->t_min = ray->t_min;
    out->t_max = t_max;
}

typedef struct pending {
    float entry;
    uint32_t child;
} pending;

/* Pushes the children that the ray enters, the nearest on top. */
static inline int push_children_sorted(const fct_scene_node *node, const float entry[FCT_SCENE_WIDTH],
                                       pending *stack, int top) {
    int base = top;
    for (int k = 0; k < FCT_SCENE_WIDTH; ++k) {
        if (!(entry[k] < INFINITY)) continue;
        int place = top++;
        while (place > base && stack[place - 1].entry < entry[k]) stack[place] = stack[place - 1], --place;
        stack[place] = (pending){entry[k], node->child[k]};
    }
    return top;
}

/* The state of a search for the closest hit. */
typedef struct search {
    fct_hit best;
    uint32_t instance; /* of best, or FCT_NONE */
    float limit;       /* t of best, or t_max */
    float base; /* largest coordinate of the origin over that of the direction; negative: no lamps first */
    bool lit;   /* best is a lamp's lit side */
} search;

/* Surfaces whose hits differ by less than this coincide: a hit's t has roundings of the size of the
 * coordinates. */
static inline float coincidence(const search *s) {
    return s->base < 0 || s->instance == FCT_NONE ? 0 : COINCIDENCE * (s->limit + s->base);
}

static inline bool is_lit_side(const fct_scene_frame *frame, const fct_ray *local, const fct_hit *hit) {
    if (!frame->emits || frame->two_sided) return frame->emits;
    const float *d = local->direction, *n = hit->normal; /* the sign is that of the world */
    return d[0] * n[0] + d[1] * n[1] + d[2] * n[2] < 0;
}

static inline void meet_instance(const fct_scene *scene, const fct_ray *ray, uint32_t i, search *s,
                                 fct_visits *visits) {
    const fct_scene_frame *frame = scene->frames + i;
    const bool lamps_first = s->base >= 0, behind = lamps_first && frame->emits && !s->lit;
    const float slack = coincidence(s), reach = behind ? s->limit + slack : s->limit;
    fct_ray local = *ray;
    fct_hit found;
    local.t_max = reach;
    if (!frame->identity) move_ray_to_model(frame, ray, reach, &local);
    if (!fct_bvh_closest_hit(frame->bvh, &local, &found, visits) || found.t > reach) return;
    const bool lit = lamps_first && is_lit_side(frame, &local, &found);
    if (s->instance != FCT_NONE) {
        if (lit == s->lit ? found.t > s->limit || (found.t == s->limit && i > s->instance)
                          : !lit && found.t >= s->limit - slack)
            return;
    }
    s->best = found, s->limit = found.t, s->instance = i, s->lit = lit;
}

/* Takes the normal of a model to the world. */
static inline void set_world_normal(const fct_scene *scene, const float model[3], fct_scene_hit *hit) {
    v3 normal = v3_load(model);
    if (!scene->frames[hit->instance].identity) {
        /* Normalised first, so that the products of a tiny or huge normal stay in range. */
        const fct_instance *placed = scene->instances + hit->instance;
        normal = fct_transform_normal(placed->normal_matrix, v3_unit(normal));
        if (placed->mirrored) normal = v3_scale(normal, -1);
    }
    v3_store(hit->normal, v3_unit(normal));
}

static inline bool find_closest(const fct_scene *scene, const fct_ray *ray, bool lamps_first,
                                fct_scene_hit *hit, fct_visits *visits) {
    slabs box;
    pending stack[STACK];
    int top = 0;
    search s = {.instance = FCT_NONE, .limit = ray->t_max, .base = -1};
    hit->instance = hit->face = FCT_NONE;
    if (!prepare_slabs(ray, &box)) return false;
    if (lamps_first) {
        float o = 0, d = FLT_MIN;
        for (int c = 0; c < 3; ++c) {
            o = fabsf(ray->origin[c]) > o ? fabsf(ray->origin[c]) : o;
            d = fabsf(ray->direction[c]) > d ? fabsf(ray->direction[c]) : d;
        }
        s.base = o / d;
    }
    stack[top++] = (pending){ray->t_min, 0};
    while (top > 0) {
        pending next = stack[--top];
        const float reach = s.limit + coincidence(&s);
        if (next.entry > reach) continue;
        if (next.child & FCT_SCENE_LEAF) {
            meet_instance(scene, ray, next.child & ~FCT_SCENE_LEAF, &s, visits);
            continue;
        }
        float entry[FCT_SCENE_WIDTH];
        meet_children(scene->nodes + next.child, &box, ray->t_min, reach, entry);
        top = push_children_sorted(scene->nodes + next.child, entry, stack, top);
        if (visits) visits->nodes += 1, visits->boxes += FCT_SCENE_WIDTH;
    }
    if (s.instance == FCT_NONE) return false;
    hit->instance = s.instance;
    hit->t = s.best.t, hit->u = s.best.u, hit->v = s.best.v;
    hit->face = s.best.face, hit->place = s.best.place;
    set_world_normal(scene, s.best.normal, hit);
    return true;
}

bool fct_scene_closest_hit(const fct_scene *scene, const fct_ray *ray, fct_scene_hit *hit,
                           fct_visits *visits) {
    return find_closest(scene, ray, false, hit, visits);
}

bool fct_scene_light_hit(const fct_scene *scene, const fct_ray *ray, fct_scene_hit *hit, fct_visits *visits) {
    return find_closest(scene, ray, true, hit, visits);
}

/* Calls visit(user, instance, ray) for the instances whose boxes the ray meets, with the ray in the model's
 * space, until one call returns true. Returns whether one did. */
typedef bool fct_visit_instance(void *user, uint32_t instance, const fct_ray *local, fct_visits *visits);
static inline bool visit_instances(const fct_scene *scene, const fct_ray *ray, fct_visit_instance *visit,
                                   void *user, fct_visits *visits) {
    slabs s;
    uint32_t stack[STACK];
    int top = 0;
    if (!prepare_slabs(ray, &s)) return false;
    stack[top++] = 0;
    while (top > 0) {
        uint32_t child = stack[--top];
        if (!(child & FCT_SCENE_LEAF)) {
            const fct_scene_node *node = scene->nodes + child;
            float entry[FCT_SCENE_WIDTH];
            meet_children(node, &s, ray->t_min, ray->t_max, entry);
            for (int k = 0; k < FCT_SCENE_WIDTH; ++k)
                if (entry[k] < INFINITY) stack[top++] = node->child[k];
            if (visits) visits->nodes += 1, visits->boxes += FCT_SCENE_WIDTH;
            continue;
        }
        const uint32_t i = child & ~FCT_SCENE_LEAF;
        const fct_scene_frame *frame = scene->frames + i;
        fct_ray local;
        if (!frame->identity) move_ray_to_model(frame, ray, ray->t_max, &local);
        if (visit(user, i, frame->identity ? ray : &local, visits)) return true;
    }
    return false;
}

static bool meets_instance(void *user, uint32_t instance, const fct_ray *local, fct_visits *visits) {
    const fct_scene *const *scene = user;
    return fct_bvh_any_hit((*scene)->frames[instance].bvh, local, visits);
}

bool fct_scene_any_hit(const fct_scene *scene, const fct_ray *ray, fct_visits *visits) {
    return visit_instances(scene, ray, meets_instance, &scene, visits);
}

/* The first `capacity` hits so far: a heap, the last hit on top. */
typedef struct hit_list {
    const fct_scene *scene;
    fct_scene_hit *hits;
    size_t capacity, found; /* found counts all hits */
    uint32_t instance;      /* that the ray meets now */
} hit_list;

static bool is_before(const void *items, size_t i, size_t j) {
    const fct_scene_hit *a = (const fct_scene_hit *)items + i, *b = (const fct_scene_hit *)items + j;
    if (a->t != b->t) return a->t < b->t;
    return a->instance != b->instance ? a->instance < b->instance : a->face < b->face;
}

static void swap_hits(void *items, size_t i, size_t j) {
    fct_scene_hit *hits = items, kept = hits[i];
    hits[i] = hits[j];
    hits[j] = kept;
}

static void keep_hit(void *user, const fct_hit *found) {
    hit_list *list = user;
    const fct_scene_hit hit = {.t = found->t,
                               .u = found->u,
                               .v = found->v,
                               .instance = list->instance,
                               .face = found->face,
                               .place = found->place};
    size_t count = list->found++;
    if (count < list->capacity) {
        list->hits[count] = hit;
        fct_sift_up(list->hits, count, is_before, swap_hits);
    } else if (list->capacity) {
        const fct_scene_hit both[2] = {hit, list->hits[0]};
        if (!is_before(both, 0, 1)) return;
        list->hits[0] = hit;
        fct_sift_down(list->hits, 0, list->capacity, is_before, swap_hits);
    }
}

static const fct_bvh *get_obb(const fct_scene *scene, uint32_t instance) {
    const fct_scene_model *own = scene->own + scene->instances[instance].model;
    return own->points ? own->points : own->bvh;
}

static bool list_hits(void *user, uint32_t instance, const fct_ray *local, fct_visits *visits) {
    hit_list *list = user;
    list->instance = instance;
    fct_ray_visit_hits(get_obb(list->scene, instance), local, keep_hit, list, visits);
    return false;
}

size_t fct_scene_all_hits(const fct_scene *scene, const fct_ray *ray, size_t capacity, fct_scene_hit *hits,
                          fct_visits *visits) {
    hit_list list = {.scene = scene, .hits = hits, .capacity = capacity};
    visit_instances(scene, ray, list_hits, &list, visits);
    size_t kept = list.found < capacity ? list.found : capacity;
    fct_sift_sort(hits, kept, is_before, swap_hits);
    for (size_t i = 0; i < kept; ++i) {
        fct_hit hit = {.place = hits[i].place};
        fct_hit_set_normal(get_obb(scene, hits[i].instance), &hit);
        set_world_normal(scene, hit.normal, &hits[i]);
    }
    return list.found;
}
