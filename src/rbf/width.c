#include "rbf/width.h"

#include <stdlib.h>

/* The widths to try: from half of the unit box down, by these steps. */
static const double WIDEST = 0.5, STEP = 0.8, NARROWEST = 1e-9;
/* Eigenvalues below this part of the diagonal are next to nothing. */
static const double DEFINITE = 1e-7;

enum {
  NEIGHBOURHOOD = 240, /* constraints that lie next to each other in the order of clusters */
  MOST = 9             /* neighbourhoods */
};

/* Whether the equations of a neighbourhood stay definite without a part of their diagonal. */
static zs_dense_result check(const zs_rbf_system *system, size_t first, size_t count, double sigma,
                             double *matrix)
{
  zs_rbf_system part = *system;
  part.radial.rate = 1 / (sigma * sigma);
  part.points += first * part.dimension;
  part.count = count;
  part.smoothing = -DEFINITE;
  double *monomials = zs_rbf_system_monomials(&part);
  if (!monomials)
    return ZS_DENSE_MEMORY;
  zs_dense dense;
  zs_rbf_system_matrix(&part, matrix);
  const zs_dense_result result =
    zs_dense_factorise(&dense, count, part.terms, matrix, monomials);
  zs_dense_free(&dense);
  free(monomials);
  return result;
}

double zs_rbf_choose_width(const zs_rbf_system *system)
{
  const size_t n = system->count, size = n < NEIGHBOURHOOD ? n : NEIGHBOURHOOD;
  const size_t parts = n / size < MOST ? n / size : MOST;
  double *matrix = malloc(size * size * sizeof *matrix), sigma = WIDEST;
  zs_dense_result result = matrix ? ZS_DENSE_DONE : ZS_DENSE_MEMORY;
  /* What is too wide for one neighbourhood needs no trying with the others. */
  for (size_t i = 0; result == ZS_DENSE_DONE && i < parts; i++) {
    const size_t first = parts > 1 ? i * (n - size) / (parts - 1) : 0;
    while ((result = check(system, first, size, sigma, matrix)) == ZS_DENSE_SINGULAR &&
           sigma > NARROWEST)
      sigma *= STEP;
  }
  free(matrix);
  return result == ZS_DENSE_MEMORY ? 0 : sigma;
}
