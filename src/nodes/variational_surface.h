/* Triangles between samples of <variational>. */
#ifndef ZS_NODES_VARIATIONAL_SURFACE_H
#define ZS_NODES_VARIATIONAL_SURFACE_H

#include "base/vector3.h"
#include "rbf/constraints.h"

/* A mesh whose vertices are the samples from `first` on. */
typedef struct zs_surface {
  zs_rbf_samples *list;
  size_t first, triangle_count;
  uint32_t *triangles; /* owned; 3 indices each, from 0 for the first sample of the mesh */
} zs_surface;

static inline zs_rbf_sample *zs_surface_vertex(const zs_surface *s, size_t index)
{
  return &s->list->samples[s->first + index];
}

/* Twice the area vector of a triangle. */
static inline void zs_surface_area_vector(const zs_surface *s, size_t t, double area[3])
{
  const uint32_t *corner = s->triangles + 3 * t;
  const double *a = zs_surface_vertex(s, corner[0])->position;
  double u[3], v[3];
  zs_subtract3(zs_surface_vertex(s, corner[1])->position, a, u);
  zs_subtract3(zs_surface_vertex(s, corner[2])->position, a, v);
  zs_cross3(u, v, area);
}

/* Add samples in the middle of edges until a smooth surface leaves the triangles by no more
 * than `deviation`, about; NaN: automatic.  They lie on the surface, and have normals where
 * nothing nearby has one.  False after reporting that memory is out. */
bool zs_surface_hold_to_faces(zs_surface *s, double deviation, zs_diag *diag);

#endif
