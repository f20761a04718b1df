/* Places whose side of a surface is known from samples of it, however far they are from
 * them: radial sums go where they like between and beyond their constraints, and may make
 * surface where there is none. */
#ifndef ZS_RBF_WITNESSES_H
#define ZS_RBF_WITNESSES_H

#include "rbf/constraints.h"
#include "rbf/fit.h"

/* List places all over the samples' box and somewhat beyond it, the closer together the nearer
 * the samples are, with the distance to the nearest sample as their value, negative outside.
 * Inside is where the samples on the surface, each a piece of it as large as its neighbours are
 * far, wind around a place (Barill et al., "Fast winding numbers for soups and clouds", SIGGRAPH
 * 2018).  Places where that is not clear are left out, and the list is empty when samples have no
 * normals, or those of an open surface or of curves on one.  There are a few for each sample, but
 * not more than 65 536, or what the first grid has; finding them costs about n log n of n samples.
 * False when memory is out. */
bool zs_rbf_witnesses_make(zs_rbf_constraints *witnesses, const zs_rbf_samples *samples,
                           unsigned dimension, const zs_control *control);

/* Mark witnesses on whose side a fit is not, some that are far from each other, and say how many.
 * `positions` have the fit's dimension.  False after reporting: memory, cancelled. */
bool zs_rbf_witnesses_against(const zs_rbf *rbf, const double *positions, const double *values,
                              size_t count, const zs_control *control, bool *against,
                              size_t *marked_count, zs_diag *diag);

#endif
