/* Arrays that grow as elements come. */
#ifndef ZS_ARRAY_H
#define ZS_ARRAY_H

#include <stddef.h>

/* An array with room for `count` elements of `size` bytes, both above 0: the array itself while it
 * has `*capacity` >= count of them, or else a larger one with its elements, which takes its place,
 * for free().  It is at least twice as long, so that adding one by one takes time in proportion to
 * their number.  `array` may be NULL, with a capacity of 0.  NULL when memory is out or no array
 * can be so large: then the array and the capacity are as they were. */
void *zs_array_grown(void *array, size_t count, size_t *capacity, size_t size);

#endif
