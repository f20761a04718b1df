#include "rbf/greedy.h"

#include "field/program.h"
#include "rbf/clusters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The first fit has this part of the budget, but at least so many; each further
 * one up to so many times as many as the one before. */
static const double BEGIN = 0.125, GROWTH = 1.6;
enum { FEWEST = 100 };

/* The constraints in the order of their clusters, and which are used. */
typedef struct selection {
  const zs_rbf_problem *problem;
  zs_rbf_clusters *clusters; /* of all positions */
  double *values, *misses;   /* in the order of the clusters */
  bool *used;
  size_t used_count;
  double *chosen_points, *chosen_values; /* what is fitted, and the centres' places */
  double worst;
} selection;

static bool make(selection *s, const zs_rbf_problem *p)
{
  const size_t n = p->count;
  *s = (selection){.problem = p};
  s->clusters = zs_rbf_clusters_new(p->positions, n, p->dimension, 1);
  s->values = malloc(n * sizeof *s->values);
  s->misses = malloc(n * sizeof *s->misses);
  s->used = calloc(n, sizeof *s->used);
  s->chosen_points = malloc(n * p->dimension * sizeof *s->chosen_points);
  s->chosen_values = malloc(n * sizeof *s->chosen_values);
  if (!s->clusters || !s->values || !s->misses || !s->used || !s->chosen_points ||
      !s->chosen_values)
    return false;
  for (size_t i = 0; i < n; i++) {
    s->values[i] = p->values[s->clusters->order[i]];
    s->misses[i] = INFINITY;
  }
  return true;
}

static void clear(selection *s)
{
  zs_rbf_clusters_free(s->clusters);
  free(s->values);
  free(s->misses);
  free(s->used);
  free(s->chosen_points);
  free(s->chosen_values);
}

/* Use the constraint of each of `parts` runs of neighbours that is missed most,
 * if by more than `least`. */
static void choose(selection *s, size_t parts, double least)
{
  const size_t n = s->problem->count;
  for (size_t part = 0; part < parts; part++) {
    const size_t begin = part * n / parts, end = (part + 1) * n / parts;
    size_t best = n;
    for (size_t i = begin; i < end; i++)
      if (!s->used[i] && s->misses[i] > least && (best == n || s->misses[i] > s->misses[best]))
        best = i;
    if (best == n)
      continue;
    s->used[best] = true;
    s->used_count++;
  }
}

static zs_rbf *fit_chosen(const selection *s, const zs_control *control, const zs_place *place,
                          zs_diag *diag)
{
  const unsigned dimension = s->problem->dimension;
  size_t count = 0;
  for (size_t i = 0; i < s->problem->count; i++)
    if (s->used[i]) {
      memcpy(s->chosen_points + count * dimension, s->clusters->points + i * dimension,
             dimension * sizeof *s->chosen_points);
      s->chosen_values[count++] = s->values[i];
    }
  zs_rbf_problem part = *s->problem;
  part.count = count;
  part.positions = s->chosen_points;
  part.values = s->chosen_values;
  return zs_rbf_fit(&part, control, place, diag);
}

/* How far a fit misses all constraints; false after reporting. */
static bool measure(selection *s, const zs_rbf *rbf, const zs_control *control, zs_diag *diag)
{
  const size_t n = s->problem->count;
  if (!zs_rbf_values(rbf, s->clusters->points, n, s->misses, control, diag))
    return false;
  s->worst = 0;
  for (size_t i = 0; i < n; i++) {
    s->misses[i] = fabs(s->misses[i] - s->values[i]);
    s->worst = fmax(s->worst, s->misses[i]);
  }
  return true;
}

static size_t smaller(size_t a, size_t b)
{
  return a < b ? a : b;
}

static zs_rbf *run(selection *s, size_t budget, double tolerance, const zs_control *control,
                   const zs_place *place, zs_diag *diag)
{
  const size_t first = (size_t)(BEGIN * (double)budget);
  choose(s, smaller(budget, first > FEWEST ? first : FEWEST), -1);
  double seconds = 0;
  while (true) {
    const size_t before = s->used_count;
    zs_rbf *rbf = fit_chosen(s, control, place, diag);
    if (!rbf)
      return NULL;
    rbf->seconds = seconds += rbf->seconds;
    if (!measure(s, rbf, control, diag)) {
      zs_rbf_free(rbf);
      return NULL;
    }
    rbf->residual = s->worst;
    if (s->worst > tolerance && before < budget)
      choose(s, smaller(budget - before, (size_t)ceil((GROWTH - 1) * (double)before)), tolerance);
    if (s->used_count == before)
      return rbf;
    zs_rbf_free(rbf);
  }
}

zs_rbf *zs_rbf_fit_greedily(const zs_rbf_problem *problem, size_t budget, double tolerance,
                            bool strict, const zs_control *control, const zs_place *place,
                            zs_diag *diag)
{
  selection s;
  zs_rbf *rbf = NULL;
  if (problem->count <= FEWEST)
    return zs_rbf_fit(problem, control, place, diag);
  budget = smaller(budget, problem->count);
  if (!make(&s, problem))
    zs_fail_memory(diag);
  else
    rbf = run(&s, budget, tolerance, control, place, diag);
  if (rbf && strict && s.worst > tolerance && budget < problem->count)
    zs_report(diag, ZS_WARNING, ZS_ERROR_UNABLE, place, "raise the budget or the tolerance",
              "with %zu of the %zu constraints, others are missed by up to %.3g, more than the "
              "tolerance of %.3g", budget, problem->count, s.worst, tolerance);
  clear(&s);
  return rbf;
}
