/* Maps and blends of values: bounded-blend, ricci, pinch, normalize, noise. */
#include "laws.h"

static zs_node *formula(zs_arena *arena, const char *text)
{
  return set_formula(arena, node_named(arena, "formula"), "formula", text);
}

static const char *const A_TEXT = "1 - x^2 - y^2 - z^2", *const B_TEXT = "0.4 - x + 0.3 * z";

/* ---- bounded-blend --------------------------------------------------------------- */

static zs_node *bounded(zs_arena *arena, const char *operation, double a0, zs_node *bound)
{
  zs_node *node = choose(node_named(arena, "bounded-blend"), "operation", operation);
  set(set(set(set(node, "a0", a0), "a1", 0.8), "a2", 1.2), "a3", 0.6);
  adopt(arena, adopt(arena, node, formula(arena, A_TEXT)), formula(arena, B_TEXT));
  return adopt(arena, node, bound);
}

static zs_node *joined(zs_arena *arena, const char *operation)
{
  zs_node *node = choose(node_named(arena, operation), "r-function", "r0");
  return adopt(arena, adopt(arena, node, formula(arena, A_TEXT)), formula(arena, B_TEXT));
}

static void test_bounded_blend(void **unused)
{
  (void)unused;
  static const char *const operations[] = {"union", "intersection", "difference"};
  uint64_t state = 4;
  for (int o = 0; o < 3; o++) {
    zs_arena arena = {0}, *A = &arena;
    zs_node *bound = node_named(A, "sphere");
    check_law(EQUAL, "no displacement", bounded(A, operations[o], 0, bound),
              joined(A, operations[o]));
    check_law(EQUAL, "bounded by nothing", bounded(A, operations[o], 0.7, node_named(A, "empty")),
              joined(A, operations[o]));
    zs_eval *eval = compiled(bounded(A, operations[o], 0.7, bound));
    zs_eval *plain = compiled(joined(A, operations[o])), *third = compiled(bound);
    zs_eval *first = compiled(formula(A, A_TEXT)), *second = compiled(formula(A, B_TEXT));
    for (int i = 0; i < 1000; i++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = random_between(&state, -1.5, 1.5);
      const double f3 = zs_eval_point(third, p), r1 = hypot(zs_eval_point(first, p) / 0.8,
                                                            zs_eval_point(second, p) / 1.2);
      const double r2 = f3 > 0 ? f3 / 0.6 : 0;
      const double r = r2 > 0 ? r1 * r1 / (r1 * r1 + r2 * r2) : 1;
      const double expected = r < 1 ? 0.7 * pow(1 - r, 3) / (1 + r) : 0;
      assert_true(fabs(zs_eval_point(eval, p) - zs_eval_point(plain, p) - expected) < 1e-12);
    }
    zs_eval_free(eval);
    zs_eval_free(plain);
    zs_eval_free(third);
    zs_eval_free(first);
    zs_eval_free(second);
    zs_node *other = formula(A, "x - 1");
    zs_node *both = adopt(A, adopt(A, node_named(A, "union"), bound), other);
    check_law(EQUAL, "more than three", adopt(A, bounded(A, operations[o], 0.7, bound), other),
              bounded(A, operations[o], 0.7, both));
    zs_node *few = node_named(A, "bounded-blend");
    expect_refused(adopt(A, adopt(A, few, bound), bound));
    zs_arena_free(&arena);
  }
}

/* On the curve where both operands are 0 nothing is added outside of the bounding solid, and
 * everything inside. */
static void test_bounded_blend_edge(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *node = node_named(A, "bounded-blend");
  adopt(A, adopt(A, adopt(A, node, formula(A, "x")), formula(A, "y")), formula(A, "z"));
  zs_eval *eval = compiled(node);
  assert_true(value_at(eval, 0, 0, 0.1) == 0.5);
  assert_true(value_at(eval, 0, 0, -0.1) == 0);
  assert_true(value_at(eval, 0, 0, 0) == 0);
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

/* ---- ricci -------------------------------------------------------------------------- */

static zs_node *ricci(zs_arena *arena, double exponent, double threshold, zs_node *a, zs_node *b,
                      zs_node *c)
{
  zs_node *node = set(node_named(arena, "ricci"), "exponent", exponent);
  set(node, "threshold", threshold);
  return adopt(arena, adopt(arena, adopt(arena, node, a), b), c);
}

static void test_ricci(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *a = node_named(A, "sphere"), *b = formula(A, "0.5 - abs(x)"), *c = formula(A, "y - 1");
  zs_node *all = adopt(A, adopt(A, adopt(A, node_named(A, "union"), a), b), c);
  check_law(EQUAL, "p-norms", ricci(A, 3, 0.6, a, b, c),
            formula(A, "let a = 1 - sqrt(x^2 + y^2 + z^2); let b = 0.5 - abs(x); let c = y - 1;"
                       "let g = max(a + 0.6, 0); let h = max(b + 0.6, 0); let k = max(c + 0.6, 0);"
                       "let n = (g^3 + h^3 + k^3)^(1/3); n > 0 ? n - 0.6 : max(a, max(b, c))"));
  check_law(EQUAL, "the order does not matter", ricci(A, 2.5, 0.4, a, b, c),
            ricci(A, 2.5, 0.4, c, a, b));
  zs_eval *eval = compiled(ricci(A, 1000, 0.5, a, b, c)), *sharp = compiled(all);
  uint64_t state = 6;
  for (int i = 0; i < 1000; i++) {
    double p[3];
    for (int k = 0; k < 3; k++)
      p[k] = random_between(&state, -2, 2);
    const double f = zs_eval_point(eval, p), g = zs_eval_point(sharp, p);
    assert_true(f >= g && f - g < 2e-3 * (0.5 + fabs(g)));
  }
  zs_eval_free(eval);
  zs_eval_free(sharp);
  zs_arena_free(&arena);
}

/* ---- pinch ---------------------------------------------------------------------------- */

static zs_node *pinch_point(zs_arena *arena, zs_node *pinch, double x, double y, double z,
                            double radius)
{
  zs_node *part = set3(node_of_kind(arena, pinch->kind->parts[0]), "at", x, y, z);
  adopt(arena, pinch, set(part, "radius", radius));
  return part;
}

static void test_pinch(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *pinch = node_named(A, "pinch");
  set(pinch_point(A, pinch, 1, 0, 0, 0.5), "value", 0.3);
  set(pinch_point(A, pinch, 0, 1, 0, 2), "value", -0.2);
  check_law(EQUAL, "the sum of what is taken", wrap(A, pinch, node_named(A, "sphere")),
            formula(A, "1 - sqrt(x^2 + y^2 + z^2) - 0.3 / (1 + ((x - 1)^2 + y^2 + z^2) / 0.25)"
                       "+ 0.2 / (1 + (x^2 + (y - 1)^2 + z^2) / 4)"));
  /* The surface comes to points outside and inside, in the node's own coordinates. */
  static const double points[][3] = {{1.4, 0.2, 0}, {0.5, -0.3, 0.1}};
  for (int i = 0; i < 2; i++) {
    zs_node *through = node_named(A, "pinch");
    pinch_point(A, through, points[i][0], points[i][1], points[i][2], 0.3);
    zs_node *moved = set3(node_named(A, "translate"), "by", 5, 6, 7);
    zs_eval *eval = compiled(wrap(A, moved, wrap(A, through, node_named(A, "sphere"))));
    assert_true(fabs(value_at(eval, points[i][0] + 5, points[i][1] + 6, points[i][2] + 7)) < 1e-12);
    zs_eval_free(eval);
  }
  zs_arena_free(&arena);
}

/* ---- normalize ------------------------------------------------------------------------- */

static void test_normalize(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  /* 7 (1 - x^2 / 4 - y^2 - z^2), by its own derivatives; differences of squares are exact. */
  zs_node *steep = formula(A, "7 * (1 - x^2 / 4 - y^2 - z^2)");
  check_law(EQUAL, "Rvachev's normalization", wrap(A, node_named(A, "normalize"), steep),
            formula(A, "let f = 7 * (1 - x^2 / 4 - y^2 - z^2);"
                       "f / sqrt(f^2 + (3.5 * x)^2 + (14 * y)^2 + (14 * z)^2)"));
  check_law(SAME_SIGN, "the same solid", wrap(A, node_named(A, "normalize"), steep), steep);
  zs_arena_free(&arena);
}

/* ---- noise ------------------------------------------------------------------------------ */

static zs_node *noisy(zs_arena *arena, double octaves, double gain)
{
  zs_node *node = set(set(node_named(arena, "noise"), "octaves", octaves), "gain", gain);
  set(set(set(node, "amplitude", 0.3), "frequency", 0.7), "phase", 50);
  return wrap(arena, node, formula(arena, "0"));
}

static void test_noise(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  const double k = 2 * 3.14159265358979323846 * 0.7, phase = 50 * 3.14159265358979323846 / 180;
  zs_eval *one = compiled(noisy(A, 1, 0.5)), *two = compiled(noisy(A, 2, 0.5));
  uint64_t state = 10;
  double largest = 0;
  for (int i = 0; i < 2000; i++) {
    double p[3], product = 1;
    for (int j = 0; j < 3; j++)
      p[j] = random_between(&state, -5, 5);
    for (int j = 0; j < 3; j++) /* x with z, y with x, z with y */
      product *= sin(k * p[j]) + sin(k * p[j] / 1.35 + phase * sin(k * p[(j + 2) % 3])) / 1.17;
    const double expected = 0.3 * product / pow(1 + 1 / 1.17, 3);
    const double f = zs_eval_point(one, p);
    assert_true(fabs(f - expected) < 1e-12);
    const double finer = value_at(one, 2 * p[0], 2 * p[1], 2 * p[2]);
    assert_true(fabs(zs_eval_point(two, p) - (f + finer / 2) / 1.5) < 1e-12);
    largest = fmax(largest, fabs(f));
  }
  assert_true(largest > 0.15 && largest <= 0.3);
  zs_eval_free(one);
  zs_eval_free(two);
  zs_arena_free(&arena);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_bounded_blend), cmocka_unit_test(test_bounded_blend_edge),
    cmocka_unit_test(test_ricci),         cmocka_unit_test(test_pinch),
    cmocka_unit_test(test_normalize),     cmocka_unit_test(test_noise),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
