/* bvh/near/list.h: the faces that a query finds, in the caller's array, by ascending id. */
#ifndef FCT_BVH_LIST_H
#define FCT_BVH_LIST_H

#include <stdint.h>

/* Once more faces than `capacity` have been found, the array is a heap of the lowest ids. */
typedef struct fct_face_list {
    uint32_t *faces;
    uint32_t capacity, count; /* count: found so far, may exceed the capacity */
} fct_face_list;

void fct_face_list_add(fct_face_list *list, uint32_t face);
/* Sorts the array. */
void fct_face_list_finish(fct_face_list *list);

#endif
