/* cluster/meshlet_grow.c: pieces grown face by face, at the scale the tree tells.
 *
 * A piece begins beside the one before, at the face with the fewest free faces around it, else at the next
 * free place of the tree. It takes faces that bring no new vertex first, then those that would be left alone,
 * then the one nearest to its middle and most like it in direction; the size of the subtree that would fit
 * says what is near. With no neighbour left to take it goes on at the next place of the tree, if that is
 * near. O(F x front of a piece), serial: each piece begins where the others left room.
 */
#include <string.h>

#include "base/vec.h"
#include "cluster/chart.h"
#include "cluster/meshlet.h"

enum { MOST_FRONT = 3 * FCT_MESHLET_TRIANGLES, LOOKS = 64 };

typedef struct candidate {
    uint32_t face;
    float centroid[3], normal[3];
} candidate;

typedef struct grower {
    fct_packer *packer;
    uint32_t *live;   /* by vertex: free faces */
    uint32_t *stamps; /* by vertex: the piece that has it, of those the last */
    uint32_t piece, next_place;
    double reach;      /* squared, of the first face */
    v3 middle, normal; /* sums of centroids and unit normals */
    uint32_t front_count;
    candidate front[MOST_FRONT]; /* free faces beside the piece, and some that are no longer free */
} grower;

static bool is_free(const grower *g, uint32_t face) {
    return g->packer->owner[face] == FCT_NONE;
}

static candidate describe(const fct_tree_view *view, uint32_t face) {
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
                g->front[g->front_count++] = describe(g->packer->view, ends[k] / 3);
        }
    }
}

static void take(grower *g, const candidate *c) {
    fct_packer *p = g->packer;
    const uint32_t *t = p->view->triangles + 3 * (size_t)c->face;
    fct_packer_add(p, g->piece, c->face);
    for (int k = 0; k < 3; ++k) {
        g->stamps[t[k]] = g->piece;
        --g->live[t[k]];
    }
    g->middle = v3_add(g->middle, v3_load(c->centroid));
    g->normal = v3_add(g->normal, v3_load(c->normal));
    push_neighbours(g, c->face);
}

/* 0: brings no vertex; 1: has a corner that no other free face has; 2: else. *fresh: vertices it brings. */
static int rank_of(const grower *g, uint32_t face, uint32_t *fresh) {
    const uint32_t *t = g->packer->view->triangles + 3 * (size_t)face;
    bool last = false;
    *fresh = 0;
    for (int k = 0; k < 3; ++k) {
        *fresh += g->stamps[t[k]] != g->piece;
        last = last || g->live[t[k]] == 1;
    }
    return *fresh == 0 ? 0 : last ? 1 : 2;
}

/* Whether a face looks away from a piece that is nearly flat: backs of two-sided surfaces share vertices with
 * their fronts, and together nothing could be culled. */
static bool is_opposed(const grower *g, const candidate *c) {
    double flat = 0.8 * g->packer->face_counts[g->piece];
    return g->packer->def.flatness > 0 && v3_dot(v3_load(c->normal), g->normal) < 0 &&
           v3_norm(g->normal) > flat;
}

/* The best face of the front that fits; false where there is none. Drops what is no longer free. */
static bool choose(grower *g, candidate *chosen) {
    const fct_packer *p = g->packer;
    uint32_t best = FCT_NONE, room = p->def.max_vertices - p->vertex_counts[g->piece];
    int best_rank = 3;
    double best_score = INFINITY;
    v3 middle = v3_scale(g->middle, 1.0 / p->face_counts[g->piece]), normal = v3_unit(g->normal);
    for (uint32_t i = 0; i < g->front_count;) {
        const candidate *c = &g->front[i];
        if (!is_free(g, c->face)) {
            g->front[i] = g->front[--g->front_count];
            continue;
        }
        uint32_t fresh, at = i++;
        int rank = rank_of(g, c->face, &fresh);
        if (is_opposed(g, c)) continue;
        if (fresh > room || rank > best_rank || !fct_packer_material(p, c->face, g->piece)) continue;
        double score = v3_norm2(v3_sub(v3_load(c->centroid), middle)) / g->reach;
        score += p->def.flatness * (1 - v3_dot(v3_load(c->normal), normal));
        bool better =
            rank < best_rank || score < best_score || (score == best_score && c->face < g->front[best].face);
        if (better) best = at, best_rank = rank, best_score = score;
    }
    if (best != FCT_NONE) *chosen = g->front[best];
    return best != FCT_NONE;
}

static uint32_t next_free(grower *g) {
    uint32_t faces = g->packer->view->face_count;
    while (g->next_place < faces && !is_free(g, g->next_place)) ++g->next_place;
    return g->next_place < faces ? g->next_place : FCT_NONE;
}

/* Whether a piece without neighbours to take may go on at a face: of its home, within twice the reach, of its
 * direction and material, and with room for it. */
static bool may_jump(const grower *g, uint32_t face, v3 middle, candidate *chosen) {
    const fct_packer *p = g->packer;
    uint32_t fresh;
    rank_of(g, face, &fresh);
    if (fresh > p->def.max_vertices - (uint32_t)p->vertex_counts[g->piece]) return false;
    if (!fct_packer_material(p, face, g->piece)) return false;
    *chosen = describe(p->view, face);
    if (is_opposed(g, chosen)) return false;
    return v3_norm2(v3_sub(v3_load(chosen->centroid), middle)) <= 4 * g->reach;
}

/* The next free place of the tree where the piece may go on. */
static bool jump(grower *g, candidate *chosen) {
    const fct_packer *p = g->packer;
    uint32_t first = p->faces[(size_t)g->piece * p->def.max_triangles], face = next_free(g);
    v3 middle = v3_scale(g->middle, 1.0 / p->face_counts[g->piece]);
    for (int look = 0; look < LOOKS && face < p->view->face_count && p->home[face] == p->home[first];
         ++look, ++face)
        if (is_free(g, face) && may_jump(g, face, middle, chosen)) return true;
    return false;
}

/* Where the next piece begins; FCT_NONE at the end. */
static uint32_t choose_seed(grower *g) {
    const fct_tree_view *view = g->packer->view;
    uint32_t best = FCT_NONE, fewest = UINT32_MAX;
    for (uint32_t i = 0; i < g->front_count; ++i) {
        uint32_t face = g->front[i].face;
        if (!is_free(g, face)) continue;
        const uint32_t *t = view->triangles + 3 * (size_t)face;
        uint64_t sum = (uint64_t)g->live[t[0]] + g->live[t[1]] + g->live[t[2]];
        uint32_t around = sum < UINT32_MAX - 1 ? (uint32_t)sum : UINT32_MAX - 1;
        if (around < fewest || (around == fewest && face < best)) best = face, fewest = around;
    }
    return best != FCT_NONE ? best : next_free(g);
}

static void grow_piece(grower *g, uint32_t seed) {
    fct_packer *p = g->packer;
    candidate next = describe(p->view, seed);
    g->piece = p->count - 1;
    g->reach = fmax((double)p->reach[seed] * (double)p->reach[seed], 1e-300);
    g->middle = g->normal = (v3){0, 0, 0};
    g->front_count = 0;
    do take(g, &next);
    while (p->face_counts[g->piece] < p->def.max_triangles && (choose(g, &next) || jump(g, &next)));
}

static fct_result grow_all(const fct_env *env, grower *g) {
    enum { STEP = 1024 };
    fct_packer *p = g->packer;
    const fct_tree_view *view = p->view;
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) ++g->live[view->triangles[i]];
    memset(g->stamps, 0xFF, view->vertex_count * sizeof *g->stamps);
    memset(p->owner, 0xFF, view->face_count * sizeof *p->owner);
    fct_result result = FCT_OK;
    for (uint32_t seed; result == FCT_OK && (seed = choose_seed(g)) != FCT_NONE;) {
        result = fct_packer_begin(env, p);
        if (result == FCT_OK) grow_piece(g, seed);
        if (result == FCT_OK && p->count % STEP == 0)
            result = fct_progress(env, "meshlets", (double)g->next_place / view->face_count);
    }
    return result;
}

fct_result fct_meshlets_grow(const fct_env *env, fct_packer *packer) {
    grower *g = fct_allocate_zero(env, 1, sizeof *g);
    if (!g) return fct_fail_memory(env, "meshlets");
    g->packer = packer;
    g->live = fct_allocate_zero(env, packer->view->vertex_count, sizeof *g->live);
    g->stamps = fct_allocate(env, packer->view->vertex_count, sizeof *g->stamps);
    fct_result result = g->live && g->stamps ? grow_all(env, g) : fct_fail_memory(env, "meshlets");
    fct_release(env, g->live);
    fct_release(env, g->stamps);
    fct_release(env, g);
    return result;
}
