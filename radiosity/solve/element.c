/* radiosity/solve/element.c: see element.h.
 *
 * Under a similarity (rotation or reflection times a factor), the sums of the hierarchy file transform in
 * closed form and an element costs O(1). Under any other transform, A and M do not follow from the file's
 * sums: set_from_faces adds them up, and an opened cluster costs O(its faces).
 */
#include "radiosity/solve/element.h"

#include <string.h>

#include "base/math/barycentric.h"
#include "cluster/tree/node.h"
#include "scene/coarse.h"
#include "scene/transform.h"

enum { PAGE = 4096 };
/* Distance of points above their patches, over half the height of its box: neighbouring rectangles, which
 * overlap at an angle, would hide lower points. With 1, a bumpy body misses 15 % of its direct light; with 2,
 * 5 %; with 4 and more, nothing. */
#define PATCH_LIFT 4.F

/* An area vector in world space that still points to the outside of a mirrored model. */
static v3 area_to_world(const fct_instance *in, v3 s) {
    v3 r = fct_transform_normal(in->normal_matrix, s);
    return in->mirrored ? v3_scale(r, -1) : r;
}

/* Marks the pages of a model's hierarchy that hold bytes [begin, begin + size) of section 0 (nodes),
 * 1 (triangles) or 2 (positions). */
static void mark_pages(const fct_elements *set, uint32_t model, int section, size_t begin, size_t size) {
    if (set->solved || fct_scene_coarse_model(set->scene, model)) return;
    const fct_tree_view *t = &set->view.models[model].tree->view; /* no copy: this runs for each point */
    size_t base = 0;
    if (section > 0) base += (size_t)t->node_count * sizeof(fct_cluster) / PAGE + 1;
    if (section > 1) base += (size_t)t->face_count * 12 / PAGE + 1;
    for (size_t page = base + begin / PAGE; page <= base + (begin + size - 1) / PAGE; ++page)
        if (!atomic_load_explicit(&set->touched[model][page], memory_order_relaxed)) /* keeps lines shared */
            atomic_store_explicit(&set->touched[model][page], 1, memory_order_relaxed);
}

uint64_t fct_elements_touched(const fct_elements *set) {
    uint64_t pages = 0;
    for (uint32_t m = 0; m < set->view.model_count; ++m)
        for (size_t i = 0; i < set->touched_sizes[m]; ++i)
            pages += atomic_load_explicit(&set->touched[m][i], memory_order_relaxed);
    return pages * PAGE + set->touched_before;
}

static const fct_coarse *coarse_form(const fct_elements *set, uint32_t instance) {
    return fct_scene_coarse_model(set->scene, set->view.instances[instance].model);
}

static void transform_face(const fct_tree_view *t, const fct_instance *in, uint32_t place, v3 p[3]) {
    for (size_t k = 0; k < 3; ++k)
        p[k] = fct_transform_point(in->to_world,
                                   v3_load(t->positions + 3 * (size_t)t->triangles[3 * (size_t)place + k]));
}

static void mark_face(const fct_elements *set, const fct_instance *in, const fct_tree_view *t,
                      uint32_t place) {
    mark_pages(set, in->model, 1, (size_t)place * 12, 12);
    for (size_t k = 0; k < 3; ++k)
        mark_pages(set, in->model, 2, (size_t)t->triangles[3 * (size_t)place + k] * 12, 12);
}

/* World-space corners of the face at `place`. */
static void load_face(const fct_elements *set, const fct_instance *in, uint32_t place, v3 p[3]) {
    const fct_tree_view *t = &set->view.models[in->model].tree->view;
    mark_face(set, in, t, place);
    transform_face(t, in, place, p);
}

/* sign: -1 if the corners wind against the element's side. */
static void set_triangle(fct_element *e, const v3 p[3], double sign) {
    v3 s = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5 * sign);
    v3 n = v3_unit(s);
    e->kind = FCT_ELEMENT_TRIANGLE;
    e->center = v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), 1 / 3.);
    e->radius = 0;
    for (int k = 0; k < 3; ++k) e->radius = fct_max(e->radius, v3_norm(v3_sub(p[k], e->center)));
    e->area = v3_norm(s);
    e->vector = s;
    memset(e->moment, 0, sizeof e->moment);
    sym3_add_outer(e->moment, e->area, n);
    e->cone = 0;
}

/* A, S, M and centroid as sums over the faces, for transforms that change shapes. */
static void set_from_faces(const fct_elements *set, const fct_instance *in, const fct_cluster *c, double sign,
                           fct_element *e) {
    e->area = 0;
    e->vector = e->center = v3_make(0, 0, 0);
    memset(e->moment, 0, sizeof e->moment);
    for (uint32_t i = c->first; i < c->first + c->count; ++i) {
        v3 p[3];
        load_face(set, in, i, p);
        v3 s = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5 * sign);
        double a = v3_norm(s);
        e->area += a;
        e->vector = v3_add(e->vector, s);
        e->center = v3_mad(e->center, a / 3, v3_add(v3_add(p[0], p[1]), p[2]));
        sym3_add_outer(e->moment, a, v3_unit(s));
    }
    if (e->area > 0) e->center = v3_scale(e->center, 1 / e->area);
    e->cone = FCT_PI;
}

static void set_cluster(const fct_elements *set, const fct_instance *in, const fct_cluster *c, double sign,
                        fct_element *e) {
    e->kind = FCT_ELEMENT_CLUSTER;
    double s = in->uniform_scale, stretch = s;
    if (s > 0) {
        double m[6];
        for (int k = 0; k < 6; ++k) m[k] = c->moment[k];
        e->area = c->area * s * s;
        e->vector = v3_scale(area_to_world(in, v3_load(c->area_vector)), sign);
        e->center = fct_transform_point(in->to_world, v3_load(c->centroid));
        /* M' = N M N^T / s^2, because N is s^2 times a rotation or reflection. */
        const float *n = in->normal_matrix;
        v3 rows[3] = {v3_load(n), v3_load(n + 3), v3_load(n + 6)};
        static const int index[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
        for (int k = 0; k < 6; ++k)
            e->moment[k] = sym3_form(m, rows[index[k][0]], rows[index[k][1]]) / (s * s);
        e->cone = c->cone_angle;
    } else {
        set_from_faces(set, in, c, in->mirrored ? -sign : sign, e);
        /* The Frobenius norm bounds the stretch of the box. */
        stretch = 0;
        for (int r = 0; r < 3; ++r)
            for (int k = 0; k < 3; ++k) stretch += (double)in->to_world[4 * r + k] * in->to_world[4 * r + k];
        stretch = sqrt(stretch);
    }
    v3 from = v3_sub(fct_transform_point(in->to_world, v3_load(c->box_center)), e->center);
    e->radius = stretch * v3_norm(v3_load(c->box_half)) + v3_norm(from);
}

static fct_result reserve_elements(fct_elements *set, size_t more) {
    fct_result r =
        fct_grow(set->env, (void **)&set->items, &set->capacity, set->count + more, sizeof *set->items);
    if (r == FCT_OK)
        r = fct_grow(set->env, (void **)&set->ranges, &set->range_capacity, set->count + more,
                     sizeof *set->ranges);
    if (r == FCT_OK)
        r = fct_grow(set->env, (void **)&set->places, &set->place_capacity,
                     (set->cluster_count + more) * FCT_ELEMENT_POINTS, sizeof *set->places);
    return r;
}

static fct_result add_corners(fct_elements *set, const v3 p[3], uint32_t *index) {
    fct_result r = fct_grow(set->env, (void **)&set->corners, &set->corner_capacity, set->corner_count + 9,
                            sizeof *set->corners);
    if (r != FCT_OK) return r;
    for (int k = 0; k < 3; ++k) v3_store(set->corners + set->corner_count + 3 * k, p[k]);
    *index = (uint32_t)(set->corner_count / 9);
    set->corner_count += 9;
    return FCT_OK;
}

static void load_corners(const fct_elements *set, uint32_t triangle, v3 p[3]) {
    for (int k = 0; k < 3; ++k) p[k] = v3_load(set->corners + 9 * (size_t)triangle + 3 * k);
}

/* Appends the element of a tree node. The caller has reserved its place, and sets the power. */
static fct_result add_node(fct_elements *set, uint32_t parent, uint32_t instance, uint32_t node,
                           uint8_t back) {
    const fct_instance *in = &set->view.instances[instance];
    const fct_tree *tree = set->view.models[in->model].tree;
    const fct_material *material = &set->view.materials[in->material];
    const uint32_t face_count = fct_node_faces(tree, node), place = fct_node_first(tree, node);
    fct_element e = {
        .parent = parent, .instance = instance, .node = node, .back = back, .triangle = FCT_NONE};
    double sign = back ? -1 : 1;
    if (face_count == 1) {
        v3 p[3];
        load_face(set, in, place, p);
        set_triangle(&e, p, in->mirrored ? -sign : sign);
        fct_result r = add_corners(set, p, &e.triangle);
        if (r != FCT_OK) return r;
    } else {
        mark_pages(set, in->model, 0, (size_t)node * sizeof(fct_cluster), sizeof(fct_cluster));
        fct_cluster room;
        set_cluster(set, in, fct_node_cluster(tree, node, &room), sign, &e);
        e.triangle = (uint32_t)set->cluster_count++;
    }
    fct_paints_node(&set->paints, instance, node, e.reflectance);
    for (int k = 0; k < 3; ++k) {
        e.emission[k] = material->emission[k];
        e.radiosity[k] = e.emission[k];
    }
    set->ranges[set->count] = (fct_element_range){.first = place, .count = face_count};
    set->items[set->count++] = e;
    return FCT_OK;
}

/* Makes all elements from `first` on the children of `id`. */
static void set_children(fct_elements *set, uint32_t id, size_t first) {
    set->items[id].child = set->ranges[id].child = (uint32_t)first;
    set->items[id].child_count = set->ranges[id].child_count = (uint32_t)(set->count - first);
}

static void copy_light_to_children(fct_elements *set, uint32_t id) {
    const fct_element *e = &set->items[id];
    for (uint32_t c = e->child; c < e->child + e->child_count; ++c)
        for (int k = 0; k < 3; ++k) {
            set->items[c].irradiance[k] = e->irradiance[k];
            set->items[c].radiosity[k] = e->radiosity[k];
            set->items[c].power[k] = v3_scale(set->items[c].vector, e->radiosity[k]);
        }
}

bool fct_elements_can_split(const fct_elements *set, uint32_t id) {
    const fct_element *e = &set->items[id];
    if (e->child_count) return false;
    if (e->kind == FCT_ELEMENT_CLUSTER) {
        const fct_coarse *coarse = coarse_form(set, e->instance);
        return !coarse || e->node < coarse->top_count;
    }
    if (e->kind == FCT_ELEMENT_VOLUME) return false;
    v3 p[3];
    load_corners(set, e->triangle, p);
    double longest = 0;
    for (int k = 0; k < 3; ++k) longest = fct_max(longest, v3_norm(v3_sub(p[k], p[(k + 1) % 3])));
    return longest > set->min_edge && e->area > 0;
}

/* Three corner triangles, then the middle one; fct_elements_locate relies on this order. */
static fct_result quarter_triangle(fct_elements *set, uint32_t id) {
    v3 p[3], m[3];
    load_corners(set, set->items[id].triangle, p);
    for (int k = 0; k < 3; ++k)
        m[k] = v3_scale(v3_add(p[(k + 1) % 3], p[(k + 2) % 3]), .5); /* opposite to corner k */
    const v3 parts[4][3] = {{p[0], m[2], m[1]}, {m[2], p[1], m[0]}, {m[1], m[0], p[2]}, {m[0], m[1], m[2]}};
    const fct_instance *in = &set->view.instances[set->items[id].instance];
    double sign = (set->items[id].back ? -1 : 1) * (in->mirrored ? -1 : 1);
    float reflectances[4][3];
    v3 face[3];
    load_face(set, in, set->ranges[id].first, face);
    fct_paints_quarters(&set->paints, set->items[id].instance, set->ranges[id].first, face, parts,
                        set->items[id].reflectance, reflectances);
    for (int k = 0; k < 4; ++k) {
        fct_element e = set->items[id];
        memcpy(e.reflectance, reflectances[k], sizeof e.reflectance);
        e.parent = id;
        e.child = e.child_count = 0;
        set_triangle(&e, parts[k], sign);
        fct_result r = add_corners(set, parts[k], &e.triangle);
        if (r != FCT_OK) return r;
        set->ranges[set->count] = set->ranges[id];
        set->items[set->count++] = e;
    }
    return FCT_OK;
}

fct_result fct_elements_split(fct_elements *set, uint32_t id) {
    fct_result r = reserve_elements(set, 4);
    if (r != FCT_OK) return r;
    size_t first = set->count;
    const fct_element e = set->items[id];
    if (e.kind == FCT_ELEMENT_TRIANGLE) {
        r = quarter_triangle(set, id);
    } else {
        const fct_tree *tree = set->view.models[set->view.instances[e.instance].model].tree;
        r = add_node(set, id, e.instance, fct_node_child(tree, e.node, 0), e.back);
        if (r == FCT_OK) r = add_node(set, id, e.instance, fct_node_child(tree, e.node, 1), e.back);
    }
    if (r != FCT_OK) return r;
    set_children(set, id, first);
    copy_light_to_children(set, id);
    return FCT_OK;
}

static fct_result add_roots(fct_elements *set, uint32_t volume, uint32_t instance) {
    const fct_instance *in = &set->view.instances[instance];
    fct_tree_view t = fct_tree_get(set->view.models[in->model].tree);
    int sides = set->view.materials[in->material].two_sided ? 2 : 1;
    fct_result r = reserve_elements(set, (size_t)t.root_count * (size_t)sides);
    set->roots[instance] = (uint32_t)set->count;
    set->root_counts[instance] = t.root_count;
    size_t first = set->count;
    for (int back = 0; back < sides; ++back)
        for (uint32_t i = 0; i < t.root_count && r == FCT_OK; ++i)
            r = add_node(set, volume, instance, t.roots[i], (uint8_t)back);
    if (r == FCT_OK) set_children(set, volume, first);
    return r;
}

/* Sums of a volume from its children, which have larger numbers. */
static void sum_volume(fct_elements *set, uint32_t id) {
    fct_element *e = &set->items[id];
    e->area = 0;
    e->vector = e->center = v3_make(0, 0, 0);
    e->cone = FCT_PI;
    for (uint32_t c = e->child; c < e->child + e->child_count; ++c) {
        const fct_element *k = &set->items[c];
        e->area += k->area;
        e->vector = v3_add(e->vector, k->vector);
        e->center = v3_mad(e->center, k->area, k->center);
        for (int i = 0; i < 6; ++i) e->moment[i] += k->moment[i];
    }
    if (e->area > 0)
        e->center = v3_scale(e->center, 1 / e->area);
    else if (e->child_count)
        e->center = set->items[e->child].center;
    for (uint32_t c = e->child; c < e->child + e->child_count; ++c)
        e->radius =
            fct_max(e->radius, v3_norm(v3_sub(set->items[c].center, e->center)) + set->items[c].radius);
}

fct_result fct_elements_create(const fct_env *env, const fct_scene *scene, double min_edge,
                               fct_elements *out) {
    *out = (fct_elements){.env = env, .scene = scene, .view = fct_scene_get(scene), .min_edge = min_edge};
    fct_elements *set = out;
    const fct_scene_view *view = &set->view;
    fct_result r = FCT_ERROR_MEMORY;
    set->roots = fct_allocate(env, view->instance_count, sizeof *set->roots);
    set->root_counts = fct_allocate_zero(env, view->instance_count, sizeof *set->root_counts);
    set->touched = fct_allocate_zero(env, view->model_count, sizeof *set->touched);
    set->touched_sizes = fct_allocate_zero(env, view->model_count, sizeof *set->touched_sizes);
    if (!set->roots || !set->root_counts || !set->touched || !set->touched_sizes) goto done;
    for (uint32_t m = 0; m < view->model_count; ++m) {
        fct_tree_view t = fct_tree_get(view->models[m].tree);
        const fct_coarse *coarse = fct_scene_coarse_model(scene, m);
        if (coarse) set->touched_before += coarse->touched_bytes;
        size_t pages = (size_t)t.node_count * sizeof(fct_cluster) / PAGE + (size_t)t.face_count * 12 / PAGE +
                       (size_t)t.vertex_count * 12 / PAGE + 6;
        set->touched[m] = fct_allocate_zero(env, pages, 1);
        if (!set->touched[m]) goto done;
        set->touched_sizes[m] = pages;
    }
    if ((r = fct_paints_create(env, scene, &set->paints)) != FCT_OK) goto done;
    if ((r = reserve_elements(set, view->volume_count)) != FCT_OK) goto done;
    for (uint32_t i = 0; i < view->volume_count; ++i) {
        set->items[i] = (fct_element){.parent = FCT_NONE,
                                      .instance = FCT_NONE,
                                      .node = FCT_NONE,
                                      .triangle = FCT_NONE,
                                      .kind = FCT_ELEMENT_VOLUME};
        set->ranges[i] = (fct_element_range){0};
    }
    set->count = view->volume_count;
    for (uint32_t i = 0; i < view->volume_count && r == FCT_OK; ++i)
        if (view->volumes[i].instance != FCT_NONE) r = add_roots(set, i, view->volumes[i].instance);
    if (r != FCT_OK) goto done;
    /* The scene numbers the two children of a volume one after the other. */
    for (uint32_t i = 0; i < view->volume_count; ++i)
        if (view->volumes[i].instance == FCT_NONE) {
            for (int k = 0; k < 2; ++k) set->items[view->volumes[i].child[k]].parent = i;
            set->items[i].child = set->ranges[i].child = view->volumes[i].child[0];
            set->items[i].child_count = set->ranges[i].child_count = 2;
        }
    for (uint32_t i = view->volume_count; i-- > 0;) sum_volume(set, i);
    fct_elements_pull(set);
    return FCT_OK;
done:
    fct_elements_release(set);
    return r == FCT_ERROR_MEMORY ? fct_fail_memory(env, "the elements") : r;
}

void fct_elements_release(fct_elements *set) {
    if (!set->env) return;
    fct_paints_release(&set->paints);
    for (uint32_t m = 0; set->touched && m < set->view.model_count; ++m)
        fct_release(set->env, set->touched[m]);
    void *owned[] = {set->items, set->ranges,      set->places,  set->corners,
                     set->roots, set->root_counts, set->touched, set->touched_sizes};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; ++i) fct_release(set->env, owned[i]);
    *set = (fct_elements){0};
}

/* Place of the face at fraction *t of the area of a node; *t becomes the fraction within that face. */
static uint32_t find_face_by_area(const fct_elements *set, const fct_instance *in, uint32_t node, double *t) {
    const fct_tree *tree = set->view.models[in->model].tree;
    const uint32_t inner = tree->view.node_count;
    while (node < inner) {
        mark_pages(set, in->model, 0, (size_t)node * sizeof(fct_cluster), sizeof(fct_cluster));
        double area[2];
        for (int k = 0; k < 2; ++k) area[k] = fct_node_area(tree, fct_node_child(tree, node, k));
        double share = area[0] + area[1] > 0 ? area[0] / (area[0] + area[1]) : .5;
        int k = *t < share ? 0 : 1;
        *t = k == 0 ? *t / share : (*t - share) / (1 - share);
        *t = fct_min(fct_max(*t, 0), 1 - 1e-12);
        node = fct_node_child(tree, node, k);
    }
    return node - inner;
}

/* Shrinks a triangle of a patch toward the middle of the rectangle, to the area of the cluster's outline:
 * points near the rim of the rectangle lie beside the surface. */
static void shrink_to_outline(const fct_coarse *coarse, uint32_t place, v3 p[3]) {
    const uint32_t patch = coarse->patches[place];
    const bool second = place > 0 && coarse->patches[place - 1] == patch;
    const double s = sqrt((double)coarse->fill[patch]);
    const v3 middle = v3_scale(v3_add(p[0], p[second ? 1 : 2]), .5);
    for (int k = 0; k < 3; ++k) p[k] = v3_mad(v3_scale(p[k], s), 1 - s, middle);
}

/* The point of the triangle p, of the face at out->place, that (a, b) in [0, 1)^2 chooses uniformly. */
static void place_point(const fct_elements *set, const fct_element *e, v3 p[3], double a, double b,
                        fct_element_point *out) {
    const fct_instance *in = &set->view.instances[e->instance];
    const fct_coarse *coarse = coarse_form(set, e->instance);
    double w = 1 - sqrt(a), v = b * sqrt(a), u = 1 - w - v, height = 0;
    if (coarse) {
        shrink_to_outline(coarse, out->place, p);
        height = PATCH_LIFT * in->uniform_scale * coarse->height[coarse->patches[out->place]];
    }
    double sign = (e->back ? -1 : 1) * (in->mirrored ? -1 : 1);
    v3 s = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), sign);
    v3 x = v3_add(v3_add(v3_scale(p[0], w), v3_scale(p[1], u)), v3_scale(p[2], v));
    /* 1e-4 of the local edge, or the rounding of a float coordinate where that is larger; above the relief of
     * a patch. */
    double size = sqrt(v3_norm(s)), reach = fct_max(fct_max(fabs(x.x), fabs(x.y)), fabs(x.z));
    out->offset = (float)(1e-4 * size + 2e-7 * reach + height);
    v3_store(out->position, x);
    v3_store(out->normal, v3_unit(s));
}

void fct_element_sample(const fct_elements *set, uint32_t id, double t, double a, double b,
                        fct_element_point *out) {
    const fct_element *e = &set->items[id];
    while (e->kind == FCT_ELEMENT_VOLUME) { /* down to a root, by area */
        uint32_t last = e->child + e->child_count - 1, c = e->child;
        double total = 0, before = 0;
        for (uint32_t i = c; i <= last; ++i) total += set->items[i].area;
        while (c < last && t * total >= before + set->items[c].area) before += set->items[c++].area;
        double area = set->items[c].area;
        t = area > 0 ? fct_min(fct_max((t * total - before) / area, 0), 1 - 1e-12) : .5;
        e = &set->items[c];
    }
    const fct_instance *in = &set->view.instances[e->instance];
    v3 p[3];
    if (e->kind == FCT_ELEMENT_TRIANGLE) {
        load_corners(set, e->triangle, p);
        out->place = set->ranges[e - set->items].first;
    } else {
        out->place = find_face_by_area(set, in, e->node, &t);
        load_face(set, in, out->place, p);
    }
    place_point(set, e, p, a, b, out);
}

/* The k-th point lies at the returned fraction of the area; r[1] and r[2] choose it in the triangle there. */
static double draw_point(uint32_t id, uint32_t k, double r[3]) {
    for (uint64_t d = 0; d < 3; ++d) r[d] = fct_uniform(fct_hash3(id, k, d));
    return (k + r[0]) / FCT_ELEMENT_POINTS;
}

static void find_places_chunk(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    fct_elements *set = user;
    (void)chunk, (void)thread;
    for (size_t id = set->pointed + begin; id < set->pointed + end; ++id) {
        const fct_element *e = &set->items[id];
        if (e->kind != FCT_ELEMENT_CLUSTER) continue;
        const fct_instance *in = &set->view.instances[e->instance];
        const fct_tree_view *view = &set->view.models[in->model].tree->view;
        for (uint32_t k = 0; k < FCT_ELEMENT_POINTS; ++k) {
            double r[3], t = draw_point((uint32_t)id, k, r);
            const uint32_t place = find_face_by_area(set, in, e->node, &t);
            set->places[FCT_ELEMENT_POINTS * (size_t)e->triangle + k] = place;
            mark_face(set, in, view, place);
        }
    }
}

void fct_elements_make_points(fct_elements *set) {
    fct_parallel_for(set->env, set->count - set->pointed, 64, find_places_chunk, set);
    set->pointed = set->count;
}

void fct_element_point_at(const fct_elements *set, uint32_t id, uint32_t k, fct_element_point *out) {
    const fct_element *e = &set->items[id];
    double r[3], t = draw_point(id, k, r);
    if (e->kind != FCT_ELEMENT_CLUSTER) {
        fct_element_sample(set, id, t, r[1], r[2], out);
        return;
    }
    const fct_instance *in = &set->view.instances[e->instance];
    v3 p[3];
    out->place = set->places[FCT_ELEMENT_POINTS * (size_t)e->triangle + k]; /* its pages are marked */
    transform_face(&set->view.models[in->model].tree->view, in, out->place, p);
    place_point(set, e, p, r[1], r[2], out);
}

void fct_elements_truncate(fct_elements *set, size_t count) {
    for (size_t id = set->count; id-- > count;) { /* corners and places were added in this order */
        const fct_element *e = &set->items[id];
        if (e->kind == FCT_ELEMENT_TRIANGLE) set->corner_count = 9 * (size_t)e->triangle;
        if (e->kind == FCT_ELEMENT_CLUSTER) set->cluster_count = e->triangle;
    }
    set->count = count;
    if (set->pointed > count) set->pointed = count;
    for (size_t id = 0; id < count; ++id) {
        if (set->items[id].child_count == 0 || set->items[id].child < count) continue;
        set->items[id].child = set->items[id].child_count = 0;
        set->ranges[id].child = set->ranges[id].child_count = 0;
    }
}

uint32_t fct_elements_locate(const fct_elements *set, uint32_t instance, bool back, uint32_t place, float u,
                             float v) {
    const fct_instance *in = &set->view.instances[instance];
    if (back && !set->view.materials[in->material].two_sided) return FCT_NONE;
    uint32_t id = set->roots[instance] + (back ? set->root_counts[instance] : 0);
    for (uint32_t last = id + set->root_counts[instance] - 1; id < last;) { /* ranges of roots ascend */
        uint32_t middle = id + (last - id + 1) / 2;
        if (set->ranges[middle].first <= place)
            id = middle;
        else
            last = middle - 1;
    }
    float w = 1 - u - v;
    for (;;) {
        const fct_element_range *r = &set->ranges[id];
        if (r->child_count == 0) return id;
        if (r->child_count == 2) {
            id = r->child + (place - set->ranges[r->child].first < set->ranges[r->child].count ? 0 : 1);
        } else if (w > .5F) {
            w = 2 * w - 1, u *= 2, v *= 2;
            id = r->child;
        } else if (u > .5F) {
            u = 2 * u - 1, w *= 2, v *= 2;
            id = r->child + 1;
        } else if (v > .5F) {
            v = 2 * v - 1, w *= 2, u *= 2;
            id = r->child + 2;
        } else {
            w = 1 - 2 * w, u = 1 - 2 * u, v = 1 - 2 * v;
            id = r->child + 3;
        }
    }
}

uint32_t fct_elements_locate_point(const fct_elements *set, uint32_t instance, bool back, uint32_t place,
                                   v3 point) {
    const fct_instance *in = &set->view.instances[instance];
    const fct_tree_view t = fct_tree_get(set->view.models[in->model].tree);
    v3 p[3];
    for (size_t k = 0; k < 3; ++k) {
        const size_t vertex = t.triangles[3 * (size_t)place + k];
        p[k] = fct_transform_point(in->to_world, v3_load(t.positions + 3 * vertex));
    }
    double uv[2];
    fct_barycentrics(p, point, uv);
    return fct_elements_locate(set, instance, back, place, (float)uv[0], (float)uv[1]);
}

void fct_elements_refer(fct_elements *set, const fct_scene *scene) {
    const fct_scene *from = set->scene;
    set->scene = scene, set->view = fct_scene_get(scene), set->solved = true;
    if (from == scene) return;
    for (size_t i = 0; i < set->count; ++i) {
        fct_element *e = &set->items[i];
        if (e->kind == FCT_ELEMENT_VOLUME) continue;
        const uint32_t model = set->view.instances[e->instance].model;
        const fct_coarse *coarse = fct_scene_coarse_model(from, model);
        if (!coarse) continue;
        const fct_tree *tree = set->view.models[model].tree;
        e->node = fct_coarse_origin(coarse, e->node);
        set->ranges[i].first = fct_node_first(tree, e->node);
        set->ranges[i].count = fct_node_faces(tree, e->node);
    }
}

void fct_elements_pull(fct_elements *set) {
    /* Descending order visits children before parents within surfaces and within volumes. Surfaces go first:
     * volumes have smaller numbers than the roots below them. */
    for (size_t pass = 0; pass < 2; ++pass) {
        size_t volumes = set->view.volume_count;
        size_t begin = pass == 0 ? volumes : 0, end = pass == 0 ? set->count : volumes;
        for (size_t i = end; i-- > begin;) {
            fct_element *e = &set->items[i];
            if (e->child_count == 0) {
                for (int k = 0; k < 3; ++k) e->power[k] = v3_scale(e->vector, e->radiosity[k]);
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                double flux = 0;
                v3 power = {0, 0, 0};
                for (uint32_t c = e->child; c < e->child + e->child_count; ++c) {
                    flux += set->items[c].area * set->items[c].radiosity[k];
                    power = v3_add(power, set->items[c].power[k]);
                }
                e->radiosity[k] = e->area > 0 ? flux / e->area : 0;
                e->power[k] = power;
            }
        }
    }
}
