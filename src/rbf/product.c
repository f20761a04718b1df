#include "rbf/product.h"

#include <stdlib.h>

zs_rbf_multiply_kernel *zs_rbf_multiply_select(void)
{
  static zs_rbf_multiply_kernel *const table[ZS_ISA_COUNT] = ZS_VARIANTS(zs_rbf_multiply, );
  return table[zs_isa_select()];
}

/* Targets at a time: enough pairs to hide what starting on them costs, and not all at once. */
static size_t targets_together(const zs_rbf_product *product)
{
  enum { PAIRS = 1 << 15, LEAST = 16, MOST = 256 };
  const size_t count = PAIRS / (product->source_count + 1) / LEAST * LEAST;
  return count < LEAST ? LEAST : count < MOST ? count : MOST;
}

void zs_rbf_multiply(const zs_rbf_product *product, unsigned threads)
{
  (void)threads; /* without OpenMP */
  const size_t most = targets_together(product);
  zs_rbf_multiply_kernel *multiply = zs_rbf_multiply_select();
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
  for (size_t first = 0; first < product->target_count; first += most) {
    const size_t left = product->target_count - first;
    zs_rbf_product part = *product;
    part.targets += first * product->dimension;
    part.sums += first;
    part.target_count = left < most ? left : most;
    multiply(&part);
  }
}

enum { PART = 128 }; /* points */

/* Add the sums of two parts of the points for each other, or of one for itself, to `sums`, of all
 * points. */
static void multiply_parts(const zs_rbf_product *product, zs_rbf_multiply_kernel *multiply,
                           size_t target, size_t source, double *sums)
{
  zs_rbf_product own = *product;
  const size_t n = product->source_count, first[2] = {target * PART, source * PART};
  own.targets += first[0] * product->dimension;
  own.sums = sums + first[0];
  own.target_count = n - first[0] < PART ? n - first[0] : PART;
  own.sources += first[1] * product->dimension;
  own.weights += first[1];
  own.source_count = n - first[1] < PART ? n - first[1] : PART;
  if (target != source) {
    own.target_weights = product->weights + first[0];
    own.source_sums = sums + first[1];
  }
  multiply(&own);
}

/* One of so many shares of all pairs of parts. */
static void multiply_share(const zs_rbf_product *product, size_t share, size_t shares,
                           double *sums)
{
  zs_rbf_multiply_kernel *multiply = zs_rbf_multiply_select();
  const size_t parts = (product->source_count + PART - 1) / PART;
  /* Rows of a triangle, one after the other. */
  for (size_t row = 0, column = share; row < parts;) {
    if (column < parts) {
      multiply_parts(product, multiply, row, column, sums);
      column += shares;
    } else {
      row++;
      column -= parts - row;
    }
  }
}

/* Shares of so many points: some pairs of parts each, and no more than there is room for sums. */
static size_t share_count(size_t points)
{
  enum { PAIRS = 4, MOST = 64, ROOM = 1 << 22 };
  const size_t parts = (points + PART - 1) / PART, room = ROOM / (points + 1);
  const size_t wanted = parts * (parts + 1) / 2 / PAIRS, most = room < MOST ? room : MOST;
  return wanted < most ? wanted : most;
}

double zs_rbf_multiply_symmetric_bytes(size_t points)
{
  return (double)share_count(points) * (double)points * sizeof(double);
}

/* Every share has sums of its own, which are added up in order at the end. */
void zs_rbf_multiply_symmetric(const zs_rbf_product *product, unsigned threads)
{
  (void)threads; /* without OpenMP */
  const size_t n = product->source_count, shares = share_count(n);
  double *sums = shares > 1 ? calloc(shares * n, sizeof *sums) : NULL;
  if (!sums) {
    multiply_share(product, 0, 1, product->sums);
    return;
  }
#pragma omp parallel num_threads(threads)
  {
#pragma omp for schedule(dynamic, 1)
    for (size_t s = 0; s < shares; s++)
      multiply_share(product, s, shares, sums + s * n);
#pragma omp for schedule(static)
    for (size_t i = 0; i < n; i++)
      for (size_t s = 0; s < shares; s++)
        product->sums[i] += sums[s * n + i];
  }
  free(sums);
}
