// bench/queries/bullet.cpp: rays through Bullet's tree of quantised boxes over a mesh. Bullet asks for the
// nearest hit of a segment; its triangle test has a tolerance at the edges.
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>

#include <limits>

#include "bench/queries/sides.h"

namespace {

struct model {
    btTriangleIndexVertexArray arrays;
    btBvhTriangleMeshShape shape;
    btVector3 center;
    btScalar radius;

    explicit model(const fct_mesh *mesh)
        : arrays(int(mesh->face_count), reinterpret_cast<int *>(mesh->triangles), 12, int(mesh->vertex_count),
                 mesh->positions, 12),
          shape(&arrays, true) {
        btVector3 lower, upper;
        shape.getAabb(btTransform::getIdentity(), lower, upper);
        center = (lower + upper) / 2;
        radius = (upper - lower).length() / 2;
    }
};

void *build_model(const fct_mesh *mesh, const fct_tree *, uint32_t) {
    return new model(mesh);
}

void destroy_model(void *m) {
    delete static_cast<model *>(m);
}

struct nearest : btTriangleRaycastCallback {
    using btTriangleRaycastCallback::btTriangleRaycastCallback;
    bool hit = false;

    btScalar reportHit(const btVector3 &, btScalar fraction, int, int) override {
        hit = true;
        return fraction;
    }
};

// The segment ends where the ray has left the ball around the model.
void find_closest_hits(void *model_, size_t count, const void *queries, double *t) {
    auto *m = static_cast<model *>(model_);
    for (size_t i = 0; i < count; ++i) {
        const fct_ray &r = static_cast<const fct_ray *>(queries)[i];
        btVector3 from(r.origin[0], r.origin[1], r.origin[2]),
            direction(r.direction[0], r.direction[1], r.direction[2]);
        btScalar end = ((m->center - from).length() + m->radius) / direction.length();
        btVector3 to = from + end * direction;
        nearest callback(from, to);
        m->shape.performRaycast(&callback, from, to);
        t[i] = callback.hit ? double(callback.m_hitFraction) * double(end)
                            : std::numeric_limits<double>::infinity();
    }
}

bench_side make_side() {
    bench_side s{};
    s.name = "Bullet";
    s.most_triangles = 2000000; // its nodes have 21 bits for a triangle
    s.build = build_model;
    s.destroy = destroy_model;
    s.ask[BENCH_CLOSEST_HIT] = find_closest_hits;
    return s;
}

} // namespace

extern const bench_side bench_bullet = make_side();
