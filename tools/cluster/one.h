/* tools/cluster/one.h: clusters one file. */
#ifndef FCT_TOOLS_CLUSTER_ONE_H
#define FCT_TOOLS_CLUSTER_ONE_H

#include "tools/kit/env.h"
#include "tools/kit/options.h"

typedef struct cluster_options {
    fct_tree_def def;
    const char *temporary; /* folder, or NULL */
} cluster_options;

/* Reads `input`, clusters it and writes `output`; *report receives the JSON report. Returns an exit code. */
int tool_cluster_file(tool *t, const cluster_options *options, const char *input, const char *output,
                      json_t **report);
/* Prints a report for people. */
void tool_cluster_say(tool *t, const char *input, const json_t *report);
/* A number of a report; 0 if it is absent. */
double tool_cluster_number(const json_t *object, const char *key);

#endif
