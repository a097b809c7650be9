/* Bounds of the distances of eight triangles and eight boxes, against distances in double. */
#include "packed.h"

#include "base/math/simd.h"
#include "bvh/near/measure.h"

/* A leaf of `count` triangles over `vertex_count` vertices, in a room for the largest leaf. */
typedef struct leaf_room {
    union {
        fct_leaf leaf;
        char bytes[512];
    } u;
    v3 vertices[16];
} leaf_room;

static void set_vertices(leaf_room *room, uint32_t vertex_count) {
    fct_leaf *leaf = &room->u.leaf;
    float *rows = (float *)(void *)(room->u.bytes + sizeof *leaf + 24 * (size_t)fct_leaf_octets(leaf));
    uint32_t stride = 8u * leaf->vertex_octets;
    for (uint32_t i = 0; i < stride; ++i) {
        float p[3];
        v3_store(p, room->vertices[i < vertex_count ? i : 0]);
        for (uint32_t k = 0; k < 3; ++k) rows[k * stride + i] = p[k];
        if (i < vertex_count) room->vertices[i] = v3_load(p);
    }
}

/* The corners of a triangle differ, but for every eighth triangle of leaves with `degenerate`. */
static void set_corners(leaf_room *room, uint32_t vertex_count, bool degenerate, uint64_t *seed) {
    uint8_t *corners = (uint8_t *)room->u.bytes + sizeof(fct_leaf);
    for (uint32_t i = 0; i < 8; ++i) {
        uint32_t first = (uint32_t)(random_next(seed) % vertex_count);
        for (uint32_t c = 0; c < 3; ++c) {
            uint32_t next = degenerate && i == 7 ? c / 2 : c;
            corners[8 * c + i] = (uint8_t)((first + next) % vertex_count);
        }
    }
}

/* A leaf is within a limit, unless all vertices lie beyond it on the way to the nearest one. Of vertices that
 * are equally near up to rounding, any is the nearest. */
static void leaf_is_within(const fct_leaf *leaf, const fct_at *at, const fct_near_vertices *vertices) {
    const float *rows = fct_leaf_vertices(leaf);
    uint32_t stride = 8u * leaf->vertex_octets;
    double nearest2 = INFINITY, least = INFINITY, most = 0;
    v3 from = v3_load(at->at), v[16];
    for (uint32_t i = 0; i < stride; ++i) {
        v[i] = v3_sub(v3_make((double)rows[i], (double)rows[stride + i], (double)rows[2 * stride + i]), from);
        nearest2 = fmin(nearest2, v3_norm2(v[i]));
    }
    for (uint32_t i = 0; i < stride; ++i) {
        double bound = INFINITY;
        if (v3_norm2(v[i]) > nearest2 * (1 + 3e-6)) continue;
        for (uint32_t j = 0; j < stride; ++j) bound = fmin(bound, v3_dot(v[j], v3_unit(v[i])));
        least = fmin(least, bound), most = fmax(most, bound);
    }
    double below = least - at->margin, above = most + at->margin;
    assert_true(fct_leaf_within(vertices, leaf->vertex_octets, (float)(above * above)));
    if (below > 0) assert_false(fct_leaf_within(vertices, leaf->vertex_octets, (float)(below * below)));
}

/* Every bound holds within the margin. If `tight`, both bounds are within the margin of the distance. */
static void bounds_hold(const fct_bvh *bvh, leaf_room *room, v3 point, bool tight) {
    const fct_leaf *leaf = &room->u.leaf;
    fct_at at = fct_at_make(bvh, point);
    fct_near_vertices vertices;
    fct_near_vertices_load(leaf, &at, &vertices);
    fct_eight_near near = fct_measure_triangles(&vertices, leaf->vertex_octets, fct_leaf_corners(leaf));
    float upper2[8], plane[8];
    f8_store(upper2, near.upper2), f8_store(plane, near.plane);
    leaf_is_within(leaf, &at, &vertices);
    v3 from = v3_load(at.at);
    for (uint32_t i = 0; i < 8; ++i) {
        v3 t[3];
        fct_leaf_triangle(leaf, i, t);
        double distance = v3_norm(v3_sub(plain_closest(from, t), from));
        double upper = sqrt((double)upper2[i]), lower = plane[i] > 0 ? (double)plane[i] / upper : 0;
        assert_true(upper >= distance - at.margin && lower <= distance + at.margin);
        if (tight) assert_true(upper <= distance + at.margin && lower >= distance - 8 * at.margin);
        /* The mask includes each triangle whose lower bound is below the limit, and no other. */
        uint32_t bit = 1u << i;
        float limit = (float)(lower * 1.00001), smaller = (float)(lower * .99999);
        assert_true(fct_triangles_within(&near, limit * limit + 1e-30f) & bit);
        if (lower > 1e-6) assert_false(fct_triangles_within(&near, smaller * smaller) & bit);
    }
}

/* Triangles of one size, from 1 to 10^-6, with the point as far away as their size and much farther. */
static void triangles_lie_between_their_bounds(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 8, 3), FCT_BACKEND_OBB);
    uint64_t seed = 7;
    for (uint32_t i = 0; i < 4000; ++i) {
        leaf_room room;
        uint32_t octets = 1 + i % 2, vertex_count = 5 + 7 * (octets - 1);
        double size = exp2(-20 * random_unit(&seed)), reach = i % 5 == 0 ? 1e3 : i % 3 ? 4 * size : 1;
        bool needles = i % 7 == 0;
        room.u.leaf = (fct_leaf){.count = 8, .vertex_octets = (uint8_t)octets};
        v3 middle = v3_scale(random_direction(&seed), .3), axis = random_direction(&seed);
        for (uint32_t k = 0; k < vertex_count; ++k) {
            v3 d = random_direction(&seed);
            if (needles) d = v3_add(v3_scale(axis, random_unit(&seed)), v3_scale(d, 1e-5));
            room.vertices[k] = v3_mad(middle, size, d);
        }
        set_corners(&room, vertex_count, needles, &seed);
        set_vertices(&room, vertex_count);
        v3 point = v3_mad(middle, reach * random_unit(&seed), random_direction(&seed));
        /* The lower bound of a triangle far smaller than its distance is as good as a float. */
        bounds_hold(m.bvh, &room, point, !needles && reach == 1 && size < .1);
    }
    model_release(&env, &m);
}

/* The point is a corner, or lies on a side or inside: the distance is 0 and no triangle is lost. */
static void triangles_that_hold_the_point_are_within(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    model m = model_make(&env, make_pebble(&env, 8, 3), FCT_BACKEND_OBB);
    uint64_t seed = 11;
    for (uint32_t i = 0; i < 2000; ++i) {
        leaf_room room;
        room.u.leaf = (fct_leaf){.count = 8, .vertex_octets = 1};
        for (uint32_t k = 0; k < 6; ++k) room.vertices[k] = v3_scale(random_direction(&seed), .5);
        set_corners(&room, 6, false, &seed);
        set_vertices(&room, 6);
        v3 t[3];
        uint32_t number = i % 8;
        fct_leaf_triangle(&room.u.leaf, number, t);
        double u = i % 3 ? random_unit(&seed) : 0, v = i % 5 ? (1 - u) * random_unit(&seed) : 0;
        v3 point = v3_add(v3_scale(t[0], 1 - u - v), v3_add(v3_scale(t[1], u), v3_scale(t[2], v)));
        fct_at at = fct_at_make(m.bvh, point);
        fct_near_vertices vertices;
        fct_near_vertices_load(&room.u.leaf, &at, &vertices);
        fct_eight_near near = fct_measure_triangles(&vertices, 1, fct_leaf_corners(&room.u.leaf));
        float upper2[8];
        f8_store(upper2, near.upper2);
        double reach = at.margin + at.rounding;
        assert_true(sqrt((double)upper2[number]) <= 4 * reach); /* thin triangles choose a point beside it */
        assert_true(fct_triangles_within(&near, (float)(reach * reach)) >> number & 1);
    }
    model_release(&env, &m);
}

static void boxes_have_their_distance(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[2] = {make_pebble(&env, 24, 3), make_bars(&env, 12, 3)};
    uint32_t kinds = 0;
    for (int k = 0; k < 2; ++k) {
        model m = model_make(&env, meshes[k], FCT_BACKEND_OBB);
        uint64_t seed = 5;
        uint32_t refs[64] = {m.bvh->root}, count = 1;
        for (uint32_t r = 0; r < count; ++r) {
            kinds |= is_oriented(refs[r]) ? 2 : 1;
            v3 point = v3_scale(random_direction(&seed), 2 * random_unit(&seed));
            fct_at at = fct_at_make(m.bvh, point);
            float distance2[8], limit2 = .5f;
            const uint32_t *child;
            uint32_t met = fct_measure_children(m.bvh, refs[r], &at, limit2, distance2, &child);
            for (uint32_t i = 0; i < child_count(m.bvh, refs[r]); ++i) {
                plain_box box = box_of(m.bvh, refs[r], i);
                double expected = plain_box_distance(&box, v3_load(at.at));
                assert_true(fabs(sqrt((double)distance2[i]) - expected) < 1e-5);
                assert_int_equal(met >> i & 1, distance2[i] <= limit2);
                assert_int_equal(child[i], child_of(m.bvh, refs[r], i));
                if (!is_leaf(child[i]) && count < 64) refs[count++] = child[i];
            }
            assert_int_equal(met >> child_count(m.bvh, refs[r]), 0);
        }
        model_release(&env, &m);
    }
    assert_int_equal(kinds, 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_lie_between_their_bounds),
        cmocka_unit_test(triangles_that_hold_the_point_are_within),
        cmocka_unit_test(boxes_have_their_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
