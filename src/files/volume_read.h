/* Volume files as input: NRRD, MetaImage, NIfTI-1 and VTK image data. */
#ifndef ZS_VOLUME_READ_H
#define ZS_VOLUME_READ_H

#include "base/diagnostic.h"

/* How numbers stand in a file, and in memory. */
typedef enum zs_voxel_type {
  ZS_VOXEL_U8, ZS_VOXEL_I8, ZS_VOXEL_U16, ZS_VOXEL_I16, ZS_VOXEL_U32, ZS_VOXEL_I32,
  ZS_VOXEL_U64, ZS_VOXEL_I64, ZS_VOXEL_F32, ZS_VOXEL_F64,
  ZS_VOXEL_TYPE_COUNT
} zs_voxel_type;

/* Bytes of one number. */
size_t zs_voxel_size(zs_voxel_type type);

/* Samples on a grid.  Sample (i, j, k) is number (k size[1] + j) size[0] + i, and
 * lies at `matrix` (3 x 4, row-major) applied to (i, j, k), in the file's own
 * coordinates: its spacing, directions and origin in one.  Its value is
 * slope * number + intercept. */
typedef struct zs_volume {
  uint32_t size[3];
  double matrix[12];
  zs_voxel_type type;
  double slope, intercept; /* 1 and 0 but in NIfTI files that say otherwise */
  void *numbers;           /* in this machine's byte order */
} zs_volume;

enum { ZS_VOLUME_MOST = INT32_MAX }; /* samples */

/* Read a volume; the name's ending tells what it is.
 *
 *   .nrrd .nhdr      raw, gzip, text and hex; data in the file or beside the header
 *   .mha .mhd        raw, zlib and text; data in the file or beside the header
 *   .nii .nii.gz     NIfTI-1, in one file; the sform, else the qform, else the voxel sizes
 *   .vti             text, base64 and raw, each plain or by zlib; the first array of
 *                    point data, or of cell data, or the one that is said to be the scalars
 *
 * All types of whole and floating-point numbers and both byte orders are read.
 * Missing axes have one sample.  Directions may lean and run backwards, but not
 * lie in a plane.  Data in other files must lie in the header's folder or below.
 *
 * False after reporting with the file, and the field of the header: unreadable,
 * malformed and truncated files, more than one number a sample, more than
 * ZS_VOLUME_MOST samples, sizes that the file is too short for (nothing is
 * allocated for those).  The volume is then cleared. */
bool zs_volume_read(zs_volume *volume, const char *path, zs_diag *diag);
void zs_volume_clear(zs_volume *volume);

/* Whether a name ends as those that zs_volume_read knows. */
bool zs_volume_is_name(const char *path);

static inline size_t zs_volume_count(const zs_volume *volume)
{
  return (size_t)volume->size[0] * volume->size[1] * volume->size[2];
}

/* `count` values from sample `first` on, as doubles: exact but for whole numbers
 * above 2^53. */
void zs_volume_values(const zs_volume *volume, size_t first, size_t count, double *values);

/* Store number `i`, converted to the volume's type: rounded, and clamped to its range. */
void zs_volume_store(zs_volume *volume, size_t i, double number);

#endif
