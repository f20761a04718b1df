/* The same walk on scalar operations: what operations made for the nodes, and bounds
 * that know them, are worth. */
#include "jobs.h"
#include "scenes.h"

#include <stdio.h>

static const double BUDGET = 1;
enum { SPHERES = 1000 };
static const unsigned sizes[BENCH_SIZES] = {64, 128, 256};

static bool row(bench *b, zs_field *ours, zs_field *scalar, unsigned size)
{
  work w, other;
  bench_time times[2];
  char text[16];
  if (!work_begin(&w, ours, size, 1) || !work_begin(&other, scalar, size, 1))
    return false;
  times[0] = bench_measure(b, job_occupancy, &w, BUDGET);
  times[1] = bench_measure(b, job_occupancy, &other, BUDGET);
  if (times[0].failed || times[1].failed)
    return false;
  const double gain = times[1].processor / times[0].processor;
  /* A formula and an operation may round a sample on the surface apart. */
  const double apart = (double)w.answer - (double)other.answer;
  const bool same = apart * apart < 1e-8 * (double)w.answer * (double)w.answer;
  printf("%-15s %5u %10.2f %10.2f %4u %9s\n", "spheres-1000", size, 1e3 * times[0].processor,
         1e3 * times[1].processor, times[1].runs, bench_ratio(text, gain, same ? "" : "!"));
  bench_remember(b, gain, "scalar spheres-1000 %u", size);
  return same;
}

void bench_scalar(bench *b)
{
  if (!bench_wants(b, "scalar spheres-1000"))
    return;
  printf("\n%-15s %5s %10s %10s %4s %9s\n", "scalar", "size", "ms", "scalar ms", "runs", "gain");
  zs_field *ours = scene_compile(scene_spheres, bench_parts(b, SPHERES));
  zs_field *scalar = scene_compile_scalar(scene_spheres, bench_parts(b, SPHERES));
  bool good = ours && scalar;
  for (unsigned k = 0; k < BENCH_SIZES && good; k++)
    good = row(b, ours, scalar, bench_size(b, sizes[k]));
  if (!good)
    b->wrong = true;
  zs_field_unref(ours);
  zs_field_unref(scalar);
}
