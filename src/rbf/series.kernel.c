/* Taylor series of radial sums.  Compiled once per instruction set.
 *
 * About t = 0, with y = middle - centre, s = y.y + lift, and phi as a function F
 * of the squared distance s + 2 y.t + t.t,
 *
 *   F = sum_n F_n (2 y.t + t.t)^n,              F_n = F^(n) (s) / n!
 *     = sum_ij F_(i+j) binomial (i + j, j) 2^i (y.t)^i (t.t)^j.
 *
 * So what has to be added up over the centres are the moments
 * weight F_(i+j) y^a, |a| = i; the rest is the same for all of them, and in
 * the layout. */
#include "rbf/series.h"
#include "rbf/vector.h"

#include <string.h>

typedef zs_vector vector;

enum {
  DERIVATIVES = ZS_SERIES_LONG + 1,
  VECTORS = 2,   /* added to the moments together, which are many more than registers */
  GROUP = VECTORS * ZS_WIDTH
};

/* Some centres seen from the middle. */
typedef struct group {
  vector y[3][VECTORS], square[VECTORS], inverse[VECTORS], weight[VECTORS];
  vector phi[VECTORS], logarithm[VECTORS]; /* one of them, as the kernel needs */
  vector f[DERIVATIVES][VECTORS];          /* weight * F_n, up to the degree */
} group;

/* Up to GROUP centres; idle lanes repeat one, without weight. */
static void gather(group *g, zs_rbf_kernel kernel, const double middle[3],
                   const zs_rbf_centre *centres, const uint32_t *list, size_t count)
{
  const bool logarithmic = kernel == ZS_RBF_TPS2 || kernel == ZS_RBF_TPS4;
  for (unsigned i = 0; i < GROUP; i++) {
    const unsigned v = i / ZS_WIDTH, lane = i % ZS_WIDTH;
    const zs_rbf_centre *c = &centres[list[i < count ? i : 0]];
    double x = middle[0] - c->x, y = middle[1] - c->y, z = middle[2] - c->z;
    double square = x * x + y * y + z * z + c->lift;
    g->y[0][v][lane] = x;
    g->y[1][v][lane] = y;
    g->y[2][v][lane] = z;
    g->square[v][lane] = square;
    g->inverse[v][lane] = 1 / square;
    g->weight[v][lane] = i < count ? c->weight : 0;
    g->phi[v][lane] = logarithmic ? 0 : zs_rbf_phi(kernel, square);
    g->logarithm[v][lane] = logarithmic ? log(square) : 0;
  }
}

/* F = s^power. */
static void power_derivatives(group *g, int degree, double power)
{
  for (unsigned v = 0; v < VECTORS; v++) {
    g->f[0][v] = g->weight[v] * g->phi[v];
    for (int n = 1; n <= degree; n++)
      g->f[n][v] = g->f[n - 1][v] * g->inverse[v] * ((power - n + 1) / n);
  }
}

/* F = 1/2 s^m log s, m = 1 or 2: with s (1 + e) for s,
 *   F = 1/2 s^m (1 + e)^m (log s + e - e^2 / 2 + e^3 / 3 - ...). */
static void logarithmic_derivatives(group *g, int degree, int m)
{
  const double binomial[3] = {1, m, m == 2};
  for (unsigned v = 0; v < VECTORS; v++) {
    const vector s = g->square[v];
    vector scale = 0.5 * g->weight[v] * (m == 2 ? s * s : s);
    for (int n = 0; n <= degree; n++) {
      double constant = 0;
      for (int k = 0; k <= m && k < n; k++)
        constant += binomial[k] * ((n - k) % 2 ? 1.0 : -1.0) / (n - k);
      g->f[n][v] = scale * (constant + (n <= m ? binomial[n] * g->logarithm[v] : (vector){0}));
      scale *= g->inverse[v];
    }
  }
}

/* The moments of |a| = order; returns where the next ones start. */
static inline ZS_ALWAYS vector *add_order(const zs_series_layout *layout, const group *g,
                                       unsigned degree, unsigned order,
                                       vector (*power)[VECTORS], vector *moments)
{
  if (order > degree)
    return moments;
  for (unsigned n = layout->first[order]; n < layout->first[order + 1]; n++) {
    if (n > 0)
      for (unsigned v = 0; v < VECTORS; v++)
        power[n][v] = power[layout->lower[n]][v] * g->y[layout->axis[n]][v];
    for (unsigned j = 0; order + 2 * j <= degree; j++) {
      vector sum = *moments;
      for (unsigned v = 0; v < VECTORS; v++)
        sum += g->f[order + j][v] * power[n][v];
      *moments++ = sum;
    }
  }
  return moments;
}

/* With degree and order known, the loops over j are straight code. */
static inline ZS_ALWAYS void add_orders(const zs_series_layout *layout, const group *g,
                                     unsigned degree, vector *moments)
{
  vector power[ZS_SERIES_LONG_TERMS][VECTORS];
  for (unsigned v = 0; v < VECTORS; v++)
    power[0][v] = (vector){0} + 1;
  moments = add_order(layout, g, degree, 0, power, moments);
  moments = add_order(layout, g, degree, 1, power, moments);
  moments = add_order(layout, g, degree, 2, power, moments);
  moments = add_order(layout, g, degree, 3, power, moments);
  moments = add_order(layout, g, degree, 4, power, moments);
  moments = add_order(layout, g, degree, 5, power, moments);
  moments = add_order(layout, g, degree, 6, power, moments);
  moments = add_order(layout, g, degree, 7, power, moments);
  moments = add_order(layout, g, degree, 8, power, moments);
  moments = add_order(layout, g, degree, 9, power, moments);
  moments = add_order(layout, g, degree, 10, power, moments);
  moments = add_order(layout, g, degree, 11, power, moments);
  add_order(layout, g, degree, 12, power, moments);
}

static void add_moments(const zs_series_layout *layout, const group *g, vector *moments)
{
  if (layout->degree == ZS_SERIES_SHORT)
    add_orders(layout, g, ZS_SERIES_SHORT, moments);
  else
    add_orders(layout, g, ZS_SERIES_LONG, moments);
}

void ZS_PASTE(zs_series_expand, ZS_ISA)(const zs_series_layout *layout, zs_rbf_kernel kernel,
                                        const double middle[3], const zs_rbf_centre *centres,
                                        const uint32_t *list, size_t count, double *series)
{
  static const double powers[ZS_RBF_KERNEL_COUNT] = {0.5, 1.5, 2.5, 1, 2};
  const int degree = (int)layout->degree;
  vector moments[ZS_SERIES_LONG_MOMENTS];
  double sum[ZS_SERIES_LONG_MOMENTS];
  if (!count)
    return;
  memset(moments, 0, layout->moments * sizeof *moments);
  for (size_t i = 0; i < count; i += GROUP) {
    group g = {.phi = {{0}}};
    gather(&g, kernel, middle, centres, list + i, count - i);
    if (kernel == ZS_RBF_TPS2 || kernel == ZS_RBF_TPS4)
      logarithmic_derivatives(&g, degree, (int)powers[kernel]);
    else
      power_derivatives(&g, degree, powers[kernel]);
    add_moments(layout, &g, moments);
  }
  for (unsigned n = 0; n < layout->moments; n++) {
    sum[n] = 0;
    for (unsigned lane = 0; lane < ZS_WIDTH; lane++)
      sum[n] += moments[n][lane];
  }
  for (unsigned n = 0; n < layout->parts; n++)
    series[layout->part[n].to] += layout->part[n].factor * sum[layout->part[n].moment];
}
