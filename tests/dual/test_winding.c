/* Closed bodies that are wound inwards: they are found and turned, and nothing else is. */
#include "base/math/vec.h"
#include "facetree/dual.h"
#include "support.h"

static fct_env env;

typedef struct placement {
    float scale, offset;
    bool inward;
} placement;

/* Spheres along the diagonal. */
static fct_mesh make_spheres(const placement *places, uint32_t count, unsigned arrays) {
    fct_mesh one = make_sphere(&env, 6), mesh;
    uint32_t vertices = one.vertex_count, faces = one.face_count;
    assert_int_equal(fct_mesh_create(&env, count * vertices, count * faces, arrays, &mesh), FCT_OK);
    for (uint32_t i = 0; i < count; ++i) {
        for (uint32_t k = 0; k < 3 * vertices; ++k) {
            mesh.positions[3 * i * vertices + k] = places[i].scale * one.positions[k] + places[i].offset;
            if (mesh.normals) mesh.normals[3 * i * vertices + k] = one.positions[k] * (i % 2 ? 1 : -1);
        }
        for (uint32_t f = 0; f < faces; ++f)
            for (uint32_t k = 0; k < 3; ++k) {
                uint32_t from = places[i].inward ? 2 - k : k, corner = 3 * (i * faces + f) + k;
                mesh.triangles[corner] = one.triangles[3 * f + from] + i * vertices;
                for (uint32_t j = 0; j < 2 && mesh.texcoords; ++j) /* names the vertex */
                    mesh.texcoords[2 * (size_t)corner + j] = (float)(mesh.triangles[corner] + j);
            }
    }
    fct_mesh_release(&env, &one);
    return mesh;
}

static double find_volume(const fct_mesh *mesh, uint32_t begin, uint32_t end) {
    double volume = 0;
    for (uint32_t f = begin; f < end; ++f) {
        v3 p[3];
        for (uint32_t k = 0; k < 3; ++k)
            p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)f + k]);
        volume += v3_dot(p[0], v3_cross(p[1], p[2])) / 6;
    }
    return volume;
}

static uint32_t count_inward(const fct_mesh *mesh) {
    uint32_t count;
    assert_int_equal(fct_inward_find(&env, mesh, &count, NULL), FCT_OK);
    return count;
}

/* An outward sphere with a cavity; an inward sphere with an inward one inside; one of each alone. */
static void bodies_are_found_and_turned(void **state) {
    (void)state;
    const placement places[] = {{3, 0, false}, {1, 0, true},   {2, 10, true},
                                {1, 10, true}, {1, 20, false}, {1.5f, 30, true}};
    const bool wrong[] = {false, false, true, true, false, true};
    fct_mesh mesh = make_spheres(places, 6, FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS), before;
    uint32_t faces = mesh.face_count / 6, count;
    uint8_t *marks = malloc(mesh.face_count);
    assert_int_equal(fct_inward_find(&env, &mesh, &count, marks), FCT_OK);
    assert_int_equal(count, 3);
    for (uint32_t f = 0; f < mesh.face_count; ++f) assert_int_equal(marks[f], wrong[f / faces]);
    assert_int_equal(fct_mesh_copy(&env, &mesh, &before), FCT_OK);
    assert_int_equal(fct_inward_flip(&env, &mesh, &count), FCT_OK);
    assert_int_equal(count, 3);
    for (uint32_t i = 0; i < 6; ++i) {
        double was = find_volume(&before, i * faces, (i + 1) * faces);
        double now = find_volume(&mesh, i * faces, (i + 1) * faces);
        assert_float_equal(now, wrong[i] ? -was : was, 1e-9 * fabs(was));
    }
    for (size_t c = 0; c < 3 * (size_t)mesh.face_count; ++c)
        for (uint32_t j = 0; j < 2; ++j)
            assert_true(mesh.texcoords[2 * c + j] == (float)(mesh.triangles[c] + j));
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        uint32_t i = v / (mesh.vertex_count / 6);
        v3 outward = {mesh.positions[3 * (size_t)v] - places[i].offset,
                      mesh.positions[3 * (size_t)v + 1] - places[i].offset,
                      mesh.positions[3 * (size_t)v + 2] - places[i].offset};
        double dot = v3_dot(outward, v3_load(mesh.normals + 3 * (size_t)v));
        assert_true((dot > 0) == (wrong[i] || i % 2)); /* others keep their normals, right or wrong */
    }
    /* The inner one of the two bodies that were turned is now inside an outward body, but outward itself. */
    assert_int_equal(count_inward(&mesh), 0);
    free(marks);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &before);
}

/* Two bodies with a cavity, and 70 small ones between them: the largest bodies are searched. */
static void cavities_of_the_largest_bodies(void **state) {
    (void)state;
    placement places[74] = {{3, 0, false}, {1, 0, true}};
    for (uint32_t i = 2; i < 72; ++i) places[i] = (placement){0.1f + 0.001f * (float)i, 10 * (float)i, false};
    places[72] = (placement){4, 900, false}, places[73] = (placement){1, 900, true};
    for (uint32_t turned = 0; turned < 2; ++turned) {
        fct_mesh mesh = make_spheres(places, 74, 0);
        assert_int_equal(count_inward(&mesh), 0);
        fct_mesh_release(&env, &mesh);
        places[0].scale = 4, places[72].scale = 3;
    }
}

static void other_meshes_are_not_inward(void **state) {
    (void)state;
    const placement inward = {1, 5, true};
    fct_mesh mesh = make_spheres(&inward, 1, 0);
    assert_int_equal(count_inward(&mesh), 1);
    --mesh.face_count; /* open */
    assert_int_equal(count_inward(&mesh), 0);
    ++mesh.face_count;
    uint32_t *t = mesh.triangles + 30, swap = t[0];
    t[0] = t[1], t[1] = swap; /* one face the other way */
    assert_int_equal(count_inward(&mesh), 0);
    t[1] = t[0], t[0] = swap;
    fct_mesh twice; /* every face twice: four at each edge */
    uint32_t corners = 3 * mesh.face_count;
    assert_int_equal(fct_mesh_create(&env, mesh.vertex_count, 2 * mesh.face_count, 0, &twice), FCT_OK);
    memcpy(twice.positions, mesh.positions, 12 * (size_t)mesh.vertex_count);
    for (uint32_t c = 0; c < 2 * corners; ++c) twice.triangles[c] = mesh.triangles[c % corners];
    assert_int_equal(count_inward(&twice), 0);
    fct_mesh_release(&env, &twice);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) mesh.positions[3 * (size_t)v + 2] = 7; /* flat */
    assert_int_equal(count_inward(&mesh), 0);
    mesh.face_count = 0;
    assert_int_equal(count_inward(&mesh), 0);
    mesh.face_count = 1;
    fct_mesh_release(&env, &mesh);
}

/* Two cones over one rough rim, with their tops at one place: their volume is rounding alone. */
static void bodies_without_volume_are_not_inward(void **state) {
    (void)state;
    enum { RIM = 40 };
    uint64_t seed = 1;
    for (int run = 0; run < 50; ++run) {
        fct_mesh mesh;
        assert_int_equal(fct_mesh_create(&env, RIM + 2, 2 * RIM, 0, &mesh), FCT_OK);
        for (size_t k = 0; k < 3 * (size_t)(RIM + 1); ++k) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            mesh.positions[k] = (float)(seed >> 40) * 0x1p-24f;
        }
        memcpy(mesh.positions + 3 * (RIM + 1), mesh.positions + 3 * RIM, 3 * sizeof(float));
        for (uint32_t i = 0; i < RIM; ++i) {
            uint32_t next = (i + 1) % RIM, t[6] = {i, next, RIM, next, i, RIM + 1};
            memcpy(mesh.triangles + 6 * (size_t)i, t, sizeof t);
        }
        assert_int_equal(count_inward(&mesh), 0);
        fct_mesh_release(&env, &mesh);
    }
}

/* Every corner has a vertex of its own. */
static void a_soup_is_a_body(void **state) {
    (void)state;
    const placement inward = {1, 5, true};
    fct_mesh mesh = make_spheres(&inward, 1, 0), soup;
    uint32_t corners = 3 * mesh.face_count, count;
    assert_int_equal(fct_mesh_create(&env, corners, mesh.face_count, 0, &soup), FCT_OK);
    for (uint32_t c = 0; c < corners; ++c) {
        memcpy(soup.positions + 3 * (size_t)c, mesh.positions + 3 * (size_t)mesh.triangles[c], 12);
        soup.triangles[c] = c;
    }
    assert_int_equal(fct_inward_flip(&env, &soup, &count), FCT_OK);
    assert_int_equal(count, 1);
    for (uint32_t f = 0; f < soup.face_count; ++f) {
        const uint32_t turned[3] = {3 * f, 3 * f + 2, 3 * f + 1};
        assert_memory_equal(soup.triangles + 3 * (size_t)f, turned, sizeof turned);
    }
    assert_int_equal(count_inward(&soup), 0);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &soup);
}

static void the_nth_allocation_fails(void **state) {
    (void)state;
    const placement places[] = {{1, 0, true}, {1, 4, false}};
    fct_mesh mesh = make_spheres(places, 2, FCT_MESH_NORMALS), before;
    recorder r = {0};
    fct_env failing = recorder_env(&r);
    fct_result result = FCT_ERROR_MEMORY;
    assert_int_equal(fct_mesh_copy(&env, &mesh, &before), FCT_OK);
    for (long n = 1; result != FCT_OK; ++n) {
        uint32_t count;
        r.allocations = 0, r.fail_at = n;
        result = fct_inward_flip(&failing, &mesh, &count);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
        bool same = !memcmp(mesh.triangles, before.triangles, 12 * (size_t)mesh.face_count);
        assert_true(same == (result != FCT_OK));
        assert_int_equal(r.alive, 0);
        assert_true(n < 100);
    }
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &before);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bodies_are_found_and_turned),
        cmocka_unit_test(cavities_of_the_largest_bodies),
        cmocka_unit_test(other_meshes_are_not_inward),
        cmocka_unit_test(bodies_without_volume_are_not_inward),
        cmocka_unit_test(a_soup_is_a_body),
        cmocka_unit_test(the_nth_allocation_fails),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
