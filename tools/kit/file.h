/* tools/kit/file.h: file names, checks of outputs before long work, and text files that appear only when
 * complete. */
#ifndef FCT_TOOLS_FILE_H
#define FCT_TOOLS_FILE_H

#include "tools/kit/env.h"

/* Whether `path` ends in `.ending`, in any case. */
bool tool_ends(const char *path, const char *ending);
/* Whether the name is that of a mesh that can be written. */
bool tool_is_mesh_name(const char *path);
/* Whether the input has the format "fct", "obj" or another, by its name or by --format. */
bool tool_has_format(const tool *t, const char *path, const char *format);
bool tool_is_gltf(const tool *t, const char *path);
/* Whether the input is a scene.json. A glTF file is a scene where materials matter, else a mesh. */
bool tool_is_scene(const tool *t, const char *path);
bool tool_is_folder(const char *path);
/* Whether an input can be read only once: standard input, a pipe or a device. */
bool tool_is_stream(const char *path);
/* The last part of a path without its ending. */
void tool_stem(const char *path, char *stem, size_t size);

/* Checks the kind of an output. endings: "ply obj": the accepted ones. other: NULL if the ending chooses the
 * format; else a name with an ending of no known kind is accepted too, and `other`, if not empty, ends the
 * message. Devices, pipes and "-" are accepted. Returns an exit code. */
int tool_check_kind(tool *t, const char *path, const char *endings, const char *other);
/* The endings of meshes, and of meshes with colours. */
#define TOOL_MESHES       "ply obj off stl om glb"
#define TOOL_COLOR_MESHES "ply obj off om glb"

/* Whether the path ends in no known kind of file, and is neither a device nor "-". */
bool tool_is_unknown_kind(const char *path);

/* Whether the path is standard output: "-", /dev/stdout and the like. */
bool tool_is_standard_output(const char *path);
/* Whether a file can be created at `path`, which may be "-", and whether it is no input. Returns an exit
 * code.
 */
int tool_check_output(tool *t, const char *path);
/* Whether two outputs are one file, by the folder and the name, or by the file if it exists. */
bool tool_same_output(const char *a, const char *b);
/* Creates the folder if it is missing, and checks that files can be created in it. Returns an exit code. */
int tool_check_folder(tool *t, const char *path);

/* A text file that appears at `path` when it is complete; "-" is stdout. */
typedef struct tool_writer {
    FILE *stream; /* NULL: not open */
    fct_writer *file;
} tool_writer;
int tool_writer_open(tool *t, const char *path, tool_writer *writer);
/* code: the outcome so far. Keeps the file for TOOL_DONE and TOOL_NO. Returns the outcome. */
int tool_writer_close(tool *t, tool_writer *writer, int code);

/* The value of fct_mesh_file_hash. Returns an exit code. */
int tool_hash_file(tool *t, const char *path, uint64_t *hash);

#endif
