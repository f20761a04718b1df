/* Pictures: what is written decodes to the same pixels. */
#include "set_up.h"

#include "files/image.h"

#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static int bit_depth(const char *path)
{
  size_t length;
  char *bytes = read_whole(path, &length);
  assert_non_null(bytes);
  assert_true(length > 26);
  int depth = bytes[24];
  free(bytes);
  return depth;
}

static void assert_decodes_to(const char *path, const zs_image *image)
{
  png_image png = {.version = PNG_IMAGE_VERSION};
  assert_true(png_image_begin_read_from_file(&png, path));
  assert_int_equal(png.width, image->width);
  assert_int_equal(png.height, image->height);
  png.format = image->channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  size_t size = (size_t)image->width * image->height * image->channels;
  uint8_t *pixels = malloc(size);
  assert_non_null(pixels);
  assert_true(png_image_finish_read(&png, NULL, pixels, 0, NULL));
  assert_memory_equal(pixels, image->pixels, size);
  free(pixels);
}

static void test_round_trip(void **state)
{
  (void)state;
  for (uint32_t channels = 1; channels <= 3; channels += 2)
    for (uint32_t width = 1; width < 20; width++) {
      zs_image image;
      const char *path = scratch_path(&folder, "a.png");
      assert_true(zs_image_allocate(&image, width, 7, channels, NULL));
      for (size_t i = 0; i < (size_t)width * 7 * channels; i++)
        image.pixels[i] = (uint8_t)(i * 89 + 1);
      assert_true(zs_image_write(&image, path, NULL));
      assert_decodes_to(path, &image);
      assert_int_equal(bit_depth(path), 8);
      zs_image_clear(&image);
      assert_null(image.pixels);
    }
}

/* Black and white pictures take one bit a pixel. */
static void test_two_tone(void **state)
{
  (void)state;
  for (uint32_t width = 1; width < 20; width++) {
    zs_image image;
    const char *path = scratch_path(&folder, "b.PNG");
    assert_true(zs_image_allocate(&image, width, 5, 1, NULL));
    for (size_t i = 0; i < (size_t)width * 5; i++)
      image.pixels[i] = i * i % 7 < 3 ? 255 : 0;
    assert_true(zs_image_write(&image, path, NULL));
    assert_int_equal(bit_depth(path), 1);
    /* libpng scales one bit to 0 or 255. */
    assert_decodes_to(path, &image);
    zs_image_clear(&image);
  }
}

static void test_bad(void **state)
{
  (void)state;
  uint8_t pixel[4] = {0};
  const struct {
    zs_image image;
    const char *name;
    zs_status status;
  } cases[] = {{{1, 1, 1, pixel}, "c.jpg", ZS_ERROR_ARGUMENT},
               {{1, 1, 1, pixel}, "c", ZS_ERROR_ARGUMENT},
               {{1, 1, 2, pixel}, "c.png", ZS_ERROR_ARGUMENT},
               {{1, 1, 1, NULL}, "c.png", ZS_ERROR_ARGUMENT},
               {{0, 1, 1, pixel}, "c.png", ZS_ERROR_ARGUMENT},
               {{1, 1, 1, pixel}, "no/such/folder/c.png", ZS_ERROR_IO}};
  int before = scratch_count(&folder);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    zs_diag diag = {0};
    assert_false(zs_image_write(&cases[i].image, scratch_path(&folder, cases[i].name), &diag));
    assert_int_equal(diag.errors, 1);
    assert_int_equal(diag.status, cases[i].status);
  }
  assert_int_equal(scratch_count(&folder), before);
}

static void test_sizes(void **state)
{
  (void)state;
  const uint32_t bad[][2] = {{0, 1}, {1, 0}, {ZS_IMAGE_LARGEST + 1, 1}, {1, UINT32_MAX}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    zs_image image;
    zs_diag diag = {0};
    assert_false(zs_image_allocate(&image, bad[i][0], bad[i][1], 3, &diag));
    assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
    assert_null(image.pixels);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_round_trip), cmocka_unit_test(test_two_tone), cmocka_unit_test(test_bad),
    cmocka_unit_test(test_sizes)};
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
