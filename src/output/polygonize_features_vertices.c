/* The features method's vertices: where the tangent planes of a loop meet, within
 * the cell, and on the surface. */
#include "output/polygonize.h"
#include "output/polygonize_roots.h"
#include "output/quadric.h"

#include "base/array.h"
#include "base/diagnostic.h"
#include "base/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where all normals of a loop are closer than this, about 14 degrees, to their
 * mean, the surface is flat enough for the middle of the loop. */
static const float FLAT = 0.97f;

/* Sharp vertices settle within this part of a cell. */
static const float NEAR = 0.15f;

/* Parts of a cell: places are as good as each other when their distances from the
 * planes differ by less; and planes meet when all are closer. */
static const double SLACK = 2e-5, FITTING = 0.05;

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
  double side;     /* the shortest of a cell */
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

/* The greatest distance of a place from the planes of a loop. */
static double distance_from_planes(const loop *l, const double place[3])
{
  double greatest = 0;
  for (unsigned i = 0; i < l->count; i++) {
    double distance = 0;
    for (int k = 0; k < 3; k++)
      distance += l->normals[i][k] * (place[k] + l->middle[k] - l->points[i][k]);
    greatest = fmax(greatest, fabs(distance));
  }
  return greatest;
}

/* Add the tangent plane at an edge, in a frame whose origin is the middle. */
static void add_plane(const loop *l, unsigned i, zs_quadric *planes)
{
  double distance = 0;
  for (int k = 0; k < 3; k++)
    distance += (double)l->normals[i][k] * (l->points[i][k] - l->middle[k]);
  zs_quadric_add(planes, l->normals[i], distance);
}

/* Where the tangent planes of a loop meet. */
typedef struct meeting {
  unsigned rank;  /* 2 on a sharp edge, 3 in a corner */
  bool is_within; /* the cell */
  double misfit;  /* greatest distance from one of the planes */
  float place[3], normal[3];
} meeting;

/* Look for the place closest to all tangent planes, in the cell if there is one as
 * good there as in the cells around it; and for the direction that leads away from
 * all of them alike, however many edges lie on either side. */
static void meet(const placing *s, const loop *l, const cell *c, meeting *m)
{
  static const double below[3] = {-INFINITY, -INFINITY, -INFINITY},
                      above[3] = {INFINITY, INFINITY, INFINITY};
  zs_quadric planes = {{{0}}, {0}}, away = planes;
  double lo[3], hi[3], lower[3], upper[3], best[3], direction[3];
  for (unsigned i = 0; i < l->count; i++) {
    add_plane(l, i, &planes);
    zs_quadric_add(&away, l->normals[i], 1);
  }
  m->is_within = true;
  for (int k = 0; k < 3; k++) {
    const double reach = c->lo[k] < c->hi[k] ? s->job->cell[k] : 0;
    lo[k] = (double)c->lo[k] - l->middle[k];
    hi[k] = (double)c->hi[k] - l->middle[k];
    lower[k] = lo[k] - reach;
    upper[k] = hi[k] + reach;
  }
  m->rank = zs_quadric_minimize(&planes, lower, upper, best);
  m->misfit = distance_from_planes(l, best);
  const double good = 2 * m->misfit + SLACK * s->side;
  for (int k = 0; k < 3; k++)
    m->is_within = m->is_within && best[k] >= lo[k] && best[k] <= hi[k];
  if (!m->is_within) {
    double nearby[3];
    zs_quadric_minimize(&planes, lo, hi, nearby);
    m->is_within = m->rank < 2 || distance_from_planes(l, nearby) <= good;
    if (m->is_within)
      memcpy(best, nearby, sizeof best);
  }
  zs_quadric_minimize(&away, below, above, direction);
  for (int k = 0; k < 3; k++) {
    m->place[k] = (float)(l->middle[k] + best[k]);
    m->normal[k] = (float)direction[k];
  }
  normalize(m->normal);
}

/* The edges of a loop that lie on the same side of a sharp edge as edge i does. */
static unsigned count_side(const loop *l, unsigned i)
{
  unsigned count = 0;
  for (unsigned j = 0; j < l->count; j++)
    count += !zs_crease_between(l->normals[i], l->normals[j]);
  return count;
}

/* The part of a step that stays in the cell. */
static float part_within(const cell *c, const float from[3], const float step[3])
{
  float part = 1;
  for (int k = 0; k < 3; k++) {
    const float room = (step[k] > 0 ? c->hi[k] : c->lo[k]) - from[k];
    if (fabsf(step[k]) * part > fabsf(room))
      part = fabsf(room / step[k]);
  }
  return part;
}

/* A place in the plane of the side that has most of the loop's edges, and that side's
 * normal.  Between those edges all of the plane is surface; so it is toward the middle
 * of the loop unless a sharp edge passes through the cell: `toward_middle`. */
static void stand_aside(const loop *l, const cell *c, bool toward_middle, float place[3],
                        float normal[3])
{
  unsigned most = 0, count = 0;
  float step[3];
  for (unsigned i = 1; i < l->count; i++)
    if (count_side(l, i) > count_side(l, most))
      most = i;
  for (int k = 0; k < 3; k++)
    place[k] = normal[k] = 0;
  for (unsigned i = 0; i < l->count; i++) {
    if (zs_crease_between(l->normals[most], l->normals[i]))
      continue;
    for (int k = 0; k < 3; k++) {
      place[k] += l->points[i][k];
      normal[k] += l->normals[i][k];
    }
    count++;
  }
  normalize(normal);
  for (int k = 0; k < 3; k++)
    place[k] /= (float)count;
  clamp(place, c);
  if (!toward_middle)
    return;
  for (int k = 0; k < 3; k++)
    step[k] = l->middle[k] - place[k];
  const float above = dot(step, normal);
  for (int k = 0; k < 3; k++)
    step[k] -= above * normal[k];
  const float part = part_within(c, place, step) / 2;
  for (int k = 0; k < 3; k++)
    place[k] += part * step[k];
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
 * cross it: a vertex on or beside a sharp edge is then as close to it as its cell
 * allows. */
static void add_line(const placing *s, unsigned i)
{
  placer *w = s->worker->scratch;
  const bool inside = w->f[0][i] >= 0;
  if (inside == (w->f[1][i] >= 0)) {
    if (w->patch[i]->sharp || w->patch[i]->aside)
      return;
    nearest_corner(s, &w->cells[i], w->patch[i]->edges, !inside, w->place[i], w->end[i]);
    w->f[1][i] = -w->f[0][i];
  }
  const float *inner = inside ? w->place[i] : w->end[i], *outer = inside ? w->end[i] : w->place[i];
  w->of_line[w->roots.count] = (uint16_t)i;
  zs_roots_add(&w->roots, inner, outer, w->f[!inside][i], w->f[inside][i]);
}

/* Far from where the planes of a sharp edge meet, the surface is one of its sides;
 * and far from the plane of one side it is another one. */
static bool accept(const placing *s, const zs_patch *patch, const float from[3],
                   const float place[3])
{
  const float near = NEAR * (float)s->side;
  const float step[3] = {place[0] - from[0], place[1] - from[1], place[2] - from[2]};
  return !(patch->sharp || patch->aside) || dot(step, step) <= near * near;
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

/* Claim the cell where a patch's planes meet. */
static void claim(const placing *s, zs_patch *patch, const meeting *m)
{
  zs_claims *claims = &s->worker->claims;
  zs_claim *items =
    zs_array_grown(claims->items, claims->count + 1, &claims->room, sizeof *items);
  if (!items) {
    s->worker->out_of_memory = true;
    return;
  }
  claims->items = items;
  zs_claim *c = &items[claims->count++];
  *c = (zs_claim){
    .patch = patch,
    .vertex = (uint32_t)(s->brick->first_patch + (size_t)(patch - s->brick->patches)),
    .rank = m->rank};
  memcpy(c->normal, m->normal, sizeof c->normal);
  for (int k = 0; k < 3; k++) {
    c->place[k] = s->frame.origin[k] + m->place[k];
    c->cell[k] = (uint32_t)(floor((c->place[k] - s->job->lo[k]) / s->job->cell[k]) + 1);
  }
}

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
    meeting m;
    meet(s, &l, c, &m);
    patch->aside = !m.is_within;
    patch->sharp = m.is_within && m.rank > 1;
    patch->corner = m.is_within && m.rank > 2;
    memcpy(place, m.place, sizeof m.place);
    memcpy(out, m.normal, sizeof m.normal);
    if (patch->aside) {
      if (!c->pad_edges && m.misfit <= FITTING * s->side)
        claim(s, patch, &m);
      stand_aside(&l, c, m.rank == 2, place, out);
    }
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
  s->side = fmin(s->job->cell[0], fmin(s->job->cell[1], s->job->cell[2]));
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

/* A vertex on a sharp edge gives it up for one of the sides; any other one moves to
 * the middle of its loop. */
static void unfold_patch(const placing *s, zs_patch *patch)
{
  float place[3];
  cell c;
  loop l;
  look_at_cell(s, patch->cell, &c);
  gather(s, &c, patch->edges, &l);
  if (patch->sharp) {
    stand_aside(&l, &c, false, place, vertex_item(s, patch, s->job->dual->normals));
  } else {
    memcpy(place, l.middle, sizeof place);
    clamp(place, &c);
  }
  write_place(s, &c, patch, place);
  patch->aside = patch->sharp;
  patch->sharp = patch->corner = false;
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

/* Gradients that faces cannot agree with, as of several sheets in one cell, are no
 * normals: the faces around are to tell. */
static void forget_normals(const zs_polygonize_job *job, const zs_brick *brick)
{
  for (uint32_t i = 0; i < brick->patch_count; i++)
    if (brick->patches[i].folded)
      memset(job->dual->normals + 3 * (brick->first_patch + i), 0,
             3 * sizeof *job->dual->normals);
}

static bool has_folds(const zs_brick *brick)
{
  bool any = false;
  for (uint32_t i = 0; i < brick->patch_count && !any; i++)
    any = brick->patches[i].folded;
  return any;
}

static void forget_folds(zs_brick *brick)
{
  for (uint32_t i = 0; i < brick->patch_count; i++)
    brick->patches[i].folded = brick->patches[i].suspect = false;
}

bool zs_polygonize_unfold(zs_polygonize_job *job, bool last, bool *any)
{
  placer *scratch;
  bool found = false;
  if (!allocate_placers(job, &scratch))
    return false;
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads) reduction(|| : found)
  for (size_t i = 0; i < job->active_count; i++) {
    zs_brick *brick = job->active[i];
    if (has_folds(brick)) {
      found = true;
      if (last)
        forget_normals(job, brick);
      else
        unfold_brick(job, &job->workers[zs_thread_number()], brick);
    }
    forget_folds(brick);
  }
  free(scratch);
  *any = found;
  return true;
}
