/* Random problems for fits, and an independent solution. */
#ifndef ZS_TEST_CLOUDS_H
#define ZS_TEST_CLOUDS_H

#include "../random.h"

#include "rbf/fit.h"

#include <lapacke.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { CLOUD_MAXIMUM = 3000 };

/* A problem with room for its arrays. */
typedef struct cloud {
  zs_rbf_problem problem;
  double positions[CLOUD_MAXIMUM * ZS_RBF_MAXIMUM_DIMENSION], values[CLOUD_MAXIMUM];
} cloud;

static inline double smooth(unsigned dimension, const double *x)
{
  double f = 0.3;
  for (unsigned k = 0; k < dimension; k++)
    f += sin(2 * x[k] + k) + 0.2 * x[k] * x[(k + 1) % dimension];
  return f;
}

/* Of the Gaussians of clouds: some times as far as points are from each other. */
static inline double cloud_sigma(unsigned dimension, size_t count)
{
  return 4 / pow((double)count, 1.0 / dimension);
}

static inline cloud *random_cloud(unsigned dimension, zs_rbf_kernel kernel, size_t count,
                                  uint64_t seed)
{
  cloud *c = calloc(1, sizeof *c);
  assert_non_null(c);
  c->problem = (zs_rbf_problem){.dimension = dimension,
                                .kernel = kernel,
                                .sigma = cloud_sigma(dimension, count),
                                .count = count,
                                .positions = c->positions,
                                .values = c->values};
  for (size_t i = 0; i < count; i++) {
    for (unsigned k = 0; k < dimension; k++)
      c->positions[i * dimension + k] = random_between(&seed, -1, 1);
    c->values[i] = smooth(dimension, c->positions + i * dimension);
  }
  return c;
}

static inline zs_rbf *fitted(const cloud *c)
{
  zs_diag diag = {0};
  zs_rbf *rbf = zs_rbf_fit(&c->problem, NULL, NULL, &diag);
  assert_non_null(rbf);
  assert_int_equal(diag.errors, 0);
  return rbf;
}

static inline zs_rbf_radial radial_of(const zs_rbf_problem *p)
{
  return (zs_rbf_radial){p->kernel, 1 / (p->sigma * p->sigma)};
}

/* The whole bordered system, in the points' own coordinates, by a pivoted
 * symmetric factorisation. */
static inline void solve_bordered(const cloud *c, unsigned degree, double *solution)
{
  const zs_rbf_problem *p = &c->problem;
  double terms[ZS_RBF_MAXIMUM_TERMS];
  const size_t n = p->count, size = n + zs_rbf_monomials(p->dimension, degree, p->positions, terms);
  double *matrix = calloc(size * size, sizeof *matrix);
  lapack_int *pivots = calloc(size, sizeof *pivots);
  assert_non_null(matrix);
  assert_non_null(pivots);
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i < n; i++) {
      double s = 0;
      for (unsigned k = 0; k < p->dimension; k++) {
        double d = p->positions[i * p->dimension + k] - p->positions[j * p->dimension + k];
        s += d * d;
      }
      matrix[j * size + i] = zs_rbf_phi(radial_of(p), s) +
                             (i == j ? zs_rbf_sign(p->kernel) * p->smoothing : 0);
    }
    zs_rbf_monomials(p->dimension, degree, p->positions + j * p->dimension, terms);
    for (size_t k = n; k < size; k++)
      matrix[j * size + k] = matrix[k * size + j] = terms[k - n];
    solution[j] = p->values[j];
  }
  for (size_t k = n; k < size; k++)
    solution[k] = 0;
  assert_int_equal(LAPACKE_dsysv(LAPACK_COL_MAJOR, 'L', (lapack_int)size, 1, matrix,
                                 (lapack_int)size, pivots, solution, (lapack_int)size),
                   0);
  free(matrix);
  free(pivots);
}

static inline double bordered_value(const cloud *c, unsigned degree, const double *solution,
                             const double *x)
{
  const zs_rbf_problem *p = &c->problem;
  double f = 0, terms[ZS_RBF_MAXIMUM_TERMS];
  for (size_t j = 0; j < p->count; j++) {
    double s = 0;
    for (unsigned k = 0; k < p->dimension; k++) {
      double d = x[k] - p->positions[j * p->dimension + k];
      s += d * d;
    }
    f += solution[j] * zs_rbf_phi(radial_of(p), s);
  }
  unsigned count = zs_rbf_monomials(p->dimension, degree, x, terms);
  for (unsigned k = 0; k < count; k++)
    f += solution[p->count + k] * terms[k];
  return f;
}

/* The greatest difference of a fit from the bordered system's solution, at random
 * points of a cube with half the side `reach`. */
static inline double difference_from_bordered(const zs_rbf *rbf, const cloud *c, unsigned degree,
                                              double reach)
{
  double *solution = malloc((CLOUD_MAXIMUM + ZS_RBF_MAXIMUM_TERMS) * sizeof *solution);
  assert_non_null(solution);
  solve_bordered(c, degree, solution);
  uint64_t seed = 3;
  double worst = 0;
  for (int i = 0; i < 100; i++) {
    double x[ZS_RBF_MAXIMUM_DIMENSION];
    for (unsigned k = 0; k < rbf->dimension; k++)
      x[k] = random_between(&seed, -reach, reach);
    worst = fmax(worst, fabs(zs_rbf_value(rbf, x) - bordered_value(c, degree, solution, x)));
  }
  free(solution);
  return worst;
}

#endif
