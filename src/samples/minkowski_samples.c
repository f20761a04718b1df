#include "samples/minkowski.h"

#include "base/array.h"
#include "field/program.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Raising ------------------------------------------------------------------------------ */

bool zs_minkowski_raise(const zs_lattice_samples *a, const zs_lattice_points *points,
                        zs_lattice_samples *sum, const zs_control *control, zs_diag *diag)
{
  static const zs_minkowski_kernels *const table[ZS_ISA_COUNT] = ZS_VARIANTS(zs_minkowski_table, );
  const zs_minkowski_kernels *kernels = table[zs_isa_select()];
  const int32_t rows = (int32_t)sum->count[1];
  for (uint32_t k = 0; k < sum->count[2]; k++) {
#pragma omp parallel for schedule(dynamic, 4) num_threads(zs_control_threads(control))
    for (int32_t j = 0; j < rows; j++)
      kernels->raise_row(a, points, sum, (uint32_t)j, k);
    if (control && control->progress &&
        !control->progress(control->context, "sum", (k + 1.0) / sum->count[2]))
      return zs_fail(diag, ZS_CANCELLED, NULL, "cancelled");
  }
  return true;
}

/* ---- Parts ---------------------------------------------------------------------------------- */

/* Visit a part from one of its points, and return where its number is greatest. */
static size_t visit(const zs_lattice_samples *a, bool *seen, size_t *stack, size_t from)
{
  const size_t stride[3] = {1, a->count[0], (size_t)a->count[0] * a->count[1]};
  size_t depth = 0, deepest = from;
  stack[depth++] = from;
  seen[from] = true;
  while (depth) {
    const size_t i = stack[--depth];
    const size_t at[3] = {i % stride[1], i / stride[1] % a->count[1], i / stride[2]};
    if (a->f[i] > a->f[deepest])
      deepest = i;
    for (int side = 0; side < 6; side++) {
      const int k = side / 2;
      if (side % 2 ? at[k] + 1 == a->count[k] : at[k] == 0)
        continue;
      const size_t other = side % 2 ? i + stride[k] : i - stride[k];
      if (!seen[other] && a->f[other] >= 0) {
        seen[other] = true;
        stack[depth++] = other;
      }
    }
  }
  return deepest;
}

uint32_t (*zs_lattice_parts(const zs_lattice_samples *a, size_t *count))[3]
{
  const size_t stride = a->count[0], layer = stride * a->count[1], all = layer * a->count[2];
  size_t capacity = 0;
  bool *seen = calloc(all + 1, sizeof *seen);
  size_t *stack = malloc((all + 1) * sizeof *stack);
  uint32_t(*parts)[3] = zs_array_grown(NULL, 1, &capacity, sizeof *parts);
  bool memory = seen && stack && parts;
  *count = 0;
  for (size_t i = 0; memory && i < all; i++) {
    if (seen[i] || !(a->f[i] >= 0))
      continue;
    const size_t deepest = visit(a, seen, stack, i);
    uint32_t(*more)[3] = zs_array_grown(parts, *count + 1, &capacity, sizeof *parts);
    memory = more;
    if (!memory)
      break;
    parts = more;
    parts[*count][0] = (uint32_t)(deepest % stride);
    parts[*count][1] = (uint32_t)(deepest / stride % a->count[1]);
    parts[(*count)++][2] = (uint32_t)(deepest / layer);
  }
  free(seen);
  free(stack);
  if (memory)
    return parts;
  free(parts);
  return NULL;
}
