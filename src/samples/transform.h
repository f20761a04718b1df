/* Exact Euclidean distance transforms of sampled sets, along one axis at a time,
 * in a time linear in the number of samples.
 *
 * The squared distance from a sample to the nearest of some sites is the minimum of
 * parabolas; along a line of samples the lower envelope of these is built in one pass
 * and read off in another (Felzenszwalb and Huttenlocher, "Distance transforms of
 * sampled functions", Theory of Computing 8, 2012).  A pass along each axis in turn
 * gives the distance in the plane, or in space. */
#ifndef ZS_TRANSFORM_H
#define ZS_TRANSFORM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* One pass: squares[i] becomes the minimum over the samples j of the line through i along
 * `axis` of squares[j] + (distance from i to j)^2.  Samples stand with x fastest; those
 * that are no sites have INFINITY before the first pass.  Values need not be 0 at sites:
 * a first pass may be replaced by distances to sites between the samples of a line.
 *
 * `nearest`, unless NULL, is carried along: what stands at j comes to i.  `spacing` is
 * positive.  False when memory is out. */
bool zs_transform_pass(float *squares, uint32_t *nearest, const size_t count[3], int axis,
                       double spacing);

#endif
