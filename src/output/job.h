/* What the jobs of the back ends have in common. */
#ifndef ZS_JOB_H
#define ZS_JOB_H

#include "field/program.h"

/* A number that one thread counts, in a cache line of its own. */
typedef struct zs_counter {
  _Alignas(64) uint64_t count;
} zs_counter;

/* Zeroed counters for `threads` threads, for free(); NULL when memory is out. */
zs_counter *zs_counters_new(unsigned threads);
uint64_t zs_counters_sum(const zs_counter *counters, unsigned threads);

/* Whether a job may take `bytes` more of working memory; reports when not.
 * `what` says what for ("a layer of samples"). */
bool zs_memory_check(const zs_control *control, uint64_t bytes, const char *what, zs_diag *diag);

/* Whether a number is that of a quantity; reports when not. */
bool zs_quantity_check(zs_quantity quantity, zs_diag *diag);

/* How many of n bytes are odd. */
uint64_t zs_count_odd(const uint8_t *bytes, size_t n);

#endif
