/* The features method's vertices: where the tangent planes of a loop meet, within
 * the cell, and on the surface. */
#include "output/polygonize.h"
#include "output/polygonize_roots.h"
#include "output/quadric.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where all normals of a loop are closer than this, about 14 degrees, to their
 * mean, the surface is flat enough for the middle of the loop. */
static const float FLAT = 0.97f;

/* Sharp vertices settle within this part of a cell. */
static const float NEAR = 0.15f;

/* The crossing edges of a loop. */
typedef struct loop {
  unsigned count;
  float points[ZS_CELL_EDGES][3]; /* in the brick's frame */
  float normals[ZS_CELL_EDGES][3];
  float middle[3], sum[3]; /* of points, of normals */
} loop;

/* A cell, in the brick's frame. */
typedef struct cell {
  unsigned at[3];
  unsigned inside;       /* its case */
  unsigned pad_edges;
  float lo[3], hi[3];    /* the space for its vertices: a little off its sides */
} cell;

/* Vertices on their way to the surface. */
typedef struct placer {
  zs_edge_numbers numbers;
  zs_brick_rows rows;
  zs_roots roots;
  unsigned count; /* of the block */
  zs_patch *patch[ZS_BLOCK];
  uint16_t of_line[ZS_BLOCK]; /* the vertex of each line */
  cell cells[ZS_BLOCK];
  float place[ZS_BLOCK][3], out[ZS_BLOCK][3], end[ZS_BLOCK][3];
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float f[2][ZS_BLOCK]; /* at the place, and at the end of its line */
} placer;

/* What one brick's vertices are placed with. */
typedef struct placing {
  const zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  zs_brick *brick;
  zs_frame frame;
  size_t offsets[ZS_CELL_EDGES];
  float margin[3]; /* of vertices to the sides of their cells */
} placing;

static float dot(const float a[3], const float b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Calls of fminf and fmaxf cost more than what they do; no NaN may get out. */
static void clamp(float place[3], const cell *c)
{
  for (int k = 0; k < 3; k++) {
    float least = place[k] > c->lo[k] ? place[k] : c->lo[k];
    place[k] = least < c->hi[k] ? least : c->hi[k];
  }
}

/* ---- A cell and its loops ---------------------------------------------------- */

/* Coordinate of a local plane in the brick's frame. */
static float lattice_plane(const placing *s, unsigned axis, unsigned i)
{
  return (float)(s->job->cell[axis] * ((int)i - ZS_BRICK / 2));
}

/* A pad cell is as flat as the face of the grid that it lies on. */
static void look_at_cell(const placing *s, unsigned number, cell *c)
{
  const placer *w = s->worker->scratch;
  for (unsigned k = 0; k < 3; k++, number /= ZS_BRICK)
    c->at[k] = number % ZS_BRICK;
  c->inside = zs_brick_cell_case(w->rows, c->at[0], c->at[1], c->at[2]);
  c->pad_edges = s->brick->at_face ? zs_brick_pad_edges(s->job, s->brick, c->at) : 0;
  for (unsigned k = 0; k < 3; k++) {
    const uint32_t i = zs_lattice_index(s->brick, (int)k, c->at[k]);
    c->lo[k] = lattice_plane(s, k, c->at[k]) + s->margin[k];
    c->hi[k] = lattice_plane(s, k, c->at[k] + 1) - s->margin[k];
    if (c->pad_edges && zs_lattice_pad_edge(s->job, (int)k, i))
      c->lo[k] = c->hi[k] = lattice_plane(s, k, c->at[k] + (i == 0));
  }
}

static void gather(const placing *s, const cell *c, unsigned edges, loop *l)
{
  const placer *w = s->worker->scratch;
  const zs_mesh *mesh = s->job->mesh;
  const uint32_t *numbers = w->numbers + zs_reach_offset(c->at[0], c->at[1], c->at[2]);
  float middle[3] = {0}, sum[3] = {0};
  unsigned n = 0;
  for (edges &= s->job->cap ? edges : ~c->pad_edges; edges; edges &= edges - 1, n++) {
    const size_t vertex = 3 * (size_t)numbers[s->offsets[__builtin_ctz(edges)]];
    const float *position = mesh->positions + vertex, *normal = mesh->normals + vertex;
    for (int k = 0; k < 3; k++) {
      const float place = (float)(position[k] - s->frame.origin[k]);
      l->points[n][k] = place;
      l->normals[n][k] = normal[k];
      middle[k] += place;
      sum[k] += normal[k];
    }
  }
  l->count = n;
  for (int k = 0; k < 3; k++) {
    l->middle[k] = middle[k] / (float)n;
    l->sum[k] = sum[k];
  }
}

static bool is_flat(const loop *l)
{
  const float least = FLAT * sqrtf(dot(l->sum, l->sum));
  bool flat = least > 0;
  for (unsigned i = 0; i < l->count; i++)
    flat = flat && dot(l->normals[i], l->sum) >= least;
  return flat;
}

/* To unit length; zero when it has hardly any. */
static void normalize(float v[3])
{
  float length = sqrtf(dot(v, v));
  for (int k = 0; k < 3; k++)
    v[k] = length > 1e-3f ? v[k] / length : 0;
}

/* The place closest to all tangent planes, and the direction that leads away from
 * all of them alike, however many edges lie on either side.  True when it is on a
 * sharp edge or corner. */
static bool meet(const loop *l, const cell *c, float place[3], float normal[3])
{
  static const double below[3] = {-INFINITY, -INFINITY, -INFINITY},
                      above[3] = {INFINITY, INFINITY, INFINITY};
  zs_quadric planes = {{{0}}, {0}}, away = planes;
  double lo[3], hi[3], offset[3], direction[3];
  for (unsigned i = 0; i < l->count; i++) {
    double distance = 0;
    for (int k = 0; k < 3; k++)
      distance += (double)l->normals[i][k] * (l->points[i][k] - l->middle[k]);
    zs_quadric_add(&planes, l->normals[i], distance);
    zs_quadric_add(&away, l->normals[i], 1);
  }
  for (int k = 0; k < 3; k++) {
    lo[k] = (double)c->lo[k] - l->middle[k];
    hi[k] = (double)c->hi[k] - l->middle[k];
  }
  unsigned rank = zs_quadric_minimize(&planes, lo, hi, offset);
  zs_quadric_minimize(&away, below, above, direction);
  for (int k = 0; k < 3; k++) {
    place[k] = (float)(l->middle[k] + offset[k]);
    normal[k] = (float)direction[k];
  }
  normalize(normal);
  return rank > 1;
}

/* ---- Onto the surface ------------------------------------------------------------
 *
 * A vertex settles on the line along its normal; when the surface does not cross
 * that within the cell, on the line to the nearest corner on its other side. */

/* The position of a patch's vertex, or its normal, in an array of the mesh. */
static float *vertex_item(const placing *s, const zs_patch *patch, float *items)
{
  return items + 3 * (s->brick->first_patch + (size_t)(patch - s->brick->patches));
}

static void write_place(const placing *s, const cell *c, const zs_patch *patch,
                        const float place[3])
{
  float *position = vertex_item(s, patch, s->job->dual->positions);
  for (int k = 0; k < 3; k++) {
    const uint32_t i = zs_lattice_index(s->brick, k, c->at[k]);
    position[k] = (float)(c->pad_edges && zs_lattice_pad_edge(s->job, k, i)
                            ? zs_lattice_place(s->job, k, i)
                            : s->frame.origin[k] + (double)place[k]);
  }
}

/* From a place along its normal, outward when it is inside, to where its space
 * ends. */
static void end_along(const cell *c, const float out[3], bool inside, const float from[3],
                      float end[3])
{
  float step[3], reach = INFINITY;
  for (int k = 0; k < 3; k++) {
    step[k] = c->lo[k] == c->hi[k] ? 0 : inside ? out[k] : -out[k];
    float most = step[k] != 0 ? ((step[k] > 0 ? c->hi[k] : c->lo[k]) - from[k]) / step[k] : reach;
    reach = most < reach ? most : reach;
  }
  for (int k = 0; k < 3; k++)
    end[k] = step[k] != 0 ? from[k] + reach * step[k] : from[k];
  clamp(end, c);
}

/* The corner nearest to a place among the ends of a loop's edges on the wanted
 * side of the surface. */
static void nearest_corner(const placing *s, const cell *c, unsigned edges, bool inside,
                           const float from[3], float nearest[3])
{
  float least = INFINITY;
  for (edges &= ~c->pad_edges; edges; edges &= edges - 1) {
    const unsigned edge = (unsigned)__builtin_ctz(edges), start = zs_cell_edge_start(edge);
    const unsigned corner =
      (c->inside >> start & 1) == inside ? start : start | 1u << edge / 4;
    float place[3], square = 0;
    for (unsigned k = 0; k < 3; k++) {
      place[k] = lattice_plane(s, k, c->at[k] + (corner >> k & 1));
      if (c->lo[k] == c->hi[k])
        place[k] = c->lo[k];
      square += (place[k] - from[k]) * (place[k] - from[k]);
    }
    if (square >= least)
      continue;
    least = square;
    memcpy(nearest, place, sizeof place);
  }
}

static void evaluate(const placing *s, float places[][3], float *f)
{
  placer *w = s->worker->scratch;
  for (unsigned i = 0; i < w->count; i++)
    for (int k = 0; k < 3; k++)
      w->at[k][i] = places[i][k];
  zs_program_values(s->worker->eval, s->brick->program, &s->frame, w->count, w->at[0], w->at[1],
                    w->at[2], f);
  s->worker->evaluations += w->count;
}

/* Add the line of a vertex to those to be solved, unless the surface does not
 * cross it: a sharp vertex is then as close to the edge as its cell allows. */
static void add_line(const placing *s, unsigned i)
{
  placer *w = s->worker->scratch;
  const bool inside = w->f[0][i] >= 0;
  if (inside == (w->f[1][i] >= 0)) {
    if (w->patch[i]->sharp)
      return;
    nearest_corner(s, &w->cells[i], w->patch[i]->edges, !inside, w->place[i], w->end[i]);
    w->f[1][i] = -w->f[0][i];
  }
  const float *inner = inside ? w->place[i] : w->end[i], *outer = inside ? w->end[i] : w->place[i];
  w->of_line[w->roots.count] = (uint16_t)i;
  zs_roots_add(&w->roots, inner, outer, w->f[!inside][i], w->f[inside][i]);
}

/* Far from where the planes of a sharp edge meet, the surface is one of its
 * sides. */
static bool accept(const placing *s, const zs_patch *patch, const float from[3],
                   const float place[3])
{
  const double *side = s->job->cell;
  const float near = NEAR * (float)fmin(side[0], fmin(side[1], side[2]));
  const float step[3] = {place[0] - from[0], place[1] - from[1], place[2] - from[2]};
  return !patch->sharp || dot(step, step) <= near * near;
}

/* Settle the block and write its vertices. */
static void settle(const placing *s)
{
  placer *w = s->worker->scratch;
  evaluate(s, w->place, w->f[0]);
  for (unsigned i = 0; i < w->count; i++)
    end_along(&w->cells[i], w->out[i], w->f[0][i] >= 0, w->place[i], w->end[i]);
  evaluate(s, w->end, w->f[1]);
  w->roots.count = 0;
  for (unsigned i = 0; i < w->count; i++)
    add_line(s, i);
  s->worker->evaluations += zs_roots_solve(&w->roots, s->worker->eval, s->brick->program,
                                           &s->frame, (float)s->job->tolerance, 0);
  for (unsigned n = 0; n < w->roots.count; n++) {
    const unsigned i = w->of_line[n];
    float place[3] = {w->roots.found[0][n], w->roots.found[1][n], w->roots.found[2][n]};
    clamp(place, &w->cells[i]);
    if (accept(s, w->patch[i], w->place[i], place))
      memcpy(w->place[i], place, sizeof place);
  }
  for (unsigned i = 0; i < w->count; i++)
    write_place(s, &w->cells[i], w->patch[i], w->place[i]);
  w->count = 0;
}

/* ---- A brick -------------------------------------------------------------------------- */

static void place_patch(const placing *s, zs_patch *patch)
{
  placer *w = s->worker->scratch;
  cell *c = &w->cells[w->count];
  float *place = w->place[w->count], *out = w->out[w->count];
  loop l;
  look_at_cell(s, patch->cell, c);
  gather(s, c, patch->edges, &l);
  if (is_flat(&l)) {
    memcpy(place, l.middle, sizeof l.middle);
    memcpy(out, l.sum, sizeof l.sum);
    normalize(out);
  } else {
    patch->sharp = meet(&l, c, place, out);
  }
  clamp(place, c);
  memcpy(vertex_item(s, patch, s->job->dual->normals), out, sizeof l.sum);
  if (!(patch->edges & ~c->pad_edges)) {
    write_place(s, c, patch, place);
    return;
  }
  w->patch[w->count++] = patch;
  if (w->count == ZS_BLOCK)
    settle(s);
}

/* Whether a patch's vertex is at the place of one before it in its cell. */
static bool meets_another(const placing *s, const zs_patch *patch)
{
  const float *p = vertex_item(s, patch, s->job->dual->positions);
  bool meets = false;
  for (const zs_patch *other = patch; other-- > s->brick->patches && other->cell == patch->cell;) {
    const float *q = vertex_item(s, other, s->job->dual->positions);
    meets = meets || (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]);
  }
  return meets;
}

/* Move a patch's vertex halfway to an edge of its own. */
static void move_aside(const placing *s, const zs_patch *patch)
{
  float *p = vertex_item(s, patch, s->job->dual->positions);
  cell c;
  loop l;
  look_at_cell(s, patch->cell, &c);
  gather(s, &c, patch->edges, &l);
  for (int k = 0; k < 3; k++)
    p[k] += ((float)(s->frame.origin[k] + (double)l.points[0][k]) - p[k]) / 2;
}

/* Vertices of one cell can meet, as where its planes are of no help.  Welding
 * them would pinch the mesh. */
static void separate(const placing *s)
{
  enum { TRIES = 2 * ZS_CELL_LOOPS };
  for (uint32_t i = 1; i < s->brick->patch_count; i++)
    for (unsigned n = 0; n < TRIES && meets_another(s, &s->brick->patches[i]); n++)
      move_aside(s, &s->brick->patches[i]);
}

static void enter_brick(placing *s)
{
  placer *w = s->worker->scratch;
  s->frame = zs_brick_frame(s->job, s->brick);
  zs_brick_gather_signs(s->job, s->brick, w->rows);
  zs_brick_number_edges(s->job, s->brick, w->numbers);
  zs_cell_edge_offsets(s->offsets);
  for (int k = 0; k < 3; k++)
    s->margin[k] = (float)fmin(s->job->apart, s->job->cell[k] / 4);
  w->count = 0;
}

static void place_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  placing s = {.job = job, .worker = worker, .brick = brick};
  placer *w = worker->scratch;
  if (!brick->patch_count)
    return;
  enter_brick(&s);
  for (uint32_t i = 0; i < brick->patch_count; i++)
    place_patch(&s, &brick->patches[i]);
  if (w->count)
    settle(&s);
  separate(&s);
}

static bool allocate_placers(zs_polygonize_job *job, placer **scratch)
{
  *scratch = aligned_alloc(64, job->threads * sizeof **scratch);
  if (!*scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++)
    job->workers[t].scratch = *scratch + t;
  return true;
}

bool zs_polygonize_patch_vertices(zs_polygonize_job *job)
{
  placer *scratch;
  job->dual = zs_mesh_new(job->patch_count, job->triangle_count, true, job->diag);
  if (!job->dual || !allocate_placers(job, &scratch))
    return false;
  bool done = zs_polygonize_each(job, "cells", 0.9, 0.97, place_brick);
  free(scratch);
  return done;
}

/* ---- Folds ----------------------------------------------------------------------------- */

static void unfold_patch(const placing *s, zs_patch *patch)
{
  cell c;
  loop l;
  patch->folded = patch->sharp = false;
  look_at_cell(s, patch->cell, &c);
  gather(s, &c, patch->edges, &l);
  clamp(l.middle, &c);
  write_place(s, &c, patch, l.middle);
}

static bool has_folds(const zs_brick *brick)
{
  bool any = false;
  for (uint32_t i = 0; i < brick->patch_count && !any; i++)
    any = brick->patches[i].folded;
  return any;
}

static void unfold_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  placing s = {.job = job, .worker = worker, .brick = brick};
  enter_brick(&s);
  for (uint32_t i = 0; i < brick->patch_count; i++)
    if (brick->patches[i].folded)
      unfold_patch(&s, &brick->patches[i]);
  separate(&s);
}

bool zs_polygonize_unfold(zs_polygonize_job *job, bool *any)
{
  placer *scratch;
  *any = false;
  for (size_t i = 0; i < job->active_count; i++) {
    job->active[i]->unfolded = has_folds(job->active[i]);
    *any = *any || job->active[i]->unfolded;
  }
  if (!*any)
    return true;
  if (!allocate_placers(job, &scratch))
    return false;
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++)
    if (job->active[i]->unfolded)
      unfold_brick(job, &job->workers[zs_polygonize_thread()], job->active[i]);
  free(scratch);
  return true;
}
