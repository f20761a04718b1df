/* Taylor series of radial sums, in space.
 *
 * About a point m, every centre c with |c - m| > |t| has the series
 *
 *   phi(|m + t - c|) = sum_k R^(2a - k) |t|^k C_k (cos angle),   R = |m - c|,
 *
 * phi = r^2a, with Gegenbauer polynomials C_k; the logarithmic kernels have
 * others like them.  Where c lies outside of space, in a fit of more dimensions,
 * R is the distance there, and all the rest stays true.  Series of many centres about the same point add up to one
 * polynomial, so that what nearly cancels in the sum has cancelled before
 * anything is bounded or evaluated. */
#ifndef ZS_RBF_SERIES_H
#define ZS_RBF_SERIES_H

#include "field/operation.h"
#include "rbf/kernel.h"

/* One centre, as the loops read it.  The lift is the square of its distance from
 * space: 0, but for fits of more than three dimensions. */
typedef struct zs_rbf_centre {
  double x, y, z, lift, weight;
} zs_rbf_centre;

enum {
  ZS_SERIES_SHORT = 8, /* the two degrees that series are cut at */
  ZS_SERIES_LONG = 12,
  ZS_SERIES_SHORT_TERMS = 165, /* monomials up to that degree */
  ZS_SERIES_LONG_TERMS = 455,
  ZS_SERIES_LONG_MOMENTS = 1036, /* series.kernel.c */
  ZS_SERIES_LONG_PARTS = 3906
};

/* How a series of some degree is laid out: by degree, then by falling power of
 * x, then of y; and tables for working with it. */
typedef struct zs_series_layout {
  unsigned degree, terms, moments, parts;
  uint8_t power[ZS_SERIES_LONG_TERMS][3], order[ZS_SERIES_LONG_TERMS]; /* order: their sum */
  /* Each monomial is that of `lower` times a coordinate. */
  uint16_t lower[ZS_SERIES_LONG_TERMS];
  uint8_t axis[ZS_SERIES_LONG_TERMS];
  uint16_t first[ZS_SERIES_LONG + 2]; /* of each order, and the end */
  uint16_t index[ZS_SERIES_LONG + 1][ZS_SERIES_LONG + 1][ZS_SERIES_LONG + 1]; /* by powers */
  uint16_t nested[ZS_SERIES_LONG_TERMS]; /* by falling powers of x, of y, of z: for Horner */
  /* Moments, by monomial and then by power of t.t, become coefficients. */
  struct {
    double factor;
    uint16_t moment, to;
  } part[ZS_SERIES_LONG_PARTS];
} zs_series_layout;

/* The layout for one of the two degrees, for free(); NULL when memory is out. */
zs_series_layout *zs_series_layout_new(unsigned degree);

/* The series of the same function about a point `by` further on; `to` may be
 * `from`. */
void zs_series_shift(const zs_series_layout *layout, const double *from, const double by[3],
                     double *to);

/* The value of a series whose coefficients are in the order `nested`. */
double zs_series_value(const zs_series_layout *layout, const double *nested, double x, double y,
                       double z);

/* What the series of a centre of unit weight leaves out up to |t| = q R, q < 1. */
double zs_series_remainder(const zs_series_layout *layout, zs_rbf_kernel kernel, double distance,
                           double q);

/* Add to `series` those of the listed centres about `middle`, all away from
 * it.  Built once per instruction set. */
typedef void zs_series_expand(const zs_series_layout *layout, zs_rbf_kernel kernel,
                              const double middle[3], const zs_rbf_centre *centres,
                              const uint32_t *list, size_t count, double *series);
extern zs_series_expand zs_series_expand_baseline;
#if defined ZS_WITH_X86_KERNELS
extern zs_series_expand zs_series_expand_avx2, zs_series_expand_avx512;
#endif

/* The one for the machine. */
zs_series_expand *zs_series_expand_select(void);

#endif
