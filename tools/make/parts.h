/* tools/make/parts.h: example scenes and meshes: a growing mesh, shapes, smooth surfaces, and scenes. Lengths
 * are in metres, y is up. Every result depends only on the arguments and the seed.
 */
#ifndef FCT_TOOLS_PARTS_H
#define FCT_TOOLS_PARTS_H

#include "tools/kit/env.h"

typedef struct make_point {
    double x, y, z;
} make_point;

static inline make_point make_p(double x, double y, double z) {
    return (make_point){x, y, z};
}

/* --- A mesh that grows (mesh.c). After a failed allocation `failed` is set, and additions do nothing. --- */
typedef struct make_mesh {
    tool *t;
    float *positions;
    uint32_t *triangles;
    size_t vertex_count, vertex_capacity, face_count, face_capacity;
    bool failed;
} make_mesh;

/* Makes room for more elements, if their number is known. */
void make_reserve(make_mesh *m, size_t vertices, size_t faces);
uint32_t make_vertex(make_mesh *m, make_point p);
void make_triangle(make_mesh *m, uint32_t a, uint32_t b, uint32_t c);
void make_quad(make_mesh *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d);
/* A quad with four new vertices. */
void make_patch(make_mesh *m, make_point a, make_point b, make_point c, make_point d);
/* Reverses every triangle. */
void make_turn(make_mesh *m);
/* Writes the mesh and frees it. Fails if the mesh has failed. Returns an exit code. */
int make_save(make_mesh *m, const char *path);
void make_clear(make_mesh *m);

/* --- Closed and open shapes (shapes.c) --- */
/* An icosahedron with each face cut into frequency^2 triangles, projected to the sphere. */
void make_sphere(make_mesh *m, make_point center, double radius, uint32_t frequency);
/* A box of six sides. bottom, top: whether to include these sides. */
void make_box(make_mesh *m, make_point lower, make_point upper, bool bottom, bool top);
/* Turns a profile (radius, height) about the y axis through `center` in `segments` steps. Radius 0 at an end
 * closes the shape. A profile that goes upwards has its outside on the outer side. */
void make_lathe(make_mesh *m, make_point center, const double (*profile)[2], uint32_t count,
                uint32_t segments);
/* The height at a point of the unit square. */
typedef double make_height(double x, double z, uint64_t seed);
/* Hills and valleys from noise. */
make_height make_terrain_height;
/* n x n squares over the unit square, facing up. height NULL: the plane y = 0. */
void make_sheet(make_mesh *m, uint32_t n, make_height *height, uint64_t seed);
/* The vertex of the sheet in column i and row j. */
make_point make_sheet_vertex(uint32_t n, uint32_t i, uint32_t j, make_height *height, uint64_t seed);
/* Slender boxes at random positions and angles in the unit cube. */
void make_crates(make_mesh *m, uint32_t count, uint64_t seed);
void make_cylinder(make_mesh *m, uint32_t triangles);
void make_cube(make_mesh *m, uint32_t triangles);

/* --- A sheet of any size as a PLY file (sheet.c). Returns an exit code. --- */
int make_sheet_file(tool *t, const char *path, uint32_t n, make_height *height, bool inside);

/* --- Noise (noise.c) --- */
/* A hash of three integers and the seed; uniform in [0, 1). */
double make_hash(int64_t x, int64_t y, int64_t z, uint64_t seed);
/* Smooth noise in [-1, 1] with features of size 1. Its value at integer points is uniform; along each axis
 * the slope is at most 3. */
double make_noise(make_point p, uint64_t seed);

/* --- Smooth surfaces (surface.c) --- */
/* Negative inside. |f(p) - f(q)| <= slope |p - q|. */
typedef struct make_field {
    double (*value)(const void *user, make_point p);
    const void *user;
    double slope;
    make_point lower, upper; /* a box that contains the surface */
} make_field;
/* A closed manifold with about `triangles` triangles on the zero level. Returns an exit code. */
int make_surface(make_mesh *m, const make_field *field, uint32_t triangles);

/* --- Statues (statues.c): about one unit high, standing on y = 0 --- */
typedef enum make_statue {
    MAKE_TORSO,
    MAKE_KNOT,
    MAKE_GYROID,
    MAKE_SHELL,
    MAKE_BUST,
    MAKE_STATUES
} make_statue;
extern const char *const make_statue_names[];
int make_statue_mesh(make_mesh *m, make_statue statue, uint32_t triangles, uint64_t seed);
/* A fluted, hollow vase. From 2,000 triangles on the count is exact to 0.1 %. */
void make_vase(make_mesh *m, uint32_t triangles);

/* --- Scenes (museum.c, cornell.c): fill a folder and return an exit code --- */
typedef struct make_result {
    uint64_t triangles; /* over all instances */
    json_t *files;      /* array of the names of written files */
} make_result;
int make_museum(tool *t, const char *folder, uint32_t triangles, make_result *result);
int make_cornell(tool *t, const char *folder, uint32_t triangles, make_result *result);
/* Writes folder/name, adds it to result->files, and frees the mesh. */
int make_scene_part(make_mesh *m, const char *folder, const char *name, make_result *result);
/* Writes folder/scene.json and frees the document. */
int make_scene_file(tool *t, const char *folder, json_t *document, make_result *result);

/* --- The hall of the museum (hall.c) --- */
typedef enum make_hall_part {
    MAKE_FLOOR,
    MAKE_CARPET,
    MAKE_WALL_LEFT,
    MAKE_WALL_RIGHT,
    MAKE_WALL_ENDS,
    MAKE_CEILING,
    MAKE_STONE,
    MAKE_SKYLIGHT,
    MAKE_PANEL_WARM,
    MAKE_PANEL_COOL,
    MAKE_HALL_PARTS
} make_hall_part;
/* A square of the floor under an object: the floor has no faces there. */
typedef struct make_footprint {
    double x, z, half;
} make_footprint;
/* The closed shell, one mesh per material. */
void make_hall(make_mesh parts[MAKE_HALL_PARTS], const make_footprint *feet, uint32_t foot_count);
/* The positions of the columns (x and z on the right side; the left side mirrors them), and their size. */
enum { MAKE_BAYS = 6 };
extern const double make_column_z[MAKE_BAYS];
#define MAKE_COLUMN_X      3.75
#define MAKE_COLUMN_HALF   .25
#define MAKE_COLUMN_HEIGHT 4.
#define MAKE_AISLE_HEIGHT  4.25

#endif
