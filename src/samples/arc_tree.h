/* What an outline of lines and arcs encloses, as intersections and unions of the sides of its
 * edges, each of which stands there once: Rvachev; Dobkin, Guibas, Hershberger and Snoeyink,
 * "An efficient algorithm for finding the CSG representation of a simple polygon", 1988. */
#ifndef ZS_ARC_TREE_H
#define ZS_ARC_TREE_H

#include "base/arena.h"
#include "samples/arcs.h"

/* What is to the left of an edge (of an arc to the right: or in its disc; of one to the left: and
 * outside of it), or of all or some of other items. */
typedef struct zs_arc_item {
  enum { ZS_ARC_EDGE, ZS_ARC_ALL, ZS_ARC_SOME } kind;
  size_t edge;                     /* of the ring, by which it is to be divided */
  const struct zs_arc_item *first; /* children, linked by `next` */
  size_t count;
  const struct zs_arc_item *next;
} zs_arc_item;

typedef struct zs_arc_tree {
  zs_arena arena;
  zs_arc_ring ring; /* the outline, arcs divided as finely as is needed */
  zs_arc_item root;
  unsigned levels;  /* of functions of two operands on top of each other, joined by halves */
} zs_arc_tree;

/* The tree of a simple counter-clockwise outline, whose numbers of pieces it raises.  False
 * when memory is out.  To be freed in any case. */
bool zs_arc_tree_build(zs_arc_tree *tree, zs_arc_ring *outline);
void zs_arc_tree_free(zs_arc_tree *tree);

#endif
