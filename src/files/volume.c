#include "files/volume.h"

#include "base/names.h"
#include "files/nifti.h"
#include "files/number.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

static const struct {
  const char *ending;
  zs_volume_format format;
} formats[] = {{".vti", ZS_VOLUME_VTI},
               {".nrrd", ZS_VOLUME_NRRD},
               {".mhd", ZS_VOLUME_MHD},
               {".nii", ZS_VOLUME_NIFTI},
               {".nii.gz", ZS_VOLUME_NIFTI_GZIP},
               {".raw", ZS_VOLUME_RAW}};

/* The sample types by zs_sample_type, as the formats call them. */
static const struct {
  size_t size;
  const char *vti, *nrrd, *mhd;
  unsigned nifti;
} types[] = {{1, "UInt8", "uint8", "MET_UCHAR", 2},
             {2, "Int16", "int16", "MET_SHORT", 4},
             {4, "Float32", "float", "MET_FLOAT", 16},
             {8, "Float64", "double", "MET_DOUBLE", 64}};

bool zs_volume_format_of(const char *path, zs_volume_format *format, zs_diag *diag)
{
  for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
    if (zs_name_ends_in(path, formats[i].ending)) {
      *format = formats[i].format;
      return true;
    }
  return zs_fail(diag, ZS_ERROR_ARGUMENT, path,
                 "unknown kind of volume file; expected a name.vti, .nrrd, .mhd, .nii, .nii.gz or "
                 ".raw");
}

/* Where sample 0 sits on each axis. */
static void first_sample(const zs_grid *grid, double at[3])
{
  for (int k = 0; k < 3; k++)
    at[k] = grid->lo[k] + grid->cell[k] / 2;
}

/* Three numbers as text, apart by spaces. */
typedef struct triple {
  char text[3 * ZS_NUMBER_SIZE];
} triple;

static triple triple_of(const double numbers[3], const char *separator)
{
  char n[3][ZS_NUMBER_SIZE];
  triple t;
  snprintf(t.text, sizeof t.text, "%s%s%s%s%s", zs_number_format(n[0], numbers[0]), separator,
           zs_number_format(n[1], numbers[1]), separator, zs_number_format(n[2], numbers[2]));
  return t;
}

static uint64_t data_bytes(const zs_grid *grid, zs_sample_type type)
{
  return (uint64_t)grid->count[0] * grid->count[1] * grid->count[2] * types[type].size;
}

/* Keep the reason of the first write that fails.  Returns `good`. */
static bool note(zs_volume_writer *writer, bool good)
{
  if (!good && !writer->error)
    writer->error = errno ? errno : EIO;
  return good;
}

/* Low bytes first, on every machine. */
static void store(unsigned char *out, uint64_t bits, size_t size)
{
  for (size_t i = 0; i < size; i++)
    out[i] = (unsigned char)(bits >> (8 * i));
}

static void store_float(unsigned char *out, double number)
{
  const float single = (float)number;
  uint32_t bits;
  memcpy(&bits, &single, sizeof bits);
  store(out, bits, sizeof bits);
}

static bool write_length(FILE *stream, uint64_t length)
{
  unsigned char bytes[8];
  store(bytes, length, sizeof bytes);
  return fwrite(bytes, 1, sizeof bytes, stream) == sizeof bytes;
}

static bool vti_header(FILE *stream, const zs_grid *grid, zs_sample_type type, const char *name)
{
  double origin[3];
  first_sample(grid, origin);
  char extent[64];
  snprintf(extent, sizeof extent, "0 %u 0 %u 0 %u", grid->count[0] - 1, grid->count[1] - 1,
           grid->count[2] - 1);
  return fprintf(stream,
                 "<?xml version=\"1.0\"?>\n"
                 "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\""
                 " header_type=\"UInt64\">\n"
                 "  <ImageData WholeExtent=\"%s\" Origin=\"%s\" Spacing=\"%s\">\n"
                 "    <Piece Extent=\"%s\">\n"
                 "      <PointData Scalars=\"%s\">\n"
                 "        <DataArray type=\"%s\" Name=\"%s\" format=\"appended\" offset=\"0\"/>\n"
                 "      </PointData>\n"
                 "    </Piece>\n"
                 "  </ImageData>\n"
                 "  <AppendedData encoding=\"raw\">\n_",
                 extent, triple_of(origin, " ").text, triple_of(grid->cell, " ").text, extent, name,
                 types[type].vti, name) > 0 &&
         write_length(stream, data_bytes(grid, type));
}

static bool nrrd_header(FILE *stream, const zs_grid *grid, zs_sample_type type, const char *name)
{
  double origin[3];
  char cell[3][ZS_NUMBER_SIZE];
  first_sample(grid, origin);
  for (int k = 0; k < 3; k++)
    zs_number_format(cell[k], grid->cell[k]);
  return fprintf(stream,
                 "NRRD0004\n"
                 "content: %s\n"
                 "type: %s\n"
                 "dimension: 3\n"
                 "space dimension: 3\n"
                 "sizes: %u %u %u\n"
                 "space directions: (%s,0,0) (0,%s,0) (0,0,%s)\n"
                 "kinds: domain domain domain\n"
                 "centers: cell cell cell\n"
                 "endian: little\n"
                 "encoding: raw\n"
                 "space origin: (%s)\n"
                 "\n",
                 name, types[type].nrrd, grid->count[0], grid->count[1], grid->count[2], cell[0],
                 cell[1], cell[2], triple_of(origin, ",").text) > 0;
}

/* `data_name` is the file of samples beside the header. */
static bool mhd_header(FILE *stream, const zs_grid *grid, zs_sample_type type,
                       const char *data_name)
{
  double origin[3];
  first_sample(grid, origin);
  return fprintf(stream,
                 "ObjectType = Image\n"
                 "NDims = 3\n"
                 "BinaryData = True\n"
                 "BinaryDataByteOrderMSB = False\n"
                 "CompressedData = False\n"
                 "TransformMatrix = 1 0 0 0 1 0 0 0 1\n"
                 "Offset = %s\n"
                 "CenterOfRotation = 0 0 0\n"
                 "ElementSpacing = %s\n"
                 "DimSize = %u %u %u\n"
                 "ElementType = %s\n"
                 "ElementDataFile = %s\n",
                 triple_of(origin, " ").text, triple_of(grid->cell, " ").text, grid->count[0],
                 grid->count[1], grid->count[2], types[type].mhd, data_name) > 0;
}

/* All of a NIfTI-1 file before its samples. */
static void nifti_header(unsigned char h[ZS_NIFTI_DATA], const zs_grid *grid, zs_sample_type type,
                         const char *name)
{
  enum { SCANNER = 1, AXES = 3 };
  double origin[3];
  first_sample(grid, origin);
  memset(h, 0, ZS_NIFTI_DATA);
  store(h + ZS_NIFTI_SIZEOF_HDR, ZS_NIFTI_HEADER, 4);
  store(h + ZS_NIFTI_DATATYPE, types[type].nifti, 2);
  store(h + ZS_NIFTI_BITPIX, 8 * types[type].size, 2);
  store_float(h + ZS_NIFTI_VOX_OFFSET, ZS_NIFTI_DATA);
  store_float(h + ZS_NIFTI_SCL_SLOPE, 1);
  store(h + ZS_NIFTI_QFORM_CODE, SCANNER, 2); /* its quaternion of zeros turns nothing */
  store(h + ZS_NIFTI_SFORM_CODE, SCANNER, 2);
  store_float(h + ZS_NIFTI_PIXDIM, 1);
  store(h + ZS_NIFTI_DIM, AXES, 2);
  for (size_t k = 0; k < 7; k++)
    store(h + ZS_NIFTI_DIM + 2 * (k + 1), k < AXES ? grid->count[k] : 1, 2);
  for (size_t k = 0; k < AXES; k++) {
    store_float(h + ZS_NIFTI_PIXDIM + 4 * (k + 1), grid->cell[k]);
    store_float(h + ZS_NIFTI_QOFFSET + 4 * k, origin[k]);
    store_float(h + ZS_NIFTI_SROW + 20 * k, grid->cell[k]);
    store_float(h + ZS_NIFTI_SROW + 16 * k + 12, origin[k]);
  }
  snprintf((char *)h + ZS_NIFTI_DESCRIP, 80, "%s", name);
  memcpy(h + ZS_NIFTI_MAGIC, "n+1", 4);
}

/* Bytes to the file, through the packer if there is one; `flush` is one of zlib's. */
static bool write_packed(zs_volume_writer *writer, const void *bytes, size_t count, int flush)
{
  FILE *stream = writer->data.stream;
  z_stream *z = writer->packer;
  if (!z)
    return fwrite(bytes, 1, count, stream) == count;
  unsigned char packed[1 << 15];
  z->next_in = (z_const Bytef *)bytes;
  z->avail_in = (uInt)count;
  do {
    z->next_out = packed;
    z->avail_out = sizeof packed;
    deflate(z, flush);
    const size_t n = sizeof packed - z->avail_out;
    if (fwrite(packed, 1, n, stream) != n)
      return false;
  } while (z->avail_out == 0);
  return true;
}

static void close_packer(zs_volume_writer *writer)
{
  if (writer->packer)
    deflateEnd(writer->packer);
  free(writer->packer);
  writer->packer = NULL;
}

static bool open_packer(zs_volume_writer *writer, zs_diag *diag)
{
  enum { GZIP = 15 + 16, MEMORY = 8 };
  z_stream *z = calloc(1, sizeof *z);
  if (z && deflateInit2(z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, GZIP, MEMORY,
                        Z_DEFAULT_STRATEGY) == Z_OK) {
    writer->packer = z;
    return true;
  }
  free(z);
  return zs_fail_memory(diag);
}

static bool open_nifti(zs_volume_writer *writer, const char *path, const zs_grid *grid,
                       const char *name, zs_diag *diag)
{
  unsigned char header[ZS_NIFTI_DATA];
  for (int k = 0; k < 3; k++)
    if (grid->count[k] > INT16_MAX)
      return zs_fail(diag, ZS_ERROR_ARGUMENT, path,
                     "%u samples along an axis are more than the %d that NIfTI-1 can have",
                     grid->count[k], INT16_MAX);
  if (!zs_output_open(&writer->data, path, diag))
    return false;
  if (writer->format == ZS_VOLUME_NIFTI_GZIP && !open_packer(writer, diag)) {
    zs_output_discard(&writer->data);
    return false;
  }
  nifti_header(header, grid, writer->type, name);
  note(writer, write_packed(writer, header, sizeof header, Z_NO_FLUSH));
  return true;
}

/* The name.raw that belongs to name.mhd, for free(); NULL when memory is out. */
static char *raw_path(const char *path)
{
  char *raw = strdup(path);
  if (raw)
    memcpy(raw + strlen(raw) - 4, ".raw", 4);
  return raw;
}

static bool open_mhd(zs_volume_writer *writer, const char *path, const zs_grid *grid, zs_diag *diag)
{
  char *raw = raw_path(path);
  if (!raw)
    return zs_fail_memory(diag);
  bool open = zs_output_open(&writer->header, path, diag);
  if (open && !zs_output_open(&writer->data, raw, diag)) {
    zs_output_discard(&writer->header);
    open = false;
  }
  if (open) {
    const char *slash = strrchr(raw, '/');
    note(writer, mhd_header(writer->header.stream, grid, writer->type, slash ? slash + 1 : raw));
  }
  free(raw);
  return open;
}

bool zs_volume_open(zs_volume_writer *writer, const char *path, const zs_grid *grid,
                    zs_sample_type type, const char *name, zs_diag *diag)
{
  *writer = (zs_volume_writer){.type = type};
  if ((unsigned)type > ZS_SAMPLE_F64)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, path,
                   "the type of samples is %d; expected U8 (0), I16 (1), F32 (2) or F64 (3)",
                   (int)type);
  if (!zs_volume_format_of(path, &writer->format, diag))
    return false;
  if (writer->format == ZS_VOLUME_MHD)
    return open_mhd(writer, path, grid, diag);
  if (writer->format == ZS_VOLUME_NIFTI || writer->format == ZS_VOLUME_NIFTI_GZIP)
    return open_nifti(writer, path, grid, name, diag);
  if (!zs_output_open(&writer->data, path, diag))
    return false;
  FILE *stream = writer->data.stream;
  if (writer->format == ZS_VOLUME_VTI)
    note(writer, vti_header(stream, grid, type, name));
  else if (writer->format == ZS_VOLUME_NRRD)
    note(writer, nrrd_header(stream, grid, type, name));
  return true;
}

/* ---- Samples ------------------------------------------------------------------ */

/* Round to an integer in lo..hi; NaN gives 0. */
static int64_t integer(double number, double lo, double hi)
{
  if (isnan(number))
    return 0;
  return (int64_t)rint(fmin(fmax(number, lo), hi));
}

static void encode(unsigned char *out, double number, zs_sample_type type)
{
  uint64_t wide;
  switch (type) {
  case ZS_SAMPLE_U8:
    out[0] = (unsigned char)integer(number, 0, UINT8_MAX);
    break;
  case ZS_SAMPLE_I16:
    store(out, (uint64_t)integer(number, INT16_MIN, INT16_MAX), 2);
    break;
  case ZS_SAMPLE_F32:
    store_float(out, number);
    break;
  case ZS_SAMPLE_F64:
    memcpy(&wide, &number, sizeof wide);
    store(out, wide, sizeof wide);
    break;
  }
}

enum { CHUNK = 4096 /* samples converted at a time */ };

static bool write_chunk(zs_volume_writer *writer, const unsigned char *bytes, size_t count)
{
  return note(writer, write_packed(writer, bytes, count * types[writer->type].size, Z_NO_FLUSH));
}

bool zs_volume_write_floats(zs_volume_writer *writer, const float *samples, size_t count)
{
  unsigned char bytes[CHUNK * 8];
  size_t size = types[writer->type].size;
  for (size_t at = 0; at < count && !writer->error; at += CHUNK) {
    size_t n = count - at < CHUNK ? count - at : CHUNK;
    for (size_t i = 0; i < n; i++)
      encode(bytes + i * size, (double)samples[at + i], writer->type);
    write_chunk(writer, bytes, n);
  }
  return !writer->error;
}

bool zs_volume_write_bytes(zs_volume_writer *writer, const uint8_t *samples, size_t count)
{
  if (writer->type == ZS_SAMPLE_U8)
    return !writer->error && write_chunk(writer, samples, count);
  unsigned char bytes[CHUNK * 8];
  size_t size = types[writer->type].size;
  for (size_t at = 0; at < count && !writer->error; at += CHUNK) {
    size_t n = count - at < CHUNK ? count - at : CHUNK;
    for (size_t i = 0; i < n; i++)
      encode(bytes + i * size, samples[at + i], writer->type);
    write_chunk(writer, bytes, n);
  }
  return !writer->error;
}

/* ---- The end ------------------------------------------------------------------- */

void zs_volume_discard(zs_volume_writer *writer)
{
  close_packer(writer);
  zs_output_discard(&writer->data);
  if (writer->format == ZS_VOLUME_MHD)
    zs_output_discard(&writer->header);
}

static bool commit_mhd(zs_volume_writer *writer, zs_diag *diag)
{
  char *raw = strdup(writer->data.path);
  if (!raw) {
    zs_volume_discard(writer);
    return zs_fail_memory(diag);
  }
  bool done = zs_output_commit(&writer->data, diag);
  if (!done)
    zs_output_discard(&writer->header);
  else if (!zs_output_commit(&writer->header, diag)) {
    remove(raw);
    done = false;
  }
  free(raw);
  return done;
}

/* Hand everything to the operating system, so that renaming is all that is
 * left to do. */
static bool flush(zs_volume_writer *writer)
{
  FILE *stream = writer->data.stream;
  if (writer->error)
    return false;
  if (writer->format == ZS_VOLUME_VTI)
    note(writer, fputs("\n  </AppendedData>\n</VTKFile>\n", stream) != EOF);
  if (writer->packer)
    note(writer, write_packed(writer, NULL, 0, Z_FINISH));
  close_packer(writer);
  note(writer, !fflush(stream));
  if (writer->format == ZS_VOLUME_MHD)
    note(writer, !fflush(writer->header.stream));
  return !writer->error;
}

bool zs_volume_commit(zs_volume_writer *writer, zs_diag *diag)
{
  if (!flush(writer)) {
    zs_fail(diag, ZS_ERROR_IO, writer->data.path, "cannot be written: %s",
            strerror(writer->error));
    zs_volume_discard(writer);
    return false;
  }
  return writer->format == ZS_VOLUME_MHD ? commit_mhd(writer, diag)
                                         : zs_output_commit(&writer->data, diag);
}
