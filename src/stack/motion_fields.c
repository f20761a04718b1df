#include "stack/motion_fields.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* One row, `kernel` being symmetric and adding up to `sum`. */
static void blur_row(const float *row, float *to, size_t width, const float *kernel, int reach,
                     float sum)
{
  const ptrdiff_t n = (ptrdiff_t)width;
  memset(to, 0, width * sizeof *to);
  for (int k = -reach; k <= reach; k++) {
    const float w = kernel[abs(k)];
    const ptrdiff_t from = k < 0 ? (-k < n ? -k : n) : 0, end = k > 0 ? (n - k > 0 ? n - k : 0) : n;
    for (ptrdiff_t x = 0; x < from; x++)
      to[x] += w * row[0];
    for (ptrdiff_t x = from; x < end; x++)
      to[x] += w * row[x + k];
    for (ptrdiff_t x = end; x < n; x++)
      to[x] += w * row[n - 1];
  }
  for (size_t x = 0; x < width; x++)
    to[x] /= sum;
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
    blur_row(field + y * width, work + y * width, width, kernel, reach, sum);
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

/* The greatest of the numbers and of others beside them. */
static void raise_row(float *restrict to, const float *restrict others, size_t count)
{
  for (size_t i = 0; i < count; i++)
    to[i] = others[i] > to[i] ? others[i] : to[i];
}

void zs_field_spread(float *field, float *work, size_t width, size_t height, int reach)
{
  memcpy(work, field, width * height * sizeof *work);
  for (size_t y = 0; y < height; y++)
    for (size_t k = 1; k <= (size_t)reach && k < width; k++) {
      raise_row(work + y * width, field + y * width + k, width - k);
      raise_row(work + y * width + k, field + y * width, width - k);
    }
  memcpy(field, work, width * height * sizeof *field);
  for (size_t k = 1; k <= (size_t)reach && k < height; k++) {
    raise_row(field, work + k * width, (height - k) * width);
    raise_row(field + k * width, work, (height - k) * width);
  }
}
