/* Closing meshes: what is closed stays, what is not becomes closed. */
#include "../random.h"

#include "mesh/mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* A cube of side n whose faces are squares of two triangles, with corners of their own. */
static zs_mesh *cube_of_squares(uint32_t n)
{
  const uint32_t count = 6 * n * n;
  zs_mesh *m = zs_mesh_new(4 * (size_t)count, 2 * (size_t)count, false, NULL);
  assert_non_null(m);
  uint32_t v = 0, t = 0;
  for (uint32_t face = 0; face < 6; face++)
    for (uint32_t i = 0; i < n; i++)
      for (uint32_t j = 0; j < n; j++) {
        const uint32_t first = v;
        for (uint32_t c = 0; c < 4; c++) {
          const float a = (float)(i + (c == 1 || c == 2)), b = (float)(j + (c >= 2));
          const float p[3] = {a, b, face < 3 ? (float)n : 0};
          for (uint32_t k = 0; k < 3; k++)
            m->positions[3 * v + (k + face) % 3] = p[k];
          v++;
        }
        const uint32_t out[6] = {0, 1, 2, 0, 2, 3}, in[6] = {0, 2, 1, 0, 3, 2};
        for (uint32_t c = 0; c < 6; c++)
          m->triangles[3 * t + c] = first + (face < 3 ? out : in)[c];
        t += 2;
      }
  return m;
}

static bool is_64(double volume)
{
  return volume > 64 - 1e-9 && volume < 64 + 1e-9;
}

static void remove_triangle(zs_mesh *m, size_t t)
{
  memmove(m->triangles + 3 * t, m->triangles + 3 * (t + 1),
          3 * (--m->triangle_count - t) * sizeof *m->triangles);
}

static zs_mesh *closed(const zs_mesh *m, zs_mesh_holes *holes, zs_mesh_report *report)
{
  zs_mesh *c = zs_mesh_close(m, holes, NULL);
  assert_non_null(c);
  assert_true(zs_mesh_check(c, report, NULL));
  return c;
}

static void test_closed_stays(void **state)
{
  (void)state;
  zs_mesh_holes holes;
  zs_mesh_report report;
  zs_mesh *m = cube_of_squares(4), *c = closed(m, &holes, &report);
  assert_true(holes.count == 0 && !holes.inside_out && c->triangle_count == m->triangle_count);
  assert_true(report.closed && report.oriented && is_64(report.volume));
  zs_mesh_free(c);
  /* Inside out. */
  for (size_t t = 0; t < m->triangle_count; t++) {
    const uint32_t first = m->triangles[3 * t];
    m->triangles[3 * t] = m->triangles[3 * t + 1];
    m->triangles[3 * t + 1] = first;
  }
  c = closed(m, &holes, &report);
  assert_true(holes.inside_out && is_64(report.volume));
  zs_mesh_free(c);
  zs_mesh_free(m);
}

static void test_holes(void **state)
{
  (void)state;
  zs_mesh_holes holes;
  zs_mesh_report report;
  zs_mesh *m = cube_of_squares(4);
  remove_triangle(m, 150); /* a triangle ... */
  for (int i = 0; i < 2; i++)
    remove_triangle(m, 10); /* ... and a square in a flat face */
  zs_mesh *c = closed(m, &holes, &report);
  assert_true(holes.count == 2 && holes.sides == 7);
  assert_true(report.closed && report.manifold && report.oriented && is_64(report.volume));
  zs_mesh_free(c);
  /* A whole face: the hole's rim is a square of 16 sides. */
  m->triangle_count -= 32;
  c = closed(m, &holes, &report);
  assert_true(holes.count == 3 && report.closed && is_64(report.volume));
  zs_mesh_free(c);
  zs_mesh_free(m);
}

/* Triangles at random: whatever they are, every side is then run along as often one way as
 * the other, so that areas in the three planes of coordinates add up to nothing. */
static void test_soup(void **state)
{
  (void)state;
  uint64_t random = 9;
  for (int i = 0; i < 300; i++) {
    const uint32_t vertices = 3 + random_below(&random, 8), count = 1 + random_below(&random, 20);
    zs_mesh *m = zs_mesh_new(vertices, count, false, NULL);
    for (uint32_t v = 0; v < 3 * vertices; v++)
      m->positions[v] = (float)random_below(&random, 3);
    for (uint32_t c = 0; c < 3 * count; c++)
      m->triangles[c] = random_below(&random, vertices);
    zs_mesh_holes holes;
    zs_mesh *c = zs_mesh_close(m, &holes, NULL);
    assert_non_null(c);
    double areas[3] = {0, 0, 0};
    for (size_t t = 0; t < c->triangle_count; t++)
      for (int s = 0; s < 3; s++) {
        assert_true(c->triangles[3 * t + (size_t)s] < c->vertex_count);
        const float *p = c->positions + 3 * (size_t)c->triangles[3 * t + (size_t)s];
        const float *q = c->positions + 3 * (size_t)c->triangles[3 * t + (size_t)(s + 1) % 3];
        for (int k = 0; k < 3; k++)
          areas[k] += (double)p[k] * (double)q[(k + 1) % 3] - (double)p[(k + 1) % 3] * (double)q[k];
      }
    for (int k = 0; k < 3; k++)
      assert_true(areas[k] < 1e-4 && areas[k] > -1e-4);
    zs_mesh_free(c);
    zs_mesh_free(m);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_closed_stays),
                                     cmocka_unit_test(test_holes), cmocka_unit_test(test_soup)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
