/* Slices of a solid: their distances, and constraints on their outlines. */
#ifndef ZS_STACK_SLICES_H
#define ZS_STACK_SLICES_H

#include "samples/picture.h"

/* A point of a slice, in pixels (the centre of the first pixel of the distances is 0 0), and
 * what f is to be there. */
typedef struct zs_slice_point {
  float x, y, value;
} zs_slice_point;

typedef struct zs_stack_slice {
  double height;   /* in pixels */
  float *distance; /* width x height numbers; NULL: nothing is inside */
  zs_slice_point *points;
  size_t count;
} zs_stack_slice;

enum { ZS_SLICES_MARGIN = 4 };

/* Slices by ascending height, all of the same size. */
typedef struct zs_slices {
  size_t width, height, margin; /* of distances, the margins of pictures included */
  size_t count, capacity;
  zs_stack_slice *slices;
  /* Neighbouring pixels of which one is inside, and how many of these pairs are stairs: their
   * brightness goes on as it is on both sides, so that it does not say where between them
   * the outline lies. */
  size_t crossings, stairs;
} zs_slices;

/* Append the slice of a picture, which is above those before and as large as they.  Points
 * are: on the outline of the picture, slightly smoothed, 0.8 pixels apart; and beside these
 * one pixel inwards and outwards, where the distance is their value.  False when memory is
 * out. */
bool zs_slices_add(zs_slices *slices, const zs_picture *picture, double height);

/* Append the slice of an outline by its distance, in pixels, at the centres of width x height
 * pixels and of ZS_SLICES_MARGIN rows and columns around them, all of which are outside.  It
 * was made by malloc, and is the slices' from now on, even after failing.  NULL: nothing is
 * inside.  Points are as above, on the outline itself.  False when memory is out. */
bool zs_slices_add_distance(zs_slices *slices, size_t width, size_t height, float *distance,
                            double at);

void zs_slices_clear(zs_slices *slices);

/* Whether a pixel of a slice is inside. */
static inline bool zs_slice_inside(const zs_stack_slice *slice, size_t pixel)
{
  return slice->distance && slice->distance[pixel] >= 0;
}

#endif
