/* bench/queries/sides.h: the libraries that answer the same queries, each as one table of functions.
 *
 * A side answers a question for an array of queries and writes one number per query, so that the same code
 * times all sides and compares their answers. The loop over the queries is inside the side: no call through a
 * pointer per query.
 */
#ifndef FCT_BENCH_QUERIES_SIDES_H
#define FCT_BENCH_QUERIES_SIDES_H

#include "facetree/facetree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum bench_question {
    BENCH_CLOSEST_HIT,     /* fct_ray -> t, or infinity */
    BENCH_ANY_HIT,         /* fct_ray -> 1 or 0 */
    BENCH_ALL_HITS,        /* fct_ray -> number of hits */
    BENCH_CLOSEST_POINT,   /* float[3] -> distance */
    BENCH_SIGNED_DISTANCE, /* float[3] -> distance, negative inside */
    BENCH_INSIDE,          /* float[3] -> 1 inside of the surface, else 0 */
    BENCH_NEAREST,         /* float[3] -> distance of the eighth nearest face */
    BENCH_BALL,            /* bench_ball -> number of faces that touch the ball */
    BENCH_BOX,             /* bench_ball -> number of faces that touch the cube around the ball */
    BENCH_OVERLAP,         /* fct_pose of the model beside itself -> 1 or 0 */
    BENCH_PATH,            /* the same for poses that follow each other */
    BENCH_PAIRS,           /* fct_pose of the model beside itself -> number of pairs of faces that meet */
    BENCH_WITHIN,          /* bench_near -> whether the surfaces are within the distance: 1 or 0 */
    BENCH_DISTANCE,        /* fct_pose of the model beside itself -> distance of the surfaces */
    BENCH_RELATION,        /* fct_pose of the model beside itself -> fct_relation */
    BENCH_FIRST_CONTACT,   /* fct_motion of the model beside itself -> time */
    BENCH_EXCEPT,          /* bench_except -> t of the closest hit of another face, or infinity */
    BENCH_QUESTIONS
} bench_question;

typedef struct bench_ball {
    float center[3], radius;
} bench_ball;
typedef struct bench_except {
    fct_ray ray;
    uint32_t face;
} bench_except;
typedef struct bench_near {
    fct_pose pose;
    double distance;
} bench_near;

typedef void bench_ask(void *model, size_t count, const void *queries, double *answers);

typedef struct bench_side {
    const char *name;
    uint32_t most_triangles; /* larger meshes are not given to this side */
    bool whole;              /* uses the threads by itself: its queries are not shared out to threads */
    bool alone;              /* cannot answer overlaps on two threads at once */
    bool no_sign;            /* its signed distances are all positive */
    /* The structure of a mesh, which must outlive it; NULL if the side cannot hold this mesh. The tree is for
     * ours. */
    void *(*build)(const fct_mesh *mesh, const fct_tree *tree, uint32_t threads);
    void (*destroy)(void *model);
    size_t (*bytes)(const void *model); /* NULL: the growth of the heap counts */
    bench_ask *ask[BENCH_QUESTIONS];    /* NULL where the side has no such query; NaN: not of this mesh */
    /* For each of `frames` x `count` poses of copies of the model: the number of pairs of bodies that touch,
     * per frame. NULL if the side has no broad phase. */
    void (*count_touching)(void *model, uint32_t count, uint32_t frames, const fct_pose *poses,
                           double *pairs);
    /* The Hausdorff distance of two meshes, up to `error`. NULL if the side has none. */
    double (*find_hausdorff)(const fct_mesh *a, const fct_mesh *b, double error);
} bench_side;

/* Ours first; those that were found when the program was built. */
extern const bench_side *const bench_sides[];
extern const size_t bench_side_count;

extern const bench_side bench_facetree, bench_batch, bench_embree, bench_robust, bench_cgal, bench_bullet,
    bench_fcl;

/* The structure of a model of bench_facetree. */
const fct_bvh *bench_own_bvh(const void *model);
/* Adds the visits of such a model for the same queries. */
void bench_count_visits(const void *model, bench_question question, size_t count, const void *queries,
                        fct_visits *visits);

#ifdef __cplusplus
}
#endif
#endif
