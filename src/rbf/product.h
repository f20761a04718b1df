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
  /* NULL, or what is added up the other way too:
   *   source_sums[j] += sum_i target_weights[i] phi (|targets_i - sources_j|) */
  const double *target_weights; /* target_count */
  double *source_sums;          /* source_count */
} zs_rbf_product;

/* Built once per instruction set. */
typedef void zs_rbf_multiply_kernel(const zs_rbf_product *product);
extern zs_rbf_multiply_kernel zs_rbf_multiply_baseline;
#if defined ZS_WITH_X86_KERNELS
extern zs_rbf_multiply_kernel zs_rbf_multiply_avx2, zs_rbf_multiply_avx512;
#endif

/* The one for the machine; it runs on the calling thread. */
zs_rbf_multiply_kernel *zs_rbf_multiply_select(void);

/* The same product by `threads` threads; of sums by targets. */
void zs_rbf_multiply(const zs_rbf_product *product, unsigned threads);

/* The same where targets and sources are the same points: phi of a pair is found once for both.
 * Sums do not depend on the threads. */
void zs_rbf_multiply_symmetric(const zs_rbf_product *product, unsigned threads);

/* Bytes that it takes meanwhile for so many points; where memory is out it does without, on the
 * calling thread. */
double zs_rbf_multiply_symmetric_bytes(size_t points);

#endif
