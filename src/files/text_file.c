#include "files/text_file.h"

#include "base/expression.h"

#include <errno.h>
#include <math.h>
#include <string.h>

bool zs_text_file_fail(const zs_text_file *file, zs_status status, const char *message)
{
  const zs_source source = {.name = file->path};
  const zs_place place = {.source = &source, .line = file->line};
  return zs_report(file->diag, ZS_ERROR, status, &place, NULL, "%s", message);
}

bool zs_text_file_fail_word(const zs_text_file *file, const char *word, size_t length,
                            const char *expected)
{
  char message[200];
  snprintf(message, sizeof message, "'%.*s' is not %s", (int)(length < 40 ? length : 40), word,
           expected);
  return zs_text_file_fail(file, ZS_ERROR_SYNTAX, message);
}

zs_line_result zs_text_file_next(zs_text_file *file)
{
  int c;
  file->length = 0;
  file->line++;
  while ((c = getc(file->stream)) != EOF && c != '\n') {
    if (c == 0) {
      zs_text_file_fail(file, ZS_ERROR_SYNTAX, "a byte 0: this is not a text file");
      return ZS_LINE_FAILED;
    }
    if (file->length == ZS_TEXT_FILE_LINE - 1) {
      zs_text_file_fail(file, ZS_ERROR_SYNTAX, "line is longer than 4095 bytes");
      return ZS_LINE_FAILED;
    }
    file->text[file->length++] = (char)c;
  }
  file->text[file->length] = '\0';
  if (ferror(file->stream)) {
    zs_fail(file->diag, ZS_ERROR_IO, file->path, "cannot be read: %s", strerror(errno));
    return ZS_LINE_FAILED;
  }
  return c == EOF && file->length == 0 ? ZS_LINE_END : ZS_LINE_READ;
}

static bool is_separator(char c)
{
  return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r';
}

size_t zs_text_word(const char **at)
{
  const char *start = *at;
  while (is_separator(*start))
    start++;
  *at = start;
  if (*start == '#')
    return 0;
  size_t length = 0;
  while (start[length] && start[length] != '#' && !is_separator(start[length]))
    length++;
  return length;
}

bool zs_text_number(const char *word, size_t length, double *number)
{
  return zs_number_parse(word, length, number) == length && isfinite(*number);
}
