/* NRRD, "nearly raw raster data": http://teem.sourceforge.net/nrrd/format.html */
#define _POSIX_C_SOURCE 200809L /* strtok_r, fseeko */
#include "files/volume_input.h"

#include "base/expression.h"

#include <math.h>
#include <string.h>
#include <strings.h>

enum { MOST_AXES = 16 };

static const zs_voxel_type_name types[] = {
  {"signed char", ZS_VOXEL_I8}, {"int8", ZS_VOXEL_I8}, {"int8_t", ZS_VOXEL_I8},
  {"uchar", ZS_VOXEL_U8}, {"unsigned char", ZS_VOXEL_U8}, {"uint8", ZS_VOXEL_U8},
  {"uint8_t", ZS_VOXEL_U8},
  {"short", ZS_VOXEL_I16}, {"short int", ZS_VOXEL_I16}, {"signed short", ZS_VOXEL_I16},
  {"signed short int", ZS_VOXEL_I16}, {"int16", ZS_VOXEL_I16}, {"int16_t", ZS_VOXEL_I16},
  {"ushort", ZS_VOXEL_U16}, {"unsigned short", ZS_VOXEL_U16},
  {"unsigned short int", ZS_VOXEL_U16}, {"uint16", ZS_VOXEL_U16}, {"uint16_t", ZS_VOXEL_U16},
  {"int", ZS_VOXEL_I32}, {"signed int", ZS_VOXEL_I32}, {"int32", ZS_VOXEL_I32},
  {"int32_t", ZS_VOXEL_I32},
  {"uint", ZS_VOXEL_U32}, {"unsigned int", ZS_VOXEL_U32}, {"uint32", ZS_VOXEL_U32},
  {"uint32_t", ZS_VOXEL_U32},
  {"longlong", ZS_VOXEL_I64}, {"long long", ZS_VOXEL_I64}, {"long long int", ZS_VOXEL_I64},
  {"signed long long", ZS_VOXEL_I64}, {"signed long long int", ZS_VOXEL_I64},
  {"int64", ZS_VOXEL_I64}, {"int64_t", ZS_VOXEL_I64},
  {"ulonglong", ZS_VOXEL_U64}, {"unsigned long long", ZS_VOXEL_U64},
  {"unsigned long long int", ZS_VOXEL_U64}, {"uint64", ZS_VOXEL_U64}, {"uint64_t", ZS_VOXEL_U64},
  {"float", ZS_VOXEL_F32}, {"double", ZS_VOXEL_F64}};

static const struct {
  const char *name;
  zs_encoding encoding;
} encodings[] = {{"raw", ZS_ENCODING_RAW}, {"gz", ZS_ENCODING_ZLIB}, {"gzip", ZS_ENCODING_ZLIB},
                 {"txt", ZS_ENCODING_TEXT}, {"text", ZS_ENCODING_TEXT},
                 {"ascii", ZS_ENCODING_TEXT}, {"hex", ZS_ENCODING_HEX}};

/* What the header says. */
typedef struct header {
  zs_volume_input *input;
  bool has_type, has_encoding, has_endian, big_endian, has_directions, has_spacings;
  zs_encoding encoding;
  int dimension, size_count, space; /* 0: not there */
  double sizes[MOST_AXES], spacings[MOST_AXES], minima[MOST_AXES];
  double directions[MOST_AXES][3], origin[3];
  bool beside_space[MOST_AXES]; /* the axis is none of space's */
  long line_skip;
  double byte_skip;
  char *data_file;
} header;

/* ---- Fields ------------------------------------------------------------------------ */

static bool set_type(header *h, const char *field, char *value)
{
  h->has_type =
    zs_volume_set_type(h->input, field, value, types, sizeof types / sizeof *types);
  return h->has_type;
}

static bool set_encoding(header *h, const char *field, char *value)
{
  for (size_t i = 0; i < sizeof encodings / sizeof *encodings; i++)
    if (strcasecmp(value, encodings[i].name) == 0) {
      h->encoding = encodings[i].encoding;
      h->has_encoding = true;
      return true;
    }
  return zs_volume_fail(h->input, field, "'%.40s' cannot be read; expected raw, gzip, text or hex",
                        value);
}

static bool set_endian(header *h, const char *field, char *value)
{
  h->big_endian = strcasecmp(value, "big") == 0;
  h->has_endian = true;
  return h->big_endian || strcasecmp(value, "little") == 0 ||
         zs_volume_fail(h->input, field, "'%.40s' is neither little nor big", value);
}

/* One whole number. */
static bool whole(const header *h, const char *field, const char *value, double lo, double hi,
                  double *number)
{
  return (zs_volume_numbers(value, number, 1) == 1 && *number >= lo && *number <= hi &&
          *number == floor(*number)) ||
         zs_volume_fail(h->input, field, "'%.40s' is not a whole number from %g to %g", value, lo,
                        hi);
}

static bool set_dimension(header *h, const char *field, char *value)
{
  double number;
  if (!whole(h, field, value, 1, MOST_AXES, &number))
    return false;
  h->dimension = (int)number;
  return true;
}

static bool set_space_dimension(header *h, const char *field, char *value)
{
  double number;
  if (!whole(h, field, value, 1, 3, &number))
    return false;
  h->space = (int)number;
  return true;
}

/* The names of spaces are of three dimensions, but those with time. */
static bool set_space(header *h, const char *field, char *value)
{
  if (strstr(value, "time"))
    return zs_volume_fail(h->input, field, "'%.40s' has four dimensions; expected three", value);
  h->space = 3;
  return true;
}

static bool set_sizes(header *h, const char *field, char *value)
{
  h->size_count = zs_volume_numbers(value, h->sizes, MOST_AXES);
  return (h->size_count >= 1 && h->size_count <= MOST_AXES) ||
         zs_volume_fail(h->input, field, "'%.40s' is not a list of up to %d sizes", value,
                        MOST_AXES);
}

/* A number for every axis, where NaN stands for one that means nothing. */
static bool by_axis(const header *h, const char *field, char *value, double *numbers,
                    double otherwise)
{
  char *rest, *word = strtok_r(value, " \t", &rest);
  for (int k = 0; word; k++, word = strtok_r(NULL, " \t", &rest)) {
    const size_t length = strlen(word);
    double number;
    if (k == MOST_AXES)
      return zs_volume_fail(h->input, field, "more than %d axes", MOST_AXES);
    if (strcasecmp(word, "nan") == 0)
      number = otherwise;
    else if (zs_number_parse(word, length, &number) != length || !isfinite(number))
      return zs_volume_fail(h->input, field, "'%.40s' is not a number", word);
    numbers[k] = number;
  }
  return true;
}

static bool set_spacings(header *h, const char *field, char *value)
{
  h->has_spacings = true;
  return by_axis(h, field, value, h->spacings, 1);
}

static bool set_minima(header *h, const char *field, char *value)
{
  return by_axis(h, field, value, h->minima, 0);
}

/* "(1,0,0)" at `text`; its length, or 0. */
static size_t read_vector(const char *text, double vector[3])
{
  const char *end = text[0] == '(' ? strchr(text, ')') : NULL;
  char copy[128];
  if (!end || (size_t)(end - text) >= sizeof copy)
    return 0;
  memcpy(copy, text, (size_t)(end - text));
  copy[end - text] = '\0';
  vector[0] = vector[1] = vector[2] = 0;
  const int count = zs_volume_numbers(copy, vector, 3);
  return count >= 1 && count <= 3 ? (size_t)(end - text) + 1 : 0;
}

static bool set_directions(header *h, const char *field, char *value)
{
  const char *at = value;
  h->has_directions = true;
  for (int k = 0; *(at += strspn(at, " \t")); k++) {
    if (k == MOST_AXES)
      return zs_volume_fail(h->input, field, "more than %d axes", MOST_AXES);
    size_t length = read_vector(at, h->directions[k]);
    if (!length && strncmp(at, "none", 4) == 0) {
      h->beside_space[k] = true;
      length = 4;
    }
    if (!length)
      return zs_volume_fail(h->input, field, "'%.40s' is not a vector as in (1,0,0), nor none", at);
    at += length;
  }
  return true;
}

static bool set_origin(header *h, const char *field, char *value)
{
  return read_vector(value, h->origin) ||
         zs_volume_fail(h->input, field, "'%.40s' is not a point as in (1,0,0)", value);
}

/* Axes of colours, vectors and the like: not those of space. */
static bool set_kinds(header *h, const char *field, char *value)
{
  (void)field;
  char *rest, *word = strtok_r(value, " \t", &rest);
  for (int k = 0; word && k < MOST_AXES; k++, word = strtok_r(NULL, " \t", &rest))
    h->beside_space[k] |= strcasecmp(word, "domain") && strcasecmp(word, "space") &&
                          strcmp(word, "???") && strcasecmp(word, "none");
  return true;
}

static bool set_line_skip(header *h, const char *field, char *value)
{
  double number;
  if (!whole(h, field, value, 0, 1e9, &number))
    return false;
  h->line_skip = (long)number;
  return true;
}

static bool set_byte_skip(header *h, const char *field, char *value)
{
  return whole(h, field, value, -1, 1e15, &h->byte_skip);
}

static bool set_data_file(header *h, const char *field, char *value)
{
  h->data_file = value;
  return zs_volume_check_data_file(h->input, field, value);
}

static const struct {
  const char *name;
  bool (*set)(header *h, const char *field, char *value);
} fields[] = {{"type", set_type},
              {"encoding", set_encoding},
              {"endian", set_endian},
              {"dimension", set_dimension},
              {"space", set_space},
              {"space dimension", set_space_dimension},
              {"sizes", set_sizes},
              {"spacings", set_spacings},
              {"axis mins", set_minima},
              {"axismins", set_minima},
              {"space directions", set_directions},
              {"space origin", set_origin},
              {"kinds", set_kinds},
              {"line skip", set_line_skip},
              {"lineskip", set_line_skip},
              {"byte skip", set_byte_skip},
              {"byteskip", set_byte_skip},
              {"data file", set_data_file},
              {"datafile", set_data_file}};

/* A line of the header, without its end.  Keys, comments and fields that say nothing of
 * the samples are passed over. */
static bool read_line(header *h, char *line)
{
  char *colon = strchr(line, ':');
  if (line[0] == '#')
    return true;
  if (!colon)
    return zs_volume_fail(h->input, NULL, "'%.40s' is not a line of an NRRD header", line);
  if (colon[1] == '=')
    return true;
  *colon = '\0';
  char *value = colon + 1 + strspn(colon + 1, " \t");
  for (size_t n = strlen(value); n && strchr(" \t\r", value[n - 1]); n--)
    value[n - 1] = '\0';
  for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
    if (strcasecmp(line, fields[i].name) == 0)
      return fields[i].set(h, fields[i].name, value);
  return true;
}

/* Read all lines; *end becomes where the data begins, or the text's length. */
static bool read_lines(header *h, char *text, size_t length, size_t *end)
{
  bool first = true;
  for (char *line = text; line < text + length; first = false) {
    char *newline = memchr(line, '\n', (size_t)(text + length - line));
    char *next = newline ? newline + 1 : text + length;
    if (newline)
      *newline = '\0';
    if (line[0] == '\0' || strcmp(line, "\r") == 0) {
      *end = (size_t)(next - text);
      return true;
    }
    if (!first && !read_line(h, line))
      return false;
    line = next;
  }
  *end = length;
  return length < ZS_VOLUME_MOST_HEADER ||
         zs_volume_fail(h->input, NULL, "the header does not end within %d bytes",
                        ZS_VOLUME_MOST_HEADER);
}

/* ---- What they amount to ---------------------------------------------------------------- */

static bool check_header(const header *h)
{
  const char *missing = !h->has_type       ? "type"
                        : !h->dimension    ? "dimension"
                        : !h->size_count   ? "sizes"
                        : !h->has_encoding ? "encoding"
                                           : NULL;
  if (missing)
    return zs_volume_fail(h->input, missing, "is missing in the header");
  if (h->size_count != h->dimension)
    return zs_volume_fail(h->input, "sizes", "there are %d; expected %d, the dimension",
                          h->size_count, h->dimension);
  if (!h->has_endian && zs_voxel_size(h->input->volume->type) > 1 &&
      h->encoding != ZS_ENCODING_TEXT)
    return zs_volume_fail(h->input, "endian", "is missing in the header");
  return true;
}

/* Whether an axis can be left out of more than three. */
static bool is_spare(const header *h, int k)
{
  return h->sizes[k] == 1 && (h->beside_space[k] || !h->has_directions);
}

/* Leave out axes of one sample that are not those of space. */
static bool keep_space_axes(header *h)
{
  int kept = 0;
  for (int k = 0; k < h->dimension; k++)
    if (h->beside_space[k] && h->sizes[k] != 1)
      return zs_volume_fail(h->input, "sizes", "axis %d has %g numbers for every sample; expected "
                            "one number a sample", k + 1, h->sizes[k]);
  int spare = h->dimension - 3;
  for (int k = 0; k < h->dimension; k++) {
    if ((h->beside_space[k] || spare > 0) && is_spare(h, k)) {
      spare--;
      continue;
    }
    h->sizes[kept] = h->sizes[k];
    h->spacings[kept] = h->spacings[k];
    h->minima[kept] = h->minima[k];
    memcpy(h->directions[kept++], h->directions[k], sizeof *h->directions);
  }
  h->dimension = kept;
  return true;
}

static bool place(header *h)
{
  double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, origin[3];
  memcpy(origin, h->origin, sizeof origin);
  for (int k = 0; k < 3 && k < h->dimension; k++) {
    if (h->has_directions) {
      memcpy(axes[k], h->directions[k], sizeof axes[k]);
    } else {
      axes[k][k] = h->spacings[k];
      origin[k] += h->minima[k];
    }
  }
  return zs_volume_set_axes(h->input, h->has_directions ? "space directions" : "spacings", axes,
                            origin);
}

/* Go `count` lines on from where the stream is; false at the end. */
static bool skip_lines(FILE *stream, long count)
{
  for (int c; count > 0 && (c = getc(stream)) != EOF;)
    count -= c == '\n';
  return count == 0;
}

static bool read_samples(const void *of, zs_volume_input *data, uint64_t offset)
{
  const header *h = of;
  const zs_volume *volume = data->volume;
  uint64_t before = 0;
  if (h->line_skip) {
    if (fseeko(data->stream, (off_t)offset, SEEK_SET) != 0 ||
        !skip_lines(data->stream, h->line_skip))
      return zs_volume_fail(data, "line skip", "there are fewer lines");
    offset = (uint64_t)ftello(data->stream);
  }
  if (h->byte_skip >= 0) {
    before = (uint64_t)h->byte_skip;
  } else {
    const uint64_t bytes = zs_volume_count(volume) * zs_voxel_size(volume->type);
    if (h->encoding != ZS_ENCODING_RAW)
      return zs_volume_fail(h->input, "byte skip", "-1 is for raw data only");
    if (bytes <= data->length && data->length - bytes >= offset)
      before = data->length - bytes - offset;
  }
  if (h->encoding == ZS_ENCODING_TEXT || h->encoding == ZS_ENCODING_HEX) {
    offset += before;
    before = 0;
  }
  return zs_volume_read_data(data, offset, before, h->encoding, h->big_endian);
}

static bool read_file(void *of, char *text, size_t length)
{
  header *h = of;
  size_t end;
  if (length < 8 || memcmp(text, "NRRD000", 7) != 0)
    return zs_volume_fail(h->input, NULL,
                          "this is not an NRRD file: it does not begin with NRRD000");
  if (!read_lines(h, text, length, &end) || !check_header(h) || !keep_space_axes(h) ||
      !zs_volume_set_sizes(h->input, "sizes", h->sizes, h->dimension) || !place(h))
    return false;
  if (!h->data_file)
    return read_samples(h, h->input, end);
  return zs_volume_read_beside(h->input, "data file", h->data_file, read_samples, h);
}

bool zs_volume_read_nrrd(zs_volume_input *input)
{
  header h = {.input = input};
  for (int k = 0; k < MOST_AXES; k++)
    h.spacings[k] = 1;
  return zs_volume_read_header(input, read_file, &h);
}
