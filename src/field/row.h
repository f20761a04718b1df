/* Rows of affine maps in the coordinates of a frame, for the kernels. */
#ifndef ZS_ROW_H
#define ZS_ROW_H

#include "field/lanes.h"

/* A row as a polynomial of a frame's coordinates:
 *   constant + u k[0] + v k[1] + w k[2]            or, in perspective,
 *   constant + w (k[2] + u k[0] + v k[1]). */
typedef struct zs_row {
  float constant, k[3];
} zs_row;

/* Combined in double, so that nothing is lost far from the scene's origin. */
static inline zs_row zs_row_in_frame(const double row[4], const zs_frame *frame)
{
  double constant = row[3];
  for (int j = 0; j < 3; j++)
    constant += row[j] * frame->origin[j];
  zs_row out = {.constant = (float)constant};
  for (int j = 0; j < 3; j++) {
    const double *axis = frame->axes[j];
    out.k[j] =
      (float)(frame->parallel ? row[j] : row[0] * axis[0] + row[1] * axis[1] + row[2] * axis[2]);
  }
  return out;
}

/* A row applied to registers. */
static inline zs_row zs_row_of_registers(const double row[4])
{
  return (zs_row){(float)row[3], {(float)row[0], (float)row[1], (float)row[2]}};
}

/* Bounds of a row over boxes of its inputs: each input appears once, so the
 * range is exact but for rounding, whose size is that of the largest terms. */
static inline zs_intervals zs_row_bounds(zs_row row, const zs_bounds *const in[3],
                                         unsigned part)
{
  const zs_lanes slack = zs_lanes_all(4 * 1.2e-7f);
  zs_intervals sum = {zs_lanes_all(row.constant), zs_lanes_all(row.constant)};
  zs_lanes size = zs_lanes_absolute(sum.lo);
  for (int j = 0; j < 3; j++) {
    if (row.k[j] == 0) /* the input may be infinite */
      continue;
    const zs_intervals a = zs_intervals_load(in[j], part);
    const zs_lanes k = zs_lanes_all(row.k[j]), p = k * a.lo, q = k * a.hi;
    sum.lo += row.k[j] > 0 ? p : q;
    sum.hi += row.k[j] > 0 ? q : p;
    size += zs_lanes_larger(zs_lanes_absolute(p), zs_lanes_absolute(q));
  }
  return zs_intervals_checked(sum.lo - slack * size, sum.hi + slack * size, sum.lo <= sum.hi);
}

/* The same in perspective. */
static inline zs_intervals zs_row_perspective_bounds(zs_row row, const zs_bounds *const in[3],
                                                     unsigned part)
{
  const zs_lanes constant = zs_lanes_all(row.constant), slack = zs_lanes_all(2.4e-7f);
  const zs_intervals direction =
    zs_row_bounds((zs_row){row.k[2], {row.k[0], row.k[1], 0}}, in, part);
  const zs_intervals along = zs_intervals_multiply(direction, zs_intervals_load(in[2], part));
  const zs_lanes size =
    zs_lanes_absolute(constant) +
    zs_lanes_larger(zs_lanes_absolute(along.lo), zs_lanes_absolute(along.hi));
  return zs_intervals_checked(constant + along.lo - slack * size,
                              constant + along.hi + slack * size, zs_intervals_known(along));
}

#endif
