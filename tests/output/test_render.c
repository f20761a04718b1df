/* The renderer: what rays hit, against closed forms; orientation; no shortcut
 * shows. */
#include "formula.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static const double lo[3] = {-1, -1, -1}, hi[3] = {1, 1, 1};

static zs_image render(const char *formula, const zs_view *view, zs_render_mode mode,
                       uint32_t width, uint32_t height, const zs_control *control,
                       zs_job_report *report)
{
  zs_field *field = formula_field(formula);
  assert_non_null(field);
  const zs_render_options options = {width, height, mode, *view};
  zs_image image;
  assert_true(zs_render(field, lo, hi, &options, &image, control, report, NULL));
  assert_int_equal(image.width, width);
  assert_int_equal(image.height, height);
  assert_int_equal(image.channels, mode == ZS_RENDER_DEPTH ? 1 : 3);
  zs_field_unref(field);
  return image;
}

static zs_view named(const char *name)
{
  zs_view view;
  assert_true(zs_view_named(&view, name, NULL));
  return view;
}

/* ---- A ball seen from a given place ------------------------------------------------ */

enum { WIDTH = 120, HEIGHT = 90 };
static const double EYE[3] = {3, -4, 2}, RADIUS = 0.8, FIELD_OF_VIEW = 30;
static const char ball[] = "0.8 - sqrt(x*x + y*y + z*z)";

static zs_view ball_view(void)
{
  zs_view view = {.id = "", .has_eye = true, .up = {0, 0, 1}, .field_of_view = FIELD_OF_VIEW};
  memcpy(view.eye, EYE, sizeof view.eye);
  return view;
}

/* The ray of a pixel from EYE to the origin, by the textbook. */
static void pixel_ray(uint32_t column, uint32_t row, double direction[3], double forward[3])
{
  double length = sqrt(EYE[0] * EYE[0] + EYE[1] * EYE[1] + EYE[2] * EYE[2]), sum = 0;
  for (int k = 0; k < 3; k++)
    forward[k] = -EYE[k] / length;
  double right[3] = {forward[1], -forward[0], 0}; /* forward x z */
  double r = hypot(right[0], right[1]);
  right[0] /= r;
  right[1] /= r;
  const double up[3] = {right[1] * forward[2], -right[0] * forward[2],
                        right[0] * forward[1] - right[1] * forward[0]};
  const double slope = tan(FIELD_OF_VIEW * acos(-1) / 360);
  const double u = ((column + 0.5) / HEIGHT - (double)WIDTH / HEIGHT / 2) * 2 * slope;
  const double v = (0.5 - (row + 0.5) / HEIGHT) * 2 * slope;
  for (int k = 0; k < 3; k++) {
    direction[k] = forward[k] + u * right[k] + v * up[k];
    sum += direction[k] * direction[k];
  }
  for (int k = 0; k < 3; k++)
    direction[k] /= sqrt(sum);
}

/* Where the ray meets the ball; returns how far it passes inside the ball's
 * edge (negative: misses). */
static double ball_hit(const double direction[3], double point[3])
{
  double along = 0, square = 0;
  for (int k = 0; k < 3; k++) {
    along -= EYE[k] * direction[k];
    square += EYE[k] * EYE[k];
  }
  const double miss = sqrt(square - along * along);
  const double distance = along - sqrt(fmax(RADIUS * RADIUS - miss * miss, 0));
  for (int k = 0; k < 3; k++)
    point[k] = EYE[k] + distance * direction[k];
  return RADIUS - miss;
}

static void test_ball_normals(void **state)
{
  (void)state;
  const zs_view view = ball_view();
  zs_image image = render(ball, &view, ZS_RENDER_NORMALS, WIDTH, HEIGHT, NULL, NULL);
  for (uint32_t row = 0; row < HEIGHT; row++)
    for (uint32_t column = 0; column < WIDTH; column++) {
      const uint8_t *rgb = image.pixels + 3 * (row * WIDTH + column);
      double direction[3], forward[3], point[3];
      pixel_ray(column, row, direction, forward);
      const double depth = ball_hit(direction, point);
      const bool black = rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0;
      if (fabs(depth) > 1e-5)
        assert_int_equal(black, depth < 0);
      for (int k = 0; k < 3 && depth > 1e-4; k++)
        assert_true(fabs(rgb[k] / 255.0 * 2 - 1 - point[k] / RADIUS) < 1.2 / 127);
    }
  zs_image_clear(&image);
}

static void test_ball_depth(void **state)
{
  (void)state;
  const zs_view view = ball_view();
  zs_image image = render(ball, &view, ZS_RENDER_DEPTH, WIDTH, HEIGHT, NULL, NULL);
  double near = INFINITY, far = -INFINITY, direction[3], forward[3], point[3];
  pixel_ray(0, 0, direction, forward);
  for (int corner = 0; corner < 8; corner++) {
    double w = 0;
    for (int k = 0; k < 3; k++)
      w += ((corner >> k & 1 ? 1 : -1) - EYE[k]) * forward[k];
    near = fmin(near, w);
    far = fmax(far, w);
  }
  for (uint32_t row = 0; row < HEIGHT; row++)
    for (uint32_t column = 0; column < WIDTH; column++) {
      pixel_ray(column, row, direction, forward);
      const double inside = ball_hit(direction, point);
      double w = 0;
      for (int k = 0; k < 3; k++)
        w += (point[k] - EYE[k]) * forward[k];
      const double expected = 255 - 254 * (w - near) / (far - near);
      if (inside > 1e-4)
        assert_true(fabs(image.pixels[row * WIDTH + column] - expected) < 0.51);
      else if (inside < -1e-5)
        assert_int_equal(image.pixels[row * WIDTH + column], 0);
    }
  zs_image_clear(&image);
}

/* Light comes from above on the left, and the background is no part of it. */
static void test_ball_shaded(void **state)
{
  (void)state;
  const zs_view view = ball_view();
  zs_image image = render(ball, &view, ZS_RENDER_SHADED, WIDTH, HEIGHT, NULL, NULL);
  const uint8_t *upper = image.pixels + (size_t)3 * (30 * WIDTH + 50);
  const uint8_t *lower = image.pixels + (size_t)3 * (60 * WIDTH + 70);
  assert_true(upper[1] > lower[1] + 40);
  for (uint32_t row = 1; row < HEIGHT; row++) /* no hit in the first column */
    assert_true(image.pixels[(size_t)3 * row * WIDTH] <=
                image.pixels[(size_t)3 * (row - 1) * WIDTH]);
  zs_image_clear(&image);
}

/* ---- Built-in views ------------------------------------------------------------------ */

/* A large ball at the origin and a small one along an axis. */
static const char *const pairs[3] = {
  "max(0.25 - sqrt(x*x + y*y + z*z), 0.08 - sqrt((x - 0.85)^2 + y*y + z*z))",
  "max(0.25 - sqrt(x*x + y*y + z*z), 0.08 - sqrt(x*x + (y - 0.85)^2 + z*z))",
  "max(0.25 - sqrt(x*x + y*y + z*z), 0.08 - sqrt(x*x + y*y + (z - 0.85)^2))"};

/* Where the picture has the small ball: -1, 0 or 1 to the right, and upward.
 * The middle of all is nearer to it than the mean. */
static void small_ball_side(const zs_image *image, int side[2])
{
  double sum[2] = {0, 0}, least[2] = {1e9, 1e9}, most[2] = {-1e9, -1e9}, n = 0;
  for (uint32_t row = 0; row < image->height; row++)
    for (uint32_t column = 0; column < image->width; column++) {
      const double at[2] = {column, -(double)row};
      if (image->pixels[row * image->width + column] == 0)
        continue;
      n++;
      for (int k = 0; k < 2; k++) {
        sum[k] += at[k];
        least[k] = fmin(least[k], at[k]);
        most[k] = fmax(most[k], at[k]);
      }
    }
  assert_true(n > 0);
  for (int k = 0; k < 2; k++) {
    double off = (least[k] + most[k]) / 2 - sum[k] / n;
    side[k] = off > 2 ? 1 : off < -2 ? -1 : 0;
  }
}

static void test_views(void **state)
{
  (void)state;
  static const struct {
    const char *name;
    int right[3], up[3]; /* on the picture, for x, y and z */
    double toward[3];    /* the eye */
  } views[] = {{"front", {1, 0, 0}, {0, 0, 1}, {0, -1, 0}},
               {"back", {-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
               {"left", {0, -1, 0}, {0, 0, 1}, {-1, 0, 0}},
               {"right", {0, 1, 0}, {0, 0, 1}, {1, 0, 0}},
               {"top", {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
               {"bottom", {1, 0, 0}, {0, -1, 0}, {0, 0, -1}},
               {"iso", {1, 1, 0}, {-1, 1, 1}, {0.577, -0.577, 0.577}}};
  for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
    const zs_view view = named(views[v].name);
    for (int axis = 0; axis < 3; axis++) {
      int side[2];
      zs_image image = render(pairs[axis], &view, ZS_RENDER_DEPTH, 96, 80, NULL, NULL);
      small_ball_side(&image, side);
      assert_int_equal(side[0], views[v].right[axis]);
      assert_int_equal(side[1], views[v].up[axis]);
      zs_image_clear(&image);
    }
    /* What faces the eye is in the middle of a ball. */
    zs_image image = render(ball, &view, ZS_RENDER_NORMALS, 81, 61, NULL, NULL);
    const uint8_t *middle = image.pixels + (size_t)3 * (30 * 81 + 40);
    for (int k = 0; k < 3; k++)
      assert_true(fabs(middle[k] / 255.0 * 2 - 1 - views[v].toward[k]) < 0.08);
    zs_image_clear(&image);
  }
}

/* Views without an eye show all of the solid, and as large as it fits. */
static void test_framing(void **state)
{
  (void)state;
  static const char *const names[] = {"front", "back", "left", "right", "top", "bottom", "iso"};
  static const char *const solids[] = {
    "0.2 - sqrt((x - 0.5)^2 + (y + 0.3)^2 + (z - 0.6)^2)",
    "min(min(0.9 - abs(x), 0.1 - abs(y)), 0.2 - abs(z))"};
  for (size_t v = 0; v < 7; v++)
    for (size_t s = 0; s < 2; s++) {
      const zs_view view = named(names[v]);
      zs_image image = render(solids[s], &view, ZS_RENDER_DEPTH, 128, 96, NULL, NULL);
      uint32_t first[2] = {128, 96}, last[2] = {0, 0};
      for (uint32_t row = 0; row < 96; row++)
        for (uint32_t column = 0; column < 128; column++) {
          const uint32_t at[2] = {column, row};
          for (int k = 0; k < 2 && image.pixels[row * 128 + column]; k++) {
            first[k] = at[k] < first[k] ? at[k] : first[k];
            last[k] = at[k] > last[k] ? at[k] : last[k];
          }
        }
      assert_true(first[0] > 0 && first[1] > 0 && last[0] < 127 && last[1] < 95);
      assert_true(last[0] - first[0] > 0.7 * 128 || last[1] - first[1] > 0.7 * 96);
      zs_image_clear(&image);
    }
}

/* ---- Cuts and thin things ------------------------------------------------------------- */

static void test_cuts(void **state)
{
  (void)state;
  static const char *const names[] = {"front", "back", "left", "right", "top", "bottom"};
  static const int normals[][3] = {{0, -1, 0}, {0, 1, 0}, {-1, 0, 0},
                                   {1, 0, 0},  {0, 0, 1}, {0, 0, -1}};
  for (size_t v = 0; v < 6; v++) {
    const zs_view view = named(names[v]);
    zs_image image = render("1 + x*x", &view, ZS_RENDER_NORMALS, 40, 40, NULL, NULL);
    unsigned hits = 0;
    for (size_t i = 0; i < 1600; i++) {
      const uint8_t *rgb = image.pixels + 3 * i;
      if (rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0)
        continue;
      hits++;
      for (int k = 0; k < 3; k++)
        assert_int_equal(rgb[k], normals[v][k] < 0 ? 0 : normals[v][k] > 0 ? 255 : 128);
    }
    assert_int_equal(hits, 36 * 36); /* 0.92 of the picture */
    zs_image_clear(&image);
  }
}

/* From within the solid, everything is cut, and faces the eye. */
static void test_eye_inside(void **state)
{
  (void)state;
  const zs_view view = {.id = "", .has_eye = true, .eye = {0.1, 0.2, -0.1},
                        .target = {1, 0.2, -0.1}, .up = {0, 0, 1}, .field_of_view = 10};
  zs_image image = render(ball, &view, ZS_RENDER_NORMALS, 16, 16, NULL, NULL);
  for (size_t i = 0; i < 256; i++) {
    assert_true(image.pixels[3 * i] < 4);
    assert_true(abs(image.pixels[3 * i + 1] - 128) < 13);
  }
  zs_image_clear(&image);
}

/* Sheets far thinner than a sample's spacing have no holes, whatever way they
 * are turned. */
static void test_thin_sheets(void **state)
{
  (void)state;
  static const char *const sheets[] = {
    "1e-4 - abs(y - 0.0123)", "1e-4 - abs(x * 0.6 + y * 0.8 - 0.1)",
    "1e-4 - abs(x * 0.4 + y * 0.7 + z * 0.592 + 0.05)",
    "5e-5 - abs(sqrt(x*x + z*z + (y - 3)^2) - 3.1)"};
  const zs_view view = {.id = "", .has_eye = true, .eye = {0, -8, 0}, .up = {0, 0, 1},
                        .field_of_view = 10};
  for (size_t s = 0; s < sizeof sheets / sizeof *sheets; s++) {
    zs_image image = render(sheets[s], &view, ZS_RENDER_DEPTH, 100, 100, NULL, NULL);
    for (uint32_t row = 15; row < 85; row++)
      for (uint32_t column = 15; column < 85; column++)
        assert_true(image.pixels[row * 100 + column] > 0);
    zs_image_clear(&image);
  }
}

/* Nothing to see is a picture too. */
static void test_nothing(void **state)
{
  (void)state;
  static const char *const nothing[] = {"-1 - x*x", "0 / (0 * x)", "sqrt(-1 - x*x)"};
  for (size_t i = 0; i < 3; i++) {
    const zs_view view = named("iso");
    zs_image image = render(nothing[i], &view, ZS_RENDER_DEPTH, 30, 20, NULL, NULL);
    for (size_t p = 0; p < 600; p++)
      assert_int_equal(image.pixels[p], 0);
    zs_image_clear(&image);
  }
  /* The box behind the eye. */
  const zs_view away = {.id = "", .has_eye = true, .eye = {0, -8, 0}, .target = {0, -9, 0},
                        .up = {0, 0, 1}, .field_of_view = 40};
  zs_image image = render(ball, &away, ZS_RENDER_DEPTH, 30, 20, NULL, NULL);
  for (size_t p = 0; p < 600; p++)
    assert_int_equal(image.pixels[p], 0);
  zs_image_clear(&image);
}

/* Without options it is what the initial ones say. */
static void test_no_options(void **state)
{
  (void)state;
  zs_field *field = formula_field(ball);
  assert_non_null(field);
  zs_render_options options;
  zs_render_options_init(&options);
  zs_image image, same;
  assert_true(zs_render(field, lo, hi, NULL, &image, NULL, NULL, NULL));
  assert_true(zs_render(field, lo, hi, &options, &same, NULL, NULL, NULL));
  assert_int_equal(image.width, same.width);
  assert_memory_equal(image.pixels, same.pixels, (size_t)3 * same.width * same.height);
  zs_image_clear(&image);
  zs_image_clear(&same);
  zs_field_unref(field);
}

/* ---- Shortcuts -------------------------------------------------------------------------- */

static const char solid[] =
  "max(min(min(0.7 - abs(x), 0.5 - abs(y)), min(0.6 - abs(z), sqrt(x*x + y*y) - 0.3)),"
  " 0.3 - sqrt((x - 0.6)^2 + (y + 0.4)^2 + (z - 0.5)^2))";

/* The same with a thin sheet. */
static const char thin[] =
  "max(max(min(min(0.7 - abs(x), 0.5 - abs(y)), min(0.6 - abs(z), sqrt(x*x + y*y) - 0.3)),"
  " 0.3 - sqrt((x - 0.6)^2 + (y + 0.4)^2 + (z - 0.5)^2)), 0.001 - abs(x + y + z - 0.4))";

/* Part of the pixels that differ by more than a few levels. */
static double differing(const zs_image *a, const zs_image *b)
{
  const size_t n = (size_t)a->width * a->height;
  double count = 0;
  for (size_t p = 0; p < n; p++) {
    int most = 0;
    for (size_t c = p * a->channels; c < (p + 1) * a->channels; c++)
      most = abs(a->pixels[c] - b->pixels[c]) > most ? abs(a->pixels[c] - b->pixels[c]) : most;
    count += most > 8;
  }
  return count / (double)n;
}

/* Pictures by any number of threads, which are the same to the bit, and by
 * brute force. */
static void compare_pictures(const char *formula, const zs_view *view, zs_render_mode mode,
                             double most)
{
  zs_control control;
  zs_job_report brute, pruned;
  zs_control_init(&control);
  control.threads = 1;
  zs_image image = render(formula, view, mode, 97, 71, &control, &pruned);
  for (unsigned threads = 2; threads <= 3; threads++) {
    control.threads = threads;
    zs_image again = render(formula, view, mode, 97, 71, &control, NULL);
    assert_memory_equal(again.pixels, image.pixels, (size_t)97 * 71 * image.channels);
    zs_image_clear(&again);
  }
  control.threads = 1;
  control.brute = true;
  zs_image expected = render(formula, view, mode, 97, 71, &control, &brute);
  assert_true(pruned.evaluations < brute.evaluations);
  assert_int_equal(pruned.threads, 1);
  assert_true(differing(&image, &expected) <= most);
  for (size_t p = 0; mode == ZS_RENDER_DEPTH && p < (size_t)97 * 71; p++)
    assert_true(image.pixels[p] >= expected.pixels[p] - 1); /* what is near is not overlooked */
  zs_image_clear(&expected);
  zs_image_clear(&image);
}

/* With and without pruning a surface is the same, located to a small part of a
 * pixel: pictures differ where that decides on which side of an edge a ray
 * falls, and where only pruning lets a sheet far thinner than a pixel be seen. */
static void test_shortcuts(void **state)
{
  (void)state;
  const zs_view views[] = {named("iso"), named("left"), ball_view()};
  for (size_t v = 0; v < 3; v++)
    for (int mode = 0; mode < 3; mode++) {
      compare_pictures(solid, &views[v], (zs_render_mode)mode, 0.003);
      compare_pictures(thin, &views[v], (zs_render_mode)mode, 0.04);
    }
}

/* ---- Mistakes ------------------------------------------------------------------------------ */

static void assert_refused(const zs_render_options *options, const zs_control *control,
                           zs_status status)
{
  zs_field *field = formula_field(ball);
  assert_non_null(field);
  zs_image image;
  zs_diag diag = {0};
  assert_false(zs_render(field, lo, hi, options, &image, control, NULL, &diag));
  assert_int_equal(diag.errors, 1);
  assert_int_equal(diag.status, status);
  assert_null(image.pixels);
  zs_field_unref(field);
}

static void test_bad(void **state)
{
  (void)state;
  zs_render_options good, bad;
  zs_render_options_init(&good);
  assert_int_equal(good.width, 800);
  assert_int_equal(good.height, 600);
  bad = good;
  bad.width = 0;
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad = good;
  bad.height = 1000000000;
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad = good;
  memset(bad.view.direction, 0, sizeof bad.view.direction);
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad.view.direction[1] = NAN;
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad = good;
  bad.mode = (zs_render_mode)3;
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad = good;
  bad.view.has_eye = true; /* at its target */
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad = good;
  bad.view.field_of_view = 180;
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad.view.field_of_view = -1;
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  bad.view.field_of_view = NAN;
  assert_refused(&bad, NULL, ZS_ERROR_ARGUMENT);
  zs_control control;
  zs_control_init(&control);
  control.memory_limit = 100000;
  assert_refused(&good, &control, ZS_ERROR_MEMORY);
}

/* An `up` along the view gives way to another, with no picture lost. */
static void test_up_along_view(void **state)
{
  (void)state;
  zs_view view = named("top");
  zs_image expected = render(solid, &view, ZS_RENDER_DEPTH, 40, 40, NULL, NULL);
  const double ups[3][3] = {{0, 0, 1}, {0, 0, 0}, {NAN, 0, 1}};
  for (int i = 0; i < 3; i++) {
    memcpy(view.up, ups[i], sizeof view.up);
    zs_image image = render(solid, &view, ZS_RENDER_DEPTH, 40, 40, NULL, NULL);
    assert_memory_equal(image.pixels, expected.pixels, 1600);
    zs_image_clear(&image);
  }
  zs_image_clear(&expected);
}

typedef struct stopper {
  unsigned calls, allowed;
  double latest;
} stopper;

static bool stop(void *context, const char *stage, double fraction)
{
  stopper *s = context;
  assert_non_null(stage);
  assert_true(fraction >= s->latest && fraction <= 1);
  s->latest = fraction;
  return ++s->calls <= s->allowed;
}

static void test_cancel(void **state)
{
  (void)state;
  zs_render_options options;
  zs_render_options_init(&options);
  options.width = options.height = 150;
  for (unsigned allowed = 0; allowed < 20; allowed += 4) {
    stopper s = {.allowed = allowed};
    zs_control control;
    zs_control_init(&control);
    control.threads = 1;
    control.progress = stop;
    control.context = &s;
    assert_refused(&options, &control, ZS_CANCELLED);
    assert_int_equal(s.calls, allowed + 1);
  }
}

static void keep_hint(void *context, const zs_diagnostic *diagnostic)
{
  *(bool *)context = diagnostic->hint && strstr(diagnostic->hint, "front");
}

static void test_unknown_view(void **state)
{
  (void)state;
  bool hinted = false;
  zs_view view;
  zs_diag diag = {.report = keep_hint, .context = &hinted};
  assert_false(zs_view_named(&view, "frnot", &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  assert_true(hinted);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_ball_normals),  cmocka_unit_test(test_ball_depth),
    cmocka_unit_test(test_ball_shaded),   cmocka_unit_test(test_views),
    cmocka_unit_test(test_framing),       cmocka_unit_test(test_cuts),
    cmocka_unit_test(test_eye_inside),    cmocka_unit_test(test_thin_sheets),
    cmocka_unit_test(test_nothing),       cmocka_unit_test(test_no_options),
    cmocka_unit_test(test_shortcuts),     cmocka_unit_test(test_bad),
    cmocka_unit_test(test_up_along_view), cmocka_unit_test(test_cancel),
    cmocka_unit_test(test_unknown_view)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
