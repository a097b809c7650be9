/* tools/make/lattice.h: the signs of a field on a lattice, kept only in blocks of 8^3 cells that the surface
 * can reach. */
#ifndef FCT_TOOLS_LATTICE_H
#define FCT_TOOLS_LATTICE_H

#include "tools/make/parts.h"

enum {
    B = 8, /* cells along a block */
    CORNERS = B * B * B,
    LOCAL = B + 1 /* signs along a block, with the next one */
};
enum { OUTSIDE = -1, INSIDE = -2, SURFACE = -3 }; /* states of blocks without a number */

typedef struct make_lattice {
    tool *t;
    const make_field *field;
    double step;
    make_point origin;
    int blocks[3];
    int *index;                   /* block -> its number if it is active, else OUTSIDE or INSIDE */
    int (*places)[3];             /* active block -> its block coordinates */
    uint64_t (*bits)[B];          /* active block -> a bit per corner, 1 inside: word z, bit y * 8 + x */
    uint32_t *bases;              /* active block -> first vertex of its cells */
    uint16_t (*offsets)[CORNERS]; /* active block and cell -> first vertex minus the base; UINT16_MAX: none */
    int active;
} make_lattice;

/* A point in units of the lattice, as a point of the world. */
make_point make_lattice_point(const make_lattice *l, double x, double y, double z);
/* The value of the field at a point of the world. */
double make_lattice_value(const make_lattice *l, make_point p);
/* The number of a neighbour of block b, or its state. */
int make_lattice_neighbour(const make_lattice *l, int b, int dx, int dy, int dz);
/* The signs of a block's corners and of the next corner along each axis. */
void make_lattice_gather(const make_lattice *l, int b, uint8_t sign[LOCAL][LOCAL][LOCAL]);
/* The number of lattice edges that cross the surface: half the number of triangles. */
size_t make_lattice_crossings(const make_lattice *l);
void make_lattice_close(make_lattice *l);
/* The signs on a lattice with the given spacing, without ambiguous faces. False if memory is short; close the
 * lattice in any case. */
bool make_lattice_open(tool *t, const make_field *field, double step, make_lattice *l);

#endif
