/* Polynomials in a cube by their Chebyshev coefficients: those of
 * T_i (x) T_j (y) T_k (z), -1 <= x, y, z <= 1, at (k * order + j) * order + i. */
#ifndef ZS_RBF_CHEBYSHEV_H
#define ZS_RBF_CHEBYSHEV_H

enum { ZS_CHEBYSHEV_ORDER = 10 /* coefficients along a side, at most */ };

/* Node i of a row. */
double zs_chebyshev_node(unsigned order, unsigned i);

/* The matrix, by columns, that turns values at the nodes of a row into
 * coefficients. */
void zs_chebyshev_fit(unsigned order, double *matrix);

/* Matrices, by columns, from the coefficients of a row to those of its lower and
 * its upper half, of order ZS_CHEBYSHEV_ORDER. */
typedef struct zs_chebyshev_halves {
  double matrix[2][ZS_CHEBYSHEV_ORDER * ZS_CHEBYSHEV_ORDER];
} zs_chebyshev_halves;

void zs_chebyshev_halves_make(zs_chebyshev_halves *halves);

/* The coefficients in one of the eight halves of a cube, x fastest. */
void zs_chebyshev_halve(const zs_chebyshev_halves *halves, const double *series, unsigned child,
                        double *result);

#endif
