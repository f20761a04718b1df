/* The polygonizer's first stage: which bricks hold surface, and their samples. */
#include "output/polygonize.h"
#include "output/polygonize_rows.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A slope measured from neighbouring samples may be this much too small. */
static const float SLOPE_MARGIN = 2;

typedef struct sampler {
  _Alignas(64) float before[ZS_BRICK]; /* see zs_row_kernels */
  float f[ZS_BRICK_CORNERS + ZS_BRICK_ROWS + ZS_BRICK];
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float result[4][ZS_BLOCK]; /* f and its gradient */
  zs_row_bits real;                       /* corners that are not pads */
  zs_row_bits crossing[3];                /* starts of edges within the brick */
  float inner[ZS_BRICK_EDGES + ZS_EDGE_RUN], outer[ZS_BRICK_EDGES + ZS_EDGE_RUN]; /* their ends */
  uint16_t corner[ZS_BLOCK];              /* candidates for a move */
  unsigned candidates;
  zs_moved moved[ZS_BRICK_CORNERS];
  uint32_t moved_count;
} sampler;

/* What one brick is sampled with. */
typedef struct sampling {
  const zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  zs_brick *brick;
  zs_corner_box real;
  zs_eval *eval;
  const zs_program *program;
  const zs_row_kernels *rows;
  zs_frame frame;
  float per_cell[3]; /* 1 / side of a cell */
  float reach;       /* how far from the surface corners are kept */
} sampling;

static size_t table_place(const zs_polygonize_job *job, const uint32_t index[3])
{
  return ((size_t)index[2] * job->bricks[1] + index[1]) * job->bricks[0] + index[0];
}

const zs_brick *zs_lattice_brick(const zs_polygonize_job *job, const uint32_t index[3])
{
  for (int k = 0; k < 3; k++)
    if (index[k] >= job->bricks[k])
      return &job->outside;
  return job->table[table_place(job, index)];
}

const zs_brick *zs_brick_upper(const zs_polygonize_job *job, const zs_brick *brick, unsigned d)
{
  uint32_t at[3];
  for (int k = 0; k < 3; k++)
    at[k] = brick->index[k] + (d >> k & 1);
  return d ? zs_lattice_brick(job, at) : brick;
}

bool zs_brick_real_corners(const zs_polygonize_job *job, const uint32_t index[3],
                           zs_corner_box *real)
{
  for (int k = 0; k < 3; k++) {
    uint32_t first = index[k] * ZS_BRICK, end = job->corners[k] - 1;
    real->lo[k] = first == 0;
    real->hi[k] = end <= first ? 0 : end - first < ZS_BRICK ? end - first : ZS_BRICK;
    if (real->lo[k] >= real->hi[k])
      return false;
  }
  return true;
}

unsigned zs_corner_box_row(const zs_corner_box *box, unsigned row)
{
  unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
  if (y < box->lo[1] || y >= box->hi[1] || z < box->lo[2] || z >= box->hi[2])
    return 0;
  return ((1u << box->hi[0]) - 1) & ~((1u << box->lo[0]) - 1);
}

zs_frame zs_brick_frame(const zs_polygonize_job *job, const zs_brick *brick)
{
  double origin[3];
  for (int k = 0; k < 3; k++)
    origin[k] = job->lo[k] + job->cell[k] * ((double)brick->index[k] * ZS_BRICK + ZS_BRICK / 2 - 1);
  return zs_frame_at(origin);
}

/* ---- Samples -------------------------------------------------------------------- */

/* The corners that are not pads.  Where bounds know the sign of a corner they
 * stand for its value: no closer to the surface than it is. */
static void sample_corners(const sampling *s)
{
  sampler *w = s->worker->scratch;
  const unsigned *lo = s->real.lo;
  zs_lattice lattice = {.frame = s->frame};
  for (unsigned k = 0; k < 3; k++) {
    lattice.count[k] = s->real.hi[k] - lo[k];
    for (unsigned i = 0; i < lattice.count[k]; i++)
      lattice.at[k][i] = zs_brick_place(s->job, (int)k, lo[k] + i);
  }
  const bool prune = !s->job->control || !s->job->control->brute;
  s->worker->evaluations +=
    zs_program_lattice(s->eval, s->program, &lattice, ZS_REQUEST_SIGN, prune,
                       w->f + (lo[2] * ZS_BRICK + lo[1]) * ZS_BRICK + lo[0]);
}

static unsigned clamped(unsigned i, unsigned lo, unsigned hi)
{
  return i < lo ? lo : i >= hi ? hi - 1 : i;
}

/* Give pads the values of their neighbours. */
static void fill_pads(const sampling *s)
{
  sampler *w = s->worker->scratch;
  const zs_corner_box *real = &s->real;
  for (unsigned corner = 0; corner < ZS_BRICK_CORNERS; corner++) {
    const unsigned x = clamped(corner % ZS_BRICK, real->lo[0], real->hi[0]);
    const unsigned y = clamped(corner / ZS_BRICK % ZS_BRICK, real->lo[1], real->hi[1]);
    const unsigned z = clamped(corner / ZS_BRICK_ROWS, real->lo[2], real->hi[2]);
    w->f[corner] = w->f[(z * ZS_BRICK + y) * ZS_BRICK + x];
  }
}

static bool has_pads(const zs_corner_box *real)
{
  bool pads = false;
  for (int k = 0; k < 3; k++)
    pads = pads || real->lo[k] > 0 || real->hi[k] < ZS_BRICK;
  return pads;
}

/* All corners, and which edges between them cross the surface. */
static void sample_brick(const sampling *s)
{
  sampler *w = s->worker->scratch;
  sample_corners(s);
  const bool pads = has_pads(&s->real);
  if (pads)
    fill_pads(s);
  s->rows->signs(w->f, s->brick->signs);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    w->real[row] = pads ? (uint16_t)zs_corner_box_row(&s->real, row) : 0xffff;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    s->brick->signs[row] &= w->real[row];
  s->rows->inner(s->brick->signs, w->real, w->crossing);
}

/* ---- Corner repulsion -------------------------------------------------------------
 *
 * Where the surface passes close to a corner of the lattice, the edges that
 * meet there are cut close to it, and the triangles between the cuts are
 * slivers.  Moving the corner away along the gradient before the edges are cut
 * changes no sign, hence no connection.  (After C. Dietrich et al., "Edge
 * transformations for improving mesh quality of marching cubes", 2009, which
 * calls it the gradient transformation.) */

/* How far from the surface corners are kept. */
static float repulsion(const zs_polygonize_job *job)
{
  return ZS_REPULSION * (float)fmin(job->cell[0], fmin(job->cell[1], job->cell[2]));
}

static bool inside(float f)
{
  return f >= 0;
}

static void corner_place(const sampling *s, unsigned corner, float place[3])
{
  place[0] = zs_brick_place(s->job, 0, corner % ZS_BRICK);
  place[1] = zs_brick_place(s->job, 1, corner / ZS_BRICK % ZS_BRICK);
  place[2] = zs_brick_place(s->job, 2, corner / ZS_BRICK_ROWS);
}

static void fill_places(const sampling *s)
{
  sampler *w = s->worker->scratch;
  for (unsigned i = 0; i < w->candidates; i++) {
    float place[3];
    corner_place(s, w->corner[i], place);
    for (int k = 0; k < 3; k++)
      w->at[k][i] = place[k];
  }
}

/* From gradients to moves: candidates that are close get their offset, the
 * others leave the list. */
static void choose_moves(const sampling *s, float offset[3][ZS_BLOCK])
{
  sampler *w = s->worker->scratch;
  _Alignas(64) float step[ZS_BLOCK];
  s->rows->steps(w->candidates, w->result[0], (const float(*)[ZS_BLOCK])w->result + 1, s->reach, step);
  unsigned kept = 0;
  for (unsigned i = 0; i < w->candidates; i++) {
    if (step[i] == 0)
      continue;
    for (int k = 0; k < 3; k++)
      offset[k][kept] = step[i] * w->result[1 + k][i];
    w->corner[kept++] = w->corner[i];
  }
  w->candidates = kept;
}

/* Try the moves: they count where the field agrees that they lead away. */
static void move_candidates(const sampling *s)
{
  sampler *w = s->worker->scratch;
  float offset[3][ZS_BLOCK];
  if (!w->candidates)
    return;
  fill_places(s);
  zs_program_gradients(s->eval, s->program, &s->frame, w->candidates, w->at[0], w->at[1], w->at[2],
                       w->result[0]);
  s->worker->evaluations += w->candidates;
  choose_moves(s, offset);
  fill_places(s);
  for (int k = 0; k < 3; k++)
    for (unsigned i = 0; i < w->candidates; i++)
      w->at[k][i] += offset[k][i];
  zs_program_values(s->eval, s->program, &s->frame, w->candidates, w->at[0], w->at[1], w->at[2],
                    w->result[0]);
  s->worker->evaluations += w->candidates;
  for (unsigned i = 0; i < w->candidates; i++) {
    float *f = &w->f[w->corner[i]], moved = w->result[0][i];
    if (inside(moved) != inside(*f) || !(fabsf(moved) > fabsf(*f)))
      continue;
    *f = moved;
    w->moved[w->moved_count++] =
      (zs_moved){w->corner[i], {offset[0][i], offset[1][i], offset[2][i]}};
  }
  w->candidates = 0;
}

/* Corners on the grid's faces stay, so that caps stay flat. */
static void repel(const sampling *s)
{
  sampler *w = s->worker->scratch;
  zs_corner_box free = s->real;
  zs_row_bits close;
  w->candidates = w->moved_count = 0;
  if (s->job->features) /* its vertices lie within cells, wherever edges are cut */
    return;
  for (int k = 0; k < 3; k++) {
    free.lo[k] += zs_lattice_on_face(s->job, k, zs_lattice_index(s->brick, k, free.lo[k]));
    if (free.hi[k] > free.lo[k])
      free.hi[k] -= zs_lattice_on_face(s->job, k, zs_lattice_index(s->brick, k, free.hi[k] - 1));
  }
  s->rows->close(w->f, (const zs_row_bits *)w->crossing, s->per_cell, SLOPE_MARGIN * s->reach,
                 close);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned bits = close[row] ? close[row] & zs_corner_box_row(&free, row) : 0; bits;
         bits &= bits - 1) {
      w->corner[w->candidates++] = (uint16_t)(row * ZS_BRICK + (unsigned)__builtin_ctz(bits));
      if (w->candidates == ZS_BLOCK)
        move_candidates(s);
    }
  move_candidates(s);
}

/* ---- What is kept of a brick ------------------------------------------------------- */

/* Keep the values at the ends of the crossing edges within the brick.  False
 * when memory is out. */
static bool keep_ends(const sampling *s)
{
  sampler *w = s->worker->scratch;
  const unsigned count = s->rows->ends(w->f, (const zs_row_bits *)w->crossing,
                                       &s->job->bit_table, w->inner, w->outer);
  const size_t room = 2 * (size_t)count + ZS_EDGE_RUN; /* whole runs are read */
  float *ends = zs_arena_reserve(&s->worker->ends, room, sizeof *ends);
  if (!ends)
    return false;
  memcpy(ends, w->inner, count * sizeof *ends);
  memcpy(ends + count, w->outer, count * sizeof *ends);
  memset(ends + 2 * (size_t)count, 0, ZS_EDGE_RUN * sizeof *ends);
  s->brick->ends = ends;
  s->brick->end_count = count;
  return true;
}

static bool keep_moved(const sampling *s)
{
  const sampler *w = s->worker->scratch;
  if (!w->moved_count)
    return true;
  zs_moved *moved = zs_arena_reserve(&s->worker->arena, w->moved_count, sizeof *moved);
  if (!moved)
    return false;
  memcpy(moved, w->moved, w->moved_count * sizeof *moved);
  s->brick->moved = moved;
  s->brick->moved_count = w->moved_count;
  return true;
}

/* ---- The walk ------------------------------------------------------------------------ */

static bool over_limit(const zs_polygonize_job *job, const zs_polygonize_worker *worker)
{
  const uint64_t bytes = worker->arena.bytes + worker->ends.bytes +
                         job->programs[worker - job->workers].bytes;
  return !zs_control_allows(job->control, (double)(job->used_bytes + bytes * job->threads));
}

static void visit_brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                        const zs_program *program)
{
  zs_polygonize_job *job = visitor;
  zs_polygonize_worker *worker = &job->workers[thread];
  sampling s = {.job = job, .worker = worker, .eval = eval, .program = program};
  if (worker->out_of_memory || !zs_brick_real_corners(job, index, &s.real))
    return;
  s.brick = ZS_ARENA_NEW(&worker->arena, zs_brick, 1);
  if (!s.brick || over_limit(job, worker)) {
    worker->out_of_memory = true;
    return;
  }
  memcpy(s.brick->index, index, sizeof s.brick->index);
  s.brick->program = program;
  s.brick->sampled = true;
  s.brick->at_face = zs_brick_at_face(job, index);
  s.frame = zs_brick_frame(job, s.brick);
  s.reach = repulsion(job);
  for (int k = 0; k < 3; k++)
    s.per_cell[k] = (float)(1 / job->cell[k]);
  s.rows = zs_row_kernels_of(zs_eval_isa(eval));
  sample_brick(&s);
  repel(&s);
  if (!keep_moved(&s) || !keep_ends(&s))
    worker->out_of_memory = true;
  job->table[table_place(job, index)] = s.brick;
}

static void visit_uniform(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool within)
{
  zs_polygonize_job *job = visitor;
  uint32_t at[3];
  if (!within)
    return;
  for (at[2] = lo[2]; at[2] < hi[2]; at[2]++)
    for (at[1] = lo[1]; at[1] < hi[1]; at[1]++)
      for (at[0] = lo[0]; at[0] < hi[0]; at[0]++)
        job->table[table_place(job, at)] = &job->inside;
}

/* Pads lie on the grid's faces; for the walk they lie where they would as cells,
 * which makes the outermost bricks a little larger than they have to be.  Corners
 * shared by bricks can be moved out of either one. */
static bool run_walk(zs_polygonize_job *job)
{
  zs_walk walk = {
    .field = job->field,
    .request = ZS_REQUEST_SIGN, /* all that follows happens at the surface */
    .control = job->control,
    .stage = "sample",
    .progress_from = 0,
    .progress_to = 0.5,
    .visitor = job,
    .programs = job->programs,
    .uniform = visit_uniform,
    .brick = visit_brick,
  };
  const double rounding = 1e-3;
  for (int k = 0; k < 3; k++) {
    walk.lo[k] = job->lo[k] - job->cell[k];
    walk.size[k] = job->cell[k] * ZS_BRICK;
    walk.count[k] = job->bricks[k];
    walk.margin[k] = job->features ? 0 : (1 + rounding) * repulsion(job);
  }
  return zs_walk_run(&walk, job->diag);
}

static bool sample(zs_polygonize_job *job)
{
  sampler *scratch = aligned_alloc(64, job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++) {
    memset(scratch[t].before, 0, sizeof scratch[t].before);
    memset(scratch[t].f, 0, sizeof scratch[t].f);
    job->workers[t].scratch = &scratch[t];
  }
  bool done = run_walk(job);
  free(scratch);
  for (unsigned t = 0; done && t < job->threads; t++)
    if (job->workers[t].out_of_memory)
      return zs_fail(job->diag, ZS_ERROR_MEMORY, NULL,
                     "the samples do not fit into memory; try a lower resolution");
  return done;
}

/* ---- From the walk's findings to a consistent lattice -------------------------------- */

/* The thirteen neighbours that come later in the table's order. */
static const int8_t LATER[13][3] = {{1, 0, 0},   {-1, 1, 0}, {0, 1, 0},  {1, 1, 0},  {-1, -1, 1},
                                    {0, -1, 1},  {1, -1, 1}, {-1, 0, 1}, {0, 0, 1},  {1, 0, 1},
                                    {-1, 1, 1},  {0, 1, 1},  {1, 1, 1}};

/* Two touching bricks that bounds proved to be inside and outside cannot be:
 * an enclosure of the field is wrong, and so would be the mesh. */
static bool check_bounds(const zs_polygonize_job *job)
{
  zs_corner_box real;
  uint32_t at[3];
  for (at[2] = 0; at[2] < job->bricks[2]; at[2]++)
    for (at[1] = 0; at[1] < job->bricks[1]; at[1]++)
      for (at[0] = 0; at[0] < job->bricks[0]; at[0]++) {
        const zs_brick *brick = job->table[table_place(job, at)];
        if ((brick != &job->inside && brick != &job->outside) || !zs_brick_real_corners(job, at, &real))
          continue;
        for (unsigned d = 0; d < 13; d++) {
          uint32_t to[3];
          for (int k = 0; k < 3; k++)
            to[k] = (uint32_t)((int64_t)at[k] + LATER[d][k]); /* below 0: no brick's index */
          const zs_brick *other = zs_lattice_brick(job, to);
          if (other != brick && (other == &job->inside || other == &job->outside) &&
              to[0] < job->bricks[0] && to[1] < job->bricks[1] && to[2] < job->bricks[2] &&
              zs_brick_real_corners(job, to, &real))
            return zs_fail(job->diag, ZS_ERROR_UNABLE, NULL,
                           "the bounds of the field contradict each other near %g %g %g; "
                           "evaluating every sample (--brute) does without them",
                           zs_lattice_place(job, 0, at[0] * ZS_BRICK),
                           zs_lattice_place(job, 1, at[1] * ZS_BRICK),
                           zs_lattice_place(job, 2, at[2] * ZS_BRICK));
        }
      }
  return true;
}

/* A brick proven to be inside, at a face of the grid: the cap needs its signs. */
static bool make_cap_brick(zs_polygonize_job *job, const uint32_t index[3])
{
  zs_brick *brick = ZS_ARENA_NEW(&job->workers[0].arena, zs_brick, 1);
  if (!brick)
    return zs_fail_memory(job->diag);
  memcpy(brick->index, index, sizeof brick->index);
  brick->at_face = true;
  zs_corner_box real;
  zs_brick_real_corners(job, index, &real); /* it holds corners that are not pads */
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    brick->signs[row] = (uint16_t)zs_corner_box_row(&real, row);
  job->table[table_place(job, index)] = brick;
  return true;
}

/* Give bricks at the grid's faces data of their own, and list all that have. */
static bool list_active(zs_polygonize_job *job)
{
  zs_corner_box real;
  uint32_t at[3];
  size_t total = (size_t)job->bricks[0] * job->bricks[1] * job->bricks[2];
  for (at[2] = 0; at[2] < job->bricks[2]; at[2]++)
    for (at[1] = 0; at[1] < job->bricks[1]; at[1]++)
      for (at[0] = 0; at[0] < job->bricks[0]; at[0]++) {
        const zs_brick **entry = &job->table[table_place(job, at)];
        if (!zs_brick_real_corners(job, at, &real))
          *entry = &job->outside;
        else if (*entry == &job->inside && zs_brick_at_face(job, at) && !make_cap_brick(job, at))
          return false;
        job->active_count += *entry != &job->inside && *entry != &job->outside;
      }
  job->active = malloc((job->active_count + 1) * sizeof(*job->active));
  if (!job->active)
    return zs_fail_memory(job->diag);
  job->active_count = 0;
  for (size_t i = 0; i < total; i++)
    if (job->table[i] != &job->inside && job->table[i] != &job->outside)
      job->active[job->active_count++] = (zs_brick *)job->table[i];
  return true;
}

/* What bounds proved of a neighbour below holds on the shared corners too.
 * Rounding can make a sample there disagree; the proof wins, so that no
 * crossing edge is left without an owner. */
static void obey_neighbours(const zs_polygonize_job *job, zs_brick *brick)
{
  zs_corner_box real;
  zs_brick_real_corners(job, brick->index, &real); /* it holds corners that are not pads */
  for (unsigned d = 1; d < 8; d++) {
    uint32_t at[3];
    bool exists = true;
    for (int k = 0; k < 3; k++) {
      unsigned step = d >> k & 1;
      exists = exists && brick->index[k] >= step;
      at[k] = brick->index[k] - step;
    }
    if (!exists)
      continue;
    const zs_brick *below = zs_lattice_brick(job, at);
    if (below->sampled)
      continue;
    unsigned bits = d & 1 ? 1 : 0xffff;
    for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
      if ((d & 2 && row % ZS_BRICK) || (d & 4 && row / ZS_BRICK))
        continue;
      unsigned proven = below == &job->outside ? 0 : zs_corner_box_row(&real, row);
      unsigned signs = (brick->signs[row] & ~bits) | (proven & bits);
      if (signs != brick->signs[row])
        brick->ends = NULL;
      brick->signs[row] = (uint16_t)signs;
    }
  }
}

bool zs_polygonize_sample(zs_polygonize_job *job)
{
  if (!sample(job) || !check_bounds(job) || !list_active(job))
    return false;
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++)
    obey_neighbours(job, job->active[i]);
  return true;
}
