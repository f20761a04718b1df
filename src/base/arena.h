/* Memory that is freed all at once.  Not thread-safe. */
#ifndef ZS_ARENA_H
#define ZS_ARENA_H

#include <stdbool.h>
#include <stddef.h>

typedef struct zs_arena_block zs_arena_block;

typedef struct zs_arena {
  zs_arena_block *block; /* the newest; older ones are linked behind it */
  size_t used, bytes;    /* used in the newest block; total held */
} zs_arena;

typedef struct zs_arena_mark {
  zs_arena_block *block;
  size_t used;
} zs_arena_mark;

/* Zeroed memory, aligned for any type up to 64 bytes, or NULL when memory is
 * out or count * size overflows.  A zero-initialised arena is ready to use. */
void *zs_arena_alloc(zs_arena *arena, size_t count, size_t size);
/* The same with arbitrary contents, for what is about to be filled. */
void *zs_arena_reserve(zs_arena *arena, size_t count, size_t size);
#define ZS_ARENA_NEW(arena, type, count) ((type *)zs_arena_alloc((arena), (count), sizeof(type)))

/* A NUL-terminated copy of `length` bytes. */
char *zs_arena_string(zs_arena *arena, const char *text, size_t length);

/* Return to a mark taken earlier; blocks are kept for reuse. */
zs_arena_mark zs_arena_mark_here(const zs_arena *arena);
void zs_arena_rewind(zs_arena *arena, zs_arena_mark mark);

void zs_arena_free(zs_arena *arena);

#endif
