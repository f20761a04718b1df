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
#define ZS_DECLARE_SCALAR(isa) \
  extern const zs_scalar_table zs_scalar_kernels_##isa; \
  extern const zs_kernels zs_linear_root_kernels_##isa, zs_linear_registers_kernels_##isa, \
    zs_constant_kernels_##isa;
ZS_DECLARE_SCALAR(baseline)
#if defined ZS_WITH_X86_KERNELS
ZS_DECLARE_SCALAR(avx2)
ZS_DECLARE_SCALAR(avx512)
#endif

#endif
