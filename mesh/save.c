/* mesh/save.c: selects the writer by the ending of the file name, and replaces the file as a whole. */
#define _GNU_SOURCE
#include "mesh/save.h"

#include <string.h>
#include <strings.h>

#include "base/io/output.h"
#include "mesh/glb/write/write.h"
#include "mesh/mesh.h"
#include "mesh/om/write.h"
#include "mesh/ply/write.h"
#include "mesh/text/write.h"

typedef fct_result writer(const fct_sink *sink, FILE *stream);

static writer *find_writer(const char *ending) {
    static const struct {
        const char *ending;
        writer *write;
    } formats[] = {{"ply", fct_write_ply}, {"obj", fct_write_obj}, {"off", fct_write_off},
                   {"stl", fct_write_stl}, {"glb", fct_write_glb}, {"om", fct_write_om}};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; ++i)
        if (!strcasecmp(formats[i].ending, ending)) return formats[i].write;
    return NULL;
}

typedef struct job {
    fct_sink sink;
    writer *write;
} job;

static fct_result produce(void *user, FILE *stream) {
    const job *j = user;
    return j->write(&j->sink, stream);
}

fct_mesh_save_def fct_mesh_save_def_default(void) {
    return (fct_mesh_save_def){.size = sizeof(fct_mesh_save_def), .exposure = 1, .display = FCT_MESH_COLORS};
}

fct_result fct_choose_display(const fct_env *env, const char *path, const fct_mesh *mesh, unsigned display,
                              float **out) {
    *out = display == FCT_MESH_IRRADIANCE ? mesh->irradiance
           : display == FCT_MESH_DIRECT   ? mesh->direct
           : display == FCT_MESH_INDIRECT ? mesh->indirect
                                          : mesh->colors;
    if (display == FCT_MESH_COLORS || *out) return FCT_OK;
    return fct_fail(env, FCT_ERROR_DATA, "%s: the mesh does not have the light to display (bit %u)", path,
                    display);
}

fct_result fct_mesh_save(const fct_env *env, const char *path, const fct_mesh *mesh,
                         const fct_mesh_save_def *def) {
    fct_mesh_save_def standard = fct_mesh_save_def_default();
    if (!def) def = &standard;
    if (def->size != sizeof *def || !(def->exposure >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "%s: a save def of another version, or a negative exposure",
                        path);
    const char *dot = strrchr(path, '.');
    fct_mesh shown = *mesh;
    job j = {{env, path, &shown, def, def->no_radiosity ? NULL : mesh->colors},
             find_writer(dot ? dot + 1 : "")};
    if (!j.write && (!strcmp(path, "-") || fct_output_is_device(path))) j.write = fct_write_ply;
    if (!j.write)
        return fct_fail(env, FCT_ERROR_DATA,
                        "%s: unknown kind of file; .ply, .obj, .off, .stl, .om and .glb are known", path);
    fct_result result = fct_mesh_check(env, path, mesh);
    if (result != FCT_OK) return result;
    result = fct_choose_display(env, path, mesh, def->display, &shown.colors);
    if (result != FCT_OK) return result;
    if (mesh->corner_normals)
        fct_note(env, FCT_MESSAGE_NOTE, "%s: normals that differ by corner are left out", path);
    return fct_sink_write(env, path, produce, &j);
}
