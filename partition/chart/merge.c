/* partition/chart/merge.c: merges neighbouring charts whose union is a chart.
 *
 * Clusters end at borders of the tree, and opened nodes leave small charts beside large ones. Each round
 * takes the pairs of neighbours in order of the share of the smaller one's border that the merge removes. A
 * chart takes any number of others per round, or is taken itself. Two disks form a disk if they share one
 * more vertex than edges. That test reads only the faces of the smaller chart, and a hash set of (vertex,
 * chart) tells which vertices the other one has. Rounds end when no pair can merge.
 */
#include "partition/chart/merge.h"

#include <string.h>

#include "base/key.h"
#include "base/sort.h"
#include "partition/adjacency.h"

/* A merge must remove this share of the smaller chart's border. Smaller shares give star-shaped charts. */
static const double least_share = 0.125;

enum { MOST_ROUNDS = 256, STREAM = 4096 };

typedef struct piece {
    v3 vector; /* area vector */
    double area, perimeter;
    double cone; /* upper bound of the angle between its normals and its vector */
    uint32_t faces;
    uint32_t head, tail; /* of its list of places */
    bool fixed;          /* not a disk: never merges */
    bool grew;           /* took a chart in this round */
    bool gone;           /* taken by another chart */
    bool fresh;          /* changed in the last round */
} piece;

typedef struct merger {
    fct_charter *charter;
    piece *pieces;
    uint32_t *next;       /* per place: the next one in the list of its piece */
    uint32_t *last_label; /* per vertex */
    uint32_t *stamps;     /* per vertex: the test that counted it last */
    bool *shared;         /* per vertex: two or more charts use it */
    uint32_t test;
    uint64_t *set; /* hash set of vertex << 32 | chart, for shared vertices; open addressing */
    size_t set_mask;
} merger;

static const uint64_t nothing = UINT64_MAX;

static size_t find_slot(const merger *m, uint64_t key) {
    uint64_t hash = key * 0x9E3779B97F4A7C15u;
    size_t slot = (size_t)(hash ^ hash >> 29) & m->set_mask;
    while (m->set[slot] != nothing && m->set[slot] != key) slot = (slot + 1) & m->set_mask;
    return slot;
}

static bool has_vertex(const merger *m, uint32_t vertex, uint32_t chart) {
    return m->set[find_slot(m, (uint64_t)vertex << 32 | chart)] != nothing;
}

static void add_vertex(merger *m, uint32_t vertex, uint32_t chart) {
    uint64_t key = (uint64_t)vertex << 32 | chart;
    m->set[find_slot(m, key)] = key;
}

/* Finds the shared vertices and fills the set, with room for as many entries again. */
static fct_result list_shared(const fct_env *env, merger *m) {
    const fct_tree_view *view = m->charter->view;
    const uint32_t *labels = m->charter->labels;
    size_t corners = 3 * (size_t)view->face_count, entries = 0, capacity = 64;
    for (uint32_t v = 0; v < view->vertex_count; ++v) m->last_label[v] = FCT_NONE, m->shared[v] = false;
    for (size_t i = 0; i < corners; ++i) {
        uint32_t v = view->triangles[i], label = labels[i / 3];
        if (m->last_label[v] == label) continue;
        m->shared[v] = m->last_label[v] != FCT_NONE;
        m->last_label[v] = label;
    }
    for (size_t i = 0; i < corners; ++i) {
        uint32_t v = view->triangles[i], label = labels[i / 3];
        if (!m->shared[v] || m->last_label[v] == label) continue;
        m->last_label[v] = label;
        ++entries;
    }
    while (capacity < 4 * entries + 64) capacity *= 2;
    fct_release(env, m->set);
    m->set = fct_allocate(env, capacity, sizeof *m->set);
    if (!m->set) return fct_fail_memory(env, "charts");
    m->set_mask = capacity - 1;
    memset(m->set, 0xFF, capacity * sizeof *m->set);
    for (size_t i = 0; i < corners; ++i) {
        uint32_t v = view->triangles[i];
        if (m->shared[v]) add_vertex(m, v, labels[i / 3]);
    }
    return FCT_OK;
}

/* Whether three or more faces lie on the mesh edge of a side. */
static bool is_crowded(const fct_sides *sides, uint32_t side) {
    uint32_t before = sides->before[side], after = sides->after[side];
    if (before != FCT_NONE) return after != FCT_NONE || sides->before[before] != FCT_NONE;
    return after != FCT_NONE && sides->after[after] != FCT_NONE;
}

/* Whether the union of two disks is a disk: their common border is one line. Refuses if `small` has a crowded
 * edge with both ends in `large`, because that edge may belong to both. */
static bool glues_to_disk(merger *m, uint32_t small, uint32_t large, double *length) {
    const fct_tree_view *view = m->charter->view;
    const fct_sides *sides = &m->charter->sides;
    uint32_t vertices = 0, edges = 0;
    bool crowded = false;
    ++m->test;
    *length = 0;
    for (uint32_t p = m->pieces[small].head; p != FCT_NONE; p = m->next[p])
        for (uint32_t side = 3 * p; side < 3 * p + 3; ++side) {
            uint32_t v = view->triangles[side], w = view->triangles[side % 3 == 2 ? side - 2 : side + 1];
            bool has = m->shared[v] && has_vertex(m, v, large);
            if (has && m->stamps[v] != m->test) m->stamps[v] = m->test, ++vertices;
            if (!has || !m->shared[w] || !has_vertex(m, w, large)) continue;
            crowded = crowded || is_crowded(sides, side);
            uint32_t other = sides->before[side] != FCT_NONE ? sides->before[side] : sides->after[side];
            if (other == FCT_NONE || m->charter->labels[other / 3] != large) continue;
            ++edges;
            *length += fct_side_length(view, side);
        }
    return !crowded && edges > 0 && vertices == edges + 1;
}

static double find_widest_angle(const merger *m, uint32_t chart, v3 axis, double enough) {
    double widest = 0;
    for (uint32_t p = m->pieces[chart].head; p != FCT_NONE && widest <= enough; p = m->next[p])
        widest = fmax(widest, fct_angle(fct_face_vector(m->charter->view, p), axis));
    return widest;
}

/* Whether all normals of both charts are within the limit of the common vector. Compares their cones first,
 * then the faces, unless the larger chart has too many faces for so small a gain. */
static bool keeps_angle(const merger *m, uint32_t small, uint32_t large, double *cone) {
    const piece *a = &m->pieces[small], *b = &m->pieces[large];
    double limit = m->charter->def.max_angle;
    v3 axis = v3_add(a->vector, b->vector);
    *cone = fmax(a->cone + fct_angle(a->vector, axis), b->cone + fct_angle(b->vector, axis));
    if (limit >= FCT_HALF_TURN) return true;
    if (v3_norm2(axis) > 0 ? *cone <= limit : a->area + b->area == 0) return true;
    if (!(v3_norm2(axis) > 0) || b->faces > STREAM + 16 * a->faces) return false;
    *cone = find_widest_angle(m, small, axis, limit);
    if (*cone <= limit) *cone = fmax(*cone, find_widest_angle(m, large, axis, limit));
    return *cone <= limit;
}

/* Merges `small` into `large` if their union is a chart. */
static bool join_charts(merger *m, uint32_t small, uint32_t large) {
    piece *a = &m->pieces[small], *b = &m->pieces[large];
    const fct_charter *c = m->charter;
    const fct_tree_view *view = c->view;
    if (a->faces > c->def.max_faces - b->faces || a->area + b->area > c->def.max_area) return false;
    if (view->materials && view->materials[a->head] != view->materials[b->head]) return false;
    double cone, length;
    bool glued = glues_to_disk(m, small, large, &length);
    if ((!glued && !c->def.any_topology) || !keeps_angle(m, small, large, &cone)) return false;
    for (uint32_t p = a->head; p != FCT_NONE; p = m->next[p]) {
        m->charter->labels[p] = large;
        for (size_t i = 3 * (size_t)p; i < 3 * (size_t)p + 3; ++i)
            if (m->shared[view->triangles[i]]) add_vertex(m, view->triangles[i], large);
    }
    m->next[b->tail] = a->head;
    b->tail = a->tail;
    b->vector = v3_add(a->vector, b->vector);
    b->area += a->area, b->faces += a->faces;
    b->perimeter += a->perimeter - 2 * length;
    b->cone = cone, b->grew = true, a->gone = true;
    return true;
}

/* One pass over the pairs in order. Returns how many charts were taken. */
static uint32_t join_pairs(merger *m, const fct_adjacency *neighbours, const uint32_t *order) {
    uint32_t joined = 0;
    for (uint32_t i = 0; i < neighbours->pair_count; ++i) {
        uint32_t a = neighbours->pairs[2 * (size_t)order[i]], b = neighbours->pairs[2 * (size_t)order[i] + 1];
        piece *p = &m->pieces[a], *q = &m->pieces[b];
        if (p->fixed || q->fixed || p->gone || q->gone || (p->grew && q->grew)) continue;
        if (!p->fresh && !q->fresh && !p->grew && !q->grew) continue; /* refused in an earlier round */
        if (neighbours->lengths[order[i]] < least_share * fmin(p->perimeter, q->perimeter)) continue;
        bool first_small = p->grew ? false : q->grew ? true : p->faces < q->faces;
        joined += join_charts(m, first_small ? a : b, first_small ? b : a);
    }
    return joined;
}

static fct_result run_round(const fct_env *env, merger *m, uint32_t *joined) {
    const fct_tree_view *view = m->charter->view;
    fct_mesh mesh = {.vertex_count = view->vertex_count,
                     .face_count = view->face_count,
                     .positions = (float *)view->positions,
                     .triangles = (uint32_t *)view->triangles};
    fct_adjacency neighbours = {0};
    fct_result result = fct_adjacency_pairs(env, &mesh, &m->charter->sides, m->charter->labels, &neighbours);
    if (result == FCT_OK) result = list_shared(env, m);
    uint64_t *keys = NULL;
    uint32_t *order = NULL;
    const fct_array arrays[] = {FCT_ARRAY(keys, neighbours.pair_count),
                                FCT_ARRAY(order, neighbours.pair_count)};
    if (result == FCT_OK) result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "charts");
    if (result == FCT_OK) {
        for (uint32_t i = 0; i < neighbours.pair_count; ++i) {
            const piece *p = &m->pieces[neighbours.pairs[2 * (size_t)i]],
                        *q = &m->pieces[neighbours.pairs[2 * (size_t)i + 1]];
            double border = fmin(p->perimeter, q->perimeter);
            double share = border > 0 ? neighbours.lengths[i] / border : 1;
            keys[i] = ~fct_float_key((float)share), order[i] = i;
        }
        result = fct_sort_pairs(env, keys, order, neighbours.pair_count);
    }
    if (result == FCT_OK) *joined = join_pairs(m, &neighbours, order);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    fct_adjacency_release(env, &neighbours);
    return result;
}

static void describe_pieces(merger *m) {
    const fct_charter *c = m->charter;
    for (uint32_t i = 0; i < c->count; ++i) m->pieces[i] = (piece){.head = FCT_NONE, .fresh = true};
    for (uint32_t p = 0; p < c->view->face_count; ++p) {
        piece *item = &m->pieces[c->labels[p]];
        v3 vector = fct_face_vector(c->view, p);
        item->vector = v3_add(item->vector, vector);
        item->area += v3_norm(vector);
        if (item->head == FCT_NONE)
            item->head = p;
        else
            m->next[item->tail] = p;
        item->tail = p;
        m->next[p] = FCT_NONE;
        ++item->faces;
        item->fixed = item->fixed || (fct_face_repeats(c->view, p) && !c->def.any_topology);
        for (uint32_t side = 3 * p; side < 3 * p + 3; ++side) {
            uint32_t before = c->sides.before[side], after = c->sides.after[side];
            bool inside = (before != FCT_NONE && c->labels[before / 3] == c->labels[p]) ||
                          (after != FCT_NONE && c->labels[after / 3] == c->labels[p]);
            if (!inside) item->perimeter += fct_side_length(c->view, side);
        }
    }
    for (uint32_t i = 0; i < c->count; ++i)
        m->pieces[i].cone = find_widest_angle(m, i, m->pieces[i].vector, INFINITY);
}

/* Renumbers the charts in order of first places. */
static void renumber_charts(merger *m) {
    fct_charter *c = m->charter;
    for (uint32_t i = 0; i < c->count; ++i) m->pieces[i].head = FCT_NONE;
    uint32_t count = 0;
    for (uint32_t p = 0; p < c->view->face_count; ++p) {
        piece *item = &m->pieces[c->labels[p]];
        if (item->head == FCT_NONE) item->head = count++;
        c->labels[p] = item->head;
    }
    c->count = count;
}

static fct_result run_rounds(const fct_env *env, merger *m) {
    fct_result result = FCT_OK;
    uint32_t joined = 1;
    describe_pieces(m);
    for (int round = 0; round < MOST_ROUNDS && joined && result == FCT_OK; ++round) {
        for (uint32_t i = 0; i < m->charter->count; ++i) {
            m->pieces[i].fresh = round == 0 || m->pieces[i].grew;
            m->pieces[i].grew = false;
        }
        result = run_round(env, m, &joined);
        if (result == FCT_OK) result = fct_progress(env, "merging", 1 - 1.0 / (round + 2));
    }
    if (result == FCT_OK) renumber_charts(m);
    return result;
}

fct_result fct_charts_merge(const fct_env *env, fct_charter *c) {
    merger m = {.charter = c};
    const fct_array arrays[] = {FCT_ARRAY(m.pieces, c->count), FCT_ARRAY(m.next, c->view->face_count),
                                FCT_ARRAY(m.last_label, c->view->vertex_count),
                                FCT_ARRAY_ZERO(m.stamps, c->view->vertex_count),
                                FCT_ARRAY(m.shared, c->view->vertex_count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "charts");
    if (result == FCT_OK) result = run_rounds(env, &m);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    fct_release(env, m.set);
    return result;
}
