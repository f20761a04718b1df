/* How wide Gaussians can be. */
#ifndef ZS_RBF_WIDTH_H
#define ZS_RBF_WIDTH_H

#include "rbf/system.h"

/* A width in the unit box for the equations of Gaussians, whose own is still open, in the order
 * of clusters: the widest, by steps, with which those of some neighbourhoods are far from
 * singular.  Wider Gaussians make smoother fits; with much wider ones than constraints are
 * apart, they can hardly be told from each other.  0 when memory is out. */
double zs_rbf_choose_width(const zs_rbf_system *system);

#endif
