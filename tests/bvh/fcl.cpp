// Two models against FCL: the pairs of faces that meet, and the distance. FCL computes in double without
// exact decisions, so a pair may differ if the two faces touch within 1e-9 of the size.
#include "tests/bvh/fcl.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

extern "C" {
// cmocka.h needs these.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "bvh/pair/triangles.h"
#include "facetree/facetree.h"
}

namespace {

using face_pair = std::pair<uint32_t, uint32_t>;

struct model {
    fct_mesh mesh{};
    fct_tree *tree = nullptr;
    fct_bvh *bvh = nullptr;
    fcl_model peer;
    double size = 0;
};

bool load_model(const fct_env &env, const char *name, double scale, model &m) {
    if (fct_mesh_load(&env, (std::string(FACETREE_DATA "/") + name).c_str(), &m.mesh) != FCT_OK) return false;
    fct_bounds b;
    for (uint32_t i = 0; i < 3 * m.mesh.vertex_count; ++i) m.mesh.positions[i] *= float(scale);
    fct_bvh_def def = fct_bvh_def_default();
    def.parts = FCT_BVH_PAIRS;
    assert_int_equal(fct_tree_build(&env, &m.mesh, nullptr, nullptr, &m.tree), FCT_OK);
    assert_int_equal(fct_bvh_build(&env, m.tree, &def, &m.bvh), FCT_OK);
    b = fct_bvh_bounds(m.bvh);
    for (int k = 0; k < 3; ++k) m.size = std::max(m.size, double(b.upper[k]) - double(b.lower[k]));
    build_fcl_model(m.mesh, m.peer);
    return true;
}

void release_model(const fct_env &env, model &m) {
    fct_bvh_destroy(m.bvh);
    fct_tree_destroy(m.tree);
    fct_mesh_release(&env, &m.mesh);
}

double random_unit(uint64_t &state) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return double(state >> 11) * 0x1p-53;
}

/* The centre of b lies `away` from that of a in a random direction. */
fct_pose random_pose(const model &a, const model &b, double away, uint64_t &seed) {
    fcl::Vector3d direction(random_unit(seed) - .5, random_unit(seed) - .5, random_unit(seed) - .5);
    fcl::Quaterniond q(random_unit(seed) - .5, random_unit(seed) - .5, random_unit(seed) - .5,
                       random_unit(seed) - .5);
    fcl::Matrix3d r = q.normalized().toRotationMatrix();
    fct_bounds x = fct_bvh_bounds(a.bvh), y = fct_bvh_bounds(b.bvh);
    fct_pose pose;
    for (int i = 0; i < 3; ++i) {
        pose.translation[i] =
            (double(x.lower[i]) + double(x.upper[i])) / 2 + away * direction.normalized()[i];
        for (int j = 0; j < 3; ++j) {
            pose.rotation[i][j] = r(i, j);
            pose.translation[i] -= r(i, j) * (double(y.lower[j]) + double(y.upper[j])) / 2;
        }
    }
    return pose;
}

std::set<face_pair> our_pairs(const model &a, const model &b, const fct_pose &pose) {
    size_t count = fct_bvh_pairs(a.bvh, b.bvh, &pose, SIZE_MAX, 0, nullptr, nullptr, nullptr);
    std::vector<fct_face_pair> pairs(count);
    assert_int_equal(fct_bvh_pairs(a.bvh, b.bvh, &pose, SIZE_MAX, count, pairs.data(), nullptr, nullptr),
                     count);
    std::set<face_pair> out;
    for (const fct_face_pair &p : pairs) out.insert({p.face_a, p.face_b});
    assert_int_equal(out.size(), count);
    return out;
}

std::set<face_pair> peer_pairs(const model &a, const model &b, const fct_pose &pose) {
    fcl::CollisionRequestd request(1 << 24, false);
    fcl::CollisionResultd result;
    fcl::collide(&a.peer, fcl::Transform3d::Identity(), &b.peer, make_fcl_pose(pose), request, result);
    std::set<face_pair> out;
    for (size_t i = 0; i < result.numContacts(); ++i)
        out.insert({uint32_t(result.getContact(i).b1), uint32_t(result.getContact(i).b2)});
    return out;
}

/* Whether the faces touch so lightly that rounding decides. */
bool is_doubtful(const model &a, const model &b, const fct_pose &pose, const face_pair &pair) {
    v3 p[3], q[3], pa, pb;
    for (int c = 0; c < 3; ++c) {
        p[c] = v3_load(a.mesh.positions + 3 * a.mesh.triangles[3 * pair.first + uint32_t(c)]);
        v3 x = v3_load(b.mesh.positions + 3 * b.mesh.triangles[3 * pair.second + uint32_t(c)]);
        double out[3];
        for (int k = 0; k < 3; ++k)
            out[k] = pose.rotation[k][0] * x.x + pose.rotation[k][1] * x.y + pose.rotation[k][2] * x.z +
                     pose.translation[k];
        q[c] = v3_make(out[0], out[1], out[2]);
    }
    fct_contact contact;
    double within = 1e-9 * (a.size + b.size);
    if (fct_triangles_contact(p, q, &contact)) return contact.depth < within;
    return fct_triangles_distance(p, q, &pa, &pb) < within * within;
}

void compare_models(const char *name_a, const char *name_b, double scale, int count) {
    fct_env env = fct_env_default();
    model a, b;
    if (!load_model(env, name_a, 1, a) || !load_model(env, name_b, scale, b)) {
        print_message("skipped: no %s and %s in " FACETREE_DATA "\n", name_a, name_b);
        return;
    }
    uint64_t seed = 1;
    size_t touching = 0, pairs = 0, doubtful = 0;
    for (int i = 0; i < count; ++i) {
        fct_pose pose = random_pose(a, b, (.2 + .8 * random_unit(seed)) * (a.size + b.size) / 2, seed);
        std::set<face_pair> ours = our_pairs(a, b, pose), theirs = peer_pairs(a, b, pose);
        std::vector<face_pair> differ;
        std::set_symmetric_difference(ours.begin(), ours.end(), theirs.begin(), theirs.end(),
                                      std::back_inserter(differ));
        for (const face_pair &pair : differ) assert_true(is_doubtful(a, b, pose, pair));
        doubtful += differ.size(), pairs += ours.size(), touching += !ours.empty();
        fct_distance d;
        assert_true(fct_bvh_distance(a.bvh, b.bvh, &pose, nullptr, nullptr, &d, nullptr));
        assert_int_equal(d.distance == 0, !ours.empty());
        if (!ours.empty()) continue;
        fcl::DistanceRequestd request;
        fcl::DistanceResultd result;
        fcl::distance(&a.peer, fcl::Transform3d::Identity(), &b.peer, make_fcl_pose(pose), request, result);
        assert_true(std::fabs(result.min_distance - d.distance) <= 1e-9 * (a.size + b.size));
    }
    print_message("%s and %s: %zu of %d touch, %zu pairs, %zu decided by rounding\n", name_a, name_b,
                  touching, count, pairs, doubtful);
    assert_in_range(touching, 1, size_t(count) - 1);
    release_model(env, a);
    release_model(env, b);
}

// A path that comes near, touches, and goes on, in steps from 1e-5 to 1e-2 of the size: what hints keep from
// pose to pose does not change the answers.
void a_path(void **) {
    fct_env env = fct_env_default();
    model a, b;
    if (!load_model(env, "stanford-bunny.obj", 1, a) || !load_model(env, "cow.obj", .02, b)) {
        print_message("skipped: no bunny and cow in " FACETREE_DATA "\n");
        return;
    }
    uint64_t seed = 5;
    size_t touching = 0;
    const int count = 400;
    fct_pair_hint touch = fct_pair_hint_none(), near = fct_pair_hint_none();
    fct_pose pose = random_pose(a, b, .45 * (a.size + b.size), seed);
    fct_bounds x = fct_bvh_bounds(a.bvh), y = fct_bvh_bounds(b.bvh);
    double within = .01 * a.size;
    for (int i = 0; i < count; ++i) {
        fcl::CollisionRequestd request;
        fcl::CollisionResultd result;
        fcl::collide(&a.peer, fcl::Transform3d::Identity(), &b.peer, make_fcl_pose(pose), request, result);
        assert_int_equal(fct_bvh_overlap(a.bvh, b.bvh, &pose, &touch, nullptr), result.isCollision());
        fcl::DistanceRequestd apart;
        fcl::DistanceResultd distance;
        fcl::distance(&a.peer, fcl::Transform3d::Identity(), &b.peer, make_fcl_pose(pose), apart, distance);
        double gap = result.isCollision() ? 0 : distance.min_distance;
        bool is_near = fct_bvh_within(a.bvh, b.bvh, &pose, within, &near, nullptr);
        if (std::fabs(gap - within) > 1e-9 * a.size) assert_int_equal(is_near, gap <= within);
        touching += result.isCollision();
        double step = std::pow(10, -5 + 3 * random_unit(seed)) * a.size;
        if (result.isCollision()) step *= random_unit(seed) < .1 ? -10 : -.1;
        double length = 0, way[3];
        for (int k = 0; k < 3; ++k) {
            double at = pose.translation[k];
            for (int j = 0; j < 3; ++j)
                at += pose.rotation[k][j] * (double(y.lower[j]) + double(y.upper[j])) / 2;
            way[k] = (double(x.lower[k]) + double(x.upper[k])) / 2 - at, length += way[k] * way[k];
        }
        for (int k = 0; k < 3; ++k) pose.translation[k] += step * way[k] / std::sqrt(length);
    }
    print_message("a path: %zu of %d poses touch\n", touching, count);
    assert_in_range(touching, count / 20, count * 19 / 20);
    release_model(env, a);
    release_model(env, b);
}

void bunny_and_bunny(void **) {
    compare_models("stanford-bunny.obj", "stanford-bunny.obj", 1, 100);
}

void cow_and_suzanne(void **) {
    compare_models("cow.obj", "suzanne.obj", 2, 400);
}

void fandisk_and_arm(void **) {
    compare_models("fandisk.obj", "rocker-arm.obj", 1, 100);
}

} // namespace

int main() {
    const CMUnitTest tests[] = {
        cmocka_unit_test(bunny_and_bunny),
        cmocka_unit_test(cow_and_suzanne),
        cmocka_unit_test(fandisk_and_arm),
        cmocka_unit_test(a_path),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
