/* The features method: manifold dual contouring.
 *
 * The surface in a cell consists of loops of crossing edges (see
 * contour_table.h).  Each loop, a patch, becomes one vertex within the cell, where
 * the tangent planes at its edges meet; each crossing edge becomes a face that
 * joins the vertices of the four cells around it.  (T. Ju et al., "Dual
 * contouring of Hermite data", 2002; one vertex for a loop: G. Nielson, "Dual
 * marching cubes", 2004.)
 *
 * The mesh is the dual of the one that the loops outline, which is a closed
 * manifold; so is the dual, as long as no two of its vertices are joined twice.
 * Two loops that meet twice, in a face with four crossings, are parted there.  What
 * follows keeps it one: vertices move (polygonize_features_claims.c), and mesh edges
 * turn (polygonize_features_turn.c). */
#include "output/polygonize.h"

#include "base/diagnostic.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_PATCHES = ZS_BRICK_CORNERS * ZS_CELL_LOOPS };

typedef struct finder {
  const zs_loop_table *table;
  zs_patch found[MOST_PATCHES];
  uint16_t rows[ZS_BRICK_ROWS + 1];
  uint32_t count;
} finder;

/* The loops of a cell of the brick. */
static const zs_cell_loops *cell_loops(const zs_polygonize_job *job, const zs_loop_table *table,
                                       const zs_brick *brick, const unsigned local[3],
                                       unsigned inside)
{
  const unsigned face = table->twice[inside];
  if (face == ZS_NO_FACE)
    return &table->loops[inside];
  uint32_t across[3];
  for (int k = 0; k < 3; k++)
    across[k] = zs_lattice_index(brick, k, local[k]);
  across[face / 2] += face & 1 ? 1 : UINT32_MAX;
  /* The face has corners inside, so it is none of the lattice's outermost. */
  bool both = table->twice[zs_lattice_cell_case(job, across)] == (face ^ 1);
  return both ? &table->parted[inside] : &table->loops[inside];
}

/* Without caps loops of edges to pads alone are no part of the surface. */
static unsigned surface_edges(const zs_polygonize_job *job, const zs_brick *brick,
                              const unsigned local[3])
{
  const unsigned all = (1u << ZS_CELL_EDGES) - 1;
  return job->cap ? all : all & ~zs_brick_pad_edges(job, brick, local);
}

static void find_patches(const zs_polygonize_job *job, const zs_brick *brick, finder *w)
{
  zs_brick_rows rows;
  zs_brick_gather_signs(job, brick, rows);
  w->count = 0;
  unsigned at[3];
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    at[1] = row % ZS_BRICK;
    at[2] = row / ZS_BRICK;
    w->rows[row] = (uint16_t)w->count;
    for (uint32_t cells = zs_brick_active_cells(job, brick, rows, at[1], at[2]); cells;
         cells &= cells - 1) {
      at[0] = (unsigned)__builtin_ctz(cells);
      const unsigned inside = zs_brick_cell_case(rows, at[0], at[1], at[2]);
      const zs_cell_loops *loops = cell_loops(job, w->table, brick, at, inside);
      for (unsigned l = 0; l < loops->count; l++)
        if (loops->edges[l] & surface_edges(job, brick, at))
          w->found[w->count++] = (zs_patch){.cell = (uint16_t)(row * ZS_BRICK + at[0]),
                                            .edges = loops->edges[l]};
    }
  }
  w->rows[ZS_BRICK_ROWS] = (uint16_t)w->count;
}

/* Keep what was found with the brick. */
static void keep_patches(zs_polygonize_worker *worker, zs_brick *brick, const finder *w)
{
  if (!w->count)
    return;
  brick->patches = zs_arena_reserve(&worker->arena, w->count, sizeof *brick->patches);
  uint16_t *rows = zs_arena_reserve(&worker->arena, ZS_BRICK_ROWS + 1, sizeof *rows);
  if (!brick->patches || !rows) {
    worker->out_of_memory = true;
    return;
  }
  memcpy(brick->patches, w->found, w->count * sizeof *w->found);
  memcpy(rows, w->rows, sizeof w->rows);
  brick->patch_rows = rows;
  brick->patch_count = w->count;
}

static void visit_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  finder *w = worker->scratch;
  find_patches(job, brick, w);
  keep_patches(worker, brick, w);
}

bool zs_polygonize_patches(zs_polygonize_job *job)
{
  zs_loop_table table;
  zs_loop_table_make(&table);
  finder *scratch = malloc(job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++) {
    scratch[t].table = &table;
    job->workers[t].scratch = &scratch[t];
  }
  bool done = zs_polygonize_each(job, "loops", 0.9, 0.9, visit_brick);
  free(scratch);
  for (size_t i = 0; i < job->active_count; i++) {
    job->active[i]->first_patch = job->patch_count;
    job->patch_count += job->active[i]->patch_count;
  }
  return done;
}
