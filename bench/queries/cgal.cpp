// bench/queries/cgal.cpp: CGAL's tree of axis boxes. Rays and closest points ask a tree over triangles in
// double. Overlap and signs need CGAL's surface mesh with exact predicates, which is made when first asked
// for.
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Rigid_triangle_mesh_collision_detection.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "bench/queries/sides.h"

namespace {

using fast = CGAL::Simple_cartesian<double>;
using exact = CGAL::Exact_predicates_inexact_constructions_kernel;
using triangles = std::vector<fast::Triangle_3>;
using tree =
    CGAL::AABB_tree<CGAL::AABB_traits<fast, CGAL::AABB_triangle_primitive<fast, triangles::const_iterator>>>;
using surface = CGAL::Surface_mesh<exact::Point_3>;

struct model {
    const fct_mesh *mesh;
    triangles faces;
    tree boxes;
    surface body;
    std::unique_ptr<CGAL::Rigid_triangle_mesh_collision_detection<surface>> pair;
    std::unique_ptr<CGAL::Side_of_triangle_mesh<surface, exact>> side;
};

template <class kernel> typename kernel::Point_3 make_point(const float *p) {
    return {double(p[0]), double(p[1]), double(p[2])};
}

void *build_model(const fct_mesh *mesh, const fct_tree *, uint32_t) {
    auto *m = new model;
    m->mesh = mesh;
    m->faces.reserve(mesh->face_count);
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * size_t(f);
        fast::Triangle_3 face(make_point<fast>(mesh->positions + 3 * size_t(t[0])),
                              make_point<fast>(mesh->positions + 3 * size_t(t[1])),
                              make_point<fast>(mesh->positions + 3 * size_t(t[2])));
        if (!face.is_degenerate()) m->faces.push_back(face);
    }
    m->boxes.rebuild(m->faces.cbegin(), m->faces.cend());
    m->boxes.accelerate_distance_queries();
    return m;
}

void destroy_model(void *m) {
    delete static_cast<model *>(m);
}

fast::Ray_3 make_ray(const fct_ray &r) {
    return {make_point<fast>(r.origin),
            fast::Direction_3(double(r.direction[0]), double(r.direction[1]), double(r.direction[2]))};
}

void find_closest_hits(void *m, size_t count, const void *queries, double *t) {
    const auto *rays = static_cast<const fct_ray *>(queries);
    for (size_t i = 0; i < count; ++i) {
        t[i] = std::numeric_limits<double>::infinity();
        auto hit = static_cast<model *>(m)->boxes.first_intersection(make_ray(rays[i]));
        if (!hit) continue;
        const auto *point = boost::get<fast::Point_3>(&hit->first);
        if (!point) point = &boost::get<fast::Segment_3>(hit->first).source();
        fast::Vector_3 d(double(rays[i].direction[0]), double(rays[i].direction[1]),
                         double(rays[i].direction[2]));
        t[i] = (*point - make_point<fast>(rays[i].origin)) * d / d.squared_length();
    }
}

void find_any_hits(void *m, size_t count, const void *queries, double *hit) {
    const auto *rays = static_cast<const fct_ray *>(queries);
    for (size_t i = 0; i < count; ++i)
        hit[i] = static_cast<model *>(m)->boxes.do_intersect(make_ray(rays[i]));
}

void find_closest_points(void *m, size_t count, const void *queries, double *distances) {
    const auto *points = static_cast<const float *>(queries);
    for (size_t i = 0; i < count; ++i)
        distances[i] =
            std::sqrt(static_cast<model *>(m)->boxes.squared_distance(make_point<fast>(points + 3 * i)));
}

void count_hits(void *m, size_t count, const void *queries, double *hits) {
    const auto *rays = static_cast<const fct_ray *>(queries);
    for (size_t i = 0; i < count; ++i)
        hits[i] = double(static_cast<model *>(m)->boxes.number_of_intersected_primitives(make_ray(rays[i])));
}

void count_in_box(void *m, size_t count, const void *queries, double *faces) {
    const auto *balls = static_cast<const bench_ball *>(queries);
    for (size_t i = 0; i < count; ++i) {
        const float *c = balls[i].center;
        double r = double(balls[i].radius);
        fast::Iso_cuboid_3 box(fast::Point_3(double(c[0]) - r, double(c[1]) - r, double(c[2]) - r),
                               fast::Point_3(double(c[0]) + r, double(c[1]) + r, double(c[2]) + r));
        faces[i] = double(static_cast<model *>(m)->boxes.number_of_intersected_primitives(box));
    }
}

void make_surface(const fct_mesh *mesh, surface &body) {
    namespace polygons = CGAL::Polygon_mesh_processing;
    std::vector<exact::Point_3> points;
    std::vector<std::array<size_t, 3>> corners;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v)
        points.push_back(make_point<exact>(mesh->positions + 3 * size_t(v)));
    for (uint32_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * size_t(f);
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) corners.push_back({t[0], t[1], t[2]});
    }
    if (!polygons::is_polygon_soup_a_polygon_mesh(corners)) polygons::orient_polygon_soup(points, corners);
    polygons::polygon_soup_to_polygon_mesh(points, corners, body);
}

void make_body(model *m) {
    if (m->body.is_empty()) make_surface(m->mesh, m->body);
}

void find_overlaps(void *model_, size_t count, const void *queries, double *touching) {
    auto *m = static_cast<model *>(model_);
    if (!m->pair) {
        make_body(m);
        m->pair.reset(new CGAL::Rigid_triangle_mesh_collision_detection<surface>);
        m->pair->add_mesh(m->body);
        m->pair->add_mesh(m->body);
    }
    for (size_t i = 0; i < count; ++i) {
        const fct_pose &p = static_cast<const fct_pose *>(queries)[i];
        const auto &r = p.rotation;
        m->pair->set_transformation(1,
                                    exact::Aff_transformation_3(r[0][0], r[0][1], r[0][2], p.translation[0],
                                                                r[1][0], r[1][1], r[1][2], p.translation[1],
                                                                r[2][0], r[2][1], r[2][2], p.translation[2]));
        touching[i] = !m->pair->get_all_intersections(0).empty();
    }
}

void find_signed_distances(void *model_, size_t count, const void *queries, double *distances) {
    auto *m = static_cast<model *>(model_);
    make_body(m);
    if (!CGAL::is_closed(m->body)) {
        distances[0] = std::nan("");
        return;
    }
    if (!m->side) m->side.reset(new CGAL::Side_of_triangle_mesh<surface, exact>(m->body));
    find_closest_points(m, count, queries, distances);
    for (size_t i = 0; i < count; ++i) {
        auto point = make_point<exact>(static_cast<const float *>(queries) + 3 * i);
        if ((*m->side)(point) == CGAL::ON_BOUNDED_SIDE) distances[i] = -distances[i];
    }
}

void find_inside(void *model_, size_t count, const void *queries, double *inside) {
    auto *m = static_cast<model *>(model_);
    make_body(m);
    if (!CGAL::is_closed(m->body)) {
        inside[0] = std::nan("");
        return;
    }
    if (!m->side) m->side.reset(new CGAL::Side_of_triangle_mesh<surface, exact>(m->body));
    for (size_t i = 0; i < count; ++i) {
        auto point = make_point<exact>(static_cast<const float *>(queries) + 3 * i);
        inside[i] = (*m->side)(point) == CGAL::ON_BOUNDED_SIDE;
    }
}

double find_hausdorff(const fct_mesh *a, const fct_mesh *b, double error) {
    surface one, other;
    make_surface(a, one), make_surface(b, other);
    return CGAL::Polygon_mesh_processing::bounded_error_symmetric_Hausdorff_distance<CGAL::Sequential_tag>(
        one, other, error);
}

bench_side make_side() {
    bench_side s{};
    s.name = "CGAL";
    s.most_triangles = 2000000;
    s.alone = true; // its pairs of meshes keep the pose
    s.build = build_model;
    s.destroy = destroy_model;
    s.ask[BENCH_CLOSEST_HIT] = find_closest_hits;
    s.ask[BENCH_ANY_HIT] = find_any_hits;
    s.ask[BENCH_CLOSEST_POINT] = find_closest_points;
    s.ask[BENCH_SIGNED_DISTANCE] = find_signed_distances;
    s.ask[BENCH_ALL_HITS] = count_hits;
    s.ask[BENCH_BOX] = count_in_box;
    s.ask[BENCH_INSIDE] = find_inside;
    s.find_hausdorff = find_hausdorff;
    s.ask[BENCH_OVERLAP] = s.ask[BENCH_PATH] = find_overlaps;
    return s;
}

} // namespace

extern const bench_side bench_cgal = make_side();
