/* bench/simplify/shapes.c: makes meshes with colours, and cubes with noise.
 *
 * usage:
 * - bench_simplify_shapes paint IN OUT: gives each vertex a colour by its position
 * - bench_simplify_shapes cube NOISE OUT: the unit cube of 12,288 triangles (Garland 1999, figure 6.17). Each
 *   vertex but the eight corners moves along its normal by at most NOISE percent of the diagonal, at random
 * The output depends on the arguments only.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench/cluster/bench.h"

/* --- Colours --- */

/* A map of land and sea in the unit cube: colours change slowly, but for the coast, where h = 0. */
static void paint_point(const double p[3], float color[3]) {
    double h = 0;
    for (int i = 0; i < 4; ++i) {
        double f = 3 << i, x = f * p[0], y = f * p[1], z = f * p[2];
        h += (sin(x + 1.3 * y + i) + sin(y - .7 * z + 2 * i) + sin(z + .4 * x + 3 * i)) / (1.8 * (1 << i));
    }
    static const double sea[2][3] = {{.05, .25, .55}, {.02, .08, .2}},
                        land[2][3] = {{.2, .4, .08}, {.6, .4, .3}};
    const double(*ends)[3] = h < 0 ? sea : land;
    double t = fmin(fabs(h) / 1.5, 1);
    for (int k = 0; k < 3; ++k) color[k] = (float)(ends[0][k] + t * (ends[1][k] - ends[0][k]));
}

static void paint(const fct_env *env, const char *in, fct_mesh *out) {
    fct_mesh mesh;
    bench_load(env, in, &mesh);
    bench_check(fct_mesh_create(env, mesh.vertex_count, mesh.face_count, FCT_MESH_COLORS, out), "a mesh");
    memcpy(out->positions, mesh.positions, 3 * (size_t)mesh.vertex_count * sizeof(float));
    memcpy(out->triangles, mesh.triangles, 3 * (size_t)mesh.face_count * sizeof(uint32_t));
    double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0;
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i) {
        double x = (double)mesh.positions[i];
        lower[i % 3] = fmin(lower[i % 3], x), upper[i % 3] = fmax(upper[i % 3], x);
    }
    for (int k = 0; k < 3; ++k) size = fmax(size, upper[k] - lower[k]);
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        double p[3];
        for (size_t k = 0; k < 3; ++k)
            p[k] = ((double)mesh.positions[3 * v + k] - lower[k]) / (size > 0 ? size : 1);
        paint_point(p, out->colors + 3 * v);
    }
    fct_mesh_release(env, &mesh);
}

/* --- Cubes with noise --- */

enum { CUTS = 32, ROW = CUTS + 1 }; /* squares along an edge of the cube */

/* The vertex at a point of the lattice on the surface; made when first asked for. */
static uint32_t lattice_vertex(fct_mesh *m, uint32_t *ids, const uint32_t at[3]) {
    uint32_t *id = &ids[at[0] + ROW * (at[1] + ROW * at[2])];
    if (*id == 0) {
        float *p = m->positions + 3 * (size_t)m->vertex_count;
        for (int k = 0; k < 3; ++k) p[k] = (float)at[k] / CUTS;
        *id = ++m->vertex_count;
    }
    return *id - 1;
}

/* The side of the cube across `axis`, at 0 or CUTS, seen from outside. */
static void add_side(fct_mesh *m, uint32_t *ids, int axis, uint32_t level) {
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (uint32_t i = 0; i < CUTS * CUTS; ++i) {
        uint32_t corner[4];
        for (uint32_t k = 0; k < 4; ++k) {
            uint32_t at[3];
            at[axis] = level, at[u] = i % CUTS + (k & 1), at[v] = i / CUTS + (k >> 1);
            corner[k] = lattice_vertex(m, ids, at);
        }
        uint32_t left = level ? corner[2] : corner[1], right = level ? corner[1] : corner[2];
        uint32_t *t = m->triangles + 3 * (size_t)m->face_count;
        t[0] = corner[0], t[1] = right, t[2] = corner[3];
        t[3] = corner[0], t[4] = corner[3], t[5] = left;
        m->face_count += 2;
    }
}

static void make_cube(const fct_env *env, double noise, fct_mesh *m) {
    uint32_t *ids = bench_allocate(ROW * ROW * ROW, sizeof *ids);
    bench_check(fct_mesh_create(env, 6 * CUTS * CUTS + 2, 12 * CUTS * CUTS, 0, m), "a mesh");
    m->vertex_count = m->face_count = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (uint32_t end = 0; end < 2; ++end) add_side(m, ids, axis, end * CUTS);
    free(ids);
    bench_dice dice = {5};
    for (size_t v = 0; v < m->vertex_count; ++v) {
        double normal[3], length = 0, move = noise / 100 * sqrt(3) * (2 * bench_unit(&dice) - 1);
        for (size_t k = 0; k < 3; ++k) {
            double x = (double)m->positions[3 * v + k];
            normal[k] = x == 0 ? -1 : x == 1 ? 1 : 0;
            length += fabs(normal[k]);
        }
        for (size_t k = 0; k < 3 && length < 3; ++k)
            m->positions[3 * v + k] += (float)(move * normal[k] / sqrt(length));
    }
}

int main(int argc, char **argv) {
    if (argc != 4) bench_fail("usage: %s paint IN OUT, or %s cube NOISE OUT", argv[0], argv[0]);
    fct_env env = bench_env(1);
    fct_mesh mesh;
    if (!strcmp(argv[1], "paint"))
        paint(&env, argv[2], &mesh);
    else if (!strcmp(argv[1], "cube")) {
        char *end;
        double noise = strtod(argv[2], &end);
        if (end == argv[2] || *end || !(noise >= 0 && noise < 100))
            bench_fail("NOISE: expected percent, found '%s'", argv[2]);
        make_cube(&env, noise, &mesh);
    } else
        bench_fail("cannot make '%s', expected paint or cube", argv[1]);
    bench_save(&env, argv[3], &mesh);
    fct_mesh_release(&env, &mesh);
    return 0;
}
