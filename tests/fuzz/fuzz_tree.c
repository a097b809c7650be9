/* Whatever the bytes are: an error, or a tree on which nothing that a user may ask crashes or hangs, verified
 * or not. Checksums are mended first, for no mutation would ever get past them. */
#include <math.h>
#include <string.h>

#include <xxhash.h>

#include "cluster/file.h"
#include "facetree/bvh.h"
#include "fuzz/fuzz.h"

/* As docs/hierarchy-file.md has it. */
enum { HEADER = 448, FILE_SIZE = 16, CHECKSUM = 24, SECTIONS = 128, SECTION = 32 };

static uint64_t get64(const uint8_t *p) {
    uint64_t value;
    memcpy(&value, p, sizeof value);
    return value;
}

static void put64(uint8_t *p, uint64_t value) {
    memcpy(p, &value, sizeof value);
}

static void mend(uint8_t *data, size_t size) {
    if (size < HEADER) return;
    for (uint8_t *s = data + SECTIONS; s < data + HEADER; s += SECTION) {
        uint64_t offset = get64(s + 8), length = get64(s + 16);
        if (offset <= size && length <= size - offset) put64(s + 24, XXH3_64bits(data + offset, length));
    }
    put64(data + FILE_SIZE, size);
    put64(data + CHECKSUM, 0);
    put64(data + CHECKSUM, XXH3_64bits(data, HEADER));
}

static void shoot(const fct_env *env, const fct_tree *tree) {
    fct_bvh *bvh;
    if (fct_bvh_create(env, tree, FCT_BACKEND_OBB, &bvh) != FCT_OK) return;
    uint32_t faces = fct_tree_get(tree).face_count;
    fct_ray ray = {{.1F, .2F, 3}, 0, {.01F, .02F, -1}, INFINITY};
    fct_hit hit;
    if (fct_bvh_closest_hit(bvh, &ray, &hit, NULL))
        fuzz_require(hit.face < faces && hit.t >= 0, "a hit is a face");
    fct_closest closest;
    if (fct_bvh_closest_point(bvh, ray.origin, INFINITY, &closest, NULL))
        fuzz_require(closest.face < faces, "a nearest point lies on a face");
    fct_bvh_destroy(bvh);
}

static void use(const fct_env *env, const fct_tree *tree) {
    fct_tree_view view = fct_tree_get(tree);
    uint32_t *nodes = fct_allocate(env, view.face_count, 4), *labels = fct_allocate(env, view.face_count, 4);
    for (uint32_t k = 1; k <= view.face_count; k += 1 + k / 2) {
        uint32_t count = fct_tree_partition(tree, k, nodes), places = 0;
        for (uint32_t i = 0; i < count; ++i) {
            fct_cluster cluster;
            fct_box box;
            fct_tree_cluster(tree, nodes[i], &cluster);
            fct_cluster_box(&cluster, &box);
            fuzz_require(cluster.first == places, "clusters follow one another");
            places += cluster.count;
        }
        fuzz_require(places == view.face_count, "a partition has every face once");
        fct_tree_labels(tree, nodes, count, labels);
        for (uint32_t f = 0; f < view.face_count; ++f) fuzz_require(labels[f] < count, "labels are in range");
        fct_partition_quality quality;
        fct_tree_quality(env, tree, nodes, count, &quality);
    }
    fct_release(env, nodes);
    fct_release(env, labels);
    fct_mesh mesh;
    fuzz_require(fct_tree_mesh(env, tree, &mesh) == FCT_OK, "a tree holds a mesh");
    fct_mesh_release(env, &mesh);
    shoot(env, tree);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    fct_tree *tree;
    uint8_t *copy = malloc(size + 1);
    if (!copy) return 0;
    memcpy(copy, data, size);
    mend(copy, size);
    fct_result result = fct_tree_parse(&env, "input", copy, size, &tree);
    free(copy);
    fuzz_require((result == FCT_OK) == (tree != NULL), "a failed read leaves no tree");
    if (!tree) return 0;
    use(&env, tree);
    fct_tree_verify(&env, tree);
    fct_tree_destroy(tree);
    return 0;
}
