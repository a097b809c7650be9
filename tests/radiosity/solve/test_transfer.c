/* Formulas of transfer.h and oracle.h on elements made by hand, against sums over triangles, numerical
 * integration between patches, and closed forms. */
#include "../place.h"
#include "radiosity/solve/oracle.h"

static const double pi = 3.14159265358979323846;

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance * fmax(fabs(expected), 1e-12)))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* A cluster of facets with areas and unit normals about a centre. */
typedef struct facet {
    double area;
    v3 normal;
} facet;

static fct_element make_cluster(const facet *facets, int count, v3 center, double radius) {
    fct_element e = {.center = center, .radius = radius, .kind = FCT_ELEMENT_CLUSTER, .cone = pi};
    for (int i = 0; i < count; ++i) {
        double a = facets[i].area, n[3] = {facets[i].normal.x, facets[i].normal.y, facets[i].normal.z};
        e.area += a;
        e.vector = v3_mad(e.vector, a, facets[i].normal);
        for (int r = 0, k = 0; r < 3; ++r)
            for (int c = r; c < 3; ++c, ++k) e.moment[k] += a * n[r] * n[c];
    }
    return e;
}

/* Areas of the facets that face u, projected. */
static double project(const facet *facets, int count, v3 u) {
    double sum = 0;
    for (int i = 0; i < count; ++i) sum += facets[i].area * fmax(0, v3_dot(facets[i].normal, u));
    return sum;
}

/* About `count` directions, evenly on the sphere. */
static v3 direction(int i, int count) {
    double z = 1 - (2 * i + 1.) / count, r = sqrt(1 - z * z), a = 2.399963229728653 * i;
    return v3_make(r * cos(a), r * sin(a), z);
}

static void flat_sheets_project_exactly(void **state) {
    (void)state;
    const facet sheet[2] = {{.5, {0, .6, .8}}, {1.5, {0, .6, .8}}};
    fct_element e = make_cluster(sheet, 2, v3_make(0, 0, 0), 1), triangle = e;
    triangle.kind = FCT_ELEMENT_TRIANGLE;
    for (int i = 0; i < 200; ++i) {
        v3 u = direction(i, 200);
        double exact = project(sheet, 2, u), back = 2 * fmax(0, -v3_dot(sheet[0].normal, u));
        assert_near(fct_projected_area(&triangle, u), exact, 1e-12);
        if (exact > 0)
            assert_near(fct_projected_area(&e, u), exact, 1e-12);
        else /* seen from behind: (.95 - 1) / 2 of the area, below 0 */
            assert_true(fct_projected_area(&e, u) == 0);
        double bound = fct_projected_bound(&e, u, 0);
        assert_true(bound >= exact - 1e-12 && bound <= exact + 1e-12 + 0 * back);
    }
}

/* A closed body with even normals: A u^T M u = A^2 / 3, so the estimate is .95 / (2 sqrt 3) A against A / 4.
 * The constant .95 is stated in docs/radiosity.md. */
static void bodies_project_by_their_moments(void **state) {
    (void)state;
    enum { N = 2000 };
    facet facets[N];
    for (int i = 0; i < N; ++i) facets[i] = (facet){2. / N, direction(i, N)};
    fct_element e = make_cluster(facets, N, v3_make(0, 0, 0), 1);
    for (int i = 0; i < 50; ++i) {
        v3 u = direction(i, 50);
        assert_near(fct_projected_area(&e, u), .95 / (2 * sqrt(3)) * 2, 2e-3);
        assert_near(fct_projected_bound(&e, u, 0), 1 / (2 * sqrt(3)) * 2, 2e-3);
        assert_near(fct_projected_bound(&e, u, .1), 1 / (2 * sqrt(3)) * 2 + .1 * 2, 2e-3);
    }
    /* Never more than the whole area. */
    assert_near(fct_projected_bound(&e, v3_make(0, 0, 1), .9), 2, 1e-12);
}

/* Over random bumpy clusters: S.u <= true <= bound; the widened bound holds for all directions within it. */
static void bounds_contain_the_true_area(void **state) {
    (void)state;
    for (uint64_t c = 0; c < 40; ++c) {
        facet facets[12];
        for (uint64_t i = 0; i < 12; ++i) {
            v3 n = v3_make(fct_uniform(fct_hash3(c, i, 0)) - .5, fct_uniform(fct_hash3(c, i, 1)) - .5, .3);
            facets[i] = (facet){fct_uniform(fct_hash3(c, i, 2)), v3_unit(n)};
        }
        fct_element e = make_cluster(facets, 12, v3_make(0, 0, 0), 1);
        double ratio = 0;
        for (int i = 0; i < 60; ++i) {
            v3 u = direction(i, 60);
            double exact = project(facets, 12, u), bound = fct_projected_bound(&e, u, 0);
            assert_true(v3_dot(e.vector, u) <= exact + 1e-12 && exact <= bound + 1e-12);
            double estimate = fct_projected_area(&e, u);
            assert_true(estimate >= v3_dot(e.vector, u) - 1e-12 && estimate <= bound + 1e-12);
            ratio += estimate / 60 / e.area;
            double spread = .2, wide = fct_projected_bound(&e, u, spread);
            v3 s, t;
            v3_frame(u, &s, &t);
            for (int k = 0; k < 8; ++k) {
                v3 w = v3_mad(v3_scale(u, sqrt(1 - spread * spread)), spread * cos(k), s);
                w = v3_mad(w, spread * sin(k), t);
                assert_true(project(facets, 12, w) <= wide + 1e-9);
            }
        }
        assert_near(ratio, .25, .12); /* the mean projection of any convex surface is a quarter of its area */
    }
}

static void facing_away_is_exact_for_cones(void **state) {
    (void)state;
    const facet up[1] = {{1, {0, 0, 1}}};
    fct_element e = make_cluster(up, 1, v3_make(0, 0, 0), 1);
    for (int i = 0; i <= 180; ++i) {
        double a = pi * i / 180;
        v3 u = v3_make(sin(a), 0, cos(a));
        e.cone = .3;
        bool away = a - .3 - .2 > pi / 2;
        if (fabs(a - .5 - pi / 2) > .01) assert_int_equal(fct_faces_away(&e, u, .2), away);
        e.cone = 2;
        assert_false(fct_faces_away(&e, u, .2));
    }
}

/* P.u is right where the visible side is lit alone; the mean is right for an even body. */
static void power_is_seen_from_its_side(void **state) {
    (void)state;
    const facet box[2] = {{1, {0, 0, 1}}, {1, {0, 0, -1}}};
    fct_element e = make_cluster(box, 2, v3_make(0, 0, 0), 1);
    const v3 up = {0, 0, 1};
    /* The upper side shines with 3, the lower one is dark: P = 3 (0, 0, 1), mean b = 1.5. */
    e.power[1] = v3_make(0, 0, 3), e.radiosity[1] = 1.5;
    assert_near(fct_sent_power(&e, up, 1, 1), 3, 1e-12);
    /* Both shine with 2: P = 0. */
    e.power[1] = v3_make(0, 0, 0), e.radiosity[1] = 2;
    assert_near(fct_sent_power(&e, up, 1, 1), 2, 1e-12);
}

/* On the axis of a disk lamp E / B = R^2 / (R^2 + h^2) at every distance. */
static void disks_are_exact_on_their_axis(void **state) {
    (void)state;
    for (double h = .01; h < 100; h *= 2) {
        double area = pi * .49;
        assert_near(area * fct_distance_factor(h * h, area), .49 / (.49 + h * h), 1e-9);
    }
}

static fct_element square(v3 center, v3 normal, double side) {
    const facet f[1] = {{side * side, normal}};
    fct_element e = make_cluster(f, 1, center, side / sqrt(2));
    e.cone = 0;
    for (int c = 0; c < 3; ++c) e.reflectance[c] = .5, e.radiosity[c] = c + 1;
    return e;
}

/* Form factor between two squares, by midpoints. */
static double integrate_squares(const fct_element *i, v3 ni, const fct_element *j, v3 nj, int grid) {
    double sum = 0, si = sqrt(i->area), sj = sqrt(j->area);
    v3 a, b, c, d;
    v3_frame(ni, &a, &b), v3_frame(nj, &c, &d);
    for (int k = 0; k < grid * grid; ++k)
        for (int l = 0; l < grid * grid; ++l) {
            v3 x = v3_mad(v3_mad(i->center, si * ((k % grid + .5) / grid - .5), a),
                          si * ((k / grid + .5) / grid - .5), b);
            v3 y = v3_mad(v3_mad(j->center, sj * ((l % grid + .5) / grid - .5), c),
                          sj * ((l / grid + .5) / grid - .5), d);
            v3 r = v3_sub(y, x);
            double r2 = v3_norm2(r), p = v3_dot(r, ni), q = -v3_dot(r, nj);
            if (p > 0 && q > 0) sum += p * q / (pi * r2 * r2);
        }
    return sum * j->area / pow(grid, 4);
}

/* Apart: the bound lies above the integral, and tends to it with distance. The flow is rho b F A over
 * channels. */
static void flow_bounds_the_form_factor(void **state) {
    (void)state;
    const v3 up = {0, 0, 1};
    for (double r = 2; r < 1000; r *= 3) {
        v3 down = v3_unit(v3_make(-.3, 0, -1)), place = v3_scale(v3_make(.4, .1, .9), r);
        fct_element i = square(v3_make(0, 0, 0), up, 1.5), j = square(place, down, .7);
        fct_pair pair = fct_pair_place(&i, &j);
        assert_near(pair.distance, v3_norm(place), 1e-12);
        assert_near(v3_dot(pair.toward, v3_unit(place)), 1, 1e-12);
        assert_false(pair.overlap);
        double exact = integrate_squares(&i, up, &j, down, 8), bound = fct_pair_form_bound(&i, &j, &pair);
        assert_true(bound >= exact);
        if (r > 100) assert_near(bound, exact, .02);
        /* rho .5, b 1 + 2 + 3, area 2.25 */
        assert_near(fct_pair_flow(&i, &j, &pair), .5 * 6 * 2.25 * bound, 1e-12);
        i.reflectance[0] = i.reflectance[1] = i.reflectance[2] = 0;
        assert_near(fct_pair_flow(&i, &j, &pair), .05 * 6 * 2.25 * bound, 1e-12);
        i.kind = FCT_ELEMENT_VOLUME;
        assert_near(fct_pair_flow(&i, &j, &pair), .7 * 6 * 2.25 * fct_pair_form_bound(&i, &j, &pair), 1e-12);
    }
}

/* Directions between the elements vary by their typical radii: the bound at a distance is that of the
 * projected areas widened by half the angle, with the area over pi r^2 plus itself. */
static void flow_widens_by_the_spread(void **state) {
    (void)state;
    fct_element i = square(v3_make(0, 0, 0), v3_make(0, 0, 1), 1),
                j = square(v3_make(0, 0, 5), v3_make(0, 1, 0), 1);
    fct_pair pair = fct_pair_place(&i, &j);
    double radii = .55 * 2 / sqrt(2), spread = .5 * radii / 5;
    assert_near(pair.radii, radii, 1e-12);
    /* j is edge-on: only the spread lets it send. */
    double pj = spread * 1, pi_ = fmin(1, 1 + spread);
    assert_near(fct_pair_form_bound(&i, &j, &pair), pj * pi_ / (pi * 25 + pj), 1e-9);
}

/* Two faces of an open book with a right angle: exactly A - |S| of the union is bent. A flat pair exchanges
 * nothing; a concave patch with itself 1 - |S| / A, which for a hemisphere is 1/2. */
static void overlapping_patches_exchange_their_bend(void **state) {
    (void)state;
    fct_element i = square(v3_make(0, 0, 0), v3_make(0, 0, 1), 1),
                j = square(v3_make(.5, 0, .5), v3_make(-1, 0, 0), 1);
    fct_pair pair = fct_pair_place(&i, &j);
    assert_true(pair.overlap);
    assert_near(fct_pair_form_bound(&i, &j, &pair), 2 - sqrt(2), 1e-9);
    j = square(v3_make(.5, 0, 0), v3_make(0, 0, 1), 1);
    pair = fct_pair_place(&i, &j);
    assert_true(fct_pair_form_bound(&i, &j, &pair) < 1e-9);
    j = square(v3_make(.1, 0, .1), v3_make(0, 0, -1), .1); /* a small source limits the exchange */
    pair = fct_pair_place(&i, &j);
    assert_true(pair.overlap);
    assert_near(fct_pair_form_bound(&i, &j, &pair), .01, 1e-9);
    enum { N = 4000 };
    facet half[N];
    for (int k = 0; k < N; ++k) half[k] = (facet){1. / N, direction(k, 2 * N)}; /* z > 0 */
    fct_element cap = make_cluster(half, N, v3_make(0, 0, 0), 1);
    pair = fct_pair_place(&cap, &cap);
    assert_near(fct_pair_form_bound(&cap, &cap, &pair), .5, 1e-3);
    cap.kind = FCT_ELEMENT_VOLUME;
    assert_near(fct_pair_form_bound(&cap, &cap, &pair), 1, 1e-12);
}

static void errors_fall_with_distance(void **state) {
    (void)state;
    fct_element i = square(v3_make(0, 0, 0), v3_make(0, 0, 1), 1),
                j = square(v3_make(0, 0, 10), v3_make(0, 0, -1), 2);
    fct_pair pair = fct_pair_place(&i, &j);
    double ri = .55 / sqrt(2), rj = .55 * sqrt(2);
    assert_near(fct_pair_source_error(&j, &pair), rj * rj / 100, 1e-9);
    assert_near(fct_pair_receiver_error(&i, &pair), ri / 40, 1e-9);
}

static void spread_counts_darkness_sixteenfold(void **state) {
    (void)state;
    fct_element e = square(v3_make(0, 0, 0), v3_make(0, 0, 1), 2);
    e.reflectance[2] = .25F;
    const double lit[3][3] = {{1, 2, 3}, {1.5, 2, 1}, {1.25, 1, 2}}, half[2][3] = {{0, 0, 0}, {0, 1, 0}};
    assert_near(fct_direct_spread(&e, 3, lit), 4 * (.5 * .5 + .5 * 1 + .25 * 2), 1e-12);
    assert_near(fct_direct_spread(&e, 2, half), 16 * 4 * .5, 1e-12);
    const double dark[2][3] = {{0}}, red[2][3] = {{1, 0, 0}, {2, 0, 0}};
    assert_true(fct_direct_spread(&e, 2, dark) == 0);
    assert_near(fct_direct_spread(&e, 2, red), 4 * .5, 1e-12); /* no lamp sends green or blue */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_sheets_project_exactly),
        cmocka_unit_test(bodies_project_by_their_moments),
        cmocka_unit_test(bounds_contain_the_true_area),
        cmocka_unit_test(facing_away_is_exact_for_cones),
        cmocka_unit_test(power_is_seen_from_its_side),
        cmocka_unit_test(disks_are_exact_on_their_axis),
        cmocka_unit_test(flow_bounds_the_form_factor),
        cmocka_unit_test(flow_widens_by_the_spread),
        cmocka_unit_test(overlapping_patches_exchange_their_bend),
        cmocka_unit_test(errors_fall_with_distance),
        cmocka_unit_test(spread_counts_darkness_sixteenfold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
