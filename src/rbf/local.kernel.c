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
  COLUMNS = ZS_WIDTH == 8 ? 8 : 4, /* of a strip */
  PANEL = 4 * BLOCK, /* columns whose share of earlier ones is subtracted at once ... */
  DEPTH = 192        /* ... and how many of these at a time, for caches to hold both */
};

/* c -= a b, one strip: a has depth columns of STRIP, b as many rows of COLUMNS. */
static inline ZS_ALWAYS void subtract_strip(double *c, size_t c_stride, const double *a,
                                            const double *b, size_t depth)
{
  zs_vector sum[COLUMNS][VECTORS] = {{{0}}};
  for (size_t k = 0; k < depth; k++) {
    zs_vector column[VECTORS];
    for (unsigned v = 0; v < VECTORS; v++)
      column[v] = zs_vector_load(a + k * STRIP + v * ZS_WIDTH);
    for (unsigned j = 0; j < COLUMNS; j++)
      for (unsigned v = 0; v < VECTORS; v++)
        sum[j][v] += column[v] * b[k * COLUMNS + j];
  }
  for (unsigned j = 0; j < COLUMNS; j++)
    for (unsigned v = 0; v < VECTORS; v++) {
      double *at = c + j * c_stride + v * ZS_WIDTH;
      zs_vector_store(at, zs_vector_load(at) - sum[j][v]);
    }
}

/* Rows of b, of some columns, so that those of a strip follow each other. */
static void pack_right(double *to, const double *b, size_t b_down, size_t b_across, size_t columns,
                       size_t depth)
{
  for (size_t j = 0; j < columns; j += COLUMNS, to += COLUMNS * depth)
    for (size_t k = 0; k < depth; k++)
      for (size_t i = 0; i < COLUMNS; i++)
        to[k * COLUMNS + i] = b[k * b_down + (j + i) * b_across];
}

static void pack_left(double *to, const double *a, size_t a_stride, size_t depth)
{
  for (size_t k = 0; k < depth; k++)
    for (size_t v = 0; v < STRIP; v += ZS_WIDTH)
      zs_vector_store(to + k * STRIP + v, zs_vector_load(a + k * a_stride + v));
}

/* c -= a b where b[k, j] is b[k * b_down + j * b_across].  Factors are packed: columns of a
 * matrix are far apart, and often in each other's place of the cache. */
static void subtract_general(double *c, size_t c_stride, size_t rows, size_t columns,
                             const double *a, size_t a_stride, const double *b, size_t b_down,
                             size_t b_across, size_t depth)
{
  double right[DEPTH * PANEL];
  _Alignas(64) double left[DEPTH * STRIP];
  for (size_t first = 0; first < depth; first += DEPTH) {
    const size_t count = depth - first < DEPTH ? depth - first : DEPTH;
    for (size_t j = 0; j < columns; j += PANEL) {
      const size_t width = columns - j < PANEL ? columns - j : PANEL;
      pack_right(right, b + first * b_down + j * b_across, b_down, b_across, width, count);
      for (size_t i = 0; i < rows; i += STRIP) {
        pack_left(left, a + first * a_stride + i, a_stride, count);
        for (size_t k = 0; k < width; k += COLUMNS)
          subtract_strip(c + (j + k) * c_stride + i, c_stride, left, right + k * count, count);
      }
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

/* A triangular block on the diagonal, its transpose too, with inverse numbers on the diagonal. */
typedef struct triangle {
  double below[BLOCK][BLOCK], above[BLOCK][BLOCK]; /* l[i, j], and l[j, i], by i and j */
} triangle;

static void take_triangle(triangle *t, const double *l, size_t l_stride)
{
  for (size_t j = 0; j < BLOCK; j++)
    for (size_t i = j; i < BLOCK; i++)
      t->below[i][j] = t->above[j][i] = i == j ? 1 / l[j * l_stride + j] : l[j * l_stride + i];
}

/* x := x l^-T, a strip of rows at a time. */
static void divide_transposed(double *x, size_t x_stride, size_t rows, const double *l,
                              size_t l_stride)
{
  triangle t;
  take_triangle(&t, l, l_stride);
  for (size_t i = 0; i < rows; i += ZS_WIDTH) {
    zs_vector strip[BLOCK];
    for (size_t j = 0; j < BLOCK; j++) {
      zs_vector sum = zs_vector_load(x + j * x_stride + i);
      for (size_t k = 0; k < j; k++)
        sum -= t.below[j][k] * strip[k];
      strip[j] = sum * t.below[j][j];
      zs_vector_store(x + j * x_stride + i, strip[j]);
    }
  }
}

/* x := x l^-1, the same way. */
static void divide(double *x, size_t x_stride, size_t rows, const double *l, size_t l_stride)
{
  triangle t;
  take_triangle(&t, l, l_stride);
  for (size_t i = 0; i < rows; i += ZS_WIDTH) {
    zs_vector strip[BLOCK];
    for (size_t j = BLOCK; j-- > 0;) {
      zs_vector sum = zs_vector_load(x + j * x_stride + i);
      for (size_t k = j + 1; k < BLOCK; k++)
        sum -= t.above[j][k] * strip[k];
      strip[j] = sum * t.above[j][j];
      zs_vector_store(x + j * x_stride + i, strip[j]);
    }
  }
}

static bool factorise(double *a, size_t stride, size_t n)
{
  const size_t odd = n % BLOCK;
  if (!factorise_columns(a, stride, odd, n))
    return false;
  for (size_t first = odd; first < n; first += PANEL) {
    const size_t end = n - first < PANEL ? n : first + PANEL;
    subtract(a + first * stride + first, stride, n - first, end - first, a + first, stride,
             a + first, stride, first);
    for (size_t j = first; j < end; j += BLOCK) {
      double *block = a + j * stride + j;
      subtract(block, stride, n - j, BLOCK, a + first * stride + j, stride,
               a + first * stride + j, stride, j - first);
      if (!factorise_columns(block, stride, BLOCK, BLOCK))
        return false;
      divide_transposed(block + BLOCK, stride, n - j - BLOCK, block, stride);
    }
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
