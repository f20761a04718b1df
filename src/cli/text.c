#include "cli/text.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool blank(char c)
{
  return c == ' ' || (c >= '\t' && c <= '\r');
}

static bool digit(char c)
{
  return c >= '0' && c <= '9';
}

const char *cli_number_scan(const char *text, double *value)
{
  while (blank(*text))
    text++;
  const char *first = text + (*text == '-' || *text == '+');
  if (!digit(first[0]) && !(first[0] == '.' && digit(first[1])))
    return NULL;
  if (first[0] == '0' && (first[1] == 'x' || first[1] == 'X'))
    return NULL;
  char *end;
  *value = strtod(text, &end);
  return isfinite(*value) ? end : NULL;
}

bool cli_number_parse(const char *text, double *value)
{
  return cli_numbers_parse(text, value, 1) == 1;
}

size_t cli_numbers_parse(const char *text, double *values, size_t capacity)
{
  size_t count = 0;
  for (;;) {
    while (blank(*text))
      text++;
    if (count && *text == ',')
      text++;
    else if (!*text)
      return count;
    double value;
    const char *end = cli_number_scan(text, &value);
    if (!end || count == capacity || (*end && !blank(*end) && *end != ','))
      return 0;
    values[count++] = value;
    text = end;
  }
}

bool cli_integer_parse(const char *text, uint64_t minimum, uint64_t maximum, uint64_t *value)
{
  if (!digit(*text))
    return false;
  char *end;
  errno = 0;
  unsigned long long number = strtoull(text, &end, 10);
  if (*end || errno == ERANGE || number < minimum || number > maximum)
    return false;
  *value = number;
  return true;
}

bool cli_bytes_parse(const char *text, uint64_t *value)
{
  static const char suffixes[] = "kmgt";
  double number;
  const char *end = cli_number_scan(text, &number);
  if (!end)
    return false;
  const char *suffix = *end ? strchr(suffixes, tolower((unsigned char)*end)) : NULL;
  if (suffix) {
    number = ldexp(number, 10 * (int)(suffix - suffixes + 1));
    end++;
  }
  if (suffix && end[0] == 'i' && end[1] == 'B')
    end++;
  if (*end == 'B')
    end++;
  if (*end || number < 1 || number >= 0x1p63)
    return false;
  *value = (uint64_t)number;
  return true;
}

enum { LONGEST_WORD = 32 };

/* Insertions, deletions, substitutions and swaps of neighbours between two
 * words (optimal string alignment). */
static size_t edit_distance(const char *a, size_t m, const char *b, size_t n)
{
  size_t row[3][LONGEST_WORD + 1];
  for (size_t j = 0; j <= n; j++)
    row[0][j] = j;
  for (size_t i = 1; i <= m; i++) {
    size_t *now = row[i % 3], *before = row[(i + 2) % 3], *earlier = row[(i + 1) % 3];
    now[0] = i;
    for (size_t j = 1; j <= n; j++) {
      size_t best = before[j - 1] + (a[i - 1] != b[j - 1]);
      if (before[j] + 1 < best)
        best = before[j] + 1;
      if (now[j - 1] + 1 < best)
        best = now[j - 1] + 1;
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && earlier[j - 2] < best)
        best = earlier[j - 2] + 1;
      now[j] = best;
    }
  }
  return row[m % 3][n];
}

const char *cli_suggest(const char *word, const char *const *names, size_t count)
{
  size_t m = strlen(word);
  if (m == 0 || m > LONGEST_WORD)
    return NULL;
  const char *nearest = NULL;
  size_t least = m / 3 + 2; /* short words must be nearer */
  for (size_t i = 0; i < count; i++) {
    size_t n = strlen(names[i]);
    if (n > LONGEST_WORD)
      continue;
    size_t distance = edit_distance(word, m, names[i], n);
    if (distance < least && distance < n) {
      least = distance;
      nearest = names[i];
    }
  }
  return nearest;
}

size_t cli_character_length(const char *text)
{
  const unsigned char *c = (const unsigned char *)text;
  if (c[0] < 0x80)
    return c[0] >= ' ' && c[0] != 0x7f;
  size_t length = c[0] >= 0xf0 ? 4 : c[0] >= 0xe0 ? 3 : 2;
  uint32_t code = c[0] & (0xffu >> (length + 1));
  for (size_t i = 1; i < length; i++) {
    if ((c[i] & 0xc0) != 0x80)
      return 0;
    code = code << 6 | (c[i] & 0x3f);
  }
  /* Below 0xa0 are control characters and what has a shorter form. */
  static const uint32_t least[] = {0xa0, 0x800, 0x10000};
  bool surrogate = code >= 0xd800 && code <= 0xdfff;
  bool good = c[0] >= 0xc0 && c[0] <= 0xf4 && code >= least[length - 2] && code <= 0x10ffff;
  return good && !surrogate ? length : 0;
}

bool cli_ends_with(const char *text, const char *ending)
{
  size_t m = strlen(text), n = strlen(ending);
  if (m < n)
    return false;
  for (size_t i = 0; i < n; i++)
    if (tolower((unsigned char)text[m - n + i]) != tolower((unsigned char)ending[i]))
      return false;
  return true;
}

enum { WIDEST_NUMBER = 20 };

/* The end of a %d, %4d or %04d at `text`, or NULL. */
static const char *conversion(const char *text, bool *zeros, int *width)
{
  text++;
  *zeros = *text == '0';
  *width = 0;
  while (digit(*text) && *width <= WIDEST_NUMBER)
    *width = *width * 10 + (*text++ - '0');
  return *text == 'd' && *width <= WIDEST_NUMBER ? text + 1 : NULL;
}

char *cli_frame_name(const char *pattern, unsigned index)
{
  char *name = malloc(strlen(pattern) + WIDEST_NUMBER + 1);
  if (!name)
    return NULL;
  char *out = name;
  unsigned conversions = 0;
  while (*pattern && conversions <= 1) {
    if (pattern[0] != '%') {
      *out++ = *pattern++;
    } else if (pattern[1] == '%') {
      *out++ = '%';
      pattern += 2;
    } else {
      bool zeros;
      int width;
      pattern = conversion(pattern, &zeros, &width);
      if (!pattern || conversions++)
        break;
      out += snprintf(out, WIDEST_NUMBER + 1, zeros ? "%0*u" : "%*u", width, index);
    }
  }
  *out = '\0';
  if (!pattern || conversions != 1) {
    free(name);
    errno = EINVAL;
    return NULL;
  }
  return name;
}
