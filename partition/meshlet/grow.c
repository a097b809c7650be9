/* partition/meshlet/grow.c: grows pieces face by face.
 *
 * A piece begins next to the previous piece, at the face whose vertices have the fewest free faces, or at the
 * next free place of the tree. It takes faces in this order:
 * 1. faces that bring no new vertex;
 * 2. faces with a corner that no other free face has;
 * 3. the face nearest to its middle and most similar in direction. Distances are relative to the size of the
 *    subtree that would fit.
 * Without a neighbour to take, it continues at the next place of the tree, if that is near. Regions of the
 * tree grow independently, in parallel. O(F x front of a piece).
 */
#include "partition/meshlet/grow.h"

#include <string.h>

#include "base/math/vec.h"
#include "base/parallel.h"
#include "partition/face.h"

enum { MOST_FRONT = 3 * FCT_MESHLET_TRIANGLES, LOOKS = 64 };

typedef struct candidate {
    uint32_t face;
    float centroid[3], normal[3];
} candidate;

/* A region and its current piece. Vertices have numbers within the region. */
typedef struct grower {
    const fct_packer *packer;
    const uint32_t *corners; /* per corner of the region: its vertex */
    uint32_t *live;          /* per vertex: free faces */
    uint32_t *stamps;        /* per vertex: the last piece that has it */
    uint32_t first, end;     /* places of the region */
    uint32_t next_place;
    uint32_t piece, seed, face_count, vertex_count;
    double reach;      /* squared reach of the seed */
    v3 middle, normal; /* sums of centroids and unit normals of its faces */
    uint32_t front_count;
    candidate front[MOST_FRONT]; /* free faces beside the piece; may contain taken ones */
} grower;

/* Other threads own the faces of other regions, so the range is tested first. */
static bool is_free(const grower *g, uint32_t face) {
    return face >= g->first && face < g->end && g->packer->owner[face] == FCT_NONE;
}

static const uint32_t *get_corners(const grower *g, uint32_t face) {
    return g->corners + 3 * (size_t)(face - g->first);
}

static bool has_material(const grower *g, uint32_t face) {
    const uint32_t *materials = g->packer->view->materials;
    return !materials || materials[face] == materials[g->seed];
}

static candidate describe_face(const fct_tree_view *view, uint32_t face) {
    const uint32_t *t = view->triangles + 3 * (size_t)face;
    candidate c = {.face = face};
    v3 sum = {0, 0, 0};
    for (int k = 0; k < 3; ++k) sum = v3_mad(sum, 1.0 / 3, v3_load(view->positions + 3 * (size_t)t[k]));
    v3_store(c.centroid, sum);
    v3_store(c.normal, v3_unit(fct_face_vector(view, face)));
    return c;
}

static void push_neighbours(grower *g, uint32_t face) {
    const fct_sides *sides = &g->packer->sides;
    for (uint32_t side = 3 * face; side < 3 * face + 3; ++side) {
        uint32_t ends[2] = {sides->before[side], sides->after[side]};
        for (int k = 0; k < 2; ++k) {
            if (ends[k] == FCT_NONE || !is_free(g, ends[k] / 3)) continue;
            uint32_t i = 0;
            while (i < g->front_count && g->front[i].face != ends[k] / 3) ++i;
            if (i == g->front_count && i < MOST_FRONT)
                g->front[g->front_count++] = describe_face(g->packer->view, ends[k] / 3);
        }
    }
}

static void take_face(grower *g, const candidate *c) {
    const uint32_t *t = get_corners(g, c->face);
    g->packer->owner[c->face] = g->piece;
    ++g->face_count;
    for (int k = 0; k < 3; ++k) {
        g->vertex_count += g->stamps[t[k]] != g->piece;
        g->stamps[t[k]] = g->piece;
        --g->live[t[k]];
    }
    g->middle = v3_add(g->middle, v3_load(c->centroid));
    g->normal = v3_add(g->normal, v3_load(c->normal));
    push_neighbours(g, c->face);
}

/* The class of a face, see the top: 0, 1 or 2. *fresh: the number of new vertices. */
static int rank_face(const grower *g, uint32_t face, uint32_t *fresh) {
    const uint32_t *t = get_corners(g, face);
    bool last = false;
    *fresh = 0;
    for (int k = 0; k < 3; ++k) {
        *fresh += g->stamps[t[k]] != g->piece;
        last = last || g->live[t[k]] == 1;
    }
    return *fresh == 0 ? 0 : last ? 1 : 2;
}

/* Whether a face looks away from a nearly flat piece. The back of a two-sided surface shares vertices with
 * its front, and a piece with both could never be culled. */
static bool is_opposed(const grower *g, const candidate *c) {
    double flat = 0.8 * g->face_count;
    return g->packer->def.flatness > 0 && v3_dot(v3_load(c->normal), g->normal) < 0 &&
           v3_norm(g->normal) > flat;
}

/* The best face of the front that fits; false if there is none. Drops faces that are not free. */
static bool choose_face(grower *g, candidate *chosen) {
    const fct_packer *p = g->packer;
    uint32_t best = FCT_NONE, room = p->def.max_vertices - g->vertex_count;
    int best_rank = 3;
    double best_score = INFINITY;
    v3 middle = v3_scale(g->middle, 1.0 / g->face_count), normal = v3_unit(g->normal);
    for (uint32_t i = 0; i < g->front_count;) {
        const candidate *c = &g->front[i];
        if (!is_free(g, c->face)) {
            g->front[i] = g->front[--g->front_count];
            continue;
        }
        uint32_t fresh, at = i++;
        int rank = rank_face(g, c->face, &fresh);
        if (is_opposed(g, c)) continue;
        if (fresh > room || rank > best_rank || !has_material(g, c->face)) continue;
        double score = v3_norm2(v3_sub(v3_load(c->centroid), middle)) / g->reach;
        score += p->def.flatness * (1 - v3_dot(v3_load(c->normal), normal));
        bool better =
            rank < best_rank || score < best_score || (score == best_score && c->face < g->front[best].face);
        if (better) best = at, best_rank = rank, best_score = score;
    }
    if (best != FCT_NONE) *chosen = g->front[best];
    return best != FCT_NONE;
}

static uint32_t find_free(grower *g) {
    while (g->next_place < g->end && !is_free(g, g->next_place)) ++g->next_place;
    return g->next_place;
}

/* Whether a piece may continue at a face that is not its neighbour: the face fits, has its material, does not
 * look away, and lies within twice the reach. */
static bool may_jump(const grower *g, uint32_t face, v3 middle, candidate *chosen) {
    const fct_packer *p = g->packer;
    uint32_t fresh;
    rank_face(g, face, &fresh);
    if (fresh > p->def.max_vertices - g->vertex_count) return false;
    if (!has_material(g, face)) return false;
    *chosen = describe_face(p->view, face);
    if (is_opposed(g, chosen)) return false;
    return v3_norm2(v3_sub(v3_load(chosen->centroid), middle)) <= 4 * g->reach;
}

/* The next free place of the same home where the piece may continue. */
static bool choose_jump(grower *g, candidate *chosen) {
    const uint32_t *home = g->packer->home;
    uint32_t face = find_free(g);
    v3 middle = v3_scale(g->middle, 1.0 / g->face_count);
    for (int look = 0; look < LOOKS && face < g->end && home[face] == home[g->seed]; ++look, ++face)
        if (is_free(g, face) && may_jump(g, face, middle, chosen)) return true;
    return false;
}

/* The face at which the next piece begins; `end` if there is none. */
static uint32_t choose_seed(grower *g) {
    uint32_t best = FCT_NONE;
    uint64_t fewest = UINT64_MAX;
    for (uint32_t i = 0; i < g->front_count; ++i) {
        uint32_t face = g->front[i].face;
        if (!is_free(g, face)) continue;
        const uint32_t *t = get_corners(g, face);
        uint64_t around = (uint64_t)g->live[t[0]] + g->live[t[1]] + g->live[t[2]];
        if (around < fewest || (around == fewest && face < best)) best = face, fewest = around;
    }
    return best != FCT_NONE ? best : find_free(g);
}

static void grow_piece(grower *g, uint32_t seed) {
    const fct_packer *p = g->packer;
    candidate next = describe_face(p->view, seed);
    g->seed = seed;
    g->reach = fmax((double)p->reach[seed] * (double)p->reach[seed], 1e-300);
    g->middle = g->normal = (v3){0, 0, 0};
    g->front_count = g->face_count = g->vertex_count = 0;
    do take_face(g, &next);
    while (g->face_count < p->def.max_triangles && (choose_face(g, &next) || choose_jump(g, &next)));
    ++g->piece;
}

/* --- Regions --- */

typedef struct field {
    fct_packer *packer;
    const uint32_t *bounds;
    uint32_t *corners; /* per corner: the number of its vertex in the region */
    uint32_t *counts;  /* per region: number of pieces, then number of its first piece */
    grower *growers;   /* per thread */
} field;

/* Numbers the vertices of the region by first use. Returns their number. */
static uint32_t number_vertices(const fct_packer *p, uint32_t first, uint32_t end, uint32_t *corners) {
    uint32_t count = 0;
    for (size_t f = first; f < end; ++f) {
        const uint32_t *t = p->view->triangles + 3 * f;
        for (size_t k = 0; k < 3; ++k) {
            uint32_t before = p->vertex_before[3 * f + k];
            size_t other = k > 0 && t[k] == t[0] ? 3 * f : k > 1 && t[k] == t[1] ? 3 * f + 1 : SIZE_MAX;
            if (other == SIZE_MAX && before != FCT_NONE && before >= first) {
                other = 3 * (size_t)before;
                while (p->view->triangles[other] != t[k]) ++other;
            }
            corners[3 * f + k] = other == SIZE_MAX ? count++ : corners[other];
        }
    }
    return count;
}

static void grow_regions(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk;
    field *all = user;
    for (size_t r = begin; r < end; ++r) {
        grower *g = &all->growers[thread];
        g->packer = all->packer;
        g->first = g->next_place = all->bounds[r], g->end = all->bounds[r + 1];
        g->piece = 0, g->front_count = 0;
        uint32_t vertices = number_vertices(g->packer, g->first, g->end, all->corners);
        g->corners = all->corners + 3 * (size_t)g->first;
        memset(g->live, 0, vertices * sizeof *g->live);
        memset(g->stamps, 0xFF, vertices * sizeof *g->stamps);
        for (size_t i = 0; i < 3 * (size_t)(g->end - g->first); ++i) ++g->live[g->corners[i]];
        for (uint32_t f = g->first; f < g->end; ++f) g->packer->owner[f] = FCT_NONE;
        for (uint32_t seed; (seed = choose_seed(g)) < g->end;) grow_piece(g, seed);
        all->counts[r] = g->piece;
    }
}

static void number_pieces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    field *all = user;
    for (size_t r = begin; r < end; ++r)
        for (uint32_t f = all->bounds[r]; f < all->bounds[r + 1]; ++f)
            all->packer->owner[f] += all->counts[r];
}

static fct_result grow_field(const fct_env *env, field *all, uint32_t regions) {
    fct_result result = fct_parallel_for_progress(env, "growing", regions, 1, grow_regions, all);
    if (result != FCT_OK) return result;
    uint32_t total = 0;
    for (uint32_t r = 0; r < regions; ++r) {
        uint32_t count = all->counts[r];
        all->counts[r] = total;
        total += count;
    }
    all->packer->count = total;
    fct_parallel_for(env, regions, 1, number_pieces, all);
    return FCT_OK;
}

fct_result fct_meshlets_grow(const fct_env *env, fct_packer *packer, const uint32_t *bounds,
                             uint32_t bound_count) {
    uint32_t regions = bound_count - 1, threads = fct_env_threads(env);
    size_t largest = 0;
    if (threads > regions) threads = regions;
    for (uint32_t r = 0; r < regions; ++r)
        if (bounds[r + 1] - bounds[r] > largest) largest = bounds[r + 1] - bounds[r];
    field all = {.packer = packer, .bounds = bounds};
    uint32_t *scratch;
    const fct_array arrays[] = {FCT_ARRAY(all.corners, 3 * (size_t)packer->view->face_count),
                                FCT_ARRAY(all.counts, regions), FCT_ARRAY_ZERO(all.growers, threads),
                                FCT_ARRAY(scratch, 6 * (size_t)(threads * largest))};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "meshlets");
    for (uint32_t t = 0; t < threads && result == FCT_OK; ++t) {
        all.growers[t].live = scratch + 6 * t * largest;
        all.growers[t].stamps = all.growers[t].live + 3 * largest;
    }
    if (result == FCT_OK) result = grow_field(env, &all, regions);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
