/* Soft objects and convolution surfaces. */
#include "laws.h"

#include "field/program.h"
#include "nodes/extent.h"

#include <stdio.h>

static zs_node *formula(zs_arena *arena, const char *text)
{
  return set_formula(arena, node_named(arena, "formula"), "formula", text);
}

/* A part of `parent` by its name. */
static zs_node *part(zs_arena *arena, zs_node *parent, const char *name)
{
  for (const zs_kind *const *kind = parent->kind->parts; *kind; kind++)
    if (!strcmp((*kind)->name, name)) {
      zs_node *node = node_of_kind(arena, *kind);
      adopt(arena, parent, node);
      return node;
    }
  fail_msg("there is no part <%s>", name);
  return NULL;
}

static zs_node *soft(zs_arena *arena, const char *falloff, double threshold)
{
  return set(choose(node_named(arena, "soft"), "falloff", falloff), "threshold", threshold);
}

/* ---- soft ----------------------------------------------------------------------------- */

static void test_falloffs(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  static const char *const names[] = {"wyvill", "blobtree", "blinn", "metaball"};
  static const char *const fields[] = {
    "u < 1 ? 1 - 22/9 * u^2 + 17/9 * u^4 - 4/9 * u^6 : 0", "u < 1 ? (1 - u^2)^3 : 0",
    "exp(-4 * log(2) * u^2)", "u < 1/3 ? 1 - 3 * u^2 : u < 1 ? 1.5 * (1 - u)^2 : 0"};
  for (int i = 0; i < 4; i++) {
    char text[300];
    snprintf(text, sizeof text,
             "let u = sqrt((x - 0.2)^2 + (y + 0.1)^2 + z^2) / 1.5; 0.8 * (%s) - 0.3", fields[i]);
    zs_node *node = soft(A, names[i], 0.3);
    set(set(set3(part(A, node, "point"), "at", 0.2, -0.1, 0), "radius", 1.5), "weight", 0.8);
    check_law(EQUAL, names[i], node, formula(A, text));
  }
  zs_arena_free(&arena);
}

/* Distances to lines are those of capsules; fields add; the nearest piece of a polyline counts. */
static void test_soft_lines(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  const double points[9] = {-1, 0, 0, 0, 0.5, 0, 1, 0, 0.5};
  zs_node *line = soft(A, "blobtree", 0.2);
  set_numbers(A, part(A, line, "polyline"), "points", points, 9);
  zs_eval *eval = compiled(line), *capsule[2];
  for (int i = 0; i < 2; i++) {
    zs_node *node = set(node_named(A, "capsule"), "radius", 1);
    capsule[i] = compiled(set_vector(set_vector(node, "from", points + 3 * i), "to",
                                     points + 3 * i + 3));
  }
  uint64_t state = 1;
  for (int i = 0; i < 1000; i++) {
    double p[3];
    for (int k = 0; k < 3; k++)
      p[k] = random_between(&state, -2, 2);
    const double u = 1 - fmax(zs_eval_point(capsule[0], p), zs_eval_point(capsule[1], p));
    const double expected = (u < 1 ? pow(1 - u * u, 3) : 0) - 0.2;
    assert_true(fabs(zs_eval_point(eval, p) - expected) < 1e-9);
  }
  zs_eval_free(eval);
  zs_eval_free(capsule[0]);
  zs_eval_free(capsule[1]);
  zs_arena_free(&arena);
}

/* The distance to a triangle, against many points of it. */
static void test_soft_triangle(void **unused)
{
  (void)unused;
  uint64_t state = 7;
  enum { STEPS = 300 };
  for (int t = 0; t < 20; t++) {
    zs_arena arena = {0};
    double c[9];
    for (int i = 0; i < 9; i++)
      c[i] = random_between(&state, -1, 1);
    zs_node *node = soft(&arena, "wyvill", 0.3);
    set(set_numbers(&arena, part(&arena, node, "triangle"), "points", c, 9), "radius", 3);
    zs_eval *eval = compiled(node);
    for (int n = 0; n < 10; n++) {
      double p[3], least = INFINITY;
      for (int k = 0; k < 3; k++)
        p[k] = random_between(&state, -1.5, 1.5);
      for (int i = 0; i <= STEPS; i++)
        for (int j = 0; i + j <= STEPS; j++) {
          double d = 0;
          for (int k = 0; k < 3; k++)
            d = hypot(d, c[k] + (c[3 + k] - c[k]) * i / STEPS + (c[6 + k] - c[k]) * j / STEPS -
                           p[k]);
          least = fmin(least, d);
        }
      const double q = least * least / 9;
      const double expected = 1 + q * (-22 + q * (17 - 4 * q)) / 9 - 0.3;
      assert_true(fabs(zs_eval_point(eval, p) - expected) < 0.01);
    }
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

/* Radii whose squares are no numbers any more. */
static void test_small_radius(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  static const char *const names[] = {"wyvill", "blobtree", "blinn", "metaball"};
  for (int i = 0; i < 4; i++) {
    zs_node *node = soft(A, names[i], 0.5);
    set(part(A, node, "point"), "radius", 1e-300);
    zs_eval *eval = compiled(node);
    const float x[2] = {0, 1}, y[2] = {0, 0};
    float f[2], g[3][2];
    zs_eval_gradients(eval, NULL, 2, x, y, y, f, g[0], g[1], g[2]);
    assert_true(f[0] == 0.5f && f[1] == -0.5f);
    for (int k = 0; k < 3; k++)
      assert_true(g[k][0] == 0 && g[k][1] == 0);
    zs_eval_free(eval);
  }
  zs_arena_free(&arena);
}

/* ---- convolution -------------------------------------------------------------------------- */

static double kernel(const double p[3], const double q[3], double s)
{
  double r2 = 0;
  for (int k = 0; k < 3; k++)
    r2 += (p[k] - q[k]) * (p[k] - q[k]);
  return 1 / ((1 + s * s * r2) * (1 + s * s * r2));
}

/* Gauss-Legendre, of 4 points in each of many intervals of 0..1. */
static const double NODES[4] = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813,
                                0.93056815579702629};
static const double WEIGHTS[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                  0.17392742256872693};
enum { INTERVALS = 24 };

static double along(const double p[3], const double a[3], const double b[3], double s)
{
  double sum = 0, length = 0;
  for (int k = 0; k < 3; k++)
    length = hypot(length, b[k] - a[k]);
  for (int i = 0; i < 4 * INTERVALS; i++) {
    const double t = (i / 4 + NODES[i % 4]) / INTERVALS;
    const double q[3] = {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]),
                         a[2] + t * (b[2] - a[2])};
    sum += WEIGHTS[i % 4] * kernel(p, q, s);
  }
  return sum / INTERVALS * length;
}

/* Lines of the triangle that are parallel to its first side. */
static double over(const double p[3], const double c[9], double s)
{
  double u[3], v[3], sum = 0, height = 0, side = 0, along_side = 0, v2 = 0;
  for (int k = 0; k < 3; k++) {
    u[k] = c[3 + k] - c[k];
    v[k] = c[6 + k] - c[k];
    side += u[k] * u[k];
    along_side += u[k] * v[k];
    v2 += v[k] * v[k];
  }
  height = sqrt(v2 - along_side * along_side / side);
  for (int i = 0; i < 4 * INTERVALS; i++) {
    const double t = (i / 4 + NODES[i % 4]) / INTERVALS;
    double a[3], b[3];
    for (int k = 0; k < 3; k++) {
      a[k] = c[k] + t * v[k];
      b[k] = a[k] + (1 - t) * u[k];
    }
    sum += WEIGHTS[i % 4] * along(p, a, b, s);
  }
  return sum / INTERVALS * height;
}

/* The closed forms against numerical quadrature, for kernels wide and narrow. */
static void test_closed_forms(void **unused)
{
  (void)unused;
  uint64_t state = 12;
  for (int t = 0; t < 60; t++) {
    zs_arena arena = {0}, *A = &arena;
    const double sharpness = random_between(&state, 0.3, 3);
    const double radius = random_between(&state, 0.5, 2);
    double c[9];
    for (int i = 0; i < 9; i++)
      c[i] = random_between(&state, -1, 1);
    zs_node *node[3];
    static const char *const names[] = {"point", "segment", "triangle"};
    for (int i = 0; i < 3; i++) {
      node[i] = set(set(node_named(A, "convolution"), "sharpness", sharpness), "threshold", 0.2);
      set(set(part(A, node[i], names[i]), "radius", radius), "weight", 1.5);
    }
    set_vector((zs_node *)node[0]->children[0], "at", c);
    set_vector(set_vector((zs_node *)node[1]->children[0], "from", c), "to", c + 3);
    set_numbers(A, (zs_node *)node[2]->children[0], "points", c, 9);
    for (int i = 0; i < 3; i++) {
      zs_eval *eval = compiled(node[i]);
      for (int n = 0; n < 10; n++) {
        const double p[3] = {random_between(&state, -1.5, 1.5), random_between(&state, -1.5, 1.5),
                             random_between(&state, -1.5, 1.5)};
        const double s = sharpness / radius;
        const double integral = i == 0   ? kernel(p, c, s)
                                : i == 1 ? along(p, c, c + 3, s)
                                         : over(p, c, s);
        const double f = zs_eval_point(eval, p);
        if (fabs(f - (1.5 * integral - 0.2)) > 1e-6)
          fail_msg("<%s>, s %g: %.12g, quadrature %.12g", names[i], s, f, 1.5 * integral - 0.2);
      }
      zs_eval_free(eval);
    }
    zs_arena_free(&arena);
  }
}

/* Pieces join without a trace. */
static void test_pieces(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *whole = node_named(A, "convolution"), *pieces = node_named(A, "convolution");
  const double points[12] = {-1, 0, 0, -0.5, 0.25, 0, -0.5, 0.25, 0, 1, 1, 0};
  set3(set3(part(A, whole, "segment"), "from", -1, 0, 0), "to", 1, 1, 0);
  set_numbers(A, part(A, pieces, "polyline"), "points", points, 12);
  check_law(EQUAL, "a line in pieces", whole, pieces);
  zs_node *square = node_named(A, "convolution"), *other = node_named(A, "convolution");
  const double halves[4][9] = {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 0, 0, 1, 1, 0, 0, 1, 0},
                               {0, 0, 0, 0, 1, 0, 1, 0, 0}, {1, 1, 0, 1, 0, 0, 0, 1, 0}};
  for (int i = 0; i < 4; i++)
    set_numbers(A, part(A, i < 2 ? square : other, "triangle"), "points", halves[i], 9);
  check_law(EQUAL, "a square in triangles", square, other);
  zs_arena_free(&arena);
}

/* ---- The kernels ----------------------------------------------------------------------------- */

static const char *const isas[] = {"baseline", "avx2", "avx512"};
static const char *const falloffs[] = {"wyvill", "blobtree", "blinn", "metaball"};
enum { FIELDS = 5 }; /* of these, and of a convolution */

/* A skeleton of all shapes, in which parts add and take away. */
static zs_node *random_skeleton(zs_arena *A, int field, uint64_t *state)
{
  static const char *const names[] = {"point", "segment", "polyline", "triangle"};
  zs_node *node = field < 4 ? soft(A, falloffs[field], 0.3) : node_named(A, "convolution");
  const int count = 1 + (int)random_below(state, random_below(state, 3) ? 6 : 50);
  for (int i = 0; i < count; i++) {
    const unsigned shape = random_below(state, 4);
    double c[12];
    for (int k = 0; k < 12; k++)
      c[k] = random_between(state, -2, 2);
    zs_node *own = part(A, node, names[shape]);
    if (shape == 0)
      set_vector(own, "at", c);
    else if (shape == 1)
      set_vector(set_vector(own, "from", c), "to", c + 3);
    else
      set_numbers(A, own, "points", c, shape == 2 ? 12 : 9);
    set(set(own, "radius", exp(random_between(state, -1.5, 1.5))), "weight",
        random_below(state, 4) ? random_between(state, 0.2, 2) : random_between(state, -1, -0.2));
  }
  return node;
}

/* Whether f has one slope along an axis: the nearest pieces do not change there. */
static bool has_slope(zs_eval *eval, const double p[3], int axis, double *slope)
{
  const double h = 1e-5;
  double f[3];
  for (int i = 0; i < 3; i++) {
    double at[3] = {p[0], p[1], p[2]};
    at[axis] += (i - 1) * h;
    f[i] = zs_eval_point(eval, at);
  }
  *slope = (f[2] - f[0]) / (2 * h);
  return fabs((f[2] - f[1]) - (f[1] - f[0])) < 1e-3 * h;
}

/* Values and slopes of blocks are those of the definition, near and far, on every instruction
 * set. */
static void test_blocks(void **unused)
{
  (void)unused;
  enum { POINTS = 100 };
  uint64_t state = 31;
  unsigned slopes = 0;
  for (int t = 0; t < 12 * FIELDS; t++) {
    zs_arena arena = {0};
    setenv("ZEROSET_ISA", isas[t % 3], 1);
    zs_eval *eval = compiled(random_skeleton(&arena, t % FIELDS, &state));
    float x[3][POINTS], f[POINTS], g[4][POINTS];
    for (int i = 0; i < POINTS; i++)
      for (int k = 0; k < 3; k++)
        x[k][i] = (float)random_between(&state, -3, 3) * (i % 5 ? 1 : 50);
    x[1][7] = NAN;
    zs_eval_values(eval, NULL, POINTS, x[0], x[1], x[2], f);
    zs_eval_gradients(eval, NULL, POINTS, x[0], x[1], x[2], g[0], g[1], g[2], g[3]);
    assert_true(isnan(f[7]) && isnan(g[0][7]));
    for (int i = 0; i < POINTS; i++) {
      const double p[3] = {(double)x[0][i], (double)x[1][i], (double)x[2][i]};
      if (i == 7)
        continue;
      const double expected = zs_eval_point(eval, p);
      if (!(fabs((double)f[i] - expected) < 1e-5 * (1 + fabs(expected)) &&
            fabs((double)(f[i] - g[0][i])) < 1e-6 * (1 + fabs(expected))))
        fail_msg("field %d on %s at %g %g %g: %.9g, with slopes %.9g, instead of %.9g",
                 t % FIELDS, isas[t % 3], p[0], p[1], p[2], (double)f[i], (double)g[0][i],
                 expected);
      for (int k = 0; k < 3; k++) {
        double slope;
        if (!has_slope(eval, p, k, &slope))
          continue;
        slopes++;
        if (!(fabs((double)g[k + 1][i] - slope) < 2e-3 * (1 + fabs(slope))))
          fail_msg("field %d at %g %g %g: slope %d is %g, differences %g", t % FIELDS, p[0], p[1],
                   p[2], k, (double)g[k + 1][i], slope);
      }
    }
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
  assert_true(slopes > 12 * FIELDS * POINTS);
  unsetenv("ZEROSET_ISA");
}

/* Boxes of all sizes hold what f is in them; small ones do so closely. */
static void test_ranges(void **unused)
{
  (void)unused;
  enum { BOXES = 64, SAMPLES = 40 };
  uint64_t state = 33;
  for (int t = 0; t < 12 * FIELDS; t++) {
    zs_arena arena = {0};
    setenv("ZEROSET_ISA", isas[t % 3], 1);
    zs_eval *eval = compiled(random_skeleton(&arena, t % FIELDS, &state));
    double lo[BOXES][3], hi[BOXES][3];
    float f_lo[BOXES], f_hi[BOXES];
    for (int b = 0; b < BOXES; b++)
      for (int k = 0; k < 3; k++) {
        lo[b][k] = random_between(&state, -3, 3) * (b % 9 ? 1 : 1000);
        hi[b][k] = lo[b][k] + exp(random_between(&state, -9, 3));
      }
    for (int k = 0; k < 3; k++) /* so close to one point that little is left of f */
      hi[0][k] = lo[0][k] + 1e-4;
    lo[1][0] = -INFINITY;
    zs_eval_bounds(eval, BOXES, (const double(*)[3])lo, (const double(*)[3])hi, f_lo, f_hi);
    assert_true(f_hi[0] - f_lo[0] < 2e-2f);
    for (int b = 0; b < BOXES; b++)
      for (int i = 0; i < SAMPLES; i++) {
        double p[3];
        for (int k = 0; k < 3; k++)
          p[k] = isinf(lo[b][k])             ? hi[b][k] - exp(random_between(&state, -3, 9))
                 : random_below(&state, 3)   ? random_between(&state, lo[b][k], hi[b][k])
                 : random_below(&state, 2) ? lo[b][k] : hi[b][k];
        const double f = zs_eval_point(eval, p);
        if (!(isnan(f_lo[b]) || (f >= (double)f_lo[b] && f <= (double)f_hi[b])))
          fail_msg("field %d on %s: %.9g at %g %g %g is not in %.9g .. %.9g", t % FIELDS,
                   isas[t % 3], f, p[0], p[1], p[2], (double)f_lo[b], (double)f_hi[b]);
      }
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
  unsetenv("ZEROSET_ISA");
}

/* ---- Many parts ------------------------------------------------------------------------------ */

/* In a small box few of many parts are left, and the box of all holds the solid. */
static void test_many(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  uint64_t state = 21;
  zs_node *node = soft(A, "wyvill", 0.5);
  for (int i = 0; i < 400; i++)
    set(set3(part(A, node, "point"), "at", random_between(&state, -10, 10),
             random_between(&state, -10, 10), random_between(&state, -10, 10)), "radius", 1);
  zs_eval *eval = compiled(node), *local = compiled(node);
  const zs_box box = node->kind->box(node, NULL, 0);
  for (int t = 0; t < 50; t++) {
    double lo[3], hi[3];
    for (int k = 0; k < 3; k++) {
      lo[k] = random_between(&state, -11, 10);
      hi[k] = lo[k] + 1;
    }
    assert_true(zs_eval_restrict(local, lo, hi, ZS_REQUEST_VALUE));
    for (int i = 0; i < 50; i++) {
      const float x = (float)random_between(&state, lo[0] + 1e-4, hi[0] - 1e-4);
      const float y = (float)random_between(&state, lo[1] + 1e-4, hi[1] - 1e-4);
      const float z = (float)random_between(&state, lo[2] + 1e-4, hi[2] - 1e-4);
      float f;
      zs_eval_values(local, NULL, 1, &x, &y, &z, &f);
      const double whole = value_at(eval, x, y, z);
      assert_true(fabs(f - whole) < 1e-5);
      const double p[3] = {x, y, z};
      for (int k = 0; k < 3; k++)
        assert_true(whole < 0 || (p[k] >= box.lo[k] && p[k] <= box.hi[k]));
    }
    zs_eval_release(local);
  }
  zs_eval_free(eval);
  zs_eval_free(local);
  zs_arena_free(&arena);
}

static void test_refused(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  expect_refused(node_named(A, "soft"));
  expect_refused(node_named(A, "convolution"));
  zs_node *node = node_named(A, "soft");
  const double numbers[12] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3};
  static const size_t wrong[] = {0, 3, 7};
  for (int i = 0; i < 3; i++)
    expect_refused(set_numbers(A, part(A, node, "polyline"), "points", numbers, wrong[i]));
  expect_refused(set_numbers(A, part(A, node, "triangle"), "points", numbers, 12));
  expect_refused(set_numbers(A, part(A, node, "triangle"), "points", numbers, 9));
  zs_arena_free(&arena);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_falloffs),     cmocka_unit_test(test_soft_lines),
    cmocka_unit_test(test_soft_triangle), cmocka_unit_test(test_small_radius),
    cmocka_unit_test(test_closed_forms),
    cmocka_unit_test(test_pieces),       cmocka_unit_test(test_blocks),
    cmocka_unit_test(test_ranges),       cmocka_unit_test(test_many),
    cmocka_unit_test(test_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
