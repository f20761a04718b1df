/* Whether normals that came with samples agree with each other. */
#ifndef ZS_RBF_FACING_H
#define ZS_RBF_FACING_H

#include "rbf/constraints.h"

typedef struct zs_rbf_facing {
  size_t looked_at; /* samples on the surface with normals: all, or some of many */
  size_t against;   /* whose normal points against those of the nearest ones */
  double outwards;  /* the mean cosine between a normal and the way there from the middle of all:
                       1 on a sphere, -1 when that is inside out */
} zs_rbf_facing;

/* Look at the samples from `first` on.  False when memory is out. */
bool zs_rbf_facing_find(zs_rbf_facing *facing, const zs_rbf_samples *samples, size_t first);

#endif
