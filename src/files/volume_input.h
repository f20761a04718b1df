/* Inside the volume readers: files, headers, and the data behind them. */
#ifndef ZS_VOLUME_INPUT_H
#define ZS_VOLUME_INPUT_H

#include "files/volume_read.h"

#include <stdio.h>

/* A file that is being read. */
typedef struct zs_volume_input {
  const char *path;
  FILE *stream;
  uint64_t length; /* bytes */
  zs_diag *diag;
  zs_volume *volume;
} zs_volume_input;

/* How numbers are written down. */
typedef enum zs_encoding {
  ZS_ENCODING_RAW,
  ZS_ENCODING_ZLIB, /* or gzip: the data tells which */
  ZS_ENCODING_TEXT,
  ZS_ENCODING_HEX
} zs_encoding;

/* One format: read from an open file.  False after reporting. */
bool zs_volume_read_nrrd(zs_volume_input *input);
bool zs_volume_read_meta(zs_volume_input *input);
bool zs_volume_read_nifti(zs_volume_input *input);
bool zs_volume_read_vti(zs_volume_input *input);

/* ---- Files ------------------------------------------------------------------ */

/* Open a regular file for input; false after reporting. */
bool zs_volume_input_open(zs_volume_input *input, const char *path, zs_diag *diag);
void zs_volume_input_close(zs_volume_input *input);

/* Check how a header names its data: one file.  False after reporting. */
bool zs_volume_check_data_file(const zs_volume_input *input, const char *field,
                               const char *reference);

/* Call `read` with what a header says and the open file that it names as `reference`, which
 * must be in the header's folder or below.  `field` is the header's word for it. */
typedef bool zs_volume_data_reader(const void *header, zs_volume_input *data, uint64_t offset);
bool zs_volume_read_beside(const zs_volume_input *input, const char *field, const char *reference,
                           zs_volume_data_reader *read, const void *header);

/* Call `read` with the text that a file begins with, `header` and a byte 0 behind it. */
enum { ZS_VOLUME_MOST_HEADER = 1 << 20 };
typedef bool zs_volume_text_reader(void *header, char *text, size_t length);
bool zs_volume_read_header(const zs_volume_input *input, zs_volume_text_reader *read,
                           void *header);

/* Report about a field of the header (NULL: about the file); returns false. */
bool zs_volume_fail(const zs_volume_input *input, const char *field, const char *format, ...)
  __attribute__((format(printf, 3, 4)));

/* ---- Headers ------------------------------------------------------------------ */

/* Names of types, and the type that a header names; false after reporting. */
typedef struct zs_voxel_type_name {
  const char *name;
  zs_voxel_type type;
} zs_voxel_type_name;
bool zs_volume_set_type(zs_volume_input *input, const char *field, const char *name,
                        const zs_voxel_type_name *names, size_t count);

/* Numbers of a text, separated by blanks, commas or parentheses: how many there
 * are, of which at most `most` are stored; -1: something else is among them. */
int zs_volume_numbers(const char *text, double *numbers, int most);

/* The number at or behind *at, which is moved there, before `end`; its length, 0 when there
 * is none. */
size_t zs_volume_word(const char **at, const char *end, double *number);

/* Take `count` sizes, which must be whole numbers; those beyond the third must be 1,
 * and missing ones are.  False after reporting about the field. */
bool zs_volume_set_sizes(zs_volume_input *input, const char *field, const double *sizes,
                         int count);

/* Place samples: column k of the matrix is where axis k leads. */
bool zs_volume_set_axes(zs_volume_input *input, const char *field, const double axes[3][3],
                        const double origin[3]);

/* ---- Data ------------------------------------------------------------------------ */

/* Read the volume's numbers, which begin at byte `offset` of `data` and are of the
 * given encoding.  `before` is how many bytes of decoded data to leave out in front. */
bool zs_volume_read_data(zs_volume_input *data, uint64_t offset, uint64_t before,
                         zs_encoding encoding, bool big_endian);

/* Room for the volume's numbers; at most `available` bytes can be meant.  False after
 * reporting. */
bool zs_volume_allocate(zs_volume_input *input, double available);

/* Turn numbers that stand as in a file of that byte order into this machine's. */
void zs_volume_to_host(zs_volume *volume, bool big_endian);

/* Decode zlib or gzip data, several streams one behind the other, from `from` (called
 * for more bytes: how many it has put there, 0 at the end) to `size` bytes at `out`,
 * leaving out the first `before`.  Returns NULL, or what is wrong. */
typedef size_t zs_byte_source(void *context, unsigned char *bytes, size_t most);
const char *zs_inflate(zs_byte_source *from, void *context, uint64_t before, void *out,
                       size_t size);

#endif
