/* The triangles of a cell of the contour method, by the signs of its corners. */
#ifndef ZS_CONTOUR_TABLE_H
#define ZS_CONTOUR_TABLE_H

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

/* The corner that edge e starts at; it ends one step along axis e / 4. */
unsigned zs_cell_edge_start(unsigned edge);

#endif
