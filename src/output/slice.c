/* Cross-sections as pictures. */
#include "base/diagnostic.h"
#include "field/program.h"
#include "files/image.h"
#include "output/color.h"
#include "output/slice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

float zs_slice_scale(const float *values, size_t n)
{
  const float scale = magnitude(values, n, COLOURED);
  return scale < 0 ? scale : fmaxf(scale, SMALLEST_SCALE);
}

float zs_slice_spacing(float scale)
{
  return scale < 0 ? 1 : (float)nice((double)scale / LINES);
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
static void paint_row(const zs_slice_plane *p, const float *values, uint32_t row, float scale,
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
static bool paint(const zs_slice_plane *p, const float *values, uint8_t *pixels, unsigned threads,
                  zs_diag *diag)
{
  const size_t n = (size_t)p->width * p->height;
  const float scale = zs_slice_scale(values, n), spacing = zs_slice_spacing(scale);
  if (scale < 0)
    return zs_fail_memory(diag);
  memset(pixels, PAPER, 3 * n);
#pragma omp parallel for num_threads(threads)
  for (uint32_t row = 0; row < p->count[1]; row++)
    paint_row(p, values, row, scale, spacing, pixels);
  return true;
}

/* ---- The job --------------------------------------------------------------------- */

static bool overlay(const zs_slicer *s, zs_field *field, zs_image *image, const zs_control *control,
                    zs_diag *diag)
{
  zs_drawing drawing = {0};
  const bool good = zs_slice_correspondences(&drawing, &s->plane, field, control, diag) &&
                    (zs_drawing_paint(&drawing, image) || zs_fail_memory(diag));
  zs_drawing_clear(&drawing);
  return good;
}

/* Sample and paint into an image that is allocated. */
static bool run(zs_slicer *s, zs_field *field, const zs_slice_options *options, zs_image *image,
                const zs_control *control, zs_job_report *report, zs_diag *diag)
{
  double start = zs_seconds();
  if (!zs_slicer_sample(s, field, control, diag))
    return false;
  double sampled = zs_seconds();
  if (s->values && !paint(&s->plane, s->values, image->pixels, report->threads, diag))
    return false;
  if (options->correspondence && !overlay(s, field, image, control, diag))
    return false;
  report->seconds_evaluate = sampled - start;
  report->seconds_assemble = zs_seconds() - sampled;
  report->evaluations = zs_counters_sum(s->evaluations, report->threads);
  return true;
}

bool zs_slice(zs_field *field, const double lo[3], const double hi[3],
              const zs_slice_options *options, zs_image *image, uint64_t *inside,
              const zs_control *control, zs_job_report *report, zs_diag *diag)
{
  *image = (zs_image){0};
  if (!zs_slice_options_check(lo, hi, options, diag))
    return false;
  zs_slicer s = {.plane = zs_slice_plane_of(lo, hi, options)};
  zs_job_report job = {.threads = zs_control_threads(control)};
  const bool coloured = options->quantity == ZS_QUANTITY_VALUE;
  if (options->correspondence && !coloured)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, NULL,
                   "arrows are drawn over values; expected quantity VALUE, or an SVG file");
  job.peak_bytes =
    (uint64_t)options->width * options->height * (coloured ? 3 + sizeof(float) : 1);
  bool done = zs_memory_check(control, job.peak_bytes, "the picture", diag) &&
              (zs_slicer_prepare(&s, options->quantity, job.threads) || zs_fail_memory(diag)) &&
              (!coloured || zs_image_allocate(image, options->width, options->height, 3, diag)) &&
              run(&s, field, options, image, control, &job, diag);
  if (done && inside)
    *inside = zs_slicer_inside(&s);
  if (done && !coloured) {
    *image = (zs_image){options->width, options->height, 1, s.pixels};
    s.pixels = NULL;
  }
  if (done && report)
    *report = job;
  if (!done)
    zs_image_clear(image);
  free(s.values);
  free(s.pixels);
  free(s.evaluations);
  return done;
}
