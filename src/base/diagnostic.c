#include "base/diagnostic.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MESSAGE_SIZE = 1024, LINE_SIZE = 1024, LONGEST_NAME = 64 };

/* Remember where one more line begins; false when memory is out. */
static bool add_line(zs_lines *lines, size_t start)
{
  if (lines->count == lines->capacity) {
    uint32_t capacity = lines->capacity ? 2 * lines->capacity : 64;
    size_t *starts = zs_arena_reserve(lines->arena, capacity, sizeof *starts);
    if (!starts)
      return false;
    if (lines->count)
      memcpy(starts, lines->starts, lines->count * sizeof *starts);
    lines->starts = starts;
    lines->capacity = capacity;
  }
  lines->starts[lines->count++] = start;
  return true;
}

/* Where line `number` begins; NULL when there is none.  A text with an error in
 * every line would be searched through for each of them, had it no list. */
static const char *find_line(const zs_source *source, uint32_t number)
{
  zs_lines *lines = source->lines;
  if (lines && number <= lines->count)
    return source->text + lines->starts[number - 1];
  uint32_t known = lines && lines->count ? lines->count : 1;
  const char *at = source->text + (known > 1 ? lines->starts[known - 1] : 0);
  const char *end = source->text + source->length;
  for (;; known++) {
    if (lines && known > lines->count && !add_line(lines, (size_t)(at - source->text)))
      lines = NULL;
    const char *newline = known < number ? memchr(at, '\n', (size_t)(end - at)) : NULL;
    if (!newline)
      return known == number ? at : NULL;
    at = newline + 1;
  }
}

/* Copy line `number` of a source, cut to the buffer. */
static const char *source_line(const zs_source *source, uint32_t number, char line[LINE_SIZE])
{
  const char *at = source && source->text && number ? find_line(source, number) : NULL;
  if (!at)
    return NULL;
  const char *end = source->text + source->length;
  size_t length = 0;
  while (at + length < end && length < LINE_SIZE - 1 && at[length] != '\n' && at[length] != '\r')
    length++;
  for (size_t i = 0; i < length; i++)
    line[i] = at[i] ? at[i] : ' ';
  line[length] = '\0';
  return line;
}

static bool report(zs_diag *diag, zs_severity severity, zs_status status, const zs_place *place,
                   const char *hint, const char *format, va_list arguments)
{
  if (!diag)
    return false;
  if (severity == ZS_ERROR) {
    if (!diag->errors)
      diag->status = status;
    diag->errors++;
  } else if (severity == ZS_WARNING) {
    diag->warnings++;
  }
  if (!diag->report)
    return false;
  char message[MESSAGE_SIZE], line[LINE_SIZE];
  vsnprintf(message, sizeof message, format, arguments);
  zs_diagnostic d = {.severity = severity, .code = status, .message = message, .hint = hint};
  if (place) {
    d.file = place->source ? place->source->name : NULL;
    d.line = place->line;
    d.column = place->column;
    d.element = place->element;
    d.attribute = place->attribute;
    d.source_line = source_line(place->source, place->line, line);
  }
  diag->report(diag->context, &d);
  return false;
}

bool zs_report(zs_diag *diag, zs_severity severity, zs_status status, const zs_place *place,
               const char *hint, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  report(diag, severity, status, place, hint, format, arguments);
  va_end(arguments);
  return false;
}

bool zs_fail(zs_diag *diag, zs_status status, const char *file, const char *format, ...)
{
  zs_source source = {.name = file};
  zs_place place = {.source = file ? &source : NULL};
  va_list arguments;
  va_start(arguments, format);
  report(diag, ZS_ERROR, status, &place, NULL, format, arguments);
  va_end(arguments);
  return false;
}

bool zs_fail_memory(zs_diag *diag)
{
  return zs_fail(diag, ZS_ERROR_MEMORY, NULL, "out of memory");
}

/* Edits (insertion, deletion, substitution, swap of neighbours) between two
 * words of at most LONGEST_NAME characters. */
static size_t edit_distance(const char *a, size_t m, const char *b, size_t n)
{
  size_t row[3][LONGEST_NAME + 1];
  size_t *before = row[0], *previous = row[1], *current = row[2];
  for (size_t j = 0; j <= n; j++)
    previous[j] = j;
  for (size_t i = 1; i <= m; i++) {
    current[0] = i;
    for (size_t j = 1; j <= n; j++) {
      size_t best = previous[j - 1] + (a[i - 1] != b[j - 1]);
      if (previous[j] + 1 < best)
        best = previous[j] + 1;
      if (current[j - 1] + 1 < best)
        best = current[j - 1] + 1;
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] &&
          before[j - 2] + 1 < best)
        best = before[j - 2] + 1;
      current[j] = best;
    }
    size_t *oldest = before;
    before = previous;
    previous = current;
    current = oldest;
  }
  return previous[n];
}

const char *zs_suggest(const char *word, const char *const *names, size_t count)
{
  size_t length = strlen(word);
  if (length > LONGEST_NAME)
    return NULL;
  const char *best = NULL;
  size_t least = length / 3 + 2; /* further off is a guess, not a help */
  for (size_t i = 0; i < count; i++) {
    size_t n = strlen(names[i]);
    if (n > LONGEST_NAME)
      continue;
    size_t distance = edit_distance(word, length, names[i], n);
    if (distance < least) {
      least = distance;
      best = names[i];
    }
  }
  return best;
}
