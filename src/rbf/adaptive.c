#include "rbf/adaptive.h"

#include "rbf/product.h"

#include <math.h>
#include <string.h>

enum {
  FEW = 12000, /* points, of which fewer gain nothing by clusters */
  FIRST = 6    /* order to try */
};

/* Errors fall about so much with each order: 5 times for r, 7 for r^3.  To try again costs more
 * than to be a little better than asked. */
static const double FALL = 6, SAFE = 0.5;

/* The order that should do when the error is expected to be `error` with the series' latest. */
static unsigned choose_order(const zs_adaptive_series *series, double error, double accuracy)
{
  if (!(error > 0))
    return series->order ? series->order : FIRST;
  const double orders = series->order + ceil(log(error / (SAFE * accuracy)) / log(FALL));
  return (unsigned)fmin(fmax(orders, ZS_FAST_LEAST_ORDER), ZS_FAST_MOST_ORDER + 1);
}

/* Make products of an order; false when memory is out. */
static bool build(zs_adaptive *a, unsigned order)
{
  if (a->fast && a->built == order)
    return true;
  zs_fast_free(a->fast);
  a->fast = zs_fast_new(a->system->radial, a->clusters, a->clusters, order, a->system->threads);
  a->built = order;
  return a->fast;
}

/* The product by clusters without what smoothing adds, and what it is off by. */
static bool multiply(zs_adaptive *a, const double *d, double *result, zs_fast_errors *errors)
{
  memset(result, 0, a->system->count * sizeof *result);
  if (!zs_fast_multiply(a->fast, d, result))
    return false;
  *errors = zs_fast_compare(a->fast, d, result);
  return true;
}

static void finish(const zs_adaptive *a, const double *d, double *result)
{
  const double sign = zs_rbf_sign(a->system->radial.kernel);
  for (size_t i = 0; i < a->system->count; i++)
    result[i] = sign * result[i] + a->system->smoothing * d[i];
}

bool zs_adaptive_multiply(zs_adaptive *a, zs_adaptive_series *series, const double *d,
                          double accuracy, double *result, zs_fast_errors *errors)
{
  zs_fast_errors measured = {0, 0};
  bool done = false;
  if (!a->limit)
    a->limit = zs_adaptive_is_exact(a->system) ? ZS_FAST_LEAST_ORDER : ZS_FAST_MOST_ORDER + 1;
  unsigned order = choose_order(series, fmax(series->growth, 1) * series->error, accuracy);
  while (!done && order < a->limit) {
    if (!build(a, order))
      return false;
    if (!zs_fast_is_worthwhile(a->fast)) {
      a->limit = order;
    } else if (!multiply(a, d, result, &measured)) {
      return false;
    } else {
      done = !(measured.mean > accuracy);
      series->order = order;
      series->error = measured.mean;
      order = choose_order(series, series->error, accuracy);
    }
  }
  if (done) {
    finish(a, d, result);
  } else {
    measured = (zs_fast_errors){0, 0};
    zs_rbf_system_multiply(a->system, d, result);
  }
  if (errors)
    *errors = measured;
  return true;
}

void zs_adaptive_clear(zs_adaptive *adaptive)
{
  zs_fast_free(adaptive->fast);
  adaptive->fast = NULL;
}

bool zs_adaptive_is_exact(const zs_rbf_system *system)
{
  return system->count < FEW;
}

double zs_adaptive_bytes(const zs_rbf_system *system)
{
  const double fast =
    zs_adaptive_is_exact(system) ? 0 : zs_fast_bytes(system->count, system->dimension);
  return fast + zs_rbf_multiply_symmetric_bytes(system->count);
}
