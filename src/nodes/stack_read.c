/* Slices from pictures and from volumes. */
#include "nodes/stack_source.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool zs_stack_is_volume(const zs_node *node)
{
  const zs_files *src = &((const struct stack *)node->parameters)->src;
  return src->count == 1 && zs_volume_is_name(src->paths[0]);
}

bool zs_stack_is_outlines(const zs_node *node)
{
  return zs_stack_is_outline(((const struct stack *)node->parameters)->src.paths[0]);
}

double zs_stack_first(const zs_node *node)
{
  const struct stack *p = node->parameters;
  return p->levels.count ? p->levels.values[0] : p->origin[2];
}

double zs_stack_height(const zs_node *node, size_t k)
{
  const struct stack *p = node->parameters;
  const size_t i = k * (size_t)p->every;
  return p->levels.count ? p->levels.values[i] - p->levels.values[0] : (double)i * p->spacing;
}

/* ---- Slices ---------------------------------------------------------------------------- */

static bool is_labelled(const zs_numbers *labels, double number)
{
  for (size_t i = 0; i < labels->count; i++)
    if (number == labels->values[i])
      return true;
  return false;
}

/* Slice `k` of a source as brightness; its level. */
static float make_picture(const zs_stack_source *source, const struct stack *p, size_t k,
                          const double *values, size_t count, float *pixels)
{
  const double level = isnan(p->level) ? 0.5 : p->level;
  const double white = source->white ? source->white[k] : 1;
  for (size_t i = 0; i < count; i++) /* what is no number is outside */
    pixels[i] = isnan(values[i])   ? 0
                : p->label.count  ? (float)is_labelled(&p->label, values[i])
                : source->white   ? (float)(values[i] / white)
                                  : (float)fmax(1 + values[i] - level, 0);
  return p->label.count ? 0.5F : source->white ? (float)level : 1;
}

static bool add_slice(zs_stack_read *read, const zs_stack_source *source, const zs_node *node,
                      size_t k, double height, zs_diag *diag)
{
  const zs_volume *v = &source->volume;
  const size_t count = (size_t)v->size[0] * v->size[1];
  double *values = malloc(count * sizeof *values);
  float *pixels = malloc(count * sizeof *pixels);
  bool done = values && pixels;
  if (done) {
    zs_volume_values(v, k * count, count, values);
    const float level = make_picture(source, node->parameters, k, values, count, pixels);
    const zs_picture picture = {v->size[0], v->size[1], pixels, level};
    done = zs_slices_add(&read->slices, &picture, height);
  }
  if (!done)
    zs_fail_memory(diag);
  free(values);
  free(pixels);
  return done;
}

/* ---- Series ---------------------------------------------------------------------------- */

const char *zs_stack_file_name(const char *path)
{
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

/* The last number in a file's name; -1 when there is none. */
static double number_in(const char *path)
{
  const char *name = zs_stack_file_name(path), *end = name + strlen(name);
  while (end > name && !isdigit((unsigned char)end[-1]))
    end--;
  const char *begin = end;
  while (begin > name && isdigit((unsigned char)begin[-1]))
    begin--;
  double number = end > begin ? 0 : -1;
  for (; begin < end; begin++)
    number = 10 * number + (*begin - '0');
  return number;
}

/* Evenly spaced slices whose names count up in equal steps, but for some: files are missing. */
static bool check_series(const zs_node *node, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  double least = INFINITY;
  for (size_t i = 1; i < p->src.count; i++) {
    const double step = number_in(p->src.paths[i]) - number_in(p->src.paths[i - 1]);
    if (!(step > 0) || number_in(p->src.paths[i - 1]) < 0)
      return true; /* they are not counted */
    least = fmin(least, step);
  }
  for (size_t i = 1; i < p->src.count; i++)
    if (number_in(p->src.paths[i]) - number_in(p->src.paths[i - 1]) > least)
      return zs_node_fail(node, diag, "src", "a file is missing between '%.80s' and '%.80s'; give "
                          "the heights of all in 'levels' if it should be",
                          zs_stack_file_name(p->src.paths[i - 1]),
                          zs_stack_file_name(p->src.paths[i]));
  return true;
}

bool zs_stack_check_levels(const zs_node *node, size_t slices, const char *what, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  return !p->levels.count || p->levels.count == slices ||
         zs_node_fail(node, diag, "levels", "there are %zu numbers, but %zu %s",
                      p->levels.count, slices, p->src.count > 1 ? "files" : what);
}

static bool read_pictures(zs_stack_read *read, const zs_stack_source *source, const zs_node *node,
                          zs_diag *diag)
{
  const struct stack *p = node->parameters;
  const zs_volume *v = &source->volume;
  if (!zs_stack_check_levels(node, source->total, "pages", diag) ||
      !zs_image_side(&read->pixel, p->pixel, source->side, node, diag))
    return false;
  for (size_t k = 0; k < v->size[2]; k++)
    if (!add_slice(read, source, node, k, zs_stack_height(node, k) / read->pixel, diag))
      return false;
  const zs_image_place place = {read->pixel, v->size[1],
                                {p->origin[0], p->origin[1], zs_stack_first(node)},
                                p->y == ZS_IMAGE_Y_DOWN};
  zs_image_matrix(&place, read->matrix);
  return true;
}

/* ---- Volumes --------------------------------------------------------------------------- */

static double column_length(const double matrix[12], int k)
{
  return hypot(hypot(matrix[k], matrix[4 + k]), matrix[8 + k]);
}

/* Slices lie straight above each other. */
static bool check_volume(const zs_volume *v, const zs_node *node, zs_diag *diag)
{
  const double *m = v->matrix;
  for (int k = 0; k < 3; k++) {
    const int l = (k + 1) % 3;
    const double dot = m[k] * m[l] + m[4 + k] * m[4 + l] + m[8 + k] * m[8 + l];
    if (!(fabs(dot) <= 1e-3 * column_length(m, k) * column_length(m, l)))
      return zs_node_fail(node, diag, "src", "the axes of the volume are not at right angles");
  }
  return true;
}

static bool read_volume(zs_stack_read *read, const zs_stack_source *source, const zs_node *node,
                        zs_diag *diag)
{
  const struct stack *p = node->parameters;
  const zs_volume *v = &source->volume;
  if (!check_volume(v, node, diag))
    return false;
  if (!zs_affine_invert(v->matrix, read->matrix))
    return zs_node_fail(node, diag, "src", "the axes of the volume lie in a plane");
  /* Slices are joined as if their pixels were square, of the same area: the solid is stretched
   * with them afterwards. */
  read->pixel = sqrt(column_length(v->matrix, 0) * column_length(v->matrix, 1));
  const double apart = column_length(v->matrix, 2) / read->pixel;
  for (size_t k = 0; k < v->size[2]; k += (size_t)p->every)
    if (!add_slice(read, source, node, k, (double)k * apart, diag))
      return false;
  for (int k = 8; k < 12; k++) /* heights are in pixels */
    read->matrix[k] *= apart;
  return true;
}

bool zs_stack_read_slices(zs_stack_read *read, zs_compiler *compiler, const zs_node *node)
{
  const struct stack *p = node->parameters;
  zs_diag *diag = zs_compiler_diag(compiler);
  const bool volume = zs_stack_is_volume(node);
  *read = (zs_stack_read){.pixel = 1};
  if (!volume && !p->levels.count && !check_series(node, diag))
    return false;
  if (zs_stack_is_outlines(node))
    return zs_stack_read_outlines(read, node, zs_compiler_control(compiler), diag);
  zs_stack_source *source = zs_stack_source_find(compiler, node);
  const bool done = source && (volume ? read_volume(read, source, node, diag)
                                      : read_pictures(read, source, node, diag));
  zs_stack_source_unref(source);
  return done;
}
