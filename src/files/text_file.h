/* Files of numbers in columns: lines, words, messages. */
#ifndef ZS_TEXT_FILE_H
#define ZS_TEXT_FILE_H

#include "base/diagnostic.h"

#include <stdio.h>

enum { ZS_TEXT_FILE_LINE = 4096 };

/* A file that is being read. */
typedef struct zs_text_file {
  FILE *stream;
  const char *path;
  zs_diag *diag;
  unsigned line; /* the number of the line read last; 0: of none */
  char text[ZS_TEXT_FILE_LINE]; /* of that line, without its end */
  size_t length;
} zs_text_file;

typedef enum zs_line_result { ZS_LINE_READ, ZS_LINE_END, ZS_LINE_FAILED } zs_line_result;

/* Read the next line; reports lines that are too long and bytes 0. */
zs_line_result zs_text_file_next(zs_text_file *file);

/* Report at the line; both return false. */
bool zs_text_file_fail(const zs_text_file *file, zs_status status, const char *message);
bool zs_text_file_fail_word(const zs_text_file *file, const char *word, size_t length,
                            const char *expected);

/* The length of the next word at or after *at, which is moved there; 0: only a
 * comment, begun by '#', or nothing follows.  Words are separated by blanks,
 * commas and semicolons. */
size_t zs_text_word(const char **at);

/* A whole word as a finite number. */
bool zs_text_number(const char *word, size_t length, double *number);

#endif
