#include "samples/skeleton_tree.h"

#include <math.h>

/* ---- Distances ------------------------------------------------------------------ */

/* From the nearest point of the segment ab to x; the square of its length. */
static double from_segment(const double a[3], const double b[3], const double x[3], double way[3])
{
  double ab[3], ax[3];
  zs_subtract3(b, a, ab);
  zs_subtract3(x, a, ax);
  const double length2 = zs_dot3(ab, ab);
  double t = length2 > 0 ? zs_dot3(ax, ab) / length2 : 0;
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  for (int k = 0; k < 3; k++)
    way[k] = ax[k] - t * ab[k];
  return zs_dot3(way, way);
}

/* The same for a triangle: its plane where the foot is inside, and else its sides. */
static double from_triangle(const zs_skeleton_piece *piece, const double x[3], double way[3])
{
  const double(*corner)[3] = piece->corner;
  double side[3][3], normal[3], ax[3], in_plane[3];
  for (int i = 0; i < 3; i++)
    zs_subtract3(corner[(i + 1) % 3], corner[i], side[i]);
  zs_cross3(side[0], side[1], normal);
  const double area2 = zs_dot3(normal, normal);
  bool inside = area2 > 0;
  for (int i = 0; i < 3 && inside; i++) {
    zs_subtract3(x, corner[i], ax);
    zs_cross3(side[i], ax, in_plane);
    inside = zs_dot3(in_plane, normal) >= 0;
  }
  if (inside) {
    zs_subtract3(x, corner[0], ax);
    const double across = zs_dot3(ax, normal) / area2;
    for (int k = 0; k < 3; k++)
      way[k] = across * normal[k];
    return zs_dot3(way, way);
  }
  double least = INFINITY;
  for (int i = 0; i < 3; i++) {
    double other[3];
    const double d2 = from_segment(corner[i], corner[(i + 1) % 3], x, other);
    if (d2 < least) {
      least = d2;
      for (int k = 0; k < 3; k++)
        way[k] = other[k];
    }
  }
  return least;
}

static double from_piece(const zs_skeleton_piece *piece, const double x[3], double way[3])
{
  if (piece->shape == ZS_SKELETON_TRIANGLE)
    return from_triangle(piece, x, way);
  return from_segment(piece->corner[0], piece->corner[piece->shape - 1], x, way);
}

/* From the nearest piece of a part. */
static double from_part(const zs_skeleton *skeleton, const zs_skeleton_part *part,
                        const double x[3], double way[3])
{
  double least = INFINITY, other[3];
  for (uint32_t i = 0; i < part->count; i++) {
    const double d2 = from_piece(&skeleton->pieces[part->first + i], x, other);
    if (d2 < least) {
      least = d2;
      for (int k = 0; k < 3; k++)
        way[k] = other[k];
    }
  }
  return least;
}

/* ---- Fields that fall off with the distance ---------------------------------------- */

/* By q = u^2, and the derivative by q. */
static double falloff(zs_skeleton_field field, double q, double *slope)
{
  *slope = 0;
  if (q >= 1 && field != ZS_SKELETON_BLINN)
    return 0;
  const double rest = 1 - q, u = sqrt(q);
  switch (field) {
  case ZS_SKELETON_WYVILL:
    *slope = (-22 + 34 * q - 12 * q * q) / 9;
    return 1 + q * (-22 + q * (17 - 4 * q)) / 9;
  case ZS_SKELETON_BLOBTREE:
    *slope = -3 * rest * rest;
    return rest * rest * rest;
  case ZS_SKELETON_METABALL:
    *slope = q <= 1.0 / 9 ? -3 : -1.5 * (1 - u) / u;
    return q <= 1.0 / 9 ? 1 - 3 * q : 1.5 * (1 - u) * (1 - u);
  default:
    *slope = -4 * 0.69314718055994531 * exp2(-4 * q);
    return exp2(-4 * q);
  }
}

/* ---- The Cauchy kernel, integrated --------------------------------------------------
 *
 * In units of the radius.  With D^2 = 1 + distance^2 from a line, the integral along it of
 * 1 / (D^2 + t^2)^2 is G, of its derivative by D^2 -2 H:
 *   I = atan (t / D) / D,  G = t / (2 D^2 (D^2 + t^2)) + I / (2 D^2),
 *   H = t / (4 D^2 (D^2 + t^2)^2) + 3 G / (4 D^2).
 * Over a plane figure the divergence theorem makes of the integral one along its sides (the
 * closed form of McCormack and Sherstyuk, by side, and right for every width). */

typedef struct along {
  double i, g, h;
} along;

/* From t1 to t2. */
static along integrals(double d2, double t1, double t2)
{
  const double d = sqrt(d2), r1 = 1 / (d2 + t1 * t1), r2 = 1 / (d2 + t2 * t2);
  along a;
  a.i = (atan(t2 / d) - atan(t1 / d)) / d;
  a.g = (t2 * r2 - t1 * r1 + a.i) / (2 * d2);
  a.h = (t2 * r2 * r2 - t1 * r1 * r1 + 3 * a.g) / (4 * d2);
  return a;
}

static double cauchy_point(const double x[3], double slope[3])
{
  const double r = 1 / (1 + zs_dot3(x, x));
  for (int k = 0; k < 3; k++)
    slope[k] = -4 * r * r * r * x[k];
  return r * r;
}

/* x: from the segment's first point; ab: along it. */
static double cauchy_segment(const double x[3], const double ab[3], double slope[3])
{
  const double length = sqrt(zs_dot3(ab, ab));
  slope[0] = slope[1] = slope[2] = 0;
  if (!(length > 0))
    return 0;
  const double at = zs_dot3(x, ab) / length;
  double way[3];
  for (int k = 0; k < 3; k++)
    way[k] = x[k] - at / length * ab[k];
  const double d2 = 1 + zs_dot3(way, way), t1 = -at, t2 = length - at;
  const along a = integrals(d2, t1, t2);
  const double r1 = 1 / (d2 + t1 * t1), r2 = 1 / (d2 + t2 * t2);
  for (int k = 0; k < 3; k++)
    slope[k] = -4 * a.h * way[k] + (r1 * r1 - r2 * r2) * ab[k] / length;
  return a.g;
}

/* x: the corners, from the point. */
static double cauchy_triangle(const double x[3][3], double slope[3])
{
  double side[3][3], normal[3], flux = 0, flux_slope = 0;
  for (int i = 0; i < 3; i++)
    zs_subtract3(x[(i + 1) % 3], x[i], side[i]);
  zs_cross3(side[0], side[1], normal);
  const double area = sqrt(zs_dot3(normal, normal));
  slope[0] = slope[1] = slope[2] = 0;
  if (!(area > 0))
    return 0;
  for (int k = 0; k < 3; k++)
    normal[k] /= area;
  const double height = -zs_dot3(x[0], normal), q = 1 + height * height;
  for (int i = 0; i < 3; i++) {
    const double length = sqrt(zs_dot3(side[i], side[i]));
    double outward[3];
    zs_cross3(side[i], normal, outward);
    const double t1 = zs_dot3(x[i], side[i]) / length;
    const double out = zs_dot3(x[i], outward) / length;
    const along a = integrals(q + out * out, t1, t1 + length);
    flux += out * a.i;
    flux_slope += out * (a.i / q + a.g);
    for (int k = 0; k < 3; k++)
      slope[k] -= a.g * outward[k] / length;
  }
  for (int k = 0; k < 3; k++)
    slope[k] -= height * flux_slope / q * normal[k];
  return flux / (2 * q);
}

/* The slope is in units of the radius too. */
static double cauchy(const zs_skeleton_piece *piece, double radius, const double at[3],
                     double slope[3])
{
  double x[3][3] = {{0}}, from[3], ab[3];
  for (int i = 0; i < (int)piece->shape; i++)
    for (int k = 0; k < 3; k++)
      x[i][k] = (piece->corner[i][k] - at[k]) / radius;
  for (int k = 0; k < 3; k++)
    from[k] = -x[0][k];
  if (piece->shape == ZS_SKELETON_POINT)
    return cauchy_point(from, slope);
  if (piece->shape == ZS_SKELETON_TRIANGLE)
    return cauchy_triangle((const double(*)[3])x, slope);
  zs_subtract3(x[1], x[0], ab);
  return cauchy_segment(from, ab, slope);
}

double zs_skeleton_unit(const zs_skeleton_piece *piece, double radius)
{
  return piece->shape == ZS_SKELETON_POINT     ? 1
         : piece->shape == ZS_SKELETON_SEGMENT ? radius
                                               : radius * radius;
}

/* ---- Parts ------------------------------------------------------------------------------ */

double zs_skeleton_value(const zs_skeleton *skeleton, const zs_skeleton_part *part,
                         const double at[3], double slope[3])
{
  double own[3] = {0}, value = 0;
  if (skeleton->field == ZS_SKELETON_CAUCHY) {
    for (uint32_t i = 0; i < part->count; i++) {
      const zs_skeleton_piece *piece = &skeleton->pieces[part->first + i];
      const double unit = part->weight * zs_skeleton_unit(piece, part->radius);
      double by[3];
      value += unit * cauchy(piece, part->radius, at, by);
      for (int k = 0; k < 3; k++)
        own[k] += unit * by[k] / part->radius;
    }
  } else {
    double way[3] = {0}, by;
    const double u = sqrt(from_part(skeleton, part, at, way)) / part->radius;
    value = part->weight * falloff(skeleton->field, u * u, &by);
    for (int k = 0; k < 3 && by != 0; k++) /* beside the smallest radii ways are infinite */
      own[k] = part->weight * by * 2 * (way[k] / part->radius) / part->radius;
  }
  if (slope)
    for (int k = 0; k < 3; k++)
      slope[k] = own[k];
  return value;
}

double zs_skeleton_reach(zs_skeleton_field field, const zs_skeleton_part *part, double least)
{
  if (!(least > 0))
    return field == ZS_SKELETON_BLINN || field == ZS_SKELETON_CAUCHY ? INFINITY : part->radius;
  const double share = least / fabs(part->weight);
  if (field == ZS_SKELETON_CAUCHY) /* as if all of it were nearest */
    return share < part->measure ? part->radius * sqrt(sqrt(part->measure / share) - 1) : 0;
  if (field == ZS_SKELETON_BLINN)
    return share < 1 ? part->radius * sqrt(-log2(share) / 4) : 0;
  return part->radius;
}

double zs_skeleton_reference(const void *data, const double in[])
{
  const zs_skeleton *skeleton = data;
  double sum = 0;
  for (uint32_t i = 0; i < skeleton->part_count; i++)
    sum += zs_skeleton_value(skeleton, &skeleton->parts[i], in, NULL);
  return sum;
}
