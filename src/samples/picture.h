/* The signed distance to the outline in a grey picture, which lies where brightness,
 * interpolated between neighbouring pixels, passes through a level. */
#ifndef ZS_PICTURE_H
#define ZS_PICTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Brightness at the centres of pixels, rows one after the other; what lies around the
 * picture is black, 0. */
typedef struct zs_picture {
  size_t width, height;
  const float *pixels; /* width x height */
  float level;         /* inside: at least as bright; positive */
} zs_picture;

typedef enum zs_picture_result {
  ZS_PICTURE_DONE,
  ZS_PICTURE_EMPTY, /* no pixel is inside */
  ZS_PICTURE_MEMORY
} zs_picture_result;

/* The distances, in pixels, from the centres of the picture's pixels and of `margin` >= 1
 * rows and columns of black ones around it: (width + 2 margin) x (height + 2 margin)
 * numbers.  Positive inside; where a pixel's brightness is the level 0, and below it
 * always negative.  The outline is that of marching squares: straight between the places
 * where edges of the lattice of centres cross it.  The distance to these places is exact,
 * and so is that to the outline as far as it can be told from the places that are nearest
 * to a pixel and its neighbours (to about a hundredth of a pixel otherwise).  Linear in
 * the number of pixels. */
zs_picture_result zs_picture_distance(const zs_picture *picture, size_t margin, float *distance);

#endif
