/* One leaf of a level (schwarz.h): the system of its points and of some around them, solved once for
 * the weights of its own. */
#ifndef ZS_RBF_LEAF_H
#define ZS_RBF_LEAF_H

#include "rbf/clusters.h"
#include "rbf/system.h"

enum { ZS_LEAF_POINTS = 80 /* most points of a leaf itself */ };

/* A leaf's points are first .. first + inner of its level. */
typedef struct zs_leaf {
  size_t first, inner, count;
  uint32_t *points; /* count: those of the leaf and those around it */
  float *rows;      /* inner x count, column-major: from residuals to weights */
} zs_leaf;

/* All leaves of a level, with room for what they hold. */
typedef struct zs_leaves {
  zs_leaf *list;
  size_t count;
  uint32_t *points;
  float *rows;
} zs_leaves;

/* Make room for the leaves that so many clusters of the system's points are going to be.  False
 * when memory is out; zs_leaves_clear in any case. */
bool zs_leaves_begin(zs_leaves *leaves, const zs_rbf_system *system,
                     const zs_rbf_cluster *const *clusters, size_t count);
void zs_leaves_clear(zs_leaves *leaves);

/* One thread's memory for making leaves, for free(); NULL when memory is out. */
typedef struct zs_leaf_maker zs_leaf_maker;
zs_leaf_maker *zs_leaf_maker_new(void);
double zs_leaf_maker_bytes(void);

/* Make the leaf that a cluster of the system's points is.  False when its system is singular. */
bool zs_leaf_make(zs_leaf *l, const zs_rbf_system *system, const zs_rbf_clusters *clusters,
                  const zs_rbf_cluster *cluster, zs_leaf_maker *s);

/* The weights of the leaf's points, given the residual at all points of the level. */
void zs_leaf_solve(const zs_leaf *l, const double *residual, double *weights);

/* Bytes that so many leaves of so many points in all hold at most. */
double zs_leaf_bytes(double leaves, double points);

#endif
