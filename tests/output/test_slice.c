/* Cross-sections: orientation, sampling at pixel centres, and no shortcut shows. */
#include "formula.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static const double lo[3] = {-1, -2, -3}, hi[3] = {1, 2, 3};

static zs_image slice(const char *formula, int axis, double at, uint32_t width, uint32_t height,
                      zs_quantity quantity, const zs_control *control, uint64_t *inside)
{
  zs_field *field = formula_field(formula);
  assert_non_null(field);
  zs_slice_options options;
  zs_slice_options_init(&options);
  options.axis = axis;
  options.at = at;
  options.width = width;
  options.height = height;
  options.quantity = quantity;
  zs_image image;
  assert_true(zs_slice(field, lo, hi, &options, &image, inside, control, NULL, NULL));
  assert_int_equal(image.width, width);
  assert_int_equal(image.height, height);
  assert_int_equal(image.channels, quantity == ZS_QUANTITY_INSIDE ? 1 : 3);
  zs_field_unref(field);
  return image;
}

/* Where the centre of a pixel is, by the manual's words: pixels are square,
 * the box is centred, and the slice is seen from the axis' positive end. */
static bool pixel_place(const zs_image *image, int axis, double at, uint32_t column, uint32_t row,
                        double place[3])
{
  const int right = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
  double pixel = fmax((hi[right] - lo[right]) / image->width, (hi[up] - lo[up]) / image->height);
  double across = (column + 0.5 - image->width / 2.0) * pixel;
  place[axis] = at;
  place[right] = (lo[right] + hi[right]) / 2 + (axis == 1 ? -across : across);
  place[up] = (lo[up] + hi[up]) / 2 - (row + 0.5 - image->height / 2.0) * pixel;
  return place[right] >= lo[right] && place[right] <= hi[right] && place[up] >= lo[up] &&
         place[up] <= hi[up];
}

/* An asymmetric solid that every slice below cuts, as formula and in C. */
static const char wedge[] =
  "min(0.4 + 0.31 * x - 0.23 * y + 0.17 * z, 1.9 - abs(x) - abs(y - 0.2))";

static double wedge_value(const double p[3])
{
  return fmin(0.4 + 0.31 * p[0] - 0.23 * p[1] + 0.17 * p[2],
              1.9 - fabs(p[0]) - fabs(p[1] - 0.2));
}

static void test_inside(void **state)
{
  (void)state;
  static const uint32_t sizes[][2] = {{64, 64}, {101, 37}, {37, 101}, {1, 1}, {16, 200}};
  for (int axis = 0; axis < 3; axis++)
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
      uint64_t inside, count = 0;
      const double at = 0.25;
      zs_image image =
        slice(wedge, axis, at, sizes[s][0], sizes[s][1], ZS_QUANTITY_INSIDE, NULL, &inside);
      for (uint32_t row = 0; row < image.height; row++)
        for (uint32_t column = 0; column < image.width; column++) {
          double p[3];
          bool in_box = pixel_place(&image, axis, at, column, row, p);
          uint8_t seen = image.pixels[row * image.width + column];
          count += seen == 255;
          if (!in_box)
            assert_int_equal(seen, 0);
          else if (fabs(wedge_value(p)) > 1e-5)
            assert_int_equal(seen, wedge_value(p) >= 0 ? 255 : 0);
        }
      assert_int_equal(inside, count);
      zs_image_clear(&image);
    }
}

static void test_shortcuts(void **state)
{
  (void)state;
  for (int axis = 0; axis < 3; axis++)
    for (int quantity = 0; quantity < 2; quantity++) {
      zs_control control;
      zs_control_init(&control);
      control.brute = true;
      control.threads = 1;
      uint64_t expected_inside, inside;
      zs_image expected =
        slice(wedge, axis, -0.5, 150, 170, (zs_quantity)quantity, &control, &expected_inside);
      for (unsigned threads = 1; threads <= 3; threads++) {
        zs_control_init(&control);
        control.threads = threads;
        zs_image image =
          slice(wedge, axis, -0.5, 150, 170, (zs_quantity)quantity, &control, &inside);
        assert_memory_equal(image.pixels, expected.pixels, (size_t)150 * 170 * image.channels);
        assert_int_equal(inside, expected_inside);
        zs_image_clear(&image);
      }
      zs_image_clear(&expected);
    }
}

/* Inside is warm, outside cold, the zero line dark, and so are contour lines. */
static void test_colours(void **state)
{
  (void)state;
  zs_image image = slice("0.75 - hypot(x, y)", 2, 0, 300, 600, ZS_QUANTITY_VALUE, NULL, NULL);
  const double pixel = 4.0 / 600;
  for (uint32_t row = 0; row < 600; row++)
    for (uint32_t column = 0; column < 300; column++) {
      const uint8_t *rgb = image.pixels + 3 * (row * 300 + column);
      double f = 0.75 - hypot((column + 0.5) * pixel - 1, 2 - (row + 0.5) * pixel);
      if (fabs(f) < 0.5 * pixel)
        assert_true(rgb[0] < 40 && rgb[1] < 40 && rgb[2] < 40);
      if (f > 3 * pixel)
        assert_true(rgb[0] > rgb[2]);
      if (f < -3 * pixel)
        assert_true(rgb[0] < rgb[2]);
    }
  /* Along a row through the middle, lines every 0.2: dark, then light again. */
  const uint8_t *middle = image.pixels + (size_t)3 * 300 * 300;
  unsigned lines = 0;
  for (uint32_t column = 1; column < 299; column++)
    lines += middle[3 * column + 1] + 20 < middle[3 * (column - 1) + 1] &&
             middle[3 * column + 1] < middle[3 * (column + 1) + 1];
  assert_true(lines >= 4);
  zs_image_clear(&image);
}

/* Values without scale: constant, zero, unknown and infinite ones. */
static void test_odd_values(void **state)
{
  (void)state;
  static const char *const formulas[] = {"1", "0", "-1", "0 / (0 * x)", "1 / (0 * x)", "1e30 * x",
                                         "1e-30 * x", "sqrt(x)"};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++) {
    zs_image image = slice(formulas[i], 2, 0, 20, 40, ZS_QUANTITY_VALUE, NULL, NULL);
    const uint8_t *centre = image.pixels + (size_t)3 * (20 * 20 + 10);
    bool unknown = i == 3;
    assert_int_equal(centre[0] == centre[2], unknown); /* grey */
    zs_image_clear(&image);
  }
}

static void test_bad(void **state)
{
  (void)state;
  zs_field *field = formula_field(wedge);
  assert_non_null(field);
  zs_slice_options good;
  zs_slice_options_init(&good);
  zs_slice_options bad[9];
  for (int i = 0; i < 9; i++)
    bad[i] = good;
  bad[0].width = 0;
  bad[1].height = 0;
  bad[2].width = 1000000000;
  bad[3].axis = 3;
  bad[4].axis = -1;
  bad[5].at = 3.5; /* misses the box */
  bad[6].at = NAN;
  bad[7].at = -INFINITY;
  bad[8].quantity = (zs_quantity)2;
  for (int i = 0; i < 9; i++) {
    zs_image image;
    zs_diag diag = {0};
    assert_false(zs_slice(field, lo, hi, &bad[i], &image, NULL, NULL, NULL, &diag));
    assert_int_equal(diag.errors, 1);
    assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
    assert_null(image.pixels);
  }
  zs_image image;
  zs_diag diag = {0};
  assert_false(zs_slice(field, hi, lo, &good, &image, NULL, NULL, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  zs_control control;
  zs_control_init(&control);
  control.memory_limit = 1000;
  diag = (zs_diag){0};
  assert_false(zs_slice(field, lo, hi, &good, &image, NULL, &control, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_MEMORY);
  zs_field_unref(field);
}

static bool stop(void *context, const char *stage, double fraction)
{
  (void)context, (void)stage, (void)fraction;
  return false;
}

static void test_cancel(void **state)
{
  (void)state;
  zs_field *field = formula_field(wedge);
  assert_non_null(field);
  zs_slice_options options;
  zs_slice_options_init(&options);
  zs_control control;
  zs_control_init(&control);
  control.progress = stop;
  zs_image image;
  zs_diag diag = {0};
  assert_false(zs_slice(field, lo, hi, &options, &image, NULL, &control, NULL, &diag));
  assert_int_equal(diag.status, ZS_CANCELLED);
  assert_null(image.pixels);
  zs_field_unref(field);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_inside),     cmocka_unit_test(test_shortcuts),
    cmocka_unit_test(test_colours),    cmocka_unit_test(test_odd_values),
    cmocka_unit_test(test_bad),        cmocka_unit_test(test_cancel)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
