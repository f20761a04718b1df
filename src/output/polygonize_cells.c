/* The polygonizer's cells: which edges carry vertices, and the triangles. */
#include "output/polygonize.h"

#include "base/diagnostic.h"

#include <stdlib.h>
#include <string.h>

enum {
  PLANE = ZS_REACH * ZS_REACH,
  VOLUME = PLANE * ZS_REACH /* corners that a brick's cells reach */
};

/* Offset of local corner (x, y, z) in arrays of VOLUME. */
static size_t reach_offset(unsigned x, unsigned y, unsigned z)
{
  return (size_t)z * PLANE + (size_t)y * ZS_REACH + x;
}

void zs_brick_gather_signs(const zs_polygonize_job *job, const zs_brick *brick, zs_brick_rows rows)
{
  const zs_brick *from[8];
  for (unsigned d = 0; d < 8; d++) {
    uint32_t at[3];
    for (int k = 0; k < 3; k++)
      at[k] = brick->index[k] + (d >> k & 1);
    from[d] = d ? zs_lattice_brick(job, at) : brick;
  }
  for (unsigned z = 0; z < ZS_REACH; z++)
    for (unsigned y = 0; y < ZS_REACH; y++) {
      unsigned d = (y == ZS_BRICK ? 2u : 0) | (z == ZS_BRICK ? 4u : 0);
      unsigned row = z % ZS_BRICK * ZS_BRICK + y % ZS_BRICK;
      rows[z][y] = from[d]->signs[row] | (from[d | 1]->signs[row] & 1u) << ZS_BRICK;
    }
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

/* The crossing edges of a brick.  A corner of the solid on two or three faces of
 * the grid has an edge to a pad across each of them, all cut at the corner
 * itself: only the edge across the first face has a vertex.  Without caps edges
 * to pads have none. */
static void find_crossings(const zs_polygonize_job *job, const zs_brick_rows rows, zs_brick *brick)
{
  const uint32_t to_pad = plane_bits(job, brick, zs_lattice_pad_edge);
  const uint32_t on_face = plane_bits(job, brick, zs_lattice_on_face);
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
    uint32_t signs = rows[z][y];
    uint32_t x_edges = signs ^ signs >> 1, y_edges = signs ^ rows[z][y + 1],
             z_edges = signs ^ rows[z + 1][y];
    if (!job->cap)
      x_edges &= ~to_pad;
    if (local_is(job, brick, 1, y, zs_lattice_pad_edge))
      y_edges &= job->cap ? ~on_face : 0;
    if (local_is(job, brick, 2, z, zs_lattice_pad_edge))
      z_edges &= job->cap && !local_is(job, brick, 1, y, zs_lattice_on_face) ? ~on_face : 0;
    brick->crossing[0][row] = (uint16_t)x_edges;
    brick->crossing[1][row] = (uint16_t)y_edges;
    brick->crossing[2][row] = (uint16_t)z_edges;
  }
}

/* ---- Cells -------------------------------------------------------------------------- */

static bool is_pad_cell(const zs_polygonize_job *job, int axis, uint32_t i)
{
  return zs_lattice_pad_edge(job, axis, i);
}

/* Bits x of the cells of a row that have triangles.  Cells outside two or three
 * faces of the grid have none: their vertices coincide. */
static uint32_t active_cells(const zs_polygonize_job *job, const zs_brick *brick,
                             const zs_brick_rows rows, uint32_t pads, unsigned y, unsigned z)
{
  uint32_t any = rows[z][y] | rows[z][y + 1] | rows[z + 1][y] | rows[z + 1][y + 1];
  uint32_t all = rows[z][y] & rows[z][y + 1] & rows[z + 1][y] & rows[z + 1][y + 1];
  uint32_t active = (any | any >> 1) & ~(all & all >> 1) & 0xffff;
  if (!active)
    return 0;
  unsigned outer = (unsigned)local_is(job, brick, 1, y, is_pad_cell) +
                   (unsigned)local_is(job, brick, 2, z, is_pad_cell);
  if (!job->cap)
    return outer ? 0 : active & ~pads;
  return outer == 2 ? 0 : outer == 1 ? active & ~pads : active;
}

static unsigned cell_case(const zs_brick_rows rows, unsigned x, unsigned y, unsigned z)
{
  return (rows[z][y] >> x & 3) | (rows[z][y + 1] >> x & 3) << 2 | (rows[z + 1][y] >> x & 3) << 4 |
         (rows[z + 1][y + 1] >> x & 3) << 6;
}

void zs_polygonize_count(const zs_polygonize_job *job, const zs_contour_table *table,
                         zs_brick *brick)
{
  zs_brick_rows rows;
  zs_brick_gather_signs(job, brick, rows);
  find_crossings(job, rows, brick);
  brick->vertex_count = 0;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    brick->first[row] = (uint16_t)brick->vertex_count;
    for (unsigned axis = 0; axis < 3; axis++)
      brick->vertex_count += (unsigned)__builtin_popcount(brick->crossing[axis][row]);
  }
  const uint32_t pads = plane_bits(job, brick, is_pad_cell);
  brick->triangle_count = 0;
  for (unsigned z = 0; z < ZS_BRICK; z++)
    for (unsigned y = 0; y < ZS_BRICK; y++)
      for (uint32_t cells = active_cells(job, brick, rows, pads, y, z); cells; cells &= cells - 1) {
        unsigned x = (unsigned)__builtin_ctz(cells);
        brick->triangle_count += table->cases[cell_case(rows, x, y, z)].triangle_count;
      }
}

/* ---- Triangles ------------------------------------------------------------------------ */

/* Vertex numbers by axis and start of their edge; only crossing edges are ever
 * written and read. */
typedef uint32_t edge_numbers[3][VOLUME];

/* Number the vertices of one brick's edges as far as brick `to` reaches them:
 * `d` has a bit for every axis along which the owner is the next brick. */
static void number_edges(const zs_brick *owner, unsigned d, edge_numbers numbers)
{
  const unsigned x_bits = d & 1 ? 1 : 0xffff;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
    if ((d & 2 && y) || (d & 4 && z))
      continue;
    size_t start = reach_offset(d & 1 ? ZS_BRICK : 0, d & 2 ? ZS_BRICK : y, d & 4 ? ZS_BRICK : z);
    uint32_t number = (uint32_t)owner->first_vertex + owner->first[row];
    for (unsigned axis = 0; axis < 3; axis++)
      for (unsigned edges = owner->crossing[axis][row]; edges; edges &= edges - 1, number++)
        if (edges & -edges & x_bits)
          numbers[axis][start + (unsigned)__builtin_ctz(edges)] = number;
  }
}

/* Edges to pads that share their vertex with the edge across the first face
 * (see find_crossings). */
static void share_numbers(const zs_polygonize_job *job, const zs_brick *brick,
                          edge_numbers numbers)
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
          uint32_t *own = &numbers[axis][reach_offset(from[0], from[1], from[2])];
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

static void write_triangles(const zs_polygonize_job *job, const zs_contour_table *table,
                            const zs_brick *brick, edge_numbers numbers)
{
  uint32_t *triangle = job->mesh->triangles + 3 * brick->first_triangle;
  size_t edge_offset[ZS_CELL_EDGES];
  zs_brick_rows rows;
  zs_brick_gather_signs(job, brick, rows);
  for (unsigned d = 0; d < 8; d++) {
    uint32_t at[3];
    for (int k = 0; k < 3; k++)
      at[k] = brick->index[k] + (d >> k & 1);
    const zs_brick *owner = d ? zs_lattice_brick(job, at) : brick;
    if (owner->vertex_count)
      number_edges(owner, d, numbers);
  }
  if (job->cap && touches_two_faces(job, brick))
    share_numbers(job, brick, numbers);
  for (unsigned e = 0; e < ZS_CELL_EDGES; e++) {
    unsigned start = zs_cell_edge_start(e);
    edge_offset[e] = e / 4 * VOLUME + reach_offset(start & 1, start >> 1 & 1, start >> 2);
  }
  const uint32_t pads = plane_bits(job, brick, is_pad_cell);
  const uint32_t *flat = numbers[0];
  for (unsigned z = 0; z < ZS_BRICK; z++)
    for (unsigned y = 0; y < ZS_BRICK; y++)
      for (uint32_t cells = active_cells(job, brick, rows, pads, y, z); cells; cells &= cells - 1) {
        unsigned x = (unsigned)__builtin_ctz(cells);
        const zs_cell_case *cell = &table->cases[cell_case(rows, x, y, z)];
        size_t at = reach_offset(x, y, z);
        for (unsigned i = 0; i < 3u * cell->triangle_count; i++)
          *triangle++ = flat[at + edge_offset[cell->edges[i]]];
      }
}

bool zs_polygonize_triangles(zs_polygonize_job *job, const zs_contour_table *table)
{
  edge_numbers *scratch = calloc(job->threads, sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
  for (unsigned t = 0; t < job->threads; t++)
    job->workers[t].scratch = scratch[t];
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++)
    write_triangles(job, table, job->active[i],
                    job->workers[zs_polygonize_thread()].scratch);
  free(scratch);
  return true;
}
