/* Products with the matrix of a radial kernel, term by term in double
 * precision: the cost is the number of pairs.
 *
 * Points have 2 .. ZS_RBF_MAXIMUM_DIMENSION coordinates each, one point after
 * the other. */
#ifndef ZS_RBF_PRODUCT_H
#define ZS_RBF_PRODUCT_H

#include "field/operation.h"
#include "rbf/kernel.h"

#include <stddef.h>

/* sums[i] += sum_j weights[j] phi (|targets_i - sources_j|), or the matrix. */
typedef struct zs_rbf_product {
  zs_rbf_radial radial;
  unsigned dimension;
  size_t target_count, source_count;
  const double *targets, *sources;
  const double *weights; /* source_count */
  double *sums;          /* target_count */
  /* NULL, or where the matrix goes instead of its product, in columns `stride`
   * apart: matrix[j * stride + i] = weights[j] phi (|targets_i - sources_j|). */
  double *matrix;
  size_t stride;
} zs_rbf_product;

/* Built once per instruction set. */
typedef void zs_rbf_multiply_kernel(const zs_rbf_product *product);
extern zs_rbf_multiply_kernel zs_rbf_multiply_baseline;
#if defined ZS_WITH_X86_KERNELS
extern zs_rbf_multiply_kernel zs_rbf_multiply_avx2, zs_rbf_multiply_avx512;
#endif

/* The one for the machine; it runs on the calling thread. */
zs_rbf_multiply_kernel *zs_rbf_multiply_select(void);

/* The same product by `threads` threads. */
void zs_rbf_multiply(const zs_rbf_product *product, unsigned threads);

#endif
