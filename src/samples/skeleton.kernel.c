/* Block, gradient and bounds kernels of the fields about skeletons.  Compiled once per
 * instruction set. */
#include "samples/skeleton.h"

#include <math.h>

/* Points farther out than this have no field; their squares must be numbers. */
static const float FAR = 1e17f;

static double clamped(float x)
{
  return x > FAR ? FAR : x < -FAR ? -FAR : x;
}

/* The box around a block's points. */
static void extent(const zs_block_arguments *a, double lo[3], double hi[3])
{
  for (int k = 0; k < 3; k++) {
    float least = FAR, greatest = -FAR;
    for (unsigned i = 0; i < a->n; i++) {
      const float x = a->in[k][i];
      least = x < least ? x : least;
      greatest = x > greatest ? x : greatest;
    }
    lo[k] = clamped(least);
    hi[k] = clamped(greatest);
  }
}

static bool reaches(const zs_skeleton *skeleton, const zs_skeleton_part *part, const double lo[3],
                    const double hi[3])
{
  const double reach = zs_skeleton_reach(skeleton->field, part, 0);
  for (int k = 0; k < 3; k++)
    if (part->lo[k] - hi[k] >= reach || lo[k] - part->hi[k] >= reach)
      return false;
  return true;
}

/* Sum of the parts' fields, and unless `slopes` is NULL of their derivatives. */
static void add_parts(const zs_block_arguments *a, double *sums, double (*slopes)[3])
{
  const zs_skeleton *skeleton = a->data;
  double lo[3], hi[3];
  extent(a, lo, hi);
  for (uint32_t p = 0; p < skeleton->part_count; p++) {
    const zs_skeleton_part *part = &skeleton->parts[p];
    if (!reaches(skeleton, part, lo, hi))
      continue;
    for (unsigned i = 0; i < a->n; i++) {
      const double at[3] = {clamped(a->in[0][i]), clamped(a->in[1][i]), clamped(a->in[2][i])};
      double slope[3];
      sums[i] += zs_skeleton_value(skeleton, part, at, slopes ? slope : NULL);
      for (int k = 0; slopes && k < 3; k++)
        slopes[i][k] += slope[k];
    }
  }
}

static void value(const zs_block_arguments *a)
{
  double sums[ZS_BLOCK] = {0};
  add_parts(a, sums, NULL);
  for (unsigned i = 0; i < a->n; i++)
    a->out[i] = (float)sums[i];
}

static void gradient(const zs_block_arguments *a)
{
  double sums[ZS_BLOCK] = {0}, slopes[ZS_BLOCK][3] = {{0}};
  add_parts(a, sums, slopes);
  for (unsigned i = 0; i < a->n; i++) {
    float g[3];
    for (int k = 0; k < 3; k++) {
      double sum = 0;
      for (int j = 0; j < 3; j++)
        sum += slopes[i][j] * (double)a->in[j][(k + 1) * ZS_BLOCK + (int)i];
      g[k] = (float)sum;
    }
    a->out[i] = (float)sums[i];
    for (int k = 0; k < 3; k++)
      a->out[(k + 1) * ZS_BLOCK + (int)i] = g[k];
  }
}

static void bounds(const zs_bounds_arguments *a)
{
  const zs_skeleton *skeleton = a->data;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    double lo[3], hi[3], least = 0, most = 0, size = 0;
    bool known = true;
    for (int k = 0; k < 3; k++) {
      known = known && a->in[k]->lo[l] <= a->in[k]->hi[l];
      lo[k] = clamped(a->in[k]->lo[l]);
      hi[k] = clamped(a->in[k]->hi[l]);
    }
    for (uint32_t p = 0; known && p < skeleton->part_count; p++) {
      double range[2];
      zs_skeleton_range(skeleton, &skeleton->parts[p], lo, hi, range);
      least += range[0];
      most += range[1];
      size += fabs(range[0]) + fabs(range[1]);
    }
    a->out->lo[l] = known ? (float)(least - 1e-6 * size) : NAN;
    a->out->hi[l] = known ? (float)(most + 1e-6 * size) : NAN;
  }
}

const zs_kernels ZS_KERNELS(zs_skeleton_kernels) = {value, gradient, bounds};
