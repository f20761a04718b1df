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

/* A crease settles within this part of a cell, or the planes said little. */
static const float NEAR = 0.15f;

enum { LONGEST_LOOP = 7, MOST_CREASES = ZS_BRICK_CORNERS * ZS_CELL_LOOPS };

/* The spaces that creases may take, by axis and place of their cell, in the
 * brick's frame: their own cell, a little off its sides, or the cells around it
 * too; within the grid, a little off its faces. */
typedef struct space {
  float lo[3][ZS_BRICK], hi[3][ZS_BRICK];
} space;

/* One thread's working data. */
typedef struct finder {
  zs_edge_numbers numbers;
  zs_crease found[MOST_CREASES];
  uint32_t count;
  uint8_t holder[MOST_CREASES]; /* see holder_of */
  space own, around;
  /* A block that is being settled. */
  zs_roots roots;
  zs_crease *crease[ZS_BLOCK];
  unsigned block;
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float f[2][ZS_BLOCK]; /* at the place found, and at the far end */
  float ends[2][3][ZS_BLOCK];        /* those places */
  uint16_t of_line[ZS_BLOCK];        /* the crease of each line */
} finder;

/* What one brick's creases are found with. */
typedef struct finding {
  const zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  const zs_brick *brick;
  zs_frame frame;
} finding;

static float smaller(float a, float b)
{
  return a < b ? a : b;
}

static float larger(float a, float b)
{
  return a > b ? a : b;
}

/* ---- Where planes meet ---------------------------------------------------------- */

/* The point closest to the planes through `points` with `normals`, and the
 * direction that leads away from all of them alike: out of the solid, however
 * many vertices lie on either side of the edge.  False when there is none. */
static bool meet(unsigned n, float points[][3], const float *const normals[], float place[3],
                 float normal[3])
{
  double mean[3] = {0}, solution[2][3];
  zs_quadric planes = {{{0}}, {0}};
  double values[2][3] = {{0}};
  for (unsigned i = 0; i < n; i++)
    for (int k = 0; k < 3; k++)
      mean[k] += (double)points[i][k] / n;
  for (unsigned i = 0; i < n; i++) {
    double distance = 0;
    for (int k = 0; k < 3; k++)
      distance += normals[i][k] * (points[i][k] - mean[k]);
    zs_quadric_add(&planes, normals[i], distance);
    for (int k = 0; k < 3; k++)
      values[1][k] += normals[i][k];
  }
  memcpy(values[0], planes.b, sizeof planes.b);
  zs_quadric_solve((const double(*)[3])planes.a, (const double(*)[3])values, solution);
  const double *direction = solution[1];
  double length = sqrt(direction[0] * direction[0] + direction[1] * direction[1] +
                       direction[2] * direction[2]);
  for (int k = 0; k < 3; k++) {
    place[k] = (float)(mean[k] + solution[0][k]);
    normal[k] = (float)(direction[k] / length);
  }
  return length > 0 && isfinite(length) && isfinite(place[0]) && isfinite(place[1]) &&
         isfinite(place[2]);
}

/* ---- Finding -------------------------------------------------------------------------- */

static void fill_space(const finding *s, double margin, double more, space *space)
{
  for (int k = 0; k < 3; k++) {
    const double cell = s->job->cell[k], origin = s->frame.origin[k];
    const double from = zs_lattice_place(s->job, k, 0) + margin;
    const double to = zs_lattice_place(s->job, k, s->job->corners[k]) - margin;
    for (int i = 0; i < ZS_BRICK; i++) {
      double corner = origin + cell * (i - ZS_BRICK / 2);
      space->lo[k][i] = (float)(fmax(corner - more * cell, from) - origin);
      space->hi[k][i] = (float)(fmin(corner + cell + more * cell, to) - origin);
    }
  }
}

static void fill_spaces(const finding *s)
{
  finder *w = s->worker->scratch;
  const double *cell = s->job->cell;
  const double margin = fmin(s->job->apart, fmin(cell[0], fmin(cell[1], cell[2])) / 4);
  fill_space(s, margin, 1, &w->around);
  fill_space(s, margin, 0, &w->own);
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < ZS_BRICK; i++) {
      w->own.lo[k][i] += (float)margin;
      w->own.hi[k][i] -= (float)margin;
    }
}

static void space_of(const space *space, unsigned cell, float lo[3], float hi[3])
{
  for (int k = 0; k < 3; k++, cell /= ZS_BRICK) {
    lo[k] = space->lo[k][cell % ZS_BRICK];
    hi[k] = space->hi[k][cell % ZS_BRICK];
  }
}

static void clamp(float place[3], const float lo[3], const float hi[3])
{
  for (int k = 0; k < 3; k++)
    place[k] = smaller(larger(place[k], lo[k]), hi[k]);
}

/* Whether normals are all within half the angle of a sharp edge of one of them,
 * and so within the angle of each other. */
static inline bool are_alike(unsigned n, const float *normals, const uint32_t *numbers,
                             const size_t *offsets, const uint8_t *loop)
{
  const float half = 0.9617692f; /* the root of (1 + ZS_SHARP) / 2 */
  const float *const a = normals + 3 * (size_t)numbers[offsets[loop[0]]];
  float least = 1;
  for (unsigned i = 1; i < n; i++) {
    const float *const b = normals + 3 * (size_t)numbers[offsets[loop[i]]];
    least = smaller(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], least);
  }
  return least > half;
}

/* Whether the normals of a loop disagree; false when one is missing. */
static bool is_sharp(unsigned n, const float *const normals[])
{
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
static void visit_loop(const finding *s, unsigned cell, unsigned n, const uint8_t *loop,
                       const uint32_t vertices[LONGEST_LOOP])
{
  const zs_mesh *mesh = s->job->mesh;
  finder *w = s->worker->scratch;
  const float *normals[LONGEST_LOOP];
  for (unsigned i = 0; i < n; i++)
    normals[i] = mesh->normals + 3 * (size_t)vertices[i];
  if (!is_sharp(n, normals))
    return;
  zs_crease crease = {.cell = (uint16_t)cell};
  float points[LONGEST_LOOP][3];
  for (unsigned i = 0; i < n; i++) {
    crease.edges |= (uint16_t)(1u << loop[i]);
    for (unsigned k = 0; k < 3; k++)
      points[i][k] = (float)(mesh->positions[3 * (size_t)vertices[i] + k] - s->frame.origin[k]);
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
        uint32_t vertices[LONGEST_LOOP];
        if (are_alike(n, s->job->mesh->normals, numbers, offsets, loop))
          continue;
        for (unsigned i = 0; i < n; i++)
          vertices[i] = numbers[offsets[loop[i]]];
        visit_loop(s, row * ZS_BRICK + x, n, loop, vertices);
      }
    }
}

/* ---- Settling ----------------------------------------------------------------------------
 *
 * The planes meet near the surface, on it only if it is flat on both sides.
 * Vertices are certified roots: creases settle along their normals.  A sharp edge
 * may pass by the corners of its cell unseen, so that the crease belongs into a
 * cell next to it; it may settle there, close to where the planes meet, unless
 * that cell has triangles of its own to fold over.  Else it settles in its own
 * cell, as close to the edge as it gets. */

/* How a block settles: with the program of the brick that holds the places, in
 * its frame. */
typedef struct settling {
  const finding *finding;
  const zs_brick *holder;
  const space *space;
  bool around;      /* in the cells around, too */
  zs_frame frame;   /* of the holder */
  float shift[3];   /* from the brick's frame to it */
  float lo[3], hi[3]; /* the holder, in the brick's frame */
  float near;
} settling;

/* Where a crease may settle. */
static void room_of(const settling *s, const zs_crease *crease, float lo[3], float hi[3])
{
  space_of(s->space, crease->cell, lo, hi);
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
      reach = smaller(reach, ((step[k] > 0 ? hi[k] : lo[k]) - from[k]) / step[k]);
  }
  for (int k = 0; k < 3; k++)
    end[k] = from[k] + larger(reach, 0) * step[k];
  clamp(end, lo, hi);
}

/* The ends of the block's lines, and f there. */
static void look(const settling *s)
{
  zs_polygonize_worker *worker = s->finding->worker;
  finder *w = worker->scratch;
  for (int end = 0; end < 2; end++) {
    for (unsigned i = 0; i < w->block; i++) {
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
    zs_program_values(worker->eval, s->holder->program, &s->frame, w->block, w->at[0], w->at[1],
                      w->at[2], w->f[end]);
    worker->evaluations += w->block;
  }
}

/* Whether the corners of a cell, by lattice index, have different signs. */
static bool holds_surface(const zs_polygonize_job *job, const uint32_t cell[3])
{
  unsigned inside = zs_lattice_cell_case(job, cell);
  return inside != 0 && inside != ZS_CELL_CASES - 1;
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
    int local = local_cell(s->finding->job, k, place[k]);
    own = own && local == (crease->cell >> 4 * k & (ZS_BRICK - 1));
    at[k] = (uint32_t)((int64_t)zs_lattice_index(s->finding->brick, k, 0) + local);
  }
  return square <= s->near * s->near && (own || !holds_surface(s->finding->job, at));
}

/* Settle a block: creases with a sign change on their line move to it. */
static void settle(const settling *s)
{
  zs_polygonize_worker *worker = s->finding->worker;
  finder *w = worker->scratch;
  look(s);
  w->roots.count = 0;
  for (unsigned i = 0; i < w->block; i++) {
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
  worker->evaluations += zs_roots_solve(&w->roots, worker->eval, s->holder->program, &s->frame,
                                        (float)s->finding->job->tolerance, 0);
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
  w->block = 0;
}

enum { OWN = 13 /* of the bricks around: 9 z + 3 y + x, each 0 .. 2 */ };

/* Which of the bricks around the brick, or itself, holds the place from which a
 * crease sets out. */
static unsigned holder_of(const finding *s, const zs_crease *crease)
{
  const finder *w = s->worker->scratch;
  unsigned number = 0;
  float lo[3], hi[3], from[3];
  memcpy(from, crease->place, sizeof from);
  space_of(&w->around, crease->cell, lo, hi);
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
  const zs_polygonize_job *job = s->finding->job;
  uint32_t index[3];
  for (int k = 0; k < 3; k++, neighbour /= 3) {
    const float side = (float)(job->cell[k] * ZS_BRICK);
    const int step = (int)(neighbour % 3) - 1;
    index[k] = s->finding->brick->index[k] + (uint32_t)step; /* below 0: no brick's index */
    s->shift[k] = -(float)step * side;
    s->lo[k] = ((float)step - 0.5f) * side;
    s->hi[k] = ((float)step + 0.5f) * side;
  }
  s->holder = zs_lattice_brick(job, index);
  if (!s->holder->sampled)
    return false;
  s->frame = zs_brick_frame(job, s->holder);
  return true;
}

/* Settle those creases that have not yet and whose place one brick holds; any
 * place will do when they have to stay in their cells. */
static void settle_in(settling *s, unsigned neighbour)
{
  finder *w = s->finding->worker->scratch;
  if (!turn_to(s, neighbour))
    return;
  w->block = 0;
  for (uint32_t i = 0; i < w->count; i++) {
    if (w->found[i].settled || (s->around && w->holder[i] != neighbour))
      continue;
    w->crease[w->block++] = &w->found[i];
    if (w->block == ZS_BLOCK)
      settle(s);
  }
  if (w->block)
    settle(s);
}

static void settle_all(const finding *s)
{
  const double *cell = s->job->cell;
  finder *w = s->worker->scratch;
  settling in = {.finding = s, .around = true, .space = &w->around};
  in.near = NEAR * (float)fmin(cell[0], fmin(cell[1], cell[2]));
  uint32_t holders = 0;
  for (uint32_t i = 0; i < w->count; i++) {
    w->holder[i] = (uint8_t)holder_of(s, &w->found[i]);
    holders |= 1u << w->holder[i];
  }
  for (; holders; holders &= holders - 1)
    settle_in(&in, (unsigned)__builtin_ctz(holders));
  in.around = false;
  in.space = &w->own;
  settle_in(&in, OWN);
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
      brick->creases[brick->crease_count++] = w->found[i];
}

static void visit_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  finding s = {.job = job, .worker = worker, .brick = brick};
  finder *w = worker->scratch;
  if (is_smooth(job, brick))
    return;
  s.frame = zs_brick_frame(job, brick);
  w->count = 0;
  find_creases(&s, &job->cases);
  if (!w->count)
    return;
  fill_spaces(&s);
  settle_all(&s);
  keep_settled(&s, brick);
}

/* ---- The stage ------------------------------------------------------------------------------ */

static bool find_all(zs_polygonize_job *job)
{
  finder *scratch = aligned_alloc(64, job->threads * sizeof *scratch);
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
