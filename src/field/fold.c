#include "field/fold.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static double clamped(double x, double least, double most)
{
  return x < least ? least : x > most ? most : x;
}

/* What is to be taken away at a part `phi` of a cell before its end. */
static double faded_by(double phi, bool first, double fade, double step)
{
  const double left = first ? phi : 1 - phi;
  return left < fade ? step * (fade - left) / left : 0;
}

/* ---- Along an axis ------------------------------------------------------------- */

static double fold_reference(const void *data, const double in[])
{
  const zs_fold *f = data;
  const double c = f->row[0] * in[0] + f->row[1] * in[1] + f->row[2] * in[2] + f->row[3];
  const double place = c / f->step - f->shift, cell = ceil(place);
  if (f->part != ZS_FOLD_PLACE)
    return faded_by(cell - place, f->part == ZS_FOLD_FADE_FIRST, f->fade, f->step);
  return c - f->step * clamped(cell + f->place, f->least, f->most);
}

static unsigned fold_used(const void *data)
{
  const double *r = ((const zs_fold *)data)->row;
  return (r[0] != 0) | (unsigned)(r[1] != 0) << 1 | (unsigned)(r[2] != 0) << 2;
}

ZS_DEFINE_KERNEL_TABLE(zs_fold_root_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_fold_registers_kernels)

static const zs_operation fold_root = {.name = "fold",
                                       .arity = 3,
                                       .data_size = sizeof(zs_fold),
                                       .used = fold_used,
                                       .kernels = zs_fold_root_kernels_table,
                                       .reference = fold_reference};
static const zs_operation fold_registers = {.name = "fold registers",
                                            .arity = 3,
                                            .data_size = sizeof(zs_fold),
                                            .used = fold_used,
                                            .kernels = zs_fold_registers_kernels_table,
                                            .reference = fold_reference};

zs_value zs_emit_fold(zs_compiler *compiler, const zs_coordinates *at, int axis,
                      const zs_fold *fold)
{
  zs_fold own = *fold;
  for (size_t j = 0; j < 4; j++) { /* no -0: equal rows must be equal bytes */
    const double number = at->matrix[4 * (size_t)axis + j];
    own.row[j] = number == 0 ? 0 : number;
  }
  return zs_emit_operation(compiler, at->root ? &fold_root : &fold_registers, &own, at->base[0],
                           at->base[1], at->base[2]);
}

/* ---- Around an axis ------------------------------------------------------------- */

static double turn_reference(const void *data, const double in[])
{
  const zs_turn *t = data;
  const double place = (in[2] - t->zero) / t->step - t->shift, cell = ceil(place);
  if (t->part >= ZS_TURN_FADE_FIRST)
    return faded_by(cell - place, t->part == ZS_TURN_FADE_FIRST, t->fade, t->length);
  const double angle = t->start + t->step * clamped(cell + t->place, t->least, t->most);
  return t->part == ZS_TURN_X ? in[0] * cos(angle) + in[1] * sin(angle)
                              : in[1] * cos(angle) - in[0] * sin(angle);
}

/* Points of the plane between two radii and two angles. */
typedef struct sector {
  double near, far, from, to;
} sector;

/* The sector around a rectangle; all angles when it holds the origin. */
static sector sector_around(const double lo[2], const double hi[2])
{
  double least[2], most[2];
  for (int k = 0; k < 2; k++) {
    least[k] = fmax(0, fmax(lo[k], -hi[k]));
    most[k] = fmax(-lo[k], hi[k]);
  }
  sector s = {hypot(least[0], least[1]), hypot(most[0], most[1]), -PI, PI};
  if (s.near == 0)
    return s;
  const double middle = atan2((lo[1] + hi[1]) / 2, (lo[0] + hi[0]) / 2);
  s.from = s.to = middle;
  for (int corner = 0; corner < 4; corner++) {
    const double angle = atan2(corner & 2 ? hi[1] : lo[1], corner & 1 ? hi[0] : lo[0]);
    const double apart = remainder(angle - middle, 2 * PI);
    s.from = fmin(s.from, middle + apart);
    s.to = fmax(s.to, middle + apart);
  }
  return s;
}

static void take_in(double result[2], double lo, double hi)
{
  result[0] = fmin(result[0], lo);
  result[1] = fmax(result[1], hi);
}

/* The range of r cos(angle), angles and radii of a sector. */
static void take_in_cosines(double result[2], const sector *s)
{
  double least = fmin(cos(s->from), cos(s->to)), most = fmax(cos(s->from), cos(s->to));
  if (ceil(s->from / (2 * PI)) * 2 * PI <= s->to)
    most = 1;
  if (ceil((s->from - PI) / (2 * PI)) * 2 * PI + PI <= s->to)
    least = -1;
  take_in(result, least * (least < 0 ? s->far : s->near), most * (most < 0 ? s->near : s->far));
}

/* Candidates of the points of a rectangle whose angles are in a range. */
static void take_in_turned(double result[2], const zs_turn *t, const double lo[2],
                           const double hi[2], sector s)
{
  const double slack = 2e-6 * (1 + fabs(t->zero) / t->step + PI / t->step);
  const double from = (s.from - t->zero) / t->step - t->shift - slack;
  const double to = (s.to - t->zero) / t->step - t->shift + slack;
  const double first = ceil(from), last = ceil(to);
  if (t->part >= ZS_TURN_FADE_FIRST) {
    const bool ascending = t->part == ZS_TURN_FADE_FIRST;
    const double least = first == last ? fmax(0, first - to) : 0;
    const double most = first == last ? fmin(1, first - from) : 1;
    take_in(result, faded_by(ascending ? most : least, ascending, t->fade, t->length),
            faded_by(ascending ? least : most, ascending, t->fade, t->length));
    return;
  }
  const double a = clamped(first + t->place, t->least, t->most);
  const double b = clamped(last + t->place, t->least, t->most);
  if (a == b) {
    const double angle = t->start + t->step * a;
    const double k[2] = {t->part == ZS_TURN_X ? cos(angle) : -sin(angle),
                         t->part == ZS_TURN_X ? sin(angle) : cos(angle)};
    double sum[2] = {0, 0};
    for (int i = 0; i < 2; i++) {
      sum[0] += k[i] * (k[i] > 0 ? lo[i] : hi[i]);
      sum[1] += k[i] * (k[i] > 0 ? hi[i] : lo[i]);
    }
    take_in(result, sum[0], sum[1]);
    return;
  }
  /* Angles in the copies' own coordinates: from the sector's beginning in its first cell, or
   * that of a cell, to the end in its last. */
  const double turned = t->zero - t->start;
  const double begin = (t->shift - 1 - t->place - slack) * t->step + turned;
  const double end = (t->shift - t->place + slack) * t->step + turned;
  s.from = fmin(s.from - t->start - t->step * a, begin);
  s.to = fmax(s.to - t->start - t->step * b, end);
  if (t->part == ZS_TURN_Y) { /* sin(angle) = cos(angle - pi / 2) */
    s.from -= PI / 2;
    s.to -= PI / 2;
  }
  take_in_cosines(result, &s);
}

/* Where angles jump, behind the origin, the range is taken in two parts. */
void zs_turn_bounds(const zs_turn *turn, const double lo[2], const double hi[2],
                    double result[2])
{
  const sector s = sector_around(lo, hi);
  result[0] = INFINITY;
  result[1] = -INFINITY;
  sector inner = s;
  inner.from = fmax(s.from, -PI);
  inner.to = fmin(s.to, PI);
  take_in_turned(result, turn, lo, hi, inner);
  sector beyond = s;
  if (s.to > PI) {
    beyond.from = -PI;
    beyond.to = s.to - 2 * PI;
    take_in_turned(result, turn, lo, hi, beyond);
  } else if (s.from < -PI) {
    beyond.from = s.from + 2 * PI;
    beyond.to = PI;
    take_in_turned(result, turn, lo, hi, beyond);
  }
  const double error = turn->part < ZS_TURN_FADE_FIRST ? 2e-6 * s.far : 0;
  result[0] -= error;
  result[1] += error;
}

ZS_DEFINE_KERNEL_TABLE(zs_turn_kernels)

static const zs_operation turn_operation = {.name = "turn",
                                            .arity = 3,
                                            .data_size = sizeof(zs_turn),
                                            .kernels = zs_turn_kernels_table,
                                            .reference = turn_reference};

zs_value zs_emit_turn(zs_compiler *compiler, zs_value x, zs_value y, zs_value angle,
                      const zs_turn *turn)
{
  return zs_emit_operation(compiler, &turn_operation, turn, x, y, angle);
}

/* ---- Fading ----------------------------------------------------------------------- */

static double faded_reference(const void *data, const double in[])
{
  (void)data;
  return in[0] - in[1];
}

/* Fading leaves f alone where f >= 0, and makes it less below. */
static zs_demand faded_demand(const void *data, zs_demand result)
{
  (void)data;
  return result.above >= 0 ? result : (zs_demand){INFINITY, INFINITY};
}

ZS_DEFINE_KERNEL_TABLE(zs_faded_kernels)

static const zs_operation faded = {.name = "faded",
                                   .arity = 2,
                                   .choice = true,
                                   .demand = faded_demand,
                                   .kernels = zs_faded_kernels_table,
                                   .reference = faded_reference};

zs_value zs_emit_faded(zs_compiler *compiler, zs_value f, zs_value fade)
{
  return zs_emit_operation(compiler, &faded, NULL, f, fade, 0);
}
