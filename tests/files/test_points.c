/* Reading point sets: every form of file, and what is wrong with bad ones. */
#include "../random.h"
#include "files/points.h"
#include "set_up.h"

#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

typedef struct found {
  char message[512];
  unsigned line;
  char file[256];
} found;

static void keep(void *context, const zs_diagnostic *d)
{
  found *f = context;
  snprintf(f->message, sizeof f->message, "%s", d->message);
  snprintf(f->file, sizeof f->file, "%s", d->file ? d->file : "");
  f->line = d->line;
}

static zs_points read_text(const char *text)
{
  zs_points points;
  found f = {.message = ""};
  zs_diag diag = {.report = keep, .context = &f};
  if (!zs_points_read(&points, written("points", text, strlen(text)), &diag))
    fail_msg("%s", f.message);
  assert_int_equal(diag.errors, 0);
  return points;
}

static void check(const double *numbers, size_t count, const double *expected)
{
  assert_non_null(numbers);
  for (size_t i = 0; i < count; i++)
    assert_true(numbers[i] == expected[i]);
}

static void columns_by_their_number(void **state)
{
  (void)state;
  zs_points p = read_text("# a comment\n\n1 2 3\n-4.5e1,+5;\t.5 # more\r\n");
  assert_int_equal(p.count, 2);
  check(p.positions, 6, (double[]){1, 2, 3, -45, 5, 0.5});
  assert_null(p.normals);
  assert_null(p.values);
  zs_points_clear(&p);

  p = read_text("1 2 3 4");
  assert_int_equal(p.count, 1);
  assert_null(p.normals);
  check(p.values, 1, (double[]){4});
  zs_points_clear(&p);

  p = read_text("1 2 3 4 5 6\n");
  check(p.normals, 3, (double[]){4, 5, 6});
  assert_null(p.values);
  zs_points_clear(&p);

  p = read_text("1 2 3 4 5 6 7\n");
  check(p.positions, 3, (double[]){1, 2, 3});
  check(p.normals, 3, (double[]){4, 5, 6});
  check(p.values, 1, (double[]){7});
  zs_points_clear(&p);
}

static void columns_by_name(void **state)
{
  (void)state;
  zs_points p = read_text("\xef\xbb\xbf\"value\",red,z,y,x,label\n"
                          "9,255,3,2,1,left\n8,0,6,5,4,right\n");
  assert_int_equal(p.count, 2);
  check(p.positions, 6, (double[]){1, 2, 3, 4, 5, 6});
  check(p.values, 2, (double[]){9, 8});
  assert_null(p.normals);
  zs_points_clear(&p);
}

/* A host may use a comma for its numbers. */
static void the_locale_does_not_matter(void **state)
{
  (void)state;
  static const char *const locales[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"};
  for (int i = 0; i < 3; i++) {
    if (!setlocale(LC_ALL, locales[i]))
      continue;
    zs_points p = read_text("0.5 1.25 -2.75\n");
    check(p.positions, 3, (double[]){0.5, 1.25, -2.75});
    zs_points_clear(&p);
  }
  setlocale(LC_ALL, "C");
}

static void ply_text(void **state)
{
  (void)state;
  zs_points p = read_text("ply\nformat ascii 1.0\ncomment made by hand\n"
                          "element camera 1\nproperty list uchar float matrix\n"
                          "element vertex 2\nproperty float nx\nproperty float ny\n"
                          "property float nz\nproperty double x\nproperty double y\n"
                          "property double z\nproperty uchar red\n"
                          "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                          "2 0.5 0.25\n0 0 1 1 2 3 255\n0 1 0\n4 5 6 0\n3 0 1 0\n");
  assert_int_equal(p.count, 2);
  check(p.positions, 6, (double[]){1, 2, 3, 4, 5, 6});
  check(p.normals, 6, (double[]){0, 0, 1, 0, 1, 0});
  assert_null(p.values);
  zs_points_clear(&p);
}

/* Append the bytes of a number of up to 8 bytes, least significant first, or
 * last. */
static size_t put(char *to, uint64_t bits, unsigned size, bool big)
{
  for (unsigned i = 0; i < size; i++)
    to[i] = (char)(bits >> 8 * (big ? size - 1 - i : i));
  return size;
}

static void ply_binary(void **state)
{
  (void)state;
  static const char header[] = "ply\nformat binary_%s_endian 1.0\nelement vertex 2\n"
                               "property float x\nproperty double y\nproperty short z\n"
                               "property list uchar int skipped\nproperty uchar value\n"
                               "end_header\n";
  for (int big = 0; big <= 1; big++) {
    char bytes[512];
    size_t n = (size_t)snprintf(bytes, sizeof bytes, header, big ? "big" : "little");
    for (int i = 0; i < 2; i++) {
      float x = 1.5f;
      double y = -2.25;
      uint32_t x_bits;
      uint64_t y_bits;
      memcpy(&x_bits, &x, sizeof x);
      memcpy(&y_bits, &y, sizeof y);
      n += put(bytes + n, x_bits, 4, big);
      n += put(bytes + n, y_bits, 8, big);
      n += put(bytes + n, (uint64_t)-7, 2, big);
      n += put(bytes + n, (uint64_t)i, 1, big);
      for (int k = 0; k < i; k++)
        n += put(bytes + n, 99, 4, big);
      n += put(bytes + n, 200, 1, big);
    }
    zs_points p;
    assert_true(zs_points_read(&p, written("points", bytes, n), NULL));
    assert_int_equal(p.count, 2);
    check(p.positions, 6, (double[]){1.5, -2.25, -7, 1.5, -2.25, -7});
    check(p.values, 2, (double[]){200, 200});
    zs_points_clear(&p);
    /* Every shorter file is an error. */
    for (size_t shorter = 0; shorter < n; shorter++)
      assert_false(zs_points_read(&p, written("points", bytes, shorter), NULL));
  }
}

static void bad_files_are_explained(void **state)
{
  (void)state;
  static const struct {
    const char *text;
    unsigned line;
    const char *message;
  } cases[] = {
    {"", 0, "no points"},
    {"# only a comment\n", 0, "no points"},
    {"x y z\n", 0, "no points"},
    {"1 2\n", 1, "2 columns; expected 3"},
    {"\n1 2 3 4 5\n", 2, "5 columns; expected 3"},
    {"1 2 3\n4 5\n", 2, "2 columns; expected 3 as before"},
    {"1 2 3\n1 2 3\n4 5 6 7\n", 3, "4 columns; expected 3 as before"},
    {"1 2 3\n4 nan 6\n", 2, "'nan' is not a finite number"},
    {"1 2 3\n4 5 inf\n", 2, "'inf' is not a finite number"},
    {"1 2 3\n4 5 1e999\n", 2, "'1e999' is not a finite number"},
    {"1 2 3\n4 5 6x\n", 2, "'6x' is not a finite number"},
    {"1 2 3\n4 5 0x10\n", 2, "'0x10' is not a finite number"},
    {"nan 2 3\n", 1, "not all named"},
    {"x y\n1 2\n", 1, "not all named"},
    {"x y z nx\n1 2 3 4\n", 1, "only some"},
    {"x y z x\n1 2 3 4\n", 1, "'x' is not the only column"},
    {"ply\nformat ascii 2.x\nelement vertex 1\nproperty float x\n", 5, "ends inside its header"},
    {"ply\nformat text 1.0\n", 2, "'text' is not a PLY format"},
    {"ply\nformat ascii 1.0\nelement vertex -1\n", 3, "'-1' is not a count"},
    {"ply\nformat ascii 1.0\nproperty float x\n", 3, "before the first element"},
    {"ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n", 4, "'real' is not a property"},
    {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", 5, "not all"},
    {"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int x\nend_header\n1 1\n", 5,
     "not all"},
    {"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
     "property float z\nend_header\n1 2 3\n4 5\n", 10, "before all elements"},
    {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
     "property float z\nend_header\n1 2 nan\n", 8, "'nan' is not a finite number"},
    {"ply\nformat ascii 1.0\nrubbish\n", 3, "'rubbish' is not a PLY keyword"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    zs_points points;
    found f = {.message = ""};
    zs_diag diag = {.report = keep, .context = &f};
    const char *path = written("points", cases[i].text, strlen(cases[i].text));
    assert_false(zs_points_read(&points, path, &diag));
    assert_int_equal(diag.errors, 1);
    if (!strstr(f.message, cases[i].message) || f.line != cases[i].line)
      fail_msg("case %zu: line %u: %s", i, f.line, f.message);
    assert_string_equal(f.file, path);
    assert_null(points.positions);
  }
}

static void binary_and_absent_files(void **state)
{
  (void)state;
  zs_points points;
  found f = {.message = ""};
  zs_diag diag = {.report = keep, .context = &f};
  assert_false(zs_points_read(&points, written("points", "1 2 3\n\0\1\2", 9), &diag));
  assert_int_equal(f.line, 2);
  assert_int_equal(diag.status, ZS_ERROR_SYNTAX);
  char line[6000];
  memset(line, '1', sizeof line);
  assert_false(zs_points_read(&points, written("points", line, sizeof line), &diag));
  assert_non_null(strstr(f.message, "longer than"));
  diag.errors = 0;
  assert_false(zs_points_read(&points, scratch_path(&folder, "absent"), &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
  diag.errors = 0;
  assert_false(zs_points_read(&points, folder.folder, &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
}

/* Whatever the bytes, a file is read or refused with one error. */
static void damaged_files_are_read_or_refused(void **state)
{
  (void)state;
  static const char *const whole[] = {
    "x y z value\n1 2 3 4\n-5e2 6 7. 8\n",
    "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int v\n"
    "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    "\1aaaa0123456789ab0123456789ab"};
  static const char likely[] = "0123456789 \n\t.,-+e#xyznply";
  uint64_t seed = 20;
  unsigned read = 0, refused = 0;
  for (int i = 0; i < 2000; i++) {
    char bytes[512];
    size_t length = strlen(whole[i % 2]);
    memcpy(bytes, whole[i % 2], length);
    for (unsigned change = random_below(&seed, 4) + 1; change-- > 0;) {
      size_t at = random_below(&seed, (unsigned)length);
      bytes[at] = random_below(&seed, 4) ? likely[random_below(&seed, sizeof likely - 1)]
                                         : (char)random_below(&seed, 256);
    }
    zs_diag diag = {0};
    zs_points points;
    if (zs_points_read(&points, written("points", bytes, length), &diag)) {
      read++;
      assert_int_equal(diag.errors, 0);
      for (size_t k = 0; k < 3 * points.count; k++)
        assert_true(isfinite(points.positions[k]));
      zs_points_clear(&points);
    } else {
      refused++;
      assert_int_equal(diag.errors, 1);
      assert_null(points.positions);
    }
  }
  assert_true(read > 100 && refused > 100);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(columns_by_their_number),
    cmocka_unit_test(columns_by_name),
    cmocka_unit_test(the_locale_does_not_matter),
    cmocka_unit_test(ply_text),
    cmocka_unit_test(ply_binary),
    cmocka_unit_test(bad_files_are_explained),
    cmocka_unit_test(binary_and_absent_files),
    cmocka_unit_test(damaged_files_are_read_or_refused),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
