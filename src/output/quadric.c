#include "output/quadric.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Directions in which planes say less than this part of what they say in the
 * best one are left alone.  In a side of the box even an edge has one place that
 * is best, which the planes tell less clearly the flatter they cut the side. */
static const double INFORMATIVE = 0.02, INFORMATIVE_WITHIN = 0.002;

void zs_quadric_add(zs_quadric *q, const float normal[3], double distance)
{
  for (int k = 0; k < 3; k++) {
    q->b[k] += normal[k] * distance;
    for (int l = 0; l < 3; l++)
      q->a[k][l] += (double)normal[k] * normal[l];
  }
}

/* Turn the plane of axes p and q so that a[p][q] becomes 0. */
static void rotate(double a[3][3], double v[3][3], int p, int q)
{
  double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
  double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
  double c = 1 / sqrt(t * t + 1), s = t * c;
  for (int k = 0; k < 3; k++) {
    double x = a[k][p], y = a[k][q];
    a[k][p] = c * x - s * y;
    a[k][q] = s * x + c * y;
  }
  for (int k = 0; k < 3; k++) {
    double x = a[p][k], y = a[q][k];
    a[p][k] = c * x - s * y;
    a[q][k] = s * x + c * y;
    x = v[k][p];
    y = v[k][q];
    v[k][p] = c * x - s * y;
    v[k][q] = s * x + c * y;
  }
}

/* Jacobi's method. */
void zs_symmetric_diagonalize(double a[3][3], double v[3][3])
{
  static const int pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  enum { MOST_SWEEPS = 8 };
  const double rounding = 1e-17 * (fabs(a[0][0]) + fabs(a[1][1]) + fabs(a[2][2]));
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      v[i][j] = i == j;
  bool turned = true;
  for (int sweep = 0; sweep < MOST_SWEEPS && turned; sweep++) {
    turned = false;
    for (int n = 0; n < 3; n++) {
      int p = pairs[n][0], q = pairs[n][1];
      if (!(fabs(a[p][q]) > rounding))
        continue;
      rotate(a, v, p, q);
      turned = true;
    }
  }
}

/* ---- Minimizing --------------------------------------------------------------- */

/* A search for the best place in a box. */
typedef struct search {
  const zs_quadric *quadric;
  const double *lo, *hi;
  double largest; /* eigenvalue */
  double least, best[3];
} search;

/* Add to x the solution of a x = rest in the directions, the columns of v, whose
 * eigenvalues are more than `informative`. */
static void add_solution(double a[3][3], double v[3][3], const double rest[3], double informative,
                         double x[3])
{
  for (int k = 0; k < 3; k++) {
    if (!(a[k][k] > informative))
      continue;
    double along = (v[0][k] * rest[0] + v[1][k] * rest[1] + v[2][k] * rest[2]) / a[k][k];
    for (int l = 0; l < 3; l++)
      x[l] += along * v[l][k];
  }
}

/* The best place when only the axes that are not fixed may vary, whatever the
 * box. */
static void solve(const search *s, const bool fixed[3], double x[3])
{
  double a[3][3], v[3][3], rest[3] = {0};
  const double at[3] = {x[0], x[1], x[2]};
  for (int k = 0; k < 3; k++) {
    for (int l = 0; l < 3; l++)
      a[k][l] = fixed[k] || fixed[l] ? 0 : s->quadric->a[k][l];
    if (fixed[k])
      continue;
    rest[k] = s->quadric->b[k];
    for (int l = 0; l < 3; l++)
      rest[k] -= fixed[l] ? s->quadric->a[k][l] * x[l] : 0;
    x[k] = 0;
  }
  zs_symmetric_diagonalize(a, v);
  add_solution(a, v, rest, s->largest * INFORMATIVE_WITHIN, x);
  for (int k = 0; k < 3; k++)
    x[k] = fixed[k] ? at[k] : x[k];
}

/* The sum of squared distances, less a constant. */
static double energy(const zs_quadric *q, const double x[3])
{
  double sum = 0;
  for (int k = 0; k < 3; k++)
    sum += x[k] * (q->a[k][0] * x[0] + q->a[k][1] * x[1] + q->a[k][2] * x[2] - 2 * q->b[k]);
  return sum;
}

static void descend(search *s, const bool fixed[3], const double from[3]);

/* Take the best place for some fixed axes, or where it is out of the box the best
 * one within: that lies on one of the sides that it is beyond, as the sum is
 * convex. */
static void take(search *s, const bool fixed[3], const double x[3])
{
  bool within = true;
  for (int k = 0; k < 3; k++) {
    if (fixed[k] || (x[k] >= s->lo[k] && x[k] <= s->hi[k]))
      continue;
    bool more[3] = {fixed[0], fixed[1], fixed[2]};
    double side[3] = {x[0], x[1], x[2]};
    more[k] = true;
    side[k] = x[k] < s->lo[k] ? s->lo[k] : s->hi[k];
    descend(s, more, side);
    within = false;
  }
  double sum = energy(s->quadric, x);
  if (!within || !(sum < s->least))
    return;
  s->least = sum;
  memcpy(s->best, x, sizeof s->best);
}

static void descend(search *s, const bool fixed[3], const double from[3])
{
  double x[3];
  memcpy(x, from, sizeof x);
  solve(s, fixed, x);
  take(s, fixed, x);
}

unsigned zs_quadric_minimize(const zs_quadric *quadric, const double lo[3], const double hi[3],
                             double place[3])
{
  double a[3][3], v[3][3], largest = 0;
  bool fixed[3], any = false;
  unsigned rank = 0;
  memcpy(a, quadric->a, sizeof a);
  zs_symmetric_diagonalize(a, v);
  for (int k = 0; k < 3; k++)
    largest = fmax(largest, a[k][k]);
  for (int k = 0; k < 3; k++) {
    rank += a[k][k] > INFORMATIVE * largest;
    place[k] = fmin(fmax(0, lo[k]), hi[k]);
    fixed[k] = lo[k] >= hi[k];
    any = any || fixed[k];
  }
  search s = {.quadric = quadric,
              .lo = lo,
              .hi = hi,
              .largest = largest,
              .least = INFINITY,
              .best = {place[0], place[1], place[2]}};
  if (any) {
    descend(&s, fixed, place);
  } else {
    double x[3] = {0};
    add_solution(a, v, quadric->b, INFORMATIVE * largest, x);
    take(&s, fixed, x);
  }
  memcpy(place, s.best, sizeof s.best);
  return rank;
}
