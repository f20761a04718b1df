/* Volume files, written sample by sample: .vti (VTK image data), .nrrd, .mhd
 * with its .raw, .nii (NIfTI-1), packed as .nii.gz, and plain .raw.  All are
 * little-endian, x fastest. */
#ifndef ZS_VOLUME_H
#define ZS_VOLUME_H

#include "base/output.h"

typedef enum zs_volume_format {
  ZS_VOLUME_VTI,
  ZS_VOLUME_NRRD,
  ZS_VOLUME_MHD,
  ZS_VOLUME_NIFTI,
  ZS_VOLUME_NIFTI_GZIP,
  ZS_VOLUME_RAW
} zs_volume_format;

/* The format by the ending of a name, in either case; false after reporting. */
bool zs_volume_format_of(const char *path, zs_volume_format *format, zs_diag *diag);

/* A volume file under way. */
typedef struct zs_volume_writer {
  zs_volume_format format;
  zs_sample_type type;
  zs_output data;   /* samples, with the header where that is the same file */
  zs_output header; /* of .mhd */
  void *packer;     /* of .nii.gz */
  int error;        /* errno of the first write that failed, or 0 */
} zs_volume_writer;

/* Begin a volume whose samples sit at the centres of the grid's cells, named
 * `name` in files that name their quantity.  False after reporting. */
bool zs_volume_open(zs_volume_writer *writer, const char *path, const zs_grid *grid,
                    zs_sample_type type, const char *name, zs_diag *diag);

/* The next samples; numbers are rounded and clamped to integer types.  False
 * when the file can take no more, which zs_volume_commit reports. */
bool zs_volume_write_floats(zs_volume_writer *writer, const float *samples, size_t count);
bool zs_volume_write_bytes(zs_volume_writer *writer, const uint8_t *samples, size_t count);

/* Finish: all files of the volume appear, or none with an error reported.
 * Ends the writer either way, as zs_volume_discard does. */
bool zs_volume_commit(zs_volume_writer *writer, zs_diag *diag);
void zs_volume_discard(zs_volume_writer *writer);

#endif
