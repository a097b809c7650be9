/* tests/simplify/mend_state.h: state files whose bytes are changed: corrects their checksum, and uses
 * whatever state they give. */
#ifndef FCT_TESTS_MEND_STATE_H
#define FCT_TESTS_MEND_STATE_H

#include <string.h>
#include <xxhash.h>

#include "facetree/simplifier.h"
#include "simplify/handle/file.h"

enum { MEND_PASSES = 52 };

/* Corrects the checksum, because otherwise every change would fail there. Of the number of refit passes only
 * the lowest bits stay, because any number is valid. */
static inline void mend_state(uint8_t *data, size_t size) {
    if (size < MEND_PASSES + 12) return;
    const uint8_t few[4] = {data[MEND_PASSES] & 3, 0, 0, 0};
    memcpy(data + MEND_PASSES, few, sizeof few);
    uint64_t sum = XXH3_64bits(data, size - 8);
    memcpy(data + size - 8, &sum, sizeof sum);
}

/* Paints and constrains; the state may refuse that. */
static inline void mend_wish(fct_simplifier *s) {
    static const uint32_t contour[4] = {0, 1, 1, 2}, points[2] = {1, 0};
    static const float weights[4] = {8, 1, .5f, 3};
    fct_constrain_def def = fct_constrain_def_default();
    def.contour = contour, def.contour_count = 1;
    def.points = points, def.point_count = 2;
    (void)fct_simplifier_constrain(s, &def);
    for (uint32_t count = 0; count <= 4; ++count) {
        (void)fct_simplifier_paint(s, FCT_PAINT_INPUT, weights, count);
        (void)fct_simplifier_paint(s, FCT_PAINT_CURRENT, weights, count);
    }
}

/* Reads the file, goes on, and writes meshes. `require` reports a broken promise. Returns whether it was
 * read. */
static inline bool mend_try_state(const fct_env *env, const uint8_t *data, size_t size,
                                  void (*require)(bool condition, const char *what)) {
    fct_simplifier *s;
    fct_mesh mesh;
    fct_result result = fct_state_read(env, "a file", data, size, &s);
    require(!s == (result != FCT_OK), "a failure leaves nothing behind");
    if (result != FCT_OK) return false;
    for (uint32_t i = 0; i < 3; ++i) {
        if (i == 2) mend_wish(s);
        uint32_t faces = fct_simplifier_faces(s);
        result = fct_simplifier_mesh(s, i != 1, &mesh, NULL);
        if (result == FCT_OK) require(mesh.face_count == faces, "the mesh has the faces of the state");
        if (result == FCT_OK) require(fct_mesh_validate(env, &mesh) == FCT_OK, "the mesh is valid");
        fct_mesh_release(env, &mesh);
        result = fct_simplifier_run(s, faces / 2, INFINITY, NULL);
        require(fct_simplifier_faces(s) <= faces, "a run adds no faces");
    }
    result = fct_simplifier_undo(s, UINT32_MAX);
    fct_simplifier_destroy(s);
    return true;
}

#endif
