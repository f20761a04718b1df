/* Allocation that fails once, for one program linked with $(failing_allocation). */
#ifndef FAILING_ALLOCATION_H
#define FAILING_ALLOCATION_H

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>

/* The linker sends the library's calls here (--wrap). */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
char *__real_realpath(const char *path, char *resolved);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
char *__wrap_realpath(const char *path, char *resolved);

static unsigned long until_failure; /* 0: never */

static bool fails(void)
{
  return until_failure && --until_failure == 0;
}

void *__wrap_malloc(size_t size)
{
  return fails() ? NULL : __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size)
{
  return fails() ? NULL : __real_calloc(count, size);
}

void *__wrap_realloc(void *memory, size_t size)
{
  return fails() ? NULL : __real_realloc(memory, size);
}

void *__wrap_aligned_alloc(size_t alignment, size_t size)
{
  return fails() ? NULL : __real_aligned_alloc(alignment, size);
}

/* The C library's own calls do not come here. */
char *__wrap_realpath(const char *path, char *resolved)
{
  if (!fails())
    return __real_realpath(path, resolved);
  errno = ENOMEM;
  return NULL;
}

#endif
