/* Block kernels of radial sums.  Compiled once per instruction set.
 *
 * A handful of points stays in registers while the centres of a tile, which
 * fits the first-level cache, stream past. */
#include "rbf/phi.h"
#include "rbf/sum.h"

#include <math.h>
#include <string.h>

enum {
  VECTORS = 2, /* accumulators, to hide latencies */
  POINTS = VECTORS * ZS_WIDTH,
  TILE = 512 /* centres: 20 KB */
};

typedef zs_vector vector;

/* A block's points and sums in double precision: row 0 of `sum` is f, the
 * others are its derivatives. */
typedef struct block {
  _Alignas(64) double point[3][ZS_BLOCK];
  _Alignas(64) double sum[4][ZS_BLOCK];
} block;

static void convert(block *b, const zs_block_arguments *a)
{
  for (int k = 0; k < 3; k++)
    for (unsigned i = 0; i < a->n; i++)
      b->point[k][i] = (double)a->in[k][i];
}

/* Start the sums with the polynomial of a whole sum. */
static inline ZS_ALWAYS void begin_whole(block *b, const zs_rbf_sum *sum, unsigned n, bool gradient)
{
  const double *c = sum->polynomial;
  for (unsigned i = 0; i < n; i++) {
    const double x = b->point[0][i], y = b->point[1][i], z = b->point[2][i];
    b->sum[0][i] = c[0] + x * (c[1] + c[4] * x + c[5] * y + c[6] * z) +
                   y * (c[2] + c[7] * y + c[8] * z) + z * (c[3] + c[9] * z);
    if (gradient) {
      b->sum[1][i] = c[1] + 2 * c[4] * x + c[5] * y + c[6] * z;
      b->sum[2][i] = c[2] + c[5] * x + 2 * c[7] * y + c[8] * z;
      b->sum[3][i] = c[3] + c[6] * x + c[8] * y + 2 * c[9] * z;
    }
  }
}

/* A polynomial in some of the variables, and its derivatives by them. */
typedef struct horner {
  vector f, x, y, z;
} horner;

/* Start the sums of some points with the series of a restricted sum, by
 * Horner's rule in z within y within x, derivatives alongside. */
static inline ZS_ALWAYS void begin_restricted(block *b, const zs_rbf_sum *sum, unsigned from,
                                           bool gradient)
{
  const double *c = sum->series;
  const unsigned degree = sum->layout->degree;
  vector t[3];
  horner p = {.f = {0}};
  for (int k = 0; k < 3; k++) {
    memcpy(&t[k], &b->point[k][from], sizeof t[k]);
    t[k] -= sum->middle[k];
  }
  for (unsigned i = degree + 1; i-- > 0;) {
    horner q = {.f = {0}};
    for (unsigned j = degree - i + 1; j-- > 0;) {
      horner r = {.f = {0}};
      for (unsigned k = degree - i - j + 1; k-- > 0;) {
        if (gradient)
          r.z = r.z * t[2] + r.f;
        r.f = r.f * t[2] + *c++;
      }
      if (gradient) {
        q.y = q.y * t[1] + q.f;
        q.z = q.z * t[1] + r.z;
      }
      q.f = q.f * t[1] + r.f;
    }
    if (gradient) {
      p.x = p.x * t[0] + p.f;
      p.y = p.y * t[0] + q.y;
      p.z = p.z * t[0] + q.z;
    }
    p.f = p.f * t[0] + q.f;
  }
  memcpy(&b->sum[0][from], &p.f, sizeof p.f);
  if (gradient) {
    memcpy(&b->sum[1][from], &p.x, sizeof p.x);
    memcpy(&b->sum[2][from], &p.y, sizeof p.y);
    memcpy(&b->sum[3][from], &p.z, sizeof p.z);
  }
}

static inline ZS_ALWAYS void begin(block *b, const zs_block_arguments *a, bool gradient)
{
  const zs_rbf_sum *sum = a->data;
  convert(b, a);
  if (!sum->series)
    begin_whole(b, sum, a->n, gradient);
  else
    for (unsigned i = 0; i < a->n; i += ZS_WIDTH)
      begin_restricted(b, sum, i, gradient);
}

/* Add some centres to the sums of POINTS points. */
static inline ZS_ALWAYS void add(zs_rbf_kernel kernel, block *b, unsigned from,
                              const zs_rbf_centre *centres, size_t count, bool gradient)
{
  vector point[3][VECTORS], sum[4][VECTORS];
  const unsigned rows = gradient ? 4 : 1;
  for (unsigned k = 0; k < 3; k++)
    memcpy(point[k], &b->point[k][from], sizeof point[k]);
  for (unsigned k = 0; k < rows; k++)
    memcpy(sum[k], &b->sum[k][from], sizeof sum[k]);
  for (size_t j = 0; j < count; j++) {
    const zs_rbf_centre c = centres[j];
    for (unsigned v = 0; v < VECTORS; v++) {
      vector x = point[0][v] - c.x, y = point[1][v] - c.y, z = point[2][v] - c.z;
      vector s = x * x + y * y + z * z + c.lift;
      if (!gradient) {
        sum[0][v] += c.weight * zs_vector_phi(kernel, s);
        continue;
      }
      vector slope;
      sum[0][v] += c.weight * zs_vector_phi_and_slope(kernel, s, &slope);
      slope *= c.weight;
      sum[1][v] += slope * x;
      sum[2][v] += slope * y;
      sum[3][v] += slope * z;
    }
  }
  for (unsigned k = 0; k < rows; k++)
    memcpy(&b->sum[k][from], sum[k], sizeof sum[k]);
}

static inline ZS_ALWAYS void add_all(zs_rbf_kernel kernel, block *b, const zs_block_arguments *a,
                                  bool gradient)
{
  const zs_rbf_sum *sum = a->data;
  begin(b, a, gradient);
  for (size_t tile = 0; tile < sum->count; tile += TILE) {
    size_t count = sum->count - tile < TILE ? sum->count - tile : TILE;
    for (unsigned i = 0; i < a->n; i += POINTS)
      add(kernel, b, i, sum->centres + tile, count, gradient);
  }
}

static inline ZS_ALWAYS void value(zs_rbf_kernel kernel, const zs_block_arguments *a)
{
  block b;
  add_all(kernel, &b, a, false);
  for (unsigned i = 0; i < a->n; i++)
    a->out[i] = (float)b.sum[0][i];
}

/* The gradient by the frame's coordinates through the inputs' own. */
static inline ZS_ALWAYS void gradient(zs_rbf_kernel kernel, const zs_block_arguments *a)
{
  block b;
  add_all(kernel, &b, a, true);
  for (unsigned k = 1; k < 4; k++) {
    double row[ZS_BLOCK];
    for (unsigned i = 0; i < a->n; i++)
      row[i] = b.sum[1][i] * a->in[0][k * ZS_BLOCK + i] + b.sum[2][i] * a->in[1][k * ZS_BLOCK + i] +
               b.sum[3][i] * a->in[2][k * ZS_BLOCK + i];
    for (unsigned i = 0; i < a->n; i++)
      a->out[k * ZS_BLOCK + i] = (float)row[i];
  }
  for (unsigned i = 0; i < a->n; i++)
    a->out[i] = (float)b.sum[0][i];
}

static void bounds(const zs_bounds_arguments *a)
{
  const zs_rbf_sum *sum = a->data;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    float lo[3], hi[3], f[2];
    for (int k = 0; k < 3; k++) {
      lo[k] = a->in[k]->lo[l];
      hi[k] = a->in[k]->hi[l];
    }
    zs_rbf_tree_bounds(sum->tree, lo, hi, f);
    a->out->lo[l] = f[0];
    a->out->hi[l] = f[1];
  }
}

#define DEFINE_KERNEL(KERNEL) \
  static void KERNEL##_value(const zs_block_arguments *a) \
  { \
    value(ZS_RBF_##KERNEL, a); \
  } \
  static void KERNEL##_gradient(const zs_block_arguments *a) \
  { \
    gradient(ZS_RBF_##KERNEL, a); \
  }
DEFINE_KERNEL(R)
DEFINE_KERNEL(R3)
DEFINE_KERNEL(R5)
DEFINE_KERNEL(TPS2)
DEFINE_KERNEL(TPS4)

#define KERNEL_ROW(KERNEL) [ZS_RBF_##KERNEL] = {KERNEL##_value, KERNEL##_gradient, bounds}

const zs_rbf_sum_table ZS_KERNELS(zs_rbf_sum_kernels) = {
  KERNEL_ROW(R), KERNEL_ROW(R3), KERNEL_ROW(R5), KERNEL_ROW(TPS2), KERNEL_ROW(TPS4),
};
