/* Block, gradient and bounds kernels of rasters.  Compiled once per instruction set. */
#include "samples/raster_point.h"

static void value(const zs_block_arguments *a)
{
  const zs_raster *raster = a->data;
  for (unsigned i = 0; i < a->n; i++) {
    const double point[3] = {(double)a->in[0][i], (double)a->in[1][i], (double)a->in[2][i]};
    a->out[i] = (float)zs_raster_at(raster, point, NULL);
  }
}

static void gradient(const zs_block_arguments *a)
{
  const zs_raster *raster = a->data;
  const float *x = a->in[0], *y = a->in[1], *z = a->in[2];
  for (unsigned i = 0; i < a->n; i++) {
    const double point[3] = {(double)x[i], (double)y[i], (double)z[i]};
    double slope[3] = {NAN, NAN, NAN};
    const double f = zs_raster_at(raster, point, slope);
    float g[3];
    for (unsigned k = 0; k < 3; k++) {
      const unsigned row = (k + 1) * ZS_BLOCK + i;
      g[k] = (float)(slope[0] * (double)x[row] + slope[1] * (double)y[row] +
                     slope[2] * (double)z[row]);
    }
    /* The output may be one of the inputs. */
    a->out[i] = (float)f;
    for (unsigned k = 0; k < 3; k++)
      a->out[(k + 1) * ZS_BLOCK + i] = g[k];
  }
}

static void bounds(const zs_bounds_arguments *a)
{
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double lo[3], hi[3], sum = 0;
    for (int k = 0; k < 3; k++) {
      lo[k] = (double)a->in[k]->lo[l];
      hi[k] = (double)a->in[k]->hi[l];
      sum += lo[k] + hi[k];
    }
    float result[2] = {NAN, NAN};
    if (isfinite(sum))
      zs_raster_bounds(a->data, lo, hi, result);
    a->out->lo[l] = result[0];
    a->out->hi[l] = result[1];
  }
}

const zs_kernels ZS_KERNELS(zs_raster_kernels) = {value, gradient, bounds};
