#include "samples/picture.h"

#include "samples/transform.h"

#include <math.h>
#include <stdlib.h>

/* As far as this from the outline, in pixels, what is nearest to neighbours is looked at
 * too: farther out, the straight piece between two places is no nearer than these to a
 * hundredth of a pixel. */
static const float NEAR = 6;

/* No pixel below the level is on the outline. */
static const float LEAST = 1e-6F;

/* A picture with its margin, while it is worked on. */
typedef struct scanner {
  const zs_picture *picture;
  size_t margin, width, height; /* with the margin on both sides */
  /* The nearest crossing of each pixel and its squared distance, by crossings on
   * columns of the lattice (0) and on rows (1). */
  float *squares[2];
  uint32_t *nearest[2];
} scanner;

/* Brightness above the level at a pixel, which may lie outside. */
static double above(const scanner *s, ptrdiff_t x, ptrdiff_t y)
{
  const zs_picture *p = s->picture;
  x -= (ptrdiff_t)s->margin;
  y -= (ptrdiff_t)s->margin;
  const bool within =
    x >= 0 && y >= 0 && x < (ptrdiff_t)p->width && y < (ptrdiff_t)p->height;
  const float bright = within ? p->pixels[(size_t)y * p->width + (size_t)x] : 0;
  return (double)bright - (double)p->level;
}

static bool crosses(double a, double b)
{
  return (a >= 0) != (b >= 0);
}

/* ---- Crossings ------------------------------------------------------------------- */

/* An edge of the lattice by its first pixel and its direction: 0 along the row, 1 down
 * the column. */
static uint32_t edge_number(const scanner *s, size_t x, size_t y, unsigned direction)
{
  return (uint32_t)(2 * (y * s->width + x) + direction);
}

/* The distance of each pixel of a line from the nearest crossing on it. */
static void scan_line(const scanner *s, size_t at, bool column)
{
  const size_t n = column ? s->height : s->width;
  const size_t stride = column ? s->width : 1, start = column ? at : at * s->width;
  float *squares = s->squares[!column] + start;
  uint32_t *nearest = s->nearest[!column] + start;
  double last = -INFINITY;
  uint32_t number = 0;
  for (size_t i = 0; i < n; i++) {
    const double away = (double)i - last;
    squares[i * stride] = (float)(away * away);
    nearest[i * stride] = number;
    const size_t x = column ? at : i, y = column ? i : at;
    const double a = above(s, (ptrdiff_t)x, (ptrdiff_t)y);
    const double b = above(s, (ptrdiff_t)(x + !column), (ptrdiff_t)(y + column));
    if (i + 1 == n || !crosses(a, b))
      continue;
    last = (double)i + a / (a - b);
    number = edge_number(s, x, y, column);
    /* Back to where an earlier one is nearer. */
    for (size_t j = i + 1; j-- > 0;) {
      const float back = (float)((last - (double)j) * (last - (double)j));
      if (!(back < squares[j * stride]))
        break;
      squares[j * stride] = back;
      nearest[j * stride] = number;
    }
  }
}

static bool scan(scanner *s)
{
  const size_t count[3] = {s->width, s->height, 1};
  for (size_t x = 0; x < s->width; x++)
    scan_line(s, x, true);
  for (size_t y = 0; y < s->height; y++)
    scan_line(s, y, false);
  return zs_transform_pass(s->squares[0], s->nearest[0], count, 0, 1) &&
         zs_transform_pass(s->squares[1], s->nearest[1], count, 1, 1);
}

/* ---- The outline ------------------------------------------------------------------- */

static double segment_distance2(const double a[2], const double b[2], double x, double y)
{
  const double ex = b[0] - a[0], ey = b[1] - a[1], l2 = ex * ex + ey * ey;
  double t = l2 > 0 ? ((x - a[0]) * ex + (y - a[1]) * ey) / l2 : 0;
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  const double dx = x - a[0] - t * ex, dy = y - a[1] - t * ey;
  return dx * dx + dy * dy;
}

/* The squared distance from a point to the outline within the cell whose first corner is
 * pixel (cx, cy). */
static double cell_distance2(const scanner *s, ptrdiff_t cx, ptrdiff_t cy, double x, double y)
{
  static const int corner[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  double value[5], place[4][2];
  unsigned count = 0;
  for (int k = 0; k < 5; k++)
    value[k] = above(s, cx + corner[k][0], cy + corner[k][1]);
  for (unsigned k = 0; k < 4; k++) {
    if (!crosses(value[k], value[k + 1]))
      continue;
    const double t = value[k] / (value[k] - value[k + 1]);
    for (int i = 0; i < 2; i++)
      place[count][i] = (double)(i ? cy : cx) + corner[k][i] +
                        t * (corner[k + 1][i] - corner[k][i]);
    count++;
  }
  if (count == 0)
    return INFINITY;
  if (count == 2)
    return segment_distance2(place[0], place[1], x, y);
  /* All four sides: the middle tells which corners belong together.  Side k follows
   * corner k. */
  const bool middle = value[0] + value[1] + value[2] + value[3] >= 0;
  const unsigned first = middle == (value[0] >= 0) ? 0 : 3;
  return fmin(segment_distance2(place[first], place[(first + 1) % 4], x, y),
              segment_distance2(place[(first + 2) % 4], place[(first + 3) % 4], x, y));
}

/* The squared distance to the outline on both sides of a crossing. */
static double edge_distance2(const scanner *s, uint32_t number, double x, double y)
{
  const ptrdiff_t pixel = number / 2, width = (ptrdiff_t)s->width;
  const ptrdiff_t cx = pixel % width, cy = pixel / width, column = number % 2;
  return fmin(cell_distance2(s, cx, cy, x, y),
              cell_distance2(s, cx - column, cy - !column, x, y));
}

static unsigned better(const scanner *s, size_t i)
{
  return s->squares[1][i] < s->squares[0][i];
}

static double distance2(const scanner *s, size_t x, size_t y)
{
  const size_t i = y * s->width + x;
  const double px = (double)x, py = (double)y;
  const unsigned k = better(s, i);
  double best = fmin((double)s->squares[k][i], edge_distance2(s, s->nearest[k][i], px, py));
  const double other = (double)s->squares[!k][i];
  if (other < best + 2 * sqrt(best) + 1) /* its straight piece may still be nearer */
    best = fmin(best, edge_distance2(s, s->nearest[!k][i], px, py));
  if (s->squares[k][i] > NEAR * NEAR)
    return best;
  for (int d = 0; d < 9; d++) {
    const ptrdiff_t nx = (ptrdiff_t)x + d % 3 - 1, ny = (ptrdiff_t)y + d / 3 - 1;
    if (nx < 0 || ny < 0 || nx >= (ptrdiff_t)s->width || ny >= (ptrdiff_t)s->height)
      continue;
    const size_t j = (size_t)ny * s->width + (size_t)nx;
    const uint32_t number = s->nearest[better(s, j)][j];
    if (number != s->nearest[k][i])
      best = fmin(best, edge_distance2(s, number, px, py));
  }
  return best;
}

static void measure(const scanner *s, float *distance)
{
  for (size_t y = 0; y < s->height; y++)
    for (size_t x = 0; x < s->width; x++) {
      const float d = (float)sqrt(distance2(s, x, y));
      const bool inside = above(s, (ptrdiff_t)x, (ptrdiff_t)y) >= 0;
      distance[y * s->width + x] = inside ? d : -(d > LEAST ? d : LEAST);
    }
}

static bool is_empty(const zs_picture *picture)
{
  for (size_t i = 0; i < picture->width * picture->height; i++)
    if (picture->pixels[i] >= picture->level)
      return false;
  return true;
}

zs_picture_result zs_picture_distance(const zs_picture *picture, size_t margin, float *distance)
{
  if (is_empty(picture))
    return ZS_PICTURE_EMPTY;
  scanner s = {.picture = picture,
               .margin = margin,
               .width = picture->width + 2 * margin,
               .height = picture->height + 2 * margin};
  const size_t count = s.width * s.height;
  bool memory = count <= UINT32_MAX / 2;
  for (int k = 0; memory && k < 2; k++) {
    s.squares[k] = malloc(count * sizeof *s.squares[k]);
    s.nearest[k] = malloc(count * sizeof *s.nearest[k]);
    memory = s.squares[k] && s.nearest[k];
  }
  memory = memory && scan(&s);
  if (memory)
    measure(&s, distance);
  for (int k = 0; k < 2; k++) {
    free(s.squares[k]);
    free(s.nearest[k]);
  }
  return memory ? ZS_PICTURE_DONE : ZS_PICTURE_MEMORY;
}
