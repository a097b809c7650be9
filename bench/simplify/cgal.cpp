// bench/simplify/cgal.cpp: CGAL's edge collapse with the policies of Garland and Heckbert, and the bound on
// the change of normals that CGAL's manual shows with them.
//
// Policies: plane (quadrics of planes), triangle (quadrics weighted by area). CGAL takes manifolds with
// consistent orientation only, and its placements do not move colours, so the result has none.
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <array>
#include <cstring>
#include <exception>
#include <vector>

#include "bench/simplify/side.h"

namespace {

namespace simplification = CGAL::Surface_mesh_simplification;
using kernel = CGAL::Simple_cartesian<double>;
using surface = CGAL::Surface_mesh<kernel::Point_3>;

struct model {
    surface mesh;
    bool by_plane;
};

struct enough_faces {
    std::size_t faces;
    template <class Cost, class Profile>
    bool operator()(const Cost &, const Profile &profile, std::size_t, std::size_t) const {
        return profile.surface_mesh().number_of_faces() <= faces;
    }
};

template <class Policies> void collapse_edges(surface &mesh, std::size_t faces) {
    Policies policies(mesh);
    simplification::Bounded_normal_change_placement<typename Policies::Get_placement> placement(
        policies.get_placement());
    simplification::edge_collapse(mesh, enough_faces{faces},
                                  CGAL::parameters::get_cost(policies.get_cost()).get_placement(placement));
}

void *open_model(const fct_mesh *mesh, const char *policy, uint32_t, const char **refused) {
    bool by_plane = !std::strcmp(policy, "plane");
    if (!by_plane && std::strcmp(policy, "triangle") != 0) return nullptr;
    namespace processing = CGAL::Polygon_mesh_processing;
    std::vector<kernel::Point_3> points;
    std::vector<std::array<std::size_t, 3>> faces;
    for (std::size_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * v;
        points.emplace_back(double(p[0]), double(p[1]), double(p[2]));
    }
    for (std::size_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * f;
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            *refused = "a face with a repeated corner";
            return nullptr;
        }
        faces.push_back({t[0], t[1], t[2]});
    }
    if (!processing::is_polygon_soup_a_polygon_mesh(faces)) {
        *refused = "not an oriented manifold";
        return nullptr;
    }
    model *m = new model{{}, by_plane};
    processing::polygon_soup_to_polygon_mesh(points, faces, m->mesh);
    return m;
}

void run_model(void *user, uint32_t faces) {
    model *m = static_cast<model *>(user);
    try {
        if (m->by_plane)
            collapse_edges<simplification::GarlandHeckbert_plane_policies<surface, kernel>>(m->mesh, faces);
        else
            collapse_edges<simplification::GarlandHeckbert_triangle_policies<surface, kernel>>(m->mesh,
                                                                                               faces);
        m->mesh.collect_garbage();
    } catch (const std::exception &e) {
        bench_fail("CGAL: %s", e.what());
    }
}

void get_result(void *user, const fct_env *env, fct_mesh *out) {
    const surface &mesh = static_cast<model *>(user)->mesh;
    bench_check(
        fct_mesh_create(env, uint32_t(mesh.number_of_vertices()), uint32_t(mesh.number_of_faces()), 0, out),
        "the result");
    float *p = out->positions;
    for (auto v : mesh.vertices())
        for (int k = 0; k < 3; ++k) *p++ = float(mesh.point(v)[k]);
    uint32_t *t = out->triangles;
    for (auto f : mesh.faces())
        for (auto v : mesh.vertices_around_face(mesh.halfedge(f))) *t++ = uint32_t(v);
}

void close_model(void *user) {
    delete static_cast<model *>(user);
}

} // namespace

const bench_side bench_library = {"plane, triangle", open_model, run_model, get_result, close_model};
