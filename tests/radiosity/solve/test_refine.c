/* Refinement and gathers on random scenes against a plain evaluation in double. The oracle judges every pair
 * from the root down, with visibility by brute force over all triangles: the links must be exactly those that
 * it keeps, and the opened elements exactly those that it opens. Then each leaf's irradiance must be the sum
 * over all links of its ancestors. */
#include "../place.h"
#include "../refining.h"
#include "../soup.h"

static const double pi = 3.14159265358979323846;
static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.12g, expected %.12g within %g", value, expected, tolerance);
}

static uint32_t add_colour(fct_scene *scene, uint64_t seed, double emission, bool two_sided) {
    return place_colours(scene, seed, 0, .9, emission, two_sided);
}

/* A floor, a lamp that faces it, a bumpy ball under a random similarity, a two-sided sheet, a sheared ball,
 * and a sheet without area. */
static fct_scene *make_scene(uint64_t seed) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    double r[16];
    for (uint64_t k = 0; k < 16; ++k) r[k] = fct_uniform(fct_hash3(seed, k, 1));
    place_sheet(&plain, scene, add_colour(scene, seed, 0, false), 2, v3_make(0, 0, 0), v3_make(4, 0, 0),
                v3_make(0, 4, 0));
    place_sheet(&plain, scene, add_colour(scene, seed + 100, 4, seed & 1), 1, v3_make(r[0], r[1], 3.5),
                v3_make(0, 1, 0), v3_make(1.5, 0, 0));
    fct_mesh ball = make_bumpy(&plain, 4, .2);
    double s = .4 + .4 * r[2], mirror = seed & 2 ? -s : s;
    const float turned[12] = {0, (float)s,       0, 1 + (float)r[3], 0, 0, (float)s, 2, (float)mirror, 0,
                              0, 1 + (float)r[4]};
    const float sheared[12] = {.5F, .2F, 0, 3, 0, .3F, 0, 3 * (float)r[5], .1F, 0, .4F, 1.2F};
    place_mesh(scene, &ball, add_colour(scene, seed + 200, seed & 4 ? .3 : 0, false), turned);
    place_mesh(scene, &ball, add_colour(scene, seed + 300, 0, false), sheared);
    fct_mesh_release(&plain, &ball);
    place_sheet(&plain, scene, add_colour(scene, seed + 400, seed & 4 ? 0 : .1, true), 1,
                v3_make(1 + 2 * r[6], r[7], .2), v3_make(.6, 1, .3), v3_make(r[8], .2, 1.5));
    place_sheet(&plain, scene, add_colour(scene, seed + 500, 1, false), 1, v3_make(2, 2, 2), v3_make(1, 0, 0),
                v3_make(1, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static double form(const double m[6], v3 u) {
    return m[0] * u.x * u.x + m[3] * u.y * u.y + m[5] * u.z * u.z +
           2 * (m[1] * u.x * u.y + m[2] * u.x * u.z + m[4] * u.y * u.z);
}

/* Largest projected area within `spread` of u, and the expected one. */
static double bound_area(const fct_element *e, v3 u, double spread) {
    double both = sqrt(fmax(e->area * form(e->moment, u), 0)), sheet = v3_dot(e->vector, u);
    return fmin(fmax((both + sheet) / 2 + spread * e->area, 0), e->area);
}
static double project_area(const fct_element *e, v3 u) {
    double sheet = v3_dot(e->vector, u);
    if (e->kind == FCT_ELEMENT_TRIANGLE) return fmax(sheet, 0);
    return fmax(fmax((.95 * sqrt(fmax(e->area * form(e->moment, u), 0)) + sheet) / 2, sheet), 0);
}

typedef enum outcome { KEPT, DROPPED, RECEIVER_OPENED, SOURCE_OPENED } outcome;

/* What the oracle met, so that the test knows that the scenes cover every rule. */
typedef struct tally {
    int away, hidden, near, far, partial, blind, dark, opened[2], by_size, by_shadow, by_volume, overlap,
        stuck;
} tally;

typedef struct judge {
    const fct_elements *set;
    const soup *triangles;
    double epsilon;
    double error; /* of the last pair that should be split */
    uint64_t rays;
    bool *opened; /* per element */
    tally met;
} judge;

/* True if no direction from e to the ball of sine `sine` around u meets the front of e. */
static bool is_turned_away(const fct_element *e, v3 u, double sine) {
    if (e->cone >= pi / 2 || v3_norm(e->vector) == 0) return false;
    double cosine = v3_dot(e->vector, u) / v3_norm(e->vector);
    return acos(fmin(fmax(cosine, -1), 1)) - e->cone - asin(fmin(sine, 1)) > pi / 2;
}

/* True if triangle f has no corner in front of the plane of triangle e. A hundred-thousandth of the smaller
 * one, and roundings of float coordinates, are in the plane. */
static bool is_hidden(const fct_elements *set, const fct_element *e, const fct_element *f) {
    double highest = -INFINITY, largest = 0;
    if (e->kind != FCT_ELEMENT_TRIANGLE || f->kind != FCT_ELEMENT_TRIANGLE) return false;
    for (size_t k = 0; k < 9; ++k) {
        largest = fmax(largest, fabs((double)set->corners[9 * (size_t)e->triangle + k]));
        largest = fmax(largest, fabs((double)set->corners[9 * (size_t)f->triangle + k]));
    }
    for (size_t k = 0; k < 3; ++k) {
        v3 corner = v3_load(set->corners + 9 * (size_t)f->triangle + 3 * k);
        highest = fmax(highest, v3_dot(v3_unit(e->vector), v3_sub(corner, e->center)));
    }
    return highest <= 1e-5 * fmin(e->radius, f->radius) + 4.8e-7 * largest;
}

/* Mean over point pairs [from, to) of the kernel (`clear`), and of those that see each other. */
static int sum_pairs(judge *g, const fct_link *l, int from, int to, double *clear, double *seen) {
    static const int order[16] = {0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15};
    fct_element_point p[16], q[16];
    for (uint32_t k = 0; k < 16; ++k) {
        fct_element_point_at(g->set, l->receiver, k, &p[k]);
        fct_element_point_at(g->set, l->source, k, &q[k]);
    }
    int sent = 0;
    for (int k = from; k < to; ++k) {
        int i = order[k], j = (int)((5 * (uint32_t)i + (uint32_t)fct_hash2(l->receiver, l->source)) % 16);
        if (l->receiver == l->source && i == j) j = (j + 8) % 16;
        v3 a = v3_load(p[i].position), b = v3_load(q[j].position), d = v3_sub(b, a);
        v3 m = v3_load(p[i].normal), n = v3_load(q[j].normal);
        double r2 = v3_norm2(d), x = v3_dot(m, d), y = -v3_dot(n, d);
        if (!(x > 0 && y > 0)) continue;
        double kernel = x * y / r2 / (pi * r2 + g->set->items[l->source].area / 16);
        *clear += kernel, ++sent;
        bool free = is_free(g->triangles, v3_mad(a, p[i].offset, m), v3_mad(b, q[j].offset, n));
        if (free) *seen += kernel;
    }
    return sent;
}

static void measure_link(judge *g, fct_link *l, double distance, double radii) {
    double clear = 0, seen = 0;
    l->near = distance < 2 * radii, l->rays = 4;
    int sent = sum_pairs(g, l, 0, 4, &clear, &seen);
    if (l->near || sent == 0 || (seen > 0 && seen < clear))
        l->rays = 16, sent += sum_pairs(g, l, 4, 16, &clear, &seen);
    g->rays += (uint64_t)sent;
    if (l->near)
        l->weight = (float)(seen / 16 * g->set->items[l->source].area);
    else
        l->weight = sent == 0 ? 1 : (float)(seen / clear);
    ++*(l->near                    ? &g->met.near
        : sent == 0                ? &g->met.blind
        : seen > 0 && seen < clear ? &g->met.partial
                                   : &g->met.far);
}

/* Largest power over the pair: b_j rho_i A_i F, summed over channels. */
static double find_flow(const fct_element *i, const fct_element *j, v3 u, double distance, double radii) {
    double factor = 1, light = 0;
    if (distance > radii) {
        double spread = radii / distance / 2, to = bound_area(j, v3_scale(u, -1), spread);
        factor = fmin(to * bound_area(i, u, spread) / i->area / (pi * distance * distance + to), 1);
    } else if (i->kind != FCT_ELEMENT_VOLUME && j->kind != FCT_ELEMENT_VOLUME) {
        double bend =
            i == j ? i->area - v3_norm(i->vector) : i->area + j->area - v3_norm(v3_add(i->vector, j->vector));
        factor = fmin(fmin(fmax(bend, 0), fmin(i->area, j->area)) / i->area, 1);
    }
    for (int c = 0; c < 3; ++c)
        light += j->radiosity[c] * (i->kind == FCT_ELEMENT_VOLUME ? .7 : fmax(i->reflectance[c], .05));
    return light * factor * i->area;
}

static outcome judge_pair(judge *g, fct_link *l) {
    const fct_elements *set = g->set;
    const fct_element *i = &set->items[l->receiver], *j = &set->items[l->source];
    bool self = i == j, triangle = i->kind == FCT_ELEMENT_TRIANGLE;
    if (i->area == 0 || j->area == 0 || (self && triangle)) return DROPPED;
    v3 d = v3_sub(j->center, i->center);
    double distance = v3_norm(d), radii = .55 * (i->radius + j->radius);
    v3 u = distance > 0 ? v3_scale(d, 1 / distance) : d;
    bool overlap = distance <= radii, volume = i->kind == FCT_ELEMENT_VOLUME;
    double sine = (i->radius + j->radius) / distance;
    if (!overlap && (is_turned_away(i, u, sine) || is_turned_away(j, v3_scale(u, -1), sine)))
        return ++g->met.away, DROPPED;
    if (is_hidden(set, i, j) || is_hidden(set, j, i)) return ++g->met.hidden, DROPPED;
    bool split_i = i->child_count || fct_elements_can_split(set, l->receiver);
    bool split_j = j->child_count || fct_elements_can_split(set, l->source);
    if (volume && overlap && !split_i && !split_j) return DROPPED;
    double flow = find_flow(i, j, u, distance, radii);
    if (flow == 0 && l->rays == 0) return ++g->met.dark, KEPT;
    bool splits = (split_i || split_j) && !(self && !split_i);
    outcome larger = split_i && (!split_j || i->radius >= j->radius) ? RECEIVER_OPENED : SOURCE_OPENED;
    double from = pow(.55 * j->radius / distance, 2), to = .25 * .55 * i->radius / distance;
    g->error = flow * (overlap ? 1 : fmin(from + to, 1));
    if (splits && g->error > g->epsilon) {
        if (overlap || !split_i || !split_j) return ++g->met.overlap, larger;
        return ++g->met.by_size, from > to ? SOURCE_OPENED : RECEIVER_OPENED;
    }
    if (volume && overlap && splits) return ++g->met.by_volume, larger;
    if (l->rays == 0) measure_link(g, l, distance, radii);
    if (!splits) return ++g->met.stuck, KEPT;
    if (l->near || flow * sqrt(l->weight * (1 - (double)l->weight)) <= g->epsilon) return KEPT;
    g->error = flow * sqrt(l->weight * (1 - (double)l->weight));
    return ++g->met.by_shadow, larger;
}

/* Judges a pair and the pairs below it, and counts the kept ones that `links` holds. */
static size_t follow_pair(judge *g, fct_link l, const fct_links *links) {
    outcome result = judge_pair(g, &l);
    if (result == DROPPED) return 0;
    if (result == KEPT) {
        size_t found = 0;
        for (uint32_t k = links->first[l.receiver]; k < links->first[l.receiver + 1]; ++k) {
            const fct_link *x = &links->items[k];
            assert_int_equal(x->receiver, l.receiver);
            if (x->source != l.source) continue;
            ++found;
            if (x->near != l.near || x->rays != l.rays || fabs((double)x->weight - (double)l.weight) > 1e-5)
                fail_msg("link %u <- %u: near %d, rays %d, weight %g; expected %d, %d, %g", l.receiver,
                         l.source, x->near, x->rays, (double)x->weight, l.near, l.rays, (double)l.weight);
        }
        if (found != 1) fail_msg("link %u <- %u exists %zu times", l.receiver, l.source, found);
        return 1;
    }
    uint32_t id = result == RECEIVER_OPENED ? l.receiver : l.source;
    const fct_element *e = &g->set->items[id];
    if (!e->child_count) fail_msg("pair %u <- %u: %u is not open", l.receiver, l.source, id);
    g->opened[id] = true, ++g->met.opened[result == SOURCE_OPENED];
    size_t kept = 0;
    for (uint32_t a = e->child; a < e->child + e->child_count; ++a)
        for (uint32_t b = e->child; b < e->child + (l.receiver == l.source ? e->child_count : 1); ++b)
            kept += follow_pair(g,
                                l.receiver == l.source      ? (fct_link){.receiver = a, .source = b}
                                : result == RECEIVER_OPENED ? (fct_link){.receiver = a, .source = l.source}
                                                            : (fct_link){.receiver = l.receiver, .source = a},
                                links);
    return kept;
}

/* Irradiance at a point (normal not NULL) or on a leaf over the links of element `top` and its ancestors. */
static double sum_links(const fct_elements *set, const fct_links *links, uint32_t top,
                        const fct_element *leaf, v3 x, const v3 *normal, double e[3]) {
    double row = 0;
    e[0] = e[1] = e[2] = 0;
    for (; top != FCT_NONE; top = set->items[top].parent)
        for (size_t k = 0; k < links->count; ++k) {
            const fct_link *l = &links->items[k];
            const fct_element *j = &set->items[l->source];
            if (l->receiver != top || l->rays == 0) continue;
            if (l->near) {
                row += (double)l->weight;
                for (int c = 0; c < 3; ++c) e[c] += (double)l->weight * j->radiosity[c];
                continue;
            }
            v3 d = v3_sub(j->center, x);
            double r2 = v3_norm2(d);
            if (r2 == 0) continue;
            v3 u = v3_scale(d, 1 / sqrt(r2)), back = v3_scale(u, -1);
            double seen = project_area(j, back);
            double cosine = normal ? fmax(v3_dot(*normal, u), 0) : project_area(leaf, u) / leaf->area;
            double factor = (double)l->weight * cosine / (pi * r2 + seen);
            for (int c = 0; c < 3; ++c)
                e[c] += factor * fmax(v3_dot(j->power[c], back), j->radiosity[c] * seen);
            row += factor * seen;
        }
    for (int c = 0; c < 3 && row > 1; ++c) e[c] /= row;
    return row;
}

/* One sweep sets the irradiance of each leaf to the sum over its links, and its radiosity to e + rho E. */
static void compare_sweep(fct_elements *set, fct_links *links, int *above) {
    double *expected = malloc(4 * set->count * sizeof *expected);
    for (size_t id = 0; id < set->count; ++id)
        expected[4 * id + 3] = sum_links(set, links, (uint32_t)id, &set->items[id], set->items[id].center,
                                         NULL, expected + 4 * id);
    uint32_t sweeps = 7;
    assert_int_equal(fct_links_solve(set, links, 1e-9, 1, &sweeps), FCT_OK);
    assert_int_equal(sweeps, 8);
    for (size_t id = 0; id < set->count; ++id) {
        const fct_element *e = &set->items[id];
        if (e->child_count || e->kind == FCT_ELEMENT_VOLUME || e->area == 0) continue;
        assert_near(links->rows[id], expected[4 * id + 3], 1e-9);
        *above += links->rows[id] > 1.001;
        for (int c = 0; c < 3; ++c) {
            assert_near(e->irradiance[c], expected[4 * id + (size_t)c], 1e-9);
            assert_near(e->radiosity[c],
                        (double)e->emission[c] + (double)e->reflectance[c] * e->irradiance[c], 1e-9);
        }
    }
    free(expected);
}

/* At points with normals on leaves, some of them newer than the links. */
static void compare_points(fct_elements *set, fct_links *links, uint64_t seed) {
    size_t old = set->count;
    for (size_t id = 0; id < old; ++id)
        if (fct_elements_can_split(set, (uint32_t)id) && id % 3 == 0)
            assert_int_equal(fct_elements_split(set, (uint32_t)id), FCT_OK);
    for (size_t id = seed % 5; id < set->count; id += 5) {
        const fct_element *e = &set->items[id];
        if (e->child_count || e->kind == FCT_ELEMENT_VOLUME) continue;
        v3 n = v3_unit(v3_make(fct_uniform(fct_hash3(seed, id, 1)) - .5,
                               fct_uniform(fct_hash3(seed, id, 2)) - .5,
                               fct_uniform(fct_hash3(seed, id, 3)) - .5));
        v3 x = v3_mad(e->center, .1 * e->radius, n);
        double expected[3], found[3];
        uint32_t top = (uint32_t)id;
        while (top >= old) top = set->items[top].parent;
        sum_links(set, links, top, NULL, x, &n, expected);
        fct_links_irradiance(set, links, (uint32_t)id, x, n, found);
        for (int c = 0; c < 3; ++c) assert_near(found[c], expected[c], 1e-9);
    }
    assert_true(set->count > old);
}

static void links_follow_the_rules(void **state) {
    (void)state;
    tally all = {0};
    int above = 0;
    for (uint64_t seed = 0; seed < 8; ++seed) {
        fct_scene *scene = make_scene(seed);
        soup triangles = list_triangles(scene);
        fct_elements set;
        fct_links links;
        assert_int_equal(fct_elements_create(&plain, scene, seed < 4 ? .4 : 3, &set), FCT_OK);
        assert_int_equal(fct_links_create(&plain, &links), FCT_OK);
        fct_link *before = malloc(sizeof *before);
        size_t count = 1;
        before[0] = links.items[0];
        for (int pass = 0; pass < 4; ++pass) {
            size_t old = set.count, kept = 0;
            bool *was_open = calloc(old, sizeof *was_open);
            for (size_t id = 0; id < old; ++id) was_open[id] = set.items[id].child_count > 0;
            judge g = {
                .set = &set, .triangles = &triangles, .epsilon = 2. / (1 << (2 * pass)), .rays = links.rays};
            assert_int_equal(refine_links(&set, &links, g.epsilon), FCT_OK);
            g.opened = calloc(set.count, sizeof *g.opened);
            for (size_t k = 0; k < count; ++k) kept += follow_pair(&g, before[k], &links);
            assert_int_equal(kept, links.count);
            assert_int_equal(g.rays, links.rays);
            for (size_t id = 0; id < set.count; ++id)
                assert_int_equal(set.items[id].child_count > 0, g.opened[id] || (id < old && was_open[id]));
            free(g.opened), free(was_open);
            const int *from = (const int *)&g.met;
            for (size_t k = 0; k < sizeof all / sizeof(int); ++k) ((int *)&all)[k] += from[k];
            compare_sweep(&set, &links, &above), compare_sweep(&set, &links, &above);
            count = links.count;
            before = realloc(before, count * sizeof *before);
            memcpy(before, links.items, count * sizeof *before);
        }
        for (size_t k = 0; k < links.count; ++k) links.items[k].weight *= seed & 1 ? 20 : 1;
        compare_sweep(&set, &links, &above);
        compare_points(&set, &links, seed);
        free(before), free(triangles.corners);
        fct_links_release(&plain, &links);
        fct_elements_release(&set);
        fct_scene_destroy(scene);
    }
    printf(
        "    away %d, hidden %d, near %d, far %d, partial %d, blind %d, dark %d, opened %d %d, by size %d, "
        "shadow %d, volume %d, overlap %d, stuck %d, rows above 1: %d\n",
        all.away, all.hidden, all.near, all.far, all.partial, all.blind, all.dark, all.opened[0],
        all.opened[1], all.by_size, all.by_shadow, all.by_volume, all.overlap, all.stuck, above);
    assert_true(above > 100);
    const int *met = (const int *)&all;
    for (size_t k = 0; k < sizeof all / sizeof(int); ++k) assert_true(met[k] > 0);
}

/* A small square that faces a ground of a million times its area from close by has links to it. */
static void small_faces_see_huge_ones(void **state) {
    (void)state;
    fct_scene *scene;
    fct_elements set;
    fct_links links;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    place_sheet(&plain, scene, add_colour(scene, 1, 1, false), 1, v3_make(-1000, -900, 0),
                v3_make(2000, 0, 0), v3_make(0, 2000, 0));
    place_sheet(&plain, scene, add_colour(scene, 2, 1, false), 1, v3_make(0, 0, .005), v3_make(0, 1, 0),
                v3_make(1, 0, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, scene, 1e4, &set), FCT_OK);
    assert_int_equal(fct_links_create(&plain, &links), FCT_OK);
    assert_int_equal(refine_links(&set, &links, 1e-15), FCT_OK);
    int lit = 0;
    for (size_t i = 0; i < links.count; ++i) lit += links.items[i].rays > 0;
    assert_int_equal(lit, 8);
    fct_links_release(&plain, &links);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* Two squares with a common edge, at an angle in radians above the plane of one: links exist if they see each
 * other. */
static void flat_edges_have_no_links(void **state) {
    (void)state;
    static const double angles[] = {-.5, -1e-3, 0, 1e-6, 1e-3, .05, .5};
    for (size_t k = 0; k < sizeof angles / sizeof *angles; ++k) {
        fct_scene *scene;
        fct_elements set;
        fct_links links;
        plain = fct_env_default();
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        place_sheet(&plain, scene, add_colour(scene, 1, 1, false), 1, v3_make(0, 0, 0), v3_make(1, 0, 0),
                    v3_make(0, 1, 0));
        place_sheet(&plain, scene, add_colour(scene, 2, 1, false), 1, v3_make(1, 0, 0),
                    v3_make(cos(angles[k]), 0, sin(angles[k])), v3_make(0, 1, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        assert_int_equal(fct_elements_create(&plain, scene, 9, &set), FCT_OK);
        assert_int_equal(fct_links_create(&plain, &links), FCT_OK);
        assert_int_equal(refine_links(&set, &links, 1e-15), FCT_OK);
        int lit = 0; /* of two triangles each, in both directions */
        for (size_t i = 0; i < links.count; ++i) lit += links.items[i].rays > 0;
        assert_int_equal(lit, angles[k] > 1e-4 ? 8 : 0);
        fct_links_release(&plain, &links);
        fct_elements_release(&set);
        fct_scene_destroy(scene);
    }
}

/* Links of a scene after a first pass, solved. */
typedef struct refined {
    fct_elements set;
    fct_links links;
} refined;

static void open_refined(fct_scene *scene, refined *r) {
    assert_int_equal(fct_elements_create(&plain, scene, .4, &r->set), FCT_OK);
    assert_int_equal(fct_links_create(&plain, &r->links), FCT_OK);
    assert_int_equal(refine_links(&r->set, &r->links, 2), FCT_OK);
    uint32_t sweeps = 0;
    assert_int_equal(fct_links_solve(&r->set, &r->links, 1e-9, 4, &sweeps), FCT_OK);
}

static void close_refined(refined *r) {
    fct_links_release(&plain, &r->links);
    fct_elements_release(&r->set);
}

/* Refines a new copy, and returns the number of links. */
static size_t count_links(fct_scene *scene, double epsilon, size_t most, bool limited,
                          fct_refine_result *done) {
    refined r;
    open_refined(scene, &r);
    const fct_refine_def def = {.epsilon = epsilon, .most = most, .limited = limited, .phase = "links"};
    assert_int_equal(fct_links_refine(&r.set, &r.links, &def, done), FCT_OK);
    const size_t count = r.links.count;
    close_refined(&r);
    return count;
}

/* The largest error that the oracle finds among the links that should be split. */
static double find_left_error(const soup *triangles, refined *r, double epsilon) {
    judge g = {.set = &r->set, .triangles = triangles, .epsilon = epsilon};
    double most = epsilon;
    for (size_t k = 0; k < r->links.count; ++k) {
        fct_link l = r->links.items[k];
        const fct_element *i = &r->set.items[l.receiver];
        const bool sampled = l.rays > 0;
        const int dark = g.met.dark;
        outcome o = judge_pair(&g, &l);
        assert_true(sampled || g.met.dark > dark);
        if (o == KEPT || o == DROPPED) continue;
        /* Volumes that overlap are split at any error. */
        if (g.error > most) most = g.error;
        assert_true(g.error > epsilon || i->kind == FCT_ELEMENT_VOLUME);
    }
    return most;
}

/* With a limit: the links fill it, epsilon is the largest error that is left, and a refinement to that
 * epsilon needs nearly as many links. A limit that is just large enough changes nothing, and the order of
 * errors leads to the same links. */
static void a_limit_leaves_small_errors(void **state) {
    (void)state;
    const double epsilon = .002;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        fct_scene *scene = make_scene(seed);
        soup triangles = list_triangles(scene);
        fct_refine_result done;
        const size_t all = count_links(scene, epsilon, SIZE_MAX, false, &done);
        assert_true(!done.limited && done.epsilon == epsilon);
        /* Elements have other numbers then, and so other visibility rays. */
        assert_near((double)count_links(scene, epsilon, SIZE_MAX, true, &done), (double)all,
                    .1 * (double)all);
        assert_true(!done.limited && done.epsilon == epsilon);
        for (size_t part = 2; part <= 8; part *= 2) {
            refined r;
            open_refined(scene, &r);
            const size_t most = all / part;
            const fct_refine_def def = {.epsilon = epsilon, .most = most, .phase = "links"};
            assert_true(r.links.count < most);
            assert_int_equal(fct_links_refine(&r.set, &r.links, &def, &done), FCT_OK);
            assert_true(done.limited && r.links.count <= most && r.links.count > most - 16);
            assert_near(done.epsilon, find_left_error(&triangles, &r, epsilon), 1e-5 * done.epsilon);
            /* A pass that starts again leaves nothing of its first try. */
            refined direct;
            open_refined(scene, &direct);
            const fct_refine_def at_once = {
                .epsilon = epsilon, .most = most, .limited = true, .phase = "links"};
            fct_refine_result same_done;
            assert_int_equal(fct_links_refine(&direct.set, &direct.links, &at_once, &same_done), FCT_OK);
            assert_int_equal(r.set.count, direct.set.count);
            assert_int_equal(r.links.count, direct.links.count);
            close_refined(&direct);
            close_refined(&r);
            fct_refine_result other;
            const size_t same = count_links(scene, done.epsilon, SIZE_MAX, false, &other);
            printf("    %zu of %zu links: epsilon %.3g, which needs %zu\n", most, all, done.epsilon, same);
            assert_true(3 * same > most);
        }
        free(triangles.corners);
        fct_scene_destroy(scene);
    }
}

/* Where there is room for one split alone, the pair with the largest error is split. */
static void the_largest_error_is_split_first(void **state) {
    (void)state;
    const double epsilon = .002;
    int contested = 0;
    for (uint64_t seed = 0; seed < 8; ++seed) {
        fct_scene *scene = make_scene(seed);
        soup triangles = list_triangles(scene);
        refined r;
        open_refined(scene, &r);
        judge g = {.set = &r.set, .triangles = &triangles, .epsilon = epsilon};
        fct_link worst = {0};
        double largest = 0, second = 0;
        for (size_t k = 0; k < r.links.count; ++k) {
            fct_link l = r.links.items[k];
            const outcome o = judge_pair(&g, &l);
            if (o == KEPT || o == DROPPED) continue;
            if (g.error > largest)
                second = largest, largest = g.error, worst = l;
            else if (g.error > second)
                second = g.error;
        }
        contested += second > .5 * largest && second < .99 * largest;
        const fct_refine_def def = {
            .epsilon = epsilon, .most = r.links.count + 3, .limited = true, .phase = "links"};
        fct_refine_result done;
        assert_true(largest > epsilon);
        assert_int_equal(fct_links_refine(&r.set, &r.links, &def, &done), FCT_OK);
        assert_true(done.limited);
        for (size_t k = 0; k < r.links.count && second < .99 * largest; ++k)
            assert_false(r.links.items[k].receiver == worst.receiver &&
                         r.links.items[k].source == worst.source);
        close_refined(&r);
        free(triangles.corners);
        fct_scene_destroy(scene);
    }
    assert_true(contested > 2);
}

/* Elements that were added since an earlier moment leave no trace. */
static void truncated_elements_can_be_split_again(void **state) {
    (void)state;
    fct_scene *scene = make_scene(3);
    fct_elements set;
    assert_int_equal(fct_elements_create(&plain, scene, .4, &set), FCT_OK);
    fct_elements_make_points(&set);
    const size_t count = set.count, corners = set.corner_count, clusters = set.cluster_count;
    fct_element first[64];
    for (int round = 0; round < 2; ++round) {
        for (size_t id = 0; id < count + 40; ++id)
            if (fct_elements_can_split(&set, (uint32_t)id))
                assert_int_equal(fct_elements_split(&set, (uint32_t)id), FCT_OK);
        fct_elements_make_points(&set);
        assert_true(set.count > count + 64 && set.corner_count > corners && set.cluster_count > clusters);
        if (round == 0) memcpy(first, set.items + count, sizeof first);
        assert_memory_equal(first, set.items + count, sizeof first);
        fct_elements_truncate(&set, count);
        assert_true(set.count == count && set.corner_count == corners && set.cluster_count == clusters);
        for (size_t id = set.view.volume_count; id < count; ++id)
            assert_true(set.items[id].child_count == 0 && set.ranges[id].child_count == 0);
    }
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* Sorting keeps the order of links with one receiver. */
static void links_are_sorted_stably(void **state) {
    (void)state;
    fct_scene *scene = make_scene(1);
    fct_elements set;
    fct_links links = {0};
    assert_int_equal(fct_elements_create(&plain, scene, .4, &set), FCT_OK);
    links.count = links.capacity = 500;
    links.items = fct_allocate_zero(&plain, links.count, sizeof *links.items);
    for (uint32_t k = 0; k < links.count; ++k)
        links.items[k] = (fct_link){.receiver = (uint32_t)(fct_hash(k) % set.count), .source = k};
    assert_int_equal(fct_links_sort(&set, &links), FCT_OK);
    assert_int_equal(links.count, 500);
    assert_int_equal(links.element_count, set.count);
    assert_true(links.first[0] == 0 && links.first[set.count] == 500);
    for (uint32_t id = 0; id < set.count; ++id)
        for (uint32_t k = links.first[id]; k < links.first[id + 1]; ++k) {
            assert_int_equal(links.items[k].receiver, id);
            assert_int_equal(fct_hash(links.items[k].source) % set.count, id);
            assert_true(k == links.first[id] || links.items[k - 1].source < links.items[k].source);
        }
    fct_links_release(&plain, &links);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(links_follow_the_rules),
        cmocka_unit_test(flat_edges_have_no_links),
        cmocka_unit_test(small_faces_see_huge_ones),
        cmocka_unit_test(a_limit_leaves_small_errors),
        cmocka_unit_test(the_largest_error_is_split_first),
        cmocka_unit_test(truncated_elements_can_be_split_again),
        cmocka_unit_test(links_are_sorted_stably),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
