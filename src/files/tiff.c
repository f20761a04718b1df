#include "files/tiff.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <tiffio.h>
#include <unistd.h>

/* libtiff's own memory for one thing, and ours for a tile; samples of a pixel; pages. */
static const tmsize_t MOST_BYTES = (tmsize_t)1 << 30;
static const uint64_t MOST_TILE = (uint64_t)1 << 28;
enum { MOST_SAMPLES = 64, MOST_PAGES = 65536 };

struct zs_tiff {
  TIFF *file;
  const char *path;
  zs_diag *diag;
  zs_gray_meaning meaning;
  size_t page;       /* from 1; 0: none yet */
  uint32_t directories; /* passed, pages and others */
  char message[160]; /* libtiff's first complaint about the page */
};

/* How the samples of a page stand. */
typedef struct layout {
  uint32_t width, height; /* as stored */
  uint16_t samples, bits, format, photometric, orientation;
  bool separate;          /* samples of one kind after the other */
  const uint16_t *palette[3];
  unsigned colours;       /* samples that count: 1 or 3 */
  double most;            /* the number that is white */
} layout;

/* What the first three samples of colours weigh: PNG files are read with the same. */
static const double luminance[3] = {6968 / 32768.0, 23434 / 32768.0, 2366 / 32768.0};

/* ---- Messages --------------------------------------------------------------------------- */

/* libtiff must neither print nor ask handlers of the whole process. */
static int keep_error(TIFF *file, void *context, const char *module, const char *format,
                      va_list arguments)
{
  (void)file, (void)module;
  zs_tiff *t = context;
  if (!t->message[0])
    vsnprintf(t->message, sizeof t->message, format, arguments);
  return 1;
}

static int drop_warning(TIFF *file, void *context, const char *module, const char *format,
                        va_list arguments)
{
  (void)file, (void)context, (void)module, (void)format, (void)arguments;
  return 1;
}

static bool fail_malformed(const zs_tiff *t)
{
  return zs_fail(t->diag, ZS_ERROR_SYNTAX, t->path, "page %zu of the TIFF file is malformed: %s",
                 t->page ? t->page : 1, t->message[0] ? t->message : "it cannot be decoded");
}

static bool fail_unknown(const zs_tiff *t, const char *what, unsigned number, const char *expected)
{
  return zs_fail(t->diag, ZS_ERROR_SYNTAX, t->path,
                 "page %zu of the TIFF file has %s %u, which cannot be read; expected %s", t->page,
                 what, number, expected);
}

/* ---- Pages -------------------------------------------------------------------------------- */

/* A descriptor of a regular file; -1 after reporting. */
static int open_regular(const char *path, zs_diag *diag)
{
  struct stat status;
  const int descriptor = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0 || fstat(descriptor, &status) != 0)
    zs_fail(diag, ZS_ERROR_IO, path, "cannot be opened: %s", strerror(errno));
  else if (!S_ISREG(status.st_mode))
    zs_fail(diag, ZS_ERROR_IO, path, "is not a regular file");
  else
    return descriptor;
  if (descriptor >= 0)
    close(descriptor);
  return -1;
}

zs_tiff *zs_tiff_open(const char *path, zs_gray_meaning meaning, zs_diag *diag)
{
  zs_tiff *t = calloc(1, sizeof *t);
  TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
  int descriptor = -1;
  if (!t || !options)
    zs_fail_memory(diag);
  else
    descriptor = open_regular(path, diag);
  if (descriptor >= 0) {
    *t = (zs_tiff){.path = path, .diag = diag, .meaning = meaning};
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_error, t);
    TIFFOpenOptionsSetWarningHandlerExtR(options, drop_warning, t);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options, MOST_BYTES);
    /* Not mapped into memory: a file that shrinks meanwhile would end the process. */
    t->file = TIFFFdOpenExt(descriptor, path, "rm", options);
    if (!t->file) {
      fail_malformed(t);
      close(descriptor);
    }
  }
  if (options)
    TIFFOpenOptionsFree(options);
  if (t && t->file)
    return t;
  free(t);
  return NULL;
}

void zs_tiff_close(zs_tiff *tiff)
{
  if (!tiff)
    return;
  TIFFClose(tiff->file);
  free(tiff);
}

/* Whether the directory is of a page rather than of a copy or a mask of one. */
static bool is_page(const zs_tiff *t)
{
  uint32_t type = 0;
  TIFFGetFieldDefaulted(t->file, TIFFTAG_SUBFILETYPE, &type);
  return !(type & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK));
}

zs_gray_page zs_tiff_next(zs_tiff *t)
{
  do {
    t->message[0] = '\0';
    if (t->directories > 0) { /* opening has read the first one */
      if (TIFFLastDirectory(t->file))
        return ZS_GRAY_END;
      if (!TIFFReadDirectory(t->file)) {
        t->page++;
        fail_malformed(t);
        return ZS_GRAY_FAILED;
      }
    }
    if (++t->directories > MOST_PAGES) {
      zs_fail(t->diag, ZS_ERROR_SYNTAX, t->path, "the TIFF file has more than %d pages",
              MOST_PAGES);
      return ZS_GRAY_FAILED;
    }
  } while (!is_page(t));
  t->page++;
  return ZS_GRAY_PAGE;
}

/* ---- Samples ------------------------------------------------------------------------------ */

/* A whole number of any bits, the most significant first. */
static double packed(const uint8_t *bytes, size_t i, unsigned bits)
{
  uint32_t number = 0;
  for (size_t bit = i * bits; bit < (i + 1) * bits; bit++)
    number = 2 * number + (bytes[bit / 8] >> (7 - bit % 8) & 1);
  return number;
}

#define LOAD(TYPE) \
  do { \
    TYPE number; \
    memcpy(&number, bytes + i * sizeof number, sizeof number); \
    return (double)number; \
  } while (0)

/* Number `i` of a row in this machine's byte order. */
static double number_at(const layout *l, const uint8_t *bytes, size_t i)
{
  if (l->format == SAMPLEFORMAT_IEEEFP && l->bits == 32)
    LOAD(float);
  if (l->format == SAMPLEFORMAT_IEEEFP)
    LOAD(double);
  const bool sign = l->format == SAMPLEFORMAT_INT;
  switch (sign ? -(int)l->bits : (int)l->bits) {
  case 8: LOAD(uint8_t);
  case -8: LOAD(int8_t);
  case 16: LOAD(uint16_t);
  case -16: LOAD(int16_t);
  case 32: LOAD(uint32_t);
  case -32: LOAD(int32_t);
  default: return packed(bytes, i, l->bits);
  }
}

/* From a number in the file to what a pixel has. */
static double pixel_of(const zs_tiff *t, const layout *l, double number)
{
  static const double MOST = 1e30; /* differences of such still fit */
  if (isnan(number))
    return 0;
  if (l->palette[0]) {
    double sum = 0;
    for (int k = 0; k < 3; k++)
      sum += luminance[k] * l->palette[k][(size_t)number];
    return sum / 65535;
  }
  const double part = fmin(fmax(number / l->most, -MOST), MOST);
  if (l->photometric == PHOTOMETRIC_MINISWHITE && t->meaning == ZS_GRAY_BRIGHTNESS)
    return 1 - part;
  return part;
}

/* Where a stored pixel goes: first + column * across + row * down. */
typedef struct order {
  ptrdiff_t first, across, down;
} order;

static order order_of(const layout *l)
{
  const ptrdiff_t w = l->width, h = l->height;
  switch (l->orientation) {
  case ORIENTATION_TOPRIGHT: return (order){w - 1, -1, w};
  case ORIENTATION_BOTRIGHT: return (order){w * h - 1, -1, -w};
  case ORIENTATION_BOTLEFT: return (order){w * (h - 1), 1, -w};
  case ORIENTATION_LEFTTOP: return (order){0, h, 1};
  case ORIENTATION_RIGHTTOP: return (order){h - 1, h, -1};
  case ORIENTATION_RIGHTBOT: return (order){w * h - 1, -h, -1};
  case ORIENTATION_LEFTBOT: return (order){h * (w - 1), -h, 1};
  default: return (order){0, 1, w};
  }
}

/* A row of samples, from a column on, for the picture.  `plane` of separate ones. */
static void take_row(const zs_tiff *t, const layout *l, const uint8_t *bytes, uint32_t row,
                     uint32_t column, uint32_t count, unsigned plane, float *pixels)
{
  const order o = order_of(l);
  const size_t step = l->separate ? 1 : l->samples;
  const unsigned together = l->separate ? 1 : l->colours;
  float *to = pixels + o.first + (ptrdiff_t)column * o.across + (ptrdiff_t)row * o.down;
  for (size_t x = 0; x < count; x++, to += o.across) {
    double sum = 0;
    for (unsigned k = 0; k < together; k++)
      sum += pixel_of(t, l, number_at(l, bytes, x * step + k)) *
             (l->colours > 1 ? luminance[plane + k] : 1);
    *to = (float)(plane ? *to + sum : sum);
  }
}

/* Whether so many bytes hold a row of pixels. */
static bool is_enough(const layout *l, uint64_t pixels, uint64_t bytes)
{
  return bytes >= (pixels * (l->separate ? 1 : l->samples) * l->bits + 7) / 8;
}

static bool read_strips(zs_tiff *t, const layout *l, float *pixels)
{
  const tmsize_t size = TIFFScanlineSize(t->file);
  if (!is_enough(l, l->width, size > 0 ? (uint64_t)size : 0))
    return fail_malformed(t);
  uint8_t *bytes = calloc(1, (size_t)size);
  bool done = bytes || zs_fail_memory(t->diag);
  for (unsigned plane = 0; done && plane < (l->separate ? l->colours : 1); plane++)
    for (uint32_t y = 0; done && y < l->height; y++) {
      done = TIFFReadScanline(t->file, bytes, y, (uint16_t)plane) == 1 || fail_malformed(t);
      if (done)
        take_row(t, l, bytes, y, 0, l->width, plane, pixels);
    }
  free(bytes);
  return done;
}

static bool read_tiles(zs_tiff *t, const layout *l, float *pixels)
{
  uint32_t width = 0, height = 0;
  TIFFGetField(t->file, TIFFTAG_TILEWIDTH, &width);
  TIFFGetField(t->file, TIFFTAG_TILELENGTH, &height);
  const uint64_t size = TIFFTileSize64(t->file), row = TIFFTileRowSize64(t->file);
  if (!width || !height || !is_enough(l, width, row) || size / row < height || size > MOST_TILE)
    return zs_fail(t->diag, ZS_ERROR_SYNTAX, t->path,
                   "page %zu of the TIFF file has tiles of %u x %u pixels, which cannot be read",
                   t->page, width, height);
  uint8_t *bytes = calloc(1, size);
  bool done = bytes || zs_fail_memory(t->diag);
  for (unsigned plane = 0; done && plane < (l->separate ? l->colours : 1); plane++)
    for (uint32_t y = 0; done && y < l->height; y += height)
      for (uint32_t x = 0; done && x < l->width; x += width) {
        done = TIFFReadTile(t->file, bytes, x, y, 0, (uint16_t)plane) >= 0 || fail_malformed(t);
        for (uint32_t j = 0; done && j < height && j < l->height - y; j++)
          take_row(t, l, bytes + j * row, y + j, x, width < l->width - x ? width : l->width - x,
                   plane, pixels);
      }
  free(bytes);
  return done;
}

/* ---- Pictures --------------------------------------------------------------------------- */

static bool check_numbers(const zs_tiff *t, const layout *l)
{
  const bool real = l->format == SAMPLEFORMAT_IEEEFP;
  if (l->format != SAMPLEFORMAT_UINT && l->format != SAMPLEFORMAT_INT && !real)
    return fail_unknown(t, "the sample format", l->format, "1 to 3");
  if (real ? l->bits != 32 && l->bits != 64
           : l->format == SAMPLEFORMAT_INT ? l->bits != 8 && l->bits != 16 && l->bits != 32
                                           : l->bits < 1 || (l->bits > 16 && l->bits != 32))
    return fail_unknown(t, "samples whose bits are", l->bits,
                        real ? "floating-point numbers of 32 or 64"
                             : "whole numbers of 1 to 16, or 32");
  if (l->samples < 1 || l->samples > MOST_SAMPLES)
    return fail_unknown(t, "samples in a pixel:", l->samples, "1 to 64");
  return true;
}

/* How colours are told; false after reporting. */
static bool find_colours(const zs_tiff *t, layout *l)
{
  uint16_t *palette[3];
  uint16_t compression = 0;
  TIFFGetFieldDefaulted(t->file, TIFFTAG_COMPRESSION, &compression);
  switch (l->photometric) {
  case PHOTOMETRIC_MINISWHITE:
  case PHOTOMETRIC_MINISBLACK:
  case PHOTOMETRIC_MASK:
    return true;
  case PHOTOMETRIC_PALETTE:
    if (t->meaning == ZS_GRAY_NUMBERS)
      return true;
    if (l->format != SAMPLEFORMAT_UINT || l->bits > 16 ||
        !TIFFGetField(t->file, TIFFTAG_COLORMAP, &palette[0], &palette[1], &palette[2]))
      return zs_fail(t->diag, ZS_ERROR_SYNTAX, t->path,
                     "page %zu of the TIFF file has colours of a palette, but no palette",
                     t->page);
    memcpy(l->palette, palette, sizeof palette);
    return true;
  case PHOTOMETRIC_YCBCR: /* libtiff turns it into RGB */
    if (compression != COMPRESSION_JPEG || l->separate ||
        !TIFFSetField(t->file, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB))
      break;
    /* fall through */
  case PHOTOMETRIC_RGB:
    if (l->samples < 3)
      break;
    l->colours = 3;
    return true;
  default:
    break;
  }
  return fail_unknown(t, "the photometric interpretation", l->photometric,
                      "grey (0, 1), RGB (2), a palette (3), or YCbCr (6) by JPEG");
}

static bool find_layout(const zs_tiff *t, layout *l)
{
  uint16_t planes = PLANARCONFIG_CONTIG;
  *l = (layout){.colours = 1, .photometric = PHOTOMETRIC_MINISBLACK};
  TIFFGetField(t->file, TIFFTAG_IMAGEWIDTH, &l->width);
  TIFFGetField(t->file, TIFFTAG_IMAGELENGTH, &l->height);
  TIFFGetFieldDefaulted(t->file, TIFFTAG_SAMPLESPERPIXEL, &l->samples);
  TIFFGetFieldDefaulted(t->file, TIFFTAG_BITSPERSAMPLE, &l->bits);
  TIFFGetFieldDefaulted(t->file, TIFFTAG_SAMPLEFORMAT, &l->format);
  TIFFGetFieldDefaulted(t->file, TIFFTAG_PLANARCONFIG, &planes);
  TIFFGetFieldDefaulted(t->file, TIFFTAG_ORIENTATION, &l->orientation);
  TIFFGetField(t->file, TIFFTAG_PHOTOMETRIC, &l->photometric);
  l->separate = planes == PLANARCONFIG_SEPARATE;
  if (l->format == SAMPLEFORMAT_VOID)
    l->format = SAMPLEFORMAT_UINT;
  if (!check_numbers(t, l) || !find_colours(t, l))
    return false;
  l->most = l->format == SAMPLEFORMAT_IEEEFP
              ? 1
              : ldexp(1, l->format == SAMPLEFORMAT_INT ? l->bits - 1 : l->bits) - 1;
  return true;
}

/* Sides of a stored pixel in millimetres; 0 where the file does not say. */
static void find_sides(const zs_tiff *t, const layout *l, double side[2])
{
  float x = 0, y = 0;
  uint16_t unit = RESUNIT_INCH;
  TIFFGetFieldDefaulted(t->file, TIFFTAG_RESOLUTIONUNIT, &unit);
  const double length = unit == RESUNIT_INCH ? 25.4 : unit == RESUNIT_CENTIMETER ? 10 : 0;
  side[0] = side[1] = 0;
  if (!TIFFGetField(t->file, TIFFTAG_XRESOLUTION, &x) ||
      !TIFFGetField(t->file, TIFFTAG_YRESOLUTION, &y) || !(x > 0 && y > 0))
    return;
  const bool turned = l->orientation >= ORIENTATION_LEFTTOP;
  side[turned] = length / (double)x;
  side[!turned] = length / (double)y;
}

bool zs_tiff_read(zs_tiff *t, zs_gray *gray)
{
  layout l;
  *gray = (zs_gray){0};
  if (!find_layout(t, &l))
    return false;
  const bool turned = l.orientation >= ORIENTATION_LEFTTOP;
  if (!zs_gray_allocate(gray, turned ? l.height : l.width, turned ? l.width : l.height, t->path,
                        t->diag))
    return false;
  gray->white = (uint32_t)l.most;
  gray->colour = l.colours > 1;
  find_sides(t, &l, gray->side);
  if (TIFFIsTiled(t->file) ? read_tiles(t, &l, gray->pixels) : read_strips(t, &l, gray->pixels))
    return true;
  zs_gray_clear(gray);
  return false;
}
