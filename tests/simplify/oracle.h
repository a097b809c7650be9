/* tests/simplify/oracle.h: arithmetic and meshes for the oracles of the simplifier. The arithmetic is plain
 * double and shares no code with the library. */
#ifndef FCT_TESTS_SIMPLIFY_ORACLE_H
#define FCT_TESTS_SIMPLIFY_ORACLE_H

#include "shapes.h"
#include "simplify/simplifier.h"

/* Uniform in [0, 1). */
static inline double uniform(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.;
}

static inline double between(uint64_t *state, double low, double high) {
    return low + (high - low) * uniform(state);
}

static inline v3 random_vector(uint64_t *state) {
    double x = between(state, -1, 1), y = between(state, -1, 1), z = between(state, -1, 1);
    return (v3){x, y, z};
}

static inline void assert_close(double got, double want, double tolerance) {
    double scale = fabs(want) > 1 ? fabs(want) : 1;
    if (!(fabs(got - want) <= tolerance * scale)) {
        print_error("got %.17g, expected %.17g\n", got, want);
        fail();
    }
}

/* |got - want| <= tolerance |want|, for values far below 1. */
static inline void assert_ratio(double got, double want, double tolerance) {
    if (!(fabs(got - want) <= tolerance * fabs(want))) {
        print_error("got %.17g, expected %.17g\n", got, want);
        fail();
    }
}

/* Solves the n x n system a x = b by Gaussian elimination with pivots; x replaces b. */
static inline void solve_dense(int n, double *a, double *b) {
    for (int i = 0; i < n; ++i) {
        int pivot = i;
        for (int k = i + 1; k < n; ++k)
            if (fabs(a[k * n + i]) > fabs(a[pivot * n + i])) pivot = k;
        assert_true(a[pivot * n + i] != 0);
        for (int k = 0; k < n; ++k) {
            double swap = a[i * n + k];
            a[i * n + k] = a[pivot * n + k], a[pivot * n + k] = swap;
        }
        double swap = b[i];
        b[i] = b[pivot], b[pivot] = swap;
        for (int k = i + 1; k < n; ++k) {
            double factor = a[k * n + i] / a[i * n + i];
            for (int j = i; j < n; ++j) a[k * n + j] -= factor * a[i * n + j];
            b[k] -= factor * b[i];
        }
    }
    for (int i = n; i-- > 0;) {
        for (int k = i + 1; k < n; ++k) b[i] -= a[i * n + k] * b[k];
        b[i] /= a[i * n + i];
    }
}

/* Squared distance of v from the plane x0 + s h + t k in R^n: the least-squares s and t, then the residual.
 */
static inline double squared_distance(int n, const double *x0, const double *x1, const double *x2,
                                      const double *v) {
    double hh = 0, hk = 0, kk = 0, hu = 0, ku = 0, sum = 0;
    for (int i = 0; i < n; ++i) {
        double h = x1[i] - x0[i], k = x2[i] - x0[i], u = v[i] - x0[i];
        hh += h * h, hk += h * k, kk += k * k, hu += h * u, ku += k * u;
    }
    double det = hh * kk - hk * hk, s = (kk * hu - hk * ku) / det, t = (hh * ku - hk * hu) / det;
    for (int i = 0; i < n; ++i) {
        double rest = v[i] - x0[i] - s * (x1[i] - x0[i]) - t * (x2[i] - x0[i]);
        sum += rest * rest;
    }
    return sum;
}

static inline void v3_to_array(v3 p, double out[3]) {
    out[0] = p.x, out[1] = p.y, out[2] = p.z;
}

/* A bumpy sheet of 4 x 4 squares with two triangles each, 3 units wide and away from the origin.
 *
 *   row 4  equal colours    . . . . .    Column 2 has two vertices per row, one for the faces on each side.
 *   row 3  equal colours    . . | . .    Texture coordinates jump along row 2. The last column of squares
 *   row 2  faint crease     . . | . .    has another material, the first one clearly other face colours,
 *   row 1  crease           . . | . .    and the top row slightly other ones.
 *   row 0  crease           . . | . .
 */
static inline fct_mesh make_sheet(const fct_env *env, unsigned arrays, uint64_t seed) {
    enum { N = 4, M = N + 1 };
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, M * M + M, 2 * N * N, arrays, &mesh), FCT_OK);
    for (uint32_t v = 0; v < M * M + M; ++v) {
        uint32_t i = v < M * M ? v % M : 2, j = v < M * M ? v / M : v - M * M;
        float *p = mesh.positions + 3 * v;
        if (v >= M * M)
            memcpy(p, mesh.positions + 3 * (j * M + 2), 3 * sizeof *p);
        else {
            p[0] = (float)(5 + .75 * i), p[1] = (float)(.6 * j - 2), p[2] = (float)between(&seed, 1, 1.5);
        }
        double shift = v < M * M || j > 2 ? 0 : j == 2 ? .05 : .4;
        for (uint32_t k = 0; k < 3; ++k) {
            double value = v < M * M ? between(&seed, 0, 1) : 0;
            if (mesh.colors)
                mesh.colors[3 * v + k] =
                    v < M * M ? (float)value : mesh.colors[3 * (j * M + 2) + k] + (float)shift;
            if (mesh.normals) mesh.normals[3 * v + k] = k == 2 ? 1 : (float)(.1 * i - .05 * j);
        }
    }
    uint32_t *t = mesh.triangles;
    for (uint32_t j = 0; j < N; ++j)
        for (uint32_t i = 0; i < N; ++i) {
            uint32_t a = j * M + i, b = a + 1, c = b + M, d = a + M;
            if (i == 2) a = M * M + j, d = M * M + j + 1;
            uint32_t two[6] = {a, b, c, a, c, d};
            for (uint32_t k = 0; k < 6; ++k) {
                size_t corner = (size_t)(t - mesh.triangles);
                uint32_t f = (uint32_t)(corner / 3);
                *t++ = two[k];
                if (mesh.texcoords) {
                    mesh.texcoords[2 * corner] = mesh.positions[3 * two[k]] / 2;
                    mesh.texcoords[2 * corner + 1] = mesh.positions[3 * two[k] + 1] / 3 + (j >= 2 ? .3f : 0);
                }
                if (mesh.materials) mesh.materials[f] = i == 3;
                if (mesh.face_colors) {
                    float *rgb = mesh.face_colors + 3 * f;
                    rgb[0] = j == 3 ? .54f : .5f, rgb[1] = i == 0 ? .7f : .5f, rgb[2] = j == 3 ? .46f : .5f;
                }
            }
        }
    if (mesh.materials) mesh.material_count = 2;
    return mesh;
}

/* Three faces, duplicates of two of them, and a face without area. */
static inline fct_mesh make_slivers(const fct_env *env) {
    static const float p[18] = {0, 0, 0, 1, 0, .2f, 1, 1, 0, 0, 1, .1f, 2, 0, .4f, .5f, 0, .1f};
    static const uint32_t t[18] = {0, 1, 2, 0, 2, 3, 1, 2, 0, 1, 4, 2, 0, 5, 1, 3, 0, 2};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 6, 6, 0, &mesh), FCT_OK);
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    return mesh;
}

enum {
    ALL_ARRAYS =
        FCT_MESH_COLORS | FCT_MESH_NORMALS | FCT_MESH_TEXCOORDS | FCT_MESH_MATERIALS | FCT_MESH_FACE_COLORS
};

/* Each array alone, some together, and all. */
static const unsigned array_sets[] = {0,
                                      FCT_MESH_COLORS,
                                      FCT_MESH_MATERIALS,
                                      FCT_MESH_FACE_COLORS,
                                      FCT_MESH_TEXCOORDS,
                                      FCT_MESH_NORMALS,
                                      FCT_MESH_COLORS | FCT_MESH_MATERIALS | FCT_MESH_FACE_COLORS,
                                      ALL_ARRAYS};
enum { ARRAY_SETS = sizeof array_sets / sizeof *array_sets };

static inline fct_simplifier *open_simplifier(const fct_env *env, const fct_mesh *mesh,
                                              const fct_simplify_def *def) {
    fct_simplifier *s;
    assert_int_equal(fct_simplifier_build(env, mesh, def, &s), FCT_OK);
    return s;
}

/* A vertex in the unit cube, by the bounds of the vertices that faces use. */
static inline v3 scaled_vertex(const fct_mesh *mesh, uint32_t v) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, out[3],
           extent = 0;
    for (size_t c = 0; c < 3 * (size_t)mesh->face_count; ++c)
        for (int k = 0; k < 3; ++k) {
            double x = mesh->positions[3 * (size_t)mesh->triangles[c] + k];
            low[k] = fmin(low[k], x), high[k] = fmax(high[k], x);
        }
    for (int k = 0; k < 3; ++k) extent = fmax(extent, high[k] - low[k]);
    for (int k = 0; k < 3; ++k)
        out[k] = (mesh->positions[3 * (size_t)v + k] - .5 * (low[k] + high[k])) / extent;
    return (v3){out[0], out[1], out[2]};
}

/* The raw value of a channel at a corner of the mesh. */
static inline double raw_value(const fct_mesh *mesh, const fct_channel *channel, uint32_t c) {
    size_t v = mesh->triangles[c], i = channel->component;
    switch (channel->source) {
    case CHANNEL_COLOR:
        return mesh->colors[3 * v + i];
    case CHANNEL_NORMAL:
        return mesh->normals[3 * v + i];
    default:
        return mesh->texcoords[2 * (size_t)c + i];
    }
}

/* Position and scaled attributes of a corner, as one vector of 3 + count. */
static inline void corner_vector(const fct_simplifier *s, uint32_t c, uint32_t count, double *out) {
    v3_to_array(scaled_vertex(s->mesh, s->mesh->triangles[c]), out);
    for (uint32_t i = 0; i < count; ++i)
        out[3 + i] = s->channels[i].factor * raw_value(s->mesh, &s->channels[i], c);
}

#endif
