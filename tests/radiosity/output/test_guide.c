/* Guides of gathers against their definition: the density of points over all leaves, what a pick returns, the
 * rays of a guided gather, and its mean against plain gathers. */
#include "../refining.h"
#include "radiosity/output/anchor.h"
#include "radiosity/solve/oracle.h"
#include "radiosity/surface/tessellate.h"
#include "room.h"

/* The room with links, for which every leaf shines by itself. `hot`: one leaf is much brighter. */
typedef struct linked {
    room r;
    fct_links links;
    fct_guides guides;
} linked;

static void make_linked(uint64_t seed, bool hot, linked *x) {
    x->r = make_room(seed);
    fct_elements *set = &x->r.set;
    for (size_t id = 0; id < set->count; ++id)
        for (size_t c = 0; c < 3; ++c) set->items[id].radiosity[c] = .2 + pick(seed, id, c);
    fct_elements_pull(set);
    assert_int_equal(fct_links_create(&plain, &x->links), FCT_OK);
    assert_int_equal(refine_links(set, &x->links, .02), FCT_OK);
    /* New elements that no link knows. */
    for (uint32_t id = 0, count = (uint32_t)set->count; id < count; id += 5)
        if (fct_elements_can_split(set, id)) assert_int_equal(fct_elements_split(set, id), FCT_OK);
    x->r.stored = realloc(x->r.stored, 3 * set->count * sizeof *x->r.stored);
    for (size_t i = 0; i < 3 * set->count; ++i)
        x->r.stored[i] =
            (float)((i / 3 + seed) % 7 ? .05 + pick(seed, i, 6) * (hot && i / 3 % 17 == 0 ? 30 : 1) : 0);
    assert_int_equal(fct_guides_create(set, &x->links, x->r.stored, &x->guides), FCT_OK);
}

static void end_linked(linked *x) {
    fct_guides_release(&plain, &x->guides);
    fct_links_release(&plain, &x->links);
    end_room(&x->r);
}

static bool is_below(const fct_elements *set, uint32_t id, uint32_t above) {
    while (id != FCT_NONE && id != above) id = set->items[id].parent;
    return id == above;
}

static bool is_surface_leaf(const fct_element *e) {
    return e->child_count == 0 && e->kind != FCT_ELEMENT_VOLUME;
}

static double sum_light(const linked *x, size_t id) {
    const float *b = x->r.stored + 3 * id;
    return (double)b[0] + (double)b[1] + (double)b[2];
}

/* Form factor of a link at a point: F of near links; for far ones V c P / (pi r^2 + P), where one more ray
 * than the link's counts as free, so that no source is lost by chance. */
static double find_factor(const linked *x, const fct_link *link, v3 point, v3 normal) {
    if (link->near) return link->weight;
    const fct_element *j = &x->r.set.items[link->source];
    const v3 d = v3_sub(j->center, point);
    const double r = v3_norm(d), cosine = v3_dot(normal, d) / r, n = link->rays;
    if (r == 0 || cosine <= 0) return 0;
    const double area = fct_projected_area(j, v3_scale(d, -1 / r));
    return (link->weight * n + 1) / (n + 1) * cosine * area / (FCT_PI * r * r + area);
}

/* A receiver: a point of a leaf that is not its centre. */
static uint32_t find_receiver(const linked *x, uint64_t k, fct_element_point *p) {
    uint32_t id = (uint32_t)(pick(k, 0, 1) * (double)x->r.set.count);
    while (!is_surface_leaf(&x->r.set.items[id]) || x->r.set.items[id].area <= 0)
        id = (id + 1) % (uint32_t)x->r.set.count;
    fct_element_sample(&x->r.set, id, pick(k, 0, 2), pick(k, 0, 3), pick(k, 0, 4), p);
    return id;
}

static void guides_follow_the_links(void **state) {
    (void)state;
    uint32_t lit = 0, sources = 0;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        linked x;
        make_linked(seed, seed == 3, &x);
        const fct_elements *set = &x.r.set;
        double *density = malloc(set->count * sizeof *density);
        fct_guide guide;
        assert_int_equal(fct_guide_create(&x.guides, &guide), FCT_OK);
        for (uint64_t k = 0; k < 12; ++k) {
            fct_element_point p;
            const uint32_t leaf = find_receiver(&x, fct_hash2(seed, k), &p);
            const v3 point = v3_load(p.position), normal = v3_load(p.normal);
            double total = 0;
            memset(density, 0, set->count * sizeof *density);
            for (size_t l = 0; l < x.links.count; ++l) {
                const fct_link *link = &x.links.items[l];
                if (!is_below(set, leaf, link->receiver)) continue;
                double power = 0;
                for (uint32_t id = 0; id < set->count; ++id)
                    if (is_surface_leaf(&set->items[id]) && is_below(set, id, link->source))
                        power += sum_light(&x, id) * set->items[id].area;
                const double light =
                    find_factor(&x, link, point, normal) * power / set->items[link->source].area;
                if (!(light > 0)) continue;
                total += light, ++sources;
                for (uint32_t id = 0; id < set->count; ++id)
                    if (is_surface_leaf(&set->items[id]) && is_below(set, id, link->source))
                        density[id] += light * sum_light(&x, id) / power;
            }
            assert_int_equal(fct_guide_aim(&guide, leaf, point, normal), total > 0);
            if (total <= 0) continue;
            ++lit;
            enum { PICKS = 4096 };
            uint32_t *picks = calloc(set->count, sizeof *picks), last = FCT_NONE;
            double rest = 0;
            for (int i = 0; i < PICKS; ++i) {
                double t = (i + .5) / PICKS;
                const uint32_t id = fct_guide_pick(&guide, &t);
                assert_true(id < set->count && is_surface_leaf(&set->items[id]) && t >= 0 && t < 1);
                if (id == last) assert_true(t > rest);
                ++picks[id], last = id, rest = t;
            }
            double sum = 0;
            for (uint32_t id = 0; id < set->count; ++id) {
                if (!is_surface_leaf(&set->items[id])) continue;
                const double share = density[id] / total * set->items[id].area;
                assert_near(fct_guide_density(&guide, id), density[id] / total,
                            1e-6 * density[id] / total + 1e-12);
                assert_near(picks[id], PICKS * share, 1.01);
                sum += share;
            }
            assert_near(sum, 1, 1e-6);
            free(picks);
        }
        free(density);
        fct_guide_release(&plain, &guide);
        end_linked(&x);
    }
    assert_true(lit > 40 && sources > 400);
}

/* The same gather from its definition: a third of the rays is aimed. */
static void gather_guided(const linked *x, const fct_guide *guide, double longest, uint32_t rays,
                          uint64_t seed, fct_anchor *a, uint32_t *reached) {
    const uint32_t aimed = rays / 3, cosines = rays - aimed;
    const v3 n = v3_load(a->normal);
    double all = 0, inverse = 0, e[3] = {0}, g[3][3] = {{0}};
    float origin[3], direction[3];
    v3_store(origin, v3_mad(v3_load(a->position), a->offset, n));
    for (uint32_t k = 0; k < rays; ++k) {
        v3 d;
        uint32_t target = FCT_NONE;
        double u[2], distance = 0;
        fct_plane_point(k < cosines ? k : k - cosines, k < cosines ? seed : fct_hash(seed), u);
        if (k < cosines) {
            d = fct_cosine_direction(n, u[0], u[1]);
        } else {
            fct_element_point p;
            const uint32_t i = k - cosines;
            double t = (i + fct_uniform(fct_hash2(seed, i))) / aimed;
            target = fct_guide_pick(guide, &t);
            fct_element_sample(&x->r.set, target, t, u[0], u[1], &p);
            d = v3_sub(v3_load(p.position), v3_load(origin));
            distance = v3_norm(d);
            d = v3_scale(d, 1 / distance);
            if (v3_dot(d, n) <= 0 || v3_dot(d, v3_load(p.normal)) >= 0) continue;
        }
        v3_store(direction, d);
        fct_found f = fct_transport_look(&x->r.set, x->r.stored, origin, direction);
        if (target != FCT_NONE && (f.leaf != target || fabs(f.distance / distance - 1) > 1e-3)) continue;
        *reached += target != FCT_NONE;
        double weight = 1. / cosines;
        if (f.leaf != FCT_NONE && fct_guide_density(guide, f.leaf) > 0) {
            const double pc = v3_dot(d, n) * f.cosine / (FCT_PI * f.distance * f.distance);
            weight = pc / (cosines * pc + aimed * fct_guide_density(guide, f.leaf));
        }
        all += weight;
        inverse += weight / fmin(f.distance, longest);
        const double way[3] = {d.x, d.y, d.z};
        for (int c = 0; c < 3; ++c) {
            e[c] += weight * (double)f.radiosity[c];
            for (int i = 0; i < 3; ++i)
                g[c][i] += weight * (double)f.radiosity[c] * way[i] / fmax(v3_dot(d, n), .15);
        }
    }
    a->reach = (float)(all / inverse);
    for (int c = 0; c < 3; ++c) {
        a->irradiance[c] = (float)(e[c] / all);
        const v3 whole = v3_scale(v3_make(g[c][0], g[c][1], g[c][2]), 1 / all);
        v3_store(a->gradient[c], v3_sub(whole, v3_scale(n, v3_dot(n, whole))));
    }
}

static void place_anchor(const fct_element_point *p, fct_anchor *a) {
    *a = (fct_anchor){.offset = p->offset};
    memcpy(a->position, p->position, sizeof a->position);
    memcpy(a->normal, p->normal, sizeof a->normal);
}

static void guided_gathers_equal_their_rays(void **state) {
    (void)state;
    linked x;
    fct_guide guide;
    uint32_t reached = 0;
    make_linked(5, true, &x);
    assert_int_equal(fct_guide_create(&x.guides, &guide), FCT_OK);
    for (uint64_t k = 0; k < 40; ++k) {
        fct_element_point p;
        fct_anchor a, b;
        const uint32_t leaf = find_receiver(&x, k, &p);
        const fct_source source = {&x.r.set, &x.guides, x.r.stored, k % 2 ? .4 : INFINITY, NULL};
        place_anchor(&p, &a);
        b = a;
        if (!fct_guide_aim(&guide, leaf, v3_load(p.position), v3_load(p.normal))) continue;
        fct_anchor_gather(&source, &guide, 60 + (uint32_t)k, k, &a);
        gather_guided(&x, &guide, source.longest, 60 + (uint32_t)k, k, &b, &reached);
        assert_near(a.reach, b.reach, 2e-4 * (double)b.reach);
        for (int c = 0; c < 3; ++c) {
            assert_near(a.irradiance[c], b.irradiance[c], 1e-5 * (1 + (double)b.irradiance[c]));
            for (int i = 0; i < 3; ++i)
                assert_near(a.gradient[c][i], b.gradient[c][i], 1e-5 * (1 + fabs((double)b.gradient[c][i])));
        }
    }
    assert_true(reached > 300);
    fct_guide_release(&plain, &guide);
    end_linked(&x);
}

/* Guided gathers have the same mean as plain ones, and half of their variance or less where a few leaves are
 * bright. */
static void guided_gathers_are_unbiased(void **state) {
    (void)state;
    linked x;
    fct_guide guide;
    double plain_variance = 0, guided_variance = 0;
    make_linked(8, true, &x);
    assert_int_equal(fct_guide_create(&x.guides, &guide), FCT_OK);
    const fct_source source = {&x.r.set, &x.guides, x.r.stored, INFINITY, NULL};
    for (uint64_t k = 0; k < 12; ++k) {
        fct_element_point p;
        fct_anchor truth, a;
        const uint32_t leaf = find_receiver(&x, k, &p);
        if (!fct_guide_aim(&guide, leaf, v3_load(p.position), v3_load(p.normal))) continue;
        place_anchor(&p, &truth);
        a = truth;
        fct_anchor_gather(&source, NULL, 1 << 16, k, &truth);
        fct_anchor_gather(&source, &guide, 1 << 16, k, &a);
        const double e = truth.irradiance[1];
        assert_near(a.irradiance[1], e, .012 * e);
        double mean = 0;
        for (uint64_t i = 0; i < 200; ++i) {
            fct_anchor_gather(&source, NULL, 48, fct_hash2(k, i), &a);
            plain_variance += pow((double)a.irradiance[1] / e - 1, 2);
            fct_anchor_gather(&source, &guide, 48, fct_hash2(k, i), &a);
            guided_variance += pow((double)a.irradiance[1] / e - 1, 2);
            mean += (double)a.irradiance[1] / e / 200;
        }
        assert_near(mean, 1, .06);
    }
    printf("    variance %.3f plain, %.3f guided\n", plain_variance, guided_variance);
    assert_true(guided_variance < .5 * plain_variance);
    fct_guide_release(&plain, &guide);
    end_linked(&x);
}

/* Anchors on the back of a two-sided ball aim with the links of that side. An anchor of a group of 2^k
 * vertices or more sends rays (1 + k / 4) rays. */
static void anchors_aim_from_their_side(void **state) {
    (void)state;
    linked x;
    fct_guide guide;
    fct_surface f;
    fct_anchors anchors;
    uint32_t found = 0, aimed = 0;
    make_linked(2, true, &x);
    const fct_elements *set = &x.r.set;
    assert_int_equal(fct_guide_create(&x.guides, &guide), FCT_OK);
    assert_int_equal(fct_surface_build(&plain, SHADE(x.r.scene, x.r.ball), 10, &f), FCT_OK);
    const fct_source source = {set, &x.guides, x.r.stored, 1, NULL};
    const fct_anchors_def def = {.rays = 24, .tolerance = .4, .side = -1, .instance = x.r.ball, .seed = 7};
    anchors = (fct_anchors){0};
    assert_int_equal(fct_anchors_extend(&plain, &source, &f, &def, &anchors), FCT_OK);
    for (uint32_t v = 0; v < f.mesh.vertex_count; ++v)
        for (uint32_t i = 0; i < anchors.count; ++i) {
            const fct_anchor *a = &anchors.items[i];
            if (memcmp(a->position, f.sample_points + 3 * (size_t)v, sizeof a->position)) continue;
            bool same = false;
            const v3 p = v3_load(a->position), n = v3_load(a->normal);
            assert_near(v3_dot(n, v3_load(f.normals + 3 * (size_t)v)), -1, 1e-5);
            const uint32_t leaf = fct_elements_locate_point(set, x.r.ball, true, f.places[v], p);
            assert_true(set->items[leaf].back);
            const bool lit = fct_guide_aim(&guide, leaf, p, n);
            for (uint32_t k = 0; k <= 8 && !same; ++k) {
                fct_anchor b = *a;
                fct_anchor_gather(&source, lit ? &guide : NULL, 24 + 24 * k / 2,
                                  fct_hash3(7, v, f.mesh.vertex_count), &b);
                same = fabs((double)b.irradiance[0] - (double)a->irradiance[0]) < 1e-6 &&
                       fabs((double)b.irradiance[2] - (double)a->irradiance[2]) < 1e-6;
            }
            assert_true(same);
            ++found, aimed += lit;
        }
    assert_true(found >= anchors.count && aimed > 20);
    fct_anchors_release(&plain, &anchors);
    fct_surface_release(&plain, &f);
    fct_guide_release(&plain, &guide);
    end_linked(&x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(guides_follow_the_links), cmocka_unit_test(guided_gathers_equal_their_rays),
        cmocka_unit_test(guided_gathers_are_unbiased), cmocka_unit_test(anchors_aim_from_their_side)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
