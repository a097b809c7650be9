/* Surfaces: no T-junctions, sizes of edges, creases, refinement. */
#include "../place.h"
#include "radiosity/surface/refine.h"
#include "radiosity/surface/split.h"
#include "radiosity/surface/tessellate.h"

static fct_env plain; /* outlives every scene */

static fct_scene *begin(void) {
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    return scene;
}

static fct_surface build(const fct_scene *scene, uint32_t instance, double max_edge) {
    fct_surface s;
    assert_int_equal(fct_surface_build(&plain, SHADE(scene, instance), max_edge, &s), FCT_OK);
    return s;
}

/* The unit cube with 8 vertices and 12 outward triangles. */
static fct_mesh make_cube(void) {
    static const uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&plain, 8, 12, 0, &mesh), FCT_OK);
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) mesh.positions[3 * v + k] = (float)(v >> k & 1);
    memcpy(mesh.triangles, faces, sizeof faces);
    return mesh;
}

static fct_scene *one_mesh(const fct_mesh *mesh, const float *transform) {
    fct_scene *scene = begin();
    place_mesh(scene, mesh, place_material(scene, .5, 0, false), transform);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    return scene;
}

static v3 at(const fct_surface *s, uint32_t v) {
    return v3_load(s->mesh.positions + 3 * (size_t)v);
}

static v3 face_cross(const fct_surface *s, size_t f) {
    const uint32_t *t = s->mesh.triangles + 3 * f;
    return v3_cross(v3_sub(at(s, t[1]), at(s, t[0])), v3_sub(at(s, t[2]), at(s, t[0])));
}

static double total_area(const fct_surface *s) {
    double area = 0;
    for (size_t f = 0; f < s->mesh.face_count; ++f) area += .5 * v3_norm(face_cross(s, f));
    return area;
}

/* Every edge (by positions) has as many faces in one direction as in the other. */
static void assert_closed(const fct_surface *s) {
    uint32_t *first = fct_allocate(&plain, s->mesh.vertex_count, sizeof *first);
    assert_int_equal(fct_weld(&plain, s->mesh.vertex_count, s->mesh.positions, first), FCT_OK);
    fct_edge_table table;
    size_t corners = 3 * (size_t)s->mesh.face_count;
    assert_int_equal(fct_edge_table_init(&plain, corners, &table), FCT_OK);
    for (size_t c = 0; c < corners; ++c) {
        uint32_t a = first[s->mesh.triangles[c]], b = first[s->mesh.triangles[c % 3 == 2 ? c - 2 : c + 1]];
        bool fresh;
        uint32_t *balance = fct_edge_table_insert(&table, a, b, &fresh);
        if (fresh) *balance = 0;
        *balance += a < b ? 1 : UINT32_MAX;
    }
    for (size_t i = 0; i <= table.mask; ++i) assert_true(table.keys[i] == UINT64_MAX || table.values[i] == 0);
    fct_edge_table_release(&plain, &table);
    fct_memory_release(&plain, first);
}

/* Invariants of every surface. */
static void assert_sound(const fct_scene *scene, uint32_t instance, const fct_surface *s) {
    fct_scene_view view = fct_scene_get(scene);
    const fct_instance *placed = view.instances + instance;
    fct_tree_view tree = fct_tree_get(view.models[placed->model].tree);
    double areas = 0;
    for (size_t v = 0; v < s->mesh.vertex_count; ++v) areas += s->areas[v];
    assert_true(fabs(areas - total_area(s)) <= 1e-4 * total_area(s));
    for (size_t f = 0; f < s->mesh.face_count; ++f) {
        v3 n = face_cross(s, f);
        assert_true(s->face_places[f] < tree.face_count);
        uint32_t source = tree.face_ids[s->face_places[f]];
        const uint32_t *sources = view.models[placed->model].source_faces;
        assert_int_equal(s->mesh.source_faces[f], sources ? sources[source] : source);
        if (v3_norm2(n) == 0) continue;
        for (size_t k = 0; k < 3; ++k) {
            size_t v = s->mesh.triangles[3 * f + k];
            v3 normal = v3_load(s->normals + 3 * v);
            assert_true(fabs(v3_norm(normal) - 1) < 1e-5);
            assert_true(v3_dot(normal, v3_unit(n)) > .01);
            assert_true(s->offsets[v] > 0 && s->places[v] < tree.face_count);
        }
    }
}

static void cube_is_split_evenly(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    plain = env;
    fct_mesh cube = make_cube();
    fct_scene *scene = one_mesh(&cube, NULL);
    fct_surface s = build(scene, 0, .26);
    assert_sound(scene, 0, &s);
    assert_closed(&s);
    double longest = 0;
    for (size_t f = 0; f < s.mesh.face_count; ++f)
        for (size_t k = 0; k < 3; ++k)
            longest = fmax(longest, v3_norm(v3_sub(at(&s, s.mesh.triangles[3 * f + k]),
                                                   at(&s, s.mesh.triangles[3 * f + (k + 1) % 3]))));
    assert_true(longest <= .26);
    /* Diagonals of 1.41 are halved three times, sides twice. */
    assert_true(s.mesh.face_count >= 12 * 16 && s.mesh.face_count <= 12 * 64);
    assert_true(fabs(total_area(&s) - 6) < 1e-5);
    /* Flat all over, sharp at the rims: each vertex has the normal of its side and lies on it. */
    for (uint32_t v = 0; v < s.mesh.vertex_count; ++v) {
        v3 n = v3_load(s.normals + 3 * (size_t)v), q = v3_load(s.sample_points + 3 * (size_t)v),
           p = at(&s, v);
        assert_int_equal(s.flat[v], 1);
        assert_true(fmax(fabs(n.x), fmax(fabs(n.y), fabs(n.z))) > .99999);
        assert_true(fabs(v3_dot(n, v3_sub(q, p))) < 1e-6);
        /* Sample points keep off the other sides. */
        double c[3] = {q.x, q.y, q.z}, m[3] = {n.x, n.y, n.z};
        for (int k = 0; k < 3; ++k)
            if (fabs(m[k]) < .5) assert_true(c[k] > .004 && c[k] < .996);
        bool inside = true;
        double pc[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k)
            if (fabs(m[k]) < .5) inside = inside && pc[k] > 0 && pc[k] < 1;
        if (inside) assert_true(v3_norm(v3_sub(q, p)) == 0);
    }
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &cube);
}

/* Neighbours of very different sizes agree on every edge, welded or not. */
static void splits_conform(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh ball = make_sphere(&plain, 9);
    for (size_t v = 0; v < ball.vertex_count; ++v) ball.positions[3 * v] *= 30;
    fct_scene *scene = one_mesh(&ball, NULL);
    fct_surface s = build(scene, 0, 1.5);
    assert_true(s.mesh.face_count > 3 * ball.face_count);
    assert_sound(scene, 0, &s);
    assert_closed(&s);
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);

    fct_mesh soup;
    assert_int_equal(fct_mesh_create(&plain, 3 * ball.face_count, ball.face_count, 0, &soup), FCT_OK);
    for (uint32_t c = 0; c < soup.vertex_count; ++c) {
        memcpy(soup.positions + 3 * (size_t)c, ball.positions + 3 * (size_t)ball.triangles[c], 12);
        soup.triangles[c] = c;
    }
    scene = one_mesh(&soup, NULL);
    s = build(scene, 0, 1.5);
    assert_sound(scene, 0, &s);
    assert_closed(&s);
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &soup);
    fct_mesh_release(&plain, &ball);
}

/* A dense smooth model is unchanged: the same vertices and triangles in the same order. */
static void dense_models_pass(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh ball = make_sphere(&plain, 60);
    const float moved[12] = {-2, 0, 0, 1, 0, 2, 0, 2, 0, 0, 2, 3}; /* mirrored */
    fct_scene *scene = one_mesh(&ball, moved);
    fct_surface s = build(scene, 0, 1);
    assert_int_equal(s.mesh.vertex_count, ball.vertex_count);
    assert_int_equal(s.mesh.face_count, ball.face_count);
    assert_sound(scene, 0, &s);
    for (size_t f = 0; f < ball.face_count; ++f) {
        const uint32_t *a = ball.triangles + 3 * f, *b = s.mesh.triangles + 3 * f;
        assert_true(a[0] == b[0] && a[1] == b[2] && a[2] == b[1]);
        assert_int_equal(s.mesh.source_faces[f], f);
    }
    for (uint32_t v = 0; v < ball.vertex_count; ++v) {
        v3 out = v3_scale(v3_sub(at(&s, v), v3_make(1, 2, 3)), .5), n = v3_load(s.normals + 3 * (size_t)v);
        assert_true(v3_dot(out, n) > .999);
        assert_int_equal(s.flat[v], 0);
        assert_true(v3_norm(v3_sub(v3_load(s.sample_points + 3 * (size_t)v), at(&s, v))) == 0);
    }
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &ball);
}

/* A floor under a box is fine near the contact and coarse far from it. */
static void finer_near_contacts(void **state) {
    (void)state;
    fct_scene *scene = begin();
    fct_mesh cube = make_cube();
    uint32_t grey = place_material(scene, .5, 0, false);
    place_sheet(&plain, scene, grey, 1, v3_make(-20, -20, 0), v3_make(40, 0, 0), v3_make(0, 40, 0));
    place_mesh(scene, &cube, grey, NULL);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_surface s = build(scene, 0, 2);
    double near = 0, far = 0, nears = 0, fars = 0;
    for (size_t f = 0; f < s.mesh.face_count; ++f) {
        v3 p = at(&s, s.mesh.triangles[3 * f]);
        double area = .5 * v3_norm(face_cross(&s, f));
        bool close = p.x > -.3 && p.x < 1.3 && p.y > -.3 && p.y < 1.3;
        if (close) near += area, ++nears;
        if (fabs(p.x) > 10) far += area, ++fars;
    }
    assert_true(nears > 0 && near / nears * 6 < far / fars);
    assert_sound(scene, 0, &s);
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &cube);
}

/* A hub of many faces, an edge of many faces, degenerate faces: fast and without NaN. */
static void odd_meshes(void **state) {
    (void)state;
    plain = fct_env_default();
    enum { N = 20000 };
    for (int kind = 0; kind < 3; ++kind) {
        fct_mesh mesh;
        assert_int_equal(fct_mesh_create(&plain, N + 2, N, 0, &mesh), FCT_OK);
        for (uint32_t v = 0; v < N + 2; ++v) {
            double angle = 2 * FCT_PI * v / N, sharp = kind == 0 ? (v & 1 ? .5 : -.5) : 0;
            v3 p = v < N ? v3_make(cos(angle), sin(angle), sharp) : v3_make(0, 0, v == N ? 1 : -1);
            v3_store(mesh.positions + 3 * (size_t)v, p);
        }
        for (uint32_t f = 0; f < N; ++f) {
            uint32_t fan[3] = {N, f, (f + 1) % N}, book[3] = {N, N + 1, f}, bad[3] = {f, f, (f + 1) % N};
            memcpy(mesh.triangles + 3 * (size_t)f, kind == 0 ? fan : kind == 1 || f % 2 ? book : bad, 12);
        }
        fct_scene *scene = one_mesh(&mesh, NULL);
        fct_surface s = build(scene, 0, 10);
        assert_sound(scene, 0, &s);
        for (size_t v = 0; v < 3 * (size_t)s.mesh.vertex_count; ++v)
            assert_true(isfinite(s.normals[v]) && isfinite(s.sample_points[v]));
        fct_surface_release(&plain, &s);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &mesh);
    }
}

/* Two thirds of a steep cone: the mean normal is behind the outer faces, but another direction is in front of
 * all. A screw of faces that turns over has no such direction, and each face gets a vertex of its own. */
static void fronts_are_found(void **state) {
    (void)state;
    plain = fct_env_default();
    for (int turned = 0; turned < 2; ++turned) {
        uint32_t n = turned ? 9 : 13;
        fct_mesh mesh;
        assert_int_equal(fct_mesh_create(&plain, n + 2, n, 0, &mesh), FCT_OK);
        v3_store(mesh.positions, v3_make(0, 0, 0));
        for (uint32_t i = 0; i <= n; ++i) {
            double angle = FCT_PI / 9 * i;
            v3_store(mesh.positions + 3 * (size_t)(i + 1),
                     turned ? v3_make(.001 * cos(angle), .001 * sin(angle), -5)
                            : v3_make(cos(angle), sin(angle), -5));
        }
        if (turned) v3_store(mesh.positions + 3, v3_make(.001, -.0001, 5));
        for (uint32_t i = 0; i < n; ++i) {
            uint32_t t[3] = {0, i + 1, i + 2};
            memcpy(mesh.triangles + 3 * (size_t)i, t, sizeof t);
        }
        fct_scene *scene = one_mesh(&mesh, NULL);
        fct_surface s = build(scene, 0, 100);
        assert_sound(scene, 0, &s);
        assert_true(turned ? s.mesh.vertex_count > n + 2 : s.mesh.vertex_count == n + 2);
        fct_surface_release(&plain, &s);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &mesh);
    }
}

typedef struct border {
    const fct_surface *surface;
} border;

static double crosses(void *user, uint32_t a, uint32_t b) {
    const border *x = user;
    assert_true(a < b);
    double h = .37;
    return (at(x->surface, a).x - h) * (at(x->surface, b).x - h) < 0 ? .5 : 0;
}

/* Marks edges of the top only; the other sides must split the shared rim too. */
static double on_top(void *user, uint32_t a, uint32_t b) {
    const border *x = user;
    const float *n = x->surface->normals;
    return n[3 * (size_t)a + 2] > .5F && n[3 * (size_t)b + 2] > .5F ? .5 : 0;
}

static double never(void *user, uint32_t a, uint32_t b) {
    (void)user, (void)a, (void)b;
    return 0;
}

static void refinement(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh cube = make_cube();
    fct_scene *scene = one_mesh(&cube, NULL);
    fct_surface s = build(scene, 0, .5);
    for (size_t v = 0; v < 3 * (size_t)s.mesh.vertex_count; ++v) s.mesh.colors[v] = s.mesh.positions[v];
    for (int round = 0; round < 3; ++round) {
        uint32_t vertices = s.mesh.vertex_count, faces = s.mesh.face_count, added;
        float *positions = fct_allocate(&plain, vertices, 12);
        memcpy(positions, s.mesh.positions, 12 * (size_t)vertices);
        border x = {&s};
        assert_int_equal(fct_surface_refine(&plain, &s, crosses, &x, &added), FCT_OK);
        assert_true(added > 0 && s.mesh.vertex_count == vertices + added && s.mesh.face_count > faces);
        assert_memory_equal(positions, s.mesh.positions, 12 * (size_t)vertices);
        assert_sound(scene, 0, &s);
        assert_closed(&s);
        assert_true(fabs(total_area(&s) - 6) < 1e-5);
        for (uint32_t v = 0; v < 3 * s.mesh.vertex_count; ++v)
            assert_true(fabsf(s.mesh.colors[v] - s.mesh.positions[v]) < 1e-6F);
        for (uint32_t v = vertices; v < s.mesh.vertex_count; ++v) {
            v3 n = v3_load(s.normals + 3 * (size_t)v), q = v3_load(s.sample_points + 3 * (size_t)v);
            double c[3] = {q.x, q.y, q.z}, m[3] = {n.x, n.y, n.z};
            assert_true(s.flat[v] && fabs(v3_dot(n, v3_sub(q, at(&s, v)))) < 1e-6);
            for (int k = 0; k < 3; ++k)
                if (fabs(m[k]) < .5) assert_true(c[k] > .001 && c[k] < .999);
        }
        fct_memory_release(&plain, positions);
    }
    border x = {&s};
    assert_int_equal(fct_surface_refine(&plain, &s, on_top, &x, NULL), FCT_OK);
    assert_closed(&s);
    assert_sound(scene, 0, &s);
    uint32_t added, faces = s.mesh.face_count;
    assert_int_equal(fct_surface_refine(&plain, &s, never, NULL, &added), FCT_OK);
    assert_true(added == 0 && s.mesh.face_count == faces);
    fct_surface_release(&plain, &s);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &cube);
}

/* Two squares at an edge: below 40 degrees they share two vertices, above they do not. */
static void creases_begin_at_forty_degrees(void **state) {
    (void)state;
    plain = fct_env_default();
    for (int angle = 38; angle <= 42; angle += 4) {
        double a = angle * FCT_PI / 180;
        fct_mesh mesh;
        assert_int_equal(fct_mesh_create(&plain, 6, 4, 0, &mesh), FCT_OK);
        for (uint32_t v = 0; v < 6; ++v) {
            v3 p = v < 2   ? v3_make(-1, v % 2, 0)
                   : v < 4 ? v3_make(0, v % 2, 0)
                           : v3_make(cos(a), v % 2, sin(a));
            v3_store(mesh.positions + 3 * (size_t)v, p);
        }
        static const uint32_t faces[12] = {0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5};
        memcpy(mesh.triangles, faces, sizeof faces);
        fct_scene *scene = one_mesh(&mesh, NULL);
        fct_surface s = build(scene, 0, 10);
        assert_int_equal(s.mesh.vertex_count, angle < 40 ? 6 : 8);
        assert_sound(scene, 0, &s);
        fct_surface_release(&plain, &s);
        fct_scene_destroy(scene);
        fct_mesh_release(&plain, &mesh);
    }
}

/* Edges 0-1 and 1-2 of a triangle are split: the shorter diagonal of the quadrilateral is from 0 to the
 * midpoint of 1-2 (2.06 against 2.24), or the other one in a mirrored triangle. */
static void splits_use_the_shorter_diagonal(void **state) {
    (void)state;
    plain = fct_env_default();
    static const float tall[9] = {0, 0, 0, 4, 0, 0, 0, 1, 0}, wide[9] = {0, 1, 0, 4, 0, 0, 0, 0, 0};
    static const uint32_t triangle[3] = {0, 1, 2};
    const uint8_t marks = 3;
    for (int k = 0; k < 2; ++k) {
        fct_split split;
        assert_int_equal(fct_split_edges(&plain, 3, k ? wide : tall, 1, triangle, &marks, &split), FCT_OK);
        assert_int_equal(split.face_count, 3);
        int parts_at_0 = 0;
        for (int c = 0; c < 9; ++c) parts_at_0 += split.triangles[c] == 0;
        assert_int_equal(parts_at_0, k ? 1 : 2);
        fct_split_release(&plain, &split);
    }
}

static void threads_do_not_matter(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh mesh = make_bumpy(&plain, 70, .3);
    fct_scene *scene = one_mesh(&mesh, NULL);
    fct_surface s[2];
    for (uint32_t i = 0; i < 2; ++i) {
        fct_env env = plain;
        env.thread_count = 1 + 2 * i;
        assert_int_equal(fct_surface_build(&env, SHADE(scene, 0), .05, s + i), FCT_OK);
    }
    size_t vertices = s[0].mesh.vertex_count, faces = s[0].mesh.face_count;
    assert_true(vertices == s[1].mesh.vertex_count && faces == s[1].mesh.face_count &&
                faces > mesh.face_count);
    assert_memory_equal(s[0].mesh.positions, s[1].mesh.positions, 12 * vertices);
    assert_memory_equal(s[0].mesh.triangles, s[1].mesh.triangles, 12 * faces);
    assert_memory_equal(s[0].normals, s[1].normals, 12 * vertices);
    assert_memory_equal(s[0].areas, s[1].areas, 4 * vertices);
    for (int i = 0; i < 2; ++i) fct_surface_release(&plain, s + i);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &mesh);
}

static void memory_runs_out(void **state) {
    (void)state;
    plain = fct_env_default();
    fct_mesh cube = make_cube();
    fct_scene *scene = one_mesh(&cube, NULL);
    fct_result result = FCT_ERROR_MEMORY;
    long n = 1;
    for (; result != FCT_OK; ++n) {
        recorder r = {.fail_at = n};
        fct_env env = recorder_env(&r);
        fct_surface s;
        result = fct_surface_build(&env, SHADE(scene, 0), .4, &s);
        assert_true(result == FCT_OK || (result == FCT_ERROR_MEMORY && r.messages && !s.normals));
        fct_surface_release(&env, &s);
        assert_int_equal(r.alive, 0);
    }
    assert_true(n > 30);
    recorder r = {0};
    fct_env env = recorder_env(&r);
    fct_surface s;
    assert_int_equal(fct_surface_build(&env, SHADE(scene, 0), .4, &s), FCT_OK);
    memset(s.mesh.colors, 0, 12 * (size_t)s.mesh.vertex_count);
    long steps = 0;
    do {
        uint32_t before = s.mesh.vertex_count, added;
        border x = {&s};
        r.fail_at = r.allocations + ++steps;
        result = fct_surface_refine(&env, &s, crosses, &x, &added);
        assert_true(result == FCT_OK ||
                    (result == FCT_ERROR_MEMORY && s.mesh.vertex_count == before && !added));
    } while (result != FCT_OK);
    assert_true(steps > 10);
    assert_sound(scene, 0, &s);
    fct_surface_release(&env, &s);
    assert_int_equal(r.alive, 0);
    fct_scene_destroy(scene);
    fct_mesh_release(&plain, &cube);
}

/* Copies a rectangle (two triangles) into the mesh from vertex and face on. */
static void put_rectangle(fct_mesh *mesh, uint32_t vertex, uint32_t face, v3 o, v3 u, v3 v) {
    const v3 corners[4] = {o, v3_add(o, u), v3_add(v3_add(o, u), v), v3_add(o, v)};
    const uint32_t faces[6] = {0, 1, 2, 0, 2, 3};
    for (uint32_t k = 0; k < 4; ++k) v3_store(mesh->positions + 3 * (size_t)(vertex + k), corners[k]);
    for (uint32_t k = 0; k < 6; ++k) mesh->triangles[3 * (size_t)face + k] = vertex + faces[k];
}

static double box_distance(v3 p, v3 low, v3 high) {
    const double x = fmax(fmax(low.x - p.x, p.x - high.x), 0), y = fmax(fmax(low.y - p.y, p.y - high.y), 0),
                 z = fmax(fmax(low.z - p.z, p.z - high.z), 0);
    return sqrt(x * x + y * y + z * z);
}

/* A plate, a cube that lies on it, and a tile that continues it, in one mesh: the plate is split near the
 * cube as if the cube were another instance, and nowhere else. */
static void parts_refine_each_other(void **state) {
    (void)state;
    const double longest = 1, shortest = longest / 4;
    const v3 low = v3_make(.9, -.1, .01), high = v3_make(1.1, .1, .21);
    for (int turned = 0; turned < 2; ++turned) {
        fct_mesh mesh;
        fct_scene *scene = begin();
        assert_int_equal(fct_mesh_create(&plain, 16, 16, 0, &mesh), FCT_OK);
        put_rectangle(&mesh, 0, 0, v3_make(-2, -2, 0), v3_make(4, 0, 0), v3_make(0, 4, 0));
        put_rectangle(&mesh, 4, 2, v3_make(2.02, -2, 0), v3_make(1, 0, 0), v3_make(0, 4, 0));
        fct_mesh cube = make_cube();
        for (uint32_t v = 0; v < 8; ++v)
            v3_store(mesh.positions + 3 * (size_t)(8 + v),
                     v3_add(low, v3_scale(v3_load(cube.positions + 3 * (size_t)v), .2)));
        for (uint32_t c = 0; c < 36; ++c) mesh.triangles[12 + c] = 8 + cube.triangles[c];
        const float transform[12] = {0, -2, 0, 5, 2, 0, 0, 1, 0, 0, 2, -3};
        place_mesh(scene, &mesh, place_material(scene, .5, 0, false), turned ? transform : NULL);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        const double scale = turned ? 2 : 1;
        fct_surface s = build(scene, 0, scale * longest);
        assert_sound(scene, 0, &s);
        uint32_t near = 0, coarse = 0;
        for (size_t f = 0; f < s.mesh.face_count; ++f) {
            if (s.mesh.source_faces[f] >= 4) continue;
            for (size_t k = 0; k < 3; ++k) {
                v3 ends[2];
                for (size_t i = 0; i < 2; ++i) {
                    v3 p = at(&s, s.mesh.triangles[3 * f + (k + i) % 3]);
                    if (turned) p = v3_make((p.y - 1) / 2, -(p.x - 5) / 2, (p.z + 3) / 2);
                    ends[i] = p;
                }
                const double length = v3_norm(v3_sub(ends[1], ends[0]));
                const double distance = box_distance(v3_scale(v3_add(ends[0], ends[1]), .5), low, high);
                /* The boxes of small clusters stand for their surfaces: the distance errs by a third. */
                if (length > shortest * 1.01 && distance < .6 * length)
                    fail_msg("%g long at %g", length, distance);
                if (distance < shortest / 2) ++near;
                if (distance > 1.5 && length > .4 * longest) ++coarse;
            }
        }
        assert_true(near > 10 && coarse > 100);
        assert_true(s.mesh.face_count < 400);
        fct_surface_release(&plain, &s);
        fct_mesh_release(&plain, &mesh), fct_mesh_release(&plain, &cube);
        fct_scene_destroy(scene);
    }
}

/* A tile that lies a little above a plate is no continuation of it: both are split where they are near. */
static void low_steps_refine(void **state) {
    (void)state;
    const double longest = 1, shortest = longest / 4;
    const v3 low = v3_make(-.3, -.3, .03), high = v3_make(.3, .3, .03);
    fct_mesh mesh;
    fct_scene *scene = begin();
    assert_int_equal(fct_mesh_create(&plain, 8, 4, 0, &mesh), FCT_OK);
    put_rectangle(&mesh, 0, 0, v3_make(-2, -2, 0), v3_make(4, 0, 0), v3_make(0, 4, 0));
    put_rectangle(&mesh, 4, 2, low, v3_make(.6, 0, 0), v3_make(0, .6, 0));
    place_mesh(scene, &mesh, place_material(scene, .5, 0, false), NULL);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_surface s = build(scene, 0, longest);
    uint32_t near = 0, tile = 0;
    for (size_t c = 0; c < 3 * (size_t)s.mesh.face_count; ++c) {
        const v3 a = at(&s, s.mesh.triangles[c]), b = at(&s, s.mesh.triangles[c % 3 == 2 ? c - 2 : c + 1]);
        const double length = v3_norm(v3_sub(b, a));
        tile += s.mesh.source_faces[c / 3] >= 2;
        if (s.mesh.source_faces[c / 3] >= 2 || box_distance(v3_scale(v3_add(a, b), .5), low, high) > .1)
            continue;
        assert_true(length <= 1.01 * shortest);
        ++near;
    }
    assert_true(near > 10 && tile > 3 * 8);
    fct_surface_release(&plain, &s);
    fct_mesh_release(&plain, &mesh);
    fct_scene_destroy(scene);
}

/* The faces of a fold share two corners, whatever their order in each face, so they are one part and do not
 * refine each other. A far triangle is another part. */
static void folds_are_one_part(void **state) {
    (void)state;
    static const float positions[21] = {0, 0, 0, 0, 4, 0, 4, 2, 0, 0, 2, 4, 90, 0, 0, 91, 0, 0, 90, 1, 0};
    static const uint8_t orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    static const uint32_t faces[2][3] = {{2, 1, 0}, {0, 1, 3}};
    for (int order = 0; order < 36; ++order) {
        fct_mesh mesh;
        fct_scene *scene = begin();
        assert_int_equal(fct_mesh_create(&plain, 7, 3, 0, &mesh), FCT_OK);
        memcpy(mesh.positions, positions, sizeof positions);
        for (uint32_t k = 0; k < 3; ++k) {
            mesh.triangles[k] = faces[0][orders[order / 6][k]];
            mesh.triangles[3 + k] = faces[1][orders[order % 6][k]];
            mesh.triangles[6 + k] = 4 + k;
        }
        place_mesh(scene, &mesh, place_material(scene, .5, 0, false), NULL);
        assert_int_equal(fct_scene_commit(scene), FCT_OK);
        fct_surface s = build(scene, 0, 6);
        assert_int_equal(s.mesh.face_count, 3);
        fct_surface_release(&plain, &s);
        fct_mesh_release(&plain, &mesh);
        fct_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_refine_each_other),
        cmocka_unit_test(low_steps_refine),
        cmocka_unit_test(folds_are_one_part),
        cmocka_unit_test(cube_is_split_evenly),
        cmocka_unit_test(splits_conform),
        cmocka_unit_test(dense_models_pass),
        cmocka_unit_test(finer_near_contacts),
        cmocka_unit_test(odd_meshes),
        cmocka_unit_test(refinement),
        cmocka_unit_test(creases_begin_at_forty_degrees),
        cmocka_unit_test(splits_use_the_shorter_diagonal),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(fronts_are_found),
        cmocka_unit_test(memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
