/* base/io/file.c: see file.h. */
#define _GNU_SOURCE
#include "base/io/file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static const unsigned char empty[1];

static fct_result fail_input(const fct_env *env, const char *path) {
    fct_result result = errno == ENOMEM ? FCT_ERROR_MEMORY : FCT_ERROR_INPUT;
    return fct_fail(env, result, "%s: cannot be read: %s", path, strerror(errno));
}

static fct_result read_stream(const fct_env *env, const char *path, int descriptor, fct_file *out) {
    unsigned char *data = NULL;
    size_t capacity = 0, size = 0;
    fct_result result = FCT_OK;
    for (;;) {
        result = fct_grow(env, (void **)&data, &capacity, size + 65536, 1);
        if (result != FCT_OK) goto failed;
        ssize_t got = read(descriptor, data + size, capacity - size);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            result = fail_input(env, path);
            goto failed;
        }
        if (got == 0) break;
        size += (size_t)got;
    }
    *out = (fct_file){.data = data, .size = size};
    return FCT_OK;
failed:
    fct_release(env, data);
    return result;
}

fct_result fct_file_open(const fct_env *env, const char *path, fct_file *out) {
    *out = (fct_file){0};
    if (!strcmp(path, "-")) return read_stream(env, "standard input", STDIN_FILENO, out);
    int descriptor = open(path, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return fail_input(env, path);
    fct_result result = FCT_OK;
    struct stat status;
    if (fstat(descriptor, &status)) {
        result = fail_input(env, path);
    } else if (!S_ISREG(status.st_mode)) {
        result = read_stream(env, path, descriptor, out);
    } else if (status.st_size == 0) {
        *out = (fct_file){.data = empty, .mapped = true};
    } else {
        size_t size = (size_t)status.st_size;
        void *data = mmap(NULL, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
        if (data == MAP_FAILED)
            result = fail_input(env, path);
        else
            *out = (fct_file){.data = data, .size = size, .mapped = true};
    }
    close(descriptor);
    if (result == FCT_OK && env->opened) env->opened(env->opened_user, path, out->mapped ? out->size : 0);
    return result;
}

const char *fct_file_format(const fct_env *env, const char *path) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    if (dot && dot[1]) return dot + 1;
    return env->input_format ? env->input_format : !strcmp(path, "-") ? "ply" : "";
}

void fct_file_close(const fct_env *env, fct_file *file) {
    if (!file->mapped)
        fct_release(env, (void *)file->data);
    else if (file->data != empty)
        munmap((void *)file->data, file->size);
    *file = (fct_file){0};
}

void fct_file_advise(const fct_file *file, uint64_t offset, uint64_t size, fct_file_use use) {
    if (!file->mapped || file->data == empty || !size) return;
    static const int advices[] = {MADV_RANDOM, MADV_SEQUENTIAL, MADV_NORMAL, MADV_DONTNEED};
    uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE), begin = offset / page * page;
    (void)!madvise((char *)file->data + begin, offset + size - begin, advices[use]);
}
