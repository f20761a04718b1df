/* The polygonizer's cells: which edges carry vertices, and the triangles. */
#include "output/polygonize.h"
#include "output/polygonize_rows.h"

#include "base/diagnostic.h"
#include "base/threads.h"

#include <stdlib.h>
#include <string.h>

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

/* Take edges without a vertex of their own off a brick.  A corner of the solid on
 * two or three faces of the grid has an edge to a pad across each of them, all cut
 * at the corner itself: only the edge across the first face has a vertex, unless
 * edges are to become faces.  Without caps edges to pads have none. */
static void leave_out_pads(const zs_polygonize_job *job, zs_brick *brick)
{
  const uint32_t to_pad = plane_bits(job, brick, zs_lattice_pad_edge);
  const uint32_t on_face = job->features ? 0 : plane_bits(job, brick, zs_lattice_on_face);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
    if (!job->cap)
      brick->crossing[0][row] &= (uint16_t)~to_pad;
    if (local_is(job, brick, 1, y, zs_lattice_pad_edge))
      brick->crossing[1][row] &= (uint16_t)(job->cap ? ~on_face : 0);
    if (local_is(job, brick, 2, z, zs_lattice_pad_edge))
      brick->crossing[2][row] &=
        (uint16_t)(job->cap && (job->features || !local_is(job, brick, 1, y, zs_lattice_on_face))
                     ? ~on_face
                     : 0);
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

unsigned zs_brick_pad_edges(const zs_polygonize_job *job, const zs_brick *brick,
                            const unsigned cell[3])
{
  unsigned edges = 0;
  for (int axis = 0; axis < 3; axis++)
    if (local_is(job, brick, axis, cell[axis], is_pad_cell))
      edges |= 0xfu << 4 * axis;
  return edges;
}

unsigned zs_lattice_cell_case(const zs_polygonize_job *job, const uint32_t cell[3])
{
  unsigned inside = 0;
  for (unsigned c = 0; c < 8; c++) {
    uint32_t at[3], index[3];
    for (unsigned k = 0; k < 3; k++) {
      at[k] = cell[k] + (c >> k & 1);
      index[k] = at[k] / ZS_BRICK;
    }
    unsigned row = at[2] % ZS_BRICK * ZS_BRICK + at[1] % ZS_BRICK;
    inside |= (zs_lattice_brick(job, index)->signs[row] >> at[0] % ZS_BRICK & 1u) << c;
  }
  return inside;
}

/* Cells outside two or three faces of the grid have no triangles: their vertices
 * coincide.  As vertices of the features method they are needed. */
uint32_t zs_brick_active_cells(const zs_polygonize_job *job, const zs_brick *brick,
                               const zs_brick_rows rows, unsigned y, unsigned z)
{
  uint32_t any = rows[z][y] | rows[z][y + 1] | rows[z + 1][y] | rows[z + 1][y + 1];
  uint32_t all = rows[z][y] & rows[z][y + 1] & rows[z + 1][y] & rows[z + 1][y + 1];
  uint32_t active = (any | any >> 1) & ~(all & all >> 1) & 0xffff;
  if (!active || !brick->at_face || job->features)
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
  brick->triangle_count = 2 * brick->vertex_count; /* of the features method */
  if (job->features)
    return;
  zs_brick_find_cells(job, brick, (const uint32_t(*)[ZS_REACH])rows, cells);
  brick->triangle_count = brick->loop_count = 0;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned bits = cells[row]; bits; bits &= bits - 1) {
      unsigned inside = zs_brick_cell_case((const uint32_t(*)[ZS_REACH])rows,
                                           (unsigned)__builtin_ctz(bits), row % ZS_BRICK,
                                           row / ZS_BRICK);
      brick->triangle_count += job->cases.cases[inside].triangle_count;
      brick->loop_count += job->cases.cases[inside].loop_count;
    }
}

/* ---- Vertex numbers --------------------------------------------------------------------- */

/* Number the vertices of a row's edges. */
static void number_row(const zs_brick *brick, unsigned row, uint32_t *at)
{
  uint32_t number = (uint32_t)brick->first_vertex + brick->first[row];
  if (!zs_row_has(brick->crossing, row))
    return;
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

/* Number the vertices of an upper neighbour's edges as far as a brick's cells reach them:
 * in the first plane along the axes to it.  `d`: see zs_brick_upper. */
static void number_reached(const zs_brick *owner, unsigned d, zs_edge_numbers numbers)
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
  if (brick->vertex_count)
    zs_row_kernels_of(zs_eval_isa(job->workers[0].eval))->numbers(brick, &job->bit_table, numbers);
  for (unsigned d = 1; d < 8; d++) {
    const zs_brick *owner = zs_brick_upper(job, brick, d);
    if (owner->vertex_count)
      number_reached(owner, d, numbers);
  }
  if (job->cap && !job->features && brick->at_face && touches_two_faces(job, brick))
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

enum { CELL_FACES = 6 }; /* of a cell: 2 * axis + side */

/* What edges of a cell have to do with its faces. */
typedef struct face_table {
  uint8_t common[ZS_CELL_EDGES][ZS_CELL_EDGES]; /* the face that two edges lie on */
  uint16_t edges[CELL_FACES];                   /* of a face, one bit each */
  uint8_t across[CELL_FACES][ZS_CELL_EDGES];    /* an edge in the neighbour across a face */
} face_table;

static void make_face_table(face_table *t)
{
  memset(t, 0, sizeof *t);
  for (unsigned face = 0; face < CELL_FACES; face++)
    for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
      if (e / 4 != face / 2 && (zs_cell_edge_start(e) >> face / 2 & 1) == (face & 1)) {
        t->edges[face] |= (uint16_t)(1u << e);
        t->across[face][e] = (uint8_t)(face / 2 == (e / 4 + 1) % 3 ? e ^ 1 : e ^ 2);
      }
  for (unsigned a = 0; a < ZS_CELL_EDGES; a++)
    for (unsigned b = 0; b < ZS_CELL_EDGES; b++)
      for (unsigned face = 0; face < CELL_FACES; face++)
        if (t->edges[face] >> a & t->edges[face] >> b & 1)
          t->common[a][b] = (uint8_t)face;
}

/* What all bricks' triangles are written with. */
typedef struct tables {
  size_t offsets[ZS_CELL_EDGES];
  uint16_t corners[ZS_CELL_CASES][3 * ZS_CELL_TRIANGLES]; /* offsets of triangles' corners */
  face_table faces;
} tables;

/* One thread's working data. */
typedef struct scratch {
  zs_edge_numbers numbers;
  uint16_t crease_of[ZS_BRICK_CORNERS]; /* 1 + number of the first crease of a cell, or 0 */
} scratch;

/* What one brick's triangles are written with. */
typedef struct writing {
  const zs_polygonize_job *job;
  const tables *tables;
  const zs_brick *brick;
  const uint32_t *numbers;
  const uint16_t *crease_of;
  uint32_t *triangle; /* the next one */
} writing;

static void put(writing *w, uint32_t a, uint32_t b, uint32_t c)
{
  w->triangle[0] = a;
  w->triangle[1] = b;
  w->triangle[2] = c;
  w->triangle += 3;
}

/* Whether a triangle faces the way of the normal at its second corner.  The two
 * cells that ask pass the corners in the same order, and get the same answer. */
static bool faces_normal(const zs_mesh *mesh, uint32_t a, uint32_t b, uint32_t c)
{
  const float *p = mesh->positions + 3 * (size_t)a, *q = mesh->positions + 3 * (size_t)b,
              *r = mesh->positions + 3 * (size_t)c, *n = mesh->normals + 3 * (size_t)b;
  const float u[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
  const float v[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
  return n[0] * (u[1] * v[2] - u[2] * v[1]) + n[1] * (u[2] * v[0] - u[0] * v[2]) +
           n[2] * (u[0] * v[1] - u[1] * v[0]) > 0;
}

/* The crease whose loop joins the given edges of a cell. */
static bool find_crease(const writing *w, const int cell[3], unsigned edges, uint32_t *vertex)
{
  const zs_brick *brick = w->brick;
  if ((unsigned)(cell[0] | cell[1] | cell[2]) >= ZS_BRICK)
    return zs_crease_find(w->job, brick, cell, edges, vertex);
  const unsigned number = (unsigned)((cell[2] * ZS_BRICK + cell[1]) * ZS_BRICK + cell[0]);
  if (!w->crease_of[number])
    return false;
  for (uint32_t c = w->crease_of[number] - 1u;
       c < brick->crease_count && brick->creases[c].cell == number; c++)
    if ((brick->creases[c].edges & edges) == edges) {
      *vertex = (uint32_t)(brick->first_crease + c);
      return true;
    }
  return false;
}

/* The crease next to crease number `own` across the side u, v of its loop, when
 * a sharp edge leads there.  Two loops that meet twice in a face are not joined:
 * both sides would become the same edge. */
static bool find_next(const writing *w, const int cell[3], uint32_t own, unsigned from,
                      unsigned to, uint32_t u, uint32_t v, uint32_t *next)
{
  const float *normals = w->job->mesh->normals;
  const face_table *faces = &w->tables->faces;
  if (!zs_crease_between(normals + 3 * (size_t)u, normals + 3 * (size_t)v))
    return false;
  const unsigned face = faces->common[from][to], all = faces->edges[face];
  const uint8_t *across = faces->across[face];
  int there[3] = {cell[0], cell[1], cell[2]};
  there[face / 2] += face & 1 ? 1 : -1;
  if (!find_crease(w, there, 1u << across[from] | 1u << across[to], next))
    return false;
  if ((w->brick->creases[own].edges & all) != all)
    return true;
  /* The loop meets the face twice: so may the other one. */
  uint32_t other;
  return !find_crease(w, there, faces->edges[face ^ 1], &other);
}

/* The triangle of a crease's fan at one side of its loop.  Where the sharp edge
 * leads across that side to the crease of the next cell, both cells turn theirs:
 * the side then joins the creases. */
static void put_side(writing *w, const int cell[3], size_t at, uint32_t own, unsigned from,
                     unsigned to)
{
  uint32_t u = w->numbers[at + w->tables->offsets[from]], v = w->numbers[at + w->tables->offsets[to]], next;
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
        put(w, w->numbers[at + w->tables->offsets[triangles[i]]],
            w->numbers[at + w->tables->offsets[triangles[i + 1]]],
            w->numbers[at + w->tables->offsets[triangles[i + 2]]]);
    triangles += 3 * (n - 2);
    loop += n;
  }
}

/* Those of one without. */
static void write_plain(writing *w, unsigned inside, unsigned count, const uint32_t *numbers)
{
  const uint16_t *corner = w->tables->corners[inside];
  for (unsigned i = 0; i < 3 * count; i += 3)
    put(w, numbers[corner[i]], numbers[corner[i + 1]], numbers[corner[i + 2]]);
}

/* Tell where the creases of a cell are, or forget it. */
static void enter_creases(const zs_brick *brick, bool known, uint16_t *crease_of)
{
  for (uint32_t c = brick->crease_count; c-- > 0;)
    crease_of[brick->creases[c].cell] = (uint16_t)(known ? c + 1 : 0);
}

static void write_triangles(writing *w, scratch *own)
{
  const zs_brick *brick = w->brick;
  zs_brick_rows rows;
  zs_row_bits cells;
  zs_brick_gather_signs(w->job, brick, rows);
  zs_brick_find_cells(w->job, brick, (const uint32_t(*)[ZS_REACH])rows, cells);
  zs_brick_number_edges(w->job, brick, own->numbers);
  enter_creases(brick, true, own->crease_of);
  w->numbers = own->numbers;
  w->crease_of = own->crease_of;
  w->triangle = w->job->mesh->triangles + 3 * brick->first_triangle;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++)
    for (unsigned bits = cells[row]; bits; bits &= bits - 1) {
      const unsigned x = (unsigned)__builtin_ctz(bits), y = row % ZS_BRICK, z = row / ZS_BRICK;
      const unsigned inside = zs_brick_cell_case((const uint32_t(*)[ZS_REACH])rows, x, y, z);
      const zs_cell_case *cell = &w->job->cases.cases[inside];
      const uint32_t first = own->crease_of[row * ZS_BRICK + x];
      if (!first) {
        write_plain(w, inside, cell->triangle_count, own->numbers + zs_reach_offset(x, y, z));
        continue;
      }
      uint32_t end = first;
      while (end < brick->crease_count && brick->creases[end].cell == row * ZS_BRICK + x)
        end++;
      write_creased(w, cell, (const int[3]){(int)x, (int)y, (int)z}, first - 1, end);
    }
  enter_creases(brick, false, own->crease_of);
}

bool zs_polygonize_triangles(zs_polygonize_job *job)
{
  tables *shared = malloc(sizeof *shared);
  scratch *own = calloc(job->threads, sizeof *own);
  bool done = shared && own;
  if (done) {
    make_face_table(&shared->faces);
    zs_cell_edge_offsets(shared->offsets);
    for (unsigned c = 0; c < ZS_CELL_CASES; c++)
      for (unsigned i = 0; i < 3u * job->cases.cases[c].triangle_count; i++)
        shared->corners[c][i] = (uint16_t)shared->offsets[job->cases.cases[c].triangles[i]];
#pragma omp parallel for schedule(dynamic, 4) num_threads(job->threads)
    for (size_t i = 0; i < job->active_count; i++) {
      writing w = {.job = job, .tables = shared, .brick = job->active[i]};
      write_triangles(&w, &own[zs_thread_number()]);
    }
  }
  free(shared);
  free(own);
  return done || zs_fail_memory(job->diag);
}
