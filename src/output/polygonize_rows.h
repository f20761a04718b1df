/* Loops over the rows of a brick, built for one instruction set. */
#ifndef ZS_POLYGONIZE_ROWS_H
#define ZS_POLYGONIZE_ROWS_H

#include "output/polygonize.h"
#include "output/polygonize_roots.h"

/* An edge in sixteen bits: where in its brick it starts, 256 z + 16 y + x, its
 * axis, and whether it starts inside. */
enum { ZS_EDGE_AXIS = 12, ZS_EDGE_INSIDE = 14 };

/* The crossing edges of a brick, ordered by part, row, axis and x. */
typedef struct zs_edge_list {
  unsigned first[ZS_PARTS + 1]; /* of each part, and the end */
  uint16_t edge[ZS_BRICK_EDGES + ZS_EDGE_RUN];
  uint32_t vertex[ZS_BRICK_EDGES + ZS_EDGE_RUN];
  float f_inner[ZS_BRICK_EDGES + ZS_EDGE_RUN]; /* f at their ends; NaN when not known */
  float f_outer[ZS_BRICK_EDGES + ZS_EDGE_RUN];
} zs_edge_list;

typedef struct zs_row_kernels {
  /* Corners that are inside: f >= 0. */
  void (*signs)(const float f[ZS_BRICK_CORNERS], zs_row_bits signs);
  /* By axis, starts of the edges that lie in the brick and cross the surface.
   * Only edges between corners in `real` count. */
  void (*inner)(const zs_row_bits signs, const zs_row_bits real, zs_row_bits crossing[3]);
  /* Corners closer to the surface than `limit`, as far as the slope can be told
   * from the steps of f to their neighbours in the brick.  Only corners at the
   * brick's sides and those of edges in `crossing` count.  There are finite
   * numbers at f[-1] and behind the last corner too. */
  void (*close)(const float *f, const zs_row_bits crossing[3],
                const float per_cell[3], float limit, zs_row_bits close);
  /* By axis, starts of the edges that cross the surface, without regard to pads. */
  void (*crossing)(const zs_brick_rows rows, zs_row_bits crossing[3]);
  /* Crossing edges of the rows before, by row; returns that of all rows. */
  unsigned (*first)(const zs_row_bits crossing[3], uint16_t first[ZS_BRICK_ROWS]);
  /* Cells that the surface passes through, without regard to pads. */
  void (*cells)(const zs_brick_rows rows, zs_row_bits cells);
  /* f at the ends of the edges in `crossing`, which lie in the brick, in the order of
   * zs_edge_list; lists have room like it.  There are finite numbers for one more
   * layer of corners at f.  Returns how many there are. */
  unsigned (*ends)(const float *f, const zs_row_bits crossing[3],
                   const zs_bit_table *table, float *inner, float *outer);
  /* List the edges of a brick that has its signs and its numbers.  Where it has ends, they
   * are those of the edges that start in `inner`. */
  void (*edges)(const zs_brick *brick, const zs_row_bits inner[3], const zs_bit_table *table,
                zs_edge_list *list);
  /* Number the vertices of a brick's own edges. */
  void (*numbers)(const zs_brick *brick, const zs_bit_table *table, zs_edge_numbers numbers);
  /* The lines of n edges, in the brick's frame. */
  void (*lines)(unsigned n, const uint16_t *edges, const double cell[3], zs_roots *roots);
  /* From gradients to unit normals against them, zero where there is none. */
  void (*normals)(unsigned n, float gradient[3][ZS_BLOCK]);
  /* Let a brick's boxes hold the normals of n edges. */
  void (*hold)(unsigned n, const float normal[3][ZS_BLOCK], const uint16_t *edges,
               zs_brick *brick);
  /* Three arrays as three numbers per vertex. */
  void (*pack)(unsigned n, const float from[3][ZS_BLOCK], float *packed);
  /* The same for places relative to an origin. */
  void (*places)(unsigned n, const float place[3][ZS_BLOCK], const double origin[3],
                 float *packed);
  /* How far along its gradient, in units of its length, each of n corners has to
   * be moved to be `reach` away from the surface; 0 for those that are. */
  void (*steps)(unsigned n, const float *f, const float gradient[3][ZS_BLOCK], float reach,
                float *step);
} zs_row_kernels;

/* Those of an instruction set. */
const zs_row_kernels *zs_row_kernels_of(zs_isa_kind isa);

#endif
