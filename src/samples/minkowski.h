/* Minkowski sums: of plane shapes with straight edges, exactly, and of sampled fields.
 *
 * The boundary of the sum of two shapes is among the edges of one, moved along by those corners
 * of the other over which their direction turns: the convolution of the boundaries (Guibas,
 * Ramshaw, Stolfi, "A kinetic framework for computational geometry", 1983).  Where the shapes
 * have no holes it winds around a point as often as the one shape meets the mirrored other one,
 * moved to that point, in separate parts; holes are opened by slits, which change no sum. */
#ifndef ZS_MINKOWSKI_H
#define ZS_MINKOWSKI_H

#include "base/diagnostic.h"
#include "field/operation.h"
#include "samples/fill.h"

#include <stdint.h>

/* Pairs of a corner of the one and an edge of the other that are looked at, at most. */
enum { ZS_MINKOWSKI_PAIRS = 50000000 };

/* The boundary of the sum of two shapes that are resolved (zs_fill_resolve) and have no more than
 * ZS_MINKOWSKI_PAIRS pairs, resolved; free with zs_fill_clear in any case. */
zs_fill_result zs_minkowski_sum(const zs_fill *a, const zs_fill *b, zs_fill *sum);

/* Numbers at the points (i, j, k) of a lattice with lo <= (i, j, k) < lo + count, x fastest. */
typedef struct zs_lattice_samples {
  int32_t lo[3];
  uint32_t count[3];
  float *f;
} zs_lattice_samples;

/* Points in units of the lattice. */
typedef struct zs_lattice_points {
  double (*at)[3];
  size_t count;
} zs_lattice_points;

/* Raise the numbers of `sum` to what `a`, samples of a signed distance that is positive inside and
 * linear between them, has at x - b, for every point x of the lattice and b of `points`: the union
 * of what is moved by all of these.  `a` has all those points and one more along every axis of more
 * than one.  False after reporting: cancelled.  Takes the time of all x by all b. */
bool zs_minkowski_raise(const zs_lattice_samples *a, const zs_lattice_points *points,
                        zs_lattice_samples *sum, const zs_control *control, zs_diag *diag);

/* The point of the greatest number in each part where numbers are not negative, neighbours along
 * the axes being together: `count` of them, 3 indices each, for free().  NULL when memory is
 * out. */
uint32_t (*zs_lattice_parts(const zs_lattice_samples *a, size_t *count))[3];

/* ---- For the kernels ------------------------------------------------------ */

typedef struct zs_minkowski_kernels {
  /* zs_minkowski_raise for row (j, k) of the sum along x */
  void (*raise_row)(const zs_lattice_samples *a, const zs_lattice_points *points,
                    const zs_lattice_samples *sum, uint32_t j, uint32_t k);
} zs_minkowski_kernels;

ZS_DECLARE_VARIANTS(zs_minkowski_kernels, zs_minkowski_table)

#endif
