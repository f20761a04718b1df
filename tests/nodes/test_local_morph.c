/* Local metamorphosis: schedules inside partitions, weights between them, bad input. */
#include "../random.h"
#include "scene_text.h"

#include <math.h>

#define DOMAIN "<domain min='-9 -9 -9' max='9 9 9'/>"
#define FIRST "<sphere radius='3'/>"
#define SECOND "<formula>4 - abs(x) - 2*y^2 - z</formula>"
#define THIRD "<box size='4 1 9'/>"

static zs_eval *load(const char *body)
{
  char text[4000];
  snprintf(text, sizeof text, DOMAIN "%s", body);
  zs_field *field = compile(text);
  zs_eval *eval = evaluator(field);
  zs_field_unref(field);
  return eval;
}

static zs_eval *load_morph(double time, const char *body)
{
  char text[3000];
  snprintf(text, sizeof text, "<local-morph time='%.17g'>%s</local-morph>", time, body);
  return load(text);
}

/* Spheres with schedules: three apart from each other, and one that overlaps the third. */
enum { PARTS = 4, APART = 3 };
static const struct {
  double x, y, radius, from, to;
  bool smooth;
} part[PARTS] = {{-5, 0, 1.5, 0, 1, false}, {4, 2, 1, 2, 3, true}, {0, -5, 1, 0.5, 4, false},
                 {1, -5, 1, 1, 2, false}};

static const char *parts_text(int count)
{
  static char text[1000];
  *text = 0;
  for (int i = 0; i < count; i++)
    snprintf(text + strlen(text), 200,
             "<part from='%g' to='%g' pace='%s'><sphere radius='%g' at='%g %g 0'/></part>",
             part[i].from, part[i].to, part[i].smooth ? "smoothstep" : "linear", part[i].radius,
             part[i].x, part[i].y);
  return text;
}

static double depth(int i, const double p[3])
{
  return part[i].radius - hypot(hypot(p[0] - part[i].x, p[1] - part[i].y), p[2]);
}

static double schedule(int i, double time)
{
  const double s = fmin(fmax((time - part[i].from) / (part[i].to - part[i].from), 0), 1);
  return part[i].smooth ? s * s * (3 - 2 * s) : s;
}

/* Inverse squares of distances outside, squares of depths inside. */
static double progress(int count, const double p[3], double time)
{
  double inside = 0, within = 0, outside = 0, beyond = 0;
  for (int i = 0; i < count; i++) {
    const double d = depth(i, p), w = d > 0 ? d * d : 1 / (d * d), s = schedule(i, time);
    *(d > 0 ? &inside : &outside) += w;
    *(d > 0 ? &within : &beyond) += w * s;
  }
  return inside > 0 ? within / inside : beyond / outside;
}

static void random_point(uint64_t *state, double p[3])
{
  for (int k = 0; k < 3; k++)
    p[k] = random_between(state, -7, 7);
}

static void test_definition(void **unused)
{
  (void)unused;
  uint64_t state = 3;
  zs_eval *first = load(FIRST), *second = load(SECOND);
  int overlapping = 0;
  for (int i = 0; i < 80; i++) {
    const int count = 1 + i % PARTS;
    const double time = random_between(&state, -0.5, 4.5);
    char body[2000];
    snprintf(body, sizeof body, FIRST SECOND "%s", parts_text(count));
    zs_eval *eval = load_morph(time, body);
    for (int j = 0; j < 200; j++) {
      double p[3];
      random_point(&state, p);
      if (j % 4 == 0 && count == PARTS) { /* where two overlap */
        p[0] = random_between(&state, 0.2, 0.8);
        p[1] = random_between(&state, -5.5, -4.5);
        p[2] = random_between(&state, -0.3, 0.3);
        overlapping += depth(2, p) > 0 && depth(3, p) > 0;
      }
      const double s = progress(count, p, time);
      const double expected = (1 - s) * zs_eval_point(first, p) + s * zs_eval_point(second, p);
      if (!(fabs(zs_eval_point(eval, p) - expected) < 1e-6 * (1 + fabs(expected))))
        fail_msg("%d parts, time %g, at %g %g %g: %.12g instead of %.12g", count, time, p[0], p[1],
                 p[2], zs_eval_point(eval, p), expected);
    }
    zs_eval_free(eval);
  }
  assert_true(overlapping > 100);
  zs_eval_free(first);
  zs_eval_free(second);
}

/* Inside a partition f is that of the first shape until its schedule begins and that of the
 * second once it has ended, whatever goes on elsewhere; before and after all of them it is so
 * everywhere. */
static void test_schedules(void **unused)
{
  (void)unused;
  uint64_t state = 4;
  zs_eval *shape[2] = {load(FIRST), load(SECOND)};
  for (int i = 0; i < APART; i++)
    for (int end = 0; end < 2; end++) {
      const double times[] = {end ? part[i].to : part[i].from,
                              end ? part[i].to + 0.7 : part[i].from - 0.7};
      for (int k = 0; k < 2; k++) {
        char body[2000];
        snprintf(body, sizeof body, FIRST SECOND "%s", parts_text(APART));
        zs_eval *eval = load_morph(times[k], body);
        for (int j = 0; j < 200; j++) {
          const double a = random_between(&state, 0, 6.28), r = random_between(&state, 0, 1);
          const float x = (float)(part[i].x + r * part[i].radius * cos(a));
          const float y = (float)(part[i].y + r * part[i].radius * sin(a)), z = 0;
          const double p[3] = {(double)x, (double)y, 0}, expected = zs_eval_point(shape[end], p);
          float f;
          if (depth(i, p) < 1e-6)
            continue;
          zs_eval_values(eval, NULL, 1, &x, &y, &z, &f);
          assert_true(fabs(zs_eval_point(eval, p) - expected) < 1e-9);
          assert_true(fabs((double)f - expected) < 1e-5 * (1 + fabs(expected)));
        }
        zs_eval_free(eval);
      }
    }
  for (int end = 0; end < 2; end++) {
    char body[2000];
    snprintf(body, sizeof body, FIRST SECOND "%s", parts_text(PARTS));
    zs_eval *eval = load_morph(end ? 4 : 0, body);
    for (int j = 0; j < 300; j++) {
      double p[3];
      random_point(&state, p);
      assert_true(zs_eval_point(eval, p) == zs_eval_point(shape[end], p));
    }
    zs_eval_free(eval);
  }
  zs_eval_free(shape[0]);
  zs_eval_free(shape[1]);
}

/* Across the surfaces of partitions apart nothing jumps, and neither does the slope; f is
 * between the two shapes' values everywhere. */
static void test_continuity(void **unused)
{
  (void)unused;
  uint64_t state = 5;
  char body[2000];
  snprintf(body, sizeof body, FIRST SECOND "%s", parts_text(APART));
  zs_eval *eval = load_morph(1.3, body), *first = load(FIRST), *second = load(SECOND);
  for (int j = 0; j < 600; j++) {
    const int i = j % APART;
    const double a = random_between(&state, 0, 6.28), h = 1e-5;
    double f[3];
    for (int k = 0; k < 3; k++) {
      const double r = part[i].radius + (k - 1) * h;
      f[k] = zs_eval_point(
        eval, (const double[3]){part[i].x + r * cos(a), part[i].y + r * sin(a), 0});
    }
    assert_true(fabs(f[2] - f[0]) < 100 * h);
    if (!(fabs(f[2] - 2 * f[1] + f[0]) < 0.01 * h))
      fail_msg("part %d, angle %g: slope jumps by %g", i, a, (f[2] - 2 * f[1] + f[0]) / h);
  }
  for (int j = 0; j < 2000; j++) {
    double p[3];
    random_point(&state, p);
    const double f1 = zs_eval_point(first, p), f2 = zs_eval_point(second, p);
    const double f = zs_eval_point(eval, p);
    assert_true(f >= fmin(f1, f2) - 1e-9 && f <= fmax(f1, f2) + 1e-9);
  }
  zs_eval_free(eval);
  zs_eval_free(first);
  zs_eval_free(second);
}

/* Boxes within a partition are known to be of one shape: their bounds are that shape's. */
static void test_bounds_inside(void **unused)
{
  (void)unused;
  char body[2000];
  snprintf(body, sizeof body, "<formula>-7</formula><formula>5</formula>%s", parts_text(APART));
  zs_eval *eval = load_morph(1, body); /* the first part has ended, the second not begun */
  static const double lo[2][3] = {{-5.4, -0.4, -0.4}, {3.7, 1.7, -0.3}};
  static const double hi[2][3] = {{-4.6, 0.4, 0.4}, {4.3, 2.3, 0.3}};
  float f_lo[2], f_hi[2];
  zs_eval_bounds(eval, 2, lo, hi, f_lo, f_hi);
  assert_true(f_lo[0] > 4.99f && f_hi[0] < 5.01f);
  assert_true(f_lo[1] > -7.01f && f_hi[1] < -6.99f);
  zs_eval_free(eval);
}

/* Three shapes: the second is met half-way.  Without parts all goes from 0 to 1. */
static void test_keys(void **unused)
{
  (void)unused;
  uint64_t state = 6;
  zs_eval *shape[3] = {load(FIRST), load(SECOND), load(THIRD)};
  for (int k = 0; k <= 4; k++)
    for (int parts = 0; parts < 2; parts++) {
      const double s = k / 4.0;
      zs_eval *eval = load_morph(
        parts ? 2 + 3 * s : s,
        parts ? FIRST "<part from='2' to='5'><sphere/></part>" SECOND THIRD : FIRST SECOND THIRD);
      for (int j = 0; j < 100; j++) {
        double p[3];
        random_point(&state, p);
        const int i = s < 0.5 ? 0 : 1;
        const double u = 2 * s - i;
        const double expected =
          (1 - u) * zs_eval_point(shape[i], p) + u * zs_eval_point(shape[i + 1], p);
        assert_true(fabs(zs_eval_point(eval, p) - expected) < 1e-9 * (1 + fabs(expected)));
      }
      zs_eval_free(eval);
    }
  for (int i = 0; i < 3; i++)
    zs_eval_free(shape[i]);
}

/* Solids without values that can be summed up: everything, nothing, and one twice. */
static void test_degenerate_parts(void **unused)
{
  (void)unused;
  static const struct {
    const char *parts;
    double expected;
  } cases[] = {
    {"<part from='0' to='1'><everything/></part><part from='9' to='10'><sphere/></part>", 1},
    {"<part from='0' to='1'><empty/></part><part from='9' to='10'><sphere/></part>", 0},
    {"<part from='0' to='1'><sphere/></part><part from='9' to='10'><sphere/></part>", 0.5},
    {"<part from='0' to='1'><empty/></part><part from='9' to='10'><empty/></part>", 0.5}};
  for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++) {
    char body[500];
    snprintf(body, sizeof body, "<formula>0</formula><formula>1</formula>%s", cases[i].parts);
    zs_eval *eval = load_morph(5, body);
    assert_true(fabs(zs_eval_point(eval, (const double[3]){3, 1, 2}) - cases[i].expected) < 1e-6);
    zs_eval_free(eval);
  }
}

static void test_bad_input(void **unused)
{
  (void)unused;
  refuses("<local-morph time='0'><sphere/></local-morph>", "expected at least two");
  refuses("<local-morph><sphere/><box size='1 1 1'/></local-morph>", "missing; expected a number");
  refuses("<local-morph time='0'><sphere/><sphere/><part from='1' to='1'><sphere/></part>"
          "</local-morph>", "'from'");
  refuses("<local-morph time='0'><sphere/><sphere/><part from='1' to='0'><sphere/></part>"
          "</local-morph>", "'from'");
  refuses("<local-morph time='0'><sphere/><sphere/><part/></local-morph>", "no node inside");
  refuses("<local-morph time='0'><sphere/><sphere/><part pace='fast'><sphere/></part>"
          "</local-morph>", "'fast'");
  refuses("<union><part><sphere/></part></union>", "only allowed in <local-morph>");
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_definition),    cmocka_unit_test(test_schedules),
    cmocka_unit_test(test_continuity),    cmocka_unit_test(test_bounds_inside),
    cmocka_unit_test(test_keys),          cmocka_unit_test(test_degenerate_parts),
    cmocka_unit_test(test_bad_input),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
