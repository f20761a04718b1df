#include "files/gray.h"

#include "files/image.h"
#include "files/tiff.h"

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

struct zs_gray_file {
  const char *path;
  FILE *stream;  /* of PNG and PGM files */
  zs_tiff *tiff; /* of others */
  zs_gray_meaning meaning;
  bool begun;    /* the picture of a PNG or PGM file has been asked for */
  zs_diag *diag;
  zs_gray *gray; /* that is being read */
};
typedef struct zs_gray_file reader;

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

bool zs_gray_allocate(zs_gray *gray, uint64_t width, uint64_t height, const char *path,
                      zs_diag *diag)
{
  if (width - 1 >= ZS_IMAGE_LARGEST || height - 1 >= ZS_IMAGE_LARGEST)
    return zs_fail(diag, ZS_ERROR_SYNTAX, path,
                   "the picture has %llu x %llu pixels; expected 1 to %d each way",
                   (unsigned long long)width, (unsigned long long)height, ZS_IMAGE_LARGEST);
  if (width * height > ZS_GRAY_MOST)
    return zs_fail(diag, ZS_ERROR_SYNTAX, path,
                   "the picture has %llu x %llu pixels; expected at most %d in all",
                   (unsigned long long)width, (unsigned long long)height, ZS_GRAY_MOST);
  gray->pixels = malloc(width * height * sizeof *gray->pixels);
  if (!gray->pixels)
    return zs_fail_memory(diag);
  gray->width = (uint32_t)width;
  gray->height = (uint32_t)height;
  return true;
}

static bool allocate(reader *r, unsigned long width, unsigned long height)
{
  return zs_gray_allocate(r->gray, width, height, r->path, r->diag);
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
  uint32_t white;
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

/* Ask for samples of 8 or 16 bits, grey or numbers, and nothing else. */
static void ask_for_gray(decoder *d)
{
  enum { ERROR_ACTION_SILENT = 1 };
  const png_structp png = d->png;
  const png_infop info = d->info;
  const int type = png_get_color_type(png, info), bits = png_get_bit_depth(png, info);
  d->white = bits == 16 ? 65535 : 255;
  if (d->reader->meaning == ZS_GRAY_NUMBERS && !(type & PNG_COLOR_MASK_ALPHA) &&
      type != PNG_COLOR_TYPE_RGB) {
    png_set_packing(png);
    d->white = (1U << bits) - 1;
  } else {
    png_set_expand(png);
    png_set_strip_alpha(png);
    d->reader->gray->colour = type == PNG_COLOR_TYPE_RGB || type == PNG_COLOR_TYPE_RGB_ALPHA;
    if (type & PNG_COLOR_MASK_COLOR)
      png_set_rgb_to_gray(png, ERROR_ACTION_SILENT, -1, -1);
  }
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
  png_uint_32 x = 0, y = 0;
  int unit = 0;
  gray->white = d->white;
  if (png_get_pHYs(d->png, d->info, &x, &y, &unit) && unit == PNG_RESOLUTION_METER && x && y) {
    gray->side[0] = 1000.0 / x;
    gray->side[1] = 1000.0 / y;
  }
  for (uint32_t y = 0; y < gray->height; y++)
    for (uint32_t x = 0; x < gray->width; x++) {
      const png_bytep row = d->rows[y];
      gray->pixels[(size_t)y * gray->width + x] =
        (float)(wide ? 256 * row[2 * x] + row[2 * x + 1] : row[x]) / (float)d->white;
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
  ask_for_gray(d);
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

/* ---- All --------------------------------------------------------------------- */

static bool is_tiff(const unsigned char start[4])
{
  static const unsigned char starts[][5] = {"II*", "MM\0*", "II+", "MM\0+"};
  for (int i = 0; i < 4; i++)
    if (memcmp(start, starts[i], 4) == 0)
      return true;
  return false;
}

static bool open_file(zs_gray_file *file)
{
  unsigned char start[4] = {0};
  file->stream = fopen(file->path, "rb");
  if (!file->stream)
    return zs_fail(file->diag, ZS_ERROR_IO, file->path, "cannot be opened: %s", strerror(errno));
  if (fread(start, 1, sizeof start, file->stream) == sizeof start && is_tiff(start)) {
    fclose(file->stream);
    file->stream = NULL;
    file->tiff = zs_tiff_open(file->path, file->meaning, file->diag);
    return file->tiff;
  }
  if (ferror(file->stream))
    return fail_truncated(file);
  rewind(file->stream);
  return true;
}

zs_gray_file *zs_gray_open(const char *path, zs_gray_meaning meaning, zs_diag *diag)
{
  zs_gray_file *file = calloc(1, sizeof *file);
  if (!file) {
    zs_fail_memory(diag);
    return NULL;
  }
  *file = (zs_gray_file){.path = path, .meaning = meaning, .diag = diag};
  if (open_file(file))
    return file;
  zs_gray_close(file);
  return NULL;
}

void zs_gray_close(zs_gray_file *file)
{
  if (!file)
    return;
  zs_tiff_close(file->tiff);
  if (file->stream)
    fclose(file->stream);
  free(file);
}

zs_gray_page zs_gray_next(zs_gray_file *file)
{
  if (file->tiff)
    return zs_tiff_next(file->tiff);
  const zs_gray_page page = file->begun ? ZS_GRAY_END : ZS_GRAY_PAGE;
  file->begun = true;
  return page;
}

static bool load(reader *r)
{
  const int first = getc(r->stream), second = getc(r->stream);
  if (first == 'P' && (second == '2' || second == '5'))
    return read_pgm(r, second == '2');
  rewind(r->stream);
  if (first == 0x89 && second == 'P')
    return read_png(r);
  return fail(r, "this is not a picture; expected a PNG, PGM or TIFF file");
}

bool zs_gray_load(zs_gray_file *file, zs_gray *gray)
{
  if (file->tiff)
    return zs_tiff_read(file->tiff, gray);
  *gray = (zs_gray){0};
  file->gray = gray;
  if (load(file))
    return true;
  zs_gray_clear(gray);
  return false;
}

bool zs_gray_read(zs_gray *gray, const char *path, size_t page, zs_diag *diag)
{
  *gray = (zs_gray){0};
  zs_gray_file *file = zs_gray_open(path, ZS_GRAY_BRIGHTNESS, diag);
  if (!file)
    return false;
  zs_gray_page found = zs_gray_next(file);
  size_t at = 1;
  for (; at < page && found == ZS_GRAY_PAGE; at++)
    found = zs_gray_next(file);
  if (found == ZS_GRAY_END)
    zs_fail(diag, ZS_ERROR_ARGUMENT, path, "there is no page %zu; the file has %zu", page, at - 1);
  const bool done = found == ZS_GRAY_PAGE && zs_gray_load(file, gray);
  zs_gray_close(file);
  return done;
}
