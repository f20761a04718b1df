/* Enclosures of a radial sum over boxes.
 *
 * A sum's own Lipschitz constant is useless: weights of opposite signs, each
 * many times the sum, nearly cancel.  So terms are added up before anything is
 * bounded.  About the middle m of a cell, every centre c with |c - m| > h (the
 * radius of the ball around the cell) has a power series there,
 *
 *   phi(|m + t - c|) = sum_k R^(2a - k) |t|^k C_k (cos angle),   R = |m - c|,
 *
 * with Gegenbauer polynomials C_k (and much the same for the logarithmic
 * kernels).  The sum of all series up to degree 8 is one polynomial, with a
 * remainder of at most C |d| R^2a q^9 / (1 - q), q = h / R, per centre.  Centres
 * too near for that are bounded one by one.
 *
 * Cells form octrees over a cube two and a half times as wide as the unit box;
 * those whose enclosure tells no sign are divided further. */
#ifndef ZS_RBF_TREE_H
#define ZS_RBF_TREE_H

#include "field/operation.h"
#include "rbf/kernel.h"

typedef struct zs_rbf_centre zs_rbf_centre;

enum {
  ZS_RBF_DEGREE = 8,  /* of the polynomials */
  ZS_RBF_TAYLOR = 165, /* coefficients up to that degree in three variables */
  ZS_RBF_MOMENTS = 295, /* of a sum about a point: tree.kernel.c */
  ZS_RBF_PARTS = 742 /* of all coefficients, from one moment each */
};

/* How coefficients are laid out: by degree, then by falling power of x, of y. */
typedef struct zs_rbf_layout {
  uint8_t power[ZS_RBF_TAYLOR][3], degree[ZS_RBF_TAYLOR];
  uint8_t lower[ZS_RBF_TAYLOR][3]; /* which has one power less */
  uint8_t index[ZS_RBF_DEGREE + 1][ZS_RBF_DEGREE + 1][ZS_RBF_DEGREE + 1]; /* by powers */
  uint8_t first[ZS_RBF_DEGREE + 2]; /* of each degree, and the end */
  /* Moments, by exponent and then by power of t.t, become coefficients. */
  struct {
    double factor;
    uint16_t moment;
    uint8_t to;
  } part[ZS_RBF_PARTS];
} zs_rbf_layout;

void zs_rbf_layout_init(zs_rbf_layout *layout);

typedef struct zs_rbf_tree zs_rbf_tree;

/* Build the enclosures of sum_j weight_j phi(|x - c_j|) + P(x); `polynomial` as
 * in zs_rbf_sum.  NULL when memory is out. */
zs_rbf_tree *zs_rbf_tree_new(zs_rbf_kernel kernel, const zs_rbf_centre *centres, size_t count,
                             const double polynomial[10], unsigned threads);
void zs_rbf_tree_free(zs_rbf_tree *tree);

/* An enclosure over a box, for values rounded to single precision; NaN in both
 * ends outside the cube. */
void zs_rbf_tree_bounds(const zs_rbf_tree *tree, const float lo[3], const float hi[3],
                        float result[2]);

/* Bytes held. */
size_t zs_rbf_tree_bytes(const zs_rbf_tree *tree);

/* Add to `taylor` the series about `middle` of the listed centres, all away
 * from it.  Built once per instruction set. */
typedef void zs_rbf_expand(const zs_rbf_layout *layout, zs_rbf_kernel kernel,
                           const double middle[3], const zs_rbf_centre *centres,
                           const uint32_t *list, size_t count, double taylor[ZS_RBF_TAYLOR]);
extern zs_rbf_expand zs_rbf_expand_baseline;
#if defined ZS_WITH_X86_KERNELS
extern zs_rbf_expand zs_rbf_expand_avx2, zs_rbf_expand_avx512;
#endif

#endif
