/* Inside the mesh readers: a file in memory, and the mesh that grows from it.
 *
 * Mesh files are read by our own readers rather than OpenMesh's: those trust
 * what they read (list lengths, half-edge numbers, the first line of an empty
 * file), end the program by assertions, open the material files that an OBJ
 * file names, and cannot tell the line of a mistake. */
#ifndef ZS_MESH_INPUT_H
#define ZS_MESH_INPUT_H

#include "mesh/mesh.h"

#include "base/diagnostic.h"

typedef struct zs_mesh_input {
  zs_source source; /* the whole file; a byte 0 follows its text */
  zs_diag *diag;
  /* Text: the rest of the current line, and the word read last. */
  size_t at, line_end;
  uint32_t line; /* 0 before the first, and in binary files */
  const char *word;
  size_t word_length;
  /* The mesh so far. */
  float *positions, *normals;
  uint32_t *triangles;
  size_t vertex_count, vertex_capacity, normal_capacity, triangle_count, triangle_capacity;
  size_t normals_given;
  uint32_t highest_index, highest_line; /* the highest vertex asked for, and where */
} zs_mesh_input;

/* One format: false after reporting. */
bool zs_mesh_read_stl(zs_mesh_input *input);
bool zs_mesh_read_ply(zs_mesh_input *input);
bool zs_mesh_read_obj(zs_mesh_input *input);
bool zs_mesh_read_off(zs_mesh_input *input);
bool zs_mesh_read_om(zs_mesh_input *input);

/* ---- Text ------------------------------------------------------------------ */

/* Go to the next line that is not blank or a comment; false at the end. */
bool zs_input_line(zs_mesh_input *input);

/* The next word of the line, in word and word_length; false at its end.  A '#'
 * ends a line. */
bool zs_input_word(zs_mesh_input *input);
/* The next word of this line or the following ones; false after reporting. */
bool zs_input_token(zs_mesh_input *input);

/* Whether the latest word is `text`, in any case of letters. */
bool zs_input_is(const zs_mesh_input *input, const char *text);

/* The latest word as a number or as a whole number of 0 .. 2^32 - 2; false
 * after reporting. */
bool zs_input_number(zs_mesh_input *input, double *number);
bool zs_input_count(zs_mesh_input *input, uint32_t *count);

/* `n` numbers from the current line; false after reporting. */
bool zs_input_numbers(zs_mesh_input *input, double *numbers, unsigned n);

/* Report a syntax error at the latest word, in text; returns false. */
bool zs_input_fail(zs_mesh_input *input, const char *format, ...)
  __attribute__((format(printf, 2, 3)));

/* ---- Binary data ------------------------------------------------------------ */

/* Numbers are built from bytes, whatever this machine's order is. */
static inline uint64_t zs_bytes_load(const void *bytes, unsigned size, bool big_endian)
{
  const unsigned char *b = bytes;
  uint64_t number = 0;
  for (unsigned i = 0; i < size; i++)
    number = number << 8 | b[big_endian ? i : size - 1 - i];
  return number;
}

float zs_float_of_bits(uint32_t bits);
double zs_double_of_bits(uint64_t bits);

/* Report that the file ends too early; returns false. */
bool zs_input_fail_truncated(zs_mesh_input *input);

/* ---- Building ---------------------------------------------------------------- */

/* All return false after reporting. */
bool zs_input_add_vertex(zs_mesh_input *input, const double position[3]);
/* The normal of a vertex, of any length; added to what was given before. */
bool zs_input_add_normal(zs_mesh_input *input, size_t vertex, const double normal[3]);
/* A fan of triangles.  Vertices may come later in the file. */
bool zs_input_add_polygon(zs_mesh_input *input, const uint32_t *vertices, size_t count);

/* Room for `count` elements of a growing array; NULL after reporting. */
void *zs_input_grow(zs_mesh_input *input, void *array, size_t *capacity, size_t count,
                    size_t size);

#endif
