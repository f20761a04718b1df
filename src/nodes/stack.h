/* Inside <stack>: from its files to slices. */
#ifndef ZS_NODES_STACK_H
#define ZS_NODES_STACK_H

#include "nodes/image.h"
#include "stack/slices.h"

struct stack {
  zs_files src;
  double spacing, pixel, level, origin[3]; /* NaN: level not given, pixel as in the file */
  zs_numbers levels, label;                /* label: none when not given */
  int every, method, continuity, caps, y;
};

/* What is read of a stack: slices, and the map (3 x 4) from the scene to columns and rows of
 * pixels, without margins, and pixels along the stack. */
typedef struct zs_stack_read {
  zs_slices slices;
  double matrix[12], pixel;
} zs_stack_read;

/* Whether the file is one that holds all slices, and says where they lie. */
bool zs_stack_is_volume(const zs_node *node);

/* Whether slices are drawn outlines, by the names of files. */
bool zs_stack_is_outlines(const zs_node *node);

/* False after reporting; to be cleared in any case. */
bool zs_stack_read_slices(zs_stack_read *read, zs_compiler *compiler, const zs_node *node);

/* ---- Between the files of stacks -------------------------------------------------------- */

/* A path without its folders. */
const char *zs_stack_file_name(const char *path);

/* Of slices without a place in their files: the height of the first one, and how far above
 * it the k-th one lies of those that are kept. */
double zs_stack_first(const zs_node *node);
double zs_stack_height(const zs_node *node, size_t k);

/* Whether there are as many `levels`, if any, as slices in the files. */
bool zs_stack_check_levels(const zs_node *node, size_t slices, const char *what, zs_diag *diag);

/* zs_stack_read_slices for outlines (stack_outlines.c); whether a name is that of such a file. */
bool zs_stack_read_outlines(zs_stack_read *read, const zs_node *node, const zs_control *control,
                            zs_diag *diag);
bool zs_stack_is_outline(const char *path);

#endif
