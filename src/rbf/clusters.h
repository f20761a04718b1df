/* Points in the order of a tree of boxes: whatever is near in space is near in
 * memory.  Each cluster is cut at its median along its longest side. */
#ifndef ZS_RBF_CLUSTERS_H
#define ZS_RBF_CLUSTERS_H

#include "rbf/fit.h"

typedef struct zs_rbf_cluster {
  size_t first, count; /* of points */
  uint32_t children;   /* the first of two; 0: none */
  double lo[ZS_RBF_MAXIMUM_DIMENSION], hi[ZS_RBF_MAXIMUM_DIMENSION]; /* around the points */
} zs_rbf_cluster;

typedef struct zs_rbf_clusters {
  unsigned dimension;
  size_t count;    /* points */
  double *points;  /* count x dimension, in the order of the tree */
  uint32_t *order; /* which of the given points each one is */
  zs_rbf_cluster *clusters; /* the first one holds all */
  size_t cluster_count;
} zs_rbf_clusters;

/* Cut 1 .. 2^31 points until no cluster has more than `most`.  NULL when memory
 * is out. */
zs_rbf_clusters *zs_rbf_clusters_new(const double *points, size_t count, unsigned dimension,
                                     size_t most);
void zs_rbf_clusters_free(zs_rbf_clusters *clusters);

/* A point, and the square of its distance from something. */
typedef struct zs_rbf_neighbour {
  double square;
  uint32_t point;
} zs_rbf_neighbour;

/* The `count` points outside `cluster` that are nearest to the box of `part`, or
 * all there are, in no particular order; returns how many. */
size_t zs_rbf_clusters_around(const zs_rbf_clusters *clusters, const zs_rbf_cluster *cluster,
                              const zs_rbf_cluster *part, size_t count,
                              zs_rbf_neighbour *around);

/* List the clusters of at most `most` points whose parents have more, in the
 * order of their points; returns how many.  `list` may be NULL, to count. */
size_t zs_rbf_clusters_cut(const zs_rbf_clusters *clusters, size_t most,
                           const zs_rbf_cluster **list);

/* List the smallest clusters inside one; returns how many. */
size_t zs_rbf_clusters_parts(const zs_rbf_clusters *clusters, const zs_rbf_cluster *cluster,
                             const zs_rbf_cluster **list);

#endif
