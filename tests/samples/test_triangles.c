/* The distance to triangles against brute force over all of them, and sides against solid
 * angles. */
#define _POSIX_C_SOURCE 200809L /* setenv */

#include "../random.h"

#include "field/compiler.h"
#include "samples/triangles.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST_VERTICES = 5000, MOST_TRIANGLES = 10000 };

/* A closed surface. */
static struct {
  double positions[3 * MOST_VERTICES];
  uint32_t triangles[3 * MOST_TRIANGLES];
  size_t vertex_count, triangle_count;
} mesh;

/* ---- Brute force -------------------------------------------------------------------- */

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double segment_distance(const double a[3], const double b[3], const double p[3])
{
  double e[3], d[3], r[3];
  for (int k = 0; k < 3; k++) {
    e[k] = b[k] - a[k];
    d[k] = p[k] - a[k];
  }
  const double t = fmin(fmax(dot(d, e) / dot(e, e), 0), 1);
  for (int k = 0; k < 3; k++)
    r[k] = d[k] - t * e[k];
  return sqrt(dot(r, r));
}

static double triangle_distance(const double *v[3], const double p[3])
{
  double best = INFINITY, n[3], u[3], w[3];
  for (int i = 0; i < 3; i++)
    best = fmin(best, segment_distance(v[i], v[(i + 1) % 3], p));
  for (int k = 0; k < 3; k++) {
    u[k] = v[1][k] - v[0][k];
    w[k] = v[2][k] - v[0][k];
  }
  for (int k = 0; k < 3; k++)
    n[k] = u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3];
  for (int i = 0; i < 3; i++) {
    double e[3], d[3], side = 0;
    for (int k = 0; k < 3; k++) {
      e[k] = v[(i + 1) % 3][k] - v[i][k];
      d[k] = p[k] - v[i][k];
    }
    for (int k = 0; k < 3; k++)
      side += n[k] * (e[(k + 1) % 3] * d[(k + 2) % 3] - e[(k + 2) % 3] * d[(k + 1) % 3]);
    if (side < 0)
      return best;
  }
  double d[3];
  for (int k = 0; k < 3; k++)
    d[k] = p[k] - v[0][k];
  return dot(n, n) > 0 ? fmin(best, fabs(dot(d, n)) / sqrt(dot(n, n))) : best;
}

/* The solid angle of a triangle (van Oosterom and Strackee, 1983). */
static double solid_angle(const double *v[3], const double p[3])
{
  double r[3][3], l[3], cross[3];
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++)
      r[i][k] = v[i][k] - p[k];
    l[i] = sqrt(dot(r[i], r[i]));
  }
  for (int k = 0; k < 3; k++)
    cross[k] = r[1][(k + 1) % 3] * r[2][(k + 2) % 3] - r[1][(k + 2) % 3] * r[2][(k + 1) % 3];
  return 2 * atan2(dot(r[0], cross), l[0] * l[1] * l[2] + dot(r[0], r[1]) * l[2] +
                                       dot(r[1], r[2]) * l[0] + dot(r[2], r[0]) * l[1]);
}

static double brute_distance(const double p[3])
{
  double best = INFINITY, angle = 0;
  for (size_t t = 0; t < mesh.triangle_count; t++) {
    const double *v[3];
    for (int i = 0; i < 3; i++)
      v[i] = mesh.positions + 3 * mesh.triangles[3 * t + (size_t)i];
    best = fmin(best, triangle_distance(v, p));
    angle += solid_angle(v, p);
  }
  return angle > 6.283185307179586 ? best : -best; /* at least once around, of 4 pi each */
}

/* ---- Surfaces ------------------------------------------------------------------------- */

static void add_vertex(double x, double y, double z)
{
  const double p[3] = {x, y, z};
  assert_true(mesh.vertex_count < MOST_VERTICES);
  memcpy(mesh.positions + 3 * mesh.vertex_count++, p, sizeof p);
}

static void add_triangle(size_t a, size_t b, size_t c)
{
  const uint32_t corners[3] = {(uint32_t)a, (uint32_t)b, (uint32_t)c};
  assert_true(mesh.triangle_count < MOST_TRIANGLES);
  memcpy(mesh.triangles + 3 * mesh.triangle_count++, corners, sizeof corners);
}

static void add_cube(double x, double y, double z, double side, bool inward)
{
  static const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                  {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const size_t first = mesh.vertex_count;
  for (int i = 0; i < 8; i++)
    add_vertex(x + side * (i & 1), y + side * (i >> 1 & 1), z + side * (i >> 2));
  for (int f = 0; f < 6; f++)
    for (int h = 0; h < 2; h++) {
      const size_t a = first + (size_t)faces[f][0], b = first + (size_t)faces[f][1 + h],
                   c = first + (size_t)faces[f][2 + h];
      add_triangle(a, inward ? c : b, inward ? b : c);
    }
}

/* On lattice points: rays pass through edges and corners all the time. */
static void make_cubes(uint64_t *state)
{
  (void)state;
  add_cube(-1, -1, -1, 1, false);
  add_cube(-0.5, -0.5, -0.5, 1, false); /* overlaps */
  add_cube(-0.25, -0.25, -0.25, 0.5, true); /* a cavity, where only one of them is around it */
  add_cube(0.5, 0, 0, 0.25, false); /* shares faces' planes */
}

/* A torus of n x m vertices, disturbed by `noise` until it crosses itself. */
static void make_torus(size_t n, size_t m, double noise, uint64_t *state)
{
  const double turn = 6.283185307179586;
  const size_t first = mesh.vertex_count;
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < m; j++) {
      const double u = turn * (double)i / (double)n, v = turn * (double)j / (double)m;
      const double r = 0.9 + 0.4 * cos(v) + random_between(state, -noise, noise);
      add_vertex(r * cos(u), r * sin(u), 0.4 * sin(v) + random_between(state, -noise, noise));
    }
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < m; j++) {
      const size_t a = first + i * m + j, b = first + (i + 1) % n * m + j;
      const size_t c = first + (i + 1) % n * m + (j + 1) % m, d = first + i * m + (j + 1) % m;
      add_triangle(a, b, c);
      add_triangle(a, c, d);
    }
}

static void make_ring(uint64_t *state)
{
  make_torus(24, 12, 0, state);
}

static void make_rough(uint64_t *state)
{
  make_torus(60, 30, 0.02, state);
}

static void make_tangle(uint64_t *state)
{
  make_torus(12, 6, 0.7, state);
}

/* Long thin triangles, and some without an area. */
static void make_needle(uint64_t *state)
{
  (void)state;
  enum { SIDES = 40 };
  for (int i = 0; i < SIDES; i++)
    add_vertex(0.01 * cos(6.283185307179586 * i / SIDES), 0.01 * sin(6.283185307179586 * i / SIDES),
               0);
  add_vertex(0, 0, 2);
  add_vertex(0, 0, -2);
  add_vertex(0.01, 0, 0); /* again: of no area with its twin and any other */
  for (size_t i = 0; i < SIDES; i++) {
    add_triangle(i, (i + 1) % SIDES, SIDES);
    add_triangle((i + 1) % SIDES, i, SIDES + 1);
  }
  add_triangle(0, SIDES + 2, SIDES);
  add_triangle(SIDES + 2, 0, SIDES);
}

static void (*const makers[])(uint64_t *state) = {make_cubes, make_ring, make_rough, make_tangle,
                                                  make_needle};
enum { MAKERS = sizeof makers / sizeof *makers };

static zs_triangles *surface_of(int maker, uint64_t *state)
{
  mesh.vertex_count = mesh.triangle_count = 0;
  makers[maker](state);
  double *positions = malloc(3 * mesh.vertex_count * sizeof *positions);
  assert_non_null(positions);
  memcpy(positions, mesh.positions, 3 * mesh.vertex_count * sizeof *positions);
  zs_triangles *s = zs_triangles_new(positions, mesh.triangles, mesh.triangle_count);
  assert_non_null(s);
  return s;
}

/* Anywhere, on a lattice, and next to the surface. */
static void random_point(double p[3], uint64_t *state)
{
  const unsigned way = random_below(state, 4);
  const size_t vertex = random_below(state, (unsigned)mesh.vertex_count);
  for (size_t k = 0; k < 3; k++) {
    if (way == 0)
      p[k] = random_between(state, -20, 20);
    else if (way == 1)
      p[k] = 0.125 * (double)random_below(state, 25) - 1.5;
    else if (way == 2)
      p[k] = mesh.positions[3 * vertex + k] + random_between(state, -0.02, 0.02);
    else
      p[k] = random_between(state, -1.5, 1.5);
  }
}

static void check(double f, const double p[3], double tolerance)
{
  const double expected = brute_distance(p);
  /* On the surface the sign is free. */
  const double wrong = fabs(expected) < 1e-12 + tolerance ? fabs(f) - fabs(expected) : f - expected;
  if (!(fabs(wrong) <= 1e-12 + tolerance * (1 + fabs(expected))))
    fail_msg("at %.17g %.17g %.17g: %.15g, brute force %.15g", p[0], p[1], p[2], f, expected);
}

/* ---- Tests ------------------------------------------------------------------------------- */

static void test_points(void **unused)
{
  (void)unused;
  uint64_t state = 1;
  for (int m = 0; m < MAKERS; m++) {
    zs_triangles *s = surface_of(m, &state);
    for (int i = 0; i < 600; i++) {
      double p[3];
      random_point(p, &state);
      check(zs_triangles_distance(s, p), p, 0);
    }
    zs_triangles_free(s);
  }
}

static void test_special_points(void **unused)
{
  (void)unused;
  uint64_t state = 1;
  zs_triangles *s = surface_of(0, &state);
  assert_true(isnan(zs_triangles_distance(s, (const double[3]){0, NAN, 0})));
  assert_true(zs_triangles_distance(s, (const double[3]){0, INFINITY, 0}) == -INFINITY);
  zs_triangles_free(s);
  static const uint32_t same[3] = {0, 0, 1};
  assert_null(zs_triangles_new(calloc(6, sizeof(double)), same, 1));
  zs_triangles_free(NULL);
}

/* What is restricted to a box is the same inside it, and restricting again. */
static void test_restriction(void **unused)
{
  (void)unused;
  uint64_t state = 2;
  for (int m = 0; m < MAKERS; m++) {
    zs_triangles *s = surface_of(m, &state);
    bool smaller = false;
    for (int i = 0; i < 20; i++) {
      zs_arena arena = {0};
      const void *part = s;
      float lo[3], hi[3];
      for (int k = 0; k < 3; k++) {
        lo[k] = (float)random_between(&state, -1.2, 1);
        hi[k] = lo[k] + (float)random_between(&state, 0.05, 0.6);
      }
      for (int level = 0; level < 3; level++) {
        part = zs_triangles_operation.restricted(part, lo, hi, &arena);
        for (int j = 0; j < 8; j++) {
          double p[3];
          for (int k = 0; k < 3; k++)
            p[k] = random_between(&state, (double)lo[k], (double)hi[k]);
          check(zs_triangles_distance(part, p), p, 0);
        }
        for (int k = 0; k < 3; k++)
          hi[k] = lo[k] + 0.4f * (hi[k] - lo[k]);
      }
      smaller |= ((const zs_triangles *)part)->count < s->count / 4;
      zs_arena_free(&arena);
    }
    assert_true(smaller || s->count < 1000);
    zs_triangles_free(s);
  }
}

static zs_eval *evaluator(zs_triangles *s)
{
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  assert_true(zs_compiler_keep(c, s, zs_triangles_free));
  const zs_coordinates at = zs_coordinates_root();
  const zs_value f = zs_emit_operation(c, &zs_triangles_operation, s, zs_emit_coordinate(c, &at, 0),
                                       zs_emit_coordinate(c, &at, 1),
                                       zs_emit_coordinate(c, &at, 2));
  zs_field *field = zs_compiler_finish(c, f, 1);
  zs_eval *eval = zs_eval_new(field, NULL);
  assert_non_null(eval);
  zs_field_unref(field);
  return eval;
}

/* Blocks over small and large boxes, with points far away and points that are none. */
static void check_blocks(zs_eval *eval, double size, uint64_t *state)
{
  enum { POINTS = 300 };
  static float x[POINTS], y[POINTS], z[POINTS], f[POINTS], g[4][POINTS];
  double centre[3];
  random_point(centre, state);
  for (int i = 0; i < POINTS; i++) {
    x[i] = (float)(centre[0] + random_between(state, -size, size));
    y[i] = (float)(centre[1] + random_between(state, -size, size));
    z[i] = (float)(centre[2] + random_between(state, -size, size));
  }
  x[7] = 1e5f;
  y[20] = NAN;
  zs_eval_values(eval, NULL, POINTS, x, y, z, f);
  zs_eval_gradients(eval, NULL, POINTS, x, y, z, g[0], g[1], g[2], g[3]);
  for (int i = 0; i < POINTS; i += 3) {
    const double p[3] = {(double)x[i], (double)y[i], (double)z[i]}, h = 1e-4;
    const double n[3] = {(double)g[1][i], (double)g[2][i], (double)g[3][i]};
    check((double)f[i], p, 2e-7);
    check((double)g[0][i], p, 2e-7);
    /* A unit vector along f; kinks show as differences that fall short. */
    assert_true(fabs(dot(n, n) - 1) < 1e-4);
    double ahead[3], behind[3];
    for (int k = 0; k < 3; k++) {
      ahead[k] = p[k] + h * n[k];
      behind[k] = p[k] - h * n[k];
    }
    const double here = brute_distance(p);
    const double d = fmax(fabs(brute_distance(ahead) - here), fabs(here - brute_distance(behind)));
    assert_true(d > 0.9 * h || fabs(here) < h);
  }
  assert_true(isnan(f[20]) && isnan(g[0][20]));
}

static void test_blocks(void **unused)
{
  (void)unused;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  uint64_t state = 3;
  for (int m = 0; m < MAKERS; m++)
    for (int isa = 0; isa < 3; isa++) {
      setenv("ZEROSET_ISA", isas[isa], 1);
      zs_eval *eval = evaluator(surface_of(m, &state));
      check_blocks(eval, isa == 0 ? 0.05 : isa == 1 ? 0.4 : 2, &state);
      zs_eval_free(eval);
    }
  unsetenv("ZEROSET_ISA");
}

static void test_bounds(void **unused)
{
  (void)unused;
  uint64_t state = 4;
  for (int m = 0; m < MAKERS; m++) {
    zs_eval *eval = evaluator(surface_of(m, &state));
    for (int i = 0; i < 40; i++) {
      double lo[1][3], hi[1][3];
      float f_lo, f_hi;
      for (int k = 0; k < 3; k++) {
        lo[0][k] = random_between(&state, -1.5, 1);
        hi[0][k] = lo[0][k] + exp(random_between(&state, -5, 0));
      }
      zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
      for (int j = 0; j < 10; j++) {
        double p[3];
        for (int k = 0; k < 3; k++)
          p[k] = random_between(&state, lo[0][k], hi[0][k]);
        const double f = brute_distance(p);
        assert_true(f >= (double)f_lo && f <= (double)f_hi);
      }
    }
    zs_eval_free(eval);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_points), cmocka_unit_test(test_special_points),
    cmocka_unit_test(test_restriction), cmocka_unit_test(test_blocks),
    cmocka_unit_test(test_bounds)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
