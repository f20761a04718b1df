/* Variational nodes, from the text of a scene to values of the field. */
#include "../random.h"
#include "scene_text.h"

#include <math.h>

enum { POINTS = 150 };

static double sphere[POINTS][3]; /* on the unit sphere */

/* ---- Data ---------------------------------------------------------------------- */

/* Numbers with a point, whatever the locale: none is set in this program. */
static void write_sphere(void)
{
  FILE *text = create("sphere.xyz"), *ply = create("sphere.ply"), *obj = create("sphere.obj");
  fprintf(ply, "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\n"
               "property double y\nproperty double z\nproperty double nx\nproperty double ny\n"
               "property double nz\nend_header\n", POINTS);
  for (int i = 0; i < POINTS; i++) {
    const double *p = sphere[i];
    fprintf(text, "%.17g %.17g %.17g  %.17g %.17g %.17g\n", p[0], p[1], p[2], p[0], p[1], p[2]);
    fprintf(ply, "%.17g %.17g %.17g %.17g %.17g %.17g\n", p[0], p[1], p[2], p[0], p[1], p[2]);
    fprintf(obj, "v %.9g %.9g %.9g\nvn %.9g %.9g %.9g\n", p[0], p[1], p[2], p[0], p[1], p[2]);
  }
  for (int i = 1; i + 2 <= POINTS; i += 3)
    fprintf(obj, "f %d//%d %d//%d %d//%d\n", i, i, i + 1, i + 1, i + 2, i + 2);
  assert_int_equal(fclose(text) | fclose(ply) | fclose(obj), 0);
}

/* A spiral from pole to pole. */
static int set_up_sphere(void **state)
{
  if (set_up(state) != 0)
    return -1;
  for (int i = 0; i < POINTS; i++) {
    double z = 1 - (2 * i + 1) / (double)POINTS, r = sqrt(1 - z * z), angle = 2.399963229728653 * i;
    sphere[i][0] = r * cos(angle);
    sphere[i][1] = r * sin(angle);
    sphere[i][2] = z;
  }
  write_sphere();
  return 0;
}

/* ---- What is fitted -------------------------------------------------------------- */

static void is_the_distance_nearby(void **state)
{
  (void)state;
  zs_field *field = compile("<variational><points src='sphere.xyz'/></variational>");
  zs_eval *eval = evaluator(field);
  uint64_t seed = 2;
  for (int i = 0; i < POINTS; i++)
    assert_true(fabs(zs_eval_point(eval, sphere[i])) < 1e-8);
  for (int i = 0; i < 500; i++) {
    const double *p = sphere[i % POINTS];
    const double radius = random_between(&seed, 0.9, 1.1);
    const double x[3] = {radius * p[0], radius * p[1], radius * p[2]};
    assert_true(fabs(zs_eval_point(eval, x) - (1 - radius)) < 0.01);
  }
  zs_fit_info info;
  assert_true(zs_field_fit(field, 0, &info));
  assert_false(zs_field_fit(field, 1, &info));
  assert_int_equal(info.constraints, 3 * POINTS);
  assert_int_equal(info.dimension, 3);
  assert_int_equal(info.line, 2);
  assert_string_equal(info.kernel, "r3");
  assert_true(info.residual < 1e-8);
  double lo[3], hi[3];
  assert_true(zs_field_box(field, lo, hi, NULL));
  for (int k = 0; k < 3; k++) {
    assert_true(lo[k] < -1 && lo[k] > -1.2);
    assert_true(hi[k] > 1 && hi[k] < 1.2);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* The same points through every way in. */
static void all_sources_agree(void **state)
{
  (void)state;
  static char points[POINTS * 200];
  size_t n = (size_t)snprintf(points, sizeof points, "<variational>");
  for (int i = 0; i < POINTS; i++) {
    const double *p = sphere[i];
    n += (size_t)snprintf(points + n, sizeof points - n,
                          "<point at='%.17g %.17g %.17g' normal='%.17g %.17g %.17g'/>", p[0], p[1],
                          p[2], 3 * p[0], 3 * p[1], 3 * p[2]);
  }
  snprintf(points + n, sizeof points - n, "</variational>");
  const char *const scenes[] = {
    points, "<variational><points src='sphere.xyz'/></variational>",
    "<variational kernel='r3' normal-offset='auto' sides='both'><points src='sphere.ply'/>"
    "</variational>",
    "<variational><mesh src='sphere.obj' deviation='none'/></variational>",
    "<variational><points src='sphere.xyz'/><points src='sphere.xyz'/></variational>"};
  double first[50];
  for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
    zs_field *field = compile(scenes[s]);
    zs_eval *eval = evaluator(field);
    uint64_t seed = 6;
    for (int i = 0; i < 50; i++) {
      double x[3];
      for (int k = 0; k < 3; k++)
        x[k] = random_between(&seed, -1.2, 1.2);
      double f = zs_eval_point(eval, x);
      if (s == 0)
        first[i] = f;
      assert_true(fabs(f - first[i]) < 1e-4);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* Values make a solid without normals: an ellipsoid's surface, and its middle. */
static void values_say_where_the_inside_is(void **state)
{
  (void)state;
  FILE *file = create("values.csv");
  fprintf(file, "z,value,x,y\n");
  for (int i = 0; i < POINTS; i++)
    fprintf(file, "%.17g,0,%.17g,%.17g\n", sphere[i][2], 2 * sphere[i][0], sphere[i][1]);
  assert_int_equal(fclose(file), 0);
  zs_field *field = compile("<variational><points src='values.csv'/>\n"
                            "<point at='0 0 0' value='1'/></variational>");
  zs_eval *eval = evaluator(field);
  assert_true(fabs(zs_eval_point(eval, (double[3]){0, 0, 0}) - 1) < 1e-8);
  for (int i = 0; i < POINTS; i++) {
    const double *p = sphere[i];
    assert_true(zs_eval_point(eval, (double[3]){1.8 * p[0], 0.9 * p[1], 0.9 * p[2]}) > 0);
    assert_true(zs_eval_point(eval, (double[3]){2.2 * p[0], 1.1 * p[1], 1.1 * p[2]}) < 0);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* A ball by Gaussians, of a width given and of their own; near its surface as by r3. */
static void gaussians_make_solids(void **state)
{
  (void)state;
  static const char *const scenes[] = {
    "<variational kernel='gaussian' sigma='0.8'><points src='sphere.xyz'/></variational>",
    "<variational kernel='gaussian'><points src='sphere.xyz'/></variational>"};
  for (int s = 0; s < 2; s++) {
    zs_field *field = compile(scenes[s]);
    zs_eval *eval = evaluator(field);
    for (int i = 0; i < POINTS; i++) {
      const double *p = sphere[i];
      assert_true(fabs(zs_eval_point(eval, p)) < 1e-6);
      for (double r = 0.9; r < 1.1; r += 0.03)
        assert_true(fabs(zs_eval_point(eval, (double[3]){r * p[0], r * p[1], r * p[2]}) -
                         (1 - r)) < 0.02);
    }
    zs_fit_info info;
    assert_true(zs_field_fit(field, 0, &info));
    assert_string_equal(info.kernel, "gaussian");
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

static void placement_moves_the_solid(void **state)
{
  (void)state;
  zs_field *field = compile("<variational at='10 20 30' rotate='0 0 90' scale='2'>"
                            "<points src='sphere.xyz'/><point at='1.5 0 0' normal='1 0 0'/>"
                            "</variational>");
  zs_eval *eval = evaluator(field);
  /* The bump on x points along y now, twice as far out. */
  assert_true(fabs(zs_eval_point(eval, (double[3]){10, 23, 30})) < 1e-7);
  for (int i = 0; i < POINTS; i++) {
    const double *p = sphere[i];
    const double x[3] = {10 - 2 * p[1], 20 + 2 * p[0], 30 + 2 * p[2]};
    assert_true(fabs(zs_eval_point(eval, x)) < 1e-7);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* Blocks, gradients and bounds through the public calls. */
static void evaluators_agree(void **state)
{
  (void)state;
  enum { N = 300 };
  zs_field *field = compile("<union><variational at='5 0 0'><points src='sphere.xyz'/>"
                            "</variational><sphere radius='0.5' at='3.6 0 0'/></union>");
  zs_eval *eval = evaluator(field);
  const double origin[3] = {5, 0, 0};
  float x[3][N], f[N], g[4][N];
  uint64_t seed = 8;
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < N; i++)
      x[k][i] = (float)random_between(&seed, -1.4, 1.4);
  zs_eval_values(eval, origin, N, x[0], x[1], x[2], f);
  zs_eval_gradients(eval, origin, N, x[0], x[1], x[2], g[0], g[1], g[2], g[3]);
  for (int i = 0; i < N; i++) {
    const double h = 1e-5;
    double p[3], exact;
    for (int k = 0; k < 3; k++)
      p[k] = origin[k] + (double)x[k][i];
    exact = zs_eval_point(eval, p);
    assert_true(fabs((double)f[i] - exact) < 1e-5);
    assert_true(fabs((double)g[0][i] - exact) < 1e-5);
    for (int k = 0; k < 3; k++) {
      double a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
      a[k] += h;
      b[k] -= h;
      double slope = (zs_eval_point(eval, a) - zs_eval_point(eval, b)) / (2 * h);
      assert_true(fabs((double)g[k + 1][i] - slope) < 1e-2);
    }
    double lo[1][3], hi[1][3];
    float f_lo, f_hi;
    for (int k = 0; k < 3; k++) {
      lo[0][k] = p[k] - 0.02 * (i % 7);
      hi[0][k] = p[k] + 0.03;
    }
    zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
    assert_true(isnan(f_lo) || (f_lo <= f[i] && f[i] <= f_hi));
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* What does not change is not fitted again. */
static void fits_are_remembered(void **state)
{
  (void)state;
  zs_diag diag = {0};
  zs_scene *scene = parse("<param name='turn' value='0'/><param name='mu' value='0'/>\n"
                          "<variational rotate='0 0 {turn}' smoothing='{mu}'>"
                          "<points src='sphere.xyz'/></variational>", &diag);
  assert_non_null(scene);
  double seconds[3];
  for (int i = 0; i < 3; i++) {
    if (i == 1)
      assert_true(zs_scene_set(scene, "turn", 30, &diag));
    if (i == 2)
      assert_true(zs_scene_set(scene, "mu", 0.01, &diag));
    zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
    assert_non_null(field);
    zs_fit_info info;
    assert_true(zs_field_fit(field, 0, &info));
    seconds[i] = info.seconds;
    assert_true(i == 2 ? info.residual > 1e-6 : info.residual < 1e-8);
    zs_field_unref(field);
  }
  assert_true(seconds[0] == seconds[1]);
  assert_true(seconds[0] != seconds[2]);
  zs_scene_free(scene);
}

/* ---- What is refused --------------------------------------------------------------- */

static void write_bad_files(void)
{
  static const struct {
    const char *name, *text;
  } files[] = {
    {"bare.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"},
    {"empty.xyz", "# nothing\n"},
    {"nan.xyz", "0 0 0 0 0 1\n1 0 0 0 nan 1\n"},
    {"tiny.xyz", "1e-100 0 0 1 0 0\n-1e-100 0 0 -1 0 0\n0 1e-100 0 0 1 0\n0 0 1e-100 0 0 1\n"},
    {"huge.xyz", "1e120 0 0 1 0 0\n-1e120 0 0 -1 0 0\n0 1e120 0 0 1 0\n0 0 1e120 0 0 1\n"},
    {"flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"},
  };
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    write_text(files[i].name, files[i].text);
  }
}

static void mistakes_are_explained(void **state)
{
  (void)state;
  static const struct {
    const char *body, *message, *file;
    unsigned line;
    zs_status status;
  } cases[] = {
    {"<sphere/>\n<variational/>", "there are no points", "scene.xml", 3, ZS_ERROR_GEOMETRY},
    {"<variational><points src='bare.xyz'/></variational>", "where the inside is", "scene.xml", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational><points src='empty.xyz'/></variational>", "no points in this file", "empty.xyz",
     0, ZS_ERROR_SYNTAX},
    {"<variational><points src='nan.xyz'/></variational>", "'nan' is not a finite number",
     "nan.xyz", 2, ZS_ERROR_SYNTAX},
    {"<variational><mesh src='flat.obj'/></variational>", "no triangle with an area", "flat.obj", 0,
     ZS_ERROR_GEOMETRY},
    {"<variational><point at='0 0 0' normal='0 0 1'/>\n<point at='0 0 0' value='1'/></variational>",
     "contradict each other: value 0 at (0 0 0), value 1 at (0 0 0)", "scene.xml", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational>\n<point at='0 0 0' normal='0 0 0'/></variational>", "no direction",
     "scene.xml", 3, ZS_ERROR_GEOMETRY},
    {"<variational normal-offset='-1'><points src='sphere.xyz'/></variational>", "", "scene.xml", 2,
     ZS_ERROR_SCHEMA},
    {"<variational normal-offset='automatic'><points src='sphere.xyz'/></variational>", "",
     "scene.xml", 2, ZS_ERROR_SYNTAX},
    {"<variational kernel='cubic'><points src='sphere.xyz'/></variational>", "", "scene.xml", 2,
     ZS_ERROR_SCHEMA},
    {"<variational sigma='0.1'><points src='sphere.xyz'/></variational>", "gaussian",
     "scene.xml", 2, ZS_ERROR_SCHEMA},
    {"<variational kernel='gaussian' sigma='90'><points src='sphere.xyz'/></variational>",
     "for Gaussians of width 90", "scene.xml", 2, ZS_ERROR_UNABLE},
    {"<variational>\n<contour spacing='1e-9' points='0 0, 1 0, 0 1'/></variational>",
     "makes 3414213563 constraints", "scene.xml", 3, ZS_ERROR_UNABLE},
    {"<variational><points src='tiny.xyz'/></variational>", "e-100 across", "scene.xml", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational><points src='huge.xyz'/></variational>", "e+120 across", "scene.xml", 2,
     ZS_ERROR_GEOMETRY},
    {"<variational smoothing='-0.1'><points src='sphere.xyz'/></variational>", "", "scene.xml", 2,
     ZS_ERROR_SCHEMA},
    {"<variational><point normal='0 0 1'/></variational>", "", "scene.xml", 2, ZS_ERROR_SCHEMA},
  };
  write_bad_files();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const seen s = refusal(cases[i].body);
    if (!strstr(s.message, cases[i].message) || !strstr(s.file, cases[i].file) ||
        s.line != cases[i].line || s.status != cases[i].status)
      fail_msg("case %zu: %s:%u: status %d: %s", i, s.file, s.line, (int)s.status, s.message);
  }
}

static void write_cube(bool turned)
{
  static const int faces[6][4] = {{1, 2, 4, 3}, {5, 7, 8, 6}, {1, 5, 6, 2},
                                  {3, 4, 8, 7}, {1, 3, 7, 5}, {2, 6, 8, 4}};
  FILE *file = create("cube.obj");
  for (int i = 0; i < 8; i++)
    fprintf(file, "v %d %d %d\n", i & 1, i >> 1 & 1, i >> 2);
  for (int i = 0; i < 6; i++) {
    const int *f = faces[i];
    if (turned)
      fprintf(file, "f %d %d %d %d\n", f[0], f[1], f[2], f[3]);
    else
      fprintf(file, "f %d %d %d %d\n", f[3], f[2], f[1], f[0]);
  }
  assert_int_equal(fclose(file), 0);
}

/* The largest |f| at points of a cube's faces, which tells how far the surface leaves them. */
static double miss_of_cube(const char *body)
{
  zs_field *field = compile(body);
  zs_eval *eval = evaluator(field);
  uint64_t seed = 4;
  double worst = 0;
  for (int i = 0; i < 300; i++) {
    double p[3];
    for (int k = 0; k < 3; k++)
      p[k] = k == i % 3 ? i / 3 % 2 : random_between(&seed, 0, 1);
    worst = fmax(worst, fabs(zs_eval_point(eval, p)));
  }
  zs_eval_free(eval);
  zs_field_unref(field);
  return worst;
}

/* Between the vertices of a cube there is a ball; samples of its edges and faces make it a cube,
 * the more of them the better. */
static void meshes_are_met_between_vertices(void **state)
{
  (void)state;
  write_cube(false);
  const double ball =
    miss_of_cube("<variational><mesh src='cube.obj' deviation='none'/></variational>");
  const double usual = miss_of_cube("<variational><mesh src='cube.obj'/></variational>");
  const double near =
    miss_of_cube("<variational><mesh src='cube.obj' deviation='0.03'/></variational>");
  const double nearer =
    miss_of_cube("<variational><mesh src='cube.obj' deviation='0.003'/></variational>");
  assert_true(ball > 0.2);
  assert_true(near < 0.1);
  assert_true(nearer < 0.03);
  assert_true(usual < 0.03);
}

/* Both sides of a thin square plate, turned about y. */
static void write_plate(FILE *file, const double middle[3], double half, double thickness,
                        double turn, int side)
{
  for (int i = 0; i < 2 * side * side; i++) {
    const double sign = i % 2 ? -1 : 1, z = sign * thickness;
    const double x = half * ((i / 2 % side + 0.5) * 2 / side - 1);
    const double y = half * ((i / 2 / side + 0.5) * 2 / side - 1);
    fprintf(file, "%.9g %.9g %.9g  %.9g 0 %.9g\n", middle[0] + x * cos(turn) - z * sin(turn),
            middle[1] + y, middle[2] + x * sin(turn) + z * cos(turn), -sign * sin(turn),
            sign * cos(turn));
  }
}

/* What bends least between some plates is positive far from them, too, unless it is told. */
static void no_surface_far_from_the_points(void **state)
{
  (void)state;
  static const double middle[3][3] = {{0, 0, 0}, {2.4, 3.1, 4}, {6, 5, -3}};
  FILE *file = create("plates.xyz");
  write_plate(file, middle[0], 4.3, 0.3, 0.685, 14);
  write_plate(file, middle[1], 1.48, 0.1, 2, 7);
  write_plate(file, middle[2], 1.46, 0.1, 0.562, 5);
  assert_int_equal(fclose(file), 0);
  zs_field *field = compile("<variational><points src='plates.xyz'/></variational>");
  zs_eval *eval = evaluator(field);
  size_t inside = 0;
  for (int i = 0; i < 24 * 24 * 24; i++) {
    const double p[3] = {i % 24 - 9, i / 24 % 24 - 9, i / 24 / 24 - 9};
    bool far = true;
    for (int k = 0; k < 3; k++)
      far = far && hypot(hypot(p[0] - middle[k][0], p[1] - middle[k][1]), p[2] - middle[k][2]) >
                     (k ? 3.5 : 7);
    inside += far && zs_eval_point(eval, p) >= 0;
  }
  assert_int_equal(inside, 0);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* One of two triangles at a vertex is much larger, and the other looks the other way: the
 * vertex's normal is what both agree with most. */
static void normals_face_all_triangles(void **state)
{
  (void)state;
  write_text("fold.obj", "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 -1 0\nv -0.3 0 0.6\nf 1 2 3\nf 1 4 5\n");
  zs_field *field = compile("<variational normal-offset='0.05'>"
                            "<mesh src='fold.obj' deviation='none'/></variational>");
  zs_eval *eval = evaluator(field);
  /* Between 0 0 1 and that of the second triangle, which is -0.6 0 -0.3 by its length. */
  const double second[3] = {-2 / sqrt(5), 0, -1 / sqrt(5)};
  double n[3] = {second[0], 0, second[2] + 1};
  const double length = hypot(n[0], n[2]);
  for (int k = 0; k < 3; k++)
    n[k] *= 0.05 / length;
  assert_true(fabs(zs_eval_point(eval, n) + 0.05) < 2e-3);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* A cube whose triangles are turned the wrong way round is fitted, as what lies
 * around it, with a warning. */
static void inside_out_meshes_are_noticed(void **state)
{
  (void)state;
  for (int turned = 0; turned <= 1; turned++) {
    write_cube(turned);
    seen s = {.message = ""};
    zs_diag diag = {.report = keep, .context = &s};
    zs_scene *scene =
      parse("<variational>\n<mesh src='cube.obj' deviation='none'/></variational>", &diag);
    zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
    assert_non_null(field);
    zs_eval *eval = evaluator(field);
    double middle = zs_eval_point(eval, (double[3]){0.5, 0.5, 0.5});
    assert_int_equal(diag.errors, 0);
    assert_int_equal(diag.warnings, turned);
    assert_true(turned ? middle < 0 : middle > 0);
    if (turned) {
      assert_non_null(strstr(s.message, "inside out"));
      assert_int_equal(s.line, 3);
    }
    zs_eval_free(eval);
    zs_field_unref(field);
    zs_scene_free(scene);
  }
}

/* So are normals that do not agree with each other, or agree to point inwards; good ones are
 * not, of solids with edges and of thin ones. */
static void normals_that_cannot_be_meant_are_noticed(void **state)
{
  (void)state;
  static const struct {
    int every;       /* normal is turned; 0: none */
    double flatness; /* of an ellipsoid */
    const char *message;
  } cases[] = {{0, 1, NULL}, {0, 0.1, NULL}, {20, 1, NULL}, {3, 1, "of 150 normals point against"},
               {1, 1, "point inwards"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const double flat = cases[i].flatness;
    FILE *file = create("turned.xyz");
    for (int j = 0; j < POINTS; j++) {
      const double *p = sphere[j], sign = cases[i].every && j % cases[i].every == 0 ? -1 : 1;
      fprintf(file, "%.17g %.17g %.17g  %.17g %.17g %.17g\n", p[0], p[1], flat * p[2],
              sign * p[0], sign * p[1], sign * p[2] / flat);
    }
    assert_int_equal(fclose(file), 0);
    seen s = {.message = ""};
    zs_diag diag = {.report = keep, .context = &s};
    zs_scene *scene = parse("<variational smoothing='1e-4'>\n<points src='turned.xyz'/>"
                            "</variational>", &diag);
    zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
    assert_non_null(field);
    assert_int_equal(diag.errors, 0);
    if ((diag.warnings > 0) != !!cases[i].message ||
        (cases[i].message && !strstr(s.message, cases[i].message)))
      fail_msg("case %zu: %u warnings, '%s'", i, (unsigned)diag.warnings, s.message);
    if (cases[i].message)
      assert_int_equal(s.line, 3);
    zs_field_unref(field);
    zs_scene_free(scene);
  }
}

/* Smoothing does the same to a solid that stands on its corner. */
static void smoothing_turns_with_the_points(void **state)
{
  (void)state;
  enum { SIDE = 9 };
  const double turn[3][3] = {{0.6, -0.8, 0}, {0.48, 0.36, -0.8}, {0.64, 0.48, 0.6}};
  zs_field *field[2];
  zs_eval *eval[2];
  for (int k = 0; k < 2; k++) {
    uint64_t seed = 8;
    FILE *file = create("bumpy.xyz");
    for (int i = 0; i < 6 * SIDE * SIDE; i++) {
      const int axis = i % 3, cell = i / 6;
      double p[3], n[3] = {0, 0, 0}, to[3][2] = {{0, 0}, {0, 0}, {0, 0}};
      n[axis] = i / 3 % 2 ? 1 : -1;
      p[axis] = n[axis] * random_between(&seed, 0.97, 1.03);
      p[(axis + 1) % 3] = (2.0 * (cell % SIDE) + 1) / SIDE - 1;
      p[(axis + 2) % 3] = (2.0 * (cell / SIDE) + 1) / SIDE - 1;
      for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
          to[r][0] += (k ? turn[r][c] : r == c) * p[c];
          to[r][1] += (k ? turn[r][c] : r == c) * n[c];
        }
      fprintf(file, "%.17g %.17g %.17g  %.17g %.17g %.17g\n", to[0][0], to[1][0], to[2][0],
              to[0][1], to[1][1], to[2][1]);
    }
    assert_int_equal(fclose(file), 0);
    field[k] = compile("<variational smoothing='1e-3'><points src='bumpy.xyz'/></variational>");
    eval[k] = evaluator(field[k]);
  }
  uint64_t seed = 4;
  for (int i = 0; i < 200; i++) {
    double p[3], to[3] = {0, 0, 0};
    for (int c = 0; c < 3; c++)
      p[c] = random_between(&seed, -1.2, 1.2);
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++)
        to[r] += turn[r][c] * p[c];
    assert_true(fabs(zs_eval_point(eval[0], p) - zs_eval_point(eval[1], to)) < 1e-6);
  }
  for (int k = 0; k < 2; k++) {
    zs_eval_free(eval[k]);
    zs_field_unref(field[k]);
  }
}

static void memory_limits_are_kept(void **state)
{
  (void)state;
  zs_control control;
  zs_control_init(&control);
  control.memory_limit = 1000000; /* the matrix alone has 450^2 numbers */
  zs_diag diag = {0};
  zs_scene *scene = parse("<variational><points src='sphere.xyz'/></variational>", &diag);
  assert_non_null(scene);
  assert_null(zs_scene_compile(scene, NULL, &control, &diag));
  assert_int_equal(diag.status, ZS_ERROR_MEMORY);
  zs_scene_free(scene);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(is_the_distance_nearby),
    cmocka_unit_test(all_sources_agree),
    cmocka_unit_test(values_say_where_the_inside_is),
    cmocka_unit_test(gaussians_make_solids),
    cmocka_unit_test(placement_moves_the_solid),
    cmocka_unit_test(evaluators_agree),
    cmocka_unit_test(fits_are_remembered),
    cmocka_unit_test(mistakes_are_explained),
    cmocka_unit_test(meshes_are_met_between_vertices),
    cmocka_unit_test(no_surface_far_from_the_points),
    cmocka_unit_test(normals_face_all_triangles),
    cmocka_unit_test(inside_out_meshes_are_noticed),
    cmocka_unit_test(normals_that_cannot_be_meant_are_noticed),
    cmocka_unit_test(smoothing_turns_with_the_points),
    cmocka_unit_test(memory_limits_are_kept),
  };
  return cmocka_run_group_tests(tests, set_up_sphere, tear_down);
}
