/* Polygons: closed rings of points in the plane. */
#ifndef ZS_RINGS_H
#define ZS_RINGS_H

#include "base/diagnostic.h"

typedef struct zs_rings {
  size_t point_count, point_capacity, ring_count, ring_capacity;
  double *points; /* x and y of each; the last of a ring is joined to its first */
  size_t *ends;   /* behind the last point of each ring */
} zs_rings;

/* Read rings from a text file: x and y of a point per line, separated by spaces,
 * tabs, commas or semicolons; a blank line ends a ring; '#' starts a comment.  A
 * last point that repeats the first of its ring is left out.  False after
 * reporting with file and line: unreadable files, malformed lines, no points. */
bool zs_rings_read(zs_rings *rings, const char *path, zs_diag *diag);

/* One ring of `count` points, copied; false after reporting that memory is out. */
bool zs_rings_make(zs_rings *rings, const double *points, size_t count, zs_diag *diag);

/* Add a point to the last ring, and end that ring; the next point begins another.  False
 * when memory is out. */
bool zs_rings_add_point(zs_rings *rings, const double point[2]);
bool zs_rings_end(zs_rings *rings);

void zs_rings_clear(zs_rings *rings);

#endif
