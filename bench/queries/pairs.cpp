// bench/queries/pairs.cpp: two models against each other, beside FCL.
//
// usage: bench_queries_pairs MESH [POSES]
//
// Half of the poses touch and half are apart, each 1 % of the diagonal from first contact, with random
// rotations and directions. Prints one line per query: our time and FCL's (median of runs in turns, processor
// time of this thread), their ratio, and our visits. Fails if the answers differ.
#include <fcl/fcl.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include "facetree/facetree.h"

namespace {

constexpr int runs = 5;

double cpu_seconds() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

double median(std::vector<double> x) {
    std::sort(x.begin(), x.end());
    return x[x.size() / 2];
}

struct our_model {
    fct_env env = fct_env_default();
    fct_mesh mesh{};
    fct_tree *tree = nullptr;
    fct_bvh *bvh = nullptr;
    double diagonal = 0;
};

bool load_model(const char *path, our_model &m) {
    m.env.thread_count = 1;
    if (fct_mesh_load(&m.env, path, &m.mesh) != FCT_OK) return false;
    if (fct_tree_build(&m.env, &m.mesh, nullptr, nullptr, &m.tree) != FCT_OK) return false;
    fct_bvh_def def = fct_bvh_def_default();
    double start = cpu_seconds();
    if (fct_bvh_build(&m.env, m.tree, &def, &m.bvh) != FCT_OK) return false;
    double rays = cpu_seconds() - start, faces = double(m.mesh.face_count),
           plain = double(fct_bvh_bytes(m.bvh));
    fct_bvh_destroy(m.bvh);
    def.parts = FCT_BVH_PAIRS;
    start = cpu_seconds();
    if (fct_bvh_build(&m.env, m.tree, &def, &m.bvh) != FCT_OK) return false;
    std::printf("faces %u: %.1f bytes per triangle, %.1f without pairs; build %.3f s, %.3f s without pairs\n",
                m.mesh.face_count, double(fct_bvh_bytes(m.bvh)) / faces, plain / faces, cpu_seconds() - start,
                rays);
    fct_bounds b = fct_bvh_bounds(m.bvh);
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += std::pow(double(b.upper[k]) - double(b.lower[k]), 2);
    m.diagonal = std::sqrt(sum);
    return true;
}

using peer_model = fcl::BVHModel<fcl::OBBRSSd>;

std::shared_ptr<peer_model> build_peer(const our_model &m) {
    auto peer = std::make_shared<peer_model>();
    std::vector<fcl::Vector3d> vertices;
    std::vector<fcl::Triangle> triangles;
    for (uint32_t v = 0; v < m.mesh.vertex_count; ++v)
        vertices.emplace_back(m.mesh.positions[3 * v], m.mesh.positions[3 * v + 1],
                              m.mesh.positions[3 * v + 2]);
    for (uint32_t f = 0; f < m.mesh.face_count; ++f)
        triangles.emplace_back(m.mesh.triangles[3 * f], m.mesh.triangles[3 * f + 1],
                               m.mesh.triangles[3 * f + 2]);
    double start = cpu_seconds();
    peer->beginModel();
    peer->addSubModel(vertices, triangles);
    peer->endModel();
    std::printf("FCL: build %.3f s\n", cpu_seconds() - start);
    return peer;
}

// A random rotation about the centre, and a shift of `away` along a random direction.
struct placement {
    double rotation[3][3], direction[3];
};

placement random_placement(std::mt19937_64 &random) {
    std::normal_distribution<double> normal;
    double q[4], u[3], ql = 0, ul = 0;
    for (double &x : q) x = normal(random), ql += x * x;
    for (double &x : u) x = normal(random), ul += x * x;
    for (double &x : q) x /= std::sqrt(ql);
    placement p;
    for (int k = 0; k < 3; ++k) p.direction[k] = u[k] / std::sqrt(ul);
    double w = q[0], x = q[1], y = q[2], z = q[3];
    double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                      {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                      {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    std::copy(&r[0][0], &r[0][0] + 9, &p.rotation[0][0]);
    return p;
}

fct_pose pose_at(const our_model &m, const placement &p, double away) {
    fct_bounds b = fct_bvh_bounds(m.bvh);
    fct_pose pose;
    for (int i = 0; i < 3; ++i) {
        pose.translation[i] = (double(b.lower[i]) + double(b.upper[i])) / 2 + away * p.direction[i];
        for (int j = 0; j < 3; ++j) {
            pose.rotation[i][j] = p.rotation[i][j];
            pose.translation[i] -= p.rotation[i][j] * (double(b.lower[j]) + double(b.upper[j])) / 2;
        }
    }
    return pose;
}

// Comes from far away to within 1e-4 of the diagonal of first contact along the direction.
double find_contact(const our_model &m, const placement &p) {
    double out = 1.3 * m.diagonal, in = out, step = .01 * m.diagonal;
    auto touches = [&](double away) {
        fct_pose pose = pose_at(m, p, away);
        return fct_bvh_overlap(m.bvh, m.bvh, &pose, nullptr, nullptr);
    };
    while (in > 0 && !touches(in)) out = in, in -= step;
    for (int i = 0; i < 10; ++i) (touches((in + out) / 2) ? in : out) = (in + out) / 2;
    return in;
}

fcl::Transform3d peer_pose(const fct_pose &pose) {
    fcl::Transform3d t = fcl::Transform3d::Identity();
    for (int i = 0; i < 3; ++i) {
        t.translation()[i] = pose.translation[i];
        for (int j = 0; j < 3; ++j) t.linear()(i, j) = pose.rotation[i][j];
    }
    return t;
}

template <class Ours, class Peer>
void report(const char *name, size_t count, const fct_visits &visits, Ours ours, Peer peer) {
    std::vector<double> mine, theirs;
    for (int r = 0; r < runs; ++r) {
        double start = cpu_seconds();
        ours();
        mine.push_back(cpu_seconds() - start);
        start = cpu_seconds();
        peer();
        theirs.push_back(cpu_seconds() - start);
    }
    double n = double(count), a = median(mine) / n * 1e6, b = median(theirs) / n * 1e6;
    std::printf("%-18s ours %9.2f us  FCL %9.2f us  ratio %6.2f  boxes %8.1f triangles %7.2f\n", name, a, b,
                b / a, double(visits.boxes) / n, double(visits.triangles) / n);
}

} // namespace

int main(int count, char **arguments) {
    our_model m;
    if (count < 2 || !load_model(arguments[1], m)) return 1;
    auto peer = build_peer(m);
    size_t half = count > 2 ? size_t(std::atoi(arguments[2])) / 2 : 500;
    std::mt19937_64 random(5);
    std::vector<fct_pose> touching, apart;
    while (touching.size() < half) {
        placement p = random_placement(random);
        double contact = find_contact(m, p);
        if (contact <= 0) continue;
        touching.push_back(pose_at(m, p, contact - .01 * m.diagonal));
        apart.push_back(pose_at(m, p, contact + .01 * m.diagonal));
    }
    int bad = 0;
    for (auto *poses : {&touching, &apart}) {
        std::vector<char> mine(half), theirs(half);
        fct_visits visits{};
        for (const fct_pose &p : *poses) fct_bvh_overlap(m.bvh, m.bvh, &p, nullptr, &visits);
        report(
            poses == &touching ? "overlap, touching" : "overlap, apart", half, visits,
            [&] {
                for (size_t i = 0; i < half; ++i)
                    mine[i] = fct_bvh_overlap(m.bvh, m.bvh, &(*poses)[i], nullptr, nullptr);
            },
            [&] {
                for (size_t i = 0; i < half; ++i) {
                    fcl::CollisionRequestd request;
                    fcl::CollisionResultd result;
                    fcl::collide(peer.get(), fcl::Transform3d::Identity(), peer.get(), peer_pose((*poses)[i]),
                                 request, result);
                    theirs[i] = result.isCollision();
                }
            });
        for (size_t i = 0; i < half; ++i) bad += mine[i] != theirs[i];
    }
    std::vector<double> mine(half), theirs(half);
    fct_visits visits{};
    for (const fct_pose &p : apart) {
        fct_distance d;
        fct_bvh_distance(m.bvh, m.bvh, &p, nullptr, nullptr, &d, &visits);
    }
    report(
        "distance, apart", half, visits,
        [&] {
            for (size_t i = 0; i < half; ++i) {
                fct_distance d;
                fct_bvh_distance(m.bvh, m.bvh, &apart[i], nullptr, nullptr, &d, nullptr);
                mine[i] = d.distance;
            }
        },
        [&] {
            for (size_t i = 0; i < half; ++i) {
                fcl::DistanceRequestd request;
                fcl::DistanceResultd result;
                fcl::distance(peer.get(), fcl::Transform3d::Identity(), peer.get(), peer_pose(apart[i]),
                              request, result);
                theirs[i] = result.min_distance;
            }
        });
    double worst = 0;
    for (size_t i = 0; i < half; ++i) worst = std::max(worst, std::fabs(mine[i] - theirs[i]) / m.diagonal);
    std::printf("answers that differ: %d of %zu; distances differ by at most %.1e diagonals\n", bad, 2 * half,
                worst);
    return bad > 0 || worst > 1e-6;
}
