/* radiosity/scene.c: writes a lit scene as a glTF document that keeps its nodes.
 *
 * For each object: light its instances, move them from the world into the space of the object's node, and
 * hand them to the document (mesh/glb/scene/), which keeps the one copy of them. A vertex of the model gets
 * the position that it has there; only new vertices go through the inverse transform.
 */
#include <string.h>

#include "mesh/glb/scene/scene.h"
#include "mesh/mesh.h"
#include "radiosity/bake.h"
#include "scene/scene.h"
#include "scene/transform.h"

typedef struct saving {
    fct_bake *bake;
    const fct_solution *s;
    const fct_scene_view *view;
    bool document; /* the nodes and materials are those of a file */
    fct_glb_scene *out;
    fct_mesh *merged; /* copies of the lit meshes, or NULL */
    uint32_t merged_count;
    size_t merged_capacity;
} saving;

/* The node of an object. */
typedef struct place {
    uint32_t node;
    int64_t mesh;     /* of the document */
    bool world;       /* its space is that of the world */
    double origin[3]; /* of its space, in the space of the models' files */
} place;

static const fct_scene_model *own_model(const saving *w, uint32_t instance) {
    return w->s->scene->own + w->view->instances[instance].model;
}

/* ---- The document ---- */

static fct_result add_materials(const saving *w) {
    fct_result result = FCT_OK;
    for (uint32_t m = 0; m < w->view->material_count && result == FCT_OK; ++m) {
        const fct_material *from = &w->view->materials[m];
        const fct_glb_paint paint = {from->name, from->reflectance, from->emission, from->two_sided};
        result = fct_glb_scene_add_material(w->out, &paint);
    }
    const fct_camera *c = &w->view->camera;
    if (result != FCT_OK || !c->given) return result;
    double position[3];
    float forward[3];
    for (int k = 0; k < 3; ++k) {
        position[k] = w->view->origin[k] + (double)c->position[k];
        forward[k] = c->target[k] - c->position[k];
    }
    return fct_glb_scene_add_camera(w->out, position, forward, c->up, (double)c->vertical_fov);
}

/* A node with the transform of the object's first part. A transform with shear has no place in a node. */
static fct_result make_place(const saving *w, uint32_t first, place *out) {
    const fct_instance *i = &w->view->instances[first];
    double m[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (int k = 0; k < 12; ++k)
        m[k] = k % 4 == 3 ? w->s->scene->frames[first].at[k / 4] : (double)i->to_world[k];
    out->world = !fct_glb_scene_can_place(m);
    for (int r = 0; out->world && r < 3; ++r)
        for (int c = 0; c < 4; ++c) m[4 * r + c] = c == 3 ? w->view->origin[r] : r == c;
    memcpy(out->origin, own_model(w, first)->origin, sizeof out->origin);
    out->mesh = -1;
    return fct_glb_scene_add_node(w->out, i->name, m, &out->node);
}

static fct_result find_place(const saving *w, uint32_t object, uint32_t first, place *out) {
    const fct_scene_object *o = &w->s->scene->objects[object];
    *out = (place){.mesh = o->mesh};
    if (!w->document) return make_place(w, first, out);
    if (o->mesh < 0)
        return fct_fail(w->s->env, FCT_ERROR_DATA, "object \"%s\" was not read from the glTF file",
                        w->view->instances[first].name);
    if (o->node < 0) return fct_glb_scene_add_node(w->out, w->view->instances[first].name, NULL, &out->node);
    out->node = (uint32_t)o->node;
    return FCT_OK;
}

/* ---- Lit meshes ---- */

/* The face of the model that is face `source` of the mesh as it was added. */
static uint32_t find_face(const fct_model *model, uint32_t source) {
    if (!model->source_faces) return source;
    uint32_t low = 0, high = fct_tree_get(model->tree).face_count; /* source_faces ascend */
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        *(model->source_faces[middle] <= source ? &low : &high) = middle;
    }
    return low;
}

/* The corner of the source face that uv is, or 3. */
static uint32_t find_corner(const float *uv) {
    if (uv[0] == 0) return uv[1] == 0 ? 0 : uv[1] == 1 ? 2 : 3;
    return uv[0] == 1 && uv[1] == 0 ? 1 : 3;
}

/* Turns the normals of a lit mesh into the space of the node: with the transposed transform. */
static void turn_to_node(const saving *w, uint32_t instance, fct_mesh *mesh) {
    const float *m = w->view->instances[instance].to_world;
    for (size_t v = 0; mesh->normals && v < mesh->vertex_count; ++v) {
        float *n = mesh->normals + 3 * v;
        const double x = n[0], y = n[1], z = n[2];
        v3_store(n, v3_unit(v3_make(m[0] * x + m[4] * y + m[8] * z, m[1] * x + m[5] * y + m[9] * z,
                                    m[2] * x + m[6] * y + m[10] * z)));
    }
}

/* Moves the positions of a lit mesh into the space of the node. */
static void move_to_node(const saving *w, uint32_t instance, const place *at, const fct_mesh *own,
                         fct_mesh *mesh) {
    const fct_model *model = w->view->models + w->view->instances[instance].model;
    const double *inverse = w->s->scene->frames[instance].to_model, *origin = own_model(w, instance)->origin;
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        float *p = mesh->positions + 3 * v;
        const double x = p[0], y = p[1], z = p[2];
        for (int r = 0; r < 3; ++r) {
            const double *m = inverse + 4 * r;
            p[r] = (float)(m[0] * x + m[1] * y + m[2] * z + m[3] + (origin[r] - at->origin[r]));
        }
    }
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c) {
        const uint32_t k = find_corner(mesh->source_uv + 2 * c);
        if (k == 3) continue;
        const size_t face = find_face(model, mesh->source_faces[c / 3]);
        const float *from = own->positions + 3 * (size_t)own->triangles[3 * face + k];
        float *p = mesh->positions + 3 * (size_t)mesh->triangles[c];
        for (int r = 0; r < 3; ++r) p[r] = (float)((double)from[r] + (origin[r] - at->origin[r]));
    }
    if (w->view->instances[instance].mirrored) fct_mesh_turn_over(mesh);
}

/* The vertices of each face's source in the mesh as it was added. */
static uint32_t *list_corners(const saving *w, uint32_t instance, const fct_mesh *own, const fct_mesh *mesh) {
    const fct_model *model = w->view->models + w->view->instances[instance].model;
    uint32_t *corners = fct_allocate(w->s->env, mesh->face_count, 3 * sizeof *corners);
    for (size_t f = 0; corners && f < mesh->face_count; ++f) {
        const uint32_t *t = own->triangles + 3 * (size_t)find_face(model, mesh->source_faces[f]);
        for (size_t k = 0; k < 3; ++k)
            corners[3 * f + k] = model->source_vertices ? model->source_vertices[t[k]] : t[k];
    }
    return corners;
}

/* Adds the lit mesh of an instance and takes it. both: the other side has its own mesh. */
static fct_result add_lit(const saving *w, uint32_t instance, const place *at, bool both, bool back,
                          fct_mesh *mesh) {
    const fct_instance *i = &w->view->instances[instance];
    const fct_env *env = w->s->env;
    fct_mesh own = {0};
    uint32_t *corners = NULL;
    fct_result result = fct_tree_mesh(env, w->view->models[i->model].tree, &own);
    if (result == FCT_OK && !at->world) {
        move_to_node(w, instance, at, &own, mesh);
        turn_to_node(w, instance, mesh);
    }
    if (result == FCT_OK && w->document && !(corners = list_corners(w, instance, &own, mesh)))
        result = fct_fail_memory(env, "a lit mesh");
    fct_mesh_release(env, &own);
    const fct_glb_lit lit = {.node = at->node,
                             .name = w->view->models[i->model].name,
                             .mesh = at->mesh,
                             .material = i->material,
                             .one_sided = both,
                             .back = back,
                             .file_normals = /* bit for bit */
                             fct_solution_shading(w->s, instance, back).rule == FCT_NORMALS_FILE,
                             .corners = corners};
    if (result == FCT_OK) result = fct_glb_scene_add_lit(w->out, &lit, mesh);
    fct_mesh_release(env, mesh);
    fct_release(env, corners);
    return result;
}

/* Keeps a copy of a lit mesh in the world for w->merged. */
static fct_result keep_copy(saving *w, const fct_mesh *mesh) {
    const fct_env *env = w->s->env;
    if (!w->merged) return FCT_OK;
    fct_result result = fct_grow(env, (void **)&w->merged, &w->merged_capacity, (size_t)w->merged_count + 1,
                                 sizeof *w->merged);
    if (result == FCT_OK) result = fct_mesh_copy(env, mesh, &w->merged[w->merged_count]);
    if (result != FCT_OK) return result;
    if (!w->s->def.sources) fct_bake_drop_sources(env, &w->merged[w->merged_count]);
    fct_bake_drop_normals(w->s, &w->merged[w->merged_count]);
    ++w->merged_count;
    return FCT_OK;
}

static fct_result save_sides(saving *w, uint32_t instance, const place *at) {
    fct_mesh sides[2];
    bool back[2];
    uint32_t count;
    fct_result result = fct_bake_sides(w->bake, instance, sides, back, &count);
    for (uint32_t k = 0; k < count && result == FCT_OK; ++k) {
        result = keep_copy(w, &sides[k]);
        if (result == FCT_OK) result = add_lit(w, instance, at, count == 2, back[k], &sides[k]);
    }
    for (uint32_t k = 0; k < 2; ++k) fct_mesh_release(w->s->env, &sides[k]);
    return result;
}

/* ---- Kept meshes: those of FCT_KEEP_VERTEX and FCT_KEEP_FACE belong to whole objects ---- */

/* Gives each face its own vertices with its colour. */
static fct_result spread_faces(const fct_env *env, fct_mesh *mesh) {
    const size_t corners = 3 * (size_t)mesh->face_count;
    fct_mesh spread;
    if (corners > FCT_MESH_LIMIT)
        return fct_fail(env, FCT_ERROR_MEMORY, "%u faces with three vertices each are too many",
                        mesh->face_count);
    fct_result result = fct_mesh_create(
        env, (uint32_t)corners, mesh->face_count,
        FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_SOURCE_FACES | FCT_MESH_SOURCE_UV, &spread);
    if (result != FCT_OK) return result;
    for (size_t c = 0; c < corners; ++c) {
        const size_t v = 3 * (size_t)mesh->triangles[c];
        spread.triangles[c] = (uint32_t)c;
        memcpy(spread.positions + 3 * c, mesh->positions + v, 3 * sizeof(float));
        memcpy(spread.normals + 3 * c, mesh->normals + v, 3 * sizeof(float));
        memcpy(spread.colors + 3 * c, mesh->face_colors + c / 3 * 3, 3 * sizeof(float));
    }
    memcpy(spread.source_faces, mesh->source_faces, mesh->face_count * sizeof *spread.source_faces);
    memcpy(spread.source_uv, mesh->source_uv, 2 * corners * sizeof *spread.source_uv);
    fct_mesh_release(env, mesh);
    *mesh = spread;
    return FCT_OK;
}

/* The faces of one part of a kept object. */
static fct_result extract_part(const saving *w, uint32_t instance, const fct_mesh *object, fct_mesh *out) {
    const fct_model *model = w->view->models + w->view->instances[instance].model;
    const uint32_t count = fct_tree_get(model->tree).face_count;
    uint32_t *faces = fct_allocate(w->s->env, count, sizeof *faces);
    if (!faces) return fct_fail_memory(w->s->env, "a lit mesh");
    for (uint32_t f = 0; f < count; ++f) faces[f] = model->source_faces ? model->source_faces[f] : f;
    fct_result result = fct_mesh_extract(w->s->env, object, faces, count, out, NULL);
    fct_release(w->s->env, faces);
    if (result == FCT_OK && out->face_colors) result = spread_faces(w->s->env, out);
    if (result != FCT_OK) fct_mesh_release(w->s->env, out);
    return result;
}

static fct_result save_kept(saving *w, uint32_t object, uint32_t first, uint32_t count, const place *at) {
    fct_mesh mesh, part;
    fct_result result = fct_bake_lit_object(w->bake, object, &mesh);
    if (result == FCT_OK) result = keep_copy(w, &mesh);
    for (uint32_t i = first; i < first + count && result == FCT_OK; ++i) {
        result = extract_part(w, i, &mesh, &part);
        if (result == FCT_OK) result = add_lit(w, i, at, false, false, &part);
    }
    fct_mesh_release(w->s->env, &mesh);
    return result;
}

static fct_result save_object(saving *w, uint32_t object) {
    uint32_t first, count;
    place at;
    fct_bake_parts(w->view, object, &first, &count);
    fct_result result = find_place(w, object, first, &at);
    if (result != FCT_OK) return result;
    const fct_keep keep = w->s->def.keep;
    if (keep == FCT_KEEP_VERTEX || keep == FCT_KEEP_FACE || (keep == FCT_KEEP_CORNER && w->merged))
        return save_kept(w, object, first, count, &at);
    for (uint32_t i = first; i < first + count && result == FCT_OK; ++i) result = save_sides(w, i, &at);
    return result;
}

fct_result fct_bake_save_scene(fct_bake *bake, const char *path, const char *document,
                               const fct_mesh_save_def *def, fct_mesh *merged) {
    const fct_solution *s = fct_bake_solution(bake);
    const fct_mesh_save_def standard = fct_mesh_save_def_default();
    saving w = {.bake = bake, .s = s, .view = &s->elements.view, .document = document != NULL};
    fct_result result = FCT_OK;
    if (merged) {
        *merged = (fct_mesh){0};
        result = fct_grow(s->env, (void **)&w.merged, &w.merged_capacity, 1, sizeof *w.merged);
    }
    if (result == FCT_OK) result = fct_glb_scene_create(s->env, document, &w.out);
    if (result == FCT_OK && !document) result = add_materials(&w);
    for (uint32_t o = 0; o < w.view->object_count && result == FCT_OK; ++o) result = save_object(&w, o);
    if (merged) result = fct_bake_join(s->env, w.merged, w.merged_count, result, merged);
    if (result == FCT_OK) result = fct_glb_scene_save(w.out, path, def ? def : &standard);
    if (result != FCT_OK && merged) fct_mesh_release(s->env, merged);
    fct_glb_scene_destroy(w.out);
    return result;
}
