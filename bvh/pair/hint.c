/* bvh/pair/hint.c: see hint.h.
 *
 * If boxes are d apart, their faces stay apart while no point of b comes farther than d. A point x of b comes
 * |(R' - R) x + (t' - t)| from one pose to the next. This is convex in x, so over the bounds of b it is
 * largest at a corner.
 */
#include "bvh/pair/hint.h"

#include "bvh/pair/pose.h"

/* Rounding of the way and of a posed corner, as a share of the lengths that meet: more than 1000 times what
 * double arithmetic errs. */
#define ROUNDING 0x1p-40
/* Scaled. A reach is a float, so it errs by 2^-22 of the way. */
#define LONGEST_WAY 16.0

fct_face_pair fct_face_pair_none(void) {
    return (fct_face_pair){FCT_NONE, FCT_NONE, FCT_NONE, FCT_NONE};
}

fct_pair_hint fct_pair_hint_none(void) {
    return (fct_pair_hint){.pair = fct_face_pair_none()};
}

static v3 pose_shift(const fct_pose *pose) {
    return v3_make(pose->translation[0], pose->translation[1], pose->translation[2]);
}

/* A bound of the coordinates of posed corners and of what they are summed from. */
static double bound_lengths(const fct_bounds *b, const fct_pose *pose) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
        sum += fabs(pose->translation[i]);
        for (int j = 0; j < 3; ++j)
            sum += fabs(pose->rotation[i][j]) * fct_max(fabs((double)b->lower[j]), fabs((double)b->upper[j]));
    }
    return sum;
}

/* A bound of how far a point of b has come, rounding included. */
static double bound_way(const fct_bounds *b, const fct_pose *from, const fct_pose *to) {
    v3 middle = v3_sub(pose_shift(to), pose_shift(from)), half[3];
    for (int k = 0; k < 3; ++k) {
        double lower = (double)b->lower[k], upper = (double)b->upper[k];
        v3 column = v3_sub(fct_matrix_column(to->rotation, k), fct_matrix_column(from->rotation, k));
        middle = v3_mad(middle, (lower + upper) / 2, column);
        half[k] = v3_scale(column, (upper - lower) / 2);
    }
    double most2 = 0;
    for (int corner = 0; corner < 4; ++corner) {
        v3 way = v3_mad(half[0], corner & 1 ? -1 : 1, half[1]);
        way = v3_mad(way, corner & 2 ? -1 : 1, half[2]);
        v3 one = v3_add(middle, way), other = v3_sub(middle, way);
        most2 = fct_max(most2, fct_max(v3_dot(one, one), v3_dot(other, other)));
    }
    return sqrt(most2) + ROUNDING * (bound_lengths(b, from) + bound_lengths(b, to));
}

void fct_hint_move(const fct_pair_map *map, fct_pair_hint *hint, bool near) {
    if (hint->model_a != map->a->pair_stamp || hint->model_b != map->b->pair_stamp || hint->near != near) {
        hint->near = near;
        hint->model_a = map->a->pair_stamp, hint->model_b = map->b->pair_stamp;
        hint->touching = false, hint->front_count = hint->pause = 0;
    }
    if (hint->front_count) hint->way += bound_way(&map->b->bounds, &hint->pose, &map->pose) * map->a->scale;
    if (!(hint->way < LONGEST_WAY)) hint->front_count = 0;
    hint->pose = map->pose;
}
