/* mesh/save.c: the writer for a file's ending, around which the file is replaced as a whole. */
#define _GNU_SOURCE
#include <locale.h>
#include <string.h>
#include <strings.h>

#include "base/io/file.h"
#include "mesh/soup.h"
#include "mesh/write.h"

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
               {FCT_MESH_MATERIALS, m->materials, "materials"}};
    char text[128] = "";
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
        if ((arrays & all[i].flag) && all[i].there) strcat(strcat(text, *text ? ", " : ""), all[i].name);
    if (*text) fct_note(sink->env, FCT_MESSAGE_NOTE, "%s: this format has no place for %s", sink->name, text);
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
    return (fct_mesh_save_def){.size = sizeof(fct_mesh_save_def), .exposure = 1};
}

fct_result fct_mesh_save(const fct_env *env, const char *path, const fct_mesh *mesh,
                         const fct_mesh_save_def *def) {
    fct_mesh_save_def standard = fct_mesh_save_def_default();
    if (!def) def = &standard;
    if (def->size != sizeof *def || !(def->exposure >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "%s: a save def of another version, or a negative exposure",
                        path);
    const char *dot = strrchr(path, '.'), *ending = !strcmp(path, "-") ? "ply" : dot ? dot + 1 : "";
    job j = {{env, path, mesh, def}, find_writer(ending)};
    if (!j.write)
        return fct_fail(env, FCT_ERROR_DATA,
                        "%s: unknown kind of file; .ply, .obj, .off, .stl, .om and .glb are known", path);
    fct_result result = fct_mesh_check(env, path, mesh);
    if (result != FCT_OK) return result;
    /* printf writes a decimal comma where the program's locale has one. */
    locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!c) return fct_fail_memory(env, "a locale");
    locale_t before = uselocale(c);
    result = fct_file_write_atomic(env, path, produce, &j);
    uselocale(before);
    freelocale(c);
    return result;
}
