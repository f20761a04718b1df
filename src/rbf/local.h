/* Factorisations of many small interpolation problems, by many threads.
 *
 * LAPACK libraries have threads of their own, which get in each other's way
 * when all threads of a program call them: these run on the calling thread. */
#ifndef ZS_RBF_LOCAL_H
#define ZS_RBF_LOCAL_H

#include "field/operation.h"

#include <stddef.h>

enum { ZS_LOCAL_BLOCK = 16 }; /* rows and columns come in multiples of it */

/* Rows of the inverse of a symmetric positive definite matrix: its last
 * `inner`.  All matrices are column-major; sizes are multiples of
 * ZS_LOCAL_BLOCK. */
typedef struct zs_local {
  size_t size, inner;
  double *matrix; /* size x size: the lower triangle; overwritten by its Cholesky factor */
  double *rows;   /* inner x size: the result */
} zs_local;

/* What the instruction sets have their own of. */
typedef struct zs_local_kernels {
  /* The Cholesky factor of a symmetric positive definite matrix of any size, whose lower
   * triangle it overwrites; false when the matrix is not positive definite. */
  bool (*factorise)(double *a, size_t stride, size_t n);
  /* False when the matrix is not positive definite. */
  bool (*invert)(const zs_local *local);
  /* c -= a b^T: c is rows x columns, a is rows x depth, b is columns x depth;
   * columns and rows are multiples of ZS_LOCAL_BLOCK. */
  void (*subtract)(double *c, size_t c_stride, size_t rows, size_t columns, const double *a,
                   size_t a_stride, const double *b, size_t b_stride, size_t depth);
  /* sums[i] += sum_j rows[j * inner + i] * values[j] */
  void (*apply)(const float *rows, size_t inner, size_t count, const double *values, double *sums);
} zs_local_kernels;

ZS_DECLARE_VARIANTS(zs_local_kernels, zs_local_table)

/* Those for the machine. */
const zs_local_kernels *zs_local_select(void);

#endif
