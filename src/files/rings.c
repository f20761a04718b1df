#include "files/rings.h"

#include "base/array.h"
#include "files/text_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

void zs_rings_clear(zs_rings *rings)
{
  free(rings->points);
  free(rings->ends);
  *rings = (zs_rings){0};
}

bool zs_rings_add_point(zs_rings *rings, const double point[2])
{
  double *points = zs_array_grown(rings->points, rings->point_count + 1, &rings->point_capacity,
                                  2 * sizeof *points);
  if (!points)
    return false;
  rings->points = points;
  memcpy(points + 2 * rings->point_count++, point, 2 * sizeof *point);
  return true;
}

bool zs_rings_end(zs_rings *rings)
{
  const size_t begin = rings->ring_count ? rings->ends[rings->ring_count - 1] : 0;
  const double *first = rings->points + 2 * begin;
  if (rings->point_count > begin + 1 &&
      !memcmp(first, rings->points + 2 * (rings->point_count - 1), 2 * sizeof *first))
    rings->point_count--;
  if (rings->point_count == begin)
    return true;
  size_t *ends =
    zs_array_grown(rings->ends, rings->ring_count + 1, &rings->ring_capacity, sizeof *ends);
  if (!ends)
    return false;
  rings->ends = ends;
  ends[rings->ring_count++] = rings->point_count;
  return true;
}

/* A line of two numbers. */
static bool read_point(const zs_text_file *file, const char *at, size_t length, double point[2])
{
  for (int k = 0; k < 2; k++) {
    if (!length)
      return zs_text_file_fail(file, ZS_ERROR_SYNTAX, "1 column; expected x and y");
    if (!zs_text_number(at, length, &point[k]))
      return zs_text_file_fail_word(file, at, length, "a finite number");
    at += length;
    length = zs_text_word(&at);
  }
  return !length ||
         zs_text_file_fail(file, ZS_ERROR_SYNTAX, "more than 2 columns; expected x and y");
}

static bool read_all(zs_text_file *file, zs_rings *rings)
{
  zs_line_result result;
  while ((result = zs_text_file_next(file)) == ZS_LINE_READ) {
    const char *at = file->text;
    const size_t length = zs_text_word(&at);
    double point[2];
    if (length && !read_point(file, at, length, point))
      return false;
    if (length ? !zs_rings_add_point(rings, point) : *at != '#' && !zs_rings_end(rings))
      return zs_fail_memory(file->diag);
  }
  if (result == ZS_LINE_FAILED)
    return false;
  if (!zs_rings_end(rings))
    return zs_fail_memory(file->diag);
  return rings->ring_count ||
         zs_fail(file->diag, ZS_ERROR_SYNTAX, file->path, "there are no points in this file");
}

bool zs_rings_read(zs_rings *rings, const char *path, zs_diag *diag)
{
  *rings = (zs_rings){0};
  zs_text_file file = {.path = path, .diag = diag, .stream = fopen(path, "rb")};
  if (!file.stream)
    return zs_fail(diag, ZS_ERROR_IO, path, "cannot be opened: %s", strerror(errno));
  const bool done = read_all(&file, rings);
  fclose(file.stream);
  if (!done)
    zs_rings_clear(rings);
  return done;
}

bool zs_rings_make(zs_rings *rings, const double *points, size_t count, zs_diag *diag)
{
  *rings = (zs_rings){0};
  bool memory = true;
  for (size_t i = 0; memory && i < count; i++)
    memory = zs_rings_add_point(rings, points + 2 * i);
  if (memory && zs_rings_end(rings))
    return true;
  zs_rings_clear(rings);
  return zs_fail_memory(diag);
}
