/* The bunny: a variational interpolant through measured points and normals. */
#include "zeroset.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MAXIMUM_POINTS = 4096 };

static void report(void *context, const zs_diagnostic *d)
{
  (void)context;
  print_error("%s:%u:%u: %s\n", d->file ? d->file : "", d->line, d->column, d->message);
}

/* The vertices of scenes/bunny.obj where the scene puts them: y up turned to z
 * up, then by 60 degrees about z. */
static size_t read_points(const char *path, double (*points)[3])
{
  FILE *file = fopen(path, "r");
  assert_non_null(file);
  char line[256];
  size_t n = 0;
  while (fgets(line, sizeof line, file)) {
    double x, y, z;
    if (sscanf(line, "v %lf %lf %lf", &x, &y, &z) != 3)
      continue;
    assert_true(n < MAXIMUM_POINTS);
    points[n][0] = 0.5 * x + sqrt(0.75) * z;
    points[n][1] = sqrt(0.75) * x - 0.5 * z;
    points[n][2] = y;
    n++;
  }
  fclose(file);
  return n;
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void subtract(const double a[3], const double b[3], double out[3])
{
  for (int k = 0; k < 3; k++)
    out[k] = a[k] - b[k];
}

/* Squared distance from p to the segment ab. */
static double segment_distance(const double p[3], const double a[3], const double b[3])
{
  double ab[3], ap[3];
  subtract(b, a, ab);
  subtract(p, a, ap);
  double length = dot(ab, ab);
  double t = length > 0 ? fmin(fmax(dot(ap, ab) / length, 0), 1) : 0;
  double d[3] = {ap[0] - t * ab[0], ap[1] - t * ab[1], ap[2] - t * ab[2]};
  return dot(d, d);
}

/* Squared distance from p to a triangle: to its plane above it, else to its sides. */
static double triangle_distance(const double p[3], const double t[3][3])
{
  double u[3], v[3], w[3];
  subtract(t[1], t[0], u);
  subtract(t[2], t[0], v);
  subtract(p, t[0], w);
  double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v);
  double area = uu * vv - uv * uv;
  double s = wu * vv - wv * uv, r = wv * uu - wu * uv;
  if (area > 0 && s >= 0 && r >= 0 && s + r <= area) {
    s /= area;
    r /= area;
    double d[3] = {w[0] - s * u[0] - r * v[0], w[1] - s * u[1] - r * v[1],
                   w[2] - s * u[2] - r * v[2]};
    return dot(d, d);
  }
  return fmin(segment_distance(p, t[0], t[1]),
              fmin(segment_distance(p, t[1], t[2]), segment_distance(p, t[2], t[0])));
}

/* The largest distance from a point to the mesh, by brute force. */
static double farthest(const zs_mesh *mesh, const double (*points)[3], size_t n)
{
  const float *positions = zs_mesh_positions(mesh);
  const uint32_t *triangles = zs_mesh_triangles(mesh);
  size_t count = zs_mesh_triangle_count(mesh);
  double *nearest = malloc(n * sizeof *nearest);
  assert_non_null(nearest);
  for (size_t i = 0; i < n; i++)
    nearest[i] = DBL_MAX;
  for (size_t k = 0; k < count; k++) {
    double t[3][3], radius = 0;
    for (int c = 0; c < 3; c++)
      for (int a = 0; a < 3; a++)
        t[c][a] = positions[3 * triangles[3 * k + c] + a];
    for (int c = 1; c < 3; c++) {
      double side[3];
      subtract(t[c], t[0], side);
      radius = fmax(radius, sqrt(dot(side, side)));
    }
    for (size_t i = 0; i < n; i++) {
      double d[3];
      subtract(points[i], t[0], d);
      /* No point of the triangle is nearer than this. */
      double least = sqrt(dot(d, d)) - radius;
      if (least <= 0 || least * least < nearest[i])
        nearest[i] = fmin(nearest[i], triangle_distance(points[i], t));
    }
  }
  double largest = 0;
  for (size_t i = 0; i < n; i++)
    largest = fmax(largest, nearest[i]);
  free(nearest);
  return sqrt(largest);
}

static void test_distance(void **state)
{
  (void)state;
  static double points[MAXIMUM_POINTS][3];
  const char *root = getenv("top_srcdir");
  char path[4096];
  snprintf(path, sizeof path, "%s/scenes/bunny.obj", root ? root : ".");
  size_t n = read_points(path, points);
  assert_int_equal(n, 1839);
  double diagonal[3] = {0};
  for (int k = 0; k < 3; k++) {
    double least = DBL_MAX, most = -DBL_MAX;
    for (size_t i = 0; i < n; i++) {
      least = fmin(least, points[i][k]);
      most = fmax(most, points[i][k]);
    }
    diagonal[k] = most - least;
  }

  zs_diag diag = {.report = report};
  snprintf(path, sizeof path, "%s/scenes/bunny.xml", root ? root : ".");
  zs_scene *scene = zs_scene_load(path, NULL, &diag);
  assert_non_null(scene);
  zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
  assert_non_null(field);
  double lo[3], hi[3];
  zs_grid grid;
  assert_true(zs_field_box(field, lo, hi, &diag));
  assert_true(zs_grid_fit(&grid, lo, hi, 128, &diag));
  zs_mesh *mesh = zs_polygonize(field, &grid, NULL, NULL, NULL, &diag);
  assert_non_null(mesh);
  zs_mesh_report measures;
  assert_true(zs_mesh_check(mesh, &measures, &diag));
  assert_true(measures.closed && measures.manifold && measures.oriented);
  assert_int_equal(measures.components, 1);

  double distance = farthest(mesh, points, n) / sqrt(dot(diagonal, diagonal));
  print_message("largest distance of a point: %.4f %% of the diagonal\n", 100 * distance);
  assert_true(distance < 0.002);

  zs_field_info info;
  zs_fit_info fit;
  zs_field_describe(field, &info);
  assert_int_equal(info.fits, 1);
  assert_true(zs_field_fit(field, 0, &fit));
  assert_true(fit.constraints >= n);
  assert_true(fit.residual < 1e-6 * sqrt(dot(diagonal, diagonal)));

  zs_mesh_free(mesh);
  zs_field_unref(field);
  zs_scene_free(scene);
}

int main(void)
{
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_distance)};
  return cmocka_run_group_tests_name("bunny", tests, NULL, NULL);
}
