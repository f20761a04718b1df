/* Variational fits, beside SciPy's where it is installed, and their evaluation. */
#include "bench.h"
#include "sums.h"

#include "../files/scratch.h"
#include "rbf/fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double BUDGET = 3; /* seconds for the runs of one number */

static const unsigned sizes[] = {1000, 5000, 10000, 100000, 200000, 1000000};
enum {
  SIZES = sizeof sizes / sizeof *sizes,
  PEER_SIZES = 3, /* SciPy keeps the matrix */
  USUAL_SIZES = 4 /* the others take minutes and gigabytes: with BENCH_LARGE=1 */
};
static const zs_rbf_kernel kernels[] = {ZS_RBF_R3, ZS_RBF_R};

/* Constraints, and what became of them. */
typedef struct fit_work {
  zs_rbf_problem problem;
  double *positions, *values;
  zs_rbf *rbf; /* of the last run */
} fit_work;

/* A ball with bumps: points spread evenly over it where f is 0, and a hundredth
 * inside each of them one where f is 1. */
static bool fit_work_begin(fit_work *w, unsigned count)
{
  w->positions = malloc(3 * count * sizeof *w->positions);
  w->values = malloc(count * sizeof *w->values);
  for (unsigned i = 0; w->positions && w->values && i < count; i++) {
    const double z = 1 - (2 * (i / 2) + 1) / (double)((count + 1) / 2), r = sqrt(1 - z * z);
    const double angle = 2.399963229728653 * (i / 2), x = r * cos(angle), y = r * sin(angle);
    const double radius = 0.4 + 0.06 * sin(5 * x) * cos(4 * y) + 0.04 * sin(7 * z) - 0.01 * (i % 2);
    w->positions[3 * i] = radius * x;
    w->positions[3 * i + 1] = radius * y;
    w->positions[3 * i + 2] = radius * z;
    w->values[i] = i % 2;
  }
  w->problem = (zs_rbf_problem){
    .dimension = 3, .count = count, .positions = w->positions, .values = w->values};
  return w->positions && w->values;
}

static void fit_work_end(fit_work *w)
{
  free(w->positions);
  free(w->values);
  zs_rbf_free(w->rbf);
}

static bench_span job_fit(void *context)
{
  fit_work *w = context;
  const zs_control control = bench_control(0);
  zs_rbf_free(w->rbf);
  bench_spread_threads();
  const bench_span begun = bench_now();
  w->rbf = zs_rbf_fit(&w->problem, &control, NULL, bench_diag());
  return bench_since_together(begun, w->rbf != NULL);
}

static bool write_file(const char *path, const fit_work *w)
{
  FILE *file = fopen(path, "wb");
  if (!file)
    return false;
  const size_t n = w->problem.count;
  const bool written = fwrite(w->positions, sizeof(double), 3 * n, file) == 3 * n &&
                       fwrite(w->values, sizeof(double), n, file) == n;
  return !fclose(file) && written;
}

/* Seconds that SciPy takes for the same; 0 when it is not there. */
static double ask_scipy(const fit_work *w, scratch *folder)
{
  char command[4096], line[128];
  double seconds = 0;
  const char *path = scratch_path(folder, "fit.raw");
  if (!write_file(path, w))
    return 0;
  snprintf(command, sizeof command, "'%s' '%s/tests/bench/peer_scipy.py' '%s' %zu %s 2>/dev/null",
           bench_environment("BENCH_PYTHON", "/usr/bin/python3"),
           bench_environment("top_srcdir", "."), path, w->problem.count,
           w->problem.kernel == ZS_RBF_R3 ? "cubic" : "linear");
  FILE *pipe = popen(command, "r");
  while (pipe && fgets(line, sizeof line, pipe))
    if (sscanf(line, "scipy %lf", &seconds) != 1)
      seconds = 0;
  if (pipe)
    pclose(pipe);
  return seconds;
}

static bool row(bench *b, fit_work *w, double theirs, double *before)
{
  const char *kernel = zs_rbf_kernel_names[w->problem.kernel];
  const unsigned count = (unsigned)w->problem.count;
  char growth[16], gain[16];
  const bench_time t = bench_measure(b, job_fit, w, BUDGET);
  const double residual = w->rbf ? w->rbf->residual : INFINITY;
  const bool good = !t.failed && residual <= 1e-5;
  printf("fit %-11s %7u %10.1f %10.1f %4u %9s %9.1e%s %-9s", kernel, count, 1e3 * t.processor,
         1e3 * t.wall, t.runs, bench_ratio(growth, *before > 0 ? t.processor / *before : 0, ""),
         residual, good ? "" : "!", w->rbf ? w->rbf->method : "");
  if (theirs > 0)
    printf(" %10.1f %9s", 1e3 * theirs, bench_ratio(gain, theirs / t.wall, ""));
  printf("\n");
  bench_remember(b, t.processor, "fit %s %u", kernel, count);
  bench_remember(b, 1e6 * residual, "fit %s %u residual", kernel, count);
  if (theirs > 0)
    bench_remember(b, theirs / t.wall, "fit %s %u gain", kernel, count);
  *before = t.processor;
  return good;
}

/* The fits of one kernel; what is to be evaluated is left in `works`. */
static bool run_fits(bench *b, zs_rbf_kernel kernel, scratch *folder, fit_work works[SIZES],
                     unsigned count)
{
  bool good = true;
  double before = 0;
  printf("\n%-15s %7s %10s %10s %4s %9s %9s %-9s %10s %9s\n", "fits", "count", "ms", "clock ms",
         "runs", "growth", "residual", "method", "SciPy ms", "gain");
  for (unsigned i = 0; i < count && good; i++) {
    fit_work *w = &works[i];
    good = fit_work_begin(w, bench_parts(b, sizes[i]));
    w->problem.kernel = kernel;
    if (good)
      good = row(b, w, i < PEER_SIZES ? ask_scipy(w, folder) : 0, &before);
  }
  return good;
}

/* Their evaluation, at every tenfold number. */
static bool run_sums(bench *b, const fit_work works[SIZES], unsigned count)
{
  bool good = true;
  bench_sum_header();
  for (unsigned i = 0; i < count && good; i++)
    if (sizes[i] != 5000 && works[i].rbf)
      good = bench_sum(b, works[i].rbf);
  return good;
}

void bench_fits(bench *b)
{
  const unsigned count = atoi(bench_environment("BENCH_LARGE", "0")) ? SIZES : USUAL_SIZES;
  scratch folder = {.folder = ""};
  for (size_t k = 0; k < sizeof kernels / sizeof *kernels; k++) {
    const char *name = zs_rbf_kernel_names[kernels[k]];
    const bool sums = bench_wants(b, "sum %s", name);
    if (!sums && !bench_wants(b, "fit %s", name))
      continue;
    if (!*folder.folder && !scratch_make(&folder)) {
      fprintf(stderr, "bench: no files can be written here\n");
      b->wrong = true;
      return;
    }
    fit_work works[SIZES] = {{.rbf = NULL}};
    const bool good = run_fits(b, kernels[k], &folder, works, count) &&
                      (!sums || run_sums(b, works, count));
    for (unsigned i = 0; i < SIZES; i++)
      fit_work_end(&works[i]);
    if (!good)
      b->wrong = true;
  }
  if (*folder.folder)
    scratch_remove(&folder);
}
