/* Radial sums cell by cell.
 *
 * An octree divides a cube ten times as wide as the unit box.  In each of its
 * leaves the sum is a polynomial, for the centres far from there, and the few
 * near centres as they are.  Polynomials come from values at Chebyshev nodes and
 * are handed down, so that a centre is met only by the cells around it, the
 * larger the farther; many centres that are far from a cell are first replaced by
 * a grid of nodes (Fong and Darve, "The black-box fast multipole method", 2009).
 *
 * Whether a group of centres is far, and how many nodes that takes, is told by
 * what its interpolation would be off by: the distance gives the rate, the
 * weights the size.  Groups are many, and weights of fits have both signs, so
 * each may be off by a part of the tolerance; the whole is measured afterwards.
 *
 * Making the cells of n centres takes a time below n: from 10 000 to 100 000 centres
 * of a surface it grows fivefold, and memory threefold.  Evaluation at a point does
 * not depend on n. */
#ifndef ZS_RBF_CELLS_H
#define ZS_RBF_CELLS_H

#include "field/operation.h"
#include "rbf/centre.h"
#include "rbf/chebyshev.h"

#include <stddef.h>

/* Half the cube's side.  In the plane a larger one costs little, and shapes lie side by
 * side there. */
#define ZS_CELLS_HALF 5.0
#define ZS_CELLS_FLAT_HALF 20.0

/* Centres first .. first + count - 1. */
typedef struct zs_rbf_range {
  uint32_t first, count;
} zs_rbf_range;

typedef struct zs_rbf_cell {
  uint32_t children; /* the first of eight, x fastest; 0: a leaf */
  uint32_t order, near_count;
  /* Coefficients of T_i (x) T_j (y) T_k (z) at k * stride + j * order + i, where the
   * stride is order^2 rounded up to ZS_CELLS_STRIDE. */
  const double *polynomial;
  const zs_rbf_range *near;
} zs_rbf_cell;

enum { ZS_CELLS_STRIDE = 8 };
static inline unsigned zs_cells_stride(unsigned order)
{
  return (order * order + ZS_CELLS_STRIDE - 1) / ZS_CELLS_STRIDE * ZS_CELLS_STRIDE;
}

typedef struct zs_rbf_cells {
  zs_rbf_cell *cells; /* the first is the cube */
  double half;        /* the cube's side's */
  size_t count, bytes;
  double error; /* as measured, with an allowance for what no sample met */
} zs_rbf_cells;

/* A sum as it is given. */
typedef struct zs_rbf_terms {
  zs_rbf_radial radial;
  bool flat; /* all centres lie in the plane z = 0, and so do all points that will be asked for */
  size_t count;
  zs_rbf_centre *centres; /* will be put in another order */
  double polynomial[10];  /* 1 x y z xx xy xz yy yz zz */
} zs_rbf_terms;

static inline double zs_rbf_terms_half(const zs_rbf_terms *terms)
{
  return terms->flat ? ZS_CELLS_FLAT_HALF : ZS_CELLS_HALF;
}

/* Cells that are off by about `tolerance` at most near the centres; NULL after
 * reporting that memory is out, or cancelled.  `control` may be NULL. */
zs_rbf_cells *zs_rbf_cells_new(const zs_rbf_terms *terms, double tolerance,
                               const zs_control *control, zs_diag *diag);
void zs_rbf_cells_free(zs_rbf_cells *cells);

/* The leaf around a point of the cube, and its box. */
const zs_rbf_cell *zs_rbf_cells_find(const zs_rbf_cells *cells, const double point[3],
                                     double middle[3], double *half);

/* f at a point, in plain loops; the same for a sum of all terms. */
double zs_rbf_cells_value(const zs_rbf_cells *cells, const zs_rbf_terms *terms,
                          const double point[3]);
double zs_rbf_terms_value(const zs_rbf_terms *terms, const double point[3]);

/* The sums of all terms at up to ZS_BLOCK points, a row each of x, y and z. */
void zs_rbf_terms_values(const zs_rbf_terms *terms, unsigned n, double (*point)[ZS_BLOCK],
                         double f[ZS_BLOCK]);

/* The loops, one set per kernel, built once per instruction set. */
typedef struct zs_cells_kernels {
  /* f, and with `gradient` its derivatives, at n points, up to ZS_BLOCK: rows of
   * ZS_BLOCK numbers. */
  void (*evaluate)(const zs_rbf_cells *cells, const zs_rbf_terms *terms, unsigned n,
                   const double (*point)[ZS_BLOCK], double (*sum)[ZS_BLOCK], bool gradient);
  /* Add to sums[0 .. n) the terms of some centres, the kernel's rate being given; n is a
   * multiple of 16. */
  void (*add)(double rate, const zs_rbf_centre *centres, size_t count,
              const double *const point[3], size_t n, double *sums);
  /* Apply a matrix, given by columns of `to` numbers, along the three axes of `from`^3 numbers:
   * to^3 numbers. */
  void (*transform)(const double *matrix, unsigned from, unsigned to, const double *in,
                    double *out);
} zs_cells_kernels;

typedef zs_cells_kernels zs_cells_kernel_table[ZS_RBF_KERNEL_COUNT];
ZS_DECLARE_VARIANTS(zs_cells_kernel_table, zs_cells_kernels)

/* Those for the machine. */
const zs_cells_kernels *zs_cells_select(zs_rbf_kernel kernel);

#endif
