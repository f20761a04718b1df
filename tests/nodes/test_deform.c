/* Maps that deform space: bend, shear, stretch. */
#include "laws.h"

#include "nodes/extent.h"

static const double PI = 3.14159265358979323846;
static const char *const axes[] = {"x", "y", "z"};

/* A child whose value tells the place. */
static zs_node *telltale(zs_arena *arena)
{
  return set_formula(arena, node_named(arena, "formula"), "formula", "x + 7 * y - 30 * z");
}

static double told(const double p[3])
{
  return p[0] + 7 * p[1] - 30 * p[2];
}

static zs_node *bend(zs_arena *arena, int axis, int toward, double rate)
{
  zs_node *node = set(node_named(arena, "bend"), "rate", rate);
  return choose(choose(node, "axis", axes[axis]), "toward", axes[toward]);
}

/* Barr's forward map: from p, bent about the place `still` between lo and hi. */
static void bend_forward(const double p[3], int axis, int toward, double rate, double lo,
                         double hi, double still, double q[3])
{
  const double k = rate * PI / 180, place = fmin(fmax(p[axis], lo), hi);
  const double angle = k * (place - still), away = 1 / k - p[toward];
  memcpy(q, p, 3 * sizeof *q);
  q[axis] = still + away * sin(angle) + (p[axis] - place) * cos(angle);
  q[toward] = 1 / k - away * cos(angle) + (p[axis] - place) * sin(angle);
}

/* What was at a place is where the forward map takes it, for all axes, both sides, and
 * ranges before, about and behind the origin. */
static void test_bend_inverts(void **unused)
{
  (void)unused;
  static const double ranges[][3] = {{-1, 2, 0}, {0.5, 2, 0.5}, {-2, -1, -1}, {0, 9, 0}};
  uint64_t state = 3;
  for (int t = 0; t < 400; t++) {
    zs_arena arena = {0};
    const int axis = t % 3, toward = (axis + 1 + t / 3 % 2) % 3;
    const double *range = ranges[t / 6 % 4];
    double rate = random_between(&state, 1, range[1] > 5 ? 39 : 80);
    rate *= random_below(&state, 2) ? 1 : -1;
    zs_node *node = bend(&arena, axis, toward, rate);
    set(set(node, "min", range[0]), "max", range[1]);
    assert_true(node->kind->check(node, NULL));
    double p[3], q[3];
    for (int k = 0; k < 3; k++)
      p[k] = random_between(&state, -0.5, 0.5);
    p[axis] = random_between(&state, range[0] - 0.3, range[1] + 0.3);
    bend_forward(p, axis, toward, rate, range[0], range[1], range[2], q);
    zs_eval *eval = compiled(wrap(&arena, node, telltale(&arena)));
    const double f = zs_eval_point(eval, q);
    if (fabs(f - told(p)) > 1e-10 * (1 + fabs(180 / (PI * rate))))
      fail_msg("axis %d toward %d, rate %g, %g to %g: %.15g for %.15g", axis, toward, rate,
               range[0], range[1], f, told(p));
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

static void test_bend_limits(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *solid = set3(node_named(A, "box"), "size", 2, 1, 3);
  check_law(EQUAL, "no bend", wrap(A, bend(A, 2, 0, 0), solid), solid);
  check_law(EQUAL, "next to no bend", wrap(A, bend(A, 2, 0, 1e-300), solid), solid);
  check_law(EQUAL, "the other side",
            wrap(A, bend(A, 2, 0, -20), solid),
            wrap(A, set3(node_named(A, "mirror"), "normal", 1, 0, 0),
                 wrap(A, bend(A, 2, 0, 20),
                      wrap(A, set3(node_named(A, "mirror"), "normal", 1, 0, 0), solid))));
  /* A rod of the right length closes to a ring. */
  const double radius = 1.25, middle[3] = {radius, 0, 0};
  zs_node *rod = set(node_named(A, "cylinder"), "radius", 0.4);
  zs_node *ring = set(set(node_named(A, "torus"), "radius", radius), "tube", 0.4);
  zs_node *moved = set3(node_named(A, "translate"), "by", middle[0], middle[1], middle[2]);
  check_law(EQUAL, "a rod becomes a ring", wrap(A, bend(A, 2, 0, 180 / (PI * radius)), rod),
            wrap(A, moved, wrap(A, set(choose(node_named(A, "rotate"), "axis", "x"), "angle", 90),
                                ring)));
  zs_arena_free(&arena);
}

/* Nearly straight bends lose nothing in single precision: their centres are far away. */
static void test_bend_precision(void **unused)
{
  (void)unused;
  uint64_t state = 9;
  for (double rate = 1e-6; rate < 10; rate *= 10) {
    zs_arena arena = {0};
    zs_node *solid = set3(node_named(&arena, "box"), "size", 2, 1, 3);
    zs_node *node = set(set(bend(&arena, 2, 0, rate), "min", -1), "max", 1);
    zs_eval *eval = compiled(wrap(&arena, node, solid));
    for (int i = 0; i < 200; i++) {
      const float x = (float)random_between(&state, -2, 2);
      const float z = (float)random_between(&state, -2, 2);
      float f;
      zs_eval_values(eval, NULL, 1, &x, &x, &z, &f);
      assert_true(fabs(f - value_at(eval, x, x, z)) < 3e-6);
    }
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

/* The box of the bent solid holds it, and not much more. */
static void test_bend_box(void **unused)
{
  (void)unused;
  uint64_t state = 5;
  for (int t = 0; t < 60; t++) {
    zs_arena arena = {0};
    zs_node *solid = set3(node_named(&arena, "box"), "size", 0.6, 0.8, 3);
    const double rate = random_between(&state, 5, 60) * (t % 2 ? 1 : -1);
    zs_node *node = bend(&arena, 2, 0, rate);
    if (t % 3)
      set(set(node, "min", random_between(&state, -2, 0.2)), "max", random_between(&state, 0.3, 2));
    const zs_box child = {{-0.3, -0.4, -1.5}, {0.3, 0.4, 1.5}};
    const zs_box box = node->kind->box(node, &child, 1);
    zs_eval *eval = compiled(wrap(&arena, node, solid));
    double lo[3] = {9, 9, 9}, hi[3] = {-9, -9, -9};
    for (int i = 0; i < 20000; i++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = random_between(&state, -2.5, 2.5);
      if (zs_eval_point(eval, p) < 0)
        continue;
      for (int k = 0; k < 3; k++) {
        assert_true(p[k] >= box.lo[k] - 1e-9 && p[k] <= box.hi[k] + 1e-9);
        lo[k] = fmin(lo[k], p[k]);
        hi[k] = fmax(hi[k], p[k]);
      }
    }
    for (int k = 0; k < 3; k++)
      assert_true(lo[k] < box.lo[k] + 0.3 && hi[k] > box.hi[k] - 0.3);
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

static void test_shear(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *solid = node_named(A, "torus");
  /* The same as a matrix, its factor included. */
  static const double values[] = {1, 1.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  zs_node *matrix = set_numbers(A, node_named(A, "matrix"), "values", values, 12);
  zs_node *shear = choose(set(node_named(A, "shear"), "by", 1.5), "axis", "y");
  check_law(EQUAL, "a shear is a matrix", wrap(A, shear, solid), wrap(A, matrix, solid));
  for (int axis = 0; axis < 3; axis++)
    for (int toward = 0; toward < 3; toward++) {
      zs_node *there = choose(choose(set(node_named(A, "shear"), "by", 0.7), "axis", axes[axis]),
                              "toward", axes[toward]);
      zs_node *back = choose(choose(set(node_named(A, "shear"), "by", -0.7), "axis", axes[axis]),
                             "toward", axes[toward]);
      if (axis == toward)
        expect_refused(there);
      else
        check_law(SAME_SIGN, "shear", wrap(A, back, wrap(A, there, solid)), solid);
    }
  zs_arena_free(&arena);
}

static void test_stretch(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *solid = set3(node_named(A, "box"), "size", 1, 0.5, 0.8);
  zs_node *stretch = set3(set3(node_named(A, "stretch"), "by", 2, 0.5, -1.5), "about", 0.1, 0.2, 3);
  zs_node *scale = set3(set3(node_named(A, "scale"), "by", 2, 0.5, -1.5), "about", 0.1, 0.2, 3);
  zs_node *factor = set(node_named(A, "scale-value"), "by", 0.5);
  zs_node *move = set3(node_named(A, "translate"), "by", 0, 0, -7.5);
  check_law(EQUAL, "a stretch scales and keeps values",
            wrap(A, move, wrap(A, factor, wrap(A, stretch, solid))),
            wrap(A, move, wrap(A, scale, solid)));
  zs_arena_free(&arena);
}

static void test_refused(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  expect_refused(bend(A, 2, 2, 10));
  expect_refused(bend(A, 0, 0, 10));
  expect_refused(set(set(bend(A, 2, 0, 10), "min", 1), "max", 1));
  expect_refused(set(set(bend(A, 2, 0, 10), "min", 0), "max", 37));
  expect_refused(set(bend(A, 2, 0, 10), "max", 19));
  zs_node *alone = choose(set(node_named(A, "bend"), "rate", 10), "axis", "x");
  assert_true(alone->kind->check(alone, NULL)); /* toward z */
  zs_arena_free(&arena);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_bend_inverts),   cmocka_unit_test(test_bend_limits),
    cmocka_unit_test(test_bend_precision), cmocka_unit_test(test_bend_box),
    cmocka_unit_test(test_shear),          cmocka_unit_test(test_stretch),
    cmocka_unit_test(test_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
