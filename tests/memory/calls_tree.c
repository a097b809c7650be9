/* tests/memory/calls_tree.c: calls of cluster.h and bvh.h. */
#include "tests/memory/calls.h"

static fct_result finish_tree(fct_tree *tree, fct_result result) {
    assert_int_equal(tree != NULL, result == FCT_OK);
    fct_tree_destroy(tree);
    return result;
}

static fct_result build_with(const fct_env *env, fct_cluster_method method, fct_cluster_cost cost) {
    fct_tree *tree;
    fct_tree_def def = fct_tree_def_default();
    def.method = method, def.cost = cost;
    fct_result result = STARVE(fct_tree_build(env, &inputs.sheet, &def, NULL, &tree));
    return finish_tree(tree, result);
}

static fct_result build_rounds(const fct_env *env) {
    return build_with(env, FCT_CLUSTER_ROUNDS, FCT_COST_INCREMENT);
}

static fct_result build_greedy(const fct_env *env) {
    return build_with(env, FCT_CLUSTER_GREEDY, FCT_COST_MEAN);
}

static fct_tree *open_sheet(const fct_env *env) {
    fct_tree *tree;
    assert_int_equal(fct_tree_open(env, IN "sheet.fct", &tree), FCT_OK);
    return tree;
}

static fct_result check_tree(const fct_env *env) {
    fct_tree *tree = open_sheet(env);
    fct_result result = STARVE(fct_tree_check(env, tree));
    fct_tree_destroy(tree);
    return result;
}

static fct_result read_cluster(const fct_env *env) {
    fct_tree *tree = open_sheet(env);
    fct_cluster cluster;
    fct_result result = STARVE(fct_tree_cluster(tree, 0, &cluster));
    fct_tree_destroy(tree);
    return result;
}

static fct_result read_children(const fct_env *env) {
    fct_tree *tree = open_sheet(env);
    fct_cluster clusters[2];
    fct_result result = STARVE(fct_tree_children(tree, 0, clusters));
    fct_tree_destroy(tree);
    return result;
}

static fct_result copy_tree_mesh(const fct_env *env) {
    fct_mesh mesh;
    fct_result result = STARVE(fct_tree_mesh(env, inputs.tree, &mesh));
    if (result != FCT_OK) assert_null(mesh.positions);
    fct_mesh_release(env, &mesh);
    return result;
}

static fct_result save_tree(const fct_env *env) {
    return STARVE(fct_tree_save(env, inputs.tree, OUT "sheet.fct"));
}

static fct_result open_tree(const fct_env *env) {
    fct_tree *tree;
    fct_result result = STARVE(fct_tree_open(env, IN "sheet.fct", &tree));
    return finish_tree(tree, result);
}

static fct_result verify_tree(const fct_env *env) {
    fct_tree *tree = open_sheet(env);
    fct_result result = STARVE(fct_tree_verify(env, tree));
    fct_tree_destroy(tree);
    return result;
}

static fct_result build_file_from(const fct_env *env, const char *path) {
    fct_large_def large = fct_large_def_default();
    large.part_faces = 40;
    return STARVE(fct_tree_build_file(env, path, OUT "sheet.fct", NULL, &large, NULL));
}

static fct_result build_file(const fct_env *env) {
    return build_file_from(env, IN "sheet.ply");
}

static fct_result build_file_of_triangles(const fct_env *env) {
    return build_file_from(env, IN "ball.ply");
}

static fct_result build_file_of_text(const fct_env *env) {
    return build_file_from(env, IN "sheet.obj");
}

static fct_result create_bvh_with(const fct_env *env, fct_backend backend) {
    fct_bvh *bvh;
    fct_result result = STARVE(fct_bvh_create(env, inputs.tree, backend, &bvh));
    assert_int_equal(bvh != NULL, result == FCT_OK);
    fct_bvh_destroy(bvh);
    return result;
}

static fct_result create_bvh(const fct_env *env) {
    return create_bvh_with(env, FCT_BACKEND_OBB);
}

static fct_result create_embree(const fct_env *env) {
    return create_bvh_with(env, FCT_BACKEND_EMBREE);
}

static fct_result build_bvh(const fct_env *env) {
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_SIGN | FCT_BVH_PAIRS;
    fct_bvh *bvh;
    fct_result result = STARVE(fct_bvh_build(env, inputs.tree, &def, &bvh));
    assert_int_equal(bvh != NULL, result == FCT_OK);
    fct_bvh_destroy(bvh);
    return result;
}

/* Three copies of one model at the same place: three pairs touch. */
typedef struct copies {
    fct_bvh *bvh;
    fct_body bodies[3];
    fct_body_pair pairs[3];
    size_t found;
} copies;

static void make_copies(copies *c) {
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_PAIRS;
    assert_int_equal(fct_bvh_build(&inputs.env, inputs.tree, &def, &c->bvh), FCT_OK);
    for (int i = 0; i < 3; ++i) c->bodies[i] = (fct_body){c->bvh, fct_pose_identity()};
}

static fct_result find_touching(const fct_env *env) {
    copies c;
    make_copies(&c);
    fct_result result = STARVE(fct_bodies_touching(env, 3, c.bodies, 3, c.pairs, &c.found));
    assert_int_equal(c.found, result == FCT_OK ? 3 : 0);
    fct_bvh_destroy(c.bvh);
    return result;
}

static fct_result create_tracker(const fct_env *env) {
    fct_body_tracker *tracker;
    fct_result result = STARVE(fct_body_tracker_create(env, &tracker));
    assert_int_equal(tracker != NULL, result == FCT_OK);
    fct_body_tracker_destroy(tracker);
    return result;
}

/* Two frames: the second one starts from the first. */
static fct_result track_touching(const fct_env *env) {
    copies c;
    make_copies(&c);
    fct_body_tracker *tracker;
    fct_result result = fct_body_tracker_create(env, &tracker);
    for (int frame = 0; frame < 2 && result == FCT_OK; ++frame) {
        result = STARVE(fct_body_tracker_touching(tracker, 3, c.bodies, 3, c.pairs, &c.found));
        assert_int_equal(c.found, result == FCT_OK ? 3 : 0);
    }
    fct_body_tracker_destroy(tracker);
    fct_bvh_destroy(c.bvh);
    return result;
}

static fct_result check_bvh(const fct_env *env) {
    fct_ray rays[24];
    fct_ray_check check;
    fct_ray_mix(inputs.bvh, 1, FCT_LENGTH(rays), rays);
    return STARVE(fct_bvh_check(env, inputs.bvh, inputs.embree, FCT_LENGTH(rays), rays, &check));
}

static fct_result compare_meshes(const fct_env *env) {
    fct_mesh_error error;
    return STARVE(fct_mesh_compare(env, inputs.bvh, inputs.other_bvh, 2, 1, &error));
}

static fct_result refit_bvh(const fct_env *env) {
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_SIGN | FCT_BVH_PAIRS;
    fct_bvh *bvh, *moved;
    assert_int_equal(fct_bvh_build(&inputs.env, inputs.tree, &def, &bvh), FCT_OK);
    fct_result result = STARVE(fct_bvh_refit(env, bvh, inputs.sheet.positions, &moved, NULL));
    assert_int_equal(moved != NULL, result == FCT_OK);
    fct_bvh_destroy(moved);
    fct_bvh_destroy(bvh);
    return result;
}

static fct_result find_hausdorff(const fct_env *env) {
    fct_hausdorff hausdorff;
    return STARVE(fct_mesh_hausdorff(env, inputs.bvh, inputs.other_bvh, .1, 0, &hausdorff));
}

const memory_call tree_calls[] = {{"fct_tree_build", "rounds", build_rounds, false},
                                  {"fct_tree_build", "greedy", build_greedy, false},
                                  {"fct_tree_check", "", check_tree, false},
                                  {"fct_tree_cluster", "", read_cluster, false},
                                  {"fct_tree_children", "", read_children, false},
                                  {"fct_tree_mesh", "", copy_tree_mesh, false},
                                  {"fct_tree_save", "", save_tree, false},
                                  {"fct_tree_open", "", open_tree, false},
                                  {"fct_tree_verify", "", verify_tree, false},
                                  {"fct_tree_build_file", "ply", build_file, false},
                                  {"fct_tree_build_file", "ply of triangles", build_file_of_triangles, false},
                                  {"fct_tree_build_file", "obj", build_file_of_text, false},
                                  {"fct_bvh_create", "obb", create_bvh, false},
                                  {"fct_bvh_create", "embree", create_embree, true},
                                  {"fct_bvh_build", "all parts", build_bvh, false},
                                  {"fct_bodies_touching", "", find_touching, false},
                                  {"fct_body_tracker_create", "", create_tracker, false},
                                  {"fct_body_tracker_touching", "", track_touching, false},
                                  {"fct_bvh_check", "", check_bvh, false},
                                  {"fct_bvh_refit", "", refit_bvh, false},
                                  {"fct_mesh_hausdorff", "", find_hausdorff, false},
                                  {"fct_mesh_compare", "", compare_meshes, false},
                                  {NULL, NULL, NULL, false}};
