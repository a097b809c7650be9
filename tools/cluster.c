/* tools/cluster.c: facetree cluster: mesh files to hierarchy files. Several files are shared out to one
 * process a core, so that small and large ones keep all cores busy. */
#define _GNU_SOURCE
#include "tools/tool.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum {
    KEY_METHOD = TOOL_KEY,
    KEY_COST,
    KEY_FIT,
    KEY_DIRECTION,
    KEY_SHAPE,
    KEY_FIT_MEASURE,
    KEY_ROOTS,
    KEY_MAX_COST
};

static const struct argp_option options_table[] = {
    {"method", KEY_METHOD, "NAME", 0,
     "rounds: all mutually cheapest pairs at once (default); greedy: the cheapest merge first", 0},
    {"cost", KEY_COST, "COST", 0,
     "increment: growth of the total error (default); mean: mean error of the union", 0},
    {"fit", KEY_FIT, "W", 0, "Weight of the distance to the plane (default: as suits the cost)", 0},
    {"direction", KEY_DIRECTION, "W", 0, "Weight of the deviation of normals", 0},
    {"shape", KEY_SHAPE, "W", 0, "Weight of irregular borders", 0},
    {"fit-measure", KEY_FIT_MEASURE, "MEASURE", 0,
     "area: over the surface (default); points: over the corners", 0},
    {"roots", KEY_ROOTS, "N", 0, "Stop at N clusters (default 1)", 0},
    {"max-cost", KEY_MAX_COST, "C", 0, "Make no merge that costs more; what is left over are roots", 0},
    {0}};

static error_t parse(int key, char *text, struct argp_state *state) {
    static const char *const methods[] = {"greedy", "rounds", NULL},
                             *const costs[] = {"increment", "mean", NULL},
                             *const measures[] = {"area", "points", NULL};
    static const fct_cluster_method method_values[] = {FCT_CLUSTER_GREEDY, FCT_CLUSTER_ROUNDS};
    static const fct_cluster_cost cost_values[] = {FCT_COST_INCREMENT, FCT_COST_MEAN};
    static const fct_fit_measure measure_values[] = {FCT_FIT_AREA, FCT_FIT_POINTS};
    fct_tree_def *def = state->input;
    int index = 0;
    error_t error;
    switch (key) {
    case KEY_METHOD:
        error = tool_parse_choice(state, "--method", text, methods, &index);
        def->method = method_values[index];
        return error;
    case KEY_COST:
        error = tool_parse_choice(state, "--cost", text, costs, &index);
        def->cost = cost_values[index];
        return error;
    case KEY_FIT_MEASURE:
        error = tool_parse_choice(state, "--fit-measure", text, measures, &index);
        def->fit_measure = measure_values[index];
        return error;
    case KEY_FIT:
        return tool_parse_real(state, "--fit", text, 0, 1e30, &def->fit_weight);
    case KEY_DIRECTION:
        return tool_parse_real(state, "--direction", text, 0, 1e30, &def->direction_weight);
    case KEY_SHAPE:
        return tool_parse_real(state, "--shape", text, 0, 1e30, &def->shape_weight);
    case KEY_ROOTS:
        return tool_parse_count32(state, "--roots", text, 1, FCT_NONE - 1, &def->root_count);
    case KEY_MAX_COST:
        return tool_parse_real(state, "--max-cost", text, 0, INFINITY, &def->max_cost);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* --- One file --- */

static json_t *report(const fct_tree *tree, const fct_tree_stats *stats, double read, double write,
                      double total, const char *output) {
    fct_tree_view view = fct_tree_get(tree);
    struct stat status;
    bool regular = strcmp(output, "-") != 0 && stat(output, &status) == 0 && S_ISREG(status.st_mode);
    return json_pack("{s:I, s:I, s:I, s:I, s:f, s:{s:f, s:f, s:f, s:f, s:f, s:f}, s:I, s:I}", "faces",
                     (json_int_t)view.face_count, "vertices", (json_int_t)view.vertex_count, "roots",
                     (json_int_t)view.root_count, "depth", (json_int_t)view.depth, "mean_depth",
                     view.mean_depth, "seconds", "read", read, "dual", stats->seconds_dual, "contract",
                     stats->seconds_contract, "boxes", stats->seconds_boxes, "write", write, "total", total,
                     "peak_bytes", (json_int_t)tool_peak_bytes(), "file_bytes",
                     (json_int_t)(regular ? status.st_size : 0));
}

/* Reads, clusters and writes; *out receives the report. */
static int cluster_file(tool *t, const fct_tree_def *options, const char *input, const char *output,
                        json_t **out) {
    fct_tree_def def = *options;
    fct_mesh mesh = {0};
    fct_tree *tree = NULL;
    fct_tree_stats stats = {0};
    double start = tool_seconds();
    int code = TOOL_DONE;
    if (strcmp(input, "-") != 0) code = tool_hash_file(t, input, &def.source_hash);
    if (code == TOOL_DONE) code = tool_load_mesh(t, input, &mesh);
    if (code != TOOL_DONE) goto done;
    if (mesh.face_count == 0) {
        code = tool_fail(t, TOOL_DATA, "%s: expected at least one face, found none", input);
        goto done;
    }
    if (def.root_count > mesh.face_count) {
        code = tool_fail(t, TOOL_USAGE, "--roots %u: %s has only %u faces", def.root_count, input,
                         mesh.face_count);
        goto done;
    }
    double read = tool_seconds() - start;
    const char *slash = strrchr(input, '/');
    def.source = strcmp(input, "-") == 0 ? "standard input" : slash ? slash + 1 : input;
    t->items = mesh.face_count;
    t->unit = "faces";
    code = tool_result(t, fct_tree_build(&t->env, &mesh, &def, &stats, &tree));
    if (tool_context(t, code, input) != TOOL_DONE) goto done;
    double before = tool_seconds();
    code = tool_result(t, fct_tree_save(&t->env, tree, output));
    double end = tool_seconds();
    if (code == TOOL_DONE) *out = report(tree, &stats, read, end - before, end - start, output);
done:
    fct_tree_destroy(tree);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

static double number(const json_t *object, const char *key) {
    return json_number_value(json_object_get(object, key));
}

static void say_report(tool *t, const char *input, const json_t *r) {
    tool_say(t, "%s: %.0f faces, %.0f root%s, depth %.0f (mean %.1f), %.2f s, %.1f MB", input,
             number(r, "faces"), number(r, "roots"), number(r, "roots") == 1 ? "" : "s", number(r, "depth"),
             number(r, "mean_depth"), number(json_object_get(r, "seconds"), "total"),
             number(r, "file_bytes") / 1e6);
}

static int cluster_one(tool *t, const fct_tree_def *def) {
    json_t *r = NULL;
    int code = tool_check_output(t, t->output);
    if (code == TOOL_DONE) code = cluster_file(t, def, t->inputs[0], t->output, &r);
    if (code != TOOL_DONE) return code;
    say_report(t, t->inputs[0], r);
    return tool_json(t, r);
}

/* --- Several files --- */

typedef struct job {
    char *input, *output;
    pid_t process;
    int pipe, code;
    json_t *report;
} job;

typedef struct jobs {
    job *list;
    int count, capacity;
} jobs;

static int add_job(tool *t, jobs *all, const char *folder, const char *name) {
    if (all->count == all->capacity) {
        int larger = all->capacity ? 2 * all->capacity : 16;
        job *list = realloc(all->list, (size_t)larger * sizeof *list);
        if (!list) return tool_fail(t, TOOL_MEMORY, "out of memory for the list of files");
        all->list = list, all->capacity = larger;
    }
    char stem[NAME_MAX + 1], path[PATH_MAX], output[PATH_MAX];
    if ((size_t)snprintf(path, sizeof path, "%s%s%s", folder ? folder : "", folder ? "/" : "", name) >=
        sizeof path)
        return tool_fail(t, TOOL_INPUT, "%s/%s: the name is too long", folder, name);
    tool_stem(path, stem, sizeof stem);
    if ((size_t)snprintf(output, sizeof output, "%s/%s.fct", t->output, stem) >= sizeof output)
        return tool_fail(t, TOOL_OUTPUT, "%s/%s.fct: the name is too long", t->output, stem);
    for (int i = 0; i < all->count; ++i)
        if (!strcmp(all->list[i].output, output))
            return tool_fail(t, TOOL_USAGE, "%s and %s would both be written to %s", all->list[i].input, path,
                             output);
    job *j = all->list + all->count;
    *j = (job){.input = strdup(path), .output = strdup(output), .pipe = -1};
    ++all->count;
    return j->input && j->output ? TOOL_DONE
                                 : tool_fail(t, TOOL_MEMORY, "out of memory for the list of files");
}

static int is_mesh_entry(const struct dirent *entry) {
    return tool_is_mesh_name(entry->d_name) && entry->d_name[0] != '.';
}

static int add_folder(tool *t, jobs *all, const char *folder) {
    struct dirent **entries;
    int count = scandir(folder, &entries, is_mesh_entry, alphasort);
    if (count < 0) return tool_fail(t, TOOL_INPUT, "%s: cannot be read: %s", folder, strerror(errno));
    int code = count ? TOOL_DONE : tool_fail(t, TOOL_INPUT, "%s: expected mesh files, found none", folder);
    for (int i = 0; i < count; ++i) {
        if (code == TOOL_DONE) code = add_job(t, all, folder, entries[i]->d_name);
        free(entries[i]);
    }
    free(entries);
    return code;
}

/* Never returns: the work of one process, which sends its report through the pipe. */
static void work(tool *t, const fct_tree_def *def, const job *j, int out, uint32_t processes) {
    json_t *r = NULL;
    t->env.thread_count = t->threads > processes ? t->threads / processes : 1;
    t->bar_off = true;
    if (t->max_memory) t->max_memory = t->max_memory / processes + 1;
    int code = cluster_file(t, def, j->input, j->output, &r);
    if (r && json_dumpfd(r, out, JSON_COMPACT))
        code = tool_fail(t, TOOL_INTERNAL, "%s: the report was lost", j->input);
    _exit(tool_env_close(t, code));
}

static int start(tool *t, const fct_tree_def *def, job *j, uint32_t processes) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC)) return tool_fail(t, TOOL_INTERNAL, "no pipe: %s", strerror(errno));
    j->process = fork();
    if (j->process == 0) {
        close(ends[0]);
        work(t, def, j, ends[1], processes);
    }
    close(ends[1]);
    j->pipe = ends[0];
    if (j->process > 0) return TOOL_DONE;
    close(j->pipe);
    return tool_fail(t, TOOL_INTERNAL, "no process: %s", strerror(errno));
}

static void take(tool *t, job *j, int status) {
    j->code = WIFEXITED(status) ? WEXITSTATUS(status) : TOOL_INTERNAL;
    if (WIFSIGNALED(status)) tool_warn(t, "%s: ended by signal %d", j->input, WTERMSIG(status));
    if (j->code == TOOL_DONE) j->report = json_loadfd(j->pipe, 0, NULL);
    if (j->code == TOOL_DONE && !j->report) j->code = TOOL_INTERNAL;
    close(j->pipe);
    j->process = 0;
    if (j->report) say_report(t, j->input, j->report);
}

static void stop_all(const jobs *all) {
    for (int i = 0; i < all->count; ++i)
        if (all->list[i].process > 0) kill(all->list[i].process, SIGTERM);
}

/* Keeps `processes` at work until all files are done. */
static int run_jobs(tool *t, const fct_tree_def *def, jobs *all, uint32_t processes) {
    int code = TOOL_DONE, next = 0, running = 0, finished = 0;
    fflush(NULL);
    while (running > 0 || (next < all->count && code == TOOL_DONE)) {
        if (next < all->count && running < (int)processes && code == TOOL_DONE) {
            code = start(t, def, all->list + next, processes);
            if (code == TOOL_DONE) ++running, ++next;
            continue;
        }
        int status;
        pid_t process = waitpid(-1, &status, 0);
        for (int i = 0; i < next && process > 0; ++i)
            if (all->list[i].process == process) take(t, all->list + i, status), --running, ++finished;
        if (!t->env.progress(t, "files", (double)finished / all->count) && code == TOOL_DONE) {
            code = tool_fail(t, TOOL_CANCELLED, "cancelled");
            stop_all(all);
        }
    }
    return code;
}

/* Sums (the deepest tree, the mean depth over all faces, the largest process) and each file's own report. */
static json_t *sum_reports(const jobs *all, double seconds) {
    static const char *const phases[] = {"read", "dual", "contract", "boxes", "write"};
    double phase_sums[5] = {0}, faces = 0, vertices = 0, roots = 0, depth = 0, mean = 0, peak = 0, bytes = 0;
    json_t *files = json_array();
    for (int i = 0; i < all->count; ++i) {
        json_t *r = all->list[i].report, *times = json_object_get(r, "seconds");
        if (!r) continue;
        for (int p = 0; p < 5; ++p) phase_sums[p] += number(times, phases[p]);
        faces += number(r, "faces"), vertices += number(r, "vertices"), roots += number(r, "roots");
        mean += number(r, "mean_depth") * number(r, "faces"), bytes += number(r, "file_bytes");
        depth = fmax(depth, number(r, "depth")), peak = fmax(peak, number(r, "peak_bytes"));
        json_object_set_new(r, "input", json_string(all->list[i].input));
        json_object_set_new(r, "output", json_string(all->list[i].output));
        json_array_append(files, r);
    }
    return json_pack("{s:I, s:I, s:I, s:I, s:f, s:{s:f, s:f, s:f, s:f, s:f, s:f}, s:I, s:I, s:o}", "faces",
                     (json_int_t)faces, "vertices", (json_int_t)vertices, "roots", (json_int_t)roots, "depth",
                     (json_int_t)depth, "mean_depth", faces > 0 ? mean / faces : 0, "seconds", "read",
                     phase_sums[0], "dual", phase_sums[1], "contract", phase_sums[2], "boxes", phase_sums[3],
                     "write", phase_sums[4], "total", seconds, "peak_bytes", (json_int_t)peak, "file_bytes",
                     (json_int_t)bytes, "files", files);
}

static int cluster_many(tool *t, const fct_tree_def *def) {
    jobs all = {0};
    int code = TOOL_DONE, failed = 0, worst = TOOL_DONE;
    for (int i = 0; i < t->input_count && code == TOOL_DONE; ++i)
        code = tool_is_folder(t->inputs[i]) ? add_folder(t, &all, t->inputs[i])
                                            : add_job(t, &all, NULL, t->inputs[i]);
    if (code == TOOL_DONE) code = tool_check_folder(t, t->output);
    if (code != TOOL_DONE) goto done;
    if (!t->threads) t->threads = (uint32_t)sysconf(_SC_NPROCESSORS_ONLN);
    code = run_jobs(t, def, &all, t->threads < (uint32_t)all.count ? t->threads : (uint32_t)all.count);
    for (int i = all.count - 1; i >= 0; --i)
        if (all.list[i].code != TOOL_DONE) ++failed, worst = all.list[i].code;
    /* Each failure has been told by its process. */
    if (code == TOOL_DONE && failed) {
        code = tool_fail(t, worst, "%d of %d files failed", failed, all.count);
        t->error_told = failed == 1;
    }
    if (code == TOOL_DONE) code = tool_json(t, sum_reports(&all, tool_seconds() - t->start));
done:
    for (int i = 0; i < all.count; ++i) {
        free(all.list[i].input);
        free(all.list[i].output);
        json_decref(all.list[i].report);
    }
    free(all.list);
    return code;
}

static int run(tool *t, void *options) {
    size_t length = strlen(t->output);
    bool several = t->input_count > 1 || tool_is_folder(t->inputs[0]) || tool_is_folder(t->output) ||
                   t->output[length - 1] == '/';
    return several ? cluster_many(t, options) : cluster_one(t, options);
}

int tool_cluster(int argc, char **argv) {
    static const tool_command command = {
        .name = "cluster",
        .synopsis = "IN... -o OUT.fct",
        .summary = "build the hierarchy of face clusters of a mesh",
        .text = "IN is a mesh file (OBJ, PLY, OFF, STL, OM, GLB; - reads a PLY), OUT.fct the hierarchy file. "
                "Several "
                "files, or a folder of them, are clustered over all cores, and -o names a folder that "
                "receives one "
                "NAME.fct for each. A scene that finds NAME.fct beside a model NAME.ply opens it.\n\n"
                "JSON keys: faces, vertices, roots, depth, mean_depth, seconds{read, dual, contract, boxes, "
                "write, "
                "total}, peak_bytes, file_bytes; for several files their sums, and files[].",
        .options = options_table,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = INT_MAX,
        .output = TOOL_OUTPUT_REQUIRED,
        .output_folder = true};
    fct_tree_def def = fct_tree_def_default();
    return tool_main(&command, argc, argv, &def);
}
