/* Elements against direct sums over their triangles in plain double, and their points against the surface. */
#include "../place.h"
#include "radiosity/solve/element.h"

static fct_env plain; /* outlives every scene */

static const float turned[12] = {0, -2, 0, 1, 2, 0, 0, 2, 0, 0, 2, 3};
static const float mirrored[12] = {-1.5F, 0, 0, 4, 0, 1.5F, 0, 0, 0, 0, 1.5F, 0};
static const float sheared[12] = {1, .5F, 0, 0, 0, 2, 0, -3, 0, .25F, .5F, 0};
static const float sheared_mirrored[12] = {-1, .5F, 0, 0, 0, 2, 0, 3, 0, .25F, .5F, 9};

/* Bumpy bodies under these transforms, most of them two-sided, and one small square, which is the last
 * instance. */
static fct_scene *make_scene(bool sheared_too) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    fct_mesh mesh = make_bumpy(&plain, 6, .2);
    uint32_t two = place_material(scene, .5, 1, true), one = place_material(scene, .25, 0, false);
    place_mesh(scene, &mesh, two, turned), place_mesh(scene, &mesh, two, mirrored);
    if (sheared_too) place_mesh(scene, &mesh, two, sheared), place_mesh(scene, &mesh, one, sheared_mirrored);
    place_sheet(&plain, scene, one, 1, v3_make(20, 0, 0), v3_make(2, 0, 0), v3_make(0, 1, 0));
    fct_mesh_release(&plain, &mesh);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static fct_elements open_all(const fct_scene *scene, double min_edge) {
    fct_elements set;
    assert_int_equal(fct_elements_create(&plain, scene, min_edge, &set), FCT_OK);
    for (size_t id = 0; id < set.count; ++id)
        if (fct_elements_can_split(&set, (uint32_t)id))
            assert_int_equal(fct_elements_split(&set, (uint32_t)id), FCT_OK);
    return set;
}

/* World corners of the face at a place, wound so that the cross product points to the element's side. */
static void load(const fct_elements *set, const fct_element *e, uint32_t place, v3 p[3]) {
    const fct_instance *in = &set->view.instances[e->instance];
    fct_tree_view t = fct_tree_get(set->view.models[in->model].tree);
    for (int k = 0; k < 3; ++k) {
        const float *x = t.positions + 3 * (size_t)t.triangles[3 * place + (uint32_t)k], *m = in->to_world;
        double w[3];
        for (int r = 0; r < 3; ++r)
            w[r] = (double)m[4 * r] * x[0] + (double)m[4 * r + 1] * x[1] + (double)m[4 * r + 2] * x[2] +
                   m[4 * r + 3];
        p[k] = v3_make(w[0], w[1], w[2]);
    }
    if (in->mirrored != (e->back != 0)) {
        v3 swap = p[1];
        p[1] = p[2], p[2] = swap;
    }
}

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static void assert_same(v3 a, v3 b, double tolerance) {
    if (!(v3_norm(v3_sub(a, b)) <= tolerance))
        fail_msg("(%g %g %g), expected (%g %g %g)", a.x, a.y, a.z, b.x, b.y, b.z);
}

static void sums_equal_direct_sums(void **state) {
    (void)state;
    fct_scene *scene = make_scene(true);
    fct_elements set = open_all(scene, 100);
    int clusters = 0, backs = 0;
    for (size_t id = set.view.volume_count; id < set.count; ++id) {
        const fct_element *e = &set.items[id];
        double area = 0, moment[6] = {0}, farthest = 0, turn = 0;
        v3 vector = {0, 0, 0}, center = {0, 0, 0};
        for (uint32_t i = 0; i < set.ranges[id].count; ++i) {
            v3 p[3];
            load(&set, e, set.ranges[id].first + i, p);
            v3 s = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5);
            double a = v3_norm(s), n[3] = {s.x / a, s.y / a, s.z / a};
            area += a, vector = v3_add(vector, s);
            center = v3_add(center, v3_scale(v3_add(v3_add(p[0], p[1]), p[2]), a / 3));
            for (int r = 0, k = 0; r < 3; ++r)
                for (int c = r; c < 3; ++c, ++k) moment[k] += a * n[r] * n[c];
            for (int k = 0; k < 3; ++k) farthest = fmax(farthest, v3_norm(v3_sub(p[k], e->center)));
            turn = fmax(turn, acos(fmin(1, v3_dot(v3_unit(s), v3_unit(e->vector)))));
        }
        assert_near(e->area, area, 1e-5 * area);
        assert_same(e->vector, vector, 1e-5 * area);
        assert_same(e->center, v3_scale(center, 1 / area), 1e-5 * (1 + v3_norm(e->center)));
        for (int k = 0; k < 6; ++k) assert_near(e->moment[k], moment[k], 1e-5 * area);
        assert_true(e->radius >= farthest * (1 - 1e-5));
        /* a box and the way to its centre, stretched by at most the Frobenius norm */
        assert_true(e->radius <= 4.5 * farthest);
        if (e->cone < 1.57) assert_true(turn <= e->cone + 1e-3);
        for (int k = 0; k < 3; ++k) {
            assert_near(e->radiosity[k], e->emission[k], 1e-6);
            assert_same(e->power[k], v3_scale(e->vector, e->emission[k]), 1e-5 * area);
        }
        clusters += e->kind == FCT_ELEMENT_CLUSTER, backs += e->back;
    }
    assert_true(clusters > 100 && backs > 100);
    const fct_element *root = &set.items[0];
    double area = 0;
    v3 vector = {0, 0, 0}, center = {0, 0, 0};
    for (size_t id = set.view.volume_count; id < set.count; ++id) {
        const fct_element *e = &set.items[id];
        if (e->child_count) continue;
        area += e->area, vector = v3_add(vector, e->vector),
                         center = v3_add(center, v3_scale(e->center, e->area));
        assert_true(v3_norm(v3_sub(e->center, root->center)) + e->radius <= root->radius * (1 + 1e-6));
    }
    assert_near(root->area, area, 1e-5 * area);
    assert_same(root->vector, vector, 1e-4 * area);
    assert_same(root->center, v3_scale(center, 1 / area), 1e-4);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

static void quarters_tile_their_triangle(void **state) {
    (void)state;
    fct_scene *scene = make_scene(true);
    fct_elements set = open_all(scene, .3);
    int quartered = 0;
    for (size_t id = 0; id < set.count; ++id) {
        const fct_element *e = &set.items[id];
        if (e->kind != FCT_ELEMENT_TRIANGLE) continue;
        const float *q = set.corners + 9 * (size_t)e->triangle;
        double longest = 0;
        for (int k = 0; k < 3; ++k)
            longest = fmax(longest, v3_norm(v3_sub(v3_load(q + 3 * k), v3_load(q + 3 * ((k + 1) % 3)))));
        assert_int_equal(e->child_count, longest > .3 ? 4 : 0);
        if (!e->child_count) continue;
        ++quartered;
        v3 center = {0, 0, 0};
        for (uint32_t c = e->child; c < e->child + 4; ++c) {
            assert_int_equal(set.items[c].parent, id);
            assert_near(set.items[c].area, e->area / 4, 1e-4 * e->area);
            assert_same(set.items[c].vector, v3_scale(e->vector, .25), 1e-4 * e->area);
            center = v3_add(center, v3_scale(set.items[c].center, .25));
        }
        assert_same(center, e->center, 1e-5 * (1 + v3_norm(e->center)));
    }
    assert_true(quartered > 50);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* Under similarities (under other transforms, points follow the areas of the model). Stratified fractions:
 * the mean of the points is the centroid, a child gets its share of the area, normals are those of the faces,
 * and locate finds the leaf below the element. */
static void samples_follow_the_area(void **state) {
    (void)state;
    fct_scene *scene = make_scene(false);
    fct_elements set = open_all(scene, .5);
    enum { N = 4096 };
    int tested = 0;
    for (uint32_t id = 0; id < set.count; id += id < 30 ? 1 : 97) {
        const fct_element *e = &set.items[id];
        v3 mean = {0, 0, 0}, normal = {0, 0, 0};
        double in_first = 0;
        for (uint32_t k = 0; k < N; ++k) {
            double u[2];
            fct_element_point p;
            fct_plane_point(k, 7, u);
            fct_element_sample(&set, id, (k + .5) / N, u[0], u[1], &p);
            mean = v3_mad(mean, 1. / N, v3_load(p.position));
            normal = v3_mad(normal, 1. / N, v3_load(p.normal));
            assert_near(v3_norm(v3_load(p.normal)), 1, 1e-5);
            assert_true(p.offset > 0 && p.offset < .01);
            if (e->kind == FCT_ELEMENT_VOLUME || k % 16) continue;
            uint32_t leaf =
                fct_elements_locate_point(&set, e->instance, e->back, p.place, v3_load(p.position));
            uint32_t up = leaf;
            /* (u, v) of a quarter are its own: only whole triangles are located */
            if (e->kind == FCT_ELEMENT_TRIANGLE && set.items[e->parent].kind == FCT_ELEMENT_TRIANGLE)
                continue;
            while (up != id && up != FCT_NONE) {
                if (e->child_count && up == e->child) in_first += 16. / N;
                up = set.items[up].parent;
            }
            assert_int_equal(up, id);
        }
        double tolerance = .02 * e->radius + 1e-5;
        assert_same(mean, e->center, tolerance);
        assert_same(normal, v3_scale(e->vector, 1 / e->area), .02);
        if (e->child_count == 2 && e->kind == FCT_ELEMENT_CLUSTER)
            assert_near(in_first, set.items[e->child].area / e->area, .02), ++tested;
    }
    assert_true(tested > 10);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* A point of a leaf lies in the quarter that locate returns. */
static void leaves_contain_their_points(void **state) {
    (void)state;
    fct_scene *scene = make_scene(true);
    fct_elements set = open_all(scene, .3);
    fct_tree_view t = fct_tree_get(set.view.models[set.view.instances[4].model].tree);
    for (uint32_t place = 0; place < t.face_count; ++place)
        for (int k = 0; k < 200; ++k) {
            double b[2];
            fct_triangle_point(fct_uniform(fct_hash2(1, (uint64_t)k)), fct_uniform(fct_hash2(2, (uint64_t)k)),
                               b);
            uint32_t leaf = fct_elements_locate(&set, 4, false, place, (float)b[0], (float)b[1]);
            const fct_element *e = &set.items[leaf];
            v3 p[3], q[3];
            load(&set, e, place, p);
            v3 x = v3_mad(v3_mad(p[0], b[0], v3_sub(p[1], p[0])), b[1], v3_sub(p[2], p[0]));
            double sum = 0;
            for (int c = 0; c < 3; ++c)
                q[c] = v3_sub(v3_load(set.corners + 9 * (size_t)e->triangle + 3 * c), x);
            for (int c = 0; c < 3; ++c) sum += .5 * v3_norm(v3_cross(q[c], q[(c + 1) % 3]));
            assert_near(sum, e->area, 1e-5);
            assert_int_equal(e->child_count, 0);
        }
    assert_int_equal(fct_elements_locate(&set, 4, true, 0, .3F, .3F), FCT_NONE);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* Sixteen points, one in each sixteenth of the area: a flat element of two triangles has eight in each. */
static void points_are_stratified(void **state) {
    (void)state;
    fct_scene *scene = make_scene(true);
    fct_elements set;
    assert_int_equal(fct_elements_create(&plain, scene, 100, &set), FCT_OK);
    fct_elements_make_points(&set);
    int first = 0;
    fct_elements_make_points(&set);
    for (uint32_t k = 0; k < FCT_ELEMENT_POINTS; ++k) {
        fct_element_point p;
        fct_element_point_at(&set, set.roots[4], k, &p);
        first += p.place == 0;
    }
    assert_int_equal(first, 8);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

static void pull_weighs_by_area(void **state) {
    (void)state;
    fct_scene *scene = make_scene(true);
    fct_elements set = open_all(scene, .7);
    for (size_t id = 0; id < set.count; ++id)
        for (int c = 0; c < 3; ++c) set.items[id].radiosity[c] = fct_uniform(fct_hash3(id, (uint64_t)c, 5));
    double *leaf = malloc(set.count * sizeof *leaf);
    for (size_t id = 0; id < set.count; ++id) leaf[id] = set.items[id].radiosity[1];
    fct_elements_pull(&set);
    for (size_t top = 0; top < set.count; top += top < 40 ? 1 : 31) {
        double flux = 0, area = 0;
        v3 power = {0, 0, 0};
        for (size_t id = 0; id < set.count; ++id) {
            uint32_t up = (uint32_t)id;
            while (up != FCT_NONE && up != top) up = set.items[up].parent;
            const fct_element *e = &set.items[id];
            if (up == FCT_NONE || e->child_count) continue;
            flux += e->area * leaf[id], area += e->area;
            power = v3_add(power, v3_scale(e->vector, leaf[id]));
        }
        assert_near(set.items[top].radiosity[1], flux / area, 1e-4);
        assert_same(set.items[top].power[1], power, 1e-4 * area);
    }
    free(leaf);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* One opened root reads its own record, the children's, and nothing else. */
static void touched_pages_are_few(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_scene *scene;
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    place_sheet(&plain, scene, place_material(scene, .5, 1, false), 60, v3_make(0, 0, 0), v3_make(1, 0, 0),
                v3_make(0, 1, 0));
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_elements set;
    assert_int_equal(fct_elements_create(&plain, scene, 1, &set), FCT_OK);
    assert_int_equal(fct_elements_touched(&set), 4096);
    assert_int_equal(fct_elements_split(&set, set.roots[0]), FCT_OK);
    assert_true(fct_elements_touched(&set) <= 4 * 4096);
    fct_elements_make_points(&set);
    for (uint32_t id = 0; id < set.count; ++id)
        for (uint32_t k = 0; k < FCT_ELEMENT_POINTS; ++k) {
            fct_element_point p;
            fct_element_point_at(&set, id, k, &p);
        }
    assert_true(fct_elements_touched(&set) >= 8 * 4096);
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* The point at fraction t of an element's area, worked out from the model's face order: under any transform
 * the shares of a surface's faces are those of the model, and those of a volume's roots are the roots' world
 * areas. Returns false if t lies on the border between two faces. */
static bool find_sample(const fct_elements *set, uint32_t id, double t, double a, double b,
                        fct_element_point *out) {
    const fct_element *e = &set->items[id];
    while (e->kind == FCT_ELEMENT_VOLUME) {
        double sum = 0, before = 0;
        for (uint32_t k = 0; k < e->child_count; ++k) sum += set->items[e->child + k].area;
        uint32_t k = 0;
        while (k + 1 < e->child_count && before + set->items[e->child + k].area <= t * sum)
            before += set->items[e->child + k++].area;
        t = (t * sum - before) / set->items[e->child + k].area;
        if (t < 1e-4 || t > 1 - 1e-4) return false;
        e = &set->items[e->child + k];
    }
    const fct_instance *in = &set->view.instances[e->instance];
    fct_tree_view tree = fct_tree_get(set->view.models[in->model].tree);
    fct_element_range r = set->ranges[e - set->items];
    double sum = 0, before = 0;
    for (int pass = 0; pass < 2; ++pass)
        for (uint32_t place = r.first; place < r.first + r.count; ++place) {
            const uint32_t *c = tree.triangles + 3 * (size_t)place;
            v3 x[3];
            for (int k = 0; k < 3; ++k) x[k] = v3_load(tree.positions + 3 * (size_t)c[k]);
            double area = v3_norm(v3_cross(v3_sub(x[1], x[0]), v3_sub(x[2], x[0])));
            if (pass == 0) {
                sum += area;
            } else if (r.count == 1 || before + area > t * sum) {
                if (r.count > 1 && (t * sum < before + 1e-5 * sum || t * sum > before + area - 1e-5 * sum))
                    return false;
                out->place = place;
                break;
            } else {
                before += area;
            }
        }
    v3 p[3];
    load(set, e, out->place, p);
    bool turn = in->mirrored != (e->back != 0); /* load has exchanged corners 1 and 2 */
    if (e->kind == FCT_ELEMENT_TRIANGLE)
        for (int k = 0; k < 3; ++k)
            p[k] = v3_load(set->corners + 9 * (size_t)e->triangle + 3 * (turn && k ? 3 - k : k));
    double v = b * sqrt(a), u = sqrt(a) - v;
    v3 first = v3_sub(p[turn ? 2 : 1], p[0]), second = v3_sub(p[turn ? 1 : 2], p[0]);
    v3 x = v3_mad(v3_mad(p[0], u, first), v, second), s = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    v3_store(out->position, x), v3_store(out->normal, v3_unit(s));
    out->offset = (float)(1e-4 * sqrt(v3_norm(s)) + 2e-7 * fmax(fabs(x.x), fmax(fabs(x.y), fabs(x.z))));
    return true;
}

static void samples_equal_the_face_at_their_fraction(void **state) {
    (void)state;
    fct_scene *scene = make_scene(true);
    fct_elements set = open_all(scene, .5);
    size_t tested = 0;
    for (uint32_t id = 0; id < set.count; ++id)
        for (uint64_t k = 0; k < 12; ++k) {
            double t = fct_uniform(fct_hash3(id, k, 0)), a = fct_uniform(fct_hash3(id, k, 1)),
                   b = fct_uniform(fct_hash3(id, k, 2));
            fct_element_point p, q = {.place = FCT_NONE};
            if (!find_sample(&set, id, t, a, b, &q)) continue;
            fct_element_sample(&set, id, t, a, b, &p);
            assert_int_equal(p.place, q.place);
            assert_same(v3_load(p.position), v3_load(q.position), 2e-6 * (1 + v3_norm(v3_load(q.position))));
            assert_same(v3_load(p.normal), v3_load(q.normal), 1e-4);
            assert_near(p.offset, q.offset, 1e-4 * q.offset);
            ++tested;
        }
    assert_true(tested > 10 * set.count);
    /* The points are those of the sixteenths. */
    fct_elements_make_points(&set);
    for (uint32_t id = 0; id < set.count; id += 3)
        for (uint32_t k = 0; k < FCT_ELEMENT_POINTS; ++k) {
            fct_element_point p;
            fct_element_point_at(&set, id, k, &p);
            uint32_t last = 0, first = FCT_NONE;
            for (int i = 0; i <= 40; ++i) {
                fct_element_point q;
                fct_element_sample(&set, id, fmin((k + i / 40.) / 16, 1 - 1e-9), .5, .5, &q);
                if (set.items[id].kind == FCT_ELEMENT_VOLUME) continue;
                first = q.place < first ? q.place : first, last = q.place > last ? q.place : last;
            }
            assert_true(first == FCT_NONE || (p.place >= first && p.place <= last));
        }
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* Children start with their parent's light. Radii bound the boxes: the way to the centre of the box and its
 * half diagonal, stretched by the scale or by the Frobenius norm. */
static void children_inherit_light(void **state) {
    (void)state;
    fct_scene *scene = make_scene(true);
    fct_elements set;
    assert_int_equal(fct_elements_create(&plain, scene, .3, &set), FCT_OK);
    for (size_t id = 0; id < set.count; ++id) {
        fct_element *e = &set.items[id];
        for (uint64_t c = 0; c < 3; ++c) {
            e->radiosity[c] = fct_uniform(fct_hash3(id, c, 1)),
            e->irradiance[c] = fct_uniform(fct_hash3(id, c, 2));
            e->power[c] = v3_make(1, 2, 3);
        }
        if (!fct_elements_can_split(&set, (uint32_t)id)) continue;
        assert_int_equal(fct_elements_split(&set, (uint32_t)id), FCT_OK);
        e = &set.items[id];
        assert_false(fct_elements_can_split(&set, (uint32_t)id));
        for (uint32_t k = e->child; k < e->child + e->child_count; ++k) {
            const fct_element *child = &set.items[k];
            assert_true(child->parent == id && child->child_count == 0 && child->back == e->back);
            assert_true(child->instance == e->instance);
            for (int c = 0; c < 3; ++c) {
                assert_near(child->radiosity[c], e->radiosity[c], 0);
                assert_near(child->irradiance[c], e->irradiance[c], 0);
                assert_same(child->power[c], v3_scale(child->vector, e->radiosity[c]), 1e-12);
                assert_true(child->reflectance[c] == e->reflectance[c] &&
                            child->emission[c] == e->emission[c]);
            }
        }
    }
    for (size_t id = set.view.volume_count; id < set.count; ++id) {
        const fct_element *e = &set.items[id];
        const fct_instance *in = &set.view.instances[e->instance];
        const fct_tree *tree = set.view.models[in->model].tree;
        fct_cluster c;
        double radius = 0;
        if (e->kind == FCT_ELEMENT_TRIANGLE) {
            for (int k = 0; k < 3; ++k)
                radius =
                    fmax(radius,
                         v3_norm(v3_sub(v3_load(set.corners + 9 * (size_t)e->triangle + 3 * k), e->center)));
        } else {
            assert_int_equal(fct_tree_cluster(tree, e->node, &c), FCT_OK);
            double middle[3], frobenius = 0, x[3] = {e->center.x, e->center.y, e->center.z}, way = 0;
            for (int r = 0; r < 3; ++r) {
                middle[r] = in->to_world[4 * r + 3];
                for (int k = 0; k < 3; ++k) {
                    middle[r] += (double)in->to_world[4 * r + k] * c.box_center[k];
                    frobenius += pow(in->to_world[4 * r + k], 2);
                }
                way += pow(middle[r] - x[r], 2);
            }
            radius = sqrt(way) +
                     v3_norm(v3_load(c.box_half)) * sqrt(in->uniform_scale > 0 ? frobenius / 3 : frobenius);
            assert_near(e->cone, in->uniform_scale > 0 ? c.cone_angle : FCT_PI, 1e-6);
        }
        assert_near(e->radius, radius, 1e-4 * radius);
    }
    for (size_t id = 0; id < set.view.volume_count; ++id) {
        const fct_element *e = &set.items[id];
        double radius = 0, area = 0;
        for (uint32_t k = e->child; k < e->child + e->child_count; ++k) {
            const fct_element *child = &set.items[k];
            assert_int_equal(child->parent, id);
            radius = fmax(radius, v3_norm(v3_sub(child->center, e->center)) + child->radius),
            area += child->area;
        }
        assert_near(e->radius, radius, 1e-9 * radius), assert_near(e->area, area, 1e-9 * area);
        assert_near(e->cone, FCT_PI, 0);
        double moment[6] = {0};
        for (uint32_t k = e->child; k < e->child + e->child_count; ++k)
            for (int m = 0; m < 6; ++m) moment[m] += set.items[k].moment[m];
        for (int m = 0; m < 6; ++m) assert_near(e->moment[m], moment[m], 1e-9 * area);
    }
    fct_elements_release(&set);
    fct_scene_destroy(scene);
}

/* With every element open and no points yet, the pages read are those of all nodes, faces and vertices. */
static void touched_pages_are_counted(void **state) {
    (void)state;
    plain = fct_env_default();
    for (uint32_t n = 4; n < 64; n *= 2) {
        fct_scene *scene;
        assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
        place_sheet(&plain, scene, place_material(scene, .5, 1, false), n, v3_make(0, 0, 0), v3_make(1, 0, 0),
                    v3_make(0, 1, 0));
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_elements set = open_all(scene, 10);
        uint64_t faces = 2 * n * n, nodes = faces - 1, vertices = (n + 1) * (n + 1), pages = 0;
        const uint64_t sizes[3] = {nodes * sizeof(fct_cluster), faces * 12, vertices * 12};
        for (int k = 0; k < 3; ++k) pages += (sizes[k] + 4095) / 4096;
        assert_int_equal(fct_elements_touched(&set), 4096 * pages);
        fct_elements_release(&set);
        fct_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_equal_direct_sums),  cmocka_unit_test(quarters_tile_their_triangle),
        cmocka_unit_test(samples_follow_the_area), cmocka_unit_test(leaves_contain_their_points),
        cmocka_unit_test(points_are_stratified),   cmocka_unit_test(pull_weighs_by_area),
        cmocka_unit_test(touched_pages_are_few),   cmocka_unit_test(samples_equal_the_face_at_their_fraction),
        cmocka_unit_test(children_inherit_light),  cmocka_unit_test(touched_pages_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
