/* simplify/pairs/join.c: see join.h. Cost: linear in the corners of both rings, apart from faces whose two
 * other points belong to both. */
#include "simplify/pairs/join.h"

#include "simplify/collapse.h"
#include "simplify/cost/constraint.h"
#include "simplify/log.h"
#include "simplify/pairs/release.h"

/* Adds the equal faces i and j of the two ends. */
static bool add_wall(const fct_simplifier *s, const fct_remaining *i, const fct_remaining *j,
                     fct_walls *out) {
    bool same_side = i->x == j->x;
    uint8_t solid = find_solid(s, i->corner);
    bool wall = solid != SOLID_NONE && solid == find_solid(s, j->corner);
    if (point_is_locked(s, i->x) || point_is_locked(s, i->y) || (!same_side && !wall))
        return !s->def->check_foldover;
    out->first[out->count] = same_side ? FCT_NONE : i->corner;
    out->second[out->count++] = j->corner;
    return true;
}

static bool is_listed(const fct_walls *walls, uint32_t corner) {
    for (uint32_t i = 0; i < walls->count; ++i)
        if (walls->first[i] == corner) return true;
    return false;
}

bool fct_simplify_find_walls(fct_simplifier *s, const fct_move *move, fct_walls *out) {
    const fct_remaining *r = s->remaining;
    out->count = 0;
    ++s->side_epoch;
    for (uint32_t i = 0; i < move->count_a; ++i)
        s->side_marks[r[i].x].epoch = s->side_marks[r[i].y].epoch = s->side_epoch;
    for (uint32_t j = move->count_a; j < s->remaining_count; ++j) {
        if (s->side_marks[r[j].x].epoch != s->side_epoch || s->side_marks[r[j].y].epoch != s->side_epoch)
            continue;
        for (uint32_t i = 0; i < move->count_a; ++i) {
            bool equal = (r[i].x == r[j].x && r[i].y == r[j].y) || (r[i].x == r[j].y && r[i].y == r[j].x);
            if (!equal || is_listed(out, r[i].corner)) continue;
            if (!add_wall(s, &r[i], &r[j], out)) return false;
            break;
        }
    }
    return true;
}

uint32_t fct_simplify_count_walls(const fct_walls *walls) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < walls->count; ++i) count += 1 + (walls->first[i] != FCT_NONE);
    return count;
}

void fct_simplify_join_classes(fct_simplifier *s, uint32_t point) {
    if (!s->wedge_classes || stream_kinds(s->mesh)) return;
    uint32_t first = s->first_wedges[point];
    for (uint32_t w = s->next_wedges[first]; w != FCT_NONE; w = s->next_wedges[w])
        s->wedge_classes[w] = s->wedge_classes[first];
}

static void remove_face(fct_simplifier *s, uint32_t corner) {
    for (uint32_t k = 0; k < 3; ++k) s->walled[s->triangles[corner - corner % 3 + k]] = 1;
    fct_simplify_remove_face(s, corner / 3);
}

void fct_simplify_remove_walls(fct_simplifier *s, const fct_walls *walls) {
    for (uint32_t i = 0; i < walls->count; ++i) {
        if (s->log) fct_log_wall(s, walls->first[i], walls->second[i]);
        bool wall = walls->first[i] != FCT_NONE;
        if (wall) fct_simplify_release_face(s, walls->first[i] / 3);
        if (wall) fct_simplify_release_face(s, walls->second[i] / 3);
        if (wall) remove_face(s, walls->first[i]);
        remove_face(s, walls->second[i]);
    }
    if (walls->count) s->released_bucket = s->queue->current;
    s->wall_room -= walls->count;
}
