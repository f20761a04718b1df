/* Pairs of <between correspondence="auto">: two shapes are drawn on pixels, one is registered
 * to the other, and points along the outline half-way become pairs.  Each shape fills its drawing,
 * so that how large it is and where does not matter. */
#include "nodes/interpolate.h"

#include "samples/picture.h"
#include "stack/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  PIXELS = 96,  /* along the longer side of a shape */
  MARGIN = 12,  /* of pixels around them */
  MOST_PAIRS = 32
};

/* How stiff motions are (stack/motion.h): shapes alone may bend. */
static const float PLIANT = 30;

/* How near to the outline half-way, and to each other, points are, in pixels. */
static const float NEAR = 0.75F, APART = 4;

/* The pixels of a shape. */
typedef struct sheet {
  double lo[2], cell; /* the lower left corner of the first pixel; a pixel's side */
  float *distance;
} sheet;

/* Two shapes on as many pixels each. */
typedef struct drawing {
  size_t width, height;
  sheet sheets[2];
} drawing;

/* The box around a shape; its heights do not matter. */
typedef struct box {
  double lo[3], hi[3];
} box;

/* False when memory is out. */
static bool lay_out(drawing *d, const box boxes[2])
{
  double most[2] = {0, 0};
  for (int i = 0; i < 2; i++) {
    const double sides[2] = {boxes[i].hi[0] - boxes[i].lo[0], boxes[i].hi[1] - boxes[i].lo[1]};
    d->sheets[i].cell = fmax(sides[0], sides[1]) / PIXELS;
    for (int k = 0; k < 2; k++)
      most[k] = fmax(most[k], sides[k] / d->sheets[i].cell);
  }
  d->width = (size_t)ceil(most[0]) + 2 * MARGIN;
  d->height = (size_t)ceil(most[1]) + 2 * MARGIN;
  for (int i = 0; i < 2; i++) {
    sheet *s = &d->sheets[i];
    for (int k = 0; k < 2; k++)
      s->lo[k] = (boxes[i].lo[k] + boxes[i].hi[k]) / 2 -
                 (double)(k ? d->height : d->width) / 2 * s->cell;
    s->distance = malloc((d->width + 2) * (d->height + 2) * sizeof *s->distance);
  }
  return d->sheets[0].distance && d->sheets[1].distance;
}

/* f at the centres of pixels, as brightness about 1 where it is 0.  False when memory is out. */
static bool sample(const drawing *d, const sheet *s, zs_field *field, float *pixels)
{
  const double origin[3] = {s->lo[0], s->lo[1], 0};
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
      x[i] = (float)(((double)i + 0.5) * s->cell);
      y[i] = (float)(((double)j + 0.5) * s->cell);
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
static zs_picture_result draw(drawing *d, int i, zs_field *field)
{
  float *pixels = malloc(d->width * d->height * sizeof *pixels);
  zs_picture_result result = ZS_PICTURE_MEMORY;
  if (pixels && sample(d, &d->sheets[i], field, pixels)) {
    const zs_picture picture = {d->width, d->height, pixels, 1};
    float *distance = d->sheets[i].distance;
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
    const float f = (zs_motion_sample(d->sheets[0].distance, d->width, d->height, x - u[0],
                                      y - u[1]) +
                     zs_motion_sample(d->sheets[1].distance, d->width, d->height, x + u[0],
                                      y + u[1])) / 2;
    bool good = fabsf(f) < NEAR;
    for (size_t k = 0; k < count && good; k++)
      good = hypotf(chosen[k][0] - x, chosen[k][1] - y) >= apart;
    if (!good)
      continue;
    for (int c = 0; c < 4; c++) {
      const sheet *s = &d->sheets[c / 2];
      const double at = (double)((c % 2 ? y : x) + (c < 2 ? -u[c % 2] : u[c % 2])) + 0.5;
      ends[count][c] = s->lo[c % 2] + at * s->cell;
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
  const bool found = zs_motion_find(&m, d->sheets[0].distance, d->sheets[1].distance, d->width,
                                    d->height, PLIANT, true);
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
  for (int i = 0; i < 2 && result == ZS_PICTURE_DONE; i++)
    result = draw(d, i, fields[i]);
  return result == ZS_PICTURE_DONE ? find_pairs(d, ends, count) : result != ZS_PICTURE_MEMORY;
}

/* Without a box around each shape there are no pairs, of which a warning tells. */
static bool find_boxes(const zs_node *between, const zs_node *const levels[2], box boxes[2],
                       zs_diag *diag)
{
  for (int i = 0; i < 2; i++) {
    const double *lo = boxes[i].lo, *hi = boxes[i].hi;
    if (!zs_level_box(levels[i], boxes[i].lo, boxes[i].hi)) {
      const zs_place place = zs_node_place(between, "correspondence");
      zs_report(diag, ZS_WARNING, ZS_ERROR_GEOMETRY, &place, NULL,
                "there are no pairs: the shape at %g is empty or has no bounds",
                zs_level_height(levels[i]));
      return false;
    }
    if (!(hi[0] > lo[0] || hi[1] > lo[1]))
      return false;
  }
  return true;
}

bool zs_between_find_pairs(zs_compiler *compiler, const zs_node *between,
                           const zs_node *const levels[2], double (**ends)[4], size_t *count)
{
  drawing d = {.width = 0};
  zs_diag *diag = zs_compiler_diag(compiler);
  zs_field *fields[2] = {NULL, NULL};
  box boxes[2];
  *count = 0;
  *ends = zs_arena_alloc(zs_compiler_arena(compiler), MOST_PAIRS, sizeof **ends);
  if (!*ends)
    return zs_fail_memory(diag);
  if (!find_boxes(between, levels, boxes, diag))
    return true;
  for (int i = 0; i < 2; i++)
    fields[i] = zs_children_field(compiler, levels[i], diag);
  bool done = fields[0] && fields[1];
  if (done)
    done = (lay_out(&d, boxes) && draw_and_find(&d, fields, *ends, count)) ||
           zs_fail_memory(diag);
  for (int i = 0; i < 2; i++) {
    free(d.sheets[i].distance);
    zs_field_unref(fields[i]);
  }
  return done;
}
