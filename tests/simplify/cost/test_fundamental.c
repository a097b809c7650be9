/* The initial quadric of every wedge against the direct sum over its faces. */
#include "../oracle.h"

static fct_env env;

static double side_length(const fct_simplifier *s, uint32_t c, uint32_t d) {
    return v3_norm(
        v3_sub(scaled_vertex(s->mesh, s->mesh->triangles[d]), scaled_vertex(s->mesh, s->mesh->triangles[c])));
}

/* Heron's area and the law of cosines. */
static double face_area(const fct_simplifier *s, uint32_t f) {
    double a = side_length(s, 3 * f, 3 * f + 1), b = side_length(s, 3 * f + 1, 3 * f + 2);
    double c = side_length(s, 3 * f + 2, 3 * f), h = .5 * (a + b + c);
    return sqrt(fmax(h * (h - a) * (h - b) * (h - c), 0));
}

static double corner_weight(const fct_simplifier *s, uint32_t c) {
    uint32_t f = c - c % 3, x = f + (c + 1) % 3, y = f + (c + 2) % 3, count = 0;
    double area = face_area(s, c / 3), sum = 0;
    if (area < 1e-12) return 0;
    if (s->def->weighting == FCT_WEIGHT_AREA) return area / 3;
    for (uint32_t g = 0; g < s->mesh->face_count; ++g)
        if (face_area(s, g) >= 1e-12) sum += face_area(s, g), ++count;
    if (s->def->weighting == FCT_WEIGHT_UNIFORM) return sum / (3 * count);
    double a = side_length(s, c, x), b = side_length(s, c, y), d = side_length(s, x, y);
    return sum * acos((a * a + b * b - d * d) / (2 * a * b)) / (3.141592653589793 * count);
}

/* The sum over the corners of one wedge at the vector v: the weight of each corner times the squared
 * distance from its plane. */
static double direct_sum(const fct_simplifier *s, uint32_t wedge, const double *v) {
    const fct_mesh *mesh = s->mesh;
    double sum = 0;
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c) {
        uint32_t own = s->corner_wedges ? s->corner_wedges[c] : s->triangles[c], f = 3 * (c / 3);
        if (own != wedge) continue;
        double x[3][3 + SIMPLIFY_MAX_CHANNELS];
        for (uint32_t k = 0; k < 3; ++k) corner_vector(s, f + k, s->steering, x[k]);
        v3 corner[3];
        for (int k = 0; k < 3; ++k) corner[k] = (v3){x[k][0], x[k][1], x[k][2]};
        double area = .5 * v3_norm(v3_cross(v3_sub(corner[1], corner[0]), v3_sub(corner[2], corner[0])));
        if (area == 0) continue;
        sum += corner_weight(s, c) * squared_distance((int)(3 + s->steering), x[0], x[1], x[2], v);
    }
    return sum;
}

static double wedge_area(const fct_simplifier *s, uint32_t wedge) {
    double area = 0;
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c)
        if ((s->corner_wedges ? s->corner_wedges[c] : s->triangles[c]) == wedge) area += corner_weight(s, c);
    return area;
}

static void check_wedges(const fct_mesh *mesh, const fct_simplify_def *def) {
    fct_simplifier *s = open_simplifier(&env, mesh, def);
    uint64_t seed = 7;
    for (uint32_t w = 0; w < s->wedge_count; ++w) {
        const double *q = wedge_quadric(s, w);
        assert_close(q[10], wedge_area(s, w), 1e-12);
        for (int k = 0; k < 3; ++k) {
            double v[3 + SIMPLIFY_MAX_CHANNELS];
            for (uint32_t i = 0; i < 3 + s->steering; ++i) v[i] = between(&seed, -.6, .6);
            double got = fct_quadric_value(q, s->steering, (v3){v[0], v[1], v[2]}, v + 3);
            assert_ratio(got, direct_sum(s, w, v), 1e-6);
        }
    }
    fct_simplifier_destroy(s);
}

/* Every combination of arrays. */
static void quadrics_are_direct_sums(void **state) {
    (void)state;
    for (size_t i = 0; i < ARRAY_SETS; ++i)
        for (int kind = 0; kind < 4; ++kind) {
            fct_mesh mesh = make_sheet(&env, array_sets[i], 11 + i);
            fct_simplify_def def = fct_simplify_def_default();
            def.weighting = kind < 2 ? FCT_WEIGHT_AREA : kind == 2 ? FCT_WEIGHT_ANGLE : FCT_WEIGHT_UNIFORM;
            if (kind == 1) def.color_weight = .7, def.texcoord_weight = .3, def.normal_weight = 0;
            check_wedges(&mesh, &def);
            fct_mesh_release(&env, &mesh);
        }
}

/* A duplicate counts like any face; a face without area adds nothing. */
static void duplicates_and_slivers(void **state) {
    (void)state;
    fct_mesh mesh = make_slivers(&env);
    fct_simplify_def def = fct_simplify_def_default();
    for (int k = FCT_WEIGHT_AREA; k <= FCT_WEIGHT_UNIFORM; ++k) {
        def.weighting = (fct_weighting)k;
        check_wedges(&mesh, &def);
    }
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadrics_are_direct_sums),
        cmocka_unit_test(duplicates_and_slivers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
