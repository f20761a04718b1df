/* 128-bit keys of data, by which what was computed from it is found again. */
#ifndef ZS_KEY_H
#define ZS_KEY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Begin the key of something of a kind. */
void zs_key_begin(uint64_t key[2], const char *kind);

/* Mix bytes into a key. */
void zs_key_add(uint64_t key[2], const void *bytes, size_t size);

/* Mix in which file a path leads to, and which state of it: its size and when it was
 * written.  False when there is none. */
bool zs_key_add_file(uint64_t key[2], const char *path);

#endif
