/* Point sets: text and PLY files. */
#ifndef ZS_POINTS_H
#define ZS_POINTS_H

#include "base/diagnostic.h"

/* Points with what the file says of each. */
typedef struct zs_points {
  size_t count;
  double *positions; /* 3 per point */
  double *normals;   /* 3 per point, of any length; NULL: not in the file */
  double *values;    /* 1 per point; NULL: not in the file */
} zs_points;

/* Read a point set.  A file that starts with "ply" is read as PLY (vertices
 * with properties x y z [nx ny nz] [value]; text and both binary forms); any
 * other is text, a point per line: numbers separated by spaces, tabs, commas or
 * semicolons, in 3 columns x y z, 4 (and a value), 6 (and a normal) or 7 (a
 * normal, then a value), or in the order of a header line of the names x y z
 * nx ny nz value, where columns with other names are ignored.  '#' starts a
 * comment.  The decimal separator is a point.
 *
 * False after reporting with file and line: unreadable or empty files,
 * malformed lines, numbers that are not finite.  The points are then cleared. */
bool zs_points_read(zs_points *points, const char *path, zs_diag *diag);

void zs_points_clear(zs_points *points);

#endif
