#include "output/outline.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = ZS_OUTLINE_CELLS };

/* Cells that may hold solid. */
typedef struct cells {
  bool full[N][N][N]; /* z, y, x */
} cells;

static void uniform(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside)
{
  cells *c = visitor;
  for (uint32_t z = lo[2]; z < hi[2]; z++)
    for (uint32_t y = lo[1]; y < hi[1]; y++)
      for (uint32_t x = lo[0]; x < hi[0]; x++)
        c->full[z][y][x] = inside;
}

static void brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                  const zs_program *program)
{
  (void)thread, (void)eval, (void)program;
  cells *c = visitor;
  c->full[index[2]][index[1]][index[0]] = true;
}

/* The box from the first to the last full cell of a row; false when the row
 * is empty. */
static bool row_box(const bool row[N], uint32_t y, uint32_t z, const zs_walk *walk, zs_box *box)
{
  uint32_t first = 0, last = N;
  while (first < N && !row[first])
    first++;
  if (first == N)
    return false;
  while (!row[last - 1])
    last--;
  const uint32_t from[3] = {first, y, z}, to[3] = {last, y + 1, z + 1};
  for (int k = 0; k < 3; k++) {
    box->lo[k] = walk->lo[k] + walk->size[k] * from[k];
    box->hi[k] = walk->lo[k] + walk->size[k] * to[k];
  }
  return true;
}

/* Boxes of the rows of cells that may hold solid, in a lattice on `box`. */
static bool find(zs_outline *outline, cells *c, zs_field *field, const zs_box *box,
                 const zs_control *control, zs_diag *diag)
{
  zs_walk walk = {.field = field,
                  .count = {N, N, N},
                  .request = ZS_REQUEST_SIGN,
                  .control = control,
                  .visitor = c,
                  .uniform = uniform,
                  .brick = brick};
  for (int k = 0; k < 3; k++) {
    walk.lo[k] = box->lo[k];
    walk.size[k] = (box->hi[k] - box->lo[k]) / N;
  }
  memset(c, 0, sizeof *c);
  if (!zs_walk_run(&walk, diag))
    return false;
  outline->count = 0;
  for (uint32_t z = 0; z < N; z++)
    for (uint32_t y = 0; y < N; y++)
      outline->count += row_box(c->full[z][y], y, z, &walk, &outline->boxes[outline->count]);
  if (!outline->count)
    outline->boxes[outline->count++] = *box;
  return true;
}

static zs_box hull(const zs_outline *outline)
{
  zs_box all = outline->boxes[0];
  for (size_t b = 1; b < outline->count; b++)
    for (int k = 0; k < 3; k++) {
      all.lo[k] = fmin(all.lo[k], outline->boxes[b].lo[k]);
      all.hi[k] = fmax(all.hi[k], outline->boxes[b].hi[k]);
    }
  return all;
}

bool zs_outline_find(zs_outline *outline, zs_field *field, const zs_box *box,
                     const zs_control *control, zs_diag *diag)
{
  cells *c = malloc(sizeof *c);
  if (!c)
    return zs_fail_memory(diag);
  /* No samples are taken: there is nothing to do by brute force. */
  const zs_control quiet = {.threads = zs_control_threads(control)};
  bool found = find(outline, c, field, box, &quiet, diag);
  if (found) {
    /* Once more in the part of the box that it takes, in finer cells. */
    const zs_box part = hull(outline);
    found = find(outline, c, field, &part, &quiet, diag);
  }
  free(c);
  return found;
}
