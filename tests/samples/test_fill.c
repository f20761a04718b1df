/* What outlines fill, against windings counted by angles. */
#include "../random.h"

#include "samples/fill.h"
#include "samples/polygon.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { MOST_POINTS = 400, MOST_RINGS = 20 };

static struct {
  double points[2 * MOST_POINTS];
  size_t ends[MOST_RINGS], rings;
} outline;

static void add_point(double x, double y)
{
  size_t n = outline.rings ? outline.ends[outline.rings - 1] : 0;
  outline.points[2 * n] = x;
  outline.points[2 * n + 1] = y;
  outline.ends[outline.rings - 1] = n + 1;
}

static void begin_ring(void)
{
  outline.ends[outline.rings] = outline.rings ? outline.ends[outline.rings - 1] : 0;
  outline.rings++;
}

/* How often the rings wind around a point, by the angles that their edges take up. */
static long winding(double x, double y)
{
  double sum = 0;
  for (size_t r = 0, first = 0; r < outline.rings; first = outline.ends[r++])
    for (size_t i = first; i < outline.ends[r]; i++) {
      const double *a = outline.points + 2 * i;
      const double *b = outline.points + 2 * (i + 1 < outline.ends[r] ? i + 1 : first);
      const double ax = a[0] - x, ay = a[1] - y, bx = b[0] - x, by = b[1] - y;
      sum += atan2(ax * by - ay * bx, ax * bx + ay * by);
    }
  return lround(sum / 6.283185307179586);
}

static bool is_filled(double x, double y, bool even_odd)
{
  const long w = winding(x, y);
  return even_odd ? w % 2 != 0 : w != 0;
}

/* Random points anywhere; on a coarse lattice, where edges lie on each other; and squares
 * that overlap, touch and repeat. */
static void make(int kind, uint64_t *state)
{
  outline.rings = 0;
  const unsigned rings = 1 + random_below(state, 6);
  for (unsigned r = 0; r < rings; r++) {
    begin_ring();
    if (kind < 2) {
      const unsigned points = 3 + random_below(state, 20);
      for (unsigned i = 0; i < points; i++)
        if (kind == 0)
          add_point(random_between(state, -1, 1), random_between(state, -1, 1));
        else
          add_point(0.25 * random_below(state, 8) - 1, 0.25 * random_below(state, 8) - 1);
      continue;
    }
    const double x = 0.25 * random_below(state, 6) - 1, y = 0.25 * random_below(state, 6) - 1;
    const double side = 0.25 * (1 + random_below(state, 3));
    const bool back = random_below(state, 3) == 0;
    add_point(x, y);
    add_point(back ? x : x + side, back ? y + side : y);
    add_point(x + side, y + side);
    add_point(back ? x + side : x, back ? y : y + side);
  }
}

/* Whether some points of a small circle are filled, and some are not. */
static bool changes_around(double x, double y, int points, bool even_odd)
{
  bool inside = false, outside = false;
  for (int i = 0; i < points && !(inside && outside); i++) {
    const double angle = 6.283185307179586 * i / points;
    const bool filled = is_filled(x + 1e-4 * cos(angle), y + 1e-4 * sin(angle), even_odd);
    inside |= filled;
    outside |= !filled;
  }
  return inside && outside;
}

/* The sign is right, f is 0 nowhere but where what is filled ends, and it is there. */
static void check(const zs_fill *fill, bool even_odd, uint64_t *state)
{
  zs_arena arena = {0};
  const zs_polygon *polygon = zs_polygon_of_edges(&arena, fill->edges, fill->count);
  assert_non_null(polygon);
  for (int i = 0; i < 200; i++) {
    const double x = random_between(state, -1.2, 1.2), y = random_between(state, -1.2, 1.2);
    const double f = zs_polygon_distance(polygon, x, y, NULL);
    if (fabs(f) < 1e-6)
      continue;
    if ((f > 0) != is_filled(x, y, even_odd))
      fail_msg("at %.17g %.17g: %g, but winding %ld", x, y, f, winding(x, y));
    /* Nothing changes closer than that ... */
    for (int j = 0; j < 5; j++) {
      const double angle = random_between(state, 0, 7), r = 0.999 * fabs(f);
      assert_true((f > 0) == is_filled(x + r * cos(angle), y + r * sin(angle), even_odd));
    }
    /* ... and something does at the nearest point: of a small circle around it, where an edge
     * or a corner is, some of the points are filled and some are not. */
    const double h = 1e-7;
    const double gx = (zs_polygon_distance(polygon, x + h, y, NULL) - f) / h;
    const double gy = (zs_polygon_distance(polygon, x, y + h, NULL) - f) / h;
    if (fabs(hypot(gx, gy) - 1) > 1e-4)
      continue; /* two points are nearest */
    if (!changes_around(x - f * gx, y - f * gy, 64, even_odd))
      assert_true(changes_around(x - f * gx, y - f * gy, 6400, even_odd)); /* a sharp corner */
  }
  zs_arena_free(&arena);
}

/* The rings are those edges, with the same area. */
static void check_rings(const zs_fill *fill)
{
  double *points, area = 0, expected = 0;
  size_t *ends, rings;
  assert_true(zs_fill_rings(fill, &points, &ends, &rings));
  assert_int_equal(ends[rings - 1], fill->count);
  for (size_t r = 0, first = 0; r < rings; first = ends[r++])
    for (size_t i = first; i < ends[r]; i++) {
      const double *a = points + 2 * i, *b = points + 2 * (i + 1 < ends[r] ? i + 1 : first);
      area += (a[0] * b[1] - a[1] * b[0]) / 2;
    }
  for (size_t i = 0; i < fill->count; i++)
    expected += (fill->edges[i][0] * fill->edges[i][3] - fill->edges[i][1] * fill->edges[i][2]) / 2;
  assert_true(area > 0 && fabs(area - expected) < 1e-9);
  free(points);
  free(ends);
}

static void test_random(void **unused)
{
  (void)unused;
  uint64_t state = 3;
  for (int i = 0; i < 150; i++) {
    const bool even_odd = i % 2;
    zs_fill fill = {0};
    make(i % 3, &state);
    assert_true(zs_fill_add_rings(&fill, outline.points, outline.ends, outline.rings));
    const zs_fill_result result = fill.count ? zs_fill_resolve(&fill, even_odd) : ZS_FILL_EMPTY;
    assert_true(result == ZS_FILL_DONE || result == ZS_FILL_EMPTY);
    if (result == ZS_FILL_DONE) {
      check(&fill, even_odd, &state);
      check_rings(&fill);
    }
    zs_fill_clear(&fill);
  }
}

/* A resolved one stays as it is. */
static void test_twice(void **unused)
{
  (void)unused;
  uint64_t state = 8;
  for (int i = 0; i < 50; i++) {
    zs_fill fill = {0};
    make(0, &state);
    assert_true(zs_fill_add_rings(&fill, outline.points, outline.ends, outline.rings));
    assert_int_equal(zs_fill_resolve(&fill, i % 2), ZS_FILL_DONE);
    const size_t count = fill.count;
    assert_int_equal(zs_fill_resolve(&fill, false), ZS_FILL_DONE);
    assert_int_equal(fill.count, count);
    zs_fill_clear(&fill);
  }
}

/* Lines back and forth enclose nothing. */
static void test_empty(void **unused)
{
  (void)unused;
  static const double points[] = {0, 0, 1, 1, 2, 0, 1, 1};
  static const size_t ends[] = {4};
  for (int even_odd = 0; even_odd < 2; even_odd++) {
    zs_fill fill = {0};
    assert_true(zs_fill_add_rings(&fill, points, ends, 1));
    assert_int_equal(zs_fill_resolve(&fill, even_odd), ZS_FILL_EMPTY);
    zs_fill_clear(&fill);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_random), cmocka_unit_test(test_twice),
                                     cmocka_unit_test(test_empty)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
