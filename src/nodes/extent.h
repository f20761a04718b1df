/* Where a solid is, when bounds of its whole program cannot tell: found for the
 * parts for which they can, and carried up the tree from there. */
#ifndef ZS_EXTENT_H
#define ZS_EXTENT_H

#include "nodes/kind.h"

/* The box of a node's solid; infinite where none is found.  Compiles parts of
 * the tree; `control` and `cache` as for zs_compiler_new. */
zs_box zs_node_extent(const zs_node *node, const zs_control *control, struct zs_cache *cache);

/* The same where bounds of the node's own program have been found not to tell. */
zs_box zs_node_extent_by_children(const zs_node *node, const zs_control *control,
                                  struct zs_cache *cache);

/* The box of a node's child nodes together, in the node's own coordinates, along some axes (one
 * bit each); infinite along the others and where no end is found.  False when the children do
 * not compile: emitting them reports why. */
bool zs_children_extent(zs_compiler *compiler, const zs_node *node, unsigned axes, zs_box *box);

bool zs_box_is_finite(const zs_box *box);

/* ---- For the kinds' box functions ---- */

zs_box zs_box_everything(void);
zs_box zs_box_grown(zs_box box, double by);

/* The box of the image of a box, under the map whose inverse is affine (3 x 4). */
zs_box zs_box_image(const zs_box *box, const double inverse[12]);

/* Box functions that serve several kinds. */
zs_box zs_box_of_union(const zs_node *node, const zs_box *children, size_t count);
zs_box zs_box_of_intersection(const zs_node *node, const zs_box *children, size_t count);
zs_box zs_box_of_first(const zs_node *node, const zs_box *children, size_t count);

#endif
