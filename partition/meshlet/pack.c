/* partition/meshlet/pack.c: makes fewer and fuller pieces.
 *
 * Growth leaves small pieces between full ones. From the smallest piece up:
 * 1. Merge it with the neighbour that shares most vertices with it, if both fit into one piece.
 * 2. Otherwise give its faces to neighbours one by one, first those that bring no new vertex. If some face
 *    finds no place, take all of them back.
 *
 * Pieces without neighbours merge with others that are near in the tree. Serial; O(pieces x limits).
 */
#include "partition/meshlet/pack.h"

#include <string.h>

#include "base/sort.h"

enum { MOST_PASSES = 8, NEAR = 16, SIDES = 3 * FCT_MESHLET_TRIANGLES };

/* Where a face may go through one of its sides: the piece there, which has the face's opposite corner or must
 * add it. */
typedef struct option {
    uint32_t receiver; /* FCT_NONE: no piece */
    uint32_t corner;   /* the corner to add, or FCT_NONE */
} option;

typedef struct move {
    uint32_t face, receiver;
    bool corner_new;
} move;

typedef struct sharing {
    uint32_t count; /* faces without a new place */
    uint32_t faces[FCT_MESHLET_TRIANGLES];
    option options[FCT_MESHLET_TRIANGLES][3];
    uint32_t move_count;
    move moves[FCT_MESHLET_TRIANGLES];
} sharing;

static uint32_t find_vertex(const fct_packer *p, uint32_t piece, uint32_t vertex) {
    const uint32_t *list = p->vertices + (size_t)piece * p->def.max_vertices;
    for (uint32_t i = 0; i < p->vertex_counts[piece]; ++i)
        if (list[i] == vertex) return i;
    return FCT_NONE;
}

static bool has_vertex(const fct_packer *p, uint32_t piece, uint32_t vertex) {
    return find_vertex(p, piece, vertex) != FCT_NONE;
}

void fct_packer_add(fct_packer *p, uint32_t piece, uint32_t face) {
    size_t base = (size_t)piece * p->def.max_vertices;
    p->owner[face] = piece;
    p->faces[(size_t)piece * p->def.max_triangles + p->face_counts[piece]++] = face;
    for (size_t k = 0; k < 3; ++k) {
        uint32_t vertex = p->view->triangles[3 * (size_t)face + k], i = find_vertex(p, piece, vertex);
        if (i == FCT_NONE) {
            i = p->vertex_counts[piece]++;
            p->vertices[base + i] = vertex, p->uses[base + i] = 0;
        }
        ++p->uses[base + i];
    }
}

/* Undoes the last fct_packer_add of a piece. The vertices that it added are the last ones. */
static void remove_last_face(fct_packer *p, uint32_t piece) {
    size_t base = (size_t)piece * p->def.max_vertices;
    uint32_t face = p->faces[(size_t)piece * p->def.max_triangles + --p->face_counts[piece]];
    for (size_t k = 3; k-- > 0;) {
        uint32_t i = find_vertex(p, piece, p->view->triangles[3 * (size_t)face + k]);
        if (--p->uses[base + i] == 0) --p->vertex_counts[piece];
    }
}

/* --- Joining two pieces --- */

/* Whether two pieces fit into one; *shared: the vertices that they share. Stops as soon as they cannot fit.
 */
static bool fit_pieces(const fct_packer *p, uint32_t a, uint32_t b, uint32_t *shared) {
    if ((uint32_t)p->face_counts[a] + p->face_counts[b] > p->def.max_triangles) return false;
    if (!fct_packer_material(p, p->faces[(size_t)a * p->def.max_triangles], b)) return false;
    uint32_t count = p->vertex_counts[a], both = count + p->vertex_counts[b];
    *shared = 0;
    for (uint32_t i = 0; i < count; ++i) {
        if (both - *shared - (count - i) > p->def.max_vertices) return false;
        *shared += has_vertex(p, b, p->vertices[(size_t)a * p->def.max_vertices + i]);
    }
    return both - *shared <= p->def.max_vertices;
}

static void join_pieces(fct_packer *p, uint32_t from, uint32_t to) {
    for (uint32_t i = 0; i < p->face_counts[from]; ++i)
        fct_packer_add(p, to, p->faces[(size_t)from * p->def.max_triangles + i]);
    p->face_counts[from] = 0, p->vertex_counts[from] = 0;
}

/* The other piece at a side of a face of `piece`; FCT_NONE at a border. */
static uint32_t find_across(const fct_packer *p, uint32_t side, uint32_t piece) {
    uint32_t before = p->sides.before[side], after = p->sides.after[side];
    if (before != FCT_NONE && p->owner[before / 3] != piece) return p->owner[before / 3];
    if (after != FCT_NONE && p->owner[after / 3] != piece) return p->owner[after / 3];
    return FCT_NONE;
}

/* Merges a piece with the neighbour that has room for it and shares most vertices with it. */
static bool join_neighbour(fct_packer *p, uint32_t piece) {
    uint32_t seen[SIDES], count = 0, best = FCT_NONE, most = 0;
    const uint32_t *faces = p->faces + (size_t)piece * p->def.max_triangles;
    for (uint32_t i = 0; i < p->face_counts[piece]; ++i)
        for (uint32_t side = 3 * faces[i]; side < 3 * faces[i] + 3; ++side) {
            uint32_t other = find_across(p, side, piece), at = 0, shared;
            while (at < count && seen[at] != other) ++at;
            if (other == FCT_NONE || at < count) continue;
            seen[count++] = other;
            if (!fit_pieces(p, piece, other, &shared) || shared < most) continue;
            if (shared == most && best < other) continue;
            best = other, most = shared;
        }
    if (best != FCT_NONE) join_pieces(p, piece, best);
    return best != FCT_NONE;
}

/* --- Sharing out the faces of a piece --- */

static option find_option(const fct_packer *p, uint32_t side, uint32_t piece) {
    option o = {find_across(p, side, piece), FCT_NONE};
    if (o.receiver == FCT_NONE) return o;
    uint32_t corner = p->view->triangles[side % 3 == 0 ? side + 2 : side - 1];
    if (!fct_packer_material(p, side / 3, o.receiver))
        o.receiver = FCT_NONE;
    else if (!has_vertex(p, o.receiver, corner))
        o.corner = corner;
    return o;
}

/* The best move: first without a new vertex, then to the receiver with most room. */
static bool choose_move(const fct_packer *p, const sharing *s, uint32_t *index, option *chosen) {
    uint32_t best = 0;
    for (uint32_t i = 0; i < s->count; ++i)
        for (int k = 0; k < 3; ++k) {
            option o = s->options[i][k];
            if (o.receiver == FCT_NONE || p->face_counts[o.receiver] >= p->def.max_triangles) continue;
            bool fresh = o.corner != FCT_NONE;
            if (fresh && p->vertex_counts[o.receiver] >= p->def.max_vertices) continue;
            uint32_t room = p->def.max_vertices - p->vertex_counts[o.receiver];
            uint32_t score = 1 + room + (fresh ? 0 : FCT_MESHLET_VERTICES + 1);
            if (score > best) best = score, *index = i, *chosen = o;
        }
    return best > 0;
}

/* Updates the options of the remaining faces after a face moved. */
static void update_options(const fct_packer *p, sharing *s, uint32_t piece, uint32_t face, option moved) {
    for (uint32_t i = 0; i < s->count; ++i)
        for (uint32_t k = 0; k < 3; ++k) {
            option *o = &s->options[i][k];
            uint32_t side = 3 * s->faces[i] + k;
            uint32_t before = p->sides.before[side], after = p->sides.after[side];
            if ((before != FCT_NONE && before / 3 == face) || (after != FCT_NONE && after / 3 == face))
                *o = find_option(p, side, piece);
            else if (o->receiver == moved.receiver && o->corner == moved.corner)
                o->corner = FCT_NONE;
        }
}

static bool distribute_faces(fct_packer *p, uint32_t piece, sharing *s) {
    uint32_t vertices = p->vertex_counts[piece], faces = p->face_counts[piece], index = 0;
    option chosen = {FCT_NONE, FCT_NONE};
    s->count = faces, s->move_count = 0;
    for (uint32_t i = 0; i < faces; ++i) {
        s->faces[i] = p->faces[(size_t)piece * p->def.max_triangles + i];
        for (uint32_t k = 0; k < 3; ++k) s->options[i][k] = find_option(p, 3 * s->faces[i] + k, piece);
    }
    while (s->count > 0 && choose_move(p, s, &index, &chosen)) {
        uint32_t face = s->faces[index];
        fct_packer_add(p, chosen.receiver, face);
        s->moves[s->move_count++] = (move){face, chosen.receiver, chosen.corner != FCT_NONE};
        s->faces[index] = s->faces[--s->count];
        memcpy(s->options[index], s->options[s->count], sizeof s->options[index]);
        update_options(p, s, piece, face, chosen);
    }
    if (s->count == 0) {
        p->face_counts[piece] = 0, p->vertex_counts[piece] = 0;
        return true;
    }
    for (uint32_t i = s->move_count; i-- > 0;) {
        remove_last_face(p, s->moves[i].receiver);
        p->owner[s->moves[i].face] = piece;
    }
    p->face_counts[piece] = (uint16_t)faces, p->vertex_counts[piece] = (uint16_t)vertices;
    return false;
}

/* --- The passes --- */

/* Lists the pieces that are not empty, by number of faces, then by number. */
static uint32_t sort_pieces(const fct_packer *p, uint32_t *order) {
    uint32_t places[FCT_MESHLET_TRIANGLES + 2] = {0}, total = 0;
    for (uint32_t i = 0; i < p->count; ++i) ++places[p->face_counts[i]];
    places[0] = 0;
    for (uint32_t n = 1; n <= p->def.max_triangles; ++n) {
        uint32_t count = places[n];
        places[n] = total;
        total += count;
    }
    for (uint32_t i = 0; i < p->count; ++i)
        if (p->face_counts[i]) order[places[p->face_counts[i]]++] = i;
    return total;
}

/* Skips pieces larger than the mean: to try them too takes three times as long for 1 % fewer pieces. */
static fct_result pack_neighbours(const fct_env *env, fct_packer *p, uint32_t *order, sharing *s) {
    uint32_t removed = 1;
    for (int pass = 0; pass < MOST_PASSES && removed > 0; ++pass) {
        uint32_t count = sort_pieces(p, order), mean = p->view->face_count / count;
        removed = 0;
        for (uint32_t i = 0; i < count; ++i) {
            if (i % 1024 == 0) {
                fct_result result = fct_progress(env, "packing", (double)i / count);
                if (result != FCT_OK) return result;
            }
            if (p->face_counts[order[i]] > mean) break;
            removed += join_neighbour(p, order[i]) || distribute_faces(p, order[i], s);
        }
    }
    return FCT_OK;
}

/* First fit among the last NEAR pieces of the same home, larger pieces first. */
static fct_result pack_near(const fct_env *env, fct_packer *p, uint32_t *order) {
    uint64_t *keys = fct_allocate(env, p->count, sizeof *keys);
    if (!keys) return fct_fail_memory(env, "packing meshlets");
    uint32_t count = 0, recent[NEAR], kept = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        if (!p->face_counts[i]) continue;
        uint64_t home = p->home[p->faces[(size_t)i * p->def.max_triangles]];
        keys[count] = home << 10 | (FCT_MESHLET_TRIANGLES - p->face_counts[i]);
        order[count++] = i;
    }
    fct_result result = fct_sort_pairs(env, keys, order, count);
    for (uint32_t i = 0; i < count && result == FCT_OK; ++i) {
        uint32_t piece = order[i], at = 0, shared;
        if (i > 0 && keys[i] >> 10 != keys[i - 1] >> 10) kept = 0;
        while (at < kept && !fit_pieces(p, piece, recent[at], &shared)) ++at;
        if (at < kept) {
            join_pieces(p, piece, recent[at]);
        } else {
            if (kept == NEAR) memmove(recent, recent + 1, --kept * sizeof *recent);
            recent[kept++] = piece;
        }
    }
    fct_release(env, keys);
    return result;
}

fct_result fct_meshlets_pack(const fct_env *env, fct_packer *packer) {
    uint32_t *order;
    sharing *s;
    const fct_array arrays[] = {FCT_ARRAY(order, packer->count), FCT_ARRAY(s, 1)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "packing meshlets");
    if (result == FCT_OK) result = pack_neighbours(env, packer, order, s);
    if (result == FCT_OK) result = pack_near(env, packer, order);
    fct_release_all(env, arrays, FCT_LENGTH(arrays));
    return result;
}
