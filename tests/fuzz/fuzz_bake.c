/* A small scene that the bytes describe: an error, or light that is finite, not negative, and no more than
 * the lamps emit. Few rays and large triangles keep a bake short. */
#include "facetree/radiosity.h"
#include "fuzz/fuzz_bytes.h"
#include "fuzz/fuzz_scene.h"

/* Stored light may exceed the bound of the exact solution by the noise of few rays. */
#define NOISE 4

typedef struct room {
    const fct_env *env;
    fct_scene *scene;
    uint32_t materials;
    double most_emission, most_reflectance;
    bool bounded; /* light: a path of the reference may carry any multiple */
} room;

static void add_materials(room *r, fuzz_bytes *b) {
    r->materials = 1 + fuzz_below(b, 3);
    for (uint32_t i = 0; i < r->materials; ++i) {
        uint32_t flags = fuzz_byte(b), id;
        fct_material m = {.two_sided = flags & 1};
        for (int k = 0; k < 3; ++k) {
            m.reflectance[k] = (float)(.95 * fuzz_share(b));
            if (flags & 2) m.emission[k] = flags & 4 ? fuzz_real(b) : (float)fuzz_share(b);
        }
        if (flags == 255) m.reflectance[0] = fuzz_real(b);
        bool valid = true;
        for (int k = 0; k < 3; ++k)
            valid = valid && m.reflectance[k] >= 0 && m.reflectance[k] < 1 && m.emission[k] >= 0 &&
                    m.emission[k] < INFINITY;
        fct_result result = fct_scene_add_material(r->scene, &m, &id);
        fuzz_require(result == (valid ? FCT_OK : FCT_ERROR_DATA), "a material in range, and no other");
        if (!valid) m = (fct_material){.reflectance = {.5F, .5F, .5F}};
        if (!valid) fuzz_require(fct_scene_add_material(r->scene, &m, &id) == FCT_OK, "a grey material");
        for (int k = 0; k < 3; ++k) {
            r->most_emission = fmax(r->most_emission, (double)m.emission[k]);
            r->most_reflectance = fmax(r->most_reflectance, (double)m.reflectance[k]);
        }
    }
}

/* Axes may change places or point backwards; sizes are powers of two. Rarely anything. */
static void make_transform(fuzz_bytes *b, float t[12]) {
    uint32_t flags = fuzz_byte(b), turn = fuzz_below(b, 3);
    memset(t, 0, 12 * sizeof *t);
    for (uint32_t k = 0; k < 3; ++k) {
        double size = flags & 1u << k ? 4 : 1;
        t[4 * k + (k + turn) % 3] = (float)(flags & 8u << k ? -size : size);
        t[4 * k + 3] = flags & 64 ? fuzz_real(b) : (float)(fuzz_below(b, 9)) - 4;
    }
    if (flags & 128) t[fuzz_below(b, 12)] = fuzz_real(b);
}

static fct_mesh make_part(const fct_env *env, fuzz_bytes *b) {
    uint32_t kind = fuzz_below(b, 16);
    if (kind < 12) return fuzz_make_grid(env, 1, 1, false, 0);
    return kind < 15 ? fuzz_make_box(env, kind == 14, 0) : fuzz_make_mesh(env, b);
}

static void add_objects(room *r, fuzz_bytes *b) {
    uint32_t objects = 0;
    for (uint32_t count = 1 + fuzz_below(b, 3); count > 0; --count) {
        float transform[12];
        uint32_t ids[256], material = fuzz_below(b, r->materials);
        bool mixed = fuzz_flag(b);
        fct_mesh mesh = make_part(r->env, b);
        make_transform(b, transform);
        for (uint32_t f = 0; f < mesh.face_count && f < 256; ++f) ids[f] = (material + f / 2) % r->materials;
        fct_result result =
            fct_scene_add_object(r->scene, "part", &mesh, NULL, transform, material, mixed ? ids : NULL);
        fuzz_require(result == FCT_OK || result == FCT_ERROR_DATA, "an object, or an error");
        objects += result == FCT_OK;
        fct_mesh_release(r->env, &mesh);
        if (result != FCT_OK || !fuzz_flag(b)) continue;
        make_transform(b, transform);
        result = fct_scene_add_instance(r->scene, "copy", fuzz_below(b, objects), transform,
                                        fuzz_flag(b) ? FCT_NONE : material);
        fuzz_require(result == FCT_OK || result == FCT_ERROR_DATA, "an instance, or an error");
        objects += result == FCT_OK;
    }
}

/* Light of the exact solution is at most e / (1 - rho), with the largest e and rho of the scene. */
static void check_light(const room *r, const float *light, size_t count) {
    double most = NOISE * r->most_emission / (1 - r->most_reflectance);
    for (size_t i = 0; i < count; ++i) {
        fuzz_require(isfinite(light[i]) && light[i] >= 0, "light is finite and not negative");
        fuzz_require(!r->bounded || (double)light[i] <= most, "light is no more than lamps emit");
    }
}

static void check_stats(const fct_bake_stats *s) {
    double sum = s->power_absorbed + s->power_escaped;
    fuzz_require(s->power_emitted >= 0 && s->power_absorbed >= 0 && s->power_escaped >= 0, "power");
    fuzz_require(isfinite(s->power_emitted) && isfinite(sum) && isfinite(s->error_estimate), "is finite");
    fuzz_require(fabs(sum - s->power_emitted) <= .5 * s->power_emitted, "the power is balanced");
}

static void check_output(const room *r, fct_bake *bake, fuzz_bytes *b) {
    fct_mesh mesh;
    fct_scene_view view = fct_scene_get(r->scene);
    uint32_t counts[16], faces = 0;
    fuzz_require(fct_bake_mesh(bake, &mesh, counts) == FCT_OK, "a lit mesh");
    fuzz_require(fct_mesh_validate(r->env, &mesh) == FCT_OK, "which is valid");
    for (uint32_t i = 0; i < view.instance_count; ++i) faces += counts[i];
    fuzz_require(faces == mesh.face_count, "with the faces of all instances");
    if (mesh.vertex_count) check_light(r, mesh.colors, 3 * (size_t)mesh.vertex_count);
    fct_mesh_release(r->env, &mesh);
    float point[3] = {fuzz_real(b), fuzz_real(b), fuzz_real(b)}, normal[3] = {0, 0, fuzz_flag(b) ? -1 : 1};
    fct_probe probe;
    for (int k = 0; k < 3; ++k)
        if (!isfinite(point[k])) point[k] = 0;
    fuzz_require(fct_bake_probe(bake, 1, point, normal, &probe) == FCT_OK, "a probe");
    check_light(r, probe.radiosity, 3);
    check_light(r, probe.irradiance, 3);
}

static void run_bake(room *r, fuzz_bytes *b, uint32_t options, double share) {
    fct_scene_view view = fct_scene_get(r->scene);
    double diagonal = 0;
    for (int k = 0; k < 3; ++k)
        diagonal = hypot(diagonal, (double)view.bounds.upper[k] - (double)view.bounds.lower[k]);
    fct_bake_def def = fct_bake_def_default();
    def.method = (options & 7) == 7 ? FCT_BAKE_REFERENCE : FCT_BAKE_FACE;
    def.final = (options >> 3) % 3;
    def.error = options & 32 ? .01 : .3;
    def.samples = 1 + (options >> 6);
    def.indirect_only = options & 128;
    def.max_edge = diagonal * (.3 + share);
    r->bounded = def.method == FCT_BAKE_FACE;
    fct_bake *bake;
    fct_result result = fct_bake_create(r->env, r->scene, &def, &bake);
    fuzz_require(result == FCT_OK || result == FCT_ERROR_DATA, "a bake, or an error");
    fuzz_require((result == FCT_OK) == (bake != NULL), "a failure leaves nothing behind");
    if (result != FCT_OK) return;
    check_output(r, bake, b);
    fct_bake_stats stats = fct_bake_get_stats(bake);
    if (def.method == FCT_BAKE_FACE) check_stats(&stats);
    fct_bake_destroy(bake);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size + (1 << 13));
    fuzz_bytes b = fuzz_begin(data, size);
    room r = {.env = &env};
    uint32_t options = fuzz_byte(&b);
    double share = fuzz_share(&b);
    fuzz_require(fct_scene_create(&env, FCT_BACKEND_OBB, &r.scene) == FCT_OK, "an empty scene");
    add_materials(&r, &b);
    add_objects(&r, &b);
    if (fct_scene_commit(r.scene) == FCT_OK) {
        fuzz_use_scene(r.scene);
        run_bake(&r, &b, options, share);
    }
    fct_scene_destroy(r.scene);
    fuzz_end();
    return 0;
}
