/* mesh/sink.c: see sink.h. */
#define _GNU_SOURCE
#include "mesh/sink.h"

#include <locale.h>
#include <string.h>

#include "base/env.h"
#include "base/io/output.h"
#include "mesh/mesh.h"

void fct_note_left_out(const fct_sink *sink, unsigned arrays) {
    const fct_mesh *m = sink->mesh;
    const struct {
        unsigned flag;
        bool there;
        const char *name;
    } all[] = {{FCT_MESH_COLORS, m->colors, "colours"},
               {FCT_MESH_NORMALS, m->normals, "normals"},
               {FCT_MESH_TEXCOORDS, m->texcoords, "texture coordinates"},
               {FCT_MESH_FACE_COLORS, m->face_colors, "face colours"},
               {FCT_MESH_MATERIALS, m->materials, "materials"},
               {FCT_MESH_IRRADIANCE, m->irradiance, "irradiance"},
               {FCT_MESH_DIRECT, m->direct, "direct light"},
               {FCT_MESH_INDIRECT, m->indirect, "indirect light"},
               {FCT_MESH_ERROR, m->error, "the error of light"}};
    char text[192] = "";
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
        if ((arrays & all[i].flag) && all[i].there) strcat(strcat(text, *text ? ", " : ""), all[i].name);
    if (*text) fct_note(sink->env, FCT_MESSAGE_NOTE, "%s: this format has no place for %s", sink->name, text);
}

void fct_warn_of_origin(const fct_sink *sink) {
    const double *o = sink->mesh->origin;
    if (fct_mesh_has_origin(sink->mesh))
        fct_note(sink->env, FCT_MESSAGE_WARNING,
                 "%s: this format stores coordinates as floats, which lose digits this far from 0 "
                 "(about %g %g %g)",
                 sink->name, o[0], o[1], o[2]);
}

fct_result fct_sink_write(const fct_env *env, const char *path,
                          fct_result (*produce)(void *user, FILE *stream), void *user) {
    locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!c) return fct_fail_memory(env, "a locale");
    locale_t before = uselocale(c);
    fct_result result = fct_file_write_atomic(env, path, produce, user);
    uselocale(before);
    freelocale(c);
    return result;
}
