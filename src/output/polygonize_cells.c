/* The polygonizer's cells: which edges carry vertices, and the triangles. */
#include "output/polygonize.h"

#include "base/diagnostic.h"

#include <stdlib.h>

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
  if (!active)
    return 0;
  unsigned outer = (unsigned)local_is(job, brick, 1, y, is_pad_cell) +
                   (unsigned)local_is(job, brick, 2, z, is_pad_cell);
  unsigned allowed = job->cap ? 2 : 1; /* sides that it must not be outside of */
  if (outer >= allowed)
    return 0;
  return outer + 1 == allowed ? active & ~plane_bits(job, brick, is_pad_cell) : active;
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
  brick->triangle_count = 0;
  for (unsigned z = 0; z < ZS_BRICK; z++)
    for (unsigned y = 0; y < ZS_BRICK; y++)
      for (uint32_t cells = zs_brick_active_cells(job, brick, rows, y, z); cells;
           cells &= cells - 1) {
        unsigned x = (unsigned)__builtin_ctz(cells);
        brick->triangle_count += table->cases[zs_brick_cell_case(rows, x, y, z)].triangle_count;
      }
}

/* ---- Vertex numbers --------------------------------------------------------------------- */

/* Number the vertices of one brick's edges as far as another's cells reach them:
 * `d` has a bit for every axis along which the owner is the next brick. */
static void number_owned(const zs_brick *owner, unsigned d, zs_edge_numbers numbers)
{
  const unsigned x_bits = d & 1 ? 1 : 0xffff;
  for (unsigned row = 0; row < ZS_BRICK_ROWS; row++) {
    unsigned y = row % ZS_BRICK, z = row / ZS_BRICK;
    if ((d & 2 && y) || (d & 4 && z))
      continue;
    size_t start =
      zs_reach_offset(d & 1 ? ZS_BRICK : 0, d & 2 ? ZS_BRICK : y, d & 4 ? ZS_BRICK : z);
    uint32_t number = (uint32_t)owner->first_vertex + owner->first[row];
    for (unsigned axis = 0; axis < 3; axis++)
      for (unsigned edges = owner->crossing[axis][row]; edges; edges &= edges - 1, number++)
        if (edges & -edges & x_bits)
          numbers[axis * ZS_REACH_CORNERS + start + (unsigned)__builtin_ctz(edges)] = number;
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
    uint32_t at[3];
    for (int k = 0; k < 3; k++)
      at[k] = brick->index[k] + (d >> k & 1);
    const zs_brick *owner = d ? zs_lattice_brick(job, at) : brick;
    if (owner->vertex_count)
      number_owned(owner, d, numbers);
  }
  if (job->cap && touches_two_faces(job, brick))
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

/* The triangles of a cell; its creases are those of the brick from `crease` to
 * `end`. */
static void write_cell(writing *w, const zs_contour_table *table, unsigned inside,
                       const int xyz[3], uint32_t crease, uint32_t end)
{
  const zs_cell_case *cell = &table->cases[inside];
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

static void write_triangles(const zs_polygonize_job *job, const zs_contour_table *table,
                            const zs_brick *brick, zs_edge_numbers numbers)
{
  writing w = {.job = job,
               .brick = brick,
               .numbers = numbers,
               .triangle = job->mesh->triangles + 3 * brick->first_triangle};
  zs_brick_rows rows;
  uint32_t crease = 0;
  zs_brick_gather_signs(job, brick, rows);
  zs_brick_number_edges(job, brick, numbers);
  zs_cell_edge_offsets(w.offsets);
  for (unsigned z = 0; z < ZS_BRICK; z++)
    for (unsigned y = 0; y < ZS_BRICK; y++)
      for (uint32_t cells = zs_brick_active_cells(job, brick, rows, y, z); cells;
           cells &= cells - 1) {
        unsigned x = (unsigned)__builtin_ctz(cells);
        unsigned number = (z * ZS_BRICK + y) * ZS_BRICK + x;
        uint32_t first = crease;
        while (crease < brick->crease_count && brick->creases[crease].cell == number)
          crease++;
        const int xyz[3] = {(int)x, (int)y, (int)z};
        write_cell(&w, table, zs_brick_cell_case(rows, x, y, z), xyz, first, crease);
      }
}

bool zs_polygonize_triangles(zs_polygonize_job *job, const zs_contour_table *table)
{
  zs_edge_numbers *scratch = calloc(job->threads, sizeof *scratch);
  if (!scratch)
    return zs_fail_memory(job->diag);
#pragma omp parallel for schedule(dynamic, 16) num_threads(job->threads)
  for (size_t i = 0; i < job->active_count; i++)
    write_triangles(job, table, job->active[i], scratch[zs_polygonize_thread()]);
  free(scratch);
  return true;
}
