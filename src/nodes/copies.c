#include "nodes/copies.h"

#include <math.h>

/* Of a cell: what fades take at least, and at most. */
static const double LEAST_FADE = 1.0 / 16, MOST_FADE = 0.45;

/* A copy i counts where lo - step / 2 <= c - step i <= hi + step / 2, and fades where it is up
 * to `room` steps farther. */
zs_copies zs_copies_of(double lo, double hi, double step, double count)
{
  const double width = (hi - lo) / step;
  const double candidates = fmax(2, ceil(width + 1 + 2 * LEAST_FADE));
  if (count > 0 && !(candidates < count))
    return (zs_copies){.candidates = count};
  const double room = (candidates - 1 - width) / 2;
  return (zs_copies){.folded = true,
                     .candidates = candidates,
                     .shift = 0.5 + room + hi / step,
                     .fade = fmin(room, MOST_FADE)};
}
