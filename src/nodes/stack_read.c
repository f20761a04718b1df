/* Slices from series of pictures, and from volumes. */
#include "nodes/stack.h"

#include "files/volume_read.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool zs_stack_is_volume(const zs_node *node)
{
  const zs_files *src = &((const struct stack *)node->parameters)->src;
  return src->count == 1 && zs_volume_is_name(src->paths[0]);
}

static double number_or(double number, double otherwise)
{
  return isnan(number) ? otherwise : number;
}

static bool add(zs_stack_read *read, const zs_picture *picture, double height, zs_diag *diag)
{
  return zs_slices_add(&read->slices, picture, height) || zs_fail_memory(diag);
}

/* ---- Series ---------------------------------------------------------------------------- */

static const char *name_of(const char *path)
{
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

/* The last number in a file's name; -1 when there is none. */
static double number_in(const char *path)
{
  const char *name = name_of(path), *end = name + strlen(name);
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
                          name_of(p->src.paths[i - 1]), name_of(p->src.paths[i]));
  return true;
}

static void keep_label(zs_gray *gray, double label)
{
  for (size_t i = 0; i < (size_t)gray->width * gray->height; i++)
    gray->pixels[i] = fabs((double)gray->pixels[i] * gray->white - label) < 0.5 ? 1 : 0;
}

static bool add_picture(zs_stack_read *read, const zs_node *node, size_t i, double height,
                        zs_diag *diag)
{
  const struct stack *p = node->parameters;
  zs_gray gray;
  if (!zs_gray_read(&gray, p->src.paths[i], diag))
    return false;
  const zs_slices *s = &read->slices;
  bool done = s->count == 0 || (s->width == gray.width + 2 * s->margin &&
                                s->height == gray.height + 2 * s->margin);
  if (!done) {
    zs_node_fail(node, diag, "src", "'%.80s' has %u x %u pixels; those before have %zu x %zu",
                 name_of(p->src.paths[i]), gray.width, gray.height, s->width - 2 * s->margin,
                 s->height - 2 * s->margin);
  } else {
    if (!isnan(p->label))
      keep_label(&gray, p->label);
    const zs_picture picture = {gray.width, gray.height, gray.pixels,
                                (float)number_or(p->level, 0.5)};
    done = add(read, &picture, height, diag);
  }
  zs_gray_clear(&gray);
  return done;
}

static bool read_series(zs_stack_read *read, const zs_node *node, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  if (!p->levels.count && !check_series(node, diag))
    return false;
  if (p->levels.count && p->levels.count != p->src.count)
    return zs_node_fail(node, diag, "levels", "there are %zu numbers, but %zu files",
                        p->levels.count, p->src.count);
  const double first = p->levels.count ? p->levels.values[0] : p->origin[2];
  for (size_t i = 0; i < p->src.count; i += (size_t)p->every) {
    const double z = p->levels.count ? p->levels.values[i] - first : (double)i * p->spacing;
    if (!add_picture(read, node, i, z / p->pixel, diag))
      return false;
  }
  const zs_slices *s = &read->slices;
  const zs_image_place place = {p->pixel, (double)(s->height - 2 * s->margin),
                                {p->origin[0], p->origin[1], first}, p->y == ZS_IMAGE_Y_DOWN};
  zs_image_matrix(&place, read->matrix);
  read->pixel = p->pixel;
  return true;
}

/* ---- Volumes --------------------------------------------------------------------------- */

static double column_length(const double matrix[12], int k)
{
  return hypot(hypot(matrix[k], matrix[4 + k]), matrix[8 + k]);
}

/* Distances are found in square pixels, and slices lie straight above each other. */
static bool check_volume(const zs_volume *v, const zs_node *node, zs_diag *diag)
{
  const double *m = v->matrix, a = column_length(m, 0), b = column_length(m, 1);
  if (!(fabs(a - b) <= 1e-3 * a))
    return zs_node_fail(node, diag, "src", "pixels have the sides %g and %g; expected square ones",
                        a, b);
  for (int k = 0; k < 3; k++) {
    const int l = (k + 1) % 3;
    const double dot = m[k] * m[l] + m[4 + k] * m[4 + l] + m[8 + k] * m[8 + l];
    if (!(fabs(dot) <= 1e-3 * column_length(m, k) * column_length(m, l)))
      return zs_node_fail(node, diag, "src", "the axes of the volume are not at right angles");
  }
  return true;
}

static bool add_slice(zs_stack_read *read, const zs_volume *v, const zs_node *node, size_t k,
                      double height, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  const size_t count = (size_t)v->size[0] * v->size[1];
  double *values = malloc(count * sizeof *values);
  float *pixels = malloc(count * sizeof *pixels);
  bool done = values && pixels;
  if (done) {
    zs_volume_values(v, k * count, count, values);
    const double level = number_or(p->level, 0.5);
    for (size_t i = 0; i < count; i++) /* what is no number is outside */
      pixels[i] = isnan(values[i])    ? 0
                  : !isnan(p->label) ? (float)(values[i] == p->label)
                                     : (float)fmax(1 + values[i] - level, 0);
    const zs_picture picture = {v->size[0], v->size[1], pixels, isnan(p->label) ? 1 : 0.5F};
    done = add(read, &picture, height, diag);
  } else {
    zs_fail_memory(diag);
  }
  free(values);
  free(pixels);
  return done;
}

static bool read_volume(zs_stack_read *read, const zs_node *node, zs_diag *diag)
{
  const struct stack *p = node->parameters;
  zs_volume v;
  if (!zs_volume_read(&v, p->src.paths[0], diag))
    return false;
  bool done = check_volume(&v, node, diag);
  if (done && !zs_affine_invert(v.matrix, read->matrix))
    done = zs_node_fail(node, diag, "src", "the axes of the volume lie in a plane");
  read->pixel = column_length(v.matrix, 0);
  const double apart = column_length(v.matrix, 2) / read->pixel;
  for (size_t k = 0; done && k < v.size[2]; k += (size_t)p->every)
    done = add_slice(read, &v, node, k, (double)k * apart, diag);
  zs_volume_clear(&v);
  for (int k = 8; k < 12; k++) /* heights are in pixels */
    read->matrix[k] *= apart;
  return done;
}

bool zs_stack_read_slices(zs_stack_read *read, const zs_node *node, zs_diag *diag)
{
  *read = (zs_stack_read){.pixel = 1};
  return zs_stack_is_volume(node) ? read_volume(read, node, diag)
                                  : read_series(read, node, diag);
}
