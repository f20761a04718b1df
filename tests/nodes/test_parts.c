/* The parts of <variational>: what each gives the fit, and what is refused. */
#include "../random.h"
#include "scene_text.h"

#include "files/image.h"

#include <math.h>

/* ---- Contours --------------------------------------------------------------------- */

#define SQUARE "0 0 2 0 2 1 0 1"

static double distance_to_rectangle(double x, double y)
{
  const double dx = fabs(x - 1) - 1, dy = fabs(y - 0.5) - 0.5;
  const double out = hypot(fmax(dx, 0), fmax(dy, 0));
  return -(out + fmin(fmax(dx, dy), 0));
}

static double random_on_rectangle(uint64_t *seed, double *x, double *y)
{
  const double s = random_between(seed, 0, 6);
  *x = s < 2 ? s : s < 3 ? 2 : s < 5 ? 5 - s : 0;
  *y = s < 2 ? 0 : s < 3 ? s - 2 : s < 5 ? 1 : 6 - s;
  return s;
}

/* A contour alone is a 2D shape: a polygon, exact at its edges to the last corner. */
static void contours_are_plane_shapes(void **state)
{
  (void)state;
  write_text("square.txt", "# a rectangle\n0 0\n2 0\n2 1\n0 1\n");
  static const char *const scenes[] = {
    "<variational><contour points='" SQUARE "'/></variational>",
    "<variational dimension='2'><contour src='square.txt'/></variational>",
    "<variational><contour src='square.svg'/></variational>"};
  write_text("square.svg", "<svg viewBox='0 0 3 2'><rect y='1' width='2' height='1'/></svg>");
  for (int s = 0; s < 3; s++) {
    zs_field *field = compile(scenes[s]);
    zs_eval *eval = evaluator(field);
    zs_fit_info info;
    assert_true(zs_field_fit(field, 0, &info));
    assert_int_equal(info.dimension, 2);
    assert_string_equal(info.kernel, "tps2");
    uint64_t seed = 1;
    for (int i = 0; i < 1000; i++) {
      double x, y;
      random_on_rectangle(&seed, &x, &y);
      const double z = random_between(&seed, -50, 50);
      assert_true(fabs(zs_eval_point(eval, (double[3]){x, y, z})) < 2e-4);
    }
    for (int i = 0; i < 500; i++) {
      const double x = random_between(&seed, -0.05, 2.05), y = random_between(&seed, -0.05, 1.05);
      const double p[3] = {x, y, i}, d = distance_to_rectangle(x, y);
      if (fabs(d) > 0.01)
        assert_true((zs_eval_point(eval, p) > 0) == (d > 0));
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* The same square in a plane that leans, and a stack of them. */
static void contours_lie_in_any_plane(void **state)
{
  (void)state;
  zs_field *field = compile("<variational><contour points='" SQUARE
                            "' origin='0 0 5' u='1 0 0' v='0 0.6 0.8'/></variational>");
  zs_eval *eval = evaluator(field);
  for (int i = 0; i < 20; i++) {
    const double along = i / 10.0;
    assert_true(fabs(zs_eval_point(eval, (double[3]){along, 0, 5})) < 1e-3);
    assert_true(fabs(zs_eval_point(eval, (double[3]){along, 0.6, 5.8})) < 1e-3);
    assert_true(zs_eval_point(eval, (double[3]){0.1 + 0.9 * along, 0.3, 5.4}) > 0);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
  field = compile("<variational><contour z='-0.5' points='" SQUARE "'/><contour z='0.5' points='"
                  SQUARE "'/></variational>");
  eval = evaluator(field);
  zs_fit_info info;
  assert_true(zs_field_fit(field, 0, &info));
  assert_int_equal(info.dimension, 3);
  assert_true(zs_eval_point(eval, (double[3]){1, 0.5, 0}) > 0);
  for (int i = 0; i <= 10; i++) /* by symmetry the sides bulge, and equally */
    assert_true(fabs(zs_eval_point(eval, (double[3]){0.2 * i, 0, 0.3}) -
                     zs_eval_point(eval, (double[3]){2 - 0.2 * i, 1, -0.3})) < 1e-6);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* Bounds cannot tell where a fit ends; its box can, through what becomes of it. */
static void boxes_follow_shapes(void **state)
{
  (void)state;
#define SHAPE "<variational at='1 0 0'><contour points='" SQUARE "'/></variational>"
  static const struct {
    const char *body;
    double lo[3], hi[3];
  } cases[] = {
    {"<extrude height='4'>" SHAPE "</extrude>", {1, 0, -2}, {3, 1, 2}},
    {"<extrude axis='x' min='5' max='6'>" SHAPE "</extrude>", {5, 1, 0}, {6, 3, 1}},
    {"<extrude height='4' end-scale='2'>" SHAPE "</extrude>", {1, 0, -2}, {6, 2, 2}},
    {"<extrude height='4' twist='180'>" SHAPE "</extrude>", {-3, -1, -2}, {3, 3.17, 2}},
    {"<revolve>" SHAPE "</revolve>", {-3, -3, 0}, {3, 3, 1}},
    {"<revolve axis='y' offset='2'>" SHAPE "</revolve>", {-5, 0, -5}, {5, 1, 5}},
    {"<extrude height='2'><slice z='3'>" SHAPE "</slice></extrude>", {1, 0, -1}, {3, 1, 1}},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    zs_field *field = compile(cases[i].body);
    double lo[3], hi[3];
    assert_true(zs_field_box(field, lo, hi, NULL));
    for (int k = 0; k < 3; k++)
      if (!(lo[k] < cases[i].lo[k] && lo[k] > cases[i].lo[k] - 0.4 && hi[k] > cases[i].hi[k] &&
            hi[k] < cases[i].hi[k] + 0.4))
        fail_msg("case %zu: %g to %g along axis %d", i, lo[k], hi[k], k);
    zs_field_unref(field);
  }
}

/* ---- Pictures --------------------------------------------------------------------- */

enum { SIDE = 32 };

static void write_picture(const char *name, double x, double y, double radius)
{
  zs_image image;
  assert_true(zs_image_allocate(&image, SIDE, SIDE, 1, NULL));
  for (int j = 0; j < SIDE; j++)
    for (int i = 0; i < SIDE; i++)
      image.pixels[j * SIDE + i] = (uint8_t)(
        255 * fmin(1, fmax(0, 0.5 + (radius - hypot(i + 0.5 - x, j + 0.5 - y)) / 3)));
  assert_true(zs_image_write(&image, scratch_path(&folder, name), NULL));
  zs_image_clear(&image);
}

/* A white disc becomes a disc, of any pixel size, from the top or from the bottom. */
static void pictures_become_shapes(void **state)
{
  (void)state;
  write_picture("disc.png", 12, 10, 7);
  for (int down = 0; down <= 1; down++) {
    zs_field *field =
      compile(down ? "<variational><image src='disc.png' pixel='0.1' y='down'/></variational>"
                   : "<variational><image src='disc.png' pixel='0.1'/></variational>");
    zs_eval *eval = evaluator(field);
    const double y = down ? 1.0 : 2.2;
    for (int i = 0; i < 100; i++) {
      const double a = 0.0628 * i;
      for (double r = 0.62; r < 0.8; r += 0.02) {
        const double f = zs_eval_point(eval, (double[3]){1.2 + r * cos(a), y + r * sin(a), 3});
        assert_true(fabs(f - (0.7 - r)) < 0.01);
      }
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* A black picture above and below ends the solid before them. */
static void black_pictures_are_caps(void **state)
{
  (void)state;
  write_picture("disc.png", 16, 16, 9);
  write_picture("black.png", 16, 16, -9);
  zs_field *field = compile(
    "<variational><image src='disc.png' z='-4'/><image src='disc.png' z='0'/>"
    "<image src='disc.png' z='4'/><image src='black.png' z='8'/><image src='black.png' z='-8'/>"
    "</variational>");
  zs_eval *eval = evaluator(field);
  for (int i = 0; i < 32; i++)
    for (int j = 0; j < 32; j++)
      for (int side = -1; side <= 1; side += 2)
        assert_true(zs_eval_point(eval, (double[3]){i + 0.5, j + 0.5, 8 * side}) < 0);
  assert_true(zs_eval_point(eval, (double[3]){16, 16, 0}) > 0);
  assert_true(zs_eval_point(eval, (double[3]){16, 16, 4}) > 0);
  double lo[3], hi[3];
  assert_true(zs_field_box(field, lo, hi, NULL));
  assert_true(lo[2] > -8.5 && hi[2] < 8.5 && lo[2] < -4 && hi[2] > 4);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* ---- Points without normals ------------------------------------------------------- */

static void write_sphere(const char *name, int count)
{
  FILE *file = create(name);
  for (int i = 0; i < count; i++) {
    const double z = 1 - (2 * i + 1) / (double)count, r = sqrt(1 - z * z);
    fprintf(file, "%.17g %.17g %.17g\n", r * cos(2.399963229728653 * i),
            r * sin(2.399963229728653 * i), z);
  }
  assert_int_equal(fclose(file), 0);
}

static void bare_points_get_normals(void **state)
{
  (void)state;
  write_sphere("bare.xyz", 300);
  static const char *const scenes[] = {
    "<variational><points src='bare.xyz'/></variational>",
    "<variational><points src='bare.xyz' normals='estimate'/>"
    "<point at='0 0 0' value='1'/></variational>"};
  for (int s = 0; s < 2; s++) {
    zs_field *field = compile(scenes[s]);
    zs_eval *eval = evaluator(field);
    uint64_t seed = 3;
    for (int i = 0; i < 500; i++) {
      double p[3], r = 0;
      for (int k = 0; k < 3; k++)
        p[k] = random_between(&seed, -1.1, 1.1);
      r = hypot(hypot(p[0], p[1]), p[2]);
      if (r > 0.7 && r < 1.2)
        assert_true(fabs(zs_eval_point(eval, p) - (1 - r)) < 0.05);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
  /* With a value inside they need none, and without any there is no inside. */
  zs_field *field = compile("<variational><points src='bare.xyz'/>"
                            "<point at='0 0 0' value='1'/></variational>");
  zs_fit_info info;
  assert_true(zs_field_fit(field, 0, &info));
  assert_int_equal(info.constraints, 301);
  zs_field_unref(field);
}

/* One point with a normal is a half-space, three are; normals of 0 0 0 are as if there were none. */
static void few_and_empty_normals_do(void **state)
{
  (void)state;
  write_text("one.xyz", "0 0 1  0 0 2\n");
  write_text("three.xyz", "0 0 1  0 0 1\n1 0 1  0 0 1\n0 1 1  0 0 1\n");
  static const char *const scenes[] = {"<variational><points src='one.xyz'/></variational>",
                                       "<variational><points src='three.xyz'/></variational>"};
  for (int s = 0; s < 2; s++)
    for (double z = 0; z < 2; z += 0.3)
      assert_true(fabs(value_in(scenes[s], 0.3, 0.2, z) - (1 - z)) < 1e-6);
  FILE *file = create("zero.xyz");
  for (int i = 0; i < 300; i++) {
    const double z = 1 - (2 * i + 1) / 300.0, r = sqrt(1 - z * z), a = 2.399963229728653 * i;
    fprintf(file, "%.17g %.17g %.17g 0 0 0\n", r * cos(a), r * sin(a), z);
  }
  assert_int_equal(fclose(file), 0);
  assert_true(fabs(value_in("<variational><points src='zero.xyz'/></variational>", 0, 0.9, 0) -
                   0.1) < 0.01);
}

/* The points of a fit are told where they are in the scene. */
static void fitted_points_are_told(void **state)
{
  (void)state;
  write_sphere("bare.xyz", 100);
  zs_field *field = compile("<variational at='10 20 30' rotate='20 30 40' scale='2'>"
                            "<points src='bare.xyz' normals='estimate'/>"
                            "<point at='0 0 0' value='1'/></variational>");
  zs_eval *eval = evaluator(field);
  zs_fit_info info;
  assert_true(zs_field_fit(field, 0, &info));
  assert_int_equal(info.point_count, 100);
  for (size_t i = 0; i < info.point_count; i++)
    assert_true(fabs(zs_eval_point(eval, info.points + 3 * i)) < 1e-6);
  zs_eval_free(eval);
  zs_field_unref(field);
  static const char *const none[] = {
    "<twist rate='10'><variational><points src='bare.xyz'/></variational></twist>",
    "<variational><contour points='" SQUARE "'/></variational>",
    "<variational slice='0'><shape at='0'><points src='bare.xyz'/></shape></variational>"};
  for (int i = 0; i < 3; i++) {
    field = compile(none[i]);
    assert_true(zs_field_fit(field, 0, &info));
    assert_int_equal(info.point_count, 0);
    assert_null(info.points);
    zs_field_unref(field);
  }
}

/* ---- Settings --------------------------------------------------------------------- */

static size_t constraints_of(const char *body)
{
  zs_field *field = compile(body);
  zs_fit_info info;
  assert_true(zs_field_fit(field, 0, &info));
  zs_field_unref(field);
  return info.constraints;
}

static void budgets_and_tolerances_save_constraints(void **state)
{
  (void)state;
  write_sphere("many.xyz", 1500);
  assert_int_equal(constraints_of("<variational><points src='many.xyz'/></variational>"), 4500);
  assert_int_equal(
    constraints_of("<variational budget='300'><points src='many.xyz'/></variational>"), 300);
  const size_t loose =
    constraints_of("<variational tolerance='0.003'><points src='many.xyz'/></variational>");
  assert_true(loose < 1500);
  zs_field *field =
    compile("<variational tolerance='0.003'><points src='many.xyz'/></variational>");
  zs_eval *eval = evaluator(field);
  for (int i = 0; i < 500; i++) {
    const double z = 1 - (2 * i + 1) / 500.0, r = sqrt(1 - z * z), a = 2.4 * i;
    assert_true(fabs(zs_eval_point(eval, (double[3]){r * cos(a), r * sin(a), z})) < 0.006);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* Quadratic polynomials meet quadrics whatever the points, given values. */
static void degrees_are_met_exactly(void **state)
{
  (void)state;
  FILE *file = create("values.xyz");
  uint64_t seed = 9;
  for (int i = 0; i < 60; i++) {
    double p[3];
    for (int k = 0; k < 3; k++)
      p[k] = random_between(&seed, -1, 1);
    fprintf(file, "%.17g %.17g %.17g %.17g\n", p[0], p[1], p[2],
            1 - p[0] * p[0] - 2 * p[1] * p[1] + p[1] * p[2]);
  }
  assert_int_equal(fclose(file), 0);
  const char *const scene = "<variational degree='2'><points src='values.xyz'/></variational>";
  assert_true(fabs(value_in(scene, 3, -2, 1) - (1 - 9 - 8 - 2)) < 1e-6);
  assert_true(fabs(value_in("<variational><points src='values.xyz'/></variational>", 3, -2, 1) +
                   18) > 1);
}

/* ---- What is refused -------------------------------------------------------------- */

static void mistakes_are_explained(void **state)
{
  (void)state;
  static const struct {
    const char *body, *message;
    unsigned line;
    zs_status status;
  } cases[] = {
    {"<variational>\n<contour/></variational>", "neither 'points' nor 'src'", 3, ZS_ERROR_SCHEMA},
    {"<variational>\n<contour points='0 0 1 0 1 1' src='bare.xyz'/></variational>",
     "cannot be combined", 3, ZS_ERROR_SCHEMA},
    {"<variational>\n<contour points='0 0 1 0 1'/></variational>", "even number", 3,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<contour points='0 0 1 0 2 0'/></variational>", "encloses nothing", 3,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<contour points='0 0 1 0 1 0 1 1'/></variational>", "twice in a row", 3,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<contour points='" SQUARE "' u='1 0 0'/></variational>", "'v' is missing", 3,
     ZS_ERROR_SCHEMA},
    {"<variational>\n<contour points='" SQUARE "' u='1 0 0' v='2 0 0'/></variational>", "parallel",
     3, ZS_ERROR_GEOMETRY},
    {"<variational>\n<contour points='" SQUARE "' u='1 0 0' v='0 1 0' z='1'/></variational>",
     "cannot be combined", 3, ZS_ERROR_SCHEMA},
    {"<variational dimension='2'>\n<contour points='" SQUARE "' z='1'/></variational>",
     "lies in space", 3, ZS_ERROR_SCHEMA},
    {"<variational>\n<contour src='shape.svg'/></variational>", "there are no shapes", 1,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<image src='black.png'/></variational>", "the picture is black", 3,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<image src='black.png' z='1'/></variational>", "the picture is black", 3,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<image src='bare.xyz'/></variational>", "not a picture", 0, ZS_ERROR_SYNTAX},
    {"<variational>\n<image src='absent.png'/></variational>", "", 3, ZS_ERROR_IO},
    {"<variational>\n<image src='black.png' level='0'/></variational>", "", 3, ZS_ERROR_SCHEMA},
    {"<variational>\n<points src='one.xyz'/></variational>", "1 points are too few", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<points src='two.xyz'/></variational>", "2 points are too few", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<points src='three.xyz'/></variational>", "3 points are too few", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<points src='close.xyz'/></variational>", "too close together", 2,
     ZS_ERROR_UNABLE},
    {"<variational>\n<mesh src='faceless.obj'/></variational>", "no triangle with an area", 0,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<points src='line.xyz'/></variational>", "on one line", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<points src='same.xyz'/></variational>", "all in one place", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<points src='bare.xyz' normals='none'/></variational>", "where the inside is",
     2, ZS_ERROR_GEOMETRY},
    {"<variational>\n<point at='0 0 0' value='1'/><point at='0 0 1e-10' value='0'/>"
     "<point at='1 0 0'/></variational>", "contradict", 2, ZS_ERROR_GEOMETRY},
    {"<variational budget='2'>\n<points src='bare.xyz'/></variational>", "", 2, ZS_ERROR_SCHEMA},
    {"<variational degree='3'>\n<points src='bare.xyz'/></variational>", "", 2, ZS_ERROR_SCHEMA},
  };
  write_picture("black.png", 16, 16, -9);
  write_sphere("bare.xyz", 100);
  write_text("shape.svg", "<svg/>");
  write_text("one.xyz", "1 2 3\n");
  write_text("two.xyz", "1 2 3\n2 2 3\n");
  write_text("three.xyz", "1 2 3\n2 2 3\n2 3 3\n");
  write_text("close.xyz", "0 0 0 0\n1 0 0 0.5\n0 1 0 0.2\n0 0 1 0.1\n1 1 1 0.7\n"
                          "1 1 1.00000002 0.1\n");
  write_text("faceless.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n");
  FILE *line = create("line.xyz");
  for (int i = 0; i < 20; i++)
    fprintf(line, "%d %d %d\n", i, 2 * i, 3 * i);
  assert_int_equal(fclose(line), 0);
  FILE *same = create("same.xyz");
  for (int i = 0; i < 20; i++)
    fprintf(same, "1 2 3\n");
  assert_int_equal(fclose(same), 0);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const seen s = refusal(cases[i].body);
    if (!strstr(s.message, cases[i].message) || s.line != cases[i].line ||
        s.status != cases[i].status)
      fail_msg("case %zu: %s:%u: status %d: %s", i, s.file, s.line, (int)s.status, s.message);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(contours_are_plane_shapes),
    cmocka_unit_test(contours_lie_in_any_plane),
    cmocka_unit_test(boxes_follow_shapes),
    cmocka_unit_test(pictures_become_shapes),
    cmocka_unit_test(black_pictures_are_caps),
    cmocka_unit_test(bare_points_get_normals),
    cmocka_unit_test(few_and_empty_normals_do),
    cmocka_unit_test(fitted_points_are_told),
    cmocka_unit_test(budgets_and_tolerances_save_constraints),
    cmocka_unit_test(degrees_are_met_exactly),
    cmocka_unit_test(mistakes_are_explained),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
