/* simplify/progressive/build.c: see build.h.
 *
 * 1. Sort the records by their keys, so that levels in the middle of a sweep are even.
 * 2. Repeat the contractions on the faces of the input. Each one ends nodes and faces. They are listed, with
 *    the corners that move away from the ended nodes.
 * 3. What remains is the base mesh. Write it, then the lists in reverse order: those of the last contraction
 *    first.
 * Handles are wedges of the simplifier (without attributes: points). When wedges
 * merge, that of the kept point stays, so that few corners move. Cost: linear, plus the rings of vanished
 * points.
 */
#include "simplify/progressive/build.h"
#include "mesh/mesh.h"

#include "simplify/output.h"
#include "simplify/progressive/progressive.h"

/* A node that has ended, in the order of the contractions. */
typedef struct ended_node {
    uint32_t node;
    uint32_t first_corner, corner_count; /* of `moved` */
} ended_node;

typedef struct ended_step {
    uint32_t nodes, faces; /* the number of ended nodes and faces after this contraction */
    float error;
} ended_step;

typedef struct builder {
    const fct_simplifier *s;
    const fct_log *log;
    fct_progressive *m;
    uint32_t handle_count;
    uint32_t *order; /* records by their keys */
    /* Per corner. */
    uint32_t *points, *handles, *next_corners; /* handles of a removed face stay as they were */
    /* Per face: it was removed, or it is degenerate. */
    bool *dead;
    /* Per point. */
    uint32_t *first_corners, *last_corners, *faces;
    /* Per handle. */
    uint32_t *handle_nodes, *uses, *handle_points, *wedge_handles, *merged; /* merged: FCT_NONE: not merged */
    /* Per node, in the order of the contractions. */
    uint32_t node_count;
    uint32_t *node_parents, *node_handles, *node_points;
    float *positions, *values;
    /* Lists. */
    ended_step *steps;
    uint32_t step_count;
    ended_node *ended;
    uint32_t ended_count;
    uint32_t *removed, removed_count; /* faces */
    uint32_t *moved;                  /* corners */
    size_t moved_count, moved_capacity;
    uint32_t ring[2 * SIMPLIFY_HUB], ring_count;      /* the corners of the point that goes */
    uint32_t old[4 * SIMPLIFY_MAX_WEDGES], old_count; /* the handles at both points */
} builder;

static void sort_records(builder *b) {
    uint32_t *starts = b->order + b->log->count; /* QUEUE_BUCKETS + 1 */
    memset(starts, 0, (QUEUE_BUCKETS + 1) * sizeof *starts);
    for (uint32_t i = 0; i < b->log->count; ++i) ++starts[b->log->records[i].key + 1];
    for (uint32_t k = 0; k < QUEUE_BUCKETS; ++k) starts[k + 1] += starts[k];
    for (uint32_t i = 0; i < b->log->count; ++i) b->order[starts[b->log->records[i].key]++] = i;
}

/* The values of a corner of the input, as a level has them. */
static void read_values(const builder *b, size_t corner, uint32_t point, float *out) {
    const fct_mesh *mesh = b->s->mesh;
    size_t v = mesh->triangles[corner];
    if (mesh->colors) memcpy(out + b->m->color, mesh->colors + 3 * v, 3 * sizeof *out);
    if (mesh->texcoords) memcpy(out + b->m->texcoord, mesh->texcoords + 2 * corner, 2 * sizeof *out);
    if (!mesh->normals) return;
    memcpy(out + b->m->normal, mesh->normals + 3 * v, 3 * sizeof *out);
    fct_simplify_write_normal(b->s, point, out + b->m->normal);
}

/* The values of an entry of the log, in the order of the nodes. */
static void read_logged(const builder *b, size_t entry, uint32_t point, float *out) {
    const fct_simplifier *s = b->s;
    const float *from = b->log->values + s->channel_count * entry;
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        uint32_t first = channel->source == CHANNEL_COLOR    ? b->m->color
                         : channel->source == CHANNEL_NORMAL ? b->m->normal
                                                             : b->m->texcoord;
        out[first + channel->component] = from[i];
    }
    if (b->m->normal != FCT_NONE) fct_simplify_write_normal(s, point, out + b->m->normal);
}

/* Starts a node of a handle at a point; the caller fills in position and values. */
static uint32_t start_node(builder *b, uint32_t handle, uint32_t point) {
    uint32_t node = b->node_count++;
    b->node_parents[node] = FCT_NONE;
    b->node_handles[node] = handle;
    b->node_points[node] = point;
    b->handle_nodes[handle] = node;
    b->handle_points[handle] = point;
    return node;
}

static void start_corner(builder *b, uint32_t c) {
    const fct_simplifier *s = b->s;
    uint32_t v = s->mesh->triangles[c], p = s->point_of[v], h = s->corner_wedges ? s->corner_wedges[c] : p;
    b->points[c] = p;
    b->handles[c] = h;
    b->next_corners[c] = FCT_NONE;
    if (b->first_corners[p] == FCT_NONE)
        b->first_corners[p] = c;
    else
        b->next_corners[b->last_corners[p]] = c;
    b->last_corners[p] = c;
    ++b->faces[p];
    if (b->uses[h]++) return;
    uint32_t node = start_node(b, h, p);
    /* The point's source is its lowest vertex; the vertices of a point differ at most in the sign of 0. */
    memcpy(b->positions + 3 * (size_t)node, s->mesh->positions + 3 * (size_t)v, 3 * sizeof *b->positions);
    if (b->m->value_count) read_values(b, c, p, b->values + (size_t)b->m->value_count * node);
}

static void start_faces(builder *b) {
    const fct_simplifier *s = b->s;
    memset(b->first_corners, 0xff, s->point_count * sizeof *b->first_corners);
    memset(b->merged, 0xff, b->handle_count * sizeof *b->merged);
    memset(b->handle_nodes, 0xff, b->handle_count * sizeof *b->handle_nodes);
    for (uint32_t h = 0; h < b->handle_count; ++h) b->wedge_handles[h] = h;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        const uint32_t *t = s->mesh->triangles + 3 * (size_t)f;
        uint32_t x = s->point_of[t[0]], y = s->point_of[t[1]], z = s->point_of[t[2]];
        b->dead[f] = x == y || y == z || z == x;
        for (uint32_t k = 0; k < 3 && !b->dead[f]; ++k) start_corner(b, 3 * f + k);
    }
}

/* Appends the live corners of a point to the ring. */
static void gather_ring(builder *b, uint32_t point) {
    for (uint32_t c = b->first_corners[point]; c != FCT_NONE; c = b->next_corners[c])
        if (!b->dead[c / 3]) b->ring[b->ring_count++] = c;
}

static uint32_t find_survivor(const builder *b, uint32_t handle) {
    while (b->merged[handle] != FCT_NONE) handle = b->merged[handle];
    return handle;
}

static void list_old(builder *b, uint32_t handle) {
    for (uint32_t i = 0; i < b->old_count; ++i)
        if (b->old[i] == handle) return;
    b->old[b->old_count++] = handle;
}

/* Merges two handles of a face that vanishes; a handle of the kept point survives. */
static void merge_handles(builder *b, uint32_t kept, uint32_t other, uint32_t kept_point) {
    uint32_t x = find_survivor(b, kept), y = find_survivor(b, other);
    if (x == y) return;
    if (b->handle_points[x] != kept_point && b->handle_points[y] == kept_point)
        b->merged[x] = y;
    else
        b->merged[y] = x;
}

/* Removes the faces at both points (all faces at both rings if `body`), merges handles, and lists the handles
 * at the vanishing faces and at the gone point. */
static void remove_faces(builder *b, const fct_record *r) {
    for (uint32_t i = 0; i < b->ring_count; ++i) {
        uint32_t c = b->ring[i], f = c / 3, at = FCT_NONE;
        list_old(b, b->handles[c]);
        if (b->dead[f]) continue;
        for (uint32_t k = 3 * f; k < 3 * f + 3; ++k)
            if (b->points[k] == r->kept) at = k;
        if (at == FCT_NONE && !r->body) continue;
        b->dead[f] = true;
        b->removed[b->removed_count++] = f;
        for (uint32_t k = 3 * f; k < 3 * f + 3; ++k) --b->uses[b->handles[k]], --b->faces[b->points[k]];
        if (at == FCT_NONE) continue;
        list_old(b, b->handles[at]);
        if (b->points[c] == r->gone) merge_handles(b, b->handles[at], b->handles[c], r->kept);
    }
}

static fct_result move_corner(builder *b, uint32_t c, uint32_t to) {
    fct_result result =
        fct_grow(b->s->env, (void **)&b->moved, &b->moved_capacity, b->moved_count + 1, sizeof *b->moved);
    if (result != FCT_OK) return result;
    if (b->moved_count + 1 >= FCT_NONE) return fct_fail_memory(b->s->env, "a progressive mesh");
    b->moved[b->moved_count++] = c;
    --b->uses[b->handles[c]], ++b->uses[to];
    b->handles[c] = to;
    return FCT_OK;
}

/* Ends the node of a handle; its corners in the ring, and at the kept point, move to the survivor. */
static fct_result end_node(builder *b, uint32_t handle, uint32_t parent, const fct_record *r) {
    uint32_t to = find_survivor(b, handle);
    size_t first = b->moved_count;
    fct_result result = FCT_OK;
    for (uint32_t i = 0; i < b->ring_count && to != handle && result == FCT_OK; ++i)
        if (b->handles[b->ring[i]] == handle && !b->dead[b->ring[i] / 3])
            result = move_corner(b, b->ring[i], to);
    bool kept = to != handle && b->handle_points[handle] == r->kept;
    for (uint32_t c = kept ? b->first_corners[r->kept] : FCT_NONE; c != FCT_NONE && result == FCT_OK;
         c = b->next_corners[c])
        if (!b->dead[c / 3] && b->handles[c] == handle) result = move_corner(b, c, to);
    uint32_t node = b->handle_nodes[handle];
    b->node_parents[node] = parent;
    b->ended[b->ended_count++] = (ended_node){node, (uint32_t)first, (uint32_t)(b->moved_count - first)};
    return result;
}

/* Ends the nodes of the other corners of the removed faces that lost their last face. */
static fct_result end_apexes(builder *b, const fct_record *r, uint32_t first_removed) {
    fct_result result = FCT_OK;
    for (uint32_t i = first_removed; i < b->removed_count; ++i)
        for (uint32_t c = 3 * b->removed[i]; c < 3 * b->removed[i] + 3; ++c) {
            uint32_t p = b->points[c], h = b->handles[c], parent = FCT_NONE;
            if (p == r->kept || p == r->gone || b->uses[h] > 0 || b->handle_nodes[h] == FCT_NONE) continue;
            uint32_t *live = &b->first_corners[p];
            while (*live != FCT_NONE && b->dead[*live / 3]) *live = b->next_corners[*live];
            if (*live != FCT_NONE) parent = b->handle_nodes[b->handles[*live]];
            result = end_node(b, h, parent, r);
            if (result != FCT_OK) return result;
            b->handle_nodes[h] = FCT_NONE;
        }
    return FCT_OK;
}

/* Appends the corners of the gone point to those of the kept one. */
static void join_rings(builder *b, const fct_record *r) {
    uint32_t a = r->kept, last = b->last_corners[a];
    for (uint32_t i = 0; i < b->ring_count; ++i) {
        uint32_t c = b->ring[i];
        if (b->dead[c / 3] || b->points[c] != r->gone) continue;
        b->points[c] = a;
        ++b->faces[a];
        if (b->first_corners[a] == FCT_NONE)
            b->first_corners[a] = c;
        else
            b->next_corners[last] = c;
        last = c;
        b->next_corners[c] = FCT_NONE;
    }
    b->last_corners[a] = last;
    b->first_corners[r->gone] = FCT_NONE;
}

/* Starts the node of a wedge of the kept point. Returns FCT_NONE if no face uses it. */
static uint32_t start_kept_node(builder *b, const fct_record *r, uint32_t handle, size_t entry) {
    uint32_t total = 0;
    for (uint32_t i = 0; i < b->old_count; ++i)
        if (find_survivor(b, b->old[i]) == handle) total += b->uses[b->old[i]];
    if (total == 0) return FCT_NONE;
    uint32_t node = start_node(b, handle, r->kept);
    memcpy(b->positions + 3 * (size_t)node, r->at, sizeof r->at);
    if (b->m->value_count) read_logged(b, entry, r->kept, b->values + (size_t)b->m->value_count * node);
    return node;
}

/* Replaces the nodes of both points by those of the kept point afterwards. */
static fct_result replace_nodes(builder *b, const fct_record *r) {
    uint32_t entries = b->s->channel_count ? r->wedge_count : 1, any = FCT_NONE;
    uint32_t survivors[SIMPLIFY_MAX_WEDGES], started[SIMPLIFY_MAX_WEDGES];
    size_t first = r->first_wedge;
    for (uint32_t i = 0; i < entries; ++i) {
        uint32_t wedge = b->s->channel_count ? b->log->wedges[first + i] : r->kept;
        list_old(b, b->wedge_handles[wedge]);
        survivors[i] = find_survivor(b, b->wedge_handles[wedge]);
        list_old(b, survivors[i]);
        b->wedge_handles[wedge] = survivors[i];
    }
    uint32_t before[FCT_LENGTH(b->old)];
    for (uint32_t k = 0; k < b->old_count; ++k) before[k] = b->handle_nodes[b->old[k]];
    for (uint32_t i = 0; i < entries; ++i) {
        started[i] = start_kept_node(b, r, survivors[i], first + i);
        if (started[i] != FCT_NONE) any = started[i];
    }
    for (uint32_t k = 0; k < b->old_count; ++k) {
        uint32_t h = b->old[k], parent = any;
        if (before[k] == FCT_NONE) continue; /* no face used it */
        for (uint32_t i = 0; i < entries; ++i)
            if (survivors[i] == find_survivor(b, h) && started[i] != FCT_NONE) parent = started[i];
        uint32_t current = b->handle_nodes[h];
        b->handle_nodes[h] = before[k];
        fct_result result = end_node(b, h, parent, r);
        b->handle_nodes[h] = current != before[k] ? current : FCT_NONE;
        if (result != FCT_OK) return result;
    }
    for (uint32_t k = 0; k < b->old_count; ++k) b->merged[b->old[k]] = FCT_NONE;
    return FCT_OK;
}

static void end_step(builder *b, float error) {
    float before = b->step_count ? b->steps[b->step_count - 1].error : 0;
    b->steps[b->step_count++] =
        (ended_step){b->ended_count, b->removed_count, error > before ? error : before};
}

/* Removes the faces of an inner wall. continues: the record before is a wall of the same pair, and both are
 * one step. */
static fct_result repeat_wall(builder *b, const fct_record *r, bool continues) {
    static const fct_record apart = {.kept = FCT_NONE, .gone = FCT_NONE};
    uint32_t first_removed = b->removed_count;
    b->ring_count = 0;
    for (int i = 0; i < 2; ++i) {
        uint32_t f = i ? r->gone : r->kept;
        if (f == FCT_NONE) continue;
        b->dead[f] = true;
        b->removed[b->removed_count++] = f;
        for (uint32_t k = 3 * f; k < 3 * f + 3; ++k) --b->uses[b->handles[k]], --b->faces[b->points[k]];
    }
    fct_result result = end_apexes(b, &apart, first_removed);
    if (continues) --b->step_count;
    end_step(b, r->error);
    return result;
}

static fct_result repeat_contraction(builder *b, const fct_record *r) {
    uint32_t first_removed = b->removed_count;
    b->ring_count = b->old_count = 0;
    gather_ring(b, r->gone);
    if (r->body) gather_ring(b, r->kept);
    remove_faces(b, r);
    if (!b->s->channel_count) /* the ends of a pair have no common face */
        merge_handles(b, b->wedge_handles[r->kept], b->wedge_handles[r->gone], r->kept);
    fct_result result = replace_nodes(b, r);
    if (result == FCT_OK) result = end_apexes(b, r, first_removed);
    join_rings(b, r);
    end_step(b, r->error);
    return result;
}

/* Numbers points in the order of their nodes. */
static void number_points(builder *b) {
    fct_progressive *m = b->m;
    uint32_t *numbers = b->first_corners;
    memset(numbers, 0xff, b->s->point_count * sizeof *numbers);
    m->point_count = 0;
    for (uint32_t n = 0; n < m->node_count; ++n) {
        uint32_t *number = &numbers[m->points[n]];
        if (*number == FCT_NONE) *number = m->point_count++;
        m->points[n] = *number;
    }
}

static void write_node(builder *b, uint32_t node, const ended_node *ended, const uint32_t *face_places,
                       const uint32_t *numbers) {
    fct_progressive *m = b->m;
    uint32_t to = numbers[node], parent = b->node_parents[node];
    m->parents[to] = parent == FCT_NONE ? FCT_NONE : numbers[parent];
    m->handles[to] = b->node_handles[node];
    m->points[to] = b->node_points[node];
    m->first_corners[to] = m->corner_count;
    memcpy(m->positions + 3 * (size_t)to, b->positions + 3 * (size_t)node, 3 * sizeof *m->positions);
    if (m->value_count)
        memcpy(m->values + (size_t)m->value_count * to, b->values + (size_t)m->value_count * node,
               m->value_count * sizeof *m->values);
    for (uint32_t i = 0; ended && i < ended->corner_count; ++i) {
        uint32_t c = b->moved[ended->first_corner + i];
        m->corners[m->corner_count++] = 3 * face_places[c / 3] + c % 3;
    }
}

static void write_face(builder *b, uint32_t f, uint32_t to) {
    const fct_mesh *mesh = b->s->mesh;
    fct_progressive *m = b->m;
    memcpy(m->triangles + 3 * (size_t)to, b->handles + 3 * (size_t)f, 3 * sizeof *m->triangles);
    if (m->materials) m->materials[to] = mesh->materials[f];
    if (m->face_colors)
        memcpy(m->face_colors + 3 * (size_t)to, mesh->face_colors + 3 * (size_t)f,
               3 * sizeof *m->face_colors);
}

/* Writes the base mesh: the nodes and faces that are left. */
static void write_base(builder *b, uint32_t *face_places, uint32_t *numbers) {
    fct_progressive *m = b->m;
    for (uint32_t f = 0; f < b->s->mesh->face_count; ++f) {
        if (b->dead[f]) continue;
        for (uint32_t c = 3 * f; c < 3 * f + 3; ++c) {
            uint32_t node = b->handle_nodes[b->handles[c]];
            if (numbers[node] != FCT_NONE) continue;
            numbers[node] = m->node_count++;
            write_node(b, node, NULL, NULL, numbers);
        }
        face_places[f] = m->face_count++;
        write_face(b, f, face_places[f]);
    }
    m->step_nodes[1] = m->node_count, m->step_faces[1] = m->face_count;
}

/* Writes the step that undoes contraction i. */
static void write_step(builder *b, uint32_t i, uint32_t *face_places, uint32_t *numbers) {
    fct_progressive *m = b->m;
    uint32_t node = i ? b->steps[i - 1].nodes : 0, face = i ? b->steps[i - 1].faces : 0;
    for (uint32_t k = node; k < b->steps[i].nodes; ++k) numbers[b->ended[k].node] = m->node_count++;
    for (uint32_t k = node; k < b->steps[i].nodes; ++k)
        write_node(b, b->ended[k].node, &b->ended[k], face_places, numbers);
    for (; face < b->steps[i].faces; ++face) {
        face_places[b->removed[face]] = m->face_count++;
        write_face(b, b->removed[face], m->face_count - 1);
    }
    uint32_t step = b->step_count - i;
    m->errors[step] = i ? b->steps[i - 1].error : 0;
    m->step_nodes[step + 1] = m->node_count, m->step_faces[step + 1] = m->face_count;
}

static fct_result allocate_progressive(builder *b) {
    const fct_mesh *mesh = b->s->mesh;
    fct_progressive *m = b->m;
    size_t nodes = b->node_count, faces = b->s->face_count, steps = (size_t)b->step_count + 1;
    m->handle_count = b->handle_count;
    const fct_array arrays[] = {FCT_ARRAY(m->step_nodes, steps + 1),
                                FCT_ARRAY(m->step_faces, steps + 1),
                                FCT_ARRAY_ZERO(m->errors, steps),
                                FCT_ARRAY(m->parents, nodes),
                                FCT_ARRAY(m->handles, nodes),
                                FCT_ARRAY(m->points, nodes),
                                FCT_ARRAY(m->first_corners, nodes + 1),
                                FCT_ARRAY(m->positions, 3 * nodes),
                                FCT_ARRAY(m->values, nodes * m->value_count),
                                FCT_ARRAY(m->corners, b->moved_count),
                                FCT_ARRAY_ZERO(m->nodes, b->handle_count),
                                FCT_ARRAY(m->triangles, 3 * faces),
                                FCT_ARRAY_IF(mesh->materials, m->materials, faces),
                                FCT_ARRAY_IF(mesh->face_colors, m->face_colors, 3 * faces)};
    return fct_allocate_all(b->s->env, arrays, FCT_LENGTH(arrays), "a progressive mesh");
}

static fct_result write_progressive(builder *b) {
    fct_progressive *m = b->m;
    uint32_t *face_places, *numbers;
    const fct_array arrays[] = {FCT_ARRAY(face_places, b->s->mesh->face_count),
                                FCT_ARRAY(numbers, b->node_count)};
    fct_result result = allocate_progressive(b);
    const fct_mesh *mesh = b->s->mesh;
    m->material_count = mesh->material_count;
    if (result == FCT_OK)
        result = fct_names_copy(m->env, mesh->material_names, mesh->material_count, &m->material_names);
    if (result == FCT_OK)
        result = fct_allocate_all(b->s->env, arrays, FCT_LENGTH(arrays), "numbers of nodes");
    if (result != FCT_OK) return result;
    memset(numbers, 0xff, b->node_count * sizeof *numbers);
    m->step_count = b->step_count + 1;
    m->step_nodes[0] = m->step_faces[0] = 0;
    m->errors[0] = b->step_count ? b->steps[b->step_count - 1].error : 0;
    write_base(b, face_places, numbers);
    for (uint32_t i = b->step_count; i-- > 0;) write_step(b, i, face_places, numbers);
    m->first_corners[m->node_count] = m->corner_count;
    m->total_faces = m->face_count;
    number_points(b);
    fct_release_all(b->s->env, arrays, FCT_LENGTH(arrays));
    return fct_progressive_begin(m);
}

static fct_result run_builder(builder *b) {
    const fct_simplifier *s = b->s;
    size_t corners = 3 * (size_t)s->mesh->face_count, points = s->point_count, handles = b->handle_count;
    size_t records = b->log->count, nodes = handles + (s->channel_count ? b->log->wedge_count : records);
    if (nodes >= FCT_NONE) return fct_fail_memory(s->env, "a progressive mesh of more than 2^32 nodes");
    const fct_array arrays[] = {FCT_ARRAY(b->order, records + QUEUE_BUCKETS + 1),
                                FCT_ARRAY(b->points, corners),
                                FCT_ARRAY(b->handles, corners),
                                FCT_ARRAY(b->next_corners, corners),
                                FCT_ARRAY(b->dead, s->mesh->face_count),
                                FCT_ARRAY(b->first_corners, points),
                                FCT_ARRAY(b->last_corners, points),
                                FCT_ARRAY_ZERO(b->faces, points),
                                FCT_ARRAY(b->handle_nodes, handles),
                                FCT_ARRAY_ZERO(b->uses, handles),
                                FCT_ARRAY(b->handle_points, handles),
                                FCT_ARRAY(b->wedge_handles, handles),
                                FCT_ARRAY(b->merged, handles),
                                FCT_ARRAY(b->node_parents, nodes),
                                FCT_ARRAY(b->node_handles, nodes),
                                FCT_ARRAY(b->node_points, nodes),
                                FCT_ARRAY(b->positions, 3 * nodes),
                                FCT_ARRAY(b->values, nodes * b->m->value_count),
                                FCT_ARRAY(b->steps, records),
                                FCT_ARRAY(b->ended, nodes),
                                FCT_ARRAY(b->removed, s->mesh->face_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "a progressive mesh");
    if (result != FCT_OK) return result;
    sort_records(b);
    start_faces(b);
    for (uint32_t i = 0; i < records && result == FCT_OK; ++i) {
        const fct_record *r = &b->log->records[b->order[i]];
        result =
            r->wall ? repeat_wall(b, r, b->log->records[b->order[i - 1]].wall) : repeat_contraction(b, r);
    }
    if (result == FCT_OK) result = write_progressive(b);
    fct_release(s->env, b->moved);
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_progressive_build(const fct_simplifier *s, fct_progressive **out) {
    *out = NULL;
    builder *b = fct_allocate_zero(s->env, 1, sizeof *b);
    fct_progressive *m = fct_allocate_zero(s->env, 1, sizeof *m);
    fct_result result = b && m ? FCT_OK : fct_fail_memory(s->env, "a progressive mesh");
    if (m) m->env = s->env;
    if (result == FCT_OK) {
        m->color = m->normal = m->texcoord = FCT_NONE;
        if (s->mesh->colors) m->color = m->value_count, m->value_count += 3;
        if (s->mesh->normals) m->normal = m->value_count, m->value_count += 3;
        if (s->mesh->texcoords) m->texcoord = m->value_count, m->value_count += 2;
        memcpy(m->origin, s->mesh->origin, sizeof m->origin);
        b->s = s, b->log = s->log, b->m = m;
        b->handle_count = s->corner_wedges ? s->wedge_count : s->point_count;
        result = run_builder(b);
    }
    fct_release(s->env, b);
    if (result == FCT_OK)
        *out = m;
    else
        fct_progressive_destroy(m);
    return result;
}
