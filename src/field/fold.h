/* Space folded along an axis, or around one, for solids that are repeated: where in one of
 * the copies next to it a point is, at a cost that does not depend on how many there are.
 *
 * Along a coordinate c cells follow one another, c being in cell ceil(c / step - shift).  A
 * point of cell m has the copies m + place, place = 0, 1, ..., as candidates, kept between
 * `least` and `most`.  From cell to cell the first candidate leaves and another comes after
 * the last: before that a fade is taken from the first one's values, and after it from the
 * last one's, that grows without limit towards the change, so that unions of the candidates
 * are continuous whatever their values are. */
#ifndef ZS_FOLD_H
#define ZS_FOLD_H

#include "field/compiler.h"

typedef enum zs_fold_part {
  ZS_FOLD_PLACE,      /* c in the candidate's own coordinates: c - step copy */
  ZS_FOLD_FADE_FIRST, /* what the first candidate is to lose, at least 0 */
  ZS_FOLD_FADE_LAST
} zs_fold_part;

typedef struct zs_fold {
  double row[4];      /* c as a map of three coordinates, filled in by zs_emit_fold */
  double step;        /* > 0 */
  double shift;
  double least, most; /* the copies there are: whole numbers or infinite */
  double fade;        /* how long fades are, in cells: > 0, < 1/2 */
  int place, part;    /* the candidate; a zs_fold_part */
} zs_fold;

/* Fold along one of the coordinates. */
zs_value zs_emit_fold(zs_compiler *compiler, const zs_coordinates *at, int axis,
                      const zs_fold *fold);

typedef enum zs_turn_part {
  ZS_TURN_X,
  ZS_TURN_Y,
  ZS_TURN_FADE_FIRST,
  ZS_TURN_FADE_LAST
} zs_turn_part;

/* The same with the angle about the origin of a plane for c: copies are turned by
 * start + step copy, in radians.  Angles, from -pi to pi, are counted from `zero`. */
typedef struct zs_turn {
  double step, shift, least, most, fade;
  double zero, start;
  double length; /* of a fade where it is the size of what is faded: > 0 */
  int place, part;
} zs_turn;

/* Of the point (x, y), whose angle atan2(y, x) is `angle`. */
zs_value zs_emit_turn(zs_compiler *compiler, zs_value x, zs_value y, zs_value angle,
                      const zs_turn *turn);

/* f - fade, f < 0 wherever fade > 0. */
zs_value zs_emit_faded(zs_compiler *compiler, zs_value f, zs_value fade);

/* ---- For the kernels ------------------------------------------------------ */

/* An enclosure over a rectangle of numbers. */
void zs_turn_bounds(const zs_turn *turn, const double lo[2], const double hi[2],
                    double result[2]);

ZS_DECLARE_KERNELS(zs_fold_root_kernels)
ZS_DECLARE_KERNELS(zs_fold_registers_kernels)
ZS_DECLARE_KERNELS(zs_turn_kernels)
ZS_DECLARE_KERNELS(zs_faded_kernels)

#endif
