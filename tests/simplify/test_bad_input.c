/* Degenerate and non-manifold input, hubs, bad options, failing allocations, cancelling, and equal bits from
 * every run. */
#include "shapes.h"

static fct_env env;

static fct_mesh make(uint32_t vertices, uint32_t faces) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, vertices, faces, 0, &mesh), FCT_OK);
    memset(mesh.positions, 0, 12 * (size_t)vertices);
    memset(mesh.triangles, 0, 12 * (size_t)faces);
    return mesh;
}

static void set_face(fct_mesh *mesh, uint32_t f, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t t[3] = {a, b, c};
    memcpy(mesh->triangles + 3 * (size_t)f, t, sizeof t);
}

static fct_mesh to_count(const fct_mesh *mesh, uint32_t faces, fct_simplify_stats *stats) {
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = faces;
    return simplified(&env, mesh, &def, stats);
}

static void an_empty_mesh_stays_empty(void **state) {
    (void)state;
    for (uint32_t vertices = 0; vertices < 3; vertices += 2) {
        fct_mesh mesh = make(vertices, 0);
        fct_simplify_stats stats;
        fct_mesh out = to_count(&mesh, 0, &stats);
        assert_int_equal(out.face_count + out.vertex_count, 0);
        assert_int_equal(stats.stopped_because, FCT_STOP_FACES);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &mesh);
    }
}

static void one_triangle(void **state) {
    (void)state;
    fct_mesh mesh = make(5, 1);
    float p[15] = {9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 8, 8, 8};
    memcpy(mesh.positions, p, sizeof p);
    set_face(&mesh, 0, 1, 2, 3);
    fct_mesh out = to_count(&mesh, 1, NULL);
    assert_int_equal(out.vertex_count, 3); /* unreferenced vertices are dropped */
    assert_memory_equal(out.positions, mesh.positions + 3, 36);
    fct_mesh_release(&env, &out);
    out = to_count(&mesh, 0, NULL);
    assert_int_equal(out.face_count, 0);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* Nothing else covers what a contraction of flat open faces takes, so it is an error, also without the checks
 * of faces. */
static void flat_open_faces_stay_within_the_error(void **state) {
    (void)state;
    const float p[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    for (uint32_t faces = 1; faces <= 2; ++faces)
        for (int checked = 0; checked < 2; ++checked) {
            fct_mesh mesh = make(4, faces);
            memcpy(mesh.positions, p, sizeof p);
            for (uint32_t f = 0; f < faces; ++f) set_face(&mesh, f, 0, f + 1, f + 2);
            fct_simplify_def def = fct_simplify_def_default();
            def.boundary_weight = 0;
            def.max_error = 1e-6;
            def.check_foldover = checked;
            fct_simplify_stats stats;
            fct_mesh out = simplified(&env, &mesh, &def, &stats);
            assert_int_equal(out.face_count, faces);
            assert_int_equal(stats.stopped_because, FCT_STOP_ERROR);
            fct_mesh_release(&env, &out);
            fct_mesh_release(&env, &mesh);
        }
}

static void degenerate_faces(void **state) {
    (void)state;
    /* Faces with all corners at one place, with repeated ids, and with corners in line. */
    fct_mesh mesh = make(300, 200);
    for (uint32_t v = 0; v < 300; ++v) mesh.positions[3 * v] = v < 100 ? 0 : (float)v;
    for (uint32_t f = 0; f < 200; ++f) {
        if (f < 50)
            set_face(&mesh, f, f, f + 1, f + 2);
        else if (f < 100)
            set_face(&mesh, f, f + 100, f + 100, f + 101);
        else
            set_face(&mesh, f, f, f + 1, f + 3);
    }
    fct_mesh out = to_count(&mesh, 200, NULL);
    assert_true(out.face_count <= 100 && out.face_count > 90);
    fct_mesh_release(&env, &out);
    out = to_count(&mesh, 0, NULL);
    assert_int_equal(out.face_count, 0);
    fct_mesh_release(&env, &out);
    mesh.face_count = 100;
    out = to_count(&mesh, 0, NULL);
    assert_int_equal(out.face_count, 0);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

static void a_hub_of_a_hundred_thousand_faces(void **state) {
    (void)state;
    enum { N = 100000 };
    fct_mesh fan = make(N + 1, N);
    for (uint32_t i = 0; i < N; ++i) {
        double a = 6.283185307179586 * i / N;
        float p[3] = {(float)cos(a), (float)sin(a), 0};
        memcpy(fan.positions + 3 * (i + 1), p, sizeof p);
        set_face(&fan, i, 0, i + 1, (i + 1) % N + 1);
    }
    for (int lift = 0; lift < 2; ++lift) {
        fan.positions[2] = lift ? .5f : 0;
        fct_mesh out = to_count(&fan, 100, NULL);
        assert_in_range(out.face_count, 90, 100);
        double area = 3.14159265358979 * sqrt(lift ? 1.25 : 1);
        assert_float_equal(mesh_area(&out), area, .02 * area);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &fan);
}

static void an_edge_of_a_hundred_thousand_faces(void **state) {
    (void)state;
    enum { N = 100000 };
    fct_mesh book = make(N + 2, N);
    book.positions[2] = 1;
    for (uint32_t i = 0; i < N; ++i) {
        double a = 6.283185307179586 * i / N;
        float p[3] = {(float)cos(a), (float)sin(a), .5f};
        memcpy(book.positions + 3 * (i + 2), p, sizeof p);
        set_face(&book, i, 0, 1, i + 2);
    }
    fct_mesh out = to_count(&book, 1000, NULL);
    assert_in_range(out.face_count, 1, 1000);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &book);
}

static void many_disconnected_triangles(void **state) {
    (void)state;
    enum { N = 100000 };
    fct_mesh mesh = make(3 * N, N);
    for (uint32_t f = 0; f < N; ++f) {
        float x = (float)(f % 317), y = (float)(f / 317), size = .1f + .8f * (float)(f % 7) / 7;
        float p[9] = {x, y, 0, x + size, y, 0, x, y + size, 0};
        memcpy(mesh.positions + 9 * (size_t)f, p, sizeof p);
        set_face(&mesh, f, 3 * f, 3 * f + 1, 3 * f + 2);
    }
    fct_mesh out = to_count(&mesh, N / 10, NULL);
    assert_int_equal(out.face_count, N / 10);
    /* The largest faces remain. */
    for (uint32_t f = 0; f < out.face_count; ++f) assert_true(v3_norm(face_cross(&out, f)) > .5);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

static void extremes_of_extent(void **state) {
    (void)state;
    uint32_t faces = 0;
    for (int k = 0; k < 3; ++k) {
        float scale = (float[]){1, 1e-30f, 1e30f}[k];
        fct_mesh sphere = make_sphere(&env, 20);
        for (uint32_t i = 0; i < 3 * sphere.vertex_count; ++i) sphere.positions[i] *= scale;
        fct_mesh out = to_count(&sphere, 100, NULL);
        for (uint32_t v = 0; v < out.vertex_count; ++v) {
            v3 p = v3_scale(vertex(&out, v), 1 / (double)scale);
            assert_true(v3_norm(p) > .8 && v3_norm(p) < 1.2);
        }
        if (k == 0) faces = out.face_count;
        assert_int_equal(out.face_count, faces);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &sphere);
    }
}

/* Points outside of the bounds keep finite coordinates. */
static void the_largest_floats_stay_finite(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 20);
    for (uint32_t i = 0; i < 3 * sphere.vertex_count; ++i) sphere.positions[i] *= 3.4e38f;
    for (uint32_t faces = 4; faces <= 64; faces *= 2) {
        fct_mesh out = to_count(&sphere, faces, NULL);
        assert_true(out.face_count <= faces);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &sphere);
}

/* A rough square whose sides are 14 steps between the smallest floats. */
static void the_smallest_floats_keep_areas(void **state) {
    (void)state;
    fct_mesh grid = make_grid(&env, 12);
    uint32_t random = 12;
    for (uint32_t i = 0; i < 3 * grid.vertex_count; ++i) {
        random = random * 1664525u + 1013904223u;
        grid.positions[i] += (float)((random >> 8) / 16777216. - .5) / 120;
        grid.positions[i] *= 2e-44f;
    }
    for (uint32_t f = 0; f < grid.face_count; ++f) assert_true(v3_norm(face_cross(&grid, f)) > 0);
    for (uint32_t faces = 4; faces < 288; faces += 1 + faces / 8) {
        fct_mesh out = to_count(&grid, faces, NULL);
        for (uint32_t f = 0; f < out.face_count; ++f) assert_true(v3_norm(face_cross(&out, f)) > 0);
        fct_mesh_release(&env, &out);
    }
    fct_mesh_release(&env, &grid);
}

static void duplicated_and_non_manifold_faces(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 16), mesh = make(sphere.vertex_count, 3 * sphere.face_count);
    memcpy(mesh.positions, sphere.positions, 12 * sphere.vertex_count);
    for (uint32_t f = 0; f < sphere.face_count; ++f) {
        const uint32_t *t = sphere.triangles + 3 * f;
        set_face(&mesh, 3 * f, t[0], t[1], t[2]);
        set_face(&mesh, 3 * f + 1, t[1], t[2], t[0]);
        set_face(&mesh, 3 * f + 2, t[2], t[1], t[0]);
    }
    fct_mesh out = to_count(&mesh, 300, NULL);
    assert_in_range(out.face_count, 200, 300);
    for (uint32_t v = 0; v < out.vertex_count; ++v) assert_true(fabs(v3_norm(vertex(&out, v)) - 1) < .2);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);

    /* Faces between random points. */
    mesh = make(60, 4000);
    uint64_t seed = 1;
    for (uint32_t i = 0; i < 180; ++i) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        mesh.positions[i] = (float)(seed >> 40) / (float)(1 << 24);
    }
    for (uint32_t c = 0; c < 12000; ++c) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        mesh.triangles[c] = (uint32_t)(seed >> 33) % 60;
    }
    fct_simplify_stats stats;
    out = to_count(&mesh, 500, &stats);
    assert_true(out.face_count <= 500 || stats.stopped_because == FCT_STOP_EXHAUSTED);
    assert_true(out.face_count < 4000);
    fct_mesh_release(&env, &out);
    fct_simplify_def def = fct_simplify_def_default();
    def.check_foldover = false;
    mesh.face_count = 1000; /* fewer faces, so that no edge joins two hubs */
    out = simplified(&env, &mesh, &def, NULL);
    assert_int_equal(out.face_count, 0);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &sphere);
}

/* Each face of a fan has its own colours, so the hub has one wedge per face. */
static void more_wedges_than_an_edge_takes(void **state) {
    (void)state;
    fct_mesh mesh = make(3 * 400, 400);
    mesh = with_arrays(&env, &mesh, FCT_MESH_COLORS);
    for (uint32_t f = 0; f < 400; ++f)
        for (uint32_t k = 0; k < 3; ++k) {
            double a = 6.283185307179586 * ((f + (k == 2)) % 400) / 400;
            float p[3] = {k ? (float)cos(a) : 0, k ? (float)sin(a) : 0, 0};
            memcpy(mesh.positions + 9 * f + 3 * k, p, sizeof p);
            mesh.colors[9 * f + 3 * k] = (float)(f % 17) / 17;
            mesh.triangles[3 * f + k] = 3 * f + k;
        }
    fct_mesh out = to_count(&mesh, 100, NULL);
    assert_true(out.face_count <= 400);
    assert_int_equal(open_sides(&out, NULL), out.face_count); /* still one disc */
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

static void bad_attributes_and_options_are_refused(void **state) {
    (void)state;
    recorder r = {0};
    fct_env recording = recorder_env(&r);
    fct_mesh sphere = make_sphere(&env, 8), out;
    sphere = with_arrays(&env, &sphere, FCT_MESH_COLORS);
    fct_simplify_def def = fct_simplify_def_default();
    sphere.colors[17] = NAN;
    assert_int_equal(fct_simplify(&recording, &sphere, &def, &out, NULL), FCT_ERROR_DATA);
    assert_true(r.text[0] != 0);
    assert_null(out.positions);
    sphere.colors[17] = 0;
    fct_simplify_def wrong[5];
    for (int i = 0; i < 5; ++i) wrong[i] = def;
    wrong[0].max_error = NAN, wrong[1].color_weight = -2, wrong[2].boundary_weight = INFINITY;
    wrong[3].size = 4, wrong[4].regularization = NAN;
    for (int i = 0; i < 5; ++i) {
        r.text[0] = 0;
        assert_int_equal(fct_simplify(&recording, &sphere, &wrong[i], &out, NULL), FCT_ERROR_DATA);
        assert_true(r.text[0] != 0);
    }
    assert_int_equal(r.alive, 0);
    fct_mesh_release(&env, &sphere);
}

/* A sphere with every kind of array. */
static fct_mesh make_everything(void) {
    fct_mesh mesh = make_sphere(&env, 8);
    mesh = with_arrays(&env, &mesh,
                       FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS | FCT_MESH_FACE_COLORS |
                           FCT_MESH_MATERIALS | FCT_MESH_SOURCE_FACES);
    memcpy(mesh.normals, mesh.positions, 12 * mesh.vertex_count);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) mesh.colors[3 * v] = mesh.positions[3 * v] + 1;
    for (uint32_t c = 0; c < 3 * mesh.face_count; ++c) {
        mesh.texcoords[2 * c] = mesh.positions[3 * mesh.triangles[c]] > 0;
        mesh.texcoords[2 * c + 1] = mesh.positions[3 * mesh.triangles[c] + 1] + (float)(c / 3 % 2);
    }
    for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f > 100, mesh.source_faces[f] = f;
    mesh.material_count = 2;
    return mesh;
}

static void the_nth_allocation_fails(void **state) {
    (void)state;
    fct_mesh mesh = make_everything();
    char *names[2] = {"a", "b"};
    fct_mesh view = mesh;
    view.material_names = names;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 60;
    def.keep_topology = true;
    long n = 0;
    for (fct_result result = FCT_ERROR_MEMORY; result != FCT_OK;) {
        recorder r = {.fail_at = ++n};
        fct_env failing = recorder_env(&r);
        failing.thread_count = 1;
        fct_mesh out;
        result = fct_simplify(&failing, &view, &def, &out, NULL);
        if (result == FCT_OK)
            fct_mesh_release(&failing, &out);
        else {
            assert_int_equal(result, FCT_ERROR_MEMORY);
            assert_true(r.text[0] != 0 && !out.positions && !out.triangles);
        }
        assert_int_equal(r.alive, 0);
    }
    assert_true(n > 30);
    fct_mesh_release(&env, &mesh);
}

static bool stop_after(void *user, const char *phase, double done) {
    (void)phase;
    assert_true(done >= 0 && done <= 1);
    return --*(int *)user > 0;
}

static void cancelling_returns_at_once(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 100);
    fct_simplify_def def = fct_simplify_def_default();
    int calls = 1;
    fct_result result = FCT_ERROR_CANCELLED;
    for (int n = 1; result == FCT_ERROR_CANCELLED; ++n) {
        recorder r = {0};
        fct_env cancelling = recorder_env(&r);
        cancelling.progress = stop_after;
        calls = n;
        cancelling.progress_user = &calls;
        fct_mesh out;
        def.target_faces = 1000;
        result = fct_simplify(&cancelling, &sphere, &def, &out, NULL);
        if (result == FCT_OK) {
            assert_true(n > 4);
            fct_mesh_release(&cancelling, &out);
        }
        assert_int_equal(r.alive, 0);
    }
    assert_int_equal(result, FCT_OK);
    fct_mesh_release(&env, &sphere);
}

static void every_thread_count_gives_the_same_bits(void **state) {
    (void)state;
    fct_mesh mesh = make_sphere(&env, 60);
    mesh = with_arrays(&env, &mesh, FCT_MESH_COLORS);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v)
        mesh.colors[3 * v] = mesh.positions[3 * v] > .2f ? 1 : mesh.positions[3 * v + 1] + 1;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 700;
    fct_mesh out[4];
    for (uint32_t i = 0; i < 4; ++i) {
        fct_env threads = env;
        threads.thread_count = i + 1;
        assert_int_equal(fct_simplify(&threads, &mesh, &def, &out[i], NULL), FCT_OK);
        assert_int_equal(out[i].vertex_count, out[0].vertex_count);
        assert_memory_equal(out[i].positions, out[0].positions, 12 * out[0].vertex_count);
        assert_memory_equal(out[i].colors, out[0].colors, 12 * out[0].vertex_count);
        assert_memory_equal(out[i].triangles, out[0].triangles, 12 * out[0].face_count);
    }
    for (uint32_t i = 0; i < 4; ++i) fct_mesh_release(&env, &out[i]);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_mesh_stays_empty),
        cmocka_unit_test(one_triangle),
        cmocka_unit_test(flat_open_faces_stay_within_the_error),
        cmocka_unit_test(degenerate_faces),
        cmocka_unit_test(a_hub_of_a_hundred_thousand_faces),
        cmocka_unit_test(an_edge_of_a_hundred_thousand_faces),
        cmocka_unit_test(many_disconnected_triangles),
        cmocka_unit_test(extremes_of_extent),
        cmocka_unit_test(the_largest_floats_stay_finite),
        cmocka_unit_test(the_smallest_floats_keep_areas),
        cmocka_unit_test(duplicated_and_non_manifold_faces),
        cmocka_unit_test(more_wedges_than_an_edge_takes),
        cmocka_unit_test(bad_attributes_and_options_are_refused),
        cmocka_unit_test(the_nth_allocation_fails),
        cmocka_unit_test(cancelling_returns_at_once),
        cmocka_unit_test(every_thread_count_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
