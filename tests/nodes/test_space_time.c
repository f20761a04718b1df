/* Space-time blends: shapes at the ends of time, half-cylinders, what is added, bad input. */
#include "../random.h"
#include "scene_text.h"

#include <math.h>

#define DOMAIN "<domain min='-9 -9 -20' max='9 9 20'/>"

/* Shapes whose values are distances, and some whose are not. */
static const char *const shapes[] = {
  "<circle radius='2' at='-1 0 0'/>", "<rectangle size='3 5' rotate='0 0 20'/>",
  "<formula>4 - x^2 - 2*y^2 + x*y</formula>", "<formula>3 * (2 - abs(x - 3) - abs(y))</formula>"};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static zs_eval *load(const char *body)
{
  zs_field *field = compile(body);
  zs_eval *eval = evaluator(field);
  zs_field_unref(field);
  return eval;
}

static zs_eval *load_shape(int i)
{
  char text[400];
  snprintf(text, sizeof text, DOMAIN "%s", shapes[i]);
  return load(text);
}

static zs_eval *load_blend(const char *attributes, int first, int second, const char *more)
{
  char text[1000];
  snprintf(text, sizeof text, DOMAIN "<space-time-blend %s>%s%s%s</space-time-blend>", attributes,
           shapes[first], shapes[second], more);
  return load(text);
}

static double f(zs_eval *eval, double x, double y, double z)
{
  return zs_eval_point(eval, (const double[3]){x, y, z});
}

/* ---- The formulas, as they are written in the paper ------------------------------------- */

static double conjunction(double a, double b)
{
  return a + b - sqrt(a * a + b * b);
}

static double disjunction(double a, double b)
{
  return a + b + sqrt(a * a + b * b);
}

static double displacement(double a0, double r1, double r2)
{
  const double r = r2 > 0 ? r1 * r1 / (r1 * r1 + r2 * r2) : 1;
  return r < 1 ? a0 * pow(1 - r, 3) / (1 + r) : 0;
}

/* c - t with poles of second order at both ends, and slope -1 at c. */
static double half_space(double min, double c, double max, double t)
{
  const double a = c - min, b = max - c;
  return a * b / (2 * (a + b)) * (pow(a / (t - min), 2) - pow(b / (max - t), 2));
}

typedef struct numbers {
  double min, max, a0, a1, a2, a3, b0;
} numbers;

/* For times not very near to the ends. */
static double definition(const numbers *n, double f1, double f2, double t, double bound)
{
  const double h1 = half_space(n->min, 0, n->max, t), h2 = -half_space(n->min, 1, n->max, t);
  double g1 = conjunction(f1, h1), g2 = conjunction(f2, h2);
  g1 += displacement(n->b0, hypot(f1 / n->a1, h1 / n->a3), fmax(t - n->min / 2, 0) / n->a3);
  g2 += displacement(n->b0, hypot(f2 / n->a2, h2 / n->a3), fmax((n->max + 1) / 2 - t, 0) / n->a3);
  const double f3 = fmin(conjunction(t - n->min, n->max - t), bound);
  return disjunction(g1, g2) +
         displacement(n->a0, hypot(g1 / n->a1, g2 / n->a2), fmax(f3, 0) / n->a3);
}

static void test_definition(void **unused)
{
  (void)unused;
  uint64_t state = 5;
  for (int i = 0; i < 60; i++) {
    const numbers n = {random_between(&state, -12, -1), random_between(&state, 2, 12),
                       random_between(&state, -1, 3),   random_between(&state, 0.3, 2),
                       random_between(&state, 0.3, 2),  random_between(&state, 0.3, 2),
                       i % 3 ? 0 : random_between(&state, -1, 0.5)};
    const double t = random_between(&state, n.min * 0.97, n.max * 0.97);
    const int one = i % SHAPES, two = (i / SHAPES) % SHAPES;
    char attributes[400], cut[300];
    snprintf(attributes, sizeof attributes,
             "time='%.17g' min='%.17g' max='%.17g' a0='%.17g' a1='%.17g' a2='%.17g' a3='%.17g' "
             "b0='%.17g'", t, n.min, n.max, n.a0, n.a1, n.a2, n.a3, n.b0);
    snprintf(cut, sizeof cut, "<circle radius='1' at='0 4 0'/><half-plane normal='-1 0'/>");
    zs_eval *eval = load_blend(attributes, one, two, i % 2 ? cut : "");
    zs_eval *first = load_shape(one), *second = load_shape(two);
    for (int j = 0; j < 100; j++) {
      const double x = random_between(&state, -6, 6), y = random_between(&state, -6, 6);
      const double z = random_between(&state, -15, 15);
      const double bound = i % 2 ? fmax(1 - hypot(x, y - 4), x) : INFINITY;
      const double expected = definition(&n, f(first, x, y, 0), f(second, x, y, 0), t, bound);
      const double found = f(eval, x, y, z);
      if (!(fabs(found - expected) < 1e-6 * (1 + fabs(expected))))
        fail_msg("%s at %g %g: %.12g instead of %.12g", attributes, x, y, found, expected);
    }
    zs_eval_free(eval);
    zs_eval_free(first);
    zs_eval_free(second);
  }
}

/* ---- Ends ---------------------------------------------------------------------------------- */

/* At and beyond the ends of time f is that of a child, in double and in blocks, for any
 * displacement; there it begins to change slowly. */
static void test_ends(void **unused)
{
  (void)unused;
  static const char *const how[] = {"", "a0='6' a3='0.1'", "a0='-2' b0='-0.7'", "a0='3' b0='1'"};
  uint64_t state = 6;
  for (int i = 0; i < 4 * SHAPES * SHAPES; i++) {
    const int one = i % SHAPES, two = i / SHAPES % SHAPES;
    zs_eval *shape[2] = {load_shape(one), load_shape(two)};
    for (int k = 0; k < 4; k++) {
      static const double times[] = {-4, 7, -40, 70};
      char attributes[200];
      snprintf(attributes, sizeof attributes, "time='%g' min='-4' max='7' %s", times[k],
               how[i / SHAPES / SHAPES]);
      zs_eval *eval = load_blend(attributes, one, two, "");
      for (int j = 0; j < 50; j++) {
        const float x = (float)random_between(&state, -8, 8);
        const float y = (float)random_between(&state, -8, 8), z = 0;
        float value;
        const double expected = f(shape[k % 2], (double)x, (double)y, 0);
        zs_eval_values(eval, NULL, 1, &x, &y, &z, &value);
        const double tolerance = 1e-11 * (1 + expected * expected);
        if (!(fabs(f(eval, (double)x, (double)y, 0) - expected) < tolerance) ||
            !(fabs((double)value - expected) < 1e-5 * (1 + fabs(expected))))
          fail_msg("%s at %g %g: %.12g instead of %.12g", attributes, (double)x, (double)y,
                   f(eval, (double)x, (double)y, 0), expected);
      }
      zs_eval_free(eval);
    }
    zs_eval_free(shape[0]);
    zs_eval_free(shape[1]);
  }
}

/* Along z it is the same solid, cut at the ends. */
static void test_along_z(void **unused)
{
  (void)unused;
  uint64_t state = 7;
  zs_eval *whole = load_blend("min='-3' max='5' a0='2' b0='-0.3'", 0, 3, "");
  for (int i = 0; i < 60; i++) {
    const double t = random_between(&state, -4, 6);
    char attributes[100];
    snprintf(attributes, sizeof attributes, "min='-3' max='5' a0='2' b0='-0.3' time='%.17g'", t);
    zs_eval *frame = load_blend(attributes, 0, 3, "");
    for (int j = 0; j < 20; j++) {
      const double x = random_between(&state, -6, 6), y = random_between(&state, -6, 6);
      const double slab = fmin(t + 3, 5 - t) + 5 * 2.5e-7; /* its ends are inside however rounded */
      const double expected = fmin(f(frame, x, y, 0), slab);
      assert_true(fabs(f(whole, x, y, t) - expected) < 1e-9 * (1 + fabs(expected)));
    }
    zs_eval_free(frame);
  }
  zs_eval_free(whole);
}

/* ---- Between ------------------------------------------------------------------------------- */

/* With nothing added the solid is the two half-cylinders; what is added is between 0 and a0,
 * and lets shapes that have no point in common join. */
static void test_half_cylinders(void **unused)
{
  (void)unused;
  uint64_t state = 8;
  zs_eval *plain = load_blend("a0='0'", 0, 3, ""), *more = load_blend("a0='5'", 0, 3, "");
  zs_eval *first = load_shape(0), *second = load_shape(3);
  int raised = 0, joined = 0;
  for (int i = 0; i < 20000; i++) {
    const double x = random_between(&state, -4, 6), y = random_between(&state, -4, 4);
    const double t = i % 2 ? random_between(&state, -9.9, 9.9) : random_between(&state, -0.5, 1.5);
    const bool inside = (t <= 0 && f(first, x, y, 0) >= 0) || (t >= 1 && f(second, x, y, 0) >= 0);
    const double f0 = f(plain, x, y, t), f5 = f(more, x, y, t);
    if ((f0 >= 0) != inside && fabs(f0) > 1e-12)
      fail_msg("%g at %g %g %g", f0, x, y, t);
    assert_true(f5 - f0 >= 0 && f5 - f0 <= 5 + 1e-12);
    raised += f5 - f0 > 0.1;
    joined += t > 0 && t < 1 && f5 >= 0;
  }
  assert_true(raised > 1000 && joined > 300);
  zs_eval_free(plain);
  zs_eval_free(more);
  zs_eval_free(first);
  zs_eval_free(second);
}

/* As a method of <interpolate>: levels 20 apart are the paper's own times. */
static void test_interpolated(void **unused)
{
  (void)unused;
  uint64_t state = 9;
  static const char *const given[][2] = {
    {"", "a0='2'"}, {"a0='0.7' a2='3' b0='-0.4'", "a0='0.7' a2='3' b0='-0.4'"}};
  for (int i = 0; i < 2; i++) {
    char text[800], attributes[200];
    snprintf(text, sizeof text,
             DOMAIN "<interpolate method='space-time'><level at='-9.5'>%s</level><between %s/>"
             "<level at='10.5'>%s</level></interpolate>", shapes[0], given[i][0], shapes[2]);
    snprintf(attributes, sizeof attributes, "min='-9.5' max='10.5' %s", given[i][1]);
    zs_eval *interpolated = load(text), *blend = load_blend(attributes, 0, 2, "");
    for (int j = 0; j < 1000; j++) {
      const double x = random_between(&state, -6, 6), y = random_between(&state, -6, 6);
      const double z = random_between(&state, -11, 11), expected = f(blend, x, y, z);
      if (!(fabs(f(interpolated, x, y, z) - expected) < 1e-9 * (1 + fabs(expected))))
        fail_msg("%s at %g %g %g: %.12g, %.12g", given[i][0], x, y, z, f(interpolated, x, y, z),
                 expected);
    }
    zs_eval_free(interpolated);
    zs_eval_free(blend);
  }
}

/* ---- Bad input ------------------------------------------------------------------------------ */

#define BLEND(attributes, children) \
  "<space-time-blend " attributes ">" children "</space-time-blend>"
#define METHOD(method, attributes) \
  "<interpolate method='" method "'><level at='0'><circle/></level><between " attributes "/>" \
  "<level at='1'><circle/></level></interpolate>"

static void test_bad_input(void **unused)
{
  (void)unused;
  refuses(BLEND("", "<circle/>"), "expected at least two");
  refuses(BLEND("min='0'", "<circle/><circle/>"), "'0'");
  refuses(BLEND("max='1'", "<circle/><circle/>"), "'1'");
  refuses(BLEND("a1='0'", "<circle/><circle/>"), "expected a length > 0");
  refuses(BLEND("time='now'", "<circle/><circle/>"), "'now'");
  refuses(METHOD("extended", "a0='1'"), "'a0' has a meaning with method=\"space-time\" only");
  refuses(METHOD("linear", "b0='1'"), "'b0' has a meaning");
  refuses(METHOD("space-time", "weight='smoothstep'"), "cannot be combined");
  refuses(METHOD("space-time", "a3='-1'"), "'-1'");
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_definition), cmocka_unit_test(test_ends),
    cmocka_unit_test(test_along_z),    cmocka_unit_test(test_half_cylinders),
    cmocka_unit_test(test_interpolated), cmocka_unit_test(test_bad_input),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
