/* The boundary of what outlines fill: rings that cross themselves and each other become
 * edges with the inside on their left, each of them once and none of them inside.
 *
 * Edges are cut where they meet, on a lattice 2^40 times finer than the whole, and those
 * are kept that have the inside on one side alone. */
#ifndef ZS_FILL_H
#define ZS_FILL_H

#include <stdbool.h>
#include <stddef.h>

/* Edges from (e[0], e[1]) to (e[2], e[3]).  A zero-initialised one is empty. */
typedef struct zs_fill {
  double (*edges)[4];
  size_t count, capacity;
} zs_fill;

void zs_fill_clear(zs_fill *fill);

/* Add the edges of rings: x and y of points, and where each ring ends among them.  False
 * when memory is out. */
bool zs_fill_add_rings(zs_fill *fill, const double *points, const size_t *ends, size_t rings);

/* Add one edge, unless its ends are one point.  False when memory is out. */
bool zs_fill_add_edge(zs_fill *fill, const double a[2], const double b[2]);

/* Add the edges of another one. */
bool zs_fill_add(zs_fill *fill, const zs_fill *other);

typedef enum zs_fill_result {
  ZS_FILL_DONE,
  ZS_FILL_MEMORY, /* memory is out */
  ZS_FILL_EMPTY,  /* nothing is filled */
  ZS_FILL_UNCLEAR /* edges that nearly lie on each other are too much for its arithmetic */
} zs_fill_result;

/* Leave the boundary of the filled part: by the even-odd rule, or where the edges wind
 * around a point (the nonzero rule).  Takes a time of about n log n for n edges and the
 * crossings among them. */
zs_fill_result zs_fill_resolve(zs_fill *fill, bool even_odd);

/* The edges as rings, in arrays for free(): `points` x and y of each, `ends` behind the
 * last point of each ring.  Of a resolved one.  False when memory is out. */
bool zs_fill_rings(const zs_fill *fill, double **points, size_t **ends, size_t *rings);

#endif
