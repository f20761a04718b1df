/* Space warped by a lattice of control points: x + D(x), D the uniform cubic B-spline of their
 * moves (True, Hughes, "Volume warping", 1992), and its inverse by Newton's method.
 *
 * Coordinates and moves are in units of the lattice: control point (i, j, k) stands at
 * (i, j, k), 0 <= i < size.  Control points beyond stay where they are, so that D and its first
 * two derivatives come to 0 two units away from the lattice, where space is as it was. */
#ifndef ZS_WARP_H
#define ZS_WARP_H

#include "field/operation.h"

enum {
  ZS_WARP_MOST = 64,       /* control points along a side */
  ZS_WARP_PADDING = 3,     /* layers that stay, on every side */
  ZS_WARP_SUBSTITUTIONS = 4
};

/* Ranges of D and of its derivatives: component k and its derivative by axis j in that order;
 * and the largest size of any second derivative of a component. */
typedef struct zs_warp_range {
  double lo[3], hi[3];
  double slope_lo[3][3], slope_hi[3][3];
  double bend[3];
} zs_warp_range;

typedef struct zs_warp {
  uint32_t size[3];
  double (*moves)[4];    /* x fastest, with padding; the fourth is 0 */
  zs_warp_range *cells;  /* by unit cell: size + 3 a side, the first from -2 to -1 */
  zs_warp_range all;
  bool backward;         /* the operation evaluates the inverse, and there may be starts: */
  uint32_t starts[3];    /* 0: none; else points a side of a grid over where space is warped */
  float (*start)[3];     /* the displacement that the inverse is there */
} zs_warp;

/* A lattice that moves nothing; size 1 to ZS_WARP_MOST.  NULL when memory is out. */
zs_warp *zs_warp_new(const uint32_t size[3]);
void zs_warp_free(void *warp);

/* The move of a control point, to be read and changed until zs_warp_finish. */
double *zs_warp_move(zs_warp *warp, const uint32_t control[3]);

/* Find the ranges, after the last move. */
void zs_warp_finish(zs_warp *warp);

/* Bytes that the next call takes. */
double zs_warp_start_bytes(const zs_warp *warp, uint32_t resolution);

/* Find where Newton's method starts on a grid with `resolution` cells along the longest side,
 * by all threads.  False when memory is out. */
bool zs_warp_prepare_inverse(zs_warp *warp, uint32_t resolution, unsigned threads);

/* Whether nothing moves. */
bool zs_warp_is_identity(const zs_warp *warp);

/* The basis functions at a point: the first control point of 4 x 4 x 4, which may be one that
 * stays, and the weights along each axis. */
void zs_warp_basis(const double at[3], int first[3], double weight[3][4]);

/* D, and its derivatives unless `slope` is NULL. */
void zs_warp_at(const zs_warp *warp, const double at[3], double value[3], double slope[3][3]);

/* y - x for the y with y + D(y) = x; true, or where Newton's method finds none, a few steps of
 * y = x - D(y); `slope`, unless NULL, are the derivatives. */
bool zs_warp_inverse(const zs_warp *warp, const double x[3], double value[3], double slope[3][3]);

/* The determinant of the derivatives of x + D(x). */
double zs_warp_determinant(const double slope[3][3]);

/* A point where space is turned inside out, of a grid of 4 to the unit; false when there is
 * none among them. */
bool zs_warp_fold(const zs_warp *warp, double at[3], double *determinant);

/* One component of D, or of what the inverse adds, as data of the operation.  Those of one
 * warp are siblings. */
typedef struct zs_warp_part {
  const zs_warp *warp;
  int component;
  int unused; /* keeps the bytes that decide equality defined */
} zs_warp_part;

extern const zs_operation zs_warp_operation;

/* ---- For the kernels ------------------------------------------------------ */

/* Enclosures of D, or of what the inverse adds, over a box of numbers. */
void zs_warp_bounds(const zs_warp *warp, const double lo[3], const double hi[3], double least[3],
                    double most[3]);

ZS_DECLARE_KERNELS(zs_warp_kernels)

#endif
