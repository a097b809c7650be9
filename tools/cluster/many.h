/* tools/cluster/many.h: clusters several files. */
#ifndef FCT_TOOLS_CLUSTER_MANY_H
#define FCT_TOOLS_CLUSTER_MANY_H

#include "tools/cluster/one.h"

/* Clusters all inputs, files and folders, into the folder of -o. Returns an exit code. */
int tool_cluster_many(tool *t, const cluster_options *options);

#endif
