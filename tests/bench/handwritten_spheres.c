#include "handwritten.h"

#include <math.h>

void handwritten_spheres(const spheres *scene, size_t n, const float *restrict x,
                         const float *restrict y, const float *restrict z, float *restrict f)
{
  const float k = (float)scene->blend, factor = 0.25f / k;
  for (size_t first = 0; first < n; first += HANDWRITTEN_POINTS) {
    const float *px = x + first, *py = y + first, *pz = z + first;
    float joined[HANDWRITTEN_POINTS];
    for (size_t i = 0; i < HANDWRITTEN_POINTS; i++)
      joined[i] = -INFINITY;
    for (unsigned s = 0; s < scene->count; s++) {
      const sphere item = scene->items[s];
#pragma omp simd
      for (size_t i = 0; i < HANDWRITTEN_POINTS; i++) {
        const float dx = px[i] - item.x, dy = py[i] - item.y, dz = pz[i] - item.z;
        const float value = item.radius - sqrtf(dx * dx + dy * dy + dz * dz);
        const float left = k - fabsf(joined[i] - value), h = left > 0 ? left : 0;
        joined[i] = (joined[i] > value ? joined[i] : value) + h * h * factor;
      }
    }
    for (size_t i = 0; i < HANDWRITTEN_POINTS; i++)
      f[first + i] = joined[i];
  }
}
