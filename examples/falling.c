/* Drops pebbles into a bowl and lets them come to rest.
 *
 * Surfaces of two bodies that overlap meet in a closed curve. The area inside of this curve, times a
 * pressure, is the force that drives the bodies apart: so it grows with the depth, and its direction does not
 * depend on single faces. A tracker keeps, for each pair of bodies, where the last search ended; pebbles that
 * rest cost little. Friction is a spring between the bodies, which slides at the Coulomb limit. Each run
 * gives the same frames, for any number of threads.
 *
 * Writes falling-0.ply to falling-3.ply, with y up, while z is up here. usage: falling
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <facetree/facetree.h>

enum {
    RINGS = 11,
    SPOKES = 24, /* of a pebble */
    CELLS = 32,  /* of the bowl, along each side */
    LAYERS = 3,
    BODIES = 1 + 9 * LAYERS, /* body 0 is the bowl */
    FRAMES = 150,
    FRAME_STEPS = 10, /* a frame is 1/25 s */
    MOST_PAIRS = 2048 /* of faces of two bodies */
};
/* Metres, seconds and a mass of 1 per pebble. Under its weight, a pebble on its flat side sinks by 4 mm, and
 * swings 8 times per second; a step is a thirtieth of this time. */
static const double half_side = 3, radii[3] = {.5, .4, .3}, gravity = 9.81;
static const double step = 1. / 25 / FRAME_STEPS;
static const double pressure = 600; /* per area inside the curve */
static const double damping = 2;    /* share of the pressure that 1 m/s adds or takes */
static const double spring = 1500, spring_damping = 20, friction = .6;
static const double drag = 2; /* share of the spin lost per second: pebbles do not roll for ever */

typedef struct vec {
    double x, y, z;
} vec;

static vec add(vec a, double s, vec b) { /* a + s b */
    return (vec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static vec cross(vec a, vec b) {
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static double dot(vec a, vec b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static vec turn(const fct_pose *p, vec v) {
    const double(*r)[3] = p->rotation;
    return (vec){dot((vec){r[0][0], r[0][1], r[0][2]}, v), dot((vec){r[1][0], r[1][1], r[1][2]}, v),
                 dot((vec){r[2][0], r[2][1], r[2][2]}, v)};
}

static vec turn_back(const fct_pose *p, vec v) {
    const double(*r)[3] = p->rotation;
    return (vec){dot((vec){r[0][0], r[1][0], r[2][0]}, v), dot((vec){r[0][1], r[1][1], r[2][1]}, v),
                 dot((vec){r[0][2], r[1][2], r[2][2]}, v)};
}

static vec center_of(const fct_pose *p) {
    return (vec){p->translation[0], p->translation[1], p->translation[2]};
}

/* --- Shapes --- */

static double bowl_height(double x, double y) {
    return .12 * (x * x + y * y);
}

static void fill_bowl(fct_mesh *mesh) {
    uint32_t *t = mesh->triangles;
    for (uint32_t i = 0; i <= CELLS; ++i)
        for (uint32_t j = 0; j <= CELLS; ++j) {
            float *p = mesh->positions + 3 * (size_t)(i * (CELLS + 1) + j);
            double x = half_side * (2. * j / CELLS - 1), y = half_side * (2. * i / CELLS - 1);
            p[0] = (float)x, p[1] = (float)y, p[2] = (float)bowl_height(x, y);
            if (i == CELLS || j == CELLS) continue;
            uint32_t v = i * (CELLS + 1) + j, up = v + CELLS + 1;
            *t++ = v, *t++ = v + 1, *t++ = up + 1;
            *t++ = v, *t++ = up + 1, *t++ = up;
        }
}

static void fill_pebble(fct_mesh *mesh) {
    uint32_t top = RINGS * SPOKES, bottom = top + 1, *t = mesh->triangles;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        double a = 3.141592653589793 * (v / SPOKES + 1) / (RINGS + 1),
               b = 6.283185307179586 * (v % SPOKES) / SPOKES;
        double p[3] = {sin(a) * cos(b), sin(a) * sin(b), cos(a)};
        if (v >= top) p[0] = p[1] = 0, p[2] = v == top ? 1 : -1;
        for (int k = 0; k < 3; ++k) mesh->positions[3 * v + k] = (float)(radii[k] * p[k]);
    }
    for (uint32_t j = 0; j < SPOKES; ++j) {
        uint32_t next = (j + 1) % SPOKES, last = (RINGS - 1) * SPOKES;
        *t++ = top, *t++ = j, *t++ = next;
        *t++ = bottom, *t++ = last + next, *t++ = last + j;
        for (uint32_t i = 0; i < last; i += SPOKES) {
            *t++ = i + j, *t++ = i + SPOKES + j, *t++ = i + SPOKES + next;
            *t++ = i + j, *t++ = i + SPOKES + next, *t++ = i + next;
        }
    }
}

typedef struct shape {
    fct_mesh mesh;
    fct_tree *tree;
    fct_bvh *bvh;
} shape;

static fct_result make_shape(const fct_env *env, bool bowl, shape *out) {
    uint32_t vertices = bowl ? (CELLS + 1) * (CELLS + 1) : RINGS * SPOKES + 2;
    uint32_t faces = bowl ? 2 * CELLS * CELLS : 2 * RINGS * SPOKES;
    fct_tree_def tree_def = fct_tree_def_default();
    fct_bvh_def bvh_def = fct_bvh_def_default();
    bvh_def.parts = FCT_BVH_PAIRS;
    fct_result result = fct_mesh_create(env, vertices, faces, 0, &out->mesh);
    if (result != FCT_OK) return result;
    (bowl ? fill_bowl : fill_pebble)(&out->mesh);
    result = fct_tree_build(env, &out->mesh, &tree_def, NULL, &out->tree);
    return result == FCT_OK ? fct_bvh_build(env, out->tree, &bvh_def, &out->bvh) : result;
}

static vec face_normal(const fct_mesh *mesh, uint32_t face) { /* not of unit length */
    vec p[3];
    for (int c = 0; c < 3; ++c) {
        const float *v = mesh->positions + 3 * (size_t)mesh->triangles[3 * face + c];
        p[c] = (vec){v[0], v[1], v[2]};
    }
    return cross(add(p[1], -1, p[0]), add(p[2], -1, p[0]));
}

/* --- The world --- */

typedef struct motion {
    vec velocity, spin, force, torque;
} motion;

typedef struct world {
    const fct_env *env;
    shape bowl, pebble;
    fct_body bodies[BODIES];
    fct_body_tracker *tracker;
    motion motions[BODIES];
    vec slide[BODIES][BODIES];        /* how far the friction spring of two bodies is stretched */
    uint32_t touched[BODIES][BODIES]; /* the step after the last one in which they touched */
    uint32_t steps;
    size_t pair_count;
    double carried; /* force of the bowl, upwards */
} world;

static void place_pebbles(world *w) {
    w->bodies[0] = (fct_body){w->bowl.bvh, fct_pose_identity()};
    for (int i = 1; i < BODIES; ++i) {
        int layer = (i - 1) / 9, x = (i - 1) % 3 - 1, y = (i - 1) / 3 % 3 - 1;
        double a = .7 * i, c = cos(a), s = sin(a);
        w->bodies[i].bvh = w->pebble.bvh;
        w->bodies[i].pose = (fct_pose){{{c, -s, 0}, {.6 * s, .6 * c, -.8}, {.8 * s, .8 * c, .6}},
                                       {1.15 * x + .1 * layer, 1.15 * y - .1 * layer, 1.2 + 1.2 * layer}};
    }
}

/* The pose of b in the coordinates of a. */
static fct_pose relate(const fct_pose *a, const fct_pose *b) {
    fct_pose out;
    for (int j = 0; j < 4; ++j) {
        vec v = add(center_of(b), -1, center_of(a));
        if (j < 3) v = (vec){b->rotation[0][j], b->rotation[1][j], b->rotation[2][j]};
        v = turn_back(a, v);
        const double column[3] = {v.x, v.y, v.z};
        for (int i = 0; i < 3; ++i) *(j < 3 ? &out.rotation[i][j] : &out.translation[i]) = column[i];
    }
    return out;
}

/* The area vector of the curve in which the surfaces meet, seen from a, and the middle of the curve. */
static bool find_curve(const world *w, const fct_body_pair *pair, vec *area, vec *middle) {
    const fct_body *a = w->bodies + pair->body_a, *b = w->bodies + pair->body_b;
    const fct_mesh *mesh_a = pair->body_a ? &w->pebble.mesh : &w->bowl.mesh, *mesh_b = &w->pebble.mesh;
    fct_pose pose = relate(&a->pose, &b->pose);
    fct_face_pair faces[MOST_PAIRS];
    size_t count = fct_bvh_pairs(a->bvh, b->bvh, &pose, MOST_PAIRS, MOST_PAIRS, faces, NULL, NULL);
    vec first = {0}, sum = {0}, twice = {0};
    double length = 0;
    for (size_t i = 0; i < count; ++i) {
        fct_contact contact;
        if (!fct_bvh_contact(a->bvh, b->bvh, &pose, faces + i, &contact)) continue;
        vec from = {contact.from[0], contact.from[1], contact.from[2]};
        vec along = add((vec){contact.to[0], contact.to[1], contact.to[2]}, -1, from);
        if (i == 0) first = from;
        from = add(from, -1, first);
        /* The curve runs along the product of both normals: around the normal of a. */
        vec way =
            cross(face_normal(mesh_a, faces[i].face_a), turn(&pose, face_normal(mesh_b, faces[i].face_b)));
        double size = sqrt(dot(along, along));
        twice = add(twice, dot(way, along) < 0 ? -1 : 1, cross(from, along));
        sum = add(sum, size, add(from, .5, along));
        length += size;
    }
    if (!(length > 0)) return false;
    *area = turn(&a->pose, (vec){twice.x / 2, twice.y / 2, twice.z / 2});
    *middle = add(center_of(&a->pose), 1, turn(&a->pose, add(first, 1 / length, sum)));
    return dot(*area, *area) > 0;
}

/* The velocity of a body at a point. */
static vec velocity_at(const world *w, uint32_t body, vec point) {
    vec arm = add(point, -1, center_of(&w->bodies[body].pose));
    return add(w->motions[body].velocity, 1, cross(w->motions[body].spin, arm));
}

static void push(world *w, uint32_t body, vec point, double sign, vec force) {
    vec arm = add(point, -1, center_of(&w->bodies[body].pose));
    w->motions[body].force = add(w->motions[body].force, sign, force);
    w->motions[body].torque = add(w->motions[body].torque, sign, cross(arm, force));
}

static void push_apart(world *w, const fct_body_pair *pair) {
    uint32_t a = pair->body_a, b = pair->body_b;
    vec area, middle, *slide = &w->slide[a][b], zero = {0};
    if (!find_curve(w, pair, &area, &middle)) return;
    double size = sqrt(dot(area, area));
    vec normal = add(zero, 1 / size, area);
    vec velocity = add(velocity_at(w, b, middle), -1, velocity_at(w, a, middle));
    double apart = dot(velocity, normal), most = pressure * size * fmax(1 - damping * apart, 0);
    velocity = add(velocity, -apart, normal);
    if (w->touched[a][b] != w->steps) *slide = zero;
    w->touched[a][b] = w->steps + 1;
    *slide = add(add(*slide, step, velocity), -dot(*slide, normal), normal);
    vec rub = add(add(zero, -spring, *slide), -spring_damping, velocity);
    double strength = sqrt(dot(rub, rub));
    if (strength > friction * most) {
        rub = add(zero, friction * most / strength, rub);
        *slide = add(zero, -1 / spring, rub);
    }
    vec force = add(rub, most, normal);
    push(w, b, middle, 1, force);
    push(w, a, middle, -1, force);
    if (a == 0) w->carried += force.z;
}

/* Turns the pose by the spin, and makes its rotation orthonormal again. */
static void spin_pose(fct_pose *pose, vec spin) {
    vec row[3] = {{0}};
    for (int j = 0; j < 2; ++j) {
        vec axis = {pose->rotation[0][j], pose->rotation[1][j], pose->rotation[2][j]};
        axis = add(axis, step, cross(spin, axis));
        if (j == 1) axis = add(axis, -dot(axis, row[0]), row[0]);
        row[j] = add((vec){0, 0, 0}, 1 / sqrt(dot(axis, axis)), axis);
    }
    row[2] = cross(row[0], row[1]);
    for (int j = 0; j < 3; ++j)
        pose->rotation[0][j] = row[j].x, pose->rotation[1][j] = row[j].y, pose->rotation[2][j] = row[j].z;
}

static void move_body(fct_pose *pose, motion *m) {
    const double *r = radii;
    vec inertia = {(r[1] * r[1] + r[2] * r[2]) / 5, (r[2] * r[2] + r[0] * r[0]) / 5,
                   (r[0] * r[0] + r[1] * r[1]) / 5};
    vec spin = turn_back(pose, m->spin), torque = turn_back(pose, m->torque);
    torque = add(torque, -1, cross(spin, (vec){inertia.x * spin.x, inertia.y * spin.y, inertia.z * spin.z}));
    vec faster = {torque.x / inertia.x, torque.y / inertia.y, torque.z / inertia.z};
    spin = add(add(spin, step, faster), -step * drag, spin);
    m->spin = turn(pose, spin);
    m->velocity = add(m->velocity, step, m->force);
    pose->translation[0] += step * m->velocity.x;
    pose->translation[1] += step * m->velocity.y;
    pose->translation[2] += step * m->velocity.z;
    spin_pose(pose, m->spin);
}

static fct_result advance(world *w) {
    static fct_body_pair pairs[BODIES * BODIES / 2];
    for (int i = 0; i < BODIES; ++i)
        w->motions[i].force = (vec){0, 0, -gravity}, w->motions[i].torque = (vec){0, 0, 0};
    w->carried = 0;
    fct_result result =
        fct_body_tracker_touching(w->tracker, BODIES, w->bodies, BODIES * BODIES / 2, pairs, &w->pair_count);
    if (result != FCT_OK) return result;
    for (size_t i = 0; i < w->pair_count; ++i) push_apart(w, pairs + i);
    for (int i = 1; i < BODIES; ++i) move_body(&w->bodies[i].pose, w->motions + i);
    ++w->steps;
    return FCT_OK;
}

/* --- Results --- */

static vec place_vertex(const world *w, int body, uint32_t v) {
    const float *p = (body ? &w->pebble : &w->bowl)->mesh.positions + 3 * (size_t)v;
    const fct_pose *pose = &w->bodies[body].pose;
    return add(center_of(pose), 1, turn(pose, (vec){p[0], p[1], p[2]}));
}

static fct_result save_world(const world *w, int number) {
    const fct_mesh *bowl = &w->bowl.mesh, *pebble = &w->pebble.mesh;
    fct_mesh all;
    fct_result result =
        fct_mesh_create(w->env, bowl->vertex_count + (BODIES - 1) * pebble->vertex_count,
                        bowl->face_count + (BODIES - 1) * pebble->face_count, FCT_MESH_FACE_COLORS, &all);
    if (result != FCT_OK) return result;
    uint32_t vertex = 0, face = 0;
    for (int i = 0; i < BODIES; ++i) {
        const fct_mesh *mesh = i ? pebble : bowl;
        for (uint32_t f = 0; f < mesh->face_count; ++f, ++face)
            for (int k = 0; k < 3; ++k) {
                all.triangles[3 * face + k] = vertex + mesh->triangles[3 * f + k];
                all.face_colors[3 * face + k] = i ? .15F + .3F * (float)(i * (k + 2) % 5) / 2 : .5F;
            }
        for (uint32_t v = 0; v < mesh->vertex_count; ++v, ++vertex) {
            vec p = place_vertex(w, i, v);
            float *to = all.positions + 3 * (size_t)vertex;
            to[0] = (float)p.x, to[1] = (float)p.z, to[2] = (float)-p.y;
        }
    }
    char name[32];
    snprintf(name, sizeof name, "falling-%d.ply", number);
    fct_mesh_save_def def = fct_mesh_save_def_default();
    result = fct_mesh_save(w->env, name, &all, &def);
    fct_mesh_release(w->env, &all);
    return result;
}

/* At rest, no pebble moves or has sunk, and the bowl carries the weight of all. */
static bool check_rest(const world *w) {
    double fastest = 0, deepest = 0;
    for (int i = 1; i < BODIES; ++i) {
        fastest = fmax(fastest, sqrt(dot(w->motions[i].velocity, w->motions[i].velocity)));
        for (uint32_t v = 0; v < w->pebble.mesh.vertex_count; ++v) {
            vec p = place_vertex(w, i, v);
            deepest = fmax(deepest, bowl_height(p.x, p.y) - p.z);
        }
    }
    double weight = (BODIES - 1) * gravity;
    printf("fastest %.4f, deepest %.4f, the bowl carries %.1f of %.1f\n", fastest, deepest, w->carried,
           weight);
    return fastest < .02 && deepest < .03 && fabs(w->carried / weight - 1) < .02;
}

static fct_result run_world(world *w) {
    static const int saved[4] = {0, 15, 30, FRAMES};
    fct_result result = FCT_OK;
    for (int frame = 0, number = 0; frame <= FRAMES && result == FCT_OK; ++frame) {
        if (number < 4 && frame == saved[number]) result = save_world(w, number++);
        clock_t start = clock();
        for (int i = 0; i < FRAME_STEPS && result == FCT_OK; ++i) result = advance(w);
        double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
        if (frame % 25 == 0)
            printf("frame %3d: %3zu pairs touch, %.1f ms\n", frame, w->pair_count, 1e3 * seconds);
    }
    return result;
}

static void print_error(void *user, fct_severity severity, const char *text) {
    (void)user;
    if (severity == FCT_MESSAGE_ERROR) fprintf(stderr, "%s\n", text);
}

static void release_shape(const fct_env *env, shape *s) {
    fct_bvh_destroy(s->bvh);
    fct_tree_destroy(s->tree);
    fct_mesh_release(env, &s->mesh);
}

int main(void) {
    fct_env env = fct_env_default();
    env.message = print_error;
    static world w;
    w.env = &env;
    bool good = make_shape(&env, true, &w.bowl) == FCT_OK && make_shape(&env, false, &w.pebble) == FCT_OK &&
                fct_body_tracker_create(&env, &w.tracker) == FCT_OK;
    if (good) {
        place_pebbles(&w);
        good = run_world(&w) == FCT_OK && check_rest(&w);
    }
    fct_body_tracker_destroy(w.tracker);
    release_shape(&env, &w.pebble);
    release_shape(&env, &w.bowl);
    return !good;
}
