/* cluster/file/format.c: places of sections, and checksums. The checksum of a section is the hash of the
 * hashes of its blocks of 1 MiB, so that threads can share the work and a writer can hash block by block.
 */
#include "cluster/file/format.h"

#include <stddef.h>
#include <string.h>

#define XXH_STATIC_LINKING_ONLY
#include <xxhash.h>

#include "base/parallel.h"

const unsigned char fct_format_magic[8] = {0x89, 'F', 'C', 'T', '\r', '\n', 0x1A, '\n'};

const char *fct_format_section_name(int section) {
    static const char *const names[FCT_SECTION_COUNT] = {"roots",    "cut ids",    "cut",       "nodes",
                                                         "face ids", "vertex ids", "triangles", "positions",
                                                         "colors",   "materials"};
    return names[section];
}

static uint64_t align_offset(uint64_t offset) {
    return (offset + FCT_FORMAT_ALIGNMENT - 1) / FCT_FORMAT_ALIGNMENT * FCT_FORMAT_ALIGNMENT;
}

void fct_format_place(fct_format_header *header) {
    uint64_t faces = header->face_count, vertices = header->vertex_count, cut = header->cut_count;
    const uint64_t sizes[FCT_SECTION_COUNT] = {
        [FCT_SECTION_ROOTS] = 4 * (uint64_t)header->root_count,
        [FCT_SECTION_CUT_IDS] = 4 * cut,
        [FCT_SECTION_CUT] = cut * sizeof(fct_cluster),
        [FCT_SECTION_NODES] = (uint64_t)header->node_count * sizeof(fct_cluster),
        [FCT_SECTION_FACE_IDS] = 4 * faces,
        [FCT_SECTION_VERTEX_IDS] = 4 * vertices,
        [FCT_SECTION_TRIANGLES] = 12 * faces,
        [FCT_SECTION_POSITIONS] = 12 * vertices,
        [FCT_SECTION_COLORS] = header->flags & FCT_FORMAT_COLORS ? 12 * vertices : 0,
        [FCT_SECTION_MATERIALS] = header->flags & FCT_FORMAT_MATERIALS ? 4 * faces : 0};
    header->section_count = FCT_SECTION_COUNT;
    header->head_size = sizeof *header + header->source_size + header->names_size;
    uint64_t offset = align_offset(header->head_size);
    for (uint32_t i = 0; i < FCT_SECTION_COUNT; ++i) {
        header->sections[i].kind = i, header->sections[i].reserved = 0;
        header->sections[i].offset = offset, header->sections[i].size = sizes[i];
        offset = align_offset(offset + sizes[i]);
    }
    header->file_size = offset;
}

uint64_t fct_format_head_checksum(const void *head, size_t size) {
    const size_t at = offsetof(fct_format_header, checksum), after = at + sizeof(uint64_t);
    static const uint64_t zero = 0;
    XXH3_state_t state;
    XXH3_64bits_reset(&state);
    XXH3_64bits_update(&state, head, at);
    XXH3_64bits_update(&state, &zero, sizeof zero);
    XXH3_64bits_update(&state, (const char *)head + after, size - after);
    return XXH3_64bits_digest(&state);
}

typedef struct hash_job {
    const char *data;
    size_t size;
    uint64_t *hashes;
} hash_job;

static void hash_block(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const hash_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        size_t at = i * FCT_FORMAT_BLOCK, left = job->size - at;
        job->hashes[i] = XXH3_64bits(job->data + at, left < FCT_FORMAT_BLOCK ? left : FCT_FORMAT_BLOCK);
    }
}

void fct_format_hash_blocks(const fct_env *env, const void *data, size_t size, uint64_t *hashes) {
    hash_job job = {data, size, hashes};
    fct_parallel_for(env, fct_format_block_count(size), 1, hash_block, &job);
}

uint64_t fct_format_fold(const uint64_t *hashes, size_t count) {
    return XXH3_64bits(hashes, count * sizeof *hashes);
}
