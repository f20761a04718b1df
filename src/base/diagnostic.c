#include "base/diagnostic.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MESSAGE_SIZE = 1024, LINE_SIZE = 1024, LONGEST_NAME = 64 };

/* Copy line `number` of a source, cut to the buffer. */
static const char *source_line(const zs_source *source, uint32_t number, char line[LINE_SIZE])
{
  if (!source || !source->text || !number)
    return NULL;
  const char *at = source->text, *end = at + source->length;
  for (; number > 1 && at < end; number--) {
    const char *newline = memchr(at, '\n', (size_t)(end - at));
    if (!newline)
      return NULL;
    at = newline + 1;
  }
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
