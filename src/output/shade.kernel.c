/* Compiled once per instruction set. */
#include "output/shade.h"

#include <math.h>

extern const zs_sky_kernel ZS_KERNELS(zs_sky_kernel);

enum { DIRECTIONS = 12, RINGS = 4 };

static const float circle[DIRECTIONS][2] = {
  {1, 0},      {0.866f, 0.5f},   {0.5f, 0.866f},   {0, 1},  {-0.5f, 0.866f}, {-0.866f, 0.5f},
  {-1, 0},     {-0.866f, -0.5f}, {-0.5f, -0.866f}, {0, -1}, {0.5f, -0.866f}, {0.866f, -0.5f}};

/* Surfaces this little above the horizon (as a sine) do not darken. */
static const float HORIZON = 0.08f;

/* How much they darken. */
static const float STRENGTH = 1.9f;

/* To the nearest whole number, for what is far smaller than 2^22. */
static inline float rounded(float x)
{
  const float large = 12582912;
  return (x + large) - large;
}

static inline float larger(float a, float b)
{
  return a > b ? a : b;
}

/* Add what the pixels `far` radii away in one direction take of the sky. */
static void add_shadows(const zs_sky *sky, float far, const float direction[2],
                        float *restrict taken)
{
  const float *restrict depth = sky->depth, *restrict radius = sky->radius, *restrict u = sky->u;
  const float *restrict at_x = sky->at[0], *restrict at_y = sky->at[1], *restrict at_z = sky->at[2];
  const float *restrict normal_x = sky->normal[0], *restrict normal_y = sky->normal[1],
              *restrict normal_z = sky->normal[2];
  const int width = (int)sky->width, height = (int)sky->height, x = (int)sky->x, y = (int)sky->y;
  const float pixel = sky->pixel, reach = sky->reach, v = sky->v;
  const float widening = sky->perspective ? 1 : 0;
  const float far_x = far * direction[0], far_y = far * direction[1];
#pragma omp simd
  for (int i = 0; i < ZS_BLOCK; i++) {
    const float right = rounded(radius[i] * far_x), up = rounded(radius[i] * far_y);
    const int column = x + i + (int)right, row = y - (int)up;
    const int shown = (column >= 0) & (column < width) & (row >= 0) & (row < height);
    const float d = depth[(row * width + column) & -shown];
    const float scale = 1 - widening + d * widening;
    const float to_x = (u[i] + right * pixel) * scale - at_x[i];
    const float to_y = (v + up * pixel) * scale - at_y[i];
    const float to_z = d - at_z[i];
    const float distance = sqrtf(to_x * to_x + to_y * to_y + to_z * to_z);
    const float near = 1 - distance / reach;
    const float above = to_x * normal_x[i] + to_y * normal_y[i] + to_z * normal_z[i];
    const float shadow = larger(above / distance - HORIZON, 0) * near * (2 - near);
    taken[i] += shown & (distance > 0) & (near > 0) ? shadow : 0;
  }
}

static void find_openness(zs_sky *sky)
{
  float taken[ZS_BLOCK] = {0};
  for (int d = 0; d < DIRECTIONS; d++)
    for (int ring = 0; ring < RINGS; ring++) {
      /* Rings are closer together near the middle. */
      const float part = ((float)ring + 0.5f + (float)(d % 3) / 3 - 0.33f) / RINGS;
      add_shadows(sky, part * part, circle[d], taken);
    }
  for (int i = 0; i < ZS_BLOCK; i++)
    sky->open[i] = larger(1 - STRENGTH * taken[i] / (DIRECTIONS * RINGS), 0);
}

const zs_sky_kernel ZS_KERNELS(zs_sky_kernel) = {find_openness};
