/* tools/cluster.c: facetree cluster: mesh files to hierarchy files. Several files are shared out to one
 * process a core, so that small and large ones keep all cores busy. */
#define _GNU_SOURCE
#include "tools/kit/tool.h"

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
    KEY_MAX_COST,
    KEY_TEMPORARY
};

typedef struct cluster_options {
    fct_tree_def def;
    const char *temporary; /* folder, or NULL */
} cluster_options;

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
    {"temporary", KEY_TEMPORARY, "FOLDER", 0,
     "Temporary files of a mesh that does not fit into --max-memory go to FOLDER (default: beside the "
     "output)",
     0},
    {0}};

static error_t parse(int key, char *text, struct argp_state *state) {
    static const char *const methods[] = {"greedy", "rounds", NULL},
                             *const costs[] = {"increment", "mean", NULL},
                             *const measures[] = {"area", "points", NULL};
    static const fct_cluster_method method_values[] = {FCT_CLUSTER_GREEDY, FCT_CLUSTER_ROUNDS};
    static const fct_cluster_cost cost_values[] = {FCT_COST_INCREMENT, FCT_COST_MEAN};
    static const fct_fit_measure measure_values[] = {FCT_FIT_AREA, FCT_FIT_POINTS};
    cluster_options *options = state->input;
    fct_tree_def *def = &options->def;
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
    case KEY_TEMPORARY:
        options->temporary = text;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* --- One file --- */

/* The stats' times are those of a build in memory, too. */
static json_t *report(const fct_large_stats *s, double total, const char *output) {
    struct stat status;
    bool regular = strcmp(output, "-") != 0 && stat(output, &status) == 0 && S_ISREG(status.st_mode);
    return json_pack("{s:I, s:I, s:I, s:I, s:f, s:I, s:{s:f, s:f, s:f, s:f, s:f, s:f}, s:I, s:I}", "faces",
                     (json_int_t)s->face_count, "vertices", (json_int_t)s->vertex_count, "roots",
                     (json_int_t)s->root_count, "depth", (json_int_t)s->depth, "mean_depth", s->mean_depth,
                     "parts", (json_int_t)s->part_count, "seconds", "read", s->seconds_read, "dual",
                     s->seconds_dual, "contract", s->seconds_contract, "boxes", s->seconds_boxes, "write",
                     s->seconds_write, "total", total, "peak_bytes", (json_int_t)tool_peak_bytes(),
                     "file_bytes", (json_int_t)(regular ? status.st_size : 0));
}

static int check_faces(tool *t, const fct_tree_def *def, const char *input, uint32_t faces) {
    if (faces == 0) return tool_fail(t, TOOL_DATA, "%s: expected at least one face, found none", input);
    if (def->root_count > faces)
        return tool_fail(t, TOOL_USAGE, "--roots %u: %s has only %u faces", def->root_count, input, faces);
    return TOOL_DONE;
}

/* What --max-memory leaves to be allocated. */
static size_t memory_left(const tool *t) {
    if (!t->max_memory) return SIZE_MAX;
    return t->max_memory > t->memory_now ? t->max_memory - t->memory_now : 0;
}

static bool fits(const tool *t, const fct_tree_def *def, uint32_t faces, uint32_t vertices) {
    return fct_tree_build_need(faces, vertices, def).in_memory <= memory_left(t);
}

/* All of it in memory. Where that turns out not to fit it is given up, with *large set. */
static int cluster_in_memory(tool *t, const fct_tree_def *def, const char *input, const char *output,
                             bool *large, fct_large_stats *s) {
    fct_mesh mesh = {0};
    fct_tree *tree = NULL;
    fct_tree_stats stats = {0};
    double start = tool_seconds();
    int code = tool_load_mesh(t, input, &mesh);
    if (code == TOOL_DONE) code = check_faces(t, def, input, mesh.face_count);
    if (code != TOOL_DONE) goto done;
    *large = strcmp(input, "-") != 0 && !fits(t, def, mesh.face_count, 0); /* the mesh is there already */
    if (*large) goto done;
    t->items = mesh.face_count;
    t->unit = "faces";
    double read = tool_seconds();
    code = tool_result(t, fct_tree_build(&t->env, &mesh, def, &stats, &tree));
    *large = code == TOOL_MEMORY && t->max_memory && strcmp(input, "-") != 0;
    if (*large) { /* it took more than the estimate */
        t->error[0] = 0, t->memory_refused = false;
        code = TOOL_DONE;
        goto done;
    }
    if (tool_context(t, code, input) != TOOL_DONE) goto done;
    double built = tool_seconds();
    code = tool_result(t, fct_tree_save(&t->env, tree, output));
    fct_tree_view view = fct_tree_get(tree);
    *s = (fct_large_stats){view.face_count,     view.vertex_count,
                           view.root_count,     view.depth,
                           view.mean_depth,     1,
                           view.root_count,     read - start,
                           stats.seconds_dual,  stats.seconds_contract,
                           stats.seconds_boxes, tool_seconds() - built};
done:
    fct_tree_destroy(tree);
    fct_mesh_release(&t->env, &mesh);
    return code;
}

/* Reads, clusters and writes; *out receives the report. */
static int cluster_file(tool *t, const cluster_options *options, const char *input, const char *output,
                        json_t **out) {
    fct_tree_def def = options->def;
    fct_large_stats stats = {0};
    double start = tool_seconds();
    bool standard = strcmp(input, "-") == 0, known = false, large = false;
    uint32_t faces = 0, vertices = 0;
    int code = standard ? TOOL_DONE : tool_hash_file(t, input, &def.source_hash);
    if (code == TOOL_DONE && t->max_memory && tool_ends(input, "ply"))
        code = tool_result(t, fct_mesh_file_counts(&t->env, input, &known, &faces, &vertices));
    if (code == TOOL_DONE && known) code = check_faces(t, &def, input, faces);
    if (code != TOOL_DONE) return code;
    const char *slash = strrchr(input, '/');
    def.source = standard ? "standard input" : slash ? slash + 1 : input;
    double hashed = tool_seconds() - start;
    large = known && !fits(t, &def, faces, vertices);
    if (!large) code = cluster_in_memory(t, &def, input, output, &large, &stats);
    if (large) {
        fct_large_def limits = fct_large_def_default();
        limits.max_memory = memory_left(t);
        uint64_t least = known ? fct_tree_build_need(faces, vertices, &def).in_parts : 0;
        if (limits.max_memory < least)
            return tool_fail(t, TOOL_MEMORY, "%s: --max-memory %zu: a tree of %u faces takes at least %llu",
                             input, t->max_memory, faces,
                             (unsigned long long)(least + (t->max_memory - limits.max_memory)));
        limits.temporary_folder = options->temporary;
        t->items = faces;
        t->unit = "faces";
        code = tool_result(t, fct_tree_build_file(&t->env, input, output, &def, &limits, &stats));
        tool_context(t, code, input);
    }
    stats.seconds_read += hashed;
    if (code == TOOL_DONE) *out = report(&stats, tool_seconds() - start, output);
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

static int cluster_one(tool *t, const cluster_options *options) {
    json_t *r = NULL;
    int code = tool_check_output(t, t->output);
    if (code == TOOL_DONE) code = cluster_file(t, options, t->inputs[0], t->output, &r);
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
static void work(tool *t, const cluster_options *options, const job *j, int out, uint32_t processes) {
    json_t *r = NULL;
    t->env.thread_count = t->threads > processes ? t->threads / processes : 1;
    t->bar_off = true;
    if (t->max_memory) t->max_memory = t->max_memory / processes + 1;
    int code = cluster_file(t, options, j->input, j->output, &r);
    if (r && json_dumpfd(r, out, JSON_COMPACT))
        code = tool_fail(t, TOOL_INTERNAL, "%s: the report was lost", j->input);
    _exit(tool_env_close(t, code));
}

static int start(tool *t, const cluster_options *options, job *j, uint32_t processes) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC)) return tool_fail(t, TOOL_INTERNAL, "no pipe: %s", strerror(errno));
    j->process = fork();
    if (j->process == 0) {
        close(ends[0]);
        work(t, options, j, ends[1], processes);
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
static int run_jobs(tool *t, const cluster_options *options, jobs *all, uint32_t processes) {
    int code = TOOL_DONE, next = 0, running = 0, finished = 0;
    fflush(NULL);
    while (running > 0 || (next < all->count && code == TOOL_DONE)) {
        if (next < all->count && running < (int)processes && code == TOOL_DONE) {
            code = start(t, options, all->list + next, processes);
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

static int cluster_many(tool *t, const cluster_options *options) {
    jobs all = {0};
    int code = TOOL_DONE, failed = 0, worst = TOOL_DONE;
    for (int i = 0; i < t->input_count && code == TOOL_DONE; ++i)
        code = tool_is_folder(t->inputs[i]) ? add_folder(t, &all, t->inputs[i])
                                            : add_job(t, &all, NULL, t->inputs[i]);
    if (code == TOOL_DONE) code = tool_check_folder(t, t->output);
    if (code != TOOL_DONE) goto done;
    if (!t->threads) t->threads = (uint32_t)sysconf(_SC_NPROCESSORS_ONLN);
    code = run_jobs(t, options, &all, t->threads < (uint32_t)all.count ? t->threads : (uint32_t)all.count);
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
        .text =
            "IN is a mesh file (OBJ, PLY, OFF, STL, OM, GLB; - reads a PLY), OUT.fct the hierarchy file. "
            "Several "
            "files, or a folder of them, are clustered over all cores, and -o names a folder that "
            "receives one "
            "NAME.fct for each. A scene that finds NAME.fct beside a model NAME.ply opens it.\n\n"
            "A mesh that does not fit into --max-memory (about 250 bytes a triangle) is cut into parts that "
            "are "
            "clustered one by one; temporary files then take as much of the disk as OUT.fct. Only binary PLY "
            "files of triangles can be larger than memory themselves. 100 million triangles take 1 GB at the "
            "least; more memory makes fewer parts, not better clusters.\n\n"
            "JSON keys: faces, vertices, roots, depth, mean_depth, parts, seconds{read, dual, contract, "
            "boxes, "
            "write, "
            "total}, peak_bytes, file_bytes; for several files their sums, and files[].",
        .options = options_table,
        .parse = parse,
        .run = run,
        .inputs_min = 1,
        .inputs_max = INT_MAX,
        .output = TOOL_OUTPUT_REQUIRED,
        .output_folder = true};
    cluster_options options = {.def = fct_tree_def_default()};
    return tool_main(&command, argc, argv, &options);
}
