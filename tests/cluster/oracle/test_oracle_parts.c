/* The steps of a build in parts, against brute force: the parts that the curve cuts, the clusters that remain
 * of each part, and the sides of faces on the cut.
 */
#define _GNU_SOURCE
#include "oracle.h"
#include "parts.h"

#include <unistd.h>

#include "cluster/large/large.h"

/* A build after some of its steps. */
typedef struct steps {
    const char *name;
    const fct_mesh *mesh;
    fct_env env;
    fct_tree_def def;
    fct_large l;
    char path[64];
    uint32_t *part_of; /* per face */
    uint8_t *shared;   /* per vertex: faces of several parts use it */
} steps;

static void open_run(steps *r, const char *name, const fct_mesh *mesh, int option, uint32_t part_faces,
                     uint32_t top_limit) {
    *r = (steps){.name = name, .mesh = mesh, .env = single(), .def = def_of(option)};
    bool is_mean = r->def.cost == FCT_COST_MEAN; /* the defaults, which the oracle wants as numbers */
    r->def.fit_weight = is_mean ? 1e6 : 1e4, r->def.direction_weight = 1;
    r->def.shape_weight = is_mean ? 1 : 0.002;
    snprintf(r->path, sizeof r->path, "/tmp/facetree-steps-XXXXXX.ply");
    int file = mkstemps(r->path, 4);
    assert_true(file >= 0 && close(file) == 0);
    assert_int_equal(fct_mesh_save(&r->env, r->path, mesh, NULL), FCT_OK);
    r->l = (fct_large){.env = &r->env, .def = &r->def, .path = r->path, .part_faces = part_faces};
    r->l.budget = 1 << 28, r->l.top_limit = top_limit;
    assert_int_equal(fct_stream_open(&r->env, r->path, NULL, r->path, &r->l.stream), FCT_OK);
    r->l.info = fct_stream_get(r->l.stream);
    r->part_of = malloc(4 * (size_t)mesh->face_count);
    r->shared = calloc(mesh->vertex_count, 1);
    assert_int_equal(fct_large_cut(&r->l), FCT_OK);
}

static void close_run(steps *r) {
    fct_large *l = &r->l;
    fct_spool *spools[] = {&l->faces, &l->nodes, &l->costs, &l->face_ids, &l->triangles, &l->materials,
                           &l->tops,  &l->sums,  &l->means, &l->edges,    &l->sides};
    for (size_t i = 0; i < sizeof spools / sizeof *spools; ++i) fct_spool_close(spools[i]);
    fct_stream_close(l->stream);
    fct_release(l->env, l->shared), fct_release(l->env, l->runs), fct_release(l->env, l->parts);
    free(r->part_of), free(r->shared);
    unlink(r->path);
}

static void *read_spool(const fct_spool *spool, size_t count, size_t size) {
    void *data = malloc(count * size + 1);
    assert_int_equal(spool->size, count * size);
    assert_int_equal(fct_spool_read(spool, 0, data, count * size), FCT_OK);
    return data;
}

/* --- The cut --- */

/* Each face is in one part, in the order of the file within the part, as the file has it. */
static void check_faces(steps *r) {
    const fct_large *l = &r->l;
    size_t words = r->mesh->materials ? 5 : 4, read = 0;
    uint32_t *counts = calloc(l->part_count, 4), *last = calloc(l->part_count, 4);
    memset(r->part_of, 0xFF, 4 * (size_t)r->mesh->face_count);
    for (size_t i = 0; i < l->run_count; ++i) {
        const fct_face_run *run = &l->runs[i];
        uint32_t *rows = malloc(4 * words * run->count);
        assert_true(run->part < l->part_count && run->count > 0);
        assert_int_equal(fct_spool_read(&l->faces, run->offset, rows, 4 * words * run->count), FCT_OK);
        for (size_t k = 0; k < run->count; ++k) {
            const uint32_t *row = rows + words * k;
            uint32_t face = row[0];
            assert_true(face < r->mesh->face_count && r->part_of[face] == UINT32_MAX);
            assert_true(counts[run->part] == 0 || face > last[run->part]);
            assert_memory_equal(row + 1, r->mesh->triangles + 3 * (size_t)face, 12);
            if (words == 5) assert_int_equal(row[4], r->mesh->materials[face]);
            r->part_of[face] = run->part, last[run->part] = face;
            ++counts[run->part], ++read;
        }
        free(rows);
    }
    assert_int_equal(read, r->mesh->face_count);
    assert_int_equal(l->faces.size, 4 * words * read);
    for (size_t p = 0; p < l->part_count; ++p) {
        assert_int_equal(counts[p], l->parts[p].face_count);
        assert_true(counts[p] > 0 && counts[p] <= l->part_faces + l->part_faces / 4);
    }
    free(counts), free(last);
}

static void check_shared(steps *r) {
    uint32_t *first = malloc(4 * (size_t)r->mesh->vertex_count);
    memset(first, 0xFF, 4 * (size_t)r->mesh->vertex_count);
    for (size_t i = 0; i < 3 * (size_t)r->mesh->face_count; ++i) {
        uint32_t v = r->mesh->triangles[i], part = r->part_of[i / 3];
        if (first[v] == UINT32_MAX) first[v] = part;
        if (first[v] != part) r->shared[v] = 1;
    }
    for (uint32_t v = 0; v < r->mesh->vertex_count; ++v)
        assert_int_equal(r->l.shared[v / 32] >> v % 32 & 1, r->shared[v]);
    free(first);
}

static void check_bounds(const steps *r) {
    fct_bounds used = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}, all = used;
    for (size_t i = 0; i < 3 * (size_t)r->mesh->face_count; ++i)
        for (size_t k = 0; k < 3; ++k) {
            float x = r->mesh->positions[3 * (size_t)r->mesh->triangles[i] + k];
            used.lower[k] = fminf(used.lower[k], x), used.upper[k] = fmaxf(used.upper[k], x);
        }
    for (size_t i = 0; i < 3 * (size_t)r->mesh->vertex_count; ++i) {
        float x = r->mesh->positions[i];
        all.lower[i % 3] = fminf(all.lower[i % 3], x), all.upper[i % 3] = fmaxf(all.upper[i % 3], x);
    }
    assert_memory_equal(&r->l.bounds, &used, sizeof used);
    assert_memory_equal(&r->l.all_bounds, &all, sizeof all);
}

/* The number on the curve of a face's first vertex, in a cube from the lowest corner of all vertices. */
static uint32_t code_of(const steps *r, uint32_t face) {
    const fct_bounds *b = &r->l.all_bounds;
    double side = 0;
    uint32_t cell[3];
    for (int k = 0; k < 3; ++k) side = fmax(side, (double)b->upper[k] - (double)b->lower[k]);
    for (size_t k = 0; k < 3; ++k) {
        double x = (double)r->mesh->positions[3 * (size_t)r->mesh->triangles[3 * (size_t)face] + k];
        double at = side > 0 ? floor((x - (double)b->lower[k]) * (1024 / side)) : 0;
        cell[k] = (uint32_t)fmin(at, 1023);
    }
    return fct_curve_code(cell);
}

typedef struct stretch {
    uint32_t number, face;
} stretch;

static int compare_stretches(const void *p, const void *q) {
    const stretch *a = p, *b = q;
    return a->number != b->number ? (a->number > b->number) - (a->number < b->number)
                                  : (a->face > b->face) - (a->face < b->face);
}

/* A stretch is 2^10 cells. It belongs to the group in which its middle face lies if all groups have the same
 * number of faces. A group is one part, or several of the largest size and a last one. */
static void check_groups(const steps *r) {
    const fct_large *l = &r->l;
    uint32_t faces = r->mesh->face_count, most = l->part_faces + l->part_faces / 4;
    uint64_t groups = (faces + l->part_faces - 1) / l->part_faces, group;
    uint32_t *group_of = malloc(4 * (size_t)faces);
    stretch *list = malloc(faces * sizeof *list);
    for (uint32_t f = 0; f < faces; ++f) list[f] = (stretch){code_of(r, f) >> 10, f};
    qsort(list, faces, sizeof *list, compare_stretches);
    for (uint32_t i = 0, end; i < faces; i = end) {
        for (end = i; end < faces && list[end].number == list[i].number;) ++end;
        for (uint32_t k = i; k < end; ++k)
            group_of[list[k].face] = (uint32_t)((i + (end - i) / 2) * groups / faces);
    }
    uint32_t *sizes = calloc(groups, 4), *parts = malloc(4 * groups), next = 0;
    for (uint32_t f = 0; f < faces; ++f) { /* parts are numbered by their first faces */
        group = group_of[f];
        if (sizes[group] % most == 0) parts[group] = next++;
        ++sizes[group];
        if (r->part_of[f] != parts[group])
            fail_msg("%s: face %u of group %u is in part %u, not %u", r->name, f, (uint32_t)group,
                     r->part_of[f], parts[group]);
    }
    free(group_of), free(list), free(sizes), free(parts);
}

static void the_cut(void **state) {
    (void)state;
    for (int which = 0; which < PART_MESHES + 2; ++which) {
        fct_env env = single();
        const char *name = "one vertex";
        fct_mesh mesh = which < PART_MESHES ? make_part_mesh(&env, which, &name) : make_book(&env, 300);
        for (uint32_t parts = 3; parts < 200; parts *= 5) {
            steps r;
            open_run(&r, name, &mesh, 0, mesh.face_count / parts + 1, INT32_MAX);
            check_faces(&r);
            check_shared(&r);
            check_bounds(&r);
            check_groups(&r);
            close_run(&r);
        }
        fct_mesh_release(&env, &mesh);
    }
}

/* --- The clusters that remain --- */

/* A top and the direct sums over its faces, in the unit model. */
typedef struct cluster {
    fct_top top;
    uint32_t *faces;
    oracle_cluster sums;
    bool frozen; /* it has a face on the cut */
} cluster;

typedef struct remains {
    const steps *r;
    oracle o;
    cluster *clusters;
    uint32_t *cluster_of, *ids; /* per face; places of the parts */
    fct_cluster *nodes;
} remains;

static bool is_on_cut(const steps *r, uint32_t face) {
    const uint32_t *t = r->mesh->triangles + 3 * (size_t)face;
    for (int k = 0; k < 3; ++k) {
        uint32_t u = t[k], v = t[(k + 1) % 3];
        if (u != v && r->shared[u] && r->shared[v]) return true;
    }
    return false;
}

static uint8_t height_of(const remains *m, const fct_part *part, uint32_t node) {
    if (node >= part->node_count) return 0;
    const uint32_t *child = m->nodes[part->first_node + node].child;
    uint8_t a = height_of(m, part, child[0]), b = height_of(m, part, child[1]);
    return (uint8_t)(1 + (a > b ? a : b));
}

static remains open_remains(const steps *r) {
    const fct_large *l = &r->l;
    remains m = {.r = r, .o = oracle_create(r->mesh, &r->def)};
    fct_top *tops = read_spool(&l->tops, l->top_count, sizeof *tops);
    m.ids = read_spool(&l->face_ids, r->mesh->face_count, 4);
    m.nodes = read_spool(&l->nodes, l->nodes.size / sizeof *m.nodes, sizeof *m.nodes);
    m.clusters = calloc(l->top_count, sizeof *m.clusters);
    m.cluster_of = malloc(4 * (size_t)r->mesh->face_count);
    memset(m.cluster_of, 0xFF, 4 * (size_t)r->mesh->face_count);
    for (uint32_t i = 0; i < l->top_count; ++i) {
        cluster *c = &m.clusters[i];
        c->top = tops[i];
        assert_true(c->top.part < l->part_count);
        const fct_part *part = &l->parts[c->top.part];
        assert_true(i >= part->first_top && i < part->first_top + part->top_count);
        c->faces = m.ids + part->first_face + c->top.first;
        for (uint32_t k = 0; k < c->top.count; ++k) {
            uint32_t face = c->faces[k];
            assert_true(m.cluster_of[face] == UINT32_MAX && r->part_of[face] == c->top.part);
            m.cluster_of[face] = i;
            c->frozen |= is_on_cut(r, face);
        }
        c->sums = oracle_measure(&m.o, c->faces, c->top.count);
    }
    for (uint32_t f = 0; f < r->mesh->face_count; ++f) assert_true(m.cluster_of[f] != UINT32_MAX);
    free(tops);
    return m;
}

static void close_remains(remains *m) {
    oracle_destroy(&m->o);
    free(m->clusters), free(m->cluster_of), free(m->ids), free(m->nodes);
}

static void expect(const remains *m, uint32_t number, const char *what, double found, double wanted,
                   double slack) {
    if (!(fabs(found - wanted) <= slack))
        fail_msg("%s: top %u of %u faces: %s is %.9g, should be %.9g (slack %.3g)", m->r->name, number,
                 m->clusters[number].top.count, what, found, wanted, slack);
}

/* Box and record of a top. The border at edges of three or more faces differs inside a part: seam.c corrects
 * it. */
static void check_record(const remains *m, uint32_t number) {
    const cluster *c = &m->clusters[number];
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < 9 * c->top.count; ++i) {
        double x = m->o.faces[c->faces[i / 9]].corner[i / 3 % 3][i % 3];
        low[i % 3] = fmin(low[i % 3], x), high[i % 3] = fmax(high[i % 3], x);
    }
    for (int k = 0; k < 3; ++k) {
        expect(m, number, "lower corner", (double)c->top.lower[k], low[k], 1e-7);
        expect(m, number, "upper corner", (double)c->top.upper[k], high[k], 1e-7);
        expect(m, number, "area vector", (double)c->top.record.vector[k], c->sums.vector[k],
               3e-6 * c->sums.area + 1e-15);
    }
    expect(m, number, "area", (double)c->top.record.area, c->sums.area, 3e-6 * c->sums.area + 1e-15);
    assert_int_equal(c->top.record.count, c->top.count);
}

static void check_place(const remains *m, uint32_t number) {
    const cluster *c = &m->clusters[number];
    const fct_part *part = &m->r->l.parts[c->top.part];
    const uint32_t *materials = m->r->mesh->materials;
    bool leaf = c->top.count == 1, mixed = !materials;
    for (uint32_t k = 1; k < c->top.count && materials; ++k)
        mixed |= materials[c->faces[k]] != materials[*c->faces];
    assert_int_equal(c->top.material, mixed ? FCT_NONE : materials[*c->faces]);
    assert_int_equal(c->top.height, height_of(m, part, c->top.node));
    if (leaf) {
        assert_true(c->top.node == part->node_count + c->top.first && c->top.cost == 0);
        return;
    }
    const fct_cluster *node = &m->nodes[part->first_node + c->top.node];
    assert_true(node->first == c->top.first && node->count == c->top.count && node->cost == c->top.cost);
    if (m->r->l.top_limit == INT32_MAX) assert_int_equal(c->top.phase, mixed ? 1 : 0);
}

/* The cheapest partner of a cluster in its part, with a lower bound of its price. UINT32_MAX: it has none. */
static uint32_t find_partner(const remains *m, uint32_t number, oracle_price *least) {
    const cluster *c = &m->clusters[number];
    uint32_t best = UINT32_MAX;
    *least = (oracle_price){INFINITY, 0};
    for (uint32_t l = 0; l < m->o.link_count; ++l) {
        uint32_t a = m->cluster_of[m->o.links[l].a], b = m->cluster_of[m->o.links[l].b];
        uint32_t other = a == number ? b : b == number ? a : number;
        if (other == number || m->clusters[other].top.part != c->top.part) continue;
        const cluster *d = &m->clusters[other];
        oracle_price price =
            oracle_merge_price(&m->o, &c->sums, c->faces, c->top.count, &d->sums, d->faces, d->top.count);
        if (price.cost < least->cost) *least = price, best = other;
    }
    return best;
}

/* Faces on the cut stay alone. Two other clusters that prefer each other have merged, except that a cluster
 * which waits for a face on the cut goes on to wait when a neighbour becomes cheaper. */
static void check_waiting(const remains *m) {
    uint32_t pairs = 0, count = m->r->l.top_count, *partners = malloc(4 * (size_t)count);
    for (uint32_t i = 0; i < count; ++i) {
        const cluster *c = &m->clusters[i];
        oracle_price least;
        partners[i] = find_partner(m, i, &least);
        if (c->frozen) assert_int_equal(c->top.count, 1);
    }
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t other = partners[i];
        if (other == UINT32_MAX || m->clusters[i].frozen || m->clusters[other].frozen) continue;
        pairs += partners[other] == i;
    }
    if (pairs > count / 50) fail_msg("%s: %u of %u tops prefer each other", m->r->name, pairs, count);
    free(partners);
}

/* The spool has each side of which both ends are shared, once. */
static void check_sides(const remains *m) {
    const steps *r = m->r;
    size_t count = r->l.sides.size / sizeof(fct_seam_side), at = 0;
    fct_seam_side *sides = read_spool(&r->l.sides, count, sizeof *sides);
    for (size_t p = 0; p < r->l.part_count; ++p)
        for (uint32_t f = 0; f < r->mesh->face_count; ++f)
            for (int k = 0; k < 3 && r->part_of[f] == p; ++k) {
                const uint32_t *t = r->mesh->triangles + 3 * (size_t)f;
                uint32_t u = t[k], v = t[(k + 1) % 3];
                if (u == v || !r->shared[u] || !r->shared[v]) continue;
                assert_true(at < count);
                const fct_seam_side *s = &sides[at++];
                double from[3], to[3];
                for (int i = 0; i < 3; ++i) {
                    from[i] = (double)r->mesh->positions[3 * (size_t)u + (size_t)i];
                    to[i] = (double)r->mesh->positions[3 * (size_t)v + (size_t)i];
                }
                assert_true(s->low == (u < v ? u : v) && s->high == (u < v ? v : u));
                assert_true(s->face == f && s->part == p && s->top == m->cluster_of[f]);
                assert_true(fabs((double)s->length - oracle_distance(from, to)) <=
                            1e-7 * oracle_distance(from, to));
            }
    assert_int_equal(at, count);
    free(sides);
}

static void what_remains(void **state) {
    (void)state;
    for (int which = 0; which < PART_MESHES; ++which) {
        fct_env env = single();
        const char *name;
        fct_mesh mesh = make_part_mesh(&env, which, &name);
        int option = part_options[which] | 1; /* greedy */
        steps r;
        open_run(&r, name, &mesh, option, mesh.face_count / 6, INT32_MAX);
        check_faces(&r);
        check_shared(&r);
        assert_int_equal(fct_large_pieces(&r.l), FCT_OK);
        remains m = open_remains(&r);
        for (uint32_t i = 0; i < r.l.top_count; ++i) check_record(&m, i), check_place(&m, i);
        if (!mesh.materials && !(option & 2) && which != 6) check_waiting(&m); /* the box is full of ties */
        check_sides(&m);
        close_remains(&m);
        close_run(&r);
        fct_mesh_release(&env, &mesh);
    }
}

/* A part leaves no more clusters than its share of the limit. */
static void a_limit_of_clusters(void **state) {
    (void)state;
    for (int which = 0; which < PART_MESHES; ++which) {
        fct_env env = single();
        const char *name;
        fct_mesh mesh = make_part_mesh(&env, which, &name);
        for (uint32_t limit = 600; limit > 0; limit /= 20) {
            steps r;
            open_run(&r, name, &mesh, part_options[which], mesh.face_count / 6, limit);
            check_faces(&r);
            check_shared(&r);
            assert_int_equal(fct_large_pieces(&r.l), FCT_OK);
            for (size_t p = 0; p < r.l.part_count; ++p) {
                const fct_part *part = &r.l.parts[p];
                assert_true(part->top_count <= (uint64_t)limit * part->face_count / mesh.face_count + 16);
            }
            remains m = open_remains(&r);
            for (uint32_t i = 0; i < r.l.top_count; ++i) check_record(&m, i);
            close_remains(&m);
            close_run(&r);
        }
        fct_mesh_release(&env, &mesh);
    }
}

/* A terrain with as many loose triangles above it. Where it suffices to join these, the faces on the cut
 * wait. */
static void loose_clusters_are_joined_first(void **state) {
    (void)state;
    fct_env env = single();
    fct_mesh terrain = make_terrain(&env, 20, 0.1, 5);
    uint32_t faces = terrain.face_count, vertices = terrain.vertex_count, random = 3, joined = 0, waiting = 0;
    fct_mesh mesh = shape_of(&env, vertices + 3 * faces, 2 * faces);
    memcpy(mesh.positions, terrain.positions, 12 * (size_t)vertices);
    memcpy(mesh.triangles, terrain.triangles, 12 * (size_t)faces);
    for (uint32_t f = 0; f < faces; ++f) {
        double x = shape_random(&random), y = shape_random(&random);
        for (uint32_t k = 0; k < 3; ++k)
            set_vertex(&mesh, vertices + 3 * f + k, x + 0.01 * shape_random(&random), y + 0.01 * k,
                       0.02 * shape_random(&random));
        set_face(&mesh, faces + f, vertices + 3 * f, vertices + 3 * f + 1, vertices + 3 * f + 2);
    }
    steps r;
    open_run(&r, "terrain under triangles", &mesh, 1, mesh.face_count / 6, 3 * mesh.face_count / 4);
    check_faces(&r);
    check_shared(&r);
    assert_int_equal(fct_large_pieces(&r.l), FCT_OK);
    remains m = open_remains(&r);
    for (uint32_t i = 0; i < r.l.top_count; ++i) {
        const cluster *c = &m.clusters[i];
        joined += c->top.phase == 2, waiting += c->frozen;
        if (c->frozen) assert_int_equal(c->top.count, 1);
    }
    assert_true(joined > 0 && waiting > 100);
    close_remains(&m);
    close_run(&r);
    fct_mesh_release(&env, &mesh);
    fct_mesh_release(&env, &terrain);
}

/* Two neighbours of 2048 faces and height 33. Their union is higher than 2 log2 n + 8 but not than 3 log2 n -
 * 1, so they merge along their edge. With height 35 they are joined by proximity. */
static void tall_tops_use_the_reserve(void **state) {
    (void)state;
    for (uint8_t height = 33; height <= 35; height += 2) {
        fct_env env = single();
        fct_tree_def def = def_of(1);
        fct_large l = {.env = &env, .def = &def, .path = "/tmp/tree.fct", .top_count = 2};
        fct_top tops[2];
        fct_top_edge edge = {0, 1, 0.1f};
        l.info.face_count = 4096;
        l.bounds = (fct_bounds){{0, 0, 0}, {1, 1, 1}};
        for (uint32_t i = 0; i < 2; ++i) {
            fct_record record = {.count = 2048, .area = 1, .vector = {0, 0, 1}, .perimeter = 4};
            tops[i] = (fct_top){.part = i,
                                .count = 2048,
                                .material = FCT_NONE,
                                .phase = 1,
                                .height = height,
                                .upper = {1, 1, 1},
                                .record = record};
        }
        assert_int_equal(fct_spool_open(&env, "/tmp", l.path, &l.tops), FCT_OK);
        assert_int_equal(fct_spool_open(&env, "/tmp", l.path, &l.edges), FCT_OK);
        assert_int_equal(fct_spool_append(&l.tops, tops, sizeof tops), FCT_OK);
        assert_int_equal(fct_spool_append(&l.edges, &edge, sizeof edge), FCT_OK);
        assert_int_equal(fct_large_contract(&l), FCT_OK);
        assert_true(l.upper_count == 1 && l.component_count == 1);
        assert_int_equal(l.upper_phase_counts[1], height == 33);
        assert_int_equal(l.upper_phase_counts[2], height == 35);
        fct_spool_close(&l.tops), fct_spool_close(&l.edges);
        fct_release(&env, l.all_tops), fct_release(&env, l.upper);
        fct_release(&env, l.top_order), fct_release(&env, l.top_places);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_cut), cmocka_unit_test(what_remains), cmocka_unit_test(a_limit_of_clusters),
        cmocka_unit_test(loose_clusters_are_joined_first), cmocka_unit_test(tall_tops_use_the_reserve)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
