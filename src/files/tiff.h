/* TIFF files as input, through libtiff: pages of grey pixels. */
#ifndef ZS_TIFF_H
#define ZS_TIFF_H

#include "files/gray.h"

/* A file that is being read, from page to page. */
typedef struct zs_tiff zs_tiff;

/* NULL after reporting; closed by zs_tiff_close in the other case.  `path` must live as long. */
zs_tiff *zs_tiff_open(const char *path, zs_gray_meaning meaning, zs_diag *diag);
void zs_tiff_close(zs_tiff *tiff);

/* Go on to the next page, to the first one after opening.  Reduced copies of pages and
 * transparency masks are left out. */
zs_gray_page zs_tiff_next(zs_tiff *tiff);

/* Read the page: strips and tiles, all compressions that libtiff knows; whole numbers of 1 to
 * 16 or of 32 bits, with or without a sign, and floating-point numbers of 32 and 64 bits, which
 * are brightness as they are; grey, palettes and RGB (JPEG's YCbCr too).  Further samples, such
 * as transparency, are ignored.  The picture is turned as its orientation says.
 *
 * Takes memory for a row or a tile besides the picture.  False after reporting. */
bool zs_tiff_read(zs_tiff *tiff, zs_gray *gray);

#endif
