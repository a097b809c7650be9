/* Coarse work reads only the beginning of a hierarchy file, on any mesh, also with loose faces. The test
 * drops the file from the page cache, opens it, and counts the pages that are in the cache afterwards. */
#define _GNU_SOURCE
#include "../check_tree.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/math/vec.h"

static const char *const path = "test_touch.fct";
enum { PAGE = 4096, LONE = 200, RINGS = SANITIZED ? 150 : 300 };

/* The number of pages of the file in the page cache. */
static size_t resident(void) {
    int descriptor = open(path, O_RDWR);
    struct stat status;
    assert_true(descriptor >= 0 && fstat(descriptor, &status) == 0);
    size_t size = (size_t)status.st_size, pages = (size + PAGE - 1) / PAGE, count = 0;
    void *data = mmap(NULL, size, PROT_READ, MAP_SHARED, descriptor, 0);
    unsigned char *bits = malloc(pages);
    assert_true(data != MAP_FAILED && mincore(data, size, bits) == 0);
    for (size_t i = 0; i < pages; ++i) count += bits[i] & 1;
    free(bits);
    munmap(data, size);
    close(descriptor);
    return count;
}

/* Drops the file from the page cache. Returns whether that worked, so that later pages are those that were
 * read. */
static bool dropped(void) {
    int descriptor = open(path, O_RDWR);
    assert_true(descriptor >= 0);
    fsync(descriptor);
    posix_fadvise(descriptor, 0, 0, POSIX_FADV_DONTNEED);
    close(descriptor);
    if (sysconf(_SC_PAGESIZE) == PAGE && resident() == 0) return true;
    print_message("the file system keeps files in memory, so reads cannot be counted\n");
    return false;
}

/* A sphere of small faces, and large triangles far apart around it, which stay leaves until the last merges.
 */
static fct_mesh make_scene(const fct_env *env) {
    fct_mesh ball = make_sphere(env, RINGS), mesh;
    assert_int_equal(fct_mesh_create(env, ball.vertex_count + 3 * LONE, ball.face_count + LONE, 0, &mesh),
                     FCT_OK);
    memcpy(mesh.positions, ball.positions, 12 * (size_t)ball.vertex_count);
    memcpy(mesh.triangles, ball.triangles, 12 * (size_t)ball.face_count);
    for (uint32_t i = 0; i < LONE; ++i) {
        double turn = 2.4 * i, height = 1 - 2 * (i + .5) / LONE, r = sqrt(1 - height * height);
        v3 out = v3_make(r * cos(turn), r * sin(turn), height), t, b, center = v3_scale(out, 4 + .03 * i);
        v3_frame(out, &t, &b);
        float *p = mesh.positions + 3 * (size_t)(ball.vertex_count + 3 * i);
        v3_store(p, v3_mad(center, .3, t));
        v3_store(p + 3, v3_mad(center, .3, b));
        v3_store(p + 6, v3_mad(center, -.3, t));
        for (uint32_t k = 0; k < 3; ++k)
            mesh.triangles[3 * (size_t)(ball.face_count + i) + k] = ball.vertex_count + 3 * i + k;
    }
    fct_mesh_release(env, &ball);
    return mesh;
}

static int save_scene(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_scene(&env);
    fct_tree *tree;
    assert_int_equal(fct_tree_build(&env, &mesh, NULL, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    return 0;
}

static int remove_scene(void **state) {
    (void)state;
    return unlink(path);
}

static void opening_reads_the_first_page(void **state) {
    (void)state;
    if (!dropped()) skip();
    fct_env env = fct_env_default();
    fct_tree *tree;
    assert_int_equal(fct_tree_open(&env, path, &tree), FCT_OK);
    fct_tree_view view = fct_tree_get(tree);
    assert_true(view.component_count == LONE + 1 && view.boundary_edges == 3 * LONE);
    assert_int_equal(resident(), 1);
    fct_cluster root;
    assert_int_equal(fct_tree_cluster(tree, view.roots[0], &root), FCT_OK);
    assert_int_equal(root.count, view.face_count);
    assert_in_range(resident(), 1, 4);
    fct_tree_destroy(tree);
}

static void a_thousand_clusters_read_less_than_a_megabyte(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_tree *tree;
    uint32_t nodes[2048], count, leaves = 0;
    for (uint32_t k = 1000; k <= 2048; k += 1048) {
        if (!dropped()) skip();
        assert_int_equal(fct_tree_open(&env, path, &tree), FCT_OK);
        assert_int_equal(fct_tree_partition(&env, tree, k, nodes, &count), FCT_OK);
        assert_int_equal(count, k);
        uint32_t faces = 0;
        for (uint32_t i = 0; i < count; ++i) {
            fct_cluster c;
            assert_int_equal(fct_tree_cluster(tree, nodes[i], &c), FCT_OK);
            leaves += c.count == 1;
            faces += c.count;
        }
        assert_int_equal(faces, fct_tree_get(tree).face_count);
        /* the nodes above the cut, its ids and its clusters */
        size_t pages = resident(), least = k * sizeof(fct_cluster) / PAGE;
        size_t most = 2048 * (2 * sizeof(fct_cluster) + 4) / PAGE + 4;
        print_message("%u clusters: %zu KB of %zu\n", k, pages * 4,
                      (size_t)fct_tree_get(tree).node_count * sizeof(fct_cluster) / 1000);
        assert_true(most < (1 << 20) / PAGE);
        assert_in_range(pages, least, most);
        fct_tree_destroy(tree);
    }
    assert_true(leaves >= LONE);
}

/* The count also notices when everything is read. */
static void checking_reads_everything(void **state) {
    (void)state;
    if (!dropped()) skip();
    fct_env env = fct_env_default();
    fct_tree *tree;
    struct stat status;
    assert_int_equal(fct_tree_open(&env, path, &tree), FCT_OK);
    assert_int_equal(fct_tree_check(&env, tree), FCT_OK);
    assert_int_equal(stat(path, &status), 0);
    assert_true(resident() >= (size_t)status.st_size / PAGE * 9 / 10);
    fct_tree_destroy(tree);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(opening_reads_the_first_page),
                                       cmocka_unit_test(a_thousand_clusters_read_less_than_a_megabyte),
                                       cmocka_unit_test(checking_reads_everything)};
    return cmocka_run_group_tests(tests, save_scene, remove_scene);
}
