/* What the kinds that repeat their children share. */
#ifndef ZS_COPIES_H
#define ZS_COPIES_H

#include "nodes/kind.h"

enum { ZS_MOST_COPIES = 4096 /* that a node emits, at most */ };

/* The copies at one place, next to one another by `step`, of a child between lo and hi; in a
 * fold (fold.h), or when there are no more of them than that, all that there are. */
typedef struct zs_copies {
  bool folded;
  double candidates;
  double shift, fade; /* folded */
} zs_copies;

/* `count` copies, 0 for endlessly many.  Candidates are all copies that a point within half a
 * step of the child may be near to: of an exact distance the nearest is always among them, and
 * of any child those that hold the point.  What fades is farther away.  Infinitely many
 * candidates when the child is endless and the copies are. */
zs_copies zs_copies_of(double lo, double hi, double step, double count);

/* Whether so many more copies may be emitted; reports and returns false when in all there are
 * too many. */
bool zs_copies_allowed(zs_compiler *compiler, const zs_node *node, double count);

/* Where a compilation keeps the box of a node's children; NULL after reporting that memory is
 * out. */
zs_box *zs_children_box(zs_compiler *compiler, const zs_node *node, bool *known);

#endif
