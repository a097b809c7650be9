/* partition/chart/charter.h: the state that the steps of making charts share. */
#ifndef FCT_PARTITION_CHARTER_H
#define FCT_PARTITION_CHARTER_H

#include "cluster/tree/node.h"
#include "facetree/partition.h"
#include "partition/face.h"
#include "partition/sides.h"

typedef struct fct_charter {
    const fct_tree *tree;
    const fct_tree_view *view; /* of the tree */
    fct_chart_def def;
    fct_sides sides;  /* by place */
    uint32_t *labels; /* per place: its chart; charts are numbered by first place */
    uint32_t count;   /* charts */
} fct_charter;

#endif
