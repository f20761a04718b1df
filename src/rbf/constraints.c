#include "rbf/constraints.h"

#include "base/array.h"
#include "field/program.h"
#include "rbf/clusters.h"
#include "rbf/nearest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The automatic offset, by the samples' size; the least part of it that still
 * makes a constraint; and what counts as the same point. */
static const double AUTOMATIC = 0.01, LEAST = 0.02, SAME = 1e-6;
/* Offsets reach this part of the way to the medial axis. */
static const double CLEARANCE = 0.5;

bool zs_rbf_samples_add(zs_rbf_samples *list, const zs_rbf_sample *sample, zs_diag *diag)
{
  zs_rbf_sample *samples =
    zs_array_grown(list->samples, list->count + 1, &list->capacity, sizeof *samples);
  if (!samples)
    return zs_fail_memory(diag);
  list->samples = samples;
  samples[list->count++] = *sample;
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

double zs_rbf_samples_size(const zs_rbf_samples *list)
{
  static const double ROUNDING = 1e-13; /* of means of the same number, at most */
  double mean[3] = {0, 0, 0}, square = 0, farthest = 0;
  for (size_t i = 0; i < list->count; i++)
    for (int k = 0; k < 3; k++) {
      mean[k] += list->samples[i].position[k] / (double)list->count;
      farthest = fmax(farthest, fabs(list->samples[i].position[k]));
    }
  for (size_t i = 0; i < list->count; i++) {
    double from[3];
    for (int k = 0; k < 3; k++)
      from[k] = list->samples[i].position[k] - mean[k];
    square = fmax(square, from[0] * from[0] + from[1] * from[1] + from[2] * from[2]);
  }
  const double size = 2 * sqrt(square);
  return size > ROUNDING * farthest ? size : 0;
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

size_t zs_rbf_samples_oriented(const zs_rbf_samples *list, size_t first, double *positions,
                               double *normals)
{
  size_t count = 0;
  for (size_t i = first; i < list->count; i++) {
    const zs_rbf_sample *sample = &list->samples[i];
    if (sample->value != 0 || !unit_normal(sample, normals + 3 * count))
      continue;
    memcpy(positions + 3 * count++, sample->position, sizeof sample->position);
  }
  return count;
}

/* The samples and how they lie. */
typedef struct cloud {
  const zs_rbf_samples *samples;
  zs_rbf_clusters *clusters; /* of the samples' positions */
  double size;
} cloud;

/* A ball that touches a sample on one side and shrinks until it holds no other
 * sample of the same value. */
typedef struct ball {
  const zs_rbf_sample *sample;
  const double *direction;
  double radius;
} ball;

static void shrink(const cloud *c, ball *b, const zs_rbf_sample *other)
{
  const double same = SAME * c->size;
  double along = 0, square = 0;
  for (int k = 0; k < 3; k++) {
    const double d = other->position[k] - b->sample->position[k];
    along += d * b->direction[k];
    square += d * d;
  }
  if (along > 0 && square > same * same && square < 2 * along * b->radius &&
      other->value == b->sample->value)
    b->radius = square / (2 * along);
}

/* By all samples of a cluster, unless it is farther than the ball reaches. */
static void shrink_by_cluster(const cloud *c, ball *b, const zs_rbf_cluster *cluster)
{
  if (zs_nearest_gap(cluster, b->sample->position) >= 4 * b->radius * b->radius)
    return;
  if (cluster->children) {
    shrink_by_cluster(c, b, &c->clusters->clusters[cluster->children]);
    shrink_by_cluster(c, b, &c->clusters->clusters[cluster->children + 1]);
    return;
  }
  for (size_t i = cluster->first; i < cluster->first + cluster->count; i++)
    shrink(c, b, &c->samples->samples[c->clusters->order[i]]);
}

/* The offsets of sample i to the inner and the outer side; 0: none. */
static void offsets_of(const cloud *c, size_t i, const zs_rbf_rules *rules, double result[2])
{
  const zs_rbf_sample *sample = &c->samples->samples[i];
  double unit[3], direction[3];
  result[0] = result[1] = 0;
  if (!unit_normal(sample, unit))
    return;
  const double most = !isnan(rules->offset) ? rules->offset
                      : c->size > 0          ? AUTOMATIC * c->size
                                            : 1;
  for (int side = 0; side < (rules->both ? 2 : 1); side++) {
    for (int k = 0; k < 3; k++)
      direction[k] = side ? unit[k] : -unit[k];
    /* A larger ball would make no difference. */
    ball b = {sample, direction, most / CLEARANCE};
    shrink_by_cluster(c, &b, &c->clusters->clusters[0]);
    result[side] = CLEARANCE * b.radius;
    if (result[side] < LEAST * most)
      result[side] = 0;
  }
}

static void add(zs_rbf_constraints *c, unsigned dimension, const zs_rbf_sample *sample,
                const double *unit, double outward)
{
  double *to = c->positions + dimension * c->count;
  for (unsigned k = 0; k < dimension; k++)
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

bool zs_rbf_samples_check(const zs_rbf_samples *samples, const zs_place *place, zs_diag *diag)
{
  if (samples->count == 0)
    return zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place, NULL,
                     "there are no points; expected parts such as <mesh>, <points> or <contour>");
  if (samples->count > ZS_RBF_MAXIMUM_COUNT)
    return zs_report(diag, ZS_ERROR, ZS_ERROR_UNABLE, place,
                     "use fewer points, or a simplified mesh",
                     "%zu points are more than the %d constraints that can be fitted",
                     samples->count, ZS_RBF_MAXIMUM_COUNT);
  /* Fields are evaluated in single precision, where squares have to have room. */
  static const double LEAST = 1e-15, MOST = 1e15;
  const double size = zs_rbf_samples_size(samples);
  return (!(size > 0 && size < LEAST) && !(size > MOST)) ||
         zs_report(diag, ZS_ERROR, ZS_ERROR_GEOMETRY, place, NULL,
                   "the points are %.3g across; expected %g to %g", size, LEAST, MOST);
}

static bool make_cloud(cloud *c, const zs_rbf_samples *samples)
{
  enum { SMALLEST = 12 }; /* cluster */
  double *positions = malloc(3 * samples->count * sizeof *positions);
  *c = (cloud){.samples = samples, .size = zs_rbf_samples_size(samples)};
  for (size_t i = 0; positions && i < samples->count; i++)
    memcpy(positions + 3 * i, samples->samples[i].position, 3 * sizeof *positions);
  if (positions)
    c->clusters = zs_rbf_clusters_new(positions, samples->count, 3, SMALLEST);
  free(positions);
  return c->clusters != NULL;
}

bool zs_rbf_constraints_build(zs_rbf_constraints *constraints, const zs_rbf_samples *samples,
                              const zs_rbf_rules *rules, const zs_control *control,
                              const zs_place *place, zs_diag *diag)
{
  (void)control; /* without OpenMP */
  *constraints = (zs_rbf_constraints){0};
  if (!zs_rbf_samples_check(samples, place, diag))
    return false;
  const size_t n = samples->count;
  cloud c;
  double(*offsets)[2] = malloc(n * sizeof *offsets);
  constraints->positions = malloc(3 * n * rules->dimension * sizeof *constraints->positions);
  constraints->values = malloc(3 * n * sizeof *constraints->values);
  if (!make_cloud(&c, samples) || !offsets || !constraints->positions || !constraints->values) {
    zs_rbf_clusters_free(c.clusters);
    free(offsets);
    zs_rbf_constraints_clear(constraints);
    return zs_fail_memory(diag);
  }
#pragma omp parallel for schedule(dynamic, 64) num_threads(zs_control_threads(control))
  for (size_t i = 0; i < n; i++)
    offsets_of(&c, i, rules, offsets[i]);
  zs_rbf_clusters_free(c.clusters);
  for (size_t i = 0; i < n; i++) {
    const zs_rbf_sample *sample = &samples->samples[i];
    double unit[3] = {0, 0, 0};
    unit_normal(sample, unit);
    add(constraints, rules->dimension, sample, NULL, 0);
    if (offsets[i][0] > 0)
      add(constraints, rules->dimension, sample, unit, -offsets[i][0]);
    if (offsets[i][1] > 0)
      add(constraints, rules->dimension, sample, unit, offsets[i][1]);
  }
  free(offsets);
  if (check_values(constraints, place, diag))
    return true;
  zs_rbf_constraints_clear(constraints);
  return false;
}
