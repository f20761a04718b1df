#include "files/points.h"

#include "base/array.h"
#include "base/expression.h"
#include "files/text_file.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  MAXIMUM_COLUMNS = 64,
  MAXIMUM_ELEMENTS = 32,
  MAXIMUM_POINTS = 100000000,
  NUMBERS = 7, /* x y z nx ny nz value */
  IGNORED = NUMBERS
};

static const char *const names[NUMBERS] = {"x", "y", "z", "nx", "ny", "nz", "value"};

/* A file being read into rows of NUMBERS numbers. */
typedef struct reader {
  zs_text_file file; /* its line is 0 in binary data */
  unsigned columns;
  unsigned char role[MAXIMUM_COLUMNS]; /* what each column is: an index of names, or IGNORED */
  bool has[NUMBERS];
  double *rows;
  size_t count, capacity;
} reader;

static bool fail(const reader *r, zs_status status, const char *message)
{
  return zs_text_file_fail(&r->file, status, message);
}

static bool fail_columns(const reader *r, unsigned columns, const char *expected)
{
  char message[160];
  snprintf(message, sizeof message, "%u columns; expected %s", columns, expected);
  return fail(r, ZS_ERROR_SYNTAX, message);
}

/* ---- Rows ------------------------------------------------------------------------ */

static double *add_row(reader *r)
{
  if (r->count == MAXIMUM_POINTS) {
    fail(r, ZS_ERROR_UNABLE, "more than 100 million points");
    return NULL;
  }
  double *rows = zs_array_grown(r->rows, r->count + 1, &r->capacity, NUMBERS * sizeof *rows);
  if (!rows) {
    zs_fail_memory(r->file.diag);
    return NULL;
  }
  r->rows = rows;
  double *row = rows + NUMBERS * r->count++;
  memset(row, 0, NUMBERS * sizeof *row);
  return row;
}

/* What a column named so is. */
static unsigned char role_of(const char *word, size_t length)
{
  for (unsigned char i = 0; i < NUMBERS; i++)
    if (strlen(names[i]) == length && !strncmp(names[i], word, length))
      return i;
  return IGNORED;
}

/* Add a named column. */
static bool add_column(reader *r, const char *word, size_t length)
{
  if (r->columns == MAXIMUM_COLUMNS)
    return fail(r, ZS_ERROR_SYNTAX, "more than 64 columns");
  unsigned char role = role_of(word, length);
  if (role != IGNORED && r->has[role])
    return zs_text_file_fail_word(&r->file, word, length, "the only column of that name");
  if (role != IGNORED)
    r->has[role] = true;
  r->role[r->columns++] = role;
  return true;
}

static bool check_columns(const reader *r)
{
  if (!r->has[0] || !r->has[1] || !r->has[2])
    return fail(r, ZS_ERROR_SYNTAX, "the columns x, y and z are not all named");
  if (r->has[3] != r->has[4] || r->has[4] != r->has[5])
    return fail(r, ZS_ERROR_SYNTAX, "of nx, ny and nz only some are named");
  return true;
}

/* ---- Text -------------------------------------------------------------------------- */

static bool read_header(reader *r, const char *at)
{
  size_t length;
  for (; (length = zs_text_word(&at)) != 0; at += length) {
    /* Spreadsheets quote names. */
    bool quoted = length >= 2 && at[0] == '"' && at[length - 1] == '"';
    if (!add_column(r, at + quoted, length - 2 * quoted))
      return false;
  }
  return check_columns(r);
}

/* Columns by their number, from the first line of a file without a header. */
static bool count_columns(reader *r, const char *at)
{
  static const unsigned char layout[NUMBERS + 1][NUMBERS] = {
    [3] = {0, 1, 2}, [4] = {0, 1, 2, 6}, [6] = {0, 1, 2, 3, 4, 5}, [7] = {0, 1, 2, 3, 4, 5, 6}};
  unsigned columns = 0;
  size_t length;
  for (; (length = zs_text_word(&at)) != 0; at += length)
    columns++;
  if (columns != 3 && columns != 4 && columns != 6 && columns != 7)
    return fail_columns(r, columns, "3 (x y z), 4 (and a value), 6 (and a normal), 7 (both), or a "
                                    "header line that names them");
  r->columns = columns;
  for (unsigned i = 0; i < columns; i++) {
    r->role[i] = layout[columns][i];
    r->has[r->role[i]] = true;
  }
  return true;
}

static bool read_row(reader *r, const char *at)
{
  double numbers[NUMBERS + 1];
  unsigned columns = 0;
  size_t length;
  for (; (length = zs_text_word(&at)) != 0; at += length, columns++) {
    if (columns == r->columns)
      continue;
    unsigned char role = r->role[columns];
    if (role != IGNORED && !zs_text_number(at, length, &numbers[role]))
      return zs_text_file_fail_word(&r->file, at, length, "a finite number");
  }
  if (columns != r->columns) {
    char expected[40];
    snprintf(expected, sizeof expected, "%u as before", r->columns);
    return fail_columns(r, columns, expected);
  }
  double *row = add_row(r);
  if (!row)
    return false;
  for (unsigned i = 0; i < NUMBERS; i++)
    if (r->has[i])
      row[i] = numbers[i];
  return true;
}

/* The rest of a text file, its first line read already. */
static bool read_text(reader *r)
{
  zs_line_result result = ZS_LINE_READ;
  const char *at = r->file.text;
  if (!strncmp(at, "\xef\xbb\xbf", 3))
    at += 3;
  while (result == ZS_LINE_READ) {
    size_t length = zs_text_word(&at);
    double number;
    if (length && !r->columns) {
      if (zs_number_parse(at, length, &number) == 0) {
        if (!read_header(r, at))
          return false;
        length = 0;
      } else if (!count_columns(r, at)) {
        return false;
      }
    }
    if (length && !read_row(r, at))
      return false;
    result = zs_text_file_next(&r->file);
    at = r->file.text;
  }
  return result == ZS_LINE_END;
}

/* ---- PLY --------------------------------------------------------------------------- */

typedef enum ply_format { PLY_ASCII, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN } ply_format;

typedef enum ply_type {
  PLY_CHAR, PLY_UCHAR, PLY_SHORT, PLY_USHORT, PLY_INT, PLY_UINT, PLY_FLOAT, PLY_DOUBLE,
  PLY_TYPE_COUNT
} ply_type;

static const char *const ply_types[2][PLY_TYPE_COUNT] = {
  {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"},
  {"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"}};

typedef struct ply_property {
  ply_type type, count_type;
  bool list;
} ply_property;

typedef struct ply_element {
  bool vertex;
  unsigned long long count;
  unsigned properties;
  ply_property property[MAXIMUM_COLUMNS];
} ply_element;

typedef struct ply {
  ply_format format;
  const char *at; /* ASCII: what is left of the line */
  unsigned elements;
  ply_element element[MAXIMUM_ELEMENTS];
} ply;

static bool word_is(const char *word, size_t length, const char *expected)
{
  return strlen(expected) == length && !strncmp(word, expected, length);
}

/* Move to the next word of the header line. */
static size_t step(const char **at, size_t length)
{
  *at += length;
  return zs_text_word(at);
}

static bool ply_type_of(const reader *r, const char *word, size_t length, ply_type *type)
{
  for (int i = 0; i < PLY_TYPE_COUNT; i++) {
    if (word_is(word, length, ply_types[0][i]) || word_is(word, length, ply_types[1][i])) {
      *type = (ply_type)i;
      return true;
    }
  }
  return zs_text_file_fail_word(&r->file, word, length, "a property type");
}

static bool ply_read_format(const reader *r, ply *p, const char *at, size_t length)
{
  static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  for (int i = 0; i < 3; i++) {
    if (word_is(at, length, formats[i])) {
      p->format = (ply_format)i;
      return true;
    }
  }
  return zs_text_file_fail_word(&r->file, at, length, "a PLY format");
}

static bool ply_read_element(const reader *r, ply *p, const char *at, size_t length)
{
  if (p->elements == MAXIMUM_ELEMENTS)
    return fail(r, ZS_ERROR_SYNTAX, "more than 32 elements");
  ply_element *e = &p->element[p->elements++];
  *e = (ply_element){.vertex = word_is(at, length, "vertex")};
  length = step(&at, length);
  double count;
  if (!zs_text_number(at, length, &count) || count < 0 || count > 1e15 || count != floor(count))
    return zs_text_file_fail_word(&r->file, at, length, "a count");
  e->count = (unsigned long long)count;
  return true;
}

static bool ply_read_property(reader *r, ply *p, const char *at, size_t length)
{
  if (!p->elements)
    return fail(r, ZS_ERROR_SYNTAX, "a property before the first element");
  ply_element *e = &p->element[p->elements - 1];
  if (e->properties == MAXIMUM_COLUMNS)
    return fail(r, ZS_ERROR_SYNTAX, "more than 64 properties");
  ply_property *property = &e->property[e->properties++];
  property->list = word_is(at, length, "list");
  if (property->list) {
    length = step(&at, length);
    if (!ply_type_of(r, at, length, &property->count_type))
      return false;
    length = step(&at, length);
  }
  if (!ply_type_of(r, at, length, &property->type))
    return false;
  length = step(&at, length);
  if (!length)
    return fail(r, ZS_ERROR_SYNTAX, "a property without a name");
  return !e->vertex || add_column(r, property->list ? "list" : at, property->list ? 4 : length);
}

/* The lines up to end_header; "ply" has been read. */
static bool ply_read_header(reader *r, ply *p)
{
  for (;;) {
    zs_line_result result = zs_text_file_next(&r->file);
    if (result == ZS_LINE_END)
      fail(r, ZS_ERROR_SYNTAX, "the file ends inside its header");
    if (result != ZS_LINE_READ)
      return false;
    const char *keyword = r->file.text;
    size_t size = zs_text_word(&keyword);
    const char *at = keyword;
    size_t length = step(&at, size);
    bool fine = true;
    if (word_is(keyword, size, "end_header"))
      return true;
    if (word_is(keyword, size, "format"))
      fine = ply_read_format(r, p, at, length);
    else if (word_is(keyword, size, "element"))
      fine = ply_read_element(r, p, at, length);
    else if (word_is(keyword, size, "property"))
      fine = ply_read_property(r, p, at, length);
    else if (!word_is(keyword, size, "comment") && !word_is(keyword, size, "obj_info"))
      fine = zs_text_file_fail_word(&r->file, keyword, size, "a PLY keyword");
    if (!fine)
      return false;
  }
}

static bool ply_fail_end(const reader *r)
{
  return fail(r, ZS_ERROR_SYNTAX, "the file ends before all elements its header announces");
}

static bool ply_ascii_number(reader *r, ply *p, double *number)
{
  size_t length;
  while ((length = zs_text_word(&p->at)) == 0) {
    zs_line_result result = zs_text_file_next(&r->file);
    if (result != ZS_LINE_READ)
      return result == ZS_LINE_END && ply_fail_end(r);
    p->at = r->file.text;
  }
  if (!zs_text_number(p->at, length, number))
    return zs_text_file_fail_word(&r->file, p->at, length, "a finite number");
  p->at += length;
  return true;
}

static double ply_decode(ply_type type, uint64_t bits)
{
  float single;
  double wide;
  uint32_t half = (uint32_t)bits;
  switch (type) {
  case PLY_CHAR:
    return (int8_t)bits;
  case PLY_SHORT:
    return (int16_t)bits;
  case PLY_INT:
    return (int32_t)bits;
  case PLY_FLOAT:
    memcpy(&single, &half, sizeof single);
    return (double)single;
  case PLY_DOUBLE:
    memcpy(&wide, &bits, sizeof wide);
    return wide;
  default:
    return (double)bits;
  }
}

static bool ply_number(reader *r, ply *p, ply_type type, double *number)
{
  static const unsigned char sizes[PLY_TYPE_COUNT] = {1, 1, 2, 2, 4, 4, 4, 8};
  if (p->format == PLY_ASCII)
    return ply_ascii_number(r, p, number);
  unsigned char bytes[8];
  unsigned size = sizes[type];
  if (fread(bytes, 1, size, r->file.stream) != size)
    return ply_fail_end(r);
  uint64_t bits = 0;
  for (unsigned i = 0; i < size; i++)
    bits = bits << 8 | bytes[p->format == PLY_BIG_ENDIAN ? i : size - 1 - i];
  *number = ply_decode(type, bits);
  return isfinite(*number) || fail(r, ZS_ERROR_SYNTAX, "a number that is not finite");
}

/* One element: numbers by property; lists are read over. */
static bool ply_read_instance(reader *r, ply *p, const ply_element *e, double *numbers)
{
  for (unsigned i = 0; i < e->properties; i++) {
    const ply_property *property = &e->property[i];
    double count = 1;
    if (property->list && !ply_number(r, p, property->count_type, &count))
      return false;
    for (; count >= 1; count--)
      if (!ply_number(r, p, property->type, &numbers[i]))
        return false;
  }
  return true;
}

static bool ply_read_vertices(reader *r, ply *p, const ply_element *e)
{
  double numbers[MAXIMUM_COLUMNS];
  for (unsigned long long n = 0; n < e->count; n++) {
    if (!ply_read_instance(r, p, e, numbers))
      return false;
    double *row = add_row(r);
    if (!row)
      return false;
    for (unsigned i = 0; i < r->columns; i++)
      if (r->role[i] != IGNORED)
        row[r->role[i]] = numbers[i];
  }
  return true;
}

static bool read_ply(reader *r)
{
  ply p = {.at = ""};
  double skipped[MAXIMUM_COLUMNS];
  if (!ply_read_header(r, &p) || !check_columns(r))
    return false;
  if (p.format != PLY_ASCII)
    r->file.line = 0;
  for (unsigned i = 0; i < p.elements; i++) {
    const ply_element *e = &p.element[i];
    if (e->vertex)
      return ply_read_vertices(r, &p, e);
    for (unsigned long long n = 0; e->properties && n < e->count; n++)
      if (!ply_read_instance(r, &p, e, skipped))
        return false;
  }
  return fail(r, ZS_ERROR_SYNTAX, "there is no element named vertex");
}

/* ---- Points ------------------------------------------------------------------------ */

/* Columns from..to of the rows as an array; NULL when memory is out. */
static double *columns(const reader *r, unsigned from, unsigned to)
{
  const size_t width = to - from;
  double *array = malloc(r->count * width * sizeof *array);
  for (size_t i = 0; array && i < r->count; i++)
    memcpy(array + i * width, r->rows + i * NUMBERS + from, width * sizeof *array);
  return array;
}

static bool deliver(const reader *r, zs_points *points)
{
  points->count = r->count;
  points->positions = columns(r, 0, 3);
  points->normals = r->has[3] ? columns(r, 3, 6) : NULL;
  points->values = r->has[6] ? columns(r, 6, 7) : NULL;
  if (points->positions && (points->normals || !r->has[3]) && (points->values || !r->has[6]))
    return true;
  zs_points_clear(points);
  return zs_fail_memory(r->file.diag);
}

static bool read_all(reader *r)
{
  zs_line_result result = zs_text_file_next(&r->file);
  if (result == ZS_LINE_FAILED)
    return false;
  const char *at = r->file.text;
  size_t length = zs_text_word(&at);
  if (!(word_is(at, length, "ply") ? read_ply(r) : read_text(r)))
    return false;
  if (r->count)
    return true;
  r->file.line = 0;
  return fail(r, ZS_ERROR_SYNTAX, "there are no points in this file");
}

bool zs_points_read(zs_points *points, const char *path, zs_diag *diag)
{
  *points = (zs_points){0};
  reader *r = calloc(1, sizeof *r);
  if (!r)
    return zs_fail_memory(diag);
  r->file.path = path;
  r->file.diag = diag;
  r->file.stream = fopen(path, "rb");
  bool done = false;
  if (!r->file.stream) {
    zs_fail(diag, ZS_ERROR_IO, path, "cannot be opened: %s", strerror(errno));
  } else {
    done = read_all(r) && deliver(r, points);
    fclose(r->file.stream);
  }
  free(r->rows);
  free(r);
  return done;
}

void zs_points_clear(zs_points *points)
{
  free(points->positions);
  free(points->normals);
  free(points->values);
  *points = (zs_points){0};
}
