#include "solids.h"

#include <math.h>

zs_mesh *make_torus(unsigned m, unsigned n, double major, double minor, bool normals)
{
  const double turn = 2 * 3.14159265358979323846;
  zs_mesh *mesh = zs_mesh_new((size_t)m * n, 2 * (size_t)m * n, normals, NULL);
  if (!mesh)
    return NULL;
  for (unsigned i = 0; i < m; i++)
    for (unsigned j = 0; j < n; j++) {
      double u = turn * i / m, v = turn * j / n;
      double out[3] = {cos(v) * cos(u), cos(v) * sin(u), sin(v)};
      size_t at = (size_t)i * n + j;
      uint32_t a = (uint32_t)at, b = (i + 1) % m * n + j, c = i * n + (j + 1) % n,
               d = (i + 1) % m * n + (j + 1) % n;
      const uint32_t corners[6] = {a, b, d, a, d, c};
      for (unsigned k = 0; k < 3; k++) {
        double centre = k == 0 ? major * cos(u) : k == 1 ? major * sin(u) : 0;
        mesh->positions[3 * at + k] = (float)(centre + minor * out[k]);
        if (normals)
          mesh->normals[3 * at + k] = (float)out[k];
      }
      memcpy(mesh->triangles + 6 * at, corners, sizeof corners);
    }
  return mesh;
}
