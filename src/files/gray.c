#include "files/gray.h"

#include "files/image.h"

#include <ctype.h>
#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

void zs_gray_clear(zs_gray *gray)
{
  free(gray->pixels);
  *gray = (zs_gray){0};
}

/* A file that is being read. */
typedef struct reader {
  const char *path;
  FILE *stream;
  zs_diag *diag;
  zs_gray *gray;
} reader;

static bool fail(const reader *r, const char *problem)
{
  return zs_fail(r->diag, ZS_ERROR_SYNTAX, r->path, "%s", problem);
}

static bool fail_truncated(const reader *r)
{
  return ferror(r->stream)
           ? zs_fail(r->diag, ZS_ERROR_IO, r->path, "cannot be read: %s", strerror(errno))
           : fail(r, "the picture ends too early");
}

static bool allocate(reader *r, unsigned long width, unsigned long height)
{
  if (width - 1 >= ZS_IMAGE_LARGEST || height - 1 >= ZS_IMAGE_LARGEST)
    return zs_fail(r->diag, ZS_ERROR_SYNTAX, r->path,
                   "the picture has %lu x %lu pixels; expected 1 to %d each way", width, height,
                   ZS_IMAGE_LARGEST);
  r->gray->pixels = malloc(width * height * sizeof *r->gray->pixels);
  if (!r->gray->pixels)
    return zs_fail_memory(r->diag);
  r->gray->width = (uint32_t)width;
  r->gray->height = (uint32_t)height;
  return true;
}

/* ---- PGM --------------------------------------------------------------------- */

/* The next number of a text, behind blanks and comments; -1: there is none. */
static long next_number(FILE *stream)
{
  int c = getc(stream);
  while (c == '#' || isspace(c)) {
    if (c == '#')
      while (c != '\n' && c != EOF)
        c = getc(stream);
    c = getc(stream);
  }
  if (c < '0' || c > '9')
    return -1;
  long number = 0;
  for (; c >= '0' && c <= '9'; c = getc(stream))
    if (number <= 1000000)
      number = 10 * number + (c - '0');
  ungetc(c, stream);
  return number;
}

/* The next sample of a file with 1 or 2 bytes each; -1: there is none. */
static long next_sample(FILE *stream, int bytes)
{
  int high = bytes == 2 ? getc(stream) : 0, low = getc(stream);
  return high == EOF || low == EOF ? -1 : 256L * high + low;
}

static bool read_pgm(reader *r, bool text)
{
  const long width = next_number(r->stream), height = next_number(r->stream),
             most = next_number(r->stream);
  if (width < 0 || height < 0 || most < 1 || most > 65535)
    return fail(r, "the header of the PGM file is malformed");
  if (!allocate(r, (unsigned long)width, (unsigned long)height))
    return false;
  if (!text)
    getc(r->stream); /* one blank */
  const size_t count = (size_t)width * (size_t)height;
  for (size_t i = 0; i < count; i++) {
    const long sample = text ? next_number(r->stream) : next_sample(r->stream, most > 255 ? 2 : 1);
    if (sample < 0)
      return fail_truncated(r);
    if (sample > most)
      return fail(r, "a pixel is brighter than the header says is possible");
    r->gray->pixels[i] = (float)sample / (float)most;
  }
  r->gray->white = (uint32_t)most;
  return true;
}

/* ---- PNG --------------------------------------------------------------------- */

/* What the decoder works with; its errors jump to `escape`. */
typedef struct decoder {
  reader *reader;
  png_structp png;
  png_infop info;
  png_bytep bytes, *rows; /* of the whole picture: it may be interlaced */
  jmp_buf escape;
  bool reported;
  char message[128];
} decoder;

static void decoder_error(png_structp png, png_const_charp message)
{
  decoder *d = png_get_error_ptr(png);
  snprintf(d->message, sizeof d->message, "%s", message);
  longjmp(d->escape, 1);
}

static void decoder_warning(png_structp png, png_const_charp message)
{
  (void)png, (void)message;
}

/* Ask for grey samples of 8 or 16 bits and nothing else. */
static void ask_for_gray(png_structp png, png_infop info)
{
  enum { ERROR_ACTION_SILENT = 1 };
  png_set_expand(png);
  png_set_strip_alpha(png);
  if (png_get_color_type(png, info) & PNG_COLOR_MASK_COLOR)
    png_set_rgb_to_gray(png, ERROR_ACTION_SILENT, -1, -1);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
}

static bool make_rows(decoder *d, size_t stride)
{
  const uint32_t height = d->reader->gray->height;
  d->bytes = malloc(stride * height);
  d->rows = malloc(height * sizeof *d->rows);
  if (!d->bytes || !d->rows)
    return zs_fail_memory(d->reader->diag);
  for (uint32_t y = 0; y < height; y++)
    d->rows[y] = d->bytes + y * stride;
  return true;
}

static void deliver(const decoder *d, bool wide)
{
  zs_gray *gray = d->reader->gray;
  gray->white = wide ? 65535 : 255;
  for (uint32_t y = 0; y < gray->height; y++)
    for (uint32_t x = 0; x < gray->width; x++) {
      const png_bytep row = d->rows[y];
      gray->pixels[(size_t)y * gray->width + x] =
        wide ? (float)(256 * row[2 * x] + row[2 * x + 1]) / 65535 : (float)row[x] / 255;
    }
}

/* In a function of its own, so that no local variable outlives a jump. */
static bool decode(decoder *d)
{
  if (setjmp(d->escape))
    return false;
  png_set_user_limits(d->png, ZS_IMAGE_LARGEST, ZS_IMAGE_LARGEST);
  png_init_io(d->png, d->reader->stream);
  png_read_info(d->png, d->info);
  ask_for_gray(d->png, d->info);
  d->reported = true;
  if (!allocate(d->reader, png_get_image_width(d->png, d->info),
                png_get_image_height(d->png, d->info)) ||
      !make_rows(d, png_get_rowbytes(d->png, d->info)))
    return false;
  d->reported = false;
  png_read_image(d->png, d->rows);
  deliver(d, png_get_bit_depth(d->png, d->info) == 16);
  return true;
}

static bool read_png(reader *r)
{
  decoder d = {.reader = r};
  d.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &d, decoder_error, decoder_warning);
  d.info = d.png ? png_create_info_struct(d.png) : NULL;
  const bool good = d.info && decode(&d);
  png_destroy_read_struct(&d.png, &d.info, NULL);
  free(d.bytes);
  free(d.rows);
  if (good || d.reported)
    return good;
  if (!d.message[0])
    return zs_fail_memory(r->diag);
  return zs_fail(r->diag, ZS_ERROR_SYNTAX, r->path, "the PNG file is malformed: %s", d.message);
}

/* ---- Both -------------------------------------------------------------------- */

static bool read_any(reader *r)
{
  const int first = getc(r->stream), second = getc(r->stream);
  if (first == 'P' && (second == '2' || second == '5'))
    return read_pgm(r, second == '2');
  rewind(r->stream);
  if (first == 0x89 && second == 'P')
    return read_png(r);
  return fail(r, "this is not a picture; expected a PNG or PGM file");
}

bool zs_gray_read(zs_gray *gray, const char *path, zs_diag *diag)
{
  *gray = (zs_gray){0};
  reader r = {.path = path, .diag = diag, .gray = gray, .stream = fopen(path, "rb")};
  if (!r.stream)
    return zs_fail(diag, ZS_ERROR_IO, path, "cannot be opened: %s", strerror(errno));
  const bool done = read_any(&r);
  fclose(r.stream);
  if (!done)
    zs_gray_clear(gray);
  return done;
}
