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

/* The part of the sky that a pixel's hit sees, judged by the hits of the
 * picture around it. */
float zs_openness(const zs_camera *camera, const zs_hit *hits, uint32_t x, uint32_t y);

#endif
