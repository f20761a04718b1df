/* Block, gradient and bounds kernels of warps.  Compiled once per instruction set. */
#include "samples/warp.h"

#include "samples/warp_point.h"

/* What is added at a point, and its derivatives unless `slope` is NULL. */
static void move_at(const zs_warp *warp, const float *const in[3], unsigned i, double value[3],
                    double slope[3][3])
{
  const double at[3] = {(double)in[0][i], (double)in[1][i], (double)in[2][i]};
  const double sum = at[0] + at[1] + at[2];
  if (!isfinite(sum)) {
    for (int k = 0; k < 3; k++)
      value[k] = isnan(sum) ? (double)NAN : 0;
    if (slope)
      memset(slope, 0, 3 * sizeof *slope);
  } else if (warp->backward) {
    zs_warp_solve(warp, at, slope ? ZS_WARP_SMOOTH : ZS_WARP_SINGLE, value, slope);
  } else if (slope) {
    zs_warp_evaluate(warp, at, value, slope);
  } else {
    zs_warp_evaluate(warp, at, value, NULL);
  }
}

static void value(const zs_block_arguments *a)
{
  const zs_warp_part *part = a->data;
  for (unsigned i = 0; i < a->n; i++) {
    double all[3];
    move_at(part->warp, a->in, i, all, NULL);
    a->out[i] = (float)all[part->component];
    for (unsigned s = 0; s < a->siblings; s++)
      a->sibling[s].out[i] = (float)all[((const zs_warp_part *)a->sibling[s].data)->component];
  }
}

/* By the frame's coordinates, through the inputs' own derivatives `by`. */
static void put(float *out, unsigned i, double value, const double slope[3],
                const float by[3][3])
{
  out[i] = (float)value;
  for (unsigned r = 0; r < 3; r++) {
    float sum = 0;
    for (int k = 0; k < 3; k++)
      sum += (float)slope[k] * by[k][r];
    out[(r + 1) * ZS_BLOCK + i] = sum;
  }
}

static void gradient(const zs_block_arguments *a)
{
  const zs_warp_part *part = a->data;
  for (unsigned i = 0; i < a->n; i++) {
    double all[3], slope[3][3];
    float by[3][3];
    move_at(part->warp, a->in, i, all, slope);
    for (int k = 0; k < 3; k++) /* the outputs may be the inputs */
      for (unsigned r = 0; r < 3; r++)
        by[k][r] = a->in[k][(r + 1) * ZS_BLOCK + i];
    put(a->out, i, all[part->component], slope[part->component], (const float(*)[3])by);
    for (unsigned s = 0; s < a->siblings; s++) {
      const int component = ((const zs_warp_part *)a->sibling[s].data)->component;
      put(a->sibling[s].out, i, all[component], slope[component], (const float(*)[3])by);
    }
  }
}

static void put_bounds(zs_bounds *out, unsigned lane, bool known, double lo, double hi)
{
  out->lo[lane] = known ? nextafterf((float)lo, -INFINITY) : NAN;
  out->hi[lane] = known ? nextafterf((float)hi, INFINITY) : NAN;
}

static void bounds(const zs_bounds_arguments *a)
{
  const zs_warp_part *part = a->data;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double lo[3], hi[3], least[3] = {0}, most[3] = {0};
    bool known = true;
    for (int k = 0; k < 3; k++) {
      lo[k] = (double)a->in[k]->lo[l];
      hi[k] = (double)a->in[k]->hi[l];
      known &= lo[k] <= hi[k] && isfinite(lo[k]) && isfinite(hi[k]);
    }
    if (known)
      zs_warp_bounds(part->warp, lo, hi, least, most);
    put_bounds(a->out, l, known, least[part->component], most[part->component]);
    for (unsigned s = 0; s < a->siblings; s++) {
      const int component = ((const zs_warp_part *)a->sibling[s].data)->component;
      put_bounds(a->sibling[s].out, l, known, least[component], most[component]);
    }
  }
}

const zs_kernels ZS_KERNELS(zs_warp_kernels) = {value, gradient, bounds};
