/* Stanford polygon files: text, little- and big-endian.  Vertices may have
 * normals; elements and properties of no interest are passed over. */
#include "mesh/input.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAXIMUM_ELEMENTS = 64, MAXIMUM_PROPERTIES = 256 };

typedef enum role { X, Y, Z, NX, NY, NZ, CORNERS, OTHER } role;

typedef enum encoding { TEXT, LITTLE_ENDIAN_DATA, BIG_ENDIAN_DATA } encoding;

typedef struct type {
  const char *name;
  unsigned size;
  enum { UNSIGNED, SIGNED, REAL } kind;
} type;

static const type types[] = {
  {"char", 1, SIGNED},   {"int8", 1, SIGNED},    {"uchar", 1, UNSIGNED}, {"uint8", 1, UNSIGNED},
  {"short", 2, SIGNED},  {"int16", 2, SIGNED},   {"ushort", 2, UNSIGNED}, {"uint16", 2, UNSIGNED},
  {"int", 4, SIGNED},    {"int32", 4, SIGNED},   {"uint", 4, UNSIGNED},  {"uint32", 4, UNSIGNED},
  {"float", 4, REAL},    {"float32", 4, REAL},   {"double", 8, REAL},    {"float64", 8, REAL},
};

typedef struct property {
  const type *value;
  const type *length; /* of lists, else NULL */
  role role;
} property;

typedef struct element {
  bool vertices, faces;
  uint32_t count;
  unsigned first_property, property_count;
} element;

typedef struct reader {
  zs_mesh_input *input;
  encoding encoding;
  size_t at; /* in binary data */
  element elements[MAXIMUM_ELEMENTS];
  property properties[MAXIMUM_PROPERTIES];
  unsigned element_count, property_count;
  uint32_t *corners;
  size_t corner_capacity;
} reader;

/* ---- The header ----------------------------------------------------------------- */

/* The next word of the line; false after reporting that it is missing. */
static bool need_word(zs_mesh_input *input, const char *what)
{
  return zs_input_word(input) || zs_input_fail(input, "the line ends before %s", what);
}

static bool read_format(reader *r)
{
  if (!need_word(r->input, "the format"))
    return false;
  if (zs_input_is(r->input, "ascii"))
    r->encoding = TEXT;
  else if (zs_input_is(r->input, "binary_little_endian"))
    r->encoding = LITTLE_ENDIAN_DATA;
  else if (zs_input_is(r->input, "binary_big_endian"))
    r->encoding = BIG_ENDIAN_DATA;
  else
    return zs_input_fail(r->input, "unknown format; expected ascii, binary_little_endian or "
                                   "binary_big_endian");
  return true;
}

static bool read_element(reader *r)
{
  if (r->element_count == MAXIMUM_ELEMENTS)
    return zs_input_fail(r->input, "more than %d elements", MAXIMUM_ELEMENTS);
  element *e = &r->elements[r->element_count];
  *e = (element){.first_property = r->property_count};
  if (!need_word(r->input, "the element's name"))
    return false;
  e->vertices = zs_input_is(r->input, "vertex");
  e->faces = zs_input_is(r->input, "face");
  if (!need_word(r->input, "the number of elements") || !zs_input_count(r->input, &e->count))
    return false;
  r->element_count++;
  return true;
}

static bool read_type(reader *r, const type **found)
{
  if (!need_word(r->input, "the type"))
    return false;
  for (size_t i = 0; i < sizeof types / sizeof *types; i++)
    if (zs_input_is(r->input, types[i].name)) {
      *found = &types[i];
      return true;
    }
  return zs_input_fail(r->input, "unknown type of a property");
}

static role role_of(const zs_mesh_input *input, const element *e, bool list)
{
  static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz"};
  if (e->vertices && !list)
    for (unsigned i = 0; i < 6; i++)
      if (zs_input_is(input, names[i]))
        return (role)i;
  if (e->faces && list &&
      (zs_input_is(input, "vertex_indices") || zs_input_is(input, "vertex_index")))
    return CORNERS;
  return OTHER;
}

static bool read_property(reader *r)
{
  if (!r->element_count)
    return zs_input_fail(r->input, "a property before the first element");
  if (r->property_count == MAXIMUM_PROPERTIES)
    return zs_input_fail(r->input, "more than %d properties", MAXIMUM_PROPERTIES);
  element *e = &r->elements[r->element_count - 1];
  property *p = &r->properties[r->property_count];
  *p = (property){.role = OTHER};
  size_t before = r->input->at;
  if (!need_word(r->input, "the type"))
    return false;
  bool list = zs_input_is(r->input, "list");
  if (list) {
    if (!read_type(r, &p->length))
      return false;
    if (p->length->kind == REAL)
      return zs_input_fail(r->input, "the length of a list is no whole number");
  } else {
    r->input->at = before;
  }
  if (!read_type(r, &p->value) || !need_word(r->input, "the property's name"))
    return false;
  p->role = role_of(r->input, e, list);
  e->property_count++;
  r->property_count++;
  return true;
}

static bool read_header(reader *r)
{
  zs_mesh_input *input = r->input;
  bool format = false;
  if (!zs_input_line(input) || !zs_input_word(input))
    return zs_input_fail_truncated(input);
  if (!zs_input_is(input, "ply"))
    return zs_input_fail(input, "the file does not begin with 'ply'");
  while (zs_input_line(input)) {
    bool done = true;
    zs_input_word(input);
    if (zs_input_is(input, "end_header")) {
      r->at = input->line_end + 1;
      return format || zs_input_fail(input, "the header has no format");
    }
    if (zs_input_is(input, "format"))
      done = format = read_format(r);
    else if (zs_input_is(input, "element"))
      done = read_element(r);
    else if (zs_input_is(input, "property"))
      done = read_property(r);
    else if (!zs_input_is(input, "comment") && !zs_input_is(input, "obj_info"))
      done = zs_input_fail(input, "unknown line of the header; expected format, comment, element, "
                                  "property or end_header");
    if (!done)
      return false;
  }
  return zs_input_fail_truncated(input);
}

/* ---- The data ---------------------------------------------------------------------- */

static bool read_binary(reader *r, const type *t, double *number)
{
  zs_mesh_input *input = r->input;
  if (r->at > input->source.length || input->source.length - r->at < t->size)
    return zs_input_fail_truncated(input);
  uint64_t bits =
    zs_bytes_load(input->source.text + r->at, t->size, r->encoding == BIG_ENDIAN_DATA);
  r->at += t->size;
  if (t->kind == REAL)
    *number = t->size == 4 ? (double)zs_float_of_bits((uint32_t)bits) : zs_double_of_bits(bits);
  else if (t->kind == SIGNED && bits >> (8 * t->size - 1))
    *number = (double)bits - ldexp(1, 8 * (int)t->size);
  else
    *number = (double)bits;
  return true;
}

static bool read_number(reader *r, const type *t, double *number)
{
  if (r->encoding != TEXT)
    return read_binary(r, t, number);
  return zs_input_token(r->input) && zs_input_number(r->input, number);
}

static bool read_whole(reader *r, const type *t, const char *what, uint32_t *number)
{
  double n;
  if (!read_number(r, t, &n))
    return false;
  if (!(n >= 0 && n < UINT32_MAX && n == floor(n)))
    return zs_input_fail(r->input, "%s is %g; expected a whole number from 0 to %u", what, n,
                         UINT32_MAX - 1);
  *number = (uint32_t)n;
  return true;
}

static bool read_corners(reader *r, const property *p)
{
  uint32_t count;
  if (!read_whole(r, p->length, "the number of corners of a face", &count))
    return false;
  for (uint32_t i = 0; i < count; i++) {
    uint32_t *grown = zs_input_grow(r->input, r->corners, &r->corner_capacity, (size_t)i + 1,
                                    sizeof *r->corners);
    if (!grown)
      return false;
    r->corners = grown;
    if (!read_whole(r, p->value, "the corner of a face", &grown[i]))
      return false;
  }
  return zs_input_add_polygon(r->input, r->corners, count);
}

static bool skip_list(reader *r, const property *p)
{
  uint32_t count;
  double ignored;
  if (!read_whole(r, p->length, "the length of a list", &count))
    return false;
  for (uint32_t i = 0; i < count; i++)
    if (!read_number(r, p->value, &ignored))
      return false;
  return true;
}

/* One vertex, face or other element. */
static bool read_one(reader *r, const element *e, uint32_t number, unsigned roles)
{
  double values[OTHER + 1] = {0};
  for (unsigned i = 0; i < e->property_count; i++) {
    const property *p = &r->properties[e->first_property + i];
    bool done = p->role == CORNERS ? read_corners(r, p)
                : p->length        ? skip_list(r, p)
                                   : read_number(r, p->value, &values[p->role]);
    if (!done)
      return false;
  }
  if (!e->vertices)
    return true;
  const unsigned normal = 1u << NX | 1u << NY | 1u << NZ;
  return zs_input_add_vertex(r->input, values) &&
         ((roles & normal) != normal || zs_input_add_normal(r->input, number, values + NX));
}

static bool read_elements(reader *r, const element *e)
{
  const unsigned position = 1u << X | 1u << Y | 1u << Z;
  unsigned roles = 0;
  for (unsigned i = 0; i < e->property_count; i++)
    roles |= 1u << r->properties[e->first_property + i].role;
  if (e->vertices && (roles & position) != position)
    return zs_input_fail(r->input, "the vertices have no properties x, y and z");
  for (uint32_t n = 0; n < e->count && e->property_count; n++)
    if (!read_one(r, e, n, roles))
      return false;
  return true;
}

static bool read_data(reader *r)
{
  if (r->encoding != TEXT)
    r->input->line = 0; /* mistakes in binary data have no line */
  for (unsigned i = 0; i < r->element_count; i++)
    if (!read_elements(r, &r->elements[i]))
      return false;
  return true;
}

bool zs_mesh_read_ply(zs_mesh_input *input)
{
  reader *r = calloc(1, sizeof *r);
  if (!r)
    return zs_fail_memory(input->diag);
  r->input = input;
  bool done = read_header(r) && read_data(r);
  free(r->corners);
  free(r);
  return done;
}
