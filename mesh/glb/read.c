/* mesh/glb/read.c: places the meshes of a GLB file by their nodes and joins them to one soup.
 *
 * The reader visits each node once, in the order of the scene. A node with two parents is an error, so there
 * are no cycles. Consecutive primitives of a mesh that use the same accessors share their vertices. Lists,
 * strips and fans become triangles; points become vertices. A mirroring transform reverses the winding, as
 * the specification demands. Cameras, lights, skins and animations are ignored. The size of the file limits
 * the number of vertices and triangles, so that a short file with many references cannot exhaust the memory.
 */
#include "mesh/glb/read.h"

#include <math.h>
#include <string.h>

#include "mesh/glb/glb.h"

typedef struct transform {
    double m[12]; /* rows of R|t */
    bool identity;
} transform;

typedef struct primitive {
    int64_t position, normal, color, radiosity, texcoord, indices, material, mode;
} primitive;

typedef struct visit {
    int64_t node;
    transform to_world; /* of the parent */
} visit;

typedef struct reader {
    fct_glb glb;
    const fct_env *env;
    const char *name;
    fct_soup *soup;
    bool has_colors, has_normals, has_texcoords, has_materials, needs_unnamed;
    size_t without_color, without_texcoord, lines;
    uint64_t limit; /* on vertices and on corners */
    visit *stack;
    size_t stack_count, stack_capacity;
    unsigned char *visited;
    size_t node_count, vertex_capacity, color_capacity, normal_capacity, corner_capacity, texcoord_capacity,
        material_capacity;
    uint32_t unnamed; /* number of the material that primitives without one get */
} reader;

static size_t count_of(const reader *r, const char *name) {
    return json_array_size(json_object_get(r->glb.root, name));
}

static fct_result read_primitive(const reader *r, json_t *object, primitive *out) {
    const fct_glb *g = &r->glb;
    json_t *attributes = json_object_get(object, "attributes");
    fct_result result = fct_glb_index(g, attributes, "POSITION", &out->position);
    if (result == FCT_OK) result = fct_glb_index(g, attributes, "NORMAL", &out->normal);
    if (result == FCT_OK) result = fct_glb_index(g, attributes, "COLOR_0", &out->color);
    if (result == FCT_OK) result = fct_glb_index(g, attributes, "_RADIOSITY", &out->radiosity);
    if (result == FCT_OK) result = fct_glb_index(g, attributes, "TEXCOORD_0", &out->texcoord);
    if (result == FCT_OK) result = fct_glb_index(g, object, "indices", &out->indices);
    if (result == FCT_OK) result = fct_glb_index(g, object, "material", &out->material);
    if (result == FCT_OK) result = fct_glb_index(g, object, "mode", &out->mode);
    if (result == FCT_OK && out->mode == FCT_GLB_ABSENT) out->mode = 4;
    return result;
}

/* Decides which arrays the soup has: colours, texture coordinates and materials if any primitive has them,
 * normals if all primitives have them. */
static fct_result choose_arrays(reader *r) {
    json_t *meshes = json_object_get(r->glb.root, "meshes"), *mesh, *object;
    size_t i, j;
    r->has_normals = true;
    json_array_foreach(meshes, i, mesh) json_array_foreach(json_object_get(mesh, "primitives"), j, object) {
        primitive p;
        fct_result result = read_primitive(r, object, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT) continue;
        r->has_colors |= p.color >= 0 || p.radiosity >= 0;
        r->has_texcoords |= p.texcoord >= 0;
        r->has_normals &= p.normal >= 0;
        r->needs_unnamed |= p.material < 0;
        if (p.material < 0) continue;
        json_t *material;
        result = fct_glb_item(&r->glb, "materials", p.material, &material);
        if (result != FCT_OK) return result;
        r->has_materials |= json_is_string(json_object_get(material, "name")) || p.material > 0;
    }
    return FCT_OK;
}

/* Numbers the materials as the file does. Adds one with an empty name if a primitive has no material. */
static fct_result name_materials(reader *r) {
    if (!r->has_materials) return FCT_OK;
    size_t count = count_of(r, "materials");
    r->unnamed = (uint32_t)count;
    r->soup->material_names = fct_allocate_zero(r->env, count + 1, sizeof(char *));
    if (!r->soup->material_names) return fct_fail_memory(r->env, "material names");
    r->soup->material_count = (uint32_t)(count + r->needs_unnamed);
    for (size_t i = 0; i < r->soup->material_count; ++i) {
        json_t *name = json_object_get(json_array_get(json_object_get(r->glb.root, "materials"), i), "name");
        char number[32];
        snprintf(number, sizeof number, "material_%zu", i);
        const char *text = json_is_string(name) ? json_string_value(name) : i < count ? number : "";
        r->soup->material_names[i] = fct_copy_text(r->env, text, strlen(text));
        if (!r->soup->material_names[i]) return fct_fail_memory(r->env, "material names");
    }
    return FCT_OK;
}

static transform compose_transforms(const transform *a, const transform *b) {
    transform c = {.identity = a->identity && b->identity};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j) {
            double sum = j == 3 ? a->m[4 * i + 3] : 0;
            for (int k = 0; k < 3; ++k) sum += a->m[4 * i + k] * b->m[4 * k + j];
            c.m[4 * i + j] = sum;
        }
    return c;
}

/* Reads the `count` numbers of object[key]. Leaves the values unchanged if there is no such key. */
static fct_result read_numbers(const reader *r, json_t *object, const char *key, size_t count, double *values,
                               bool *there) {
    json_t *array = json_object_get(object, key);
    if (!array) return FCT_OK;
    *there = true;
    bool ok = json_array_size(array) == count;
    for (size_t i = 0; ok && i < count; ++i) {
        ok = json_is_number(json_array_get(array, i));
        values[i] = json_number_value(json_array_get(array, i));
    }
    return ok ? FCT_OK
              : fct_fail(r->env, FCT_ERROR_DATA, "%s: a node's %s is not %zu numbers", r->name, key, count);
}

static fct_result read_transform(const reader *r, json_t *node, transform *out) {
    double matrix[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    bool has_matrix = false, has_parts = false;
    fct_result result = read_numbers(r, node, "matrix", 16, matrix, &has_matrix);
    if (result == FCT_OK) result = read_numbers(r, node, "translation", 3, t, &has_parts);
    if (result == FCT_OK) result = read_numbers(r, node, "rotation", 4, q, &has_parts);
    if (result == FCT_OK) result = read_numbers(r, node, "scale", 3, s, &has_parts);
    if (result != FCT_OK) return result;
    out->identity = !has_matrix && !has_parts;
    double x = q[0], y = q[1], z = q[2], w = q[3];
    double rotation[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j)
            out->m[4 * i + j] = has_matrix ? matrix[4 * j + i] : j == 3 ? t[i] : rotation[3 * i + j] * s[j];
    return FCT_OK;
}

static double compute_cofactor(const double *m, int i, int j) {
    int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c];
}

static bool is_mirroring(const transform *t) {
    double determinant = 0;
    for (int j = 0; j < 3; ++j) determinant += t->m[j] * compute_cofactor(t->m, 0, j);
    return determinant < 0;
}

static fct_result append_positions(reader *r, const transform *t, const fct_glb_array *positions) {
    float *to = r->soup->positions + 3 * (size_t)r->soup->vertex_count;
    for (size_t v = 0; v < positions->count; ++v) {
        double p[3];
        for (int k = 0; k < 3; ++k) p[k] = fct_glb_value(positions, v, k);
        for (int k = 0; k < 3; ++k) {
            const double *m = t->m + 4 * k;
            to[3 * v + k] = (float)(t->identity ? p[k] : m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3]);
            if (!isfinite(to[3 * v + k]))
                return fct_fail(r->env, FCT_ERROR_DATA, "%s: a position is not finite (vertex %zu)", r->name,
                                r->soup->vertex_count + v);
        }
    }
    return FCT_OK;
}

/* Multiplies normals by the cofactor matrix, which is right for any scale, and makes them unit vectors. */
static void append_normals(reader *r, const transform *t, const fct_glb_array *normals) {
    float *to = r->soup->normals + 3 * (size_t)r->soup->vertex_count;
    double sign = is_mirroring(t) ? -1 : 1;
    for (size_t v = 0; v < normals->count; ++v) {
        double n[3], turned[3], length = 0;
        for (int k = 0; k < 3; ++k) n[k] = fct_glb_value(normals, v, k);
        for (int k = 0; k < 3; ++k) {
            turned[k] = 0;
            for (int j = 0; j < 3; ++j) turned[k] += sign * compute_cofactor(t->m, k, j) * n[j];
            length += turned[k] * turned[k];
        }
        length = sqrt(length);
        for (int k = 0; k < 3; ++k)
            to[3 * v + k] = (float)(t->identity ? n[k] : length > 0 ? turned[k] / length : 0);
    }
}

static fct_result get_array(const reader *r, int64_t index, int least, int most, size_t count,
                            fct_glb_array *out) {
    fct_result result = fct_glb_array_of(&r->glb, index, least, most, out);
    if (result == FCT_OK && out->count != count)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: accessor %lld has %zu elements, where %zu positions are",
                        r->name, (long long)index, out->count, count);
    return result;
}

static fct_result grow_vertices(reader *r, size_t count) {
    fct_soup *soup = r->soup;
    size_t total = soup->vertex_count + count;
    if (total > r->limit || total > FCT_MESH_LIMIT)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: its nodes place more than %llu vertices", r->name,
                        (unsigned long long)r->limit);
    size_t room = total > 0 ? total : 1; /* so that no array is NULL */
    fct_result result =
        fct_grow(r->env, (void **)&soup->positions, &r->vertex_capacity, room, 3 * sizeof(float));
    if (result == FCT_OK && r->has_colors)
        result = fct_grow(r->env, (void **)&soup->colors, &r->color_capacity, room, 3 * sizeof(float));
    if (result == FCT_OK && r->has_normals)
        result = fct_grow(r->env, (void **)&soup->normals, &r->normal_capacity, room, 3 * sizeof(float));
    return result;
}

/* Appends the primitive's vertices. */
static fct_result append_vertices(reader *r, const transform *t, const primitive *p) {
    fct_soup *soup = r->soup;
    fct_glb_array positions, values;
    fct_result result = fct_glb_array_of(&r->glb, p->position, 3, 3, &positions);
    if (result == FCT_OK) result = grow_vertices(r, positions.count);
    if (result == FCT_OK) result = append_positions(r, t, &positions);
    if (result != FCT_OK) return result;
    if (r->has_normals) {
        result = get_array(r, p->normal, 3, 3, positions.count, &values);
        if (result != FCT_OK) return result;
        append_normals(r, t, &values);
    }
    if (r->has_colors) {
        float *to = soup->colors + 3 * (size_t)soup->vertex_count;
        int64_t index = p->radiosity >= 0 ? p->radiosity : p->color;
        if (index >= 0) result = get_array(r, index, 3, 4, positions.count, &values);
        if (result != FCT_OK) return result;
        r->without_color += index < 0 ? positions.count : 0;
        for (size_t v = 0; v < positions.count; ++v)
            for (int k = 0; k < 3; ++k) to[3 * v + k] = index < 0 ? 1 : (float)fct_glb_value(&values, v, k);
    }
    soup->vertex_count += (uint32_t)positions.count;
    return FCT_OK;
}

static fct_result grow_corners(reader *r, size_t corners) {
    fct_soup *soup = r->soup;
    size_t total = soup->corner_count + corners;
    if (total > 3 * r->limit || total / 3 > FCT_MESH_LIMIT)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: its nodes place more than %llu triangles", r->name,
                        (unsigned long long)r->limit);
    fct_result result =
        fct_grow(r->env, (void **)&soup->corners, &r->corner_capacity, total, sizeof(uint32_t));
    if (result == FCT_OK && r->has_texcoords)
        result = fct_grow(r->env, (void **)&soup->texcoords, &r->texcoord_capacity, total, 2 * sizeof(float));
    if (result == FCT_OK && r->has_materials)
        result = fct_grow(r->env, (void **)&soup->materials, &r->material_capacity, total / 3 + 1,
                          sizeof(uint32_t));
    return result;
}

/* Finds the three places in the index list that form triangle k of a list (4), strip (5) or fan (6). */
static void find_places(int64_t mode, size_t k, size_t places[3]) {
    if (mode == 4) {
        for (size_t j = 0; j < 3; ++j) places[j] = 3 * k + j;
    } else if (mode == 5) {
        places[0] = k, places[1] = k + 1 + (k & 1), places[2] = k + 2 - (k & 1);
    } else {
        places[0] = k + 1, places[1] = k + 2, places[2] = 0;
    }
}

/* Appends the primitive's triangles. Its vertices begin at `first`. turn: reverse the winding. */
static fct_result append_triangles(reader *r, const primitive *p, uint32_t first, bool turn) {
    fct_soup *soup = r->soup;
    fct_glb_array indices = {0}, texcoords = {0};
    size_t vertices = soup->vertex_count - first, count = vertices;
    fct_result result = FCT_OK;
    if (p->indices >= 0) {
        result = fct_glb_array_of(&r->glb, p->indices, 1, 1, &indices);
        count = indices.count;
    }
    if (result == FCT_OK && r->has_texcoords && p->texcoord >= 0)
        result = get_array(r, p->texcoord, 2, 2, vertices, &texcoords);
    if (result != FCT_OK) return result;
    if (p->mode == 4 && count % 3)
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: a primitive's %zu indices are no triangles", r->name,
                        count);
    size_t triangles = p->mode == 4 ? count / 3 : count < 3 ? 0 : count - 2;
    result = grow_corners(r, 3 * triangles);
    if (result != FCT_OK) return result;
    for (size_t k = 0; k < triangles; ++k) {
        size_t places[3];
        find_places(p->mode, k, places);
        for (size_t j = 0; j < 3; ++j) {
            size_t place = places[turn && j ? 3 - j : j], corner = soup->corner_count + j;
            double index = p->indices >= 0 ? fct_glb_value(&indices, place, 0) : (double)place;
            if (!(index >= 0 && index < (double)vertices))
                return fct_fail(r->env, FCT_ERROR_DATA,
                                "%s: vertex index %.0f is out of range, of %zu vertices", r->name, index,
                                vertices);
            soup->corners[corner] = first + (uint32_t)index;
            for (int c = 0; r->has_texcoords && c < 2; ++c)
                soup->texcoords[2 * corner + c] =
                    p->texcoord >= 0 ? (float)fct_glb_value(&texcoords, (size_t)index, c) : 0;
        }
        if (r->has_materials)
            soup->materials[soup->corner_count / 3] = p->material >= 0 ? (uint32_t)p->material : r->unnamed;
        soup->corner_count += 3;
    }
    r->without_texcoord += r->has_texcoords && p->texcoord < 0 ? 3 * triangles : 0;
    return FCT_OK;
}

static bool share_vertices(const primitive *a, const primitive *b) {
    return a->position == b->position && a->normal == b->normal && a->color == b->color &&
           a->radiosity == b->radiosity;
}

static fct_result append_mesh(reader *r, int64_t index, const transform *t) {
    json_t *mesh, *object;
    size_t i;
    fct_result result = fct_glb_item(&r->glb, "meshes", index, &mesh);
    if (result != FCT_OK) return result;
    primitive before = {.position = FCT_GLB_ABSENT};
    uint32_t first = 0;
    bool turn = is_mirroring(t);
    json_array_foreach(json_object_get(mesh, "primitives"), i, object) {
        primitive p;
        result = read_primitive(r, object, &p);
        if (result != FCT_OK) return result;
        if (p.position == FCT_GLB_ABSENT) continue;
        if (p.mode > 6)
            return fct_fail(r->env, FCT_ERROR_DATA, "%s: a primitive of mode %lld", r->name,
                            (long long)p.mode);
        if (p.mode > 0 && p.mode < 4) {
            ++r->lines;
            continue;
        }
        if (!share_vertices(&before, &p)) {
            first = r->soup->vertex_count;
            result = append_vertices(r, t, &p);
        }
        if (result == FCT_OK && p.mode) result = append_triangles(r, &p, first, turn);
        if (result != FCT_OK) return result;
        before = p;
    }
    return FCT_OK;
}

static fct_result push_nodes(reader *r, json_t *nodes, const transform *to_world) {
    for (size_t i = json_array_size(nodes); i-- > 0;) {
        json_t *item = json_array_get(nodes, i);
        if (!json_is_integer(item))
            return fct_fail(r->env, FCT_ERROR_DATA, "%s: a node's number is no number", r->name);
        fct_result result =
            fct_grow(r->env, (void **)&r->stack, &r->stack_capacity, r->stack_count + 1, sizeof *r->stack);
        if (result != FCT_OK) return result;
        r->stack[r->stack_count++] = (visit){json_integer_value(item), *to_world};
    }
    return FCT_OK;
}

static fct_result visit_node(reader *r, const visit *v) {
    json_t *node;
    fct_result result = fct_glb_item(&r->glb, "nodes", v->node, &node);
    if (result != FCT_OK) return result;
    if (r->visited[v->node])
        return fct_fail(r->env, FCT_ERROR_DATA, "%s: node %lld has two parents", r->name, (long long)v->node);
    r->visited[v->node] = 1;
    transform local;
    int64_t mesh;
    result = read_transform(r, node, &local);
    if (result == FCT_OK) result = fct_glb_index(&r->glb, node, "mesh", &mesh);
    if (result != FCT_OK) return result;
    transform t = compose_transforms(&v->to_world, &local);
    if (mesh >= 0) result = append_mesh(r, mesh, &t);
    return result == FCT_OK ? push_nodes(r, json_object_get(node, "children"), &t) : result;
}

/* Pushes the root nodes: those of the scene, or all nodes without a parent if the file has no scene. */
static fct_result push_roots(reader *r, const transform *identity) {
    int64_t scene;
    json_t *object;
    fct_result result = fct_glb_index(&r->glb, r->glb.root, "scene", &scene);
    if (result != FCT_OK) return result;
    if (scene == FCT_GLB_ABSENT && count_of(r, "scenes")) scene = 0;
    if (scene != FCT_GLB_ABSENT) {
        result = fct_glb_item(&r->glb, "scenes", scene, &object);
        return result == FCT_OK ? push_nodes(r, json_object_get(object, "nodes"), identity) : result;
    }
    unsigned char *child = fct_allocate_zero(r->env, r->node_count, 1);
    if (!child) return fct_fail_memory(r->env, "nodes");
    json_t *node, *item;
    size_t i, j;
    json_array_foreach(json_object_get(r->glb.root, "nodes"), i, node)
        json_array_foreach(json_object_get(node, "children"), j, item) {
        int64_t number = json_integer_value(item);
        if (number >= 0 && (uint64_t)number < r->node_count) child[number] = 1;
    }
    for (i = r->node_count; result == FCT_OK && i-- > 0;) {
        if (child[i]) continue;
        result =
            fct_grow(r->env, (void **)&r->stack, &r->stack_capacity, r->stack_count + 1, sizeof *r->stack);
        if (result == FCT_OK) r->stack[r->stack_count++] = (visit){(int64_t)i, *identity};
    }
    fct_release(r->env, child);
    return result;
}

static fct_result visit_scene(reader *r) {
    transform identity = {.m = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, .identity = true};
    fct_result result = FCT_OK;
    r->node_count = count_of(r, "nodes");
    if (!r->node_count) { /* without nodes, each mesh is placed once */
        for (size_t i = 0; result == FCT_OK && i < count_of(r, "meshes"); ++i)
            result = append_mesh(r, (int64_t)i, &identity);
        return result;
    }
    r->visited = fct_allocate_zero(r->env, r->node_count, 1);
    if (!r->visited) return fct_fail_memory(r->env, "nodes");
    result = push_roots(r, &identity);
    for (size_t n = 0; result == FCT_OK && r->stack_count; ++n) {
        visit v = r->stack[--r->stack_count];
        if (n % 64 == 0) result = fct_progress(r->env, "read", (double)n / (double)(r->node_count + n));
        if (result == FCT_OK) result = visit_node(r, &v);
    }
    return result;
}

static void report_left_out(const reader *r) {
    if (r->without_color)
        fct_note(r->env, FCT_MESSAGE_WARNING, "%s: %zu vertices have no colour and get white", r->name,
                 r->without_color);
    if (r->without_texcoord)
        fct_note(r->env, FCT_MESSAGE_WARNING, "%s: %zu corners have no texture coordinate and get 0 0",
                 r->name, r->without_texcoord);
    if (r->lines || count_of(r, "skins") || count_of(r, "animations"))
        fct_note(r->env, FCT_MESSAGE_NOTE, "%s: lines, skins and animations are left out", r->name);
}

fct_result fct_read_glb(const fct_source *source, fct_soup *out) {
    reader r = {.env = source->env,
                .name = source->name,
                .soup = out,
                .limit = 64 * (uint64_t)source->size + 4000000};
    fct_result result = fct_glb_open(source, &r.glb);
    if (result == FCT_OK) result = choose_arrays(&r);
    if (result == FCT_OK) result = name_materials(&r);
    if (result == FCT_OK) result = grow_vertices(&r, 0);
    if (result == FCT_OK) result = grow_corners(&r, 0);
    if (result == FCT_OK && !out->positions) out->positions = fct_allocate(r.env, 0, 1);
    if (result == FCT_OK && !out->corners) out->corners = fct_allocate(r.env, 0, 1);
    if (result == FCT_OK && (!out->positions || !out->corners)) result = fct_fail_memory(r.env, "a mesh");
    if (result == FCT_OK) result = visit_scene(&r);
    if (result == FCT_OK) {
        out->polygon_count = (uint32_t)(out->corner_count / 3);
        report_left_out(&r);
    }
    fct_glb_close(&r.glb);
    fct_release(r.env, r.stack);
    fct_release(r.env, r.visited);
    return result;
}
