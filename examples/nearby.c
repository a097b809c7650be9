/* Faces near a point, in a ball and in a view, on a surface whose vertices move.
 *
 * A square sheet lies in the plane z = 0, then waves run through it. Each frame moves the vertices, and a
 * refit makes the structure for them without new clusters. usage: nearby
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <facetree/facetree.h>

enum { CELLS = 64, VERTICES = (CELLS + 1) * (CELLS + 1), FRAMES = 4, NEAREST = 6 };

static double wave_height(double x, double y, int frame) {
    return .1 * frame * sin(4 * x + frame) * cos(3 * y);
}

static void fill_sheet(float *positions, int frame) {
    for (int v = 0; v < VERTICES; ++v) {
        double x = 2. * (v % (CELLS + 1)) / CELLS - 1, y = 2. * (v / (CELLS + 1)) / CELLS - 1;
        float *p = positions + 3 * (size_t)v;
        p[0] = (float)x, p[1] = (float)y, p[2] = (float)wave_height(x, y, frame);
    }
}

static fct_result make_sheet(const fct_env *env, fct_mesh *mesh) {
    fct_result result = fct_mesh_create(env, VERTICES, 2 * CELLS * CELLS, 0, mesh);
    if (result != FCT_OK) return result;
    fill_sheet(mesh->positions, 0);
    uint32_t *t = mesh->triangles;
    for (uint32_t i = 0; i < CELLS; ++i)
        for (uint32_t j = 0; j < CELLS; ++j) {
            uint32_t v = i * (CELLS + 1) + j, up = v + CELLS + 1;
            *t++ = v, *t++ = v + 1, *t++ = up + 1;
            *t++ = v, *t++ = up + 1, *t++ = up;
        }
    return FCT_OK;
}

/* A view from z = 2 downwards: four sides of a pyramid that is as wide as `size` times its depth, and the
 * eye's plane. A point x is inside if n.x + d >= 0 for each n, d. */
static void set_view(double size, double planes[5][4]) {
    const double sides[5][4] = {{1, 0, -size / 2, size},
                                {-1, 0, -size / 2, size},
                                {0, 1, -size / 2, size},
                                {0, -1, -size / 2, size},
                                {0, 0, -1, 2}};
    for (int i = 0; i < 20; ++i) planes[i / 4][i % 4] = sides[i / 4][i % 4];
}

/* Whether the answers are right: on the flat sheet they are known, and always agree with each other. */
static bool show_frame(const fct_bvh *bvh, int frame, double work) {
    const float eye[3] = {.1f, .2f, .5f};
    fct_closest nearest[NEAREST];
    uint32_t count = fct_bvh_nearest(bvh, eye, NEAREST, INFINITY, nearest, NULL);
    if (count != NEAREST) return false;
    float farthest = nextafterf(nearest[NEAREST - 1].distance, INFINITY); /* the distance is rounded */
    uint32_t in_ball = fct_bvh_faces_in_ball(bvh, eye, farthest, 0, NULL, NULL);
    double planes[5][4];
    set_view(.5, planes);
    uint32_t in_view = fct_bvh_faces_in_planes(bvh, 5, planes[0], 0, NULL, NULL);
    printf(
        "frame %d: nearest face %u at %.4f, %u faces within %.4f, %u in view, a ray takes %.2f of the work\n",
        frame, nearest[0].face, (double)nearest[0].distance, in_ball, (double)farthest, in_view, work);
    if (in_ball < NEAREST) return false;
    /* The view is a square of side 1 on the flat sheet, closed: half of the cells, and one more row, per
     * side. */
    if (frame == 0)
        return fabs((double)nearest[0].distance - .5) < 1e-6 && in_view >= CELLS * CELLS / 2 &&
               in_view <= CELLS * CELLS / 2 + 8 * CELLS;
    return true;
}

static bool run_frames(const fct_env *env, fct_mesh *mesh, const fct_bvh *built) {
    bool good = show_frame(built, 0, 1);
    for (int frame = 1; frame < FRAMES && good; ++frame) {
        fct_bvh *moved;
        double work;
        fill_sheet(mesh->positions, frame);
        good = fct_bvh_refit(env, built, mesh->positions, &moved, &work) == FCT_OK;
        if (!good) break;
        good = show_frame(moved, frame, work);
        fct_bvh_destroy(moved);
    }
    return good;
}

static void print_error(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

int main(void) {
    fct_env env = fct_env_default();
    env.message = print_error;
    fct_mesh mesh = {0};
    fct_tree *tree = NULL;
    fct_bvh *bvh = NULL;
    bool good = make_sheet(&env, &mesh) == FCT_OK &&
                fct_tree_build(&env, &mesh, NULL, NULL, &tree) == FCT_OK &&
                fct_bvh_create(&env, tree, FCT_BACKEND_OBB, &bvh) == FCT_OK && run_frames(&env, &mesh, bvh);
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    return !good;
}
