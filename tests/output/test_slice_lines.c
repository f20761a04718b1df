/* Cross-sections as SVG files, and what becomes what drawn over them. */
#include "../nodes/scene_text.h"
#include "../random.h"

#include <math.h>
#include <stdlib.h>

static const double LO[3] = {-10, -9, -8}, HI[3] = {10, 9, 8};

static zs_slice_options options_of(int axis, double at, zs_quantity quantity)
{
  zs_slice_options options;
  zs_slice_options_init(&options);
  options.width = 120;
  options.height = 100;
  options.axis = axis;
  options.at = at;
  options.quantity = quantity;
  return options;
}

/* The file of a slice, for free(). */
static char *svg_of(const char *body, const zs_slice_options *options, uint64_t *inside)
{
  char path[400];
  strcpy(path, scratch_path(&folder, "cut.svg"));
  zs_field *field = compile(body);
  assert_true(zs_slice_svg(field, LO, HI, options, path, inside, NULL, NULL, NULL));
  zs_field_unref(field);
  FILE *file = fopen(path, "r");
  assert_non_null(file);
  char *text = calloc(1, 4000000);
  assert_non_null(text);
  assert_true(fread(text, 1, 3999999, file) > 0);
  fclose(file);
  return text;
}

/* x and y of all places of a path, from where its data begin; returns where they end. */
static const char *read_places(const char *data, double (*places)[2], size_t most, size_t *count)
{
  *count = 0;
  while (*data && *data != '"') {
    char *end;
    const double x = strtod(data, &end);
    if (end == data) {
      data++;
      continue;
    }
    assert_true(*count < most);
    places[*count][0] = x;
    places[(*count)++][1] = -strtod(end, &end);
    data = end;
  }
  return data;
}

enum { MOST = 4000 };
static double places[MOST][2];

/* ---- The outline ------------------------------------------------------------------------- */

/* A disc's outline lies on its circle, to what single precision resolves, on any plane: seen
 * along y the picture's right is -x. */
static void test_circle(void **unused)
{
  (void)unused;
  static const char *const axes[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; axis++)
    for (int k = 0; k < 2; k++) {
      char body[300];
      snprintf(body, sizeof body, "<cylinder radius='3.3' height='30' axis='%s' at='1 2 -1.5'/>",
               axes[axis]);
      const zs_slice_options options =
        options_of(axis, 0.5, k ? ZS_QUANTITY_INSIDE : ZS_QUANTITY_VALUE);
      uint64_t inside;
      char *text = svg_of(body, &options, &inside);
      const double x = axis == 0 ? 2 : axis == 1 ? -1 : 1, y = axis == 2 ? 2 : -1.5;
      size_t count;
      read_places(strstr(text, " d=\"") + 4, places, MOST, &count);
      assert_true(count > 60);
      double area = 0;
      for (size_t i = 0; i < count; i++) {
        const double *a = places[i], *b = places[(i + 1) % count];
        if (!(fabs(hypot(a[0] - x, a[1] - y) - 3.3) < 3e-6))
          fail_msg("axis %d: %g %g is off by %g", axis, a[0], a[1],
                   hypot(a[0] - x, a[1] - y) - 3.3);
        area += (a[0] * b[1] - a[1] * b[0]) / 2;
      }
      assert_true(fabs(fabs(area) - 3.14159265 * 3.3 * 3.3) < 0.05);
      assert_true(inside > 0);
      free(text);
    }
}

/* Far from the origin, too, to what a file's numbers resolve. */
static void test_far_circle(void **unused)
{
  (void)unused;
  static const double lo[3] = {1e6 - 2, -2, -1}, hi[3] = {1e6 + 2, 2, 1};
  char path[400];
  strcpy(path, scratch_path(&folder, "cut.svg"));
  const zs_slice_options options = options_of(2, 0, ZS_QUANTITY_VALUE);
  zs_field *field = compile("<sphere radius='1' at='1000000 0 0'/>");
  assert_true(zs_slice_svg(field, lo, hi, &options, path, NULL, NULL, NULL, NULL));
  zs_field_unref(field);
  size_t length, count;
  char *text = read_whole(path, &length);
  assert_non_null(text);
  read_places(strstr(text, " d=\"") + 4, places, MOST, &count);
  assert_true(count > 60);
  for (size_t i = 0; i < count; i++)
    assert_true(fabs(hypot(places[i][0] - 1e6, places[i][1]) - 1) < 2e-3);
  free(text);
}

/* What is written is read back as the same shape, with the lower left corner of the picture,
 * whose pixels are of 0.18, at the origin: with holes, parts, corners, and where the box
 * cuts it off. */
static void test_read_back(void **unused)
{
  (void)unused;
  static const char *const shapes[] = {
    "<difference><rectangle size='12 9' rotate='0 0 20'/><circle radius='2' at='1 1 0'/>"
    "</difference>",
    "<union><circle radius='2' at='-5 3 0'/><circle radius='2.5' at='5 -4 0'/></union>",
    "<difference><half-plane normal='1 2' point='1 0'/><circle radius='3' at='-8 -6 0'/>"
    "</difference>",
    "<formula>sin(x) * cos(y)</formula>"};
  uint64_t state = 2;
  for (int i = 0; i < 4; i++) {
    const zs_slice_options options = options_of(2, 0, ZS_QUANTITY_INSIDE);
    free(svg_of(shapes[i], &options, NULL));
    zs_field *was = compile(shapes[i]), *is = compile("<path src='cut.svg' at='-10.8 -9 0'/>");
    zs_eval *eval[2] = {evaluator(was), evaluator(is)};
    int agree = 0;
    for (int j = 0; j < 3000; j++) {
      const double p[3] = {random_between(&state, LO[0], HI[0]),
                           random_between(&state, LO[1], HI[1]), 0};
      const double f = zs_eval_point(eval[0], p), g = zs_eval_point(eval[1], p);
      if (fabs(f) < 0.1)
        continue; /* corners are cut within a pixel */
      if ((f >= 0) != (g >= 0))
        fail_msg("shape %d at %g %g: %g and %g", i, p[0], p[1], f, g);
      agree++;
    }
    assert_true(agree > 2000);
    for (int k = 0; k < 2; k++)
      zs_eval_free(eval[k]);
    zs_field_unref(was);
    zs_field_unref(is);
  }
}

static void test_nothing_and_everything(void **unused)
{
  (void)unused;
  const zs_slice_options options = options_of(2, 0, ZS_QUANTITY_VALUE);
  uint64_t inside;
  char *text = svg_of("<formula>-1</formula>", &options, &inside);
  assert_null(strstr(text, "fill-rule"));
  assert_int_equal(inside, 0);
  free(text);
  text = svg_of("<everything/>", &options, &inside);
  size_t count;
  read_places(strstr(text, " d=\"") + 4, places, MOST, &count);
  for (size_t i = 0; i < count; i++) /* around the box */
    assert_true(fabs(fabs(places[i][0]) - 10) < 0.2 || fabs(fabs(places[i][1]) - 9) < 0.2);
  free(text);
}

/* ---- What becomes what ---------------------------------------------------------------------- */

#define LEVELS(attributes, between) \
  "<interpolate " attributes "><level at='-2'><circle radius='2' at='-3 1 0'/></level>" between \
  "<level at='3'><circle radius='3' at='4 1 0'/></level><level at='5'><circle/></level>" \
  "</interpolate>"
#define TWO_PAIRS "<between><pair from='-3 1' to='4 1'/><pair points='-3 3 0 6 4 4'/></between>"

static void test_told(void **unused)
{
  (void)unused;
  zs_field *field = compile(LEVELS("axis='x' at='1 2 3' rotate='0 0 90'", TWO_PAIRS));
  zs_correspondence c;
  zs_field_info info;
  zs_field_describe(field, &info);
  assert_int_equal(info.correspondences, 1);
  assert_true(zs_field_correspondence(field, 0, &c));
  assert_false(zs_field_correspondence(field, 1, &c));
  assert_string_equal(c.element, "between");
  assert_true(!c.found && c.count == 2 && c.level[0] == -2 && c.level[1] == 3);
  /* x and y of the shapes are y and z; then everything turns from x to y, and moves. */
  static const double ends[2][2][3] = {{{1 + 3, 2 - 2, 3 + 1}, {1 - 4, 2 + 3, 3 + 1}},
                                       {{1 + 3, 2 - 2, 3 + 3}, {1 - 4, 2 + 3, 3 + 4}}};
  for (size_t i = 0; i < 2; i++)
    for (size_t e = 0; e < 2; e++)
      for (size_t k = 0; k < 3; k++)
        assert_true(fabs(c.ways[3 * (i * c.places + e * (c.places - 1)) + k] - ends[i][e][k]) <
                    1e-12);
  const double middle = c.ways[3 * (c.places + c.places / 2) + 2];
  assert_true(fabs(middle - (3 + 6)) < 1e-12); /* a curve goes through its points */
  assert_true(fabs(c.plane[0][1] - 0) < 1e-12 && fabs(c.plane[1][1] - 5) < 1e-12);
  assert_true(fabs(c.normal[1] - 1) < 1e-12);
  zs_field_unref(field);

  field = compile(LEVELS("", "<between correspondence='auto'/>"));
  assert_true(zs_field_correspondence(field, 0, &c));
  assert_true(c.found && c.count > 3);
  for (size_t i = 0; i < c.count; i++) { /* of discs the points near the outlines */
    const double *from = c.ways + 6 * i, *to = from + 3;
    assert_true(fabs(hypot(from[0] + 3, from[1] - 1) - 2) < 0.5 && from[2] == -2);
    assert_true(fabs(hypot(to[0] - 4, to[1] - 1) - 3) < 0.5 && to[2] == 3);
  }
  zs_field_unref(field);

  /* Inside maps that are not affine they have no place. */
  field = compile("<twist axis='z' rate='2'>" LEVELS("", TWO_PAIRS) "</twist>");
  assert_true(zs_field_correspondence(field, 0, &c));
  assert_true(c.count == 2 && !c.ways);
  zs_field_unref(field);
  field = compile(LEVELS("", ""));
  assert_false(zs_field_correspondence(field, 0, &c));
  zs_field_unref(field);
}

/* The outlines of both levels are in the file, in their colours, and the arrow from the one to
 * the other; above the gap nothing is. */
static void test_drawn(void **unused)
{
  (void)unused;
  zs_slice_options options = options_of(2, 0.5, ZS_QUANTITY_INSIDE);
  options.correspondence = true;
  char *text = svg_of(LEVELS("", TWO_PAIRS), &options, NULL);
  static const char *const colors[] = {"stroke=\"#006b4d\"", "stroke=\"#731a94\""};
  static const double circles[2][3] = {{-3, 1, 2}, {4, 1, 3}};
  for (int k = 0; k < 2; k++) {
    const char *at = strstr(text, colors[k]);
    assert_non_null(at);
    size_t count;
    read_places(strstr(at, " d=\"") + 4, places, MOST, &count);
    assert_true(count > 30);
    for (size_t i = 0; i < count; i++) {
      const double off =
        hypot(places[i][0] - circles[k][0], places[i][1] - circles[k][1]) - circles[k][2];
      assert_true(fabs(off) < 1e-3);
    }
  }
  const char *arrow = strstr(text, "stroke=\"#121217\"");
  assert_non_null(arrow);
  size_t count;
  read_places(strstr(arrow, " d=\"") + 4, places, MOST, &count);
  assert_true(count >= 2);
  assert_true(fabs(places[0][0] + 3) < 1e-5 && fabs(places[0][1] - 1) < 1e-5);
  assert_true(fabs(places[count - 1][0] - 4) < 1e-5 && fabs(places[count - 1][1] - 1) < 1e-5);
  free(text);
  options.at = 4;
  text = svg_of(LEVELS("", TWO_PAIRS), &options, NULL);
  assert_null(strstr(text, "stroke="));
  free(text);
  /* Seen from the side arrows rise from level to level, and no outline is there. */
  options = options_of(1, 1, ZS_QUANTITY_INSIDE);
  options.correspondence = true;
  text = svg_of(LEVELS("", TWO_PAIRS), &options, NULL);
  assert_null(strstr(text, colors[0]));
  read_places(strstr(strstr(text, "stroke=\"#121217\""), " d=\"") + 4, places, MOST, &count);
  assert_true(fabs(places[0][0] - 3) < 1e-5 && fabs(places[0][1] + 2) < 1e-5); /* right is -x */
  assert_true(fabs(places[count - 1][0] + 4) < 1e-5 && fabs(places[count - 1][1] - 3) < 1e-5);
  free(text);
}

/* On pixels: dark along the arrow, and as without where nothing is drawn. */
static void test_painted(void **unused)
{
  (void)unused;
  zs_slice_options options = options_of(2, 0.5, ZS_QUANTITY_VALUE);
  zs_field *field = compile(LEVELS("", TWO_PAIRS));
  zs_image image[2];
  for (int k = 0; k < 2; k++) {
    options.correspondence = k;
    assert_true(zs_slice(field, LO, HI, &options, &image[k], NULL, NULL, NULL, NULL));
  }
  const double pixel = 0.18; /* 18 over 100 rows */
  size_t changed = 0;
  for (uint32_t row = 0; row < 100; row++)
    for (uint32_t column = 0; column < 120; column++) {
      const uint8_t *a = image[0].pixels + 3 * (row * 120 + column);
      const uint8_t *b = image[1].pixels + 3 * (row * 120 + column);
      const double x = (column - 59.5) * pixel, y = (49.5 - row) * pixel;
      const bool differs = memcmp(a, b, 3) != 0;
      changed += differs;
      if (fabs(y - 1) < pixel / 2 && x > -2.5 && x < 2.5)
        assert_true(b[0] < 100 && b[1] < 100 && b[2] < 100);
      if (y < -3 || x < -6 || x > 8)
        assert_false(differs);
    }
  assert_true(changed > 200 && changed < 3000);
  for (int k = 0; k < 2; k++)
    zs_image_clear(&image[k]);
  zs_field_unref(field);
}

static void test_refused(void **unused)
{
  (void)unused;
  zs_field *field = compile(LEVELS("", TWO_PAIRS));
  zs_slice_options options = options_of(2, 0.5, ZS_QUANTITY_INSIDE);
  zs_image image;
  zs_diag diag = {0};
  options.correspondence = true;
  assert_false(zs_slice(field, LO, HI, &options, &image, NULL, NULL, NULL, &diag));
  assert_int_equal(diag.errors, 1);
  char path[500];
  snprintf(path, sizeof path, "%s/none/cut.svg", folder.folder);
  assert_false(zs_slice_svg(field, LO, HI, &options, path, NULL, NULL, NULL, &diag));
  assert_int_equal(diag.errors, 2);
  options.at = 11;
  strcpy(path, scratch_path(&folder, "never.svg"));
  assert_false(zs_slice_svg(field, LO, HI, &options, path, NULL, NULL, NULL, &diag));
  options.at = 0;
  zs_control control;
  zs_control_init(&control);
  control.memory_limit = 1000;
  assert_false(zs_slice_svg(field, LO, HI, &options, path, NULL, &control, NULL, &diag));
  assert_int_equal(diag.errors, 4);
  FILE *file = fopen(path, "r");
  assert_null(file);
  zs_field_unref(field);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_circle), cmocka_unit_test(test_far_circle),
    cmocka_unit_test(test_read_back),
    cmocka_unit_test(test_nothing_and_everything), cmocka_unit_test(test_told),
    cmocka_unit_test(test_drawn), cmocka_unit_test(test_painted), cmocka_unit_test(test_refused),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
