/* A locale whose decimal separator is a comma, on machines that have none. */
#ifndef ZS_TEST_COMMA_LOCALE_H
#define ZS_TEST_COMMA_LOCALE_H

#include <locale.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* glibc's compiled form of the category LC_NUMERIC: a magic number, offsets of
 * the items, the items. */
static inline bool write_comma_locale(const char *path)
{
  static const struct {
    uint32_t magic, count, offsets[6];
    char point[2], separator[1], grouping[1];
    uint32_t wide_point, wide_separator;
    char codeset[8];
  } file = {0x20031115 ^ LC_NUMERIC, 6, {32, 34, 35, 36, 40, 44}, ",", "", "", ',', 0, "UTF-8"};
  FILE *stream = fopen(path, "wb");
  if (!stream)
    return false;
  bool written = fwrite(&file, sizeof file, 1, stream) == 1;
  return fclose(stream) == 0 && written;
}

/* Set a comma locale for the rest of the program; false where there is none. */
static inline bool set_comma_locale(void)
{
  static const char *const names[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE", "fr_FR"};
  char text[8];
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
    if (setlocale(LC_NUMERIC, names[i]))
      return true;
  char folder[] = "/tmp/comma-XXXXXX", locale[64], path[96];
  if (!mkdtemp(folder))
    return false;
  snprintf(locale, sizeof locale, "%s/xx_XX", folder);
  snprintf(path, sizeof path, "%s/LC_NUMERIC", locale);
  setenv("LOCPATH", folder, 1);
  bool set = mkdir(locale, 0700) == 0 && write_comma_locale(path) &&
             setlocale(LC_NUMERIC, "xx_XX");
  unlink(path);
  rmdir(locale);
  rmdir(folder);
  snprintf(text, sizeof text, "%.1f", 0.5);
  return set && strcmp(text, "0,5") == 0;
}

#endif
