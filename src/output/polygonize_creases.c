/* The polygonizer's sharp edges and corners.
 *
 * Where the normals of a cell's loop disagree, its triangles would cut a sharp
 * edge off.  Such a loop gets one more vertex, where the tangent planes at its
 * vertices meet, and a fan of triangles around it; and where two such loops meet
 * across the sharp edge, their common side is turned to join the new vertices.
 * (L. Kobbelt et al., "Feature sensitive surface extraction from volume data",
 * 2001.)  The mesh stays a closed manifold: a fan has the outline of the
 * triangles that it replaces, and a side is turned only in a face that is cut
 * once, so that no two of the new edges join the same vertices. */
#include "output/polygonize_creases.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_CREASES = ZS_BRICK_CORNERS * ZS_CELL_LOOPS };

/* One thread's working data. */
typedef struct finder {
  zs_edge_numbers numbers;
  zs_loops loops;
  zs_found found[MOST_CREASES];
  uint32_t count;
  zs_settling settling;
} finder;

/* What one brick's creases are found with. */
typedef struct finding {
  const zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  const zs_brick *brick;
  const zs_crease_kernels *kernels;
  zs_frame frame;
} finding;

/* ---- Finding -------------------------------------------------------------------------- */

/* Whether normals are all within half the angle of a sharp edge of one of them,
 * and so within the angle of each other. */
static bool are_alike(unsigned n, const float *normals, const uint32_t *numbers,
                      const size_t *offsets, const uint8_t *loop)
{
  const float half = 0.9617692f; /* the root of (1 + ZS_SHARP) / 2 */
  const float *const a = normals + 3 * (size_t)numbers[offsets[loop[0]]];
  float least = 1;
  for (unsigned i = 1; i < n; i++) {
    const float *const b = normals + 3 * (size_t)numbers[offsets[loop[i]]];
    const float dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    least = dot < least ? dot : least;
  }
  return least > half;
}

/* Keep the creases of the block's loops that are sharp. */
static void flush(const finding *s)
{
  finder *w = s->worker->scratch;
  zs_loops *loops = &w->loops;
  for (uint64_t met = s->kernels->meet(loops); met; met &= met - 1) {
    const unsigned i = (unsigned)__builtin_ctzll(met);
    zs_found *found = &w->found[w->count++];
    *found = (zs_found){.crease = {.cell = loops->cell[i], .edges = loops->edges[i]}};
    for (int k = 0; k < 3; k++) {
      const double first = loops->point[0][k][i] - s->frame.origin[k];
      found->crease.place[k] = (float)first + loops->place[k][i];
      found->crease.normal[k] = loops->direction[k][i];
    }
  }
  loops->count = 0;
}

/* Add one loop of a cell to the block. */
static void add_loop(const finding *s, unsigned cell, unsigned n, const uint8_t *loop,
                     const uint32_t *numbers, const size_t *offsets)
{
  const zs_mesh *mesh = s->job->mesh;
  finder *w = s->worker->scratch;
  zs_loops *loops = &w->loops;
  const unsigned at = loops->count++;
  unsigned edges = 0;
  for (unsigned i = 0; i < n; i++) {
    const size_t vertex = 3 * (size_t)numbers[offsets[loop[i]]];
    edges |= 1u << loop[i];
    for (unsigned k = 0; k < 3; k++) {
      loops->point[i][k][at] = mesh->positions[vertex + k];
      loops->normal[i][k][at] = mesh->normals[vertex + k];
    }
  }
  loops->cell[at] = (uint16_t)cell;
  loops->edges[at] = (uint16_t)edges;
  loops->length[at] = (float)n;
  if (loops->count == ZS_LOOPS)
    flush(s);
}

/* Let one box hold another. */
static void hold(zs_normal_box *box, const zs_normal_box *other)
{
  for (int k = 0; k < 3; k++) {
    box->lo[k] = fminf(box->lo[k], other->lo[k]);
    box->hi[k] = fmaxf(box->hi[k], other->hi[k]);
  }
}

/* Whether the normals that a brick's cells meet are all alike, as far as boxes
 * tell: the distance of unit vectors a and b is the root of 2 - 2 a b. */
static bool is_smooth(const zs_polygonize_job *job, const zs_brick *brick)
{
  const float margin = 0.99f;
  zs_normal_box box = brick->all_normals;
  for (unsigned d = 1; d < 8; d++) {
    const zs_brick *owner = zs_brick_upper(job, brick, d);
    if (owner->vertex_count)
      hold(&box, &owner->side_normals[__builtin_ctz(d)]);
  }
  float square = 0;
  for (int k = 0; k < 3; k++)
    square += (box.hi[k] - box.lo[k]) * (box.hi[k] - box.lo[k]);
  return square < margin * (2 - 2 * ZS_SHARP) || box.lo[0] > box.hi[0];
}

/* Creases of the cells of a brick; those outside the grid's faces have none. */
static void find_creases(const finding *s, const zs_contour_table *table)
{
  const zs_brick *brick = s->brick;
  finder *w = s->worker->scratch;
  size_t offsets[ZS_CELL_EDGES];
  zs_brick_rows rows;
  zs_row_bits cells;
  zs_brick_gather_signs(s->job, brick, rows);
  zs_brick_find_cells(s->job, brick, (const uint32_t(*)[ZS_REACH])rows, cells);
  zs_brick_number_edges(s->job, brick, w->numbers);
  zs_cell_edge_offsets(offsets);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned bits = cells[row]; bits; bits &= bits - 1) {
      const unsigned x = (unsigned)__builtin_ctz(bits), y = row % ZS_BRICK, z = row / ZS_BRICK;
      if (brick->at_face && zs_brick_is_pad_cell(s->job, brick, x, y, z))
        continue;
      const uint32_t *numbers = w->numbers + zs_reach_offset(x, y, z);
      const zs_cell_case *cell =
        &table->cases[zs_brick_cell_case((const uint32_t(*)[ZS_REACH])rows, x, y, z)];
      const uint8_t *loop = cell->loops;
      for (unsigned l = 0; l < cell->loop_count; loop += cell->loop_lengths[l++]) {
        const unsigned n = cell->loop_lengths[l];
        if (!are_alike(n, s->job->mesh->normals, numbers, offsets, loop))
          add_loop(s, row * ZS_BRICK + x, n, loop, numbers, offsets);
      }
    }
  flush(s);
}

/* ---- Bricks ---------------------------------------------------------------------------- */

/* Keep those that settled with the brick. */
static void keep_settled(const finding *s, zs_brick *brick)
{
  const finder *w = s->worker->scratch;
  uint32_t count = 0;
  for (uint32_t i = 0; i < w->count; i++)
    count += w->found[i].settled;
  if (!count)
    return;
  brick->creases = zs_arena_reserve(&s->worker->arena, count, sizeof *brick->creases);
  if (!brick->creases) {
    s->worker->out_of_memory = true;
    return;
  }
  for (uint32_t i = 0; i < w->count; i++)
    if (w->found[i].settled)
      brick->creases[brick->crease_count++] = w->found[i].crease;
  zs_creases_compare(s->job, brick);
}

static void visit_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  finding s = {.job = job, .worker = worker, .brick = brick};
  finder *w = worker->scratch;
  if (is_smooth(job, brick))
    return;
  s.frame = zs_brick_frame(job, brick);
  s.kernels = zs_crease_kernels_of(zs_eval_isa(worker->eval));
  w->count = 0;
  find_creases(&s, &job->cases);
  if (!w->count)
    return;
  zs_creases_settle(job, worker, brick, w->found, w->count, &w->settling);
  keep_settled(&s, brick);
}

/* ---- The stage ------------------------------------------------------------------------------ */

static bool find_all(zs_polygonize_job *job)
{
  finder *scratch = aligned_alloc(64, job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++) {
    memset(&scratch[t].loops, 0, sizeof scratch[t].loops);
    job->workers[t].scratch = &scratch[t];
  }
  bool done = zs_polygonize_each(job, "creases", 0.9, 0.97, visit_brick);
  free(scratch);
  return done;
}

/* Number the vertices of the creases behind those of the edges. */
static void number(zs_polygonize_job *job)
{
  size_t triangles = 0;
  for (size_t i = 0; i < job->active_count; i++) {
    zs_brick *brick = job->active[i];
    brick->first_crease = job->vertex_count;
    job->vertex_count += brick->crease_count;
    /* A fan has two triangles more than its loop had. */
    brick->triangle_count += 2 * brick->crease_count;
    brick->first_triangle = triangles;
    triangles += brick->triangle_count;
  }
  job->triangle_count = triangles;
}

static void place(const zs_polygonize_job *job)
{
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++) {
    const zs_brick *brick = job->active[i];
    const zs_frame frame = zs_brick_frame(job, brick);
    for (uint32_t c = 0; c < brick->crease_count; c++)
      for (size_t k = 0; k < 3; k++) {
        size_t at = 3 * (brick->first_crease + c) + k;
        job->mesh->positions[at] = (float)(frame.origin[k] + (double)brick->creases[c].place[k]);
        job->mesh->normals[at] = brick->creases[c].normal[k];
      }
  }
}

bool zs_polygonize_creases(zs_polygonize_job *job)
{
  bool any = false;
  if (!find_all(job))
    return false;
  for (size_t i = 0; i < job->active_count && !any; i++)
    any = job->active[i]->crease_count > 0;
  if (!any)
    return true;
  if (!zs_polygonize_distinct(job))
    return false;
  number(job);
  if (!zs_mesh_resize(job->mesh, job->vertex_count, 0, job->diag))
    return false;
  place(job);
  return true;
}

bool zs_crease_find(const zs_polygonize_job *job, const zs_brick *brick, const int cell[3],
                    unsigned edges, uint32_t *vertex)
{
  uint32_t index[3];
  unsigned number = 0;
  for (int k = 2; k >= 0; k--) {
    index[k] = brick->index[k];
    if (cell[k] < 0)
      index[k]--; /* below the first brick: beyond all, where nothing is */
    else if (cell[k] >= ZS_BRICK)
      index[k]++;
    number = number * ZS_BRICK + ((unsigned)cell[k] & (ZS_BRICK - 1));
  }
  const zs_brick *owner = zs_lattice_brick(job, index);
  uint32_t low = 0, high = owner->crease_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (owner->creases[middle].cell < number)
      low = middle + 1;
    else
      high = middle;
  }
  for (; low < owner->crease_count && owner->creases[low].cell == number; low++)
    if ((owner->creases[low].edges & edges) == edges) {
      *vertex = (uint32_t)(owner->first_crease + low);
      return true;
    }
  return false;
}
