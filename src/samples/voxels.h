/* Samples on a grid, interpolated, as an operation on grid coordinates: sample
 * (i, j, k) is the value at (i, j, k), and beyond the outermost samples the value is
 * that of the nearest point among them.
 *
 * Linear interpolation is continuous; cubic interpolation, by B-splines through the
 * samples (Unser, Aldroubi and Eden, "B-spline signal processing", 1993), has
 * continuous second derivatives.  A point costs the same in any box, which is why
 * there is no regional form; bounds look up the least and greatest of the samples, or
 * of the splines' coefficients, in a pyramid of bricks. */
#ifndef ZS_VOXELS_H
#define ZS_VOXELS_H

#include "field/operation.h"

enum { ZS_VOXELS_LEVELS = 32 };

/* Least and greatest of a brick. */
typedef struct zs_voxels_range {
  float lo, hi;
} zs_voxels_range;

/* Immutable. */
typedef struct zs_voxels {
  bool cubic;
  uint32_t taps;     /* numbers along each axis that a value depends on: 2 or 4 */
  uint32_t size[3];  /* numbers along each axis, x fastest: at least `taps` */
  float top[3];      /* greatest coordinates that are not beyond all samples */
  float *numbers;    /* samples; or coefficients, with one more at either side */
  unsigned level_count;
  uint32_t level_size[ZS_VOXELS_LEVELS][3]; /* bricks; their sides are 4, 8, 16 ... numbers */
  zs_voxels_range *levels[ZS_VOXELS_LEVELS];
} zs_voxels;

/* How many numbers are kept of so many samples along an axis. */
uint32_t zs_voxels_room(uint32_t samples, bool cubic);

/* A grid without numbers: zs_voxels_sample says where they go, and zs_voxels_finish
 * completes it.  The product of zs_voxels_room must fit into 31 bits.  NULL when memory
 * is out; `zs_voxels_free` takes NULL too. */
zs_voxels *zs_voxels_new(const uint32_t samples[3], bool cubic);
void zs_voxels_free(void *voxels);

/* Where a row of samples along x goes. */
float *zs_voxels_row(zs_voxels *voxels, uint32_t j, uint32_t k);

/* All samples are there and finite. */
bool zs_voxels_finish(zs_voxels *voxels, unsigned threads);

/* The value at a point. */
double zs_voxels_value(const zs_voxels *voxels, const double at[3]);

/* The least and greatest value in a box; for the kernels. */
void zs_voxels_bounds(const zs_voxels *voxels, const float lo[3], const float hi[3], float f[2]);

/* Inputs: grid coordinates; data: a zs_voxels that lives as long as the field. */
extern const zs_operation zs_voxels_operation;

ZS_DECLARE_KERNELS(zs_voxels_kernels)

#endif
