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
