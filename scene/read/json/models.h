/* scene/read/json/models.h: models of scene.json. */
#ifndef FCT_SCENE_MODELS_H
#define FCT_SCENE_MODELS_H

#include "scene/read/json/document.h"
#include "scene/read/model_file.h"

/* Reads the table `models`, without opening their files. Errors: DATA, MEMORY. */
fct_result fct_document_read_models(fct_document *d);
void fct_document_release_models(fct_document *d);

/* Opens the model's file; fct_model_close frees *file. Errors: INPUT, DATA, MEMORY, CANCELLED. */
fct_result fct_document_open_model(fct_document *d, const fct_document_model *model, bool want_mesh,
                                   fct_model_file *file);
/* Fills file->mesh in input order if the file holds a hierarchy. Errors: MEMORY. */
fct_result fct_document_need_mesh(fct_document *d, fct_model_file *file);
/* Notes which models have colours that are light. */
void fct_document_mark_light(fct_document *d, const fct_model_file *file, const fct_scene_parts *parts);
/* Adds the model to the scene, as one model or as one per material of its mesh, unless it is there already.
 * Errors: INPUT, DATA, MEMORY, CANCELLED. */
fct_result fct_document_need_whole(fct_document *d, fct_document_model *model);
fct_result fct_document_need_split(fct_document *d, fct_document_model *model);

#endif
