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
#include "output/polygonize.h"
#include "output/polygonize_roots.h"
#include "output/quadric.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Normals that differ by more, about 32 degrees, are those of a sharp edge. */
static const float SHARP = 0.85f;

/* A crease settles within this part of a cell, or the planes said little. */
static const float NEAR = 0.15f;

enum { LONGEST_LOOP = 7, MOST_CREASES = ZS_BRICK_CORNERS * ZS_CELL_LOOPS };

typedef struct finder {
  zs_edge_numbers numbers;
  zs_crease found[MOST_CREASES];
  uint32_t count;
} finder;

bool zs_crease_between(const float a[3], const float b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < SHARP;
}

/* ---- Where planes meet ---------------------------------------------------------- */

/* The point closest to the planes through `points` with `normals`, and the
 * direction that leads away from all of them alike: out of the solid, however
 * many vertices lie on either side of the edge.  False when there is none. */
static bool meet(unsigned n, float points[][3], const float *const normals[], float place[3],
                 float normal[3])
{
  double mean[3] = {0}, solution[2][3];
  zs_quadric planes = {{{0}}, {0}}, away = planes;
  for (unsigned i = 0; i < n; i++)
    for (int k = 0; k < 3; k++)
      mean[k] += (double)points[i][k] / n;
  for (unsigned i = 0; i < n; i++) {
    double distance = 0;
    for (int k = 0; k < 3; k++)
      distance += normals[i][k] * (points[i][k] - mean[k]);
    zs_quadric_add(&planes, normals[i], distance);
    zs_quadric_add(&away, normals[i], 1);
  }
  double values[2][3];
  memcpy(values[0], planes.b, sizeof planes.b);
  memcpy(values[1], away.b, sizeof away.b);
  zs_quadric_solve((const double(*)[3])planes.a, (const double(*)[3])values, solution);
  const double *direction = solution[1];
  double length = hypot(hypot(direction[0], direction[1]), direction[2]);
  for (int k = 0; k < 3; k++) {
    place[k] = (float)(mean[k] + solution[0][k]);
    normal[k] = (float)(direction[k] / length);
  }
  return length > 0 && isfinite(length) && isfinite(place[0]) && isfinite(place[1]) &&
         isfinite(place[2]);
}

/* ---- Finding -------------------------------------------------------------------------- */

/* The space that a crease may take, in the brick's frame: its own cell, a little
 * off its sides, or the cells around it too; within the grid, a little off its
 * faces. */
static void space_of(const zs_polygonize_job *job, const zs_brick *brick, unsigned cell,
                     bool around, float lo[3], float hi[3])
{
  const unsigned at[3] = {cell % ZS_BRICK, cell / ZS_BRICK % ZS_BRICK, cell / ZS_BRICK_ROWS};
  const zs_frame frame = zs_brick_frame(job, brick);
  for (int k = 0; k < 3; k++) {
    double margin = fmin(job->apart, job->cell[k] / 4);
    double from = zs_lattice_place(job, k, 0) + margin;
    double to = zs_lattice_place(job, k, job->corners[k]) - margin;
    double corner = frame.origin[k] + job->cell[k] * ((double)at[k] - ZS_BRICK / 2);
    double more = around ? job->cell[k] : -margin;
    lo[k] = (float)(fmax(corner - more, from) - frame.origin[k]);
    hi[k] = (float)(fmin(corner + job->cell[k] + more, to) - frame.origin[k]);
  }
}

static void clamp(float place[3], const float lo[3], const float hi[3])
{
  for (int k = 0; k < 3; k++)
    place[k] = fminf(fmaxf(place[k], lo[k]), hi[k]);
}

/* Whether the normals of a loop disagree; false when one is missing. */
static bool is_sharp(unsigned n, const float *const normals[])
{
  /* Normals within half the angle of one are within the angle of each other. */
  const float half = sqrtf((1 + SHARP) / 2);
  const float *const a = normals[0];
  unsigned alike = 1;
  for (unsigned i = 1; i < n; i++) {
    const float *const b = normals[i];
    alike += a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > half;
  }
  if (alike == n)
    return false;
  bool sharp = false;
  for (unsigned i = 0; i < n; i++) {
    if (normals[i][0] == 0 && normals[i][1] == 0 && normals[i][2] == 0)
      return false;
    for (unsigned j = 0; j < i && !sharp; j++)
      sharp = zs_crease_between(normals[i], normals[j]);
  }
  return sharp;
}

/* One loop of a cell: keep a crease if it is sharp. */
static void visit_loop(const zs_polygonize_job *job, const zs_brick *brick, finder *w,
                       unsigned cell, unsigned n, const uint8_t *loop,
                       const uint32_t vertices[LONGEST_LOOP])
{
  const float *normals[LONGEST_LOOP];
  for (unsigned i = 0; i < n; i++)
    normals[i] = job->mesh->normals + 3 * (size_t)vertices[i];
  if (!is_sharp(n, normals))
    return;
  zs_crease crease = {.cell = (uint16_t)cell};
  const zs_frame frame = zs_brick_frame(job, brick);
  float points[LONGEST_LOOP][3];
  for (unsigned i = 0; i < n; i++) {
    crease.edges |= (uint16_t)(1u << loop[i]);
    for (unsigned k = 0; k < 3; k++)
      points[i][k] =
        (float)(job->mesh->positions[3 * (size_t)vertices[i] + k] - frame.origin[k]);
  }
  if (meet(n, points, normals, crease.place, crease.normal))
    w->found[w->count++] = crease;
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
  return square < margin * (2 - 2 * SHARP) || box.lo[0] > box.hi[0];
}

/* Creases of the cells of a brick; those outside the grid's faces have none. */
static void find_creases(const zs_polygonize_job *job, const zs_contour_table *table,
                         const zs_brick *brick, finder *w)
{
  size_t offsets[ZS_CELL_EDGES];
  zs_brick_rows rows;
  zs_row_bits cells;
  w->count = 0;
  if (is_smooth(job, brick))
    return;
  zs_brick_gather_signs(job, brick, rows);
  zs_brick_find_cells(job, brick, (const uint32_t(*)[ZS_REACH])rows, cells);
  zs_brick_number_edges(job, brick, w->numbers);
  zs_cell_edge_offsets(offsets);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned bits = cells[row]; bits; bits &= bits - 1) {
      const unsigned x = (unsigned)__builtin_ctz(bits), y = row % ZS_BRICK, z = row / ZS_BRICK;
      if (brick->at_face && zs_brick_is_pad_cell(job, brick, x, y, z))
        continue;
      const zs_cell_case *cell =
        &table->cases[zs_brick_cell_case((const uint32_t(*)[ZS_REACH])rows, x, y, z)];
      const uint8_t *loop = cell->loops;
      for (unsigned l = 0; l < cell->loop_count; loop += cell->loop_lengths[l++]) {
        uint32_t vertices[LONGEST_LOOP];
        for (unsigned i = 0; i < cell->loop_lengths[l]; i++)
          vertices[i] = w->numbers[zs_reach_offset(x, y, z) + offsets[loop[i]]];
        visit_loop(job, brick, w, row * ZS_BRICK + x, cell->loop_lengths[l], loop, vertices);
      }
    }
}

/* Keep what was found with the brick. */
static void keep_creases(zs_polygonize_worker *worker, zs_brick *brick, const finder *w)
{
  if (!w->count)
    return;
  brick->creases = ZS_ARENA_NEW(&worker->arena, zs_crease, w->count);
  if (!brick->creases) {
    worker->out_of_memory = true;
    return;
  }
  memcpy(brick->creases, w->found, w->count * sizeof *w->found);
  brick->crease_count = w->count;
}

/* ---- Settling ----------------------------------------------------------------------------
 *
 * The planes meet near the surface, on it only if it is flat on both sides.
 * Vertices are certified roots: creases settle along their normals.  A sharp edge
 * may pass by the corners of its cell unseen, so that the crease belongs into a
 * cell next to it; it may settle there, close to where the planes meet, unless
 * that cell has triangles of its own to fold over.  Else it settles in its own
 * cell, as close to the edge as it gets. */

typedef struct settler {
  zs_roots roots;
  zs_crease *crease[ZS_BLOCK]; /* the block */
  unsigned count;
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float f[2][ZS_BLOCK]; /* at the place found, and at the far end */
  float ends[2][3][ZS_BLOCK];        /* those places */
  uint16_t of_line[ZS_BLOCK];        /* the crease of each line */
} settler;

/* How a block settles: with the program of the brick that holds the places, in
 * its frame. */
typedef struct settling {
  const zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  const zs_brick *brick, *holder;
  bool around; /* in the cells around, too */
  zs_frame frame;   /* of the holder */
  float shift[3];   /* from the brick's frame to it */
  float lo[3], hi[3]; /* the holder, in the brick's frame */
  float near;
} settling;

/* Where a crease may settle. */
static void room_of(const settling *s, const zs_crease *crease, float lo[3], float hi[3])
{
  space_of(s->job, s->brick, crease->cell, s->around, lo, hi);
  clamp(lo, s->lo, s->hi);
  clamp(hi, s->lo, s->hi);
}

/* From the crease along its normal, outward when it is inside, to where its room
 * ends, or to where it would be too far from where the planes meet. */
static void far_end(const settling *s, const zs_crease *crease, bool inside, const float lo[3],
                    const float hi[3], const float from[3], float end[3])
{
  float step[3], reach = s->around ? s->near : INFINITY;
  for (int k = 0; k < 3; k++) {
    step[k] = inside ? crease->normal[k] : -crease->normal[k];
    if (step[k] != 0)
      reach = fminf(reach, ((step[k] > 0 ? hi[k] : lo[k]) - from[k]) / step[k]);
  }
  for (int k = 0; k < 3; k++)
    end[k] = from[k] + fmaxf(reach, 0) * step[k];
  clamp(end, lo, hi);
}

/* The ends of the block's lines, and f there. */
static void look(const settling *s)
{
  settler *w = s->worker->scratch;
  for (int end = 0; end < 2; end++) {
    for (unsigned i = 0; i < w->count; i++) {
      float lo[3], hi[3], from[3], place[3];
      room_of(s, w->crease[i], lo, hi);
      memcpy(from, w->crease[i]->place, sizeof from);
      clamp(from, lo, hi);
      memcpy(place, from, sizeof place);
      if (end)
        far_end(s, w->crease[i], w->f[0][i] >= 0, lo, hi, from, place);
      for (int k = 0; k < 3; k++)
        w->at[k][i] = w->ends[end][k][i] = place[k] + s->shift[k];
    }
    zs_program_values(s->worker->eval, s->holder->program, &s->frame, w->count, w->at[0],
                      w->at[1], w->at[2], w->f[end]);
    s->worker->evaluations += w->count;
  }
}

/* Whether the corners of a cell, by lattice index, have different signs. */
static bool holds_surface(const zs_polygonize_job *job, const uint32_t cell[3])
{
  unsigned inside = 0;
  for (unsigned c = 0; c < 8; c++) {
    uint32_t at[3], index[3];
    for (unsigned k = 0; k < 3; k++) {
      at[k] = cell[k] + (c >> k & 1);
      index[k] = at[k] / ZS_BRICK;
    }
    const zs_brick *owner = zs_lattice_brick(job, index);
    unsigned row = at[2] % ZS_BRICK * ZS_BRICK + at[1] % ZS_BRICK;
    inside += owner->signs[row] >> at[0] % ZS_BRICK & 1;
  }
  return inside != 0 && inside != 8;
}

/* Lattice coordinate of a place in the brick's frame, from the brick's first
 * corner. */
static int local_cell(const zs_polygonize_job *job, int axis, float place)
{
  return (int)floor(place / job->cell[axis]) + ZS_BRICK / 2;
}

/* Whether a crease may settle in a place around its cell. */
static bool accept(const settling *s, const zs_crease *crease, const float place[3])
{
  uint32_t at[3];
  float square = 0;
  bool own = true;
  for (int k = 0; k < 3; k++) {
    float moved = place[k] - crease->place[k];
    square += moved * moved;
    int local = local_cell(s->job, k, place[k]);
    own = own && local == (crease->cell >> 4 * k & (ZS_BRICK - 1));
    at[k] = (uint32_t)((int64_t)zs_lattice_index(s->brick, k, 0) + local);
  }
  return square <= s->near * s->near && (own || !holds_surface(s->job, at));
}

/* Settle a block: creases with a sign change on their line move to it. */
static void settle(const settling *s)
{
  settler *w = s->worker->scratch;
  look(s);
  w->roots.count = 0;
  for (unsigned i = 0; i < w->count; i++) {
    float end[2][3];
    bool inside = w->f[0][i] >= 0;
    if (inside == (w->f[1][i] >= 0))
      continue;
    for (int e = 0; e < 2; e++)
      for (int k = 0; k < 3; k++)
        end[e][k] = w->ends[e][k][i];
    w->of_line[w->roots.count] = (uint16_t)i;
    zs_roots_add(&w->roots, end[!inside], end[inside], w->f[!inside][i], w->f[inside][i]);
  }
  s->worker->evaluations +=
    zs_roots_solve(&w->roots, s->worker->eval, s->holder->program, &s->frame,
                   (float)s->job->tolerance, 0);
  for (unsigned i = 0; i < w->roots.count; i++) {
    zs_crease *crease = w->crease[w->of_line[i]];
    float place[3];
    for (int k = 0; k < 3; k++)
      place[k] = w->roots.found[k][i] - s->shift[k];
    if (s->around && !accept(s, crease, place))
      continue;
    memcpy(crease->place, place, sizeof place);
    crease->settled = true;
  }
  w->count = 0;
}

enum { OWN = 13 /* of the bricks around: 9 z + 3 y + x, each 0 .. 2 */ };

/* Which of the bricks around the brick, or itself, holds the place from which a
 * crease sets out. */
static unsigned holder_of(const settling *s, const zs_crease *crease)
{
  unsigned number = 0;
  float lo[3], hi[3], from[3];
  memcpy(from, crease->place, sizeof from);
  space_of(s->job, s->brick, crease->cell, true, lo, hi);
  clamp(from, lo, hi);
  for (int k = 2; k >= 0; k--) {
    int local = local_cell(s->job, k, from[k]);
    number = 3 * number + (local < 0 ? 0 : local < ZS_BRICK ? 1 : 2);
  }
  return number;
}

/* Turn to one of the bricks around; false when it has no surface. */
static bool turn_to(settling *s, unsigned neighbour)
{
  uint32_t index[3];
  for (int k = 0; k < 3; k++, neighbour /= 3) {
    const float side = (float)(s->job->cell[k] * ZS_BRICK);
    const int step = (int)(neighbour % 3) - 1;
    index[k] = s->brick->index[k] + (uint32_t)step; /* below 0: no brick's index */
    s->shift[k] = -(float)step * side;
    s->lo[k] = ((float)step - 0.5f) * side;
    s->hi[k] = ((float)step + 0.5f) * side;
  }
  s->holder = zs_lattice_brick(s->job, index);
  if (!s->holder->sampled)
    return false;
  s->frame = zs_brick_frame(s->job, s->holder);
  return true;
}

/* Settle those creases that have not yet and whose place one brick holds; any
 * place will do when they have to stay in their cells. */
static void settle_in(settling *s, unsigned neighbour)
{
  settler *w = s->worker->scratch;
  if (!turn_to(s, neighbour))
    return;
  w->count = 0;
  for (uint32_t i = 0; i < s->brick->crease_count; i++) {
    zs_crease *crease = &s->brick->creases[i];
    if (crease->settled || (s->around && holder_of(s, crease) != neighbour))
      continue;
    w->crease[w->count++] = crease;
    if (w->count == ZS_BLOCK)
      settle(s);
  }
  if (w->count)
    settle(s);
}

static void visit_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  if (!brick->crease_count)
    return;
  settling s = {.job = job, .worker = worker, .brick = brick, .around = true};
  s.near = NEAR * (float)fmin(job->cell[0], fmin(job->cell[1], job->cell[2]));
  uint32_t holders = 0;
  for (uint32_t i = 0; i < brick->crease_count; i++)
    holders |= 1u << holder_of(&s, &brick->creases[i]);
  for (; holders; holders &= holders - 1)
    settle_in(&s, (unsigned)__builtin_ctz(holders));
  s.around = false;
  settle_in(&s, OWN);
  for (uint32_t i = 0; i < brick->crease_count; i++)
    if (!brick->creases[i].settled)
      brick->creases[i].edges = 0;
  zs_brick_compact_creases(brick);
}

/* ---- The stage ------------------------------------------------------------------------------ */

static bool find_all(zs_polygonize_job *job, const zs_contour_table *table)
{
  finder *scratch = malloc(job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++) {
    unsigned thread = zs_polygonize_thread();
    find_creases(job, table, job->active[i], &scratch[thread]);
    keep_creases(&job->workers[thread], job->active[i], &scratch[thread]);
  }
  free(scratch);
  for (unsigned t = 0; t < job->threads; t++)
    if (job->workers[t].out_of_memory)
      return zs_fail_memory(job->diag);
  return true;
}

static bool settle_all(zs_polygonize_job *job)
{
  settler *scratch = aligned_alloc(64, job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++)
    job->workers[t].scratch = &scratch[t];
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

bool zs_polygonize_creases(zs_polygonize_job *job, const zs_contour_table *table)
{
  bool any = false;
  if (!find_all(job, table))
    return false;
  for (size_t i = 0; i < job->active_count && !any; i++)
    any = job->active[i]->crease_count > 0;
  if (!any)
    return true;
  if (!settle_all(job) || !zs_polygonize_distinct(job))
    return false;
  number(job);
  if (!zs_mesh_resize(job->mesh, job->vertex_count, job->triangle_count, job->diag))
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
