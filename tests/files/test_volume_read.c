/* Volumes as input: what was written is read, in every dialect, and what is broken is not. */
#include "set_up.h"

#include "../random.h"

#include "files/volume.h"
#include "files/volume_read.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <zlib.h>

#include <cmocka.h>

enum { NX = 3, NY = 4, NZ = 5, COUNT = NX * NY * NZ, MOST = 1 << 16, MUTATIONS = 150 };

/* Sample i, a number that every type holds. */
static double sample(size_t i)
{
  return (double)((i * 37) % 120);
}

/* A file under construction. */
static struct {
  unsigned char bytes[MOST];
  size_t length;
} file;

static void add(const void *bytes, size_t length)
{
  assert_true(file.length + length <= MOST);
  memcpy(file.bytes + file.length, bytes, length);
  file.length += length;
}

__attribute__((format(printf, 1, 2))) static void add_text(const char *format, ...)
{
  char text[1000];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  add(text, strlen(text));
}

static const char *save(const char *name)
{
  const char *path = written(name, file.bytes, file.length);
  file.length = 0;
  return path;
}

/* Samples as bytes of a type in a byte order. */
static size_t encode(zs_voxel_type type, bool big, unsigned char *out)
{
  const size_t size = zs_voxel_size(type);
  for (size_t i = 0; i < COUNT; i++) {
    uint64_t bits = (uint64_t)sample(i);
    const float single = (float)sample(i);
    const double number = sample(i);
    if (type == ZS_VOXEL_F32) {
      uint32_t narrow;
      memcpy(&narrow, &single, sizeof narrow);
      bits = narrow;
    } else if (type == ZS_VOXEL_F64) {
      memcpy(&bits, &number, sizeof bits);
    }
    for (size_t b = 0; b < size; b++)
      out[i * size + b] = (unsigned char)(bits >> (8 * (big ? size - 1 - b : b)));
  }
  return COUNT * size;
}

static size_t packed(const unsigned char *bytes, size_t length, bool gzip, unsigned char *out)
{
  z_stream z = {.zalloc = Z_NULL};
  assert_int_equal(deflateInit2(&z, 9, Z_DEFLATED, gzip ? 31 : 15, 8, Z_DEFAULT_STRATEGY), Z_OK);
  z.next_in = (unsigned char *)bytes;
  z.avail_in = (uInt)length;
  z.next_out = out;
  z.avail_out = MOST;
  assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
  const size_t n = z.total_out;
  deflateEnd(&z);
  return n;
}

static void add_base64(const unsigned char *bytes, size_t length)
{
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (size_t i = 0; i < length; i += 3) {
    uint32_t bits = 0;
    char four[4];
    for (size_t b = 0; b < 3; b++)
      bits = bits << 8 | (i + b < length ? bytes[i + b] : 0);
    for (int d = 0; d < 4; d++)
      four[d] = i + (size_t)d > length ? '=' : digits[bits >> (18 - 6 * d) & 63];
    add(four, 4);
  }
}

typedef struct seen {
  char message[512];
} seen;

static void keep(void *context, const zs_diagnostic *d)
{
  seen *s = context;
  assert_non_null(d->file);
  snprintf(s->message, sizeof s->message, "%s", d->message);
}

static zs_volume read_good(const char *path)
{
  seen s = {""};
  zs_diag diag = {.report = keep, .context = &s};
  zs_volume volume;
  if (!zs_volume_read(&volume, path, &diag))
    fail_msg("%s: %s", path, s.message);
  return volume;
}

static void expect_error(const char *name, const char *part)
{
  seen s = {""};
  zs_diag diag = {.report = keep, .context = &s};
  zs_volume volume;
  const char *path = save(name);
  assert_false(zs_volume_read(&volume, path, &diag));
  assert_int_equal(diag.errors, 1);
  assert_null(volume.numbers);
  if (!strstr(s.message, part))
    fail_msg("'%s' is not in: %s", part, s.message);
}

/* The expected samples at origin + spacing * index. */
static void check(const char *path, const double spacing[3], const double origin[3])
{
  zs_volume v = read_good(path);
  assert_true(v.size[0] == NX && v.size[1] == NY && v.size[2] == NZ);
  double values[COUNT];
  zs_volume_values(&v, 0, COUNT, values);
  for (size_t i = 0; i < COUNT; i++)
    if (values[i] != sample(i))
      fail_msg("%s: sample %zu is %g, expected %g", path, i, values[i], sample(i));
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 4; k++) {
      const double expected = k == 3 ? origin[i] : k == i ? spacing[i] : 0;
      if (!(fabs(v.matrix[4 * i + k] - expected) < 1e-6))
        fail_msg("%s: matrix[%d][%d] is %g, expected %g", path, i, k, v.matrix[4 * i + k],
                 expected);
    }
  zs_volume_clear(&v);
}

static const double zero[3] = {0, 0, 0};
static const double spacing[3] = {0.25, 0.5, 1.5}, origin[3] = {1.125, -1.75, 100.5};

/* ---- Round trips ------------------------------------------------------------------- */

static void test_round_trips(void **state)
{
  (void)state;
  static const char *const names[] = {"a.vti", "a.nrrd", "a.mhd", "a.nii", "a.nii.gz", "B.NII.GZ"};
  static const zs_grid grid = {{1, -2, 99.75}, {0.25, 0.5, 1.5}, {NX, NY, NZ}};
  for (size_t n = 0; n < sizeof names / sizeof *names; n++)
    for (zs_sample_type type = ZS_SAMPLE_U8; type <= ZS_SAMPLE_F64; type++) {
      zs_volume_writer writer;
      float samples[COUNT];
      for (size_t i = 0; i < COUNT; i++)
        samples[i] = (float)sample(i);
      const char *path = scratch_path(&folder, names[n]);
      assert_true(zs_volume_open(&writer, path, &grid, type, "f", NULL));
      assert_true(zs_volume_write_floats(&writer, samples, 7));
      assert_true(zs_volume_write_floats(&writer, samples + 7, COUNT - 7));
      assert_true(zs_volume_commit(&writer, NULL));
      check(path, spacing, origin);
    }
}

/* ---- Dialects ----------------------------------------------------------------------- */

static void test_nrrd(void **state)
{
  (void)state;
  static const char *const types[] = {"uint8", "signed char", "unsigned short", "short", "uint32",
                                      "int", "uint64", "long long", "float", "double"};
  unsigned char raw[8 * COUNT], small[MOST];
  for (zs_voxel_type type = 0; type < ZS_VOXEL_TYPE_COUNT; type++)
    for (int variant = 0; variant < 8; variant++) {
      const bool big = variant & 1, gzip = variant & 2, beside = variant & 4;
      const size_t length = encode(type, big, raw);
      const size_t n = gzip ? packed(raw, length, true, small) : length;
      if (beside) {
        add_text("two\nlines\n%s", gzip ? "" : "and 8 bytes "); /* to be skipped */
        add(gzip ? small : raw, n);
        save("data.bin");
      }
      add_text("NRRD0005\r\n# a comment\r\ntype: %s\r\nDimension: 3\r\nsizes: 3 4 5\r\n"
               "key:=value: with colon\r\nlabels: \"x\" \"y\" \"z\"\r\n"
               "spacings: 0.25 0.5 1.5\r\nendian: %s\r\nencoding: %s\r\n",
               types[type], big ? "big" : "little", gzip ? "gzip" : "raw");
      if (beside && !gzip)
        add_text("line skip: 2\r\nbyte skip: 12\r\ndata file: data.bin\r\n");
      else if (beside)
        add_text("line skip: 2\r\ndata file: ./data.bin\r\n");
      else
        add_text("\r\n");
      if (!beside)
        add(gzip ? small : raw, n);
      check(save(beside ? "a.nhdr" : "a.nrrd"), spacing, zero);
    }
}

static void test_nrrd_text_and_axes(void **state)
{
  (void)state;
  for (int hex = 0; hex < 2; hex++) {
    /* Axes of one sample that are none of space's are left out. */
    add_text("NRRD0004\ntype: %s\ndimension: 4\nsizes: 1 3 4 5\nspace: left-posterior-superior\n"
             "space directions: none (0.25,0,0) (0,0.5,0) (0,0,1.5)\n"
             "kinds: vector domain domain domain\nspace origin: (1.125,-1.75,100.5)\n"
             "encoding: %s\n\n", hex ? "uchar" : "double", hex ? "hex" : "ascii");
    for (size_t i = 0; i < COUNT; i++) {
      if (hex)
        add_text("%02x%s", (unsigned)sample(i), i % 7 ? "" : "\n");
      else
        add_text("%g ", sample(i));
    }
    check(save("t.nrrd"), spacing, origin);
  }
  /* Data at the end of a file. */
  unsigned char raw[COUNT];
  add_text("whatever there is in front");
  add(raw, encode(ZS_VOXEL_U8, false, raw));
  save("end.raw");
  add_text("NRRD0001\ntype: uchar\ndimension: 3\nsizes: 3 4 5\naxis mins: 1.125 -1.75 100.5\n"
           "spacings: 0.25 0.5 1.5\nencoding: raw\nbyteskip: -1\ndatafile: end.raw\n");
  check(save("e.nhdr"), spacing, origin);
}

/* Axes that lean, run backwards and are interchanged. */
static void test_directions(void **state)
{
  (void)state;
  add_text("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nspace dimension: 3\n"
           "space directions: (0,-2,0) (0,0.5,3) (1,0,0)\nspace origin: (7,8,9)\n"
           "encoding: ascii\n\n1 2\n");
  zs_volume v = read_good(save("d.nrrd"));
  static const double expected[12] = {0, 0, 1, 7, -2, 0.5, 0, 8, 0, 3, 0, 9};
  assert_memory_equal(v.matrix, expected, sizeof expected);
  zs_volume_clear(&v);
  /* Plane pictures are one voxel thick. */
  add_text("NRRD0004\ntype: uchar\ndimension: 2\nsizes: 2 3\nencoding: ascii\n\n1 2 3 4 5 6\n");
  v = read_good(save("plane.nrrd"));
  assert_true(v.size[0] == 2 && v.size[1] == 3 && v.size[2] == 1 && v.matrix[10] == 1);
  zs_volume_clear(&v);
}

static void test_meta(void **state)
{
  (void)state;
  static const char *const types[] = {"UCHAR", "CHAR", "USHORT", "SHORT", "UINT",
                                      "INT", "ULONG_LONG", "LONG_LONG", "FLOAT", "DOUBLE"};
  unsigned char raw[8 * COUNT], small[MOST];
  for (zs_voxel_type type = 0; type < ZS_VOXEL_TYPE_COUNT; type++)
    for (int variant = 0; variant < 8; variant++) {
      const bool big = variant & 1, zlib = variant & 2, beside = variant & 4;
      const size_t length = encode(type, big, raw);
      const size_t n = zlib ? packed(raw, length, false, small) : length;
      if (beside) {
        add(zlib ? small : raw, n);
        save("m.zraw");
      }
      add_text("ObjectType = Image\nNDims = 3\nBinaryData = True\n"
               "BinaryDataByteOrderMSB = %s\nCompressedData = %s\nOffset = 1.125 -1.75 100.5\n"
               "ElementSpacing = 0.25 0.5 1.5\nDimSize = 3 4 5\nAnatomicalOrientation = RAI\n"
               "ElementType = MET_%s\nElementDataFile = %s\n",
               big ? "True" : "False", zlib ? "True" : "False", types[type],
               beside ? "m.zraw" : "LOCAL");
      if (!beside)
        add(zlib ? small : raw, n);
      check(save(beside ? "a.mhd" : "a.mha"), spacing, origin);
    }
  /* Rows of the matrix are directions of axes. */
  add_text("NDims = 3\nDimSize = 1 2 1\nTransformMatrix = 0 1 0 -1 0 0 0 0 1\n"
           "ElementSpacing = 2 3 4\nElementType = MET_UCHAR\nBinaryData = False\n"
           "ElementDataFile = LOCAL\n8 9");
  zs_volume v = read_good(save("turned.mha"));
  static const double expected[12] = {0, -3, 0, 0, 2, 0, 0, 0, 0, 0, 4, 0};
  assert_memory_equal(v.matrix, expected, sizeof expected);
  zs_volume_clear(&v);
}

static void put(unsigned char *header, size_t at, size_t size, bool big, uint32_t number)
{
  for (size_t i = 0; i < size; i++)
    header[at + i] = (unsigned char)(number >> (8 * (big ? size - 1 - i : i)));
}

static void put_float(unsigned char *header, size_t at, bool big, float number)
{
  uint32_t bits;
  memcpy(&bits, &number, sizeof bits);
  put(header, at, 4, big, bits);
}

/* Types, byte orders, scale, and the three ways to say where samples are. */
static void test_nifti(void **state)
{
  (void)state;
  static const unsigned codes[] = {2, 256, 512, 4, 768, 8, 1280, 1024, 16, 64};
  unsigned char raw[8 * COUNT];
  for (zs_voxel_type type = 0; type < ZS_VOXEL_TYPE_COUNT; type++)
    for (int variant = 0; variant < 6; variant++) {
      const bool big = variant % 2;
      const int method = variant / 2;
      unsigned char h[352] = {0};
      put(h, 0, 4, big, 348);
      static const uint16_t dim[8] = {4, NX, NY, NZ, 1, 0, 0, 0};
      for (size_t i = 0; i < 8; i++)
        put(h, 40 + 2 * i, 2, big, dim[i]);
      put(h, 70, 2, big, codes[type]);
      put_float(h, 76, big, 1);
      for (size_t k = 0; k < 3; k++) {
        put_float(h, 80 + 4 * k, big, (float)spacing[k]);
        put_float(h, 268 + 4 * k, big, (float)origin[k]);
        put_float(h, 280 + 20 * k, big, (float)spacing[k]);
        put_float(h, 292 + 16 * k, big, (float)origin[k]);
      }
      put_float(h, 108, big, 352);
      put(h, method == 1 ? 252 : 254, 2, big, method > 0);
      memcpy(h + 344, "n+1", 4);
      add(h, sizeof h);
      add(raw, encode(type, big, raw));
      check(save("n.nii"), spacing, method ? origin : zero);
    }
  /* A quarter turn about z, mirrored in z; values halved and moved. */
  unsigned char h[352] = {0};
  put(h, 0, 4, false, 348);
  static const uint16_t dim[8] = {3, 1, 1, 2, 1, 1, 1, 1};
  for (size_t i = 0; i < 8; i++)
    put(h, 40 + 2 * i, 2, false, dim[i]);
  put(h, 70, 2, false, 2);
  put_float(h, 76, false, -1);
  for (size_t k = 0; k < 3; k++)
    put_float(h, 80 + 4 * k, false, (float)k + 2);
  put_float(h, 108, false, 352);
  put_float(h, 112, false, 0.5f);
  put_float(h, 116, false, -3);
  put(h, 252, 2, false, 1);
  put_float(h, 264, false, sqrtf(0.5f));
  memcpy(h + 344, "n+1", 4);
  add(h, sizeof h);
  add("\x04\x0a", 2);
  zs_volume v = read_good(save("q.nii"));
  static const double expected[12] = {0, -3, 0, 0, 2, 0, 0, 0, 0, 0, -4, 0};
  double values[2];
  zs_volume_values(&v, 0, 2, values);
  for (int i = 0; i < 12; i++)
    assert_true(fabs(v.matrix[i] - expected[i]) < 1e-6);
  assert_true(values[0] == -1 && values[1] == 2);
  zs_volume_clear(&v);
  put_float(h, 268, false, NAN);
  add(h, sizeof h);
  add("\x04\x0a", 2);
  expect_error("q.nii", "the origin is");
}

/* Data of an array as VTK writes it: its length, or the sizes of its blocks, before it. */
static size_t vti_data(const unsigned char *raw, size_t length, bool zlib, bool big, bool wide,
                       unsigned char *out, size_t *header)
{
  const size_t size = wide ? 8 : 4, half = length / 2;
  unsigned char one[2 * MOST];
  if (!zlib) {
    put(out, big && wide ? 4 : 0, 4, big, (uint32_t)length);
    memset(out + (big ? 0 : 4), 0, wide ? 4 : 0);
    memcpy(out + size, raw, length);
    *header = 0; /* is one piece with the data */
    return size + length;
  }
  const size_t a = packed(raw, half, false, one);
  const size_t b = packed(raw + half, length - half, false, one + a);
  const size_t numbers[] = {2, half, length - half == half ? 0 : length - half, a, b};
  memset(out, 0, 5 * size);
  for (size_t i = 0; i < 5; i++)
    put(out, i * size + (big && wide ? 4 : 0), 4, big, (uint32_t)numbers[i]);
  *header = 5 * size;
  memcpy(out + *header, one, a + b);
  return *header + a + b;
}

static void test_vti(void **state)
{
  (void)state;
  static const char *const types[] = {"UInt8", "Int8", "UInt16", "Int16", "UInt32",
                                      "Int32", "UInt64", "Int64", "Float32", "Float64"};
  unsigned char raw[8 * COUNT], data[4 * MOST];
  for (zs_voxel_type type = 0; type < ZS_VOXEL_TYPE_COUNT; type++)
    for (int variant = 0; variant < 64; variant++) {
      const int where = variant % 4; /* text, inline base64, appended base64, appended raw */
      const bool big = variant & 4, zlib = variant & 8, wide = variant & 16, cells = variant & 32;
      const size_t length = encode(type, big, raw);
      size_t header;
      const size_t n = vti_data(raw, length, zlib, big, wide, data, &header);
      static const char *const formats[] = {"ascii", "binary", "appended", "appended"};
      const char *section = cells ? "CellData" : "PointData";
      add_text("<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" "
               "byte_order=\"%s\" header_type=\"%s\"%s>\n<ImageData WholeExtent=\"%s\" "
               "Origin=\"%s 100.5\" Spacing=\"0.25 0.5 1.5\"><Piece Extent=\"%s\">\n"
               "<%s Scalars=\"f\"><DataArray type=\"Float32\" Name=\"other\" format=\"ascii\">"
               "</DataArray><DataArray type=\"%s\" Name=\"f\" format=\"%s\" offset=\"%s\">",
               big ? "BigEndian" : "LittleEndian", wide ? "UInt64" : "UInt32",
               zlib ? " compressor=\"vtkZLibDataCompressor\"" : "",
               cells ? "0 3 0 4 0 5" : "-1 1 2 5 0 4", cells ? "1 -2" : "1.375 -2.75",
               cells ? "0 3 0 4 0 5" : "-1 1 2 5 0 4", section, types[type], formats[where],
               where < 2 ? "" : where == 2 ? "4" : "3");
      for (size_t i = 0; where == 0 && i < COUNT; i++)
        add_text("%g%s", sample(i), i % 9 ? " " : "\n");
      if (where == 1) {
        add_base64(data, header);
        add_base64(data + header, n - header);
      }
      add_text("</DataArray></%s></Piece></ImageData>\n", section);
      if (where == 2) {
        add_text("<AppendedData encoding=\"base64\">\n_AAAA");
        add_base64(data, header);
        add_base64(data + header, n - header);
        add_text("</AppendedData>");
      } else if (where == 3) {
        add_text("<AppendedData encoding=\"raw\">\n  _abc");
        add(data, n);
        add_text("</AppendedData>");
      }
      add_text("</VTKFile>\n");
      check(save("v.vti"), spacing,
            cells ? (const double[3]){1.125, -1.75, 101.25} : origin);
    }
}

/* ---- What is broken --------------------------------------------------------------------- */

static void test_bad_headers(void **state)
{
  (void)state;
#define NRRD "NRRD0004\ntype: uint8\ndimension: 3\n"
  static const struct {
    const char *name, *text, *part;
  } cases[] = {
    {"a.nrrd", "", "not an NRRD file"},
    {"a.nrrd", "PNG", "not an NRRD file"},
    {"a.nrrd", "NRRD0004\n\n", "type: is missing"},
    {"a.nrrd", NRRD "encoding: raw\n\n", "sizes: is missing"},
    {"a.nrrd", NRRD "sizes: 3 4\nencoding: raw\n\n", "sizes: there are 2; expected 3"},
    {"a.nrrd", NRRD "sizes: 3 4 5\nencoding: bzip2\n\n", "encoding: 'bzip2' cannot be read"},
    {"a.nrrd", NRRD "sizes: 3 4 0\nencoding: raw\n\n", "sizes: 0 is not a number of samples"},
    {"a.nrrd", NRRD "sizes: 3 4 x\nencoding: raw\n\n", "sizes: '3 4 x'"},
    {"a.nrrd", NRRD "sizes: 30000 30000 30000\nencoding: raw\n\n", "sizes: 2.7e+13 samples"},
    {"a.nrrd", NRRD "sizes: 1000 1000 1000\nencoding: raw\n\nabc", "too short for 1000 x 1000"},
    {"a.nrrd", NRRD "sizes: 1000 1000 1000\nencoding: gzip\n\nabc", "too short for 1000 x 1000"},
    {"a.nrrd", NRRD "sizes: 1 1 9\nencoding: gzip\n\nabcdefgh", "damaged"},
    {"a.nrrd", NRRD "sizes: 1 1 9\nencoding: text\n\n1 2 3 4 5 6 7 8 seven", "sample 8: 'seven'"},
    {"a.nrrd", NRRD "sizes: 1 1 4\nencoding: text\n\n1 2 3   ", "ends too early"},
    {"a.nrrd", NRRD "sizes: 1 1 4\nspacings: 0 1 1\nencoding: text\n\n1 2 3 4", "spacings: "},
    {"a.nrrd", NRRD "sizes: 1 1 4\nspace directions: (1,0,0) (0,1,0) (1,1,0)\n"
               "encoding: text\n\n1 2 3 4", "space directions: the axes do not span"},
    {"a.nrrd", NRRD "sizes: 1 1 4\nspace directions: (1,0,0) what\n\n", "space directions: 'what'"},
    {"a.nrrd", "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 4 5 6\nencoding: raw\n\n",
     "axis 4 has 6 samples"},
    {"a.nrrd", "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 4 5 6\nkinds: RGB-color domain "
               "domain domain\nencoding: raw\n\n", "axis 1 has 3 numbers for every sample"},
    {"a.nrrd", "NRRD0004\ntype: short\ndimension: 1\nsizes: 1\nencoding: raw\n\nab",
     "endian: is missing"},
    {"a.nrrd", "NRRD0004\ntype: block\n", "type: 'block'"},
    {"a.nrrd", "NRRD0004\nwhat is this\n", "'what is this' is not a line"},
    {"a.nhdr", NRRD "sizes: 1 1 1\nencoding: raw\ndata file: none.raw\n", "data file: 'none.raw'"},
    {"a.nhdr", NRRD "sizes: 1 1 1\nencoding: raw\ndata file: ../Makefile\n", "outside"},
    {"a.nhdr", NRRD "sizes: 1 1 1\nencoding: raw\ndata file: /etc/passwd\n", "'/etc/passwd'"},
    {"a.nhdr", NRRD "sizes: 1 1 1\nencoding: raw\ndata file: LIST\na\n", "data file: lists"},
    {"a.mhd", "hello", "not a line of a MetaImage"},
    {"a.mhd", "NDims = 3\n", "DimSize: is missing"},
    {"a.mhd", "DimSize = 3 4 5\n", "DimSize: stands before NDims"},
    {"a.mhd", "NDims = 3\nDimSize = 3 4\n", "DimSize: '3 4'"},
    {"a.mhd", "NDims = 3\nDimSize = 3 4 5\nElementType = MET_OTHER\n", "ElementType: 'MET_OTHER'"},
    {"a.mhd", "NDims = 3\nElementNumberOfChannels = 3\n", "ElementNumberOfChannels: '3'"},
    {"a.mhd", "NDims = 3\nDimSize = 3 4 5\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nab",
     "too short for 3 x 4 x 5"},
    {"a.nii", "short", "ends too early"},
    {"a.nii.gz", "\x1f\x8bnonsense that is no gzip", "damaged"},
    {"a.vti", "<VTKFile type='PolyData'/>", "VTKFile: is not of type ImageData"},
    {"a.vti", "<VTKFile type='ImageData' compressor='vtkLZ4DataCompressor'/>", "compressor"},
    {"a.vti", "<VTKFile type='ImageData'><ImageData/></VTKFile>", "Piece: is missing"},
    {"a.vti", "<VTKFile type='ImageData'>", "ends inside <VTKFile>"},
    {"a.vti", "<!DOCTYPE a [<!ENTITY b 'c'>]><VTKFile/>", "document type"},
#define PIECE "<VTKFile type='ImageData'><ImageData><Piece Extent='0 0 0 0 0 3'><PointData>"
    {"a.vti", PIECE "</PointData></Piece></ImageData></VTKFile>", "DataArray: is missing"},
    {"a.vti", PIECE "<DataArray type='UInt8'>1 2 3</DataArray></PointData></Piece></ImageData>"
              "</VTKFile>", "too short for 1 x 1 x 4"},
    {"a.vti", PIECE "<DataArray type='UInt8'>1 2 3 four</DataArray></PointData></Piece>"
              "</ImageData></VTKFile>", "number 3 of 4"},
    {"a.vti", PIECE "<DataArray type='UInt8' format='binary'>BQAAAAECAwQF</DataArray></PointData>"
              "</Piece></ImageData></VTKFile>", "DataArray: holds 5 bytes; expected 4"},
    {"a.vti", PIECE "<DataArray type='UInt8' format='appended' offset='9'/></PointData></Piece>"
              "</ImageData></VTKFile>", "AppendedData: is missing"},
    {"a.vti", PIECE "<DataArray type='UInt8' format='appended' offset='900'/></PointData></Piece>"
              "</ImageData><AppendedData encoding='raw'>_1234</AppendedData></VTKFile>",
     "offset: 900 is behind"},
    {"a.vti", PIECE "<DataArray type='UInt8' NumberOfComponents='3'/></PointData></Piece>"
              "</ImageData></VTKFile>", "NumberOfComponents: 3"},
    {"a.tif", "", "no volume format"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    add_text("%s", cases[i].text);
    expect_error(cases[i].name, cases[i].part);
  }
  zs_diag diag = {0};
  zs_volume volume;
  assert_false(zs_volume_read(&volume, scratch_path(&folder, "nothing.nrrd"), &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
  assert_false(zs_volume_read(&volume, "/dev/zero.nrrd", NULL));
}

/* Files of all formats with some bytes changed, cut off or doubled: read or refused, and
 * within the memory that the file can stand for. */
static void test_mutations(void **state)
{
  (void)state;
  static const char *const names[] = {"a.nrrd", "t.nrrd", "a.mha", "n.nii", "a.nii.gz", "v.vti",
                                      "a.vti",  "a.mhd",  "a.nhdr"};
  uint64_t random = 5;
  for (size_t n = 0; n < sizeof names / sizeof *names; n++) {
    size_t length;
    char *good = read_whole(scratch_path(&folder, names[n]), &length);
    assert_non_null(good);
    for (int i = 0; i < MUTATIONS; i++) {
      add(good, length);
      const size_t header = length < 500 ? length : 500;
      for (unsigned m = 1 + random_below(&random, 4); m > 0; m--) {
        const size_t at = random_below(&random, (unsigned)(i % 3 ? header : length));
        file.bytes[at] = (unsigned char)(random_below(&random, 2)
                                           ? (char)random_bits(&random)
                                           : "0123456789 -.:=\n<>\"(),"[random_below(&random, 22)]);
      }
      if (random_below(&random, 4) == 0)
        file.length = random_below(&random, (unsigned)length);
      char name[16];
      snprintf(name, sizeof name, "m-%s", names[n]);
      zs_volume volume;
      const char *path = save(name);
      if (zs_volume_read(&volume, path, NULL)) {
        double values[4];
        assert_true(zs_volume_count(&volume) <= length * 1032 * 8);
        zs_volume_values(&volume, zs_volume_count(&volume) - 1, 1, values);
      }
      zs_volume_clear(&volume);
    }
    free(good);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_round_trips), cmocka_unit_test(test_nrrd),
    cmocka_unit_test(test_nrrd_text_and_axes), cmocka_unit_test(test_directions),
    cmocka_unit_test(test_meta), cmocka_unit_test(test_nifti), cmocka_unit_test(test_vti),
    cmocka_unit_test(test_bad_headers), cmocka_unit_test(test_mutations)};
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
