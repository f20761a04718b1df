/* Diagnostics as text, as the program prints them but for the source line. */
#ifndef ZS_TEST_PRINT_H
#define ZS_TEST_PRINT_H

#include "zeroset.h"

#include <stdio.h>
#include <string.h>

typedef struct printed {
  char text[1 << 16];
  size_t length;
} printed;

__attribute__((format(printf, 2, 3))) static inline void print_more(printed *p, const char *format,
                                                                    ...)
{
  va_list arguments;
  va_start(arguments, format);
  int n = vsnprintf(p->text + p->length, sizeof p->text - p->length, format, arguments);
  va_end(arguments);
  if (n > 0 && (size_t)n < sizeof p->text - p->length)
    p->length += (size_t)n;
}

/* The report function of a sink whose context is a `printed`. */
static inline void print_diagnostic(void *context, const zs_diagnostic *d)
{
  static const char *const severities[] = {"note", "warning", "error"};
  printed *p = context;
  if (d->file)
    print_more(p, "%s:", d->file);
  if (d->line)
    print_more(p, "%u:%u:", d->line, d->column);
  print_more(p, "%s%s: ", p->length && p->text[p->length - 1] == ':' ? " " : "",
             severities[d->severity]);
  if (d->element)
    print_more(p, "<%s>: ", d->element);
  if (d->attribute)
    print_more(p, "%s: ", d->attribute);
  print_more(p, "%s", d->message);
  if (d->hint)
    print_more(p, "; %s", d->hint);
  print_more(p, "\n");
}

#endif
