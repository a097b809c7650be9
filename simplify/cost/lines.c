/* simplify/cost/lines.c: see lines.h.
 *
 *         corner               1. A point is straight if it has two held edges and lies on the line between
 *     o---o---o---o                their other ends, apart from the rounding of the input.
 *     |    straight  \          2. A run goes from a point that is not straight over straight points to the
 *     o               o            next one that is not. It is split at its farthest point until each part
 *                                  lies on the line between its ends. So an arc of very many short edges,
 *                                  which is straight everywhere, does not become one line.
 *                               3. The points inside a part slide along its line. The ends of a run stay, and
 *                                  nothing but planes holds the points where a run was split.
 * A closed curve of straight points has no run. Cost: O(n log n) for n held points, O(n^2) at worst.
 */
#include "simplify/cost/lines.h"

/* A seam is a curve if its squared difference of the attributes, over the squared range, is at least this. */
#define LEAST_STRENGTH .25f

typedef struct run_finder {
    fct_simplifier *s;
    uint32_t (*others)[2]; /* per constraint: the other ends of two held edges */
    uint8_t *degrees;      /* per constraint: held edges, at most 3 */
    bool *visited;         /* per constraint: a straight point whose run was found */
    uint32_t *path;        /* the points of the current run */
    uint32_t *splits;      /* a stack of indexes of `path`: the ends of the parts still to test */
} run_finder;

/* Squared distance of p from the line a-b; INFINITY if p does not lie between both. */
static double find_height2(v3 a, v3 b, v3 p) {
    v3 along = v3_sub(b, a), from = v3_sub(p, a);
    double length2 = v3_norm2(along), t = v3_dot(along, from);
    if (!(t > 0 && t < length2)) return INFINITY;
    return v3_norm2(v3_cross(along, from)) / length2;
}

static bool is_straight(const run_finder *r, uint32_t point) {
    const fct_simplifier *s = r->s;
    uint32_t i = s->constraint_of[point];
    if (i == FCT_NONE || r->degrees[i] != 2) return false;
    double height2 = find_height2(point_position(s, r->others[i][0]), point_position(s, r->others[i][1]),
                                  point_position(s, point));
    return height2 <= s->least_height * s->least_height;
}

static void list_held_edges(run_finder *r, const float *strength) {
    const fct_simplifier *s = r->s;
    for (uint32_t e = 0; e < s->edge_count; ++e) {
        if (!(strength[e] >= LEAST_STRENGTH)) continue;
        for (int k = 0; k < 2; ++k) {
            uint32_t i = s->constraint_of[s->edges[e].ends[k]];
            if (r->degrees[i] < 2) r->others[i][r->degrees[i]] = s->edges[e].ends[1 - k];
            if (r->degrees[i] < 3) ++r->degrees[i];
        }
    }
}

static fct_constraint *constraint_of(run_finder *r, uint32_t index) {
    return &r->s->constraints[r->s->constraint_of[r->path[index]]];
}

/* Makes a line of the points (first, last) of the path if they lie on it. Returns the farthest point if they
 * do not, else 0. */
static uint32_t make_line(run_finder *r, uint32_t first, uint32_t last) {
    fct_simplifier *s = r->s;
    v3 a = point_position(s, r->path[first]), b = point_position(s, r->path[last]);
    double most2 = s->least_height * s->least_height;
    uint32_t farthest = 0;
    for (uint32_t i = first + 1; i < last; ++i) {
        double height2 = find_height2(a, b, point_position(s, r->path[i]));
        if (height2 > most2) most2 = height2, farthest = i;
        if (height2 == INFINITY) break;
    }
    if (farthest || last < first + 2) return farthest;
    for (uint32_t i = first + 1; i < last; ++i)
        constraint_of(r, i)->hold = HOLD_LINE, constraint_of(r, i)->line = s->line_count;
    s->lines[s->line_count++] = (fct_line){a, v3_unit(v3_sub(b, a))};
    return 0;
}

/* Splits the path of `count` points into lines, and fixes its ends if lines start there. */
static void split_path(run_finder *r, uint32_t count) {
    uint32_t first = 0, depth = 0;
    r->splits[depth++] = count - 1;
    while (depth > 0) {
        uint32_t last = r->splits[depth - 1], farthest = make_line(r, first, last);
        if (farthest)
            r->splits[depth++] = farthest;
        else
            first = last, --depth;
    }
    if (constraint_of(r, 1)->hold == HOLD_LINE) constraint_of(r, 0)->hold = HOLD_POINT;
    if (constraint_of(r, count - 2)->hold == HOLD_LINE) constraint_of(r, count - 1)->hold = HOLD_POINT;
}

/* Follows the straight points from `start` over its neighbour `next`. */
static void walk_run(run_finder *r, uint32_t start, uint32_t next) {
    uint32_t count = 0;
    r->path[count++] = start;
    while (is_straight(r, next)) {
        uint32_t i = r->s->constraint_of[next], previous = r->path[count - 1];
        if (r->visited[i]) return;
        r->visited[i] = true;
        r->path[count++] = next;
        next = r->others[i][r->others[i][0] == previous];
    }
    r->path[count++] = next;
    if (count > 2) split_path(r, count);
}

fct_result fct_simplify_find_lines(fct_simplifier *s, const float *strength) {
    run_finder r = {.s = s};
    uint32_t count = s->constraint_count;
    const fct_array arrays[] = {FCT_ARRAY(r.others, count), FCT_ARRAY_ZERO(r.degrees, count),
                                FCT_ARRAY_ZERO(r.visited, count), FCT_ARRAY(r.path, (size_t)count + 2),
                                FCT_ARRAY(r.splits, (size_t)count + 2)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "lines");
    if (result != FCT_OK) return result;
    s->lines = fct_allocate(s->env, count, sizeof *s->lines);
    if (!s->lines)
        result = fct_fail_memory(s->env, "lines");
    else {
        list_held_edges(&r, strength);
        for (uint32_t e = 0; e < s->edge_count; ++e)
            for (int k = 0; k < 2 && strength[e] >= LEAST_STRENGTH; ++k)
                if (!is_straight(&r, s->edges[e].ends[k]))
                    walk_run(&r, s->edges[e].ends[k], s->edges[e].ends[1 - k]);
    }
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}
