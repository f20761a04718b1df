/* A function sampled on layers of a lattice, interpolated between the samples: an
 * operation on x, y and z.
 *
 * In a layer samples lie at whole x and y and are joined by the cubics of Catmull and
 * Rom; layers lie at any heights and are joined by cubics whose slopes at a layer are
 * those of the parabola through it and its neighbours.  Where one of these is much nearer
 * than the other, the secant to it counts for less: carried far, it would lead astray.  f
 * passes through every sample, and its derivatives are continuous.  Beyond the outermost
 * samples in x and y f falls by the distance from there; above and below the layers it
 * stays what it is on the last.
 *
 * Evaluating takes the same time everywhere, so that there is nothing to gain from a
 * region of its own. */
#ifndef ZS_RASTER_H
#define ZS_RASTER_H

#include "field/operation.h"

enum {
  ZS_RASTER_LEVELS = 24,
  ZS_RASTER_STEEPEST = 3 /* secant of a gap that counts fully, by that of its neighbour's length */
};

/* The least and the greatest sample of each block of 4 x 4 x 1 samples, or with level l
 * 2^l times as many each way. */
typedef struct zs_raster_level {
  uint32_t count[3];
  float *least, *greatest;
} zs_raster_level;

/* Immutable when finished. */
typedef struct zs_raster {
  uint32_t count[3]; /* samples each way, at least 1; at least 2 in x and y */
  size_t row, layer; /* strides: rows and columns are continued by one before and two after */
  float *samples;    /* sample (x, y, z) is at zs_raster_sample */
  float *heights;    /* of the layers, ascending */
  bool linear;       /* straight from layer to layer instead */
  double overshoot;  /* how far cubics across layers may leave the range of four, by its size */
  unsigned level_count;
  zs_raster_level levels[ZS_RASTER_LEVELS];
} zs_raster;

/* A raster of count[0] x count[1] x count[2] samples yet to be written; NULL when memory is
 * out.  `heights` are copied; single precision must tell them apart. */
zs_raster *zs_raster_new(const uint32_t count[3], const float *heights);
void zs_raster_free(void *raster);

static inline float *zs_raster_sample(const zs_raster *raster, size_t x, size_t y, size_t z)
{
  return raster->samples + z * raster->layer + (y + 1) * raster->row + x + 1;
}

/* To be called when all samples are written; false when memory is out. */
bool zs_raster_finish(zs_raster *raster);

/* f, and unless `slope` is NULL its derivatives by x, y and z. */
double zs_raster_value(const zs_raster *raster, const double point[3], double slope[3]);

/* What four samples in a row count for, in f and in its derivative. */
typedef struct zs_raster_weights {
  double value[4], slope[4];
} zs_raster_weights;

/* The first of the four layers that count at z, which may be one before the first, and what
 * they count for: layers with zeros may be none. */
int zs_raster_layers(const zs_raster *raster, double z, zs_raster_weights *weights);

/* Inputs x, y and z; data: a zs_raster that lives as long as the field. */
extern const zs_operation zs_raster_operation;

/* ---- For the kernels ------------------------------------------------------ */

/* An enclosure of f over a box of finite numbers. */
void zs_raster_bounds(const zs_raster *raster, const double lo[3], const double hi[3],
                      float result[2]);

/* What the slope at a layer is, times the size of the gap at hand on one side of it: by the
 * difference across that gap, and by the one across the gap beyond the layer. */
static inline void zs_raster_slope(double gap, double beyond, double *by_gap, double *by_beyond)
{
  const double shorter = gap < beyond ? gap : beyond, longer = gap < beyond ? beyond : gap;
  const double parabola = longer / (gap + beyond), most = ZS_RASTER_STEEPEST * shorter / longer;
  const double part = parabola < most ? parabola : most; /* of the shorter one's secant */
  *by_gap = gap < beyond ? part : 1 - part;
  *by_beyond = (gap < beyond ? 1 - part : part) * gap / beyond;
}

ZS_DECLARE_KERNELS(zs_raster_kernels)

#endif
