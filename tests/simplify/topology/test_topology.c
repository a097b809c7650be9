/* Points, wedges, classes, rings and edges of a mesh against comparisons of all pairs; welding against its
 * rules. */
#include "../oracle.h"

static fct_env env;

static float canonical(float x) {
    return x == 0 ? 0 : x;
}

static bool equal_floats(const float *a, const float *b, int count) {
    for (int i = 0; i < count; ++i)
        if (canonical(a[i]) != canonical(b[i])) return false;
    return true;
}

/* Two labellings are the same partition. */
static void assert_same_partition(const uint32_t *got, const uint32_t *want, uint32_t count) {
    uint32_t *map = malloc(2 * (size_t)count * sizeof *map);
    memset(map, 0xff, 2 * (size_t)count * sizeof *map);
    for (uint32_t i = 0; i < count; ++i) {
        if (want[i] == FCT_NONE) continue;
        uint32_t *forward = map + got[i], *back = map + count + want[i];
        if (*forward == FCT_NONE && *back == FCT_NONE) *forward = want[i], *back = got[i];
        assert_true(*forward == want[i] && *back == got[i]);
    }
    free(map);
}

/* --- The rules of welding, by comparisons of all pairs of sides --- */

typedef struct rules {
    const fct_mesh *mesh;
    uint32_t places[200], points[200], bodies[200];
} rules;

static void unite(uint32_t *labels, uint32_t count, uint32_t a, uint32_t b) {
    uint32_t from = labels[b], to = labels[a];
    for (uint32_t i = 0; i < count; ++i)
        if (labels[i] == from) labels[i] = to;
}

static void find_ends(const rules *r, uint32_t c, uint32_t ends[2]) {
    uint32_t a = r->mesh->triangles[c], b = r->mesh->triangles[c - c % 3 + (c + 1) % 3];
    bool swap = r->places[a] > r->places[b];
    ends[0] = swap ? b : a, ends[1] = swap ? a : b;
}

static bool same_vertices(const rules *r, uint32_t c, uint32_t d) {
    uint32_t e[2], f[2];
    find_ends(r, c, e), find_ends(r, d, f);
    return e[0] == f[0] && e[1] == f[1];
}

static bool same_places(const rules *r, uint32_t c, uint32_t d) {
    uint32_t e[2], f[2];
    find_ends(r, c, e), find_ends(r, d, f);
    return r->places[e[0]] == r->places[f[0]] && r->places[e[1]] == r->places[f[1]];
}

static bool is_open(const rules *r, uint32_t c) {
    uint32_t e[2];
    find_ends(r, c, e);
    if (r->places[e[0]] == r->places[e[1]]) return false;
    for (uint32_t d = 0; d < 3 * r->mesh->face_count; ++d)
        if (d != c && same_vertices(r, c, d)) return false;
    return true;
}

static void join_ends(rules *r, uint32_t c, uint32_t d, bool bodies) {
    uint32_t e[2], f[2], count = r->mesh->vertex_count;
    find_ends(r, c, e), find_ends(r, d, f);
    for (int k = 0; k < 2; ++k) {
        unite(r->points, count, e[k], f[k]);
        if (bodies) unite(r->bodies, count, e[k], f[k]);
    }
}

/* The open sides at the two places of side c. */
static uint32_t list_open(const rules *r, uint32_t c, uint32_t *list) {
    uint32_t count = 0;
    for (uint32_t d = 0; d < 3 * r->mesh->face_count; ++d)
        if (is_open(r, d) && same_places(r, c, d)) list[count++] = d;
    return count;
}

static void apply_rules(rules *r, const fct_mesh *mesh) {
    uint32_t corners = 3 * mesh->face_count, list[600];
    r->mesh = mesh;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        r->places[v] = r->points[v] = r->bodies[v] = v;
        for (uint32_t w = 0; w < v; ++w)
            if (equal_floats(mesh->positions + 3 * v, mesh->positions + 3 * w, 3)) {
                r->places[v] = r->places[w];
                break;
            }
    }
    for (uint32_t c = 0; c < corners; ++c) {
        uint32_t a = mesh->triangles[c], b = mesh->triangles[c - c % 3 + (c + 1) % 3];
        unite(r->bodies, mesh->vertex_count, a, b);
        if (r->places[a] == r->places[b]) unite(r->points, mesh->vertex_count, a, b);
    }
    for (uint32_t c = 0; c < corners; ++c)
        if (is_open(r, c) && list_open(r, c, list) == 2) join_ends(r, list[0], list[1], true);
    for (uint32_t c = 0; c < corners; ++c) {
        uint32_t count = is_open(r, c) ? list_open(r, c, list) : 0, body_of[600];
        if (count < 3 || list[0] != c) continue;
        bool single = false;
        for (uint32_t i = 0; i < count; ++i) body_of[i] = r->bodies[mesh->triangles[list[i]]];
        for (uint32_t i = 0; i < count; ++i) {
            uint32_t others = 0;
            for (uint32_t k = 0; k < count; ++k) others += k != i && body_of[k] == body_of[i];
            single |= others == 0;
        }
        for (uint32_t i = 0; i < count; ++i)
            for (uint32_t k = 0; k < i; ++k)
                if (single || body_of[i] == body_of[k]) join_ends(r, list[i], list[k], false);
    }
}

/* A few faces on a lattice of 3 x 3 x 2 places, with several vertices per place: sides of every kind
 * coincide. */
static fct_mesh make_puzzle(uint64_t seed) {
    uint32_t copies = 2 + (uint32_t)(uniform(&seed) * 2), faces = 4 + (uint32_t)(uniform(&seed) * 24);
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 18 * copies, faces, 0, &mesh), FCT_OK);
    for (uint32_t v = 0; v < 18 * copies; ++v) {
        uint32_t place = v / copies;
        float p[3] = {(float)(place % 3), (float)(place / 3 % 3), (float)(place / 9)};
        if (p[0] == 0 && v % 2) p[0] = -0.f;
        memcpy(mesh.positions + 3 * v, p, sizeof p);
    }
    uint32_t reach = 5 + (uint32_t)(uniform(&seed) * 13);
    for (uint32_t c = 0; c < 3 * faces; ++c)
        mesh.triangles[c] = (uint32_t)(uniform(&seed) * reach) * copies + (uint32_t)(uniform(&seed) * copies);
    return mesh;
}

static void vertices_weld_by_the_rules(void **state) {
    (void)state;
    uint32_t joined = 0, apart = 0;
    for (uint64_t round = 0; round < 400; ++round) {
        fct_mesh mesh = make_puzzle(100 + round);
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        rules r;
        apply_rules(&r, &mesh);
        bool used[200] = {false};
        for (uint32_t c = 0; c < 3 * mesh.face_count; ++c) used[mesh.triangles[c]] = true;
        for (uint32_t v = 0; v < mesh.vertex_count; ++v)
            if (!used[v]) r.points[v] = FCT_NONE;
        for (uint32_t v = 0; v < mesh.vertex_count; ++v)
            assert_true((s->point_of[v] == FCT_NONE) == !used[v]);
        assert_same_partition(s->point_of, r.points, mesh.vertex_count);
        for (uint32_t v = 0; v < mesh.vertex_count; ++v)
            for (uint32_t w = 0; w < v; ++w)
                if (used[v] && used[w] && r.places[v] == r.places[w])
                    ++*(r.points[v] == r.points[w] ? &joined : &apart);
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
    assert_true(joined > 1000 && apart > 1000);
}

/* Two doubled triangles at one side: pairs of sides connect the copies to two bodies, which stay apart. */
static void doubled_triangles_at_one_side_stay_apart(void **state) {
    (void)state;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 12, 4, 0, &mesh), FCT_OK);
    const float places[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (uint32_t v = 0; v < 12; ++v) {
        uint32_t place = v % 3 < 2 ? v % 3 : v < 6 ? 2 : 3;
        memcpy(mesh.positions + 3 * v, places[place], 12);
        mesh.triangles[v] = v;
    }
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    rules r;
    apply_rules(&r, &mesh);
    assert_same_partition(s->point_of, r.points, 12);
    assert_int_equal(s->point_count, 6);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

/* --- A soup whose points are its places --- */

static void a_large_soup_finds_its_places(void **state) {
    (void)state;
    fct_mesh sphere = make_sphere(&env, 24), soup;
    uint32_t corners = 3 * sphere.face_count;
    assert_int_equal(fct_mesh_create(&env, corners, sphere.face_count, 0, &soup), FCT_OK);
    for (uint32_t c = 0; c < corners; ++c) {
        memcpy(soup.positions + 3 * c, sphere.positions + 3 * sphere.triangles[c], 12);
        soup.triangles[c] = c;
    }
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &soup, &def);
    assert_int_equal(s->point_count, sphere.vertex_count);
    assert_same_partition(s->point_of, sphere.triangles, corners);
    for (uint32_t c = 0; c < corners; ++c) {
        uint32_t source = point_at(s, s->point_of[c])->source;
        assert_true(source <= c && equal_floats(soup.positions + 3 * source, soup.positions + 3 * c, 3));
    }
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &soup);
    fct_mesh_release(&env, &sphere);
}

/* --- Wedges and classes --- */

static void wedges_are_distinct_attributes_at_points(void **state) {
    (void)state;
    const unsigned arrays[] = {FCT_MESH_COLORS, FCT_MESH_NORMALS, FCT_MESH_TEXCOORDS, ALL_ARRAYS};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; ++k) {
        fct_mesh mesh = make_sheet(&env, arrays[k], 41);
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        uint32_t corners = 3 * mesh.face_count, want[96], classes[96], got_classes[96];
        for (uint32_t c = 0; c < corners; ++c) {
            want[c] = classes[c] = c;
            uint32_t v = mesh.triangles[c];
            for (uint32_t d = c; d-- > 0;) {
                uint32_t w = mesh.triangles[d];
                if (s->point_of[v] != s->point_of[w]) continue;
                if (mesh.colors && !equal_floats(mesh.colors + 3 * v, mesh.colors + 3 * w, 3)) continue;
                if (mesh.normals && !equal_floats(mesh.normals + 3 * v, mesh.normals + 3 * w, 3)) continue;
                classes[c] = classes[d];
                if (mesh.texcoords && !equal_floats(mesh.texcoords + 2 * c, mesh.texcoords + 2 * d, 2))
                    continue;
                want[c] = want[d];
            }
            got_classes[c] = s->wedge_classes[s->corner_wedges[c]];
        }
        assert_same_partition(s->corner_wedges, want, corners);
        assert_same_partition(got_classes, classes, corners);
        for (uint32_t p = 0; p < s->point_count; ++p)
            for (uint32_t w = s->first_wedges[p]; w != FCT_NONE; w = s->next_wedges[w]) {
                uint32_t uses = 0;
                for (uint32_t c = 0; c < corners; ++c)
                    uses += s->corner_wedges[c] == w && s->triangles[c] == p;
                assert_int_equal(s->wedge_uses[w], uses);
                assert_true(uses > 0);
            }
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
}

/* --- Rings, edges, frame --- */

static void check_rings(const fct_simplifier *s) {
    uint32_t corners = 3 * s->mesh->face_count;
    bool *seen = calloc(corners + 1, 1);
    for (uint32_t p = 0; p < s->point_count; ++p) {
        uint32_t count = 0, last = FCT_NONE;
        for (uint32_t c = point_at(s, p)->first_corner; c != FCT_NONE; c = s->next_corners[c]) {
            assert_true(s->triangles[c] == p && !seen[c]);
            seen[c] = true, last = c, ++count;
        }
        assert_int_equal(count, point_at(s, p)->valence);
        if (count) assert_int_equal(last, point_at(s, p)->last_corner);
        assert_int_equal(s->point_parents[p], p);
    }
    uint32_t live = 0;
    for (uint32_t c = 0; c < corners; ++c) {
        assert_true(seen[c] == !corner_dead(s, c));
        live += seen[c];
    }
    assert_int_equal(live, 3 * s->live_faces);
    assert_int_equal(s->face_count, s->live_faces);
    free(seen);
}

static void check_edges(const fct_simplifier *s) {
    uint32_t corners = 3 * s->mesh->face_count, edges = 0;
    for (uint32_t c = 0; c < corners; ++c) {
        if (corner_dead(s, c)) continue;
        uint32_t a = s->triangles[c], b = s->triangles[c - c % 3 + (c + 1) % 3], first = c;
        for (uint32_t d = 0; d < corners; ++d) {
            if (corner_dead(s, d)) continue;
            uint32_t x = s->triangles[d], y = s->triangles[d - d % 3 + (d + 1) % 3];
            bool same = (x == a && y == b) || (x == b && y == a);
            assert_true(same == (s->side_edges[c] == s->side_edges[d]));
            if (same && d < first) first = d;
        }
        edges += first == c;
        const fct_edge *e = &s->edges[s->side_edges[c]];
        assert_true((e->ends[0] == a && e->ends[1] == b) || (e->ends[0] == b && e->ends[1] == a));
        assert_int_equal(e->parent, s->side_edges[c]);
    }
    assert_int_equal(s->edge_count, edges);
}

static void rings_and_edges_hold_every_live_corner(void **state) {
    (void)state;
    for (uint64_t round = 0; round < 60; ++round) {
        fct_mesh mesh = round < 50 ? make_puzzle(round) : make_sheet(&env, round % 2 ? ALL_ARRAYS : 0, round);
        fct_simplify_def def = fct_simplify_def_default();
        fct_simplifier *s = open_simplifier(&env, &mesh, &def);
        for (uint32_t f = 0; f < mesh.face_count; ++f) {
            uint32_t p[3];
            for (int k = 0; k < 3; ++k) p[k] = s->point_of[mesh.triangles[3 * f + (uint32_t)k]];
            bool degenerate = p[0] == p[1] || p[1] == p[2] || p[2] == p[0];
            assert_true(degenerate == corner_dead(s, 3 * f));
            for (int k = 0; k < 3 && !degenerate; ++k)
                assert_int_equal(s->triangles[3 * f + (uint32_t)k], p[k]);
        }
        check_rings(s);
        check_edges(s);
        fct_simplifier_destroy(s);
        fct_mesh_release(&env, &mesh);
    }
}

static void the_frame_is_that_of_used_vertices(void **state) {
    (void)state;
    fct_mesh mesh;
    assert_int_equal(fct_mesh_create(&env, 5, 1, 0, &mesh), FCT_OK);
    const float p[15] = {90, 0, 0, 1, 2, 3, 5, 2, 4, 1, 9, 3.5f, 0, -80, 0};
    const uint32_t t[3] = {1, 2, 3};
    memcpy(mesh.positions, p, sizeof p);
    memcpy(mesh.triangles, t, sizeof t);
    fct_simplify_def def = fct_simplify_def_default();
    fct_simplifier *s = open_simplifier(&env, &mesh, &def);
    assert_close(s->extent, 7, 0);
    assert_close(s->center.x, 3, 0);
    assert_close(s->center.y, 5.5, 0);
    assert_close(s->center.z, 3.5, 0);
    assert_close(point_position(s, s->point_of[1]).y, -.5, 1e-15);
    assert_close(point_position(s, s->point_of[2]).x, 2. / 7, 1e-15);
    fct_simplifier_destroy(s);
    mesh.triangles[0] = mesh.triangles[1] = mesh.triangles[2] = 0;
    s = open_simplifier(&env, &mesh, &def); /* one place: the extent is 1 */
    assert_close(s->extent, 1, 0);
    assert_int_equal(s->live_faces, 0);
    fct_simplifier_destroy(s);
    fct_mesh_release(&env, &mesh);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vertices_weld_by_the_rules),
        cmocka_unit_test(doubled_triangles_at_one_side_stay_apart),
        cmocka_unit_test(a_large_soup_finds_its_places),
        cmocka_unit_test(wedges_are_distinct_attributes_at_points),
        cmocka_unit_test(rings_and_edges_hold_every_live_corner),
        cmocka_unit_test(the_frame_is_that_of_used_vertices),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
