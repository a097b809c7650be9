// facetree/openmesh.hpp: clusters the faces of an OpenMesh mesh and stores the results in its properties.
// Header only, C++17, OpenMesh 9; not part of facetree.h.
//
//     OpenMesh::TriMesh_ArrayKernelT<> mesh = ...;
//     facetree::mesh_tree tree(mesh);
//     auto parts = tree.cut(200);
//     OpenMesh::FProp<int> id(mesh, "cluster");
//     tree.store_ids(mesh, parts, id);
//
// The mesh is any TriMesh_ArrayKernelT<Traits> with points of three coordinates. A PolyMesh does not compile;
// triangulate() a copy of it. Deleted elements that are not yet garbage-collected are left out, and their
// properties stay unchanged. After mesh_tree(mesh), points may change, but faces and vertices must not be
// added, removed or renumbered until the last store. A different number of them throws std::logic_error.
//
// Errors of the library (bad data, no memory, cancelled) throw facetree::error with its code and message.
// Hooks of an fct_env must not throw. Objects of these classes are not thread-safe: use each from one thread
// at a time.
#ifndef FACETREE_OPENMESH_HPP
#define FACETREE_OPENMESH_HPP

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <OpenMesh/Core/Mesh/Handles.hh>
#include <OpenMesh/Core/Utils/Property.hh>
#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <OpenMesh/Core/Utils/vector_traits.hh>

#include "facetree/partition.h"

namespace facetree {

class error : public std::runtime_error {
  public:
    error(fct_result result, const std::string &text)
        : std::runtime_error(text.empty() ? fct_result_text(result) : text), code(result) {}
    fct_result result() const noexcept { return code; }

  private:
    fct_result code;
};

namespace detail {

// An environment with a fixed address that keeps the last message of the library.
class context {
  public:
    explicit context(const fct_env &user) : env(user), outer(user) {
        env.message = keep;
        env.message_user = this;
    }
    context(const context &) = delete;
    context &operator=(const context &) = delete;

    const fct_env *get() const { return &env; }
    void check(fct_result result) {
        std::string said;
        said.swap(text);
        if (result != FCT_OK) throw error(result, said);
    }

  private:
    static void keep(void *self, fct_severity severity, const char *line) {
        context *c = static_cast<context *>(self);
        try {
            if (severity == FCT_MESSAGE_ERROR) c->text = line;
        } catch (...) { // no memory for the text; the exception still has the code
            c->text.clear();
        }
        if (c->outer.message) c->outer.message(c->outer.message_user, severity, line);
    }

    fct_env env, outer;
    std::string text;
};

// The handle of each number 0, 1, 2, ...; empty if nothing is deleted, because numbers and handles are then
// equal.
template <class Handle> class handle_list {
  public:
    template <class Deleted> void fill(std::size_t all, Deleted &&deleted) {
        total = all;
        handles.clear();
        count = 0;
        for (std::size_t i = 0; i < all; ++i) {
            Handle h(static_cast<int>(i));
            if (!deleted(h)) {
                if (count < i) handles.push_back(h);
                ++count;
            } else if (count == i) { // the first deleted element
                for (std::size_t k = 0; k < i; ++k) handles.push_back(Handle(static_cast<int>(k)));
            }
        }
    }
    Handle operator[](std::size_t i) const {
        return handles.empty() ? Handle(static_cast<int>(i)) : handles[i];
    }
    std::size_t size() const { return count; }
    std::size_t full_size() const { return total; }

  private:
    std::vector<Handle> handles;
    std::size_t count = 0, total = 0;
};

template <class Mesh> struct numbering {
    handle_list<OpenMesh::FaceHandle> faces;
    handle_list<OpenMesh::VertexHandle> vertices;

    explicit numbering(const Mesh &mesh) {
        const bool face_status = mesh.has_face_status(), vertex_status = mesh.has_vertex_status();
        faces.fill(mesh.n_faces(), [&](auto h) { return face_status && mesh.status(h).deleted(); });
        vertices.fill(mesh.n_vertices(), [&](auto h) { return vertex_status && mesh.status(h).deleted(); });
    }
    void check(const Mesh &mesh) const {
        if (mesh.n_faces() != faces.full_size() || mesh.n_vertices() != vertices.full_size())
            throw std::logic_error("facetree: the mesh has gained or lost elements since it was read");
    }
};

inline double srgb_of(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

inline double linear_of(double srgb) {
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

// Converts to a colour of OpenMesh: bytes are sRGB, floats are linear light, a fourth component is opaque.
template <class Color> Color color_of(const float rgb[3], double exposure) {
    using value = typename OpenMesh::vector_traits<Color>::value_type;
    constexpr bool whole = std::is_integral<value>::value;
    Color color;
    for (unsigned k = 0; k < OpenMesh::vector_traits<Color>::size_; ++k) {
        double x = k < 3 ? static_cast<double>(rgb[k]) * exposure : 1;
        if (whole) {
            x = x > 0 ? x < 1 ? srgb_of(x) : 1 : 0; // NaN is black
            x = std::floor(x * static_cast<double>(std::numeric_limits<value>::max()) + 0.5);
        }
        color[k] = static_cast<value>(x);
    }
    return color;
}

template <class Color> void color_to(const Color &color, float rgb[3]) {
    using value = typename OpenMesh::vector_traits<Color>::value_type;
    for (unsigned k = 0; k < 3; ++k) {
        double x = static_cast<double>(color[k]);
        if (std::is_integral<value>::value)
            x = linear_of(x / static_cast<double>(std::numeric_limits<value>::max()));
        rgb[k] = static_cast<float>(x);
    }
}

template <class Mesh> constexpr void require_triangles() {
    static_assert(Mesh::is_trimesh(),
                  "clusters are of triangles: triangulate a copy of the mesh into a TriMesh");
    static_assert(OpenMesh::vector_traits<typename Mesh::Point>::size_ == 3, "points of three coordinates");
}

} // namespace detail

// An fct_mesh with a copy of the points and triangles of an OpenMesh mesh, for any function of the library.
// Its face i is face(i) of the mesh and its vertex i is vertex(i), both in the mesh's order. If `colors` is
// true and the mesh has vertex colours, they are copied, too. Not copyable.
template <class Mesh> class mesh_copy {
  public:
    explicit mesh_copy(const Mesh &mesh, bool colors = false, const fct_env &env = fct_env_default())
        : context(std::make_unique<detail::context>(env)), ids(mesh) {
        detail::require_triangles<Mesh>();
        const std::size_t most = std::numeric_limits<std::int32_t>::max();
        if (ids.faces.size() > most || ids.vertices.size() > most)
            throw error(FCT_ERROR_DATA, "more vertices or faces than 31 bits can count");
        colors = colors && mesh.has_vertex_colors();
        context->check(fct_mesh_create(context->get(), static_cast<std::uint32_t>(ids.vertices.size()),
                                       static_cast<std::uint32_t>(ids.faces.size()),
                                       colors ? unsigned(FCT_MESH_COLORS) : 0u, &data));
        try {
            fill(mesh);
        } catch (...) {
            fct_mesh_release(context->get(), &data);
            throw;
        }
    }
    mesh_copy(mesh_copy &&other) noexcept
        : context(std::move(other.context)), ids(std::move(other.ids)), data(other.data) {
        other.data = fct_mesh{};
    }
    mesh_copy &operator=(mesh_copy &&other) noexcept {
        std::swap(context, other.context);
        std::swap(ids, other.ids);
        std::swap(data, other.data);
        return *this;
    }
    ~mesh_copy() {
        if (context) fct_mesh_release(context->get(), &data);
    }

    const fct_mesh *get() const { return &data; }
    OpenMesh::FaceHandle face(std::size_t i) const { return ids.faces[i]; }
    OpenMesh::VertexHandle vertex(std::size_t i) const { return ids.vertices[i]; }

    // Writes colours times exposure to the vertex colours of the mesh. colors: vertex_count x 3 floats of
    // linear light in the order of this copy, such as fct_mesh::colors after a bake. Byte colours are clamped
    // and converted to sRGB. Call mesh.request_vertex_colors() before.
    void store_vertex_colors(Mesh &mesh, const float *colors, double exposure = 1) const {
        ids.check(mesh);
        if (!mesh.has_vertex_colors()) throw std::logic_error("facetree: the mesh has no vertex colours");
        for (std::size_t v = 0; v < ids.vertices.size(); ++v)
            mesh.set_color(ids.vertices[v], detail::color_of<typename Mesh::Color>(colors + 3 * v, exposure));
    }

  private:
    template <class> friend class mesh_tree;

    void fill(const Mesh &mesh) {
        std::vector<std::uint32_t> numbers; // per vertex of the mesh, if some are deleted
        if (ids.vertices.size() < ids.vertices.full_size())
            numbers.assign(ids.vertices.full_size(), FCT_NONE);
        for (std::size_t v = 0; v < ids.vertices.size(); ++v) {
            const OpenMesh::VertexHandle h = ids.vertices[v];
            const auto &point = mesh.point(h);
            for (unsigned k = 0; k < 3; ++k) data.positions[3 * v + k] = static_cast<float>(point[k]);
            if (data.colors) detail::color_to(mesh.color(h), data.colors + 3 * v);
            if (!numbers.empty()) numbers[static_cast<std::size_t>(h.idx())] = static_cast<std::uint32_t>(v);
        }
        for (std::size_t f = 0; f < ids.faces.size(); ++f) {
            auto side = mesh.halfedge_handle(ids.faces[f]);
            for (unsigned k = 0; k < 3; ++k, side = mesh.next_halfedge_handle(side)) {
                const auto v = static_cast<std::size_t>(mesh.to_vertex_handle(side).idx());
                data.triangles[3 * f + k] = numbers.empty() ? static_cast<std::uint32_t>(v) : numbers[v];
            }
        }
    }

    std::unique_ptr<detail::context> context;
    detail::numbering<Mesh> ids;
    fct_mesh data{};
};

// A partition of the faces. labels: per face of the tree's input, below count. nodes: the tree's node of each
// cluster; empty after refine, because refined clusters are not nodes.
struct partition {
    std::uint32_t count = 0;
    std::vector<std::uint32_t> labels, nodes;
};

// A colour per cluster in linear light. Successive hues are a golden section apart, in three shades.
inline std::array<float, 3> cluster_color(std::uint32_t cluster) {
    double turn = std::fmod(cluster * 0.61803398874989485, 1.0), shade = 0.45 + 0.25 * (cluster % 3);
    std::array<float, 3> rgb{};
    for (unsigned k = 0; k < 3; ++k) {
        double x = std::fabs(6 * std::fmod(turn + k / 3.0, 1.0) - 3) -
                   1; // red, green and blue as piecewise linear functions of the hue
        x = x < 0 ? 0 : x > 1 ? 1 : x;
        rgb[k] = static_cast<float>(shade * (0.15 + 0.85 * x));
    }
    return rgb;
}

// The tree of clusters of a mesh. Movable, not copyable. Keeps no reference to the mesh. The tree and its
// file also hold the vertex colours of the mesh.
template <class Mesh> class mesh_tree {
  public:
    explicit mesh_tree(const Mesh &mesh, const fct_tree_def &def = fct_tree_def_default(),
                       const fct_env &env = fct_env_default())
        : mesh_tree(mesh_copy<Mesh>(mesh, true, env), def, env) {}
    explicit mesh_tree(const mesh_copy<Mesh> &copy, const fct_tree_def &def = fct_tree_def_default(),
                       const fct_env &env = fct_env_default())
        : context(std::make_unique<detail::context>(env)), ids(copy.ids), tree(nullptr, fct_tree_destroy) {
        fct_tree *built = nullptr;
        context->check(fct_tree_build(context->get(), copy.get(), &def, nullptr, &built));
        tree.reset(built);
    }

    // The tree for functions of the library. Face i of its input is face(i) of the mesh.
    const fct_tree *get() const { return tree.get(); }
    fct_tree_view view() const { return fct_tree_get(tree.get()); }
    OpenMesh::FaceHandle face(std::size_t i) const { return ids.faces[i]; }
    void save(const std::string &path) const {
        context->check(fct_tree_save(context->get(), tree.get(), path.c_str()));
    }

    // cut: the partition into `count` clusters, clamped to [roots, faces]. cut_at_cost: the partition after
    // all merges that cost at most max_cost.
    partition cut(std::uint32_t count) const {
        const fct_tree_view v = view();
        count = count < v.root_count ? v.root_count : count > v.face_count ? v.face_count : count;
        partition out;
        out.nodes.resize(count);
        out.labels.resize(v.face_count);
        context->check(fct_tree_partition(context->get(), tree.get(), count, out.nodes.data(), &out.count));
        context->check(
            fct_tree_labels(context->get(), tree.get(), out.nodes.data(), out.count, out.labels.data()));
        return out;
    }
    partition cut_at_cost(double max_cost) const { return cut(fct_tree_count_at_cost(tree.get(), max_cost)); }

    // Moves faces across borders: fct_tree_refine for a cut, fct_partition_refine for a partition that is
    // refined already. On failure the partition is unchanged.
    fct_refine_stats refine(partition &parts, const fct_refine_def &def = fct_refine_def_default()) const {
        fct_refine_stats stats{};
        if (parts.nodes.size() == parts.count)
            context->check(fct_tree_refine(context->get(), tree.get(), parts.nodes.data(), parts.count, &def,
                                           parts.labels.data(), &stats));
        else
            with_mesh([&](const fct_mesh *mesh) {
                return fct_partition_refine(context->get(), mesh, parts.count, &def, parts.labels.data(),
                                            &stats);
            });
        parts.nodes.clear();
        return stats;
    }
    fct_partition_quality quality(const partition &parts) const {
        fct_partition_quality out{};
        with_mesh([&](const fct_mesh *mesh) {
            return fct_labels_quality(context->get(), mesh, parts.labels.data(), parts.count, &out);
        });
        return out;
    }

    // The record (area, normal cone, plane, box, ...) of each cluster of a cut that is not refined.
    std::vector<fct_cluster> clusters(const partition &parts) const {
        if (parts.nodes.size() != parts.count)
            throw std::logic_error("facetree: a refined partition has no nodes");
        std::vector<fct_cluster> out(parts.count);
        for (std::size_t i = 0; i < out.size(); ++i)
            context->check(fct_tree_cluster(tree.get(), parts.nodes[i], &out[i]));
        return out;
    }
    // The plane n.x + d = 0 of each cluster, refined or not, as nx, ny, nz, d.
    std::vector<std::array<float, 4>> planes(const partition &parts) const {
        std::vector<std::array<float, 4>> out(parts.count);
        with_mesh([&](const fct_mesh *mesh) {
            return fct_labels_planes(context->get(), mesh, parts.labels.data(), parts.count,
                                     out.data()->data());
        });
        return out;
    }

    // Writes the cluster of each face, 0 to count - 1, to a property of any integer type that can hold it.
    template <class Id>
    void store_ids(Mesh &mesh, const partition &parts, OpenMesh::FPropHandleT<Id> property) const {
        check(mesh, parts);
        for (std::size_t f = 0; f < parts.labels.size(); ++f)
            mesh.property(property, ids.faces[f]) = static_cast<Id>(parts.labels[f]);
    }
    // Writes the plane of each face's cluster to a property of 4-vectors (OpenMesh::Vec4f, Vec4d).
    template <class Vector>
    void store_planes(Mesh &mesh, const partition &parts, OpenMesh::FPropHandleT<Vector> property) const {
        check(mesh, parts);
        const auto all = planes(parts);
        for (std::size_t f = 0; f < parts.labels.size(); ++f) {
            Vector &to = mesh.property(property, ids.faces[f]);
            for (unsigned k = 0; k < 4; ++k)
                to[k] = static_cast<typename OpenMesh::vector_traits<Vector>::value_type>(
                    all[parts.labels[f]][k]);
        }
    }
    // The same with OpenMesh::FProp<T> and other property managers.
    template <class Id, class Any>
    void store_ids(Mesh &mesh, const partition &parts,
                   const OpenMesh::PropertyManager<OpenMesh::FPropHandleT<Id>, Any> &property) const {
        store_ids(mesh, parts, property.getRawProperty());
    }
    template <class Vector, class Any>
    void store_planes(Mesh &mesh, const partition &parts,
                      const OpenMesh::PropertyManager<OpenMesh::FPropHandleT<Vector>, Any> &property) const {
        store_planes(mesh, parts, property.getRawProperty());
    }
    // Writes color(cluster), three floats of linear light, to the face colours of the mesh. Call
    // mesh.request_face_colors() before.
    template <class Color = std::array<float, 3> (*)(std::uint32_t)>
    void store_face_colors(Mesh &mesh, const partition &parts, Color &&color = cluster_color) const {
        check(mesh, parts);
        if (!mesh.has_face_colors()) throw std::logic_error("facetree: the mesh has no face colours");
        for (std::size_t f = 0; f < parts.labels.size(); ++f) {
            const auto linear = color(parts.labels[f]);
            const float rgb[3] = {static_cast<float>(linear[0]), static_cast<float>(linear[1]),
                                  static_cast<float>(linear[2])};
            mesh.set_color(ids.faces[f], detail::color_of<typename Mesh::Color>(rgb, 1));
        }
    }

  private:
    void check(const Mesh &mesh, const partition &parts) const {
        ids.check(mesh);
        if (parts.labels.size() != ids.faces.size())
            throw std::logic_error("facetree: the partition is of another tree");
    }
    template <class Call> void with_mesh(Call &&call) const {
        fct_mesh mesh{};
        context->check(fct_tree_mesh(context->get(), tree.get(), &mesh));
        fct_result result = call(&mesh);
        fct_mesh_release(context->get(), &mesh);
        context->check(result);
    }

    std::unique_ptr<detail::context> context; // outlives the tree
    detail::numbering<Mesh> ids;
    std::unique_ptr<fct_tree, void (*)(fct_tree *)> tree;
};

} // namespace facetree

#endif
