/* mesh/glb/replace/save.c: writes a document with other triangles.
 *
 * The faces of the given mesh are sorted by the mesh of the document that their primitive belongs to. Each of
 * these groups becomes a geometry (export.h) in the space of its node. The document is copied without its
 * geometry, and its meshes get new primitives.
 */
#include <string.h>
#include <strings.h>

#include "base/math/vec.h"
#include "mesh/glb/replace/carry.h"
#include "mesh/glb/replace/document.h"
#include "mesh/glb/write/export.h"

/* ---- Geometry ---- */

/* Moves a mesh of one group into the space of its node. */
static void move_to_node(const fct_gltf_group *g, fct_mesh *mesh) {
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        float *p = mesh->positions + 3 * (size_t)v;
        double world[3];
        const double *m = g->to_node;
        for (int k = 0; k < 3; ++k) world[k] = mesh->origin[k] + (double)p[k];
        for (int k = 0; k < 3 && !(g->identity && mesh->origin[k] == 0); ++k)
            p[k] = (float)(m[4 * k] * world[0] + m[4 * k + 1] * world[1] + m[4 * k + 2] * world[2] +
                           m[4 * k + 3]);
    }
    memset(mesh->origin, 0, sizeof mesh->origin);
    if (g->mirrored) fct_mesh_turn_over(mesh);
    if (g->identity) return;
    /* A normal goes to the world with the inverse transpose, so it comes back with the transpose. */
    for (uint32_t v = 0; mesh->normals && v < mesh->vertex_count; ++v) {
        float *n = mesh->normals + 3 * (size_t)v;
        const double *m = g->to_world;
        double local[3];
        for (int k = 0; k < 3; ++k)
            local[k] = m[k] * (double)n[0] + m[4 + k] * (double)n[1] + m[8 + k] * (double)n[2];
        v3_store(n, v3_unit(v3_make(local[0], local[1], local[2])));
    }
}

static void drop(const fct_env *env, float **array) {
    fct_release(env, *array);
    *array = NULL;
}

/* The faces of a group as a mesh whose materials are numbers of its own parts. */
static fct_result make_group_mesh(const fct_gltf *d, const fct_mesh *mesh, size_t index,
                                  const uint32_t *faces, uint32_t count, fct_mesh *out) {
    const fct_gltf_group *g = d->groups + index;
    fct_result result = fct_mesh_extract(d->env, mesh, faces, count, out, NULL);
    if (result != FCT_OK) return result;
    for (uint32_t f = 0; f < count; ++f) out->materials[f] -= g->first;
    out->material_count = g->count;
    if (!g->colors) drop(d->env, &out->colors);
    if (!g->texcoords) drop(d->env, &out->texcoords);
    move_to_node(g, out);
    return FCT_OK;
}

/* ---- Writing ---- */

typedef struct writing {
    fct_gltf *gltf;
    const fct_mesh_save_def *def;
    const char *path;
    const fct_mesh *mesh;
    json_t *root;     /* the document without its geometry */
    fct_mesh *meshes; /* per geometry */
    size_t *groups;   /* the group of each geometry */
    fct_glb_content content;
    fct_gltf_images images;
    bool failed; /* memory for text was exhausted */
} writing;

static fct_result fail_json(const fct_gltf *d) {
    return fct_fail_memory(d->env, "the JSON of a glTF file");
}

/* Sorts the faces by group and makes the geometries of the groups that have faces. */
static fct_result make_geometries(writing *w) {
    fct_gltf *d = w->gltf;
    const fct_mesh *m = w->mesh;
    uint32_t *faces, *starts;
    const fct_array arrays[] = {FCT_ARRAY(faces, m->face_count), FCT_ARRAY_ZERO(starts, d->group_count + 2),
                                FCT_ARRAY_ZERO(w->meshes, d->group_count),
                                FCT_ARRAY(w->groups, d->group_count),
                                FCT_ARRAY_ZERO(w->content.geometries, d->group_count)};
    fct_result result = fct_allocate_all(d->env, arrays, FCT_LENGTH(arrays), "the meshes of a glTF file");
    if (result != FCT_OK) return result;
    for (uint32_t f = 0; f < m->face_count; ++f) ++starts[d->parts[m->materials[f]].mesh + 2];
    for (size_t g = 2; g <= d->group_count; ++g) starts[g] += starts[g - 1];
    for (uint32_t f = 0; f < m->face_count; ++f) faces[starts[d->parts[m->materials[f]].mesh + 1]++] = f;
    for (size_t g = 0; g < d->group_count && result == FCT_OK; ++g) {
        uint32_t count = starts[g + 1] - starts[g];
        if (!count) continue;
        size_t at = w->content.geometry_count++;
        fct_glb_geometry *geometry = w->content.geometries + at;
        w->groups[at] = g;
        result = make_group_mesh(d, m, g, faces + starts[g], count, w->meshes + at);
        *geometry = (fct_glb_geometry){.mesh = w->meshes + at, .light_name = d->groups[g].light};
        fct_sink sink = {d->env, w->path, w->meshes + at, w->def, NULL};
        geometry->light = geometry->light_name ? w->meshes[at].colors : NULL;
        if (result == FCT_OK) result = fct_glb_layout_build(&sink, &geometry->layout);
        if (result == FCT_OK)
            result = fct_progress(d->env, "write", .5 * (double)(g + 1) / (double)d->group_count);
    }
    fct_release(d->env, faces);
    fct_release(d->env, starts);
    return result;
}

/* Gives the meshes that stay new numbers, and removes the others from the nodes. numbers: group_count. False
 * without memory. */
static bool renumber_meshes(const writing *w, int64_t *numbers) {
    json_t *node;
    size_t i;
    for (size_t g = 0; g < w->gltf->group_count; ++g) numbers[g] = FCT_GLB_ABSENT;
    for (size_t k = 0; k < w->content.geometry_count; ++k) numbers[w->groups[k]] = (int64_t)k;
    json_array_foreach(json_object_get(w->root, "nodes"), i, node) {
        json_int_t mesh = json_integer_value(json_object_get(node, "mesh"));
        bool has_mesh = json_object_get(node, "mesh") && mesh >= 0 && (uint64_t)mesh < w->gltf->group_count;
        if (!has_mesh || numbers[mesh] == FCT_GLB_ABSENT)
            json_object_del(node, "mesh");
        else if (json_object_set_new(node, "mesh", json_integer(numbers[mesh])))
            return false;
    }
    return true;
}

/* Without nodes, a document places each mesh once; so does the copy. */
static fct_result copy_document(writing *w) {
    fct_gltf *d = w->gltf;
    int64_t *numbers = fct_allocate(d->env, d->group_count, sizeof *numbers);
    fct_result result = numbers ? fct_gltf_copy_root(d, &w->root) : fail_json(d);
    if (result == FCT_OK && !renumber_meshes(w, numbers)) result = fail_json(d);
    fct_release(d->env, numbers);
    return result;
}

static void print_primitive(writing *w, size_t k, uint32_t i, const json_t *object, FILE *json) {
    static const char *const replaced[] = {"attributes", "indices", "mode", "targets"};
    json_t *primitive = json_deep_copy(object);
    for (size_t r = 0; r < FCT_LENGTH(replaced); ++r) json_object_del(primitive, replaced[r]);
    fct_gltf_remove_extension(primitive, "KHR_draco_mesh_compression");
    if (fct_gltf_print_open(primitive, json, &w->failed)) fputc(',', json);
    fct_glb_print_primitive(w->content.geometries + k, i, json);
    fputc('}', json);
    json_decref(primitive);
}

static void print_mesh(writing *w, size_t k, FILE *json) {
    const fct_gltf *d = w->gltf;
    const fct_gltf_group *g = d->groups + w->groups[k];
    json_t *object = json_array_get(json_object_get(d->glb.root, "meshes"), w->groups[k]);
    json_t *mesh = json_deep_copy(object), *primitives = json_object_get(object, "primitives");
    bool first = true;
    json_object_del(mesh, "primitives");
    json_object_del(mesh, "weights");
    if (fct_gltf_print_open(mesh, json, &w->failed)) fputc(',', json);
    fprintf(json, "\"primitives\":[");
    for (uint32_t i = 0; i < g->count; ++i) {
        if (!fct_glb_primitive_faces(w->content.geometries + k, i)) continue;
        if (!first) fputc(',', json);
        print_primitive(w, k, i, json_array_get(primitives, d->parts[g->first + i].primitive), json);
        first = false;
    }
    fprintf(json, "]}");
    json_decref(mesh);
}

/* The root has members: copy_document gives it an asset. */
static size_t print_document(void *user, FILE *json) {
    writing *w = user;
    fct_gltf_print_open(w->root, json, &w->failed);
    for (size_t k = 0; k < w->content.geometry_count; ++k) {
        fputs(k ? "," : ",\"meshes\":[", json);
        print_mesh(w, k, json);
    }
    if (w->content.geometry_count) fputc(']', json);
    size_t size = fct_glb_print_content(&w->content, json);
    fputc('}', json);
    return size;
}

static fct_result produce(void *user, FILE *stream) {
    writing *w = user;
    fct_sink sink = {w->gltf->env, w->path, w->mesh, w->def, NULL};
    fct_result result = fct_glb_write_file(&sink, &w->content, print_document, w, stream);
    return result == FCT_OK && w->failed ? fail_json(w->gltf) : result;
}

static void release_writing(writing *w) {
    const fct_env *env = w->gltf->env;
    for (size_t k = 0; k < w->content.geometry_count; ++k) {
        fct_glb_layout_release(env, &w->content.geometries[k].layout);
        fct_mesh_release(env, w->meshes + k);
    }
    fct_gltf_release_images(env, &w->images);
    fct_release(env, w->meshes);
    fct_release(env, w->groups);
    fct_release(env, w->content.geometries);
    json_decref(w->root);
}

static fct_result check_arguments(const fct_gltf *d, const char *path, const fct_mesh *mesh,
                                  const fct_mesh_save_def *def) {
    const char *dot = strrchr(path, '.');
    if (def->size != sizeof *def || !(def->exposure >= 0))
        return fct_fail(d->env, FCT_ERROR_DATA, "%s: a save def of another version, or a negative exposure",
                        path);
    if (!dot || strcasecmp(dot, ".glb") != 0)
        return fct_fail(d->env, FCT_ERROR_DATA, "%s: a glTF document is written as .glb", path);
    fct_result result = fct_mesh_check(d->env, path, mesh);
    if (result != FCT_OK) return result;
    if (!mesh->materials && mesh->face_count)
        return fct_fail(d->env, FCT_ERROR_DATA, "%s: the mesh has no materials", path);
    for (uint32_t f = 0; f < mesh->face_count; ++f)
        if (mesh->materials[f] >= d->part_count)
            return fct_fail(d->env, FCT_ERROR_DATA, "%s: face %u has material %u of %u", path, f,
                            mesh->materials[f], d->part_count);
    return FCT_OK;
}

fct_result fct_gltf_save(fct_gltf *d, const char *path, const fct_mesh *mesh, const fct_mesh_save_def *def) {
    fct_mesh_save_def standard = fct_mesh_save_def_default();
    if (!def) def = &standard;
    fct_result result = check_arguments(d, path, mesh, def);
    if (result != FCT_OK) return result;
    writing w = {.gltf = d, .def = def, .path = path, .mesh = mesh};
    result = make_geometries(&w);
    if (result == FCT_OK) result = copy_document(&w);
    if (result == FCT_OK) result = fct_gltf_store_images(d, w.root, fct_glb_number(&w.content), &w.images);
    w.content.blobs = w.images.blobs, w.content.blob_count = w.images.count;
    if (result == FCT_OK) result = fct_sink_write(d->env, path, produce, &w);
    release_writing(&w);
    return result;
}
