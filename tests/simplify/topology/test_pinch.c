/* Vertices where closed fans touch: against a search for fans by brute force; pinched surfaces get as simple
 * as others; what the caller says of a vertex holds for all its fans. */
#include "../handle.h"
#include "../oracle.h"
#include "simplify/cost/constraint.h"
#include "simplify/topology/pinch.h"

static fct_env env;

/* The vertex `gone` becomes `kept`, at the given place. */
static void glue(fct_mesh *mesh, uint32_t kept, uint32_t gone, v3 at) {
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c)
        if (mesh->triangles[c] == gone) mesh->triangles[c] = kept;
    v3_store(mesh->positions + 3 * kept, at);
    v3_store(mesh->positions + 3 * gone, at);
}

static uint32_t north_pole(const fct_mesh *mesh) {
    uint32_t pole = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        if (mesh->positions[3 * v + 2] > mesh->positions[3 * pole + 2]) pole = v;
    return pole;
}

static uint32_t south_pole(const fct_mesh *mesh) {
    uint32_t pole = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        if (mesh->positions[3 * v + 2] < mesh->positions[3 * pole + 2]) pole = v;
    return pole;
}

/* A sphere whose poles meet in its middle. */
static fct_mesh make_apple(uint32_t n) {
    fct_mesh mesh = make_sphere(&env, n);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * v;
        float r = sqrtf(p[0] * p[0] + p[1] * p[1]);
        p[2] *= r < .9f ? .2f + .8f * r : 1; /* dents */
    }
    glue(&mesh, north_pole(&mesh), south_pole(&mesh), v3_make(0, 0, 0));
    return mesh;
}

/* Two spheres that share a pole. */
static fct_mesh make_beads(uint32_t n) {
    fct_mesh parts[2], mesh;
    for (int i = 0; i < 2; ++i) {
        parts[i] = make_sphere(&env, n);
        for (uint32_t v = 0; v < parts[i].vertex_count; ++v) parts[i].positions[3 * v + 2] += 2 * (float)i;
    }
    uint32_t north = north_pole(&parts[0]), south = parts[0].vertex_count + south_pole(&parts[1]);
    assert_int_equal(fct_mesh_join(&env, parts, 2, &mesh), FCT_OK);
    glue(&mesh, north, south, v3_make(0, 0, 1));
    for (int i = 0; i < 2; ++i) fct_mesh_release(&env, &parts[i]);
    return mesh;
}

/* The number of fans at a vertex, all of them closed and of one orientation; else 1. */
static uint32_t count_fans(const fct_mesh *mesh, uint32_t v) {
    uint32_t corners[256], fan_of[256], count = 0, fans = 0;
    for (uint32_t c = 0; c < 3 * mesh->face_count; ++c)
        if (mesh->triangles[c] == v) fan_of[count] = count, corners[count++] = c;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t before = 0, after = 0, other = FCT_NONE;
        for (uint32_t j = 0; j < count; ++j) {
            uint32_t a = mesh->triangles[corner_next(corners[i])],
                     b = mesh->triangles[corner_previous(corners[i])];
            before += mesh->triangles[corner_next(corners[j])] == a;
            if (mesh->triangles[corner_next(corners[j])] == b) ++after, other = j;
        }
        if (before != 1 || after != 1) return 1;
        uint32_t low = fan_of[i] < fan_of[other] ? fan_of[i] : fan_of[other],
                 high = fan_of[i] ^ fan_of[other] ^ low;
        for (uint32_t j = 0; j < count; ++j)
            if (fan_of[j] == high) fan_of[j] = low;
    }
    for (uint32_t i = 0; i < count; ++i) fans += fan_of[i] == i;
    return fans > 0 ? fans : 1;
}

/* Glues random vertices and turns faces over. Each closed fan gets a vertex; attributes and locks follow. */
static void fans_are_those_of_a_search(void **state) {
    (void)state;
    uint32_t found = 0, turned = 0;
    for (uint64_t seed = 1; seed < 40; ++seed) {
        fct_mesh plain = seed % 2 ? make_sphere(&env, 6) : make_grid(&env, 7),
                 mesh = with_arrays(&env, &plain, FCT_MESH_COLORS | FCT_MESH_NORMALS);
        uint64_t dice = seed;
        for (int i = 0; i < 12; ++i) {
            uint32_t a = (uint32_t)(uniform(&dice) * mesh.vertex_count),
                     b = (uint32_t)(uniform(&dice) * mesh.vertex_count);
            if (a != b) glue(&mesh, a, b, vertex(&mesh, a));
        }
        for (uint32_t f = 0; f < mesh.face_count && seed % 3 == 0; f += 17) {
            uint32_t swap = mesh.triangles[3 * f];
            mesh.triangles[3 * f] = mesh.triangles[3 * f + 1], mesh.triangles[3 * f + 1] = swap;
        }
        uint8_t *locks = calloc(mesh.vertex_count, 1);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
            locks[v] = uniform(&dice) < .3;
            for (int k = 0; k < 3; ++k) {
                mesh.colors[3 * v + (uint32_t)k] = (float)uniform(&dice);
                mesh.normals[3 * v + (uint32_t)k] = (float)uniform(&dice);
            }
        }
        fct_sorted sorted;
        assert_int_equal(fct_simplify_sort(&env, &mesh, locks, &sorted), FCT_OK);
        fct_mesh before;
        assert_int_equal(fct_mesh_copy(&env, &sorted.mesh, &before), FCT_OK);
        assert_int_equal(fct_simplify_split_pinches(&env, &sorted), FCT_OK);
        const fct_mesh *after = &sorted.mesh;
        assert_int_equal(sorted_inputs(&sorted), before.vertex_count);
        uint32_t copies = 0;
        for (uint32_t v = 0; v < before.vertex_count; ++v) {
            uint32_t fans = count_fans(&before, v), first, end = fct_simplify_find_copies(&sorted, v, &first);
            assert_int_equal(end - first, fans - 1);
            for (uint32_t i = first; i < end; ++i) assert_int_equal(sorted.copies[i], v);
            copies += fans - 1;
        }
        assert_int_equal(sorted.copy_count, copies);
        for (uint32_t c = 0; c < 3 * after->face_count; ++c) {
            uint32_t v = after->triangles[c],
                     from = v < before.vertex_count ? v : sorted.copies[v - before.vertex_count];
            assert_int_equal(from, before.triangles[c]);
            assert_memory_equal(after->positions + 3 * v, before.positions + 3 * from, 12);
            assert_memory_equal(after->colors + 3 * v, before.colors + 3 * from, 12);
            assert_memory_equal(after->normals + 3 * v, before.normals + 3 * from, 12);
            assert_int_equal(sorted.locks[v], sorted.locks[from]);
        }
        for (uint32_t v = 0; v < after->vertex_count; ++v) assert_int_equal(count_fans(after, v), 1);
        found += copies, turned += seed % 3 == 0 ? copies : 0;
        fct_simplify_release_sorted(&env, &sorted);
        fct_mesh_release(&env, &before);
        fct_mesh_release(&env, &mesh);
        free(locks);
    }
    assert_true(found > 60 && turned > 10);
}

/* The points of an edge that leaves a pinch are at one fan only, so each body ends as four faces. */
static void pinched_surfaces_reach_every_target(void **state) {
    (void)state;
    fct_mesh meshes[] = {make_apple(12), make_beads(10)};
    const uint32_t least[] = {4, 8};
    for (size_t i = 0; i < FCT_LENGTH(meshes); ++i) {
        for (uint32_t target = 100; target > 0; target = target > least[i]    ? least[i]
                                                         : target == least[i] ? 1
                                                                              : 0) {
            fct_simplify_def def = fct_simplify_def_default();
            def.target_faces = target;
            fct_simplify_stats stats;
            fct_mesh out = simplified(&env, &meshes[i], &def, &stats);
            assert_int_equal(stats.stopped_because, FCT_STOP_FACES);
            assert_true(out.face_count <= target);
            fct_mesh_report report;
            assert_int_equal(fct_mesh_inspect(&env, &out, &report), FCT_OK);
            assert_int_equal(report.boundary_edges + report.nonmanifold_edges + report.nonmanifold_vertices,
                             0);
            if (target == 100 && i == 1) assert_ratio(mesh_volume(&out), mesh_volume(&meshes[i]), .05);
            fct_mesh_release(&env, &out);
        }
        fct_simplify_def def = fct_simplify_def_default();
        def.target_faces = 100, def.keep_topology = true;
        fct_mesh out = simplified(&env, &meshes[i], &def, NULL);
        fct_mesh_report report;
        assert_int_equal(fct_mesh_inspect(&env, &out, &report), FCT_OK);
        assert_int_equal(report.nonmanifold_vertices, 1);
        fct_mesh_release(&env, &out);
        fct_mesh_release(&env, &meshes[i]);
    }
}

/* Open fans that touch stay one point: a square whose quarters meet in the middle only. */
static void open_fans_stay_together(void **state) {
    (void)state;
    fct_mesh mesh = make_grid(&env, 8);
    uint32_t kept = 0;
    for (uint32_t f = 0; f < mesh.face_count; ++f) {
        uint32_t x = f / 2 % 8, y = f / 16;
        if ((x < 4) != (y < 4)) continue;
        memmove(mesh.triangles + 3 * (size_t)kept++, mesh.triangles + 3 * (size_t)f, 12);
    }
    mesh.face_count = kept;
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = 4;
    fct_mesh out = simplified(&env, &mesh, &def, NULL);
    fct_mesh_report report;
    assert_int_equal(fct_mesh_inspect(&env, &out, &report), FCT_OK);
    assert_int_equal(report.nonmanifold_vertices, 1);
    assert_ratio(mesh_area(&out), .5, 1e-6);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
}

/* Locks, paint, point constraints and contours at a pinch, and a file in between. */
static void wishes_hold_for_all_fans(void **state) {
    (void)state;
    fct_mesh mesh = make_beads(12);
    uint32_t pole = FCT_NONE, beside[2] = {FCT_NONE, FCT_NONE};
    for (uint32_t v = 0; v < mesh.vertex_count; ++v)
        if (count_fans(&mesh, v) == 2) pole = v;
    assert_true(pole != FCT_NONE);
    for (uint32_t c = 0; c < 3 * mesh.face_count; ++c) {
        uint32_t v = mesh.triangles[corner_next(c)];
        if (mesh.triangles[c] == pole) beside[mesh.positions[3 * v + 2] > 1] = v;
    }
    float *paint = malloc(mesh.vertex_count * sizeof *paint);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) paint[v] = v == pole ? 1e6f : 1;
    uint8_t *locks = calloc(mesh.vertex_count, 1);
    locks[pole] = 1;
    for (int kind = 0; kind < 4; ++kind)
        for (int file = 0; file < 2; ++file) {
            fct_simplify_def def = fct_simplify_def_default();
            if (kind == 0) def.locks = locks;
            fct_simplifier *s = made(&env, &mesh, &def);
            if (file) s = stopped(&env, s);
            assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_INPUT, paint, mesh.vertex_count - 1),
                             FCT_ERROR_DATA);
            if (kind == 1)
                assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_INPUT, paint, mesh.vertex_count), FCT_OK);
            fct_constrain_def wish = fct_constrain_def_default();
            const uint32_t contour[4] = {pole, beside[0], beside[1], pole};
            if (kind == 2) wish.points = &pole, wish.point_count = 1, wish.point_weight = 1e6;
            if (kind == 3) wish.contour = contour, wish.contour_count = 2, wish.contour_weight = 1e6;
            assert_int_equal(fct_simplifier_constrain(s, &wish), FCT_OK);
            const uint32_t wrong[2] = {beside[0], beside[1]};
            if (kind == 3) {
                wish.contour = wrong, wish.contour_count = 1;
                assert_int_equal(fct_simplifier_constrain(s, &wish), FCT_ERROR_DATA);
                /* Each contour holds both ends of its edge: at the pole one of each fan. */
                const fct_sorted *sorted = &s->sorted;
                uint32_t ends[4] = {sorted->vertex_places[pole], sorted_inputs(sorted),
                                    sorted->vertex_places[beside[0]], sorted->vertex_places[beside[1]]};
                for (int k = 0; k < 4; ++k) assert_non_null(constraint_at(s, s->point_of[ends[k]]));
            }
            run_to(s, 60);
            fct_mesh out = mesh_of(s, false);
            double nearest[2] = {9, 9};
            for (uint32_t c = 0; c < 3 * out.face_count; ++c) { /* of each bead */
                double z = 0;
                for (uint32_t k = 0; k < 3; ++k)
                    z += (double)out.positions[3 * out.triangles[c - c % 3 + k] + 2];
                v3 away = v3_sub(vertex(&out, out.triangles[c]), v3_make(0, 0, 1));
                nearest[z > 3] = fmin(nearest[z > 3], v3_norm(away));
            }
            for (int i = 0; i < 2 && kind < 3; ++i) assert_true(nearest[i] < (kind == 0 ? 1e-12 : .01));
            fct_mesh_release(&env, &out);
            fct_simplifier_destroy(s);
        }
    free(locks);
    free(paint);
    fct_mesh_release(&env, &mesh);
}

/* A fan has the largest weight of its vertices, whichever of them was split: a second vertex lies at the
 * pole, in a face of one of the beads. */
static void doubled_vertices_pass_their_weight(void **state) {
    (void)state;
    for (int upper = 0; upper < 2; ++upper) {
        fct_mesh beads = make_beads(6), mesh;
        uint32_t pole = 0, twin = beads.vertex_count, faces = beads.face_count, f = 0;
        while (count_fans(&beads, pole) != 2) ++pole;
        assert_int_equal(fct_mesh_create(&env, twin + 1, faces + 2, 0, &mesh), FCT_OK);
        memcpy(mesh.positions, beads.positions, 12 * (size_t)twin);
        memcpy(mesh.positions + 3 * (size_t)twin, beads.positions + 3 * (size_t)pole, 12);
        memcpy(mesh.triangles, beads.triangles, 12 * (size_t)faces);
        for (;; ++f) {
            const uint32_t *t = beads.triangles + 3 * (size_t)f;
            bool above = beads.positions[3 * t[0] + 2] + beads.positions[3 * t[1] + 2] +
                             beads.positions[3 * t[2] + 2] >
                         3;
            if (above == upper && (t[0] == pole || t[1] == pole || t[2] == pole)) break;
        }
        uint32_t *t = mesh.triangles + 3 * (size_t)f, k = t[0] == pole ? 0 : t[1] == pole ? 1 : 2;
        uint32_t x = t[(k + 1) % 3], y = t[(k + 2) % 3];
        const uint32_t added[6] = {pole, x, twin, pole, twin, y};
        t[k] = twin;
        memcpy(mesh.triangles + 3 * (size_t)faces, added, sizeof added);
        assert_int_equal(count_fans(&mesh, pole), 2);
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = made(&env, &mesh, &def);
        assert_int_equal(s->sorted.copy_count, 1);
        float *paint = malloc((twin + 1) * sizeof *paint);
        for (uint32_t v = 0; v <= twin; ++v) paint[v] = v == twin ? 100 : 1;
        assert_int_equal(fct_simplifier_paint(s, FCT_PAINT_INPUT, paint, twin + 1), FCT_OK);
        uint32_t with_twin = s->point_of[s->sorted.vertex_places[twin]], heavy = 0;
        assert_true(s->weights[with_twin] == 100);
        for (uint32_t p = 0; p < s->point_count; ++p) heavy += s->weights[p] == 100;
        assert_int_equal(heavy, 1);
        free(paint);
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &beads);
        fct_mesh_release(&env, &mesh);
    }
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fans_are_those_of_a_search),
        cmocka_unit_test(pinched_surfaces_reach_every_target),
        cmocka_unit_test(open_fans_stay_together),
        cmocka_unit_test(wishes_hold_for_all_fans),
        cmocka_unit_test(doubled_vertices_pass_their_weight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
