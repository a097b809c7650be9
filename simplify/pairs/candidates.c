/* simplify/pairs/candidates.c: see candidates.h. Garland 1999, section 3.2.1, with pairs between bodies only,
 * as in the other scheme that he quotes (Popovic and Hoppe). So a sheet is not glued to its own other side,
 * and neighbours along a surface are no pairs.
 *
 * 1. A binary tree of boxes over the points in their order, which is that of the curve. A node lists its
 *    bodies if they are few.
 * 2. Each point searches the tree. It skips nodes that are too far away, and nodes of which each body is its
 *    own or has a nearer point already. So the insides of bodies are skipped.
 * 3. A pair that both points found counts once.
 * Memory: linear. Cost: near-linear, because no point finds more than PAIR_BODIES others.
 */
#include "simplify/pairs/candidates.h"

#include "base/parallel.h"
#include "simplify/cost/constraint.h"

/* A body encloses a volume if this is more than the part of its area to the power 3/2. */
#define LEAST_VOLUME 1e-7

enum { LEAF = 8 /* points */, NODE_BODIES = 8, MANY = NODE_BODIES + 1, CHUNK = 1024 /* points per task */ };

typedef struct pair_node {
    float lower[3], upper[3];
    uint32_t bodies[NODE_BODIES], body_count; /* MANY: they are not listed */
} pair_node;

typedef struct pair_finder {
    fct_simplifier *s;
    uint32_t *bodies; /* per point: its body, FCT_NONE if it makes no pairs */
    pair_node *nodes; /* nodes 2 i and 2 i + 1 are the children of node i; node leaf_count + i is leaf i */
    uint32_t leaf_count;
    double limit2;
    uint32_t *found; /* per point: PAIR_BODIES points, FCT_NONE at the end */
} pair_finder;

/* The points that were found, one per body. */
typedef struct nearest_points {
    uint32_t count;
    uint32_t points[PAIR_BODIES], bodies[PAIR_BODIES];
    double distance2[PAIR_BODIES];
} nearest_points;

static const float *find_place(const fct_simplifier *s, uint32_t point) {
    return s->mesh->positions + 3 * (size_t)point_at(s, point)->source;
}

static void find_bodies(fct_simplifier *s, uint32_t *bodies) {
    fct_sets_create(bodies, s->point_count);
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; c += 3) {
        if (corner_dead(s, c)) continue;
        fct_sets_join(bodies, s->triangles[c], s->triangles[c + 1]);
        fct_sets_join(bodies, s->triangles[c], s->triangles[c + 2]);
    }
    for (uint32_t p = 0; p < s->point_count; ++p) bodies[p] = fct_sets_find(bodies, p);
}

/* Finds out which bodies are closed, and the side of their faces on which the volume lies. */
static fct_result find_solids(fct_simplifier *s, const uint32_t *bodies) {
    double *volumes, *areas;
    bool *open;
    const fct_array scratch[] = {FCT_ARRAY_ZERO(volumes, s->point_count),
                                 FCT_ARRAY_ZERO(areas, s->point_count), FCT_ARRAY_ZERO(open, s->point_count)};
    fct_result result = fct_allocate_all(s->env, scratch, FCT_LENGTH(scratch), "bodies");
    if (result != FCT_OK) return result;
    for (uint32_t e = 0; e < s->first_pair; ++e)
        if (s->edge_flags[e] & EDGE_BOUNDARY) open[bodies[s->edges[e].ends[0]]] = true;
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; c += 3) {
        if (corner_dead(s, c)) continue;
        uint32_t body = bodies[s->triangles[c]];
        v3 o = point_position(s, body), x = v3_sub(point_position(s, s->triangles[c]), o);
        v3 y = v3_sub(point_position(s, s->triangles[c + 1]), o);
        v3 z = v3_sub(point_position(s, s->triangles[c + 2]), o);
        areas[body] += .5 * v3_norm(v3_cross(v3_sub(y, x), v3_sub(z, x)));
        volumes[body] += v3_dot(x, v3_cross(y, z)) / 6;
    }
    for (uint32_t p = 0; p < s->point_count; ++p) {
        uint32_t body = bodies[p];
        bool encloses = fabs(volumes[body]) > LEAST_VOLUME * areas[body] * sqrt(areas[body]);
        s->solids[p] = open[body] || !encloses ? SOLID_NONE : volumes[body] > 0 ? SOLID : SOLID_INSIDE_OUT;
    }
    fct_release_all(s->env, scratch, FCT_LENGTH(scratch));
    return FCT_OK;
}

/* ---- The tree ---- */

static void begin_node(pair_node *n) {
    n->body_count = 0;
    for (int k = 0; k < 3; ++k) n->lower[k] = INFINITY, n->upper[k] = -INFINITY;
}

static void add_body(pair_node *n, uint32_t body) {
    for (uint32_t i = 0; i < n->body_count && i < NODE_BODIES; ++i)
        if (n->bodies[i] == body) return;
    if (n->body_count < NODE_BODIES) n->bodies[n->body_count] = body;
    if (n->body_count < MANY) ++n->body_count;
}

static void fill_leaf(const pair_finder *f, uint32_t leaf, pair_node *n) {
    uint32_t end = (leaf + 1) * LEAF < f->s->point_count ? (leaf + 1) * LEAF : f->s->point_count;
    begin_node(n);
    for (uint32_t p = leaf * LEAF; p < end; ++p) {
        if (f->bodies[p] == FCT_NONE) continue;
        const float *at = find_place(f->s, p);
        for (int k = 0; k < 3; ++k) {
            n->lower[k] = at[k] < n->lower[k] ? at[k] : n->lower[k];
            n->upper[k] = at[k] > n->upper[k] ? at[k] : n->upper[k];
        }
        add_body(n, f->bodies[p]);
    }
}

static void join_nodes(const pair_node *a, const pair_node *b, pair_node *n) {
    *n = *a;
    for (int k = 0; k < 3; ++k) {
        n->lower[k] = b->lower[k] < n->lower[k] ? b->lower[k] : n->lower[k];
        n->upper[k] = b->upper[k] > n->upper[k] ? b->upper[k] : n->upper[k];
    }
    for (uint32_t i = 0; i < b->body_count && i < NODE_BODIES; ++i) add_body(n, b->bodies[i]);
    if (b->body_count == MANY) n->body_count = MANY;
}

static fct_result make_tree(pair_finder *f) {
    f->leaf_count = 1;
    while ((uint64_t)f->leaf_count * LEAF < f->s->point_count) f->leaf_count *= 2;
    f->nodes = fct_allocate(f->s->env, 2 * (size_t)f->leaf_count, sizeof *f->nodes);
    if (!f->nodes) return fct_fail_memory(f->s->env, "pairs of points");
    for (uint32_t i = 0; i < f->leaf_count; ++i)
        if ((uint64_t)i * LEAF < f->s->point_count)
            fill_leaf(f, i, &f->nodes[f->leaf_count + i]);
        else
            begin_node(&f->nodes[f->leaf_count + i]);
    for (uint32_t i = f->leaf_count; i-- > 1;)
        join_nodes(&f->nodes[2 * (size_t)i], &f->nodes[2 * (size_t)i + 1], &f->nodes[i]);
    return FCT_OK;
}

/* ---- The search ---- */

static bool is_nearer(double distance2, uint32_t point, double other2, uint32_t other) {
    return distance2 < other2 || (distance2 == other2 && point < other);
}

static uint32_t find_farthest(const nearest_points *n) {
    uint32_t far = 0;
    for (uint32_t i = 1; i < n->count; ++i)
        if (is_nearer(n->distance2[far], n->points[far], n->distance2[i], n->points[i])) far = i;
    return far;
}

static void add_point(nearest_points *n, uint32_t point, uint32_t body, double distance2) {
    uint32_t place = 0;
    while (place < n->count && n->bodies[place] != body) ++place;
    if (place == n->count && n->count == PAIR_BODIES) place = find_farthest(n);
    if (place < n->count && !is_nearer(distance2, point, n->distance2[place], n->points[place])) return;
    if (place == n->count) ++n->count;
    n->points[place] = point, n->bodies[place] = body, n->distance2[place] = distance2;
}

/* The squared distance of a node's box. Rounding is monotonic, so no point inside has a smaller one. */
static double find_box_distance2(const pair_node *n, const float at[3]) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        double below = (double)n->lower[k] - at[k], above = (double)at[k] - n->upper[k];
        double d = below > 0 ? below : above > 0 ? above : 0;
        sum += d * d;
    }
    return sum;
}

static uint32_t find_first_point(const pair_finder *f, uint32_t node) {
    while (node < f->leaf_count) node *= 2;
    return (node - f->leaf_count) * LEAF;
}

/* Whether a node may hold a point to add: `distance2` is that of its box. Of many points at one place, those
 * with higher numbers are not looked at. */
static bool is_wanted(const pair_finder *f, uint32_t node, uint32_t own, const nearest_points *near,
                      double distance2) {
    const pair_node *n = &f->nodes[node];
    if (n->body_count == 0 || distance2 > f->limit2) return false;
    if (near->count == PAIR_BODIES) {
        uint32_t far = find_farthest(near);
        if (!is_nearer(distance2, find_first_point(f, node), near->distance2[far], near->points[far]))
            return false;
    }
    if (n->body_count == MANY) return true;
    for (uint32_t i = 0; i < n->body_count; ++i) {
        bool known = n->bodies[i] == own;
        for (uint32_t k = 0; k < near->count && !known; ++k)
            known = near->bodies[k] == n->bodies[i] && near->distance2[k] < distance2;
        if (!known) return true;
    }
    return false;
}

static void search_leaf(const pair_finder *f, uint32_t leaf, uint32_t point, nearest_points *near) {
    const float *at = find_place(f->s, point);
    uint32_t end = (leaf + 1) * LEAF < f->s->point_count ? (leaf + 1) * LEAF : f->s->point_count;
    for (uint32_t q = leaf * LEAF; q < end; ++q) {
        if (f->bodies[q] == FCT_NONE || f->bodies[q] == f->bodies[point]) continue;
        const float *other = find_place(f->s, q);
        double sum = 0;
        for (int k = 0; k < 3; ++k) sum += ((double)at[k] - other[k]) * ((double)at[k] - other[k]);
        if (sum <= f->limit2) add_point(near, q, f->bodies[q], sum);
    }
}

static void search_tree(const pair_finder *f, uint32_t point, nearest_points *near) {
    uint32_t stack[64], depth = 0; /* one node per level waits */
    const float *at = find_place(f->s, point);
    stack[depth++] = 1;
    while (depth > 0) {
        uint32_t i = stack[--depth];
        const pair_node *n = &f->nodes[i];
        if (!is_wanted(f, i, f->bodies[point], near, find_box_distance2(n, at))) continue;
        if (i >= f->leaf_count) {
            search_leaf(f, i - f->leaf_count, point, near);
            continue;
        }
        bool second_nearer =
            find_box_distance2(&f->nodes[2 * i + 1], at) < find_box_distance2(&f->nodes[2 * i], at);
        stack[depth++] = 2 * i + !second_nearer;
        stack[depth++] = 2 * i + second_nearer;
    }
}

static void search_points(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const pair_finder *f = user;
    for (size_t p = begin; p < end; ++p) {
        nearest_points near = {0};
        if (f->bodies[p] != FCT_NONE) search_tree(f, (uint32_t)p, &near);
        uint32_t *out = f->found + PAIR_BODIES * p;
        for (uint32_t i = 0; i < PAIR_BODIES; ++i) out[i] = i < near.count ? near.points[i] : FCT_NONE;
    }
}

/* ---- The pairs ---- */

static bool has_found(const pair_finder *f, uint32_t point, uint32_t other) {
    for (uint32_t i = 0; i < PAIR_BODIES; ++i)
        if (f->found[(size_t)PAIR_BODIES * point + i] == other) return true;
    return false;
}

static void append_entry(fct_simplifier *s, uint32_t point, uint32_t entry) {
    s->next_pairs[entry] = FCT_NONE;
    if (s->first_pairs[point] == FCT_NONE)
        s->first_pairs[point] = entry;
    else
        s->next_pairs[s->last_pairs[point]] = entry;
    s->last_pairs[point] = entry;
}

/* Writes the pairs to `edges`, or only counts them if that is NULL. */
static size_t list_pairs(const pair_finder *f, fct_edge *edges) {
    fct_simplifier *s = f->s;
    size_t count = 0;
    for (uint32_t p = 0; p < s->point_count; ++p)
        for (uint32_t i = 0; i < PAIR_BODIES; ++i) {
            uint32_t q = f->found[(size_t)PAIR_BODIES * p + i];
            if (q == FCT_NONE) break;
            if (q < p && has_found(f, q, p)) continue;
            uint32_t e = (uint32_t)(s->first_pair + count++);
            if (!edges) continue;
            edges[e] = (fct_edge){.ends = {p, q}, .parent = e};
            append_entry(s, p, 2 * (e - s->first_pair));
            append_entry(s, q, 2 * (e - s->first_pair) + 1);
        }
    return count;
}

static fct_result append_pairs(const pair_finder *f) {
    fct_simplifier *s = f->s;
    size_t count = list_pairs(f, NULL), edge_count = s->first_pair + count;
    if (edge_count >= FCT_NONE / 2) return fct_fail_memory(s->env, "more than 2^31 pairs of points");
    fct_edge *edges;
    const fct_array arrays[] = {FCT_ARRAY(edges, edge_count), FCT_ARRAY(s->next_pairs, 2 * count),
                                FCT_ARRAY(s->first_pairs, s->point_count),
                                FCT_ARRAY(s->last_pairs, s->point_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "pairs of points");
    if (result != FCT_OK) return result;
    memcpy(edges, s->edges, s->first_pair * sizeof *edges);
    memset(s->first_pairs, 0xff, s->point_count * sizeof *s->first_pairs);
    memset(s->last_pairs, 0xff, s->point_count * sizeof *s->last_pairs);
    list_pairs(f, edges);
    fct_release(s->env, s->edges);
    s->edges = edges;
    s->edge_count = (uint32_t)edge_count;
    return FCT_OK;
}

static fct_result find_pairs(pair_finder *f) {
    fct_simplifier *s = f->s;
    find_bodies(s, f->bodies);
    fct_result result = find_solids(s, f->bodies);
    if (result != FCT_OK) return result;
    for (uint32_t p = 0; p < s->point_count; ++p) {
        uint32_t valence = point_at(s, p)->valence;
        if (valence == 0 || valence > SIMPLIFY_HUB || point_is_locked(s, p)) f->bodies[p] = FCT_NONE;
    }
    result = make_tree(f);
    if (result == FCT_OK)
        result = fct_parallel_for_progress(s->env, "pairs", s->point_count, CHUNK, search_points, f);
    return result == FCT_OK ? append_pairs(f) : result;
}

fct_result fct_simplify_pairs(fct_simplifier *s) {
    s->first_pair = s->edge_count;
    if (!(s->def->pair_distance > 0)) return FCT_OK;
    double limit = s->def->pair_distance + s->step;
    pair_finder f = {.s = s, .limit2 = limit * limit};
    const fct_array scratch[] = {FCT_ARRAY(f.bodies, s->point_count),
                                 FCT_ARRAY(f.found, (size_t)PAIR_BODIES * s->point_count)};
    const fct_array arrays[] = {FCT_ARRAY(s->solids, s->point_count),
                                FCT_ARRAY_ZERO(s->walled, s->point_count)};
    fct_result result = fct_allocate_all(s->env, scratch, FCT_LENGTH(scratch), "pairs of points");
    if (result != FCT_OK) return result;
    result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "pairs of points");
    if (result == FCT_OK) result = find_pairs(&f);
    fct_release(s->env, f.nodes);
    fct_release_all(s->env, scratch, FCT_LENGTH(scratch));
    return result;
}
