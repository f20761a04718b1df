/* Files of fits, so that scenes need not solve them again. */
#ifndef ZS_NODES_FITS_H
#define ZS_NODES_FITS_H

#include "base/diagnostic.h"
#include "scene/tree.h"

/* Write the fits that the present compilation has asked for.  False after
 * reporting; `count`, when not NULL, becomes how many there are. */
bool zs_fits_write(const zs_cache *cache, const char *path, size_t *count, zs_diag *diag);

/* Let a cache remember the fits of a file.  They are found by what they depend on:
 * whatever has changed is fitted anew.  False after reporting, with the file:
 * unreadable, of another kind, truncated or damaged files. */
bool zs_fits_read(zs_cache *cache, const char *path, zs_diag *diag);

#endif
