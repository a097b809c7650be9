/* simplify/simplify.c: the public function: checks, phases, and the mesh that is left.
 *
 * The output's faces keep the input's order, its vertices are numbered as the faces first use them. Vertices
 * that no face uses are dropped, and so are faces with two corners at one place.
 */
#include "simplify/state.h"

fct_simplify_def fct_simplify_def_default(void) {
    return (fct_simplify_def){
        .size = sizeof(fct_simplify_def),
        .max_error = INFINITY,
        .placement = FCT_PLACE_OPTIMAL,
        .color_weight = .1,
        .texcoord_weight = .1,
        .normal_weight = .01,
        .boundary_weight = 1000,
        .feature_threshold = .1,
        .regularization = 1e-9,
        .refit_passes = 2,
        .check_foldover = true,
    };
}

static bool not_negative(double value) {
    return value >= 0 && value < INFINITY;
}

static fct_result check(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def) {
    if (def->size != sizeof *def)
        return fct_fail(env, FCT_ERROR_DATA, "fct_simplify_def was not filled by fct_simplify_def_default");
    if (!(def->max_error >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "max_error is %g, expected at least 0", def->max_error);
    if (!not_negative(def->color_weight) || !not_negative(def->texcoord_weight) ||
        !not_negative(def->normal_weight) || !not_negative(def->boundary_weight) ||
        !not_negative(def->regularization) || !(def->feature_threshold >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "a weight or threshold of the simplifier is negative or NaN");
    if (mesh->face_count > UINT32_MAX / 3)
        return fct_fail(env, FCT_ERROR_MEMORY, "%u faces, expected at most %u", mesh->face_count,
                        UINT32_MAX / 3);
    return fct_mesh_validate(env, mesh);
}

static void release(fct_simplifier *s) {
    void *arrays[] = {s->point_of,      s->positions,     s->sources,      s->point_parents, s->first_corners,
                      s->last_corners,  s->valences,      s->first_wedges, s->triangles,     s->next_corners,
                      s->side_edges,    s->corner_wedges, s->edges,        s->edge_flags,    s->quadrics,
                      s->attributes,    s->wedge_parents, s->next_wedges,  s->wedge_uses,    s->wedge_classes,
                      s->class_parents, s->link_marks,    s->ring_b,       s->refused};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i) fct_release(s->env, arrays[i]);
}

/* Numbers what becomes a vertex, by a key per live corner, in order of first use. */
static uint32_t vertex_key(fct_simplifier *s, uint32_t c) {
    if (!s->wedge_classes) return s->triangles[c];
    return fct_sets_find(s->class_parents, s->wedge_classes[corner_wedge(s, c)]);
}

static void write_position(const fct_simplifier *s, uint32_t point, float *out) {
    if (s->sources[point] != FCT_NONE) {
        memcpy(out, s->mesh->positions + 3 * (size_t)s->sources[point], 3 * sizeof *out);
        return;
    }
    v3_store(out, v3_mad(s->center, s->extent, point_position(s, point)));
}

/* The attributes of a corner's wedge; vertex attributes of wedges that share a vertex are the last one's
 * written, and equal to rounding where no seam lies between. */
static void write_attributes(fct_simplifier *s, fct_mesh *out, uint32_t corner, uint32_t c, uint32_t v) {
    const double *a = s->attributes + (size_t)s->channel_count * corner_wedge(s, c);
    for (uint32_t i = 0; i < s->channel_count; ++i) {
        const fct_channel *channel = &s->channels[i];
        float value = (float)(a[i] / channel->factor);
        if (channel->source == CHANNEL_COLOR)
            out->colors[3 * (size_t)v + channel->component] = value;
        else if (channel->source == CHANNEL_NORMAL)
            out->normals[3 * (size_t)v + channel->component] = value;
        else
            out->texcoords[2 * (size_t)corner + channel->component] = value;
    }
}

static void normalize_normals(fct_mesh *out) {
    for (uint32_t v = 0; v < out->vertex_count; ++v) {
        float *n = out->normals + 3 * (size_t)v;
        v3 unit = v3_unit(v3_load(n));
        if (v3_norm2(unit) > 0) v3_store(n, unit);
    }
}

static fct_result copy_names(const fct_env *env, const fct_mesh *mesh, fct_mesh *out) {
    if (!mesh->material_names) {
        out->material_count = mesh->material_count;
        return FCT_OK;
    }
    out->material_names = fct_allocate_zero(env, mesh->material_count, sizeof *out->material_names);
    if (!out->material_names) return fct_fail_memory(env, "material names");
    for (uint32_t i = 0; i < mesh->material_count; ++i) {
        size_t length = strlen(mesh->material_names[i]) + 1;
        out->material_names[i] = fct_allocate(env, length, 1);
        if (!out->material_names[i]) return fct_fail_memory(env, "material names");
        memcpy(out->material_names[i], mesh->material_names[i], length);
        out->material_count = i + 1;
    }
    return FCT_OK;
}

static void write_face(const fct_mesh *mesh, fct_mesh *out, uint32_t f, uint32_t to) {
    if (out->face_colors)
        memcpy(out->face_colors + 3 * (size_t)to, mesh->face_colors + 3 * (size_t)f, 3 * sizeof(float));
    if (out->materials) out->materials[to] = mesh->materials[f];
    if (out->source_faces) out->source_faces[to] = mesh->source_faces[f];
}

static fct_result write_mesh(fct_simplifier *s, fct_mesh *out) {
    const fct_mesh *mesh = s->mesh;
    uint32_t key_count = s->wedge_classes ? s->class_count : s->point_count, vertices = 0;
    uint32_t *numbers = fct_allocate(s->env, key_count, sizeof *numbers);
    if (!numbers) return fct_fail_memory(s->env, "output vertices");
    memset(numbers, 0xff, key_count * sizeof *numbers);
    uint32_t corners = 3 * mesh->face_count;
    for (uint32_t c = 0; c < corners; ++c) {
        if (corner_dead(s, c)) continue;
        uint32_t key = vertex_key(s, c);
        if (numbers[key] == FCT_NONE) numbers[key] = vertices++;
    }
    unsigned arrays =
        (mesh->colors ? FCT_MESH_COLORS : 0) | (mesh->normals ? FCT_MESH_NORMALS : 0) |
        (mesh->texcoords ? FCT_MESH_TEXCOORDS : 0) | (mesh->face_colors ? FCT_MESH_FACE_COLORS : 0) |
        (mesh->materials ? FCT_MESH_MATERIALS : 0) | (mesh->source_faces ? FCT_MESH_SOURCE_FACES : 0);
    fct_result result = fct_mesh_create(s->env, vertices, s->live_faces, arrays, out);
    if (result == FCT_OK) result = copy_names(s->env, mesh, out);
    uint32_t to = 0;
    for (uint32_t f = 0; f < mesh->face_count && result == FCT_OK; ++f) {
        if (corner_dead(s, 3 * f)) continue;
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t c = 3 * f + k, v = numbers[vertex_key(s, c)];
            out->triangles[3 * (size_t)to + k] = v;
            write_position(s, s->triangles[c], out->positions + 3 * (size_t)v);
            if (s->channel_count) write_attributes(s, out, 3 * to + k, c, v);
        }
        write_face(mesh, out, f, to++);
    }
    if (result == FCT_OK && out->normals) normalize_normals(out);
    fct_release(s->env, numbers);
    return result;
}

static fct_result prepare(fct_simplifier *s) {
    fct_simplify_channels(s);
    fct_result result = fct_simplify_topology(s);
    if (result == FCT_OK) result = fct_simplify_attributes(s);
    if (result == FCT_OK) result = fct_simplify_quadrics(s);
    if (result != FCT_OK) return result;
    size_t ring = s->face_count > SIMPLIFY_HUB ? s->face_count : SIMPLIFY_HUB;
    s->ring_b = fct_allocate(s->env, ring, sizeof *s->ring_b);
    s->refused = fct_allocate_zero(s->env, s->point_count, sizeof *s->refused);
    if (!s->ring_b || !s->refused) return fct_fail_memory(s->env, "rings");
    if (!s->def->keep_topology) return FCT_OK;
    s->link_marks = fct_allocate_zero(s->env, s->point_count, sizeof *s->link_marks);
    return s->link_marks ? FCT_OK : fct_fail_memory(s->env, "marks of points");
}

fct_result fct_simplify(const fct_env *env, const fct_mesh *mesh, const fct_simplify_def *def, fct_mesh *out,
                        fct_simplify_stats *stats) {
    *out = (fct_mesh){0};
    fct_result result = check(env, mesh, def);
    if (result != FCT_OK) return result;
    fct_simplifier *s = fct_allocate_zero(env, 1, sizeof *s);
    if (!s) return fct_fail_memory(env, "the simplifier");
    s->env = env, s->mesh = mesh, s->def = def;
    fct_stop stop = FCT_STOP_FACES;
    double start = fct_seconds(), ready = start, contracted = start;
    result = prepare(s);
    ready = fct_seconds();
    if (result == FCT_OK) result = fct_simplify_contract(s, &stop);
    contracted = fct_seconds();
    bool refit = s->live_faces < s->face_count && def->placement != FCT_PLACE_SUBSET;
    if (result == FCT_OK && refit && def->refit_passes) result = fct_simplify_refit(s);
    if (result == FCT_OK) result = write_mesh(s, out);
    if (result != FCT_OK) fct_mesh_release(env, out);
    if (result == FCT_OK && stats)
        *stats = (fct_simplify_stats){.faces_before = mesh->face_count,
                                      .faces_after = out->face_count,
                                      .stopped_because = stop,
                                      .max_cost = sqrt(s->max_error2) * s->extent,
                                      .seconds_init = ready - start,
                                      .seconds_contract = contracted - ready,
                                      .seconds_refit = fct_seconds() - contracted};
    release(s);
    fct_release(env, s);
    return result;
}
