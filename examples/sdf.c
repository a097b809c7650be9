/* Samples the signed distance to a mesh on a grid: sdf [MESH OUT.npy [N]].
 *
 * Writes N x N x N floats (default 128), indexed z, y, x, as a NumPy file. Distances are negative inside. The
 * cubes of the grid enclose the mesh with a margin of a twentieth. Without arguments it samples a torus and
 * compares the result with the exact distance.
 *
 * Two facts make it fast. Queries may run on any number of threads at once. And the distance changes by at
 * most one step from one grid point to the next: passed as the maximum distance, this limits each search.
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <facetree/facetree.h>

enum { MOST_THREADS = 256 };

typedef struct grid {
    const fct_bvh *bvh;
    uint32_t n, thread_count;
    float lower[3], step;
    float *distances; /* n x n x n */
} grid;

typedef struct worker {
    grid *g;
    uint32_t number;
} worker;

static void print_error(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

static void sample_row(const grid *g, uint32_t y, uint32_t z) {
    float *row = g->distances + ((size_t)z * g->n + y) * g->n, limit = INFINITY;
    for (uint32_t x = 0; x < g->n; ++x) {
        float p[3] = {g->lower[0] + g->step * (float)x, g->lower[1] + g->step * (float)y,
                      g->lower[2] + g->step * (float)z};
        fct_closest nearest;
        /* Rounding can only make the limit too small by far less than a thousandth of a step. */
        if (!fct_bvh_signed_distance(g->bvh, p, limit, &nearest, NULL))
            fct_bvh_signed_distance(g->bvh, p, INFINITY, &nearest, NULL);
        row[x] = nearest.distance;
        limit = fabsf(nearest.distance) + 1.001f * g->step;
    }
}

/* Every thread takes every thread_count-th slice. */
static void *sample_slices(void *argument) {
    const worker *w = argument;
    for (uint32_t z = w->number; z < w->g->n; z += w->g->thread_count)
        for (uint32_t y = 0; y < w->g->n; ++y) sample_row(w->g, y, z);
    return NULL;
}

static void sample_grid(grid *g) {
    pthread_t threads[MOST_THREADS];
    worker workers[MOST_THREADS];
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    g->thread_count = processors < 1 ? 1 : processors > MOST_THREADS ? MOST_THREADS : (uint32_t)processors;
    bool started[MOST_THREADS] = {false};
    for (uint32_t i = 0; i < g->thread_count; ++i) {
        workers[i] = (worker){g, i};
        if (i > 0) started[i] = pthread_create(&threads[i], NULL, sample_slices, &workers[i]) == 0;
    }
    for (uint32_t i = 0; i < g->thread_count; ++i)
        if (!started[i]) sample_slices(&workers[i]);
    for (uint32_t i = 0; i < g->thread_count; ++i)
        if (started[i]) pthread_join(threads[i], NULL);
}

static int place_grid(grid *g, const fct_bvh *bvh, uint32_t n) {
    fct_bounds b = fct_bvh_bounds(bvh);
    float side = 0;
    for (int k = 0; k < 3; ++k) side = fmaxf(side, b.upper[k] - b.lower[k]);
    *g = (grid){.bvh = bvh, .n = n, .step = 1.1f * side / (float)(n - 1)};
    for (int k = 0; k < 3; ++k) g->lower[k] = .5f * (b.lower[k] + b.upper[k]) - .55f * side;
    g->distances = malloc((size_t)n * n * n * sizeof *g->distances);
    return g->distances ? 0 : 1;
}

/* The format of numpy.save: a magic word, the length of the header, a header of text, the numbers. */
static int write_npy(const char *path, const grid *g) {
    const uint16_t one = 1;
    char text[256], order = *(const unsigned char *)&one ? '<' : '>';
    FILE *file = fopen(path, "wb");
    if (!file) return perror(path), 1;
    int length =
        snprintf(text, sizeof text, "{'descr': '%cf4', 'fortran_order': False, 'shape': (%u, %u, %u), }",
                 order, g->n, g->n, g->n);
    while ((10 + length + 1) % 64) text[length++] = ' ';
    text[length++] = '\n';
    const unsigned char head[10] = {
        0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, (unsigned char)(length & 255), (unsigned char)(length >> 8)};
    size_t count = (size_t)g->n * g->n * g->n;
    int failed = fwrite(head, 1, 10, file) != 10 || fwrite(text, 1, (size_t)length, file) != (size_t)length ||
                 fwrite(g->distances, sizeof *g->distances, count, file) != count;
    failed |= fclose(file) != 0;
    if (failed) perror(path);
    return failed;
}

/* A torus about the z axis, of radii 1 and .4. */
static int make_torus(const fct_env *env, fct_mesh *mesh) {
    enum { AROUND = 240, ACROSS = 120 };
    if (fct_mesh_create(env, AROUND * ACROSS, 2 * AROUND * ACROSS, 0, mesh) != FCT_OK) return 1;
    for (uint32_t i = 0; i < AROUND; ++i)
        for (uint32_t j = 0; j < ACROSS; ++j) {
            double a = 6.283185307179586 * i / AROUND, b = 6.283185307179586 * j / ACROSS;
            double r = 1 + .4 * cos(b);
            float *p = mesh->positions + 3 * (size_t)(i * ACROSS + j);
            p[0] = (float)(r * cos(a)), p[1] = (float)(r * sin(a)), p[2] = (float)(.4 * sin(b));
            uint32_t i1 = (i + 1) % AROUND, j1 = (j + 1) % ACROSS;
            uint32_t corners[6] = {i * ACROSS + j, i1 * ACROSS + j,  i1 * ACROSS + j1,
                                   i * ACROSS + j, i1 * ACROSS + j1, i * ACROSS + j1};
            memcpy(mesh->triangles + 6 * (size_t)(i * ACROSS + j), corners, sizeof corners);
        }
    return 0;
}

/* Prints the largest difference from the exact distance; returns 1 if it is above that of the facets. */
static int check_torus(const grid *g) {
    double largest = 0;
    for (size_t i = 0; i < (size_t)g->n * g->n * g->n; ++i) {
        double x = (double)(g->lower[0] + g->step * (float)(i % g->n)),
               y = (double)(g->lower[1] + g->step * (float)(i / g->n % g->n)),
               z = (double)(g->lower[2] + g->step * (float)(i / g->n / g->n));
        double exact = hypot(hypot(x, y) - 1, z) - .4;
        largest = fmax(largest, fabs((double)g->distances[i] - exact));
    }
    printf("torus: %u^3 distances, %.5f from the exact ones at most\n", g->n, largest);
    return largest > 5e-4;
}

int main(int argc, char **argv) {
    fct_env env = fct_env_default();
    env.message = print_error;
    uint32_t n = argc > 3 ? (uint32_t)strtoul(argv[3], NULL, 10) : argc > 1 ? 128 : 40;
    if (argc == 2 || argc > 4 || n < 2 || n > 1024) {
        fprintf(stderr, "usage: sdf [MESH OUT.npy [N]], N from 2 to 1024\n");
        return 64;
    }
    fct_mesh mesh = {0};
    fct_tree *tree = NULL;
    fct_bvh *bvh = NULL;
    grid g = {0};
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_SIGN;
    int failed = argc > 1 ? fct_mesh_load(&env, argv[1], &mesh) != FCT_OK : make_torus(&env, &mesh);
    failed = failed || fct_tree_build(&env, &mesh, NULL, NULL, &tree) != FCT_OK ||
             fct_bvh_build(&env, tree, &def, &bvh) != FCT_OK || place_grid(&g, bvh, n);
    if (!failed) {
        sample_grid(&g);
        failed = argc > 1 ? write_npy(argv[2], &g) : check_torus(&g);
    }
    free(g.distances);
    fct_bvh_destroy(bvh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    return failed;
}
