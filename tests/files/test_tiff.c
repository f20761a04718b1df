/* TIFF files as input: what libtiff writes is read, page by page; what is broken is refused,
 * without a word of libtiff's own. */
#include "../random.h"
#include "set_up.h"

#include "files/gray.h"

#include <fcntl.h>
#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <tiffio.h>

#include <cmocka.h>

/* ---- Writing --------------------------------------------------------------------------- */

enum { WIDTH = 37, HEIGHT = 21, MOST = 4 };

/* A page of random numbers. */
typedef struct page {
  uint16_t bits, format, compression, photometric, samples, planes, orientation;
  uint32_t tile; /* side of tiles; 0: strips */
  double numbers[HEIGHT][WIDTH][MOST];
} page;

static void randomize(page *p, uint64_t *seed)
{
  for (int y = 0; y < HEIGHT; y++)
    for (int x = 0; x < WIDTH; x++)
      for (int k = 0; k < p->samples; k++) {
        const double u = random_between(seed, 0, 1);
        p->numbers[y][x][k] =
          p->format == SAMPLEFORMAT_IEEEFP  ? (double)(float)u
          : p->format == SAMPLEFORMAT_INT ? floor(u * ldexp(1, p->bits)) - ldexp(1, p->bits - 1)
                                          : floor(u * ldexp(1, p->bits));
      }
}

/* Number `i` of a row in this machine's order. */
static void store(const page *p, uint8_t *row, size_t i, double number)
{
  if (p->format == SAMPLEFORMAT_IEEEFP && p->bits == 64)
    memcpy(row + 8 * i, &number, 8);
  else if (p->format == SAMPLEFORMAT_IEEEFP)
    memcpy(row + 4 * i, &(float){(float)number}, 4);
  else if (p->bits >= 8 && p->bits % 8 == 0 && p->bits != 24) {
    const uint64_t bits = (uint64_t)(int64_t)number;
    if (p->bits == 8)
      row[i] = (uint8_t)bits;
    else if (p->bits == 16)
      memcpy(row + 2 * i, &(uint16_t){(uint16_t)bits}, 2);
    else
      memcpy(row + 4 * i, &(uint32_t){(uint32_t)bits}, 4);
  } else {
    for (unsigned b = 0; b < p->bits; b++)
      if ((uint32_t)number >> (p->bits - 1 - b) & 1)
        row[(i * p->bits + b) / 8] |= (uint8_t)(0x80 >> (i * p->bits + b) % 8);
  }
}

static void describe(TIFF *file, const page *p)
{
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, WIDTH);
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, HEIGHT);
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, p->bits);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, p->samples);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, p->format);
  TIFFSetField(file, TIFFTAG_COMPRESSION, p->compression);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, p->photometric);
  TIFFSetField(file, TIFFTAG_PLANARCONFIG, p->planes);
  TIFFSetField(file, TIFFTAG_ORIENTATION, p->orientation);
  const int extra = p->samples - (p->photometric == PHOTOMETRIC_RGB ? 3 : 1);
  if (extra > 0)
    TIFFSetField(file, TIFFTAG_EXTRASAMPLES, extra,
                 (uint16_t[MOST]){EXTRASAMPLE_UNASSALPHA, EXTRASAMPLE_UNSPECIFIED});
  if (p->tile) {
    TIFFSetField(file, TIFFTAG_TILEWIDTH, p->tile);
    TIFFSetField(file, TIFFTAG_TILELENGTH, p->tile);
  } else {
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 5);
  }
}

/* A row or tile from (x, y) on; separate planes hold one sample. */
static void pack(const page *p, uint32_t x, uint32_t y, uint32_t count, int plane, uint8_t *bytes)
{
  const int from = p->planes == PLANARCONFIG_SEPARATE ? plane : 0;
  const int samples = p->planes == PLANARCONFIG_SEPARATE ? 1 : p->samples;
  for (uint32_t i = 0; i < count; i++)
    for (int k = 0; k < samples; k++)
      store(p, bytes, i * (size_t)samples + (size_t)k,
            x + i < WIDTH && y < HEIGHT ? p->numbers[y][x + i][from + k] : 0);
}

static void write_page(TIFF *file, const page *p)
{
  static uint8_t bytes[64 * 64 * 8 * MOST];
  for (int plane = 0; plane < (p->planes == PLANARCONFIG_SEPARATE ? p->samples : 1); plane++) {
    for (uint32_t y = 0; !p->tile && y < HEIGHT; y++) {
      memset(bytes, 0, sizeof bytes);
      pack(p, 0, y, WIDTH, plane, bytes);
      assert_int_equal(TIFFWriteScanline(file, bytes, y, (uint16_t)plane), 1);
    }
    for (uint32_t y = 0; p->tile && y < HEIGHT; y += p->tile)
      for (uint32_t x = 0; x < WIDTH; x += p->tile) {
        memset(bytes, 0, sizeof bytes);
        for (uint32_t j = 0; j < p->tile; j++)
          pack(p, x, y + j, p->tile, plane, bytes + (tmsize_t)j * TIFFTileRowSize(file));
        assert_true(TIFFWriteTile(file, bytes, x, y, 0, (uint16_t)plane) > 0);
      }
  }
}

static const char *write_file(const char *name, const char *mode, const page *p)
{
  const char *path = scratch_path(&folder, name);
  TIFF *file = TIFFOpen(path, mode);
  assert_non_null(file);
  describe(file, p);
  write_page(file, p);
  TIFFClose(file);
  return path;
}

/* ---- Reading ------------------------------------------------------------------------------ */

static double expected_of(const page *p, int x, int y)
{
  const double *n = p->numbers[y][x];
  const double white = p->format == SAMPLEFORMAT_IEEEFP ? 1
                       : ldexp(1, p->bits - (p->format == SAMPLEFORMAT_INT)) - 1;
  if (p->photometric == PHOTOMETRIC_RGB)
    return (0.2126 * n[0] + 0.7152 * n[1] + 0.0722 * n[2]) / white;
  return p->photometric == PHOTOMETRIC_MINISWHITE ? 1 - n[0] / white : n[0] / white;
}

static void assert_reads(const char *path, const page *p, double tolerance)
{
  zs_gray gray;
  assert_true(zs_gray_read(&gray, path, 1, NULL));
  assert_int_equal(gray.width, WIDTH);
  assert_int_equal(gray.height, HEIGHT);
  for (int y = 0; y < HEIGHT; y++)
    for (int x = 0; x < WIDTH; x++) {
      const double expected = expected_of(p, x, y);
      if (!(fabs(gray.pixels[y * WIDTH + x] - expected) <= tolerance))
        fail_msg("(%d, %d): %g is not %g", x, y, (double)gray.pixels[y * WIDTH + x], expected);
    }
  zs_gray_clear(&gray);
}

/* All numbers, both byte orders, strips and tiles, planes together and apart, compressions. */
static void pages_come_back(void **state)
{
  (void)state;
  static const uint16_t kinds[][2] = {
    {1, SAMPLEFORMAT_UINT},  {2, SAMPLEFORMAT_UINT},  {4, SAMPLEFORMAT_UINT},
    {8, SAMPLEFORMAT_UINT},  {12, SAMPLEFORMAT_UINT}, {16, SAMPLEFORMAT_UINT},
    {32, SAMPLEFORMAT_UINT}, {8, SAMPLEFORMAT_INT},   {16, SAMPLEFORMAT_INT},
    {32, SAMPLEFORMAT_INT},  {32, SAMPLEFORMAT_IEEEFP}, {64, SAMPLEFORMAT_IEEEFP}};
  static const uint16_t compressions[] = {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_PACKBITS,
                                          COMPRESSION_ADOBE_DEFLATE};
  static const char *const modes[] = {"wl", "wb", "wl8"};
  uint64_t seed = 1;
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
    for (int variant = 0; variant < 24; variant++) {
      page p = {.bits = kinds[k][0], .format = kinds[k][1],
                .compression = compressions[variant % 4], .tile = variant % 2 ? 16 : 0,
                .planes = variant / 2 % 2 ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG,
                .photometric = variant % 3 == 0 && kinds[k][1] != SAMPLEFORMAT_INT
                                 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK,
                .samples = (uint16_t)(variant % 3 == 0 ? 3 + variant / 12 : 1 + variant / 12),
                .orientation = ORIENTATION_TOPLEFT};
      randomize(&p, &seed);
      assert_reads(write_file("all.tif", modes[variant / 8], &p), &p, 2e-4);
    }
}

static void facsimiles_come_back(void **state)
{
  (void)state;
  static const uint16_t compressions[] = {COMPRESSION_CCITTRLE, COMPRESSION_CCITTFAX3,
                                          COMPRESSION_CCITTFAX4};
  uint64_t seed = 2;
  for (int i = 0; i < 3; i++) {
    page p = {.bits = 1, .format = SAMPLEFORMAT_UINT, .compression = compressions[i],
              .photometric = PHOTOMETRIC_MINISWHITE, .samples = 1, .planes = PLANARCONFIG_CONTIG,
              .orientation = ORIENTATION_TOPLEFT};
    randomize(&p, &seed);
    assert_reads(write_file("fax.tif", "w", &p), &p, 0);
  }
}

/* The corner of the picture where row 0 and column 0 meet, and whether rows run down it. */
static void pictures_are_turned(void **state)
{
  (void)state;
  static const struct {
    uint16_t orientation;
    bool right, bottom, turned;
  } cases[] = {{ORIENTATION_TOPLEFT, false, false, false}, {ORIENTATION_TOPRIGHT, true, false, false},
               {ORIENTATION_BOTRIGHT, true, true, false},  {ORIENTATION_BOTLEFT, false, true, false},
               {ORIENTATION_LEFTTOP, false, false, true},  {ORIENTATION_RIGHTTOP, true, false, true},
               {ORIENTATION_RIGHTBOT, true, true, true},   {ORIENTATION_LEFTBOT, false, true, true}};
  uint64_t seed = 3;
  for (int i = 0; i < 8; i++) {
    page p = {.bits = 16, .format = SAMPLEFORMAT_UINT, .compression = COMPRESSION_NONE,
              .photometric = PHOTOMETRIC_MINISBLACK, .samples = 1, .planes = PLANARCONFIG_CONTIG,
              .orientation = cases[i].orientation};
    randomize(&p, &seed);
    zs_gray gray;
    assert_true(zs_gray_read(&gray, write_file("turned.tif", "w", &p), 1, NULL));
    const int width = cases[i].turned ? HEIGHT : WIDTH, height = cases[i].turned ? WIDTH : HEIGHT;
    assert_int_equal(gray.width, width);
    assert_int_equal(gray.height, height);
    for (int row = 0; row < HEIGHT; row++)
      for (int column = 0; column < WIDTH; column++) {
        const int along = cases[i].turned ? row : column, across = cases[i].turned ? column : row;
        const int x = cases[i].right ? width - 1 - along : along;
        const int y = cases[i].bottom ? height - 1 - across : across;
        assert_true(fabs(gray.pixels[y * width + x] - expected_of(&p, column, row)) < 1e-6);
      }
    zs_gray_clear(&gray);
  }
}

/* Colours of a palette by their luminance, or by their numbers. */
static void palettes_are_read(void **state)
{
  (void)state;
  uint64_t seed = 4;
  uint16_t red[16], green[16], blue[16];
  page p = {.bits = 4, .format = SAMPLEFORMAT_UINT, .compression = COMPRESSION_LZW,
            .photometric = PHOTOMETRIC_PALETTE, .samples = 1, .planes = PLANARCONFIG_CONTIG,
            .orientation = ORIENTATION_TOPLEFT};
  randomize(&p, &seed);
  for (int i = 0; i < 16; i++) {
    red[i] = (uint16_t)(random_between(&seed, 0, 1) * 65535);
    green[i] = (uint16_t)(random_between(&seed, 0, 1) * 65535);
    blue[i] = (uint16_t)(random_between(&seed, 0, 1) * 65535);
  }
  const char *path = scratch_path(&folder, "palette.tif");
  TIFF *file = TIFFOpen(path, "w");
  describe(file, &p);
  TIFFSetField(file, TIFFTAG_COLORMAP, red, green, blue);
  write_page(file, &p);
  TIFFClose(file);
  for (int meaning = ZS_GRAY_BRIGHTNESS; meaning <= ZS_GRAY_NUMBERS; meaning++) {
    zs_gray gray;
    zs_gray_file *open = zs_gray_open(path, (zs_gray_meaning)meaning, NULL);
    assert_int_equal(zs_gray_next(open), ZS_GRAY_PAGE);
    assert_true(zs_gray_load(open, &gray));
    assert_int_equal(zs_gray_next(open), ZS_GRAY_END);
    zs_gray_close(open);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
      const int number = (int)p.numbers[i / WIDTH][i % WIDTH][0];
      const double bright = 0.2126 * red[number] + 0.7152 * green[number] + 0.0722 * blue[number];
      if (meaning == ZS_GRAY_NUMBERS)
        assert_true(fabs(gray.pixels[i] * (double)gray.white - number) < 1e-5);
      else
        assert_true(fabs(gray.pixels[i] - bright / 65535) < 2e-4);
    }
    zs_gray_clear(&gray);
  }
}

/* JPEG's own colours: nearly what was written. */
static void jpegs_are_read(void **state)
{
  (void)state;
  page p = {.bits = 8, .format = SAMPLEFORMAT_UINT, .compression = COMPRESSION_JPEG,
            .photometric = PHOTOMETRIC_YCBCR, .samples = 3, .planes = PLANARCONFIG_CONTIG,
            .orientation = ORIENTATION_TOPLEFT};
  if (!TIFFIsCODECConfigured(COMPRESSION_JPEG))
    skip();
  for (int y = 0; y < HEIGHT; y++)
    for (int x = 0; x < WIDTH; x++)
      for (int k = 0; k < 3; k++)
        p.numbers[y][x][k] = 40 + 3 * x + 2 * y + 20 * k; /* smooth */
  const char *path = scratch_path(&folder, "jpeg.tif");
  TIFF *file = TIFFOpen(path, "w");
  describe(file, &p);
  TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 16);
  TIFFSetField(file, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  write_page(file, &p);
  TIFFClose(file);
  p.photometric = PHOTOMETRIC_RGB;
  assert_reads(path, &p, 0.03);
}

/* In order, without reduced copies and masks. */
static void pages_are_told_apart(void **state)
{
  (void)state;
  uint64_t seed = 5;
  page p = {.bits = 8, .format = SAMPLEFORMAT_UINT, .compression = COMPRESSION_NONE,
            .photometric = PHOTOMETRIC_MINISBLACK, .samples = 1, .planes = PLANARCONFIG_CONTIG,
            .orientation = ORIENTATION_TOPLEFT};
  static const uint32_t types[] = {FILETYPE_REDUCEDIMAGE, FILETYPE_PAGE, 0, FILETYPE_MASK, 0};
  const char *path = scratch_path(&folder, "pages.tif");
  TIFF *file = TIFFOpen(path, "w");
  double corner[5];
  for (int i = 0; i < 5; i++) {
    randomize(&p, &seed);
    corner[i] = p.numbers[0][0][0] / 255;
    describe(file, &p);
    TIFFSetField(file, TIFFTAG_SUBFILETYPE, types[i]);
    write_page(file, &p);
    assert_true(TIFFWriteDirectory(file));
  }
  TIFFClose(file);
  static const int pages[] = {1, 2, 4};
  for (size_t i = 0; i < 4; i++) {
    zs_diag diag = {0};
    zs_gray gray;
    assert_int_equal(zs_gray_read(&gray, path, i + 1, &diag), i < 3);
    if (i < 3)
      assert_true(fabs(gray.pixels[0] - corner[pages[i]]) < 1e-6);
    else
      assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
    zs_gray_clear(&gray);
  }
}

static void sides_are_millimetres(void **state)
{
  (void)state;
  static const struct {
    uint16_t unit, orientation;
    double x, y;
  } cases[] = {{RESUNIT_INCH, ORIENTATION_TOPLEFT, 0.254, 0.127},
               {RESUNIT_CENTIMETER, ORIENTATION_TOPLEFT, 0.1, 0.05},
               {RESUNIT_CENTIMETER, ORIENTATION_RIGHTTOP, 0.05, 0.1},
               {RESUNIT_NONE, ORIENTATION_TOPLEFT, 0, 0}};
  for (int i = 0; i < 4; i++) {
    page p = {.bits = 8, .format = SAMPLEFORMAT_UINT, .compression = COMPRESSION_NONE,
              .photometric = PHOTOMETRIC_MINISBLACK, .samples = 1, .planes = PLANARCONFIG_CONTIG,
              .orientation = cases[i].orientation};
    const char *path = scratch_path(&folder, "sides.tif");
    TIFF *file = TIFFOpen(path, "w");
    describe(file, &p);
    TIFFSetField(file, TIFFTAG_RESOLUTIONUNIT, cases[i].unit);
    TIFFSetField(file, TIFFTAG_XRESOLUTION, 100.0);
    TIFFSetField(file, TIFFTAG_YRESOLUTION, 200.0);
    write_page(file, &p);
    TIFFClose(file);
    zs_gray gray;
    assert_true(zs_gray_read(&gray, path, 1, NULL));
    assert_true(fabs(gray.side[0] - cases[i].x) < 1e-6 && fabs(gray.side[1] - cases[i].y) < 1e-6);
    zs_gray_clear(&gray);
  }
}

/* ---- Bad files --------------------------------------------------------------------------- */

/* An entry of a directory: tag, type (3: 16 bits, 4: 32 bits), number of values, value. */
typedef struct entry {
  uint16_t tag, type;
  uint32_t count, value;
} entry;

enum { ENTRIES = 9, DATA = 8 + 2 + 12 * ENTRIES + 4 };

/* A little-endian page of 8 x 8 bytes behind its directory, `next` behind that. */
static size_t make_bytes(uint8_t *bytes, const entry *changed, uint32_t next)
{
  entry entries[ENTRIES] = {{256, 4, 1, 8}, {257, 4, 1, 8},    {258, 3, 1, 8}, {259, 3, 1, 1},
                            {262, 3, 1, 1}, {273, 4, 1, DATA}, {277, 3, 1, 1}, {278, 4, 1, 8},
                            {279, 4, 1, 64}};
  memcpy(bytes, "II*\0\010\0\0\0\011", 9);
  bytes[9] = 0;
  for (int i = 0; i < ENTRIES; i++) {
    const entry *e = changed && changed->tag == entries[i].tag ? changed : &entries[i];
    memcpy(bytes + 10 + 12 * i, &e->tag, 2);
    memcpy(bytes + 12 + 12 * i, &e->type, 2);
    memcpy(bytes + 14 + 12 * i, &e->count, 4);
    memcpy(bytes + 18 + 12 * i, &e->value, 4);
  }
  memcpy(bytes + DATA - 4, &next, 4);
  for (int i = 0; i < 64; i++)
    bytes[DATA + i] = (uint8_t)(3 * i);
  return DATA + 64;
}

static void keep_message(void *context, const zs_diagnostic *diagnostic)
{
  snprintf(context, 512, "%s", diagnostic->message);
}

/* Read all pages; how many there were, or -1 with the message. */
static int read_all(const char *path, char message[512])
{
  zs_diag diag = {.report = keep_message, .context = message};
  int count = 0;
  message[0] = '\0';
  zs_gray_file *file = zs_gray_open(path, ZS_GRAY_BRIGHTNESS, &diag);
  zs_gray_page page = file ? zs_gray_next(file) : ZS_GRAY_FAILED;
  for (; page == ZS_GRAY_PAGE; page = zs_gray_next(file), count++) {
    zs_gray gray;
    if (!zs_gray_load(file, &gray)) {
      assert_null(gray.pixels);
      page = ZS_GRAY_FAILED;
      break;
    }
    zs_gray_clear(&gray);
  }
  zs_gray_close(file);
  assert_int_equal(page == ZS_GRAY_FAILED, diag.errors > 0);
  return page == ZS_GRAY_FAILED ? -1 : count;
}

static void bad_files_are_refused(void **state)
{
  (void)state;
  static const struct {
    entry changed;
    const char *message;
  } cases[] = {
    {{256, 4, 1, 0x7fffffff}, "pixels; expected 1 to"},
    {{257, 4, 1, 40000}, "pixels; expected 1 to"},
    {{256, 4, 1, 0}, "malformed"},
    {{258, 3, 1, 24}, "bits are 24"},
    {{259, 3, 1, 4711}, "malformed"},
    {{262, 3, 1, 5}, "photometric interpretation 5"},
    {{262, 3, 1, 2}, "photometric interpretation 2"},
    {{273, 4, 1, 5000}, "malformed"},
    {{277, 3, 1, 60000}, "60000"},
  };
  uint8_t bytes[DATA + 64];
  char message[512];
  assert_int_equal(read_all(written("good.tif", bytes, make_bytes(bytes, NULL, 0)), message), 1);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const size_t length = make_bytes(bytes, &cases[i].changed, 0);
    if (read_all(written("bad.tif", bytes, length), message) != -1 ||
        !strstr(message, cases[i].message))
      fail_msg("case %zu: '%s' does not say '%s'", i, message, cases[i].message);
  }
}

/* A directory that follows itself; one that is not there. */
static void cycles_are_refused(void **state)
{
  (void)state;
  static const uint32_t nexts[] = {8, 100000};
  uint8_t bytes[DATA + 64];
  char message[512];
  for (int i = 0; i < 2; i++) {
    const size_t length = make_bytes(bytes, NULL, nexts[i]);
    assert_int_equal(read_all(written("cycle.tif", bytes, length), message), -1);
    assert_non_null(strstr(message, "page 2 of the TIFF file is malformed"));
  }
}

/* Any beginning of a file, whether its directory or its data are cut off. */
static void truncated_files_are_refused(void **state)
{
  (void)state;
  uint8_t bytes[DATA + 64];
  char message[512];
  const size_t length = make_bytes(bytes, NULL, 0);
  for (size_t n = 0; n < length; n++)
    if (read_all(written("cut.tif", bytes, n), message) != -1)
      fail_msg("%zu of %zu bytes are read", n, length);
}

static int complaints;

static void complain(const char *module, const char *format, va_list arguments)
{
  (void)module, (void)format, (void)arguments;
  complaints++;
}

/* Changed bytes: pages or an error, and nothing for the handlers of the whole process. */
static void changed_files_end_well(void **state)
{
  (void)state;
  static const uint16_t compressions[] = {COMPRESSION_NONE, COMPRESSION_LZW,
                                          COMPRESSION_ADOBE_DEFLATE, COMPRESSION_JPEG};
  uint64_t seed = 6;
  int refused = 0;
  TIFFSetErrorHandler(complain);
  TIFFSetWarningHandler(complain);
  complaints = 0;
  for (int c = 0; c < 4; c++) {
    size_t length;
    page p = {.bits = 8, .format = SAMPLEFORMAT_UINT, .compression = compressions[c],
              .photometric = PHOTOMETRIC_MINISBLACK, .samples = 1, .planes = PLANARCONFIG_CONTIG,
              .orientation = ORIENTATION_TOPLEFT, .tile = c == 1 ? 16 : 0};
    if (!TIFFIsCODECConfigured(p.compression))
      continue;
    randomize(&p, &seed);
    const char *path = scratch_path(&folder, "whole.tif");
    TIFF *file = TIFFOpen(path, "w");
    describe(file, &p);
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 8);
    write_page(file, &p);
    TIFFClose(file);
    assert_int_equal(complaints, 0);
    char *bytes = read_whole(path, &length), message[512];
    char *changed = malloc(length);
    for (int i = 0; i < 500; i++) {
      memcpy(changed, bytes, length);
      for (int k = 0; k < 3; k++) { /* two of three in the directory, at the end */
        const size_t range = k && length > 200 ? 200 : length;
        changed[length - 1 - (size_t)(random_between(&seed, 0, 1) * (double)range)] =
          (char)(random_between(&seed, 0, 1) * 256);
      }
      refused += read_all(written("changed.tif", changed, length), message) < 0;
    }
    free(changed);
    free(bytes);
  }
  assert_true(refused > 100);
  assert_int_equal(complaints, 0);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(pages_come_back),
    cmocka_unit_test(facsimiles_come_back),
    cmocka_unit_test(pictures_are_turned),
    cmocka_unit_test(palettes_are_read),
    cmocka_unit_test(jpegs_are_read),
    cmocka_unit_test(pages_are_told_apart),
    cmocka_unit_test(sides_are_millimetres),
    cmocka_unit_test(bad_files_are_refused),
    cmocka_unit_test(cycles_are_refused),
    cmocka_unit_test(truncated_files_are_refused),
    cmocka_unit_test(changed_files_end_well),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
