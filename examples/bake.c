/* Computes the light in a small room, stores it as vertex colours, and simplifies the mesh.
 *
 * Writes room.ply with sRGB colours for viewers and the light as radiosity_r, _g, _b. A closed room absorbs
 * all light of the lamp: the example checks the balance.
 */
#include <math.h>
#include <stdio.h>

#include <facetree/facetree.h>

static void print_error(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

/* Adds a box. inwards: the faces look inside, as the walls of a room. */
static fct_result add_box(fct_scene *scene, const fct_env *env, const char *name, const float center[3],
                          const float half[3], bool inwards, uint32_t material) {
    static const uint32_t corners[36] = {0, 4, 6, 6, 2, 0, 1, 3, 7, 7, 5, 1, 0, 1, 5, 5, 4, 0,
                                         2, 6, 7, 7, 3, 2, 0, 2, 3, 3, 1, 0, 4, 5, 7, 7, 6, 4};
    fct_mesh mesh;
    fct_result result = fct_mesh_create(env, 8, 12, 0, &mesh);
    if (result != FCT_OK) return result;
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < 3; ++k) mesh.positions[3 * i + k] = center[k] + (i >> k & 1 ? half[k] : -half[k]);
    for (int c = 0; c < 36; ++c) mesh.triangles[c] = corners[inwards ? 35 - c : c];
    result = fct_scene_add_object(scene, name, &mesh, NULL, NULL, material, NULL);
    fct_mesh_release(env, &mesh);
    return result;
}

static fct_result make_room(fct_scene *scene, const fct_env *env) {
    fct_material white = {.name = "white", .reflectance = {.7F, .68F, .65F}};
    fct_material red = {.name = "red", .reflectance = {.65F, .15F, .1F}};
    fct_material lamp = {.name = "lamp", .emission = {12, 11, 9}};
    uint32_t ids[3];
    fct_result result = fct_scene_add_material(scene, &white, ids);
    if (result == FCT_OK) result = fct_scene_add_material(scene, &red, ids + 1);
    if (result == FCT_OK) result = fct_scene_add_material(scene, &lamp, ids + 2);
    if (result == FCT_OK)
        result = add_box(scene, env, "room", (float[]){0, 0, 1.25F}, (float[]){2, 2, 1.25F}, true, ids[0]);
    if (result == FCT_OK)
        result =
            add_box(scene, env, "block", (float[]){.5F, .3F, .5F}, (float[]){.4F, .4F, .5F}, false, ids[1]);
    if (result == FCT_OK)
        result = add_box(scene, env, "lamp", (float[]){0, 0, 2.3F}, (float[]){.4F, .4F, .05F}, false, ids[2]);
    return result == FCT_OK ? fct_scene_commit(scene) : result;
}

static bool report_balance(const fct_bake_stats *stats) {
    double out = stats->power_absorbed + stats->power_escaped, gap = fabs(out / stats->power_emitted - 1);
    printf("emitted %.3f, absorbed %.3f, escaped %.3f: closed within %.2f %%\n", stats->power_emitted,
           stats->power_absorbed, stats->power_escaped, 100 * gap);
    return stats->converged && gap < .01;
}

int main(void) {
    fct_env env = fct_env_default();
    env.message = print_error;
    fct_scene *scene = NULL;
    fct_bake *bake = NULL;
    fct_mesh lit = {0}, small = {0};
    fct_bake_def bake_def = fct_bake_def_default();
    fct_result result = fct_scene_create(&env, FCT_BACKEND_OBB, &scene);
    if (result == FCT_OK) result = make_room(scene, &env);
    if (result == FCT_OK) result = fct_bake_create(&env, scene, &bake_def, &bake);
    if (result == FCT_OK) result = fct_bake_mesh(bake, &lit, NULL);

    fct_simplify_def simplify_def = fct_simplify_def_default();
    simplify_def.target_faces = lit.face_count / 10;
    fct_simplify_stats simplified = {0};
    if (result == FCT_OK) result = fct_simplify(&env, &lit, &simplify_def, &small, &simplified);
    fct_mesh_save_def save_def = fct_mesh_save_def_default();
    if (result == FCT_OK) result = fct_mesh_save(&env, "room.ply", &small, &save_def);

    bool good = result == FCT_OK;
    if (good) {
        fct_bake_stats stats = fct_bake_get_stats(bake);
        good = report_balance(&stats);
        printf("room.ply: %u triangles of %u\n", simplified.faces_after, simplified.faces_before);
    }
    fct_mesh_release(&env, &small);
    fct_mesh_release(&env, &lit);
    fct_bake_destroy(bake);
    fct_scene_destroy(scene);
    return !good;
}
