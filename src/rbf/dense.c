#include "rbf/dense.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Singular values of P below this part of the largest are taken for zero:
 * constraints that are flat to a millionth of their extent are flat. */
static const double RANK_TOLERANCE = 1e-6;

double zs_dense_bytes(size_t n, size_t terms)
{
  double rows = (double)n, columns = (double)terms;
  /* The matrix; P, U and LAPACK's own work; a few vectors. */
  return sizeof(double) * rows * (rows + 3 * columns + 64 + 8);
}

/* Reflectors of an orthogonal Q whose leading columns span P. */
static zs_dense_result decompose_polynomials(zs_dense *dense, const double *p)
{
  const size_t n = dense->n, terms = dense->terms, most = n < terms ? n : terms;
  double *copy = malloc(n * terms * sizeof *copy);
  double *left = malloc(n * most * sizeof *left);
  lapack_int status = LAPACK_WORK_MEMORY_ERROR;
  if (copy && left) {
    memcpy(copy, p, n * terms * sizeof *copy);
    status = LAPACKE_dgesdd(LAPACK_COL_MAJOR, 'S', (lapack_int)n, (lapack_int)terms, copy,
                            (lapack_int)n, dense->singular, left, (lapack_int)n, dense->right,
                            (lapack_int)most);
  }
  free(copy);
  dense->reflectors = left;
  if (status)
    return status > 0 ? ZS_DENSE_SINGULAR : ZS_DENSE_MEMORY;
  dense->rank = 0;
  while (dense->rank < most &&
         dense->singular[dense->rank] > RANK_TOLERANCE * dense->singular[0])
    dense->rank++;
  status = LAPACKE_dgeqrf(LAPACK_COL_MAJOR, (lapack_int)n, (lapack_int)dense->rank, left,
                          (lapack_int)n, dense->tau);
  /* The triangle of an orthonormal matrix is diagonal, of ones up to sign. */
  for (size_t k = 0; k < dense->rank; k++)
    dense->sign[k] = left[k * n + k] < 0 ? -1 : 1;
  return status ? ZS_DENSE_MEMORY : ZS_DENSE_DONE;
}

/* Apply Q or its transpose to a matrix from one side. */
static bool apply(const zs_dense *dense, char side, char transpose, size_t columns, double *matrix)
{
  const lapack_int n = (lapack_int)dense->n;
  return LAPACKE_dormqr(LAPACK_COL_MAJOR, side, transpose, n, (lapack_int)columns,
                        (lapack_int)dense->rank, dense->reflectors, n, dense->tau, matrix, n) == 0;
}

zs_dense_result zs_dense_factorise(zs_dense *dense, size_t n, size_t terms, double *a,
                                   const double *p)
{
  *dense = (zs_dense){.n = n, .terms = terms, .a = a};
  zs_dense_result result = decompose_polynomials(dense, p);
  if (result != ZS_DENSE_DONE)
    return result;
  if (!apply(dense, 'L', 'T', n, a) || !apply(dense, 'R', 'N', n, a))
    return ZS_DENSE_MEMORY;
  const size_t rank = dense->rank, rest = n - rank;
  if (!rest)
    return ZS_DENSE_DONE;
  lapack_int status = LAPACKE_dpotrf(LAPACK_COL_MAJOR, 'L', (lapack_int)rest,
                                     a + rank * n + rank, (lapack_int)n);
  if (status > 0)
    return ZS_DENSE_SINGULAR;
  return status ? ZS_DENSE_MEMORY : ZS_DENSE_DONE;
}

zs_dense_result zs_dense_solve(const zs_dense *dense, const double *h, double *d, double *c)
{
  const size_t n = dense->n, rank = dense->rank, rest = n - rank;
  double *q = malloc(n * sizeof *q);
  if (!q)
    return ZS_DENSE_MEMORY;
  memcpy(q, h, n * sizeof *q);
  bool done = apply(dense, 'L', 'T', 1, q);
  memset(d, 0, n * sizeof *d);
  if (rest)
    memcpy(d + rank, q + rank, rest * sizeof *d);
  if (done && rest)
    done = LAPACKE_dpotrs(LAPACK_COL_MAJOR, 'L', (lapack_int)rest, 1, dense->a + rank * n + rank,
                          (lapack_int)n, d + rank, (lapack_int)rest) == 0;
  /* Q1^T (h - A d), through the block below the leading one. */
  for (size_t k = 0; k < rank; k++)
    for (size_t i = rank; i < n; i++)
      q[k] -= dense->a[k * n + i] * d[i];
  memset(c, 0, dense->terms * sizeof *c);
  const size_t most = n < dense->terms ? n : dense->terms;
  for (size_t k = 0; k < rank; k++)
    for (size_t j = 0; j < dense->terms; j++)
      c[j] += dense->right[j * most + k] * dense->sign[k] * q[k] / dense->singular[k];
  done = done && apply(dense, 'L', 'N', 1, d);
  free(q);
  return done ? ZS_DENSE_DONE : ZS_DENSE_MEMORY;
}

void zs_dense_free(zs_dense *dense)
{
  free(dense->reflectors);
  dense->reflectors = NULL;
}
