/* Dense solution of conditionally positive definite interpolation.
 *
 *   [ A   P ] [d]   [h]      A symmetric n x n, positive definite on the null
 *   [ P^T 0 ] [c] = [0]      space of P^T; P is n x terms, of any rank
 *
 * by projection: with an orthogonal Q whose first `rank` columns span P,
 * d = Q (0, y), and the trailing block of Q^T A Q is positive definite, so that
 * its Cholesky factorisation fails exactly when A is not definite.  A pivoted
 * symmetric factorisation of the whole matrix would hide that.  When P is rank
 * deficient, c is the solution of least norm.
 *
 * All matrices are column-major.  The only file that knows LAPACKE. */
#ifndef ZS_RBF_DENSE_H
#define ZS_RBF_DENSE_H

#include <stdbool.h>
#include <stddef.h>

enum { ZS_DENSE_MAXIMUM_TERMS = 21 }; /* quadratic polynomials in five dimensions */

typedef enum zs_dense_result {
  ZS_DENSE_DONE,
  ZS_DENSE_MEMORY,
  ZS_DENSE_SINGULAR
} zs_dense_result;

/* What the columns of P span: P = U diag (singular) V^T, singular values that
 * are next to nothing taken for 0. */
typedef struct zs_span {
  size_t n, terms, rank;
  double *basis; /* n x rank: U */
  double singular[ZS_DENSE_MAXIMUM_TERMS];
  double right[ZS_DENSE_MAXIMUM_TERMS * ZS_DENSE_MAXIMUM_TERMS]; /* V^T, terms x terms */
} zs_span;

/* P (n x terms) is left alone.  Free with zs_span_free in any case. */
zs_dense_result zs_span_make(zs_span *span, size_t n, size_t terms, const double *p);
void zs_span_free(zs_span *span);

/* The least c (`terms`) for which P c has the coordinates q (`rank`) in U. */
void zs_span_coefficients(const zs_span *span, const double *q, double *c);

/* The least x with A x nearest to b, by singular values: A is rows x columns, its singular
 * values below a 1e-10th of the largest taken for 0; b has max(rows, columns) x `sides` numbers,
 * of whose columns the first `rows` are given and the first `columns` become x.  A is
 * overwritten. */
zs_dense_result zs_dense_least(size_t rows, size_t columns, size_t sides, double *a, double *b);

typedef struct zs_dense {
  zs_span span; /* its basis is overwritten by V, n x rank, of Q = 1 - V T V^T */
  double *a;    /* n x n: the lower triangle of Q^T A Q, its trailing block factorised */
  double t[ZS_DENSE_MAXIMUM_TERMS * ZS_DENSE_MAXIMUM_TERMS]; /* T, rank x rank: upper triangle */
  double sign[ZS_DENSE_MAXIMUM_TERMS]; /* U = Q1 diag(sign) */
} zs_dense;

/* Bytes that a system of n equations works in, the matrix included. */
double zs_dense_bytes(size_t n, size_t terms);

/* Factorise.  `a` (both triangles) is overwritten and stays borrowed; `p` is
 * left alone.  n >= 1, terms >= 1.  Free with zs_dense_free in any case. */
zs_dense_result zs_dense_factorise(zs_dense *dense, size_t n, size_t terms, double *a,
                                   const double *p);

/* Solve for h: d has n entries, c has `terms`. */
zs_dense_result zs_dense_solve(const zs_dense *dense, const double *h, double *d, double *c);

void zs_dense_free(zs_dense *dense);

#endif
