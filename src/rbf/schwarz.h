/* A preconditioner for fits: restricted additive Schwarz by levels.
 *
 * On every level but the last, the points fall into leaves.  For each one the
 * system of its points and of some around them is solved, and the weights of
 * its own points are kept.  What this leaves over at a part of the points is
 * the right-hand side of the next level, which takes care of what is smooth;
 * the last level is solved exactly.  See Beatson, Light and Billings, "Fast
 * solution of the radial basis function interpolation equations: domain
 * decomposition methods", SIAM J. Sci. Comput. 22 (2000). */
#ifndef ZS_RBF_SCHWARZ_H
#define ZS_RBF_SCHWARZ_H

#include "rbf/clusters.h"
#include "rbf/system.h"

typedef struct zs_schwarz zs_schwarz;

/* Bytes that a preconditioner for so many points holds and is made with. */
double zs_schwarz_bytes(const zs_rbf_system *system);

/* Points of the system are those of the clusters, in their order, whose
 * smallest have ZS_SCHWARZ_CLUSTER points at most; both are borrowed.  `poll`
 * is told the part that is done, 0 .. 1, and cancels when it returns false. */
enum { ZS_SCHWARZ_CLUSTER = 12 };
zs_rbf_result zs_schwarz_new(const zs_rbf_system *system, const zs_rbf_clusters *clusters,
                                 bool (*poll)(void *context, double fraction), void *context,
                                 zs_schwarz **schwarz);
void zs_schwarz_free(zs_schwarz *schwarz);

/* z: about the solution for r, orthogonal to polynomials. */
bool zs_schwarz_apply(zs_schwarz *schwarz, const double *r, double *z);

#endif
