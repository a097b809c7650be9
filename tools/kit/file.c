/* tools/kit/file.c: see file.h. */
#define _GNU_SOURCE
#include "tools/kit/file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

bool tool_ends(const char *path, const char *ending) {
    size_t length = strlen(path), wanted = strlen(ending);
    return length > wanted + 1 && path[length - wanted - 1] == '.' &&
           !strcasecmp(path + length - wanted, ending);
}

bool tool_is_mesh_name(const char *path) {
    static const char *const endings[] = {"ply", "obj", "off", "stl", "om", "glb", NULL};
    for (int i = 0; endings[i]; ++i)
        if (tool_ends(path, endings[i])) return true;
    return false;
}

bool tool_is_scene_name(const char *path) {
    return tool_ends(path, "json") || tool_ends(path, "gltf");
}

bool tool_is_folder(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

void tool_stem(const char *path, char *stem, size_t size) {
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    int length = dot && dot > name ? (int)(dot - name) : (int)strlen(name);
    snprintf(stem, size, "%.*s", length, name);
}

static int fail_write(tool *t, const char *path, int error) {
    return tool_fail(t, TOOL_OUTPUT, "%s: cannot be written: %s", path, strerror(error));
}

/* Creates a file beside `path`; *temporary receives its name, which the caller frees. Returns -1 and sets
 * errno on failure. */
static int open_beside(const char *path, char **temporary) {
    size_t size = strlen(path) + 16;
    *temporary = malloc(size);
    if (!*temporary) return -1;
    snprintf(*temporary, size, "%s.XXXXXX", path);
    int descriptor = mkostemp(*temporary, O_CLOEXEC);
    if (descriptor < 0) {
        int error = errno;
        free(*temporary);
        *temporary = NULL;
        errno = error;
    }
    return descriptor;
}

int tool_check_output(tool *t, const char *path) {
    if (!strcmp(path, "-")) return TOOL_DONE;
    struct stat status;
    bool exists = stat(path, &status) == 0;
    if (exists && S_ISDIR(status.st_mode)) return fail_write(t, path, EISDIR);
    if (exists && access(path, W_OK)) return fail_write(t, path, errno);
    if (exists && !S_ISREG(status.st_mode)) return TOOL_DONE;
    if (path[strlen(path) - 1] == '/') return fail_write(t, path, EISDIR);
    char *temporary;
    int descriptor = open_beside(path, &temporary);
    if (descriptor < 0) return fail_write(t, path, errno);
    close(descriptor);
    unlink(temporary);
    free(temporary);
    return TOOL_DONE;
}

int tool_check_folder(tool *t, const char *path) {
    if (mkdir(path, 0777) && errno != EEXIST) return fail_write(t, path, errno);
    if (!tool_is_folder(path)) return fail_write(t, path, ENOTDIR);
    char probe[PATH_MAX];
    if ((size_t)snprintf(probe, sizeof probe, "%s/probe", path) >= sizeof probe)
        return fail_write(t, path, ENAMETOOLONG);
    char *temporary;
    int descriptor = open_beside(probe, &temporary);
    if (descriptor < 0) return fail_write(t, path, errno);
    close(descriptor);
    unlink(temporary);
    free(temporary);
    return TOOL_DONE;
}

int tool_writer_open(tool *t, const char *path, tool_writer *writer) {
    *writer = (tool_writer){.path = path};
    if (!strcmp(path, "-")) {
        writer->stream = stdout;
        return TOOL_DONE;
    }
    struct stat status;
    bool exists = stat(path, &status) == 0;
    int descriptor = exists && !S_ISREG(status.st_mode) ? open(path, O_WRONLY | O_CLOEXEC)
                                                        : open_beside(path, &writer->temporary);
    if (descriptor < 0) return fail_write(t, path, errno);
    if (writer->temporary) {
        mode_t mask = umask(0);
        umask(mask);
        (void)!fchmod(descriptor, exists ? status.st_mode & 07777 : 0666 & ~mask);
    }
    writer->stream = fdopen(descriptor, "w");
    if (writer->stream) return TOOL_DONE;
    int error = errno;
    close(descriptor);
    if (writer->temporary) unlink(writer->temporary);
    free(writer->temporary);
    return fail_write(t, path, error);
}

int tool_writer_close(tool *t, tool_writer *writer, int code) {
    bool keep = code == TOOL_DONE || code == TOOL_NO;
    errno = 0;
    bool failed = fflush(writer->stream) || ferror(writer->stream);
    if (writer->temporary && keep && !failed && fsync(fileno(writer->stream))) failed = true;
    int error = errno;
    if (writer->stream != stdout && fclose(writer->stream) && !failed) failed = true, error = errno;
    if (!failed && keep && writer->temporary && rename(writer->temporary, writer->path))
        failed = true, error = errno;
    if (writer->temporary && (failed || !keep)) unlink(writer->temporary);
    const char *path = writer->path;
    free(writer->temporary);
    *writer = (tool_writer){0};
    return failed && keep ? fail_write(t, path, error ? error : EIO) : code;
}

int tool_hash_file(tool *t, const char *path, uint64_t *hash) {
    enum { CHUNK = 1 << 18 };
    int code = TOOL_DONE;
    FILE *file = fopen(path, "rbe");
    XXH3_state_t *state = XXH3_createState();
    char *buffer = malloc(CHUNK);
    if (!file) {
        code = tool_fail(t, TOOL_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    } else if (!state || !buffer) {
        code = tool_fail(t, TOOL_MEMORY, "%s: out of memory", path);
    } else {
        XXH3_64bits_reset(state);
        for (size_t got; (got = fread(buffer, 1, CHUNK, file)) > 0;) XXH3_64bits_update(state, buffer, got);
        if (ferror(file)) code = tool_fail(t, TOOL_INPUT, "%s: cannot be read: %s", path, strerror(errno));
        *hash = XXH3_64bits_digest(state);
    }
    free(buffer);
    XXH3_freeState(state);
    if (file) fclose(file);
    return code;
}
