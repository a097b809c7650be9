/* tools/bake/outputs.c: see outputs.h. */
#include "tools/bake/outputs.h"

#include <string.h>

#include "tools/kit/options.h"

static const struct output {
    const char *name;
    unsigned light;
} outputs_table[] = {{"radiosity", FCT_MESH_COLORS}, {"irradiance", FCT_MESH_IRRADIANCE},
                     {"direct", FCT_MESH_DIRECT},    {"indirect", FCT_MESH_INDIRECT},
                     {"error", FCT_MESH_ERROR},      {"normal", FCT_MESH_NORMALS}};

enum { OUTPUTS = sizeof outputs_table / sizeof *outputs_table };

/* The light of the name text[0, length), or 0. */
static unsigned find_light(const char *text, size_t length) {
    for (int i = 0; i < OUTPUTS; ++i)
        if (strlen(outputs_table[i].name) == length && !strncmp(outputs_table[i].name, text, length))
            return outputs_table[i].light;
    return 0;
}

error_t bake_parse_outputs(struct argp_state *state, const char *text, bake_outputs *out) {
    *out = (bake_outputs){0};
    for (const char *name = text;; ++name) {
        const size_t length = strcspn(name, ",");
        const unsigned light = find_light(name, length);
        if (!light || light & out->lights)
            return tool_usage(state,
                              "--light: expected a list of radiosity, irradiance, direct, indirect, "
                              "error and normal, found '%.*s'%s",
                              (int)length, name, light ? " twice" : "");
        if (!out->first && light & (FCT_MESH_NORMALS | FCT_MESH_ERROR))
            return tool_usage(state, "--light: the first quantity makes the colours, found '%.*s'",
                              (int)length, name);
        if (!out->first) out->first = light;
        out->lights |= light;
        name += length;
        if (!*name) break;
    }
    if (out->lights & FCT_MESH_ERROR && !(out->lights & FCT_MESH_COLORS))
        return tool_usage(state, "--light: error is that of radiosity, and needs it in the list");
    return 0;
}

json_t *bake_list_outputs(const bake_outputs *outputs) {
    json_t *list = json_array();
    for (int first = 1; first >= 0; --first)
        for (int i = 0; i < OUTPUTS; ++i) {
            const unsigned light = outputs_table[i].light;
            if (light & outputs->lights && (light == outputs->first) == first)
                json_array_append_new(list, json_string(outputs_table[i].name));
        }
    return list;
}

void bake_set_save(const bake_outputs *outputs, fct_mesh_save_def *def) {
    def->display = outputs->first;
    def->no_radiosity = !(outputs->lights & FCT_MESH_COLORS);
}
