/* Block, gradient and bounds kernels of folds.  Compiled once per instruction set. */
#include "field/fold.h"

#include "field/interval.h"
#include "field/row.h"

#include <math.h>
#include <string.h>

#if defined ZS_HAVE_LIBMVEC && defined __GNUC__ && !defined __clang__
/* glibc's vector variants, without asking for -ffast-math. */
#define VECTOR __attribute__((simd("notinbranch"), const))
VECTOR float sinf(float);
VECTOR float cosf(float);
#undef VECTOR
#endif

static const float HALF_PI = 1.57079633f;

/* A fold in single precision.  Whole cells from the scene's origin to the frame's are taken
 * away in double precision, so that far copies are as exact as near ones. */
typedef struct cells {
  zs_row row;
  float step, inverse, shift, least, most, fade, length;
  float place; /* 0 for fades */
  int part;    /* a zs_fold_part */
} cells;

static cells cells_of(const zs_fold *f, const zs_frame *frame)
{
  double row[4] = {f->row[0], f->row[1], f->row[2], f->row[3]}, skipped = 0;
  if (frame) {
    double middle = row[3];
    for (int j = 0; j < 3; j++)
      middle += row[j] * frame->origin[j];
    skipped = rint(middle / f->step);
    skipped = skipped < f->least ? f->least : skipped > f->most ? f->most : skipped;
    if (isfinite(skipped))
      row[3] -= skipped * f->step;
    else
      skipped = 0;
  }
  return (cells){.row = frame ? zs_row_in_frame(row, frame) : zs_row_of_registers(row),
                 .step = (float)f->step,
                 .inverse = (float)(1 / f->step),
                 .shift = (float)f->shift,
                 .least = (float)(f->least - skipped),
                 .most = (float)(f->most - skipped),
                 .fade = (float)f->fade,
                 .length = (float)f->step,
                 .place = f->part == ZS_FOLD_PLACE ? (float)f->place : 0,
                 .part = f->part};
}

/* ---- Along an axis: values -------------------------------------------------------- */

static inline float ceiling(float x)
{
  return -floorf(-x);
}

static inline float candidate(const cells *c, float v)
{
  const float copy = ceiling(v * c->inverse - c->shift) + c->place;
  const float bounded = copy < c->least ? c->least : copy;
  return v - c->step * (bounded > c->most ? c->most : bounded);
}

/* How much of a cell is left for a candidate. */
static inline float left_of(const cells *c, float v)
{
  const float place = v * c->inverse - c->shift, phi = ceiling(place) - place;
  return c->part == ZS_FOLD_FADE_FIRST ? phi : 1 - phi;
}

static inline float faded_by(const cells *c, float left)
{
  return left < c->fade ? c->length * (c->fade - left) / left : 0;
}

/* d fade / d left */
static inline float fade_slope(const cells *c, float left)
{
  return left < c->fade && left > 0 ? -c->length * c->fade / (left * left) : 0;
}

static void finish_values(const cells *c, size_t n, float *v)
{
  if (c->part == ZS_FOLD_PLACE) {
#pragma omp simd
    for (size_t i = 0; i < n; i++)
      v[i] = candidate(c, v[i]);
  } else {
#pragma omp simd
    for (size_t i = 0; i < n; i++)
      v[i] = faded_by(c, left_of(c, v[i]));
  }
}

/* The row; inputs that it does not use may be anything. */
static void apply(zs_row r, const zs_block_arguments *x, bool perspective, unsigned k, float constant,
                  float *out)
{
  static const float none[ZS_BLOCK] = {0};
  for (size_t from = 0; from < x->n; from += ZS_BLOCK) {
    const float *p[3];
    for (int j = 0; j < 3; j++)
      p[j] = r.k[j] != 0 || perspective ? x->in[j] + k * ZS_BLOCK + from : none;
    const size_t n = x->n - from < ZS_BLOCK ? x->n - from : ZS_BLOCK;
    const float *u = p[0], *v = p[1], *w = p[2];
    float *to = out + from;
    if (perspective) {
#pragma omp simd
      for (size_t i = 0; i < n; i++)
        to[i] = constant + w[i] * (r.k[2] + u[i] * r.k[0] + v[i] * r.k[1]);
    } else {
#pragma omp simd
      for (size_t i = 0; i < n; i++)
        to[i] = constant + r.k[0] * u[i] + r.k[1] * v[i] + r.k[2] * w[i];
    }
  }
}

static void root_value(const zs_block_arguments *x)
{
  const cells c = cells_of(x->data, x->frame);
  apply(c.row, x, x->frame->perspective, 0, c.row.constant, x->out);
  finish_values(&c, x->n, x->out);
}

static void registers_value(const zs_block_arguments *x)
{
  const cells c = cells_of(x->data, NULL);
  apply(c.row, x, false, 0, c.row.constant, x->out);
  finish_values(&c, x->n, x->out);
}

/* Values and the derivatives of c are in the output's rows. */
static void finish_gradients(const cells *c, size_t n, float *out)
{
  if (c->part != ZS_FOLD_PLACE) {
    const float sign = c->part == ZS_FOLD_FADE_FIRST ? -c->inverse : c->inverse;
    for (size_t i = 0; i < n; i++) {
      const float slope = sign * fade_slope(c, left_of(c, out[i]));
      for (unsigned k = 1; k < 4; k++)
        out[k * ZS_BLOCK + i] *= slope;
    }
  }
  finish_values(c, n, out);
}

static void root_gradient(const zs_block_arguments *x)
{
  const cells c = cells_of(x->data, x->frame);
  apply(c.row, x, false, 0, c.row.constant, x->out);
  for (unsigned k = 1; k < 4; k++)
    for (size_t i = 0; i < x->n; i++)
      x->out[k * ZS_BLOCK + i] = c.row.k[k - 1];
  finish_gradients(&c, x->n, x->out);
}

static void registers_gradient(const zs_block_arguments *x)
{
  const cells c = cells_of(x->data, NULL);
  for (unsigned k = 0; k < 4; k++)
    apply(c.row, x, false, k, k ? 0 : c.row.constant, x->out + k * ZS_BLOCK);
  finish_gradients(&c, x->n, x->out);
}

/* ---- Along an axis: bounds --------------------------------------------------------- */

static double kept(const cells *c, double copy)
{
  return copy < (double)c->least ? (double)c->least : copy > (double)c->most ? (double)c->most : copy;
}

static zs_interval fade_bounds(const cells *c, double from, double to)
{
  const double cell = ceil(from);
  double least = 0, most = 1;
  if (cell == ceil(to)) {
    least = cell - to > 0 ? cell - to : 0;
    most = cell - from < 1 ? cell - from : 1;
  }
  const bool first = c->part == ZS_FOLD_FADE_FIRST;
  const float near = (float)(first ? least : 1 - most), far = (float)(first ? most : 1 - least);
  return zs_interval_widened(faded_by(c, far), faded_by(c, near), 8);
}

/* Within one cell exact; else from where the range begins in its first cell, or a cell does,
 * to where it ends in the last, or a cell does. */
static zs_interval fold_bounds(const cells *c, zs_interval v)
{
  if (!zs_interval_known(v))
    return zs_interval_unknown();
  const double step = (double)c->step, lo = (double)v.lo, hi = (double)v.hi;
  const double shift = (double)c->shift, inverse = (double)c->inverse;
  const double most = fmax(fabs(lo), fabs(hi));
  const double slack = 4e-7 * (most * inverse + fabs(shift) + 1);
  const double from = lo * inverse - shift - slack, to = hi * inverse - shift + slack;
  if (!(slack < 1e30)) /* infinite */
    return c->part == ZS_FOLD_PLACE ? zs_interval_unknown() : fade_bounds(c, 0.5, 1.5);
  if (c->part != ZS_FOLD_PLACE)
    return fade_bounds(c, from, to);
  const double a = kept(c, ceil(from) + (double)c->place), b = kept(c, ceil(to) + (double)c->place);
  double least = lo - step * a, greatest = hi - step * b;
  if (a != b) {
    least = fmin(least, step * (shift - 1 - (double)c->place - slack));
    greatest = fmax(greatest, step * (shift - (double)c->place + slack));
  }
  const double error = 4e-7 * (most + step * fmax(fabs(a), fabs(b)));
  return (zs_interval){(float)(least - error), (float)(greatest + error)};
}

static void finish_bounds(const cells *c, const zs_bounds_arguments *x)
{
  zs_bounds v;
  const bool perspective = x->frame && x->frame->perspective;
  ZS_FOR_PARTS(part)
    zs_intervals_store(&v, part,
                       perspective ? zs_row_perspective_bounds(c->row, x->in, part)
                                   : zs_row_bounds(c->row, x->in, part));
  for (unsigned l = 0; l < ZS_LANES; l++)
    zs_interval_to_lane(x->out, l, fold_bounds(c, zs_interval_of_lane(&v, l)));
}

static void root_bounds(const zs_bounds_arguments *x)
{
  const cells c = cells_of(x->data, x->frame);
  finish_bounds(&c, x);
}

static void registers_bounds(const zs_bounds_arguments *x)
{
  const cells c = cells_of(x->data, NULL);
  zs_bounds_arguments own = *x;
  own.frame = NULL;
  finish_bounds(&c, &own);
}

/* ---- Around an axis ----------------------------------------------------------------- */

/* Angles as a coordinate c, counted from `zero`. */
static cells turned_cells(const zs_turn *t)
{
  return (cells){.step = (float)t->step,
                 .inverse = (float)(1 / t->step),
                 .shift = (float)(t->shift + t->zero / t->step),
                 .least = (float)t->least,
                 .most = (float)t->most,
                 .fade = (float)t->fade,
                 .length = (float)t->length,
                 .place = t->part < ZS_TURN_FADE_FIRST ? (float)t->place : 0,
                 .part = t->part == ZS_TURN_FADE_FIRST ? ZS_FOLD_FADE_FIRST : ZS_FOLD_FADE_LAST};
}

/* By what the candidate of a point is turned, and a quarter less for the other row of the
 * rotation: (cos, sin) and (-sin, cos). */
static inline float turned_by(const cells *c, float start, float angle)
{
  const float copy = ceiling(angle * c->inverse - c->shift) + c->place;
  const float bounded = copy < c->least ? c->least : copy;
  return start + c->step * (bounded > c->most ? c->most : bounded);
}

static void turn_value(const zs_block_arguments *a)
{
  const zs_turn *t = a->data;
  const cells c = turned_cells(t);
  const float *x = a->in[0], *y = a->in[1], *angle = a->in[2];
  float *out = a->out;
  if (t->part >= ZS_TURN_FADE_FIRST) {
#pragma omp simd
    for (size_t i = 0; i < a->n; i++)
      out[i] = faded_by(&c, left_of(&c, angle[i]));
    return;
  }
  const float start = (float)t->start;
  const float sign = t->part == ZS_TURN_X ? 1.0f : -1.0f;
  const float *p = t->part == ZS_TURN_X ? x : y, *q = t->part == ZS_TURN_X ? y : x;
#pragma omp simd
  for (size_t i = 0; i < a->n; i++) {
    const float by = turned_by(&c, start, angle[i]);
    out[i] = p[i] * cosf(by) + sign * q[i] * cosf(by - HALF_PI);
  }
}

static void turn_gradient(const zs_block_arguments *a)
{
  const zs_turn *t = a->data;
  const cells c = turned_cells(t);
  const float *x = a->in[0], *y = a->in[1], *angle = a->in[2];
  float *out = a->out;
  const float start = (float)t->start;
  for (size_t i = 0; i < a->n; i++) {
    float kx, ky, v;
    if (t->part >= ZS_TURN_FADE_FIRST) {
      /* d angle = (x dy - y dx) / r^2 */
      const float left = left_of(&c, angle[i]), square = x[i] * x[i] + y[i] * y[i];
      const float sign = t->part == ZS_TURN_FADE_FIRST ? -c.inverse : c.inverse;
      const float slope = square > 0 ? sign * fade_slope(&c, left) / square : 0;
      kx = -y[i] * slope;
      ky = x[i] * slope;
      v = faded_by(&c, left);
    } else {
      const float by = turned_by(&c, start, angle[i]), cosine = cosf(by), sine = sinf(by);
      kx = t->part == ZS_TURN_X ? cosine : -sine;
      ky = t->part == ZS_TURN_X ? sine : cosine;
      v = x[i] * kx + y[i] * ky;
    }
    for (unsigned k = 1; k < 4; k++)
      out[k * ZS_BLOCK + i] = kx * x[k * ZS_BLOCK + i] + ky * y[k * ZS_BLOCK + i];
    out[i] = v;
  }
}

static void turn_bounds(const zs_bounds_arguments *a)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double lo[2], hi[2], result[2];
    for (int k = 0; k < 2; k++) {
      lo[k] = (double)a->in[k]->lo[l];
      hi[k] = (double)a->in[k]->hi[l];
    }
    zs_interval out = zs_interval_unknown();
    if (lo[0] <= hi[0] && lo[1] <= hi[1] && isfinite(lo[0] - hi[0]) && isfinite(lo[1] - hi[1])) {
      zs_turn_bounds(a->data, lo, hi, result);
      out = zs_interval_widened((float)result[0], (float)result[1], 8);
    }
    zs_interval_to_lane(a->out, l, out);
  }
}

/* ---- Fading --------------------------------------------------------------------------- */

static void faded_value(const zs_block_arguments *x)
{
  const float *f = x->in[0], *fade = x->in[1];
  float *out = x->out;
#pragma omp simd
  for (size_t i = 0; i < x->n; i++)
    out[i] = f[i] - fade[i];
}

/* Where nothing is taken away the fade's derivatives are of no account. */
static void faded_gradient(const zs_block_arguments *x)
{
  for (unsigned k = 4; k-- > 0;) {
    const float *f = x->in[0] + k * ZS_BLOCK, *fade = x->in[1] + k * ZS_BLOCK, *by = x->in[1];
    float *out = x->out + k * ZS_BLOCK;
#pragma omp simd
    for (size_t i = 0; i < x->n; i++)
      out[i] = f[i] - (by[i] > 0 ? fade[i] : 0);
  }
}

static void faded_bounds(const zs_bounds_arguments *x)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    const zs_interval f = zs_interval_of_lane(x->in[0], l);
    const zs_interval fade = zs_interval_of_lane(x->in[1], l);
    x->choice->copy[0] |= (uint16_t)((unsigned)(fade.hi == 0) << l);
    zs_interval_to_lane(x->out, l, fade.hi == 0 ? f : zs_interval_subtract(f, fade));
  }
}

const zs_kernels ZS_KERNELS(zs_fold_root_kernels) = {root_value, root_gradient, root_bounds};
const zs_kernels ZS_KERNELS(zs_fold_registers_kernels) = {registers_value, registers_gradient,
                                                          registers_bounds};
const zs_kernels ZS_KERNELS(zs_turn_kernels) = {turn_value, turn_gradient, turn_bounds};
const zs_kernels ZS_KERNELS(zs_faded_kernels) = {faded_value, faded_gradient, faded_bounds};
