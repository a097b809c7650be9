/* Any mesh that the bytes describe, with any options: an error, or a simplified mesh that keeps the promises
 * of simplify.h, and a progressive mesh that keeps those of progressive.h. */
#define _GNU_SOURCE
#include <float.h>

#include "base/math/vec.h"
#include "fuzz/fuzz_bytes.h"
#include "simplify/progressive/progressive.h"

/* Rounding to floats may turn a face whose height is fewer steps between floats. */
#define COARSE 100
/* Lower faces count as faces without area, in multiples of the mesh's extent. */
#define LEAST_HEIGHT 1e-14

/* Between faces that may be folded, of the input, and that are folded beyond doubt, of the result: 32 and 11
 * degrees. Several small turns may bring faces below 26 degrees. */
#define EARLY_FOLD .85
#define LATE_FOLD  .98

static v3 corner_of(const fct_mesh *mesh, uint32_t face, uint32_t k) {
    return v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)face + k]);
}

static v3 cross_of(const fct_mesh *mesh, uint32_t face) {
    v3 a = corner_of(mesh, face, 0);
    return v3_cross(v3_sub(corner_of(mesh, face, 1), a), v3_sub(corner_of(mesh, face, 2), a));
}

static bool same_point(v3 a, v3 b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/* Defects that the simplifier does not add. */
typedef struct defects {
    bool flat, doubled, crowded, folded; /* no area; same corners; an edge of three faces; folded over */
    bool coarse;                         /* a face that rounding may turn */
} defects;

/* The step between floats at the largest coordinate. */
static double find_step(const fct_mesh *mesh) {
    double reach = 0;
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i)
        reach = fmax(reach, fabs((double)mesh->positions[i]));
    return fmax(reach * (double)FLT_EPSILON, (double)FLT_TRUE_MIN);
}

/* The longest side of the bounds. */
static double find_extent(const fct_mesh *mesh) {
    double extent = 0;
    for (size_t k = 0; k < 3; ++k) {
        double lower = INFINITY, upper = -INFINITY;
        for (size_t v = 0; v < mesh->vertex_count; ++v) {
            double x = (double)mesh->positions[3 * v + k];
            lower = fmin(lower, x), upper = fmax(upper, x);
        }
        extent = fmax(extent, upper - lower);
    }
    return extent;
}

/* Whether the face is lower than `height` over its longest side. */
static bool is_low(const fct_mesh *mesh, uint32_t f, double height) {
    double longest = 0;
    for (uint32_t k = 0; k < 3; ++k)
        longest = fmax(longest, v3_norm(v3_sub(corner_of(mesh, f, (k + 1) % 3), corner_of(mesh, f, k))));
    return v3_norm(cross_of(mesh, f)) <= height * longest;
}

/* How to look for defects. The input is judged strictly, because the promises hold for an input without them,
 * and the result mildly. */
typedef struct inspection {
    const fct_mesh *mesh;
    bool strict; /* equal places are one point; else only equal vertices are, because bodies may touch */
    double step, least; /* between floats; a face that is not higher has no area */
} inspection;

static bool meet(const inspection *i, uint32_t f, uint32_t k, uint32_t g, uint32_t l) {
    const uint32_t *t = i->mesh->triangles;
    return t[3 * (size_t)f + k] == t[3 * (size_t)g + l] ||
           (i->strict && same_point(corner_of(i->mesh, f, k), corner_of(i->mesh, g, l)));
}

/* The cosine of the angle between f and g at side k of f, where the corner `third` of g is opposite. */
static double find_fold(const fct_mesh *mesh, uint32_t f, uint32_t k, uint32_t g, uint32_t third) {
    v3 a = corner_of(mesh, f, k), along = v3_unit(v3_sub(corner_of(mesh, f, (k + 1) % 3), a)),
       p = v3_sub(corner_of(mesh, f, (k + 2) % 3), a), q = v3_sub(corner_of(mesh, g, third), a);
    p = v3_unit(v3_mad(p, -v3_dot(p, along), along)), q = v3_unit(v3_mad(q, -v3_dot(q, along), along));
    return v3_dot(p, q);
}

/* Adds what the faces f and g have in common: the corners, or a side. `sides` counts per side of f. */
static void inspect_pair(const inspection *i, uint32_t f, uint32_t g, uint32_t sides[3], defects *out) {
    uint32_t mates[3] = {3, 3, 3}, common = 0; /* corners of g; 3: none */
    for (uint32_t k = 0; k < 3; ++k) {
        for (uint32_t l = 0; l < 3; ++l)
            if (meet(i, f, k, g, l)) mates[k] = l;
        common += mates[k] < 3;
    }
    out->doubled = out->doubled || common == 3;
    for (uint32_t k = 0; k < 3; ++k) {
        uint32_t a = mates[k], b = mates[(k + 1) % 3];
        if (a == 3 || b == 3 || a == b) continue;
        ++sides[k];
        if (is_low(i->mesh, f, COARSE * i->step) || is_low(i->mesh, g, COARSE * i->step)) continue;
        if (find_fold(i->mesh, f, k, g, 3 - a - b) > (i->strict ? EARLY_FOLD : LATE_FOLD)) out->folded = true;
    }
}

static defects inspect(const fct_mesh *mesh, bool strict) {
    defects out = {0};
    inspection i = {mesh, strict, find_step(mesh), strict ? LEAST_HEIGHT * find_extent(mesh) : 0};
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        uint32_t sides[3] = {0, 0, 0};
        out.flat = out.flat || is_low(mesh, f, i.least);
        out.coarse = out.coarse || is_low(mesh, f, COARSE * i.step);
        for (uint32_t g = 0; g < mesh->face_count; ++g)
            if (g != f) inspect_pair(&i, f, g, sides, &out);
        for (int k = 0; k < 3; ++k) out.crowded = out.crowded || sides[k] > 1;
    }
    return out;
}

static void check_range(const float *before, size_t rows, const float *after, size_t new_rows,
                        size_t columns) {
    fuzz_require(!before == !after, "the arrays of the input");
    for (size_t c = 0; c < columns && after; ++c) {
        float low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < rows; ++i)
            low = fminf(low, before[i * columns + c]), high = fmaxf(high, before[i * columns + c]);
        for (size_t i = 0; i < new_rows; ++i)
            fuzz_require(after[i * columns + c] >= low && after[i * columns + c] <= high,
                         "an attribute stays within its range");
    }
}

static bool is_vertex(const fct_mesh *mesh, const float *p) {
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        if (!memcmp(mesh->positions + 3 * v, p, 3 * sizeof *p)) return true;
    return false;
}

static void check_attributes(const fct_mesh *mesh, const fct_mesh *out) {
    check_range(mesh->colors, mesh->vertex_count, out->colors, out->vertex_count, 3);
    check_range(mesh->texcoords, 3 * (size_t)mesh->face_count, out->texcoords, 3 * (size_t)out->face_count,
                2);
    check_range(mesh->face_colors, mesh->face_count, out->face_colors, out->face_count, 3);
    fuzz_require(!mesh->normals == !out->normals && !mesh->materials == !out->materials &&
                     !mesh->source_faces == !out->source_faces,
                 "the arrays of the input");
    for (size_t v = 0; out->normals && v < out->vertex_count; ++v) {
        double length = v3_norm(v3_load(out->normals + 3 * v));
        fuzz_require(length == 0 || fabs(length - 1) < 1e-5, "normals have unit length");
    }
    for (uint32_t f = 0; f < out->face_count; ++f) {
        if (out->materials)
            fuzz_require(out->materials[f] < out->material_count, "material ids are in range");
        if (f > 0 && out->source_faces)
            fuzz_require(out->source_faces[f - 1] <= out->source_faces[f], "faces keep their order");
    }
}

static void check(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def, const fct_mesh *out,
                  const fct_simplify_stats *stats) {
    fuzz_require(fct_mesh_validate(env, out) == FCT_OK, "the result is valid");
    fuzz_require(stats->faces_before == mesh->face_count && stats->faces_after == out->face_count, "counts");
    fuzz_require(out->face_count <= mesh->face_count && out->vertex_count <= mesh->vertex_count, "no growth");
    fuzz_require(stats->max_cost >= 0 && stats->max_cost <= def->max_error * (1 + 1e-9), "the error's limit");
    if (stats->stopped_because == FCT_STOP_FACES)
        fuzz_require(out->face_count <= def->target_faces, "the target is reached");
    fuzz_require(stats->pairs_joined <= stats->pairs_found &&
                     stats->pairs_found <= 8 * (uint64_t)mesh->vertex_count &&
                     (def->pair_distance > 0 || stats->pairs_found == 0),
                 "the number of pairs");
    if (def->max_error == INFINITY) fuzz_require(stats->stopped_because != FCT_STOP_ERROR, "no limit");
    check_attributes(mesh, out);
    for (uint32_t v = 0; def->placement == FCT_PLACE_SUBSET && v < out->vertex_count; ++v)
        fuzz_require(is_vertex(mesh, out->positions + 3 * (size_t)v), "a vertex of the input");
    if (!def->check_foldover) return;
    defects before = inspect(mesh, true), after = inspect(out, false);
    fuzz_require(before.flat || !after.flat, "no face loses its area");
    if (before.flat || before.doubled || before.crowded) return;
    fuzz_require(!after.doubled, "no face gets the corners of another");
    if (stats->pairs_joined > 0) return; /* joined bodies share edges, and may touch there */
    fuzz_require(!after.crowded, "no edge gets a third face");
    fuzz_require(before.folded || before.coarse || !after.folded, "no face folds over");
}

/* The levels of a progressive mesh, also of one that was written and read. */
static void check_levels(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def,
                         const fct_mesh *out) {
    fct_mesh same, x, y;
    fct_progressive *made, *read = NULL;
    fct_progressive_info info;
    if (fct_simplify_progressive(env, mesh, def, &same, NULL, &made) != FCT_OK) return; /* no memory */
    fuzz_require(same.face_count == out->face_count && same.vertex_count == out->vertex_count &&
                     !memcmp(same.positions, out->positions, 12 * (size_t)out->vertex_count),
                 "the log does not change the result");
    fct_mesh_release(env, &same);
    char *bytes = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&bytes, &size);
    fct_result result = fct_progressive_write(made, stream);
    fuzz_require(fclose(stream) == 0, "a stream in memory");
    if (result == FCT_OK) result = fct_progressive_read(env, "bytes", (unsigned char *)bytes, size, &read);
    fuzz_require(result == FCT_OK || result == FCT_ERROR_MEMORY, "what was written can be read");
    free(bytes);
    fct_progressive_inspect(made, &info);
    fuzz_require(info.least_faces == out->face_count, "the base mesh is the result");
    for (uint32_t i = 0; i < 6 && read; ++i) {
        uint32_t faces = info.least_faces + (info.most_faces - info.least_faces) * (i * 4 % 6) / 5;
        fuzz_require(fct_progressive_go(made, faces) == fct_progressive_go(read, faces), "the same levels");
        if (fct_progressive_mesh(made, &x) != FCT_OK) break;
        if (fct_progressive_mesh(read, &y) == FCT_OK) {
            fuzz_require(fct_mesh_validate(env, &x) == FCT_OK, "a level is a mesh");
            fuzz_require(x.vertex_count == y.vertex_count &&
                             !memcmp(x.positions, y.positions, 12 * (size_t)x.vertex_count) &&
                             !memcmp(x.triangles, y.triangles, 12 * (size_t)x.face_count) &&
                             (!x.colors || !memcmp(x.colors, y.colors, 12 * (size_t)x.vertex_count)) &&
                             (!x.normals || !memcmp(x.normals, y.normals, 12 * (size_t)x.vertex_count)) &&
                             (!x.texcoords || !memcmp(x.texcoords, y.texcoords, 24 * (size_t)x.face_count)) &&
                             (!x.materials || !memcmp(x.materials, y.materials, 4 * (size_t)x.face_count)),
                         "the same bytes");
            fct_mesh_release(env, &y);
        }
        fct_mesh_release(env, &x);
    }
    fct_progressive_destroy(made);
    fct_progressive_destroy(read);
}

static double weight(fuzz_bytes *b, double usual) {
    uint32_t value = fuzz_byte(b);
    return value < 128 ? usual : value == 255 ? (double)fuzz_real(b) : (value - 128) * usual;
}

static bool is_weight(double value) {
    return value == 0 || (value >= 1e-12 && value <= 1e12);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    fuzz_bytes b = fuzz_begin(data, size);
    fct_mesh mesh = fuzz_make_mesh(&env, &b), out;
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplify_stats stats;
    uint32_t options = fuzz_byte(&b);
    def.target_faces = fuzz_below(&b, mesh.face_count + 1);
    def.placement = options & 3;
    def.keep_topology = options & 4;
    def.check_foldover = !(options & 8);
    if (options & 16) def.max_error = fuzz_real(&b);
    if (options & 32) def.refit_passes = fuzz_below(&b, 4);
    if (options & 64) {
        def.color_weight = weight(&b, def.color_weight),
        def.texcoord_weight = weight(&b, def.texcoord_weight);
        def.normal_weight = weight(&b, def.normal_weight);
    }
    if (options & 128) {
        def.boundary_weight = weight(&b, def.boundary_weight);
        def.regularization = weight(&b, def.regularization), def.feature_threshold = weight(&b, .1);
    }
    uint32_t pairs = fuzz_byte(&b);
    if (pairs & 1) def.pair_distance = pairs == 255 ? (double)fuzz_real(&b) : pairs / 16.;
    def.primitive = pairs >> 1 & 1;
    bool valid = fuzz_check_mesh(&env, &mesh) && def.max_error >= 0 &&
                 (is_weight(def.color_weight) || def.color_weight == FCT_WEIGHT_AUTO) &&
                 is_weight(def.texcoord_weight) && is_weight(def.normal_weight) &&
                 is_weight(def.boundary_weight) && is_weight(def.regularization) &&
                 def.placement <= FCT_PLACE_SUBSET && def.pair_distance >= 0 &&
                 !(def.pair_distance > 0 && (def.keep_topology || def.primitive == FCT_PRIMITIVE_FACE)) &&
                 def.feature_threshold >= 0;
    fct_result result = fct_simplify(&env, &mesh, &def, &out, &stats);
    fuzz_require(result == (valid ? FCT_OK : FCT_ERROR_DATA), "valid input is simplified, and no other");
    fuzz_require(result == FCT_OK || (!out.positions && !out.triangles), "a failure leaves nothing behind");
    if (result == FCT_OK) check(&env, &mesh, &def, &out, &stats);
    if (result == FCT_OK && size % 4 == 0) check_levels(&env, &mesh, &def, &out);
    fct_mesh_release(&env, &out);
    fct_mesh_release(&env, &mesh);
    fuzz_end();
    return 0;
}
