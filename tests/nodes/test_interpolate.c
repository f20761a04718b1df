/* Interpolation of shapes on levels: levels are met, pairs are followed, ends, bad input. */
#include "../random.h"
#include "scene_text.h"

#include <math.h>

/* ---- Levels ----------------------------------------------------------------------------- */

/* Three shapes at uneven heights, with all that can stand between them. */
#define SHAPE_A "<circle radius='3' at='1 0 0'/>"
#define SHAPE_B "<union><rectangle size='5 2'/><circle radius='1' at='0 3 0'/></union>"
#define SHAPE_C "<ellipse radii='2 4' at='-1 1 0'/>"
#define PAIRS "<pair from='1 0' to='0 1'/><pair from='2 2' to='2 1'/><pair from='-1 1' to='-2 1'/>"
#define CURVE "<pair points='0 3 -2 4 0 5 1 5'/><pair from='1 0' to='0 1'/>"

static const char *const options[] = {
  "", "method='linear'", "continuity='c1'", "centers='fixed'", "caps='round'",
  "caps='open' continuity='c1' centers='fixed'", "method='space-time'",
  "method='space-time' caps='round' continuity='c1'"};
static const char *const betweens[] = {
  "", "<between ha='2' hb='3'>" PAIRS "</between>",
  "<between fill='0.7' wc='3' wd='2'>" CURVE "</between>",
  "<between correspondence='auto' hb='0.5'/>"};

static const char *stack_of(const char *option, const char *between, const char *other)
{
  static char text[4096];
  snprintf(text, sizeof text,
           "<domain min='-9 -9 -9' max='9 9 9'/><interpolate %s><level at='-1'>" SHAPE_A
           "</level>%s<level at='1.5'>" SHAPE_B "</level>%s<level at='2'>" SHAPE_C
           "</level></interpolate>",
           option, between, other);
  return text;
}

static void test_levels(void **unused)
{
  (void)unused;
  static const char *const shapes[] = {SHAPE_A, SHAPE_B, SHAPE_C};
  static const double heights[] = {-1, 1.5, 2};
  uint64_t state = 1;
  zs_eval *shape[3];
  for (int k = 0; k < 3; k++) {
    char text[400];
    snprintf(text, sizeof text, "<domain min='-9 -9 -9' max='9 9 9'/>%s", shapes[k]);
    zs_field *field = compile(text);
    shape[k] = evaluator(field);
    zs_field_unref(field);
  }
  for (unsigned i = 0; i < sizeof options / sizeof *options; i++)
    for (unsigned j = 0; j < 16; j++) {
      if ((j % 4 == 3 || j / 4 == 3) && (i + j) % 5) /* finding pairs takes its time */
        continue;
      zs_field *field = compile(stack_of(options[i], betweens[j % 4], betweens[j / 4]));
      zs_eval *eval = evaluator(field);
      for (int n = 0; n < 60; n++) {
        const int k = n % 3;
        const double p[3] = {random_between(&state, -6, 6), random_between(&state, -6, 6),
                             heights[k]};
        const float x = (float)p[0], y = (float)p[1], z = (float)p[2];
        const double exact[3] = {(double)x, (double)y, p[2]};
        double expected = zs_eval_point(shape[k], exact);
        if (!strstr(options[i], "open") && !strstr(options[i], "round"))
          expected = fmin(expected, fmin(p[2] + 1, 2 - p[2]) + 5e-7); /* the slab that it is cut by */
        float f;
        zs_eval_values(eval, NULL, 1, &x, &y, &z, &f);
        if (!(fabs(zs_eval_point(eval, exact) - expected) < 1e-9) ||
            !(fabs((double)f - expected) < 4e-6))
          fail_msg("%s, %s, %s, level %d: %g and %g instead of %g", options[i], betweens[j % 4],
                   betweens[j / 4], k, zs_eval_point(eval, exact), (double)f, expected);
      }
      zs_eval_free(eval);
      zs_field_unref(field);
    }
  for (int k = 0; k < 3; k++)
    zs_eval_free(shape[k]);
}

/* ---- Pairs ------------------------------------------------------------------------------ */

/* Area and middle of {f >= 0} on a plane z, in a square about the origin. */
static void measure(zs_eval *eval, double z, double half, double *area, double middle[2])
{
  enum { SIDE = 240 };
  static float x[SIDE], y[SIDE], h[SIDE], f[SIDE];
  const double cell = 2 * half / SIDE;
  double count = 0;
  middle[0] = middle[1] = 0;
  for (int j = 0; j < SIDE; j++) {
    for (int i = 0; i < SIDE; i++) {
      x[i] = (float)((i + 0.5) * cell - half);
      y[i] = (float)((j + 0.5) * cell - half);
      h[i] = (float)z;
    }
    zs_eval_values(eval, NULL, SIDE, x, y, h, f);
    for (int i = 0; i < SIDE; i++) {
      const double part = fmin(fmax((double)f[i] / cell + 0.5, 0), 1);
      count += part;
      middle[0] += part * (double)x[i];
      middle[1] += part * (double)y[i];
    }
  }
  for (int c = 0; c < 2; c++)
    middle[c] /= count;
  *area = count * cell * cell;
}

/* A disc that moves by more than its own width stays a disc, and goes straight. */
static void test_moving_disc(void **unused)
{
  (void)unused;
  static const char *const how[] = {"", "continuity='c1'", "centers='fixed'"};
  for (int i = 0; i < 3; i++) {
    char text[600];
    snprintf(text, sizeof text,
             "<interpolate %s><level at='0'><circle radius='1' at='-2 0 0'/></level>"
             "<between><pair from='-2 0' to='2 0'/></between>"
             "<level at='1'><circle radius='1' at='2 0 0'/></level></interpolate>", how[i]);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (double t = 0.1; t < 0.95; t += 0.1) {
      double area, middle[2];
      measure(eval, t, 4, &area, middle);
      const double moved = i == 1 ? t * t * (3 - 2 * t) : t;
      assert_true(fabs(area - 3.14159265) < 0.0314);
      assert_true(fabs(middle[0] - (4 * moved - 2)) < 0.01 && fabs(middle[1]) < 0.01);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* Small discs at the ends of pairs are found on the way between them, while everything turns
 * by 60 degrees and grows. */
static void test_features(void **unused)
{
  (void)unused;
  enum { COUNT = 5 };
  static const double from[COUNT][2] = {{-4, -3}, {4, -3}, {4, 3}, {-4, 2}, {0, 0.5}};
  char shape[2][COUNT * 100] = {"", ""}, pairs[COUNT * 100] = "", text[2000];
  double to[COUNT][2];
  for (int i = 0; i < COUNT; i++) {
    to[i][0] = 1.2 * (0.5 * from[i][0] - 0.866 * from[i][1]) + 1;
    to[i][1] = 1.2 * (0.866 * from[i][0] + 0.5 * from[i][1]) + 0.3 * i;
    for (int k = 0; k < 2; k++) {
      const double *p = k ? to[i] : from[i];
      snprintf(shape[k] + strlen(shape[k]), 100, "<circle radius='0.3' at='%.9g %.9g 0'/>", p[0],
               p[1]);
    }
    snprintf(pairs + strlen(pairs), 100, "<pair from='%.9g %.9g' to='%.9g %.9g'/>", from[i][0],
             from[i][1], to[i][0], to[i][1]);
  }
  snprintf(text, sizeof text,
           "<domain min='-9 -9 0' max='9 9 1'/><interpolate caps='open'><level at='0'>%s</level>"
           "<between>%s</between><level at='1'>%s</level></interpolate>", shape[0], pairs,
           shape[1]);
  zs_field *field = compile(text);
  zs_eval *eval = evaluator(field);
  for (double t = 0.1; t < 0.95; t += 0.1)
    for (int i = 0; i < COUNT; i++) {
      /* The disc's middle is where f is largest nearby. */
      double best = -INFINITY, at[2] = {0, 0};
      const double x = (1 - t) * from[i][0] + t * to[i][0], y = (1 - t) * from[i][1] + t * to[i][1];
      for (int j = 0; j < 11 * 11; j++) {
        const double p[3] = {x + 0.025 * (j % 11 - 5), y + 0.025 * (j / 11 - 5), t};
        const double f = zs_eval_point(eval, p);
        if (f > best) {
          best = f;
          at[0] = p[0];
          at[1] = p[1];
        }
      }
      assert_true(best > 0.29);
      assert_true(hypot(at[0] - x, at[1] - y) < 0.05); /* the box is some 10 wide */
    }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* What belongs together is found: discs and bars that have nothing in common keep their area
 * and go from the one to the other, in any plane and with shapes that are no distances. */
static void test_found_pairs(void **unused)
{
  (void)unused;
  static const char *const shapes[][2] = {
    {"<circle radius='1' at='-2 0 0'/>", "<circle radius='1' at='2 0 0'/>"},
    {"<rectangle size='1.5 2' at='-2 0 0'/>", "<rectangle size='1.5 2' at='2 0 0'/>"},
    {"<formula>4 - 4*(x + 2)^2 - y^2</formula>", "<formula>4 - 4*(x - 2)^2 - y^2</formula>"}};
  static const double areas[] = {3.1416, 3, 6.2832};
  for (int i = 0; i < 6; i++) {
    char text[600];
    snprintf(text, sizeof text,
             "<domain min='-4 -4 0' max='4 4 1'/><interpolate %s><level at='0'>%s</level>"
             "<between correspondence='auto'/>"
             "<level at='1'>%s</level></interpolate>", i < 3 ? "" : "continuity='c1'",
             shapes[i % 3][0], shapes[i % 3][1]);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (double t = 0.1; t < 0.95; t += 0.2) {
      double area, middle[2];
      measure(eval, t, 4, &area, middle);
      const double moved = i < 3 ? t : t * t * (3 - 2 * t);
      if (!(fabs(area / areas[i % 3] - 1) < 0.06 && fabs(middle[0] - (4 * moved - 2)) < 0.1))
        fail_msg("case %d at %g: area %g, at %g", i, t, area, middle[0]);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* However small a shape is beside the other, and however far away: nothing vanishes midway. */
static void test_found_pairs_of_unlike_sizes(void **unused)
{
  (void)unused;
  static const struct {
    const char *below, *above;
    double least, most, from[2], to[2]; /* of the area midway; the box to measure in */
  } cases[] = {
    {"<circle radius='0.2' at='8 8 0'/>",
     "<polygon points='19 18.5, 21 18.5, 21 19.1, 19.6 19.1, 19.6 21.5, 19 21.5'/>",
     0.12, 3, {7.5, 7.5}, {21.5, 22}},
    {"<rectangle size='6 0.5' at='-4 0 0'/>", "<rectangle size='0.5 6' at='4 1 0'/>", 2.9,
     11 /* both sides are 3.25 half-way */, {-8, -3}, {5, 5}},
    {"<rectangle size='4 0.4'/>", "<circle radius='3' at='1 2 0'/>", 1.6, 28.5, {-3, -2}, {5, 6}}};
  for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++) {
    enum { ACROSS = 300 };
    char text[600];
    snprintf(text, sizeof text,
             "<interpolate caps='open'><level at='0'>%s</level>"
             "<between correspondence='auto'/><level at='1'>%s</level></interpolate>",
             cases[i].below, cases[i].above);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    const double *from = cases[i].from, *to = cases[i].to;
    for (double t = 0.05; t < 1; t += 0.1) {
      int inside = 0;
      for (int k = 0; k < ACROSS * ACROSS; k++) {
        const double p[3] = {from[0] + (k % ACROSS + 0.5) / ACROSS * (to[0] - from[0]),
                             from[1] + (k / ACROSS + 0.5) / ACROSS * (to[1] - from[1]), t};
        inside += zs_eval_point(eval, p) >= 0;
      }
      const double area = inside * (to[0] - from[0]) * (to[1] - from[1]) / (ACROSS * ACROSS);
      if (!(area > cases[i].least && area < cases[i].most))
        fail_msg("case %u at %g: area %g", i, t, area);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* What is found turns with the shapes: bars and an ell half-way have the same area and middle,
 * turned, whichever way they lie. */
static void test_found_pairs_turn(void **unused)
{
  (void)unused;
  double first[2] = {0, 0};
  for (int i = 0; i < 4; i++) {
    const double turn = 37 * i;
    char text[800];
    snprintf(text, sizeof text,
             "<interpolate caps='open'>"
             "<level at='0'><rectangle size='5 1' rotate='0 0 %g'/></level>"
             "<between correspondence='auto'/>"
             "<level at='1'><polygon points='0 0, 4 0, 4 1, 1 1, 1 3, 0 3' rotate='0 0 %g'/></level>"
             "</interpolate>", 30 + turn, turn - 20);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    double area, middle[2];
    measure(eval, 0.5, 5, &area, middle);
    if (i == 0) {
      first[0] = area;
      first[1] = hypot(middle[0], middle[1]);
    }
    assert_true(area > 4.5 && area < 8);
    if (!(fabs(area / first[0] - 1) < 0.03 && fabs(hypot(middle[0], middle[1]) - first[1]) < 0.1))
      fail_msg("turned by %g: area %g, not %g", turn, area, first[0]);
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* ---- Pairs that move ---------------------------------------------------------------------- */

#define MOVED(attributes, own, pairs) \
  "<interpolate " attributes "><level at='-1'>" SHAPE_A "</level><between " own ">" pairs \
  "</between><level at='1.5'>" SHAPE_B "</level></interpolate>"

/* A pair on its way is the pair whose points are where it has come to: in all ways to give
 * one, by the time of the whole or of the gap. */
static void test_moving_pairs(void **unused)
{
  (void)unused;
  static const struct {
    const char *moving, *still;
  } cases[] = {
    {MOVED("time='0.25'", "", "<pair from='1 0' to='0 1' from-end='2 4' to-end='-4 1'/>"),
     MOVED("", "", "<pair from='1.25 1' to='-1 1'/>")},
    {MOVED("time='1'", "time='0.75'", "<pair from='1 0' to='0 1' to-end='-4 1'/>"
           "<pair from='1 3' to='0 2' from-end='1 7'/>"),
     MOVED("", "", "<pair from='1 0' to='-3 1'/><pair from='1 6' to='0 2'/>")},
    {MOVED("centers='fixed' time='0.5'", "", "<pair from='1 0' to='0 1' to-end='2 2'/>"),
     MOVED("centers='fixed'", "", "<pair from='1 0' to='1 1.5'/>")},
    {MOVED("time='0.5'", "", "<pair points='0 3 -2 4 1 5' points-end='2 3 -2 6 1 0'/>"),
     MOVED("", "", "<pair points='1 3 -2 5 1 2.5'/>")},
    {MOVED("", "", "<pair from='1 0' to='0 1' from-end='2 4' to-end='-4 1'/>"),
     MOVED("time='0.6'", "", "<pair from='1 0' to='0 1'/>")},
    {MOVED("time='1'", "", "<pair from='1 0' to='0 1' from-end='2 4' to-end='-4 1'/>"),
     MOVED("", "", "<pair from='2 4' to='-4 1'/>")}};
  uint64_t state = 12;
  for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++) {
    zs_field *field[2] = {compile(cases[i].moving), compile(cases[i].still)};
    zs_eval *eval[2] = {evaluator(field[0]), evaluator(field[1])};
    for (int j = 0; j < 200; j++) {
      const double p[3] = {random_between(&state, -6, 6), random_between(&state, -6, 6),
                           random_between(&state, -1, 1.5)};
      const double f = zs_eval_point(eval[0], p), g = zs_eval_point(eval[1], p);
      if (!(fabs(f - g) < 1e-9))
        fail_msg("case %u at %g %g %g: %.12g and %.12g", i, p[0], p[1], p[2], f, g);
    }
    for (int k = 0; k < 2; k++) {
      zs_eval_free(eval[k]);
      zs_field_unref(field[k]);
    }
  }
}

/* Pairs that cross on their way only while they move are refused then, and only then. */
static void test_moving_pairs_meet(void **unused)
{
  (void)unused;
#define CROSSING(time) \
  MOVED("time='" time "'", "", "<pair from='0 0' to='1 0' from-end='0 2'/>" \
        "<pair from='0 1' to='1 1'/>")
  zs_field_unref(compile(CROSSING("0")));
  zs_field_unref(compile(CROSSING("0.25")));
  refuses(CROSSING("0.5"), "meets");
  refuses(CROSSING("1"), "meets that of the pair in line 2, about 0.5");
}

/* ---- Between levels ---------------------------------------------------------------------- */

/* Two half-planes stand for two values: f on the way is what the weight says. */
static double weight_at(const char *attributes, double t)
{
  char text[400];
  snprintf(text, sizeof text,
           "<domain min='-1 -1 0' max='1 1 1'/><interpolate caps='open'><level at='0'>"
           "<formula>0</formula></level><between %s/><level at='1'><formula>1</formula></level>"
           "</interpolate>", attributes);
  return value_in(text, 0, 0, t);
}

static void test_weights(void **unused)
{
  (void)unused;
  static const struct {
    const char *attributes;
    double t, expected;
  } cases[] = {{"", 0.3, 0.3},
               {"weight='linear'", 0.8, 0.8},
               {"weight='smoothstep'", 0.25, 0.15625},
               {"weight='0 0, 0.3 0.1, 1 1'", 0.3, 0.1},
               {"weight='0 0, 0.3 0.1, 1 1'", 1, 1},
               {"weight='0 0 1 1'", 0.4, 0.4},
               {"weight='0 0, 0.5 0.5, 0.75 0.5, 1 1'", 0.6, 0.5},
               {"fill='2'", 0.5, 2.5},
               {"fill='2'", 0.25, 0.25 + 2 * 0.75},
               {"fill='-1' wc='4' wd='2'", 0.25, 0.25 - 0.9375 * 0.9375},
               {"fill='1' wc='0.5'", 0.5 + 1.0 / 8, 0.625 + 0.5}};
  for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++)
    if (!(fabs(weight_at(cases[i].attributes, cases[i].t) - cases[i].expected) < 2e-3))
      fail_msg("%s at %g: %g instead of %g", cases[i].attributes, cases[i].t,
               weight_at(cases[i].attributes, cases[i].t), cases[i].expected);
  /* Monotone knots make a monotone weight. */
  double last = 0;
  for (double t = 0; t <= 1; t += 0.01) {
    const double w = weight_at("weight='0 0, 0.1 0.4, 0.2 0.41, 0.9 0.5, 1 1'", t);
    assert_true(w >= last - 1e-12);
    last = w;
  }
}

/* ha and hb: a disc has moved by 1 - (1 - t^ha)^hb. */
static void test_motion(void **unused)
{
  (void)unused;
  static const double h[][2] = {{2, 1}, {1, 3}, {2, 12}, {0.5, 1}};
  for (int i = 0; i < 4; i++) {
    char text[600];
    snprintf(text, sizeof text,
             "<interpolate><level at='0'><circle radius='1' at='-2 0 0'/></level>"
             "<between ha='%g' hb='%g'><pair from='-2 0' to='2 0'/></between>"
             "<level at='1'><circle radius='1' at='2 0 0'/></level></interpolate>", h[i][0],
             h[i][1]);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    double area, middle[2];
    measure(eval, 0.4, 4, &area, middle);
    assert_true(fabs(middle[0] - (4 * (1 - pow(1 - pow(0.4, h[i][0]), h[i][1])) - 2)) < 0.02);
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* With c1 the slope along the axis is the same below and above a level, without it is not. */
static void test_continuity(void **unused)
{
  (void)unused;
  uint64_t state = 3;
  static const char *const how[] = {"caps='open'", "caps='open' continuity='c1'",
                                    "caps='open' method='space-time'"};
  double jump[3] = {0, 0, 0};
  for (int smooth = 0; smooth < 3; smooth++)
    for (int j = 0; j < 4; j++) {
      const bool blended = smooth == 2; /* which is smooth if nothing moves */
      const char *option = how[smooth];
      zs_field *field = compile(
        stack_of(option, blended ? "" : betweens[j], blended ? "" : betweens[3 - j]));
      zs_eval *eval = evaluator(field);
      for (int n = 0; n < 200; n++) {
        const double x = random_between(&state, -4, 4), y = random_between(&state, -4, 4);
        const double h = 1e-6;
        double f[3];
        for (int k = 0; k < 3; k++)
          f[k] = zs_eval_point(eval, (const double[3]){x, y, 1.5 + (k - 1) * h});
        jump[smooth] = fmax(jump[smooth], fabs(f[2] - 2 * f[1] + f[0]) / h);
      }
      zs_eval_free(eval);
      zs_field_unref(field);
    }
  if (!(jump[1] < 1e-3 && jump[0] > 0.1 && jump[2] < 1e-3))
    fail_msg("slopes jump by %g, with c1 by %g, blended by %g", jump[0], jump[1], jump[2]);
}

/* Between neighbours of equal values nothing swings over. */
static void test_no_overshoot(void **unused)
{
  (void)unused;
  zs_field *field = compile(
    "<domain min='-1 -1 0' max='1 1 5'/><interpolate caps='open' continuity='c1'>"
    "<level at='0'><formula>0</formula></level><level at='1'><formula>0</formula></level>"
    "<level at='1.5'><formula>3</formula></level><level at='4'><formula>3</formula></level>"
    "<level at='5'><formula>2</formula></level></interpolate>");
  zs_eval *eval = evaluator(field);
  for (double z = -0.5; z < 5.5; z += 0.01) {
    const double f = zs_eval_point(eval, (const double[3]){0, 0, z});
    assert_true(f >= -1e-12 && f <= 3 + 1e-12);
    if (z < 1 || (z > 1.5 && z < 4))
      assert_true(fabs(f - (z < 1 ? 0 : 3)) < 1e-12);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

static void test_ends(void **unused)
{
  (void)unused;
  const char *text = "<domain min='-5 -5 -5' max='5 5 5'/><interpolate %s><level at='0'>"
                     "<circle radius='2'/></level><level at='2'><circle radius='2'/></level>"
                     "</interpolate>";
  static const struct {
    const char *caps;
    double z, expected;
  } cases[] = {{"", 1, 1 + 5e-7},    {"", 2.5, -0.5 + 5e-7},   {"caps='open'", 4, 2},
               {"caps='round'", 1, 2}, {"caps='round'", 4, 0}, {"caps='round'", -1, 1.5}};
  for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++) {
    char scene[400];
    snprintf(scene, sizeof scene, text, cases[i].caps);
    assert_true(fabs(value_in(scene, 0, 0, cases[i].z) - cases[i].expected) < 1e-9);
  }
}

/* x and y of pairs go round with the axis, and a box is found. */
static void test_axes(void **unused)
{
  (void)unused;
  static const char *const names[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; axis++) {
    char text[900];
    snprintf(text, sizeof text,
             "<interpolate axis='%s'><level at='0'><circle radius='1' at='-2 1 0'/></level>"
             "<between><pair from='-2 1' to='2 1'/><pair from='-3 1' to='2 2'/>"
             "<pair from='-2 2' to='3 1'/></between>"
             "<level at='1'><circle radius='1' at='2 1 0'/></level></interpolate>", names[axis]);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    double lo[3], hi[3], p[3];
    assert_true(zs_field_box(field, lo, hi, NULL));
    p[(axis + 1) % 3] = 0;
    p[(axis + 2) % 3] = 1;
    p[axis] = 0.5;
    assert_true(zs_eval_point(eval, p) > 0.4);
    for (int k = 0; k < 3; k++)
      assert_true(lo[k] < p[k] && hi[k] > p[k] && hi[k] - lo[k] < 20);
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* ---- Bad input --------------------------------------------------------------------------- */

#define TWO(before, attributes, pairs) \
  "<interpolate " before "><level at='0'><circle/></level><between " attributes ">" pairs \
  "</between><level at='1'><circle/></level></interpolate>"

static void test_bad_input(void **unused)
{
  (void)unused;
  refuses("<interpolate><level at='0'><circle/></level></interpolate>", "found 1 of at least 2");
  refuses("<interpolate><level at='1'><circle/></level><level at='1'><circle/></level>"
         "</interpolate>", "does not lie beyond");
  refuses("<interpolate><between/><level at='0'><circle/></level><level at='1'><circle/></level>"
         "</interpolate>", "between two levels");
  refuses("<interpolate><level at='0'><circle/></level><level at='1'><circle/></level><between/>"
         "</interpolate>", "between two levels");
  refuses("<interpolate><level at='0'><circle/></level><between/><between/><level at='1'>"
         "<circle/></level></interpolate>", "between two levels");
  refuses(TWO("", "weight='0 0, 1'", ""), "is no weight");
  refuses(TWO("", "weight='0 0, 0.5 x, 1 1'", ""), "is no weight");
  refuses(TWO("", "weight='0 0, 0.5 0.5'", ""), "is no weight");
  refuses(TWO("", "weight='0 0, 0.5 0.5, 0.5 0.6, 1 1'", ""), "is no weight");
  refuses(TWO("", "ha='0'", ""), "expected a number from 0.01 to 100");
  refuses(TWO("continuity='c1'", "weight='smoothstep'", ""), "cannot be combined");
  refuses(TWO("continuity='c1'", "fill='1'", ""), "expected more than 1");
  refuses(TWO("", "correspondence='auto'", "<pair from='0 0' to='1 1'/>"), "cannot be combined");
  refuses(TWO("", "", "<pair from='0 0'/>"), "'to' is missing");
  refuses(TWO("", "", "<pair/>"), "expected 'from' and 'to', or 'points'");
  refuses(TWO("", "", "<pair points='0 0 1'/>"), "there are 3 numbers");
  refuses(TWO("", "", "<pair from='0 0' to='1 1' points='0 0 1 1'/>"), "cannot be combined");
  refuses(TWO("", "", "<pair from-end='0 0' points='0 0 1 1'/>"), "combined with 'from-end'");
  refuses(TWO("", "", "<pair points='0 0 1 1' points-end='0 0 1'/>"),
          "there are 3 numbers; expected 4, as many as of 'points'");
  refuses(TWO("", "", "<pair from='0 0' to='1 1' points-end='0 0 1 1'/>"), "these are missing");
  refuses(TWO("", "", "<pair from-end='0 0' to-end='1 1'/>"), "expected 'from' and 'to'");
  refuses(TWO("time='1.5'", "", ""), "'1.5'");
  refuses(TWO("", "time='-1'", ""), "'-1'");
  refuses(TWO("", "", "<pair from='0 0' to='1 1'/><pair from='0 1' to='1 0'/>"),
         "meets that of the pair in line 2, about 0.5");
  refuses(TWO("centers='fixed'", "", "<pair from='0 0' to='1 1'/><pair from='0 0' to='1 0'/>"),
         "meets");
}

/* What is given twice counts once. */
static void test_repeated_pairs(void **unused)
{
  (void)unused;
  const double once =
    value_in(TWO("", "", "<pair from='0 0' to='1 1'/>"), 0.3, 0.4, 0.5);
  const double twice = value_in(
    TWO("", "", "<pair from='0 0' to='1 1'/><pair from='0 0' to='1 1'/>"), 0.3, 0.4, 0.5);
  assert_true(fabs(once - twice) < 1e-12);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_levels),       cmocka_unit_test(test_moving_disc),
    cmocka_unit_test(test_features),     cmocka_unit_test(test_weights),
    cmocka_unit_test(test_motion),       cmocka_unit_test(test_continuity),
    cmocka_unit_test(test_no_overshoot), cmocka_unit_test(test_ends),
    cmocka_unit_test(test_axes),         cmocka_unit_test(test_bad_input),
    cmocka_unit_test(test_moving_pairs), cmocka_unit_test(test_moving_pairs_meet),
    cmocka_unit_test(test_repeated_pairs), cmocka_unit_test(test_found_pairs),
    cmocka_unit_test(test_found_pairs_of_unlike_sizes),
    cmocka_unit_test(test_found_pairs_turn),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
