/* tools/make/lattice.c: see lattice.h.
 *
 * A face of a cell is ambiguous if exactly its two diagonal corners are inside: sheets would then meet twice
 * in one edge. One of the outer corners is made inside until no face is ambiguous. The surface through the
 * lattice is then a manifold.
 */
#include "tools/make/lattice.h"

#include <math.h>
#include <string.h>

make_point make_lattice_point(const make_lattice *l, double x, double y, double z) {
    return make_p(l->origin.x + x * l->step, l->origin.y + y * l->step, l->origin.z + z * l->step);
}

double make_lattice_value(const make_lattice *l, make_point p) {
    return l->field->value(l->field->user, p);
}

/* SURFACE if the surface can reach the cube of `size` cells at the block (x, y, z), by the slope of the
 * field; else OUTSIDE or INSIDE. */
static int classify_block(const make_lattice *l, int x, int y, int z, int size) {
    double half = .5 * size;
    double f = make_lattice_value(l, make_lattice_point(l, x * B + half, y * B + half, z * B + half));
    double reach = l->field->slope * (half + 1.01) * 1.7320508 * l->step;
    return f > reach ? OUTSIDE : f < -reach ? INSIDE : SURFACE;
}

static size_t find_block(const make_lattice *l, int x, int y, int z) {
    return ((size_t)z * (size_t)l->blocks[1] + (size_t)y) * (size_t)l->blocks[0] + (size_t)x;
}

static void find_blocks_of(make_lattice *l, int x0, int y0, int z0, int state) {
    for (int z = z0; z < z0 + B && z < l->blocks[2]; ++z)
        for (int y = y0; y < y0 + B && y < l->blocks[1]; ++y)
            for (int x = x0; x < x0 + B && x < l->blocks[0]; ++x) {
                int own = state == SURFACE ? classify_block(l, x, y, z, B) : state;
                l->index[find_block(l, x, y, z)] = own == SURFACE ? l->active++ : own;
            }
}

static bool find_blocks(make_lattice *l) {
    for (int z = 0; z < l->blocks[2]; z += B)
        for (int y = 0; y < l->blocks[1]; y += B)
            for (int x = 0; x < l->blocks[0]; x += B)
                find_blocks_of(l, x, y, z, classify_block(l, x, y, z, B * B));
    l->places = tool_allocate(l->t, (size_t)l->active, sizeof *l->places);
    l->bits = tool_allocate(l->t, (size_t)l->active, sizeof *l->bits);
    if (!l->places || !l->bits) return false;
    for (int z = 0; z < l->blocks[2]; ++z)
        for (int y = 0; y < l->blocks[1]; ++y)
            for (int x = 0; x < l->blocks[0]; ++x) {
                int number = l->index[find_block(l, x, y, z)];
                if (number < 0) continue;
                l->places[number][0] = x, l->places[number][1] = y, l->places[number][2] = z;
            }
    return true;
}

/* Takes the signs of the 4^3 corners from (x0, y0, z0) of a block on. One value decides if the slope allows
 * it. */
static void take_eighth(make_lattice *l, int b, int x0, int y0, int z0) {
    const int *at = l->places[b];
    double x = at[0] * B + x0, y = at[1] * B + y0, z = at[2] * B + z0;
    double f = make_lattice_value(l, make_lattice_point(l, x + 1.5, y + 1.5, z + 1.5));
    bool all = fabs(f) > l->field->slope * 1.5 * 1.7320509 * l->step;
    for (int k = 0; k < 64; ++k) {
        int dx = k & 3, dy = k >> 2 & 3, dz = k >> 4;
        bool inside = all ? f < 0 : make_lattice_value(l, make_lattice_point(l, x + dx, y + dy, z + dz)) < 0;
        l->bits[b][z0 + dz] |= (uint64_t)inside << ((y0 + dy) * B + x0 + dx);
    }
}

static void take_signs(make_lattice *l) {
    memset(l->bits, 0, (size_t)l->active * sizeof *l->bits);
    for (int b = 0; b < l->active; ++b)
        for (int k = 0; k < 8; ++k) take_eighth(l, b, k % 2 * 4, k / 2 % 2 * 4, k / 4 * 4);
}

int make_lattice_neighbour(const make_lattice *l, int b, int dx, int dy, int dz) {
    int x = l->places[b][0] + dx, y = l->places[b][1] + dy, z = l->places[b][2] + dz;
    if (x < 0 || y < 0 || z < 0 || x >= l->blocks[0] || y >= l->blocks[1] || z >= l->blocks[2])
        return OUTSIDE;
    return l->index[find_block(l, x, y, z)];
}

void make_lattice_gather(const make_lattice *l, int b, uint8_t sign[LOCAL][LOCAL][LOCAL]) {
    int around[8];
    for (int k = 0; k < 8; ++k) around[k] = make_lattice_neighbour(l, b, k & 1, k >> 1 & 1, k >> 2);
    for (int z = 0; z < LOCAL; ++z)
        for (int y = 0; y < LOCAL; ++y)
            for (int x = 0; x < LOCAL; ++x) {
                int from = around[(x == B) | (y == B) << 1 | (z == B) << 2];
                sign[z][y][x] = from < 0 ? from == INSIDE : l->bits[from][z % B] >> (y % B * B + x % B) & 1;
            }
}

/* Makes a corner of block b, or of the next block, inside. False if the corner is in a block without a
 * number. */
static bool fill_corner(make_lattice *l, int b, const int at[3]) {
    int owner = make_lattice_neighbour(l, b, at[0] == B, at[1] == B, at[2] == B);
    if (owner < 0) return false;
    l->bits[owner][at[2] % B] |= (uint64_t)1 << (at[1] % B * B + at[0] % B);
    return true;
}

/* One pass over all faces of cells. Returns the number of corners that were made inside. */
static size_t fill_ambiguous(make_lattice *l) {
    size_t filled = 0;
    uint8_t sign[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active; ++b) {
        make_lattice_gather(l, b, sign);
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
            if (!fill_corner(l, b, c[outer])) fill_corner(l, b, c[other]);
            ++filled;
            make_lattice_gather(l, b, sign);
        }
    }
    return filled;
}

size_t make_lattice_crossings(const make_lattice *l) {
    size_t count = 0;
    uint8_t s[LOCAL][LOCAL][LOCAL];
    for (int b = 0; b < l->active; ++b) {
        make_lattice_gather(l, b, s);
        for (int z = 0; z < B; ++z)
            for (int y = 0; y < B; ++y)
                for (int x = 0; x < B; ++x)
                    count += (size_t)(s[z][y][x] ^ s[z][y][x + 1]) + (s[z][y][x] ^ s[z][y + 1][x]) +
                             (s[z][y][x] ^ s[z + 1][y][x]);
    }
    return count;
}

void make_lattice_close(make_lattice *l) {
    tool_release(l->t, l->index);
    tool_release(l->t, l->places);
    tool_release(l->t, l->bits);
    tool_release(l->t, l->bases);
    tool_release(l->t, l->offsets);
}

bool make_lattice_open(tool *t, const make_field *field, double step, make_lattice *l) {
    double size[3] = {field->upper.x - field->lower.x, field->upper.y - field->lower.y,
                      field->upper.z - field->lower.z};
    *l = (make_lattice){.t = t, .field = field, .step = step};
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
