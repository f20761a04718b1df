/* Products with the matrix of a radial kernel that take clusters of points
 * together.
 *
 * Between two clusters that are far from each other, the kernel is a polynomial
 * in either point: the sources are replaced by few, on a grid of Chebyshev nodes
 * around them, and so are the targets.  What is left is sums of pairs again,
 * which product.h adds up: nothing depends on the kernel, and no tables of
 * operators have to be made.  A cluster with fewer points than nodes stands for
 * itself, and thin ones have fewer nodes across.  Among the points of one tree phi of each pair
 * is found once for both.  See Wilson, Vaughn and Krasny,
 * "A GPU-accelerated fast multipole method based on barycentric Lagrange
 * interpolation and dual tree traversal", Comput. Phys. Commun. 265 (2021). */
#ifndef ZS_RBF_FAST_H
#define ZS_RBF_FAST_H

#include "rbf/clusters.h"

typedef struct zs_fast zs_fast;

enum { ZS_FAST_LEAST_ORDER = 3, ZS_FAST_MOST_ORDER = 14 };

/* For products between the points of two trees, which are borrowed and may be
 * the same, with at most `order` nodes along each side of a cluster.  NULL when
 * memory is out. */
zs_fast *zs_fast_new(zs_rbf_radial radial, const zs_rbf_clusters *targets,
                     const zs_rbf_clusters *sources, unsigned order, unsigned threads);
void zs_fast_free(zs_fast *fast);

/* sums[i] += sum_j weights[j] phi (|targets_i - sources_j|), about; points in the
 * order of their trees.  Sums do not depend on the threads.  One product at a time; false when
 * memory is out. */
bool zs_fast_multiply(zs_fast *fast, const double *weights, double *sums);

/* About the bytes that it takes for n points with themselves. */
double zs_fast_bytes(size_t n, unsigned dimension);

/* Pairs that a product adds up, and whether summing all pairs would cost more. */
double zs_fast_pairs(const zs_fast *fast);
bool zs_fast_is_worthwhile(const zs_fast *fast);

/* What a product with some weights, given as the sums that were 0 before, is off by at a
 * sample of the targets; infinite when memory is out. */
typedef struct zs_fast_errors {
  double mean, most; /* the root of the mean square, and the greatest */
} zs_fast_errors;
zs_fast_errors zs_fast_compare(const zs_fast *fast, const double *weights, const double *sums);

/* The cheapest that is off by at most `accuracy` for some weights, in the root of
 * the mean square at a sample of the targets.  NULL when summing all pairs costs
 * no more, when none is good enough, or when memory is out. */
zs_fast *zs_fast_choose(zs_rbf_radial radial, const zs_rbf_clusters *targets,
                        const zs_rbf_clusters *sources, const double *weights, double accuracy,
                        unsigned threads);

#endif
