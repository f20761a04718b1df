/* The place closest to many planes, by least squares: where sharp edges and
 * corners of a surface lie. */
#ifndef ZS_QUADRIC_H
#define ZS_QUADRIC_H

/* Sums over planes n . x = d with unit normals n.  Begin with all zeros. */
typedef struct zs_quadric {
  double a[3][3]; /* n n^T */
  double b[3];    /* n d */
} zs_quadric;

void zs_quadric_add(zs_quadric *quadric, const float normal[3], double distance);

/* The place in the box lo .. hi closest to all planes.  Of directions in which
 * the planes say little, as along an edge, none is taken: the place is as close
 * to the origin there as the box allows.  Bounds may be infinite; axes with
 * lo = hi are fixed.  Returns in how many directions the planes say enough: 1 on
 * a plane, 2 on an edge, 3 in a corner. */
unsigned zs_quadric_minimize(const zs_quadric *quadric, const double lo[3], const double hi[3],
                             double place[3]);

/* Eigenvalues (the diagonal of a) and -vectors (the columns of v) of a symmetric
 * matrix. */
void zs_symmetric_diagonalize(double a[3][3], double v[3][3]);

#endif
