/* scene/texture/reflectance.c: the reflectance of painted surfaces, at points and as means.
 *
 * The mean over a triangle is that of n x n samples, the centroids of equal parts, at least one per texel
 * along its longest edge. A triangle with too many texels is sampled on a coarser level of the texture, whose
 * texels are means themselves. Nodes add up their faces.
 */
#include "scene/texture/reflectance.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "cluster/tree/node.h"
#include "scene/texture/pyramid.h"
#include "scene/transform.h"

/* The paint of a face. */
typedef struct face_paint {
    const fct_scene_paint *paint;
    const fct_pyramid *pyramid; /* NULL: no texture */
    double points[3][2];        /* of the corners, in the image */
    double tint[3][3];          /* of the corners: times the texture, or the reflectance itself */
    bool even;                  /* all tints are 1 */
} face_paint;

static bool has_texture(const fct_scene *scene, const fct_instance *in) {
    return scene->paints[in->material].pyramid != FCT_NONE && scene->models[in->model].texcoords;
}

static bool has_colors(const fct_scene *scene, const fct_instance *in) {
    return scene->paints[in->material].def.vertex_colors && !scene->own[in->model].colors_are_light &&
           fct_tree_get(scene->models[in->model].tree).colors;
}

bool fct_scene_is_painted(const fct_scene *scene, uint32_t instance) {
    const fct_instance *in = &scene->instances[instance];
    return scene->paints[in->material].painted && (has_texture(scene, in) || has_colors(scene, in));
}

static void load_tints(const fct_scene *scene, const fct_instance *in, uint32_t place, face_paint *f) {
    const fct_tree_view t = fct_tree_get(scene->models[in->model].tree);
    const bool colored = has_colors(scene, in);
    f->even = f->pyramid && !colored;
    for (size_t k = 0; k < 3; ++k) {
        const float *color = colored ? t.colors + 3 * (size_t)t.triangles[3 * (size_t)place + k] : NULL;
        for (size_t c = 0; c < 3; ++c) {
            const double value = color ? fct_min(fct_max(color[c], 0), 1) : 1;
            f->tint[k][c] = f->pyramid ? value
                                       : fct_min(value * (double)f->paint->def.factor[c],
                                                 (double)FCT_SCENE_MOST_REFLECTANCE);
        }
    }
}

static void load_face_paint(const fct_scene *scene, const fct_instance *in, uint32_t place, face_paint *f) {
    f->paint = &scene->paints[in->material];
    f->pyramid = has_texture(scene, in) ? scene->pyramids[f->paint->pyramid] : NULL;
    load_tints(scene, in, place, f);
    const float *m = f->paint->def.transform;
    for (size_t k = 0; f->pyramid && k < 3; ++k) {
        const float *uv = scene->models[in->model].texcoords + 6 * (size_t)place + 2 * k;
        for (size_t c = 0; c < 2; ++c)
            f->points[k][c] = (double)m[3 * c] * uv[0] + (double)m[3 * c + 1] * uv[1] + m[3 * c + 2];
    }
}

/* The reflectance at barycentrics inside the face. */
static void evaluate_paint(const face_paint *f, double u, double v, double level, double out[3]) {
    const double weight[3] = {1 - u - v, u, v};
    double point[2] = {0, 0}, color[3] = {1, 1, 1};
    if (f->pyramid) {
        for (int k = 0; k < 3; ++k)
            for (int c = 0; c < 2; ++c) point[c] += weight[k] * f->points[k][c];
        fct_pyramid_sample(f->pyramid, f->paint->def.wrap, point, level, color);
        for (int c = 0; c < 3; ++c) color[c] *= f->paint->scale[c];
    }
    for (int c = 0; c < 3; ++c) {
        const double tint = weight[0] * f->tint[0][c] + weight[1] * f->tint[1][c] + weight[2] * f->tint[2][c];
        out[c] = f->even ? color[c] : color[c] * tint;
    }
}

/* The length of the way from a to b, in texels. */
static double count_texels(const face_paint *f, const double a[2], const double b[2]) {
    const double x = (b[0] - a[0]) * f->pyramid->levels[0].width,
                 y = (b[1] - a[1]) * f->pyramid->levels[0].height;
    return sqrt(x * x + y * y);
}

/* Texels per length in the world along the edge where they are densest. */
static double find_density(const fct_scene *scene, const fct_instance *in, uint32_t place,
                           const face_paint *f) {
    const fct_tree_view t = fct_tree_get(scene->models[in->model].tree);
    double density = 0;
    v3 p[3];
    for (size_t k = 0; k < 3; ++k)
        p[k] = fct_transform_point(in->to_world,
                                   v3_load(t.positions + 3 * (size_t)t.triangles[3 * (size_t)place + k]));
    for (size_t k = 0; k < 3; ++k) {
        const double length = v3_norm(v3_sub(p[k], p[(k + 1) % 3]));
        if (length > 0)
            density = fct_max(density, count_texels(f, f->points[k], f->points[(k + 1) % 3]) / length);
    }
    return density;
}

void fct_scene_reflectance(const fct_scene *scene, uint32_t instance, uint32_t place, float u, float v,
                           float width, float out[3]) {
    const fct_instance *in = &scene->instances[instance];
    if (!fct_scene_is_painted(scene, instance)) {
        memcpy(out, scene->materials[in->material].reflectance, 3 * sizeof *out);
        return;
    }
    face_paint f;
    double level = 0, color[3];
    load_face_paint(scene, in, place, &f);
    if (f.pyramid && width > 0)
        level = fct_pyramid_level_of(f.pyramid, (double)width * find_density(scene, in, place, &f));
    const double x = fct_max(u, 0), y = fct_max(v, 0), sum = fct_max(x + y, 1);
    evaluate_paint(&f, x / sum, y / sum, level, color);
    for (int c = 0; c < 3; ++c) out[c] = (float)color[c];
}

/* ---- Means ---- */

/* All faces of a model together take at most so many samples beyond the least number per face. */
#define MOST_SAMPLES ((uint32_t)1 << 26)
enum { LEAST_FACE_SAMPLES = 16, MOST_FACE_SAMPLES = 1 << 18 };

uint32_t fct_reflectance_samples(uint32_t face_count) {
    const uint32_t share = MOST_SAMPLES / face_count;
    return share < LEAST_FACE_SAMPLES  ? LEAST_FACE_SAMPLES
           : share > MOST_FACE_SAMPLES ? MOST_FACE_SAMPLES
                                       : share;
}

/* Triangles with fewer texels along an edge take two samples per texel. */
#define FEW_PARTS 8

/* Parts per edge of a triangle, and the level of the texture for them. */
static uint32_t choose_parts(const face_paint *f, const double corners[3][2], uint32_t most_samples,
                             double *level) {
    double points[3][2], longest = 0;
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 2; ++c)
            points[k][c] = (1 - corners[k][0] - corners[k][1]) * f->points[0][c] +
                           corners[k][0] * f->points[1][c] + corners[k][1] * f->points[2][c];
    for (int k = 0; k < 3; ++k) longest = fct_max(longest, count_texels(f, points[k], points[(k + 1) % 3]));
    const double few = fct_min(ceil(2 * longest), FEW_PARTS);
    const double most = floor(sqrt(most_samples)),
                 parts = fct_min(fct_max(fct_max(ceil(longest), few), 2), most);
    *level = fct_pyramid_level_of(f->pyramid, longest / parts);
    return (uint32_t)parts;
}

void fct_reflectance_of_triangle(const fct_scene *scene, uint32_t instance, uint32_t place,
                                 const double corners[3][2], uint32_t most_samples, double out[3]) {
    face_paint f;
    double level = 0, color[3], sum[3] = {0, 0, 0};
    load_face_paint(scene, &scene->instances[instance], place, &f);
    const uint32_t n = f.pyramid ? choose_parts(&f, corners, most_samples, &level) : 1;
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t j = 0; j < 2 * (n - i) - 1; ++j) { /* upright parts, and the turned ones between them */
            const double third = j % 2 ? 2 / 3. : 1 / 3., s = (i + third) / n, t = (j / 2 + third) / n;
            double uv[2];
            for (int c = 0; c < 2; ++c)
                uv[c] = (1 - s - t) * corners[0][c] + s * corners[1][c] + t * corners[2][c];
            evaluate_paint(&f, uv[0], uv[1], level, color);
            for (int c = 0; c < 3; ++c) sum[c] += color[c];
        }
    for (int c = 0; c < 3; ++c) out[c] = sum[c] / ((double)n * n);
}

typedef struct node_means {
    const fct_scene *scene;
    uint32_t instance, samples;
    float *faces; /* face_count x 3 */
} node_means;

static void average_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    static const double whole[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    const node_means *m = user;
    (void)chunk, (void)thread;
    for (size_t p = begin; p < end; ++p) {
        double mean[3];
        fct_reflectance_of_triangle(m->scene, m->instance, (uint32_t)p, whole, m->samples, mean);
        for (size_t c = 0; c < 3; ++c) m->faces[3 * p + c] = (float)mean[c];
    }
}

/* Children have larger numbers than their parents. */
static void average_nodes(const fct_tree *tree, float *means) {
    for (uint32_t node = fct_tree_get(tree).node_count; node-- > 0;) {
        double sum[3] = {0, 0, 0}, plain[3] = {0, 0, 0}, area = 0;
        for (int k = 0; k < 2; ++k) {
            const uint32_t child = fct_node_child(tree, node, k);
            fct_cluster room;
            const double a = fct_node_cluster(tree, child, &room)->area;
            for (size_t c = 0; c < 3; ++c) {
                sum[c] += a * means[3 * (size_t)child + c];
                plain[c] += .5 * means[3 * (size_t)child + c];
            }
            area += a;
        }
        for (size_t c = 0; c < 3; ++c)
            means[3 * (size_t)node + c] = (float)(area > 0 ? sum[c] / area : plain[c]);
    }
}

fct_result fct_reflectance_of_nodes(const fct_env *env, const fct_scene *scene, uint32_t instance,
                                    float **out) {
    enum { GRAIN = 256 }; /* faces */
    const fct_tree *tree = scene->models[scene->instances[instance].model].tree;
    const fct_tree_view t = fct_tree_get(tree);
    *out = fct_allocate(env, (size_t)t.node_count + t.face_count, 3 * sizeof **out);
    if (!*out) return fct_fail_memory(env, "reflectances");
    node_means m = {scene, instance, fct_reflectance_samples(t.face_count), *out + 3 * (size_t)t.node_count};
    fct_result result = fct_parallel_for_progress(env, "textures", t.face_count, GRAIN, average_faces, &m);
    if (result == FCT_OK) {
        average_nodes(tree, *out);
        return FCT_OK;
    }
    fct_release(env, *out);
    *out = NULL;
    return result;
}
