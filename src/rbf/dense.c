#include "rbf/dense.h"

#include "rbf/local.h"
#include "rbf/long_vector.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Singular values of P below this part of the largest are taken for zero:
 * constraints that are flat to a millionth of their extent are flat. */
static const double RANK_TOLERANCE = 1e-6;

/* Systems up to this size are factorised by the calling thread: LAPACK libraries have threads,
 * which get in the way of ours where many small systems are solved at once (local.h). */
enum { SMALL = 1500 };

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

/* ---- The orthogonal factor ------------------------------------------------------------------ */

/* Reflectors of an orthogonal Q whose leading columns span P. */
static zs_dense_result decompose_polynomials(zs_dense *dense, size_t n, size_t terms,
                                             const double *p)
{
  double tau[ZS_DENSE_MAXIMUM_TERMS];
  zs_dense_result result = zs_span_make(&dense->span, n, terms, p);
  if (result != ZS_DENSE_DONE)
    return result;
  double *v = dense->span.basis;
  const lapack_int rows = (lapack_int)n, rank = (lapack_int)dense->span.rank;
  if (LAPACKE_dgeqrf(LAPACK_COL_MAJOR, rows, rank, v, rows, tau) ||
      LAPACKE_dlarft(LAPACK_COL_MAJOR, 'F', 'C', rows, rank, v, rows, tau, dense->t, rank))
    return ZS_DENSE_MEMORY;
  for (size_t k = 0; k < dense->span.rank; k++) {
    /* The triangle of an orthonormal matrix is diagonal, of ones up to sign. */
    dense->sign[k] = v[k * n + k] < 0 ? -1 : 1;
    memset(v + k * n, 0, k * sizeof *v);
    v[k * n + k] = 1;
  }
  return ZS_DENSE_DONE;
}

/* out = T in, or with T transposed. */
static void apply_triangle(const zs_dense *dense, bool transposed, const double *in, double *out)
{
  const size_t rank = dense->span.rank;
  for (size_t i = 0; i < rank; i++) {
    out[i] = 0;
    for (size_t k = 0; k < rank; k++)
      out[i] += dense->t[transposed ? i * rank + k : k * rank + i] * in[k];
  }
}

/* Apply Q or its transpose to a vector. */
static void apply(const zs_dense *dense, bool transposed, double *vector)
{
  const size_t n = dense->span.n, rank = dense->span.rank;
  const double *v = dense->span.basis;
  double along[ZS_DENSE_MAXIMUM_TERMS] = {0}, c[ZS_DENSE_MAXIMUM_TERMS];
  for (size_t k = 0; k < rank; k++)
    along[k] = zs_long_dot(n, v + k * n, vector);
  apply_triangle(dense, transposed, along, c);
  for (size_t k = 0; k < rank; k++)
    zs_long_add(n, -c[k], v + k * n, vector);
}

/* Find W = Y T - V (T^T S T) / 2 with Y = A V, S = V^T Y, for which
 *   Q^T A Q = (1 - V T^T V^T) A (1 - V T V^T) = A - W V^T - V W^T. */
static void find_update(const zs_dense *dense, double *y, double *w)
{
  enum { MOST = ZS_DENSE_MAXIMUM_TERMS };
  const size_t n = dense->span.n, rank = dense->span.rank;
  const double *v = dense->span.basis, *t = dense->t;
  double s[MOST][MOST], column[MOST], both[MOST];
  memset(y, 0, n * rank * sizeof *y);
  for (size_t j = 0; j < n; j++)
    for (size_t k = 0; k < rank; k++)
      zs_long_add(n, v[k * n + j], dense->a + j * n, y + k * n);
  for (size_t k = 0; k < rank; k++)
    for (size_t i = 0; i < rank; i++)
      s[i][k] = zs_long_dot(n, v + i * n, y + k * n);
  memset(w, 0, n * rank * sizeof *w);
  for (size_t k = 0; k < rank; k++) {
    for (size_t i = 0; i < rank; i++) {
      column[i] = zs_long_dot(rank, s[i], t + k * rank);
      zs_long_add(n, t[k * rank + i], y + i * n, w + k * n);
    }
    apply_triangle(dense, true, column, both);
    for (size_t i = 0; i < rank; i++)
      zs_long_add(n, -both[i] / 2, v + i * n, w + k * n);
  }
}

/* The lower triangle of Q^T A Q. */
static bool transform(zs_dense *dense)
{
  const size_t n = dense->span.n, rank = dense->span.rank;
  const double *v = dense->span.basis;
  double *y = malloc(2 * n * rank * sizeof *y), *w = y + n * rank;
  if (!y)
    return false;
  find_update(dense, y, w);
  for (size_t j = 0; j < n; j++)
    for (size_t k = 0; k < rank; k++) {
      double *column = dense->a + j * n + j;
      zs_long_add(n - j, -v[k * n + j], w + k * n + j, column);
      zs_long_add(n - j, -w[k * n + j], v + k * n + j, column);
    }
  free(y);
  return true;
}

/* ---- Solution ------------------------------------------------------------------------------- */

zs_dense_result zs_dense_factorise(zs_dense *dense, size_t n, size_t terms, double *a,
                                   const double *p)
{
  *dense = (zs_dense){.a = a};
  zs_dense_result result = decompose_polynomials(dense, n, terms, p);
  if (result != ZS_DENSE_DONE)
    return result;
  if (!transform(dense))
    return ZS_DENSE_MEMORY;
  const size_t rank = dense->span.rank, rest = n - rank;
  if (!rest)
    return ZS_DENSE_DONE;
  double *trailing = a + rank * n + rank;
  if (rest <= SMALL)
    return zs_local_select()->factorise(trailing, n, rest) ? ZS_DENSE_DONE : ZS_DENSE_SINGULAR;
  const lapack_int status =
    LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (lapack_int)rest, trailing, (lapack_int)n);
  return status > 0 ? ZS_DENSE_SINGULAR : status ? ZS_DENSE_MEMORY : ZS_DENSE_DONE;
}

/* x := (L L^T)^-1 x, with L in the trailing block. */
static void solve_triangles(const zs_dense *dense, double *x)
{
  const size_t n = dense->span.n, rank = dense->span.rank, rest = n - rank;
  const double *l = dense->a + rank * n + rank;
  for (size_t j = 0; j < rest; j++) {
    x[j] /= l[j * n + j];
    zs_long_add(rest - j - 1, -x[j], l + j * n + j + 1, x + j + 1);
  }
  for (size_t j = rest; j-- > 0;)
    x[j] = (x[j] - zs_long_dot(rest - j - 1, l + j * n + j + 1, x + j + 1)) / l[j * n + j];
}

zs_dense_result zs_dense_solve(const zs_dense *dense, const double *h, double *d, double *c)
{
  const size_t n = dense->span.n, rank = dense->span.rank;
  double *q = malloc(n * sizeof *q);
  if (!q)
    return ZS_DENSE_MEMORY;
  memcpy(q, h, n * sizeof *q);
  apply(dense, true, q);
  memset(d, 0, rank * sizeof *d);
  memcpy(d + rank, q + rank, (n - rank) * sizeof *d);
  if (rank < n)
    solve_triangles(dense, d + rank);
  /* Q1^T (h - A d), through the block below the leading one. */
  for (size_t k = 0; k < rank; k++) {
    q[k] -= zs_long_dot(n - rank, dense->a + k * n + rank, d + rank);
    q[k] *= dense->sign[k];
  }
  zs_span_coefficients(&dense->span, q, c);
  apply(dense, false, d);
  free(q);
  return ZS_DENSE_DONE;
}

void zs_dense_free(zs_dense *dense)
{
  zs_span_free(&dense->span);
}
