/* Temporary files: without a name where the file system has O_TMPFILE, with a locked name elsewhere. Those of
 * killed processes are removed, and no others. Outputs follow links to missing files and take names of 255
 * bytes. */
#define _GNU_SOURCE
#include "support.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/io/output.h"
#include "base/io/temporary.h"

static bool has_nameless = true; /* false: as on a file system without O_TMPFILE */
static char folder[64];

/* Replaces the function of the C library. */
int open(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    unsigned mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(rest, unsigned) : 0;
    va_end(rest);
    if (!has_nameless && (flags & O_TMPFILE) == O_TMPFILE) {
        errno = EOPNOTSUPP;
        return -1;
    }
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

static int enter_folder(void **state) {
    (void)state;
    strcpy(folder, "/tmp/facetree-temporary-XXXXXX");
    return mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static int leave_folder(void **state) {
    (void)state;
    return chdir("/") || rmdir(folder); /* fails if a file remains */
}

static uint32_t count_entries(void) {
    DIR *all = opendir(".");
    uint32_t count = 0;
    for (struct dirent *e; (e = readdir(all));) count += strcmp(e->d_name, ".") && strcmp(e->d_name, "..");
    closedir(all);
    return count;
}

static fct_result write_new(void *user, FILE *stream) {
    fputs(user ? user : "new", stream);
    return FCT_OK;
}

static void holds(const char *path, const char *text) {
    char found[64] = "";
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    (void)!fread(found, 1, sizeof found - 1, file);
    fclose(file);
    assert_string_equal(found, text);
}

static void a_file_has_no_name_before_the_end(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_output output;
    assert_int_equal(fct_output_open(&env, "file", 3, &output), FCT_OK);
    uint32_t named = *output.temporary ? 1 : 0;
    assert_int_equal(count_entries(), named);
    assert_int_equal(fct_output_write(&output, 0, "one", 3), FCT_OK);
    assert_int_equal(fct_output_finish(&output), FCT_OK);
    assert_int_equal(count_entries(), 1);
    holds("file", "one");
    assert_int_equal(fct_output_open(&env, "file", 3, &output), FCT_OK);
    assert_int_equal(fct_output_write(&output, 0, "two", 3), FCT_OK);
    assert_int_equal(count_entries(), 1 + named);
    holds("file", "one");
    assert_int_equal(fct_output_finish(&output), FCT_OK);
    assert_int_equal(count_entries(), 1);
    holds("file", "two");
    unlink("file");
}

/* The target did not exist when the output was opened. */
static void a_file_that_appears_meanwhile_is_replaced(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    for (int i = 0; i < 2; ++i) {
        has_nameless = i == 0;
        fct_output output;
        assert_int_equal(fct_output_open(&env, "file", 3, &output), FCT_OK);
        assert_int_equal(fct_output_write(&output, 0, "new", 3), FCT_OK);
        assert_int_equal(fct_file_write_atomic(&env, "file", write_new, "other"), FCT_OK);
        assert_int_equal(fct_output_finish(&output), FCT_OK);
        holds("file", "new");
        assert_int_equal(count_entries(), 1);
        unlink("file");
    }
    has_nameless = true;
}

static void permissions_are_those_of_the_old_file_or_of_the_mask(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    struct stat status;
    mode_t before = umask(027);
    for (int i = 0; i < 2; ++i) {
        has_nameless = i == 0;
        assert_int_equal(fct_file_write_atomic(&env, "file", write_new, NULL), FCT_OK);
        assert_int_equal(stat("file", &status), 0);
        assert_int_equal(status.st_mode & 07777, 0640);
        assert_int_equal(chmod("file", 0604), 0);
        assert_int_equal(fct_file_write_atomic(&env, "file", write_new, NULL), FCT_OK);
        assert_int_equal(stat("file", &status), 0);
        assert_int_equal(status.st_mode & 07777, 0604);
        unlink("file");
    }
    umask(before);
    has_nameless = true;
}

/* Starts a process that opens an output and waits. Returns the process. */
static pid_t start_writer(void) {
    int ends[2];
    char byte;
    assert_int_equal(pipe(ends), 0);
    pid_t process = fork();
    if (process == 0) {
        fct_env env = fct_env_default();
        fct_output output;
        if (fct_output_open(&env, "file", 100, &output) != FCT_OK) _exit(1);
        (void)!write(ends[1], "x", 1);
        for (;;) pause();
    }
    assert_int_equal(read(ends[0], &byte, 1), 1);
    close(ends[0]);
    close(ends[1]);
    return process;
}

static void kill_writer(pid_t process) {
    int status;
    kill(process, SIGKILL);
    assert_int_equal(waitpid(process, &status, 0), process);
}

static void files_of_killed_processes_are_removed(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    has_nameless = false;
    pid_t dead = start_writer(), alive = start_writer();
    char name[64];
    snprintf(name, sizeof name, ".facetree-%ld-0.tmp", (long)alive);
    kill_writer(dead);
    assert_int_equal(count_entries(), 2);
    assert_int_equal(fct_output_check(&env, "other"), FCT_OK);
    assert_int_equal(count_entries(), 1);
    assert_true(file_exists(name));
    fct_temporary_remove("."); /* none is of this process */
    assert_true(file_exists(name));
    kill_writer(alive);
    has_nameless = true; /* a run with nameless files removes named ones too */
    assert_int_equal(fct_output_check(&env, "other"), FCT_OK);
    assert_int_equal(count_entries(), 0);
    pid_t nameless = start_writer();
    uint32_t count = count_entries();
    kill_writer(nameless);
    assert_true(count <= 1);
    fct_temporary_sweep(".");
    assert_int_equal(count_entries(), 0);
}

static void the_files_of_this_process_can_be_removed(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_output output;
    has_nameless = false;
    assert_int_equal(fct_output_open(&env, "file", 100, &output), FCT_OK);
    fct_temporary_sweep(".");
    assert_int_equal(count_entries(), 1); /* it is locked */
    fct_temporary_remove(".");
    assert_int_equal(count_entries(), 0);
    fct_output_abandon(&output);
    fct_temporary_remove("no such folder");
    has_nameless = true;
}

static void other_files_stay(void **state) {
    (void)state;
    static const char *const names[] = {".facetree-1.tmp",   ".facetree-1-.tmp", ".facetree--1.tmp",
                                        ".facetree-1-1.tmq", "facetree-1-1.tmp", ".facetree-1-1.tmp.ply",
                                        ".facetree-a-1.tmp"};
    enum { COUNT = sizeof names / sizeof *names };
    for (int i = 0; i < COUNT; ++i) close(open(names[i], O_CREAT | O_WRONLY, 0600));
    assert_int_equal(mkdir(".facetree-1-1.tmp", 0700), 0);
    assert_int_equal(symlink(names[0], ".facetree-1-2.tmp"), 0);
    close(open(".facetree-1-3.tmp", O_CREAT | O_WRONLY, 0600));
    assert_int_equal(count_entries(), COUNT + 3);
    fct_temporary_sweep(".");
    assert_int_equal(count_entries(), COUNT + 2);
    assert_false(file_exists(".facetree-1-3.tmp"));
    for (int i = 0; i < COUNT; ++i) assert_int_equal(unlink(names[i]), 0);
    assert_int_equal(rmdir(".facetree-1-1.tmp"), 0);
    assert_int_equal(unlink(".facetree-1-2.tmp"), 0);
}

static void links_to_missing_files_are_followed(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    char absolute[128];
    struct stat status;
    assert_int_equal(mkdir("inner", 0700), 0);
    snprintf(absolute, sizeof absolute, "%s/inner/target", folder);
    assert_int_equal(symlink("inner/second", "first"), 0);
    assert_int_equal(symlink("../third", "inner/second"), 0); /* relative to the folder of the link */
    assert_int_equal(symlink(absolute, "third"), 0);
    for (int i = 0; i < 2; ++i) { /* the target is missing, then there */
        assert_int_equal(fct_file_write_atomic(&env, "first", write_new, i ? "two" : "one"), FCT_OK);
        holds("inner/target", i ? "two" : "one");
        assert_int_equal(lstat("first", &status), 0);
        assert_true(S_ISLNK(status.st_mode));
    }
    assert_int_equal(symlink("no/such/folder", "lost"), 0);
    assert_int_equal(fct_file_write_atomic(&env, "lost", write_new, NULL), FCT_ERROR_OUTPUT);
    assert_int_equal(symlink("loop", "loop"), 0);
    assert_int_equal(fct_file_write_atomic(&env, "loop", write_new, NULL), FCT_ERROR_OUTPUT);
    static const char *const names[] = {"first", "inner/second", "third", "inner/target", "lost", "loop"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) assert_int_equal(unlink(names[i]), 0);
    assert_int_equal(rmdir("inner"), 0);
}

static void names_may_be_as_long_as_the_file_system_allows(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    char name[NAME_MAX + 2];
    memset(name, 'n', sizeof name);
    for (int i = 0; i < 4; ++i) { /* new and replaced, without and with a temporary name */
        has_nameless = i < 2;
        name[NAME_MAX] = 0;
        assert_int_equal(fct_file_write_atomic(&env, name, write_new, NULL), FCT_OK);
        holds(name, "new");
        name[NAME_MAX] = 'n', name[NAME_MAX + 1] = 0;
        fct_writer *writer; /* the error comes before the work */
        assert_int_equal(fct_writer_open(&env, name, &writer), FCT_ERROR_OUTPUT);
        assert_null(writer);
        name[NAME_MAX] = 0;
        if (i == 1) unlink(name);
    }
    unlink(name);
    has_nameless = true;
    assert_int_equal(fct_output_check(&env, "none/"), FCT_ERROR_OUTPUT);
    assert_int_equal(count_entries(), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_file_has_no_name_before_the_end),
                                       cmocka_unit_test(a_file_that_appears_meanwhile_is_replaced),
                                       cmocka_unit_test(permissions_are_those_of_the_old_file_or_of_the_mask),
                                       cmocka_unit_test(files_of_killed_processes_are_removed),
                                       cmocka_unit_test(the_files_of_this_process_can_be_removed),
                                       cmocka_unit_test(other_files_stay),
                                       cmocka_unit_test(links_to_missing_files_are_followed),
                                       cmocka_unit_test(names_may_be_as_long_as_the_file_system_allows)};
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
