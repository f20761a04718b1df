#include "jobs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double BRUTE_BUDGET = 0.5; /* seconds */

bool work_begin(work *w, zs_field *field, unsigned size, unsigned threads)
{
  double lo[3], hi[3];
  *w = (work){.field = field, .control = bench_control(threads)};
  return zs_field_box(field, lo, hi, bench_diag()) &&
         zs_grid_fit(&w->grid, lo, hi, size, bench_diag());
}

static uint64_t layer_samples(const zs_grid *grid)
{
  return (uint64_t)grid->count[0] * grid->count[1];
}

typedef struct sink {
  unsigned char *samples;
  size_t layer_bytes;
} sink;

static bool store(void *context, uint32_t z, uint32_t count, const void *samples)
{
  const sink *s = context;
  if (s->samples)
    memcpy(s->samples + z * s->layer_bytes, samples, count * s->layer_bytes);
  return true;
}

static size_t sample_bytes(zs_quantity quantity)
{
  return quantity == ZS_QUANTITY_VALUE ? sizeof(float) : 1;
}

static bench_span voxels(work *w, zs_quantity quantity)
{
  zs_job_report report = {0};
  sink s = {w->samples, layer_samples(&w->grid) * sample_bytes(quantity)};
  bench_span begun = bench_now();
  bool done = zs_voxelize(w->field, &w->grid, quantity, store, &s, &w->answer, &w->control,
                          &report, bench_diag());
  bench_span taken = bench_since(begun, done);
  w->evaluations = report.evaluations;
  return taken;
}

bench_span job_occupancy(void *context)
{
  return voxels(context, ZS_QUANTITY_INSIDE);
}

bench_span job_values(void *context)
{
  return voxels(context, ZS_QUANTITY_VALUE);
}

static bench_span timed_mesh(work *w, bool cap, bool creases)
{
  zs_job_report report = {0};
  zs_mesh_options options;
  zs_mesh_options_init(&options);
  options.cap = cap;
  options.creases = creases;
  bench_span begun = bench_now();
  zs_mesh *m = zs_polygonize(w->field, &w->grid, &options, &w->control, &report, bench_diag());
  bench_span taken = bench_since(begun, m != NULL);
  w->evaluations = report.evaluations;
  w->answer = m ? zs_mesh_triangle_count(m) : 0;
  zs_mesh_free(m);
  return taken;
}

bench_span job_mesh(void *context)
{
  return timed_mesh(context, true, true);
}

/* What cuts sharp edges off, as peers do. */
bench_span job_cut_mesh(void *context)
{
  return timed_mesh(context, true, false);
}

/* A part of a box has faces that are no faces of the solid. */
static bench_span job_open_mesh(void *context)
{
  return timed_mesh(context, false, true);
}

static uint64_t hash(const zs_image *image)
{
  uint64_t h = UINT64_C(0xcbf29ce484222325);
  size_t n = (size_t)image->width * image->height * image->channels;
  for (size_t i = 0; i < n; i++)
    h = (h ^ image->pixels[i]) * UINT64_C(0x100000001b3);
  return h;
}

bench_span job_picture(void *context)
{
  work *w = context;
  const zs_grid *grid = &w->grid;
  double hi[3];
  for (int k = 0; k < 3; k++)
    hi[k] = grid->lo[k] + grid->cell[k] * grid->count[k];
  zs_image image = {0};
  zs_slice_options options;
  zs_job_report report = {0};
  zs_slice_options_init(&options);
  options.width = options.height = grid->count[0];
  options.quantity = ZS_QUANTITY_INSIDE;
  bench_span begun = bench_now();
  bool done = zs_slice(w->field, grid->lo, hi, &options, &image, NULL, &w->control, &report,
                       bench_diag());
  bench_span taken = bench_since(begun, done);
  w->evaluations = report.evaluations;
  w->answer = done ? hash(&image) : 0;
  zs_image_clear(&image);
  return taken;
}

/* ---- By brute force -------------------------------------------------------------- */

/* Layers in the middle.  They begin where bricks do, so that both ways round
 * the coordinates alike. */
static work middle_layers(const work *whole, uint32_t layers)
{
  enum { BRICK = 16 };
  work w = *whole;
  uint32_t from = (w.grid.count[2] - layers) / 2 / BRICK * BRICK;
  w.grid.lo[2] += w.grid.cell[2] * from;
  w.grid.count[2] = layers;
  return w;
}

static bool same_values(const float *a, const float *b, size_t n)
{
  for (size_t i = 0; i < n; i++)
    if (!(fabsf(a[i] - b[i]) <= 1e-6f * fmaxf(1, fabsf(b[i]))))
      return false;
  return true;
}

/* Whether the part has the same samples when it is done as usual. */
static bool same_samples(work *part, zs_quantity quantity)
{
  size_t n = layer_samples(&part->grid) * part->grid.count[2], bytes = n * sample_bytes(quantity);
  void *brute_samples = part->samples, *samples = malloc(bytes);
  part->samples = samples;
  part->control.brute = false;
  bool same = samples && !voxels(part, quantity).failed &&
              (quantity == ZS_QUANTITY_VALUE ? same_values(samples, brute_samples, n)
                                             : !memcmp(samples, brute_samples, bytes));
  part->samples = brute_samples;
  free(samples);
  return same;
}

brute brute_voxels(const bench *b, const work *whole, zs_quantity quantity, double seconds)
{
  bench_job *job = quantity == ZS_QUANTITY_VALUE ? job_values : job_occupancy;
  const uint32_t all = whole->grid.count[2];
  work part = middle_layers(whole, 1);
  part.control.brute = true;
  bench_span layer = job(&part);
  uint32_t layers = (uint32_t)fmin(fmax(1, BRUTE_BUDGET / BENCH_REPEATS / layer.wall), all);
  part = middle_layers(whole, layers);
  part.control.brute = true;
  part.samples = malloc(layer_samples(&part.grid) * layers * sample_bytes(quantity));
  brute result = {0};
  bench_time time = {.failed = true};
  if (part.samples && !layer.failed)
    time = bench_measure(b, job, &part, BRUTE_BUDGET);
  if (!time.failed) {
    result.gain = time.processor / layers * all / seconds;
    result.same = same_samples(&part, quantity);
  }
  free(part.samples);
  return result;
}

brute brute_mesh(const bench *b, const work *whole)
{
  work part = *whole;
  for (int k = 0; k < 3; k++)
    part.grid.count[k] = (part.grid.count[k] + 1) / 2;
  bench_time usual = bench_measure(b, job_open_mesh, &part, BRUTE_BUDGET);
  uint64_t triangles = part.answer;
  part.control.brute = true;
  bench_time time = bench_measure(b, job_open_mesh, &part, BRUTE_BUDGET);
  if (usual.failed || time.failed)
    return (brute){0};
  return (brute){time.processor / usual.processor, part.answer == triangles};
}

brute brute_picture(const bench *b, const work *whole, double seconds)
{
  work w = *whole;
  w.control.brute = true;
  bench_time time = bench_measure(b, job_picture, &w, BRUTE_BUDGET);
  if (time.failed)
    return (brute){0};
  return (brute){time.processor / seconds, w.answer == whole->answer};
}
