/* MetaImage: .mha, and .mhd with its data beside it. */
#define _POSIX_C_SOURCE 200809L
#include "files/volume_input.h"

#include <string.h>
#include <strings.h>

enum { MOST_AXES = 10 };

static const zs_voxel_type_name types[] = {
  {"MET_UCHAR", ZS_VOXEL_U8},      {"MET_CHAR", ZS_VOXEL_I8},
  {"MET_USHORT", ZS_VOXEL_U16},    {"MET_SHORT", ZS_VOXEL_I16},
  {"MET_UINT", ZS_VOXEL_U32},      {"MET_INT", ZS_VOXEL_I32},
  {"MET_ULONG", ZS_VOXEL_U32},     {"MET_LONG", ZS_VOXEL_I32},
  {"MET_ULONG_LONG", ZS_VOXEL_U64}, {"MET_LONG_LONG", ZS_VOXEL_I64},
  {"MET_FLOAT", ZS_VOXEL_F32},     {"MET_DOUBLE", ZS_VOXEL_F64}};

/* What the header says. */
typedef struct header {
  zs_volume_input *input;
  int dimension, size_count;
  bool has_type, binary, compressed, big_endian, has_matrix;
  double sizes[MOST_AXES], spacing[MOST_AXES], matrix[MOST_AXES * MOST_AXES], origin[MOST_AXES];
  double header_size;
  char *data_file;
} header;

static bool is_true(const char *value)
{
  return value[0] == 'T' || value[0] == 't' || value[0] == '1';
}

/* `count` numbers. */
static bool numbers(const header *h, const char *field, const char *value, double *list, int count)
{
  if (!h->dimension)
    return zs_volume_fail(h->input, field, "stands before NDims");
  const int found = zs_volume_numbers(value, list, count);
  return found == count ||
         zs_volume_fail(h->input, field, "'%.40s' is not a list of %d numbers", value, count);
}

static bool set_dimension(header *h, const char *field, char *value)
{
  double number;
  if (zs_volume_numbers(value, &number, 1) != 1 || !(number >= 1 && number <= MOST_AXES) ||
      number != (int)number)
    return zs_volume_fail(h->input, field, "'%.40s' is not a whole number from 1 to %d", value,
                          MOST_AXES);
  h->dimension = (int)number;
  return true;
}

static bool set_sizes(header *h, const char *field, char *value)
{
  h->size_count = h->dimension;
  return numbers(h, field, value, h->sizes, h->dimension);
}

static bool set_spacing(header *h, const char *field, char *value)
{
  return numbers(h, field, value, h->spacing, h->dimension);
}

static bool set_origin(header *h, const char *field, char *value)
{
  return numbers(h, field, value, h->origin, h->dimension);
}

static bool set_matrix(header *h, const char *field, char *value)
{
  h->has_matrix = true;
  return numbers(h, field, value, h->matrix, h->dimension * h->dimension);
}

static bool set_type(header *h, const char *field, char *value)
{
  h->has_type =
    zs_volume_set_type(h->input, field, value, types, sizeof types / sizeof *types);
  return h->has_type;
}

static bool set_channels(header *h, const char *field, char *value)
{
  double number;
  return (zs_volume_numbers(value, &number, 1) == 1 && number == 1) ||
         zs_volume_fail(h->input, field, "'%.40s' numbers for every sample; expected 1", value);
}

static bool set_binary(header *h, const char *field, char *value)
{
  (void)field;
  h->binary = is_true(value);
  return true;
}

static bool set_compressed(header *h, const char *field, char *value)
{
  (void)field;
  h->compressed = is_true(value);
  return true;
}

static bool set_big_endian(header *h, const char *field, char *value)
{
  (void)field;
  h->big_endian = is_true(value);
  return true;
}

static bool set_header_size(header *h, const char *field, char *value)
{
  return (zs_volume_numbers(value, &h->header_size, 1) == 1 && h->header_size >= -1 &&
          h->header_size <= 1e15) ||
         zs_volume_fail(h->input, field, "'%.40s' is not a number of bytes", value);
}

static bool set_data_file(header *h, const char *field, char *value)
{
  h->data_file = value;
  return zs_volume_check_data_file(h->input, field, value);
}

static const struct {
  const char *name;
  bool (*set)(header *h, const char *field, char *value);
} fields[] = {{"NDims", set_dimension},
              {"DimSize", set_sizes},
              {"ElementSpacing", set_spacing},
              {"ElementSize", NULL}, /* of what was seen, not where */
              {"Offset", set_origin},
              {"Position", set_origin},
              {"Origin", set_origin},
              {"TransformMatrix", set_matrix},
              {"Rotation", set_matrix},
              {"Orientation", set_matrix},
              {"ElementType", set_type},
              {"ElementNumberOfChannels", set_channels},
              {"BinaryData", set_binary},
              {"CompressedData", set_compressed},
              {"BinaryDataByteOrderMSB", set_big_endian},
              {"ElementByteOrderMSB", set_big_endian},
              {"HeaderSize", set_header_size},
              {"ElementDataFile", set_data_file}};

/* "Name = value"; names that say nothing of the samples are passed over. */
static bool read_line(header *h, char *line)
{
  char *equals = strchr(line, '=');
  if (!line[strspn(line, " \t\r")])
    return true;
  if (!equals)
    return zs_volume_fail(h->input, NULL, "'%.40s' is not a line of a MetaImage header", line);
  char *value = equals + 1 + strspn(equals + 1, " \t");
  for (size_t n = strlen(value); n && strchr(" \t\r", value[n - 1]); n--)
    value[n - 1] = '\0';
  size_t length = (size_t)(equals - line);
  while (length && strchr(" \t", line[length - 1]))
    length--;
  for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
    if (strlen(fields[i].name) == length && strncasecmp(line, fields[i].name, length) == 0)
      return !fields[i].set || fields[i].set(h, fields[i].name, value);
  return true;
}

/* The header ends with the line that says where the data is; *end becomes what follows. */
static bool read_lines(header *h, char *text, size_t length, size_t *end)
{
  for (char *line = text; line < text + length && !h->data_file;) {
    char *newline = memchr(line, '\n', (size_t)(text + length - line));
    char *next = newline ? newline + 1 : text + length;
    if (newline)
      *newline = '\0';
    if (!read_line(h, line))
      return false;
    line = next;
    *end = (size_t)(next - text);
  }
  const char *missing = !h->dimension    ? "NDims"
                        : !h->size_count ? "DimSize"
                        : !h->has_type   ? "ElementType"
                        : !h->data_file  ? "ElementDataFile"
                                         : NULL;
  return !missing || zs_volume_fail(h->input, missing, "is missing in the header");
}

/* Row k of the matrix is the direction of axis k. */
static bool place(const header *h)
{
  double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const int n = h->dimension < 3 ? h->dimension : 3;
  for (int k = 0; k < n; k++)
    for (int i = 0; i < n; i++)
      axes[k][i] = h->spacing[k] * (h->has_matrix ? h->matrix[k * h->dimension + i] : i == k);
  return zs_volume_set_axes(h->input, h->has_matrix ? "TransformMatrix" : "ElementSpacing", axes,
                            h->origin);
}

static bool read_samples(const void *of, zs_volume_input *data, uint64_t offset)
{
  const header *h = of;
  const zs_volume *volume = data->volume;
  const zs_encoding encoding = !h->binary      ? ZS_ENCODING_TEXT
                               : h->compressed ? ZS_ENCODING_ZLIB
                                               : ZS_ENCODING_RAW;
  if (h->header_size < 0) { /* the data is what the file ends with */
    const uint64_t bytes = zs_volume_count(volume) * zs_voxel_size(volume->type);
    offset = bytes <= data->length ? data->length - bytes : data->length;
  } else {
    offset += (uint64_t)h->header_size;
  }
  return zs_volume_read_data(data, offset, 0, encoding, h->big_endian);
}

static bool read_file(void *of, char *text, size_t length)
{
  header *h = of;
  size_t end = 0;
  if (!read_lines(h, text, length, &end) ||
      !zs_volume_set_sizes(h->input, "DimSize", h->sizes, h->dimension) || !place(h))
    return false;
  if (strcasecmp(h->data_file, "LOCAL") == 0)
    return read_samples(h, h->input, end);
  return zs_volume_read_beside(h->input, "ElementDataFile", h->data_file, read_samples, h);
}

bool zs_volume_read_meta(zs_volume_input *input)
{
  header h = {.input = input, .binary = true};
  for (int k = 0; k < MOST_AXES; k++)
    h.spacing[k] = 1;
  return zs_volume_read_header(input, read_file, &h);
}
