/* bench/cluster/vsa.cpp: CGAL's variational shape approximation, a slow peer with good clusters.
 *
 * usage: vsa MESH K SEEDING
 * SEEDING is random, hierarchical or incremental. The time includes the seeding with five relaxations and 20
 * iterations, but not the conversion of the mesh. A non-manifold mesh is cut into a manifold first, without
 * its doubled faces. judge.c judges the partition.
 */
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Variational_shape_approximation.h>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <vector>

#include "bench/cluster/bench.h"

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Positions = boost::property_map<Mesh, boost::vertex_point_t>::type;
using Approximation = CGAL::Variational_shape_approximation<Mesh, Positions>;
namespace parameters = CGAL::parameters;
namespace seeding = CGAL::Surface_mesh_approximation;

seeding::Seeding_method method_of(const char *name) {
    if (!std::strcmp(name, "random")) return seeding::RANDOM;
    if (!std::strcmp(name, "hierarchical")) return seeding::HIERARCHICAL;
    if (!std::strcmp(name, "incremental")) return seeding::INCREMENTAL;
    bench_fail("expected random, hierarchical or incremental, found '%s'", name);
}

/* kept[i]: the input face of face i. */
Mesh convert(const fct_mesh &input, std::vector<uint32_t> &kept) {
    namespace processing = CGAL::Polygon_mesh_processing;
    std::vector<Kernel::Point_3> points;
    std::vector<std::array<std::size_t, 3>> faces;
    bool *single = bench_single_faces(&input);
    for (std::size_t v = 0; v < input.vertex_count; ++v) {
        const float *p = input.positions + 3 * v;
        points.emplace_back(p[0], p[1], p[2]);
    }
    for (std::size_t f = 0; f < input.face_count; ++f) {
        const uint32_t *t = input.triangles + 3 * f;
        if (!single[f]) continue;
        faces.push_back({t[0], t[1], t[2]});
        kept.push_back(static_cast<uint32_t>(f));
    }
    std::free(single);
    if (!processing::is_polygon_soup_a_polygon_mesh(faces)) processing::orient_polygon_soup(points, faces);
    Mesh mesh;
    processing::polygon_soup_to_polygon_mesh(points, faces, mesh);
    if (mesh.number_of_faces() != kept.size())
        bench_fail("CGAL kept %zu of %zu faces", std::size_t(mesh.number_of_faces()), kept.size());
    return mesh;
}

void measure_approximation(const char *path, uint32_t count, seeding::Seeding_method method) {
    fct_env env = bench_env(2);
    fct_mesh input;
    bench_load(&env, path, &input);
    std::vector<uint32_t> kept, labels(input.face_count, FCT_NONE);
    Mesh mesh = convert(input, kept);
    Positions positions = get(boost::vertex_point, mesh);
    seeding::L21_metric_plane_proxy<Mesh, Positions> metric(mesh, positions);
    bench_memory before = bench_memory_start();
    double start = bench_seconds();
    Approximation approximation(mesh, positions, metric);
    approximation.initialize_seeds(
        parameters::seeding_method(method).max_number_of_proxies(count).number_of_relaxations(5));
    approximation.run(20);
    double seconds = bench_seconds() - start;
    std::size_t grown = bench_memory_grown(before);
    auto proxies = mesh.add_property_map<Mesh::Face_index, std::size_t>("f:proxy", 0).first;
    approximation.proxy_map(proxies);
    std::size_t most = approximation.number_of_proxies();
    for (auto f : mesh.faces())
        if (proxies[f] < most) labels[kept[f.idx()]] = static_cast<uint32_t>(proxies[f]);
    bench_quality q = bench_judge(&env, &input, labels.data(), static_cast<uint32_t>(most));
    std::printf("{\"faces\": %u, \"seconds\": %.6g, \"grown_bytes\": %zu, \"clusters\": %u, \"deviation\": "
                "%.6g, \"fit\": %.6g, "
                "\"irregularity\": %.6g}\n",
                input.face_count, seconds, grown, q.clusters, q.deviation, q.fit, q.irregularity);
    fct_mesh_release(&env, &input);
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 4) bench_fail("usage: vsa MESH K random|hierarchical|incremental");
    try {
        measure_approximation(argv[1], bench_count(argv[2], "K"), method_of(argv[3]));
    } catch (const std::exception &e) {
        bench_fail("%s: %s", argv[1], e.what());
    }
    return 0;
}
