/* Inside <stack>: from its files to slices. */
#ifndef ZS_NODES_STACK_H
#define ZS_NODES_STACK_H

#include "nodes/image.h"
#include "stack/slices.h"

struct stack {
  zs_files src;
  double spacing, pixel, level, origin[3]; /* NaN: level not given, pixel as in the file */
  zs_numbers levels, label;                /* label: none when not given */
  int every, method, caps, y;
};

/* What is read of a stack: slices, and the map (3 x 4) from the scene to columns and rows of
 * pixels, without margins, and pixels along the stack. */
typedef struct zs_stack_read {
  zs_slices slices;
  double matrix[12], pixel;
} zs_stack_read;

/* Whether the file is one that holds all slices, and says where they lie. */
bool zs_stack_is_volume(const zs_node *node);

/* A path without its folders. */
const char *zs_stack_file_name(const char *path);

/* False after reporting; to be cleared in any case. */
bool zs_stack_read_slices(zs_stack_read *read, zs_compiler *compiler, const zs_node *node);

#endif
