/* Pictures: allocation and PNG files. */
#ifndef ZS_IMAGE_H
#define ZS_IMAGE_H

#include "base/diagnostic.h"

/* Largest width and height of a picture. */
enum { ZS_IMAGE_LARGEST = 32768 };

/* Black pixels.  False after reporting: a size of 0 or above ZS_IMAGE_LARGEST,
 * or no memory. */
bool zs_image_allocate(zs_image *image, uint32_t width, uint32_t height, uint32_t channels,
                       zs_diag *diag);

/* Whether a size is one that pictures can have; reports when not. */
bool zs_image_size_check(uint32_t width, uint32_t height, zs_diag *diag);

#endif
