#define _POSIX_C_SOURCE 200809L /* st_mtim */
#include "base/key.h"

#include <string.h>
#include <sys/stat.h>

/* Two chains of multiplications by odd constants (of the golden ratio and of splitmix64),
 * each word spread over all bits. */
void zs_key_add(uint64_t key[2], const void *bytes, size_t size)
{
  static const uint64_t factor[2] = {UINT64_C(0x9e3779b97f4a7c15), UINT64_C(0xbf58476d1ce4e5b9)};
  for (size_t at = 0; at < size; at += sizeof(uint64_t)) {
    uint64_t word = 0;
    memcpy(&word, (const char *)bytes + at, size - at < sizeof word ? size - at : sizeof word);
    for (int k = 0; k < 2; k++) {
      key[k] = (key[k] ^ word) * factor[k];
      key[k] ^= key[k] >> 29;
    }
  }
}

void zs_key_begin(uint64_t key[2], const char *kind)
{
  key[0] = strlen(kind);
  key[1] = ~key[0];
  zs_key_add(key, kind, strlen(kind));
}

bool zs_key_add_file(uint64_t key[2], const char *path)
{
  struct stat status;
  if (stat(path, &status) != 0)
    return false;
  const uint64_t state[] = {(uint64_t)status.st_dev, (uint64_t)status.st_ino,
                            (uint64_t)status.st_size, (uint64_t)status.st_mtim.tv_sec,
                            (uint64_t)status.st_mtim.tv_nsec};
  zs_key_add(key, state, sizeof state);
  return true;
}
