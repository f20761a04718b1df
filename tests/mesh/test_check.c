/* zs_mesh_check: topology and measures. */
#include "../random.h"
#include "solids.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static zs_mesh_report check(const zs_mesh *mesh)
{
  zs_mesh_report report;
  assert_non_null(mesh);
  assert_true(zs_mesh_check(mesh, &report, NULL));
  return report;
}

static void assert_near(double value, double expected)
{
  assert_true(fabs(value - expected) <= 1e-6 * (1 + fabs(expected)));
}

static void a_cube_is_a_cube(void **state)
{
  (void)state;
  zs_mesh *mesh = make_cube();
  zs_mesh_report r = check(mesh);
  assert_true(r.closed && r.manifold && r.oriented);
  assert_int_equal(r.components, 1);
  assert_int_equal(r.euler_characteristic, 2);
  assert_near(r.volume, 1);
  assert_near(r.area, 6);
  zs_mesh_free(mesh);
}

/* The polyhedron's own measures, by formulas of its rings. */
static void a_torus_has_a_hole(void **state)
{
  (void)state;
  const double pi = 3.14159265358979323846;
  zs_mesh *mesh = make_torus(400, 300, 2, 0.5, false);
  zs_mesh_report r = check(mesh);
  assert_true(r.closed && r.manifold && r.oriented);
  assert_int_equal(r.components, 1);
  assert_int_equal(r.euler_characteristic, 0);
  assert_true(fabs(r.volume / (2 * pi * pi * 2 * 0.25) - 1) < 3e-4);
  assert_true(fabs(r.area / (4 * pi * pi * 2 * 0.5) - 1) < 3e-4);
  zs_mesh_free(mesh);
}

/* Any order of vertices, triangles and corners gives the same report. */
static void order_does_not_matter(void **state)
{
  (void)state;
  uint64_t seed = 3;
  for (int run = 0; run < 20; run++) {
    zs_mesh *mesh = make_torus(9, 7, 2, 0.5, false);
    size_t n = mesh->vertex_count;
    uint32_t *name = malloc(n * sizeof *name);
    float *positions = malloc(3 * n * sizeof *positions);
    assert_non_null(name);
    assert_non_null(positions);
    for (uint32_t v = 0; v < n; v++) {
      uint32_t other = random_below(&seed, v + 1);
      name[v] = name[other];
      name[other] = v;
    }
    for (size_t v = 0; v < n; v++)
      memcpy(positions + 3 * (size_t)name[v], mesh->positions + 3 * v, 3 * sizeof *positions);
    memcpy(mesh->positions, positions, 3 * n * sizeof *positions);
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      unsigned turn = random_below(&seed, 3);
      uint32_t *corners = mesh->triangles + 3 * t, old[3] = {corners[0], corners[1], corners[2]};
      for (unsigned c = 0; c < 3; c++)
        corners[c] = name[old[(c + turn) % 3]];
    }
    zs_mesh_report r = check(mesh);
    assert_true(r.closed && r.manifold && r.oriented);
    assert_int_equal(r.euler_characteristic, 0);
    assert_int_equal(r.components, 1);
    free(name);
    free(positions);
    zs_mesh_free(mesh);
  }
}

static void a_missing_triangle_opens_the_mesh(void **state)
{
  (void)state;
  zs_mesh *mesh = make_cube();
  mesh->triangle_count--;
  zs_mesh_report r = check(mesh);
  assert_false(r.closed);
  assert_true(r.manifold && r.oriented);
  assert_int_equal(r.boundary_edges, 3);
  assert_int_equal(r.euler_characteristic, 1);
  assert_true(r.volume == 0);
  zs_mesh_free(mesh);
}

static void a_turned_triangle_is_not_oriented(void **state)
{
  (void)state;
  zs_mesh *mesh = make_cube();
  uint32_t first = mesh->triangles[0];
  mesh->triangles[0] = mesh->triangles[1];
  mesh->triangles[1] = first;
  zs_mesh_report r = check(mesh);
  assert_true(r.closed && r.manifold);
  assert_false(r.oriented);
  zs_mesh_free(mesh);
}

/* Two tetrahedra that share a vertex, an edge or nothing. */
static void pinches_are_found(void **state)
{
  (void)state;
  static const uint32_t solid[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  for (unsigned shared = 0; shared < 3; shared++) {
    float positions[24];
    uint32_t corners[24];
    uint64_t seed = 11;
    for (int i = 0; i < 24; i++)
      positions[i] = (float)random_between(&seed, -1, 1);
    for (unsigned i = 0; i < 12; i++) {
      corners[i] = solid[i];
      corners[12 + i] = solid[i] < shared ? solid[i] : solid[i] + 4;
    }
    zs_mesh *mesh = make_mesh(8, positions, 8, corners);
    zs_mesh_report r = check(mesh);
    assert_true(r.closed && r.oriented);
    assert_int_equal(r.manifold, shared == 0);
    assert_int_equal(r.components, shared == 0 ? 2 : 1);
    assert_int_equal(r.nonmanifold_edges, shared == 2);
    assert_int_equal(r.nonmanifold_vertices, shared == 1);
    assert_int_equal(r.euler_characteristic, shared == 2 ? 3 : 4 - (int)shared);
    zs_diag diag = {0};
    assert_int_equal(zs_mesh_require_manifold(mesh, "test it", &diag), shared == 0);
    assert_int_equal(diag.errors, shared != 0);
    zs_mesh_free(mesh);
  }
}

/* Triangles with a repeated corner cover nothing and join what is around. */
static void repeated_corners_do_not_count(void **state)
{
  (void)state;
  zs_mesh *cube = make_cube();
  uint32_t corners[3 * 14];
  memcpy(corners, cube->triangles, 36 * sizeof *corners);
  const uint32_t more[6] = {0, 0, 1, 5, 5, 5};
  memcpy(corners + 36, more, sizeof more);
  zs_mesh *mesh = make_mesh(8, cube->positions, 14, corners);
  zs_mesh_report r = check(mesh);
  assert_true(r.closed && r.manifold && r.oriented);
  assert_int_equal(r.euler_characteristic, 2);
  zs_diag diag = {0};
  assert_false(zs_mesh_require_manifold(mesh, "test it", &diag));
  assert_int_equal(diag.status, ZS_ERROR_UNABLE);
  zs_mesh_free(mesh);
  zs_mesh_free(cube);
}

/* Many triangles around one vertex, and unused vertices. */
static void a_star_of_many_triangles_is_checked(void **state)
{
  (void)state;
  enum { N = 20000 };
  zs_mesh *mesh = zs_mesh_new(N + 10, N, false, NULL);
  assert_non_null(mesh);
  memset(mesh->positions, 0, 3 * mesh->vertex_count * sizeof *mesh->positions);
  for (uint32_t i = 0; i < N; i++) {
    const uint32_t corners[3] = {0, 1 + i, 1 + (i + 1) % N};
    memcpy(mesh->triangles + 3 * i, corners, sizeof corners);
  }
  zs_mesh_report r = check(mesh);
  assert_true(r.manifold && r.oriented && !r.closed);
  assert_int_equal(r.boundary_edges, N);
  assert_int_equal(r.euler_characteristic, 1);
  zs_mesh_free(mesh);
}

static void an_empty_mesh_is_not_closed(void **state)
{
  (void)state;
  zs_mesh *mesh = zs_mesh_new(0, 0, false, NULL);
  zs_mesh_report r = check(mesh);
  assert_false(r.closed);
  assert_int_equal(r.components, 0);
  zs_mesh_free(mesh);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(a_cube_is_a_cube),
    cmocka_unit_test(a_torus_has_a_hole),
    cmocka_unit_test(order_does_not_matter),
    cmocka_unit_test(a_missing_triangle_opens_the_mesh),
    cmocka_unit_test(a_turned_triangle_is_not_oriented),
    cmocka_unit_test(pinches_are_found),
    cmocka_unit_test(repeated_corners_do_not_count),
    cmocka_unit_test(a_star_of_many_triangles_is_checked),
    cmocka_unit_test(an_empty_mesh_is_not_closed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
