/* tools/bake/normals.c: see normals.h. */
#include "tools/bake/normals.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/kit/options.h"

#define CREASE "crease="

const char *bake_name_normals(fct_normals rule) {
    static const char *const names[] = {"file", "crease", "flat"};
    return names[rule];
}

/* An angle over 0 and up to 180 degrees, or NAN. */
static double read_angle(const char *text) {
    char *end = NULL;
    const double angle = *text >= '!' ? strtod(text, &end) : NAN;
    return end && !*end && angle > 0 && angle <= 180 ? angle : NAN;
}

error_t bake_parse_normals(struct argp_state *state, const char *text, fct_bake_def *def) {
    const size_t prefix = strlen(CREASE);
    if (!strcmp(text, "file") || !strcmp(text, "flat")) {
        def->normals = text[1] == 'i' ? FCT_NORMALS_FILE : FCT_NORMALS_FLAT;
        return 0;
    }
    if (strncmp(text, CREASE, prefix))
        return tool_usage(state, "--normals: expected file, crease=DEG or flat, found '%s'", text);
    const double angle = read_angle(text + prefix);
    if (isnan(angle))
        return tool_usage(state, "--normals: expected an angle over 0 and up to 180 degrees, found '%s'",
                          text + prefix);
    def->normals = FCT_NORMALS_CREASE;
    def->crease = angle;
    return 0;
}

void bake_warn_normals(tool *t, const fct_bake_stats *stats) {
    if (stats->normals_unusable)
        tool_warn(
            t,
            "%llu of %llu normals at corners of triangles are zero or turn away from their triangle; the "
            "triangles around them decide there",
            (unsigned long long)stats->normals_unusable, (unsigned long long)stats->normals_given);
}
