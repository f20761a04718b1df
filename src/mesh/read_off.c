/* Geomview's OFF as text: OFF, NOFF (normals), COFF (colours), STOFF (texture
 * coordinates) and their combinations. */
#include "mesh/input.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* The keyword on the first line: [ST][C][N]OFF. */
static bool read_keyword(zs_mesh_input *input, bool *normals)
{
  static const char *const parts[] = {"ST", "C", "N"};
  if (!zs_input_line(input) || !zs_input_word(input))
    return zs_input_fail_truncated(input);
  const char *word = input->word;
  size_t length = input->word_length;
  for (unsigned i = 0; i < 3; i++) {
    size_t n = strlen(parts[i]);
    if (length > n && strncasecmp(word, parts[i], n) == 0) {
      word += n;
      length -= n;
      *normals = i == 2;
    }
  }
  if (length != 3 || strncasecmp(word, "OFF", 3) != 0)
    return zs_input_fail(input, "the file begins with '%.*s'; expected OFF, NOFF, COFF or STOFF",
                         (int)(input->word_length < 40 ? input->word_length : 40), input->word);
  return true;
}

static bool read_vertices(zs_mesh_input *input, uint32_t count, bool normals)
{
  for (uint32_t i = 0; i < count; i++) {
    double numbers[6];
    if (!zs_input_line(input))
      return zs_input_fail_truncated(input);
    if (!zs_input_numbers(input, numbers, normals ? 6 : 3) ||
        !zs_input_add_vertex(input, numbers) ||
        (normals && !zs_input_add_normal(input, i, numbers + 3)))
      return false;
  }
  return true;
}

static bool read_faces(zs_mesh_input *input, uint32_t count, uint32_t **corners, size_t *capacity)
{
  for (uint32_t i = 0; i < count; i++) {
    uint32_t n;
    if (!zs_input_line(input))
      return zs_input_fail_truncated(input);
    zs_input_word(input);
    if (!zs_input_count(input, &n))
      return false;
    for (uint32_t k = 0; k < n; k++) {
      if (!zs_input_word(input))
        return zs_input_fail(input, "the line ends after %u of %u corners", k, n);
      uint32_t *grown = zs_input_grow(input, *corners, capacity, (size_t)k + 1, sizeof **corners);
      if (!grown)
        return false;
      *corners = grown;
      if (!zs_input_count(input, &grown[k]))
        return false;
    }
    if (!zs_input_add_polygon(input, *corners, n))
      return false;
  }
  return true;
}

bool zs_mesh_read_off(zs_mesh_input *input)
{
  bool normals = false;
  uint32_t vertices, faces;
  if (!read_keyword(input, &normals))
    return false;
  if (!zs_input_token(input))
    return false;
  if (zs_input_is(input, "BINARY"))
    return zs_input_fail(input, "binary OFF files are not supported; expected text");
  if (!zs_input_count(input, &vertices) || !zs_input_token(input) ||
      !zs_input_count(input, &faces))
    return false;
  /* The number of edges follows, and is often wrong. */
  uint32_t *corners = NULL;
  size_t capacity = 0;
  bool done = read_vertices(input, vertices, normals) &&
              read_faces(input, faces, &corners, &capacity);
  free(corners);
  return done;
}
