/* Whatever the text is: an error with a line of text, or rays and points that every query of a model answers.
 */
#include "facetree/bvh.h"
#include "fuzz/fuzz_bytes.h"
#include "tools/kit/rows.h"

/* Models that the rays are shot at: a box, and faces around an edge. They live as long as the process. */
enum { MODELS = 2 };
static fct_bvh *models[MODELS];

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerInitialize(int *argc, char ***argv) {
    static fuzz_limit limit;
    static fct_env env;
    (void)argc, (void)argv;
    env = fuzz_env(&limit, 0);
    for (int i = 0; i < MODELS; ++i) {
        fct_mesh mesh = i ? fuzz_make_fan(&env, 9, true, 0) : fuzz_make_box(&env, false, 0);
        fct_tree *tree;
        fuzz_require(fct_tree_build(&env, &mesh, NULL, NULL, &tree) == FCT_OK, "a tree");
        fuzz_require(fct_bvh_create(&env, tree, FCT_BACKEND_OBB, models + i) == FCT_OK, "a model");
        fct_mesh_release(&env, &mesh);
    }
    return 0;
}

static int read_text(tool *t, const uint8_t *data, size_t size, int least, int columns, const double *missing,
                     tool_rows *rows) {
    FILE *file = fmemopen((void *)data, size, "r");
    fuzz_require(file != NULL, "a file in memory");
    const tool_row_format format = {.least = least, .columns = columns, .missing = missing};
    int code = tool_rows_parse(t, "text", file, &format, rows);
    fclose(file);
    fuzz_require(code == TOOL_DONE || (code == TOOL_DATA && t->error[0] && !rows->values),
                 "rows, or an error");
    for (size_t i = 0; i < rows->count * (size_t)columns; ++i) {
        double value = rows->values[i];
        bool must_be_finite = i % (size_t)columns < (size_t)least;
        fuzz_require(isfinite((float)value) || (isinf(value) && !must_be_finite),
                     "a number that fits a float");
    }
    return code;
}

static void shoot(const fct_bvh *bvh, const double *row) {
    fct_ray ray = {.t_min = (float)row[6], .t_max = (float)row[7]};
    for (int k = 0; k < 3; ++k) ray.origin[k] = (float)row[k], ray.direction[k] = (float)row[3 + k];
    fct_hit hit;
    bool found = fct_bvh_closest_hit(bvh, &ray, &hit, NULL);
    uint32_t faces = fct_tree_get(fct_bvh_tree(bvh)).face_count;
    fuzz_require(found == (hit.face != FCT_NONE), "a hit has a face");
    fuzz_require(found == fct_bvh_any_hit(bvh, &ray, NULL), "both kinds of ray agree");
    if (found)
        fuzz_require(hit.face < faces && hit.t >= ray.t_min && hit.t <= ray.t_max, "a hit is in the range");
}

/* A box of one unit has a nearest point for every point, at most at its distance from a corner. */
static void find_nearest(const fct_bvh *bvh, const float *point) {
    fct_closest closest, two[2];
    bool found = fct_bvh_closest_point(bvh, point, INFINITY, &closest, NULL);
    double away = hypot(hypot((double)point[0], (double)point[1]), (double)point[2]);
    fuzz_require(found && closest.face < fct_tree_get(fct_bvh_tree(bvh)).face_count, "a nearest point");
    fuzz_require((double)closest.distance <= away * (1 + 1e-6) + 1e-6, "no corner is nearer");
    for (int k = 0; k < 3; ++k)
        fuzz_require(closest.point[k] >= -1.0001F && closest.point[k] <= 1.0001F, "a point of the model");
    fuzz_require(fct_bvh_nearest(bvh, point, 2, INFINITY, two, NULL) == 2 && two[0].face == closest.face &&
                     two[1].distance >= closest.distance,
                 "the nearest of two faces");
    uint32_t least,
        found_count = fct_bvh_faces_in_ball(bvh, point, closest.distance * 1.0001F + 1e-30F, 1, &least, NULL);
    fuzz_require(found_count >= 1 && least <= closest.face, "a ball that touches the model");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const double usual[2] = {0, INFINITY}, origin[3] = {0};
    if (!size) return 0;
    tool t = {.name = "fuzz"};
    tool_rows rows;
    if (read_text(&t, data, size, 6, 8, usual, &rows) == TOOL_DONE)
        for (size_t i = 0; i < rows.count * MODELS; ++i)
            shoot(models[i % MODELS], rows.values + i / MODELS * 8);
    tool_rows_release(&t, &rows);
    if (read_text(&t, data, size, 3, 3, NULL, &rows) == TOOL_DONE) {
        float *points = tool_allocate(&t, rows.count, 3 * sizeof *points);
        tool_rows_points(&rows, 3, 0, origin, points);
        for (size_t i = 0; i < rows.count * MODELS; ++i)
            find_nearest(models[i % MODELS], points + i / MODELS * 3);
        tool_release(&t, points);
    }
    tool_rows_release(&t, &rows);
    return 0;
}
