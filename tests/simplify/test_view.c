/* View-dependent meshes: cuts beside an oracle, their faces, and what they need; the same bytes by any way.
 */
#include "views.h"

static fct_env env;

/* Marks the steps that are wanted with all their ancestors, and all that they use. */
static void mark_closure(const fct_progressive *m, const uint32_t *states, const fct_view *view,
                         bool *marked) {
    fct_cut_view frame;
    assert_int_equal(fct_cut_read_view(&env, view, m->origin, &frame), FCT_OK);
    for (uint32_t s = 0; s < m->step_count; ++s)
        marked[s] =
            s == 0 || (marked[m->hierarchy->parents[s]] && fct_cut_wants(&frame, &m->hierarchy->bounds[s]));
    for (uint32_t t = m->step_count; t-- > 1;)
        for (uint32_t s = 1; s < t && marked[t]; ++s) marked[s] |= uses_step(m, states, t, s, false);
}

static v3 normal_of(const fct_progressive *m, const uint32_t nodes[3]) {
    v3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = v3_load(m->positions + 3 * (size_t)nodes[k]);
    return v3_unit(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
}

/* Whether the face is one of some level (*recorded), or turns at most as far from its direction at the finest
 * level as 45 degrees, or as at some level. */
static bool is_sound(const fct_progressive *m, const uint32_t *states, uint32_t f, bool *recorded) {
    const fct_hierarchy *h = m->hierarchy;
    size_t row = 3 * (size_t)m->face_count;
    const uint32_t *last = states + (m->step_count - 1) * row + 3 * (size_t)f;
    uint32_t nodes[3];
    double least = .7071;
    for (uint32_t k = 0; k < 3; ++k) nodes[k] = h->nodes[h->triangles[3 * (size_t)f + k]];
    for (uint32_t s = 0; s < m->step_count; ++s) {
        const uint32_t *state = states + s * row + 3 * (size_t)f;
        if (state[0] == FCT_NONE) continue;
        if (!memcmp(state, nodes, sizeof nodes)) return *recorded = true;
        least = fmin(least, v3_dot(normal_of(m, state), normal_of(m, last)));
    }
    return v3_dot(normal_of(m, nodes), normal_of(m, last)) >= least - 1e-5;
}

/* No side is open or has more than two faces, no two faces are equal, and each has area. */
static void check_closed(const fct_mesh *mesh) {
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, mesh, &report), FCT_OK);
    assert_int_equal(report.boundary_edges + report.nonmanifold_edges + report.duplicate_faces, 0);
    assert_int_equal(report.misoriented_edges + report.degenerate_faces, 0);
}

/* What cuts had. */
typedef struct tally {
    uint32_t partial, forced, mixed, strict; /* cuts between the ends, steps, faces of no level, steps */
} tally;

static void check_cut(fct_progressive *m, const uint32_t *states, const fct_view *view,
                      const fct_view_stats *stats, const fct_mesh *out, tally *sum) {
    bool *marked = malloc(m->step_count);
    uint32_t faces = 0, splits = 0;
    mark_closure(m, states, view, marked);
    for (uint32_t t = 0; t < m->step_count; ++t) {
        if (!is_done(m->hierarchy, t)) {
            assert_false(marked[t]);
            continue;
        }
        bool used = marked[t];
        for (uint32_t s = t + 1; s < m->step_count && !used; ++s)
            used = is_done(m->hierarchy, s) && uses_step(m, states, s, t, true);
        assert_true(used);
        sum->strict += !marked[t];
        for (uint32_t s = 1; s < t; ++s)
            assert_true(is_done(m->hierarchy, s) || !uses_step(m, states, t, s, false));
        splits += t > 0;
        faces += m->step_faces[t + 1] - m->step_faces[t];
        for (uint32_t f = m->step_faces[t]; f < m->step_faces[t + 1]; ++f) {
            bool recorded = false;
            assert_true(is_sound(m, states, f, &recorded));
            sum->mixed += !recorded;
        }
    }
    assert_int_equal(fct_mesh_validate(&env, out), FCT_OK);
    assert_int_equal(out->face_count, faces);
    assert_int_equal(stats->faces, faces);
    assert_int_equal(stats->splits, splits);
    sum->partial += splits > 0 && splits < m->step_count - 1;
    sum->forced += stats->forced;
    free(marked);
}

/* A sphere with bumps, so that faces of views would fold over. */
static fct_mesh make_bumps(void) {
    fct_mesh mesh = make_sphere(&env, 11);
    uint64_t seed = 9;
    for (uint32_t c = 0; c < 3 * mesh.vertex_count; ++c)
        mesh.positions[c] += (float)between(&seed, -.12, .12);
    return mesh;
}

static void cuts_are_legal_and_least(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int kind = 0; kind < 5; ++kind) {
        fct_mesh mesh = kind == 0   ? make_sphere(&env, 8)
                        : kind == 3 ? make_grid(&env, 8)
                        : kind == 4 ? make_bumps()
                                    : make_torus(&env, 8, kind == 2, kind == 2);
        fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 20);
        uint32_t *states = list_states(m);
        tally sum = {0};
        v3 middle = {mesh.origin[0], mesh.origin[1], mesh.origin[2]};
        for (int i = 0; i < 25; ++i) {
            fct_view view = random_view(&seed, middle, 1.5);
            if (i % 2) view.tolerance /= 10, view.vertical_fov = 10, view.outside_factor = INFINITY;
            view.silhouette_tolerance = view.tolerance;
            fct_view_stats stats;
            fct_mesh out = view_mesh(m, &view, &stats);
            check_cut(m, states, &view, &stats, &out, &sum);
            if (kind < 2 || kind == 4) check_closed(&out);
            if (kind == 2) assert_int_equal(open_sides(&out, NULL), 0);
            fct_mesh_release(&env, &out);
        }
        assert_true(kind != 4 || sum.strict > 0);
        assert_true(kind == 3 || (sum.partial > 10 && sum.forced > 10 && sum.mixed > 5));
        free(states);
        fct_progressive_destroy(m);
        fct_mesh_release(&env, &mesh);
    }
}

/* No tolerance gives the finest level, an infinite one the base mesh, with the bytes of these levels. */
static void limits_are_the_ends(void **state) {
    (void)state;
    uint64_t seed = 2;
    fct_mesh mesh = make_torus(&env, 10, true, true);
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 30);
    fct_mesh ends[2] = {level_mesh(m, 0), level_mesh(m, FCT_NONE)};
    for (int i = 0; i < 20; ++i) {
        fct_view view = random_view(&seed, v3_make(0, 1000, 0), 1.5);
        view.tolerance = i % 2 ? 0 : INFINITY;
        view.silhouette_tolerance = view.tolerance;
        if (i % 4 == 1) view.outside_factor = view.back_factor = INFINITY;
        fct_view_stats stats;
        fct_mesh out = view_mesh(m, &view, &stats);
        assert_true(same_mesh(&out, &ends[i % 2]));
        assert_int_equal(stats.forced, 0);
        assert_true(i % 2 == 0 || (stats.error == 0 && stats.pixels == 0));
        fct_mesh_release(&env, &out);
    }
    for (int i = 0; i < 2; ++i) fct_mesh_release(&env, &ends[i]);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

/* A view gives the same bytes after any other views and at any level, and does not change the level. */
static void views_do_not_depend_on_the_way(void **state) {
    (void)state;
    uint64_t seed = 3;
    fct_mesh mesh = make_torus(&env, 12, true, true);
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 30);
    uint32_t splits = 0;
    for (int i = 0; i < 30; ++i) {
        fct_view view = random_view(&seed, v3_make(0, 1000, 0), 1.5);
        fct_view_stats stats, first;
        fct_progressive *fresh = progressive_of(&env, &mesh, fct_simplify_def_default(), 30);
        fct_progressive_go(m, (uint32_t)between(&seed, 30, mesh.face_count));
        fct_mesh before, after, a = {0}, b = view_mesh(fresh, &view, &first);
        assert_int_equal(fct_progressive_mesh(m, &before), FCT_OK);
        a = view_mesh(m, &view, &stats);
        assert_int_equal(fct_progressive_mesh(m, &after), FCT_OK);
        assert_true(same_mesh(&a, &b) && same_mesh(&before, &after));
        assert_int_equal(splits + stats.done - stats.undone, stats.splits);
        assert_int_equal(first.done, stats.splits);
        assert_true(stats.pixels == first.pixels && stats.error == first.error);
        splits = stats.splits;
        fct_mesh *meshes[] = {&before, &after, &a, &b};
        for (int k = 0; k < 4; ++k) fct_mesh_release(&env, meshes[k]);
        fct_view_stats again;
        fct_mesh same = view_mesh(m, &view, &again);
        assert_int_equal(again.done + again.undone, 0);
        fct_mesh_release(&env, &same);
        fct_progressive_destroy(fresh);
    }
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

/* Bodies that the base mesh lacks appear as soon as their size has the pixels of the tolerance. */
static void bodies_appear(void **state) {
    (void)state;
    static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    fct_mesh mesh;
    enum { BODIES = 4 };
    assert_int_equal(fct_mesh_create(&env, 4 * BODIES, 4 * BODIES, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < BODIES; ++i) {
        float size = (float)(1 << i);
        for (uint32_t c = 0; c < 12; ++c) {
            mesh.positions[12 * i + c] = c % 3 == c / 3 ? size : 0;
            mesh.triangles[12 * i + c] = 4 * i + faces[c];
        }
        for (uint32_t v = 0; v < 4; ++v) mesh.positions[12 * i + 3 * v] += 10 * size;
    }
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 0);
    fct_view view = fct_view_default();
    /* A body of size s has a diameter of about 1.7 s, and the eye is so far away that 1 pixel is .1. */
    view.position[0] = 0, view.position[2] = 1e5, view.vertical_fov = 1, view.height = 17453;
    view.width = 17453, view.silhouette_tolerance = 0;
    uint32_t last = 4 * BODIES;
    for (double tolerance = 1; tolerance < 1000; tolerance *= 1.2) {
        view.tolerance = view.silhouette_tolerance = tolerance;
        fct_mesh out = view_mesh(m, &view, NULL);
        uint32_t expected = 0;
        bool sure = true;
        for (int i = 0; i < BODIES; ++i) {
            double pixels = 10 * sqrt(3) * (1 << i);
            expected += 4 * (pixels > tolerance);
            sure &= fabs(pixels / tolerance - 1) > .02;
        }
        if (sure) assert_int_equal(out.face_count, expected);
        assert_true(out.face_count <= last);
        last = out.face_count;
        fct_mesh_release(&env, &out);
    }
    assert_int_equal(last, 0);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

static void bad_views_are_refused(void **state) {
    (void)state;
    recorder heard = {0};
    fct_mesh mesh = make_sphere(&env, 6), out;
    env.message = recorder_message, env.message_user = &heard;
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), 20);
    static const struct {
        size_t offset;
        double value;
        const char *says;
    } faults[] = {{offsetof(fct_view, position), NAN, "must be finite"},
                  {offsetof(fct_view, target[2]), 1, "are the same"},
                  {offsetof(fct_view, up[1]), INFINITY, "must be finite"},
                  {offsetof(fct_view, vertical_fov), .5, "vertical_fov"},
                  {offsetof(fct_view, vertical_fov), NAN, "vertical_fov"},
                  {offsetof(fct_view, tolerance), -1, "silhouette_tolerance must"},
                  {offsetof(fct_view, silhouette_tolerance), 1.5, "silhouette_tolerance must"},
                  {offsetof(fct_view, silhouette_tolerance), NAN, "silhouette_tolerance must"},
                  {offsetof(fct_view, back_factor), .5, "at least 1"},
                  {offsetof(fct_view, outside_factor), NAN, "at least 1"},
                  {offsetof(fct_view, color_tolerance), -.1, "at least 0"}};
    for (size_t i = 0; i < FCT_LENGTH(faults); ++i) {
        fct_view view = fct_view_default();
        memcpy((char *)&view + faults[i].offset, &faults[i].value, sizeof(double));
        heard = (recorder){0};
        assert_int_equal(fct_progressive_view(m, &view, &out, NULL), FCT_ERROR_DATA);
        assert_non_null(strstr(heard.text, faults[i].says));
        assert_null(out.positions);
    }
    fct_view view = fct_view_default();
    view.width = 0;
    assert_int_equal(fct_progressive_view(m, &view, &out, NULL), FCT_ERROR_DATA);
    view = fct_view_default(), view.size = 3;
    assert_int_equal(fct_progressive_view(m, &view, &out, NULL), FCT_ERROR_DATA);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
    env.message = NULL;
}

/* A body with seams that appears in one split, from a file: the view without tolerance has all of it. */
static void files_keep_bodies_with_seams(void **state) {
    (void)state;
    static const float positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const uint32_t triangles[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 4, 4, FCT_MESH_TEXCOORDS, &mesh), FCT_OK);
    memcpy(mesh.positions, positions, sizeof positions);
    memcpy(mesh.triangles, triangles, sizeof triangles);
    for (uint32_t i = 0; i < 24; ++i) mesh.texcoords[i] = .04f * (float)i;
    fct_progressive *made = progressive_of(&env, &mesh, fct_simplify_def_default(), 0), *read;
    char *bytes = NULL;
    size_t size;
    FILE *stream = open_memstream(&bytes, &size);
    assert_int_equal(fct_progressive_write(made, stream), FCT_OK);
    fclose(stream);
    assert_int_equal(fct_progressive_read(&env, "a file", (unsigned char *)bytes, size, &read), FCT_OK);
    fct_view view = fct_view_default();
    view.position[2] = 5, view.tolerance = view.silhouette_tolerance = 0;
    fct_mesh seen = view_mesh(read, &view, NULL);
    assert_int_equal(seen.face_count, 4);
    fct_mesh_release(&env, &seen);
    fct_mesh_release(&env, &mesh);
    free(bytes);
    fct_progressive_destroy(made);
    fct_progressive_destroy(read);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(files_keep_bodies_with_seams),
                                       cmocka_unit_test(cuts_are_legal_and_least),
                                       cmocka_unit_test(limits_are_the_ends),
                                       cmocka_unit_test(views_do_not_depend_on_the_way),
                                       cmocka_unit_test(bodies_appear),
                                       cmocka_unit_test(bad_views_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
