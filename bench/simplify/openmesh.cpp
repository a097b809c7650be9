// bench/simplify/openmesh.cpp: OpenMesh's decimater with its quadric module. The policy is default.
//
// A vertex moves onto another, so vertices keep their colours. OpenMesh takes no edge of more than two faces.
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include <cstring>
#include <vector>

#include "bench/simplify/side.h"

namespace {

using surface = OpenMesh::TriMesh_ArrayKernelT<>;

struct model {
    const fct_mesh *input;
    surface mesh;
    OpenMesh::VPropHandleT<uint32_t> source; // the vertex of the input
};

void *open_model(const fct_mesh *mesh, const char *policy, uint32_t, const char **refused) {
    if (std::strcmp(policy, "default") != 0) return nullptr;
    omerr().disable();
    model *m = new model;
    m->input = mesh;
    m->mesh.add_property(m->source);
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * std::size_t(v);
        m->mesh.property(m->source, m->mesh.add_vertex(surface::Point(p[0], p[1], p[2]))) = v;
    }
    for (std::size_t f = 0; f < mesh->face_count; ++f) {
        const uint32_t *t = mesh->triangles + 3 * f;
        bool repeats = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
        surface::VertexHandle corners[3];
        for (int k = 0; k < 3; ++k) corners[k] = surface::VertexHandle(int(t[k]));
        if (repeats || !m->mesh.add_face(corners, 3).is_valid()) {
            *refused = repeats ? "a face with a repeated corner" : "not an oriented manifold";
            delete m;
            return nullptr;
        }
    }
    return m;
}

void run_model(void *user, uint32_t faces) {
    model *m = static_cast<model *>(user);
    m->mesh.request_vertex_status();
    m->mesh.request_edge_status();
    m->mesh.request_halfedge_status();
    m->mesh.request_face_status();
    {
        OpenMesh::Decimater::DecimaterT<surface> decimater(m->mesh);
        OpenMesh::Decimater::ModQuadricT<surface>::Handle quadric;
        decimater.add(quadric);
        decimater.initialize();
        decimater.decimate_to_faces(0, faces);
    }
    m->mesh.garbage_collection();
}

void get_result(void *user, const fct_env *env, fct_mesh *out) {
    model *m = static_cast<model *>(user);
    std::vector<uint32_t> triangles;
    for (auto f : m->mesh.faces())
        for (auto v : m->mesh.fv_range(f)) triangles.push_back(m->mesh.property(m->source, v));
    bench_pick_vertices(env, m->input, triangles.data(), uint32_t(triangles.size() / 3), out);
}

void close_model(void *user) {
    delete static_cast<model *>(user);
}

} // namespace

const bench_side bench_library = {"default", open_model, run_model, get_result, close_model};
