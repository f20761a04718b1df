#include "output/polygonize_rows.h"

ZS_DECLARE_VARIANTS(zs_row_kernels, zs_row_kernels)
static const zs_row_kernels *const kernels[ZS_ISA_COUNT] = ZS_VARIANTS(zs_row_kernels, );

const zs_row_kernels *zs_row_kernels_of(zs_isa_kind isa)
{
  return kernels[isa];
}
