/* What a tree is cut into, for any mesh that the bytes describe. FUZZ_PART selects the promises of
 * partition.h that this program checks, by plain code. */
#include <float.h>

#include "base/math/vec.h"
#include "facetree/dual.h"
#include "facetree/partition.h"
#include "fuzz/fuzz_bytes.h"

enum { CUT, CHARTS, MESHLETS, REFINE };

typedef struct subject {
    const fct_env *env;
    const fct_mesh *mesh;
    const fct_tree *tree;
    fct_tree_view view;
    const uint32_t *corners; /* of the mesh, with the vertices that connect faces in the tree */
} subject;

static v3 area_vector(const fct_mesh *mesh, uint32_t f) {
    v3 p[3];
    for (int k = 0; k < 3; ++k)
        p[k] = v3_load(mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)f + (size_t)k]);
    return v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5);
}

static double longest_side(const fct_mesh *mesh, uint32_t f) {
    double longest = 0;
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t *t = mesh->triangles + 3 * (size_t)f;
        v3 a = v3_load(mesh->positions + 3 * (size_t)t[k]),
           b = v3_load(mesh->positions + 3 * (size_t)t[(k + 1) % 3]);
        longest = fmax(longest, v3_norm(v3_sub(a, b)));
    }
    return longest;
}

static void *allocate(const subject *s, size_t count, size_t size) {
    void *memory = fct_allocate_zero(s->env, count ? count : 1, size);
    fuzz_require(memory != NULL, "memory");
    return memory;
}

/* --- Sides of faces, sorted --- */

typedef struct side {
    uint32_t label, low, high, face;
} side;

static int compare_sides(const void *a, const void *b) {
    const side *p = a, *q = b;
    if (p->label != q->label) return p->label < q->label ? -1 : 1;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return p->face < q->face ? -1 : p->face > q->face;
}

static bool same_edge(const side *a, const side *b) {
    return a->label == b->label && a->low == b->low && a->high == b->high;
}

static uint32_t find_root(uint32_t *parents, uint32_t i) {
    while (parents[i] != i) i = parents[i] = parents[parents[i]];
    return i;
}

/* Topology of the faces of one label. */
typedef struct topology {
    uint32_t faces, vertices, edges, pieces, border;
    bool crowded, repeated; /* an edge of three faces; a face that uses a vertex twice */
} topology;

static void count_vertices(const subject *s, const uint32_t *labels, topology *all) {
    size_t corners = 3 * (size_t)s->view.face_count;
    side *list = allocate(s, corners, sizeof *list);
    for (size_t c = 0; c < corners; ++c) list[c] = (side){labels[c / 3], s->corners[c], 0, 0};
    qsort(list, corners, sizeof *list, compare_sides);
    for (size_t c = 0; c < corners; ++c)
        all[list[c].label].vertices += c == 0 || !same_edge(list + c - 1, list + c);
    fct_release(s->env, list);
}

static topology *look_at(const subject *s, const uint32_t *labels, uint32_t count) {
    size_t corners = 3 * (size_t)s->view.face_count;
    topology *all = allocate(s, count, sizeof *all);
    side *list = allocate(s, corners, sizeof *list);
    uint32_t *parents = allocate(s, s->view.face_count, sizeof *parents);
    count_vertices(s, labels, all);
    for (uint32_t f = 0; f < s->view.face_count; ++f) {
        const uint32_t *t = s->corners + 3 * (size_t)f;
        parents[f] = f, ++all[labels[f]].faces, ++all[labels[f]].pieces;
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) all[labels[f]].repeated = true;
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t a = t[k], b = t[(k + 1) % 3];
            list[3 * (size_t)f + k] = (side){labels[f], a < b ? a : b, a < b ? b : a, f};
        }
    }
    qsort(list, corners, sizeof *list, compare_sides);
    for (size_t i = 0, end; i < corners; i = end) {
        topology *t = all + list[i].label;
        for (end = i + 1; end < corners && same_edge(list + i, list + end); ++end) {
            uint32_t a = find_root(parents, list[i].face), b = find_root(parents, list[end].face);
            if (a != b && list[i].low != list[i].high) parents[a] = b, --t->pieces;
        }
        ++t->edges, t->border += end - i == 1, t->crowded = t->crowded || end - i > 2;
    }
    fct_release(s->env, list);
    fct_release(s->env, parents);
    return all;
}

/* --- Cuts, their labels, quality and neighbours --- */

static double distance_of(const subject *s, const fct_cluster *c) {
    double largest = 0;
    for (size_t i = 3 * (size_t)c->first; i < 3 * ((size_t)c->first + c->count); ++i) {
        v3 p = v3_load(s->view.positions + 3 * (size_t)s->view.triangles[i]);
        largest = fmax(largest, fabs(v3_dot(v3_load(c->plane), p) + (double)c->plane[3]));
    }
    return largest;
}

/* The nodes have the places in order, each once. */
static void check_cut(const subject *s, const uint32_t *nodes, uint32_t count) {
    uint32_t places = 0;
    fuzz_require(count >= s->view.root_count && count <= s->view.face_count, "the number of clusters");
    for (uint32_t i = 0; i < count; ++i) {
        fct_cluster c;
        fuzz_require(fct_tree_cluster(s->tree, nodes[i], &c) == FCT_OK, "a node of the tree");
        fuzz_require(c.first == places && c.count > 0, "clusters follow one another");
        places += c.count;
    }
    fuzz_require(places == s->view.face_count, "a cut has each face once");
}

/* Walks down from the roots: a cluster of the cut is within the limit, and no node above one is. */
static void check_distances(const subject *s, double limit, const uint32_t *nodes, uint32_t count,
                            double largest) {
    uint32_t *stack = allocate(s, (size_t)s->view.face_count + 1, sizeof *stack), height = 0, at = 0;
    double widest = 0;
    for (uint32_t r = s->view.root_count; r-- > 0;) stack[height++] = s->view.roots[r];
    while (height > 0) {
        fct_cluster c;
        uint32_t node = stack[--height];
        fuzz_require(fct_tree_cluster(s->tree, node, &c) == FCT_OK, "a node of the tree");
        double distance = distance_of(s, &c);
        if (c.count > 1 && !(distance <= limit)) {
            stack[height++] = c.child[1], stack[height++] = c.child[0];
            continue;
        }
        fuzz_require(at < count && nodes[at++] == node, "the coarsest cut within the distance");
        widest = fmax(widest, distance);
    }
    fuzz_require(at == count && widest == largest, "the largest distance");
    fct_release(s->env, stack);
}

static void check_quality(const fct_partition_quality *q) {
    const double values[5] = {q->mean_fit, q->mean_direction, q->mean_irregularity, q->mean_normal_deviation,
                              q->box_area};
    for (int i = 0; i < 5; ++i) fuzz_require(isfinite(values[i]) && values[i] >= 0, "the quality of a cut");
}

static void check_neighbours(const subject *s, const uint32_t *labels, uint32_t count) {
    fct_adjacency a;
    fuzz_require(fct_labels_adjacency(s->env, s->mesh, labels, count, &a) == FCT_OK, "neighbours");
    fuzz_require(a.label_count == count && a.first[0] == 0 && a.first[count] == 2 * a.pair_count,
                 "each pair twice");
    for (uint32_t i = 0; i < a.pair_count; ++i) {
        const uint32_t *p = a.pairs + 2 * (size_t)i;
        fuzz_require(p[0] < p[1] && p[1] < count, "a pair of labels");
        fuzz_require(i == 0 || p[-2] < p[0] || (p[-2] == p[0] && p[-1] < p[1]), "pairs are sorted");
        fuzz_require(a.edges[i] > 0 && a.lengths[i] >= 0 && isfinite(a.lengths[i]), "a shared border");
    }
    for (uint32_t l = 0; l < count; ++l)
        for (uint32_t i = a.first[l]; i < a.first[l + 1]; ++i) {
            const uint32_t *p = a.pairs + 2 * (size_t)a.other_pairs[i];
            fuzz_require((p[0] == l && p[1] == a.others[i]) || (p[1] == l && p[0] == a.others[i]),
                         "both sides of a pair");
        }
    fct_adjacency_release(s->env, &a);
}

static void use_cut(const subject *s, fuzz_bytes *b) {
    fct_bounds bounds = s->view.bounds;
    double size = 0, limit = fuzz_real(b), largest;
    for (int k = 0; k < 3; ++k) size = fmax(size, (double)bounds.upper[k] - (double)bounds.lower[k]);
    if (fuzz_flag(b)) limit = fuzz_share(b) * size * .2;
    uint32_t count, k = fuzz_below(b, s->view.face_count + 2), faces = s->view.face_count;
    uint32_t *nodes = allocate(s, faces, sizeof *nodes), *labels = allocate(s, faces, sizeof *labels);
    fct_result result = fct_tree_cut_at_distance(s->env, s->tree, limit, nodes, &count, &largest);
    fuzz_require(result == (limit >= 0 ? FCT_OK : FCT_ERROR_DATA), "a distance of at least 0 has a cut");
    if (result == FCT_OK) {
        check_cut(s, nodes, count);
        check_distances(s, limit, nodes, count, largest);
    }
    fuzz_require(fct_tree_partition(s->env, s->tree, k, nodes, &count) == FCT_OK, "a partition");
    check_cut(s, nodes, count);
    fuzz_require(k < s->view.root_count || k > faces || count == k, "as many clusters as wanted");
    fuzz_require(fct_tree_count_at_cost(s->tree, limit) <= faces, "there are no more than all");
    fuzz_require(fct_tree_labels(s->env, s->tree, nodes, count, labels) == FCT_OK, "labels");
    for (uint32_t p = 0; p < faces; ++p) {
        fct_cluster c;
        uint32_t label = labels[s->view.face_ids[p]];
        fuzz_require(label < count && fct_tree_cluster(s->tree, nodes[label], &c) == FCT_OK, "a label");
        fuzz_require(p - c.first < c.count, "a label is the cluster of its face");
    }
    fct_partition_quality quality;
    float *planes = allocate(s, count, 4 * sizeof *planes);
    fuzz_require(fct_tree_quality(s->env, s->tree, nodes, count, &quality) == FCT_OK, "quality of a cut");
    check_quality(&quality);
    fuzz_require(fct_labels_quality(s->env, s->mesh, labels, count, &quality) == FCT_OK, "and of labels");
    check_quality(&quality);
    fuzz_require(fct_labels_planes(s->env, s->mesh, labels, count, planes) == FCT_OK, "planes");
    fuzz_require(fuzz_all_finite(planes, 4 * (size_t)count), "planes are finite");
    check_neighbours(s, labels, count);
    fct_release(s->env, planes);
    fct_release(s->env, labels);
    fct_release(s->env, nodes);
}

/* --- Charts --- */

/* The normals of a chart of several faces lie within the angle, unless they cancel. */
static void check_angles(const subject *s, const uint32_t *labels, const topology *all, uint32_t count,
                         double max_angle) {
    double(*sums)[4] = allocate(s, count, sizeof *sums);
    for (uint32_t f = 0; f < s->view.face_count; ++f) {
        v3 n = area_vector(s->mesh, f);
        double *sum = sums[labels[f]];
        sum[0] += n.x, sum[1] += n.y, sum[2] += n.z, sum[3] += v3_norm(n);
    }
    for (uint32_t f = 0; f < s->view.face_count; ++f) {
        const double *sum = sums[labels[f]];
        v3 n = area_vector(s->mesh, f), whole = {sum[0], sum[1], sum[2]}, u = v3_unit(n), v = v3_unit(whole);
        double longest = longest_side(s->mesh, f);
        if (all[labels[f]].faces < 2 || v3_norm(n) <= 1e-8 * longest * longest ||
            v3_norm(whole) <= 1e-6 * sum[3])
            continue;
        double angle = atan2(v3_norm(v3_cross(u, v)), v3_dot(u, v));
        fuzz_require(angle <= max_angle + 1e-6, "the normals of a chart lie within the angle");
    }
    fct_release(s->env, sums);
}

static void check_charts(const subject *s, const uint32_t *labels, const fct_chart_def *def,
                         const fct_chart_stats *stats) {
    uint32_t next = 0, largest = 0, others = 0, faces = s->view.face_count;
    for (uint32_t p = 0; p < faces; ++p) {
        uint32_t label = labels[s->view.face_ids[p]];
        fuzz_require(label <= next && label < stats->charts, "charts are numbered by their first place");
        next += label == next;
    }
    fuzz_require(next == stats->charts, "no chart is empty");
    topology *all = look_at(s, labels, stats->charts);
    double *areas = allocate(s, stats->charts, sizeof *areas);
    uint32_t *materials = allocate(s, stats->charts, sizeof *materials);
    for (uint32_t f = 0; f < faces; ++f) {
        uint32_t own = s->mesh->materials ? s->mesh->materials[f] + 1 : 1;
        fuzz_require(!materials[labels[f]] || materials[labels[f]] == own, "one material per chart");
        materials[labels[f]] = own, areas[labels[f]] += v3_norm(area_vector(s->mesh, f));
    }
    for (uint32_t i = 0; i < stats->charts; ++i) {
        const topology *t = all + i;
        bool disk = !t->repeated && !t->crowded && t->pieces == 1 && t->border > 0 &&
                    t->vertices + t->faces == t->edges + 1;
        largest = t->faces > largest ? t->faces : largest, others += !disk;
        fuzz_require(t->faces <= def->max_faces || t->faces == 1, "faces per chart");
        fuzz_require(t->faces == 1 || areas[i] <= def->max_area * (1 + 1e-6), "area per chart");
        fuzz_require(disk || def->any_topology || (t->faces == 1 && t->repeated), "charts are disks");
    }
    fuzz_require(largest == stats->largest_faces, "the largest chart");
    fuzz_require(def->any_topology || others == stats->non_disks, "the charts that are no disks");
    fuzz_require(!def->keep_cuts || stats->merged == 0, "clusters are kept");
    fuzz_require(isfinite(stats->seam_length) && isfinite(stats->boundary_length) &&
                     stats->largest_angle >= 0 && stats->largest_angle < 3.2,
                 "figures of charts");
    check_angles(s, labels, all, stats->charts, def->max_angle);
    fct_release(s->env, materials);
    fct_release(s->env, areas);
    fct_release(s->env, all);
}

static void use_charts(const subject *s, fuzz_bytes *b) {
    fct_chart_def def = fct_chart_def_default();
    fct_chart_stats stats;
    uint32_t options = fuzz_byte(b), *labels = allocate(s, s->view.face_count, sizeof *labels);
    if (options & 1) def.max_angle = 4 * fuzz_share(b);
    if (options & 2) def.max_faces = fuzz_below(b, 16);
    if (options & 4) def.max_area = fuzz_real(b);
    def.any_topology = options & 8, def.keep_cuts = options & 16;
    bool valid = def.max_faces > 0 && def.max_area >= 0;
    fct_result result = fct_tree_charts(s->env, s->tree, &def, labels, &stats);
    fuzz_require(result == (valid ? FCT_OK : FCT_ERROR_DATA), "options in range give charts");
    if (result == FCT_OK) check_charts(s, labels, &def, &stats);
    fct_release(s->env, labels);
}

/* --- Meshlets --- */

static bool same_place(const fct_mesh *mesh, uint32_t a, uint32_t b) {
    const float *p = mesh->positions + 3 * (size_t)a, *q = mesh->positions + 3 * (size_t)b;
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

static void check_meshlet(const subject *s, const fct_meshlets *m, uint32_t i, bool *seen) {
    const fct_meshlet *x = m->meshlets + i;
    const uint32_t *vertices = m->vertices + x->vertex_offset, *faces = m->faces + m->first_face[i];
    const uint8_t *local = m->triangles + x->triangle_offset;
    for (uint32_t v = 0; v < x->vertex_count; ++v) {
        fuzz_require(vertices[v] < s->mesh->vertex_count, "a vertex of the input");
        for (uint32_t w = 0; w < v; ++w)
            fuzz_require(vertices[v] != vertices[w], "a meshlet lists each vertex once");
    }
    for (uint32_t t = 0; t < x->triangle_count; ++t) {
        fuzz_require(faces[t] < s->view.face_count && !seen[faces[t]], "each face is in one meshlet");
        seen[faces[t]] = true;
        const uint32_t *materials = s->mesh->materials;
        fuzz_require(!materials || materials[faces[t]] == materials[faces[0]], "one material per meshlet");
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t corner = s->mesh->triangles[3 * (size_t)faces[t] + k];
            fuzz_require(local[3 * t + k] < x->vertex_count, "an index below the number of vertices");
            uint32_t v = vertices[local[3 * t + k]];
            fuzz_require(v == corner || (s->view.def.weld && same_place(s->mesh, v, corner)),
                         "the corners of the input");
        }
    }
}

/* In floats, as in a shader, for distances whose squares are floats. */
static bool is_culled(const fct_meshlet_bounds *b, const float eye[3]) {
    float d[3], squared = 0, dot = 0;
    for (int k = 0; k < 3; ++k) d[k] = b->cone_apex[k] - eye[k], squared += d[k] * d[k];
    if (!(squared >= FLT_MIN && squared <= FLT_MAX)) return false;
    float length = sqrtf(squared);
    for (int k = 0; k < 3; ++k) dot += d[k] / length * b->cone_axis[k];
    return dot >= b->cone_cutoff;
}

static void check_bounds(const subject *s, const fct_meshlets *m, uint32_t i, const float direction[3]) {
    const fct_meshlet *x = m->meshlets + i;
    const fct_meshlet_bounds *b = m->bounds + i;
    float eye[3];
    for (int k = 0; k < 3; ++k) eye[k] = b->center[k] + direction[k] * b->radius;
    bool culled = is_culled(b, eye);
    for (uint32_t v = 0; v < x->vertex_count; ++v) {
        const float *q = s->mesh->positions + 3 * (size_t)m->vertices[x->vertex_offset + v];
        v3 p = v3_load(q);
        fuzz_require(v3_norm(v3_sub(p, v3_load(b->center))) <= (double)b->radius || b->radius == FLT_MAX,
                     "the sphere holds");
        for (int k = 0; k < 3; ++k) {
            double along = v3_dot(v3_sub(p, v3_load(b->box.center)), v3_load(b->box.axes[k]));
            fuzz_require(fabs(along) <= (double)b->box.half[k] || b->box.half[k] == FLT_MAX,
                         "the oriented box holds");
            fuzz_require(q[k] >= b->bounds.lower[k] && q[k] <= b->bounds.upper[k], "the box holds");
        }
    }
    for (uint32_t t = 0; culled && t < x->triangle_count; ++t) {
        uint32_t face = m->faces[m->first_face[i] + t];
        v3 corner = v3_load(s->mesh->positions + 3 * (size_t)s->mesh->triangles[3 * (size_t)face]);
        fuzz_require(v3_dot(area_vector(s->mesh, face), v3_sub(v3_load(eye), corner)) <= 0,
                     "a culled triangle faces away");
    }
}

static void check_meshlets(const subject *s, const fct_meshlet_def *def, const fct_meshlets *m,
                           const float direction[3]) {
    uint32_t vertices = 0, bytes = 0;
    bool *seen = allocate(s, s->view.face_count, sizeof *seen);
    fuzz_require(m->first_face[0] == 0 && m->first_face[m->count] == s->view.face_count, "all faces");
    for (uint32_t i = 0; i < m->count; ++i) {
        const fct_meshlet *x = m->meshlets + i;
        fuzz_require(x->vertex_count >= 1 && x->vertex_count <= def->max_vertices, "vertices per meshlet");
        fuzz_require(x->triangle_count >= 1 && x->triangle_count <= def->max_triangles, "and triangles");
        fuzz_require(x->vertex_offset == vertices && x->triangle_offset == bytes, "no gaps");
        fuzz_require(m->first_face[i + 1] - m->first_face[i] == x->triangle_count, "a range of faces");
        vertices += x->vertex_count, bytes += (3 * x->triangle_count + 3) / 4 * 4;
        check_meshlet(s, m, i, seen);
        check_bounds(s, m, i, direction);
    }
    fuzz_require(vertices == m->vertex_count && bytes == m->triangle_bytes, "lengths of the arrays");
    fct_release(s->env, seen);
}

static void use_meshlets(const subject *s, fuzz_bytes *b) {
    fct_meshlet_def def = fct_meshlet_def_default();
    fct_meshlets m;
    uint32_t options = fuzz_byte(b);
    if (options & 1) def.max_vertices = 2 + fuzz_below(b, 256);
    if (options & 2) def.max_triangles = fuzz_below(b, 514);
    if (options & 4) def.flatness = fuzz_real(b);
    float direction[3] = {fuzz_real(b), fuzz_real(b), fuzz_real(b)};
    bool valid = def.max_vertices >= 3 && def.max_vertices <= 256 && def.max_triangles >= 1 &&
                 def.max_triangles <= 512 && def.flatness >= 0 && def.flatness <= 1e6;
    fct_result result = fct_tree_meshlets(s->env, s->tree, &def, &m);
    fuzz_require(result == (valid ? FCT_OK : FCT_ERROR_DATA), "options in range give meshlets");
    if (result == FCT_OK) check_meshlets(s, &def, &m, direction);
    fct_meshlets_release(s->env, &m);
}

/* --- Refinement --- */

/* Per label, the pieces that the dual graph connects, and 0 if no face has the label. */
static uint32_t *count_pieces(const subject *s, const uint32_t *labels, uint32_t count) {
    fct_mesh mesh = *s->mesh;
    fct_dual dual;
    mesh.triangles = (uint32_t *)s->corners;
    fuzz_require(fct_dual_build(s->env, &mesh, &dual) == FCT_OK, "a dual graph");
    uint32_t *parents = allocate(s, mesh.face_count, sizeof *parents),
             *pieces = allocate(s, count, sizeof *pieces);
    for (uint32_t f = 0; f < mesh.face_count; ++f) parents[f] = f, ++pieces[labels[f]];
    for (uint32_t e = 0; e < dual.edge_count; ++e) {
        uint32_t a = dual.edges[2 * (size_t)e], b = dual.edges[2 * (size_t)e + 1], label = labels[a];
        if (label != labels[b]) continue;
        a = find_root(parents, a), b = find_root(parents, b);
        if (a != b) parents[a] = b, --pieces[label];
    }
    fct_release(s->env, parents);
    fct_dual_release(s->env, &dual);
    return pieces;
}

/* Labels are in range. No cluster loses all faces or falls into more pieces. A face that moved joined its own
 * material. */
static void check_refined(const subject *s, const uint32_t *old_labels, const uint32_t *labels,
                          uint32_t count) {
    uint32_t faces = s->view.face_count;
    uint32_t *materials = allocate(s, count, sizeof *materials); /* a bit per material of the cluster */
    for (uint32_t f = 0; f < faces && s->mesh->materials; ++f)
        materials[old_labels[f]] |= 1u << s->mesh->materials[f];
    for (uint32_t f = 0; f < faces; ++f) {
        uint32_t own = s->mesh->materials ? 1u << s->mesh->materials[f] : 0;
        fuzz_require(labels[f] < count, "labels are in range");
        fuzz_require((materials[labels[f]] & own) == own, "a face joins its own material");
    }
    uint32_t *before = count_pieces(s, old_labels, count), *after = count_pieces(s, labels, count);
    for (uint32_t i = 0; i < count; ++i) {
        fuzz_require((before[i] > 0) == (after[i] > 0), "a cluster keeps a face");
        fuzz_require(after[i] <= before[i], "a cluster does not fall into pieces");
    }
    fct_release(s->env, after);
    fct_release(s->env, before);
    fct_release(s->env, materials);
}

static void use_refine(const subject *s, fuzz_bytes *b) {
    uint32_t faces = s->view.face_count, count;
    uint32_t *nodes = allocate(s, faces, sizeof *nodes), *labels = allocate(s, faces, sizeof *labels),
             *before = allocate(s, faces, sizeof *before);
    fct_refine_def def = fct_refine_def_default();
    fct_refine_stats stats;
    uint32_t options = fuzz_byte(b), k = fuzz_below(b, faces + 1);
    if (options & 1) def.sweep_count = fuzz_below(b, 8);
    if (options & 2) def.perimeter_weight = fuzz_real(b);
    if (options & 4) def.irregularity_limit = fuzz_real(b);
    bool valid = def.perimeter_weight >= 0 && def.perimeter_weight <= 1e6 && def.irregularity_limit >= 1;
    fuzz_require(fct_tree_partition(s->env, s->tree, k, nodes, &count) == FCT_OK, "a partition");
    fuzz_require(fct_tree_labels(s->env, s->tree, nodes, count, before) == FCT_OK, "its labels");
    if (options & 8) { /* labels from the bytes, for a mesh without a tree */
        bool range = true;
        count = 1 + fuzz_below(b, 8);
        for (uint32_t f = 0; f < faces; ++f) before[f] = fuzz_byte(b), range = range && before[f] < count;
        if (!range && fuzz_byte(b) < 250)
            for (uint32_t f = 0; f < faces; ++f) before[f] %= count, range = true;
        valid = valid && range;
    }
    memcpy(labels, before, faces * sizeof *labels);
    fct_result result = options & 8 ? fct_partition_refine(s->env, s->mesh, count, &def, labels, &stats)
                                    : fct_tree_refine(s->env, s->tree, nodes, count, &def, labels, &stats);
    fuzz_require(result == (valid ? FCT_OK : FCT_ERROR_DATA), "valid labels and options are refined");
    if (result != FCT_OK) fuzz_require(!memcmp(labels, before, faces * sizeof *labels), "no change");
    subject plain = *s;
    if (options & 8) plain.corners = s->mesh->triangles;
    if (result == FCT_OK) check_refined(&plain, before, labels, count);
    fct_release(s->env, before);
    fct_release(s->env, labels);
    fct_release(s->env, nodes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_limit limit;
    fct_env env = fuzz_env(&limit, size);
    fuzz_bytes b = fuzz_begin(data, size);
    fct_mesh mesh = fuzz_make_mesh(&env, &b);
    fct_tree *tree = fuzz_make_tree(&env, &b, &mesh);
    if (tree) {
        fct_weld weld = {0};
        subject s = {&env, &mesh, tree, fct_tree_get(tree), mesh.triangles};
        if (s.view.def.weld) fuzz_require(fct_weld_build(&env, &mesh, &weld) == FCT_OK, "a weld");
        if (weld.triangles) s.corners = weld.triangles;
        if (FUZZ_PART == CUT) use_cut(&s, &b);
        if (FUZZ_PART == CHARTS) use_charts(&s, &b);
        if (FUZZ_PART == MESHLETS) use_meshlets(&s, &b);
        if (FUZZ_PART == REFINE) use_refine(&s, &b);
        fct_weld_release(&env, &weld);
        fct_tree_destroy(tree);
    }
    fct_mesh_release(&env, &mesh);
    fuzz_end();
    return 0;
}
