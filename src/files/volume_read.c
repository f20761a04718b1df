/* Reading volumes: the formats by name, and what their readers share. */
#define _POSIX_C_SOURCE 200809L /* fileno, fstat, realpath, strdup */
#define _XOPEN_SOURCE 700
#include "files/volume_input.h"

#include "base/expression.h"
#include "base/names.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

static const size_t sizes[ZS_VOXEL_TYPE_COUNT] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};

size_t zs_voxel_size(zs_voxel_type type)
{
  return sizes[type];
}

void zs_volume_clear(zs_volume *volume)
{
  free(volume->numbers);
  *volume = (zs_volume){0};
}

/* ---- Numbers ------------------------------------------------------------------ */

#define LOAD(TYPE) \
  for (size_t i = 0; i < count; i++) \
    values[i] = (double)((const TYPE *)volume->numbers)[first + i]; \
  break

void zs_volume_values(const zs_volume *volume, size_t first, size_t count, double *values)
{
  switch (volume->type) {
  case ZS_VOXEL_U8: LOAD(uint8_t);
  case ZS_VOXEL_I8: LOAD(int8_t);
  case ZS_VOXEL_U16: LOAD(uint16_t);
  case ZS_VOXEL_I16: LOAD(int16_t);
  case ZS_VOXEL_U32: LOAD(uint32_t);
  case ZS_VOXEL_I32: LOAD(int32_t);
  case ZS_VOXEL_U64: LOAD(uint64_t);
  case ZS_VOXEL_I64: LOAD(int64_t);
  case ZS_VOXEL_F32: LOAD(float);
  default: LOAD(double);
  }
  if (volume->slope != 1 || volume->intercept != 0)
    for (size_t i = 0; i < count; i++)
      values[i] = volume->slope * values[i] + volume->intercept;
}

/* The nearest whole number of a range whose ends are exact or rounded inward. */
static double whole(double number, double lo, double hi)
{
  return isnan(number) ? 0 : rint(fmin(fmax(number, lo), hi));
}

void zs_volume_store(zs_volume *volume, size_t i, double number)
{
  static const double MOST_I64 = 9223372036854774784.0, MOST_U64 = 18446744073709549568.0;
  void *to = volume->numbers;
  switch (volume->type) {
  case ZS_VOXEL_U8: ((uint8_t *)to)[i] = (uint8_t)whole(number, 0, UINT8_MAX); break;
  case ZS_VOXEL_I8: ((int8_t *)to)[i] = (int8_t)whole(number, INT8_MIN, INT8_MAX); break;
  case ZS_VOXEL_U16: ((uint16_t *)to)[i] = (uint16_t)whole(number, 0, UINT16_MAX); break;
  case ZS_VOXEL_I16: ((int16_t *)to)[i] = (int16_t)whole(number, INT16_MIN, INT16_MAX); break;
  case ZS_VOXEL_U32: ((uint32_t *)to)[i] = (uint32_t)whole(number, 0, UINT32_MAX); break;
  case ZS_VOXEL_I32: ((int32_t *)to)[i] = (int32_t)whole(number, INT32_MIN, INT32_MAX); break;
  case ZS_VOXEL_U64: ((uint64_t *)to)[i] = (uint64_t)whole(number, 0, MOST_U64); break;
  case ZS_VOXEL_I64: ((int64_t *)to)[i] = (int64_t)whole(number, -0x1p63, MOST_I64); break;
  case ZS_VOXEL_F32: ((float *)to)[i] = (float)number; break;
  default: ((double *)to)[i] = number;
  }
}

void zs_volume_to_host(zs_volume *volume, bool big_endian)
{
  const uint16_t one = 1;
  const bool host_is_big = !*(const unsigned char *)&one;
  const size_t size = zs_voxel_size(volume->type), count = zs_volume_count(volume);
  if (size == 1 || big_endian == host_is_big)
    return;
  unsigned char *at = volume->numbers;
  for (size_t i = 0; i < count; i++, at += size)
    for (size_t b = 0; b < size / 2; b++) {
      const unsigned char byte = at[b];
      at[b] = at[size - 1 - b];
      at[size - 1 - b] = byte;
    }
}

/* ---- Files ---------------------------------------------------------------------- */

bool zs_volume_fail(const zs_volume_input *input, const char *field, const char *format, ...)
{
  char message[256];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  return zs_fail(input->diag, ZS_ERROR_SYNTAX, input->path, "%s%s%s", field ? field : "",
                 field ? ": " : "", message);
}

bool zs_volume_input_open(zs_volume_input *input, const char *path, zs_diag *diag)
{
  struct stat status;
  *input = (zs_volume_input){.path = path, .diag = diag, .stream = fopen(path, "rb")};
  if (!input->stream || fstat(fileno(input->stream), &status) != 0)
    zs_fail(diag, ZS_ERROR_IO, path, "cannot be opened: %s", strerror(errno));
  else if (!S_ISREG(status.st_mode))
    zs_fail(diag, ZS_ERROR_IO, path, "is not a regular file");
  else {
    input->length = (uint64_t)status.st_size;
    return true;
  }
  zs_volume_input_close(input);
  return false;
}

void zs_volume_input_close(zs_volume_input *input)
{
  if (input->stream)
    fclose(input->stream);
  input->stream = NULL;
}

/* Whether a file, links followed, is in the folder of another one or below. */
static bool is_beside(const char *path, const char *other)
{
  char *a = realpath(path, NULL), *b = realpath(other, NULL);
  const char *slash = b ? strrchr(b, '/') : NULL;
  const bool beside = a && slash && strncmp(a, b, (size_t)(slash - b) + 1) == 0;
  free(a);
  free(b);
  return beside;
}

static bool open_beside(zs_volume_input *data, const zs_volume_input *header, const char *field,
                        const char *reference, const char *path)
{
  if (access(path, R_OK) != 0)
    return zs_fail(header->diag, ZS_ERROR_IO, header->path, "%s: '%.80s' cannot be opened: %s",
                   field, reference, strerror(errno));
  if (!is_beside(path, header->path))
    return zs_volume_fail(header, field, "'%.80s' is outside the folder of this file", reference);
  return zs_volume_input_open(data, path, header->diag);
}

bool zs_volume_check_data_file(const zs_volume_input *input, const char *field,
                               const char *reference)
{
  if (strncmp(reference, "LIST", 4) == 0 || strchr(reference, '%'))
    return zs_volume_fail(input, field, "lists of data files cannot be read; expected one file");
  return (*reference && *reference != '/' && !strstr(reference, "://")) ||
         zs_volume_fail(input, field, "'%.80s' is not the name of a file in this folder",
                        reference);
}

bool zs_volume_read_beside(const zs_volume_input *input, const char *field, const char *reference,
                           zs_volume_data_reader *read, const void *header)
{
  const char *slash = strrchr(input->path, '/');
  const size_t folder = slash ? (size_t)(slash - input->path) + 1 : 0;
  char *path = malloc(folder + strlen(reference) + 1);
  zs_volume_input data;
  if (!path)
    return zs_fail_memory(input->diag);
  memcpy(path, input->path, folder);
  strcpy(path + folder, reference);
  bool done = open_beside(&data, input, field, reference, path);
  if (done) {
    data.volume = input->volume;
    done = read(header, &data, 0);
    zs_volume_input_close(&data);
  }
  free(path);
  return done;
}

/* ---- Headers ----------------------------------------------------------------------- */

bool zs_volume_read_header(const zs_volume_input *input, zs_volume_text_reader *read,
                           void *header)
{
  char *text = malloc(ZS_VOLUME_MOST_HEADER + 1);
  if (!text)
    return zs_fail_memory(input->diag);
  const size_t length = fread(text, 1, ZS_VOLUME_MOST_HEADER, input->stream);
  text[length] = '\0';
  const bool done = read(header, text, length);
  free(text);
  return done;
}

bool zs_volume_set_type(zs_volume_input *input, const char *field, const char *name,
                        const zs_voxel_type_name *names, size_t count)
{
  for (size_t i = 0; i < count; i++)
    if (strcasecmp(name, names[i].name) == 0) {
      input->volume->type = names[i].type;
      return true;
    }
  return zs_volume_fail(input, field, "'%.40s' is not a type of numbers that can be read", name);
}

static bool is_blank(char c)
{
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == '(' || c == ')';
}

size_t zs_volume_word(const char **at, const char *end, double *number)
{
  while (*at < end && is_blank(**at))
    (*at)++;
  const char *word_end = *at;
  while (word_end < end && !is_blank(*word_end))
    word_end++;
  const size_t length = (size_t)(word_end - *at);
  return zs_number_parse(*at, length, number) == length ? length : 0;
}

int zs_volume_numbers(const char *text, double *numbers, int most)
{
  const char *end = text + strlen(text);
  for (int count = 0;; count++) {
    double number;
    const size_t length = zs_volume_word(&text, end, &number);
    if (text == end)
      return count;
    if (!length || !isfinite(number))
      return -1;
    if (count < most)
      numbers[count] = number;
    text += length;
  }
}

bool zs_volume_set_sizes(zs_volume_input *input, const char *field, const double *list, int count)
{
  uint32_t *size = input->volume->size;
  double total = 1;
  size[0] = size[1] = size[2] = 1;
  for (int k = 0; k < count; k++) {
    if (!(list[k] >= 1 && list[k] <= INT32_MAX && list[k] == floor(list[k])))
      return zs_volume_fail(input, field, "%g is not a number of samples", list[k]);
    if (k >= 3 && list[k] != 1)
      return zs_volume_fail(input, field, "axis %d has %g samples; expected a volume of 3 axes",
                            k + 1, list[k]);
    if (k < 3)
      size[k] = (uint32_t)list[k];
    total *= list[k];
  }
  return total <= ZS_VOLUME_MOST ||
         zs_volume_fail(input, field, "%g samples are more than %d", total, ZS_VOLUME_MOST);
}

bool zs_volume_set_axes(zs_volume_input *input, const char *field, const double axes[3][3],
                        const double origin[3])
{
  double *m = input->volume->matrix, lengths = 1;
  if (!isfinite(origin[0] + origin[1] + origin[2]))
    return zs_volume_fail(input, field, "the origin is %g %g %g; expected finite numbers",
                          origin[0], origin[1], origin[2]);
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++)
      m[4 * i + k] = axes[k][i];
    m[4 * i + 3] = origin[i];
    lengths *= hypot(hypot(axes[i][0], axes[i][1]), axes[i][2]);
  }
  const double volume = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                        m[2] * (m[4] * m[9] - m[5] * m[8]);
  return (isfinite(lengths) && fabs(volume) > 1e-9 * lengths) ||
         zs_volume_fail(input, field, "the axes do not span space; expected three directions, "
                        "none of length 0 and not in one plane");
}

/* ---- By name -------------------------------------------------------------------------- */

static const struct {
  const char *ending;
  bool (*read)(zs_volume_input *input);
} formats[] = {{".nrrd", zs_volume_read_nrrd}, {".nhdr", zs_volume_read_nrrd},
               {".mhd", zs_volume_read_meta},  {".mha", zs_volume_read_meta},
               {".nii", zs_volume_read_nifti}, {".nii.gz", zs_volume_read_nifti},
               {".vti", zs_volume_read_vti}};
enum { FORMAT_COUNT = sizeof formats / sizeof *formats };

static int format_of(const char *path)
{
  for (int i = 0; i < FORMAT_COUNT; i++)
    if (zs_name_ends_in(path, formats[i].ending))
      return i;
  return -1;
}

bool zs_volume_is_name(const char *path)
{
  return format_of(path) >= 0;
}

bool zs_volume_read(zs_volume *volume, const char *path, zs_diag *diag)
{
  *volume = (zs_volume){.slope = 1};
  const int format = format_of(path);
  if (format < 0)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, path,
                   "the ending of the name is no volume format; expected .nrrd, .nhdr, .mhd, .mha, "
                   ".nii, .nii.gz or .vti");
  zs_volume_input input;
  if (!zs_volume_input_open(&input, path, diag))
    return false;
  input.volume = volume;
  const bool done = formats[format].read(&input);
  zs_volume_input_close(&input);
  if (!done)
    zs_volume_clear(volume);
  return done;
}
