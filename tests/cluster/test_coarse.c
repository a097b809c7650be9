/* Coarse trees: the nodes above a cut and the patches below it, against their definition. */
#include "support.h"

#include "base/math/vec.h"
#include "cluster/tree/coarse.h"
#include "cluster/tree/node.h"
#include "facetree/bvh.h"
#include "facetree/partition.h"

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

static fct_tree *tree_of(const fct_env *env, fct_mesh mesh) {
    fct_tree *tree;
    assert_int_equal(fct_tree_build(env, &mesh, NULL, NULL, &tree), FCT_OK);
    fct_mesh_release(env, &mesh);
    return tree;
}

/* A sheet of n x n quads with hills. */
static fct_mesh make_hills(const fct_env *env, uint32_t n, double height) {
    fct_mesh mesh = make_grid(env, n);
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        float *p = mesh.positions + 3 * v;
        p[2] = (float)(height * sin(9 * (double)p[0]) * cos(7 * (double)p[1]));
    }
    return mesh;
}

static bool is_in_cut(const uint32_t *cut, uint32_t count, uint32_t node) {
    for (uint32_t i = 0; i < count; ++i)
        if (cut[i] == node) return true;
    return false;
}

/* The patches are the partition, in order of place. Ranges, children and records of all nodes fit. */
static void assert_structure(const fct_env *env, const fct_tree *tree, const fct_coarse *c) {
    const fct_tree_view large = fct_tree_get(tree), small = fct_tree_get(c->tree);
    uint32_t count = 0, *cut = calloc(c->patch_count, sizeof *cut), place = 0, single = 0;
    assert_int_equal(fct_tree_partition(env, tree, c->patch_count, cut, &count), FCT_OK);
    assert_int_equal(count, c->patch_count);
    assert_int_equal(c->top_count, c->patch_count - large.root_count);
    for (uint32_t i = 0; i < c->patch_count; ++i) {
        assert_true(is_in_cut(cut, count, c->nodes[i]));
        assert_int_equal(fct_node_first(tree, c->nodes[i]), place); /* so each member comes once */
        place += fct_node_faces(tree, c->nodes[i]);
        single += fct_node_faces(tree, c->nodes[i]) == 1;
    }
    assert_int_equal(place, large.face_count);
    assert_int_equal(small.face_count, 2 * c->patch_count - single);
    assert_int_equal(small.node_count, small.face_count - small.root_count);
    assert_int_equal(fct_tree_check(env, c->tree), FCT_OK);
    for (uint32_t id = 0; id < small.node_count; ++id) {
        fct_cluster own, origin;
        const uint32_t from = fct_coarse_origin(c, id);
        assert_int_equal(fct_tree_cluster(c->tree, id, &own), FCT_OK);
        assert_int_equal(fct_tree_cluster(tree, from, &origin), FCT_OK);
        assert_true(id >= c->top_count || from == id);
        assert_memory_equal(&own, &origin, offsetof(fct_cluster, child));
        uint32_t next = own.first, part = origin.first;
        for (int k = 0; k < 2; ++k) {
            assert_int_equal(fct_node_first(c->tree, own.child[k]), next);
            next += fct_node_faces(c->tree, own.child[k]);
            if (id >= c->top_count) continue;
            const uint32_t child = fct_coarse_origin(c, own.child[k]);
            assert_int_equal(fct_node_first(tree, child), part);
            part += fct_node_faces(tree, child);
        }
        assert_int_equal(next, own.first + own.count);
        assert_int_equal(part, id < c->top_count ? origin.first + origin.count : origin.first);
    }
    for (uint32_t p = 0; p < small.face_count; ++p) {
        const uint32_t node = c->nodes[c->patches[p]];
        assert_int_equal(fct_coarse_origin(c, small.node_count + p), node);
        assert_true(p == 0 || c->patches[p] >= c->patches[p - 1]);
    }
    free(cut);
}

/* Each rectangle lies in the plane of its cluster around the middle of the box, and is as large as the box,
 * or as the geometric mean of that and of the outline where the box is thicker than 1 / 20 of its size. */
static void assert_rectangles(const fct_tree *tree, const fct_coarse *c, uint32_t *bent, uint32_t *flat) {
    const fct_tree_view view = fct_tree_get(c->tree);
    for (uint32_t p = 0; p + 1 < view.face_count; ++p) {
        const uint32_t patch = c->patches[p];
        if (c->patches[p + 1] != patch) continue;
        fct_cluster own;
        fct_box box;
        assert_int_equal(fct_tree_cluster(tree, c->nodes[patch], &own), FCT_OK);
        fct_cluster_box(&own, &box);
        v3 q[4], n = v3_load(own.plane);
        const uint32_t *t = view.triangles + 3 * (size_t)p;
        for (int k = 0; k < 3; ++k) q[k] = v3_load(view.positions + 3 * (size_t)t[k]);
        q[3] = v3_load(view.positions + 3 * (size_t)t[5]);
        assert_true(t[3] == t[0] && t[4] == t[2]);
        const v3 s = v3_sub(q[1], q[0]), u = v3_sub(q[3], q[0]), around = v3_cross(s, u);
        const double size = v3_norm(s) + v3_norm(u), outline = v3_norm(v3_load(own.area_vector));
        for (int k = 0; k < 4; ++k)
            assert_near(v3_dot(n, q[k]) + own.plane[3], 0, 1e-5 * (size + v3_norm(q[k])));
        assert_true(v3_dot(around, n) > 0);
        int across = 0;
        for (int k = 1; k < 3; ++k)
            if (fabs(v3_dot(n, v3_load(box.axes[k]))) > fabs(v3_dot(n, v3_load(box.axes[across]))))
                across = k;
        const v3 a = v3_load(box.axes[(across + 1) % 3]), b = v3_load(box.axes[(across + 2) % 3]);
        const v3 flat_a = v3_mad(a, -v3_dot(a, n), n), flat_b = v3_mad(b, -v3_dot(b, n), n);
        const double ha = box.half[(across + 1) % 3], hb = box.half[(across + 2) % 3];
        const double whole = 4 * ha * hb * v3_norm(v3_cross(flat_a, flat_b)), h = box.half[across];
        const double thin = fmin(h / (.05 * sqrt(whole / 4)), 1), cover = fmax(fmin(outline / whole, 1), .1),
                     mean = pow(cover, .25);
        const double factor = 1 - thin * (1 - mean);
        assert_near(v3_norm(around), whole * factor * factor, 1e-4 * whole);
        assert_near(c->fill[patch], fmin(cover * whole / v3_norm(around), 1), 1e-4);
        assert_near(c->height[patch], h, 1e-6 * h);
        const v3 middle = v3_scale(v3_add(q[0], q[2]), .5), from = v3_sub(middle, v3_load(box.center));
        assert_near(v3_norm(v3_cross(from, n)), 0, 1e-5 * (size + v3_norm(middle)));
        if (thin > .9) ++*bent;
        if (thin < .1) ++*flat;
    }
}

static void trees_follow_their_definition(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    uint32_t bent = 0, flat = 0;
    for (int shape = 0; shape < 4; ++shape) {
        fct_tree *tree = tree_of(&env, shape == 0   ? make_sphere(&env, 12)
                                       : shape == 1 ? make_hills(&env, 40, .1)
                                       : shape == 2 ? make_grid(&env, 30)
                                                    : make_hills(&env, 5, .2));
        const uint32_t most = fct_tree_get(tree).face_count;
        for (uint32_t patches = 1; patches <= most; patches = patches * 5 + 2) {
            fct_coarse c;
            assert_int_equal(fct_tree_coarsen(&env, tree, patches, &c), FCT_OK);
            assert_int_equal(c.closed, shape == 0);
            assert_structure(&env, tree, &c);
            assert_rectangles(tree, &c, &bent, &flat);
            fct_coarse_release(&env, &c);
        }
        fct_tree_destroy(tree);
    }
    assert_true(bent > 20 && flat > 20);
}

/* No ray passes between the patches of flat ground, and few pass between those of hills. */
static void rays_do_not_pass(void **state) {
    (void)state;
    const fct_env env = fct_env_default();
    for (int shape = 0; shape < 2; ++shape) {
        fct_tree *tree = tree_of(&env, shape ? make_hills(&env, 60, .05) : make_grid(&env, 60));
        fct_bvh *bvh;
        fct_coarse c;
        assert_int_equal(fct_tree_coarsen(&env, tree, 150, &c), FCT_OK);
        assert_int_equal(fct_bvh_create(&env, c.tree, FCT_BACKEND_OBB, &bvh), FCT_OK);
        const fct_bounds b = fct_tree_get(tree).bounds;
        int passed = 0;
        uint32_t seed = 1;
        for (int i = 0; i < 20000; ++i) {
            fct_ray ray = {.origin = {0, 0, 1}, .direction = {.1F, -.2F, -1}, .t_max = INFINITY};
            for (int k = 0; k < 2; ++k) {
                seed = seed * 1664525u + 1013904223u;
                const float share = .02F + .96F * (float)(seed >> 8) / 16777216.F;
                ray.origin[k] = b.lower[k] + share * (b.upper[k] - b.lower[k]) - ray.direction[k];
            }
            passed += !fct_bvh_any_hit(bvh, &ray, NULL);
        }
        assert_true(shape ? passed < 400 : passed == 0);
        fct_bvh_destroy(bvh);
        fct_coarse_release(&env, &c);
        fct_tree_destroy(tree);
    }
}

/* The same from a file, which is read no further than the cut needs; damage is an error. */
static void files_are_checked_as_they_are_read(void **state) {
    (void)state;
    recorder r = {0};
    const fct_env env = recorder_env(&r);
    fct_tree *tree = tree_of(&env, make_hills(&env, 90, .1)), *open;
    fct_coarse c, d;
    assert_int_equal(fct_tree_save(&env, tree, "hills.fct"), FCT_OK);
    assert_int_equal(fct_tree_open(&env, "hills.fct", &open), FCT_OK);
    assert_int_equal(fct_tree_coarsen(&env, tree, 40, &c), FCT_OK);
    assert_int_equal(fct_tree_coarsen(&env, open, 40, &d), FCT_OK);
    const fct_tree_view a = fct_tree_get(c.tree), b = fct_tree_get(d.tree);
    assert_int_equal(a.face_count, b.face_count);
    assert_memory_equal(a.positions, b.positions, 12 * (size_t)a.vertex_count);
    assert_memory_equal(c.tree->nodes, d.tree->nodes, a.node_count * sizeof(fct_cluster));
    assert_int_equal(c.touched_bytes, 0);
    /* 79 records in at least the one page of the first 31, and at most one page each. */
    assert_true(d.touched_bytes >= 3 * 4096 && d.touched_bytes <= 79 * 4096 && d.touched_bytes % 4096 == 0);
    fct_coarse_release(&env, &d);
    fct_tree_destroy(open);

    FILE *file = fopen("hills.fct", "r+b");
    const size_t nodes = (size_t)(((const fct_tree *)tree)->view.node_count);
    assert_non_null(file);
    unsigned char *bytes = malloc(1 << 22);
    const size_t size = fread(bytes, 1, 1 << 22, file);
    size_t at = 0; /* of the record of the root */
    while (at + sizeof(fct_cluster) < size && memcmp(bytes + at, tree->nodes, sizeof(fct_cluster)) != 0) ++at;
    assert_true(at + nodes * sizeof(fct_cluster) < size);
    const uint32_t wrong[] = {0, 5, 1000000000};
    for (size_t k = 0; k < 3; ++k)
        for (size_t node = 0; node < 39; node += 7) {
            const long child = (long)(at + node * sizeof(fct_cluster) + offsetof(fct_cluster, child));
            fseek(file, child, SEEK_SET);
            fwrite(&wrong[k], sizeof *wrong, 1, file);
            fflush(file);
            assert_int_equal(fct_tree_open(&env, "hills.fct", &open), FCT_OK);
            r.text[0] = 0;
            fct_result result = fct_tree_coarsen(&env, open, 40, &d);
            if (result != FCT_OK) {
                assert_int_equal(result, FCT_ERROR_DATA);
                assert_non_null(strstr(r.text, "hills.fct"));
            } else { /* the number was that of the child */
                fct_coarse_release(&env, &d);
            }
            assert_true(result != FCT_OK || k == 1);
            fct_tree_destroy(open);
            fseek(file, child, SEEK_SET);
            fwrite(bytes + child, sizeof *wrong, 1, file);
            fflush(file);
        }
    fclose(file);
    free(bytes);
    fct_coarse_release(&env, &c);
    fct_tree_destroy(tree);
    assert_int_equal(r.alive, 0);
}

/* A single face in the cut: its corners are checked as well. */
static void corners_of_single_faces_are_checked(void **state) {
    (void)state;
    recorder r = {0};
    const fct_env env = recorder_env(&r);
    fct_mesh mesh = make_hills(&env, 90, .05), part;
    const uint32_t last = mesh.face_count - 1;
    /* The last face alone is far away, so it stays alone down to every cut. */
    for (uint32_t k = 0; k < 3; ++k) mesh.triangles[3 * (size_t)last + k] = k;
    uint32_t *kept = calloc(last, sizeof *kept), *ids = NULL;
    for (uint32_t f = 0; f < last; ++f) kept[f] = f;
    assert_int_equal(fct_mesh_extract(&env, &mesh, kept, last, &part, &ids), FCT_OK);
    fct_mesh far = make_grid(&env, 1), both;
    for (size_t v = 0; v < far.vertex_count; ++v) far.positions[3 * v] += 50;
    far.face_count = 1;
    const fct_mesh parts[2] = {part, far};
    assert_int_equal(fct_mesh_join(&env, parts, 2, &both), FCT_OK);
    fct_tree *tree = tree_of(&env, both), *open;
    assert_int_equal(fct_tree_save(&env, tree, "far.fct"), FCT_OK);
    const fct_tree_view view = fct_tree_get(tree);
    uint32_t place = 0;
    while (view.face_ids[place] != view.face_count - 1) ++place;
    FILE *file = fopen("far.fct", "r+b");
    unsigned char *bytes = malloc(1 << 23);
    const size_t size = fread(bytes, 1, 1 << 23, file), want = 12 * (size_t)view.face_count;
    size_t at = 0;
    while (at + want <= size && memcmp(bytes + at, view.triangles, want) != 0) at += 4;
    assert_true(at + want <= size);
    const uint32_t wild = 0x7fffffff;
    fseek(file, (long)(at + 12 * (size_t)place), SEEK_SET);
    fwrite(&wild, sizeof wild, 1, file);
    fclose(file);
    assert_int_equal(fct_tree_open(&env, "far.fct", &open), FCT_OK);
    fct_coarse c;
    assert_int_equal(fct_tree_coarsen(&env, open, 100, &c), FCT_ERROR_DATA);
    fct_tree_destroy(open), fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh), fct_mesh_release(&env, &part), fct_mesh_release(&env, &far);
    fct_memory_release(&env, ids);
    free(kept), free(bytes);
    assert_int_equal(r.alive, 0);
}

static void each_allocation_may_fail(void **state) {
    (void)state;
    recorder r = {0};
    const fct_env env = recorder_env(&r);
    fct_tree *tree = tree_of(&env, make_sphere(&env, 6));
    const long before = r.alive;
    fct_coarse c;
    fct_result result = FCT_ERROR_MEMORY;
    long fail = 0;
    while (result != FCT_OK) {
        r.allocations = 0, r.fail_at = ++fail;
        result = fct_tree_coarsen(&env, tree, 20, &c);
        assert_true(result == FCT_OK || (result == FCT_ERROR_MEMORY && r.alive == before && !c.tree));
    }
    r.fail_at = 0;
    assert_true(fail > 10);
    fct_coarse_release(&env, &c);
    assert_int_equal(r.alive, before);
    fct_tree_destroy(tree);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(trees_follow_their_definition),
        cmocka_unit_test(rays_do_not_pass),
        cmocka_unit_test(files_are_checked_as_they_are_read),
        cmocka_unit_test(corners_of_single_faces_are_checked),
        cmocka_unit_test(each_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
