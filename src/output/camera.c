#include "output/camera.h"

#include "base/vector3.h"
#include "base/diagnostic.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Part of the picture that framing fills, and the vertical angle of the
 * perspective views that are built in. */
static const double FILLED = 0.92, PERSPECTIVE = 24;

/* Nearest depth that is drawn, relative to the farthest. */
static const double NEAREST = 1e-4;

static const struct {
  const char *name;
  double direction[3], up[3], field_of_view;
} built_in[] = {
  {"front", {0, 1, 0}, {0, 0, 1}, 0},   {"back", {0, -1, 0}, {0, 0, 1}, 0},
  {"left", {1, 0, 0}, {0, 0, 1}, 0},    {"right", {-1, 0, 0}, {0, 0, 1}, 0},
  {"top", {0, 0, -1}, {0, 1, 0}, 0},    {"bottom", {0, 0, 1}, {0, -1, 0}, 0},
  {"iso", {-1, 1, -1}, {0, 0, 1}, PERSPECTIVE},
};
enum { BUILT_IN = sizeof built_in / sizeof *built_in };

bool zs_view_named(zs_view *view, const char *name, zs_diag *diag)
{
  const char *names[BUILT_IN];
  for (size_t i = 0; i < BUILT_IN; i++) {
    names[i] = built_in[i].name;
    if (strcmp(name, names[i]))
      continue;
    *view = (zs_view){.id = names[i], .field_of_view = built_in[i].field_of_view};
    memcpy(view->direction, built_in[i].direction, sizeof view->direction);
    memcpy(view->up, built_in[i].up, sizeof view->up);
    return true;
  }
  const char *near = zs_suggest(name, names, BUILT_IN);
  char hint[64];
  if (near)
    snprintf(hint, sizeof hint, "did you mean '%s'?", near);
  return zs_report(diag, ZS_ERROR, ZS_ERROR_ARGUMENT, NULL, near ? hint : NULL,
                   "there is no view '%s'; expected front, back, left, right, top, bottom or iso",
                   name);
}

/* ---- Vectors --------------------------------------------------------------------- */

/* False for vectors without a direction. */
static bool normalize(double a[3])
{
  double largest = fmax(fmax(fabs(a[0]), fabs(a[1])), fabs(a[2]));
  if (!(largest > 0 && largest < INFINITY))
    return false;
  for (int k = 0; k < 3; k++)
    a[k] /= largest;
  double length = sqrt(zs_dot3(a, a));
  for (int k = 0; k < 3; k++)
    a[k] /= length;
  return isfinite(length);
}

/* ---- Set-up ------------------------------------------------------------------------ */

/* Right, up and forward; an `up` along the view gives way to y, then to x. */
static bool set_axes(zs_camera *camera, const zs_view *view, zs_diag *diag)
{
  double *right = camera->frame.axes[0], *up = camera->frame.axes[1],
         *forward = camera->frame.axes[2];
  for (int k = 0; k < 3; k++)
    forward[k] = view->has_eye ? view->target[k] - view->eye[k] : view->direction[k];
  if (!normalize(forward))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   view->has_eye ? "the view's eye and target are the same point, or not finite"
                                 : "the view's direction is zero, or not finite");
  const double ups[3][3] = {{view->up[0], view->up[1], view->up[2]}, {0, 1, 0}, {1, 0, 0}};
  for (int i = 0; i < 3; i++) {
    double along[3] = {ups[i][0], ups[i][1], ups[i][2]};
    if (!normalize(along))
      continue;
    zs_cross3(forward, along, right);
    if (zs_dot3(right, right) > 1e-12)
      break;
  }
  normalize(right);
  zs_cross3(right, forward, up);
  return true;
}

/* A corner of a box relative to a point, along the camera's axes. */
static void corner(const zs_camera *camera, const zs_box *box, int i, const double from[3],
                   double at[3])
{
  double offset[3];
  for (int k = 0; k < 3; k++)
    offset[k] = (i >> k & 1 ? box->hi[k] : box->lo[k]) - from[k];
  for (int k = 0; k < 3; k++)
    at[k] = zs_dot3(camera->frame.axes[k], offset);
}

/* Half the picture's width and height when its half height is 1. */
static void half_sides(const zs_camera *camera, double half[2])
{
  half[0] = (double)camera->width / camera->height;
  half[1] = 1;
}

/* What a picture has to hold: the outline relative to a point, as the extremes
 * of x - t z and -x - t z over its corners (x, z) to the right, and upward. */
typedef struct extent {
  double upper[2], lower[2];
} extent;

static extent extent_of(const zs_camera *camera, const zs_outline *outline, const double from[3],
                        const double t[2])
{
  extent e = {{-INFINITY, -INFINITY}, {-INFINITY, -INFINITY}};
  for (size_t b = 0; b < outline->count; b++)
    for (int i = 0; i < 8; i++) {
      double at[3];
      corner(camera, &outline->boxes[b], i, from, at);
      for (int k = 0; k < 2; k++) {
        e.upper[k] = fmax(e.upper[k], at[k] - t[k] * at[2]);
        e.lower[k] = fmax(e.lower[k], -at[k] - t[k] * at[2]);
      }
    }
  return e;
}

/* Move a point along the camera's axes. */
static void move(const zs_camera *camera, double point[3], double right, double up, double forward)
{
  const double(*axes)[3] = camera->frame.axes;
  for (int k = 0; k < 3; k++)
    point[k] += right * axes[0][k] + up * axes[1][k] + forward * axes[2][k];
}

/* Centre parallel rays on the outline.  Returns the half height that shows it. */
static double frame_parallel(zs_camera *camera, const zs_outline *outline)
{
  const double parallel[2] = {0, 0};
  double half[2];
  half_sides(camera, half);
  extent e = extent_of(camera, outline, camera->frame.origin, parallel);
  double height = 0;
  for (int k = 0; k < 2; k++)
    height = fmax(height, (e.upper[k] + e.lower[k]) / 2 / half[k]);
  move(camera, camera->frame.origin, (e.upper[0] - e.lower[0]) / 2, (e.upper[1] - e.lower[1]) / 2,
       0);
  return height / FILLED;
}

/* The half height of parallel rays about the origin that shows the box. */
static double parallel_height(const zs_camera *camera)
{
  double half[2], height = 0;
  half_sides(camera, half);
  for (int i = 0; i < 8; i++) {
    double at[3];
    corner(camera, &camera->box, i, camera->frame.origin, at);
    height = fmax(height, fmax(fabs(at[0]) / half[0], fabs(at[1]) / half[1]));
  }
  return height / FILLED;
}

/* Put the eye where the outline just fills the picture: `slope` is the tangent
 * of half the vertical angle.  With the eye at (a, -d) a corner is seen when
 * |x - a| <= t (z + d). */
static void frame_perspective(zs_camera *camera, const zs_outline *outline, double slope)
{
  double half[2], t[2], distance = 0;
  half_sides(camera, half);
  for (int k = 0; k < 2; k++)
    t[k] = slope * half[k] * FILLED;
  extent e = extent_of(camera, outline, camera->frame.origin, t);
  for (int k = 0; k < 2; k++)
    distance = fmax(distance, (e.upper[k] + e.lower[k]) / (2 * t[k]));
  move(camera, camera->frame.origin, (e.upper[0] - e.lower[0]) / 2, (e.upper[1] - e.lower[1]) / 2,
       -distance);
}

/* Place the origin; returns the picture's half height at depth 1 in
 * perspective, at any depth without. */
static double place(zs_camera *camera, const zs_view *view, const zs_outline *outline)
{
  const zs_box *box = &camera->box;
  double *origin = camera->frame.origin;
  const double slope = tan(view->field_of_view * acos(-1) / 360);
  camera->frame.perspective = view->field_of_view > 0;
  for (int k = 0; k < 3; k++)
    origin[k] = !view->has_eye                ? (box->lo[k] + box->hi[k]) / 2
                : camera->frame.perspective ? view->eye[k]
                                            : view->target[k];
  if (view->has_eye)
    return camera->frame.perspective ? slope : parallel_height(camera);
  if (!camera->frame.perspective)
    return frame_parallel(camera, outline);
  frame_perspective(camera, outline, slope);
  return slope;
}

/* The depths of the box. */
static void set_depths(zs_camera *camera)
{
  camera->near = INFINITY;
  camera->far = -INFINITY;
  for (int i = 0; i < 8; i++) {
    double at[3];
    corner(camera, &camera->box, i, camera->frame.origin, at);
    camera->near = fmin(camera->near, at[2]);
    camera->far = fmax(camera->far, at[2]);
  }
  if (camera->frame.perspective)
    camera->near = fmax(camera->near, NEAREST * camera->far);
}

bool zs_camera_set(zs_camera *camera, const zs_view *view, const zs_box *box,
                   const zs_outline *outline, uint32_t width, uint32_t height, zs_diag *diag)
{
  *camera = (zs_camera){.width = width, .height = height, .box = *box};
  if (!(view->field_of_view >= 0 && view->field_of_view < 180))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "the view's field of view is %g degrees; expected 0 to below 180",
                   view->field_of_view);
  if (!set_axes(camera, view, diag))
    return false;
  camera->top = place(camera, view, outline);
  camera->pixel = 2 * camera->top / height;
  camera->left = -camera->pixel * width / 2;
  set_depths(camera);
  return true;
}

/* ---- Rays --------------------------------------------------------------------------- */

/* The ray through (u, v): start + w step. */
static void ray(const zs_camera *camera, double u, double v, double start[3], double step[3])
{
  const zs_frame *frame = &camera->frame;
  for (int k = 0; k < 3; k++) {
    double across = u * frame->axes[0][k] + v * frame->axes[1][k];
    start[k] = frame->origin[k] + (frame->perspective ? 0 : across);
    step[k] = frame->axes[2][k] + (frame->perspective ? across : 0);
  }
}

void zs_camera_point(const zs_camera *camera, double u, double v, double w, double point[3])
{
  double start[3], step[3];
  ray(camera, u, v, start, step);
  for (int k = 0; k < 3; k++)
    point[k] = start[k] + w * step[k];
}

void zs_camera_direction(const zs_camera *camera, double u, double v, double direction[3])
{
  double start[3];
  ray(camera, u, v, start, direction);
  normalize(direction);
}

double zs_camera_footprint(const zs_camera *camera, double w)
{
  return camera->pixel * (camera->frame.perspective ? w : 1);
}

zs_ray_span zs_camera_span(const zs_camera *camera, double u, double v)
{
  double start[3], step[3], far = INFINITY;
  double near = camera->frame.perspective ? NEAREST * camera->far : -INFINITY;
  zs_ray_span span = {.axis = -1};
  ray(camera, u, v, start, step);
  for (int k = 0; k < 3; k++) {
    if (step[k] == 0) {
      if (start[k] < camera->box.lo[k] || start[k] > camera->box.hi[k])
        far = -INFINITY;
      continue;
    }
    double low = (camera->box.lo[k] - start[k]) / step[k];
    double high = (camera->box.hi[k] - start[k]) / step[k];
    if (fmin(low, high) >= near) {
      near = fmin(low, high);
      span.axis = k;
      span.side = step[k] > 0 ? -1 : 1;
    }
    far = fmin(far, fmax(low, high));
  }
  span.near = (float)fmax(near, camera->near);
  span.far = near < far ? (float)fmin(far, camera->far) : -INFINITY;
  return span;
}
