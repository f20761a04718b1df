/* The voxelizer: samples at the cell centres of a grid, slab by slab. */
#include "base/diagnostic.h"
#include "field/program.h"
#include "files/volume.h"
#include "output/grid.h"
#include "output/job.h"

#include <stdlib.h>
#include <string.h>

enum {
  BRICK = 16, /* samples along the sides of a brick */
  SLAB_BYTES = 64 << 20 /* about the size of a slab of samples */
};

/* One slab of a volume under way. */
typedef struct slab {
  const zs_grid *grid;
  zs_quantity quantity;
  uint32_t z, layers; /* its layers are z .. z + layers - 1 */
  uint32_t brick[3];  /* samples of a brick */
  void *samples;      /* float, or uint8_t when the quantity is INSIDE */
  zs_counter *evaluations; /* by thread */
} slab;

/* Samples along an axis of the slab. */
static uint32_t side(const slab *s, int axis)
{
  return axis == 2 ? s->layers : s->grid->count[axis];
}

/* Index of a sample of the slab. */
static size_t sample_index(const slab *s, uint32_t x, uint32_t y, uint32_t z)
{
  return ((size_t)z * s->grid->count[1] + y) * s->grid->count[0] + x;
}

static void uniform(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside)
{
  slab *s = visitor;
  uint32_t from[3], to[3];
  for (int k = 0; k < 3; k++) {
    uint64_t end = (uint64_t)hi[k] * s->brick[k];
    from[k] = lo[k] * s->brick[k];
    to[k] = end < side(s, k) ? (uint32_t)end : side(s, k);
  }
  uint8_t *samples = s->samples;
  for (uint32_t z = from[2]; z < to[2]; z++)
    for (uint32_t y = from[1]; y < to[1]; y++)
      memset(samples + sample_index(s, from[0], y, z), inside, to[0] - from[0]);
}

/* The samples of a brick, as rows along x. */
typedef struct rows {
  uint32_t lo[3], count[3]; /* of samples, in the slab */
  float first[3];           /* where sample lo is, relative to the frame */
  float cell[3];
} rows;

static rows brick_rows(const slab *s, const uint32_t index[3], zs_frame *frame)
{
  rows r;
  double origin[3];
  for (int k = 0; k < 3; k++) {
    r.lo[k] = index[k] * s->brick[k];
    uint32_t left = side(s, k) - r.lo[k];
    r.count[k] = left < s->brick[k] ? left : s->brick[k];
    /* Origins stay on one lattice whatever the height of slabs, so that the
     * same sample is always rounded in the same way. */
    uint32_t at = k == 2 ? s->z + r.lo[k] : r.lo[k], corner = at / BRICK * BRICK;
    origin[k] = s->grid->lo[k] + s->grid->cell[k] * corner;
    r.cell[k] = (float)s->grid->cell[k];
    r.first[k] = (float)(at - corner);
  }
  *frame = zs_frame_at(origin);
  return r;
}

/* Coordinates of `count` rows from row `first` on. */
static void fill_rows(const rows *r, uint32_t first, uint32_t count, float *x, float *y, float *z)
{
  for (uint32_t row = first; row < first + count; row++) {
    float at_y = (r->first[1] + (float)(row % r->count[1]) + 0.5f) * r->cell[1];
    float at_z = (r->first[2] + (float)(row / r->count[1]) + 0.5f) * r->cell[2];
    for (uint32_t i = 0; i < r->count[0]; i++) {
      *x++ = (r->first[0] + (float)i + 0.5f) * r->cell[0];
      *y++ = at_y;
      *z++ = at_z;
    }
  }
}

static void store_rows(const slab *s, const rows *r, uint32_t first, uint32_t count, const float *f)
{
  for (uint32_t row = first; row < first + count; row++, f += r->count[0]) {
    size_t at =
      sample_index(s, r->lo[0], r->lo[1] + row % r->count[1], r->lo[2] + row / r->count[1]);
    if (s->quantity == ZS_QUANTITY_VALUE) {
      memcpy((float *)s->samples + at, f, r->count[0] * sizeof *f);
      continue;
    }
    uint8_t *out = (uint8_t *)s->samples + at;
    for (uint32_t i = 0; i < r->count[0]; i++)
      out[i] = f[i] >= 0;
  }
}

static void brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                  const zs_program *program)
{
  slab *s = visitor;
  zs_frame frame;
  rows r = brick_rows(s, index, &frame);
  _Alignas(64) float x[ZS_BLOCK], y[ZS_BLOCK], z[ZS_BLOCK], f[ZS_BLOCK];
  const uint32_t all = r.count[1] * r.count[2], most = ZS_BLOCK / r.count[0];
  for (uint32_t first = 0; first < all; first += most) {
    uint32_t count = all - first < most ? all - first : most;
    fill_rows(&r, first, count, x, y, z);
    zs_program_values(eval, program, &frame, count * r.count[0], x, y, z, f);
    store_rows(s, &r, first, count, f);
  }
  s->evaluations[thread].count += (uint64_t)all * r.count[0];
}

/* Evaluate all samples of a slab. */
static bool fill_slab(slab *s, zs_field *field, const zs_control *control, zs_diag *diag)
{
  const zs_grid *grid = s->grid;
  bool inside = s->quantity == ZS_QUANTITY_INSIDE;
  zs_walk walk = {.field = field,
                  .request = inside ? ZS_REQUEST_SIGN : ZS_REQUEST_VALUE,
                  .control = control,
                  .stage = "voxels",
                  .progress_from = (double)s->z / grid->count[2],
                  .progress_to = (double)(s->z + s->layers) / grid->count[2],
                  .visitor = s,
                  .uniform = inside ? uniform : NULL,
                  .brick = brick};
  for (int k = 0; k < 3; k++) {
    walk.lo[k] = grid->lo[k] + (k == 2 ? grid->cell[k] * s->z : 0);
    walk.size[k] = grid->cell[k] * s->brick[k];
    walk.count[k] = (side(s, k) - 1) / s->brick[k] + 1;
  }
  return zs_walk_run(&walk, diag);
}

static uint64_t count_inside(const slab *s, unsigned threads)
{
  const size_t layer = (size_t)s->grid->count[0] * s->grid->count[1];
  uint64_t count = 0;
#pragma omp parallel for reduction(+ : count) num_threads(threads)
  for (uint32_t z = 0; z < s->layers; z++) {
    const uint8_t *bytes = (const uint8_t *)s->samples + z * layer;
    const float *floats = (const float *)s->samples + z * layer;
    for (size_t i = 0; i < layer; i++)
      count += s->quantity == ZS_QUANTITY_INSIDE ? bytes[i] : floats[i] >= 0;
  }
  return count;
}

/* Layers of a slab: whole bricks where they fit in the budget, else a part of
 * a brick that divides it. */
static uint32_t slab_layers(const zs_grid *grid, uint64_t layer_bytes, uint64_t budget)
{
  uint64_t layers = budget / layer_bytes;
  if (layers >= grid->count[2])
    return grid->count[2];
  if (layers >= BRICK)
    return (uint32_t)(layers / BRICK * BRICK);
  uint32_t part = BRICK / 2;
  while (part > 1 && part > layers)
    part /= 2;
  return part;
}

/* What a job is asked for and reports. */
typedef struct job {
  zs_field *field;
  zs_slab_sink *sink;
  void *context;
  const zs_control *control;
  unsigned threads;
  uint64_t inside;
  zs_job_report report;
  bool stopped; /* by the sink */
} job;

/* Slab after slab.  False after reporting, or when the sink has stopped it. */
static bool run_slabs(job *j, slab *s, uint32_t layers, zs_diag *diag)
{
  const uint32_t all = s->grid->count[2];
  for (s->z = 0; s->z < all; s->z += s->layers) {
    s->layers = all - s->z < layers ? all - s->z : layers;
    double start = zs_seconds();
    if (!fill_slab(s, j->field, j->control, diag))
      return false;
    j->inside += count_inside(s, j->threads);
    double evaluated = zs_seconds();
    j->stopped = !j->sink(j->context, s->z, s->layers, s->samples);
    j->report.seconds_evaluate += evaluated - start;
    j->report.seconds_assemble += zs_seconds() - evaluated;
    if (j->stopped)
      return false;
  }
  return true;
}

static bool run(job *j, const zs_grid *grid, zs_quantity quantity, zs_diag *diag)
{
  if (!zs_grid_check(grid, diag))
    return false;
  const uint64_t sample = quantity == ZS_QUANTITY_INSIDE ? 1 : sizeof(float);
  const uint64_t layer_bytes = sample * grid->count[0] * grid->count[1];
  if (!zs_memory_check(j->control, layer_bytes, "a layer of samples", diag))
    return false;
  uint64_t budget = SLAB_BYTES;
  if (j->control && j->control->memory_limit && j->control->memory_limit < budget)
    budget = j->control->memory_limit;
  const uint32_t layers = slab_layers(grid, layer_bytes, budget);
  j->threads = zs_control_threads(j->control);
  slab s = {.grid = grid,
            .quantity = quantity,
            .brick = {BRICK, BRICK, layers < BRICK ? layers : BRICK},
            .samples = malloc(layers * layer_bytes),
            .evaluations = zs_counters_new(j->threads)};
  bool done = s.samples && s.evaluations ? run_slabs(j, &s, layers, diag) : zs_fail_memory(diag);
  if (s.evaluations)
    j->report.evaluations = zs_counters_sum(s.evaluations, j->threads);
  j->report.peak_bytes = layers * layer_bytes;
  j->report.threads = j->threads;
  free(s.samples);
  free(s.evaluations);
  return done;
}

static void hand_back(const job *j, uint64_t *inside, zs_job_report *report)
{
  if (inside)
    *inside = j->inside;
  if (report)
    *report = j->report;
}

bool zs_voxelize(zs_field *field, const zs_grid *grid, zs_quantity quantity, zs_slab_sink *sink,
                 void *context, uint64_t *inside, const zs_control *control, zs_job_report *report,
                 zs_diag *diag)
{
  job j = {.field = field, .sink = sink, .context = context, .control = control};
  bool done = run(&j, grid, quantity, diag);
  hand_back(&j, inside, report);
  if (j.stopped)
    zs_fail(diag, ZS_CANCELLED, NULL, "stopped by the receiver of the samples");
  return done;
}

/* ---- Into a file --------------------------------------------------------------- */

typedef struct file_sink {
  zs_volume_writer writer;
  const zs_grid *grid;
  zs_quantity quantity;
} file_sink;

static bool write_slab(void *context, uint32_t z, uint32_t count_z, const void *samples)
{
  (void)z;
  file_sink *sink = context;
  size_t count = (size_t)sink->grid->count[0] * sink->grid->count[1] * count_z;
  return sink->quantity == ZS_QUANTITY_INSIDE
           ? zs_volume_write_bytes(&sink->writer, samples, count)
           : zs_volume_write_floats(&sink->writer, samples, count);
}

bool zs_voxelize_file(zs_field *field, const zs_grid *grid, zs_quantity quantity,
                      zs_sample_type type, const char *path, uint64_t *inside,
                      const zs_control *control, zs_job_report *report, zs_diag *diag)
{
  if (quantity == ZS_QUANTITY_VALUE && type != ZS_SAMPLE_F32 && type != ZS_SAMPLE_F64)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, path,
                   "values do not fit in integer samples; expected the type f32 or f64");
  if (!zs_grid_check(grid, diag))
    return false;
  file_sink sink = {.grid = grid, .quantity = quantity};
  const char *name = quantity == ZS_QUANTITY_INSIDE ? "inside" : "f";
  if (!zs_volume_open(&sink.writer, path, grid, type, name, diag))
    return false;
  job j = {.field = field, .sink = write_slab, .context = &sink, .control = control};
  bool done = run(&j, grid, quantity, diag);
  hand_back(&j, inside, report);
  /* What stops the sink is an error of the file, known to the writer. */
  if (done || j.stopped)
    return zs_volume_commit(&sink.writer, diag);
  zs_volume_discard(&sink.writer);
  return false;
}
