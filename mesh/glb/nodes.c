/* mesh/glb/nodes.c: see nodes.h. Source: glTF 2.0 specification, chapter 3.5.
 *
 * Every node is visited at most once, because a node with two parents is an error. So there are no cycles,
 * and the work is linear in the size of the document.
 */
#include "mesh/glb/nodes.h"

#include <math.h>

typedef struct visit_entry {
    int64_t node;
    fct_glb_transform to_world; /* of the parent */
} visit_entry;

typedef struct walk {
    fct_glb *glb;
    const fct_env *env;
    fct_glb_visitor *visit;
    void *user;
    visit_entry *stack;
    size_t stack_count, stack_capacity, node_count;
    unsigned char *visited;
} walk;

fct_result fct_glb_numbers(const fct_glb *glb, json_t *object, const char *what, int64_t index,
                           const char *key, size_t count, double *values) {
    json_t *array = json_object_get(object, key);
    if (!array) return FCT_OK;
    bool good = json_array_size(array) == count;
    for (size_t i = 0; good && i < count; ++i) {
        good = json_is_number(json_array_get(array, i));
        values[i] = json_number_value(json_array_get(array, i));
    }
    return good ? FCT_OK
                : fct_glb_fail(glb, "%s[%lld]: %s is not %zu numbers", what, (long long)index, key, count);
}

static fct_glb_transform compose_transforms(const fct_glb_transform *a, const fct_glb_transform *b) {
    fct_glb_transform c = {.identity = a->identity && b->identity};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j) {
            double sum = j == 3 ? a->m[4 * i + 3] : 0;
            for (int k = 0; k < 3; ++k) sum += a->m[4 * i + k] * b->m[4 * k + j];
            c.m[4 * i + j] = sum;
        }
    return c;
}

/* The rotation of a quaternion x y z w of any length; 0 gives the identity. */
static void make_rotation(const double q[4], double out[9]) {
    double x = q[0], y = q[1], z = q[2], w = q[3], square = x * x + y * y + z * z + w * w;
    double s = square > 0 ? 2 / square : 0;
    double rotation[9] = {1 - s * (y * y + z * z), s * (x * y - z * w),     s * (x * z + y * w),
                          s * (x * y + z * w),     1 - s * (x * x + z * z), s * (y * z - x * w),
                          s * (x * z - y * w),     s * (y * z + x * w),     1 - s * (x * x + y * y)};
    for (int i = 0; i < 9; ++i) out[i] = rotation[i];
}

static fct_result read_transform(const walk *w, json_t *node, int64_t index, fct_glb_transform *out) {
    double matrix[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1}, rotation[9];
    fct_result result = fct_glb_numbers(w->glb, node, "nodes", index, "matrix", 16, matrix);
    if (result == FCT_OK) result = fct_glb_numbers(w->glb, node, "nodes", index, "translation", 3, t);
    if (result == FCT_OK) result = fct_glb_numbers(w->glb, node, "nodes", index, "rotation", 4, q);
    if (result == FCT_OK) result = fct_glb_numbers(w->glb, node, "nodes", index, "scale", 3, s);
    if (result != FCT_OK) return result;
    bool has_matrix = json_object_get(node, "matrix") != NULL;
    out->identity = !has_matrix && !json_object_get(node, "translation") &&
                    !json_object_get(node, "rotation") && !json_object_get(node, "scale");
    make_rotation(q, rotation);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j)
            out->m[4 * i + j] = has_matrix ? matrix[4 * j + i] : j == 3 ? t[i] : rotation[3 * i + j] * s[j];
    return FCT_OK;
}

static fct_result push_node(walk *w, int64_t node, const fct_glb_transform *to_world) {
    fct_result result =
        fct_grow(w->env, (void **)&w->stack, &w->stack_capacity, w->stack_count + 1, sizeof *w->stack);
    if (result == FCT_OK) w->stack[w->stack_count++] = (visit_entry){node, *to_world};
    return result;
}

static fct_result push_nodes(walk *w, json_t *nodes, const fct_glb_transform *to_world) {
    fct_result result = FCT_OK;
    for (size_t i = json_array_size(nodes); i-- > 0 && result == FCT_OK;) {
        json_t *item = json_array_get(nodes, i);
        if (!json_is_integer(item)) return fct_glb_fail(w->glb, "a list of nodes holds no whole number");
        result = push_node(w, json_integer_value(item), to_world);
    }
    return result;
}

static fct_result visit_node(walk *w, const visit_entry *entry) {
    fct_glb_place place = {.index = entry->node};
    fct_result result = fct_glb_item(w->glb, "nodes", entry->node, &place.node);
    if (result != FCT_OK) return result;
    if (w->visited[entry->node])
        return fct_glb_fail(w->glb, "nodes[%lld] has two parents", (long long)entry->node);
    w->visited[entry->node] = 1;
    fct_glb_transform local;
    result = read_transform(w, place.node, place.index, &local);
    if (result == FCT_OK) result = fct_glb_index(w->glb, place.node, "mesh", &place.mesh);
    if (result != FCT_OK) return result;
    place.to_world = compose_transforms(&entry->to_world, &local);
    result = w->visit(w->user, &place);
    if (result != FCT_OK) return result;
    return push_nodes(w, json_object_get(place.node, "children"), &place.to_world);
}

/* Pushes the nodes that no node has as a child. */
static fct_result push_orphans(walk *w, const fct_glb_transform *identity) {
    unsigned char *child = fct_allocate_zero(w->env, w->node_count, 1);
    if (!child) return fct_fail_memory(w->env, "nodes");
    json_t *node, *item;
    size_t i, j;
    json_array_foreach(json_object_get(w->glb->root, "nodes"), i, node)
        json_array_foreach(json_object_get(node, "children"), j, item) {
        int64_t number = json_integer_value(item);
        if (number >= 0 && (uint64_t)number < w->node_count) child[number] = 1;
    }
    fct_result result = FCT_OK;
    for (i = w->node_count; result == FCT_OK && i-- > 0;)
        if (!child[i]) result = push_node(w, (int64_t)i, identity);
    fct_release(w->env, child);
    return result;
}

static fct_result push_roots(walk *w, const fct_glb_transform *identity) {
    int64_t scene;
    json_t *object;
    size_t scenes = fct_glb_count(w->glb, "scenes");
    fct_result result = fct_glb_index(w->glb, w->glb->root, "scene", &scene);
    if (result != FCT_OK) return result;
    if (scene == FCT_GLB_ABSENT && scenes) scene = 0;
    if (scene == FCT_GLB_ABSENT) return push_orphans(w, identity);
    if (scenes > 1)
        fct_glb_warn(w->glb, "it has %zu scenes, and all except scenes[%lld] are left out", scenes,
                     (long long)scene);
    result = fct_glb_item(w->glb, "scenes", scene, &object);
    return result == FCT_OK ? push_nodes(w, json_object_get(object, "nodes"), identity) : result;
}

static fct_result visit_meshes(walk *w, const fct_glb_transform *identity) {
    fct_glb_place place = {.index = FCT_GLB_ABSENT, .to_world = *identity};
    int64_t count = (int64_t)fct_glb_count(w->glb, "meshes");
    fct_result result = FCT_OK;
    for (; result == FCT_OK && place.mesh < count; ++place.mesh) result = w->visit(w->user, &place);
    return result;
}

fct_result fct_glb_visit_nodes(fct_glb *glb, fct_glb_visitor *visit, void *user) {
    const fct_glb_transform identity = {.m = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, .identity = true};
    walk w = {.glb = glb, .env = glb->source->env, .visit = visit, .user = user};
    w.node_count = fct_glb_count(glb, "nodes");
    if (!w.node_count) return visit_meshes(&w, &identity);
    w.visited = fct_allocate_zero(w.env, w.node_count, 1);
    if (!w.visited) return fct_fail_memory(w.env, "nodes");
    fct_result result = push_roots(&w, &identity);
    for (size_t n = 0; result == FCT_OK && w.stack_count; ++n) {
        visit_entry entry = w.stack[--w.stack_count];
        if (n % 64 == 0) result = fct_progress(w.env, "read", (double)n / (double)(w.node_count + n));
        if (result == FCT_OK) result = visit_node(&w, &entry);
    }
    fct_release(w.env, w.stack);
    fct_release(w.env, w.visited);
    return result;
}
