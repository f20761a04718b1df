#include "base/array.h"

#include <stdint.h>
#include <stdlib.h>

enum { FIRST_CAPACITY = 16 };

void *zs_array_grown(void *array, size_t count, size_t *capacity, size_t size)
{
  if (count <= *capacity)
    return array;
  const size_t most = PTRDIFF_MAX / size; /* of any array */
  if (count > most)
    return NULL;
  size_t wanted = *capacity > most / 2 ? most : 2 * *capacity;
  if (wanted < FIRST_CAPACITY && FIRST_CAPACITY <= most)
    wanted = FIRST_CAPACITY;
  if (wanted < count)
    wanted = count;
  void *grown = realloc(array, wanted * size);
  if (grown)
    *capacity = wanted;
  return grown;
}
