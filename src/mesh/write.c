/* Writing meshes: straight from the arrays, but for OpenMesh's own format. */
#include "mesh/openmesh.h"

#include "base/diagnostic.h"
#include "base/names.h"
#include "base/output.h"

#include <errno.h>
#include <math.h>
#include <string.h>

enum { BUFFER = 16384, FLOAT_SIZE = 32 };

/* Bytes on their way to a file, little-endian whatever this machine is. */
typedef struct writer {
  const zs_mesh *mesh;
  FILE *stream;
  size_t used;
  unsigned char bytes[BUFFER];
} writer;

static void flush(writer *w)
{
  fwrite(w->bytes, 1, w->used, w->stream); /* errors are the stream's, seen on commit */
  w->used = 0;
}

static void put_byte(writer *w, unsigned byte)
{
  if (w->used == BUFFER)
    flush(w);
  w->bytes[w->used++] = (unsigned char)byte;
}

static void put_number(writer *w, uint32_t number, unsigned size)
{
  for (unsigned i = 0; i < size; i++)
    put_byte(w, number >> 8 * i & 0xff);
}

static void put_float(writer *w, float number)
{
  uint32_t bits;
  memcpy(&bits, &number, sizeof bits);
  put_number(w, bits, sizeof bits);
}

static void put_text(writer *w, const char *text)
{
  while (*text)
    put_byte(w, (unsigned char)*text++);
}

/* Nine digits tell all floats apart.  The locale's decimal point, whatever its
 * bytes, becomes a point. */
static void put_decimal(writer *w, float number)
{
  char text[FLOAT_SIZE];
  snprintf(text, sizeof text, "%.9g", (double)number);
  bool point = false;
  for (const char *at = text; *at; at++) {
    if (strchr("0123456789+-e", *at)) {
      put_byte(w, (unsigned char)*at);
    } else if (!point) {
      put_byte(w, '.');
      point = true;
    }
  }
}

static void put_decimals(writer *w, const float *numbers)
{
  for (int k = 0; k < 3; k++) {
    if (k)
      put_byte(w, ' ');
    put_decimal(w, numbers[k]);
  }
  put_byte(w, '\n');
}

static void put_count(writer *w, size_t count)
{
  char text[FLOAT_SIZE];
  snprintf(text, sizeof text, "%zu", count);
  put_text(w, text);
}

/* ---- Formats ------------------------------------------------------------------- */

static void face_normal(const zs_mesh *mesh, const uint32_t *corners, float normal[3])
{
  const float *p[3];
  double n[3], square = 0;
  for (int c = 0; c < 3; c++)
    p[c] = mesh->positions + 3 * (size_t)corners[c];
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = ((double)p[1][i] - p[0][i]) * ((double)p[2][j] - p[0][j]) -
           ((double)p[1][j] - p[0][j]) * ((double)p[2][i] - p[0][i]);
    square += n[k] * n[k];
  }
  for (int k = 0; k < 3; k++)
    normal[k] = square > 0 ? (float)(n[k] / sqrt(square)) : 0;
}

static bool write_stl(writer *w, zs_diag *diag)
{
  static const char header[80] = "binary STL, made by Zeroset"; /* must not begin with "solid" */
  const zs_mesh *mesh = w->mesh;
  if (mesh->triangle_count > UINT32_MAX)
    return zs_fail(diag, ZS_ERROR_UNABLE, NULL,
                   "an STL file cannot hold %zu triangles; expected up to %u",
                   mesh->triangle_count, UINT32_MAX);
  for (size_t i = 0; i < sizeof header; i++)
    put_byte(w, (unsigned char)header[i]);
  put_number(w, (uint32_t)mesh->triangle_count, 4);
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *corners = &mesh->triangles[3 * t];
    float normal[3];
    face_normal(mesh, corners, normal);
    for (int k = 0; k < 3; k++)
      put_float(w, normal[k]);
    for (int c = 0; c < 3; c++)
      for (size_t k = 0; k < 3; k++)
        put_float(w, mesh->positions[3 * (size_t)corners[c] + k]);
    put_number(w, 0, 2);
  }
  return true;
}

static bool write_ply(writer *w, zs_diag *diag)
{
  (void)diag;
  const zs_mesh *mesh = w->mesh;
  put_text(w, "ply\nformat binary_little_endian 1.0\ncomment made by Zeroset\nelement vertex ");
  put_count(w, mesh->vertex_count);
  put_text(w, "\nproperty float x\nproperty float y\nproperty float z\n");
  if (mesh->normals)
    put_text(w, "property float nx\nproperty float ny\nproperty float nz\n");
  put_text(w, "element face ");
  put_count(w, mesh->triangle_count);
  /* Signed numbers are the custom; a mesh that needs the last bit gets it. */
  put_text(w, mesh->vertex_count > INT32_MAX ? "\nproperty list uchar uint vertex_indices\n"
                                             : "\nproperty list uchar int vertex_indices\n");
  put_text(w, "end_header\n");
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    for (size_t k = 0; k < 3; k++)
      put_float(w, mesh->positions[3 * v + k]);
    for (size_t k = 0; mesh->normals && k < 3; k++)
      put_float(w, mesh->normals[3 * v + k]);
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    put_byte(w, 3);
    for (size_t c = 0; c < 3; c++)
      put_number(w, mesh->triangles[3 * t + c], 4);
  }
  return true;
}

static bool write_obj(writer *w, zs_diag *diag)
{
  (void)diag;
  const zs_mesh *mesh = w->mesh;
  put_text(w, "# made by Zeroset\n");
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    put_text(w, "v ");
    put_decimals(w, mesh->positions + 3 * v);
  }
  for (size_t v = 0; mesh->normals && v < mesh->vertex_count; v++) {
    put_text(w, "vn ");
    put_decimals(w, mesh->normals + 3 * v);
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    put_byte(w, 'f');
    for (size_t c = 0; c < 3; c++) {
      size_t vertex = (size_t)mesh->triangles[3 * t + c] + 1;
      put_byte(w, ' ');
      put_count(w, vertex);
      if (mesh->normals) {
        put_text(w, "//");
        put_count(w, vertex);
      }
    }
    put_byte(w, '\n');
  }
  return true;
}

/* Plain OFF: few programs read its form with normals. */
static bool write_off(writer *w, zs_diag *diag)
{
  (void)diag;
  const zs_mesh *mesh = w->mesh;
  put_text(w, "OFF\n");
  put_count(w, mesh->vertex_count);
  put_byte(w, ' ');
  put_count(w, mesh->triangle_count);
  put_text(w, " 0\n");
  for (size_t v = 0; v < mesh->vertex_count; v++)
    put_decimals(w, mesh->positions + 3 * v);
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    put_byte(w, '3');
    for (size_t c = 0; c < 3; c++) {
      put_byte(w, ' ');
      put_count(w, mesh->triangles[3 * t + c]);
    }
    put_byte(w, '\n');
  }
  return true;
}

static bool write_om(writer *w, zs_diag *diag)
{
  return zs_mesh_require_manifold(w->mesh, "write it as .om", diag) &&
         zs_openmesh_write(w->mesh, w->stream, diag);
}

typedef struct format {
  const char *ending;
  bool (*write)(writer *w, zs_diag *diag);
} format;

static const format formats[] = {
  {".stl", write_stl}, {".ply", write_ply}, {".obj", write_obj},
  {".off", write_off}, {".om", write_om},
};

static const format *format_of(const char *path)
{
  for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
    if (zs_name_ends_in(path, formats[i].ending))
      return &formats[i];
  return NULL;
}

bool zs_mesh_write(const zs_mesh *mesh, const char *path, zs_diag *diag)
{
  const format *f = format_of(path);
  if (!f)
    return zs_fail(diag, ZS_ERROR_ARGUMENT, path,
                   "the ending of the name is no mesh format; expected .stl .ply .obj .off or "
                   ".om");
  zs_output output;
  if (!zs_output_open(&output, path, diag))
    return false;
  writer w = {.mesh = mesh, .stream = output.stream};
  bool written = f->write(&w, diag);
  flush(&w);
  if (!written) {
    zs_output_discard(&output);
    return false;
  }
  return zs_output_commit(&output, diag);
}
