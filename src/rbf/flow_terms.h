/* Terms of flows at points, and how far they can be off in boxes: for flow.kernel.c in double
 * and for flow_local.kernel.c in single precision.  These say beforehand what numbers are:
 *
 *   zs_real, zs_real_number     a vector, and one of its elements
 *   zs_real_mask                what comparisons of vectors give
 *   zs_real_reach               as zs_flow_reach, of such elements
 *   zs_real_larger(a, b)
 *   zs_real_chosen(mask, yes, no)
 *   zs_real_absolute(a)
 *   zs_real_root(a)
 *   zs_real_rough_logarithm(a)  at most 0.06 below the natural logarithm of a normal number,
 *                               and not above it */
#ifndef ZS_RBF_FLOW_TERMS_H
#define ZS_RBF_FLOW_TERMS_H

#include "rbf/flow.h"

#define ZS_TERMS __attribute__((always_inline)) static inline

/* How far points are from a centre, and a weight of its, with their derivatives by s. */
typedef struct centre {
  zs_real x, x_slope, y, y_slope;
} centre;

typedef struct weight {
  zs_real value, slope;
} weight;

/* f and its derivatives by x, y and s. */
typedef struct tangent {
  zs_real f, x, y, s;
} tangent;

/* `phi`, and its derivative by r over r, at a centre. */
ZS_TERMS void add_centre(tangent *t, const centre *c, const weight *w, zs_real phi, zs_real slope)
{
  const zs_real steep = w->value * slope;
  t->f += w->value * phi;
  t->x += steep * c->x;
  t->y += steep * c->y;
  t->s += w->slope * phi - steep * (c->x * c->x_slope + c->y * c->y_slope);
}

/* Second derivatives by x, y and s, without those that are the places' own by s, and those of
 * weights. */
typedef struct curvature {
  zs_real xx, xy, yy, xs, ys, ss;
} curvature;

/* Second derivatives of r^2 log r are `slope` = 2 log r + 1 along the axes, and `twice` = 2 / r^2 by
 * the products of coordinates. */
ZS_TERMS void add_curvature(curvature *h, const centre *c, const weight *w, zs_real slope,
                            zs_real twice)
{
  const zs_real xx = slope + twice * c->x * c->x, xy = twice * c->x * c->y;
  const zs_real yy = slope + twice * c->y * c->y;
  const zs_real of_x = xx * c->x_slope + xy * c->y_slope, of_y = xy * c->x_slope + yy * c->y_slope;
  h->xx += w->value * xx;
  h->xy += w->value * xy;
  h->yy += w->value * yy;
  h->xs += w->slope * slope * c->x - w->value * of_x;
  h->ys += w->slope * slope * c->y - w->value * of_y;
  h->ss += w->value * (of_x * c->x_slope + of_y * c->y_slope) -
           2 * w->slope * slope * (c->x * c->x_slope + c->y * c->y_slope);
}

/* How far second derivatives lead from a tangent in boxes with half sides `r`. */
ZS_TERMS zs_real curved_away(const curvature *h, const zs_real r[3])
{
  const zs_real_number half = (zs_real_number)0.5;
  return half * (zs_real_absolute(h->xx) * r[0] * r[0] + zs_real_absolute(h->yy) * r[1] * r[1] +
                 zs_real_absolute(h->ss) * r[2] * r[2]) +
         zs_real_absolute(h->xy) * r[0] * r[1] + zs_real_absolute(h->xs) * r[0] * r[2] +
         zs_real_absolute(h->ys) * r[1] * r[2];
}

/* What is known of r^2 log r within a distance of a place. */
typedef struct zone {
  zs_real value, slope; /* the largest |r^2 log r| and |r (2 log r + 1)| */
  zs_real bend;         /* how far from the tangent plane */
  zs_real turn;         /* how far from what second derivatives at the place lead to */
} zone;

/* The bend is the integral of second derivatives, at most |2 log r| + 3, along the way, which
 * may pass through 0; the turn is that of third ones, at most 2 sqrt(2) / r. */
ZS_TERMS zone zone_around(zs_real away, zs_real step)
{
  static const zs_real_number VALUE_PEAK = (zs_real_number)0.6065306597126334,
                              SLOPE_PEAK = (zs_real_number)0.22313016014842982,
                              OFF = (zs_real_number)0.06 /* of rough logarithms */,
                              TINY = (zs_real_number)1e-30, HALF = (zs_real_number)0.5,
                              THIRD = (zs_real_number)0.47140452079103168 /* sqrt(2) / 3 */;
  const zs_real tiny = (zs_real){0} + TINY;
  const zs_real far = away + step, near = away - step;
  const zs_real l = zs_real_rough_logarithm(zs_real_larger(far, tiny)), above = l + OFF;
  const zs_real other =
    zs_real_rough_logarithm(zs_real_larger(zs_real_chosen(near > 0, near, step), tiny));
  const zs_real most = zs_real_larger(zs_real_absolute(other), zs_real_absolute(l)) + OFF;
  zone z;
  z.value = zs_real_chosen(far < VALUE_PEAK, -far * far * l,
                           zs_real_larger((zs_real){0} + HALF * VALUE_PEAK * VALUE_PEAK,
                                          far * far * above));
  z.slope = zs_real_chosen(far < SLOPE_PEAK, far * zs_real_absolute(2 * l + 1),
                           zs_real_larger((zs_real){0} + 2 * SLOPE_PEAK, far * (2 * above + 1)));
  z.bend = step * step * zs_real_chosen(near > 0, most + 3 * HALF, most + 7 * HALF);
  z.turn = zs_real_chosen(near > 0, step * step * step * THIRD / zs_real_larger(near, tiny),
                          2 * z.bend);
  return z;
}

/* How far a centre's term gets from its tangent in boxes, by what its weight and the weight's
 * derivatives by s become; where that is less, without what second derivatives add up to: those of
 * many centres all but cancel each other. */
typedef struct bend {
  zs_real value, first, second;
  zs_real_mask curved; /* where it is without */
} bend;

/* In boxes with half sides `r`, whose middles are at the square root of `r2` from the centre, by
 * the reach of its place. */
ZS_TERMS bend bend_at(const zs_real_reach *x, const zs_real_reach *y, const zs_real r[3],
                      zs_real r2)
{
  const zs_real step_x = r[0] + x->first * r[2], step_y = r[1] + y->first * r[2];
  const zs_real step = zs_real_root(step_x * step_x + step_y * step_y);
  const zs_real half = r[2] * r[2] / 2;
  const zone z = zone_around(zs_real_root(r2), step);
  const zs_real_mask curved = z.turn < z.bend;
  return (bend){zs_real_chosen(curved, z.turn, z.bend) + z.slope * half * (x->second + y->second),
                r[2] * zs_real_chosen(curved, z.bend, z.slope * step), half * z.value, curved};
}

ZS_TERMS zs_real bend_of_term(const bend *b, const zs_real_reach *weight)
{
  return weight->value * b->value + weight->first * b->first + weight->second * b->second;
}

#endif
