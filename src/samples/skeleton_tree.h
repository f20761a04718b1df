/* Inside the fields about skeletons: vectors, and what is asked of the definition. */
#ifndef ZS_SKELETON_TREE_H
#define ZS_SKELETON_TREE_H

#include "samples/skeleton.h"

static inline double zs_vector_dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void zs_vector_difference(const double a[3], const double b[3], double c[3])
{
  for (int k = 0; k < 3; k++)
    c[k] = a[k] - b[k];
}

static inline void zs_vector_cross(const double a[3], const double b[3], double c[3])
{
  for (int k = 0; k < 3; k++)
    c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* Lengths and areas are in scene units: the integral over u is 1 / radius or 1 / radius^2 of
 * that over the skeleton. */
double zs_skeleton_unit(const zs_skeleton_piece *piece, double radius);

/* f in double precision: the operation's definition. */
double zs_skeleton_reference(const void *data, const double in[]);

#endif
