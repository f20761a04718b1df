/* The triangles of a cell of the contour method, by the signs of its corners. */
#ifndef ZS_CONTOUR_TABLE_H
#define ZS_CONTOUR_TABLE_H

#include <stdbool.h>
#include <stdint.h>

/* Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2); bit c of a case says
 * that it is inside.  Edge e runs along axis e / 4; with u and v the two axes
 * that follow it in cyclic order, bit 0 of e % 4 is its place along u and bit 1
 * along v. */
enum { ZS_CELL_EDGES = 12, ZS_CELL_CASES = 256, ZS_CELL_TRIANGLES = 5, ZS_CELL_LOOPS = 4 };

/* The surface in a cell: closed loops of edges, each cut into two triangles less
 * than it has edges.  Loops and triangles run counter-clockwise seen from
 * outside the solid; the triangles of one loop follow those of the one before. */
typedef struct zs_cell_case {
  uint8_t triangle_count, loop_count;
  uint8_t triangles[3 * ZS_CELL_TRIANGLES]; /* edges */
  uint8_t loop_lengths[ZS_CELL_LOOPS];
  uint8_t loops[ZS_CELL_EDGES]; /* the edges of the loops, one loop after the other */
} zs_cell_case;

typedef struct zs_contour_table {
  zs_cell_case cases[ZS_CELL_CASES];
} zs_contour_table;

/* Fill in the table.  It is derived, not copied: every face of a cell cuts off
 * each run of inside corners on its own, which depends on the face's corners
 * only, so the two cells of a face agree; the cuts join to closed loops; and a
 * loop is triangulated without a diagonal between two edges of one face, so
 * that a diagonal can never coincide with one of another cell.  Together this
 * makes every mesh closed, manifold and oriented, whatever the signs are. */
void zs_contour_table_make(zs_contour_table *table);

enum { ZS_NO_FACE = 6 };

/* The loops of a case as sets of edges, one bit each. */
typedef struct zs_cell_loops {
  uint8_t count;
  uint16_t edges[ZS_CELL_LOOPS];
} zs_cell_loops;

/* The loops of the dual mesh, which has a vertex for every loop and joins those
 * that meet in a cell face.  Where a loop meets such a face twice, and its
 * neighbour as well, they would be joined twice, and the mesh would be no
 * manifold: there both have to cut off the runs of outside corners instead,
 * which parts either into two. */
typedef struct zs_loop_table {
  zs_cell_loops loops[ZS_CELL_CASES];
  uint8_t twice[ZS_CELL_CASES]; /* the face, 2 * axis + side, that one loop meets twice; or
                                   ZS_NO_FACE */
  bool crowded[ZS_CELL_CASES];  /* a face has four crossings */
  zs_cell_loops parted[ZS_CELL_CASES]; /* with that face cut the other way */
} zs_loop_table;

void zs_loop_table_make(zs_loop_table *table);

/* The corner that edge e starts at; it ends one step along axis e / 4. */
unsigned zs_cell_edge_start(unsigned edge);

#endif
