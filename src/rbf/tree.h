/* Enclosures of a radial sum over boxes.
 *
 * A sum's own Lipschitz constant is useless: weights of opposite signs, each
 * many times the sum, nearly cancel.  So f itself is interpolated in a cell, at a
 * few Chebyshev nodes along each side: the coefficients bound the polynomial, and
 * the highest of them tell what it leaves out.  That is evidence, not proof; it
 * is doubled, and tests look for exceptions.
 *
 * Where Gaussians are too narrow for that, cells enclose nothing: f is unknown there.
 *
 * Cells form octrees over the cube of cells.h; those whose enclosure tells no
 * sign are divided further, down to a hundredth of the unit box. */
#ifndef ZS_RBF_TREE_H
#define ZS_RBF_TREE_H

#include "base/diagnostic.h"

#include <stddef.h>

struct zs_rbf_sum;
typedef struct zs_rbf_tree zs_rbf_tree;

/* Build the enclosures of a sum, of which all but the tree is filled in.  NULL after
 * reporting that memory is out, or cancelled.  `control` may be NULL. */
zs_rbf_tree *zs_rbf_tree_new(const struct zs_rbf_sum *sum, const zs_control *control,
                             zs_diag *diag);
void zs_rbf_tree_free(zs_rbf_tree *tree);

/* An enclosure over a box, for values of the sum and of its restrictions, in
 * single precision too; NaN in both ends outside the cube. */
void zs_rbf_tree_bounds(const zs_rbf_tree *tree, const float lo[3], const float hi[3],
                        float result[2]);

/* Bytes held. */
size_t zs_rbf_tree_bytes(const zs_rbf_tree *tree);

#endif
