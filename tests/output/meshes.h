/* Meshes of formulas, and what every mesh has to be: for tests. */
#ifndef ZS_TEST_MESHES_H
#define ZS_TEST_MESHES_H

#include "../random.h"
#include "formula.h"

#include "mesh/mesh.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Sign changes everywhere, of no use to anyone: what topology has to survive. */
static const char NOISE[] =
  "sin(391*x + 17*sin(233*y + 51*z)) + sin(417*y + 23*sin(279*z + 77*x)) + sin(353*z + 80*x*y)";

static inline zs_grid cube_grid(double lo, double hi, uint32_t resolution)
{
  zs_grid grid = {.lo = {lo, lo, lo}, .count = {resolution, resolution, resolution}};
  for (int k = 0; k < 3; k++)
    grid.cell[k] = (hi - lo) / resolution;
  return grid;
}

static inline zs_mesh *mesh_formula(const char *formula, const zs_grid *grid,
                                    zs_mesh_method method, bool cap, unsigned threads, bool brute,
                                    zs_job_report *report)
{
  zs_field *field = formula_field(formula);
  assert_non_null(field);
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  options.method = method;
  options.cap = cap;
  zs_control control;
  zs_control_init(&control);
  control.threads = threads;
  control.brute = brute;
  zs_mesh *mesh = zs_polygonize(field, grid, &options, &control, report, NULL);
  zs_field_unref(field);
  return mesh;
}

static inline zs_mesh_report check_mesh(const zs_mesh *mesh)
{
  zs_mesh_report report;
  assert_true(zs_mesh_check(mesh, &report, NULL));
  return report;
}

static inline void assert_sound(const zs_mesh *mesh)
{
  assert_non_null(mesh);
  zs_mesh_report report = check_mesh(mesh);
  assert_true(report.closed);
  assert_true(report.manifold);
  assert_true(report.oriented);
  assert_true(report.volume > 0);
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
    assert_true(mesh->triangles[i] < mesh->vertex_count);
}

static inline int compare_points(const void *a, const void *b)
{
  return memcmp(a, b, 3 * sizeof(float));
}

/* No two vertices coincide, or welding (STL) would pinch the surface. */
static inline void assert_distinct(const zs_mesh *mesh)
{
  size_t n = mesh->vertex_count;
  float *copy = malloc(3 * n * sizeof *copy);
  assert_non_null(copy);
  for (size_t i = 0; i < 3 * n; i++)
    copy[i] = mesh->positions[i] == 0 ? 0 : mesh->positions[i]; /* -0 is 0 */
  qsort(copy, n, 3 * sizeof *copy, compare_points);
  for (size_t i = 1; i < n; i++)
    assert_int_not_equal(compare_points(copy + 3 * i, copy + 3 * (i - 1)), 0);
  free(copy);
}

/* The smallest angle of a triangle. */
static inline double sharpest_angle(const zs_mesh *mesh, size_t triangle)
{
  double largest_cosine = -1;
  for (size_t c = 0; c < 3; c++) {
    const float *p[3];
    double dot = 0, uu = 0, vv = 0;
    for (size_t k = 0; k < 3; k++)
      p[k] = mesh->positions + 3 * (size_t)mesh->triangles[3 * triangle + (c + k) % 3];
    for (size_t k = 0; k < 3; k++) {
      double u = (double)p[1][k] - p[0][k], v = (double)p[2][k] - p[0][k];
      dot += u * v;
      uu += u * u;
      vv += v * v;
    }
    largest_cosine = fmax(largest_cosine, dot / sqrt(uu * vv));
  }
  return acos(fmin(largest_cosine, 1));
}

static inline void assert_same(const zs_mesh *a, const zs_mesh *b)
{
  assert_non_null(a);
  assert_non_null(b);
  assert_int_equal(a->vertex_count, b->vertex_count);
  assert_int_equal(a->triangle_count, b->triangle_count);
  assert_memory_equal(a->positions, b->positions, 12 * a->vertex_count);
  assert_memory_equal(a->normals, b->normals, 12 * a->vertex_count);
  assert_memory_equal(a->triangles, b->triangles, 12 * a->triangle_count);
}

/* At several resolutions: sound, and still so when coinciding vertices are welded. */
static inline void assert_sound_in(const char *formula, zs_mesh_method method, const double box[2],
                                   uint32_t step)
{
  for (uint32_t resolution = 2; resolution <= 46; resolution += step) {
    zs_grid grid = cube_grid(box[0], box[1], resolution);
    zs_mesh *mesh = mesh_formula(formula, &grid, method, true, 2, false, NULL);
    if (!mesh && resolution == 2)
      continue; /* too coarse to hit the solid */
    assert_sound(mesh);
    assert_distinct(mesh);
    zs_mesh_free(mesh);
  }
}

/* Noise on grids of random shape: caps and bricks at all alignments. */
static inline void assert_noise_is_sound(zs_mesh_method method)
{
  uint64_t seed = 5;
  for (int i = 0; i < 60; i++) {
    zs_grid grid = {.lo = {-0.4, -0.3, -0.2}};
    for (int k = 0; k < 3; k++) {
      grid.count[k] = 1 + random_below(&seed, 36);
      grid.cell[k] = random_between(&seed, 0.01, 0.04);
    }
    zs_mesh *mesh = mesh_formula(NOISE, &grid, method, true, 2, false, NULL);
    assert_sound(mesh);
    assert_distinct(mesh);
    zs_mesh_free(mesh);
  }
}

/* The same surface to a part of a cell, connected in the same way: where bounds
 * stand in for values, roots are looked for from other places, and corners are
 * moved a little differently. */
static inline void assert_alike(const zs_mesh *a, const zs_mesh *b, double cell)
{
  assert_non_null(a);
  assert_non_null(b);
  const zs_mesh_report ra = check_mesh(a), rb = check_mesh(b);
  assert_int_equal(ra.euler_characteristic, rb.euler_characteristic);
  assert_int_equal(ra.components, rb.components);
  assert_true(fabs(ra.volume - rb.volume) < 1e-3 * ra.volume);
  assert_true(fabs(ra.area - rb.area) < 1e-3 * ra.area);
  if (a->vertex_count != b->vertex_count) /* creases can tip over */
    return;
  for (size_t i = 0; i < 3 * a->vertex_count; i++)
    assert_true(fabsf(a->positions[i] - b->positions[i]) < cell);
}

/* The number of threads does not change a byte, nor pruning the surface.  Returns
 * how many evaluations pruning saved. */
static inline uint64_t assert_same_however_made(const char *formula, zs_mesh_method method,
                                                uint32_t resolution)
{
  zs_grid grid = cube_grid(-0.77, 0.91, resolution);
  zs_job_report pruned, brute;
  zs_mesh *reference = mesh_formula(formula, &grid, method, true, 1, false, &pruned);
  for (unsigned threads = 2; threads <= 3; threads++) {
    zs_mesh *mesh = mesh_formula(formula, &grid, method, true, threads, false, NULL);
    assert_same(reference, mesh);
    zs_mesh_free(mesh);
  }
  zs_mesh *mesh = mesh_formula(formula, &grid, method, true, 2, true, &brute);
  assert_alike(reference, mesh, grid.cell[0]);
  assert_true(pruned.evaluations <= brute.evaluations);
  zs_mesh_free(mesh);
  zs_mesh_free(reference);
  return brute.evaluations - pruned.evaluations;
}

static inline bool stop(void *context, const char *stage, double fraction)
{
  (void)stage;
  (void)fraction;
  int *left = context;
  return --*left > 0;
}

/* Cancelled at every moment at which it can be. */
static inline void assert_cancellable(zs_field *field, const zs_grid *grid,
                                      const zs_mesh_options *options)
{
  zs_control control;
  zs_control_init(&control);
  control.progress = stop;
  int calls = 0, left;
  control.context = &left;
  do {
    left = ++calls;
    zs_diag diag = {0};
    zs_mesh *mesh = zs_polygonize(field, grid, options, &control, NULL, &diag);
    assert_int_equal(mesh ? ZS_OK : ZS_CANCELLED, diag.status);
    zs_mesh_free(mesh);
  } while (left <= 0);
  assert_true(calls > 3);
}

#endif
