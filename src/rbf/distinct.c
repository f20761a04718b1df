#include "rbf/distinct.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Constraints nearer than this part of the box are one constraint; values that
 * differ by less than this part of the largest are equal. */
static const double SAME = 1e-8;

static double distance_squared(unsigned dimension, const double *a, const double *b)
{
  double s = 0;
  for (unsigned k = 0; k < dimension; k++)
    s += (a[k] - b[k]) * (a[k] - b[k]);
  return s;
}

/* Map the box of the constraints to the unit box about the origin. */
static void normalise(const zs_rbf_problem *problem, zs_rbf_distinct *distinct)
{
  const unsigned dimension = problem->dimension;
  distinct->size = 0;
  for (unsigned k = 0; k < dimension; k++) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < problem->count; i++) {
      lo = fmin(lo, problem->positions[i * dimension + k]);
      hi = fmax(hi, problem->positions[i * dimension + k]);
    }
    distinct->centre[k] = lo + (hi - lo) / 2;
    distinct->size = fmax(distinct->size, hi - lo);
  }
  if (distinct->size == 0)
    distinct->size = 1;
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

static bool fail_conflict(const zs_rbf_problem *p, size_t i, size_t j, const zs_place *place,
                          zs_diag *diag)
{
  const size_t at[2] = {i, j};
  char text[2][ZS_RBF_MAXIMUM_DIMENSION * 32] = {"", ""};
  for (int side = 0; side < 2; side++)
    for (unsigned k = 0, n = 0; k < p->dimension; k++)
      n += (unsigned)snprintf(text[side] + n, sizeof text[side] - n, "%s%.12g", k ? " " : "",
                              p->positions[at[side] * p->dimension + k]);
  return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place,
                   "smoothing above 0 averages such constraints",
                   "constraints contradict each other: value %.9g at (%s), value %.9g at (%s)",
                   p->values[i], text[0], p->values[j], text[1]);
}

/* Mark constraints that repeat an earlier one.  The pairs that count lie close
 * together in the order of their keys. */
static bool mark_duplicates(const zs_rbf_problem *p, const zs_rbf_distinct *distinct,
                            bool *repeated, const zs_place *place, zs_diag *diag)
{
  const unsigned dimension = p->dimension;
  const double *u = distinct->points;
  sorted *order = sort_constraints(u, p->count, dimension);
  if (!order)
    return zs_fail_memory(diag);
  bool agree = true;
  for (size_t a = 0; agree && a < p->count; a++) {
    for (size_t b = a + 1; agree && b < p->count && order[b].key - order[a].key <= 2 * SAME; b++) {
      size_t i = order[a].index, j = order[b].index;
      if (repeated[i] || repeated[j] ||
          distance_squared(dimension, u + i * dimension, u + j * dimension) > SAME * SAME)
        continue;
      if (fabs(p->values[i] - p->values[j]) <= SAME * distinct->largest)
        repeated[i > j ? i : j] = true;
      else if (p->smoothing == 0)
        agree = fail_conflict(p, i < j ? i : j, i < j ? j : i, place, diag);
    }
  }
  free(order);
  return agree;
}

static bool check_finite(const zs_rbf_problem *p, const zs_rbf_distinct *distinct,
                         const zs_place *place, zs_diag *diag)
{
  bool finite = isfinite(distinct->size);
  for (size_t i = 0; i < p->count; i++) {
    finite = finite && isfinite(p->values[i]);
    for (unsigned k = 0; k < p->dimension; k++)
      finite = finite && isfinite(p->positions[i * p->dimension + k]);
  }
  return finite || zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place, NULL,
                             "constraints are too far apart, or not finite");
}

/* Put all points into the unit box, then keep the first of each. */
static bool collect(const zs_rbf_problem *p, zs_rbf_distinct *distinct, bool *repeated,
                    const zs_place *place, zs_diag *diag)
{
  const unsigned dimension = p->dimension;
  normalise(p, distinct);
  if (!check_finite(p, distinct, place, diag))
    return false;
  for (size_t i = 0; i < p->count; i++) {
    distinct->largest = fmax(distinct->largest, fabs(p->values[i]));
    for (unsigned k = 0; k < dimension; k++)
      distinct->points[i * dimension + k] =
        (p->positions[i * dimension + k] - distinct->centre[k]) / distinct->size;
  }
  if (!mark_duplicates(p, distinct, repeated, place, diag))
    return false;
  for (size_t i = 0; i < p->count; i++) {
    if (repeated[i])
      continue;
    memmove(distinct->points + distinct->count * dimension, distinct->points + i * dimension,
            dimension * sizeof *distinct->points);
    distinct->values[distinct->count++] = p->values[i];
  }
  return true;
}

bool zs_rbf_distinct_make(zs_rbf_distinct *distinct, const zs_rbf_problem *problem,
                          const zs_place *place, zs_diag *diag)
{
  *distinct = (zs_rbf_distinct){.count = 0};
  bool *repeated = calloc(problem->count, sizeof *repeated);
  distinct->points = malloc(problem->count * problem->dimension * sizeof *distinct->points);
  distinct->values = malloc(problem->count * sizeof *distinct->values);
  bool done = repeated && distinct->points && distinct->values
                ? collect(problem, distinct, repeated, place, diag)
                : zs_fail_memory(diag);
  free(repeated);
  if (!done)
    zs_rbf_distinct_clear(distinct);
  return done;
}

void zs_rbf_distinct_clear(zs_rbf_distinct *distinct)
{
  free(distinct->points);
  free(distinct->values);
  *distinct = (zs_rbf_distinct){.count = 0};
}
