/* Pictures as input: what was written is read, and what is no picture is not. */
#include "set_up.h"

#include "files/gray.h"
#include "files/image.h"

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static bool near(float a, double b)
{
  return fabs((double)a - b) < 1e-6;
}

/* Grey ones come back exactly; of colours the luminance. */
static void pngs_are_read(void **state)
{
  (void)state;
  for (uint32_t channels = 1; channels <= 3; channels += 2)
    for (uint32_t width = 1; width < 20; width += 3) {
      zs_image image;
      const char *path = scratch_path(&folder, "a.png");
      assert_true(zs_image_allocate(&image, width, 5, channels, NULL));
      for (size_t i = 0; i < (size_t)width * 5 * channels; i++)
        image.pixels[i] = (uint8_t)((i / channels) * 89 + 1); /* r = g = b */
      assert_true(zs_image_write(&image, path, NULL));
      zs_gray gray;
      assert_true(zs_gray_read(&gray, path, 1, NULL));
      assert_int_equal(gray.width, width);
      assert_int_equal(gray.height, 5);
      for (size_t i = 0; i < (size_t)width * 5; i++)
        assert_true(fabs((double)gray.pixels[i] - image.pixels[i * channels] / 255.0) < 0.005);
      zs_gray_clear(&gray);
      zs_image_clear(&image);
    }
}

static void two_tone_and_deep_pngs_are_read(void **state)
{
  (void)state;
  static const uint8_t bits[4] = {0, 255, 255, 0};
  static const uint16_t deep[4] = {0, 1000, 40000, 65535};
  zs_image image = {2, 2, 1, (uint8_t *)bits};
  const char *path = scratch_path(&folder, "bits.png"); /* of one bit a pixel */
  assert_true(zs_image_write(&image, path, NULL));
  zs_gray gray;
  assert_true(zs_gray_read(&gray, path, 1, NULL));
  for (int i = 0; i < 4; i++)
    assert_true(near(gray.pixels[i], bits[i] / 255));
  zs_gray_clear(&gray);
  uint8_t bytes[8];
  for (int i = 0; i < 4; i++) {
    bytes[2 * i] = (uint8_t)(deep[i] >> 8);
    bytes[2 * i + 1] = (uint8_t)deep[i];
  }
  path = scratch_path(&folder, "deep.png");
  FILE *file = fopen(path, "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, 2, 2, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, 0, 0);
  png_write_info(png, info);
  png_write_row(png, bytes);
  png_write_row(png, bytes + 4);
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  assert_int_equal(fclose(file), 0);
  assert_true(zs_gray_read(&gray, path, 1, NULL));
  for (int i = 0; i < 4; i++)
    assert_true(near(gray.pixels[i], deep[i] / 65535.0));
  zs_gray_clear(&gray);
}

static void pgms_are_read(void **state)
{
  (void)state;
  static const struct {
    const char *bytes;
    size_t length;
  } files[] = {{"P2\n# made by hand\n3 2\n200\n0 50 100\n150 200 20\n", 0},
               {"P5 3 2 200\n\0\062\144\226\310\024", 17},
               {"P5\n3 2\n2000\n\0\0\001\364\003\350\005\334\007\320\0\310", 24}};
  static const double expected[6] = {0, 0.25, 0.5, 0.75, 1, 0.1};
  for (size_t f = 0; f < 3; f++) {
    const size_t length = files[f].length ? files[f].length : strlen(files[f].bytes);
    zs_gray gray;
    assert_true(zs_gray_read(&gray, written("a.pgm", files[f].bytes, length), 1, NULL));
    assert_int_equal(gray.width, 3);
    assert_int_equal(gray.height, 2);
    for (int i = 0; i < 6; i++)
      assert_true(near(gray.pixels[i], expected[i]));
    zs_gray_clear(&gray);
  }
}

static void keep_message(void *context, const zs_diagnostic *diagnostic)
{
  snprintf(context, 512, "%s", diagnostic->message);
}

static void bad_files_are_refused(void **state)
{
  (void)state;
  static const struct {
    const char *bytes, *message;
  } cases[] = {
    {"", "not a picture"},
    {"P", "not a picture"},
    {"P6\n1 1\n255\n000", "not a picture"},
    {"P2\n", "header"},
    {"P2 2 x 5", "header"},
    {"P2 2 2 0\n0 0 0 0", "header"},
    {"P2 2 2 70000\n0 0 0 0", "header"},
    {"P2 0 2 10\n", "0 x 2 pixels"},
    {"P2 99999999999999 2 10\n", "pixels"},
    {"P2 2 2 10\n0 0 0", "ends too early"},
    {"P2 2 2 10\n0 0 -3 0", "ends too early"},
    {"P2 2 2 10\n0 0 11 0", "brighter"},
    {"P5 2 2 255\n123", "ends too early"},
    {"\x89PNG\r\n\x1a\n", "malformed"},
    {"\x89PNG nonsense", "malformed"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char message[512] = "";
    zs_diag diag = {.report = keep_message, .context = message};
    zs_gray gray;
    const char *path = written("bad", cases[i].bytes, strlen(cases[i].bytes));
    assert_false(zs_gray_read(&gray, path, 1, &diag));
    assert_null(gray.pixels);
    if (!strstr(message, cases[i].message))
      fail_msg("case %zu: %s", i, message);
  }
  zs_gray gray;
  zs_diag diag = {0};
  assert_false(zs_gray_read(&gray, scratch_path(&folder, "absent.png"), 1, &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
}

/* Any beginning of a file is refused, whatever is missing. */
static void truncated_pngs_are_refused(void **state)
{
  (void)state;
  zs_image image;
  const char *path = scratch_path(&folder, "whole.png");
  assert_true(zs_image_allocate(&image, 40, 30, 1, NULL));
  for (size_t i = 0; i < 1200; i++)
    image.pixels[i] = (uint8_t)(i * i * 31);
  assert_true(zs_image_write(&image, path, NULL));
  zs_image_clear(&image);
  size_t length;
  char *bytes = read_whole(path, &length);
  for (size_t n = 0; n + 12 < length; n += 7) { /* the last chunk has no data */
    zs_gray gray;
    assert_false(zs_gray_read(&gray, written("part.png", bytes, n), 1, NULL));
    assert_null(gray.pixels);
  }
  free(bytes);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(pngs_are_read),
    cmocka_unit_test(two_tone_and_deep_pngs_are_read),
    cmocka_unit_test(pgms_are_read),
    cmocka_unit_test(bad_files_are_refused),
    cmocka_unit_test(truncated_pngs_are_refused),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
