/* Stereolithography files, binary and text.  Their triangles share no vertices:
 * corners at the same place become one. */
#include "mesh/input.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { HEADER = 84, RECORD = 50 }; /* bytes before the triangles, and of each */

/* Vertices by their coordinates: open addressing, entries are 1 + a vertex. */
typedef struct welder {
  zs_mesh_input *input;
  uint32_t *slots;
  size_t slot_count; /* a power of two */
} welder;

static uint64_t mix(uint64_t h, uint32_t word)
{
  h = (h ^ word) * UINT64_C(0x9e3779b97f4a7c15);
  return h ^ h >> 29;
}

/* Where a vertex is, or should be, in the table. */
static uint32_t *find(const welder *w, const float p[3])
{
  uint32_t bits[3];
  memcpy(bits, p, sizeof bits);
  size_t at = (size_t)mix(mix(mix(0, bits[0]), bits[1]), bits[2]);
  for (;; at++) {
    uint32_t *slot = &w->slots[at & (w->slot_count - 1)];
    if (!*slot || memcmp(w->input->positions + 3 * (size_t)(*slot - 1), p, 3 * sizeof *p) == 0)
      return slot;
  }
}

/* Keep the table at most half full. */
static bool make_room(welder *w)
{
  if (2 * (w->input->vertex_count + 1) <= w->slot_count)
    return true;
  size_t wanted = w->slot_count ? 2 * w->slot_count : 1024;
  uint32_t *slots = calloc(wanted, sizeof *slots);
  if (!slots)
    return zs_fail_memory(w->input->diag);
  free(w->slots);
  w->slots = slots;
  w->slot_count = wanted;
  for (size_t v = 0; v < w->input->vertex_count; v++)
    *find(w, w->input->positions + 3 * v) = (uint32_t)v + 1;
  return true;
}

static bool weld(welder *w, const double position[3], uint32_t *vertex)
{
  float p[3];
  if (!make_room(w))
    return false;
  for (int k = 0; k < 3; k++)
    p[k] = position[k] == 0 ? 0 : (float)position[k]; /* -0 is 0 */
  uint32_t *slot = find(w, p);
  if (!*slot) {
    const double exact[3] = {(double)p[0], (double)p[1], (double)p[2]};
    if (!zs_input_add_vertex(w->input, exact))
      return false;
    *slot = (uint32_t)w->input->vertex_count;
  }
  *vertex = *slot - 1;
  return true;
}

/* ---- Binary ------------------------------------------------------------------ */

static bool read_binary(welder *w, uint32_t count)
{
  const char *record = w->input->source.text + HEADER;
  for (uint32_t t = 0; t < count; t++, record += RECORD) {
    uint32_t triangle[3];
    for (unsigned c = 0; c < 3; c++) {
      double p[3];
      for (unsigned k = 0; k < 3; k++)
        p[k] = (double)zs_float_of_bits(
          (uint32_t)zs_bytes_load(record + 12 * (c + 1) + 4 * k, 4, false));
      if (!weld(w, p, &triangle[c]))
        return false;
    }
    if (!zs_input_add_polygon(w->input, triangle, 3))
      return false;
  }
  return true;
}

/* ---- Text ---------------------------------------------------------------------- */

static bool read_loop(welder *w)
{
  uint32_t triangle[3];
  for (unsigned c = 0; c < 3; c++) {
    double p[3];
    if (!zs_input_line(w->input) || !zs_input_word(w->input))
      return zs_input_fail_truncated(w->input);
    if (!zs_input_is(w->input, "vertex"))
      return zs_input_fail(w->input, "expected a vertex, number %u of the triangle", c + 1);
    if (!zs_input_numbers(w->input, p, 3) || !weld(w, p, &triangle[c]))
      return false;
  }
  if (!zs_input_line(w->input) || !zs_input_word(w->input))
    return zs_input_fail_truncated(w->input);
  if (!zs_input_is(w->input, "endloop"))
    return zs_input_fail(w->input, "expected endloop after three vertices");
  return zs_input_add_polygon(w->input, triangle, 3);
}

/* Any number of solids; what is between the loops says nothing of its own. */
static bool read_text(welder *w)
{
  zs_mesh_input *input = w->input;
  bool open = false;
  while (zs_input_line(input)) {
    zs_input_word(input);
    if (zs_input_is(input, "solid"))
      open = true;
    else if (zs_input_is(input, "endsolid"))
      open = false;
    else if (zs_input_is(input, "outer")) {
      if (!read_loop(w))
        return false;
    } else if (!zs_input_is(input, "facet") && !zs_input_is(input, "endfacet")) {
      return zs_input_fail(input,
                           "expected solid, facet, outer loop, endfacet or endsolid");
    }
  }
  return !open || zs_input_fail_truncated(input);
}

static bool read_any(welder *w)
{
  zs_mesh_input *input = w->input;
  const size_t length = input->source.length;
  const char *text = input->source.text;
  uint64_t count = length >= HEADER ? zs_bytes_load(text + HEADER - 4, 4, false) : 0;
  /* Binary headers may begin with "solid" too: the size decides. */
  bool fits = length >= HEADER && length == HEADER + RECORD * count;
  if (!fits && length >= 5 && strncasecmp(text, "solid", 5) == 0)
    return read_text(w);
  if (length < HEADER || length < HEADER + RECORD * count)
    return zs_input_fail_truncated(input);
  return read_binary(w, (uint32_t)count);
}

bool zs_mesh_read_stl(zs_mesh_input *input)
{
  welder w = {.input = input};
  bool done = read_any(&w);
  free(w.slots);
  return done;
}
