#include "rbf/product.h"

zs_rbf_multiply_kernel *zs_rbf_multiply_select(void)
{
  static zs_rbf_multiply_kernel *const table[ZS_ISA_COUNT] = ZS_VARIANTS(zs_rbf_multiply, );
  return table[zs_isa_select()];
}

void zs_rbf_multiply(const zs_rbf_product *product, unsigned threads)
{
  enum { PART = 256 }; /* targets: enough to hide what starting costs */
  (void)threads; /* without OpenMP */
  zs_rbf_multiply_kernel *multiply = zs_rbf_multiply_select();
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
  for (size_t first = 0; first < product->target_count; first += PART) {
    const size_t left = product->target_count - first;
    zs_rbf_product part = *product;
    part.targets += first * product->dimension;
    part.sums += first;
    part.target_count = left < PART ? left : PART;
    multiply(&part);
  }
}

/* The sums of two parts of the points for each other, or of one for itself. */
static void multiply_parts(const zs_rbf_product *product, zs_rbf_multiply_kernel *multiply,
                           size_t part, const size_t parts[2])
{
  zs_rbf_product own = *product;
  size_t first[2], count[2];
  for (int k = 0; k < 2; k++) {
    first[k] = parts[k] * part;
    const size_t left = product->source_count - first[k];
    count[k] = left < part ? left : part;
  }
  own.targets += first[0] * product->dimension;
  own.sums += first[0];
  own.target_count = count[0];
  own.sources += first[1] * product->dimension;
  own.weights += first[1];
  own.source_count = count[1];
  if (parts[0] != parts[1]) {
    own.target_weights = product->weights + first[0];
    own.source_sums = product->sums + first[1];
  }
  multiply(&own);
}

/* In the k-th round parts meet whose numbers add up to k, around: every part meets one other or
 * itself, so that no two threads add to the same sums, and in all rounds every one. */
void zs_rbf_multiply_symmetric(const zs_rbf_product *product, unsigned threads)
{
  enum { PART = 128 };
  (void)threads; /* without OpenMP */
  zs_rbf_multiply_kernel *multiply = zs_rbf_multiply_select();
  const size_t parts = (product->source_count + PART - 1) / PART;
#pragma omp parallel num_threads(threads)
  for (size_t round = 0; round < parts; round++) {
#pragma omp for schedule(dynamic, 1)
    for (size_t i = 0; i < parts; i++) {
      const size_t pair[] = {i, (round + parts - i) % parts};
      if (pair[0] <= pair[1])
        multiply_parts(product, multiply, PART, pair);
    }
  }
}
