#include "rbf/fast.h"
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
static const double PEAK = 30;
/* From so many constraints on, products take clusters together.  Those within
 * GMRES may be off by this part of the residual; those that the residual is
 * found with, by this part of the tolerance.  Up to EXACT constraints the last
 * residual is found by summing all pairs, beyond at a sample only. */
enum { FAST = 12000, EXACT = 250000 };
static const double QUICK = 1e-2, FINE = 0.1;
/* The part of the progress that making the preconditioner is. */
static const double PREPARATION = 0.4;

typedef struct solver {
  const zs_rbf_job *job;
  zs_rbf_solution *solution;
  zs_schwarz *schwarz;
  zs_span span;
  zs_fast *quick, *fine; /* NULL: sums of all pairs */
  double *left; /* of the equations, but for polynomials */
  double norm, first, aim; /* of what is left, was at first, and should be */
  double progress; /* the latest fraction */
  bool cancelled;
} solver;

double zs_rbf_iterative_bytes(const zs_rbf_system *system)
{
  const size_t n = system->count;
  const double fast = n < FAST ? 0 : n > EXACT ? 2 : 1;
  return zs_schwarz_bytes(system) + zs_fgmres_bytes(n) +
         fast * zs_fast_bytes(n, system->dimension) +
         (double)n * sizeof(double) * (2 * system->terms + 5);
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

/* result = (A + mu) d, by clusters or, without, by pairs. */
static bool multiply_by(const solver *s, zs_fast *fast, const double *d, double *result)
{
  const zs_rbf_system *system = &s->job->system;
  const double sign = zs_rbf_sign(system->radial.kernel);
  if (!fast) {
    zs_rbf_system_multiply(system, d, result);
    return true;
  }
  memset(result, 0, system->count * sizeof *result);
  if (!zs_fast_multiply(fast, d, result))
    return false;
  for (size_t i = 0; i < system->count; i++)
    result[i] = sign * result[i] + system->smoothing * d[i];
  return true;
}

static bool multiply(void *context, const double *x, double *result)
{
  solver *s = context;
  if (!multiply_by(s, s->quick, x, result))
    return false;
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

/* Given h - (A + mu) d in `left`: the best polynomial with these weights, what is
 * left then, and its norm. */
static void take_polynomial(solver *s)
{
  const zs_rbf_system *system = &s->job->system;
  zs_rbf_solution *solution = s->solution;
  double q[ZS_RBF_MAXIMUM_TERMS], square = 0;
  zs_rbf_system_coordinates(&s->span, s->left, q);
  zs_span_coefficients(&s->span, q, solution->polynomial);
  zs_rbf_system_project(&s->span, s->left);
  solution->left = solution->residual = 0;
  for (size_t i = 0; i < system->count; i++) {
    zs_rbf_solution_note(solution, s->left[i], system->smoothing * solution->weights[i]);
    square += s->left[i] * s->left[i];
  }
  s->norm = sqrt(square);
}

/* What the weights leave of the equations. */
static bool find_left(solver *s, zs_fast *fast)
{
  if (!multiply_by(s, fast, s->solution->weights, s->left))
    return false;
  for (size_t i = 0; i < s->job->system.count; i++)
    s->left[i] = s->job->values[i] - s->left[i];
  take_polynomial(s);
  return true;
}

/* Find what is left; what approximate products may hide counts as left. */
static bool find_true_left(solver *s)
{
  if (!find_left(s, s->fine))
    return false;
  if (!s->fine)
    return true;
  const double error = zs_fast_check(s->fine, s->solution->weights).most;
  s->solution->left += error;
  s->solution->residual += error;
  return true;
}

/* Weights for residuals of random sign, the roughest that products will see:
 * neighbouring weights nearly cancel, and errors show most. */
static bool make_rough_weights(solver *s, double *residual, double *weights)
{
  uint32_t random = 1;
  for (size_t i = 0; i < s->job->system.count; i++) {
    random = random * UINT32_C(1664525) + UINT32_C(1013904223);
    residual[i] = random >> 31 ? 1 : -1;
  }
  zs_rbf_system_project(&s->span, residual);
  return precondition(s, residual, weights);
}

/* Choose products that take clusters together. */
static bool choose_products(solver *s)
{
  const zs_rbf_system *system = &s->job->system;
  const zs_rbf_clusters *clusters = s->job->clusters;
  const size_t n = system->count;
  double *weights = malloc(n * sizeof *weights);
  const bool done = weights && make_rough_weights(s, s->left, weights);
  if (done)
    s->quick = zs_fast_choose(system->radial, clusters, clusters, weights, QUICK,
                              system->threads);
  if (done && n > EXACT)
    /* For the final weights, whose residual is of the values' own size. */
    s->fine = zs_fast_choose(system->radial, clusters, clusters, weights,
                             FINE * s->job->tolerance / (PEAK * s->job->largest),
                             system->threads);
  free(weights);
  return done;
}

/* Begin with no weights. */
static bool begin(solver *s)
{
  const size_t n = s->job->system.count;
  if (n >= FAST && !choose_products(s))
    return false;
  memcpy(s->left, s->job->values, n * sizeof *s->left);
  take_polynomial(s);
  s->first = s->norm;
  s->aim = s->job->tolerance * sqrt((double)n) / PEAK;
  return true;
}

/* The norm that GMRES can reach from what is left: inexact products hide the
 * rest.  (The errors of later steps, of rougher vectors, are larger, but weigh
 * less; see Simoncini and Szyld, SIAM J. Sci. Comput. 25, 2003.) */
static bool find_reach(solver *s, double *reach)
{
  const size_t n = s->job->system.count;
  *reach = s->aim;
  if (!s->quick)
    return true;
  double *z = malloc(n * sizeof *z);
  const bool done = z && precondition(s, s->left, z);
  if (done)
    *reach = fmax(s->aim, zs_fast_check(s->quick, z).mean * sqrt((double)n));
  free(z);
  return done;
}

/* One restart of GMRES, from what is left. */
static bool cycle(solver *s)
{
  double reach;
  const zs_fgmres fgmres = {s->job->system.count, s, multiply, precondition, stepped};
  s->aim = fmin(s->aim, s->norm * 0.3 * s->job->tolerance / s->solution->left);
  if (!find_reach(s, &reach))
    return false;
  const zs_fgmres_result ended =
    zs_fgmres_solve(&fgmres, s->left, reach, s->solution->weights);
  return ended != ZS_FGMRES_MEMORY && ended != ZS_FGMRES_STOPPED && find_true_left(s);
}

/* Cycles until the tolerance is met, or no more is gained. */
static zs_rbf_result iterate(solver *s)
{
  const size_t n = s->job->system.count;
  double *best = malloc(n * sizeof *best);
  bool gaining = true, done = best && begin(s);
  for (int i = 0; done && gaining && i < CYCLES && s->solution->left > s->job->tolerance; i++) {
    const zs_rbf_solution before = *s->solution;
    memcpy(best, s->solution->weights, n * sizeof *best);
    done = cycle(s);
    gaining = s->solution->left < REDUCTION * before.left;
    if (!(s->solution->left < before.left)) {
      *s->solution = before;
      memcpy(s->solution->weights, best, n * sizeof *best);
    }
  }
  free(best);
  return done ? ZS_RBF_DONE : s->cancelled ? ZS_RBF_CANCELLED : ZS_RBF_MEMORY;
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
  zs_fast_free(s.quick);
  zs_fast_free(s.fine);
  zs_schwarz_free(s.schwarz);
  zs_span_free(&s.span);
  free(s.left);
  return result;
}
