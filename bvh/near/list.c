/* bvh/near/list.c: see list.h. Adding costs O(1) while there is room, then O(log capacity). */
#include "bvh/near/list.h"

#include "base/sift.h"

static bool is_less(const void *items, size_t i, size_t j) {
    const uint32_t *id = items;
    return id[i] < id[j];
}

static void swap_ids(void *items, size_t i, size_t j) {
    uint32_t *id = items, kept = id[i];
    id[i] = id[j];
    id[j] = kept;
}

void fct_face_list_add(fct_face_list *list, uint32_t face) {
    uint32_t number = list->count++;
    if (number < list->capacity) {
        list->faces[number] = face;
        return;
    }
    if (list->capacity == 0) return;
    if (number == list->capacity) fct_sift_all(list->faces, list->capacity, is_less, swap_ids);
    if (face >= list->faces[0]) return;
    list->faces[0] = face;
    fct_sift_down(list->faces, 0, list->capacity, is_less, swap_ids);
}

void fct_face_list_finish(fct_face_list *list) {
    fct_sift_sort(list->faces, list->count < list->capacity ? list->count : list->capacity, is_less,
                  swap_ids);
}
