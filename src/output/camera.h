/* Cameras: from a view of a box to rays and a frame for evaluation. */
#ifndef ZS_CAMERA_H
#define ZS_CAMERA_H

#include "output/outline.h"

/* A picture's camera.  In the frame's local coordinates a ray has constant u
 * (to the right) and v (up), and depth w along the viewing direction, from the
 * eye in perspective.  Pixel (i, j), counted from the top left, has its centre
 * at u = left + (i + 1/2) pixel, v = top - (j + 1/2) pixel. */
typedef struct zs_camera {
  zs_frame frame;
  double left, top, pixel;
  uint32_t width, height;
  zs_box box;
  double near, far; /* depths that hold what is seen of the box; near >= far: nothing */
} zs_camera;

/* The camera of a view of a box.  Views without an eye show all of the outline;
 * it may be NULL for the others.  False after reporting a view that cannot be. */
bool zs_camera_set(zs_camera *camera, const zs_view *view, const zs_box *box,
                   const zs_outline *outline, uint32_t width, uint32_t height, zs_diag *diag);

/* A point of the scene from local coordinates. */
void zs_camera_point(const zs_camera *camera, double u, double v, double w, double point[3]);

/* Unit direction of the ray through (u, v). */
void zs_camera_direction(const zs_camera *camera, double u, double v, double direction[3]);

/* Side of a pixel in scene units at depth w. */
double zs_camera_footprint(const zs_camera *camera, double w);

/* The part of a ray that lies in the box. */
typedef struct zs_ray_span {
  float near, far; /* near > far: the ray misses the box */
  int axis;        /* of the face that it comes in through; -1 when the eye is inside */
  int side;        /* of that face: -1 low, 1 high */
} zs_ray_span;

zs_ray_span zs_camera_span(const zs_camera *camera, double u, double v);

#endif
