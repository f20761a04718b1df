#include "scenes.h"

#include "../random.h"
#include "bench.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST_PIECE = 4096 };

void text_append(text *t, const char *format, ...)
{
  if (t->capacity - t->length < LONGEST_PIECE) {
    t->capacity = 2 * t->capacity + 2 * LONGEST_PIECE;
    t->bytes = realloc(t->bytes, t->capacity);
    if (!t->bytes)
      abort();
  }
  va_list arguments;
  va_start(arguments, format);
  t->length += (size_t)vsnprintf(t->bytes + t->length, LONGEST_PIECE, format, arguments);
  va_end(arguments);
}

void text_clear(text *t)
{
  free(t->bytes);
  *t = (text){0};
}

/* Spheres whose radii are up to `size`. */
static spheres spheres_of_size(unsigned count, double size)
{
  uint64_t seed = 20070501;
  spheres s = {malloc(count * sizeof(sphere)), count, 0.2 * size};
  if (!s.items)
    abort();
  for (unsigned i = 0; i < count; i++) {
    sphere *item = &s.items[i];
    item->x = (float)random_between(&seed, -1, 1);
    item->y = (float)random_between(&seed, -1, 1);
    item->z = (float)random_between(&seed, -1, 1);
    item->radius = (float)(size * random_between(&seed, 0.4, 1));
  }
  return s;
}

static double size_of_volume(unsigned count)
{
  return 0.35 * pow(count / 100.0, -1.0 / 3);
}

spheres spheres_of_volume(unsigned count)
{
  return spheres_of_size(count, size_of_volume(count));
}

spheres spheres_of_surface(unsigned count)
{
  return spheres_of_size(count, size_of_volume(1000) * pow(count / 1000.0, -0.5));
}

static bool write_spheres(text *t, spheres s)
{
  text_append(t, "<scene><domain min='-1.2 -1.2 -1.2' max='1.2 1.2 1.2'/>"
                 "<smooth-union radius='%.9g'>\n", s.blend);
  for (unsigned i = 0; i < s.count; i++)
    text_append(t, "<sphere radius='%.9g' at='%.9g %.9g %.9g'/>\n", s.items[i].radius,
                s.items[i].x, s.items[i].y, s.items[i].z);
  text_append(t, "</smooth-union></scene>\n");
  free(s.items);
  return true;
}

bool scene_spheres(text *t, unsigned n)
{
  return write_spheres(t, spheres_of_volume(n));
}

bool scene_spheres_same_surface(text *t, unsigned n)
{
  return write_spheres(t, spheres_of_surface(n));
}

/* A Menger sponge: a cube less three families of square bars per level. */
bool scene_menger(text *t, unsigned levels)
{
  text_append(t, "<scene><domain min='-1.1 -1.1 -1.1' max='1.1 1.1 1.1'/>"
                 "<difference><box size='2'/>");
  for (unsigned level = 0, bars = 1; level < levels; level++, bars *= 3) {
    double cell = 2.0 / bars;
    for (unsigned axis = 0; axis < 3; axis++)
      for (unsigned i = 0; i < bars; i++)
        for (unsigned j = 0; j < bars; j++) {
          double p[3], s[3];
          s[axis] = 3;
          p[axis] = 0;
          s[(axis + 1) % 3] = s[(axis + 2) % 3] = cell / 3;
          p[(axis + 1) % 3] = -1 + cell * (i + 0.5);
          p[(axis + 2) % 3] = -1 + cell * (j + 0.5);
          text_append(t, "<box size='%.9g %.9g %.9g' at='%.9g %.9g %.9g'/>", s[0], s[1], s[2],
                      p[0], p[1], p[2]);
        }
  }
  text_append(t, "</difference></scene>");
  return true;
}

bool scene_gyroid(text *t, unsigned n)
{
  (void)n;
  text_append(t, "<scene><domain min='-1.1 -1.1 -1.1' max='1.1 1.1 1.1'/><intersection>"
                 "<sphere radius='1'/><formula>let k = 20;"
                 "0.02 - abs(sin(k*x)*cos(k*y) + sin(k*y)*cos(k*z) + sin(k*z)*cos(k*x))/35"
                 "</formula></intersection></scene>");
  return true;
}

bool scene_column(text *t, unsigned n)
{
  (void)n;
  text_append(t, "<scene><domain min='-1 -1 -1' max='1 1 1'/><twist axis='z' rate='90'>"
                 "<smooth-union radius='0.1'><box size='0.6 0.6 1.8'/>");
  for (int i = 0; i < 8; i++)
    text_append(t, "<cylinder radius='0.08' height='1.8' at='%.4f %.4f 0'/>",
                0.45 * cos(i * 0.7854), 0.45 * sin(i * 0.7854));
  text_append(t, "</smooth-union></twist></scene>");
  return true;
}

/* A wheel with many teeth and holes: a large flat CSG tree. */
bool scene_gear(text *t, unsigned teeth)
{
  text_append(t, "<scene><domain min='-1.2 -1.2 -0.2' max='1.2 1.2 0.2'/><difference><union>"
                 "<cylinder radius='1' height='0.3'/>");
  for (unsigned i = 0; i < teeth; i++) {
    double a = 360.0 * i / teeth, r = a * 3.14159265358979 / 180;
    text_append(t, "<box size='0.2 %.5f 0.3' round='0.005' rotate='0 0 %.6f' at='%.6f %.6f 0'/>",
                3.0 / teeth, a, cos(r), sin(r));
  }
  text_append(t, "</union><cylinder radius='0.2' height='1'/>");
  for (unsigned i = 0; i < teeth / 4; i++) {
    double r = 6.28318530717959 * i / (teeth / 4);
    text_append(t, "<cylinder radius='%.5f' height='1' at='%.6f %.6f 0'/>", 3.0 / teeth,
                0.7 * cos(r), 0.7 * sin(r));
  }
  text_append(t, "</difference></scene>");
  return true;
}

/* The bunny of scenes/ with inner constraints only: two for each of its 1839
 * vertices. */
bool scene_bunny(text *t, unsigned n)
{
  (void)n;
  text_append(t, "<scene><domain min='-5.6 -6.4 -0.6' max='4.7 4.6 10.4'/>"
                 "<variational sides='in' rotate='90 0 60'><mesh src='bunny.obj' deviation='none'/>"
                 "</variational>"
                 "</scene>");
  return true;
}

/* A point on the unit sphere. */
static void on_sphere(uint64_t *seed, double p[3])
{
  const double z = random_between(seed, -1, 1), turn = random_between(seed, 0, 6.28318530717959);
  p[0] = sqrt(1 - z * z) * cos(turn);
  p[1] = sqrt(1 - z * z) * sin(turn);
  p[2] = z;
}

/* Soft points all over a sphere, the smaller the more there are. */
bool scene_soft(text *t, unsigned n)
{
  uint64_t seed = 20070503;
  text_append(t, "<scene><domain min='-2 -2 -2' max='2 2 2'/><soft threshold='0.5'>");
  for (unsigned i = 0; i < n; i++) {
    double p[3];
    on_sphere(&seed, p);
    text_append(t, "<point at='%.9g %.9g %.9g' radius='%.9g'/>", p[0], p[1], p[2], 4.8 / sqrt(n));
  }
  text_append(t, "</soft></scene>");
  return true;
}

/* Spines on a sphere, about which one kernel of the same width is added up. */
bool scene_convolution(text *t, unsigned n)
{
  uint64_t seed = 20070503;
  text_append(t, "<scene><domain min='-2 -2 -2' max='2 2 2'/><convolution threshold='%.9g'>",
              0.0006 * n);
  for (unsigned i = 0; i < n; i++) {
    double p[3];
    on_sphere(&seed, p);
    text_append(t, "<segment from='%.9g %.9g %.9g' to='%.9g %.9g %.9g' radius='0.2'/>", p[0],
                p[1], p[2], 1.1 * p[0], 1.1 * p[1], 1.1 * p[2]);
  }
  text_append(t, "</convolution></scene>");
  return true;
}

/* One long formula that draws n rings, each with a slot across it. */
bool scene_rings(text *t, unsigned n)
{
  uint64_t seed = 20070502;
  double size = 1 / sqrt(n);
  text_append(t, "<scene><domain min='-1 -1 -1' max='1 1 1'/><formula>\n");
  for (unsigned i = 0; i < n; i++) {
    double x = random_between(&seed, -1, 1), y = random_between(&seed, -1, 1);
    double radius = size * random_between(&seed, 0.5, 1);
    double turn = random_between(&seed, 0, 6.28), c = cos(turn), s = sin(turn);
    text_append(t, "let x%u = x + (%.9g); let y%u = y + (%.9g);\n", i, x, i, y);
    text_append(t, "let d%u = sqrt(x%u^2 + y%u^2);\n", i, i, i);
    text_append(t, "let s%u = abs(x%u * (%.9g) + y%u * (%.9g)) - %.9g;\n", i, i, c, i, s,
                radius / 8);
    text_append(t, "let r%u = min(min(%.9g - d%u, d%u - %.9g), s%u);\n", i, radius, i, i,
                radius / 2, i);
    if (i)
      text_append(t, "let u%u = max(u%u, r%u);\n", i, i - 1, i);
    else
      text_append(t, "let u0 = r0;\n");
  }
  text_append(t, "u%u</formula></scene>\n", n - 1);
  return true;
}

const char *scene_path(char path[4096], const char *name)
{
  snprintf(path, 4096, "%s/scenes/%s", bench_environment("top_srcdir", "."), name);
  return path;
}

static zs_field *compile(scene_writer *write, unsigned n, const zs_control *control)
{
  text t = {0};
  char path[4096];
  zs_scene *scene = write(&t, n) ? zs_scene_parse(t.bytes, t.length,
                                                  scene_path(path, "bench.xml"), NULL, bench_diag())
                                 : NULL;
  zs_field *field = scene ? zs_scene_compile(scene, NULL, control, bench_diag()) : NULL;
  zs_scene_free(scene);
  text_clear(&t);
  return field;
}

zs_field *scene_compile(scene_writer *write, unsigned n)
{
  return compile(write, n, NULL);
}

zs_field *scene_compile_scalar(scene_writer *write, unsigned n)
{
  zs_control control = bench_control(1);
  control.scalar = true;
  return compile(write, n, &control);
}
