/* base/io/temporary.c: see temporary.h. */
#define _GNU_SOURCE
#include "base/io/temporary.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#define PREFIX ".facetree-"
#define SUFFIX ".tmp"
enum { NUMBERS = 1000 }; /* names to try */

bool fct_folder_of(const char *path, char *folder, size_t size) {
    const char *slash = strrchr(path, '/');
    size_t length = slash == path ? 1 : slash ? (size_t)(slash - path) : 0;
    return (size_t)snprintf(folder, size, "%.*s", length ? (int)length : 1, length ? path : ".") < size;
}

static bool make_name(const char *folder, int number, char *name, size_t size) {
    if ((size_t)snprintf(name, size, "%s/" PREFIX "%ld-%d" SUFFIX, folder, (long)getpid(), number) < size)
        return true;
    errno = ENAMETOOLONG;
    return false;
}

/* Locks a file against removal by other processes. False if another process is removing it. Without locks on
 * the file system, no process removes it. */
static bool lock_file(int descriptor) {
    struct stat status;
    if (flock(descriptor, LOCK_SH | LOCK_NB)) return errno != EWOULDBLOCK;
    return fstat(descriptor, &status) || status.st_nlink > 0;
}

/* A nameless file gets its name through /proc. */
static void name_descriptor(int descriptor, char path[32]) {
    snprintf(path, 32, "/proc/self/fd/%d", descriptor);
}

static int open_nameless(const char *folder) {
    char link[32];
    struct stat status;
    int descriptor = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
    if (descriptor < 0) return -1;
    name_descriptor(descriptor, link);
    if (lstat(link, &status) == 0) return descriptor;
    close(descriptor);
    return -1;
}

int fct_temporary_open(const char *folder, char *name, size_t size) {
    *name = 0;
    int descriptor = open_nameless(folder);
    if (descriptor >= 0) return descriptor;
    for (int i = 0; i < NUMBERS; ++i) {
        if (!make_name(folder, i, name, size)) return -1;
        descriptor = open(name, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0 && lock_file(descriptor)) return descriptor;
        if (descriptor >= 0) {
            close(descriptor);
            unlink(name);
        } else if (errno != EEXIST) {
            return -1;
        }
    }
    return -1;
}

int fct_temporary_link(int descriptor, const char *name) {
    char link[32];
    name_descriptor(descriptor, link);
    return linkat(AT_FDCWD, link, AT_FDCWD, name, AT_SYMLINK_FOLLOW);
}

int fct_temporary_link_any(int descriptor, const char *folder, char *name, size_t size) {
    (void)flock(descriptor, LOCK_SH | LOCK_NB); /* before it has a name, so no process can remove it */
    for (int i = 0; i < NUMBERS; ++i) {
        if (!make_name(folder, i, name, size)) break;
        if (fct_temporary_link(descriptor, name) == 0) return 0;
        if (errno != EEXIST) break;
    }
    *name = 0;
    return -1;
}

/* Whether `name` is that of a temporary file; *process receives the process that made it. No function of this
 * file that a signal handler reaches uses strtol or memory of the heap. */
static bool parse_name(const char *name, long *process) {
    if (strncmp(name, PREFIX, sizeof PREFIX - 1) != 0) return false;
    const char *c = name + sizeof PREFIX - 1, *first = c;
    *process = 0;
    for (; *c >= '0' && *c <= '9' && c - first < 10; ++c) *process = 10 * *process + (*c - '0');
    if (c == first || *c++ != '-') return false;
    first = c;
    while (*c >= '0' && *c <= '9') ++c;
    return c > first && strcmp(c, SUFFIX) == 0;
}

/* Removes the file unless a process holds its lock. */
static void remove_unlocked(int folder, const char *name) {
    struct stat status;
    int descriptor = openat(folder, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) return;
    if (fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
        flock(descriptor, LOCK_EX | LOCK_NB) == 0)
        unlinkat(folder, name, 0);
    close(descriptor);
}

/* The kernel's record of an entry of a folder. readdir allocates memory, which a signal handler must not. */
typedef struct entry {
    uint64_t inode;
    int64_t offset;
    uint16_t size;
    uint8_t type;
    char name[];
} entry;

/* Removes temporary files: those of `process`, or those that no process locks if it is 0. */
static void remove_from_folder(const char *path, long process) {
    _Alignas(8) char buffer[8192];
    long got, owner;
    int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return;
    while ((got = syscall(SYS_getdents64, folder, buffer, sizeof buffer)) > 0) {
        for (long at = 0; at < got;) {
            const entry *e = (const entry *)(buffer + at);
            at += e->size;
            if (!parse_name(e->name, &owner)) continue;
            if (process && owner == process)
                unlinkat(folder, e->name, 0);
            else if (!process)
                remove_unlocked(folder, e->name);
        }
    }
    close(folder);
}

void fct_temporary_sweep(const char *folder) {
    remove_from_folder(folder, 0);
}

void fct_temporary_remove(const char *folder) {
    remove_from_folder(folder, (long)getpid());
}
