/* A library to preload. Files without a name fail, as on a file system without O_TMPFILE, unless NAMELESS is
 * set in the environment. KILL_AT=n kills the process before its nth call that opens, names, writes or
 * removes a file. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))

static void count_call(void) {
    static long calls;
    const char *at = getenv("KILL_AT");
    if (at && __atomic_add_fetch(&calls, 1, __ATOMIC_RELAXED) == atol(at)) kill(getpid(), SIGKILL);
}

EXPORT int open(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    unsigned mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(rest, unsigned) : 0;
    va_end(rest);
    count_call();
    if ((flags & O_TMPFILE) == O_TMPFILE && !getenv("NAMELESS")) {
        errno = EOPNOTSUPP;
        return -1;
    }
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

EXPORT int close(int descriptor) {
    count_call();
    return (int)syscall(SYS_close, descriptor);
}

EXPORT int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags) {
    count_call();
    return (int)syscall(SYS_linkat, from_folder, from, to_folder, to, flags);
}

EXPORT int rename(const char *from, const char *to) {
    count_call();
    return (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
}

EXPORT int unlink(const char *path) {
    count_call();
    return (int)syscall(SYS_unlinkat, AT_FDCWD, path, 0);
}

EXPORT int unlinkat(int folder, const char *path, int flags) {
    count_call();
    return (int)syscall(SYS_unlinkat, folder, path, flags);
}

EXPORT int mkdir(const char *path, mode_t mode) {
    count_call();
    return (int)syscall(SYS_mkdirat, AT_FDCWD, path, mode);
}

EXPORT int fsync(int descriptor) {
    count_call();
    return (int)syscall(SYS_fsync, descriptor);
}

EXPORT int ftruncate(int descriptor, off_t size) {
    count_call();
    return (int)syscall(SYS_ftruncate, descriptor, size);
}

EXPORT ssize_t pwrite(int descriptor, const void *data, size_t size, off_t offset) {
    count_call();
    return (ssize_t)syscall(SYS_pwrite64, descriptor, data, size, offset);
}
