#include "files/image.h"

#include "base/memory.h"
#include "base/names.h"
#include "base/output.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

bool zs_image_size_check(uint32_t width, uint32_t height, zs_diag *diag)
{
  if (width - 1 < ZS_IMAGE_LARGEST && height - 1 < ZS_IMAGE_LARGEST)
    return true;
  return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                 "a picture of %ux%u pixels cannot be made; expected 1 to %d each way", width,
                 height, ZS_IMAGE_LARGEST);
}

bool zs_image_allocate(zs_image *image, uint32_t width, uint32_t height, uint32_t channels,
                       zs_diag *diag)
{
  *image = (zs_image){0};
  if (!zs_image_size_check(width, height, diag))
    return false;
  uint8_t *pixels = zs_memory_zeroed((size_t)width * height, channels);
  if (!pixels)
    return zs_fail_memory(diag);
  *image = (zs_image){width, height, channels, pixels};
  return true;
}

void zs_image_clear(zs_image *image)
{
  if (!image)
    return;
  free(image->pixels);
  *image = (zs_image){0};
}

/* What the encoder works with; its errors jump to `escape`. */
typedef struct encoder {
  const zs_image *image;
  FILE *stream;
  uint8_t *row; /* of a picture with one bit a pixel */
  jmp_buf escape;
  char message[128];
} encoder;

static void encoder_error(png_structp png, png_const_charp message)
{
  encoder *e = png_get_error_ptr(png);
  snprintf(e->message, sizeof e->message, "%s", message);
  longjmp(e->escape, 1);
}

static void encoder_warning(png_structp png, png_const_charp message)
{
  (void)png, (void)message;
}

static void encoder_write(png_structp png, png_bytep bytes, png_size_t length)
{
  encoder *e = png_get_io_ptr(png);
  if (fwrite(bytes, 1, length, e->stream) != length)
    png_error(png, strerror(errno));
}

/* The stream's owner flushes it. */
static void encoder_flush(png_structp png)
{
  (void)png;
}

/* Whether a grey picture has black and white pixels only. */
static bool two_tone(const zs_image *image)
{
  if (image->channels != 1)
    return false;
  size_t n = (size_t)image->width * image->height;
  for (size_t i = 0; i < n; i++)
    if (image->pixels[i] != 0 && image->pixels[i] != 255)
      return false;
  return true;
}

static void write_rows(png_structp png, const encoder *e)
{
  const zs_image *image = e->image;
  size_t stride = (size_t)image->width * image->channels;
  for (uint32_t y = 0; y < image->height; y++) {
    const uint8_t *pixels = image->pixels + y * stride;
    if (!e->row) {
      png_write_row(png, pixels);
      continue;
    }
    memset(e->row, 0, (image->width + 7) / 8);
    for (uint32_t x = 0; x < image->width; x++)
      e->row[x / 8] |= (uint8_t)((pixels[x] & 0x80) >> (x % 8));
    png_write_row(png, e->row);
  }
}

/* Files are a tenth larger than with the usual 6, and written in less than half
 * the time, which is a part of a preview's. */
enum { LEVEL = 4 };

/* In a function of its own, so that no local variable outlives a jump. */
static bool encode(encoder *e, png_structp png, png_infop info)
{
  if (setjmp(e->escape))
    return false;
  png_set_write_fn(png, e, encoder_write, encoder_flush);
  png_set_IHDR(png, info, e->image->width, e->image->height, e->row ? 1 : 8,
               e->image->channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, LEVEL);
  png_write_info(png, info);
  write_rows(png, e);
  png_write_end(png, info);
  return true;
}

static bool write_png(const zs_image *image, FILE *stream, const char *path, zs_diag *diag)
{
  encoder e = {.image = image, .stream = stream};
  if (two_tone(image)) {
    e.row = malloc((image->width + 7) / 8);
    if (!e.row)
      return zs_fail_memory(diag);
  }
  png_structp png =
    png_create_write_struct(PNG_LIBPNG_VER_STRING, &e, encoder_error, encoder_warning);
  png_infop info = png ? png_create_info_struct(png) : NULL;
  bool good = info && encode(&e, png, info);
  png_destroy_write_struct(&png, &info);
  free(e.row);
  if (good)
    return true;
  if (!e.message[0])
    return zs_fail_memory(diag);
  return zs_fail(diag, ZS_ERROR_IO, path, "cannot be written: %s", e.message);
}

bool zs_image_write(const zs_image *image, const char *path, zs_diag *diag)
{
  if (!zs_name_ends_in(path, ".png"))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, path, "unknown kind of picture; expected a name.png");
  if (!image->pixels || (image->channels != 1 && image->channels != 3))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, path,
                   "the picture is empty, or has other than 1 or 3 channels");
  if (!zs_image_size_check(image->width, image->height, diag))
    return false;
  zs_output output;
  if (!zs_output_open(&output, path, diag))
    return false;
  if (write_png(image, output.stream, path, diag))
    return zs_output_commit(&output, diag);
  zs_output_discard(&output);
  return false;
}
