/* make bench: what the kernel costs, by ratios that hold on noisy machines.
 * doc/performance.md explains the rows.
 *
 * Usage: bench [--smoke] [WORD ...]   only rows whose name contains a WORD
 *
 * Environment, set by make: top_srcdir, where the scenes are; ZEROSET, the
 * program; XMLLINT; BENCH_PYTHON, a Python that may have VTK, scikit-image and SciPy;
 * BENCH_GTS, the peer built on GTS; ZEROSET_BENCH_DATA, a folder with optional
 * input. */
#include "bench.h"

#include "cli/blas.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef enum sense { AT_MOST, AT_LEAST } sense;

/* What a number, or its ratio to another one, must reach. */
typedef struct target {
  const char *what;
  const char *number, *by; /* by: NULL for the number itself */
  sense sense;
  double limit;
  const char *unit;
} target;

static const target targets[] = {
  {"prospero, 1024²: gain over brute force", "prospero picture 1024 brute", NULL, AT_LEAST, 80,
   "x"},
  {"prospero, 4096² by 1024²", "prospero picture 4096", "prospero picture 1024", AT_MOST, 4.5,
   "x"},
  {"spheres-100, unpruned values: ours by C", "spheres-100 unpruned", "spheres-100 handwritten",
   AT_MOST, 1, "x"},
  {"spheres-1000, 256³ occupancy: gain over scalar", "scalar spheres-1000 256", NULL, AT_LEAST, 10,
   "x"},
  {"spheres-100000 by spheres-1000, same surface, 256³", "spheres-100000 occupancy 256",
   "spheres-1000 occupancy 256", AT_MOST, 3, "x"},
  {"spheres-1000, 256³ values: gain over brute force", "spheres-1000 values 256 brute", NULL,
   AT_LEAST, 20, "x"},
  {"spheres-1000, mesh 256 by VTK's extraction alone", "peers spheres-1000 mesh 256",
   "peers spheres-1000 vtk 256", AT_MOST, 1.5, "x"},
  {"menger-4, mesh 256 by VTK's extraction alone", "peers menger-4 mesh 256",
   "peers menger-4 vtk 256", AT_MOST, 1.5, "x"},
  {"spheres-1000, the same with its sharp edges", "peers spheres-1000 sharp 256",
   "peers spheres-1000 vtk 256", AT_MOST, 1.5, "x"},
  {"menger-4, the same with its sharp edges", "peers menger-4 sharp 256",
   "peers menger-4 vtk 256", AT_MOST, 1.5, "x"},
  {"spheres-1000, mesh 512 by 256", "spheres-1000 mesh 512", "spheres-1000 mesh 256", AT_MOST, 4.5,
   "x"},
  {"menger-4, mesh 512 by 256", "menger-4 mesh 512", "menger-4 mesh 256", AT_MOST, 4.5, "x"},
  {"load 100000 by 2 xmllint + 0.2 s", "load 100000", "load 100000 allowance", AT_MOST, 1, "x"},
  {"slowest picture of a scene without data", "picture slowest", NULL, AT_MOST, 0.5, " s"},
  {"fit of 1000, r3: gain over SciPy", "fit r3 1000 gain", NULL, AT_LEAST, 3, "x"},
  {"fit of 5000, r3: gain over SciPy", "fit r3 5000 gain", NULL, AT_LEAST, 5, "x"},
  {"fit of 10000, r3: gain over SciPy", "fit r3 10000 gain", NULL, AT_LEAST, 20, "x"},
  {"fit of 100000 by 10000, r3", "fit r3 100000", "fit r3 10000", AT_MOST, 40, "x"},
  {"fit of 10000, r3: residual", "fit r3 10000 residual", NULL, AT_MOST, 1, "e-6"},
  {"fit of 100000, r3: residual", "fit r3 100000 residual", NULL, AT_MOST, 10, "e-6"},
  {"fit of 100000, r: residual", "fit r 100000 residual", NULL, AT_MOST, 1, "e-6"},
  {"256³ values of 10000, r3: gain over direct sums", "sum r3 10000 gain", NULL, AT_LEAST, 30,
   "x"},
  {"256³ values of 10000, r3: error near the surface", "sum r3 10000 error", NULL, AT_MOST, 1,
   "e-6"},
  {"mesh 256 of 100000, r3: gain over direct sums", "sum r3 100000 mesh gain", NULL, AT_LEAST, 100,
   "x"},
  {"blocks of 512³ sampled, 100000, r3", "sum r3 100000 blocks", NULL, AT_MOST, 12, "%"},
  {"a value of 100000 by one of 10000, r3", "sum r3 100000", "sum r3 10000", AT_MOST, 3, "x"},
  {"a value of 200000 by one of 10000, r3", "sum r3 200000", "sum r3 10000", AT_MOST, 3, "x"},
  {"gyroid-sphere, mesh 1024: peak memory", "memory mesh", NULL, AT_MOST, 2, " GB"},
  {"gyroid-sphere, 2048³ voxels: peak memory", "memory voxels", NULL, AT_MOST, 1, " GB"},
};

static double reached(const bench *b, const target *t)
{
  double value = bench_recall(b, t->number);
  return t->by ? value / bench_recall(b, t->by) : value;
}

/* The rows of the targets that a second thread should speed up. */
static const char *const threaded[] = {
  "prospero picture 4096",      "spheres-1000 occupancy 256", "spheres-100000 occupancy 256",
  "spheres-1000 values 256",    "spheres-1000 mesh 256",      "menger-4 mesh 256",
};

/* The least gain from a second thread among them; NaN when none was measured. */
static double least_gain(const bench *b)
{
  double least = NAN;
  for (size_t i = 0; i < sizeof threaded / sizeof *threaded; i++) {
    char name[128];
    snprintf(name, sizeof name, "%s threads", threaded[i]);
    least = fmin(least, bench_recall(b, name));
  }
  return least;
}

static void print_target(const char *what, double value, sense sense, double limit,
                         const char *unit)
{
  if (isnan(value))
    return;
  bool met = sense == AT_MOST ? value <= limit : value >= limit;
  printf("%-52s %8.2f%-3s %s %g%s  %s\n", what, value, unit, sense == AT_MOST ? "<=" : ">=", limit,
         unit, met ? "reached" : "missed");
}

static void print_targets(const bench *b)
{
  printf("\ntargets\n");
  for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
    const target *t = &targets[i];
    print_target(t->what, reached(b, t), t->sense, t->limit, t->unit);
  }
  print_target("second thread: least gain of their rows", least_gain(b), AT_LEAST, 1.7, "x");
}

static void print_header(void)
{
  double load[1] = {0};
  printf("zeroset %s, %s, %ld processors", zs_version(), zs_isa(), sysconf(_SC_NPROCESSORS_ONLN));
  if (getloadavg(load, 1) == 1)
    printf(", %.1f processes running already", load[0]);
  printf("\n");
}

int main(int argc, char **argv)
{
  cli_blas_stop_threads();
  bench b = {.words = argc - 1, .word = argv + 1};
  if (b.words && !strcmp(b.word[0], "--smoke")) {
    b.smoke = true;
    b.words--;
    b.word++;
  }
  setvbuf(stdout, NULL, _IOLBF, 0);
  print_header();
  /* Memory comes first: a child's peak is never less than its parent's. */
  bench_section *const sections[] = {bench_memory,      bench_workloads, bench_scalar,
                                     bench_handwritten, bench_peers,     bench_loading,
                                     bench_pictures,    bench_fits};
  for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
    sections[i](&b);
  if (!b.smoke)
    print_targets(&b);
  free(b.numbers);
  if (b.wrong)
    printf("\nsomething is wrong: see the rows marked !\n");
  return b.wrong;
}
