/* Primitives of few parameters: superellipsoid, quadric, convex. */
#include "laws.h"

static zs_node *formula(zs_arena *arena, const char *text)
{
  return set_formula(arena, node_named(arena, "formula"), "formula", text);
}

static zs_node *superellipsoid(zs_arena *arena, double e1, double e2)
{
  return set(set(node_named(arena, "superellipsoid"), "e1", e1), "e2", e2);
}

static void test_superellipsoid(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  check_law(EQUAL, "exponents 1", set3(superellipsoid(A, 1, 1), "radii", 1, 1.5, 0.7),
            set3(node_named(A, "ellipsoid"), "radii", 1, 1.5, 0.7));
  check_law(EQUAL, "exponents 2: an octahedron", superellipsoid(A, 2, 2),
            formula(A, "1 - abs(x) - abs(y) - abs(z)"));
  check_law(EQUAL, "Barr's formula", set3(superellipsoid(A, 0.5, 1.6), "radii", 1, 1.4, 0.8),
            formula(A, "let s = abs(x)^(2/1.6) + abs(y/1.4)^(2/1.6);"
                       "0.8 * (1 - (s^(1.6/0.5) + abs(z/0.8)^(2/0.5))^(0.5/2))"));
  check_law(EQUAL, "pinched", superellipsoid(A, 3, 2.5),
            formula(A, "let s = abs(x)^(2/2.5) + abs(y)^(2/2.5);"
                       "1 - (s^(2.5/3) + abs(z)^(2/3))^(3/2)"));
  /* The smallest exponents: 200-norms, a box but for a hundredth, and no overflow. */
  zs_eval *eval = compiled(superellipsoid(A, 0.01, 0.01));
  uint64_t state = 8;
  for (int i = 0; i < 1000; i++) {
    const float x = (float)random_between(&state, -50, 50);
    const float y = (float)random_between(&state, -5, 5);
    const float z = (float)random_between(&state, -3, 3);
    float f;
    zs_eval_values(eval, NULL, 1, &x, &y, &z, &f);
    const double cube = 1 - fmax(fabs(x), fmax(fabs(y), fabs(z)));
    assert_true(f <= cube + 1e-5 && f >= cube - 0.01 * (1 - cube));
  }
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

/* Never more than the distance while no exponent is above 1: f changes by no more than one
 * goes. */
static void test_superellipsoid_bound(void **unused)
{
  (void)unused;
  uint64_t state = 2;
  for (int t = 0; t < 40; t++) {
    zs_arena arena = {0};
    zs_node *node = superellipsoid(&arena, random_between(&state, 0.01, 1),
                                   random_between(&state, 0.01, 1));
    set3(node, "radii", random_between(&state, 0.3, 2), random_between(&state, 0.3, 2),
         random_between(&state, 0.3, 2));
    zs_eval *eval = compiled(node);
    for (int i = 0; i < 300; i++) {
      double p[3], q[3], d = 0;
      for (int k = 0; k < 3; k++) {
        p[k] = random_between(&state, -3, 3);
        q[k] = p[k] + random_between(&state, -0.1, 0.1);
        d = hypot(d, q[k] - p[k]);
      }
      assert_true(fabs(zs_eval_point(eval, p) - zs_eval_point(eval, q)) <= d * (1 + 1e-9));
    }
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

static void test_quadric(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *ball = set(set3(node_named(A, "quadric"), "squares", -1, -1, -1), "constant", 1);
  check_law(SAME_SIGN, "a ball", ball, node_named(A, "sphere"));
  zs_node *all = set3(set3(node_named(A, "quadric"), "squares", 1, -2, 3), "products", 4, -5, 6);
  check_law(EQUAL, "every factor", set(set3(all, "linear", -7, 8, 9), "constant", 2),
            formula(A, "x^2 - 2*y^2 + 3*z^2 + 4*x*y - 5*y*z + 6*z*x - 7*x + 8*y + 9*z + 2"));
  expect_refused(set(node_named(A, "quadric"), "constant", 1));
  zs_arena_free(&arena);
}

static zs_node *plane(zs_arena *arena, zs_node *convex, double x, double y, double z,
                      double distance)
{
  zs_node *part = set3(node_of_kind(arena, convex->kind->parts[0]), "normal", x, y, z);
  set(part, "distance", distance);
  assert_true(part->kind->check(part, NULL));
  return adopt(arena, convex, part);
}

static void test_convex(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *octahedron = node_named(A, "convex");
  for (int i = 0; i < 8; i++)
    plane(A, octahedron, i & 1 ? 2 : -2, i & 2 ? 2 : -2, i & 4 ? 2 : -2, 1 / sqrt(3));
  check_law(EQUAL, "an octahedron", octahedron,
            formula(A, "(1 - abs(x) - abs(y) - abs(z)) / sqrt(3)"));
  /* By points, any of the plane. */
  zs_node *box = node_named(A, "convex");
  for (int i = 0; i < 6; i++) {
    double n[3] = {0}, p[3] = {0.3, -5, 2};
    n[i / 2] = i % 2 ? 1 : -1;
    p[i / 2] = n[i / 2] * (0.5 + i / 2);
    zs_node *part = node_of_kind(A, box->kind->parts[0]);
    adopt(A, box, set_vector(set_vector(part, "normal", n), "point", p));
  }
  check_law(SAME_SIGN, "a box", box, set3(node_named(A, "box"), "size", 1, 3, 5));
  expect_refused(node_named(A, "convex"));
  expect_refused(set3(node_of_kind(A, box->kind->parts[0]), "normal", 0, 0, 0));
  expect_refused(set3(set(set3(node_of_kind(A, box->kind->parts[0]), "normal", 1, 0, 0),
                          "distance", 1), "point", 1, 0, 0));
  zs_arena_free(&arena);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_superellipsoid),
    cmocka_unit_test(test_superellipsoid_bound),
    cmocka_unit_test(test_quadric),
    cmocka_unit_test(test_convex),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
