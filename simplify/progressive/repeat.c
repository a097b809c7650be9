/* simplify/progressive/repeat.c: see repeat.h.
 *
 * Handles are wedges of the simplifier (without attributes: points). When wedges merge, that of the kept
 * point stays, so that few corners move.
 */
#include "simplify/progressive/repeat.h"

#include <string.h>

#include "simplify/output.h"

/* The values of a corner of the input, as a level has them. */
static void read_values(const fct_builder *b, size_t corner, uint32_t point, float *out) {
    const fct_mesh *mesh = b->s->mesh;
    size_t v = mesh->triangles[corner];
    if (mesh->colors) memcpy(out + b->m->color, mesh->colors + 3 * v, 3 * sizeof *out);
    if (mesh->texcoords) memcpy(out + b->m->texcoord, mesh->texcoords + 2 * corner, 2 * sizeof *out);
    if (!mesh->normals) return;
    memcpy(out + b->m->normal, mesh->normals + 3 * v, 3 * sizeof *out);
    if (!b->locked[point]) fct_simplify_write_normal(out + b->m->normal);
}

/* The values of an entry of the log, in the order of the nodes. */
static void read_logged(const fct_builder *b, size_t entry, uint32_t point, float *out) {
    const fct_simplifier *s = b->s;
    const float *from = b->log->values + s->channel_count * entry;
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        if (channel->source == CHANNEL_LIGHT) continue;
        uint32_t first = channel->source == CHANNEL_COLOR    ? b->m->color
                         : channel->source == CHANNEL_NORMAL ? b->m->normal
                                                             : b->m->texcoord;
        out[first + channel->component] = from[i];
    }
    if (b->m->normal != FCT_NONE && !b->locked[point]) fct_simplify_write_normal(out + b->m->normal);
}

/* Starts a node of a handle at a point; the caller fills in position and values. */
static uint32_t start_node(fct_builder *b, uint32_t handle, uint32_t point) {
    uint32_t node = b->node_count++;
    b->node_parents[node] = FCT_NONE;
    b->node_handles[node] = handle;
    b->node_points[node] = point;
    b->handle_nodes[handle] = node;
    b->handle_points[handle] = point;
    return node;
}

static void start_corner(fct_builder *b, uint32_t c) {
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

void fct_builder_start(fct_builder *b) {
    const fct_simplifier *s = b->s;
    memset(b->first_corners, 0xff, s->point_count * sizeof *b->first_corners);
    memcpy(b->locked, b->log->locked, s->point_count * sizeof *b->locked);
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
static void gather_ring(fct_builder *b, uint32_t point) {
    for (uint32_t c = b->first_corners[point]; c != FCT_NONE; c = b->next_corners[c])
        if (!b->dead[c / 3]) b->ring[b->ring_count++] = c;
}

static uint32_t find_survivor(const fct_builder *b, uint32_t handle) {
    while (b->merged[handle] != FCT_NONE) handle = b->merged[handle];
    return handle;
}

static void list_old(fct_builder *b, uint32_t handle) {
    for (uint32_t i = 0; i < b->old_count; ++i)
        if (b->old[i] == handle) return;
    b->old[b->old_count++] = handle;
}

/* Merges two handles of a face that vanishes; a handle of the kept point survives. */
static void merge_handles(fct_builder *b, uint32_t kept, uint32_t other, uint32_t kept_point) {
    uint32_t x = find_survivor(b, kept), y = find_survivor(b, other);
    if (x == y) return;
    if (b->handle_points[x] != kept_point && b->handle_points[y] == kept_point)
        b->merged[x] = y;
    else
        b->merged[y] = x;
}

/* Removes the faces at both points (all faces at both rings if `body`), merges handles, and lists the handles
 * at the vanishing faces and at the gone point. */
static void remove_faces(fct_builder *b, const fct_record *r) {
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

static fct_result move_corner(fct_builder *b, uint32_t c, uint32_t to) {
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
static fct_result end_node(fct_builder *b, uint32_t handle, uint32_t parent, const fct_record *r) {
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
    b->ended[b->ended_count++] = (fct_ended_node){node, (uint32_t)first, (uint32_t)(b->moved_count - first)};
    return result;
}

/* Ends the nodes of the other corners of the removed faces that lost their last face. */
static fct_result end_apexes(fct_builder *b, const fct_record *r, uint32_t first_removed) {
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
static void join_rings(fct_builder *b, const fct_record *r) {
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
static uint32_t start_kept_node(fct_builder *b, const fct_record *r, uint32_t handle, size_t entry) {
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
static fct_result replace_nodes(fct_builder *b, const fct_record *r) {
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

static void end_step(fct_builder *b, float error, bool wall) {
    float before = b->step_count ? b->steps[b->step_count - 1].error : 0;
    b->steps[b->step_count++] =
        (fct_ended_step){b->ended_count, b->removed_count, error > before ? error : before, wall};
}

fct_result fct_builder_repeat_wall(fct_builder *b, const fct_record *r, bool continues) {
    static const fct_record apart = {.kept = FCT_NONE, .gone = FCT_NONE};
    uint32_t first_removed = b->removed_count;
    bool wall = !continues || b->steps[b->step_count - 1].wall;
    b->ring_count = 0;
    for (int i = 0; i < 2; ++i) {
        uint32_t f = i ? r->gone : r->kept;
        if (f == FCT_NONE) continue;
        b->dead[f] = true;
        b->removed[b->removed_count++] = f;
        for (uint32_t k = 3 * f; k < 3 * f + 3; ++k) {
            --b->uses[b->handles[k]];
            wall &= --b->faces[b->points[k]] > 0;
        }
    }
    fct_result result = end_apexes(b, &apart, first_removed);
    if (continues) --b->step_count;
    end_step(b, r->error, wall);
    return result;
}

fct_result fct_builder_repeat(fct_builder *b, const fct_record *r) {
    uint32_t first_removed = b->removed_count;
    b->ring_count = b->old_count = 0;
    b->locked[r->kept] |= b->locked[r->gone];
    gather_ring(b, r->gone);
    if (r->body) gather_ring(b, r->kept);
    remove_faces(b, r);
    if (!b->s->channel_count) /* the ends of a pair have no common face */
        merge_handles(b, b->wedge_handles[r->kept], b->wedge_handles[r->gone], r->kept);
    fct_result result = replace_nodes(b, r);
    if (result == FCT_OK) result = end_apexes(b, r, first_removed);
    join_rings(b, r);
    end_step(b, r->error, false);
    return result;
}
