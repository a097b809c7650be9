/* Shoots rays from the middle of a bumpy sphere and finds the nearest point of its surface.
 *
 * Every ray must hit, because the surface is closed and the intersection test is watertight.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <facetree/facetree.h>

enum { RINGS = 100, SPOKES = 200, RAYS = 100000 };

static void print_error(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

/* A grid over latitude and longitude, with one vertex at each pole. */
static void fill_sphere(fct_mesh *mesh) {
    uint32_t north = RINGS * SPOKES, south = north + 1, *t = mesh->triangles;
    for (uint32_t i = 0; i < RINGS + 2; ++i)
        for (uint32_t j = 0; j < SPOKES; ++j) {
            double a = 3.141592653589793 * i / (RINGS + 1), b = 6.283185307179586 * j / SPOKES;
            double r = 1 + .1 * sin(a) * sin(6 * a) * cos(8 * b);
            uint32_t vertex = i == 0 ? north : i == RINGS + 1 ? south : (i - 1) * SPOKES + j;
            float *p = mesh->positions + 3 * (size_t)vertex;
            p[0] = (float)(r * sin(a) * cos(b)), p[1] = (float)(r * sin(a) * sin(b)),
            p[2] = (float)(r * cos(a));
            uint32_t next = (j + 1) % SPOKES;
            if (i == 0) *t++ = north, *t++ = j, *t++ = next;
            if (i == RINGS) *t++ = south, *t++ = (i - 1) * SPOKES + next, *t++ = (i - 1) * SPOKES + j;
            if (i == 0 || i >= RINGS) continue;
            uint32_t here = (i - 1) * SPOKES;
            *t++ = here + j, *t++ = here + SPOKES + j, *t++ = here + SPOKES + next;
            *t++ = here + j, *t++ = here + SPOKES + next, *t++ = here + next;
        }
}

static uint32_t shoot_rays(const fct_bvh *bvh) {
    fct_ray *rays = malloc(RAYS * sizeof *rays);
    fct_hit *hits = malloc(RAYS * sizeof *hits);
    uint32_t hit_count = 0;
    for (uint32_t i = 0; rays && hits && i < RAYS; ++i) { /* directions on a spiral over the sphere */
        double z = 1 - (2 * i + 1.) / RAYS, r = sqrt(1 - z * z), a = 2.399963229728653 * i;
        rays[i] = (fct_ray){{0, 0, 0}, 0, {(float)(r * cos(a)), (float)(r * sin(a)), (float)z}, INFINITY};
    }
    if (rays && hits) fct_bvh_closest_hits(bvh, RAYS, rays, hits);
    double mean = 0;
    for (uint32_t i = 0; rays && hits && i < RAYS; ++i)
        if (hits[i].face != FCT_NONE) ++hit_count, mean += hits[i].t;
    printf("%u of %u rays hit, %.4f away on average\n", hit_count, (unsigned)RAYS,
           hit_count ? mean / hit_count : 0);
    free(rays);
    free(hits);
    return hit_count;
}

int main(void) {
    fct_env env = fct_env_default();
    env.message = print_error;
    fct_mesh mesh;
    if (fct_mesh_create(&env, RINGS * SPOKES + 2, 2 * RINGS * SPOKES, 0, &mesh) != FCT_OK) return 1;
    fill_sphere(&mesh);

    fct_tree *tree = NULL;
    fct_bvh *bvh = NULL;
    fct_tree_def def = fct_tree_def_default();
    int failed = fct_tree_build(&env, &mesh, &def, NULL, &tree) != FCT_OK ||
                 fct_bvh_create(&env, tree, FCT_BACKEND_OBB, &bvh) != FCT_OK;
    if (!failed) {
        fct_closest nearest;
        const float point[3] = {2, 0, 0};
        failed = shoot_rays(bvh) != RAYS || !fct_bvh_closest_point(bvh, point, INFINITY, &nearest, NULL);
        if (!failed)
            printf("nearest to (2, 0, 0): (%.3f, %.3f, %.3f) on face %u, %.3f away\n", nearest.point[0],
                   nearest.point[1], nearest.point[2], nearest.face, nearest.distance);
    }
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    return failed;
}
