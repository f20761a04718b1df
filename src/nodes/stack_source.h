/* Inside <stack>: the numbers in its files, read once for all stacks of a scene. */
#ifndef ZS_NODES_STACK_SOURCE_H
#define ZS_NODES_STACK_SOURCE_H

#include "files/volume_read.h"
#include "nodes/stack.h"

#include <stdatomic.h>

/* Immutable but for the references: every holder of one gives it back. */
typedef struct zs_stack_source {
  atomic_uint references;
  zs_volume volume;  /* slices along its last axis; of pictures without a place */
  uint32_t *white;   /* of each slice of pictures: the number that is white */
  size_t total;      /* pictures in the files; those that are left out by `every` too */
  double side[2];    /* of a pixel, in millimetres; 0: the files do not say */
} zs_stack_source;

/* The numbers in a stack's files, a volume's or those of pictures, from the scene's cache
 * when they are there.  NULL after reporting; to be given back by zs_stack_source_unref. */
zs_stack_source *zs_stack_source_find(zs_compiler *compiler, const zs_node *node);
void zs_stack_source_unref(void *source);

#endif
