/* The OpenMesh adapter: the same tree as for an fct_mesh, properties by handle, deleted elements, points and
 * colours of every type, errors as exceptions. */
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized" /* gcc warns about inlined code of OpenMesh */
#endif

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

extern "C" {
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
}

#include "facetree/openmesh.hpp"

namespace {

struct double_traits : OpenMesh::DefaultTraits {
    typedef OpenMesh::Vec3d Point;
    typedef OpenMesh::Vec4f Color;
};
typedef OpenMesh::TriMesh_ArrayKernelT<> plain_mesh;
typedef OpenMesh::TriMesh_ArrayKernelT<double_traits> double_mesh;

/* n x n squares over [0,1]^2 with a ridge along the middle: two planes. */
template <class Mesh> Mesh ridge(int n) {
    Mesh mesh;
    std::vector<OpenMesh::VertexHandle> v;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) {
            double x = double(i) / n;
            v.push_back(mesh.add_vertex(typename Mesh::Point(x, double(j) / n, 0.5 - std::fabs(x - 0.5))));
        }
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            size_t a = size_t(j * (n + 1) + i), d = a + size_t(n) + 1;
            mesh.add_face(v[a], v[a + 1], v[d + 1]);
            mesh.add_face(v[a], v[d + 1], v[d]);
        }
    return mesh;
}

template <class Mesh> double middle_x(const Mesh &mesh, OpenMesh::FaceHandle f) {
    double x = 0;
    for (auto v : mesh.fv_range(f)) x += double(mesh.point(v)[0]) / 3;
    return x;
}

template <class Mesh> void two_sides() {
    Mesh mesh = ridge<Mesh>(8);
    facetree::mesh_tree<Mesh> tree(mesh);
    facetree::partition parts = tree.cut(2);
    assert_int_equal(parts.count, 2);
    OpenMesh::FPropHandleT<int> id;
    mesh.add_property(id);
    tree.store_ids(mesh, parts, id);
    auto planes = OpenMesh::FProp<OpenMesh::Vec4d>(mesh, "plane");
    tree.store_planes(mesh, parts, planes);
    int left = -1;
    for (auto f : mesh.faces()) {
        bool on_left = middle_x(mesh, f) < 0.5;
        if (left < 0) left = on_left ? mesh.property(id, f) : 1 - mesh.property(id, f);
        assert_int_equal(mesh.property(id, f), on_left ? left : 1 - left);
        const double s = std::sqrt(0.5); /* z = x and z = 1 - x */
        assert_true(std::fabs(planes[f][0] - (on_left ? -s : s)) < 1e-6);
        assert_true(std::fabs(planes[f][1]) < 1e-6 && std::fabs(planes[f][2] - s) < 1e-6);
        assert_true(std::fabs(planes[f][3] - (on_left ? 0 : -s)) < 1e-6);
    }
    std::vector<fct_cluster> clusters = tree.clusters(parts);
    assert_int_equal(clusters.size(), 2);
    assert_true(std::fabs(double(clusters[0].area) - std::sqrt(0.5)) < 1e-6);
    assert_int_equal(tree.cut_at_cost(1e30).count, 1);
    assert_int_equal(tree.cut(1000000).count, mesh.n_faces());
}

void both_sides_of_a_ridge(void **) {
    two_sides<plain_mesh>();
    two_sides<double_mesh>();
}

/* Some faces and their isolated vertices are deleted, but not garbage-collected. */
void deleted_elements_are_left_out(void **) {
    plain_mesh mesh = ridge<plain_mesh>(10);
    mesh.request_face_status();
    mesh.request_edge_status();
    mesh.request_vertex_status();
    mesh.request_face_colors();
    mesh.request_vertex_colors();
    for (int f = 0; f < 200; ++f)
        if ((f > 2 && f < 9) || f % 9 == 1 || f > 180) mesh.delete_face(OpenMesh::FaceHandle(f), true);
    size_t faces = 0, vertices = 0;
    for (auto f : mesh.all_faces()) faces += !mesh.status(f).deleted();
    for (auto v : mesh.all_vertices()) vertices += !mesh.status(v).deleted();
    assert_true(faces < mesh.n_faces() && vertices < mesh.n_vertices());

    facetree::mesh_copy<plain_mesh> copy(mesh);
    assert_int_equal(copy.get()->face_count, faces);
    assert_int_equal(copy.get()->vertex_count, vertices);
    for (uint32_t f = 0; f < faces; ++f) {
        std::set<int> expected, found;
        for (auto v : mesh.fv_range(copy.face(f))) expected.insert(v.idx());
        for (uint32_t k = 0; k < 3; ++k) found.insert(copy.vertex(copy.get()->triangles[3 * f + k]).idx());
        assert_true(expected == found && !mesh.status(copy.face(f)).deleted());
        assert_true(f == 0 || copy.face(f - 1).idx() < copy.face(f).idx());
    }
    facetree::mesh_tree<plain_mesh> tree(copy);
    OpenMesh::FPropHandleT<short> id;
    mesh.add_property(id);
    for (auto f : mesh.all_faces()) mesh.property(id, f) = -5;
    auto parts = tree.cut(6);
    tree.store_ids(mesh, parts, id);
    tree.store_face_colors(mesh, parts);
    std::map<short, plain_mesh::Color> colors;
    for (auto f : mesh.all_faces()) {
        assert_true((mesh.property(id, f) == -5) == mesh.status(f).deleted());
        if (mesh.status(f).deleted()) continue;
        auto known = colors.emplace(mesh.property(id, f), mesh.color(f)).first;
        assert_true(known->second == mesh.color(f));
    }
    assert_int_equal(colors.size(), 6);
    mesh.garbage_collection();
    try {
        tree.store_ids(mesh, parts, id);
        fail();
    } catch (const std::logic_error &) {
    }
    facetree::mesh_tree<plain_mesh> collected(mesh);
    assert_int_equal(collected.view().face_count, faces);
}

void refinement_keeps_clusters_and_drops_nodes(void **) {
    double_mesh mesh = ridge<double_mesh>(12);
    for (auto v : mesh.vertices()) {
        auto p = mesh.point(v);
        mesh.set_point(v, {p[0], p[1], 0.2 * std::sin(7 * p[0]) * std::cos(5 * p[1])});
    }
    facetree::mesh_tree<double_mesh> tree(mesh);
    auto parts = tree.cut(12);
    auto before = tree.quality(parts);
    fct_refine_stats stats = tree.refine(parts);
    auto after = tree.quality(parts);
    assert_true(stats.moves > 0 && after.connected);
    assert_true(after.mean_normal_deviation < before.mean_normal_deviation);
    fct_refine_def def = fct_refine_def_default();
    def.perimeter_weight = 0;
    tree.refine(parts, def); /* refined, so it is no cut */
    assert_true(tree.quality(parts).mean_normal_deviation <= after.mean_normal_deviation);
    assert_int_equal(tree.planes(parts).size(), 12);
    try {
        tree.clusters(parts);
        fail();
    } catch (const std::logic_error &) {
    }
}

template <class Mesh> void colors_there_and_back(double tolerance) {
    Mesh mesh = ridge<Mesh>(4);
    facetree::mesh_copy<Mesh> bare(mesh, true);
    assert_null(bare.get()->colors);
    std::vector<float> colors(3 * mesh.n_vertices(), 0.0f);
    try {
        bare.store_vertex_colors(mesh, colors.data());
        fail();
    } catch (const std::logic_error &) {
    }
    mesh.request_vertex_colors();
    for (size_t i = 0; i < colors.size(); ++i) colors[i] = float(i) / float(colors.size()) / 2;
    bare.store_vertex_colors(mesh, colors.data(), 2);
    facetree::mesh_copy<Mesh> copy(mesh, true);
    assert_non_null(copy.get()->colors);
    for (size_t i = 0; i < colors.size(); ++i)
        assert_true(std::fabs(double(copy.get()->colors[i]) - 2 * double(colors[i])) <= tolerance);
    facetree::mesh_copy<Mesh> moved(std::move(copy));
    assert_null(copy.get()->colors);
    copy = std::move(moved);
    assert_non_null(copy.get()->colors);
}

void colors_of_bytes_and_floats(void **) {
    colors_there_and_back<plain_mesh>(0.005);
    colors_there_and_back<double_mesh>(1e-7);
    plain_mesh mesh = ridge<plain_mesh>(1);
    mesh.request_vertex_colors();
    const float colors[12] = {0, 1, 0.215861f, 7, -1, NAN, 0, 0, 0, 0, 0, 0};
    facetree::mesh_copy<plain_mesh>(mesh).store_vertex_colors(mesh, colors);
    assert_true(mesh.color(OpenMesh::VertexHandle(0)) == plain_mesh::Color(0, 255, 128)); /* sRGB */
    assert_true(mesh.color(OpenMesh::VertexHandle(1)) == plain_mesh::Color(255, 0, 0));
}

void *fail_nth(void *user, size_t size) {
    long *state = static_cast<long *>(user); /* allocations until the failure; live allocations */
    if (--state[0] == 0) return nullptr;
    ++state[1];
    return aligned_alloc(64, size);
}

void release(void *user, void *memory) {
    --static_cast<long *>(user)[1];
    free(memory);
}

void hear(void *user, fct_severity, const char *) {
    ++*static_cast<int *>(user);
}

void errors_are_exceptions(void **) {
    plain_mesh mesh = ridge<plain_mesh>(3);
    int heard = 0;
    fct_env env = fct_env_default();
    env.message = hear;
    env.message_user = &heard;
    plain_mesh empty;
    try {
        facetree::mesh_tree<plain_mesh> tree(empty, fct_tree_def_default(), env);
        fail();
    } catch (const facetree::error &e) {
        assert_int_equal(e.result(), FCT_ERROR_DATA);
        assert_string_equal(e.what(), "a mesh without faces has no tree");
        assert_int_equal(heard, 1);
    }
    facetree::mesh_tree<plain_mesh> tree(mesh, fct_tree_def_default(), env);
    try {
        tree.save("no/such/folder/tree.fct");
        fail();
    } catch (const facetree::error &e) {
        assert_int_equal(e.result(), FCT_ERROR_OUTPUT);
    }
    mesh.set_point(OpenMesh::VertexHandle(3), {0, NAN, 0});
    try {
        facetree::mesh_tree<plain_mesh> bad(mesh);
        fail();
    } catch (const facetree::error &e) {
        assert_non_null(strstr(e.what(), "vertex 3"));
    }
}

void survives_no_memory(void **) {
    plain_mesh mesh = ridge<plain_mesh>(5);
    for (long nth = 1;; ++nth) {
        long state[2] = {nth, 0};
        fct_env env = fct_env_default();
        env.allocate = fail_nth;
        env.release = release;
        env.memory_user = state;
        bool done = false;
        try {
            facetree::mesh_tree<plain_mesh> tree(mesh, fct_tree_def_default(), env);
            auto parts = tree.cut(5);
            tree.refine(parts);
            tree.planes(parts);
            auto other = std::move(tree);
            other.cut(3);
            done = true;
        } catch (const facetree::error &e) {
            assert_int_equal(e.result(), FCT_ERROR_MEMORY);
        }
        assert_int_equal(state[1], 0);
        if (done) {
            assert_true(nth > 20);
            break;
        }
    }
}

} // namespace

int main() {
    const struct CMUnitTest tests[] = {cmocka_unit_test(both_sides_of_a_ridge),
                                       cmocka_unit_test(deleted_elements_are_left_out),
                                       cmocka_unit_test(refinement_keeps_clusters_and_drops_nodes),
                                       cmocka_unit_test(colors_of_bytes_and_floats),
                                       cmocka_unit_test(errors_are_exceptions),
                                       cmocka_unit_test(survives_no_memory)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
