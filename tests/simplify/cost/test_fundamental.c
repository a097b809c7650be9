/* The initial quadric of every wedge against the direct sum over its faces and constraint planes. */
#include "../oracle.h"

static fct_env env;

/* Whether corner d begins a side between the same two points as side c; *same_way: in the same direction. */
static bool side_is_shared(const fct_simplifier *s, uint32_t c, uint32_t d, bool *same_way) {
    const uint32_t *t = s->triangles;
    uint32_t c2 = c - c % 3 + (c + 1) % 3, d2 = d - d % 3 + (d + 1) % 3;
    *same_way = t[c] == t[d] && t[c2] == t[d2];
    return *same_way || (t[c] == t[d2] && t[c2] == t[d]);
}

static double gap_between(const fct_simplifier *s, uint32_t c, uint32_t d) {
    double sum = 0;
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t k = 0; k < 3 * s->mesh->face_count; ++k) {
            double value = raw_value(s->mesh, &s->channels[i], k);
            low = fmin(low, value), high = fmax(high, value);
        }
        double difference = raw_value(s->mesh, &s->channels[i], c) - raw_value(s->mesh, &s->channels[i], d);
        if (high > low) sum += difference * difference / ((high - low) * (high - low));
    }
    return fmin(sum, 1);
}

static bool faces_have_a_border(const fct_mesh *mesh, uint32_t f, uint32_t g, double threshold) {
    double sum = 0;
    for (int k = 0; k < 3 && mesh->face_colors; ++k)
        sum += fabs((double)mesh->face_colors[3 * f + k] - mesh->face_colors[3 * g + k]);
    return (mesh->materials && mesh->materials[f] != mesh->materials[g]) || sum > threshold;
}

/* 1 at boundaries and borders, the squared gap at seams, else 0. */
static double side_strength(const fct_simplifier *s, uint32_t c) {
    const fct_mesh *mesh = s->mesh;
    double strength = 0;
    bool open = true;
    uint32_t c2 = c - c % 3 + (c + 1) % 3;
    for (uint32_t d = 0; d < 3 * mesh->face_count; ++d) {
        bool same_way;
        if (d / 3 == c / 3 || !side_is_shared(s, c, d, &same_way)) continue;
        uint32_t d2 = d - d % 3 + (d + 1) % 3, apex_c = c - c % 3 + (c + 2) % 3,
                 apex_d = d - d % 3 + (d + 2) % 3;
        if (s->triangles[apex_c] != s->triangles[apex_d]) open = false;
        if (faces_have_a_border(mesh, c / 3, d / 3, s->def->feature_threshold)) strength = 1;
        if (!s->channel_count) continue;
        strength = fmax(strength, gap_between(s, c, same_way ? d : d2));
        strength = fmax(strength, gap_between(s, c2, same_way ? d2 : d));
    }
    return open ? 1 : strength;
}

/* The sum over the corners of one wedge at the vector v: a third of each face's area times the squared
 * distance from its plane, and the constraint planes through the sides at the corner. */
static double direct_sum(const fct_simplifier *s, uint32_t wedge, const double *v) {
    const fct_mesh *mesh = s->mesh;
    double sum = 0;
    v3 p = {v[0], v[1], v[2]};
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c) {
        uint32_t own = s->corner_wedges ? s->corner_wedges[c] : s->triangles[c], f = 3 * (c / 3);
        if (own != wedge) continue;
        double x[3][3 + SIMPLIFY_MAX_CHANNELS];
        for (uint32_t k = 0; k < 3; ++k) corner_vector(s, f + k, s->steering, x[k]);
        v3 corner[3];
        for (int k = 0; k < 3; ++k) corner[k] = (v3){x[k][0], x[k][1], x[k][2]};
        v3 normal = v3_cross(v3_sub(corner[1], corner[0]), v3_sub(corner[2], corner[0]));
        double area = .5 * v3_norm(normal);
        if (area == 0) continue;
        sum += area / 3 * squared_distance((int)(3 + s->steering), x[0], x[1], x[2], v);
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t other = (k + 1) % 3;
            if (c != f + k && c != f + other) continue;
            v3 side = v3_sub(corner[other], corner[k]);
            v3 across = v3_unit(v3_cross(v3_unit(normal), side));
            double distance = v3_dot(across, v3_sub(p, corner[k]));
            sum += s->def->boundary_weight * side_strength(s, f + k) * v3_norm2(side) * distance * distance;
        }
    }
    return sum;
}

static double wedge_area(const fct_simplifier *s, uint32_t wedge) {
    double area = 0;
    for (uint32_t c = 0; c < 3 * s->mesh->face_count; ++c) {
        if ((s->corner_wedges ? s->corner_wedges[c] : s->triangles[c]) != wedge) continue;
        v3 a = scaled_vertex(s->mesh, s->mesh->triangles[3 * (c / 3)]);
        v3 b = scaled_vertex(s->mesh, s->mesh->triangles[3 * (c / 3) + 1]);
        v3 d = scaled_vertex(s->mesh, s->mesh->triangles[3 * (c / 3) + 2]);
        area += v3_norm(v3_cross(v3_sub(b, a), v3_sub(d, a))) / 6;
    }
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

/* Every combination of arrays, with weights for the constraints that neither hide the faces nor vanish. */
static void quadrics_are_direct_sums(void **state) {
    (void)state;
    const unsigned arrays[] = {0,
                               FCT_MESH_COLORS,
                               FCT_MESH_MATERIALS,
                               FCT_MESH_FACE_COLORS,
                               FCT_MESH_TEXCOORDS,
                               FCT_MESH_NORMALS,
                               FCT_MESH_COLORS | FCT_MESH_MATERIALS | FCT_MESH_FACE_COLORS,
                               ALL_ARRAYS};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i)
        for (int kind = 0; kind < 3; ++kind) {
            fct_mesh mesh = make_sheet(&env, arrays[i], 11 + i);
            fct_simplify_def def = fct_simplify_def_default();
            def.boundary_weight = kind == 0 ? .5 : kind == 1 ? 0 : 1000;
            if (kind == 1) def.color_weight = .7, def.texcoord_weight = .3, def.normal_weight = 0;
            check_wedges(&mesh, &def);
            fct_mesh_release(&env, &mesh);
        }
}

/* A seam from black to white differs by more than 1 in sum, and is held like a boundary. */
static void strong_seams_are_held_like_boundaries(void **state) {
    (void)state;
    fct_mesh mesh = make_sheet(&env, FCT_MESH_COLORS, 13);
    for (uint32_t v = 25; v < 30; ++v)
        for (uint32_t k = 0; k < 3; ++k)
            mesh.colors[3 * v + k] = 1, mesh.colors[3 * ((v - 25) * 5 + 2) + k] = 0;
    fct_simplify_def def = fct_simplify_def_default();
    def.boundary_weight = .5;
    check_wedges(&mesh, &def);
    fct_mesh_release(&env, &mesh);
}

/* A duplicate of a boundary face leaves its open sides open; a face without area adds nothing. */
static void duplicates_and_slivers(void **state) {
    (void)state;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 6, 6, 0, &mesh), FCT_OK);
    const float p[18] = {0, 0, 0, 1, 0, .2f, 1, 1, 0, 0, 1, .1f, 2, 0, .4f, .5f, 0, .1f};
    const uint32_t t[18] = {0, 1, 2, 0, 2, 3, 1, 2, 0, 1, 4, 2, 0, 5, 1, 3, 0, 2};
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    fct_simplify_def def = fct_simplify_def_default();
    def.boundary_weight = .5;
    check_wedges(&mesh, &def);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadrics_are_direct_sums),
        cmocka_unit_test(strong_seams_are_held_like_boundaries),
        cmocka_unit_test(duplicates_and_slivers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
