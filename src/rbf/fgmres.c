#include "rbf/fgmres.h"

#include "base/memory.h"
#include "rbf/long_vector.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS = ZS_FGMRES_STEPS };

/* The norm must fall by this factor within so many steps. */
static const double PROGRESS = 0.7;
enum { PATIENCE = 6 };

/* A v[0] .. A v[m-1], preconditioned, by the basis v[0] .. v[m]: a matrix whose
 * subdiagonal was rotated away, column by column. */
typedef struct solver {
  const zs_fgmres *problem;
  double *basis, *steps;            /* vectors of n each */
  double triangle[STEPS][STEPS];    /* [column][row] */
  double cosine[STEPS], sine[STEPS];
  double right[STEPS + 1];          /* the last entry: what is left, up to sign */
} solver;

double zs_fgmres_bytes(size_t n)
{
  return (2.0 * STEPS + 1) * (double)n * sizeof(double);
}

/* Make w orthogonal to the first vectors of the basis, twice for the sake of
 * rounding, and note its parts. */
static void orthogonalise(const solver *s, unsigned vectors, double *w, double *parts)
{
  const size_t n = s->problem->n;
  for (unsigned i = 0; i < vectors; i++)
    parts[i] = 0;
  for (int pass = 0; pass < 2; pass++)
    for (unsigned i = 0; i < vectors; i++) {
      const double *v = s->basis + i * n, part = zs_long_dot(n, v, w);
      zs_long_add(n, -part, v, w);
      parts[i] += part;
    }
}

/* Rotate a new column as the ones before were, and then its last entry away. */
static void rotate(solver *s, unsigned column, const double *parts, double below)
{
  double *t = s->triangle[column], next = parts[0];
  for (unsigned i = 0; i < column; i++) {
    t[i] = s->cosine[i] * next + s->sine[i] * parts[i + 1];
    next = s->cosine[i] * parts[i + 1] - s->sine[i] * next;
  }
  const double length = hypot(next, below);
  s->cosine[column] = length > 0 ? next / length : 1;
  s->sine[column] = length > 0 ? below / length : 0;
  t[column] = length;
  s->right[column + 1] = -s->sine[column] * s->right[column];
  s->right[column] *= s->cosine[column];
}

/* Add the best combination of the first steps to x. */
static void combine(const solver *s, unsigned steps, double *x)
{
  double y[STEPS];
  for (unsigned i = steps; i-- > 0;) {
    y[i] = s->right[i];
    for (unsigned j = i + 1; j < steps; j++)
      y[i] -= s->triangle[j][i] * y[j];
    y[i] /= s->triangle[i][i];
  }
  for (unsigned i = 0; i < steps; i++)
    zs_long_add(s->problem->n, y[i], s->steps + i * s->problem->n, x);
}

/* One step; false when a callback stops it. */
static bool advance(solver *s, unsigned step)
{
  const zs_fgmres *p = s->problem;
  double *z = s->steps + step * p->n, *w = s->basis + (step + 1) * p->n;
  double parts[STEPS];
  if (!p->precondition(p->context, s->basis + step * p->n, z) || !p->multiply(p->context, z, w))
    return false;
  orthogonalise(s, step + 1, w, parts);
  const double below = sqrt(zs_long_dot(p->n, w, w));
  for (size_t i = 0; below > 0 && i < p->n; i++)
    w[i] /= below;
  rotate(s, step, parts, below);
  return p->step(p->context, fabs(s->right[step + 1]));
}

static zs_fgmres_result iterate(solver *s, const double *b, double norm, double *x)
{
  const size_t n = s->problem->n;
  double history[STEPS + 1];
  history[0] = s->right[0] = sqrt(zs_long_dot(n, b, b));
  if (s->right[0] <= norm)
    return ZS_FGMRES_DONE;
  for (size_t i = 0; i < n; i++)
    s->basis[i] = b[i] / s->right[0];
  zs_fgmres_result result = ZS_FGMRES_STALLED;
  unsigned step = 0;
  while (step < STEPS && result == ZS_FGMRES_STALLED) {
    if (!advance(s, step))
      return ZS_FGMRES_STOPPED;
    /* A singular matrix has nothing to add; a NaN is no progress either. */
    if (!(s->triangle[step][step] > 0) || !isfinite(s->right[step + 1]))
      break;
    step++;
    history[step] = fabs(s->right[step]);
    if (history[step] <= norm)
      result = ZS_FGMRES_DONE;
    else if (step >= PATIENCE && history[step] > PROGRESS * history[step - PATIENCE])
      break;
  }
  combine(s, step, x);
  return result;
}

zs_fgmres_result zs_fgmres_solve(const zs_fgmres *fgmres, const double *b, double norm, double *x)
{
  const size_t n = fgmres->n;
  solver *s = calloc(1, sizeof *s);
  zs_fgmres_result result = ZS_FGMRES_MEMORY;
  if (s) {
    s->problem = fgmres;
    s->basis = zs_memory_new((STEPS + 1) * n, sizeof *s->basis);
    s->steps = zs_memory_new(STEPS * n, sizeof *s->steps);
    if (s->basis && s->steps)
      result = iterate(s, b, norm, x);
    free(s->basis);
    free(s->steps);
  }
  free(s);
  return result;
}
