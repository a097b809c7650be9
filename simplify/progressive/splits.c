/* simplify/progressive/splits.c: see splits.h. A step codes, in this order:
 *
 * 1. Whether it splits a point. Of a split: the point, both positions, and for each corner of the point the
 *    end and the node that it goes to.
 * 2. The number of new faces. Of each face: its corners (in a split, only its apex), its handles, material
 *    and colour.
 * 3. New points and nodes where they appear first: position and attributes.
 * 4. The error.
 * Cost of a step: linear in the corners of the point that splits.
 */
#include "simplify/progressive/splits.h"

#include <math.h>
#include <string.h>

#include "base/key.h"

static void fail_stream(fct_splits *k) {
    if (k->result == FCT_OK) k->result = FCT_ERROR_DATA;
}

static bool stopped(fct_splits *k) {
    if (k->coder.overrun) fail_stream(k);
    return k->result != FCT_OK;
}

#define GROW(k, array, room, count)                                                                          \
    grow_array((k), (void **)&(array), &(room), (size_t)(count), sizeof *(array))
static bool grow_array(fct_splits *k, void **array, size_t *room, size_t count, size_t size) {
    if (k->result == FCT_OK && count > *room) k->result = fct_grow(k->m->env, array, room, count, size);
    return k->result == FCT_OK;
}

/* Counts stay below 2^31, as in meshes. */
static bool check_count(fct_splits *k, size_t count) {
    if (count >= INT32_MAX) fail_stream(k);
    return k->result == FCT_OK;
}

static uint32_t find_name(const fct_splits *k, uint32_t point) {
    return k->names ? k->names[point] : point;
}

static uint32_t find_point(const fct_splits *k, uint32_t handle) {
    return find_name(k, k->m->points[k->m->nodes[handle]]);
}

static void append_corner(fct_splits *k, uint32_t point, uint32_t c) {
    stream_point *p = &k->points[point];
    k->next[c] = FCT_NONE;
    k->previous[c] = p->last;
    if (p->last == FCT_NONE)
        p->first = c;
    else
        k->next[p->last] = c;
    p->last = c;
    ++p->count;
}

static void remove_corner(fct_splits *k, uint32_t point, uint32_t c) {
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

/* Codes a position near guess; `at` is that of the writer and the result. */
static void code_position(fct_splits *k, int context, const float guess[3], float at[3]) {
    for (int i = 0; i < 3; ++i) {
        at[i] = fct_code_float(&k->coder, &k->models.position[context][i], guess[i], at[i]);
        if (!isfinite(at[i])) fail_stream(k);
    }
}

/* Adds a point. point: its number in m, only for a writer. */
static uint32_t add_point(fct_splits *k, uint32_t point, int context, const float guess[3], const float *at) {
    uint32_t name = k->point_count;
    stream_point made = {FCT_NONE, FCT_NONE, 0, {0, 0, 0}};
    float near[3]; /* a copy, because `guess` may be one of `points`, which moves */
    memcpy(near, guess, sizeof near);
    if (!k->names && (!check_count(k, (size_t)name + 1) || !GROW(k, k->points, k->room.list, name + 1)))
        return 0;
    if (at) memcpy(made.at, at, sizeof made.at);
    code_position(k, context, near, made.at);
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
        if (!check_count(k, (size_t)node + 1) || !GROW(k, m->parents, k->room.parents, node + 1) ||
            !GROW(k, m->handles, k->room.handles, node + 1) ||
            !GROW(k, m->points, k->room.points, node + 1) ||
            !GROW(k, m->first_corners, k->room.first_corners, (size_t)node + 2) ||
            !GROW(k, m->positions, k->room.positions, 3 * ((size_t)node + 1)) ||
            !GROW(k, m->values, k->room.values, n * ((size_t)node + 1)))
            return 0;
        ++m->node_count;
        m->parents[node] = parent, m->points[node] = point, m->handles[node] = FCT_NONE;
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
        if (!isfinite(coded)) fail_stream(k);
        if (!k->names) *value = coded;
    }
    return node;
}

/* Gives a node that was read a handle: a new one if handle is FCT_NONE. */
static uint32_t give_handle(fct_splits *k, uint32_t node, uint32_t handle) {
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
        fail_stream(k);
        return 0;
    }
    node = code_node(k, node, parent, second ? k->born : k->split, group);
    if (k->result != FCT_OK) return 0;
    k->members[k->member_count] = (stream_member){group, node, second};
    if (k->names) k->coded[node] = true;
    return k->member_count++;
}

/* Which member of a group, at one end, a corner goes to. node: that of the writer. */
static uint32_t code_member(fct_splits *k, uint32_t group, bool second, uint32_t node) {
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

static void add_group(fct_splits *k, uint32_t group) {
    for (uint32_t i = 0; i < k->group_count; ++i)
        if (k->groups[i] == group) return;
    if (k->group_count == STREAM_LIST)
        fail_stream(k);
    else
        k->groups[k->group_count++] = group;
}

/* Codes the end and the node of each corner of the point that splits. A writer's m is past the split. */
static void code_ring(fct_splits *k) {
    const fct_progressive *m = k->m;
    bool second = false;
    k->ring_count = 0;
    for (uint32_t c = k->points[k->split].first; c != FCT_NONE; c = k->next[c])
        if (GROW(k, k->ring, k->room.ring, k->ring_count + 1)) k->ring[k->ring_count++].corner = c;
    for (uint32_t i = 0; i < k->ring_count && !stopped(k); ++i) {
        uint32_t group = m->triangles[k->ring[i].corner], node = FCT_NONE;
        if (k->names) node = m->nodes[group], group = m->handles[m->parents[node]];
        bool moves = k->names && find_name(k, m->points[node]) == k->born;
        second = fct_code_bit(&k->coder, &k->models.side[second], moves);
        add_group(k, group);
        if (k->result == FCT_OK) k->ring[i].member = code_member(k, group, second, node);
    }
}

/* Moves corners to the handles of their members, for a reader. The handle of a group stays with its first
 * member at the old end, or else with its first one. */
static void apply_ring(fct_splits *k) {
    fct_progressive *m = k->m;
    for (uint32_t g = 0; g < k->group_count; ++g) {
        uint32_t keeper = FCT_NONE;
        for (uint32_t i = 0; i < k->member_count; ++i) {
            const stream_member *x = &k->members[i];
            if (x->group == k->groups[g] && (keeper == FCT_NONE || (k->members[keeper].second && !x->second)))
                keeper = i;
        }
        give_handle(k, k->members[keeper].node, k->groups[g]);
    }
    for (uint32_t i = 0; i < k->member_count && k->result == FCT_OK; ++i) {
        uint32_t node = k->members[i].node, h = m->handles[node];
        if (h == FCT_NONE) h = give_handle(k, node, FCT_NONE);
        m->first_corners[node] = m->corner_count;
        for (uint32_t r = 0; r < k->ring_count && h != k->members[i].group; ++r) {
            if (k->ring[r].member != i || !check_count(k, (size_t)m->corner_count + 1) ||
                !GROW(k, m->corners, k->room.corners, m->corner_count + 1))
                continue;
            m->corners[m->corner_count++] = k->ring[r].corner;
            m->triangles[k->ring[r].corner] = h;
        }
        m->first_corners[node + 1] = m->corner_count;
    }
}

static void add_neighbour(fct_splits *k, uint32_t corner) {
    uint32_t point = find_point(k, k->m->triangles[corner]);
    for (uint32_t i = 0; i < k->neighbour_count; ++i)
        if (k->neighbours[i] == point) return;
    k->neighbour_faces[k->neighbour_count] = corner / 3;
    k->neighbours[k->neighbour_count++] = point;
}

/* Lists the neighbours of the point that splits, unless they are many. */
static void list_neighbours(fct_splits *k) {
    k->neighbour_count = 0;
    for (uint32_t i = 0; i < k->ring_count && k->ring_count <= STREAM_LIST; ++i) {
        uint32_t c = k->ring[i].corner, first = c - c % 3;
        add_neighbour(k, first + (c + 1) % 3);
        add_neighbour(k, first + (c + 2) % 3);
    }
}

/* The point of m that a writer splits in its next step, and the new one; FCT_NONE: it splits none. */
static void find_split(const fct_progressive *m, uint32_t *split, uint32_t *born) {
    *split = *born = FCT_NONE;
    for (uint32_t n = m->step_nodes[m->level]; n < m->step_nodes[m->level + 1]; ++n) {
        uint32_t parent = m->parents[n];
        if (parent != FCT_NONE &&
            (m->handles[parent] == m->handles[n] || m->first_corners[n] < m->first_corners[n + 1]))
            *split = m->points[parent];
    }
    for (uint32_t n = m->step_nodes[m->level]; n < m->step_nodes[m->level + 1]; ++n)
        if (*split != FCT_NONE && m->parents[n] != FCT_NONE && m->points[m->parents[n]] == *split &&
            m->points[n] != *split)
            *born = m->points[n];
}

/* The writer's position of a point in the step that it has just done. */
static const float *find_position(const fct_progressive *m, uint32_t point) {
    for (uint32_t n = m->step_nodes[m->level - 1]; n < m->step_nodes[m->level]; ++n)
        if (m->points[n] == point) return m->positions + 3 * (size_t)n;
    return m->positions;
}

/* Codes the point that splits, its new position and the new point: opposite to it. */
static void code_ends(fct_splits *k, uint32_t split, uint32_t born) {
    fct_progressive *m = k->m;
    k->split = fct_code_uniform(&k->coder, k->point_count, k->names ? k->names[split] : 0);
    stream_point *p = &k->points[k->split];
    float before[3], opposite[3];
    memcpy(before, p->at, sizeof before);
    if (k->names) memcpy(p->at, find_position(m, split), sizeof p->at);
    code_position(k, 0, before, p->at);
    for (int i = 0; i < 3; ++i) opposite[i] = before[i] + before[i] - k->points[k->split].at[i];
    k->born = add_point(k, born, 1, opposite, k->names ? find_position(m, born) : NULL);
}

/* Codes a new handle at a point, for corner c. */
static void code_new_handle(fct_splits *k, size_t c, uint32_t parent, uint32_t point) {
    fct_progressive *m = k->m;
    uint32_t node = code_node(k, k->names ? m->nodes[m->triangles[c]] : 0, parent, point, FCT_NONE);
    if (k->result != FCT_OK) return;
    if (k->names)
        k->coded[node] = true;
    else
        m->triangles[c] = give_handle(k, node, FCT_NONE);
}

/* Codes the handle of corner c of a new face, at one end of the split. */
static void code_end_corner(fct_splits *k, size_t c, bool second) {
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
        fail_stream(k);
        return;
    }
    uint32_t parent = k->names ? m->parents[wanted] : FCT_NONE;
    for (uint32_t i = 0; i < k->group_count && k->names; ++i)
        if (k->groups[i] == m->handles[parent]) group = i;
    group = fct_code_uniform(&k->coder, k->group_count, group);
    if (!k->names) parent = k->group_parents[group];
    uint32_t member = add_member(k, wanted, parent, FCT_NONE, second);
    if (k->result == FCT_OK && !k->names) m->triangles[c] = give_handle(k, k->members[member].node, FCT_NONE);
}

/* Codes the handle of corner c of a new face at a point that other faces may use. */
static void code_point_corner(fct_splits *k, size_t c, uint32_t point) {
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
    uint32_t other = k->names ? p->first : 0;
    while (k->names && m->triangles[other] != wanted) other = k->next[other];
    if (p->count > STREAM_LIST)
        other = fct_code_uniform(&k->coder, 3 * (uint32_t)(c / 3), other);
    else {
        uint32_t place = 0, x = p->first;
        while (k->names && x != other) x = k->next[x], ++place;
        place = fct_code_uniform(&k->coder, p->count, place);
        for (other = p->first; place > 0; --place) other = k->next[other];
    }
    if (k->names) return;
    if (find_point(k, m->triangles[other]) == point)
        m->triangles[c] = m->triangles[other];
    else
        fail_stream(k);
}

/* Codes a point of corner c: a new one, or one that is near in the order of appearance. */
static uint32_t code_point(fct_splits *k, size_t c) {
    fct_progressive *m = k->m;
    uint32_t node = k->names ? m->nodes[m->triangles[c]] : 0, point = k->names ? m->points[node] : 0;
    static const float origin[3] = {0, 0, 0};
    bool made = k->point_count == 0 ||
                fct_code_bit(&k->coder, &k->models.new_point, k->names && k->names[point] == FCT_NONE);
    if (made) {
        const float *guess = k->point_count ? k->points[k->last_point].at : origin;
        return add_point(k, point, 2, guess, k->names ? m->positions + 3 * (size_t)node : NULL);
    }
    uint32_t last = k->point_count - 1;
    uint32_t distance =
        fct_code_number(&k->coder, &k->models.distance, k->names ? last - k->names[point] : 0);
    if (distance > last) fail_stream(k);
    return k->result == FCT_OK ? last - distance : 0;
}

/* Codes the apex of a new face between both ends of the split: corner c. *guess: a face beside it. */
static uint32_t code_apex(fct_splits *k, size_t c, uint32_t *guess) {
    uint32_t place = k->neighbour_count, wanted = k->names ? find_point(k, k->m->triangles[c]) : 0;
    if (k->ring_count) *guess = k->ring[0].corner / 3;
    for (uint32_t i = 0; i < k->neighbour_count && k->names; ++i)
        if (k->neighbours[i] == wanted) place = i;
    bool listed = place < k->neighbour_count;
    if (!k->neighbour_count || !fct_code_bit(&k->coder, &k->models.neighbour, listed))
        return code_point(k, c);
    place = fct_code_uniform(&k->coder, k->neighbour_count, place);
    *guess = k->neighbour_faces[place];
    return k->neighbours[place];
}

/* Codes material and colour of a face, probably those of the face `guess`. */
static void code_look(fct_splits *k, uint32_t f, uint32_t guess) {
    fct_progressive *m = k->m;
    if (m->materials) {
        uint32_t *own = &m->materials[f], other = f ? m->materials[guess] : 0;
        if (fct_code_bit(&k->coder, &k->models.material, k->names && *own != other))
            *own = fct_code_uniform(&k->coder, m->material_count, k->names ? *own : 0);
        else
            *own = other;
        if (*own >= m->material_count) fail_stream(k);
    }
    if (!m->face_colors) return;
    static const float black[3] = {0, 0, 0};
    float *own = m->face_colors + 3 * (size_t)f;
    const float *other = f ? m->face_colors + 3 * (size_t)guess : black;
    bool differs =
        fct_code_bit(&k->coder, &k->models.face_color, k->names && memcmp(own, other, sizeof black));
    for (int i = 0; i < 3; ++i) {
        own[i] =
            differs ? fct_code_float(&k->coder, &k->models.color, other[i], k->names ? own[i] : 0) : other[i];
        if (!isfinite(own[i])) fail_stream(k);
    }
}

static bool add_face(fct_splits *k) {
    fct_progressive *m = k->m;
    size_t faces = (size_t)m->face_count + 1;
    if (k->names) return true;
    if (faces > UINT32_MAX / 3) fail_stream(k);
    if (!check_count(k, faces) || !GROW(k, m->triangles, k->room.triangles, 3 * faces) ||
        !GROW(k, k->next, k->room.next, 3 * faces) || !GROW(k, k->previous, k->room.previous, 3 * faces))
        return false;
    if (m->materials && !GROW(k, m->materials, k->room.materials, faces)) return false;
    if (m->face_colors && !GROW(k, m->face_colors, k->room.face_colors, 3 * faces)) return false;
    ++m->face_count;
    return true;
}

/* The writer's corners of a new face: those at the old end, the new end and the apex. */
static void find_ends(const fct_splits *k, uint32_t f, uint32_t *first, bool *turned) {
    const uint32_t *t = k->m->triangles + 3 * (size_t)f;
    for (uint32_t i = 0; i < 3; ++i)
        if (find_point(k, t[i]) == k->split) *first = i;
    *turned = find_point(k, t[(*first + 1) % 3]) != k->born;
}

static void code_face(fct_splits *k, uint32_t f) {
    uint32_t guess = f ? f - 1 : 0, points[3] = {0};
    if (!add_face(k)) return;
    size_t c = 3 * (size_t)f;
    if (k->split != FCT_NONE) {
        uint32_t first = 0;
        bool turned = false;
        if (k->names) find_ends(k, f, &first, &turned);
        first = fct_code_uniform(&k->coder, 3, first);
        turned = fct_code_bit(&k->coder, &k->models.turned, turned);
        uint32_t second = (first + (turned ? 2 : 1)) % 3, apex = 3 - first - second;
        points[first] = k->split, points[second] = k->born;
        code_end_corner(k, c + first, false);
        if (k->result == FCT_OK) code_end_corner(k, c + second, true);
        if (k->result == FCT_OK) points[apex] = code_apex(k, c + apex, &guess);
        if (k->result == FCT_OK) code_point_corner(k, c + apex, points[apex]);
    } else
        for (uint32_t i = 0; i < 3 && !stopped(k); ++i) {
            points[i] = code_point(k, c + i);
            if (k->result == FCT_OK) code_point_corner(k, c + i, points[i]);
        }
    if (points[0] == points[1] || points[1] == points[2] || points[2] == points[0]) fail_stream(k);
    if (!stopped(k)) code_look(k, f, guess);
    for (uint32_t i = 0; i < 3 && k->result == FCT_OK; ++i) append_corner(k, points[i], (uint32_t)c + i);
    k->last_point = points[2];
}

/* Codes the point that splits, and moves its corners. A writer's m goes past the step. */
static void code_split(fct_splits *k, uint32_t step) {
    fct_progressive *m = k->m;
    uint32_t split = FCT_NONE, born = FCT_NONE;
    k->split = k->born = FCT_NONE;
    k->ring_count = k->member_count = k->group_count = k->neighbour_count = 0;
    if (k->names && step > 0) {
        find_split(m, &split, &born);
        fct_progressive_forward(m);
    }
    if (k->point_count == 0 || !fct_code_bit(&k->coder, &k->models.split, split != FCT_NONE)) return;
    code_ends(k, split, born);
    if (k->result == FCT_OK) code_ring(k);
    if (stopped(k)) return;
    for (uint32_t g = 0; g < k->group_count && !k->names; ++g) k->group_parents[g] = m->nodes[k->groups[g]];
    list_neighbours(k);
    if (!k->names) apply_ring(k);
    for (uint32_t i = 0; i < k->ring_count && k->result == FCT_OK; ++i)
        if (k->members[k->ring[i].member].second) {
            remove_corner(k, k->split, k->ring[i].corner);
            append_corner(k, k->born, k->ring[i].corner);
        }
}

/* Codes the error of the level: at most that of the level before. */
static void code_error(fct_splits *k, uint32_t step) {
    fct_progressive *m = k->m;
    float before = step > 0 ? m->errors[step - 1] : INFINITY;
    uint32_t drop = fct_float_bits(before) - (k->names ? fct_float_bits(m->errors[step]) : 0);
    drop = fct_code_number(&k->coder, &k->models.error, drop);
    if (drop > fct_float_bits(before)) fail_stream(k);
    if (!k->names) m->errors[step] = fct_float_of_bits(fct_float_bits(before) - drop);
    if (!isfinite(m->errors[step])) fail_stream(k);
}

/* Whether a step without faces is one: both ends have corners. */
static bool is_pair_split(const fct_splits *k) {
    return k->has_pairs && k->split != FCT_NONE && k->points[k->split].count > 0 &&
           k->points[k->born].count > 0;
}

fct_result fct_splits_step(fct_splits *k) {
    fct_progressive *m = k->m;
    uint32_t step = k->step, count = k->names ? m->step_faces[step + 1] - m->step_faces[step] : 0;
    if (!k->names && (!GROW(k, m->step_nodes, k->room.step_nodes, (size_t)step + 2) ||
                      !GROW(k, m->step_faces, k->room.step_faces, (size_t)step + 2) ||
                      !GROW(k, m->errors, k->room.errors, (size_t)step + 1)))
        return k->result;
    code_split(k, step);
    uint32_t first = k->names ? m->step_faces[step] : m->face_count;
    if (!k->names) m->step_nodes[0] = m->step_faces[0] = 0;
    if (k->result == FCT_OK) count = fct_code_number(&k->coder, &k->models.faces, count);
    if (step > 0 && count == 0 && !is_pair_split(k)) fail_stream(k);
    for (uint32_t i = 0; i < count && !stopped(k); ++i) code_face(k, first + i);
    if (!stopped(k)) code_error(k, step);
    if (stopped(k)) return k->result;
    ++k->step;
    if (k->names) return FCT_OK;
    m->step_count = m->level = step + 1;
    m->step_nodes[step + 1] = m->node_count, m->step_faces[step + 1] = m->face_count;
    m->first_corners[m->node_count] = m->corner_count;
    return FCT_OK;
}

static fct_result start_splits(fct_progressive *m, fct_splits **out) {
    fct_splits *k = *out = fct_allocate_zero(m->env, 1, sizeof *k);
    if (!k) return fct_fail_memory(m->env, "a progressive mesh");
    k->m = m;
    k->coder.env = m->env;
    fct_models_begin((fct_model *)&k->models, sizeof k->models / sizeof(fct_model));
    return FCT_OK;
}

bool fct_splits_have_pairs(const fct_progressive *m) {
    for (uint32_t step = 1; step < m->step_count; ++step)
        if (m->step_faces[step] == m->step_faces[step + 1]) return true;
    return false;
}

fct_result fct_splits_write(fct_progressive *m, fct_splits **out) {
    fct_result result = start_splits(m, out);
    if (result != FCT_OK) return result;
    fct_splits *k = *out;
    size_t corners = 3 * (size_t)m->face_count;
    k->has_pairs = fct_splits_have_pairs(m);
    const fct_array arrays[] = {FCT_ARRAY(k->points, m->point_count), FCT_ARRAY(k->names, m->point_count),
                                FCT_ARRAY(k->next, corners), FCT_ARRAY(k->previous, corners),
                                FCT_ARRAY_ZERO(k->coded, m->node_count)};
    result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a progressive mesh");
    if (result == FCT_OK) {
        memset(k->names, 0xff, m->point_count * sizeof *k->names);
        return FCT_OK;
    }
    fct_splits_close(k);
    *out = NULL;
    return result;
}

fct_result fct_splits_read(fct_progressive *m, bool has_materials, bool has_face_colors, bool has_pairs,
                           fct_splits **out) {
    fct_result result = start_splits(m, out);
    if (result != FCT_OK) return result;
    fct_splits *k = *out;
    k->has_pairs = has_pairs;
    /* Also a mesh without faces has its arrays. */
    GROW(k, m->first_corners, k->room.first_corners, 1);
    if (has_materials) GROW(k, m->materials, k->room.materials, 1);
    if (has_face_colors) GROW(k, m->face_colors, k->room.face_colors, 1);
    result = k->result;
    if (result == FCT_OK) return FCT_OK;
    fct_splits_close(k);
    *out = NULL;
    return result;
}

void fct_splits_close(fct_splits *k) {
    if (!k) return;
    fct_coder_release(&k->coder);
    void *arrays[] = {k->points, k->names, k->next, k->previous, k->ring, k->coded};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(k->m->env, arrays[i]);
    fct_release(k->m->env, k);
}
