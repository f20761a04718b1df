/* The polygonizer: topology whatever the field, measures, accuracy. */
#include "meshes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double PI = 3.14159265358979323846;

static const char SPHERE[] = "0.8 - sqrt(x*x + y*y + z*z)";
static const char TORUS[] = "0.25 - hypot(hypot(x, y) - 0.6, z)";
static const char CUBE[] = "min(min(0.7 - abs(x), 0.6 - abs(y)), 0.5 - abs(z))";

static zs_mesh *polygonize(const char *formula, const zs_grid *grid, bool cap, unsigned threads,
                           bool brute, zs_job_report *report)
{
  return mesh_formula(formula, grid, ZS_MESH_CONTOUR, cap, threads, brute, report);
}

/* Whatever the field and wherever the grid cuts it: sound, and still so when
 * coinciding vertices are welded. */
static void every_mesh_is_a_closed_manifold(void **state)
{
  (void)state;
  static const char *const formulas[] = {SPHERE, TORUS, CUBE, NOISE,
                                         "x", "0.3 - abs(z)", "x + y - 0.1", "x*y*z",
                                         "sin(9*x)*sin(9*y)*sin(9*z)",
                                         "max(0.2 - hypot(x, y), 0.1 - hypot(y, z))"};
  static const double boxes[][2] = {{-1, 1}, {-0.63, 0.71}, {-0.5, 0.5}};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++)
    for (size_t b = 0; b < 3; b++)
      assert_sound_in(formulas[i], ZS_MESH_CONTOUR, boxes[b], 11);
}

static void grids_of_any_shape_are_sound(void **state)
{
  (void)state;
  assert_noise_is_sound(ZS_MESH_CONTOUR);
}

/* Without caps only the box's faces bound the surface. */
static void open_meshes_end_at_the_box(void **state)
{
  (void)state;
  zs_grid grid = cube_grid(-0.5, 0.5, 24);
  zs_mesh *mesh = polygonize(NOISE, &grid, false, 2, false, NULL);
  assert_non_null(mesh);
  zs_mesh_report report = check_mesh(mesh);
  assert_false(report.closed);
  assert_true(report.manifold);
  assert_true(report.oriented);
  assert_true(report.boundary_edges > 0);
  zs_mesh_free(mesh);
  grid = cube_grid(-1, 1, 24);
  mesh = polygonize(SPHERE, &grid, false, 2, false, NULL);
  assert_sound(mesh);
  zs_mesh_free(mesh);
}

typedef struct measured {
  const char *formula;
  double volume, area;
  int64_t euler_characteristic;
  bool smooth;
} measured;

static void measures_converge_to_closed_forms(void **state)
{
  (void)state;
  const measured solids[] = {
    {SPHERE, 4 / 3.0 * PI * 0.512, 4 * PI * 0.64, 2, true},
    {TORUS, 2 * PI * PI * 0.6 * 0.0625, 4 * PI * PI * 0.6 * 0.25, 0, true},
    {CUBE, 1.4 * 1.2 * 1, 2 * (1.4 * 1.2 + 1.4 + 1.2), 2, false},
    {"0.4 - sqrt(x*x + y*y + max(abs(z) - 0.4, 0)^2)",
     PI * 0.16 * 0.8 + 4 / 3.0 * PI * 0.064, 2 * PI * 0.4 * 0.8 + 4 * PI * 0.16, 2, true},
    /* A sphere with a hole drilled through: the "napkin ring". */
    {"min(0.8 - sqrt(x*x + y*y + z*z), hypot(x, y) - 0.4)",
     4 / 3.0 * PI * pow(0.64 - 0.16, 1.5), 4 * PI * (0.8 + 0.4) * sqrt(0.64 - 0.16), 0, false},
  };
  for (size_t i = 0; i < sizeof solids / sizeof *solids; i++) {
    const measured *solid = &solids[i];
    double error[3];
    for (int level = 0; level < 3; level++) {
      zs_grid grid = cube_grid(-1.013, 1.009, 32u << level);
      zs_mesh *mesh = polygonize(solid->formula, &grid, true, 2, false, NULL);
      assert_sound(mesh);
      zs_mesh_report report = check_mesh(mesh);
      assert_int_equal(report.components, 1);
      assert_int_equal(report.euler_characteristic, solid->euler_characteristic);
      error[level] = fabs(report.volume / solid->volume - 1);
      if (level == 2) {
        assert_true(error[2] < 0.002);
        assert_true(fabs(report.area / solid->area - 1) < 0.002);
      }
      zs_mesh_free(mesh);
    }
    if (solid->smooth) {
      double order = log2(error[0] / error[2]) / 2;
      assert_true(order >= 1.8);
    }
  }
}

/* Sharp edges and corners are met, not cut off: a cube along the axes is exact at
 * any resolution, a tilted one nearly so. */
static void sharp_edges_are_kept(void **state)
{
  (void)state;
  static const char tilted[] =
    "let c = cos(0.4); let s = sin(0.4); let u = c*x + s*y; let v = c*y - s*x;"
    "let p = c*u + s*z; let q = c*z - s*u;"
    "min(min(0.6 - abs(p), 0.6 - abs(v)), 0.6 - abs(q))";
  for (uint32_t resolution = 8; resolution <= 64; resolution *= 2) {
    zs_grid grid = cube_grid(-1.113, 1.109, resolution);
    zs_mesh *mesh = polygonize(CUBE, &grid, true, 2, false, NULL);
    assert_sound(mesh);
    zs_mesh_report report = check_mesh(mesh);
    assert_true(fabs(report.volume / 1.68 - 1) < 1e-5);
    assert_true(fabs(report.area / 8.56 - 1) < 1e-5);
    zs_mesh_free(mesh);
    mesh = polygonize(tilted, &grid, true, 2, false, NULL);
    assert_sound(mesh);
    report = check_mesh(mesh);
    assert_int_equal(report.euler_characteristic, 2);
    assert_true(fabs(report.volume / 1.728 - 1) < 0.15 / resolution);
    assert_true(fabs(report.area / 8.64 - 1) < 0.15 / resolution);
    zs_mesh_free(mesh);
  }
}

/* Without creases every vertex is on an edge of the lattice or moved with its
 * corners; with them there are more vertices, two triangles for each. */
static void creases_can_be_left_out(void **state)
{
  (void)state;
  zs_field *field = formula_field(CUBE);
  zs_grid grid = cube_grid(-1.013, 1.009, 24);
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  zs_mesh *with = zs_polygonize(field, &grid, &options, NULL, NULL, NULL);
  options.creases = false;
  zs_mesh *without = zs_polygonize(field, &grid, &options, NULL, NULL, NULL);
  options.normals = false;
  zs_mesh *bare = zs_polygonize(field, &grid, &options, NULL, NULL, NULL);
  options.creases = true;
  zs_mesh *bare_with = zs_polygonize(field, &grid, &options, NULL, NULL, NULL);
  assert_sound(with);
  assert_sound(without);
  assert_sound(bare);
  assert_sound(bare_with);
  size_t more = with->vertex_count - without->vertex_count;
  assert_true(more > 100);
  assert_int_equal(with->triangle_count, without->triangle_count + 2 * more);
  assert_memory_equal(with->positions, without->positions, 12 * without->vertex_count);
  assert_null(bare->normals);
  assert_null(bare_with->normals);
  assert_memory_equal(bare->positions, without->positions, 12 * without->vertex_count);
  assert_memory_equal(bare_with->positions, with->positions, 12 * with->vertex_count);
  zs_mesh_free(with);
  zs_mesh_free(without);
  zs_mesh_free(bare);
  zs_mesh_free(bare_with);
  zs_field_unref(field);
}

/* Vertices lie on f = 0: to a millionth of the box for distances, and for other
 * fields a sign change lies within that distance along some direction. */
static void vertices_are_certified_roots(void **state)
{
  (void)state;
  static const char *const distances[] = {
    SPHERE, TORUS, CUBE, "min(0.8 - sqrt(x*x + y*y + z*z), hypot(x, y) - 0.4)"};
  static const char *const hostile[] = {
    "(0.8 - sqrt(x*x + y*y + z*z))^3", "0.8 - sqrt(x*x + y*y + z*z) < 0 ? -1 : 1",
    "let d = 0.8 - sqrt(x*x + y*y + z*z); d < 0 ? 1e-3*d : d",
    "(0.8 - sqrt(x*x + y*y + z*z)) * 1e30", "(0.8 - sqrt(x*x + y*y + z*z)) * 1e-30"};
  const double tolerance = 2e-6; /* 1e-6 of a box of side 2 */
  zs_grid grid = cube_grid(-1, 1, 40);
  for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
    zs_mesh *mesh = polygonize(distances[i], &grid, true, 2, false, NULL);
    assert_non_null(mesh);
    zs_field *field = formula_field(distances[i]);
    zs_eval *eval = zs_eval_new(field, NULL);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      const float *p = mesh->positions + 3 * v;
      double point[3] = {p[0], p[1], p[2]};
      assert_true(fabs(zs_eval_point(eval, point)) <= tolerance);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
    zs_mesh_free(mesh);
  }
  for (size_t i = 0; i < sizeof hostile / sizeof *hostile; i++) {
    zs_job_report report;
    zs_mesh *mesh = polygonize(hostile[i], &grid, true, 2, false, &report);
    assert_non_null(mesh);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      const float *p = mesh->positions + 3 * v;
      double r = sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]);
      assert_true(fabs(r - 0.8) <= tolerance);
    }
    zs_mesh_free(mesh);
  }
}

static void normals_are_unit_and_point_out(void **state)
{
  (void)state;
  zs_grid grid = cube_grid(-1, 1, 33);
  zs_mesh *mesh = polygonize(SPHERE, &grid, true, 2, false, NULL);
  assert_non_null(mesh);
  for (size_t v = 0; v < mesh->vertex_count; v++)
    for (int k = 0; k < 3; k++)
      assert_true(fabs(mesh->normals[3 * v + k] - mesh->positions[3 * v + k] / 0.8) < 1e-5);
  zs_mesh_free(mesh);
  /* A field without gradients: the faces' normals stand in. */
  mesh = polygonize("sqrt(x*x + y*y + z*z) < 0.8 ? 1 : -1", &grid, true, 2, false, NULL);
  assert_non_null(mesh);
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    double along = 0, length = 0;
    for (int k = 0; k < 3; k++) {
      along += (double)mesh->normals[3 * v + k] * mesh->positions[3 * v + k] / 0.8;
      length += (double)mesh->normals[3 * v + k] * mesh->normals[3 * v + k];
    }
    assert_true(fabs(length - 1) < 1e-5);
    assert_true(along > 0.97);
  }
  zs_mesh_free(mesh);
}

/* The box of a domain within the solid is exact, with face normals. */
static void a_box_within_the_solid_is_exact(void **state)
{
  (void)state;
  for (int brute = 0; brute < 2; brute++)
    for (uint32_t resolution = 1; resolution < 40; resolution += 6) {
      zs_grid grid = cube_grid(-0.25, 0.5, resolution);
      zs_mesh *mesh = polygonize("4 - x*x - y*y - z*z", &grid, true, 2, brute, NULL);
      assert_sound(mesh);
      assert_distinct(mesh);
      zs_mesh_report report = check_mesh(mesh);
      assert_true(fabs(report.volume - 0.421875) < 1e-12);
      assert_true(fabs(report.area - 6 * 0.5625) < 1e-12);
      assert_int_equal(report.euler_characteristic, 2);
      for (size_t v = 0; v < mesh->vertex_count; v++) {
        double square = 0;
        for (int k = 0; k < 3; k++) {
          float p = mesh->positions[3 * v + k], n = mesh->normals[3 * v + k];
          assert_true(p == 0.5f ? n > 0.5f : p == -0.25f ? n < -0.5f : n == 0);
          square += (double)n * n;
        }
        assert_true(fabs(square - 1) < 1e-6);
      }
      zs_mesh_free(mesh);
    }
}

/* The number of threads does not change a byte, nor pruning the surface. */
static void meshes_are_the_same_however_they_are_made(void **state)
{
  (void)state;
  static const char *const formulas[] = {SPHERE, TORUS, CUBE,
                                         "min(0.9 - sqrt(x*x + y*y + z*z), sin(7*x)*sin(8*y)*z)"};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++)
    assert_true(assert_same_however_made(formulas[i], ZS_MESH_CONTOUR, 70) > 0);
}

/* Samples of one brick are taken once, roots take a few evaluations each. */
/* Kernels round in their own ways: the surface is the same within that, but for
 * noise, where one bit decides on a sharp edge; and always sound. */
static void instruction_sets_agree(void **state)
{
  (void)state;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  static const char *const formulas[] = {SPHERE, CUBE, NOISE};
  zs_grid grid = cube_grid(-0.63, 0.85, 37);
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++) {
    zs_mesh_report first;
    for (size_t isa = 0; isa < sizeof isas / sizeof *isas; isa++) {
      setenv("ZEROSET_ISA", isas[isa], 1);
      zs_mesh *mesh = polygonize(formulas[i], &grid, true, 2, false, NULL);
      assert_sound(mesh);
      assert_distinct(mesh);
      zs_mesh_report report = check_mesh(mesh);
      if (isa == 0)
        first = report;
      const double close = strcmp(formulas[i], NOISE) ? 1e-5 : 0.1;
      assert_true(fabs(report.volume / first.volume - 1) < close);
      assert_true(fabs(report.area / first.area - 1) < close);
      zs_mesh_free(mesh);
    }
  }
  unsetenv("ZEROSET_ISA");
}

static void evaluations_are_few(void **state)
{
  (void)state;
  zs_grid grid = cube_grid(-1, 1, 100);
  zs_job_report report;
  zs_mesh *mesh = polygonize(SPHERE, &grid, true, 2, true, &report);
  assert_non_null(mesh);
  uint64_t samples = UINT64_C(101) * 101 * 101;
  assert_true(report.evaluations > samples);
  assert_true(report.evaluations - samples < 6 * (uint64_t)mesh->vertex_count);
  zs_mesh_free(mesh);
}

/* Slivers (angles under 5 degrees) are what corner repulsion is against. */
static void a_sphere_has_few_slivers(void **state)
{
  (void)state;
  zs_grid grid = cube_grid(-1.013, 1.009, 64);
  zs_mesh *mesh = polygonize(SPHERE, &grid, true, 2, false, NULL);
  assert_non_null(mesh);
  size_t slivers = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++)
    slivers += sharpest_angle(mesh, t) < 5 * PI / 180;
  assert_true((double)slivers < 1e-4 * (double)mesh->triangle_count);
  zs_mesh_free(mesh);
}

/* Far from the origin single precision has few digits left; the mesh is coarser
 * but as sound. */
static void places_far_from_the_origin_are_sound(void **state)
{
  (void)state;
  const double at[3] = {4000, -3000, 2000};
  zs_field *field = formula_field_at(SPHERE, at);
  zs_grid grid = cube_grid(-1, 1, 40);
  for (int k = 0; k < 3; k++)
    grid.lo[k] += at[k];
  zs_mesh *mesh = zs_polygonize(field, &grid, NULL, NULL, NULL, NULL);
  assert_sound(mesh);
  assert_distinct(mesh);
  zs_mesh_free(mesh);
  zs_field_unref(field);
}

/* ---- Failures ------------------------------------------------------------------------ */

static void assert_fails(zs_field *field, const zs_grid *grid, const zs_mesh_options *options,
                         const zs_control *control, zs_status status)
{
  zs_diag diag = {0};
  assert_null(zs_polygonize(field, grid, options, control, NULL, &diag));
  assert_int_equal(diag.errors, 1);
  assert_int_equal(diag.status, status);
}

static void failures_are_reported(void **state)
{
  (void)state;
  zs_field *sphere = formula_field(SPHERE), *nothing = formula_field("-1 - x*x"),
           *everything = formula_field("1 + x*x"), *nan = formula_field("0/(x - x)");
  zs_grid grid = cube_grid(-1, 1, 40), zero = grid, huge = grid;
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  options.cap = false;
  assert_fails(nothing, &grid, NULL, NULL, ZS_ERROR_UNABLE);
  assert_fails(nan, &grid, NULL, NULL, ZS_ERROR_UNABLE);
  assert_fails(everything, &grid, &options, NULL, ZS_ERROR_UNABLE);
  options.tolerance = 0;
  assert_fails(sphere, &grid, &options, NULL, ZS_ERROR_ARGUMENT);
  zs_mesh_options_init(&options);
  options.method = (zs_mesh_method)2;
  assert_fails(sphere, &grid, &options, NULL, ZS_ERROR_ARGUMENT);
  zero.count[1] = 0;
  assert_fails(sphere, &zero, NULL, NULL, ZS_ERROR_ARGUMENT);
  huge.count[0] = huge.count[1] = huge.count[2] = UINT32_MAX;
  assert_fails(sphere, &huge, NULL, NULL, ZS_ERROR_ARGUMENT);
  zs_control control;
  zs_control_init(&control);
  control.memory_limit = 200000;
  assert_fails(sphere, &grid, NULL, &control, ZS_ERROR_MEMORY);
  control.memory_limit = 100;
  assert_fails(sphere, &grid, NULL, &control, ZS_ERROR_MEMORY);
  assert_cancellable(sphere, &grid, NULL);
  zs_field_unref(sphere);
  zs_field_unref(nothing);
  zs_field_unref(everything);
  zs_field_unref(nan);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(every_mesh_is_a_closed_manifold),
    cmocka_unit_test(grids_of_any_shape_are_sound),
    cmocka_unit_test(open_meshes_end_at_the_box),
    cmocka_unit_test(measures_converge_to_closed_forms),
    cmocka_unit_test(sharp_edges_are_kept),
    cmocka_unit_test(creases_can_be_left_out),
    cmocka_unit_test(vertices_are_certified_roots),
    cmocka_unit_test(normals_are_unit_and_point_out),
    cmocka_unit_test(a_box_within_the_solid_is_exact),
    cmocka_unit_test(meshes_are_the_same_however_they_are_made),
    cmocka_unit_test(instruction_sets_agree),
    cmocka_unit_test(evaluations_are_few),
    cmocka_unit_test(a_sphere_has_few_slivers),
    cmocka_unit_test(places_far_from_the_origin_are_sound),
    cmocka_unit_test(failures_are_reported),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
