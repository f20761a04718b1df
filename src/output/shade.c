#include "output/shade.h"

#include <math.h>
#include <string.h>

/* Lights along the camera's axes (right, up, towards the eye). */
static const float key_direction[3] = {-0.50f, 0.68f, 0.62f};
static const float fill_direction[3] = {0.80f, 0.10f, 0.55f};

static const zs_color key_light = {1.00f, 0.96f, 0.90f}, fill_light = {0.20f, 0.25f, 0.31f},
                      sky_light = {0.40f, 0.43f, 0.48f}, ground_light = {0.20f, 0.18f, 0.16f};

/* Surfaces are of pale clay, cuts of terracotta. */
static const zs_color clay = {0.64f, 0.56f, 0.44f}, terracotta = {0.60f, 0.22f, 0.12f};

static const zs_color backdrop_top = {0.88f, 0.91f, 0.95f}, backdrop_bottom = {0.58f, 0.63f, 0.70f};

static const float GLOSS = 0.08f, GLOSS_EXPONENT = 40;

/* How far surfaces darken each other, relative to the box's diagonal, and in
 * pixels at most and least. */
static const double REACH = 0.06;
static const float WIDEST = 64, NARROWEST = 2;

static float dot(const float a[3], const float b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void along_axes(const zs_camera *camera, const float direction[3], float out[3])
{
  const double(*axes)[3] = camera->frame.axes;
  float length = sqrtf(dot(direction, direction));
  for (int k = 0; k < 3; k++)
    out[k] = ((float)axes[0][k] * direction[0] + (float)axes[1][k] * direction[1] -
              (float)axes[2][k] * direction[2]) /
             length;
}

zs_studio zs_studio_for(const zs_camera *camera)
{
  zs_studio studio;
  along_axes(camera, key_direction, studio.key);
  along_axes(camera, fill_direction, studio.fill);
  return studio;
}

/* Light that wraps a little around the edge of what it lights. */
static float wrapped(float cosine, float wrap)
{
  return fmaxf((cosine + wrap) / (1 + wrap), 0);
}

/* Blinn's highlight: the normal against the middle of light and eye. */
static float highlight(const float normal[3], const float light[3], const double ray[3])
{
  float middle[3];
  for (int k = 0; k < 3; k++)
    middle[k] = light[k] - (float)ray[k];
  float length = sqrtf(dot(middle, middle));
  return length > 0 ? GLOSS * powf(fmaxf(dot(normal, middle) / length, 0), GLOSS_EXPONENT) : 0;
}

static zs_color product(zs_color a, zs_color b)
{
  return (zs_color){a.r * b.r, a.g * b.g, a.b * b.b};
}

zs_color zs_shade(const zs_studio *studio, const zs_camera *camera, const zs_hit *hit, double u,
                  double v, float open)
{
  double ray[3];
  zs_camera_direction(camera, u, v, ray);
  zs_color light = zs_color_mix(ground_light, sky_light, 0.5f + 0.5f * hit->normal[2]);
  light = zs_color_scale(light, open);
  /* Crevices see less of the lamps too, though they are not as wide as the sky. */
  const float direct = 0.4f + 0.6f * open;
  float key = direct * wrapped(dot(hit->normal, studio->key), 0.15f);
  float fill = direct * wrapped(dot(hit->normal, studio->fill), 0.3f);
  light = zs_color_add(light, zs_color_scale(key_light, key));
  light = zs_color_add(light, zs_color_scale(fill_light, fill));
  zs_color color = product(hit->kind == ZS_HIT_CUT ? terracotta : clay, light);
  const float shine = open * highlight(hit->normal, studio->key, ray);
  return zs_color_add(color, zs_color_scale(key_light, shine));
}

zs_color zs_backdrop(float height)
{
  return zs_color_mix(backdrop_bottom, backdrop_top, height);
}

/* ---- Openness ------------------------------------------------------------------------ */

ZS_DECLARE_VARIANTS(zs_sky_kernel, zs_sky_kernel)
static const zs_sky_kernel *const kernels[ZS_ISA_COUNT] = ZS_VARIANTS(zs_sky_kernel, );

static float diagonal(const zs_camera *camera)
{
  double sum = 0;
  for (int k = 0; k < 3; k++) {
    double side = camera->box.hi[k] - camera->box.lo[k];
    sum += side * side;
  }
  return (float)sqrt(sum);
}

/* How far around a hit others are looked at, in pixels: 0 when they would be
 * too near to count. */
static float radius_of(const zs_camera *camera, const zs_hit *hit, float reach)
{
  if (hit->kind == ZS_HIT_NOTHING)
    return 0;
  const float radius = fminf(reach / (float)zs_camera_footprint(camera, (double)hit->depth), WIDEST);
  return radius >= NARROWEST ? radius : 0;
}

/* Where pixel i of a run is and which way it faces, along the camera's axes. */
static void place(zs_sky *sky, unsigned i, const zs_camera *camera, const zs_hit *hit)
{
  const float scale = camera->frame.perspective ? hit->depth : 1;
  sky->u[i] = (float)(camera->left + (sky->x + i + 0.5) * camera->pixel);
  sky->at[0][i] = sky->u[i] * scale;
  sky->at[1][i] = sky->v * scale;
  sky->at[2][i] = hit->depth;
  for (int k = 0; k < 3; k++)
    sky->normal[k][i] = (float)(camera->frame.axes[k][0] * (double)hit->normal[0] +
                                camera->frame.axes[k][1] * (double)hit->normal[1] +
                                camera->frame.axes[k][2] * (double)hit->normal[2]);
}

void zs_openness(const zs_camera *camera, const zs_hit *hits, const float *depth, uint32_t y,
                 float *open)
{
  const zs_hit *row = hits + (size_t)y * camera->width;
  zs_sky sky = {.y = y,
                .width = camera->width,
                .height = camera->height,
                .depth = depth,
                .perspective = camera->frame.perspective,
                .pixel = (float)camera->pixel,
                .reach = (float)REACH * diagonal(camera),
                .v = (float)(camera->top - (y + 0.5) * camera->pixel)};
  for (; sky.x < camera->width; sky.x += sky.n) {
    const uint32_t left = camera->width - sky.x;
    float widest = 0;
    sky.n = left < ZS_BLOCK ? left : ZS_BLOCK;
    memset(sky.radius, 0, sizeof sky.radius);
    for (unsigned i = 0; i < sky.n; i++) {
      sky.radius[i] = radius_of(camera, &row[sky.x + i], sky.reach);
      widest = fmaxf(widest, sky.radius[i]);
      if (sky.radius[i] > 0)
        place(&sky, i, camera, &row[sky.x + i]);
    }
    if (widest > 0)
      kernels[zs_isa_select()]->openness(&sky);
    for (unsigned i = 0; i < sky.n; i++)
      open[sky.x + i] = sky.radius[i] > 0 ? sky.open[i] : 1;
  }
}
