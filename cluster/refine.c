/* cluster/refine.c: faces on the borders of a partition change sides.
 *
 * Energy: 2 sum (A_c - |S_c|), the squared deviation of unit normals from their cluster's mean (L2,1), plus
 * a weight times sum P_c^2 / (4 pi), which is area times irregularity; the weight is in units of the ratio of
 * the two at the start, so it is the same for every scale, mesh and number of clusters.
 * A sweep moves each face at most once, the largest gain first (an indexed heap; a plain pass over the faces
 * gains a quarter less). Gains are taken anew when a face's turn comes. A face leaves only where a search
 * finds its neighbours of the cluster still connected without it: nearly always around one of its corners,
 * within 30 faces; a search that sees SEARCH faces in vain refuses. O(F) and O(B log B) a sweep, B on
 * borders.
 */
#include <math.h>
#include <string.h>

#include "base/heap.h"
#include "base/vec.h"
#include "cluster/labels.h"
#include "facetree/cluster.h"
#include "facetree/dual.h"

/* Faces that a search may see, and borders with other clusters that a face is moved across: it has at most
 * six neighbours. */
enum { SEARCH = 512, SIDES = 6 };

typedef struct region {
    v3 vector; /* S */
    double perimeter;
    uint32_t count;
} region;

/* A face's best change of side: gain is what the energy falls by, 0 where nothing is to be had. */
typedef struct step {
    double gain, squares; /* squares: growth of the sum of squared perimeters */
    uint32_t to;
} step;

typedef struct refiner {
    const fct_mesh *mesh;
    fct_dual dual;
    uint32_t *first, *neighbours; /* those of face f are places [first[f], first[f + 1]) */
    float *lengths;               /* of the border with each neighbour */
    uint32_t *labels;
    region *regions;
    uint32_t region_count;
    uint32_t *seen, search; /* the search that saw a face last; the number of the latest */
    uint32_t *moved, sweep; /* the sweep in which a face moved last; the current one */
    fct_heap heap;          /* faces that gain, the most first */
    double weight;          /* of squared perimeters */
    double squares, most_squares;
    uint32_t queue[SEARCH + SIDES];
} refiner;

fct_refine_def fct_refine_def_default(void) {
    return (fct_refine_def){
        .size = sizeof(fct_refine_def), .sweep_count = 4, .perimeter_weight = 0.1, .irregularity_limit = 1};
}

static v3 area_vector(const fct_mesh *mesh, uint32_t face) {
    const uint32_t *t = mesh->triangles + 3 * (size_t)face;
    v3 p = v3_load(mesh->positions + 3 * (size_t)t[0]), q = v3_load(mesh->positions + 3 * (size_t)t[1]),
       r = v3_load(mesh->positions + 3 * (size_t)t[2]);
    return v3_scale(v3_cross(v3_sub(q, p), v3_sub(r, p)), 0.5);
}

/* |s + a| - |s|, without the digits that the difference loses. */
static double growth(v3 s, v3 a) {
    double length = v3_norm(v3_add(s, a)) + v3_norm(s);
    return length > 0 ? (2 * v3_dot(s, a) + v3_dot(a, a)) / length : 0;
}

/* (p + d)^2 - p^2 */
static double square_growth(double p, double d) {
    return d * (2 * p + d);
}

static bool same_material(const refiner *r, uint32_t a, uint32_t b) {
    return !r->mesh->materials || r->mesh->materials[a] == r->mesh->materials[b];
}

/* Border of the face with each cluster around it. */
typedef struct fringe {
    uint32_t count, labels[SIDES];
    double lengths[SIDES];
    bool open[SIDES]; /* a neighbour there has the face's material */
    double own;       /* with its own cluster */
} fringe;

static void look_around(const refiner *r, uint32_t face, fringe *out) {
    out->count = 0, out->own = 0;
    for (uint32_t i = r->first[face]; i < r->first[face + 1]; ++i) {
        uint32_t other = r->neighbours[i], label = r->labels[other], k = 0;
        if (label == r->labels[face]) {
            out->own += (double)r->lengths[i];
            continue;
        }
        while (k < out->count && out->labels[k] != label) ++k;
        if (k == SIDES) continue;
        if (k == out->count) {
            ++out->count;
            out->labels[k] = label, out->lengths[k] = 0, out->open[k] = false;
        }
        out->lengths[k] += (double)r->lengths[i];
        out->open[k] = out->open[k] || same_material(r, face, other);
    }
}

/* Gains that are lost in the rounding of their parts are none: on even ground nothing moves for nothing. (The
 * lengths of borders are floats.) */
static step best_step(const refiner *r, uint32_t face) {
    step best = {0, 0, FCT_NONE};
    const region *from = &r->regions[r->labels[face]];
    fringe around;
    if (from->count == 1) return best;
    look_around(r, face, &around);
    if (around.count == 0) return best;
    v3 a = area_vector(r->mesh, face);
    double area = v3_norm(a), perimeter = (double)r->dual.perimeters[face];
    double leave = growth(from->vector, v3_scale(a, -1));
    double left = square_growth(from->perimeter, 2 * around.own - perimeter);
    for (uint32_t k = 0; k < around.count; ++k) {
        if (!around.open[k]) continue;
        const region *to = &r->regions[around.labels[k]];
        double entered = square_growth(to->perimeter, perimeter - 2 * around.lengths[k]);
        double gain = 2 * (leave + growth(to->vector, a)) - r->weight * (left + entered);
        double rounding = 1e-12 * (area + fabs(leave)) + 1e-6 * r->weight * (fabs(left) + fabs(entered));
        if (!(gain > rounding) || gain < best.gain) continue;
        if (gain == best.gain && around.labels[k] > best.to) continue;
        if (left + entered > 0 && !(r->squares + left + entered <= r->most_squares)) continue;
        best = (step){gain, left + entered, around.labels[k]};
    }
    return best;
}

static bool is_neighbour(const refiner *r, uint32_t face, uint32_t other) {
    for (uint32_t i = r->first[face]; i < r->first[face + 1]; ++i)
        if (r->neighbours[i] == other) return true;
    return false;
}

/* Whether the neighbours of the face in its own cluster stay connected when it leaves: a search, breadth
 * first, from one of them through the cluster. */
static bool may_leave(refiner *r, uint32_t face) {
    uint32_t label = r->labels[face], start = FCT_NONE, missing = 0, head = 0, tail = 0;
    for (uint32_t i = r->first[face]; i < r->first[face + 1]; ++i) {
        if (r->labels[r->neighbours[i]] != label) continue;
        if (start == FCT_NONE)
            start = r->neighbours[i];
        else
            ++missing;
    }
    if (missing == 0) return true;
    if (++r->search == 0) {
        memset(r->seen, 0, (size_t)r->mesh->face_count * sizeof *r->seen);
        r->search = 1;
    }
    r->seen[face] = r->seen[start] = r->search;
    r->queue[tail++] = start;
    while (head < tail && tail < SEARCH) {
        uint32_t at = r->queue[head++];
        for (uint32_t i = r->first[at]; i < r->first[at + 1]; ++i) {
            uint32_t next = r->neighbours[i];
            if (r->labels[next] != label || r->seen[next] == r->search) continue;
            r->seen[next] = r->search;
            if (tail < SEARCH + SIDES) r->queue[tail++] = next;
            if (is_neighbour(r, face, next) && --missing == 0) return true;
        }
    }
    return false;
}

static void move(refiner *r, uint32_t face, const step *s) {
    region *from = &r->regions[r->labels[face]], *to = &r->regions[s->to];
    fringe around;
    look_around(r, face, &around);
    uint32_t k = 0;
    while (around.labels[k] != s->to) ++k;
    v3 a = area_vector(r->mesh, face);
    double perimeter = (double)r->dual.perimeters[face];
    from->vector = v3_sub(from->vector, a);
    from->perimeter += 2 * around.own - perimeter;
    --from->count;
    to->vector = v3_add(to->vector, a);
    to->perimeter += perimeter - 2 * around.lengths[k];
    ++to->count;
    r->squares += s->squares;
    r->labels[face] = s->to;
    r->moved[face] = r->sweep;
}

/* A larger gain is a smaller key: the bits of positive doubles are in their order. */
static uint64_t key_of(double gain) {
    uint64_t bits;
    memcpy(&bits, &gain, sizeof bits);
    return ~bits;
}

/* Returns how many faces moved. */
static uint64_t sweep(refiner *r) {
    uint64_t moves = 0;
    ++r->sweep;
    for (uint32_t f = 0; f < r->mesh->face_count; ++f) {
        double gain = best_step(r, f).gain;
        if (gain > 0) fct_heap_append(&r->heap, f, key_of(gain));
    }
    fct_heap_order(&r->heap);
    for (uint32_t f; (f = fct_heap_pop(&r->heap)) != FCT_NONE;) {
        step s = best_step(r, f);
        if (!(s.gain > 0) || !may_leave(r, f)) continue;
        move(r, f, &s);
        ++moves;
        for (uint32_t i = r->first[f]; i < r->first[f + 1]; ++i) {
            uint32_t next = r->neighbours[i];
            if (r->moved[next] == r->sweep) continue;
            double gain = best_step(r, next).gain;
            if (gain > 0)
                fct_heap_set(&r->heap, next, key_of(gain));
            else
                fct_heap_remove(&r->heap, next);
        }
    }
    return moves;
}

/* Neighbours of each face in order of their id, and the borders with them, in place of the dual's edges. */
static void list_neighbours(const fct_env *env, refiner *r) {
    fct_dual *dual = &r->dual;
    memset(r->first, 0, ((size_t)dual->face_count + 1) * sizeof *r->first);
    for (size_t e = 0; e < 2 * (size_t)dual->edge_count; ++e) ++r->first[dual->edges[e]];
    uint32_t end = 0;
    for (uint32_t f = 0; f <= dual->face_count; ++f) {
        uint32_t count = f < dual->face_count ? r->first[f] : 0;
        r->first[f] = end;
        end += count;
    }
    /* Edges are sorted by their lesser face, then by the greater: first the lesser neighbours of every face,
     * then the greater ones, which its own run of edges holds. */
    memcpy(r->seen, r->first, (size_t)dual->face_count * sizeof *r->seen);
    for (int greater = 0; greater < 2; ++greater)
        for (uint32_t e = 0; e < dual->edge_count; ++e) {
            uint32_t at = dual->edges[2 * (size_t)e + !greater], other = dual->edges[2 * (size_t)e + greater];
            uint32_t place = r->seen[at]++;
            r->neighbours[place] = other;
            r->lengths[place] = dual->lengths[e];
        }
    memset(r->seen, 0, (size_t)dual->face_count * sizeof *r->seen);
    fct_release(env, dual->edges);
    fct_release(env, dual->lengths);
    dual->edges = NULL, dual->lengths = NULL;
}

/* Sums of the clusters, and what the weight and the limit come to. */
static void prepare(refiner *r, const fct_refine_def *def) {
    const fct_dual *dual = &r->dual;
    double area = 0, deviation = 0;
    for (uint32_t f = 0; f < dual->face_count; ++f) {
        region *at = &r->regions[r->labels[f]];
        v3 a = area_vector(r->mesh, f);
        area += v3_norm(a);
        at->vector = v3_add(at->vector, a);
        at->perimeter += (double)dual->perimeters[f];
        ++at->count;
        for (uint32_t i = r->first[f]; i < r->first[f + 1]; ++i)
            if (r->labels[r->neighbours[i]] == r->labels[f]) at->perimeter -= (double)r->lengths[i];
    }
    deviation = 2 * area;
    for (uint32_t i = 0; i < r->region_count; ++i) {
        deviation -= 2 * v3_norm(r->regions[i].vector);
        r->squares += r->regions[i].perimeter * r->regions[i].perimeter;
    }
    /* On flat ground all deviation is rounding, and borders may still be straightened. */
    deviation = fmax(deviation, 1e-6 * area);
    r->weight = r->squares > 0 ? def->perimeter_weight * deviation / r->squares : 0;
    r->most_squares = isinf(def->irregularity_limit) ? INFINITY : r->squares * def->irregularity_limit;
}

static fct_result allocate(const fct_env *env, refiner *r) {
    size_t faces = r->mesh->face_count, ends = 2 * (size_t)r->dual.edge_count;
    if (ends > UINT32_MAX)
        return fct_fail(env, FCT_ERROR_DATA, "%zu sides of faces with neighbours, at most %u can be refined",
                        ends, UINT32_MAX);
    r->first = fct_allocate(env, faces + 1, sizeof *r->first);
    r->neighbours = fct_allocate(env, ends, sizeof *r->neighbours);
    r->lengths = fct_allocate(env, ends, sizeof *r->lengths);
    r->labels = fct_allocate(env, faces, sizeof *r->labels);
    r->regions = fct_allocate_zero(env, r->region_count, sizeof *r->regions);
    r->seen = fct_allocate(env, faces, sizeof *r->seen);
    r->moved = fct_allocate_zero(env, faces, sizeof *r->moved);
    if (r->first && r->neighbours && r->lengths && r->labels && r->regions && r->seen && r->moved)
        return FCT_OK;
    return fct_fail_memory(env, "refining a partition");
}

static void release(const fct_env *env, refiner *r) {
    fct_dual_release(env, &r->dual);
    fct_heap_release(env, &r->heap);
    fct_release(env, r->first);
    fct_release(env, r->neighbours);
    fct_release(env, r->lengths);
    fct_release(env, r->labels);
    fct_release(env, r->regions);
    fct_release(env, r->seen);
    fct_release(env, r->moved);
    fct_release(env, r);
}

static fct_result run_sweeps(const fct_env *env, refiner *r, const fct_refine_def *def,
                             fct_refine_stats *stats) {
    for (uint32_t i = 0; i < def->sweep_count; ++i) {
        fct_result result = fct_progress(env, "refine", (double)i / def->sweep_count);
        if (result != FCT_OK) return result;
        uint64_t moves = sweep(r);
        stats->sweeps = i + 1;
        stats->moves += moves;
        if (moves == 0) break;
    }
    return fct_progress(env, "refine", 1);
}

static fct_result check_def(const fct_env *env, const fct_refine_def *def) {
    if (def->size != sizeof *def)
        return fct_fail(env, FCT_ERROR_DATA, "fct_refine_def has size %u, this library's is %zu", def->size,
                        sizeof *def);
    if (!(def->perimeter_weight >= 0 && def->perimeter_weight <= 1e6))
        return fct_fail(env, FCT_ERROR_DATA, "a perimeter weight of %g, expected 0 to 1e6",
                        def->perimeter_weight);
    if (!(def->irregularity_limit >= 1))
        return fct_fail(env, FCT_ERROR_DATA, "an irregularity limit of %g, expected at least 1",
                        def->irregularity_limit);
    return FCT_OK;
}

fct_result fct_partition_refine(const fct_env *env, const fct_mesh *mesh, uint32_t count,
                                const fct_refine_def *def, uint32_t *labels, fct_refine_stats *stats) {
    fct_refine_def options = def ? *def : fct_refine_def_default();
    fct_refine_stats done = {0};
    fct_result result = check_def(env, &options);
    if (result == FCT_OK) result = fct_labels_check(env, mesh, labels, count);
    if (result != FCT_OK) return result;
    if (mesh->face_count == 0) {
        if (stats) *stats = done;
        return FCT_OK;
    }
    refiner *r = fct_allocate_zero(env, 1, sizeof *r);
    if (!r) return fct_fail_memory(env, "refining a partition");
    r->mesh = mesh;
    r->region_count = count;
    double start = fct_seconds();
    result = fct_dual_build(env, mesh, &r->dual);
    if (result == FCT_OK) result = allocate(env, r);
    if (result == FCT_OK) {
        memcpy(r->labels, labels, (size_t)mesh->face_count * sizeof *labels);
        list_neighbours(env, r);
        prepare(r, &options);
        result = fct_heap_create(env, mesh->face_count, &r->heap);
    }
    if (result == FCT_OK) {
        done.seconds_dual = fct_seconds() - start;
        result = run_sweeps(env, r, &options, &done);
        done.seconds_sweeps = fct_seconds() - start - done.seconds_dual;
    }
    if (result == FCT_OK) {
        memcpy(labels, r->labels, (size_t)mesh->face_count * sizeof *labels);
        if (stats) *stats = done;
    }
    release(env, r);
    return result;
}
