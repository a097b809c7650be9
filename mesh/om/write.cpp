// mesh/om/write.cpp: writes OM files with OpenMesh's writer, behind extern "C".
//
// Our exporter makes half-edges from the triangles. It pairs sides that run in opposite directions along an
// edge, in face order. An unpaired side, for example at an edge of three faces, gets its own edge with a
// boundary on the other side. So the file holds every triangle.
#include <algorithm>
#include <ostream>
#include <streambuf>
#include <vector>

#include <OpenMesh/Core/IO/exporter/BaseExporter.hh>
#include <OpenMesh/Core/IO/writer/OMWriter.hh>

#include "mesh/om/openmesh.hpp"
extern "C" {
#include "base/env.h"
#include "base/sort.h"
#include "mesh/color.h"
#include "mesh/mesh.h"
}
#include "mesh/om/write.h"

namespace {

using namespace OpenMesh;

// Half-edges 2e and 2e + 1 are the sides of edge e. A boundary side has face -1.
class mesh_exporter : public IO::BaseExporter {
  public:
    struct half {
        int to, next, face;
    };

    mesh_exporter(const fct_sink *sink, const uint64_t *keys, const uint32_t *sides)
        : mesh(sink->mesh), exposure(sink->def->exposure) {
        size_t count = 3 * size_t(mesh->face_count);
        side_halves.assign(count, -1);
        for (size_t begin = 0, end; begin < count; begin = end) {
            for (end = begin + 1; end < count && keys[end] == keys[begin];) ++end;
            pair_sides(sides + begin, end - begin);
        }
        link_halves();
    }

    size_t n_vertices() const override { return mesh->vertex_count; }
    size_t n_faces() const override { return mesh->face_count; }
    size_t n_edges() const override { return halves.size() / 2; }
    const BaseKernel *kernel() override { return &no_properties; }
    bool is_triangle_mesh() const override { return true; }
    bool has_vertex_normals() const override { return mesh->normals; }
    bool has_vertex_colors() const override { return mesh->colors; }
    bool has_face_colors() const override { return mesh->face_colors; }
    bool is_point_double() const override { return false; }
    bool is_normal_double() const override { return false; }

    Vec3f point(VertexHandle v) const override {
        const float *p = mesh->positions + 3 * size_t(v.idx());
        const double *o = mesh->origin;
        if (!fct_mesh_has_origin(mesh)) return Vec3f(p[0], p[1], p[2]); // keeps the sign of -0
        return Vec3f(float(o[0] + double(p[0])), float(o[1] + double(p[1])), float(o[2] + double(p[2])));
    }
    Vec3f normal(VertexHandle v) const override { return triple(mesh->normals, v); }
    Vec3f colorf(VertexHandle v) const override { return triple(mesh->colors, v); }
    Vec3f colorf(FaceHandle f) const override { return triple(mesh->face_colors, f); }
    int get_halfedge_id(VertexHandle v) override { return vertex_halves[size_t(v.idx())]; }
    int get_halfedge_id(FaceHandle f) override { return side_halves[3 * size_t(f.idx()) + 2]; }
    int get_next_halfedge_id(HalfedgeHandle h) override { return halves[size_t(h.idx())].next; }
    int get_to_vertex_id(HalfedgeHandle h) override { return halves[size_t(h.idx())].to; }
    int get_face_id(HalfedgeHandle h) override { return halves[size_t(h.idx())].face; }
    unsigned int get_vhandles(FaceHandle f, std::vector<VertexHandle> &out) const override {
        out.clear();
        for (int k = 0; k < 3; ++k)
            out.push_back(VertexHandle(int(mesh->triangles[3 * size_t(f.idx()) + k])));
        return 3;
    }
    HalfedgeHandle getHeh(FaceHandle f, VertexHandle v) const override {
        for (int k = 0; k < 3; ++k) {
            int h = side_halves[3 * size_t(f.idx()) + k];
            if (halves[size_t(h)].to == v.idx()) return HalfedgeHandle(h);
        }
        return HalfedgeHandle();
    }

    // The writer does not call these with the options in fct_write_om.
    Vec3d pointd(VertexHandle v) const override { return Vec3d(point(v)); }
    Vec3d normald(VertexHandle v) const override { return Vec3d(normal(v)); }
    Vec3uc color(VertexHandle v) const override { return bytes(mesh->colors, v); }
    Vec4uc colorA(VertexHandle) const override { return Vec4uc(0, 0, 0, 0); }
    Vec3ui colori(VertexHandle) const override { return Vec3ui(0, 0, 0); }
    Vec4ui colorAi(VertexHandle) const override { return Vec4ui(0, 0, 0, 0); }
    Vec4f colorAf(VertexHandle v) const override { return opaque(colorf(v)); }
    Vec2f texcoord(VertexHandle) const override { return Vec2f(0, 0); }
    Vec2f texcoord(HalfedgeHandle) const override { return Vec2f(0, 0); }
    Attributes::StatusInfo status(VertexHandle) const override { return {}; }
    unsigned int get_face_texcoords(std::vector<Vec2f> &) const override { return 0; }
    Vec3f normal(FaceHandle) const override { return Vec3f(0, 0, 0); }
    Vec3d normald(FaceHandle) const override { return Vec3d(0, 0, 0); }
    Vec3uc color(FaceHandle f) const override { return bytes(mesh->face_colors, f); }
    Vec4uc colorA(FaceHandle) const override { return Vec4uc(0, 0, 0, 0); }
    Vec3ui colori(FaceHandle) const override { return Vec3ui(0, 0, 0); }
    Vec4ui colorAi(FaceHandle) const override { return Vec4ui(0, 0, 0, 0); }
    Vec4f colorAf(FaceHandle f) const override { return opaque(colorf(f)); }
    Attributes::StatusInfo status(FaceHandle) const override { return {}; }
    Vec3uc color(EdgeHandle) const override { return Vec3uc(0, 0, 0); }
    Vec4uc colorA(EdgeHandle) const override { return Vec4uc(0, 0, 0, 0); }
    Vec3ui colori(EdgeHandle) const override { return Vec3ui(0, 0, 0); }
    Vec4ui colorAi(EdgeHandle) const override { return Vec4ui(0, 0, 0, 0); }
    Vec3f colorf(EdgeHandle) const override { return Vec3f(0, 0, 0); }
    Vec4f colorAf(EdgeHandle) const override { return Vec4f(0, 0, 0, 0); }
    Attributes::StatusInfo status(EdgeHandle) const override { return {}; }
    Attributes::StatusInfo status(HalfedgeHandle) const override { return {}; }

  private:
    static Vec3f triple(const float *values, BaseHandle h) {
        const float *p = values + 3 * size_t(h.idx());
        return Vec3f(p[0], p[1], p[2]);
    }
    Vec3uc bytes(const float *colors, BaseHandle h) const {
        const float *c = colors + 3 * size_t(h.idx());
        double e = double(exposure);
        return Vec3uc(fct_srgb_byte(double(c[0]) * e), fct_srgb_byte(double(c[1]) * e),
                      fct_srgb_byte(double(c[2]) * e));
    }
    static Vec4f opaque(const Vec3f &c) { return Vec4f(c[0], c[1], c[2], 1.f); }

    uint32_t end_of(uint32_t side) const { return mesh->triangles[side % 3 == 2 ? side - 2 : side + 1]; }

    // Takes the sides of one edge. Pairs the i-th ascending side with the i-th descending side. An unpaired
    // side gets an edge of its own.
    void pair_sides(const uint32_t *sides, size_t count) {
        std::vector<uint32_t> ways[2];
        for (size_t i = 0; i < count; ++i)
            ways[mesh->triangles[sides[i]] < end_of(sides[i])].push_back(sides[i]);
        for (size_t i = 0; i < std::max(ways[0].size(), ways[1].size()); ++i) {
            bool up = i < ways[1].size(), down = i < ways[0].size();
            uint32_t a = up ? ways[1][i] : ways[0][i];
            int h = int(halves.size());
            halves.push_back({int(end_of(a)), -1, int(a / 3)});
            halves.push_back({int(mesh->triangles[a]), -1, up && down ? int(ways[0][i] / 3) : -1});
            side_halves[a] = h;
            if (up && down) side_halves[ways[0][i]] = h + 1;
        }
    }

    // Sets `next` within faces. At a boundary, turns about the end vertex from face to face to find the next
    // boundary half-edge.
    void link_halves() {
        std::vector<int> before(halves.size(), -1);
        for (size_t side = 0; side < side_halves.size(); ++side) {
            size_t next = side % 3 == 2 ? side - 2 : side + 1;
            halves[size_t(side_halves[side])].next = side_halves[next];
            before[size_t(side_halves[next])] = side_halves[side];
        }
        vertex_halves.assign(mesh->vertex_count, -1);
        for (size_t h = 0; h < halves.size(); ++h) {
            int from = halves[h ^ 1].to;
            if (vertex_halves[size_t(from)] < 0 || halves[h].face < 0) vertex_halves[size_t(from)] = int(h);
            if (halves[h].face >= 0) continue;
            size_t turn = h ^ 1;
            while (halves[turn].face >= 0) turn = size_t(before[turn]) ^ 1;
            halves[h].next = int(turn);
        }
    }

    const fct_mesh *mesh;
    float exposure;
    BaseKernel no_properties; // because the writer dereferences it without a check
    std::vector<half> halves;
    std::vector<int> side_halves, vertex_halves;
};

fct_result sort_sides(const fct_sink *sink, uint64_t *keys, uint32_t *sides) {
    const uint32_t *t = sink->mesh->triangles;
    size_t count = 3 * size_t(sink->mesh->face_count);
    for (size_t i = 0; i < count; ++i) {
        uint32_t a = t[i], b = t[i % 3 == 2 ? i - 2 : i + 1];
        keys[i] = uint64_t(std::min(a, b)) << 32 | std::max(a, b);
        sides[i] = uint32_t(i);
    }
    return fct_sort_pairs(sink->env, keys, sides, count);
}

struct file_buffer : std::streambuf {
    explicit file_buffer(FILE *file) : stream(file) {}
    int overflow(int c) override { return c == EOF || std::putc(c, stream) == EOF ? EOF : c; }
    std::streamsize xsputn(const char *p, std::streamsize n) override {
        return std::streamsize(std::fwrite(p, 1, size_t(n), stream));
    }
    FILE *stream;
};

} // namespace

extern "C" fct_result fct_write_om(const fct_sink *sink, FILE *stream) {
    const fct_mesh *m = sink->mesh;
    fct_note_left_out(sink, FCT_MESH_TEXCOORDS | FCT_MESH_MATERIALS | FCT_MESH_LIGHTS);
    fct_warn_of_origin(sink);
    size_t count = 3 * size_t(m->face_count);
    auto *keys = static_cast<uint64_t *>(fct_allocate(sink->env, count, sizeof(uint64_t)));
    auto *sides = static_cast<uint32_t *>(fct_allocate(sink->env, count, sizeof(uint32_t)));
    fct_result result =
        keys && sides ? sort_sides(sink, keys, sides) : fct_fail_memory(sink->env, "half-edges");
    try {
        if (result == FCT_OK) {
            mesh_exporter exporter(sink, keys, sides);
            fct_openmesh::call_guard guard;
            file_buffer buffer(stream);
            std::ostream to(&buffer);
            IO::Options options(IO::Options::Binary);
            if (m->normals) options += IO::Options::VertexNormal;
            if (m->colors) options += IO::Options::VertexColor;
            if (m->face_colors) options += IO::Options::FaceColor;
            if (!IO::OMWriter().write(to, exporter, options) && !std::ferror(stream))
                result = fct_fail(sink->env, FCT_ERROR_INTERNAL, "%s: OpenMesh failed to write", sink->name);
        }
    } catch (const std::bad_alloc &) {
        result = fct_fail_memory(sink->env, "OpenMesh");
    } catch (...) {
        result = fct_fail(sink->env, FCT_ERROR_INTERNAL, "%s: OpenMesh failed", sink->name);
    }
    fct_release(sink->env, keys);
    fct_release(sink->env, sides);
    return result;
}
