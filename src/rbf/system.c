#include "rbf/system.h"

#include "rbf/product.h"

#include <stdlib.h>
#include <string.h>

zs_rbf_result zs_rbf_result_of(zs_dense_result result)
{
  return result == ZS_DENSE_DONE     ? ZS_RBF_DONE
         : result == ZS_DENSE_MEMORY ? ZS_RBF_MEMORY
                                     : ZS_RBF_SINGULAR;
}

double *zs_rbf_system_monomials(const zs_rbf_system *system)
{
  const size_t n = system->count;
  double *p = malloc(n * system->terms * sizeof *p);
  for (size_t i = 0; p && i < n; i++) {
    double terms[ZS_RBF_MAXIMUM_TERMS];
    zs_rbf_monomials(system->dimension, system->degree, system->points + i * system->dimension,
                     terms);
    for (unsigned k = 0; k < system->terms; k++)
      p[k * n + i] = terms[k];
  }
  return p;
}

void zs_rbf_system_matrix(const zs_rbf_system *system, double *matrix)
{
  enum { PART = 32 }; /* columns */
  const size_t n = system->count;
  zs_rbf_multiply_kernel *multiply = zs_rbf_multiply_select();
  double signs[PART];
  for (size_t j = 0; j < PART; j++)
    signs[j] = zs_rbf_sign(system->radial.kernel);
#pragma omp parallel for schedule(dynamic, 1) num_threads(system->threads)
  for (size_t first = 0; first < n; first += PART) {
    const size_t count = n - first < PART ? n - first : PART;
    multiply(&(zs_rbf_product){.radial = system->radial,
                               .dimension = system->dimension,
                               .target_count = n,
                               .source_count = count,
                               .targets = system->points,
                               .sources = system->points + first * system->dimension,
                               .weights = signs,
                               .matrix = matrix + first * n,
                               .stride = n});
    for (size_t j = first; j < first + count; j++)
      matrix[j * n + j] += system->smoothing;
  }
}

void zs_rbf_system_multiply(const zs_rbf_system *system, const double *d, double *result)
{
  const double sign = zs_rbf_sign(system->radial.kernel);
  memset(result, 0, system->count * sizeof *result);
  zs_rbf_multiply_symmetric(&(zs_rbf_product){.radial = system->radial,
                                              .dimension = system->dimension,
                                              .target_count = system->count,
                                              .source_count = system->count,
                                              .targets = system->points,
                                              .sources = system->points,
                                              .weights = d,
                                              .sums = result},
                            system->threads);
  for (size_t i = 0; i < system->count; i++)
    result[i] = sign * result[i] + system->smoothing * d[i];
}

void zs_rbf_system_roughen(const zs_rbf_system *system, double *residual)
{
  uint32_t random = 1;
  for (size_t i = 0; i < system->count; i++) {
    random = random * UINT32_C(1664525) + UINT32_C(1013904223);
    residual[i] = random >> 31 ? 1 : -1;
  }
}

void zs_rbf_system_coordinates(const zs_span *span, const double *v, double *q)
{
  for (size_t k = 0; k < span->rank; k++) {
    const double *u = span->basis + k * span->n;
    q[k] = 0;
    for (size_t i = 0; i < span->n; i++)
      q[k] += u[i] * v[i];
  }
}

void zs_rbf_system_project(const zs_span *span, double *v)
{
  double q[ZS_RBF_MAXIMUM_TERMS];
  zs_rbf_system_coordinates(span, v, q);
  for (size_t k = 0; k < span->rank; k++) {
    const double *u = span->basis + k * span->n;
    for (size_t i = 0; i < span->n; i++)
      v[i] -= q[k] * u[i];
  }
}
