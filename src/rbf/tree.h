/* Enclosures of a radial sum over boxes.
 *
 * A sum's own Lipschitz constant is useless: weights of opposite signs, each
 * many times the sum, nearly cancel.  So terms are added up before anything is
 * bounded: the series (rbf/series.h) of the centres about the middle of a cell
 * become one polynomial and a bound for its remainder; centres too near for
 * that are bounded one by one.
 *
 * Cells form octrees over a cube two and a half times as wide as the unit box;
 * those whose enclosure tells no sign are divided further. */
#ifndef ZS_RBF_TREE_H
#define ZS_RBF_TREE_H

#include "rbf/series.h"

typedef struct zs_rbf_tree zs_rbf_tree;

/* Build the enclosures of sum_j weight_j phi(|x - c_j|) + P(x); `polynomial` as
 * in rbf/sum.h.  NULL when memory is out. */
zs_rbf_tree *zs_rbf_tree_new(zs_rbf_kernel kernel, const zs_rbf_centre *centres, size_t count,
                             const double polynomial[10], unsigned threads);
void zs_rbf_tree_free(zs_rbf_tree *tree);

/* An enclosure over a box, for values rounded to single precision; NaN in both
 * ends outside the cube. */
void zs_rbf_tree_bounds(const zs_rbf_tree *tree, const float lo[3], const float hi[3],
                        float result[2]);

/* Bytes held. */
size_t zs_rbf_tree_bytes(const zs_rbf_tree *tree);

#endif
