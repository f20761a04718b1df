/* Grey pictures as input: PNG, PGM and TIFF files. */
#ifndef ZS_GRAY_H
#define ZS_GRAY_H

#include "base/diagnostic.h"

/* Brightness from 0 (black) to 1 (white), rows from the top of the picture. */
typedef struct zs_gray {
  uint32_t width, height;
  uint32_t white; /* the number that stands for 1 in the file */
  bool colour;    /* brightness is that of colours */
  double side[2]; /* of a pixel, along x and y, in millimetres; 0: the file does not say */
  float *pixels;  /* width x height */
} zs_gray;

enum { ZS_GRAY_MOST = 1 << 28 }; /* pixels in a picture */

/* What pixels are made of: of palettes the colours' brightness, or their numbers; grey
 * of less than 8 bits in PNG files counts up to 255 as brightness, not as numbers. */
typedef enum zs_gray_meaning { ZS_GRAY_BRIGHTNESS, ZS_GRAY_NUMBERS } zs_gray_meaning;

typedef enum zs_gray_page { ZS_GRAY_PAGE, ZS_GRAY_END, ZS_GRAY_FAILED } zs_gray_page;

/* A file of one picture (PNG, PGM) or more (TIFF), in order. */
typedef struct zs_gray_file zs_gray_file;

/* Open a file; which kind it is, its first bytes tell.  `path` must live as long as it.
 * NULL after reporting. */
zs_gray_file *zs_gray_open(const char *path, zs_gray_meaning meaning, zs_diag *diag);
void zs_gray_close(zs_gray_file *file);

/* Go on to the next picture, to the first one after opening. */
zs_gray_page zs_gray_next(zs_gray_file *file);

/* Read the picture, once.  PNG: all kinds; colours become grey by their luminance, and
 * transparency is ignored.  PGM: text (P2) and binary (P5), 8 and 16 bit.  TIFF: see tiff.h.
 * Values are those in the file, by the largest that it could have: no gamma curve is applied.
 *
 * False after reporting with the file: unreadable, malformed and truncated
 * files, sizes above ZS_IMAGE_LARGEST or ZS_GRAY_MOST.  The picture is then cleared. */
bool zs_gray_load(zs_gray_file *file, zs_gray *gray);

/* Read picture number `page`, from 1, as brightness. */
bool zs_gray_read(zs_gray *gray, const char *path, size_t page, zs_diag *diag);
void zs_gray_clear(zs_gray *gray);

/* ---- Between the readers ----------------------------------------------------------------- */

/* Room for pixels; false after reporting a size that pictures cannot have, or that memory is
 * out. */
bool zs_gray_allocate(zs_gray *gray, uint64_t width, uint64_t height, const char *path,
                      zs_diag *diag);

#endif
