/* Mesh files: what is written is read back; malformed files are errors. */
#include "../random.h"
#include "solids.h"

#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

static const char *const ENDINGS[] = {"stl", "ply", "obj", "off", "om"};
enum { FORMATS = 5, NAME = 64 };

/* Files of this test, in the current folder. */
static const char *file_name(char name[NAME], const char *ending)
{
  snprintf(name, NAME, "test-mesh-files-%ld.%s", (long)getpid(), ending);
  return name;
}

/* Write bytes to a file and read it as a mesh. */
static zs_mesh *read_bytes(const char *ending, const void *bytes, size_t length, zs_diag *diag)
{
  char name[NAME];
  FILE *stream = fopen(file_name(name, ending), "wb");
  assert_non_null(stream);
  assert_int_equal(fwrite(bytes, 1, length, stream), length);
  assert_int_equal(fclose(stream), 0);
  zs_mesh *mesh = zs_mesh_read(name, diag);
  remove(name);
  return mesh;
}

static zs_mesh *read_text(const char *ending, const char *text, zs_diag *diag)
{
  return read_bytes(ending, text, strlen(text), diag);
}

/* The bytes that a mesh is written as. */
static unsigned char *write_bytes(const char *ending, const zs_mesh *mesh, size_t *length)
{
  char name[NAME];
  assert_true(zs_mesh_write(mesh, file_name(name, ending), NULL));
  FILE *stream = fopen(name, "rb");
  assert_non_null(stream);
  assert_int_equal(fseek(stream, 0, SEEK_END), 0);
  *length = (size_t)ftell(stream);
  rewind(stream);
  unsigned char *bytes = malloc(*length);
  assert_non_null(bytes);
  assert_int_equal(fread(bytes, 1, *length, stream), *length);
  fclose(stream);
  remove(name);
  return bytes;
}

/* The same triangles in the same order, from the same corner or another one. */
static void assert_same_surface(const zs_mesh *a, const zs_mesh *b)
{
  assert_int_equal(a->triangle_count, b->triangle_count);
  for (size_t t = 0; t < a->triangle_count; t++) {
    bool same = false;
    for (unsigned turn = 0; turn < 3 && !same; turn++) {
      same = true;
      for (unsigned c = 0; c < 3; c++)
        same = same && memcmp(a->positions + 3 * (size_t)a->triangles[3 * t + c],
                              b->positions + 3 * (size_t)b->triangles[3 * t + (c + turn) % 3],
                              3 * sizeof(float)) == 0;
    }
    assert_true(same);
  }
}

static void assert_normals_near(const zs_mesh *a, const zs_mesh *b)
{
  assert_non_null(a->normals);
  assert_non_null(b->normals);
  assert_int_equal(a->vertex_count, b->vertex_count);
  for (size_t i = 0; i < 3 * a->vertex_count; i++)
    assert_true(fabsf(a->normals[i] - b->normals[i]) < 1e-6f);
}

static void every_format_keeps_the_mesh(void **state)
{
  (void)state;
  for (int f = 0; f < FORMATS; f++)
    for (int normals = 0; normals < 2; normals++) {
      zs_mesh *mesh = make_torus(17, 13, 1e3, 1.0 / 3, normals);
      size_t length;
      unsigned char *bytes = write_bytes(ENDINGS[f], mesh, &length);
      zs_mesh *read = read_bytes(ENDINGS[f], bytes, length, NULL);
      assert_non_null(read);
      assert_int_equal(read->vertex_count, mesh->vertex_count);
      assert_same_surface(mesh, read);
      bool keeps_normals = strcmp(ENDINGS[f], "stl") != 0 && strcmp(ENDINGS[f], "off") != 0;
      if (normals && keeps_normals)
        assert_normals_near(mesh, read);
      else
        assert_null(read->normals);
      zs_mesh_free(read);
      free(bytes);
      zs_mesh_free(mesh);
    }
}

/* Writing twice gives the same bytes, whatever the locale. */
static void bytes_do_not_depend_on_the_locale(void **state)
{
  (void)state;
  static const char *const locales[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "C.UTF-8"};
  zs_mesh *mesh = make_torus(5, 4, 1.5, 0.3, true);
  for (int f = 0; f < FORMATS; f++) {
    size_t length, again;
    unsigned char *bytes = write_bytes(ENDINGS[f], mesh, &length);
    for (int l = 0; l < 4; l++) {
      if (!setlocale(LC_ALL, locales[l]))
        continue;
      unsigned char *other = write_bytes(ENDINGS[f], mesh, &again);
      zs_mesh *read = read_bytes(ENDINGS[f], other, again, NULL);
      setlocale(LC_ALL, "C");
      assert_int_equal(again, length);
      assert_memory_equal(other, bytes, length);
      assert_non_null(read);
      assert_same_surface(mesh, read);
      zs_mesh_free(read);
      free(other);
    }
    free(bytes);
  }
  zs_mesh_free(mesh);
}

/* A file cut anywhere is an error, or a shorter list of whole elements where a
 * format does not say how many there are.  Nothing crashes. */
static void truncated_files_are_errors(void **state)
{
  (void)state;
  zs_mesh *mesh = make_torus(4, 3, 1.5, 0.3, true);
  for (int f = 0; f < FORMATS; f++) {
    size_t length;
    unsigned char *bytes = write_bytes(ENDINGS[f], mesh, &length);
    bool counted = strcmp(ENDINGS[f], "obj") != 0;
    for (size_t n = 0; n < length; n++) {
      zs_diag diag = {0};
      zs_mesh *read = read_bytes(ENDINGS[f], bytes, n, &diag);
      assert_int_equal(diag.errors, read ? 0 : 1);
      if (!read)
        continue;
      /* In text the last number may lose digits, and the last line its end. */
      bool text = strcmp(ENDINGS[f], "off") == 0;
      assert_true(!counted || (text && n + 3 > length));
      zs_mesh_free(read);
    }
    free(bytes);
  }
  zs_mesh_free(mesh);
}

/* Damaged bytes: any answer but a crash; a mesh that is read is consistent. */
static void damaged_files_do_no_harm(void **state)
{
  (void)state;
  uint64_t seed = 77;
  zs_mesh *mesh = make_torus(4, 3, 1.5, 0.3, true);
  for (int f = 0; f < FORMATS; f++) {
    size_t length;
    unsigned char *bytes = write_bytes(ENDINGS[f], mesh, &length);
    unsigned char *damaged = malloc(length);
    assert_non_null(damaged);
    for (int run = 0; run < 1500; run++) {
      memcpy(damaged, bytes, length);
      unsigned where = random_below(&seed, 2) ? (unsigned)length : 120;
      for (unsigned i = 0; i <= random_below(&seed, 3); i++)
        damaged[random_below(&seed, where < length ? where : (unsigned)length)] =
          (unsigned char)random_bits(&seed);
      zs_diag diag = {0};
      zs_mesh *read = read_bytes(ENDINGS[f], damaged, length, &diag);
      assert_int_equal(diag.errors, read ? 0 : 1);
      if (!read)
        continue;
      for (size_t i = 0; i < 3 * read->triangle_count; i++)
        assert_true(read->triangles[i] < read->vertex_count);
      for (size_t i = 0; i < 3 * read->vertex_count; i++)
        assert_true(isfinite(read->positions[i]));
      zs_mesh_free(read);
    }
    free(damaged);
    free(bytes);
  }
  zs_mesh_free(mesh);
}

/* ---- Particular files ------------------------------------------------------------ */

typedef struct expectation {
  const char *ending, *text;
  size_t vertices, triangles;
  bool normals;
} expectation;

static void other_writers_files_are_read(void **state)
{
  (void)state;
  static const expectation files[] = {
    {"obj", "# c\r\nmtllib /etc/passwd\no a\nv 0 0 0 1 0 0\nv 1 0 0\n v 1 1 0 # c\nv 0 1 0\n"
            "vt 0 0\nusemtl x\nf 1/1 2/1 3/1 4/1\nf -4 -2 -1\n", 4, 3, false},
    {"obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 2\nf 1//1 2//1 3//-1\n", 3, 1, true},
    {"obj", "v 0 0 0\nv 1 0 0\nvn 0 0 2\nvn 1 0 0\n", 2, 0, true},
    {"obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv +1.5e0 1 0", 3, 1, false},
    {"off", "OFF 3 1 0\n0 0 0\n1 0 0\n# c\n0 1 0\n3 0 1 2 255 0 0\n", 3, 1, false},
    {"off", "NOFF\n\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n", 3, 1, true},
    {"off", "COFF\n3 0 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n", 3, 0, false},
    {"stl", "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex -0 1 0\n"
            "endloop\nendfacet\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 1 0 0\nVERTEX 1 1 0\n"
            "VERTEX 0.0 1e0 -0\nENDLOOP\nENDFACET\nendsolid a b\n", 4, 2, false},
    {"ply", "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty double x\n"
            "property double y\nproperty double z\nproperty uchar red\nelement face 1\n"
            "property list uchar uint vertex_index\nproperty list uchar float w\nelement extra 1\n"
            "property int a\nend_header\n0 0 0 255\n1 0 0 255\n1 1 0 255\n0 1 0 255\n"
            "4 0 1 2 3 2 0.5 0.5\n7\n", 4, 2, false},
    {"ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float nz\nproperty float x\n"
            "property float z\nproperty float y\nproperty float nx\nproperty float ny\nend_header\n"
            "1 0 0 0 0 0\n", 1, 0, true},
  };
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    zs_mesh *mesh = read_text(files[i].ending, files[i].text, NULL);
    assert_non_null(mesh);
    assert_int_equal(mesh->vertex_count, files[i].vertices);
    assert_int_equal(mesh->triangle_count, files[i].triangles);
    assert_int_equal(mesh->normals != NULL, files[i].normals);
    for (size_t v = 0; v < mesh->vertex_count && mesh->normals; v++) {
      const float *n = mesh->normals + 3 * v;
      assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-6f);
    }
    zs_mesh_free(mesh);
  }
}

/* Big-endian PLY, byte by byte. */
static void big_endian_files_are_read(void **state)
{
  (void)state;
  static const char header[] =
    "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty short y\n"
    "property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  static const unsigned char data[] = {
    0x3f, 0x80, 0, 0, 0xff, 0xfe, 0x40, 0, 0, 0, 0, 0, 0, 0, /* 1 -2 2 */
    0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0,                /* 0 3 0 */
    0xc0, 0, 0, 0, 1, 0, 0xbf, 0xf0, 0, 0, 0, 0, 0, 0,       /* -2 256 -1 */
    3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2};
  static const float expected[9] = {1, -2, 2, 0, 3, 0, -2, 256, -1};
  unsigned char bytes[sizeof header - 1 + sizeof data];
  memcpy(bytes, header, sizeof header - 1);
  memcpy(bytes + sizeof header - 1, data, sizeof data);
  zs_mesh *mesh = read_bytes("ply", bytes, sizeof bytes, NULL);
  assert_non_null(mesh);
  assert_int_equal(mesh->vertex_count, 3);
  assert_memory_equal(mesh->positions, expected, sizeof expected);
  assert_int_equal(mesh->triangle_count, 1);
  zs_mesh_free(mesh);
}

typedef struct mistake {
  const char *ending, *text;
  unsigned line, column;
  const char *message;
} mistake;

typedef struct seen {
  unsigned line, column, count;
  bool named;
  char message[256];
} seen;

static void remember(void *context, const zs_diagnostic *d)
{
  seen *s = context;
  s->line = d->line;
  s->column = d->column;
  s->count++;
  s->named = d->file && strncmp(d->file, "test-mesh-files-", 16) == 0;
  snprintf(s->message, sizeof s->message, "%s", d->message);
}

static void mistakes_are_named_with_their_place(void **state)
{
  (void)state;
  static const mistake files[] = {
    {"obj", "v 0 0 0\nv 1 x 0\n", 2, 5, "'x' is not a number"},
    {"obj", "v 0 0 0\nv 1 nan 0\n", 2, 5, "'nan' is not a number"},
    {"obj", "v 0 0 0\nv 1 0\n", 2, 6, "the line ends after 2 of 3 numbers"},
    {"obj", "v 0 0 1e39\n", 1, 7, "vertex 0 has the coordinate 1e+39"},
    {"obj", "v 0 0 0\n\nf 1 2 3\n", 3, 0, "a face has vertex 2"},
    {"obj", "v 0 0 0\nf 1 1\n", 2, 6, "a face with 2 corners"},
    {"obj", "v 0 0 0\nf 1 0 1\n", 2, 5, "'0' is not a corner"},
    {"obj", "v 0 0 0\nf 1 1/a 1/1/\n", 2, 9, "'1/1/' is not a corner"},
    {"obj", "v 0 0 0\nf 1 1 1//2\n", 2, 7, "a corner has normal 2"},
    {"obj", "# nothing\n", 0, 0, "the file has no vertices"},
    {"obj", "", 0, 0, "the file has no vertices"},
    {"off", "", 0, 0, "the file ends too early"},
    {"off", "OF\n", 1, 1, "the file begins with 'OF'"},
    {"off", "OFF BINARY\n", 1, 5, "binary OFF files are not supported"},
    {"off", "OFF\n-1 0 0\n", 2, 1, "'-1' is not a whole number"},
    {"off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", 4, 0, "a face has vertex 1"},
    {"off", "OFF\n1 1 0\n0 0 0\n4000000000 0 0 1\n", 4, 17, "the line ends after 3 of 4000000000"},
    {"stl", "", 0, 0, "the file ends too early"},
    {"stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nedge\n", 5, 1,
     "expected a vertex, number 2"},
    {"stl", "solid a\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 0 0\n", 6, 1,
     "expected endloop"},
    {"stl", "solid a\nhello\n", 2, 1, "expected solid, facet"},
    {"stl", "solid a\n", 1, 1, "the file ends too early"},
    {"ply", "", 0, 0, "the file ends too early"},
    {"ply", "plyx\n", 1, 1, "the file does not begin with 'ply'"},
    {"ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty flat x\n", 4, 10, "unknown type"},
    {"ply", "ply\nformat text 1.0\n", 2, 8, "unknown format"},
    {"ply", "ply\nformat ascii 1.0\nproperty float x\n", 3, 1, "a property before"},
    {"ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", 5, 1,
     "the vertices have no properties x, y and z"},
    {"ply", "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\n"
            "end_header\n3 0 1 -2\n", 6, 7, "the corner of a face is -2"},
    {"ply", "ply\nformat ascii 1.0\nelement face 4000000000\nproperty list uchar int a\n"
            "end_header\n", 5, 11, "the file ends too early"},
    {"om", "", 0, 0, "the file ends too early"},
    {"om", "OMX345678901234567890", 0, 0, "the file does not begin with"},
  };
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    seen s = {0};
    zs_diag diag = {.report = remember, .context = &s};
    assert_null(read_text(files[i].ending, files[i].text, &diag));
    assert_int_equal(s.count, 1);
    assert_int_equal(diag.status, ZS_ERROR_SYNTAX);
    assert_true(s.named);
    if (!strstr(s.message, files[i].message) || s.line != files[i].line ||
        s.column != files[i].column)
      fail_msg("file %zu: %u:%u: %s", i, s.line, s.column, s.message);
  }
}

static void names_and_folders_are_checked(void **state)
{
  (void)state;
  zs_mesh *mesh = make_cube();
  zs_diag diag = {0};
  assert_null(zs_mesh_read("mesh.xyz", &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  diag = (zs_diag){0};
  assert_null(zs_mesh_read("no-such-folder/mesh.stl", &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
  diag = (zs_diag){0};
  assert_false(zs_mesh_write(mesh, "mesh", &diag));
  assert_int_equal(diag.status, ZS_ERROR_ARGUMENT);
  diag = (zs_diag){0};
  assert_false(zs_mesh_write(mesh, "no-such-folder/mesh.ply", &diag));
  assert_int_equal(diag.status, ZS_ERROR_IO);
  zs_mesh_free(mesh);
}

/* OpenMesh's format cannot hold what is not manifold: an error, and no file. */
static void unfit_meshes_leave_no_file(void **state)
{
  (void)state;
  char name[NAME];
  zs_mesh *mesh = make_cube();
  mesh->triangles[0] = mesh->triangles[1];
  zs_diag diag = {0};
  assert_false(zs_mesh_write(mesh, file_name(name, "om"), &diag));
  assert_int_equal(diag.status, ZS_ERROR_UNABLE);
  assert_int_equal(access(name, F_OK), -1);
  zs_mesh_free(mesh);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(every_format_keeps_the_mesh),
    cmocka_unit_test(bytes_do_not_depend_on_the_locale),
    cmocka_unit_test(truncated_files_are_errors),
    cmocka_unit_test(damaged_files_do_no_harm),
    cmocka_unit_test(other_writers_files_are_read),
    cmocka_unit_test(big_endian_files_are_read),
    cmocka_unit_test(mistakes_are_named_with_their_place),
    cmocka_unit_test(names_and_folders_are_checked),
    cmocka_unit_test(unfit_meshes_leave_no_file),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
