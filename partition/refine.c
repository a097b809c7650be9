/* partition/refine.c: moves units across the borders of a partition.
 *
 * Energy: E = 2 sum (A_c - |S_c|) + w sum P_c^2 over the clusters c. The first sum is the squared deviation
 * of unit normals from the mean normal of their cluster (L2,1); P_c^2 / (4 pi) is area times irregularity
 * (8.16). w is perimeter_weight times the ratio of the two sums at the start, so it does not depend on scale,
 * mesh or number of clusters.
 *
 * Units are the clusters of finer cuts of the tree and at last the faces, because a border of single faces
 * would have to grow longer before it could reach a better place. A sweep moves each unit at most once,
 * largest gain first, by an indexed heap; the gain is computed again when the unit's turn comes. A unit
 * leaves only if its neighbours in the cluster stay connected without it. O(F) and O(B log B) per sweep, B
 * units on borders.
 */
#include <math.h>
#include <string.h>

#include "base/heap.h"
#include "base/key.h"
#include "cluster/tree/node.h"
#include "facetree/partition.h"
#include "partition/labels.h"
#include "partition/units.h"

enum {
    SEARCH = 2048, /* borders that a search for connections may visit; a longer search refuses the move */
    SIDES = 16,    /* clusters that a unit may choose from; a face has at most six */
    WIDE = 256,    /* a unit with more neighbours is not priced again when one of them moves */
    COARSEST = 4   /* units per cluster in the first cut; each finer cut has as many units per unit */
};

typedef struct region {
    v3 vector; /* S */
    double perimeter;
    uint32_t count; /* units */
} region;

/* The best move of a unit: `gain` is the decrease of the energy, 0 if no move decreases it. */
typedef struct step {
    double gain, squares; /* squares: increase of the sum of squared perimeters */
    uint32_t to;
} step;

/* Arrays per unit have room for all faces. */
typedef struct refiner {
    const fct_units *units;
    uint32_t *labels;
    region *regions;
    uint32_t region_count;
    uint32_t *seen, *wanted, search; /* per unit: the last search that saw or wanted it; the current search */
    uint32_t *moved, sweep;          /* per unit: the last sweep that moved it; the current sweep */
    fct_heap heap;                   /* units that gain, largest gain first */
    double weight;                   /* of squared perimeters */
    double squares, most_squares;
    uint32_t queue[SEARCH + 1];
} refiner;

fct_refine_def fct_refine_def_default(void) {
    return (fct_refine_def){
        .size = sizeof(fct_refine_def), .sweep_count = 4, .perimeter_weight = 0.1, .irregularity_limit = 1};
}

/* |s + a| - |s|, without cancellation. */
static double grow_length(v3 s, v3 a) {
    double length = v3_norm(v3_add(s, a)) + v3_norm(s);
    return length > 0 ? (2 * v3_dot(s, a) + v3_dot(a, a)) / length : 0;
}

/* (p + d)^2 - p^2 */
static double grow_square(double p, double d) {
    return d * (2 * p + d);
}

/* Borders of a unit with the clusters around it. */
typedef struct fringe {
    uint32_t count, labels[SIDES];
    double lengths[SIDES];
    bool open[SIDES]; /* the unit may join: a neighbour there has its material */
    double own;       /* border with its own cluster */
} fringe;

static void list_borders(const refiner *r, uint32_t unit, fringe *out) {
    const fct_units *units = r->units;
    out->count = 0, out->own = 0;
    for (uint32_t i = units->first[unit]; i < units->first[unit + 1]; ++i) {
        uint32_t other = units->neighbours[i], label = r->labels[other], k = 0;
        if (label == r->labels[unit]) {
            out->own += fct_unit_length(units, i);
            continue;
        }
        while (k < out->count && out->labels[k] != label) ++k;
        if (k == SIDES) continue;
        if (k == out->count) {
            ++out->count;
            out->labels[k] = label, out->lengths[k] = 0, out->open[k] = false;
        }
        out->lengths[k] += fct_unit_length(units, i);
        out->open[k] = out->open[k] || fct_units_alike(units, unit, other);
    }
}

/* Gains below the rounding of their terms count as 0, so that nothing moves on flat ground without a reason.
 * Lengths of borders are floats. */
static step find_best_step(const refiner *r, uint32_t unit) {
    step best = {0, 0, FCT_NONE};
    const region *from = &r->regions[r->labels[unit]];
    fringe around;
    if (from->count == 1) return best;
    list_borders(r, unit, &around);
    if (around.count == 0) return best;
    v3 a = fct_unit_vector(r->units, unit);
    double area = v3_norm(a), perimeter = fct_unit_perimeter(r->units, unit);
    double leave = grow_length(from->vector, v3_scale(a, -1));
    double left = grow_square(from->perimeter, 2 * around.own - perimeter);
    for (uint32_t k = 0; k < around.count; ++k) {
        if (!around.open[k]) continue;
        const region *to = &r->regions[around.labels[k]];
        double entered = grow_square(to->perimeter, perimeter - 2 * around.lengths[k]);
        double gain = 2 * (leave + grow_length(to->vector, a)) - r->weight * (left + entered);
        double rounding = 1e-12 * (area + fabs(leave)) + 1e-6 * r->weight * (fabs(left) + fabs(entered));
        if (!(gain > rounding) || gain < best.gain) continue;
        if (gain == best.gain && around.labels[k] > best.to) continue;
        if (left + entered > 0 && !(r->squares + left + entered <= r->most_squares)) continue;
        best = (step){gain, left + entered, around.labels[k]};
    }
    return best;
}

/* Whether the neighbours of the unit in its cluster stay connected without it: a breadth-first search from
 * one of them through the cluster. */
static bool may_leave(refiner *r, uint32_t unit) {
    const fct_units *units = r->units;
    uint32_t label = r->labels[unit], missing = 0, head = 0, tail = 0, looks = 0;
    if (++r->search == 0) { /* the numbers wrapped around */
        memset(r->seen, 0, (size_t)r->heap.capacity * sizeof *r->seen);
        memset(r->wanted, 0, (size_t)r->heap.capacity * sizeof *r->wanted);
        r->search = 1;
    }
    for (uint32_t i = units->first[unit]; i < units->first[unit + 1]; ++i) {
        uint32_t other = units->neighbours[i];
        if (r->labels[other] != label) continue;
        if (fct_unit_fixed(units, other)) return false;
        r->wanted[other] = r->search;
        if (tail == 0)
            r->queue[tail++] = other;
        else
            ++missing;
    }
    if (missing == 0) return true;
    r->seen[unit] = r->seen[r->queue[0]] = r->search;
    while (head < tail) {
        uint32_t at = r->queue[head++];
        for (uint32_t i = units->first[at]; i < units->first[at + 1]; ++i) {
            uint32_t next = units->neighbours[i];
            if (++looks > SEARCH) return false;
            if (r->labels[next] != label || r->seen[next] == r->search) continue;
            if (fct_unit_fixed(units, next)) continue;
            r->seen[next] = r->search;
            r->queue[tail++] = next;
            if (r->wanted[next] == r->search && --missing == 0) return true;
        }
    }
    return false;
}

static void move_unit(refiner *r, uint32_t unit, const step *s) {
    region *from = &r->regions[r->labels[unit]], *to = &r->regions[s->to];
    fringe around;
    list_borders(r, unit, &around);
    uint32_t k = 0;
    while (around.labels[k] != s->to) ++k;
    v3 a = fct_unit_vector(r->units, unit);
    double perimeter = fct_unit_perimeter(r->units, unit);
    from->vector = v3_sub(from->vector, a);
    from->perimeter += 2 * around.own - perimeter;
    --from->count;
    to->vector = v3_add(to->vector, a);
    to->perimeter += perimeter - 2 * around.lengths[k];
    ++to->count;
    r->squares += s->squares;
    r->labels[unit] = s->to;
    r->moved[unit] = r->sweep;
}

/* The heap is a min-heap, so the largest gain gets the smallest key. */
static uint64_t key_of(double gain) {
    return ~fct_double_bits(gain);
}

/* One sweep. Returns the number of units that moved. */
static uint64_t run_sweep(refiner *r) {
    const fct_units *units = r->units;
    uint64_t moves = 0;
    ++r->sweep;
    for (uint32_t i = 0; i < units->count; ++i) {
        double gain = find_best_step(r, i).gain;
        if (gain > 0) fct_heap_append(&r->heap, i, key_of(gain));
    }
    fct_heap_order(&r->heap);
    for (uint32_t unit; (unit = fct_heap_pop(&r->heap)) != FCT_NONE;) {
        step s = find_best_step(r, unit);
        if (!(s.gain > 0) || !may_leave(r, unit)) continue;
        move_unit(r, unit, &s);
        ++moves;
        for (uint32_t i = units->first[unit]; i < units->first[unit + 1]; ++i) {
            uint32_t next = units->neighbours[i];
            if (r->moved[next] == r->sweep || units->first[next + 1] - units->first[next] > WIDE) continue;
            double gain = find_best_step(r, next).gain;
            if (gain > 0)
                fct_heap_set(&r->heap, next, key_of(gain));
            else
                fct_heap_remove(&r->heap, next);
        }
    }
    return moves;
}

/* Sums the units of each cluster. Returns the deviation of normals. */
static double sum_regions(refiner *r) {
    const fct_units *units = r->units;
    double deviation = 0;
    memset(r->regions, 0, (size_t)r->region_count * sizeof *r->regions);
    for (uint32_t unit = 0; unit < units->count; ++unit) {
        region *at = &r->regions[r->labels[unit]];
        v3 a = fct_unit_vector(units, unit);
        deviation += 2 * v3_norm(a);
        at->vector = v3_add(at->vector, a);
        at->perimeter += fct_unit_perimeter(units, unit);
        ++at->count;
        for (uint32_t i = units->first[unit]; i < units->first[unit + 1]; ++i)
            if (r->labels[units->neighbours[i]] == r->labels[unit])
                at->perimeter -= fct_unit_length(units, i);
    }
    r->squares = 0;
    for (uint32_t i = 0; i < r->region_count; ++i) {
        deviation -= 2 * v3_norm(r->regions[i].vector);
        r->squares += r->regions[i].perimeter * r->regions[i].perimeter;
    }
    return deviation;
}

/* Sets weight and limit from the partition of the faces at the start. */
static void set_weight(refiner *r, const fct_refine_def *def) {
    double area = 0, deviation = sum_regions(r);
    for (uint32_t f = 0; f < r->units->count; ++f) area += v3_norm(fct_unit_vector(r->units, f));
    /* On flat ground the deviation is rounding alone. The lower bound still lets borders become straight. */
    deviation = fmax(deviation, 1e-6 * area);
    r->weight = r->squares > 0 ? def->perimeter_weight * deviation / r->squares : 0;
    r->most_squares = isinf(def->irregularity_limit) ? INFINITY : r->squares * def->irregularity_limit;
}

static void release_refiner(const fct_env *env, refiner *r) {
    if (!r) return;
    fct_heap_release(env, &r->heap);
    fct_release(env, r->labels);
    fct_release(env, r->regions);
    fct_release(env, r->seen);
    fct_release(env, r->wanted);
    fct_release(env, r->moved);
    fct_release(env, r);
}

/* Labels stay unset. */
static refiner *create_refiner(const fct_env *env, const fct_units *faces, uint32_t count) {
    refiner *r = fct_allocate_zero(env, 1, sizeof *r);
    if (!r) {
        fct_fail_memory(env, "refining a partition");
        return NULL;
    }
    r->units = faces;
    r->region_count = count;
    const fct_array arrays[] = {FCT_ARRAY(r->labels, faces->count), FCT_ARRAY(r->regions, count),
                                FCT_ARRAY_ZERO(r->seen, faces->count),
                                FCT_ARRAY_ZERO(r->wanted, faces->count),
                                FCT_ARRAY_ZERO(r->moved, faces->count)};
    if (fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "refining a partition") == FCT_OK &&
        fct_heap_create(env, faces->count, &r->heap) == FCT_OK)
        return r;
    release_refiner(env, r);
    return NULL;
}

/* Sweeps over the units until no unit moves. [from, to) is its part of the progress. */
static fct_result run_sweeps(const fct_env *env, refiner *r, const fct_units *units,
                             const fct_refine_def *def, double from, double to, fct_refine_stats *stats) {
    r->units = units;
    sum_regions(r);
    for (uint32_t i = 0; i < def->sweep_count; ++i) {
        fct_result result = fct_progress(env, "refine", from + (to - from) * i / def->sweep_count);
        if (result != FCT_OK) return result;
        uint64_t moves = run_sweep(r);
        ++stats->sweeps;
        stats->moves += moves;
        if (moves == 0) break;
    }
    return fct_progress(env, "refine", to);
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
    fct_units faces = {0};
    refiner *r = NULL;
    double start = fct_seconds();
    fct_result result = check_def(env, &options);
    if (result == FCT_OK) result = fct_labels_check(env, mesh, labels, count);
    if (result == FCT_OK && mesh->face_count > 0) result = fct_units_of_faces(env, mesh, NULL, NULL, &faces);
    if (result != FCT_OK || mesh->face_count == 0) goto done;
    r = create_refiner(env, &faces, count);
    result = FCT_ERROR_MEMORY;
    if (!r) goto done;
    memcpy(r->labels, labels, (size_t)mesh->face_count * sizeof *labels);
    set_weight(r, &options);
    done.seconds_dual = fct_seconds() - start;
    result = run_sweeps(env, r, &faces, &options, 0, 1, &done);
    done.seconds_sweeps = fct_seconds() - start - done.seconds_dual;
    if (result == FCT_OK) memcpy(labels, r->labels, (size_t)mesh->face_count * sizeof *labels);
done:
    release_refiner(env, r);
    fct_units_release(env, &faces);
    if (result == FCT_OK && stats) *stats = done;
    return result;
}

/* Numbers the units by place: the parts of the clusters after all nodes below id `open` are opened. Children
 * have larger ids than their parents, so no node inside a unit is opened; children of nodes above the
 * clusters begin where a cluster begins. Returns the number of units. */
static uint32_t number_units(const fct_tree *tree, const uint32_t *nodes, uint32_t count, uint32_t open,
                             uint32_t *unit_of) {
    const fct_tree_view *view = &tree->view;
    memset(unit_of, 0, (size_t)view->face_count * sizeof *unit_of);
    for (uint32_t i = 0; i < count; ++i) unit_of[fct_node_first(tree, nodes[i])] = 1;
    for (uint32_t node = 0; node < open && node < view->node_count; ++node)
        for (int k = 0; k < 2; ++k) unit_of[fct_node_first(tree, fct_node_child(tree, node, k))] = 1;
    uint32_t units = 0;
    for (uint32_t place = 0; place < view->face_count; ++place) {
        units += unit_of[place];
        unit_of[place] = units - 1;
    }
    return units;
}

/* Refines one finer cut. Its units take their labels from `labels`, which is by place, and write the new ones
 * there. */
static fct_result refine_cut(const fct_env *env, refiner *r, const fct_units *faces, const uint32_t *unit_of,
                             uint32_t unit_count, uint32_t *scratch, uint32_t *labels,
                             const fct_refine_def *def, double from, double to, fct_refine_stats *stats) {
    fct_units units;
    fct_result result = fct_units_of_runs(env, faces, unit_of, unit_count, scratch, &units);
    if (result != FCT_OK) return result;
    for (uint32_t f = 0; f < faces->count; ++f) r->labels[unit_of[f]] = labels[f];
    result = run_sweeps(env, r, &units, def, from, to, stats);
    for (uint32_t f = 0; f < faces->count; ++f) labels[f] = r->labels[unit_of[f]];
    fct_units_release(env, &units);
    return result;
}

/* Refines cuts from COARSEST units per cluster on, then the faces. labels is by place; scratch holds three
 * numbers per face. */
static fct_result refine_cuts(const fct_env *env, refiner *r, const fct_tree *tree, const fct_units *faces,
                              const uint32_t *nodes, uint32_t *labels, uint32_t *scratch,
                              const fct_refine_def *def, fct_refine_stats *stats) {
    const fct_tree_view *view = &tree->view;
    double from = 0;
    uint64_t target = (uint64_t)r->region_count * COARSEST;
    for (; target < view->face_count / 2; target *= COARSEST) {
        uint32_t open = target > view->root_count ? (uint32_t)target - view->root_count : 0;
        uint32_t units = number_units(tree, nodes, r->region_count, open, scratch);
        double to = from + (1 - from) * 0.25;
        fct_result result = refine_cut(env, r, faces, scratch, units, scratch + view->face_count, labels, def,
                                       from, to, stats);
        if (result != FCT_OK) return result;
        from = to;
    }
    memcpy(r->labels, labels, (size_t)view->face_count * sizeof *labels);
    return run_sweeps(env, r, faces, def, from, 1, stats);
}

/* The faces in the tree's order, connected as in the input's order, which is how the tree was built. */
static fct_result units_of_places(const fct_env *env, const fct_tree *tree, const fct_mesh *places,
                                  fct_units *out) {
    const fct_tree_view *view = &tree->view;
    fct_mesh input;
    fct_result result = fct_tree_mesh(env, tree, &input);
    if (result != FCT_OK) return result;
    fct_weld weld = {0};
    if (view->def.weld) result = fct_weld_build(env, &input, &weld);
    fct_mesh welded = input;
    if (weld.triangles) welded.triangles = weld.triangles;
    uint32_t *place_of = fct_allocate(env, view->face_count, sizeof *place_of);
    if (result == FCT_OK && place_of) {
        for (uint32_t place = 0; place < view->face_count; ++place) place_of[view->face_ids[place]] = place;
        result = fct_units_of_faces(env, &welded, place_of, places, out);
    } else if (result == FCT_OK) {
        result = fct_fail_memory(env, "refining a partition");
    }
    fct_release(env, place_of);
    fct_weld_release(env, &weld);
    fct_mesh_release(env, &input);
    return result;
}

fct_result fct_tree_refine(const fct_env *env, const fct_tree *tree, const uint32_t *nodes, uint32_t count,
                           const fct_refine_def *def, uint32_t *labels, fct_refine_stats *stats) {
    const fct_tree_view *view = &tree->view;
    fct_mesh mesh = {.vertex_count = view->vertex_count,
                     .face_count = view->face_count,
                     .positions = (float *)view->positions,
                     .triangles = (uint32_t *)view->triangles,
                     .materials = (uint32_t *)view->materials,
                     .material_count = view->material_count};
    fct_refine_def options = def ? *def : fct_refine_def_default();
    fct_refine_stats done = {0};
    fct_units faces = {0};
    refiner *r = NULL;
    uint32_t *places = NULL; /* labels by place, and three numbers a face beside them */
    double start = fct_seconds();
    fct_result result = check_def(env, &options);
    if (result == FCT_OK) result = fct_tree_check(env, tree);
    if (result == FCT_OK) result = units_of_places(env, tree, &mesh, &faces);
    if (result != FCT_OK) return result;
    r = create_refiner(env, &faces, count);
    places = r ? fct_allocate(env, view->face_count, 4 * sizeof *places) : NULL;
    result = r && !places ? fct_fail_memory(env, "refining a partition") : FCT_ERROR_MEMORY;
    if (!places) goto done;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t first = fct_node_first(tree, nodes[i]);
        uint32_t faces_in = fct_node_faces(tree, nodes[i]);
        for (uint32_t place = first; place < first + faces_in; ++place) places[place] = i;
    }
    memcpy(r->labels, places, (size_t)view->face_count * sizeof *places);
    set_weight(r, &options);
    done.seconds_dual = fct_seconds() - start;
    result = refine_cuts(env, r, tree, &faces, nodes, places, places + view->face_count, &options, &done);
    done.seconds_sweeps = fct_seconds() - start - done.seconds_dual;
    if (result == FCT_OK)
        for (uint32_t place = 0; place < view->face_count; ++place)
            labels[view->face_ids[place]] = r->labels[place];
done:
    release_refiner(env, r);
    fct_release(env, places);
    fct_units_release(env, &faces);
    if (result == FCT_OK && stats) *stats = done;
    return result;
}
