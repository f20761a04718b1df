/* minkowski-morph: ends, exact polygons wherever they are put, samples against closed forms. */
#include "../random.h"
#include "laws.h"
#include "scene_text.h"

#include <stdio.h>

#define MORPH(time, more, inside) \
  "<minkowski-morph time='" time "' " more ">" inside "</minkowski-morph>"

/* f of two scenes at random points of a box differs by `tolerance` at most, where it is as near to
 * the surface as `near`. */
static void check_same(const char *one, const char *other, double size, double near,
                       double tolerance)
{
  uint64_t state = 3;
  int compared = 0;
  zs_field *a = compile(one), *b = compile(other);
  zs_eval *p = evaluator(a), *q = evaluator(b);
  for (int i = 0; i < 20000; i++) {
    double x[3];
    for (int k = 0; k < 3; k++)
      x[k] = random_between(&state, -size, size);
    const double f = zs_eval_point(q, x);
    if (fabs(f) > near)
      continue;
    compared++;
    const double g = zs_eval_point(p, x);
    if (!(fabs(g - f) <= tolerance))
      fail_msg("%s at %g %g %g: %g, not %g", one, x[0], x[1], x[2], g, f);
  }
  assert_true(compared > 100);
  zs_eval_free(p);
  zs_eval_free(q);
  zs_field_unref(a);
  zs_field_unref(b);
}

/* ---- Ends ----------------------------------------------------------------------------------- */

static void ends_are_the_shapes(void **unused)
{
  (void)unused;
  static const char *const shapes[] = {"<polygon points='0 0 3 0 1 1'/>", "<circle radius='2'/>",
                                       "<torus radius='2' tube='0.5' rotate='20 0 0'/>",
                                       "<half-space normal='1 2 3'/>"};
  static const char *const times[] = {"0", "-3", "1", "{3/2}"};
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 4; k++) {
      char text[400];
      snprintf(text, sizeof text, MORPH("%s", "", "%s%s"), times[k], shapes[i],
               shapes[(i + 1) % 4]);
      check_same(text, shapes[k < 2 ? i : (i + 1) % 4], 3, INFINITY, 0);
    }
}

/* More than two are passed in turn. */
static void all_are_passed(void **unused)
{
  (void)unused;
#define SQUARES "<rectangle size='2 2'/><rectangle size='4 2'/><rectangle size='4 6'/>"
  check_same(MORPH("0.5", "", SQUARES), "<rectangle size='3 2'/>", 4, INFINITY, 1e-9);
  check_same(MORPH("1", "", SQUARES), "<rectangle size='4 2'/>", 4, INFINITY, 0);
  check_same(MORPH("1.25", "", SQUARES), "<rectangle size='4 3'/>", 4, INFINITY, 1e-9);
  check_same(MORPH("2", "", SQUARES), "<rectangle size='4 6'/>", 4, INFINITY, 0);
  check_same(MORPH("7", "", SQUARES), "<rectangle size='4 6'/>", 4, INFINITY, 0);
}

/* ---- Polygons ----------------------------------------------------------------------------------- */

/* Sums of rectangles and what is similar are known; wherever the shapes are put. */
static void polygons_are_exact(void **unused)
{
  (void)unused;
  check_same(MORPH("0.25", "", "<rectangle size='4 2'/><rectangle min='-2 1' max='2 5'/>"),
             "<rectangle min='-2 -0.5' max='2 2'/>", 4, INFINITY, 1e-9);
  check_same(MORPH("0.5", "", "<rectangle size='2 2'/><rectangle size='2 2' rotate='0 0 45'/>"),
             "<regular-polygon sides='8' radius='1.3065629648763766' rotate='0 0 22.5'/>", 3, INFINITY,
             1e-9);
  /* A similar shape is that shape at all times. */
  check_same(MORPH("0.4", "", "<polygon points='-1 -1 2 0 -1 2'/>"
                              "<polygon points='-1 -1 2 0 -1 2' scale='2' at='1 0 0'/>"),
             "<polygon points='-1 -1 2 0 -1 2' scale='1.4' at='0.4 0 0'/>", 4, INFINITY, 1e-9);
  check_same(MORPH("0.5", "", "<polygon points='-1 -1 2 0 -1 2' scale='-1 1 1'/>"
                              "<path d='M1 -1 L-2 0 L1 2 Z'/>"),
             "<polygon points='1 -1 -2 0 1 2'/>", 3, INFINITY, 1e-9);
  /* A frame around a smaller one's hole, and round about another axis. */
  check_same(MORPH("0.5", "", "<path d='M-4 -4H4V4H-4Z M-2 -2H2V2H-2Z' fill-rule='even-odd'/>"
                              "<rectangle size='2 2'/>"),
             "<path d='M-2.5 -2.5H2.5V2.5H-2.5Z M-0.5 -0.5H0.5V0.5H-0.5Z' fill-rule='even-odd'/>", 3,
             INFINITY, 1e-9);
  check_same("<minkowski-morph time='0.25' rotate='30 0 50' at='0 1 0'>"
             "<rectangle size='4 2'/><rectangle min='-2 1' max='2 5'/></minkowski-morph>",
             "<rectangle min='-2 -0.5' max='2 2' rotate='30 0 50' at='0 1 0'/>", 4, INFINITY, 1e-9);
}

/* ---- Samples ---------------------------------------------------------------------------------------- */

/* Errors next to the surface, in parts of a cell: small for smooth ones, and not much for sharp
 * ones.  Deep inside and far outside only the sign counts. */
static void samples_are_near(void **unused)
{
  (void)unused;
  /* circles of radius 2 and 1: one of 1.5; cells of 3 / 400 */
  check_same(MORPH("0.5", "", "<circle radius='2' at='1 0 0'/><circle/>"),
             "<circle radius='1.5' at='0.5 0 0'/>", 3, 0.02, 0.02 * 3 / 400);
  /* 0.5 about a rectangle of 2 by 1; the rectangle inside the circle, and not */
  check_same(MORPH("0.5", "", "<circle/><rectangle size='4 2'/>"),
             "<rectangle size='3 2' round='0.5'/>", 2, 0.02, 0.1 * 4 / 400);
  check_same(MORPH("0.25", "", "<circle radius='2'/><rectangle size='1 0.8'/>"),
             "<rectangle size='3.25 3.2' round='1.5'/>", 2, 0.02, 0.1 * 4 / 400);
  /* the second one larger than the first one's hole */
  check_same(MORPH("0.5", "", "<circle radius='4'/><circle radius='0.1'/>"),
             "<circle radius='2.05'/>", 3, 0.02, 0.1 * 4 / 400);
  check_same(MORPH("0.5", "resolution='40'", "<sphere radius='2'/><box size='2 3 1'/>"),
             "<box size='3 3.5 2.5' round='1'/>", 2, 0.05, 0.2 * 3.5 / 40);
  check_same(MORPH("0.3", "resolution='40'", "<sphere radius='1' at='0 0 1'/><sphere radius='2'/>"),
             "<sphere radius='1.3' at='0 0 0.7'/>", 2, 0.05, 0.1 * 2.6 / 40);
  check_same(MORPH("0.5", "resolution='32'", "<box size='2 1 1'/><box size='1 2 1'/>"),
             "<box size='1.5 1.5 1'/>", 1, 0.02, 0.3 * 1.5 / 32);
  /* f is not a distance, and the same solid */
  check_same(MORPH("0.5", "", "<formula>9 * (4 - x^2 - y^2)</formula><circle/>"),
             "<circle radius='1.5'/>", 2, 0.02, 0.05 * 3 / 400);
}

/* What is sampled agrees with what is exact, for shapes that are not convex: a `union` of one
 * polygon has no outline of its own. */
static void samples_agree_with_polygons(void **unused)
{
  (void)unused;
#define A "<polygon points='-2 -2 2 -2 2 2 0 0 -2 2'/>"
#define B "<polygon points='-0.5 0 0 -1 0.6 0.2 0 0'/>"
  check_same(MORPH("0.4", "", "<union>" A "</union>" B), MORPH("0.4", "", A B), 2, 0.01, 0.005);
  check_same(MORPH("0.4", "", "<union>" A "</union><union>" B "</union>"), MORPH("0.4", "", A B), 2,
             0.01, 0.005);
}

/* A ball fills what is within its radius of the other solid, which knows its distances outside: the
 * sum has no cavities where that one has plateaus inside. */
static void sums_have_no_cavities(void **unused)
{
  (void)unused;
#define BEAMS "<union><box size='8 2 2'/><box size='2 8 2'/><box size='2 2 8'/></union>"
  uint64_t state = 9;
  zs_field *sum = compile(MORPH("0.25", "resolution='32'", BEAMS "<sphere radius='4'/>"));
  zs_field *grown = compile("<offset by='1'><scale by='0.75'>" BEAMS "</scale></offset>");
  zs_eval *p = evaluator(sum), *q = evaluator(grown);
  int inside = 0;
  for (int i = 0; i < 20000; i++) {
    double x[3];
    for (int k = 0; k < 3; k++)
      x[k] = i < 5000 && k != i % 3 ? 0 : random_between(&state, -5, 5);
    const double f = zs_eval_point(p, x), g = zs_eval_point(q, x);
    if (fabs(g) > 0.3 * 8 / 32 && (f >= 0) != (g >= 0))
      fail_msg("%g %g %g: %g, not %g", x[0], x[1], x[2], f, g);
    inside += g > 0;
  }
  assert_true(inside > 2000);
  zs_eval_free(p);
  zs_eval_free(q);
  zs_field_unref(sum);
  zs_field_unref(grown);
}

/* Finer lattices are nearer, with the square of the cell. */
static void finer_is_nearer(void **unused)
{
  (void)unused;
  double worst[2] = {0, 0};
  for (int fine = 0; fine < 2; fine++) {
    char text[300];
    snprintf(text, sizeof text,
             MORPH("0.5", "resolution='%d'", "<ellipse radii='2 1'/><circle radius='1'/>"),
             fine ? 160 : 40);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (int i = 0; i < 400; i++) {
      /* a point of the ellipse of 1 by 0.5, and 0.5 along its normal */
      const double a = i * 0.015707963, n[2] = {0.5 * cos(a), sin(a)};
      const double size = 0.5 / hypot(n[0], n[1]);
      const double x[3] = {cos(a) + size * n[0], 0.5 * sin(a) + size * n[1], i};
      worst[fine] = fmax(worst[fine], fabs(zs_eval_point(eval, x)));
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
  assert_true(worst[0] < 0.01 && worst[1] < worst[0] / 6);
}

/* ---- What is wrong ------------------------------------------------------------------------------------ */

static void bad_input_is_refused(void **unused)
{
  (void)unused;
  static const struct {
    const char *scene, *message;
  } cases[] = {
    {"<minkowski-morph><circle/><circle/></minkowski-morph>", "missing; expected a number"},
    {MORPH("0.5", "", ""), "expected"},
    {MORPH("0.5", "", "<circle/>"), "expected"},
    {MORPH("0.5", "resolution='7'", "<circle/><circle/>"), "7"},
    {MORPH("0.5", "resolution='4000'", "<circle/><circle/>"), "4000"},
    {MORPH("0.5", "", "<circle/><sphere/>"), "expected two of a kind"},
    {MORPH("0.5", "", "<sphere/><slab min='0' max='1'/>"), "no box is found"},
    {MORPH("0.5", "", "<half-plane normal='1 0'/><circle/>"), "no box is found"},
    {MORPH("0.5", "resolution='2000'", "<sphere/><sphere/>"), "more than is allowed"},
    {MORPH("0.5", "", "<circle at='1e12 0 0'/><circle/>"), ""},
    {MORPH("0.5", "resolution='8'", "<circle radius='1000'/><formula>"
           "(x - 330)^2 + (y - 777)^2 &lt; 0.01 ? 1 : -1</formula>"), "larger 'resolution'"},
    {MORPH("0.5", "", "<polygon points='0 0 1 1 2 2'/><circle/>"), "enclose nothing"},
    {MORPH("0.5", "", "<path src='none.svg'/><rectangle/>"), "none.svg"},
  };
  for (size_t i = 0; i < ZS_COUNT_OF(cases); i++) {
    const seen s = refusal(cases[i].scene);
    if (!strstr(s.message, cases[i].message) || s.line != 2)
      fail_msg("%s: line %u: %s", cases[i].scene, s.line, s.message);
  }
}

static bool stop(void *context, const char *stage, double fraction)
{
  (void)context, (void)fraction;
  return strcmp(stage, "sum");
}

/* Sampling is interrupted when asked, and bounded in memory. */
static void work_is_limited(void **unused)
{
  (void)unused;
  const char *text = MORPH("0.5", "", "<sphere/><box/>");
  for (int limited = 0; limited < 2; limited++) {
    zs_diag diag = {0};
    zs_control control = {.progress = limited ? NULL : stop, .memory_limit = limited ? 100000 : 0};
    zs_scene *scene = parse(text, &diag);
    assert_null(zs_scene_compile(scene, NULL, &control, &diag));
    assert_int_equal(diag.status, limited ? ZS_ERROR_MEMORY : ZS_CANCELLED);
    zs_scene_free(scene);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(ends_are_the_shapes),      cmocka_unit_test(polygons_are_exact),
    cmocka_unit_test(samples_are_near),         cmocka_unit_test(samples_agree_with_polygons),
    cmocka_unit_test(finer_is_nearer),          cmocka_unit_test(bad_input_is_refused),
    cmocka_unit_test(all_are_passed),
    cmocka_unit_test(work_is_limited),          cmocka_unit_test(sums_have_no_cavities),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
