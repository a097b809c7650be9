/* tools/cluster/many.c: facetree cluster with several files: one process per core, each with one file at a
 * time, so that small and large files keep all cores busy. */
#define _GNU_SOURCE
#include "tools/cluster/many.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tools/kit/file.h"

typedef struct cluster_job {
    char *input, *output;
    pid_t process;
    int pipe, code;
    json_t *report;
} cluster_job;

typedef struct job_list {
    cluster_job *list;
    int count, capacity;
} job_list;

static int add_job(tool *t, job_list *all, const char *folder, const char *name) {
    if (all->count == all->capacity) {
        int larger = all->capacity ? 2 * all->capacity : 16;
        cluster_job *list = realloc(all->list, (size_t)larger * sizeof *list);
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
    cluster_job *j = all->list + all->count;
    *j = (cluster_job){.input = strdup(path), .output = strdup(output), .pipe = -1};
    ++all->count;
    if (!j->input || !j->output) return tool_fail(t, TOOL_MEMORY, "out of memory for the list of files");
    return tool_note_input(t, path);
}

static int is_mesh_entry(const struct dirent *entry) {
    return (tool_is_mesh_name(entry->d_name) || tool_ends(entry->d_name, "gltf")) && entry->d_name[0] != '.';
}

static int add_folder(tool *t, job_list *all, const char *folder) {
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

/* The work of one process: it sends its report through the pipe `out` and exits. */
static void work_on_job(tool *t, const cluster_options *options, const cluster_job *j, int out,
                        uint32_t processes) {
    json_t *r = NULL;
    t->env.thread_count = t->threads > processes ? t->threads / processes : 1;
    t->bar.shown = false;
    if (t->max_memory) t->max_memory = t->max_memory / processes + 1;
    int code = tool_cluster_file(t, options, j->input, j->output, &r);
    if (r && json_dumpfd(r, out, JSON_COMPACT))
        code = tool_fail(t, TOOL_INTERNAL, "%s: the report was lost", j->input);
    _exit(tool_env_close(t, code));
}

static int start_job(tool *t, const cluster_options *options, cluster_job *j, uint32_t processes) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC))
        return tool_fail(t, TOOL_INTERNAL, "a pipe cannot be created: %s", strerror(errno));
    pid_t parent = getpid();
    j->process = fork();
    if (j->process == 0) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (getppid() != parent) _exit(TOOL_CANCELLED);
        close(ends[0]);
        work_on_job(t, options, j, ends[1], processes);
    }
    close(ends[1]);
    j->pipe = ends[0];
    if (j->process > 0) return TOOL_DONE;
    close(j->pipe);
    return tool_fail(t, TOOL_INTERNAL, "a process cannot be created: %s", strerror(errno));
}

/* Takes the report of a process that has ended. */
static void finish_job(tool *t, cluster_job *j, int status) {
    j->code = WIFEXITED(status) ? WEXITSTATUS(status) : TOOL_INTERNAL;
    if (WIFSIGNALED(status)) tool_warn(t, "%s: ended by signal %d", j->input, WTERMSIG(status));
    if (j->code == TOOL_DONE) j->report = json_loadfd(j->pipe, 0, NULL);
    if (j->code == TOOL_DONE && !j->report) j->code = TOOL_INTERNAL;
    close(j->pipe);
    j->process = 0;
    if (j->report) tool_cluster_say(t, j->input, j->report);
}

static void stop_jobs(const job_list *all) {
    for (int i = 0; i < all->count; ++i)
        if (all->list[i].process > 0) kill(all->list[i].process, SIGTERM);
}

/* Keeps `processes` processes running until all files are done. */
static int run_jobs(tool *t, const cluster_options *options, job_list *all, uint32_t processes) {
    int code = TOOL_DONE, next = 0, running = 0, finished = 0;
    fflush(NULL);
    while (running > 0 || (next < all->count && code == TOOL_DONE)) {
        if (next < all->count && running < (int)processes && code == TOOL_DONE) {
            code = start_job(t, options, all->list + next, processes);
            if (code == TOOL_DONE) ++running, ++next;
            continue;
        }
        int status;
        pid_t process = waitpid(-1, &status, 0);
        for (int i = 0; i < next && process > 0; ++i)
            if (all->list[i].process == process) finish_job(t, all->list + i, status), --running, ++finished;
        if (!t->env.progress(t, "files", (double)finished / all->count) && code == TOOL_DONE) {
            code = tool_fail(t, TOOL_CANCELLED, "cancelled");
            stop_jobs(all);
        }
    }
    return code;
}

/* The sums over all files and the report of each file. depth is that of the deepest tree, mean_depth is a
 * mean over all faces, peak_bytes is that of the largest process. */
static json_t *sum_reports(const job_list *all, double seconds) {
    static const char *const phases[] = {"read", "dual", "contract", "boxes", "write"};
    double phase_sums[5] = {0}, faces = 0, vertices = 0, roots = 0, depth = 0, mean = 0, peak = 0, bytes = 0;
    json_t *files = json_array();
    for (int i = 0; i < all->count; ++i) {
        json_t *r = all->list[i].report, *times = json_object_get(r, "seconds");
        if (!r) continue;
        for (int p = 0; p < 5; ++p) phase_sums[p] += tool_cluster_number(times, phases[p]);
        faces += tool_cluster_number(r, "faces"), vertices += tool_cluster_number(r, "vertices"),
            roots += tool_cluster_number(r, "roots");
        mean += tool_cluster_number(r, "mean_depth") * tool_cluster_number(r, "faces"),
            bytes += tool_cluster_number(r, "file_bytes");
        depth = fmax(depth, tool_cluster_number(r, "depth")),
        peak = fmax(peak, tool_cluster_number(r, "peak_bytes"));
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

int tool_cluster_many(tool *t, const cluster_options *options) {
    job_list all = {0};
    int code = TOOL_DONE, failed = 0, worst = TOOL_DONE;
    for (int i = 0; i < t->input_count && code == TOOL_DONE; ++i)
        code = tool_is_folder(t->inputs[i]) ? add_folder(t, &all, t->inputs[i])
                                            : add_job(t, &all, NULL, t->inputs[i]);
    if (code == TOOL_DONE && !tool_is_folder(t->output) && !tool_is_unknown_kind(t->output))
        code = tool_fail(t, TOOL_USAGE, "%s: expected a folder for several meshes", t->output);
    if (code == TOOL_DONE) code = tool_check_folder(t, t->output);
    for (int i = 0; i < all.count && code == TOOL_DONE; ++i) code = tool_refuse_input(t, all.list[i].output);
    if (code != TOOL_DONE) goto done;
    if (!t->threads) t->threads = (uint32_t)sysconf(_SC_NPROCESSORS_ONLN);
    code = run_jobs(t, options, &all, t->threads < (uint32_t)all.count ? t->threads : (uint32_t)all.count);
    for (int i = all.count - 1; i >= 0; --i)
        if (all.list[i].code != TOOL_DONE) ++failed, worst = all.list[i].code;
    /* The process of a file has printed its failure already. */
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
