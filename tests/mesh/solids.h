/* Meshes for tests. */
#ifndef ZS_TEST_SOLIDS_H
#define ZS_TEST_SOLIDS_H

#include "mesh/mesh.h"

#include <string.h>

static inline zs_mesh *make_mesh(size_t vertices, const float *positions, size_t triangles,
                                 const uint32_t *corners)
{
  zs_mesh *mesh = zs_mesh_new(vertices, triangles, false, NULL);
  if (!mesh)
    return NULL;
  memcpy(mesh->positions, positions, 3 * vertices * sizeof *positions);
  memcpy(mesh->triangles, corners, 3 * triangles * sizeof *corners);
  return mesh;
}

/* The unit cube, twelve triangles. */
static inline zs_mesh *make_cube(void)
{
  float positions[24];
  static const uint32_t corners[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  for (unsigned v = 0; v < 8; v++)
    for (unsigned k = 0; k < 3; k++)
      positions[3 * v + k] = (float)(v >> k & 1);
  return make_mesh(8, positions, 12, corners);
}

/* A torus around z of m x n quads, each two triangles; normals on request. */
zs_mesh *make_torus(unsigned m, unsigned n, double major, double minor, bool normals);

#endif
