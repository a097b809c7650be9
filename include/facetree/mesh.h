/* facetree/mesh.h: indexed triangle meshes: load, save, inspect; glTF documents with other triangles.
 *
 * Face f and vertex v keep their numbers in every later step. Polygons become triangles in order, and
 * source_faces gives the polygon of each triangle. Loading repairs nothing: degenerate, duplicate and
 * non-manifold faces stay, and fct_mesh_inspect counts them.
 */
#ifndef FACETREE_MESH_H
#define FACETREE_MESH_H

#include "facetree/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The arrays of a mesh. Functions take `const fct_mesh *`, so a caller may point one at its own arrays. Call
 * fct_mesh_release only for a mesh that a facetree function created. */
typedef struct fct_mesh {
    uint32_t vertex_count;
    uint32_t face_count;
    float *positions;    /* vertex_count x 3, finite */
    uint32_t *triangles; /* face_count x 3, each < vertex_count */
    float *colors;       /* vertex_count x 3, linear light (radiosity in a baked mesh), or NULL */
    float *irradiance;   /* vertex_count x 3: the light that arrives per area, or NULL */
    float *direct;       /* vertex_count x 3: its part straight from the lamps, or NULL */
    float *indirect;     /* vertex_count x 3: its other part, or NULL */
    float *error;        /* vertex_count: expected RMS error of the light in `colors`, in its unit, or NULL */
    float *normals;      /* vertex_count x 3, or NULL */
    float *corner_normals; /* face_count x 3 x 3, per corner, or NULL: for vertices with several normals; then
                              `normals` is NULL. fct_scene_add_object alone uses them */
    float *texcoords;      /* face_count x 3 x 2, per corner, so seams need no extra vertices, or NULL */
    float *face_colors;    /* face_count x 3, linear, or NULL */
    uint32_t *materials;   /* face_count, index into material_names, or NULL */
    uint32_t *source_faces; /* face_count, polygon of each triangle, or NULL: the face number */
    uint32_t source_count;  /* polygons of the file, also those left out; 0 without source_faces */
    float *source_uv;       /* face_count x 3 x 2: where each corner lies in the triangle source_faces[f]: the
                               weights of that triangle's second and third corner; or NULL */
    uint32_t material_count;
    char **material_names; /* material_count strings, or NULL */
    double origin[3];      /* the vertex is at origin + position; 0 unless a reader set it (docs/mesh.md) */
} fct_mesh;

/* The optional arrays of fct_mesh_create. */
enum {
    FCT_MESH_COLORS = 1,
    FCT_MESH_NORMALS = 2,
    FCT_MESH_TEXCOORDS = 4,
    FCT_MESH_FACE_COLORS = 8,
    FCT_MESH_MATERIALS = 16,
    FCT_MESH_SOURCE_FACES = 32,
    FCT_MESH_SOURCE_UV = 64,
    FCT_MESH_IRRADIANCE = 128,
    FCT_MESH_DIRECT = 256,
    FCT_MESH_INDIRECT = 512,
    FCT_MESH_CORNER_NORMALS = 1024,
    FCT_MESH_ERROR = 2048
};

/* Allocates the arrays (contents undefined). On failure *out is all zero. Errors: MEMORY. */
FCT_API fct_result fct_mesh_create(const fct_env *env, uint32_t vertex_count, uint32_t face_count,
                                   unsigned arrays, fct_mesh *out);
/* Releases all arrays and zeroes the struct. env is the environment that created the mesh. */
FCT_API void fct_mesh_release(const fct_env *env, fct_mesh *mesh);
/* A deep copy. Errors: MEMORY. */
FCT_API fct_result fct_mesh_copy(const fct_env *env, const fct_mesh *mesh, fct_mesh *out);

/* Copies the `count` faces listed in `faces`, in that order, and their vertices in order of vertex id, with
 * all arrays. vertex_ids, if not NULL, receives an array of the old vertex ids (out->vertex_count). The
 * caller releases it with fct_memory_release. Errors: MEMORY. */
FCT_API fct_result fct_mesh_extract(const fct_env *env, const fct_mesh *mesh, const uint32_t *faces,
                                    uint32_t count, fct_mesh *out, uint32_t **vertex_ids);
FCT_API void fct_memory_release(const fct_env *env, void *memory);
/* Joins parts: their vertices, and their faces, one part after the other, with the arrays that all parts with
 * vertices or faces have, except materials. *out has the origin of the first part; all must have the same.
 * Errors: MEMORY (also above 2^31 vertices or faces). */
FCT_API fct_result fct_mesh_join(const fct_env *env, const fct_mesh *parts, size_t count, fct_mesh *out);

/* The attributes of a surface at one point. */
typedef struct fct_surface_point {
    unsigned found;  /* FCT_MESH_NORMALS, FCT_MESH_TEXCOORDS, FCT_MESH_COLORS: the members that are set; the
                        others are 0 */
    float normal[3]; /* unit length; 0 where the normals of the corners cancel */
    float texcoord[2];
    float color[3]; /* linear */
} fct_surface_point;
/* Interpolates the attributes at the point (1 - u - v) p0 + u p1 + v p2 of a face, as fct_hit and fct_closest
 * give it:
 *     a(u, v) = (1 - u - v) a0 + u a1 + v a2
 * a_k is that of corner k: of its vertex (`normals`, `colors`) or its own (`corner_normals`, `texcoords`). A
 * normal is divided by its length afterwards. A mesh without `colors` has one colour per face (`face_colors`)
 * or none. face < face_count; u and v are finite. */
FCT_API void fct_mesh_point(const fct_mesh *mesh, uint32_t face, float u, float v, fct_surface_point *out);

/* Counts of a mesh. All counts of defects are zero for a closed oriented manifold. */
typedef struct fct_mesh_report {
    uint32_t polygons;              /* faces before triangulation */
    uint32_t vertices, faces;       /* as in the mesh */
    uint32_t edges;                 /* distinct vertex pairs that are sides of a face */
    uint32_t boundary_edges;        /* sides of exactly one face */
    uint32_t boundary_loops;        /* connected sets of boundary edges */
    uint32_t nonmanifold_edges;     /* sides of three or more faces */
    uint32_t misoriented_edges;     /* of two faces that use the edge in the same direction */
    uint32_t nonmanifold_vertices;  /* whose faces form more than one fan */
    uint32_t degenerate_faces;      /* repeated index or zero area */
    uint32_t duplicate_faces;       /* same three vertices as an earlier face, in any order */
    uint32_t unreferenced_vertices; /* used by no face */
    uint32_t components;            /* of faces that share an edge */
    fct_bounds bounds;              /* of the positions, relative to the mesh's origin */
    double area;
    double diagonal; /* of the bounds */
} fct_mesh_report;

/* Inspects the mesh. O(F), parallel. Errors: MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_inspect(const fct_env *env, const fct_mesh *mesh, fct_mesh_report *report);

/* Checks that indices are in range, positions and attributes are finite, and the counts are below 2^31 - 1.
 * Errors: DATA. The message names the first wrong element. */
FCT_API fct_result fct_mesh_validate(const fct_env *env, const fct_mesh *mesh);

/* Reads OBJ, PLY (text, both byte orders, strips), OFF, STL (corners with equal coordinates become one
 * vertex), OM and glTF 2.0 (.glb, .gltf: meshes placed by their nodes; colours from _RADIOSITY, else
 * another light, else COLOR_0; buffers in the folder of the file or below, anywhere with env->allow_outside).
 * The ending of the name selects the format. "-" reads a PLY from standard input. Integer colours are sRGB
 * and become linear. Float colours are linear, those of OBJ sRGB. radiosity_r/g/b of a PLY replace its other
 * colours; without them irradiance_r/g/b do, or direct_, or indirect_. The error of light is `error` of a PLY
 * and _ERROR of glTF. A mesh without faces is valid.
 * Messages name the data that a mesh cannot store (lines, normals that differ by corner, ...). docs/mesh.md
 * lists the formats. Errors: INPUT, DATA (with file and line or element), MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_load(const fct_env *env, const char *path, fct_mesh *out);
/* The same with corner_normals, where the corners of a vertex have different normals in an OBJ. */
FCT_API fct_result fct_mesh_load_shaded(const fct_env *env, const char *path, fct_mesh *out);

/* The counts of a file that can be clustered without loading it (a binary PLY of triangles), from its header.
 * *known is false for other files. Errors: INPUT, DATA, MEMORY. */
FCT_API fct_result fct_mesh_file_counts(const fct_env *env, const char *path, bool *known,
                                        uint32_t *face_count, uint32_t *vertex_count);

/* Whether a glTF file stores light at its vertices (_RADIOSITY, _IRRADIANCE, ...), as a bake does. Such a
 * file is a lit mesh; another glTF file is a scene. *out is false for other kinds of files, and for pipes,
 * which can be read only once. Errors: INPUT, DATA, MEMORY. */
FCT_API fct_result fct_mesh_file_holds_light(const fct_env *env, const char *path, bool *out);

/* A hash that changes when the mesh of a file does: XXH3-64 of the bytes of the file and, for glTF, of the
 * files of its buffers behind them, in the order of the document. Buffers that cannot be read do not count:
 * whether the mesh needs them is for fct_mesh_load to say. Errors: INPUT, MEMORY. */
FCT_API fct_result fct_mesh_file_hash(const fct_env *env, const char *path, uint64_t *out);

typedef struct fct_mesh_save_def {
    uint32_t size;
    float exposure; /* factor on colours before they are clamped for display: PLY bytes, GLB COLOR_0; default
                       1 */
    bool ascii;     /* text instead of binary where the format has both; default false */
    unsigned display;  /* the light that makes the colours for display: FCT_MESH_COLORS (default),
                          FCT_MESH_IRRADIANCE, FCT_MESH_DIRECT or FCT_MESH_INDIRECT */
    bool no_radiosity; /* leave out the floats of mesh->colors; default false */
    bool sources;      /* PLY: write source_face and source_uv of each face; default false */
} fct_mesh_save_def;
FCT_API fct_mesh_save_def fct_mesh_save_def_default(void);

/* Writes .ply (binary little endian; colours as sRGB bytes and float radiosity_r/g/b), .obj, .off, .stl, .om
 * or .glb (unlit; COLOR_0 exposed, clamped and linear, and float _RADIOSITY). "-" writes a PLY to standard
 * output, and a pipe or a device without such an ending receives a PLY. Replaces the target as a whole:
 * temporary file, fsync, rename. PLY and GLB also write irradiance, direct and indirect light and their error
 * as floats (irradiance_r/g/b, ..., error; _IRRADIANCE, ..., _ERROR). PLY keeps every array except
 * source_faces and source_uv, bit for bit; fct_mesh_load skips these two. A note names the
 * arrays that the format cannot store. GLB groups faces by material and splits vertices whose texture
 * coordinates differ. OM keeps colours as bytes. def may be NULL. Errors: OUTPUT, DATA (unknown ending,
 * invalid mesh, a display that the mesh does not have), MEMORY, CANCELLED. */
FCT_API fct_result fct_mesh_save(const fct_env *env, const char *path, const fct_mesh *mesh,
                                 const fct_mesh_save_def *def);

/* ---- The triangles of a glTF document replaced ---- */

/* A glTF document that keeps its nodes with their names and transforms, its materials with their textures,
 * its cameras and lights. fct_gltf_open gives its triangles as one mesh in the world. The caller makes
 * another mesh from it, for instance with fct_simplify, and fct_gltf_save writes the document with the
 * triangles of that mesh. */
typedef struct fct_gltf fct_gltf;

/* Opens a .glb or .gltf and reads its meshes. Each mesh of the document is read once, at the place of the
 * first node that has it, however many nodes have it. mesh->materials holds the primitive of each face: a
 * number below mesh->material_count, without a name. A warning names what neither the mesh nor fct_gltf_save
 * keeps. *out keeps the file open; env must outlive it. Errors: INPUT, DATA, MEMORY, CANCELLED. */
FCT_API fct_result fct_gltf_open(const fct_env *env, const char *path, fct_gltf **out, fct_mesh *mesh);

/* Writes the document as a .glb with the faces of `mesh`, whose materials and origin are those of the mesh
 * that fct_gltf_open gave. Positions go back into the space of their node. Kept: positions, normals, the
 * first colours and texture coordinates, _RADIOSITY if the file had it; images are stored in the file. A
 * primitive without faces is left out, and so is a mesh without primitives; its node stays. Replaces the
 * target as fct_mesh_save does. def may be NULL. Errors: OUTPUT, DATA (mesh->materials absent or out of
 * range, other than .glb, more than 4 GB), INPUT (the file of a buffer), MEMORY, CANCELLED. */
FCT_API fct_result fct_gltf_save(fct_gltf *gltf, const char *path, const fct_mesh *mesh,
                                 const fct_mesh_save_def *def);
FCT_API void fct_gltf_close(fct_gltf *gltf);

#ifdef __cplusplus
}
#endif
#endif
