/* tools/make/surface.c: the zero level of a field as a closed manifold of well-shaped triangles.
 *
 * Signs are taken on a lattice, only in blocks of 8^3 cells that the field's slope lets the surface reach. In
 * every cell each connected sheet gets one vertex, every lattice edge that crosses the surface one quad of
 * the four sheets around it (dual marching cubes, after Nielson 2004). Faces whose diagonal corners alone
 * are inside would make sheets meet in one edge twice; one of their outer corners is filled until there are
 * none, and the result is a manifold. Vertices then go to the surface by Newton steps, spread evenly by three
 * rounds of averaging, and quads are cut along their shorter diagonal.
 */
#include "tools/make/make.h"

#include <math.h>
#include <string.h>

enum { B = 8, CORNERS = B * B * B, LOCAL = B + 1 };
enum { OUTSIDE = -1, INSIDE = -2, SURFACE = -3 }; /* blocks that are all one, and unnumbered ones */

typedef struct lattice {
    tool *t;
    const make_field *field;
    double step;
    make_point origin;
    int blocks[3];
    int *index;                   /* block -> number of an active one, OUTSIDE or INSIDE */
    int (*places)[3];             /* active block -> its block coordinates */
    uint64_t (*bits)[B];          /* active block -> a bit for each corner inside: word z, bit y * 8 + x */
    uint32_t *bases;              /* active block -> first vertex of its cells */
    uint16_t (*offsets)[CORNERS]; /* active block -> cell -> vertex, from the base; UINT16_MAX: none */
    int active;
} lattice;

/* Which sheet (0 to 3) each crossing edge of a cell belongs to, by the corners that are inside. Edge 4 a + i
 * runs along axis a at offset i & 1 along axis a + 1, i >> 1 along axis a + 2. */
typedef struct sheets {
    uint8_t count[256], of_edge[256][12];
} sheets;

static int edge_corner(int edge, int end) {
    int axis = edge / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
    return end << axis | (edge & 1) << u | (edge >> 1 & 1) << v;
}

static bool edge_on_face(int edge, int axis, int side) {
    return (edge_corner(edge, 0) >> axis & 1) == side && (edge_corner(edge, 1) >> axis & 1) == side;
}

static void number_sheets(sheets *s) {
    for (int config = 0; config < 256; ++config) {
        int root[12];
        for (int e = 0; e < 12; ++e) {
            bool crosses = (config >> edge_corner(e, 0) & 1) != (config >> edge_corner(e, 1) & 1);
            root[e] = crosses ? e : -1;
        }
        for (int face = 0; face < 6; ++face) {
            int first = -1;
            for (int e = 0; e < 12; ++e) {
                if (root[e] < 0 || !edge_on_face(e, face / 2, face & 1)) continue;
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

static make_point lattice_point(const lattice *l, double x, double y, double z) {
    return make_p(l->origin.x + x * l->step, l->origin.y + y * l->step, l->origin.z + z * l->step);
}

static double value_at(const lattice *l, make_point p) {
    return l->field->value(l->field->user, p);
}

/* OUTSIDE or INSIDE when no corner of the `size` cells from a block's first on can lie on the surface. */
static int classify(const lattice *l, int x, int y, int z, int size) {
    double half = .5 * size;
    double f = value_at(l, lattice_point(l, x * B + half, y * B + half, z * B + half));
    double reach = l->field->slope * (half + 1.01) * 1.7320508 * l->step;
    return f > reach ? OUTSIDE : f < -reach ? INSIDE : SURFACE;
}

static size_t block_at(const lattice *l, int x, int y, int z) {
    return ((size_t)z * (size_t)l->blocks[1] + (size_t)y) * (size_t)l->blocks[0] + (size_t)x;
}

static void find_blocks_of(lattice *l, int x0, int y0, int z0, int state) {
    for (int z = z0; z < z0 + B && z < l->blocks[2]; ++z)
        for (int y = y0; y < y0 + B && y < l->blocks[1]; ++y)
            for (int x = x0; x < x0 + B && x < l->blocks[0]; ++x) {
                int own = state == SURFACE ? classify(l, x, y, z, B) : state;
                l->index[block_at(l, x, y, z)] = own == SURFACE ? l->active++ : own;
            }
}

static bool find_blocks(lattice *l) {
    for (int z = 0; z < l->blocks[2]; z += B)
        for (int y = 0; y < l->blocks[1]; y += B)
            for (int x = 0; x < l->blocks[0]; x += B) find_blocks_of(l, x, y, z, classify(l, x, y, z, B * B));
    l->places = tool_allocate(l->t, (size_t)l->active, sizeof *l->places);
    l->bits = tool_allocate(l->t, (size_t)l->active, sizeof *l->bits);
    if (!l->places || !l->bits) return false;
    for (int z = 0; z < l->blocks[2]; ++z)
        for (int y = 0; y < l->blocks[1]; ++y)
            for (int x = 0; x < l->blocks[0]; ++x) {
                int number = l->index[block_at(l, x, y, z)];
                if (number < 0) continue;
                l->places[number][0] = x, l->places[number][1] = y, l->places[number][2] = z;
            }
    return true;
}

/* Signs of the 4^3 corners from (x, y, z) of a block on, by one value where the slope lets that do. */
static void take_eighth(lattice *l, int b, int x0, int y0, int z0) {
    const int *at = l->places[b];
    double x = at[0] * B + x0, y = at[1] * B + y0, z = at[2] * B + z0;
    double f = value_at(l, lattice_point(l, x + 1.5, y + 1.5, z + 1.5));
    bool all = fabs(f) > l->field->slope * 1.5 * 1.7320509 * l->step;
    for (int k = 0; k < 64; ++k) {
        int dx = k & 3, dy = k >> 2 & 3, dz = k >> 4;
        bool inside = all ? f < 0 : value_at(l, lattice_point(l, x + dx, y + dy, z + dz)) < 0;
        l->bits[b][z0 + dz] |= (uint64_t)inside << ((y0 + dy) * B + x0 + dx);
    }
}

static void take_signs(lattice *l) {
    memset(l->bits, 0, (size_t)l->active * sizeof *l->bits);
    for (int b = 0; b < l->active; ++b)
        for (int k = 0; k < 8; ++k) take_eighth(l, b, k % 2 * 4, k / 2 % 2 * 4, k / 4 * 4);
}

/* Number of the block next to block b, or its state. */
static int neighbour(const lattice *l, int b, int dx, int dy, int dz) {
    int x = l->places[b][0] + dx, y = l->places[b][1] + dy, z = l->places[b][2] + dz;
    if (x < 0 || y < 0 || z < 0 || x >= l->blocks[0] || y >= l->blocks[1] || z >= l->blocks[2])
        return OUTSIDE;
    return l->index[block_at(l, x, y, z)];
}

/* Signs of the block's corners and of the next ones behind. */
static void gather(const lattice *l, int b, uint8_t sign[LOCAL][LOCAL][LOCAL]) {
    int around[8];
    for (int k = 0; k < 8; ++k) around[k] = neighbour(l, b, k & 1, k >> 1 & 1, k >> 2);
    for (int z = 0; z < LOCAL; ++z)
        for (int y = 0; y < LOCAL; ++y)
            for (int x = 0; x < LOCAL; ++x) {
                int from = around[(x == B) | (y == B) << 1 | (z == B) << 2];
                sign[z][y][x] = from < 0 ? from == INSIDE : l->bits[from][z % B] >> (y % B * B + x % B) & 1;
            }
}

/* Fills corner (x, y, z) of block b, possibly in the block behind; false when it lies in a uniform block. */
static bool fill(lattice *l, int b, const int at[3]) {
    int owner = neighbour(l, b, at[0] == B, at[1] == B, at[2] == B);
    if (owner < 0) return false;
    l->bits[owner][at[2] % B] |= (uint64_t)1 << (at[1] % B * B + at[0] % B);
    return true;
}

/* One pass over all faces; returns how many corners were filled. */
static size_t fill_ambiguous(lattice *l) {
    size_t filled = 0;
    uint8_t sign[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active; ++b) {
        gather(l, b, sign);
        for (int k = 0; k < CORNERS * 3; ++k) {
            int at[3] = {k / 3 % B, k / 3 / B % B, k / 3 / (B * B)}, u = k % 3, v = (u + 1) % 3;
            int c[4][3];
            for (int i = 0; i < 4; ++i) {
                memcpy(c[i], at, sizeof at);
                c[i][u] += i & 1, c[i][v] += i >> 1;
            }
            int s[4];
            for (int i = 0; i < 4; ++i) s[i] = sign[c[i][2]][c[i][1]][c[i][0]];
            if (s[0] != s[3] || s[1] != s[2] || s[0] == s[1]) continue;
            int outer = s[0] ? 1 : 0, other = s[0] ? 2 : 3;
            if (!fill(l, b, c[outer])) fill(l, b, c[other]);
            ++filled;
            gather(l, b, sign);
        }
    }
    return filled;
}

static size_t count_crossings(const lattice *l) {
    size_t count = 0;
    uint8_t s[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active; ++b) {
        gather(l, b, s);
        for (int z = 0; z < B; ++z)
            for (int y = 0; y < B; ++y)
                for (int x = 0; x < B; ++x)
                    count += (size_t)(s[z][y][x] ^ s[z][y][x + 1]) + (s[z][y][x] ^ s[z][y + 1][x]) +
                             (s[z][y][x] ^ s[z + 1][y][x]);
    }
    return count;
}

static int cell_config(uint8_t s[LOCAL][LOCAL][LOCAL], int x, int y, int z) {
    int config = 0;
    for (int k = 0; k < 8; ++k) config |= s[z + (k >> 2)][y + (k >> 1 & 1)][x + (k & 1)] << k;
    return config;
}

/* Middle of the crossing edges of one sheet of a cell. */
static make_point sheet_middle(const sheets *table, int config, int sheet) {
    double sum[3] = {0, 0, 0};
    int count = 0;
    for (int e = 0; e < 12; ++e) {
        if (table->of_edge[config][e] != sheet) continue;
        int corner = edge_corner(e, 0);
        for (int c = 0; c < 3; ++c) sum[c] += (corner >> c & 1) + (c == e / 4 ? .5 : 0);
        ++count;
    }
    return make_p(sum[0] / count, sum[1] / count, sum[2] / count);
}

static bool add_vertices(lattice *l, const sheets *table, make_mesh *m) {
    l->bases = tool_allocate(l->t, (size_t)l->active, sizeof *l->bases);
    l->offsets = tool_allocate(l->t, (size_t)l->active, sizeof *l->offsets);
    if (!l->bases || !l->offsets) return false;
    uint8_t sign[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active && !m->failed; ++b) {
        const int *at = l->places[b];
        l->bases[b] = (uint32_t)m->vertex_count;
        gather(l, b, sign);
        for (int k = 0; k < CORNERS; ++k) {
            int x = k % B, y = k / B % B, z = k / (B * B), config = cell_config(sign, x, y, z);
            l->offsets[b][k] = UINT16_MAX;
            if (table->count[config]) l->offsets[b][k] = (uint16_t)(m->vertex_count - l->bases[b]);
            for (int sheet = 0; sheet < table->count[config]; ++sheet) {
                make_point p = sheet_middle(table, config, sheet);
                make_vertex(m,
                            lattice_point(l, at[0] * B + x + p.x, at[1] * B + y + p.y, at[2] * B + z + p.z));
            }
        }
    }
    return !m->failed;
}

static bool corner_inside(const lattice *l, int b, int x, int y, int z) {
    int owner = neighbour(l, b, x < 0 ? -1 : x >= B, y < 0 ? -1 : y >= B, z < 0 ? -1 : z >= B);
    if (owner < 0) return owner == INSIDE;
    return l->bits[owner][(z + B) % B] >> ((y + B) % B * B + (x + B) % B) & 1;
}

/* Vertex of the sheet that `edge` belongs to, in cell `at` of block b or of a block beside it. */
static uint32_t sheet_vertex(const lattice *l, const sheets *table, int b, const int at[3], int edge) {
    int config = 0;
    for (int k = 0; k < 8; ++k)
        config |= corner_inside(l, b, at[0] + (k & 1), at[1] + (k >> 1 & 1), at[2] + (k >> 2)) << k;
    int owner = neighbour(l, b, -(at[0] < 0), -(at[1] < 0), -(at[2] < 0));
    int cell = (((at[2] + B) % B) * B + (at[1] + B) % B) * B + (at[0] + B) % B;
    return l->bases[owner] + l->offsets[owner][cell] + table->of_edge[config][edge];
}

static void add_quads(const lattice *l, const sheets *table, make_mesh *m) {
    uint8_t sign[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active && !m->failed; ++b) {
        gather(l, b, sign);
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
                    corner[i] = sheet_vertex(l, table, b, cell, 4 * axis + back_u + 2 * back_v);
                }
                if (inside)
                    make_quad(m, corner[0], corner[1], corner[2], corner[3]);
                else
                    make_quad(m, corner[0], corner[3], corner[2], corner[1]);
            }
        }
    }
}

/* One Newton step along the gradient, at most one lattice step long. */
static void step_to_surface(const lattice *l, float *vertex) {
    static const double tetrahedron[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    double d = .05 * l->step, mean = 0, gradient[3] = {0, 0, 0};
    for (int k = 0; k < 4; ++k) {
        const double *s = tetrahedron[k];
        double f = value_at(l, make_p(vertex[0] + d * s[0], vertex[1] + d * s[1], vertex[2] + d * s[2]));
        mean += .25 * f;
        for (int c = 0; c < 3; ++c) gradient[c] += .25 * f * s[c] / d;
    }
    double square = gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2];
    if (!(square > 1e-6)) return;
    double along = -mean / square, length = fabs(along) * sqrt(square);
    if (length > l->step) along *= l->step / length;
    for (int c = 0; c < 3; ++c) vertex[c] = (float)(vertex[c] + along * gradient[c]);
}

/* Half-way to the mean of the neighbours along the sides of quads (two triangles each, from `first` on). */
static void average(const lattice *l, make_mesh *m, size_t first_vertex, size_t first_face,
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

static double distance2(const make_mesh *m, uint32_t a, uint32_t b) {
    const float *p = m->positions + 3 * (size_t)a, *q = m->positions + 3 * (size_t)b;
    double x = (double)p[0] - q[0], y = (double)p[1] - q[1], z = (double)p[2] - q[2];
    return x * x + y * y + z * z;
}

static bool finish(const lattice *l, make_mesh *m, size_t first_vertex, size_t first_face) {
    float(*sums)[4] = tool_allocate(l->t, m->vertex_count - first_vertex, sizeof *sums);
    if (!sums) return false;
    for (int round = 0; round < 5; ++round) {
        if (round > 1) average(l, m, first_vertex, first_face, sums);
        for (size_t v = first_vertex; v < m->vertex_count; ++v) step_to_surface(l, m->positions + 3 * v);
    }
    for (size_t f = first_face; f < m->face_count; f += 2) {
        uint32_t *t = m->triangles + 3 * f, q[4] = {t[0], t[1], t[2], t[5]};
        if (distance2(m, q[0], q[2]) <= distance2(m, q[1], q[3])) continue;
        uint32_t turned[6] = {q[1], q[2], q[3], q[1], q[3], q[0]};
        memcpy(t, turned, sizeof turned);
    }
    tool_release(l->t, sums);
    return true;
}

static void close_lattice(lattice *l) {
    tool_release(l->t, l->index);
    tool_release(l->t, l->places);
    tool_release(l->t, l->bits);
    tool_release(l->t, l->bases);
    tool_release(l->t, l->offsets);
}

/* Signs at the given spacing, without ambiguous faces. */
static bool open_lattice(tool *t, const make_field *field, double step, lattice *l) {
    double size[3] = {field->upper.x - field->lower.x, field->upper.y - field->lower.y,
                      field->upper.z - field->lower.z};
    *l = (lattice){.t = t, .field = field, .step = step};
    l->origin =
        make_p(field->lower.x - 1.37 * step, field->lower.y - 1.37 * step, field->lower.z - 1.37 * step);
    size_t total = 1;
    for (int c = 0; c < 3; ++c) {
        l->blocks[c] = (int)ceil((size[c] / step + 3) / B);
        total *= (size_t)l->blocks[c];
    }
    l->index = tool_allocate(t, total, sizeof *l->index);
    if (!l->index || !find_blocks(l)) return false;
    take_signs(l);
    while (fill_ambiguous(l) > 0) {
    }
    return true;
}

/* Spacing for a count of triangles: the count grows with its inverse square, and a little more where detail
 * appears, so it is measured once more near the end. */
static bool find_step(tool *t, const make_field *field, uint32_t triangles, double *step) {
    double size = fmax(field->upper.x - field->lower.x,
                       fmax(field->upper.y - field->lower.y, field->upper.z - field->lower.z));
    *step = size / 40;
    for (int round = 0; round < 3; ++round) {
        lattice l;
        bool good = open_lattice(t, field, *step, &l);
        double found = good ? 2. * (double)count_crossings(&l) : 1;
        close_lattice(&l);
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
    lattice l = {.t = m->t};
    number_sheets(&table);
    size_t first_vertex = m->vertex_count, first_face = m->face_count;
    bool good = find_step(m->t, field, triangles, &step) && open_lattice(m->t, field, step, &l);
    if (good) {
        size_t crossings = count_crossings(&l);
        make_reserve(m, crossings + crossings / 64 + 64, 2 * crossings);
        good = !m->failed && add_vertices(&l, &table, m);
    }
    if (good) {
        add_quads(&l, &table, m);
        good = !m->failed && finish(&l, m, first_vertex, first_face);
    }
    close_lattice(&l);
    return good ? TOOL_DONE : TOOL_MEMORY;
}
