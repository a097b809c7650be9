/* mesh/glb/replace/open.c: opens a document and reads each of its meshes once. */
#include <string.h>

#include "base/io/beside.h"
#include "base/math/vec.h"
#include "mesh/glb/features.h"
#include "mesh/glb/primitive.h"
#include "mesh/glb/replace/carry.h"

/* Inverts R|t. False if it flattens space. */
static bool invert(const double m[12], double out[12]) {
    v3 x = v3_make(m[0], m[4], m[8]), y = v3_make(m[1], m[5], m[9]), z = v3_make(m[2], m[6], m[10]);
    v3 rows[3] = {v3_cross(y, z), v3_cross(z, x), v3_cross(x, y)};
    double determinant = v3_dot(x, rows[0]), size = v3_norm(x) * v3_norm(y) * v3_norm(z);
    if (!(fabs(determinant) > 1e-9 * size) || !isfinite(1 / determinant)) return false;
    for (int i = 0; i < 3; ++i) {
        v3 row = v3_scale(rows[i], 1 / determinant);
        out[4 * i] = row.x, out[4 * i + 1] = row.y, out[4 * i + 2] = row.z;
        out[4 * i + 3] = -v3_dot(row, v3_make(m[3], m[7], m[11]));
    }
    return true;
}

static void set_transform(fct_gltf_group *g, const fct_glb_transform *t) {
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    g->identity = t->identity || !invert(t->m, g->to_node);
    memcpy(g->to_world, g->identity ? identity : t->m, sizeof identity);
    if (g->identity) memcpy(g->to_node, identity, sizeof identity);
    const double *m = g->to_node;
    g->mirrored = v3_dot(v3_make(m[0], m[1], m[2]),
                         v3_cross(v3_make(m[4], m[5], m[6]), v3_make(m[8], m[9], m[10]))) < 0;
}

/* Lists the primitives of a mesh that append_mesh numbers. */
static fct_result list_parts(fct_gltf *d, uint32_t mesh) {
    fct_gltf_group *g = d->groups + mesh;
    json_t *object,
        *primitives =
            json_object_get(json_array_get(json_object_get(d->glb.root, "meshes"), mesh), "primitives");
    size_t i;
    g->first = d->part_count, g->count = 0;
    json_array_foreach(primitives, i, object) {
        fct_glb_primitive p;
        fct_result result = fct_glb_read_primitive(&d->glb, object, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT || p.mode < 4) continue;
        result = fct_grow(d->env, (void **)&d->parts, &d->part_capacity, (size_t)d->part_count + 1,
                          sizeof *d->parts);
        if (result != FCT_OK) return result;
        d->parts[d->part_count++] = (fct_gltf_part){mesh, (uint32_t)i};
        ++g->count;
        g->colors |= p.color >= 0 || p.light >= 0;
        if (!g->light) g->light = p.light_name;
        g->texcoords |= p.texcoord >= 0;
    }
    return FCT_OK;
}

typedef struct reader {
    fct_gltf *gltf;
    fct_glb_builder builder;
    fct_glb_transform last; /* of the mesh read last */
} reader;

static fct_result read_mesh(void *user, const fct_glb_place *place) {
    reader *r = user;
    fct_gltf *d = r->gltf;
    if (place->mesh == FCT_GLB_ABSENT) return FCT_OK;
    json_t *mesh;
    fct_result result = fct_glb_item(&d->glb, "meshes", place->mesh, &mesh);
    if (result != FCT_OK || d->groups[place->mesh].placed) return result;
    fct_gltf_group *g = d->groups + place->mesh;
    g->placed = true;
    set_transform(g, &place->to_world);
    result = list_parts(d, (uint32_t)place->mesh);
    if (result != FCT_OK || !g->count) return result;
    r->last.identity = g->identity;
    memcpy(r->last.m, g->to_world, sizeof r->last.m);
    return fct_glb_append_mesh(&r->builder, place->mesh, &r->last);
}

/* Reads each mesh once, those that no node of the scene has last, relative to the origin in *soup. */
static fct_result read_soup(fct_gltf *d, fct_soup *soup) {
    reader r = {.gltf = d,
                .builder = {.glb = &d->glb, .soup = soup, .by_primitive = true},
                .last = {.identity = true}};
    bool unnamed;
    memset(d->groups, 0, d->group_count * sizeof *d->groups);
    d->part_count = 0;
    d->glb.vertex_count = d->glb.corner_count = 0;
    fct_result result = fct_glb_choose_arrays(&r.builder, &unnamed);
    r.builder.has_materials = true;
    if (result == FCT_OK) result = fct_glb_begin_soup(&r.builder);
    if (result == FCT_OK) result = fct_glb_visit_nodes(&d->glb, read_mesh, &r);
    /* Others are put beside one of them, so that they share its local origin. */
    fct_glb_place place = {.index = FCT_GLB_ABSENT, .to_world = r.last};
    for (; result == FCT_OK && place.mesh < (int64_t)d->group_count; ++place.mesh)
        result = read_mesh(&r, &place);
    if (result != FCT_OK) return result;
    fct_glb_end_soup(&r.builder);
    r.builder.without_color = r.builder.without_texcoord = 0; /* a mesh keeps the arrays that it has */
    fct_glb_report_builder(&r.builder);
    soup->material_count = d->part_count;
    return FCT_OK;
}

static fct_result read_document(fct_gltf *d, fct_mesh *mesh) {
    fct_soup soup = {0}, far = {0};
    fct_result result;
    d->group_count = fct_glb_count(&d->glb, "meshes");
    d->groups = fct_allocate(d->env, d->group_count, sizeof *d->groups);
    if (!d->groups) return fct_fail_memory(d->env, "a glTF document");
    result = read_soup(d, &soup);
    if (result == FCT_OK && fct_extent_origin(&soup.extent, far.origin)) {
        fct_soup_release(d->env, &soup);
        soup = far;
        result = read_soup(d, &soup);
    }
    if (result == FCT_OK) result = fct_glb_report_losses(&d->glb);
    if (result == FCT_OK) return fct_soup_mesh(d->env, d->name, &soup, mesh);
    fct_soup_release(d->env, &soup);
    return result;
}

fct_result fct_gltf_open_document(const fct_env *env, const char *path, fct_gltf **out) {
    *out = NULL;
    fct_gltf *d = fct_allocate_zero(env, 1, sizeof *d);
    if (!d) return fct_fail_memory(env, "a glTF document");
    d->env = env;
    d->glb.source = &d->source, d->source.env = env;
    const char *name = strcmp(path, "-") != 0 ? path : "standard input";
    d->name = fct_copy_text(env, name, strlen(name));
    d->folder = d->name ? fct_file_folder(env, path) : NULL;
    fct_result result = d->folder ? fct_file_open(env, path, &d->file) : FCT_ERROR_MEMORY;
    if (!d->name) result = fct_fail_memory(env, "a glTF document");
    if (result == FCT_OK) result = fct_progress(env, "read", 0);
    d->source = (fct_source){env, d->name, d->file.data, d->file.size, d->folder};
    if (result == FCT_OK) result = fct_glb_open(&d->source, &d->glb);
    if (result == FCT_OK)
        *out = d;
    else
        fct_gltf_close(d);
    return result;
}

fct_result fct_gltf_open(const fct_env *env, const char *path, fct_gltf **out, fct_mesh *mesh) {
    fct_gltf *d;
    *out = NULL;
    *mesh = (fct_mesh){0};
    fct_result result = fct_gltf_open_document(env, path, &d);
    if (result != FCT_OK) return result;
    result = read_document(d, mesh);
    if (result == FCT_OK)
        *out = d;
    else
        fct_gltf_close(d);
    return result;
}

void fct_gltf_close(fct_gltf *d) {
    if (!d) return;
    fct_glb_close(&d->glb);
    fct_file_close(d->env, &d->file);
    fct_release(d->env, d->groups);
    fct_release(d->env, d->parts);
    fct_release(d->env, d->name);
    fct_release(d->env, d->folder);
    fct_release(d->env, d);
}
