#include "bench/queries/workloads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench/cluster/bench.h"

static double middle(const fct_bounds *b, int k) {
    return ((double)b->lower[k] + (double)b->upper[k]) / 2;
}

static double extent(const fct_bounds *b, int k) {
    return (double)b->upper[k] - (double)b->lower[k];
}

/* --- Rays --- */

void bench_primary_rays(const fct_bvh *bvh, size_t count, fct_ray *rays) {
    fct_bounds b = fct_bvh_bounds(bvh);
    double forward[3] = {-.62, -.48, -.62}, right[3], up[3], half2 = 0;
    for (int k = 0; k < 3; ++k) half2 += extent(&b, k) * extent(&b, k) / 4;
    double flat = hypot(forward[0], forward[2]), distance = 2.5 * sqrt(half2);
    right[0] = -forward[2] / flat, right[1] = 0, right[2] = forward[0] / flat;
    up[0] = right[1] * forward[2] - right[2] * forward[1];
    up[1] = right[2] * forward[0] - right[0] * forward[2];
    up[2] = right[0] * forward[1] - right[1] * forward[0];
    size_t width = (size_t)sqrt((double)count);
    for (size_t i = 0; i < count; ++i) {
        double x = .35 * (2 * ((double)(i % width) + .5) / (double)width - 1);
        double y = .35 * (2 * ((double)(i / width) + .5) / (double)width - 1);
        rays[i] = (fct_ray){.t_min = 0, .t_max = INFINITY};
        for (int k = 0; k < 3; ++k) {
            rays[i].origin[k] = (float)(middle(&b, k) - distance * forward[k]);
            rays[i].direction[k] = (float)(forward[k] + x * right[k] + y * up[k]);
        }
    }
}

void bench_incoherent_rays(const fct_bvh *bvh, size_t count, fct_ray *rays) {
    fct_bounds b = fct_bvh_bounds(bvh);
    bench_dice dice = {5};
    for (size_t i = 0; i < count; ++i) {
        rays[i] = (fct_ray){.t_min = 0, .t_max = INFINITY};
        for (int k = 0; k < 3; ++k) {
            double from = (double)b.lower[k] + extent(&b, k) * bench_unit(&dice);
            double to = (double)b.lower[k] + extent(&b, k) * bench_unit(&dice);
            rays[i].origin[k] = (float)from, rays[i].direction[k] = (float)(to - from);
        }
    }
}

/* --- Points --- */

void bench_near_points(const fct_mesh *mesh, double diagonal, size_t count, float *points) {
    bench_dice dice = {1};
    for (size_t i = 0; i < count; ++i) {
        const uint32_t *t = mesh->triangles + 3 * (size_t)(bench_roll(&dice) % mesh->face_count);
        double u = bench_unit(&dice), v = (1 - u) * bench_unit(&dice), most = .02 * diagonal / sqrt(3);
        for (size_t k = 0; k < 3; ++k) {
            double a = (double)mesh->positions[3 * (size_t)t[0] + k],
                   b = (double)mesh->positions[3 * (size_t)t[1] + k],
                   c = (double)mesh->positions[3 * (size_t)t[2] + k];
            points[3 * i + k] = (float)(a + u * (b - a) + v * (c - a) + most * (2 * bench_unit(&dice) - 1));
        }
    }
}

void bench_box_points(const fct_bvh *bvh, size_t count, float *points) {
    fct_bounds b = fct_bvh_bounds(bvh);
    bench_dice dice = {2};
    for (size_t i = 0; i < 3 * count; ++i)
        points[i] = (float)((double)b.lower[i % 3] + extent(&b, (int)(i % 3)) * bench_unit(&dice));
}

void bench_grid_points(const fct_bvh *bvh, uint32_t side, float *points) {
    fct_bounds b = fct_bvh_bounds(bvh);
    size_t row = side, layer = row * side, count = layer * side;
    for (size_t i = 0; i < count; ++i) {
        size_t cell[3] = {i % row, i / row % row, i / layer};
        for (int k = 0; k < 3; ++k)
            points[3 * i + (size_t)k] =
                (float)(middle(&b, k) + 1.1 * extent(&b, k) * (((double)cell[k] + .5) / side - .5));
    }
}

void bench_move_vertices(const fct_env *env, const fct_mesh *mesh, double most, fct_mesh *out) {
    bench_dice dice = {4};
    bench_check(fct_mesh_create(env, mesh->vertex_count, mesh->face_count, 0, out), "a mesh");
    memcpy(out->triangles, mesh->triangles, 3 * (size_t)mesh->face_count * sizeof *out->triangles);
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; ++i)
        out->positions[i] = (float)((double)mesh->positions[i] + most * (2 * bench_unit(&dice) - 1));
}

/* --- Poses --- */

static double random_normal(bench_dice *dice) {
    double u = 1 - bench_unit(dice), v = bench_unit(dice);
    return sqrt(-2 * log(u)) * cos(2 * 3.141592653589793 * v);
}

static void random_rotation(bench_dice *dice, double r[3][3]) {
    double q[4], length = 0;
    for (int k = 0; k < 4; ++k) q[k] = random_normal(dice), length += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(length);
    double w = q[0], x = q[1], y = q[2], z = q[3];
    r[0][0] = 1 - 2 * (y * y + z * z), r[0][1] = 2 * (x * y - z * w), r[0][2] = 2 * (x * z + y * w);
    r[1][0] = 2 * (x * y + z * w), r[1][1] = 1 - 2 * (x * x + z * z), r[1][2] = 2 * (y * z - x * w);
    r[2][0] = 2 * (x * z - y * w), r[2][1] = 2 * (y * z + x * w), r[2][2] = 1 - 2 * (x * x + y * y);
}

/* Takes the middle of the bounds to `center`. */
static void place_middle(const fct_bounds *b, const double center[3], fct_pose *pose) {
    for (int i = 0; i < 3; ++i) {
        pose->translation[i] = center[i];
        for (int j = 0; j < 3; ++j) pose->translation[i] -= pose->rotation[i][j] * middle(b, j);
    }
}

static void place_away(const fct_bounds *b, const double direction[3], double away, fct_pose *pose) {
    double center[3];
    for (int k = 0; k < 3; ++k) center[k] = middle(b, k) + away * direction[k];
    place_middle(b, center, pose);
}

/* Comes from far away to first contact along the direction, within 1e-5 of the diagonal. 0 if nothing is met.
 */
static double find_contact(const fct_bvh *bvh, double diagonal, const double direction[3], fct_pose *pose) {
    fct_bounds b = fct_bvh_bounds(bvh);
    double out = 1.3 * diagonal, in = out, step = .01 * diagonal;
    for (; in > 0; out = in, in -= step) {
        place_away(&b, direction, in, pose);
        if (fct_bvh_overlap(bvh, bvh, pose, NULL, NULL)) break;
    }
    for (int i = 0; i < 10 && in > 0; ++i) {
        double half = (in + out) / 2;
        place_away(&b, direction, half, pose);
        *(fct_bvh_overlap(bvh, bvh, pose, NULL, NULL) ? &in : &out) = half;
    }
    return fmax(in, 0);
}

void bench_contact_poses(const fct_bvh *bvh, double diagonal, size_t count, fct_pose *touching,
                         fct_pose *apart) {
    fct_bounds b = fct_bvh_bounds(bvh);
    bench_dice dice = {5};
    for (size_t i = 0; i < count;) {
        fct_pose pose;
        double direction[3], length = 0;
        random_rotation(&dice, pose.rotation);
        for (int k = 0; k < 3; ++k)
            direction[k] = random_normal(&dice), length += direction[k] * direction[k];
        for (int k = 0; k < 3; ++k) direction[k] /= sqrt(length);
        double contact = find_contact(bvh, diagonal, direction, &pose);
        if (contact <= 0) continue;
        place_away(&b, direction, contact - .01 * diagonal, &pose);
        touching[i] = pose;
        place_away(&b, direction, contact + .01 * diagonal, &pose);
        apart[i++] = pose;
    }
}

void bench_path(const fct_bvh *bvh, double diagonal, double step, size_t count, fct_pose *poses) {
    const double axis[3] = {.48, .6, .64}, direction[3] = {.36, -.48, .8};
    fct_bounds b = fct_bvh_bounds(bvh);
    double away = 0;
    for (size_t i = 0, out = 0; i < count; ++i) {
        double angle = 2 * step * (double)i, s = sin(angle), c = cos(angle);
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) poses[i].rotation[j][k] = (1 - c) * axis[j] * axis[k] + (j == k) * c;
            poses[i].rotation[j][(j + 1) % 3] -= s * axis[(j + 2) % 3];
            poses[i].rotation[j][(j + 2) % 3] += s * axis[(j + 1) % 3];
        }
        if (i == 0) away = find_contact(bvh, diagonal, direction, &poses[0]) + .01 * diagonal;
        place_away(&b, direction, away, &poses[i]);
        if (out)
            --out;
        else if (fct_bvh_overlap(bvh, bvh, &poses[i], NULL, NULL))
            out = 30;
        away += (out ? step : -step) * diagonal;
    }
}

/* --- Falling bodies --- */

typedef struct faller {
    double center[3], velocity[3];
} faller;

/* A step along the line of their centres, and the speed at which they meet is reversed in part. */
static void push_apart(faller *a, faller *b, double by) {
    double line[3], length = 0, speed = 0;
    for (int k = 0; k < 3; ++k) line[k] = b->center[k] - a->center[k], length += line[k] * line[k];
    length = sqrt(length) + 1e-9 * by;
    for (int k = 0; k < 3; ++k) line[k] /= length, speed += line[k] * (b->velocity[k] - a->velocity[k]);
    double change = speed < 0 ? -.65 * speed : 0;
    for (int k = 0; k < 3; ++k) {
        a->center[k] -= by * line[k], b->center[k] += by * line[k];
        a->velocity[k] -= change * line[k], b->velocity[k] += change * line[k];
    }
}

static void move_faller(faller *f, double diagonal, double wall) {
    f->velocity[2] -= .004 * diagonal;
    for (int k = 0; k < 3; ++k) {
        f->center[k] += f->velocity[k], f->velocity[k] *= .99;
        double low = k == 2 ? 0 : -wall, high = k == 2 ? INFINITY : wall;
        if (f->center[k] < low || f->center[k] > high) {
            f->center[k] = fmin(fmax(f->center[k], low), high);
            f->velocity[k] *= -.3;
        }
    }
}

void bench_falling_poses(const fct_env *env, const fct_bvh *bvh, double diagonal, uint32_t count,
                         uint32_t frames, fct_pose *poses) {
    faller *fallers = bench_allocate(count, sizeof *fallers);
    fct_body *bodies = bench_allocate(count, sizeof *bodies);
    size_t room = 64 * (size_t)count, found;
    fct_body_pair *pairs = bench_allocate(room, sizeof *pairs);
    fct_bounds b = fct_bvh_bounds(bvh);
    uint32_t row = (uint32_t)ceil(cbrt(count));
    double wall = .45 * row * diagonal;
    bench_dice dice = {9};
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t cell[3] = {i % row, i / row % row, i / row / row};
        for (int k = 0; k < 3; ++k)
            fallers[i].center[k] =
                diagonal * (.9 * (cell[k] + (k == 2 ? 1 : .5 - .5 * row)) + .1 * bench_unit(&dice));
        bodies[i].bvh = bvh;
        random_rotation(&dice, bodies[i].pose.rotation);
    }
    for (uint32_t f = 0; f < frames; ++f) {
        for (uint32_t i = 0; i < count; ++i) {
            move_faller(fallers + i, diagonal, wall);
            place_middle(&b, fallers[i].center, &bodies[i].pose);
            poses[(size_t)f * count + i] = bodies[i].pose;
        }
        bench_check(fct_bodies_touching(env, count, bodies, room, pairs, &found), "bodies");
        for (size_t i = 0; i < found && i < room; ++i)
            push_apart(fallers + pairs[i].body_a, fallers + pairs[i].body_b, .01 * diagonal);
    }
    free(pairs), free(bodies), free(fallers);
}
