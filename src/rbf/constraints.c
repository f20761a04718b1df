#include "rbf/constraints.h"

#include "field/program.h"
#include "rbf/fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The automatic offset, by the diagonal of the box; the least part of it that
 * still makes a constraint; and what counts as the same point. */
static const double AUTOMATIC = 0.01, LEAST = 1e-3, SAME = 1e-6;
/* Offsets reach this part of the way to the medial axis. */
static const double CLEARANCE = 0.5;

bool zs_rbf_samples_add(zs_rbf_samples *list, const zs_rbf_sample *sample, zs_diag *diag)
{
  if (list->count == list->capacity) {
    size_t capacity = list->capacity ? 2 * list->capacity : 256;
    zs_rbf_sample *samples = capacity > SIZE_MAX / sizeof *samples
                               ? NULL
                               : realloc(list->samples, capacity * sizeof *samples);
    if (!samples)
      return zs_fail_memory(diag);
    list->samples = samples;
    list->capacity = capacity;
  }
  list->samples[list->count++] = *sample;
  return true;
}

void zs_rbf_samples_clear(zs_rbf_samples *list)
{
  free(list->samples);
  *list = (zs_rbf_samples){0};
}

void zs_rbf_constraints_clear(zs_rbf_constraints *constraints)
{
  free(constraints->positions);
  free(constraints->values);
  *constraints = (zs_rbf_constraints){0};
}

static double diagonal(const zs_rbf_samples *samples)
{
  double square = 0;
  for (int k = 0; k < 3; k++) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < samples->count; i++) {
      lo = fmin(lo, samples->samples[i].position[k]);
      hi = fmax(hi, samples->samples[i].position[k]);
    }
    square += (hi - lo) * (hi - lo);
  }
  return sqrt(square);
}

/* A sample's normal at unit length; false when it is unknown. */
static bool unit_normal(const zs_rbf_sample *sample, double unit[3])
{
  const double *n = sample->normal;
  double length = hypot(hypot(n[0], n[1]), n[2]);
  if (!(length > 0))
    return false;
  for (int k = 0; k < 3; k++)
    unit[k] = n[k] / length;
  return true;
}

/* Radius of the largest ball on the side of `direction` that touches sample i
 * and holds no other sample of the same value. */
static double touching_radius(const zs_rbf_samples *samples, size_t i, const double direction[3],
                              double same)
{
  const zs_rbf_sample *p = &samples->samples[i];
  double radius = INFINITY;
  for (size_t j = 0; j < samples->count; j++) {
    const zs_rbf_sample *q = &samples->samples[j];
    double along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
      double d = q->position[k] - p->position[k];
      along += d * direction[k];
      square += d * d;
    }
    if (along > 0 && square > same * same && square < 2 * along * radius && q->value == p->value)
      radius = square / (2 * along);
  }
  return radius;
}

/* The offsets of sample i to the inner and the outer side; 0: none. */
static void offsets_of(const zs_rbf_samples *samples, size_t i, double offset, double box,
                       bool both, double result[2])
{
  double unit[3], direction[3];
  result[0] = result[1] = 0;
  if (!unit_normal(&samples->samples[i], unit))
    return;
  for (int side = 0; side < (both ? 2 : 1); side++) {
    if (!isnan(offset)) {
      result[side] = offset;
      continue;
    }
    double automatic = box > 0 ? AUTOMATIC * box : 1;
    for (int k = 0; k < 3; k++)
      direction[k] = side ? unit[k] : -unit[k];
    double most = CLEARANCE * touching_radius(samples, i, direction, SAME * box);
    result[side] = fmin(automatic, most);
    if (result[side] < LEAST * automatic)
      result[side] = 0;
  }
}

static void add(zs_rbf_constraints *c, const zs_rbf_sample *sample, const double *unit,
                double outward)
{
  double *to = c->positions + 3 * c->count;
  for (int k = 0; k < 3; k++)
    to[k] = sample->position[k] + (unit ? outward * unit[k] : 0);
  c->values[c->count++] = sample->value - outward;
}

static bool check_values(const zs_rbf_constraints *c, const zs_place *place, zs_diag *diag)
{
  for (size_t i = 1; i < c->count; i++)
    if (c->values[i] != c->values[0])
      return true;
  return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place,
                   "give the points normals, or add points with positive values inside",
                   "all constraints have the value %.9g and none has a normal, so nothing says "
                   "where the inside is", c->values[0]);
}

static bool check_samples(const zs_rbf_samples *samples, const zs_place *place, zs_diag *diag)
{
  if (samples->count == 0)
    return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place, NULL,
                     "there are no points; expected <mesh>, <points> or <point> elements");
  if (samples->count <= ZS_RBF_MAXIMUM_COUNT)
    return true;
  return zs_report(diag, ZS_ERROR, ZS_ERROR_UNABLE, place,
                   "use fewer points, or a simplified mesh",
                   "%zu points are more than the %d constraints that can be fitted",
                   samples->count, ZS_RBF_MAXIMUM_COUNT);
}

bool zs_rbf_constraints_build(zs_rbf_constraints *constraints, const zs_rbf_samples *samples,
                              double offset, bool both, const zs_control *control,
                              const zs_place *place, zs_diag *diag)
{
  (void)control; /* without OpenMP */
  *constraints = (zs_rbf_constraints){0};
  if (!check_samples(samples, place, diag))
    return false;
  const size_t n = samples->count;
  const double box = diagonal(samples);
  double(*offsets)[2] = malloc(n * sizeof *offsets);
  constraints->positions = malloc(3 * n * 3 * sizeof *constraints->positions);
  constraints->values = malloc(3 * n * sizeof *constraints->values);
  if (!offsets || !constraints->positions || !constraints->values) {
    free(offsets);
    zs_rbf_constraints_clear(constraints);
    return zs_fail_memory(diag);
  }
#pragma omp parallel for schedule(static) num_threads(zs_control_threads(control))
  for (size_t i = 0; i < n; i++)
    offsets_of(samples, i, offset, box, both, offsets[i]);
  for (size_t i = 0; i < n; i++) {
    const zs_rbf_sample *sample = &samples->samples[i];
    double unit[3] = {0, 0, 0};
    unit_normal(sample, unit);
    add(constraints, sample, NULL, 0);
    if (offsets[i][0] > 0)
      add(constraints, sample, unit, -offsets[i][0]);
    if (offsets[i][1] > 0)
      add(constraints, sample, unit, offsets[i][1]);
  }
  free(offsets);
  if (check_values(constraints, place, diag))
    return true;
  zs_rbf_constraints_clear(constraints);
  return false;
}
