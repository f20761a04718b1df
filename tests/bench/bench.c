/* make bench: one table of what the kernel costs, by ratios that hold on noisy
 * machines.  Every workload runs at three sizes, so that growth can be seen.
 * doc/performance.md explains the rows.
 *
 * Usage: bench [WORD ...]   only workloads whose name contains a WORD
 * ZEROSET_BENCH_DATA names a folder with optional input (prospero.xml). */
#include "../random.h"

#include "zeroset.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { REPEATS = 5, SIZES = 3 };

static double seconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void complain(void *context, const zs_diagnostic *d)
{
  (void)context;
  fprintf(stderr, "bench: %s:%u:%u: %s\n", d->file ? d->file : "", d->line, d->column, d->message);
}

static zs_diag diag = {.report = complain};

/* ---- Scenes as text ----------------------------------------------------------- */

typedef struct text {
  char *bytes;
  size_t length, capacity;
} text;

static void append(text *t, const char *format, ...)
{
  if (t->capacity - t->length < 4096) {
    t->capacity = 2 * t->capacity + 8192;
    t->bytes = realloc(t->bytes, t->capacity);
    if (!t->bytes)
      abort();
  }
  va_list arguments;
  va_start(arguments, format);
  t->length += (size_t)vsnprintf(t->bytes + t->length, 4096, format, arguments);
  va_end(arguments);
}

/* n random spheres under a smooth union, the same volume for every n. */
static void spheres(text *t, unsigned n)
{
  uint64_t seed = 20070501;
  double size = 0.35 * pow(n / 100.0, -1.0 / 3);
  append(t, "<scene><domain min='-1.2 -1.2 -1.2' max='1.2 1.2 1.2'/><smooth-union radius='%.6f'>",
         0.2 * size);
  for (unsigned i = 0; i < n; i++) {
    double p[3];
    for (int k = 0; k < 3; k++)
      p[k] = random_between(&seed, -1, 1);
    append(t, "<sphere radius='%.6f' at='%.6f %.6f %.6f'/>", size * random_between(&seed, 0.4, 1),
           p[0], p[1], p[2]);
  }
  append(t, "</smooth-union></scene>");
}

/* A Menger sponge: a cube less three families of square bars per level. */
static void menger(text *t, unsigned levels)
{
  append(t, "<scene><domain min='-1.1 -1.1 -1.1' max='1.1 1.1 1.1'/><difference><box size='2'/>");
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
          append(t, "<box size='%.9g %.9g %.9g' at='%.9g %.9g %.9g'/>", s[0], s[1], s[2], p[0],
                 p[1], p[2]);
        }
  }
  append(t, "</difference></scene>");
}

static void gyroid(text *t, unsigned unused)
{
  (void)unused;
  append(t, "<scene><domain min='-1.1 -1.1 -1.1' max='1.1 1.1 1.1'/><intersection>"
            "<sphere radius='1'/><formula>let k = 20;"
            "0.02 - abs(sin(k*x)*cos(k*y) + sin(k*y)*cos(k*z) + sin(k*z)*cos(k*x))/35"
            "</formula></intersection></scene>");
}

static void column(text *t, unsigned unused)
{
  (void)unused;
  append(t, "<scene><domain min='-1 -1 -1' max='1 1 1'/><twist axis='z' rate='90'>"
            "<smooth-union radius='0.1'><box size='0.6 0.6 1.8'/>");
  for (int i = 0; i < 8; i++)
    append(t, "<cylinder radius='0.08' height='1.8' at='%.4f %.4f 0'/>", 0.45 * cos(i * 0.7854),
           0.45 * sin(i * 0.7854));
  append(t, "</smooth-union></twist></scene>");
}

/* A wheel with many teeth and holes: a large flat CSG tree. */
static void gear(text *t, unsigned teeth)
{
  append(t, "<scene><domain min='-1.2 -1.2 -0.2' max='1.2 1.2 0.2'/><difference><union>"
            "<cylinder radius='1' height='0.3'/>");
  for (unsigned i = 0; i < teeth; i++) {
    double a = 360.0 * i / teeth, r = a * 3.14159265358979 / 180;
    append(t, "<box size='0.2 %.5f 0.3' round='0.005' rotate='0 0 %.6f' at='%.6f %.6f 0'/>",
           3.0 / teeth, a, cos(r), sin(r));
  }
  append(t, "</union><cylinder radius='0.2' height='1'/>");
  for (unsigned i = 0; i < teeth / 4; i++) {
    double r = 6.28318530717959 * i / (teeth / 4);
    append(t, "<cylinder radius='%.5f' height='1' at='%.6f %.6f 0'/>", 3.0 / teeth, 0.7 * cos(r),
           0.7 * sin(r));
  }
  append(t, "</difference></scene>");
}

static zs_field *compile_text(void (*write)(text *, unsigned), unsigned n, double *load)
{
  text t = {0};
  write(&t, n);
  double start = seconds();
  zs_scene *scene = zs_scene_parse(t.bytes, t.length, "bench.xml", NULL, &diag);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  *load = seconds() - start;
  zs_scene_free(scene);
  free(t.bytes);
  return field;
}

/* ---- Jobs ------------------------------------------------------------------------ */

typedef struct result {
  double seconds;
  uint64_t evaluations, answer; /* answer: samples inside, or triangles */
} result;

typedef bool job(zs_field *field, unsigned size, const zs_control *control, result *r);

static bool swallow(void *context, uint32_t z, uint32_t count, const void *samples)
{
  (void)context, (void)z, (void)count, (void)samples;
  return true;
}

static bool box_grid(zs_field *field, unsigned size, zs_grid *grid)
{
  double lo[3], hi[3];
  return zs_field_box(field, lo, hi, &diag) && zs_grid_fit(grid, lo, hi, size, &diag);
}

static bool voxels(zs_field *field, unsigned size, zs_quantity quantity,
                   const zs_control *control, result *r)
{
  zs_grid grid;
  zs_job_report report = {0};
  if (!box_grid(field, size, &grid) ||
      !zs_voxelize(field, &grid, quantity, swallow, NULL, &r->answer, control, &report, &diag))
    return false;
  r->evaluations = report.evaluations;
  return true;
}

static bool occupancy(zs_field *field, unsigned size, const zs_control *control, result *r)
{
  return voxels(field, size, ZS_QUANTITY_INSIDE, control, r);
}

static bool values(zs_field *field, unsigned size, const zs_control *control, result *r)
{
  return voxels(field, size, ZS_QUANTITY_VALUE, control, r);
}

static bool mesh(zs_field *field, unsigned size, const zs_control *control, result *r)
{
  zs_grid grid;
  zs_job_report report = {0};
  if (!box_grid(field, size, &grid))
    return false;
  zs_mesh *m = zs_polygonize(field, &grid, NULL, control, &report, &diag);
  if (!m)
    return false;
  r->evaluations = report.evaluations;
  r->answer = zs_mesh_triangle_count(m);
  zs_mesh_free(m);
  return true;
}

static bool picture(zs_field *field, unsigned size, const zs_control *control, result *r)
{
  double lo[3], hi[3];
  zs_image image = {0};
  zs_slice_options options;
  zs_job_report report = {0};
  zs_slice_options_init(&options);
  options.width = options.height = size;
  options.quantity = ZS_QUANTITY_INSIDE;
  bool done = zs_field_box(field, lo, hi, &diag) &&
              zs_slice(field, lo, hi, &options, &image, &r->answer, control, &report, &diag);
  r->evaluations = report.evaluations;
  zs_image_clear(&image);
  return done;
}

static int by_seconds(const void *a, const void *b)
{
  double x = ((const result *)a)->seconds, y = ((const result *)b)->seconds;
  return (x > y) - (x < y);
}

/* The run of median time. */
static bool median(job *run, zs_field *field, unsigned size, unsigned threads, bool brute,
                   unsigned repeats, result *r)
{
  result all[REPEATS];
  zs_control control;
  zs_control_init(&control);
  control.threads = threads;
  control.brute = brute;
  for (unsigned i = 0; i < repeats; i++) {
    double start = seconds();
    if (!run(field, size, &control, &all[i]))
      return false;
    all[i].seconds = seconds() - start;
  }
  qsort(all, repeats, sizeof *all, by_seconds);
  *r = all[repeats / 2];
  return true;
}

typedef struct workload {
  const char *name, *what;
  job *run;
  unsigned sizes[SIZES];
  unsigned dimensions; /* samples grow as size^dimensions */
  bool brute;          /* small enough to compare with every sample evaluated */
} workload;

/* One line: time, what a sample of the full grid costs, gain over brute force,
 * growth since the previous size, gain from a second thread. */
static bool row(zs_field *field, const workload *w, unsigned index, double *previous)
{
  const unsigned size = w->sizes[index];
  result one, two, brute = {0};
  if (!median(w->run, field, size, 1, false, REPEATS, &one) ||
      !median(w->run, field, size, 2, false, REPEATS, &two))
    return false;
  bool with_brute = w->brute && index == 0;
  if (with_brute && !median(w->run, field, size, 1, true, 1, &brute))
    return false;
  double samples = pow(size, w->dimensions);
  printf("%-14s %-10s %5u %10.2f %8.2f %10.3f", w->name, w->what, size, 1e3 * one.seconds,
         1e9 * one.seconds / samples, (double)one.evaluations / samples);
  if (with_brute)
    printf(" %8.1fx%s", brute.seconds / one.seconds, brute.answer == one.answer ? "" : "!");
  else
    printf(" %9s", "");
  if (*previous > 0)
    printf(" %7.2fx", one.seconds / *previous);
  else
    printf(" %8s", "");
  printf(" %7.2fx\n", one.seconds / two.seconds);
  fflush(stdout);
  *previous = one.seconds;
  return !with_brute || brute.answer == one.answer;
}

static bool wanted(const char *name, int words, char **word)
{
  for (int i = 0; i < words; i++)
    if (strstr(name, word[i]))
      return true;
  return words == 0;
}

static bool run_workload(zs_field *field, const workload *w)
{
  double previous = 0;
  for (unsigned i = 0; i < SIZES; i++)
    if (!row(field, w, i, &previous))
      return false;
  return true;
}

/* A family of scenes and what is done with them. */
typedef struct family {
  const char *name;
  void (*write)(text *, unsigned);
  unsigned n;
  workload workloads[3];
} family;

static const family families[] = {
  {"spheres-100", spheres, 100,
   {{"spheres-100", "occupancy", occupancy, {64, 128, 256}, 3, true},
    {"spheres-100", "values", values, {64, 128, 256}, 3, true},
    {"spheres-100", "mesh", mesh, {64, 128, 256}, 3, true}}},
  {"spheres-1000", spheres, 1000,
   {{"spheres-1000", "occupancy", occupancy, {64, 128, 256}, 3, true},
    {"spheres-1000", "values", values, {64, 128, 256}, 3, true},
    {"spheres-1000", "mesh", mesh, {64, 128, 256}, 3, true}}},
  {"spheres-3000", spheres, 3000,
   {{"spheres-3000", "occupancy", occupancy, {64, 128, 256}, 3, true}}},
  {"menger-3", menger, 3,
   {{"menger-3", "occupancy", occupancy, {64, 128, 256}, 3, true},
    {"menger-3", "mesh", mesh, {64, 128, 256}, 3, true}}},
  {"gyroid-sphere", gyroid, 0,
   {{"gyroid-sphere", "occupancy", occupancy, {64, 128, 256}, 3, true},
    {"gyroid-sphere", "mesh", mesh, {64, 128, 256}, 3, true}}},
  {"twisted-column", column, 0,
   {{"twisted-column", "occupancy", occupancy, {64, 128, 256}, 3, true},
    {"twisted-column", "mesh", mesh, {64, 128, 256}, 3, true}}},
  {"gear", gear, 120,
   {{"gear", "occupancy", occupancy, {64, 128, 256}, 3, true},
    {"gear", "mesh", mesh, {64, 128, 256}, 3, true}}},
};

static bool run_family(const family *f)
{
  double load;
  zs_field *field = compile_text(f->write, f->n, &load);
  bool done = field != NULL;
  for (size_t i = 0; done && i < 3 && f->workloads[i].run; i++)
    done = run_workload(field, &f->workloads[i]);
  zs_field_unref(field);
  return done;
}

/* The usual 2D benchmark of implicit evaluators, where its scene is at hand. */
static bool run_prospero(void)
{
  const char *folder = getenv("ZEROSET_BENCH_DATA");
  char path[4096];
  snprintf(path, sizeof path, "%s/prospero.xml", folder ? folder : ".");
  FILE *file = fopen(path, "r");
  if (!file) {
    printf("%-14s skipped: %s is not there\n", "prospero", path);
    return true;
  }
  fclose(file);
  static const workload w = {"prospero", "picture", picture, {1024, 2048, 4096}, 2, true};
  zs_scene *scene = zs_scene_load(path, NULL, &diag);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  bool done = field && run_workload(field, &w);
  zs_field_unref(field);
  zs_scene_free(scene);
  return done;
}

/* Reading and compiling, by the number of nodes. */
static bool run_loading(void)
{
  double previous = 0;
  static const unsigned sizes[SIZES] = {1000, 10000, 100000};
  for (unsigned i = 0; i < SIZES; i++) {
    double best = INFINITY;
    for (int repeat = 0; repeat < REPEATS; repeat++) {
      double load;
      zs_field *field = compile_text(spheres, sizes[i], &load);
      if (!field)
        return false;
      zs_field_unref(field);
      best = fmin(best, load);
    }
    printf("%-14s %-10s %5u %10.2f %8.0f %10s %9s", "spheres-N", "load", sizes[i], 1e3 * best,
           1e9 * best / sizes[i], "", "");
    if (previous > 0)
      printf(" %7.2fx", best / previous);
    printf("\n");
    previous = best;
  }
  return true;
}

int main(int argc, char **argv)
{
  bool done = true;
  printf("zeroset %s, %s\n", zs_version(), zs_isa());
  printf("%-14s %-10s %5s %10s %8s %10s %9s %8s %8s\n", "workload", "job", "size", "ms",
         "ns/samp", "eval/samp", "brute", "growth", "2 thr");
  if (wanted("prospero", argc - 1, argv + 1))
    done = run_prospero();
  for (size_t i = 0; i < sizeof families / sizeof *families; i++)
    if (wanted(families[i].name, argc - 1, argv + 1))
      done = run_family(&families[i]) && done;
  if (wanted("load", argc - 1, argv + 1))
    done = run_loading() && done;
  return done ? 0 : 1;
}
