/* simplify/handle/live.c: see live.h. Cost: linear in the points, wedges and corners of the input. */
#include "simplify/handle/live.h"

#include "simplify/handle/wish.h"

/* Larger coordinates in the unit cube are damage, because no contraction leads so far away. */
#define MOST_COORDINATE 1e6
/* Larger coefficients are damage. */
#define MOST_NUMBER 1e60

typedef struct live_head {
    uint32_t root_count, live_faces, edge_count, wedge_count; /* wedges in the lists of the roots */
    uint32_t constraint_count, line_count, mark_count, pin_count, flags, unused;
    double max_error2, last_error;
} live_head;

enum { PRICED = 1, HAS_CONSTRAINTS = 2, HAS_PAINT = 4, HAS_PINS = 8 };

typedef struct live_point {
    double at[3], quadric[POSITION_QUADRIC];
    uint32_t source, valence, wedge_count, refused;
} live_point;

typedef struct live_edge {
    uint32_t ends[2];
    uint16_t bucket;
    uint8_t state, ends_only;
} live_edge;

typedef struct live_constraint {
    double planes[POSITION_QUADRIC];
    uint32_t point, line, hold, unused;
} live_constraint;

typedef struct live_pin {
    uint32_t point, unused;
    double quadric[10];
} live_pin;

_Static_assert(sizeof(live_head) == 56 && sizeof(live_pin) == 88 && sizeof(fct_mark) == 40 &&
                   sizeof(live_point) == 128 && sizeof(live_edge) == 12 && sizeof(live_constraint) == 104 &&
                   sizeof(fct_line) == 48,
               "no gaps");

static bool is_root(const fct_simplifier *s, uint32_t point) {
    return s->point_parents[point] == point;
}

/* ---- Writing ---- */

/* Numbers the edges that are not dead and those of living sides, in their order. */
static uint32_t number_edges(fct_simplifier *s, uint32_t *numbers) {
    uint32_t count = 0;
    for (uint32_t e = 0; e < s->edge_count; ++e) numbers[e] = s->edges[e].state != EDGE_DEAD ? 0 : FCT_NONE;
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c)
        if (!corner_dead(s, c)) numbers[edge_root(s->edges, s->side_edges[c])] = 0;
    for (uint32_t e = 0; e < s->edge_count; ++e)
        if (numbers[e] != FCT_NONE) numbers[e] = count++;
    return count;
}

static uint32_t find_flags(const fct_simplifier *s) {
    return (s->priced ? PRICED : 0) | (s->constraint_of ? HAS_CONSTRAINTS : 0) | (s->paint ? HAS_PAINT : 0) |
           (s->pins ? HAS_PINS : 0);
}

static live_head make_head(const fct_simplifier *s, uint32_t edge_count) {
    live_head head = {.live_faces = s->live_faces,
                      .edge_count = edge_count,
                      .line_count = s->line_count,
                      .mark_count = (uint32_t)s->mark_count,
                      .flags = find_flags(s),
                      .max_error2 = s->max_error2,
                      .last_error = s->last_error};
    for (uint32_t p = 0; p < s->point_count; ++p) {
        if (!is_root(s, p)) continue;
        ++head.root_count;
        head.constraint_count += s->constraint_of && s->constraint_of[p] != FCT_NONE;
        head.pin_count += point_is_pinned(s, p);
        for (uint32_t w = s->first_wedges ? s->first_wedges[p] : FCT_NONE; w != FCT_NONE;
             w = s->next_wedges[w])
            ++head.wedge_count;
    }
    return head;
}

static void write_roots(uint32_t *parents, uint32_t count, fct_sink *sink) {
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t root = fct_sets_find(parents, i);
        fct_sink_put(sink, &root, sizeof root);
    }
}

/* A wedge: its number, its class, its attributes and its quadric. */
static void write_wedge(fct_simplifier *s, uint32_t w, fct_sink *sink) {
    uint32_t head[2] = {w, s->wedge_classes[w]};
    fct_sink_put(sink, head, sizeof head);
    fct_sink_put(sink, s->attributes + (size_t)s->channel_count * w, s->channel_count * sizeof(double));
    if (s->quadrics) fct_sink_put(sink, wedge_quadric(s, w), s->quadric_size * sizeof(double));
}

/* A point, the corners around it in their order, and its wedges in their order. */
static void write_point_ring(fct_simplifier *s, uint32_t p, fct_sink *sink) {
    const fct_point *point = point_at(s, p);
    live_point out = {.at = {point->at.x, point->at.y, point->at.z},
                      .source = point->source,
                      .valence = point->valence,
                      .refused = s->refused[p]};
    uint32_t first = s->first_wedges ? s->first_wedges[p] : FCT_NONE;
    memcpy(out.quadric, point->quadric, sizeof out.quadric);
    for (uint32_t w = first; w != FCT_NONE; w = s->next_wedges[w]) ++out.wedge_count;
    fct_sink_put(sink, &out, sizeof out);
    for (uint32_t c = point->first_corner; c != FCT_NONE; c = s->next_corners[c])
        if (!corner_dead(s, c)) fct_sink_put(sink, &c, sizeof c);
    for (uint32_t w = first; w != FCT_NONE; w = s->next_wedges[w]) write_wedge(s, w, sink);
}

static void write_edges(fct_simplifier *s, const uint32_t *numbers, fct_sink *sink) {
    for (uint32_t e = 0; e < s->edge_count; ++e) {
        const fct_edge *edge = &s->edges[e];
        if (numbers[e] == FCT_NONE) continue;
        live_edge out = {.bucket = edge->bucket, .state = edge->state, .ends_only = edge->ends_only};
        for (int k = 0; k < 2; ++k) out.ends[k] = fct_sets_find(s->point_parents, edge->ends[k]);
        fct_sink_put(sink, &out, sizeof out);
    }
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c)
        if (!corner_dead(s, c))
            fct_sink_put(sink, &numbers[edge_root(s->edges, s->side_edges[c])], sizeof *numbers);
}

static void write_constraints(const fct_simplifier *s, fct_sink *sink) {
    for (uint32_t p = 0; p < s->point_count && s->constraint_of; ++p) {
        if (!is_root(s, p) || s->constraint_of[p] == FCT_NONE) continue;
        const fct_constraint *from = &s->constraints[s->constraint_of[p]];
        live_constraint out = {.point = p, .hold = from->hold};
        out.line = from->hold == HOLD_LINE ? from->line : FCT_NONE;
        memcpy(out.planes, from->planes, sizeof out.planes);
        fct_sink_put(sink, &out, sizeof out);
    }
    fct_sink_put(sink, s->lines, s->line_count * sizeof *s->lines);
}

static void write_wishes(const fct_simplifier *s, fct_sink *sink) {
    fct_sink_put(sink, s->marks, s->mark_count * sizeof *s->marks);
    if (s->paint) fct_sink_put(sink, s->paint, s->point_count * sizeof *s->paint);
    for (uint32_t p = 0; p < s->point_count; ++p) {
        if (!is_root(s, p) || !point_is_pinned(s, p)) continue;
        live_pin out = {.point = p};
        memcpy(out.quadric, s->pins[p], sizeof out.quadric);
        fct_sink_put(sink, &out, sizeof out);
    }
}

fct_result fct_live_write(fct_simplifier *s, fct_sink *sink) {
    uint32_t *numbers = fct_allocate(s->env, s->edge_count, sizeof *numbers);
    if (!numbers) return fct_fail_memory(s->env, "the edges of a state");
    live_head head = make_head(s, number_edges(s, numbers));
    fct_sink_put(sink, &head, sizeof head);
    write_roots(s->point_parents, s->point_count, sink);
    if (s->channel_count) write_roots(s->wedge_parents, s->wedge_count, sink);
    for (uint32_t p = 0; p < s->point_count; ++p)
        if (is_root(s, p)) write_point_ring(s, p, sink);
    write_edges(s, numbers, sink);
    write_constraints(s, sink);
    write_wishes(s, sink);
    fct_release(s->env, numbers);
    return sink->result;
}

/* ---- Reading ---- */

typedef struct reader {
    fct_simplifier *s;
    fct_source *source;
    live_head head;
    fct_live_room room;
} reader;

static bool are_numbers(const double *values, size_t count, double most) {
    for (size_t i = 0; i < count; ++i)
        if (!(fabs(values[i]) <= most)) return false;
    return true;
}

static bool are_roots(const uint32_t *parents, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i)
        if (parents[i] >= count || parents[parents[i]] != parents[i]) return false;
    return true;
}

static const char *read_parents(reader *r) {
    const fct_simplifier *s = r->s;
    uint32_t roots = 0;
    if (!fct_source_take(r->source, r->room.parents, s->point_count, sizeof *r->room.parents))
        return "truncated";
    if (!are_roots(r->room.parents, s->point_count)) return "a point was contracted to none";
    for (uint32_t p = 0; p < s->point_count; ++p) roots += r->room.parents[p] == p;
    if (roots != r->head.root_count) return "wrong number of points";
    if (!s->channel_count) return NULL;
    if (!fct_source_take(r->source, r->room.wedge_parents, s->wedge_count, sizeof *r->room.wedge_parents))
        return "truncated";
    return are_roots(r->room.wedge_parents, s->wedge_count) ? NULL : "a wedge was joined with none";
}

/* Forgets all points, faces and wedges. */
static void clear_state(reader *r) {
    fct_simplifier *s = r->s;
    memcpy(s->point_parents, r->room.parents, s->point_count * sizeof *s->point_parents);
    memset(s->points, 0, s->point_count * sizeof *s->points);
    memset(s->refused, 0, s->point_count);
    for (uint32_t p = 0; p < s->point_count; ++p)
        s->points[p].first_corner = s->points[p].last_corner = FCT_NONE, s->points[p].source = FCT_NONE;
    memset(s->triangles, 0xff, 3 * (size_t)s->mesh->face_count * sizeof *s->triangles);
    s->live_faces = r->head.live_faces;
    s->priced = r->head.flags & PRICED, s->max_error2 = r->head.max_error2,
    s->last_error = r->head.last_error;
    if (!s->channel_count) return;
    memcpy(s->wedge_parents, r->room.wedge_parents, s->wedge_count * sizeof *s->wedge_parents);
    memset(s->first_wedges, 0xff, s->point_count * sizeof *s->first_wedges);
    memset(s->wedge_uses, 0, s->wedge_count * sizeof *s->wedge_uses);
    memset(r->room.owners, 0xff, s->wedge_count * sizeof *r->room.owners);
}

/* The corners of a point, which belong to vertices that were contracted to it, each once. */
static const char *read_ring(reader *r, uint32_t p, uint32_t valence) {
    fct_simplifier *s = r->s;
    fct_point *point = point_at(s, p);
    for (uint32_t i = 0; i < valence; ++i) {
        uint32_t c;
        if (!fct_source_take(r->source, &c, 1, sizeof c)) return "truncated";
        if (c >= 3 * s->mesh->face_count || s->triangles[c] != FCT_NONE) return "a corner occurs twice";
        if (r->room.parents[s->point_of[s->mesh->triangles[c]]] != p) return "a corner has another point";
        s->triangles[c] = p;
        s->next_corners[c] = FCT_NONE;
        if (i == 0)
            point->first_corner = c;
        else
            s->next_corners[point->last_corner] = c;
        point->last_corner = c;
    }
    point->valence = valence;
    return NULL;
}

/* Whether the attributes of a wedge lie in the range of the input, apart from rounding. */
static bool are_attributes(const fct_simplifier *s, const double *a) {
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        double slack = 1e-6 * (channel->upper - channel->lower) +
                       1e-9 * fct_max(fabs(channel->lower), fabs(channel->upper));
        if (!(a[i] >= channel->lower - slack && a[i] <= channel->upper + slack)) return false;
    }
    return true;
}

static const char *read_wedges(reader *r, uint32_t p, uint32_t count) {
    fct_simplifier *s = r->s;
    uint32_t *link = s->channel_count ? &s->first_wedges[p] : NULL, head[2];
    for (uint32_t i = 0; i < count; ++i) {
        if (!link || !fct_source_take(r->source, head, 1, sizeof head)) return "truncated";
        uint32_t w = head[0];
        if (w >= s->wedge_count || r->room.wedge_parents[w] != w || r->room.owners[w] != FCT_NONE)
            return "a wedge occurs twice";
        if (head[1] >= s->wedge_count) return "a wedge has no class";
        r->room.owners[w] = p;
        *link = w, link = &s->next_wedges[w];
        *link = FCT_NONE;
        s->wedge_classes[w] = head[1];
        double *a = s->attributes + (size_t)s->channel_count * w;
        if (!fct_source_take(r->source, a, s->channel_count, sizeof *a)) return "truncated";
        if (!are_attributes(s, a)) return "an attribute is out of range";
        if (!s->quadrics) continue;
        if (!fct_source_take(r->source, wedge_quadric(s, w), s->quadric_size, sizeof(double)))
            return "truncated";
        if (!are_numbers(wedge_quadric(s, w), s->quadric_size, MOST_NUMBER)) return "a quadric is no number";
    }
    return NULL;
}

static const char *read_point(reader *r, uint32_t p) {
    fct_simplifier *s = r->s;
    fct_point *point = point_at(s, p);
    live_point in;
    if (!fct_source_take(r->source, &in, 1, sizeof in)) return "truncated";
    if (!are_numbers(in.at, 3, MOST_COORDINATE)) return "a point is far away";
    if (!are_numbers(in.quadric, POSITION_QUADRIC, MOST_NUMBER)) return "a quadric is no number";
    if (in.source != FCT_NONE && in.source >= s->mesh->vertex_count) return "a point has no vertex";
    if (in.refused > 1) return "a mark is out of range";
    point->at = (v3){in.at[0], in.at[1], in.at[2]};
    point->source = in.source;
    memcpy(point->quadric, in.quadric, sizeof in.quadric);
    s->refused[p] = (uint8_t)in.refused;
    const char *fault = read_ring(r, p, in.valence);
    return fault ? fault : read_wedges(r, p, in.wedge_count);
}

/* Each face has no corner or three, at three points and wedges of these points. */
static const char *check_faces(reader *r) {
    fct_simplifier *s = r->s;
    uint32_t live = 0;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        const uint32_t *t = s->triangles + 3 * (size_t)f;
        uint32_t corners = (t[0] != FCT_NONE) + (t[1] != FCT_NONE) + (t[2] != FCT_NONE);
        if (corners == 0) continue;
        if (corners < 3 || t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return "a face lacks a corner";
        ++live;
        for (size_t k = 0; k < 3 && s->channel_count; ++k) {
            uint32_t w = r->room.wedge_parents[s->corner_wedges[3 * (size_t)f + k]];
            if (r->room.owners[w] != t[k]) return "a corner has another wedge";
            ++s->wedge_uses[w];
        }
    }
    return live == r->head.live_faces ? NULL : "wrong number of faces";
}

static const char *read_edges(reader *r) {
    fct_simplifier *s = r->s;
    s->edge_count = r->head.edge_count;
    for (uint32_t e = 0; e < s->edge_count; ++e) {
        live_edge in;
        if (!fct_source_take(r->source, &in, 1, sizeof in)) return "truncated";
        if (in.ends[0] >= s->point_count || in.ends[1] >= s->point_count || in.state > EDGE_DEAD ||
            in.bucket >= QUEUE_BUCKETS || in.ends_only > 1)
            return "an edge is out of range";
        s->edges[e] = (fct_edge){.ends = {in.ends[0], in.ends[1]},
                                 .parent = e,
                                 .next = FCT_NONE,
                                 .bucket = in.bucket,
                                 .state = in.state,
                                 .ends_only = in.ends_only};
    }
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c) {
        if (corner_dead(s, c)) continue;
        if (!fct_source_take(r->source, &s->side_edges[c], 1, sizeof *s->side_edges)) return "truncated";
        if (s->side_edges[c] >= s->edge_count) return "a side has no edge";
    }
    return NULL;
}

static const char *read_constraints(reader *r) {
    const fct_simplifier *s = r->s;
    memset(r->room.constraint_of, 0xff, s->point_count * sizeof *r->room.constraint_of);
    for (uint32_t i = 0; i < r->head.constraint_count; ++i) {
        live_constraint in;
        if (!fct_source_take(r->source, &in, 1, sizeof in)) return "truncated";
        if (in.point >= s->point_count || r->room.parents[in.point] != in.point ||
            r->room.constraint_of[in.point] != FCT_NONE)
            return "a constraint has no point of its own";
        if (in.hold > HOLD_LOCK || (in.hold == HOLD_LINE && in.line >= r->head.line_count))
            return "a constraint is out of range";
        if (!are_numbers(in.planes, POSITION_QUADRIC, MOST_NUMBER)) return "a constraint is no number";
        r->room.constraint_of[in.point] = i;
        r->room.constraints[i] = (fct_constraint){.line = in.line, .hold = (uint8_t)in.hold};
        memcpy(r->room.constraints[i].planes, in.planes, sizeof in.planes);
    }
    if (!fct_source_take(r->source, r->room.lines, r->head.line_count, sizeof *r->room.lines))
        return "truncated";
    return are_numbers(&r->room.lines[0].origin.x, 6 * (size_t)r->head.line_count, MOST_COORDINATE)
               ? NULL
               : "a line is far away";
}

static const char *read_paint(reader *r) {
    const fct_simplifier *s = r->s;
    float *paint = r->room.paint, *weights = r->room.weights;
    if (!(r->head.flags & HAS_PAINT)) return NULL;
    if (!fct_source_take(r->source, paint, s->point_count, sizeof *paint)) return "truncated";
    memset(weights, 0, s->point_count * sizeof *weights);
    for (uint32_t p = 0; p < s->point_count; ++p) {
        float *weight = &weights[r->room.parents[p]];
        if (!is_paint(paint[p])) return "a painted weight is out of range";
        *weight = paint[p] > *weight ? paint[p] : *weight;
    }
    return NULL;
}

static const char *read_pins(reader *r) {
    const fct_simplifier *s = r->s;
    if (r->head.flags & HAS_PINS) memset(r->room.pins, 0, s->point_count * sizeof *r->room.pins);
    for (uint32_t i = 0; i < r->head.pin_count; ++i) {
        live_pin in;
        if (!fct_source_take(r->source, &in, 1, sizeof in)) return "truncated";
        if (in.point >= s->point_count || r->room.parents[in.point] != in.point ||
            r->room.pins[in.point][0] > 0)
            return "a point constraint has no point of its own";
        if (!are_numbers(in.quadric, 10, MOST_NUMBER)) return "a point constraint is no number";
        memcpy(r->room.pins[in.point], in.quadric, sizeof in.quadric);
    }
    return NULL;
}

static const char *read_wishes(reader *r) {
    if (!fct_source_take(r->source, r->room.marks, r->head.mark_count, sizeof *r->room.marks))
        return "truncated";
    for (uint32_t i = 0; i < r->head.mark_count; ++i) {
        const fct_mark *mark = &r->room.marks[i];
        uint32_t second = mark->points[1] == FCT_NONE ? 0 : mark->points[1];
        if (mark->points[0] >= r->s->point_count || second >= r->s->point_count)
            return "a constraint has no point";
        double most = mark->points[1] == FCT_NONE ? MOST_NUMBER : WISH_MOST_WEIGHT;
        if (!(mark->weight > 0 && mark->weight <= most) || !are_numbers(mark->at, 3, MOST_COORDINATE))
            return "a constraint is no number";
    }
    const char *fault = read_paint(r);
    return fault ? fault : read_pins(r);
}

/* Before the first run nothing is contracted, and the edges of sides are those between their points: the
 * constraints may be made again (mark.c). */
static const char *check_beginning(const reader *r) {
    const fct_simplifier *s = r->s;
    if (r->head.flags & PRICED) return NULL;
    if (r->head.root_count != s->point_count || r->head.live_faces != s->face_count)
        return "contractions before the first run";
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c) {
        if (corner_dead(s, c)) continue;
        const uint32_t *ends = s->edges[s->side_edges[c]].ends, a = s->triangles[c],
                       b = s->triangles[corner_next(c)];
        if (!(ends[0] == a && ends[1] == b) && !(ends[0] == b && ends[1] == a))
            return "a side has the edge of another";
    }
    return NULL;
}

/* Exchanges the arrays of the room with those of the simplifier. */
static void exchange_arrays(reader *r) {
    fct_simplifier *s = r->s;
    const fct_live_room before = {.constraints = s->constraints,
                                  .constraint_of = s->constraint_of,
                                  .lines = s->lines,
                                  .paint = s->paint,
                                  .weights = s->weights,
                                  .pins = s->pins,
                                  .marks = s->marks,
                                  .parents = r->room.parents,
                                  .wedge_parents = r->room.wedge_parents,
                                  .owners = r->room.owners};
    s->constraints = r->room.constraints, s->constraint_of = r->room.constraint_of, s->lines = r->room.lines;
    s->paint = r->room.paint, s->weights = r->room.weights, s->pins = r->room.pins;
    s->marks = r->room.marks, s->mark_count = s->mark_capacity = r->head.mark_count;
    s->constraint_count = r->head.constraint_count, s->line_count = r->head.line_count;
    r->room = before;
    if (r->head.flags & HAS_CONSTRAINTS) return;
    fct_release(s->env, s->constraint_of);
    s->constraint_of = NULL;
}

static const char *read_all(reader *r) {
    fct_simplifier *s = r->s;
    const char *fault = read_parents(r);
    if (fault) return fault;
    clear_state(r);
    for (uint32_t p = 0; p < s->point_count && !fault; ++p)
        if (is_root(s, p)) fault = read_point(r, p);
    if (!fault) fault = check_faces(r);
    if (!fault) fault = read_edges(r);
    if (!fault) fault = check_beginning(r);
    if (!fault) fault = read_constraints(r);
    if (!fault) fault = read_wishes(r);
    if (!fault) exchange_arrays(r);
    return fault;
}

static const char *find_head_fault(const reader *r) {
    const live_head *h = &r->head;
    if (h->live_faces > r->s->face_count || h->edge_count > 3 * (uint64_t)r->s->face_count)
        return "more faces or edges than the input has";
    if (h->constraint_count > r->s->point_count || h->line_count > r->s->point_count ||
        h->flags >= 2 * HAS_PINS || (!(h->flags & HAS_CONSTRAINTS) && h->constraint_count > 0) ||
        (!(h->flags & HAS_PINS) && h->pin_count > 0))
        return "constraints out of range";
    if (h->mark_count > (size_t)(r->source->end - r->source->at) / sizeof(fct_mark)) return "truncated";
    if (!(h->max_error2 >= 0 && h->max_error2 <= MOST_NUMBER) || !(h->last_error >= 0))
        return "an error is no number";
    return NULL;
}

static fct_result reserve(const fct_simplifier *s, const live_head *head, fct_live_room *room) {
    bool painted = head->flags & HAS_PAINT;
    const fct_array arrays[] = {FCT_ARRAY(room->parents, s->point_count),
                                FCT_ARRAY_IF(s->channel_count, room->wedge_parents, s->wedge_count),
                                FCT_ARRAY_IF(s->channel_count, room->owners, s->wedge_count),
                                FCT_ARRAY(room->constraints, head->constraint_count),
                                FCT_ARRAY(room->constraint_of, s->point_count),
                                FCT_ARRAY(room->lines, head->line_count),
                                FCT_ARRAY_IF(painted, room->paint, s->point_count),
                                FCT_ARRAY_IF(painted, room->weights, s->point_count),
                                FCT_ARRAY_IF(head->flags & HAS_PINS, room->pins, s->point_count),
                                FCT_ARRAY(room->marks, head->mark_count)};
    return fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "a state");
}

fct_result fct_live_reserve(const fct_simplifier *s, fct_live_room *room) {
    live_head head = make_head(s, 0);
    return reserve(s, &head, room);
}

void fct_live_release(const fct_env *env, fct_live_room *room) {
    void *arrays[] = {room->parents,       room->wedge_parents, room->owners, room->constraints,
                      room->constraint_of, room->lines,         room->paint,  room->weights,
                      room->pins,          room->marks};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(env, arrays[i]);
    *room = (fct_live_room){0};
}

fct_result fct_live_read(fct_simplifier *s, fct_source *source, fct_live_room *room, const char **fault) {
    reader r = {.s = s, .source = source};
    *fault = NULL;
    if (!fct_source_take(source, &r.head, 1, sizeof r.head)) *fault = "truncated";
    if (!*fault) *fault = find_head_fault(&r);
    if (*fault) return FCT_ERROR_DATA;
    fct_result result = FCT_OK;
    if (room)
        r.room = *room, *room = (fct_live_room){0};
    else
        result = reserve(s, &r.head, &r.room);
    if (result != FCT_OK) return result;
    *fault = read_all(&r);
    fct_live_release(s->env, &r.room);
    return *fault ? FCT_ERROR_DATA : FCT_OK;
}
