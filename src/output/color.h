/* Colours of pictures. */
#ifndef ZS_COLOR_H
#define ZS_COLOR_H

#include <math.h>
#include <stdint.h>

/* Red, green and blue, 0 to 1. */
typedef struct zs_color {
  float r, g, b;
} zs_color;

static inline zs_color zs_color_mix(zs_color a, zs_color b, float t)
{
  return (zs_color){a.r + (b.r - a.r) * t, a.g + (b.g - a.g) * t, a.b + (b.b - a.b) * t};
}

static inline zs_color zs_color_scale(zs_color a, float factor)
{
  return (zs_color){a.r * factor, a.g * factor, a.b * factor};
}

static inline zs_color zs_color_add(zs_color a, zs_color b)
{
  return (zs_color){a.r + b.r, a.g + b.g, a.b + b.b};
}

static inline uint8_t zs_color_byte(float value)
{
  return (uint8_t)(fminf(fmaxf(value, 0), 1) * 255 + 0.5f);
}

static inline void zs_color_store(zs_color color, uint8_t *pixel)
{
  pixel[0] = zs_color_byte(color.r);
  pixel[1] = zs_color_byte(color.g);
  pixel[2] = zs_color_byte(color.b);
}

/* Linear light to what screens expect (sRGB, IEC 61966-2-1). */
static inline float zs_color_encode(float linear)
{
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
}

#endif
