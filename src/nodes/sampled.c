#include "nodes/sampled.h"

#include "scene/tree.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

const char *const zs_sampled_interpolations[] = {"linear", "cubic", NULL};
const char *const zs_sampled_outsides[] = {"empty", "extend", NULL};

struct zs_sampled {
  atomic_uint references;
  zs_voxels *voxels;
  uint32_t samples[3];
  double matrix[12], inverse[12];
};

static void *ref(void *data)
{
  zs_sampled *sampled = data;
  atomic_fetch_add_explicit(&sampled->references, 1, memory_order_relaxed);
  return sampled;
}

void zs_sampled_unref(void *data)
{
  zs_sampled *sampled = data;
  if (atomic_fetch_sub_explicit(&sampled->references, 1, memory_order_acq_rel) > 1)
    return;
  zs_voxels_free(sampled->voxels);
  free(sampled);
}

const zs_cache_type zs_sampled_type = {ref, zs_sampled_unref};

zs_sampled *zs_sampled_new(zs_voxels *voxels, const uint32_t samples[3], const double matrix[12])
{
  zs_sampled *sampled = calloc(1, sizeof *sampled);
  if (!sampled || !zs_affine_invert(matrix, sampled->inverse)) {
    zs_voxels_free(voxels);
    free(sampled);
    return NULL;
  }
  atomic_init(&sampled->references, 1);
  sampled->voxels = voxels;
  memcpy(sampled->samples, samples, sizeof sampled->samples);
  memcpy(sampled->matrix, matrix, sizeof sampled->matrix);
  return sampled;
}

/* The length of column k of the matrix, the side of a voxel along axis k. */
static double side_of(const zs_sampled *s, int k)
{
  return hypot(hypot(s->matrix[k], s->matrix[4 + k]), s->matrix[8 + k]);
}

/* Whether the axes are at right angles. */
static bool is_right(const zs_sampled *s)
{
  for (int k = 0; k < 3; k++) {
    const int j = (k + 1) % 3;
    double product = 0;
    for (int i = 0; i < 3; i++)
      product += s->matrix[4 * i + k] * s->matrix[4 * i + j];
    if (fabs(product) > 1e-6 * side_of(s, k) * side_of(s, j))
      return false;
  }
  return true;
}

/* The distance from the outer faces of the voxels, positive inside; where the axes
 * lean, a lower bound of it. */
static zs_value emit_faces(zs_compiler *compiler, const zs_sampled *s, const zs_coordinates *at)
{
  const bool right = is_right(s);
  double rows[12], parameter[4] = {0}, norm = 0;
  memcpy(rows, s->inverse, sizeof rows);
  for (int k = 0; k < 3; k++) {
    const double side = right ? side_of(s, k) : 1;
    rows[4 * k + 3] -= ((double)s->samples[k] - 1) / 2;
    for (int i = 0; i < 4; i++) {
      norm += i < 3 ? rows[4 * k + i] * rows[4 * k + i] : 0;
      rows[4 * k + i] *= side;
    }
    parameter[k] = side * s->samples[k] / 2;
  }
  const zs_coordinates box = zs_coordinates_affine(at, rows);
  const zs_value f = zs_emit_primitive(compiler, ZS_PRIMITIVE_CUBOID, parameter, &box);
  return zs_emit_scaled(compiler, f, right ? 1 : 1 / sqrt(norm));
}

zs_value zs_sampled_emit(zs_compiler *compiler, zs_sampled *sampled, int outside,
                         const zs_coordinates *at)
{
  if (!zs_compiler_keep(compiler, sampled, zs_sampled_unref))
    return zs_emit_constant(compiler, 0);
  const zs_coordinates grid = zs_coordinates_affine(at, sampled->inverse);
  zs_value u[3];
  for (int k = 0; k < 3; k++)
    u[k] = zs_emit_coordinate(compiler, &grid, k);
  const zs_value f =
    zs_emit_operation(compiler, &zs_voxels_operation, sampled->voxels, u[0], u[1], u[2]);
  if (outside == ZS_SAMPLED_EXTEND)
    return f;
  return zs_emit(compiler, ZS_FUNCTION_MINIMUM, f, emit_faces(compiler, sampled, at), 0);
}
