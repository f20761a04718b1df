#include "nodes/space_time.h"

#include "nodes/common.h"

/* How near to the ends of time the half-spaces' functions stop growing, over its length. */
static const double NEAREST = 1e-7;

static zs_value less_number(zs_compiler *compiler, zs_value a, double number)
{
  return zs_emit(compiler, ZS_FUNCTION_SUBTRACT, a, zs_emit_constant(compiler, number), 0);
}

static zs_value intersection(zs_compiler *compiler, zs_value a, zs_value b)
{
  const zs_blend r0 = {.side = ZS_BLEND_INTERSECTION};
  return zs_emit_operation(compiler, &zs_r_alpha, &r0, a, b, 0);
}

/* The time since `min`, or until `max`. */
static zs_value time_to(zs_compiler *compiler, const zs_space_time *blend, zs_value t, bool end)
{
  return end ? zs_emit(compiler, ZS_FUNCTION_SUBTRACT, zs_emit_constant(compiler, blend->max), t, 0)
             : less_number(compiler, t, blend->min);
}

/* a / d where d is the time to an end, which is a at the plane. */
static zs_value rising(zs_compiler *compiler, const zs_space_time *blend, double a, zs_value d)
{
  const double nearest = NEAREST * (blend->max - blend->min);
  d = zs_emit(compiler, ZS_FUNCTION_MAXIMUM, d, zs_emit_constant(compiler, nearest), 0);
  return zs_emit(compiler, ZS_FUNCTION_DIVIDE, zs_emit_constant(compiler, a), d, 0);
}

/* A function of the half-space t <= plane: plane - t near the plane, but endless at `min` and
 * minus that at `max`, so that an R-function with it is the other operand there.  With u and v
 * the reciprocal times to the ends, 1 at the plane, it is u^2 - v^2 but for a factor, and
 * written without that difference of large numbers.  Poles of second order let R-functions
 * come to the other operand without a kink. */
static zs_value until(zs_compiler *compiler, const zs_space_time *blend, double plane, zs_value t)
{
  const zs_function multiply = ZS_FUNCTION_MULTIPLY;
  const zs_value u =
    rising(compiler, blend, plane - blend->min, time_to(compiler, blend, t, false));
  const zs_value v = rising(compiler, blend, blend->max - plane, time_to(compiler, blend, t, true));
  const zs_value left = zs_emit_negated(compiler, less_number(compiler, t, plane));
  const zs_value growth =
    zs_emit(compiler, multiply, zs_emit(compiler, multiply, u, v, 0),
            zs_emit_scaled(compiler, zs_emit(compiler, ZS_FUNCTION_ADD, u, v, 0), 0.5), 0);
  return zs_emit(compiler, multiply, left, growth, 0);
}

/* A shape while h >= 0, smoothed where it ends within `bound`. */
static zs_value half_cylinder(zs_compiler *compiler, const zs_space_time *blend, double reach,
                              zs_value f, zs_value h, zs_value bound)
{
  const zs_value sharp = intersection(compiler, f, h);
  if (blend->smoothing == 0)
    return sharp;
  const zs_bounded_blend smooth = {blend->smoothing, reach, blend->blend.a3, blend->blend.a3};
  return zs_emit(compiler, ZS_FUNCTION_ADD, sharp,
                 zs_bounded_displacement_emit(compiler, &smooth, f, h, bound), 0);
}

zs_value zs_space_time_emit(zs_compiler *compiler, const zs_space_time *blend, zs_value f1,
                            zs_value f2, zs_value t, const zs_value *bound)
{
  const zs_value first = until(compiler, blend, blend->end, t);
  const zs_value second = zs_emit_negated(compiler, until(compiler, blend, blend->start, t));
  /* Smoothing begins half-way from an end of time to the plane. */
  const zs_value since = less_number(compiler, t, (blend->min + blend->end) / 2);
  const zs_value rest = zs_emit_negated(
    compiler, less_number(compiler, t, (blend->max + blend->start) / 2));
  const zs_value g1 = half_cylinder(compiler, blend, blend->blend.a1, f1, first, since);
  const zs_value g2 = half_cylinder(compiler, blend, blend->blend.a2, f2, second, rest);
  zs_value during = intersection(compiler, time_to(compiler, blend, t, false),
                                 time_to(compiler, blend, t, true));
  if (bound)
    during = zs_emit(compiler, ZS_FUNCTION_MINIMUM, during, *bound, 0);
  return zs_bounded_blend_emit(compiler, ZS_BLEND_UNION, &blend->blend, g1, g2, during);
}
