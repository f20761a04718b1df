/* Inside <distance-morph>: its anchors. */
#ifndef ZS_NODES_DISTANCE_MORPH_H
#define ZS_NODES_DISTANCE_MORPH_H

#include "nodes/kind.h"
#include "rbf/rigid.h"

/* <pair>: a point of the first shape, and those of the others that it becomes. */
extern const zs_kind zs_distance_morph_pair;

/* Whether the pairs fit so many shapes, and each other; reports what does not. */
bool zs_distance_morph_check_pairs(const zs_node *node, size_t shapes, zs_diag *diag);

/* Anchors between two shapes, in the frame of the first, which the rigid part carries along:
 * there anchor i goes straight from p_i to what the rigid part makes into q_i. */
typedef struct zs_anchors {
  unsigned dimension; /* 2: all lie in the x-y plane, and z does not matter */
  size_t count;
  double *positions; /* where they are: `dimension` numbers each */
  double *ways;      /* the whole way, by component: `count` numbers each */
  bool straying;     /* whether there is a way at all beyond the rigid part's */
  zs_rigid rigid;
} zs_anchors;

/* The anchors at the part t (0 < t < 1) of the way from shape `first` of `shapes` to the next, in
 * the arena; `rigid`: whether they move as a body, as far as they can.  False after reporting:
 * memory, or anchors that meet. */
bool zs_anchors_find(const zs_node *node, size_t shapes, size_t first, double t, bool rigid,
                     zs_arena *arena, zs_anchors *anchors, zs_diag *diag);

#endif
