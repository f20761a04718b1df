#include "stack/motion_fields.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

float zs_motion_sample(const float *field, size_t width, size_t height, float x, float y)
{
  const float right = (float)(width - 1), bottom = (float)(height - 1);
  x = x > 0 ? x < right ? x : right : 0;
  y = y > 0 ? y < bottom ? y : bottom : 0;
  const size_t i = (size_t)x + 1 < width ? (size_t)x : width - 2;
  const size_t j = (size_t)y + 1 < height ? (size_t)y : height - 2;
  const float s = x - (float)i, t = y - (float)j, *p = field + j * width + i;
  return (1 - t) * ((1 - s) * p[0] + s * p[1]) + t * ((1 - s) * p[width] + s * p[width + 1]);
}

void zs_field_blur(float *field, float *work, size_t width, size_t height, double sigma)
{
  enum { MOST = 16 };
  float kernel[MOST + 1], sum = 0;
  const int reach = (int)ceil(3 * sigma) < MOST ? (int)ceil(3 * sigma) : MOST;
  for (int k = 0; k <= reach; k++) {
    kernel[k] = (float)exp(-k * k / (2 * sigma * sigma));
    sum += k ? 2 * kernel[k] : kernel[k];
  }
  for (size_t y = 0; y < height; y++)
    for (size_t x = 0; x < width; x++) {
      float f = 0;
      for (int k = -reach; k <= reach; k++)
        f += kernel[abs(k)] * field[y * width + zs_field_clamped((ptrdiff_t)x + k, width)];
      work[y * width + x] = f / sum;
    }
  for (size_t y = 0; y < height; y++) {
    float *out = field + y * width;
    memset(out, 0, width * sizeof *out);
    for (int k = -reach; k <= reach; k++) {
      const float *row = work + zs_field_clamped((ptrdiff_t)y + k, height) * width;
      const float w = kernel[abs(k)] / sum;
      for (size_t x = 0; x < width; x++)
        out[x] += w * row[x];
    }
  }
}

void zs_field_spread(float *field, float *work, size_t width, size_t height, int reach)
{
  for (size_t y = 0; y < height; y++)
    for (size_t x = 0; x < width; x++) {
      float f = -INFINITY;
      for (int k = -reach; k <= reach; k++)
        f = fmaxf(f, field[y * width + zs_field_clamped((ptrdiff_t)x + k, width)]);
      work[y * width + x] = f;
    }
  for (size_t y = 0; y < height; y++)
    for (size_t x = 0; x < width; x++) {
      float f = -INFINITY;
      for (int k = -reach; k <= reach; k++)
        f = fmaxf(f, work[zs_field_clamped((ptrdiff_t)y + k, height) * width + x]);
      field[y * width + x] = f;
    }
}
