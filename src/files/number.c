#include "files/number.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *zs_number_format(char text[ZS_NUMBER_SIZE], double number)
{
  char local[2 * ZS_NUMBER_SIZE];
  /* Printing and reading follow the same locale, whichever it is. */
  for (int digits = 15; digits <= 17; digits++) {
    snprintf(local, sizeof local, "%.*g", digits, number);
    if (strtod(local, NULL) == number)
      break;
  }
  /* Its decimal point, of one or more bytes, is all that is not ASCII for
   * numbers, nor the letters of inf and nan. */
  size_t n = 0;
  bool point = false;
  for (const char *at = local; *at && n < ZS_NUMBER_SIZE - 1; at++) {
    if (strchr("0123456789+-einfa", *at)) {
      text[n++] = *at;
      point = false;
    } else if (!point) {
      text[n++] = '.';
      point = true;
    }
  }
  text[n] = '\0';
  return text;
}
