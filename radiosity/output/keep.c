/* radiosity/output/keep.c: see keep.h.
 *
 * A lit surface has one vertex per smooth side of a crease. Its faces are those of its model, in order, so
 * corner k of face f is corner k of face f of the model (in a mirrored instance, corners 1 and 2 change
 * places). The sources of the model lead to the mesh as it was added.
 */
#include "radiosity/output/keep.h"

#include <string.h>

#include "base/env.h"
#include "mesh/mesh.h"
#include "scene/transform.h"

/* The rule of fct_keep_centres. */
#define CENTRE_SHARE .75
#define CORNER_SHARE (1. / 12)
/* Weight of a corner of a face without area, against areas: it counts only where no other corner does. */
#define LEAST_WEIGHT 1e-300

/* The values of vertices that are joined, and their floats: four kinds of light, normals and the error. */
enum { LIGHTS = 6 };
static const size_t widths[LIGHTS] = {3, 3, 3, 3, 3, 1};

/* Twice the area vector of a face. */
static v3 measure_face(const fct_mesh *m, size_t f, v3 *centre) {
    const uint32_t *t = m->triangles + 3 * f;
    const v3 a = v3_load(m->positions + 3 * (size_t)t[0]), b = v3_load(m->positions + 3 * (size_t)t[1]),
             c = v3_load(m->positions + 3 * (size_t)t[2]);
    *centre = v3_scale(v3_add(v3_add(a, b), c), 1. / 3);
    return v3_cross(v3_sub(b, a), v3_sub(c, a));
}

static void copy_floats(float *to, const float *from, size_t count) {
    if (count) memcpy(to, from, count * sizeof *to);
}

/* The shading normal at the centre of a face: that of the file if it has one there. */
static v3 find_centre_normal(const fct_surface *s, size_t f, v3 face_normal) {
    static const float centre[2] = {1.f / 3, 1.f / 3};
    if (s->shading.rule != FCT_NORMALS_FILE) return face_normal;
    fct_shaded_face face;
    fct_shading_face(&s->shading, s->face_places[f], &face);
    const v3 normal = fct_shaded_normal(&face, centre);
    return v3_norm2(normal) > 0 ? normal : face_normal;
}

static void place_centre(const fct_surface *old, size_t f, fct_surface *s) {
    const uint32_t *t = old->mesh.triangles + 3 * f;
    const size_t v = old->mesh.vertex_count + f;
    v3 centre;
    const v3 cross = measure_face(&old->mesh, f, &centre);
    const double area = .5 * v3_norm(cross);
    const v3 normal = find_centre_normal(old, f, v3_unit(cross));
    v3_store(s->mesh.positions + 3 * v, centre);
    v3_store(s->sample_points + 3 * v, fct_shading_lift(&old->shading, old->face_places[f], centre));
    v3_store(s->normals + 3 * v, normal);
    for (int k = 0; k < 3; ++k) {
        s->offsets[v] = fmaxf(s->offsets[v], old->offsets[t[k]]);
        s->areas[t[k]] += (float)(area * CORNER_SHARE);
    }
    s->areas[v] = (float)(area * CENTRE_SHARE);
    s->places[v] = old->face_places[f];
    s->flat[v] = v3_dot(normal, v3_unit(cross)) >= FCT_FLAT_COSINE;
}

fct_result fct_keep_centres(const fct_env *env, fct_surface *surface) {
    const fct_mesh *m = &surface->mesh;
    const size_t vertices = m->vertex_count, faces = m->face_count;
    fct_surface s;
    if (vertices + faces > FCT_MESH_LIMIT)
        return fct_fail(env, FCT_ERROR_MEMORY, "a surface has too many vertices and faces");
    fct_result result = fct_surface_allocate(env, (uint32_t)(vertices + faces), m->face_count, &s);
    if (result != FCT_OK) return result;
    s.shading = surface->shading;
    copy_floats(s.mesh.positions, m->positions, 3 * vertices);
    copy_floats(s.normals, surface->normals, 3 * vertices);
    copy_floats(s.sample_points, surface->sample_points, 3 * vertices);
    copy_floats(s.offsets, surface->offsets, vertices);
    copy_floats(s.mesh.source_uv, m->source_uv, 6 * faces);
    if (vertices) memcpy(s.places, surface->places, vertices * sizeof *s.places);
    if (vertices) memcpy(s.flat, surface->flat, vertices);
    memcpy(s.mesh.triangles, m->triangles, 3 * faces * sizeof *m->triangles);
    memcpy(s.mesh.source_faces, m->source_faces, faces * sizeof *m->source_faces);
    memcpy(s.face_places, surface->face_places, faces * sizeof *s.face_places);
    for (size_t f = 0; f < faces; ++f) place_centre(surface, f, &s);
    fct_surface_release(env, surface);
    *surface = s;
    return FCT_OK;
}

/* ---- Merging parts ---- */

typedef struct merging {
    const fct_env *env;
    const fct_scene_view *view;
    uint32_t first, count; /* instances */
    const fct_mesh *lit;
    fct_mesh *out;
    double *sums;      /* except FCT_KEEP_CORNER: per vertex x LIGHTS x 3, weighted */
    double *weights;   /* except FCT_KEEP_CORNER: per vertex */
    uint8_t *taken;    /* FCT_KEEP_CORNER: per vertex of the added mesh */
    uint32_t *numbers; /* FCT_KEEP_CORNER: per vertex of the part that is being added */
} merging;

static const fct_model *model_of(const merging *m, uint32_t part) {
    return m->view->models + m->view->instances[m->first + part].model;
}

/* The vertices of the part's model; those of its lit surface begin with them. */
static uint32_t count_vertices(const merging *m, uint32_t part) {
    return fct_tree_get(model_of(m, part)->tree).vertex_count;
}

static uint32_t source_vertex(const fct_model *model, uint32_t v) {
    return model->source_vertices ? model->source_vertices[v] : v;
}

static void list_lights(const fct_mesh *mesh, float *out[LIGHTS]) {
    out[0] = mesh->colors, out[1] = mesh->irradiance, out[2] = mesh->direct, out[3] = mesh->indirect;
    out[4] = mesh->normals, out[5] = mesh->error;
}

/* Positions of the part's vertices, also of those without faces, and places of its faces. */
static void copy_geometry(const merging *m, uint32_t part) {
    const fct_model *model = model_of(m, part);
    const fct_mesh *lit = &m->lit[part];
    for (uint32_t v = 0; v < count_vertices(m, part); ++v)
        copy_floats(m->out->positions + 3 * (size_t)source_vertex(model, v), lit->positions + 3 * (size_t)v,
                    3);
    for (size_t f = 0; f < lit->face_count; ++f) {
        const uint32_t to = lit->source_faces[f];
        m->out->source_faces[to] = to;
        copy_floats(m->out->source_uv + 6 * (size_t)to, lit->source_uv + 6 * f, 6);
    }
    const fct_instance *placed = m->view->instances + m->first + part;
    for (size_t i = 0; i < model->loose_count; ++i)
        v3_store(m->out->positions + 3 * (size_t)model->loose_vertices[i],
                 fct_transform_point(placed->to_world, v3_load(model->loose_positions + 3 * i)));
}

/* Adds the light of the part's corners to their vertices of the added mesh. */
static void add_corners(const merging *m, uint32_t part, const fct_mesh *own) {
    const fct_model *model = model_of(m, part);
    const fct_mesh *lit = &m->lit[part];
    const bool mirrored = m->view->instances[m->first + part].mirrored;
    float *lights[LIGHTS];
    list_lights(lit, lights);
    for (size_t f = 0; f < lit->face_count; ++f) {
        v3 centre;
        const double weight = v3_norm(measure_face(lit, f, &centre)) + LEAST_WEIGHT;
        uint32_t *t = m->out->triangles + 3 * (size_t)lit->source_faces[f];
        for (size_t k = 0; k < 3; ++k) {
            const size_t from = lit->triangles[3 * f + k];
            const size_t v = source_vertex(model, own->triangles[3 * f + (mirrored ? (3 - k) % 3 : k)]);
            t[k] = (uint32_t)v;
            m->weights[v] += weight;
            for (size_t i = 0; i < LIGHTS; ++i)
                for (size_t c = 0; lights[i] && c < widths[i]; ++c)
                    m->sums[3 * (LIGHTS * v + i) + c] += weight * (double)lights[i][widths[i] * from + c];
        }
    }
}

static void store_means(const merging *m) {
    float *lights[LIGHTS];
    list_lights(m->out, lights);
    for (size_t v = 0; v < m->out->vertex_count; ++v)
        for (size_t i = 0; i < LIGHTS; ++i)
            for (size_t c = 0; lights[i] && c < widths[i]; ++c)
                lights[i][widths[i] * v + c] =
                    m->weights[v] > 0 ? (float)(m->sums[3 * (LIGHTS * v + i) + c] / m->weights[v]) : 0;
    for (size_t v = 0; v < m->out->vertex_count; ++v) {
        float *n = m->out->normals + 3 * v;
        v3_store(n, v3_unit(v3_load(n)));
    }
}

/* The mean of each face by the rule of fct_keep_centres; of its corners if the face has no area. */
static void store_faces(const merging *m, uint32_t part, const fct_mesh *own) {
    const fct_model *model = model_of(m, part);
    const fct_mesh *lit = &m->lit[part];
    const bool mirrored = m->view->instances[m->first + part].mirrored;
    const size_t centres = lit->vertex_count - lit->face_count;
    for (size_t f = 0; f < lit->face_count; ++f) {
        const size_t to = 3 * (size_t)lit->source_faces[f];
        v3 centre, sum = {0, 0, 0};
        const bool flat = v3_norm2(measure_face(lit, f, &centre)) > 0;
        for (size_t k = 0; k < 3; ++k) {
            sum = v3_add(sum, v3_load(lit->colors + 3 * (size_t)lit->triangles[3 * f + k]));
            m->out->triangles[to + k] =
                source_vertex(model, own->triangles[3 * f + (mirrored ? (3 - k) % 3 : k)]);
        }
        v3 mean = v3_scale(sum, flat ? CORNER_SHARE : 1. / 3);
        if (flat) mean = v3_mad(mean, CENTRE_SHARE, v3_load(lit->colors + 3 * (centres + f)));
        v3_store(m->out->face_colors + to, mean);
    }
}

/* Numbers the vertices of a part: the first side of a vertex keeps its number, others follow. Returns the
 * next free number. */
static uint64_t number_sides(const merging *m, uint32_t part, uint64_t next) {
    const uint32_t own = count_vertices(m, part);
    for (uint32_t v = 0; v < m->lit[part].vertex_count; ++v) {
        const uint32_t source = v < own ? source_vertex(model_of(m, part), v) : FCT_NONE;
        const bool free = source != FCT_NONE && !m->taken[source];
        if (free) m->taken[source] = 1;
        m->numbers[v] = free ? source : (uint32_t)next++;
    }
    return next;
}

static void copy_sides(const merging *m, uint32_t part) {
    const fct_mesh *lit = &m->lit[part];
    float *from[LIGHTS], *to[LIGHTS];
    list_lights(lit, from);
    list_lights(m->out, to);
    for (size_t v = 0; v < lit->vertex_count; ++v) {
        const size_t number = m->numbers[v];
        copy_floats(m->out->positions + 3 * number, lit->positions + 3 * v, 3);
        for (int i = 0; i < LIGHTS; ++i)
            if (from[i] && to[i]) copy_floats(to[i] + widths[i] * number, from[i] + widths[i] * v, widths[i]);
    }
    for (size_t c = 0; c < 3 * (size_t)lit->face_count; ++c)
        m->out->triangles[3 * (size_t)lit->source_faces[c / 3] + c % 3] = m->numbers[lit->triangles[c]];
}

/* Allocates *out for all parts, with the vertices of the sides. */
static fct_result create_out(merging *m, fct_keep keep) {
    const fct_model *model = model_of(m, 0);
    uint64_t vertices = model->source_vertex_count;
    if (keep == FCT_KEEP_CORNER) {
        memset(m->taken, 0, model->source_vertex_count);
        for (uint32_t p = 0; p < m->count; ++p) vertices = number_sides(m, p, vertices);
        memset(m->taken, 0, model->source_vertex_count);
    }
    if (vertices > FCT_MESH_LIMIT)
        return fct_fail(m->env, FCT_ERROR_MEMORY, "the lit mesh has more than 2^31 vertices");
    unsigned arrays = fct_mesh_bits(&m->lit[0]);
    if (keep == FCT_KEEP_FACE)
        arrays = FCT_MESH_FACE_COLORS | FCT_MESH_NORMALS | FCT_MESH_SOURCE_FACES | FCT_MESH_SOURCE_UV;
    fct_result result = fct_mesh_create(m->env, (uint32_t)vertices, model->source_face_count, arrays, m->out);
    if (result != FCT_OK) return result;
    float *lights[LIGHTS];
    list_lights(m->out, lights);
    for (int i = 0; i < LIGHTS; ++i)
        if (lights[i]) memset(lights[i], 0, widths[i] * (size_t)vertices * sizeof(float));
    memcpy(m->out->origin, m->lit[0].origin, sizeof m->out->origin);
    return FCT_OK;
}

static fct_result add_part(const merging *m, uint32_t part, fct_keep keep, uint64_t *next) {
    copy_geometry(m, part);
    if (keep == FCT_KEEP_CORNER) {
        *next = number_sides(m, part, *next);
        copy_sides(m, part);
        return FCT_OK;
    }
    fct_mesh own;
    fct_result result = fct_tree_mesh(m->env, model_of(m, part)->tree, &own);
    if (result != FCT_OK) return result;
    add_corners(m, part, &own);
    if (keep == FCT_KEEP_FACE) store_faces(m, part, &own);
    fct_mesh_release(m->env, &own);
    return FCT_OK;
}

fct_result fct_keep_merge(const fct_env *env, const fct_scene_view *view, uint32_t first, uint32_t count,
                          fct_keep keep, const fct_mesh *lit, fct_mesh *out) {
    merging m = {.env = env, .view = view, .first = first, .count = count, .lit = lit, .out = out};
    const size_t vertices = model_of(&m, 0)->source_vertex_count;
    const bool sides = keep == FCT_KEEP_CORNER, means = !sides;
    size_t largest = 0;
    *out = (fct_mesh){0};
    for (uint32_t p = 0; p < count; ++p)
        if (lit[p].vertex_count > largest) largest = lit[p].vertex_count;
    m.sums = NULL, m.weights = NULL;
    if (means) {
        m.sums = fct_allocate_zero(env, vertices, 3 * LIGHTS * sizeof *m.sums);
        m.weights = fct_allocate_zero(env, vertices, sizeof *m.weights);
    }
    if (sides) {
        m.taken = fct_allocate(env, vertices, 1);
        m.numbers = fct_allocate(env, largest, sizeof *m.numbers);
    }
    fct_result result = FCT_OK;
    if ((means && (!m.sums || !m.weights)) || (sides && (!m.taken || !m.numbers)))
        result = fct_fail_memory(env, "the lit mesh");
    if (result == FCT_OK) result = create_out(&m, keep);
    uint64_t next = vertices;
    for (uint32_t p = 0; p < count && result == FCT_OK; ++p) result = add_part(&m, p, keep, &next);
    if (result == FCT_OK && means) store_means(&m);
    fct_release(env, m.sums), fct_release(env, m.weights);
    fct_release(env, m.taken), fct_release(env, m.numbers);
    if (result != FCT_OK) fct_mesh_release(env, out);
    return result;
}
