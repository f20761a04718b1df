/* Light and colour of rendered pictures, in linear light. */
#ifndef ZS_SHADE_H
#define ZS_SHADE_H

#include "output/camera.h"
#include "output/color.h"
#include "output/trace.h"

/* The lights: they stand still relative to the camera, but for the sky. */
typedef struct zs_studio {
  float key[3], fill[3]; /* unit vectors towards the lights */
} zs_studio;

zs_studio zs_studio_for(const zs_camera *camera);

/* Colour of what is hit by the ray through (u, v).  `open` is the part of the
 * sky that the place sees, 0 to 1. */
zs_color zs_shade(const zs_studio *studio, const zs_camera *camera, const zs_hit *hit, double u,
                  double v, float open);

/* Colour of the background; `height` is 0 at the bottom of the picture, 1 at
 * its top. */
zs_color zs_backdrop(float height);

/* The part of the sky that the hits of row y see, judged by the hits of the
 * picture around them; 1 where nothing is hit.  `depth` is that of every pixel's
 * hit, INFINITY where there is none. */
void zs_openness(const zs_camera *camera, const zs_hit *hits, const float *depth, uint32_t y,
                 float *open);

/* A run of pixels in a row.  Places and normals are along the camera's axes. */
typedef struct zs_sky {
  unsigned n;
  uint32_t x, y, width, height; /* of the first pixel; of the picture */
  const float *depth;
  bool perspective;
  float pixel, reach, v; /* how far from a place others darken it */
  float u[ZS_BLOCK], radius[ZS_BLOCK]; /* the reach in pixels; 0: nothing counts, or no pixel */
  float at[3][ZS_BLOCK], normal[3][ZS_BLOCK];
  float open[ZS_BLOCK]; /* the result */
} zs_sky;

typedef struct zs_sky_kernel {
  void (*openness)(zs_sky *sky);
} zs_sky_kernel;

#endif
