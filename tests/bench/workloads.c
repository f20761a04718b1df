/* The first table: every scene and job at three sizes. */
#include "jobs.h"
#include "scenes.h"

#include <math.h>
#include <stdio.h>

static const double BUDGET = 1.2; /* seconds for the runs of one row */
static const double LONGEST = 3;  /* seconds of a run, after which a scene has no more rows */

typedef enum job_kind { OCCUPANCY, VALUES, MESH, PICTURE } job_kind;

static const struct {
  const char *name;
  bench_job *run;
  unsigned dimensions; /* of the lattice */
} jobs[] = {
  [OCCUPANCY] = {"occupancy", job_occupancy, 3},
  [VALUES] = {"values", job_values, 3},
  [MESH] = {"mesh", job_mesh, 3},
  [PICTURE] = {"picture", job_picture, 2},
};

typedef struct workload {
  job_kind job;
  unsigned sizes[BENCH_SIZES];
} workload;

/* A scene and what is done with it. */
typedef struct family {
  const char *name;
  scene_writer *write;
  unsigned n;
  workload workloads[3];
  unsigned count;
} family;

#define VOXELS {64, 128, 256}
#define MESHES {128, 256, 512}
#define PICTURES {1024, 2048, 4096}

static const family families[] = {
  {"prospero", scene_prospero, 0, {{PICTURE, PICTURES}}, 1},
  {"rings", scene_rings, 440, {{PICTURE, PICTURES}}, 1},
  {"spheres-100", scene_spheres, 100, {{OCCUPANCY, VOXELS}, {VALUES, VOXELS}, {MESH, MESHES}}, 3},
  {"spheres-1000", scene_spheres, 1000,
   {{OCCUPANCY, VOXELS}, {VALUES, VOXELS}, {MESH, MESHES}}, 3},
  {"spheres-3000", scene_spheres, 3000,
   {{OCCUPANCY, VOXELS}, {VALUES, VOXELS}, {MESH, MESHES}}, 3},
  {"spheres-100000", scene_spheres_same_surface, 100000,
   {{OCCUPANCY, VOXELS}, {VALUES, VOXELS}, {MESH, MESHES}}, 3},
  {"soft-100", scene_soft, 100, {{OCCUPANCY, VOXELS}}, 1},
  {"soft-1000", scene_soft, 1000, {{OCCUPANCY, VOXELS}}, 1},
  {"soft-10000", scene_soft, 10000, {{OCCUPANCY, VOXELS}}, 1},
  {"convolution-10", scene_convolution, 10, {{OCCUPANCY, VOXELS}}, 1},
  {"convolution-100", scene_convolution, 100, {{OCCUPANCY, VOXELS}}, 1},
  {"convolution-1000", scene_convolution, 1000, {{OCCUPANCY, VOXELS}}, 1},
  {"menger-4", scene_menger, 4, {{OCCUPANCY, VOXELS}, {MESH, MESHES}}, 2},
  {"gyroid-sphere", scene_gyroid, 0, {{OCCUPANCY, VOXELS}, {MESH, MESHES}}, 2},
  {"twisted-column", scene_column, 0, {{OCCUPANCY, VOXELS}, {MESH, MESHES}}, 2},
  {"gear", scene_gear, 120, {{OCCUPANCY, VOXELS}, {MESH, MESHES}}, 2},
  {"bunny", scene_bunny, 0, {{OCCUPANCY, VOXELS}, {MESH, VOXELS}}, 2},
};

/* Brute force in the row of a size; meshes and pictures are compared at the
 * least one. */
static brute compare(const bench *b, const work *w, job_kind job, unsigned index, double seconds)
{
  if (job == OCCUPANCY || job == VALUES)
    return brute_voxels(b, w, job == VALUES ? ZS_QUANTITY_VALUE : ZS_QUANTITY_INSIDE, seconds);
  if (index > 0)
    return (brute){.gain = NAN, .same = true};
  return job == MESH ? brute_mesh(b, w) : brute_picture(b, w, seconds);
}

/* One line: time, what a sample of the full grid costs, gain over brute force,
 * growth since the previous size, gain from a second thread. */
static bool row(bench *b, zs_field *field, const family *f, const workload *l, unsigned index,
                double *previous)
{
  const unsigned size = bench_size(b, l->sizes[index]);
  const char *job = jobs[l->job].name;
  work w, w2;
  if (!work_begin(&w, field, size, 1) || !work_begin(&w2, field, size, 2))
    return false;
  bench_time times[2];
  bench_measure_both(b, jobs[l->job].run, &w, jobs[l->job].run, &w2, BUDGET, times);
  if (times[0].failed || times[1].failed)
    return false;
  const double seconds = times[0].processor, gain = times[0].wall / times[1].wall;
  brute brute = compare(b, &w, l->job, index, seconds);
  bool same = brute.same && w.answer == w2.answer;
  char text[3][16];
  double samples = (double)w.grid.count[0] * w.grid.count[1];
  if (jobs[l->job].dimensions == 3)
    samples *= w.grid.count[2];
  printf("%-15s %-10s %5u %10.2f %4u %9.2f %9.3f %9s %8s %8s\n", f->name, job, size,
         1e3 * seconds, times[0].runs, 1e9 * seconds / samples,
         (double)w.evaluations / samples, bench_ratio(text[0], brute.gain, same ? "" : "!"),
         bench_ratio(text[1], *previous > 0 ? seconds / *previous : NAN, ""),
         bench_ratio(text[2], gain, w.answer == w2.answer ? "" : "!"));
  bench_remember(b, seconds, "%s %s %u", f->name, job, size);
  bench_remember(b, brute.gain, "%s %s %u brute", f->name, job, size);
  bench_remember(b, gain, "%s %s %u threads", f->name, job, size);
  *previous = seconds;
  return same;
}

/* All rows of a scene, or the first ones when they take too long for more. */
static bool run_rows(bench *b, zs_field *field, const family *f)
{
  bool good = true;
  double previous = 0;
  for (unsigned i = 0; i < f->count * BENCH_SIZES; i++) {
    const unsigned index = i % BENCH_SIZES;
    if (previous > LONGEST) {
      printf("%-15s more is left out: it would take too long\n", f->name);
      break;
    }
    if (index == 0)
      previous = 0;
    good = row(b, field, f, &f->workloads[i / BENCH_SIZES], index, &previous) && good;
  }
  return good;
}

static bool run_family(bench *b, const family *f)
{
  zs_field *field = scene_compile(f->write, bench_parts(b, f->n));
  bool good = field && run_rows(b, field, f);
  zs_field_unref(field);
  return good;
}

void bench_workloads(bench *b)
{
  bool headed = false;
  for (size_t i = 0; i < sizeof families / sizeof *families; i++) {
    const family *f = &families[i];
    if (!bench_wants(b, "%s", f->name))
      continue;
    if (!headed)
      printf("\n%-15s %-10s %5s %10s %4s %9s %9s %9s %8s %8s\n", "workload", "job", "size", "ms",
             "runs", "ns/samp", "eval/samp", "brute", "growth", "2 thr");
    headed = true;
    if (f->write == scene_prospero && !scene_prospero_exists()) {
      printf("%-15s skipped: there is no prospero.vm in the folder ZEROSET_BENCH_DATA\n", f->name);
      continue;
    }
    if (!run_family(b, f)) {
      printf("%-15s wrong!\n", f->name);
      b->wrong = true;
    }
  }
}
