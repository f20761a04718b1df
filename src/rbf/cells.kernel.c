/* Evaluation of radial sums in cells.  Compiled once per instruction set. */
#include "rbf/cells.h"
#include "rbf/pairs.h"

#include <math.h>

enum {
  ORDER = ZS_CHEBYSHEV_ORDER,
  STRIDE = (ORDER * ORDER + ZS_CELLS_STRIDE - 1) / ZS_CELLS_STRIDE * ZS_CELLS_STRIDE,
  PADDED = ZS_BLOCK + ZS_PAIRS_POINTS /* vectors reach past the end */
};

typedef zs_vector vector;

/* ---- Points by leaf ------------------------------------------------------------- */

/* A leaf and its box. */
typedef struct place {
  const zs_rbf_cell *cell;
  double middle[3], half;
} place;

/* The leaves that a block's points lie in, and the points leaf by leaf. */
typedef struct groups {
  unsigned count;
  place place[ZS_BLOCK];
  uint16_t first[ZS_BLOCK + 1];
  uint16_t from[ZS_BLOCK]; /* where the points come from */
  _Alignas(64) double point[3][PADDED];
  _Alignas(64) double sum[4][PADDED];
} groups;

static bool holds(const place *p, const double x[3])
{
  return fabs(x[0] - p->middle[0]) <= p->half && fabs(x[1] - p->middle[1]) <= p->half &&
         fabs(x[2] - p->middle[2]) <= p->half;
}

/* The group of a point, which may be a new one; `last` is that of the point before. */
static unsigned group_of(const zs_rbf_cells *cells, groups *g, const double x[3], unsigned last)
{
  if (g->count && holds(&g->place[last], x))
    return last;
  for (unsigned i = g->count; i-- > 0;)
    if (holds(&g->place[i], x))
      return i;
  place *p = &g->place[g->count];
  p->cell = zs_rbf_cells_find(cells, x, p->middle, &p->half);
  return g->count++;
}

static void sort(const zs_rbf_cells *cells, groups *g, unsigned n,
                 const double (*point)[ZS_BLOCK])
{
  uint8_t of[ZS_BLOCK];
  unsigned last = 0;
  g->count = 0;
  memset(g->first, 0, sizeof g->first);
  for (unsigned i = 0; i < n; i++) {
    const double x[3] = {point[0][i], point[1][i], point[2][i]};
    last = group_of(cells, g, x, last);
    of[i] = (uint8_t)last;
    g->first[last + 1]++;
  }
  for (unsigned i = 0; i < g->count; i++)
    g->first[i + 1] = (uint16_t)(g->first[i + 1] + g->first[i]);
  uint16_t next[ZS_BLOCK];
  memcpy(next, g->first, sizeof next);
  for (unsigned i = 0; i < n; i++) {
    const unsigned to = next[of[i]]++;
    g->from[to] = (uint16_t)i;
    for (int k = 0; k < 3; k++)
      g->point[k][to] = point[k][i];
  }
  for (int k = 0; k < 3; k++)
    for (unsigned i = n; i < n + ZS_PAIRS_POINTS; i++)
      g->point[k][i] = g->point[k][0];
}

/* ---- Polynomials ------------------------------------------------------------------ */

/* T_0 .. T_(n-1) at t, and their derivatives. */
static inline ZS_ALWAYS void chebyshev(unsigned n, vector t, vector *value, vector *slope)
{
  value[0] = (vector){0} + 1;
  value[1] = t;
  slope[0] = (vector){0};
  slope[1] = value[0];
  for (unsigned k = 2; k < n; k++) {
    value[k] = 2 * t * value[k - 1] - value[k - 2];
    slope[k] = 2 * value[k - 1] + 2 * t * slope[k - 1] - slope[k - 2];
  }
}

/* A polynomial at one z: coefficients in x and y, and their derivatives by z. */
typedef struct layer {
  _Alignas(64) double value[STRIDE];
  _Alignas(64) double slope[STRIDE];
} layer;

static inline ZS_ALWAYS void make_layer(const place *p, double z, layer *l, bool gradient)
{
  const unsigned order = p->cell->order, stride = zs_cells_stride(order);
  vector value[ORDER + 1], slope[ORDER + 1];
  chebyshev(order, (vector){0} + (z - p->middle[2]) / p->half, value, slope);
  for (unsigned n = 0; n < stride; n += ZS_WIDTH) {
    vector f = {0}, d = {0}, c;
    for (unsigned k = 0; k < order; k++) {
      memcpy(&c, p->cell->polynomial + k * stride + n, sizeof c);
      f += value[k] * c;
      if (gradient)
        d += slope[k] * c;
    }
    memcpy(l->value + n, &f, sizeof f);
    if (gradient)
      memcpy(l->slope + n, &d, sizeof d);
  }
}

/* Put the polynomial's values, or values and derivatives, into the sums of ZS_WIDTH points of a
 * layer. */
static inline ZS_ALWAYS void add_layer(const place *p, const layer *l, groups *g, unsigned at,
                                       bool gradient)
{
  const unsigned order = p->cell->order;
  vector x, y, tx[ORDER + 1], dx[ORDER + 1], ty[ORDER + 1], dy[ORDER + 1], sum[4] = {{0}};
  memcpy(&x, &g->point[0][at], sizeof x);
  memcpy(&y, &g->point[1][at], sizeof y);
  chebyshev(order, (x - p->middle[0]) / p->half, tx, dx);
  chebyshev(order, (y - p->middle[1]) / p->half, ty, dy);
  const double *value = l->value, *slope = l->slope;
  for (unsigned j = 0; j < order; j++, value += order, slope += order) {
    vector f = {0}, fx = {0}, fz = {0};
    for (unsigned i = 0; i < order; i++) {
      f += value[i] * tx[i];
      if (gradient) {
        fx += value[i] * dx[i];
        fz += slope[i] * tx[i];
      }
    }
    sum[0] += ty[j] * f;
    if (gradient) {
      sum[1] += ty[j] * fx;
      sum[2] += dy[j] * f;
      sum[3] += ty[j] * fz;
    }
  }
  memcpy(&g->sum[0][at], &sum[0], sizeof sum[0]);
  for (int k = 1; gradient && k < 4; k++) {
    sum[k] /= p->half;
    memcpy(&g->sum[k][at], &sum[k], sizeof sum[k]);
  }
}

/* What vectors write past the end of a group is written again by the next. */
static inline ZS_ALWAYS void evaluate_group(zs_rbf_radial radial, const zs_rbf_terms *terms,
                                            groups *g, unsigned index, bool gradient)
{
  const place *p = &g->place[index];
  const unsigned end = g->first[index + 1];
  for (unsigned i = g->first[index], from = i; i < end; from = i) {
    layer l;
    const double z = g->point[2][i];
    while (i < end && g->point[2][i] <= z && g->point[2][i] >= z)
      i++;
    i += i == from; /* not a number */
    make_layer(p, z, &l, gradient);
    for (unsigned at = from; at < i; at += ZS_WIDTH)
      add_layer(p, &l, g, at, gradient);
  }
  if (end - g->first[index] <= ZS_WIDTH) {
    const unsigned i = g->first[index];
    const double *const point[3] = {&g->point[0][i], &g->point[1][i], &g->point[2][i]};
    double *const sum[4] = {&g->sum[0][i], &g->sum[1][i], &g->sum[2][i], &g->sum[3][i]};
    for (uint32_t r = 0; r < p->cell->near_count; r++)
      zs_pairs_add_few(radial, end - i, point, sum, terms->centres + p->cell->near[r].first,
                       p->cell->near[r].count, gradient);
    return;
  }
  for (unsigned i = g->first[index]; i < end; i += ZS_PAIRS_POINTS) {
    const double *const point[3] = {&g->point[0][i], &g->point[1][i], &g->point[2][i]};
    double *const sum[4] = {&g->sum[0][i], &g->sum[1][i], &g->sum[2][i], &g->sum[3][i]};
    zs_pairs pairs;
    zs_pairs_load(&pairs, point, sum, gradient);
    for (uint32_t r = 0; r < p->cell->near_count; r++)
      zs_pairs_add(radial, &pairs, terms->centres + p->cell->near[r].first,
                   p->cell->near[r].count, gradient);
    zs_pairs_store(&pairs, sum, gradient);
  }
}

static inline ZS_ALWAYS void evaluate(zs_rbf_radial radial, const zs_rbf_cells *cells,
                                      const zs_rbf_terms *terms, unsigned n,
                                      const double (*point)[ZS_BLOCK], double (*sum)[ZS_BLOCK],
                                      bool gradient)
{
  groups g;
  sort(cells, &g, n, point);
  for (unsigned i = 0; i < g.count; i++) {
    if (gradient)
      evaluate_group(radial, terms, &g, i, true);
    else
      evaluate_group(radial, terms, &g, i, false);
  }
  for (unsigned k = 0; k < (gradient ? 4 : 1); k++)
    for (unsigned i = 0; i < n; i++)
      sum[k][g.from[i]] = g.sum[k][i];
}

/* ---- Making cells --------------------------------------------------------------------- */

static inline ZS_ALWAYS void add(zs_rbf_radial radial, const zs_rbf_centre *centres, size_t count,
                                 const double *const point[3], size_t n, double *sums)
{
  for (size_t i = 0; i < n; i += ZS_PAIRS_POINTS) {
    const double *const at[3] = {point[0] + i, point[1] + i, point[2] + i};
    double *const sum[4] = {sums + i};
    zs_pairs pairs;
    zs_pairs_load(&pairs, at, sum, false);
    zs_pairs_add(radial, &pairs, centres, count, false);
    zs_pairs_store(&pairs, sum, false);
  }
}

static void transform(const double *matrix, unsigned from, unsigned to, const double *in,
                      double *out)
{
  double a[ORDER * ORDER * ORDER], b[ORDER * ORDER * ORDER];
  for (unsigned row = 0; row < from * from; row++) { /* along x */
    double sum[ORDER] = {0};
    for (unsigned m = 0; m < from; m++)
      for (unsigned k = 0; k < to; k++)
        sum[k] += in[row * from + m] * matrix[m * to + k];
    memcpy(a + row * to, sum, to * sizeof *sum);
  }
  memset(b, 0, from * to * to * sizeof *b);
  for (unsigned z = 0; z < from; z++) /* along y */
    for (unsigned m = 0; m < from; m++)
      for (unsigned k = 0; k < to; k++)
        for (unsigned x = 0; x < to; x++)
          b[(z * to + k) * to + x] += a[(z * from + m) * to + x] * matrix[m * to + k];
  memset(out, 0, to * to * to * sizeof *out);
  for (unsigned m = 0; m < from; m++) /* along z */
    for (unsigned k = 0; k < to; k++)
      for (unsigned i = 0; i < to * to; i++)
        out[k * to * to + i] += b[m * to * to + i] * matrix[m * to + k];
}

#define DEFINE_KERNEL(KERNEL) \
  static void KERNEL##_evaluate(const zs_rbf_cells *cells, const zs_rbf_terms *terms, unsigned n, \
                                const double (*point)[ZS_BLOCK], double (*sum)[ZS_BLOCK], \
                                bool gradient) \
  { \
    evaluate((zs_rbf_radial){ZS_RBF_##KERNEL, terms->radial.rate}, cells, terms, n, point, sum, \
             gradient); \
  } \
  static void KERNEL##_add(double rate, const zs_rbf_centre *centres, size_t count, \
                           const double *const point[3], size_t n, double *sums) \
  { \
    add((zs_rbf_radial){ZS_RBF_##KERNEL, rate}, centres, count, point, n, sums); \
  }
DEFINE_KERNEL(R)
DEFINE_KERNEL(R3)
DEFINE_KERNEL(R5)
DEFINE_KERNEL(TPS2)
DEFINE_KERNEL(TPS4)
DEFINE_KERNEL(GAUSSIAN)

#define KERNEL_ROW(KERNEL) [ZS_RBF_##KERNEL] = {KERNEL##_evaluate, KERNEL##_add, transform}

const zs_cells_kernel_table ZS_KERNELS(zs_cells_kernels) = {
  KERNEL_ROW(R),    KERNEL_ROW(R3),   KERNEL_ROW(R5),
  KERNEL_ROW(TPS2), KERNEL_ROW(TPS4), KERNEL_ROW(GAUSSIAN),
};
