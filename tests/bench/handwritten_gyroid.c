#include "handwritten.h"

#include <math.h>

void handwritten_gyroid(size_t n, const float *restrict x, const float *restrict y,
                        const float *restrict z, float *restrict f)
{
  const float k = 20;
#pragma omp simd
  for (size_t i = 0; i < n; i++) {
    const float sx = sinf(k * x[i]), cx = cosf(k * x[i]);
    const float sy = sinf(k * y[i]), cy = cosf(k * y[i]);
    const float sz = sinf(k * z[i]), cz = cosf(k * z[i]);
    const float sheet = 0.02f - fabsf(sx * cy + sy * cz + sz * cx) * (1 / 35.0f);
    const float ball = 1 - sqrtf(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    f[i] = ball < sheet ? ball : sheet;
  }
}
