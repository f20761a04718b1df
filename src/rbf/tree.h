/* Enclosures of a radial sum over boxes.
 *
 * A sum's own Lipschitz constant is useless: weights of opposite signs, each
 * many times the sum, nearly cancel.  So terms are added up before anything is
 * bounded: the series (rbf/series.h) of the centres about the middle of a cell
 * become one polynomial and a bound for its remainder; centres too near for
 * that are bounded one by one.
 *
 * Cells form octrees over a cube ten times as wide as the unit box; those
 * whose enclosure tells no sign are divided further. */
#ifndef ZS_RBF_TREE_H
#define ZS_RBF_TREE_H

#include <stddef.h>

struct zs_rbf_sum;
typedef struct zs_rbf_tree zs_rbf_tree;

/* Build the enclosures of a sum, of which all but the tree is filled in;
 * `slope` is the size that its gradients typically have.  NULL when memory is
 * out. */
zs_rbf_tree *zs_rbf_tree_new(const struct zs_rbf_sum *sum, double slope, unsigned threads);
void zs_rbf_tree_free(zs_rbf_tree *tree);

/* An enclosure over a box, for values of the sum and of its restrictions, in
 * single precision too; NaN in both ends outside the cube. */
void zs_rbf_tree_bounds(const zs_rbf_tree *tree, const float lo[3], const float hi[3],
                        float result[2]);

/* Bytes held. */
size_t zs_rbf_tree_bytes(const zs_rbf_tree *tree);

#endif
