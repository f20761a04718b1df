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

typedef struct zs_motion {
  size_t width, height;
  float *u[2]; /* width x height numbers each, in pixels */
  /* Where it takes the motion (0 .. 1): there what is solid or open half-way would thin out
   * without it. */
  float *gate;
  bool apart; /* the slices have no pixel in common */
} zs_motion;

/* The motion from one field of distances to another, `smoothness` (30 .. 100) being how stiff
 * it is; `align` begins with the motion of their centres and extents, as is done in any case
 * when the shapes have no pixel in common.  Both have something inside.  False when memory is
 * out; zs_motion_clear in any case. */
bool zs_motion_find(zs_motion *motion, const float *from, const float *to, size_t width,
                    size_t height, float smoothness, bool align);
void zs_motion_clear(zs_motion *motion);

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
