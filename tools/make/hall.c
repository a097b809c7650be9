/* tools/make/hall.c: the shell of the museum: a nave under a barrel vault with skylights, two aisles behind
 * columns, and pilasters along the walls.
 *
 * Every surface is a sheet of rectangles between break lines. So neighbours share their edges, and no wall or
 * floor continues behind an object that touches it. Where parts meet, all lengths are multiples of 1/64,
 * which floats store exactly.
 */
#include "tools/make/parts.h"

#include <math.h>
#include <string.h>

#define LENGTH 9.  /* half, along z */
#define WIDTH  6.5 /* half, along x, to the aisles' walls */
#define NAVE   3.5 /* half, inside the architraves */
#define AISLE  4.  /* outer side of the architraves */
#define SPRING 4.75
#define RISE   2.25
#define RIB    .25
#define PI     3.14159265358979323846

enum { ARC = 24, MAX_BREAKS = 160, NONE = -1 };

const double make_column_z[MAKE_BAYS] = {-7.5, -4.5, -1.5, 1.5, 4.5, 7.5};

typedef struct breaks {
    double at[MAX_BREAKS];
    int count;
} breaks;

static void add_break(breaks *b, double at) {
    int k = b->count;
    for (int i = 0; i < b->count; ++i)
        if (b->at[i] == at) return;
    while (k > 0 && b->at[k - 1] > at) b->at[k] = b->at[k - 1], --k;
    b->at[k] = at;
    ++b->count;
}

static void add_breaks(breaks *b, const double *at, int count) {
    for (int i = 0; i < count; ++i) add_break(b, at[i]);
}

static void add_column_breaks(breaks *b) {
    for (int k = 0; k < MAKE_BAYS; ++k)
        add_break(b, make_column_z[k] - MAKE_COLUMN_HALF), add_break(b, make_column_z[k] + MAKE_COLUMN_HALF);
}

static bool is_at_column(double z) {
    for (int k = 0; k < MAKE_BAYS; ++k)
        if (fabs(z - make_column_z[k]) < MAKE_COLUMN_HALF) return true;
    return false;
}

typedef struct sheet {
    breaks u, v;
    make_point (*place)(double u, double v, double w); /* w: constant over the sheet */
    double w;
    int (*part)(double u, double v,
                const void *user); /* the part of the rectangle with this middle, or NONE */
    const void *user;
} sheet;

/* Adds the rectangles of a sheet, with the normal u x v. Rectangles of one part share their vertices. */
static void add_sheet(make_mesh *parts, const sheet *s) {
    static uint32_t ids[MAX_BREAKS][MAX_BREAKS];
    for (int part = 0; part < MAKE_HALL_PARTS; ++part) {
        memset(ids, 255, sizeof ids);
        for (int j = 0; j + 1 < s->v.count; ++j)
            for (int i = 0; i + 1 < s->u.count; ++i) {
                double u = .5 * (s->u.at[i] + s->u.at[i + 1]), v = .5 * (s->v.at[j] + s->v.at[j + 1]);
                if (s->part(u, v, s->user) != part) continue;
                uint32_t corner[4];
                for (int k = 0; k < 4; ++k) {
                    int a = i + (k == 1 || k == 2), b = j + (k >= 2);
                    if (ids[b][a] == FCT_NONE)
                        ids[b][a] = make_vertex(parts + part, s->place(s->u.at[a], s->v.at[b], s->w));
                    corner[k] = ids[b][a];
                }
                make_quad(parts + part, corner[0], corner[1], corner[2], corner[3]);
            }
    }
}

/* --- Floor --- */

typedef struct feet {
    const make_footprint *list;
    uint32_t count;
} feet;

static int pick_floor(double z, double x, const void *user) {
    const feet *f = user;
    if (fabs(x) > WIDTH - RIB && is_at_column(z)) return NONE;
    for (uint32_t k = 0; k < f->count; ++k)
        if (fabs(x - f->list[k].x) < f->list[k].half && fabs(z - f->list[k].z) < f->list[k].half) return NONE;
    return fabs(x) < 1 && fabs(z) < 8 ? MAKE_CARPET : MAKE_FLOOR;
}

static make_point place_zx(double z, double x, double y) {
    return make_p(x, y, z);
}
static make_point place_xz(double x, double z, double y) {
    return make_p(x, y, z);
}
static make_point place_zy(double z, double y, double x) {
    return make_p(x, y, z);
}
static make_point place_yz(double y, double z, double x) {
    return make_p(x, y, z);
}
static make_point place_xy(double x, double y, double z) {
    return make_p(x, y, z);
}
static make_point place_yx(double y, double x, double z) {
    return make_p(x, y, z);
}

static void add_floor(make_mesh *parts, const feet *f) {
    sheet s = {.place = place_zx, .part = pick_floor, .user = f};
    add_breaks(&s.u, (double[]){-LENGTH, -8, 8, LENGTH}, 4);
    add_breaks(&s.v, (double[]){-WIDTH, RIB - WIDTH, -1, 1, WIDTH - RIB, WIDTH}, 6);
    add_column_breaks(&s.u);
    for (uint32_t k = 0; k < f->count; ++k) {
        add_break(&s.u, f->list[k].z - f->list[k].half), add_break(&s.u, f->list[k].z + f->list[k].half);
        add_break(&s.v, f->list[k].x - f->list[k].half), add_break(&s.v, f->list[k].x + f->list[k].half);
    }
    add_sheet(parts, &s);
}

/* --- Aisles --- */

static int pick_right_wall(double z, double y, const void *user) {
    (void)y, (void)user;
    return is_at_column(z) ? NONE : MAKE_WALL_RIGHT;
}
static int pick_left_wall(double y, double z, const void *user) {
    (void)y, (void)user;
    return is_at_column(z) ? NONE : MAKE_WALL_LEFT;
}
static int pick_aisle_ceiling(double x, double z, const void *user) {
    (void)user;
    return fabs(x) > WIDTH - RIB && is_at_column(z) ? NONE : MAKE_CEILING;
}
static int pick_stone(double u, double v, const void *user) {
    (void)u, (void)v, (void)user;
    return MAKE_STONE;
}

static void add_pilasters(make_mesh *parts, int side) {
    for (int k = 0; k < MAKE_BAYS; ++k) {
        double l = make_column_z[k] - MAKE_COLUMN_HALF, u = make_column_z[k] + MAKE_COLUMN_HALF;
        double wall = side * WIDTH, front = side * (WIDTH - RIB), h = MAKE_AISLE_HEIGHT;
        double a = side > 0 ? l : u, b = side > 0 ? u : l; /* from a to b is leftwards for the viewer */
        make_mesh *m = parts + MAKE_STONE;
        make_patch(m, make_p(front, 0, a), make_p(front, 0, b), make_p(front, h, b), make_p(front, h, a));
        make_patch(m, make_p(front, 0, b), make_p(wall, 0, b), make_p(wall, h, b), make_p(front, h, b));
        make_patch(m, make_p(wall, 0, a), make_p(front, 0, a), make_p(front, h, a), make_p(wall, h, a));
    }
}

static int pick_architrave(double x, double z, const void *user) {
    (void)x, (void)user;
    return is_at_column(z) ? NONE : MAKE_STONE;
}

static void add_aisle(make_mesh *parts, int side) {
    bool right = side > 0;
    sheet wall = {.place = right ? place_zy : place_yz,
                  .part = right ? pick_right_wall : pick_left_wall,
                  .w = side * WIDTH};
    breaks *z = right ? &wall.u : &wall.v, *y = right ? &wall.v : &wall.u;
    add_breaks(z, (double[]){-LENGTH, LENGTH}, 2);
    add_column_breaks(z);
    add_breaks(y, (double[]){0, MAKE_AISLE_HEIGHT}, 2);
    add_sheet(parts, &wall);
    add_pilasters(parts, side);

    sheet ceiling = {.place = place_xz, .part = pick_aisle_ceiling, .w = MAKE_AISLE_HEIGHT, .v = *z};
    add_breaks(&ceiling.u, (double[]){side * AISLE, side * (WIDTH - RIB), side * WIDTH}, 3);
    add_sheet(parts, &ceiling);

    sheet under = {.place = place_xz, .part = pick_architrave, .w = MAKE_COLUMN_HEIGHT, .v = *z};
    add_breaks(&under.u, (double[]){side * NAVE, side * AISLE}, 2);
    add_sheet(parts, &under);
    /* The outer face looks to the wall, the inner face into the nave. */
    sheet outer = {.place = right ? place_yz : place_zy, .part = pick_stone, .w = side * AISLE};
    *(right ? &outer.v : &outer.u) = *z;
    add_breaks(right ? &outer.u : &outer.v, (double[]){MAKE_COLUMN_HEIGHT, MAKE_AISLE_HEIGHT}, 2);
    add_sheet(parts, &outer);
    sheet inner = {.place = right ? place_zy : place_yz, .part = pick_stone, .w = side * NAVE};
    *(right ? &inner.u : &inner.v) = *z;
    add_breaks(right ? &inner.v : &inner.u, (double[]){MAKE_COLUMN_HEIGHT, SPRING}, 2);
    add_sheet(parts, &inner);
}

/* --- Vault --- */

/* Point k of ARC on the ellipse of the vault (inset 0) or of its ribs. Both ends are exact. */
static double find_arc_x(int k, double inset) {
    return k == 0 ? NAVE - inset : k == ARC ? inset - NAVE : (NAVE - inset) * cos(PI * k / ARC);
}
static double find_arc_y(int k, double inset) {
    return k == 0 || k == ARC ? SPRING : SPRING + (RISE - inset) * sin(PI * k / ARC);
}
static make_point place_arc(double z, double k, double inset) {
    return make_p(find_arc_x((int)k, inset), find_arc_y((int)k, inset), z);
}

static int pick_vault(double z, double k, const void *user) {
    (void)user;
    if (is_at_column(z)) return NONE;
    double bay = z - 3 * round(z / 3);
    bool light = fabs(bay) < .75 && fabs(z) < 7 && fabs(k - ARC / 2) < 2.5;
    return light ? MAKE_SKYLIGHT : MAKE_CEILING;
}

static void add_vault(make_mesh *parts) {
    sheet s = {.place = place_arc, .part = pick_vault};
    add_breaks(&s.u, (double[]){-LENGTH, LENGTH}, 2);
    add_column_breaks(&s.u);
    for (int bay = -2; bay <= 2; ++bay) add_break(&s.u, 3 * bay - .75), add_break(&s.u, 3 * bay + .75);
    for (int k = 0; k <= ARC; ++k) add_break(&s.v, k);
    add_sheet(parts, &s);
    for (int r = 0; r < MAKE_BAYS; ++r) {
        double l = make_column_z[r] - MAKE_COLUMN_HALF, u = make_column_z[r] + MAKE_COLUMN_HALF;
        sheet rib = {.place = place_arc, .part = pick_stone, .w = RIB, .v = s.v};
        add_breaks(&rib.u, (double[]){l, u}, 2);
        add_sheet(parts, &rib);
        make_mesh *m = parts + MAKE_STONE;
        for (int k = 0; k < ARC; ++k) {
            make_patch(m, place_arc(u, k, RIB), place_arc(u, k, 0), place_arc(u, k + 1, 0),
                       place_arc(u, k + 1, RIB));
            make_patch(m, place_arc(l, k, 0), place_arc(l, k, RIB), place_arc(l, k + 1, RIB),
                       place_arc(l, k + 1, 0));
        }
        for (int side = -1; side <= 1; side += 2) {
            double a = side > 0 ? NAVE - RIB : -NAVE, b = a + RIB;
            make_patch(m, make_p(a, SPRING, l), make_p(b, SPRING, l), make_p(b, SPRING, u),
                       make_p(a, SPRING, u));
        }
    }
}

/* --- Ends --- */

static int pick_end(double x, double y, const void *user) {
    const int *side = user;
    double height = fabs(x) > AISLE ? MAKE_AISLE_HEIGHT : fabs(x) > NAVE ? MAKE_COLUMN_HEIGHT : SPRING;
    if (y > height) return NONE;
    bool panel = *side < 0 && fabs(fabs(x) - 5.25) < .5 && y > .75 && y < 3.25;
    return panel ? (x < 0 ? MAKE_PANEL_WARM : MAKE_PANEL_COOL) : MAKE_WALL_ENDS;
}
static int pick_front(double y, double x, const void *user) {
    return pick_end(x, y, user);
}

static void add_end(make_mesh *parts, const int *side) {
    bool back = *side < 0;
    sheet s = {.place = back ? place_xy : place_yx,
               .part = back ? pick_end : pick_front,
               .w = *side * LENGTH,
               .user = side};
    breaks *x = back ? &s.u : &s.v, *y = back ? &s.v : &s.u;
    for (int k = -1; k <= 1; k += 2)
        add_breaks(x, (double[]){k * WIDTH, k * AISLE, k * NAVE, k * 4.75, k * 5.75}, 5);
    for (int k = 0; k <= ARC; ++k) add_break(x, find_arc_x(k, 0));
    add_breaks(y, (double[]){0, .75, 3.25, MAKE_COLUMN_HEIGHT, MAKE_AISLE_HEIGHT, SPRING}, 6);
    add_sheet(parts, &s);
    make_mesh *m = parts + MAKE_WALL_ENDS;
    for (int k = 0; k < ARC; ++k) { /* the wall under the vault, in strips */
        double z = s.w;
        make_point strip[4] = {make_p(find_arc_x(k + 1, 0), SPRING, z), make_p(find_arc_x(k, 0), SPRING, z),
                               place_arc(z, k, 0), place_arc(z, k + 1, 0)};
        uint32_t ids[4], count = 0;
        for (int i = 0; i < 4; ++i) /* the first and the last strip are triangles */
            if (!(k == 0 && i == 2) && !(k == ARC - 1 && i == 3)) ids[count++] = make_vertex(m, strip[i]);
        for (uint32_t i = 2; i < count; ++i)
            make_triangle(m, ids[0], ids[back ? i - 1 : i], ids[back ? i : i - 1]);
    }
}

void make_hall(make_mesh parts[MAKE_HALL_PARTS], const make_footprint *list, uint32_t count) {
    static const int sides[2] = {-1, 1};
    feet f = {list, count};
    add_floor(parts, &f);
    for (int k = 0; k < 2; ++k) add_aisle(parts, sides[k]);
    add_vault(parts);
    for (int k = 0; k < 2; ++k) add_end(parts, sides + k);
}
