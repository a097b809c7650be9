// Meshes and poses for FCL, for tests and benchmarks.
#ifndef FCT_TESTS_BVH_FCL_H
#define FCT_TESTS_BVH_FCL_H

#include <fcl/fcl.h>

#include <vector>

#include "facetree/facetree.h"

using fcl_model = fcl::BVHModel<fcl::OBBRSSd>;

inline void build_fcl_model(const fct_mesh &mesh, fcl_model &model) {
    std::vector<fcl::Vector3d> vertices;
    std::vector<fcl::Triangle> triangles;
    for (size_t v = 0; v < mesh.vertex_count; ++v)
        vertices.emplace_back(mesh.positions[3 * v], mesh.positions[3 * v + 1], mesh.positions[3 * v + 2]);
    for (size_t f = 0; f < mesh.face_count; ++f)
        triangles.emplace_back(mesh.triangles[3 * f], mesh.triangles[3 * f + 1], mesh.triangles[3 * f + 2]);
    model.beginModel();
    model.addSubModel(vertices, triangles);
    model.endModel();
}

inline fcl::Transform3d make_fcl_pose(const fct_pose &pose) {
    fcl::Transform3d t = fcl::Transform3d::Identity();
    for (int i = 0; i < 3; ++i) {
        t.translation()[i] = pose.translation[i];
        for (int j = 0; j < 3; ++j) t.linear()(i, j) = pose.rotation[i][j];
    }
    return t;
}

#endif
