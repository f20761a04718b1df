/* Compiled once per instruction set. */
#include "output/polygonize_roots.h"

#include "field/lanes.h"

extern const zs_root_kernels ZS_KERNELS(zs_root_kernels);

/* A length in units of that of a vector of lines, at most a quarter. */
static inline zs_lanes relative(float length, const zs_roots *r, unsigned i)
{
  zs_lanes square = zs_lanes_all(0);
  for (int k = 0; k < 3; k++) {
    const zs_lanes along = zs_lanes_load(r->along[k] + i);
    square += along * along;
  }
  return zs_lanes_smaller(zs_lanes_all(0.25f), length / zs_lanes_square_root(square));
}

/* Where the straight line between the ends of a bracket is 0; the middle when
 * the values are no help, or not known. */
static inline zs_lanes line_root(zs_lanes low, zs_lanes width, zs_lanes f_low, zs_lanes f_high)
{
  const zs_lanes part = f_low / (f_low - f_high);
  return low + width * zs_lanes_select((part >= 0) & (part <= 1), part, zs_lanes_all(0.5f));
}

static void begin(zs_roots *r, float tolerance)
{
  const zs_lanes lane = zs_lanes_ascending();
  zs_brackets *b = &r->brackets;
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    for (int k = 0; k < 3; k++) {
      zs_lanes_store(b->from[k] + i, zs_lanes_load(r->from[k] + i));
      zs_lanes_store(b->along[k] + i, zs_lanes_load(r->along[k] + i));
    }
    /* Lanes beyond the last line get brackets without width. */
    const zs_lanes_mask lines = lane < (float)r->count - (float)i;
    const zs_lanes low = zs_lanes_all(0);
    const zs_lanes width = zs_lanes_select(lines, zs_lanes_all(1), low);
    const zs_lanes f_low = zs_lanes_load(r->f_inner + i), f_high = zs_lanes_load(r->f_outer + i);
    zs_lanes_store(b->low + i, low);
    zs_lanes_store(b->width + i, width);
    zs_lanes_store(b->f_low + i, f_low);
    zs_lanes_store(b->f_high + i, f_high);
    zs_lanes_store(b->side + i, zs_lanes_all(0));
    zs_lanes_store(b->tolerance + i, relative(tolerance / 2, r, i));
    zs_lanes_store(b->root + i, line_root(low, width, f_low, f_high));
    for (unsigned l = 0; l < ZS_WIDTH; l++)
      r->line[i + l] = (uint16_t)(i + l);
  }
}

static void look(zs_roots *r, float reach)
{
  zs_brackets *b = &r->brackets;
  for (unsigned i = 0; i < r->pending; i += ZS_WIDTH) {
    const zs_lanes low = zs_lanes_load(b->low + i), width = zs_lanes_load(b->width + i);
    const zs_lanes tolerance = zs_lanes_load(b->tolerance + i);
    const zs_lanes middle = low + width / 2;
    const zs_lanes room = zs_lanes_larger(zs_lanes_all(0), reach - width / 2);
    const zs_lanes gap = zs_lanes_smaller(tolerance / 4, width / 2);
    zs_lanes t = zs_lanes_load(b->root + i) + zs_lanes_load(b->side + i) * 0.9f * tolerance;
    t = zs_lanes_clamped(t, middle - room, middle + room);
    t = zs_lanes_clamped(t, low + gap, low + width - gap);
    zs_lanes_store(b->next + i, t);
    for (int k = 0; k < 3; k++)
      zs_lanes_store(r->at[k] + i,
                     zs_lanes_load(b->from[k] + i) + t * zs_lanes_load(b->along[k] + i));
  }
}

/* What f at an end is multiplied with when the other end moved twice in a row,
 * from `old` to `new`: the straight line then leads closer to the end that stays.
 * (N. Anderson, A. Bjorck: "A new high order method of regula falsi type for
 * computing a root of an equation", 1973.) */
static inline zs_lanes shrink(zs_lanes new, zs_lanes old)
{
  const zs_lanes factor = 1 - new / old;
  return zs_lanes_select(factor > 0, factor, zs_lanes_all(0.5f));
}

static unsigned narrow(zs_roots *r)
{
  zs_brackets *b = &r->brackets;
  unsigned open = 0;
  for (unsigned i = 0; i < r->pending; i += ZS_WIDTH) {
    const zs_lanes t = zs_lanes_load(b->next + i), f = zs_lanes_load(r->f + i);
    const zs_lanes f_low = zs_lanes_load(b->f_low + i), f_high = zs_lanes_load(b->f_high + i);
    const zs_lanes old_low = zs_lanes_load(b->low + i);
    const zs_lanes high = old_low + zs_lanes_load(b->width + i);
    const zs_lanes_mask inside = f >= 0;
    const zs_lanes side = zs_lanes_select(inside, zs_lanes_all(1), zs_lanes_all(-1));
    const zs_lanes factor = zs_lanes_select(side == zs_lanes_load(b->side + i),
                                            shrink(f, zs_lanes_select(inside, f_low, f_high)),
                                            zs_lanes_all(1));
    const zs_lanes other = zs_lanes_select(inside, f_high, f_low) * factor;
    const zs_lanes low = zs_lanes_select(inside, t, old_low);
    const zs_lanes width = zs_lanes_select(inside, high, t) - low;
    const zs_lanes new_low = zs_lanes_select(inside, f, other);
    const zs_lanes new_high = zs_lanes_select(inside, other, f);
    zs_lanes_store(b->low + i, low);
    zs_lanes_store(b->width + i, width);
    zs_lanes_store(b->f_low + i, new_low);
    zs_lanes_store(b->f_high + i, new_high);
    zs_lanes_store(b->side + i, side);
    zs_lanes_store(b->root + i, line_root(low, width, new_low, new_high));
    const zs_lanes_mask wide = width > 2 * zs_lanes_load(b->tolerance + i);
    open += (unsigned)__builtin_popcount(zs_lanes_bits(wide));
  }
  return open;
}

static void finish(zs_roots *r, float tolerance, float least)
{
  for (unsigned i = 0; i < r->count; i += ZS_WIDTH) {
    const zs_lanes end = relative(least, r, i);
    const zs_lanes t = zs_lanes_clamped(zs_lanes_load(r->t + i), end, 1 - end);
    const zs_lanes inside =
      zs_lanes_larger(zs_lanes_all(0), t - 4 * relative(tolerance / 2, r, i));
    for (int k = 0; k < 3; k++) {
      const zs_lanes from = zs_lanes_load(r->from[k] + i), along = zs_lanes_load(r->along[k] + i);
      zs_lanes_store(r->found[k] + i, from + t * along);
      zs_lanes_store(r->inside[k] + i, from + inside * along);
    }
  }
}

const zs_root_kernels ZS_KERNELS(zs_root_kernels) = {begin, look, narrow, finish};
