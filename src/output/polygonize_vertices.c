/* The polygonizer's vertices: certified roots along the edges, and normals. */
#include "output/polygonize.h"
#include "output/polygonize_roots.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct solver {
  zs_roots roots;
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float result[4][ZS_BLOCK]; /* f and its gradient */
  uint32_t number[ZS_BLOCK];              /* the vertex of each line */
  /* By corner within reach: 1 + its place in `moves`, 0 for those not moved. */
  uint16_t move_of[ZS_REACH][ZS_REACH][ZS_REACH];
  const zs_moved *moves[ZS_REACH * ZS_REACH * ZS_REACH];
} solver;

/* What one brick's vertices are found with. */
typedef struct solving {
  zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  const zs_brick *brick;
  zs_frame frame;
} solving;

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

/* On the surface itself a field may have a kink, and its
 * gradient there be 0, as that of min(d, 0) + max(d, 0) computed term by term:
 * the gradient is taken just inside. */
static void find_normals(const solving *s)
{
  solver *w = s->worker->scratch;
  const unsigned count = w->roots.count;
  for (int k = 0; k < 3; k++)
    memcpy(w->at[k], w->roots.inside[k], count * sizeof *w->at[k]);
  zs_program_gradients(s->worker->eval, s->brick->program, &s->frame, count, w->at[0], w->at[1], w->at[2],
                       w->result[0]);
  s->worker->evaluations += count;
  for (unsigned i = 0; i < count; i++) {
    float g[3] = {w->result[1][i], w->result[2][i], w->result[3][i]};
    unit_normal(g, s->job->mesh->normals + 3 * (size_t)w->number[i]);
  }
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
  for (unsigned k = 0; job->mesh->normals && k < 3; k++)
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

/* ---- Edges of a brick ------------------------------------------------------------------ */

/* Solve the edges collected so far and write their vertices. */
static void flush(const solving *s)
{
  solver *w = s->worker->scratch;
  if (!w->roots.count)
    return;
  s->worker->evaluations +=
    zs_roots_solve(&w->roots, s->worker->eval, s->brick->program, &s->frame,
                   (float)s->job->tolerance, (float)s->job->apart);
  for (unsigned i = 0; i < w->roots.count; i++)
    for (int k = 0; k < 3; k++)
      s->job->mesh->positions[3 * (size_t)w->number[i] + (unsigned)k] =
        (float)(s->frame.origin[k] + (double)w->roots.found[k][i]);
  if (s->job->mesh->normals)
    find_normals(s);
  w->roots.count = 0;
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
  float inner[3], outer[3];
  end[axis]++;
  corner_place(s, start_inside ? start : end, inner);
  corner_place(s, start_inside ? end : start, outer);
  w->number[w->roots.count] = number;
  zs_roots_add(&w->roots, inner, outer, ends ? ends[0] : 1, ends ? ends[1] : -1);
  if (w->roots.count == ZS_BLOCK)
    flush(s);
}

static void visit_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  solving s = {.job = job, .worker = worker, .brick = brick};
  place_caps(job, brick);
  if (!brick->vertex_count || !brick->sampled)
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

/* ---- The stage ------------------------------------------------------------------------------ */

bool zs_polygonize_vertices(zs_polygonize_job *job)
{
  solver *scratch = aligned_alloc(64, job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++) {
    scratch[t].roots.count = 0;
    job->workers[t].scratch = &scratch[t];
  }
  bool done = zs_polygonize_each(job, "vertices", 0.5, 0.9, visit_brick);
  free(scratch);
  return done;
}
