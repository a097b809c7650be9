/* Nodes of GLB scenes: translation, rotation and scale, matrices and parents against vectors that the test
 * rotates by Rodrigues' formula; normals against the plane of the triangle that comes out. */
#include "mesh/mesh_support.h"

static double next(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0 * 2 - 1;
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* p turned by `angle` about the unit vector `axis`. */
static void rotate(const double axis[3], double angle, const double p[3], double out[3]) {
    double across[3], along = dot(axis, p);
    cross(axis, p, across);
    for (int k = 0; k < 3; ++k)
        out[k] = p[k] * cos(angle) + across[k] * sin(angle) + axis[k] * along * (1 - cos(angle));
}

/* One triangle below a node of parts, below a node with a matrix. */
static void check_scene(uint64_t *seed, const double scale[3]) {
    double axis[3], move[3], matrix[3][4], corners[3][3], e1[3], e2[3], normal[3];
    for (int k = 0; k < 3; ++k) axis[k] = next(seed), move[k] = 3 * next(seed);
    double length = sqrt(dot(axis, axis)), angle = 3 * next(seed);
    for (int k = 0; k < 3; ++k) axis[k] /= length;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j) matrix[i][j] = next(seed) + (i == j ? 2 : 0);
    float binary[18];
    for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 3; ++k) corners[c][k] = binary[3 * c + k] = (float)next(seed);
    for (int k = 0; k < 3; ++k) e1[k] = corners[1][k] - corners[0][k], e2[k] = corners[2][k] - corners[0][k];
    cross(e1, e2, normal);
    length = sqrt(dot(normal, normal));
    for (int i = 0; i < 9; ++i) binary[9 + i] = (float)(normal[i % 3] / length);
    char json[2000], columns[400];
    size_t at = 0;
    for (int j = 0; j < 4; ++j)
        at += (size_t)sprintf(columns + at, "%.17g,%.17g,%.17g,%d%s", matrix[0][j], matrix[1][j],
                              matrix[2][j], j == 3, j < 3 ? "," : "");
    double s = sin(angle / 2);
    sprintf(json,
            "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
            "\"nodes\":[{\"matrix\":[%s],\"children\":[1]},{\"mesh\":0,\"translation\":[%.17g,%.17g,%.17g],"
            "\"rotation\":[%.17g,%.17g,%.17g,%.17g],\"scale\":[%.17g,%.17g,%.17g]}],"
            "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1}}]}],"
            "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
            "{\"bufferView\":0,\"byteOffset\":36,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],"
            "\"bufferViews\":[{\"buffer\":0,\"byteLength\":72}],\"buffers\":[{\"byteLength\":72}]}",
            columns, move[0], move[1], move[2], axis[0] * s, axis[1] * s, axis[2] * s, cos(angle / 2),
            scale[0], scale[1], scale[2]);
    recorder r = {0};
    fct_mesh m;
    bytes b = make_glb(json, binary, sizeof binary);
    assert_int_equal(parse_bytes(&r, "glb", b.data, b.size, &m), FCT_OK);
    double out[3][3];
    for (int c = 0; c < 3; ++c) {
        double scaled[3], turned[3];
        for (int k = 0; k < 3; ++k) scaled[k] = scale[k] * corners[c][k];
        rotate(axis, angle, scaled, turned);
        for (int i = 0; i < 3; ++i) {
            double x = matrix[i][3];
            for (int k = 0; k < 3; ++k) x += matrix[i][k] * (turned[k] + move[k]);
            out[c][i] = (double)m.positions[3 * c + i];
            assert_true(fabs(out[c][i] - x) <= 1e-5 * (1 + fabs(x)));
        }
    }
    /* The triangle keeps its front under a mirroring transform, and the normal stays on that side. */
    const uint32_t *t = m.triangles;
    for (int k = 0; k < 3; ++k) e1[k] = out[t[1]][k] - out[t[0]][k], e2[k] = out[t[2]][k] - out[t[0]][k];
    cross(e1, e2, normal);
    length = sqrt(dot(normal, normal));
    for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 3; ++k)
            assert_true(fabs((double)m.normals[3 * c + k] - normal[k] / length) <= 1e-4);
    release(&r, &m);
}

static void transforms_compose(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int trial = 0; trial < 200; ++trial) {
        double scale[3];
        for (int k = 0; k < 3; ++k) scale[k] = (.5 + fabs(next(&seed))) * (trial >> k & 1 ? -1 : 1);
        check_scene(&seed, scale);
    }
}

/* Normalized integers are divided by their range: 127, 255, 32767 and 65535. */
static void normalized_integers_are_divided(void **state) {
    (void)state;
    static const struct {
        int type, size, top;
    } types[] = {{5120, 1, 127}, {5121, 1, 255}, {5122, 2, 32767}, {5123, 2, 65535}};
    for (size_t i = 0; i < sizeof types / sizeof *types; ++i) {
        unsigned char binary[72] = {0};
        const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        memcpy(binary, positions, sizeof positions);
        int values[6] = {types[i].top,     0, types[i].top / 3,
                         types[i].top / 2, 1, i % 2 ? 0 : -types[i].top - 1};
        for (int v = 0; v < 3; ++v)
            for (int k = 0; k < 2; ++k)
                for (int byte = 0; byte < types[i].size; ++byte)
                    binary[36 + 4 * v + types[i].size * k + byte] =
                        (unsigned char)(values[2 * v + k] >> 8 * byte);
        char json[1500];
        sprintf(json,
                "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{"
                "\"mesh\":0}],"
                "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1}}]}],"
                "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
                "{\"bufferView\":1,\"componentType\":%d,\"normalized\":true,\"count\":3,\"type\":\"VEC2\"}],"
                "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,"
                "\"byteLength\":12,\"byteStride\":4}],\"buffers\":[{\"byteLength\":48}]}",
                types[i].type);
        recorder r = {0};
        fct_mesh m;
        bytes b = make_glb(json, binary, 48);
        assert_int_equal(parse_bytes(&r, "glb", b.data, b.size, &m), FCT_OK);
        assert_non_null(m.texcoords);
        for (int k = 0; k < 6; ++k)
            assert_true(fabs((double)m.texcoords[k] - fmax(-1, (double)values[k] / types[i].top)) < 1e-7);
        release(&r, &m);
    }
}

/* Strips turn every second triangle; fans keep their first vertex. */
static void strips_and_fans_keep_the_winding(void **state) {
    (void)state;
    static const uint32_t expected[2][9] = {{0, 1, 2, 1, 3, 2, 2, 3, 4}, {1, 2, 0, 2, 3, 0, 3, 4, 0}};
    for (int fan = 0; fan < 2; ++fan) {
        float positions[15];
        for (int i = 0; i < 15; ++i) positions[i] = (float)(i * i % 7);
        char json[1000];
        sprintf(json,
                "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{"
                "\"mesh\":0}],"
                "\"meshes\":[{\"primitives\":[{\"mode\":%d,\"attributes\":{\"POSITION\":0}}]}],"
                "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":5,\"type\":\"VEC3\"}],"
                "\"bufferViews\":[{\"buffer\":0,\"byteLength\":60}],\"buffers\":[{\"byteLength\":60}]}",
                5 + fan);
        recorder r = {0};
        fct_mesh m;
        bytes b = make_glb(json, positions, sizeof positions);
        assert_int_equal(parse_bytes(&r, "glb", b.data, b.size, &m), FCT_OK);
        assert_int_equal(m.face_count, 3);
        assert_memory_equal(m.triangles, expected[fan], sizeof expected[fan]);
        release(&r, &m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(transforms_compose),
                                       cmocka_unit_test(normalized_integers_are_divided),
                                       cmocka_unit_test(strips_and_fans_keep_the_winding)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
