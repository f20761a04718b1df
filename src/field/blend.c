/* The double-precision definitions of the blends. */
#include "field/blend.h"

#include "field/scalar.h"

#include <math.h>

static double r_alpha(const void *data, const double in[])
{
  const zs_blend *p = data;
  const double a = in[0], b = in[1], alpha = p->parameter[0];
  /* With one operand at infinity the R-functions tend to these. */
  if (isinf(a) || isinf(b))
    return p->side > 0 ? (a > b ? a : b) : (a < b ? a : b);
  double big = p->side * (fabs(a) > fabs(b) ? a : b), small = p->side * (fabs(a) > fabs(b) ? b : a);
  /* Of the union's two forms the one without cancellation: with
   * q = sqrt(a^2 + b^2 - 2 alpha a b), (a + b + q) (a + b - q) = 2 (1 + alpha) a b. */
  double q = hypot(big - alpha * small, sqrt(1 - alpha * alpha) * small);
  double v = big < 0 ? 2 * small * (big / (big + small - q)) : (big + small + q) / (1 + alpha);
  return p->side * v;
}

static double r_m(const void *data, const double in[])
{
  const zs_blend *p = data;
  const zs_blend r0 = {.side = p->side};
  double w = in[0] * in[0] + in[1] * in[1];
  return r_alpha(&r0, in) * pow(w, p->parameter[0] / 2);
}

static double r_displaced(const void *data, const double in[])
{
  const zs_blend *p = data;
  const zs_blend r0 = {.side = p->side};
  double u = in[0] / p->parameter[1], v = in[1] / p->parameter[2];
  return r_alpha(&r0, in) + p->parameter[0] / (1 + u * u + v * v);
}

/* The larger or the smaller input moved by the correction c. */
static double corrected(const zs_blend *p, const double in[], double c)
{
  return p->side > 0 ? fmax(in[0], in[1]) + c : fmin(in[0], in[1]) - c;
}

static double smooth_quadratic(const void *data, const double in[])
{
  const zs_blend *p = data;
  double k = p->parameter[0], d = fabs(in[0] - in[1]), h = d < k ? k - d : 0;
  return corrected(p, in, h * h / (4 * k));
}

static double smooth_cubic(const void *data, const double in[])
{
  const zs_blend *p = data;
  double k = p->parameter[0], d = fabs(in[0] - in[1]), h = d < k ? k - d : 0;
  return corrected(p, in, h * h * h / (6 * k * k));
}

static double smooth_circular(const void *data, const double in[])
{
  const zs_blend *p = data;
  double k = p->parameter[0], d = fabs(in[0] - in[1]);
  return corrected(p, in, d < k ? k - d / 2 - sqrt(2 * k * k - d * d) / 2 : 0);
}

static double smooth_chamfer(const void *data, const double in[])
{
  const zs_blend *p = data;
  double k = p->parameter[0], d = fabs(in[0] - in[1]);
  return corrected(p, in, d < k ? (k - d) / 2 : 0);
}

static double smooth_exponential(const void *data, const double in[])
{
  const zs_blend *p = data;
  double k = p->parameter[0], d = fabs(in[0] - in[1]);
  return corrected(p, in, isfinite(d) ? k / 4 * log2(1 + exp2(-4 * d / k)) : 0);
}

static double interpolation(const void *data, const double in[])
{
  (void)data;
  double t = in[2];
  return t <= 0 ? in[0] : t >= 1 ? in[1] : (1 - t) * in[0] + t * in[1];
}

/* The sign of an R-function depends on the signs of its operands alone, for
 * rounded values too; anything else of it on all of both. */
static zs_demand r_alpha_demand(const void *data, zs_demand result)
{
  (void)data;
  return zs_demand_is_sign(result) ? result : (zs_demand){INFINITY, INFINITY};
}

static const zs_operation *r_alpha_for_sign(const void *data)
{
  const zs_blend *p = data;
  return zs_scalar_operation(p->side > 0 ? ZS_FUNCTION_MAXIMUM : ZS_FUNCTION_MINIMUM,
                             ZS_FORM_REGISTERS);
}

/* How many reaches an operand has to be away from where the result matters to
 * have no influence there.  One is not enough: more operands between may hand its
 * influence on, each lifting the result and passing on a part of what it was.
 * With h = 1 - d/k the best a quadratic joint can do is to lift by
 * d + k h^2 / 4 and to pass on h / 2: nothing above exp(-2.4) per reach.  A cubic
 * one is below exp(-3.9), a circular one below exp(-1.9); a chamfer passes on a
 * half at every reach.  What is left after these many, the first of which an operand
 * needs to be lifted at all, is less than 1e-7 k. */
static zs_demand smooth_demand(const zs_blend *p, zs_demand result, double reaches)
{
  const float margin = (float)(reaches * p->parameter[0]);
  return (zs_demand){result.below + margin, result.above + margin};
}

static zs_demand quadratic_demand(const void *data, zs_demand result)
{
  return smooth_demand(data, result, 8);
}

static zs_demand cubic_demand(const void *data, zs_demand result)
{
  return smooth_demand(data, result, 6);
}

static zs_demand circular_demand(const void *data, zs_demand result)
{
  return smooth_demand(data, result, 10);
}

static zs_demand chamfer_demand(const void *data, zs_demand result)
{
  return smooth_demand(data, result, 26);
}

ZS_DEFINE_KERNEL_TABLE(zs_r_alpha_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_r_m_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_r_displaced_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_smooth_quadratic_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_smooth_cubic_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_smooth_circular_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_smooth_chamfer_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_smooth_exponential_kernels)
ZS_DEFINE_KERNEL_TABLE(zs_interpolation_kernels)

const zs_operation zs_r_alpha = {.name = "r-alpha",
                                 .arity = 2,
                                 .choice = true,
                                 .demand = r_alpha_demand,
                                 .for_sign = r_alpha_for_sign,
                                 .data_size = sizeof(zs_blend),
                                 .kernels = zs_r_alpha_kernels_table,
                                 .reference = r_alpha};
/* Not sign-transparent: far below single precision the power may vanish. */
const zs_operation zs_r_m = {.name = "r-m",
                             .arity = 2,
                             .data_size = sizeof(zs_blend),
                             .kernels = zs_r_m_kernels_table,
                             .reference = r_m};
const zs_operation zs_r_displaced = {.name = "r-displaced",
                                     .arity = 2,
                                     .data_size = sizeof(zs_blend),
                                     .kernels = zs_r_displaced_kernels_table,
                                     .reference = r_displaced};
const zs_operation zs_smooth_quadratic = {.name = "smooth-quadratic",
                                          .demand = quadratic_demand,
                                          .arity = 2,
                                          .choice = true,
                                          .data_size = sizeof(zs_blend),
                                          .kernels = zs_smooth_quadratic_kernels_table,
                                          .reference = smooth_quadratic};
const zs_operation zs_smooth_cubic = {.name = "smooth-cubic",
                                          .demand = cubic_demand,
                                      .arity = 2,
                                      .choice = true,
                                      .data_size = sizeof(zs_blend),
                                      .kernels = zs_smooth_cubic_kernels_table,
                                      .reference = smooth_cubic};
const zs_operation zs_smooth_circular = {.name = "smooth-circular",
                                          .demand = circular_demand,
                                         .arity = 2,
                                         .choice = true,
                                         .data_size = sizeof(zs_blend),
                                         .kernels = zs_smooth_circular_kernels_table,
                                         .reference = smooth_circular};
const zs_operation zs_smooth_chamfer = {.name = "smooth-chamfer",
                                          .demand = chamfer_demand,
                                        .arity = 2,
                                        .choice = true,
                                        .data_size = sizeof(zs_blend),
                                        .kernels = zs_smooth_chamfer_kernels_table,
                                        .reference = smooth_chamfer};
const zs_operation zs_smooth_exponential = {.name = "smooth-exponential",
                                            .arity = 2,
                                            .data_size = sizeof(zs_blend),
                                            .kernels = zs_smooth_exponential_kernels_table,
                                            .reference = smooth_exponential};
const zs_operation zs_interpolation = {.name = "interpolation",
                                       .arity = 3,
                                       .choice = true,
                                       .kernels = zs_interpolation_kernels_table,
                                       .reference = interpolation};
