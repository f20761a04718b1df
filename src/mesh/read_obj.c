/* Wavefront OBJ: v, vn and f; everything else is passed over. */
#include "mesh/input.h"

#include <stdlib.h>

typedef struct reader {
  zs_mesh_input *input;
  double *normals; /* 3 for each vn */
  size_t normal_count, normal_capacity;
  uint32_t *corners, *corner_normals; /* of the face being read */
  size_t corner_count, corner_capacity, corner_normal_capacity;
  bool face_normals; /* faces say which normal belongs to a corner */
} reader;

enum { NONE = UINT32_MAX };

/* A reference at the start of `text`: 1, 2, ... from the beginning of the list
 * or -1, -2, ... from its end so far.  Returns its length, 0 when there is none;
 * the number counts from 0. */
static size_t parse_reference(const char *text, size_t length, size_t listed, uint32_t *number)
{
  bool from_end = length && text[0] == '-';
  size_t at = from_end;
  uint64_t n = 0;
  for (; at < length && text[at] >= '0' && text[at] <= '9'; at++)
    if (n < UINT32_MAX)
      n = 10 * n + (uint64_t)(text[at] - '0');
  if (at == from_end || n == 0 || n >= UINT32_MAX || (from_end && n > listed))
    return 0;
  *number = (uint32_t)(from_end ? listed - n : n - 1);
  return at;
}

static bool fail_corner(zs_mesh_input *input)
{
  return zs_input_fail(input, "'%.*s' is not a corner of a face; expected v, v/t, v//n or v/t/n "
                              "with numbers from 1, or from -1 backwards",
                       (int)(input->word_length < 40 ? input->word_length : 40), input->word);
}

/* One corner of a face: the latest word. */
static bool read_corner(reader *r, uint32_t *vertex, uint32_t *normal)
{
  zs_mesh_input *input = r->input;
  const char *at = input->word, *end = at + input->word_length;
  size_t n = parse_reference(at, (size_t)(end - at), input->vertex_count, vertex);
  *normal = NONE;
  if (!n)
    return fail_corner(input);
  at += n;
  if (at == end)
    return true;
  if (*at++ != '/')
    return fail_corner(input);
  while (at < end && *at != '/') /* texture coordinates are of no interest */
    at++;
  if (at == end)
    return true;
  at++;
  n = parse_reference(at, (size_t)(end - at), r->normal_count, normal);
  if (!n || at + n != end)
    return fail_corner(input);
  if (*normal >= r->normal_count)
    return zs_input_fail(input, "a corner has normal %u; there are %zu before it", *normal + 1,
                         r->normal_count);
  return true;
}

static bool add_corner(reader *r, uint32_t vertex, uint32_t normal)
{
  uint32_t *grown = zs_input_grow(r->input, r->corners, &r->corner_capacity, r->corner_count + 1,
                                  sizeof *r->corners);
  if (!grown)
    return false;
  r->corners = grown;
  grown = zs_input_grow(r->input, r->corner_normals, &r->corner_normal_capacity,
                        r->corner_count + 1, sizeof *r->corner_normals);
  if (!grown)
    return false;
  r->corner_normals = grown;
  r->corners[r->corner_count] = vertex;
  r->corner_normals[r->corner_count++] = normal;
  return true;
}

static bool read_face(reader *r)
{
  uint32_t vertex, normal;
  r->corner_count = 0;
  while (zs_input_word(r->input))
    if (!read_corner(r, &vertex, &normal) || !add_corner(r, vertex, normal))
      return false;
  if (!zs_input_add_polygon(r->input, r->corners, r->corner_count))
    return false;
  for (size_t i = 0; i < r->corner_count; i++) {
    if (r->corner_normals[i] == NONE)
      continue;
    r->face_normals = true;
    if (r->corners[i] >= r->input->vertex_count)
      return zs_input_fail(r->input, "a face has vertex %u; there are %zu before it",
                           r->corners[i] + 1, r->input->vertex_count);
    if (!zs_input_add_normal(r->input, r->corners[i],
                             r->normals + 3 * (size_t)r->corner_normals[i]))
      return false;
  }
  return true;
}

static bool read_normal(reader *r)
{
  double n[3];
  if (!zs_input_numbers(r->input, n, 3))
    return false;
  double *grown = zs_input_grow(r->input, r->normals, &r->normal_capacity, r->normal_count + 1,
                                3 * sizeof *r->normals);
  if (!grown)
    return false;
  r->normals = grown;
  for (size_t k = 0; k < 3; k++)
    r->normals[3 * r->normal_count + k] = n[k];
  r->normal_count++;
  return true;
}

static bool read_lines(reader *r)
{
  double p[3];
  while (zs_input_line(r->input)) {
    bool done = true;
    zs_input_word(r->input);
    if (zs_input_is(r->input, "v"))
      done = zs_input_numbers(r->input, p, 3) && zs_input_add_vertex(r->input, p);
    else if (zs_input_is(r->input, "vn"))
      done = read_normal(r);
    else if (zs_input_is(r->input, "f"))
      done = read_face(r);
    if (!done)
      return false;
  }
  return true;
}

/* Files of points have no faces to tell which normal is whose: one for each
 * vertex, in order. */
static bool pair_normals(reader *r)
{
  if (r->face_normals || r->normal_count != r->input->vertex_count)
    return true;
  for (size_t i = 0; i < r->normal_count; i++)
    if (!zs_input_add_normal(r->input, i, r->normals + 3 * i))
      return false;
  return true;
}

bool zs_mesh_read_obj(zs_mesh_input *input)
{
  reader r = {.input = input};
  bool done = read_lines(&r) && pair_normals(&r);
  free(r.normals);
  free(r.corners);
  free(r.corner_normals);
  return done;
}
