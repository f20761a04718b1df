#include "output/drawing.h"

#include "base/array.h"

#include <stdlib.h>

bool zs_drawing_stroke(zs_drawing *drawing, zs_color color, float width, bool closed)
{
  zs_stroke *strokes =
    zs_array_grown(drawing->strokes, drawing->stroke_count + 1, &drawing->stroke_capacity,
                   sizeof *strokes);
  if (!strokes)
    return false;
  drawing->strokes = strokes;
  strokes[drawing->stroke_count++] =
    (zs_stroke){color, width, closed, drawing->point_count, 0};
  return true;
}

bool zs_drawing_point(zs_drawing *drawing, const double at[2])
{
  double(*points)[2] =
    zs_array_grown(drawing->points, drawing->point_count + 1, &drawing->point_capacity,
                   sizeof *points);
  if (!points)
    return false;
  drawing->points = points;
  points[drawing->point_count][0] = at[0];
  points[drawing->point_count++][1] = at[1];
  drawing->strokes[drawing->stroke_count - 1].count++;
  return true;
}

void zs_drawing_clear(zs_drawing *drawing)
{
  free(drawing->points);
  free(drawing->strokes);
  *drawing = (zs_drawing){0};
}

/* ---- On pixels ------------------------------------------------------------------------ */

static double distance_to_segment(const double p[2], const double a[2], const double b[2])
{
  const double d[2] = {b[0] - a[0], b[1] - a[1]}, e[2] = {p[0] - a[0], p[1] - a[1]};
  const double square = d[0] * d[0] + d[1] * d[1];
  const double t = square > 0 ? fmin(fmax((d[0] * e[0] + d[1] * e[1]) / square, 0), 1) : 0;
  return hypot(e[0] - t * d[0], e[1] - t * d[1]);
}

/* The pixels of a picture that are no farther than `reach` from a segment. */
typedef struct pixels {
  uint32_t lo[2], hi[2]; /* half open */
} pixels;

static pixels around(const double a[2], const double b[2], double reach, const uint32_t size[2])
{
  pixels r;
  for (int k = 0; k < 2; k++) {
    const double lo = floor(fmin(a[k], b[k]) - reach), hi = ceil(fmax(a[k], b[k]) + reach);
    r.lo[k] = (uint32_t)fmin(fmax(lo, 0), size[k]);
    r.hi[k] = (uint32_t)fmin(fmax(hi, 0), size[k]);
  }
  return r;
}

/* How much of each pixel a segment covers, where that is more than is covered already. */
static void cover(float *covered, const double a[2], const double b[2], float width,
                  const uint32_t size[2])
{
  const pixels r = around(a, b, (double)width / 2 + 0.5, size);
  for (uint32_t y = r.lo[1]; y < r.hi[1]; y++)
    for (uint32_t x = r.lo[0]; x < r.hi[0]; x++) {
      const double p[2] = {x + 0.5, y + 0.5};
      const double c = (double)width / 2 + 0.5 - distance_to_segment(p, a, b);
      float *pixel = &covered[(size_t)y * size[0] + x];
      *pixel = fmaxf(*pixel, (float)fmin(fmax(c, 0), fmin((double)width, 1)));
    }
}

/* Mix what a segment may cover, and leave nothing covered. */
static void mix(float *covered, const double a[2], const double b[2], const zs_stroke *stroke,
                zs_image *image)
{
  const uint32_t size[2] = {image->width, image->height};
  const pixels r = around(a, b, (double)stroke->width / 2 + 0.5, size);
  for (uint32_t y = r.lo[1]; y < r.hi[1]; y++)
    for (uint32_t x = r.lo[0]; x < r.hi[0]; x++) {
      const size_t at = (size_t)y * size[0] + x;
      uint8_t *pixel = image->pixels + 3 * at;
      const zs_color old = {pixel[0] / 255.0F, pixel[1] / 255.0F, pixel[2] / 255.0F};
      zs_color_store(zs_color_mix(old, stroke->color, covered[at]), pixel);
      covered[at] = 0;
    }
}

bool zs_drawing_paint(const zs_drawing *drawing, zs_image *image)
{
  const uint32_t size[2] = {image->width, image->height};
  float *covered = calloc((size_t)size[0] * size[1], sizeof *covered);
  if (!covered)
    return false;
  for (size_t i = 0; i < drawing->stroke_count; i++) {
    const zs_stroke *s = &drawing->strokes[i];
    const double(*p)[2] = (const double(*)[2])drawing->points + s->first;
    const size_t segments = s->count - !(s->closed && s->count > 1);
    for (size_t k = 0; s->count && k < segments; k++)
      cover(covered, p[k], p[(k + 1) % s->count], s->width, size);
    for (size_t k = 0; s->count && k < segments; k++)
      mix(covered, p[k], p[(k + 1) % s->count], s, image);
  }
  free(covered);
  return true;
}
