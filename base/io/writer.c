/* base/io/writer.c: fct_writer, a stream whose file appears when it is complete. */
#define _GNU_SOURCE
#include <errno.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/io/output.h"

struct fct_writer {
    const fct_env *env;
    FILE *stream;
    bool direct; /* standard output, a device or a pipe: there is no temporary file */
    fct_output output;
};

enum { BUFFER = 1 << 18 };

bool fct_output_is_device(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}

static fct_result open_beside(fct_writer *w, const char *path) {
    fct_result result = fct_output_open(w->env, path, 0, &w->output);
    if (result != FCT_OK) return result;
    int descriptor = dup(w->output.descriptor);
    w->stream = descriptor < 0 ? NULL : fdopen(descriptor, "wb");
    if (w->stream) {
        setvbuf(w->stream, NULL, _IOFBF, BUFFER);
        return FCT_OK;
    }
    result = fct_output_fail(w->env, path, errno);
    if (descriptor >= 0) close(descriptor);
    fct_output_abandon(&w->output);
    return result;
}

fct_result fct_writer_open(const fct_env *env, const char *path, fct_writer **out) {
    bool standard = !strcmp(path, "-");
    fct_result result = FCT_OK;
    fct_writer *w = *out = fct_allocate_zero(env, 1, sizeof *w);
    if (!w) return fct_fail_memory(env, "an output file");
    w->env = env;
    w->direct = standard || fct_output_is_device(path);
    if (w->direct) {
        snprintf(w->output.path, sizeof w->output.path, "%s", standard ? "standard output" : path);
        w->stream = standard ? stdout : fopen(path, "wbe");
        if (!w->stream) result = fct_output_fail(env, path, errno);
    } else {
        result = open_beside(w, path);
    }
    if (result == FCT_OK) return FCT_OK;
    fct_release(env, w);
    *out = NULL;
    return result;
}

FILE *fct_writer_stream(fct_writer *writer) {
    return writer->stream;
}

fct_result fct_writer_close(fct_writer *writer, bool keep) {
    if (!writer) return FCT_OK;
    const fct_env *env = writer->env;
    errno = 0;
    bool failed = fflush(writer->stream) || ferror(writer->stream);
    int error = errno;
    if (writer->stream != stdout && fclose(writer->stream) && !failed) failed = true, error = errno;
    fct_result result = failed && keep ? fct_output_fail(env, writer->output.path, error) : FCT_OK;
    if (!writer->direct && keep && !failed)
        result = fct_output_finish(&writer->output);
    else if (!writer->direct)
        fct_output_abandon(&writer->output);
    fct_release(env, writer);
    return result;
}

fct_result fct_file_write_atomic(const fct_env *env, const char *path,
                                 fct_result (*produce)(void *user, FILE *stream), void *user) {
    fct_writer *writer;
    fct_result result = fct_writer_open(env, path, &writer);
    if (result != FCT_OK) return result;
    result = produce(user, writer->stream);
    fct_result closed = fct_writer_close(writer, result == FCT_OK);
    return result == FCT_OK ? closed : result;
}
