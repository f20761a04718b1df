/* Interpolation on grids of Chebyshev nodes. */
#ifndef ZS_RBF_NODES_H
#define ZS_RBF_NODES_H

#include "field/operation.h"
#include "rbf/fit.h"

enum {
  ZS_NODES_MOST = 14, /* along a side */
  ZS_NODES_ROOM = 4096
};

/* A grid in a box; the last axis is the fastest. */
typedef struct zs_nodes {
  unsigned dimension;
  unsigned side[ZS_RBF_MAXIMUM_DIMENSION]; /* 1 .. ZS_NODES_MOST */
  double lo[ZS_RBF_MAXIMUM_DIMENSION], hi[ZS_RBF_MAXIMUM_DIMENSION];
} zs_nodes;

/* How many nodes there are. */
size_t zs_nodes_count(const zs_nodes *nodes);

/* Their coordinates: count x dimension. */
void zs_nodes_points(const zs_nodes *nodes, double *points);

/* Whether numbers can be brought from either grid to the other at once: what there is in between
 * has a limited size. */
bool zs_nodes_match(const zs_nodes *a, const zs_nodes *b);

/* What the instruction sets have their own of.  All are about the polynomial
 * that has given values at the nodes, at points of the box. */
typedef struct zs_nodes_kernels {
  /* sums[i] += the polynomial's value at point i */
  void (*interpolate)(const zs_nodes *nodes, const double *values, const double *points,
                      size_t count, double *sums);
  /* The transpose: values[node] += the sum over i of weights[i] times the part
   * that the node has in the value at point i. */
  void (*collect)(const zs_nodes *nodes, double *values, const double *points, size_t count,
                  const double *weights);
  /* The same for points that are the nodes of another grid, which match: axis by axis, so that
   * n nodes along each of d axes take d n^(d + 1) steps instead of n^(2 d). */
  void (*interpolate_grid)(const zs_nodes *nodes, const double *values, const zs_nodes *at,
                           double *sums);
  void (*collect_grid)(const zs_nodes *nodes, double *values, const zs_nodes *at,
                       const double *weights);
} zs_nodes_kernels;

ZS_DECLARE_VARIANTS(zs_nodes_kernels, zs_nodes_table)

/* Those for the machine. */
const zs_nodes_kernels *zs_nodes_select(void);

#endif
