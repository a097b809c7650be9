/* facetree/mesh.h: indexed triangle meshes: load, save, inspect.
 *
 * Ids are the input's: face f and vertex v keep their numbers through every later step. Polygons become
 * triangles in order; source_faces tells which polygon a triangle came from. Nothing is repaired: degenerate,
 * duplicate and non-manifold faces stay and are counted by fct_mesh_inspect.
 */
#ifndef FACETREE_MESH_H
#define FACETREE_MESH_H

#include "facetree/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Arrays of a mesh. Functions take `const fct_mesh *`, so a caller may point one at arrays of its own without
 * a copy; only a mesh that a facetree function filled (fct_mesh_create, fct_mesh_load, ...) goes to
 * fct_mesh_release. */
typedef struct fct_mesh {
    uint32_t vertex_count;
    uint32_t face_count;
    float *positions;    /* vertex_count x 3, finite */
    uint32_t *triangles; /* face_count x 3, each < vertex_count */
    float *colors;       /* vertex_count x 3, linear light (radiosity in a baked mesh), or NULL */
    float *normals;      /* vertex_count x 3, or NULL */
    float *texcoords;    /* face_count x 3 x 2, per corner, so that seams double no vertex, or NULL */
    float *face_colors;  /* face_count x 3, linear, or NULL */
    uint32_t *materials; /* face_count, index into material_names, or NULL */
    uint32_t
        *source_faces; /* face_count, polygon of the file each triangle came from, or NULL: the same number */
    uint32_t material_count;
    char **material_names; /* material_count strings, or NULL */
} fct_mesh;

/* Which optional arrays fct_mesh_create makes. */
enum {
    FCT_MESH_COLORS = 1,
    FCT_MESH_NORMALS = 2,
    FCT_MESH_TEXCOORDS = 4,
    FCT_MESH_FACE_COLORS = 8,
    FCT_MESH_MATERIALS = 16,
    FCT_MESH_SOURCE_FACES = 32
};

/* Allocates the arrays (contents undefined). On failure *out is all zero. Errors: MEMORY. */
FCT_API fct_result fct_mesh_create(const fct_env *env, uint32_t vertex_count, uint32_t face_count,
                                   unsigned arrays, fct_mesh *out);
/* Frees every array and zeroes the struct; env must be the one the mesh was made with. */
FCT_API void fct_mesh_release(const fct_env *env, fct_mesh *mesh);
/* A deep copy. Errors: MEMORY. */
FCT_API fct_result fct_mesh_copy(const fct_env *env, const fct_mesh *mesh, fct_mesh *out);

/* The faces listed in `faces` (count of them, in that order) with the vertices they use, in order of vertex
 * id; all arrays come along. vertex_ids, if not NULL, receives an allocated array (out->vertex_count) of the
 * old vertex ids, to be freed by the caller through fct_memory_release. Errors: MEMORY. */
FCT_API fct_result fct_mesh_extract(const fct_env *env, const fct_mesh *mesh, const uint32_t *faces,
                                    uint32_t count, fct_mesh *out, uint32_t **vertex_ids);
FCT_API void fct_memory_release(const fct_env *env, void *memory);

/* What a file or a mesh holds; counts of zero mean a clean closed manifold. */
typedef struct fct_mesh_report {
    uint32_t polygons;          /* faces before triangulation: runs of source_faces, the face count without */
    uint32_t vertices, faces;   /* as in the mesh */
    uint32_t edges;             /* distinct vertex pairs that are sides of a face */
    uint32_t boundary_edges;    /* sides of exactly one face */
    uint32_t boundary_loops;    /* connected sets of boundary edges */
    uint32_t nonmanifold_edges; /* sides of three or more faces */
    uint32_t misoriented_edges; /* shared by two faces that run along it in the same direction */
    uint32_t nonmanifold_vertices;  /* whose faces form more than one fan */
    uint32_t degenerate_faces;      /* repeated index or zero area */
    uint32_t duplicate_faces;       /* same three vertices as an earlier face, in any order */
    uint32_t unreferenced_vertices; /* used by no face */
    uint32_t components;            /* of faces that share an edge */
    fct_bounds bounds;
    double area;
    double diagonal; /* of the bounds */
} fct_mesh_report;

/* Counts. O(F log F), parallel. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_inspect(const fct_env *env, const fct_mesh *mesh, fct_mesh_report *report);

/* Checks what the struct promises: indices in range, finite positions and attributes, F and V below 2^31 - 1,
 * a squared extent that a double can hold. Errors: DATA with the first offending element in the message. */
FCT_API fct_result fct_mesh_validate(const fct_env *env, const fct_mesh *mesh);

/* Reads OBJ, PLY (ascii, both byte orders, tristrips), OFF, STL (corners with equal coordinates are one
 * vertex), OM and GLB (all meshes placed by their nodes; _RADIOSITY if there, else COLOR_0, as colours),
 * chosen by the name's ending. Byte colours are sRGB and become linear; float colours are taken as linear;
 * radiosity_r/g/b of a PLY win over both.
 * "-" reads a PLY from standard input. A mesh without faces is valid input here.
 * What a file has and a mesh has no place for (lines, groups, normals that differ by corner, ...) is told in
 * a message. docs/mesh.md says what is read of each format. Errors: INPUT, DATA (with file, line or element),
 * MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_load(const fct_env *env, const char *path, fct_mesh *out);

/* Counts of a file that can be clustered without being loaded (binary PLY of triangles): *known tells whether
 * it is one. Reads its header alone. Errors: INPUT, DATA, MEMORY. */
FCT_API fct_result fct_mesh_file_counts(const fct_env *env, const char *path, bool *known,
                                        uint32_t *face_count, uint32_t *vertex_count);

typedef struct fct_mesh_save_def {
    uint32_t size;
    float exposure; /* factor on colours before they are clamped for display: PLY bytes, GLB COLOR_0; default
                       1 */
    bool ascii;     /* text instead of binary where the format has both; default false */
} fct_mesh_save_def;
FCT_API fct_mesh_save_def fct_mesh_save_def_default(void);

/* Writes .ply (binary little endian; colours as sRGB bytes plus float radiosity_r/g/b), .obj, .off, .stl, .om
 * or .glb (unlit; COLOR_0 exposed, clamped, linear, plus float _RADIOSITY). Atomic: a temporary file beside
 * the target, fsync, rename. "-" writes a PLY to standard output. PLY keeps every array but source_faces, bit
 * for bit; arrays that another format has no place for are told in a note. GLB groups faces by material and
 * splits vertices where texture coordinates differ; OM keeps colours as bytes. def may be NULL. Errors:
 * OUTPUT, DATA (unknown ending, invalid mesh), MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_save(const fct_env *env, const char *path, const fct_mesh *mesh,
                                 const fct_mesh_save_def *def);

#ifdef __cplusplus
}
#endif
#endif
