/* facetree/facetree.h: the whole library. */
#ifndef FACETREE_FACETREE_H
#define FACETREE_FACETREE_H

#include "facetree/base.h"
#include "facetree/bvh.h"
#include "facetree/cluster.h"
#include "facetree/collide.h"
#include "facetree/dual.h"
#include "facetree/mesh.h"
#include "facetree/partition.h"
#include "facetree/progressive.h"
#include "facetree/radiosity.h"
#include "facetree/scene.h"
#include "facetree/simplifier.h"
#include "facetree/simplify.h"

#endif
