/* Cross-sections as pictures. */
#include "base/diagnostic.h"
#include "field/program.h"
#include "files/image.h"
#include "output/color.h"
#include "output/grid.h"
#include "output/job.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = ZS_LATTICE_SIDE /* pixels along the sides of a brick */ };

/* Where the pixels of the picture are.  Cells (i, j) count from the box's low
 * corner along the two axes of the plane; the picture shows them turned. */
typedef struct plane {
  int axis, right, up; /* of space */
  bool mirrored;       /* the picture's right is the axis' low end */
  double at, pixel;
  double lo[2];        /* corner of cell (0, 0) */
  uint32_t count[2];   /* cells, those in the box only */
  uint32_t column, row; /* the top left pixel of those that show cells */
  uint32_t width, height;
} plane;

/* A slice under way. */
typedef struct slicer {
  plane plane;
  float *values;   /* by pixel, NaN outside the box; NULL for INSIDE */
  uint8_t *pixels; /* by pixel; NULL for VALUE */
  zs_counter *evaluations; /* by thread */
} slicer;

void zs_slice_options_init(zs_slice_options *options)
{
  *options = (zs_slice_options){.width = 1024, .height = 1024, .axis = 2};
}

/* Cells of one axis: the pixels whose centres are in lo..hi, when `pixels` of
 * them are centred on it.  Returns the number of pixels before them. */
static uint32_t plane_side(plane *p, int side, double lo, double hi, uint32_t pixels)
{
  double middle = pixels * 0.5, half = (hi - lo) / (2 * p->pixel);
  double first = ceil(middle - half - 0.5 - 1e-9), last = floor(middle + half - 0.5 + 1e-9);
  first = fmin(fmax(first, 0), pixels - 1.0);
  last = fmin(fmax(last, first), pixels - 1.0);
  p->count[side] = (uint32_t)(last - first) + 1;
  p->lo[side] = (lo + hi) / 2 + (first - middle) * p->pixel;
  return (uint32_t)first;
}

static plane plane_of(const double lo[3], const double hi[3], const zs_slice_options *options)
{
  static const int rights[3] = {1, 0, 0}, ups[3] = {2, 2, 1};
  plane p = {.axis = options->axis,
             .right = rights[options->axis],
             .up = ups[options->axis],
             .mirrored = options->axis == 1,
             .at = options->at,
             .width = options->width,
             .height = options->height};
  p.pixel = fmax((hi[p.right] - lo[p.right]) / p.width, (hi[p.up] - lo[p.up]) / p.height);
  uint32_t before = plane_side(&p, 0, lo[p.right], hi[p.right], p.width);
  p.column = p.mirrored ? p.width - before - p.count[0] : before;
  before = plane_side(&p, 1, lo[p.up], hi[p.up], p.height);
  p.row = p.height - before - p.count[1];
  return p;
}

/* Index of the leftmost pixel of those that show `count` cells from (i, j) on. */
static size_t pixel_index(const plane *p, uint32_t i, uint32_t j, uint32_t count)
{
  size_t column = p->column + (p->mirrored ? p->count[0] - i - count : i);
  size_t row = p->row + (p->count[1] - 1 - j);
  return row * p->width + column;
}

static uint32_t smaller(uint32_t a, uint32_t b)
{
  return a < b ? a : b;
}

static void uniform(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside)
{
  slicer *s = visitor;
  const plane *p = &s->plane;
  const uint32_t i = lo[p->right] * BRICK, count = smaller(hi[p->right] * BRICK, p->count[0]) - i;
  const uint32_t end = smaller(hi[p->up] * BRICK, p->count[1]);
  for (uint32_t j = lo[p->up] * BRICK; j < end; j++)
    memset(s->pixels + pixel_index(p, i, j, count), inside ? 255 : 0, count);
}

/* A row of cells into its pixels; their values are `stride` apart. */
static void store_row(const slicer *s, uint32_t i, uint32_t j, uint32_t count, const float *f,
                      size_t stride)
{
  const size_t at = pixel_index(&s->plane, i, j, count);
  float turned[BRICK];
  const float *row = f;
  if (s->plane.mirrored || stride != 1) {
    for (uint32_t k = 0; k < count; k++)
      turned[s->plane.mirrored ? count - 1 - k : k] = f[k * stride];
    row = turned;
  }
  if (s->values) {
    memcpy(s->values + at, row, count * sizeof *row);
    return;
  }
  uint8_t *pixels = s->pixels + at;
#pragma omp simd
  for (uint32_t k = 0; k < count; k++)
    pixels[k] = row[k] >= 0 ? 255 : 0;
}

static void brick(void *visitor, unsigned thread, const uint32_t index[3], zs_eval *eval,
                  const zs_program *program)
{
  static const size_t stride[3] = {1, ZS_LATTICE_SIDE, ZS_LATTICE_SIDE * ZS_LATTICE_SIDE};
  slicer *s = visitor;
  const plane *p = &s->plane;
  const int axis[2] = {p->right, p->up};
  const float pixel = (float)p->pixel;
  zs_lattice lattice;
  double origin[3];
  uint32_t from[2];
  origin[p->axis] = p->at;
  lattice.count[p->axis] = 1;
  lattice.at[p->axis][0] = 0;
  for (int k = 0; k < 2; k++) {
    from[k] = index[axis[k]] * BRICK;
    origin[axis[k]] = p->lo[k] + p->pixel * from[k];
    lattice.count[axis[k]] = smaller(BRICK, p->count[k] - from[k]);
    for (unsigned i = 0; i < BRICK; i++)
      lattice.at[axis[k]][i] = ((float)i + 0.5f) * pixel;
  }
  lattice.frame = zs_frame_at(origin);
  float f[ZS_LATTICE_SIDE * ZS_LATTICE_SIDE * ZS_LATTICE_SIDE];
  s->evaluations[thread].count +=
    zs_program_lattice(eval, program, &lattice, ZS_REQUEST_VALUE, false, f);
  for (uint32_t j = 0; j < lattice.count[p->up]; j++)
    store_row(s, from[0], from[1] + j, lattice.count[p->right], f + j * stride[p->up],
              stride[p->right]);
}

static bool sample(slicer *s, zs_field *field, const zs_control *control, zs_diag *diag)
{
  const plane *p = &s->plane;
  zs_walk walk = {.field = field,
                  .request = s->values ? ZS_REQUEST_VALUE : ZS_REQUEST_SIGN,
                  .control = control,
                  .stage = "slice",
                  .progress_to = 1,
                  .visitor = s,
                  .uniform = s->values ? NULL : uniform,
                  .brick = brick};
  walk.lo[p->axis] = p->at;
  walk.size[p->axis] = 0;
  walk.count[p->axis] = 1;
  walk.lo[p->right] = p->lo[0];
  walk.lo[p->up] = p->lo[1];
  walk.size[p->right] = walk.size[p->up] = p->pixel * BRICK;
  walk.count[p->right] = (p->count[0] - 1) / BRICK + 1;
  walk.count[p->up] = (p->count[1] - 1) / BRICK + 1;
  return zs_walk_run(&walk, diag);
}

/* ---- The field as colours ------------------------------------------------------ */

/* Widths of contour lines in pixels, and how far apart they must be. */
static const float ZERO_LINE = 3, LINE = 1, CLOSEST = 3, COMFORTABLE = 8;

/* About how many contour lines a picture has on one side of zero. */
static const double LINES = 8;

/* Colours of pixels outside the box, and the least |f| that colours are for. */
enum { PAPER = 245 };
static const float SMALLEST_SCALE = 1e-30f;

/* Part of the pixels that the colours distinguish; beyond, they saturate. */
static const double COLOURED = 0.98;

/* A value that this part of the finite |f| does not exceed, from the upper
 * bits of the numbers: positive floats are ordered like integers. */
static float magnitude(const float *values, size_t n, double part)
{
  enum { SHIFT = 16, BINS = 1 << (31 - SHIFT) };
  uint32_t *bins = calloc(BINS, sizeof *bins);
  if (!bins)
    return -1;
  size_t finite = 0;
  for (size_t i = 0; i < n; i++) {
    float size = fabsf(values[i]);
    uint32_t bits;
    memcpy(&bits, &size, sizeof bits);
    if (isfinite(size)) {
      bins[bits >> SHIFT]++;
      finite++;
    }
  }
  size_t below = 0;
  uint32_t bin = 0;
  while (bin < BINS - 1 && (double)(below += bins[bin]) < part * (double)finite)
    bin++;
  free(bins);
  uint32_t bits = ((bin + 1) << SHIFT) - 1; /* the bin's upper end */
  float size;
  memcpy(&size, &bits, sizeof size);
  return isfinite(size) ? size : 1;
}

/* 1, 2 or 5 times a power of ten, at least `least`. */
static double nice(double least)
{
  double power = pow(10, floor(log10(least)));
  for (int i = 0; i < 3; i++) {
    static const double steps[3] = {1, 2, 5};
    if (steps[i] * power >= least * (1 - 1e-9))
      return steps[i] * power;
  }
  return 10 * power;
}

/* A palette of three colours from 0 to 1. */
static zs_color palette(const zs_color stops[3], float t)
{
  return t < 0.5f ? zs_color_mix(stops[0], stops[1], 2 * t)
                  : zs_color_mix(stops[1], stops[2], 2 * t - 1);
}

static zs_color value_color(float f, float scale)
{
  static const zs_color inside[3] = {
    {0.996f, 0.949f, 0.878f}, {0.957f, 0.690f, 0.404f}, {0.690f, 0.247f, 0.157f}};
  static const zs_color outside[3] = {
    {0.925f, 0.957f, 0.984f}, {0.533f, 0.714f, 0.859f}, {0.122f, 0.318f, 0.557f}};
  float t = fminf(fabsf(f) / scale, 1);
  return palette(f >= 0 ? inside : outside, t);
}

/* Difference of f along a row or column (`stride` apart), per pixel: the
 * steeper side's, so that lines do not swell at kinks. */
static float slope(const float *values, size_t at, size_t stride, bool before, bool after)
{
  float lower = before ? fabsf(values[at] - values[at - stride]) : 0;
  float upper = after ? fabsf(values[at + stride] - values[at]) : 0;
  return fmaxf(lower, upper); /* of a number and NaN, the number */
}

/* How much of a pixel a line of some width covers whose middle is `distance`
 * pixels away. */
static float coverage(float distance, float width)
{
  return fminf(fmaxf(width / 2 + 0.5f - distance, 0), fminf(width, 1));
}

/* How dark the contour lines make a pixel, 0 to 1. */
static float line_darkness(float f, float gradient, float spacing)
{
  float zero = coverage(fabsf(f) / gradient, ZERO_LINE);
  float apart = spacing / gradient;
  float fade = fminf(fmaxf((apart - CLOSEST) / (COMFORTABLE - CLOSEST), 0), 1);
  float nearest = fabsf(f - spacing * rintf(f / spacing));
  return fmaxf(zero, 0.45f * fade * coverage(nearest / gradient, LINE));
}

/* Paint a row of pixels, counted from the first that shows cells. */
static void paint_row(const plane *p, const float *values, uint32_t row, float scale,
                      float spacing, uint8_t *pixels)
{
  static const zs_color unknown = {0.55f, 0.55f, 0.55f}, ink = {0.07f, 0.07f, 0.09f};
  size_t at = (size_t)(p->row + row) * p->width + p->column;
  for (uint32_t column = 0; column < p->count[0]; column++, at++) {
    float f = values[at];
    zs_color color = unknown;
    if (!isnan(f)) {
      float across = slope(values, at, 1, column > 0, column + 1 < p->count[0]);
      float along = slope(values, at, p->width, row > 0, row + 1 < p->count[1]);
      float gradient = hypotf(across, along);
      color = value_color(f, scale);
      if (gradient > 0)
        color = zs_color_mix(color, ink, line_darkness(f, gradient, spacing));
    }
    zs_color_store(color, pixels + 3 * at);
  }
}

/* Paint all values; what is outside the box is paper. */
static bool paint(const plane *p, const float *values, uint8_t *pixels, unsigned threads,
                  zs_diag *diag)
{
  const size_t n = (size_t)p->width * p->height;
  float scale = magnitude(values, n, COLOURED);
  if (scale < 0)
    return zs_fail_memory(diag);
  scale = fmaxf(scale, SMALLEST_SCALE);
  float spacing = (float)nice((double)scale / LINES);
  memset(pixels, PAPER, 3 * n);
#pragma omp parallel for num_threads(threads)
  for (uint32_t row = 0; row < p->count[1]; row++)
    paint_row(p, values, row, scale, spacing, pixels);
  return true;
}

/* ---- The job --------------------------------------------------------------------- */

static bool options_check(const double lo[3], const double hi[3], const zs_slice_options *options,
                          zs_diag *diag)
{
  static const char axes[] = "xyz";
  if (options->axis < 0 || options->axis > 2)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL, "the axis is %d; expected 0, 1 or 2",
                   options->axis);
  if (!zs_image_size_check(options->width, options->height, diag) || !zs_box_check(lo, hi, diag))
    return false;
  const int axis = options->axis;
  if (!(options->at >= lo[axis] && options->at <= hi[axis]))
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "the slice at %c = %g misses the box, which goes from %g to %g", axes[axis],
                   options->at, lo[axis], hi[axis]);
  return true;
}

static uint64_t count_inside(const slicer *s)
{
  const size_t n = (size_t)s->plane.width * s->plane.height;
  if (!s->values)
    return zs_count_odd(s->pixels, n);
  uint64_t count = 0;
  for (size_t i = 0; i < n; i++)
    count += s->values[i] >= 0;
  return count;
}

/* Sample and paint into an image that is allocated. */
static bool run(slicer *s, zs_field *field, zs_image *image, const zs_control *control,
                zs_job_report *report, zs_diag *diag)
{
  double start = zs_seconds();
  if (!sample(s, field, control, diag))
    return false;
  double sampled = zs_seconds();
  if (s->values && !paint(&s->plane, s->values, image->pixels, report->threads, diag))
    return false;
  report->seconds_evaluate = sampled - start;
  report->seconds_assemble = zs_seconds() - sampled;
  report->evaluations = zs_counters_sum(s->evaluations, report->threads);
  return true;
}

/* The buffers of a slice; false after reporting. */
static bool prepare(slicer *s, zs_quantity quantity, zs_image *image, unsigned threads,
                    zs_diag *diag)
{
  const plane *p = &s->plane;
  const size_t n = (size_t)p->width * p->height;
  const bool coloured = quantity == ZS_QUANTITY_VALUE;
  s->evaluations = zs_counters_new(threads);
  s->values = coloured ? malloc(n * sizeof *s->values) : NULL;
  if (!s->evaluations || (coloured && !s->values))
    return zs_fail_memory(diag);
  for (size_t i = 0; coloured && i < n; i++)
    s->values[i] = NAN;
  if (!zs_image_allocate(image, p->width, p->height, coloured ? 3 : 1, diag))
    return false;
  s->pixels = coloured ? NULL : image->pixels;
  return true;
}

bool zs_slice(zs_field *field, const double lo[3], const double hi[3],
              const zs_slice_options *options, zs_image *image, uint64_t *inside,
              const zs_control *control, zs_job_report *report, zs_diag *diag)
{
  *image = (zs_image){0};
  if (!options_check(lo, hi, options, diag))
    return false;
  slicer s = {.plane = plane_of(lo, hi, options)};
  zs_job_report job = {.threads = zs_control_threads(control)};
  const bool coloured = options->quantity == ZS_QUANTITY_VALUE;
  job.peak_bytes =
    (uint64_t)options->width * options->height * (coloured ? 3 + sizeof(float) : 1);
  bool done = zs_memory_check(control, job.peak_bytes, "the picture", diag) &&
              prepare(&s, options->quantity, image, job.threads, diag) &&
              run(&s, field, image, control, &job, diag);
  if (done && inside)
    *inside = count_inside(&s);
  if (done && report)
    *report = job;
  if (!done)
    zs_image_clear(image);
  free(s.values);
  free(s.evaluations);
  return done;
}
