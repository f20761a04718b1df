/* Small dense matrices.  Compiled once per instruction set.
 *
 * Everything is made of one product: a strip of the result stays in registers
 * while columns of the left factor stream past.  Factorisations go by blocks of
 * columns, each of which first subtracts what all earlier ones contribute. */
#include "rbf/local.h"
#include "rbf/vector.h"

#include <math.h>
#include <string.h>

enum {
  BLOCK = ZS_LOCAL_BLOCK,
  VECTORS = 2, /* of a strip */
  STRIP = VECTORS * ZS_WIDTH,
  COLUMNS = ZS_WIDTH == 8 ? 8 : 4 /* of a strip */
};

/* c -= a b, one strip: a is STRIP x depth; b has depth rows of COLUMNS. */
static inline ZS_ALWAYS void subtract_strip(double *c, size_t c_stride, const double *a,
                                            size_t a_stride, const double *b, size_t depth)
{
  zs_vector sum[COLUMNS][VECTORS] = {{{0}}};
  for (size_t k = 0; k < depth; k++) {
    zs_vector column[VECTORS];
    memcpy(column, a + k * a_stride, sizeof column);
    for (unsigned j = 0; j < COLUMNS; j++)
      for (unsigned v = 0; v < VECTORS; v++)
        sum[j][v] += column[v] * b[k * COLUMNS + j];
  }
  for (unsigned j = 0; j < COLUMNS; j++) {
    zs_vector column[VECTORS];
    memcpy(column, c + j * c_stride, sizeof column);
    for (unsigned v = 0; v < VECTORS; v++)
      column[v] -= sum[j][v];
    memcpy(c + j * c_stride, column, sizeof column);
  }
}

/* c -= a b where b[k, j] is b[k * b_down + j * b_across]. */
static void subtract_general(double *c, size_t c_stride, size_t rows, size_t columns,
                             const double *a, size_t a_stride, const double *b, size_t b_down,
                             size_t b_across, size_t depth)
{
  enum { DEPTH = 512 };
  double packed[DEPTH * COLUMNS];
  for (size_t first = 0; first < depth; first += DEPTH) {
    const size_t count = depth - first < DEPTH ? depth - first : DEPTH;
    for (size_t j = 0; j < columns; j += COLUMNS) {
      for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < COLUMNS; i++)
          packed[k * COLUMNS + i] = b[(first + k) * b_down + (j + i) * b_across];
      for (size_t i = 0; i < rows; i += STRIP)
        subtract_strip(c + j * c_stride + i, c_stride, a + first * a_stride + i, a_stride, packed,
                       count);
    }
  }
}

static void subtract(double *c, size_t c_stride, size_t rows, size_t columns, const double *a,
                     size_t a_stride, const double *b, size_t b_stride, size_t depth)
{
  subtract_general(c, c_stride, rows, columns, a, a_stride, b, b_stride, 1, depth);
}

/* The first columns of the Cholesky factor of a matrix, in place; of the others what these
 * contribute to them is not subtracted. */
static inline ZS_ALWAYS bool factorise_columns(double *a, size_t stride, size_t columns,
                                               size_t rows)
{
  for (size_t j = 0; j < columns; j++) {
    double *column = a + j * stride;
    if (!(column[j] > 0) || isinf(column[j]))
      return false;
    const double pivot = sqrt(column[j]);
    for (size_t i = j; i < rows; i++)
      column[i] /= pivot;
    for (size_t k = j + 1; k < columns; k++)
      for (size_t i = k; i < rows; i++)
        a[k * stride + i] -= column[i] * column[k];
  }
  return true;
}

/* to -= factor from */
static void subtract_column(double *restrict to, const double *restrict from, double factor,
                            size_t rows)
{
  for (size_t i = 0; i < rows; i++)
    to[i] -= factor * from[i];
}

static void scale_column(double *column, double factor, size_t rows)
{
  for (size_t i = 0; i < rows; i++)
    column[i] *= factor;
}

/* x := x l^-T, with l a triangular block on the diagonal. */
static void divide_transposed(double *x, size_t x_stride, size_t rows, const double *l,
                              size_t l_stride)
{
  for (size_t j = 0; j < BLOCK; j++) {
    for (size_t k = 0; k < j; k++)
      subtract_column(x + j * x_stride, x + k * x_stride, l[k * l_stride + j], rows);
    scale_column(x + j * x_stride, 1 / l[j * l_stride + j], rows);
  }
}

/* x := x l^-1. */
static void divide(double *x, size_t x_stride, size_t rows, const double *l, size_t l_stride)
{
  for (size_t j = BLOCK; j-- > 0;) {
    for (size_t k = j + 1; k < BLOCK; k++)
      subtract_column(x + j * x_stride, x + k * x_stride, l[j * l_stride + k], rows);
    scale_column(x + j * x_stride, 1 / l[j * l_stride + j], rows);
  }
}

static bool factorise(double *a, size_t stride, size_t n)
{
  const size_t odd = n % BLOCK;
  if (!factorise_columns(a, stride, odd, n))
    return false;
  for (size_t j = odd; j < n; j += BLOCK) {
    double *block = a + j * stride + j;
    subtract(block, stride, n - j, BLOCK, a + j, stride, a + j, stride, j);
    if (!factorise_columns(block, stride, BLOCK, BLOCK))
      return false;
    divide_transposed(block + BLOCK, stride, n - j - BLOCK, block, stride);
  }
  return true;
}

static bool invert(const zs_local *local)
{
  const size_t n = local->size, inner = local->inner, outer = n - inner;
  double *l = local->matrix, *x = local->rows;
  if (!factorise(l, n, n))
    return false;
  /* (0 1) L^-T, whose first columns are 0 ... */
  memset(x, 0, inner * n * sizeof *x);
  for (size_t i = 0; i < inner; i++)
    x[(outer + i) * inner + i] = 1;
  for (size_t j = outer; j < n; j += BLOCK) {
    subtract(x + j * inner, inner, inner, BLOCK, x + outer * inner, inner, l + outer * n + j, n,
             j - outer);
    divide_transposed(x + j * inner, inner, inner, l + j * n + j, n);
  }
  /* ... and that by L^-1. */
  for (size_t j = n; j > 0; j -= BLOCK) {
    const size_t first = j - BLOCK;
    subtract_general(x + first * inner, inner, inner, BLOCK, x + j * inner, inner,
                     l + first * n + j, 1, n, n - j);
    divide(x + first * inner, inner, inner, l + first * n + first, n);
  }
  return true;
}

static void apply(const float *rows, size_t inner, size_t count, const double *values,
                  double *sums)
{
  double *restrict to = sums;
  for (size_t j = 0; j < count; j++) {
    const float *restrict column = rows + j * inner;
    for (size_t i = 0; i < inner; i++)
      to[i] += (double)column[i] * values[j];
  }
}

const zs_local_kernels ZS_KERNELS(zs_local_table) = {factorise, invert, subtract, apply};
