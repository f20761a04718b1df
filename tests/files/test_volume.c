/* Volume files: headers that say where samples are, and the samples. */
#include "set_up.h"

#include "files/number.h"
#include "files/volume.h"

#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { NX = 3, NY = 4, NZ = 5, COUNT = NX * NY * NZ };

/* Samples sit at 1.125, -1.75, 100.5 and on, these steps apart. */
static const zs_grid grid = {{1, -2, 100}, {0.25, 0.5, 1}, {NX, NY, NZ}};
static const zs_sample_type types[] = {ZS_SAMPLE_U8, ZS_SAMPLE_I16, ZS_SAMPLE_F32, ZS_SAMPLE_F64};
static const char *const vti_types[] = {"UInt8", "Int16", "Float32", "Float64"};
static const char *const nrrd_types[] = {"uint8", "int16", "float", "double"};
static const char *const mhd_types[] = {"MET_UCHAR", "MET_SHORT", "MET_FLOAT", "MET_DOUBLE"};

/* Bytes of one sample. */
static size_t sample_size(zs_sample_type type)
{
  static const size_t sizes[] = {
    [ZS_SAMPLE_U8] = 1, [ZS_SAMPLE_I16] = 2, [ZS_SAMPLE_F32] = 4, [ZS_SAMPLE_F64] = 8};
  return sizes[type];
}

/* Sample i, a number that every type holds. */
static float sample(size_t i)
{
  return (float)((i * 37) % 200);
}

static void write_volume(const char *path, zs_sample_type type)
{
  zs_volume_writer writer;
  float samples[COUNT];
  for (size_t i = 0; i < COUNT; i++)
    samples[i] = sample(i);
  assert_true(zs_volume_open(&writer, path, &grid, type, "f", NULL));
  assert_true(zs_volume_write_floats(&writer, samples, 7));
  assert_true(zs_volume_write_floats(&writer, samples + 7, COUNT - 7));
  assert_true(zs_volume_commit(&writer, NULL));
}

/* A little-endian number of a type. */
static double decode(const unsigned char *bytes, zs_sample_type type)
{
  uint64_t bits = 0;
  for (size_t i = 0; i < sample_size(type); i++)
    bits |= (uint64_t)bytes[i] << (8 * i);
  float single;
  double number;
  uint32_t narrow = (uint32_t)bits;
  memcpy(&single, &narrow, sizeof single);
  memcpy(&number, &bits, sizeof number);
  return type == ZS_SAMPLE_F64   ? number
         : type == ZS_SAMPLE_F32 ? (double)single
         : type == ZS_SAMPLE_I16 ? (double)(int16_t)bits
                                 : (double)bits;
}

static void check_samples(const char *bytes, zs_sample_type type)
{
  for (size_t i = 0; i < COUNT; i++)
    assert_true(decode((const unsigned char *)bytes + i * sample_size(type), type) ==
                (double)sample(i));
}

static void assert_contains(const char *text, const char *part)
{
  if (!strstr(text, part))
    fail_msg("'%s' is missing in:\n%s", part, text);
}

static void test_vti(void **state)
{
  (void)state;
  for (size_t t = 0; t < 4; t++) {
    size_t length, size = COUNT * sample_size(types[t]);
    const char *path = scratch_path(&folder, "a.vti");
    write_volume(path, types[t]);
    char *text = read_whole(path, &length);
    assert_non_null(text);
    assert_contains(text, "WholeExtent=\"0 2 0 3 0 4\"");
    assert_contains(text, "<Piece Extent=\"0 2 0 3 0 4\">");
    assert_contains(text, "Origin=\"1.125 -1.75 100.5\"");
    assert_contains(text, "Spacing=\"0.25 0.5 1\"");
    assert_contains(text, "byte_order=\"LittleEndian\"");
    assert_contains(text, "header_type=\"UInt64\"");
    char type[64];
    snprintf(type, sizeof type, "<DataArray type=\"%s\" Name=\"f\" format=\"appended\"",
             vti_types[t]);
    assert_contains(text, type);
    const char *data = strchr(strstr(text, "<AppendedData encoding=\"raw\">"), '_') + 1;
    for (int i = 0; i < 8; i++)
      assert_int_equal((unsigned char)data[i], size >> (8 * i) & 255);
    check_samples(data + 8, types[t]);
    assert_string_equal(data + 8 + size, "\n  </AppendedData>\n</VTKFile>\n");
    free(text);
  }
}

static void test_nrrd(void **state)
{
  (void)state;
  for (size_t t = 0; t < 4; t++) {
    size_t length, size = COUNT * sample_size(types[t]);
    const char *path = scratch_path(&folder, "a.NRRD"); /* endings in any case */
    write_volume(path, types[t]);
    char *text = read_whole(path, &length);
    assert_non_null(text);
    assert_int_equal(strncmp(text, "NRRD0004\n", 9), 0);
    char type[64];
    snprintf(type, sizeof type, "\ntype: %s\n", nrrd_types[t]);
    assert_contains(text, type);
    assert_contains(text, "\ndimension: 3\n");
    assert_contains(text, "\nsizes: 3 4 5\n");
    assert_contains(text, "\nspace directions: (0.25,0,0) (0,0.5,0) (0,0,1)\n");
    assert_contains(text, "\nspace origin: (1.125,-1.75,100.5)\n");
    assert_contains(text, "\nencoding: raw\n");
    assert_contains(text, "\nendian: little\n");
    const char *data = strstr(text, "\n\n") + 2;
    assert_int_equal((size_t)(data - text) + size, length);
    check_samples(data, types[t]);
    free(text);
  }
}

static void test_mhd(void **state)
{
  (void)state;
  for (size_t t = 0; t < 4; t++) {
    size_t length, raw_length;
    write_volume(scratch_path(&folder, "name.with.dots.mhd"), types[t]);
    char *text = read_whole(scratch_path(&folder, "name.with.dots.mhd"), &length);
    char *raw = read_whole(scratch_path(&folder, "name.with.dots.raw"), &raw_length);
    assert_non_null(text);
    assert_non_null(raw);
    char type[64];
    snprintf(type, sizeof type, "\nElementType = %s\n", mhd_types[t]);
    assert_contains(text, type);
    assert_contains(text, "\nDimSize = 3 4 5\n");
    assert_contains(text, "\nOffset = 1.125 -1.75 100.5\n");
    assert_contains(text, "\nElementSpacing = 0.25 0.5 1\n");
    assert_contains(text, "\nBinaryDataByteOrderMSB = False\n");
    const char *last = "ElementDataFile = name.with.dots.raw\n"; /* must come last */
    assert_string_equal(text + length - strlen(last), last);
    assert_int_equal(raw_length, COUNT * sample_size(types[t]));
    check_samples(raw, types[t]);
    free(text);
    free(raw);
  }
}

static void test_raw(void **state)
{
  (void)state;
  for (size_t t = 0; t < 4; t++) {
    size_t length;
    const char *path = scratch_path(&folder, "a.raw");
    write_volume(path, types[t]);
    char *bytes = read_whole(path, &length);
    assert_non_null(bytes);
    assert_int_equal(length, COUNT * sample_size(types[t]));
    check_samples(bytes, types[t]);
    free(bytes);
  }
}

/* More samples than are converted at a time, from bytes. */
static void test_bytes(void **state)
{
  (void)state;
  enum { MANY = 10007 };
  uint8_t samples[MANY];
  for (size_t i = 0; i < MANY; i++)
    samples[i] = (uint8_t)(i % 251);
  for (size_t t = 0; t < 4; t++) {
    const zs_grid line = {{0, 0, 0}, {1, 1, 1}, {MANY, 1, 1}};
    const char *path = scratch_path(&folder, "bytes.raw");
    zs_volume_writer writer;
    size_t length;
    assert_true(zs_volume_open(&writer, path, &line, types[t], "inside", NULL));
    assert_true(zs_volume_write_bytes(&writer, samples, MANY));
    assert_true(zs_volume_commit(&writer, NULL));
    char *bytes = read_whole(path, &length);
    assert_non_null(bytes);
    assert_int_equal(length, MANY * sample_size(types[t]));
    for (size_t i = 0; i < MANY; i++)
      assert_true(decode((unsigned char *)bytes + i * sample_size(types[t]), types[t]) ==
                  samples[i]);
    free(bytes);
  }
}

static void test_rounding(void **state)
{
  (void)state;
  const float samples[] = {-1e9f, -0.6f, 0.4f, 0.6f, 254.7f, 1e9f, NAN};
  const double u8[] = {0, 0, 0, 1, 255, 255, 0}, i16[] = {-32768, -1, 0, 1, 255, 32767, 0};
  const zs_grid line = {{0, 0, 0}, {1, 1, 1}, {7, 1, 1}};
  for (size_t t = 0; t < 2; t++) {
    const char *path = scratch_path(&folder, "round.raw");
    zs_volume_writer writer;
    size_t length;
    assert_true(zs_volume_open(&writer, path, &line, types[t], "f", NULL));
    assert_true(zs_volume_write_floats(&writer, samples, 7));
    assert_true(zs_volume_commit(&writer, NULL));
    char *bytes = read_whole(path, &length);
    assert_non_null(bytes);
    for (size_t i = 0; i < 7; i++)
      assert_true(decode((unsigned char *)bytes + i * sample_size(types[t]), types[t]) ==
                  (t ? i16 : u8)[i]);
    free(bytes);
  }
}

/* A volume that is given up leaves nothing, and one that was there before. */
static void test_discard(void **state)
{
  (void)state;
  static const char *const names[] = {"d.vti", "d.nrrd", "d.mhd", "d.raw"};
  int before = scratch_count(&folder);
  for (size_t i = 0; i < 4; i++) {
    zs_volume_writer writer;
    const float samples[COUNT] = {0};
    assert_true(
      zs_volume_open(&writer, scratch_path(&folder, names[i]), &grid, ZS_SAMPLE_F32, "f", NULL));
    assert_true(zs_volume_write_floats(&writer, samples, COUNT));
    zs_volume_discard(&writer);
  }
  assert_int_equal(scratch_count(&folder), before);
}

static void test_bad_names(void **state)
{
  (void)state;
  static const char *const names[] = {
    "volume", "volume.", "volume.png", ".vti.x", "no/such/folder/a.vti", "no/such/folder/a.mhd"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    zs_volume_writer writer;
    zs_diag diag = {0};
    const char *path = scratch_path(&folder, names[i]);
    assert_false(zs_volume_open(&writer, path, &grid, ZS_SAMPLE_F32, "f", &diag));
    assert_int_equal(diag.errors, 1);
    assert_int_equal(diag.status, i < 4 ? ZS_ERROR_ARGUMENT : ZS_ERROR_IO);
  }
}

/* A device that takes nothing: the first failure is kept and reported. */
static void test_full_device(void **state)
{
  (void)state;
  FILE *full = fopen("/dev/full", "wb");
  if (!full)
    skip();
  zs_volume_writer writer;
  zs_diag diag = {0};
  const char *path = scratch_path(&folder, "full.raw");
  assert_true(zs_volume_open(&writer, path, &grid, ZS_SAMPLE_F32, "f", NULL));
  fclose(writer.data.stream);
  writer.data.stream = full;
  const float samples[COUNT] = {0};
  setvbuf(full, NULL, _IONBF, 0);
  assert_false(zs_volume_write_floats(&writer, samples, COUNT));
  assert_false(zs_volume_commit(&writer, &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
  assert_int_equal(access(scratch_path(&folder, "full.raw"), F_OK), -1);
}

static void test_numbers(void **state)
{
  (void)state;
  static const struct {
    double number;
    const char *text;
  } cases[] = {{0, "0"},       {1, "1"},           {-0.25, "-0.25"}, {0.1, "0.1"},
               {1e22, "1e+22"}, {1.5e-7, "1.5e-07"}, {0.1 + 0.2, "0.30000000000000004"}};
  char text[ZS_NUMBER_SIZE];
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_string_equal(zs_number_format(text, cases[i].number), cases[i].text);
  const double extremes[] = {1.7976931348623157e308, 4.9e-324, -2.2250738585072014e-308, 1.0 / 3};
  for (size_t i = 0; i < 4; i++)
    assert_true(strtod(zs_number_format(text, extremes[i]), NULL) == extremes[i]);
}

static void test_comma_locale(void **state)
{
  (void)state;
  static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "fr_FR.utf8"};
  bool found = false;
  for (size_t i = 0; i < 4 && !found; i++)
    found = setlocale(LC_NUMERIC, names[i]) != NULL;
  if (!found)
    skip();
  char text[ZS_NUMBER_SIZE];
  zs_number_format(text, 0.1 + 0.2);
  setlocale(LC_NUMERIC, "C");
  assert_string_equal(text, "0.30000000000000004");
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_vti),         cmocka_unit_test(test_nrrd),
    cmocka_unit_test(test_mhd),         cmocka_unit_test(test_raw),
    cmocka_unit_test(test_bytes),       cmocka_unit_test(test_rounding),
    cmocka_unit_test(test_discard),     cmocka_unit_test(test_bad_names),
    cmocka_unit_test(test_full_device), cmocka_unit_test(test_numbers),
    cmocka_unit_test(test_comma_locale)};
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
