#include "mesh/mesh.h"

#include "base/diagnostic.h"
#include "base/memory.h"

#include <stdlib.h>

/* An array (NULL: a new one) with another number of elements, or NULL when memory
 * is out.  Arrays of no elements are allocated too, so that NULL means what it
 * says. */
static void *resized(void *array, size_t count, size_t size)
{
  if (!array)
    return zs_memory_new(count, size);
  if (count > SIZE_MAX / 2 / size)
    return NULL;
  void *new = realloc(array, count ? count * size : 1);
  zs_memory_is_large(new, count * size);
  return new;
}

static bool check_vertex_count(size_t vertex_count, zs_diag *diag)
{
  return vertex_count < UINT32_MAX ||
         zs_fail(diag, ZS_ERROR_UNABLE, NULL,
                 "the mesh has %zu vertices; expected less than 2^32 - 1", vertex_count);
}

zs_mesh *zs_mesh_new(size_t vertex_count, size_t triangle_count, bool normals, zs_diag *diag)
{
  if (!check_vertex_count(vertex_count, diag))
    return NULL;
  zs_mesh *mesh = calloc(1, sizeof *mesh);
  if (mesh) {
    mesh->vertex_count = vertex_count;
    mesh->triangle_count = triangle_count;
    mesh->positions = resized(NULL, vertex_count, 3 * sizeof *mesh->positions);
    mesh->normals = normals ? resized(NULL, vertex_count, 3 * sizeof *mesh->normals) : NULL;
    mesh->triangles = resized(NULL, triangle_count, 3 * sizeof *mesh->triangles);
  }
  if (!mesh || !mesh->positions || (normals && !mesh->normals) || !mesh->triangles) {
    zs_mesh_free(mesh);
    zs_fail_memory(diag);
    return NULL;
  }
  return mesh;
}

bool zs_mesh_resize(zs_mesh *mesh, size_t vertex_count, size_t triangle_count, zs_diag *diag)
{
  if (!check_vertex_count(vertex_count, diag))
    return false;
  float *positions = resized(mesh->positions, vertex_count, 3 * sizeof *positions);
  if (positions)
    mesh->positions = positions;
  float *normals =
    mesh->normals ? resized(mesh->normals, vertex_count, 3 * sizeof *normals) : NULL;
  if (normals)
    mesh->normals = normals;
  uint32_t *triangles = resized(mesh->triangles, triangle_count, 3 * sizeof *triangles);
  if (triangles)
    mesh->triangles = triangles;
  if (!positions || !triangles || (mesh->normals && !normals))
    return zs_fail_memory(diag);
  mesh->vertex_count = vertex_count;
  mesh->triangle_count = triangle_count;
  return true;
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
