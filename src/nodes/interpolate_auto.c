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

static bool lay_out(drawing *d, const double lo[2], const double hi[2])
{
  const double longest = fmax(hi[0] - lo[0], hi[1] - lo[1]);
  if (!(longest > 0))
    return false;
  d->cell = longest / PIXELS;
  d->width = (size_t)ceil((hi[0] - lo[0]) / d->cell) + 2 * MARGIN;
  d->height = (size_t)ceil((hi[1] - lo[1]) / d->cell) + 2 * MARGIN;
  for (int k = 0; k < 2; k++) {
    d->lo[k] = lo[k] - MARGIN * d->cell;
    d->distance[k] = malloc((d->width + 2) * (d->height + 2) * sizeof *d->distance[k]);
  }
  return d->distance[0] && d->distance[1];
}

/* f at the centres of pixels, as brightness about 1 where it is 0. */
static bool sample(const drawing *d, zs_field *field, float *pixels, zs_diag *diag)
{
  zs_eval *eval = zs_eval_new(field, diag);
  float *row = malloc(3 * d->width * sizeof *row);
  if (!eval || !row) {
    zs_eval_free(eval);
    free(row);
    return false;
  }
  float *x = row, *y = row + d->width, *z = y + d->width, most = 0;
  for (size_t j = 0; j < d->height; j++) {
    for (size_t i = 0; i < d->width; i++) {
      x[i] = (float)(d->lo[0] + ((double)i + 0.5) * d->cell);
      y[i] = (float)(d->lo[1] + ((double)j + 0.5) * d->cell);
      z[i] = 0;
    }
    zs_eval_values(eval, NULL, d->width, x, y, z, pixels + j * d->width);
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
static bool draw(drawing *d, int k, zs_field *field, zs_diag *diag)
{
  float *pixels = malloc(d->width * d->height * sizeof *pixels);
  bool done = pixels && sample(d, field, pixels, diag);
  if (done) {
    const zs_picture picture = {d->width, d->height, pixels, 1};
    float *distance = d->distance[k];
    done = zs_picture_distance(&picture, 1, distance) == ZS_PICTURE_DONE;
    for (size_t j = 0; done && j < d->height; j++)
      memmove(distance + j * d->width, distance + (j + 1) * (d->width + 2) + 1,
              d->width * sizeof *distance);
  }
  free(pixels);
  return done;
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

/* As many pairs as there is room for, evenly along the outline. */
static size_t find_pairs(const drawing *d, double (*ends)[4])
{
  zs_motion m;
  size_t count = 0;
  if (zs_motion_find(&m, d->distance[0], d->distance[1], d->width, d->height, PLIANT, true)) {
    float apart = APART;
    do {
      count = choose(d, &m, apart, ends);
      apart *= 1.3F;
    } while (count == MOST_PAIRS);
  }
  zs_motion_clear(&m);
  return count;
}

size_t zs_between_find_pairs(zs_compiler *compiler, const zs_node *const levels[2],
                             double (**ends)[4])
{
  drawing d = {.width = 0};
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_field *fields[2] = {NULL, NULL};
  double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
  bool done = true;
  size_t count = 0;
  *ends = zs_arena_alloc(zs_compiler_arena(compiler), MOST_PAIRS, sizeof **ends);
  for (int k = 0; k < 2 && done; k++) {
    double from[3], to[3];
    done = *ends && zs_level_box(levels[k], from, to);
    for (int c = 0; c < 2 && done; c++) {
      lo[c] = fmin(lo[c], from[c]);
      hi[c] = fmax(hi[c], to[c]);
    }
    fields[k] = done ? zs_children_field(compiler, levels[k], diag) : NULL;
    done = fields[k];
  }
  if (done && lay_out(&d, lo, hi) && draw(&d, 0, fields[0], diag) &&
      draw(&d, 1, fields[1], diag))
    count = find_pairs(&d, *ends);
  for (int k = 0; k < 2; k++) {
    free(d.distance[k]);
    zs_field_unref(fields[k]);
  }
  return count;
}
