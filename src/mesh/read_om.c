/* OpenMesh's own binary format, versions 1 and 2: chunks of properties; since
 * version 2 faces are given by half-edges. */
#include "mesh/input.h"

#include <stdlib.h>
#include <string.h>

enum { HEADER = 16 };
enum { VERTEX = 0, MESH = 1, FACE = 2, EDGE = 4, HALFEDGE = 6, SENTINEL = 7 }; /* entities */
enum { POSITION = 0, NORMAL = 1, CUSTOM = 6, TOPOLOGY = 7 };                   /* types */

/* What a chunk holds for each of its entities: `dimension` numbers of `size`
 * bytes. */
typedef struct chunk {
  bool named, is_float, is_signed;
  unsigned entity, type, dimension, size;
} chunk;

typedef struct reader {
  zs_mesh_input *input;
  const char *at, *end;
  char kind;        /* T, Q or P: triangles, quads, polygons */
  unsigned version; /* major */
  uint32_t vertices, faces, edges;
  uint32_t *next, *to, *face; /* by half-edge */
} reader;

static bool has(const reader *r, uint64_t bytes)
{
  return (uint64_t)(r->end - r->at) >= bytes;
}

/* The caller has made sure that the bytes are there. */
static uint64_t load(reader *r, unsigned size)
{
  uint64_t number = zs_bytes_load(r->at, size, false);
  r->at += size;
  return number;
}

/* Negative numbers, "no face", become UINT32_MAX, and so do larger ones. */
static uint32_t load_index(reader *r, const chunk *c)
{
  uint64_t number = load(r, c->size);
  if ((c->is_signed && number >> (8 * c->size - 1)) || number > UINT32_MAX)
    return UINT32_MAX;
  return (uint32_t)number;
}

static bool read_header(reader *r)
{
  if (!has(r, HEADER))
    return zs_input_fail_truncated(r->input);
  if (r->at[0] != 'O' || r->at[1] != 'M' || !memchr("TQP", r->at[2], 3))
    return zs_input_fail(r->input, "the file does not begin with 'OMT', 'OMQ' or 'OMP'");
  r->kind = r->at[2];
  r->version = (unsigned char)r->at[3] >> 5;
  if (r->version < 1 || r->version > 2)
    return zs_input_fail(r->input, "the file has version %u of the format; expected 1 or 2",
                         r->version);
  r->at += 4;
  r->vertices = (uint32_t)load(r, 4);
  r->faces = (uint32_t)load(r, 4);
  r->edges = (uint32_t)load(r, 4);
  if (r->edges > UINT32_MAX / 2)
    return zs_input_fail(r->input, "the file has %u edges; expected at most %u", r->edges,
                         UINT32_MAX / 2);
  return true;
}

/* Bits of a chunk's header, from the lowest: reserved, named (1 each), entity
 * (3), type (4), signed, float (1 each), dimension - 1 (3), log2 of size (2; for
 * floats of size / 4). */
static bool read_chunk(reader *r, chunk *c)
{
  if (!has(r, 2))
    return zs_input_fail_truncated(r->input);
  unsigned bits = (unsigned)load(r, 2);
  *c = (chunk){.named = bits >> 1 & 1,
               .entity = bits >> 2 & 7,
               .type = bits >> 5 & 15,
               .is_signed = bits >> 9 & 1,
               .is_float = bits >> 10 & 1,
               .dimension = (bits >> 11 & 7) + 1};
  /* Writers leave the flag for floats as it was before in front of numbers of
   * half-edges. */
  if (c->type == TOPOLOGY)
    c->is_float = false;
  c->size = (c->is_float ? 4u : 1u) << (bits >> 14 & 3);
  if (!c->named || c->entity == SENTINEL)
    return true;
  if (!has(r, 1))
    return zs_input_fail_truncated(r->input);
  unsigned length = (unsigned)load(r, 1);
  if (!has(r, length))
    return zs_input_fail_truncated(r->input);
  r->at += length;
  return true;
}

/* ---- Chunks -------------------------------------------------------------------------- */

static uint64_t entity_count(const reader *r, const chunk *c)
{
  switch (c->entity) {
  case VERTEX:
    return r->vertices;
  case FACE:
    return r->faces;
  case EDGE:
    return r->edges;
  case HALFEDGE:
    return 2 * (uint64_t)r->edges;
  default:
    return 1;
  }
}

static bool skip(reader *r, uint64_t bytes)
{
  if (!has(r, bytes))
    return zs_input_fail_truncated(r->input);
  r->at += bytes;
  return true;
}

static bool read_vectors(reader *r, const chunk *c)
{
  if (!c->is_float || c->dimension != 3 || c->size > 8)
    return zs_input_fail(r->input, "positions or normals are not three floats or doubles each");
  if (!has(r, (uint64_t)r->vertices * 3 * c->size))
    return zs_input_fail_truncated(r->input);
  for (uint32_t v = 0; v < r->vertices; v++) {
    double p[3];
    for (int k = 0; k < 3; k++) {
      uint64_t bits = load(r, c->size);
      p[k] = c->size == 4 ? (double)zs_float_of_bits((uint32_t)bits) : zs_double_of_bits(bits);
    }
    if (!(c->type == POSITION ? zs_input_add_vertex(r->input, p)
                              : zs_input_add_normal(r->input, v, p)))
      return false;
  }
  return true;
}

/* Version 1: the corners of each face. */
static bool read_corners(reader *r, const chunk *c)
{
  for (uint32_t f = 0; f < r->faces; f++) {
    uint32_t corners[4];
    uint64_t n = r->kind == 'T' ? 3 : 4;
    if (r->kind == 'P') {
      if (!has(r, 2))
        return zs_input_fail_truncated(r->input);
      n = load(r, 2);
    }
    if (!has(r, n * c->size))
      return zs_input_fail_truncated(r->input);
    if (n < 3)
      return zs_input_fail(r->input, "a face with %u corners; expected at least 3", (unsigned)n);
    /* A fan around the first corner. */
    for (uint64_t i = 0; i < n; i++) {
      corners[i < 2 ? i : 2] = load_index(r, c);
      if (i < 2)
        continue;
      if (!zs_input_add_polygon(r->input, corners, 3))
        return false;
      corners[1] = corners[2];
    }
  }
  return true;
}

/* Version 2: for each edge the successor, end and face of its two half-edges. */
static bool read_halfedges(reader *r, const chunk *c)
{
  const uint64_t count = 2 * (uint64_t)r->edges;
  if (r->next)
    return zs_input_fail(r->input, "the half-edges are given twice");
  if (!has(r, count * 3 * c->size))
    return zs_input_fail_truncated(r->input);
  r->next = malloc((count + 1) * sizeof *r->next);
  r->to = malloc((count + 1) * sizeof *r->to);
  r->face = malloc((count + 1) * sizeof *r->face);
  if (!r->next || !r->to || !r->face)
    return zs_fail_memory(r->input->diag);
  for (uint64_t h = 0; h < count; h++) {
    r->next[h] = load_index(r, c);
    r->to[h] = load_index(r, c);
    r->face[h] = load_index(r, c);
  }
  return true;
}

/* One face by a half-edge of it.  A half-edge leads on to another of its face,
 * each once. */
static bool add_face(reader *r, uint32_t face, uint32_t first)
{
  const uint64_t count = 2 * (uint64_t)r->edges;
  uint32_t corners[3], at = first;
  unsigned n = 0;
  do {
    if (!r->next || at >= count || r->face[at] != face)
      return zs_input_fail(r->input, "the half-edges of face %u are inconsistent", face);
    r->face[at] = UINT32_MAX; /* visited */
    corners[n < 2 ? n : 2] = r->to[at];
    if (n >= 2) {
      if (!zs_input_add_polygon(r->input, corners, 3))
        return false;
      corners[1] = corners[2];
    }
    n += n < 3;
    at = r->next[at];
  } while (at != first);
  if (n < 3)
    return zs_input_fail(r->input, "a face with %u corners; expected at least 3", n);
  return true;
}

static bool read_faces(reader *r, const chunk *c)
{
  if (!has(r, (uint64_t)r->faces * c->size))
    return zs_input_fail_truncated(r->input);
  for (uint32_t f = 0; f < r->faces; f++)
    if (!add_face(r, f, load_index(r, c)))
      return false;
  return true;
}

static bool read_chunk_data(reader *r, const chunk *c)
{
  if (c->entity != VERTEX && c->entity != MESH && c->entity != FACE && c->entity != EDGE &&
      c->entity != HALFEDGE)
    return zs_input_fail(r->input, "a chunk of the unknown entity %u", c->entity);
  if (c->type == CUSTOM) {
    if (!has(r, 4))
      return zs_input_fail_truncated(r->input);
    return skip(r, load(r, 4));
  }
  if (c->entity == VERTEX && (c->type == POSITION || c->type == NORMAL))
    return read_vectors(r, c);
  if (c->entity == HALFEDGE && c->type == TOPOLOGY)
    return read_halfedges(r, c);
  if (c->entity == FACE && c->type == TOPOLOGY)
    return r->version < 2 ? read_corners(r, c) : read_faces(r, c);
  return skip(r, entity_count(r, c) * c->dimension * c->size);
}

static bool read_chunks(reader *r)
{
  for (;;) {
    chunk c = {0};
    if (r->version < 2 && r->at == r->end)
      return true; /* the first version had no last chunk */
    if (!read_chunk(r, &c))
      return false;
    if (c.entity == SENTINEL)
      return true;
    if (!read_chunk_data(r, &c))
      return false;
  }
}

bool zs_mesh_read_om(zs_mesh_input *input)
{
  reader r = {.input = input,
              .at = input->source.text,
              .end = input->source.text + input->source.length};
  bool done = read_header(&r) && read_chunks(&r);
  if (done && input->vertex_count != r.vertices)
    done = zs_input_fail(input, "the file has %zu positions for %u vertices",
                         input->vertex_count, r.vertices);
  free(r.next);
  free(r.to);
  free(r.face);
  return done;
}
