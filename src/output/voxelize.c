/* The voxelizer: samples at the cell centres of a grid, slab by slab. */
#include "base/diagnostic.h"
#include "base/memory.h"
#include "field/program.h"
#include "files/volume.h"
#include "output/grid.h"
#include "output/job.h"

#include <stdlib.h>
#include <string.h>

enum {
  BRICK = ZS_LATTICE_SIDE, /* samples along the sides of a brick */
  SLAB_BYTES = 64 << 20 /* about the size of a slab of samples */
};

/* One slab of a volume under way. */
typedef struct slab {
  const zs_grid *grid;
  zs_quantity quantity;
  uint32_t z, layers; /* its layers are z .. z + layers - 1 */
  uint32_t brick[3];  /* samples of a brick */
  void *samples;      /* float, or uint8_t when the quantity is INSIDE */
  zs_request request;
  bool prune;
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

/* The samples of a brick; `from` is its first one in the slab. */
static zs_lattice brick_lattice(const slab *s, const uint32_t index[3], uint32_t from[3])
{
  zs_lattice lattice;
  double origin[3];
  for (int k = 0; k < 3; k++) {
    from[k] = index[k] * s->brick[k];
    const uint32_t left = side(s, k) - from[k];
    lattice.count[k] = left < s->brick[k] ? left : s->brick[k];
    /* Origins stay on one lattice whatever the height of slabs, so that the
     * same sample is always rounded in the same way. */
    const uint32_t at = k == 2 ? s->z + from[k] : from[k], corner = at / BRICK * BRICK;
    origin[k] = s->grid->lo[k] + s->grid->cell[k] * corner;
    for (uint32_t i = 0; i < lattice.count[k]; i++)
      lattice.at[k][i] = ((float)(at - corner + i) + 0.5f) * (float)s->grid->cell[k];
  }
  lattice.frame = zs_frame_at(origin);
  return lattice;
}

static void store_row(const slab *s, size_t at, const float *f, uint32_t count)
{
  if (s->quantity == ZS_QUANTITY_VALUE) {
    memcpy((float *)s->samples + at, f, count * sizeof *f);
    return;
  }
  uint8_t *out = (uint8_t *)s->samples + at;
#pragma omp simd
  for (uint32_t i = 0; i < count; i++)
    out[i] = f[i] >= 0;
}

static void brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                  const zs_program *program)
{
  slab *s = visitor;
  uint32_t from[3];
  float f[ZS_LATTICE_SIDE * ZS_LATTICE_SIDE * ZS_LATTICE_SIDE];
  const zs_lattice lattice = brick_lattice(s, index, from);
  s->evaluations[thread].count +=
    zs_program_lattice(eval, program, &lattice, s->request, s->prune, f);
  for (uint32_t z = 0; z < lattice.count[2]; z++)
    for (uint32_t y = 0; y < lattice.count[1]; y++)
      store_row(s, sample_index(s, from[0], from[1] + y, from[2] + z),
                f + (z * ZS_LATTICE_SIDE + y) * ZS_LATTICE_SIDE, lattice.count[0]);
}

/* Evaluate all samples of a slab. */
static bool fill_slab(slab *s, zs_field *field, const zs_control *control, zs_diag *diag)
{
  const zs_grid *grid = s->grid;
  bool inside = s->quantity == ZS_QUANTITY_INSIDE;
  zs_walk walk = {.field = field,
                  .request = s->request,
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
    if (s->quantity == ZS_QUANTITY_INSIDE) {
      count += zs_count_odd((const uint8_t *)s->samples + z * layer, layer);
      continue;
    }
    const float *f = (const float *)s->samples + z * layer;
    uint64_t of_layer = 0;
#pragma omp simd reduction(+ : of_layer)
    for (size_t i = 0; i < layer; i++)
      of_layer += f[i] >= 0;
    count += of_layer;
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
  if (!zs_grid_check(grid, diag) || !zs_quantity_check(quantity, diag))
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
            .request = quantity == ZS_QUANTITY_INSIDE ? ZS_REQUEST_SIGN : ZS_REQUEST_VALUE,
            .prune = !j->control || !j->control->brute,
            .brick = {BRICK, BRICK, layers < BRICK ? layers : BRICK},
            .samples = zs_memory_new(layers, layer_bytes),
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
  if (!zs_grid_check(grid, diag) || !zs_quantity_check(quantity, diag))
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
