/* A room with surfaces in all directions, for tests of gathers. */
#ifndef TESTS_RADIOSITY_OUTPUT_ROOM_H
#define TESTS_RADIOSITY_OUTPUT_ROOM_H

#include "../place.h"
#include "../soup.h"
#include "radiosity/solve/transport.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* A number in [0, 1). */
static double pick(uint64_t a, uint64_t b, uint64_t c) {
    return fct_uniform(fct_hash3(a, b, c));
}

/* A room with random sheets inside, and a bumpy ball as the last instance. Every leaf shines in a colour of
 * its own. */
typedef struct room {
    fct_scene *scene;
    fct_elements set;
    float *stored;
    soup triangles;
    uint32_t ball;
} room;

static room make_room(uint64_t seed) {
    room r = {.ball = 14};
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &r.scene), FCT_OK);
    uint32_t grey = place_material(r.scene, .5, 0, false), two = place_material(r.scene, .5, 0, true);
    fct_mesh cube = make_sphere(&plain, 3), ball = make_bumpy(&plain, 9, .25);
    for (size_t t = 0; t < cube.face_count; ++t) {
        uint32_t *c = cube.triangles + 3 * t, swap = c[1];
        c[1] = c[2], c[2] = swap;
    }
    const float wide[12] = {4, 0, 0, 0, 0, 4, 0, 0, 0, 0, 4, 0};
    place_mesh(r.scene, &cube, grey, wide);
    for (uint64_t k = 0; k < 13; ++k)
        place_sheet(&plain, r.scene, k & 1 ? two : grey, 1,
                    v3_make(2 * pick(seed, k, 0) - 1, 2 * pick(seed, k, 1) - 1, pick(seed, k, 2) - .5),
                    v3_make(.4 * pick(seed, k, 3), .4, .3 * pick(seed, k, 4)),
                    v3_make(.4, -.2, pick(seed, k, 5) - .5));
    const float place[12] = {.6F, 0, 0, .2F, 0, .6F, 0, .5F, 0, 0, .6F, 0};
    place_mesh(r.scene, &ball, two, place);
    fct_mesh_release(&plain, &cube), fct_mesh_release(&plain, &ball);
    assert_int_equal(fct_scene_commit(r.scene), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, r.scene, 1, &r.set), FCT_OK);
    for (uint32_t id = 0; id < r.set.count; ++id)
        if (fct_elements_can_split(&r.set, id)) assert_int_equal(fct_elements_split(&r.set, id), FCT_OK);
    r.stored = malloc(3 * r.set.count * sizeof *r.stored);
    for (size_t i = 0; i < 3 * r.set.count; ++i)
        r.stored[i] = (float)(pick(seed, i, 6) * pick(seed, i / 30, 7));
    r.triangles = list_triangles(r.scene);
    return r;
}

static void end_room(room *r) {
    free(r->stored), free(r->triangles.corners);
    fct_elements_release(&r->set);
    fct_scene_destroy(r->scene);
}

#endif
