/* bvh/near/frame.c: the frame along the principal axes of a map. */
#include "base/math/eigen.h"
#include "bvh/near/mapped.h"

void fct_mapped_frame_make(const float map[12], fct_mapped_frame *out) {
    v3 row[3] = {v3_load(map), v3_load(map + 4), v3_load(map + 8)}, image[3], axis[3];
    double m[6] = {0, 0, 0, 0, 0, 0}, values[3];
    v3 principal[3];
    for (int i = 0; i < 3; ++i) sym3_add_outer(m, 1, row[i]);
    fct_eigen3(m, values, principal);
    for (int i = 0; i < 3; ++i)
        image[i] =
            v3_make(v3_dot(row[0], principal[i]), v3_dot(row[1], principal[i]), v3_dot(row[2], principal[i]));
    /* The images are orthogonal up to rounding. The frame must be so exactly enough for any bound to hold. */
    axis[2] = v3_unit(image[2]);
    axis[1] = v3_unit(v3_sub(image[1], v3_scale(axis[2], v3_dot(image[1], axis[2]))));
    axis[0] = v3_cross(axis[1], axis[2]);
    double size = v3_norm(image[2]);
    out->unit = ldexp(1, -ilogb(size));
    for (int i = 0; i < 3; ++i) {
        v3 a = v3_scale(axis[i], out->unit);
        v3_store(out->rows + 3 * i,
                 v3_add(v3_scale(row[0], a.x), v3_add(v3_scale(row[1], a.y), v3_scale(row[2], a.z))));
    }
}
