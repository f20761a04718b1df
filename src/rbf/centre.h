/* Centres of radial sums in space. */
#ifndef ZS_RBF_CENTRE_H
#define ZS_RBF_CENTRE_H

#include "rbf/kernel.h"

/* One centre, as the loops read it.  The lift is the square of its distance from
 * space: 0, but for fits of more than three dimensions. */
typedef struct zs_rbf_centre {
  double x, y, z, lift, weight;
} zs_rbf_centre;

#endif
