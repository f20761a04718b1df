#include "rbf/series.h"

#include <stdlib.h>
#include <string.h>

static double factorial(unsigned n)
{
  double product = 1;
  for (unsigned i = 2; i <= n; i++)
    product *= i;
  return product;
}

/* |a|! / a! */
static double multinomial(const uint8_t a[3])
{
  return factorial((unsigned)a[0] + a[1] + a[2]) /
         (factorial(a[0]) * factorial(a[1]) * factorial(a[2]));
}

static void add_monomial(zs_series_layout *l, unsigned i, unsigned j, unsigned k)
{
  const uint16_t n = (uint16_t)l->terms++;
  l->power[n][0] = (uint8_t)i;
  l->power[n][1] = (uint8_t)j;
  l->power[n][2] = (uint8_t)k;
  l->order[n] = (uint8_t)(i + j + k);
  l->index[i][j][k] = n;
  if (n > 0) {
    l->axis[n] = i ? 0 : j ? 1 : 2;
    l->lower[n] = i ? l->index[i - 1][j][k] : j ? l->index[i][j - 1][k] : l->index[i][j][k - 1];
  }
}

/* What the moment of y^a, i = |a|, and a j contributes: it is multiplied by
 *   binomial (i + j, j) 2^i multinomial (a) t^a (t.t)^j
 * where (t.t)^j is a sum over the monomials of order j, their powers doubled. */
static void find_parts(zs_series_layout *l)
{
  for (unsigned n = 0; n < l->terms; n++) {
    const unsigned i = l->order[n];
    const uint8_t *a = l->power[n];
    for (unsigned j = 0; i + 2 * j <= l->degree; j++, l->moments++) {
      const double common = factorial(i + j) / (factorial(i) * factorial(j)) *
                            (double)(1u << i) * multinomial(a);
      for (unsigned m = l->first[j]; m < l->first[j + 1]; m++, l->parts++) {
        const uint8_t *b = l->power[m];
        l->part[l->parts].factor = common * multinomial(b);
        l->part[l->parts].moment = (uint16_t)l->moments;
        l->part[l->parts].to = l->index[a[0] + 2 * b[0]][a[1] + 2 * b[1]][a[2] + 2 * b[2]];
      }
    }
  }
}

zs_series_layout *zs_series_layout_new(unsigned degree)
{
  zs_series_layout *l = calloc(1, sizeof *l);
  if (!l)
    return NULL;
  l->degree = degree;
  for (unsigned order = 0; order <= degree; order++) {
    l->first[order] = (uint16_t)l->terms;
    for (unsigned i = order + 1; i-- > 0;)
      for (unsigned j = order - i + 1; j-- > 0;)
        add_monomial(l, i, j, order - i - j);
  }
  l->first[degree + 1] = (uint16_t)l->terms;
  unsigned n = 0;
  for (unsigned i = degree + 1; i-- > 0;)
    for (unsigned j = degree - i + 1; j-- > 0;)
      for (unsigned k = degree - i - j + 1; k-- > 0;)
        l->nested[n++] = l->index[i][j][k];
  find_parts(l);
  return l;
}

/* Taylor's shift of one row of `n` coefficients, `stride` apart: p (t + by). */
static void shift_row(double *c, size_t stride, unsigned n, double by)
{
  for (unsigned last = n - 1; last > 0; last--)
    for (unsigned i = n - 1; i >= n - last; i--)
      c[(i - 1) * stride] += by * c[i * stride];
}

void zs_series_shift(const zs_series_layout *layout, const double *from, const double by[3],
                     double *to)
{
  enum { SIDE = ZS_SERIES_LONG + 1 };
  double c[SIDE][SIDE][SIDE];
  const unsigned side = layout->degree + 1;
  for (unsigned n = 0; n < layout->terms; n++) {
    const uint8_t *p = layout->power[n];
    c[p[0]][p[1]][p[2]] = from[n];
  }
  for (int axis = 0; axis < 3; axis++)
    for (unsigned i = 0; i < side; i++)
      for (unsigned j = 0; j < side - i; j++) {
        double *row = axis == 0 ? &c[0][i][j] : axis == 1 ? &c[i][0][j] : &c[i][j][0];
        shift_row(row, axis == 0 ? SIDE * SIDE : axis == 1 ? SIDE : 1, side - i - j, by[axis]);
      }
  for (unsigned n = 0; n < layout->terms; n++) {
    const uint8_t *p = layout->power[n];
    to[n] = c[p[0]][p[1]][p[2]];
  }
}

double zs_series_value(const zs_series_layout *layout, const double *nested, double x, double y,
                       double z)
{
  double f = 0;
  for (unsigned i = layout->degree + 1; i-- > 0;) {
    double fx = 0;
    for (unsigned j = layout->degree - i + 1; j-- > 0;) {
      double fxy = 0;
      for (unsigned k = layout->degree - i - j + 1; k-- > 0;)
        fxy = fxy * z + *nested++;
      fx = fx * y + fxy;
    }
    f = f * x + fx;
  }
  return f;
}

double zs_series_remainder(const zs_series_layout *layout, zs_rbf_kernel kernel, double distance,
                           double q)
{
  /* max |C_k| of the first term left out, rounded up; those that follow are
   * smaller. */
  static const double first_short[ZS_RBF_KERNEL_COUNT] = {0.0321, 0.0157, 0.0187, 0.0312, 0.0241};
  static const double first_long[ZS_RBF_KERNEL_COUNT] = {0.0181, 0.00536, 0.0033, 0.0139, 0.0061};
  static const unsigned twice_power[ZS_RBF_KERNEL_COUNT] = {1, 3, 5, 2, 4};
  double q2 = q * q, q4 = q2 * q2, q9 = q4 * q4 * q, power = distance;
  for (unsigned i = 1; i < twice_power[kernel]; i++)
    power *= distance;
  return power / (1 - q) * (layout->degree == ZS_SERIES_SHORT ? first_short[kernel] * q9
                                                              : first_long[kernel] * q9 * q4);
}

zs_series_expand *zs_series_expand_select(void)
{
  static zs_series_expand *const table[ZS_ISA_COUNT] = ZS_VARIANTS(zs_series_expand, );
  return table[zs_isa_select()];
}
