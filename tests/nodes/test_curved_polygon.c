/* <curved-polygon>: signs against counted crossings of outlines. */
#include "scene_text.h"

#include "../random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_EDGES = 60, MOST_POINTS = 512 };
static const double PI = 3.14159265358979323846;

/* Edge i leads from corner i to the next, bulging to the right when that is positive. */
static struct {
  double corners[MOST_EDGES][2], bulges[MOST_EDGES];
  int count;
} outline;

static const double *corner(int i)
{
  return outline.corners[i % outline.count];
}

/* Star-shaped and swirled: with deep pockets. */
static void make_outline(uint64_t *state)
{
  const double swirl = random_below(state, 2) ? random_between(state, -4, 4) : 0;
  const double least = random_between(state, 0.2, 0.9);
  const bool arcs = random_below(state, 4) > 0, backwards = random_below(state, 2);
  outline.count = 3 + (int)random_below(state, MOST_EDGES - 3);
  for (int i = 0; i < outline.count; i++) {
    const double r = random_between(state, least, 1);
    const double angle = 6.283185307179586 * i / outline.count + swirl * (1 - r);
    double *p = outline.corners[backwards ? outline.count - 1 - i : i];
    p[0] = r * cos(angle);
    p[1] = r * sin(angle);
    outline.bulges[i] = 0;
    if (arcs && random_below(state, 2))
      outline.bulges[i] = random_between(state, -1, 1) * random_between(state, 0, 1);
  }
}

/* The point at a fraction of an edge. */
static void edge_point(int i, double t, double out[2])
{
  const double *a = corner(i), *b = corner(i + 1), bulge = outline.bulges[i];
  const double x = b[0] - a[0], y = b[1] - a[1];
  /* On the circle: by the angles to its ends, which are a quarter of the arc's at the chord. */
  const double quarter = atan(bulge), half = 2 * quarter;
  double along = t, right = 0;
  if (bulge != 0) {
    const double radius = 1 / (2 * sin(half)), angle = 2 * half * (t - 0.5);
    along = 0.5 + radius * sin(angle);
    right = radius * (cos(angle) - cos(half));
  }
  out[0] = a[0] + along * x + right * y;
  out[1] = a[1] + along * y - right * x;
}

/* The circle of an edge that is an arc; t in edge_point goes from angle -half to half. */
typedef struct circle {
  double centre[2], radius, half;
} circle;

static circle circle_of(int i)
{
  const double *a = corner(i), *b = corner(i + 1), half = 2 * atan(outline.bulges[i]);
  const double x = b[0] - a[0], y = b[1] - a[1], down = cos(half) / (2 * sin(half));
  return (circle){{(a[0] + b[0]) / 2 - down * y, (a[1] + b[1]) / 2 + down * x},
                  hypot(x, y) / (2 * fabs(sin(half))), half};
}

/* The fractions of an arc where y turns; returns how many. */
static int find_turns(int i, double t[2])
{
  const double *a = corner(i), *b = corner(i + 1), half = circle_of(i).half;
  int count = 0;
  for (int k = -2; k <= 2; k++) {
    const double angle = atan2(-(b[1] - a[1]), b[0] - a[0]) + k * PI, at = 0.5 + angle / (2 * half);
    if (at > 0 && at < 1 && count < 2)
      t[count++] = at;
  }
  if (count == 2 && t[0] > t[1]) {
    const double later = t[0];
    t[0] = t[1];
    t[1] = later;
  }
  return count;
}

/* How often an edge crosses the way from (x, y) to the right. */
static int count_crossings(int i, double x, double y)
{
  double stops[4] = {0}, a[2], b[2], middle[2];
  const bool curved = outline.bulges[i] != 0;
  const int turns = curved ? find_turns(i, stops + 1) : 0;
  int crossings = 0;
  stops[turns + 1] = 1;
  memcpy(a, corner(i), sizeof a);
  for (int k = 0; k <= turns; k++, memcpy(a, b, sizeof a)) {
    if (k == turns)
      memcpy(b, corner(i + 1), sizeof b);
    else
      edge_point(i, stops[k + 1], b);
    if ((a[1] > y) == (b[1] > y))
      continue;
    double at = a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1]);
    if (curved) {
      const circle c = circle_of(i);
      const double up = y - c.centre[1], across = sqrt(fmax(c.radius * c.radius - up * up, 0));
      edge_point(i, (stops[k] + stops[k + 1]) / 2, middle);
      at = c.centre[0] + (middle[0] > c.centre[0] ? across : -across);
    }
    crossings += x < at;
  }
  return crossings;
}

static bool is_inside(double x, double y)
{
  int crossings = 0;
  for (int i = 0; i < outline.count; i++)
    crossings += count_crossings(i, x, y);
  return crossings % 2;
}

static double edge_distance(int i, double x, double y)
{
  const double *a = corner(i), *b = corner(i + 1);
  const double ex = b[0] - a[0], ey = b[1] - a[1], ends = fmin(hypot(x - a[0], y - a[1]),
                                                               hypot(x - b[0], y - b[1]));
  if (outline.bulges[i] == 0) {
    const double t = ((x - a[0]) * ex + (y - a[1]) * ey) / (ex * ex + ey * ey);
    return t > 0 && t < 1 ? hypot(x - a[0] - t * ex, y - a[1] - t * ey) : ends;
  }
  /* The angle from the middle of the arc, seen from its circle's centre. */
  const circle c = circle_of(i);
  double middle[2];
  edge_point(i, 0.5, middle);
  const double ux = middle[0] - c.centre[0], uy = middle[1] - c.centre[1];
  const double px = x - c.centre[0], py = y - c.centre[1];
  const double angle = fabs(atan2(ux * py - uy * px, ux * px + uy * py));
  return angle < fabs(c.half) ? fabs(hypot(px, py) - c.radius) : ends;
}

static double distance_of(double x, double y)
{
  double least = INFINITY;
  for (int i = 0; i < outline.count; i++)
    least = fmin(least, edge_distance(i, x, y));
  return least;
}

static void write_outline(char *text, size_t size, const char *function, bool through)
{
  size_t used = (size_t)snprintf(text, size, "<curved-polygon r-function='%s'>", function);
  for (int i = 0; i < outline.count; i++) {
    const double *to = corner(i + 1);
    double middle[2];
    edge_point(i, 0.5, middle);
    if (outline.bulges[i] == 0)
      used += (size_t)snprintf(text + used, size - used, "<line to='%.17g %.17g'/>", to[0], to[1]);
    else if (through)
      used += (size_t)snprintf(text + used, size - used,
                               "<arc to='%.17g %.17g' through='%.17g %.17g'/>", to[0], to[1],
                               middle[0], middle[1]);
    else
      used += (size_t)snprintf(text + used, size - used, "<arc to='%.17g %.17g' bulge='%.17g'/>",
                               to[0], to[1], outline.bulges[i]);
  }
  snprintf(text + used, size - used, "</curved-polygon>");
}

static zs_field *compile_quietly(const char *body)
{
  zs_diag diag = {0};
  zs_scene *scene = parse(body, &diag);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  zs_scene_free(scene);
  return field;
}

/* What single precision may be off by next to the outline: of flat arcs, whose distance is the
 * difference of a radius and one that is about as long, some of the last digits of these. */
static double tolerance_of(void)
{
  double tolerance = 1e-5;
  for (int i = 0; i < outline.count; i++)
    if (outline.bulges[i] != 0)
      tolerance = fmax(tolerance, 4e-7 * circle_of(i).radius);
  return tolerance;
}

/* Compare signs at random points. */
static void check_signs(zs_eval *eval, int points, const char *body, uint64_t *state)
{
  static float x[MOST_POINTS], y[MOST_POINTS], z[MOST_POINTS], f[MOST_POINTS];
  const double tolerance = tolerance_of();
  for (int done = 0; done < points; done += MOST_POINTS) {
    for (int j = 0; j < MOST_POINTS; j++) {
      x[j] = (float)random_between(state, -1.3, 1.3);
      y[j] = (float)random_between(state, -1.3, 1.3);
    }
    zs_eval_values(eval, NULL, MOST_POINTS, x, y, z, f);
    for (int j = 0; j < MOST_POINTS; j++) {
      const double px = (double)x[j], py = (double)y[j];
      const bool inside = is_inside(px, py);
      if (f[j] != 0 && (f[j] > 0) == inside)
        continue;
      const double distance = distance_of(px, py);
      if (distance > tolerance)
        fail_msg("at %.9g %.9g: %g, but %sside at a distance of %g of\n%s", px, py, (double)f[j],
                 inside ? "in" : "out", distance, body);
    }
  }
}

/* No farther from 0 than the outline is. */
static void check_least_distance(zs_eval *eval, uint64_t *state)
{
  for (int j = 0; j < 150; j++) {
    const double p[3] = {random_between(state, -1.3, 1.3), random_between(state, -1.3, 1.3), 0};
    assert_true(fabs(zs_eval_point(eval, p)) <= distance_of(p[0], p[1]) + 1e-9);
  }
}

/* ZEROSET_TEST_LONG in the environment: many more outlines and points, in some minutes. */
static void test_random(void **unused)
{
  (void)unused;
  uint64_t state = 6;
  const bool complete = getenv("ZEROSET_TEST_LONG");
  const int wanted = complete ? 1000 : 60, points = complete ? 100000 : 2000;
  int curved = 0;
  static char body[MOST_EDGES * 200];
  for (int i = 0, accepted = 0; accepted < wanted; i++) {
    make_outline(&state);
    write_outline(body, sizeof body, i % 2 ? "r0" : "min-max", i % 3 == 0);
    zs_field *field = compile_quietly(body);
    if (!field)
      continue; /* its edges cross */
    zs_eval *eval = evaluator(field);
    accepted++;
    for (int e = 0; e < outline.count; e++)
      curved += outline.bulges[e] != 0;
    check_signs(eval, points, body, &state);
    if (i % 2 == 0)
      check_least_distance(eval, &state);
    zs_eval_free(eval);
    zs_field_unref(field);
  }
  assert_true(curved > 2 * wanted);
}

/* f is 0 on the edges, and has the slope 1 there with r0, as the R-functions have. */
static void test_known(void **unused)
{
  (void)unused;
  const char *disc = "<curved-polygon><arc to='1 0' bulge='1'/><arc to='-1 0' bulge='1'/>"
                     "</curved-polygon>";
  for (int i = 0; i < 40; i++) {
    const double a = 0.16 * i + 0.05;
    assert_true(fabs(value_in(disc, cos(a), sin(a), 3)) < 1e-9);
    assert_true(value_in(disc, 0.99 * cos(a), 0.99 * sin(a), 0) > 0);
    assert_true(value_in(disc, 1.01 * cos(a), 1.01 * sin(a), 0) < 0);
  }
  const char *square = "<curved-polygon><line to='0 0'/><line to='2 0'/><line to='2 2'/>"
                       "<line to='1 2'/><line to='0 2'/></curved-polygon>";
  assert_true(fabs(value_in(square, 1, 1e-6, 0) - 1e-6) < 1e-11);
  assert_true(fabs(value_in(square, 1.5, 2, 0)) < 1e-15);
  /* Any way round, and by a point in place of the bulge. */
  const char *a = "<curved-polygon><line to='0 0'/><line to='2 0'/><arc to='0 2' bulge='0.3'/>"
                  "</curved-polygon>";
  const char *b = "<curved-polygon><line to='0 0'/><line to='0 2'/><arc to='2 0' bulge='-0.3'/>"
                  "</curved-polygon>";
  for (int i = 0; i < 40; i++) {
    const double x = 0.07 * i - 0.3, y = 0.11 * (i % 9);
    assert_true(fabs(value_in(a, x, y, 0) - value_in(b, x, y, 0)) < 1e-9);
  }
  /* With an arc of more than half a circle, too. */
  static const char *const ways[] = {
    "<curved-polygon><line to='0 0'/><line to='0 4'/><arc to='4 4' bulge='-2'/><line to='4 0'/>"
    "</curved-polygon>",
    "<curved-polygon><line to='4 0'/><line to='4 4'/><arc to='0 4' bulge='2'/><line to='0 0'/>"
    "</curved-polygon>"};
  for (int i = 0; i < 2; i++) {
    assert_true(value_in(ways[i], 2, 2, 0) > 0 && value_in(ways[i], 2, 7.9, 0) > 0);
    assert_true(value_in(ways[i], 0.1, 0.1, 0) > 0 && value_in(ways[i], 4.4, 5, 0) > 0);
    assert_true(value_in(ways[i], -0.1, 2, 0) < 0 && value_in(ways[i], 2, 8.1, 0) < 0);
  }
}

static void test_mistakes(void **unused)
{
  (void)unused;
  static const char *const cases[][2] = {
    {"<curved-polygon/>", "0 edges enclose nothing"},
    {"<curved-polygon><line to='0 0'/><line to='1 0'/></curved-polygon>", "enclose nothing"},
    {"<curved-polygon><line to='0 0'/><line to='0 0'/><line to='1 0'/></curved-polygon>",
     "ends where it begins"},
    {"<curved-polygon><line to='0 0'/><line to='1 1'/><line to='1 0'/><line to='0 1'/>"
     "</curved-polygon>", "cross or touch"},
    /* Two arcs whose circles meet again very near to their corner. */
    {"<curved-polygon><line to='0 0'/><line to='0 0.5'/><line to='-0.7616 0.3668'/>"
     "<arc to='-0.9209 0.2102' bulge='-0.7567'/><arc to='-0.8591 0' bulge='-0.426'/>"
     "</curved-polygon>", "cross or touch"},
    {"<curved-polygon><line to='0 0'/><arc to='1 1'/><line to='1 0'/></curved-polygon>",
     "neither 'through' nor 'bulge'"},
    {"<curved-polygon><line to='0 0'/><arc to='1 1' through='0.5 0.5'/><line to='1 0'/>"
     "</curved-polygon>", "on the line of the arc's ends"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    refuses(cases[i][0], cases[i][1]);
}

int main(void)
{
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_random), cmocka_unit_test(test_known),
                                     cmocka_unit_test(test_mistakes)};
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
