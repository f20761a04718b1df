/* Loops over the lines of a block.  Compiled once per instruction set. */
#include "output/polygonize_roots.h"

#include <math.h>

extern const zs_root_kernels ZS_KERNELS(zs_root_kernels);

static inline float smaller(float a, float b)
{
  return a < b ? a : b;
}

static inline float larger(float a, float b)
{
  return a > b ? a : b;
}

/* All loops run over whole groups of lanes: compilers then need no loop for a
 * rest.  Lanes beyond the last line hold brackets without width. */
#define FOR_LANES(i, n)                              \
  for (unsigned group = 0; group < (n); group += ZS_LANES) \
    for (unsigned i = group; i < group + ZS_LANES; i++)

/* Half the width of a bracket that is narrow enough, in units of the length. */
static inline float relative(float length, const zs_roots *r, unsigned i)
{
  float square = 0;
  for (int k = 0; k < 3; k++)
    square += r->along[k][i] * r->along[k][i];
  return smaller(0.25f, length / sqrtf(square));
}

/* Where the straight line between the ends of a bracket is 0; the middle when
 * the values are no help. */
static inline float line_root(const zs_brackets *b, unsigned i)
{
  float part = b->f_low[i] / (b->f_low[i] - b->f_high[i]);
  part = part >= 0 ? part : 0.5f; /* nor for NaN */
  part = part <= 1 ? part : 0.5f;
  return b->low[i] + b->width[i] * part;
}

static void begin(zs_roots *r, float tolerance)
{
  zs_brackets *b = &r->brackets;
  const unsigned n = r->count;
  FOR_LANES(i, n) {
    for (int k = 0; k < 3; k++) {
      b->from[k][i] = r->from[k][i];
      b->along[k][i] = r->along[k][i];
    }
    b->low[i] = 0;
    b->width[i] = i < n;
    b->f_low[i] = r->f_inner[i];
    b->f_high[i] = r->f_outer[i];
    b->side[i] = 0;
    b->tolerance[i] = relative(tolerance / 2, r, i);
    b->root[i] = line_root(b, i);
    r->line[i] = (uint16_t)i;
  }
}

static void look(zs_roots *r, float reach)
{
  zs_brackets *b = &r->brackets;
  const unsigned n = r->pending;
  FOR_LANES(i, n) {
    const float low = b->low[i], width = b->width[i], tolerance = b->tolerance[i];
    const float middle = low + width / 2, room = larger(0, reach - width / 2);
    const float gap = smaller(tolerance / 4, width / 2);
    float t = b->root[i] + b->side[i] * 0.9f * tolerance;
    t = smaller(larger(t, middle - room), middle + room);
    t = smaller(larger(t, low + gap), low + width - gap);
    b->next[i] = t;
    for (int k = 0; k < 3; k++)
      r->at[k][i] = b->from[k][i] + t * b->along[k][i];
  }
}

static unsigned narrow(zs_roots *r)
{
  zs_brackets *b = &r->brackets;
  const unsigned n = r->pending;
  int open = 0;
  FOR_LANES(i, n) {
    const float t = b->next[i], f = r->f[i], high = b->low[i] + b->width[i];
    const int inside = f >= 0;
    const float low = inside ? t : b->low[i];
    const float width = (inside ? high : t) - low;
    b->low[i] = low;
    b->width[i] = width;
    b->f_low[i] = inside ? f : b->f_low[i];
    b->f_high[i] = inside ? b->f_high[i] : f;
    b->side[i] = inside ? 1 : -1;
    b->root[i] = line_root(b, i);
    open += width > 2 * b->tolerance[i];
  }
  return (unsigned)open;
}

static void finish(zs_roots *r, float tolerance, float least)
{
  const unsigned n = r->count;
  FOR_LANES(i, n) {
    const float end = relative(least, r, i);
    const float t = smaller(larger(r->t[i], end), 1 - end);
    const float inside = larger(0, t - 4 * relative(tolerance / 2, r, i));
    for (int k = 0; k < 3; k++) {
      r->found[k][i] = r->from[k][i] + t * r->along[k][i];
      r->inside[k][i] = r->from[k][i] + inside * r->along[k][i];
    }
  }
}

const zs_root_kernels ZS_KERNELS(zs_root_kernels) = {begin, look, narrow, finish};
