/* Reading meshes: the formats by name, and what their readers share. */
#define _POSIX_C_SOURCE 200809L /* fileno, fstat */
#include "mesh/input.h"

#include "base/array.h"
#include "base/expression.h"
#include "base/names.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { SHOWN = 40 /* characters of a word in a message */ };

/* ---- Text ------------------------------------------------------------------ */

static bool is_space(char c)
{
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

static void skip_space(zs_mesh_input *input)
{
  while (input->at < input->line_end && is_space(input->source.text[input->at]))
    input->at++;
}

/* The line that begins at `start`. */
static void begin_line(zs_mesh_input *input, size_t start)
{
  const char *text = input->source.text;
  const char *end = memchr(text + start, '\n', input->source.length - start);
  input->at = start;
  input->line_end = end ? (size_t)(end - text) : input->source.length;
  input->line++;
  input->word = NULL;
}

bool zs_input_line(zs_mesh_input *input)
{
  size_t start = input->line ? input->line_end + 1 : 0;
  for (; start < input->source.length; start = input->line_end + 1) {
    begin_line(input, start);
    skip_space(input);
    if (input->at < input->line_end && input->source.text[input->at] != '#')
      return true;
  }
  return false;
}

bool zs_input_word(zs_mesh_input *input)
{
  const char *text = input->source.text;
  skip_space(input);
  if (input->at >= input->line_end || text[input->at] == '#') {
    input->word = NULL;
    return false;
  }
  size_t start = input->at;
  while (input->at < input->line_end && !is_space(text[input->at]))
    input->at++;
  input->word = text + start;
  input->word_length = input->at - start;
  return true;
}

bool zs_input_token(zs_mesh_input *input)
{
  while (!zs_input_word(input))
    if (!zs_input_line(input))
      return zs_input_fail_truncated(input);
  return true;
}

bool zs_input_is(const zs_mesh_input *input, const char *text)
{
  return input->word && input->word_length == strlen(text) &&
         strncasecmp(input->word, text, input->word_length) == 0;
}

bool zs_input_number(zs_mesh_input *input, double *number)
{
  if (zs_number_parse(input->word, input->word_length, number) == input->word_length)
    return true;
  return zs_input_fail(input, "'%.*s' is not a number",
                       (int)(input->word_length < SHOWN ? input->word_length : SHOWN),
                       input->word);
}

bool zs_input_count(zs_mesh_input *input, uint32_t *count)
{
  uint64_t n = 0;
  size_t i = 0;
  for (; i < input->word_length && input->word[i] >= '0' && input->word[i] <= '9'; i++)
    if (n < UINT32_MAX)
      n = 10 * n + (uint64_t)(input->word[i] - '0');
  if (i < input->word_length || n >= UINT32_MAX)
    return zs_input_fail(input, "'%.*s' is not a whole number from 0 to %u",
                         (int)(input->word_length < SHOWN ? input->word_length : SHOWN),
                         input->word, UINT32_MAX - 1);
  *count = (uint32_t)n;
  return true;
}

bool zs_input_numbers(zs_mesh_input *input, double *numbers, unsigned n)
{
  for (unsigned i = 0; i < n; i++) {
    if (!zs_input_word(input))
      return zs_input_fail(input, "the line ends after %u of %u numbers", i, n);
    if (!zs_input_number(input, &numbers[i]))
      return false;
  }
  return true;
}

/* 1-based column, in characters, of the latest word or the line's end. */
static uint32_t column(const zs_mesh_input *input)
{
  const char *text = input->source.text, *at = input->word ? input->word : text + input->at;
  uint32_t characters = 1;
  while (at > text && at[-1] != '\n') {
    at--;
    characters += ((unsigned char)*at & 0xc0) != 0x80; /* not inside a UTF-8 character */
  }
  return characters;
}

bool zs_input_fail(zs_mesh_input *input, const char *format, ...)
{
  char message[256];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  zs_place place = {.source = &input->source, .line = input->line};
  if (input->line)
    place.column = column(input);
  return zs_report(input->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL, "%s", message);
}

bool zs_input_fail_truncated(zs_mesh_input *input)
{
  return zs_input_fail(input, "the file ends too early");
}

/* ---- Binary data ------------------------------------------------------------ */

float zs_float_of_bits(uint32_t bits)
{
  float number;
  memcpy(&number, &bits, sizeof number);
  return number;
}

double zs_double_of_bits(uint64_t bits)
{
  double number;
  memcpy(&number, &bits, sizeof number);
  return number;
}

/* ---- Building ---------------------------------------------------------------- */

void *zs_input_grow(zs_mesh_input *input, void *array, size_t *capacity, size_t count,
                    size_t size)
{
  void *grown = zs_array_grown(array, count, capacity, size);
  if (!grown)
    zs_fail_memory(input->diag);
  return grown;
}

bool zs_input_add_vertex(zs_mesh_input *input, const double position[3])
{
  float *grown = zs_input_grow(input, input->positions, &input->vertex_capacity,
                               input->vertex_count + 1, 3 * sizeof *input->positions);
  if (!grown)
    return false;
  input->positions = grown;
  for (size_t k = 0; k < 3; k++) {
    if (!(fabs(position[k]) <= (double)FLT_MAX))
      return zs_input_fail(input, "vertex %zu has the coordinate %g; expected a number up to %g",
                           input->vertex_count, position[k], (double)FLT_MAX);
    input->positions[3 * input->vertex_count + k] = (float)position[k];
  }
  input->vertex_count++;
  return true;
}

bool zs_input_add_normal(zs_mesh_input *input, size_t vertex, const double normal[3])
{
  size_t before = input->normal_capacity;
  while (input->normal_capacity <= vertex) {
    float *grown = zs_input_grow(input, input->normals, &input->normal_capacity, vertex + 1,
                                 3 * sizeof *input->normals);
    if (!grown)
      return false;
    input->normals = grown;
  }
  memset(input->normals + 3 * before, 0,
         3 * (input->normal_capacity - before) * sizeof *input->normals);
  double length = hypot(hypot(normal[0], normal[1]), normal[2]);
  if (!(length > 0 && length <= DBL_MAX))
    return true; /* says nothing: the vertex has none unless another one follows */
  for (size_t k = 0; k < 3; k++)
    input->normals[3 * vertex + k] += (float)(normal[k] / length);
  return true;
}

bool zs_input_add_polygon(zs_mesh_input *input, const uint32_t *vertices, size_t count)
{
  if (count < 3)
    return zs_input_fail(input, "a face with %zu corners; expected at least 3", count);
  for (size_t i = 0; i < count; i++)
    if (vertices[i] >= input->highest_index) {
      input->highest_index = vertices[i];
      input->highest_line = input->line;
    }
  for (size_t i = 2; i < count; i++) {
    uint32_t *grown = zs_input_grow(input, input->triangles, &input->triangle_capacity,
                                    input->triangle_count + 1, 3 * sizeof *input->triangles);
    if (!grown)
      return false;
    input->triangles = grown;
    uint32_t *triangle = input->triangles + 3 * input->triangle_count++;
    triangle[0] = vertices[0];
    triangle[1] = vertices[i - 1];
    triangle[2] = vertices[i];
  }
  return true;
}

/* ---- The file ------------------------------------------------------------------ */

static bool fail_io(const char *path, const char *what, zs_diag *diag)
{
  return zs_fail(diag, ZS_ERROR_IO, path, "cannot read the mesh: %s", what);
}

/* The contents of a file, with a byte 0 behind them; NULL after reporting. */
static char *load(const char *path, size_t *length, zs_diag *diag)
{
  FILE *stream = fopen(path, "rb");
  struct stat status;
  char *text = NULL;
  if (!stream || fstat(fileno(stream), &status) != 0) {
    fail_io(path, strerror(errno), diag);
  } else if (!S_ISREG(status.st_mode)) {
    fail_io(path, "it is not a regular file", diag);
  } else if (!(text = malloc((size_t)status.st_size + 1))) {
    zs_fail_memory(diag);
  } else {
    *length = fread(text, 1, (size_t)status.st_size, stream);
    text[*length] = '\0';
    if (ferror(stream)) {
      fail_io(path, "the device reports an error", diag);
      free(text);
      text = NULL;
    }
  }
  if (stream)
    fclose(stream);
  return text;
}

/* Whether every vertex has a normal; makes them unit vectors. */
static bool finish_normals(zs_mesh_input *input)
{
  if (input->normal_capacity < input->vertex_count || !input->vertex_count)
    return false;
  for (size_t v = 0; v < input->vertex_count; v++) {
    float *n = input->normals + 3 * v;
    float length = hypotf(hypotf(n[0], n[1]), n[2]);
    if (!(length > 1e-6f)) /* none, or normals that cancel out */
      return false;
    for (int k = 0; k < 3; k++)
      n[k] /= length;
  }
  return true;
}

static zs_mesh *finish(zs_mesh_input *input)
{
  if (input->triangle_count && input->highest_index >= input->vertex_count) {
    input->line = input->highest_line;
    input->at = input->line_end;
    zs_place place = {.source = &input->source, .line = input->line};
    zs_report(input->diag, ZS_ERROR, ZS_ERROR_SYNTAX, &place, NULL,
              "a face has vertex %u, counted from 0; the file has %zu vertices",
              input->highest_index, input->vertex_count);
    return NULL;
  }
  if (!input->vertex_count) {
    zs_fail(input->diag, ZS_ERROR_SYNTAX, input->source.name, "the file has no vertices");
    return NULL;
  }
  bool normals = finish_normals(input);
  zs_mesh *mesh = zs_mesh_new(input->vertex_count, input->triangle_count, normals, input->diag);
  if (!mesh)
    return NULL;
  memcpy(mesh->positions, input->positions, 3 * input->vertex_count * sizeof *mesh->positions);
  if (normals)
    memcpy(mesh->normals, input->normals, 3 * input->vertex_count * sizeof *mesh->normals);
  if (input->triangle_count)
    memcpy(mesh->triangles, input->triangles,
           3 * input->triangle_count * sizeof *mesh->triangles);
  return mesh;
}

/* ---- Formats ---------------------------------------------------------------------- */

typedef struct format {
  const char *ending;
  bool (*read)(zs_mesh_input *input);
} format;

static const format formats[] = {
  {".stl", zs_mesh_read_stl}, {".ply", zs_mesh_read_ply}, {".obj", zs_mesh_read_obj},
  {".off", zs_mesh_read_off}, {".om", zs_mesh_read_om},
};

static const format *format_of(const char *path)
{
  for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
    if (zs_name_ends_in(path, formats[i].ending))
      return &formats[i];
  return NULL;
}

zs_mesh *zs_mesh_read(const char *path, zs_diag *diag)
{
  const format *f = format_of(path);
  if (!f) {
    zs_fail(diag, ZS_ERROR_ARGUMENT, path,
            "the ending of the name is no mesh format; expected .stl .ply .obj .off or .om");
    return NULL;
  }
  size_t length = 0;
  char *text = load(path, &length, diag);
  if (!text)
    return NULL;
  zs_mesh_input input = {.source = {.name = path, .text = text, .length = length}, .diag = diag};
  zs_mesh *mesh = f->read(&input) ? finish(&input) : NULL;
  free(input.positions);
  free(input.normals);
  free(input.triangles);
  free(text);
  return mesh;
}
