#include "rbf/local.h"

const zs_local_kernels *zs_local_select(void)
{
  static const zs_local_kernels *const table[ZS_ISA_COUNT] = ZS_VARIANTS(zs_local_table, );
  return table[zs_isa_select()];
}
