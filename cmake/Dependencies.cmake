# What each folder links, all from Debian 12.
find_package(OpenMP REQUIRED COMPONENTS C)
find_package(embree 3.13 REQUIRED)
find_package(OpenMesh REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(JANSSON REQUIRED IMPORTED_TARGET jansson)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
find_package(PNG REQUIRED)

set(FACETREE_base_LIBRARIES PkgConfig::XXHASH)
set(FACETREE_mesh_LIBRARIES OpenMeshCore OpenMeshTools PkgConfig::JANSSON PkgConfig::XXHASH)
set(FACETREE_cluster_LIBRARIES PkgConfig::XXHASH)
set(FACETREE_bvh_LIBRARIES embree)
set(FACETREE_scene_LIBRARIES PkgConfig::JANSSON PkgConfig::XXHASH)
