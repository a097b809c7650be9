/* Views of real meshes: sound surfaces, and pixels beside those that were asked for. Skipped without the
 * data.
 */
#include "screen.h"

static fct_env env;

static bool load(const char *name, fct_mesh *mesh) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", FACETREE_DATA, name);
    if (!file_exists(path)) return false;
    assert_int_equal(fct_mesh_load(&env, path, mesh), FCT_OK);
    return true;
}

static uint64_t make_key(uint32_t a, uint32_t b) {
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

typedef struct side {
    uint64_t key;
    uint32_t face;
} side;

static int compare_sides(const void *a, const void *b) {
    const side *x = a, *y = b;
    return x->key < y->key ? -1 : x->key > y->key;
}

/* Edges whose two faces turn by more than 154 degrees: they lie on each other. */
static uint32_t count_folds(const fct_mesh *mesh) {
    size_t count = 3 * (size_t)mesh->face_count;
    side *sides = malloc((count + 1) * sizeof *sides);
    uint32_t folds = 0;
    for (size_t c = 0; c < count; ++c)
        sides[c] = (side){make_key(mesh->triangles[c], mesh->triangles[c % 3 == 2 ? c - 2 : c + 1]),
                          (uint32_t)(c / 3)};
    qsort(sides, count, sizeof *sides, compare_sides);
    for (size_t c = 1; c < count; ++c)
        folds +=
            sides[c].key == sides[c - 1].key && v3_dot(v3_unit(face_cross(mesh, sides[c].face)),
                                                       v3_unit(face_cross(mesh, sides[c - 1].face))) < -.9;
    free(sides);
    return folds;
}

/* The surface is as sound as the levels: as closed, without new shared or folded edges. */
static void check_surface(fct_progressive *m, const fct_mesh *out, bool closed) {
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, out, &report), FCT_OK);
    assert_int_equal(report.nonmanifold_edges + report.duplicate_faces, 0);
    assert_int_equal(report.degenerate_faces + report.misoriented_edges, 0);
    if (closed) assert_int_equal(report.boundary_edges, 0);
    fct_mesh level = level_mesh(m, out->face_count), finest = level_mesh(m, FCT_NONE);
    uint32_t allowed = count_folds(&level) + count_folds(&finest);
    assert_in_range(count_folds(out), 0, allowed + 1);
    fct_mesh_release(&env, &level);
    fct_mesh_release(&env, &finest);
}

static void check_views(const char *name, uint32_t base, int views) {
    fct_mesh mesh;
    if (!load(name, &mesh)) skip();
    fct_progressive *m = progressive_of(&env, &mesh, fct_simplify_def_default(), base);
    fct_mesh finest = level_mesh(m, FCT_NONE);
    fct_mesh_report whole;
    assert_int_equal(fct_mesh_inspect(&env, &finest, &whole), FCT_OK);
    v3 low = v3_load(whole.bounds.lower), high = v3_load(whole.bounds.upper);
    uint64_t seed = 7;
    uint32_t splits = 0, forced = 0, partial = 0, silhouettes = 0;
    double most = 0;
    for (int i = 0; i < views; ++i) {
        fct_view view = random_view(&seed, v3_scale(v3_add(low, high), .5), .5 * v3_norm(v3_sub(high, low)));
        fct_view_stats stats;
        fct_mesh out = view_mesh(m, &view, &stats);
        check_surface(m, &out, whole.boundary_edges == 0);
        screen seen = measure_screen(&env, &finest, &out, &view);
        /* Faces of no level may be a little further off than the contractions measured. */
        assert_true(seen.front < 1.25 && seen.distance < 1.1 * stats.error + 1e-6);
        assert_true(seen.silhouette * view.silhouette_tolerance < 1.25 * view.tolerance);
        /* A silhouette of single faces is none of the vertices, whose normals are those of a smooth surface.
         */
        silhouettes += seen.silhouette < 1.25;
        most = fmax(most, seen.front);
        partial += out.face_count > 2 * base && out.face_count < finest.face_count / 2;
        splits += stats.splits, forced += stats.forced;
        fct_mesh_release(&env, &out);
    }
    assert_true(most > .7 && partial > (uint32_t)views / 3 && silhouettes > (uint32_t)views / 5);
    assert_true(forced < .25 * splits);
    fct_mesh_release(&env, &finest);
    fct_progressive_destroy(m);
    fct_mesh_release(&env, &mesh);
}

static void views_of_the_cow(void **state) {
    (void)state;
    check_views("cow.obj", 60, 40);
}

static void views_of_the_bunny(void **state) {
    (void)state;
    check_views("stanford-bunny.obj", 100, 20);
}

static void views_of_a_machine_part(void **state) {
    (void)state;
    check_views("rocker-arm.obj", 60, 20);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(views_of_the_cow),
                                       cmocka_unit_test(views_of_the_bunny),
                                       cmocka_unit_test(views_of_a_machine_part)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
