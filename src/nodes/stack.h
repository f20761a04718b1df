/* Inside <stack>: from its files to slices. */
#ifndef ZS_NODES_STACK_H
#define ZS_NODES_STACK_H

#include "nodes/image.h"
#include "stack/slices.h"

struct stack {
  zs_files src;
  double spacing, pixel, level, label, origin[3]; /* level, label: NaN when not given */
  zs_numbers levels;
  int every, method, caps, y;
};

/* What is read of a stack: slices, and the map (3 x 4) from the scene to columns and rows of
 * pixels, without margins, and pixels along the stack. */
typedef struct zs_stack_read {
  zs_slices slices;
  double matrix[12], pixel;
} zs_stack_read;

/* Whether the file is one that holds all slices. */
bool zs_stack_is_volume(const zs_node *node);

/* False after reporting; to be cleared in any case. */
bool zs_stack_read_slices(zs_stack_read *read, const zs_node *node, zs_diag *diag);

#endif
