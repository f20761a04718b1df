#include "field/scalar.h"

#include <math.h>

/* The double-precision definitions, one per function and form, since a
 * reference does not know its own operation. */
#define BINARY_REFERENCES(NAME) \
  static double NAME##_0(const void *data, const double in[]) \
  { \
    (void)data; \
    return zs_function_value(ZS_FUNCTION_##NAME, in[0], in[1], 0); \
  } \
  static double NAME##_1(const void *data, const double in[]) \
  { \
    return zs_function_value(ZS_FUNCTION_##NAME, in[0], *(const double *)data, 0); \
  } \
  static double NAME##_2(const void *data, const double in[]) \
  { \
    return zs_function_value(ZS_FUNCTION_##NAME, *(const double *)data, in[0], 0); \
  }

#define UNARY_REFERENCE(NAME) \
  static double NAME##_0(const void *data, const double in[]) \
  { \
    (void)data; \
    return zs_function_value(ZS_FUNCTION_##NAME, in[0], in[1], in[2]); \
  }

#define BINARY(F) \
  F(ADD) F(SUBTRACT) F(MULTIPLY) F(DIVIDE) F(POWER) F(MODULO) F(MINIMUM) F(MAXIMUM) F(ATAN2) \
  F(HYPOT) F(LESS) F(LESS_EQUAL) F(EQUAL) F(NOT_EQUAL)
#define UNARY(F) \
  F(NEGATE) F(ABSOLUTE) F(SQUARE) F(SQUARE_ROOT) F(EXPONENTIAL) F(LOGARITHM) F(SINE) F(COSINE) \
  F(TANGENT) F(ARC_SINE) F(ARC_COSINE) F(ARC_TANGENT) F(FLOOR) F(CEILING) F(ROUND) F(SIGN)

BINARY(BINARY_REFERENCES)
UNARY(UNARY_REFERENCE)
UNARY_REFERENCE(SELECT)

typedef const zs_kernels *kernel_list[ZS_ISA_COUNT];

#define LISTS(NAME) \
  [ZS_FUNCTION_##NAME] = {ZS_VARIANTS(zs_scalar_kernels, [ZS_FUNCTION_##NAME][0]), \
                          ZS_VARIANTS(zs_scalar_kernels, [ZS_FUNCTION_##NAME][1]), \
                          ZS_VARIANTS(zs_scalar_kernels, [ZS_FUNCTION_##NAME][2])},
static const kernel_list kernels[ZS_FUNCTION_COUNT][ZS_FORM_COUNT] = {
  BINARY(LISTS)
  UNARY(LISTS)
  LISTS(SELECT)
};

static const kernel_list linear_root_kernels = ZS_VARIANTS(zs_linear_root_kernels, );
static const kernel_list linear_registers_kernels = ZS_VARIANTS(zs_linear_registers_kernels, );
static const kernel_list constant_kernels = ZS_VARIANTS(zs_constant_kernels, );

/* ---- Where operands matter -------------------------------------------------- */

static zs_demand demand_everywhere(void)
{
  return (zs_demand){INFINITY, INFINITY};
}

/* A little more, for what rounding moves by. */
static zs_demand widened(double below, double above, double size)
{
  const double slack = 1e-5 * size;
  return (zs_demand){(float)(below + slack), (float)(above + slack)};
}

static zs_demand extremum_demand(const void *data, zs_demand result)
{
  (void)data;
  return result;
}

static zs_demand negate_demand(const void *data, zs_demand result)
{
  (void)data;
  return (zs_demand){result.above, result.below};
}

/* The absolute value tells neither side from the other. */
static zs_demand absolute_demand(const void *data, zs_demand result)
{
  (void)data;
  const float reach = result.above > 0 ? result.above : 0;
  return (zs_demand){reach, reach};
}

/* a + c */
static zs_demand shifted_demand(double c, zs_demand result)
{
  return widened(result.below + c, result.above - c,
                 fabs(c) + fabs((double)result.below) + fabs((double)result.above));
}

static zs_demand add_demand(const void *data, zs_demand result)
{
  return shifted_demand(*(const double *)data, result);
}

static zs_demand subtract_demand(const void *data, zs_demand result)
{
  return shifted_demand(-*(const double *)data, result);
}

/* c - a */
static zs_demand subtract_from_demand(const void *data, zs_demand result)
{
  return shifted_demand(-*(const double *)data, negate_demand(NULL, result));
}

/* c a */
static zs_demand scaled_demand(double c, zs_demand result)
{
  /* Products far below single precision lose their sign. */
  if (!(fabs(c) > 1e-6 && fabs(c) < 1e6))
    return demand_everywhere();
  if (c < 0)
    result = negate_demand(NULL, result);
  const double below = result.below / fabs(c), above = result.above / fabs(c);
  return widened(below, above, fabs(below) + fabs(above));
}

static zs_demand multiply_demand(const void *data, zs_demand result)
{
  return scaled_demand(*(const double *)data, result);
}

static zs_demand divide_demand(const void *data, zs_demand result)
{
  return scaled_demand(1 / *(const double *)data, result);
}

#define EXTREMUM(NAME) ((ZS_FUNCTION_##NAME == ZS_FUNCTION_MINIMUM) || \
                        (ZS_FUNCTION_##NAME == ZS_FUNCTION_MAXIMUM))

#define BINARY_OPERATIONS(NAME) \
  [ZS_FUNCTION_##NAME] = { \
    {.name = #NAME, .arity = 2, .choice = EXTREMUM(NAME), \
     .kernels = kernels[ZS_FUNCTION_##NAME][0], .reference = NAME##_0}, \
    {.name = #NAME " .c", .arity = 1, .choice = EXTREMUM(NAME), .data_size = sizeof(double), \
     .kernels = kernels[ZS_FUNCTION_##NAME][1], .reference = NAME##_1}, \
    {.name = #NAME " c.", .arity = 1, .choice = EXTREMUM(NAME), .data_size = sizeof(double), \
     .kernels = kernels[ZS_FUNCTION_##NAME][2], .reference = NAME##_2}},

#define UNARY_OPERATION(NAME) \
  [ZS_FUNCTION_##NAME] = {{.name = #NAME, .arity = 1, \
                           .kernels = kernels[ZS_FUNCTION_##NAME][0], .reference = NAME##_0}},

#define EXTREMUM_DEMANDS(NAME) \
  [ZS_FUNCTION_##NAME][ZS_FORM_REGISTERS].demand = extremum_demand, \
  [ZS_FUNCTION_##NAME][ZS_FORM_CONSTANT_RIGHT].demand = extremum_demand, \
  [ZS_FUNCTION_##NAME][ZS_FORM_CONSTANT_LEFT].demand = extremum_demand,

static const zs_operation operations[ZS_FUNCTION_COUNT][ZS_FORM_COUNT] = {
  BINARY(BINARY_OPERATIONS)
  UNARY(UNARY_OPERATION)
  [ZS_FUNCTION_SELECT] = {{.name = "SELECT", .arity = 3, .choice = true,
                           .kernels = kernels[ZS_FUNCTION_SELECT][0], .reference = SELECT_0}},
  [ZS_FUNCTION_ADD][ZS_FORM_REGISTERS].neutral = 1 << 0 | 1 << 1,
  [ZS_FUNCTION_SUBTRACT][ZS_FORM_REGISTERS].neutral = 1 << 1,
  [ZS_FUNCTION_DIVIDE][ZS_FORM_REGISTERS].signed_zeros = 1 << 1,
  [ZS_FUNCTION_DIVIDE][ZS_FORM_CONSTANT_LEFT].signed_zeros = 1 << 0,
  [ZS_FUNCTION_POWER][ZS_FORM_REGISTERS].signed_zeros = 1 << 0,
  [ZS_FUNCTION_POWER][ZS_FORM_CONSTANT_RIGHT].signed_zeros = 1 << 0,
  [ZS_FUNCTION_ATAN2][ZS_FORM_REGISTERS].signed_zeros = 1 << 0 | 1 << 1,
  [ZS_FUNCTION_ATAN2][ZS_FORM_CONSTANT_RIGHT].signed_zeros = 1 << 0,
  [ZS_FUNCTION_ATAN2][ZS_FORM_CONSTANT_LEFT].signed_zeros = 1 << 0,
  [ZS_FUNCTION_ABSOLUTE][0].even = true,
  [ZS_FUNCTION_SQUARE][0].even = true,
  [ZS_FUNCTION_HYPOT][ZS_FORM_REGISTERS].even = true,
  [ZS_FUNCTION_EXPONENTIAL][0].even = true,
  [ZS_FUNCTION_COSINE][0].even = true,
  [ZS_FUNCTION_NEGATE][0].demand = negate_demand,
  [ZS_FUNCTION_ABSOLUTE][0].demand = absolute_demand,
  [ZS_FUNCTION_ADD][ZS_FORM_CONSTANT_RIGHT].demand = add_demand,
  [ZS_FUNCTION_ADD][ZS_FORM_CONSTANT_LEFT].demand = add_demand,
  [ZS_FUNCTION_SUBTRACT][ZS_FORM_CONSTANT_RIGHT].demand = subtract_demand,
  [ZS_FUNCTION_SUBTRACT][ZS_FORM_CONSTANT_LEFT].demand = subtract_from_demand,
  [ZS_FUNCTION_MULTIPLY][ZS_FORM_CONSTANT_RIGHT].demand = multiply_demand,
  [ZS_FUNCTION_MULTIPLY][ZS_FORM_CONSTANT_LEFT].demand = multiply_demand,
  [ZS_FUNCTION_DIVIDE][ZS_FORM_CONSTANT_RIGHT].demand = divide_demand,
  EXTREMUM_DEMANDS(MINIMUM)
  EXTREMUM_DEMANDS(MAXIMUM)
};

const zs_operation *zs_scalar_operation(zs_function function, zs_form form)
{
  return &operations[function][form];
}

static double linear_reference(const void *data, const double in[])
{
  const double *r = ((const zs_linear *)data)->row;
  return r[0] * in[0] + r[1] * in[1] + r[2] * in[2] + r[3];
}

static unsigned linear_used(const void *data)
{
  const double *r = ((const zs_linear *)data)->row;
  return (r[0] != 0) | (unsigned)(r[1] != 0) << 1 | (unsigned)(r[2] != 0) << 2;
}

static double constant_reference(const void *data, const double in[])
{
  (void)in;
  return *(const double *)data;
}

zs_lanes_test zs_zero_lanes(zs_isa_kind isa)
{
  static const zs_lanes_test *const tests[ZS_ISA_COUNT] = ZS_VARIANTS(zs_zero_lanes, );
  return *tests[isa];
}

const zs_operation zs_linear_root = {.name = "linear",
                                     .arity = 3,
                                     .data_size = sizeof(zs_linear),
                                     .used = linear_used,
                                     .kernels = linear_root_kernels,
                                     .reference = linear_reference};
const zs_operation zs_linear_registers = {.name = "linear registers",
                                          .arity = 3,
                                          .data_size = sizeof(zs_linear),
                                          .used = linear_used,
                                          .kernels = linear_registers_kernels,
                                          .reference = linear_reference};
const zs_operation zs_constant = {.name = "constant",
                                  .arity = 0,
                                  .data_size = sizeof(double),
                                  .kernels = constant_kernels,
                                  .reference = constant_reference};
const zs_operation zs_coordinate = {.name = "coordinate", .arity = 0};
