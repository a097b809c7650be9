/* mesh/glb/scene/build.c: builds the document: nodes, materials, and the pieces of lit meshes. */
#include <math.h>
#include <string.h>

#include "base/math/vec.h"
#include "mesh/glb/scene/pieces.h"
#include "mesh/glb/write/utf8.h"

/* Columns with a cosine below this are orthogonal: matrices of floats round by so much. Their rotation, scale
 * and translation then place points with the precision of floats. */
#define ORTHOGONAL 1e-6
#define DEGREE     (3.14159265358979323846 / 180)
/* glTF demands a near plane; the scene has none. */
#define NEAR_PLANE .01

static fct_result fail_json(const fct_glb_scene *s) {
    return fct_fail_memory(s->env, "the JSON of a glTF file");
}

static json_t *make_root(void) {
    char generator[64];
    snprintf(generator, sizeof generator, "Facetree %s", fct_version());
    return json_pack("{s:{s:s, s:s}}", "asset", "version", "2.0", "generator", generator);
}

fct_result fct_glb_scene_create(const fct_env *env, const char *document, fct_glb_scene **out) {
    *out = NULL;
    fct_glb_scene *s = fct_allocate_zero(env, 1, sizeof *s);
    if (!s) return fct_fail_memory(env, "a glTF document");
    s->env = env;
    fct_result result = document ? fct_gltf_open_document(env, document, &s->document) : FCT_OK;
    if (result == FCT_OK && document) result = fct_gltf_copy_root(s->document, &s->root);
    if (result == FCT_OK && !document && !(s->root = make_root())) result = fail_json(s);
    if (result == FCT_OK)
        *out = s;
    else
        fct_glb_scene_destroy(s);
    return result;
}

void fct_glb_release_piece(const fct_env *env, fct_glb_piece *piece) {
    for (size_t i = 0; i < piece->extra_count; ++i) fct_release(env, piece->extras[i].values);
    fct_release(env, piece->extras);
    fct_release(env, piece->name);
    fct_mesh_release(env, &piece->lit);
    *piece = (fct_glb_piece){0};
}

void fct_glb_scene_destroy(fct_glb_scene *s) {
    if (!s) return;
    const fct_env *env = s->env;
    for (size_t i = 0; i < s->piece_count; ++i) fct_glb_release_piece(env, s->pieces + i);
    fct_release(env, s->pieces);
    fct_release(env, s->spans);
    fct_release(env, s->variants);
    json_decref(s->root);
    fct_gltf_close(s->document);
    fct_release(env, s);
}

/* Appends an item to a list of an object, which is created if it is missing. Takes the item. *index (may be
 * NULL): its number. False without memory. */
static bool append_item(json_t *object, const char *list, json_t *item, size_t *index) {
    json_t *array = json_object_get(object, list);
    if (!array && !json_object_set_new(object, list, json_array())) array = json_object_get(object, list);
    if (index) *index = json_array_size(array);
    return item && array ? !json_array_append_new(array, item) : (json_decref(item), false);
}

static bool use_extension(fct_glb_scene *s, const char *name) {
    json_t *used = json_object_get(s->root, "extensionsUsed"), *item;
    size_t i;
    json_array_foreach(used, i,
                       item) if (json_is_string(item) && !strcmp(json_string_value(item), name)) return true;
    return append_item(s->root, "extensionsUsed", json_string(name), NULL);
}

/* Copies a name of at most 127 bytes. Bytes that are not UTF-8 become ?. */
static void copy_name(const char *name, char out[128]) {
    size_t at = 0;
    while (name[at] && at < 127) {
        const int length = fct_utf8_length((const unsigned char *)name + at);
        if (length == 0) out[at] = '?', ++at;
        if (at + (size_t)length > 127) break;
        for (int k = 0; k < length; ++k, ++at) out[at] = name[at];
    }
    out[at] = 0;
}

static json_t *make_text(const char *text) {
    char name[128];
    copy_name(text, name);
    return json_string(name);
}

static json_t *make_floats(const double *values, size_t count) {
    json_t *array = json_array();
    bool failed = !array;
    for (size_t i = 0; i < count && !failed; ++i)
        failed = json_array_append_new(array, json_real(values[i])) != 0;
    if (!failed) return array;
    json_decref(array);
    return NULL;
}

static json_t *make_colour(const float *values, double factor) {
    const double scaled[3] = {factor * (double)values[0], factor * (double)values[1],
                              factor * (double)values[2]};
    return make_floats(scaled, 3);
}

/* ---- Materials ---- */

fct_result fct_glb_scene_add_material(fct_glb_scene *s, const fct_glb_paint *paint) {
    const float *e = paint->emission;
    const double most = fmax((double)e[0], fmax((double)e[1], (double)e[2]));
    json_t *material = json_pack(
        "{s:o, s:{s:f, s:f}, s:{s:{}}, s:{s:o, s:o}}", "name", make_text(paint->name), "pbrMetallicRoughness",
        "metallicFactor", 0., "roughnessFactor", 1., "extensions", "KHR_materials_unlit", "extras",
        "reflectance", make_colour(paint->reflectance, 1), "emission", make_colour(e, 1));
    bool good = material && use_extension(s, "KHR_materials_unlit");
    if (good && paint->two_sided) good = !json_object_set_new(material, "doubleSided", json_true());
    if (good && most > 0)
        good = !json_object_set_new(material, "emissiveFactor", make_colour(e, most > 1 ? 1 / most : 1));
    if (good && most > 1)
        good =
            use_extension(s, "KHR_materials_emissive_strength") &&
            !json_object_set_new(json_object_get(material, "extensions"), "KHR_materials_emissive_strength",
                                 json_pack("{s:f}", "emissiveStrength", most));
    if (good) return append_item(s->root, "materials", material, NULL) ? FCT_OK : fail_json(s);
    json_decref(material);
    return fail_json(s);
}

/* The material that shows one side alone: itself, or a copy. */
static fct_result find_variant(fct_glb_scene *s, int64_t material, int64_t *out) {
    json_t *original = json_array_get(json_object_get(s->root, "materials"), (size_t)material), *copy;
    *out = material;
    if (!json_is_true(json_object_get(original, "doubleSided"))) return FCT_OK;
    const size_t before = s->variant_count, needed = (size_t)material + 1;
    fct_result result =
        fct_grow(s->env, (void **)&s->variants, &s->variant_capacity, needed, sizeof *s->variants);
    if (result != FCT_OK) return result;
    for (size_t i = before; i < needed; ++i) s->variants[i] = FCT_GLB_ABSENT;
    if (needed > before) s->variant_count = needed;
    if (s->variants[material] == FCT_GLB_ABSENT) {
        size_t index;
        copy = json_deep_copy(original);
        json_object_del(copy, "doubleSided");
        if (!append_item(s->root, "materials", copy, &index)) return fail_json(s);
        s->variants[material] = (int64_t)index;
    }
    *out = s->variants[material];
    return FCT_OK;
}

/* ---- Nodes ---- */

/* Columns of R. */
static void load_columns(const double m[12], v3 columns[3]) {
    for (int k = 0; k < 3; ++k) columns[k] = v3_make(m[k], m[4 + k], m[8 + k]);
}

bool fct_glb_scene_can_place(const double m[12]) {
    v3 c[3];
    load_columns(m, c);
    for (int k = 0; k < 3; ++k) {
        const v3 a = c[k], b = c[(k + 1) % 3];
        if (!(fabs(v3_dot(a, b)) <= ORTHOGONAL * v3_norm(a) * v3_norm(b))) return false;
    }
    return true;
}

/* The unit quaternion x y z w of a rotation with columns c. The largest component is found from the diagonal,
 * so that no small number is divided by. */
static void find_quaternion(const v3 c[3], double q[4]) {
    const double m[3][3] = {{c[0].x, c[1].x, c[2].x}, {c[0].y, c[1].y, c[2].y}, {c[0].z, c[1].z, c[2].z}};
    const double trace = m[0][0] + m[1][1] + m[2][2];
    int i = m[1][1] > m[0][0] ? 1 : 0;
    if (m[2][2] > m[i][i]) i = 2;
    if (trace > m[i][i]) {
        q[3] = 1 + trace;
        for (int k = 0; k < 3; ++k) q[k] = m[(k + 2) % 3][(k + 1) % 3] - m[(k + 1) % 3][(k + 2) % 3];
    } else {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        q[i] = 1 + m[i][i] - m[j][j] - m[k][k];
        q[j] = m[j][i] + m[i][j];
        q[k] = m[k][i] + m[i][k];
        q[3] = m[k][j] - m[j][k];
    }
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; ++k) q[k] /= length;
}

/* Sets translation, rotation and scale, each unless it is the identity. */
static bool set_transform(json_t *node, const double m[12]) {
    v3 c[3];
    load_columns(m, c);
    double scale[3], q[4], t[3] = {m[3], m[7], m[11]};
    for (int k = 0; k < 3; ++k) scale[k] = v3_norm(c[k]), c[k] = v3_unit(c[k]);
    if (v3_dot(c[0], v3_cross(c[1], c[2])) < 0) scale[0] = -scale[0], c[0] = v3_scale(c[0], -1);
    find_quaternion(c, q);
    bool good = true;
    if (t[0] != 0 || t[1] != 0 || t[2] != 0)
        good = !json_object_set_new(node, "translation", make_floats(t, 3));
    if (good && (q[0] != 0 || q[1] != 0 || q[2] != 0))
        good = !json_object_set_new(node, "rotation", make_floats(q, 4));
    if (good && (scale[0] != 1 || scale[1] != 1 || scale[2] != 1))
        good = !json_object_set_new(node, "scale", make_floats(scale, 3));
    return good;
}

/* Appends the node to the default scene, which is created if it is missing. */
static bool append_root(json_t *root, size_t node) {
    json_t *scenes = json_object_get(root, "scenes");
    const json_int_t number = json_integer_value(json_object_get(root, "scene"));
    if (json_array_size(scenes) == 0 && (!append_item(root, "scenes", json_object(), NULL) ||
                                         json_object_set_new(root, "scene", json_integer(0))))
        return false;
    json_t *scene = json_array_get(json_object_get(root, "scenes"), (size_t)number);
    return scene && append_item(scene, "nodes", json_integer((json_int_t)node), NULL);
}

fct_result fct_glb_scene_add_node(fct_glb_scene *s, const char *name, const double transform[12],
                                  uint32_t *out) {
    size_t index;
    json_t *node = json_pack("{s:o}", "name", make_text(name));
    if (!node) return fail_json(s);
    if (transform && !set_transform(node, transform)) {
        json_decref(node);
        return fail_json(s);
    }
    if (!append_item(s->root, "nodes", node, &index) || !append_root(s->root, index)) return fail_json(s);
    *out = (uint32_t)index;
    return FCT_OK;
}

fct_result fct_glb_scene_add_camera(fct_glb_scene *s, const double position[3], const float forward[3],
                                    const float up[3], double vertical_fov) {
    v3 z = v3_unit(v3_scale(v3_load(forward), -1)), x = v3_unit(v3_cross(v3_load(up), z));
    if (v3_norm2(z) == 0) z = v3_make(0, 0, 1);
    if (v3_norm2(x) == 0) x = v3_unit(v3_cross(fabs(z.x) < .9 ? v3_make(1, 0, 0) : v3_make(0, 1, 0), z));
    const v3 y = v3_cross(z, x);
    const double m[12] = {x.x, y.x, z.x, position[0], x.y, y.y, z.y, position[1], x.z, y.z, z.z, position[2]};
    uint32_t node;
    size_t camera;
    fct_result result = fct_glb_scene_add_node(s, "camera", m, &node);
    if (result != FCT_OK) return result;
    json_t *lens = json_pack("{s:s, s:{s:f, s:f}}", "type", "perspective", "perspective", "yfov",
                             vertical_fov * DEGREE, "znear", NEAR_PLANE);
    if (!append_item(s->root, "cameras", lens, &camera) ||
        json_object_set_new(json_array_get(json_object_get(s->root, "nodes"), node), "camera",
                            json_integer((json_int_t)camera)))
        return fail_json(s);
    return FCT_OK;
}

/* ---- Lit meshes ---- */

/* Appends a piece, which takes the mesh. */
static fct_result append_piece(fct_glb_scene *s, const fct_glb_lit *lit, fct_mesh *mesh,
                               fct_glb_piece **out) {
    fct_result result =
        fct_grow(s->env, (void **)&s->pieces, &s->piece_capacity, s->piece_count + 1, sizeof *s->pieces);
    if (result != FCT_OK) return result;
    *out = s->pieces + s->piece_count++;
    **out = (fct_glb_piece){.node = lit->node,
                            .mesh = lit->mesh,
                            .primitive = FCT_GLB_ABSENT,
                            .material = FCT_GLB_ABSENT,
                            .color_name = "COLOR_0",
                            .lit = *mesh};
    *mesh = (fct_mesh){0};
    return FCT_OK;
}

/* What the piece needs no longer. */
static void drop_sources(const fct_env *env, fct_mesh *mesh) {
    fct_release(env, mesh->source_faces);
    fct_release(env, mesh->source_uv);
    mesh->source_faces = NULL, mesh->source_uv = NULL;
}

static bool uses_all_vertices(const fct_env *env, const fct_mesh *mesh, fct_result *result) {
    uint8_t *used = fct_allocate_zero(env, mesh->vertex_count, 1);
    *result = used ? FCT_OK : fct_fail_memory(env, "a lit mesh");
    for (size_t c = 0; used && c < 3 * (size_t)mesh->face_count; ++c) used[mesh->triangles[c]] = 1;
    bool all = used && (!mesh->vertex_count || !memchr(used, 0, mesh->vertex_count));
    fct_release(env, used);
    return all;
}

/* The listed faces of a mesh as *out; all faces of a mesh without unused vertices are moved. */
static fct_result take_faces(const fct_env *env, fct_mesh *mesh, const uint32_t *faces, uint32_t count,
                             fct_mesh *out) {
    fct_result result = FCT_OK;
    if (count == mesh->face_count && uses_all_vertices(env, mesh, &result)) {
        *out = *mesh;
        *mesh = (fct_mesh){0};
        return FCT_OK;
    }
    return result == FCT_OK ? fct_mesh_extract(env, mesh, faces, count, out, NULL) : result;
}

/* One piece of the faces that come from a primitive of the document. */
static fct_result add_span(fct_glb_scene *s, const fct_glb_lit *lit, const fct_glb_span *span, fct_mesh *mesh,
                           const uint32_t *faces, uint32_t count) {
    json_t *primitives = json_object_get(
        json_array_get(json_object_get(s->document->glb.root, "meshes"), (size_t)span->mesh), "primitives");
    fct_mesh part = {0};
    fct_glb_piece *piece;
    int64_t material;
    uint32_t *corners = fct_allocate(s->env, count, 3 * sizeof *corners);
    if (!corners) return fct_fail_memory(s->env, "a lit mesh");
    for (size_t i = 0; i < count; ++i)
        memcpy(corners + 3 * i, lit->corners + 3 * (size_t)faces[i], 3 * sizeof *corners);
    fct_result result = take_faces(s->env, mesh, faces, count, &part);
    if (result == FCT_OK) result = append_piece(s, lit, &part, &piece);
    fct_mesh_release(s->env, &part);
    if (result == FCT_OK) {
        piece->primitive = span->primitive;
        result = fct_glb_fill_attributes(s, span, corners, lit, piece);
    }
    if (result == FCT_OK)
        result = fct_glb_index(&s->document->glb, json_array_get(primitives, (size_t)span->primitive),
                               "material", &material);
    if (result == FCT_OK && lit->one_sided && material >= 0)
        result = find_variant(s, material, &piece->material);
    if (result == FCT_OK) drop_sources(s->env, &piece->lit);
    fct_release(s->env, corners);
    return result;
}

/* Splits the mesh by the primitives that its faces come from. */
static fct_result add_spans(fct_glb_scene *s, const fct_glb_lit *lit, fct_mesh *mesh) {
    const fct_glb_span *spans;
    size_t count;
    uint32_t found = 0;
    const uint32_t total = mesh->face_count;
    fct_result result = fct_glb_find_spans(s, lit->mesh, &spans, &count);
    uint32_t *faces = result == FCT_OK ? fct_allocate(s->env, total, sizeof *faces) : NULL;
    if (result == FCT_OK && !faces) result = fct_fail_memory(s->env, "a lit mesh");
    for (size_t i = 0; i < count && result == FCT_OK && found < total; ++i) {
        uint32_t number = 0;
        for (uint32_t f = 0; f < total; ++f) {
            const uint64_t source = mesh->source_faces[f];
            if (source >= spans[i].first_face && source - spans[i].first_face < spans[i].face_count)
                faces[number++] = f;
        }
        found += number;
        if (number) result = add_span(s, lit, spans + i, mesh, faces, number);
    }
    if (result == FCT_OK && found < total)
        result = fct_glb_fail(&s->document->glb, "it is not the file that the scene was read from");
    fct_release(s->env, faces);
    return result;
}

/* In a new document. */
static fct_result add_plain(fct_glb_scene *s, const fct_glb_lit *lit, fct_mesh *mesh) {
    fct_glb_piece *piece;
    fct_mesh part = {0};
    fct_result result = FCT_OK;
    if (!uses_all_vertices(s->env, mesh, &result) && result == FCT_OK) {
        uint32_t *faces = fct_allocate(s->env, mesh->face_count, sizeof *faces);
        if (!faces) return fct_fail_memory(s->env, "a lit mesh");
        for (uint32_t f = 0; f < mesh->face_count; ++f) faces[f] = f;
        result = fct_mesh_extract(s->env, mesh, faces, mesh->face_count, &part, NULL);
        fct_release(s->env, faces);
        fct_mesh_release(s->env, mesh);
        *mesh = part;
    }
    if (result == FCT_OK) result = append_piece(s, lit, mesh, &piece);
    if (result != FCT_OK) return result;
    piece->material = lit->material;
    char name[128];
    copy_name(lit->name, name);
    piece->name = fct_copy_text(s->env, name, strlen(name));
    if (!piece->name) return fct_fail_memory(s->env, "a lit mesh");
    drop_sources(s->env, &piece->lit);
    return lit->one_sided ? find_variant(s, lit->material, &piece->material) : FCT_OK;
}

fct_result fct_glb_scene_add_lit(fct_glb_scene *s, const fct_glb_lit *lit, fct_mesh *mesh) {
    memset(mesh->origin, 0, sizeof mesh->origin);
    fct_result result = !mesh->face_count ? FCT_OK
                        : s->document     ? add_spans(s, lit, mesh)
                                          : add_plain(s, lit, mesh);
    fct_mesh_release(s->env, mesh);
    return result;
}
