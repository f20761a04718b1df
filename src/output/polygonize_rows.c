#include "output/polygonize_rows.h"

ZS_DECLARE_VARIANTS(zs_row_kernels, zs_row_kernels)
static const zs_row_kernels *const kernels[ZS_ISA_COUNT] = ZS_VARIANTS(zs_row_kernels, );

const zs_row_kernels *zs_row_kernels_of(zs_isa_kind isa)
{
  return kernels[isa];
}

void zs_bit_table_make(zs_bit_table *table)
{
  for (unsigned bits = 0; bits < 256; bits++) {
    unsigned count = 0;
    for (unsigned i = 0; i < 8; i++) {
      table->below[bits][i] = (uint8_t)count;
      if (bits >> i & 1)
        table->places[bits][count++] = (uint8_t)i;
    }
    table->counts[bits] = (uint8_t)count;
    while (count < 8)
      table->places[bits][count++] = 0;
  }
}
