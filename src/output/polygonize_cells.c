/* The polygonizer's cells: which edges carry vertices, and the triangles. */
#include "output/polygonize.h"
#include "output/polygonize_rows.h"

#include "base/diagnostic.h"

#include <stdlib.h>

void zs_brick_gather_signs(const zs_polygonize_job *job, const zs_brick *brick, zs_brick_rows rows)
{
  const zs_brick *from[8];
  for (unsigned d = 0; d < 8; d++)
    from[d] = zs_brick_upper(job, brick, d);
  for (unsigned z = 0; z < ZS_REACH; z++) {
    const unsigned layer = z % ZS_BRICK * ZS_BRICK, d = z < ZS_BRICK ? 0 : 4;
    const uint16_t *own = from[d]->signs + layer, *next = from[d | 1]->signs + layer;
    for (unsigned y = 0; y < ZS_BRICK; y++)
      rows[z][y] = own[y] | (next[y] & 1u) << ZS_BRICK;
    rows[z][ZS_BRICK] =
      from[d | 2]->signs[layer] | (from[d | 3]->signs[layer] & 1u) << ZS_BRICK;
  }
}

bool zs_brick_at_face(const zs_polygonize_job *job, const uint32_t index[3])
{
  for (int k = 0; k < 3; k++)
    if (index[k] == 0 || index[k] * ZS_BRICK + ZS_REACH > job->corners[k] - 2)
      return true;
  return false;
}

/* ---- Edges ------------------------------------------------------------------------ */

/* Bits x of the planes for which `is` holds, 17 of them. */
static uint32_t plane_bits(const zs_polygonize_job *job, const zs_brick *brick,
                           bool (*is)(const zs_polygonize_job *, int, uint32_t))
{
  uint32_t bits = 0;
  for (unsigned x = 0; x < ZS_REACH; x++)
    bits |= (uint32_t)is(job, 0, zs_lattice_index(brick, 0, x)) << x;
  return bits;
}

static bool local_is(const zs_polygonize_job *job, const zs_brick *brick, int axis, unsigned local,
                     bool (*is)(const zs_polygonize_job *, int, uint32_t))
{
  return is(job, axis, zs_lattice_index(brick, axis, local));
}

/* Take edges without a vertex of their own off a brick.  A corner of the solid on two or three faces of
 * the grid has an edge to a pad across each of them, all cut at the corner
 * itself: only the edge across the first face has a vertex.  Without caps edges
 * to pads have none. */
static void leave_out_pads(const zs_polygonize_job *job, zs_brick *brick)
{
  const uint32_t to_pad = plane_bits(job, brick, zs_lattice_pad_edge);
  const uint32_t on_face = plane_bits(job, brick, zs_lattice_on_face);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
    if (!job->cap)
      brick->crossing[0][row] &= (uint16_t)~to_pad;
    if (local_is(job, brick, 1, y, zs_lattice_pad_edge))
      brick->crossing[1][row] &= (uint16_t)(job->cap ? ~on_face : 0);
    if (local_is(job, brick, 2, z, zs_lattice_pad_edge))
      brick->crossing[2][row] &=
        (uint16_t)(job->cap && !local_is(job, brick, 1, y, zs_lattice_on_face) ? ~on_face : 0);
  }
}

/* ---- Cells -------------------------------------------------------------------------- */

static bool is_pad_cell(const zs_polygonize_job *job, int axis, uint32_t i)
{
  return zs_lattice_pad_edge(job, axis, i);
}

bool zs_brick_is_pad_cell(const zs_polygonize_job *job, const zs_brick *brick, unsigned x,
                          unsigned y, unsigned z)
{
  return local_is(job, brick, 0, x, is_pad_cell) || local_is(job, brick, 1, y, is_pad_cell) ||
         local_is(job, brick, 2, z, is_pad_cell);
}

/* Cells outside two or three faces of the grid have no triangles: their vertices
 * coincide. */
uint32_t zs_brick_active_cells(const zs_polygonize_job *job, const zs_brick *brick,
                               const zs_brick_rows rows, unsigned y, unsigned z)
{
  uint32_t any = rows[z][y] | rows[z][y + 1] | rows[z + 1][y] | rows[z + 1][y + 1];
  uint32_t all = rows[z][y] & rows[z][y + 1] & rows[z + 1][y] & rows[z + 1][y + 1];
  uint32_t active = (any | any >> 1) & ~(all & all >> 1) & 0xffff;
  if (!active || !brick->at_face)
    return active;
  unsigned outer = (unsigned)local_is(job, brick, 1, y, is_pad_cell) +
                   (unsigned)local_is(job, brick, 2, z, is_pad_cell);
  unsigned allowed = job->cap ? 2 : 1; /* sides that it must not be outside of */
  if (outer >= allowed)
    return 0;
  return outer + 1 == allowed ? active & ~plane_bits(job, brick, is_pad_cell) : active;
}

void zs_brick_find_cells(const zs_polygonize_job *job, const zs_brick *brick,
                         const zs_brick_rows rows, zs_row_bits cells)
{
  zs_row_kernels_of(zs_eval_isa(job->workers[0].eval))->cells(rows, cells);
  for (unsigned row = 0; brick->at_face && row < ZS_BRICK_ROWS; row++)
    cells[row] =
      (uint16_t)zs_brick_active_cells(job, brick, rows, row % ZS_BRICK, row / ZS_BRICK);
}

void zs_polygonize_count(const zs_polygonize_job *job, zs_brick *brick)
{
  const zs_row_kernels *kernels = zs_row_kernels_of(zs_eval_isa(job->workers[0].eval));
  zs_brick_rows rows;
  zs_row_bits cells;
  zs_brick_gather_signs(job, brick, rows);
  kernels->crossing((const uint32_t(*)[ZS_REACH])rows, brick->crossing);
  if (brick->at_face)
    leave_out_pads(job, brick);
  brick->vertex_count = kernels->first((const zs_row_bits *)brick->crossing, brick->first);
  zs_brick_find_cells(job, brick, (const uint32_t(*)[ZS_REACH])rows, cells);
  brick->triangle_count = 0;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned bits = cells[row]; bits; bits &= bits - 1) {
      unsigned inside = zs_brick_cell_case((const uint32_t(*)[ZS_REACH])rows,
                                           (unsigned)__builtin_ctz(bits), row % ZS_BRICK,
                                           row / ZS_BRICK);
      brick->triangle_count += job->cases.cases[inside].triangle_count;
    }
}

/* ---- Vertex numbers --------------------------------------------------------------------- */

/* Number the vertices of a row's edges. */
static void number_row(const zs_brick *brick, unsigned row, uint32_t *at)
{
  uint32_t number = (uint32_t)brick->first_vertex + brick->first[row];
  for (unsigned axis = 0; axis < 3; axis++, at += ZS_REACH_CORNERS)
    for (unsigned edges = brick->crossing[axis][row]; edges; edges &= edges - 1)
      at[__builtin_ctz(edges)] = number++;
}

/* Number the vertices of those that start at the first corner. */
static void number_first(const zs_brick *brick, unsigned row, uint32_t *at)
{
  uint32_t number = (uint32_t)brick->first_vertex + brick->first[row];
  if (!((brick->crossing[0][row] | brick->crossing[1][row] | brick->crossing[2][row]) & 1))
    return;
  for (unsigned axis = 0; axis < 3; axis++, at += ZS_REACH_CORNERS) {
    const unsigned edges = brick->crossing[axis][row];
    if (edges & 1)
      *at = number;
    number += zs_ones(edges);
  }
}

/* Number the vertices of a brick's own edges, or of an upper neighbour's as far as
 * its cells reach them: in the first plane along the axes to it.  `d`: see
 * zs_brick_upper. */
static void number_owned(const zs_brick *owner, unsigned d, zs_edge_numbers numbers)
{
  const unsigned y_end = d & 2 ? 1 : ZS_BRICK, z_end = d & 4 ? 1 : ZS_BRICK;
  uint32_t *start = numbers + zs_reach_offset(d & 1 ? ZS_BRICK : 0, d & 2 ? ZS_BRICK : 0,
                                              d & 4 ? ZS_BRICK : 0);
  for (unsigned z = 0; z < z_end; z++)
    for (unsigned y = 0; y < y_end; y++) {
      uint32_t *at = start + zs_reach_offset(0, y, z);
      if (d & 1)
        number_first(owner, z * ZS_BRICK + y, at);
      else
        number_row(owner, z * ZS_BRICK + y, at);
    }
}

/* Edges to pads that share their vertex with the edge across the first face
 * (see find_crossings). */
static void share_numbers(const zs_polygonize_job *job, const zs_brick *brick,
                          zs_edge_numbers numbers)
{
  unsigned c[3];
  for (c[2] = 0; c[2] < ZS_REACH; c[2]++)
    for (c[1] = 0; c[1] < ZS_REACH; c[1]++)
      for (c[0] = 0; c[0] < ZS_REACH; c[0]++) {
        const uint32_t *number = NULL;
        for (int axis = 0; axis < 3; axis++) {
          uint32_t i = zs_lattice_index(brick, axis, c[axis]);
          if (!zs_lattice_on_face(job, axis, i))
            continue;
          unsigned from[3] = {c[0], c[1], c[2]};
          from[axis] -= i == 1; /* plane 1 is the second of its brick */
          uint32_t *own =
            &numbers[(size_t)axis * ZS_REACH_CORNERS + zs_reach_offset(from[0], from[1], from[2])];
          if (number)
            *own = *number;
          else
            number = own;
        }
      }
}

static bool touches_two_faces(const zs_polygonize_job *job, const zs_brick *brick)
{
  unsigned faces = 0;
  for (int axis = 0; axis < 3; axis++) {
    bool touches = false;
    for (unsigned i = 0; i < ZS_REACH; i++)
      touches = touches || local_is(job, brick, axis, i, zs_lattice_on_face);
    faces += touches;
  }
  return faces > 1;
}

void zs_brick_number_edges(const zs_polygonize_job *job, const zs_brick *brick,
                           zs_edge_numbers numbers)
{
  for (unsigned d = 0; d < 8; d++) {
    const zs_brick *owner = zs_brick_upper(job, brick, d);
    if (owner->vertex_count)
      number_owned(owner, d, numbers);
  }
  if (job->cap && brick->at_face && touches_two_faces(job, brick))
    share_numbers(job, brick, numbers);
}

void zs_cell_edge_offsets(size_t offsets[ZS_CELL_EDGES])
{
  for (unsigned e = 0; e < ZS_CELL_EDGES; e++) {
    unsigned start = zs_cell_edge_start(e);
    offsets[e] =
      (size_t)(e / 4) * ZS_REACH_CORNERS + zs_reach_offset(start & 1, start >> 1 & 1, start >> 2);
  }
}

/* ---- Triangles ------------------------------------------------------------------------ */

/* What one brick's triangles are written with. */
typedef struct writing {
  const zs_polygonize_job *job;
  const zs_brick *brick;
  const uint32_t *numbers;
  size_t offsets[ZS_CELL_EDGES];
  /* By case: of the corners of its triangles. */
  const uint16_t (*corners)[3 * ZS_CELL_TRIANGLES];
  uint32_t *triangle; /* the next one */
} writing;

static void put(writing *w, uint32_t a, uint32_t b, uint32_t c)
{
  w->triangle[0] = a;
  w->triangle[1] = b;
  w->triangle[2] = c;
  w->triangle += 3;
}

/* The face of a cell that two edges of it lie on: 2 * axis + side. */
static unsigned common_face(unsigned a, unsigned b)
{
  unsigned face = 0;
  for (unsigned axis = 0; axis < 3; axis++) {
    unsigned side = zs_cell_edge_start(a) >> axis & 1;
    if (a / 4 != axis && b / 4 != axis && (zs_cell_edge_start(b) >> axis & 1) == side)
      face = 2 * axis + side;
  }
  return face;
}

/* The edges of a face, one bit each. */
static unsigned face_edges(unsigned face)
{
  unsigned edges = 0;
  for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
    if (e / 4 != face / 2 && (zs_cell_edge_start(e) >> face / 2 & 1) == (face & 1))
      edges |= 1u << e;
  return edges;
}

/* What edges of a face are in the neighbour across it. */
static unsigned across(unsigned edges, unsigned face)
{
  unsigned there = 0;
  for (; edges; edges &= edges - 1) {
    unsigned e = (unsigned)__builtin_ctz(edges);
    there |= 1u << (face / 2 == (e / 4 + 1) % 3 ? e ^ 1 : e ^ 2);
  }
  return there;
}

/* Whether a triangle faces the way of the normal at its second corner.  The two
 * cells that ask pass the corners in the same order, and get the same answer. */
static bool faces_normal(const zs_mesh *mesh, uint32_t a, uint32_t b, uint32_t c)
{
  const float *p = mesh->positions + 3 * (size_t)a, *q = mesh->positions + 3 * (size_t)b,
              *r = mesh->positions + 3 * (size_t)c, *n = mesh->normals + 3 * (size_t)b;
  double dot = 0;
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    dot += n[k] * (((double)q[i] - p[i]) * ((double)r[j] - p[j]) -
                   ((double)q[j] - p[j]) * ((double)r[i] - p[i]));
  }
  return dot > 0;
}

/* The crease next to crease number `own` across the side u, v of its loop, when
 * a sharp edge leads there.  Two loops that meet twice in a face are not joined:
 * both sides would become the same edge. */
static bool find_next(const writing *w, const int cell[3], uint32_t own, unsigned from,
                      unsigned to, uint32_t u, uint32_t v, uint32_t *next)
{
  const float *normals = w->job->mesh->normals;
  if (!zs_crease_between(normals + 3 * (size_t)u, normals + 3 * (size_t)v))
    return false;
  unsigned face = common_face(from, to), all = face_edges(face);
  int there[3] = {cell[0], cell[1], cell[2]};
  there[face / 2] += face & 1 ? 1 : -1;
  if ((w->brick->creases[own].edges & all) == all &&
      zs_crease_find(w->job, w->brick, there, across(all, face), next))
    return false;
  return zs_crease_find(w->job, w->brick, there, across(1u << from | 1u << to, face), next);
}

/* The triangle of a crease's fan at one side of its loop.  Where the sharp edge
 * leads across that side to the crease of the next cell, both cells turn theirs:
 * the side then joins the creases. */
static void put_side(writing *w, const int cell[3], size_t at, uint32_t own, unsigned from,
                     unsigned to)
{
  uint32_t u = w->numbers[at + w->offsets[from]], v = w->numbers[at + w->offsets[to]], next;
  uint32_t crease = (uint32_t)(w->brick->first_crease + own);
  if (find_next(w, cell, own, from, to, u, v, &next) &&
      faces_normal(w->job->mesh, crease, u, next) && faces_normal(w->job->mesh, next, v, crease))
    put(w, crease, u, next);
  else
    put(w, u, v, crease);
}

/* The triangles of a cell with creases: those of the brick from `crease` to
 * `end`. */
static void write_creased(writing *w, const zs_cell_case *cell, const int xyz[3],
                          uint32_t crease, uint32_t end)
{
  const size_t at = zs_reach_offset((unsigned)xyz[0], (unsigned)xyz[1], (unsigned)xyz[2]);
  const uint8_t *loop = cell->loops, *triangles = cell->triangles;
  for (unsigned l = 0; l < cell->loop_count; l++) {
    const unsigned n = cell->loop_lengths[l];
    uint32_t own = crease;
    while (own < end && !(w->brick->creases[own].edges >> loop[0] & 1))
      own++;
    if (own < end)
      for (unsigned i = 0; i < n; i++)
        put_side(w, xyz, at, own, loop[i], loop[(i + 1) % n]);
    else
      for (unsigned i = 0; i < 3 * (n - 2); i += 3)
        put(w, w->numbers[at + w->offsets[triangles[i]]],
            w->numbers[at + w->offsets[triangles[i + 1]]],
            w->numbers[at + w->offsets[triangles[i + 2]]]);
    triangles += 3 * (n - 2);
    loop += n;
  }
}

/* Those of one without. */
static void write_plain(writing *w, unsigned inside, unsigned count, const uint32_t *numbers)
{
  const uint16_t *corner = w->corners[inside];
  for (unsigned i = 0; i < 3 * count; i += 3)
    put(w, numbers[corner[i]], numbers[corner[i + 1]], numbers[corner[i + 2]]);
}

static void write_triangles(writing *w, zs_edge_numbers numbers)
{
  const zs_brick *brick = w->brick;
  zs_brick_rows rows;
  zs_row_bits cells;
  uint32_t crease = 0;
  zs_brick_gather_signs(w->job, brick, rows);
  zs_brick_find_cells(w->job, brick, (const uint32_t(*)[ZS_REACH])rows, cells);
  zs_brick_number_edges(w->job, brick, numbers);
  w->numbers = numbers;
  w->triangle = w->job->mesh->triangles + 3 * brick->first_triangle;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned bits = cells[row]; bits; bits &= bits - 1) {
      const unsigned x = (unsigned)__builtin_ctz(bits), y = row % ZS_BRICK, z = row / ZS_BRICK;
      const unsigned inside = zs_brick_cell_case((const uint32_t(*)[ZS_REACH])rows, x, y, z);
      const zs_cell_case *cell = &w->job->cases.cases[inside];
      const uint32_t first = crease;
      while (crease < brick->crease_count && brick->creases[crease].cell == row * ZS_BRICK + x)
        crease++;
      if (crease == first)
        write_plain(w, inside, cell->triangle_count, numbers + zs_reach_offset(x, y, z));
      else
        write_creased(w, cell, (const int[3]){(int)x, (int)y, (int)z}, first, crease);
    }
}

bool zs_polygonize_triangles(zs_polygonize_job *job)
{
  writing shared = {.job = job};
  uint16_t corners[ZS_CELL_CASES][3 * ZS_CELL_TRIANGLES];
  zs_edge_numbers *scratch = calloc(job->threads, sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  zs_cell_edge_offsets(shared.offsets);
  for (unsigned c = 0; c < ZS_CELL_CASES; c++)
    for (unsigned i = 0; i < 3u * job->cases.cases[c].triangle_count; i++)
      corners[c][i] = (uint16_t)shared.offsets[job->cases.cases[c].triangles[i]];
  shared.corners = (const uint16_t(*)[3 * ZS_CELL_TRIANGLES])corners;
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++) {
    writing w = shared;
    w.brick = job->active[i];
    write_triangles(&w, scratch[zs_polygonize_thread()]);
  }
  free(scratch);
  return true;
}
