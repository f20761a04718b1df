/* Components of a mesh chosen by points. */
#include "mesh/mesh.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Points by the cells of a lattice as wide as they reach, sorted by cell, so that
 * only those in the 27 cells around a vertex have to be looked at. */
typedef struct seed {
  int64_t cell[3];
  const double *point;
  double square;   /* of the distance to the nearest vertex so far */
  uint32_t vertex; /* that one */
} seed;

typedef struct seeds {
  seed *list;
  size_t count;
  double reach;
} seeds;

static int compare_cells(const int64_t a[3], const int64_t b[3])
{
  for (int k = 0; k < 3; k++)
    if (a[k] != b[k])
      return a[k] < b[k] ? -1 : 1;
  return 0;
}

static int by_cell(const void *a, const void *b)
{
  const seed *p = a, *q = b;
  return compare_cells(p->cell, q->cell);
}

/* Where a coordinate lies on the lattice; far from it, anywhere at its end. */
static int64_t cell_of(double x, double reach)
{
  const double most = 1e15;
  return isinf(reach) ? 0 : (int64_t)floor(fmin(fmax(x / reach, -most), most));
}

static bool make_seeds(seeds *s, const double *points, size_t count, double reach)
{
  *s = (seeds){.list = malloc((count ? count : 1) * sizeof *s->list), .count = count,
               .reach = reach};
  for (size_t i = 0; s->list && i < count; i++) {
    s->list[i] = (seed){.point = points + 3 * i, .square = reach * reach};
    for (int k = 0; k < 3; k++)
      s->list[i].cell[k] = cell_of(points[3 * i + (size_t)k], reach);
  }
  if (s->list)
    qsort(s->list, count, sizeof *s->list, by_cell);
  return s->list != NULL;
}

/* The first seed in a cell or behind it. */
static size_t first_in(const seeds *s, const int64_t cell[3])
{
  size_t lo = 0, hi = s->count;
  while (lo < hi) {
    const size_t middle = lo + (hi - lo) / 2;
    if (compare_cells(s->list[middle].cell, cell) < 0)
      lo = middle + 1;
    else
      hi = middle;
  }
  return lo;
}

/* Hold a vertex against the seeds of one cell. */
static void visit(const seeds *s, const int64_t cell[3], const float *position, uint32_t vertex)
{
  for (size_t i = first_in(s, cell); i < s->count && !compare_cells(s->list[i].cell, cell); i++) {
    seed *one = &s->list[i];
    double square = 0;
    for (int k = 0; k < 3; k++) {
      const double d = (double)position[k] - one->point[k];
      square += d * d;
    }
    if (square < one->square || (square == one->square && vertex < one->vertex)) {
      one->square = square;
      one->vertex = vertex;
    }
  }
}

static void find_nearest(const seeds *s, const zs_mesh *mesh)
{
  const int around = isinf(s->reach) ? 0 : 1;
  for (size_t i = 0; i < s->count; i++)
    s->list[i].vertex = UINT32_MAX;
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const float *p = mesh->positions + 3 * v;
    int64_t cell[3];
    for (int64_t z = -around; z <= around; z++)
      for (int64_t y = -around; y <= around; y++)
        for (int64_t x = -around; x <= around; x++) {
          cell[0] = cell_of((double)p[0], s->reach) + x;
          cell[1] = cell_of((double)p[1], s->reach) + y;
          cell[2] = cell_of((double)p[2], s->reach) + z;
          visit(s, cell, p, (uint32_t)v);
        }
  }
}

static uint32_t root(uint32_t *parent, uint32_t i)
{
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

/* The lowest vertex of the component of every vertex, as a forest for `root`. */
static uint32_t *components(const zs_mesh *mesh)
{
  uint32_t *parent = malloc((mesh->vertex_count + 1) * sizeof *parent);
  for (size_t v = 0; parent && v < mesh->vertex_count; v++)
    parent[v] = (uint32_t)v;
  for (size_t t = 0; parent && t < mesh->triangle_count; t++)
    for (unsigned k = 1; k < 3; k++) {
      const uint32_t a = root(parent, mesh->triangles[3 * t]);
      const uint32_t b = root(parent, mesh->triangles[3 * t + k]);
      parent[a > b ? a : b] = a > b ? b : a;
    }
  return parent;
}

/* Move what is kept to the front; `number` becomes the new number of each vertex. */
static void compact(zs_mesh *mesh, uint32_t *parent, const bool *kept, uint32_t *number,
                    size_t *vertices, size_t *triangles)
{
  *vertices = *triangles = 0;
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    if (!kept[root(parent, (uint32_t)v)])
      continue;
    number[v] = (uint32_t)*vertices;
    memmove(mesh->positions + 3 * *vertices, mesh->positions + 3 * v, 3 * sizeof(float));
    if (mesh->normals)
      memmove(mesh->normals + 3 * *vertices, mesh->normals + 3 * v, 3 * sizeof(float));
    ++*vertices;
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t corner[3] = {mesh->triangles[3 * t], mesh->triangles[3 * t + 1],
                                mesh->triangles[3 * t + 2]};
    if (!kept[root(parent, corner[0])])
      continue;
    for (unsigned k = 0; k < 3; k++)
      mesh->triangles[3 * *triangles + k] = number[corner[k]];
    ++*triangles;
  }
}

bool zs_mesh_keep_components(zs_mesh *mesh, const double *points, size_t count, double reach,
                             zs_diag *diag)
{
  seeds s;
  uint32_t *parent = components(mesh), *number = malloc((mesh->vertex_count + 1) * sizeof *number);
  bool *kept = calloc(mesh->vertex_count + 1, sizeof *kept);
  bool memory = make_seeds(&s, points, count, reach) && parent && number && kept;
  size_t selected = 0, vertices = 0, triangles = 0;
  if (memory) {
    find_nearest(&s, mesh);
    for (size_t i = 0; i < count; i++)
      if (s.list[i].vertex != UINT32_MAX) {
        kept[root(parent, s.list[i].vertex)] = true;
        selected++;
      }
    if (selected)
      compact(mesh, parent, kept, number, &vertices, &triangles);
  }
  free(s.list);
  free(parent);
  free(number);
  free(kept);
  if (!memory)
    return zs_fail_memory(diag);
  if (!selected)
    return zs_fail(diag, ZS_ERROR_UNABLE, NULL, "no part of the surface is near any of the points "
                   "that say which parts to keep");
  return zs_mesh_resize(mesh, vertices, triangles, diag);
}
