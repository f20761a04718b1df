#include "rbf/adaptive.h"
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
 * square, after few steps and many points; that of a product's errors, too. */
static const double PEAK = 30;
/* Products within GMRES may be off by this part of what its vectors are, and by this part of
 * the norm that is aimed at when they are added up. */
static const double QUICK = 2e-2, SHARE = 0.6;
/* Errors of products grow from one step of GMRES to the next, whose vectors are rougher: by so
 * much, but more from the first residual of all, which is as smooth as the values are, and to
 * that of a restart, which is the roughest. */
static const double GROWTH = 4, GROWTH_TO_ROUGH = 30;
/* What a restart reduces the residual by at most, unless products are exact: the more, the more
 * accurate the first ones would have to be, and a new residual costs no more than these. */
static const double LEAP = 4e-6;
/* What is left is found so that it is off by at most this part of the tolerance, in the root of
 * the mean square. */
static const double FINE = 0.02;
enum { FINE_ORDER = 13 }; /* of clusters' nodes, which usually does */
/* The part of the progress that making the preconditioner is. */
static const double PREPARATION = 0.4;

typedef struct solver {
  const zs_rbf_job *job;
  zs_rbf_solution *solution;
  zs_schwarz *schwarz;
  zs_span span;
  zs_adaptive products;
  zs_adaptive_series steps, solutions; /* of products with GMRES's vectors, and with weights */
  double *left; /* of the equations, but for polynomials */
  double norm, first, aim; /* of what is left, was at first, and should be */
  double reach;            /* what the present restart aims at */
  double progress; /* the latest fraction */
  bool cancelled;
} solver;

double zs_rbf_iterative_bytes(const zs_rbf_system *system)
{
  const size_t n = system->count;
  return zs_schwarz_bytes(system) + zs_fgmres_bytes(n) + zs_adaptive_bytes(system) +
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
  s->norm = norm;
  return tell(s, PREPARATION + (1 - PREPARATION) * (way > 0 ? way : 0));
}

/* A product with the next of GMRES's vectors.  The smaller what is left is, the less the
 * vector will weigh, and the more it may be off (Simoncini and Szyld, SIAM J. Sci. Comput. 25,
 * 2003). */
static bool multiply(void *context, const double *x, double *result)
{
  solver *s = context;
  const double off = fmin(QUICK, SHARE * s->reach / s->norm) / sqrt((double)s->job->system.count);
  const bool first = s->steps.error == 0;
  if (!zs_adaptive_multiply(&s->products, &s->steps, x, off, result, NULL))
    return false;
  s->steps.growth = first ? GROWTH_TO_ROUGH : s->steps.growth > GROWTH ? 1 : GROWTH;
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

/* What the weights leave of the equations; what approximate products may hide counts as
 * left. */
static bool find_left(solver *s)
{
  const zs_rbf_system *system = &s->job->system;
  zs_fast_errors errors = {0, 0};
  if (!zs_adaptive_multiply(&s->products, &s->solutions, s->solution->weights,
                            FINE * s->job->tolerance, s->left, &errors))
    return false;
  for (size_t i = 0; i < system->count; i++)
    s->left[i] = s->job->values[i] - s->left[i];
  take_polynomial(s);
  const double hidden = fmax(errors.most, PEAK * errors.mean);
  s->solution->left += hidden;
  s->solution->residual += hidden;
  return true;
}

/* Begin with no weights. */
static void begin(solver *s)
{
  const size_t n = s->job->system.count;
  memcpy(s->left, s->job->values, n * sizeof *s->left);
  take_polynomial(s);
  s->first = s->norm;
  s->aim = s->job->tolerance * sqrt((double)n) / PEAK;
}

/* One restart of GMRES, from what is left. */
static bool cycle(solver *s)
{
  const zs_fgmres fgmres = {s->job->system.count, s, multiply, precondition, stepped};
  s->aim = fmin(s->aim, s->norm * 0.3 * s->job->tolerance / s->solution->left);
  s->reach = zs_adaptive_is_exact(&s->job->system) ? s->aim : fmax(s->aim, LEAP * s->norm);
  s->steps.growth = GROWTH_TO_ROUGH;
  const zs_fgmres_result ended =
    zs_fgmres_solve(&fgmres, s->left, s->reach, s->solution->weights);
  return ended != ZS_FGMRES_MEMORY && ended != ZS_FGMRES_STOPPED && find_left(s);
}

/* Cycles until the tolerance is met, or no more is gained. */
static zs_rbf_result iterate(solver *s)
{
  const size_t n = s->job->system.count;
  double *best = malloc(n * sizeof *best);
  bool gaining = true, done = best;
  if (done)
    begin(s);
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
  solver s = {.job = job,
              .solution = solution,
              .products = {.system = &job->system, .clusters = job->clusters},
              .solutions = {.order = FINE_ORDER}};
  memset(solution->weights, 0, job->system.count * sizeof *solution->weights);
  zs_rbf_result result = prepare(&s);
  if (result == ZS_RBF_DONE)
    result = iterate(&s);
  zs_adaptive_clear(&s.products);
  zs_schwarz_free(s.schwarz);
  zs_span_free(&s.span);
  free(s.left);
  return result;
}
