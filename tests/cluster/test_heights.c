/* Clusters that are too tall to merge: rounds that begin with tall clusters keep the limit, and grafting
 * keeps the order of costs.
 */
#include "shapes.h"

#include "cluster/merge/graft.h"
#include "cluster/merge/greedy.h"
#include "cluster/merge/rounds/rounds.h"

/* Merges cluster f with `count` - 1 faces and pairs of faces, each merge one level higher and dearer, and
 * leads the edges of merged clusters to the union. */
static void make_chain(fct_work *work, uint32_t f, uint32_t count, double cost) {
    for (uint32_t step = 1; step < count; ++step) {
        uint32_t e = 0, kept = 0;
        while (e < work->edge_count && (work->edges[e].a != f || work->heights[work->edges[e].b] > 1) &&
               (work->edges[e].b != f || work->heights[work->edges[e].a] > 1))
            ++e;
        if (e == work->edge_count) return;
        uint32_t other = work->edges[e].a == f ? work->edges[e].b : work->edges[e].a;
        fct_work_merge(work, f, other, (double)work->edges[e].shared, (float)(cost * step));
        for (uint32_t i = 0; i < work->edge_count; ++i) {
            fct_edge edge = work->edges[i];
            edge.a = edge.a == other ? f : edge.a, edge.b = edge.b == other ? f : edge.b;
            if (edge.a != edge.b) work->edges[kept++] = edge;
        }
        work->edge_count = kept;
    }
}

/* No union after the first `done` merges that is higher than 8 may be higher than 2 log2 n + 8 or 3 log2 n
 * - 1. */
static void check_heights(const fct_work *work, uint32_t done) {
    uint32_t faces = work->face_count;
    uint32_t(*sizes)[2] = calloc(2 * (size_t)faces, sizeof *sizes); /* height, faces */
    for (uint32_t n = 0; n < faces + work->merge_count; ++n) {
        if (n < faces) {
            sizes[n][1] = 1;
            continue;
        }
        const uint32_t *child = work->children[n - faces];
        uint32_t left = sizes[child[0]][0], right = sizes[child[1]][0];
        sizes[n][0] = (left > right ? left : right) + 1;
        sizes[n][1] = sizes[child[0]][1] + sizes[child[1]][1];
        double levels = log2(sizes[n][1]), most = fmin(2 * levels + 8, 3 * levels - 1);
        if (n >= faces + done && sizes[n][0] > 8 && sizes[n][0] > floor(most))
            fail_msg("a cluster of %u faces has height %u", sizes[n][1], sizes[n][0]);
    }
    free(sizes);
}

static void rounds_from_tall_clusters_keep_the_limit(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_tree_def def = fct_tree_def_default();
    fct_mesh mesh = make_grid(&env, 60);
    fct_work work;
    roughen(&mesh, 0.005);
    assert_int_equal(fct_work_create(&env, &mesh, &def, &work), FCT_OK);
    assert_int_equal(fct_work_list_edges(&work), FCT_OK);
    for (uint32_t f = 0; f < mesh.face_count; f += 61)
        if (work.heights[f] == 0 && work.nodes[f] != FCT_NONE) make_chain(&work, f, 9, 0);
    uint32_t chains = work.merge_count;
    assert_true(chains > 500);
    assert_int_equal(fct_work_rounds(&work, true), FCT_OK);
    assert_true(work.face_count - work.merge_count < 100);
    check_heights(&work, chains);
    fct_work_release(&work);
    fct_mesh_release(&env, &mesh);
}

/* A merged mesh before grafting, and the tree afterwards. */
typedef struct forest {
    const fct_work *work;
    uint32_t *roots;   /* per face: the slot of its cluster before */
    uint32_t *parents; /* per node afterwards */
    float *costs;      /* of the merges before, ascending */
    uint32_t merges;
} forest;

static int compare_floats(const void *p, const void *q) {
    float a = *(const float *)p, b = *(const float *)q;
    return (a > b) - (a < b);
}

static void label_faces(const fct_work *work, uint32_t node, uint32_t slot, uint32_t *roots) {
    if (node < work->face_count) {
        roots[node] = slot;
        return;
    }
    for (int k = 0; k < 2; ++k) label_faces(work, work->children[node - work->face_count][k], slot, roots);
}

static forest note_forest(const fct_work *work) {
    uint32_t faces = work->face_count;
    forest f = {.work = work,
                .roots = malloc(faces * sizeof *f.roots),
                .parents = malloc(2 * faces * sizeof *f.parents),
                .costs = malloc(faces * sizeof *f.costs),
                .merges = work->merge_count};
    for (uint32_t s = 0; s < faces; ++s)
        if (work->nodes[s] != FCT_NONE) label_faces(work, work->nodes[s], s, f.roots);
    memcpy(f.costs, work->costs, f.merges * sizeof *f.costs);
    qsort(f.costs, f.merges, sizeof *f.costs, compare_floats);
    return f;
}

/* The lowest node above all faces of a cluster. */
static uint32_t find_top(const forest *f, uint32_t slot, uint32_t *uses) {
    uint32_t faces = f->work->face_count, count = 0, node = FCT_NONE;
    memset(uses, 0, 2 * faces * sizeof *uses);
    for (uint32_t i = 0; i < faces; ++i) {
        if (f->roots[i] != slot) continue;
        ++count;
        for (uint32_t up = i; up != FCT_NONE; up = f->parents[up]) ++uses[up];
        node = i;
    }
    while (uses[node] < count) node = f->parents[node];
    return node;
}

static float cost_of(const fct_work *work, uint32_t node, float other) {
    return node == FCT_NONE || node < work->face_count ? other : work->costs[node - work->face_count];
}

/* The costs before are still there. A new merge costs at least as much as the node that it was put beside,
 * and at most as much as the node above; if the trees before are out of order there, as much as one of the
 * two. Returns the number of grafts. */
static uint32_t check_forest(forest *f) {
    const fct_work *work = f->work;
    uint32_t faces = work->face_count, grafts = 0, *uses = malloc(2 * faces * sizeof *uses);
    float *costs = malloc(faces * sizeof *costs);
    memset(f->parents, 0xFF, 2 * faces * sizeof *f->parents);
    for (uint32_t m = 0; m < work->merge_count; ++m)
        for (int k = 0; k < 2; ++k) {
            assert_true(work->children[m][k] < faces + m);
            f->parents[work->children[m][k]] = faces + m;
        }
    for (uint32_t slot = 0; slot < faces; ++slot) {
        bool was_root = false;
        for (uint32_t i = 0; i < faces && !was_root; ++i) was_root = f->roots[i] == slot;
        if (!was_root || work->nodes[slot] != FCT_NONE) continue;
        uint32_t top = find_top(f, slot, uses), merge = f->parents[top];
        assert_true(merge != FCT_NONE);
        const uint32_t *child = work->children[merge - faces];
        uint32_t above = f->parents[merge];
        /* not if a later graft went in between */
        if (child[1] != top || (above != FCT_NONE && work->children[above - faces][1] == merge)) continue;
        float cost = work->costs[merge - faces];
        float low = cost_of(work, child[0], cost), high = cost_of(work, above, cost);
        if (low <= high ? !(cost >= low && cost <= high) : cost != low && cost != high)
            fail_msg("a grafted merge costs %.9g, between %.9g and %.9g", (double)cost, (double)low,
                     (double)high);
        ++grafts;
    }
    memcpy(costs, work->costs, work->merge_count * sizeof *costs);
    qsort(costs, work->merge_count, sizeof *costs, compare_floats);
    for (uint32_t i = 0, at = 0; i < f->merges; ++i, ++at) {
        while (at < work->merge_count && costs[at] < f->costs[i]) ++at;
        assert_true(at < work->merge_count && costs[at] == f->costs[i]);
    }
    free(uses), free(costs);
    return grafts;
}

static void grafting_keeps_the_order_of_costs(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t grafts = 0;
    for (int run = 0; run < 20; ++run) {
        fct_mesh mesh = make_grid(&env, 12);
        fct_tree_def def = fct_tree_def_default();
        fct_work work;
        roughen(&mesh, 0.01);
        assert_int_equal(fct_work_create(&env, &mesh, &def, &work), FCT_OK);
        assert_int_equal(fct_work_list_edges(&work), FCT_OK);
        /* pairs, then tall chains, that are much cheaper or much dearer than the grafts will be */
        for (uint32_t f = 0; f < mesh.face_count; f += 3)
            if (work.heights[f] == 0 && work.nodes[f] != FCT_NONE)
                make_chain(&work, f, 2, pow(10, (int)f % 5 - 6));
        for (uint32_t f = (uint32_t)run; f < mesh.face_count; f += 5)
            if (work.heights[f] < 2 && work.nodes[f] != FCT_NONE)
                make_chain(&work, f, 5 + (uint32_t)run, pow(10, (int)f % 7 - 5));
        forest f = note_forest(&work);
        assert_int_equal(fct_work_graft(&work, &mesh), FCT_OK);
        grafts += check_forest(&f);
        free(f.roots), free(f.parents), free(f.costs);
        fct_work_release(&work);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(grafts > 100);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(rounds_from_tall_clusters_keep_the_limit),
                                       cmocka_unit_test(grafting_keeps_the_order_of_costs)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
