/* How creases settle.
 *
 * The planes meet near the surface, on it only if it is flat on both sides.
 * Vertices are certified roots: creases settle along their normals.  A sharp edge
 * may pass by the corners of its cell unseen, so that the crease belongs into a
 * cell next to it; it may settle there, close to where the planes meet, unless
 * that cell has triangles of its own to fold over.  Else it settles in its own
 * cell, as close to the edge as it gets. */
#include "output/polygonize_creases.h"

#include <math.h>
#include <string.h>

ZS_DECLARE_VARIANTS(zs_crease_kernels, zs_crease_kernels)
static const zs_crease_kernels *const kernels[ZS_ISA_COUNT] = ZS_VARIANTS(zs_crease_kernels, );

const zs_crease_kernels *zs_crease_kernels_of(zs_isa_kind isa)
{
  return kernels[isa];
}

/* A crease settles within this part of a cell, or the planes said little. */
static const float NEAR = 0.15f;

/* How blocks settle: with the program of the brick that holds their places, in
 * its frame. */
typedef struct settler {
  const zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  const zs_brick *brick, *holder;
  const zs_crease_kernels *kernels;
  zs_found *found;
  uint32_t count;
  zs_settling *block;
  bool around;      /* in the cells around, too */
  zs_frame frame;   /* of the holder */
  float shift[3];   /* from the brick's frame to it */
  float lowest[3], highest[3]; /* a little off the grid's faces, in the brick's frame */
  float near;
  zs_room room;
} settler;

/* f at places of the block. */
static void evaluate(const settler *s, const float place[3][ZS_BLOCK], float f[ZS_BLOCK])
{
  zs_settling *b = s->block;
  for (int k = 0; k < 3; k++) {
    const float shift = s->shift[k];
#pragma omp simd
    for (unsigned i = 0; i < b->count; i++)
      b->at[k][i] = place[k][i] + shift;
  }
  zs_program_values(s->worker->eval, s->holder->program, &s->frame, b->count, b->at[0], b->at[1],
                    b->at[2], f);
  s->worker->evaluations += b->count;
}

static bool changes_sign(const zs_settling *b, unsigned i)
{
  return (b->f_from[i] >= 0) != (b->f_to[i] >= 0);
}

/* ---- Where creases may settle ------------------------------------------------------- */

/* Corner of a crease's cell, from the brick's frame, in cells. */
static int corner_of(const zs_crease *crease, int axis)
{
  return (crease->cell >> 4 * axis & (ZS_BRICK - 1)) - ZS_BRICK / 2;
}

/* Whether the corners of a cell, by lattice index, have different signs. */
static bool holds_surface(const zs_polygonize_job *job, const uint32_t cell[3])
{
  unsigned inside = zs_lattice_cell_case(job, cell);
  return inside != 0 && inside != ZS_CELL_CASES - 1;
}

/* Whether a crease may settle in a place around its cell. */
static bool accept(const settler *s, const zs_crease *crease, const float place[3])
{
  uint32_t at[3];
  float square = 0;
  bool own = true;
  for (int k = 0; k < 3; k++) {
    const float moved = place[k] - crease->place[k];
    const int cell = (int)floor(place[k] / s->job->cell[k]);
    square += moved * moved;
    own = own && cell == corner_of(crease, k);
    at[k] = zs_lattice_index(s->brick, k, ZS_BRICK / 2) + (uint32_t)cell;
  }
  return square <= s->near * s->near && (own || !holds_surface(s->job, at));
}

static void keep(const settler *s, unsigned i, const float place[3])
{
  zs_found *found = &s->found[s->block->number[i]];
  if (s->around && !accept(s, &found->crease, place))
    return;
  memcpy(found->crease.place, place, sizeof found->crease.place);
  found->settled = true;
}

/* ---- Blocks -------------------------------------------------------------------------- */

/* Where the surface is flat on both sides, the place itself is certified by the
 * sign next to it.  Creases for which it is not stay in the block. */
static void settle_at_once(const settler *s)
{
  zs_settling *b = s->block;
  unsigned left = 0;
  s->kernels->lines(b, (float)s->job->tolerance);
  evaluate(s, (const float(*)[ZS_BLOCK])b->to, b->f_to);
  for (unsigned i = 0; i < b->count; i++) {
    if (changes_sign(b, i)) {
      keep(s, i, (const float[3]){b->from[0][i], b->from[1][i], b->from[2][i]});
      continue;
    }
    b->number[left] = b->number[i];
    b->f_from[left] = b->f_from[i];
    for (int k = 0; k < 3; k++) {
      b->normal[k][left] = b->normal[k][i];
      b->from[k][left] = b->from[k][i];
      b->lo[k][left] = b->lo[k][i];
      b->hi[k][left] = b->hi[k][i];
    }
    left++;
  }
  b->count = left;
}

/* Creases with a sign change on their line move to it. */
static void settle_on_lines(const settler *s)
{
  zs_settling *b = s->block;
  s->kernels->lines(b, s->around ? s->near : INFINITY);
  evaluate(s, (const float(*)[ZS_BLOCK])b->to, b->f_to);
  b->roots.count = 0;
  for (unsigned i = 0; i < b->count; i++) {
    if (!changes_sign(b, i))
      continue;
    float from[3], to[3];
    for (int k = 0; k < 3; k++) {
      from[k] = b->from[k][i] + s->shift[k];
      to[k] = b->to[k][i] + s->shift[k];
    }
    b->line[b->roots.count] = (uint16_t)i;
    if (b->f_from[i] >= 0)
      zs_roots_add(&b->roots, from, to, b->f_from[i], b->f_to[i]);
    else
      zs_roots_add(&b->roots, to, from, b->f_to[i], b->f_from[i]);
  }
  s->worker->evaluations += zs_roots_solve(&b->roots, s->worker->eval, s->holder->program,
                                           &s->frame, (float)s->job->tolerance, 0);
  for (unsigned i = 0; i < b->roots.count; i++) {
    float place[3];
    for (int k = 0; k < 3; k++)
      place[k] = b->roots.found[k][i] - s->shift[k];
    keep(s, b->line[i], place);
  }
}

static void settle_block(const settler *s)
{
  zs_settling *b = s->block;
  s->kernels->rooms(b, &s->room);
  evaluate(s, (const float(*)[ZS_BLOCK])b->from, b->f_from);
  settle_at_once(s);
  if (b->count)
    settle_on_lines(s);
  b->count = 0;
}

/* ---- Bricks -------------------------------------------------------------------------- */

static float limited(float x, float lo, float hi)
{
  return fminf(fmaxf(x, lo), hi);
}

enum { OWN = 13 /* of the bricks around: 9 z + 3 y + x, each 0 .. 2 */ };

/* Which of the bricks around the brick, or itself, holds a place. */
static uint8_t holder_of(const settler *s, const float place[3])
{
  int number = 0;
  for (int k = 2; k >= 0; k--) {
    const float half = (float)(s->job->cell[k] * ZS_BRICK / 2);
    const float at = limited(place[k], s->lowest[k], s->highest[k]);
    number = 3 * number + (at < -half ? 0 : at < half ? 1 : 2);
  }
  return (uint8_t)number;
}

/* How far creases stay from the sides of their cells and from the grid's faces. */
static double margin_of(const zs_polygonize_job *job)
{
  return fmin(job->apart, fmin(job->cell[0], fmin(job->cell[1], job->cell[2])) / 4);
}

static void find_limits(settler *s)
{
  const zs_frame frame = zs_brick_frame(s->job, s->brick);
  const double margin = margin_of(s->job);
  for (int k = 0; k < 3; k++) {
    const double last = zs_lattice_place(s->job, k, s->job->corners[k]);
    s->lowest[k] = (float)(zs_lattice_place(s->job, k, 0) + margin - frame.origin[k]);
    s->highest[k] = (float)(last - margin - frame.origin[k]);
  }
}

/* Turn to one of the bricks around; false when it has no surface. */
static bool turn_to(settler *s, unsigned neighbour)
{
  const zs_polygonize_job *job = s->job;
  const float margin = (float)margin_of(job);
  uint32_t index[3];
  for (int k = 0; k < 3; k++, neighbour /= 3) {
    const float cell = (float)job->cell[k], side = (float)(job->cell[k] * ZS_BRICK);
    const int step = (int)(neighbour % 3) - 1;
    index[k] = s->brick->index[k] + (uint32_t)step; /* below 0: no brick's index */
    s->shift[k] = -(float)step * side;
    s->room.side[k] = cell;
    s->room.below[k] = s->around ? cell : -margin;
    s->room.above[k] = s->around ? 2 * cell : cell - margin;
    s->room.first[k] = limited(((float)step - 0.5f) * side, s->lowest[k], s->highest[k]);
    s->room.last[k] = limited(((float)step + 0.5f) * side, s->lowest[k], s->highest[k]);
  }
  s->holder = zs_lattice_brick(job, index);
  if (!s->holder->sampled)
    return false;
  s->frame = zs_brick_frame(job, s->holder);
  return true;
}

/* Settle those creases that have not yet and whose place one brick holds; any
 * place will do when they have to stay in their cells. */
static void settle_in(settler *s, unsigned neighbour)
{
  zs_settling *b = s->block;
  if (!turn_to(s, neighbour))
    return;
  b->count = 0;
  for (uint32_t i = 0; i < s->count; i++) {
    const zs_crease *crease = &s->found[i].crease;
    if (s->found[i].settled || (s->around && s->found[i].holder != neighbour))
      continue;
    for (int k = 0; k < 3; k++) {
      b->corner[k][b->count] = (float)corner_of(crease, k);
      b->place[k][b->count] = crease->place[k];
      b->normal[k][b->count] = crease->normal[k];
    }
    b->number[b->count++] = (uint16_t)i;
    if (b->count == ZS_BLOCK)
      settle_block(s);
  }
  if (b->count)
    settle_block(s);
}

void zs_creases_settle(const zs_polygonize_job *job, zs_polygonize_worker *worker,
                       const zs_brick *brick, zs_found *found, uint32_t count,
                       zs_settling *scratch)
{
  const double *cell = job->cell;
  settler s = {.job = job,
               .worker = worker,
               .brick = brick,
               .kernels = zs_crease_kernels_of(zs_eval_isa(worker->eval)),
               .found = found,
               .count = count,
               .block = scratch,
               .around = true};
  s.near = NEAR * (float)fmin(cell[0], fmin(cell[1], cell[2]));
  find_limits(&s);
  uint32_t holders = 0;
  for (uint32_t i = 0; i < count; i++) {
    found[i].holder = holder_of(&s, found[i].crease.place);
    holders |= 1u << found[i].holder;
  }
  for (; holders; holders &= holders - 1)
    settle_in(&s, (unsigned)__builtin_ctz(holders));
  s.around = false;
  settle_in(&s, OWN);
}
