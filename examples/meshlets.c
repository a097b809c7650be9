/* Prepares a mesh for a game engine: meshlets, culled for one eye as a mesh shader does, and charts for a
 * lightmap with their neighbours.
 *
 * usage: meshlets [MESH]      default: a torus
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

static bool turns_its_back(const fct_meshlet_bounds *b, const float eye[3]) {
    float away[3], length = 0, dot = 0;
    for (int k = 0; k < 3; ++k) away[k] = b->cone_apex[k] - eye[k], length += away[k] * away[k];
    for (int k = 0; k < 3; ++k) dot += away[k] * b->cone_axis[k];
    return dot >= b->cone_cutoff * sqrtf(length);
}

static fct_result show_meshlets(const fct_env *env, const fct_tree *tree) {
    const float eye[3] = {10, 3, 5};
    uint32_t faces = fct_tree_get(tree).face_count, culled = 0;
    fct_meshlets meshlets;
    fct_result result = fct_tree_meshlets(env, tree, NULL, &meshlets);
    if (result != FCT_OK) return result;
    for (uint32_t i = 0; i < meshlets.count; ++i)
        if (turns_its_back(&meshlets.bounds[i], eye)) culled += meshlets.meshlets[i].triangle_count;
    printf("%u meshlets of %.1f vertices and %.1f triangles; %.0f%% of triangles culled for one eye\n",
           meshlets.count, (double)meshlets.vertex_count / meshlets.count, (double)faces / meshlets.count,
           100.0 * culled / faces);
    fct_meshlets_release(env, &meshlets);
    return FCT_OK;
}

static fct_result show_charts(const fct_env *env, const fct_tree *tree, const fct_mesh *mesh) {
    uint32_t *labels = malloc(mesh->face_count * sizeof *labels);
    fct_chart_def def = fct_chart_def_default();
    fct_chart_stats stats;
    fct_adjacency neighbours;
    if (!labels) return FCT_ERROR_MEMORY;
    def.max_angle = 1; /* radians */
    fct_result result = fct_tree_charts(env, tree, &def, labels, &stats);
    if (result == FCT_OK) result = fct_labels_adjacency(env, mesh, labels, stats.charts, &neighbours);
    if (result == FCT_OK) {
        printf("%u charts, %u of them no disk, seams %.2f long, %u pairs of neighbours\n", stats.charts,
               stats.non_disks, stats.seam_length, neighbours.pair_count);
        fct_adjacency_release(env, &neighbours);
    }
    free(labels);
    return result;
}

int main(int argc, char **argv) {
    fct_env env = fct_env_default();
    env.message = print_error;
    fct_mesh mesh;
    if ((argc > 1 ? fct_mesh_load(&env, argv[1], &mesh) : make_torus(&env, 120, 60, &mesh)) != FCT_OK)
        return 1;
    fct_tree *tree = NULL;
    fct_result result = fct_tree_build(&env, &mesh, NULL, NULL, &tree);
    if (result == FCT_OK) result = show_meshlets(&env, tree);
    if (result == FCT_OK) result = show_charts(&env, tree, &mesh);
    fct_tree_destroy(tree);
    fct_mesh_release(&env, &mesh);
    return result != FCT_OK;
}
