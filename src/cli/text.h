/* Numbers and words on the command line.  The program never calls setlocale,
 * so the C locale is in effect and its decimal separator is a point. */
#ifndef CLI_TEXT_H
#define CLI_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A decimal number at the start of `text`, after blanks.  Returns where it
 * ends, or NULL: hexadecimal numbers, "nan", "inf" and numbers too large for a
 * double are none. */
const char *cli_number_scan(const char *text, double *value);

/* The whole text as one decimal number. */
bool cli_number_parse(const char *text, double *value);

/* Numbers separated by blanks or commas, nothing else: returns how many, or 0
 * when the text is malformed or has more than `capacity`. */
size_t cli_numbers_parse(const char *text, double *values, size_t capacity);

/* The whole text as a whole number in minimum .. maximum. */
bool cli_integer_parse(const char *text, uint64_t minimum, uint64_t maximum, uint64_t *value);

/* A number of bytes: a positive number with an optional K, M, G or T (powers of
 * 1024), which "B" or "iB" may follow. */
bool cli_bytes_parse(const char *text, uint64_t *value);

/* The closest of a list of `count` names to a misspelt word, or NULL if none is
 * near. */
const char *cli_suggest(const char *word, const char *const *names, size_t count);

/* The bytes of the UTF-8 character at the start of `text`, or 0 when it is none,
 * or one that controls a terminal; the end of the text counts as one of those. */
size_t cli_character_length(const char *text);

/* Whether `text` ends in `ending`, upper and lower case alike. */
bool cli_ends_with(const char *text, const char *ending);

/* The name of frame `index` from a pattern with exactly one %d, %4d or %04d
 * ("%%" is a percent sign), in a string for free().  NULL when the pattern is
 * wrong, or memory is out (errno is then ENOMEM). */
char *cli_frame_name(const char *pattern, unsigned index);

#endif
