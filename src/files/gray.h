/* Grey pictures as input: PNG and PGM files. */
#ifndef ZS_GRAY_H
#define ZS_GRAY_H

#include "base/diagnostic.h"

/* Brightness from 0 (black) to 1 (white), rows from the top of the picture. */
typedef struct zs_gray {
  uint32_t width, height;
  uint32_t white; /* the number that stands for 1 in the file */
  float *pixels;  /* width x height */
} zs_gray;

/* Read a picture; which kind it is, its first bytes tell.  PNG: all kinds;
 * colours become grey by their luminance, and transparency is ignored.  PGM:
 * text (P2) and binary (P5), 8 and 16 bit.  Values are those in the file, by
 * the largest that it could have: no gamma curve is applied.
 *
 * False after reporting with the file: unreadable, malformed and truncated
 * files, sizes above ZS_IMAGE_LARGEST.  The picture is then cleared. */
bool zs_gray_read(zs_gray *gray, const char *path, zs_diag *diag);
void zs_gray_clear(zs_gray *gray);

#endif
