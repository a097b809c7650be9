/* radiosity/objects.c: lit meshes of instances, objects and whole scenes. */
#include <string.h>

#include "base/env.h"
#include "radiosity/bake.h"
#include "radiosity/output/keep.h"

static const fct_scene_view *view_of(const fct_bake *bake) {
    return &fct_bake_solution(bake)->elements.view;
}

void fct_bake_parts(const fct_scene_view *view, uint32_t object, uint32_t *first, uint32_t *count) {
    uint32_t low = 0, high = view->instance_count; /* objects are in ascending order */
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        *(view->instances[middle].object < object ? &low : &high) =
            middle + (view->instances[middle].object < object);
    }
    *first = low, *count = 0;
    while (low + *count < view->instance_count && view->instances[low + *count].object == object) ++*count;
}

fct_normals fct_bake_get_normals(const fct_bake *bake, uint32_t object) {
    const fct_solution *s = fct_bake_solution(bake);
    uint32_t first, count;
    fct_bake_parts(&s->elements.view, object, &first, &count);
    fct_normals rule = FCT_NORMALS_CREASE;
    for (uint32_t i = first; i < first + count; ++i) {
        rule = fct_solution_shading(s, i, false).rule;
        if (rule == FCT_NORMALS_FILE) break;
    }
    return rule;
}

/* The parts [first, first + count) of an object in the order of the mesh as it was added. */
static fct_result keep_parts(fct_bake *bake, uint32_t first, uint32_t count, fct_mesh *out) {
    const fct_solution *s = fct_bake_solution(bake);
    fct_mesh *lit = fct_allocate_zero(s->env, count, sizeof *lit);
    if (!lit) return fct_fail_memory(s->env, "the lit mesh");
    fct_result result = FCT_OK;
    for (uint32_t p = 0; p < count && result == FCT_OK; ++p) {
        fct_mesh sides[2];
        bool back[2];
        uint32_t one;
        result = fct_bake_sides(bake, first + p, sides, back, &one);
        lit[p] = sides[0];
    }
    if (result == FCT_OK)
        result = fct_keep_merge(s->env, &s->elements.view, first, count, s->def.keep, lit, out);
    for (uint32_t p = 0; p < count; ++p) fct_mesh_release(s->env, &lit[p]);
    fct_release(s->env, lit);
    return result;
}

static fct_result join_sides(fct_bake *bake, uint32_t instance, fct_mesh *out) {
    const fct_env *env = fct_bake_solution(bake)->env;
    fct_mesh sides[2] = {{0}, {0}};
    bool back[2];
    uint32_t count = 0;
    fct_result result = fct_bake_sides(bake, instance, sides, back, &count);
    if (result == FCT_OK && count == 2) {
        result = fct_mesh_join(env, sides, 2, out);
    } else if (result == FCT_OK) {
        *out = sides[0];
        sides[0] = (fct_mesh){0};
    }
    for (int k = 0; k < 2; ++k) fct_mesh_release(env, &sides[k]);
    return result;
}

fct_result fct_bake_instance(fct_bake *bake, uint32_t instance, fct_mesh *out) {
    const fct_solution *s = fct_bake_solution(bake);
    const fct_instance *i = &s->elements.view.instances[instance];
    const bool kept = s->def.keep != FCT_KEEP_NONE;
    uint32_t first, count;
    *out = (fct_mesh){0};
    fct_bake_parts(&s->elements.view, i->object, &first, &count);
    if (kept && count > 1)
        return fct_fail(s->env, FCT_ERROR_DATA,
                        "instance %u is a part of object \"%s\", which is kept as a whole", instance,
                        i->name);
    fct_result result = kept ? keep_parts(bake, first, 1, out) : join_sides(bake, instance, out);
    fct_bake_drop_normals(s, out);
    return result;
}

fct_result fct_bake_join(const fct_env *env, fct_mesh *parts, uint32_t count, fct_result result,
                         fct_mesh *out) {
    if (result == FCT_OK && count == 1) {
        *out = parts[0];
        parts[0] = (fct_mesh){0};
    } else if (result == FCT_OK) {
        result = fct_mesh_join(env, parts, count, out);
    }
    for (uint32_t p = 0; p < count; ++p) fct_mesh_release(env, &parts[p]);
    fct_release(env, parts);
    return result;
}

fct_result fct_bake_lit_object(fct_bake *bake, uint32_t object, fct_mesh *out) {
    const fct_solution *s = fct_bake_solution(bake);
    uint32_t first, count;
    *out = (fct_mesh){0};
    fct_bake_parts(&s->elements.view, object, &first, &count);
    if (s->def.keep != FCT_KEEP_NONE) return keep_parts(bake, first, count, out);
    fct_mesh *parts = fct_allocate_zero(s->env, count, sizeof *parts);
    if (!parts) return fct_fail_memory(s->env, "the lit mesh");
    fct_result result = FCT_OK;
    for (uint32_t p = 0; p < count && result == FCT_OK; ++p) result = join_sides(bake, first + p, &parts[p]);
    return fct_bake_join(s->env, parts, count, result, out);
}

fct_result fct_bake_object(fct_bake *bake, uint32_t object, fct_mesh *out) {
    fct_result result = fct_bake_lit_object(bake, object, out);
    fct_bake_drop_normals(fct_bake_solution(bake), out);
    return result;
}

void fct_bake_drop_normals(const fct_solution *s, fct_mesh *mesh) {
    if (s->def.outputs & FCT_MESH_NORMALS) return;
    fct_release(s->env, mesh->normals);
    mesh->normals = NULL;
}

void fct_bake_drop_sources(const fct_env *env, fct_mesh *mesh) {
    fct_release(env, mesh->source_faces);
    fct_release(env, mesh->source_uv);
    mesh->source_faces = NULL, mesh->source_uv = NULL;
}

/* The number of faces of each instance: those of the lit parts, or of the models. */
static void count_faces(const fct_scene_view *view, const fct_mesh *parts, bool kept, uint32_t *out) {
    for (uint32_t i = 0; i < view->instance_count; ++i)
        out[i] =
            kept ? fct_tree_get(view->models[view->instances[i].model].tree).face_count : parts[i].face_count;
}

fct_result fct_bake_mesh(fct_bake *bake, fct_mesh *out, uint32_t *face_counts) {
    const fct_solution *s = fct_bake_solution(bake);
    const fct_scene_view *view = view_of(bake);
    const bool kept = s->def.keep != FCT_KEEP_NONE;
    const uint32_t count = kept ? view->object_count : view->instance_count;
    *out = (fct_mesh){0};
    fct_mesh *parts = fct_allocate_zero(s->env, count, sizeof *parts);
    if (!parts) return fct_fail_memory(s->env, "the lit mesh");
    fct_result result = FCT_OK;
    for (uint32_t i = 0; i < count && result == FCT_OK; ++i) {
        result = kept ? fct_bake_object(bake, i, &parts[i]) : join_sides(bake, i, &parts[i]);
        if (!s->def.sources) fct_bake_drop_sources(s->env, &parts[i]);
        fct_bake_drop_normals(s, &parts[i]);
    }
    if (result == FCT_OK && face_counts) count_faces(view, parts, kept, face_counts);
    return fct_bake_join(s->env, parts, count, result, out);
}
