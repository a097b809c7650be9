/* mesh/mesh.h: what the files of mesh/ share about an fct_mesh. */
#ifndef FCT_MESH_MESH_H
#define FCT_MESH_MESH_H

#include "base/env.h"
#include "facetree/mesh.h"

/* The most vertices, and the most faces, of a mesh: ids fit an int, and FCT_NONE is no id. */
#define FCT_MESH_LIMIT ((uint64_t)INT32_MAX - 1)

/* fct_mesh_validate whose messages begin with `name`. NULL: they begin with the element. */
fct_result fct_mesh_check(const fct_env *env, const char *name, const fct_mesh *mesh);

/* An array of a mesh. */
typedef struct fct_mesh_array {
    void *member;  /* where the mesh keeps the pointer to the array */
    size_t size;   /* bytes per element */
    unsigned bit;  /* FCT_MESH_, 0 for positions and triangles */
    bool of_faces; /* an element per face, else per vertex */
} fct_mesh_array;
enum { FCT_MESH_ARRAYS = 14 };
/* Lists all arrays, also those that are NULL. */
void fct_mesh_arrays(fct_mesh *mesh, fct_mesh_array out[FCT_MESH_ARRAYS]);
/* The FCT_MESH_ bits of the arrays that the mesh has. */
unsigned fct_mesh_bits(const fct_mesh *mesh);

/* Reverses the winding of every face. */
void fct_mesh_turn_over(fct_mesh *mesh);

static inline bool fct_mesh_has_origin(const fct_mesh *mesh) {
    return mesh->origin[0] != 0 || mesh->origin[1] != 0 || mesh->origin[2] != 0;
}

/* The index of the first value that is not finite, or count. */
size_t fct_first_not_finite(const float *values, size_t count);

/* A copy of text[0, length) with a final 0, or NULL without memory. */
char *fct_copy_text(const fct_env *env, const char *text, size_t length);
/* Copies `count` strings; NULL stays NULL. Errors: MEMORY, with *out = NULL. */
fct_result fct_names_copy(const fct_env *env, char *const *names, uint32_t count, char ***out);
/* Releases `count` strings and the array. NULL is allowed. */
void fct_names_release(const fct_env *env, char **names, uint32_t count);

#endif
