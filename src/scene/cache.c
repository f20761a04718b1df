#include "scene/scene.h"

#include "base/array.h"

#include <stdlib.h>

enum { KEPT = 8 }; /* compilations that an entry outlives without being used */

typedef struct entry {
  uint64_t key[2];
  void *data;
  const zs_cache_type *type;
  unsigned used; /* the compilation that asked for it last */
} entry;

struct zs_cache {
  entry *entries;
  size_t count, capacity;
  unsigned compilation;
};

zs_cache *zs_cache_new(void)
{
  return calloc(1, sizeof(zs_cache));
}

void zs_cache_free(zs_cache *cache)
{
  if (!cache)
    return;
  for (size_t i = 0; i < cache->count; i++)
    cache->entries[i].type->unref(cache->entries[i].data);
  free(cache->entries);
  free(cache);
}

void zs_cache_advance(zs_cache *cache)
{
  cache->compilation++;
  size_t kept = 0;
  for (size_t i = 0; i < cache->count; i++) {
    entry *e = &cache->entries[i];
    if (cache->compilation - e->used > KEPT)
      e->type->unref(e->data);
    else
      cache->entries[kept++] = *e;
  }
  cache->count = kept;
}

/* Fits take far longer than looking through a list of them. */
static entry *find(const zs_cache *cache, const uint64_t key[2], const zs_cache_type *type)
{
  for (size_t i = 0; i < cache->count; i++) {
    entry *e = &cache->entries[i];
    if (e->key[0] == key[0] && e->key[1] == key[1] && e->type == type)
      return e;
  }
  return NULL;
}

void *zs_cache_find(zs_cache *cache, const uint64_t key[2], const zs_cache_type *type)
{
  entry *e = cache ? find(cache, key, type) : NULL;
  if (!e)
    return NULL;
  e->used = cache->compilation;
  return type->ref(e->data);
}

bool zs_cache_add(zs_cache *cache, const uint64_t key[2], const zs_cache_type *type, void *data)
{
  if (!cache)
    return true;
  entry *e = find(cache, key, type);
  if (e) {
    void *old = e->data;
    e->data = type->ref(data);
    e->used = cache->compilation;
    type->unref(old);
    return true;
  }
  entry *entries =
    zs_array_grown(cache->entries, cache->count + 1, &cache->capacity, sizeof *entries);
  if (!entries)
    return false;
  cache->entries = entries;
  entries[cache->count++] =
    (entry){{key[0], key[1]}, type->ref(data), type, cache->compilation};
  return true;
}

bool zs_cache_each(const zs_cache *cache, const zs_cache_type *type,
                   bool (*visit)(void *context, void *data), void *context)
{
  for (size_t i = 0; i < cache->count; i++) {
    const entry *e = &cache->entries[i];
    if (e->type == type && e->used == cache->compilation && !visit(context, e->data))
      return false;
  }
  return true;
}
