/* Radial kernels as functions of the squared distance s = r^2.
 *
 * Each is conditionally positive definite of some order m, up to a sign: sums
 * of shifted kernels whose weights annihilate polynomials of degree < m define
 * an energy.  The Gaussian is positive definite: its order is 0.
 * See Wendland, "Scattered Data Approximation" (2005), chapter 8. */
#ifndef ZS_RBF_KERNEL_H
#define ZS_RBF_KERNEL_H

#include <math.h>

typedef enum zs_rbf_kernel {
  ZS_RBF_R,    /* r: the biharmonic kernel of space */
  ZS_RBF_R3,   /* r^3: the triharmonic kernel of space */
  ZS_RBF_R5,   /* r^5 */
  ZS_RBF_TPS2, /* r^2 log r: the thin plate */
  ZS_RBF_TPS4, /* r^4 log r */
  ZS_RBF_GAUSSIAN, /* exp(-rate r^2) */
  ZS_RBF_KERNEL_COUNT
} zs_rbf_kernel;

/* A kernel with what it needs to be known: the rate of the Gaussian, which is 1 by
 * the square of its width; 0 for the others. */
typedef struct zs_rbf_radial {
  zs_rbf_kernel kernel;
  double rate;
} zs_rbf_radial;

/* "r", "r3", ... as authors write them. */
extern const char *const zs_rbf_kernel_names[ZS_RBF_KERNEL_COUNT + 1];

/* The kernel that minimises bending without kinks in 2 to 5 dimensions. */
zs_rbf_kernel zs_rbf_default_kernel(unsigned dimension);

/* The order of conditional definiteness, and the sign (1 or -1) that makes the
 * kernel positive. */
unsigned zs_rbf_order(zs_rbf_kernel kernel);
double zs_rbf_sign(zs_rbf_kernel kernel);

/* The power of lengths that a kernel is: 0 for the Gaussian, whose lengths are by its width. */
double zs_rbf_power(zs_rbf_kernel kernel);

static inline double zs_rbf_phi(zs_rbf_radial radial, double s)
{
  switch (radial.kernel) {
  case ZS_RBF_R:
    return sqrt(s);
  case ZS_RBF_R3:
    return s * sqrt(s);
  case ZS_RBF_R5:
    return s * s * sqrt(s);
  case ZS_RBF_TPS2:
    return s > 0 ? 0.5 * s * log(s) : 0;
  case ZS_RBF_TPS4:
    return s > 0 ? 0.5 * s * s * log(s) : 0;
  default:
    return exp(-radial.rate * s);
  }
}

#endif
