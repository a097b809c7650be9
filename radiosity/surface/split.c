/* radiosity/surface/split.c: see split.h. The hash tables use linear probing and are at most half full. */
#include "radiosity/surface/split.h"

#include "base/key.h"
#include "base/math/vec.h"
#include "radiosity/sample.h"

#include <string.h>

#define NO_EDGE UINT64_MAX

static size_t choose_table_size(size_t count) {
    size_t size = 16;
    while (size < 2 * count) size *= 2;
    return size;
}

fct_result fct_edge_table_init(const fct_env *env, size_t count, fct_edge_table *out) {
    size_t size = choose_table_size(count);
    out->mask = size - 1;
    out->keys = fct_allocate(env, size, sizeof *out->keys);
    out->values = fct_allocate(env, size, sizeof *out->values);
    if (!out->keys || !out->values) {
        fct_edge_table_release(env, out);
        return fct_fail_memory(env, "a table of edges");
    }
    memset(out->keys, 0xff, size * sizeof *out->keys);
    return FCT_OK;
}

void fct_edge_table_release(const fct_env *env, fct_edge_table *table) {
    fct_release(env, table->keys);
    fct_release(env, table->values);
    *table = (fct_edge_table){0};
}

static size_t find_edge_slot(const fct_edge_table *table, uint64_t key) {
    size_t slot = fct_hash(key) & table->mask;
    while (table->keys[slot] != key && table->keys[slot] != NO_EDGE) slot = (slot + 1) & table->mask;
    return slot;
}

uint32_t *fct_edge_table_insert(fct_edge_table *table, uint32_t a, uint32_t b, bool *fresh) {
    uint64_t key = fct_pair_key(a, b);
    size_t slot = find_edge_slot(table, key);
    *fresh = table->keys[slot] == NO_EDGE;
    table->keys[slot] = key;
    return table->values + slot;
}

const uint32_t *fct_edge_table_find(const fct_edge_table *table, uint32_t a, uint32_t b) {
    uint64_t key = fct_pair_key(a, b);
    size_t slot = find_edge_slot(table, key);
    return table->keys[slot] == key ? table->values + slot : NULL;
}

static double measure_distance2(const float *positions, uint32_t a, uint32_t b) {
    return v3_norm2(v3_sub(v3_load(positions + 3 * (size_t)a), v3_load(positions + 3 * (size_t)b)));
}

/* True if the diagonal from a to the midpoint of bc is no longer than the one from c to the midpoint of ab.
 * Squared medians: (2 |ab|^2 + 2 |ca|^2 - |bc|^2) / 4 against (2 |ca|^2 + 2 |bc|^2 - |ab|^2) / 4. */
static bool first_diagonal_is_shorter(const float *positions, uint32_t a, uint32_t b, uint32_t c) {
    return measure_distance2(positions, a, b) <= measure_distance2(positions, b, c);
}

/* Places (see split.h) of the corners of a part. Returns where those of the next part go. */
static uint8_t *emit_part(uint8_t *out, int a, int b, int c) {
    out[0] = (uint8_t)a, out[1] = (uint8_t)b, out[2] = (uint8_t)c;
    return out + 3;
}

/* Writes the places of the parts of a triangle with corners t. Returns their number. */
static uint32_t split_face(const float *positions, const uint32_t t[3], unsigned mark, uint8_t *out) {
    int edges = __builtin_popcount(mark), turn = 0;
    if (edges == 0) return emit_part(out, 0, 1, 2), 1;
    if (edges == 3) {
        out = emit_part(out, 0, 3, 5);
        out = emit_part(out, 3, 1, 4);
        out = emit_part(out, 5, 4, 2);
        return emit_part(out, 3, 4, 5), 4;
    }
    /* Turn the triangle until edge 0, or edges 0 and 1, are the marked ones. */
    unsigned wanted = edges == 1 ? 1 : 3;
    while (((mark >> turn | mark << (3 - turn)) & 7) != wanted) ++turn;
    const int a = turn, b = (turn + 1) % 3, c = (turn + 2) % 3, ab = 3 + a, bc = 3 + b;
    if (edges == 1) {
        out = emit_part(out, a, ab, c);
        return emit_part(out, ab, b, c), 2;
    }
    out = emit_part(out, ab, b, bc);
    if (first_diagonal_is_shorter(positions, t[a], t[b], t[c])) {
        out = emit_part(out, a, ab, bc);
        return emit_part(out, a, bc, c), 3;
    }
    out = emit_part(out, a, ab, c);
    return emit_part(out, ab, bc, c), 3;
}

fct_result fct_split_edges(const fct_env *env, uint32_t vertex_count, const float *positions,
                           uint32_t face_count, const uint32_t *triangles, const uint8_t *marks,
                           fct_split *out) {
    size_t marked = 0;
    fct_edge_table table = {0};
    *out = (fct_split){0};
    for (size_t f = 0; f < face_count; ++f) marked += (size_t)__builtin_popcount(marks[f] & 7u);
    size_t faces = face_count + marked;
    if (faces > FCT_SPLIT_MAX_FACES || vertex_count + marked > FCT_SPLIT_MAX_FACES)
        return fct_fail(env, FCT_ERROR_MEMORY, "splitting %u triangles makes more than 2^31", face_count);
    fct_result result = fct_edge_table_init(env, marked, &table);
    if (result != FCT_OK) return result;
    const fct_array arrays[] = {FCT_ARRAY(out->triangles, 3 * faces), FCT_ARRAY(out->parents, faces),
                                FCT_ARRAY(out->ends, 2 * marked), FCT_ARRAY(out->places, 3 * faces)};
    result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "split triangles");
    if (result != FCT_OK) goto done;
    for (uint32_t f = 0; f < face_count; ++f) {
        const uint32_t *t = triangles + 3 * (size_t)f;
        uint32_t corners[6] = {t[0], t[1], t[2], 0, 0, 0}; /* by place */
        for (int k = 0; k < 3; ++k) {
            if (!(marks[f] >> k & 1)) continue;
            bool fresh;
            uint32_t a = t[k], b = t[k == 2 ? 0 : k + 1],
                     *value = fct_edge_table_insert(&table, a, b, &fresh);
            if (fresh) {
                *value = out->vertex_count++;
                out->ends[2 * (size_t)*value] = a, out->ends[2 * (size_t)*value + 1] = b;
            }
            corners[3 + k] = vertex_count + *value;
        }
        const size_t first = 3 * (size_t)out->face_count;
        uint32_t parts = split_face(positions, t, marks[f] & 7u, out->places + first);
        for (size_t c = first; c < first + 3 * (size_t)parts; ++c)
            out->triangles[c] = corners[out->places[c]];
        while (parts--) out->parents[out->face_count++] = f;
    }
done:
    fct_edge_table_release(env, &table);
    if (result != FCT_OK) fct_split_release(env, out);
    return result;
}

void fct_split_release(const fct_env *env, fct_split *split) {
    fct_release(env, split->triangles);
    fct_release(env, split->parents);
    fct_release(env, split->ends);
    fct_release(env, split->places);
    *split = (fct_split){0};
}

void fct_split_uv(const fct_split *split, size_t face, const float *old_uv, const double shares[3],
                  float *uv) {
    for (size_t c = 0; c < 3; ++c) {
        const uint32_t place = split->places[3 * face + c];
        const float *a = old_uv + 2 * (size_t)(place % 3), *b = old_uv + 2 * (size_t)((place + 1) % 3);
        const double share = place < 3 ? 0 : shares[place - 3];
        for (size_t k = 0; k < 2; ++k)
            uv[2 * c + k] = (float)((1 - share) * (double)a[k] + share * (double)b[k]);
    }
}

static uint64_t hash_position(const float *p, uint32_t bits[3]) {
    for (int k = 0; k < 3; ++k) {
        float value = p[k] == 0 ? 0 : p[k];
        memcpy(bits + k, &value, sizeof value);
    }
    return fct_hash2((uint64_t)bits[0] << 32 | bits[1], bits[2]);
}

fct_result fct_weld(const fct_env *env, uint32_t vertex_count, const float *positions, uint32_t *first) {
    size_t size = choose_table_size(vertex_count), mask = size - 1;
    uint32_t *slots = fct_allocate(env, size, sizeof *slots);
    if (!slots) return fct_fail_memory(env, "a table of vertices");
    memset(slots, 0xff, size * sizeof *slots);
    for (uint32_t v = 0; v < vertex_count; ++v) {
        const float *p = positions + 3 * (size_t)v;
        uint32_t bits[3];
        size_t slot = hash_position(p, bits) & mask;
        for (;; slot = (slot + 1) & mask) {
            if (slots[slot] == FCT_NONE) {
                slots[slot] = v;
                break;
            }
            const float *q = positions + 3 * (size_t)slots[slot];
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) break;
        }
        first[v] = slots[slot];
    }
    fct_release(env, slots);
    return FCT_OK;
}
