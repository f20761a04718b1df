/* Sums over pairs of points and centres, for *.kernel.c: a handful of points
 * stays in registers while centres stream past. */
#ifndef ZS_RBF_PAIRS_H
#define ZS_RBF_PAIRS_H

#include "rbf/centre.h"
#include "rbf/phi.h"

#include <stdbool.h>
#include <string.h>

enum {
  ZS_PAIRS_VECTORS = 2, /* accumulators, to hide latencies */
  ZS_PAIRS_POINTS = ZS_PAIRS_VECTORS * ZS_WIDTH
};

/* Some points, and f and its derivatives there. */
typedef struct zs_pairs {
  zs_vector point[3][ZS_PAIRS_VECTORS], sum[4][ZS_PAIRS_VECTORS];
} zs_pairs;

/* Rows of coordinates and of sums to a zs_pairs and back; only f without `gradient`. */
static inline ZS_ALWAYS void zs_pairs_load(zs_pairs *p, const double *const point[3],
                                           double *const sum[4], bool gradient)
{
  for (unsigned k = 0; k < 3; k++)
    memcpy(p->point[k], point[k], sizeof p->point[k]);
  for (unsigned k = 0; k < (gradient ? 4 : 1); k++)
    memcpy(p->sum[k], sum[k], sizeof p->sum[k]);
}

static inline ZS_ALWAYS void zs_pairs_store(const zs_pairs *p, double *const sum[4], bool gradient)
{
  for (unsigned k = 0; k < (gradient ? 4 : 1); k++)
    memcpy(sum[k], p->sum[k], sizeof p->sum[k]);
}

static inline ZS_ALWAYS void zs_pairs_add(zs_rbf_radial radial, zs_pairs *p,
                                          const zs_rbf_centre *centres, size_t count, bool gradient)
{
  for (size_t j = 0; j < count; j++) {
    const zs_rbf_centre c = centres[j];
    for (unsigned v = 0; v < ZS_PAIRS_VECTORS; v++) {
      zs_vector x = p->point[0][v] - c.x, y = p->point[1][v] - c.y, z = p->point[2][v] - c.z;
      zs_vector s = x * x + y * y + z * z + c.lift;
      if (!gradient) {
        p->sum[0][v] += c.weight * zs_vector_phi(radial, s);
        continue;
      }
      zs_vector slope;
      p->sum[0][v] += c.weight * zs_vector_phi_and_slope(radial, s, &slope);
      slope *= c.weight;
      p->sum[1][v] += slope * x;
      p->sum[2][v] += slope * y;
      p->sum[3][v] += slope * z;
    }
  }
}

/* Next centres, one in each place; those past the end weigh nothing. */
static inline ZS_ALWAYS void zs_pairs_gather(const zs_rbf_centre *centres, size_t count,
                                             zs_vector c[5])
{
  for (size_t l = 0; l < ZS_WIDTH; l++) {
    const zs_rbf_centre *from = &centres[l < count ? l : count - 1];
    c[0][l] = from->x;
    c[1][l] = from->y;
    c[2][l] = from->z;
    c[3][l] = from->lift;
    c[4][l] = l < count ? from->weight : 0;
  }
}

/* The same for up to ZS_WIDTH points, rows like those of zs_pairs_load: vectors are of
 * centres then, so that few points take little. */
static inline ZS_ALWAYS void zs_pairs_add_few(zs_rbf_radial radial, unsigned n,
                                              const double *const point[3], double *const sum[4],
                                              const zs_rbf_centre *centres, size_t count,
                                              bool gradient)
{
  zs_vector sums[ZS_WIDTH][4] = {{{0}}}, c[5] = {{0}};
  for (size_t j = 0; j < count; j += ZS_WIDTH) {
    zs_pairs_gather(centres + j, count - j, c);
    for (unsigned i = 0; i < n; i++) {
      const zs_vector x = point[0][i] - c[0], y = point[1][i] - c[1], z = point[2][i] - c[2];
      const zs_vector s = x * x + y * y + z * z + c[3];
      if (!gradient) {
        sums[i][0] += c[4] * zs_vector_phi(radial, s);
        continue;
      }
      zs_vector slope;
      sums[i][0] += c[4] * zs_vector_phi_and_slope(radial, s, &slope);
      slope *= c[4];
      sums[i][1] += slope * x;
      sums[i][2] += slope * y;
      sums[i][3] += slope * z;
    }
  }
  for (unsigned i = 0; i < n; i++)
    for (unsigned k = 0; k < (gradient ? 4 : 1); k++)
      for (unsigned l = 0; l < ZS_WIDTH; l++)
        sum[k][i] += sums[i][k][l];
}

#endif
