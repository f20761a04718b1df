/* Rasters: what they pass through, their derivatives, and their bounds. */
#define _POSIX_C_SOURCE 200809L /* setenv */

#include "../random.h"

#include "field/compiler.h"
#include "field/program.h"
#include "samples/raster.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static const uint32_t COUNTS[][3] = {{2, 2, 1}, {9, 5, 1}, {30, 41, 1}, {6, 7, 2}, {8, 9, 7},
                                     {21, 18, 30}};
enum { RASTERS = sizeof COUNTS / sizeof COUNTS[0] };

typedef double sampled(double x, double y, double z);

static double noise(double x, double y, double z)
{
  return sin(12.3 * x + 7 * y * y + 3 * z) * 2 - 0.5;
}

static double plane(double x, double y, double z)
{
  return 0.3 * x - 0.7 * y + 0.2 * z - 1;
}

/* Layers at uneven heights. */
static zs_raster *make(int number, bool linear, sampled *f)
{
  float heights[64];
  const uint32_t *count = COUNTS[number];
  for (uint32_t k = 0; k < count[2]; k++)
    heights[k] = (float)(k + 0.4 * sin(2.5 * k));
  zs_raster *r = zs_raster_new(count, heights);
  assert_non_null(r);
  r->linear = linear;
  for (uint32_t z = 0; z < count[2]; z++)
    for (uint32_t y = 0; y < count[1]; y++)
      for (uint32_t x = 0; x < count[0]; x++)
        *zs_raster_sample(r, x, y, z) = (float)f(x, y, (double)heights[z]);
  assert_true(zs_raster_finish(r));
  return r;
}

static void random_point(const zs_raster *r, double p[3], double beyond, uint64_t *state)
{
  for (int k = 0; k < 2; k++)
    p[k] = random_between(state, -beyond, r->count[k] - 1 + beyond);
  p[2] = random_between(state, (double)r->heights[0] - beyond,
                        (double)r->heights[r->count[2] - 1] + beyond);
}

static void test_passes_through_samples(void **unused)
{
  (void)unused;
  for (int i = 0; i < 2 * RASTERS; i++) {
    zs_raster *r = make(i / 2, i % 2, noise);
    for (uint32_t z = 0; z < r->count[2]; z++)
      for (uint32_t y = 0; y < r->count[1]; y++)
        for (uint32_t x = 0; x < r->count[0]; x++) {
          const double p[3] = {x, y, (double)r->heights[z]};
          const double f = zs_raster_value(r, p, NULL);
          assert_true(f == (double)*zs_raster_sample(r, x, y, z));
        }
    zs_raster_free(r);
  }
}

/* Away from the edges, where rows are continued by a constant, planes are met. */
static void test_reproduces_planes(void **unused)
{
  (void)unused;
  uint64_t state = 3;
  for (int i = 0; i < 2 * RASTERS; i++) {
    zs_raster *r = make(i / 2, i % 2, plane);
    for (int j = 0; j < 200; j++) {
      double p[3];
      random_point(r, p, r->count[0] > 4 ? -1 : 0, &state);
      for (int k = 0; k < 2; k++)
        if (r->count[k] <= 4)
          p[k] = 0;
      p[2] = fmin(fmax(p[2], (double)r->heights[0]), (double)r->heights[r->count[2] - 1]);
      assert_true(fabs(zs_raster_value(r, p, NULL) - plane(p[0], p[1], p[2])) < 1e-5);
    }
    zs_raster_free(r);
  }
}

/* f and its slopes hardly change across the places where one polynomial ends. */
static void test_is_smooth(void **unused)
{
  (void)unused;
  uint64_t state = 4;
  for (int i = 0; i < RASTERS; i++) {
    zs_raster *r = make(i, false, noise);
    for (int j = 0; j < 300; j++) {
      double p[3], below[3], above[3];
      random_point(r, p, 0, &state);
      const int axis = (int)random_below(&state, r->count[2] > 2 ? 3 : 2);
      p[axis] = axis < 2 ? floor(p[axis]) : (double)r->heights[random_below(&state, r->count[2])];
      if (axis < 2 && (p[axis] <= 0 || p[axis] >= r->count[axis] - 1))
        continue;
      if (axis == 2 && (p[2] <= (double)r->heights[0] ||
                        p[2] >= (double)r->heights[r->count[2] - 1]))
        continue;
      p[axis] -= 1e-7;
      const double f = zs_raster_value(r, p, below);
      p[axis] += 2e-7;
      const double g = zs_raster_value(r, p, above);
      assert_true(fabs(f - g) < 1e-5);
      for (int k = 0; k < 3; k++)
        assert_true(fabs(below[k] - above[k]) < 1e-4);
    }
    zs_raster_free(r);
  }
}

static void test_falls_beyond(void **unused)
{
  (void)unused;
  zs_raster *r = make(1, false, noise);
  const double at[3] = {-3, 2, 0}, edge[3] = {0, 2, 0}, corner[3] = {11, 8, 0}, end[3] = {8, 4, 0};
  assert_true(fabs(zs_raster_value(r, at, NULL) - (zs_raster_value(r, edge, NULL) - 3)) < 1e-12);
  assert_true(fabs(zs_raster_value(r, corner, NULL) - (zs_raster_value(r, end, NULL) - 5)) <
              1e-12);
  zs_raster_free(r);
}

/* ---- The operation ------------------------------------------------------------------- */

static zs_eval *evaluator(const zs_raster *r)
{
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  zs_coordinates at = zs_coordinates_root();
  zs_value in[3];
  for (int k = 0; k < 3; k++)
    in[k] = zs_emit_coordinate(c, &at, k);
  zs_field *field = zs_compiler_finish(
    c, zs_emit_operation(c, &zs_raster_operation, r, in[0], in[1], in[2]), 1);
  assert_non_null(field);
  zs_eval *eval = zs_eval_new(field, NULL);
  assert_non_null(eval);
  zs_field_unref(field);
  return eval;
}

enum { POINTS = 300 };

static void test_blocks(void **unused)
{
  (void)unused;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  static float x[POINTS], y[POINTS], z[POINTS], f[POINTS], g[4][POINTS];
  uint64_t state = 5;
  for (int i = 0; i < 3 * RASTERS; i++) {
    setenv("ZEROSET_ISA", isas[i % 3], 1);
    zs_raster *r = make(i / 3, i % 2, noise);
    zs_eval *eval = evaluator(r);
    for (int j = 0; j < POINTS; j++) {
      double p[3];
      random_point(r, p, 2, &state);
      x[j] = (float)p[0];
      y[j] = (float)p[1];
      z[j] = (float)p[2];
    }
    x[7] = NAN;
    zs_eval_values(eval, NULL, POINTS, x, y, z, f);
    zs_eval_gradients(eval, NULL, POINTS, x, y, z, g[0], g[1], g[2], g[3]);
    for (int j = 0; j < POINTS; j++) {
      double p[3] = {(double)x[j], (double)y[j], (double)z[j]}, slope[3];
      if (j == 7) {
        assert_true(isnan(f[j]) && isnan(g[0][j]));
        continue;
      }
      const double expected = zs_raster_value(r, p, slope);
      assert_true(fabs((double)f[j] - expected) < 1e-5);
      assert_true(fabs((double)g[0][j] - expected) < 1e-5);
      for (int k = 0; k < 3; k++) {
        assert_true(fabs((double)g[k + 1][j] - slope[k]) < 1e-4 * (1 + fabs(slope[k])));
        const double h = 1e-5, here = p[k];
        p[k] = here + h;
        const double ahead = zs_raster_value(r, p, NULL);
        p[k] = here - h;
        const double behind = zs_raster_value(r, p, NULL);
        p[k] = here;
        /* Not across the end of a piece of the samples. */
        const double right = (ahead - expected) / h, left = (expected - behind) / h;
        if (fabs(right - left) < 0.01)
          assert_true(fabs((ahead - behind) / (2 * h) - slope[k]) < 0.01 * (1 + fabs(slope[k])));
      }
    }
    zs_eval_free(eval);
    zs_raster_free(r);
  }
  unsetenv("ZEROSET_ISA");
}

static void test_bounds(void **unused)
{
  (void)unused;
  uint64_t state = 6;
  for (int i = 0; i < 2 * RASTERS; i++) {
    zs_raster *r = make(i / 2, i % 2, noise);
    zs_eval *eval = evaluator(r);
    for (int b = 0; b < 60; b++) {
      double lo[1][3], hi[1][3];
      random_point(r, lo[0], 4, &state);
      for (int k = 0; k < 3; k++)
        hi[0][k] = lo[0][k] + exp(random_between(&state, -3, 3));
      float f_lo, f_hi;
      zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
      for (int j = 0; j < 40; j++) {
        double p[3];
        for (int k = 0; k < 3; k++)
          p[k] = random_between(&state, lo[0][k], hi[0][k]);
        const double f = zs_raster_value(r, p, NULL);
        assert_true(f >= (double)f_lo && f <= (double)f_hi);
      }
    }
    zs_eval_free(eval);
    zs_raster_free(r);
  }
}

/* A small box near a plane tells on which side it lies. */
static void test_bounds_are_narrow(void **unused)
{
  (void)unused;
  zs_raster *r = make(2, false, plane);
  const double lo[3] = {10, 10, 0}, hi[3] = {11, 11, 0};
  float result[2];
  zs_raster_bounds(r, lo, hi, result);
  assert_true(result[1] - result[0] < 7);
  zs_raster_free(r);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_passes_through_samples),
    cmocka_unit_test(test_reproduces_planes),
    cmocka_unit_test(test_is_smooth),
    cmocka_unit_test(test_falls_beyond),
    cmocka_unit_test(test_blocks),
    cmocka_unit_test(test_bounds),
    cmocka_unit_test(test_bounds_are_narrow),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
