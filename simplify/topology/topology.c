/* simplify/topology/topology.c: see topology.h.
 *
 * 1. Points: vertices with equal coordinates share a place; weld.c decides which of them share a point.
 * 2. Rings: the faces in terms of points. Faces with two corners at one point are removed. Faces without area
 *    but with three distinct points stay, because they connect their neighbours.
 * 3. Wedges: the distinct (point, attributes).
 * 4. Edges, with flags for boundaries and borders.
 * Cost: linear in the corners (expected, because of hash tables). Numbers follow the order of the input.
 */
#include "simplify/topology/topology.h"

#include <float.h>

#include "base/key.h"
#include "simplify/topology/weld.h"

/* A corner moves by at most .87 of the step between floats at the largest coordinate when it becomes a float,
 * so a face with four times this height keeps more than half of it. */
#define LEAST_HEIGHT 4

enum { KEY_WORDS = 1 + STREAM_FLOATS };

/* Writes the words that distinguish item i from others. -0 counts as 0, because -0 + 0 is 0. */
typedef void key_of(const fct_simplifier *s, const uint32_t *base, uint32_t i, uint32_t key[KEY_WORDS]);

static void write_position_key(const fct_simplifier *s, const uint32_t *base, uint32_t v,
                               uint32_t key[KEY_WORDS]) {
    (void)base;
    for (int k = 0; k < 3; ++k) key[k] = fct_float_bits(s->mesh->positions[3 * (size_t)v + k] + 0.0f);
}

static void write_vertex_key(const fct_simplifier *s, const uint32_t *base, uint32_t v,
                             uint32_t key[KEY_WORDS]) {
    key[0] = base[v];
    for (uint32_t i = 0, word = 1; i < STREAM_COUNT; ++i) {
        const float *values = stream_values(s->mesh, i);
        uint32_t width = stream_width(i);
        for (uint32_t k = 0; k < width && values; ++k)
            key[word++] = fct_float_bits(values[width * (size_t)v + k] + 0.0f);
    }
}

static void write_corner_key(const fct_simplifier *s, const uint32_t *base, uint32_t c,
                             uint32_t key[KEY_WORDS]) {
    key[0] = base[s->mesh->triangles[c]];
    for (int k = 0; k < 2; ++k) key[1 + k] = fct_float_bits(s->mesh->texcoords[2 * (size_t)c + k] + 0.0f);
}

static uint64_t hash_key(const uint32_t *key, uint32_t words) {
    uint64_t h = 0x9e3779b97f4a7c15u;
    for (uint32_t k = 0; k < words; ++k) {
        h = (h ^ key[k]) * 0xbf58476d1ce4e5b9u;
        h ^= h >> 29;
    }
    return h ^ h >> 32;
}

/* Numbers the items [0, count) by distinct key of `words` words, in the order of first appearance: ids[i]
 * receives the number. Items with ids[i] == FCT_NONE on entry are skipped. */
static fct_result number_keys(const fct_simplifier *s, key_of *key, uint32_t words, const uint32_t *base,
                              uint32_t count, uint32_t *ids, uint32_t *distinct) {
    size_t size = 64;
    while (size < 2 * (size_t)count) size *= 2;
    uint32_t *table = fct_allocate(s->env, size, sizeof *table); /* per slot: the first item with its key */
    if (!table) return fct_fail_memory(s->env, "a table of vertices");
    memset(table, 0xff, size * sizeof *table);
    *distinct = 0;
    uint32_t mine[KEY_WORDS] = {0}, other[KEY_WORDS] = {0};
    for (uint32_t i = 0; i < count; ++i) {
        if (ids[i] == FCT_NONE) continue;
        key(s, base, i, mine);
        size_t slot = hash_key(mine, words) & (size - 1);
        for (; table[slot] != FCT_NONE; slot = (slot + 1) & (size - 1)) {
            key(s, base, table[slot], other);
            if (!memcmp(mine, other, words * sizeof *mine)) break;
        }
        if (table[slot] == FCT_NONE) {
            table[slot] = i;
            ids[i] = (*distinct)++;
        } else
            ids[i] = ids[table[slot]];
    }
    fct_release(s->env, table);
    return FCT_OK;
}

/* The longest side of the bounds becomes 1 and their centre the origin. */
static void find_frame(fct_simplifier *s) {
    v3 lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t v = 0; v < s->mesh->vertex_count; ++v) {
        if (s->point_of[v] == FCT_NONE) continue;
        v3 p = v3_load(s->mesh->positions + 3 * (size_t)v);
        lower = (v3){fct_min(lower.x, p.x), fct_min(lower.y, p.y), fct_min(lower.z, p.z)};
        upper = (v3){fct_max(upper.x, p.x), fct_max(upper.y, p.y), fct_max(upper.z, p.z)};
    }
    bool empty = s->point_count == 0;
    v3 size = v3_sub(upper, lower);
    s->center = empty ? (v3){0, 0, 0} : v3_scale(v3_add(lower, upper), .5);
    s->extent = empty ? 1 : fct_max(size.x, fct_max(size.y, size.z));
    if (!(s->extent > 0)) s->extent = 1;
    double reach = fct_max(fabs(s->center.x), fct_max(fabs(s->center.y), fabs(s->center.z))) + .5 * s->extent;
    double step = fct_max(FLT_EPSILON * reach, FLT_TRUE_MIN);
    s->step = step;
    s->least_height = LEAST_HEIGHT * step / s->extent;
}

static fct_result make_points(fct_simplifier *s) {
    const fct_mesh *mesh = s->mesh;
    s->point_of = fct_allocate(s->env, mesh->vertex_count, sizeof *s->point_of);
    if (!s->point_of) return fct_fail_memory(s->env, "the points of a mesh");
    memset(s->point_of, 0xff, mesh->vertex_count * sizeof *s->point_of);
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) s->point_of[mesh->triangles[c]] = 0;
    fct_result result =
        number_keys(s, write_position_key, 3, NULL, mesh->vertex_count, s->point_of, &s->point_count);
    if (result == FCT_OK) result = fct_simplify_weld(s);
    if (result != FCT_OK) return result;

    uint32_t count = s->point_count;
    const fct_array arrays[] = {FCT_ARRAY_ZERO(s->points, count), FCT_ARRAY(s->point_parents, count)};
    result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the points of a mesh");
    if (result != FCT_OK) return result;
    find_frame(s);
    /* From the last vertex to the first, so that the lowest vertex of a point becomes its source. */
    for (uint32_t v = mesh->vertex_count; v-- > 0;) {
        uint32_t p = s->point_of[v];
        if (p == FCT_NONE) continue;
        v3 at = v3_scale(v3_sub(v3_load(mesh->positions + 3 * (size_t)v), s->center), 1 / s->extent);
        point_at(s, p)->at = at;
        point_at(s, p)->source = v;
    }
    for (uint32_t p = 0; p < count; ++p) s->point_parents[p] = p, point_at(s, p)->first_corner = FCT_NONE;
    return FCT_OK;
}

/* Writes the faces in terms of points, and the list of corners at each point. Faces with two corners at one
 * point are removed for good. */
static fct_result make_rings(fct_simplifier *s) {
    size_t corners = 3 * (size_t)s->mesh->face_count;
    const fct_array arrays[] = {FCT_ARRAY(s->triangles, corners), FCT_ARRAY(s->next_corners, corners),
                                FCT_ARRAY(s->side_edges, corners)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the corners of a mesh");
    if (result != FCT_OK) return result;
    for (uint32_t f = 0; f < s->mesh->face_count; ++f) {
        const uint32_t *in = s->mesh->triangles + 3 * (size_t)f;
        uint32_t *out = s->triangles + 3 * (size_t)f;
        for (int k = 0; k < 3; ++k) out[k] = s->point_of[in[k]];
        if (out[0] == out[1] || out[1] == out[2] || out[2] == out[0]) {
            out[0] = FCT_NONE;
            continue;
        }
        ++s->live_faces;
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t p = out[k], c = 3 * f + k;
            if (point_at(s, p)->first_corner == FCT_NONE)
                point_at(s, p)->first_corner = c;
            else
                s->next_corners[point_at(s, p)->last_corner] = c;
            point_at(s, p)->last_corner = c;
            s->next_corners[c] = FCT_NONE;
            ++point_at(s, p)->valence;
        }
    }
    s->face_count = s->live_faces;
    return FCT_OK;
}

/* Classes are distinct (point, colour, normal, light), wedges are distinct (class, texture coordinates). */
static fct_result make_wedges(fct_simplifier *s) {
    const fct_mesh *mesh = s->mesh;
    s->wedge_count = s->point_count;
    if (!s->channel_count) return FCT_OK;
    size_t corners = 3 * (size_t)mesh->face_count;
    s->corner_wedges = fct_allocate_zero(s->env, corners, sizeof *s->corner_wedges);
    uint32_t *class_of = fct_allocate(s->env, mesh->vertex_count, sizeof *class_of);
    uint32_t *first_of = NULL, class_count = s->point_count; /* per class: its first wedge */
    fct_result result = s->corner_wedges && class_of ? FCT_OK : fct_fail_memory(s->env, "wedges");
    if (result != FCT_OK) goto done;
    memcpy(class_of, s->point_of, mesh->vertex_count * sizeof *class_of);
    uint32_t words = 1;
    for (uint32_t i = 0; i < STREAM_COUNT; ++i) words += stream_values(mesh, i) ? stream_width(i) : 0;
    if (words > 1)
        result =
            number_keys(s, write_vertex_key, words, s->point_of, mesh->vertex_count, class_of, &class_count);
    if (result != FCT_OK) goto done;
    s->wedge_count = class_count;
    if (mesh->texcoords)
        result = number_keys(s, write_corner_key, 3, class_of, (uint32_t)corners, s->corner_wedges,
                             &s->wedge_count);
    else
        for (size_t c = 0; c < corners; ++c) s->corner_wedges[c] = class_of[mesh->triangles[c]];
    if (result != FCT_OK) goto done;

    const fct_array arrays[] = {
        FCT_ARRAY(s->first_wedges, s->point_count), FCT_ARRAY(s->wedge_parents, s->wedge_count),
        FCT_ARRAY(s->next_wedges, s->wedge_count), FCT_ARRAY_ZERO(s->wedge_uses, s->wedge_count),
        FCT_ARRAY_ZERO(s->wedge_classes, s->wedge_count)};
    result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "wedges");
    if (result != FCT_OK) goto done;
    first_of = fct_allocate(s->env, class_count, sizeof *first_of);
    result = first_of ? FCT_OK : fct_fail_memory(s->env, "wedges");
    if (result != FCT_OK) goto done;
    memset(s->first_wedges, 0xff, s->point_count * sizeof *s->first_wedges);
    for (uint32_t w = 0; w < s->wedge_count; ++w) s->wedge_parents[w] = w;
    memset(first_of, 0xff, class_count * sizeof *first_of);
    for (uint32_t c = 0; c < corners; ++c) {
        if (corner_dead(s, c)) continue;
        uint32_t w = s->corner_wedges[c], p = s->triangles[c];
        if (s->wedge_uses[w]++) continue;
        uint32_t class = class_of[mesh->triangles[c]];
        if (first_of[class] == FCT_NONE) first_of[class] = w;
        s->wedge_classes[w] = first_of[class];
        s->next_wedges[w] = s->first_wedges[p];
        s->first_wedges[p] = w;
    }
done:
    fct_release(s->env, first_of);
    fct_release(s->env, class_of);
    return result;
}

/* Whether the side between two faces is a border: other material, or face colours that differ by more than
 * the threshold in |dr| + |dg| + |db|. */
static bool faces_differ(const fct_simplifier *s, uint32_t f, uint32_t g) {
    const fct_mesh *mesh = s->mesh;
    if (mesh->materials && mesh->materials[f] != mesh->materials[g]) return true;
    if (!mesh->face_colors) return false;
    double sum = 0;
    for (int k = 0; k < 3; ++k)
        sum += fabs((double)mesh->face_colors[3 * (size_t)f + k] - mesh->face_colors[3 * (size_t)g + k]);
    return sum > s->def->feature_threshold;
}

typedef struct edge_builder {
    uint32_t *marks;  /* point -> the last point that it got an edge with */
    uint32_t *slots;  /* point -> that edge */
    uint32_t *apexes; /* edge -> apex of its first face */
    uint32_t *faces;  /* edge -> its first face */
} edge_builder;

/* Adds side c, between point a and the higher point `other`. An edge is a boundary if all its faces have the
 * same apex, so duplicate faces count once. */
static void add_side(fct_simplifier *s, edge_builder *b, uint32_t a, uint32_t other, uint32_t c) {
    uint32_t apex = s->triangles[corner_previous(c)], f = c / 3;
    if (b->marks[other] != a) {
        uint32_t e = s->edge_count++;
        b->marks[other] = a;
        b->slots[other] = e;
        b->apexes[e] = apex;
        b->faces[e] = f;
        s->edges[e] = (fct_edge){.ends = {a, other}, .parent = e};
        s->edge_flags[e] = EDGE_BOUNDARY;
    }
    uint32_t e = b->slots[other];
    s->side_edges[c] = e;
    if (b->apexes[e] != apex) s->edge_flags[e] &= (uint8_t)~EDGE_BOUNDARY;
    if (faces_differ(s, b->faces[e], f)) s->edge_flags[e] |= EDGE_BORDER;
}

static fct_result make_edges(fct_simplifier *s) {
    size_t corners = 3 * (size_t)s->live_faces; /* an upper bound of the edge count */
    edge_builder b = {0};
    const fct_array scratch[] = {FCT_ARRAY(b.marks, s->point_count), FCT_ARRAY(b.slots, s->point_count),
                                 FCT_ARRAY(b.apexes, corners), FCT_ARRAY(b.faces, corners)};
    const fct_array arrays[] = {FCT_ARRAY(s->edges, corners), FCT_ARRAY_ZERO(s->edge_flags, corners)};
    fct_result result = fct_allocate_all(s->env, scratch, FCT_LENGTH(scratch), "the edges of a mesh");
    if (result == FCT_OK)
        result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the edges of a mesh");
    if (result != FCT_OK) goto done;
    memset(b.marks, 0xff, s->point_count * sizeof *b.marks);
    for (uint32_t a = 0; a < s->point_count; ++a)
        for (uint32_t c = point_at(s, a)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
            uint32_t previous = corner_previous(c);
            uint32_t y = s->triangles[corner_next(c)], z = s->triangles[previous];
            if (y > a) add_side(s, &b, a, y, c);
            if (z > a) add_side(s, &b, a, z, previous);
        }
done:
    fct_release_all(s->env, scratch, FCT_LENGTH(scratch));
    return result;
}

fct_result fct_simplify_topology(fct_simplifier *s) {
    fct_result result = make_points(s);
    if (result == FCT_OK) result = make_rings(s);
    if (result == FCT_OK) result = make_wedges(s);
    if (result == FCT_OK) result = make_edges(s);
    return result;
}
