/* Primitives, shapes and the solids from shapes against what is known of them:
 * values at chosen points, and that exact distances have unit slope. */
#include "build.h"

#define NEAR(a, b) \
  do { \
    const double a_ = (a), b_ = (b); \
    if (!(fabs(a_ - b_) <= 1e-12 * (1 + fabs(b_)))) \
      fail_msg("%s is %.15g, not %.15g", #a, a_, b_); \
  } while (0)

/* |grad f| = 1 wherever f is smooth. */
static void assert_unit_slope(zs_eval *eval)
{
  uint64_t state = 7;
  int smooth = 0;
  for (int i = 0; i < 2000; i++) {
    double p[3], g[3];
    for (int k = 0; k < 3; k++)
      p[k] = random_between(&state, -3, 3);
    if (!difference_gradient(eval, p, 1e-6, g))
      continue;
    smooth++;
    const double slope = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    if (fabs(slope - 1) > 1e-4)
      fail_msg("the slope at %g %g %g is %g", p[0], p[1], p[2], slope);
  }
  assert_true(smooth > 1000);
}

/* |f| is no more than the distance to the surface: f changes no faster than the
 * point moves. */
static void assert_bounded_slope(zs_eval *eval)
{
  uint64_t state = 8;
  for (int i = 0; i < 20000; i++) {
    double p[3], q[3], d2 = 0;
    for (int k = 0; k < 3; k++) {
      p[k] = random_between(&state, -3, 3);
      q[k] = p[k] + random_between(&state, -0.5, 0.5);
      d2 += (q[k] - p[k]) * (q[k] - p[k]);
    }
    assert_true(fabs(zs_eval_point(eval, p) - zs_eval_point(eval, q)) <= sqrt(d2) * (1 + 1e-9));
  }
}

/* Check that a distance is exact: unit slope, and known values. */
static void check_distance(zs_node *node, size_t count, const double expected[][4])
{
  zs_eval *eval = compiled(node);
  for (size_t i = 0; i < count; i++)
    NEAR(zs_eval_point(eval, expected[i]), expected[i][3]);
  assert_unit_slope(eval);
  assert_bounded_slope(eval);
  zs_eval_free(eval);
}
#define CHECK_DISTANCE(node, ...) \
  do { \
    static const double expected_[][4] = {__VA_ARGS__}; \
    check_distance(node, ZS_COUNT_OF(expected_), expected_); \
  } while (0)

static void test_round_primitives(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  CHECK_DISTANCE(set(node_named(&arena, "sphere"), "radius", 2), {0, 0, 0, 2}, {3, 0, 0, -1},
                 {0, 2, 0, 0}, {1, 2, 2, -1});
  CHECK_DISTANCE(set(set(node_named(&arena, "torus"), "radius", 1.5), "tube", 0.5),
                 {1.5, 0, 0, 0.5}, {0, -2.5, 0, -0.5}, {0, 1.5, 0.5, 0}, {0, 0, 0, -1},
                 {0, 1.5, -2, -1.5});
  CHECK_DISTANCE(choose(set(node_named(&arena, "torus"), "tube", 0.5), "axis", "x"),
                 {0, 0, 1, 0.5}, {0.5, 1, 0, 0}, {1, 0, 0, 0.5 - sqrt(2)});
  CHECK_DISTANCE(set3(set3(set(node_named(&arena, "capsule"), "radius", 0.5), "from", 0, 0, 0),
                      "to", 2, 0, 0),
                 {1, 0, 0, 0.5}, {1, 0.25, 0, 0.25}, {-1, 0, 0, -0.5}, {3, 0, 0, -0.5},
                 {2, 0, 2, -1.5});
  CHECK_DISTANCE(set3(set3(set(node_named(&arena, "capsule"), "radius", 0.5), "from", 1, 1, 1),
                      "to", 1, 1, 1),
                 {1, 1, 1, 0.5}, {1, 1, 2, -0.5});
  zs_arena_free(&arena);
}

static void test_cylinder_and_cone(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  CHECK_DISTANCE(set(node_named(&arena, "cylinder"), "radius", 0.5), {0, 0, 9, 0.5},
                 {0, 2, -3, -1.5});
  CHECK_DISTANCE(set(node_named(&arena, "cylinder"), "height", 3), {0, 0, 0, 1}, {0, 0, 1, 0.5},
                 {0, 0, 2, -0.5}, {2, 0, 0, -1}, {0, 4, 5.5, -5}, {0, 0, -1.5, 0});
  CHECK_DISTANCE(choose(set(node_named(&arena, "cylinder"), "height", 3), "axis", "y"),
                 {0, 1, 0, 0.5}, {0, 5.5, 4, -5});
  /* A 3-4-5 mantle: radius 3 below, 0 above, height 4. */
  zs_node *cone = set(set(node_named(&arena, "cone"), "radius", 3), "height", 4);
  CHECK_DISTANCE(cone, {0, 0, 2, 0}, {0, 0, 3, -1}, {3, 0, -2, 0}, {0, 0, -2.5, -0.5},
                 {0, 0, -1.9, 0.1}, {0, 0, 0, 1.2}, {1.5 + 4, 0, 3, -5}, {3, 0, -4, -2},
                 {4, 0, -2, -1});
  zs_node *straight = set(set(node_named(&arena, "cone"), "top-radius", 1), "height", 3);
  CHECK_DISTANCE(straight, {0, 0, 0, 1}, {0, 0, 1, 0.5}, {2, 0, 0, -1}, {0, 4, 5.5, -5});
  CHECK_DISTANCE(choose(set(set(set(node_named(&arena, "cone"), "radius", 0), "top-radius", 3),
                            "height", 4),
                        "axis", "x"),
                 {2, 3, 0, 0}, {-2, 0, 0, 0}, {-3, 0, 0, -1}, {0, 0, 0, 1.2});
  zs_arena_free(&arena);
}

static void test_flat_primitives(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  CHECK_DISTANCE(set3(node_named(&arena, "box"), "size", 2, 4, 6), {0, 0, 0, 1}, {0, 1.5, 0, 0.5},
                 {1, 2, 3, 0}, {4, 6, 3, -5}, {0, 0, 4, -1});
  CHECK_DISTANCE(set3(set3(node_named(&arena, "box"), "min", 0, 0, 0), "max", 1, 2, 3),
                 {0.5, 1, 1.5, 0.5}, {-3, -4, 1, -5}, {1, 2, 3, 0});
  CHECK_DISTANCE(set(set3(node_named(&arena, "box"), "size", 2, 2, 2), "round", 0.5),
                 {0, 0, 0, 1}, {1, 0, 0, 0}, {0.5 + 3, 0.5 + 4, 0, -4.5});
  CHECK_DISTANCE(set3(set3(node_named(&arena, "half-space"), "normal", 0, 0, 5), "point", 9, 9, 1),
                 {0, 0, 0, 1}, {5, 5, 3, -2});
  CHECK_DISTANCE(set3(node_named(&arena, "half-space"), "normal", 3, 4, 0), {3, 4, 7, -5},
                 {-3, -4, 0, 5});
  CHECK_DISTANCE(set(set(node_named(&arena, "slab"), "min", 1), "max", 3), {0, 7, 2, 1},
                 {0, 0, 0, -1}, {0, 0, 3, 0});
  zs_arena_free(&arena);
}

static void test_ellipsoid(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  zs_eval *eval = compiled(set3(node_named(&arena, "ellipsoid"), "radii", 2, 1, 0.5));
  NEAR(value_at(eval, 2, 0, 0), 0);
  NEAR(value_at(eval, 0, -1, 0), 0);
  NEAR(value_at(eval, 0, 0, 0.5), 0);
  NEAR(value_at(eval, 0, 0, 0), 0.5);
  NEAR(value_at(eval, 0, 0, 1), -0.5);
  assert_bounded_slope(eval);
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

static void test_gyroid(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  zs_eval *eval = compiled(set(set(node_named(&arena, "gyroid"), "period", 2), "thickness", 0.3));
  /* The surface goes through the origin, and repeats. */
  NEAR(value_at(eval, 0, 0, 0), 0.15);
  NEAR(value_at(eval, 2, -4, 6), 0.15);
  NEAR(value_at(eval, 0.1, 0.2, 0.3), value_at(eval, 2.1, 2.2, -1.7));
  assert_bounded_slope(eval);
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

static void test_shapes(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  CHECK_DISTANCE(set(node_named(&arena, "circle"), "radius", 2), {0, 0, 5, 2}, {3, 4, 0, -3});
  const double size[2] = {2, 4}, lo[2] = {0, 0}, hi[2] = {2, 1};
  CHECK_DISTANCE(set_vector(node_named(&arena, "rectangle"), "size", size), {0, 0, 9, 1},
                 {4, 6, 0, -5}, {1, 2, 0, 0});
  CHECK_DISTANCE(set_vector(set_vector(node_named(&arena, "rectangle"), "min", lo), "max", hi),
                 {1, 0.5, 9, 0.5}, {-3, -4, 0, -5});
  static const double square[] = {0, 0, 2, 0, 2, 1, 0, 1};
  CHECK_DISTANCE(set_numbers(&arena, node_named(&arena, "polygon"), "points", square, 8),
                 {1, 0.5, 9, 0.5}, {-3, -4, 0, -5}, {0.25, 0.5, 0, 0.25});
  /* A square on its corner. */
  CHECK_DISTANCE(set(set(node_named(&arena, "regular-polygon"), "sides", 4), "radius", sqrt(2)),
                 {0, 0, 1, 1}, {0, sqrt(2), 0, 0}, {0.5, 0.5, 0, 1 - sqrt(0.5)},
                 {1 + sqrt(2), 0, 0, -1});
  const double normal[2] = {3, 4}, point[2] = {3, 4};
  CHECK_DISTANCE(set_vector(set_vector(node_named(&arena, "half-plane"), "normal", normal), "point",
                            point),
                 {0, 0, 7, 5}, {6, 8, 0, -5}, {-1, 7, 0, 0});
  const double radii[2] = {2, 0.5};
  zs_eval *eval = compiled(set_vector(node_named(&arena, "ellipse"), "radii", radii));
  NEAR(value_at(eval, 2, 0, 3), 0);
  NEAR(value_at(eval, 0, -0.5, 3), 0);
  NEAR(value_at(eval, 0, 1, 3), -0.5);
  assert_bounded_slope(eval);
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

static zs_node *shape(zs_arena *arena)
{
  const double size[2] = {2, 4};
  return set_vector(node_named(arena, "rectangle"), "size", size);
}

static void test_extrude(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  /* Of a rectangle: the box. */
  CHECK_DISTANCE(adopt(&arena, set(node_named(&arena, "extrude"), "height", 6), shape(&arena)),
                 {0, 0, 0, 1}, {0, 1.5, 0, 0.5}, {1, 2, 3, 0}, {4, 6, 3, -5}, {0, 0, 4, -1});
  CHECK_DISTANCE(adopt(&arena, set(set(node_named(&arena, "extrude"), "min", 1), "max", 3),
                       shape(&arena)),
                 {0, 0, 2, 1}, {0, 0, 0, -1}, {4, 6, 3, -5});
  /* Along x the shape's x is y, and its y is z. */
  CHECK_DISTANCE(choose(adopt(&arena, set(node_named(&arena, "extrude"), "height", 6),
                              shape(&arena)),
                        "axis", "x"),
                 {3, 1, 2, 0}, {4, 0, 0, -1}, {0, 2, 0, -1}, {0, 0, 3, -1});
  /* Twisted by a quarter turn: at the top the long side lies along x. */
  zs_node *twisted = set(set(node_named(&arena, "extrude"), "height", 6), "twist", 90);
  zs_eval *eval = compiled(adopt(&arena, twisted, shape(&arena)));
  NEAR(value_at(eval, 0, 2, -3), 0);
  NEAR(value_at(eval, -2, 0, 3), 0);
  assert_true(value_at(eval, 0, 1.5, 3) < 0);
  /* Half way, counter-clockwise: the end of the long side, at y = 2, has gone
   * to the left. */
  assert_true(value_at(eval, -1.2, 1.2, 0) > 0);
  assert_true(value_at(eval, 1.2, 1.2, 0) < 0);
  zs_eval_free(eval);
  /* A pyramid. */
  zs_node *pyramid = set(set(node_named(&arena, "extrude"), "height", 2), "end-scale", 0);
  eval = compiled(adopt(&arena, pyramid, shape(&arena)));
  NEAR(value_at(eval, 1, 0, -1), 0);
  NEAR(value_at(eval, 0.5, 0, 0), 0);
  NEAR(value_at(eval, 0, 1, 0), 0);
  assert_true(fabs(value_at(eval, 0, 0, 1)) < 1e-5);
  assert_true(value_at(eval, 0.1, 0, 0.95) < 0);
  assert_true(value_at(eval, 0, 0, 1.1) < 0);
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

static void test_revolve(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  /* Of a circle off the axis: the torus. */
  zs_node *circle = set(node_named(&arena, "circle"), "radius", 0.5);
  CHECK_DISTANCE(adopt(&arena, set(node_named(&arena, "revolve"), "offset", 1.5), circle),
                 {1.5, 0, 0, 0.5}, {0, -2.5, 0, -0.5}, {0, 1.5, 0.5, 0}, {0, 0, 0, -1});
  /* Of a rectangle on the axis: the cylinder. */
  CHECK_DISTANCE(adopt(&arena, choose(node_named(&arena, "revolve"), "axis", "y"), shape(&arena)),
                 {0, 0, 0, 1}, {0, 1.5, 0, 0.5}, {0, 2, 0, 0}, {2, 0, 0, -1}, {0, 5, 5, -5});
  zs_arena_free(&arena);
}

/* Linear between circles: radius and f follow the level exactly. */
static void test_interpolate(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  static const double at[] = {0, 1, 3}, radius[] = {1, 2, 0.5};
  zs_node *node = node_named(&arena, "interpolate");
  for (int i = 0; i < 3; i++) {
    zs_node *level = set(node_of_kind(&arena, node->kind->parts[0]), "at", at[i]);
    zs_node *circle = set(node_named(&arena, "circle"), "radius", radius[i]);
    adopt(&arena, node, adopt(&arena, level, circle));
  }
  assert_true(node->kind->check(node, NULL));
  zs_eval *closed = compiled(node);
  zs_eval *open = compiled(choose(node, "caps", "open"));
  uint64_t state = 9;
  for (int i = 0; i < 2000; i++) {
    const double x = random_between(&state, -3, 3), y = random_between(&state, -3, 3);
    const double z = random_between(&state, -1, 4);
    const double r = z <= 0 ? 1 : z <= 1 ? 1 + z : z <= 3 ? 2 - 0.75 * (z - 1) : 0.5;
    const double f = r - hypot(x, y);
    NEAR(value_at(open, x, y, z), f);
    NEAR(value_at(closed, x, y, z), fmin(f, fmin(z, 3 - z) + 3 * 2.5e-7));
  }
  zs_eval_free(closed);
  zs_eval_free(open);
  zs_arena_free(&arena);
}

static void test_formula(void **unused)
{
  (void)unused;
  zs_arena arena = {0};
  zs_node *node = node_named(&arena, "formula");
  set_formula(&arena, node, "formula", "let r = hypot(x, y); 0.25 - hypot(r - 1, z)");
  zs_eval *formula = compiled(node), *torus = compiled(node_named(&arena, "torus"));
  uint64_t state = 10;
  for (int i = 0; i < 1000; i++) {
    const double x = random_between(&state, -2, 2), y = random_between(&state, -2, 2);
    const double z = random_between(&state, -2, 2);
    NEAR(value_at(formula, x, y, z), value_at(torus, x, y, z));
  }
  zs_eval_free(formula);
  zs_eval_free(torus);
  zs_arena_free(&arena);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_round_primitives), cmocka_unit_test(test_cylinder_and_cone),
    cmocka_unit_test(test_flat_primitives),  cmocka_unit_test(test_ellipsoid),
    cmocka_unit_test(test_gyroid),           cmocka_unit_test(test_shapes),
    cmocka_unit_test(test_extrude),          cmocka_unit_test(test_revolve),
    cmocka_unit_test(test_interpolate),      cmocka_unit_test(test_formula),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
