/* The polygon's distance against brute force over all edges. */
#define _POSIX_C_SOURCE 200809L /* setenv */

#include "../random.h"

#include "field/compiler.h"
#include "field/program.h"
#include "samples/polygon.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static double brute_distance(const double *v, size_t count, double x, double y)
{
  double best = INFINITY;
  bool inside = false;
  for (size_t i = 0, j = count - 1; i < count; j = i++) {
    const double ax = v[2 * j], ay = v[2 * j + 1], bx = v[2 * i], by = v[2 * i + 1];
    const double ex = bx - ax, ey = by - ay, l2 = ex * ex + ey * ey;
    double t = l2 > 0 ? ((x - ax) * ex + (y - ay) * ey) / l2 : 0;
    t = fmin(fmax(t, 0), 1);
    best = fmin(best, hypot(x - ax - t * ex, y - ay - t * ey));
    if ((ay > y) != (by > y) && x < ax + (y - ay) * ex / ey)
      inside = !inside;
  }
  return inside ? best : -best;
}

/* ---- Polygons ---------------------------------------------------------------------- */

/* Star-shaped about the origin, with spikes. */
static void make_star(double *v, size_t count, uint64_t *state)
{
  for (size_t i = 0; i < count; i++) {
    const double angle = 6.283185307179586 * (double)i / (double)count;
    const double r = random_between(state, 0.4, 1);
    v[2 * i] = r * cos(angle);
    v[2 * i + 1] = r * sin(angle);
  }
}

/* Corners anywhere: crosses itself. */
static void make_tangle(double *v, size_t count, uint64_t *state)
{
  for (size_t i = 0; i < 2 * count; i++)
    v[i] = random_between(state, -1, 1);
}

/* Corners on a coarse lattice: repeated points, edges on lines through others'
 * corners, edges that lie on each other. */
static void make_lattice(double *v, size_t count, uint64_t *state)
{
  for (size_t i = 0; i < 2 * count; i++)
    v[i] = 0.25 * (double)random_below(state, 9) - 1;
  v[2] = v[0]; /* at least one repeated point ... */
  v[3] = v[1];
  v[4] = v[0] + 0.5; /* ... and one edge */
}

/* A comb with long thin teeth: most edges are far longer than their distance. */
static void make_comb(double *v, size_t count, uint64_t *state)
{
  (void)state;
  for (size_t i = 0; i < count; i++) {
    v[2 * i] = -1 + 2 * (double)i / (double)(count - 1);
    v[2 * i + 1] = i == 0 || i == count - 1 ? -1 : i % 2 ? 1 : -0.9;
  }
}

typedef void make_polygon(double *v, size_t count, uint64_t *state);

static const struct {
  make_polygon *make;
  size_t count;
} POLYGONS[] = {{make_star, 3},     {make_star, 17},   {make_star, 400}, {make_star, 1500},
                {make_tangle, 5},   {make_tangle, 60}, {make_lattice, 8}, {make_lattice, 60},
                {make_comb, 300}};
enum { POLYGON_COUNT = sizeof POLYGONS / sizeof POLYGONS[0], MOST_CORNERS = 1500 };

static void for_every_polygon(void (*test)(const double *v, size_t count, zs_arena *arena,
                                           uint64_t *state))
{
  uint64_t state = 3;
  double *v = malloc(2 * MOST_CORNERS * sizeof *v);
  assert_non_null(v);
  for (int repeat = 0; repeat < 2; repeat++)
    for (int i = 0; i < POLYGON_COUNT; i++) {
      zs_arena arena = {0};
      POLYGONS[i].make(v, POLYGONS[i].count, &state);
      test(v, POLYGONS[i].count, &arena, &state);
      zs_arena_free(&arena);
    }
  free(v);
}

/* Points of all kinds: anywhere, far away, beside corners, on the lattice. */
static void random_point(const double *v, size_t count, double p[2], uint64_t *state)
{
  const size_t corner = random_below(state, (unsigned)count);
  switch (random_below(state, 5)) {
  case 0:
    p[0] = random_between(state, -30, 30);
    p[1] = random_between(state, -30, 30);
    break;
  case 1:
    p[0] = v[2 * corner] + random_between(state, -0.01, 0.01);
    p[1] = v[2 * corner + 1] + random_between(state, -0.01, 0.01);
    break;
  case 2:
    p[0] = 0.125 * (double)random_below(state, 25) - 1.5;
    p[1] = 0.125 * (double)random_below(state, 25) - 1.5;
    break;
  default:
    p[0] = random_between(state, -1.3, 1.3);
    p[1] = random_between(state, -1.3, 1.3);
  }
}

static void check_against_brute(const zs_polygon *polygon, const double *v, size_t count,
                                const double p[2])
{
  const double d = zs_polygon_distance(polygon, p[0], p[1], NULL);
  const double expected = brute_distance(v, count, p[0], p[1]);
  /* On an edge the sign is free. */
  const double wrong = fabs(expected) < 1e-14 ? fabs(d) - fabs(expected) : d - expected;
  if (!(fabs(wrong) <= 1e-12 * (1 + fabs(expected))))
    fail_msg("%zu corners, at %.17g %.17g: %.15g, brute force %.15g", count, p[0], p[1], d,
             expected);
}

static void check_points(const double *v, size_t count, zs_arena *arena, uint64_t *state)
{
  const zs_polygon *polygon = zs_polygon_new(arena, v, count);
  assert_non_null(polygon);
  for (int i = 0; i < 2000; i++) {
    double p[2];
    random_point(v, count, p, state);
    check_against_brute(polygon, v, count, p);
  }
}

static void test_points(void **unused)
{
  (void)unused;
  for_every_polygon(check_points);
}

static void test_special_points(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  static const double v[] = {0, 0, 1, 0, 1, 1, 0, 1};
  const zs_polygon *polygon = zs_polygon_new(&arena, v, 4);
  assert_true(isnan(zs_polygon_distance(polygon, NAN, 0, NULL)));
  assert_true(zs_polygon_distance(polygon, INFINITY, 0, NULL) == -INFINITY);
  assert_true(zs_polygon_distance(polygon, 0, -INFINITY, NULL) == -INFINITY);
  static const double point[] = {1, 2, 1, 2, 1, 2};
  assert_null(zs_polygon_new(&arena, point, 3));
  assert_null(zs_polygon_new(&arena, point, 0));
  zs_arena_free(&arena);
}

/* Either way round, and wherever it starts. */
static void check_order(const double *v, size_t count, zs_arena *arena, uint64_t *state)
{
  double *w = malloc(2 * count * sizeof *w);
  assert_non_null(w);
  for (size_t i = 0; i < count; i++) {
    w[2 * i] = v[2 * ((count - i + 7) % count)];
    w[2 * i + 1] = v[2 * ((count - i + 7) % count) + 1];
  }
  const zs_polygon *polygon = zs_polygon_new(arena, w, count);
  for (int i = 0; i < 200; i++) {
    double p[2];
    random_point(v, count, p, state);
    check_against_brute(polygon, v, count, p);
  }
  free(w);
}

static void test_order(void **unused)
{
  (void)unused;
  for_every_polygon(check_order);
}

/* What is restricted to a box is the same inside it, and restricting again. */
static void check_restriction(const double *v, size_t count, zs_arena *arena, uint64_t *state)
{
  const zs_polygon *polygon = zs_polygon_new(arena, v, count);
  bool smaller = false;
  for (int i = 0; i < 40; i++) {
    const void *part = polygon;
    float lo[2], hi[2];
    for (int k = 0; k < 2; k++) {
      lo[k] = (float)random_between(state, -1.2, 1);
      hi[k] = lo[k] + (float)random_between(state, 0.01, 0.5);
    }
    for (int level = 0; level < 4; level++) {
      part = zs_polygon_operation.restricted(part, lo, hi, arena);
      for (int j = 0; j < 50; j++) {
        const double p[2] = {random_between(state, lo[0], hi[0]),
                             random_between(state, lo[1], hi[1])};
        check_against_brute(part, v, count, p);
      }
      for (int k = 0; k < 2; k++)
        hi[k] = lo[k] + 0.4f * (hi[k] - lo[k]);
    }
    smaller |= ((const zs_polygon *)part)->edge_count < polygon->edge_count / 4;
  }
  assert_true(smaller || count < 20);
}

static void test_restriction(void **unused)
{
  (void)unused;
  for_every_polygon(check_restriction);
}

/* ---- The operation ------------------------------------------------------------------- */

static zs_eval *evaluator(const double *v, size_t count)
{
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  const zs_polygon *polygon = zs_polygon_new(zs_compiler_arena(c), v, count);
  zs_coordinates at = zs_coordinates_root();
  zs_value result = zs_emit_operation(c, &zs_polygon_operation, polygon,
                                      zs_emit_coordinate(c, &at, 0), zs_emit_coordinate(c, &at, 1),
                                      0);
  zs_field *field = zs_compiler_finish(c, result, 1);
  assert_non_null(field);
  zs_eval *eval = zs_eval_new(field, NULL);
  assert_non_null(eval);
  zs_field_unref(field);
  return eval;
}

enum { POINTS = 512 };

/* Blocks over small and large parts of the plane, and with one point far away. */
static void check_blocks(const double *v, size_t count, zs_arena *arena, uint64_t *state)
{
  (void)arena;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  static float x[POINTS], y[POINTS], z[POINTS], f[POINTS], g[4][POINTS];
  for (int i = 0; i < 9; i++) {
    setenv("ZEROSET_ISA", isas[i % 3], 1);
    zs_eval *eval = evaluator(v, count);
    const double size = i < 3 ? 0.02 : i < 6 ? 0.3 : 2.5;
    const double cx = random_between(state, -1, 1), cy = random_between(state, -1, 1);
    for (int j = 0; j < POINTS; j++) {
      x[j] = (float)(cx + random_between(state, -size, size));
      y[j] = (float)(cy + random_between(state, -size, size));
    }
    if (i == 7)
      x[5] = 1e6f;
    if (i == 8)
      y[5] = NAN;
    zs_eval_values(eval, NULL, POINTS, x, y, z, f);
    zs_eval_gradients(eval, NULL, POINTS, x, y, z, g[0], g[1], g[2], g[3]);
    for (int j = 0; j < POINTS; j++) {
      const double expected = brute_distance(v, count, x[j], y[j]);
      if (isnan(y[j])) {
        assert_true(isnan(f[j]) && isnan(g[0][j]));
        continue;
      }
      const double tolerance = 2e-6 * (1 + fabs(expected));
      if (!(fabs(f[j] - expected) <= tolerance) || !(fabs(g[0][j] - expected) <= tolerance))
        fail_msg("%zu corners, at %g %g: %g and %g, brute force %g (%s)", count, x[j], y[j], f[j],
                 g[0][j], expected, zs_isa());
      /* A unit vector that leads along f; kinks show as differences that fall short. */
      const double slope = hypot(g[1][j], g[2][j]), h = 1e-4;
      assert_true(fabs(slope - 1) < 1e-4 && g[3][j] == 0);
      const double ahead = brute_distance(v, count, x[j] + h * g[1][j], y[j] + h * g[2][j]);
      const double behind = brute_distance(v, count, x[j] - h * g[1][j], y[j] - h * g[2][j]);
      const double d = fmax(fabs(ahead - expected), fabs(expected - behind));
      assert_true(d > 0.9 * h || fabs(expected) < h);
    }
    zs_eval_free(eval);
  }
  unsetenv("ZEROSET_ISA");
}

static void test_blocks(void **unused)
{
  (void)unused;
  for_every_polygon(check_blocks);
}

/* On the boundary itself the gradient is the inner normal. */
static void test_normals_on_edges(void **unused)
{
  (void)unused;
  static const double v[] = {0, 0, 2, 0, 2, 2, 0, 2};
  zs_eval *eval = evaluator(v, 4);
  static const float x[] = {1, 2, 0.5f, 0}, y[] = {0, 1, 2, 0.25f}, z[4] = {0};
  static const float nx[] = {0, -1, 0, 1}, ny[] = {1, 0, -1, 0};
  float f[4], gx[4], gy[4], gz[4];
  zs_eval_gradients(eval, NULL, 4, x, y, z, f, gx, gy, gz);
  for (int i = 0; i < 4; i++) {
    assert_true(f[i] == 0);
    assert_true(gx[i] == nx[i] && gy[i] == ny[i]);
  }
  zs_eval_free(eval);
}

static void check_bounds(const double *v, size_t count, zs_arena *arena, uint64_t *state)
{
  (void)arena;
  zs_eval *eval = evaluator(v, count);
  for (int i = 0; i < 50; i++) {
    double lo[1][3] = {{0, 0, 0}}, hi[1][3] = {{0, 0, 0}};
    for (int k = 0; k < 2; k++) {
      lo[0][k] = random_between(state, -2, 2);
      hi[0][k] = lo[0][k] + exp(random_between(state, -5, 1));
    }
    float f_lo, f_hi;
    zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
    for (int j = 0; j < 20; j++) {
      const double x = random_between(state, lo[0][0], hi[0][0]);
      const double y = random_between(state, lo[0][1], hi[0][1]);
      const double f = brute_distance(v, count, x, y);
      assert_true(f >= f_lo && f <= f_hi);
    }
    /* No wider than the box allows. */
    assert_true(f_hi - f_lo <= 1.01 * hypot(hi[0][0] - lo[0][0], hi[0][1] - lo[0][1]) + 1e-4);
  }
  zs_eval_free(eval);
}

static void test_bounds(void **unused)
{
  (void)unused;
  for_every_polygon(check_bounds);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_points),      cmocka_unit_test(test_special_points),
    cmocka_unit_test(test_order),       cmocka_unit_test(test_restriction),
    cmocka_unit_test(test_blocks),      cmocka_unit_test(test_normals_on_edges),
    cmocka_unit_test(test_bounds),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
