/* base/io/output.c: see output.h. */
#define _GNU_SOURCE
#include "base/io/output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Bytes between requests to write to the disk, so that the disk works before the end. */
#define PORTION ((uint64_t)64 << 20)

fct_result fct_output_fail(const fct_env *env, const char *path, int error) {
    return fct_fail(env, FCT_ERROR_OUTPUT, "%s: cannot be written: %s", path,
                    error ? strerror(error) : "the stream failed");
}

/* Creates a new file beside `target` and stores its name in `temporary`. The name has the process id and a
 * count. O_EXCL fails if another process has created it. */
static int create_beside(const char *target, char *temporary, size_t size) {
    for (int i = 0; i < 1000; ++i) {
        if ((size_t)snprintf(temporary, size, "%s.%ld-%d.tmp", target, (long)getpid(), i) >= size) {
            errno = ENAMETOOLONG;
            return -1;
        }
        int descriptor = open(temporary, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0 || errno != EEXIST) return descriptor;
    }
    return -1;
}

/* A nameless file, for a target that is a pipe or a device. */
static int create_spool(void) {
    const char *folder = getenv("TMPDIR");
    char name[PATH_MAX];
    if ((size_t)snprintf(name, sizeof name, "%s/facetree.XXXXXX", folder && *folder ? folder : "/tmp") >=
        sizeof name) {
        errno = ENAMETOOLONG;
        return -1;
    }
    int descriptor = mkostemp(name, O_CLOEXEC);
    if (descriptor >= 0) unlink(name);
    return descriptor;
}

/* Writes the folder to the disk, because a rename is permanent only then. Some network file systems cannot
 * synchronise folders, so failures are ignored. */
static void synchronise_folder(const char *target) {
    char folder[PATH_MAX];
    snprintf(folder, sizeof folder, "%s", target);
    char *slash = strrchr(folder, '/');
    if (!slash)
        strcpy(folder, ".");
    else
        slash[slash == folder] = 0;
    int descriptor = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    (void)!fsync(descriptor);
    close(descriptor);
}

/* Opens a file beside `path`, or a nameless one. */
static fct_result create_output(const fct_env *env, const char *path, fct_output *out) {
    struct stat status;
    bool standard = !strcmp(path, "-"), exists = !standard && stat(path, &status) == 0;
    *out = (fct_output){.env = env, .descriptor = -1};
    if ((size_t)snprintf(out->path, sizeof out->path, "%s", path) >= sizeof out->path)
        return fct_output_fail(env, path, ENAMETOOLONG);
    if (exists && S_ISDIR(status.st_mode)) return fct_output_fail(env, path, EISDIR);
    if (exists && access(path, W_OK)) return fct_output_fail(env, path, errno);
    if (standard || (exists && !S_ISREG(status.st_mode))) {
        out->spooled = true;
        out->descriptor = create_spool();
    } else {
        if (!exists || !realpath(path, out->target)) strcpy(out->target, out->path);
        out->descriptor = create_beside(out->target, out->temporary, sizeof out->temporary);
    }
    if (out->descriptor < 0) return fct_output_fail(env, path, errno);
    if (exists && !out->spooled) (void)!fchmod(out->descriptor, status.st_mode & 07777);
    return FCT_OK;
}

fct_result fct_output_open(const fct_env *env, const char *path, uint64_t size, fct_output *out) {
    fct_result result = create_output(env, path, out);
    if (result != FCT_OK) return result;
    /* Some file systems cannot reserve space, and report a full disk only while writing. */
    if (size && fallocate(out->descriptor, 0, 0, (off_t)size) && (errno == ENOSPC || errno == EFBIG))
        result = fct_output_fail(env, path, errno);
    else if (ftruncate(out->descriptor, (off_t)size))
        result = fct_output_fail(env, path, errno);
    if (result != FCT_OK) fct_output_abandon(out);
    return result;
}

fct_result fct_output_write(fct_output *output, uint64_t offset, const void *data, size_t size) {
    const char *from = data;
    for (size_t done = 0; done < size;) {
        ssize_t got = pwrite(output->descriptor, from + done, size - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return fct_output_fail(output->env, output->path, got ? errno : ENOSPC);
        done += (size_t)got;
    }
    output->pending += size;
    if (output->pending < PORTION) return FCT_OK;
    output->pending = 0;
    (void)!sync_file_range(output->descriptor, 0, 0, SYNC_FILE_RANGE_WRITE);
    return FCT_OK;
}

fct_result fct_output_read(const fct_output *output, uint64_t offset, void *data, size_t size) {
    char *to = data;
    for (size_t done = 0; done < size;) {
        ssize_t got = pread(output->descriptor, to + done, size - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return fct_output_fail(output->env, output->path, got ? errno : EIO);
        done += (size_t)got;
    }
    return FCT_OK;
}

/* Copies the nameless file to standard output, a device or a pipe. */
static fct_result copy_spool(fct_output *output) {
    bool standard = !strcmp(output->path, "-");
    FILE *to = standard ? stdout : fopen(output->path, "wbe");
    if (!to) return fct_output_fail(output->env, output->path, errno);
    char block[1 << 16];
    ssize_t got;
    fct_result result = FCT_OK;
    off_t offset = 0;
    errno = 0;
    while ((got = pread(output->descriptor, block, sizeof block, offset)) > 0) {
        if (fwrite(block, 1, (size_t)got, to) != (size_t)got) break;
        offset += got;
    }
    if (got || fflush(to) || ferror(to))
        result = fct_output_fail(output->env, standard ? "standard output" : output->path, errno);
    if (!standard && fclose(to) && result == FCT_OK)
        result = fct_output_fail(output->env, output->path, errno);
    return result;
}

static fct_result take_name(const fct_output *output) {
    if (fsync(output->descriptor) || rename(output->temporary, output->target))
        return fct_output_fail(output->env, output->path, errno);
    synchronise_folder(output->target);
    return FCT_OK;
}

fct_result fct_output_finish(fct_output *output) {
    fct_result result = output->spooled ? copy_spool(output) : take_name(output);
    if (result != FCT_OK) {
        fct_output_abandon(output);
        return result;
    }
    close(output->descriptor);
    output->descriptor = -1;
    return result;
}

void fct_output_abandon(fct_output *output) {
    if (output->descriptor < 0) return;
    close(output->descriptor);
    if (!output->spooled) unlink(output->temporary);
    output->descriptor = -1;
}
