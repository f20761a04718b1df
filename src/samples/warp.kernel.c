/* Block, gradient and bounds kernels of warps.  Compiled once per instruction set. */
#include "samples/warp.h"

#include "samples/warp_point.h"

/* A component at a point, and its derivatives unless `slope` is NULL. */
static double component_at(const zs_warp_part *part, const float *const in[3], unsigned i,
                           double slope[3])
{
  const double at[3] = {(double)in[0][i], (double)in[1][i], (double)in[2][i]};
  double value[3], slopes[3][3];
  if (!isfinite(at[0] + at[1] + at[2])) {
    if (slope)
      slope[0] = slope[1] = slope[2] = 0;
    return isnan(at[0] + at[1] + at[2]) ? (double)NAN : 0;
  }
  if (part->warp->backward)
    zs_warp_solve(part->warp, at, slope ? ZS_WARP_SMOOTH : ZS_WARP_SINGLE, value,
                  slope ? slopes : NULL);
  else if (slope)
    zs_warp_evaluate(part->warp, at, value, slopes);
  else
    zs_warp_evaluate(part->warp, at, value, NULL);
  if (slope)
    memcpy(slope, slopes[part->component], sizeof slopes[0]);
  return value[part->component];
}

static void value(const zs_block_arguments *a)
{
  for (unsigned i = 0; i < a->n; i++)
    a->out[i] = (float)component_at(a->data, a->in, i, NULL);
}

/* By the frame's coordinates, through the inputs' own derivatives. */
static void gradient(const zs_block_arguments *a)
{
  for (unsigned i = 0; i < a->n; i++) {
    double slope[3];
    const double f = component_at(a->data, a->in, i, slope);
    for (unsigned r = 1; r < 4; r++) {
      float sum = 0;
      for (int k = 0; k < 3; k++)
        sum += (float)slope[k] * a->in[k][r * ZS_BLOCK + i];
      a->out[r * ZS_BLOCK + i] = sum;
    }
    a->out[i] = (float)f;
  }
}

static void bounds(const zs_bounds_arguments *a)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double lo[3], hi[3], result[2] = {(double)NAN, (double)NAN};
    bool known = true;
    for (int k = 0; k < 3; k++) {
      lo[k] = (double)a->in[k]->lo[l];
      hi[k] = (double)a->in[k]->hi[l];
      known &= lo[k] <= hi[k] && isfinite(lo[k]) && isfinite(hi[k]);
    }
    if (known)
      zs_warp_bounds(a->data, lo, hi, result);
    a->out->lo[l] = known ? nextafterf((float)result[0], -INFINITY) : NAN;
    a->out->hi[l] = known ? nextafterf((float)result[1], INFINITY) : NAN;
  }
}

const zs_kernels ZS_KERNELS(zs_warp_kernels) = {value, gradient, bounds};
