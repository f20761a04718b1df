#include "handwritten.h"

#include <math.h>

enum { RIBS = 8 };

static const float rib_x[RIBS] = {0.45f, 0.3182f, 0, -0.3182f, -0.45f, -0.3182f, 0, 0.3182f};
static const float rib_y[RIBS] = {0, 0.3182f, 0.45f, 0.3182f, 0, -0.3182f, -0.45f, -0.3182f};

static inline float least(float a, float b)
{
  return a < b ? a : b;
}

static inline float greatest(float a, float b)
{
  return a > b ? a : b;
}

static inline float smooth_greatest(float a, float b)
{
  const float k = 0.1f, apart = fabsf(a - b), h = greatest(k - apart, 0);
  return greatest(a, b) + h * h * (0.25f / k);
}

static inline float box(float u, float v, float w)
{
  const float a = greatest(u, 0), b = greatest(v, 0), c = greatest(w, 0);
  return -(least(greatest(u, greatest(v, w)), 0) + sqrtf(a * a + b * b + c * c));
}

static inline float rib(float x, float y, float w)
{
  const float r = sqrtf(x * x + y * y) - 0.08f;
  const float a = greatest(r, 0), c = greatest(w, 0);
  return -(least(greatest(r, w), 0) + sqrtf(a * a + c * c));
}

void handwritten_column(size_t n, const float *restrict x, const float *restrict y,
                        const float *restrict z, float *restrict f)
{
  const float turn = 90 * 3.14159265358979f / 180;
  for (size_t first = 0; first < n; first += HANDWRITTEN_POINTS) {
    const float *px = x + first, *py = y + first, *pz = z + first;
    float u[HANDWRITTEN_POINTS], v[HANDWRITTEN_POINTS], w[HANDWRITTEN_POINTS];
    float joined[HANDWRITTEN_POINTS];
#pragma omp simd
    for (size_t i = 0; i < HANDWRITTEN_POINTS; i++) {
      const float s = sinf(turn * pz[i]), c = cosf(turn * pz[i]);
      u[i] = px[i] * c + py[i] * s;
      v[i] = py[i] * c - px[i] * s;
      w[i] = fabsf(pz[i]) - 0.9f;
      joined[i] = box(fabsf(u[i]) - 0.3f, fabsf(v[i]) - 0.3f, w[i]);
    }
    for (int j = 0; j < RIBS; j++) {
#pragma omp simd
      for (size_t i = 0; i < HANDWRITTEN_POINTS; i++)
        joined[i] = smooth_greatest(joined[i], rib(u[i] - rib_x[j], v[i] - rib_y[j], w[i]));
    }
    for (size_t i = 0; i < HANDWRITTEN_POINTS; i++)
      f[first + i] = joined[i];
  }
}
