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

zs_dense_result zs_span_make(zs_span *span, size_t n, size_t terms, const double *p)
{
  const size_t most = n < terms ? n : terms;
  *span = (zs_span){.n = n, .terms = terms};
  double *copy = malloc(n * terms * sizeof *copy);
  span->basis = malloc(n * most * sizeof *span->basis);
  lapack_int status = LAPACK_WORK_MEMORY_ERROR;
  if (copy && span->basis) {
    memcpy(copy, p, n * terms * sizeof *copy);
    status = LAPACKE_dgesdd(LAPACK_COL_MAJOR, 'S', (lapack_int)n, (lapack_int)terms, copy,
                            (lapack_int)n, span->singular, span->basis, (lapack_int)n,
                            span->right, (lapack_int)most);
  }
  free(copy);
  if (status)
    return status > 0 ? ZS_DENSE_SINGULAR : ZS_DENSE_MEMORY;
  while (span->rank < most && span->singular[span->rank] > RANK_TOLERANCE * span->singular[0])
    span->rank++;
  return ZS_DENSE_DONE;
}

void zs_span_free(zs_span *span)
{
  free(span->basis);
  span->basis = NULL;
}

void zs_span_coefficients(const zs_span *span, const double *q, double *c)
{
  const size_t most = span->n < span->terms ? span->n : span->terms;
  memset(c, 0, span->terms * sizeof *c);
  for (size_t k = 0; k < span->rank; k++)
    for (size_t j = 0; j < span->terms; j++)
      c[j] += span->right[j * most + k] * q[k] / span->singular[k];
}

zs_dense_result zs_dense_least(size_t rows, size_t columns, size_t sides, double *a, double *b)
{
  const size_t least = rows < columns ? rows : columns, most = rows < columns ? columns : rows;
  double *singular = malloc(least * sizeof *singular);
  lapack_int rank, status = LAPACK_WORK_MEMORY_ERROR;
  if (singular)
    status = LAPACKE_dgelsd(LAPACK_COL_MAJOR, (lapack_int)rows, (lapack_int)columns,
                            (lapack_int)sides, a, (lapack_int)rows, b, (lapack_int)most, singular,
                            1e-10, &rank);
  free(singular);
  if (status > 0)
    return ZS_DENSE_SINGULAR;
  return status ? ZS_DENSE_MEMORY : ZS_DENSE_DONE;
}

/* Reflectors of an orthogonal Q whose leading columns span P. */
static zs_dense_result decompose_polynomials(zs_dense *dense, size_t n, size_t terms,
                                             const double *p)
{
  zs_dense_result result = zs_span_make(&dense->span, n, terms, p);
  if (result != ZS_DENSE_DONE)
    return result;
  double *basis = dense->span.basis;
  lapack_int status =
    LAPACKE_dgeqrf(LAPACK_COL_MAJOR, (lapack_int)n, (lapack_int)dense->span.rank, basis,
                   (lapack_int)n, dense->tau);
  /* The triangle of an orthonormal matrix is diagonal, of ones up to sign. */
  for (size_t k = 0; k < dense->span.rank; k++)
    dense->sign[k] = basis[k * n + k] < 0 ? -1 : 1;
  return status ? ZS_DENSE_MEMORY : ZS_DENSE_DONE;
}

/* LAPACKE's functions for callers with work space do not look for NaNs first, which would
 * take longer than solving does.  NaNs come out as residuals. */

/* Apply Q or its transpose to a matrix from one side. */
static bool apply(const zs_dense *dense, char side, char transpose, size_t columns, double *matrix)
{
  const lapack_int n = (lapack_int)dense->span.n, rank = (lapack_int)dense->span.rank;
  const double *basis = dense->span.basis;
  double size = 0;
  lapack_int status =
    LAPACKE_dormqr_work(LAPACK_COL_MAJOR, side, transpose, n, (lapack_int)columns, rank, basis, n,
                        dense->tau, matrix, n, &size, -1);
  double *work = malloc((size_t)size * sizeof *work);
  if (status || !work) {
    free(work);
    return false;
  }
  status =
    LAPACKE_dormqr_work(LAPACK_COL_MAJOR, side, transpose, n, (lapack_int)columns, rank, basis, n,
                        dense->tau, matrix, n, work, (lapack_int)size);
  free(work);
  return status == 0;
}

zs_dense_result zs_dense_factorise(zs_dense *dense, size_t n, size_t terms, double *a,
                                   const double *p)
{
  *dense = (zs_dense){.a = a};
  zs_dense_result result = decompose_polynomials(dense, n, terms, p);
  if (result != ZS_DENSE_DONE)
    return result;
  if (!apply(dense, 'L', 'T', n, a) || !apply(dense, 'R', 'N', n, a))
    return ZS_DENSE_MEMORY;
  const size_t rank = dense->span.rank, rest = n - rank;
  if (!rest)
    return ZS_DENSE_DONE;
  lapack_int status = LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (lapack_int)rest,
                                          a + rank * n + rank, (lapack_int)n);
  if (status > 0)
    return ZS_DENSE_SINGULAR;
  return status ? ZS_DENSE_MEMORY : ZS_DENSE_DONE;
}

zs_dense_result zs_dense_solve(const zs_dense *dense, const double *h, double *d, double *c)
{
  const size_t n = dense->span.n, rank = dense->span.rank, rest = n - rank;
  double *q = malloc(n * sizeof *q);
  if (!q)
    return ZS_DENSE_MEMORY;
  memcpy(q, h, n * sizeof *q);
  bool done = apply(dense, 'L', 'T', 1, q);
  memset(d, 0, n * sizeof *d);
  if (rest)
    memcpy(d + rank, q + rank, rest * sizeof *d);
  if (done && rest)
    done = LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', (lapack_int)rest, 1,
                               dense->a + rank * n + rank, (lapack_int)n, d + rank,
                               (lapack_int)rest) == 0;
  /* Q1^T (h - A d), through the block below the leading one. */
  for (size_t k = 0; k < rank; k++)
    for (size_t i = rank; i < n; i++)
      q[k] -= dense->a[k * n + i] * d[i];
  for (size_t k = 0; k < rank; k++)
    q[k] *= dense->sign[k];
  zs_span_coefficients(&dense->span, q, c);
  done = done && apply(dense, 'L', 'N', 1, d);
  free(q);
  return done ? ZS_DENSE_DONE : ZS_DENSE_MEMORY;
}

void zs_dense_free(zs_dense *dense)
{
  zs_span_free(&dense->span);
}
