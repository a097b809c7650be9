/* tools/kit/file.c: see file.h. */
#define _GNU_SOURCE
#include "tools/kit/file.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "tools/guard/signals.h"

bool tool_ends(const char *path, const char *ending) {
    size_t length = strlen(path), wanted = strlen(ending);
    return length > wanted + 1 && path[length - wanted - 1] == '.' &&
           !strcasecmp(path + length - wanted, ending);
}

/* Whether `path` ends in one of the endings, which are separated by blanks. */
static bool ends_in_one(const char *path, const char *endings) {
    char ending[16];
    for (int used; sscanf(endings, "%15s%n", ending, &used) == 1; endings += used)
        if (tool_ends(path, ending)) return true;
    return false;
}

bool tool_is_mesh_name(const char *path) {
    return ends_in_one(path, TOOL_MESHES);
}

bool tool_has_format(const tool *t, const char *path, const char *format) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    if (dot && dot[1]) return tool_ends(path, format);
    return t->env.input_format && !strcasecmp(t->env.input_format, format);
}

bool tool_is_gltf(const tool *t, const char *path) {
    return tool_has_format(t, path, "glb") || tool_has_format(t, path, "gltf");
}

bool tool_is_scene(const tool *t, const char *path) {
    return tool_has_format(t, path, "json");
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

/* --- Kinds of files --- */

/* Endings of kinds of files. An output with one of them holds that kind. */
static const char kinds[] = "ply obj off stl om glb gltf fct fpm fst json png bin mtl "
                            "fbx dae 3ds usd usda usdc usdz blend step stp iges igs "
                            "jpg jpeg bmp gif tga tif tiff webp exr hdr ppm pgm svg pdf zip gz";

/* ".a, .b or .c". */
static void list_endings(const char *endings, char *text, size_t size) {
    char ending[16];
    const char *last = strrchr(endings, ' ');
    size_t length = 0;
    *text = 0;
    for (int used; length < size && sscanf(endings, "%15s%n", ending, &used) == 1; endings += used)
        length += (size_t)snprintf(text + length, size - length, "%s.%s",
                                   !length           ? ""
                                   : endings >= last ? " or "
                                                     : ", ",
                                   ending);
}

/* Whether the path is a pipe, a device or another thing that is neither a file nor a folder. */
static bool is_device(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}

bool tool_is_stream(const char *path) {
    return !strcmp(path, "-") || is_device(path);
}

int tool_check_kind(tool *t, const char *path, const char *endings, const char *other) {
    if (!strcmp(path, "-") || is_device(path) || ends_in_one(path, endings)) return TOOL_DONE;
    if (other && !ends_in_one(path, kinds)) return TOOL_DONE;
    char list[128];
    list_endings(endings, list, sizeof list);
    return tool_fail(t, TOOL_USAGE, "%s: expected a name that ends in %s%s%s", path, list,
                     other && *other ? ", or " : "", other ? other : "");
}

bool tool_is_unknown_kind(const char *path) {
    return strcmp(path, "-") != 0 && !is_device(path) && !ends_in_one(path, kinds);
}

/* --- Outputs --- */

bool tool_is_standard_output(const char *path) {
    struct stat named, standard;
    if (!strcmp(path, "-")) return true;
    if (strncmp(path, "/dev/", 5) != 0 && strncmp(path, "/proc/", 6) != 0) return false;
    return stat(path, &named) == 0 && fstat(STDOUT_FILENO, &standard) == 0 &&
           named.st_dev == standard.st_dev && named.st_ino == standard.st_ino &&
           (!S_ISCHR(named.st_mode) || isatty(STDOUT_FILENO));
}

/* The folder of the file, by device and inode. */
static bool stat_folder(const char *path, struct stat *status) {
    char folder[PATH_MAX];
    const char *slash = strrchr(path, '/');
    int length = slash == path ? 1 : slash ? (int)(slash - path) : 0;
    return snprintf(folder, sizeof folder, "%.*s", length ? length : 1, length ? path : ".") < PATH_MAX &&
           stat(folder, status) == 0;
}

static bool is_same_inode(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

bool tool_same_output(const char *a, const char *b) {
    struct stat first, second;
    if (!strcmp(a, "-") || !strcmp(b, "-")) return !strcmp(a, b);
    bool exist[2] = {stat(a, &first) == 0, stat(b, &second) == 0};
    if (exist[0] != exist[1]) return false;
    if (exist[0]) return S_ISREG(first.st_mode) && is_same_inode(&first, &second);
    const char *names[2] = {strrchr(a, '/'), strrchr(b, '/')};
    return !strcmp(names[0] ? names[0] + 1 : a, names[1] ? names[1] + 1 : b) && stat_folder(a, &first) &&
           stat_folder(b, &second) && is_same_inode(&first, &second);
}

int tool_check_output(tool *t, const char *path) {
    int code = tool_refuse_input(t, path);
    if (code != TOOL_DONE || !strcmp(path, "-")) return code;
    guard_note_output(path);
    return tool_result(t, fct_output_check(&t->env, path));
}

int tool_check_folder(tool *t, const char *path) {
    char probe[PATH_MAX];
    if (mkdir(path, 0777) && errno != EEXIST)
        return tool_fail(t, TOOL_OUTPUT, "%s: cannot be written: %s", path, strerror(errno));
    if ((size_t)snprintf(probe, sizeof probe, "%s/.probe", path) >= sizeof probe)
        return tool_fail(t, TOOL_OUTPUT, "%s: cannot be written: %s", path, strerror(ENAMETOOLONG));
    return tool_check_output(t, probe);
}

int tool_writer_open(tool *t, const char *path, tool_writer *writer) {
    *writer = (tool_writer){0};
    int code = tool_refuse_input(t, path);
    if (code == TOOL_DONE) code = tool_check_inputs(t);
    if (code == TOOL_DONE) code = tool_result(t, fct_writer_open(&t->env, path, &writer->file));
    if (code == TOOL_DONE) writer->stream = fct_writer_stream(writer->file);
    return code;
}

int tool_writer_close(tool *t, tool_writer *writer, int code) {
    bool keep = code == TOOL_DONE || code == TOOL_NO;
    if (keep && tool_check_inputs(t) != TOOL_DONE) keep = false, code = TOOL_INPUT; /* mapped until here */
    fct_result result = fct_writer_close(writer->file, keep);
    *writer = (tool_writer){0};
    t->wrote |= keep && result == FCT_OK;
    return keep && result != FCT_OK ? tool_result(t, result) : code;
}

/* Reads by blocks, because a mapped file counts as memory of the program. */
int tool_hash_file(tool *t, const char *path, uint64_t *hash) {
    enum { CHUNK = 1 << 18 };
    int code = TOOL_DONE;
    if (tool_is_gltf(t, path)) return tool_result(t, fct_mesh_file_hash(&t->env, path, hash));
    FILE *file = fopen(path, "rbe");
    if (file) code = tool_note_input(t, path);
    XXH3_state_t *state = XXH3_createState();
    char *buffer = malloc(CHUNK);
    if (!file) {
        code = tool_fail(t, TOOL_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    } else if (code == TOOL_DONE && (!state || !buffer)) {
        code = tool_fail(t, TOOL_MEMORY, "%s: out of memory", path);
    } else if (code == TOOL_DONE) {
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
