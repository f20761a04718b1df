#include "rbf/fgmres.h"
#include "rbf/schwarz.h"
#include "rbf/solve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Restarts from the residual itself, each of which must reduce it so much. */
enum { CYCLES = 8 };
static const double REDUCTION = 0.5;
/* The largest part of a residual is about this many times the root of its mean
 * square, after few steps and many points. */
static const double PEAK = 12;
/* The part of the progress that making the preconditioner is. */
static const double PREPARATION = 0.4;

typedef struct solver {
  const zs_rbf_job *job;
  zs_rbf_solution *solution;
  zs_schwarz *schwarz;
  zs_span span;
  double *left; /* of the equations, but for polynomials */
  double first, aim; /* norms of what was left, and should be */
  double progress; /* the latest fraction */
  bool cancelled;
} solver;

double zs_rbf_iterative_bytes(const zs_rbf_system *system)
{
  return zs_schwarz_bytes(system) + zs_fgmres_bytes(system->count) +
         (double)system->count * sizeof(double) * (2 * system->terms + 4);
}

static bool tell(solver *s, double fraction)
{
  s->progress = fmax(s->progress, fmin(fraction, 1));
  s->cancelled = s->cancelled || !s->job->progress(s->job->context, s->progress);
  return !s->cancelled;
}

static bool prepared(void *context, double fraction)
{
  return tell(context, PREPARATION * fraction);
}

static bool stepped(void *context, double norm)
{
  solver *s = context;
  const double way = log(s->first / norm) / log(s->first / s->aim);
  return tell(s, PREPARATION + (1 - PREPARATION) * (way > 0 ? way : 0));
}

static bool multiply(void *context, const double *x, double *result)
{
  solver *s = context;
  zs_rbf_system_multiply(&s->job->system, x, result);
  zs_rbf_system_project(&s->span, result);
  return true;
}

static bool precondition(void *context, const double *r, double *z)
{
  solver *s = context;
  if (!zs_schwarz_apply(s->schwarz, r, z))
    return false;
  zs_rbf_system_project(&s->span, z);
  return true;
}

/* What the weights leave of the equations, the best polynomial with them, and
 * the norm of what is left. */
static double find_left(solver *s)
{
  const zs_rbf_system *system = &s->job->system;
  const size_t n = system->count;
  zs_rbf_solution *solution = s->solution;
  double q[ZS_RBF_MAXIMUM_TERMS], square = 0;
  zs_rbf_system_multiply(system, solution->weights, s->left);
  for (size_t i = 0; i < n; i++)
    s->left[i] = s->job->values[i] - s->left[i];
  zs_rbf_system_coordinates(&s->span, s->left, q);
  zs_span_coefficients(&s->span, q, solution->polynomial);
  zs_rbf_system_project(&s->span, s->left);
  solution->left = solution->residual = 0;
  for (size_t i = 0; i < n; i++) {
    zs_rbf_solution_note(solution, s->left[i], system->smoothing * solution->weights[i]);
    square += s->left[i] * s->left[i];
  }
  return sqrt(square);
}

/* Cycles until the tolerance is met, or no more is gained. */
static zs_rbf_result iterate(solver *s)
{
  const size_t n = s->job->system.count;
  const zs_fgmres fgmres = {n, s, multiply, precondition, stepped};
  const double tolerance = s->job->tolerance;
  double *best = malloc(n * sizeof *best), norm = find_left(s);
  zs_rbf_result result = best ? ZS_RBF_DONE : ZS_RBF_MEMORY;
  s->first = norm;
  s->aim = tolerance * sqrt((double)n) / PEAK;
  for (int cycle = 0; result == ZS_RBF_DONE && cycle < CYCLES && s->solution->left > tolerance;
       cycle++) {
    const double before = s->solution->left;
    const zs_rbf_solution kept = *s->solution;
    memcpy(best, s->solution->weights, n * sizeof *best);
    s->aim = fmin(s->aim, norm * 0.3 * tolerance / before);
    const zs_fgmres_result ended = zs_fgmres_solve(&fgmres, s->left, s->aim, s->solution->weights);
    if (ended == ZS_FGMRES_MEMORY || ended == ZS_FGMRES_STOPPED) {
      result = s->cancelled ? ZS_RBF_CANCELLED : ZS_RBF_MEMORY;
      break;
    }
    norm = find_left(s);
    if (!(s->solution->left < before)) {
      *s->solution = kept;
      memcpy(s->solution->weights, best, n * sizeof *best);
    }
    if (!(s->solution->left < REDUCTION * before))
      break;
  }
  free(best);
  return result;
}

static zs_rbf_result prepare(solver *s)
{
  const zs_rbf_system *system = &s->job->system;
  double *monomials = zs_rbf_system_monomials(system);
  s->left = malloc(system->count * sizeof *s->left);
  zs_rbf_result result = ZS_RBF_MEMORY;
  if (s->left && monomials)
    result = zs_rbf_result_of(zs_span_make(&s->span, system->count, system->terms, monomials));
  free(monomials);
  if (result == ZS_RBF_DONE)
    result = zs_schwarz_new(system, s->job->clusters, prepared, s, &s->schwarz);
  return result;
}

zs_rbf_result zs_rbf_solve_iteratively(const zs_rbf_job *job, zs_rbf_solution *solution)
{
  solver s = {.job = job, .solution = solution};
  memset(solution->weights, 0, job->system.count * sizeof *solution->weights);
  zs_rbf_result result = prepare(&s);
  if (result == ZS_RBF_DONE)
    result = iterate(&s);
  zs_schwarz_free(s.schwarz);
  zs_span_free(&s.span);
  free(s.left);
  return result;
}
