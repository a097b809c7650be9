/* The extraction of faces, against the corners of the whole mesh. */
#include "mesh/mesh_support.h"

static uint32_t random_below(uint64_t *seed, uint32_t count) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((*seed >> 33) % count);
}

/* Whether corner `c` of the copy has the values of corner `from` of the mesh. */
static void assert_same_corner(const fct_mesh *mesh, size_t from, const fct_mesh *copy, size_t c) {
    size_t v = mesh->triangles[from], w = copy->triangles[c];
    assert_in_range(w, 0, copy->vertex_count - 1);
    assert_memory_equal(mesh->positions + 3 * v, copy->positions + 3 * w, 12);
    assert_memory_equal(mesh->colors + 3 * v, copy->colors + 3 * w, 12);
    assert_memory_equal(mesh->texcoords + 2 * from, copy->texcoords + 2 * c, 8);
}

/* Few faces at the ends of the mesh, many anywhere, one twice, none; in any order. */
static void extracted_faces_keep_their_corners(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    uint64_t seed = 5;
    fct_mesh mesh;
    assert_int_equal(
        fct_mesh_create(&env, 900, 700, FCT_MESH_COLORS | FCT_MESH_TEXCOORDS | FCT_MESH_MATERIALS, &mesh),
        FCT_OK);
    for (uint32_t i = 0; i < 2700; ++i) mesh.positions[i] = (float)i, mesh.colors[i] = (float)(i * 7 % 1000);
    for (uint32_t i = 0; i < 2100; ++i) mesh.triangles[i] = random_below(&seed, 900);
    for (uint32_t i = 0; i < 4200; ++i) mesh.texcoords[i] = (float)i;
    for (uint32_t f = 0; f < 700; ++f) mesh.materials[f] = f;
    for (int round = 0; round < 200; ++round) {
        uint32_t faces[64], count = round % 64, *ids;
        fct_mesh copy;
        for (uint32_t i = 0; i < count; ++i) faces[i] = random_below(&seed, round % 2 ? 700 : 3);
        assert_int_equal(fct_mesh_extract(&env, &mesh, faces, count, &copy, &ids), FCT_OK);
        assert_int_equal(copy.face_count, count);
        for (uint32_t i = 0; i < count; ++i) {
            assert_int_equal(copy.materials[i], faces[i]);
            for (size_t c = 0; c < 3; ++c)
                assert_same_corner(&mesh, 3 * (size_t)faces[i] + c, &copy, 3 * i + c);
        }
        unsigned char used[900] = {0};
        uint32_t distinct = 0;
        for (uint32_t c = 0; c < 3 * count; ++c) {
            uint32_t v = mesh.triangles[3 * faces[c / 3] + c % 3];
            distinct += !used[v];
            used[v] = 1;
            assert_int_equal(ids[copy.triangles[c]], v);
        }
        assert_int_equal(copy.vertex_count, distinct);
        for (uint32_t w = 1; w < copy.vertex_count; ++w) assert_true(ids[w] > ids[w - 1]);
        fct_memory_release(&env, ids);
        fct_mesh_release(&env, &copy);
    }
    fct_mesh_release(&env, &mesh);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(extracted_faces_keep_their_corners)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
