/* tools/info.c: facetree info: the contents of a mesh, a hierarchy file or a scene. */
#define _GNU_SOURCE
#include "tools/commands.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "facetree/dual.h"
#include "tools/kit/command.h"
#include "tools/kit/file.h"
#include "tools/kit/model.h"

enum { KEY_VERIFY = TOOL_KEY };

static const struct argp_option info_options_table[] = {
    {"verify", KEY_VERIFY, NULL, 0,
     "Read a whole hierarchy file: check checksums, structure, and the numbers of every node against its "
     "faces",
     0},
    {0}};

static error_t parse_info(int key, char *text, struct argp_state *state) {
    (void)text;
    if (key != KEY_VERIFY) return ARGP_ERR_UNKNOWN;
    *(bool *)state->input = true;
    return 0;
}

static void set_count(json_t *object, const char *key, uint64_t value) {
    json_object_set_new(object, key, json_integer((json_int_t)value));
}

/* Bounds relative to an origin. The origin is printed if it is not 0. */
static void set_bounds(json_t *object, const fct_bounds *bounds, const double origin[3]) {
    json_object_set_new(object, "bounds",
                        json_pack("{s:o, s:o}", "lower", tool_json_point(bounds->lower, origin), "upper",
                                  tool_json_point(bounds->upper, origin)));
    if (origin[0] != 0 || origin[1] != 0 || origin[2] != 0)
        json_object_set_new(object, "origin", json_pack("[f, f, f]", origin[0], origin[1], origin[2]));
}

/* The number of polygons in the file: of runs of equal source_faces. */
static uint32_t count_polygons(const fct_mesh *mesh) {
    uint32_t count = mesh->face_count ? 1 : 0;
    if (!mesh->source_faces) return mesh->face_count;
    for (uint32_t f = 1; f < mesh->face_count; ++f)
        count += mesh->source_faces[f] != mesh->source_faces[f - 1];
    return count;
}

static int describe_mesh(tool *t, const fct_mesh *mesh, json_t *object) {
    fct_mesh_report r;
    uint32_t inward = 0;
    int code = tool_result(t, fct_mesh_inspect(&t->env, mesh, &r));
    if (code == TOOL_DONE) code = tool_result(t, fct_inward_find(&t->env, mesh, &inward, NULL));
    if (code != TOOL_DONE) return code;
    set_count(object, "vertices", r.vertices);
    set_count(object, "faces", r.faces);
    set_count(object, "polygons", count_polygons(mesh));
    set_count(object, "edges", r.edges);
    set_count(object, "boundary_edges", r.boundary_edges);
    set_count(object, "boundary_loops", r.boundary_loops);
    set_count(object, "nonmanifold_edges", r.nonmanifold_edges);
    set_count(object, "misoriented_edges", r.misoriented_edges);
    set_count(object, "nonmanifold_vertices", r.nonmanifold_vertices);
    set_count(object, "degenerate_faces", r.degenerate_faces);
    set_count(object, "duplicate_faces", r.duplicate_faces);
    set_count(object, "unreferenced_vertices", r.unreferenced_vertices);
    set_count(object, "components", r.components);
    set_count(object, "inward_bodies", inward);
    if (!json_object_get(object, "materials")) set_count(object, "materials", mesh->material_count);
    json_object_set_new(object, "vertex_colors", json_boolean(mesh->colors != NULL));
    json_object_set_new(object, "face_colors", json_boolean(mesh->face_colors != NULL));
    json_object_set_new(object, "normals", json_boolean(mesh->normals != NULL));
    json_object_set_new(object, "texture_coordinates", json_boolean(mesh->texcoords != NULL));
    if (r.vertices) set_bounds(object, &r.bounds, mesh->origin);
    json_object_set_new(object, "area", json_real(r.area));
    json_object_set_new(object, "diagonal", json_real(r.diagonal));
    return TOOL_DONE;
}

static json_t *describe_build(const fct_tree_def *def) {
    json_t *object =
        json_pack("{s:s, s:s, s:s, s:f, s:f, s:f, s:I}", "method",
                  def->method == FCT_CLUSTER_ROUNDS ? "rounds" : "greedy", "cost",
                  def->cost == FCT_COST_MEAN ? "mean" : "increment", "fit_measure",
                  def->fit_measure == FCT_FIT_POINTS ? "points" : "area", "fit", def->fit_weight, "direction",
                  def->direction_weight, "shape", def->shape_weight, "roots", (json_int_t)def->root_count);
    json_object_set_new(object, "weld", json_boolean(def->weld));
    if (def->max_cost < 1e300) json_object_set_new(object, "max_cost", json_real(def->max_cost));
    return object;
}

/* The area of the surface, read from the roots alone. */
static int sum_area(tool *t, const fct_tree *tree, double *area) {
    fct_tree_view view = fct_tree_get(tree);
    int code = TOOL_DONE;
    *area = 0;
    for (uint32_t i = 0; i < view.root_count && code == TOOL_DONE; ++i) {
        fct_cluster root = {0};
        uint32_t id = view.roots[i];
        if (id >= view.node_count + view.face_count)
            return tool_fail(t, TOOL_DATA, "%s: root %u is out of range", t->inputs[0], i);
        code = tool_result(t, fct_tree_cluster(tree, id, &root));
        *area += (double)root.area;
    }
    return code;
}

/* The header alone, so that a large file answers at once. */
static int describe_header(tool *t, const fct_tree *tree, json_t *object) {
    fct_tree_view view = fct_tree_get(tree);
    double area, square = 0;
    int code = sum_area(t, tree, &area);
    if (code != TOOL_DONE) return code;
    for (int k = 0; k < 3; ++k) {
        double side = (double)view.bounds.upper[k] - (double)view.bounds.lower[k];
        square += side * side;
    }
    char hash[24];
    snprintf(hash, sizeof hash, "%016" PRIx64, view.source_hash);
    set_count(object, "vertices", view.vertex_count);
    set_count(object, "faces", view.face_count);
    set_count(object, "boundary_edges", view.boundary_edges);
    set_count(object, "nonmanifold_edges", view.nonmanifold_edges);
    set_count(object, "components", view.component_count);
    json_object_set_new(object, "inward", json_boolean(view.inward));
    set_count(object, "materials", view.material_count);
    json_object_set_new(object, "vertex_colors", json_boolean(view.colors != NULL));
    set_bounds(object, &view.bounds, view.origin);
    json_object_set_new(object, "area", json_real(area));
    json_object_set_new(object, "diagonal", json_real(sqrt(square)));
    set_count(object, "roots", view.root_count);
    set_count(object, "inner_nodes", view.node_count);
    set_count(object, "depth", view.depth);
    json_object_set_new(object, "mean_depth", json_real(view.mean_depth));
    json_object_set_new(object, "source", json_string(view.source));
    json_object_set_new(object, "source_hash", json_string(hash));
    json_object_set_new(object, "build", describe_build(&view.def));
    return TOOL_DONE;
}

static int describe_tree(tool *t, const char *path, bool verify, json_t *object) {
    fct_tree *tree;
    struct stat status;
    int code = tool_result(t, fct_tree_open(&t->env, path, &tree));
    if (code != TOOL_DONE) return code;
    if (verify) code = tool_result(t, fct_tree_verify(&t->env, tree));
    if (code == TOOL_DONE) code = describe_header(t, tree, object);
    if (code == TOOL_DONE && stat(path, &status) == 0 && S_ISREG(status.st_mode))
        set_count(object, "file_bytes", (uint64_t)status.st_size);
    if (code == TOOL_DONE && verify) json_object_set_new(object, "verified", json_true());
    fct_tree_destroy(tree);
    return code;
}

/* The width and height of each texture, by its name. */
static void set_textures(json_t *object, const fct_scene_view *view) {
    json_t *sizes = json_object();
    for (uint32_t k = 0; k < view->texture_count; ++k) {
        const fct_texture *x = &view->textures[k];
        json_t *name = tool_json_text(x->name);
        json_object_set_new(sizes, json_string_value(name),
                            json_pack("[I, I]", (json_int_t)x->width, (json_int_t)x->height));
        json_decref(name);
    }
    json_object_set_new(object, "textures", sizes);
}

static int describe_scene(tool *t, const char *path, json_t *object) {
    fct_scene *scene;
    int code = tool_result(t, fct_scene_load(&t->env, path, FCT_BACKEND_OBB, &scene));
    if (code != TOOL_DONE) return code;
    fct_scene_view view = fct_scene_get(scene);
    uint32_t emitters = 0, inward = 0;
    for (uint32_t i = 0; i < view.model_count; ++i) inward += view.models[i].inward;
    for (uint32_t i = 0; i < view.instance_count; ++i) {
        const float *e = view.materials[view.instances[i].material].emission;
        emitters += e[0] > 0 || e[1] > 0 || e[2] > 0;
    }
    set_count(object, "faces", view.face_count);
    set_count(object, "objects", view.object_count);
    set_count(object, "instances", view.instance_count);
    set_count(object, "models", view.model_count);
    set_count(object, "inward_models", inward);
    set_count(object, "materials", view.material_count);
    set_count(object, "emitting_instances", emitters);
    set_textures(object, &view);
    set_count(object, "light_groups", view.light_group_count);
    json_object_set_new(object, "camera", json_boolean(view.camera.given));
    double lower[3], upper[3];
    fct_bounds bounds;
    fct_scene_bounds(scene, lower, upper);
    for (int c = 0; c < 3; ++c) bounds.lower[c] = (float)lower[c], bounds.upper[c] = (float)upper[c];
    set_bounds(object, &bounds, view.origin);
    fct_scene_destroy(scene);
    return TOOL_DONE;
}

/* A glTF file is a mesh, and also a scene unless it stores light or has no faces. A pipe
 * cannot be read again: it is a mesh only. */
static int describe_mesh_file(tool *t, const char *path, json_t *object) {
    fct_mesh mesh;
    struct stat status;
    bool lit = false, gltf = tool_is_gltf(t, path);
    int code = tool_result(t, fct_mesh_load(&t->env, path, &mesh));
    if (code != TOOL_DONE) return code;
    if (gltf) code = tool_result(t, fct_mesh_file_holds_light(&t->env, path, &lit));
    bool again = stat(path, &status) == 0 && S_ISREG(status.st_mode);
    bool scene = gltf && again && !lit && mesh.face_count;
    json_object_set_new(object, "kind", json_string(scene ? "scene" : "mesh"));
    if (code == TOOL_DONE && scene) code = describe_scene(t, path, object);
    if (code == TOOL_DONE) code = describe_mesh(t, &mesh, object);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static int describe_file(tool *t, const char *path, bool verify, json_t **out) {
    bool tree = tool_has_format(t, path, "fct"), scene = tool_is_scene(t, path);
    if (verify && !tree)
        return tool_fail(t, TOOL_USAGE, "--verify: expected a hierarchy file (.fct), found '%s'", path);
    json_t *object = *out = json_pack("{s:o, s:s}", "file", tool_json_text(path), "kind",
                                      tree    ? "hierarchy"
                                      : scene ? "scene"
                                              : "mesh");
    int code;
    if (!object) {
        code = tool_fail(t, TOOL_MEMORY, "out of memory for the answer");
    } else if (tree) {
        code = describe_tree(t, path, verify, object);
    } else if (scene) {
        code = describe_scene(t, path, object);
    } else {
        code = describe_mesh_file(t, path, object);
    }
    return code;
}

/* --- Folders --- */

static int is_known_entry(const struct dirent *entry) {
    const char *name = entry->d_name;
    return name[0] != '.' && (tool_is_mesh_name(name) || tool_ends(name, "fct") || tool_ends(name, "gltf") ||
                              !strcmp(name, "scene.json"));
}

/* A line: the file, and its counts or its error. */
static void say_file(tool *t, const json_t *object) {
    const char *error = json_string_value(json_object_get(object, "error"));
    const char *file = json_string_value(json_object_get(object, "file"));
    if (error)
        tool_say(t, "%s", error);
    else
        tool_say(t, "%s: %s, %.0f faces, %.0f vertices, %.0f components", file,
                 json_string_value(json_object_get(object, "kind")),
                 json_number_value(json_object_get(object, "faces")),
                 json_number_value(json_object_get(object, "vertices")),
                 json_number_value(json_object_get(object, "components")));
}

/* Describes a file of a folder. A failure becomes the member "error"; *worst keeps the first exit code. */
static int add_file(tool *t, const char *path, bool verify, json_t *files, int *worst) {
    json_t *object = NULL;
    int code = describe_file(t, path, verify && tool_ends(path, "fct"), &object);
    if (code == TOOL_CANCELLED || !object) {
        json_decref(object);
        return code;
    }
    if (code != TOOL_DONE) {
        json_object_set_new(object, "error", tool_json_text(t->error));
        t->error[0] = 0;
        if (*worst == TOOL_DONE) *worst = code;
    }
    say_file(t, object);
    return json_array_append_new(files, object) ? tool_fail(t, TOOL_MEMORY, "out of memory for the answer")
                                                : TOOL_DONE;
}

static int describe_folder(tool *t, const char *folder, bool verify) {
    struct dirent **entries;
    int count = scandir(folder, &entries, is_known_entry, alphasort), failed, worst = TOOL_DONE;
    if (count < 0) return tool_fail(t, TOOL_INPUT, "%s: cannot be read: %s", folder, strerror(errno));
    int code =
        count ? TOOL_DONE : tool_fail(t, TOOL_INPUT, "%s: expected meshes or scenes, found none", folder);
    json_t *files = json_array();
    for (int i = 0; i < count; ++i) {
        char path[PATH_MAX];
        snprintf(path, sizeof path, "%s%s%s", folder, folder[strlen(folder) - 1] == '/' ? "" : "/",
                 entries[i]->d_name);
        if (code == TOOL_DONE) code = add_file(t, path, verify, files, &worst);
        free(entries[i]);
    }
    free(entries);
    failed = code == TOOL_DONE && worst != TOOL_DONE;
    if (code == TOOL_DONE) code = tool_json(t, json_pack("{s:O}", "files", files));
    json_decref(files);
    return failed && code == TOOL_DONE ? tool_fail(t, worst, "%s: not every file can be read", folder) : code;
}

static int run_info(tool *t, void *options) {
    bool verify = *(bool *)options;
    json_t *object = NULL;
    if (tool_is_folder(t->inputs[0])) return describe_folder(t, t->inputs[0], verify);
    int code = describe_file(t, t->inputs[0], verify, &object);
    if (code == TOOL_DONE) return tool_print(t, object);
    json_decref(object);
    return code;
}

int tool_info(int argc, char **argv) {
    static const tool_stage stages[] = {{"read", 25}, {"inspect", 75}, {0}};
    static const tool_command command = {
        .name = "info",
        .synopsis = "FILE",
        .summary = "count what a file holds; check a hierarchy file",
        .text = "FILE is a mesh, a hierarchy file (.fct), a scene.json, a glTF file (.gltf, .glb), whose "
                "mesh and scene are both counted, or a folder of them: then each "
                "file has a line, and --json lists the files in files[], with error for one that cannot be "
                "read.\n\n"
                "For a mesh it counts vertices, faces, the polygons that the faces come from, edges "
                "(boundary, non-manifold and "
                "misoriented ones), components, closed bodies that are wound inwards, and degenerate and "
                "duplicate faces. For a hierarchy it "
                "prints the header, which is "
                "fast for files of any size: vertices, faces, boundary and non-manifold edges, components, "
                "bounds, depth, roots, whether the surface is wound inwards, and "
                "the source and options of the build.\n\n"
                "--verify reads the whole hierarchy. It checks checksums, links, ranges and depth. For every "
                "node it checks that box "
                "and cone contain the faces, and that area, moment, centroid and plane match them. If a "
                "check fails, the message says "
                "which, and the exit code is 65.\n\nJSON keys: as printed.",
        .examples = "  facetree info bunny.obj\n"
                    "  facetree info meshes/\n"
                    "  facetree info bunny.fct --verify",
        .options = info_options_table,
        .parse = parse_info,
        .run = run_info,
        .stages = stages,
        .inputs_min = 1,
        .inputs_max = 1,
        .output = TOOL_OUTPUT_UNUSED};
    bool verify = false;
    return tool_main(&command, argc, argv, &verify);
}
