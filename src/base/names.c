#include "base/names.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

enum { FIRST_CAPACITY = 32 };

/* FNV-1a. */
static uint32_t hash_of(const char *text, size_t length)
{
  uint32_t hash = 2166136261u;
  for (size_t i = 0; i < length; i++)
    hash = (hash ^ (unsigned char)text[i]) * 16777619u;
  return hash;
}

/* The slot that holds a name, or the free one where it belongs. */
static zs_name *slot_of(const zs_names *names, const char *text, size_t length, uint32_t hash)
{
  for (uint32_t i = hash;; i++) {
    zs_name *slot = &names->slots[i & (names->capacity - 1)];
    if (!slot->text || (slot->hash == hash && slot->length == length &&
                        memcmp(slot->text, text, length) == 0))
      return slot;
  }
}

const zs_name *zs_names_find(const zs_names *names, const char *text, size_t length)
{
  if (!names->capacity)
    return NULL;
  const zs_name *slot = slot_of(names, text, length, hash_of(text, length));
  return slot->text ? slot : NULL;
}

static bool grow(zs_names *names, zs_arena *arena)
{
  zs_names larger = {.capacity = names->capacity ? 2 * names->capacity : FIRST_CAPACITY,
                     .count = names->count};
  if (!larger.capacity)
    return false;
  larger.slots = ZS_ARENA_NEW(arena, zs_name, larger.capacity);
  if (!larger.slots)
    return false;
  for (uint32_t i = 0; i < names->capacity; i++) {
    const zs_name *slot = &names->slots[i];
    if (slot->text)
      *slot_of(&larger, slot->text, slot->length, slot->hash) = *slot;
  }
  *names = larger;
  return true;
}

bool zs_names_add(zs_names *names, zs_arena *arena, const char *text, size_t length,
                  uint32_t value)
{
  /* At most two thirds full, so that searches stay short. */
  if (names->count >= names->capacity / 3 * 2 && !grow(names, arena))
    return false;
  uint32_t hash = hash_of(text, length);
  *slot_of(names, text, length, hash) = (zs_name){text, length, hash, value};
  names->count++;
  return true;
}

int zs_compare_naturally(const char *a, const char *b)
{
  while (*a && *b) {
    if (isdigit((unsigned char)*a) && isdigit((unsigned char)*b)) {
      a += strspn(a, "0");
      b += strspn(b, "0");
      const size_t m = strspn(a, "0123456789"), n = strspn(b, "0123456789");
      const int order = m != n ? (m < n ? -1 : 1) : strncmp(a, b, m);
      if (order)
        return order;
      a += m;
      b += n;
    } else if (*a != *b) {
      break;
    } else {
      a++;
      b++;
    }
  }
  return (unsigned char)*a - (unsigned char)*b;
}

bool zs_name_ends_in(const char *name, const char *ending)
{
  const size_t length = strlen(name), n = strlen(ending);
  return length > n && strcasecmp(name + length - n, ending) == 0;
}
