/* tools/make/sheet.c: writes a sheet to a PLY file row by row, so that the disk limits its size and not the
 * memory. The bytes are those that fct_mesh_save would write. */
#include "tools/make/parts.h"

#include <string.h>

#include "tools/kit/file.h"

enum { BUFFER = 1 << 18, RECORD = 13 };

typedef struct sheet_writer {
    tool *t;
    FILE *stream;
    unsigned char *buffer;
    size_t used;
} sheet_writer;

static void put_bytes(sheet_writer *w, const void *data, size_t size) {
    if (w->used + size > BUFFER) {
        fwrite(w->buffer, 1, w->used, w->stream);
        w->used = 0;
    }
    memcpy(w->buffer + w->used, data, size);
    w->used += size;
}

static void put_word(unsigned char *p, uint32_t x) {
    for (int i = 0; i < 4; ++i) p[i] = (unsigned char)(x >> 8 * i);
}

static void put_vertex(sheet_writer *w, make_point p) {
    float values[3] = {(float)p.x, (float)p.y, (float)p.z};
    unsigned char bytes[12];
    for (int i = 0; i < 3; ++i) {
        uint32_t bits;
        memcpy(&bits, values + i, sizeof bits);
        put_word(bytes + 4 * i, bits);
    }
    put_bytes(w, bytes, sizeof bytes);
}

static void put_triangle(sheet_writer *w, uint32_t a, uint32_t b, uint32_t c, bool inside) {
    unsigned char bytes[RECORD] = {3};
    put_word(bytes + 1, a);
    put_word(bytes + 5, inside ? c : b);
    put_word(bytes + 9, inside ? b : c);
    put_bytes(w, bytes, sizeof bytes);
}

/* False if the user cancelled. */
static bool put_rows(sheet_writer *w, uint32_t n, make_height *height, bool inside) {
    const fct_env *env = &w->t->env;
    for (uint32_t j = 0; j <= n; ++j) {
        for (uint32_t i = 0; i <= n; ++i) put_vertex(w, make_sheet_vertex(n, i, j, height, w->t->seed));
        if (!env->progress(env->progress_user, "write", .5 * j / (n + 1.))) return false;
    }
    for (uint32_t j = 0; j < n; ++j) {
        for (uint32_t i = 0; i < n; ++i) {
            uint32_t a = j * (n + 1) + i, b = a + n + 1, c = b + 1, d = a + 1;
            put_triangle(w, a, b, c, inside);
            put_triangle(w, a, c, d, inside);
        }
        if (!env->progress(env->progress_user, "write", .5 + .5 * j / n)) return false;
    }
    return env->progress(env->progress_user, "write", 1);
}

int make_sheet_file(tool *t, const char *path, uint32_t n, make_height *height, bool inside) {
    tool_writer file;
    sheet_writer w = {.t = t, .buffer = tool_allocate(t, BUFFER, 1)};
    if (!w.buffer) return TOOL_MEMORY;
    int code = tool_writer_open(t, path, &file);
    if (code == TOOL_DONE) {
        w.stream = file.stream;
        fprintf(w.stream,
                "ply\nformat binary_little_endian 1.0\ncomment Facetree %s\nelement vertex %u\n"
                "property float x\nproperty float y\nproperty float z\nelement face %u\n"
                "property list uchar int vertex_indices\nend_header\n",
                fct_version(), (n + 1) * (n + 1), 2 * n * n);
        if (!put_rows(&w, n, height, inside)) code = tool_fail(t, TOOL_CANCELLED, "cancelled");
        fwrite(w.buffer, 1, w.used, w.stream);
        code = tool_writer_close(t, &file, code);
    }
    tool_release(t, w.buffer);
    return code;
}
