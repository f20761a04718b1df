/* The points of a tree that are nearest to a place in space. */
#ifndef ZS_RBF_NEAREST_H
#define ZS_RBF_NEAREST_H

#include "rbf/clusters.h"

enum { ZS_NEAREST_MOST = 12 };

/* What is looked for, and the points so far, nearest first. */
typedef struct zs_nearest {
  const double *from; /* 3 coordinates */
  uint32_t except;    /* a point that does not count; UINT32_MAX: none */
  unsigned most;      /* 1 .. ZS_NEAREST_MOST points */
  unsigned count;
  double square[ZS_NEAREST_MOST]; /* of distances */
  uint32_t point[ZS_NEAREST_MOST]; /* by the order in which they were given */
} zs_nearest;

/* Find `most` points of a tree in three dimensions, or all when it has fewer. */
void zs_nearest_find(zs_nearest *nearest, const zs_rbf_clusters *tree);

/* The square of the distance between a place and the box of a cluster. */
double zs_nearest_gap(const zs_rbf_cluster *cluster, const double from[3]);

#endif
