/* bvh/pair/collide.c: the public queries on two models. */
#include "bvh/pair/hint.h"
#include "bvh/pair/search.h"
#include "bvh/pair/triangles.h"

static bool is_pair(const fct_pair_map *map, const fct_face_pair *pair) {
    return pair && pair->place_a < map->a->view.face_count && pair->place_b < map->b->view.face_count;
}

static void read_pair(const fct_pair_map *map, const fct_face_pair *pair, v3 p[3], v3 q[3]) {
    fct_pair_triangle_a(map, pair->place_a, p);
    fct_pair_triangle_b(map, pair->place_b, q);
}

static fct_face_pair make_pair(const fct_pair_map *map, uint32_t place_a, uint32_t place_b) {
    return (fct_face_pair){map->a->view.face_ids[place_a], map->b->view.face_ids[place_b], place_a, place_b};
}

/* Whether both faces exist and have area. Reads their corners. */
static bool read_faces(const fct_pair_map *map, const fct_face_pair *pair, v3 p[3], v3 q[3]) {
    if (!is_pair(map, pair)) return false;
    if (fct_bvh_degenerate(map->a, pair->place_a) || fct_bvh_degenerate(map->b, pair->place_b)) return false;
    read_pair(map, pair, p, q);
    return true;
}

static bool hint_meets(const fct_pair_map *map, fct_pair_hint *hint) {
    v3 p[3], q[3];
    if (!hint || hint->stale || !read_faces(map, &hint->pair, p, q) || !fct_triangles_meet(p, q))
        return false;
    hint->pair = make_pair(map, hint->pair.place_a, hint->pair.place_b);
    return true;
}

/* The nearest faces found, unless the surfaces are over `most` apart. */
static fct_near_pair begin_near_pair(const fct_pair_map *map, double most, const fct_pair_hint *hint) {
    fct_near_pair best = {.distance2 = most * most, .place_a = FCT_NONE, .place_b = FCT_NONE};
    if (!hint || !is_pair(map, &hint->pair)) return best;
    fct_near_pair known = {.place_a = hint->pair.place_a, .place_b = hint->pair.place_b};
    v3 p[3], q[3];
    read_pair(map, &hint->pair, p, q);
    known.distance2 = fct_triangles_distance(p, q, &known.point_a, &known.point_b);
    return known.distance2 <= best.distance2 ? known : best;
}

/* Whether the next query does without a front. */
static bool is_paused(fct_pair_hint *hint) {
    if (hint->touching || !hint->pause) return false;
    --hint->pause;
    return true;
}

static bool find_overlap(const fct_pair_map *map, fct_pair_hint *hint, fct_visits *visits) {
    fct_face_pair found;
    if (!hint) return fct_overlap_search(map, 1, 1, &found, visits) > 0;
    fct_hint_move(map, hint, false);
    bool meet = hint_meets(map, hint);
    if (!meet)
        meet = is_paused(hint) ? fct_overlap_search(map, 1, 1, &hint->pair, visits) > 0
                               : fct_front_search(map, hint, -1, visits);
    hint->stale = !meet;
    return meet;
}

bool fct_bvh_overlap(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, fct_pair_hint *hint,
                     fct_visits *visits) {
    fct_pair_map map;
    return fct_pair_map_set(a, b, pose, &map) && find_overlap(&map, hint, visits);
}

size_t fct_bvh_pairs(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, size_t limit, size_t capacity,
                     fct_face_pair *pairs, fct_pair_hint *hint, fct_visits *visits) {
    fct_pair_map map;
    if (!fct_pair_map_set(a, b, pose, &map)) return 0;
    if (hint && !find_overlap(&map, hint, visits)) return 0;
    return fct_overlap_search(&map, limit, capacity, pairs, visits);
}

size_t fct_bvh_self_pairs(const fct_bvh *bvh, size_t limit, size_t capacity, fct_face_pair *pairs,
                          fct_visits *visits) {
    fct_pair_map map;
    if (!fct_pair_map_set(bvh, bvh, NULL, &map)) return 0;
    return fct_self_search(&map, limit, capacity, pairs, visits);
}

bool fct_bvh_contact(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, const fct_face_pair *pair,
                     fct_contact *out) {
    fct_pair_map map;
    v3 p[3], q[3];
    return fct_pair_map_set(a, b, pose, &map) && read_faces(&map, pair, p, q) &&
           fct_triangles_contact(p, q, out);
}

fct_distance_def fct_distance_def_default(void) {
    return (fct_distance_def){.size = sizeof(fct_distance_def), .max_distance = INFINITY};
}

static bool find_distance(const fct_pair_map *map, const fct_distance_def *def, fct_pair_hint *hint,
                          fct_distance *out, fct_visits *visits) {
    if (!(def->max_distance >= 0) || !(def->relative >= 0) || !(def->absolute >= 0)) return false;
    fct_near_pair best = begin_near_pair(map, def->max_distance, hint);
    fct_distance_search(map, def->relative, def->absolute, 0, &best, visits);
    if (best.place_a == FCT_NONE) return false;
    *out =
        (fct_distance){.distance = sqrt(best.distance2), .pair = make_pair(map, best.place_a, best.place_b)};
    out->point_a[0] = best.point_a.x, out->point_a[1] = best.point_a.y, out->point_a[2] = best.point_a.z;
    out->point_b[0] = best.point_b.x, out->point_b[1] = best.point_b.y, out->point_b[2] = best.point_b.z;
    if (hint) hint->pair = out->pair, hint->stale = false;
    return true;
}

bool fct_bvh_distance(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, const fct_distance_def *def,
                      fct_pair_hint *hint, fct_distance *out, fct_visits *visits) {
    fct_distance_def standard = fct_distance_def_default();
    fct_pair_map map;
    if (!def) def = &standard;
    if (def->size != sizeof *def || !fct_pair_map_set(a, b, pose, &map)) return false;
    return find_distance(&map, def, hint, out, visits);
}

/* Up to this distance, scaled, the search of contacts also finds near faces. */
#define FRONT_DISTANCE 1.0

bool fct_bvh_within(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, double distance,
                    fct_pair_hint *hint, fct_visits *visits) {
    fct_pair_map map;
    if (!(distance >= 0) || !fct_pair_map_set(a, b, pose, &map)) return false;
    fct_near_pair best = begin_near_pair(&map, distance, hint && !hint->stale ? hint : NULL);
    if (hint) fct_hint_move(&map, hint, true);
    bool found = best.place_a != FCT_NONE;
    if (!found && hint && distance * a->scale <= FRONT_DISTANCE && !is_paused(hint)) {
        found = fct_front_search(&map, hint, distance, visits);
    } else if (!found) {
        fct_distance_search(&map, 0, 0, distance, &best, visits);
        found = best.place_a != FCT_NONE;
        if (hint && found) hint->pair = make_pair(&map, best.place_a, best.place_b);
    }
    if (hint) hint->stale = !found;
    return found;
}
