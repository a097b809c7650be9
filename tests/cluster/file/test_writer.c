/* The writer of hierarchy files: pieces of any size, with the sections in turns, give the same bytes as
 * fct_tree_save. Every error leaves the old file and no temporary file. */
#include "../check_tree.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/io/file.h"
#include "cluster/file/file.h"

static const char *const folder = "test_writer_folder";
static const char *const path = "test_writer_folder/tree.fct";

static int enter(void **state) {
    (void)state;
    return mkdir(folder, 0777);
}

static int leave(void **state) {
    (void)state;
    unlink(path);
    return rmdir(folder);
}

static int count_files(void) {
    int count = 0;
    DIR *open = opendir(folder);
    for (struct dirent *entry; (entry = readdir(open));) count += entry->d_name[0] != '.';
    closedir(open);
    return count;
}

typedef struct bytes {
    unsigned char *data;
    size_t size;
} bytes;

static bytes read_bytes(const char *name) {
    fct_env env = fct_env_default();
    fct_file file;
    assert_int_equal(fct_file_open(&env, name, &file), FCT_OK);
    bytes all = {malloc(file.size), file.size};
    memcpy(all.data, file.data, file.size);
    fct_file_close(&env, &file);
    return all;
}

static fct_tree *build_sphere(const fct_env *env, uint32_t n) {
    fct_mesh mesh = make_sphere(env, n);
    fct_tree *tree;
    assert_int_equal(fct_tree_build(env, &mesh, NULL, NULL, &tree), FCT_OK);
    fct_mesh_release(env, &mesh);
    return tree;
}

static const struct {
    fct_section section;
    uint32_t bytes; /* per item */
} parts[] = {{FCT_SECTION_TRIANGLES, 12}, {FCT_SECTION_NODES, sizeof(fct_cluster)},
             {FCT_SECTION_POSITIONS, 12}, {FCT_SECTION_ROOTS, 4},
             {FCT_SECTION_VERTEX_IDS, 4}, {FCT_SECTION_FACE_IDS, 4}};
enum { PARTS = sizeof parts / sizeof *parts };

/* Writes the sections of a tree without colours in turns, `piece` bytes at a time. The caller finishes. */
static fct_result write_by_turns(const fct_env *env, const fct_tree *tree, size_t piece,
                                 fct_tree_writer **writer) {
    const fct_tree_view *view = &tree->view;
    const void *data[PARTS] = {view->triangles, tree->nodes,      view->positions,
                               view->roots,     view->vertex_ids, view->face_ids};
    const uint32_t counts[PARTS] = {view->face_count, view->node_count,   view->vertex_count,
                                    view->root_count, view->vertex_count, view->face_count};
    size_t done[PARTS] = {0}, left = 1;
    fct_result result = fct_tree_writer_open(env, path, view, 0, writer);
    if (result != FCT_OK) return result;
    while (left && result == FCT_OK) {
        left = 0;
        for (int i = 0; i < PARTS && result == FCT_OK; ++i) {
            size_t rest = (size_t)counts[i] * parts[i].bytes - done[i], take = piece < rest ? piece : rest;
            result = fct_tree_writer_put(*writer, parts[i].section, (const char *)data[i] + done[i], take);
            done[i] += take, left += rest - take;
        }
    }
    return result;
}

static void pieces_make_the_same_file(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    /* the nodes fill more than one block of 1 MiB */
    fct_tree *tree = build_sphere(&env, SANITIZED ? 56 : 90);
    fct_tree_view view = fct_tree_get(tree);
    assert_true((size_t)view.node_count * sizeof(fct_cluster) > 1 << 20);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    bytes saved = read_bytes(path);
    const size_t pieces[] = {1 << 24, 1 << 20, 1000003, 4096, 1237};
    for (size_t i = 0; i < sizeof pieces / sizeof *pieces; ++i) {
        env.thread_count = (uint32_t)(1 + 2 * (i % 2));
        fct_tree_writer *writer;
        assert_int_equal(write_by_turns(&env, tree, pieces[i], &writer), FCT_OK);
        assert_int_equal(fct_tree_writer_finish(writer, &view), FCT_OK);
        bytes written = read_bytes(path);
        assert_int_equal(written.size, saved.size);
        assert_memory_equal(written.data, saved.data, saved.size);
        free(written.data);
    }
    assert_int_equal(count_files(), 1);
    free(saved.data);
    fct_tree_destroy(tree);
    assert_int_equal(r.alive, 0);
}

static void an_abandoned_file_was_never_there(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_tree *tree = build_sphere(&env, 4);
    fct_tree_view view = fct_tree_get(tree);
    fct_tree_writer *writer;
    int before = count_files();
    assert_int_equal(fct_tree_writer_open(&env, path, &view, 0, &writer), FCT_OK);
    assert_true(count_files() <= before + 1); /* a temporary file may have no name */
    assert_int_equal(fct_tree_writer_put(writer, FCT_SECTION_NODES, tree->nodes, 1000), FCT_OK);
    fct_tree_writer_abandon(writer);
    assert_int_equal(count_files(), before);
    assert_int_equal(fct_tree_writer_open(&env, "no_such_folder/x.fct", &view, 0, &writer), FCT_ERROR_OUTPUT);
    assert_null(writer);
    assert_non_null(strstr(r.text, "no_such_folder/x.fct"));
    fct_tree_writer_abandon(NULL);
    fct_tree_destroy(tree);
    assert_int_equal(r.alive, 0);
}

/* The error of a device reaches the message hook. */
static void a_full_device_is_an_error(void **state) {
    (void)state;
    if (access("/dev/full", W_OK)) skip();
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_tree *tree = build_sphere(&env, 4);
    assert_int_equal(fct_tree_save(&env, tree, "/dev/full"), FCT_ERROR_OUTPUT);
    assert_non_null(strstr(r.text, "No space left"));
    fct_tree_destroy(tree);
    assert_int_equal(r.alive, 0);
}

static void no_memory_leaves_the_old_file(void **state) {
    (void)state;
    recorder ample = {0}, r = {0};
    fct_env plenty = recorder_env(&ample), env = recorder_env(&r);
    fct_tree *tree = build_sphere(&plenty, 8);
    fct_tree_view view = fct_tree_get(tree);
    FILE *old = fopen(path, "wb");
    fputs("old", old);
    fclose(old);
    for (r.fail_at = 1;; ++r.fail_at) {
        fct_tree_writer *writer;
        r.allocations = 0;
        fct_result result = write_by_turns(&env, tree, 1000, &writer);
        if (result == FCT_OK)
            result = fct_tree_writer_finish(writer, &view);
        else
            fct_tree_writer_abandon(writer);
        assert_int_equal(r.alive, 0);
        assert_int_equal(count_files(), 1);
        bytes now = read_bytes(path);
        bool same = now.size == 3 && !memcmp(now.data, "old", 3);
        free(now.data);
        assert_true(same == (result != FCT_OK));
        if (result == FCT_OK) break;
        assert_int_equal(result, FCT_ERROR_MEMORY);
    }
    assert_true(r.fail_at > 10);
    fct_tree_destroy(tree);
    assert_int_equal(ample.alive, 0);
}

static bool stop(void *user, const char *phase, double done) {
    (void)phase, (void)done;
    return --*(int *)user > 0;
}

static void a_cancelled_save_leaves_the_old_file(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_tree *tree = build_sphere(&env, 8);
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_OK);
    bytes before = read_bytes(path);
    int steps = 3;
    env.progress = stop, env.progress_user = &steps;
    assert_int_equal(fct_tree_save(&env, tree, path), FCT_ERROR_CANCELLED);
    bytes after = read_bytes(path);
    assert_int_equal(before.size, after.size);
    assert_memory_equal(before.data, after.data, after.size);
    assert_int_equal(count_files(), 1);
    free(before.data), free(after.data);
    fct_tree_destroy(tree);
    assert_int_equal(r.alive, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pieces_make_the_same_file), cmocka_unit_test(an_abandoned_file_was_never_there),
        cmocka_unit_test(a_full_device_is_an_error), cmocka_unit_test(no_memory_leaves_the_old_file),
        cmocka_unit_test(a_cancelled_save_leaves_the_old_file)};
    return cmocka_run_group_tests(tests, enter, leave);
}
