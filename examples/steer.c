/* examples/steer.c: steers a simplification: runs, paints a side, goes back, and runs again.
 *
 *     ./steer bunny.obj 10000 1000 small.ply
 *
 * runs to 10,000 faces and then to 1,000, asks for eight times the cost where x is above the middle, goes
 * back to 10,000 and runs to 1,000 again. The painted side then keeps about twice as many faces as the other
 * side of a symmetric mesh. Without arguments it does this with a ball, and checks that.
 */
#include <facetree/facetree.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void print_message(void *user, fct_severity severity, const char *text) {
    (void)user;
    fprintf(stderr, "%s: %s\n", severity == FCT_MESSAGE_ERROR ? "error" : "warning", text);
}

enum { RINGS = 64, SECTORS = 128 };

/* A ball of radius 1 with two poles. */
static fct_result make_ball(const fct_env *env, fct_mesh *mesh) {
    const double pi = 3.14159265358979;
    const uint32_t rows = RINGS - 1, last = rows * SECTORS;
    fct_result result = fct_mesh_create(env, last + 2, 2 * rows * SECTORS, 0, mesh);
    if (result != FCT_OK) return result;
    for (uint32_t v = 0; v < last; ++v) {
        double polar = pi * (v / SECTORS + 1) / RINGS, around = 2 * pi * (v % SECTORS) / SECTORS;
        float *p = mesh->positions + 3 * (size_t)v;
        p[0] = (float)(sin(polar) * cos(around)), p[1] = (float)(sin(polar) * sin(around));
        p[2] = (float)cos(polar);
    }
    float *poles = mesh->positions + 3 * (size_t)last;
    for (int k = 0; k < 6; ++k) poles[k] = k == 2 ? 1.f : k == 5 ? -1.f : 0.f;
    uint32_t *t = mesh->triangles;
    for (uint32_t j = 0; j < SECTORS; ++j) {
        uint32_t next = (j + 1) % SECTORS, low = (rows - 1) * SECTORS;
        *t++ = last, *t++ = j, *t++ = next;
        *t++ = last + 1, *t++ = low + next, *t++ = low + j;
        for (uint32_t i = 0; i + 1 < rows; ++i) {
            uint32_t a = i * SECTORS + j, b = i * SECTORS + next;
            *t++ = a, *t++ = a + SECTORS, *t++ = b + SECTORS;
            *t++ = a, *t++ = b + SECTORS, *t++ = b;
        }
    }
    return FCT_OK;
}

static double find_middle(const fct_mesh *mesh) {
    float low = INFINITY, high = -INFINITY;
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        low = fminf(low, mesh->positions[3 * v]), high = fmaxf(high, mesh->positions[3 * v]);
    return (low + high) / 2.;
}

/* The faces of the current mesh with their first corner on either side. */
static fct_result print_sides(const fct_env *env, fct_simplifier *s, double middle, const char *what,
                              double *share) {
    fct_mesh mesh;
    fct_result result = fct_simplifier_mesh(s, false, &mesh, NULL);
    if (result != FCT_OK) return result;
    uint32_t right = 0;
    for (size_t f = 0; f < mesh.face_count; ++f)
        right += mesh.positions[3 * (size_t)mesh.triangles[3 * f]] > middle;
    printf("%s: %u faces, %u of them on the right\n", what, mesh.face_count, right);
    *share = (double)right / mesh.face_count;
    fct_mesh_release(env, &mesh);
    return FCT_OK;
}

/* Paints the vertices of the current mesh. */
static fct_result paint_right(const fct_env *env, fct_simplifier *s, double middle) {
    fct_mesh mesh;
    fct_result result = fct_simplifier_mesh(s, false, &mesh, NULL);
    if (result != FCT_OK) return result;
    float *weights = malloc(((size_t)mesh.vertex_count + 1) * sizeof *weights);
    for (size_t v = 0; v < mesh.vertex_count && weights; ++v)
        weights[v] = mesh.positions[3 * v] > middle ? 8 : 1;
    result =
        weights ? fct_simplifier_paint(s, FCT_PAINT_CURRENT, weights, mesh.vertex_count) : FCT_ERROR_MEMORY;
    free(weights);
    fct_mesh_release(env, &mesh);
    return result;
}

static fct_result steer(const fct_env *env, fct_simplifier *s, double middle, uint32_t many, uint32_t few,
                        const char *path, double *share) {
    fct_mesh mesh;
    fct_result result = fct_simplifier_run(s, many, INFINITY, NULL);
    if (result == FCT_OK) result = fct_simplifier_run(s, few, INFINITY, NULL);
    if (result == FCT_OK) result = print_sides(env, s, middle, "without paint", share);
    if (result == FCT_OK) result = paint_right(env, s, middle);
    if (result == FCT_OK) result = fct_simplifier_undo(s, many);
    if (result == FCT_OK) result = print_sides(env, s, middle, "back", share);
    if (result == FCT_OK) result = fct_simplifier_run(s, few, INFINITY, NULL);
    if (result == FCT_OK) result = print_sides(env, s, middle, "with paint", share);
    if (result != FCT_OK || !path) return result;
    result = fct_simplifier_mesh(s, true, &mesh, NULL);
    if (result != FCT_OK) return result;
    result = fct_mesh_save(env, path, &mesh, NULL);
    fct_mesh_release(env, &mesh);
    return result;
}

int main(int argc, char **argv) {
    if (argc != 5 && argc != 1) {
        fprintf(stderr, "usage: steer IN MANY FEW OUT\n");
        return 64;
    }
    fct_env env = fct_env_default();
    env.message = print_message;
    fct_mesh mesh;
    fct_simplifier *s = NULL;
    if ((argc > 1 ? fct_mesh_load(&env, argv[1], &mesh) : make_ball(&env, &mesh)) != FCT_OK) return 1;
    uint32_t many = argc > 1 ? (uint32_t)strtoul(argv[2], NULL, 10) : 8000,
             few = argc > 1 ? (uint32_t)strtoul(argv[3], NULL, 10) : 800;
    double share = 0;
    double middle = find_middle(&mesh);
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = few;
    fct_result result = fct_simplifier_create(&env, &mesh, &def, &s);
    fct_mesh_release(&env, &mesh);
    if (result == FCT_OK) result = steer(&env, s, middle, many, few, argc > 1 ? argv[4] : NULL, &share);
    fct_simplifier_destroy(s);
    if (argc == 1 && !(share > .62 && share < .72)) return 1;
    return result == FCT_OK ? 0 : 1;
}
