/* simplify/handle/mark.c: contours and point constraints of the caller (Garland 1999, section 3.6).
 *
 * Before the first contraction, contours become held edges like boundaries (cost/constraint.c), with lines
 * where they are straight. Later, the planes of their edges in the input are added to the points that their
 * ends were contracted to. A point constraint (3.19) is a quadric of its own beside that of the faces.
 */
#include "base/sort.h"
#include "simplify/cost/constraint.h"
#include "simplify/handle/history.h"
#include "simplify/handle/wish.h"
#include "simplify/topology/pinch.h"

/* The contours among some marks, sorted by their points. */
typedef struct contours {
    const fct_mark *marks;
    uint64_t *keys;  /* ascending */
    uint32_t *order; /* per key: its mark */
    bool *met;       /* per key: the input has this edge */
    size_t count;
} contours;

static uint64_t pair_key(uint32_t a, uint32_t b) {
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

/* The first key that is not below the wanted one. */
static size_t find_key(const contours *k, uint64_t wanted) {
    size_t low = 0, high = k->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (k->keys[middle] < wanted)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Adds the plane through a side of a face of the input to both its ends. */
static void add_plane(fct_simplifier *s, const uint32_t ends[2], const v3 p[3], uint32_t side,
                      double weight) {
    v3 normal = v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
    v3 along = v3_sub(p[(side + 1) % 3], p[side]), across = v3_unit(v3_cross(normal, along));
    double length = v3_norm(along);
    if (!(v3_norm2(across) > 0)) return;
    for (int k = 0; k < 2; ++k) {
        uint32_t root = fct_sets_find(s->point_parents, ends[k]);
        if (s->constraint_of[root] == FCT_NONE) {
            s->constraint_of[root] = s->constraint_count;
            s->constraints[s->constraint_count++] = (fct_constraint){.line = FCT_NONE, .hold = HOLD_PLANES};
        }
        double *planes = s->constraints[s->constraint_of[root]].planes;
        quadric_add_plane(planes, across, p[side], weight * length);
        planes[10] += length;
    }
}

static v3 input_position(const fct_simplifier *s, uint32_t vertex) {
    v3 p = v3_load(s->mesh->positions + 3 * (size_t)vertex);
    return v3_scale(v3_sub(p, s->center), 1 / s->extent);
}

/* Visits the sides of the input that are contours: notes that they exist and, if `add`, adds their planes. */
static void visit_sides(fct_simplifier *s, contours *k, bool add) {
    for (uint32_t f = 0; f < s->mesh->face_count && k->count; ++f) {
        const uint32_t *t = s->mesh->triangles + 3 * (size_t)f;
        const uint32_t points[3] = {s->point_of[t[0]], s->point_of[t[1]], s->point_of[t[2]]};
        const v3 p[3] = {input_position(s, t[0]), input_position(s, t[1]), input_position(s, t[2])};
        if (points[0] == points[1] || points[1] == points[2] || points[2] == points[0]) continue;
        for (uint32_t side = 0; side < 3; ++side) {
            const uint32_t ends[2] = {points[side], points[(side + 1) % 3]};
            uint64_t key = pair_key(ends[0], ends[1]);
            for (size_t i = find_key(k, key); i < k->count && k->keys[i] == key; ++i) {
                k->met[i] = true;
                if (add) add_plane(s, ends, p, side, k->marks[k->order[i]].weight);
            }
        }
    }
}

static fct_result check_met(const fct_simplifier *s, const contours *k) {
    for (size_t i = 0; i < k->count; ++i)
        if (!k->met[i])
            return fct_fail(s->env, FCT_ERROR_DATA, "pair %u of the contour is no edge of the input",
                            k->order[i]);
    return FCT_OK;
}

/* Makes the constraints again, with the contours. On failure those of before stay. */
static fct_result hold_contours(fct_simplifier *s) {
    uint32_t *constraint_of = s->constraint_of, constraints_before = s->constraint_count,
             lines_before = s->line_count;
    fct_constraint *constraints = s->constraints;
    fct_line *lines = s->lines;
    s->constraint_of = NULL, s->constraints = NULL, s->lines = NULL;
    s->constraint_count = s->line_count = 0;
    fct_result result = fct_simplify_constraints(s);
    if (result != FCT_OK) {
        fct_release(s->env, s->constraint_of), fct_release(s->env, s->constraints);
        fct_release(s->env, s->lines);
        s->constraint_of = constraint_of, s->constraints = constraints, s->lines = lines;
        s->constraint_count = constraints_before, s->line_count = lines_before;
        return result;
    }
    fct_release(s->env, constraint_of), fct_release(s->env, constraints), fct_release(s->env, lines);
    return FCT_OK;
}

/* Adds the planes of the contours to the current points. */
static fct_result add_planes(fct_simplifier *s, contours *k) {
    size_t most = (size_t)s->constraint_count + 2 * k->count;
    if (!k->count) return FCT_OK;
    fct_constraint *constraints = fct_allocate(s->env, most, sizeof *constraints);
    uint32_t *of = s->constraint_of ? NULL : fct_allocate(s->env, s->point_count, sizeof *of);
    if (!constraints || (!of && !s->constraint_of)) {
        fct_release(s->env, constraints), fct_release(s->env, of);
        return fct_fail_memory(s->env, "constraints");
    }
    if (of) {
        memset(of, 0xff, s->point_count * sizeof *of);
        s->constraint_of = of;
    }
    if (s->constraint_count) memcpy(constraints, s->constraints, s->constraint_count * sizeof *constraints);
    fct_release(s->env, s->constraints);
    s->constraints = constraints;
    visit_sides(s, k, true);
    return FCT_OK;
}

/* w times (3.19) for each point constraint. */
static void add_pins(fct_simplifier *s, const fct_mark *marks, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        if (marks[i].points[1] != FCT_NONE) continue;
        double w = marks[i].weight, *q = s->pins[fct_sets_find(s->point_parents, marks[i].points[0])];
        const double *p = marks[i].at;
        q[0] += w, q[3] += w, q[5] += w;
        q[6] -= w * p[0], q[7] -= w * p[1], q[8] -= w * p[2];
        q[9] += w * (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    }
}

static void release_contours(const fct_env *env, contours *k) {
    void *arrays[] = {k->keys, k->order, k->met};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(env, arrays[i]);
}

static fct_result list_contours(const fct_simplifier *s, const fct_mark *marks, size_t count, contours *k) {
    *k = (contours){.marks = marks};
    const fct_array arrays[] = {FCT_ARRAY(k->keys, count), FCT_ARRAY(k->order, count),
                                FCT_ARRAY_ZERO(k->met, count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "contours");
    for (size_t i = 0; i < count && result == FCT_OK; ++i) {
        if (marks[i].points[1] == FCT_NONE) continue;
        k->keys[k->count] = pair_key(marks[i].points[0], marks[i].points[1]);
        k->order[k->count++] = (uint32_t)i;
    }
    return result == FCT_OK ? fct_sort_pairs(s->env, k->keys, k->order, k->count) : result;
}

/* The lists have room. */
static fct_result apply_marks(fct_simplifier *s, contours *k, const fct_mark *marks, size_t count) {
    size_t before = s->mark_count;
    memcpy(s->marks + before, marks, count * sizeof *marks);
    s->mark_count += count;
    fct_result result = FCT_OK;
    if (k->count) result = s->priced ? add_planes(s, k) : hold_contours(s);
    if (result != FCT_OK) {
        s->mark_count = before;
        return result;
    }
    if (k->count < count) add_pins(s, marks, count);
    return FCT_OK;
}

fct_result fct_mark_add(fct_simplifier *s, const fct_mark *marks, size_t count) {
    contours k;
    if (count == 0) return FCT_OK;
    fct_result result = list_contours(s, marks, count, &k);
    if (result == FCT_OK) visit_sides(s, &k, false);
    if (result == FCT_OK) result = check_met(s, &k);
    if (result == FCT_OK)
        result =
            fct_grow(s->env, (void **)&s->marks, &s->mark_capacity, s->mark_count + count, sizeof *s->marks);
    if (result == FCT_OK && k.count < count && !s->pins) {
        s->pins = fct_allocate_zero(s->env, s->point_count, sizeof *s->pins);
        if (!s->pins) result = fct_fail_memory(s->env, "point constraints");
    }
    if (result == FCT_OK) result = apply_marks(s, &k, marks, count);
    release_contours(s->env, &k);
    return result;
}

/* ---- The public function ---- */

fct_constrain_def fct_constrain_def_default(void) {
    return (fct_constrain_def){.size = sizeof(fct_constrain_def), .contour_weight = 1, .point_weight = 1};
}

static fct_result check_def(const fct_simplifier *s, const fct_constrain_def *def) {
    if (def->size != sizeof *def)
        return fct_fail(s->env, FCT_ERROR_DATA,
                        "fct_constrain_def has size %u, expected %zu: fill it with fct_constrain_def_default",
                        def->size, sizeof *def);
    const double weights[2] = {def->contour_weight, def->point_weight};
    for (int i = 0; i < 2; ++i)
        if (!(weights[i] > 0 && weights[i] <= WISH_MOST_WEIGHT))
            return fct_fail(s->env, FCT_ERROR_DATA, "%s is %g, expected above 0 and at most 1e12",
                            i ? "point_weight" : "contour_weight", weights[i]);
    if (def->contour_count > 0 && !(s->own.boundary_weight > 0))
        return fct_fail(s->env, FCT_ERROR_DATA, "a contour needs a boundary_weight above 0, found 0");
    return FCT_OK;
}

/* The point of a vertex of the input. */
static fct_result find_point(const fct_simplifier *s, const char *what, uint32_t i, uint32_t vertex,
                             uint32_t *point) {
    if (vertex >= sorted_inputs(&s->sorted))
        return fct_fail(s->env, FCT_ERROR_DATA, "%s %u: vertex %u, expected below %u", what, i, vertex,
                        sorted_inputs(&s->sorted));
    *point = s->point_of[s->sorted.vertex_places[vertex]];
    if (*point != FCT_NONE) return FCT_OK;
    return fct_fail(s->env, FCT_ERROR_DATA, "%s %u: no face has vertex %u", what, i, vertex);
}

static fct_result fill_marks(const fct_simplifier *s, const fct_constrain_def *def, fct_mark *marks) {
    fct_result result = FCT_OK;
    for (uint32_t i = 0; i < def->contour_count && result == FCT_OK; ++i) {
        marks[i] = (fct_mark){.weight = def->contour_weight};
        for (int k = 0; k < 2 && result == FCT_OK; ++k)
            result = find_point(s, "pair", i, def->contour[2 * (size_t)i + (size_t)k], &marks[i].points[k]);
    }
    for (uint32_t i = 0; i < def->point_count && result == FCT_OK; ++i) {
        fct_mark *mark = &marks[(size_t)def->contour_count + i];
        *mark = (fct_mark){.weight = def->point_weight / (s->extent * s->extent), .points = {0, FCT_NONE}};
        result = find_point(s, "point", i, def->points[i], &mark->points[0]);
        if (result != FCT_OK) break;
        v3 p = def->positions
                   ? v3_load(def->positions + 3 * (size_t)i)
                   : v3_load(s->mesh->positions + 3 * (size_t)s->sorted.vertex_places[def->points[i]]);
        p = v3_scale(v3_sub(p, s->center), 1 / s->extent);
        mark->at[0] = p.x, mark->at[1] = p.y, mark->at[2] = p.z;
        if (!(v3_norm2(p) <= 1e6))
            result = fct_fail(s->env, FCT_ERROR_DATA, "point %u: its position is too far away", i);
    }
    return result;
}

/* An edge of the input at a split vertex belongs to one of the fans there (topology/pinch.h). If it is none
 * of the first fan, the mark gets the points of its own. */
static fct_result choose_fans(fct_simplifier *s, fct_mark *marks, size_t count) {
    const fct_sorted *sorted = &s->sorted;
    uint32_t inputs = sorted_inputs(sorted);
    if (sorted->copy_count == 0 || count == 0) return FCT_OK;
    contours k;
    fct_result result = list_contours(s, marks, count, &k);
    if (result == FCT_OK) visit_sides(s, &k, false);
    for (uint32_t c = 0; c < 3 * s->mesh->face_count && result == FCT_OK; ++c) {
        const uint32_t v[2] = {s->mesh->triangles[c], s->mesh->triangles[corner_next(c)]};
        uint32_t from[2];
        if (v[0] < inputs && v[1] < inputs) continue;
        for (int i = 0; i < 2; ++i)
            from[i] = s->point_of[v[i] < inputs ? v[i] : sorted->copies[v[i] - inputs]];
        uint64_t key = pair_key(from[0], from[1]);
        for (size_t i = find_key(&k, key); i < k.count && k.keys[i] == key && !k.met[i]; ++i)
            for (int end = 0; end < 2; ++end) marks[k.order[i]].points[end] = s->point_of[v[end]];
    }
    release_contours(s->env, &k);
    return result;
}

/* A point constraint of a split vertex holds all its fans: counts the further ones, or adds their marks. */
static size_t hold_fans(const fct_simplifier *s, const fct_constrain_def *def, const fct_mark *of_points,
                        fct_mark *more) {
    const fct_sorted *sorted = &s->sorted;
    size_t count = 0;
    for (uint32_t i = 0; i < def->point_count && sorted->copy_count > 0; ++i) {
        if (def->points[i] >= sorted_inputs(sorted)) continue;
        uint32_t first, end = fct_simplify_find_copies(sorted, sorted->vertex_places[def->points[i]], &first);
        uint32_t held = s->point_of[sorted->vertex_places[def->points[i]]];
        for (; first < end; ++first) {
            uint32_t point = s->point_of[sorted_inputs(sorted) + first];
            if (point == held) continue; /* doubled vertices have joined the fans */
            if (more) more[count] = of_points[i], more[count].points[0] = point;
            ++count;
        }
    }
    return count;
}

fct_result fct_simplifier_constrain(fct_simplifier *s, const fct_constrain_def *def) {
    fct_result result = check_def(s, def);
    if (result != FCT_OK) return result;
    size_t given = (size_t)def->contour_count + def->point_count,
           count = given + hold_fans(s, def, NULL, NULL);
    fct_mark *marks = fct_allocate(s->env, count, sizeof *marks);
    if (!marks) return fct_fail_memory(s->env, "constraints");
    result = fill_marks(s, def, marks);
    if (result == FCT_OK) result = choose_fans(s, marks, def->contour_count);
    if (result == FCT_OK) hold_fans(s, def, marks + def->contour_count, marks + given);
    if (result == FCT_OK) result = fct_mark_add(s, marks, count);
    if (result == FCT_OK && s->history) s->history->broken = true;
    fct_release(s->env, marks);
    return result;
}
