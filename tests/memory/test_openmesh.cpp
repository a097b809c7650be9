/* The OpenMesh adapter with a failing operator new and with failing hooks: every call either works or throws
 * std::bad_alloc or facetree::error with its memory code, and nothing stays allocated. */
#ifndef __clang__
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized" /* gcc warns about inlined code of OpenMesh */
#endif

#include <new>
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
#include "tests/memory/starve.h"

namespace {

typedef OpenMesh::TriMesh_ArrayKernelT<> mesh_type;

/* n x n squares, without one corner, so that handles and numbers differ. */
mesh_type make_mesh(int n) {
    mesh_type mesh;
    std::vector<OpenMesh::VertexHandle> v;
    mesh.request_face_status();
    mesh.request_edge_status();
    mesh.request_vertex_status();
    mesh.request_vertex_colors();
    mesh.request_face_colors();
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i)
            v.push_back(mesh.add_vertex(mesh_type::Point(float(i), float(j), float(i * j % 3))));
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            size_t a = size_t(j * (n + 1) + i), d = a + size_t(n) + 1;
            mesh.add_face(v[a], v[a + 1], v[d + 1]);
            mesh.add_face(v[a], v[d + 1], v[d]);
        }
    mesh.delete_vertex(v[0]);
    return mesh;
}

/* Every function of the adapter. */
void use_all(mesh_type &mesh, OpenMesh::FPropHandleT<int> id, OpenMesh::FPropHandleT<OpenMesh::Vec4f> plane,
             const fct_env &env) {
    facetree::mesh_copy<mesh_type> copy(mesh, true, env), other(std::move(copy));
    facetree::mesh_tree<mesh_type> tree(other, fct_tree_def_default(), env),
        second(mesh, fct_tree_def_default(), env);
    facetree::partition parts = tree.cut(5);
    std::vector<fct_cluster> clusters = tree.clusters(parts);
    tree.store_ids(mesh, parts, id);
    tree.refine(parts);
    tree.refine(parts);
    tree.quality(parts);
    tree.store_planes(mesh, parts, plane);
    tree.store_face_colors(mesh, parts);
    other.store_vertex_colors(mesh, other.get()->colors);
}

enum outcome { WORKS, NO_MEMORY, OTHER };

outcome try_all(mesh_type &mesh, OpenMesh::FPropHandleT<int> id,
                OpenMesh::FPropHandleT<OpenMesh::Vec4f> plane, const fct_env &env) {
    outcome result = WORKS;
    starve_begin();
    try {
        use_all(mesh, id, plane, env);
    } catch (const std::bad_alloc &) {
        result = NO_MEMORY;
    } catch (const facetree::error &e) {
        result = e.result() == FCT_ERROR_MEMORY ? NO_MEMORY : OTHER;
    } catch (...) {
        result = OTHER;
    }
    starve_end();
    return result;
}

void fail_everywhere(starve_kind kind) {
    mesh_type mesh = make_mesh(6);
    OpenMesh::FPropHandleT<int> id;
    OpenMesh::FPropHandleT<OpenMesh::Vec4f> plane;
    mesh.add_property(id);
    mesh.add_property(plane);
    fct_env env = starve_env();
    env.thread_count = 1;
    try_all(mesh, id, plane, env); /* streams and locales allocate at their first use */
    for (int lasting = 0; lasting < 2; ++lasting)
        for (long n = 1;; ++n) {
            starve_set(kind, n, lasting);
            long before = starve_alive();
            outcome result = try_all(mesh, id, plane, env);
            assert_int_equal(starve_alive(), before);
            assert_int_not_equal(result, OTHER);
            if (!starve_failed()) {
                assert_int_equal(result, WORKS);
                assert_true(n > 10);
                break;
            }
        }
}

void operator_new_fails(void **) {
    fail_everywhere(STARVE_SYSTEM);
}

void hooks_fail(void **) {
    fail_everywhere(STARVE_HOOK);
}

} // namespace

int main() {
    const CMUnitTest tests[] = {cmocka_unit_test(operator_new_fails), cmocka_unit_test(hooks_fail)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
