/* tests/mesh/test_inspect.c: counts against pictures, brute force, and real meshes. */
#include "base/math/vec.h"
#include "mesh/mesh_support.h"

static fct_mesh_report inspect(const fct_env *env, const fct_mesh *mesh) {
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(env, mesh, &report), FCT_OK);
    return report;
}

static fct_mesh make(const fct_env *env, uint32_t vertices, const uint32_t *triangles, uint32_t faces) {
    fct_mesh m;
    assert_int_equal(fct_mesh_create(env, vertices, faces, 0, &m), FCT_OK);
    for (uint32_t v = 0; v < vertices; ++v) {
        float p[3] = {(float)v, (float)(v * v), (float)(v % 3)};
        memcpy(m.positions + 3 * (size_t)v, p, sizeof p);
    }
    if (faces) memcpy(m.triangles, triangles, 12 * (size_t)faces);
    return m;
}

static void a_sphere_is_closed(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_sphere(&env, 12);
    fct_mesh_report p = inspect(&env, &m);
    assert_int_equal(p.edges, 3 * p.faces / 2);
    assert_int_equal(p.vertices + p.faces, p.edges + 2);
    assert_int_equal(p.components, 1);
    assert_int_equal(p.boundary_edges + p.boundary_loops + p.nonmanifold_edges + p.misoriented_edges +
                         p.nonmanifold_vertices + p.degenerate_faces + p.duplicate_faces +
                         p.unreferenced_vertices,
                     0);
    assert_true(fabs(p.area - 12.566) < .3);
    assert_int_equal(p.polygons, p.faces);
    release(&r, &m);
}

static void a_grid_has_one_loop(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_grid(&env, 10);
    fct_mesh_report p = inspect(&env, &m);
    assert_int_equal(p.boundary_edges, 40);
    assert_int_equal(p.boundary_loops, 1);
    assert_true(fabs(p.area - 1) < 1e-6 && fabs(p.diagonal - sqrt(2)) < 1e-6);
    release(&r, &m);
}

/*   Two triangles that meet in a vertex; a fin on an edge of a third pair; a twin; a stray vertex 9.
 *       1   3
 *      / \ / \
 *     2---0---4        5-6-7, 5-6-8 and 6-5-... share the edge 5 6
 */
static void counts_what_is_wrong(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    static const uint32_t t[] = {0, 1, 2, 0, 4, 3, 5, 6, 7, 6, 5, 8, 5, 6, 8, 1, 2, 0, 5, 5, 6};
    fct_mesh m = make(&env, 10, t, 7);
    fct_mesh_report p = inspect(&env, &m);
    assert_int_equal(p.nonmanifold_vertices, 1);
    assert_int_equal(p.nonmanifold_edges, 1);
    assert_int_equal(p.duplicate_faces, 2); /* 1 2 0 and 5 6 8 */
    assert_int_equal(p.degenerate_faces, 1);
    assert_int_equal(p.unreferenced_vertices, 1);
    assert_int_equal(p.components, 3);
    assert_int_equal(p.misoriented_edges, 3); /* the sides of the twins that run the same way */
    release(&r, &m);
}

/* The definitions by the letter, in O(F^2). */
static void brute_force(const fct_mesh *m, fct_mesh_report *p) {
    memset(p, 0, sizeof *p);
    uint32_t label[64];
    for (uint32_t f = 0; f < m->face_count; ++f) label[f] = f;
    for (uint32_t a = 0; a < m->vertex_count; ++a)
        for (uint32_t b = a + 1; b < m->vertex_count; ++b) {
            uint32_t faces = 0, first = 0, with[64], up = 0;
            for (uint32_t f = 0; f < m->face_count; ++f) {
                const uint32_t *t = m->triangles + 3 * f;
                bool has = false, runs_up = false;
                for (int k = 0; k < 3; ++k) {
                    uint32_t x = t[k], y = t[(k + 1) % 3];
                    if (!has && ((x == a && y == b) || (x == b && y == a))) has = true, runs_up = x == a;
                }
                if (has) with[faces++] = f, up += runs_up;
            }
            if (!faces) continue;
            first = with[0];
            ++p->edges;
            p->boundary_edges += faces == 1;
            p->nonmanifold_edges += faces > 2;
            p->misoriented_edges += faces == 2 && up != 1;
            for (uint32_t i = 1; i < faces; ++i) {
                uint32_t from = label[with[i]], to = label[first];
                for (uint32_t f = 0; f < m->face_count; ++f)
                    if (label[f] == from) label[f] = to;
            }
        }
    for (uint32_t f = 0; f < m->face_count; ++f) {
        bool seen = false;
        for (uint32_t g = 0; g < f; ++g) seen |= label[g] == label[f];
        p->components += !seen;
        bool twin = false;
        const uint32_t *t = m->triangles + 3 * f;
        for (uint32_t g = 0; g < f; ++g) {
            const uint32_t *u = m->triangles + 3 * g;
            static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                             {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
            for (int o = 0; o < 6; ++o)
                twin |= t[0] == u[orders[o][0]] && t[1] == u[orders[o][1]] && t[2] == u[orders[o][2]];
        }
        p->duplicate_faces += twin;
    }
    for (uint32_t v = 0; v < m->vertex_count; ++v) { /* faces at v, joined where they share an edge at v */
        uint32_t at[64], mark[64], count = 0, fans = 0;
        for (uint32_t f = 0; f < m->face_count; ++f) {
            const uint32_t *t = m->triangles + 3 * f;
            if (t[0] == v || t[1] == v || t[2] == v) at[count] = f, mark[count] = count, ++count;
        }
        for (uint32_t i = 0; i < count; ++i)
            for (uint32_t j = 0; j < i; ++j)
                for (int k = 0; k < 3; ++k)
                    for (int l = 0; l < 3; ++l) {
                        uint32_t x = m->triangles[3 * at[i] + k];
                        if (x == v || x != m->triangles[3 * at[j] + l]) continue;
                        uint32_t from = mark[i], to = mark[j];
                        for (uint32_t n = 0; n < count; ++n)
                            if (mark[n] == from) mark[n] = to;
                    }
        for (uint32_t i = 0; i < count; ++i) {
            bool seen = false;
            for (uint32_t j = 0; j < i; ++j) seen |= mark[j] == mark[i];
            fans += !seen;
        }
        p->nonmanifold_vertices += fans > 1;
        p->unreferenced_vertices += count == 0;
    }
}

/* Random soups over few vertices are full of every kind of trouble. Faces that repeat an index are left out
 * of these: which of their sides comes first is a matter of taste. */
static void agrees_with_brute_force(void **state) {
    (void)state;
    uint32_t seed = 1;
    for (int round = 0; round < 300; ++round) {
        recorder r = {0};
        fct_env env = recorder_env(&r);
        uint32_t triangles[3 * 40], faces = 1 + (uint32_t)round % 40, vertices = 4 + (uint32_t)round % 13;
        for (uint32_t f = 0; f < faces;) {
            uint32_t *t = triangles + 3 * f;
            for (int k = 0; k < 3; ++k) seed = seed * 1664525u + 1013904223u, t[k] = (seed >> 16) % vertices;
            f += t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        }
        fct_mesh m = make(&env, vertices, triangles, faces);
        fct_mesh_report p = inspect(&env, &m), q;
        brute_force(&m, &q);
        assert_int_equal(p.edges, q.edges);
        assert_int_equal(p.boundary_edges, q.boundary_edges);
        assert_int_equal(p.nonmanifold_edges, q.nonmanifold_edges);
        assert_int_equal(p.misoriented_edges, q.misoriented_edges);
        assert_int_equal(p.nonmanifold_vertices, q.nonmanifold_vertices);
        assert_int_equal(p.duplicate_faces, q.duplicate_faces);
        assert_int_equal(p.unreferenced_vertices, q.unreferenced_vertices);
        assert_int_equal(p.components, q.components);
        env.thread_count = 1;
        fct_mesh_report single = inspect(&env, &m);
        assert_memory_equal(&p, &single,
                            offsetof(fct_mesh_report, bounds)); /* padding comes after the bounds */
        assert_memory_equal(&p.bounds, &single.bounds, sizeof p.bounds);
        assert_true(p.area == single.area && p.diagonal == single.diagonal);
        release(&r, &m);
    }
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    recorder quiet = {0};
    fct_env ample = recorder_env(&quiet);
    fct_mesh m = make_full(&ample);
    for (long n = 1, done = 0; done < 3; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        fct_mesh_report report;
        fct_mesh copy;
        uint32_t *ids, faces[] = {5, 0};
        done = 0;
        fct_result result = fct_mesh_inspect(&env, &m, &report);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
        done += result == FCT_OK;
        assert_int_equal(r.alive, 0);
        r.allocations = 0;
        result = fct_mesh_copy(&env, &m, &copy);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
        done += result == FCT_OK;
        if (result == FCT_OK) assert_same_mesh(&m, &copy);
        fct_mesh_release(&env, &copy);
        assert_int_equal(r.alive, 0);
        r.allocations = 0;
        result = fct_mesh_extract(&env, &m, faces, 2, &copy, &ids);
        assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
        done += result == FCT_OK;
        fct_mesh_release(&env, &copy);
        fct_memory_release(&env, ids);
        assert_int_equal(r.alive, 0);
    }
    release(&quiet, &m);
}

static void extract_brings_everything_along(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_full(&env), part;
    uint32_t *ids, faces[] = {6, 1, 6};
    assert_int_equal(fct_mesh_extract(&env, &m, faces, 3, &part, &ids), FCT_OK);
    assert_int_equal(part.face_count, 3);
    for (uint32_t v = 0; v < part.vertex_count; ++v) {
        assert_true(v == 0 || ids[v] > ids[v - 1]);
        assert_memory_equal(part.positions + 3 * v, m.positions + 3 * ids[v], 12);
        assert_memory_equal(part.colors + 3 * v, m.colors + 3 * ids[v], 12);
        assert_memory_equal(part.normals + 3 * v, m.normals + 3 * ids[v], 12);
    }
    for (uint32_t i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k)
            assert_int_equal(ids[part.triangles[3 * i + k]], m.triangles[3 * faces[i] + k]);
        assert_memory_equal(part.texcoords + 6 * i, m.texcoords + 6 * faces[i], 24);
        assert_memory_equal(part.face_colors + 3 * i, m.face_colors + 3 * faces[i], 12);
        assert_int_equal(part.materials[i], m.materials[faces[i]]);
    }
    assert_string_equal(part.material_names[2], m.material_names[2]);
    fct_memory_release(&env, ids);
    fct_mesh_release(&env, &part);
    release(&r, &m);
}

static void validate_names_the_culprit(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_mesh m = make_full(&env);
    assert_int_equal(fct_mesh_validate(&env, &m), FCT_OK);
    m.triangles[10] = 9;
    assert_int_equal(fct_mesh_validate(&env, &m), FCT_ERROR_DATA);
    assert_string_equal(r.text, "face 3: vertex index 9 is out of range, of 9 vertices");
    m.triangles[10] = 0;
    m.materials[7] = 3;
    assert_int_equal(fct_mesh_validate(&env, &m), FCT_ERROR_DATA);
    assert_string_equal(r.text, "face 7: material 3 is out of range, of 3 materials");
    m.materials[7] = 0;
    float *places[] = {m.positions + 4, m.colors + 4, m.normals + 4, m.texcoords + 7, m.face_colors + 4};
    static const char *const messages[] = {
        "vertex 1: its position is not finite (nan)", "vertex 1: its colour is not finite (nan)",
        "vertex 1: its normal is not finite (nan)", "face 1: its texture coordinate is not finite (nan)",
        "face 1: its colour is not finite (nan)"};
    for (int i = 0; i < 5; ++i) {
        float before = *places[i];
        *places[i] = NAN;
        assert_int_equal(fct_mesh_validate(&env, &m), FCT_ERROR_DATA);
        assert_string_equal(r.text, messages[i]);
        *places[i] = before;
    }
    assert_int_equal(fct_mesh_validate(&env, &m), FCT_OK);
    release(&r, &m);
}

/* One edge of 10^5 triangles, a vertex of as many corners, 10^5 loose triangles: none of them takes squares.
 */
static void crowds_are_counted_quickly(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    enum { N = 100000 };
    uint32_t *t = malloc(sizeof(uint32_t) * 3 * N);
    for (uint32_t f = 0; f < N; ++f) t[3 * f] = 0, t[3 * f + 1] = 1, t[3 * f + 2] = f + 2;
    fct_mesh m = make(&env, N + 2, t, N);
    fct_mesh_report p = inspect(&env, &m);
    assert_int_equal(p.nonmanifold_edges, 1);
    assert_int_equal(p.components, 1);
    assert_int_equal(p.boundary_edges, 2 * N);
    fct_mesh_release(&env, &m);
    for (uint32_t i = 0; i < 3 * N; ++i) t[i] = i;
    m = make(&env, 3 * N, t, N);
    p = inspect(&env, &m);
    assert_int_equal(p.components, N);
    assert_int_equal(p.boundary_loops, N);
    free(t);
    release(&r, &m);
}

/* The lines of an OBJ that begin with `letter` and a blank. */
static uint32_t count_lines(const char *path, char letter) {
    FILE *file = fopen(path, "rb");
    uint32_t count = 0;
    for (int before = '\n', c; (c = getc(file)) != EOF; before = c)
        if (before == '\n' && c == letter) {
            int next = getc(file);
            count += next == ' ' || next == '\t';
            if (next != EOF) ungetc(next, file);
        }
    fclose(file);
    return count;
}

static void real_meshes_have_known_counts(void **state) {
    (void)state;
    static const struct {
        const char *name;
        uint32_t faces, boundary, nonmanifold;
    } meshes[] = {{"cow", 5804, 0, 0},           {"fandisk", 12946, 0, 0},
                  {"rocker-arm", 20088, 0, 0},   {"spot", 5856, 0, 0},
                  {"nefertiti", 99938, 0, 0},    {"stanford-bunny", 69451, 223, 0},
                  {"suzanne", 968, FCT_NONE, 1}, {"cornell/cornell_box", 36, FCT_NONE, FCT_NONE}};
    if (!file_exists(FACETREE_DATA "/cow.obj")) skip();
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; ++i) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s.obj", FACETREE_DATA, meshes[i].name);
        recorder r = {0};
        fct_env env = recorder_env(&r);
        fct_mesh m;
        assert_int_equal(fct_mesh_load(&env, path, &m), FCT_OK);
        fct_mesh_report p = inspect(&env, &m);
        assert_int_equal(p.vertices, count_lines(path, 'v'));
        assert_int_equal(p.polygons, count_lines(path, 'f'));
        assert_int_equal(p.faces, meshes[i].faces);
        if (meshes[i].boundary != FCT_NONE) assert_int_equal(p.boundary_edges, meshes[i].boundary);
        if (meshes[i].nonmanifold != FCT_NONE) assert_int_equal(p.nonmanifold_edges, meshes[i].nonmanifold);
        if (!strcmp(meshes[i].name, "spot")) assert_non_null(m.texcoords);
        if (!strcmp(meshes[i].name, "cornell/cornell_box")) assert_int_equal(m.material_count, 8);
        release(&r, &m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sphere_is_closed),
        cmocka_unit_test(a_grid_has_one_loop),
        cmocka_unit_test(counts_what_is_wrong),
        cmocka_unit_test(agrees_with_brute_force),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(extract_brings_everything_along),
        cmocka_unit_test(validate_names_the_culprit),
        cmocka_unit_test(crowds_are_counted_quickly),
        cmocka_unit_test(real_meshes_have_known_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
