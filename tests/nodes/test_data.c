/* <volume>, <sample> and <distance>: fields of data, against what the data is of. */
#define _POSIX_C_SOURCE 200809L /* setenv */
#include "scene_text.h"

#include "../random.h"

#include <math.h>

/* Sample a scene into a file of the folder. */
static void voxelize(const char *body, const char *name, double cell, zs_sample_type type)
{
  static const double lo[3] = {-1.5, -1.25, -1}, hi[3] = {1.5, 1.25, 1.25};
  zs_field *field = compile(body);
  zs_grid grid;
  const double cells[3] = {cell, cell, cell};
  const zs_quantity quantity = type == ZS_SAMPLE_U8 ? ZS_QUANTITY_INSIDE : ZS_QUANTITY_VALUE;
  assert_true(zs_grid_fit_cell(&grid, lo, hi, cells, NULL));
  assert_true(zs_voxelize_file(field, &grid, quantity, type, scratch_path(&folder, name), NULL,
                               NULL, NULL, NULL));
  zs_field_unref(field);
}

static void random_point(uint64_t *state, double p[3])
{
  p[0] = random_between(state, -1.4, 1.4);
  p[1] = random_between(state, -1.1, 1.1);
  p[2] = random_between(state, -0.9, 1.1);
}

/* The largest difference of two scenes where |f| of the first is less than `near`. */
static double difference(const char *a, const char *b, double near)
{
  zs_field *fields[2] = {compile(a), compile(b)};
  zs_eval *evals[2] = {evaluator(fields[0]), evaluator(fields[1])};
  uint64_t state = 7;
  double largest = 0;
  for (int i = 0; i < 4000; i++) {
    double p[3];
    random_point(&state, p);
    const double f = zs_eval_point(evals[0], p), g = zs_eval_point(evals[1], p);
    if (fabs(f) < near)
      largest = fmax(largest, fabs(f - g));
  }
  for (int i = 0; i < 2; i++) {
    zs_eval_free(evals[i]);
    zs_field_unref(fields[i]);
  }
  return largest;
}

#define SOLID "<union><sphere radius='0.8' at='0.2 0.1 0'/><box size='1.8 0.6 0.5'/></union>"
#define SMOOTH "<formula>0.4 - x^2 - 0.8 * y^2 - z^2 + 0.2 * sin(3 * x) * cos(2 * y)</formula>"
#define LINEAR "<formula>0.3 * x - 0.2 * y + 0.7 * z + 0.1</formula>"

/* The same solid comes back, to what is lost between samples, in every format. */
static void test_round_trip(void **unused)
{
  (void)unused;
  static const char *const names[] = {"a.nrrd", "a.mhd", "a.vti", "a.nii.gz"};
  for (int i = 0; i < 4; i++) {
    char body[200];
    voxelize(SOLID, names[i], 0.05, ZS_SAMPLE_F32);
    snprintf(body, sizeof body, "<volume src='%s'/>", names[i]);
    /* At the solid's creases f is off by no more than the way to the next samples. */
    assert_true(difference(SOLID, body, 0.2) < 0.05);
    snprintf(body, sizeof body, "<volume src='%s' sign='negative' outside='extend'/>", names[i]);
    assert_true(difference("<complement>" SOLID "</complement>", body, 0.2) < 0.05);
    voxelize(LINEAR, names[i], 0.05, ZS_SAMPLE_F32);
    snprintf(body, sizeof body, "<volume src='%s' level='0' outside='extend'/>", names[i]);
    assert_true(difference(LINEAR, body, INFINITY) < 2e-6);
  }
}

/* Errors fall with the square of the cell, those of cubic splines with its fourth power. */
static void test_order(void **unused)
{
  (void)unused;
  static const char *const bodies[] = {
    "<volume src='o.nrrd' outside='extend'/>",
    "<volume src='o.nrrd' outside='extend' interpolation='cubic'/>"};
  double errors[2][2];
  for (int h = 0; h < 2; h++) {
    /* Near the ends mirrored splines are no better: look at the middle. */
    voxelize(SMOOTH, "o.nrrd", h ? 0.025 : 0.05, ZS_SAMPLE_F64);
    for (int i = 0; i < 2; i++)
      errors[i][h] = difference(SMOOTH, bodies[i], 0.1);
  }

  assert_true(errors[0][1] < errors[0][0] / 3 && errors[0][1] < 4e-3);
  assert_true(errors[1][1] < errors[1][0] / 10 && errors[1][1] < 2e-5);
}

/* Densities and segmentations: level half way, a label among others. */
static void test_levels(void **unused)
{
  (void)unused;
  voxelize(SOLID, "inside.nrrd", 0.05, ZS_SAMPLE_U8);
  zs_field *solid = compile(SOLID), *again = compile("<volume src='inside.nrrd'/>");
  zs_field *label = compile("<volume src='inside.nrrd' label='1'/>");
  zs_field *other = compile("<volume src='inside.nrrd' label='0'/>");
  zs_eval *a = evaluator(solid), *b = evaluator(again);
  zs_eval *c = evaluator(label), *d = evaluator(other);
  uint64_t state = 3;
  for (int i = 0; i < 3000; i++) {
    double p[3];
    random_point(&state, p);
    const double f = zs_eval_point(a, p), l = zs_eval_point(c, p);
    if (fabs(f) > 0.09) {
      assert_true((f > 0) == (zs_eval_point(b, p) > 0) && (f > 0) == (l > 0));
      assert_true((f > 0) != (zs_eval_point(d, p) > 0));
      assert_true(fabs(l) <= 0.0251); /* half a cell */
    }
  }
  zs_eval *evals[] = {a, b, c, d};
  zs_field *fields[] = {solid, again, label, other};
  for (int i = 0; i < 4; i++) {
    zs_eval_free(evals[i]);
    zs_field_unref(fields[i]);
  }
}

/* 3 x 2 x 2 samples on axes that lean and run backwards. */
static void write_leaning(void)
{
  write_text("lean.nrrd", "NRRD0004\ntype: float\ndimension: 3\nsizes: 3 2 2\nspace dimension: 3\n"
                          "space directions: (0,-2,0) (0,0.5,3) (1,0.25,0)\n"
                          "space origin: (7,8,9)\nencoding: text\n\n"
                          "1 -2 3 -4 5 -6 7 -8 9 -10 11 -12\n");
}

static void test_places(void **unused)
{
  (void)unused;
  write_leaning();
  static const double samples[] = {1, -2, 3, -4, 5, -6, 7, -8, 9, -10, 11, -12};
  for (int cubic = 0; cubic < 2; cubic++) {
    char body[200];
    snprintf(body, sizeof body, "<volume src='lean.nrrd' outside='extend' interpolation='%s'/>",
             cubic ? "cubic" : "linear");
    for (int s = 0; s < 12; s++) {
      const double i = s % 3, j = s / 3 % 2, k = s / 6;
      assert_true(fabs(value_in(body, 7 + k, 8 - 2 * i + 0.5 * j + 0.25 * k, 9 + 3 * j) -
                       samples[s]) < 1e-5);
    }
    /* Beyond, as at the nearest sample. */
    assert_true(fabs(value_in(body, 7, 108, 9) - 1) < 1e-5);
  }
  /* The outer faces are half a voxel beyond the outermost samples. */
  const char *empty = "<volume src='lean.nrrd' level='-100'/>";
  assert_true(value_in(empty, 7, 8 + 0.99, 9) > 0 && value_in(empty, 7, 8 + 1.01, 9) < 0);
  assert_true(value_in(empty, 7 + 1.2, 8.3, 9) > 0 && value_in(empty, 7 - 0.51, 8, 9) < 0);
  assert_true(value_in("<volume src='lean.nrrd' level='-100' outside='extend'/>", 0, 99, 0) > 0);
}

/* One sample, and samples along one axis alone; what is not a number is outside. */
static void test_thin(void **unused)
{
  (void)unused;
  for (int cubic = 0; cubic < 2; cubic++) {
    const char *way = cubic ? "cubic" : "linear";
    char body[200];
    write_text("one.nrrd",
               "NRRD0004\ntype: float\ndimension: 3\nsizes: 1 1 1\nencoding: text\n\n5\n");
    snprintf(body, sizeof body, "<volume src='one.nrrd' level='4' interpolation='%s'/>", way);
    assert_true(fabs(value_in(body, 0, 0, 0) - 0.5) < 1e-6); /* to the faces */
    assert_true(fabs(value_in(body, 0, 2, 0) + 1.5) < 1e-6);
    write_text("line.nrrd", "NRRD0004\ntype: float\ndimension: 3\nsizes: 1 1 3\nspacings: 9 9 1\n"
                            "encoding: text\n\n-1 1 -1\n");
    snprintf(body, sizeof body, "<volume src='line.nrrd' interpolation='%s'/>", way);
    assert_true(fabs(value_in(body, 3, -3, 0) + 1) < 1e-6);
    assert_true(fabs(value_in(body, -3, 3, 1) - 1) < 1e-6);
  }
  const float not_a_number[2] = {NAN, 1};
  FILE *file = create("nan.nrrd");
  fputs("NRRD0004\ntype: float\ndimension: 1\nsizes: 2\nendian: little\nencoding: raw\n\n", file);
  assert_int_equal(fwrite(not_a_number, 4, 2, file), 2);
  fclose(file);
  assert_true(value_in("<volume src='nan.nrrd' level='0'/>", 0, 0, 0) < -1e29);
}

enum { POINTS = 1000 };

/* Blocks against the definition, gradients against differences, bounds against samples, on
 * every instruction set. */
static void check_operation(const char *body, uint64_t *state)
{
  static float x[POINTS], y[POINTS], z[POINTS], f[POINTS], g[4][POINTS];
  zs_field *field = compile(body);
  zs_eval *eval = evaluator(field);
  for (int i = 0; i < POINTS; i++) {
    x[i] = (float)random_between(state, -2, 2);
    y[i] = (float)random_between(state, -2, 2);
    z[i] = (float)random_between(state, -2, 2);
  }
  zs_eval_values(eval, NULL, POINTS, x, y, z, f);
  zs_eval_gradients(eval, NULL, POINTS, x, y, z, g[0], g[1], g[2], g[3]);
  for (int i = 0; i < POINTS; i++) {
    const double p[3] = {(double)x[i], (double)y[i], (double)z[i]}, h = 1e-5;
    const double expected = zs_eval_point(eval, p);
    assert_true(fabs((double)f[i] - expected) < 1e-5 && fabs((double)g[0][i] - expected) < 1e-5);
    for (int k = 0; k < 3; k++) {
      double ahead[3] = {p[0], p[1], p[2]}, behind[3] = {p[0], p[1], p[2]};
      ahead[k] += h;
      behind[k] -= h;
      const double d = (zs_eval_point(eval, ahead) - expected) / h;
      const double e = (expected - zs_eval_point(eval, behind)) / h;
      /* At a kink either side will do. */
      if (fabs(d - e) < 1e-3)
        assert_true(fabs((double)g[k + 1][i] - (d + e) / 2) < 5e-3);
    }
  }
  for (int i = 0; i < 200; i++) {
    double lo[1][3], hi[1][3];
    float f_lo, f_hi;
    for (int k = 0; k < 3; k++) {
      lo[0][k] = random_between(state, -1.7, 1.5);
      hi[0][k] = lo[0][k] + exp(random_between(state, -6, 0.5));
    }
    zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
    assert_true(f_lo <= f_hi);
    for (int j = 0; j < 50; j++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = random_between(state, lo[0][k], hi[0][k]);
      const double value = zs_eval_point(eval, p);
      assert_true(value >= (double)f_lo && value <= (double)f_hi);
    }
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

static void test_operation(void **unused)
{
  (void)unused;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  static const char *const bodies[] = {
    "<volume src='p.nrrd'/>", "<volume src='p.nrrd' interpolation='cubic'/>",
    "<volume src='p.nrrd' outside='extend' rotate='20 30 40' scale='0.8' at='0.1 0 0'/>",
    "<volume src='p.nrrd' outside='extend' interpolation='cubic' rotate='0 0 10'/>",
    "<sample resolution='40'>" SMOOTH "</sample>"};
  uint64_t state = 11;
  voxelize(SMOOTH, "p.nrrd", 0.07, ZS_SAMPLE_F32);
  for (int isa = 0; isa < 3; isa++) {
    setenv("ZEROSET_ISA", isas[isa], 1);
    for (size_t b = 0; b < sizeof bodies / sizeof *bodies; b++)
      check_operation(bodies[b], &state);
  }
  unsetenv("ZEROSET_ISA");
}

/* Bounds of boxes far smaller than the volume are close: nothing is evaluated in vain. */
static void test_close_bounds(void **unused)
{
  (void)unused;
  voxelize(LINEAR, "b.nrrd", 0.03, ZS_SAMPLE_F32);
  zs_field *field = compile("<volume src='b.nrrd' outside='extend'/>");
  zs_eval *eval = evaluator(field);
  uint64_t state = 5;
  for (int i = 0; i < 300; i++) {
    const double side = exp(random_between(&state, -4, -0.5));
    double lo[1][3], hi[1][3];
    float f_lo, f_hi;
    for (int k = 0; k < 3; k++) {
      lo[0][k] = random_between(&state, -1, 1 - side);
      hi[0][k] = lo[0][k] + side;
    }
    zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
    const double exact = 1.2 * side; /* of the linear field */
    assert_true((double)(f_hi - f_lo) < 2.2 * exact + 1.2 * 3 * 0.03);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* ---- <sample> ------------------------------------------------------------------------- */

static void test_sample(void **unused)
{
  (void)unused;
  assert_true(difference(SOLID, "<sample resolution='80'>" SOLID "</sample>", 0.02) < 0.02);
  assert_true(difference(SOLID, "<sample cell='0.02' min='-1.5 -1.2 -1' max='1.5 1.2 1.2'>" SOLID
                                "</sample>", 0.2) < 0.02);
  assert_true(difference(LINEAR, "<sample min='-2 -2 -2' max='2 2 2' outside='extend'>" LINEAR
                                 "</sample>", 1) < 1e-5);
  /* Several children are their union, and the box is found around all of them. */
  assert_true(difference(SOLID, "<sample resolution='80'><sphere radius='0.8' at='0.2 0.1 0'/>"
                                "<box size='1.8 0.6 0.5'/></sample>", 0.02) < 0.02);
}

/* ---- <distance> ----------------------------------------------------------------------- */

/* A box of 4 x 2 x 6, the corner at (10, 0, 0), without its last `missing` triangles. */
static void write_box(const char *name, int missing)
{
  static const char *const faces[] = {"1 3 4", "1 4 2", "5 6 8", "5 8 7", "1 2 6", "1 6 5",
                                      "3 7 8", "3 8 4", "1 5 7", "1 7 3", "2 4 8", "2 8 6"};
  FILE *file = create(name);
  for (int i = 0; i < 8; i++)
    fprintf(file, "v %d %d %d\n", 10 + 4 * (i & 1), 2 * (i >> 1 & 1), 6 * (i >> 2));
  for (int f = 0; f < 12 - missing; f++)
    fprintf(file, "f %s\n", faces[f]);
  fclose(file);
}

static void test_distance(void **unused)
{
  (void)unused;
  uint64_t state = 2;
  zs_field *expected = compile("<box min='10 0 0' max='14 2 6' rotate='0 30 0'/>");
  zs_eval *a = evaluator(expected);
  for (int missing = 0; missing < 3; missing++) {
    write_box("box.obj", missing); /* what is missing is flat: filling it restores the box */
    zs_field *field = compile("<distance src='box.obj' rotate='0 30 0'/>");
    zs_eval *b = evaluator(field);
    for (int i = 0; i < 500; i++) {
      const double p[3] = {random_between(&state, 5, 16), random_between(&state, -3, 4),
                           random_between(&state, -10, 4)};
      assert_true(fabs(zs_eval_point(a, p) - zs_eval_point(b, p)) < 1e-9);
    }
    zs_eval_free(b);
    zs_field_unref(field);
  }
  zs_eval_free(a);
  zs_field_unref(expected);
}

/* ---- What is wrong ---------------------------------------------------------------------- */

static void expect_message(const char *body, zs_status status, const char *part)
{
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  zs_scene *scene = parse(body, &diag);
  zs_field *field = scene ? zs_scene_compile(scene, NULL, NULL, &diag) : NULL;
  assert_true((field == NULL) == (status != ZS_OK));
  assert_int_equal(diag.status, status);
  if (!strstr(s.message, part))
    fail_msg("'%s' is not in: %s", part, s.message);
  zs_field_unref(field);
  zs_scene_free(scene);
}

static void test_mistakes(void **unused)
{
  (void)unused;
  write_leaning();
  write_text("same.nrrd", "NRRD0004\ntype: float\ndimension: 1\nsizes: 2\nencoding: text\n\n3 3\n");
  write_text("short.nrrd", "NRRD0004\ntype: float\ndimension: 1\nsizes: 2\nencoding: text\n\n3\n");
  expect_message("<volume src='none.nrrd'/>", ZS_ERROR_IO, "'none.nrrd' cannot be opened");
  expect_message("<volume src='short.nrrd'/>", ZS_ERROR_SYNTAX, "too short");
  expect_message("<volume src='same.nrrd'/>", ZS_ERROR_GEOMETRY, "all samples are the same, 3");
  expect_message("<volume src='same.nrrd' level='2'/>", ZS_OK,
                 "no surface: the samples are from 3");
  expect_message("<volume src='lean.nrrd' level='99'/>", ZS_OK, "no surface");
  expect_message("<volume src='lean.nrrd' level='1' label='2'/>", ZS_ERROR_SCHEMA,
                 "'label' cannot be combined");
  write_text("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  write_text("inside-out.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 3 1\n"
                               "3 0 2 3\n3 1 3 2\n");
  write_box("open.obj", 1);
  expect_message("<distance src='points.obj'/>", ZS_ERROR_GEOMETRY, "the mesh has no triangles");
  expect_message("<distance src='open.obj'/>", ZS_OK, "not closed: 1 hole, 3 sides");
  expect_message("<distance src='inside-out.off'/>", ZS_OK, "inside out");
  expect_message("<distance src='lean.nrrd'/>", ZS_ERROR_ARGUMENT, "no mesh format");
  expect_message("<sample><half-space/></sample>", ZS_ERROR_GEOMETRY, "expected 'min' and 'max'");
  expect_message("<sample min='0 0 0'><sphere/></sample>", ZS_ERROR_SCHEMA, "'max' is missing");
  expect_message("<sample min='0 0 0' max='1 1 0'><sphere/></sample>", ZS_ERROR_GEOMETRY,
                 "not greater than 'min'");
  expect_message("<sample cell='1e-9'><sphere/></sample>", ZS_ERROR_GEOMETRY, "at most 4096");
}

/* A file that has changed is read again by the same scene. */
static void test_changes(void **unused)
{
  (void)unused;
  zs_diag diag = {0};
  for (int i = 0; i < 2; i++) {
    static zs_scene *scene;
    char text[100];
    snprintf(text, sizeof text, "NRRD0004\ntype: float\ndimension: 1\nsizes: 2\nencoding: text\n\n%s\n",
             i ? "-2 8" : "3 -3");
    write_text("c.nrrd", text);
    if (!i)
      scene = parse("<volume src='c.nrrd' outside='extend'/>", &diag);
    for (int again = 0; again < 2; again++) {
      zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
      zs_eval *eval = evaluator(field);
      assert_true(fabs(zs_eval_point(eval, (const double[3]){0, 0, 0}) - (i ? -2 : 3)) < 1e-6);
      zs_eval_free(eval);
      zs_field_unref(field);
    }
    if (i)
      zs_scene_free(scene);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_round_trip),   cmocka_unit_test(test_order),
    cmocka_unit_test(test_levels),       cmocka_unit_test(test_places),
    cmocka_unit_test(test_thin),         cmocka_unit_test(test_operation),
    cmocka_unit_test(test_close_bounds), cmocka_unit_test(test_sample),
    cmocka_unit_test(test_distance),     cmocka_unit_test(test_mistakes),
    cmocka_unit_test(test_changes)};
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
