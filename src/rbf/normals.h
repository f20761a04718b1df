/* Normals of points that have none. */
#ifndef ZS_RBF_NORMALS_H
#define ZS_RBF_NORMALS_H

#include "rbf/constraints.h"

/* Give unit normals to the samples that are to be estimated: the direction in
 * which the nearest neighbours vary least, turned out of the solid.  Turns are
 * handed on from point to point along a minimum spanning tree of the graph of
 * neighbours, whose edges are the shorter the better two normals are mirror
 * images of each other across the plane between their points, as on any arc
 * (Hoppe et al., "Surface reconstruction from unorganized points", 1992, with
 * the mirror instead of parallels).  Each connected part of the graph is taken
 * for the surface of a solid: its point farthest from the middle looks outwards.
 *
 * Samples stay without a normal where neighbours, however few, do not lie along
 * one plane or, in two dimensions, one line.  False after reporting at `place`: fewer than
 * 2 * dimension samples, none of which a normal can be told, memory. */
bool zs_rbf_normals_estimate(zs_rbf_samples *samples, unsigned dimension,
                             const zs_control *control, const zs_place *place, zs_diag *diag);

/* How well two of the normals are each other's mirror images across the plane between their points,
 * 3 coordinates each: 1 when they are, -1 when one of them has to be turned. */
double zs_rbf_normals_agreement(const double *positions, const double *normals, size_t i, size_t j);

#endif
