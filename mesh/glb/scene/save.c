/* mesh/glb/scene/save.c: writes a document with lit meshes: one mesh per node that has pieces, one geometry
 * and one primitive per piece. */
#include <string.h>
#include <strings.h>

#include "mesh/glb/scene/pieces.h"
#include "mesh/save.h"

typedef struct writing {
    fct_glb_scene *scene;
    const char *path;
    const fct_mesh_save_def *def;
    fct_mesh *shown; /* per piece: its mesh with the colours for display */
    size_t *next;    /* per piece: the next piece of its node, or its own number */
    size_t *firsts;  /* per mesh of the output: its first piece */
    size_t mesh_count;
    fct_glb_content content;
    fct_gltf_images images;
    bool failed; /* memory for text was exhausted */
} writing;

static fct_result fail_json(const fct_glb_scene *s) {
    return fct_fail_memory(s->env, "the JSON of a glTF file");
}

/* Gives each node with pieces a mesh number, in the order of the pieces, and removes the meshes of others. */
static fct_result number_meshes(writing *w) {
    fct_glb_scene *s = w->scene;
    json_t *nodes = json_object_get(s->root, "nodes"), *node;
    const size_t node_count = json_array_size(nodes);
    size_t i, *last = fct_allocate(s->env, node_count, sizeof *last);
    if (!last) return fct_fail_memory(s->env, "a glTF file");
    memset(last, 0xff, node_count * sizeof *last);
    json_array_foreach(nodes, i, node) json_object_del(node, "mesh");
    fct_result result = FCT_OK;
    for (i = 0; i < s->piece_count && result == FCT_OK; ++i) {
        const size_t n = s->pieces[i].node;
        w->next[i] = i;
        if (n >= node_count) {
            result = fct_fail(s->env, FCT_ERROR_DATA, "%s: node %zu of %zu does not exist", w->path, n,
                              node_count);
        } else if (last[n] != SIZE_MAX) {
            w->next[last[n]] = i;
        } else {
            w->firsts[w->mesh_count] = i;
            if (json_object_set_new(json_array_get(nodes, n), "mesh",
                                    json_integer((json_int_t)w->mesh_count++)))
                result = fail_json(s);
        }
        if (n < node_count) last[n] = i;
    }
    fct_release(s->env, last);
    return result;
}

static fct_result make_geometries(writing *w) {
    fct_glb_scene *s = w->scene;
    const fct_array arrays[] = {FCT_ARRAY(w->shown, s->piece_count), FCT_ARRAY(w->next, s->piece_count),
                                FCT_ARRAY(w->firsts, s->piece_count),
                                FCT_ARRAY_ZERO(w->content.geometries, s->piece_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "the meshes of a glTF file");
    for (size_t i = 0; i < s->piece_count && result == FCT_OK; ++i) {
        const fct_glb_piece *p = s->pieces + i;
        w->shown[i] = p->lit;
        result = fct_choose_display(s->env, w->path, &p->lit, w->def->display, &w->shown[i].colors);
        w->content.geometries[i] = (fct_glb_geometry){.mesh = w->shown + i,
                                                      .layout = {.vertex_count = p->lit.vertex_count},
                                                      .light = w->def->no_radiosity ? NULL : p->lit.colors,
                                                      .light_name = "_RADIOSITY",
                                                      .color_name = p->color_name,
                                                      .extras = p->extras,
                                                      .extra_count = p->extra_count};
    }
    w->content.geometry_count = s->piece_count;
    return result == FCT_OK ? number_meshes(w) : result;
}

/* The members of a primitive that the output keeps. */
static json_t *copy_primitive(const fct_glb_scene *s, const fct_glb_piece *p) {
    static const char *const replaced[] = {"attributes", "indices", "mode", "targets"};
    json_t *copy;
    if (p->primitive == FCT_GLB_ABSENT) {
        copy = json_object();
    } else {
        json_t *mesh = json_array_get(json_object_get(s->document->glb.root, "meshes"), (size_t)p->mesh);
        copy = json_deep_copy(json_array_get(json_object_get(mesh, "primitives"), (size_t)p->primitive));
        for (size_t r = 0; r < FCT_LENGTH(replaced); ++r) json_object_del(copy, replaced[r]);
        fct_gltf_remove_extension(copy, "KHR_draco_mesh_compression");
    }
    if (copy && p->material != FCT_GLB_ABSENT &&
        json_object_set_new(copy, "material", json_integer((json_int_t)p->material))) {
        json_decref(copy);
        return NULL;
    }
    return copy;
}

/* The members of a mesh that the output keeps. */
static json_t *copy_mesh(const fct_glb_scene *s, const fct_glb_piece *p) {
    if (p->mesh == FCT_GLB_ABSENT) {
        json_t *name = json_string(p->name);
        return name ? json_pack("{s:o}", "name", name) : NULL;
    }
    json_t *copy =
        json_deep_copy(json_array_get(json_object_get(s->document->glb.root, "meshes"), (size_t)p->mesh));
    json_object_del(copy, "primitives");
    json_object_del(copy, "weights");
    return copy;
}

static void print_object(writing *w, json_t *object, FILE *json) {
    if (fct_gltf_print_open(object, json, &w->failed)) fputc(',', json);
    json_decref(object);
}

static void print_mesh(writing *w, size_t first, FILE *json) {
    print_object(w, copy_mesh(w->scene, w->scene->pieces + first), json);
    fprintf(json, "\"primitives\":[");
    for (size_t i = first;; i = w->next[i]) {
        print_object(w, copy_primitive(w->scene, w->scene->pieces + i), json);
        fct_glb_print_primitive(w->content.geometries + i, 0, json);
        fputc('}', json);
        if (w->next[i] == i) break;
        fputc(',', json);
    }
    fprintf(json, "]}");
}

static size_t print_document(void *user, FILE *json) {
    writing *w = user;
    fct_gltf_print_open(w->scene->root, json, &w->failed);
    for (size_t k = 0; k < w->mesh_count; ++k) {
        fputs(k ? "," : ",\"meshes\":[", json);
        print_mesh(w, w->firsts[k], json);
    }
    if (w->mesh_count) fputc(']', json);
    size_t size = fct_glb_print_content(&w->content, json);
    fputc('}', json);
    return size;
}

static fct_result produce(void *user, FILE *stream) {
    writing *w = user;
    fct_sink sink = {w->scene->env, w->path, NULL, w->def, NULL};
    fct_result result = fct_progress(w->scene->env, "write", 0);
    if (result == FCT_OK) result = fct_glb_write_file(&sink, &w->content, print_document, w, stream);
    return result == FCT_OK && w->failed ? fail_json(w->scene) : result;
}

fct_result fct_glb_scene_save(fct_glb_scene *s, const char *path, const fct_mesh_save_def *def) {
    const char *dot = strrchr(path, '.');
    if (def->size != sizeof *def || !(def->exposure >= 0))
        return fct_fail(s->env, FCT_ERROR_DATA, "%s: a save def of another version, or a negative exposure",
                        path);
    if (!dot || strcasecmp(dot, ".glb") != 0)
        return fct_fail(s->env, FCT_ERROR_DATA, "%s: a scene is written as .glb", path);
    if (s->lost)
        fct_glb_warn(&s->document->glb,
                     "%zu attributes of primitives cannot be kept (matrices, or more than %d)", s->lost,
                     FCT_GLB_EXTRAS);
    writing w = {.scene = s, .path = path, .def = def};
    fct_result result = make_geometries(&w);
    if (result == FCT_OK && s->document)
        result = fct_gltf_store_images(s->document, s->root, fct_glb_number(&w.content), &w.images);
    else if (result == FCT_OK)
        fct_glb_number(&w.content);
    w.content.blobs = w.images.blobs, w.content.blob_count = w.images.count;
    if (result == FCT_OK) result = fct_sink_write(s->env, path, produce, &w);
    fct_gltf_release_images(s->env, &w.images);
    fct_release(s->env, w.shown), fct_release(s->env, w.next), fct_release(s->env, w.firsts);
    fct_release(s->env, w.content.geometries);
    return result;
}
