#include "stack/motion_fields.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  LEVELS = 4,   /* of the pyramid at the most */
  LEAST = 12,   /* pixels along a side of its coarsest level */
  WARPS = 6,    /* linearisations on each level */
  SWEEPS = 25   /* Jacobi's iterations for each */
};

/* The displacement is found where one of the distances is about as small as this, in pixels
 * of the finest level, and continued smoothly from there. */
static const float NEAR = 6, LEAST_NEAR = 1.5F;
/* One level of the pyramid. */
typedef struct level {
  size_t width, height;
  float scale;      /* of its pixels, in those of the finest */
  float *field[2];  /* smoothed distances, in its pixels */
  float *slope[2][2];
  float *start[2], *v[2], *next[2]; /* the displacement is start + v */
  float *gx, *gy, *rest, *weight;   /* of one linearisation */
} level;

/* ---- The pyramid ----------------------------------------------------------------------- */

static bool allocate(float **field, size_t count)
{
  *field = calloc(count, sizeof **field);
  return *field;
}

static bool make_level(level *l, size_t width, size_t height, float scale)
{
  const size_t count = width * height;
  *l = (level){.width = width, .height = height, .scale = scale};
  bool memory = allocate(&l->gx, count) && allocate(&l->gy, count) && allocate(&l->rest, count) &&
                allocate(&l->weight, count);
  for (int k = 0; memory && k < 2; k++)
    memory = allocate(&l->field[k], count) && allocate(&l->slope[k][0], count) &&
             allocate(&l->slope[k][1], count) && allocate(&l->start[k], count) &&
             allocate(&l->v[k], count) && allocate(&l->next[k], count);
  return memory;
}

static void free_level(level *l)
{
  for (int k = 0; k < 2; k++) {
    free(l->field[k]);
    free(l->slope[k][0]);
    free(l->slope[k][1]);
    free(l->start[k]);
    free(l->v[k]);
    free(l->next[k]);
  }
  free(l->gx);
  free(l->gy);
  free(l->rest);
  free(l->weight);
}

/* Means of four, in pixels that are twice as large. */
static void halve(const float *from, size_t width, size_t height, level *l, float *to)
{
  for (size_t y = 0; y < l->height; y++)
    for (size_t x = 0; x < l->width; x++) {
      const size_t i = 2 * x, j = 2 * y, right = i + 1 < width ? i + 1 : i;
      const size_t down = j + 1 < height ? j + 1 : j;
      to[y * l->width + x] = (from[j * width + i] + from[j * width + right] +
                              from[down * width + i] + from[down * width + right]) / 8;
    }
}

static void differentiate(level *l)
{
  for (int k = 0; k < 2; k++) {
    zs_field_blur(l->field[k], l->rest, l->width, l->height, 1);
    for (size_t y = 0; y < l->height; y++)
      for (size_t x = 0; x < l->width; x++) {
        const float *f = l->field[k];
        const zs_field_neighbours n = zs_field_around(l->width, l->height, x, y);
        l->slope[k][0][y * l->width + x] = (f[n.right] - f[n.left]) / 2;
        l->slope[k][1][y * l->width + x] = (f[n.down] - f[n.up]) / 2;
      }
  }
}

/* ---- Alignment ---------------------------------------------------------------------------- */

static double determinant(const zs_motion_matrix *a)
{
  return a->xx * a->yy - a->xy * a->xy;
}

/* Where what is inside lies, and how far it spreads. */
typedef struct moments {
  double centre[2];
  zs_motion_matrix spread; /* covariance, of pixels that are squares: invertible */
} moments;

static moments moments_of(const float *field, size_t width, size_t height)
{
  double count = 0, sum[2] = {0, 0}, xx = 0, xy = 0, yy = 0;
  for (size_t i = 0; i < width * height; i++) {
    if (field[i] < 0)
      continue;
    const double x = (double)(i % width), y = (double)(i / width);
    count++;
    sum[0] += x;
    sum[1] += y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  static const double PIXEL = 1.0 / 12;
  const double x = sum[0] / count, y = sum[1] / count;
  return (moments){{x, y},
                   {fmax(xx / count - x * x, 0) + PIXEL, xy / count - x * y,
                    fmax(yy / count - y * y, 0) + PIXEL}};
}

/* What takes one centre to the other, and one spread to the other in two equal steps. */
typedef struct alignment {
  double middle[2], shift[2];
  zs_motion_matrix grow; /* how the displacement changes from the middle on */
  double scale[2];       /* of either's distances, to be those half-way */
} alignment;

/* The map of spreads is the one that neither turns nor reflects: the geometric mean of the inverse
 * of the one matrix and of the other.  Half-way (1 + map) / 2 has been done, so that what is left
 * and what is behind differ by 2 (map - 1) / (map + 1). */
static alignment align(const moments *from, const moments *to)
{
  const double a = determinant(&from->spread), b = determinant(&to->spread);
  /* With determinants of 1, these two add up to a multiple of the map. */
  const double p = 1 / sqrt(a), q = 1 / sqrt(b);
  const zs_motion_matrix sum = {from->spread.yy * p + to->spread.xx * q,
                                to->spread.xy * q - from->spread.xy * p,
                                from->spread.xx * p + to->spread.yy * q};
  const double scale = sqrt(sqrt(b / a) / determinant(&sum));
  const zs_motion_matrix map = {sum.xx * scale, sum.xy * scale, sum.yy * scale};
  const zs_motion_matrix more = {map.xx + 1, map.xy, map.yy + 1};
  const double twice = 2 / determinant(&more), square = map.xy * map.xy;
  alignment all = {.grow = {twice * ((map.xx - 1) * more.yy - square), twice * 2 * map.xy,
                            twice * ((map.yy - 1) * more.xx - square)}};
  for (int k = 0; k < 2; k++) {
    all.middle[k] = (from->centre[k] + to->centre[k]) / 2;
    all.shift[k] = to->centre[k] - from->centre[k];
    const double on = k ? 0.5 : -0.5;
    const zs_motion_matrix own = {1 + on * all.grow.xx, on * all.grow.xy, 1 + on * all.grow.yy};
    all.scale[k] = 1 / sqrt(determinant(&own));
  }
  return all;
}

static void align_level(level *l, const alignment *all)
{
  for (size_t i = 0; i < l->width * l->height; i++) {
    const double x = l->scale * ((double)(i % l->width) + 0.5) - 0.5 - all->middle[0];
    const double y = l->scale * ((double)(i / l->width) + 0.5) - 0.5 - all->middle[1];
    l->start[0][i] = (float)((all->shift[0] + all->grow.xx * x + all->grow.xy * y) / l->scale);
    l->start[1][i] = (float)((all->shift[1] + all->grow.xy * x + all->grow.yy * y) / l->scale);
  }
}

/* ---- Registration ---------------------------------------------------------------------------- */

/* Both fields where the present displacement takes them, and how they differ there. */
static void linearise(level *l)
{
  const size_t w = l->width, h = l->height;
  const float near = fmaxf(NEAR / l->scale, LEAST_NEAR);
  for (size_t i = 0; i < w * h; i++) {
    const float ux = (l->start[0][i] + l->v[0][i]) / 2, uy = (l->start[1][i] + l->v[1][i]) / 2;
    const float x = (float)(i % w), y = (float)(i / w);
    const float a = zs_motion_sample(l->field[0], w, h, x - ux, y - uy);
    const float b = zs_motion_sample(l->field[1], w, h, x + ux, y + uy);
    float g[2];
    for (int k = 0; k < 2; k++)
      g[k] = (zs_motion_sample(l->slope[0][k], w, h, x - ux, y - uy) +
              zs_motion_sample(l->slope[1][k], w, h, x + ux, y + uy)) / 2;
    const float least = fminf(fabsf(a), fabsf(b));
    l->gx[i] = g[0];
    l->gy[i] = g[1];
    l->rest[i] = b - a - g[0] * l->v[0][i] - g[1] * l->v[1][i];
    l->weight[i] = expf(-least * least / (2 * near * near)) + 1e-3F;
  }
}

/* The mean of a pixel's neighbours, moved towards agreement. */
static inline void relax(const level *l, size_t i, zs_field_neighbours n, float smoothness)
{
  const float *u = l->v[0], *v = l->v[1];
  const float mx = (u[n.left] + u[n.right] + u[n.up] + u[n.down]) / 4;
  const float my = (v[n.left] + v[n.right] + v[n.up] + v[n.down]) / 4;
  const float gx = l->gx[i], gy = l->gy[i], weight = l->weight[i];
  const float step = weight * (l->rest[i] + gx * mx + gy * my) /
                     (smoothness + weight * (gx * gx + gy * gy));
  l->next[0][i] = mx - gx * step;
  l->next[1][i] = my - gy * step;
}

/* One of Jacobi's iterations. */
static void sweep(level *l, float smoothness)
{
  const level at = *l; /* whose pointers do not change */
  const size_t w = l->width, h = l->height;
  for (size_t y = 0; y < h; y++) {
    const size_t row = y * w, last = row + w - 1;
    const size_t up = y > 0 ? w : 0, down = y + 1 < h ? w : 0;
    relax(&at, row, zs_field_around(w, h, 0, y), smoothness);
    relax(&at, last, zs_field_around(w, h, w - 1, y), smoothness);
#pragma omp simd
    for (size_t i = row + 1; i < last; i++)
      relax(&at, i, (zs_field_neighbours){i - 1, i + 1, i - up, i + down}, smoothness);
  }
  for (int k = 0; k < 2; k++) {
    float *v = l->v[k];
    l->v[k] = l->next[k];
    l->next[k] = v;
  }
}

/* The displacement of a coarser level, in pixels half as large. */
static void refine(const level *from, level *to)
{
  for (int k = 0; k < 2; k++) {
    for (size_t i = 0; i < to->width * to->height; i++) {
      const size_t x = zs_field_clamped((ptrdiff_t)(i % to->width / 2), from->width);
      const size_t y = zs_field_clamped((ptrdiff_t)(i / to->width / 2), from->height);
      to->v[k][i] = 2 * from->v[k][y * from->width + x];
    }
    zs_field_blur(to->v[k], to->rest, to->width, to->height, 1);
  }
}

static void register_level(level *l, float smoothness)
{
  for (int warp = 0; warp < WARPS; warp++) {
    linearise(l);
    for (int k = 0; k < SWEEPS; k++)
      sweep(l, smoothness);
  }
}

/* ---- All of it -------------------------------------------------------------------------- */

static bool have_common_pixel(const float *a, const float *b, size_t count)
{
  for (size_t i = 0; i < count; i++)
    if (a[i] >= 0 && b[i] >= 0)
      return true;
  return false;
}

/* The levels' fields, the finest first: `scale` times those given. */
static bool make_pyramid(level *levels, unsigned count, const float *const fields[2],
                         const double scale[2], size_t width, size_t height)
{
  for (unsigned l = 0; l < count; l++) {
    if (!make_level(&levels[l], width, height, (float)(1U << l)))
      return false;
    for (int k = 0; k < 2; k++)
      if (l > 0)
        halve(levels[l - 1].field[k], levels[l - 1].width, levels[l - 1].height, &levels[l],
              levels[l].field[k]);
      else
        for (size_t i = 0; i < width * height; i++)
          levels[0].field[k][i] = (float)scale[k] * fields[k][i];
    width = (width + 1) / 2;
    height = (height + 1) / 2;
  }
  for (unsigned l = 0; l < count; l++)
    differentiate(&levels[l]);
  return true;
}

bool zs_motion_find(zs_motion *motion, const float *from, const float *to, size_t width,
                    size_t height, float smoothness, bool aligned)
{
  const size_t count = width * height;
  const float *const fields[2] = {from, to};
  level levels[LEVELS] = {{0}};
  *motion = (zs_motion){.width = width, .height = height};
  bool memory = allocate(&motion->u[0], count) && allocate(&motion->u[1], count) &&
                allocate(&motion->gate, count);
  motion->apart = !have_common_pixel(from, to, count);
  aligned = aligned || motion->apart;
  alignment between = {.scale = {1, 1}};
  if (aligned) {
    const moments a = moments_of(from, width, height), b = moments_of(to, width, height);
    between = align(&a, &b);
  }
  unsigned used = 1;
  while (used < (aligned ? LEVELS : LEVELS - 1U) && (width >> used) >= LEAST &&
         (height >> used) >= LEAST)
    used++;
  memory = memory && make_pyramid(levels, used, fields, between.scale, width, height);
  for (unsigned l = used; memory && l-- > 0;) {
    align_level(&levels[l], &between);
    if (l + 1 < used)
      refine(&levels[l + 1], &levels[l]);
    register_level(&levels[l], smoothness);
  }
  if (memory) {
    float *const work[4] = {levels[0].rest, levels[0].weight, levels[0].gx, levels[0].gy};
    motion->growth = between.grow;
    for (int k = 0; k < 2; k++)
      memcpy(motion->u[k], levels[0].v[k], count * sizeof *motion->u[k]);
    zs_motion_limit(motion, work);
    for (size_t i = 0; i < count; i++)
      for (int k = 0; k < 2; k++)
        motion->u[k][i] += levels[0].start[k][i];
    zs_motion_find_gate(motion, from, to, work);
  }
  for (unsigned l = 0; l < LEVELS; l++)
    free_level(&levels[l]);
  return memory;
}

void zs_motion_clear(zs_motion *motion)
{
  free(motion->u[0]);
  free(motion->u[1]);
  free(motion->gate);
  *motion = (zs_motion){0};
}
