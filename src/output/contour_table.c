#include "output/contour_table.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum {
  LONGEST_LOOP = 7, /* of all cases, with runs cut off separately */
  NONE = 0xff
};

unsigned zs_cell_edge_start(unsigned edge)
{
  unsigned axis = edge / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
  return (edge & 1) << u | (edge >> 1 & 1) << v;
}

/* The edge between two corners that differ in one axis. */
static unsigned edge_between(unsigned a, unsigned b)
{
  unsigned step = a ^ b, start = a & b;
  unsigned axis = step == 1 ? 0 : step == 2 ? 1 : 2;
  unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
  return 4 * axis + (start >> u & 1) + 2 * (start >> v & 1);
}

/* The corners of a face (axis, side) counter-clockwise seen from outside the
 * cell. */
static void face_corners(unsigned axis, unsigned side, unsigned corners[4])
{
  static const unsigned around[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
  for (unsigned i = 0; i < 4; i++) {
    const unsigned *at = around[side ? i : 3 - i];
    corners[i] = side << axis | at[0] << u | at[1] << v;
  }
}

/* Both cell faces that an edge lies on, one bit each. */
static unsigned faces_of(unsigned edge)
{
  unsigned axis = edge / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
  return 1u << (2 * u + (edge & 1)) | 1u << (2 * v + (edge >> 1 & 1));
}

/* On one face, join the edge on which each run of inside corners ends to the
 * edge on which it begins, or with `apart` to that on which the next one does. */
static void cut_face(unsigned inside, unsigned axis, unsigned side, bool apart,
                     uint8_t next[ZS_CELL_EDGES])
{
  unsigned corners[4];
  face_corners(axis, side, corners);
  for (unsigned i = 0; i < 4; i++) {
    unsigned last = corners[i], after = corners[(i + 1) % 4];
    if (!(inside >> last & 1) || inside >> after & 1)
      continue;
    unsigned first = apart ? i + 2 : i;
    if (apart)
      while (!(inside >> corners[first % 4] & 1))
        first++;
    else
      while (inside >> corners[(first + 3) % 4] & 1)
        first += 3;
    next[edge_between(last, after)] =
      (uint8_t)edge_between(corners[(first + 3) % 4], corners[first % 4]);
  }
}

/* ---- Triangulating a loop ------------------------------------------------------- */

/* Twice the middle of an edge: whole numbers. */
static void edge_middle(unsigned edge, double middle[3])
{
  unsigned start = zs_cell_edge_start(edge);
  for (unsigned k = 0; k < 3; k++)
    middle[k] = 2 * (start >> k & 1) + (edge / 4 == k);
}

/* The largest cosine of the angles of a triangle between edge middles. */
static double sharpness(unsigned a, unsigned b, unsigned c)
{
  double p[3][3], worst = -1;
  edge_middle(a, p[0]);
  edge_middle(b, p[1]);
  edge_middle(c, p[2]);
  for (int i = 0; i < 3; i++) {
    const double *o = p[i], *q = p[(i + 1) % 3], *r = p[(i + 2) % 3];
    double dot = 0, qq = 0, rr = 0;
    for (int k = 0; k < 3; k++) {
      dot += (q[k] - o[k]) * (r[k] - o[k]);
      qq += (q[k] - o[k]) * (q[k] - o[k]);
      rr += (r[k] - o[k]) * (r[k] - o[k]);
    }
    worst = fmax(worst, dot / sqrt(qq * rr));
  }
  return worst;
}

/* The best triangulations of the parts i .. j of a loop. */
typedef struct plan {
  double cost[LONGEST_LOOP][LONGEST_LOOP];
  unsigned apex[LONGEST_LOOP][LONGEST_LOOP];
} plan;

/* Whether the loop may be cut between its vertices i < j < n: along a side, or
 * along a diagonal between edges without a common face. */
static bool may_cut(const uint8_t *loop, unsigned n, unsigned i, unsigned j)
{
  if (j - i == 1 || (i == 0 && j == n - 1))
    return true;
  return !(faces_of(loop[i]) & faces_of(loop[j]));
}

/* Choose the triangulation whose sharpest angle is the bluntest. */
static void plan_loop(const uint8_t *loop, unsigned n, plan *best)
{
  const double rounding = 1e-9; /* so that ties are ties on every machine */
  for (unsigned i = 0; i + 1 < n; i++)
    best->cost[i][i + 1] = -1;
  for (unsigned span = 2; span < n; span++)
    for (unsigned i = 0; i + span < n; i++) {
      unsigned j = i + span;
      best->cost[i][j] = INFINITY;
      if (!may_cut(loop, n, i, j))
        continue;
      for (unsigned k = i + 1; k < j; k++) {
        double cost = fmax(sharpness(loop[i], loop[k], loop[j]),
                           fmax(best->cost[i][k], best->cost[k][j]));
        if (cost < best->cost[i][j] - rounding) {
          best->cost[i][j] = cost;
          best->apex[i][j] = k;
        }
      }
    }
}

static void emit(const uint8_t *loop, const plan *best, unsigned i, unsigned j, zs_cell_case *cell)
{
  if (j - i < 2)
    return;
  unsigned k = best->apex[i][j];
  uint8_t *triangle = &cell->triangles[3 * cell->triangle_count++];
  triangle[0] = loop[i];
  triangle[1] = loop[k];
  triangle[2] = loop[j];
  emit(loop, best, i, k, cell);
  emit(loop, best, k, j, cell);
}

/* Take the loop that begins at an edge out of `next`.  It runs clockwise seen
 * from outside the solid, so it is listed backwards. */
static unsigned take_loop(uint8_t next[ZS_CELL_EDGES], unsigned edge, uint8_t loop[LONGEST_LOOP])
{
  unsigned n = 0;
  for (unsigned at = edge; next[at] != NONE; n++) {
    unsigned after = next[at];
    memmove(loop + 1, loop, n);
    loop[0] = (uint8_t)at;
    next[at] = NONE;
    at = after;
  }
  return n;
}

static void make_case(unsigned inside, zs_cell_case *cell)
{
  uint8_t next[ZS_CELL_EDGES], *loop = cell->loops;
  memset(next, NONE, sizeof next);
  for (unsigned axis = 0; axis < 3; axis++)
    for (unsigned side = 0; side < 2; side++)
      cut_face(inside, axis, side, false, next);
  for (unsigned edge = 0; edge < ZS_CELL_EDGES; edge++) {
    unsigned n = take_loop(next, edge, loop);
    if (!n)
      continue;
    plan best;
    plan_loop(loop, n, &best);
    emit(loop, &best, 0, n - 1, cell);
    cell->loop_lengths[cell->loop_count++] = (uint8_t)n;
    loop += n;
  }
}

void zs_contour_table_make(zs_contour_table *table)
{
  memset(table, 0, sizeof *table);
  for (unsigned inside = 0; inside < ZS_CELL_CASES; inside++)
    make_case(inside, &table->cases[inside]);
}

/* ---- Loops of the dual mesh ------------------------------------------------------- */

/* The loops of a case with one face, or none, cut the other way. */
static void make_loops(unsigned inside, unsigned parted, zs_cell_loops *loops)
{
  uint8_t next[ZS_CELL_EDGES];
  memset(next, NONE, sizeof next);
  for (unsigned face = 0; face < ZS_NO_FACE; face++)
    cut_face(inside, face / 2, face % 2, face == parted, next);
  for (unsigned edge = 0; edge < ZS_CELL_EDGES; edge++) {
    if (next[edge] == NONE)
      continue;
    uint16_t *edges = &loops->edges[loops->count++];
    for (unsigned at = edge; next[at] != NONE;) {
      unsigned after = next[at];
      *edges |= (uint16_t)(1u << at);
      next[at] = NONE;
      at = after;
    }
  }
}

/* The face all of whose edges belong to one loop. */
static uint8_t face_met_twice(const zs_cell_loops *loops)
{
  for (unsigned face = 0; face < ZS_NO_FACE; face++)
    for (unsigned l = 0; l < loops->count; l++) {
      unsigned met = 0;
      for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
        met += loops->edges[l] >> e & faces_of(e) >> face & 1;
      if (met == 4)
        return (uint8_t)face;
    }
  return ZS_NO_FACE;
}

/* Whether all edges of a face are in loops. */
static bool is_crowded(const zs_cell_loops *loops)
{
  unsigned met[ZS_NO_FACE] = {0};
  for (unsigned l = 0; l < loops->count; l++)
    for (unsigned e = 0; e < ZS_CELL_EDGES; e++)
      for (unsigned face = 0; face < ZS_NO_FACE; face++)
        met[face] += loops->edges[l] >> e & faces_of(e) >> face & 1;
  bool crowded = false;
  for (unsigned face = 0; face < ZS_NO_FACE; face++)
    crowded = crowded || met[face] == 4;
  return crowded;
}

void zs_loop_table_make(zs_loop_table *table)
{
  memset(table, 0, sizeof *table);
  for (unsigned inside = 0; inside < ZS_CELL_CASES; inside++) {
    make_loops(inside, ZS_NO_FACE, &table->loops[inside]);
    table->crowded[inside] = is_crowded(&table->loops[inside]);
    table->twice[inside] = face_met_twice(&table->loops[inside]);
    if (table->twice[inside] != ZS_NO_FACE)
      make_loops(inside, table->twice[inside], &table->parted[inside]);
  }
}
