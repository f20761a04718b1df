/* Samples of contours and pictures: where they lie, and where their normals point. */
#include "rbf/contour.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const zs_rbf_plane ground = {.u = {1, 0, 0}, .v = {0, 1, 0}};

static void trace(zs_rbf_samples *list, const double *points, const size_t *ends, size_t rings,
                  const zs_rbf_plane *plane, double spacing)
{
  zs_rings r = {.point_count = ends[rings - 1], .ring_count = rings, .points = (double *)points,
                .ends = (size_t *)ends};
  assert_true(zs_rbf_contour_add(list, &r, plane, spacing, NULL, NULL));
}

static double length(const double *v)
{
  return hypot(hypot(v[0], v[1]), v[2]);
}

/* A ring with a hole, in all four ways round. */
static void normals_point_out(void **state)
{
  (void)state;
  for (int way = 0; way < 4; way++) {
    double points[80][2];
    const size_t ends[2] = {40, 80};
    for (int i = 0; i < 40; i++) {
      const double a = i * 0.15707963267948966;
      const double outer = way & 1 ? a : -a, inner = way & 2 ? a : -a;
      points[i][0] = 2 * cos(outer);
      points[i][1] = 2 * sin(outer);
      points[40 + i][0] = cos(inner);
      points[40 + i][1] = sin(inner);
    }
    zs_rbf_samples list = {0};
    trace(&list, &points[0][0], ends, 2, &ground, 10);
    assert_int_equal(list.count, 80);
    for (size_t i = 0; i < list.count; i++) {
      const double *p = list.samples[i].position, *n = list.samples[i].normal;
      const double outwards = (p[0] * n[0] + p[1] * n[1]) / (length(p) * length(n));
      assert_true(fabs(outwards - (length(p) > 1.5 ? 1 : -1)) < 1e-9);
      assert_true(n[2] == 0 && p[2] == 0);
    }
    zs_rbf_samples_clear(&list);
  }
}

/* A square: corners without normals, edges with, denser towards the corners, in a
 * plane that leans and is stretched. */
static void corners_are_sharp(void **state)
{
  (void)state;
  static const double square[] = {0, 0, 1, 0, 1, 1, 0, 1};
  static const size_t end = 4;
  const zs_rbf_plane leaning = {{5, 6, 7}, {0, 2, 0}, {0, 0, 3}};
  zs_rbf_samples list = {0};
  trace(&list, square, &end, 1, &leaning, 0.5);
  size_t corners = 0;
  double nearest = INFINITY;
  for (size_t i = 0; i < list.count; i++) {
    const double *p = list.samples[i].position, *n = list.samples[i].normal;
    const double y = (p[1] - 6) / 2, z = (p[2] - 7) / 3;
    double gap = INFINITY;
    for (size_t j = 0; j < list.count; j++) {
      const double *q = list.samples[j].position;
      if (j != i)
        gap = fmin(gap, length((double[3]){q[0] - p[0], q[1] - p[1], q[2] - p[2]}));
    }
    assert_true(p[0] == 5 && y > -1e-9 && y < 1 + 1e-9 && z > -1e-9 && z < 1 + 1e-9);
    assert_true(gap <= 0.5 + 1e-9);
    nearest = fmin(nearest, gap);
    if (length(n) == 0) { /* corners, and what is next to them */
      const double from_y = fmin(fabs(y), fabs(1 - y)), from_z = fmin(fabs(z), fabs(1 - z));
      assert_true(fmax(2 * from_y, 3 * from_z) < 0.25 + 1e-9);
      corners += fmax(from_y, from_z) < 1e-9;
      continue;
    }
    const double across = y < 1e-9 ? -1 : y > 1 - 1e-9 ? 1 : 0;
    const double up = z < 1e-9 ? -1 : z > 1 - 1e-9 ? 1 : 0;
    assert_true(fabs(n[1] - across) < 1e-9 && fabs(n[2] - up) < 1e-9 && n[0] == 0);
  }
  assert_int_equal(corners, 4);
  assert_true(nearest < 0.02);
  zs_rbf_samples_clear(&list);
}

static void keep_message(void *context, const zs_diagnostic *diagnostic)
{
  snprintf(context, 512, "%s", diagnostic->message);
}

static void bad_rings_are_refused(void **state)
{
  (void)state;
  static const struct {
    double points[8];
    size_t count;
    const char *message;
  } cases[] = {{{0, 0, 1, 1}, 2, "encloses nothing"},
               {{3, 4}, 1, "encloses nothing"},
               {{0, 0, 1, 1, 2, 2}, 3, "encloses nothing"},
               {{0, 0, 1, 0, 1, 0, 0, 1}, 4, "twice in a row"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char message[512] = "";
    zs_diag diag = {.report = keep_message, .context = message};
    zs_rbf_samples list = {0};
    zs_rings rings = {.point_count = cases[i].count, .ring_count = 1,
                      .points = (double *)cases[i].points, .ends = (size_t *)&cases[i].count};
    assert_false(zs_rbf_contour_add(&list, &rings, &ground, NAN, NULL, &diag));
    if (!strstr(message, cases[i].message))
      fail_msg("case %zu: %s", i, message);
    zs_rbf_samples_clear(&list);
  }
}

/* ---- Pictures --------------------------------------------------------------------- */

enum { WIDTH = 40, HEIGHT = 30 };
static float pixels[WIDTH * HEIGHT];
static const zs_gray picture = {.width = WIDTH, .height = HEIGHT, .pixels = pixels};

/* A disc with a soft edge: brightness falls by 1/4 a pixel. */
static void draw_disc(double x, double y, double radius)
{
  for (int j = 0; j < HEIGHT; j++)
    for (int i = 0; i < WIDTH; i++)
      pixels[j * WIDTH + i] =
        (float)fmin(1, fmax(0, 0.5 + (radius - hypot(i + 0.5 - x, j + 0.5 - y)) / 4));
}

static void crossings_lie_on_the_outline(void **state)
{
  (void)state;
  draw_disc(15, 12, 8);
  const zs_rbf_plane plane = {{100, 200, 300}, {0.5, 0, 0}, {0, 0.5, 0}};
  for (int down = 0; down <= 1; down++) {
    zs_rbf_samples list = {0};
    assert_true(zs_rbf_picture_add(&list, &picture, 0.5, down, &plane, NULL));
    assert_true(list.count > 40 && list.count < 80);
    for (size_t i = 0; i < list.count; i++) {
      const double *p = list.samples[i].position, *n = list.samples[i].normal;
      const double x = (p[0] - 100) / 0.5 - 15, row = (p[1] - 200) / 0.5;
      const double y = down ? row - 12 : row - (HEIGHT - 12);
      assert_true(fabs(hypot(x, y) - 8) < 0.05 && p[2] == 300);
      assert_true((x * n[0] + y * n[1]) / (8 * length(n)) > 0.99);
    }
    zs_rbf_samples_clear(&list);
  }
}

/* Outside the picture it is black; what crosses its border is closed there. */
static void borders_close_the_outline(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  for (int i = 0; i < WIDTH * HEIGHT; i++)
    pixels[i] = 1;
  assert_true(zs_rbf_picture_add(&list, &picture, 0.5, false, &ground, NULL));
  assert_int_equal(list.count, 2 * (WIDTH + HEIGHT));
  for (size_t i = 0; i < list.count; i++) {
    const double *p = list.samples[i].position;
    assert_true(fabs(p[0] * (p[0] - WIDTH) * p[1] * (p[1] - HEIGHT)) < 1e-9);
  }
  zs_rbf_samples_clear(&list);
}

static void black_pictures_have_no_outline(void **state)
{
  (void)state;
  zs_rbf_samples list = {0};
  memset(pixels, 0, sizeof pixels);
  assert_true(zs_rbf_picture_add(&list, &picture, 0.5, false, &ground, NULL));
  assert_int_equal(list.count, 0);
  /* One pixel has four crossings round it; where it is hardly above the level they
   * all nearly coincide, and one is kept. */
  pixels[5 * WIDTH + 5] = 1;
  assert_true(zs_rbf_picture_add(&list, &picture, 0.5, false, &ground, NULL));
  assert_int_equal(list.count, 4);
  pixels[5 * WIDTH + 5] = 0.51F;
  assert_true(zs_rbf_picture_add(&list, &picture, 0.5, false, &ground, NULL));
  assert_int_equal(list.count, 5);
  zs_rbf_samples_clear(&list);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(normals_point_out),
    cmocka_unit_test(corners_are_sharp),
    cmocka_unit_test(bad_rings_are_refused),
    cmocka_unit_test(crossings_lie_on_the_outline),
    cmocka_unit_test(borders_close_the_outline),
    cmocka_unit_test(black_pictures_have_no_outline),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
