/* tests/cluster/folder.h: a temporary folder with paths for one mesh and one tree. Group set-up and
 * tear-down. */
#ifndef FCT_TESTS_CLUSTER_FOLDER_H
#define FCT_TESTS_CLUSTER_FOLDER_H

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static char folder[] = "/tmp/facetree-test-XXXXXX", mesh_path[64], tree_path[64];

static inline int make_folder(void **state) {
    (void)state;
    if (!mkdtemp(folder)) return -1;
    snprintf(mesh_path, sizeof mesh_path, "%s/mesh.ply", folder);
    snprintf(tree_path, sizeof tree_path, "%s/tree.fct", folder);
    return 0;
}

static inline int remove_folder(void **state) {
    (void)state;
    unlink(mesh_path);
    unlink(tree_path);
    return rmdir(folder);
}

#endif
