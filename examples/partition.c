/* Clusters a mesh, writes the hierarchy to a file, opens it again, and cuts the mesh into 64 clusters.
 *
 * usage: partition [MESH]      default: a torus
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <facetree/facetree.h>

static void print_error(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

/* A torus of n x m quads, with two triangles each. */
static fct_result make_torus(const fct_env *env, uint32_t n, uint32_t m, fct_mesh *mesh) {
    fct_result result = fct_mesh_create(env, n * m, 2 * n * m, 0, mesh);
    if (result != FCT_OK) return result;
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t j = 0; j < m; ++j) {
            double a = 6.283185307179586 * i / n, b = 6.283185307179586 * j / m, r = 2 + cos(b);
            float *p = mesh->positions + 3 * (size_t)(i * m + j);
            p[0] = (float)(r * cos(a)), p[1] = (float)(r * sin(a)), p[2] = (float)sin(b);
            uint32_t right = (i + 1) % n * m + j, up = i * m + (j + 1) % m,
                     across = (i + 1) % n * m + (j + 1) % m;
            uint32_t *t = mesh->triangles + 6 * (size_t)(i * m + j);
            t[0] = i * m + j, t[1] = right, t[2] = across;
            t[3] = i * m + j, t[4] = across, t[5] = up;
        }
    return FCT_OK;
}

static void print_clusters(const fct_tree *tree, const uint32_t *nodes, uint32_t count) {
    double area = 0, largest = 0;
    for (uint32_t i = 0; i < count; ++i) {
        fct_cluster cluster;
        fct_tree_cluster(tree, nodes[i], &cluster);
        area += cluster.area;
        if (cluster.area > largest) largest = cluster.area;
    }
    printf("%u clusters, area %.3f, the largest %.3f\n", count, area, largest);
}

int main(int argc, char **argv) {
    enum { PARTS = 64 };
    fct_env env = fct_env_default();
    env.message = print_error;
    fct_mesh mesh;
    if ((argc > 1 ? fct_mesh_load(&env, argv[1], &mesh) : make_torus(&env, 120, 60, &mesh)) != FCT_OK)
        return 1;

    fct_tree *tree = NULL;
    fct_tree_def def = fct_tree_def_default();
    fct_result result = fct_tree_build(&env, &mesh, &def, NULL, &tree);
    fct_mesh_release(&env, &mesh);
    if (result == FCT_OK) result = fct_tree_save(&env, tree, "surface.fct");
    fct_tree_destroy(tree);
    if (result == FCT_OK) result = fct_tree_open(&env, "surface.fct", &tree);
    if (result != FCT_OK) return 1;

    uint32_t nodes[PARTS], count;
    fct_partition_quality quality;
    result = fct_tree_partition(&env, tree, PARTS, nodes, &count);
    if (result == FCT_OK) print_clusters(tree, nodes, count);
    if (result == FCT_OK) result = fct_tree_quality(&env, tree, nodes, count, &quality);
    if (result == FCT_OK)
        printf("in one piece each: %s; mean squared deviation of normals %.4f\n",
               quality.connected ? "yes" : "no", quality.mean_normal_deviation);
    fct_tree_destroy(tree);
    return result != FCT_OK || count != PARTS;
}
