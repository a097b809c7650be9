/* Moves one mesh towards another: how far apart they are, when they meet, and which faces touch.
 *
 * usage: collide [A B]      default: two balls, whose answers are known
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <facetree/facetree.h>

enum { RINGS = 63, SPOKES = 128, SHOWN = 4 };

static void print_error(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

/* A ball of radius 1: rings of vertices between two poles. */
static fct_result make_ball(const fct_env *env, fct_mesh *mesh) {
    uint32_t top = RINGS * SPOKES, bottom = top + 1, last = top - SPOKES;
    fct_result result = fct_mesh_create(env, top + 2, 2 * RINGS * SPOKES, 0, mesh);
    if (result != FCT_OK) return result;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        double a = 3.141592653589793 * (v / SPOKES + 1) / (RINGS + 1),
               b = 6.283185307179586 * (v % SPOKES) / SPOKES;
        float *p = mesh->positions + 3 * (size_t)v;
        p[0] = (float)(v < top ? sin(a) * cos(b) : 0), p[1] = (float)(v < top ? sin(a) * sin(b) : 0);
        p[2] = v == top ? 1 : v == bottom ? -1 : (float)cos(a);
    }
    uint32_t *t = mesh->triangles;
    for (uint32_t j = 0; j < SPOKES; ++j) {
        uint32_t next = (j + 1) % SPOKES;
        *t++ = top, *t++ = j, *t++ = next;
        *t++ = bottom, *t++ = last + next, *t++ = last + j;
        for (uint32_t i = 0; i < last; i += SPOKES) {
            *t++ = i + j, *t++ = i + SPOKES + j, *t++ = i + SPOKES + next;
            *t++ = i + j, *t++ = i + SPOKES + next, *t++ = i + next;
        }
    }
    return FCT_OK;
}

typedef struct model {
    fct_tree *tree;
    fct_bvh *bvh;
} model;

static fct_result open_model(const fct_env *env, const char *path, model *out) {
    fct_mesh mesh = {0};
    fct_tree_def tree_def = fct_tree_def_default();
    fct_bvh_def bvh_def = fct_bvh_def_default();
    bvh_def.parts = FCT_BVH_PAIRS;
    fct_result result = path ? fct_mesh_load(env, path, &mesh) : make_ball(env, &mesh);
    if (result == FCT_OK) result = fct_tree_build(env, &mesh, &tree_def, NULL, &out->tree);
    if (result == FCT_OK) result = fct_bvh_build(env, out->tree, &bvh_def, &out->bvh);
    fct_mesh_release(env, &mesh);
    return result;
}

/* From beside a, turned by 45 degrees, to the centre of a. */
static fct_motion plan_motion(const fct_bvh *a, const fct_bvh *b) {
    const double c = .70710678118654752;
    fct_bounds at = fct_bvh_bounds(a), own = fct_bvh_bounds(b);
    fct_motion motion = {{{{c, -c, 0}, {c, c, 0}, {0, 0, 1}}, {0, 0, 0}}, fct_pose_identity()};
    for (int k = 0; k < 3; ++k) {
        double middle = ((double)own.lower[k] + own.upper[k]) / 2;
        motion.to.translation[k] = ((double)at.lower[k] + at.upper[k]) / 2 - middle;
        for (int i = 0; i < 3; ++i)
            motion.from.translation[i] -= (motion.from.rotation[i][k] - (i == k)) * middle;
    }
    double side = ((double)at.upper[0] - at.lower[0] + own.upper[0] - own.lower[0]) / 2;
    for (int k = 0; k < 3; ++k) motion.from.translation[k] += motion.to.translation[k];
    motion.from.translation[0] += 2 * side;
    return motion;
}

static void show_pairs(const fct_bvh *a, const fct_bvh *b, const fct_pose *pose) {
    fct_face_pair pairs[SHOWN];
    size_t found = fct_bvh_pairs(a, b, pose, SIZE_MAX, SHOWN, pairs, NULL, NULL);
    printf("%zu pairs of faces then\n", found);
    for (size_t i = 0; i < found && i < SHOWN; ++i) {
        fct_contact c;
        if (fct_bvh_contact(a, b, pose, pairs + i, &c))
            printf("  faces %u and %u at (%.3f, %.3f, %.3f), %.2e deep\n", pairs[i].face_a, pairs[i].face_b,
                   c.from[0], c.from[1], c.from[2], c.depth);
    }
}

/* Whether all answers were given and, for balls, are right: they start 2 apart, and 4 from centre to centre.
 */
static bool show_motion(const fct_bvh *a, const fct_bvh *b, bool balls) {
    fct_motion motion = plan_motion(a, b);
    fct_pair_hint hint = fct_pair_hint_none();
    fct_distance start;
    fct_first_contact first;
    if (!fct_bvh_distance(a, b, &motion.from, NULL, &hint, &start, NULL)) return false;
    printf("%.4f apart: faces %u and %u\n", start.distance, start.pair.face_a, start.pair.face_b);
    if (!fct_bvh_first_contact(a, b, &motion, 1e-4 * start.distance, &first, NULL)) return false;
    printf("they meet at time %.4f, at (%.3f, %.3f, %.3f)\n", first.time, first.nearest.point_a[0],
           first.nearest.point_a[1], first.nearest.point_a[2]);

    fct_pose pose = fct_motion_at(b, &motion, fmin(first.time + .01, 1));
    hint.pair = first.nearest.pair;
    bool before = fct_bvh_overlap(a, b, &motion.from, NULL, NULL);
    bool after = fct_bvh_overlap(a, b, &pose, &hint, NULL);
    printf("touching at the start: %s; a little later: %s\n", before ? "yes" : "no", after ? "yes" : "no");
    show_pairs(a, b, &pose);
    if (!balls) return true;
    return !before && after && fabs(start.distance - 2) < .003 && fabs(first.time - .5) < .001;
}

int main(int count, char **words) {
    fct_env env = fct_env_default();
    env.message = print_error;
    model a = {0}, b = {0};
    bool balls = count < 3;
    bool good = open_model(&env, balls ? NULL : words[1], &a) == FCT_OK &&
                open_model(&env, balls ? NULL : words[2], &b) == FCT_OK && show_motion(a.bvh, b.bvh, balls);
    fct_bvh_destroy(b.bvh);
    fct_tree_destroy(b.tree);
    fct_bvh_destroy(a.bvh);
    fct_tree_destroy(a.tree);
    return !good;
}
