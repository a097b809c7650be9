/* Traversal of the packed nodes: exact decisions at edges, prepared rays, and how many nodes it visits. */
#include "packed.h"

#include "bvh/ray/traverse.h"

/* ---- Integer rays: all sheared coordinates and edge functions are multiples of 1/16 below 2^18, so that the
 * library's float arithmetic is exact, and so is the integer arithmetic here ---- */

static int random_int(uint64_t *seed, int low, int high) {
    return low + (int)(random_next(seed) % (uint64_t)(high - low + 1));
}

/* Triangles with even integer corners; some stand along the z axis or repeat the triangle before. */
static fct_mesh make_integer_soup(const fct_env *env, uint32_t count, uint64_t seed) {
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(env, 3 * count, count, 0, &mesh), FCT_OK);
    for (uint32_t i = 0; i < 3 * count; ++i) {
        mesh.triangles[i] = i;
        for (int k = 0; k < 3; ++k) {
            bool near = i % 3 > 0;
            float from = near ? mesh.positions[3 * (i - i % 3) + (uint32_t)k] : 0;
            mesh.positions[3 * i + (uint32_t)k] =
                from + 2.0f * (float)random_int(&seed, near ? -4 : -10, near ? 4 : 10);
        }
    }
    for (uint32_t f = 7; f < count; f += 9) memcpy(mesh.positions + 9 * f, mesh.positions + 9 * (f - 1), 36);
    return mesh;
}

typedef struct exact_hit {
    double t, u, v;
    bool hit;
} exact_hit;

/* Woop's test in integers: the direction's largest component has size 4. */
static exact_hit meet_exactly(const fct_mesh *mesh, uint32_t face, const int o[3], const int d[3], int z) {
    int x = (z + 1) % 3, y = (z + 2) % 3;
    int64_t sx[3], sy[3], sz[3];
    for (int c = 0; c < 3; ++c) {
        const float *p = mesh->positions + 3 * (size_t)mesh->triangles[3 * face + (uint32_t)c];
        int64_t along = (int64_t)p[z] - o[z];
        sx[c] = 4 * ((int64_t)p[x] - o[x]) - 4 * d[x] / d[z] * along;
        sy[c] = 4 * ((int64_t)p[y] - o[y]) - 4 * d[y] / d[z] * along;
        sz[c] = along * (d[z] > 0 ? 1 : -1); /* 4 t */
    }
    int64_t w[3];
    for (int c = 0; c < 3; ++c) {
        int i = (c + 1) % 3, j = (c + 2) % 3;
        w[c] = sx[i] * sy[j] - sy[i] * sx[j];
    }
    int64_t det = w[0] + w[1] + w[2];
    bool mixed = (w[0] < 0 || w[1] < 0 || w[2] < 0) && (w[0] > 0 || w[1] > 0 || w[2] > 0);
    exact_hit out = {.hit = !mixed && det != 0};
    if (!out.hit) return out;
    out.t = (double)(w[0] * sz[0] + w[1] * sz[1] + w[2] * sz[2]) / (4.0 * (double)det);
    out.u = (double)w[1] / (double)det, out.v = (double)w[2] / (double)det;
    return out;
}

/* Half of the rays pass exactly through a corner or the middle of a side. */
static void edges_decide_exactly(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_integer_soup(&env, 260, 3);
    model m = model_make(&env, mesh, FCT_BACKEND_OBB);
    uint64_t seed = 5;
    size_t hits = 0, rims = 0, limited = 0;
    for (int i = 0; i < 12000; ++i) {
        int d[3], o[3], z = random_int(&seed, 0, 2);
        for (int k = 0; k < 3; ++k) d[k] = random_int(&seed, -3, 3) * (i % 3 > 0);
        d[z] = random_next(&seed) & 1 ? 4 : -4;
        for (int k = 0; k < 3; ++k) o[k] = random_int(&seed, -24, 24);
        if (i % 2) {
            const float *p = mesh.positions + 9 * (random_next(&seed) % mesh.face_count);
            int from = random_int(&seed, 0, 2), to = random_int(&seed, 0, 2), steps = random_int(&seed, 0, 5);
            for (int k = 0; k < 3; ++k) o[k] = (int)(p[3 * from + k] + p[3 * to + k]) / 2 - steps * d[k];
        }
        double t_min = i % 5 == 0 ? 1 : 0, t_max = i % 7 == 0 ? 3 : INFINITY, nearest = INFINITY;
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            exact_hit e = meet_exactly(&mesh, f, o, d, z);
            if (!e.hit || e.t < t_min || e.t > t_max) continue;
            rims += e.u == 0 || e.v == 0 || e.u + e.v == 1;
            nearest = fmin(nearest, e.t);
        }
        fct_ray ray = make_ray(v3_make(o[0], o[1], o[2]), v3_make(d[0], d[1], d[2]), t_min, t_max);
        fct_hit hit;
        bool found = fct_bvh_closest_hit(m.bvh, &ray, &hit, NULL);
        assert_int_equal(found, nearest < INFINITY);
        assert_int_equal(fct_bvh_any_hit(m.bvh, &ray, NULL), found);
        if (!found) continue;
        ++hits;
        limited += nearest == t_min || nearest == t_max;
        exact_hit e = meet_exactly(&mesh, hit.face, o, d, z);
        double near = 2e-7 * (1 + nearest);
        assert_true(e.hit && fabs(e.t - nearest) <= near && fabs((double)hit.t - nearest) <= near);
        assert_true(fabs((double)hit.u - e.u) < 2e-7 && fabs((double)hit.v - e.v) < 2e-7);
        /* Two equal triangles: the one of the lower id. */
        assert_true(hit.face % 9 != 7);
        v3 p[3];
        face_corners(&mesh, hit.face, p);
        v3 normal = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        assert_true(v3_norm(v3_sub(normal, v3_load(hit.normal))) < 1e-6 * v3_norm(normal));
    }
    assert_true(hits > 4000 && rims > 4000 && limited > 50);
    model_release(&env, &m);
}

/* ---- Prepared rays ---- */

static void prepared_rays_are_the_same_rays(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh mesh = make_pebble(&env, 10, 3);
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; ++i)
        mesh.positions[i] = 100 * mesh.positions[i] + 30.0f * (float)(i % 3);
    model m = model_make(&env, mesh, FCT_BACKEND_OBB);
    const fct_bvh *bvh = m.bvh;
    uint64_t seed = 9;
    size_t moved = 0, prepared = 0;
    for (int i = 0; i < 4000; ++i) {
        double far = i % 2 ? exp2(20 * random_unit(&seed)) : 1;
        v3 aim = v3_add(v3_make(0, 30, 60), v3_scale(random_direction(&seed), 60 * random_unit(&seed)));
        v3 origin = v3_mad(aim, 150 * far, random_direction(&seed));
        v3 d = v3_scale(v3_sub(aim, origin), exp2(floor(40 * random_unit(&seed)) - 20) / far);
        fct_ray ray = make_ray(origin, d, i % 3 ? 0 : -INFINITY, i % 5 ? INFINITY : 2e3 / v3_norm(d) * far);
        fct_prepared_ray r;
        if (!fct_ray_prepare(bvh, &ray, &r)) continue;
        ++prepared, moved += r.moved;
        /* The caller's point at t is the prepared point at t', in the scaled unit. */
        for (int k = 0; k < 2; ++k) {
            double at = 2 * random_unit(&seed), t = (r.shift + at) * r.factor;
            v3 ours = v3_mad(v3_load(r.origin), at, v3_load(r.direction));
            v3 theirs = v3_scale(v3_mad(v3_load(ray.origin), t, v3_load(ray.direction)), bvh->scale);
            assert_true(v3_norm(v3_sub(ours, theirs)) < 2e-6 + 1e-12 * far);
        }
        double largest = 0;
        for (int k = 0; k < 3; ++k) {
            double c = (double)r.direction[k];
            largest = fmax(largest, fabs(c));
            assert_true(fabs(c * (double)r.inverse[k] - 1) < 1e-6);
            assert_int_equal(r.side[k], c < 0);
            assert_true(fabs((double)r.origin[k] - (double)bvh->center[k]) <= 4);
            assert_int_equal(r.axis[k], (r.axis[2] + 1 + (uint32_t)k) % 3);
        }
        double z = (double)r.direction[r.axis[2]];
        assert_true(largest >= 1 && largest < 2 && fabs(z) == largest);
        assert_true(fabs((double)r.shear[0] * z - (double)r.direction[r.axis[0]]) < 1e-6);
        assert_true(fabs((double)r.shear[1] * z - (double)r.direction[r.axis[1]]) < 1e-6);
        assert_true(fabs((double)r.shear[2] * z - 1) < 1e-6);
        assert_true(r.t_min >= 0);
        if (isfinite(ray.t_max))
            assert_true(fabs((r.shift + (double)r.t_max) * r.factor / (double)ray.t_max - 1) < 1e-5);
        if (r.moved) { /* the origin is on the widened bounds */
            double off = INFINITY;
            for (int k = 0; k < 3; ++k)
                off = fmin(off, fmin(fabs((double)r.origin[k] - (double)bvh->lower[k]),
                                     fabs((double)r.origin[k] - (double)bvh->upper[k])));
            assert_true(off < 1e-5);
        }
        float t = (float)(.5 * r.factor);
        assert_true(
            fabs((double)fct_ray_clamp_t(&ray, fct_ray_unscale_t(&r, (float)(.5 - r.shift))) / (double)t -
                 1) < 1e-4 * far ||
            t < ray.t_min || t > ray.t_max);
    }
    assert_true(prepared > 2000 && moved > 1000);
    model_release(&env, &m);
}

/* ---- Visits ---- */

/* No traversal can avoid the boxes that a ray enters before its hit. Ours visits few others. */
static void traversal_visits_little_more_than_it_must(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    fct_mesh meshes[3] = {make_pebble(&env, 40, 6), make_bars(&env, 40, 3), make_soup(&env, 4000, 8)};
    for (int k = 0; k < 3; ++k) {
        model m = model_make(&env, meshes[k], FCT_BACKEND_OBB);
        fct_visits must = {0}, visited = {0};
        uint64_t seed = 21, any_nodes = 0;
        size_t hits = 0;
        for (int i = 0; i < 2000; ++i) {
            v3 aim = {random_unit(&seed), random_unit(&seed), random_unit(&seed)};
            if (k == 0) aim = v3_scale(random_direction(&seed), random_unit(&seed));
            v3 origin = v3_mad(aim, 3, random_direction(&seed));
            fct_ray ray = make_ray(origin, v3_sub(aim, origin), 0, INFINITY);
            fct_prepared_ray r;
            fct_raw_hit hit;
            if (!fct_ray_prepare(m.bvh, &ray, &r)) continue;
            fct_visits least = {0}, most = {0}, ours = {0}, any = {0};
            v3 o = v3_load(r.origin), d = v3_load(r.direction);
            bool found = fct_traverse_closest(m.bvh, &r, &hit, &ours);
            double t = found ? (double)hit.t : INFINITY;
            count_entered(m.bvh, m.bvh->root, o, d, (double)r.t_min, t * (1 - 1e-4) - 1e-4, &least);
            assert_true(ours.nodes >= least.nodes && ours.triangles >= least.triangles);
            assert_int_equal(ours.boxes, 8 * ours.nodes);
            fct_traverse_any(m.bvh, &r, &any);
            if (!found) { /* a miss visits each box on its way, and an occlusion test does the same */
                count_entered(m.bvh, m.bvh->root, o, d, (double)r.t_min - 1e-5, INFINITY, &most);
                assert_true(ours.nodes <= most.nodes + 1);
                assert_int_equal(any.nodes, ours.nodes);
                continue;
            }
            ++hits;
            assert_true(any.nodes <= ours.nodes);
            must.nodes += least.nodes, must.triangles += least.triangles;
            visited.nodes += ours.nodes, visited.triangles += ours.triangles;
            any_nodes += any.nodes;
        }
        /* Measured, pebble, bars, soup: 1.01, 1.42, 1.02 times the nodes and 1.07, -, 1.04 times the
         * triangles; few boxes of bars must be visited. The search for any hit visits .71, .95, .77 of them.
         */
        static const double most_nodes[3] = {1.05, 1.5, 1.05}, most_any[3] = {.74, .98, .8};
        assert_true(hits > 600);
        assert_true((double)visited.nodes < most_nodes[k] * (double)must.nodes);
        if (k != 1) assert_true((double)visited.triangles < 1.1 * (double)must.triangles);
        assert_true((double)any_nodes < most_any[k] * (double)visited.nodes);
        model_release(&env, &m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edges_decide_exactly),
        cmocka_unit_test(prepared_rays_are_the_same_rays),
        cmocka_unit_test(traversal_visits_little_more_than_it_must),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
