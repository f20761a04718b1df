/* D of a warp at a point: what its definition and its kernels share. */
#ifndef ZS_WARP_POINT_H
#define ZS_WARP_POINT_H

#include "samples/warp.h"

#include <math.h>
#include <string.h>
#if defined __FMA__
#include <immintrin.h>
#endif

/* Uniform cubic B-splines from one control point to the next, by the part t of the way. */
static inline void zs_warp_weigh(double t, double w[4])
{
  const double s = 1 - t;
  w[0] = s * s * s / 6;
  w[1] = 2.0 / 3 - t * t * (1 - 0.5 * t);
  w[2] = 2.0 / 3 - s * s * (1 - 0.5 * s);
  w[3] = t * t * t / 6;
}

static inline void zs_warp_weigh_slope(double t, double d[4])
{
  const double s = 1 - t;
  d[0] = -0.5 * s * s;
  d[1] = t * (1.5 * t - 2);
  d[2] = s * (2 - 1.5 * s);
  d[3] = 0.5 * t * t;
}

/* Where a coordinate is: the padded index of the first of four control points; beyond the
 * reach of those that move, at its end. */
static inline size_t zs_warp_cell(uint32_t size, double at, double *t)
{
  const double least = -2, most = (double)size + 1;
  const double x = at > least ? at < most ? at : most : least; /* NaN is least */
  double cell = floor(x);
  if (cell > most - 1)
    cell = most - 1;
  *t = x - cell;
  return (size_t)(cell + ZS_WARP_PADDING - 1);
}

typedef double zs_warp_vector __attribute__((vector_size(32)));

/* c += a b, rounded once where the machine can; passed by address, since vectors are returned
 * in other ways with other instruction sets. */
static inline void zs_warp_add(zs_warp_vector *c, double a, const zs_warp_vector *b)
{
#if defined __FMA__
  *c = (zs_warp_vector)_mm256_fmadd_pd(_mm256_set1_pd(a), (__m256d)*b, (__m256d)*c);
#else
  *c += a * *b;
#endif
}

/* Four numbers that may not be aligned. */
static inline void zs_warp_load(zs_warp_vector *v, const double from[4])
{
  memcpy(v, from, sizeof *v);
}

static inline void zs_warp_evaluate(const zs_warp *warp, const double at[3], double value[3],
                                    double slope[3][3])
{
  size_t first[3];
  double w[3][4], d[3][4];
  for (int k = 0; k < 3; k++) {
    double t;
    first[k] = zs_warp_cell(warp->size[k], at[k], &t);
    zs_warp_weigh(t, w[k]);
    zs_warp_weigh_slope(t, d[k]);
  }
  const size_t row = warp->size[0] + 2 * ZS_WARP_PADDING;
  const size_t layer = row * (warp->size[1] + 2 * ZS_WARP_PADDING);
  zs_warp_vector sum = {0}, by[3] = {{0}, {0}, {0}};
  for (size_t k = 0; k < 4; k++) {
    zs_warp_vector f = {0}, fx = {0}, fy = {0};
    for (size_t j = 0; j < 4; j++) {
      const double(*p)[4] = (const double(*)[4])warp->moves + (first[2] + k) * layer +
                            (first[1] + j) * row + first[0];
      zs_warp_vector along = {0}, slopes = {0};
      for (size_t i = 0; i < 4; i++) {
        zs_warp_vector own;
        zs_warp_load(&own, p[i]);
        zs_warp_add(&along, w[0][i], &own);
        if (slope)
          zs_warp_add(&slopes, d[0][i], &own);
      }
      zs_warp_add(&f, w[1][j], &along);
      if (slope) {
        zs_warp_add(&fx, w[1][j], &slopes);
        zs_warp_add(&fy, d[1][j], &along);
      }
    }
    zs_warp_add(&sum, w[2][k], &f);
    if (slope) {
      zs_warp_add(&by[0], w[2][k], &fx);
      zs_warp_add(&by[1], w[2][k], &fy);
      zs_warp_add(&by[2], d[2][k], &f);
    }
  }
  for (int k = 0; k < 3; k++) {
    value[k] = sum[k];
    for (int j = 0; j < 3 && slope; j++)
      slope[k][j] = by[j][k];
  }
}

/* ---- The inverse ------------------------------------------------------------------ */

/* How far y + D(y) may be from x: as near as double precision gets, or single; or so that the
 * derivatives are as near, too. */
static const double ZS_WARP_EXACT = 1e-11, ZS_WARP_SINGLE = 1e-6, ZS_WARP_SMOOTH = 1e-9;

/* How far the lattice reaches beyond its control points. */
static const double ZS_WARP_REACH = 2;

static inline double zs_warp_length(const zs_warp *warp, int axis)
{
  return warp->size[axis] - 1 + 2 * ZS_WARP_REACH;
}

/* The determinant of 1 + d. */
static inline double zs_warp_determinant_of(const double d[3][3])
{
  const double a = 1 + d[0][0], e = 1 + d[1][1], i = 1 + d[2][2];
  return a * (e * i - d[1][2] * d[2][1]) - d[0][1] * (d[1][0] * i - d[1][2] * d[2][0]) +
         d[0][2] * (d[1][0] * d[2][1] - e * d[2][0]);
}

/* The inverse of 1 + d; false when it is nearly singular. */
static inline bool zs_warp_invert(const double d[3][3], double inverse[3][3])
{
  const double determinant = zs_warp_determinant_of(d);
  if (!(fabs(determinant) > 1e-9))
    return false;
  double m[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      m[i][j] = d[i][j] + (i == j);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const int r = (j + 1) % 3, s = (j + 2) % 3, u = (i + 1) % 3, v = (i + 2) % 3;
      inverse[i][j] = (m[r][u] * m[s][v] - m[r][v] * m[s][u]) / determinant;
    }
  return true;
}

/* A place on the way to the inverse of x: x + e, how far it is from being one, and the
 * derivatives of D there. */
typedef struct zs_warp_step {
  double e[3], residual[3], most;
  double slope[3][3];
} zs_warp_step;

static inline void zs_warp_examine(const zs_warp *warp, const double x[3], zs_warp_step *s)
{
  const double y[3] = {x[0] + s->e[0], x[1] + s->e[1], x[2] + s->e[2]};
  zs_warp_evaluate(warp, y, s->residual, s->slope);
  s->most = 0;
  for (int k = 0; k < 3; k++) {
    s->residual[k] += s->e[k];
    if (!(fabs(s->residual[k]) <= s->most))
      s->most = fabs(s->residual[k]);
  }
}

/* How far from being an inverse a whole step of Newton's method ends at most, by Taylor's
 * theorem. */
static inline double zs_warp_remainder(const zs_warp *warp, const zs_warp_step *s,
                                       const double e[3])
{
  const double way = fabs(e[0] - s->e[0]) + fabs(e[1] - s->e[1]) + fabs(e[2] - s->e[2]);
  const double *bend = warp->all.bend;
  const double most = bend[0] > bend[1] ? bend[0] : bend[1];
  return 0.5 * (most > bend[2] ? most : bend[2]) * way * way;
}

/* Newton's method with steps that are halved until they lead nearer; steps that must lead near
 * enough are not examined, and leave the derivatives as they were. */
static inline bool zs_warp_newton(const zs_warp *warp, const double x[3], double tolerance,
                                  zs_warp_step *s)
{
  enum { STEPS = 40, HALVINGS = 12 };
  zs_warp_examine(warp, x, s);
  for (int n = 0; n < STEPS && s->most > tolerance; n++) {
    double inverse[3][3], way = 1;
    if (!zs_warp_invert((const double(*)[3])s->slope, inverse))
      return false;
    zs_warp_step next;
    for (int h = 0; h < HALVINGS; h++, way /= 2) {
      for (int k = 0; k < 3; k++)
        next.e[k] = s->e[k] - way * (inverse[k][0] * s->residual[0] +
                                     inverse[k][1] * s->residual[1] +
                                     inverse[k][2] * s->residual[2]);
      if (h == 0 && zs_warp_remainder(warp, s, next.e) <= tolerance) {
        memcpy(s->e, next.e, sizeof next.e);
        return true;
      }
      zs_warp_examine(warp, x, &next);
      if (next.most < s->most)
        break;
    }
    if (!(next.most < s->most)) /* far out rounding is larger than the tolerance */
      return s->most <= 100 * ZS_WARP_EXACT;
    *s = next;
  }
  return s->most <= tolerance;
}

/* The displacement between the starts around a point. */
static inline void zs_warp_find_start(const zs_warp *warp, const double x[3], double e[3])
{
  size_t first[3];
  double t[3];
  for (int k = 0; k < 3; k++) {
    const double last = warp->starts[k] - 1.0;
    const double at = fmin(fmax((x[k] + ZS_WARP_REACH) / zs_warp_length(warp, k) * last, 0), last);
    const double cell = fmin(floor(at), last - 1);
    first[k] = (size_t)cell;
    t[k] = at - cell;
  }
  e[0] = e[1] = e[2] = 0;
  for (unsigned corner = 0; corner < 8; corner++) {
    size_t index[3];
    double w = 1;
    for (unsigned k = 0; k < 3; k++) {
      index[k] = first[k] + (corner >> k & 1);
      w *= corner >> k & 1 ? t[k] : 1 - t[k];
    }
    const float *start =
      warp->start[(index[2] * warp->starts[1] + index[1]) * warp->starts[0] + index[0]];
    for (int k = 0; k < 3; k++)
      e[k] += w * (double)start[k];
  }
}

/* Whether x is out of the reach of all that moves. */
static inline bool zs_warp_is_beyond(const zs_warp *warp, const double x[3])
{
  for (int k = 0; k < 3; k++)
    if (x[k] - warp->all.hi[k] > (double)warp->size[k] + 1 || x[k] - warp->all.lo[k] < -2)
      return true;
  return false;
}

/* zs_warp_inverse (warp.h), to a tolerance. */
static inline bool zs_warp_solve(const zs_warp *warp, const double x[3], double tolerance,
                                 double value[3], double slope[3][3])
{
  zs_warp_step s = {.e = {0}};
  bool found = zs_warp_is_beyond(warp, x);
  if (!found && warp->start) {
    zs_warp_find_start(warp, x, s.e);
    found = zs_warp_newton(warp, x, tolerance, &s);
  }
  if (!found) { /* from one step back */
    zs_warp_evaluate(warp, x, s.e, NULL);
    for (int k = 0; k < 3; k++)
      s.e[k] = -s.e[k];
    found = zs_warp_newton(warp, x, tolerance, &s);
  }
  if (!found) {
    double y[3] = {x[0], x[1], x[2]};
    for (int n = 0; n < ZS_WARP_SUBSTITUTIONS; n++) {
      zs_warp_evaluate(warp, y, s.e, s.slope);
      for (int k = 0; k < 3; k++) {
        s.e[k] = -s.e[k];
        y[k] = x[k] + s.e[k];
      }
    }
    /* Bounds count on the inverse being found where it is near there. */
    zs_warp_step last = s;
    found = zs_warp_newton(warp, x, tolerance, &last);
    if (found)
      s = last;
  }
  memcpy(value, s.e, sizeof s.e);
  double inverse[3][3];
  const bool regular = slope && found && zs_warp_invert((const double(*)[3])s.slope, inverse);
  for (int k = 0; k < 3 && slope; k++)
    for (int j = 0; j < 3; j++)
      slope[k][j] = regular ? inverse[k][j] - (k == j) : -s.slope[k][j];
  return found;
}

#endif
