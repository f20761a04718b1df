#include "cli/report.h"

#include "cli/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- Diagnostics ------------------------------------------------------- */

void cli_reporter_init(cli_reporter *reporter, bool quiet)
{
  const char *terminal = getenv("TERM");
  const char *no_colour = getenv("NO_COLOR"); /* https://no-color.org */
  *reporter = (cli_reporter){
    .quiet = quiet,
    .colour = isatty(STDERR_FILENO) && terminal && strcmp(terminal, "dumb") != 0 &&
              !(no_colour && *no_colour)};
}

void cli_reporter_clear(cli_reporter *reporter)
{
  free(reporter->seen);
}

/* FNV-1a. */
static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t count)
{
  const unsigned char *byte = bytes;
  for (size_t i = 0; i < count; i++)
    hash = (hash ^ byte[i]) * 0x100000001b3;
  return hash;
}

static uint64_t hash_text(uint64_t hash, const char *text)
{
  return text ? hash_bytes(hash, text, strlen(text) + 1) : hash_bytes(hash, "\1", 1);
}

static uint64_t diagnostic_hash(const zs_diagnostic *d)
{
  uint64_t hash = hash_text(0xcbf29ce484222325, d->file);
  hash = hash_bytes(hash, &d->line, sizeof d->line);
  hash = hash_bytes(hash, &d->column, sizeof d->column);
  hash = hash_text(hash, d->element);
  hash = hash_text(hash, d->attribute);
  return hash_text(hash, d->message);
}

/* Compiling again (a sweep, another object) finds the same things again. */
static bool seen_before(cli_reporter *reporter, const zs_diagnostic *d)
{
  uint64_t hash = diagnostic_hash(d);
  for (size_t i = 0; i < reporter->seen_count; i++)
    if (reporter->seen[i] == hash)
      return true;
  if (reporter->seen_count == reporter->seen_capacity) {
    size_t capacity = 2 * reporter->seen_capacity + 16;
    uint64_t *seen = realloc(reporter->seen, capacity * sizeof *seen);
    if (!seen)
      return false;
    reporter->seen = seen;
    reporter->seen_capacity = capacity;
  }
  reporter->seen[reporter->seen_count++] = hash;
  return false;
}

/* The next character of a text; a byte that is none counts as one. */
static const char *next_character(const char *text)
{
  size_t length = cli_character_length(text);
  return text + (length ? length : 1);
}

/* Print a part of a text, which may hold anything: nothing may reach the
 * terminal that steers it. */
static void put_part(const char *text, const char *end)
{
  while (text < end) {
    const char *next = next_character(text);
    if (cli_character_length(text))
      fwrite(text, 1, (size_t)(next - text), stderr);
    else
      fputc(*text == '\t' ? ' ' : '?', stderr);
    text = next;
  }
}

static void put_text(const char *text)
{
  put_part(text, text + strlen(text));
}

enum { MARGIN = 2, WINDOW = 100 }; /* columns of the source line that are shown */

/* Up to `count` characters further on. */
static const char *advance(const char *text, unsigned count)
{
  for (unsigned i = 0; i < count && *text; i++)
    text = next_character(text);
  return text;
}

/* The source line, or the part of a long one around the column, and a caret. */
static void put_source(const cli_reporter *reporter, const zs_diagnostic *d)
{
  unsigned column = d->column ? d->column : 1;
  unsigned skipped = column > WINDOW * 3 / 4 ? column - WINDOW / 2 : 0;
  const char *text = advance(d->source_line, skipped);
  const char *end = advance(text, WINDOW);
  fprintf(stderr, "%*s%s", MARGIN, "", skipped ? "..." : "");
  put_part(text, end);
  fputs(*end ? "...\n" : "\n", stderr);
  if (!d->column)
    return;
  unsigned indent = MARGIN + (skipped ? 3u : 0u) + column - 1 - skipped;
  fprintf(stderr, "%*s", (int)indent, "");
  fputs(reporter->colour ? "\033[1;32m^\033[m\n" : "^\n", stderr);
}

static void put_severity(const cli_reporter *reporter, zs_severity severity)
{
  static const char *const names[] = {"note", "warning", "error"};
  static const char *const colours[] = {"1;36", "1;35", "1;31"};
  if (reporter->colour)
    fprintf(stderr, "\033[%sm%s:\033[m ", colours[severity], names[severity]);
  else
    fprintf(stderr, "%s: ", names[severity]);
}

void cli_report(void *context, const zs_diagnostic *d)
{
  cli_reporter *reporter = context;
  if (d->code == ZS_CANCELLED || (reporter->quiet && d->severity != ZS_ERROR) ||
      seen_before(reporter, d))
    return;
  if (reporter->before)
    reporter->before(reporter->context);
  if (d->file)
    put_text(d->file);
  else
    fputs("zeroset", stderr);
  if (d->file && d->line)
    fprintf(stderr, ":%u", d->line);
  if (d->file && d->line && d->column)
    fprintf(stderr, ":%u", d->column);
  fputs(": ", stderr);
  put_severity(reporter, d->severity);
  if (d->element)
    fprintf(stderr, "<%s>: ", d->element);
  if (d->attribute)
    fprintf(stderr, "%s: ", d->attribute);
  put_text(d->message);
  fputc('\n', stderr);
  if (d->source_line && *d->source_line)
    put_source(reporter, d);
  if (d->hint) {
    fprintf(stderr, "%*shint: ", MARGIN, "");
    put_text(d->hint);
    fputc('\n', stderr);
  }
}

int cli_exit_status(zs_status status)
{
  switch (status) {
  case ZS_OK:
    return CLI_DONE;
  case ZS_ERROR_SYNTAX:
  case ZS_ERROR_SCHEMA:
  case ZS_ERROR_GEOMETRY:
    return CLI_WRONG_SCENE;
  case ZS_ERROR_ARGUMENT:
    return CLI_WRONG_COMMAND_LINE;
  case ZS_ERROR_IO:
    return CLI_WRONG_FILE;
  case ZS_ERROR_MEMORY:
  case ZS_ERROR_UNABLE:
  case ZS_CANCELLED:
    break;
  }
  return CLI_UNABLE;
}

/* ---- JSON -------------------------------------------------------------- */

void cli_number_text(double value, char text[32])
{
  for (int digits = 6; digits <= 17; digits++) {
    snprintf(text, 32, "%.*g", digits, value);
    if (strtod(text, NULL) == value)
      break;
  }
}

/* JSON is UTF-8, and file names may be anything: bytes that are no character
 * become U+FFFD. */
static void put_json_text(FILE *stream, const char *text)
{
  fputc('"', stream);
  while (*text) {
    size_t length = cli_character_length(text);
    if (*text == '"' || *text == '\\')
      fputc('\\', stream);
    if (length)
      fwrite(text, 1, length, stream);
    else
      fprintf(stream, "\\u%04x", (unsigned char)*text < 0x80 ? (unsigned char)*text : 0xfffd);
    text += length ? length : 1;
  }
  fputc('"', stream);
}

static void put_key(cli_json *json, const char *key)
{
  if (json->comma)
    fputs(", ", json->stream);
  json->comma = true;
  if (key) {
    put_json_text(json->stream, key);
    fputs(": ", json->stream);
  }
}

void cli_json_begin(cli_json *json, const char *key, char bracket)
{
  put_key(json, key);
  fputc(bracket, json->stream);
  json->comma = false;
}

void cli_json_end(cli_json *json, char bracket)
{
  fputc(bracket, json->stream);
  json->comma = true;
}

void cli_json_string(cli_json *json, const char *key, const char *value)
{
  put_key(json, key);
  put_json_text(json->stream, value);
}

void cli_json_number(cli_json *json, const char *key, double value)
{
  if (!isfinite(value)) {
    cli_json_null(json, key);
    return;
  }
  char text[32];
  cli_number_text(value, text);
  put_key(json, key);
  fputs(text, json->stream);
}

void cli_json_integer(cli_json *json, const char *key, int64_t value)
{
  put_key(json, key);
  fprintf(json->stream, "%lld", (long long)value);
}

void cli_json_boolean(cli_json *json, const char *key, bool value)
{
  put_key(json, key);
  fputs(value ? "true" : "false", json->stream);
}

void cli_json_null(cli_json *json, const char *key)
{
  put_key(json, key);
  fputs("null", json->stream);
}
