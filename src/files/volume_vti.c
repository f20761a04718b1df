/* VTK image data, .vti: XML whose arrays are text, base64, or bytes behind it. */
#include "files/volume_input.h"

#include "base/xml.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CHUNK = 1 << 16, DEPTH = 64 };

static const zs_xml_language language = {.name_space = "", .root = "VTKFile"};

static const zs_voxel_type_name types[] = {
  {"UInt8", ZS_VOXEL_U8},   {"Int8", ZS_VOXEL_I8},     {"UInt16", ZS_VOXEL_U16},
  {"Int16", ZS_VOXEL_I16},  {"UInt32", ZS_VOXEL_U32},  {"Int32", ZS_VOXEL_I32},
  {"UInt64", ZS_VOXEL_U64}, {"Int64", ZS_VOXEL_I64},   {"Float32", ZS_VOXEL_F32},
  {"Float64", ZS_VOXEL_F64}};

/* The document, and the appended data behind its text. */
typedef struct document {
  zs_volume_input *input;
  zs_arena arena;
  char *text;
  size_t length, capacity;
  const zs_element *root;
  bool has_appended, appended_base64;
  uint64_t appended; /* where its '_' is followed by data, in the file */
  bool big_endian, compressed, wide_header;
} document;

/* ---- The document ------------------------------------------------------------------- */

static bool more_text(document *d, size_t *added)
{
  if (d->capacity - d->length < CHUNK) {
    const size_t capacity = 2 * d->capacity + 2 * CHUNK;
    char *text = realloc(d->text, capacity);
    if (!text)
      return zs_fail_memory(d->input->diag);
    d->text = text;
    d->capacity = capacity;
  }
  *added = fread(d->text + d->length, 1, CHUNK, d->input->stream);
  d->length += *added;
  return true;
}

static const char *find(const char *text, size_t length, const char *word)
{
  const size_t n = strlen(word);
  for (const char *end = text + length; (size_t)(end - text) >= n; text++) {
    text = memchr(text, word[0], (size_t)(end - text) - n + 1);
    if (!text)
      return NULL;
    if (memcmp(text, word, n) == 0)
      return text;
  }
  return NULL;
}

/* The tag of the appended data, which is at `tag`, and the '_' that begins it. */
static bool read_appended(document *d, size_t tag)
{
  const char *close, *mark = NULL;
  for (size_t added = 1;;) {
    close = memchr(d->text + tag, '>', d->length - tag);
    mark = close ? memchr(close, '_', d->length - (size_t)(close - d->text)) : NULL;
    if (mark || !added)
      break;
    if (d->length - tag > 4 * CHUNK)
      return zs_volume_fail(d->input, "AppendedData", "has no '_' before its data");
    if (!more_text(d, &added))
      return false;
  }
  if (!mark)
    return zs_volume_fail(d->input, "AppendedData", "has no '_' before its data");
  const char *encoding = find(d->text + tag, (size_t)(close - d->text) - tag, "encoding");
  d->appended_base64 =
    encoding && find(encoding, (size_t)(close - encoding), "base64") != NULL;
  if (!d->appended_base64 && !(encoding && find(encoding, (size_t)(close - encoding), "raw")))
    return zs_volume_fail(d->input, "AppendedData", "encoding: expected raw or base64");
  d->has_appended = true;
  d->appended = (uint64_t)(mark - d->text) + 1;
  return true;
}

/* Read the text, up to the appended data, which is no XML. */
static bool read_text(document *d)
{
  static const char appended[] = "<AppendedData", end[] = "</VTKFile>";
  size_t searched = 0, added = 1;
  while (added) {
    if (!more_text(d, &added))
      return false;
    const char *tag = find(d->text + searched, d->length - searched, appended);
    if (tag) {
      const size_t at = (size_t)(tag - d->text);
      if (!read_appended(d, at))
        return false;
      memcpy(d->text + at, end, sizeof end - 1); /* there is room: the tag was as long */
      d->length = at + sizeof end - 1;
      return true;
    }
    searched = d->length < sizeof appended ? 0 : d->length - sizeof appended;
  }
  return true;
}

static const zs_element *child(const zs_element *parent, const char *name)
{
  for (const zs_element *e = parent ? parent->first : NULL; e; e = e->next)
    if (strcmp(e->name, name) == 0)
      return e;
  return NULL;
}

static const char *value(const zs_element *element, const char *name)
{
  const zs_xml_attribute *attribute = zs_element_attribute(element, name);
  return attribute ? attribute->value : NULL;
}

static bool is_value(const zs_element *element, const char *name, const char *expected)
{
  const char *text = value(element, name);
  return text && strcmp(text, expected) == 0;
}

/* Exactly `count` numbers of an attribute that may be missing. */
static bool numbers(const document *d, const zs_element *element, const char *name, double *list,
                    int count)
{
  const char *text = value(element, name);
  return !text || zs_volume_numbers(text, list, count) == count ||
         zs_volume_fail(d->input, name, "'%.40s' is not a list of %d numbers", text, count);
}

/* The array to read; *cells says whether it is of the cells. */
static const zs_element *find_array(const zs_element *piece, bool *cells)
{
  for (int pass = 0; pass < 2; pass++) {
    const zs_element *data = child(piece, pass ? "CellData" : "PointData");
    const char *wanted = data ? value(data, "Scalars") : NULL;
    const zs_element *first = child(data, "DataArray");
    *cells = pass;
    for (const zs_element *e = first; wanted && e; e = e->next)
      if (strcmp(e->name, "DataArray") == 0 && is_value(e, "Name", wanted))
        return e;
    if (first)
      return first;
  }
  return NULL;
}

static bool place(document *d, const zs_element *image, const zs_element *piece, bool cells)
{
  double extent[6] = {0, -1, 0, -1, 0, -1}, origin[3] = {0, 0, 0}, spacing[3] = {1, 1, 1};
  double direction[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, axes[3][3], sizes[3];
  if (!numbers(d, image, "WholeExtent", extent, 6) || !numbers(d, piece, "Extent", extent, 6) ||
      !numbers(d, image, "Origin", origin, 3) || !numbers(d, image, "Spacing", spacing, 3) ||
      !numbers(d, image, "Direction", direction, 9))
    return false;
  for (int k = 0; k < 3; k++) {
    sizes[k] = extent[2 * k + 1] - extent[2 * k] + !cells;
    for (int i = 0; i < 3; i++) {
      axes[k][i] = direction[3 * i + k] * spacing[k];
      origin[i] += axes[k][i] * (extent[2 * k] + (cells ? 0.5 : 0));
    }
  }
  return zs_volume_set_sizes(d->input, "Extent", sizes, 3) &&
         zs_volume_set_axes(d->input, "Spacing", axes, origin);
}

/* ---- Bytes ------------------------------------------------------------------------------ */

/* Data as it comes: from the file or from an element's text, base64 or not. */
typedef struct stream {
  FILE *file; /* NULL: */
  const char *text, *end;
  bool base64, ended;
  unsigned char ready[3]; /* decoded and not yet taken */
  unsigned count, taken;
} stream;

static int next_character(stream *s)
{
  if (s->file)
    return getc(s->file);
  return s->text < s->end ? (unsigned char)*s->text++ : EOF;
}

static int digit_of(int c)
{
  return c >= 'A' && c <= 'Z'   ? c - 'A'
         : c >= 'a' && c <= 'z' ? c - 'a' + 26
         : c >= '0' && c <= '9' ? c - '0' + 52
         : c == '+'             ? 62
         : c == '/'             ? 63
                                : -1;
}

/* Decode four characters to up to three bytes.  Padding ends one piece, and another may
 * follow: headers of compressed data are pieces of their own. */
static void decode_group(stream *s)
{
  uint32_t bits = 0;
  unsigned digits = 0, read = 0;
  while (read < 4) {
    const int c = next_character(s);
    if (isspace(c))
      continue;
    const int digit = digit_of(c);
    if (digit < 0 && c != '=') {
      s->ended = true;
      return;
    }
    bits = bits << 6 | (uint32_t)(digit < 0 ? 0 : digit);
    digits += digit >= 0;
    read++;
  }
  s->count = digits * 6 / 8;
  s->taken = 0;
  for (unsigned i = 0; i < 3; i++)
    s->ready[i] = (unsigned char)(bits >> (16 - 8 * i));
}

static size_t pull(void *context, unsigned char *bytes, size_t most)
{
  stream *s = context;
  if (!s->base64)
    return fread(bytes, 1, most, s->file);
  size_t n = 0;
  while (n < most && !s->ended) {
    if (s->taken == s->count)
      decode_group(s);
    else
      bytes[n++] = s->ready[s->taken++];
  }
  return n;
}

static bool read_number(const document *d, stream *s, uint64_t *number)
{
  unsigned char bytes[8];
  const size_t size = d->wide_header ? 8 : 4;
  if (pull(s, bytes, size) != size)
    return zs_volume_fail(d->input, NULL, "the data ends too early");
  *number = 0;
  for (size_t i = 0; i < size; i++)
    *number = *number << 8 | bytes[d->big_endian ? i : size - 1 - i];
  return true;
}

/* The header of compressed data: it must be for as many bytes as there are. */
static bool read_blocks(const document *d, stream *s, uint64_t size)
{
  uint64_t blocks, block, last, compressed;
  if (!read_number(d, s, &blocks) || !read_number(d, s, &block) || !read_number(d, s, &last))
    return false;
  const double whole = (double)block * ((double)blocks - (last != 0)) + (double)last;
  if (blocks == 0 || whole != (double)size)
    return zs_volume_fail(d->input, "DataArray", "holds %g bytes; expected %g", whole,
                          (double)size);
  for (uint64_t i = 0; i < blocks; i++)
    if (!read_number(d, s, &compressed))
      return false;
  return true;
}

static bool read_bytes(document *d, stream *s)
{
  zs_volume *volume = d->input->volume;
  const size_t size = zs_volume_count(volume) * zs_voxel_size(volume->type);
  const double most = d->compressed ? 1032 : 1;
  if (!zs_volume_allocate(d->input, (double)d->input->length * most))
    return false;
  if (d->compressed) {
    if (!read_blocks(d, s, size))
      return false;
    const char *problem = zs_inflate(pull, s, 0, volume->numbers, size);
    if (problem)
      return zs_volume_fail(d->input, NULL, "%s", problem);
  } else {
    uint64_t length;
    if (!read_number(d, s, &length))
      return false;
    if (length != size)
      return zs_volume_fail(d->input, "DataArray", "holds %g bytes; expected %zu", (double)length,
                            size);
    if (pull(s, volume->numbers, size) != size)
      return zs_volume_fail(d->input, NULL, "the data ends too early");
  }
  zs_volume_to_host(volume, d->big_endian);
  return true;
}

static bool read_words(document *d, const zs_element *array)
{
  zs_volume *volume = d->input->volume;
  const size_t count = zs_volume_count(volume);
  if (!zs_volume_allocate(d->input, ((double)array->text_length + 1) / 2 *
                                      (double)zs_voxel_size(volume->type)))
    return false;
  const char *at = array->text, *end = array->text + array->text_length;
  for (size_t i = 0; i < count; i++) {
    double number;
    const size_t length = zs_volume_word(&at, end, &number);
    if (!length)
      return zs_volume_fail(d->input, "DataArray", at == end ? "holds %zu numbers; expected %zu"
                            : "number %zu of %zu is not one", i, count);
    zs_volume_store(volume, i, number);
    at += length;
  }
  return true;
}

static bool read_array(document *d, const zs_element *array)
{
  const char *format = value(array, "format");
  if (!format || strcmp(format, "ascii") == 0)
    return read_words(d, array);
  stream s = {.base64 = true};
  if (strcmp(format, "binary") == 0) {
    s.text = array->text;
    s.end = array->text + array->text_length;
    return read_bytes(d, &s);
  }
  if (strcmp(format, "appended") != 0)
    return zs_volume_fail(d->input, "format", "'%.40s' is not ascii, binary or appended", format);
  double offset = 0;
  if (!d->has_appended)
    return zs_volume_fail(d->input, "AppendedData", "is missing");
  if (!numbers(d, array, "offset", &offset, 1))
    return false;
  const double at = (double)d->appended + offset;
  if (!(offset >= 0 && at < (double)d->input->length) ||
      fseek(d->input->stream, (long)at, SEEK_SET) != 0)
    return zs_volume_fail(d->input, "offset", "%g is behind the end of the file", offset);
  s.file = d->input->stream;
  s.base64 = d->appended_base64;
  return read_bytes(d, &s);
}

/* ---- The file ---------------------------------------------------------------------------- */

static bool read_settings(document *d)
{
  const zs_element *root = d->root;
  const char *compressor = value(root, "compressor");
  if (strcmp(root->name, "VTKFile") != 0 || !is_value(root, "type", "ImageData"))
    return zs_volume_fail(d->input, "VTKFile", "is not of type ImageData");
  d->big_endian = is_value(root, "byte_order", "BigEndian");
  d->wide_header = is_value(root, "header_type", "UInt64");
  d->compressed = compressor && *compressor;
  return !d->compressed || strcmp(compressor, "vtkZLibDataCompressor") == 0 ||
         zs_volume_fail(d->input, "compressor", "'%.40s' cannot be read; expected "
                        "vtkZLibDataCompressor", compressor);
}

static bool read_document(document *d)
{
  zs_volume_input *input = d->input;
  if (!read_settings(d))
    return false;
  const zs_element *image = child(d->root, "ImageData"), *piece = child(image, "Piece");
  if (!piece)
    return zs_volume_fail(input, "Piece", "is missing");
  if (child(piece, "Piece") || (piece->next && strcmp(piece->next->name, "Piece") == 0))
    return zs_volume_fail(input, "Piece", "there are several; expected one");
  bool cells;
  const zs_element *array = find_array(piece, &cells);
  if (!array)
    return zs_volume_fail(input, "DataArray", "is missing");
  const char *type = value(array, "type");
  if (!zs_volume_set_type(input, "type", type ? type : "", types, sizeof types / sizeof *types))
    return false;
  double components = 1;
  if (!numbers(d, array, "NumberOfComponents", &components, 1))
    return false;
  if (components != 1)
    return zs_volume_fail(input, "NumberOfComponents", "%g; expected one number a sample",
                          components);
  return place(d, image, piece, cells) && read_array(d, array);
}

bool zs_volume_read_vti(zs_volume_input *input)
{
  document d = {.input = input};
  bool done = read_text(&d);
  if (done) {
    const zs_source source = {.name = input->path, .text = d.text, .length = d.length};
    d.root = zs_xml_parse(&source, &language, DEPTH, &d.arena, input->diag);
    done = d.root && read_document(&d);
  }
  zs_arena_free(&d.arena);
  free(d.text);
  return done;
}
