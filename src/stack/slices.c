#include "stack/slices.h"

#include "base/array.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MARGIN = ZS_SLICES_MARGIN };

/* All lengths in pixels.  What pictures of two values are smoothed by; points on the outline
 * and beside it are no nearer to each other; how far the latter are from it. */
static const double BLUR = 0.5;
static const float APART = 0.8F, CROWDED = 0.45F, BESIDE = 1;
/* Values beside the outline that are less say too little about which side it is. */
static const float LEAST = 0.15F;

/* A picture on its way to points. */
typedef struct tracer {
  const zs_slices *slices;
  zs_stack_slice *slice;
  const float *smooth; /* 0 on the outline, positive inside; as large as the distances */
  int32_t *first, *next; /* of the points in each pixel, -1: none; the next one of each */
  size_t capacity;
} tracer;

/* ---- Smoothing ---------------------------------------------------------------------- */

/* One pass of a Gaussian along rows or columns. */
static void blur(const float *from, float *to, size_t count, size_t lines, size_t step,
                 size_t line)
{
  enum { REACH = 2 };
  float weight[REACH + 1], sum = 0;
  for (int k = 0; k <= REACH; k++) {
    weight[k] = (float)exp(-k * k / (2 * BLUR * BLUR));
    sum += k ? 2 * weight[k] : weight[k];
  }
  for (size_t l = 0; l < lines; l++)
    for (size_t i = 0; i < count; i++) {
      const float *at = from + l * line + i * step;
      float f = weight[0] * at[0];
      for (size_t k = 1; k <= REACH; k++) {
        const size_t back = i >= k ? k : i, on = i + k < count ? k : count - 1 - i;
        f += weight[k] * (at[on * step] + *(at - back * step));
      }
      to[l * line + i * step] = f / sum;
    }
}

/* A pixel's brightness; around the picture it is black. */
static float bright(const zs_picture *p, size_t x, size_t y)
{
  return x < p->width && y < p->height ? p->pixels[y * p->width + x] : 0;
}

/* Count pairs of neighbours that the outline passes between, and stairs among them. */
static void count_stairs(zs_slices *s, const zs_picture *p)
{
  for (size_t y = 0; y < p->height; y++)
    for (size_t x = 0; x < p->width; x++)
      for (size_t down = 0; down < 2; down++) { /* numbers below 0 are outside too */
        const size_t right = 1 - down;
        const float a = bright(p, x, y), b = bright(p, x + right, y + down);
        if ((a >= p->level) == (b >= p->level))
          continue;
        s->crossings++;
        s->stairs += a == bright(p, x - right, y - down) &&
                     b == bright(p, x + 2 * right, y + 2 * down);
      }
}

/* Brightness above the level, smoothed; NULL when memory is out.  Margins are black. */
static float *smoothed(const zs_slices *s, const zs_picture *picture)
{
  const size_t count = s->width * s->height;
  float *raw = malloc(count * sizeof *raw), *across = malloc(count * sizeof *across);
  if (raw && across) {
    for (size_t i = 0; i < count; i++)
      raw[i] = -picture->level;
    for (size_t y = 0; y < picture->height; y++)
      for (size_t x = 0; x < picture->width; x++)
        raw[(y + MARGIN) * s->width + x + MARGIN] += picture->pixels[y * picture->width + x];
    blur(raw, across, s->width, s->height, 1, s->width);
    blur(across, raw, s->height, s->width, s->width, 1);
  }
  free(across);
  if (across)
    return raw;
  free(raw);
  return NULL;
}

/* ---- Points ------------------------------------------------------------------------- */

/* A field between the centres of pixels, and its gradient unless that is NULL. */
static float between(const zs_slices *s, const float *field, float x, float y, float gradient[2])
{
  const float right = (float)(s->width - 1), bottom = (float)(s->height - 1);
  x = x < 0 ? 0 : x > right ? right : x;
  y = y < 0 ? 0 : y > bottom ? bottom : y;
  const size_t i = (size_t)x < s->width - 2 ? (size_t)x : s->width - 2;
  const size_t j = (size_t)y < s->height - 2 ? (size_t)y : s->height - 2;
  const float u = x - (float)i, v = y - (float)j, *p = field + j * s->width + i;
  const float a = p[0], b = p[1], c = p[s->width], d = p[s->width + 1];
  if (gradient) {
    gradient[0] = (1 - v) * (b - a) + v * (d - c);
    gradient[1] = (1 - u) * (c - a) + u * (d - b);
  }
  return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
}

static size_t pixel_of(const zs_slices *s, float x, float y)
{
  const size_t i = x > 0 ? (size_t)x : 0, j = y > 0 ? (size_t)y : 0;
  return (j < s->height ? j : s->height - 1) * s->width + (i < s->width ? i : s->width - 1);
}

static bool is_crowded(const tracer *t, float x, float y, float distance)
{
  for (int dy = -1; dy <= 1; dy++)
    for (int dx = -1; dx <= 1; dx++) {
      const size_t pixel = pixel_of(t->slices, x + (float)dx, y + (float)dy);
      for (int32_t i = t->first[pixel]; i >= 0; i = t->next[i]) {
        const zs_slice_point *p = &t->slice->points[i];
        if (hypotf(p->x - x, p->y - y) < distance)
          return true;
      }
    }
  return false;
}

/* False when memory is out. */
static bool add(tracer *t, float x, float y, float value)
{
  zs_stack_slice *s = t->slice;
  size_t capacity = t->capacity;
  zs_slice_point *points =
    zs_array_grown(s->points, s->count + 1, &capacity, sizeof *points);
  s->points = points ? points : s->points;
  int32_t *next = zs_array_grown(t->next, s->count + 1, &t->capacity, sizeof *next);
  t->next = next ? next : t->next;
  if (!points || !next)
    return false;
  const size_t pixel = pixel_of(t->slices, x, y);
  t->next[s->count] = t->first[pixel];
  t->first[pixel] = (int32_t)s->count;
  s->points[s->count++] = (zs_slice_point){x, y, value};
  return true;
}

/* Points on the outline, where the smoothed picture crosses the level between neighbours. */
static bool trace(tracer *t)
{
  const zs_slices *s = t->slices;
  for (size_t y = 0; y + 1 < s->height; y++)
    for (size_t x = 0; x + 1 < s->width; x++)
      for (int down = 0; down < 2; down++) {
        const float *p = t->smooth + y * s->width + x;
        const float a = p[0], b = p[down ? s->width : 1];
        if ((a >= 0) == (b >= 0))
          continue;
        const float along = a / (a - b), px = (float)x + (down ? 0 : along);
        const float py = (float)y + (down ? along : 0);
        if (!is_crowded(t, px, py, APART) && !add(t, px, py, 0))
          return false;
      }
  return true;
}

static float clamped(float x, float lo, float hi)
{
  return x < lo ? lo : x > hi ? hi : x;
}

/* Points beside those on the outline, along the gradient.  Thin parts end before them. */
static bool add_sides(tracer *t)
{
  const size_t count = t->slice->count;
  for (size_t i = 0; i < count; i++)
    for (int side = -1; side <= 1; side += 2) {
      const zs_slice_point p = t->slice->points[i];
      float g[2];
      between(t->slices, t->smooth, p.x, p.y, g);
      const float length = hypotf(g[0], g[1]), step = (float)side * BESIDE;
      if (!(length > 0))
        continue;
      const float x = p.x + step * g[0] / length, y = p.y + step * g[1] / length;
      const float d = (float)side * between(t->slices, t->slice->distance, x, y, NULL);
      if (d < LEAST || is_crowded(t, x, y, CROWDED))
        continue;
      if (!add(t, x, y, (float)side * clamped(d, LEAST, BESIDE)))
        return false;
    }
  return true;
}

static bool make_points(const zs_slices *slices, zs_stack_slice *slice, const float *smooth)
{
  const size_t pixels = slices->width * slices->height;
  tracer t = {.slices = slices, .slice = slice, .smooth = smooth};
  t.first = malloc(pixels * sizeof *t.first);
  bool memory = t.first;
  if (memory) {
    memset(t.first, -1, pixels * sizeof *t.first);
    memory = trace(&t) && add_sides(&t);
  }
  free(t.first);
  free(t.next);
  return memory;
}

/* ---- Slices --------------------------------------------------------------------------- */

/* An empty slice; NULL when memory is out. */
static zs_stack_slice *append(zs_slices *slices, size_t width, size_t height, double at)
{
  zs_stack_slice *grown =
    zs_array_grown(slices->slices, slices->count + 1, &slices->capacity, sizeof *grown);
  if (!grown)
    return NULL;
  slices->slices = grown;
  slices->margin = MARGIN;
  slices->width = width + 2 * MARGIN;
  slices->height = height + 2 * MARGIN;
  zs_stack_slice *slice = &slices->slices[slices->count++];
  *slice = (zs_stack_slice){.height = at};
  return slice;
}

bool zs_slices_add(zs_slices *slices, const zs_picture *picture, double height)
{
  zs_stack_slice *slice = append(slices, picture->width, picture->height, height);
  if (!slice)
    return false;
  slice->distance = malloc(slices->width * slices->height * sizeof *slice->distance);
  const zs_picture_result result = slice->distance
                                     ? zs_picture_distance(picture, MARGIN, slice->distance)
                                     : ZS_PICTURE_MEMORY;
  if (result == ZS_PICTURE_EMPTY) {
    free(slice->distance);
    slice->distance = NULL;
    return true;
  }
  count_stairs(slices, picture);
  float *smooth = result == ZS_PICTURE_DONE ? smoothed(slices, picture) : NULL;
  const bool memory = smooth && make_points(slices, slice, smooth);
  free(smooth);
  return memory;
}

bool zs_slices_add_distance(zs_slices *slices, size_t width, size_t height, float *distance,
                            double at)
{
  zs_stack_slice *slice = append(slices, width, height, at);
  if (!slice) {
    free(distance);
    return false;
  }
  slice->distance = distance;
  return !distance || make_points(slices, slice, distance);
}

void zs_slices_clear(zs_slices *slices)
{
  for (size_t i = 0; i < slices->count; i++) {
    free(slices->slices[i].distance);
    free(slices->slices[i].points);
  }
  free(slices->slices);
  *slices = (zs_slices){0};
}
