/* Memory in large pages.  A page costs the system as much work when it is first written, whatever
 * its size: in small ones, an array of a million bytes can cost more to get than to fill. */
#ifndef ZS_MEMORY_H
#define ZS_MEMORY_H

#include <stddef.h>

/* New memory with arbitrary contents for `count` elements of `size` bytes (above 0), aligned to 64
 * bytes until it is reallocated, for free(); at least one byte.  NULL when memory is out or the
 * size overflows. */
void *zs_memory_new(size_t count, size_t size);

/* The same, zeroed: for what is going to be written, or else calloc() leaves out pages. */
void *zs_memory_zeroed(size_t count, size_t size);

/* How much of it there is for whoever asks for so many bytes, below SIZE_MAX / 2. */
size_t zs_memory_room(size_t bytes);

/* Say that much of a large piece of memory, new and not yet written, is going to
 * be used: the system may then hand it out in fewer, larger pages. */
void zs_memory_is_large(void *memory, size_t size);

#endif
