/* Inside <minkowski-morph>. */
#ifndef ZS_NODES_MINKOWSKI_MORPH_H
#define ZS_NODES_MINKOWSKI_MORPH_H

#include "nodes/kind.h"

/* The element's attributes. */
struct minkowski_morph {
  double time;
  int resolution; /* 0: left out */
};

/* f at the part t (0 < t < 1) of the way between two nodes, by samples
 * (minkowski_sampled.c); 0 after reporting. */
zs_value zs_minkowski_sampled_emit(zs_compiler *compiler, const zs_node *node,
                                   const zs_node *const ends[2], double t,
                                   const zs_coordinates *at);

#endif
