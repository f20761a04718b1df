#include "base/arena.h"

#include "base/memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { ALIGNMENT = 64, FIRST_BLOCK = 4096 };

struct zs_arena_block {
  _Alignas(ALIGNMENT) zs_arena_block *older;
  zs_arena_block *spare; /* a rewound block, next in line to be used again */
  size_t size;
  _Alignas(ALIGNMENT) unsigned char data[];
};

/* A block with room for `wanted` bytes, or NULL. */
static zs_arena_block *new_block(size_t wanted)
{
  if (wanted > SIZE_MAX / 4)
    return NULL;
  const size_t bytes = sizeof(zs_arena_block) + wanted;
  zs_arena_block *block = zs_memory_new(bytes, 1);
  if (block)
    block->size = zs_memory_room(bytes) - sizeof *block;
  return block;
}

static bool grow(zs_arena *arena, size_t size)
{
  zs_arena_block *spare = arena->block ? arena->block->spare : NULL;
  if (spare && spare->size >= size) {
    spare->older = arena->block;
    arena->block->spare = NULL;
    arena->block = spare;
    arena->used = 0;
    return true;
  }
  size_t wanted = arena->block ? 2 * arena->block->size : FIRST_BLOCK;
  if (wanted < size)
    wanted = size;
  zs_arena_block *block = new_block(wanted);
  if (!block)
    return false;
  if (spare) {
    arena->bytes -= spare->size;
    block->spare = spare->spare;
    arena->block->spare = NULL;
    free(spare);
  } else {
    block->spare = NULL;
  }
  block->older = arena->block;
  arena->block = block;
  arena->used = 0;
  arena->bytes += block->size;
  return true;
}

void *zs_arena_reserve(zs_arena *arena, size_t count, size_t size)
{
  if (size && count > (SIZE_MAX / 2) / size)
    return NULL;
  size_t bytes = count * size;
  /* Small objects need no more than their own alignment. */
  size_t alignment = bytes >= ALIGNMENT ? ALIGNMENT : 16;
  size_t start = (arena->used + alignment - 1) & ~(alignment - 1);
  if (!arena->block || start > arena->block->size || bytes > arena->block->size - start) {
    if (!grow(arena, bytes))
      return NULL;
    start = 0;
  }
  arena->used = start + bytes;
  return arena->block->data + start;
}

void *zs_arena_alloc(zs_arena *arena, size_t count, size_t size)
{
  void *memory = zs_arena_reserve(arena, count, size);
  return memory ? memset(memory, 0, count * size) : NULL;
}

char *zs_arena_string(zs_arena *arena, const char *text, size_t length)
{
  char *copy = zs_arena_reserve(arena, length + 1, 1);
  if (!copy)
    return NULL;
  if (length)
    memcpy(copy, text, length);
  copy[length] = '\0';
  return copy;
}

zs_arena_mark zs_arena_mark_here(const zs_arena *arena)
{
  return (zs_arena_mark){arena->block, arena->used};
}

void zs_arena_rewind(zs_arena *arena, zs_arena_mark mark)
{
  while (arena->block != mark.block) {
    zs_arena_block *block = arena->block, *older = block->older;
    if (!older) {
      /* Everything is given back: keep this block, now empty. */
      arena->used = 0;
      return;
    }
    /* Only one spare is kept: the larger, newer one. */
    if (block->spare) {
      arena->bytes -= block->size;
      older->spare = block->spare;
      free(block);
    } else {
      older->spare = block;
    }
    arena->block = older;
  }
  arena->used = mark.used;
}

void zs_arena_free(zs_arena *arena)
{
  zs_arena_block *block = arena->block;
  if (block)
    free(block->spare);
  while (block) {
    zs_arena_block *older = block->older;
    free(block);
    block = older;
  }
  *arena = (zs_arena){0};
}
