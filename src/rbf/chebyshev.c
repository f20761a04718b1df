#include "rbf/chebyshev.h"

#include <math.h>
#include <string.h>

enum { ORDER = ZS_CHEBYSHEV_ORDER, ALL = ORDER * ORDER * ORDER };

double zs_chebyshev_node(unsigned order, unsigned i)
{
  return cos(3.14159265358979323846 * (i + 0.5) / order);
}

void zs_chebyshev_fit(unsigned order, double *matrix)
{
  for (unsigned m = 0; m < order; m++)
    for (unsigned k = 0; k < order; k++)
      matrix[m * order + k] =
        (k ? 2.0 : 1.0) / order * cos(3.14159265358979323846 * k * (m + 0.5) / order);
}

/* T_m ((t + side) / 2) as a sum of T_k (t), found from its values at nodes. */
static void make_halve(double side, double *halve)
{
  double fit[ORDER * ORDER];
  zs_chebyshev_fit(ORDER, fit);
  memset(halve, 0, ORDER * ORDER * sizeof *halve);
  for (unsigned m = 0; m < ORDER; m++)
    for (unsigned i = 0; i < ORDER; i++) {
      const double value = cos(m * acos((zs_chebyshev_node(ORDER, i) + side) / 2));
      for (unsigned k = 0; k <= m; k++)
        halve[m * ORDER + k] += fit[i * ORDER + k] * value;
    }
}

void zs_chebyshev_halves_make(zs_chebyshev_halves *halves)
{
  make_halve(-1, halves->matrix[0]);
  make_halve(1, halves->matrix[1]);
}

/* The matrices are triangular. */
void zs_chebyshev_halve(const zs_chebyshev_halves *halves, const double *series, unsigned child,
                        double *result)
{
  double a[ALL], b[ALL];
  const double *x = halves->matrix[child & 1], *y = halves->matrix[child >> 1 & 1];
  const double *z = halves->matrix[child >> 2 & 1];
  memset(a, 0, sizeof a);
  memset(b, 0, sizeof b);
  memset(result, 0, ALL * sizeof *result);
  for (unsigned row = 0; row < ORDER * ORDER; row++)
    for (unsigned i = 0; i < ORDER; i++)
      for (unsigned k = 0; k <= i; k++)
        a[row * ORDER + k] += series[row * ORDER + i] * x[i * ORDER + k];
  for (unsigned layer = 0; layer < ORDER; layer++)
    for (unsigned i = 0; i < ORDER; i++)
      for (unsigned k = 0; k <= i; k++)
        for (unsigned n = 0; n < ORDER; n++)
          b[(layer * ORDER + k) * ORDER + n] +=
            a[(layer * ORDER + i) * ORDER + n] * y[i * ORDER + k];
  for (unsigned i = 0; i < ORDER; i++)
    for (unsigned k = 0; k <= i; k++)
      for (unsigned n = 0; n < ORDER * ORDER; n++)
        result[k * ORDER * ORDER + n] += b[i * ORDER * ORDER + n] * z[i * ORDER + k];
}
