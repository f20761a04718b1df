/* The signed distance to the surface of a mesh file. */
#include "nodes/common.h"

#include "base/key.h"
#include "mesh/mesh.h"
#include "samples/triangles.h"
#include "scene/tree.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

struct distance {
  const char *src;
};

static const zs_attribute attributes[] = {
  {.name = "src", .type = ZS_FILE, .offset = offsetof(struct distance, src), .unit = "",
   .doc = "an STL, PLY, OBJ, OFF or OM file"},
};

/* A surface about its middle, shared by fields and the scene's cache. */
typedef struct surface {
  atomic_uint references;
  double centre[3];
  zs_triangles *triangles;
} surface;

static void *surface_ref(void *data)
{
  surface *s = data;
  atomic_fetch_add_explicit(&s->references, 1, memory_order_relaxed);
  return s;
}

static void surface_unref(void *data)
{
  surface *s = data;
  if (atomic_fetch_sub_explicit(&s->references, 1, memory_order_acq_rel) > 1)
    return;
  zs_triangles_free(s->triangles);
  free(s);
}

static const zs_cache_type surface_type = {surface_ref, surface_unref};

/* The middle of the box around a mesh: single precision is best spent there. */
static void find_centre(const zs_mesh *mesh, double centre[3])
{
  for (size_t k = 0; k < 3; k++) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      lo = fmin(lo, (double)mesh->positions[3 * v + k]);
      hi = fmax(hi, (double)mesh->positions[3 * v + k]);
    }
    centre[k] = lo + (hi - lo) / 2;
  }
}

static surface *surface_of(const zs_mesh *mesh, zs_diag *diag)
{
  surface *s = calloc(1, sizeof *s);
  double *positions = malloc(3 * mesh->vertex_count * sizeof *positions);
  if (s && positions) {
    find_centre(mesh, s->centre);
    for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
      positions[i] = (double)mesh->positions[i] - s->centre[i % 3];
    s->triangles = zs_triangles_new(positions, mesh->triangles, mesh->triangle_count);
  }
  if (!s)
    free(positions);
  if (s && s->triangles) {
    atomic_init(&s->references, 1);
    return s;
  }
  free(s);
  zs_fail_memory(diag);
  return NULL;
}

/* Say what has been mended. */
static void warn(const zs_node *node, const zs_mesh_holes *holes, zs_diag *diag)
{
  const zs_place place = zs_node_place(node, "src");
  if (holes->count)
    zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
              "the mesh is not closed: %zu hole%s, %zu sides of triangles around %s, %s filled",
              holes->count, holes->count == 1 ? "" : "s", holes->sides,
              holes->count == 1 ? "it" : "them", holes->count == 1 ? "is" : "are");
  if (holes->inside_out)
    zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
              "the mesh is inside out: its triangles are clockwise seen from outside; it is "
              "turned");
}

static surface *read_surface(const zs_node *node, zs_diag *diag)
{
  const struct distance *p = node->parameters;
  zs_mesh *mesh = zs_mesh_read(p->src, diag), *closed = NULL;
  zs_mesh_holes holes;
  surface *s = NULL;
  if (mesh)
    closed = zs_mesh_close(mesh, &holes, diag);
  if (closed && closed->triangle_count == 0) {
    zs_fail(diag, ZS_ERROR_GEOMETRY, p->src, "the mesh has no triangles");
  } else if (closed) {
    warn(node, &holes, diag);
    s = surface_of(closed, diag);
  }
  zs_mesh_free(mesh);
  zs_mesh_free(closed);
  return s;
}

static surface *find(zs_compiler *compiler, const zs_node *node)
{
  struct zs_cache *cache = zs_compiler_cache(compiler);
  zs_diag *diag = zs_compiler_diag(compiler);
  uint64_t key[2];
  zs_key_begin(key, "distance");
  const bool has_key = zs_key_add_file(key, ((const struct distance *)node->parameters)->src);
  surface *s = has_key ? zs_cache_find(cache, key, &surface_type) : NULL;
  if (s)
    return s;
  s = read_surface(node, diag);
  if (s && has_key && !zs_cache_add(cache, key, &surface_type, s))
    zs_fail_memory(diag);
  return s;
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  surface *s = find(compiler, node);
  if (!s)
    return zs_emit_constant(compiler, 0);
  if (!zs_compiler_keep(compiler, s, surface_unref))
    return zs_emit_constant(compiler, 0);
  const zs_coordinates about = zs_coordinates_moved(at, s->centre);
  zs_value u[3];
  for (int k = 0; k < 3; k++)
    u[k] = zs_emit_coordinate(compiler, &about, k);
  return zs_emit_operation(compiler, &zs_triangles_operation, s->triangles, u[0], u[1], u[2]);
}

const zs_kind zs_kind_distance = {
  .name = "distance",
  .family = ZS_FAMILY_DATA,
  .summary = "the solid that a mesh encloses, from a file",
  .doc = "f is the distance to the nearest triangle, positive inside. Triangles are "
         "counter-clockwise seen from outside; a mesh that is inside out is turned, with a "
         "warning. Vertices at the same place are one. Holes are filled with triangles about the middle of "
         "their rim, with a warning. Inside is where the surface winds around a point at least "
         "once: parts that overlap are joined, and a part inside another that is turned inwards is a "
         "cavity.",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct distance),
  .children = ZS_CHILDREN_NONE,
  .emit = emit,
};
