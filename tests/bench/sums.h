/* The rows of the benchmark about evaluating fits. */
#ifndef ZS_BENCH_SUMS_H
#define ZS_BENCH_SUMS_H

#include "bench.h"

#include "rbf/fit.h"

void bench_sum_header(void);

/* One row; false when something failed or is wrong. */
bool bench_sum(bench *b, const zs_rbf *rbf);

#endif
