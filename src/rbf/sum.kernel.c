/* Block kernels of radial sums.  Compiled once per instruction set. */
#include "rbf/pairs.h"
#include "rbf/sum.h"

#include <math.h>
#include <string.h>

enum { TILE = 512 /* centres: 20 KB, to fit the nearest cache */ };

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

/* Start the sums with the polynomial. */
static inline ZS_ALWAYS void begin(block *b, const zs_rbf_terms *terms, unsigned n, bool gradient)
{
  const double *c = terms->polynomial;
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

/* Take all terms, one by one or cell by cell. */
static inline ZS_ALWAYS void add_all(zs_rbf_kernel kernel, block *b, const zs_block_arguments *a,
                                     bool gradient)
{
  const zs_rbf_sum *sum = a->data;
  const zs_rbf_terms *terms = &sum->terms;
  const zs_rbf_radial radial = {kernel, terms->radial.rate};
  convert(b, a);
  if (sum->restricted) {
    ZS_KERNELS(zs_cells_kernels)[kernel].evaluate(
      sum->cells, terms, a->n, (const double(*)[ZS_BLOCK])b->point, b->sum, gradient);
    return;
  }
  begin(b, terms, a->n, gradient);
  for (size_t tile = 0; tile < terms->count; tile += TILE) {
    const size_t count = terms->count - tile < TILE ? terms->count - tile : TILE;
    for (unsigned i = 0; i < a->n; i += ZS_PAIRS_POINTS) {
      const double *const point[3] = {&b->point[0][i], &b->point[1][i], &b->point[2][i]};
      double *const row[4] = {&b->sum[0][i], &b->sum[1][i], &b->sum[2][i], &b->sum[3][i]};
      zs_pairs pairs;
      zs_pairs_load(&pairs, point, row, gradient);
      zs_pairs_add(radial, &pairs, terms->centres + tile, count, gradient);
      zs_pairs_store(&pairs, row, gradient);
    }
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
DEFINE_KERNEL(GAUSSIAN)

#define KERNEL_ROW(KERNEL) [ZS_RBF_##KERNEL] = {KERNEL##_value, KERNEL##_gradient, bounds}

const zs_rbf_sum_table ZS_KERNELS(zs_rbf_sum_kernels) = {
  KERNEL_ROW(R),    KERNEL_ROW(R3),   KERNEL_ROW(R5),
  KERNEL_ROW(TPS2), KERNEL_ROW(TPS4), KERNEL_ROW(GAUSSIAN),
};
