/* Evaluation of variational fits, beside direct sums of all terms. */
#include "sums.h"

#include "field/compiler.h"
#include "field/program.h"
#include "rbf/sum.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double BUDGET = 3;  /* seconds for the runs of one job */
static const double HALF = 0.55; /* of the box's side, in which the fit is 1 wide */

/* A field of one sum, and where results go. */
typedef struct sum_work {
  const zs_rbf *rbf;
  zs_rbf_sum *sum;
  zs_field *field;
  unsigned size; /* cells along a side */
  bool brute;
  uint32_t from, layers; /* of the volume */
  float *values, *next;
  uint64_t evaluations;
} sum_work;

static bench_span job_compile(void *context)
{
  sum_work *w = context;
  zs_field_unref(w->field);
  zs_rbf_sum_free(w->sum);
  w->field = NULL;
  const zs_control control = bench_control(2);
  const bench_span begun = bench_now();
  w->sum = zs_rbf_sum_new(w->rbf, 3, NULL, ZS_RBF_ACCURACY, &control, bench_diag());
  const bench_span span = bench_since_together(begun, w->sum != NULL);
  zs_compiler *compiler = w->sum ? zs_compiler_new(NULL, NULL, bench_diag()) : NULL;
  if (!compiler)
    return span;
  const zs_coordinates root = zs_coordinates_root();
  zs_value u[3];
  for (int k = 0; k < 3; k++)
    u[k] = zs_emit_coordinate(compiler, &root, k);
  w->field = zs_compiler_finish(compiler,
                                zs_emit_operation(compiler, zs_rbf_sum_operation(w->sum->kernel),
                                                  w->sum, u[0], u[1], u[2]),
                                1);
  return span;
}

static zs_grid grid_of(const sum_work *w)
{
  const double cell = 2 * HALF / w->size;
  return (zs_grid){{-HALF, -HALF, -HALF + w->from * cell},
                   {cell, cell, cell},
                   {w->size, w->size, w->layers}};
}

static bool keep(void *context, uint32_t z, uint32_t count_z, const void *samples)
{
  sum_work *w = context;
  const size_t count = (size_t)count_z * w->size * w->size;
  (void)z;
  memcpy(w->next, samples, count * sizeof *w->next);
  w->next += count;
  return true;
}

static bench_span job_values(void *context)
{
  sum_work *w = context;
  const zs_grid grid = grid_of(w);
  zs_control control = bench_control(1);
  control.brute = w->brute;
  w->next = w->values;
  const bench_span begun = bench_now();
  const bool done = zs_voxelize(w->field, &grid, ZS_QUANTITY_VALUE, keep, w, NULL, &control, NULL,
                                bench_diag());
  return bench_since(begun, done);
}

static bench_span job_sum_mesh(void *context)
{
  sum_work *w = context;
  const zs_grid grid = grid_of(w);
  const zs_control control = bench_control(1);
  zs_mesh_options options;
  zs_job_report report = {.evaluations = 0};
  zs_mesh_options_init(&options);
  const bench_span begun = bench_now();
  zs_mesh *mesh = zs_polygonize(w->field, &grid, &options, &control, &report, bench_diag());
  const bench_span span = bench_since(begun, mesh != NULL);
  w->evaluations = report.evaluations;
  zs_mesh_free(mesh);
  return span;
}

static void count_brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                        const zs_program *program)
{
  (void)thread, (void)index, (void)eval, (void)program;
  atomic_fetch_add((atomic_ullong *)visitor, 1);
}

static void skip(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside)
{
  (void)visitor, (void)lo, (void)hi, (void)inside;
}

/* The part of the blocks of 16 samples along a side that bounds do not decide. */
static double undecided_part(const sum_work *w, unsigned blocks)
{
  atomic_ullong count = 0;
  const zs_control control = bench_control(1);
  const double side = 2 * HALF / blocks;
  const zs_walk walk = {.field = w->field,
                        .lo = {-HALF, -HALF, -HALF},
                        .size = {side, side, side},
                        .count = {blocks, blocks, blocks},
                        .request = ZS_REQUEST_SIGN,
                        .control = &control,
                        .stage = "count",
                        .progress_to = 1,
                        .visitor = &count,
                        .uniform = skip,
                        .brick = count_brick};
  if (!zs_walk_run(&walk, bench_diag()))
    return NAN;
  return (double)count / ((double)blocks * blocks * blocks);
}

/* What a direct sum costs: some layers across the middle. */
static bench_time measure_direct(const bench *b, const sum_work *w, double *a_value)
{
  const double samples = (double)w->size * w->size;
  sum_work layers = *w;
  layers.brute = true;
  layers.from = w->size / 2;
  /* About as many terms as a second or two are good for. */
  layers.layers = (uint32_t)fmin(4, fmax(1, 6e9 / ((double)w->rbf->count * samples)));
  const bench_time t = bench_measure(b, job_values, &layers, 0);
  *a_value = t.processor / (samples * layers.layers);
  return t;
}

/* The greatest error at some of the grid's samples where |f| <= 1: the sum's own,
 * before values and coordinates are rounded to single precision. */
static double greatest_error(const sum_work *w)
{
  enum { BLOCKS = 16, POINTS = BLOCKS * ZS_BLOCK };
  const zs_rbf_terms *terms = &w->sum->terms;
  const size_t samples = (size_t)w->size * w->size * w->size;
  const double cell = 2 * HALF / w->size;
  double point[3][ZS_BLOCK], exact[ZS_BLOCK], sum[1][ZS_BLOCK], error = 0;
  size_t near = 0, seen = 0;
  for (size_t i = 0; i < samples; i++)
    near += fabsf(w->values[i]) <= 1;
  for (size_t i = 0, n = 0; i < samples; i++) {
    if (fabsf(w->values[i]) > 1 || seen++ % (near / POINTS + 1))
      continue;
    const size_t at[3] = {i % w->size, i / w->size % w->size, i / w->size / w->size};
    for (int k = 0; k < 3; k++)
      point[k][n] = -HALF + cell * ((double)at[k] + 0.5);
    if (++n < ZS_BLOCK)
      continue;
    n = 0;
    zs_rbf_terms_values(terms, ZS_BLOCK, point, exact);
    zs_cells_select(terms->radial.kernel)
      ->evaluate(w->sum->cells, terms, ZS_BLOCK, (const double(*)[ZS_BLOCK])point, sum, false);
    for (int j = 0; j < ZS_BLOCK; j++)
      error = fmax(error, fabs(sum[0][j] - exact[j]));
  }
  return error;
}

bool bench_sum(bench *b, const zs_rbf *rbf)
{
  const unsigned size = bench_size(b, 256), count = (unsigned)rbf->count;
  const char *kernel = zs_rbf_kernel_names[rbf->radial.kernel];
  sum_work w = {.rbf = rbf, .size = size, .layers = size};
  double direct = NAN;
  w.values = malloc((size_t)size * size * size * sizeof *w.values);
  const bench_time compile = bench_measure(b, job_compile, &w, 0);
  bool good = w.values && w.field && !compile.failed;
  if (good) {
    const bench_time values = bench_measure(b, job_values, &w, BUDGET);
    const double error = greatest_error(&w);
    const bench_time brute = measure_direct(b, &w, &direct);
    const bench_time mesh = bench_measure(b, job_sum_mesh, &w, BUDGET);
    good = !values.failed && !brute.failed && !mesh.failed;
    const double samples = (double)size * size * size, blocks = undecided_part(&w, size / 8);
    const double gain = direct * samples / values.processor;
    const double mesh_gain = direct * (double)w.evaluations / mesh.processor;
    /* The surface's constraints are 0 and, inside, 1. */
    const bool close = error <= 1e-6;
    printf("sum %-11s %7u %10.1f %7.1f %9.1f %9.0f %9.0f %8.1e%s %9.1f %9.0f %8.1f\n", kernel,
           count, 1e3 * compile.processor, (double)w.sum->cells->bytes / 1e6,
           1e9 * values.processor / samples, 1e9 * direct, gain, error, close ? "" : "!",
           1e3 * mesh.processor, mesh_gain, 100 * blocks);
    bench_remember(b, 1e9 * values.processor / samples, "sum %s %u", kernel, count);
    bench_remember(b, gain, "sum %s %u gain", kernel, count);
    bench_remember(b, 1e6 * error, "sum %s %u error", kernel, count);
    bench_remember(b, mesh_gain, "sum %s %u mesh gain", kernel, count);
    bench_remember(b, 100 * blocks, "sum %s %u blocks", kernel, count);
    good = good && close;
  }
  zs_field_unref(w.field);
  zs_rbf_sum_free(w.sum);
  free(w.values);
  return good;
}

void bench_sum_header(void)
{
  printf("\n%-15s %7s %10s %7s %9s %9s %9s %8s %9s %9s %8s\n", "sums", "count", "compile ms", "MB",
         "ns/value", "ns direct", "gain", "error", "mesh ms", "gain", "blocks %");
}
