#include "base/memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

/* What fills half a large page gets one. */
enum { ALIGNMENT = 64, LARGE_PAGE = 1 << 21, WORTH_A_PAGE = LARGE_PAGE / 2 };

void zs_memory_is_large(void *memory, size_t size)
{
#ifdef MADV_HUGEPAGE
  uintptr_t begin = ((uintptr_t)memory + LARGE_PAGE - 1) & ~(uintptr_t)(LARGE_PAGE - 1);
  uintptr_t end = ((uintptr_t)memory + size) & ~(uintptr_t)(LARGE_PAGE - 1);
  if (memory && begin < end)
    madvise((void *)begin, end - begin, MADV_HUGEPAGE); /* advice: it may be refused */
#else
  (void)memory, (void)size;
#endif
}

static size_t alignment_for(size_t bytes)
{
  return bytes < WORTH_A_PAGE ? ALIGNMENT : LARGE_PAGE;
}

size_t zs_memory_room(size_t bytes)
{
  const size_t alignment = alignment_for(bytes);
  return bytes ? (bytes + alignment - 1) / alignment * alignment : alignment;
}

void *zs_memory_new(size_t count, size_t size)
{
  if (count > SIZE_MAX / 2 / size)
    return NULL;
  const size_t room = zs_memory_room(count * size);
  void *memory = aligned_alloc(alignment_for(count * size), room);
  zs_memory_is_large(memory, room);
  return memory;
}

void *zs_memory_zeroed(size_t count, size_t size)
{
  void *memory = zs_memory_new(count, size);
  return memory ? memset(memory, 0, count * size) : NULL;
}
