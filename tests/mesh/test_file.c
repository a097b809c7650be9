/* tests/mesh/test_file.c: whole files or none, and a file that cannot be read says why. */
#define _GNU_SOURCE
#include <dirent.h>

#include "base/io/file.h"
#include "base/io/output.h"
#include "mesh_support.h"

static const char folder[] = "facetree_test_folder";

/* How many files the folder holds. */
static int count_files(void) {
    DIR *d = opendir(folder);
    int count = 0;
    for (struct dirent *e; (e = readdir(d));) count += e->d_name[0] != '.';
    closedir(d);
    return count;
}

static int make_folder(void **state) {
    (void)state;
    return mkdir(folder, 0777);
}

static int remove_folder(void **state) {
    (void)state;
    char path[512];
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));) {
        snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        if (strcmp(e->d_name, ".") && strcmp(e->d_name, "..")) remove(path);
    }
    closedir(d);
    return rmdir(folder);
}

static void expect_content(const char *path, const char *text) {
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_file file;
    assert_int_equal(fct_file_open(&env, path, &file), FCT_OK);
    assert_int_equal(file.size, strlen(text));
    assert_memory_equal(file.data, text, file.size);
    fct_file_close(&env, &file);
    assert_int_equal(r.alive, 0);
}

static fct_result write_text(void *user, FILE *stream) {
    fputs(user, stream);
    return FCT_OK;
}

static fct_result write_and_give_up(void *user, FILE *stream) {
    fputs(user, stream);
    return FCT_ERROR_CANCELLED;
}

static void failures_leave_the_old_file(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    char path[] = "facetree_test_folder/a";
    assert_int_equal(fct_file_write_atomic(&env, path, write_text, "first"), FCT_OK);
    assert_int_equal(chmod(path, 0640), 0);
    expect_content(path, "first");
    assert_int_equal(fct_file_write_atomic(&env, path, write_and_give_up, "second"), FCT_ERROR_CANCELLED);
    expect_content(path, "first");
    assert_int_equal(count_files(), 1);
    assert_int_equal(fct_file_write_atomic(&env, path, write_text, "third"), FCT_OK);
    expect_content(path, "third");
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0640);
    assert_int_equal(count_files(), 1);
}

static void links_are_followed(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    assert_int_equal(fct_file_write_atomic(&env, "facetree_test_folder/a", write_text, "old"), FCT_OK);
    assert_int_equal(symlink("a", "facetree_test_folder/link"), 0);
    assert_int_equal(fct_file_write_atomic(&env, "facetree_test_folder/link", write_text, "new"), FCT_OK);
    expect_content("facetree_test_folder/a", "new");
    struct stat status;
    assert_int_equal(lstat("facetree_test_folder/link", &status), 0);
    assert_true(S_ISLNK(status.st_mode));
}

static void what_cannot_be_opened_says_why(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_file file;
    fct_mesh m;
    assert_int_equal(fct_file_open(&env, "facetree_test_folder/none", &file), FCT_ERROR_INPUT);
    assert_true(strstr(r.text, "No such file") != NULL);
    assert_int_equal(fct_file_open(&env, folder, &file), FCT_ERROR_INPUT);
    assert_true(strstr(r.text, "Is a directory") != NULL);
    assert_int_equal(fct_mesh_load(&env, "facetree_test_folder/none.ply", &m), FCT_ERROR_INPUT);
    assert_int_equal(fct_mesh_load(&env, "none.docx", &m), FCT_ERROR_DATA);
    assert_true(strstr(r.text, "none.docx: unknown kind of file") != NULL);
    assert_int_equal(fct_file_write_atomic(&env, folder, write_text, "x"), FCT_ERROR_OUTPUT);
    assert_int_equal(fct_file_write_atomic(&env, "no_such_folder/x", write_text, "x"), FCT_ERROR_OUTPUT);
    assert_true(strstr(r.text, "no_such_folder/x: cannot be written: No such file") != NULL);
    assert_int_equal(r.alive, 0);
}

static void a_full_disk_is_an_error(void **state) {
    (void)state;
    if (access("/dev/full", W_OK)) skip();
    recorder r = {0};
    fct_env env = recorder_env(&r);
    assert_int_equal(fct_file_write_atomic(&env, "/dev/full", write_text, "x"), FCT_ERROR_OUTPUT);
    assert_true(strstr(r.text, "No space left") != NULL);
}

static void pipes_are_read_into_memory(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    int ends[2];
    char path[64];
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(write(ends[1], "through a pipe", 14), 14);
    close(ends[1]);
    snprintf(path, sizeof path, "/proc/self/fd/%d", ends[0]);
    if (!access(path, R_OK)) {
        fct_file file;
        assert_int_equal(fct_file_open(&env, path, &file), FCT_OK);
        assert_false(file.mapped);
        assert_int_equal(file.size, 14);
        assert_memory_equal(file.data, "through a pipe", 14);
        fct_file_close(&env, &file);
    }
    close(ends[0]);
    assert_int_equal(r.alive, 0);
}

/* A failed save leaves the old file and no other. Every run writes the same bytes. */
static void saves_are_whole(void **state) {
    (void)state;
    static const char *const endings[] = {"ply", "obj", "off", "stl", "glb", "om"};
    recorder ample = {0};
    fct_env plenty = recorder_env(&ample);
    fct_mesh m = make_full(&plenty);
    for (int i = 0; i < 6; ++i) {
        char path[64];
        snprintf(path, sizeof path, "%s/mesh.%s", folder, endings[i]);
        assert_int_equal(fct_file_write_atomic(&plenty, path, write_text, "old"), FCT_OK);
        int files = count_files();
        fct_result result = FCT_ERROR_MEMORY;
        for (long n = 1; result != FCT_OK; ++n) {
            recorder r = {.fail_at = n};
            fct_env env = recorder_env(&r);
            result = fct_mesh_save(&env, path, &m, NULL);
            assert_true(result == FCT_OK || result == FCT_ERROR_MEMORY);
            assert_int_equal(r.alive, 0);
            assert_int_equal(count_files(), files);
            if (result != FCT_OK) expect_content(path, "old");
        }
        fct_file first, second;
        assert_int_equal(fct_file_open(&plenty, path, &first), FCT_OK);
        assert_int_equal(fct_mesh_save(&plenty, path, &m, NULL), FCT_OK);
        assert_int_equal(fct_file_open(&plenty, path, &second), FCT_OK);
        assert_int_equal(first.size, second.size);
        assert_memory_equal(first.data, second.data, first.size);
        fct_file_close(&plenty, &first);
        fct_file_close(&plenty, &second);
    }
    m.positions[5] = NAN;
    assert_int_equal(fct_mesh_save(&plenty, "facetree_test_folder/bad.ply", &m, NULL), FCT_ERROR_DATA);
    assert_false(file_exists("facetree_test_folder/bad.ply"));
    assert_int_equal(fct_mesh_save(&plenty, "facetree_test_folder/bad", &m, NULL), FCT_ERROR_DATA);
    release(&ample, &m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(failures_leave_the_old_file, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(links_are_followed, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(what_cannot_be_opened_says_why, make_folder, remove_folder),
        cmocka_unit_test(a_full_disk_is_an_error),
        cmocka_unit_test(pipes_are_read_into_memory),
        cmocka_unit_test_setup_teardown(saves_are_whole, make_folder, remove_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
