/* What becomes what, over a slice: an arrow for every pair, from the level below to the one above,
 * and the outlines that the solid has on both. */
#include "output/slice.h"

#include "base/diagnostic.h"

#include <stdlib.h>
#include <string.h>

static const zs_color BELOW = {0.0F, 0.42F, 0.30F}, ABOVE = {0.45F, 0.10F, 0.58F};
static const zs_color INK = {0.07F, 0.07F, 0.09F}, PAPER = {1, 1, 1};
static const float OUTLINE = 2, ARROW = 1.6F, MARGIN = 1.5F;

/* Heads of arrows: how long, in pixels and at most as a part of the way. */
static const double HEAD = 9, MOST_HEAD = 0.4;

/* How far inside its gap the outline of a level is taken, as a part of it: where a solid ends is
 * a place that rounding may be beyond. */
static const double WITHIN = 1e-5;

/* ---- Outlines ------------------------------------------------------------------------- */

/* Those of the solid on the plane `at`. */
static bool add_outline(zs_drawing *drawing, const zs_slice_plane *plane, double at, zs_color color,
                        zs_field *field, const zs_control *control, zs_diag *diag)
{
  zs_slicer s = {.plane = *plane};
  const size_t n = (size_t)plane->width * plane->height, first = drawing->stroke_count;
  s.plane.at = at;
  s.pixels = calloc(n, 1);
  s.evaluations = zs_counters_new(zs_control_threads(control));
  bool good = (s.pixels && s.evaluations) || zs_fail_memory(diag);
  good = good && zs_slicer_sample(&s, field, control, diag);
  good = good && (zs_slice_outline(drawing, &s, field, 0, true) || zs_fail_memory(diag));
  for (size_t i = first; i < drawing->stroke_count; i++) {
    drawing->strokes[i].color = color;
    drawing->strokes[i].width = OUTLINE;
  }
  free(s.pixels);
  free(s.evaluations);
  return good;
}

static bool add_outlines(zs_drawing *drawing, const zs_slice_plane *plane,
                         const zs_correspondence *c, zs_field *field, const zs_control *control,
                         zs_diag *diag)
{
  const double below = c->plane[0][plane->axis], above = c->plane[1][plane->axis];
  const double within = WITHIN * (above - below);
  return add_outline(drawing, plane, below + within, BELOW, field, control, diag) &&
         add_outline(drawing, plane, above - within, ABOVE, field, control, diag);
}

/* ---- Arrows ------------------------------------------------------------------------------ */

/* A way, once for each of two widths: light below dark. */
static bool add_way(zs_drawing *drawing, const double (*places)[2], size_t count, bool light)
{
  if (!zs_drawing_stroke(drawing, light ? PAPER : INK, light ? ARROW + 2 * MARGIN : ARROW, false))
    return false;
  for (size_t i = 0; i < count; i++)
    if (!zs_drawing_point(drawing, places[i]))
      return false;
  const double *tip = places[count - 1], *before = places[count - 2];
  const double d[2] = {before[0] - tip[0], before[1] - tip[1]}, last = hypot(d[0], d[1]);
  const double whole = hypot(places[0][0] - tip[0], places[0][1] - tip[1]);
  const double size = fmin(HEAD, MOST_HEAD * fmax(whole, last)) / (last > 0 ? last : 1);
  static const double COSINE = 0.9, SINE = 0.4359;
  const double sides[2][2] = {
    {tip[0] + size * (COSINE * d[0] - SINE * d[1]), tip[1] + size * (COSINE * d[1] + SINE * d[0])},
    {tip[0] + size * (COSINE * d[0] + SINE * d[1]), tip[1] + size * (COSINE * d[1] - SINE * d[0])}};
  const zs_stroke way = drawing->strokes[drawing->stroke_count - 1];
  return zs_drawing_stroke(drawing, way.color, way.width, false) &&
         zs_drawing_point(drawing, sides[0]) && zs_drawing_point(drawing, tip) &&
         zs_drawing_point(drawing, sides[1]);
}

static bool add_arrows(zs_drawing *drawing, const zs_slice_plane *plane,
                       const zs_correspondence *c)
{
  double(*places)[2] = malloc(c->places * sizeof *places);
  bool good = places;
  for (int light = 1; light >= 0; light--)
    for (size_t i = 0; i < c->count && good; i++) {
      for (size_t k = 0; k < c->places; k++)
        zs_slice_picture(plane, c->ways + 3 * (i * c->places + k), places[k]);
      good = add_way(drawing, (const double(*)[2])places, c->places, light);
    }
  free(places);
  return good;
}

/* ---- All ---------------------------------------------------------------------------------- */

bool zs_slice_correspondences(zs_drawing *drawing, const zs_slice_plane *plane, zs_field *field,
                              const zs_control *control, zs_diag *diag)
{
  zs_correspondence c;
  for (size_t i = 0; zs_field_correspondence(field, i, &c); i++) {
    if (!c.ways)
      continue;
    const bool across = fabs(c.normal[plane->axis]) > 1 - 1e-9;
    const double below = fmin(c.plane[0][plane->axis], c.plane[1][plane->axis]);
    const double above = fmax(c.plane[0][plane->axis], c.plane[1][plane->axis]);
    if (across && !(plane->at >= below && plane->at <= above))
      continue;
    if (across && !add_outlines(drawing, plane, &c, field, control, diag))
      return false;
    if (!add_arrows(drawing, plane, &c))
      return zs_fail_memory(diag);
  }
  return true;
}
