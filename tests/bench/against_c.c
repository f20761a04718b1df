/* Unpruned evaluation of blocks of points against the same scene written in C. */
#include "handwritten.h"

#include "../random.h"
#include "bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double BUDGET = 1; /* seconds for the runs of one number */

typedef struct contest {
  zs_eval *eval;
  void (*run)(const struct contest *c, float *f); /* the scene in C */
  spheres spheres;
  size_t n;
  float *x, *y, *z;  /* the points */
  float *ours, *other; /* the values */
} contest;

static void run_spheres(const contest *c, float *f)
{
  handwritten_spheres(&c->spheres, c->n, c->x, c->y, c->z, f);
}

static void run_gyroid(const contest *c, float *f)
{
  handwritten_gyroid(c->n, c->x, c->y, c->z, f);
}

static void run_column(const contest *c, float *f)
{
  handwritten_column(c->n, c->x, c->y, c->z, f);
}

static const struct {
  const char *name;
  scene_writer *write;
  unsigned n;
  void (*run)(const contest *c, float *f);
  unsigned points[BENCH_SIZES];
} scenes[] = {
  {"spheres-100", scene_spheres, 100, run_spheres, {1 << 12, 1 << 14, 1 << 16}},
  {"spheres-1000", scene_spheres, 1000, run_spheres, {1 << 12, 1 << 14, 1 << 16}},
  {"gyroid-sphere", scene_gyroid, 0, run_gyroid, {1 << 14, 1 << 16, 1 << 18}},
  {"twisted-column", scene_column, 0, run_column, {1 << 14, 1 << 16, 1 << 18}},
};

static bench_span job_ours(void *context)
{
  contest *c = context;
  bench_span begun = bench_now();
  zs_eval_values(c->eval, NULL, c->n, c->x, c->y, c->z, c->ours);
  return bench_since(begun, true);
}

static bench_span job_handwritten(void *context)
{
  contest *c = context;
  bench_span begun = bench_now();
  c->run(c, c->other);
  return bench_since(begun, true);
}

static double largest_difference(const contest *c)
{
  double largest = 0;
  for (size_t i = 0; i < c->n; i++) {
    double difference = fabs((double)c->ours[i] - c->other[i]);
    if (!(difference <= largest))
      largest = difference;
  }
  return largest;
}

static bool contest_begin(contest *c, zs_field *field, size_t most)
{
  float **arrays[] = {&c->x, &c->y, &c->z, &c->ours, &c->other};
  uint64_t seed = 3;
  for (size_t a = 0; a < sizeof arrays / sizeof *arrays; a++) {
    *arrays[a] = malloc(most * sizeof(float));
    if (!*arrays[a])
      return false;
    for (size_t i = 0; i < most; i++)
      (*arrays[a])[i] = (float)random_between(&seed, -1, 1);
  }
  c->eval = zs_eval_new(field, bench_diag());
  return c->eval != NULL;
}

static void contest_end(contest *c)
{
  zs_eval_free(c->eval);
  free(c->spheres.items);
  free(c->x);
  free(c->y);
  free(c->z);
  free(c->ours);
  free(c->other);
}

static bool row(bench *b, contest *c, const char *name)
{
  bench_time times[2];
  bench_measure_both(b, job_ours, c, job_handwritten, c, BUDGET, times);
  const double ours = times[0].processor, other = times[1].processor;
  double difference = largest_difference(c);
  bool same = difference <= 1e-5;
  char text[16];
  printf("%-15s %8zu %10.2f %10.2f %9s %12.1e\n", name, c->n,
         1e9 * ours / (double)c->n, 1e9 * other / (double)c->n,
         bench_ratio(text, ours / other, same ? "" : "!"), difference);
  bench_remember(b, ours, "%s unpruned", name);
  bench_remember(b, other, "%s handwritten", name);
  return same;
}

static bool run_scene(bench *b, size_t index)
{
  contest c = {.run = scenes[index].run};
  if (c.run == run_spheres)
    c.spheres = spheres_of_volume(bench_parts(b, scenes[index].n));
  zs_field *field = scene_compile(scenes[index].write, bench_parts(b, scenes[index].n));
  bool good = field && contest_begin(&c, field, scenes[index].points[BENCH_SIZES - 1]);
  for (unsigned k = 0; k < BENCH_SIZES && good; k++) {
    c.n = bench_size(b, scenes[index].points[k]);
    good = row(b, &c, scenes[index].name);
  }
  contest_end(&c);
  zs_field_unref(field);
  return good;
}

void bench_handwritten(bench *b)
{
  bool headed = false;
  for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
    if (!bench_wants(b, "handwritten %s", scenes[i].name))
      continue;
    if (!headed)
      printf("\n%-15s %8s %10s %10s %9s %12s\n", "handwritten", "points", "ns/point", "C", "ours/C",
             "difference");
    headed = true;
    if (!run_scene(b, i))
      b->wrong = true;
  }
}
