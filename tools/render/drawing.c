/* tools/render/drawing.c: see drawing.h. From a file to a drawing.
 *
 * A mesh is drawn as it is. A hierarchy or a scene becomes parts: trees with a transform. Their faces are
 * copied one part after another, in the order of the trees, so that a cluster is a range of faces.
 */
#include "tools/render/drawing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "tools/kit/file.h"
#include "tools/kit/model.h"
#include "tools/render/palette.h"

typedef struct part {
    const fct_tree *tree;
    const fct_instance *instance; /* NULL: in the tree's own frame */
    const fct_material *material; /* NULL: none */
    uint32_t first_face;
    double scale; /* by which the transform scales areas, roughly */
} part;

/* One cluster of a cut. */
typedef struct cut {
    uint32_t part, node, first, count; /* first: in the part's faces */
    double relief; /* area minus |area vector|^2 / area: what opening the cluster can improve */
} cut;

typedef struct loader {
    fct_tree *tree;
    fct_scene *scene;
    part *parts;
    uint32_t part_count;
    cut *cuts;
    uint32_t cut_count;
} loader;

/* --- Kinds of files --- */

/* Whether the file is a scene: a scene.json, an OBJ with materials, or a glTF file without baked light. A
 * glTF file from a pipe cannot be read twice, and is a mesh. */
static int find_scene_file(tool *t, const char *path, bool *scene) {
    bool lit = false;
    *scene = tool_is_scene(t, path);
    if (tool_ends(path, "obj")) return tool_result(t, fct_scene_obj_has_library(&t->env, path, scene));
    struct stat status;
    if (!tool_is_gltf(t, path) || stat(path, &status) || !S_ISREG(status.st_mode)) return TOOL_DONE;
    int code = tool_result(t, fct_mesh_file_holds_light(&t->env, path, &lit));
    *scene = !lit;
    return code;
}

/* --- Parts --- */

static int use_scene(tool *t, const char *path, loader *l, drawing *out) {
    int code = tool_result(t, fct_scene_load(&t->env, path, FCT_BACKEND_OBB, &l->scene));
    if (code != TOOL_DONE) return code;
    fct_scene_view view = fct_scene_get(l->scene);
    out->camera = view.camera;
    l->parts = tool_allocate(t, view.instance_count, sizeof *l->parts);
    if (!l->parts) return TOOL_MEMORY;
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        const fct_instance *instance = view.instances + i;
        double trace = 0;
        for (int k = 0; k < 9; ++k) trace += (double)instance->normal_matrix[k] * instance->normal_matrix[k];
        l->parts[i] = (part){view.models[instance->model].tree, instance, view.materials + instance->material,
                             0, sqrt(trace / 3)};
    }
    l->part_count = view.instance_count;
    return TOOL_DONE;
}

static int use_tree(tool *t, const drawing_source *source, loader *l) {
    int code = tool_open_tree(t, source->path, &source->tree, &l->tree);
    if (code == TOOL_DONE) code = tool_result(t, fct_tree_check(&t->env, l->tree));
    if (code != TOOL_DONE) return code;
    l->parts = tool_allocate(t, 1, sizeof *l->parts);
    if (!l->parts) return TOOL_MEMORY;
    l->parts[0] = (part){.tree = l->tree, .scale = 1};
    l->part_count = 1;
    return TOOL_DONE;
}

static void transform_point(const part *p, const float *in, float *out) {
    if (!p->instance) {
        memcpy(out, in, 3 * sizeof *out);
        return;
    }
    const float *m = p->instance->to_world;
    for (int i = 0; i < 3; ++i) {
        double x = m[3 + 4 * i];
        for (int k = 0; k < 3; ++k) x += (double)m[4 * i + k] * in[k];
        out[i] = (float)x;
    }
}

static void lay_part(const part *p, fct_mesh *mesh, uint32_t first_vertex) {
    fct_tree_view tree = fct_tree_get(p->tree);
    for (uint32_t v = 0; v < tree.vertex_count; ++v)
        transform_point(p, tree.positions + 3 * (size_t)v, mesh->positions + 3 * ((size_t)first_vertex + v));
    if (mesh->colors)
        memcpy(mesh->colors + 3 * (size_t)first_vertex, tree.colors,
               (size_t)tree.vertex_count * 3 * sizeof(float));
    bool mirrored = p->instance && p->instance->mirrored;
    for (uint32_t f = 0; f < tree.face_count; ++f)
        for (int i = 0; i < 3; ++i)
            mesh->triangles[3 * ((size_t)p->first_face + f) + i] =
                first_vertex + tree.triangles[3 * (size_t)f + (mirrored ? 2 - i : i)];
}

/* Copies the faces of all parts into one mesh. */
static int lay_out(tool *t, loader *l, drawing *out) {
    uint64_t vertices = 0, faces = 0;
    for (uint32_t i = 0; i < l->part_count; ++i) {
        fct_tree_view tree = fct_tree_get(l->parts[i].tree);
        l->parts[i].first_face = (uint32_t)faces;
        vertices += tree.vertex_count;
        faces += tree.face_count;
    }
    if (vertices >= INT32_MAX || faces >= INT32_MAX)
        return tool_fail(t, TOOL_DATA, "the scene has %llu faces, expected fewer than 2^31",
                         (unsigned long long)faces);
    bool colors = l->part_count == 1 && !l->parts[0].instance && fct_tree_get(l->parts[0].tree).colors;
    int code = tool_result(t, fct_mesh_create(&t->env, (uint32_t)vertices, (uint32_t)faces,
                                              colors ? FCT_MESH_COLORS : 0, &out->mesh));
    uint32_t first_vertex = 0;
    for (uint32_t i = 0; i < l->part_count && code == TOOL_DONE; ++i) {
        lay_part(l->parts + i, &out->mesh, first_vertex);
        first_vertex += fct_tree_get(l->parts[i].tree).vertex_count;
    }
    return code;
}

/* Keeps a scene with painted materials for drawing_shade. */
static int keep_painted_scene(tool *t, loader *l, drawing *out) {
    bool painted = false;
    for (uint32_t i = 0; i < l->part_count; ++i) painted = painted || fct_scene_is_painted(l->scene, i);
    if (!painted) return TOOL_DONE;
    out->starts = tool_allocate(t, (size_t)l->part_count + 1, sizeof *out->starts);
    if (!out->starts) return TOOL_MEMORY;
    for (uint32_t i = 0; i < l->part_count; ++i) out->starts[i] = l->parts[i].first_face;
    out->starts[l->part_count] = out->mesh.face_count;
    out->scene = l->scene;
    return TOOL_DONE;
}

static int paint_materials(tool *t, loader *l, drawing *out) {
    if (!l->scene) return TOOL_DONE;
    out->paint = tool_allocate(t, out->mesh.face_count, 3 * sizeof *out->paint);
    out->glow = tool_allocate(t, out->mesh.face_count, 3 * sizeof *out->glow);
    if (!out->paint || !out->glow) return TOOL_MEMORY;
    for (uint32_t i = 0; i < l->part_count; ++i) {
        const part *p = l->parts + i;
        uint32_t end = p->first_face + fct_tree_get(p->tree).face_count;
        for (size_t f = p->first_face; f < end; ++f) {
            memcpy(out->paint + 3 * f, p->material->reflectance, 3 * sizeof(float));
            memcpy(out->glow + 3 * f, p->material->emission, 3 * sizeof(float));
        }
    }
    return keep_painted_scene(t, l, out);
}

/* --- Clusters --- */

static cut make_cut(const loader *l, uint32_t number, uint32_t node) {
    const part *p = l->parts + number;
    fct_cluster c;
    fct_tree_cluster(p->tree, node, &c);
    double s2 = 0, area = c.area;
    for (int k = 0; k < 3; ++k) s2 += (double)c.area_vector[k] * c.area_vector[k];
    double relief = area > 0 && c.count > 1 ? fmax(0, area - s2 / area) * p->scale : 0;
    /* Flat clusters are opened last, the largest first. */
    if (c.count > 1) relief += 1e-9 * area * p->scale;
    return (cut){number, node, c.first, c.count, relief};
}

/* The order of the heap: larger relief, then lower part, then lower node. */
static bool precedes_cut(const cut *a, const cut *b) {
    if (a->relief != b->relief) return a->relief > b->relief;
    return a->part != b->part ? a->part < b->part : a->node < b->node;
}

static void sift_cut_down(cut *heap, uint32_t count, uint32_t i) {
    for (uint32_t child; (child = 2 * i + 1) < count; i = child) {
        if (child + 1 < count && precedes_cut(heap + child + 1, heap + child)) ++child;
        if (!precedes_cut(heap + child, heap + i)) return;
        cut swap = heap[i];
        heap[i] = heap[child], heap[child] = swap;
    }
}

static void sift_cut_up(cut *heap, uint32_t i) {
    while (i && precedes_cut(heap + i, heap + (i - 1) / 2)) {
        cut swap = heap[i];
        heap[i] = heap[(i - 1) / 2], heap[(i - 1) / 2] = swap;
        i = (i - 1) / 2;
    }
}

/* One tree gives its partition. With several trees the cluster with the most relief is opened, from all roots
 * on, until there are `count`. */
static int make_cuts(tool *t, loader *l, uint32_t count) {
    uint64_t roots = 0, faces = 0;
    for (uint32_t i = 0; i < l->part_count; ++i) {
        fct_tree_view tree = fct_tree_get(l->parts[i].tree);
        roots += tree.root_count;
        faces += tree.face_count;
    }
    if (count > faces) count = (uint32_t)faces;
    uint32_t most = count > roots ? count : (uint32_t)roots, n = 0;
    l->cuts = tool_allocate(t, most, sizeof *l->cuts);
    uint32_t *nodes = tool_allocate(t, most, sizeof *nodes);
    if (!l->cuts || !nodes) {
        tool_release(t, nodes);
        return TOOL_MEMORY;
    }
    int code = TOOL_DONE;
    for (uint32_t i = 0; i < l->part_count && code == TOOL_DONE; ++i) {
        const fct_tree *tree = l->parts[i].tree;
        uint32_t here = l->part_count == 1 ? count : fct_tree_get(tree).root_count;
        code = tool_result(t, fct_tree_partition(&t->env, tree, here, nodes, &here));
        for (uint32_t k = 0; k < here; ++k) l->cuts[n++] = make_cut(l, i, nodes[k]);
    }
    tool_release(t, nodes);
    if (code != TOOL_DONE) return code;
    for (uint32_t i = n / 2; i-- > 0 && l->part_count > 1;) sift_cut_down(l->cuts, n, i);
    while (n < most && l->cuts[0].count > 1) {
        cut top = l->cuts[0];
        fct_cluster c;
        fct_tree_cluster(l->parts[top.part].tree, top.node, &c);
        l->cuts[0] = make_cut(l, top.part, c.child[0]);
        sift_cut_down(l->cuts, n, 0);
        l->cuts[n] = make_cut(l, top.part, c.child[1]);
        sift_cut_up(l->cuts, n++);
    }
    l->cut_count = n;
    return TOOL_DONE;
}

/* Labels ascend through the faces of all parts. drawing_prepare fills the paint. */
static int label_clusters(tool *t, const loader *l, drawing *out) {
    out->labels = tool_allocate(t, out->mesh.face_count, sizeof *out->labels);
    out->paint = tool_allocate(t, out->mesh.face_count, 3 * sizeof *out->paint);
    if (!out->labels || !out->paint) return TOOL_MEMORY;
    memset(out->labels, 0, out->mesh.face_count * sizeof *out->labels);
    /* The number of a cluster is the number of clusters that begin before it. */
    for (uint32_t i = 0; i < l->cut_count; ++i)
        ++out->labels[(size_t)l->parts[l->cuts[i].part].first_face + l->cuts[i].first];
    for (uint32_t f = 0, number = 0; f < out->mesh.face_count; ++f) {
        number += out->labels[f];
        out->labels[f] = number - 1;
    }
    return TOOL_DONE;
}

/* Corner i of a box lies on the positive side of axis k if bit k of i is set. The diagonal of each triangle
 * is opposite its middle corner. */
static const uint8_t box_sides[12][3] = {{0, 4, 6}, {6, 2, 0}, {1, 3, 7}, {7, 5, 1}, {0, 1, 5}, {5, 4, 0},
                                         {2, 6, 7}, {7, 3, 2}, {0, 2, 3}, {3, 1, 0}, {4, 5, 7}, {7, 6, 4}};

/* The area of the largest side of a box, in the world. */
static double find_box_area(const loader *l, const cut *c) {
    const part *p = l->parts + c->part;
    fct_cluster cluster;
    fct_tree_cluster(p->tree, c->node, &cluster);
    double x = cluster.box_half[0], y = cluster.box_half[1], z = cluster.box_half[2];
    return 4 * fmax(x * y, fmax(x * z, y * z)) * p->scale;
}

/* `pad` is added to each half extent, so that of two boxes in one plane the smaller one stays visible. */
static void lay_box(const part *p, const cut *c, uint32_t number, double pad, drawing *out) {
    fct_cluster cluster;
    fct_box box;
    fct_tree_cluster(p->tree, c->node, &cluster);
    fct_cluster_box(&cluster, &box);
    for (int i = 0; i < 8; ++i) {
        float corner[3];
        for (int k = 0; k < 3; ++k) {
            double x = box.center[k];
            for (int a = 0; a < 3; ++a) x += (i >> a & 1 ? 1 : -1) * (box.half[a] + pad) * box.axes[a][k];
            corner[k] = (float)x;
        }
        transform_point(p, corner, out->mesh.positions + 3 * (8 * (size_t)number + (size_t)i));
    }
    float color[3];
    drawing_color(number, color);
    bool mirrored = p->instance && p->instance->mirrored;
    for (size_t f = 0; f < 12; ++f) {
        size_t face = 12 * (size_t)number + f;
        for (int i = 0; i < 3; ++i)
            out->mesh.triangles[3 * face + (size_t)i] = 8 * number + box_sides[f][mirrored ? 2 - i : i];
        out->lines[face] = 1 << 0 | 1 << 2;
        memcpy(out->paint + 3 * face, color, sizeof color);
    }
}

static int draw_boxes(tool *t, const loader *l, drawing *out) {
    uint32_t n = l->cut_count;
    if (n >= INT32_MAX / 12) return tool_fail(t, TOOL_DATA, "%u boxes are too many for one picture", n);
    int code = tool_result(t, fct_mesh_create(&t->env, 8 * n, 12 * n, 0, &out->mesh));
    if (code != TOOL_DONE) return code;
    out->paint = tool_allocate(t, 12 * (size_t)n, 3 * sizeof *out->paint);
    out->lines = tool_allocate(t, 12 * (size_t)n, 1);
    if (!out->paint || !out->lines) return TOOL_MEMORY;
    double largest = 0;
    for (uint32_t i = 0; i < n; ++i) largest = fmax(largest, find_box_area(l, l->cuts + i));
    for (uint32_t i = 0; i < n; ++i) {
        const part *p = l->parts + l->cuts[i].part;
        double part_of_all = largest > 0 ? find_box_area(l, l->cuts + i) / largest : 1;
        lay_box(p, l->cuts + i, i, 3e-4 * sqrt(largest / p->scale) * (1 - sqrt(part_of_all)), out);
    }
    out->shading = DRAWING_FLAT;
    return TOOL_DONE;
}

static int draw_parts(tool *t, const drawing_source *source, loader *l, drawing *out) {
    int code = TOOL_DONE;
    if (source->subject != DRAWING_SURFACE) code = make_cuts(t, l, source->count);
    if (code == TOOL_DONE && source->subject == DRAWING_BOXES) return draw_boxes(t, l, out);
    if (code == TOOL_DONE) code = lay_out(t, l, out);
    if (code == TOOL_DONE && source->subject == DRAWING_SURFACE) code = paint_materials(t, l, out);
    if (code == TOOL_DONE && source->subject == DRAWING_CLUSTERS) code = label_clusters(t, l, out);
    return code;
}

static void copy_origin(const double origin[3], drawing *out) {
    memcpy(out->mesh.origin, origin, sizeof out->mesh.origin);
}

int drawing_load(tool *t, const drawing_source *source, drawing *out) {
    loader l = {0};
    bool surface = source->subject == DRAWING_SURFACE, scene;
    int code = find_scene_file(t, source->path, &scene);
    if (code != TOOL_DONE) return code;
    if (surface && !scene && !tool_has_format(t, source->path, "fct"))
        return tool_load_mesh(t, source->path, &out->mesh);
    code = scene ? use_scene(t, source->path, &l, out) : use_tree(t, source, &l);
    if (code == TOOL_DONE) code = draw_parts(t, source, &l, out);
    if (code == TOOL_DONE && l.scene) copy_origin(fct_scene_get(l.scene).origin, out);
    if (code == TOOL_DONE && l.tree) copy_origin(fct_tree_get(l.tree).origin, out);
    tool_release(t, l.cuts);
    tool_release(t, l.parts);
    if (!out->scene) fct_scene_destroy(l.scene);
    fct_tree_destroy(l.tree);
    return code;
}

void drawing_release(tool *t, drawing *d) {
    fct_mesh_release(&t->env, &d->mesh);
    tool_release(t, d->paint);
    tool_release(t, d->glow);
    tool_release(t, d->labels);
    tool_release(t, d->lines);
    tool_release(t, d->normals);
    tool_release(t, d->values);
    tool_release(t, d->starts);
    fct_scene_destroy(d->scene);
}
