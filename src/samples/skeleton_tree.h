/* Inside the fields about skeletons: vectors, and what is asked of the definition. */
#ifndef ZS_SKELETON_TREE_H
#define ZS_SKELETON_TREE_H

#include "base/vector3.h"
#include "samples/skeleton.h"

/* Lengths and areas are in scene units: the integral over u is 1 / radius or 1 / radius^2 of
 * that over the skeleton. */
double zs_skeleton_unit(const zs_skeleton_piece *piece, double radius);

/* f in double precision: the operation's definition. */
double zs_skeleton_reference(const void *data, const double in[]);

#endif
