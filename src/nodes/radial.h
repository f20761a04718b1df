/* Fits of radial sums that belong to a node: made and evaluated where it is compiled. */
#ifndef ZS_RADIAL_H
#define ZS_RADIAL_H

#include "nodes/kind.h"

#include "rbf/fit.h"

/* Fit, and emit the sum at coordinates in the problem's units; in two dimensions it does not
 * depend on z.  After reporting at the node it is 0. */
zs_value zs_radial_emit(zs_compiler *compiler, const zs_node *node, const zs_rbf_problem *problem,
                        const zs_coordinates *at);

/* The sum of a fit alone, which is not needed after it; 0 after reporting. */
zs_value zs_radial_sum_emit(zs_compiler *compiler, const zs_rbf *rbf, const zs_coordinates *at);

/* What is to be told of a fit that belongs to a node. */
zs_fit_info zs_radial_info(const zs_node *node, const zs_rbf *rbf);

#endif
