/* The exact signed distance to the boundary of a plane polygon, positive
 * inside by the even-odd rule, as an operation on x and y.
 *
 * The edges stand in a tree of boxes, so that thousands of vertices cost little
 * more than a few: a block of points looks at the edges that can be nearest to
 * one of its points, unless these are scattered, and a region of the plane keeps
 * only those.  The sign of a point follows from that of a point whose side is
 * known, by counting the edges between the two: there is one beside the edges of
 * each leaf, so that few are.
 */
#ifndef ZS_POLYGON_H
#define ZS_POLYGON_H

#include "field/operation.h"

/* An edge from a to b. */
typedef struct zs_polygon_edge {
  double a[2], b[2];
  double direction[2], length; /* of b - a; the direction has length 1 */
} zs_polygon_edge;

/* A node of the tree of boxes; nodes stand in depth-first order. */
typedef struct zs_polygon_box {
  double lo[2], hi[2];
  uint32_t first, count; /* edges of a leaf; count = 0 for inner nodes */
  uint32_t skip;         /* the node that follows when this one is left out */
} zs_polygon_box;

/* A point that is not on an edge, and whether it is inside. */
typedef struct zs_polygon_witness {
  double at[2];
  bool inside;
} zs_polygon_witness;

/* Immutable. */
typedef struct zs_polygon {
  const zs_polygon_edge *edges;
  const zs_polygon_box *boxes;
  uint32_t edge_count, box_count;
  zs_polygon_witness reference;        /* in single precision */
  const zs_polygon_witness *witnesses; /* near each leaf, by its box; NULL: the reference serves */
} zs_polygon;

/* The closed polygon through `count` points (x, y pairs); its last point is
 * joined to the first.  Edges of no length are dropped.  NULL when memory is
 * out or no edge is left. */
const zs_polygon *zs_polygon_new(zs_arena *arena, const double *points, size_t count);

/* The same for edges from (e[0], e[1]) to (e[2], e[3]), in any order, which are rings
 * together. */
const zs_polygon *zs_polygon_of_edges(zs_arena *arena, double (*edges)[4], size_t count);

/* The signed distance at a point, in time logarithmic in the number of edges, and unless `slope`
 * is NULL its derivatives: on an edge those of its left side. */
double zs_polygon_distance(const zs_polygon *polygon, double x, double y, double slope[2]);

/* Inputs x and y; data: a zs_polygon that lives as long as the field. */
extern const zs_operation zs_polygon_operation;

/* ---- For the kernels ------------------------------------------------------ */

/* A point from which the edges that matter in a box are found. */
typedef struct zs_polygon_view {
  double centre[2]; /* in single precision, inside the box */
  double reach;     /* edges farther from it than this do not matter */
  bool inside;
} zs_polygon_view;

zs_polygon_view zs_polygon_look(const zs_polygon *polygon, const double lo[2], const double hi[2]);

ZS_DECLARE_KERNELS(zs_polygon_kernels)

#endif
