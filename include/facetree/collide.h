/* facetree/collide.h: queries on two models: do they touch, where, how far are they apart, when do they meet.
 * docs/queries.md is the guide.
 *
 * Both models need FCT_BVH_PAIRS (bvh.h). A pose places model b in the coordinates of model a. Its rotation
 * may also scale or mirror. Any matrix gives correct answers, but one that shears or scales unequally gives
 * slow ones. A pose that is NULL is the identity.
 *
 * Faces are closed triangles. The corners of b are mapped by the pose in double, as
 * ((r0 x + r1 y) + r2 z) + t for each coordinate, and rounded once per operation. From there on, whether two
 * faces meet is decided by exact arithmetic: also where they are coplanar, or share a vertex or an edge. A
 * face without area meets nothing; its distance counts. Distances are computed in double.
 *
 * Queries do not allocate and do not fail, and any number of threads may ask. Nothing touches and no distance
 * is found if a model has no FCT_BVH_PAIRS; if the pose is not finite, or its rotation is zero; or if a
 * length of the pose beside a model, or the two models beside each other, have a ratio above 1e30. visits may
 * be NULL; it counts pairs of boxes, and pairs of triangles.
 */
#ifndef FACETREE_COLLIDE_H
#define FACETREE_COLLIDE_H

#include "facetree/bvh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* x -> rotation x + translation. */
typedef struct fct_pose {
    double rotation[3][3]; /* rows */
    double translation[3];
} fct_pose;
FCT_API fct_pose fct_pose_identity(void);

/* A face of a and a face of b. */
typedef struct fct_face_pair {
    uint32_t face_a, face_b;   /* input face ids; FCT_NONE if there is no pair */
    uint32_t place_a, place_b; /* their places in the trees' order */
} fct_face_pair;
/* All ids FCT_NONE. */
FCT_API fct_face_pair fct_face_pair_none(void);

/* A pair of boxes in the front of a search: see fct_pair_hint. */
typedef struct fct_front_pair {
    uint32_t box_a, box_b; /* names of boxes */
    uint32_t lanes;        /* bit i: box i of the node that was opened belongs to the pair; bit 8: a's node */
    float reach;           /* the pair is apart until b has come this far */
} fct_front_pair;
enum { FCT_FRONT_PAIRS = 128 };

/* What a query leaves for the next one about the same models, such as that of the next frame: it makes
 * queries about a slow motion faster. The faces that met, or were nearest, come first. The front of a search
 * for a contact is the set of pairs of boxes where it ended, because the boxes were apart. Each pair stays
 * apart until b has moved by the distance of the boxes, so the next search looks only at the others.
 *
 * A hint does not change whether faces meet, how many do, or the exact distance. It may change which pair
 * answers, and a distance within the tolerance. Keep one per pair of models and per thread. It is a value,
 * and owns nothing. What it knows about other models is not used. */
typedef struct fct_pair_hint {
    fct_face_pair pair; /* the last faces that met or were nearest; may be set in a new hint */
    /* The rest belongs to the queries. */
    uint64_t model_a, model_b; /* what the models of the last query hold, as hashes; 0 if there was none */
    fct_pose pose;             /* of the last query */
    bool stale;                /* the pair did not answer it */
    bool near;                 /* it looked for faces within a distance */
    bool touching;  /* it found a pair of faces; front[0] is their pair of leaves, and there is no front */
    uint32_t pause; /* searches that make no front, because b moves too fast */
    uint32_t front_count; /* pairs of the front */
    uint32_t effort;      /* boxes and leaves that its search tested */
    double way;           /* how far b has come since the front was made; at least, scaled */
    fct_front_pair front[FCT_FRONT_PAIRS];
} fct_pair_hint;
/* The first hint of a sequence. */
FCT_API fct_pair_hint fct_pair_hint_none(void);

/* Whether any two faces meet. `hint` may be NULL, as in all queries. If the result is true, hint->pair
 * receives a pair that meets. */
FCT_API bool fct_bvh_overlap(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, fct_pair_hint *hint,
                             fct_visits *visits);
/* The pairs of faces that meet, in an order that is the same for the same structures and pose. Stops after
 * `limit` pairs. The first `capacity` pairs are written; returns the number of pairs found. A hint changes
 * neither the pairs nor their order. */
FCT_API size_t fct_bvh_pairs(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, size_t limit,
                             size_t capacity, fct_face_pair *pairs, fct_pair_hint *hint, fct_visits *visits);
/* The pairs of faces of one model that meet and share no vertex position; each once, with face_a < face_b. */
FCT_API size_t fct_bvh_self_pairs(const fct_bvh *bvh, size_t limit, size_t capacity, fct_face_pair *pairs,
                                  fct_visits *visits);

/* Where two faces meet. All in the coordinates of a. */
typedef struct fct_contact {
    double from[3], to[3]; /* ends of the segment that both share; of faces in one plane: the two points of
                              their common region that are farthest apart */
    double normal[3]; /* unit: the direction in which the face of b leaves that of a by the shortest way */
    double depth;     /* the length of that way; 0 if the faces only touch */
} fct_contact;
/* Returns whether the faces meet; *out is undefined if they do not. */
FCT_API bool fct_bvh_contact(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose,
                             const fct_face_pair *pair, fct_contact *out);

typedef struct fct_distance_def {
    uint32_t size;             /* sizeof(fct_distance_def), set by fct_distance_def_default */
    double max_distance;       /* farther faces do not count; default: infinity */
    double relative, absolute; /* the result may exceed the distance d by relative d + absolute; default: 0 */
} fct_distance_def;
FCT_API fct_distance_def fct_distance_def_default(void);

typedef struct fct_distance {
    double distance;               /* 0 if faces meet */
    double point_a[3], point_b[3]; /* the nearest points, in the coordinates of a */
    fct_face_pair pair;
} fct_distance;
/* The distance of the two surfaces; returns whether it is within max_distance. def and hint may be NULL;
 * hint->pair receives the pair. A def of another size finds nothing. */
FCT_API bool fct_bvh_distance(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose,
                              const fct_distance_def *def, fct_pair_hint *hint, fct_distance *out,
                              fct_visits *visits);
/* Whether the surfaces are within `distance` of each other. */
FCT_API bool fct_bvh_within(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, double distance,
                            fct_pair_hint *hint, fct_visits *visits);

typedef enum fct_relation {
    FCT_APART,    /* no faces meet, and neither body holds a part of the other */
    FCT_TOUCHING, /* faces meet */
    FCT_A_INSIDE, /* no faces meet, and a connected part of a lies inside b */
    FCT_B_INSIDE  /* no faces meet, no part of a lies inside b, and a part of b lies inside a */
} fct_relation;
/* Inside is where the winding number of a surface is over 1/2 (bvh.h). Both models need FCT_BVH_SIGN too,
 * else only APART and TOUCHING are returned. */
FCT_API fct_relation fct_bvh_relation(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose,
                                      fct_pair_hint *hint, fct_visits *visits);

/* b moves from one pose to another in the time from 0 to 1: its centre along a straight line at constant
 * speed, while it turns about the axis and angle (under half a turn) between the two rotations at constant
 * speed. */
typedef struct fct_motion {
    fct_pose from, to; /* rotations: orthonormal, not mirrored */
} fct_motion;
/* The pose at a time. The centre is that of the bounds of b. */
FCT_API fct_pose fct_motion_at(const fct_bvh *b, const fct_motion *motion, double time);

typedef struct fct_first_contact {
    double time;   /* the surfaces are within `tolerance` at this time, and over tolerance / 2 apart before */
    fct_pose pose; /* of b at this time */
    fct_distance nearest; /* at this time */
} fct_first_contact;
/* Finds when the surfaces come within `tolerance` (> 0) of each other, by conservative
 * advancement (Mirtich 1996). A tolerance below 1e-5 of the longest way of a point of b counts as that.
 * Returns false if they stay apart, or if the motion is not one of rotations. */
FCT_API bool fct_bvh_first_contact(const fct_bvh *a, const fct_bvh *b, const fct_motion *motion,
                                   double tolerance, fct_first_contact *out, fct_visits *visits);

/* The answers for `count` poses, on the threads of a's environment. Bit i % 64 of touching[i / 64] is the
 * answer to pose i; `touching` has (count + 63) / 64 words. The answer to a pose is a hint for the next. */
FCT_API void fct_bvh_overlaps(const fct_bvh *a, const fct_bvh *b, size_t count, const fct_pose *poses,
                              uint64_t *touching);
/* out[i].pair has the faces FCT_NONE if nothing is within def's max_distance. */
FCT_API void fct_bvh_distances(const fct_bvh *a, const fct_bvh *b, size_t count, const fct_pose *poses,
                               const fct_distance_def *def, fct_distance *out);

/* A model under a pose, in the world. */
typedef struct fct_body {
    const fct_bvh *bvh;
    fct_pose pose;
} fct_body;
typedef struct fct_body_pair {
    uint32_t body_a, body_b; /* body_a < body_b */
    fct_face_pair faces;     /* a pair of their faces that meets */
} fct_body_pair;
/* All pairs of bodies that touch, ordered by body_a, then body_b. Bodies may share a model. Writes the first
 * `capacity` pairs; *found receives the number of all. The rotations must have an inverse. Errors: DATA (a
 * body without FCT_BVH_PAIRS, or a pose that is not finite or has no inverse; the message names it), MEMORY,
 * CANCELLED. */
FCT_API fct_result fct_bodies_touching(const fct_env *env, uint32_t count, const fct_body *bodies,
                                       size_t capacity, fct_body_pair *pairs, size_t *found);

/* The same from frame to frame: keeps a hint for each pair of bodies whose bounds met in the last frame
 * (about 2 KB), so bodies that move slowly take less time. It finds the same pairs of bodies, perhaps with
 * other faces. Bodies may be added at the end, and may change their models. */
typedef struct fct_body_tracker fct_body_tracker;
/* The environment must outlive the tracker. Errors: MEMORY. */
FCT_API fct_result fct_body_tracker_create(const fct_env *env, fct_body_tracker **out);
FCT_API void fct_body_tracker_destroy(fct_body_tracker *tracker);
/* Errors: as above; the tracker then keeps the last frame. One thread at a time. */
FCT_API fct_result fct_body_tracker_touching(fct_body_tracker *tracker, uint32_t count,
                                             const fct_body *bodies, size_t capacity, fct_body_pair *pairs,
                                             size_t *found);

#ifdef __cplusplus
}
#endif
#endif
