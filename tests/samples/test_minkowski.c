/* Minkowski sums of polygons: against what sums are, and closed forms. */
#include "../random.h"

#include "samples/minkowski.h"
#include "samples/polygon.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double PI = 3.14159265358979323846;

/* ---- Shapes ------------------------------------------------------------------------------ */

static void add_ring(zs_fill *fill, const double *points, size_t count)
{
  assert_true(zs_fill_add_rings(fill, points, &count, 1));
}

/* A star-shaped ring about a point, of random radii; convex when `round`. */
static void add_star(zs_fill *fill, uint64_t *state, const double at[2], double size, bool round)
{
  double points[2 * 40];
  const size_t count = 3 + random_below(state, 12);
  for (size_t i = 0; i < count; i++) {
    const double angle = 2 * PI * ((double)i + random_between(state, 0, 0.9)) / (double)count;
    const double r = size * (round ? 1 : random_between(state, 0.3, 1));
    points[2 * i] = at[0] + r * cos(angle);
    points[2 * i + 1] = at[1] + r * sin(angle);
  }
  add_ring(fill, points, count);
}

static void resolve(zs_fill *fill)
{
  assert_int_equal(zs_fill_resolve(fill, true), ZS_FILL_DONE);
}

static double area_of(const zs_fill *fill)
{
  double area = 0;
  for (size_t i = 0; i < fill->count; i++) {
    const double *e = fill->edges[i];
    area += (e[0] * e[3] - e[2] * e[1]) / 2;
  }
  return area;
}

/* How far a shape reaches in a direction. */
static double support(const zs_fill *fill, const double n[2])
{
  double most = -INFINITY;
  for (size_t i = 0; i < fill->count; i++)
    most = fmax(most, fill->edges[i][0] * n[0] + fill->edges[i][1] * n[1]);
  return most;
}

static void scale(zs_fill *fill, double factor)
{
  for (size_t i = 0; i < fill->count; i++)
    for (int k = 0; k < 4; k++)
      fill->edges[i][k] *= factor;
}

/* ---- What a sum is --------------------------------------------------------------------------- */

static bool contains(const zs_fill *fill, const double p[2])
{
  bool inside = false;
  for (size_t i = 0; i < fill->count; i++) {
    const double *e = fill->edges[i];
    if ((e[1] <= p[1]) != (e[3] <= p[1]))
      inside ^= e[0] + (p[1] - e[1]) / (e[3] - e[1]) * (e[2] - e[0]) > p[0];
  }
  return inside;
}

static double side(const double *a, const double *b, const double *c)
{
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static bool cross(const double a[4], const double b[4])
{
  return side(a, a + 2, b) * side(a, a + 2, b + 2) < 0 && side(b, b + 2, a) * side(b, b + 2, a + 2) < 0;
}

/* Whether x is a + b for some points of the shapes: whether the first one meets the second one,
 * mirrored and moved to x. */
static bool is_sum(const zs_fill *a, const zs_fill *b, const double x[2])
{
  zs_fill other = {0};
  bool meet = false;
  assert_true(zs_fill_add(&other, b));
  for (size_t i = 0; i < b->count; i++)
    for (int k = 0; k < 4; k++)
      other.edges[i][k] = x[k % 2] - b->edges[i][k];
  for (size_t i = 0; !meet && i < a->count; i++) {
    meet = contains(&other, a->edges[i]);
    for (size_t j = 0; !meet && j < b->count; j++)
      meet = cross(a->edges[i], other.edges[j]);
  }
  for (size_t j = 0; !meet && j < b->count; j++)
    meet = contains(a, other.edges[j]);
  zs_fill_clear(&other);
  return meet;
}

/* At random points that are not too near to its boundary the sum says what a sum is; and next to
 * its boundary on both sides. */
static void check_sum(const zs_fill *a, const zs_fill *b, uint64_t *state)
{
  zs_fill sum;
  zs_arena arena = {0};
  assert_int_equal(zs_minkowski_sum(a, b, &sum), ZS_FILL_DONE);
  const zs_polygon *polygon = zs_polygon_of_edges(&arena, sum.edges, sum.count);
  assert_non_null(polygon);
  int inside = 0;
  for (int i = 0; i < 400; i++) {
    double x[2] = {random_between(state, -4, 4), random_between(state, -4, 4)};
    if (i % 2) {
      const double *e = sum.edges[random_below(state, sum.count)];
      const double t = random_between(state, 0, 1);
      for (int k = 0; k < 2; k++)
        x[k] = e[k] + t * (e[k + 2] - e[k]) + 1e-6 * random_between(state, -1, 1);
    }
    const double d = zs_polygon_distance(polygon, x[0], x[1], NULL);
    if (fabs(d) < 1e-9)
      continue;
    if ((d > 0) != is_sum(a, b, x))
      fail_msg("%.9g %.9g: %g", x[0], x[1], d);
    inside += d > 0;
  }
  assert_true(inside > 20 && inside < 380);
  zs_fill_clear(&sum);
  zs_arena_free(&arena);
}

static void sums_are_sums(void **unused)
{
  (void)unused;
  static const double middle[2] = {0.1, -0.2}, left[2] = {-0.9, 0.3}, right[2] = {0.9, 0.2};
  uint64_t state = 7;
  for (int t = 0; t < 60; t++) {
    zs_fill a = {0}, b = {0};
    const bool apart = t % 5 == 1, holes = t % 3 == 1;
    add_star(&a, &state, apart ? left : middle, apart ? 0.7 : 1.2, t % 4 == 0);
    if (apart)
      add_star(&a, &state, right, 0.7, false);
    if (holes && !apart) /* a hole, and an island in it */
      add_star(&a, &state, middle, 0.3, false);
    if (t % 6 == 4) {
      const double box[] = {-1, -1, 1, -1, 1, 1, -1, 1}, hole[] = {-0.9, -0.9, -0.9, 0.9, 0.9, 0.9,
                                                                    0.9, -0.9};
      add_ring(&b, box, 4);
      add_ring(&b, hole, 4);
      const double island[] = {-0.3, -0.3, 0.3, -0.3, 0.3, 0.3, -0.3, 0.3};
      add_ring(&b, island, 4);
    } else {
      add_star(&b, &state, middle, t % 2 ? 0.2 : 0.8, t % 4 == 2);
    }
    resolve(&a);
    resolve(&b);
    check_sum(&a, &b, &state);
    check_sum(&b, &a, &state);
    check_sum(&a, &a, &state);
    zs_fill_clear(&a);
    zs_fill_clear(&b);
  }
}

/* A small shape keeps a ring's hole, a large one fills it. */
static void holes_close_when_they_must(void **unused)
{
  (void)unused;
  const double box[] = {-2, -2, 2, -2, 2, 2, -2, 2}, hole[] = {-1, -1, 1, -1, 1, 1, -1, 1};
  for (int large = 0; large < 2; large++) {
    const double s = large ? 1.01 : 0.5, square[] = {-s, -s, s, -s, s, s, -s, s};
    zs_fill ring = {0}, other = {0}, sum;
    add_ring(&ring, box, 4);
    add_ring(&ring, hole, 4);
    add_ring(&other, square, 4);
    resolve(&ring);
    resolve(&other);
    assert_int_equal(zs_minkowski_sum(&ring, &other, &sum), ZS_FILL_DONE);
    const double outer = 4 * (2 + s) * (2 + s), inner = large ? 0 : 4 * (1 - s) * (1 - s);
    assert_true(fabs(area_of(&sum) - (outer - inner)) < 1e-9);
    zs_fill_clear(&ring);
    zs_fill_clear(&other);
    zs_fill_clear(&sum);
  }
}

/* Of convex shapes the sum reaches as far as both together, has no more edges than both, and an
 * area that is a quadratic in the weights, with the mixed area V = sum of h_A(n) l / 2 over the
 * edges of B, of length l and normal n. */
static void convex_sums_are_known(void **unused)
{
  (void)unused;
  static const double at[2] = {0.3, 0.1};
  uint64_t state = 19;
  for (int trial = 0; trial < 100; trial++) {
    zs_fill a = {0}, b = {0};
    add_star(&a, &state, at, 1, true);
    add_star(&b, &state, at, 0.7, true);
    resolve(&a);
    resolve(&b);
    double mixed = 0;
    for (size_t i = 0; i < b.count; i++) {
      const double *e = b.edges[i], n[2] = {e[3] - e[1], e[0] - e[2]};
      mixed += support(&a, n) / 2;
    }
    for (int step = 1; step < 8; step++) {
      const double t = step / 8.0, areas[2] = {area_of(&a), area_of(&b)};
      zs_fill p = {0}, q = {0}, sum;
      assert_true(zs_fill_add(&p, &a) && zs_fill_add(&q, &b));
      scale(&p, 1 - t);
      scale(&q, t);
      assert_int_equal(zs_minkowski_sum(&p, &q, &sum), ZS_FILL_DONE);
      const double expected =
        (1 - t) * (1 - t) * areas[0] + 2 * t * (1 - t) * mixed + t * t * areas[1];
      assert_true(fabs(area_of(&sum) - expected) < 1e-9);
      assert_true(sum.count <= a.count + b.count);
      for (int i = 0; i < 40; i++) {
        const double n[2] = {cos(i * PI / 20), sin(i * PI / 20)};
        assert_true(fabs(support(&sum, n) - (1 - t) * support(&a, n) - t * support(&b, n)) < 1e-9);
      }
      zs_fill_clear(&p);
      zs_fill_clear(&q);
      zs_fill_clear(&sum);
    }
    zs_fill_clear(&a);
    zs_fill_clear(&b);
  }
}

/* ---- Samples ------------------------------------------------------------------------------------ */

/* Parts are found by their deepest points, each once. */
static void parts_are_found(void **unused)
{
  (void)unused;
  enum { N = 16 };
  float f[N * N * N];
  static const int centres[][3] = {{3, 3, 3}, {11, 4, 12}, {8, 12, 8}};
  for (int i = 0; i < N * N * N; i++) {
    const int at[3] = {i % N, i / N % N, i / N / N};
    f[i] = -INFINITY;
    for (int c = 0; c < 3; c++) {
      const double d = hypot(hypot(at[0] - centres[c][0], at[1] - centres[c][1]),
                             at[2] - centres[c][2]);
      f[i] = fmaxf(f[i], 2.5f - (float)d);
    }
  }
  const zs_lattice_samples samples = {.count = {N, N, N}, .f = f};
  size_t count;
  uint32_t(*parts)[3] = zs_lattice_parts(&samples, &count);
  assert_int_equal(count, 3);
  for (int c = 0; c < 3; c++) {
    int found = 0;
    for (size_t i = 0; i < count; i++)
      found += (int)parts[i][0] == centres[c][0] && (int)parts[i][1] == centres[c][1] &&
               (int)parts[i][2] == centres[c][2];
    assert_int_equal(found, 1);
  }
  free(parts);
}

/* Raising is the greatest of moved samples: exact for linear ones. */
static void raising_is_exact_for_linear_samples(void **unused)
{
  (void)unused;
  enum { A = 12, S = 5 };
  float a[A * A * A], sum[S * S * S];
  uint64_t state = 3;
  double points[4][3];
  const double slope[3] = {0.5, -1, 2};
  for (int i = 0; i < A * A * A; i++)
    a[i] = (float)(slope[0] * (i % A - 4) + slope[1] * (i / A % A - 4) + slope[2] * (i / A / A - 4));
  for (int i = 0; i < S * S * S; i++)
    sum[i] = -INFINITY;
  for (int p = 0; p < 4; p++)
    for (int k = 0; k < 3; k++)
      points[p][k] = random_between(&state, -1.9, 3.9);
  const zs_lattice_samples samples = {{-4, -4, -4}, {A, A, A}, a};
  zs_lattice_samples result = {{0, 0, 0}, {S, S, S}, sum};
  const zs_lattice_points list = {points, 4};
  assert_true(zs_minkowski_raise(&samples, &list, &result, NULL, NULL));
  for (int i = 0; i < S * S * S; i++) {
    double expected = -INFINITY;
    for (int p = 0; p < 4; p++)
      expected = fmax(expected, slope[0] * (i % S - points[p][0]) +
                                  slope[1] * (i / S % S - points[p][1]) +
                                  slope[2] * (i / S / S - points[p][2]));
    assert_true(fabs(sum[i] - expected) < 1e-5);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(sums_are_sums),
    cmocka_unit_test(holes_close_when_they_must),
    cmocka_unit_test(convex_sums_are_known),
    cmocka_unit_test(parts_are_found),
    cmocka_unit_test(raising_is_exact_for_linear_samples),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
