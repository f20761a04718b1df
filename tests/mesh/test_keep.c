/* Components of a mesh chosen by points, against all distances. */
#include "../random.h"
#include "solids.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { CUBES = 30 };

/* Unit cubes that do not touch, at known places, with normals that name them. */
static zs_mesh *make_cubes(double places[CUBES][3])
{
  uint64_t seed = 3;
  zs_mesh *cube = make_cube(), *mesh = zs_mesh_new(8 * CUBES, 12 * CUBES, true, NULL);
  assert_non_null(mesh);
  for (unsigned c = 0; c < CUBES; c++) {
    for (unsigned k = 0; k < 3; k++)
      places[c][k] = 3 * (double)(k == 0 ? c % 4 : k == 1 ? c / 4 % 4 : c / 16) +
                     random_between(&seed, 0, 1);
    for (unsigned v = 0; v < 8; v++)
      for (unsigned k = 0; k < 3; k++) {
        mesh->positions[24 * c + 3 * v + k] = cube->positions[3 * v + k] + (float)places[c][k];
        mesh->normals[24 * c + 3 * v + k] = (float)c;
      }
    for (unsigned i = 0; i < 36; i++)
      mesh->triangles[36 * c + i] = cube->triangles[i] + 8 * c;
  }
  zs_mesh_free(cube);
  return mesh;
}

/* The distance from a point to the nearest corner of a cube. */
static double distance(const double place[3], const double *point)
{
  double square = 0;
  for (int k = 0; k < 3; k++) {
    const double d = point[k] - place[k];
    square += fmin(d * d, (d - 1) * (d - 1));
  }
  return sqrt(square);
}

static void the_nearest_are_kept(void **state)
{
  (void)state;
  static const double reaches[] = {INFINITY, 0.4, 1.5};
  uint64_t seed = 8;
  for (int round = 0; round < 60; round++) {
    double places[CUBES][3], points[6][3];
    const double reach = reaches[round % 3];
    zs_mesh *mesh = make_cubes(places);
    bool kept[CUBES] = {false};
    size_t count = 0;
    for (int i = 0; i < 6; i++) {
      for (int k = 0; k < 3; k++)
        points[i][k] = random_between(&seed, -2, 12);
      int best = 0;
      for (int c = 1; c < CUBES; c++)
        if (distance(places[c], points[i]) < distance(places[best], points[i]))
          best = c;
      if (distance(places[best], points[i]) < reach)
        kept[best] = true;
    }
    for (int c = 0; c < CUBES; c++)
      count += kept[c];
    zs_diag diag = {0};
    const bool done = zs_mesh_keep_components(mesh, &points[0][0], 6, reach, &diag);
    assert_int_equal(done, count > 0);
    assert_int_equal(diag.status, done ? ZS_OK : ZS_ERROR_UNABLE);
    if (!done)
      count = CUBES;
    assert_int_equal(zs_mesh_vertex_count(mesh), 8 * count);
    assert_int_equal(zs_mesh_triangle_count(mesh), 12 * count);
    for (size_t v = 0; done && v < mesh->vertex_count; v++) {
      const size_t c = (size_t)mesh->normals[3 * v];
      assert_true(kept[c]);
      for (int k = 0; k < 3; k++) {
        const double side = (double)mesh->positions[3 * v + (size_t)k] - places[c][k];
        assert_true(fabs(side * (side - 1)) < 1e-5);
      }
    }
    zs_mesh_report report;
    assert_true(zs_mesh_check(mesh, &report, NULL));
    assert_true(report.closed && report.manifold && report.oriented);
    assert_int_equal(report.components, count);
    assert_true(fabs(report.volume - (double)count) < 1e-3);
    zs_mesh_free(mesh);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(the_nearest_are_kept),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
