/* Samples of contours and pictures that lie in a plane. */
#ifndef ZS_RBF_CONTOUR_H
#define ZS_RBF_CONTOUR_H

#include "files/gray.h"
#include "files/rings.h"
#include "rbf/constraints.h"

/* Where a plane lies: its point (a, b) is origin + a u + b v. */
typedef struct zs_rbf_plane {
  double origin[3], u[3], v[3]; /* u and v not parallel */
} zs_rbf_plane;

/* Append samples of closed polygons: all corners, and points on the edges that
 * are at most `spacing` apart, or when it is NaN a 64th of the polygons' size
 * (zs_rbf_samples_size); nearer together towards corners where the direction turns
 * by more than 40 degrees, so that these come out sharp.  Normals lie in the
 * plane, across the edges, out of the solid: a point is inside when it is in an
 * odd number of rings, whichever way round they go.  Sharp corners have none.
 *
 * False after reporting at `place`: a ring that encloses nothing, memory. */
bool zs_rbf_contour_add(zs_rbf_samples *list, const zs_rings *rings, const zs_rbf_plane *plane,
                        double spacing, const zs_place *place, zs_diag *diag);

/* Append samples where brightness passes through `level` between two neighbouring
 * pixels, by linear interpolation, with normals against the gradient there (Turk
 * and O'Brien, section 4.1).  The solid is where pixels are at least as bright;
 * what lies around the picture is black.  The plane's (0, 0) is the lower left
 * corner of the picture, and a pixel's side is one; with `down` it is the upper
 * left corner, and rows follow v.  Crossings that nearly coincide are left out.
 * Adds nothing when no pixel is as bright as the level.  False after reporting
 * that memory is out. */
bool zs_rbf_picture_add(zs_rbf_samples *list, const zs_gray *gray, double level, bool down,
                        const zs_rbf_plane *plane, zs_diag *diag);

#endif
