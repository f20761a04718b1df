#include "mesh/mesh.h"

#include "base/diagnostic.h"

#include <stdlib.h>

/* Arrays of no elements are allocated too, so that NULL means what it says. */
static void *new_array(size_t count, size_t size)
{
  if (count > SIZE_MAX / 2 / size)
    return NULL;
  return malloc(count ? count * size : 1);
}

zs_mesh *zs_mesh_new(size_t vertex_count, size_t triangle_count, bool normals, zs_diag *diag)
{
  if (vertex_count >= UINT32_MAX) {
    zs_fail(diag, ZS_ERROR_UNABLE, NULL, "the mesh has %zu vertices; expected less than 2^32 - 1",
            vertex_count);
    return NULL;
  }
  zs_mesh *mesh = calloc(1, sizeof *mesh);
  if (mesh) {
    mesh->vertex_count = vertex_count;
    mesh->triangle_count = triangle_count;
    mesh->positions = new_array(vertex_count, 3 * sizeof *mesh->positions);
    mesh->normals = normals ? new_array(vertex_count, 3 * sizeof *mesh->normals) : NULL;
    mesh->triangles = new_array(triangle_count, 3 * sizeof *mesh->triangles);
  }
  if (!mesh || !mesh->positions || (normals && !mesh->normals) || !mesh->triangles) {
    zs_mesh_free(mesh);
    zs_fail_memory(diag);
    return NULL;
  }
  return mesh;
}

void zs_mesh_free(zs_mesh *mesh)
{
  if (!mesh)
    return;
  free(mesh->positions);
  free(mesh->normals);
  free(mesh->triangles);
  free(mesh);
}

size_t zs_mesh_vertex_count(const zs_mesh *mesh)
{
  return mesh->vertex_count;
}

size_t zs_mesh_triangle_count(const zs_mesh *mesh)
{
  return mesh->triangle_count;
}

const float *zs_mesh_positions(const zs_mesh *mesh)
{
  return mesh->positions;
}

const float *zs_mesh_normals(const zs_mesh *mesh)
{
  return mesh->normals;
}

const uint32_t *zs_mesh_triangles(const zs_mesh *mesh)
{
  return mesh->triangles;
}
