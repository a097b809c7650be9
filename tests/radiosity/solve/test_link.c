/* Links and iteration: form factors against integrals, visible fractions, and solutions against a dense
 * solve. */
#include "../place.h"
#include "../refining.h"
#include "radiosity/solve/iterate.h"

static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance * fabs(expected) + 1e-12))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

typedef struct fixture {
    fct_scene *scene;
    fct_elements set;
    fct_links links;
    uint32_t dark, bright;
} fixture;

static fixture begin(void) {
    fixture f = {0};
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &f.scene), FCT_OK);
    f.dark = place_material(f.scene, .5, 0, false), f.bright = place_material(f.scene, 0, 1, false);
    return f;
}

static void refine(fixture *f, double epsilon, double min_edge) {
    assert_int_equal(fct_scene_commit(f->scene), FCT_OK);
    assert_int_equal(fct_elements_create(&plain, f->scene, min_edge, &f->set), FCT_OK);
    assert_int_equal(fct_links_create(&plain, &f->links), FCT_OK);
    assert_int_equal(refine_links(&f->set, &f->links, epsilon), FCT_OK);
}

static void end(fixture *f) {
    fct_links_release(&plain, &f->links);
    fct_elements_release(&f->set);
    fct_scene_destroy(f->scene);
}

/* Mean irradiance over instance 0, from the links, in channel 1. */
static double receive(fixture *f) {
    uint32_t sweeps = 0;
    assert_int_equal(fct_links_solve(&f->set, &f->links, 1e-9, 50, &sweeps), FCT_OK);
    double flux = 0, area = 0;
    for (size_t id = 0; id < f->set.count; ++id) {
        const fct_element *e = &f->set.items[id];
        if (e->child_count || e->instance != 0) continue;
        flux += e->area * e->irradiance[1], area += e->area;
    }
    return flux / area;
}

/* A far square lamp: one link between the roots, E = cos cos' A / (pi r^2 + A cos'). */
static void far_links_equal_the_kernel(void **state) {
    (void)state;
    for (int k = 0; k < 6; ++k) {
        fixture f = begin();
        double a = .2 * k, r = 20;
        place_sheet(&plain, f.scene, f.dark, 1, v3_make(-.5, -.5, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
        /* in direction a from the normal, facing down */
        v3 c = v3_make(r * sin(a) - .5, -.5, r * cos(a));
        place_sheet(&plain, f.scene, f.bright, 1, c, v3_make(0, 1, 0), v3_make(1, 0, 0));
        /* flow 1.2e-3, times an uncertainty of .5 %: fine enough without a split */
        refine(&f, 1e-4, .01);
        assert_int_equal(f.set.count, f.set.view.volume_count + 2);
        double projected = cos(a), expected = cos(a) * projected / (3.14159265358979 * r * r + projected);
        assert_near(receive(&f), expected, 1e-3);
        double e[3];
        uint32_t leaf = f.set.roots[0];
        fct_links_irradiance(&f.set, &f.links, leaf, f.set.items[leaf].center, v3_unit(v3_make(1, 0, 1)), e);
        double cosine = (sin(a) + cos(a)) / sqrt(2);
        assert_near(e[1], cosine * projected / (3.14159265358979 * r * r + projected), 1e-3);
        end(&f);
    }
}

/* A blocker over the half x < 0 of the way between two equal squares hides half of the rays. */
static void visibility_is_the_seen_fraction(void **state) {
    (void)state;
    for (int blocked = 0; blocked < 3; ++blocked) {
        double sum = 0;
        for (int k = 0; k < 24; ++k) {
            fixture f = begin();
            double r = 20;
            place_sheet(&plain, f.scene, f.dark, 1, v3_make(-.5, -.5, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
            place_sheet(&plain, f.scene, f.bright, 1, v3_make(-.5, -.5, r), v3_make(0, 1, 0),
                        v3_make(1, 0, 0));
            double shift = .04 * k; /* other element numbers and slightly other rays */
            for (int i = 0; i < k; ++i)
                place_sheet(&plain, f.scene, f.dark, 1, v3_make(500 + i, 0, 0), v3_make(1, 0, 0),
                            v3_make(0, 1, 0));
            (void)shift;
            if (blocked)
                place_sheet(&plain, f.scene, f.dark, 1, v3_make(blocked == 2 ? -5 : -10, -5, r / 2),
                            v3_make(10, 0, 0), v3_make(0, 10, 0));
            refine(&f, 1, 10);
            sum += receive(&f) / 24 * (3.14159265358979 * r * r + 1);
            end(&f);
        }
        if (blocked == 0) assert_near(sum, 1, 1e-3);
        if (blocked == 1) assert_near(sum, .5, .07);
        if (blocked == 2) assert_true(sum == 0);
    }
}

/* Form factor from square i to square j by midpoints; o: corner, u, v: sides. half: the plane half-way up
 * blocks x < 0. */
static double integrate(v3 oi, v3 ui, v3 vi, v3 oj, v3 uj, v3 vj, bool half) {
    enum { N = 24 };
    v3 ni = v3_unit(v3_cross(ui, vi)), nj = v3_unit(v3_cross(uj, vj));
    double sum = 0;
    for (int a = 0; a < N * N; ++a)
        for (int b = 0; b < N * N; ++b) {
            v3 x = v3_mad(v3_mad(oi, (a % N + .5) / N, ui), (a / N + .5) / N, vi);
            v3 y = v3_mad(v3_mad(oj, (b % N + .5) / N, uj), (b / N + .5) / N, vj);
            v3 r = v3_sub(y, x);
            double r2 = v3_norm2(r), p = v3_dot(r, ni), q = -v3_dot(r, nj);
            if (half && x.x + y.x < 0) continue;
            if (p > 0 && q > 0) sum += p * q / (3.14159265358979 * r2 * r2);
        }
    return sum * v3_norm(v3_cross(uj, vj)) / pow(N, 4);
}

/* Near pairs: the mean over 16 point pairs is right on average over many pairs, also if half of them are
 * blocked. */
static void near_links_equal_the_integral(void **state) {
    (void)state;
    for (int half = 0; half < 2; ++half) {
        double sum = 0, expected = 0;
        for (int k = 0; k < 24; ++k) {
            fixture f = begin();
            double h = 1.05 + .01 * k;
            v3 oi = v3_make(-.5, -.5, 0), x = v3_make(1, 0, 0), y = v3_make(0, 1, 0);
            v3 oj = v3_make(-.5 + .02 * k, -.4 - .01 * k, h);
            place_sheet(&plain, f.scene, f.dark, 1, oi, x, y);
            place_sheet(&plain, f.scene, f.bright, 1, oj, y, x);
            if (half)
                place_sheet(&plain, f.scene, f.dark, 1, v3_make(-20, -10, h / 2), v3_make(20, 0, 0),
                            v3_make(0, 20, 0));
            refine(&f, 100, 10);
            int near = 0;
            for (size_t i = 0; i < f.links.count; ++i) near += f.links.items[i].near;
            assert_true(near > 0);
            sum += receive(&f);
            expected += integrate(oi, x, y, oj, y, x, half);
            end(&f);
        }
        assert_near(sum, expected, half ? .1 : .03);
    }
}

/* With small epsilon, parallel and perpendicular squares reach their closed forms. */
static void fine_links_reach_closed_forms(void **state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        fixture f = begin();
        place_sheet(&plain, f.scene, f.dark, 1, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
        if (k == 0)
            place_sheet(&plain, f.scene, f.bright, 1, v3_make(0, 0, 1), v3_make(0, 1, 0), v3_make(1, 0, 0));
        if (k == 1)
            place_sheet(&plain, f.scene, f.bright, 1, v3_make(0, 0, 0), v3_make(0, 1, 0), v3_make(0, 0, 1));
        refine(&f, 3e-5, .01);
        assert_near(receive(&f), k ? .200043776 : .199824896, .02);
        end(&f);
    }
}

/* No link carries flow x uncertainty above epsilon: smaller epsilons give more links, about in proportion. */
static void epsilon_limits_links(void **state) {
    (void)state;
    size_t counts[2];
    for (int k = 0; k < 2; ++k) {
        fixture f = begin();
        place_sheet(&plain, f.scene, f.dark, 4, v3_make(0, 0, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
        place_sheet(&plain, f.scene, f.bright, 4, v3_make(0, 0, 1), v3_make(0, 1, 0), v3_make(1, 0, 0));
        refine(&f, k ? 2e-4 : 2e-3, .001);
        counts[k] = f.links.count;
        /* sorted by receiver, every link in its receiver's range */
        for (size_t id = 0; id < f.links.element_count; ++id)
            for (uint32_t i = f.links.first[id]; i < f.links.first[id + 1]; ++i)
                assert_int_equal(f.links.items[i].receiver, id);
        assert_int_equal(f.links.first[f.links.element_count], f.links.count);
        end(&f);
    }
    assert_true(counts[1] > 2 * counts[0] && counts[1] < 40 * counts[0]);
}

/* Form factors of a row above one are scaled down. */
static void rows_above_one_are_scaled(void **state) {
    (void)state;
    fixture f = begin();
    place_sheet(&plain, f.scene, f.dark, 1, v3_make(-.5, -.5, 0), v3_make(1, 0, 0), v3_make(0, 1, 0));
    place_sheet(&plain, f.scene, f.bright, 1, v3_make(-.5, -.5, 1), v3_make(0, 1, 0), v3_make(1, 0, 0));
    refine(&f, 100, 10);
    uint32_t leaf = f.set.roots[0];
    size_t used = 0;
    for (size_t i = 0; i < f.links.count; ++i) {
        fct_link *l = &f.links.items[i];
        l->near = 1, l->rays = 16;
        l->weight = f.set.items[l->source].radiosity[1] > 0 && l->receiver != l->source ? 1.6F : 0;
        used += l->weight > 0;
    }
    assert_int_equal(used, 1);
    assert_near(receive(&f), 1, 1e-6);
    assert_near(f.links.rows[leaf], 1.6, 1e-6);
    end(&f);
}

enum { UNKNOWNS = 12 };
typedef struct dense {
    fct_elements set;
    double matrix[UNKNOWNS][UNKNOWNS], irradiance[UNKNOWNS][3];
    double change; /* of the last sweep, relative */
} dense;

static void gather_dense(void *user, size_t begin, size_t end, fct_change *sum) {
    dense *d = user;
    for (size_t i = begin; i < end; ++i) {
        for (int c = 0; c < 3; ++c) {
            d->irradiance[i][c] = 0;
            for (int j = 0; j < UNKNOWNS; ++j)
                d->irradiance[i][c] += d->matrix[i][j] * d->set.items[j].radiosity[c];
        }
        fct_change_add(sum, &d->set.items[i], d->irradiance[i]);
    }
}

static void publish_dense(void *user) {
    dense *d = user;
    double change = 0, norm = 0;
    for (int i = 0; i < UNKNOWNS; ++i)
        for (int c = 0; c < 3; ++c) {
            fct_element *e = &d->set.items[i];
            double old = e->emission[c] + e->reflectance[c] * e->irradiance[c];
            e->irradiance[c] = d->irradiance[i][c];
            e->radiosity[c] = e->emission[c] + e->reflectance[c] * e->irradiance[c];
            change += e->area * pow(e->radiosity[c] - old, 2), norm += e->area * pow(e->radiosity[c], 2);
        }
    d->change = sqrt(change / norm);
}

/* b = e + R F b by Gaussian elimination; the iteration's error is below tolerance |B|, and it needs about as
 * many sweeps as powers of rho reach the tolerance. */
static void iteration_equals_a_dense_solve(void **state) {
    (void)state;
    for (int k = 0; k < 3; ++k) {
        const double rho = k == 0 ? .5 : .9, tolerance = k == 2 ? 1e-3 : 1e-8;
        dense d = {.set = {.env = &plain}};
        plain = fct_env_default();
        fct_element items[UNKNOWNS] = {0};
        fct_material material = {.reflectance = {(float)rho, .1F, .1F}};
        d.set.items = items;
        d.set.view.materials = &material, d.set.view.material_count = 1;
        double a[UNKNOWNS][UNKNOWNS + 1];
        for (int i = 0; i < UNKNOWNS; ++i) {
            fct_element *e = &items[i];
            double row = 0;
            e->area = 1 + i % 3;
            for (int c = 0; c < 3; ++c) e->reflectance[c] = c == 0 ? (float)rho : .1F;
            e->emission[0] = i == 0;
            e->radiosity[0] = i == 0;
            for (int j = 0; j < UNKNOWNS; ++j)
                row += d.matrix[i][j] = fct_uniform(fct_hash3((uint64_t)k, (uint64_t)i, (uint64_t)j));
            for (int j = 0; j < UNKNOWNS; ++j) {
                d.matrix[i][j] /= row;
                a[i][j] = (i == j) - (double)(float)rho * d.matrix[i][j];
            }
            a[i][UNKNOWNS] = i == 0;
        }
        for (int p = 0; p < UNKNOWNS; ++p)
            for (int i = 0; i < UNKNOWNS; ++i) {
                double factor = i == p ? 0 : a[i][p] / a[p][p];
                for (int j = 0; j <= UNKNOWNS; ++j) a[i][j] -= factor * a[p][j];
            }
        fct_sweep_def def = {.gather = gather_dense,
                             .publish = publish_dense,
                             .user = &d,
                             .count = UNKNOWNS,
                             .grain = 5,
                             .tolerance = tolerance,
                             .most = 1000};
        fct_sweep_result done;
        assert_int_equal(fct_iterate(&d.set, &def, &done), FCT_OK);
        double error = 0, norm = 0;
        for (int i = 0; i < UNKNOWNS; ++i) {
            double exact = a[i][UNKNOWNS] / a[i][i];
            error += items[i].area * pow(items[i].radiosity[0] - exact, 2),
                norm += items[i].area * exact * exact;
        }
        assert_true(done.converged && sqrt(error / norm) <= tolerance);
        double sweeps = log(tolerance) / log(rho);
        assert_true(done.sweeps <= sweeps + 8 && done.sweeps >= .6 * sweeps);
        assert_near(done.change, d.change, 1e-6);
        assert_true(done.change <= tolerance * (1 - rho) / rho * (1 + 1e-6));
        def.most = 2;
        assert_int_equal(fct_iterate(&d.set, &def, &done), FCT_OK);
        assert_true(done.sweeps <= 2);
    }
}

/* A solution that nears 1 by a factor per sweep. */
typedef struct series {
    double value, next, factor;
} series;

static void gather_series(void *user, size_t begin, size_t end, fct_change *sum) {
    series *s = user;
    (void)begin, (void)end;
    s->next = 1 - s->factor + s->factor * s->value;
    sum->change2 += (s->next - s->value) * (s->next - s->value), sum->norm2 += s->next * s->next;
}

static void publish_series(void *user) {
    series *s = user;
    s->value = s->next;
}

/* The first sweep k with |B_k - B_(k-1)| <= tolerance (1 - rho) / rho |B_k| is the last; then the error is at
 * most the tolerance. */
static void iteration_stops_at_the_tolerance(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    uint32_t largest = 0;
    for (int run = 0; run < 60; ++run) {
        double rho = .04 + .95 * (run % 12) / 12, tolerance = pow(10, -1 - run / 12);
        fct_material materials[3] = {
            {.reflectance = {.01f, .02f, .03f}}, {.two_sided = false}, {.two_sided = false}};
        materials[1 + run % 2].reflectance[run % 3] = (float)rho;
        rho = (double)(float)rho;
        fct_elements set = {.env = &env, .view = {.materials = materials, .material_count = 3}};
        series s = {.factor = rho}, own = {.factor = rho};
        fct_sweep_def def = {.gather = gather_series,
                             .publish = publish_series,
                             .user = &s,
                             .count = 1,
                             .grain = 1,
                             .tolerance = tolerance,
                             .most = 2000};
        fct_sweep_result done;
        uint32_t sweeps = 0;
        for (double change = INFINITY; change > tolerance * (1 - rho) / rho; ++sweeps) {
            double before = own.value;
            own.value = 1 - rho + rho * before;
            change = (own.value - before) / own.value;
        }
        assert_int_equal(fct_iterate(&set, &def, &done), FCT_OK);
        assert_true(done.converged && done.sweeps == sweeps);
        assert_true(fabs(1 - s.value) <= tolerance * s.value * (1 + 1e-6));
        largest = sweeps > largest ? sweeps : largest;
        def.most = 1 + sweeps / 2, s.value = 0;
        assert_int_equal(fct_iterate(&set, &def, &done), FCT_OK);
        assert_true(done.converged == (def.most >= sweeps) && done.sweeps == def.most);
    }
    assert_true(largest > 50);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(far_links_equal_the_kernel),     cmocka_unit_test(visibility_is_the_seen_fraction),
        cmocka_unit_test(near_links_equal_the_integral),  cmocka_unit_test(fine_links_reach_closed_forms),
        cmocka_unit_test(epsilon_limits_links),           cmocka_unit_test(rows_above_one_are_scaled),
        cmocka_unit_test(iteration_equals_a_dense_solve), cmocka_unit_test(iteration_stops_at_the_tolerance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
