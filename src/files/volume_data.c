/* The samples of volume files: raw, compressed and as text. */
#define _POSIX_C_SOURCE 200809L /* fseeko */
#include "files/volume_input.h"

#include "base/expression.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { CHUNK = 1 << 16 };

/* No byte of deflated data stands for more than these; streams have at least that many
 * bytes around them. */
static const double MOST_INFLATED = 1032;

bool zs_volume_allocate(zs_volume_input *input, double available)
{
  zs_volume *volume = input->volume;
  const size_t count = zs_volume_count(volume), size = zs_voxel_size(volume->type);
  if ((double)count * (double)size > available)
    return zs_volume_fail(input, NULL,
                          "the file is too short for %u x %u x %u samples of %zu bytes",
                          volume->size[0], volume->size[1], volume->size[2], size);
  volume->numbers = malloc(count * size);
  return volume->numbers || zs_fail_memory(input->diag);
}

/* With what should have been there. */
static bool fail_data(const zs_volume_input *input, const char *problem)
{
  const zs_volume *v = input->volume;
  return zs_volume_fail(input, NULL, "%s; expected %u x %u x %u samples of %zu bytes", problem,
                        v->size[0], v->size[1], v->size[2], zs_voxel_size(v->type));
}

static bool fail_read(const zs_volume_input *input)
{
  return ferror(input->stream)
           ? zs_fail(input->diag, ZS_ERROR_IO, input->path, "cannot be read: %s", strerror(errno))
           : fail_data(input, "the data ends too early");
}

/* ---- Compressed ------------------------------------------------------------------- */

const char *zs_inflate(zs_byte_source *from, void *context, uint64_t before, void *out,
                       size_t size)
{
  unsigned char bytes[CHUNK], skipped[CHUNK], *to = out;
  z_stream z = {.zalloc = Z_NULL};
  size_t done = 0;
  int status = Z_OK;
  enum { ZLIB_OR_GZIP = 15 + 32 };
  if (inflateInit2(&z, ZLIB_OR_GZIP) != Z_OK)
    return "memory is out";
  while (done < size) {
    if (z.avail_in == 0) {
      z.avail_in = (uInt)from(context, bytes, sizeof bytes);
      z.next_in = bytes;
      if (z.avail_in == 0)
        break;
    }
    if (status == Z_STREAM_END && inflateReset(&z) != Z_OK)
      break;
    const uint64_t left = before ? before : size - done;
    const uInt room = left < CHUNK ? (uInt)left : CHUNK;
    z.next_out = before ? skipped : to + done;
    z.avail_out = room;
    status = inflate(&z, Z_NO_FLUSH);
    if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
      break;
    if (before)
      before -= room - z.avail_out;
    else
      done += room - z.avail_out;
  }
  inflateEnd(&z);
  return done == size                                          ? NULL
         : status == Z_DATA_ERROR || status == Z_NEED_DICT     ? "the compressed data is damaged"
         : status == Z_MEM_ERROR                               ? "memory is out"
                                                               : "the data ends too early";
}

static size_t from_stream(void *context, unsigned char *bytes, size_t most)
{
  return fread(bytes, 1, most, context);
}

static bool read_compressed(zs_volume_input *data, uint64_t before, void *out, size_t size)
{
  const char *problem = zs_inflate(from_stream, data->stream, before, out, size);
  if (problem && ferror(data->stream))
    return fail_read(data);
  return !problem || fail_data(data, problem);
}

/* ---- Text -------------------------------------------------------------------------- */

/* The next word behind blanks and commas; its length, 0 at the end, or `most` for one
 * that is as long or longer. */
static size_t next_word(FILE *stream, char *word, size_t most)
{
  size_t length = 0;
  int c = getc(stream);
  while (isspace(c) || c == ',')
    c = getc(stream);
  for (; c != EOF && !isspace(c) && c != ',' && length < most; c = getc(stream))
    word[length++] = (char)c;
  return length;
}

static bool read_text(zs_volume_input *data)
{
  enum { MOST = 64 };
  zs_volume *volume = data->volume;
  const size_t count = zs_volume_count(volume);
  for (size_t i = 0; i < count; i++) {
    char word[MOST];
    double number;
    const size_t length = next_word(data->stream, word, MOST);
    if (!length)
      return fail_read(data);
    if (length == MOST || zs_number_parse(word, length, &number) != length)
      return zs_volume_fail(data, NULL, "sample %zu: '%.*s' is not a number", i,
                            (int)(length < 40 ? length : 40), word);
    zs_volume_store(volume, i, number);
  }
  return true;
}

static bool read_hex(zs_volume_input *data, size_t size)
{
  unsigned char *out = data->volume->numbers;
  for (size_t digit = 0; digit < 2 * size;) {
    const int c = getc(data->stream);
    if (c == EOF)
      return fail_read(data);
    if (isspace(c))
      continue;
    if (!isxdigit(c))
      return zs_volume_fail(data, NULL, "'%c' is not a hexadecimal digit", isprint(c) ? c : '?');
    const int value = isdigit(c) ? c - '0' : (c | 32) - 'a' + 10;
    out[digit / 2] = (unsigned char)(digit % 2 ? out[digit / 2] << 4 | value : value);
    digit++;
  }
  return true;
}

/* ---- All ---------------------------------------------------------------------------- */

bool zs_volume_read_data(zs_volume_input *data, uint64_t offset, uint64_t before,
                         zs_encoding encoding, bool big_endian)
{
  zs_volume *volume = data->volume;
  const size_t size = zs_voxel_size(volume->type);
  if (offset > data->length)
    return fail_data(data, "the data ends too early");
  double available = (double)(data->length - offset);
  if (encoding == ZS_ENCODING_ZLIB)
    available *= MOST_INFLATED;
  else if (encoding == ZS_ENCODING_TEXT)
    available = (available + 1) / 2 * (double)size; /* a digit and a blank */
  else if (encoding == ZS_ENCODING_HEX)
    available /= 2;
  if (!zs_volume_allocate(data, available - (double)before))
    return false;
  if (fseeko(data->stream, (off_t)(encoding == ZS_ENCODING_RAW ? offset + before : offset),
             SEEK_SET) != 0)
    return fail_read(data);
  const size_t bytes = zs_volume_count(volume) * size;
  bool done = false;
  switch (encoding) {
  case ZS_ENCODING_RAW:
    done = fread(volume->numbers, 1, bytes, data->stream) == bytes || fail_read(data);
    break;
  case ZS_ENCODING_ZLIB: done = read_compressed(data, before, volume->numbers, bytes); break;
  case ZS_ENCODING_TEXT: return read_text(data);
  case ZS_ENCODING_HEX: done = read_hex(data, bytes); break;
  }
  if (done)
    zs_volume_to_host(volume, big_endian);
  return done;
}
