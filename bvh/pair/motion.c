/* bvh/pair/motion.c: the first contact of a moving body, by conservative advancement (Mirtich 1996).
 *
 * No point of b moves faster than the speed v of its centre plus its angular speed times the radius r of b.
 * So if the surfaces are d apart, they stay apart for the time d / (v + omega r). The search steps by
 * slightly less, until the surfaces are within the tolerance. Far from contact, a distance that may be a
 * fifth too large is enough.
 */
#include "base/math/elementary.h"
#include "bvh/model.h"
#include "bvh/pair/pose.h"

/* Of far distances. */
#define FAR_RELATIVE .2
/* Of the way. Each step takes at least 3/8 of the tolerance, so there are at most 266,667 steps. */
#define LEAST_TOLERANCE 1e-5

/* The turn from one rotation to another, about a unit axis by an angle in [0, pi]. */
typedef struct turn {
    v3 axis;
    double angle;
} turn;

static bool is_rotation(const fct_pose *pose) {
    const double(*m)[3] = pose->rotation;
    for (int i = 0; i < 3; ++i) {
        if (!(fabs(pose->translation[i]) < INFINITY)) return false;
        for (int j = 0; j < 3; ++j) {
            double dot = i == j ? -1 : 0;
            for (int k = 0; k < 3; ++k) dot += m[k][i] * m[k][j];
            if (!(fabs(dot) < 1e-6)) return false;
        }
    }
    return fct_determinant(m) > 0;
}

/* The quaternion w x y z of a rotation: the largest of four candidates, so that nothing cancels (Shepperd
 * 1978). */
static void find_quaternion(const double m[3][3], double q[4]) {
    double trace = m[0][0] + m[1][1] + m[2][2],
           four[4] = {1 + trace, 1 + 2 * m[0][0] - trace, 1 + 2 * m[1][1] - trace, 1 + 2 * m[2][2] - trace};
    double product[4][4] = {{four[0], m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]},
                            {m[2][1] - m[1][2], four[1], m[0][1] + m[1][0], m[0][2] + m[2][0]},
                            {m[0][2] - m[2][0], m[0][1] + m[1][0], four[2], m[1][2] + m[2][1]},
                            {m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], four[3]}};
    int largest = 0;
    for (int i = 1; i < 4; ++i)
        if (four[i] > four[largest]) largest = i;
    double length = 0;
    for (int i = 0; i < 4; ++i) length += product[largest][i] * product[largest][i];
    for (int i = 0; i < 4; ++i) q[i] = product[largest][i] / sqrt(length);
}

static turn find_turn(const double from[3][3], const double to[3][3]) {
    double m[3][3], q[4];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            m[i][j] = 0;
            for (int k = 0; k < 3; ++k) m[i][j] += to[i][k] * from[j][k];
        }
    find_quaternion((const double(*)[3])m, q);
    double sign = q[0] < 0 ? -1 : 1, sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    v3 axis = v3_unit(v3_make(sign * q[1], sign * q[2], sign * q[3]));
    return (turn){axis, 2 * fct_atan2(sine, fabs(q[0]))};
}

static v3 bounds_center(const fct_bvh *b) {
    v3 lower = v3_load(b->bounds.lower), upper = v3_load(b->bounds.upper);
    return v3_scale(v3_add(lower, upper), .5);
}

/* out = (the turn by `share` of its angle) m */
static void apply_turn(const turn *t, double share, const double m[3][3], double out[3][3]) {
    double sine, cosine;
    fct_sine_cosine(share * t->angle, &sine, &cosine);
    for (int j = 0; j < 3; ++j) {
        v3 p = fct_matrix_column(m, j), along = v3_scale(t->axis, (1 - cosine) * v3_dot(t->axis, p));
        p = v3_add(v3_mad(v3_scale(p, cosine), sine, v3_cross(t->axis, p)), along);
        out[0][j] = p.x, out[1][j] = p.y, out[2][j] = p.z;
    }
}

static fct_pose pose_at(const fct_motion *motion, const turn *t, v3 center, double time) {
    if (time <= 0) return motion->from;
    if (time >= 1) return motion->to;
    fct_pose pose;
    apply_turn(t, time, motion->from.rotation, pose.rotation);
    v3 from = fct_pose_apply(&motion->from, center), to = fct_pose_apply(&motion->to, center);
    v3 at = v3_mad(from, time, v3_sub(to, from));
    at = v3_sub(at, fct_rotate(pose.rotation, center));
    pose.translation[0] = at.x, pose.translation[1] = at.y, pose.translation[2] = at.z;
    return pose;
}

fct_pose fct_motion_at(const fct_bvh *b, const fct_motion *motion, double time) {
    turn t = find_turn(motion->from.rotation, motion->to.rotation);
    return pose_at(motion, &t, bounds_center(b), time);
}

bool fct_bvh_first_contact(const fct_bvh *a, const fct_bvh *b, const fct_motion *motion, double tolerance,
                           fct_first_contact *out, fct_visits *visits) {
    if (!is_rotation(&motion->from) || !is_rotation(&motion->to) || !(tolerance > 0)) return false;
    turn t = find_turn(motion->from.rotation, motion->to.rotation);
    v3 center = bounds_center(b);
    double radius = v3_norm(v3_sub(v3_load(b->bounds.upper), center));
    v3 way = v3_sub(fct_pose_apply(&motion->to, center), fct_pose_apply(&motion->from, center));
    double speed = v3_norm(way) + t.angle * radius, time = 0;
    if (!(speed < INFINITY)) return false;
    tolerance = fct_max(tolerance, LEAST_TOLERANCE * speed);
    fct_distance_def def = fct_distance_def_default();
    fct_pair_hint hint = fct_pair_hint_none();
    def.relative = FAR_RELATIVE, def.absolute = tolerance / 8;
    for (;;) {
        fct_pose pose = pose_at(motion, &t, center, time);
        fct_distance nearest;
        /* Faces that are farther apart than the rest of the way do not meet. At the time 1, only contact is
         * found. */
        def.max_distance = speed * (1 - time) + tolerance;
        if (!fct_bvh_distance(a, b, &pose, &def, &hint, &nearest, visits)) return false;
        if (nearest.distance <= tolerance) {
            def.relative = def.absolute = 0;
            fct_bvh_distance(a, b, &pose, &def, &hint, &nearest, visits);
            *out = (fct_first_contact){.time = time, .pose = pose, .nearest = nearest};
            return true;
        }
        double least = (nearest.distance - def.absolute) / (1 + def.relative);
        if (least < tolerance && def.relative > 0) {
            def.relative = 0; /* near contact: measure again */
            continue;
        }
        time = fct_min(time + (least - tolerance / 2) / speed, 1);
    }
}
