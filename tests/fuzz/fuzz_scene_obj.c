/* Whatever the text is: an error, or a scene that holds. The text up to the first zero byte is a library, and
 * the rest an OBJ, which may also name the library of the models' folder. */
#include <string.h>

#include "fuzz/fuzz_scene.h"
#include "scene/read/mtl.h"
#include "scene/read/obj.h"

static void read_library(const fct_env *env, const char *text, size_t size) {
    fct_scene *scene;
    fct_mtl mtl;
    fuzz_require(fct_scene_create(env, FCT_BACKEND_OBB, &scene) == FCT_OK, "an empty scene");
    fuzz_require(fct_mtl_create(scene, &mtl) == FCT_OK, "a table of materials");
    fct_text t = fct_text_begin(env, "library", text, size);
    fct_mtl_read(&mtl, FUZZ_MODELS "/", &t);
    fct_scene_view view = fct_scene_get(scene);
    for (uint32_t k = 0; k < view.material_count; ++k)
        for (int c = 0; c < 3; ++c) {
            float reflectance = view.materials[k].reflectance[c];
            fuzz_require(reflectance >= 0 && reflectance <= FCT_SCENE_MOST_REFLECTANCE, "reflectance");
        }
    fct_mtl_send_notes(&mtl, "scene");
    fct_mtl_release(&mtl);
    fct_scene_destroy(scene);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    limit.largest += FUZZ_IMAGE + 1100 * size;
    const char *text = (const char *)data, *zero = size ? memchr(text, 0, size) : NULL;
    size_t head = zero ? (size_t)(zero - text) : 0, skip = zero ? head + 1 : 0;
    fct_scene *scene;
    read_library(&env, text, head);
    fuzz_require(fct_scene_create(&env, FCT_BACKEND_OBB, &scene) == FCT_OK, "an empty scene");
    if (size > skip &&
        fct_scene_read_obj(scene, "scene", text + skip, size - skip, FUZZ_MODELS "/") == FCT_OK &&
        fct_scene_commit(scene) == FCT_OK)
        fuzz_use_scene(scene);
    fct_scene_destroy(scene);
    fuzz_end();
    return 0;
}
