/* Pairs of <between correspondence="auto">: two shapes are drawn on pixels, one is registered
 * to the other, and points along the outline half-way become pairs. */
#include "nodes/interpolate.h"

#include "samples/picture.h"
#include "stack/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  PIXELS = 96,  /* along the longer side of both shapes */
  MARGIN = 12,  /* of pixels around them */
  MOST_PAIRS = 32
};

/* How stiff motions are (stack/motion.h): shapes alone may bend. */
static const float PLIANT = 30;

/* How near to the outline half-way, and to each other, points are, in pixels. */
static const float NEAR = 0.75F, APART = 4;

/* Two shapes on the same pixels. */
typedef struct drawing {
  double lo[2], cell; /* the lower left corner of the first pixel; a pixel's side */
  size_t width, height;
  float *distance[2];
} drawing;

/* False when memory is out. */
static bool lay_out(drawing *d, const double lo[2], const double hi[2])
{
  d->cell = fmax(hi[0] - lo[0], hi[1] - lo[1]) / PIXELS;
  d->width = (size_t)ceil((hi[0] - lo[0]) / d->cell) + 2 * MARGIN;
  d->height = (size_t)ceil((hi[1] - lo[1]) / d->cell) + 2 * MARGIN;
  for (int k = 0; k < 2; k++) {
    d->lo[k] = lo[k] - MARGIN * d->cell;
    d->distance[k] = malloc((d->width + 2) * (d->height + 2) * sizeof *d->distance[k]);
  }
  return d->distance[0] && d->distance[1];
}

/* f at the centres of pixels, as brightness about 1 where it is 0.  False when memory is out. */
static bool sample(const drawing *d, zs_field *field, float *pixels)
{
  const double origin[3] = {d->lo[0], d->lo[1], 0};
  zs_eval *eval = zs_eval_new(field, NULL);
  float *row = malloc(3 * d->width * sizeof *row);
  if (!eval || !row) {
    zs_eval_free(eval);
    free(row);
    return false;
  }
  float *x = row, *y = row + d->width, *z = y + d->width, most = 0;
  for (size_t j = 0; j < d->height; j++) {
    for (size_t i = 0; i < d->width; i++) {
      x[i] = (float)(((double)i + 0.5) * d->cell);
      y[i] = (float)(((double)j + 0.5) * d->cell);
      z[i] = 0;
    }
    zs_eval_values(eval, origin, d->width, x, y, z, pixels + j * d->width);
  }
  zs_eval_free(eval);
  free(row);
  for (size_t i = 0; i < d->width * d->height; i++)
    if (isfinite(pixels[i]))
      most = fmaxf(most, fabsf(pixels[i]));
  for (size_t i = 0; i < d->width * d->height; i++)
    pixels[i] = isfinite(pixels[i]) && most > 0 ? 1 + pixels[i] / most : pixels[i] > 0 ? 2 : 0;
  return true;
}

/* The distances of a shape, without the margin that zs_picture_distance adds. */
static zs_picture_result draw(drawing *d, int k, zs_field *field)
{
  float *pixels = malloc(d->width * d->height * sizeof *pixels);
  zs_picture_result result = ZS_PICTURE_MEMORY;
  if (pixels && sample(d, field, pixels)) {
    const zs_picture picture = {d->width, d->height, pixels, 1};
    float *distance = d->distance[k];
    result = zs_picture_distance(&picture, 1, distance);
    for (size_t j = 0; result == ZS_PICTURE_DONE && j < d->height; j++)
      memmove(distance + j * d->width, distance + (j + 1) * (d->width + 2) + 1,
              d->width * sizeof *distance);
  }
  free(pixels);
  return result;
}

/* Points near the outline half-way and not near to each other, as pairs: x and y of where
 * each comes from, and of where it goes. */
static size_t choose(const drawing *d, const zs_motion *m, float apart, double (*ends)[4])
{
  float chosen[MOST_PAIRS][2];
  size_t count = 0;
  for (size_t i = 0; i < d->width * d->height && count < MOST_PAIRS; i++) {
    const float x = (float)(i % d->width), y = (float)(i / d->width);
    const float u[2] = {m->u[0][i] / 2, m->u[1][i] / 2};
    const float f = (zs_motion_sample(d->distance[0], d->width, d->height, x - u[0], y - u[1]) +
                     zs_motion_sample(d->distance[1], d->width, d->height, x + u[0], y + u[1])) / 2;
    bool good = fabsf(f) < NEAR;
    for (size_t k = 0; k < count && good; k++)
      good = hypotf(chosen[k][0] - x, chosen[k][1] - y) >= apart;
    if (!good)
      continue;
    for (int c = 0; c < 4; c++) {
      const double at = (double)((c % 2 ? y : x) + (c < 2 ? -u[c % 2] : u[c % 2])) + 0.5;
      ends[count][c] = d->lo[c % 2] + at * d->cell;
    }
    chosen[count][0] = x;
    chosen[count++][1] = y;
  }
  return count;
}

/* As many pairs as there is room for, evenly along the outline.  False when memory is out. */
static bool find_pairs(const drawing *d, double (*ends)[4], size_t *count)
{
  zs_motion m;
  const bool found =
    zs_motion_find(&m, d->distance[0], d->distance[1], d->width, d->height, PLIANT, true);
  if (found) {
    float apart = APART;
    do {
      *count = choose(d, &m, apart, ends);
      apart *= 1.3F;
    } while (*count == MOST_PAIRS);
  }
  zs_motion_clear(&m);
  return found;
}

/* Draw both shapes, and find the pairs unless one of them is too small to be seen. */
static bool draw_and_find(drawing *d, zs_field *const fields[2], double (*ends)[4], size_t *count)
{
  zs_picture_result result = ZS_PICTURE_DONE;
  for (int k = 0; k < 2 && result == ZS_PICTURE_DONE; k++)
    result = draw(d, k, fields[k]);
  return result == ZS_PICTURE_DONE ? find_pairs(d, ends, count) : result != ZS_PICTURE_MEMORY;
}

/* The box around both shapes.  Without one there are no pairs, of which a warning tells. */
static bool find_box(const zs_node *between, const zs_node *const levels[2], double lo[2],
                     double hi[2], zs_diag *diag)
{
  for (int c = 0; c < 2; c++) {
    lo[c] = INFINITY;
    hi[c] = -INFINITY;
  }
  for (int k = 0; k < 2; k++) {
    double from[3], to[3];
    if (!zs_level_box(levels[k], from, to)) {
      const zs_place place = zs_node_place(between, "correspondence");
      zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
                "there are no pairs: the shape at %g is empty or has no bounds",
                zs_level_height(levels[k]));
      return false;
    }
    for (int c = 0; c < 2; c++) {
      lo[c] = fmin(lo[c], from[c]);
      hi[c] = fmax(hi[c], to[c]);
    }
  }
  return hi[0] > lo[0] || hi[1] > lo[1];
}

bool zs_between_find_pairs(zs_compiler *compiler, const zs_node *between,
                           const zs_node *const levels[2], double (**ends)[4], size_t *count)
{
  drawing d = {.width = 0};
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_field *fields[2] = {NULL, NULL};
  double lo[2], hi[2];
  *count = 0;
  *ends = zs_arena_alloc(zs_compiler_arena(compiler), MOST_PAIRS, sizeof **ends);
  if (!*ends)
    return zs_fail_memory(diag);
  if (!find_box(between, levels, lo, hi, diag))
    return true;
  for (int k = 0; k < 2; k++)
    fields[k] = zs_children_field(compiler, levels[k], diag);
  bool done = fields[0] && fields[1];
  if (done)
    done = (lay_out(&d, lo, hi) && draw_and_find(&d, fields, *ends, count)) ||
           zs_fail_memory(diag);
  for (int k = 0; k < 2; k++) {
    free(d.distance[k]);
    zs_field_unref(fields[k]);
  }
  return done;
}
