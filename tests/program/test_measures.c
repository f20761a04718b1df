/* Volume and area of meshes against closed forms, and how fast the error falls. */
#include "zeroset.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

typedef struct solid {
  const char *name, *scene;
  double volume, area;
  bool smooth; /* no edges: the error is of second order */
} solid;

static void report(void *context, const zs_diagnostic *d)
{
  (void)context;
  print_error("%u:%u: %s\n", d->line, d->column, d->message);
}

static zs_mesh_report measure(zs_field *field, uint32_t resolution, zs_diag *diag)
{
  double lo[3], hi[3];
  zs_grid grid;
  assert_true(zs_field_box(field, lo, hi, diag));
  assert_true(zs_grid_fit(&grid, lo, hi, resolution, diag));
  zs_mesh *mesh = zs_polygonize(field, &grid, NULL, NULL, NULL, diag);
  assert_non_null(mesh);
  zs_mesh_report measures;
  assert_true(zs_mesh_check(mesh, &measures, diag));
  zs_mesh_free(mesh);
  assert_true(measures.closed && measures.manifold && measures.oriented);
  assert_int_equal(measures.components, 1);
  return measures;
}

static double relative(double value, double exact)
{
  return fabs(value - exact) / exact;
}

/* The order p of an error that falls as resolution^-p, from 32 to 128. */
static double order(double coarse, double fine)
{
  return log(coarse / fine) / log(4);
}

static void test_solid(void **state)
{
  const solid *s = *state;
  zs_diag diag = {.report = report};
  zs_scene *scene = zs_scene_parse(s->scene, strlen(s->scene), s->name, NULL, &diag);
  assert_non_null(scene);
  zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
  assert_non_null(field);
  zs_mesh_report coarse = measure(field, 32, &diag);
  zs_mesh_report fine = measure(field, 128, &diag);
  double volume_error = relative(fine.volume, s->volume);
  double area_error = relative(fine.area, s->area);
  double volume_order = order(relative(coarse.volume, s->volume), volume_error);
  double area_order = order(relative(coarse.area, s->area), area_error);
  print_message("%s: volume error %.2e, order %.2f; area error %.2e, order %.2f\n", s->name,
                volume_error, volume_order, area_error, area_order);
  assert_true(volume_error < 0.002);
  assert_true(area_error < 0.002);
  if (s->smooth) {
    assert_true(volume_order >= 1.8);
    assert_true(area_order >= 1.8);
  }
  zs_field_unref(field);
  zs_scene_free(scene);
}

#define SCENE(body) "<scene>" body "</scene>"

/* A sphere of radius 1 with a hole of radius 1/2 along its axis is a ring of
 * half-height sqrt(3)/2: volume 4/3 pi h^3, area 4 pi (1 + 1/2) h. */
#define RING_HALF 0.86602540378443864676

static solid solids[] = {
  {"sphere", SCENE("<sphere radius='1'/>"), 4 * PI / 3, 4 * PI, true},
  {"torus", SCENE("<torus radius='1' tube='0.4' rotate='20 30 0'/>"), 2 * PI * PI * 0.16,
   4 * PI * PI * 0.4, true},
  {"capsule", SCENE("<capsule from='-1 0 0' to='0.5 1 0.7' radius='0.5'/>"),
   PI * 0.25 * 1.93390796058137 + 4 * PI / 3 * 0.125, PI * 1.93390796058137 * 1 + 4 * PI * 0.25,
   true},
  {"box", SCENE("<box size='2 1.5 1'/>"), 3, 13, false},
  {"cone", SCENE("<cone radius='1' top-radius='0.5' height='1.5'/>"),
   PI * 1.5 / 3 * (1 + 0.5 + 0.25), PI * (1 + 0.25) + PI * 1.5 * 1.58113883008419, false},
  {"drilled sphere",
   SCENE("<difference><sphere radius='1'/><cylinder radius='0.5' height='3'/></difference>"),
   4 * PI / 3 * RING_HALF * RING_HALF * RING_HALF, 6 * PI * RING_HALF, false},
};

int main(void)
{
  enum { COUNT = sizeof solids / sizeof solids[0] };
  struct CMUnitTest tests[COUNT];
  for (int i = 0; i < COUNT; i++)
    tests[i] = (struct CMUnitTest){solids[i].name, test_solid, NULL, NULL, &solids[i]};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
