/* Closed outlines of straight edges and arcs of circles. */
#ifndef ZS_ARCS_H
#define ZS_ARCS_H

#include <stdbool.h>
#include <stddef.h>

/* An edge from `from` to where the next one begins.  The bulge is the tangent of a quarter of
 * the angle that an arc takes up, positive to the right of the chord; 0 of a straight edge. */
typedef struct zs_arc_edge {
  double from[2], bulge;
  unsigned pieces; /* to divide it into, or of a piece: how many there are */
  size_t whole;    /* of a piece: the edge that it is of */
} zs_arc_edge;

typedef struct zs_arc_ring {
  zs_arc_edge *edges;
  size_t count;
} zs_arc_ring;

enum { ZS_ARC_MOST_PIECES = 128 };

static inline const zs_arc_edge *zs_arc_next(const zs_arc_ring *r, size_t i)
{
  return &r->edges[i + 1 < r->count ? i + 1 : 0];
}

/* The bulge of an arc from a to b through p; false when that is on the line of the ends. */
bool zs_arc_bulge(const double a[2], const double b[2], const double p[2], double *bulge);

/* The centre of an arc; returns its radius. */
double zs_arc_circle(const double a[2], const double b[2], double bulge, double centre[2]);

/* The point at a fraction t of an arc. */
void zs_arc_point(const double a[2], const double b[2], double bulge, double t, double out[2]);

/* Twice the area inside, negative when the edges go clockwise. */
double zs_arc_area(const zs_arc_ring *r);

/* Let the edges go the other way round. */
void zs_arc_reverse(zs_arc_ring *r);

/* Whether edges meet at corners alone; *memory: whether there was enough to find out. */
bool zs_arc_is_simple(const zs_arc_ring *r, bool *memory);

/* Choose into how many pieces arcs are to be divided for corners to be convex where those of
 * the pieces' chords are. */
void zs_arc_choose_pieces(zs_arc_ring *r);

/* The edges with arcs divided into their pieces; false when memory is out. */
bool zs_arc_divide(const zs_arc_ring *from, zs_arc_ring *to);

#endif
