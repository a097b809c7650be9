/* simplify/streams.h: the arrays of a mesh with attributes of its vertices, as a list. */
#ifndef FCT_SIMPLIFY_STREAMS_H
#define FCT_SIMPLIFY_STREAMS_H

#include "facetree/mesh.h"

enum {
    STREAM_COLORS,
    STREAM_NORMALS,
    STREAM_IRRADIANCE,
    STREAM_DIRECT,
    STREAM_INDIRECT,
    STREAM_ERROR,
    STREAM_COUNT,
    STREAM_FLOATS = 16 /* of all streams */
};

static inline float **stream_slot(fct_mesh *mesh, uint32_t stream) {
    float **const slots[STREAM_COUNT] = {&mesh->colors, &mesh->normals,  &mesh->irradiance,
                                         &mesh->direct, &mesh->indirect, &mesh->error};
    return slots[stream];
}
/* The values of a stream; NULL if the mesh does not have it. */
static inline const float *stream_values(const fct_mesh *mesh, uint32_t stream) {
    const float *const values[STREAM_COUNT] = {mesh->colors, mesh->normals,  mesh->irradiance,
                                               mesh->direct, mesh->indirect, mesh->error};
    return values[stream];
}
/* Floats per vertex. */
static inline uint32_t stream_width(uint32_t stream) {
    return stream == STREAM_ERROR ? 1 : 3;
}
/* The streams of a mesh as arrays of fct_mesh_create. */
static inline unsigned stream_kinds(const fct_mesh *mesh) {
    static const unsigned kinds[STREAM_COUNT] = {FCT_MESH_COLORS, FCT_MESH_NORMALS,  FCT_MESH_IRRADIANCE,
                                                 FCT_MESH_DIRECT, FCT_MESH_INDIRECT, FCT_MESH_ERROR};
    unsigned found = 0;
    for (uint32_t i = 0; i < STREAM_COUNT; ++i)
        if (stream_values(mesh, i)) found |= kinds[i];
    return found;
}

#endif
