/* The polygonizer's vertices: certified roots along the edges, and normals. */
#include "output/polygonize.h"
#include "output/polygonize_roots.h"
#include "output/polygonize_rows.h"

#include "base/diagnostic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const zs_normal_box NOTHING = {{INFINITY, INFINITY, INFINITY},
                                      {-INFINITY, -INFINITY, -INFINITY}};

typedef struct solver {
  zs_roots roots;
  zs_edge_list list; /* of the brick */
  zs_row_bits inner[3];         /* edges that lie in a brick ... */
  zs_row_bits inner_at_face[3]; /* ... and in one at the grid's face */
  _Alignas(64) float at[3][ZS_BLOCK];
  _Alignas(64) float result[4][ZS_BLOCK]; /* f and its gradient */
  float packed[3 * ZS_BLOCK];
  /* By corner within reach: the place of its offset, 0 for those not moved. */
  uint16_t move_of[ZS_REACH_CORNERS];
  float offsets[ZS_REACH_CORNERS + 1][3];
  uint16_t moved[ZS_REACH_CORNERS]; /* the corners that are */
  unsigned moved_count;
} solver;

/* What one brick's vertices are found with. */
typedef struct solving {
  zs_polygonize_job *job;
  zs_polygonize_worker *worker;
  zs_brick *brick;
  const zs_program *program; /* of the part at hand */
  const zs_row_kernels *rows;
  zs_frame frame;
  unsigned from; /* of the list, the first edge of the block at hand */
} solving;

/* Copy a block's triples of numbers to those of its vertices. */
static void unpack(const solving *s, float *triples)
{
  const solver *w = s->worker->scratch;
  const uint32_t *vertex = w->list.vertex + s->from;
  for (unsigned i = 0; i < w->roots.count; i++)
    memcpy(triples + 3 * (size_t)vertex[i], w->packed + 3 * i, 3 * sizeof *triples);
}

/* On the surface itself a field may have a kink, and its
 * gradient there be 0, as that of min(d, 0) + max(d, 0) computed term by term:
 * the gradient is taken just inside. */
static void find_normals(const solving *s)
{
  solver *w = s->worker->scratch;
  const unsigned n = w->roots.count;
  for (int k = 0; k < 3; k++)
    memcpy(w->at[k], w->roots.inside[k], n * sizeof *w->at[k]);
  zs_program_gradients(s->worker->eval, s->program, &s->frame, n, w->at[0], w->at[1],
                       w->at[2], w->result[0]);
  s->worker->evaluations += n;
  s->rows->normals(n, w->result + 1);
  if (s->job->creases)
    s->rows->hold(n, (const float(*)[ZS_BLOCK])w->result + 1, w->list.edge + s->from, s->brick);
  s->rows->pack(n, (const float(*)[ZS_BLOCK])w->result + 1, w->packed);
  unpack(s, s->job->mesh->normals);
}

/* ---- Caps --------------------------------------------------------------------------------- */

/* The vertex of an edge to a pad lies at the corner on the grid's face; its
 * normal is that of the face, or of all faces that meet there when they share
 * it. */
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
    if (job->features && k != axis)
      normal[k] = 0;
    square += normal[k] * normal[k];
  }
  for (unsigned k = 0; job->mesh->normals && k < 3; k++)
    job->mesh->normals[3 * number + k] = normal[k] / sqrtf(square);
}

static void place_caps(const zs_polygonize_job *job, const zs_brick *brick)
{
  size_t number = brick->first_vertex;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned axis = 0; axis < 3 && zs_row_has(brick->crossing, row); axis++)
      for (unsigned edges = brick->crossing[axis][row]; edges; edges &= edges - 1, number++) {
        unsigned start[3] = {(unsigned)__builtin_ctz(edges), row % ZS_BRICK, row / ZS_BRICK};
        if (zs_lattice_pad_edge(job, (int)axis, zs_lattice_index(brick, (int)axis, start[axis])))
          place_cap_vertex(job, brick, start, axis, number);
      }
}

/* ---- Corners that were moved ----------------------------------------------------------- */

/* Where the corners within reach are moved to, by brick and neighbours. */
static void gather_moves(const solving *s)
{
  solver *w = s->worker->scratch;
  w->moved_count = 0;
  for (unsigned d = 0; d < 8; d++) {
    const zs_brick *owner = zs_brick_upper(s->job, s->brick, d);
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
      const size_t at = zs_reach_offset(c[0], c[1], c[2]);
      w->moved[w->moved_count++] = (uint16_t)at;
      w->move_of[at] = (uint16_t)w->moved_count;
      memcpy(w->offsets[w->moved_count], owner->moved[i].offset, sizeof *w->offsets);
    }
  }
}

static void forget_moves(solver *w)
{
  for (unsigned i = 0; i < w->moved_count; i++)
    w->move_of[w->moved[i]] = 0;
}

/* Move the ends of the block's lines with their corners. */
static void move_ends(const solving *s)
{
  solver *w = s->worker->scratch;
  static const size_t steps[3] = {1, ZS_REACH, ZS_REACH_PLANE};
  for (unsigned i = 0; i < w->roots.count; i++) {
    const unsigned e = w->list.edge[s->from + i];
    const size_t at = zs_reach_offset(e & 15, e >> 4 & 15, e >> 8 & 15);
    const unsigned start = w->move_of[at], end = w->move_of[at + steps[e >> 12 & 3]];
    if (!(start | end))
      continue;
    const bool start_inside = e >> ZS_EDGE_INSIDE & 1;
    const float *inner = w->offsets[start_inside ? start : end];
    const float *outer = w->offsets[start_inside ? end : start];
    for (int k = 0; k < 3; k++) {
      w->roots.from[k][i] += inner[k];
      w->roots.along[k][i] += outer[k] - inner[k];
    }
  }
}

/* ---- Edges of a brick ------------------------------------------------------------------ */

/* Solve a block of n edges of the list and write their vertices. */
static void solve_block(const solving *s, unsigned n)
{
  solver *w = s->worker->scratch;
  w->roots.count = n;
  memcpy(w->roots.f_inner, w->list.f_inner + s->from, n * sizeof *w->roots.f_inner);
  memcpy(w->roots.f_outer, w->list.f_outer + s->from, n * sizeof *w->roots.f_outer);
  s->rows->lines(n, w->list.edge + s->from, s->job->cell, &w->roots);
  if (w->moved_count)
    move_ends(s);
  s->worker->evaluations +=
    zs_roots_solve(&w->roots, s->worker->eval, s->program, &s->frame,
                   (float)s->job->tolerance, (float)s->job->apart);
  s->rows->places(n, (const float(*)[ZS_BLOCK])w->roots.found, s->frame.origin, w->packed);
  unpack(s, s->job->mesh->positions);
  if (s->job->mesh->normals)
    find_normals(s);
}

/* Solve the edges from `first` to `end` by one program. */
static void solve_edges(solving *s, const zs_program *program, unsigned first, unsigned end)
{
  s->program = program;
  for (s->from = first; s->from < end; s->from += ZS_BLOCK)
    solve_block(s, end - s->from < ZS_BLOCK ? end - s->from : ZS_BLOCK);
}

/* Whether an edge leads to a pad. */
static bool leads_to_pad(const solving *s, unsigned edge)
{
  const unsigned axis = edge >> ZS_EDGE_AXIS & 3, start = edge >> 4 * axis & (ZS_BRICK - 1);
  return zs_lattice_pad_edge(s->job, (int)axis, zs_lattice_index(s->brick, (int)axis, start));
}

/* Take edges to pads off the list: their vertices are those of caps. */
static void drop_pads(const solving *s, zs_edge_list *list)
{
  unsigned count = 0, from = 0;
  for (unsigned l = 0; l < ZS_PARTS; l++) {
    const unsigned end = list->first[l + 1];
    list->first[l] = count;
    for (; from < end; from++) {
      if (leads_to_pad(s, list->edge[from]))
        continue;
      list->edge[count] = list->edge[from];
      list->vertex[count] = list->vertex[from];
      list->f_inner[count] = list->f_inner[from];
      list->f_outer[count] = list->f_outer[from];
      count++;
    }
  }
  list->first[ZS_PARTS] = count;
}

/* How far, in cells, ends of edges may be from their corners: moves are shorter. */
static const float MOST_MOVED = 2 * ZS_REPULSION;

/* Programs for the edges of each part, in the worker's arena. */
static void make_programs(const solving *s, const zs_program *programs[ZS_PARTS])
{
  zs_boxes boxes;
  zs_bounds bounds;
  for (unsigned l = 0; l < ZS_PARTS; l++) {
    const zs_part part = zs_part_at(l);
    for (unsigned k = 0; k < 3; k++) {
      const unsigned size = k < 2 ? ZS_PART_WIDTH : ZS_PART_HEIGHT;
      const float margin = (float)s->job->cell[k] * MOST_MOVED;
      boxes.axis[k].lo[l] = zs_brick_place(s->job, (int)k, part.first[k]) - margin;
      boxes.axis[k].hi[l] = zs_brick_place(s->job, (int)k, part.first[k] + size) + margin;
    }
  }
  zs_program_bounds(s->worker->eval, s->brick->program, &s->frame, &boxes, &bounds);
  zs_program_restrict_lanes(s->worker->eval, s->brick->program, (1u << ZS_PARTS) - 1,
                            ZS_REQUEST_SIGN, &s->worker->arena, programs);
}

/* Whether shorter programs for the parts are worth making: for so many
 * steps, each for so many edges. */
static bool pays(const zs_brick *brick)
{
  const size_t many = 10000;
  return brick->vertex_count * (size_t)zs_program_length(brick->program) > many;
}

/* Starts of the edges between corners of a box, by axis. */
static void find_inner_edges(const zs_corner_box *corners, zs_row_bits inner[3])
{
  for (unsigned axis = 0; axis < 3; axis++) {
    zs_corner_box starts = *corners;
    starts.hi[axis]--;
    for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
      inner[axis][row] = (uint16_t)zs_corner_box_row(&starts, row);
  }
}

static void list_edges(const solving *s)
{
  solver *w = s->worker->scratch;
  const bool at_face = s->brick->at_face;
  if (at_face) {
    zs_corner_box real;
    zs_brick_real_corners(s->job, s->brick->index, &real); /* there are some */
    find_inner_edges(&real, w->inner_at_face);
  }
  s->rows->edges(s->brick, (const zs_row_bits *)(at_face ? w->inner_at_face : w->inner),
                 &s->job->bit_table, &w->list);
  if (at_face)
    drop_pads(s, &w->list);
}

static void solve_brick(solving *s)
{
  const zs_edge_list *list = &((solver *)s->worker->scratch)->list;
  list_edges(s);
  if (!pays(s->brick)) {
    solve_edges(s, s->brick->program, 0, list->first[ZS_PARTS]);
    return;
  }
  const zs_program *programs[ZS_PARTS];
  const zs_arena_mark mark = zs_arena_mark_here(&s->worker->arena);
  make_programs(s, programs);
  for (unsigned l = 0; l < ZS_PARTS; l++)
    solve_edges(s, programs[l], list->first[l], list->first[l + 1]);
  zs_arena_rewind(&s->worker->arena, mark);
}

static void visit_brick(zs_polygonize_job *job, zs_polygonize_worker *worker, zs_brick *brick)
{
  solving s = {.job = job, .worker = worker, .brick = brick};
  brick->all_normals = NOTHING;
  for (int k = 0; k < 3; k++)
    brick->side_normals[k] = NOTHING;
  if (brick->at_face)
    place_caps(job, brick);
  if (!brick->vertex_count || !brick->sampled)
    return;
  s.rows = zs_row_kernels_of(zs_eval_isa(worker->eval));
  s.frame = zs_brick_frame(job, s.brick);
  gather_moves(&s);
  solve_brick(&s);
  brick->ends = NULL;
  forget_moves(worker->scratch);
}

/* ---- The stage ------------------------------------------------------------------------------ */

bool zs_polygonize_vertices(zs_polygonize_job *job)
{
  solver *scratch = aligned_alloc(64, job->threads * sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++) {
    memset(scratch[t].move_of, 0, sizeof scratch[t].move_of);
    memset(scratch[t].offsets[0], 0, sizeof scratch[t].offsets[0]);
    find_inner_edges(&(zs_corner_box){{0, 0, 0}, {ZS_BRICK, ZS_BRICK, ZS_BRICK}},
                     scratch[t].inner);
    job->workers[t].scratch = &scratch[t];
  }
  bool done = zs_polygonize_each(job, "vertices", 0.5, 0.9, visit_brick);
  for (unsigned t = 0; t < job->threads; t++)
    zs_arena_free(&job->workers[t].ends);
  free(scratch);
  return done;
}
