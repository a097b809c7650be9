/* simplify/topology/remain.c: see remain.h.
 *
 * 1. List the remaining faces with their new normals. A face that turns too far or loses its area ends the
 *    test. If a is a hub, of its faces only those at the neighbours of b are listed.
 * 2. Each face marks its two edges from the moved point. The second face of an edge is compared with the
 *    first: they may be equal, or folded onto each other. A third face may be the start of a non-manifold
 *    edge.
 * 3. A face that turned by more than 4 degrees in a contraction, or at all in the refit, is compared with the
 *    face across its third side, which does not move.
 * Cost: O(faces), plus the valence of a neighbour per turned face and per face at a hub.
 */
#include "simplify/topology/remain.h"

#include "simplify/cost/constraint.h"

#include "simplify/topology/ring.h"

/* Cosine of the largest angle by which the normal of a face may turn in one contraction: 84 degrees. */
#define MIN_TURN_COSINE .1
/* A face that turns by less cannot come from an open fold to a closed one: the cosine of 4 degrees, squared.
 */
#define SMALL_TURN .995
/* Two faces at an edge are folded if the cosine between their normals is below -.9. */
#define FOLD_COSINE .9
/* The faces of a level fan are at most 25 degrees from the mean, before and after. */
#define LEVEL_COSINE .9
/* No squared side in the unit cube is longer, apart from rounding and moves out of it. */
#define LONGEST2 4

void fct_simplify_begin_move(fct_simplifier *s) {
    s->remaining_count = 0;
    s->level = true;
}

/* The area of a face, times 2 and squared, after its corners became floats. */
static double find_written_area2(const fct_simplifier *s, v3 a, v3 b, v3 c) {
    const v3 at[3] = {a, b, c};
    v3 written[3];
    for (int k = 0; k < 3; ++k) {
        float p[3];
        store_written(s, at[k], p);
        written[k] = v3_load(p);
    }
    return v3_norm2(v3_cross(v3_sub(written[1], written[0]), v3_sub(written[2], written[0])));
}

/* Whether the height of the face over its longest side is below least_height. cross2: its area, times 2 and
 * squared. */
static bool is_thin(const fct_simplifier *s, v3 a, v3 b, v3 c, double cross2) {
    double longest2 =
        fct_max(v3_norm2(v3_sub(b, a)), fct_max(v3_norm2(v3_sub(c, b)), v3_norm2(v3_sub(a, c))));
    return cross2 < s->least_height * s->least_height * longest2;
}

/* Whether a thin face was better before. */
static bool loses_area(const fct_simplifier *s, v3 from, v3 at, v3 x, v3 y, double before2) {
    return !is_thin(s, from, x, y, before2) ||
           (find_written_area2(s, at, x, y) == 0 && find_written_area2(s, from, x, y) > 0);
}

bool fct_simplify_folds_over(fct_simplifier *s, const uint32_t *ring, uint32_t count, uint32_t other, v3 from,
                             v3 at) {
    bool strict = s->def->check_foldover;
    double small2 = LONGEST2 * s->least_height * s->least_height;
    fct_remaining *out = s->remaining + s->remaining_count;
    bool level = s->level;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t x = s->triangles[corner_next(ring[i])], y = s->triangles[corner_previous(ring[i])];
        if (x == other || y == other) continue;
        v3 px = point_position(s, x), py = point_position(s, y), side = v3_sub(py, px);
        v3 before = v3_cross(v3_sub(px, from), side), after = v3_cross(v3_sub(px, at), side);
        double before2 = v3_norm2(before), after2 = v3_norm2(after), dot = v3_dot(before, after);
        double dot2 = dot * dot, product2 = before2 * after2;
        if (strict && !(dot > 0 && dot2 > MIN_TURN_COSINE * MIN_TURN_COSINE * product2) && before2 > 0)
            return true;
        *out = (fct_remaining){ring[i], x, y, dot2 < SMALL_TURN * product2, after, after2};
        level &= dot2 > LEVEL_COSINE * LEVEL_COSINE * product2;
        if (after2 < small2 && is_thin(s, at, px, py, after2)) {
            if (strict && before2 > 0 && loses_area(s, from, at, px, py, before2)) return true;
            out->normal = (v3){0, 0, 0}, out->norm2 = 0;
        }
        ++out;
    }
    s->remaining_count = (uint32_t)(out - s->remaining);
    s->level = level;
    return false;
}

static v3 find_normal(const fct_simplifier *s, uint32_t corner) {
    v3 p = point_position(s, s->triangles[corner]), x = point_position(s, s->triangles[corner_next(corner)]);
    return v3_cross(v3_sub(x, p), v3_sub(point_position(s, s->triangles[corner_previous(corner)]), x));
}

static bool is_folded(v3 n, double n2, v3 m, double m2, bool same_direction) {
    double dot = same_direction ? -v3_dot(n, m) : v3_dot(n, m);
    return dot < 0 && dot * dot > FOLD_COSINE * FOLD_COSINE * n2 * m2;
}

/* Whether the first two faces of the edge point-x are folded now. */
static bool is_edge_folded(const fct_simplifier *s, uint32_t point, uint32_t x) {
    if (point == FCT_NONE) return false;
    if (point_at(s, x)->valence < point_at(s, point)->valence) {
        uint32_t swap = x;
        x = point, point = swap;
    }
    uint32_t first = fct_simplify_find_side(s, point_at(s, point)->first_corner, x);
    if (first == FCT_NONE) return false;
    uint32_t second = fct_simplify_find_side(s, s->next_corners[first], x);
    if (second == FCT_NONE) return false;
    v3 n = find_normal(s, first), m = find_normal(s, second);
    bool same = (s->triangles[corner_next(first)] == x) == (s->triangles[corner_next(second)] == x);
    return is_folded(n, v3_norm2(n), m, v3_norm2(m), same);
}

/* The number of faces of the edge point-x now, at most 3. */
static uint32_t count_faces(const fct_simplifier *s, uint32_t point, uint32_t x) {
    if (point_at(s, x)->valence < point_at(s, point)->valence) {
        uint32_t swap = x;
        x = point, point = swap;
    }
    uint32_t count = 0;
    for (uint32_t c = point_at(s, point)->first_corner; count < 3; c = s->next_corners[c], ++count) {
        c = fct_simplify_find_side(s, c, x);
        if (c == FCT_NONE) break;
    }
    return count;
}

static bool is_listed(const fct_simplifier *s, uint32_t first, uint32_t corner) {
    for (uint32_t k = first; k < s->remaining_count; ++k)
        if (s->remaining[k].corner == corner) return true;
    return false;
}

/* Adds the faces of the hub a at the neighbours of b. False if there are too many, or if a neighbour is a hub
 * too. */
static bool list_hub_faces(fct_simplifier *s, const fct_move *move) {
    uint32_t moved = s->remaining_count;
    for (uint32_t i = 0; i < 2 * moved; ++i) {
        uint32_t x = i % 2 ? s->remaining[i / 2].y : s->remaining[i / 2].x;
        if (point_at(s, x)->valence > SIMPLIFY_HUB) return false;
        for (uint32_t c = point_at(s, x)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
            c = fct_simplify_find_side(s, c, move->a);
            if (c == FCT_NONE) break;
            uint32_t at_a = s->triangles[corner_next(c)] == move->a ? corner_next(c) : corner_previous(c);
            uint32_t next = s->triangles[corner_next(at_a)], last = s->triangles[corner_previous(at_a)];
            if (next == move->b || last == move->b || is_listed(s, moved, at_a)) continue;
            if (s->remaining_count == 2 * SIMPLIFY_HUB) return false;
            v3 n = find_normal(s, at_a);
            s->remaining[s->remaining_count++] = (fct_remaining){at_a, next, last, false, n, v3_norm2(n)};
        }
    }
    return true;
}

/* Whether two faces have the same corners because of this move. */
static bool become_equal(const fct_simplifier *s, const fct_remaining *i, const fct_remaining *j) {
    return ((i->x == j->x && i->y == j->y) || (i->x == j->y && i->y == j->x)) &&
           s->triangles[i->corner] != s->triangles[j->corner];
}

/* Whether equal faces become an inner wall that vanishes (pairs/join.h). Hubs have none. */
static bool close_wall(const fct_simplifier *s, const fct_move *move, const fct_remaining *i,
                       const fct_remaining *j) {
    if (!s->next_pairs || move->b == FCT_NONE || move->count_a == 0 || i->x != j->y) return false;
    uint8_t solid = find_solid(s, i->corner);
    return solid != SOLID_NONE && solid == find_solid(s, j->corner) && !point_is_locked(s, i->x) &&
           !point_is_locked(s, i->y) && !point_is_locked(s, move->a) && !point_is_locked(s, move->b);
}

/* Whether i and j may be the two faces of the edge from the moved point to x. */
static bool may_share_edge(const fct_simplifier *s, const fct_move *move, uint32_t x, const fct_remaining *i,
                           const fct_remaining *j) {
    if (become_equal(s, i, j)) return close_wall(s, move, i, j);
    if (!is_folded(i->normal, i->norm2, j->normal, j->norm2, (i->x == x) == (j->x == x))) return true;
    return is_edge_folded(s, move->a, x) || is_edge_folded(s, move->b, x);
}

/* Whether the edge from the moved point to x may have face i as a third one: it has three already. */
static bool may_crowd_edge(const fct_simplifier *s, const fct_move *move, uint32_t x,
                           const fct_remaining *i) {
    if (move->b == FCT_NONE) return true;
    if (count_faces(s, move->a, x) < 3 && count_faces(s, move->b, x) < 3) return false;
    for (const fct_remaining *j = s->remaining; j < i; ++j)
        if (become_equal(s, i, j)) return close_wall(s, move, i, j);
    return true;
}

/* Whether the side x-y of face i stays unfolded, or was folded before. */
static bool check_fixed_side(const fct_simplifier *s, const fct_move *move, const fct_remaining *i) {
    bool from_y = point_at(s, i->y)->valence < point_at(s, i->x)->valence;
    uint32_t point = from_y ? i->y : i->x, other = from_y ? i->x : i->y;
    if (point_at(s, point)->valence > SIMPLIFY_HUB) return true;
    for (uint32_t c = point_at(s, point)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
        c = fct_simplify_find_side(s, c, other);
        if (c == FCT_NONE) break;
        bool next = s->triangles[corner_next(c)] == other, same = next != from_y;
        uint32_t third = s->triangles[next ? corner_previous(c) : corner_next(c)];
        if (third == move->a || third == move->b) continue;
        v3 n = find_normal(s, c);
        double n2 = v3_norm2(n);
        if (!is_folded(i->normal, i->norm2, n, n2, same)) continue;
        v3 before = find_normal(s, i->corner);
        if (!is_folded(before, v3_norm2(before), n, n2, same)) return false;
    }
    return true;
}

/* Marks the two edges of face i from the moved point, and compares it with the first face there. */
static bool check_moved_sides(fct_simplifier *s, const fct_move *move, uint32_t i) {
    const fct_remaining *face = &s->remaining[i];
    for (uint32_t k = 0; k < 2; ++k) {
        uint32_t x = k ? face->y : face->x;
        fct_side_mark *mark = &s->side_marks[x];
        if (mark->epoch != s->side_epoch) {
            *mark = (fct_side_mark){s->side_epoch, i};
            ++s->open_sides;
            continue;
        }
        if (mark->first == FCT_NONE ? !may_crowd_edge(s, move, x, face)
                                    : !may_share_edge(s, move, x, &s->remaining[mark->first], face))
            return false;
        s->open_sides -= mark->first != FCT_NONE;
        mark->first = FCT_NONE;
    }
    return true;
}

bool fct_simplify_remains_good(fct_simplifier *s, const fct_move *move) {
    fct_simplify_begin_move(s);
    if (fct_simplify_folds_over(s, s->ring_a, move->count_a, move->b, point_position(s, move->a), move->at))
        return false;
    if (move->count_b &&
        fct_simplify_folds_over(s, s->ring_b, move->count_b, move->a, point_position(s, move->b), move->at))
        return false;
    if (!s->def->check_foldover) return true;
    if (move->count_a == 0 && !list_hub_faces(s, move)) return false;
    ++s->side_epoch;
    s->open_sides = 0;
    for (uint32_t i = 0; i < s->remaining_count; ++i) {
        if (!check_moved_sides(s, move, i)) return false;
        bool check = s->remaining[i].turned || move->b == FCT_NONE;
        if (check && !check_fixed_side(s, move, &s->remaining[i])) return false;
    }
    return true;
}

/* The remaining faces [begin, end), which are those of one end of a pair. */
static bool check_fan(fct_simplifier *s, const fct_move *move, uint32_t point, uint32_t begin, uint32_t end) {
    const fct_move own = {.a = point, .b = FCT_NONE};
    ++s->side_epoch;
    for (uint32_t i = begin; i < end; ++i) {
        if (!check_moved_sides(s, &own, i)) return false;
        if (s->remaining[i].turned && !check_fixed_side(s, move, &s->remaining[i])) return false;
    }
    return true;
}

bool fct_simplify_joins_well(fct_simplifier *s, const fct_move *move) {
    fct_simplify_begin_move(s);
    if (fct_simplify_folds_over(s, s->ring_a, move->count_a, move->b, point_position(s, move->a), move->at) ||
        fct_simplify_folds_over(s, s->ring_b, move->count_b, move->a, point_position(s, move->b), move->at))
        return false;
    return !s->def->check_foldover || (check_fan(s, move, move->a, 0, move->count_a) &&
                                       check_fan(s, move, move->b, move->count_a, s->remaining_count));
}

bool fct_simplify_is_level(const fct_simplifier *s) {
    /* Without check_foldover open sides are not counted. */
    if (s->remaining_count == 0 || !s->level || !s->def->check_foldover || s->open_sides > 0) return false;
    v3 sum = {0, 0, 0};
    for (uint32_t i = 0; i < s->remaining_count; ++i) sum = v3_add(sum, s->remaining[i].normal);
    double sum2 = v3_norm2(sum);
    for (uint32_t i = 0; i < s->remaining_count; ++i) {
        double dot = v3_dot(sum, s->remaining[i].normal);
        if (!(dot > 0 && dot * dot > LEVEL_COSINE * LEVEL_COSINE * sum2 * s->remaining[i].norm2))
            return false;
    }
    return true;
}

bool fct_simplify_is_tetrahedron(const fct_simplifier *s, const fct_move *move) {
    uint32_t points[3], count = 0;
    if (move->count_a != 3 || move->count_b != 3) return false;
    /* The other points of the two rings: b and two apexes at a, a and the same apexes at b. */
    for (uint32_t i = 0; i < 6; ++i) {
        uint32_t c = i < 3 ? s->ring_a[i] : s->ring_b[i - 3];
        for (uint32_t k = 0; k < 2; ++k) {
            uint32_t x = s->triangles[k ? corner_previous(c) : corner_next(c)];
            if (x == move->a || x == move->b || (count > 0 && x == points[0]) ||
                (count > 1 && x == points[1]))
                continue;
            if (count == 2 || point_at(s, x)->valence != 3) return false;
            points[count++] = x;
        }
    }
    return count == 2;
}
