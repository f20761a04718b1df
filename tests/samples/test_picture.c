/* Distance transforms, and the distance to outlines in pictures, against brute force. */
#include "../random.h"

#include "samples/picture.h"
#include "samples/transform.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- Transforms --------------------------------------------------------------------- */

enum { MOST_SAMPLES = 400 };

static void check_transform(const size_t count[3], const double spacing[3], unsigned sites,
                            uint64_t *state)
{
  float squares[MOST_SAMPLES];
  uint32_t nearest[MOST_SAMPLES];
  const size_t n = count[0] * count[1] * count[2];
  float start[MOST_SAMPLES];
  for (size_t i = 0; i < n; i++) {
    start[i] = INFINITY;
    nearest[i] = (uint32_t)i;
  }
  for (unsigned s = 0; s < sites; s++) /* some of them raised */
    start[random_below(state, (unsigned)n)] =
      random_below(state, 2) ? 0 : (float)random_between(state, 0, 3);
  memcpy(squares, start, sizeof squares);
  for (int axis = 0; axis < 3; axis++)
    assert_true(zs_transform_pass(squares, nearest, count, axis, spacing[axis]));
  for (size_t i = 0; i < n; i++) {
    double best = INFINITY, named = INFINITY;
    for (size_t j = 0; j < n; j++) {
      const double d[3] = {
        spacing[0] * ((double)(i % count[0]) - (double)(j % count[0])),
        spacing[1] * ((double)(i / count[0] % count[1]) - (double)(j / count[0] % count[1])),
        spacing[2] * ((double)(i / count[0] / count[1]) - (double)(j / count[0] / count[1]))};
      const double here = (double)start[j] + d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      best = fmin(best, here);
      if (j == nearest[i])
        named = here;
    }
    if (sites == 0) {
      assert_true(isinf(squares[i]));
      continue;
    }
    assert_true(fabs((double)squares[i] - best) <= 1e-5 * (1 + best));
    assert_true(fabs(named - best) <= 1e-5 * (1 + best));
  }
}

static void test_transforms(void **unused)
{
  (void)unused;
  static const size_t counts[][3] = {{1, 1, 1}, {20, 1, 1}, {1, 20, 1}, {17, 19, 1}, {7, 6, 8}};
  static const double spacings[][3] = {{1, 1, 1}, {0.5, 2, 3}};
  uint64_t state = 5;
  for (unsigned c = 0; c < sizeof counts / sizeof counts[0]; c++)
    for (unsigned s = 0; s < 2; s++)
      for (unsigned sites = 0; sites < 12; sites += 1 + sites / 2)
        check_transform(counts[c], spacings[s], sites, &state);
}

/* ---- Pictures ----------------------------------------------------------------------- */

enum { SIDE = 24, MARGIN = 3, WHOLE = SIDE + 2 * MARGIN };

static double brightness(const zs_picture *p, int x, int y)
{
  const bool within = x >= 0 && y >= 0 && x < (int)p->width && y < (int)p->height;
  return within ? (double)p->pixels[(size_t)y * p->width + (size_t)x] : 0;
}

static double to_segment(const double a[2], const double b[2], double x, double y)
{
  const double ex = b[0] - a[0], ey = b[1] - a[1], l2 = ex * ex + ey * ey;
  const double t = l2 > 0 ? fmin(fmax(((x - a[0]) * ex + (y - a[1]) * ey) / l2, 0), 1) : 0;
  return hypot(x - a[0] - t * ex, y - a[1] - t * ey);
}

/* Marching squares, by the two triangles beside each side of a cell: the pieces of the
 * outline end on sides where brightness crosses the level, and two that are on
 * neighbouring sides of a corner unlike both its neighbours belong together. */
static double brute_distance(const zs_picture *p, double x, double y)
{
  double best = INFINITY;
  for (int cy = -1; cy < (int)p->height; cy++)
    for (int cx = -1; cx < (int)p->width; cx++) {
      const int dx[] = {0, 1, 1, 0}, dy[] = {0, 0, 1, 1};
      double v[4], at[4][2], mean = 0;
      bool crossed[4];
      int crossings = 0;
      for (int k = 0; k < 4; k++) {
        v[k] = brightness(p, cx + dx[k], cy + dy[k]) - (double)p->level;
        mean += v[k] / 4;
      }
      for (int k = 0; k < 4; k++) {
        const int n = (k + 1) % 4;
        crossed[k] = (v[k] >= 0) != (v[n] >= 0);
        crossings += crossed[k];
        const double t = crossed[k] ? v[k] / (v[k] - v[n]) : 0;
        at[k][0] = cx + dx[k] + t * (dx[n] - dx[k]);
        at[k][1] = cy + dy[k] + t * (dy[n] - dy[k]);
      }
      if (crossings == 2) {
        int first = 0, second = 3;
        while (!crossed[first])
          first++;
        while (!crossed[second])
          second--;
        best = fmin(best, to_segment(at[first], at[second], x, y));
      } else if (crossings == 4) {
        for (int k = 0; k < 4; k++) /* corners unlike the middle are cut off */
          if ((v[k] >= 0) != (mean >= 0))
            best = fmin(best, to_segment(at[(k + 3) % 4], at[k], x, y));
      }
    }
  return best;
}

static void check_picture(const zs_picture *p)
{
  static float d[WHOLE * WHOLE];
  assert_int_equal(zs_picture_distance(p, MARGIN, d), ZS_PICTURE_DONE);
  const size_t width = p->width + 2 * MARGIN, height = p->height + 2 * MARGIN;
  for (size_t y = 0; y < height; y++)
    for (size_t x = 0; x < width; x++) {
      const int px = (int)x - MARGIN, py = (int)y - MARGIN;
      const bool inside = brightness(p, px, py) >= (double)p->level;
      const double f = (double)d[y * width + x], expected = brute_distance(p, px, py);
      assert_true(inside ? f >= 0 : f < 0);
      if (!(fabs(fabs(f) - expected) < (expected < 3 ? 2e-6 : 0.01)))
        fail_msg("%d %d: %g, brute force %g", px, py, fabs(f), expected);
    }
}

static void test_pictures(void **unused)
{
  (void)unused;
  static float pixels[SIDE * SIDE];
  uint64_t state = 11;
  for (int i = 0; i < 40; i++) {
    const double cx = random_between(&state, 0, SIDE), cy = random_between(&state, 0, SIDE);
    const double radius = random_between(&state, 1, 12), soft = random_between(&state, 0.2, 6);
    for (int j = 0; j < SIDE * SIDE; j++) {
      const double r = hypot(j % SIDE - cx, j / SIDE - cy);
      const double grey = 0.5 + (radius - r) / soft;
      pixels[j] = i % 4 == 0   ? (float)random_between(&state, 0, 1) /* noise */
                  : i % 4 == 1 ? (float)(random_below(&state, 2))    /* with many saddles */
                  : i % 4 == 2 ? (float)(r < radius)
                               : (float)fmin(fmax(grey, 0), 1);
    }
    pixels[random_below(&state, SIDE * SIDE)] = 1;
    const zs_picture p = {i % 5 ? SIDE : 1 + random_below(&state, SIDE), SIDE, pixels,
                          i % 3 ? 0.5F : (float)random_between(&state, 0.1, 0.9)};
    float brightest = 0;
    for (size_t j = 0; j < p.width * p.height; j++)
      brightest = fmaxf(brightest, pixels[j]);
    if (brightest >= p.level)
      check_picture(&p);
  }
}

/* A disc drawn with soft edges: the outline is a circle to a small part of a pixel, and
 * the distance that to a circle. */
static void test_sub_pixel(void **unused)
{
  (void)unused;
  static float pixels[SIDE * SIDE], d[WHOLE * WHOLE];
  const double cx = 11.3, cy = 12.1, radius = 7.7;
  for (int j = 0; j < SIDE * SIDE; j++)
    pixels[j] = (float)fmin(fmax(0.5 + (radius - hypot(j % SIDE - cx, j / SIDE - cy)) / 2, 0), 1);
  const zs_picture p = {SIDE, SIDE, pixels, 0.5F};
  assert_int_equal(zs_picture_distance(&p, MARGIN, d), ZS_PICTURE_DONE);
  for (int j = 0; j < WHOLE * WHOLE; j++) {
    const double r = hypot(j % WHOLE - MARGIN - cx, j / WHOLE - MARGIN - cy);
    if (radius - r < 3) /* the chords' error grows towards the middle, where they meet */
      if (!(fabs((double)d[j] - (radius - r)) < 0.05))
        fail_msg("%d: %g instead of %g", j, (double)d[j], radius - r);
  }
}

static void test_special(void **unused)
{
  (void)unused;
  float d[49];
  const float black[1] = {0.2F}, white[1] = {1}, level[1] = {0.5F};
  const zs_picture empty = {1, 1, black, 0.5F}, dot = {1, 1, white, 0.5F},
                   edge = {1, 1, level, 0.5F};
  assert_int_equal(zs_picture_distance(&empty, 1, d), ZS_PICTURE_EMPTY);
  assert_int_equal(zs_picture_distance(&dot, 3, d), ZS_PICTURE_DONE);
  assert_true(fabsf(d[24] - sqrtf(0.125F)) < 1e-6F); /* a diamond */
  assert_true(fabsf(d[21] + 2.5F) < 1e-6F);
  assert_int_equal(zs_picture_distance(&edge, 3, d), ZS_PICTURE_DONE);
  assert_true(d[24] == 0 && fabsf(d[25] + 1) < 1e-6F && fabsf(d[16] + sqrtf(2)) < 1e-6F);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_transforms),
    cmocka_unit_test(test_pictures),
    cmocka_unit_test(test_sub_pixel),
    cmocka_unit_test(test_special),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
