/* Fields of numbers on pixels, for the files of motion.h. */
#ifndef ZS_STACK_MOTION_FIELDS_H
#define ZS_STACK_MOTION_FIELDS_H

#include "stack/motion.h"

/* To the nearest of 0 .. count - 1. */
static inline size_t zs_field_clamped(ptrdiff_t i, size_t count)
{
  return i < 0 ? 0 : i >= (ptrdiff_t)count ? count - 1 : (size_t)i;
}

/* The pixels beside one; itself where there is none. */
typedef struct zs_field_neighbours {
  size_t left, right, up, down;
} zs_field_neighbours;

static inline zs_field_neighbours zs_field_around(size_t width, size_t height, size_t x, size_t y)
{
  const size_t i = y * width + x;
  return (zs_field_neighbours){x > 0 ? i - 1 : i, x + 1 < width ? i + 1 : i,
                               y > 0 ? i - width : i, y + 1 < height ? i + width : i};
}

/* A Gaussian along rows and columns, in place; `work` is as large. */
void zs_field_blur(float *field, float *work, size_t width, size_t height, double sigma);

/* The greatest of (2 reach + 1)^2 neighbours, in place. */
void zs_field_spread(float *field, float *work, size_t width, size_t height, int reach);

/* Smooth what a motion has beside its growth where that changes too fast to be undone
 * (motion_gate.c). */
void zs_motion_limit(zs_motion *motion, float *const work[4]);

/* Find where it takes the motion (motion_gate.c). */
void zs_motion_find_gate(zs_motion *motion, const float *from, const float *to,
                         float *const work[4]);

#endif
