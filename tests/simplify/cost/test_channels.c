/* The scales of attributes: ranges, weights, order, and the values of wedges. */
#include "../oracle.h"

static fct_env env;

static fct_simplifier *open_colored(fct_mesh *mesh, const float *reds, uint32_t count, double weight,
                                    fct_simplify_def *def) {
    assert_int_equal(fct_mesh_create(&env, count, count / 3, FCT_MESH_COLORS, mesh), FCT_OK);
    for (uint32_t v = 0; v < count; ++v) {
        mesh->positions[3 * v] = (float)v, mesh->positions[3 * v + 1] = (float)(v % 7);
        mesh->positions[3 * v + 2] = 0;
        for (int k = 0; k < 3; ++k) mesh->colors[3 * v + k] = reds[v];
        mesh->triangles[v] = v;
    }
    *def = fct_simplify_def_default();
    def->color_weight = weight;
    return open_simplifier(&env, mesh, def);
}

static void colors_scale_by_the_middle_of_their_range(void **state) {
    (void)state;
    enum { COUNT = 3000 };
    static float reds[COUNT];
    const struct {
        double tail, far, range; /* share of vertices at `far`; the others spread evenly over [0, 1] */
    } cases[] = {{0, 1, .96},
                 {.01, 3, .9696}, /* 1 % of outliers: 1 % more are cut from [0, 1] above, 2 % below */
                 {.001, 100, 5} /* at least a twentieth of the full range */};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        uint32_t outliers = (uint32_t)lround(cases[k].tail * COUNT), rest = COUNT - outliers;
        for (uint32_t v = 0; v < COUNT; ++v)
            reds[v] = v < rest ? (float)((v + .5) / rest) : (float)cases[k].far;
        fct_mesh mesh;
        fct_simplify_def def;
        fct_simplifier *s = open_colored(&mesh, reds, COUNT, .3, &def);
        assert_int_equal(s->channel_count, 3);
        assert_int_equal(s->steering, 3);
        for (int i = 0; i < 3; ++i) {
            const fct_channel *channel = &s->channels[i];
            assert_ratio(channel->factor, .3 / cases[k].range, .006);
            assert_ratio(channel->unit, .3, 1e-12);
            assert_ratio(channel->lower, channel->factor * reds[0], 1e-12);
            assert_ratio(channel->upper, channel->factor * reds[COUNT - 1], 1e-12);
        }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
}

static void equal_colors_count_by_their_weight(void **state) {
    (void)state;
    float reds[6] = {.5f, .5f, .5f, .5f, .5f, .5f};
    fct_mesh mesh;
    fct_simplify_def def;
    fct_simplifier *s = open_colored(&mesh, reds, 6, .2, &def);
    assert_close(s->channels[0].factor, .2, 1e-15);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

/* The bounds are 2999 units long, and the range of the colours is .96. */
static void the_automatic_weight_falls_with_the_faces(void **state) {
    (void)state;
    enum { COUNT = 3000 };
    static float reds[COUNT];
    for (uint32_t v = 0; v < COUNT; ++v) reds[v] = (v + .5f) / COUNT;
    const struct {
        uint32_t target_faces;
        double max_error, weight;
    } cases[] = {{900, INFINITY, 2. / 30},  {400, INFINITY, .1},         {100, INFINITY, .1},
                 {0, 2999. / 625, 2. / 25}, {900, 2999. / 625, 2. / 30}, {625, 2999. / 900, 2. / 30},
                 {0, INFINITY, .1},         {0, 0, 2 / sqrt(1000)},      {5000, INFINITY, 2 / sqrt(1000)}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        fct_mesh mesh;
        fct_simplify_def def;
        fct_simplifier *s = open_colored(&mesh, reds, COUNT, .3, &def);
        fct_simplifier_destroy(s);
        def = fct_simplify_def_default();
        def.target_faces = cases[k].target_faces, def.max_error = cases[k].max_error;
        s = open_simplifier(&env, &mesh, &def);
        assert_int_equal(s->steering, 3);
        for (int i = 0; i < 3; ++i) {
            assert_ratio(s->channels[i].factor, cases[k].weight / .96, .006);
            assert_ratio(s->channels[i].unit, cases[k].weight, 1e-12);
            assert_ratio(s->channels[i].upper, s->channels[i].factor * reds[COUNT - 1], 1e-12);
            assert_ratio(s->channels[i].lower, s->channels[i].factor * reds[0], 1e-12);
        }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
}

static double raw_range(const fct_mesh *mesh, const fct_channel *channel, double *low, double *high) {
    *low = INFINITY, *high = -INFINITY;
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c) {
        double value = raw_value(mesh, channel, c);
        *low = fmin(*low, value), *high = fmax(*high, value);
    }
    return *high - *low;
}

static void check_limits(const fct_simplifier *s) {
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        double low, high;
        raw_range(s->mesh, &s->channels[i], &low, &high);
        assert_close(s->channels[i].lower, s->channels[i].factor * low, 1e-15);
        assert_close(s->channels[i].upper, s->channels[i].factor * high, 1e-15);
        if (s->channels[i].source != CHANNEL_COLOR)
            assert_close(s->channels[i].unit, s->channels[i].factor * (high - low), 1e-15);
    }
}

static void attributes_of_weight_zero_come_last(void **state) {
    (void)state;
    fct_mesh mesh = make_sheet(&env, ALL_ARRAYS, 3);
    for (unsigned zero = 0; zero < 8; ++zero) {
        fct_simplify_def def = fct_simplify_def_default();
        def.color_weight = zero & 1 ? 0 : .5, def.texcoord_weight = zero & 2 ? 0 : .25;
        def.normal_weight = zero & 4 ? 0 : .125;
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        assert_int_equal(s->channel_count, 8);
        assert_int_equal(s->steering, (zero & 1 ? 0 : 3) + (zero & 2 ? 0 : 2) + (zero & 4 ? 0 : 3));
        assert_int_equal(s->quadric_size, 11 + 4 * s->steering + s->steering * (s->steering + 1) / 2);
        double low, high, range_u = 0;
        for (uint32_t i = 0; i < 8; ++i)
            if (s->channels[i].source == CHANNEL_TEXCOORD)
                range_u = fmax(range_u, raw_range(&mesh, &s->channels[i], &low, &high));
        unsigned seen = 0;
        for (uint32_t i = 0; i < 8; ++i) {
            const fct_channel *channel = &s->channels[i];
            bool steers = i < s->steering;
            if (channel->source == CHANNEL_COLOR) assert_true(steers == !(zero & 1));
            if (channel->source == CHANNEL_NORMAL) {
                assert_true(steers == !(zero & 4));
                assert_close(channel->factor, .5 * (steers ? .125 : 1), 1e-15);
            }
            if (channel->source == CHANNEL_TEXCOORD) {
                assert_true(steers == !(zero & 2));
                assert_close(channel->factor, (steers ? .25 : 1) / range_u, 1e-12);
            }
            unsigned bit = 1u << (3 * (channel->source == CHANNEL_NORMAL) +
                                  6 * (channel->source == CHANNEL_TEXCOORD) + channel->component);
            assert_false(seen & bit);
            seen |= bit;
        }
        check_limits(s);
        fct_simplifier_destroy(s);
    }
    fct_mesh_release(&env, &mesh);
}

static void wedges_hold_the_scaled_values_of_their_corners(void **state) {
    (void)state;
    fct_mesh mesh = make_sheet(&env, ALL_ARRAYS, 5);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    for (uint32_t c = 0; c < 3 * mesh.face_count; ++c) {
        double want[3 + SIMPLIFY_MAX_CHANNELS];
        corner_vector(s, c, s->channel_count, want);
        for (uint32_t i = 0; i < s->channel_count; ++i)
            assert_close(s->attributes[(size_t)s->channel_count * s->corner_wedges[c] + i], want[3 + i],
                         1e-15);
        v3 p = point_position(s, s->triangles[c]);
        assert_close(p.x, want[0], 1e-12);
        assert_close(p.y, want[1], 1e-12);
        assert_close(p.z, want[2], 1e-12);
    }
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colors_scale_by_the_middle_of_their_range),
        cmocka_unit_test(the_automatic_weight_falls_with_the_faces),
        cmocka_unit_test(equal_colors_count_by_their_weight),
        cmocka_unit_test(attributes_of_weight_zero_come_last),
        cmocka_unit_test(wedges_hold_the_scaled_values_of_their_corners),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
