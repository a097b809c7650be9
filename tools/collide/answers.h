/* tools/collide/answers.h: the answers for many poses, on all threads. */
#ifndef FCT_TOOLS_COLLIDE_ANSWERS_H
#define FCT_TOOLS_COLLIDE_ANSWERS_H

#include "tools/collide/models.h"
#include "tools/collide/poses.h"

typedef enum collide_kind {
    COLLIDE_TOUCH,    /* whether faces meet, and a pair that does */
    COLLIDE_WITHIN,   /* whether the surfaces are within a distance */
    COLLIDE_DISTANCE, /* how far they are apart */
    COLLIDE_RELATION, /* whether they touch, or one holds the other */
    COLLIDE_PAIRS     /* all pairs of faces that meet, of two models or of one */
} collide_kind;

typedef struct collide_question {
    collide_kind kind;
    const collide_models *models;
    const collide_poses *poses;
    fct_distance_def distance; /* WITHIN: max_distance; DISTANCE: all */
    size_t limit;              /* PAIRS: per pose */
} collide_question;

/* The answer to one pose. */
typedef struct collide_answer {
    bool found;           /* faces meet, or are near enough; RELATION: not apart */
    fct_distance nearest; /* TOUCH: only its pair; DISTANCE: all */
    fct_relation relation;
    size_t pair_count;    /* PAIRS */
    fct_face_pair *pairs; /* pair_count; valid until the next answer is taken */
} collide_answer;

/* Takes answers in the order of the poses. */
typedef struct collide_answers {
    const collide_question *question;
    size_t next;                 /* the pose of the next answer */
    size_t first, end, capacity; /* the poses whose answers are known, and the most at one time */
    collide_answer *block;       /* of the poses [first, end) */
    fct_face_pair *slots;        /* PAIRS: `slot` pairs per answer of the block */
    size_t slot;
    fct_face_pair *large; /* PAIRS: all pairs of the one answer that has more */
    size_t large_capacity;
    fct_visits *chunk_visits; /* per chunk of the block */
    fct_visits visits;        /* of all answers so far */
    double seconds;           /* of the queries */
} collide_answers;

int collide_answers_open(tool *t, const collide_question *question, collide_answers *out);
/* The answer for pose a->next, which it advances. Returns an exit code. */
int collide_answers_take(tool *t, collide_answers *a, const collide_answer **out);
void collide_answers_close(tool *t, collide_answers *a);

#endif
