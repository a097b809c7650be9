/* cluster/large/lookup.c: nodes, triangles and vertices through caches of blocks. */
#include "cluster/large/lookup.h"

#include <string.h>

enum { NODES = 8, TRIANGLES = 128, VERTICES = 256 }; /* per block of a cache */

static fct_result fill_nodes(void *user, uint64_t block, void *data) {
    const fct_spool *spool = user;
    uint64_t size = NODES * sizeof(fct_cluster), at = block * size;
    return fct_spool_read(spool, at, data, spool->size - at < size ? spool->size - at : size);
}

static fct_result fill_triangles(void *user, uint64_t block, void *data) {
    const fct_spool *spool = user;
    uint64_t size = TRIANGLES * 12, at = block * size;
    return fct_spool_read(spool, at, data, spool->size - at < size ? spool->size - at : size);
}

static fct_result fill_vertices(void *user, uint64_t block, void *data) {
    fct_large *l = user;
    uint32_t first = (uint32_t)block * VERTICES, left = l->info.vertex_count - first;
    return fct_stream_vertices(l->stream, first, left < VERTICES ? left : VERTICES, data, NULL);
}

fct_result fct_lookup_open(fct_large *large, size_t bytes, fct_lookup *out) {
    *out = (fct_lookup){.large = large};
    uint64_t nodes = large->nodes.size / (NODES * sizeof(fct_cluster)) + 1;
    uint64_t triangles = large->triangles.size / (TRIANGLES * 12) + 1;
    uint64_t vertices = large->info.vertex_count / VERTICES + 1;
    fct_result result =
        fct_cache_create(large->env, NODES * sizeof(fct_cluster), nodes,
                         bytes / 2 / (NODES * sizeof(fct_cluster)), fill_nodes, &large->nodes, &out->nodes);
    if (result == FCT_OK)
        result = fct_cache_create(large->env, TRIANGLES * 12, triangles, bytes / 4 / (TRIANGLES * 12),
                                  fill_triangles, &large->triangles, &out->triangles);
    if (result == FCT_OK)
        result = fct_cache_create(large->env, VERTICES * 12, vertices, bytes / 4 / (VERTICES * 12),
                                  fill_vertices, large, &out->vertices);
    if (result != FCT_OK) fct_lookup_close(out);
    return result;
}

void fct_lookup_close(fct_lookup *lookup) {
    fct_cache_release(&lookup->nodes);
    fct_cache_release(&lookup->triangles);
    fct_cache_release(&lookup->vertices);
}

fct_result fct_lookup_result(const fct_lookup *lookup) {
    if (lookup->nodes.result != FCT_OK) return lookup->nodes.result;
    return lookup->triangles.result != FCT_OK ? lookup->triangles.result : lookup->vertices.result;
}

const fct_cluster *fct_lookup_node(fct_lookup *lookup, const fct_part *part, uint32_t node) {
    uint64_t at = part->first_node + node;
    const fct_cluster *block = fct_cache_get(&lookup->nodes, at / NODES);
    return block ? block + at % NODES : NULL;
}

const float *fct_lookup_vertex(fct_lookup *lookup, uint32_t vertex) {
    const float *block = fct_cache_get(&lookup->vertices, vertex / VERTICES);
    return block ? block + 3 * (vertex % VERTICES) : NULL;
}

bool fct_lookup_face(fct_lookup *lookup, const fct_part *part, uint32_t place, float corners[9]) {
    uint64_t at = part->first_face + place;
    const uint32_t *block = fct_cache_get(&lookup->triangles, at / TRIANGLES);
    if (!block) return false;
    uint32_t triangle[3];
    memcpy(triangle, block + 3 * (at % TRIANGLES), sizeof triangle);
    for (size_t k = 0; k < 3; ++k) {
        const float *p = fct_lookup_vertex(lookup, triangle[k]);
        if (!p) return false;
        memcpy(corners + 3 * k, p, 3 * sizeof *p);
    }
    return true;
}
