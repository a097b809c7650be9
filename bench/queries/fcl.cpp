// bench/queries/fcl.cpp: FCL's oriented boxes with swept spheres: overlap and distance of two models, and
// many bodies by its dynamic tree of axis boxes.
#include "tests/bvh/fcl.h"

#include <memory>
#include <vector>

#include "bench/queries/sides.h"

namespace {

using model = std::shared_ptr<fcl_model>; // objects of FCL's broad phase share their models

void *build_model(const fct_mesh *mesh, const fct_tree *, uint32_t) {
    auto *m = new model(new fcl_model);
    build_fcl_model(*mesh, **m);
    return m;
}

void destroy_model(void *m) {
    delete static_cast<model *>(m);
}

void find_overlaps(void *m, size_t count, const void *queries, double *touching) {
    const fcl_model *body = static_cast<model *>(m)->get();
    for (size_t i = 0; i < count; ++i) {
        fcl::CollisionRequestd request;
        fcl::CollisionResultd result;
        fcl::collide(body, fcl::Transform3d::Identity(), body,
                     make_fcl_pose(static_cast<const fct_pose *>(queries)[i]), request, result);
        touching[i] = result.isCollision();
    }
}

void find_distances(void *m, size_t count, const void *queries, double *distances) {
    const fcl_model *body = static_cast<model *>(m)->get();
    for (size_t i = 0; i < count; ++i) {
        fcl::DistanceRequestd request;
        fcl::DistanceResultd result;
        fcl::distance(body, fcl::Transform3d::Identity(), body,
                      make_fcl_pose(static_cast<const fct_pose *>(queries)[i]), request, result);
        distances[i] = result.min_distance;
    }
}

void find_pairs(void *m, size_t count, const void *queries, double *pairs) {
    const fcl_model *body = static_cast<model *>(m)->get();
    for (size_t i = 0; i < count; ++i) {
        fcl::CollisionRequestd request(1 << 24, false);
        fcl::CollisionResultd result;
        fcl::collide(body, fcl::Transform3d::Identity(), body,
                     make_fcl_pose(static_cast<const fct_pose *>(queries)[i]), request, result);
        pairs[i] = double(result.numContacts());
    }
}

void find_within(void *m, size_t count, const void *queries, double *found) {
    const fcl_model *body = static_cast<model *>(m)->get();
    const auto *near = static_cast<const bench_near *>(queries);
    for (size_t i = 0; i < count; ++i) {
        fcl::DistanceRequestd request;
        fcl::DistanceResultd result;
        fcl::distance(body, fcl::Transform3d::Identity(), body, make_fcl_pose(near[i].pose), request, result);
        found[i] = result.min_distance <= near[i].distance;
    }
}

// Returns false: the broad phase goes on with the next pair.
bool test_pair(fcl::CollisionObjectd *a, fcl::CollisionObjectd *b, void *pairs) {
    fcl::CollisionRequestd request;
    fcl::CollisionResultd result;
    fcl::collide(a, b, request, result);
    *static_cast<double *>(pairs) += result.isCollision();
    return false;
}

void count_touching(void *m, uint32_t count, uint32_t frames, const fct_pose *poses, double *pairs) {
    std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
    fcl::DynamicAABBTreeCollisionManagerd manager;
    for (uint32_t i = 0; i < count; ++i) {
        objects.emplace_back(new fcl::CollisionObjectd(*static_cast<model *>(m), make_fcl_pose(poses[i])));
        objects.back()->computeAABB();
        manager.registerObject(objects.back().get());
    }
    manager.setup();
    for (uint32_t f = 0; f < frames; ++f, poses += count) {
        for (uint32_t i = 0; i < count; ++i) {
            objects[i]->setTransform(make_fcl_pose(poses[i]));
            objects[i]->computeAABB();
        }
        manager.update();
        pairs[f] = 0;
        manager.collide(&pairs[f], test_pair);
    }
}

bench_side make_side() {
    bench_side s{};
    s.name = "FCL";
    s.most_triangles = 2000000;
    s.build = build_model;
    s.destroy = destroy_model;
    s.ask[BENCH_OVERLAP] = s.ask[BENCH_PATH] = find_overlaps;
    s.ask[BENCH_PAIRS] = find_pairs;
    s.ask[BENCH_WITHIN] = find_within;
    s.ask[BENCH_DISTANCE] = find_distances;
    s.count_touching = count_touching;
    return s;
}

} // namespace

extern const bench_side bench_fcl = make_side();
