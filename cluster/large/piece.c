/* cluster/large/piece.c: reads one part of a large mesh from the spool, contracts and describes it, and
 * spools its nodes and tops.
 *
 * Faces with a side on the cut are frozen: they offer prices but do not merge. A cluster whose cheapest
 * partner is frozen waits too. So, as a rule, both clusters of a merge prefer each other to all neighbours
 * that they will have in the whole model. The clusters that remain, the tops, are small near the cut and
 * large inside.
 *
 * If a part leaves more tops than its share of top_limit, press() goes on, until they fit: contract without
 * frozen faces, join clusters without neighbours by proximity, then join all clusters.
 */
#include <stdio.h>
#include <string.h>

#include "base/parallel.h"
#include "base/sort.h"
#include "cluster/large/large.h"
#include "cluster/merge/greedy.h"
#include "cluster/merge/rounds/rounds.h"
#include "cluster/tree/describe/describe.h"
#include "cluster/tree/node.h"
#include "cluster/tree/order.h"

typedef struct piece {
    fct_large *large;
    fct_env env; /* that of the large mesh, with show_progress */
    char phase[32];
    uint32_t phase_count;
    fct_part *part;
    uint32_t number;
    uint32_t *face_ids;   /* per face: id in the input */
    uint32_t *corners;    /* per face: its vertices in the input, if vertices are joined */
    uint32_t *vertex_ids; /* per vertex: id in the input, ascending */
    fct_mesh mesh;
    fct_work work;
    fct_metric metric; /* copy of the work's */
    fct_tree *tree;
    uint8_t *frozen; /* per face; the contraction marks waiting clusters in it, too */
    uint8_t *on_cut; /* per face: has a side on the cut */
    fct_top *tops;   /* in the order of the tree's roots; before order_tops, of slots */
    fct_sums *sums;  /* per top */
    fct_mean_record *means;
    uint32_t *top_of; /* per face of the part */
    fct_edge *edges;
    uint32_t edge_count;
    fct_seam_side *sides; /* `top` is a face of the part until put_sides */
    uint32_t side_count;
} piece;

static bool is_set(const uint32_t *bits, uint32_t i) {
    return bits[i / 32] >> i % 32 & 1;
}

/* Converts the progress of one step of a part to that of all parts. */
static bool show_progress(void *user, const char *phase, double done) {
    enum { STEPS = 6 };
    piece *p = user;
    if (strncmp(phase, p->phase, sizeof p->phase - 1) != 0) {
        snprintf(p->phase, sizeof p->phase, "%s", phase);
        if (p->phase_count < STEPS) ++p->phase_count;
    }
    double part = (p->phase_count - 1 + done) / STEPS;
    return fct_progress(p->large->env, "parts", (p->number + part) / (double)p->large->part_count) == FCT_OK;
}

/* --- The mesh --- */

/* Reads the faces of the part. Their corners are vertices of the whole mesh. */
static fct_result load_faces(piece *p, uint32_t *rows) {
    fct_large *l = p->large;
    size_t words = fct_large_row_words(l), at = 0;
    for (size_t r = 0; r < l->run_count; ++r) {
        const fct_face_run *run = &l->runs[r];
        if (run->part != p->number) continue;
        fct_result result = fct_spool_read(&l->faces, run->offset, rows, 4 * words * run->count);
        if (result != FCT_OK) return result;
        fct_spool_discard(&l->faces, run->offset, 4 * words * run->count);
        for (size_t i = 0; i < run->count; ++i, ++at) {
            p->face_ids[at] = rows[words * i];
            memcpy(p->mesh.triangles + 3 * at, rows + words * i + 1, 3 * sizeof(uint32_t));
            if (p->corners) memcpy(p->corners + 3 * at, rows + words * i + 4, 3 * sizeof(uint32_t));
            if (p->mesh.materials) p->mesh.materials[at] = rows[words * i + words - 1];
        }
    }
    return FCT_OK;
}

/* Lists the vertices of the part and renumbers the corners of its triangles. bits: one per vertex of the
 * whole mesh. counts: per word of bits, the number of bits set before it. */
static fct_result number_vertices(piece *p, uint32_t *bits, uint32_t *counts) {
    size_t words = (size_t)p->large->info.vertex_count / 32 + 1, corners = 3 * (size_t)p->mesh.face_count;
    uint32_t *t = p->mesh.triangles, count = 0;
    memset(bits, 0, words * sizeof *bits);
    for (size_t i = 0; i < corners; ++i) bits[t[i] / 32] |= 1u << t[i] % 32;
    for (size_t w = 0; w < words; ++w) {
        counts[w] = count;
        count += (uint32_t)__builtin_popcount(bits[w]);
    }
    p->mesh.vertex_count = count;
    p->vertex_ids = fct_allocate(p->large->env, count, sizeof *p->vertex_ids);
    p->mesh.positions = fct_allocate(p->large->env, count, 3 * sizeof *p->mesh.positions);
    if (!p->vertex_ids || !p->mesh.positions) return fct_fail_memory(p->large->env, "a part of a mesh");
    for (size_t w = 0, v = 0; w < words; ++w)
        for (uint32_t left = bits[w]; left; left &= left - 1)
            p->vertex_ids[v++] = (uint32_t)(32 * w) + (uint32_t)__builtin_ctz(left);
    for (size_t i = 0; i < corners; ++i)
        t[i] = counts[t[i] / 32] + (uint32_t)__builtin_popcount(bits[t[i] / 32] & ((1u << t[i] % 32) - 1));
    return FCT_OK;
}

/* One read covers vertices that are fewer than 64 apart in the file. */
static fct_result load_positions(piece *p, float *buffer, uint32_t rows) {
    uint32_t count = p->mesh.vertex_count;
    for (uint32_t v = 0; v < count;) {
        uint32_t first = p->vertex_ids[v], end = v + 1;
        while (end < count && p->vertex_ids[end] - first < rows &&
               p->vertex_ids[end] - p->vertex_ids[end - 1] < 64)
            ++end;
        fct_result result =
            fct_stream_vertices(p->large->stream, first, p->vertex_ids[end - 1] - first + 1, buffer, NULL);
        if (result != FCT_OK) return result;
        for (; v < end; ++v)
            memcpy(p->mesh.positions + 3 * (size_t)v, buffer + 3 * (size_t)(p->vertex_ids[v] - first),
                   3 * sizeof(float));
    }
    return FCT_OK;
}

static void mark_cut(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    piece *p = user;
    const uint32_t *shared = p->large->shared;
    for (size_t f = begin; f < end; ++f) {
        const uint32_t *t = p->mesh.triangles + 3 * f;
        uint32_t on[3];
        for (int k = 0; k < 3; ++k) on[k] = is_set(shared, p->vertex_ids[t[k]]);
        p->on_cut[f] = (on[0] & on[1] & (t[0] != t[1])) | (on[1] & on[2] & (t[1] != t[2])) |
                       (on[2] & on[0] & (t[2] != t[0]));
        p->frozen[f] = p->on_cut[f];
    }
}

static fct_result load_mesh(piece *p) {
    enum { ROWS = 1 << 14 };
    fct_large *l = p->large;
    const fct_env *env = l->env;
    size_t faces = p->part->face_count, words = (size_t)l->info.vertex_count / 32 + 1, row_words = 0;
    for (size_t r = 0; r < l->run_count; ++r)
        if (l->runs[r].part == p->number && l->runs[r].count > row_words) row_words = l->runs[r].count;
    uint32_t *rows = fct_allocate(env, row_words, fct_large_row_words(l) * sizeof *rows);
    uint32_t *bits = fct_allocate(env, words, sizeof *bits),
             *counts = fct_allocate(env, words, sizeof *counts);
    float *buffer = fct_allocate(env, ROWS, 3 * sizeof *buffer);
    p->mesh.face_count = (uint32_t)faces;
    p->mesh.material_count = l->info.material_count;
    p->face_ids = fct_allocate(env, faces, sizeof *p->face_ids);
    p->mesh.triangles = fct_allocate(env, faces, 3 * sizeof *p->mesh.triangles);
    if (l->info.materials) p->mesh.materials = fct_allocate(env, faces, sizeof *p->mesh.materials);
    if (l->joined) p->corners = fct_allocate(env, faces, 3 * sizeof *p->corners);
    p->frozen = fct_allocate(env, faces, 1);
    p->on_cut = fct_allocate(env, faces, 1);
    fct_result result;
    if (!rows || !bits || !counts || !buffer || !p->face_ids || !p->mesh.triangles ||
        (l->info.materials && !p->mesh.materials) || (l->joined && !p->corners) || !p->frozen || !p->on_cut)
        result = fct_fail_memory(env, "a part of a mesh");
    else
        result = load_faces(p, rows);
    if (result == FCT_OK) result = number_vertices(p, bits, counts);
    if (result == FCT_OK) result = load_positions(p, buffer, ROWS);
    if (result == FCT_OK) fct_parallel_for(env, faces, 1 << 14, mark_cut, p);
    fct_release(env, rows);
    fct_release(env, bits);
    fct_release(env, counts);
    fct_release(env, buffer);
    return result;
}

/* --- Contraction --- */

static uint32_t live_count(const fct_work *work) {
    return work->face_count - work->merge_count;
}

/* Sets the boxes of tops in the unit model from their faces. owner: per face, its top or FCT_NONE. */
static void bound_tops(const piece *p, const uint32_t *owner, fct_top *tops, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) tops[i].lower[k] = INFINITY, tops[i].upper[k] = -INFINITY;
    for (uint32_t f = 0; f < p->mesh.face_count; ++f) {
        if (owner[f] == FCT_NONE) continue;
        fct_top *top = &tops[owner[f]];
        for (int c = 0; c < 3; ++c) {
            v3 x = v3_load(p->mesh.positions + 3 * (size_t)p->mesh.triangles[3 * (size_t)f + (size_t)c]);
            float q[3];
            v3_store(q, v3_scale(v3_sub(x, p->work.metric.origin), p->work.metric.scale));
            for (int k = 0; k < 3; ++k) {
                if (q[k] < top->lower[k]) top->lower[k] = q[k];
                if (q[k] > top->upper[k]) top->upper[k] = q[k];
            }
        }
    }
}

/* Joins the clusters in the listed slots to one by proximity. */
static fct_result join_slots(piece *p, const uint32_t *slots, uint32_t count) {
    fct_work *work = &p->work;
    const fct_env *env = p->large->env;
    if (count < 2) return FCT_OK;
    uint32_t *owner = fct_allocate(env, (size_t)work->face_count + work->merge_count, sizeof *owner);
    uint32_t(*children)[2] = fct_allocate(env, count, sizeof *children),
    *at = fct_allocate(env, count, 2 * sizeof *at);
    float *costs = fct_allocate(env, count, sizeof *costs);
    fct_top *tops = fct_allocate_zero(env, count, sizeof *tops);
    fct_mean_record *means = work->means ? fct_allocate(env, count, sizeof *means) : NULL;
    fct_result result = FCT_OK;
    if (!owner || !children || !at || !costs || !tops || (work->means && !means)) {
        result = fct_fail_memory(env, "joining a part");
        goto done;
    }
    memset(owner, 0xFF, ((size_t)work->face_count + work->merge_count) * sizeof *owner);
    for (uint32_t i = 0; i < count; ++i) {
        owner[work->nodes[slots[i]]] = i;
        tops[i].record = work->records[slots[i]];
        tops[i].height = work->heights[slots[i]];
        if (means) means[i] = work->means[slots[i]];
    }
    for (uint32_t m = work->merge_count; m-- > 0;)
        if (owner[work->face_count + m] != FCT_NONE)
            owner[work->children[m][0]] = owner[work->children[m][1]] = owner[work->face_count + m];
    bound_tops(p, owner, tops, count);
    result = fct_large_join(env, &work->metric, tops, means, count, children, costs);
    for (uint32_t i = 0; i < count; ++i) at[i] = slots[i]; /* per cluster of the join: its slot */
    for (uint32_t m = 0; result == FCT_OK && m + 1 < count; ++m) {
        at[count + m] = at[children[m][0]];
        fct_work_merge(work, at[children[m][0]], at[children[m][1]], 0, costs[m]);
    }
done:
    fct_release(env, owner);
    fct_release(env, children);
    fct_release(env, at);
    fct_release(env, costs);
    fct_release(env, tops);
    fct_release(env, means);
    return result;
}

/* Joins the listed slots in groups of neighbours along the Hilbert curve. Groups bound the memory, because
 * joining takes four times the memory of contraction per cluster. */
static fct_result join_groups(piece *p, uint32_t *slots, uint32_t count) {
    const fct_env *env = p->large->env;
    uint32_t group = p->mesh.face_count / 8 + 4096;
    uint64_t *keys = fct_allocate(env, count, sizeof *keys);
    if (!keys) return fct_fail_memory(env, "joining a part");
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t cell[3];
        for (int k = 0; k < 3; ++k) { /* the unit model lies within 1/2 of the origin */
            float x = (p->work.records[slots[i]].centroid[k] + 0.5f) * (1 << FCT_CURVE_BITS);
            cell[k] = x > 0 ? x < (1 << FCT_CURVE_BITS) ? (uint32_t)x : (1 << FCT_CURVE_BITS) - 1 : 0;
        }
        keys[i] = fct_curve_code(cell);
    }
    fct_result result = fct_sort_pairs(env, keys, slots, count);
    fct_release(env, keys);
    for (uint32_t first = 0; first < count && result == FCT_OK; first += group)
        result = join_slots(p, slots + first, count - first < group ? count - first : group);
    return result;
}

/* Lists the live clusters that have no neighbour and no face on the cut. */
static fct_result find_loose(const piece *p, uint32_t *slots, uint32_t *count) {
    const fct_work *work = &p->work;
    const fct_env *env = p->large->env;
    uint8_t *open = fct_allocate_zero(env, (size_t)work->face_count + work->merge_count, 1);
    if (!open) return fct_fail_memory(env, "joining a part");
    for (uint32_t e = 0; e < work->edge_count; ++e)
        open[work->nodes[work->edges[e].a]] = open[work->nodes[work->edges[e].b]] = 1;
    for (uint32_t f = 0; f < work->face_count; ++f) open[f] |= p->on_cut[f];
    for (uint32_t m = 0; m < work->merge_count; ++m)
        open[work->face_count + m] |= open[work->children[m][0]] | open[work->children[m][1]];
    *count = 0;
    for (uint32_t s = 0; s < work->face_count; ++s)
        if (work->nodes[s] != FCT_NONE && !open[work->nodes[s]]) slots[(*count)++] = s;
    fct_release(env, open);
    return FCT_OK;
}

static fct_result contract_edges(piece *p, bool across) {
    return p->large->def->method == FCT_CLUSTER_ROUNDS ? fct_work_rounds(&p->work, across)
                                                       : fct_work_greedy(&p->work, across);
}

/* Reduces the live clusters to about `limit`. slots: room for all live clusters. */
static fct_result press(piece *p, uint32_t limit, uint32_t *slots) {
    fct_work *work = &p->work;
    uint32_t loose;
    fct_result result = find_loose(p, slots, &loose);
    if (result == FCT_OK && live_count(work) - loose >= limit) {
        work->frozen = NULL;
        result = contract_edges(p, true);
        work->phase_ends[1] = work->merge_count;
        if (result == FCT_OK) result = find_loose(p, slots, &loose);
    }
    if (result == FCT_OK && live_count(work) > limit) result = join_groups(p, slots, loose);
    if (result != FCT_OK || live_count(work) <= limit) return result;
    uint32_t count = 0;
    for (uint32_t s = 0; s < work->face_count; ++s)
        if (work->nodes[s] != FCT_NONE) slots[count++] = s;
    return join_groups(p, slots, count);
}

static fct_result contract(piece *p) {
    fct_work *work = &p->work;
    fct_large *l = p->large;
    uint64_t limit = (uint64_t)l->top_limit * work->face_count / l->info.face_count + 16;
    fct_result result = contract_edges(p, !work->materials);
    work->phase_ends[0] = work->materials ? work->merge_count : 0;
    work->phase_ends[1] = work->merge_count;
    if (result == FCT_OK && live_count(work) > limit) {
        uint32_t *slots = fct_allocate(l->env, live_count(work), sizeof *slots);
        result = slots ? press(p, (uint32_t)limit, slots) : fct_fail_memory(l->env, "joining a part");
        fct_release(l->env, slots);
    }
    work->phase_ends[2] = work->merge_count;
    l->loose_joins += work->phase_ends[2] - work->phase_ends[1];
    return result;
}

/* --- Tops --- */

/* Copies records and heights of live clusters to p->tops, in the order of slots, with the slot in `node`.
 * Takes over the edges. */
static fct_result note_live(piece *p) {
    fct_work *work = &p->work;
    const fct_env *env = p->large->env;
    uint32_t count = live_count(work), i = 0;
    p->part->top_count = count;
    p->tops = fct_allocate_zero(env, count, sizeof *p->tops);
    if (work->means) p->means = fct_allocate(env, count, sizeof *p->means);
    if (!p->tops || (work->means && !p->means)) return fct_fail_memory(env, "a part of a mesh");
    for (uint32_t s = 0; s < work->face_count; ++s) {
        if (work->nodes[s] == FCT_NONE) continue;
        p->tops[i].node = s;
        p->tops[i].record = work->records[s];
        p->tops[i].height = work->heights[s];
        if (p->means) p->means[i] = work->means[s];
        ++i;
    }
    p->edges = work->edges, p->edge_count = work->edge_count;
    work->edges = NULL, work->edge_count = 0;
    return FCT_OK;
}

static uint8_t phase_of(const fct_part *part, uint32_t node) {
    return node < part->phase_counts[2] ? 2 : node < part->phase_counts[2] + part->phase_counts[1] ? 1 : 0;
}

/* Sorts the tops of note_live into the order of the tree's roots and sets their other fields. */
static fct_result order_tops(piece *p) {
    fct_tree_view view = p->tree->view;
    const fct_env *env = p->large->env;
    uint32_t count = p->part->top_count;
    fct_top *tops = fct_allocate(env, count, sizeof *tops);
    fct_mean_record *means = p->means ? fct_allocate(env, count, sizeof *means) : NULL;
    p->top_of = fct_allocate(env, view.face_count, sizeof *p->top_of);
    if (!tops || !p->top_of || (p->means && !means)) {
        fct_release(env, tops);
        fct_release(env, means);
        return fct_fail_memory(env, "a part of a mesh");
    }
    for (uint32_t r = 0; r < count; ++r) {
        uint32_t root = view.roots[r];
        bool leaf = root >= view.node_count;
        fct_top *top = &tops[r];
        *top = (fct_top){.part = p->number,
                         .node = root,
                         .first = fct_node_first(p->tree, root),
                         .count = fct_node_faces(p->tree, root),
                         .cost = leaf ? 0 : p->tree->nodes[root].cost,
                         .phase = leaf ? 0 : phase_of(p->part, root),
                         .material = FCT_NONE};
        if (view.materials && (leaf || top->phase == 0)) top->material = view.materials[top->first];
        for (uint32_t place = top->first; place < top->first + top->count; ++place)
            p->top_of[view.face_ids[place]] = r;
    }
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t r = p->top_of[p->tops[i].node];
        tops[r].record = p->tops[i].record;
        tops[r].height = p->tops[i].height;
        if (means) means[r] = p->means[i];
    }
    fct_release(env, p->tops);
    fct_release(env, p->means);
    p->tops = tops, p->means = means;
    return FCT_OK;
}

static void sum_tops(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    piece *p = user;
    fct_tree_view view = p->tree->view;
    v3 origin = p->metric.origin;
    for (size_t i = begin; i < end; ++i) {
        fct_top *top = &p->tops[i];
        fct_sums all = {0};
        for (int k = 0; k < 3; ++k) top->lower[k] = INFINITY, top->upper[k] = -INFINITY;
        for (size_t place = top->first; place < (size_t)top->first + top->count; ++place) {
            const uint32_t *t = view.triangles + 3 * place;
            fct_sums before = all, face;
            fct_sums_face(view.positions, t, &face);
            if (place == top->first)
                all = face;
            else
                fct_sums_join(&before, &face, &all);
            for (int c = 0; c < 3; ++c) {
                float q[3];
                v3_store(
                    q, v3_scale(v3_sub(v3_load(view.positions + 3 * (size_t)t[c]), origin), p->metric.scale));
                for (int k = 0; k < 3; ++k) {
                    if (q[k] < top->lower[k]) top->lower[k] = q[k];
                    if (q[k] > top->upper[k]) top->upper[k] = q[k];
                }
            }
        }
        p->sums[i] = all;
    }
}

/* --- Spools --- */

static fct_result note_sides(piece *p) {
    fct_large *l = p->large;
    size_t most = 0;
    for (uint32_t f = 0; f < p->mesh.face_count; ++f) most += p->on_cut[f];
    p->sides = fct_allocate(l->env, most, 3 * sizeof *p->sides);
    if (!p->sides) return fct_fail_memory(l->env, "the seams of a mesh");
    for (uint32_t f = 0; f < p->mesh.face_count; ++f) {
        const uint32_t *t = p->mesh.triangles + 3 * (size_t)f;
        for (int k = 0; k < 3 && p->on_cut[f]; ++k) {
            uint32_t a = t[k], b = t[k == 2 ? 0 : k + 1];
            uint32_t u = p->vertex_ids[a], v = p->vertex_ids[b];
            if (u == v || !is_set(l->shared, u) || !is_set(l->shared, v)) continue;
            v3 from = v3_load(p->mesh.positions + 3 * (size_t)a),
               to = v3_load(p->mesh.positions + 3 * (size_t)b);
            p->sides[p->side_count++] = (fct_seam_side){
                u < v ? u : v, u < v ? v : u, p->face_ids[f], f, p->number, (float)v3_norm(v3_sub(to, from))};
        }
    }
    return FCT_OK;
}

static fct_result put_sides(piece *p) {
    for (uint32_t i = 0; i < p->side_count; ++i)
        p->sides[i].top = p->part->first_top + p->top_of[p->sides[i].top];
    return fct_spool_append(&p->large->sides, p->sides, p->side_count * sizeof *p->sides);
}

static fct_result put_edges(piece *p) {
    fct_large *l = p->large;
    fct_top_edge *edges = fct_allocate(l->env, p->edge_count, sizeof *edges);
    if (!edges) return fct_fail_memory(l->env, "a part of a mesh");
    uint32_t count = 0;
    for (uint32_t e = 0; e < p->edge_count; ++e) {
        uint32_t a = p->top_of[p->edges[e].a], b = p->top_of[p->edges[e].b];
        if (a != b)
            edges[count++] =
                (fct_top_edge){p->part->first_top + a, p->part->first_top + b, p->edges[e].shared};
    }
    fct_result result = fct_spool_append(&l->edges, edges, count * sizeof *edges);
    fct_release(l->env, edges);
    return result;
}

/* Spools the triangles of the input. */
static fct_result put_corners(piece *p) {
    fct_large *l = p->large;
    size_t faces = p->tree->view.face_count;
    uint32_t *rows = fct_allocate(l->env, faces, 3 * sizeof *rows);
    if (!rows) return fct_fail_memory(l->env, "a part of a mesh");
    for (size_t i = 0; i < faces; ++i)
        memcpy(rows + 3 * i, p->corners + 3 * (size_t)p->tree->face_ids[i], 3 * sizeof *rows);
    fct_result result = fct_spool_append(&l->corners, rows, 3 * faces * sizeof *rows);
    fct_release(l->env, rows);
    return result;
}

/* Spools nodes, costs (alone, for write.c), tops, and faces with the ids of the input. */
static fct_result put_tree(piece *p) {
    fct_large *l = p->large;
    fct_tree_view view = p->tree->view;
    size_t nodes = view.node_count, faces = view.face_count;
    float *costs = fct_allocate(l->env, nodes, sizeof *costs);
    uint32_t *ids = p->tree->face_ids, *triangles = p->tree->triangles;
    if (!costs) return fct_fail_memory(l->env, "a part of a mesh");
    fct_result result = p->corners ? put_corners(p) : FCT_OK;
    fct_enclosed_add(&l->enclosed, &view, v3_load(l->all_bounds.lower));
    for (size_t i = 0; i < nodes; ++i) costs[i] = p->tree->nodes[i].cost;
    for (size_t i = 0; i < faces; ++i) ids[i] = p->face_ids[ids[i]];
    for (size_t i = 0; i < 3 * faces; ++i) triangles[i] = p->vertex_ids[view.vertex_ids[triangles[i]]];
    if (result == FCT_OK)
        result = fct_spool_append(&l->nodes, p->tree->nodes, nodes * sizeof *p->tree->nodes);
    if (result == FCT_OK) result = fct_spool_append(&l->costs, costs, nodes * sizeof *costs);
    if (result == FCT_OK) result = fct_spool_append(&l->face_ids, ids, faces * sizeof *ids);
    if (result == FCT_OK) result = fct_spool_append(&l->triangles, triangles, 3 * faces * sizeof *triangles);
    if (result == FCT_OK && view.materials)
        result = fct_spool_append(&l->materials, view.materials, faces * sizeof *view.materials);
    if (result == FCT_OK) result = fct_spool_append(&l->tops, p->tops, p->part->top_count * sizeof *p->tops);
    if (result == FCT_OK) result = fct_spool_append(&l->sums, p->sums, p->part->top_count * sizeof *p->sums);
    if (result == FCT_OK && p->means)
        result = fct_spool_append(&l->means, p->means, p->part->top_count * sizeof *p->means);
    fct_release(l->env, costs);
    return result;
}

static void release_piece(piece *p) {
    const fct_env *env = p->large->env;
    fct_mesh_release(env, &p->mesh);
    if (p->work.env) fct_work_release(&p->work);
    fct_tree_destroy(p->tree);
    fct_release(env, p->face_ids);
    fct_release(env, p->corners);
    fct_release(env, p->vertex_ids);
    fct_release(env, p->frozen);
    fct_release(env, p->on_cut);
    fct_release(env, p->tops);
    fct_release(env, p->sums);
    fct_release(env, p->means);
    fct_release(env, p->top_of);
    fct_release(env, p->edges);
    fct_release(env, p->sides);
}

/* Turns the merges of the part into a tree whose roots are the tops. */
static fct_result order(piece *p) {
    const fct_env *env = p->large->env;
    fct_tree_def def = *p->large->def;
    def.root_count = 1, def.max_cost = INFINITY;
    const uint32_t *ends = p->work.phase_ends;
    p->part->phase_counts[0] = ends[0];
    p->part->phase_counts[1] = ends[1] - ends[0];
    p->part->phase_counts[2] = ends[2] - ends[1];
    p->tree = fct_tree_new(&p->env);
    if (!p->tree) return fct_fail_memory(env, "a part of a mesh");
    p->metric = p->work.metric;
    fct_result result = fct_tree_order(&p->work, &p->mesh, &def, p->tree);
    fct_work_release(&p->work);
    p->part->node_count = p->tree->view.node_count;
    return result;
}

static fct_result run(piece *p) {
    fct_large *l = p->large;
    double start = fct_seconds();
    fct_result result = load_mesh(p);
    if (result == FCT_OK) result = fct_work_create_within(&p->env, &p->mesh, &l->bounds, l->def, &p->work);
    if (result != FCT_OK) return result;
    p->work.frozen = p->frozen;
    uint32_t boundary = p->work.boundary_edges, nonmanifold = p->work.nonmanifold_edges;
    double dual = fct_seconds();
    result = contract(p);
    if (result == FCT_OK) result = note_live(p);
    if (result == FCT_OK) result = note_sides(p);
    if (result == FCT_OK) result = order(p);
    fct_mesh_release(l->env, &p->mesh);
    double contracted = fct_seconds();
    if (result == FCT_OK) result = fct_tree_describe(p->tree);
    if (result == FCT_OK) result = order_tops(p);
    if (result == FCT_OK) result = put_edges(p);
    if (result == FCT_OK) result = put_sides(p);
    if (result != FCT_OK) return result;
    p->sums = fct_allocate(l->env, p->part->top_count, sizeof *p->sums);
    if (!p->sums) return fct_fail_memory(l->env, "a part of a mesh");
    fct_parallel_for(l->env, p->part->top_count, 64, sum_tops, p);
    result = put_tree(p);
    l->boundary_edges += boundary, l->nonmanifold_edges += nonmanifold;
    l->seconds_dual += dual - start;
    l->seconds_contract += contracted - dual;
    l->seconds_boxes += fct_seconds() - contracted;
    return result;
}

fct_result fct_large_pieces(fct_large *large) {
    fct_spool *spools[] = {&large->nodes,     &large->costs, &large->face_ids, &large->triangles,
                           &large->materials, &large->tops,  &large->sums,     &large->means,
                           &large->edges,     &large->sides, &large->corners};
    fct_result result = FCT_OK;
    for (size_t i = 0; i < sizeof spools / sizeof *spools && result == FCT_OK; ++i)
        result = fct_spool_open(large->env, large->folder, large->path, spools[i]);
    uint64_t nodes = 0, faces = 0;
    for (uint32_t i = 0; i < large->part_count && result == FCT_OK; ++i) {
        fct_part *part = &large->parts[i];
        piece p = {.large = large, .part = part, .number = i, .env = *large->env};
        p.env.progress = show_progress, p.env.progress_user = &p;
        part->first_node = nodes, part->first_face = faces, part->first_top = large->top_count;
        result = run(&p);
        release_piece(&p);
        nodes += part->node_count, faces += part->face_count;
        large->top_count += part->top_count;
        if (result == FCT_OK)
            result = fct_progress(large->env, "parts", (i + 1.0) / (double)large->part_count);
    }
    fct_spool_close(&large->faces);
    return result;
}
