/* Motions between shapes: known ones are found, those that are none are none. */
#include "stack/motion.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { WIDTH = 72, HEIGHT = 56, COUNT = WIDTH * HEIGHT };

/* The distance of an upright ellipse, about. */
static void draw(float *field, double x, double y, double a, double b)
{
  for (int i = 0; i < COUNT; i++) {
    const double u = (i % WIDTH - x) / a, v = (i / WIDTH - y) / b;
    field[i] = (float)(fmin(a, b) * (1 - hypot(u, v)));
  }
}

/* A bar that is thinner than it moves. */
static void draw_bar(float *field, double y, double half)
{
  for (int i = 0; i < COUNT; i++)
    field[i] = (float)fmin(half - fabs(i / WIDTH - y), 25 - fabs(i % WIDTH - 36.0));
}

/* Whether what is half-way meets itself in both fields, near the outline, in parts of the shapes'
 * sizes. */
static double mismatch(const zs_motion *m, const float *from, float size, const float *to,
                       float other)
{
  double worst = 0;
  for (int i = 0; i < COUNT; i++) {
    const float x = (float)(i % WIDTH), y = (float)(i / WIDTH);
    const float ux = m->u[0][i] / 2, uy = m->u[1][i] / 2;
    const float a = zs_motion_sample(from, WIDTH, HEIGHT, x - ux, y - uy) / size;
    const float b = zs_motion_sample(to, WIDTH, HEIGHT, x + ux, y + uy) / other;
    if (fabsf(a) < 0.15F)
      worst = fmax(worst, (double)fabsf(a - b));
  }
  return worst;
}

static void test_still(void **unused)
{
  (void)unused;
  static float f[COUNT];
  zs_motion m;
  draw(f, 30, 25, 14, 9);
  assert_true(zs_motion_find(&m, f, f, WIDTH, HEIGHT, 100, false));
  assert_false(m.apart);
  for (int i = 0; i < COUNT; i++)
    assert_true(fabsf(m.u[0][i]) < 1e-3F && fabsf(m.u[1][i]) < 1e-3F && m.gate[i] == 0);
  zs_motion_clear(&m);
}

/* Shapes that move, grow and have nothing in common. */
static void test_moves(void **unused)
{
  (void)unused;
  static const double cases[][8] = {{30, 25, 10, 10, 36, 29, 10, 10},
                                    {30, 25, 10, 12, 34, 25, 14, 9},
                                    {14, 14, 6, 6, 54, 40, 6, 6},
                                    {16, 40, 8, 5, 56, 14, 5, 9},
                                    {12, 12, 6, 6, 46, 30, 22, 22},
                                    {46, 30, 22, 4, 10, 10, 4, 8}};
  for (int c = 0; c < 6; c++) {
    static float a[COUNT], b[COUNT];
    const double *p = cases[c];
    zs_motion m;
    draw(a, p[0], p[1], p[2], p[3]);
    draw(b, p[4], p[5], p[6], p[7]);
    assert_true(zs_motion_find(&m, a, b, WIDTH, HEIGHT, 30, false));
    assert_true(m.apart == (c >= 2));
    const double off = mismatch(&m, a, (float)fmin(p[2], p[3]), b, (float)fmin(p[6], p[7]));
    if (!(off < 0.4)) /* it is stiff */
      fail_msg("case %d: off by %g", c, off);
    /* Half-way the middle has moved from the one to the other. */
    const int x = (int)((p[0] + p[4]) / 2), y = (int)((p[1] + p[5]) / 2), i = y * WIDTH + x;
    assert_true(fabs((double)m.u[0][i] - (p[4] - p[0])) < 2.5);
    assert_true(fabs((double)m.u[1][i] - (p[5] - p[1])) < 2.5);
    zs_motion_clear(&m);
  }
}

/* It takes the motion where something thin moves by about its thickness, not where something
 * thick does. */
static void test_gate(void **unused)
{
  (void)unused;
  static float a[COUNT], b[COUNT];
  zs_motion m;
  draw_bar(a, 26, 2);
  draw_bar(b, 29, 2);
  assert_true(zs_motion_find(&m, a, b, WIDTH, HEIGHT, 100, false));
  assert_true(m.gate[28 * WIDTH + 36] > 0.5F);
  zs_motion_clear(&m);
  draw_bar(a, 26, 12);
  draw_bar(b, 29, 12);
  assert_true(zs_motion_find(&m, a, b, WIDTH, HEIGHT, 100, false));
  assert_true(m.gate[28 * WIDTH + 36] < 0.01F);
  zs_motion_clear(&m);
}

/* Nowhere does it change so fast that it could not be undone. */
static void test_limits(void **unused)
{
  (void)unused;
  static float a[COUNT], b[COUNT];
  zs_motion m;
  for (int i = 0; i < COUNT; i++) { /* stripes and a checkerboard, of unlike sizes */
    a[i] = (float)(4 * sin(i % WIDTH / 3.0));
    b[i] = (float)(4 * sin(i % WIDTH / 5.0) * sin(i / WIDTH / 2.0));
  }
  assert_true(zs_motion_find(&m, a, b, WIDTH, HEIGHT, 1, false));
  for (int y = 1; y + 1 < HEIGHT; y++)
    for (int x = 1; x + 1 < WIDTH; x++) {
      double sum = 0;
      for (int k = 0; k < 2; k++) {
        const float *u = m.u[k] + y * WIDTH + x;
        sum += pow((double)(u[1] - u[-1]) / 2, 2) + pow((double)(u[WIDTH] - u[-WIDTH]) / 2, 2);
      }
      assert_true(sqrt(sum) < 1.6);
    }
  zs_motion_clear(&m);
}

/* One pixel wide and one high fields have no neighbours to look at. */
static void test_small(void **unused)
{
  (void)unused;
  static const float a[6] = {1, 1, 1, 1, 1, 1};
  zs_motion m;
  assert_true(zs_motion_find(&m, a, a, 2, 3, 100, true));
  zs_motion_clear(&m);
  assert_true(zs_motion_find(&m, a, a, 3, 2, 100, false));
  zs_motion_clear(&m);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_still),  cmocka_unit_test(test_moves), cmocka_unit_test(test_gate),
    cmocka_unit_test(test_limits), cmocka_unit_test(test_small),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
