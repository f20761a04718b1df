/* Names: a table from them to numbers, such as places in an array, their natural order and their
 * endings. */
#ifndef ZS_NAMES_H
#define ZS_NAMES_H

#include "base/arena.h"

#include <stdint.h>

typedef struct zs_name {
  const char *text; /* borrowed, not NUL-terminated; NULL: a free slot */
  size_t length;
  uint32_t hash, value;
} zs_name;

/* A zero-initialised table is empty and ready to use.  Slots live in the arena
 * that every call to zs_names_add must be given. */
typedef struct zs_names {
  zs_name *slots;
  uint32_t capacity, count;
} zs_names;

/* The entry of a name, or NULL.  Borrowed until the next zs_names_add. */
const zs_name *zs_names_find(const zs_names *names, const char *text, size_t length);

/* Add a name that is not in the table; false when memory is out. */
bool zs_names_add(zs_names *names, zs_arena *arena, const char *text, size_t length,
                  uint32_t value);

/* Less than, equal to or greater than 0 as a comes before, with or after b: digits compare as
 * numbers, all else byte by byte. */
int zs_compare_naturally(const char *a, const char *b);

/* Whether a name is something and then an ending (".nii.gz"), in either case. */
bool zs_name_ends_in(const char *name, const char *ending);

#endif
