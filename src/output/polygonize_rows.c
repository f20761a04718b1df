#include "output/polygonize_rows.h"

#if defined ZS_WITH_X86_KERNELS
extern const zs_row_kernels zs_row_kernels_baseline, zs_row_kernels_avx2, zs_row_kernels_avx512;
static const zs_row_kernels *const kernels[ZS_ISA_COUNT] = {
  &zs_row_kernels_baseline, &zs_row_kernels_avx2, &zs_row_kernels_avx512};
#else
extern const zs_row_kernels zs_row_kernels_baseline;
static const zs_row_kernels *const kernels[ZS_ISA_COUNT] = {
  &zs_row_kernels_baseline, &zs_row_kernels_baseline, &zs_row_kernels_baseline};
#endif

const zs_row_kernels *zs_row_kernels_of(zs_isa_kind isa)
{
  return kernels[isa];
}
