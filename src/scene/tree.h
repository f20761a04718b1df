/* The tree that a scene expands to, between the reader and the compiler. */
#ifndef ZS_TREE_H
#define ZS_TREE_H

#include "nodes/kind.h"

/* What a scene looks like for one setting of its parameters.  Owned by the
 * arena it was expanded into. */
typedef struct zs_tree {
  const zs_node *root;
  size_t node_count;
  bool has_domain;
  double domain_lo[3], domain_hi[3];
} zs_tree;

/* Expand an object (NULL: the main one) with the scene's present parameters:
 * expressions, repeat, instance, use, include; kinds' checks are run.  False
 * after reporting every error found. */
bool zs_scene_expand(zs_scene *scene, const char *object, zs_arena *arena, zs_tree *tree,
                     zs_diag *diag);

/* Expand the main object and then every object, what they share once. */
bool zs_scene_expand_all(zs_scene *scene, zs_arena *arena, const zs_node *const **roots,
                         size_t *count, zs_diag *diag);

/* Things worth computing once per scene, found again by a 128-bit hash of all
 * their inputs (fits, transforms).  Reference counted by the cache and by every
 * field that uses one. */
typedef struct zs_cache zs_cache;

/* How the cache holds one type of data.  `ref` returns its argument. */
typedef struct zs_cache_type {
  void *(*ref)(void *data);
  void (*unref)(void *data);
} zs_cache_type;

/* The data of that key and type with a new reference for the caller, or NULL.
 * `cache` may be NULL: it is then empty and stays so.  One thread at a time. */
void *zs_cache_find(zs_cache *cache, const uint64_t key[2], const zs_cache_type *type);

/* Remember data, with a reference of the cache's own; the caller keeps his.
 * Entries that several compilations in a row did not ask for are let go.  False
 * when memory is out, and nothing is remembered. */
bool zs_cache_add(zs_cache *cache, const uint64_t key[2], const zs_cache_type *type, void *data);

/* Call `visit` for all data of a type that the present compilation has asked for;
 * false, at once, when it returns false. */
bool zs_cache_each(const zs_cache *cache, const zs_cache_type *type,
                   bool (*visit)(void *context, void *data), void *context);

#endif
