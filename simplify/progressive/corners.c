/* simplify/progressive/corners.c: see corners.h. Cost of a corner: linear in the members of the split (at
 * most 256), or in the corners of its point (at most 64; longer lists are not searched). */
#include "simplify/progressive/corners.h"

#include <math.h>
#include <string.h>

void fct_splits_fail(fct_splits *k) {
    if (k->result == FCT_OK) k->result = FCT_ERROR_DATA;
}

bool fct_splits_stopped(fct_splits *k) {
    if (k->coder.overrun) fct_splits_fail(k);
    return k->result != FCT_OK;
}

bool fct_splits_grow(fct_splits *k, void **array, size_t *room, size_t count, size_t size) {
    if (k->result == FCT_OK && count > *room) k->result = fct_grow(k->m->env, array, room, count, size);
    return k->result == FCT_OK;
}

bool fct_splits_check_count(fct_splits *k, size_t count) {
    if (count >= INT32_MAX) fct_splits_fail(k);
    return k->result == FCT_OK;
}

void fct_splits_append_corner(fct_splits *k, uint32_t point, uint32_t c) {
    stream_point *p = &k->points[point];
    if (k->recent) k->recent[k->m->triangles[c]] = c;
    k->next[c] = FCT_NONE;
    k->previous[c] = p->last;
    if (p->last == FCT_NONE)
        p->first = c;
    else
        k->next[p->last] = c;
    p->last = c;
    ++p->count;
}

void fct_splits_remove_corner(fct_splits *k, uint32_t point, uint32_t c) {
    stream_point *p = &k->points[point];
    uint32_t next = k->next[c], previous = k->previous[c];
    if (next == FCT_NONE)
        p->last = previous;
    else
        k->previous[next] = previous;
    if (previous == FCT_NONE)
        p->first = next;
    else
        k->next[previous] = next;
    --p->count;
}

void fct_splits_code_position(fct_splits *k, int context, const float guess[3], float at[3]) {
    for (int i = 0; i < 3; ++i) {
        at[i] = fct_code_float(&k->coder, &k->models.position[context][i], guess[i], at[i]);
        if (!isfinite(at[i])) fct_splits_fail(k);
    }
}

uint32_t fct_splits_add_point(fct_splits *k, uint32_t point, int context, const float guess[3],
                              const float *at) {
    uint32_t name = k->point_count;
    stream_point made = {FCT_NONE, FCT_NONE, 0, {0, 0, 0}};
    float near[3]; /* a copy, because `guess` may be one of `points`, which moves */
    memcpy(near, guess, sizeof near);
    if (!k->names &&
        (!fct_splits_check_count(k, (size_t)name + 1) || !GROW(k, k->points, k->room.list, name + 1)))
        return 0;
    if (at) memcpy(made.at, at, sizeof made.at);
    fct_splits_code_position(k, context, near, made.at);
    k->points[name] = made;
    if (k->names) k->names[point] = name;
    ++k->point_count;
    return name;
}

enum { ATTRIBUTES = 3 };

/* Fills in the guess of the values of a node, and the context of each: 0: as its parent (FCT_NONE: 0); 1: as
 * another node of this end, whose parent has the same attribute. */
static void guess_values(const fct_splits *k, uint32_t parent, uint32_t group, bool second, float *guess,
                         int contexts[PROGRESSIVE_VALUES]) {
    const fct_progressive *m = k->m;
    const uint32_t firsts[ATTRIBUTES] = {m->color, m->normal, m->texcoord}, sizes[ATTRIBUTES] = {3, 3, 2};
    size_t n = m->value_count;
    for (int a = 0; a < ATTRIBUTES; ++a) {
        if (firsts[a] == FCT_NONE) continue;
        size_t first = firsts[a], bytes = sizes[a] * sizeof(float);
        memset(guess + first, 0, bytes);
        if (parent == FCT_NONE) continue;
        const float *from = m->values + n * parent + first;
        memcpy(guess + first, from, bytes);
        for (uint32_t i = 0; i < k->member_count && group != FCT_NONE; ++i) {
            const stream_member *o = &k->members[i];
            if (o->group == FCT_NONE || o->second != second ||
                memcmp(from, m->values + n * m->parents[o->node] + first, bytes))
                continue;
            memcpy(guess + first, m->values + n * o->node + first, bytes);
            for (uint32_t x = 0; x < sizes[a]; ++x) contexts[first + x] = 1;
            break;
        }
    }
}

/* Codes the attributes of a node. A reader adds the node; a writer has it. Returns the node. */
static uint32_t code_node(fct_splits *k, uint32_t node, uint32_t parent, uint32_t point, uint32_t group) {
    fct_progressive *m = k->m;
    size_t n = m->value_count;
    if (!k->names) {
        node = m->node_count;
        if (!fct_splits_check_count(k, (size_t)node + 1) || !GROW(k, m->parents, k->room.parents, node + 1) ||
            !GROW(k, m->handles, k->room.handles, node + 1) ||
            !GROW(k, m->points, k->room.points, node + 1) ||
            !GROW(k, m->first_corners, k->room.first_corners, (size_t)node + 2) ||
            !GROW(k, m->positions, k->room.positions, 3 * ((size_t)node + 1)) ||
            !GROW(k, m->values, k->room.values, n * ((size_t)node + 1)))
            return 0;
        ++m->node_count;
        /* A node of the same step is a guess, but no parent. */
        m->parents[node] = parent < m->step_nodes[k->step] ? parent : FCT_NONE;
        m->points[node] = point, m->handles[node] = FCT_NONE;
        m->first_corners[node] = m->first_corners[node + 1] = m->corner_count;
        memcpy(m->positions + 3 * (size_t)node, k->points[point].at, 3 * sizeof *m->positions);
    }
    float guess[PROGRESSIVE_VALUES];
    int contexts[PROGRESSIVE_VALUES] = {0};
    if (n) guess_values(k, parent, group, point == k->born, guess, contexts);
    for (size_t i = 0; i < n; ++i) {
        float *value = &m->values[n * node + i];
        float coded =
            fct_code_float(&k->coder, &k->models.value[contexts[i]][i], guess[i], k->names ? *value : 0);
        if (!isfinite(coded)) fct_splits_fail(k);
        if (!k->names) *value = coded;
    }
    return node;
}

uint32_t fct_splits_give_handle(fct_splits *k, uint32_t node, uint32_t handle) {
    fct_progressive *m = k->m;
    if (handle == FCT_NONE) {
        handle = m->handle_count;
        if (!GROW(k, m->nodes, k->room.nodes, handle + 1)) return 0;
        ++m->handle_count;
    }
    m->handles[node] = handle;
    m->nodes[handle] = node;
    return handle;
}

static uint32_t add_member(fct_splits *k, uint32_t node, uint32_t parent, uint32_t group, bool second) {
    if (k->member_count == STREAM_MEMBERS) {
        fct_splits_fail(k);
        return 0;
    }
    node = code_node(k, node, parent, second ? k->born : k->split, group);
    if (k->result != FCT_OK) return 0;
    k->members[k->member_count] = (stream_member){group, node, second};
    if (k->names) k->coded[node] = true;
    return k->member_count++;
}

uint32_t fct_splits_code_member(fct_splits *k, uint32_t group, bool second, uint32_t node) {
    const fct_progressive *m = k->m;
    uint32_t found[STREAM_MEMBERS], count = 0, place = FCT_NONE;
    for (uint32_t i = 0; i < k->member_count; ++i) {
        if (k->members[i].group != group || k->members[i].second != second) continue;
        if (k->members[i].node == node) place = count;
        found[count++] = i;
    }
    if (count == 0 || (m->value_count && fct_code_bit(&k->coder, &k->models.another, place == FCT_NONE)))
        return add_member(k, node, k->names ? m->parents[node] : m->nodes[group], group, second);
    return found[fct_code_uniform(&k->coder, count, place)];
}

/* Codes a new handle at a point, for corner c. */
static void code_new_handle(fct_splits *k, size_t c, uint32_t parent, uint32_t point) {
    fct_progressive *m = k->m;
    uint32_t node = code_node(k, k->names ? m->nodes[m->triangles[c]] : 0, parent, point, FCT_NONE);
    if (k->result != FCT_OK) return;
    if (k->names)
        k->coded[node] = true;
    else
        m->triangles[c] = fct_splits_give_handle(k, node, FCT_NONE);
}

void fct_splits_code_end_corner(fct_splits *k, size_t c, bool second) {
    fct_progressive *m = k->m;
    uint32_t found[STREAM_MEMBERS], count = 0, place = FCT_NONE, wanted = FCT_NONE, group = 0;
    if (k->names) wanted = m->nodes[m->triangles[c]];
    for (uint32_t i = 0; i < k->member_count; ++i) {
        if (k->members[i].second != second) continue;
        if (k->members[i].node == wanted) place = count;
        found[count++] = i;
    }
    bool made =
        count == 0 || (m->value_count && fct_code_bit(&k->coder, &k->models.new_member, place == FCT_NONE));
    if (!made) {
        uint32_t i = found[fct_code_uniform(&k->coder, count, place)];
        if (!k->names) m->triangles[c] = m->handles[k->members[i].node];
        return;
    }
    if (k->group_count == 0) {
        fct_splits_fail(k);
        return;
    }
    uint32_t parent = k->names ? m->parents[wanted] : FCT_NONE;
    for (uint32_t i = 0; i < k->group_count && k->names; ++i)
        if (k->groups[i] == m->handles[parent]) group = i;
    group = fct_code_uniform(&k->coder, k->group_count, group);
    if (!k->names) parent = k->group_parents[group];
    uint32_t member = add_member(k, wanted, parent, FCT_NONE, second);
    if (k->result == FCT_OK && !k->names)
        m->triangles[c] = fct_splits_give_handle(k, k->members[member].node, FCT_NONE);
}

void fct_splits_code_point_corner(fct_splits *k, size_t c, uint32_t point) {
    fct_progressive *m = k->m;
    const stream_point *p = &k->points[point];
    if (p->count == 0) {
        code_new_handle(k, c, FCT_NONE, point);
        return;
    }
    uint32_t first = m->triangles[p->first], wanted = k->names ? m->triangles[c] : 0;
    if (!m->value_count || fct_code_bit(&k->coder, &k->models.first_handle, wanted == first)) {
        if (!k->names) m->triangles[c] = first;
        return;
    }
    if (fct_code_bit(&k->coder, &k->models.new_handle, k->names && !k->coded[m->nodes[wanted]])) {
        code_new_handle(k, c, m->nodes[first], point);
        return;
    }
    uint32_t other = k->names ? k->recent[wanted] : 0;
    if (k->names && (p->count <= STREAM_LIST || other == FCT_NONE || m->triangles[other] != wanted))
        for (other = p->first; m->triangles[other] != wanted;) other = k->next[other];
    if (p->count > STREAM_LIST)
        other = fct_code_uniform(&k->coder, 3 * (uint32_t)(c / 3), other);
    else {
        uint32_t place = 0, x = p->first;
        while (k->names && x != other) x = k->next[x], ++place;
        place = fct_code_uniform(&k->coder, p->count, place);
        for (other = p->first; place > 0; --place) other = k->next[other];
    }
    if (k->names) return;
    if (splits_point(k, m->triangles[other]) == point)
        m->triangles[c] = m->triangles[other];
    else
        fct_splits_fail(k);
}

uint32_t fct_splits_code_point(fct_splits *k, size_t c) {
    fct_progressive *m = k->m;
    uint32_t node = k->names ? m->nodes[m->triangles[c]] : 0, point = k->names ? m->points[node] : 0;
    static const float origin[3] = {0, 0, 0};
    bool made = k->point_count == 0 ||
                fct_code_bit(&k->coder, &k->models.new_point, k->names && k->names[point] == FCT_NONE);
    if (made) {
        const float *guess = k->point_count ? k->points[k->last_point].at : origin;
        return fct_splits_add_point(k, point, 2, guess, k->names ? m->positions + 3 * (size_t)node : NULL);
    }
    uint32_t last = k->point_count - 1;
    uint32_t distance =
        fct_code_number(&k->coder, &k->models.distance, k->names ? last - k->names[point] : 0);
    if (distance > last) fct_splits_fail(k);
    return k->result == FCT_OK ? last - distance : 0;
}
