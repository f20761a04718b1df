#include "rbf/fit.h"

#include "field/program.h"
#include "rbf/dense.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Constraints nearer than this part of the box are one constraint; values that
 * differ by less than this part of the largest are equal. */
static const double SAME = 1e-9;

/* Residuals, as parts of the largest value: what refinement aims at, and what
 * is no answer any more. */
static const double GOOD_RESIDUAL = 1e-10, USELESS_RESIDUAL = 1e-4;
enum { REFINEMENTS = 2 };

/* A system being assembled and solved. */
typedef struct fitter {
  const zs_rbf_problem *problem;
  const zs_control *control;
  const zs_place *place;
  zs_diag *diag;
  zs_rbf *rbf;
  unsigned degree, threads;
  double *values; /* of the distinct constraints */
  double *matrix, *monomials;
  double *left, *step; /* what a solution leaves over; a correction */
  double largest; /* value */
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

static unsigned degree_of(unsigned dimension, unsigned terms)
{
  return terms > dimension + 1 ? 2 : 1;
}

static double distance_squared(unsigned dimension, const double *a, const double *b)
{
  double s = 0;
  for (unsigned k = 0; k < dimension; k++)
    s += (a[k] - b[k]) * (a[k] - b[k]);
  return s;
}

/* f at a point of the unit box. */
static double value_at(const zs_rbf *rbf, const double *u)
{
  const unsigned dimension = rbf->dimension;
  double terms[ZS_RBF_MAXIMUM_TERMS], f = 0;
  for (size_t j = 0; j < rbf->count; j++) {
    double s = distance_squared(dimension, u, rbf->centres + j * dimension);
    f += rbf->weights[j] * zs_rbf_phi(rbf->kernel, s);
  }
  zs_rbf_monomials(dimension, degree_of(dimension, rbf->terms), u, terms);
  for (unsigned k = 0; k < rbf->terms; k++)
    f += rbf->polynomial[k] * terms[k];
  return f;
}

double zs_rbf_value(const zs_rbf *rbf, const double *point)
{
  double u[ZS_RBF_MAXIMUM_DIMENSION];
  for (unsigned k = 0; k < rbf->dimension; k++)
    u[k] = (point[k] - rbf->centre[k]) / rbf->size;
  return value_at(rbf, u);
}

static bool progress(const fitter *f, double fraction)
{
  if (!f->control || !f->control->progress ||
      f->control->progress(f->control->context, "fitting", fraction))
    return true;
  return zs_fail(f->diag, ZS_CANCELLED, NULL, "cancelled");
}

static bool unable(const fitter *f, const char *hint, const char *what)
{
  return zs_report(f->diag, ZS_ERROR, ZS_ERROR_UNABLE, f->place, hint, "%s", what);
}

/* ---- Constraints ------------------------------------------------------------ */

/* Map the box of the constraints to the unit box about the origin. */
static void normalise(zs_rbf *rbf, const double *positions, size_t count)
{
  const unsigned dimension = rbf->dimension;
  rbf->size = 0;
  for (unsigned k = 0; k < dimension; k++) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      lo = fmin(lo, positions[i * dimension + k]);
      hi = fmax(hi, positions[i * dimension + k]);
    }
    rbf->centre[k] = lo + (hi - lo) / 2;
    rbf->size = fmax(rbf->size, hi - lo);
  }
  if (rbf->size == 0)
    rbf->size = 1;
}

/* A constraint's place along a direction that no plane of a grid is normal to. */
typedef struct sorted {
  double key;
  size_t index;
} sorted;

static int by_key(const void *a, const void *b)
{
  const sorted *p = a, *q = b;
  if (p->key != q->key)
    return p->key < q->key ? -1 : 1;
  return p->index < q->index ? -1 : p->index > q->index;
}

/* Constraints sorted along a direction; NULL when memory is out. */
static sorted *sort_constraints(const double *u, size_t count, unsigned dimension)
{
  static const double direction[ZS_RBF_MAXIMUM_DIMENSION] = {0.4841, 0.4131, 0.3877, 0.5519,
                                                             0.3694};
  sorted *order = malloc(count * sizeof *order);
  if (!order)
    return NULL;
  for (size_t i = 0; i < count; i++) {
    order[i] = (sorted){.index = i};
    for (unsigned k = 0; k < dimension; k++)
      order[i].key += direction[k] * u[i * dimension + k];
  }
  qsort(order, count, sizeof *order, by_key);
  return order;
}

static bool fail_conflict(const fitter *f, size_t i, size_t j)
{
  const zs_rbf_problem *p = f->problem;
  const size_t at[2] = {i, j};
  char text[2][ZS_RBF_MAXIMUM_DIMENSION * 32] = {"", ""};
  for (int side = 0; side < 2; side++)
    for (unsigned k = 0, n = 0; k < p->dimension; k++)
      n += (unsigned)snprintf(text[side] + n, sizeof text[side] - n, "%s%.9g", k ? " " : "",
                              p->positions[at[side] * p->dimension + k]);
  return zs_report(f->diag, ZS_ERROR, ZS_ERROR_GEOMETRY, f->place,
                   "smoothing above 0 averages such constraints",
                   "constraints contradict each other: value %.9g at (%s), value %.9g at (%s)",
                   p->values[i], text[0], p->values[j], text[1]);
}

/* Mark constraints that repeat an earlier one.  The pairs that count lie close
 * together in the order of their keys. */
static bool mark_duplicates(const fitter *f, const double *u, bool *repeated)
{
  const zs_rbf_problem *p = f->problem;
  const unsigned dimension = p->dimension;
  sorted *order = sort_constraints(u, p->count, dimension);
  if (!order)
    return zs_fail_memory(f->diag);
  bool agree = true;
  for (size_t a = 0; agree && a < p->count; a++) {
    for (size_t b = a + 1; agree && b < p->count && order[b].key - order[a].key <= 2 * SAME; b++) {
      size_t i = order[a].index, j = order[b].index;
      if (repeated[i] || repeated[j] ||
          distance_squared(dimension, u + i * dimension, u + j * dimension) > SAME * SAME)
        continue;
      if (fabs(p->values[i] - p->values[j]) <= SAME * f->largest)
        repeated[i > j ? i : j] = true;
      else if (p->smoothing == 0)
        agree = fail_conflict(f, i < j ? i : j, i < j ? j : i);
    }
  }
  free(order);
  return agree;
}

/* The distinct constraints in the unit box. */
static bool gather(fitter *f)
{
  const zs_rbf_problem *p = f->problem;
  const unsigned dimension = p->dimension;
  zs_rbf *rbf = f->rbf;
  bool *repeated = calloc(p->count, sizeof *repeated);
  rbf->centres = malloc(p->count * dimension * sizeof *rbf->centres);
  rbf->weights = calloc(p->count, sizeof *rbf->weights);
  f->values = malloc(p->count * sizeof *f->values);
  if (!repeated || !rbf->centres || !rbf->weights || !f->values) {
    free(repeated);
    return zs_fail_memory(f->diag);
  }
  normalise(rbf, p->positions, p->count);
  if (!isfinite(rbf->size)) {
    free(repeated);
    return zs_report(f->diag, ZS_ERROR, ZS_ERROR_GEOMETRY, f->place, NULL,
                     "constraints are too far apart, or not finite");
  }
  for (size_t i = 0; i < p->count; i++) {
    f->largest = fmax(f->largest, fabs(p->values[i]));
    for (unsigned k = 0; k < dimension; k++)
      rbf->centres[i * dimension + k] =
        (p->positions[i * dimension + k] - rbf->centre[k]) / rbf->size;
  }
  bool agree = mark_duplicates(f, rbf->centres, repeated);
  for (size_t i = 0; agree && i < p->count; i++) {
    if (repeated[i])
      continue;
    memmove(rbf->centres + rbf->count * dimension, rbf->centres + i * dimension,
            dimension * sizeof *rbf->centres);
    f->values[rbf->count++] = p->values[i];
  }
  free(repeated);
  return agree;
}

/* ---- The system --------------------------------------------------------------- */

static bool check_size(fitter *f)
{
  const size_t n = f->rbf->count;
  if (n > ZS_RBF_MAXIMUM_COUNT)
    return zs_report(f->diag, ZS_ERROR, ZS_ERROR_UNABLE, f->place,
                     "use fewer points, or a simplified mesh",
                     "%zu constraints are more than the %d that can be fitted", n,
                     ZS_RBF_MAXIMUM_COUNT);
  double bytes = zs_dense_bytes(n, f->rbf->terms);
  f->rbf->bytes = (uint64_t)bytes;
  if (f->control && f->control->memory_limit && bytes > (double)f->control->memory_limit)
    return zs_report(f->diag, ZS_ERROR, ZS_ERROR_MEMORY, f->place, NULL,
                     "fitting %zu constraints needs %.0f MB, more than the memory limit of %.0f MB",
                     n, bytes / 1e6, (double)f->control->memory_limit / 1e6);
  return true;
}

static bool assemble(fitter *f)
{
  const zs_rbf *rbf = f->rbf;
  const size_t n = rbf->count;
  const unsigned dimension = rbf->dimension;
  const double sign = zs_rbf_sign(rbf->kernel);
  f->matrix = malloc(n * n * sizeof *f->matrix);
  f->monomials = malloc(n * rbf->terms * sizeof *f->monomials);
  f->left = malloc(n * sizeof *f->left);
  f->step = malloc(n * sizeof *f->step);
  if (!f->matrix || !f->monomials || !f->left || !f->step)
    return zs_fail_memory(f->diag);
  double *matrix = f->matrix;
#pragma omp parallel for schedule(static) num_threads(f->threads)
  for (size_t j = 0; j < n; j++) {
    const double *c = rbf->centres + j * dimension;
    for (size_t i = 0; i < n; i++) {
      double s = distance_squared(dimension, rbf->centres + i * dimension, c);
      matrix[j * n + i] = sign * zs_rbf_phi(rbf->kernel, s);
    }
    matrix[j * n + j] += f->problem->smoothing;
  }
  for (size_t i = 0; i < n; i++) {
    double terms[ZS_RBF_MAXIMUM_TERMS];
    zs_rbf_monomials(dimension, f->degree, rbf->centres + i * dimension, terms);
    for (unsigned k = 0; k < rbf->terms; k++)
      f->monomials[k * n + i] = terms[k];
  }
  return true;
}

/* What the present solution leaves of the equations; returns the largest part,
 * and the distance of f from the values in `residual`. */
static double evaluate_residual(fitter *f)
{
  zs_rbf *rbf = f->rbf;
  const double mu = f->problem->smoothing * zs_rbf_sign(rbf->kernel);
  double largest = 0, residual = 0;
#pragma omp parallel for schedule(static) num_threads(f->threads) \
  reduction(max : largest, residual)
  for (size_t i = 0; i < rbf->count; i++) {
    double off = f->values[i] - value_at(rbf, rbf->centres + i * rbf->dimension);
    f->left[i] = off - mu * rbf->weights[i];
    /* Written so that a NaN counts as infinite. */
    residual = fabs(off) <= residual ? residual : off == off ? fabs(off) : INFINITY;
    largest = fabs(f->left[i]) <= largest ? largest
              : f->left[i] == f->left[i]  ? fabs(f->left[i])
                                          : INFINITY;
  }
  rbf->residual = residual;
  return largest;
}

/* Add the solution for what is left to the weights and the polynomial. */
static bool correct(fitter *f, const zs_dense *dense)
{
  zs_rbf *rbf = f->rbf;
  const double sign = zs_rbf_sign(rbf->kernel);
  double c[ZS_RBF_MAXIMUM_TERMS];
  if (zs_dense_solve(dense, f->left, f->step, c) != ZS_DENSE_DONE)
    return zs_fail_memory(f->diag);
  for (size_t i = 0; i < rbf->count; i++)
    rbf->weights[i] += sign * f->step[i];
  for (unsigned k = 0; k < rbf->terms; k++)
    rbf->polynomial[k] += c[k];
  return true;
}

static bool fail_singular(const fitter *f)
{
  return unable(f, "remove constraints that nearly coincide, or give smoothing=\"1e-8\"",
                "the fit is singular: constraints are too close together");
}

static bool solve(fitter *f, const zs_dense *dense)
{
  memcpy(f->left, f->values, f->rbf->count * sizeof *f->left);
  if (!correct(f, dense))
    return false;
  double left = evaluate_residual(f);
  for (int i = 0; i < REFINEMENTS && left > GOOD_RESIDUAL * f->largest; i++) {
    if (!correct(f, dense))
      return false;
    left = evaluate_residual(f);
  }
  return left <= USELESS_RESIDUAL * f->largest || fail_singular(f);
}

static bool run(fitter *f)
{
  if (!progress(f, 0) || !gather(f) || !check_size(f) || !assemble(f) || !progress(f, 0.1))
    return false;
  zs_dense dense;
  zs_dense_result result =
    zs_dense_factorise(&dense, f->rbf->count, f->rbf->terms, f->matrix, f->monomials);
  bool done = result == ZS_DENSE_MEMORY     ? zs_fail_memory(f->diag)
              : result == ZS_DENSE_SINGULAR ? fail_singular(f)
                                            : progress(f, 0.9) && solve(f, &dense);
  zs_dense_free(&dense);
  return done && progress(f, 1);
}

zs_rbf *zs_rbf_fit(const zs_rbf_problem *problem, const zs_control *control,
                   const zs_place *place, zs_diag *diag)
{
  const double start = zs_seconds();
  const unsigned order = zs_rbf_order(problem->kernel);
  fitter f = {.problem = problem, .control = control, .place = place, .diag = diag};
  if (problem->count == 0) {
    zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place, NULL, "there are no constraints to fit");
    return NULL;
  }
  f.rbf = calloc(1, sizeof *f.rbf);
  if (!f.rbf) {
    zs_fail_memory(diag);
    return NULL;
  }
  /* Linear functions are reproduced whatever the kernel asks for. */
  f.degree = order > 2 ? order - 1 : 1;
  f.threads = zs_control_threads(control);
  f.rbf->dimension = problem->dimension;
  f.rbf->kernel = problem->kernel;
  const double origin[ZS_RBF_MAXIMUM_DIMENSION] = {0};
  double terms[ZS_RBF_MAXIMUM_TERMS];
  f.rbf->terms = zs_rbf_monomials(problem->dimension, f.degree, origin, terms);
  bool done = run(&f);
  free(f.values);
  free(f.matrix);
  free(f.monomials);
  free(f.left);
  free(f.step);
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
