/* The scalar functions and the linear coordinate rows as operations. */
#ifndef ZS_SCALAR_H
#define ZS_SCALAR_H

#include "base/expression.h"
#include "field/operation.h"

/* How the operands of a function of two reach it: in registers, or one of them
 * as a constant in `data` (a double). */
typedef enum zs_form {
  ZS_FORM_REGISTERS,
  ZS_FORM_CONSTANT_RIGHT,
  ZS_FORM_CONSTANT_LEFT,
  ZS_FORM_COUNT
} zs_form;

/* The operation of a function; forms other than the first exist for functions
 * of two operands. */
const zs_operation *zs_scalar_operation(zs_function function, zs_form form);

/* A row of an affine map, applied to the frame's coordinates (root) or to three
 * registers: row[0] x + row[1] y + row[2] z + row[3]. */
typedef struct zs_linear {
  double row[4];
} zs_linear;

extern const zs_operation zs_linear_root, zs_linear_registers;

/* A constant (data: double), and the stand-in for the three coordinates. */
extern const zs_operation zs_constant, zs_coordinate;

typedef zs_kernels zs_scalar_table[ZS_FUNCTION_COUNT][ZS_FORM_COUNT];
ZS_DECLARE_VARIANTS(zs_scalar_table, zs_scalar_kernels)
ZS_DECLARE_KERNELS(zs_linear_root_kernels)
ZS_DECLARE_KERNELS(zs_linear_registers_kernels)
ZS_DECLARE_KERNELS(zs_constant_kernels)

/* Lanes, one bit each, in which a value is nothing but 0, and not -0. */
typedef uint16_t (*zs_lanes_test)(const zs_bounds *f);
ZS_DECLARE_VARIANTS(zs_lanes_test, zs_zero_lanes)
zs_lanes_test zs_zero_lanes(zs_isa_kind isa);

#endif
