/* tools/make/shapes.c: spheres, boxes, surfaces of revolution, sheets and crates. Every closed shape is a
 * manifold whose faces look outwards.
 */
#include "tools/make/parts.h"

#include <math.h>

#define TURN 6.28318530717958647692

static make_point project_to_sphere(make_point center, double radius, make_point p) {
    double s = radius / sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    return make_p(center.x + s * p.x, center.y + s * p.y, center.z + s * p.z);
}

/* The vertex numbers of the face (a, b, c) of an icosahedron, row by row. Vertices are numbered: the 12
 * corners, then n - 1 per side for 30 sides, then the insides. */
typedef struct sphere_grid {
    uint32_t first, n, corner[3], side[3]; /* the sides ab, bc and ca in the list of 30 */
    bool backwards[3];
    uint32_t inside;
} sphere_grid;

static uint32_t find_side_vertex(const sphere_grid *g, int side, uint32_t step) {
    if (g->backwards[side]) step = g->n - step;
    return g->first + 12 + g->side[side] * (g->n - 1) + step - 1;
}

/* Vertex j of i in row i of n, counted from a towards bc. */
static uint32_t find_grid_vertex(const sphere_grid *g, uint32_t i, uint32_t j) {
    if (i == 0) return g->first + g->corner[0];
    if (i == g->n && j == 0) return g->first + g->corner[1];
    if (i == g->n && j == i) return g->first + g->corner[2];
    if (j == 0) return find_side_vertex(g, 0, i);
    if (i == g->n) return find_side_vertex(g, 1, j);
    if (j == i) return find_side_vertex(g, 2, g->n - i);
    return g->inside + (i - 1) * (i - 2) / 2 + j - 1;
}

static make_point blend_points(const make_point *a, const make_point *b, const make_point *c, double u,
                               double v) {
    double w = 1 - u - v;
    return make_p(w * a->x + u * b->x + v * c->x, w * a->y + u * b->y + v * c->y,
                  w * a->z + u * b->z + v * c->z);
}

void make_sphere(make_mesh *m, make_point center, double radius, uint32_t n) {
    static const uint8_t faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                         {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                         {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                         {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const double g = 1.61803398874989484820;
    const make_point corners[12] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                    {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                    {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    uint8_t sides[30][2], side_count = 0;
    sphere_grid grid = {.first = (uint32_t)m->vertex_count, .n = n};
    make_reserve(m, 10 * (size_t)n * n + 2, 20 * (size_t)n * n);
    for (int k = 0; k < 12; ++k) make_vertex(m, project_to_sphere(center, radius, corners[k]));
    for (int f = 0; f < 20; ++f)
        for (int k = 0; k < 3; ++k) {
            uint8_t a = faces[f][k], b = faces[f][(k + 1) % 3];
            if (a > b) continue;
            sides[side_count][0] = a, sides[side_count++][1] = b;
            for (uint32_t s = 1; s < n; ++s)
                make_vertex(m, project_to_sphere(
                                   center, radius,
                                   blend_points(corners + a, corners + b, corners + b, (double)s / n, 0)));
        }
    for (int f = 0; f < 20; ++f) {
        const uint8_t *face = faces[f];
        for (int k = 0; k < 3; ++k) {
            uint8_t a = face[k], b = face[(k + 1) % 3];
            grid.corner[k] = a;
            grid.backwards[k] = a > b;
            for (uint32_t s = 0; s < 30; ++s)
                if ((sides[s][0] == a && sides[s][1] == b) || (sides[s][0] == b && sides[s][1] == a))
                    grid.side[k] = s;
        }
        grid.inside = (uint32_t)m->vertex_count;
        for (uint32_t i = 2; i < n; ++i)
            for (uint32_t j = 1; j < i; ++j)
                make_vertex(
                    m, project_to_sphere(center, radius,
                                         blend_points(corners + face[0], corners + face[1], corners + face[2],
                                                      (double)(i - j) / n, (double)j / n)));
        for (uint32_t i = 0; i < n; ++i)
            for (uint32_t j = 0; j <= i; ++j) {
                uint32_t a = find_grid_vertex(&grid, i, j), b = find_grid_vertex(&grid, i + 1, j),
                         c = find_grid_vertex(&grid, i + 1, j + 1);
                make_triangle(m, a, b, c);
                if (j < i) make_triangle(m, a, c, find_grid_vertex(&grid, i, j + 1));
            }
    }
}

void make_box(make_mesh *m, make_point l, make_point u, bool bottom, bool top) {
    uint32_t v = (uint32_t)m->vertex_count;
    for (int k = 0; k < 8; ++k)
        make_vertex(m, make_p(k & 1 ? u.x : l.x, k & 2 ? u.y : l.y, k & 4 ? u.z : l.z));
    make_quad(m, v, v + 4, v + 6, v + 2);
    make_quad(m, v + 1, v + 3, v + 7, v + 5);
    make_quad(m, v, v + 2, v + 3, v + 1);
    make_quad(m, v + 4, v + 5, v + 7, v + 6);
    if (bottom) make_quad(m, v, v + 1, v + 5, v + 4);
    if (top) make_quad(m, v + 2, v + 6, v + 7, v + 3);
}

void make_lathe(make_mesh *m, make_point center, const double (*profile)[2], uint32_t count,
                uint32_t segments) {
    uint32_t previous = 0;
    bool previous_pole = false;
    for (uint32_t k = 0; k < count; ++k) {
        double radius = profile[k][0], height = center.y + profile[k][1];
        bool pole = radius == 0;
        uint32_t ring = (uint32_t)m->vertex_count;
        for (uint32_t s = 0; s < (pole ? 1 : segments); ++s) {
            double angle = TURN * s / segments;
            make_vertex(m, make_p(center.x + radius * cos(angle), height, center.z + radius * sin(angle)));
        }
        for (uint32_t s = 0; k > 0 && s < segments; ++s) {
            uint32_t next = (s + 1) % segments;
            if (previous_pole)
                make_triangle(m, previous, ring + s, ring + next);
            else if (pole)
                make_triangle(m, previous + s, ring, previous + next);
            else
                make_quad(m, previous + s, ring + s, ring + next, previous + next);
        }
        previous = ring, previous_pole = pole;
    }
}

make_point make_sheet_vertex(uint32_t n, uint32_t i, uint32_t j, make_height *height, uint64_t seed) {
    double x = (double)i / n, z = (double)j / n;
    return make_p(x, height ? height(x, z, seed) : 0, z);
}

void make_sheet(make_mesh *m, uint32_t n, make_height *height, uint64_t seed) {
    uint32_t first = (uint32_t)m->vertex_count;
    make_reserve(m, ((size_t)n + 1) * (n + 1), 2 * (size_t)n * n);
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) make_vertex(m, make_sheet_vertex(n, i, j, height, seed));
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            uint32_t a = first + j * (n + 1) + i;
            make_quad(m, a, a + n + 1, a + n + 2, a + 1);
        }
}

double make_terrain_height(double x, double z, uint64_t seed) {
    double sum = 0, size = .25, frequency = 2;
    for (int octave = 0; octave < 9; ++octave, size *= .48, frequency *= 2.03) {
        double n = make_noise(make_p(x * frequency, 7.3 * octave, z * frequency), seed);
        sum += size * (octave < 3 ? n : n * (.3 + fmax(0, sum) * 3));
    }
    return sum;
}

/* A random rotation, from a uniform unit quaternion. */
static void make_rotation(uint64_t k, uint64_t seed, double r[9]) {
    double u = make_hash((int64_t)k, 0, 0, seed), a = TURN * make_hash((int64_t)k, 1, 0, seed),
           b = TURN * make_hash((int64_t)k, 2, 0, seed);
    double x = sqrt(1 - u) * sin(a), y = sqrt(1 - u) * cos(a), z = sqrt(u) * sin(b), w = sqrt(u) * cos(b);
    double rows[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                      2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                      2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    for (int i = 0; i < 9; ++i) r[i] = rows[i];
}

void make_crates(make_mesh *m, uint32_t count, uint64_t seed) {
    double spacing = 1 / cbrt(count);
    make_reserve(m, 8 * (size_t)count, 12 * (size_t)count);
    for (uint32_t k = 0; k < count && !m->failed; ++k) {
        double r[9], half[3], at[3];
        make_rotation(k, seed, r);
        for (int c = 0; c < 3; ++c) {
            at[c] = make_hash(k, 3, c, seed);
            half[c] = spacing * (.08 + .1 * make_hash(k, 4, c, seed)) * (c == 0 ? 4 : 1);
        }
        size_t first = m->vertex_count;
        make_box(m, make_p(-half[0], -half[1], -half[2]), make_p(half[0], half[1], half[2]), true, true);
        for (size_t v = first; v < m->vertex_count; ++v) {
            float *p = m->positions + 3 * v, q[3] = {p[0], p[1], p[2]};
            for (int i = 0; i < 3; ++i)
                p[i] = (float)(at[i] + r[3 * i] * q[0] + r[3 * i + 1] * q[1] + r[3 * i + 2] * q[2]);
        }
    }
}

void make_cylinder(make_mesh *m, uint32_t triangles) {
    /* Radius 1/2 and height 1. Choose segments so that the quads are about square. */
    uint32_t segments = (uint32_t)fmax(3, lround(sqrt(triangles * TURN / 2 / 3)));
    double rows = fmax(1, triangles / (2. * segments) + 1);
    uint32_t side = (uint32_t)fmax(1, lround(rows / 2)), cap = (uint32_t)fmax(1, lround(rows / 4));
    double profile[2][2];
    uint32_t total = 2 * cap + side + 1;
    double(*line)[2] = tool_allocate(m->t, total, sizeof profile[0]);
    if (!line) {
        m->failed = true;
        return;
    }
    for (uint32_t k = 0; k < cap; ++k) line[k][0] = .5 * k / cap, line[k][1] = 0;
    for (uint32_t k = 0; k <= side; ++k) line[cap + k][0] = .5, line[cap + k][1] = (double)k / side;
    for (uint32_t k = 0; k < cap; ++k) line[total - 1 - k][0] = .5 * k / cap, line[total - 1 - k][1] = 1;
    make_lathe(m, make_p(0, 0, 0), line, total, segments);
    tool_release(m->t, line);
}

/* The number of a point on the surface of an n^3 lattice. Sides share the numbers of their common edges. */
static uint32_t find_lattice_vertex(uint32_t n, uint32_t x, uint32_t y, uint32_t z) {
    uint32_t layer = (n + 1) * (n + 1);
    if (z == 0) return y * (n + 1) + x;
    if (z == n) return layer + 4 * n * (n - 1) + y * (n + 1) + x;
    uint32_t ring = layer + 4 * n * (z - 1);
    if (y == 0) return ring + x;
    if (x == n) return ring + n + y;
    if (y == n) return ring + 3 * n - x;
    return ring + 4 * n - y;
}

void make_cube(make_mesh *m, uint32_t triangles) {
    uint32_t n = (uint32_t)fmax(1, lround(sqrt(triangles / 12.)));
    size_t vertices = 6 * (size_t)n * n + 2;
    make_reserve(m, vertices, 12 * (size_t)n * n);
    if (m->failed) return;
    m->vertex_count = vertices;
    for (int side = 0; side < 6; ++side) {
        int axis = side / 2;
        for (uint32_t j = 0; j <= n; ++j)
            for (uint32_t i = 0; i <= n; ++i) {
                uint32_t c[2][2][3];
                for (uint32_t b = 0; b < 2; ++b)
                    for (uint32_t a = 0; a < 2; ++a) {
                        c[b][a][axis] = side % 2 ? n : 0;
                        c[b][a][(axis + 1) % 3] = i + a, c[b][a][(axis + 2) % 3] = j + b;
                    }
                const uint32_t *at = c[0][0];
                float *p = m->positions + 3 * (size_t)find_lattice_vertex(n, at[0], at[1], at[2]);
                for (int k = 0; k < 3; ++k) p[k] = (float)((double)at[k] / n);
                if (i == n || j == n) continue;
                uint32_t v[4] = {find_lattice_vertex(n, c[0][0][0], c[0][0][1], c[0][0][2]),
                                 find_lattice_vertex(n, c[0][1][0], c[0][1][1], c[0][1][2]),
                                 find_lattice_vertex(n, c[1][1][0], c[1][1][1], c[1][1][2]),
                                 find_lattice_vertex(n, c[1][0][0], c[1][0][1], c[1][0][2])};
                if (side % 2)
                    make_quad(m, v[0], v[1], v[2], v[3]);
                else
                    make_quad(m, v[0], v[3], v[2], v[1]);
            }
    }
}
