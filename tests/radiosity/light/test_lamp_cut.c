/* One lamp against a plain evaluation: its measures, the table and cut of its light, and the points of shadow
 * rays. */
#include "../place.h"
#include "../soup.h"
#include "cluster/tree/node.h"
#include "radiosity/light/lamp.h"
#include "radiosity/light/lamp_cut.h"
#include "radiosity/light/polygon.h"
#include "scene/transform.h"

static const double pi = 3.14159265358979323846;
static fct_env plain; /* outlives every scene */

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.9g, expected %.9g within %g", value, expected, tolerance);
}

/* A number in [0, 1). */
static double pick(uint64_t a, uint64_t b, uint64_t c) {
    return fct_uniform(fct_hash3(a, b, c));
}

/* Relative second-order correction of K(y) = (n.y) (s.y) / |y|^4 for a surface about d with the covariance
 * sum a a^T, by differences. */
static double correct_plainly(v3 d, v3 n, v3 s, const v3 axes[3]) {
    double sum = 0, own = v3_dot(n, d) * v3_dot(s, d) / pow(v3_norm2(d), 2);
    for (int k = 0; k < 3; ++k) {
        double length = v3_norm(axes[k]), h = length > 0 ? 1e-3 * v3_norm(d) / length : 0;
        if (h == 0) continue;
        for (int sign = -1; sign <= 1; sign += 2) {
            v3 y = v3_mad(d, sign * h, axes[k]);
            sum += (v3_dot(n, y) * v3_dot(s, y) / pow(v3_norm2(y), 2) - own) / (h * h) / own / 2;
        }
    }
    return sum;
}

static void load_corners(const fct_lamp *lamp, uint32_t leaf, v3 p[3]) {
    for (size_t k = 0; k < 3; ++k)
        p[k] = v3_load(lamp->view.positions +
                       3 * (size_t)lamp->view.triangles[3 * (size_t)(leaf - lamp->view.node_count) + k]);
}

/* The quarter of a triangle that the base-4 digits after the leading 1 name: 0, 1, 2 at a corner, 3 in the
 * middle. */
static void take_part(uint32_t part, v3 p[3]) {
    int digits = 0;
    while (part >> (2 * digits) > 1) ++digits;
    for (int i = digits - 1; i >= 0; --i) {
        int d = part >> (2 * i) & 3;
        v3 q[3], m[3];
        for (int k = 0; k < 3; ++k) m[k] = v3_scale(v3_add(p[k], p[(k + 1) % 3]), .5);
        for (int k = 0; k < 3; ++k) q[k] = d == 3 ? m[k] : v3_scale(v3_add(p[k], p[d]), .5);
        memcpy(p, q, sizeof q);
    }
}

/* A triangle (corners relative to the receiver) by the far formula where that errs by less than 2 %, else
 * exactly. */
static double light_plainly(const fct_lamp *lamp, const fct_receiver *rec, const v3 p[3], bool *near) {
    v3 s = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])),
       d = v3_scale(v3_add(p[0], v3_add(p[1], p[2])), 1. / 3);
    double toward = -v3_dot(s, d), r = v3_norm(d), area2 = v3_norm(s), size2 = 0, low = INFINITY;
    *near = false;
    if (area2 == 0 || fabs(toward) <= rec->slack * area2 || (toward < 0 && !lamp->two_sided)) return 0;
    v3 axes[3];
    for (int k = 0; k < 3; ++k) {
        v3 e = v3_sub(p[(k + 1) % 3], p[k]);
        size2 += v3_norm2(e), axes[k] = v3_scale(e, 1. / 6);
        low = fmin(low, v3_dot(p[k], rec->n));
    }
    double x = v3_dot(d, rec->n) / r, y = fabs(toward) / area2 / r;
    if (low > 0 && size2 / 36 * (1 / x + 1 / y) < .02 * r * r)
        return area2 / 2 * x * y / (pi * r * r) * (1 + correct_plainly(d, rec->n, s, axes));
    *near = size2 > r * r;
    return fct_triangle_irradiance(p, rec->n);
}

/* The light of a node, an upper bound of it, and the error that the estimate may have. */
typedef struct outlook {
    double light, upper, error;
    bool whole;
} outlook;

/* True if the receiver is nowhere in front of the node's faces, which lie in its box and have normals within
 * the cone, by more than two millionths of a radian. */
static bool is_turned_away(const fct_lamp *lamp, const fct_receiver *rec, const fct_cluster *c, double far) {
    fct_box box;
    fct_cluster_box(c, &box);
    v3 n = v3_unit(v3_load(c->area_vector));
    double highest = -INFINITY, lowest = INFINITY;
    for (int corner = 0; corner < 8; ++corner) {
        v3 y = v3_load(c->box_center);
        for (int k = 0; k < 3; ++k)
            y = v3_mad(y, corner >> k & 1 ? box.half[k] : -box.half[k], v3_load(box.axes[k]));
        double height = v3_dot(n, v3_sub(rec->x, y));
        highest = fmax(highest, height), lowest = fmin(lowest, height);
    }
    if (lamp->two_sided) highest = fmax(highest, -lowest);
    return highest + (c->cone_angle - 2e-6) * far <= rec->slack;
}

static outlook look_plainly(const fct_lamp *lamp, const fct_receiver *rec, const fct_cluster *c) {
    v3 d = v3_sub(v3_load(c->centroid), rec->x), s = v3_load(c->area_vector);
    double half2 = v3_norm2(v3_load(c->box_half)),
           shift2 = v3_norm2(v3_sub(v3_load(c->centroid), v3_load(c->box_center)));
    double radius = sqrt(half2) + sqrt(shift2), r = v3_norm(d), height = v3_dot(d, rec->n),
           angle = c->cone_angle;
    outlook o = {0};
    if (height <= -radius || is_turned_away(lamp, rec, c, r + radius)) return o;
    v3 w = v3_scale(d, 1 / r);
    double spread = fmin(radius / r, 1), cosx = height / r, toward = -v3_dot(s, w);
    int side = 0;
    if (angle < 1.6 && spread <= .9) {
        double cosine = toward / v3_norm(s), margin = angle + 1.25 * spread;
        side = cosine > margin ? 1 : cosine < -margin ? -1 : 0;
    }
    if (side < 0 && !lamp->two_sided) return o;
    const float *m = c->moment;
    double form = w.x * w.x * m[0] + w.y * w.y * m[3] + w.z * w.z * m[5] +
                  2 * (w.x * w.y * m[1] + w.x * w.z * m[2] + w.y * w.z * m[4]);
    double both = sqrt(fmax(form, 0) * c->area), kernel = 1 / (pi * fmax(r * r, radius * radius));
    double upper = lamp->two_sided ? both : (both + toward) / 2,
           lower = lamp->two_sided ? fabs(toward) : fmax(toward, 0);
    upper = fmax(upper, lower);
    double widest = fmin(c->area, side ? upper : upper + spread * (c->area - upper));
    o.upper = widest * fmin(cosx + spread, 1) * kernel;
    if (side && cosx >= spread && spread < .5) {
        double cosy = fmax(fabs(toward) / c->area, .05), rms = sqrt(half2 / 3 + shift2) / r;
        o.light = fabs(toward) * cosx * kernel, o.whole = true;
        o.error = o.light * (rms * rms * (1 / fmax(cosx, .05) + 1 / cosy) + .2 * rms * fmin(angle, 1) / cosy);
        return o;
    }
    double mean = 0; /* of max(0, x) over x in cosx +- spread */
    enum { STEPS = 4000 };
    for (int i = 0; i < STEPS; ++i) mean += fmax(cosx + spread * (2 * (i + .5) / STEPS - 1), 0) / STEPS;
    o.light = (lower + upper) / 2 * mean * kernel;
    o.error = .35 * (o.upper - (side ? lower * fmax(cosx - spread, 0) * kernel : 0));
    return o;
}

static void add_item(fct_cut *cut, uint32_t node, uint32_t part, double light) {
    cut->light += light;
    assert_true(cut->count < FCT_CUT_SIZE);
    if (light > 0) cut->items[cut->count++] = (fct_cut_item){node, part, light};
}

static void cut_leaf(const fct_lamp *lamp, const fct_receiver *rec, uint32_t leaf, uint32_t part,
                     double reference, fct_cut *cut) {
    v3 p[3];
    bool near;
    load_corners(lamp, leaf, p);
    for (int k = 0; k < 3; ++k) p[k] = v3_sub(p[k], rec->x);
    take_part(part, p);
    double light = light_plainly(lamp, rec, p, &near);
    if (near && part < 1 << 12 && light > .05 * reference)
        for (uint32_t d = 0; d < 4; ++d) cut_leaf(lamp, rec, leaf, 4 * part + d, reference, cut);
    else
        add_item(cut, leaf, part, light);
}

/* Returns the number of clusters in the cut. */
static int cut_node(const fct_lamp *lamp, const fct_receiver *rec, uint32_t node, double share,
                    double reference, fct_cut *cut) {
    if (node >= lamp->view.node_count) {
        cut_leaf(lamp, rec, node, 1, reference, cut);
        return 0;
    }
    fct_cluster room;
    fct_box box;
    const fct_cluster *c = fct_node_cluster(lamp->tree, node, &room);
    outlook o = look_plainly(lamp, rec, c);
    if (o.upper <= 0) return 0;
    if (o.error <= share || o.error <= .02 * o.light) {
        v3 axes[3];
        fct_cluster_box(c, &box);
        for (int k = 0; k < 3; ++k) axes[k] = v3_scale(v3_load(box.axes[k]), box.half[k] * sqrt(.29));
        double correction =
            correct_plainly(v3_sub(v3_load(c->centroid), rec->x), rec->n, v3_load(c->area_vector), axes);
        add_item(cut, node, 1, o.whole ? o.light * (1 + fmin(fmax(correction, -.1), .1)) : o.light);
        return 1;
    }
    int clusters = 0;
    for (int k = 0; k < 2; ++k)
        clusters += cut_node(lamp, rec, fct_node_child(lamp->tree, node, k), share, reference, cut);
    return clusters;
}

/* Direction and length of the corner (i, j) of face `face` of the table's cube: faces +x -x +y -y +z -z. */
static v3 table_corner(int face, int i, int j) {
    double d[3];
    d[face / 2] = face % 2 ? -1 : 1;
    d[(face / 2 + 1) % 3] = i / 8. - 1, d[(face / 2 + 2) % 3] = j / 8. - 1;
    return v3_make(d[0], d[1], d[2]);
}

/* Projected area along the unit vector w, bilinear between the table's corners. */
static double look_up_plainly(const double *table, v3 w) {
    double a[3] = {w.x, w.y, w.z}, sum = 0;
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (fabs(a[k]) > fabs(a[axis])) axis = k;
    double length = fabs(a[axis]), u = 8 * (a[(axis + 1) % 3] / length + 1),
           v = 8 * (a[(axis + 2) % 3] / length + 1);
    for (int j = 0; j < 17; ++j)
        for (int i = 0; i < 17; ++i)
            sum += table[((2 * axis + (a[axis] < 0)) * 17 + j) * 17 + i] * fmax(1 - fabs(u - i), 0) *
                   fmax(1 - fabs(v - j), 0);
    return sum * length;
}

static double estimate_plainly(const fct_lamp *lamp, const fct_receiver *rec) {
    v3 d = v3_sub(lamp->center, rec->x);
    double r = v3_norm(d), height = v3_dot(d, rec->n), toward = -v3_dot(lamp->vector, d),
           radius = lamp->radius;
    if (height <= -radius) return 0;
    if (!lamp->table && !lamp->two_sided && toward <= -2e-3 * radius * lamp->area) return 0;
    if (r < radius / 2) return 1;
    double area = lamp->table ? look_up_plainly(lamp->table, v3_scale(d, -1 / r)) : fabs(toward) / r;
    area += .1 * lamp->area * fmin(radius / r, 1);
    return area * fmin((height + radius) / r, 1) / (area + pi * r * r);
}

/* The cut, with the estimate as the first reference. Returns whether the table gave it. */
static bool cut_plainly(const fct_lamp *lamp, const fct_receiver *rec, fct_cut *cut) {
    v3 d = v3_sub(lamp->center, rec->x);
    double r = v3_norm(d), height = v3_dot(d, rec->n), reference = estimate_plainly(lamp, rec);
    cut->count = 0, cut->light = 0;
    if (lamp->view.root_count == 1 && height <= -lamp->radius) return true;
    if (lamp->view.root_count == 1 && lamp->table && height >= lamp->radius &&
        lamp->rms2 * (1 + r / height) <= .02 * r * r) {
        add_item(cut, lamp->view.roots[0], 1,
                 look_up_plainly(lamp->table, v3_scale(d, -1 / r)) * height / r / (pi * r * r));
        return true;
    }
    for (int round = 0; round < 8 && reference > 0; ++round) {
        int clusters = 0;
        cut->count = 0, cut->light = 0;
        for (uint32_t i = 0; i < lamp->view.root_count; ++i)
            clusters += cut_node(lamp, rec, lamp->view.roots[i], 7e-4 * reference, reference, cut);
        if (clusters == 0 || cut->light >= .3 * reference) break;
        reference = fmax(cut->light, .2 * reference);
    }
    return false;
}

/* Weight of a node for shadow points. */
static double weigh_plainly(const fct_lamp *lamp, const fct_receiver *rec, uint32_t node) {
    if (node < lamp->view.node_count) {
        fct_cluster room;
        const fct_cluster *c = fct_node_cluster(lamp->tree, node, &room);
        v3 d = v3_sub(v3_load(c->centroid), rec->x);
        double radius = (double)c->box_half[0] + (double)c->box_half[1] + (double)c->box_half[2];
        double r = sqrt(v3_norm2(d) + radius * radius), top = v3_dot(d, rec->n) + radius;
        double toward = -v3_dot(v3_load(c->area_vector), d);
        toward = lamp->two_sided ? fabs(toward) : fmax(toward, 0);
        return top <= 0 ? 0 : (toward + .1 * c->area * r) * fmin(top, r) / pow(r, 4);
    }
    v3 p[3];
    double top = -INFINITY;
    load_corners(lamp, node, p);
    for (int k = 0; k < 3; ++k) p[k] = v3_sub(p[k], rec->x), top = fmax(top, v3_dot(p[k], rec->n));
    v3 s = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), .5),
       d = v3_scale(v3_add(p[0], v3_add(p[1], p[2])), 1. / 3);
    double toward = -v3_dot(s, d), area = v3_norm(s), r2 = v3_norm2(d) + area;
    if ((toward <= 0 && !lamp->two_sided) || top <= 0) return 0;
    return fabs(toward) * (top + .1 * sqrt(area)) / (pi * r2 * r2);
}

/* The point of a cut: an item in proportion to light, then down by the children's weights; v runs from the
 * corner opposite the shortest side. */
static fct_lamp_point point_plainly(const fct_lamp *lamp, const fct_receiver *rec, const fct_cut *cut,
                                    double u, double v) {
    fct_lamp_point out = {.place = FCT_NONE};
    double chance, target = u * cut->light, before = 0;
    uint32_t i = 0;
    while (i + 1 < cut->count && before + cut->items[i].light <= target) before += cut->items[i++].light;
    u = (target - before) / cut->items[i].light, chance = cut->items[i].light / cut->light;
    uint32_t node = cut->items[i].node;
    while (node < lamp->view.node_count) {
        uint32_t child[2] = {fct_node_child(lamp->tree, node, 0), fct_node_child(lamp->tree, node, 1)};
        double w[2] = {weigh_plainly(lamp, rec, child[0]), weigh_plainly(lamp, rec, child[1])};
        if (w[0] + w[1] == 0) return out;
        double share = w[0] / (w[0] + w[1]);
        bool second = u >= share;
        u = second ? (u - share) / (1 - share) : u / share, chance *= second ? 1 - share : share;
        node = child[second];
    }
    v3 p[3];
    out.place = node - lamp->view.node_count;
    load_corners(lamp, node, p);
    take_part(cut->items[i].part, p);
    int tip = 0;
    double shortest = INFINITY;
    for (int k = 0; k < 3; ++k) {
        double side = v3_norm2(v3_sub(p[(k + 2) % 3], p[(k + 1) % 3]));
        if (side < shortest) shortest = side, tip = k;
    }
    v3 e = v3_sub(p[(tip + 1) % 3], p[tip]), f = v3_sub(p[(tip + 2) % 3], p[tip]), s = v3_cross(e, f);
    out.y = v3_mad(v3_mad(p[tip], sqrt(v) * (1 - u), e), sqrt(v) * u, f);
    v3 d = v3_sub(out.y, rec->x);
    double toward = -v3_dot(s, d), height = v3_dot(d, rec->n);
    if (lamp->two_sided) toward = fabs(toward);
    if (height > 0 && toward > rec->slack * v3_norm(s))
        out.weight = toward / 2 * height / (pi * pow(v3_norm2(d), 2)) / chance;
    return out;
}

static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
static const float turned[12] = {0, -2, 0, 1, 2, 0, 0, 2, 0, 0, 2, 3};
static const float mirrored[12] = {-1.5F, 0, 0, 1, 0, 1.5F, 0, 2, 0, 0, 1.5F, 3};
static const float sheared[12] = {1, .5F, 0, 1, 0, 2, 0, 2, .3F, .25F, 1.5F, 3};
static const float sheared_mirrored[12] = {-1, .5F, 0, 1, 0, 2, 0, 2, .3F, .25F, 1.5F, 3};

/* One lamp of a few shapes and sizes, as the only instance. */
static fct_scene *make_lamp(int shape, int kind, fct_lamp *lamp) {
    static const float *const transforms[4] = {turned, mirrored, sheared, sheared_mirrored};
    fct_scene *scene;
    plain = fct_env_default();
    assert_int_equal(fct_scene_create(&plain, FCT_BACKEND_OBB, &scene), FCT_OK);
    fct_mesh mesh = shape == 0   ? make_grid(&plain, 1)
                    : shape == 1 ? make_bumpy(&plain, 6, .3)
                    : shape == 2
                        ? make_bumpy(&plain, 20, .1)
                        : make_sheet(&plain, 12, v3_make(0, 0, 0), v3_make(1, .2, 0), v3_make(0, 1, .1));
    if (shape == 3)
        for (uint32_t v = 0; v < mesh.vertex_count; ++v) /* a wavy sheet with two sides */
            mesh.positions[3 * (size_t)v + 2] +=
                (float)(.15 * sin(9 * (double)mesh.positions[3 * (size_t)v]));
    fct_material m = {.emission = {1, 2, 4}, .two_sided = shape == 3};
    uint32_t id;
    fct_tree_def def = fct_tree_def_default();
    fct_tree *tree;
    def.root_count = shape == 1 && kind == 1 ? 5 : 1;
    assert_int_equal(fct_scene_add_material(scene, &m, &id), FCT_OK);
    assert_int_equal(fct_tree_build(&plain, &mesh, &def, NULL, &tree), FCT_OK);
    assert_int_equal(fct_scene_add_object(scene, "lamp", NULL, tree, transforms[kind], id, NULL), FCT_OK);
    fct_mesh_release(&plain, &mesh);
    assert_int_equal(fct_scene_commit(scene), FCT_OK);
    fct_scene_view view = fct_scene_get(scene);
    assert_int_equal(fct_lamp_init(&plain, &view, 0, lamp), FCT_OK);
    return scene;
}

/* Sums of a lamp in its own space; faces keep their side in mirrored copies. */
static void lamps_know_their_measures(void **state) {
    (void)state;
    for (int shape = 0; shape < 4; ++shape)
        for (int kind = 0; kind < 4; ++kind) {
            fct_lamp lamp;
            fct_scene *scene = make_lamp(shape, kind, &lamp);
            fct_scene_view view = fct_scene_get(scene);
            const fct_instance *in = &view.instances[0];
            soup world = list_triangles(scene);
            double s = in->uniform_scale > 0 ? in->uniform_scale : 1, area = 0, largest = 0, radius = 0,
                   rms2 = 0;
            v3 vector = {0, 0, 0};
            for (size_t i = 0; i < world.count; ++i) {
                const v3 *p = world.corners + 3 * i;
                v3 n = v3_scale(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), in->mirrored ? -.5 : .5);
                area += v3_norm(n), vector = v3_add(vector, n);
            }
            assert_near(lamp.area * s * s, area, 1e-5 * area);
            /* In model space a mirrored lamp faces the same side as its model. */
            assert_near(v3_norm(lamp.vector) * s * s, v3_norm(vector), 1e-5 * area);
            if (in->uniform_scale == 0) assert_true(v3_norm(v3_sub(lamp.vector, vector)) < 1e-5 * area);
            assert_int_equal(lamp.table == NULL, shape == 0);
            assert_near(lamp.strength, 7, 1e-6), assert_near(lamp.emission[1], 2, 1e-6);
            for (uint32_t r = 0; r < lamp.view.root_count; ++r) {
                fct_cluster c;
                assert_int_equal(fct_tree_cluster(lamp.tree, lamp.view.roots[r], &c), FCT_OK);
                double half = v3_norm(v3_load(c.box_half)),
                       away = v3_norm(v3_sub(v3_load(c.box_center), lamp.center));
                radius = fmax(radius, half + away),
                rms2 += (double)c.area / lamp.area * (half * half / 3 + away * away);
                largest = fmax(largest, v3_norm(v3_load(c.box_center)) + half);
            }
            assert_near(lamp.radius, radius, 1e-6 * radius), assert_near(lamp.rms2, rms2, 1e-6 * rms2);
            double move = in->uniform_scale > 0 ? 3 : 0, slack = 4e-7 * largest + 4e-7 * move / s;
            assert_near(lamp.rounding, slack, 1e-3 * slack);
            const double point[3] = {5, -7, 2}, normal[3] = {.6, 0, .8};
            fct_receiver rec = fct_lamp_receiver(&lamp, point, normal);
            assert_near(rec.slack, slack + 4e-7 * 7 / s, 1e-3 * slack);
            v3 back = rec.x, turn = rec.n;
            if (in->uniform_scale > 0) {
                const float *m = in->to_world;
                double x[3] = {back.x, back.y, back.z}, y[3] = {turn.x, turn.y, turn.z}, w[3], n[3];
                for (int r = 0; r < 3; ++r) {
                    w[r] = (double)m[4 * r] * x[0] + (double)m[4 * r + 1] * x[1] +
                           (double)m[4 * r + 2] * x[2] + m[4 * r + 3];
                    n[r] = ((double)m[4 * r] * y[0] + (double)m[4 * r + 1] * y[1] +
                            (double)m[4 * r + 2] * y[2]) /
                           s;
                }
                back = v3_make(w[0], w[1], w[2]), turn = v3_make(n[0], n[1], n[2]);
            }
            assert_true(v3_norm(v3_sub(back, v3_make(5, -7, 2))) < 1e-5 &&
                        v3_norm(v3_sub(turn, v3_make(.6, 0, .8))) < 1e-6);
            /* Below 2,048 faces the table holds exact projected areas. */
            for (int k = 0; lamp.table && k < FCT_LAMP_TABLE; k += 7) {
                v3 w = table_corner(k / 289, k % 17, k / 17 % 17);
                double sum = 0;
                for (uint32_t leaf = lamp.view.node_count; leaf < lamp.view.node_count + lamp.view.face_count;
                     ++leaf) {
                    v3 p[3];
                    load_corners(&lamp, leaf, p);
                    double x = .5 * v3_dot(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])), w);
                    sum += lamp.two_sided ? fabs(x) : fmax(x, 0);
                }
                assert_near(lamp.table[k], sum, 1e-3 * lamp.area);
            }
            free(world.corners);
            fct_lamp_release(&plain, &lamp);
            fct_scene_destroy(scene);
        }
}

static void cuts_follow_the_rules(void **state) {
    (void)state;
    static fct_cut cut, expected;
    int tables = 0, parts = 0, clusters = 0, points = 0;
    for (int shape = 0; shape < 4; ++shape)
        for (int kind = 0; kind < 3; ++kind) {
            fct_lamp lamp;
            fct_scene *scene = make_lamp(shape, kind, &lamp);
            for (uint64_t i = 0; i < 80; ++i) {
                uint64_t seed = (uint64_t)(4 * shape + kind);
                v3 away =
                    v3_unit(v3_make(pick(seed, i, 0) - .5, pick(seed, i, 1) - .5, pick(seed, i, 2) - .5));
                v3 n = v3_unit(v3_make(pick(seed, i, 3) - .5, pick(seed, i, 4) - .5, pick(seed, i, 5) - .5));
                double size = lamp.radius * lamp.scale, r = size * (.3 + pow(40, pick(seed, i, 6)) * .9);
                const float *m = fct_scene_get(scene).instances[0].to_world;
                v3 c = fct_transform_point(m, v3_make(0, 0, 0)), x = v3_mad(c, r, away);
                if (i % 4 == 1) { /* within .4 % of the plane through the lamp */
                    fct_receiver here = fct_lamp_receiver(&lamp, (double[3]){c.x, c.y, c.z},
                                                          (double[3]){away.x, away.y, away.z});
                    v3 s = v3_unit(lamp.vector), side = v3_unit(v3_mad(here.n, -v3_dot(here.n, s), s));
                    x = v3_mad(lamp.center, 1.5 * lamp.radius, side);
                    x = v3_mad(x, .008 * lamp.radius * (pick(seed, i, 7) - .5), s);
                    x = fct_transform_point(lamp.own ? identity : m, x);
                }
                if (i % 3) n = v3_unit(v3_mad(n, -1.2, away));
                const double point[3] = {x.x, x.y, x.z}, normal[3] = {n.x, n.y, n.z};
                fct_receiver rec = fct_lamp_receiver(&lamp, point, normal);
                double estimate = estimate_plainly(&lamp, &rec);
                assert_near(fct_lamp_estimate(&lamp, &rec), estimate, 1e-6 * estimate);
                fct_lamp_cut(&lamp, &rec, &cut);
                bool table = cut_plainly(&lamp, &rec, &expected);
                assert_int_equal(cut.count, expected.count);
                assert_near(cut.light, expected.light, 1e-5 * expected.light);
                tables += table && cut.count;
                for (uint32_t k = 0; k < cut.count; ++k) {
                    const fct_cut_item *a = &cut.items[k], *b = &expected.items[k];
                    assert_true(a->node == b->node && a->part == b->part);
                    assert_near(a->light, b->light, 2e-5 * b->light + 1e-9);
                    parts += a->part > 1, clusters += a->node < lamp.view.node_count;
                }
                for (uint32_t k = 0; k < 24 && cut.count; ++k) {
                    double u = pick(seed, i, 10 + k), v = pick(seed, i, 100 + k);
                    fct_lamp_point p = fct_cut_point(&lamp, &rec, &cut, u, v),
                                   q = point_plainly(&lamp, &rec, &cut, u, v);
                    assert_int_equal(p.place, q.place);
                    assert_near(p.weight, q.weight, 1e-6 * q.weight);
                    if (q.place == FCT_NONE) continue;
                    assert_true(v3_norm(v3_sub(p.y, q.y)) < 1e-5 * lamp.radius), ++points;
                }
            }
            fct_lamp_release(&plain, &lamp);
            fct_scene_destroy(scene);
        }
    printf("    %d tables, %d parts, %d clusters, %d points\n", tables, parts, clusters, points);
    assert_true(tables > 20 && parts > 100 && clusters > 500 && points > 2000);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamps_know_their_measures),
        cmocka_unit_test(cuts_follow_the_rules),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
