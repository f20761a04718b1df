/* Text that grows: for the documents that the library writes about itself. */
#ifndef ZS_LANGUAGE_TEXT_H
#define ZS_LANGUAGE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

/* A zero-initialised text is empty and ready to use.  When memory runs out it
 * stays as it is and `failed` is set. */
typedef struct zs_text {
  char *data; /* NUL-terminated once something was added */
  size_t length, capacity;
  bool failed;
} zs_text;

void zs_text_add(zs_text *text, const char *string);
void zs_text_add_bytes(zs_text *text, const char *bytes, size_t count);
/* Strings and whole numbers only: numbers with a fraction would depend on the
 * locale. */
void zs_text_format(zs_text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A number with a decimal point whatever the locale. */
void zs_text_add_number(zs_text *text, double value);
/* A string with & < > " written as XML wants them. */
void zs_text_add_xml(zs_text *text, const char *string);

/* The text, in a string for free(), or NULL if memory ran out on the way.  Ends
 * the text. */
char *zs_text_finish(zs_text *text);

#endif
