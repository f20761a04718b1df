/* Joined slices: signs of given pixels, solids that are known, empty slices, islands. */
#include "../random.h"

#include "stack/join.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 36 };

typedef double solid(double x, double y, double z);

/* A slice of a solid, in pixels of two values or soft ones. */
static void add_slice(zs_slices *s, solid *f, double z, bool soft)
{
  static float pixels[SIDE * SIDE];
  for (int i = 0; i < SIDE * SIDE; i++) {
    const double d = f(i % SIDE, i / SIDE, z);
    pixels[i] = soft ? (float)fmin(fmax(0.5 + d / 2, 0), 1) : d >= 0;
  }
  const zs_picture picture = {SIDE, SIDE, pixels, 0.5F};
  assert_true(zs_slices_add(s, &picture, z));
}

static zs_slices slices_of(solid *f, const double *heights, size_t count, bool soft)
{
  zs_slices s = {0};
  for (size_t i = 0; i < count; i++)
    add_slice(&s, f, heights[i], soft);
  return s;
}

static zs_joined join(const zs_slices *s, zs_join_method method)
{
  zs_joined joined;
  assert_int_equal(zs_slices_join(&joined, s, method, NULL), ZS_JOIN_DONE);
  return joined;
}

/* f at a pixel and a height. */
static double value_of(const zs_joined *j, const zs_slices *s, double x, double y, double z)
{
  const double at[3] = {x + (double)s->margin - (double)j->first[0],
                        y + (double)s->margin - (double)j->first[1], z - s->slices[0].height};
  return zs_raster_value(j->raster, at, NULL);
}

static void check_signs(const zs_joined *j, const zs_slices *s)
{
  for (size_t i = 0; i < s->count; i++)
    for (size_t p = 0; p < SIDE * SIDE; p++) {
      const size_t x = p % SIDE, y = p / SIDE;
      const size_t pixel = (y + s->margin) * s->width + x + s->margin;
      const double f = value_of(j, s, (double)x, (double)y, s->slices[i].height);
      assert_true((f >= 0) == zs_slice_inside(&s->slices[i], pixel));
    }
}

/* ---- Solids ------------------------------------------------------------------------------ */

static double ball(double x, double y, double z)
{
  return 15 - hypot(hypot(x - 18, y - 17), z);
}

/* Two legs that meet. */
static double legs(double x, double y, double z)
{
  const double away = z < 0 ? -z / 2 : 0;
  return 7 - fmin(hypot(x - 18 - away, y - 17), hypot(x - 18 + away, y - 17));
}

static double noise(double x, double y, double z)
{
  return sin(0.5 * x + z) + sin(0.02 * y * y - z) + sin(0.02 * x * z) - 0.9;
}

static double dot(double x, double y, double z)
{
  return fabs(z) < 1 && x == 9 && y == 30 ? 1 : -1;
}

static const double EVEN[] = {-12, -8, -4, 0, 4, 8, 12}, UNEVEN[] = {-14, -13, -6, -5.5, 0, 9, 13};
static const double WIDE[] = {-13, 0, 13}, TWO[] = {-1, 6};

static const struct {
  const double *heights;
  size_t count;
} LEVELS[] = {{EVEN, 7}, {UNEVEN, 7}, {WIDE, 3}, {TWO, 2}};

static void test_signs(void **unused)
{
  (void)unused;
  solid *const solids[] = {ball, legs, noise, dot};
  for (int f = 0; f < 4; f++)
    for (int l = 0; l < 4; l++)
      for (int method = ZS_JOIN_AUTO; method <= ZS_JOIN_VARIATIONAL; method++) {
        zs_slices s = slices_of(solids[f], LEVELS[l].heights, LEVELS[l].count, l % 2);
        bool any = false;
        for (size_t i = 0; i < s.count; i++)
          any = any || s.slices[i].distance;
        if (any) {
          zs_joined j = join(&s, (zs_join_method)method);
          check_signs(&j, &s);
          zs_joined_clear(&j);
        }
        zs_slices_clear(&s);
      }
}

/* Between slices the surface of a ball is where it is to a part of a pixel, which straight
 * lines miss by far. */
static void test_ball(void **unused)
{
  (void)unused;
  double worst[2] = {0, 0};
  for (int method = 0; method < 2; method++) {
    zs_slices s = slices_of(ball, EVEN, 7, true);
    zs_joined j = join(&s, method ? ZS_JOIN_VARIATIONAL : ZS_JOIN_LINEAR);
    uint64_t state = 4;
    for (int i = 0; i < 3000; i++) {
      const double z = random_between(&state, -9, 9), angle = random_between(&state, 0, 6.28);
      const double r = sqrt(15 * 15 - z * z);
      const double f = value_of(&j, &s, 18 + r * cos(angle), 17 + r * sin(angle), z);
      worst[method] = fmax(worst[method], fabs(f));
    }
    zs_joined_clear(&j);
    zs_slices_clear(&s);
  }
  if (!(worst[1] < 0.12 && worst[0] > 2 * worst[1]))
    fail_msg("off by %g, in straight lines by %g", worst[1], worst[0]);
}

/* The slope along the stack hardly changes across a slice. */
static void test_is_smooth(void **unused)
{
  (void)unused;
  static const zs_join_method methods[] = {ZS_JOIN_LINEAR, ZS_JOIN_VARIATIONAL, ZS_JOIN_EXTENDED,
                                           ZS_JOIN_CUBIC};
  double jump[4] = {0};
  for (int method = 0; method < 4; method++) {
    zs_slices s = slices_of(legs, EVEN, 7, true);
    zs_joined j = join(&s, methods[method]);
    for (double angle = 0; angle < 6.28; angle += 0.1) {
      const double x = 18 + 7 * cos(angle), y = 17 + 7 * sin(angle), h = 1e-3;
      double f[3];
      for (int k = 0; k < 3; k++)
        f[k] = value_of(&j, &s, x, y, -4 + (k - 1) * h);
      jump[method] = fmax(jump[method], fabs(f[2] - 2 * f[1] + f[0]) / h);
    }
    zs_joined_clear(&j);
    zs_slices_clear(&s);
  }
  for (int method = 1; method < 4; method++)
    if (!(jump[method] < 0.01 && jump[method] < jump[0] / 4))
      fail_msg("slopes jump by %g, in straight lines by %g", jump[method], jump[0]);
}

/* A solid ends between its last slice and an empty one, which stays empty. */
static void test_empty_slices(void **unused)
{
  (void)unused;
  static const double heights[] = {-24, -16, -8, 0, 8, 16, 24};
  zs_slices s = slices_of(ball, heights, 7, false);
  assert_null(s.slices[0].distance);
  zs_joined j = join(&s, ZS_JOIN_VARIATIONAL);
  check_signs(&j, &s);
  assert_true(value_of(&j, &s, 18, 17, 8) >= 0);
  assert_true(value_of(&j, &s, 18, 17, 16) < 0);
  zs_joined_clear(&j);
  zs_slices_clear(&s);
}

/* Discs that have nothing in common become each other: no layer is empty, none is much
 * smaller or larger. */
static double mover(double x, double y, double z)
{
  return 5 - hypot(x - 9 - 2 * z, y - 12 - z);
}

static void test_apart(void **unused)
{
  (void)unused;
  static const double heights[] = {0, 9, 10};
  for (size_t count = 2; count <= 3; count++)
    for (int method = ZS_JOIN_AUTO; method <= ZS_JOIN_EXTENDED; method += ZS_JOIN_EXTENDED) {
      zs_slices s = slices_of(mover, heights, count, true);
      zs_joined j = join(&s, (zs_join_method)method);
      for (double z = 0; z <= 9; z += 0.5) {
        int inside = 0;
        for (int i = 0; i < SIDE * SIDE; i++)
          inside += value_of(&j, &s, i % SIDE, i / SIDE, z) >= 0;
        if (!(fabs(inside / (3.14159 * 25) - 1) < 0.2))
          fail_msg("%zu slices, at %g: %d pixels", count, z, inside);
        assert_true(value_of(&j, &s, 9 + 2 * z, 12 + z, z) > 3);
      }
      zs_joined_clear(&j);
      zs_slices_clear(&s);
    }
}

/* What the ways tell of is on the outlines of both slices, and goes where the disc goes. */
static void test_ways(void **unused)
{
  (void)unused;
  static const double heights[] = {0, 9};
  zs_slices s = slices_of(mover, heights, 2, true);
  zs_joined j = join(&s, ZS_JOIN_AUTO);
  assert_in_range(j.way_count, 20, 32);
  for (size_t i = 0; i < j.way_count; i++) {
    const zs_join_way *way = &j.ways[i];
    double at[2][2];
    for (int k = 0; k < 2; k++) {
      at[0][k] = (double)way->from[k] + (double)j.first[k] - (double)s.margin;
      at[1][k] = (double)way->to[k] + (double)j.first[k] - (double)s.margin;
    }
    assert_true(way->from[2] == 0 && way->to[2] == 9);
    assert_true(fabs(mover(at[0][0], at[0][1], 0)) < 0.3);
    assert_true(fabs(mover(at[1][0], at[1][1], 9)) < 0.7);
    assert_true(hypot(at[1][0] - at[0][0] - 18, at[1][1] - at[0][1] - 9) < 2);
  }
  zs_joined_clear(&j);
  zs_slices_clear(&s);
  /* Where nothing moves there are none. */
  s = slices_of(ball, (const double[]){-4, 0, 4}, 3, true);
  j = join(&s, ZS_JOIN_AUTO);
  assert_int_equal(j.way_count, 0);
  zs_joined_clear(&j);
  zs_slices_clear(&s);
}

/* A thin wall that moves by more than its thickness from slice to slice stays whole. */
static double wall(double x, double y, double z)
{
  return 1.2 - fabs(hypot(x - 18, y - 18) - 6 - 0.4 * z);
}

static void test_thin_walls(void **unused)
{
  (void)unused;
  static const double heights[] = {0, 8, 16};
  zs_slices s = slices_of(wall, heights, 3, true);
  zs_joined j = join(&s, ZS_JOIN_AUTO);
  for (double z = 0; z <= 16; z += 1)
    for (double angle = 0; angle < 6.28; angle += 0.2) {
      const double r = 6 + 0.4 * z;
      assert_true(value_of(&j, &s, 18 + r * cos(angle), 18 + r * sin(angle), z) > 0.2);
      assert_true(value_of(&j, &s, 18 + (r - 3) * cos(angle), 18 + (r - 3) * sin(angle), z) < 0);
    }
  zs_joined_clear(&j);
  zs_slices_clear(&s);
}

/* From below: parts of what is joined that touch no slice would show as inside where the
 * slices beside them know nothing of it. */
static void test_no_islands(void **unused)
{
  (void)unused;
  zs_slices s = slices_of(noise, WIDE, 3, false);
  zs_joined j = join(&s, ZS_JOIN_VARIATIONAL);
  const uint32_t *n = j.raster->count;
  const size_t count = (size_t)n[0] * n[1] * n[2];
  bool *reached = calloc(count, sizeof *reached);
  size_t *stack = malloc(count * sizeof *stack), used = 0;
  assert_true(reached && stack);
  for (size_t i = 0; i < count; i++) {
    const float height = j.raster->heights[i / n[0] / n[1]];
    const bool level = height == 0 || height == 13 || height == 26;
    if (level && *zs_raster_sample(j.raster, i % n[0], i / n[0] % n[1], i / n[0] / n[1]) >= 0) {
      reached[i] = true;
      stack[used++] = i;
    }
  }
  while (used) {
    const size_t i = stack[--used];
    for (int d = 0; d < 27; d++) {
      const long x = (long)(i % n[0]) + d % 3 - 1, y = (long)(i / n[0] % n[1]) + d / 3 % 3 - 1,
                 z = (long)(i / n[0] / n[1]) + d / 9 - 1;
      if (x < 0 || y < 0 || z < 0 || x >= (long)n[0] || y >= (long)n[1] || z >= (long)n[2])
        continue;
      const size_t k = ((size_t)z * n[1] + (size_t)y) * n[0] + (size_t)x;
      if (!reached[k] && *zs_raster_sample(j.raster, (size_t)x, (size_t)y, (size_t)z) >= 0) {
        reached[k] = true;
        stack[used++] = k;
      }
    }
  }
  for (size_t i = 0; i < count; i++)
    assert_true(reached[i] || *zs_raster_sample(j.raster, i % n[0], i / n[0] % n[1],
                                                i / n[0] / n[1]) < 0);
  free(reached);
  free(stack);
  zs_joined_clear(&j);
  zs_slices_clear(&s);
}

/* More threads give the same samples. */
static void test_threads(void **unused)
{
  (void)unused;
  zs_slices s = slices_of(legs, UNEVEN, 7, false);
  zs_joined j[2];
  for (int k = 0; k < 2; k++) {
    zs_control control;
    zs_control_init(&control);
    control.threads = k ? 3 : 1;
    assert_int_equal(zs_slices_join(&j[k], &s, ZS_JOIN_AUTO, &control), ZS_JOIN_DONE);
  }
  for (size_t z = 0; z < j[0].raster->count[2]; z++)
    for (size_t y = 0; y < j[0].raster->count[1]; y++)
      assert_memory_equal(zs_raster_sample(j[0].raster, 0, y, z),
                          zs_raster_sample(j[1].raster, 0, y, z),
                          j[0].raster->count[0] * sizeof(float));
  for (int k = 0; k < 2; k++)
    zs_joined_clear(&j[k]);
  zs_slices_clear(&s);
}

/* A wall that leans: its outline climbs the stairs of pixels, one in seven. */
static double leaning(double x, double y, double z)
{
  (void)z;
  return (18.2 + (x - 18) / 7 - y) / hypot(1, 1.0 / 7);
}

/* Pixels of two values are stairs, and these do not show; soft ones are where they say. */
static void test_stairs(void **unused)
{
  (void)unused;
  static const double heights[] = {0, 8, 16, 24};
  for (int soft = 0; soft < 2; soft++) {
    zs_slices s = slices_of(leaning, heights, 4, soft);
    assert_true(s.crossings > 4 * SIDE);
    /* Two sides of the picture are black beside white even where it is soft. */
    assert_true(soft ? s.stairs < s.crossings * 3 / 5 : s.stairs > s.crossings * 9 / 10);
    if (soft) /* what is there in a picture that does not end */
      s.stairs = 0;
    zs_joined j = join(&s, ZS_JOIN_VARIATIONAL);
    for (double z = 8; z <= 16; z += 4)
      for (double x = 10; x < 26; x += 0.5) {
        const double y = 18.2 + (x - 18) / 7; /* on the outline */
        const double away = fabs(value_of(&j, &s, x, y, z));
        assert_true(away < (soft ? 0.05 : 0.25)); /* stairs are half a pixel off */
      }
    zs_joined_clear(&j);
    zs_slices_clear(&s);
  }
}

static bool stop(void *context, const char *stage, double fraction)
{
  (void)context, (void)stage;
  return fraction < 0.4;
}

static void test_cancel(void **unused)
{
  (void)unused;
  zs_slices s = slices_of(ball, EVEN, 7, false);
  zs_control control;
  zs_control_init(&control);
  control.progress = stop;
  zs_joined j;
  assert_int_equal(zs_slices_join(&j, &s, ZS_JOIN_VARIATIONAL, &control), ZS_JOIN_CANCELLED);
  assert_null(j.raster);
  zs_slices_clear(&s);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_signs),        cmocka_unit_test(test_ball),
    cmocka_unit_test(test_is_smooth),    cmocka_unit_test(test_empty_slices),
    cmocka_unit_test(test_no_islands),   cmocka_unit_test(test_threads),
    cmocka_unit_test(test_cancel),       cmocka_unit_test(test_apart), cmocka_unit_test(test_ways),
    cmocka_unit_test(test_thin_walls),   cmocka_unit_test(test_stairs),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
