/* Pictures and stacks of files as nodes: where they lie, in which order, bad input. */
#include "../random.h"
#include "scene_text.h"

#include <fcntl.h>
#include <math.h>
#include <sys/stat.h>
#include <tiffio.h>

enum { WIDTH = 20, HEIGHT = 16 };

/* A disc about (x, y) from the top left, grey value `inside` on black. */
static void write_disc(const char *name, double x, double y, double radius, int inside)
{
  FILE *file = create(name);
  fprintf(file, "P2\n%d %d\n255\n", WIDTH, HEIGHT);
  for (int i = 0; i < WIDTH * HEIGHT; i++)
    fprintf(file, "%d\n", hypot(i % WIDTH + 0.5 - x, i / WIDTH + 0.5 - y) <= radius ? inside : 0);
  assert_int_equal(fclose(file), 0);
}

#define DOMAIN "<domain min='-99 -99 -99' max='99 99 99'/>"

/* ---- image --------------------------------------------------------------------------------- */

/* Signs at the centres of pixels, wherever the picture lies. */
static void test_image(void **unused)
{
  (void)unused;
  static const struct {
    const char *attributes;
    double pixel, x, y;
    bool down;
  } cases[] = {{"", 1, 0, 0, false},
               {"y='down'", 1, 0, 0, true},
               {"pixel='0.25' origin='3 -2 0'", 0.25, 3, -2, false},
               {"pixel='2' origin='-7 5 9' y='down'", 2, -7, 5, true}};
  write_disc("disc.pgm", 7, 5, 4.2, 255);
  for (unsigned c = 0; c < sizeof cases / sizeof *cases; c++) {
    char text[300];
    snprintf(text, sizeof text, DOMAIN "<image src='disc.pgm' %s/>", cases[c].attributes);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    const double pixel = cases[c].pixel;
    for (int i = -3; i < WIDTH + 3; i++)
      for (int j = -3; j < HEIGHT + 3; j++) {
        const double p[3] = {cases[c].x + (i + 0.5) * pixel,
                             cases[c].y + (cases[c].down ? j + 0.5 : HEIGHT - 0.5 - j) * pixel, 3};
        const float x = (float)p[0], y = (float)p[1], z = (float)p[2];
        float f;
        zs_eval_values(eval, NULL, 1, &x, &y, &z, &f);
        const double away = hypot(i + 0.5 - 7, j + 0.5 - 5);
        assert_true((f >= 0) == (away <= 4.2));
        assert_true((zs_eval_point(eval, p) >= 0) == (away <= 4.2));
        assert_true(fabs((double)f / pixel - (4.2 - away)) < 0.9);
      }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* ---- Order and place ---------------------------------------------------------------------- */

static void write_series(void)
{
  /* Discs that move to the right by one a slice; 10 stands after 9. */
  for (int i = 8; i < 12; i++) {
    char name[40];
    snprintf(name, sizeof name, "run%d.pgm", i);
    write_disc(name, 5 + (i - 8), 8, 4, 255);
  }
}

/* The middle of the disc on a plane. */
static double middle_at(zs_eval *eval, double z, double lo, double hi, double y)
{
  double sum = 0, count = 0;
  for (double x = lo; x < hi; x += (hi - lo) / 400)
    if (zs_eval_point(eval, (const double[3]){x, y, z}) >= 0) {
      sum += x;
      count++;
    }
  return sum / count;
}

static void test_series(void **unused)
{
  (void)unused;
  write_series();
  static const char *const methods[] = {"auto", "linear", "variational",
                                        "linear' continuity='c1", "auto' continuity='c1"};
  for (int m = 0; m < 5; m++) {
    char text[300];
    snprintf(text, sizeof text,
             DOMAIN "<stack src='run*.pgm' spacing='3' pixel='0.5' origin='1 2 10' caps='open' "
                    "method='%s'/>", methods[m]);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (int i = 0; i < 7; i++) {
      const double z = 10 + 1.5 * i, x = 1 + 0.5 * (5 + 0.5 * i);
      assert_true(fabs(middle_at(eval, z, 0, 12, 6) - x) < 0.15);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

static void test_levels_and_every(void **unused)
{
  (void)unused;
  write_series();
  zs_field *field = compile("<stack src='run*.pgm' levels='-1 0 5 6' method='linear'/>");
  zs_eval *eval = evaluator(field);
  double lo[3], hi[3];
  assert_true(zs_field_box(field, lo, hi, NULL));
  assert_true(lo[2] > -1.5 && lo[2] < -0.9 && hi[2] > 5.9 && hi[2] < 6.5);
  assert_true(fabs(middle_at(eval, 5, 0, 20, 8) - 7) < 0.2);
  assert_true(fabs(middle_at(eval, 2.5, 0, 20, 8) - 6.5) < 0.3);
  zs_eval_free(eval);
  zs_field_unref(field);
  field = compile(DOMAIN "<stack src='run*.pgm' every='3' method='linear' caps='open'/>");
  eval = evaluator(field);
  assert_true(fabs(middle_at(eval, 0, 0, 20, 8) - 5) < 0.2);
  assert_true(fabs(middle_at(eval, 3, 0, 20, 8) - 8) < 0.2);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* Only the slab between the first and the last slice, unless the ends are open. */
static void test_caps(void **unused)
{
  (void)unused;
  write_series();
  assert_true(value_in("<stack src='run*.pgm'/>", 6, 8, 3.5) < 0);
  assert_true(value_in(DOMAIN "<stack src='run*.pgm' caps='open'/>", 6, 8, 3.5) > 0);
}

static void test_labels(void **unused)
{
  (void)unused;
  for (int i = 0; i < 3; i++) {
    char name[40];
    snprintf(name, sizeof name, "label%d.pgm", i);
    write_disc(name, 8, 8, 4, i == 1 ? 3 : 7);
  }
  const char *all = DOMAIN "<stack src='label*.pgm' label='7' caps='open' spacing='8'/>";
  assert_true(value_in(all, 8, 8, 0) > 0 && value_in(all, 8, 8, 16) > 0);
  assert_true(value_in(all, 8, 8, 8) < 0); /* there it is another one */
}

/* One number, several, and a file that two stacks share. */
static void test_several_labels(void **unused)
{
  (void)unused;
  FILE *file = create("three.nrrd");
  fprintf(file, "NRRD0004\ntype: int16\ndimension: 3\nsizes: 12 12 4\nencoding: raw\n"
                "endian: little\n\n");
  for (int i = 0; i < 12 * 12 * 4; i++) { /* columns of four pixels: -1, 2, 300 */
    const int label = i % 12 < 4 ? -1 : i % 12 < 8 ? 2 : 300;
    fputc(label & 255, file);
    fputc(label >> 8 & 255, file);
  }
  assert_int_equal(fclose(file), 0);
  static const struct {
    const char *label;
    bool inside[3];
  } cases[] = {{"-1", {true, false, false}}, {"2", {false, true, false}},
               {"300", {false, false, true}}, {"-1 300", {true, false, true}},
               {"300, 2", {false, true, true}}, {"2 7", {false, true, false}}};
  for (unsigned c = 0; c < sizeof cases / sizeof *cases; c++)
    for (int k = 0; k < 3; k++) {
      char text[200];
      snprintf(text, sizeof text, DOMAIN "<stack src='three.nrrd' label='%s'/>", cases[c].label);
      assert_int_equal(value_in(text, 1.5 + 4 * k, 6, 1.5) > 0, cases[c].inside[k]);
    }
  /* Two solids of one file in one scene. */
  const char *both = DOMAIN "<difference><stack src='three.nrrd' label='-1 2'/>"
                            "<stack src='three.nrrd' label='2'/></difference>";
  assert_true(value_in(both, 1.5, 6, 1.5) > 0);
  assert_true(value_in(both, 5.5, 6, 1.5) < 0);
}

/* A file is read once for all stacks of a scene: numbers that are changed behind its back, at
 * the same size and time, are not seen. */
static void test_file_is_read_once(void **unused)
{
  (void)unused;
  static const char HEADER[] = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 3\nencoding: raw\n\n";
  static const char *const body = "<object id='a'><stack src='once.nrrd' label='1'/></object>"
                                  "<object id='b'><stack src='once.nrrd' label='2'/></object>";
  for (int changed = 0; changed < 2; changed++) {
    struct stat before;
    zs_diag diag = {0};
    zs_scene *scenes[2] = {NULL};
    FILE *file = create("once.nrrd");
    fputs(HEADER, file);
    for (int i = 0; i < 8 * 8 * 3; i++)
      fputc(1 + (i % 8 >= 4), file);
    assert_int_equal(fclose(file), 0);
    assert_int_equal(stat(scratch_path(&folder, "once.nrrd"), &before), 0);
    for (int i = 0; i < 2; i++)
      assert_non_null(scenes[i] = parse(body, &diag));
    zs_field *a = zs_scene_compile(scenes[0], "a", NULL, &diag);
    assert_non_null(a);
    file = fopen(scratch_path(&folder, "once.nrrd"), "r+b");
    fputs(HEADER, file);
    for (int i = 0; i < 8 * 8 * 3; i++)
      fputc(7, file);
    assert_int_equal(fclose(file), 0);
    const struct timespec times[2] = {before.st_atim, before.st_mtim};
    assert_int_equal(utimensat(AT_FDCWD, folder.path, times, 0), 0);
    /* A scene that has read it finds the other label; another one does not. */
    zs_field *b = zs_scene_compile(scenes[changed], "b", NULL, &diag);
    assert_int_equal(b != NULL, changed == 0);
    zs_field_unref(a);
    zs_field_unref(b);
    for (int i = 0; i < 2; i++)
      zs_scene_free(scenes[i]);
  }
}

/* ---- TIFF -------------------------------------------------------------------------------- */

/* Pages of a disc that moves to the right by one a page; its number is 3 for even pages. */
static void write_pages(const char *name, const char *mode, int first, int count)
{
  TIFF *file = TIFFOpen(scratch_path(&folder, name), mode);
  assert_non_null(file);
  for (int page = first; page < first + count; page++) {
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, WIDTH);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, HEIGHT);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(file, TIFFTAG_RESOLUTIONUNIT, RESUNIT_CENTIMETER);
    TIFFSetField(file, TIFFTAG_XRESOLUTION, 20.0); /* half a millimetre a pixel */
    TIFFSetField(file, TIFFTAG_YRESOLUTION, 20.0);
    for (int y = 0; y < HEIGHT; y++) {
      uint8_t row[WIDTH];
      for (int x = 0; x < WIDTH; x++)
        row[x] = hypot(x + 0.5 - 5 - page, y + 0.5 - 8) <= 4 ? (page % 2 ? 255 : 3) : 0;
      assert_int_equal(TIFFWriteScanline(file, row, (uint32_t)y, 0), 1);
    }
    assert_true(TIFFWriteDirectory(file));
  }
  TIFFClose(file);
}

/* The pages of one file are the same stack as files of one page. */
static void test_tiff(void **unused)
{
  (void)unused;
  static const char *const rest[] = {"level='0.01'", "level='0.01' every='2' pixel='0.5'",
                                     "level='0.01' pixel='file'", "label='3'",
                                     "level='0.01' levels='0 1 2 4 5.5'"};
  write_pages("pages.tif", "w", 0, 5);
  for (int page = 0; page < 5; page++) {
    char name[20];
    snprintf(name, sizeof name, "one%d.tiff", page);
    write_pages(name, page % 2 ? "wb" : "wl", page, 1);
  }
  for (unsigned i = 0; i < sizeof rest / sizeof *rest; i++) {
    char together[200], apart[200];
    snprintf(together, sizeof together, DOMAIN "<stack src='pages.tif' %s caps='open'/>", rest[i]);
    snprintf(apart, sizeof apart, DOMAIN "<stack src='one*.tiff' %s caps='open'/>", rest[i]);
    zs_field *a = compile(together), *b = compile(apart);
    zs_eval *eval_a = evaluator(a), *eval_b = evaluator(b);
    uint64_t seed = i;
    for (int n = 0; n < 200; n++) {
      const double p[3] = {random_between(&seed, 0, 20), random_between(&seed, 0, 16),
                           random_between(&seed, -1, 6)};
      assert_true(zs_eval_point(eval_a, p) == zs_eval_point(eval_b, p));
    }
    /* The first page's disc is where it should be. */
    const double pixel = strstr(rest[i], "pixel") ? 0.5 : 1;
    assert_true(fabs(middle_at(eval_a, 0, 0, 20 * pixel, 8 * pixel) - 5 * pixel) < 0.2);
    zs_eval_free(eval_a);
    zs_eval_free(eval_b);
    zs_field_unref(a);
    zs_field_unref(b);
  }
  /* Single pages as plane shapes. */
  for (int page = 0; page < 5; page++) {
    char text[200];
    snprintf(text, sizeof text, DOMAIN "<image src='pages.tif' page='%d' level='0.01'/>", page + 1);
    assert_true(value_in(text, 1.6 + page, 8, 0) > 0 && value_in(text, 0.4 + page, 8, 0) < 0);
    assert_true(value_in(text, 8.4 + page, 8, 0) > 0 && value_in(text, 9.6 + page, 8, 0) < 0);
  }
}

/* ---- Outlines ----------------------------------------------------------------------------- */

/* Rings about the axis x = 20, y = 16, whose radii are told by a slice's number. */
static double outer_radius(int i)
{
  return 12 - i;
}
static double hole_radius(int i)
{
  return 3 + 0.5 * i;
}

static const char RING[] =
  "<path fill-rule='evenodd' d='M%g 10 a%g %g 0 0 0 %g 0 a%g %g 0 0 0 %g 0 Z "
  "M%g 10 a%g %g 0 0 0 %g 0 a%g %g 0 0 0 %g 0 Z'/>";

static void write_ring(FILE *file, int i)
{
  const double r = outer_radius(i), h = hole_radius(i);
  fprintf(file, RING, 15 - r, r, r, 2 * r, r, r, -2 * r, 15 - h, h, h, 2 * h, h, h, -2 * h);
}

/* Slices 8 to 11 minus 8, as groups in another order, as files, and as polygons. */
static void write_outlines(void)
{
  static const int order[] = {10, 8, 11, 9};
  FILE *file = create("rings.svg");
  fprintf(file, "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 40 32'>"
                "<g id='all' transform='translate(5 6)'><title>rings</title>");
  for (int k = 0; k < 4; k++) {
    fprintf(file, "<g id='s%d'>", order[k]);
    write_ring(file, order[k] - 8);
    fprintf(file, "</g>");
  }
  fprintf(file, "<g id='s12' display='none'><circle r='3'/></g></g></svg>");
  assert_int_equal(fclose(file), 0);
  for (int i = 0; i < 4; i++) {
    char name[20];
    snprintf(name, sizeof name, "ring%d.svg", i + 8);
    file = create(name);
    fprintf(file, "<svg xmlns='http://www.w3.org/2000/svg' viewBox='-5 -6 40 32'>");
    write_ring(file, i);
    fprintf(file, "</svg>");
    assert_int_equal(fclose(file), 0);
    snprintf(name, sizeof name, "poly%d.txt", i + 8);
    file = create(name);
    for (int ring = 0; ring < 2; ring++, fprintf(file, "\n"))
      for (int k = 0; k < 720; k++) {
        const double r = ring ? hole_radius(i) : outer_radius(i), t = k * 3.14159265358979 / 360;
        fprintf(file, "%.9g %.9g\n", 20 + r * cos(t), 16 + r * sin(t));
      }
    assert_int_equal(fclose(file), 0);
  }
}

/* The exact distance at every level, whichever way the rings come. */
static void test_outlines(void **unused)
{
  (void)unused;
  static const struct {
    const char *attributes;
    double x, y, z[4];
  } cases[] = {{"src='rings.svg' spacing='3' pixel='0.5'", 0, 0, {0, 3, 6, 9}},
               {"src='ring*.svg' spacing='3'", 0, 0, {0, 3, 6, 9}},
               {"src='poly*.txt' spacing='3' pixel='0.5'", 0, 0, {0, 3, 6, 9}},
               {"src='rings.svg' spacing='3' pixel='0.5' y='down'", 0, 0, {0, 3, 6, 9}},
               {"src='rings.svg' levels='1 2 4 9' pixel='0.4' origin='3 -7 5'", 3, -7, {1, 2, 4, 9}},
               {"src='rings.svg' spacing='4' pixel='0.3' origin='0 1 5' method='extended'", 0, 1,
                {5, 9, 13, 17}}};
  write_outlines();
  for (unsigned c = 0; c < sizeof cases / sizeof *cases; c++) {
    char text[300];
    snprintf(text, sizeof text, DOMAIN "<stack %s caps='open'/>", cases[c].attributes);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (int i = 0; i < 4; i++)
      for (double radius = 0; radius < 16; radius += 0.37) {
        const double turn = 2.4 * radius;
        const double p[3] = {cases[c].x + 20 + radius * cos(turn),
                             cases[c].y + 16 + radius * sin(turn), cases[c].z[i]};
        const double f = zs_eval_point(eval, p);
        const double expected = fmin(outer_radius(i) - radius, radius - hole_radius(i));
        /* Cubics between samples round off the ridges of distances. */
        const bool ridge = radius < 1 ||
                           fabs(radius - (outer_radius(i) + hole_radius(i)) / 2) < 1;
        if (fabs(expected) < 0.3 && !ridge && fabs(f - expected) > 0.04)
          fail_msg("%s: %g is not %g at radius %g of slice %d", text, f, expected, radius, i);
        assert_true(fabs(expected) < 0.02 || (f > 0) == (expected > 0));
      }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* Empty groups are empty slices; every n-th group. */
static void test_outline_choices(void **unused)
{
  (void)unused;
  write_outlines();
  write_text("gap.svg", "<svg xmlns='http://www.w3.org/2000/svg'><g id='a'><circle r='5'/></g>"
                        "<g id='b'/><g id='c'><circle r='5'/></g></svg>");
  const char *gap = DOMAIN "<stack src='gap.svg' spacing='4' pixel='0.5' caps='open'/>";
  assert_true(value_in(gap, 0, 0, 0) > 0 && value_in(gap, 0, 0, 8) > 0);
  assert_true(value_in(gap, 0, 0, 4) < 0);
  const char *odd = DOMAIN "<stack src='rings.svg' every='2' pixel='0.5' caps='open'/>";
  assert_true(fabs(value_in(odd, 30, 16, 2)) < 0.02); /* the third ring, of radius 10 */
}

/* A volume with other sides and axes: the file says where it lies. */
static void test_volume(void **unused)
{
  (void)unused;
  FILE *file = create("labels.nrrd");
  fprintf(file, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 12 12 6\nspace dimension: 3\n"
                "space directions: (0,0.5,0) (0,0,0.5) (2,0,0)\nspace origin: (10,20,30)\n"
                "encoding: raw\n\n");
  for (int i = 0; i < 12 * 12 * 6; i++)
    fputc(hypot(i % 12 - 5, i / 12 % 12 - 6) < 4 ? 3 : hypot(i % 12 - 5, 0) < 1 ? 2 : 0, file);
  assert_int_equal(fclose(file), 0);
  const char *text = DOMAIN "<stack src='labels.nrrd' label='3' caps='open'/>";
  zs_field *field = compile(text);
  zs_eval *eval = evaluator(field);
  for (double x = 10; x <= 20; x += 1.25) {
    assert_true(zs_eval_point(eval, (const double[3]){x, 22.5, 33}) > 0.9);
    assert_true(fabs(zs_eval_point(eval, (const double[3]){x, 24.5, 33})) < 0.3);
    assert_true(zs_eval_point(eval, (const double[3]){x, 25.5, 33}) < -0.7);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
  /* By level both labels count. */
  assert_true(value_in(DOMAIN "<stack src='labels.nrrd' every='2' caps='open'/>", 14, 22.5, 30) >
              0);
  assert_true(value_in(DOMAIN "<stack src='labels.nrrd' level='2.5' caps='open'/>", 14, 22.5, 30) <
              0);
}

/* A ball of labels, its pixels as large as told. */
static void write_ball(const char *name, double x, double y, double z)
{
  enum { SIDE = 24, SLICES = 8 };
  FILE *file = create(name);
  fprintf(file, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: %d %d %d\nspacings: %g %g %g\n"
                "encoding: raw\n\n", SIDE, SIDE, SLICES, x, y, z);
  for (int i = 0; i < SIDE * SIDE * SLICES; i++) {
    const double dx = i % SIDE - 11.2, dy = i / SIDE % SIDE - 12.1, dz = 3 * (i / SIDE / SIDE - 3.5);
    fputc(dx * dx + dy * dy + dz * dz < 90, file);
  }
  assert_int_equal(fclose(file), 0);
}

/* Pixels that are not square stretch the solid: the same as of square ones of their area, which
 * every given pixel of is on its side. */
static void test_pixels_that_are_not_square(void **unused)
{
  (void)unused;
  write_ball("square.nrrd", 2, 2, 6);
  write_ball("oblong.nrrd", 1, 4, 6);
  zs_field *square = compile(DOMAIN "<stack src='square.nrrd' label='1'/>");
  zs_field *oblong = compile(DOMAIN "<stack src='oblong.nrrd' label='1'/>");
  zs_eval *a = evaluator(square), *b = evaluator(oblong);
  unsigned inside = 0;
  for (int i = 0; i < 24 * 24 * 15; i++) {
    const double x = i % 24, y = i / 24 % 24, z = i / 24 / 24 * 0.5;
    const double f = zs_eval_point(a, (const double[3]){2 * x, 2 * y, 6 * z});
    assert_true(fabs(f - zs_eval_point(b, (const double[3]){x, 4 * y, 6 * z})) < 1e-5);
    const double dx = x - 11.2, dy = y - 12.1, dz = 3 * (z - 3.5);
    if (z == floor(z))
      assert_int_equal(f >= 0, dx * dx + dy * dy + dz * dz < 90);
    inside += f >= 0;
  }
  assert_true(inside > 500);
  zs_eval_free(a);
  zs_eval_free(b);
  zs_field_unref(square);
  zs_field_unref(oblong);
}

/* The field tells what moves, in the scene's coordinates. */
static void test_correspondence(void **unused)
{
  (void)unused;
  write_disc("far1.pgm", 5, 8, 3, 255);
  write_disc("far2.pgm", 11, 8, 3, 255);
  zs_field *field = compile(DOMAIN "<translate by='0 0 1'><stack src='far*.pgm' pixel='2' "
                                   "spacing='10' origin='100 50 7'/></translate>");
  zs_correspondence c;
  assert_true(zs_field_correspondence(field, 0, &c));
  assert_false(zs_field_correspondence(field, 1, &c));
  assert_string_equal(c.element, "stack");
  assert_true(c.found && c.count > 10 && c.places == 2);
  assert_true(fabs(c.level[0] - 7) < 1e-5 && fabs(c.level[1] - 17) < 1e-5);
  assert_true(fabs(c.normal[2] - 1) < 1e-9);
  for (size_t i = 0; i < c.count; i++) {
    const double *from = c.ways + 6 * i, *to = from + 3;
    assert_true(fabs(from[2] - 8) < 1e-4 && fabs(to[2] - 18) < 1e-4);
    assert_true(fabs(to[0] - from[0] - 12) < 2 && fabs(to[1] - from[1]) < 2);
  }
  zs_field_unref(field);
}

/* ---- Bad input --------------------------------------------------------------------------- */

static void test_bad_input(void **unused)
{
  (void)unused;
  write_series();
  write_disc("gap1.pgm", 8, 8, 4, 255);
  write_disc("gap2.pgm", 8, 8, 4, 255);
  write_disc("gap4.pgm", 8, 8, 4, 255);
  write_disc("black1.pgm", 8, 8, 4, 0);
  write_disc("black2.pgm", 8, 8, 4, 0);
  write_disc("size1.pgm", 8, 8, 4, 255);
  write_text("size2.pgm", "P2\n3 3\n255\n0 0 0 0 255 0 0 0 0\n");
  write_text("cut.pgm", "P2\n3 3\n255\n0 0 0");
  write_text("thick.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 2\n"
                           "spacings: 1 2 1\nencoding: ascii\n\n1 1");
  write_pages("pages.tif", "w", 0, 3);
  write_pages("more1.tif", "w", 0, 1);
  write_pages("more2.tif", "w", 0, 2);
  refuses("<image src='pages.tif' page='4'/>", "there is no page 4; the file has 3");
  refuses("<image src='pages.tif' page='0'/>", "expected a whole number");
  refuses("<image src='run8.pgm' page='2'/>", "there is no page 2; the file has 1");
  refuses("<image src='run8.pgm' pixel='file'/>", "does not say how large pixels are");
  refuses("<image src='run8.pgm' pixel='none'/>", "expected 'file' or a length");
  refuses("<stack src='run*.pgm' pixel='file'/>", "does not say how large pixels are");
  refuses("<stack src='more*.tif'/>", "'more2.tif' has several pages; expected");
  refuses("<stack src='more1.tif'/>", "found 1 slice; expected at least 2");
  refuses("<stack src='pages.tif' levels='1 2'/>", "there are 2 numbers, but 3 pages");
  refuses("<stack src='run*.pgm' label='4 5'/>", "no slice has any of the 2 numbers");
  write_outlines();
  write_text("flat.svg", "<svg xmlns='http://www.w3.org/2000/svg'><g id='a'><circle r='5'/></g>"
                         "<g id='b'><path d='M0 0 H9'/></g></svg>");
  write_text("bare.svg", "<svg xmlns='http://www.w3.org/2000/svg'><circle r='5'/></svg>");
  write_text("void.svg", "<svg xmlns='http://www.w3.org/2000/svg'><g id='a'/><g id='b'/></svg>");
  write_text("line1.txt", "0 0\n1 0\n1 1\n");
  write_text("line2.txt", "0 0\n1 1\n");
  write_text("run1.txt", "0 0\n1 0\n1 1\n");
  refuses("<stack src='flat.svg'/>", "'b': the outlines enclose nothing");
  refuses("<stack src='bare.svg'/>", "there are no groups; expected a <g> for every slice");
  refuses("<stack src='void.svg'/>", "all 2 slices are empty");
  write_text("hair1.txt", "0 0\n0.01 0\n0 9\n\n4 0\n4.01 0\n4 9\n");
  write_text("hair2.txt", "0 0\n0.01 0\n0 9\n\n4 0\n4.01 0\n4 9\n");
  refuses("<stack src='hair*.txt' pixel='3'/>", "all 2 slices are empty");
  refuses("<stack src='line*.txt'/>", "'line2.txt': the polygons enclose nothing");
  refuses("<stack src='line1.txt'/>", "found 1 slice; expected at least 2");
  refuses("<stack src='run*'/>", "expected pictures or outlines, not both");
  refuses("<stack src='rings.svg' level='0.5'/>", "outlines have no brightness");
  refuses("<stack src='rings.svg' label='1'/>", "outlines have no labels");
  refuses("<stack src='rings.svg' pixel='file'/>", "outlines have no pixels; expected a length");
  refuses("<stack src='rings.svg' pixel='1e-6'/>", "expected at most 32768 each way");
  refuses("<stack src='rings.svg' levels='1 2'/>", "there are 2 numbers, but 4 slices");
  refuses("<stack src='poly*.txt' y='down'/>", "'poly8.txt' has y as it is");
  refuses("<image src='none.png'/>", "'none.png' cannot be opened");
  refuses("<image src='black1.pgm'/>", "no pixel of the picture is as bright as the level, 0.5");
  refuses("<image src='cut.pgm'/>", "ends too early");
  refuses("<stack src='none*.png'/>", "no file matches 'none*.png'");
  refuses("<stack src='nowhere/*.png'/>", "cannot be opened");
  refuses("<stack src='../*'/>", "outside the folder");
  refuses("<stack src='run8.pgm'/>", "found 1 slice; expected at least 2");
  refuses("<stack src='run*.pgm' every='9'/>", "found 1 slice; expected at least 2");
  refuses("<stack src='gap*.pgm'/>", "a file is missing between 'gap2.pgm' and 'gap4.pgm'");
  refuses("<stack src='black*.pgm'/>", "all 2 slices are empty");
  refuses("<stack src='run*.pgm' label='4'/>", "no slice has a 4");
  refuses("<stack src='size*.pgm'/>", "'size2.pgm' has 3 x 3 pixels; those before have 20 x 16");
  refuses("<stack src='run*.pgm' levels='1 2 3'/>", "there are 3 numbers, but 4 files");
  refuses("<stack src='run*.pgm' levels='1 2 2 3'/>", "2 does not lie beyond 2");
  refuses("<stack src='run*.pgm' levels='1 2 3 4' spacing='1'/>", "cannot be combined");
  refuses("<stack src='run*.pgm' level='0.5' label='1'/>", "cannot be combined");
  refuses("<stack src='run*.pgm' levels=''/>", "there are no numbers");
  refuses("<stack src='run*.pgm' label=' '/>", "there are no numbers");
  write_text("cut.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: ascii\n\n"
                         "1 1 1 1 1");
  write_text("cut.tif", "II*");
  write_text("torn1.tif", "II*\x08");
  write_text("torn2.tif", "II*\x08");
  refuses("<stack src='cut.nrrd' label='1'/>", "the file is too short");
  refuses("<stack src='cut.tif'/>", "this is not a picture");
  refuses("<stack src='torn*.tif'/>", "this is not a picture");
  refuses("<stack src='*.nrrd'/>", "is a volume; expected one such file, or pictures");
  refuses("<stack src='run*.pgm' level='7'/>", "7 is no brightness");
  refuses("<stack src='run*.pgm' every='0'/>", "expected a whole number");
  refuses("<stack src='thick.nrrd' pixel='2'/>", "the volume itself says");
}

/* What is wrong inside a file says who asks for it: the node itself, or a part of it. */
static void test_who_asks(void **unused)
{
  (void)unused;
  write_text("torn3.tif", "II*\x08");
  seen s = refusal("<union><sphere radius='1'/>\n<stack src='torn3.tif'/></union>");
  assert_string_equal(s.file, scratch_path(&folder, "torn3.tif"));
  assert_non_null(strstr(s.hint, "'src' of <stack> asks for this file, in "));
  assert_non_null(strstr(s.hint, "scene.xml:3"));
  write_text("torn.obj", "v 1 2\n");
  s = refusal("<variational>\n<mesh src='torn.obj'/></variational>");
  assert_int_equal(s.line, 1);
  assert_non_null(strstr(s.hint, "'src' of <mesh> asks for this file, in "));
  assert_non_null(strstr(s.hint, "scene.xml:3"));
  /* A volume also says what should have been there. */
  write_text("torn.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 9\nencoding: gzip\n\n"
                          "\x1f\x8b");
  s = refusal("<stack src='torn.nrrd' label='1'/>");
  assert_non_null(strstr(s.message, "2 x 2 x 9 samples of 1 bytes"));
  assert_non_null(strstr(s.hint, "scene.xml:2"));
}

/* Shapes of one pixel, pictures of one, and slices that are empty at the ends. */
static void test_least(void **unused)
{
  (void)unused;
  for (int i = 0; i < 3; i++) {
    char name[20];
    snprintf(name, sizeof name, "dot%d.pgm", i);
    write_disc(name, 8.5, 8.5, 0.1, 255);
    snprintf(name, sizeof name, "mid%d.pgm", i);
    write_disc(name, 8, 8, 4, i == 1 ? 255 : 0);
    snprintf(name, sizeof name, "one%d.pgm", i);
    write_text(name, "P2 1 1 255 255\n");
  }
  static const char *const methods[] = {"auto", "linear", "extended", "variational"};
  for (int m = 0; m < 4; m++) {
    char text[200];
    snprintf(text, sizeof text, DOMAIN "<stack src='dot*.pgm' method='%s'/>", methods[m]);
    for (int z = 0; z < 3; z++) {
      assert_true(value_in(text, 8.5, 7.5, z) >= 0); /* rows count from above */
      assert_true(value_in(text, 9.5, 7.5, z) < 0 && value_in(text, 8.5, 8.5, z) < 0);
    }
    snprintf(text, sizeof text, DOMAIN "<stack src='one*.pgm' method='%s'/>", methods[m]);
    assert_true(value_in(text, 0.5, 0.5, 1) >= 0 && value_in(text, 1.5, 0.5, 1) < 0);
    snprintf(text, sizeof text, DOMAIN "<stack src='mid*.pgm' spacing='6' method='%s'/>",
             methods[m]);
    assert_true(value_in(text, 8, 8, 6) > 0);
    assert_true(value_in(text, 8, 8, 0.5) < 0 && value_in(text, 8, 8, 11.5) < 0);
  }
}

/* Wherever slices lie, the pixels of the first and the last are inside with closed ends. */
static void test_ends_are_inside(void **unused)
{
  (void)unused;
  write_series();
  for (int k = 0; k < 40; k++) {
    const double spacing = 0.37 + 0.773 * k, first = 3.1 * k;
    char text[200];
    snprintf(text, sizeof text, "<stack src='run*.pgm' pixel='0.75' spacing='%.9g' "
             "origin='0 0 %.9g'/>", spacing, first);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (int end = 0; end < 2; end++) {
      const float x = 6.5f * 0.75f, y = 8 * 0.75f, z = (float)(first + 3 * end * spacing);
      float f;
      zs_eval_values(eval, NULL, 1, &x, &y, &z, &f);
      assert_true(f >= 0);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* Slices that are much nearer on one side than on the other do not make the solid swell, nor
 * f so large that nothing is known of it. */
static void test_uneven_gaps(void **unused)
{
  (void)unused;
  static const char *const levels[] = {"0 1 2 30 31 32 33", "0 0.02 2 3 4 5 6",
                                       "0 0.5 10 10.5 20 20.5 30"};
  static const char *const methods[] = {"auto", "extended", "variational"};
  for (int i = 0; i < 7; i++) {
    char name[20];
    snprintf(name, sizeof name, "odd%d.pgm", i);
    write_disc(name, 6 + i, 8, i % 2 ? 5 : 4, 255);
  }
  for (int k = 0; k < 9; k++) {
    char text[200];
    double lo[3], hi[3];
    snprintf(text, sizeof text, "<stack src='odd*.pgm' levels='%s' method='%s'/>",
             levels[k / 3], methods[k % 3]);
    zs_field *field = compile(text);
    assert_true(zs_field_box(field, lo, hi, NULL));
    assert_true(lo[0] > -20 && hi[0] < 40 && lo[1] > -20 && hi[1] < 40);
    zs_eval *eval = evaluator(field);
    for (int i = 0; i < 400; i++) {
      const double angle = 0.7 * i, z = lo[2] + (hi[2] - lo[2]) * i / 400;
      const double out[3] = {9 + 10 * cos(angle), 8 + 8 * sin(angle), z}, in[3] = {9, 8, z};
      assert_true(zs_eval_point(eval, out) < 0);
      assert_true(zs_eval_point(eval, in) > 0 || z < 0 || z > (k < 3 ? 33 : k < 6 ? 6 : 30));
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* A gap in the numbers is no error when heights say that it should be. */
static void test_gap_with_levels(void **unused)
{
  (void)unused;
  write_disc("gap1.pgm", 8, 8, 4, 255);
  write_disc("gap2.pgm", 8, 8, 4, 255);
  write_disc("gap4.pgm", 8, 8, 4, 255);
  assert_true(value_in("<stack src='gap*.pgm' levels='1 2 4'/>", 8, 8, 3) > 0);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_image),     cmocka_unit_test(test_series),
    cmocka_unit_test(test_levels_and_every), cmocka_unit_test(test_caps),
    cmocka_unit_test(test_labels),    cmocka_unit_test(test_several_labels),
    cmocka_unit_test(test_file_is_read_once),
    cmocka_unit_test(test_tiff),      cmocka_unit_test(test_outlines),
    cmocka_unit_test(test_outline_choices), cmocka_unit_test(test_volume),
    cmocka_unit_test(test_pixels_that_are_not_square),
    cmocka_unit_test(test_correspondence), cmocka_unit_test(test_who_asks),
    cmocka_unit_test(test_least),     cmocka_unit_test(test_bad_input),
    cmocka_unit_test(test_gap_with_levels),
    cmocka_unit_test(test_ends_are_inside), cmocka_unit_test(test_uneven_gaps),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
