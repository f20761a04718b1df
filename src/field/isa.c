#include "field/field.h"

#include <stdlib.h>
#include <string.h>

static const char *const names[ZS_ISA_COUNT] = {"baseline", "avx2", "avx512"};

static zs_isa_kind best_of_machine(void)
{
#if defined ZS_WITH_X86_KERNELS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    return ZS_ISA_AVX512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    return ZS_ISA_AVX2;
#endif
  return ZS_ISA_BASELINE;
}

zs_isa_kind zs_isa_select(void)
{
  zs_isa_kind best = best_of_machine();
  const char *asked = getenv("ZEROSET_ISA");
  for (unsigned isa = 0; asked && isa < best; isa++)
    if (!strcmp(asked, names[isa]))
      return (zs_isa_kind)isa;
  return best;
}

const char *zs_isa(void)
{
  return names[zs_isa_select()];
}
