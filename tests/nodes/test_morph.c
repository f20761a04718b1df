/* Shapes that become each other: ends, way between, warps, influence, one fit. */
#include "../random.h"
#include "scene_text.h"

#include <math.h>

/* ---- Scenes that are kept while their parameters change ----------------------------- */

typedef struct morph {
  zs_scene *scene;
  zs_field *field;
  zs_eval *eval;
} morph;

static morph load(const char *body)
{
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  morph m = {.scene = parse(body, &diag)};
  if (!m.scene)
    fail_msg("line %u: %s", s.line, s.message);
  return m;
}

static void set(morph *m, const char *name, double value)
{
  zs_diag diag = {0};
  zs_eval_free(m->eval);
  zs_field_unref(m->field);
  assert_true(zs_scene_set(m->scene, name, value, &diag));
  m->field = zs_scene_compile(m->scene, NULL, NULL, &diag);
  assert_non_null(m->field);
  m->eval = evaluator(m->field);
}

static double f(const morph *m, double x, double y, double z)
{
  return zs_eval_point(m->eval, (const double[3]){x, y, z});
}

static void drop(morph *m)
{
  zs_eval_free(m->eval);
  zs_field_unref(m->field);
  zs_scene_free(m->scene);
}

/* ---- X becomes O ---------------------------------------------------------------------- */

/* An X of two bars, and a ring. */
#define X_CORNERS "-4 -5 -2.5 -5 0 -1.5 2.5 -5 4 -5 1 0 4 5 2.5 5 0 1.5 -2.5 5 -4 5 -1 0"
enum { RING = 96 };

static const double x_corners[][2] = {{-4, -5}, {-2.5, -5}, {0, -1.5}, {2.5, -5}, {4, -5}, {1, 0},
                                      {4, 5},   {2.5, 5},   {0, 1.5},  {-2.5, 5}, {-4, 5}, {-1, 0}};
enum { X_COUNT = sizeof x_corners / sizeof *x_corners };

static void write_ring(void)
{
  FILE *file = create("ring.txt");
  for (int hole = 0; hole <= 1; hole++) {
    for (int i = 0; i < RING; i++) {
      const double a = 2 * 3.14159265358979323846 * i / RING, r = hole ? 0.6 : 1;
      fprintf(file, "%.17g %.17g\n", 4 * r * cos(a), 5 * r * sin(a));
    }
    fprintf(file, "\n");
  }
  assert_int_equal(fclose(file), 0);
}

/* Given, so that nobody looks for it. */
#define DOMAIN "<domain min='-8 -8 -1' max='8 8 1'/>"
#define X_TO_O(attributes, more) \
  DOMAIN "<param name='t' value='0'/><variational slice='{t}' " attributes ">" \
  "<shape at='0'><contour points='" X_CORNERS "'/></shape>" \
  "<shape at='1'><contour src='ring.txt'/></shape>" more "</variational>"

/* The distance from a point on an outline, along the normal, at which f is zero. */
static double miss(const morph *m, const double p[2], const double n[2])
{
  double lo = -0.05, hi = 0.05;
  if ((f(m, p[0] + lo * n[0], p[1] + lo * n[1], 0) > 0) ==
      (f(m, p[0] + hi * n[0], p[1] + hi * n[1], 0) > 0))
    return 1;
  for (int i = 0; i < 30; i++) {
    const double middle = (lo + hi) / 2;
    if (f(m, p[0] + middle * n[0], p[1] + middle * n[1], 0) > 0)
      lo = middle;
    else
      hi = middle;
  }
  return fabs(lo);
}

/* The largest miss of points on the edges of a polygon, not only the corners. */
static double worst_miss(const morph *m, const double (*corners)[2], int count)
{
  double worst = 0;
  for (int i = 0; i < count; i++) {
    const double *a = corners[i], *b = corners[(i + 1) % count];
    const double e[2] = {b[0] - a[0], b[1] - a[1]}, length = hypot(e[0], e[1]);
    const double n[2] = {e[1] / length, -e[0] / length};
    for (int j = 1; j < 40; j++) {
      const double p[2] = {a[0] + e[0] * j / 40, a[1] + e[1] * j / 40};
      worst = fmax(worst, miss(m, p, n));
    }
  }
  return worst;
}

static void ends_are_the_shapes(void **state)
{
  (void)state;
  const double box = 10;
  double ring[RING][2];
  for (int i = 0; i < RING; i++) {
    const double a = 2 * 3.14159265358979323846 * i / RING;
    ring[i][0] = 4 * cos(a);
    ring[i][1] = 5 * sin(a);
  }
  write_ring();
  morph m = load(X_TO_O("", ""));
  set(&m, "t", 0);
  zs_fit_info info;
  assert_true(zs_field_fit(m.field, 0, &info));
  assert_int_equal(info.dimension, 3);
  assert_true(worst_miss(&m, x_corners, X_COUNT) < 1e-4 * box);
  assert_true(f(&m, 0, 0, 7) > 0 && f(&m, 3, 0, 0) < 0);
  for (int i = 0; i < X_COUNT; i++)
    assert_true(fabs(f(&m, x_corners[i][0], x_corners[i][1], 0)) < 1e-6 * box);
  set(&m, "t", 1);
  assert_true(worst_miss(&m, (const double(*)[2])ring, RING) < 1e-4 * box);
  for (int i = 0; i < RING; i++)
    assert_true(fabs(f(&m, ring[i][0], ring[i][1], -3)) < 1e-6 * box);
  assert_true(f(&m, 0, 0, 0) < 0 && f(&m, 3.2, 0, 0) > 0);
  drop(&m);
}

/* So is any polygon, with blunt corners and narrow ones. */
static void polygons_are_met_between_corners(void **state)
{
  (void)state;
  static const struct {
    int corners;
    double inner; /* radius of every other corner */
  } cases[] = {{3, 1}, {6, 1}, {12, 1}, {24, 1}, {10, 0.4}, {14, 0.7}};
  for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
    char text[2000] = DOMAIN "<param name='t' value='0'/><variational><contour points='";
    double corners[24][2];
    for (int i = 0; i < cases[c].corners; i++) {
      const double a = 2 * 3.14159265358979323846 * i / cases[c].corners;
      const double r = i % 2 ? 5 * cases[c].inner : 5;
      corners[i][0] = r * cos(a);
      corners[i][1] = r * sin(a);
      snprintf(text + strlen(text), 60, "%s%.17g %.17g", i ? ", " : "", corners[i][0],
               corners[i][1]);
    }
    strcat(text, "'/></variational>");
    morph m = load(text);
    set(&m, "t", 0);
    const double worst = worst_miss(&m, (const double(*)[2])corners, cases[c].corners);
    if (!(worst < 1e-3)) /* 1e-4 of the box */
      fail_msg("case %zu: off by %g", c, worst);
    drop(&m);
  }
}

/* A sweep fits once, and moves without a jump: in value, and in its rate of change
 * across the planes of the shapes. */
static void sweeps_fit_once_and_are_smooth(void **state)
{
  (void)state;
  write_ring();
  morph m = load(X_TO_O("", ""));
  double seconds = 0, before[3] = {0}, rate = 0;
  static const double points[3][2] = {{0.3, 0.2}, {2.2, 3.1}, {-3, 0.4}};
  for (int i = 0; i <= 20; i++) {
    set(&m, "t", i / 20.0);
    zs_fit_info info;
    assert_true(zs_field_fit(m.field, 0, &info));
    if (i)
      assert_true(info.seconds == seconds);
    seconds = info.seconds;
    for (int k = 0; k < 3; k++) {
      const double now = f(&m, points[k][0], points[k][1], 0);
      if (i)
        assert_true(fabs(now - before[k]) < 0.5);
      before[k] = now;
    }
  }
  const double h = 1e-4;
  for (int plane = 0; plane <= 1; plane++)
    for (int k = 0; k < 3; k++) {
      double value[3];
      for (int i = 0; i < 3; i++) {
        set(&m, "t", plane + (i - 1) * h);
        value[i] = f(&m, points[k][0], points[k][1], 0);
      }
      rate = fmax(fabs(value[2] - value[1]), fabs(value[1] - value[0])) / h;
      /* The second difference of a C2 function is h times smaller. */
      assert_true(fabs(value[2] - 2 * value[1] + value[0]) / h < 1e-2 * (1 + rate));
    }
  drop(&m);
}

static void gradient(const morph *m, double x, double y, double g[2])
{
  const double h = 1e-4;
  g[0] = (f(m, x + h, y, 0) - f(m, x - h, y, 0)) / (2 * h);
  g[1] = (f(m, x, y + h, 0) - f(m, x, y - h, 0)) / (2 * h);
}

/* How far the outline turns over a short way about a point of it, in degrees. */
static double turn_at(const morph *m, double x, double y)
{
  const double way = 0.1;
  double g[2], a[2], b[2];
  gradient(m, x, y, g);
  const double length = hypot(g[0], g[1]);
  if (!(length > 0))
    return 180;
  const double along[2] = {-g[1] / length * way, g[0] / length * way};
  gradient(m, x - along[0], y - along[1], a);
  gradient(m, x + along[0], y + along[1], b);
  return fabs(atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])) * 180 / 3.14159265;
}

/* The part of an outline, of where lines along x meet it, that turns sharply. */
static double sharp_part(const morph *m)
{
  const double step = 0.25;
  int sharp = 0, all = 0;
  for (double y = -5.97; y < 6; y += 0.21)
    for (double x = -6; x < 6; x += step) {
      double lo = x, hi = x + step;
      const bool inside = f(m, lo, y, 0) > 0;
      if (inside == (f(m, hi, y, 0) > 0))
        continue;
      for (int i = 0; i < 25; i++) {
        const double middle = (lo + hi) / 2;
        if ((f(m, middle, y, 0) > 0) == inside)
          lo = middle;
        else
          hi = middle;
      }
      sharp += turn_at(m, lo, y) > 30;
      all++;
    }
  assert_true(all > 50);
  return (double)sharp / all;
}

/* Figure 3 of the paper: between the shapes, linear interpolation of distances keeps
 * creases, and the variational fit has none. */
static void ways_between_are_smoother_than_linear(void **state)
{
  (void)state;
  write_ring();
  morph smooth = load(X_TO_O("", ""));
  morph linear = load(
    DOMAIN "<param name='t' value='0'/><slice z='{t}'><interpolate caps='open'>"
    "<level at='0'><polygon points='" X_CORNERS "'/></level>"
    "<level at='1'><difference><circle radius='1' scale='4 5 1'/>"
    "<circle radius='0.6' scale='4 5 1'/></difference></level></interpolate></slice>");
  double sharp[2] = {0, 0};
  for (int i = 1; i < 4; i++) {
    set(&smooth, "t", i / 4.0);
    set(&linear, "t", i / 4.0);
    sharp[0] += sharp_part(&smooth);
    sharp[1] += sharp_part(&linear);
  }
  assert_true(sharp[0] < 0.3 * sharp[1]);
  drop(&smooth);
  drop(&linear);
}

/* ---- Warps ------------------------------------------------------------------------------ */

#define DISC(x) \
  "<contour points='{" x "+1} 0 {" x "+0.7071068} 0.7071068 {" x "} 1 " \
  "{" x "-0.7071068} 0.7071068 {" x "-1} 0 {" x "-0.7071068} -0.7071068 {" x "} -1 " \
  "{" x "+0.7071068} -0.7071068'/>"

static void discs(char *body, size_t size, double from, double to, const char *pairs)
{
  snprintf(body, size, DOMAIN "<param name='t' value='0'/><param name='a' value='%g'/>"
                       "<param name='b' value='%g'/><variational slice='{t}'>"
                       "<shape at='0'>" DISC("a") "</shape><shape at='1'>" DISC("b") "</shape>"
                       "%s</variational>", from, to, pairs);
}

/* Two discs far apart: pairs carry both of them to the middle, and what lies
 * between them back in proportion. */
static void pairs_carry_shapes(void **state)
{
  (void)state;
  static const char *const pairs[] = {
    "<pair from='0 0 0' to='6 0 0'/>",
    "<pair from='-1 0 0' to='5 0 0'/><pair from='1 0 0' to='7 0 0'/><pair from='0 1 0' to='6 1 0'/>"
    "<pair from='0 -1 0' to='6 -1 0'/>"};
  char body[4000];
  discs(body, sizeof body, 3, 3, "");
  morph middle = load(body);
  for (int n = 0; n < 2; n++) {
    discs(body, sizeof body, 0, 6, pairs[n]);
    morph m = load(body);
    uint64_t seed = 2;
    for (int i = 0; i <= 4; i++) {
      const double t = i / 4.0;
      set(&m, "t", t);
      set(&middle, "t", t);
      for (int j = 0; j < 50; j++) {
        const double x = random_between(&seed, -2, 2), y = random_between(&seed, -2, 2);
        /* Each of the two fits is solved to a tolerance, which shows more away from the discs. */
        assert_true(fabs(f(&m, x + 6 * t, y, 5) - f(&middle, x + 3, y, 5)) < 1e-4);
      }
    }
    drop(&m);
  }
  drop(&middle);
  /* Without them the discs do not meet. */
  discs(body, sizeof body, 0, 6, "");
  morph m = load(body);
  set(&m, "t", 0.5);
  assert_true(f(&m, 3, 0, 0) < 0.5);
  drop(&m);
}

/* Pairs that stay where they are change nothing; ends are exact whatever the pairs. */
static void ends_are_exact_with_pairs(void **state)
{
  (void)state;
  write_ring();
  morph m = load(X_TO_O("", "<pair from='4 5 0' to='3 4 0'/><pair from='-4 5 0' to='-3 4 0'/>"
                            "<pair from='0 -1.5 0' to='0.5 -3 0'/>"
                            "<pair from='-4 -5 0' to='-3 -4 0'/>"));
  set(&m, "t", 0);
  for (int i = 0; i < X_COUNT; i++)
    assert_true(fabs(f(&m, x_corners[i][0], x_corners[i][1], 0)) < 1e-5);
  set(&m, "t", 1);
  for (int i = 0; i < RING; i++) {
    const double a = 2 * 3.14159265358979323846 * i / RING;
    assert_true(fabs(f(&m, 4 * cos(a), 5 * sin(a), 0)) < 1e-5);
  }
  drop(&m);
  morph plain = load(X_TO_O("", ""));
  morph still = load(X_TO_O("", "<pair from='1 2 0' to='1 2 0'/><pair from='0 0 0' to='0 0 0'/>"));
  uint64_t seed = 7;
  for (int i = 0; i < 2; i++) {
    const double t = random_between(&seed, 0, 1);
    set(&plain, "t", t);
    set(&still, "t", t);
    for (int j = 0; j < 50; j++) {
      const double x = random_between(&seed, -5, 5), y = random_between(&seed, -6, 6);
      assert_true(fabs(f(&plain, x, y, 0) - f(&still, x, y, 0)) < 1e-4);
    }
  }
  drop(&plain);
  drop(&still);
}

/* ---- Solids ------------------------------------------------------------------------------ */

/* Points of a surface by two angles, with normals from differences. */
static void write_ellipsoid(const char *name, double a, double b, double c)
{
  enum { COUNT = 150 };
  FILE *file = create(name);
  for (int i = 0; i < COUNT; i++) {
    const double z = 1 - (2 * i + 1) / (double)COUNT, r = sqrt(1 - z * z);
    const double x = r * cos(2.399963229728653 * i), y = r * sin(2.399963229728653 * i);
    fprintf(file, "%.17g %.17g %.17g %.17g %.17g %.17g\n", a * x, b * y, c * z, x / a, y / b,
            z / c);
  }
  assert_int_equal(fclose(file), 0);
}

/* 2 |A and B| / (|A| + |B|) of the solid and an ellipsoid, over a grid. */
static double dice(const morph *m, double a, double b, double c)
{
  enum { SIDE = 24 };
  int both = 0, sum = 0;
  for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
    const double x = (i % SIDE + 0.5) / SIDE * 5 - 2.5;
    const double y = (i / SIDE % SIDE + 0.5) / SIDE * 5 - 2.5;
    const double z = (i / SIDE / SIDE + 0.5) / SIDE * 5 - 2.5;
    const bool in = f(m, x, y, z) >= 0;
    const bool of = x * x / a / a + y * y / b / b + z * z / c / c <= 1;
    both += in && of;
    sum += in + of;
  }
  return 2.0 * both / sum;
}

static void solids_become_each_other(void **state)
{
  (void)state;
  write_ellipsoid("long.xyz", 2, 0.8, 0.8);
  write_ellipsoid("high.xyz", 0.8, 0.8, 2);
  morph m = load("<param name='t' value='0'/><variational slice='{t}'>"
                 "<shape at='0'><points src='long.xyz'/></shape>"
                 "<shape at='1'><points src='high.xyz'/></shape></variational>");
  set(&m, "t", 0);
  zs_fit_info info;
  assert_true(zs_field_fit(m.field, 0, &info));
  assert_int_equal(info.dimension, 4);
  assert_string_equal(info.kernel, "tps2");
  assert_true(dice(&m, 2, 0.8, 0.8) >= 0.995);
  double before = 0;
  for (int i = 0; i <= 4; i++) {
    set(&m, "t", i / 4.0);
    const double now = dice(&m, 0.8, 0.8, 2);
    assert_true(now > before);
    before = now;
  }
  assert_true(before >= 0.995);
  double lo[3], hi[3];
  assert_true(zs_field_box(m.field, lo, hi, NULL));
  assert_true(hi[2] > 2 && hi[2] < 2.6 && hi[0] < 1.5);
  drop(&m);
}

/* Three shapes at the corners of a triangle: a fit in five dimensions. */
static void influence_draws_shapes(void **state)
{
  (void)state;
  write_ellipsoid("long.xyz", 2, 0.8, 0.8);
  write_ellipsoid("high.xyz", 0.8, 0.8, 2);
  write_ellipsoid("wide.xyz", 0.8, 2, 0.8);
  morph m = load("<param name='s' value='0'/><param name='t' value='0'/>"
                 "<variational slice='{s} {t}'>"
                 "<shape at='0 0'><points src='long.xyz'/></shape>"
                 "<shape at='1 0'><points src='high.xyz'/></shape>"
                 "<shape at='0.5 0.866'><points src='wide.xyz'/></shape></variational>");
  set(&m, "s", 0);
  zs_fit_info info;
  assert_true(zs_field_fit(m.field, 0, &info));
  assert_int_equal(info.dimension, 5);
  assert_string_equal(info.kernel, "r3");
  assert_true(dice(&m, 2, 0.8, 0.8) >= 0.995);
  set(&m, "s", 1);
  assert_true(dice(&m, 0.8, 0.8, 2) >= 0.995);
  set(&m, "s", 0.5);
  double before = 0;
  for (int i = 0; i <= 6; i++) {
    set(&m, "t", 0.866 * i / 6);
    const double now = dice(&m, 0.8, 2, 0.8);
    assert_true(now > before);
    before = now;
  }
  assert_true(before >= 0.995);
  drop(&m);
}

/* ---- Laws ---------------------------------------------------------------------------------- */

/* Moving, turning and scaling what is fitted moves, turns and scales f, with the
 * automatic offsets and separation. */
static void units_and_places_do_not_matter(void **state)
{
  (void)state;
  static const double turn[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
  static const struct {
    double scale, move;
    bool turned, reversed;
  } cases[] = {{1, 0, false, true}, {1, 30, false, false}, {1, 0, true, false},
               {1000, 0, false, false}, {0.001, 0, true, true}, {3, -7, true, false}};
  enum { COUNT = 120 };
  double points[2][COUNT][3], normals[2][COUNT][3], first[40];
  static char body[60000];
  for (int s = 0; s < 2; s++)
    for (int i = 0; i < COUNT; i++) {
      const double z = 1 - (2 * i + 1) / (double)COUNT, r = sqrt(1 - z * z);
      const double p[3] = {r * cos(2.4 * i), r * sin(2.4 * i), z};
      for (int k = 0; k < 3; k++) {
        const double axis = k == s ? 2 : 1;
        points[s][i][k] = axis * p[k];
        normals[s][i][k] = p[k] / axis;
      }
    }
  for (int c = -1; c < (int)(sizeof cases / sizeof *cases); c++) {
    const double scale = c < 0 ? 1 : cases[c].scale, move = c < 0 ? 0 : cases[c].move;
    const bool turned = c >= 0 && cases[c].turned, reversed = c >= 0 && cases[c].reversed;
    size_t n = (size_t)snprintf(body, sizeof body, "<variational slice='0.4'>");
    for (int s = 0; s < 2; s++) {
      n += (size_t)snprintf(body + n, sizeof body - n, "<shape at='%d'>", s);
      for (int j = 0; j < COUNT; j++) {
        const int i = reversed ? COUNT - 1 - j : j;
        double p[3] = {0}, m[3] = {0};
        for (int k = 0; k < 3; k++)
          for (int l = 0; l < 3; l++) {
            p[k] += (turned ? turn[k][l] : k == l) * points[s][i][l];
            m[k] += (turned ? turn[k][l] : k == l) * normals[s][i][l];
          }
        n += (size_t)snprintf(body + n, sizeof body - n,
                              "<point at='%.17g %.17g %.17g' normal='%.17g %.17g %.17g'/>",
                              scale * p[0] + move, scale * p[1] + move, scale * p[2] + move, m[0],
                              m[1], m[2]);
      }
      n += (size_t)snprintf(body + n, sizeof body - n, "</shape>");
    }
    snprintf(body + n, sizeof body - n, "</variational>");
    zs_field *field = compile(body);
    zs_eval *eval = evaluator(field);
    uint64_t seed = 11;
    for (int i = 0; i < 40; i++) {
      double q[3], p[3] = {0};
      for (int k = 0; k < 3; k++)
        q[k] = random_between(&seed, -2, 2);
      for (int k = 0; k < 3; k++) {
        for (int l = 0; l < 3; l++)
          p[k] += (turned ? turn[k][l] : k == l) * q[l];
        p[k] = scale * p[k] + move;
      }
      const double value = zs_eval_point(eval, p) / scale;
      if (c < 0)
        first[i] = value;
      /* The box that fits are normalised to is along the axes, so that the unit of
       * log r changes when it turns: only rounding differs. */
      assert_true(fabs(value - first[i]) < 1e-6);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* ---- What is refused ------------------------------------------------------------------------ */

static void mistakes_are_explained(void **state)
{
  (void)state;
#define A "<shape at='0'><contour points='0 0 1 0 1 1'/></shape>"
#define B "<shape at='1'><contour points='0 0 1 0 1 1'/></shape>"
  static const struct {
    const char *body, *message;
    unsigned line;
    zs_status status;
  } cases[] = {
    {"<variational>\n" A B "</variational>", "'slice' is missing", 2, ZS_ERROR_SCHEMA},
    {"<variational slice='0'>\n<contour points='0 0 1 0 1 1'/></variational>", "no shapes", 2,
     ZS_ERROR_SCHEMA},
    {"<variational slice='0'>\n" A B "<contour points='0 0 1 0 1 1'/></variational>",
     "beside the shapes", 2, ZS_ERROR_SCHEMA},
    {"<variational slice='0 0'>\n" A B "</variational>", "1 number, but 'slice' has 2", 3,
     ZS_ERROR_SCHEMA},
    {"<variational slice='0 0 0 0'>\n<shape at='0 0 0 0'><contour points='0 0 1 0 1 1'/></shape>"
     "</variational>", "more than 5", 2, ZS_ERROR_SCHEMA},
    {"<variational slice='0 0 0' dimension='3'>\n<shape at='0 0 0'><contour points='0 0 1 0 1 1'/>"
     "</shape></variational>", "more than 5", 2, ZS_ERROR_SCHEMA},
    {"<variational slice='0'>\n" A "\n<pair from='0 0 0' to='0 0 0'/></variational>",
     "pairs need two shapes; there is 1", 4, ZS_ERROR_SCHEMA},
    {"<variational>\n<pair from='0 0 0' to='0 0 0'/></variational>",
     "pairs need two shapes; there are 0", 3, ZS_ERROR_SCHEMA},
    {"<variational slice='0'>\n" A A "<pair from='0 0 0' to='0 0 0'/></variational>",
     "same place", 3, ZS_ERROR_GEOMETRY},
    {"<variational slice='0'>\n" A B "<pair from='0 0 0' to='0 0 0'/>"
     "<pair from='0 0 0' to='1 0 0'/></variational>", "contradict", 2, ZS_ERROR_GEOMETRY},
    {"<variational slice='0'>\n<shape at='0'/>" B "</variational>", "no points", 3,
     ZS_ERROR_GEOMETRY},
    {"<variational slice='0' separation='0'>\n" A B "</variational>", "", 2, ZS_ERROR_SCHEMA},
    {"<variational slice='{u}'>\n" A B "</variational>", "'u' is not a parameter", 2,
     ZS_ERROR_SCHEMA},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const seen s = refusal(cases[i].body);
    if (!strstr(s.message, cases[i].message) || s.line != cases[i].line ||
        s.status != cases[i].status)
      fail_msg("case %zu: line %u: status %d: %s", i, s.line, (int)s.status, s.message);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(ends_are_the_shapes),
    cmocka_unit_test(polygons_are_met_between_corners),
    cmocka_unit_test(sweeps_fit_once_and_are_smooth),
    cmocka_unit_test(ways_between_are_smoother_than_linear),
    cmocka_unit_test(pairs_carry_shapes),
    cmocka_unit_test(ends_are_exact_with_pairs),
    cmocka_unit_test(solids_become_each_other),
    cmocka_unit_test(influence_draws_shapes),
    cmocka_unit_test(units_and_places_do_not_matter),
    cmocka_unit_test(mistakes_are_explained),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
