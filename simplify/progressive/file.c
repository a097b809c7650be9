/* simplify/progressive/file.c: progressive mesh files (docs/progressive-file.md).
 *
 * A head, then blocks of steps, each with its own checksum: the base mesh, then splits. A reader decodes the
 * blocks in order, so the front of a file is enough for coarse levels.
 */
#include <inttypes.h>
#include <string.h>
#include <xxhash.h>

#include "base/io/file.h"
#include "base/io/output.h"
#include "simplify/progressive/splits.h"

#define ORDER_MARK 0x01020304u

enum {
    VERSION = 1,
    FIRST_BLOCK = 64,  /* splits of the first block after the base mesh; each further one has twice as many */
    MOST_BLOCK = 4096, /* splits of a block */
};

enum {
    HAS_COLORS = 1,
    HAS_NORMALS = 2,
    HAS_TEXCOORDS = 4,
    HAS_FACE_COLORS = 8,
    HAS_MATERIALS = 16,
    HAS_NAMES = 32,
    HAS_PAIRS = 64
};

typedef struct file_head {
    unsigned char magic[8];
    uint32_t version, order_mark;
    uint64_t checksum; /* of the head and the names, with 0 here */
    uint32_t names_size, flags;
    uint32_t face_count, base_faces, split_count, material_count;
    double origin[3];
} file_head;
_Static_assert(sizeof(file_head) == 72, "no gaps");

typedef struct file_block {
    uint32_t steps, size;
    uint64_t checksum; /* of the bytes that follow */
} file_block;
_Static_assert(sizeof(file_block) == 16, "no gaps");

static const unsigned char magic[8] = {0x89, 'F', 'P', 'M', '\r', '\n', 0x1a, '\n'};

/* The steps of a block that begins with `step`. */
static uint32_t find_block_steps(uint32_t step, uint32_t step_count, uint32_t before) {
    uint32_t steps = step == 0                 ? 1
                     : step == 1               ? FIRST_BLOCK
                     : 2 * before < MOST_BLOCK ? 2 * before
                                               : MOST_BLOCK;
    return steps < step_count - step ? steps : step_count - step;
}

static uint64_t hash_head(const file_head *head, const char *names) {
    file_head copy = *head;
    copy.checksum = 0;
    uint64_t parts[2] = {XXH3_64bits(&copy, sizeof copy), XXH3_64bits(names, head->names_size)};
    return XXH3_64bits(parts, sizeof parts);
}

/* ---- Writing ---- */

static fct_result write_head(const fct_progressive *m, FILE *stream) {
    file_head head = {.version = VERSION, .order_mark = ORDER_MARK, .face_count = m->face_count};
    memcpy(head.magic, magic, sizeof magic);
    head.base_faces = m->step_faces[1], head.split_count = m->step_count - 1;
    head.material_count = m->material_count;
    head.flags = (m->color != FCT_NONE ? HAS_COLORS : 0) | (m->normal != FCT_NONE ? HAS_NORMALS : 0) |
                 (m->texcoord != FCT_NONE ? HAS_TEXCOORDS : 0) | (m->face_colors ? HAS_FACE_COLORS : 0) |
                 (m->materials ? HAS_MATERIALS : 0) | (m->material_names ? HAS_NAMES : 0) |
                 (fct_splits_have_pairs(m) ? HAS_PAIRS : 0);
    memcpy(head.origin, m->origin, sizeof head.origin);
    size_t size = 0;
    for (uint32_t i = 0; m->material_names && i < m->material_count; ++i)
        size += strlen(m->material_names[i]) + 1;
    if (size > UINT32_MAX) return fct_fail_memory(m->env, "material names");
    char *names = fct_allocate(m->env, size, 1), *to = names;
    if (!names) return fct_fail_memory(m->env, "material names");
    head.names_size = (uint32_t)size;
    for (uint32_t i = 0; m->material_names && i < m->material_count; ++i) {
        size_t length = strlen(m->material_names[i]) + 1;
        memcpy(to, m->material_names[i], length);
        to += length;
    }
    head.checksum = hash_head(&head, names);
    fwrite(&head, sizeof head, 1, stream);
    fwrite(names, 1, size, stream);
    fct_release(m->env, names);
    return FCT_OK;
}

static fct_result write_blocks(fct_splits *k, FILE *stream) {
    const fct_progressive *m = k->m;
    uint32_t step = 0, steps = 0;
    while (step < m->step_count) {
        steps = find_block_steps(step, m->step_count, steps);
        fct_coder_begin_writing(&k->coder, m->env);
        for (uint32_t i = 0; i < steps; ++i) {
            fct_result result = fct_splits_step(k);
            if (result == FCT_ERROR_DATA)
                return fct_fail(m->env, result, "level %" PRIu32 " has values that a file cannot have",
                                k->step);
            if (result != FCT_OK) return result;
        }
        fct_result result = fct_coder_end_writing(&k->coder);
        if (result != FCT_OK) return result;
        if (k->coder.count > UINT32_MAX) return fct_fail_memory(m->env, "a block of a progressive mesh");
        file_block block = {steps, (uint32_t)k->coder.count, XXH3_64bits(k->coder.bytes, k->coder.count)};
        fwrite(&block, sizeof block, 1, stream);
        fwrite(k->coder.bytes, 1, k->coder.count, stream);
        step += steps;
        result = fct_progress(m->env, "write", (double)step / m->step_count);
        if (result != FCT_OK) return result;
    }
    return FCT_OK;
}

static fct_result write_file(void *user, FILE *stream) {
    fct_progressive *m = user;
    fct_splits *k;
    fct_result result = write_head(m, stream);
    if (result == FCT_OK) result = fct_splits_write(m, &k);
    if (result != FCT_OK) return result;
    result = write_blocks(k, stream);
    fct_splits_close(k);
    return result;
}

/* Writes to the path, or else to the stream, from the coarsest level on, and returns to the current one. */
static fct_result write_from_base(fct_progressive *m, const char *path, FILE *stream) {
    uint32_t level = m->level;
    while (m->level > 1) fct_progressive_backward(m);
    fct_result result = path ? fct_file_write_atomic(m->env, path, write_file, m) : write_file(m, stream);
    while (m->level > level) fct_progressive_backward(m);
    while (m->level < level) fct_progressive_forward(m);
    return result;
}

fct_result fct_progressive_write(fct_progressive *m, FILE *stream) {
    return write_from_base(m, NULL, stream);
}

fct_result fct_progressive_save(fct_progressive *m, const char *path) {
    return write_from_base(m, path, NULL);
}

/* ---- Reading ---- */

static const char *find_head_fault(const file_head *head, const unsigned char *data, size_t size) {
    if (head->order_mark != ORDER_MARK) return "written with another byte order, or damaged";
    if (head->version != VERSION) return "another version of the format";
    if (head->names_size > size - sizeof *head) return "truncated in the head";
    if (head->checksum != hash_head(head, (const char *)data + sizeof *head)) return "damaged head";
    if (head->face_count >= INT32_MAX || head->split_count >= INT32_MAX ||
        head->base_faces > head->face_count || head->flags >= 2 * HAS_PAIRS ||
        head->material_count >= INT32_MAX)
        return "counts or flags out of range";
    if ((head->flags & HAS_NAMES) && head->material_count > head->names_size) return "names are missing";
    if (!(head->flags & HAS_NAMES) && head->names_size > 0) return "names without materials";
    for (int i = 0; i < 3; ++i)
        if (!(head->origin[i] - head->origin[i] == 0)) return "the origin is not finite";
    return NULL;
}

static fct_result read_names(const fct_env *env, const char *name, const file_head *head, const char *text,
                             fct_progressive *m) {
    m->material_count = head->material_count;
    if (!(head->flags & HAS_NAMES)) return FCT_OK;
    m->material_names = fct_allocate_zero(env, head->material_count, sizeof *m->material_names);
    if (!m->material_names) return fct_fail_memory(env, "material names");
    const char *end = text + head->names_size;
    for (uint32_t i = 0; i < head->material_count; ++i) {
        const char *nul = memchr(text, 0, (size_t)(end - text));
        if (!nul) return fct_fail(env, FCT_ERROR_DATA, "%s: material name %" PRIu32 " is missing", name, i);
        size_t length = (size_t)(nul - text) + 1;
        m->material_names[i] = fct_allocate(env, length, 1);
        if (!m->material_names[i]) return fct_fail_memory(env, "material names");
        memcpy(m->material_names[i], text, length);
        text = nul + 1;
    }
    if (text != end) return fct_fail(env, FCT_ERROR_DATA, "%s: something follows the material names", name);
    return FCT_OK;
}

/* A file that is read. */
typedef struct file_reader {
    const fct_env *env;
    const char *name;
    file_head head;
    const unsigned char *at, *end;
    fct_splits *k;
    uint32_t block_number;
} file_reader;

static fct_result fail_block(const file_reader *r, const char *fault) {
    return fct_fail(r->env, FCT_ERROR_DATA, "%s: block %" PRIu32 ": %s", r->name, r->block_number, fault);
}

/* Reads one block. *truncated: the file ends before its end. */
static fct_result read_block(file_reader *r, uint32_t steps, bool *truncated) {
    file_block block;
    size_t left = (size_t)(r->end - r->at);
    *truncated = left < sizeof block;
    if (*truncated) return FCT_OK;
    memcpy(&block, r->at, sizeof block);
    if (block.steps != steps) return fail_block(r, "damaged: wrong number of splits");
    *truncated = left - sizeof block < block.size;
    if (*truncated) return FCT_OK;
    r->at += sizeof block;
    if (block.checksum != XXH3_64bits(r->at, block.size)) return fail_block(r, "damaged: wrong checksum");
    fct_coder_begin_reading(&r->k->coder, r->at, block.size);
    for (uint32_t i = 0; i < steps; ++i) {
        fct_result result = fct_splits_step(r->k);
        if (result == FCT_ERROR_DATA) return fail_block(r, "malformed");
        if (result != FCT_OK) return result;
        if (r->k->m->face_count > r->head.face_count) return fail_block(r, "more faces than the head says");
    }
    if (!fct_coder_end_reading(&r->k->coder)) return fail_block(r, "malformed: it has a wrong length");
    r->at += block.size;
    ++r->block_number;
    return FCT_OK;
}

static fct_result check_counts(const file_reader *r, bool truncated) {
    const fct_progressive *m = r->k->m;
    if (m->step_count == 0)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: truncated in the base mesh", r->name);
    if (m->step_faces[1] != r->head.base_faces)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: base mesh of %" PRIu32 " faces, expected %" PRIu32,
                        r->name, m->step_faces[1], r->head.base_faces);
    if (!truncated && m->face_count != r->head.face_count)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: %" PRIu32 " faces, expected %" PRIu32, r->name,
                        m->face_count, r->head.face_count);
    if (!truncated && r->at < r->end)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: something is appended", r->name);
    if (truncated)
        fct_note(r->env, FCT_MESSAGE_WARNING,
                 "%s: truncated: levels of up to %" PRIu32 " of %" PRIu32 " faces", r->name, m->face_count,
                 r->head.face_count);
    return FCT_OK;
}

static fct_result read_blocks(file_reader *r) {
    uint32_t steps = 0, step_count = r->head.split_count + 1;
    bool truncated = false;
    for (uint32_t step = 0; step < step_count && !truncated; step += steps) {
        steps = find_block_steps(step, step_count, steps);
        fct_result result = read_block(r, steps, &truncated);
        if (result == FCT_OK) result = fct_progress(r->env, "read", (double)step / step_count);
        if (result != FCT_OK) return result;
    }
    return check_counts(r, truncated);
}

static fct_result read_head(file_reader *r, fct_progressive *m) {
    size_t size = (size_t)(r->end - r->at);
    if (size < sizeof magic || memcmp(r->at, magic, sizeof magic))
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: no progressive mesh: it does not begin with its mark",
                        r->name);
    if (size < sizeof r->head) return fct_fail(r->env, FCT_ERROR_DATA, "%s: truncated in the head", r->name);
    memcpy(&r->head, r->at, sizeof r->head);
    const char *fault = find_head_fault(&r->head, r->at, size);
    if (fault) return fct_fail(r->env, FCT_ERROR_DATA, "%s: %s", r->name, fault);
    r->at += sizeof r->head;
    m->color = m->normal = m->texcoord = FCT_NONE;
    if (r->head.flags & HAS_COLORS) m->color = m->value_count, m->value_count += 3;
    if (r->head.flags & HAS_NORMALS) m->normal = m->value_count, m->value_count += 3;
    if (r->head.flags & HAS_TEXCOORDS) m->texcoord = m->value_count, m->value_count += 2;
    memcpy(m->origin, r->head.origin, sizeof m->origin);
    m->total_faces = r->head.face_count;
    fct_result result = read_names(r->env, r->name, &r->head, (const char *)r->at, m);
    r->at += r->head.names_size;
    return result;
}

static fct_result read_file(file_reader *r, fct_progressive *m) {
    fct_result result = read_head(r, m);
    if (result == FCT_OK)
        result = fct_splits_read(m, r->head.flags & HAS_MATERIALS, r->head.flags & HAS_FACE_COLORS,
                                 r->head.flags & HAS_PAIRS, &r->k);
    if (result == FCT_OK) result = read_blocks(r);
    if (r->k) m->point_count = r->k->point_count;
    fct_splits_close(r->k);
    return result == FCT_OK ? fct_progressive_begin(m) : result;
}

fct_result fct_progressive_read(const fct_env *env, const char *name, const unsigned char *data, size_t size,
                                fct_progressive **out) {
    *out = NULL;
    fct_progressive *m = fct_allocate_zero(env, 1, sizeof *m);
    if (!m) return fct_fail_memory(env, "a progressive mesh");
    m->env = env;
    file_reader r = {.env = env, .name = name, .at = data, .end = data + size};
    fct_result result = read_file(&r, m);
    if (result == FCT_OK)
        *out = m;
    else
        fct_progressive_destroy(m);
    return result;
}

fct_result fct_progressive_load(const fct_env *env, const char *path, fct_progressive **out) {
    *out = NULL;
    fct_file file;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    const char *name = !strcmp(path, "-") ? "standard input" : path;
    result = fct_progressive_read(env, name, file.data, file.size, out);
    fct_file_close(env, &file);
    return result;
}
