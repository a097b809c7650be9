/* tools/make/surface.c: the zero level of a field as a closed manifold of well-shaped triangles.
 *
 * 1. lattice.c takes the signs of the field on a lattice without ambiguous faces.
 * 2. Each sheet of the surface in a cell gets one vertex. Each lattice edge that crosses the surface gets one
 *    quad of the four sheets around it (dual marching cubes, Nielson 2004).
 * 3. Newton steps move the vertices to the surface; three rounds of averaging spread them evenly.
 * 4. Each quad is cut along its shorter diagonal.
 */
#include "tools/make/lattice.h"

#include <math.h>
#include <string.h>

/* Per configuration (a bit per inside corner of a cell): the number of sheets, and the sheet (0 to 3) of each
 * edge that crosses the surface. Edge 4 a + i is parallel to axis a, at offset i & 1 along axis a + 1 and i
 * >> 1 along axis a + 2. */
typedef struct sheets {
    uint8_t count[256], of_edge[256][12];
} sheets;

static int find_edge_corner(int edge, int end) {
    int axis = edge / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
    return end << axis | (edge & 1) << u | (edge >> 1 & 1) << v;
}

static bool is_edge_on_face(int edge, int axis, int side) {
    return (find_edge_corner(edge, 0) >> axis & 1) == side && (find_edge_corner(edge, 1) >> axis & 1) == side;
}

static void number_sheets(sheets *s) {
    for (int config = 0; config < 256; ++config) {
        int root[12];
        for (int e = 0; e < 12; ++e) {
            bool crosses = (config >> find_edge_corner(e, 0) & 1) != (config >> find_edge_corner(e, 1) & 1);
            root[e] = crosses ? e : -1;
        }
        for (int face = 0; face < 6; ++face) {
            int first = -1;
            for (int e = 0; e < 12; ++e) {
                if (root[e] < 0 || !is_edge_on_face(e, face / 2, face & 1)) continue;
                if (first < 0) first = e;
                int from = root[e], to = root[first];
                for (int k = 0; k < 12; ++k)
                    if (root[k] == from) root[k] = to;
            }
        }
        int names[12], count = 0;
        for (int e = 0; e < 12; ++e) {
            int k = 0;
            while (k < count && names[k] != root[e]) ++k;
            if (root[e] >= 0 && k == count) names[count++] = root[e];
            s->of_edge[config][e] = root[e] < 0 ? 255 : (uint8_t)k;
        }
        s->count[config] = (uint8_t)count;
    }
}

static int find_configuration(uint8_t s[LOCAL][LOCAL][LOCAL], int x, int y, int z) {
    int config = 0;
    for (int k = 0; k < 8; ++k) config |= s[z + (k >> 2)][y + (k >> 1 & 1)][x + (k & 1)] << k;
    return config;
}

/* The mean of the crossing edges of one sheet of a cell. */
static make_point find_sheet_middle(const sheets *table, int config, int sheet) {
    double sum[3] = {0, 0, 0};
    int count = 0;
    for (int e = 0; e < 12; ++e) {
        if (table->of_edge[config][e] != sheet) continue;
        int corner = find_edge_corner(e, 0);
        for (int c = 0; c < 3; ++c) sum[c] += (corner >> c & 1) + (c == e / 4 ? .5 : 0);
        ++count;
    }
    return make_p(sum[0] / count, sum[1] / count, sum[2] / count);
}

static bool add_vertices(make_lattice *l, const sheets *table, make_mesh *m) {
    l->bases = tool_allocate(l->t, (size_t)l->active, sizeof *l->bases);
    l->offsets = tool_allocate(l->t, (size_t)l->active, sizeof *l->offsets);
    if (!l->bases || !l->offsets) return false;
    uint8_t sign[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active && !m->failed; ++b) {
        const int *at = l->places[b];
        l->bases[b] = (uint32_t)m->vertex_count;
        make_lattice_gather(l, b, sign);
        for (int k = 0; k < CORNERS; ++k) {
            int x = k % B, y = k / B % B, z = k / (B * B), config = find_configuration(sign, x, y, z);
            l->offsets[b][k] = UINT16_MAX;
            if (table->count[config]) l->offsets[b][k] = (uint16_t)(m->vertex_count - l->bases[b]);
            for (int sheet = 0; sheet < table->count[config]; ++sheet) {
                make_point p = find_sheet_middle(table, config, sheet);
                make_vertex(
                    m, make_lattice_point(l, at[0] * B + x + p.x, at[1] * B + y + p.y, at[2] * B + z + p.z));
            }
        }
    }
    return !m->failed;
}

static bool is_corner_inside(const make_lattice *l, int b, int x, int y, int z) {
    int owner = make_lattice_neighbour(l, b, x < 0 ? -1 : x >= B, y < 0 ? -1 : y >= B, z < 0 ? -1 : z >= B);
    if (owner < 0) return owner == INSIDE;
    return l->bits[owner][(z + B) % B] >> ((y + B) % B * B + (x + B) % B) & 1;
}

/* The vertex of the sheet of `edge`, in the cell `at` of block b or of a neighbour. */
static uint32_t find_sheet_vertex(const make_lattice *l, const sheets *table, int b, const int at[3],
                                  int edge) {
    int config = 0;
    for (int k = 0; k < 8; ++k)
        config |= is_corner_inside(l, b, at[0] + (k & 1), at[1] + (k >> 1 & 1), at[2] + (k >> 2)) << k;
    int owner = make_lattice_neighbour(l, b, -(at[0] < 0), -(at[1] < 0), -(at[2] < 0));
    int cell = (((at[2] + B) % B) * B + (at[1] + B) % B) * B + (at[0] + B) % B;
    return l->bases[owner] + l->offsets[owner][cell] + table->of_edge[config][edge];
}

static void add_quads(const make_lattice *l, const sheets *table, make_mesh *m) {
    uint8_t sign[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active && !m->failed; ++b) {
        make_lattice_gather(l, b, sign);
        for (int k = 0; k < CORNERS; ++k) {
            int at[3] = {k % B, k / B % B, k / (B * B)};
            int inside = sign[at[2]][at[1]][at[0]];
            for (int axis = 0; axis < 3; ++axis) {
                int next[3] = {at[0], at[1], at[2]}, u = (axis + 1) % 3, v = (axis + 2) % 3;
                ++next[axis];
                if (sign[next[2]][next[1]][next[0]] == inside) continue;
                uint32_t corner[4];
                for (int i = 0; i < 4; ++i) { /* around the edge, seen against its axis */
                    int back_u = i == 0 || i == 3, back_v = i < 2, cell[3] = {at[0], at[1], at[2]};
                    cell[u] -= back_u, cell[v] -= back_v;
                    corner[i] = find_sheet_vertex(l, table, b, cell, 4 * axis + back_u + 2 * back_v);
                }
                if (inside)
                    make_quad(m, corner[0], corner[1], corner[2], corner[3]);
                else
                    make_quad(m, corner[0], corner[3], corner[2], corner[1]);
            }
        }
    }
}

/* One Newton step along the gradient, of at most one lattice step. */
static void step_to_surface(const make_lattice *l, float *vertex) {
    static const double tetrahedron[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    double d = .05 * l->step, mean = 0, gradient[3] = {0, 0, 0};
    for (int k = 0; k < 4; ++k) {
        const double *s = tetrahedron[k];
        double f =
            make_lattice_value(l, make_p(vertex[0] + d * s[0], vertex[1] + d * s[1], vertex[2] + d * s[2]));
        mean += .25 * f;
        for (int c = 0; c < 3; ++c) gradient[c] += .25 * f * s[c] / d;
    }
    double square = gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2];
    if (!(square > 1e-6)) return;
    double along = -mean / square, length = fabs(along) * sqrt(square);
    if (length > l->step) along *= l->step / length;
    for (int c = 0; c < 3; ++c) vertex[c] = (float)(vertex[c] + along * gradient[c]);
}

/* Moves each vertex half-way to the mean of its neighbours, along the sides of the quads. Each quad is two
 * triangles. */
static void average_vertices(const make_lattice *l, make_mesh *m, size_t first_vertex, size_t first_face,
                             float (*sums)[4]) {
    size_t count = m->vertex_count - first_vertex;
    memset(sums, 0, count * sizeof *sums);
    for (size_t f = first_face; f < m->face_count; f += 2) {
        const uint32_t *t = m->triangles + 3 * f, quad[4] = {t[0], t[1], t[2], t[5]};
        for (int k = 0; k < 4; ++k) {
            uint32_t a = quad[k], b = quad[(k + 1) % 4];
            float *to = sums[a - first_vertex], *from = m->positions + 3 * (size_t)b;
            to[0] += from[0], to[1] += from[1], to[2] += from[2], to[3] += 1;
        }
    }
    for (size_t v = 0; v < count; ++v) {
        float *p = m->positions + 3 * (first_vertex + v);
        double move[3], length = 0;
        for (int c = 0; c < 3; ++c) {
            move[c] = .5 * (sums[v][c] / sums[v][3] - p[c]);
            length += move[c] * move[c];
        }
        double scale = length > .09 * l->step * l->step ? .3 * l->step / sqrt(length) : 1;
        for (int c = 0; c < 3; ++c) p[c] = (float)(p[c] + scale * move[c]);
    }
}

static double square_distance(const make_mesh *m, uint32_t a, uint32_t b) {
    const float *p = m->positions + 3 * (size_t)a, *q = m->positions + 3 * (size_t)b;
    double x = (double)p[0] - q[0], y = (double)p[1] - q[1], z = (double)p[2] - q[2];
    return x * x + y * y + z * z;
}

static bool smooth_mesh(const make_lattice *l, make_mesh *m, size_t first_vertex, size_t first_face) {
    float(*sums)[4] = tool_allocate(l->t, m->vertex_count - first_vertex, sizeof *sums);
    if (!sums) return false;
    for (int round = 0; round < 5; ++round) {
        if (round > 1) average_vertices(l, m, first_vertex, first_face, sums);
        for (size_t v = first_vertex; v < m->vertex_count; ++v) step_to_surface(l, m->positions + 3 * v);
    }
    for (size_t f = first_face; f < m->face_count; f += 2) {
        uint32_t *t = m->triangles + 3 * f, q[4] = {t[0], t[1], t[2], t[5]};
        if (square_distance(m, q[0], q[2]) <= square_distance(m, q[1], q[3])) continue;
        uint32_t turned[6] = {q[1], q[2], q[3], q[1], q[3], q[0]};
        memcpy(t, turned, sizeof turned);
    }
    tool_release(l->t, sums);
    return true;
}

/* The spacing for a number of triangles. The number is proportional to its inverse square, apart from finer
 * detail, so it is measured three times on finer lattices. */
static bool find_step(tool *t, const make_field *field, uint32_t triangles, double *step) {
    double size = fmax(field->upper.x - field->lower.x,
                       fmax(field->upper.y - field->lower.y, field->upper.z - field->lower.z));
    *step = size / 40;
    for (int round = 0; round < 3; ++round) {
        make_lattice l;
        bool good = make_lattice_open(t, field, *step, &l);
        double found = good ? 2. * (double)make_lattice_crossings(&l) : 1;
        make_lattice_close(&l);
        if (!good) return false;
        double part = round == 0   ? fmin(1, 20e3 / triangles)
                      : round == 1 ? fmin(1, fmax(.15, 20e3 / triangles))
                                   : 1;
        *step *= sqrt(fmax(found, 8) / (part * triangles));
    }
    return true;
}

int make_surface(make_mesh *m, const make_field *field, uint32_t triangles) {
    static sheets table;
    double step;
    make_lattice l = {.t = m->t};
    number_sheets(&table);
    size_t first_vertex = m->vertex_count, first_face = m->face_count;
    bool good = find_step(m->t, field, triangles, &step) && make_lattice_open(m->t, field, step, &l);
    if (good) {
        size_t crossings = make_lattice_crossings(&l);
        make_reserve(m, crossings + crossings / 64 + 64, 2 * crossings);
        good = !m->failed && add_vertices(&l, &table, m);
    }
    if (good) {
        add_quads(&l, &table, m);
        good = !m->failed && smooth_mesh(&l, m, first_vertex, first_face);
    }
    make_lattice_close(&l);
    return good ? TOOL_DONE : TOOL_MEMORY;
}
