/* Taylor series of radial sums.  Compiled once per instruction set. */
#include "rbf/sum.h"
#include "rbf/tree.h"
#include "rbf/vector.h"

#include <string.h>

#if defined __GNUC__ && !defined __clang__
/* Bounds are widened by far more than what contraction changes. */
#pragma GCC optimize("fp-contract=fast")
#endif

typedef zs_vector vector;

/* Some centres seen from the middle of a cell. */
typedef struct group {
  vector y[3], square, inverse; /* middle - centre, its square, one over that */
} group;

/* Coefficients of weight * |y + t|^(2 power), in order of degree, from those
 * before: with g = |y + t|^2 and the Euler operator E = t . grad,
 *   g E(g^a) = a g^a E(g),
 * of which the terms of degree k are
 *   R^2 k A_k = 2 (y.t) (a - k + 1) A_(k-1) + |t|^2 (2a - k + 2) A_(k-2). */
static void power_series(const group *g, const zs_rbf_layout *at, double power, vector first,
                         vector series[ZS_RBF_TAYLOR + 1])
{
  series[ZS_RBF_NONE] = (vector){0};
  series[0] = first;
  for (unsigned n = 1; n < ZS_RBF_TAYLOR; n++) {
    const uint8_t *p = at->power[n];
    const double k = p[0] + p[1] + p[2];
    vector linear = (vector){0}, square = (vector){0};
    for (unsigned axis = 0; axis < 3; axis++) {
      linear += g->y[axis] * series[at->lower[n][axis]];
      square += series[at->twice_lower[n][axis]];
    }
    series[n] =
      g->inverse * (2 * (power - k + 1) / k * linear + (2 * power - k + 2) / k * square);
  }
}

/* The same for weight / 2 * g^m log g with m = 1 or 2, where
 *   g E(F) = m F E(g) + 1/2 g^m E(g),   g^m E(g) = E(g^(m+1)) / (m + 1):
 * the second term is a polynomial, added as it is. */
static void logarithmic_series(const group *g, const zs_rbf_layout *at, unsigned m, vector first,
                               vector weight, vector series[ZS_RBF_TAYLOR + 1])
{
  vector source[ZS_RBF_TAYLOR + 1];
  vector start = weight * g->square * g->square;
  power_series(g, at, m + 1, m == 2 ? start * g->square : start, source);
  series[ZS_RBF_NONE] = (vector){0};
  series[0] = first;
  for (unsigned n = 1; n < ZS_RBF_TAYLOR; n++) {
    const uint8_t *p = at->power[n];
    const double k = p[0] + p[1] + p[2];
    vector linear = (vector){0}, square = (vector){0};
    for (unsigned axis = 0; axis < 3; axis++) {
      linear += g->y[axis] * series[at->lower[n][axis]];
      square += series[at->twice_lower[n][axis]];
    }
    series[n] = g->inverse * (2 * (m - k + 1) / k * linear + (2 * m - k + 2) / k * square +
                              0.5 / (m + 1) * source[n]);
  }
}

/* Up to ZS_WIDTH centres; idle lanes repeat one, without weight. */
static void gather(group *g, const double middle[3], const zs_rbf_centre *centres,
                   const uint32_t *list, size_t count, zs_rbf_kernel kernel, vector *weight,
                   vector *first)
{
  for (unsigned lane = 0; lane < ZS_WIDTH; lane++) {
    const zs_rbf_centre *c = &centres[list[lane < count ? lane : 0]];
    double x = middle[0] - c->x, y = middle[1] - c->y, z = middle[2] - c->z;
    double square = x * x + y * y + z * z;
    g->y[0][lane] = x;
    g->y[1][lane] = y;
    g->y[2][lane] = z;
    g->square[lane] = square;
    g->inverse[lane] = 1 / square;
    (*weight)[lane] = lane < count ? c->weight : 0;
    (*first)[lane] = (*weight)[lane] * zs_rbf_phi(kernel, square);
  }
}

void ZS_PASTE(zs_rbf_expand, ZS_ISA)(const zs_rbf_layout *layout, zs_rbf_kernel kernel,
                                     const double middle[3], const zs_rbf_centre *centres,
                                     const uint32_t *list, size_t count,
                                     double taylor[ZS_RBF_TAYLOR])
{
  static const double powers[ZS_RBF_KERNEL_COUNT] = {0.5, 1.5, 2.5, 1, 2};
  const bool logarithmic = kernel == ZS_RBF_TPS2 || kernel == ZS_RBF_TPS4;
  vector series[ZS_RBF_TAYLOR + 1], sum[ZS_RBF_TAYLOR];
  memset(sum, 0, sizeof sum);
  for (size_t i = 0; i < count; i += ZS_WIDTH) {
    group g;
    vector weight, first;
    gather(&g, middle, centres, list + i, count - i, kernel, &weight, &first);
    if (logarithmic)
      logarithmic_series(&g, layout, (unsigned)powers[kernel], first, weight, series);
    else
      power_series(&g, layout, powers[kernel], first, series);
    for (unsigned n = 0; n < ZS_RBF_TAYLOR; n++)
      sum[n] += series[n];
  }
  for (unsigned n = 0; n < ZS_RBF_TAYLOR; n++)
    for (unsigned lane = 0; lane < ZS_WIDTH; lane++)
      taylor[n] += sum[n][lane];
}
