/* Fits in files: what is loaded is what was made, and nothing is solved again. */
#include "../random.h"
#include "scene_text.h"

#include <math.h>
#include <zlib.h>

#define BODY \
  "<param name='t' value='0.3'/><param name='mu' value='0'/>" \
  "<object id='solid'><variational smoothing='{mu}'><points src='sphere.xyz'/></variational>" \
  "</object>" \
  "<object id='between'><variational slice='{t}' smoothing='{mu}'>" \
  "<shape at='0'><contour points='0 0 2 0 2 1 0 1'/></shape>" \
  "<shape at='1'><contour points='0 0 1 0 1 2 0 2'/></shape>" \
  "<pair from='0 0 0' to='0.1 0 0'/></variational></object>"

static void write_sphere(double radius)
{
  FILE *file = create("sphere.xyz");
  for (int i = 0; i < 80; i++) {
    const double z = 1 - (2 * i + 1) / 80.0, r = sqrt(1 - z * z);
    const double p[3] = {r * cos(2.4 * i), r * sin(2.4 * i), z};
    fprintf(file, "%.17g %.17g %.17g %.17g %.17g %.17g\n", radius * p[0], radius * p[1],
            radius * p[2], p[0], p[1], p[2]);
  }
  assert_int_equal(fclose(file), 0);
}

/* f of both objects at some points, and what is told of their fits: the seconds
 * that it took, which are never the same twice. */
typedef struct results {
  double values[100], seconds[2];
} results;

static results results_of(zs_scene *scene)
{
  static const char *const objects[] = {"solid", "between"};
  results r;
  double *value = r.values;
  for (int o = 0; o < 2; o++) {
    zs_diag diag = {0};
    zs_field *field = zs_scene_compile(scene, objects[o], NULL, &diag);
    assert_non_null(field);
    zs_eval *eval = evaluator(field);
    uint64_t seed = 5;
    for (int i = 0; i < 50; i++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = random_between(&seed, -2, 2);
      *value++ = zs_eval_point(eval, p);
    }
    zs_fit_info info;
    assert_true(zs_field_fit(field, 0, &info));
    r.seconds[o] = info.seconds;
    zs_eval_free(eval);
    zs_field_unref(field);
  }
  return r;
}

static zs_scene *load(const char *name)
{
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  char path[sizeof folder.path];
  strcpy(path, scratch_path(&folder, name));
  zs_scene *scene = zs_scene_load(path, NULL, &diag);
  if (!scene)
    fail_msg("%s: %s", s.file, s.message);
  return scene;
}

static bool store(zs_scene *scene, const char *name, zs_diag *diag)
{
  char path[sizeof folder.path];
  strcpy(path, scratch_path(&folder, name));
  return zs_scene_fit(scene, path, NULL, diag);
}

static void fits_are_loaded(void **state)
{
  (void)state;
  write_sphere(1);
  write_text("plain.xml", "<?xml version='1.0'?>\n<!-- <scene> -->\n<scene>" BODY "</scene>\n");
  zs_scene *scene = load("plain.xml");
  zs_diag diag = {0};
  assert_true(store(scene, "fitted.xml", &diag));
  const results made = results_of(scene);
  assert_int_equal(diag.warnings, 0);
  zs_scene_free(scene);
  scene = load("fitted.xml");
  results now = results_of(scene);
  assert_memory_equal(&made, &now, sizeof made);
  /* Another slice is of the same fit. */
  assert_true(zs_scene_set(scene, "t", 0.7, &diag));
  now = results_of(scene);
  assert_memory_equal(made.seconds, now.seconds, sizeof made.seconds);
  /* What a fit depends on is another matter. */
  assert_true(zs_scene_set(scene, "mu", 0.01, &diag));
  now = results_of(scene);
  assert_true(made.seconds[0] != now.seconds[0] && made.seconds[1] != now.seconds[1]);
  zs_scene_free(scene);
  write_sphere(1.1);
  scene = load("fitted.xml");
  const results changed = results_of(scene);
  assert_true(made.seconds[0] != changed.seconds[0] && made.seconds[1] == changed.seconds[1]);
  /* A scene that names a file of fits names the new one when it is stored again. */
  assert_true(store(scene, "again.xml", &diag));
  zs_scene_free(scene);
  scene = load("again.xml");
  now = results_of(scene);
  assert_memory_equal(&changed, &now, sizeof now);
  zs_scene_free(scene);
  /* Through an include. */
  write_text("outer.xml", "<scene><include href='again.xml'/></scene>");
  scene = load("outer.xml");
  now = results_of(scene);
  assert_memory_equal(&changed, &now, sizeof now);
  zs_scene_free(scene);
}

/* Store the fits of the usual scene; the bytes of their file, for free(). */
static char *stored_bytes(size_t *length)
{
  write_sphere(1);
  write_text("plain.xml", "<scene>" BODY "</scene>");
  zs_scene *scene = load("plain.xml");
  zs_diag diag = {0};
  assert_true(store(scene, "fitted.xml", &diag));
  zs_scene_free(scene);
  char *bytes = read_whole(scratch_path(&folder, "fitted.fits"), length);
  assert_non_null(bytes);
  return bytes;
}

static void write_bytes(const char *bytes, size_t length)
{
  FILE *file = create("fitted.fits");
  assert_int_equal(fwrite(bytes, 1, length, file), length);
  assert_int_equal(fclose(file), 0);
}

static void damage_is_noticed(void **state)
{
  (void)state;
  size_t length;
  char *bytes = stored_bytes(&length);
  uint64_t seed = 1;
  for (int i = 0; i < 300; i++) {
    const bool cut = i % 3 == 0;
    const size_t at = i < 100 ? (size_t)i : random_below(&seed, (unsigned)length);
    bytes[at] ^= (char)(1 << i % 8);
    write_bytes(bytes, cut ? at : length);
    bytes[at] ^= (char)(1 << i % 8);
    seen s = {.message = ""};
    zs_diag found = {.report = keep, .context = &s};
    char path[sizeof folder.path];
    strcpy(path, scratch_path(&folder, "fitted.xml"));
    assert_null(zs_scene_load(path, NULL, &found));
    assert_non_null(strstr(s.message, "fits"));
    assert_non_null(strstr(s.file, "fitted.fits"));
  }
  /* Cut by its last byte, and with one more. */
  char *longer = realloc(bytes, length + 1);
  assert_non_null(longer);
  longer[length] = 0;
  for (int more = -1; more <= 1; more += 2) {
    seen s = {.message = ""};
    zs_diag found = {.report = keep, .context = &s};
    char path[sizeof folder.path];
    write_bytes(longer, more < 0 ? length - 1 : length + 1);
    strcpy(path, scratch_path(&folder, "fitted.xml"));
    assert_null(zs_scene_load(path, NULL, &found));
    assert_non_null(strstr(s.message, "fits"));
  }
  free(longer);
}

/* The numbers of a file are 8 bytes, the lowest first, after 16 of magic text. */
static void put_number(char *bytes, size_t index, uint64_t number)
{
  for (int i = 0; i < 8; i++)
    bytes[16 + 8 * index + (size_t)i] = (char)(number >> 8 * i);
}

/* Files made with care: with a right checksum, and sizes, kernels and numbers that lie. Each
 * is refused, or loaded; then it makes a field that can be asked. */
static void lies_do_no_harm(void **state)
{
  (void)state;
  size_t length;
  unsigned refused = 0, loaded = 0;
  char *bytes = stored_bytes(&length), *crafted = malloc(length);
  assert_non_null(crafted);
  const size_t count = (length - 16) / 8;
  static const uint64_t numbers[] = {0, 1, 2, 5, 6, 21, 1000, UINT64_C(1) << 31, UINT64_C(1) << 61,
                                     UINT64_MAX, UINT64_C(0x7ff0000000000000) /* infinity */,
                                     UINT64_C(0x7ff8000000000000) /* NaN */,
                                     UINT64_C(0x7fe0000000000000), /* about the largest */
                                     UINT64_C(0x0000000000000001), UINT64_C(0xbff0000000000000)};
  enum { NUMBERS = sizeof numbers / sizeof *numbers, HEAD = 14 };
  uint64_t seed = 7;
  for (unsigned i = 0; i < 400; i++) {
    const unsigned changes = 1 + (i % 3 == 0);
    memcpy(crafted, bytes, length);
    for (unsigned c = 0; c < changes; c++) {
      const size_t at = i < HEAD * NUMBERS ? i / NUMBERS : random_below(&seed, (unsigned)count - 1);
      put_number(crafted, at, numbers[c ? random_below(&seed, NUMBERS) : i % NUMBERS]);
    }
    put_number(crafted, count - 1,
               crc32(0, (const unsigned char *)crafted + 16, (unsigned)(length - 24)));
    write_bytes(crafted, length);
    char path[sizeof folder.path];
    strcpy(path, scratch_path(&folder, "fitted.xml"));
    zs_diag diag = {0};
    zs_scene *scene = zs_scene_load(path, NULL, &diag);
    refused += !scene;
    loaded += scene != NULL;
    assert_true(scene ? diag.errors == 0 : diag.errors == 1);
    /* Compiling takes its time: some of them. */
    const bool chosen = scene && loaded % 10 == 1;
    zs_field *field = chosen ? zs_scene_compile(scene, "solid", NULL, &diag) : NULL;
    assert_true(!chosen || field || diag.errors > 0);
    zs_eval *eval = field ? evaluator(field) : NULL;
    if (eval)
      zs_eval_point(eval, (const double[3]){0.1, 0.2, 0.3});
    zs_eval_free(eval);
    zs_field_unref(field);
    zs_scene_free(scene);
  }
  assert_true(refused > 50 && loaded > 50);
  free(crafted);
  free(bytes);
}

static void mistakes_are_explained(void **state)
{
  (void)state;
  write_sphere(1);
  write_text("plain.xml", "<scene>" BODY "</scene>");
  zs_scene *scene = load("plain.xml");
  zs_diag diag = {0};
  assert_false(zs_scene_fit(scene, "elsewhere.xml", NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  zs_scene_free(scene);
  write_text("sphere.xml", "<scene><sphere/></scene>");
  scene = load("sphere.xml");
  diag = (zs_diag){0};
  assert_true(store(scene, "none.xml", &diag));
  assert_int_equal(diag.warnings, 1);
  zs_scene_free(scene);
  zs_scene_free(load("none.xml"));
  write_text("broken.xml", "<scene><variational><points src='sphere.xyz' normals='none'/>"
                           "<point at='0 0 0' value='1'/><point at='0 0 0' value='2'/>"
                           "</variational></scene>");
  scene = load("broken.xml");
  diag = (zs_diag){0};
  assert_false(store(scene, "never.xml", &diag));
  assert_int_equal(diag.status, ZS_ERROR_GEOMETRY);
  zs_scene_free(scene);
  assert_null(fopen(scratch_path(&folder, "never.xml"), "r"));
  write_text("lost.xml", "<scene fits='absent.fits'><sphere/></scene>");
  char path[sizeof folder.path];
  strcpy(path, scratch_path(&folder, "lost.xml"));
  diag = (zs_diag){0};
  assert_null(zs_scene_load(path, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(fits_are_loaded),
    cmocka_unit_test(damage_is_noticed),
    cmocka_unit_test(lies_do_no_harm),
    cmocka_unit_test(mistakes_are_explained),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
