#include "rbf/solve.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What refinement aims at, as a part of the largest value. */
static const double AIM = 1e-10;
enum { REFINEMENTS = 2 };

/* One solution in the making. */
typedef struct solver {
  const zs_rbf_job *job;
  zs_rbf_solution *solution;
  double *matrix, *monomials;
  double *left, *step; /* what a solution leaves over; a correction */
  zs_dense dense;
} solver;

double zs_rbf_direct_bytes(const zs_rbf_system *system)
{
  return zs_dense_bytes(system->count, system->terms);
}

/* What the solution leaves of the equations. */
static void find_left(const solver *s)
{
  const zs_rbf_system *system = &s->job->system;
  zs_rbf_solution *solution = s->solution;
  zs_rbf_system_multiply(system, solution->weights, s->left);
  solution->left = solution->residual = 0;
  for (size_t i = 0; i < system->count; i++) {
    double sum = s->left[i];
    for (unsigned k = 0; k < system->terms; k++)
      sum += s->monomials[k * system->count + i] * solution->polynomial[k];
    s->left[i] = s->job->values[i] - sum;
    zs_rbf_solution_note(solution, s->left[i], system->smoothing * solution->weights[i]);
  }
}

/* Add the solution for what is left. */
static bool correct(const solver *s)
{
  double c[ZS_RBF_MAXIMUM_TERMS];
  if (zs_dense_solve(&s->dense, s->left, s->step, c) != ZS_DENSE_DONE)
    return false;
  for (size_t i = 0; i < s->job->system.count; i++)
    s->solution->weights[i] += s->step[i];
  for (unsigned k = 0; k < s->job->system.terms; k++)
    s->solution->polynomial[k] += c[k];
  find_left(s);
  return true;
}

static zs_rbf_result refine(const solver *s)
{
  memcpy(s->left, s->job->values, s->job->system.count * sizeof *s->left);
  if (!correct(s))
    return ZS_RBF_MEMORY;
  for (int i = 0; i < REFINEMENTS && s->solution->left > AIM * s->job->largest; i++)
    if (!correct(s))
      return ZS_RBF_MEMORY;
  return ZS_RBF_DONE;
}

static zs_rbf_result solve(solver *s)
{
  const zs_rbf_job *job = s->job;
  zs_rbf_system_matrix(&job->system, s->matrix);
  if (!job->progress(job->context, 0.1))
    return ZS_RBF_CANCELLED;
  zs_rbf_result result = zs_rbf_result_of(zs_dense_factorise(
    &s->dense, job->system.count, job->system.terms, s->matrix, s->monomials));
  if (result == ZS_RBF_DONE && !job->progress(job->context, 0.9))
    result = ZS_RBF_CANCELLED;
  if (result == ZS_RBF_DONE)
    result = refine(s);
  zs_dense_free(&s->dense);
  return result;
}

zs_rbf_result zs_rbf_solve_directly(const zs_rbf_job *job, zs_rbf_solution *solution)
{
  const size_t n = job->system.count;
  solver s = {.job = job, .solution = solution};
  memset(solution->weights, 0, n * sizeof *solution->weights);
  memset(solution->polynomial, 0, sizeof solution->polynomial);
  s.matrix = zs_memory_new(n * n, sizeof *s.matrix);
  s.monomials = zs_rbf_system_monomials(&job->system);
  s.left = malloc(n * sizeof *s.left);
  s.step = malloc(n * sizeof *s.step);
  zs_rbf_result result = ZS_RBF_MEMORY;
  if (s.matrix && s.monomials && s.left && s.step)
    result = solve(&s);
  free(s.matrix);
  free(s.monomials);
  free(s.left);
  free(s.step);
  return result;
}
