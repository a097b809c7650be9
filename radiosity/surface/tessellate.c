/* radiosity/surface/tessellate.c: see tessellate.h.
 *
 * Rounds of splits until no edge is too long. An edge is too long above max_edge, and near another instance
 * or another part of its own model above the distance to it, but never below max_edge / 4: light changes
 * fastest where surfaces meet. A part in whose plane the edge lies continues the surface and does not count.
 * The test reads only the end points, the part and the scene, so both faces at an edge agree, and so do
 * coinciding edges of unwelded meshes. The oriented boxes of the other tree give the distance.
 */
#include "radiosity/surface/tessellate.h"

#include "base/math/round.h"
#include "base/parallel.h"
#include "cluster/tree/node.h"
#include "radiosity/surface/creases.h"
#include "radiosity/surface/parts.h"
#include "radiosity/surface/split.h"
#include "scene/transform.h"

#include <string.h>

/* Default edges per diagonal of the surfaces that emit no light, since a lamp may be far away. More edges
 * resolve finer shadows; the output's time grows with the square. */
#define DIAGONAL_EDGES 72
/* Longest over shortest edge that a split may leave. Larger: finer contact shadows, more vertices. */
#define GRADES 4
/* A box with a half diagonal below this share of its distance counts as the surface itself. The distance then
 * errs by at most about a third. */
#define SMALL_BOX .35
/* Distance of an edge from a plane, over its length, up to which it lies in the plane. */
#define SAME_PLANE 1e-3
#define STACK_SIZE 288
/* Faces per chunk. */
#define GRAIN 1024

/* The faces of the instance in their present state. */
typedef struct patch {
    const fct_env *env;
    const fct_shading *shading;
    fct_scene_view view;
    uint32_t instance;
    double longest, shortest; /* edges: split above `longest`, never below `shortest` */
    fct_parts parts;          /* of the model */
    double *shrinks;          /* per instance: lower bound of world over model distance */
    uint32_t vertex_count, face_count;
    float *positions;
    uint32_t *triangles, *faces; /* faces: input face of the model's tree */
    float *uv;                   /* face_count x 3 x 2: barycentrics of the corners in that face */
    uint8_t *marks;
    uint8_t *settled; /* per face: an earlier round left it whole */
} patch;

/* Squared distance of a point to the cluster's box. */
static double measure_box_distance2(const fct_cluster *cluster, v3 p) {
    fct_box box;
    fct_cluster_box(cluster, &box);
    v3 d = v3_sub(p, v3_load(box.center));
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        double out = fabs(v3_dot(d, v3_load(box.axes[k]))) - box.half[k];
        if (out > 0) sum += out * out;
    }
    return sum;
}

/* The parts of a model beside that of an edge (model space). */
typedef struct other_parts {
    const uint32_t *labels; /* fct_parts.nodes */
    uint32_t own;
    v3 ends[2];
} other_parts;

/* Whether a cluster is flat and its plane holds the edge. */
static bool continues_surface(const fct_cluster *c, const v3 ends[2]) {
    const double most = SAME_PLANE * v3_norm(v3_sub(ends[1], ends[0]));
    const float *h = c->box_half;
    if (fct_min(h[0], fct_min(h[1], h[2])) > most) return false;
    for (int k = 0; k < 2; ++k)
        if (fabs(v3_dot(v3_load(c->plane), ends[k]) + c->plane[3]) > most) return false;
    return true;
}

/* True if the tree comes within `distance` of p (model space), to about a third of the distance. others:
 * NULL, or the tree is that of the edge itself. */
static bool tree_is_near(const fct_tree *tree, v3 p, double distance, const other_parts *others) {
    fct_tree_view view = fct_tree_get(tree);
    uint32_t stack[STACK_SIZE];
    double d2 = distance * distance, small2 = SMALL_BOX * SMALL_BOX * d2;
    for (uint32_t r = 0; r < view.root_count; ++r) {
        uint32_t top = 1;
        stack[0] = view.roots[r];
        while (top) {
            uint32_t node = stack[--top];
            if (others && others->labels[node] == others->own) continue;
            fct_cluster room;
            const fct_cluster *c = fct_node_cluster(tree, node, &room);
            if (measure_box_distance2(c, p) > d2) continue;
            bool small = node >= view.node_count || v3_norm2(v3_load(c->box_half)) < small2;
            if (others && others->labels[node] == FCT_NONE) small = false;
            if (others && small && continues_surface(c, others->ends)) continue;
            if (small || top + 2 > STACK_SIZE) return true;
            stack[top++] = fct_node_child(tree, node, 1);
            stack[top++] = fct_node_child(tree, node, 0);
        }
    }
    return false;
}

static bool bounds_are_near(const fct_bounds *bounds, const double p[3], double distance) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        double out = fct_max(bounds->lower[k] - p[k], p[k] - bounds->upper[k]);
        if (out > 0) sum += out * out;
    }
    return sum <= distance * distance;
}

/* True if another instance comes within `distance` of the point. */
static bool others_are_near(const patch *c, v3 point, double distance) {
    uint32_t stack[STACK_SIZE], top = 0;
    const double p[3] = {point.x, point.y, point.z};
    if (c->view.volume_count) stack[top++] = 0;
    while (top) {
        const fct_volume *volume = c->view.volumes + stack[--top];
        if (volume->instance == c->instance || !bounds_are_near(&volume->bounds, p, distance)) continue;
        if (volume->instance == FCT_NONE) {
            if (top + 2 > STACK_SIZE) return true;
            stack[top++] = volume->child[1];
            stack[top++] = volume->child[0];
            continue;
        }
        const fct_instance *other = c->view.instances + volume->instance;
        v3 local = fct_transform_point(other->to_model, point);
        double shrink = c->shrinks[volume->instance];
        if (tree_is_near(c->view.models[other->model].tree, local, shrink > 0 ? distance / shrink : INFINITY,
                         NULL))
            return true;
    }
    return false;
}

/* True if another part of the model comes within `distance` of the middle of the edge a, b of `part`. */
static bool parts_are_near(const patch *c, uint32_t part, v3 a, v3 b, double distance) {
    if (!c->parts.nodes) return false;
    const fct_instance *own = c->view.instances + c->instance;
    const other_parts others = {
        c->parts.nodes, part, {fct_transform_point(own->to_model, a), fct_transform_point(own->to_model, b)}};
    const v3 middle = v3_scale(v3_add(others.ends[0], others.ends[1]), .5);
    const double shrink = c->shrinks[c->instance];
    return tree_is_near(c->view.models[own->model].tree, middle, shrink > 0 ? distance / shrink : INFINITY,
                        &others);
}

/* part: of the face, if the model has several. */
static bool edge_is_too_long(const patch *c, uint32_t part, uint32_t va, uint32_t vb) {
    v3 a = v3_load(c->positions + 3 * (size_t)va), b = v3_load(c->positions + 3 * (size_t)vb);
    double length = v3_norm(v3_sub(b, a));
    if (!(length > c->shortest)) return false;
    v3 middle = v3_scale(v3_add(a, b), .5);
    v3 rounded = v3_round(middle); /* a midpoint that rounds to an end cannot split the edge */
    if (v3_norm2(v3_sub(rounded, a)) == 0 || v3_norm2(v3_sub(rounded, b)) == 0) return false;
    return length > c->longest || others_are_near(c, middle, length) || parts_are_near(c, part, a, b, length);
}

static void mark_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const patch *c = user;
    for (size_t f = begin; f < end; ++f) {
        c->marks[f] = 0;
        if (c->settled[f]) continue;
        const uint32_t *t = c->triangles + 3 * f, part = c->parts.faces ? c->parts.faces[c->faces[f]] : 0;
        for (int k = 0; k < 3; ++k)
            if (edge_is_too_long(c, part, t[k], t[k == 2 ? 0 : k + 1])) c->marks[f] |= (uint8_t)(1 << k);
        c->settled[f] = c->marks[f] == 0;
    }
}

/* Copies the positions and appends the midpoints. */
static fct_result add_midpoints(const fct_env *env, const float *old, uint32_t old_count,
                                const fct_split *split, float **out) {
    float *positions = fct_allocate(env, (size_t)old_count + split->vertex_count, 3 * sizeof *positions);
    if (!positions) return fct_fail_memory(env, "split triangles");
    memcpy(positions, old, 3 * (size_t)old_count * sizeof *positions);
    for (size_t i = 0; i < split->vertex_count; ++i) {
        v3 a = v3_load(old + 3 * (size_t)split->ends[2 * i]),
           b = v3_load(old + 3 * (size_t)split->ends[2 * i + 1]);
        v3_store(positions + 3 * (old_count + i), v3_scale(v3_add(a, b), .5));
    }
    *out = positions;
    return FCT_OK;
}

/* Replaces the faces by their parts. */
static fct_result apply_split(patch *c, fct_split *split) {
    static const double halves[3] = {.5, .5, .5};
    const fct_env *env = c->env;
    float *positions = NULL, *uv;
    uint32_t *faces;
    uint8_t *marks, *settled;
    const size_t count = split->face_count;
    const fct_array arrays[] = {FCT_ARRAY(faces, count), FCT_ARRAY(uv, 6 * count), FCT_ARRAY(marks, count),
                                FCT_ARRAY(settled, count)};
    fct_result result = fct_allocate_all(env, arrays, FCT_LENGTH(arrays), "split triangles");
    if (result != FCT_OK) return result;
    result = add_midpoints(env, c->positions, c->vertex_count, split, &positions);
    if (result != FCT_OK) {
        fct_release_all(env, arrays, FCT_LENGTH(arrays));
        return result;
    }
    for (size_t f = 0; f < split->face_count; ++f) {
        faces[f] = c->faces[split->parents[f]];
        settled[f] = c->settled[split->parents[f]];
        fct_split_uv(split, f, c->uv + 6 * (size_t)split->parents[f], halves, uv + 6 * f);
    }
    fct_release(env, c->positions), fct_release(env, c->triangles), fct_release(env, c->faces);
    fct_release(env, c->uv), fct_release(env, c->marks), fct_release(env, c->settled);
    c->positions = positions, c->faces = faces, c->uv = uv, c->marks = marks, c->settled = settled;
    c->triangles = split->triangles;
    split->triangles = NULL;
    c->face_count = split->face_count;
    c->vertex_count += split->vertex_count;
    return FCT_OK;
}

static fct_result split_long_edges(patch *c) {
    for (;;) {
        fct_parallel_for(c->env, c->face_count, GRAIN, mark_faces, c);
        bool any = false;
        for (size_t f = 0; f < c->face_count && !any; ++f) any = c->marks[f] != 0;
        if (!any) return FCT_OK;
        fct_split split;
        fct_result result = fct_split_edges(c->env, c->vertex_count, c->positions, c->face_count,
                                            c->triangles, c->marks, &split);
        if (result == FCT_OK) result = apply_split(c, &split);
        fct_split_release(c->env, &split);
        if (result == FCT_OK) result = fct_progress(c->env, "surface", 0);
        if (result != FCT_OK) return result;
    }
}

/* Fills the patch with the model in world space, in input order. */
static fct_result place_model(patch *c) {
    const fct_instance *placed = c->view.instances + c->instance;
    fct_mesh mesh;
    fct_result result = fct_tree_mesh(c->env, c->view.models[placed->model].tree, &mesh);
    if (result != FCT_OK) return result;
    size_t vertices = mesh.vertex_count, faces = mesh.face_count;
    const fct_array arrays[] = {FCT_ARRAY(c->positions, 3 * vertices),
                                FCT_ARRAY(c->triangles, 3 * faces),
                                FCT_ARRAY(c->faces, faces),
                                FCT_ARRAY_ZERO(c->uv, 6 * faces),
                                FCT_ARRAY(c->marks, faces),
                                FCT_ARRAY_ZERO(c->settled, faces),
                                FCT_ARRAY(c->shrinks, c->view.instance_count)};
    result = fct_allocate_all(c->env, arrays, FCT_LENGTH(arrays), "a surface");
    if (result != FCT_OK) goto done;
    c->vertex_count = mesh.vertex_count, c->face_count = mesh.face_count;
    for (size_t v = 0; v < 3 * vertices; v += 3)
        v3_store(c->positions + v, fct_transform_point(placed->to_world, v3_load(mesh.positions + v)));
    for (uint32_t f = 0; f < faces; ++f) {
        const uint32_t *t = mesh.triangles + 3 * (size_t)f;
        uint32_t *to = c->triangles + 3 * (size_t)f;
        to[0] = t[0], to[1] = t[placed->mirrored ? 2 : 1], to[2] = t[placed->mirrored ? 1 : 2];
        c->faces[f] = f;
        float *uv = c->uv + 6 * (size_t)f;
        uv[placed->mirrored ? 4 : 2] = uv[placed->mirrored ? 3 : 5] = 1;
    }
    for (uint32_t i = 0; i < c->view.instance_count; ++i)
        c->shrinks[i] = fct_transform_shrink(c->view.instances + i);
done:
    fct_mesh_release(c->env, &mesh);
    return result;
}

/* Translates face numbers to the mesh as it was added and to tree places, and makes the surface. */
static fct_result store_surface(patch *c, fct_surface *out) {
    const fct_env *env = c->env;
    const fct_model *model = c->view.models + c->view.instances[c->instance].model;
    fct_tree_view tree = fct_tree_get(model->tree);
    fct_result result = FCT_OK;
    uint32_t *place_of = fct_allocate(env, tree.face_count, sizeof *place_of);
    uint32_t *places = fct_allocate(env, c->face_count, sizeof *places);
    if (!place_of || !places) {
        result = fct_fail_memory(env, "a surface");
        goto done;
    }
    for (uint32_t place = 0; place < tree.face_count; ++place) place_of[tree.face_ids[place]] = place;
    for (size_t f = 0; f < c->face_count; ++f) {
        places[f] = place_of[c->faces[f]];
        if (model->source_faces) c->faces[f] = model->source_faces[c->faces[f]];
    }
    fct_corners mesh = {c->vertex_count, c->face_count, c->positions, c->triangles};
    result = fct_surface_vertices(env, &mesh, c->faces, c->uv, places, c->shading, out);
done:
    fct_release(env, place_of);
    fct_release(env, places);
    return result;
}

double fct_surface_default_edge(const fct_scene *scene) {
    const fct_scene_view view = fct_scene_get(scene);
    double lower[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, upper[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (uint32_t i = 0; i < view.volume_count; ++i) {
        const fct_volume *volume = &view.volumes[i];
        if (volume->instance == FCT_NONE) continue;
        const float *e = view.materials[view.instances[volume->instance].material].emission;
        if (e[0] > 0 || e[1] > 0 || e[2] > 0) continue;
        for (int c = 0; c < 3; ++c) {
            lower[c] = fct_min(lower[c], volume->bounds.lower[c]);
            upper[c] = fct_max(upper[c], volume->bounds.upper[c]);
        }
    }
    const bool lit = lower[0] <= upper[0];
    v3 diagonal = lit ? v3_sub((v3){upper[0], upper[1], upper[2]}, (v3){lower[0], lower[1], lower[2]})
                      : v3_sub(v3_load(view.bounds.upper), v3_load(view.bounds.lower));
    return v3_norm(diagonal) / DIAGONAL_EDGES;
}

fct_result fct_surface_build(const fct_env *env, const fct_shading *shading, double max_edge,
                             fct_surface *out) {
    double longest = max_edge > 0 ? max_edge : fct_surface_default_edge(shading->scene);
    patch c = {.env = env,
               .shading = shading,
               .view = fct_scene_get(shading->scene),
               .instance = shading->instance,
               .longest = longest,
               .shortest = longest / GRADES};
    *out = (fct_surface){0};
    fct_result result = place_model(&c);
    if (result == FCT_OK && isfinite(longest))
        result = fct_parts_create(env, c.view.models[c.view.instances[c.instance].model].tree, &c.parts);
    if (result == FCT_OK) result = split_long_edges(&c);
    if (result == FCT_OK) result = store_surface(&c, out);
    fct_release(env, c.positions);
    fct_release(env, c.triangles);
    fct_release(env, c.faces);
    fct_release(env, c.uv);
    fct_release(env, c.marks);
    fct_release(env, c.settled);
    fct_release(env, c.shrinks);
    fct_parts_release(env, &c.parts);
    return result;
}
