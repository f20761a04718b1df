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
  if (!control || !control->memory_limit || bytes <= control->memory_limit)
    return true;
  return zs_fail(diag, ZS_ERROR_MEMORY, NULL,
                 "%s takes %" PRIu64 " bytes, over the memory limit of %" PRIu64, what, bytes,
                 control->memory_limit);
}

uint64_t zs_count_bits(const uint8_t *bytes, size_t n)
{
  uint64_t count = 0, word;
  for (; n >= sizeof word; bytes += sizeof word, n -= sizeof word) {
    memcpy(&word, bytes, sizeof word);
    count += (unsigned)__builtin_popcountll(word);
  }
  for (; n; bytes++, n--)
    count += (unsigned)__builtin_popcount(*bytes);
  return count;
}
