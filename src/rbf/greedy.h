/* Fits of few constraints out of many. */
#ifndef ZS_RBF_GREEDY_H
#define ZS_RBF_GREEDY_H

#include "rbf/fit.h"

/* Fit a part of the constraints so that all are met: start with some that are
 * spread evenly, then add those that are missed most, one of each neighbourhood,
 * until none is missed by more than `tolerance` (in the values' unit, > 0) or
 * `budget` are used (Carr et al., "Reconstruction and representation of 3D
 * objects with radial basis functions", 2001).  The fit's residual is over all
 * constraints.  Like zs_rbf_fit otherwise; warns when the budget ends first and
 * the tolerance was asked for (`strict`). */
zs_rbf *zs_rbf_fit_greedily(const zs_rbf_problem *problem, size_t budget, double tolerance,
                            bool strict, const zs_control *control, const zs_place *place,
                            zs_diag *diag);

#endif
