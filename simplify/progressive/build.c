/* simplify/progressive/build.c: see build.h.
 *
 * 1. Sort the records by their keys, so that levels in the middle of a sweep are even.
 * 2. Repeat the contractions on the faces of the input (repeat.c). Each one ends nodes and faces. They are
 *    listed, with the corners that move away from the ended nodes.
 * 3. What remains is the base mesh. Write it, then the lists in reverse order: those of the last contraction
 *    first.
 * Cost: linear, plus the rings of vanished points.
 */
#include "simplify/progressive/build.h"

#include "mesh/mesh.h"
#include "simplify/progressive/repeat.h"

static void sort_records(fct_builder *b) {
    uint32_t *starts = b->order + b->log->count; /* QUEUE_BUCKETS + 1 */
    memset(starts, 0, (QUEUE_BUCKETS + 1) * sizeof *starts);
    for (uint32_t i = 0; i < b->log->count; ++i) ++starts[b->log->records[i].key + 1];
    for (uint32_t k = 0; k < QUEUE_BUCKETS; ++k) starts[k + 1] += starts[k];
    for (uint32_t i = 0; i < b->log->count; ++i) b->order[starts[b->log->records[i].key]++] = i;
}

/* Numbers points in the order of their nodes. */
static void number_points(fct_builder *b) {
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

static void write_node(fct_builder *b, uint32_t node, const fct_ended_node *ended,
                       const uint32_t *face_places, const uint32_t *numbers) {
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

static void write_face(fct_builder *b, uint32_t f, uint32_t to) {
    const fct_mesh *mesh = b->s->mesh;
    fct_progressive *m = b->m;
    memcpy(m->triangles + 3 * (size_t)to, b->handles + 3 * (size_t)f, 3 * sizeof *m->triangles);
    if (m->materials) m->materials[to] = mesh->materials[f];
    if (m->face_colors)
        memcpy(m->face_colors + 3 * (size_t)to, mesh->face_colors + 3 * (size_t)f,
               3 * sizeof *m->face_colors);
}

/* Writes the base mesh: the nodes and faces that are left. */
static void write_base(fct_builder *b, uint32_t *face_places, uint32_t *numbers) {
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
static void write_step(fct_builder *b, uint32_t i, uint32_t *face_places, uint32_t *numbers) {
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
    m->walls[step] = b->steps[i].wall;
    m->errors[step] = i ? b->steps[i - 1].error : 0;
    m->step_nodes[step + 1] = m->node_count, m->step_faces[step + 1] = m->face_count;
}

static fct_result allocate_progressive(fct_builder *b) {
    const fct_mesh *mesh = b->s->mesh;
    fct_progressive *m = b->m;
    size_t nodes = b->node_count, faces = b->s->face_count, steps = (size_t)b->step_count + 1;
    m->handle_count = b->handle_count;
    const fct_array arrays[] = {FCT_ARRAY(m->step_nodes, steps + 1),
                                FCT_ARRAY(m->step_faces, steps + 1),
                                FCT_ARRAY_ZERO(m->walls, steps),
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

static fct_result write_progressive(fct_builder *b) {
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

static fct_result run_builder(fct_builder *b) {
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
                                FCT_ARRAY(b->locked, points),
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
    fct_builder_start(b);
    for (uint32_t i = 0; i < records && result == FCT_OK; ++i) {
        const fct_record *r = &b->log->records[b->order[i]];
        result = r->wall ? fct_builder_repeat_wall(b, r, b->log->records[b->order[i - 1]].wall)
                         : fct_builder_repeat(b, r);
    }
    if (result == FCT_OK) result = write_progressive(b);
    fct_release(s->env, b->moved);
    fct_release_all(s->env, arrays, FCT_LENGTH(arrays));
    return result;
}

fct_result fct_progressive_build(const fct_simplifier *s, fct_progressive **out) {
    *out = NULL;
    fct_builder *b = fct_allocate_zero(s->env, 1, sizeof *b);
    fct_progressive *m = fct_allocate_zero(s->env, 1, sizeof *m);
    fct_result result = b && m ? FCT_OK : fct_fail_memory(s->env, "a progressive mesh");
    if (m) m->env = s->env;
    if (result == FCT_OK) {
        m->color = m->normal = m->texcoord = FCT_NONE;
        if (s->mesh->colors) m->color = m->value_count, m->value_count += 3;
        if (s->mesh->normals) m->normal = m->value_count, m->value_count += 3;
        if (s->mesh->texcoords) m->texcoord = m->value_count, m->value_count += 2;
        if (stream_kinds(s->mesh) & ~(unsigned)(FCT_MESH_COLORS | FCT_MESH_NORMALS))
            fct_note(s->env, FCT_MESSAGE_WARNING,
                     "the progressive mesh keeps the light of the vertex colours alone: irradiance, direct, "
                     "indirect and error are left out");
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
