/* The octree of the centres of a radial sum, for making its cells. */
#ifndef ZS_RBF_SWARMS_H
#define ZS_RBF_SWARMS_H

#include "rbf/cells.h"

enum { ZS_SWARM_GRIDS = 3 };
/* Nodes along a side of the grids that stand for many centres. */
extern const unsigned zs_swarm_orders[ZS_SWARM_GRIDS];

/* Centres close to each other. */
typedef struct zs_swarm {
  zs_rbf_range range;
  uint32_t children, child_count; /* none in leaves */
  double half;                    /* of the octree's cell */
  double lo[3], hi[3], lift;      /* the centres' box, and the least of their lifts */
  double weight; /* what they weigh far away: |sum| and, had they signs at random, its deviation */
  /* Fewer centres that do the same far away, order^3 for each of the orders; NULL where there
   * would not be fewer, or in slices, where centres with equal lifts would be needed. */
  const zs_rbf_centre *grids[ZS_SWARM_GRIDS];
} zs_swarm;

typedef struct zs_swarms {
  zs_swarm *list; /* the first is all */
  size_t count;
} zs_swarms;

/* Put the centres in order and divide them; false when memory is out. */
bool zs_swarms_make(zs_swarms *sources, const zs_rbf_terms *terms);
void zs_swarms_clear(zs_swarms *sources);

#endif
