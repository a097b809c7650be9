/* The hierarchy over instances: splits of least surface-area cost, and the same tree eight wide. */
#include "support.h"

#include "facetree/scene.h"
#include "scene/volume.h"

enum { COUNT = 160 };

static uint64_t state = 5;
static double between(double a, double b) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return a + (b - a) * (double)(state >> 11) * 0x1p-53;
}

static double area_of(const fct_bounds *b) {
    double s[3];
    for (int c = 0; c < 3; ++c) s[c] = (double)b->upper[c] - (double)b->lower[c];
    return s[0] * s[1] + s[1] * s[2] + s[2] * s[0];
}

static void join_bounds(fct_bounds *to, const fct_bounds *from) {
    for (int c = 0; c < 3; ++c) {
        to->lower[c] = fminf(to->lower[c], from->lower[c]);
        to->upper[c] = fmaxf(to->upper[c], from->upper[c]);
    }
}

static uint32_t list_instances(const fct_volume *volumes, uint32_t node, uint32_t *out) {
    if (volumes[node].instance != FCT_NONE) {
        *out = volumes[node].instance;
        return 1;
    }
    uint32_t left = list_instances(volumes, volumes[node].child[0], out);
    return left + list_instances(volumes, volumes[node].child[1], out + left);
}

/* Area times count on both sides of each place between two boxes sorted by centre: the least of all axes. */
static double least_split_cost(const fct_bounds *bounds, uint32_t *ids, uint32_t count) {
    double best = INFINITY;
    for (int c = 0; c < 3; ++c) {
        for (uint32_t i = 1; i < count; ++i) /* insertion sort */
            for (uint32_t j = i; j > 0; --j) {
                const fct_bounds *a = bounds + ids[j - 1], *b = bounds + ids[j];
                if (a->lower[c] + a->upper[c] <= b->lower[c] + b->upper[c]) break;
                uint32_t moved = ids[j];
                ids[j] = ids[j - 1], ids[j - 1] = moved;
            }
        for (uint32_t left = 1; left < count; ++left) {
            fct_bounds side[2] = {bounds[ids[0]], bounds[ids[left]]};
            for (uint32_t i = 0; i < count; ++i) join_bounds(side + (i >= left), bounds + ids[i]);
            best = fmin(best, area_of(side) * left + area_of(side + 1) * (count - left));
        }
    }
    return best;
}

static void make_boxes(fct_bounds *bounds) {
    for (uint32_t i = 0; i < COUNT; ++i)
        for (int c = 0; c < 3; ++c) {
            double at = between(0, 1 + 2 * c), size = between(0, .3) * between(0, 1);
            bounds[i].lower[c] = (float)at, bounds[i].upper[c] = (float)(at + size);
        }
}

static void splits_have_the_least_area_cost(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_bounds bounds[COUNT];
    fct_volume volumes[2 * COUNT - 1];
    make_boxes(bounds);
    assert_int_equal(fct_scene_build_volumes(&env, COUNT, bounds, volumes), FCT_OK);
    for (uint32_t n = 0; n < 2 * COUNT - 1; ++n) {
        uint32_t ids[COUNT], count = list_instances(volumes, n, ids);
        fct_bounds all = bounds[ids[0]];
        for (uint32_t i = 1; i < count; ++i) join_bounds(&all, bounds + ids[i]);
        assert_memory_equal(&all, &volumes[n].bounds, sizeof all);
        if (count == 1) continue;
        const fct_volume *left = volumes + volumes[n].child[0], *right = volumes + volumes[n].child[1];
        uint32_t left_ids[COUNT], left_count = list_instances(volumes, volumes[n].child[0], left_ids);
        assert_true(volumes[n].child[0] > n && volumes[n].child[1] > n);
        double cost = area_of(&left->bounds) * left_count + area_of(&right->bounds) * (count - left_count);
        assert_true(cost <= least_split_cost(bounds, ids, count) * (1 + 1e-5));
    }
}

static uint32_t depth_of(const fct_volume *volumes, uint32_t node) {
    if (volumes[node].instance != FCT_NONE) return 0;
    uint32_t a = depth_of(volumes, volumes[node].child[0]), b = depth_of(volumes, volumes[node].child[1]);
    return 1 + (a > b ? a : b);
}

static void long_chains_are_halved_below_level_32(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    enum { LONG = 120 };
    fct_bounds bounds[LONG];
    fct_volume volumes[2 * LONG - 1];
    for (int i = 0; i < LONG;
         ++i) /* each box is twice as far as the one before: the best split takes one off */
        for (int c = 0; c < 3; ++c) {
            bounds[i].lower[c] = ldexpf(1, i - 60);
            bounds[i].upper[c] = ldexpf(1.5f, i - 60);
        }
    assert_int_equal(fct_scene_build_volumes(&env, LONG, bounds, volumes), FCT_OK);
    uint32_t depth = depth_of(volumes, 0);
    assert_true(depth > 30 && depth <= 32 + 7);
}

typedef struct wide_walk {
    const fct_volume *volumes;
    const fct_scene_node *nodes;
    double pad;
    uint32_t seen[COUNT];
} wide_walk;

/* The union of the instances below; each box stands out from its own by the padding of 2^-21 of the scene. */
static fct_bounds check_wide(wide_walk *walk, uint32_t node, const fct_bounds *bounds) {
    const fct_scene_node *wide = walk->nodes + node;
    fct_bounds all = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    bool room = false, inner = false;
    for (uint32_t k = 0; k < FCT_SCENE_WIDTH; ++k) {
        if (wide->child[k] == FCT_NONE) { /* no ray hits an empty child */
            room = true;
            for (int c = 0; c < 3; ++c) assert_true(wide->bounds[2 * c][k] > wide->bounds[2 * c + 1][k]);
            continue;
        }
        assert_false(room);
        fct_bounds box;
        if (wide->child[k] & FCT_SCENE_LEAF) {
            uint32_t instance = wide->child[k] & ~FCT_SCENE_LEAF;
            ++walk->seen[instance];
            box = bounds[instance];
        } else {
            inner = true;
            assert_true(wide->child[k] > node);
            box = check_wide(walk, wide->child[k], bounds);
        }
        for (int c = 0; c < 3; ++c) {
            double below = (double)box.lower[c] - (double)wide->bounds[2 * c][k];
            double above = (double)wide->bounds[2 * c + 1][k] - (double)box.upper[c], ulp = 8e-7;
            assert_true(below > 0 && above > 0 && below > walk->pad - ulp && above > walk->pad - ulp);
            assert_true(below < walk->pad + ulp && above < walk->pad + ulp);
        }
        join_bounds(&all, &box);
    }
    assert_true(!room || !inner); /* a node with room has no child that could be opened */
    return all;
}

static void wide_nodes_hold_every_instance_once(void **unused) {
    (void)unused;
    fct_env env = fct_env_default();
    fct_bounds bounds[COUNT];
    static const uint32_t counts[] = {1, 2, 8, 9, 70, COUNT};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i) {
        fct_volume volumes[2 * COUNT - 1];
        fct_scene_node *nodes;
        make_boxes(bounds);
        assert_int_equal(fct_scene_build_volumes(&env, counts[i], bounds, volumes), FCT_OK);
        assert_int_equal(fct_scene_build_nodes(&env, counts[i], volumes, &nodes), FCT_OK);
        double size = 0;
        for (int c = 0; c < 3; ++c)
            size = fmax(size, (double)volumes[0].bounds.upper[c] - (double)volumes[0].bounds.lower[c]);
        wide_walk walk = {.volumes = volumes, .nodes = nodes, .pad = ldexp(size, -21)};
        fct_bounds all = check_wide(&walk, 0, bounds);
        assert_memory_equal(&all, &volumes[0].bounds, sizeof all);
        for (uint32_t k = 0; k < counts[i]; ++k) assert_int_equal(walk.seen[k], 1);
        /* The largest children are opened first: the root's are no larger than any that was opened. */
        double largest = 0;
        for (uint32_t k = 0; k < FCT_SCENE_WIDTH; ++k) {
            if (nodes[0].child[k] == FCT_NONE || nodes[0].child[k] & FCT_SCENE_LEAF) continue;
            fct_bounds box;
            for (int c = 0; c < 3; ++c)
                box.lower[c] = nodes[0].bounds[2 * c][k], box.upper[c] = nodes[0].bounds[2 * c + 1][k];
            largest = fmax(largest, area_of(&box));
        }
        uint32_t larger = 0; /* a volume that is larger than all children of the root lies above them */
        for (uint32_t n = 0; n < 2 * counts[i] - 1; ++n)
            larger += volumes[n].instance == FCT_NONE && area_of(&volumes[n].bounds) > largest * (1 + 1e-4);
        assert_true(larger <= 7 && (counts[i] < 9 || larger == 7));
        fct_release(&env, nodes);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splits_have_the_least_area_cost),
        cmocka_unit_test(long_chains_are_halved_below_level_32),
        cmocka_unit_test(wide_nodes_hold_every_instance_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
