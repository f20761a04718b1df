#include "output/job.h"

#include "base/diagnostic.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

void zs_control_init(zs_control *control)
{
  *control = (zs_control){0};
}

zs_counter *zs_counters_new(unsigned threads)
{
  zs_counter *counters = aligned_alloc(_Alignof(zs_counter), threads * sizeof *counters);
  if (counters)
    memset(counters, 0, threads * sizeof *counters);
  return counters;
}

uint64_t zs_counters_sum(const zs_counter *counters, unsigned threads)
{
  uint64_t sum = 0;
  for (unsigned t = 0; t < threads; t++)
    sum += counters[t].count;
  return sum;
}

bool zs_memory_check(const zs_control *control, uint64_t bytes, const char *what, zs_diag *diag)
{
  if (zs_control_allows(control, (double)bytes))
    return true;
  return zs_fail(diag, ZS_ERROR_MEMORY, NULL,
                 "%s takes %" PRIu64 " bytes, over the memory limit of %" PRIu64, what, bytes,
                 control->memory_limit);
}

/* Eight bytes at a time; the sums of 31 words of them fit into a byte. */
uint64_t zs_count_odd(const uint8_t *bytes, size_t n)
{
  const uint64_t ones = UINT64_C(0x0101010101010101);
  uint64_t count = 0;
  while (n >= sizeof ones) {
    size_t words = n / sizeof ones < 31 ? n / sizeof ones : 31;
    uint64_t sums = 0;
    for (size_t i = 0; i < words; i++) {
      uint64_t word;
      memcpy(&word, bytes + i * sizeof word, sizeof word);
      sums += word & ones;
    }
    count += sums * ones >> 56;
    bytes += words * sizeof ones;
    n -= words * sizeof ones;
  }
  for (; n; bytes++, n--)
    count += *bytes & 1;
  return count;
}

bool zs_quantity_check(zs_quantity quantity, zs_diag *diag)
{
  return quantity == ZS_QUANTITY_VALUE || quantity == ZS_QUANTITY_INSIDE ||
         zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                 "the quantity is %d; expected VALUE (0) or INSIDE (1)", (int)quantity);
}
