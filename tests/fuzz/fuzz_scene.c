/* Whatever the text is: an error, or a scene whose parts refer to one another in range and can be shot at. */
#include "fuzz/fuzz_scene.h"
#include "scene/read/load.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    limit.largest += FUZZ_IMAGE + 1100 * size;
    fct_scene *scene;
    fct_result result = fct_scene_parse_json(&env, "scene.json", (const char *)data, size, FUZZ_MODELS "/",
                                             FCT_BACKEND_OBB, &scene);
    fuzz_require((result == FCT_OK) == (scene != NULL), "a failed read leaves no scene");
    if (scene) {
        fuzz_use_scene(scene);
        fct_scene_destroy(scene);
    }
    fuzz_end();
    return 0;
}
