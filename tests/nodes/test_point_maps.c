/* Maps by points: space-map and fit-points. */
#include "../random.h"
#include "laws.h"
#include "scene_text.h"

#include "nodes/extent.h"

/* A child whose value tells the place. */
#define TELLTALE "<formula>x + 7 * y - 30 * z</formula>"

static double told(double x, double y, double z)
{
  return x + 7 * y - 30 * z;
}

static zs_node *map_of(zs_arena *arena, const char *kernel)
{
  return choose(node_named(arena, "space-map"), "kernel", kernel);
}

static zs_node *add_pair(zs_arena *arena, zs_node *map, const double from[3], const double to[3],
                         double radius)
{
  zs_node *pair = node_of_kind(arena, map->kind->parts[0]);
  set(set_vector(set_vector(pair, "from", from), "to", to), "radius", radius);
  return adopt(arena, map, pair);
}

/* Blocks are the definition in single precision, gradients its differences, and bounds hold
 * what is between. */
static void check_block(zs_eval *eval, uint64_t *state)
{
  const double lo[1][3] = {{-0.2, 0.1, 0.3}}, hi[1][3] = {{0.3, 0.5, 0.6}};
  float least, most;
  zs_eval_bounds(eval, 1, lo, hi, &least, &most);
  assert_true(most - least < 150);
  for (int i = 0; i < 100; i++) {
    const double p[3] = {random_between(state, -0.2, 0.3), random_between(state, 0.1, 0.5),
                         random_between(state, 0.3, 0.6)};
    const float x = (float)p[0], y = (float)p[1], z = (float)p[2];
    const double q[3] = {x, y, z};
    float f, g[3], v;
    double differences[3];
    zs_eval_values(eval, NULL, 1, &x, &y, &z, &v);
    zs_eval_gradients(eval, NULL, 1, &x, &y, &z, &f, &g[0], &g[1], &g[2]);
    const double expected = zs_eval_point(eval, q);
    assert_true(fabs(v - expected) < 2e-4 && fabs(f - expected) < 2e-4);
    assert_true(v >= least && v <= most);
    if (difference_gradient(eval, q, 1e-5, differences))
      for (int k = 0; k < 3; k++)
        assert_true(fabs(g[k] - differences[k]) < 0.05);
  }
}

/* ---- space-map ---------------------------------------------------------------------- */

/* What is at `from` of every pair comes to `to`, in space and in the plane. */
static void plates_carry_points(void **unused)
{
  (void)unused;
  uint64_t state = 15;
  for (int t = 0; t < 6; t++) {
    zs_arena arena = {0}, *A = &arena;
    const bool flat = t % 2;
    double from[12][3], to[12][3];
    zs_node *map = map_of(A, "thin-plate");
    for (int i = 0; i < 12; i++) {
      for (int k = 0; k < 3; k++) {
        from[i][k] = flat && k == 2 ? 0 : random_between(&state, -2, 2);
        to[i][k] = flat && k == 2 ? 0 : from[i][k] + random_between(&state, -0.3, 0.3);
      }
      add_pair(A, map, from[i], to[i], 1);
    }
    zs_node *tell = node_named(A, "formula");
    wrap(A, map, set_formula(A, tell, "formula", "x + 7 * y - 30 * z"));
    zs_eval *eval = compiled(map);
    for (int i = 0; i < 12; i++) {
      const double z = flat ? random_between(&state, -9, 9) : 0;
      const double f = value_at(eval, to[i][0], to[i][1], to[i][2] + z);
      assert_true(fabs(f - told(from[i][0], from[i][1], from[i][2] + z)) < 2e-4);
    }
    check_block(eval, &state);
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

/* A thin plate does not bend where it need not: affine displacements come back everywhere,
 * and one pair is a translation. */
static void plates_bend_least(void **unused)
{
  (void)unused;
  const double moved = value_in("<space-map><pair from='1 0 0' to='1.5 0.25 -1'/>" TELLTALE
                                "</space-map>", 7, -3, 2);
  assert_true(fabs(moved - told(6.5, -3.25, 3)) < 1e-5);
  zs_arena arena = {0}, *A = &arena;
  zs_node *map = map_of(A, "thin-plate");
  uint64_t state = 2;
  for (int i = 0; i < 8; i++) { /* twice as wide, and leaning */
    double from[3], to[3];
    for (int k = 0; k < 3; k++)
      from[k] = random_between(&state, -1, 1);
    to[0] = 2 * from[0] + 1;
    to[1] = from[1] + 0.5 * from[2];
    to[2] = from[2];
    add_pair(A, map, from, to, 1);
  }
  zs_eval *eval = compiled(wrap(A, map, set_formula(A, node_named(A, "formula"), "formula",
                                                    "x + 7 * y - 30 * z")));
  for (int i = 0; i < 100; i++) {
    const double x = random_between(&state, -5, 5), y = random_between(&state, -5, 5);
    const double z = random_between(&state, -5, 5);
    assert_true(fabs(value_at(eval, x, y, z) - told((x - 1) / 2, y - 0.5 * z, z)) < 1e-3);
  }
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

/* The sums of the definition, and no further than their boxes say. */
static void bumps_are_their_sums(void **unused)
{
  (void)unused;
  uint64_t state = 8;
  for (int t = 0; t < 20; t++) {
    zs_arena arena = {0}, *A = &arena;
    const bool cubic = t % 2;
    zs_node *map = map_of(A, cubic ? "cubic-bump" : "exponential-bump");
    double from[3][3], to[3][3], radius[3], all = 0;
    for (int i = 0; i < 3; i++) {
      double way = 0;
      for (int k = 0; k < 3; k++) {
        from[i][k] = random_between(&state, -1, 1);
        to[i][k] = from[i][k] + random_between(&state, -0.3, 0.3);
        way = hypot(way, to[i][k] - from[i][k]);
      }
      radius[i] = random_between(&state, 0.3, 1.5);
      add_pair(A, map, from[i], to[i], radius[i]);
      all += way;
    }
    zs_eval *eval = compiled(wrap(A, map, set_formula(A, node_named(A, "formula"), "formula",
                                                      "x + 7 * y - 30 * z")));
    for (int n = 0; n < 200; n++) {
      double p[3], q[3];
      for (int k = 0; k < 3; k++)
        q[k] = p[k] = random_between(&state, -2, 2);
      for (int i = 0; i < 3; i++) {
        double v = 0;
        for (int k = 0; k < 3; k++)
          v += (p[k] - to[i][k]) * (p[k] - to[i][k]) / (radius[i] * radius[i]);
        const double w = !cubic ? exp(-v) : v < 1 ? pow(1 - v, 3) / (1 + v) : 0;
        for (int k = 0; k < 3; k++)
          q[k] -= w * (to[i][k] - from[i][k]);
      }
      assert_true(fabs(zs_eval_point(eval, p) - told(q[0], q[1], q[2])) < 1e-10);
    }
    check_block(eval, &state);
    const zs_box child = {{-1, -1, -1}, {1, 1, 1}}, box = map->kind->box(map, &child, 1);
    assert_true(fabs(box.hi[1] - (1 + all)) < 1e-12 && fabs(box.lo[2] + 1 + all) < 1e-12);
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
}

/* A bump that folds space over is pointed out, once, and made all the same. */
static void folds_are_pointed_out(void **unused)
{
  (void)unused;
  static const struct {
    const char *kernel, *to;
    unsigned warnings;
  } cases[] = {{"cubic-bump", "0.27 0 0", 0},
               {"cubic-bump", "0.28 0 0", 1},
               {"exponential-bump", "0.58 0 0", 0},
               {"exponential-bump", "0 0 0.59", 1},
               {"thin-plate", "9 0 0", 0}};
  for (size_t i = 0; i < ZS_COUNT_OF(cases); i++) {
    char text[300];
    snprintf(text, sizeof text, "<space-map kernel='%s'><pair from='0 0 0' to='%s' radius='0.5'/>"
             "<sphere/></space-map>", cases[i].kernel, cases[i].to);
    seen s = {.message = ""};
    zs_diag diag = {.report = keep, .context = &s};
    zs_scene *scene = parse(text, &diag);
    assert_non_null(scene);
    assert_int_equal(diag.warnings, cases[i].warnings);
    assert_true(!cases[i].warnings || strstr(s.message, "folds"));
    zs_scene_free(scene);
  }
}

/* ---- fit-points ------------------------------------------------------------------------ */

/* f has its values at the points, from elements and from a file. */
static void fits_meet_points(void **unused)
{
  (void)unused;
  static const char *const kernels[] = {"r", "r3", "r5", "tps2", "gaussian"};
  FILE *file = create("points.txt");
  uint64_t state = 31;
  double points[60][3];
  for (int i = 0; i < 60; i++) {
    double size = 0;
    for (int k = 0; k < 3; k++) {
      points[i][k] = random_between(&state, -1, 1);
      size = hypot(size, points[i][k]);
    }
    for (int k = 0; k < 3; k++) /* a bumpy ball */
      points[i][k] *= (1 + 0.1 * sin(5 * points[i][0])) / size;
    fprintf(file, "%.17g %.17g %.17g\n", points[i][0], points[i][1], points[i][2]);
  }
  assert_int_equal(fclose(file), 0);
  for (size_t n = 0; n < ZS_COUNT_OF(kernels); n++) {
    char text[400];
    snprintf(text, sizeof text, "<fit-points kernel='%s'><points src='points.txt'/><point at='0 0 0'"
             " value='0.5'/><box size='1.6'/></fit-points>", kernels[n]);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (int i = 0; i < 60; i++)
      assert_true(fabs(zs_eval_point(eval, points[i])) < 1e-4);
    assert_true(fabs(zs_eval_point(eval, (double[3]){0, 0, 0}) - 0.5) < 1e-4);
    zs_fit_info info;
    assert_true(zs_field_fit(field, 0, &info));
    assert_string_equal(info.element, "fit-points");
    assert_string_equal(info.kernel, kernels[n]);
    assert_int_equal(info.constraints, 61);
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* Points that the child has right already change nothing. */
static void right_points_change_nothing(void **unused)
{
  (void)unused;
  static const char *const scene =
    "<fit-points><point at='1 0 0'/><point at='-1 0 0'/><point at='0 1 0'/><point at='0 0 1'/>"
    "<point at='0 0 0' value='1'/><sphere/></fit-points>";
  for (int i = 0; i < 20; i++) {
    const double x = -3 + 0.3 * i;
    assert_true(fabs(value_in(scene, x, 0.5, 1) - (1 - hypot(hypot(x, 0.5), 1))) < 1e-9);
  }
}

static void bad_input_is_refused(void **unused)
{
  (void)unused;
  write_text("bad.txt", "0 0 0\n1 2\n");
  refuses("<fit-points><sphere/></fit-points>", "no points");
  refuses("<fit-points><points src='none.txt'/><sphere/></fit-points>", "");
  refuses("<fit-points><points src='bad.txt'/><sphere/></fit-points>", "");
  refuses("<fit-points><point at='0 0 0'/><point at='0 0 0' value='1'/><sphere/></fit-points>",
          "contradict");
  refuses("<space-map><pair from='0 0 1' to='0 0 0'/><pair from='1 0 0' to='0 0 0'/><sphere/>"
          "</space-map>", "contradict");
  /* Where the child has no value there is nothing to correct. */
  assert_true(value_in("<fit-points><point at='-1 0 0'/><formula>sqrt(x)</formula></fit-points>", 4,
                       0, 0) == 2);
  assert_true(value_in("<pinch><point at='-1 0 0'/><formula>sqrt(x)</formula></pinch>", 4, 0, 0) ==
              2);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(plates_carry_points),   cmocka_unit_test(plates_bend_least),
    cmocka_unit_test(bumps_are_their_sums),  cmocka_unit_test(folds_are_pointed_out),
    cmocka_unit_test(fits_meet_points),      cmocka_unit_test(right_points_change_nothing),
    cmocka_unit_test(bad_input_is_refused),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
