/* NIfTI-1 in one file, plain or through gzip. */
#define _POSIX_C_SOURCE 200809L
#include "files/volume_input.h"

#include "files/nifti.h"

#include <math.h>
#include <string.h>

/* Numbers of the header, in its own byte order. */
typedef struct header {
  unsigned char bytes[ZS_NIFTI_HEADER];
  bool big_endian;
} header;

static uint32_t word(const header *h, size_t at, size_t size)
{
  uint32_t number = 0;
  for (size_t i = 0; i < size; i++)
    number = number << 8 | h->bytes[at + (h->big_endian ? i : size - 1 - i)];
  return number;
}

static int16_t short_at(const header *h, size_t at)
{
  return (int16_t)word(h, at, 2);
}

static double float_at(const header *h, size_t at)
{
  const uint32_t bits = word(h, at, 4);
  float number;
  memcpy(&number, &bits, sizeof number);
  return (double)number;
}

static size_t from_stream(void *context, unsigned char *bytes, size_t most)
{
  return fread(bytes, 1, most, context);
}

/* Read the header, unpacked; false after reporting. */
static bool read_header(zs_volume_input *input, header *h, bool *packed)
{
  unsigned char first[2] = {0, 0};
  const size_t length = fread(first, 1, 2, input->stream);
  *packed = length == 2 && first[0] == 0x1f && first[1] == 0x8b;
  rewind(input->stream);
  const char *problem = NULL;
  if (*packed)
    problem = zs_inflate(from_stream, input->stream, 0, h->bytes, sizeof h->bytes);
  else if (fread(h->bytes, 1, sizeof h->bytes, input->stream) != sizeof h->bytes)
    problem = "the header ends too early";
  if (problem)
    return zs_volume_fail(input, NULL, "%s", problem);
  if (word(h, ZS_NIFTI_SIZEOF_HDR, 4) != ZS_NIFTI_HEADER)
    h->big_endian = true;
  const uint32_t size = word(h, ZS_NIFTI_SIZEOF_HDR, 4);
  if (size != ZS_NIFTI_HEADER)
    return zs_volume_fail(input, "sizeof_hdr", "%u; expected %d, as NIfTI-1 has", size,
                          ZS_NIFTI_HEADER);
  const char *magic = (const char *)h->bytes + ZS_NIFTI_MAGIC;
  if (memcmp(magic, "ni1", 4) == 0)
    return zs_volume_fail(input, "magic", "the data is in another file; expected a file with both");
  return memcmp(magic, "n+1", 4) == 0 ||
         zs_volume_fail(input, "magic", "is not that of NIfTI-1");
}

static bool read_type(zs_volume_input *input, const header *h)
{
  const int code = short_at(h, ZS_NIFTI_DATATYPE);
  for (size_t i = 0; i < sizeof zs_nifti_types / sizeof *zs_nifti_types; i++)
    if (zs_nifti_types[i].code == code) {
      input->volume->type = zs_nifti_types[i].type;
      return true;
    }
  return zs_volume_fail(input, "datatype", "%d is not a type of single numbers", code);
}

static bool read_sizes(zs_volume_input *input, const header *h)
{
  const int count = short_at(h, ZS_NIFTI_DIM);
  double sizes[7];
  if (count < 1 || count > 7)
    return zs_volume_fail(input, "dim[0]", "%d; expected a number of axes from 1 to 7", count);
  for (int k = 0; k < count; k++)
    sizes[k] = short_at(h, ZS_NIFTI_DIM + 2 * ((size_t)k + 1));
  return zs_volume_set_sizes(input, "dim", sizes, count);
}

/* The axes by the quaternion of the header. */
static void rotation(const header *h, double axes[3][3], const double size[3])
{
  const double b = float_at(h, ZS_NIFTI_QUATERN), c = float_at(h, ZS_NIFTI_QUATERN + 4),
               d = float_at(h, ZS_NIFTI_QUATERN + 8);
  const double a = sqrt(fmax(0, 1 - (b * b + c * c + d * d)));
  const double r[3][3] = {
    {a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
    {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
    {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - c * c - b * b}};
  const double turned = float_at(h, ZS_NIFTI_PIXDIM) < 0 ? -1 : 1;
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 3; i++)
      axes[k][i] = r[i][k] * size[k] * (k == 2 ? turned : 1);
}

static bool place(zs_volume_input *input, const header *h)
{
  double axes[3][3] = {{0}}, origin[3] = {0, 0, 0}, size[3];
  const char *field = "pixdim";
  for (size_t k = 0; k < 3; k++) {
    size[k] = float_at(h, ZS_NIFTI_PIXDIM + 4 * (k + 1));
    if (input->volume->size[k] == 1 && size[k] == 0)
      size[k] = 1; /* of an axis that is not there */
  }
  if (short_at(h, ZS_NIFTI_SFORM_CODE) > 0) {
    field = "srow";
    for (size_t i = 0; i < 3; i++) {
      for (size_t k = 0; k < 3; k++)
        axes[k][i] = float_at(h, ZS_NIFTI_SROW + 16 * i + 4 * k);
      origin[i] = float_at(h, ZS_NIFTI_SROW + 16 * i + 12);
    }
  } else if (short_at(h, ZS_NIFTI_QFORM_CODE) > 0) {
    field = "quatern";
    rotation(h, axes, size);
    for (size_t i = 0; i < 3; i++)
      origin[i] = float_at(h, ZS_NIFTI_QOFFSET + 4 * i);
  } else {
    for (int k = 0; k < 3; k++)
      axes[k][k] = fabs(size[k]);
  }
  return zs_volume_set_axes(input, field, axes, origin);
}

static bool read_scale(zs_volume_input *input, const header *h)
{
  const double slope = float_at(h, ZS_NIFTI_SCL_SLOPE), inter = float_at(h, ZS_NIFTI_SCL_INTER);
  if (slope == 0 || !isfinite(slope)) /* not in use */
    return true;
  if (!isfinite(inter))
    return zs_volume_fail(input, "scl_inter", "is not a finite number");
  input->volume->slope = slope;
  input->volume->intercept = inter;
  return true;
}

bool zs_volume_read_nifti(zs_volume_input *input)
{
  header h = {.big_endian = false};
  bool packed;
  if (!read_header(input, &h, &packed) || !read_type(input, &h) || !read_sizes(input, &h) ||
      !place(input, &h) || !read_scale(input, &h))
    return false;
  const double offset = float_at(&h, ZS_NIFTI_VOX_OFFSET);
  if (!(offset >= ZS_NIFTI_HEADER && offset <= 1e9))
    return zs_volume_fail(input, "vox_offset", "%g; expected at least %d", offset,
                          ZS_NIFTI_HEADER);
  return packed ? zs_volume_read_data(input, 0, (uint64_t)offset, ZS_ENCODING_ZLIB, h.big_endian)
                : zs_volume_read_data(input, (uint64_t)offset, 0, ZS_ENCODING_RAW, h.big_endian);
}
