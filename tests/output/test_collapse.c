/* The features method with vertices that stand for several: a manifold however many, and
 * no farther from the surface than asked. */
#include "meshes.h"

#include "../random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char SPHERE[] = "0.8 - sqrt(x*x + y*y + z*z)";
#define TURNED                                                                                    \
  "let c = cos(0.4); let s = sin(0.4); let u = c*x + s*y; let q = c*y - s*x;"                     \
  "let p = c*u + s*z; let r = c*z - s*u;"
static const char CUBE[] = TURNED "min(min(0.6 - abs(p), 0.6 - abs(q)), 0.6 - abs(r))";
static const char BORED[] =
  TURNED "min(min(min(0.6 - abs(p), 0.6 - abs(q)), 0.6 - abs(r)), hypot(p, q) - 0.25)";

static zs_mesh *collapsed(const char *formula, const zs_grid *grid, double error,
                          unsigned threads)
{
  zs_field *field = formula_field(formula);
  assert_non_null(field);
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  options.method = ZS_MESH_FEATURES;
  options.collapse = error;
  zs_control control;
  zs_control_init(&control);
  control.threads = threads;
  zs_mesh *mesh = zs_polygonize(field, grid, &options, &control, NULL, NULL);
  zs_field_unref(field);
  return mesh;
}

/* ---- Topology ------------------------------------------------------------------ */

/* The Euler characteristic stays what it was: nothing is torn or glued. */
static void assert_sound_collapsed(const char *formula, const zs_grid *grid,
                                   const double errors[3])
{
  zs_mesh *fine = collapsed(formula, grid, 0, 2);
  assert_sound(fine);
  const zs_mesh_report before = check_mesh(fine);
  for (int e = 0; e < 3; e++) {
    zs_mesh *mesh = collapsed(formula, grid, errors[e], 2);
    assert_sound(mesh);
    assert_distinct(mesh);
    assert_true(mesh->vertex_count <= fine->vertex_count);
    const zs_mesh_report after = check_mesh(mesh);
    assert_int_equal(after.euler_characteristic, before.euler_characteristic);
    assert_int_equal(after.components, before.components);
    zs_mesh_free(mesh);
  }
  zs_mesh_free(fine);
}

static void every_mesh_stays_a_closed_manifold(void **state)
{
  (void)state;
  static const char *const formulas[] = {SPHERE, CUBE, BORED, NOISE, "0.3 - abs(z)", "x*y*z",
                                         "sin(9*x)*sin(9*y)*sin(9*z)"};
  static const double boxes[][2] = {{-1, 1}, {-0.63, 0.71}, {-0.9, 0.1}};
  static const double errors[3] = {1e-4, 0.02, 100};
  for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++)
    for (size_t b = 0; b < sizeof boxes / sizeof *boxes; b++) {
      const zs_grid grid = cube_grid(boxes[b][0], boxes[b][1], 23);
      assert_sound_collapsed(formulas[i], &grid, errors);
    }
}

/* Sheets and tubes that are close to each other, of random spheres. */
static void crowds_of_spheres_stay_closed_manifolds(void **state)
{
  (void)state;
  uint64_t seed = 71;
  static const double errors[3] = {0.001, 0.01, 0.1};
  for (int trial = 0; trial < 3; trial++) {
    char formula[4096] = "-1";
    for (int i = 0; i < 30; i++) {
      char text[128];
      snprintf(text, sizeof text, "max(%.5f - hypot(hypot(x - %.5f, y - %.5f), z - %.5f),",
               random_between(&seed, 0.05, 0.4), random_between(&seed, -1, 1),
               random_between(&seed, -1, 1), random_between(&seed, -1, 1));
      memmove(formula + strlen(text), formula, strlen(formula) + 1);
      memcpy(formula, text, strlen(text));
      strcat(formula, ")");
    }
    const zs_grid grid = cube_grid(-1.1, 1.1, 36);
    assert_sound_collapsed(formula, &grid, errors);
  }
}

static void meshes_are_the_same_for_any_number_of_threads(void **state)
{
  (void)state;
  const zs_grid grid = cube_grid(-1, 1, 60);
  zs_mesh *one = collapsed(BORED, &grid, 0.01, 1), *three = collapsed(BORED, &grid, 0.01, 3);
  assert_same(one, three);
  zs_mesh_free(one);
  zs_mesh_free(three);
}

/* ---- Places ---------------------------------------------------------------------- */

/* Of a cube flat parts and straight edges need few vertices, all of them on it; what is
 * left are mostly the cells that edges pass by. */
static void a_cube_keeps_its_shape(void **state)
{
  (void)state;
  const zs_grid grid = cube_grid(-1, 1, 96);
  zs_mesh *fine = collapsed(CUBE, &grid, 0, 2), *mesh = collapsed(CUBE, &grid, 1e-3, 2);
  assert_sound(mesh);
  assert_true(mesh->triangle_count < fine->triangle_count / 4);
  assert_true(fabs(check_mesh(mesh).volume - 8 * 0.6 * 0.6 * 0.6) < 1e-4);
  assert_true(fabs(check_mesh(mesh).area - 24 * 0.6 * 0.6) < 1e-3);
  zs_mesh_free(fine);
  zs_mesh_free(mesh);
}

/* Vertices are hardly farther from a sphere than from tangent planes around them, and
 * fewer the farther. */
static void a_sphere_is_as_close_as_asked(void **state)
{
  (void)state;
  static const double errors[] = {1e-4, 1e-3, 1e-2};
  const zs_grid grid = cube_grid(-1.03, 1.01, 128);
  size_t before = SIZE_MAX;
  for (size_t e = 0; e < sizeof errors / sizeof *errors; e++) {
    zs_mesh *mesh = collapsed(SPHERE, &grid, errors[e], 2);
    assert_sound(mesh);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      const float *p = mesh->positions + 3 * v;
      assert_true(fabs(hypot(hypot(p[0], p[1]), p[2]) - 0.8) < 2 * errors[e]);
    }
    assert_true(fabs(check_mesh(mesh).volume - 2.1446605848506324) < 4 * 8.05 * errors[e] + 1e-3);
    assert_true(mesh->vertex_count < before);
    before = mesh->vertex_count;
    zs_mesh_free(mesh);
  }
}

static void bad_distances_are_refused(void **state)
{
  (void)state;
  const zs_grid grid = cube_grid(-1, 1, 8);
  assert_null(collapsed(SPHERE, &grid, -1, 1));
  assert_null(collapsed(SPHERE, &grid, (double)NAN, 1));
  assert_null(collapsed(SPHERE, &grid, (double)INFINITY, 1));
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(every_mesh_stays_a_closed_manifold),
    cmocka_unit_test(crowds_of_spheres_stay_closed_manifolds),
    cmocka_unit_test(meshes_are_the_same_for_any_number_of_threads),
    cmocka_unit_test(a_cube_keeps_its_shape),
    cmocka_unit_test(a_sphere_is_as_close_as_asked),
    cmocka_unit_test(bad_distances_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
