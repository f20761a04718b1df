/* Distances from the pieces of skeletons and the Cauchy kernel's integrals over them, a
 * vector of points at a time, in units of the radius.  For skeleton.kernel.c. */
#ifndef ZS_SKELETON_PIECES_H
#define ZS_SKELETON_PIECES_H

#include "field/lanes.h"
#include "samples/skeleton.h"

/* No point is farther from a piece, in radii: powers of it must be numbers. */
#define ZS_SKELETON_FAR 1e8f

ZS_INLINE zs_lanes zs_lanes_dot(const zs_lanes a[3], const float b[3])
{
  return zs_lanes_multiply_add(a[0], zs_lanes_all(b[0]),
                               zs_lanes_multiply_add(a[1], zs_lanes_all(b[1]), a[2] * b[2]));
}

ZS_INLINE zs_lanes zs_lanes_square_sum(const zs_lanes a[3])
{
  return zs_lanes_multiply_add(a[0], a[0], zs_lanes_multiply_add(a[1], a[1], a[2] * a[2]));
}

/* From a piece's first corner to points of the scene. */
ZS_INLINE void zs_skeleton_relative(const zs_skeleton_form *form, const zs_lanes x[3],
                                    zs_lanes p[3])
{
  for (int k = 0; k < 3; k++)
    p[k] = zs_lanes_clamped((x[k] - form->from[k]) * form->scale, zs_lanes_all(-ZS_SKELETON_FAR),
                            zs_lanes_all(ZS_SKELETON_FAR));
}

/* ---- Distances ------------------------------------------------------------------ */

/* From the nearest point of a side to p; the square of its length. */
ZS_INLINE zs_lanes zs_skeleton_from_side(const zs_skeleton_form *form, int side,
                                         const zs_lanes p[3], zs_lanes way[3])
{
  for (int k = 0; k < 3; k++)
    way[k] = p[k] - form->corner[side][k];
  const zs_lanes t = zs_lanes_clamped(zs_lanes_dot(way, form->along[side]), zs_lanes_all(0),
                                      zs_lanes_all(form->length[side]));
  for (int k = 0; k < 3; k++)
    way[k] = zs_lanes_multiply_add(-t, zs_lanes_all(form->along[side][k]), way[k]);
  return zs_lanes_square_sum(way);
}

/* The same for a triangle: its plane where the foot is inside, and else its sides. */
ZS_INLINE zs_lanes zs_skeleton_from_triangle(const zs_skeleton_form *form, const zs_lanes p[3],
                                             zs_lanes way[3])
{
  zs_lanes least = zs_skeleton_from_side(form, 0, p, way);
  zs_lanes_mask inside = zs_lanes_dot(p, form->outward[0]) <= zs_lanes_all(0);
  for (int side = 1; side < 3; side++) {
    zs_lanes other[3];
    const zs_lanes square = zs_skeleton_from_side(form, side, p, other);
    const zs_lanes_mask nearer = square < least;
    least = zs_lanes_select(nearer, square, least);
    for (int k = 0; k < 3; k++)
      way[k] = zs_lanes_select(nearer, other[k], way[k]);
    for (int k = 0; k < 3; k++)
      other[k] = p[k] - form->corner[side][k];
    inside &= zs_lanes_dot(other, form->outward[side]) <= zs_lanes_all(0);
  }
  const zs_lanes height = zs_lanes_dot(p, form->normal);
  for (int k = 0; k < 3; k++)
    way[k] = zs_lanes_select(inside, height * form->normal[k], way[k]);
  return zs_lanes_select(inside, height * height, least);
}

ZS_INLINE zs_lanes zs_skeleton_from_piece(const zs_skeleton_piece *piece, const zs_lanes x[3],
                                          zs_lanes way[3])
{
  zs_lanes p[3];
  zs_skeleton_relative(&piece->form, x, p);
  if (piece->shape == ZS_SKELETON_SEGMENT)
    return zs_skeleton_from_side(&piece->form, 0, p, way);
  if (piece->shape == ZS_SKELETON_TRIANGLE)
    return zs_skeleton_from_triangle(&piece->form, p, way);
  for (int k = 0; k < 3; k++)
    way[k] = p[k];
  return zs_lanes_square_sum(way);
}

/* ---- Fields that fall off with the distance ---------------------------------------- */

/* 2^x for x <= 0; 0 where that is below the normal numbers. */
ZS_INLINE zs_lanes zs_lanes_power_of_two(zs_lanes x)
{
  const zs_lanes magic = zs_lanes_all(12582912); /* 1.5 * 2^23 */
  const zs_lanes_mask normal = x >= zs_lanes_all(-126);
  x = zs_lanes_larger(x, zs_lanes_all(-126));
  const zs_lanes shifted = x + magic, r = x - (shifted - magic);
  zs_lanes p = zs_lanes_all(1.540353e-4f);
  p = zs_lanes_multiply_add(p, r, zs_lanes_all(1.3333558e-3f));
  p = zs_lanes_multiply_add(p, r, zs_lanes_all(9.6181291e-3f));
  p = zs_lanes_multiply_add(p, r, zs_lanes_all(5.5504109e-2f));
  p = zs_lanes_multiply_add(p, r, zs_lanes_all(0.24022651f));
  p = zs_lanes_multiply_add(p, r, zs_lanes_all(0.69314718f));
  p = zs_lanes_multiply_add(p, r, zs_lanes_all(1));
  const zs_lanes_mask scaled = (zs_lanes_mask)p + ((zs_lanes_mask)shifted << 23);
  return (zs_lanes)(scaled & normal);
}

/* By q = u^2, and the derivative by q; in factors that are 0 where fields end. */
ZS_INLINE zs_lanes zs_skeleton_falloff(zs_skeleton_field field, zs_lanes q, zs_lanes *slope)
{
  const zs_lanes one = zs_lanes_all(1);
  if (field == ZS_SKELETON_BLINN) {
    const zs_lanes f = zs_lanes_power_of_two(-4 * q);
    *slope = -4 * 0.69314718f * f;
    return f;
  }
  q = zs_lanes_smaller(q, one);
  const zs_lanes rest = one - q;
  if (field == ZS_SKELETON_WYVILL) {
    *slope = rest * ((12 / 9.0f) * q - 22 / 9.0f);
    return rest * rest * (one - (4 / 9.0f) * q);
  }
  if (field == ZS_SKELETON_BLOBTREE) {
    *slope = -3 * rest * rest;
    return rest * rest * rest;
  }
  const zs_lanes u = zs_lanes_square_root(q), left = one - u;
  const zs_lanes_mask middle = q <= zs_lanes_all(1 / 9.0f);
  const zs_lanes divisor = zs_lanes_larger(u, zs_lanes_all(0.1f));
  *slope = zs_lanes_select(middle, zs_lanes_all(-3), -1.5f * left / divisor);
  return zs_lanes_select(middle, one - 3 * q, 1.5f * left * left);
}

/* ---- The Cauchy kernel, integrated --------------------------------------------------
 *
 * The integrals I, G and H of skeleton.c from t1 to t2 = t1 + length, as differences without
 * cancellation: of the arc tangents by the angle between, of t / (D^2 + t^2) by
 * length (D^2 - t1 t2) / ((D^2 + t1^2) (D^2 + t2^2)). */

typedef struct zs_along {
  zs_lanes i, g, h;
} zs_along;

/* The angle of a point from the axis of x, 0 .. pi, for y >= 0. */
ZS_INLINE zs_lanes zs_lanes_angle(zs_lanes y, zs_lanes x)
{
  const zs_lanes one = zs_lanes_all(1), across = zs_lanes_absolute(x);
  const zs_lanes_mask steep = y > across, beyond = x < zs_lanes_all(0);
  const zs_lanes least = zs_lanes_smaller(y, across), most = zs_lanes_larger(y, across);
  /* Around pi / 4 by the difference from there; tan (pi / 8) is between. */
  const zs_lanes_mask wide = least > 0.41421356f * most;
  const zs_lanes a = zs_lanes_select(wide, least - most, least) /
                     zs_lanes_select(wide, least + most, most);
  const zs_lanes z = a * a;
  zs_lanes p = zs_lanes_all(8.05374449538e-2f);
  p = zs_lanes_multiply_add(p, z, zs_lanes_all(-1.38776856032e-1f));
  p = zs_lanes_multiply_add(p, z, zs_lanes_all(1.99777106478e-1f));
  p = zs_lanes_multiply_add(p, z, zs_lanes_all(-3.33329491539e-1f));
  p = zs_lanes_multiply_add(p * z, a, a);
  p = zs_lanes_select(wide, p + 0.78539816f, p);
  p = zs_lanes_select(steep, 1.57079633f * one - p, p);
  return zs_lanes_select(beyond, 3.14159265f * one - p, p);
}

ZS_INLINE zs_along zs_along_side(zs_lanes d2, zs_lanes t1, float length)
{
  const zs_lanes d = zs_lanes_square_root(d2), t2 = t1 + length, product = t1 * t2;
  const zs_lanes r1 = 1 / (d2 + t1 * t1), r2 = 1 / (d2 + t2 * t2), inverse = 1 / d2;
  zs_along a;
  a.i = zs_lanes_angle(d * length, d2 + product) * d * inverse;
  a.g = 0.5f * inverse * (length * (d2 - product) * r1 * r2 + a.i);
  a.h = 0.25f * inverse * (t2 * r2 * r2 - t1 * r1 * r1 + 3 * a.g);
  return a;
}

ZS_INLINE zs_lanes zs_cauchy_point(const zs_lanes p[3], zs_lanes slope[3])
{
  const zs_lanes r = 1 / (1 + zs_lanes_square_sum(p));
  for (int k = 0; k < 3; k++)
    slope[k] = -4 * r * r * r * p[k];
  return r * r;
}

ZS_INLINE zs_lanes zs_cauchy_segment(const zs_skeleton_form *form, const zs_lanes p[3],
                                     zs_lanes slope[3])
{
  const zs_lanes at = zs_lanes_dot(p, form->along[0]);
  zs_lanes way[3];
  for (int k = 0; k < 3; k++)
    way[k] = zs_lanes_multiply_add(-at, zs_lanes_all(form->along[0][k]), p[k]);
  const zs_lanes d2 = 1 + zs_lanes_square_sum(way), t2 = form->length[0] - at;
  const zs_along a = zs_along_side(d2, -at, form->length[0]);
  const zs_lanes r1 = 1 / (d2 + at * at), r2 = 1 / (d2 + t2 * t2);
  const zs_lanes end = r1 * r1 - r2 * r2;
  for (int k = 0; k < 3; k++)
    slope[k] = -4 * a.h * way[k] + end * form->along[0][k];
  return a.g;
}

ZS_INLINE zs_lanes zs_cauchy_triangle(const zs_skeleton_form *form, const zs_lanes p[3],
                                      zs_lanes slope[3])
{
  const zs_lanes height = zs_lanes_dot(p, form->normal), q = 1 + height * height;
  zs_lanes flux = zs_lanes_all(0), flux_slope = flux;
  for (int k = 0; k < 3; k++)
    slope[k] = zs_lanes_all(0);
  for (int i = 0; i < 3; i++) {
    zs_lanes way[3]; /* from the point to the corner */
    for (int k = 0; k < 3; k++)
      way[k] = form->corner[i][k] - p[k];
    const zs_lanes out = zs_lanes_dot(way, form->outward[i]);
    const zs_along a =
      zs_along_side(q + out * out, zs_lanes_dot(way, form->along[i]), form->length[i]);
    flux += out * a.i;
    flux_slope += out * (a.i / q + a.g);
    for (int k = 0; k < 3; k++)
      slope[k] -= a.g * form->outward[i][k];
  }
  for (int k = 0; k < 3; k++)
    slope[k] -= height * flux_slope / q * form->normal[k];
  return flux / (2 * q);
}

/* The slope is in units of the radius too. */
ZS_INLINE zs_lanes zs_skeleton_cauchy(const zs_skeleton_piece *piece, const zs_lanes x[3],
                                      zs_lanes slope[3])
{
  zs_lanes p[3];
  zs_skeleton_relative(&piece->form, x, p);
  if (piece->shape == ZS_SKELETON_SEGMENT)
    return zs_cauchy_segment(&piece->form, p, slope);
  if (piece->shape == ZS_SKELETON_TRIANGLE)
    return zs_cauchy_triangle(&piece->form, p, slope);
  return zs_cauchy_point(p, slope);
}

#endif
