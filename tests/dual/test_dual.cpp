/* The dual graph against OpenMesh's half-edges on manifold meshes, and by hand on the others. */
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized" /* gcc warns about inlined code of OpenMesh */
#endif

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

extern "C" {
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "dual/lists.h"
#include "facetree/dual.h"
}

namespace {

struct Soup {
    void vertex(double x, double y, double z) {
        positions.push_back((float)x);
        positions.push_back((float)y);
        positions.push_back((float)z);
    }
    void face(uint32_t a, uint32_t b, uint32_t c) {
        triangles.push_back(a);
        triangles.push_back(b);
        triangles.push_back(c);
    }

    std::vector<float> positions;
    std::vector<uint32_t> triangles;

    fct_mesh mesh() {
        fct_mesh m = {};
        m.vertex_count = (uint32_t)(positions.size() / 3);
        m.face_count = (uint32_t)(triangles.size() / 3);
        m.positions = positions.data();
        m.triangles = triangles.data();
        return m;
    }
};

/* A torus of n x 2n squares, cut open along one ring if `open`: a bumpy surface with or without a border. */
Soup torus(uint32_t n, bool open) {
    Soup s;
    uint32_t m = 2 * n;
    for (uint32_t j = 0; j < m; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            double u = 6.283185307179586 * i / n, v = 6.283185307179586 * j / m,
                   r = 1 + 0.1 * std::sin(5 * v);
            s.vertex((3 + r * std::cos(u)) * std::cos(v), (3 + r * std::cos(u)) * std::sin(v),
                     r * std::sin(u));
        }
    for (uint32_t j = 0; j + (open ? 1 : 0) < m; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            uint32_t a = j * n + i, b = j * n + (i + 1) % n, c = (j + 1) % m * n + (i + 1) % n,
                     d = (j + 1) % m * n + i;
            s.face(a, b, c);
            s.face(a, c, d);
        }
    return s;
}

void against_openmesh(void **) {
    typedef OpenMesh::TriMesh_ArrayKernelT<> Mesh;
    for (uint32_t n = 3; n < 40; n += 9)
        for (int open = 0; open < 2; ++open) {
            Soup soup = torus(n, open != 0);
            Mesh peer;
            for (size_t v = 0; v < soup.positions.size(); v += 3)
                peer.add_vertex(Mesh::Point(soup.positions[v], soup.positions[v + 1], soup.positions[v + 2]));
            for (size_t t = 0; t < soup.triangles.size(); t += 3)
                peer.add_face(Mesh::VertexHandle((int)soup.triangles[t]),
                              Mesh::VertexHandle((int)soup.triangles[t + 1]),
                              Mesh::VertexHandle((int)soup.triangles[t + 2]));
            std::map<std::pair<uint32_t, uint32_t>, double> expected;
            uint32_t border = 0;
            std::vector<double> perimeters(soup.triangles.size() / 3);
            for (Mesh::EdgeHandle e : peer.edges()) {
                Mesh::FaceHandle f = peer.face_handle(peer.halfedge_handle(e, 0));
                Mesh::FaceHandle g = peer.face_handle(peer.halfedge_handle(e, 1));
                double length = peer.calc_edge_length(e);
                if (f.is_valid()) perimeters[(size_t)f.idx()] += length;
                if (g.is_valid()) perimeters[(size_t)g.idx()] += length;
                if (f.is_valid() && g.is_valid())
                    expected[std::minmax((uint32_t)f.idx(), (uint32_t)g.idx())] += length;
                else
                    ++border;
            }
            for (uint32_t threads = 1; threads <= 2; ++threads) {
                fct_env env = fct_env_default();
                env.thread_count = threads;
                fct_mesh mesh = soup.mesh();
                fct_dual dual;
                assert_int_equal(fct_dual_build(&env, &mesh, &dual), FCT_OK);
                assert_int_equal(dual.edge_count, expected.size());
                assert_int_equal(dual.boundary_edges, border);
                assert_int_equal(dual.nonmanifold_edges, 0);
                uint32_t e = 0;
                for (const auto &pair : expected) { /* in the same order */
                    assert_int_equal(dual.edges[2 * e], pair.first.first);
                    assert_int_equal(dual.edges[2 * e + 1], pair.first.second);
                    assert_true(std::fabs((double)dual.lengths[e] - pair.second) < 1e-5);
                    ++e;
                }
                for (size_t f = 0; f < perimeters.size(); ++f)
                    assert_true(std::fabs((double)dual.perimeters[f] - perimeters[f]) < 1e-5);
                fct_dual_release(&env, &dual);
            }
        }
}

fct_dual build(Soup &soup) {
    fct_env env = fct_env_default();
    fct_mesh mesh = soup.mesh();
    fct_dual dual;
    assert_int_equal(fct_dual_build(&env, &mesh, &dual), FCT_OK);
    for (uint32_t e = 0; e < dual.edge_count; ++e) {
        assert_true(dual.edges[2 * e] < dual.edges[2 * e + 1]);
        if (e > 0)
            assert_true(std::make_pair(dual.edges[2 * e - 2], dual.edges[2 * e - 1]) <
                        std::make_pair(dual.edges[2 * e], dual.edges[2 * e + 1]));
    }
    return dual;
}

/* No union may have a negative perimeter: the borders handed out never exceed a face's own. */
void shares_are_bounded(const fct_dual &dual) {
    std::vector<double> shared(dual.face_count);
    for (uint32_t e = 0; e < dual.edge_count; ++e)
        for (int k = 0; k < 2; ++k) shared[dual.edges[2 * e + (uint32_t)k]] += (double)dual.lengths[e];
    for (uint32_t f = 0; f < dual.face_count; ++f)
        assert_true(shared[f] <= (double)dual.perimeters[f] * (1 + 1e-6));
}

void pages_of_a_book(void **) {
    fct_env env = fct_env_default();
    Soup soup;
    soup.vertex(0, 0, 0);
    soup.vertex(0, 0, 2);
    for (uint32_t f = 0; f < 5; ++f) {
        soup.vertex((double)f - 2, 1, 1);
        soup.face(f % 2, 1 - f % 2, f + 2); /* turned both ways */
    }
    fct_dual dual = build(soup);
    assert_int_equal(dual.edge_count, 4);
    assert_int_equal(dual.nonmanifold_edges, 1);
    assert_int_equal(dual.boundary_edges, 10);
    for (uint32_t e = 0; e < 4; ++e) {
        assert_int_equal(dual.edges[2 * e], e);
        assert_int_equal(dual.edges[2 * e + 1], e + 1);
        assert_true(dual.lengths[e] == 1); /* half of 2 */
    }
    shares_are_bounded(dual);
    fct_dual_release(&env, &dual);
}

void odd_faces(void **) {
    fct_env env = fct_env_default();
    Soup soup;
    soup.vertex(0, 0, 0);
    soup.vertex(3, 0, 0);
    soup.vertex(0, 4, 0);
    soup.vertex(9, 9, 9);
    /* the same face twice, one turned; one flattened to an edge of theirs; one a point; one a loner */
    soup.face(0, 1, 2);
    soup.face(2, 1, 0);
    soup.face(1, 1, 2);
    soup.face(3, 3, 3);
    soup.face(0, 3, 0);
    fct_dual dual = build(soup);
    shares_are_bounded(dual);
    assert_true(dual.perimeters[2] == 10 && dual.perimeters[3] == 0);
    assert_int_equal(dual.edge_count, 2); /* 0-1 once for three shared sides, 1-2 in the chain on side 1 2 */
    assert_true(dual.edges[0] == 0 && dual.edges[1] == 1 && dual.edges[2] == 1 && dual.edges[3] == 2);
    assert_true(dual.lengths[0] == 3 + 4 + 2.5f && dual.lengths[1] == 2.5f);
    fct_dual_release(&env, &dual);
}

/* Checks the guarantees of dual.h for each edge. */
void against_brute_force(Soup &soup) {
    std::map<std::pair<uint32_t, uint32_t>, std::vector<uint32_t>> faces; /* of an edge, ascending */
    std::map<std::pair<uint32_t, uint32_t>, double> expected;
    for (size_t i = 0; i < soup.triangles.size(); ++i) {
        uint32_t u = soup.triangles[i], v = soup.triangles[i % 3 == 2 ? i - 2 : i + 1];
        if (u != v) faces[std::minmax(u, v)].push_back((uint32_t)(i / 3));
    }
    uint32_t border = 0, nonmanifold = 0;
    std::vector<double> perimeters(soup.triangles.size() / 3);
    for (auto &edge : faces) {
        const float *p = &soup.positions[3 * edge.first.first], *q = &soup.positions[3 * edge.first.second];
        double length =
            std::sqrt(std::pow((double)p[0] - (double)q[0], 2) + std::pow((double)p[1] - (double)q[1], 2) +
                      std::pow((double)p[2] - (double)q[2], 2));
        std::vector<uint32_t> sides = edge.second, chain = sides;
        for (uint32_t f : sides) perimeters[f] += length;
        chain.erase(std::unique(chain.begin(), chain.end()), chain.end());
        border += chain.size() == 1;
        nonmanifold += chain.size() > 2;
        for (size_t i = 0; i + 1 < chain.size(); ++i) {
            double share[2];
            for (size_t k = 0; k < 2; ++k)
                share[k] = (double)std::count(sides.begin(), sides.end(), chain[i + k]) /
                           (i + k > 0 && i + k + 1 < chain.size() ? 2 : 1);
            expected[{chain[i], chain[i + 1]}] += length * std::min(share[0], share[1]);
        }
    }
    fct_env env = fct_env_default();
    fct_dual dual = build(soup);
    assert_int_equal(dual.edge_count, expected.size());
    assert_int_equal(dual.boundary_edges, border);
    assert_int_equal(dual.nonmanifold_edges, nonmanifold);
    uint32_t e = 0;
    for (const auto &pair : expected) {
        assert_int_equal(dual.edges[2 * e], pair.first.first);
        assert_int_equal(dual.edges[2 * e + 1], pair.first.second);
        assert_true(std::fabs((double)dual.lengths[e++] - pair.second) < 1e-5 * (1 + pair.second));
    }
    for (size_t f = 0; f < perimeters.size(); ++f)
        assert_true(std::fabs((double)dual.perimeters[f] - perimeters[f]) < 1e-5 * (1 + perimeters[f]));
    shares_are_bounded(dual);
    fct_dual_release(&env, &dual);
}

/* Random meshes. Few vertices and many faces give edges with many faces, faces with a repeated vertex, and
 * duplicate faces. Many vertices and few faces give loose faces. */
void random_soups(void **) {
    uint32_t state = 1;
    auto random = [&state](uint32_t count) {
        state = state * 1664525u + 1013904223u;
        return (uint32_t)((uint64_t)state * count >> 32);
    };
    for (uint32_t run = 0; run < 400; ++run) {
        Soup soup;
        uint32_t vertices = 2 + random(60), faces = 1 + random(200);
        for (uint32_t v = 0; v < vertices; ++v) soup.vertex(random(100), random(100), random(100));
        for (uint32_t f = 0; f < faces; ++f) soup.face(random(vertices), random(vertices), random(vertices));
        against_brute_force(soup);
    }
}

/* Lists hold each dual edge at both faces, in another unit of length. */
void lists_scale_lengths(void **) {
    fct_env env = fct_env_default();
    Soup soup = torus(5, true);
    fct_mesh mesh = soup.mesh();
    fct_dual dual = build(soup);
    fct_lists lists;
    assert_int_equal(fct_lists_build(&env, &mesh, 2.5, &lists), FCT_OK);
    std::map<std::pair<uint32_t, uint32_t>, double> found;
    for (uint32_t f = 0; f < lists.face_count; ++f) {
        assert_true(std::fabs((double)lists.perimeters[f] - 2.5 * (double)dual.perimeters[f]) < 1e-5);
        for (uint32_t i = lists.starts[f]; i < lists.starts[f] + lists.counts[f]; ++i)
            found[{f, lists.neighbors[i]}] = (double)lists.lengths[i];
    }
    assert_int_equal(found.size(), 2 * dual.edge_count);
    for (uint32_t e = 0; e < dual.edge_count; ++e)
        for (uint32_t k = 0; k < 2; ++k) {
            double length = found[{dual.edges[2 * e + k], dual.edges[2 * e + 1 - k]}];
            assert_true(std::fabs(length - 2.5 * (double)dual.lengths[e]) < 1e-5);
        }
    fct_lists_release(&env, &lists);
    fct_dual_release(&env, &dual);
}

void *fail_nth(void *user, size_t size) {
    long *state = static_cast<long *>(user); /* counts down; alive */
    if (--state[0] == 0) return nullptr;
    ++state[1];
    return aligned_alloc(64, size);
}

void release(void *user, void *memory) {
    --static_cast<long *>(user)[1];
    free(memory);
}

void survives_no_memory(void **) {
    Soup soup = torus(6, true);
    fct_mesh mesh = soup.mesh();
    for (long nth = 1;; ++nth) {
        long state[2] = {nth, 0};
        fct_env env = fct_env_default();
        env.allocate = fail_nth;
        env.release = release;
        env.memory_user = state;
        fct_dual dual;
        fct_result result = fct_dual_build(&env, &mesh, &dual);
        if (result == FCT_OK) {
            assert_true(nth > 10);
            fct_dual_release(&env, &dual);
            assert_int_equal(state[1], 0);
            break;
        }
        assert_int_equal(result, FCT_ERROR_MEMORY);
        assert_int_equal(state[1], 0);
        assert_null(dual.edges);
    }
}

} // namespace

int main() {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(against_openmesh),    cmocka_unit_test(pages_of_a_book),
        cmocka_unit_test(odd_faces),           cmocka_unit_test(random_soups),
        cmocka_unit_test(lists_scale_lengths), cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
