/* Operations that blend two values: R-functions, displaced and smoothed unions
 * and intersections, and linear interpolation.
 *
 * Every one is a formula that scalar operations could compute; fused, it needs
 * one pass over a block, and its bounds come from the blend's own monotony,
 * which is sharper than interval arithmetic on the formula. */
#ifndef ZS_BLEND_H
#define ZS_BLEND_H

#include "field/operation.h"

/* Which of a pair of dual operations: an intersection is the union of the
 * complements, complemented. */
typedef enum zs_blend_side { ZS_BLEND_UNION = 1, ZS_BLEND_INTERSECTION = -1 } zs_blend_side;

/* Data of all operations below but the last. */
typedef struct zs_blend {
  double side; /* a zs_blend_side */
  double parameter[3];
} zs_blend;

/* Rvachev's R-functions of two inputs.
 *   alpha: (a + b +- sqrt(a^2 + b^2 - 2 alpha a b)) / (1 + alpha), -1 < alpha < 1
 *          parameter: alpha
 *   m:     (a + b +- sqrt(a^2 + b^2)) (a^2 + b^2)^(m/2), m = 2, 4, ... ZS_R_M_MAXIMUM
 *          parameter: m */
enum { ZS_R_M_MAXIMUM = 30 };
extern const zs_operation zs_r_alpha, zs_r_m;

/* Pasko and Savchenko's displaced R-function:
 *   a + b +- sqrt(a^2 + b^2) + a0 / (1 + (a/a1)^2 + (b/a2)^2), a1, a2 > 0
 * parameter: a0, a1, a2. */
extern const zs_operation zs_r_displaced;

/* max(a, b) + c(|a - b|), or min(a, b) - c(|a - b|).  With h = max(k - d, 0):
 *   quadratic    h^2 / (4 k)
 *   cubic        h^3 / (6 k^2)
 *   circular     k - d/2 - sqrt(2 k^2 - d^2)/2 for d < k
 *   chamfer      h / 2
 *   exponential  k/4 log2(1 + 2^(-4 d / k))
 * parameter: k > 0. */
extern const zs_operation zs_smooth_quadratic, zs_smooth_cubic, zs_smooth_circular,
  zs_smooth_chamfer, zs_smooth_exponential;

/* a where t <= 0, b where t >= 1, (1 - t) a + t b between, for inputs a, b, t.
 * No data. */
extern const zs_operation zs_interpolation;

ZS_DECLARE_KERNELS(zs_r_alpha_kernels)
ZS_DECLARE_KERNELS(zs_r_m_kernels)
ZS_DECLARE_KERNELS(zs_r_displaced_kernels)
ZS_DECLARE_KERNELS(zs_smooth_quadratic_kernels)
ZS_DECLARE_KERNELS(zs_smooth_cubic_kernels)
ZS_DECLARE_KERNELS(zs_smooth_circular_kernels)
ZS_DECLARE_KERNELS(zs_smooth_chamfer_kernels)
ZS_DECLARE_KERNELS(zs_smooth_exponential_kernels)
ZS_DECLARE_KERNELS(zs_interpolation_kernels)

#endif
