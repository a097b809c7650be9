/* tests/cluster/oracle/parts.h: small meshes of every kind for builds in parts: borders, several components,
 * materials, edges of many faces, faces without area. */
#ifndef FCT_TESTS_ORACLE_PARTS_H
#define FCT_TESTS_ORACLE_PARTS_H

#include "meshes.h"

static inline fct_env single(void) {
    fct_env env = fct_env_default();
    env.thread_count = 1;
    return env;
}

static inline void swap_words(uint32_t *a, uint32_t *b, uint32_t count) {
    for (uint32_t k = 0; k < count; ++k) {
        uint32_t word = a[k];
        a[k] = b[k], b[k] = word;
    }
}

/* Mixes the order of the faces and their first corners, so that a part has faces from the whole file. */
static inline void shuffle(fct_mesh *mesh, uint32_t seed) {
    for (uint32_t f = mesh->face_count; f-- > 1;) {
        uint32_t other = (uint32_t)(shape_random(&seed) * (f + 1));
        swap_words(mesh->triangles + 3 * (size_t)f, mesh->triangles + 3 * (size_t)other, 3);
        if (mesh->materials) swap_words(mesh->materials + f, mesh->materials + other, 1);
        uint32_t *t = mesh->triangles + 3 * (size_t)f, first = t[0];
        if (shape_random(&seed) < 0.5) t[0] = t[1], t[1] = t[2], t[2] = first;
    }
}

static inline fct_mesh make_part_mesh(const fct_env *env, int which, const char **name) {
    fct_mesh mesh;
    switch (which) {
    case 0:
        return *name = "terrain", make_terrain(env, 36, 0.25, 1);
    case 1:
        mesh = make_sphere(env, 20);
        roughen(&mesh, 0.05);
        shuffle(&mesh, 1);
        return *name = "rough sphere", mesh;
    case 2:
        return *name = "pages", make_pages(env, 5, 12, 12);
    case 3:
        mesh = make_degenerate(env, 26);
        shuffle(&mesh, 2);
        return *name = "degenerate faces", mesh;
    case 4:
        return *name = "components", make_copies(env, make_terrain(env, 12, 0.2, 4), 5);
    case 5:
        return *name = "soup", make_soup(env, 1300, true);
    case 6:
        mesh = make_fine_box(env, 12, 3, 1, 0.7);
        turn(&mesh);
        return *name = "turned box", mesh;
    case 7:
        mesh = make_terrain(env, 27, 0.2, 3);
        paint_stripes(env, &mesh, 3, 60);
        shuffle(&mesh, 3);
        return *name = "materials", mesh;
    case 8:
        return *name = "doubled", make_doubled(env, 19);
    case 9:
        return *name = "tangle", make_tangle(env, 1200);
    default:
        mesh = make_terrain(env, 26, 0.3, 6);
        for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; ++i)
            mesh.positions[i] = mesh.positions[i] * 7e-3f + 3;
        return *name = "far terrain", mesh;
    }
}
enum { PART_MESHES = 11 };
static const int part_options[PART_MESHES] = {0, 1, 2, 3, 4, 5, 1, 7, 4, 6, 0}; /* of def_of */

static inline fct_tree_def def_of(int option) {
    fct_tree_def def = fct_tree_def_default();
    def.method = option & 1 ? FCT_CLUSTER_GREEDY : FCT_CLUSTER_ROUNDS;
    def.cost = option & 2 ? FCT_COST_MEAN : FCT_COST_INCREMENT;
    def.fit_measure = option & 4 ? FCT_FIT_POINTS : FCT_FIT_AREA;
    def.weld = false; /* the oracle goes by vertices */
    return def;
}

#endif
