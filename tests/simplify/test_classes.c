/* Classes of wedges: which groups of wedges share a vertex after a contraction, and that they are equal. */
#include "levels.h"
#include "simplify/classes.h"
#include "simplify/contract.h"
#include "simplify/refit/refit.h"
#include "simplify/simplifier.h"

static fct_env env;

/* The wedges of an edge: per wedge its end, its group and its class; then the expected class per group. */
typedef struct edge_case {
    uint32_t wedge_count, ends[6], groups[6], classes[6], group_count, expected[6];
} edge_case;

static const edge_case edge_cases[] = {
    /* A crease on a texture seam ends: at one end the two groups share a vertex, at the other they do not. */
    {4, {0, 0, 1, 1}, {0, 1, 0, 1}, {0, 1, 2, 2}, 2, {0, 1}},
    {4, {0, 0, 1, 1}, {0, 1, 0, 1}, {0, 0, 2, 3}, 2, {0, 1}},
    /* A texture seam without a crease, along the edge, and one that ends. */
    {4, {0, 0, 1, 1}, {0, 1, 0, 1}, {0, 0, 2, 2}, 2, {0, 0}},
    {3, {0, 1, 1}, {0, 0, 1}, {0, 1, 1}, 2, {0, 0}},
    /* Nothing joins wedges of different ends, or different classes of one end. */
    {2, {0, 1}, {0, 1}, {0, 1}, 2, {0, 1}},
    {3, {0, 0, 1}, {0, 1, 0}, {0, 1, 2}, 2, {0, 1}},
    /* Groups 0 and 2 both share a vertex with group 1, but have different ones at the second end. */
    {5, {0, 0, 1, 1, 1}, {0, 1, 0, 1, 2}, {0, 0, 2, 2, 4}, 3, {0, 0, 4}},
    {5, {0, 0, 0, 1, 1}, {0, 1, 2, 0, 2}, {0, 0, 0, 3, 4}, 3, {0, 0, 2}},
};

static void creases_of_one_end_stay(void **state) {
    (void)state;
    float texcoords[2] = {0};
    for (size_t i = 0; i < FCT_LENGTH(edge_cases); ++i) {
        const edge_case *e = &edge_cases[i];
        uint32_t classes[6], found[SIMPLIFY_MAX_WEDGES];
        memcpy(classes, e->classes, sizeof classes);
        const fct_mesh mesh = {.texcoords = texcoords};
        const fct_simplifier s = {.mesh = &mesh, .wedge_classes = classes};
        fct_groups g = {.wedge_count = e->wedge_count, .group_count = e->group_count};
        for (uint32_t w = 0; w < e->wedge_count; ++w)
            g.wedges[w] = w, g.group_of[w] = e->groups[w], g.second[w] = e->ends[w];
        fct_classes_find(&s, &g, found);
        for (uint32_t k = 0; k < e->group_count; ++k) assert_int_equal(found[k], e->expected[k]);
    }
}

static void check_equal(const fct_simplifier *s) {
    uint32_t n = s->channel_count, pairs = 0;
    for (uint32_t p = 0; p < s->point_count; ++p)
        for (uint32_t w = s->first_wedges[p]; w != FCT_NONE && point_at(s, p)->valence > 0;
             w = s->next_wedges[w])
            for (uint32_t x = s->next_wedges[w]; x != FCT_NONE; x = s->next_wedges[x]) {
                if (s->wedge_classes[w] != s->wedge_classes[x]) continue;
                ++pairs;
                for (uint32_t i = 0; i < n; ++i)
                    assert_true(s->channels[i].source == CHANNEL_TEXCOORD ||
                                s->attributes[(size_t)n * w + i] == s->attributes[(size_t)n * x + i]);
            }
    assert_true(pairs > 3);
}

/* The colours and normals on both sides of a texture seam, after contractions and after the refit. */
static void classes_have_equal_attributes(void **state) {
    (void)state;
    for (int placement = 0; placement < 4; ++placement) {
        fct_mesh torus = make_torus(&env, 20, false, true);
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = 300, def.placement = (fct_placement)placement;
        fct_simplifier *s;
        fct_stop stop;
        assert_int_equal(fct_simplifier_create(&env, &torus, &def, &s), FCT_OK);
        assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
        check_equal(s);
        assert_int_equal(fct_simplify_refit(s, NULL), FCT_OK);
        check_equal(s);
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &torus);
    }
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(creases_of_one_end_stay),
                                       cmocka_unit_test(classes_have_equal_attributes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
