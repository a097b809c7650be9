/* The path tracer against a plain evaluation of the same paths, whose rays meet all triangles by brute force.
 */
#include "../place.h"
#include "../soup.h"
#include "radiosity/rivals/reference.h"

#include <float.h>

static const double pi = 3.14159265358979323846;
static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* A number in [0, 1). */
static double pick(uint64_t a, uint64_t b) {
    return fct_uniform(fct_hash2(a, b));
}

static uint32_t add_colour(fct_scene *scene, uint64_t seed, double emission, bool two_sided) {
    fct_material m = {.two_sided = two_sided};
    for (uint64_t k = 0; k < 3; ++k) {
        m.reflectance[k] = (float)(.95 * pick(seed, k)),
        m.emission[k] = (float)(emission * pick(seed, 3 + k));
    }
    uint32_t id;
    assert_int_equal(fct_scene_add_material(scene, &m, &id), FCT_OK);
    return id;
}

typedef struct source {
    uint32_t instance;
    double area, strength, begin, share;
} source;

typedef struct world {
    fct_scene *scene;
    fct_scene_view view;
    soup triangles;
    uint32_t first[17]; /* triangle of each instance */
    source sources[16];
    uint32_t source_count;
} world;

static const v3 *corners(const world *w, uint32_t triangle) {
    return w->triangles.corners + 3 * (size_t)triangle;
}

/* Twice the area times the normal of the front. */
static v3 front(const world *w, uint32_t instance, uint32_t triangle) {
    const v3 *p = corners(w, triangle);
    v3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    return w->view.instances[instance].mirrored ? v3_scale(n, -1) : n;
}

static world make_world(uint64_t seed) {
    world w = {.source_count = 0};
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &w.scene), FCT_OK);
    uint32_t wall = add_colour(w.scene, seed, 0, false), lamp = add_colour(w.scene, seed + 50, 4, false),
             both = add_colour(w.scene, seed + 90, seed % 2 ? 2 : 0, true);
    fct_mesh ball = make_bumpy(&plain, 4, .2), shell = make_sphere(&plain, 4);
    for (size_t t = 0; t < shell.face_count; ++t) {
        uint32_t *c = shell.triangles + 3 * t, swap = c[1];
        c[1] = c[2], c[2] = swap;
    }
    const float around[12] = {3, 0, 0, .1F, 0, 3, 0, .2F, 0, 0, 3, 0},
                left[12] = {-.4F, 0, 0, -1, 0, .4F, 0, .2F, 0, .1F, .4F, -.3F},
                right[12] = {.3F, 0, .1F, 1, 0, .3F, 0, .5F, 0, 0, .3F, .4F};
    if (seed % 3) place_mesh(w.scene, &shell, wall, around); /* else open */
    place_mesh(w.scene, &ball, lamp, left);
    place_mesh(w.scene, &ball, both, right);
    place_sheet(&plain, w.scene, both, 2, v3_make(-.8, -.8, -.7), v3_make(1.7, .1, 0), v3_make(0, 1.6, .2));
    place_sheet(&plain, w.scene, lamp, 1, v3_make(0, 0, 1.5), v3_make(0, .5, 0), v3_make(.5, 0, 0));
    place_sheet(&plain, w.scene, wall, 1, v3_make(-.2, -.5, .5), v3_make(.5, 0, .1), v3_make(0, .8, 0));
    fct_mesh_release(&plain, &ball), fct_mesh_release(&plain, &shell);
    assert_int_equal(fct_scene_commit(w.scene), FCT_OK);
    w.view = fct_scene_get(w.scene), w.triangles = list_triangles(w.scene);
    double total = 0, begin = 0;
    for (uint32_t i = 0; i < w.view.instance_count; ++i) {
        const float *e = w.view.materials[w.view.instances[i].material].emission;
        source s = {.instance = i, .strength = (double)e[0] + (double)e[1] + (double)e[2]};
        w.first[i + 1] = w.first[i] + fct_tree_get(w.view.models[w.view.instances[i].model].tree).face_count;
        for (uint32_t t = w.first[i]; t < w.first[i + 1]; ++t) s.area += v3_norm(front(&w, i, t)) / 2;
        if (s.strength > 0) w.sources[w.source_count++] = s, total += s.strength * s.area;
    }
    for (uint32_t i = 0; i < w.source_count; ++i) {
        source *s = &w.sources[i];
        s->share = s->strength * s->area / total, s->begin = begin, begin += s->share;
    }
    return w;
}

static double largest(v3 p) {
    return fmax(fabs(p.x), fmax(fabs(p.y), fabs(p.z)));
}

typedef struct spot {
    v3 p, n;
    double offset;
} spot;

static v3 origin_of(const spot *s) {
    float o[3];
    v3_store(o, v3_mad(s->p, s->offset, s->n));
    return v3_make(o[0], o[1], o[2]);
}

/* Next event: a point of an emitter, weighed against the chance that the cosine-distributed ray finds it. */
static void add_light(const world *w, const spot *at, const double through[3], double u, double v,
                      double sum[3], uint64_t *rays) {
    uint32_t i = w->source_count - 1;
    while (i > 0 && u < w->sources[i].begin) --i;
    const source *s = &w->sources[i];
    double target = (u - s->begin) / s->share * s->area, before = 0, own = 0, b[2];
    uint32_t t = w->first[s->instance];
    for (;; ++t) {
        own = v3_norm(front(w, s->instance, t)) / 2;
        if (before + own > target || t + 1 == w->first[s->instance + 1]) break;
        before += own;
    }
    fct_triangle_point(fmin((target - before) / own, 1), v, b);
    const v3 *c = corners(w, t);
    bool mirrored = w->view.instances[s->instance].mirrored;
    v3 e = v3_sub(c[mirrored ? 2 : 1], c[0]), f = v3_sub(c[mirrored ? 1 : 2], c[0]);
    v3 y = v3_mad(v3_mad(c[0], b[0], e), b[1], f), from = v3_mad(at->p, at->offset, at->n),
       d = v3_sub(y, from);
    const fct_material *m = &w->view.materials[w->view.instances[s->instance].material];
    double r2 = v3_norm2(d), height = v3_dot(d, at->n),
           toward = -v3_dot(d, v3_unit(front(w, s->instance, t)));
    if (m->two_sided) toward = fabs(toward);
    if (height <= 0 || toward <= 0) return;
    ++*rays;
    double reach = 1 - 1e-5 - 4 * FLT_EPSILON * fmax(largest(from), largest(y)) / sqrt(r2);
    if (!is_free(&w->triangles, from, v3_mad(from, reach, d))) return;
    double kernel = height * toward / (pi * r2 * r2);
    for (int k = 0; k < 3; ++k)
        sum[k] += through[k] * m->emission[k] * kernel / (kernel + s->share / s->area);
}

/* One path; sum[3] counts lost first rays. */
static void trace_plainly(const world *w, spot at, const double first[4], fct_random random, bool indirect,
                          double sum[4], uint64_t *rays) {
    double through[3] = {1, 1, 1};
    for (int bounce = 0;; ++bounce) {
        double u[4];
        for (int k = 0; k < 4; ++k) u[k] = bounce ? fct_random_next(&random) : first[k];
        if (w->source_count && !(indirect && bounce == 0)) add_light(w, &at, through, u[2], u[3], sum, rays);
        v3 d = fct_cosine_direction(at.n, u[0], u[1]), o = origin_of(&at);
        double nearest;
        bool behind;
        uint32_t hit = find_nearest(&w->triangles, o, d, &nearest, &behind), instance = 0;
        ++*rays;
        while (hit != FCT_NONE && hit >= w->first[instance + 1]) ++instance;
        const fct_material *m = &w->view.materials[w->view.instances[instance].material];
        v3 n = hit == FCT_NONE ? d : v3_unit(front(w, instance, hit));
        bool back = v3_dot(n, d) > 0;
        if (hit == FCT_NONE || (back && !m->two_sided)) {
            sum[3] += bounce == 0;
            return;
        }
        if (back) n = v3_scale(n, -1);
        v3 p = v3_mad(o, nearest, d);
        double kernel = v3_dot(d, at.n) * -v3_dot(d, n) / (pi * nearest * nearest), most = 0;
        for (uint32_t i = 0; i < w->source_count && !(indirect && bounce == 0); ++i) {
            const source *s = &w->sources[i];
            for (int k = 0; k < 3 && s->instance == instance; ++k)
                sum[k] += through[k] * m->emission[k] * kernel / (kernel + s->share / s->area);
        }
        for (int k = 0; k < 3; ++k) through[k] *= m->reflectance[k], most = fmax(most, m->reflectance[k]);
        if (bounce >= 3) { /* survives with the chance of the largest reflectance */
            if (fct_random_next(&random) >= most) return;
            for (int k = 0; k < 3; ++k) through[k] /= most;
        }
        at = (spot){p, n, 8 * FLT_EPSILON * fmax(largest(p), largest(corners(w, hit)[0]))};
    }
}

static void paths_equal_a_plain_evaluation(void **state) {
    (void)state;
    uint32_t off = 0;
    for (uint64_t seed = 0; seed < 6; ++seed) {
        world w = make_world(seed);
        enum { COUNT = 12 };
        float points[3 * COUNT], normals[3 * COUNT], offsets[COUNT], e[3 * COUNT], lost[COUNT];
        bool indirect = seed % 2 == 0, given = seed % 3 < 2;
        const uint32_t samples = seed == 5 ? 600 : 40;
        uint64_t rays = 11, expected_rays = 11;
        for (uint64_t i = 0; i < COUNT; ++i) {
            for (uint64_t k = 0; k < 3; ++k) {
                points[3 * i + k] = (float)(1.2 * pick(seed + 101 * i, k) - .6);
                normals[3 * i + k] = i == 3 ? 0 : (float)(pick(seed + 101 * i, 3 + k) - .5);
            }
            offsets[i] = (float)(1e-3 * pick(seed, i));
        }
        assert_int_equal(fct_reference_estimate(&plain, w.scene, COUNT, points, normals,
                                                given ? offsets : NULL, samples, seed, indirect, e, lost,
                                                &rays),
                         FCT_OK);
        for (uint64_t i = 0; i < COUNT; ++i) {
            double sum[4] = {0, 0, 0, 0};
            uint64_t own = fct_hash2(seed, i), ways = fct_hash2(own, 1), lights = fct_hash2(own, 2);
            spot at = {v3_load(points + 3 * i), v3_unit(v3_load(normals + 3 * i)), 0};
            at.offset = given ? (double)offsets[i] : 8 * FLT_EPSILON * largest(at.p);
            for (uint32_t s = 0; s < samples && i != 3; ++s) {
                double first[4];
                fct_plane_point(s, ways, first);
                fct_plane_point(fct_shuffle_index(s, (uint32_t)lights), fct_hash(lights), first + 2);
                trace_plainly(&w, at, first, (fct_random){fct_hash3(own, 3, s)}, indirect, sum,
                              &expected_rays);
            }
            /* A ray that grazes an edge may go either way. */
            for (int k = 0; k < 3; ++k)
                off +=
                    fabs((double)e[3 * i + (uint64_t)k] - sum[k] / samples) > 1e-5 + 1e-4 * sum[k] / samples;
            assert_near(lost[i], sum[3] / samples, 1e-6);
        }
        assert_near((double)rays, (double)expected_rays, 1e-4 * (double)expected_rays);
        free(w.triangles.corners);
        fct_scene_destroy(w.scene);
    }
    assert_in_range(off, 0, 6);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(paths_equal_a_plain_evaluation)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
