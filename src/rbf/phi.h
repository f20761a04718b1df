/* Radial kernels on vectors of squared distances, for *.kernel.c. */
#ifndef ZS_RBF_PHI_H
#define ZS_RBF_PHI_H

#include "rbf/kernel.h"
#include "rbf/vector.h"

/* Natural logarithm of positive normal numbers; finite at 0, where callers
 * multiply by 0.  log m = 2 artanh ((m - 1) / (m + 1)) with m around 1. */
static inline zs_vector zs_vector_logarithm(zs_vector a)
{
  const zs_integers half_exponent = (zs_integers){0} + INT64_C(0x3fe6a09e667f3bcd); /* sqrt(1/2) */
  const zs_integers magic = (zs_integers){0} + INT64_C(0x4338000000000000);         /* 1.5 * 2^52 */
  zs_integers bits = (zs_integers)a - half_exponent;
  zs_integers exponent = bits >> 52;
  zs_vector m = (zs_vector)((zs_integers)a - (exponent << 52));
  zs_vector e = (zs_vector)(exponent + magic) - (zs_vector)magic;
  zs_vector t = (m - 1) / (m + 1), q = t * t;
  zs_vector p = (zs_vector){0} + 1.0 / 21;
  p = p * q + 1.0 / 19;
  p = p * q + 1.0 / 17;
  p = p * q + 1.0 / 15;
  p = p * q + 1.0 / 13;
  p = p * q + 1.0 / 11;
  p = p * q + 1.0 / 9;
  p = p * q + 1.0 / 7;
  p = p * q + 1.0 / 5;
  p = p * q + 1.0 / 3;
  return e * 0.69314718055994530942 + 2 * (t + t * q * p);
}

/* exp of numbers that are not positive: 2^n exp r with r around 0; 0 where it would be
 * below the normal numbers. */
static inline zs_vector zs_vector_exponential(zs_vector a)
{
  const zs_vector magic = (zs_vector){0} + 6755399441055744.0; /* 1.5 * 2^52 */
  const zs_vector shifted = a * 1.44269504088896340736 + magic; /* n in its lowest bits */
  const zs_vector n = shifted - magic;
  const zs_vector r = a - n * 6.93147180369123816490e-01 - n * 1.90821492927058770002e-10;
  zs_vector p = (zs_vector){0} + 1.0 / 6227020800;
  p = p * r + 1.0 / 479001600;
  p = p * r + 1.0 / 39916800;
  p = p * r + 1.0 / 3628800;
  p = p * r + 1.0 / 362880;
  p = p * r + 1.0 / 40320;
  p = p * r + 1.0 / 5040;
  p = p * r + 1.0 / 720;
  p = p * r + 1.0 / 120;
  p = p * r + 1.0 / 24;
  p = p * r + 1.0 / 6;
  p = p * r + 0.5;
  p = p * r + 1;
  p = p * r + 1;
  /* What wraps around is not kept. */
  const zs_bits scaled = (zs_bits)p + ((zs_bits)shifted << 52);
  return (zs_vector)((zs_integers)scaled & (a >= -708.0));
}

/* phi of s = r^2. */
static inline ZS_ALWAYS zs_vector zs_vector_phi(zs_rbf_radial radial, zs_vector s)
{
  switch (radial.kernel) {
  case ZS_RBF_R:
    return zs_vector_root(s);
  case ZS_RBF_R3:
    return s * zs_vector_root(s);
  case ZS_RBF_R5:
    return s * s * zs_vector_root(s);
  case ZS_RBF_TPS2:
    return 0.5 * s * zs_vector_logarithm(s);
  case ZS_RBF_TPS4:
    return 0.5 * s * s * zs_vector_logarithm(s);
  default:
    return zs_vector_exponential(-radial.rate * s);
  }
}

/* phi and phi' / r.  Where r = 0 the latter is finite and its factor 0. */
static inline ZS_ALWAYS zs_vector zs_vector_phi_and_slope(zs_rbf_radial radial, zs_vector s,
                                                          zs_vector *slope)
{
  switch (radial.kernel) {
  case ZS_RBF_R: {
    const zs_vector one = (zs_vector){0} + 1;
    zs_vector r = zs_vector_root(s);
    *slope = 1 / (zs_vector)((zs_integers)r | ((r == 0) & (zs_integers)one));
    return r;
  }
  case ZS_RBF_R3: {
    zs_vector r = zs_vector_root(s);
    *slope = 3 * r;
    return s * r;
  }
  case ZS_RBF_R5: {
    zs_vector r3 = s * zs_vector_root(s);
    *slope = 5 * r3;
    return s * r3;
  }
  case ZS_RBF_TPS2: {
    zs_vector l = zs_vector_logarithm(s);
    *slope = l + 1;
    return 0.5 * s * l;
  }
  case ZS_RBF_TPS4: {
    zs_vector l = zs_vector_logarithm(s);
    *slope = s * (2 * l + 1);
    return 0.5 * s * s * l;
  }
  default: {
    zs_vector phi = zs_vector_exponential(-radial.rate * s);
    *slope = -2 * radial.rate * phi;
    return phi;
  }
  }
}

#endif
