/* tests/simplify/mend_levels.h: progressive mesh files whose bytes are changed: corrects their checksums, and
 * uses whatever levels they give. */
#ifndef FCT_TESTS_MEND_LEVELS_H
#define FCT_TESTS_MEND_LEVELS_H

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "simplify/progressive/progressive.h"

enum {
    MEND_HEAD = 72,
    MEND_HEAD_SUM = 16,
    MEND_NAMES = 24,
    MEND_BLOCK = 16,
    MEND_BLOCK_SIZE = 4,
    MEND_BLOCK_SUM = 8
};

/* Corrects the checksums, because otherwise every change would fail there. */
static inline void mend_levels(uint8_t *data, size_t size) {
    uint32_t names, length;
    if (size < MEND_HEAD) return;
    memcpy(&names, data + MEND_NAMES, sizeof names);
    if (names > size - MEND_HEAD) return;
    memset(data + MEND_HEAD_SUM, 0, 8);
    uint64_t parts[2] = {XXH3_64bits(data, MEND_HEAD), XXH3_64bits(data + MEND_HEAD, names)};
    uint64_t sum = XXH3_64bits(parts, sizeof parts);
    memcpy(data + MEND_HEAD_SUM, &sum, sizeof sum);
    for (size_t at = MEND_HEAD + (size_t)names; size - at >= MEND_BLOCK; at += MEND_BLOCK + length) {
        memcpy(&length, data + at + MEND_BLOCK_SIZE, sizeof length);
        if (length > size - at - MEND_BLOCK) return;
        sum = XXH3_64bits(data + at + MEND_BLOCK, length);
        memcpy(data + at + MEND_BLOCK_SUM, &sum, sizeof sum);
    }
}

/* Reads the file, and goes to levels. `require` reports a broken promise. Returns whether it was read. */
static inline bool mend_try_levels(const fct_env *env, const uint8_t *data, size_t size,
                                   void (*require)(bool condition, const char *what)) {
    fct_progressive *progressive;
    fct_progressive_info info;
    fct_mesh mesh;
    fct_result result = fct_progressive_read(env, "a file", data, size, &progressive);
    require(!progressive == (result != FCT_OK), "a failure leaves nothing behind");
    if (result != FCT_OK) return false;
    fct_progressive_inspect(progressive, &info);
    for (uint32_t i = 0; i <= 4; ++i) {
        uint32_t faces = info.least_faces + (info.most_faces - info.least_faces) / 4 * (i * 3 % 5);
        uint32_t found = fct_progressive_go(progressive, faces);
        result = i == 2 ? fct_progressive_morph(progressive, faces / 2, .5, &mesh)
                        : fct_progressive_mesh(progressive, &mesh);
        if (result != FCT_OK) continue; /* no memory */
        require(mesh.face_count == found && found <= faces, "a level has no more faces than asked for");
        require(i == 2 || fct_mesh_validate(env, &mesh) == FCT_OK, "a level is a valid mesh");
        for (uint32_t f = 0; f < mesh.face_count && i != 2; ++f) {
            const uint32_t *t = mesh.triangles + 3 * (size_t)f;
            require(t[0] != t[1] && t[1] != t[2] && t[2] != t[0], "a face has three vertices");
        }
        fct_mesh_release(env, &mesh);
        fct_progressive_inspect(progressive, &info);
        require(info.error >= 0, "an error is not negative");
    }
    fct_progressive_destroy(progressive);
    return true;
}

#endif
