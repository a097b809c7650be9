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

#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/key.h"

static void add_group(fct_splits *k, uint32_t group) {
    for (uint32_t i = 0; i < k->group_count; ++i)
        if (k->groups[i] == group) return;
    if (k->group_count == STREAM_LIST)
        fct_splits_fail(k);
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
    for (uint32_t i = 0; i < k->ring_count && !fct_splits_stopped(k); ++i) {
        uint32_t group = m->triangles[k->ring[i].corner], node = FCT_NONE;
        if (k->names) node = m->nodes[group], group = m->handles[m->parents[node]];
        bool moves = k->names && splits_name(k, m->points[node]) == k->born;
        second = fct_code_bit(&k->coder, &k->models.side[second], moves);
        add_group(k, group);
        if (k->result == FCT_OK) k->ring[i].member = fct_splits_code_member(k, group, second, node);
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
        fct_splits_give_handle(k, k->members[keeper].node, k->groups[g]);
    }
    for (uint32_t i = 0; i < k->member_count && k->result == FCT_OK; ++i) {
        uint32_t node = k->members[i].node, h = m->handles[node];
        if (h == FCT_NONE) h = fct_splits_give_handle(k, node, FCT_NONE);
        m->first_corners[node] = m->corner_count;
        for (uint32_t r = 0; r < k->ring_count && h != k->members[i].group; ++r) {
            if (k->ring[r].member != i || !fct_splits_check_count(k, (size_t)m->corner_count + 1) ||
                !GROW(k, m->corners, k->room.corners, m->corner_count + 1))
                continue;
            m->corners[m->corner_count++] = k->ring[r].corner;
            m->triangles[k->ring[r].corner] = h;
        }
        m->first_corners[node + 1] = m->corner_count;
    }
}

static void add_neighbour(fct_splits *k, uint32_t corner) {
    uint32_t point = splits_point(k, k->m->triangles[corner]);
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

/* The writer's position of a point in the step that it has just done, which has a node there. */
static const float *find_position(const fct_progressive *m, uint32_t point) {
    uint32_t n = m->step_nodes[m->level - 1], end = m->step_nodes[m->level];
    while (n < end && m->points[n] != point) ++n;
    assert(n < end);
    return m->positions + 3 * (size_t)n;
}

/* Codes the point that splits, its new position and the new point: opposite to it. */
static void code_ends(fct_splits *k, uint32_t split, uint32_t born) {
    fct_progressive *m = k->m;
    k->split = fct_code_uniform(&k->coder, k->point_count, k->names ? k->names[split] : 0);
    stream_point *p = &k->points[k->split];
    float before[3], opposite[3];
    memcpy(before, p->at, sizeof before);
    if (k->names) memcpy(p->at, find_position(m, split), sizeof p->at);
    fct_splits_code_position(k, 0, before, p->at);
    for (int i = 0; i < 3; ++i) opposite[i] = before[i] + before[i] - k->points[k->split].at[i];
    k->born = fct_splits_add_point(k, born, 1, opposite, k->names ? find_position(m, born) : NULL);
}

/* Codes the apex of a new face between both ends of the split: corner c. *guess: a face beside it. */
static uint32_t code_apex(fct_splits *k, size_t c, uint32_t *guess) {
    uint32_t place = k->neighbour_count, wanted = k->names ? splits_point(k, k->m->triangles[c]) : 0;
    if (k->ring_count) *guess = k->ring[0].corner / 3;
    for (uint32_t i = 0; i < k->neighbour_count && k->names; ++i)
        if (k->neighbours[i] == wanted) place = i;
    bool listed = place < k->neighbour_count;
    if (!k->neighbour_count || !fct_code_bit(&k->coder, &k->models.neighbour, listed))
        return fct_splits_code_point(k, c);
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
        if (*own >= m->material_count) fct_splits_fail(k);
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
        if (!isfinite(own[i])) fct_splits_fail(k);
    }
}

static bool add_face(fct_splits *k) {
    fct_progressive *m = k->m;
    size_t faces = (size_t)m->face_count + 1;
    if (k->names) return true;
    if (faces > UINT32_MAX / 3) fct_splits_fail(k);
    if (!fct_splits_check_count(k, faces) || !GROW(k, m->triangles, k->room.triangles, 3 * faces) ||
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
        if (splits_point(k, t[i]) == k->split) *first = i;
    *turned = splits_point(k, t[(*first + 1) % 3]) != k->born;
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
        fct_splits_code_end_corner(k, c + first, false);
        if (k->result == FCT_OK) fct_splits_code_end_corner(k, c + second, true);
        if (k->result == FCT_OK) points[apex] = code_apex(k, c + apex, &guess);
        if (k->result == FCT_OK) fct_splits_code_point_corner(k, c + apex, points[apex]);
    } else
        for (uint32_t i = 0; i < 3 && !fct_splits_stopped(k); ++i) {
            points[i] = fct_splits_code_point(k, c + i);
            if (k->result == FCT_OK) fct_splits_code_point_corner(k, c + i, points[i]);
        }
    if (points[0] == points[1] || points[1] == points[2] || points[2] == points[0]) fct_splits_fail(k);
    if (!fct_splits_stopped(k)) code_look(k, f, guess);
    for (uint32_t i = 0; i < 3 && k->result == FCT_OK; ++i)
        fct_splits_append_corner(k, points[i], (uint32_t)c + i);
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
    if (fct_splits_stopped(k)) return;
    for (uint32_t g = 0; g < k->group_count && !k->names; ++g) k->group_parents[g] = m->nodes[k->groups[g]];
    list_neighbours(k);
    if (!k->names) apply_ring(k);
    for (uint32_t i = 0; i < k->ring_count && k->result == FCT_OK; ++i)
        if (k->members[k->ring[i].member].second) {
            fct_splits_remove_corner(k, k->split, k->ring[i].corner);
            fct_splits_append_corner(k, k->born, k->ring[i].corner);
        }
}

/* Codes the error of the level: at most that of the level before. */
static void code_error(fct_splits *k, uint32_t step) {
    fct_progressive *m = k->m;
    float before = step > 0 ? m->errors[step - 1] : INFINITY;
    uint32_t drop = fct_float_bits(before) - (k->names ? fct_float_bits(m->errors[step]) : 0);
    drop = fct_code_number(&k->coder, &k->models.error, drop);
    if (drop > fct_float_bits(before)) fct_splits_fail(k);
    if (!k->names) m->errors[step] = fct_float_of_bits(fct_float_bits(before) - drop);
    if (!isfinite(m->errors[step])) fct_splits_fail(k);
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
                      !GROW(k, m->walls, k->room.walls, (size_t)step + 1) ||
                      !GROW(k, m->errors, k->room.errors, (size_t)step + 1)))
        return k->result;
    if (!k->names) m->step_nodes[0] = m->step_faces[0] = 0;
    uint32_t points = k->point_count;
    code_split(k, step);
    uint32_t first = k->names ? m->step_faces[step] : m->face_count;
    if (k->result == FCT_OK) count = fct_code_number(&k->coder, &k->models.faces, count);
    if (step > 0 && count == 0 && !is_pair_split(k)) fct_splits_fail(k);
    for (uint32_t i = 0; i < count && !fct_splits_stopped(k); ++i) code_face(k, first + i);
    if (!fct_splits_stopped(k)) code_error(k, step);
    if (fct_splits_stopped(k)) return k->result;
    ++k->step;
    if (k->names) return FCT_OK;
    m->walls[step] = step > 0 && k->split == FCT_NONE && k->point_count == points;
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
    const fct_array arrays[] = {FCT_ARRAY(k->points, m->point_count),
                                FCT_ARRAY(k->names, m->point_count),
                                FCT_ARRAY(k->next, corners),
                                FCT_ARRAY(k->previous, corners),
                                FCT_ARRAY_ZERO(k->coded, m->node_count),
                                FCT_ARRAY(k->recent, m->handle_count)};
    result = fct_allocate_all(m->env, arrays, FCT_LENGTH(arrays), "a progressive mesh");
    if (result == FCT_OK) {
        memset(k->names, 0xff, m->point_count * sizeof *k->names);
        memset(k->recent, 0xff, m->handle_count * sizeof *k->recent);
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
    void *arrays[] = {k->points, k->names, k->next, k->previous, k->ring, k->coded, k->recent};
    for (size_t i = 0; i < FCT_LENGTH(arrays); ++i) fct_release(k->m->env, arrays[i]);
    fct_release(k->m->env, k);
}
