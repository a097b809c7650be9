/* scene/read/json/document.h: the state of one scene.json while it is read, and values that several of its
 * parts use.
 *
 * A function that fails leaves json.path at the place of the error, because the message has already been
 * sent with it. A function that succeeds restores json.path.
 */
#ifndef FCT_SCENE_DOCUMENT_H
#define FCT_SCENE_DOCUMENT_H

#include "scene/read/json/json.h"
#include "scene/scene.h"

/* A model of the document. Its file is opened when an instance first needs it. */
typedef struct fct_document_model {
    const char *name; /* in the document */
    char *path;
    bool whole_there, split_there;
    uint32_t whole;        /* one model of the scene, if whole_there */
    fct_scene_parts split; /* one model per material of the mesh, if split_there */
    char **part_names;     /* split.count names of the mesh's materials */
} fct_document_model;

typedef struct fct_document {
    fct_json json;
    fct_scene *scene;
    const char *base; /* folder of relative paths */
    json_t *root;
    json_t *material_ids, *group_ids, *model_ids, *instance_names; /* name -> id */
    fct_document_model *models;
    size_t model_count;
    bool textured, colored; /* a material has a texture, or takes the vertex colours of its models */
    size_t clamped;         /* materials with texels that reflect too much */
} fct_document;

/* Records the id of a name. Errors: MEMORY. */
fct_result fct_document_set_id(fct_document *d, json_t *ids, const char *name, uint32_t id);
/* The id of the name that `value` holds; `what` names its kind in the message. Errors: DATA. */
fct_result fct_document_get_id(fct_document *d, const char *what, json_t *ids, const json_t *value,
                               uint32_t *id);

/* Reads one value of a table; the name has 1 to 63 bytes. */
typedef fct_result fct_document_reader(fct_document *d, const char *name, json_t *value);
/* Calls `read` per member of the table `key`, which is {"name": value, ...} or [{"name": ..., ...}, ...].
 * Names in `ids` are taken. Errors: DATA, and those of `read`. */
fct_result fct_document_read_table(fct_document *d, const char *key, json_t *ids, fct_document_reader *read);

/* Three numbers of a member; `out` is unchanged if the member is absent and not required. Errors: DATA. */
fct_result fct_document_read_vector(fct_document *d, const json_t *object, const char *key, bool required,
                                    float out[3]);

#endif
