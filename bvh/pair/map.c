/* bvh/pair/map.c: see map.h. */
#include "bvh/pair/map.h"

#include "bvh/pair/pose.h"

/* What float arithmetic on a placed box errs by, as a share of the lengths that meet: its centre, its half
 * extents and the other model's extent. With u = 2^-24, an axis errs by 4 u, a product of two axes by 8 u,
 * and the vector between the centres along an axis by 8 u. Along a product of two axes, this vector then errs
 * by 36 u and the radii by 20 u. */
#define FLOAT_ERROR 0x1p-18
/* No vertex of a model is farther from its centre. */
#define MODEL_RADIUS 1.75
/* Lengths of the pose and of one model beside the other model are at most this, so that floats can hold them.
 */
#define MAX_RATIO 1e30

fct_pose fct_pose_identity(void) {
    return (fct_pose){.rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

/* The centre of a model, unscaled. */
static v3 find_center(const fct_bvh *bvh) {
    return fct_bvh_from_scaled(bvh, v3_load(bvh->center));
}

static double sum_sizes(v3 a) {
    return fabs(a.x) + fabs(a.y) + fabs(a.z);
}

/* Splits the rotation of the pose into a factor and a turn, and measures the skew of the turn. */
static bool split_rotation(const fct_pose *pose, double *factor, fct_space_map *out) {
    double sum = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) sum += pose->rotation[i][j] * pose->rotation[i][j];
    *factor = sqrt(sum / 3);
    if (!(*factor >= 1e-100 && *factor <= 1e100)) return false;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out->turn[i][j] = pose->rotation[i][j] / *factor;
    double largest = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            double dot = i == j ? -1 : 0;
            for (int k = 0; k < 3; ++k) dot += out->turn[k][i] * out->turn[k][j];
            largest = fct_max(largest, fabs(dot));
        }
    out->skew = 3 * largest;
    return true;
}

/* The inverse, up to the skew. */
static void invert_map(const fct_space_map *other, fct_space_map *out) {
    *out = (fct_space_map){
        .factor = 1 / other->factor, .skew = other->skew, .blur = other->blur / other->factor};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out->turn[i][j] = other->turn[j][i];
    v3 shift = fct_rotate(out->turn, v3_make(other->shift[0], other->shift[1], other->shift[2]));
    shift = v3_scale(shift, -out->factor);
    out->shift[0] = shift.x, out->shift[1] = shift.y, out->shift[2] = shift.z;
}

/* Sets what the placing of a box needs, from turn, factor, skew and blur, which are set already. */
static void prepare_placing(fct_space_map *map) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            map->columns[j][i] = map->turn[i][j];
            map->columns_float[j][i] = (float)map->turn[i][j];
        }
    map->factor_float = (float)map->factor;
    map->slack_per_size = FLOAT_ERROR + 4 * map->skew;
    map->slack = map->slack_per_size * MODEL_RADIUS + 4 * map->skew * MODEL_RADIUS * map->factor + map->blur;
}

bool fct_pair_map_set(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose, fct_pair_map *out) {
    if (!a->pairs || !b->pairs) return false;
    *out = (fct_pair_map){.a = a, .b = b, .pose = pose ? *pose : fct_pose_identity()};
    pose = &out->pose;
    double factor;
    if (!split_rotation(pose, &factor, &out->to_a)) return false;
    v3 moved = fct_rotate(pose->rotation, find_center(b));
    v3 translation = v3_make(pose->translation[0], pose->translation[1], pose->translation[2]);
    v3 center = find_center(a), shift = v3_scale(v3_sub(v3_add(moved, translation), center), a->scale);
    double far = (sum_sizes(moved) + sum_sizes(translation) + sum_sizes(center)) * a->scale;
    factor *= a->scale / b->scale;
    if (!(factor > 1 / MAX_RATIO && factor < MAX_RATIO && far < MAX_RATIO * fct_min(factor, 1))) return false;
    out->to_a.shift[0] = shift.x, out->to_a.shift[1] = shift.y, out->to_a.shift[2] = shift.z;
    out->to_a.factor = factor;
    out->to_a.blur = (far + factor) * 0x1p-48;
    invert_map(&out->to_a, &out->to_b);
    prepare_placing(&out->to_a);
    prepare_placing(&out->to_b);
    out->volume_of_b = (float)fct_min(factor * factor * factor, 1e38);
    return true;
}

void fct_pair_triangle_a(const fct_pair_map *map, uint32_t place, v3 p[3]) {
    const fct_tree_view *view = &map->a->view;
    for (int c = 0; c < 3; ++c)
        p[c] = v3_load(view->positions + 3 * (size_t)view->triangles[3 * (size_t)place + (size_t)c]);
}

void fct_pair_triangle_b(const fct_pair_map *map, uint32_t place, v3 p[3]) {
    const fct_tree_view *view = &map->b->view;
    for (int c = 0; c < 3; ++c) {
        v3 q = v3_load(view->positions + 3 * (size_t)view->triangles[3 * (size_t)place + (size_t)c]);
        p[c] = fct_pose_apply(&map->pose, q);
    }
}

static v3 box_center(const fct_pair_node *n, uint32_t slot) {
    return v3_make((double)n->center[0][slot], (double)n->center[1][slot], (double)n->center[2][slot]);
}

/* Sets `from` to the centre of the box in the coordinates of its leaf, and returns it, as rounded, relative
 * to the centre of the model. */
static v3 set_from(const fct_bvh *bvh, v3 center, fct_leaf_map *out) {
    v3 model = v3_load(bvh->center);
    v3_store(out->from, v3_add(model, center));
    return v3_sub(v3_load(out->from), model);
}

void fct_leaf_maps_set(const fct_pair_map *map, uint32_t box_a, uint32_t box_b, fct_leaf_maps *out) {
    const fct_pair_node *na = &map->a->pairs[box_a >> 3], *nb = &map->b->pairs[box_b >> 3];
    uint32_t sa = box_a & 7, sb = box_b & 7;
    const fct_space_map *to_a = &map->to_a;
    v3 center = box_center(na, sa);
    v3 from_a = v3_sub(set_from(map->a, center, &out->of_a), center);
    v3 from_b = set_from(map->b, box_center(nb, sb), &out->of_b);
    from_b = v3_scale(fct_rotate(to_a->turn, from_b), to_a->factor);
    from_b = v3_sub(v3_add(from_b, v3_make(to_a->shift[0], to_a->shift[1], to_a->shift[2])), center);
    double size = 0;
    for (int r = 0; r < 3; ++r) {
        v3 axis = v3_make((double)na->axes[r][0][sa], (double)na->axes[r][1][sa], (double)na->axes[r][2][sa]);
        v3_store(out->of_a.turn[r], axis);
        out->of_a.shift[r] = (float)v3_dot(axis, from_a);
        for (int j = 0; j < 3; ++j)
            out->of_b.turn[r][j] =
                (float)(to_a->factor *
                        (axis.x * to_a->turn[0][j] + axis.y * to_a->turn[1][j] + axis.z * to_a->turn[2][j]));
        double shift = v3_dot(axis, from_b);
        out->of_b.shift[r] = (float)shift;
        out->half_a[r] = na->half[r][sa];
        size += fabs(shift) + (double)na->half[r][sa] + (double)nb->half[r][sb] * to_a->factor;
    }
    double slack = FLOAT_ERROR * size + 4 * to_a->skew * size + to_a->blur;
    out->size = fct_round_up(size);
    out->slack = fct_round_up(slack);
}
