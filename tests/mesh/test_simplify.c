/* Simplification keeps closed manifolds closed manifolds, near the original. */
#include "solids.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static zs_mesh_report check(const zs_mesh *mesh)
{
  zs_mesh_report report;
  assert_true(zs_mesh_check(mesh, &report, NULL));
  return report;
}

/* How far points on the triangles are from the true torus at most. */
static double deviation(const zs_mesh *mesh, double major, double minor)
{
  enum { STEPS = 6 };
  double worst = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int i = 0; i <= STEPS; i++)
      for (int j = 0; i + j <= STEPS; j++) {
        const int weight[3] = {i, j, STEPS - i - j};
        double p[3] = {0, 0, 0};
        for (size_t c = 0; c < 3; c++)
          for (size_t k = 0; k < 3; k++)
            p[k] += weight[c] * mesh->positions[3 * (size_t)mesh->triangles[3 * t + c] + k] / STEPS;
        worst = fmax(worst, fabs(hypot(hypot(p[0], p[1]) - major, p[2]) - minor));
      }
  return worst;
}

static void a_torus_stays_a_torus(void **state)
{
  (void)state;
  const double major = 2, minor = 0.5;
  zs_mesh *whole = make_torus(80, 40, major, minor, false);
  const double chord = deviation(whole, major, minor); /* of the mesh itself */
  zs_mesh_free(whole);
  size_t before = SIZE_MAX;
  for (double error = 1e-3; error < 0.1; error *= 4) {
    zs_mesh *mesh = make_torus(80, 40, major, minor, true);
    double volume = check(mesh).volume;
    assert_true(zs_mesh_simplify(mesh, error, NULL, NULL));
    zs_mesh_report r = check(mesh);
    assert_true(r.closed && r.manifold && r.oriented);
    assert_int_equal(r.components, 1);
    assert_int_equal(r.euler_characteristic, 0);
    assert_true(mesh->triangle_count < before);
    before = mesh->triangle_count;
    /* Vertices are vertices of the original still, normals with them. */
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      const float *p = mesh->positions + 3 * v, *n = mesh->normals + 3 * v;
      double r_xy = hypot(p[0], p[1]);
      assert_true(fabs(hypot(r_xy - major, p[2]) - minor) < 1e-5);
      assert_true(fabs(n[2] - p[2] / minor) < 1e-5);
      assert_true(fabs(n[0] - p[0] / r_xy * (r_xy - major) / minor) < 1e-5);
    }
    /* The surface moved by no more than the error: so did the volume. */
    assert_true(fabs(r.volume - volume) < error * r.area);
    assert_true(deviation(mesh, major, minor) < error + chord);
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
      assert_true(mesh->triangles[i] < mesh->vertex_count);
    zs_mesh_free(mesh);
  }
  assert_true(before < 6400 / 4);
}

/* Flat faces cost nothing: a finely divided box becomes a plain one. */
static void flat_faces_collapse_without_error(void **state)
{
  (void)state;
  enum { N = 8, SIDE = N + 1 };
  static uint32_t number[SIDE][SIDE][SIDE];
  zs_mesh *mesh = zs_mesh_new(6 * N * N + 2, 12 * N * N, false, NULL);
  assert_non_null(mesh);
  uint32_t count = 0;
  for (unsigned z = 0; z < SIDE; z++)
    for (unsigned y = 0; y < SIDE; y++)
      for (unsigned x = 0; x < SIDE; x++)
        if (x % N == 0 || y % N == 0 || z % N == 0) {
          const float p[3] = {(float)x, (float)y, (float)z};
          memcpy(mesh->positions + 3 * count, p, sizeof p);
          number[z][y][x] = count++;
        }
  assert_int_equal(count, mesh->vertex_count);
  uint32_t *corner = mesh->triangles;
  for (unsigned axis = 0; axis < 3; axis++)
    for (unsigned side = 0; side < 2; side++)
      for (unsigned i = 0; i < N; i++)
        for (unsigned j = 0; j < N; j++) {
          uint32_t quad[4];
          for (unsigned c = 0; c < 4; c++) {
            unsigned at[3], u = (axis + 1) % 3, v = (axis + 2) % 3;
            at[axis] = side * N;
            at[u] = i + (c == 1 || c == 2);
            at[v] = j + (c >= 2);
            quad[side ? c : 3 - c] = number[at[2]][at[1]][at[0]];
          }
          const uint32_t two[6] = {quad[0], quad[1], quad[2], quad[0], quad[2], quad[3]};
          memcpy(corner, two, sizeof two);
          corner += 6;
        }
  zs_mesh_report fine = check(mesh);
  assert_true(fine.closed && fine.manifold && fine.oriented);
  assert_true(zs_mesh_simplify(mesh, 1e-6, NULL, NULL));
  zs_mesh_report coarse = check(mesh);
  assert_true(coarse.closed && coarse.manifold && coarse.oriented);
  assert_int_equal(coarse.euler_characteristic, 2);
  assert_true(fabs(coarse.volume - N * N * N) < 1e-9);
  assert_true(fabs(coarse.area - 6 * N * N) < 1e-9);
  assert_int_equal(mesh->vertex_count, 8);
  assert_int_equal(mesh->triangle_count, 12);
  zs_mesh_free(mesh);
}

/* An open mesh is allowed, and stays manifold. */
static void open_meshes_are_simplified_too(void **state)
{
  (void)state;
  zs_mesh *mesh = make_torus(40, 20, 2, 0.5, false);
  mesh->triangle_count -= 100;
  zs_mesh_report before = check(mesh);
  assert_true(before.boundary_edges > 0 && before.manifold);
  assert_true(zs_mesh_simplify(mesh, 0.01, NULL, NULL));
  zs_mesh_report after = check(mesh);
  assert_true(after.manifold && after.oriented);
  assert_true(after.boundary_edges > 0);
  assert_true(mesh->triangle_count < 1500);
  zs_mesh_free(mesh);
}

static bool stop(void *context, const char *stage, double fraction)
{
  (void)stage;
  assert_true(fraction >= 0 && fraction <= 1);
  return --*(int *)context > 0;
}

static void failures_leave_the_mesh_alone(void **state)
{
  (void)state;
  zs_mesh *mesh = make_torus(80, 40, 2, 0.5, true);
  zs_mesh_report before = check(mesh), after;
  zs_diag diag = {0};
  assert_false(zs_mesh_simplify(mesh, -1, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  diag = (zs_diag){0};
  assert_false(zs_mesh_simplify(mesh, NAN, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  int left = 2;
  zs_control control = {.progress = stop, .context = &left};
  diag = (zs_diag){0};
  assert_false(zs_mesh_simplify(mesh, 0.05, &control, &diag));
  assert_int_equal(diag.status, ZS_CANCELLED);
  after = check(mesh);
  assert_true(after.closed && after.manifold && after.oriented);
  assert_int_equal(after.euler_characteristic, before.euler_characteristic);
  assert_true(after.volume == before.volume && after.area == before.area);
  mesh->triangles[0] = mesh->triangles[1];
  diag = (zs_diag){0};
  assert_false(zs_mesh_simplify(mesh, 0.05, NULL, &diag));
  assert_int_equal(diag.status, ZS_ERROR_UNABLE);
  zs_mesh_free(mesh);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(a_torus_stays_a_torus),
    cmocka_unit_test(flat_faces_collapse_without_error),
    cmocka_unit_test(open_meshes_are_simplified_too),
    cmocka_unit_test(failures_leave_the_mesh_alone),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
