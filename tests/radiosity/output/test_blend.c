/* Anchors against a plain evaluation in double: the rays of one gather, the groups of a surface, and blends
 * of random anchors among walls. */
#include "radiosity/output/anchor.h"
#include "radiosity/output/blend.h"
#include "radiosity/solve/transport.h"
#include "radiosity/surface/tessellate.h"
#include "room.h"

/* E = mean b, gradient = mean of b d / max(cos, .15) less its part along n, reach = harmonic mean distance.
 */
static void gather_plainly(const room *r, double longest, uint32_t rays, uint64_t seed, fct_anchor *a) {
    double e[3] = {0}, g[3][3] = {{0}}, inverse = 0;
    for (uint32_t k = 0; k < rays; ++k) {
        double u[2];
        float origin[3], direction[3];
        fct_plane_point(k, seed, u);
        v3 n = v3_load(a->normal), d = fct_cosine_direction(n, u[0], u[1]);
        for (int c = 0; c < 3; ++c)
            origin[c] = (float)((double)a->position[c] + (double)a->offset * a->normal[c]);
        v3_store(direction, d);
        fct_found f = fct_transport_look(&r->set, r->stored, origin, direction);
        inverse += 1 / fmin(f.distance, longest);
        const double x[3] = {d.x, d.y, d.z};
        for (int c = 0; c < 3; ++c) {
            e[c] += (double)f.radiosity[c] / rays;
            for (int i = 0; i < 3; ++i)
                g[c][i] += (double)f.radiosity[c] * x[i] / fmax(v3_dot(d, n), .15) / rays;
        }
    }
    a->reach = (float)(rays / inverse);
    for (int c = 0; c < 3; ++c) {
        a->irradiance[c] = (float)e[c];
        const v3 n = v3_load(a->normal), whole = {g[c][0], g[c][1], g[c][2]};
        v3_store(a->gradient[c], v3_sub(whole, v3_scale(n, v3_dot(n, whole))));
    }
}

static void assert_same_anchor(const fct_anchor *a, const fct_anchor *b) {
    assert_near(a->reach, b->reach, 1e-5 * b->reach);
    for (int c = 0; c < 3; ++c) {
        assert_near(a->normal[c], b->normal[c], 0);
        assert_near(a->irradiance[c], b->irradiance[c], 1e-6);
        for (int i = 0; i < 3; ++i) assert_near(a->gradient[c][i], b->gradient[c][i], 1e-5);
    }
    assert_near(a->offset, b->offset, 0);
}

static void gathers_equal_their_rays(void **state) {
    (void)state;
    room r = make_room(3);
    for (uint64_t k = 0; k < 40; ++k) {
        fct_anchor a = {.offset = (float)(1e-2 * pick(k, 0, 1))}, b;
        for (uint64_t c = 0; c < 3; ++c) a.position[c] = (float)(pick(k, c, 2) - .5);
        v3_store(a.normal, v3_unit(v3_make(pick(k, 0, 3) - .5, pick(k, 1, 3) - .5, pick(k, 2, 3) - .5)));
        b = a;
        const fct_source source = {&r.set, NULL, r.stored, k % 2 ? .4 : INFINITY, NULL};
        fct_anchor_gather(&source, NULL, 50 + (uint32_t)k, k, &a);
        gather_plainly(&r, source.longest, 50 + (uint32_t)k, k, &b);
        assert_same_anchor(&a, &b);
    }
    end_room(&r);
}

enum { NEAR = FCT_NEAREST_ANCHORS, TERMS = 6 };

/* The anchors that the rules of anchor.h make from the vertices. */
typedef struct maker {
    const room *r;
    const fct_surface *f;
    fct_anchors_def def;
    double longest;
    const fct_anchors *found;
    fct_anchor *made; /* per vertex; reach 0: it is not an anchor */
    uint32_t again;   /* groups whose middle vertex was an anchor before */
    uint32_t count, halved[2], turned, hidden;
    uint64_t rays;
} maker;

static v3 at(const float *array, uint32_t v) {
    return v3_load(array + 3 * (size_t)v);
}

static void follow_group(maker *m, const uint32_t *vertices, uint32_t count) {
    const fct_surface *f = m->f;
    v3 p = {0, 0, 0}, n = {0, 0, 0};
    for (uint32_t i = 0; i < count; ++i)
        p = v3_add(p, at(f->sample_points, vertices[i])), n = v3_add(n, at(f->normals, vertices[i]));
    p = v3_scale(p, 1. / count), n = v3_unit(n);
    uint32_t middle = vertices[0], size = 0;
    double least = INFINITY, worst = 0, turn = 0;
    bool hidden = false;
    for (uint32_t i = 0; i < count; ++i) {
        double d = v3_norm2(v3_sub(at(f->sample_points, vertices[i]), p)) *
                   (2 - v3_dot(at(f->normals, vertices[i]), n));
        if (d < least) least = d, middle = vertices[i];
    }
    fct_anchor *made = &m->made[middle], a = {.offset = f->offsets[middle]};
    v3_store(a.position, at(f->sample_points, middle));
    v3_store(a.normal, v3_scale(at(f->normals, middle), m->def.side));
    for (uint32_t k = count; k > 1 && size < 8; k /= 2) ++size;
    if (made->reach > 0) {
        a = *made;
        ++m->again;
    } else {
        uint32_t rays = m->def.rays + m->def.rays * size / 2;
        if (!f->flat[middle] && rays < 2 * m->def.rays) rays = 2 * m->def.rays;
        gather_plainly(m->r, m->longest, rays, fct_hash3(m->def.seed, middle, f->mesh.vertex_count), &a);
        a.reach = (float)fmin(fmax(a.reach, 1.5 * sqrt(f->areas[middle])), m->longest);
        ++m->count, m->rays += rays;
        *made = a;
    }
    int known = 0;
    for (uint32_t i = 0; i < m->found->count; ++i) {
        const fct_anchor *x = &m->found->items[i];
        if (memcmp(x->position, a.position, 12) != 0 || memcmp(x->normal, a.normal, 12) != 0 ||
            fabsf(x->irradiance[0] - a.irradiance[0]) > 1e-6F)
            continue;
        assert_same_anchor(x, &a);
        ++known;
    }
    assert_int_equal(known, 1);
    double lower[6], upper[6];
    for (int k = 0; k < 6; ++k) lower[k] = INFINITY, upper[k] = -INFINITY;
    for (uint32_t i = 0; i < count; ++i) {
        v3 x = at(f->sample_points, vertices[i]), y = at(f->normals, vertices[i]);
        double cosine = v3_dot(y, at(f->normals, middle));
        worst = fmax(worst,
                     v3_norm(v3_sub(x, at(f->sample_points, middle))) / a.reach + sqrt(fmax(1 - cosine, 0)));
        turn = fmax(turn, 2 - 2 * cosine);
        hidden |= m->def.nearest && f->flat[vertices[i]] &&
                  v3_norm(v3_sub(x, at(f->sample_points, middle))) > (double)m->def.nearest[vertices[i]];
        const double c[6] = {x.x, x.y, x.z, y.x, y.y, y.z};
        for (int k = 0; k < 6; ++k) lower[k] = fmin(lower[k], c[k]), upper[k] = fmax(upper[k], c[k]);
    }
    if (count == 1 || (worst <= m->def.tolerance && turn <= .9 * .4 && !hidden)) return;
    m->turned += worst <= m->def.tolerance && turn > .9 * .4;
    m->hidden += worst <= m->def.tolerance && turn <= .9 * .4;
    int axis = 0, bent = 3;
    for (int k = 1; k < 3; ++k) {
        if (upper[k] - lower[k] > upper[axis] - lower[axis]) axis = k;
        if (upper[k + 3] - lower[k + 3] > upper[bent] - lower[bent]) bent = k + 3;
    }
    if (upper[bent] - lower[bent] > .8) axis = bent;
    uint32_t *parts = malloc(count * sizeof *parts), low = 0, done = 0;
    for (int side = 0; side < 2; ++side) {
        for (uint32_t i = 0; i < count; ++i) {
            const float *x =
                (axis < 3 ? f->sample_points : f->normals) + 3 * (size_t)vertices[i] + (size_t)axis % 3;
            if (((double)*x < (lower[axis] + upper[axis]) / 2) == (side == 0)) parts[done++] = vertices[i];
        }
        if (side == 0) low = done;
    }
    ++m->halved[axis > 2];
    assert_true(low > 0 && low < count);
    follow_group(m, parts, low);
    follow_group(m, parts + low, count - low);
    free(parts);
}

static void groups_follow_the_rules(void **state) {
    (void)state;
    uint32_t halved[2] = {0, 0}, turned = 0, hidden = 0, again = 0;
    for (uint64_t seed = 0; seed < 6; ++seed) {
        room r = make_room(seed);
        fct_surface f;
        uint32_t instance = seed % 2 ? r.ball : 0;
        assert_int_equal(fct_surface_build(&plain, SHADE(r.scene, instance), instance ? .4 : 1.5, &f),
                         FCT_OK);
        fct_anchors t;
        maker m = {.r = &r,
                   .f = &f,
                   .found = &t,
                   .def = {.rays = 17, .tolerance = seed < 4 ? .9 : 1.6, .seed = seed}};
        m.def.side = seed % 4 == 3 ? -1 : 1;
        v3 lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
        for (size_t c = 0; c < 3 * r.triangles.count; ++c) {
            v3 x = r.triangles.corners[c];
            lower = v3_make(fmin(lower.x, x.x), fmin(lower.y, x.y), fmin(lower.z, x.z));
            upper = v3_make(fmax(upper.x, x.x), fmax(upper.y, x.y), fmax(upper.z, x.z));
        }
        m.longest = v3_norm(v3_sub(upper, lower)) / 8;
        const fct_source source = {&r.set, NULL, r.stored, m.longest, NULL};
        float *nearest = malloc(f.mesh.vertex_count * sizeof *nearest);
        uint8_t *covered = malloc(f.mesh.vertex_count);
        for (uint32_t v = 0; v < f.mesh.vertex_count; ++v)
            covered[v] = fct_hash(v) % 8 == 0, nearest[v] = (float)(4 * fct_uniform(fct_hash3(seed, v, 7)));
        if (seed % 2) m.def.covered = covered;
        if (seed % 3) m.def.nearest = nearest;
        t = (fct_anchors){0};
        assert_int_equal(fct_anchors_extend(&plain, &source, &f, &m.def, &t), FCT_OK);
        uint32_t *vertices = malloc(f.mesh.vertex_count * sizeof *vertices), count = 0;
        for (uint32_t v = 0; v < f.mesh.vertex_count; ++v)
            if (f.places[v] != FCT_NONE && !(seed % 2 && covered[v])) vertices[count++] = v;
        m.made = calloc(f.mesh.vertex_count, sizeof *m.made);
        follow_group(&m, vertices, count);
        assert_int_equal(m.count, t.count);
        assert_int_equal(m.rays, t.rays);
        double inverse = 0;
        for (uint32_t i = 0; i < t.count; ++i) inverse += 1 / (double)t.items[i].reach;
        assert_near(t.turn, .7 / (inverse / t.count), 1e-6);
        for (int k = 0; k < 2; ++k) halved[k] += m.halved[k];
        turned += m.turned, hidden += m.hidden, again += m.again;
        free(vertices), free(nearest), free(covered), free(m.made);
        fct_anchors_release(&plain, &t);
        fct_surface_release(&plain, &f);
        end_room(&r);
    }
    printf("    %u groups halved in space, %u by normals, %u for their turn alone, %u for near surfaces; %u "
           "middle "
           "vertices were anchors before\n",
           halved[0], halved[1], turned, hidden, again);
    assert_true(halved[0] > 20 && halved[1] > 20 && turned > 0 && hidden > 0 && again > 20);
}

/* Whether the vertex needs an anchor beside the given ones: with r the least reach + distance of the 24
 * nearest of them, none has distance / r + sqrt(1 - n.n') within the tolerance,
 * without a turn by more than the blend accepts and nearer than any surface in front of the vertex. */
static bool needs_anchor(const maker *m, const fct_anchors *t, uint32_t vertex) {
    const v3 p = at(m->f->sample_points, vertex), n = v3_scale(at(m->f->normals, vertex), m->def.side);
    double far2[NEAR], reach = INFINITY, most = 8;
    const fct_anchor *near[NEAR];
    int count = 0;
    bool needs = true;
    for (uint32_t i = 0; i < t->count; ++i)
        if (v3_norm2(v3_sub(n, v3_load(t->items[i].normal))) < .4) most = .4;
    for (uint32_t i = 0; i < t->count; ++i) {
        const fct_anchor *a = &t->items[i];
        const double turn2 = v3_norm2(v3_sub(n, v3_load(a->normal)));
        const double d2 = v3_norm2(v3_sub(p, v3_load(a->position))) + t->turn * t->turn * turn2;
        if (turn2 >= most || (count == NEAR && d2 >= far2[NEAR - 1])) continue;
        int k = count < NEAR ? count++ : NEAR - 1;
        for (; k > 0 && far2[k - 1] > d2; --k) far2[k] = far2[k - 1], near[k] = near[k - 1];
        far2[k] = d2, near[k] = a;
    }
    for (int i = 0; i < count; ++i)
        reach = fmin(reach, v3_norm(v3_sub(p, v3_load(near[i]->position))) + near[i]->reach);
    for (int i = 0; i < count; ++i) {
        const double turn = sqrt(fmax(1 - v3_dot(n, v3_load(near[i]->normal)), 0));
        const double apart = v3_norm(v3_sub(p, v3_load(near[i]->position)));
        const bool hidden = m->def.nearest && m->f->flat[vertex] && apart > m->def.nearest[vertex];
        needs &= apart / reach + turn > m->def.tolerance || 2 * turn * turn > .36 || hidden;
    }
    return needs;
}

/* New vertices without an anchor near enough form groups of their own. */
static void extensions_follow_the_rules(void **state) {
    (void)state;
    uint32_t needed = 0, served = 0;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        room r = make_room(seed);
        fct_surface f;
        assert_int_equal(fct_surface_build(&plain, SHADE(r.scene, r.ball), .3, &f), FCT_OK);
        fct_anchors t, known;
        maker m = {.r = &r, .f = &f, .found = &t, .def = {.rays = 17, .tolerance = .9, .seed = seed}};
        m.def.side = seed % 2 ? -1 : 1, m.longest = 3;
        const fct_source source = {&r.set, NULL, r.stored, m.longest, NULL};
        const uint32_t all = f.mesh.vertex_count, first = all / 3;
        uint8_t *covered = calloc(all, 1);
        for (uint32_t v = 0; v < all; ++v) covered[v] = v >= first || v % 2;
        m.def.covered = covered;
        t = (fct_anchors){0};
        assert_int_equal(fct_anchors_extend(&plain, &source, &f, &m.def, &t), FCT_OK);
        const uint64_t rays = t.rays;
        known = t;
        known.items = malloc(t.count * sizeof *t.items);
        memcpy(known.items, t.items, t.count * sizeof *t.items);
        for (uint32_t v = 0; v < all; ++v) covered[v] = v % 5 == 0;
        m.def.first = first;
        assert_int_equal(fct_anchors_extend(&plain, &source, &f, &m.def, &t), FCT_OK);
        uint32_t *vertices = malloc(all * sizeof *vertices), count = 0;
        for (uint32_t v = first; v < all; ++v) {
            if (f.places[v] == FCT_NONE || covered[v]) continue;
            if (needs_anchor(&m, &known, v))
                vertices[count++] = v;
            else
                ++served;
        }
        m.made = calloc(all, sizeof *m.made);
        if (count > 0) follow_group(&m, vertices, count);
        assert_int_equal(known.count + m.count, t.count);
        assert_int_equal(rays + m.rays, t.rays);
        for (uint32_t i = 0; i < known.count; ++i) {
            fct_nearest near;
            fct_anchors_nearest(&t, known.items[i].position, known.items[i].normal, &near);
            assert_near(near.distances2[0], 0, 1e-9);
        }
        needed += count;
        free(vertices), free(covered), free(m.made), free(known.items);
        fct_anchors_release(&plain, &t);
        fct_surface_release(&plain, &f);
        end_room(&r);
    }
    printf("    %u vertices needed new anchors, %u did not\n", needed, served);
    assert_true(needed > 20 && served > 20);
}

/* The value at p of the polynomial that minimizes sum w_i (e_i - f(p_i))^2 / sum w + .02 |linear terms|^2 +
 * .1 |quadratic terms|^2: least squares over one row per anchor and one per penalty, by Gram and Schmidt.
 * The quadratic terms are half the second derivatives H along the axes: |H|^2 = Hxx^2 + 2 Hxy^2 + Hyy^2.
 * *square: the first of these sums alone. */
static double fit_plainly(int count, const fct_anchor *const near[], const double *w, const double *e, v3 p,
                          v3 n, double *square) {
    double rows[NEAR + TERMS][TERMS + 1] = {{0}}, f[NEAR][TERMS + 1], total = 0, spread = 0,
                                      r[TERMS][TERMS + 1];
    const v3 s = v3_unit(v3_cross(n, v3_make(.3, .8, -.5))), t = v3_cross(n, s);
    for (int i = 0; i < count; ++i) {
        const v3 d = v3_sub(v3_load(near[i]->position), p);
        total += w[i], spread += w[i] * (v3_dot(d, s) * v3_dot(d, s) + v3_dot(d, t) * v3_dot(d, t));
    }
    for (int i = 0; i < count; ++i) {
        const v3 d = v3_scale(v3_sub(v3_load(near[i]->position), p), sqrt(total / spread));
        const double x = v3_dot(d, s), y = v3_dot(d, t), row[7] = {1, x, y, x * x, 2 * x * y, y * y, e[i]};
        memcpy(f[i], row, sizeof row);
        for (int j = 0; j <= TERMS; ++j) rows[i][j] = sqrt(w[i] / total) * row[j];
    }
    for (int j = 1; j < TERMS; ++j) rows[count + j][j] = sqrt(j < 3 ? .02 : j == 4 ? .2 : .1);
    for (int j = 0; j < TERMS; ++j)
        for (int k = j; k <= TERMS; ++k) {
            double dot = 0;
            for (int i = 0; i < count + TERMS; ++i) dot += rows[i][j] * rows[i][k];
            r[j][k] = k == j ? sqrt(dot) : dot / r[j][j];
            for (int i = 0; i < count + TERMS && k > j; ++i)
                rows[i][k] -= dot / (r[j][j] * r[j][j]) * rows[i][j];
        }
    double z[TERMS];
    for (int j = TERMS - 1; j >= 0; --j) {
        z[j] = r[j][TERMS];
        for (int k = j + 1; k < TERMS; ++k) z[j] -= r[j][k] * z[k];
        z[j] /= r[j][j];
    }
    *square = 0;
    for (int i = 0; i < count; ++i) {
        double value = 0;
        for (int j = 0; j < TERMS; ++j) value += z[j] * f[i][j];
        *square += w[i] / total * (e[i] - value) * (e[i] - value);
    }
    return z[0];
}

/* blend.h and the formulas at the top of blend.c, over all anchors. Returns the number of rays. *turned:
 * counts points whose normal no anchor has within 37 degrees; *clamped: values outside the anchors' range. */
static int blend_plainly(const room *r, const fct_anchors *t, v3 p, v3 n, double offset, bool flat,
                         double e[3], double variance[3], int *turned, int *clamped) {
    double x[NEAR], w[NEAR], values[3][NEAR], total = 0, mean = 0, farthest = 0, far2[NEAR];
    const fct_anchor *near[NEAR];
    int count = 0, rays = 0;
    double most = 8;
    for (uint32_t i = 0; i < t->count; ++i)
        if (v3_norm2(v3_sub(n, v3_load(t->items[i].normal))) < .4) most = .4;
    *turned += most > 4;
    for (uint32_t i = 0; i < t->count; ++i) {
        const fct_anchor *a = &t->items[i];
        double turn2 = v3_norm2(v3_sub(n, v3_load(a->normal)));
        double d2 = v3_norm2(v3_sub(p, v3_load(a->position))) + t->turn * t->turn * turn2;
        if (turn2 >= most || (count == NEAR && d2 >= far2[NEAR - 1])) continue;
        int k = count < NEAR ? count++ : NEAR - 1;
        for (; k > 0 && far2[k - 1] > d2; --k) far2[k] = far2[k - 1], near[k] = near[k - 1];
        far2[k] = d2, near[k] = a;
    }
    for (int i = 0; i < count; ++i) {
        v3 turn = v3_sub(n, v3_load(near[i]->normal));
        x[i] = v3_norm(v3_sub(p, v3_load(near[i]->position))) / near[i]->reach + .7 * v3_norm(turn) + 1e-4;
        farthest = fmax(farthest, x[i]);
        for (int c = 0; c < 3; ++c) {
            double own = near[i]->irradiance[c];
            values[c][i] = fmin(fmax(own + v3_dot(v3_load(near[i]->gradient[c]), turn), .5 * own), 1.6 * own);
        }
    }
    for (int i = 0; i < count; ++i) {
        w[i] = pow(1 - .98 * x[i] / farthest, 2) / (x[i] * x[i] + .2 * .2);
        total += w[i];
        for (int c = 0; c < 3; ++c) mean += w[i] * values[c][i];
    }
    mean /= total;
    for (int i = 0; i < count && flat && count > 1; ++i) {
        double apart = fabs(values[0][i] + values[1][i] + values[2][i] - mean);
        if (w[i] < .01 * total || apart < .15 * mean) continue;
        ++rays;
        v3 from = v3_mad(p, 4 * offset, n), a = v3_load(near[i]->normal);
        if (!is_free(&r->triangles, from, v3_mad(v3_load(near[i]->position), 4 * near[i]->offset, a)))
            w[i] = 0;
    }
    total = 0;
    for (int i = 0; i < count; ++i) total += w[i];
    if (total == 0) w[0] = 1;
    for (int c = 0; c < 3; ++c) {
        double lowest = INFINITY, highest = 0;
        for (int i = 0; i < count; ++i)
            if (w[i] > 0) lowest = fmin(lowest, values[c][i]), highest = fmax(highest, values[c][i]);
        e[c] = fit_plainly(count, near, w, values[c], p, n, &variance[c]);
        *clamped += e[c] < lowest - 1e-9 || e[c] > highest + 1e-9;
        e[c] = fmin(fmax(e[c], lowest), highest);
    }
    /* The weight of an anchor in the value is the value for light at that anchor alone. */
    double squares = 0, unused;
    for (int i = 0; i < count; ++i) {
        double alone[NEAR] = {0};
        alone[i] = 1;
        squares += pow(fit_plainly(count, near, w, alone, p, n, &unused), 2);
    }
    for (int c = 0; c < 3; ++c) variance[c] *= squares;
    return rays;
}

static void blends_equal_the_formula(void **state) {
    (void)state;
    int rays_of_all = 0, turned = 0, clamped = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        room r = make_room(seed);
        fct_anchors t = {.count = seed < 3 ? (uint32_t)seed + 1 : 4 + 5 * (uint32_t)seed,
                         .turn = .1 + .1 * (double)seed};
        t.items = fct_allocate_zero(&plain, t.count, sizeof *t.items);
        t.axes = fct_allocate_zero(&plain, t.count, 1);
        for (uint32_t i = 0; i < t.count; ++i) {
            fct_anchor *a = &t.items[i];
            double level = i % 3 == 0 ? 1 : .5 + pick(seed, i, 9);
            for (uint64_t k = 0; k < 3; ++k) {
                a->position[k] = (float)((2 * pick(seed, i, k) - 1) * (k == 2 ? .3 : 1));
                a->irradiance[k] = (float)(level * (1 + .1 * pick(seed, i, 10 + k)));
                for (uint64_t c = 0; c < 3; ++c)
                    a->gradient[k][c] = (float)((i % 4 ? .4 : 3) * (pick(seed, i, 20 + 3 * k + c) - .5));
            }
            v3_store(a->normal, v3_unit(v3_make(.8 * pick(seed, i, 3) - .4, .8 * pick(seed, i, 4) - .4, 1)));
            a->reach = (float)(.1 + pick(seed, i, 5)), a->offset = (float)(.02 * pick(seed, i, 6));
        }
        fct_anchors_order(&t);
        for (uint64_t q = 0; q < 60; ++q) {
            float p[3], n[3], offset = (float)(.02 * pick(seed, q, 50));
            for (uint64_t k = 0; k < 3; ++k)
                p[k] = (float)((2 * pick(seed, q, 51 + k) - 1) * (k == 2 ? .3 : 1));
            v3_store(n, v3_unit(v3_make(pick(seed, q, 54) - .5, pick(seed, q, 55) - .5, q % 9 ? 1 : .2)));
            double expected[3], variance[3], found[3];
            uint64_t rays = 5;
            int sent = blend_plainly(&r, &t, v3_load(p), v3_load(n), offset, q % 2, expected, variance,
                                     &turned, &clamped);
            fct_anchors_irradiance(&t, &r.set, p, n, offset, q % 2, found, &rays);
            assert_int_equal(rays, 5 + sent);
            for (int c = 0; c < 3; ++c) assert_near(found[c], expected[c], 1e-6);
            fct_anchors_variance(&t, &r.set, p, n, offset, q % 2, found, &rays);
            assert_int_equal(rays, 5 + 2 * sent);
            for (int c = 0; c < 3; ++c) assert_near(found[c], variance[c], 1e-6 * variance[c] + 1e-12);
            rays_of_all += sent;
        }
        fct_anchors_release(&plain, &t);
        end_room(&r);
    }
    printf("    %d visibility rays, %d points turned from all anchors, %d values clamped\n", rays_of_all,
           turned, clamped);
    assert_true(rays_of_all > 500 && turned > 5 && clamped > 5);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gathers_equal_their_rays),
        cmocka_unit_test(groups_follow_the_rules),
        cmocka_unit_test(extensions_follow_the_rules),
        cmocka_unit_test(blends_equal_the_formula),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
