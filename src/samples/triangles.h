/* The exact signed distance to a closed surface of triangles, positive inside, as an
 * operation on x, y and z.
 *
 * The triangles stand in a tree of boxes, so that the nearest one is found at a cost by
 * the logarithm of their number; the points of a block are looked at several at a time,
 * and a region of space keeps only the triangles that can be nearest in it.
 *
 * Inside is where the surface winds around a point at least once: that is a matter of the
 * whole surface, and does not change but where the surface is, so that f is continuous
 * whether parts cross each other, lie in each other, or meet at edges of many triangles.
 * It is counted along a ray; a point next to one whose side is known, and nearer to it
 * than to the surface, is on the same side. */
#ifndef ZS_TRIANGLES_H
#define ZS_TRIANGLES_H

#include "field/operation.h"

typedef struct zs_triangle {
  double a[3], ab[3], ac[3]; /* a corner, and the ways to the other two */
  double normal[3];          /* out of the solid, of length 1; 0 without an area */
  uint32_t corner[3];        /* which vertices they are */
} zs_triangle;

/* A node of the tree of boxes; nodes stand in depth-first order. */
typedef struct zs_triangle_box {
  double lo[3], hi[3];
  uint32_t first, count; /* triangles of a leaf; count = 0 for inner nodes */
  uint32_t skip;         /* the node that follows when this one is left out */
} zs_triangle_box;

/* Immutable. */
typedef struct zs_triangles {
  const zs_triangle *triangles;
  const zs_triangle_box *boxes;
  uint32_t count, box_count;
  const double *positions; /* of vertices, 3 each */
  double side;             /* about that of a typical triangle */
  const struct zs_triangles *whole; /* all of the surface: where sides are counted */
} zs_triangles;

/* The surface of `count` triangles, three vertices each, counter-clockwise seen from
 * outside, of vertices with three coordinates, which are taken over.  It must be closed:
 * every edge is run along by as many triangles one way as the other.  NULL when memory is
 * out or no triangle has three different vertices, and the positions are freed;
 * zs_triangles_free takes NULL too. */
zs_triangles *zs_triangles_new(double *positions, const uint32_t *triangles, size_t count);
void zs_triangles_free(void *triangles);

/* The signed distance at a point: NaN of NaN, -INFINITY of infinite coordinates. */
double zs_triangles_distance(const zs_triangles *triangles, const double p[3]);

/* Inputs x, y and z; data: a zs_triangles that lives as long as the field. */
extern const zs_operation zs_triangles_operation;

/* ---- For the kernels ------------------------------------------------------ */

/* A triangle that is not far from a point. */
uint32_t zs_triangles_guess(const zs_triangles *triangles, const double p[3]);

/* The triangle that is nearest to a point; the nearer `guess` is, the sooner it is found. */
uint32_t zs_triangles_nearest(const zs_triangles *triangles, const double p[3], uint32_t guess);

/* The squared distance of a point from a triangle, and the way from its nearest point. */
double zs_triangle_distance2(const zs_triangle *triangle, const double p[3], double from[3]);

/* Whether a point is inside. */
bool zs_triangles_inside(const zs_triangles *triangles, const double p[3]);

ZS_DECLARE_KERNELS(zs_triangles_kernels)

#endif
