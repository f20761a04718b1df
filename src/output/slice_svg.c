/* Cross-sections as SVG files. */
#include "base/diagnostic.h"
#include "base/output.h"
#include "files/number.h"
#include "output/slice.h"

#include <stdlib.h>
#include <string.h>

/* Widths of lines in pixels, and how many of equal f there are at most on one side of 0. */
static const float ZERO_LINE = 3, LINE = 0.6F;
enum { MOST_LINES = 16 };

/* ---- Lines ------------------------------------------------------------------------------ */

/* All lines of a slice; the solid's outlines come first, and are `filled` many. */
static bool draw(zs_drawing *drawing, size_t *filled, const zs_slicer *s, zs_field *field)
{
  if (!zs_slice_outline(drawing, s, field, 0, true))
    return false;
  *filled = drawing->stroke_count;
  if (!s->values)
    return true;
  const float scale = zs_slice_scale(s->values, (size_t)s->plane.width * s->plane.height);
  if (scale < 0)
    return false;
  for (int k = -MOST_LINES; k <= MOST_LINES; k++) {
    const size_t first = drawing->stroke_count;
    const float level = (float)k * zs_slice_spacing(scale);
    if (k != 0 && fabsf(level) <= scale && !zs_slice_outline(drawing, s, field, level, false))
      return false;
    for (size_t i = first; i < drawing->stroke_count; i++) {
      drawing->strokes[i].color = (zs_color){0.4F, 0.4F, 0.42F};
      drawing->strokes[i].width = LINE;
    }
  }
  return true;
}

/* ---- The file ----------------------------------------------------------------------------- */

/* A length to a ten-thousandth of a pixel at least, in as few digits as that takes. */
static double shortened(double length, double pixel)
{
  const double per_length = pow(10, 5 - floor(log10(pixel)));
  const double rounded = round(length * per_length) / per_length;
  return isfinite(rounded) ? rounded + 0.0 : length; /* not -0 */
}

/* A place of the picture in the file's coordinates: the scene's, with y down. */
static void write_place(FILE *stream, const zs_slice_plane *plane, const double at[2])
{
  double space[3];
  char x[ZS_NUMBER_SIZE], y[ZS_NUMBER_SIZE];
  zs_slice_place(plane, at, space);
  const double right = plane->mirrored ? -space[plane->right] : space[plane->right];
  fprintf(stream, "%s %s", zs_number_format(x, shortened(right, plane->pixel)),
          zs_number_format(y, shortened(-space[plane->up], plane->pixel)));
}

static void write_stroke(FILE *stream, const zs_slice_plane *plane, const zs_drawing *drawing,
                         const zs_stroke *stroke)
{
  for (size_t i = 0; i < stroke->count; i++) {
    fputs(i ? " L" : "M", stream);
    write_place(stream, plane, drawing->points[stroke->first + i]);
  }
  fputs(stroke->closed ? "Z" : "", stream);
}

static void write_color(FILE *stream, const char *attribute, zs_color color)
{
  fprintf(stream, " %s=\"#%02x%02x%02x\"", attribute, zs_color_byte(color.r),
          zs_color_byte(color.g), zs_color_byte(color.b));
}

/* A width of so many pixels. */
static void write_width(FILE *stream, const zs_slice_plane *plane, float width)
{
  char text[ZS_NUMBER_SIZE];
  const double length = shortened((double)width * plane->pixel, plane->pixel);
  fprintf(stream, " stroke-width=\"%s\"", zs_number_format(text, length));
}

static void write_solid(FILE *stream, const zs_slice_plane *plane, const zs_drawing *drawing,
                        size_t filled, bool bold)
{
  fputs("<path", stream);
  write_color(stream, "fill", bold ? (zs_color){0.996F, 0.949F, 0.878F} : (zs_color){0, 0, 0});
  fputs(" fill-rule=\"evenodd\"", stream);
  if (bold) {
    write_color(stream, "stroke", (zs_color){0.07F, 0.07F, 0.09F});
    write_width(stream, plane, ZERO_LINE);
  }
  fputs(" d=\"", stream);
  for (size_t i = 0; i < filled; i++) {
    fputs(i ? "\n" : "", stream);
    write_stroke(stream, plane, drawing, &drawing->strokes[i]);
  }
  fputs("\"/>\n", stream);
}

static void write_lines(FILE *stream, const zs_slice_plane *plane, const zs_drawing *drawing,
                        size_t first)
{
  fputs("<g fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n", stream);
  for (size_t i = first; i < drawing->stroke_count; i++) {
    const zs_stroke *s = &drawing->strokes[i];
    fputs("<path", stream);
    write_color(stream, "stroke", s->color);
    write_width(stream, plane, s->width);
    fputs(" d=\"", stream);
    write_stroke(stream, plane, drawing, s);
    fputs("\"/>\n", stream);
  }
  fputs("</g>\n", stream);
}

static bool write_file(const char *path, const zs_slice_plane *plane, const zs_drawing *drawing,
                       size_t filled, bool bold, zs_diag *diag)
{
  zs_output output;
  char text[4][ZS_NUMBER_SIZE];
  double corner[3];
  if (!zs_output_open(&output, path, diag))
    return false;
  zs_slice_place(plane, (const double[2]){0, 0}, corner);
  const double left = plane->mirrored ? -corner[plane->right] : corner[plane->right];
  const double box[4] = {left, -corner[plane->up], plane->width * plane->pixel,
                         plane->height * plane->pixel};
  for (int k = 0; k < 4; k++)
    zs_number_format(text[k], box[k]);
  fprintf(output.stream,
          "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%s\" height=\"%s\" "
          "viewBox=\"%s %s %s %s\">\n", text[2], text[3], text[0], text[1], text[2], text[3]);
  if (filled)
    write_solid(output.stream, plane, drawing, filled, bold);
  if (drawing->stroke_count > filled)
    write_lines(output.stream, plane, drawing, filled);
  fputs("</svg>\n", output.stream);
  return zs_output_commit(&output, diag);
}

/* ---- The job ------------------------------------------------------------------------------- */

static bool run(zs_slicer *s, zs_field *field, const zs_slice_options *options, const char *path,
                const zs_control *control, zs_job_report *job, zs_diag *diag)
{
  zs_drawing drawing = {0};
  size_t filled = 0;
  const double start = zs_seconds();
  bool good = zs_slicer_sample(s, field, control, diag);
  const double sampled = zs_seconds();
  good = good && (draw(&drawing, &filled, s, field) || zs_fail_memory(diag));
  good = good && (!options->correspondence ||
                  zs_slice_correspondences(&drawing, &s->plane, field, control, diag));
  good = good && write_file(path, &s->plane, &drawing, filled, s->values, diag);
  zs_drawing_clear(&drawing);
  job->seconds_evaluate = sampled - start;
  job->seconds_assemble = zs_seconds() - sampled;
  job->evaluations = zs_counters_sum(s->evaluations, job->threads);
  return good;
}

bool zs_slice_svg(zs_field *field, const double lo[3], const double hi[3],
                  const zs_slice_options *options, const char *path, uint64_t *inside,
                  const zs_control *control, zs_job_report *report, zs_diag *diag)
{
  if (!zs_slice_options_check(lo, hi, options, diag))
    return false;
  zs_slicer s = {.plane = zs_slice_plane_of(lo, hi, options)};
  zs_job_report job = {.threads = zs_control_threads(control)};
  const uint64_t pixels = (uint64_t)options->width * options->height;
  /* Samples, and for every edge between them where lines go on, and a place. */
  job.peak_bytes = pixels * (sizeof(float) + 2 * (2 * sizeof(uint32_t) + 1 + 2 * sizeof(double)));
  bool good = zs_memory_check(control, job.peak_bytes, "the picture", diag) &&
              (zs_slicer_prepare(&s, options->quantity, job.threads) || zs_fail_memory(diag)) &&
              run(&s, field, options, path, control, &job, diag);
  if (good && inside)
    *inside = zs_slicer_inside(&s);
  if (good && report)
    *report = job;
  free(s.pixels);
  free(s.values);
  free(s.evaluations);
  return good;
}
