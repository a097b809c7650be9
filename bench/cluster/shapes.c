/* bench/cluster/shapes.c: makes subdivided, shuffled and adversarial meshes, which `facetree make` does not
 * make.
 *
 * usage:
 * - shapes NAME COUNT OUT: strip, fan, loose, books, cubes, blocks, lattice, turned-lattice, beams,
 *   needles or gear, of COUNT triangles
 * - shapes subdivide LEVELS IN OUT: splits each triangle into four, LEVELS times, with noise
 * - shapes shuffle-faces SEED IN OUT
 * - shapes shuffle SEED IN OUT: vertices, too
 * - shapes copy 0 IN OUT
 *
 * The output depends on the arguments only.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/cluster/bench.h"

/* --- Meshes from formulas --- */

static void start(const fct_env *env, uint32_t vertices, uint32_t faces, fct_mesh *m) {
    bench_check(fct_mesh_create(env, vertices, faces, 0, m), "a mesh");
    m->vertex_count = m->face_count = 0;
}

static uint32_t add_vertex(fct_mesh *m, double x, double y, double z) {
    float *p = m->positions + 3 * (size_t)m->vertex_count;
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
    return m->vertex_count++;
}

static void add_face(fct_mesh *m, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *t = m->triangles + 3 * (size_t)m->face_count++;
    t[0] = a, t[1] = b, t[2] = c;
}

/* Two rails and the triangles between them. */
static void make_strip(const fct_env *env, uint32_t count, fct_mesh *m) {
    start(env, count + 2, count, m);
    for (uint32_t i = 0; i < count + 2; ++i) add_vertex(m, i / 2 + .5 * (i % 2), i % 2, 0);
    for (uint32_t i = 0; i < count; ++i) add_face(m, i, i + 1 + i % 2, i + 2 - i % 2);
}

/* All faces share one vertex; a flat cone, closed around it. */
static void make_fan(const fct_env *env, uint32_t count, fct_mesh *m) {
    start(env, count + 1, count, m);
    add_vertex(m, 0, .2, 0);
    for (uint32_t i = 0; i < count; ++i) {
        double angle = 2 * M_PI * i / count;
        add_vertex(m, cos(angle), 0, sin(angle));
    }
    for (uint32_t i = 0; i < count; ++i) add_face(m, 0, 1 + (i + 1) % count, 1 + i);
}

/* Random triangles that share no vertex. */
static void make_loose(const fct_env *env, uint32_t count, fct_mesh *m) {
    bench_dice dice = {1};
    double size = .5 / cbrt(count);
    start(env, 3 * count, count, m);
    for (uint32_t i = 0; i < count; ++i) {
        double x = bench_unit(&dice), y = bench_unit(&dice), z = bench_unit(&dice);
        for (int k = 0; k < 3; ++k) {
            double dx = bench_unit(&dice), dy = bench_unit(&dice), dz = bench_unit(&dice);
            add_vertex(m, x + size * dx, y + size * dy, z + size * dz);
        }
        add_face(m, 3 * i, 3 * i + 1, 3 * i + 2);
    }
}

/* Books of up to 100,000 pages. All pages of a book share one edge. */
static void make_books(const fct_env *env, uint32_t count, fct_mesh *m) {
    enum { PAGES = 100000 };
    start(env, count + 2 * (count / PAGES + 1), count, m);
    uint32_t spine = 0;
    for (uint32_t i = 0; i < count; ++i) {
        double x = 3 * (i / PAGES), angle = 2 * M_PI * (i % PAGES) / PAGES;
        if (i % PAGES == 0) spine = add_vertex(m, x, 0, 0), add_vertex(m, x, 1, 0);
        add_face(m, spine, spine + 1, add_vertex(m, x + cos(angle), .5, sin(angle)));
    }
}

/* Corners 0 to 7 of a cube: bit 0 is x, bit 1 is y, bit 2 is z. */
static const uint8_t cube_sides[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

/* A high stack of small cubes with gaps between them. */
static void make_cubes(const fct_env *env, uint32_t count, fct_mesh *m) {
    uint32_t cubes = count < 12 ? 1 : count / 12;
    start(env, 8 * cubes, 12 * cubes, m);
    for (uint32_t c = 0; c < cubes; ++c) {
        for (uint32_t k = 0; k < 8; ++k) add_vertex(m, k & 1, 1.25 * c + (k >> 1 & 1), k >> 2);
        for (int s = 0; s < 12; ++s)
            add_face(m, 8 * c + cube_sides[s][0], 8 * c + cube_sides[s][1], 8 * c + cube_sides[s][2]);
    }
}

/* Cubes at half of the places of a cubic grid, at random. Neighbours share vertices, and keep the two equal
 * faces between them. */
static void make_blocks(const fct_env *env, uint32_t count, fct_mesh *m) {
    bench_dice dice = {1};
    uint32_t n = (uint32_t)cbrt(count / 6.0) + 1, row = n + 1;
    start(env, row * row * row, 12 * n * n * n, m);
    for (uint32_t v = 0; v < row * row * row; ++v) add_vertex(m, v % row, v / row % row, v / row / row);
    for (uint32_t c = 0; c < n * n * n; ++c) {
        uint32_t at = c % n + row * (c / n % n + row * (c / n / n));
        if (bench_roll(&dice) & 1) continue;
        for (int s = 0; s < 12; ++s) {
            uint32_t v[3];
            for (int k = 0; k < 3; ++k) {
                uint32_t corner = cube_sides[s][k];
                v[k] = at + (corner & 1) + row * (corner >> 1 & 1) + row * row * (corner >> 2);
            }
            add_face(m, v[0], v[1], v[2]);
        }
    }
}

/* Cubes at the points of a cubic grid, which fill an eighth of it. */
static void make_lattice(const fct_env *env, uint32_t count, fct_mesh *m) {
    uint32_t n = (uint32_t)cbrt(count / 12.0) + 1;
    start(env, 8 * n * n * n, 12 * n * n * n, m);
    for (uint32_t c = 0; c < n * n * n; ++c) {
        for (uint32_t k = 0; k < 8; ++k)
            add_vertex(m, c % n + .5 * (k & 1), c / n % n + .5 * (k >> 1 & 1), c / n / n + .5 * (k >> 2));
        for (int s = 0; s < 12; ++s)
            add_face(m, 8 * c + cube_sides[s][0], 8 * c + cube_sides[s][1], 8 * c + cube_sides[s][2]);
    }
}

/* The same, turned as a whole: its edges run along diagonals. */
static void make_turned_lattice(const fct_env *env, uint32_t count, fct_mesh *m) {
    static const double r[3][3] = {
        {2. / 3, -1. / 3, 2. / 3}, {2. / 3, 2. / 3, -1. / 3}, {-1. / 3, 2. / 3, 2. / 3}};
    make_lattice(env, count, m);
    for (uint32_t v = 0; v < m->vertex_count; ++v) {
        float *p = m->positions + 3 * (size_t)v;
        const double x = (double)p[0], y = (double)p[1], z = (double)p[2];
        for (int k = 0; k < 3; ++k) p[k] = (float)(r[k][0] * x + r[k][1] * y + r[k][2] * z);
    }
}

/* Two directions across `along`, of length `size`. */
static void find_sides(const double along[3], double size, double a[3], double b[3]) {
    double flat = hypot(along[0], along[1]), length = hypot(flat, along[2]);
    a[0] = -along[1] / flat * size, a[1] = along[0] / flat * size, a[2] = 0;
    for (int k = 0; k < 3; ++k) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        b[k] = (along[i] * a[j] - along[j] * a[i]) / length;
    }
}

/* Square beams of 40 pieces along the diagonal of the unit cube, of slightly different directions. */
static void make_beams(const fct_env *env, uint32_t count, fct_mesh *m) {
    enum { PIECES = 40 };
    bench_dice dice = {1};
    uint32_t beams = count / (8 * PIECES) + 1;
    start(env, 4 * (PIECES + 1) * beams, 8 * PIECES * beams, m);
    for (uint32_t i = 0; i < beams; ++i) {
        double from[3], along[3], a[3], b[3];
        for (int k = 0; k < 3; ++k) from[k] = bench_unit(&dice), along[k] = .9 + .2 * bench_unit(&dice);
        find_sides(along, .1 / sqrt(beams), a, b);
        uint32_t base = m->vertex_count;
        for (uint32_t v = 0; v < 4 * (PIECES + 1); ++v) {
            static const double corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
            double s = (double)(v / 4) / PIECES, x = corner[v % 4][0], y = corner[v % 4][1], p[3];
            for (int k = 0; k < 3; ++k) p[k] = from[k] + s * along[k] + x * a[k] + y * b[k];
            add_vertex(m, p[0], p[1], p[2]);
        }
        for (uint32_t v = 0; v < 4 * PIECES; ++v) {
            uint32_t p = base + v, q = base + v / 4 * 4 + (v + 1) % 4;
            add_face(m, p, q, q + 4), add_face(m, p, q + 4, p + 4);
        }
    }
}

/* Thin triangles of random directions that share no vertex, as long as a tenth of the cube that holds them.
 */
static void make_needles(const fct_env *env, uint32_t count, fct_mesh *m) {
    bench_dice dice = {1};
    start(env, 3 * count, count, m);
    for (uint32_t i = 0; i < count; ++i) {
        double from[3], along[3], a[3], b[3];
        for (int k = 0; k < 3; ++k) from[k] = bench_unit(&dice), along[k] = .1 * (2 * bench_unit(&dice) - 1);
        find_sides(along, 1e-3, a, b);
        uint32_t v = add_vertex(m, from[0] - a[0], from[1] - a[1], from[2] - a[2]);
        add_vertex(m, from[0] + a[0], from[1] + a[1], from[2] + a[2]);
        add_vertex(m, from[0] + along[0], from[1] + along[1], from[2] + along[2]);
        add_face(m, v, v + 1, v + 2);
    }
}

/* A gear of height 1 with a hole and twelve rounded teeth: flat ends, curved walls, sharp edges between them.
 * A closed profile of `around` points (outer wall, upper end, inner wall, lower end) repeats at `turns`
 * angles. */
static void make_gear(const fct_env *env, uint32_t count, fct_mesh *m) {
    uint32_t quarter = (uint32_t)(sqrt(count / 2.0) / 8) + 1, around = 4 * quarter,
             turns = count / 2 / around;
    if (turns < 3) turns = 3;
    start(env, around * turns, 2 * around * turns, m);
    for (uint32_t i = 0; i < turns; ++i) {
        double angle = 2 * M_PI * i / turns, tooth = fmax(-1, fmin(1, 3 * sin(12 * angle)));
        double outer = 2.6 + .25 * tooth, inner = 1.2;
        for (uint32_t k = 0; k < around; ++k) {
            double t = (double)(k % quarter) / quarter, radius, height;
            switch (k / quarter) {
            case 0:
                radius = outer, height = t;
                break;
            case 1:
                radius = outer + t * (inner - outer), height = 1;
                break;
            case 2:
                radius = inner, height = 1 - t;
                break;
            default:
                radius = inner + t * (outer - inner), height = 0;
            }
            add_vertex(m, radius * cos(angle), radius * sin(angle), height);
        }
    }
    for (uint32_t i = 0; i < turns; ++i)
        for (uint32_t k = 0; k < around; ++k) {
            uint32_t a = i * around + k, b = i * around + (k + 1) % around;
            uint32_t c = (i + 1) % turns * around + k, d = (i + 1) % turns * around + (k + 1) % around;
            add_face(m, a, c, b), add_face(m, b, c, d);
        }
}

/* --- Meshes from another mesh --- */

typedef struct side {
    uint32_t low, high, corner;
} side;

static int compare_sides(const void *x, const void *y) {
    const side *a = x, *b = y;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return a->corner < b->corner ? -1 : a->corner > b->corner;
}

/* The middle of a side, moved at random by at most a twentieth of its length. */
static uint32_t add_middle(fct_mesh *m, bench_dice *dice, uint32_t a, uint32_t b) {
    const float *p = m->positions + 3 * (size_t)a, *q = m->positions + 3 * (size_t)b;
    double d[3], r[3], length = 0;
    for (int k = 0; k < 3; ++k) d[k] = (double)q[k] - (double)p[k], length += d[k] * d[k];
    do
        for (int k = 0; k < 3; ++k) r[k] = 2 * bench_unit(dice) - 1;
    while (r[0] * r[0] + r[1] * r[1] + r[2] * r[2] > 1);
    length = .05 * sqrt(length);
    for (int k = 0; k < 3; ++k) r[k] = (double)p[k] + .5 * d[k] + length * r[k];
    return add_vertex(m, r[0], r[1], r[2]);
}

static void subdivide(const fct_env *env, const fct_mesh *in, bench_dice *dice, fct_mesh *out) {
    size_t corners = 3 * (size_t)in->face_count;
    if (in->face_count > 100000000) bench_fail("a mesh too large to subdivide");
    side *sides = bench_allocate(corners, sizeof *sides);
    uint32_t *middles = bench_allocate(corners, sizeof *middles), distinct = 0;
    for (size_t c = 0; c < corners; ++c) {
        uint32_t a = in->triangles[c], b = in->triangles[c % 3 == 2 ? c - 2 : c + 1];
        sides[c] = (side){a < b ? a : b, a < b ? b : a, (uint32_t)c};
    }
    qsort(sides, corners, sizeof *sides, compare_sides);
    for (size_t i = 0; i < corners; ++i)
        distinct += i == 0 || sides[i].low != sides[i - 1].low || sides[i].high != sides[i - 1].high;
    start(env, in->vertex_count + distinct, 4 * in->face_count, out);
    memcpy(out->positions, in->positions, 3 * (size_t)in->vertex_count * sizeof(float));
    out->vertex_count = in->vertex_count;
    for (size_t i = 0; i < corners; ++i) {
        bool again = i > 0 && sides[i].low == sides[i - 1].low && sides[i].high == sides[i - 1].high;
        middles[sides[i].corner] =
            again ? middles[sides[i - 1].corner] : add_middle(out, dice, sides[i].low, sides[i].high);
    }
    for (size_t f = 0; f < in->face_count; ++f) {
        const uint32_t *t = in->triangles + 3 * f, *e = middles + 3 * f;
        add_face(out, t[0], e[0], e[2]), add_face(out, t[1], e[1], e[0]);
        add_face(out, t[2], e[2], e[1]), add_face(out, e[0], e[1], e[2]);
    }
    free(sides);
    free(middles);
}

static void subdivide_often(const fct_env *env, uint32_t levels, fct_mesh *m) {
    bench_dice dice = {7};
    for (uint32_t i = 0; i < levels; ++i) {
        fct_mesh finer;
        subdivide(env, m, &dice, &finer);
        fct_mesh_release(env, m);
        *m = finer;
    }
}

static uint32_t *permutation(uint32_t count, bench_dice *dice) {
    uint32_t *order = bench_allocate(count, sizeof *order);
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t j = (uint32_t)(bench_roll(dice) % (i + 1));
        order[i] = order[j], order[j] = i;
    }
    return order;
}

static void shuffle(const fct_env *env, uint32_t seed, bool vertices, fct_mesh *m) {
    bench_dice dice = {seed};
    fct_mesh out;
    start(env, m->vertex_count, m->face_count, &out);
    uint32_t *faces = permutation(m->face_count, &dice), *places = permutation(m->vertex_count, &dice);
    for (uint32_t v = 0; v < m->vertex_count; ++v)
        memcpy(out.positions + 3 * (size_t)(vertices ? places[v] : v), m->positions + 3 * (size_t)v,
               3 * sizeof(float));
    for (size_t f = 0; f < m->face_count; ++f) {
        const uint32_t *t = m->triangles + 3 * (size_t)faces[f];
        if (vertices)
            add_face(&out, places[t[0]], places[t[1]], places[t[2]]);
        else
            add_face(&out, t[0], t[1], t[2]);
    }
    out.vertex_count = m->vertex_count;
    free(faces);
    free(places);
    fct_mesh_release(env, m);
    *m = out;
}

int main(int argc, char **argv) {
    static const struct {
        const char *name;
        void (*make)(const fct_env *env, uint32_t count, fct_mesh *m);
    } made[] = {{"strip", make_strip},
                {"fan", make_fan},
                {"loose", make_loose},
                {"books", make_books},
                {"cubes", make_cubes},
                {"blocks", make_blocks},
                {"beams", make_beams},
                {"needles", make_needles},
                {"gear", make_gear},
                {"lattice", make_lattice},
                {"turned-lattice", make_turned_lattice}};
    fct_env env = bench_env(2);
    fct_mesh m = {0};
    if (argc < 4 || argc > 5) bench_fail("usage: shapes NAME COUNT [IN] OUT");
    uint32_t count = bench_count(argv[2], "COUNT");
    for (size_t i = 0; i < sizeof made / sizeof *made && argc == 4; ++i)
        if (strcmp(argv[1], made[i].name) == 0) made[i].make(&env, count < 2 ? 2 : count, &m);
    if (argc == 5) {
        bench_load(&env, argv[3], &m);
        if (strcmp(argv[1], "subdivide") == 0)
            subdivide_often(&env, count, &m);
        else if (strcmp(argv[1], "shuffle") == 0 || strcmp(argv[1], "shuffle-faces") == 0)
            shuffle(&env, count, strcmp(argv[1], "shuffle") == 0, &m);
        else if (strcmp(argv[1], "copy") != 0)
            fct_mesh_release(&env, &m);
    }
    if (m.face_count == 0) bench_fail("cannot make '%s'", argv[1]);
    bench_save(&env, argv[argc - 1], &m);
    fct_mesh_release(&env, &m);
    return 0;
}
