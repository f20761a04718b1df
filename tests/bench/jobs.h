/* What is done with the scenes, and the same by brute force. */
#ifndef ZS_BENCH_JOBS_H
#define ZS_BENCH_JOBS_H

#include "bench.h"

typedef struct work {
  zs_field *field;
  zs_grid grid;
  zs_control control;
  void *samples;        /* where the voxel jobs store, or NULL */
  uint64_t evaluations; /* the latest run's */
  uint64_t answer;      /* of a mesh its triangles, of a picture a hash */
} work;

/* The work on the whole box of a field; false when it has none. */
bool work_begin(work *w, zs_field *field, unsigned size, unsigned threads);

/* Jobs for bench_measure(), whose context is a work. */
bench_job job_occupancy, job_values, job_mesh, job_cut_mesh, job_picture;

typedef struct brute {
  double gain; /* how often longer brute force takes, 0 when it failed */
  bool same;   /* whether the answers agree */
} brute;

/* `whole` took `seconds` for all its samples.  Brute force takes layers in the
 * middle, as many as it does in a fraction of a second. */
brute brute_voxels(const bench *b, const work *whole, zs_quantity quantity, double seconds);
/* Both mesh an eighth of the box. */
brute brute_mesh(const bench *b, const work *whole);
/* All pixels. */
brute brute_picture(const bench *b, const work *whole, double seconds);

#endif
