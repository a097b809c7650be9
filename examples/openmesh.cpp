// Clusters an OpenMesh mesh, stores the cluster and the plane of each face as properties, and writes the mesh
// with a colour per cluster.
//
// usage: openmesh [IN [OUT [CLUSTERS]]]
// Default: a bumpy sphere, clusters.off and 100 clusters. OUT needs a format for which OpenMesh writes face
// colours: .off, .ply or .om.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include <facetree/openmesh.hpp>

typedef OpenMesh::TriMesh_ArrayKernelT<> Mesh;

// n rings of 2n quads between two poles.
static Mesh make_sphere(int n) {
    Mesh mesh;
    auto add = [&](int ring, int place) {
        double a = 3.141592653589793 * ring / n, b = 3.141592653589793 * place / n;
        double r = 1 + 0.1 * std::sin(4 * a) * std::cos(5 * b);
        return mesh.add_vertex(Mesh::Point(float(r * std::sin(a) * std::cos(b)),
                                           float(r * std::sin(a) * std::sin(b)), float(r * std::cos(a))));
    };
    for (int ring = 1; ring < n; ++ring)
        for (int place = 0; place < 2 * n; ++place) add(ring, place);
    auto north = add(0, 0), south = add(n, 0);
    auto at = [&](int ring, int place) { return Mesh::VertexHandle((ring - 1) * 2 * n + place % (2 * n)); };
    for (int place = 0; place < 2 * n; ++place) {
        mesh.add_face(north, at(1, place), at(1, place + 1));
        mesh.add_face(south, at(n - 1, place + 1), at(n - 1, place));
        for (int ring = 1; ring + 1 < n; ++ring) {
            mesh.add_face(at(ring, place), at(ring + 1, place), at(ring + 1, place + 1));
            mesh.add_face(at(ring, place), at(ring + 1, place + 1), at(ring, place + 1));
        }
    }
    return mesh;
}

// The largest distance from a vertex to the plane of one of its clusters, computed from the properties.
static double largest_distance(const Mesh &mesh, const OpenMesh::FProp<OpenMesh::Vec4f> &plane) {
    double largest = 0;
    for (auto face : mesh.faces())
        for (auto vertex : face.vertices()) {
            const OpenMesh::Vec4f &p = plane[face];
            const Mesh::Point &x = mesh.point(vertex);
            largest = std::fmax(largest, std::fabs(double(p[0] * x[0] + p[1] * x[1] + p[2] * x[2] + p[3])));
        }
    return largest;
}

int main(int argc, char **argv) try {
    const std::string output = argc > 2 ? argv[2] : "clusters.off";
    Mesh mesh;
    if (argc < 2) {
        mesh = make_sphere(60);
    } else if (!OpenMesh::IO::read_mesh(mesh, argv[1])) {
        std::cerr << argv[1] << ": cannot be read\n";
        return 1;
    }

    facetree::mesh_tree<Mesh> tree(mesh);
    facetree::partition parts = tree.cut(argc > 3 ? std::uint32_t(std::atoi(argv[3])) : 100);
    auto before = tree.quality(parts);
    tree.refine(parts);
    auto after = tree.quality(parts);
    std::cout << parts.count << " clusters of " << mesh.n_faces() << " faces; squared deviation of normals "
              << before.mean_normal_deviation << ", refined " << after.mean_normal_deviation << '\n';

    OpenMesh::FProp<int> cluster(mesh, "cluster");
    OpenMesh::FProp<OpenMesh::Vec4f> plane(mesh, "plane");
    tree.store_ids(mesh, parts, cluster);
    tree.store_planes(mesh, parts, plane);
    int largest = 0;
    for (auto face : mesh.faces()) largest = std::max(largest, cluster[face]);
    std::cout << "largest cluster number " << largest << ", vertices within " << largest_distance(mesh, plane)
              << " of their clusters' planes\n";

    mesh.request_face_colors();
    tree.store_face_colors(mesh, parts);
    if (!OpenMesh::IO::write_mesh(mesh, output, OpenMesh::IO::Options::FaceColor)) {
        std::cerr << output << ": cannot be written\n";
        return 1;
    }
    return largest + 1 != int(parts.count) || after.mean_normal_deviation > before.mean_normal_deviation;
} catch (const facetree::error &e) {
    std::cerr << e.what() << '\n';
    return 1;
}
