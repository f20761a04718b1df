/* The rigid motion that carries points nearest to others, and every motion on the way there.
 * Rotations by the singular value decomposition of the points' covariance: Arun, Huang,
 * Blostein, "Least-squares fitting of two 3-D point sets" (1987); without reflections: Umeyama,
 * "Least-squares estimation of transformation parameters between two point patterns" (1991). */
#ifndef ZS_RBF_RIGID_H
#define ZS_RBF_RIGID_H

#include <stdbool.h>
#include <stddef.h>

/* x becomes R (x - from) + to, with R the rotation by `angle` (0 .. pi) about `axis`. */
typedef struct zs_rigid {
  double axis[3]; /* of length 1 */
  double angle;   /* radians */
  double from[3], to[3];
} zs_rigid;

/* The motion that moves nothing. */
zs_rigid zs_rigid_identity(void);

/* The motion with the least sum of squares of |motion(from[i]) - to[i]| over `count` >= 1
 * points, x, y, z each, finite.  In two dimensions it turns about z, and z of the points is to
 * be 0.  Where the points leave it free - one of them, or all on a line - it turns no further
 * than it must.  False when memory is out. */
bool zs_rigid_fit(unsigned dimension, const double *from, const double *to, size_t count,
                  zs_rigid *rigid);

/* The motion at the part `t` of the way: the rotation by t angle about the axis, which is
 * spherical linear interpolation of quaternions, while `from` goes straight to `to`.  `forward`
 * and `inverse` are 3 x 4, row-major; either may be NULL. */
void zs_rigid_at(const zs_rigid *rigid, double t, double forward[12], double inverse[12]);

#endif
