/* tests/simplify/mend_levels.h: progressive mesh files whose bytes are changed: corrects their checksums, and
 * uses whatever levels they give. */
#ifndef FCT_TESTS_MEND_LEVELS_H
#define FCT_TESTS_MEND_LEVELS_H

#include <math.h>
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

/* Looks at the mesh from places that depend on the file; the cuts are meshes between the ends. */
static inline void mend_try_views(const fct_env *env, fct_progressive *progressive, uint32_t seed,
                                  void (*require)(bool condition, const char *what)) {
    fct_progressive_info info;
    fct_mesh mesh;
    fct_progressive_inspect(progressive, &info);
    for (uint32_t i = 0; i < 4; ++i, seed = seed * 1664525u + 1013904223u) {
        fct_view view = fct_view_default();
        fct_view_stats stats;
        for (uint32_t k = 0; k < 3; ++k) view.position[k] = (double)(seed >> (8 * k) & 15) / 4 - 1;
        view.target[0] = 7, view.up[i % 3] = seed >> 28;
        view.vertical_fov = 1 + (seed >> 24 & 127), view.width = 1 + (seed >> 20);
        view.tolerance = i == 3 ? 0 : (double)(1 << (seed >> 26 & 7)) / 8;
        view.silhouette_tolerance = i == 1 ? view.tolerance : 0;
        view.back_factor = seed & 1 ? 3 : (double)INFINITY, view.outside_factor = 1 + (seed >> 30);
        if (fct_progressive_view(progressive, &view, &mesh, &stats) != FCT_OK) continue; /* no memory */
        require(mesh.face_count >= info.least_faces && mesh.face_count <= info.most_faces,
                "a view is between the ends");
        require(i != 3 || mesh.face_count == info.most_faces, "no tolerance gives the finest level");
        require(fct_mesh_validate(env, &mesh) == FCT_OK, "a view is a valid mesh");
        require(stats.splits <= info.split_count && stats.forced <= stats.splits && stats.pixels >= 0,
                "a view has splits of the file");
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            const uint32_t *t = mesh.triangles + 3 * (size_t)f;
            require(t[0] != t[1] && t[1] != t[2] && t[2] != t[0], "a face of a view has three vertices");
        }
        fct_mesh_release(env, &mesh);
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
    mend_try_views(env, progressive, (uint32_t)XXH3_64bits(data, size), require);
    fct_progressive_destroy(progressive);
    return true;
}

#endif
