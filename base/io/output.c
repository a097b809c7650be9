/* base/io/output.c: see output.h. */
#define _GNU_SOURCE
#include "base/io/output.h"
#include "base/io/temporary.h"

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
    fct_result result = error == ENOMEM ? FCT_ERROR_MEMORY : FCT_ERROR_OUTPUT;
    return fct_fail(env, result, "%s: cannot be written: %s", path,
                    error ? strerror(error) : "the stream failed");
}

/* A nameless file, for a target that is a pipe or a device. */
static int create_spool(void) {
    const char *folder = getenv("TMPDIR");
    char name[PATH_MAX];
    if (!folder || !*folder) folder = "/tmp";
    fct_temporary_sweep(folder); /* a process that was killed before its unlink */
    int descriptor = fct_temporary_open(folder, name, sizeof name);
    if (descriptor >= 0 && *name) unlink(name);
    return descriptor;
}

/* Follows symbolic links to the file that `path` means, which need not exist. Returns 0 or an errno. */
static int follow_links(const char *path, char target[PATH_MAX]) {
    enum { MOST_LINKS = 40 };
    char link[PATH_MAX], folder[PATH_MAX];
    if ((size_t)snprintf(target, PATH_MAX, "%s", path) >= PATH_MAX) return ENAMETOOLONG;
    for (int i = 0; i < MOST_LINKS; ++i) {
        ssize_t length = readlink(target, link, sizeof link - 1);
        if (length < 0) return errno == EINVAL || errno == ENOENT ? 0 : errno;
        link[length] = 0;
        if (*link == '/')
            *folder = 0;
        else if (!fct_folder_of(target, folder, sizeof folder))
            return ENAMETOOLONG;
        if ((size_t)snprintf(target, PATH_MAX, "%s%s%s", folder, *folder ? "/" : "", link) >= PATH_MAX)
            return ENAMETOOLONG;
    }
    return ELOOP;
}

/* Writes the folder to the disk, because a rename is permanent only then. Some network file systems cannot
 * synchronise folders, so failures are ignored. */
static void synchronise_folder(const char *folder) {
    int descriptor = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    (void)!fsync(descriptor);
    close(descriptor);
}

/* Finds the target of `path`. Returns 0 or an errno. */
static int find_target(const char *path, fct_output *out) {
    struct stat status;
    bool standard = !strcmp(path, "-"), exists = !standard && stat(path, &status) == 0;
    int error = exists || standard ? 0 : errno;
    if ((size_t)snprintf(out->path, sizeof out->path, "%s", path) >= sizeof out->path) return ENAMETOOLONG;
    if (error && error != ENOENT) return error;
    if (exists && S_ISDIR(status.st_mode)) return EISDIR;
    if (exists && access(path, W_OK)) return errno;
    out->spooled = standard || (exists && !S_ISREG(status.st_mode));
    out->replaces = exists;
    out->mode = exists ? status.st_mode & 07777 : 0;
    if (out->spooled) return 0;
    error = follow_links(path, out->target);
    if (error) return error;
    const char *slash = strrchr(out->target, '/');
    if (slash && !slash[1]) return EISDIR;
    return fct_folder_of(out->target, out->folder, sizeof out->folder) ? 0 : ENAMETOOLONG;
}

/* Opens a file in the folder of the target, or a nameless one. */
static fct_result create_output(const fct_env *env, const char *path, fct_output *out) {
    *out = (fct_output){.env = env, .descriptor = -1};
    int error = find_target(path, out);
    if (error) return fct_output_fail(env, path, error);
    out->descriptor = out->spooled ? create_spool()
                                   : fct_temporary_open(out->folder, out->temporary, sizeof out->temporary);
    return out->descriptor < 0 ? fct_output_fail(env, path, errno) : FCT_OK;
}

fct_result fct_output_check(const fct_env *env, const char *path) {
    fct_output output = {.env = env, .descriptor = -1};
    int error = find_target(path, &output);
    if (error) return fct_output_fail(env, path, error);
    if (output.spooled) return FCT_OK;
    fct_temporary_sweep(output.folder);
    fct_result result = create_output(env, path, &output);
    if (result == FCT_OK) fct_output_abandon(&output);
    return result;
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

/* A nameless file takes a free target directly. It replaces an older file by a rename, which needs a name. */
static bool take_name(fct_output *output) {
    if (!*output->temporary) {
        if (!output->replaces && fct_temporary_link(output->descriptor, output->target) == 0) return true;
        if (!output->replaces && errno != EEXIST) return false;
        if (fct_temporary_link_any(output->descriptor, output->folder, output->temporary,
                                   sizeof output->temporary))
            return false;
    }
    return rename(output->temporary, output->target) == 0;
}

static fct_result store_output(fct_output *output) {
    if (output->replaces) (void)!fchmod(output->descriptor, output->mode);
    if (fsync(output->descriptor) || !take_name(output))
        return fct_output_fail(output->env, output->path, errno);
    synchronise_folder(output->folder);
    return FCT_OK;
}

fct_result fct_output_finish(fct_output *output) {
    fct_result result = output->spooled ? copy_spool(output) : store_output(output);
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
    if (*output->temporary) unlink(output->temporary);
    output->descriptor = -1;
}
