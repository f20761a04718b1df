/* How the shapes of neighbouring slices move into each other: dense registration of their
 * distances (Horn and Schunck, "Determining optical flow", 1981, by warping, coarse to fine).
 *
 * The unknown is a displacement u on the frame half-way: what is at y - u/2 in the lower
 * slice is at y + u/2 in the upper one.  It is made as smooth as keeps tips of the solid,
 * which have no counterpart, from being drawn along the surface, and limited so that it can
 * be inverted at every height between. */
#ifndef ZS_STACK_MOTION_H
#define ZS_STACK_MOTION_H

#include <stdbool.h>
#include <stddef.h>

/* A symmetric matrix. */
typedef struct zs_motion_matrix {
  double xx, xy, yy;
} zs_motion_matrix;

typedef struct zs_motion {
  size_t width, height;
  float *u[2]; /* width x height numbers each, in pixels */
  /* By how much u changes with the place since one shape is larger than the other all in all, or
   * shorter and wider; 0 where they were not aligned. */
  zs_motion_matrix growth;
  /* Where it takes the motion (0 .. 1): there what is solid or open half-way would thin out
   * without it. */
  float *gate;
  bool apart; /* the slices have no pixel in common */
} zs_motion;

/* The motion from one field of distances to another, `smoothness` (30 .. 100) being how stiff
 * it is; `aligned` begins with the motion of their centres and spreads, as is done in any case
 * when the shapes have no pixel in common: however they lie and however large they are, they are
 * stretched onto each other, but neither turned nor reflected.  Both have something inside.  False
 * when memory is out; zs_motion_clear in any case. */
bool zs_motion_find(zs_motion *motion, const float *from, const float *to, size_t width,
                    size_t height, float smoothness, bool aligned);
void zs_motion_clear(zs_motion *motion);

/* Take `part` of the growth out of a vector: what (1 + part growth) makes of the result is v. */
static inline void zs_motion_shrink(const zs_motion_matrix *growth, float part, float v[2])
{
  const float xx = 1 + part * (float)growth->xx, xy = part * (float)growth->xy;
  const float yy = 1 + part * (float)growth->yy;
  const float scale = 1 / (xx * yy - xy * xy), x = v[0];
  v[0] = scale * (yy * x - xy * v[1]);
  v[1] = scale * (xx * v[1] - xy * x);
}

/* A field of width x height numbers between its samples, linearly; at the edges as there. */
static inline float zs_motion_sample(const float *field, size_t width, size_t height, float x,
                                     float y)
{
  const float right = (float)(width - 1), bottom = (float)(height - 1);
  x = x > 0 ? x < right ? x : right : 0;
  y = y > 0 ? y < bottom ? y : bottom : 0;
  const size_t i = (size_t)x + 1 < width ? (size_t)x : width - 2;
  const size_t j = (size_t)y + 1 < height ? (size_t)y : height - 2;
  const float s = x - (float)i, t = y - (float)j, *p = field + j * width + i;
  return (1 - t) * ((1 - s) * p[0] + s * p[1]) + t * ((1 - s) * p[width] + s * p[width + 1]);
}

#endif
