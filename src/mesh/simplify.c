#include "mesh/openmesh.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Move the kept vertices (ascending) to the front of the arrays and give the
 * triangles their new numbers. */
static bool compact(zs_mesh *mesh, const uint32_t *kept, size_t kept_count, uint32_t *triangles,
                    size_t triangle_count, zs_diag *diag)
{
  uint32_t *renamed = malloc((mesh->vertex_count + 1) * sizeof *renamed);
  if (!renamed)
    return zs_fail_memory(diag);
  for (size_t v = 0; v < kept_count; v++) {
    renamed[kept[v]] = (uint32_t)v;
    memmove(mesh->positions + 3 * v, mesh->positions + 3 * (size_t)kept[v],
            3 * sizeof *mesh->positions);
    if (mesh->normals)
      memmove(mesh->normals + 3 * v, mesh->normals + 3 * (size_t)kept[v],
              3 * sizeof *mesh->normals);
  }
  for (size_t i = 0; i < 3 * triangle_count; i++)
    mesh->triangles[i] = renamed[triangles[i]];
  free(renamed);
  mesh->vertex_count = kept_count;
  mesh->triangle_count = triangle_count;
  return true;
}

bool zs_mesh_simplify(zs_mesh *mesh, double error, const zs_control *control, zs_diag *diag)
{
  if (!(error >= 0 && isfinite(error)))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "the error of the simplification is %g; expected a length >= 0", error);
  if (!zs_mesh_require_manifold(mesh, "simplify it", diag))
    return false;
  uint32_t *kept, *triangles;
  size_t kept_count, triangle_count;
  if (!zs_openmesh_simplify(mesh, error, control, &kept, &kept_count, &triangles,
                            &triangle_count, diag))
    return false;
  bool done = compact(mesh, kept, kept_count, triangles, triangle_count, diag);
  free(kept);
  free(triangles);
  return done;
}
