/* Trees built in memory: every node against direct sums over its faces (nodes.h). */
#include "nodes.h"

#include "cluster/shape/box.h"

static fct_mesh make_mesh(const fct_env *env, int which, const char **name) {
    fct_mesh mesh;
    switch (which) {
    case 0:
        return *name = "tetrahedron", make_tetrahedron(env);
    case 1:
        return *name = "box", make_box(env, 1, 1.7, 0.6);
    case 2:
        return *name = "cube", make_box(env, 1, 1, 1);
    case 3:
        return *name = "terrain", make_terrain(env, 14, 0.25, 1);
    case 4:
        return *name = "bent strip", make_bent_strip(env, 60);
    case 5:
        return *name = "pages", make_pages(env, 5, 4, 3);
    case 6:
        return *name = "degenerate faces", make_degenerate(env, 6);
    case 7:
        return *name = "parts", make_copies(env, make_terrain(env, 4, 0.2, 4), 4);
    case 8:
        return *name = "soup", make_soup(env, 60, true);
    case 9:
        return *name = "grid", make_grid(env, 8);
    case 10:
        mesh = make_terrain(env, 12, 0.3, 6);
        for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
            mesh.positions[i] = mesh.positions[i] * 7e-3f + 3;
        return *name = "far terrain", mesh;
    case 11:
        mesh = make_sphere(env, 20);
        roughen(&mesh, 0.05);
        return *name = "rough sphere", mesh;
    case 12:
        return *name = "large terrain", make_terrain(env, 60, 0.25, 7);
    case 13:
        return *name = "fine cube", make_fine_box(env, 18, 1, 1, 1);
    case 14:
        return *name = "fine box", make_fine_box(env, 18, 3, 1, 0.7);
    case 15:
        mesh = make_terrain(env, 50, 0.05, 8);
        turn(&mesh);
        return *name = "turned terrain", mesh;
    case 16:
        return *name = "tangle", make_tangle(env, 1500); /* most spans of faces have no new vertex */
    default:
        return *name = "large pages", make_pages(env, 5, 24, 24);
    }
}
enum { MESHES = 18 };

static void nodes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    excesses all = {0};
    for (int which = 0; which < MESHES; ++which) {
        const char *name;
        fct_mesh mesh = make_mesh(&env, which, &name);
        fct_tree *tree = tree_of(&env, &mesh, 1);
        check_nodes(name, tree, 0, &all);
        fct_tree_destroy(tree);
        fct_mesh_release(&env, &mesh);
    }
    check_excess("eight angles, all vertices", &all.exact, 1.00001, 1.000001);
    check_excess("eight angles, 64 vertices", &all.sampled, 1.3, 1.004);
    check_excess("any angle", &all.fine, 1.35, 1.04);
    check_excess("the world's axes", &all.world, 1.12, 1);
    check_excess("large clusters' eight angles", &all.own, 1.15, 1.02);
}

/* Half the surface area, by which frames of large clusters are compared. */
static void areas(void **state) {
    (void)state;
    const fct_extents extents = {{-1, 2, 5}, {2, 4, 12}};
    assert_true(fabs(2 * fct_box_area(&extents) - 2 * (3 * 2 + 2 * 7 + 7 * 3)) < 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(nodes), cmocka_unit_test(areas)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
