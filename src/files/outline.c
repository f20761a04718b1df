#include "files/outline.h"

#include "base/array.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MOST_CHORDS = 1 << 14, /* of one curve */
  MOST_POINTS = 1 << 24  /* of one shape */
};

void zs_outline_clear(zs_outline *outline)
{
  free(outline->strokes);
  free(outline->shapes);
  *outline = (zs_outline){0};
}

bool zs_outline_begin(zs_outline *o, bool even_odd)
{
  zs_outline_shape *shapes =
    zs_array_grown(o->shapes, o->shape_count + 1, &o->shape_capacity, sizeof *shapes);
  if (!shapes)
    return false;
  o->shapes = shapes;
  shapes[o->shape_count++] = (zs_outline_shape){o->stroke_count, even_odd};
  return true;
}

static void map_point(const double map[6], double p[2], bool direction)
{
  const double x = p[0], y = p[1];
  p[0] = map[0] * x + map[2] * y + (direction ? 0 : map[4]);
  p[1] = map[1] * x + map[3] * y + (direction ? 0 : map[5]);
}

bool zs_outline_add(zs_outline *o, const zs_stroke *stroke, const double map[6])
{
  zs_stroke *strokes =
    zs_array_grown(o->strokes, o->stroke_count + 1, &o->stroke_capacity, sizeof *strokes);
  if (!strokes)
    return false;
  o->strokes = strokes;
  zs_stroke *s = &strokes[o->stroke_count++];
  *s = *stroke;
  if (s->kind == ZS_STROKE_ARC) {
    map_point(map, s->p[0], false);
    map_point(map, s->p[1], true);
    map_point(map, s->p[2], true);
    map_point(map, s->p[4], false);
  } else {
    for (int i = 0; i < (s->kind == ZS_STROKE_CUBIC ? 3 : 1); i++)
      map_point(map, s->p[i], false);
  }
  return true;
}

static void enclose(double lo[2], double hi[2], double x, double y)
{
  lo[0] = fmin(lo[0], x);
  lo[1] = fmin(lo[1], y);
  hi[0] = fmax(hi[0], x);
  hi[1] = fmax(hi[1], y);
}

bool zs_outline_box(const zs_outline *o, double lo[2], double hi[2])
{
  lo[0] = lo[1] = INFINITY;
  hi[0] = hi[1] = -INFINITY;
  for (size_t i = 0; i < o->stroke_count; i++) {
    const zs_stroke *s = &o->strokes[i];
    if (s->kind == ZS_STROKE_ARC) {
      const double x = hypot(s->p[1][0], s->p[2][0]), y = hypot(s->p[1][1], s->p[2][1]);
      enclose(lo, hi, s->p[0][0] - x, s->p[0][1] - y);
      enclose(lo, hi, s->p[0][0] + x, s->p[0][1] + y);
    } else {
      for (int k = 0; k < (s->kind == ZS_STROKE_CUBIC ? 3 : 1); k++)
        enclose(lo, hi, s->p[k][0], s->p[k][1]);
    }
  }
  return o->stroke_count > 0;
}

/* ---- Chords ---------------------------------------------------------------------------- */

static size_t chords(double number)
{
  return number < 1 ? 1 : number > MOST_CHORDS ? MOST_CHORDS : (size_t)ceil(number);
}

static double second_difference(const double a[2], const double b[2], const double c[2])
{
  return hypot(a[0] - 2 * b[0] + c[0], a[1] - 2 * b[1] + c[1]);
}

/* A curve whose second derivative is at most m leaves its n chords by no more than
 * m / 8 n^2 (that of a cubic is six times its larger second difference). */
static size_t cubic_chords(const double from[2], const zs_stroke *s, double tolerance)
{
  const double a = second_difference(from, s->p[0], s->p[1]);
  const double b = second_difference(s->p[0], s->p[1], s->p[2]);
  return chords(sqrt(0.75 * fmax(a, b) / tolerance));
}

/* The image of a circle of radius 1 under a map that stretches by no more than r. */
static size_t arc_chords(const zs_stroke *s, double tolerance)
{
  const double r = hypot(hypot(s->p[1][0], s->p[1][1]), hypot(s->p[2][0], s->p[2][1]));
  const double step = tolerance < r ? 2 * acos(1 - tolerance / r) : 3;
  const size_t n = chords(fabs(s->p[3][1] - s->p[3][0]) / step);
  return n < 4 ? 4 : n;
}

static void point_of(const double from[2], const zs_stroke *s, double t, double point[2])
{
  const double r = 1 - t;
  for (int k = 0; k < 2; k++)
    if (s->kind == ZS_STROKE_CUBIC) {
      point[k] = r * r * r * from[k] + 3 * r * r * t * s->p[0][k] + 3 * r * t * t * s->p[1][k] +
                 t * t * t * s->p[2][k];
    } else {
      const double angle = s->p[3][0] + t * (s->p[3][1] - s->p[3][0]);
      point[k] = s->p[0][k] + s->p[1][k] * cos(angle) + s->p[2][k] * sin(angle);
    }
}

static bool add_chords(zs_rings *rings, const double from[2], const zs_stroke *s, size_t count)
{
  for (size_t i = 1; i < count; i++) {
    double point[2];
    point_of(from, s, (double)i / (double)count, point);
    if (!zs_rings_add_point(rings, point))
      return false;
  }
  return true;
}

bool zs_outline_flatten(const zs_outline *o, size_t shape, double tolerance, zs_rings *rings,
                        zs_diag *diag)
{
  const size_t last = shape + 1 < o->shape_count ? o->shapes[shape + 1].first : o->stroke_count;
  double from[2] = {0, 0};
  *rings = (zs_rings){0};
  bool memory = true;
  for (size_t i = o->shapes[shape].first; memory && i < last; i++) {
    const zs_stroke *s = &o->strokes[i];
    const double *to = s->p[0];
    if (s->kind == ZS_STROKE_CUBIC) {
      to = s->p[2];
      memory = add_chords(rings, from, s, cubic_chords(from, s, tolerance));
    } else if (s->kind == ZS_STROKE_ARC) {
      to = s->p[4];
      memory = add_chords(rings, from, s, arc_chords(s, tolerance));
    } else if (s->kind == ZS_STROKE_MOVE) {
      memory = zs_rings_end(rings);
    }
    memory = memory && zs_rings_add_point(rings, to);
    memcpy(from, to, sizeof from);
    if (rings->point_count > MOST_POINTS) {
      zs_rings_clear(rings);
      return zs_fail(diag, ZS_ERROR_MEMORY, NULL, "an outline of more than %d points", MOST_POINTS);
    }
  }
  if (memory && zs_rings_end(rings))
    return true;
  zs_rings_clear(rings);
  return zs_fail_memory(diag);
}
