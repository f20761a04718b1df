/* The voxelizer: where samples are, what they are, and that no shortcut shows. */
#include "../files/set_up.h"
#include "formula.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static const char ball[] = "0.8 - sqrt(x*x + y*y + z*z)";
/* A box with a bore, a ball beside it, and a place where f is not a number. */
static const char part[] =
  "max(min(min(0.7 - abs(x), 0.5 - abs(y)), min(0.6 - abs(z), sqrt(x*x + y*y) - 0.3)),"
  " 0.3 - sqrt((x - 0.6)^2 + (y + 0.4)^2 + (z - 0.5)^2)) + 0 * sqrt(x + 0.9)";

/* A whole volume in memory. */
typedef struct volume {
  const zs_grid *grid;
  size_t sample; /* bytes of one */
  uint8_t *samples;
  uint32_t next; /* layer expected */
  unsigned slabs;
} volume;

static bool keep(void *context, uint32_t z, uint32_t count_z, const void *samples)
{
  volume *v = context;
  const size_t layer = (size_t)v->grid->count[0] * v->grid->count[1] * v->sample;
  assert_int_equal(z, v->next); /* in order, without gaps */
  assert_true(count_z > 0);
  memcpy(v->samples + z * layer, samples, count_z * layer);
  v->next += count_z;
  v->slabs++;
  return true;
}

static volume sample(const char *formula, const zs_grid *grid, zs_quantity quantity,
                     const zs_control *control, uint64_t *inside, zs_job_report *report)
{
  zs_field *field = formula_field(formula);
  assert_non_null(field);
  volume v = {.grid = grid, .sample = quantity == ZS_QUANTITY_INSIDE ? 1 : sizeof(float)};
  v.samples =
    malloc((size_t)grid->count[0] * grid->count[1] * grid->count[2] * v.sample);
  assert_non_null(v.samples);
  assert_true(
    zs_voxelize(field, grid, quantity, keep, &v, inside, control, report, NULL));
  assert_int_equal(v.next, grid->count[2]);
  zs_field_unref(field);
  return v;
}

static size_t sample_count(const zs_grid *grid)
{
  return (size_t)grid->count[0] * grid->count[1] * grid->count[2];
}

/* Grids that are and are not whole bricks, flat and long ones. */
static const zs_grid grids[] = {{{-1, -1, -1}, {2.0 / 32, 2.0 / 32, 2.0 / 32}, {32, 32, 32}},
                                {{-1, -1.1, -0.9}, {0.05, 0.07, 0.06}, {37, 31, 29}},
                                {{-1, -1, 0.1}, {0.01, 0.02, 0.1}, {200, 100, 1}},
                                {{0.1, 0.1, -1}, {0.1, 0.1, 0.01}, {1, 1, 200}},
                                {{-0.2, -0.2, -0.2}, {0.02, 0.02, 0.02}, {20, 20, 20}}};
enum { GRIDS = sizeof grids / sizeof *grids };

static void test_positions(void **state)
{
  (void)state;
  static const char *const axes[3] = {"x", "y", "z"};
  for (int k = 0; k < 3; k++)
    for (int g = 0; g < GRIDS; g++) {
      const zs_grid *grid = &grids[g];
      volume v = sample(axes[k], grid, ZS_QUANTITY_VALUE, NULL, NULL, NULL);
      const float *f = (const float *)v.samples;
      for (uint32_t z = 0; z < grid->count[2]; z++)
        for (uint32_t y = 0; y < grid->count[1]; y++)
          for (uint32_t x = 0; x < grid->count[0]; x++) {
            const uint32_t at[3] = {x, y, z};
            double expected = grid->lo[k] + (at[k] + 0.5) * grid->cell[k];
            assert_true(fabs((double)*f++ - expected) < 1e-6);
          }
      free(v.samples);
    }
}

/* Far from the origin single precision alone would not do. */
static void test_far_away(void **state)
{
  (void)state;
  const double at[3] = {1e6 + 0.32, -1e6 + 0.32, 1e6 + 0.32};
  const zs_grid grid = {{1e6, -1e6, 1e6}, {0.01, 0.01, 0.01}, {64, 64, 64}};
  zs_field *field = formula_field_at("0.3 - sqrt(x*x + y*y + z*z)", at);
  assert_non_null(field);
  volume v = {.grid = &grid, .sample = 1, .samples = malloc(64 * 64 * 64)};
  uint64_t inside;
  assert_true(zs_voxelize(field, &grid, ZS_QUANTITY_INSIDE, keep, &v, &inside, NULL, NULL, NULL));
  const double size = (double)inside * 1e-6, exact = 4.0 / 3 * acos(-1) * 0.027;
  assert_true(fabs(size - exact) < 0.005 * exact);
  free(v.samples);
  zs_field_unref(field);
}

static void test_inside_count(void **state)
{
  (void)state;
  for (int g = 0; g < GRIDS; g++) {
    const zs_grid *grid = &grids[g];
    uint64_t inside, inside_values, exact = 0;
    volume v = sample(ball, grid, ZS_QUANTITY_INSIDE, NULL, &inside, NULL);
    volume values = sample(ball, grid, ZS_QUANTITY_VALUE, NULL, &inside_values, NULL);
    const uint8_t *bit = v.samples;
    for (uint32_t z = 0; z < grid->count[2]; z++)
      for (uint32_t y = 0; y < grid->count[1]; y++)
        for (uint32_t x = 0; x < grid->count[0]; x++, bit++) {
          const uint32_t at[3] = {x, y, z};
          double square = 0;
          for (int k = 0; k < 3; k++) {
            double c = grid->lo[k] + (at[k] + 0.5) * grid->cell[k];
            square += c * c;
          }
          if (fabs(sqrt(square) - 0.8) > 1e-6)
            assert_int_equal(*bit, square < 0.64);
          exact += *bit;
        }
    assert_int_equal(inside, exact);
    assert_int_equal(inside_values, exact);
    free(v.samples);
    free(values.samples);
  }
}

/* Pruned or not, on one thread or three, in one slab or many: the same bytes. */
static void test_shortcuts(void **state)
{
  (void)state;
  for (int g = 0; g < GRIDS; g++)
    for (int quantity = 0; quantity < 2; quantity++) {
      zs_control plain, other;
      zs_control_init(&plain);
      plain.threads = 1;
      plain.brute = true;
      zs_job_report brute, pruned;
      volume expected = sample(part, &grids[g], (zs_quantity)quantity, &plain, NULL, &brute);
      assert_int_equal(brute.evaluations, sample_count(&grids[g]));
      for (unsigned threads = 1; threads <= 3; threads++)
        for (int limited = 0; limited < 2; limited++) {
          zs_control_init(&other);
          other.threads = threads;
          other.memory_limit =
            limited ? 9 * expected.sample * grids[g].count[0] * grids[g].count[1] : 0;
          volume v = sample(part, &grids[g], (zs_quantity)quantity, &other, NULL, &pruned);
          assert_memory_equal(v.samples, expected.samples, sample_count(&grids[g]) * v.sample);
          assert_true(!limited || grids[g].count[2] < 10 || v.slabs > 1);
          assert_true(!limited || pruned.peak_bytes <= other.memory_limit);
          assert_int_equal(pruned.threads, threads);
          free(v.samples);
        }
      free(expected.samples);
    }
}

static void test_pruning_pays(void **state)
{
  (void)state;
  const zs_grid grid = {{-1, -1, -1}, {2.0 / 128, 2.0 / 128, 2.0 / 128}, {128, 128, 128}};
  zs_job_report report;
  volume v = sample(ball, &grid, ZS_QUANTITY_INSIDE, NULL, NULL, &report);
  assert_true(report.evaluations < sample_count(&grid) / 2);
  free(v.samples);
}

static bool refuse_after_two(void *context, uint32_t z, uint32_t count_z, const void *samples)
{
  (void)z, (void)count_z, (void)samples;
  return ++*(unsigned *)context < 2;
}

static void test_sink_stops(void **state)
{
  (void)state;
  zs_field *field = formula_field(ball);
  assert_non_null(field);
  zs_control control;
  zs_control_init(&control);
  control.memory_limit = 32 * 32 * 16;
  unsigned calls = 0;
  zs_diag diag = {0};
  const zs_grid grid = {{-1, -1, -1}, {0.1, 0.1, 0.1}, {32, 32, 64}};
  assert_false(zs_voxelize(field, &grid, ZS_QUANTITY_INSIDE, refuse_after_two, &calls, NULL,
                           &control, NULL, &diag));
  assert_int_equal(calls, 2);
  assert_int_equal(diag.status, ZS_CANCELLED);
  zs_field_unref(field);
}

static void test_memory_limit(void **state)
{
  (void)state;
  zs_field *field = formula_field(ball);
  assert_non_null(field);
  zs_control control;
  zs_control_init(&control);
  control.memory_limit = 32 * 32 - 1; /* less than a layer */
  unsigned calls = 0;
  zs_diag diag = {0};
  assert_false(zs_voxelize(field, &grids[0], ZS_QUANTITY_INSIDE, refuse_after_two, &calls, NULL,
                           &control, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_MEMORY);
  assert_int_equal(calls, 0);
  zs_field_unref(field);
}

/* ---- Files ---------------------------------------------------------------------- */

static void test_file(void **state)
{
  (void)state;
  static const char *const names[] = {"v.vti", "v.nrrd", "v.raw", "v.mhd"};
  zs_field *field = formula_field(part);
  assert_non_null(field);
  volume v = sample(part, &grids[1], ZS_QUANTITY_VALUE, NULL, NULL, NULL);
  const size_t size = sample_count(&grids[1]) * sizeof(float);
  for (size_t i = 0; i < 4; i++) {
    assert_true(zs_voxelize_file(field, &grids[1], ZS_QUANTITY_VALUE, ZS_SAMPLE_F32,
                                 scratch_path(&folder, names[i]), NULL, NULL, NULL, NULL));
    size_t length;
    char *bytes = read_whole(scratch_path(&folder, i == 3 ? "v.raw" : names[i]), &length);
    assert_non_null(bytes);
    /* The samples stand at the end, before what closes a .vti. */
    size_t closing = i == 0 ? strlen("\n  </AppendedData>\n</VTKFile>\n") : 0;
    assert_true(length >= size + closing);
    const uint16_t probe = 1;
    if (*(const uint8_t *)&probe) /* in the machine's own order of bytes */
      assert_memory_equal(bytes + length - closing - size, v.samples, size);
    free(bytes);
  }
  free(v.samples);
  zs_field_unref(field);
}

/* Progress that never goes back, and stops the job after some calls. */
typedef struct watcher {
  unsigned calls, allowed;
  double latest;
} watcher;

static bool watch(void *context, const char *stage, double fraction)
{
  watcher *w = context;
  assert_non_null(stage);
  assert_true(fraction >= w->latest && fraction <= 1);
  w->latest = fraction;
  return ++w->calls <= w->allowed;
}

static void test_progress(void **state)
{
  (void)state;
  watcher w = {.allowed = UINT32_MAX};
  zs_control control;
  zs_control_init(&control);
  control.threads = 1;
  control.progress = watch;
  control.context = &w;
  control.memory_limit = 37 * 31 * 8;
  volume v = sample(part, &grids[1], ZS_QUANTITY_INSIDE, &control, NULL, NULL);
  assert_true(w.calls > 4);
  assert_true(w.latest == 1);
  free(v.samples);
}

/* Whenever a job is cancelled, the file that was there stays as it was. */
static void test_cancel(void **state)
{
  (void)state;
  static const char *const names[] = {"c.vti", "c.nrrd", "c.mhd", "c.raw"};
  zs_field *field = formula_field(part);
  assert_non_null(field);
  for (size_t i = 0; i < 4; i++) {
    FILE *old = fopen(scratch_path(&folder, names[i]), "wb");
    assert_non_null(old);
    fputs("old", old);
    fclose(old);
    int before = scratch_count(&folder);
    for (unsigned allowed = 0; allowed < 4; allowed++) {
      watcher w = {.allowed = allowed};
      zs_control control;
      zs_control_init(&control);
      control.progress = watch;
      control.context = &w;
      control.memory_limit = 37 * 31 * 8;
      zs_diag diag = {0};
      assert_false(zs_voxelize_file(field, &grids[1], ZS_QUANTITY_INSIDE, ZS_SAMPLE_U8,
                                    scratch_path(&folder, names[i]), NULL, &control, NULL, &diag));
      assert_int_equal(diag.status, ZS_CANCELLED);
      assert_int_equal(diag.errors, 1);
      assert_int_equal(scratch_count(&folder), before);
      size_t length;
      char *text = read_whole(scratch_path(&folder, names[i]), &length);
      assert_string_equal(text, "old");
      free(text);
    }
  }
  zs_field_unref(field);
}

static void test_bad_files(void **state)
{
  (void)state;
  const struct {
    const char *name;
    zs_quantity quantity;
    zs_sample_type type;
    zs_status status;
  } cases[] = {{"e.vti", ZS_QUANTITY_VALUE, ZS_SAMPLE_U8, ZS_ERROR_ARGUMENT},
               {"e.vti", ZS_QUANTITY_VALUE, ZS_SAMPLE_I16, ZS_ERROR_ARGUMENT},
               {"e.stl", ZS_QUANTITY_VALUE, ZS_SAMPLE_F32, ZS_ERROR_ARGUMENT},
               {"e", ZS_QUANTITY_INSIDE, ZS_SAMPLE_U8, ZS_ERROR_ARGUMENT},
               {"e.vti", ZS_QUANTITY_INSIDE, (zs_sample_type)4, ZS_ERROR_ARGUMENT},
               {"e.vti", (zs_quantity)2, ZS_SAMPLE_U8, ZS_ERROR_ARGUMENT},
               {"no/folder/e.vti", ZS_QUANTITY_INSIDE, ZS_SAMPLE_U8, ZS_ERROR_IO},
               {"no/folder/e.mhd", ZS_QUANTITY_INSIDE, ZS_SAMPLE_U8, ZS_ERROR_IO}};
  zs_field *field = formula_field(part);
  assert_non_null(field);
  int before = scratch_count(&folder);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    zs_diag diag = {0};
    assert_false(zs_voxelize_file(field, &grids[1], cases[i].quantity, cases[i].type,
                                  scratch_path(&folder, cases[i].name), NULL, NULL, NULL, &diag));
    assert_int_equal(diag.errors, 1);
    assert_int_equal(diag.status, cases[i].status);
  }
  assert_int_equal(scratch_count(&folder), before);
  zs_field_unref(field);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_positions),    cmocka_unit_test(test_far_away),
    cmocka_unit_test(test_inside_count), cmocka_unit_test(test_shortcuts),
    cmocka_unit_test(test_pruning_pays), cmocka_unit_test(test_sink_stops),
    cmocka_unit_test(test_memory_limit), cmocka_unit_test(test_file),
    cmocka_unit_test(test_progress),     cmocka_unit_test(test_cancel),
    cmocka_unit_test(test_bad_files)};
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
