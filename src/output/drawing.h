/* Lines on a picture, to be painted on its pixels or written as a vector file. */
#ifndef ZS_DRAWING_H
#define ZS_DRAWING_H

#include "output/color.h"
#include "zeroset.h"

/* A line through some points. */
typedef struct zs_stroke {
  zs_color color;
  float width; /* pixels; 0: one of the outlines that are filled together */
  bool closed;
  size_t first, count; /* of the drawing's points */
} zs_stroke;

/* Begins as zeros.  Points are pixels from the left and from the top. */
typedef struct zs_drawing {
  double (*points)[2];
  zs_stroke *strokes;
  size_t point_count, point_capacity, stroke_count, stroke_capacity;
} zs_drawing;

/* A stroke of no points yet; then its points.  False when memory is out. */
bool zs_drawing_stroke(zs_drawing *drawing, zs_color color, float width, bool closed);
bool zs_drawing_point(zs_drawing *drawing, const double at[2]);

/* Paint all strokes in order on three channels.  False when memory is out. */
bool zs_drawing_paint(const zs_drawing *drawing, zs_image *image);

void zs_drawing_clear(zs_drawing *drawing);

#endif
