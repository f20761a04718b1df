/* Numbers in text files, whatever the locale. */
#ifndef ZS_NUMBER_H
#define ZS_NUMBER_H

enum { ZS_NUMBER_SIZE = 32 };

/* The shortest of 15, 16 or 17 digits that reads back as the same double, with
 * a decimal point.  Returns `text`. */
const char *zs_number_format(char text[ZS_NUMBER_SIZE], double number);

#endif
