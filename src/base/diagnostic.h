/* Reporting to the caller's sink. */
#ifndef ZS_DIAGNOSTIC_H
#define ZS_DIAGNOSTIC_H

#include "base/arena.h"
#include "zeroset.h"

/* Where the first lines of a text begin, as far as they have been asked for. */
typedef struct zs_lines {
  zs_arena *arena;
  size_t *starts;
  uint32_t count, capacity;
} zs_lines;

/* A text that diagnostics can point into. */
typedef struct zs_source {
  const char *name; /* the file, as the user would write it */
  const char *text; /* may be NULL */
  size_t length;
  zs_lines *lines; /* NULL: lines are counted anew for every diagnostic */
} zs_source;

/* Where something stands in a source. */
typedef struct zs_place {
  const zs_source *source; /* NULL: nowhere */
  uint32_t line, column;   /* 1-based; column in characters */
  const char *element, *attribute; /* may be NULL */
} zs_place;

/* Report to a sink that may be NULL, about a place that may be NULL.  The hint
 * may be NULL.  Always returns false, so that `return zs_report(...)` reads
 * well. */
bool zs_report(zs_diag *diag, zs_severity severity, zs_status status, const zs_place *place,
               const char *hint, const char *format, ...) __attribute__((format(printf, 6, 7)));

/* An error with no place: `file` may be NULL. */
bool zs_fail(zs_diag *diag, zs_status status, const char *file, const char *format, ...)
  __attribute__((format(printf, 4, 5)));

/* Out of memory. */
bool zs_fail_memory(zs_diag *diag);

/* The closest of `count` names to a misspelt word, or NULL if none is near. */
const char *zs_suggest(const char *word, const char *const *names, size_t count);

#endif
