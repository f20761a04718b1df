#include "language/text.h"

#include "files/number.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Make room for `count` more bytes and the NUL. */
static bool reserve(zs_text *text, size_t count)
{
  if (text->failed)
    return false;
  size_t needed = text->length + count + 1;
  if (needed <= text->capacity)
    return true;
  size_t capacity = 2 * needed;
  char *data = realloc(text->data, capacity);
  text->failed = !data;
  if (!data)
    return false;
  text->data = data;
  text->capacity = capacity;
  return true;
}

void zs_text_add_bytes(zs_text *text, const char *bytes, size_t count)
{
  if (!reserve(text, count))
    return;
  memcpy(text->data + text->length, bytes, count);
  text->length += count;
  text->data[text->length] = '\0';
}

void zs_text_add(zs_text *text, const char *string)
{
  zs_text_add_bytes(text, string, strlen(string));
}

void zs_text_format(zs_text *text, const char *format, ...)
{
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  int length = vsnprintf(NULL, 0, format, arguments);
  va_end(arguments);
  if (length < 0) {
    text->failed = true;
  } else if (reserve(text, (size_t)length)) {
    vsnprintf(text->data + text->length, (size_t)length + 1, format, again);
    text->length += (size_t)length;
  }
  va_end(again);
}

void zs_text_add_number(zs_text *text, double value)
{
  char number[ZS_NUMBER_SIZE];
  zs_text_add(text, zs_number_format(number, value));
}

void zs_text_add_xml(zs_text *text, const char *string)
{
  static const char special[] = "&<>\"";
  static const char *const entities[] = {"&amp;", "&lt;", "&gt;", "&quot;"};
  while (*string) {
    size_t plain = strcspn(string, special);
    zs_text_add_bytes(text, string, plain);
    string += plain;
    if (*string)
      zs_text_add(text, entities[strchr(special, *string++) - special]);
  }
}

char *zs_text_finish(zs_text *text)
{
  char *data = text->failed ? NULL : text->data;
  if (!data)
    free(text->data);
  *text = (zs_text){0};
  return data;
}
