/* bench/cluster/boxes/boxtree.c: trees of boxes: ours, converted, and two that are built from the top. */
#include "bench/cluster/boxes/boxtree.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "bench/cluster/bench.h"

/* --- Common code --- */

static v3 corner(const fct_mesh *mesh, uint32_t face, uint32_t k) {
    return v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + k]);
}

static void open_tree(const fct_mesh *mesh, box_tree *out) {
    if (mesh->face_count < 2) bench_fail("expected at least two faces");
    *out = (box_tree){.mesh = mesh, .inner_count = mesh->face_count - 1};
    out->boxes = bench_allocate((size_t)out->inner_count + mesh->face_count, sizeof *out->boxes);
    out->child = bench_allocate(out->inner_count, sizeof *out->child);
}

void box_tree_release(box_tree *tree) {
    free(tree->boxes);
    free(tree->child);
    *tree = (box_tree){0};
}

/* Half extents grow by more than the rounding to float. */
fct_box box_fit(const fct_mesh *mesh, const uint32_t *faces, uint32_t count, const v3 axes[3]) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    v3 used[3], center = {0, 0, 0};
    fct_box box;
    for (int k = 0; k < 3; ++k) v3_store(box.axes[k], axes[k]), used[k] = v3_load(box.axes[k]);
    for (uint32_t i = 0; i < count; ++i)
        for (uint32_t c = 0; c < 3; ++c) {
            v3 p = corner(mesh, faces[i], c);
            for (int k = 0; k < 3; ++k)
                low[k] = fmin(low[k], v3_dot(used[k], p)), high[k] = fmax(high[k], v3_dot(used[k], p));
        }
    for (int k = 0; k < 3; ++k) {
        center = v3_mad(center, .5 * (low[k] + high[k]), used[k]);
        box.half[k] = (float)(.5 * (high[k] - low[k]) + 2e-7 * fmax(fabs(low[k]), fabs(high[k])));
    }
    v3_store(box.center, center);
    return box;
}

/* A face without area gets a tiny weight, so that clusters of such faces have a centroid. */
v3 box_axes(const fct_mesh *mesh, const uint32_t *faces, uint32_t count, v3 axes[3]) {
    v3 origin = corner(mesh, faces[0], 0), mean = {0, 0, 0};
    double total = 0, m[6] = {0}, values[3], vectors[3][3];
    for (uint32_t i = 0; i < count; ++i) {
        v3 p[3], sum = {0, 0, 0};
        for (uint32_t k = 0; k < 3; ++k)
            p[k] = v3_sub(corner(mesh, faces[i], k), origin), sum = v3_add(sum, p[k]);
        double area = .5 * v3_norm(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]))) + DBL_MIN;
        for (int k = 0; k < 3; ++k) sym3_add_outer(m, area / 12, p[k]);
        sym3_add_outer(m, area / 12, sum);
        mean = v3_mad(mean, area / 3, sum);
        total += area;
    }
    sym3_add_outer(m, -1 / total, mean);
    bench_eigen(m, values, vectors);
    for (int k = 0; k < 3; ++k) axes[k] = (v3){vectors[k][0], vectors[k][1], vectors[k][2]};
    return v3_mad(origin, 1 / total, mean);
}

static const v3 world[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* The frame of a triangle: its longest side and its normal. */
static fct_box fit_face(const fct_mesh *mesh, uint32_t face) {
    v3 p[3] = {corner(mesh, face, 0), corner(mesh, face, 1), corner(mesh, face, 2)}, longest = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
        v3 side = v3_sub(p[(k + 1) % 3], p[k]);
        if (v3_norm2(side) > v3_norm2(longest)) longest = side;
    }
    v3 axes[3] = {v3_unit(longest), {0, 0, 0}, v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])))};
    if (v3_norm2(axes[0]) == 0) axes[0] = world[0];
    if (v3_norm2(axes[2]) == 0) v3_frame(axes[0], &axes[1], &axes[2]);
    axes[1] = v3_unit(v3_cross(axes[2], axes[0]));
    return box_fit(mesh, &face, 1, axes);
}

static void fit_faces(box_tree *tree) {
    for (uint32_t f = 0; f < tree->mesh->face_count; ++f)
        tree->boxes[tree->inner_count + f] = fit_face(tree->mesh, f);
}

/* --- Ours --- */

void box_tree_take(const fct_mesh *mesh, const fct_tree *tree, box_tree *out) {
    fct_tree_view view = fct_tree_get(tree);
    if (view.root_count != 1) bench_fail("expected one root");
    open_tree(mesh, out);
    out->root = view.roots[0];
    for (uint32_t i = 0; i < view.node_count; ++i) {
        fct_cluster cluster;
        bench_check(fct_tree_cluster(tree, i, &cluster), "a cluster");
        fct_cluster_box(&cluster, &out->boxes[i]);
        for (int c = 0; c < 2; ++c) {
            uint32_t child = cluster.child[c];
            out->child[i][c] =
                child < view.node_count ? child : out->inner_count + view.face_ids[child - view.node_count];
        }
    }
    fit_faces(out);
}

/* --- Trees from the top --- */

typedef struct task {
    uint32_t first, count, node;
} task;

typedef struct builder {
    box_tree *tree;
    uint32_t *faces; /* a permutation; each task has a range of it */
    v3 *centroids;
} builder;

/* Stores the box of the task's faces and reorders them. Returns the number of faces of the first child. */
typedef uint32_t split_function(builder *b, const task *t);

static void build(const fct_mesh *mesh, split_function *split, box_tree *out) {
    open_tree(mesh, out);
    builder b = {out, bench_allocate(mesh->face_count, sizeof(uint32_t)),
                 bench_allocate(mesh->face_count, sizeof(v3))};
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        b.faces[f] = f;
        v3 sum = v3_add(v3_add(corner(mesh, f, 0), corner(mesh, f, 1)), corner(mesh, f, 2));
        b.centroids[f] = v3_scale(sum, 1. / 3);
    }
    /* tasks on the stack have disjoint faces, so there are at most face_count */
    task *stack = bench_allocate(mesh->face_count, sizeof *stack);
    uint32_t top = 0, made = 1;
    stack[top++] = (task){0, mesh->face_count, 0};
    while (top > 0) {
        task t = stack[--top], halves[2];
        uint32_t left = split(&b, &t);
        halves[0] = (task){t.first, left, 0}, halves[1] = (task){t.first + left, t.count - left, 0};
        for (int c = 0; c < 2; ++c) {
            bool leaf = halves[c].count == 1;
            halves[c].node = leaf ? out->inner_count + b.faces[halves[c].first] : made++;
            out->child[t.node][c] = halves[c].node;
            if (!leaf) stack[top++] = halves[c];
        }
    }
    free(stack);
    free(b.faces);
    free(b.centroids);
}

/* Moves faces whose centroid lies below the cut to the front. Returns their number. */
static uint32_t part(builder *b, const task *t, v3 axis, double at) {
    uint32_t *faces = b->faces + t->first, left = 0;
    for (uint32_t i = 0; i < t->count; ++i)
        if (v3_dot(axis, b->centroids[faces[i]]) < at) {
            uint32_t swap = faces[i];
            faces[i] = faces[left], faces[left++] = swap;
        }
    return left;
}

static uint32_t split_oriented(builder *b, const task *t) {
    v3 axes[3], mean = box_axes(b->tree->mesh, b->faces + t->first, t->count, axes);
    fct_box *box = &b->tree->boxes[t->node];
    *box = box_fit(b->tree->mesh, b->faces + t->first, t->count, axes);
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; ++i)
        for (int j = 2; j > i; --j)
            if (box->half[order[j]] > box->half[order[j - 1]]) {
                int swap = order[j];
                order[j] = order[j - 1], order[j - 1] = swap;
            }
    for (int k = 0; k < 3; ++k) {
        uint32_t left = part(b, t, axes[order[k]], v3_dot(axes[order[k]], mean));
        if (left > 0 && left < t->count) return left;
    }
    return t->count / 2;
}

void box_tree_oriented(const fct_mesh *mesh, box_tree *out) {
    double start = bench_seconds();
    build(mesh, split_oriented, out);
    fit_faces(out);
    out->seconds = bench_seconds() - start;
}

enum { BINS = 16 };

typedef struct bin {
    double low[3], high[3];
    uint32_t count;
} bin;

static const bin empty = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0};

static void join(bin *to, const bin *from) {
    for (int k = 0; k < 3; ++k)
        to->low[k] = fmin(to->low[k], from->low[k]), to->high[k] = fmax(to->high[k], from->high[k]);
    to->count += from->count;
}

/* Half the surface area times the count. */
static double weight(const bin *b) {
    if (b->count == 0) return 0;
    double x = b->high[0] - b->low[0], y = b->high[1] - b->low[1], z = b->high[2] - b->low[2];
    return b->count * (x * y + y * z + z * x);
}

static bin bounds_of(const fct_mesh *mesh, uint32_t face) {
    bin out = empty;
    out.count = 1;
    for (uint32_t c = 0; c < 3; ++c) {
        v3 p = corner(mesh, face, c);
        const double x[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k)
            out.low[k] = fmin(out.low[k], x[k]), out.high[k] = fmax(out.high[k], x[k]);
    }
    return out;
}

/* Finds the cheapest cut between bins along one axis. Returns its cost; *at receives its place. */
static double best_cut(const bin bins[BINS], double low, double step, double *at) {
    double right[BINS], best = INFINITY;
    bin sum = empty;
    for (int i = BINS - 1; i > 0; --i) join(&sum, &bins[i]), right[i] = sum.count ? weight(&sum) : INFINITY;
    sum = empty;
    for (int i = 1; i < BINS; ++i) {
        join(&sum, &bins[i - 1]);
        double cost = sum.count ? weight(&sum) + right[i] : INFINITY;
        if (cost < best) best = cost, *at = low + i * step;
    }
    return best;
}

static uint32_t split_aligned(builder *b, const task *t) {
    const uint32_t *faces = b->faces + t->first;
    b->tree->boxes[t->node] = box_fit(b->tree->mesh, faces, t->count, world);
    double best = INFINITY, place = 0;
    int axis = 0;
    for (int k = 0; k < 3; ++k) {
        double low = INFINITY, high = -INFINITY, at = 0;
        for (uint32_t i = 0; i < t->count; ++i) {
            double x = v3_dot(world[k], b->centroids[faces[i]]);
            low = fmin(low, x), high = fmax(high, x);
        }
        if (!(high > low)) continue;
        bin bins[BINS];
        for (int i = 0; i < BINS; ++i) bins[i] = empty;
        for (uint32_t i = 0; i < t->count; ++i) {
            int slot = (int)(BINS * (v3_dot(world[k], b->centroids[faces[i]]) - low) / (high - low));
            bin one = bounds_of(b->tree->mesh, faces[i]);
            join(&bins[slot < BINS ? slot : BINS - 1], &one);
        }
        double cost = best_cut(bins, low, (high - low) / BINS, &at);
        if (cost < best) best = cost, axis = k, place = at;
    }
    uint32_t left = best < INFINITY ? part(b, t, world[axis], place) : 0;
    return left > 0 && left < t->count ? left : t->count / 2;
}

void box_tree_aligned(const fct_mesh *mesh, box_tree *out) {
    double start = bench_seconds();
    build(mesh, split_aligned, out);
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        out->boxes[out->inner_count + f] = box_fit(mesh, &f, 1, world);
    out->seconds = bench_seconds() - start;
}

/* --- Measures of a tree --- */

double box_tree_area(const box_tree *tree, double diagonal) {
    double area = 0;
    for (uint32_t i = 0; i < tree->inner_count; ++i) area += 4 * box_surface(&tree->boxes[i]);
    return area / (diagonal * diagonal);
}

/* Calls `visit` with each box and its parent, parents first. */
static void walk(const box_tree *tree, void (*visit)(void *user, uint32_t parent, uint32_t box), void *user) {
    uint32_t *stack = bench_allocate((size_t)tree->inner_count + 1, sizeof *stack), top = 0;
    stack[top++] = tree->root;
    while (top > 0) {
        uint32_t parent = stack[--top];
        for (int c = 0; c < 2; ++c) {
            uint32_t box = tree->child[parent][c];
            visit(user, parent, box);
            if (box < tree->inner_count) stack[top++] = box;
        }
    }
    free(stack);
}

typedef struct descent {
    const box_tree *tree;
    uint32_t *above; /* per box: its parent or its depth */
    uint32_t deepest;
} descent;

static void count_depth(void *user, uint32_t parent, uint32_t box) {
    descent *d = user;
    d->above[box] = d->above[parent] + 1;
    if (d->above[box] > d->deepest) d->deepest = d->above[box];
}

static void note_parent(void *user, uint32_t parent, uint32_t box) {
    ((descent *)user)->above[box] = parent;
}

static descent descend(const box_tree *tree, void (*visit)(void *user, uint32_t parent, uint32_t box)) {
    descent d = {.tree = tree};
    d.above = bench_allocate((size_t)tree->inner_count + tree->mesh->face_count, sizeof *d.above);
    walk(tree, visit, &d);
    return d;
}

uint32_t box_tree_depth(const box_tree *tree) {
    descent d = descend(tree, count_depth);
    free(d.above);
    return d.deepest;
}

static bool outside(const fct_box *box, v3 p, double margin) {
    v3 d = v3_sub(p, v3_load(box->center));
    for (int k = 0; k < 3; ++k)
        if (fabs(v3_dot(v3_load(box->axes[k]), d)) > (double)box->half[k] + margin) return true;
    return false;
}

uint64_t box_tree_escaped(const box_tree *tree, double diagonal) {
    descent d = descend(tree, note_parent);
    uint64_t escaped = 0;
    for (uint32_t f = 0; f < tree->mesh->face_count; ++f)
        for (uint32_t box = tree->inner_count + f;; box = d.above[box]) {
            for (uint32_t c = 0; c < 3; ++c)
                escaped += outside(&tree->boxes[box], corner(tree->mesh, f, c), 1e-5 * diagonal);
            if (box == tree->root) break;
        }
    free(d.above);
    return escaped;
}
