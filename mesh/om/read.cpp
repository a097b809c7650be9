// mesh/om/read.cpp: reads OM files with OpenMesh's reader, behind extern "C".
//
// OM stores half-edges, not faces with corners. Our importer stores the records unchanged, then follows the
// half-edges of each face. Faces keep their order, and non-manifold faces stay connected (a mesh of OpenMesh
// would detach them). check_chunks runs before the reader, because the reader trusts the counts in the
// header, and at named properties dereferences a mesh that does not exist. The chunks must fill the file
// exactly, and named properties are an error.
#include <algorithm>
#include <cstring>
#include <istream>
#include <streambuf>
#include <vector>

#include <OpenMesh/Core/IO/OMFormat.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OMReader.hh>
#include <OpenMesh/Core/IO/writer/OMWriter.hh>

#include "mesh/om/openmesh.hpp"
extern "C" {
#include "base/env.h"
#include "mesh/color.h"
}
#include "mesh/om/read.h"

namespace {

using namespace OpenMesh;
using IO::OMFormat::Chunk;

// Receives the records from OpenMesh's reader, in file order. Half-edges 2e and 2e + 1 belong to edge e.
class soup_importer : public IO::BaseImporter {
  public:
    struct half {
        int to = -1, next = -1;
    };
    std::vector<float> points, colors, normals, texcoords, face_colors, half_texcoords;
    std::vector<half> halves;
    std::vector<int> face_halves; // one half-edge of each face, or
    std::vector<int> corners;     // of old files: the faces' vertices
    std::vector<uint32_t> starts{0};

    VertexHandle add_vertex(const Vec3f &p) override {
        points.insert(points.end(), p.data(), p.data() + 3);
        return VertexHandle(int(points.size() / 3) - 1);
    }
    VertexHandle add_vertex(const Vec3d &p) override {
        return add_vertex(Vec3f(float(p[0]), float(p[1]), float(p[2])));
    }
    VertexHandle add_vertex() override { return add_vertex(Vec3f(0, 0, 0)); }
    HalfedgeHandle add_edge(VertexHandle a, VertexHandle b) override {
        halves.push_back({b.idx(), -1});
        halves.push_back({a.idx(), -1});
        return HalfedgeHandle(int(halves.size()) - 2);
    }
    FaceHandle add_face(const VHandles &indices) override {
        for (const VertexHandle &v : indices) corners.push_back(v.idx());
        starts.push_back(uint32_t(corners.size()));
        return FaceHandle(int(starts.size()) - 2);
    }
    FaceHandle add_face(HalfedgeHandle h) override {
        face_halves.push_back(h.idx());
        return FaceHandle(int(face_halves.size()) - 1);
    }
    void set_next(HalfedgeHandle h, HalfedgeHandle next) override {
        if (h.idx() >= 0 && size_t(h.idx()) < halves.size()) halves[size_t(h.idx())].next = next.idx();
    }
    void set_point(VertexHandle v, const Vec3f &p) override { store(points, v, p.data(), 3, n_vertices()); }
    void set_normal(VertexHandle v, const Vec3f &n) override { store(normals, v, n.data(), 3, n_vertices()); }
    void set_normal(VertexHandle v, const Vec3d &n) override {
        set_normal(v, Vec3f(float(n[0]), float(n[1]), float(n[2])));
    }
    void set_color(VertexHandle v, const Vec3uc &c) override {
        store_bytes(colors, v, c.data(), n_vertices());
    }
    void set_color(VertexHandle v, const Vec4uc &c) override {
        store_bytes(colors, v, c.data(), n_vertices());
    }
    void set_color(VertexHandle v, const Vec3f &c) override { store(colors, v, c.data(), 3, n_vertices()); }
    void set_color(VertexHandle v, const Vec4f &c) override { store(colors, v, c.data(), 3, n_vertices()); }
    void set_color(FaceHandle f, const Vec3uc &c) override {
        store_bytes(face_colors, f, c.data(), n_faces());
    }
    void set_color(FaceHandle f, const Vec4uc &c) override {
        store_bytes(face_colors, f, c.data(), n_faces());
    }
    void set_color(FaceHandle f, const Vec3f &c) override { store(face_colors, f, c.data(), 3, n_faces()); }
    void set_color(FaceHandle f, const Vec4f &c) override { store(face_colors, f, c.data(), 3, n_faces()); }
    void set_texcoord(VertexHandle v, const Vec2f &t) override {
        store(texcoords, v, t.data(), 2, n_vertices());
    }
    void set_texcoord(HalfedgeHandle h, const Vec2f &t) override {
        store(half_texcoords, h, t.data(), 2, halves.size());
    }
    size_t n_vertices() const override { return points.size() / 3; }
    size_t n_faces() const override { return face_halves.size() + starts.size() - 1; }
    size_t n_edges() const override { return halves.size() / 2; }
    BaseKernel *kernel() override { return &no_properties; }

    // A soup cannot hold these.
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec2f> &) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec3f> &) override {}
    void set_face_texindex(FaceHandle, int) override {}
    void set_halfedge(VertexHandle, HalfedgeHandle) override {}
    void set_status(VertexHandle, const Attributes::StatusInfo &) override {}
    void set_face(HalfedgeHandle, FaceHandle) override {}
    void request_face_texcoords2D() override {}
    void set_texcoord(VertexHandle, const Vec3f &) override {}
    void set_texcoord(HalfedgeHandle, const Vec3f &) override {}
    void set_status(HalfedgeHandle, const Attributes::StatusInfo &) override {}
    void set_color(EdgeHandle, const Vec3uc &) override {}
    void set_color(EdgeHandle, const Vec4uc &) override {}
    void set_color(EdgeHandle, const Vec3f &) override {}
    void set_color(EdgeHandle, const Vec4f &) override {}
    void set_status(EdgeHandle, const Attributes::StatusInfo &) override {}
    void set_normal(FaceHandle, const Vec3f &) override {}
    void set_normal(FaceHandle, const Vec3d &) override {}
    void set_status(FaceHandle, const Attributes::StatusInfo &) override {}
    void add_texture_information(int, std::string) override {}

  private:
    BaseKernel no_properties; // because the reader fails without one

    static void store(std::vector<float> &to, BaseHandle h, const float *values, size_t width, size_t count) {
        if (h.idx() < 0 || size_t(h.idx()) >= count) return;
        if (to.size() < count * width) to.resize(count * width, 0.f);
        std::memcpy(to.data() + size_t(h.idx()) * width, values, width * sizeof(float));
    }
    static void store_bytes(std::vector<float> &to, BaseHandle h, const unsigned char *c, size_t count) {
        float linear[3];
        for (int k = 0; k < 3; ++k) linear[k] = fct_linear_from_srgb(c[k] / 255.0);
        store(to, h, linear, 3, count);
    }
};

struct memory_buffer : std::streambuf {
    memory_buffer(const void *data, size_t size) {
        char *p = const_cast<char *>(static_cast<const char *>(data));
        setg(p, p, p + size);
    }
};

uint32_t little_32(const unsigned char *p) {
    return uint32_t(p[0]) | uint32_t(p[1]) << 8 | uint32_t(p[2]) << 16 | uint32_t(p[3]) << 24;
}

fct_result fail_om(const fct_source *s, const char *what) {
    return fct_fail(s->env, FCT_ERROR_DATA, "%s: %s", s->name, what);
}

// The supported kinds of chunks. Any other chunk is an error, because OpenMesh asserts on it, and Debian's
// build keeps asserts. Topology: a half-edge stores its next half-edge, vertex and face; a vertex or face
// stores a half-edge.
struct chunk_kind {
    unsigned entity, type, components;
    bool is_float;
    unsigned largest_bits; // code in the chunk's header: 0 is an integer of 8 bits or a float of 32
};

const chunk_kind kinds[] = {
    {Chunk::Entity_Vertex, Chunk::Type_Pos, 3, true, 1},
    {Chunk::Entity_Vertex, Chunk::Type_Normal, 3, true, 1},
    {Chunk::Entity_Vertex, Chunk::Type_Texcoord, 2, true, 0},
    {Chunk::Entity_Vertex, Chunk::Type_Color, 3, false, 0},
    {Chunk::Entity_Face, Chunk::Type_Color, 3, false, 0},
    {Chunk::Entity_Face, Chunk::Type_Normal, 3, true, 1},
    {Chunk::Entity_Halfedge, Chunk::Type_Texcoord, 2, true, 0},
    {Chunk::Entity_Vertex, Chunk::Type_Topology, 1, false, 2},
    {Chunk::Entity_Face, Chunk::Type_Topology, 1, false, 2},
    {Chunk::Entity_Halfedge, Chunk::Type_Topology, 3, false, 2},
};

// The size of the chunk's data in bytes, or SIZE_MAX if the chunk is not supported.
size_t chunk_bytes(const Chunk::Header &h, const IO::OMFormat::Header &head) {
    if (h.name_) return SIZE_MAX;
    bool topology = h.type_ == Chunk::Type_Topology; // OpenMesh sets the float bit of topology chunks too
    uint64_t count = h.entity_ == Chunk::Entity_Vertex ? head.n_vertices_
                     : h.entity_ == Chunk::Entity_Face ? head.n_faces_
                                                       : 2 * uint64_t(head.n_edges_);
    for (const chunk_kind &k : kinds) {
        if (h.entity_ != k.entity || h.type_ != k.type || h.dim_ + 1u != k.components) continue;
        if ((h.float_ != k.is_float && !topology) || h.bits_ > k.largest_bits) continue;
        return size_t(count * k.components * ((k.is_float ? 4u : 1u) << h.bits_));
    }
    return SIZE_MAX;
}

fct_result check_chunks(const fct_source *s, IO::OMFormat::Header *head) {
    const unsigned char *p = static_cast<const unsigned char *>(s->data), *end = p + s->size;
    if (s->size < 16 || std::memcmp(p, "OM", 2)) return fail_om(s, "no OM file");
    if (p[2] != 'T' && p[2] != 'P' && p[2] != 'Q') return fail_om(s, "an OM file of an unknown kind of mesh");
    head->n_vertices_ = little_32(p + 4), head->n_faces_ = little_32(p + 8),
    head->n_edges_ = little_32(p + 12);
    uint8_t version = p[3];
    uint8_t newest = IO::_OMWriter_::get_version();
    if (version > newest || version < 0x20)
        return fct_fail(s->env, FCT_ERROR_DATA, "%s: OM version %d.%d; 1.0 to %d.%d are read", s->name,
                        version >> 5, version & 31, newest >> 5, newest & 31);
    uint64_t records = uint64_t(head->n_vertices_) + head->n_faces_ + head->n_edges_;
    if (records > s->size) return fail_om(s, "its head declares more elements than the file has bytes");
    bool points = false, faces = false;
    for (p += 16; p < end;) {
        if (end - p < 2) return fail_om(s, "the file ends within the head of a chunk");
        Chunk::Header h;
        std::memset(&h, 0, sizeof h);
        using IO::OMFormat::operator<<;
        h << uint16_t(p[0] | p[1] << 8);
        p += 2;
        if (version < 0x40 && h.type_ == Chunk::Type_Topology)
            return fail_om(s, "OM files before version 2.0 are not read");
        if (h.entity_ == Chunk::Entity_Sentinel && p == end) break;
        size_t size = chunk_bytes(h, *head);
        if (size == SIZE_MAX)
            return fail_om(s, "an OM file with status bits or properties of its own is not read");
        if (size > size_t(end - p)) return fail_om(s, "the file ends within a chunk, or its head lies");
        points |= h.entity_ == Chunk::Entity_Vertex && h.type_ == Chunk::Type_Pos;
        faces |= h.entity_ == Chunk::Entity_Face && h.type_ == Chunk::Type_Topology;
        p += size;
    }
    if (head->n_vertices_ && !points) return fail_om(s, "the file has no positions");
    if (head->n_faces_ && !faces) return fail_om(s, "the file has no faces");
    return FCT_OK;
}

float *copy_floats(const fct_env *env, const std::vector<float> &from, size_t count) {
    auto *to = static_cast<float *>(fct_allocate_zero(env, count, sizeof(float)));
    if (to && count) std::memcpy(to, from.data(), std::min(count, from.size()) * sizeof(float));
    return to;
}

// Makes the corners of each face from its loop of half-edges. A half-edge outside the file and a loop that
// does not close are errors. The total number of corners cannot exceed the number of half-edges.
fct_result walk_faces(const fct_source *s, soup_importer &in, std::vector<int> &corner_halves) {
    size_t total = 0;
    for (size_t f = 0; f < in.face_halves.size(); ++f) {
        int first = in.face_halves[f], h = first;
        do {
            if (h < 0 || size_t(h) >= in.halves.size() || total++ >= in.halves.size())
                return fct_fail(s->env, FCT_ERROR_DATA, "%s: face %zu is no loop of half-edges", s->name, f);
            in.corners.push_back(in.halves[size_t(h)].to);
            corner_halves.push_back(h);
            h = in.halves[size_t(h)].next;
        } while (h != first);
        if (in.corners.size() - in.starts.back() < 3)
            return fct_fail(s->env, FCT_ERROR_DATA, "%s: face %zu has fewer than 3 corners", s->name, f);
        in.starts.push_back(uint32_t(in.corners.size()));
    }
    return FCT_OK;
}

fct_result fill_soup(const fct_source *s, soup_importer &in, const std::vector<int> &corner_halves,
                     fct_soup *out) {
    const fct_env *env = s->env;
    size_t corners = in.corners.size(), vertices = in.n_vertices(), faces = in.starts.size() - 1;
    out->vertex_count = uint32_t(vertices);
    out->polygon_count = uint32_t(faces);
    out->corner_count = corners;
    bool ok = (out->positions = copy_floats(env, in.points, 3 * vertices)) != nullptr;
    ok = ok && (out->corners = static_cast<uint32_t *>(fct_allocate(env, corners, sizeof(uint32_t))));
    ok = ok && (out->starts = static_cast<uint32_t *>(fct_allocate(env, faces + 1, sizeof(uint32_t))));
    if (!in.colors.empty()) ok = ok && (out->colors = copy_floats(env, in.colors, 3 * vertices));
    if (!in.normals.empty()) ok = ok && (out->normals = copy_floats(env, in.normals, 3 * vertices));
    if (!in.face_colors.empty())
        ok = ok && (out->polygon_colors = copy_floats(env, in.face_colors, 3 * faces));
    bool by_half = !in.half_texcoords.empty(), by_vertex = !by_half && !in.texcoords.empty();
    if (by_half || by_vertex)
        ok =
            ok && (out->texcoords = static_cast<float *>(fct_allocate_zero(env, corners, 2 * sizeof(float))));
    if (!ok) return fct_fail_memory(env, "a mesh");
    std::memcpy(out->starts, in.starts.data(), (faces + 1) * sizeof(uint32_t));
    for (size_t i = 0; i < corners; ++i) {
        out->corners[i] =
            uint32_t(in.corners[i]); // -1 becomes an index out of range, which fct_soup_mesh reports
        size_t from = by_half ? size_t(corner_halves[i]) : size_t(in.corners[i]);
        const std::vector<float> &values = by_half ? in.half_texcoords : in.texcoords;
        if ((by_half || by_vertex) && 2 * from + 2 <= values.size())
            std::memcpy(out->texcoords + 2 * i, values.data() + 2 * from, 2 * sizeof(float));
    }
    return FCT_OK;
}

} // namespace

extern "C" fct_result fct_read_om(const fct_source *source, fct_soup *out) {
    try {
        IO::OMFormat::Header head = {};
        fct_result result = check_chunks(source, &head);
        if (result != FCT_OK) return result;
        soup_importer importer;
        {
            fct_openmesh::call_guard guard;
            memory_buffer buffer(source->data, source->size);
            std::istream stream(&buffer);
            IO::Options options(IO::Options::Binary | IO::Options::VertexNormal | IO::Options::VertexColor |
                                IO::Options::VertexTexCoord | IO::Options::FaceColor |
                                IO::Options::FaceTexCoord);
            if (!IO::OMReader().read(stream, importer, options))
                return fail_om(source, "OpenMesh cannot read it");
        }
        if (importer.n_vertices() != head.n_vertices_ || importer.n_faces() != head.n_faces_)
            return fail_om(source, "OpenMesh found fewer elements than its head declares");
        std::vector<int> corner_halves;
        result = walk_faces(source, importer, corner_halves);
        return result == FCT_OK ? fill_soup(source, importer, corner_halves, out) : result;
    } catch (const std::bad_alloc &) {
        return fct_fail_memory(source->env, "OpenMesh");
    } catch (...) {
        return fct_fail(source->env, FCT_ERROR_INTERNAL, "%s: OpenMesh failed", source->name);
    }
}
