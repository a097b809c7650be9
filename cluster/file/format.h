/* cluster/file/format.h: header and section table of the hierarchy file, version 3. docs/hierarchy-file.md
 * describes every byte. The structs are the layout; all numbers are little endian. */
#ifndef FCT_CLUSTER_FORMAT_H
#define FCT_CLUSTER_FORMAT_H

#include "cluster/file/file.h"

enum {
    FCT_FORMAT_VERSION = 3,
    FCT_FORMAT_ORDER_MARK = 0x01020304,
    FCT_FORMAT_ALIGNMENT = 64,
    FCT_FORMAT_BLOCK = 1 << 20, /* bytes per hash */
    FCT_FORMAT_CUT = 2048       /* largest number of clusters in the cut */
};

/* Flags. */
enum {
    FCT_FORMAT_COLORS = 1,
    FCT_FORMAT_MATERIALS = 2,
    FCT_FORMAT_NAMES = 4,
    FCT_FORMAT_WELD = 8,
    FCT_FORMAT_INWARD = 16
};

typedef struct fct_format_section {
    uint32_t kind, reserved;
    uint64_t offset, size, checksum;
} fct_format_section;

typedef struct fct_format_header {
    unsigned char magic[8];
    uint32_t version, order_mark;
    uint64_t file_size;
    uint64_t checksum;  /* XXH3-64 of the head with this field zero */
    uint64_t head_size; /* header, source, names */
    uint32_t face_count, vertex_count, node_count, root_count, material_count, depth;
    uint32_t boundary_edges, nonmanifold_edges, component_count, flags;
    double mean_depth;
    uint64_t source_hash;
    uint32_t method, cost, fit_measure, wanted_roots;
    double fit_weight, direction_weight, shape_weight, max_cost;
    fct_bounds bounds;
    uint64_t source_size, names_size;
    uint32_t cut_count, section_count;
    fct_format_section sections[FCT_SECTION_COUNT];
    double origin[3];
} fct_format_header;

_Static_assert(sizeof(fct_format_header) == 536 && sizeof(fct_cluster) == 132,
               "the structs are the layout of the file");

extern const unsigned char fct_format_magic[8];

/* The name of a section for messages, such as "nodes". */
const char *fct_format_section_name(int section);

/* Computes kinds, offsets and sizes of the sections and the sizes of head and file, from the counts, the
 * flags and the sizes of source and names. Sums cannot overflow: counts have 32 bits, source and names at
 * most 2^62 bytes. */
void fct_format_place(fct_format_header *header);

/* The checksum of the head: `size` bytes that begin with the header, whose own checksum counts as zero. */
uint64_t fct_format_head_checksum(const void *head, size_t size);

static inline size_t fct_format_block_count(uint64_t size) {
    return (size_t)((size + FCT_FORMAT_BLOCK - 1) / FCT_FORMAT_BLOCK);
}

/* Hashes `size` bytes block by block, in parallel. */
void fct_format_hash_blocks(const fct_env *env, const void *data, size_t size, uint64_t *hashes);
/* The checksum of a section from the hashes of its blocks. */
uint64_t fct_format_fold(const uint64_t *hashes, size_t count);

#endif
