/* tools/raycast/shots.h: shoots the rays of a file on all threads and writes their hits in order. */
#ifndef FCT_TOOLS_RAYCAST_SHOTS_H
#define FCT_TOOLS_RAYCAST_SHOTS_H

#include "tools/kit/rows.h"

/* The attributes that follow a hit, in this order. */
enum { RAYCAST_ATTRIBUTES = 3 };
typedef struct raycast_attributes {
    int count;
    unsigned kind[RAYCAST_ATTRIBUTES]; /* FCT_MESH_NORMALS, FCT_MESH_TEXCOORDS or FCT_MESH_COLORS */
} raycast_attributes;

typedef struct raycast_question {
    const fct_bvh *bvh;     /* of a mesh; NULL: of a scene */
    const fct_mesh *mesh;   /* for attributes; else NULL */
    const fct_scene *scene; /* or NULL */
    const tool_rows *rows;  /* rays: ox oy oz dx dy dz tmin tmax */
    double origin[3];       /* of the mesh or scene */
    bool occlusion, all;
    raycast_attributes attributes;
} raycast_question;

typedef struct raycast_totals {
    size_t hits;     /* in all */
    size_t rays_hit; /* rays with at least one hit */
    double seconds;  /* of the queries, and of making the lines of the output if there is one */
} raycast_totals;

/* Ray number i, relative to the origin. */
fct_ray raycast_ray(const tool_rows *rows, size_t i, const double origin[3]);

/* Writes the lines to -o or standard output; only counts with --json and without -o. Returns an exit code. */
int raycast_shoot(tool *t, const raycast_question *question, raycast_totals *totals);

#endif
