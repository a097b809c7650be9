/* Reading and writing whole files. Written bytes are read back. An output appears only when it is complete.
 * Links and permissions stay. Every error leaves the old file and no temporary file. Pipes and folders. */
#define _GNU_SOURCE
#include "support.h"

#include <dirent.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/io/file.h"
#include "base/io/output.h"
#include "base/io/temporary.h"

static char folder[64];

static int enter_folder(void **state) {
    (void)state;
    strcpy(folder, "/tmp/facetree-file-XXXXXX");
    return mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static int leave_folder(void **state) {
    (void)state;
    const char *names[] = {"file", "link", "pipe", "kept", "locked"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) unlink(names[i]);
    (void)!rmdir("inner");
    return chdir("/") || rmdir(folder); /* fails if a file remains */
}

static uint32_t files_here(void) {
    DIR *all = opendir(".");
    uint32_t count = 0;
    for (struct dirent *entry; (entry = readdir(all));) count += entry->d_name[0] != '.';
    closedir(all);
    return count;
}

typedef struct content {
    const void *data;
    size_t size;
    fct_result result; /* the result of the producer */
} content;

static fct_result produce(void *user, FILE *stream) {
    const content *c = user;
    for (size_t at = 0; at < c->size; at += 1000)
        (void)!fwrite((const char *)c->data + at, 1, c->size - at < 1000 ? c->size - at : 1000, stream);
    return c->result;
}

static fct_result write_text(const fct_env *env, const char *path, const char *text) {
    content c = {text, strlen(text), FCT_OK};
    return fct_file_write_atomic(env, path, produce, &c);
}

static void holds(const char *path, const void *data, size_t size) {
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_file file;
    assert_int_equal(fct_file_open(&env, path, &file), FCT_OK);
    assert_int_equal(file.size, size);
    assert_non_null(file.data);
    if (size > 0) assert_memory_equal(file.data, data, size);
    fct_file_close(&env, &file);
    assert_true(!file.data && file.size == 0);
    fct_file_close(&env, &file); /* a zero struct */
    assert_int_equal(r.alive, 0);
}

static void what_is_written_is_read(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    const size_t sizes[] = {0, 1, 999, 4096, 300001};
    unsigned char *data = malloc(300001);
    for (size_t i = 0; i < 300001; ++i) data[i] = (unsigned char)(i * 31 >> 3);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        content c = {data, sizes[i], FCT_OK};
        assert_int_equal(fct_file_write_atomic(&env, "file", produce, &c), FCT_OK);
        assert_int_equal(files_here(), 1);
        holds("file", data, sizes[i]);
    }
    free(data);
}

static fct_result look_meanwhile(void *user, FILE *stream) {
    fputs("new", stream);
    fflush(stream);
    holds("file", user, strlen(user)); /* the old one is there while the new one is made */
    return FCT_OK;
}

static void the_old_file_stays_until_the_end(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    assert_int_equal(write_text(&env, "file", "old"), FCT_OK);
    assert_int_equal(fct_file_write_atomic(&env, "file", look_meanwhile, "old"), FCT_OK);
    holds("file", "new", 3);
    content bad = {"half", 4, FCT_ERROR_CANCELLED};
    assert_int_equal(fct_file_write_atomic(&env, "file", produce, &bad), FCT_ERROR_CANCELLED);
    holds("file", "new", 3);
    assert_int_equal(files_here(), 1);
    content first = {"half", 4, FCT_ERROR_DATA};
    assert_int_equal(fct_file_write_atomic(&env, "none", produce, &first), FCT_ERROR_DATA);
    assert_false(file_exists("none"));
    assert_int_equal(files_here(), 1);
}

/* A limit on the size of files stands for a full disk. */
static void a_full_disk_leaves_the_old_file(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    char data[20000] = {1};
    content c = {data, sizeof data, FCT_OK};
    assert_int_equal(write_text(&env, "file", "old"), FCT_OK);
    struct rlimit before, little;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    little = before;
    little.rlim_cur = 5000;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &little), 0);
    fct_result result = fct_file_write_atomic(&env, "file", produce, &c);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    signal(SIGXFSZ, handler);
    assert_int_equal(result, FCT_ERROR_OUTPUT);
    assert_non_null(strstr(r.text, "file: cannot be written"));
    holds("file", "old", 3);
    assert_int_equal(files_here(), 1);
}

static void links_and_permissions_stay(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    struct stat status;
    assert_int_equal(write_text(&env, "file", "one"), FCT_OK);
    assert_int_equal(chmod("file", 0640), 0);
    assert_int_equal(symlink("file", "link"), 0);
    assert_int_equal(write_text(&env, "link", "two"), FCT_OK);
    holds("file", "two", 3);
    assert_int_equal(lstat("link", &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    assert_int_equal(stat("file", &status), 0);
    assert_int_equal(status.st_mode & 07777, 0640);
    unlink("link");
}

typedef struct reader {
    char text[200000];
    size_t size;
} reader;

static void *read_pipe(void *user) {
    reader *r = user;
    FILE *stream = fopen("pipe", "rb");
    r->size = fread(r->text, 1, sizeof r->text, stream);
    fclose(stream);
    return NULL;
}

static void *write_pipe(void *user) {
    const content *c = user;
    FILE *stream = fopen("pipe", "wb");
    produce((void *)(uintptr_t)c, stream);
    fclose(stream);
    return NULL;
}

/* More than a pipe holds, both ways. */
static void pipes_are_read_and_written(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    static char data[150000];
    static reader read;
    for (size_t i = 0; i < sizeof data; ++i) data[i] = (char)(i % 97);
    content c = {data, sizeof data, FCT_OK};
    assert_int_equal(mkfifo("pipe", 0600), 0);
    pthread_t other;
    assert_int_equal(pthread_create(&other, NULL, read_pipe, &read), 0);
    assert_int_equal(fct_file_write_atomic(&env, "pipe", produce, &c), FCT_OK);
    pthread_join(other, NULL);
    struct stat status;
    assert_int_equal(stat("pipe", &status), 0);
    assert_true(S_ISFIFO(status.st_mode));
    assert_int_equal(read.size, sizeof data);
    assert_memory_equal(read.text, data, sizeof data);

    fct_file file;
    assert_int_equal(pthread_create(&other, NULL, write_pipe, &c), 0);
    assert_int_equal(fct_file_open(&env, "pipe", &file), FCT_OK);
    pthread_join(other, NULL);
    assert_int_equal(file.size, sizeof data);
    assert_memory_equal(file.data, data, sizeof data);
    assert_false(file.mapped);
    fct_file_close(&env, &file);

    r.fail_at = r.allocations + 2; /* memory runs out on the way */
    void (*handler)(int) = signal(SIGPIPE, SIG_IGN);
    assert_int_equal(pthread_create(&other, NULL, write_pipe, &c), 0);
    assert_int_equal(fct_file_open(&env, "pipe", &file), FCT_ERROR_MEMORY);
    pthread_join(other, NULL);
    signal(SIGPIPE, handler);
    assert_true(!file.data && r.alive == 0);
    unlink("pipe");
}

static void what_cannot_be_opened_is_told(void **state) {
    (void)state;
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_file file = {.size = 5};
    assert_int_equal(mkdir("inner", 0700), 0);
    assert_int_equal(fct_file_open(&env, "missing", &file), FCT_ERROR_INPUT);
    assert_non_null(strstr(r.text, "missing: cannot be read: "));
    assert_true(!file.data && file.size == 0);
    assert_int_equal(fct_file_open(&env, "inner", &file), FCT_ERROR_INPUT);
    assert_int_equal(fct_file_open(&env, "", &file), FCT_ERROR_INPUT);
    assert_int_equal(write_text(&env, "inner", "x"), FCT_ERROR_OUTPUT);
    assert_non_null(strstr(r.text, "inner: cannot be written: "));
    assert_int_equal(write_text(&env, "none/file", "x"), FCT_ERROR_OUTPUT);
    assert_int_equal(write_text(&env, "", "x"), FCT_ERROR_OUTPUT);
    char name[400];
    memset(name, 'n', sizeof name - 1);
    name[sizeof name - 1] = 0;
    assert_int_equal(write_text(&env, name, "x"), FCT_ERROR_OUTPUT);
    char *path = malloc(10000); /* longer than any path */
    for (size_t i = 0; i < 9999; ++i) path[i] = i % 2 ? '/' : '.';
    path[9999] = 0;
    assert_int_equal(write_text(&env, path, "x"), FCT_ERROR_OUTPUT);
    free(path);
    if (geteuid() != 0) {
        assert_int_equal(write_text(&env, "locked", "x"), FCT_OK);
        assert_int_equal(chmod("locked", 0400), 0);
        assert_int_equal(write_text(&env, "locked", "y"), FCT_ERROR_OUTPUT);
        holds("locked", "x", 1);
        unlink("locked");
    }
    assert_int_equal(rmdir("inner"), 0);
    assert_int_equal(files_here(), 1);
}

/* Advice changes nothing that can be read, wherever it points to. */
static void advice_on_any_part_is_harmless(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    char data[10000];
    memset(data, 'a', sizeof data);
    content c = {data, sizeof data, FCT_OK};
    assert_int_equal(fct_file_write_atomic(&env, "file", produce, &c), FCT_OK);
    fct_file file;
    assert_int_equal(fct_file_open(&env, "file", &file), FCT_OK);
    assert_true(file.mapped);
    for (int use = FCT_FILE_SPARSE; use <= FCT_FILE_USUAL; ++use) {
        fct_file_advise(&file, 0, file.size, (fct_file_use)use);
        fct_file_advise(&file, 4097, 3, (fct_file_use)use);
        fct_file_advise(&file, file.size, 0, (fct_file_use)use);
        assert_memory_equal(file.data, data, sizeof data);
    }
    fct_file_close(&env, &file);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read),         cmocka_unit_test(the_old_file_stays_until_the_end),
        cmocka_unit_test(a_full_disk_leaves_the_old_file), cmocka_unit_test(links_and_permissions_stay),
        cmocka_unit_test(pipes_are_read_and_written),      cmocka_unit_test(what_cannot_be_opened_is_told),
        cmocka_unit_test(advice_on_any_part_is_harmless)};
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
