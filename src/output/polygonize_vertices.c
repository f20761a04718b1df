/* The polygonizer's vertices: certified roots along the edges, and normals. */
#include "output/polygonize.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where edges start and end, and what is known of f along them.  A bracket is a
 * part of an edge, low .. low + width in units of the edge, whose lower end is
 * inside and whose upper end is outside. */
enum {
  FROM_X, FROM_Y, FROM_Z, /* the inner end, in the brick's frame */
  ALONG_X, ALONG_Y, ALONG_Z, /* from there to the outer end */
  LOW, WIDTH, F_LOW, F_HIGH,
  SIDE,      /* +1 when the lower end moved last, -1 when the upper did */
  TOLERANCE, /* half the width that is narrow enough */
  LEAST,     /* vertices stay this far from the ends */
  ITEMS
};

typedef struct solver {
  float item[ITEMS][ZS_BLOCK];
  uint16_t slot[ZS_BLOCK]; /* the vertex of the block that an edge is for */
  unsigned pending;        /* edges not solved yet */
  unsigned count;          /* vertices of the block */
  _Alignas(64) float t[ZS_BLOCK];
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float result[4][ZS_BLOCK];
  float found[3][ZS_BLOCK]; /* in the brick's frame */
  uint32_t number[ZS_BLOCK];
  /* By corner within reach: 1 + its place in `moves`, 0 for those not moved. */
  uint16_t move_of[ZS_REACH][ZS_REACH][ZS_REACH];
  const zs_moved *moves[ZS_REACH * ZS_REACH * ZS_REACH];
} solver;

/* What one brick's vertices are found with. */
typedef struct solving {
  zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  const zs_brick *brick;
  zs_eval *eval;
  const zs_program *program;
  zs_frame frame;
} solving;

/* ---- Roots -------------------------------------------------------------------------- */

/* Rounds after which bisection alone would be done, and a few to spare. */
static int round_limit(float tolerance)
{
  return (int)ceilf(log2f(0.5f / tolerance)) + 3;
}

/* Where the straight line between the ends of a bracket is 0; the middle when
 * the values are no help. */
static float line_root(float low, float width, float f_low, float f_high)
{
  float part = f_low / (f_low - f_high);
  return low + width * (part >= 0 && part <= 1 ? part : 0.5f);
}

/* The next place to look at: the straight line's root, a little beyond so that
 * the bracket closes from the other side too, but never so far from the middle
 * that bisection would have been quicker by then.  (I. Oliveira, R. Takahashi:
 * "An enhancement of the bisection method average performance preserving minmax
 * optimality", 2020, with its projection step.) */
static float next_place(const solver *w, unsigned i, int round)
{
  const float low = w->item[LOW][i], width = w->item[WIDTH][i];
  const float tolerance = w->item[TOLERANCE][i];
  float t = line_root(low, width, w->item[F_LOW][i], w->item[F_HIGH][i]);
  if (round > 0)
    t += w->item[SIDE][i] * 0.9f * tolerance;
  float middle = low + width / 2;
  float reach = fmaxf(0, ldexpf(tolerance, round_limit(tolerance) - round) - width / 2);
  t = fminf(fmaxf(t, middle - reach), middle + reach);
  float gap = fminf(tolerance / 4, width / 2);
  return fminf(fmaxf(t, low + gap), low + width - gap);
}

static void narrow(solver *w, unsigned i, float f)
{
  float t = w->t[i], high = w->item[LOW][i] + w->item[WIDTH][i];
  if (f >= 0) {
    w->item[LOW][i] = t;
    w->item[WIDTH][i] = high - t;
    w->item[F_LOW][i] = f;
    w->item[SIDE][i] = 1;
  } else {
    w->item[WIDTH][i] = t - w->item[LOW][i];
    w->item[F_HIGH][i] = f;
    w->item[SIDE][i] = -1;
  }
}

/* An edge is solved: its vertex is known; the last pending edge takes its
 * place. */
static void finish_edge(solver *w, unsigned i)
{
  float t = line_root(w->item[LOW][i], w->item[WIDTH][i], w->item[F_LOW][i], w->item[F_HIGH][i]);
  t = fminf(fmaxf(t, w->item[LEAST][i]), 1 - w->item[LEAST][i]);
  for (int k = 0; k < 3; k++)
    w->found[k][w->slot[i]] = w->item[FROM_X + k][i] + t * w->item[ALONG_X + k][i];
  unsigned last = --w->pending;
  for (int k = 0; k < ITEMS; k++)
    w->item[k][i] = w->item[k][last];
  w->slot[i] = w->slot[last];
}

/* Close the brackets of a block.  An enclosure of the tolerance's width is
 * reached for any f, continuous or not; a bracket that single precision cannot
 * divide further is closed. */
static void solve(const solving *s)
{
  solver *w = s->worker->scratch;
  for (int round = 0; w->pending; round++) {
    for (unsigned i = 0; i < w->pending; i++) {
      w->t[i] = next_place(w, i, round);
      for (int k = 0; k < 3; k++)
        w->at[k][i] = w->item[FROM_X + k][i] + w->t[i] * w->item[ALONG_X + k][i];
    }
    zs_program_values(s->eval, s->program, &s->frame, w->pending, w->at[0], w->at[1], w->at[2],
                      w->result[0]);
    s->worker->evaluations += w->pending;
    for (unsigned i = 0; i < w->pending; i++)
      narrow(w, i, w->result[0][i]);
    for (unsigned i = w->pending; i-- > 0;)
      if (w->item[WIDTH][i] <= 2 * w->item[TOLERANCE][i])
        finish_edge(w, i);
  }
}

/* ---- Normals -------------------------------------------------------------------------- */

/* Out of the solid, against the gradient; zero when there is none. */
static void unit_normal(const float g[3], float normal[3])
{
  float largest = fmaxf(fabsf(g[0]), fmaxf(fabsf(g[1]), fabsf(g[2])));
  float n[3], square = 0;
  for (int k = 0; k < 3; k++) {
    n[k] = g[k] / largest;
    square += n[k] * n[k];
  }
  float length = sqrtf(square); /* 1 .. sqrt(3), or NaN */
  for (int k = 0; k < 3; k++)
    normal[k] = length >= 1 ? -n[k] / length : 0;
}

static void find_normals(const solving *s)
{
  solver *w = s->worker->scratch;
  for (int k = 0; k < 3; k++)
    memcpy(w->at[k], w->found[k], w->count * sizeof *w->at[k]);
  zs_program_gradients(s->eval, s->program, &s->frame, w->count, w->at[0], w->at[1], w->at[2],
                       w->result[0]);
  s->worker->evaluations += w->count;
  for (unsigned i = 0; i < w->count; i++) {
    float g[3] = {w->result[1][i], w->result[2][i], w->result[3][i]};
    unit_normal(g, s->job->mesh->normals + 3 * (size_t)w->number[i]);
  }
}

/* ---- Edges of a brick ------------------------------------------------------------------ */

/* Solve the edges collected so far and write their vertices. */
static void flush(const solving *s)
{
  solver *w = s->worker->scratch;
  if (!w->count)
    return;
  solve(s);
  for (unsigned i = 0; i < w->count; i++)
    for (int k = 0; k < 3; k++)
      s->job->mesh->positions[3 * (size_t)w->number[i] + (unsigned)k] =
        (float)(s->frame.origin[k] + (double)w->found[k][i]);
  if (s->job->normals)
    find_normals(s);
  w->count = 0;
}

/* Where the corners within reach are moved to, by brick and neighbours. */
static void gather_moves(const solving *s)
{
  solver *w = s->worker->scratch;
  unsigned count = 0;
  memset(w->move_of, 0, sizeof w->move_of);
  for (unsigned d = 0; d < 8; d++) {
    uint32_t at[3];
    for (int k = 0; k < 3; k++)
      at[k] = s->brick->index[k] + (d >> k & 1);
    const zs_brick *owner = d ? zs_lattice_brick(s->job, at) : s->brick;
    for (uint32_t i = 0; i < owner->moved_count; i++) {
      unsigned c[3];
      bool reached = true;
      for (unsigned k = 0; k < 3; k++) {
        c[k] = owner->moved[i].corner >> 4 * k & (ZS_BRICK - 1);
        if (d >> k & 1) {
          reached = reached && c[k] == 0;
          c[k] += ZS_BRICK;
        }
      }
      if (!reached)
        continue;
      w->moves[count] = &owner->moved[i];
      w->move_of[c[2]][c[1]][c[0]] = (uint16_t)++count;
    }
  }
}

static void corner_place(const solving *s, const unsigned c[3], float place[3])
{
  const solver *w = s->worker->scratch;
  unsigned move = w->move_of[c[2]][c[1]][c[0]];
  for (int k = 0; k < 3; k++) {
    place[k] = (float)(s->job->cell[k] * ((double)c[k] - ZS_BRICK / 2));
    if (move)
      place[k] += w->moves[move - 1]->offset[k];
  }
}

/* Collect one edge: `start_inside` says which end is inside, `ends` the values
 * there if known. */
static void add_edge(const solving *s, const unsigned start[3], unsigned axis, bool start_inside,
                     const float ends[2], uint32_t number)
{
  solver *w = s->worker->scratch;
  unsigned end[3] = {start[0], start[1], start[2]};
  float p[3], q[3], square = 0;
  end[axis]++;
  corner_place(s, start_inside ? start : end, p);
  corner_place(s, start_inside ? end : start, q);
  unsigned i = w->pending++;
  for (int k = 0; k < 3; k++) {
    w->item[FROM_X + k][i] = p[k];
    w->item[ALONG_X + k][i] = q[k] - p[k];
    square += (q[k] - p[k]) * (q[k] - p[k]);
  }
  float length = sqrtf(square);
  w->item[LOW][i] = 0;
  w->item[WIDTH][i] = 1;
  w->item[F_LOW][i] = ends ? ends[0] : 1;
  w->item[F_HIGH][i] = ends ? ends[1] : -1;
  w->item[SIDE][i] = 0;
  w->item[TOLERANCE][i] = fminf(0.25f, (float)s->job->tolerance / 2 / length);
  w->item[LEAST][i] = fminf(0.25f, (float)s->job->apart / length);
  w->slot[i] = (uint16_t)w->count;
  w->number[w->count++] = number;
  if (w->count == ZS_BLOCK)
    flush(s);
}

static void visit_brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                        const zs_program *program)
{
  zs_polygonize_job *job = visitor;
  solving s = {.job = job, .worker = &job->workers[thread], .eval = eval, .program = program};
  s.brick = zs_lattice_brick(job, index);
  if (!s.brick->vertex_count)
    return;
  s.frame = zs_brick_frame(job, s.brick);
  gather_moves(&s);
  const float(*ends)[2] = s.brick->ends;
  uint32_t number = (uint32_t)s.brick->first_vertex;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned axis = 0; axis < 3; axis++)
      for (unsigned edges = s.brick->crossing[axis][row]; edges; edges &= edges - 1, number++) {
        unsigned x = (unsigned)__builtin_ctz(edges);
        unsigned start[3] = {x, row % ZS_BRICK, row / ZS_BRICK};
        if (zs_lattice_pad_edge(job, (int)axis, zs_lattice_index(s.brick, (int)axis, start[axis])))
          continue;
        bool within = start[axis] + 1 < ZS_BRICK;
        add_edge(&s, start, axis, s.brick->signs[row] >> x & 1, within && ends ? *ends : NULL,
                 number);
        if (within && ends)
          ends++;
      }
  flush(&s);
}

/* ---- Caps --------------------------------------------------------------------------------- */

/* The vertex of an edge to a pad lies at the corner on the grid's face; its
 * normal is that of the face, or of the faces that meet there. */
static void place_cap_vertex(const zs_polygonize_job *job, const zs_brick *brick,
                             const unsigned start[3], unsigned axis, size_t number)
{
  float normal[3], square = 0;
  for (unsigned k = 0; k < 3; k++) {
    uint32_t i = zs_lattice_index(brick, (int)k, start[k]);
    if (k == axis && i == 0)
      i = 1;
    job->mesh->positions[3 * number + k] = (float)zs_lattice_place(job, (int)k, i);
    normal[k] = i == 1 ? -1 : i == job->corners[k] - 2 ? 1 : 0;
    square += normal[k] * normal[k];
  }
  for (unsigned k = 0; job->normals && k < 3; k++)
    job->mesh->normals[3 * number + k] = normal[k] / sqrtf(square);
}

static void place_caps(const zs_polygonize_job *job, const zs_brick *brick)
{
  size_t number = brick->first_vertex;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned axis = 0; axis < 3; axis++)
      for (unsigned edges = brick->crossing[axis][row]; edges; edges &= edges - 1, number++) {
        unsigned start[3] = {(unsigned)__builtin_ctz(edges), row % ZS_BRICK, row / ZS_BRICK};
        if (zs_lattice_pad_edge(job, (int)axis, zs_lattice_index(brick, (int)axis, start[axis])))
          place_cap_vertex(job, brick, start, axis, number);
      }
}

/* ---- The stage ------------------------------------------------------------------------------ */

static void visit_uniform(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside)
{
  (void)visitor;
  (void)lo;
  (void)hi;
  (void)inside;
}

bool zs_polygonize_vertices(zs_polygonize_job *job)
{
  zs_walk w = {
    .field = job->field,
    .request = ZS_REQUEST_GRADIENT,
    .control = job->control,
    .stage = "vertices",
    .progress_from = 0.5,
    .progress_to = 0.95,
    .visitor = job,
    .uniform = visit_uniform,
    .brick = visit_brick,
  };
  for (int k = 0; k < 3; k++) {
    w.lo[k] = job->lo[k] - job->cell[k];
    w.size[k] = job->cell[k] * ZS_BRICK;
    w.count[k] = job->bricks[k];
  }
  solver *scratch = aligned_alloc(64, job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++) {
    scratch[t].pending = scratch[t].count = 0;
    job->workers[t].scratch = &scratch[t];
  }
  bool done = zs_walk_run(&w, job->diag);
  free(scratch);
  if (!done)
    return false;
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++)
    place_caps(job, job->active[i]);
  return true;
}
