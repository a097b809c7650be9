/* Whatever the bytes are: an error, or a scene that holds. A document in memory may not name files. */
#include "fuzz/fuzz_scene.h"
#include "scene/read/gltf.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    limit.largest += FUZZ_IMAGE + 1100 * size;
    fct_scene *scene;
    fuzz_require(fct_scene_create(&env, FCT_BACKEND_OBB, &scene) == FCT_OK, "an empty scene");
    if (fct_scene_read_gltf(scene, "scene", data, size, NULL) == FCT_OK && fct_scene_commit(scene) == FCT_OK)
        fuzz_use_scene(scene);
    fct_scene_destroy(scene);
    fuzz_end();
    return 0;
}
