/* simplify/handle/file.c: state files (docs/state-file.md): a head, the sorted input, the live state
 * (live.c), and a checksum of all of it.
 *
 * A reader makes points, wedges and rings of the input anew, as fct_simplifier_create does. It then replaces
 * what the contractions have changed. So numbers that a damaged file could hold are few, and each is checked.
 */
#include "simplify/handle/file.h"

#include "base/io/file.h"
#include "base/io/output.h"
#include "mesh/mesh.h"
#include "simplify/handle/handle.h"
#include "simplify/handle/live.h"
#include "simplify/options.h"
#include "simplify/simplifier.h"

#define ORDER_MARK 0x01020304u

enum { VERSION = 2 };

enum {
    HAS_COLORS = 1,
    HAS_NORMALS = 2,
    HAS_TEXCOORDS = 4,
    HAS_FACE_COLORS = 8,
    HAS_MATERIALS = 16,
    HAS_SOURCES = 32,
    HAS_NAMES = 64,
    HAS_LOCKS = 128,
    HAS_IRRADIANCE = 256,
    HAS_DIRECT = 512,
    HAS_INDIRECT = 1024,
    HAS_ERROR = 2048,
};

enum { LOCK_BORDER = 1, KEEP_TOPOLOGY = 2, CHECK_FOLDOVER = 4, CONTRACT_FACES = 8 };

typedef struct file_head {
    unsigned char magic[8];
    uint32_t version, order_mark;
    uint32_t vertex_count, face_count, flags, material_count, source_count, names_size;
    uint32_t target_faces, placement, weighting, refit_passes, switches, copy_count;
    double max_error, color_weight, texcoord_weight, normal_weight, boundary_weight, feature_threshold,
        regularization;
    double origin[3];
} file_head;
_Static_assert(sizeof(file_head) == 144, "no gaps");
_Static_assert(sizeof(fct_simplify_def) == 112, "the head holds all options but pair_distance, which is 0");

static const unsigned char magic[8] = {0x89, 'F', 'S', 'T', '\r', '\n', 0x1a, '\n'};

/* An array of the sorted mesh or of the handle. */
typedef struct file_array {
    void *data;
    size_t count, size;
} file_array;

enum { ARRAYS = 16 };

/* All arrays in their order; those that are absent have the pointer NULL. */
static void list_arrays(const fct_sorted *sorted, file_array out[ARRAYS]) {
    const fct_mesh *m = &sorted->mesh;
    size_t v = m->vertex_count, f = m->face_count, inputs = sorted_inputs(sorted);
    const file_array all[ARRAYS] = {{sorted->places, f, 4}, {sorted->vertex_places, inputs, 4},
                                    {m->triangles, f, 12},  {m->positions, v, 12},
                                    {m->colors, v, 12},     {m->normals, v, 12},
                                    {m->texcoords, f, 24},  {m->face_colors, f, 12},
                                    {m->materials, f, 4},   {m->source_faces, f, 4},
                                    {sorted->locks, v, 1},  {sorted->copies, sorted->copy_count, 4},
                                    {m->irradiance, v, 12}, {m->direct, v, 12},
                                    {m->indirect, v, 12},   {m->error, v, 4}};
    memcpy(out, all, sizeof all);
}

/* ---- Writing ---- */

static void fill_options(const fct_simplify_def *def, file_head *head) {
    head->target_faces = def->target_faces;
    head->placement = (uint32_t)def->placement, head->weighting = (uint32_t)def->weighting;
    head->refit_passes = def->refit_passes;
    head->switches = (def->lock_border ? LOCK_BORDER : 0) | (def->keep_topology ? KEEP_TOPOLOGY : 0) |
                     (def->check_foldover ? CHECK_FOLDOVER : 0) |
                     (def->primitive == FCT_PRIMITIVE_FACE ? CONTRACT_FACES : 0);
    head->max_error = def->max_error;
    head->color_weight = def->color_weight, head->texcoord_weight = def->texcoord_weight;
    head->normal_weight = def->normal_weight, head->boundary_weight = def->boundary_weight;
    head->feature_threshold = def->feature_threshold, head->regularization = def->regularization;
}

static fct_result write_head(const fct_simplifier *s, fct_sink *sink) {
    const fct_mesh *m = s->mesh;
    file_head head = {.version = VERSION,
                      .order_mark = ORDER_MARK,
                      .vertex_count = m->vertex_count,
                      .copy_count = s->sorted.copy_count,
                      .face_count = m->face_count,
                      .material_count = m->material_count,
                      .source_count = m->source_count};
    memcpy(head.magic, magic, sizeof magic);
    memcpy(head.origin, m->origin, sizeof head.origin);
    fill_options(&s->given, &head);
    head.flags = (m->colors ? HAS_COLORS : 0) | (m->normals ? HAS_NORMALS : 0) |
                 (m->texcoords ? HAS_TEXCOORDS : 0) | (m->face_colors ? HAS_FACE_COLORS : 0) |
                 (m->materials ? HAS_MATERIALS : 0) | (m->source_faces ? HAS_SOURCES : 0) |
                 (m->material_names ? HAS_NAMES : 0) | (s->sorted.locks ? HAS_LOCKS : 0) |
                 (m->irradiance ? HAS_IRRADIANCE : 0) | (m->direct ? HAS_DIRECT : 0) |
                 (m->indirect ? HAS_INDIRECT : 0) | (m->error ? HAS_ERROR : 0);
    size_t size = 0;
    for (uint32_t i = 0; m->material_names && i < m->material_count; ++i)
        size += strlen(m->material_names[i]) + 1;
    if (size > UINT32_MAX) return fct_fail_memory(s->env, "material names");
    head.names_size = (uint32_t)size;
    fct_sink_put(sink, &head, sizeof head);
    for (uint32_t i = 0; m->material_names && i < m->material_count; ++i)
        fct_sink_put(sink, m->material_names[i], strlen(m->material_names[i]) + 1);
    return FCT_OK;
}

static fct_result write_file(void *user, FILE *stream) {
    fct_simplifier *s = user;
    fct_sink sink = {.env = s->env, .file = stream};
    sink.hash = fct_allocate(s->env, 1, sizeof *sink.hash);
    if (!sink.hash) return fct_fail_memory(s->env, "a checksum");
    XXH3_64bits_reset(sink.hash);
    fct_result result = write_head(s, &sink);
    file_array arrays[ARRAYS];
    list_arrays(&s->sorted, arrays);
    for (size_t i = 0; i < ARRAYS && result == FCT_OK; ++i)
        if (arrays[i].data) fct_sink_put(&sink, arrays[i].data, arrays[i].count * arrays[i].size);
    if (result == FCT_OK) result = fct_live_write(s, &sink);
    uint64_t checksum = XXH3_64bits_digest(sink.hash);
    fwrite(&checksum, sizeof checksum, 1, stream);
    fct_release(s->env, sink.hash);
    return result;
}

fct_result fct_simplifier_save(fct_simplifier *s, const char *path) {
    return fct_file_write_atomic(s->env, path, write_file, s);
}

/* ---- Reading ---- */

typedef struct reader {
    const fct_env *env;
    const char *name;
    file_head head;
    const char *names; /* of the materials, each with its zero byte */
    fct_source source; /* what follows them */
} reader;

static fct_result fail_read(const reader *r, const char *fault) {
    return fct_fail(r->env, FCT_ERROR_DATA, "%s: %s", r->name, fault);
}

static fct_result read_head(reader *r, const unsigned char *data, size_t size) {
    uint64_t checksum;
    if (size < sizeof magic || memcmp(data, magic, sizeof magic))
        return fail_read(r, "no state of a simplification: it does not begin with its mark");
    if (size < sizeof r->head + sizeof checksum) return fail_read(r, "truncated in the head");
    memcpy(&r->head, data, sizeof r->head);
    if (r->head.order_mark != ORDER_MARK) return fail_read(r, "written with another byte order, or damaged");
    if (r->head.version != VERSION) return fail_read(r, "another version of the format");
    memcpy(&checksum, data + size - sizeof checksum, sizeof checksum);
    if (checksum != XXH3_64bits(data, size - sizeof checksum))
        return fail_read(r, "truncated or damaged: wrong checksum");
    r->source = (fct_source){data + sizeof r->head, data + size - sizeof checksum};
    const file_head *h = &r->head;
    if (h->flags >= 2 * HAS_ERROR || h->switches >= 2 * CONTRACT_FACES || h->face_count >= INT32_MAX ||
        h->vertex_count >= INT32_MAX || h->material_count >= INT32_MAX || h->copy_count > h->vertex_count)
        return fail_read(r, "counts or flags out of range");
    bool named = h->flags & HAS_NAMES;
    if (h->names_size > (size_t)(r->source.end - r->source.at) ||
        (named && h->material_count > h->names_size) || (!named && h->names_size > 0))
        return fail_read(r, "the names of materials are missing");
    r->names = (const char *)r->source.at;
    r->source.at += h->names_size;
    for (int i = 0; i < 3; ++i)
        if (!(fabs(h->origin[i]) <= DBL_MAX)) return fail_read(r, "the origin is not finite");
    return FCT_OK;
}

static fct_simplify_def find_options(const file_head *head) {
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = head->target_faces, def.max_error = head->max_error;
    def.placement = (fct_placement)head->placement, def.weighting = (fct_weighting)head->weighting;
    def.color_weight = head->color_weight, def.texcoord_weight = head->texcoord_weight;
    def.normal_weight = head->normal_weight, def.boundary_weight = head->boundary_weight;
    def.feature_threshold = head->feature_threshold, def.regularization = head->regularization;
    def.refit_passes = head->refit_passes;
    def.lock_border = head->switches & LOCK_BORDER, def.keep_topology = head->switches & KEEP_TOPOLOGY;
    def.check_foldover = head->switches & CHECK_FOLDOVER;
    def.primitive = head->switches & CONTRACT_FACES ? FCT_PRIMITIVE_FACE : FCT_PRIMITIVE_EDGE;
    return def;
}

static fct_result read_names(reader *r, fct_mesh *mesh) {
    mesh->material_count = r->head.material_count;
    if (!(r->head.flags & HAS_NAMES)) return FCT_OK;
    const char *text = r->names, *end = text + r->head.names_size;
    mesh->material_names = fct_allocate_zero(r->env, r->head.material_count, sizeof *mesh->material_names);
    if (!mesh->material_names) return fct_fail_memory(r->env, "material names");
    for (uint32_t i = 0; i < r->head.material_count; ++i) {
        const char *nul = memchr(text, 0, (size_t)(end - text));
        if (!nul) return fail_read(r, "the names of materials are missing");
        size_t length = (size_t)(nul - text) + 1;
        mesh->material_names[i] = fct_allocate(r->env, length, 1);
        if (!mesh->material_names[i]) return fct_fail_memory(r->env, "material names");
        memcpy(mesh->material_names[i], text, length);
        text = nul + 1;
    }
    return text == end ? FCT_OK : fail_read(r, "something follows the names of materials");
}

/* Whether the file has room for the arrays, before they are allocated. */
static bool has_arrays(const reader *r) {
    const file_head *h = &r->head;
    uint64_t face = 16, vertex = 16;
    vertex += h->flags & HAS_COLORS ? 12 : 0, vertex += h->flags & HAS_NORMALS ? 12 : 0;
    for (uint32_t light = HAS_IRRADIANCE; light <= HAS_ERROR; light *= 2)
        vertex += !(h->flags & light) ? 0 : light == HAS_ERROR ? 4 : 12;
    vertex += h->flags & HAS_LOCKS ? 1 : 0, face += h->flags & HAS_TEXCOORDS ? 24 : 0;
    face += h->flags & HAS_FACE_COLORS ? 12 : 0, face += h->flags & HAS_MATERIALS ? 4 : 0;
    face += h->flags & HAS_SOURCES ? 4 : 0;
    return face * h->face_count + vertex * h->vertex_count <= (uint64_t)(r->source.end - r->source.at);
}

/* Whether each face or vertex of the input has a place of its own. */
static fct_result check_places(reader *r, const uint32_t *places, uint32_t count) {
    bool *met = fct_allocate_zero(r->env, count, sizeof *met), good = true;
    if (!met) return fct_fail_memory(r->env, "places of faces");
    for (uint32_t i = 0; i < count && good; ++i) {
        good = places[i] < count && !met[places[i]];
        if (good) met[places[i]] = true;
    }
    fct_release(r->env, met);
    return good ? FCT_OK : fail_read(r, "two faces or vertices have one place");
}

/* Whether each copy lies at an earlier vertex of the input, and has a face. */
static fct_result check_copies(reader *r, const fct_sorted *sorted) {
    const fct_mesh *mesh = &sorted->mesh;
    uint32_t inputs = sorted_inputs(sorted);
    bool *met = fct_allocate_zero(r->env, mesh->vertex_count, sizeof *met), good = true;
    if (!met) return fct_fail_memory(r->env, "split vertices");
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c)
        if (mesh->triangles[c] < mesh->vertex_count) met[mesh->triangles[c]] = true;
    for (uint32_t i = 0; i < sorted->copy_count && good; ++i) {
        uint32_t from = sorted->copies[i];
        good = from < inputs && (i == 0 || sorted->copies[i - 1] <= from) && met[from] && met[inputs + i] &&
               !memcmp(mesh->positions + 3 * (size_t)from, mesh->positions + 3 * (size_t)(inputs + i),
                       3 * sizeof(float));
    }
    fct_release(r->env, met);
    return good ? FCT_OK : fail_read(r, "a vertex was split from none");
}

static fct_result read_input(reader *r, fct_simplifier *s) {
    const file_head *h = &r->head;
    fct_mesh *mesh = &s->sorted.mesh;
    if (!has_arrays(r)) return fail_read(r, "truncated in the input");
    unsigned kinds =
        (h->flags & HAS_COLORS ? FCT_MESH_COLORS : 0) | (h->flags & HAS_NORMALS ? FCT_MESH_NORMALS : 0) |
        (h->flags & HAS_TEXCOORDS ? FCT_MESH_TEXCOORDS : 0) |
        (h->flags & HAS_FACE_COLORS ? FCT_MESH_FACE_COLORS : 0) |
        (h->flags & HAS_MATERIALS ? FCT_MESH_MATERIALS : 0) |
        (h->flags & HAS_SOURCES ? FCT_MESH_SOURCE_FACES : 0) |
        (h->flags & HAS_IRRADIANCE ? FCT_MESH_IRRADIANCE : 0) |
        (h->flags & HAS_DIRECT ? FCT_MESH_DIRECT : 0) | (h->flags & HAS_INDIRECT ? FCT_MESH_INDIRECT : 0) |
        (h->flags & HAS_ERROR ? FCT_MESH_ERROR : 0);
    fct_result result = fct_mesh_create(s->env, h->vertex_count, h->face_count, kinds, mesh);
    const fct_array own[] = {FCT_ARRAY(s->sorted.places, h->face_count),
                             FCT_ARRAY(s->sorted.vertex_places, h->vertex_count - h->copy_count),
                             FCT_ARRAY_IF(h->flags & HAS_LOCKS, s->sorted.locks, h->vertex_count),
                             FCT_ARRAY_IF(h->copy_count > 0, s->sorted.copies, h->copy_count)};
    if (result == FCT_OK) result = fct_allocate_all(s->env, own, FCT_LENGTH(own), "a state");
    if (result != FCT_OK) return result;
    s->sorted.copy_count = h->copy_count;
    memcpy(mesh->origin, h->origin, sizeof mesh->origin);
    mesh->source_count = h->source_count;
    result = read_names(r, mesh);
    if (result != FCT_OK) return result;
    file_array list[ARRAYS];
    list_arrays(&s->sorted, list);
    for (size_t i = 0; i < ARRAYS; ++i)
        if (list[i].data && !fct_source_take(&r->source, list[i].data, list[i].count, list[i].size))
            return fail_read(r, "truncated in the input");
    result = check_places(r, s->sorted.places, h->face_count);
    if (result == FCT_OK) result = check_places(r, s->sorted.vertex_places, sorted_inputs(&s->sorted));
    return result == FCT_OK ? check_copies(r, &s->sorted) : result;
}

static fct_result read_state(reader *r, fct_simplifier *s) {
    const char *fault = NULL;
    fct_result result = read_input(r, s);
    if (result == FCT_OK) result = fct_simplify_check(s->env, &s->sorted.mesh, &s->given);
    s->own.locks = s->sorted.locks;
    if (result == FCT_OK) result = fct_simplifier_fill(s);
    if (result == FCT_OK) result = fct_live_read(s, &r->source, NULL, &fault);
    if (fault) return fail_read(r, fault);
    if (result == FCT_OK && r->source.at < r->source.end) return fail_read(r, "something is appended");
    return result;
}

fct_result fct_state_read(const fct_env *env, const char *name, const unsigned char *data, size_t size,
                          fct_simplifier **out) {
    *out = NULL;
    reader r = {.env = env, .name = name};
    fct_simplifier *s;
    fct_result result = read_head(&r, data, size);
    if (result != FCT_OK) return result;
    fct_simplify_def def = find_options(&r.head);
    result = fct_handle_open(env, &def, &s);
    if (result != FCT_OK) return result;
    result = read_state(&r, s);
    if (result == FCT_OK)
        *out = s;
    else
        fct_simplifier_destroy(s);
    return result;
}

fct_result fct_simplifier_load(const fct_env *env, const char *path, fct_simplifier **out) {
    *out = NULL;
    fct_file file;
    fct_result result = fct_file_open(env, path, &file);
    if (result != FCT_OK) return result;
    const char *name = !strcmp(path, "-") ? "standard input" : path;
    result = fct_state_read(env, name, file.data, file.size, out);
    fct_file_close(env, &file);
    return result;
}
