#include "rbf/fit.h"

#include "field/program.h"
#include "rbf/distinct.h"
#include "rbf/poll.h"
#include "rbf/product.h"
#include "rbf/schwarz.h"
#include "rbf/solve.h"
#include "rbf/width.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Residuals as parts of the largest value: what is asked for by default, and
 * what is no answer any more. */
static const double TOLERANCE = 1e-6, USELESS = 1e-4;

/* A smaller fit is done directly, which takes less time; a larger one that
 * cannot be met by iterations is tried directly up to so many constraints. */
enum { DIRECT = 700, DIRECT_AT_MOST = 20000 };

/* So few constraints are done by one thread before others are awake. */
enum { ONE_THREAD = 300 };

/* A fit being made. */
typedef struct fitter {
  const zs_rbf_problem *problem;
  const zs_control *control;
  const zs_place *place;
  zs_diag *diag;
  zs_rbf *rbf;
  zs_rbf_distinct distinct;
  zs_rbf_clusters *clusters;
  double *values; /* in the order of the clusters */
  double from, to; /* the part of the progress that the present solver is */
  zs_rbf_solution solution;
} fitter;

unsigned zs_rbf_monomials(unsigned dimension, unsigned degree, const double *u, double *terms)
{
  unsigned n = 0;
  terms[n++] = 1;
  if (degree >= 1)
    for (unsigned i = 0; i < dimension; i++)
      terms[n++] = u[i];
  if (degree >= 2)
    for (unsigned i = 0; i < dimension; i++)
      for (unsigned j = i; j < dimension; j++)
        terms[n++] = u[i] * u[j];
  return n;
}

double zs_rbf_value(const zs_rbf *rbf, const double *point)
{
  const unsigned dimension = rbf->dimension;
  double u[ZS_RBF_MAXIMUM_DIMENSION], terms[ZS_RBF_MAXIMUM_TERMS], f = 0;
  for (unsigned k = 0; k < dimension; k++)
    u[k] = (point[k] - rbf->centre[k]) / rbf->size;
  for (size_t j = 0; j < rbf->count; j++) {
    double square = 0;
    for (unsigned k = 0; k < dimension; k++) {
      const double difference = u[k] - rbf->centres[j * dimension + k];
      square += difference * difference;
    }
    f += rbf->weights[j] * zs_rbf_phi(rbf->radial, square);
  }
  zs_rbf_monomials(dimension, rbf->terms > dimension + 1 ? 2 : 1, u, terms);
  for (unsigned k = 0; k < rbf->terms; k++)
    f += rbf->polynomial[k] * terms[k];
  return f;
}

bool zs_rbf_values(const zs_rbf *rbf, const double *points, size_t count, double *values,
                   const zs_control *control, zs_diag *diag)
{
  enum { ROUND = 1024 }; /* points between two questions whether to go on */
  const unsigned dimension = rbf->dimension, degree = rbf->terms > dimension + 1 ? 2 : 1;
  double *u = malloc((count * dimension + 1) * sizeof *u), terms[ZS_RBF_MAXIMUM_TERMS];
  zs_rbf_poll poll = {.control = control, .stage = "values"};
  if (!u)
    return zs_fail_memory(diag);
  for (size_t i = 0; i < count; i++) {
    double *at = u + i * dimension;
    for (unsigned k = 0; k < dimension; k++)
      at[k] = (points[i * dimension + k] - rbf->centre[k]) / rbf->size;
    zs_rbf_monomials(dimension, degree, at, terms);
    values[i] = 0;
    for (unsigned k = 0; k < rbf->terms; k++)
      values[i] += rbf->polynomial[k] * terms[k];
  }
  bool going = zs_rbf_poll_begin(&poll, count, 0, 1);
  for (size_t i = 0; going && i < count; i += ROUND) {
    const size_t some = count - i < ROUND ? count - i : ROUND;
    zs_rbf_multiply(&(zs_rbf_product){.radial = rbf->radial,
                                      .dimension = dimension,
                                      .target_count = some,
                                      .source_count = rbf->count,
                                      .targets = u + i * dimension,
                                      .sources = rbf->centres,
                                      .weights = rbf->weights,
                                      .sums = values + i},
                    zs_control_threads(control));
    going = zs_rbf_poll_rounds(&poll, some);
  }
  free(u);
  return going || zs_rbf_poll_fail(&poll, diag);
}

/* ---- Reports ----------------------------------------------------------------------- */

static bool progress(void *context, double fraction)
{
  const fitter *f = context;
  const zs_control *control = f->control;
  return !control || !control->progress ||
         control->progress(control->context, "fitting", f->from + (f->to - f->from) * fraction);
}

static bool fail_cancelled(const fitter *f)
{
  return zs_fail(f->diag, ZS_CANCELLED, NULL, "cancelled");
}

static bool fail_singular(const fitter *f)
{
  if (f->problem->kernel == ZS_RBF_GAUSSIAN)
    return zs_report(f->diag, ZS_ERROR, ZS_ERROR_UNABLE, f->place,
                     "give a smaller sigma, or smoothing=\"1e-8\"",
                     "the fit is singular: constraints are too close together for Gaussians of "
                     "width %.3g", f->rbf->size / sqrt(f->rbf->radial.rate));
  return zs_report(f->diag, ZS_ERROR, ZS_ERROR_UNABLE, f->place,
                   "remove constraints that nearly coincide, or give smoothing=\"1e-8\"",
                   "the fit is singular: constraints are too close together");
}

static bool fail(const fitter *f, zs_rbf_result result)
{
  return result == ZS_RBF_MEMORY      ? zs_fail_memory(f->diag)
         : result == ZS_RBF_CANCELLED ? fail_cancelled(f)
                                      : fail_singular(f);
}

/* ---- The ladder -------------------------------------------------------------------- */

typedef zs_rbf_result solver(const zs_rbf_job *job, zs_rbf_solution *solution);

/* One way to solve. */
typedef struct rung {
  const char *name;
  solver *solve;
  double (*bytes)(const zs_rbf_system *system);
} rung;

static const rung direct = {"dense", zs_rbf_solve_directly, zs_rbf_direct_bytes};
static const rung iterative = {"iterative", zs_rbf_solve_iteratively, zs_rbf_iterative_bytes};

/* Solve in one way, and keep the solution when it is better than the one there. */
static zs_rbf_result climb(fitter *f, const rung *r, const zs_rbf_job *job)
{
  const size_t n = job->system.count;
  zs_rbf_solution solution = {.weights = malloc(n * sizeof *solution.weights)};
  if (!solution.weights)
    return ZS_RBF_MEMORY;
  const zs_rbf_result result = r->solve(job, &solution);
  if (result == ZS_RBF_DONE && solution.left < f->solution.left) {
    free(f->solution.weights);
    f->solution = solution;
    f->rbf->method = r->name;
    f->rbf->bytes = (uint64_t)r->bytes(&job->system);
  } else {
    free(solution.weights);
  }
  return result;
}

static bool fail_limit(const fitter *f, const rung *r, const zs_rbf_job *job)
{
  return zs_report(f->diag, ZS_ERROR, ZS_ERROR_MEMORY, f->place, NULL,
                   "fitting %zu constraints needs %.0f MB, more than the memory limit of %.0f MB",
                   job->system.count, r->bytes(&job->system) / 1e6,
                   (double)f->control->memory_limit / 1e6);
}

/* Iterations may end before the tolerance is met, where the constraints are very
 * uneven: then a direct solution is worth its time. */
static bool solve(fitter *f, const zs_rbf_job *job)
{
  const bool small = job->system.count <= DIRECT;
  const rung *first = small ? &direct : &iterative;
  if (!zs_control_allows(f->control, first->bytes(&job->system)))
    return fail_limit(f, first, job);
  f->to = small ? 1 : 0.5;
  const zs_rbf_result result = climb(f, first, job);
  if (result > ZS_RBF_SINGULAR)
    return fail(f, result);
  f->from = f->to;
  f->to = 1;
  if (small || f->solution.left <= job->tolerance || job->system.count > DIRECT_AT_MOST ||
      !zs_control_allows(f->control, direct.bytes(&job->system)))
    return true;
  const zs_rbf_result again = climb(f, &direct, job);
  return again <= ZS_RBF_SINGULAR || fail(f, again);
}

/* The iterations do not come near enough, and there are too many constraints, or too little
 * memory, for the direct solution. */
static bool fail_stalled(const fitter *f)
{
  return zs_report(f->diag, ZS_ERROR, ZS_ERROR_UNABLE, f->place,
                   "give kernel=\"r\" or \"r3\", smoothing=\"1e-8\", or fewer constraints",
                   "the fit of %zu constraints with kernel %s misses them by up to %.2g, where "
                   "values are up to %.2g, and comes no nearer",
                   f->rbf->count, zs_rbf_kernel_names[f->problem->kernel], f->solution.left,
                   f->distinct.largest);
}

/* A fit that misses its constraints says so, or is none. */
static bool check_solution(const fitter *f)
{
  const double tolerance = f->problem->tolerance, left = f->solution.left;
  const double asked = tolerance > 0 ? tolerance : TOLERANCE;
  if (!(left <= fmax(USELESS, asked) * f->distinct.largest))
    return f->rbf->method == iterative.name ? fail_stalled(f) : fail_singular(f);
  if (left > asked * f->distinct.largest)
    zs_report(f->diag, ZS_WARNING, ZS_ERROR_UNABLE, f->place,
              "constraints that are very close together, or very many, need smoothing",
              "the fit misses its constraints by up to %.2g, more than the %.2g asked for", left,
              asked * f->distinct.largest);
  return true;
}

/* ---- Fitting ----------------------------------------------------------------------- */

/* Order the distinct constraints by clusters. */
static bool arrange(fitter *f)
{
  const unsigned dimension = f->problem->dimension;
  const size_t n = f->distinct.count;
  zs_rbf *rbf = f->rbf;
  f->clusters = zs_rbf_clusters_new(f->distinct.points, n, dimension, ZS_SCHWARZ_CLUSTER);
  f->values = malloc(n * sizeof *f->values);
  rbf->centres = malloc(n * dimension * sizeof *rbf->centres);
  rbf->weights = malloc(n * sizeof *rbf->weights);
  if (!f->clusters || !f->values || !rbf->centres || !rbf->weights)
    return zs_fail_memory(f->diag);
  for (size_t i = 0; i < n; i++)
    f->values[i] = f->distinct.values[f->clusters->order[i]];
  memcpy(rbf->centres, f->clusters->points, n * dimension * sizeof *rbf->centres);
  memcpy(rbf->centre, f->distinct.centre, sizeof rbf->centre);
  rbf->size = f->distinct.size;
  rbf->count = n;
  return true;
}

/* Linear functions are reproduced whatever the kernel asks for. */
static unsigned degree_of(const zs_rbf_problem *problem)
{
  const unsigned order = zs_rbf_order(problem->kernel), least = order > 2 ? order - 1 : 1;
  return problem->degree > least ? problem->degree : least;
}

/* Find the rate of Gaussians. */
static bool set_rate(fitter *f, zs_rbf_system *system)
{
  const double given = f->problem->sigma / f->rbf->size;
  if (f->problem->kernel != ZS_RBF_GAUSSIAN)
    return true;
  const double sigma = given > 0 ? given : zs_rbf_choose_width(system);
  if (!(sigma > 0))
    return zs_fail_memory(f->diag);
  system->radial.rate = f->rbf->radial.rate = 1 / (sigma * sigma);
  return true;
}

static bool run(fitter *f)
{
  const zs_rbf_problem *problem = f->problem;
  const double origin[ZS_RBF_MAXIMUM_DIMENSION] = {0};
  double terms[ZS_RBF_MAXIMUM_TERMS];
  zs_rbf *rbf = f->rbf;
  if (problem->count > ZS_RBF_MAXIMUM_COUNT)
    return zs_report(f->diag, ZS_ERROR, ZS_ERROR_UNABLE, f->place,
                     "use fewer points, or a simplified mesh",
                     "%zu constraints are more than the %d that can be fitted", problem->count,
                     ZS_RBF_MAXIMUM_COUNT);
  if (!progress(f, 0))
    return fail_cancelled(f);
  if (!zs_rbf_distinct_make(&f->distinct, problem, f->place, f->diag) || !arrange(f))
    return false;
  const unsigned degree = degree_of(problem);
  rbf->dimension = problem->dimension;
  rbf->radial.kernel = problem->kernel;
  rbf->terms = zs_rbf_monomials(problem->dimension, degree, origin, terms);
  const double tolerance = problem->tolerance > 0 ? problem->tolerance : TOLERANCE;
  zs_rbf_job job = {.system = {.radial = rbf->radial,
                                     .dimension = problem->dimension,
                                     .degree = degree,
                                     .terms = rbf->terms,
                                     .smoothing = problem->smoothing /
                                                  pow(f->distinct.size,
                                                      zs_rbf_power(problem->kernel)),
                                     .count = rbf->count,
                                     .points = rbf->centres,
                                     .threads = rbf->count <= ONE_THREAD
                                                  ? 1
                                                  : zs_control_threads(f->control)},
                          .clusters = f->clusters,
                          .values = f->values,
                          .largest = f->distinct.largest,
                          .tolerance = tolerance * f->distinct.largest,
                          .progress = progress,
                          .context = f};
  if (!set_rate(f, &job.system) || !solve(f, &job) || !check_solution(f))
    return false;
  const double sign = zs_rbf_sign(problem->kernel);
  for (size_t i = 0; i < rbf->count; i++)
    rbf->weights[i] = sign * f->solution.weights[i];
  memcpy(rbf->polynomial, f->solution.polynomial, sizeof rbf->polynomial);
  rbf->residual = f->solution.residual;
  return progress(f, 1) || fail_cancelled(f);
}

zs_rbf *zs_rbf_fit(const zs_rbf_problem *problem, const zs_control *control,
                   const zs_place *place, zs_diag *diag)
{
  const double start = zs_seconds();
  fitter f = {.problem = problem, .control = control, .place = place, .diag = diag};
  f.solution.left = INFINITY;
  if (problem->count == 0) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place, NULL, "there are no constraints to fit");
    return NULL;
  }
  f.rbf = calloc(1, sizeof *f.rbf);
  if (!f.rbf) {
    zs_fail_memory(diag);
    return NULL;
  }
  const bool done = run(&f);
  zs_rbf_distinct_clear(&f.distinct);
  zs_rbf_clusters_free(f.clusters);
  free(f.values);
  free(f.solution.weights);
  if (!done) {
    zs_rbf_free(f.rbf);
    return NULL;
  }
  f.rbf->seconds = zs_seconds() - start;
  return f.rbf;
}

void zs_rbf_free(zs_rbf *rbf)
{
  if (!rbf)
    return;
  free(rbf->centres);
  free(rbf->weights);
  free(rbf);
}
