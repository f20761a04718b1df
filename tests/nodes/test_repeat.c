/* repeat-grid and repeat-polar: space folded for copies of a solid. */
#include "../random.h"
#include "random_nodes.h"
#include "scene_text.h"

#include "nodes/extent.h"

static const double PI = 3.14159265358979323846;

/* ---- The same, spelled out ------------------------------------------------------- */

static zs_node *moved(zs_arena *arena, zs_node *child, double x, double y, double z)
{
  return adopt(arena, set3(node_named(arena, "translate"), "by", x, y, z), child);
}

/* The union of copies `lo` to `hi` along the axes. */
static zs_node *spelled_grid(zs_arena *arena, zs_node *child, const double spacing[3],
                             const int lo[3], const int hi[3], const double by[3])
{
  zs_node *all = node_named(arena, "union");
  for (int i = lo[0]; i <= hi[0]; i++)
    for (int j = lo[1]; j <= hi[1]; j++)
      for (int k = lo[2]; k <= hi[2]; k++)
        adopt(arena, all, moved(arena, child, by[0] + i * spacing[0], by[1] + j * spacing[1],
                                by[2] + k * spacing[2]));
  return all;
}

static zs_node *spelled_ring(zs_arena *arena, zs_node *child, const char *axis, double angle,
                             int count)
{
  zs_node *all = node_named(arena, "union");
  for (int i = 0; i < count; i++) {
    zs_node *turn = choose(set(node_named(arena, "rotate"), "angle", i * angle), "axis", axis);
    adopt(arena, all, adopt(arena, turn, child));
  }
  return all;
}

typedef struct seen_signs {
  int inside, outside;
} seen_signs;

/* Signs are the same; values too where `exact`, as for exact distances outside; blocks are
 * the definition. */
static void check_same(const char *what, const zs_node *folded, const zs_node *spelled,
                       const double reach[3], bool exact, seen_signs *signs, uint64_t *state)
{
  enum { COUNT = 400 };
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  setenv("ZEROSET_ISA", isas[random_below(state, 3)], 1);
  zs_eval *a = compiled(folded), *b = compiled(spelled);
  float x[COUNT], y[COUNT], z[COUNT], f[COUNT];
  for (int i = 0; i < COUNT; i++) {
    x[i] = (float)random_between(state, -reach[0], reach[0]);
    y[i] = (float)random_between(state, -reach[1], reach[1]);
    z[i] = (float)random_between(state, -reach[2], reach[2]);
  }
  zs_eval_values(a, NULL, COUNT, x, y, z, f);
  for (int i = 0; i < COUNT; i++) {
    const double p = value_at(a, x[i], y[i], z[i]), q = value_at(b, x[i], y[i], z[i]);
    const double tolerance = 1e-9 * (1 + fabs(q));
    if (((p >= 0) != (q >= 0) && fabs(p - q) > tolerance) || p > q + tolerance)
      fail_msg("%s at %g %g %g: folded %.12g, spelled out %.12g", what, x[i], y[i], z[i], p, q);
    if (exact && fabs(p - q) > tolerance)
      fail_msg("%s at %g %g %g: distance %.12g, spelled out %.12g", what, x[i], y[i], z[i], p, q);
    if (!(fabs(f[i] - p) <= 2e-5 * (1 + fabs(p))))
      fail_msg("%s at %g %g %g: block %.9g, reference %.12g (%s)", what, x[i], y[i], z[i], f[i], p,
               zs_isa());
    signs->inside += q >= 0;
    signs->outside += q < 0;
  }
  zs_eval_free(a);
  zs_eval_free(b);
  unsetenv("ZEROSET_ISA");
}

/* A child that is not symmetric: an exact distance, or a field that is none. */
static zs_node *lopsided(zs_arena *arena, bool exact, uint64_t *state)
{
  const double at[3] = {random_between(state, -1, 1), random_between(state, -1, 1),
                        random_between(state, -0.5, 0.5)};
  zs_node *solid;
  if (exact) {
    solid = set(node_named(arena, "capsule"), "radius", random_between(state, 0.1, 0.4));
    set3(set3(solid, "from", 0, 0, 0), "to", random_between(state, -1, 1),
         random_between(state, -1, 1), random_between(state, -0.5, 0.5));
  } else {
    solid = adopt(arena, set_formula(arena, node_named(arena, "map"), "value", "f * (2 + sin(3 * x) - 0.8 * sin(2 * y))"),
                  set3(node_named(arena, "box"), "size", 1.4, 0.5, 0.3));
  }
  return place_at(arena, solid, at, random_between(state, -180, 180), 1);
}

static void grids_are_unions(void **unused)
{
  (void)unused;
  uint64_t state = 5;
  seen_signs signs = {0};
  int folded = 0;
  for (int t = 0; t < 150; t++) {
    zs_arena arena = {0}, *A = &arena;
    const bool exact = t % 3 != 2;
    zs_node *child = lopsided(A, exact, &state);
    double spacing[3], count[3], by[3];
    int lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};
    const bool middle = random_below(&state, 2);
    for (int k = 0; k < 3; k++) {
      spacing[k] = random_below(&state, 4) ? random_between(&state, k == 2 ? 0.8 : 0.5, 2.5) : 0;
      count[k] = spacing[k] > 0 ? (double)random_below(&state, 8) : 1;
      const bool endless = count[k] == 0;
      lo[k] = endless ? -9 : 0;
      hi[k] = endless ? 9 : (int)count[k] - 1;
      by[k] = middle && !endless ? -(count[k] - 1) / 2 * spacing[k] : 0;
      folded += endless || count[k] > 5;
    }
    zs_node *grid = set_vector(set_vector(node_named(A, "repeat-grid"), "spacing", spacing),
                               "count", count);
    choose(grid, "anchor", middle ? "middle" : "first");
    assert_true(grid->kind->check(grid, NULL));
    check_same("grid", adopt(A, grid, child), spelled_grid(A, child, spacing, lo, hi, by),
               (const double[3]){2.5, 2.5, 2.5}, exact && t % 2, &signs, &state);
    zs_arena_free(&arena);
  }
  assert_true(folded > 40 && signs.inside > 1000 && signs.outside > 1000);
}

static void rings_are_unions(void **unused)
{
  (void)unused;
  static const char *const axes[] = {"x", "y", "z"};
  uint64_t state = 6;
  seen_signs signs = {0};
  for (int t = 0; t < 240; t++) {
    zs_arena arena = {0}, *A = &arena;
    const bool exact = t % 3 != 2;
    const int axis = t % 3, count = 1 + (int)random_below(&state, 24);
    double at[3] = {0, 0, 0};
    const double away = random_between(&state, 0, 4), from = random_between(&state, -PI, PI);
    at[(axis + 1) % 3] = away * cos(from);
    at[(axis + 2) % 3] = away * sin(from);
    zs_node *child = moved(A, lopsided(A, exact, &state), at[0], at[1], at[2]);
    zs_node *ring = choose(set(node_named(A, "repeat-polar"), "count", count), "axis", axes[axis]);
    double angle = 360.0 / count;
    if (random_below(&state, 2)) {
      angle = random_between(&state, -500.0 / count, 500.0 / count);
      if (random_below(&state, 2))
        angle = random_between(&state, 4, 250.0 / count);
      set(ring, "angle", angle);
    }
    /* Inside of overlapping copies too the deepest copy is one of those that hold the point. */
    double reach[3] = {5, 5, 5};
    reach[axis] = 1;
    check_same("ring", adopt(A, ring, child), spelled_ring(A, child, axes[axis], angle, count),
               reach, exact, &signs, &state);
    zs_arena_free(&arena);
  }
  assert_true(signs.inside > 500 && signs.outside > 1000);
}

/* ---- Continuity ------------------------------------------------------------------ */

/* Along lines no step is larger than the child's slope allows, also where what is near and
 * what is far away have values that contradict. */
static void values_are_continuous(void **unused)
{
  (void)unused;
  static const char *const scenes[] = {
    "<repeat-grid spacing='1 0 0'>%s</repeat-grid>",
    "<repeat-grid spacing='1.1 0.7 1.3' count='0 9 30'>%s</repeat-grid>",
    "<repeat-polar count='17'><translate by='3 0 0'>%s</translate></repeat-polar>",
    "<repeat-polar count='17' axis='x' angle='-9'><translate by='0 3 1'>%s</translate>"
    "</repeat-polar>"};
  /* Values that rise away from the solid on one side. */
  static const char *const child =
    "<intersection><box size='0.9'/><map value='f - 0.02 + 0.6 * abs(x - 0.1 * y)'>"
    "<sphere radius='0.3'/></map></intersection>";
  static const char *const rising =
    "<map value='f &gt; -0.2 ? f : min(-0.2, f + 3 * (x + y + 0.8 + f))'><box size='0.6 0.5 0.4'/>"
    "</map>";
  uint64_t state = 8;
  for (size_t n = 0; n < 2 * ZS_COUNT_OF(scenes); n++) {
    char text[1000];
    snprintf(text, sizeof text, scenes[n / 2], n % 2 ? rising : child);
    zs_field *field = compile(text);
    zs_eval *eval = evaluator(field);
    for (int line = 0; line < 30; line++) {
      double p[3], way[3];
      for (int k = 0; k < 3; k++) {
        p[k] = random_between(&state, -4, 4);
        way[k] = random_between(&state, -1, 1);
      }
      double before = zs_eval_point(eval, p);
      const double step = 1e-6;
      /* Find steps by halving: between two points of a line that are far apart in value. */
      for (int i = 0; i < 400; i++) {
        double q[3], lo[3], hi[3];
        for (int k = 0; k < 3; k++)
          q[k] = p[k] + 0.01 * way[k];
        const double after = zs_eval_point(eval, q);
        double f_lo = before, f_hi = after;
        memcpy(lo, p, sizeof lo);
        memcpy(hi, q, sizeof hi);
        while (fabs(hi[0] - lo[0]) + fabs(hi[1] - lo[1]) + fabs(hi[2] - lo[2]) > step) {
          double m[3];
          for (int k = 0; k < 3; k++)
            m[k] = (lo[k] + hi[k]) / 2;
          const double f = zs_eval_point(eval, m);
          const bool lower = fabs(f - f_lo) > fabs(f_hi - f);
          memcpy(lower ? hi : lo, m, sizeof m);
          *(lower ? &f_hi : &f_lo) = f;
        }
        if (fabs(f_hi - f_lo) > 1e-3)
          fail_msg("scene %zu steps from %g to %g at %g %g %g", n, f_lo, f_hi, lo[0], lo[1], lo[2]);
        before = after;
        memcpy(p, q, sizeof p);
      }
    }
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* ---- Cost ------------------------------------------------------------------------- */

static size_t operations(const char *text)
{
  zs_field *field = compile(text);
  zs_field_info info;
  zs_field_describe(field, &info);
  zs_field_unref(field);
  return info.instructions;
}

/* As many operations for a million copies as for ten. */
static void cost_is_that_of_a_few(void **unused)
{
  (void)unused;
  assert_int_equal(operations("<repeat-grid spacing='1' count='10'><sphere radius='0.4'/>"
                              "</repeat-grid>"),
                   operations("<repeat-grid spacing='1' count='1000000'><sphere radius='0.4'/>"
                              "</repeat-grid>"));
  assert_true(operations("<repeat-grid spacing='1' count='1000000'><sphere radius='0.4'/>"
                         "</repeat-grid>") < 60);
  assert_int_equal(operations("<repeat-polar count='10'><sphere at='5 0 0'/></repeat-polar>"),
                   operations("<repeat-polar count='10'><sphere at='5 0 0'/></repeat-polar>"));
  assert_true(operations("<repeat-polar count='5000'><sphere radius='0.1' at='100 0 0'/>"
                         "</repeat-polar>") < 60);
}

/* ---- Where it is -------------------------------------------------------------------- */

static bool box_of(const char *text, double lo[3], double hi[3])
{
  zs_field *field = compile(text);
  zs_diag quiet = {0};
  const bool found = zs_field_box(field, lo, hi, &quiet);
  zs_field_unref(field);
  return found;
}

static void boxes_are_found(void **unused)
{
  (void)unused;
  static const struct {
    const char *text;
    double lo[3], hi[3];
  } cases[] = {
    {"<repeat-grid spacing='3' count='20 7 1'><sphere/></repeat-grid>", {-1, -1, -1}, {58, 19, 1}},
    {"<repeat-grid spacing='3' count='20 6 2' anchor='middle'><sphere/></repeat-grid>",
     {-29.5, -8.5, -2.5}, {29.5, 8.5, 2.5}},
    {"<repeat-polar count='40'><sphere at='20 0 0'/></repeat-polar>", {-21, -21, -1}, {21, 21, 1}},
    {"<repeat-polar count='12'><box size='20 1 2' at='10 0 0'/></repeat-polar>",
     {-20.03, -20.03, -1}, {20.03, 20.03, 1}},
    {"<repeat-polar count='10' angle='10' axis='x'><sphere at='0 20 0'/></repeat-polar>",
     {-1, -1, -1}, {1, 21, 21}},
    {"<intersection><box size='10'/><repeat-grid spacing='3 3 0'><cylinder radius='1'/>"
     "</repeat-grid></intersection>", {-5, -5, -5}, {5, 5, 5}},
    {"<extrude height='2'><repeat-grid spacing='10 10 0' count='9 9 0'><circle radius='4'/>"
     "</repeat-grid></extrude>", {-4, -4, -1}, {84, 84, 1}},
    {"<repeat-grid spacing='20' count='5 5 0'><union><repeat-polar count='30'>"
     "<sphere radius='0.3' at='5 0 0'/></repeat-polar><empty/></union></repeat-grid>", {0}, {0}},
    {"<repeat-grid spacing='2'><sphere radius='0.5'/></repeat-grid>", {0}, {0}},
    {"<repeat-grid spacing='2 0 0'><sphere radius='0.5'/></repeat-grid>", {0}, {0}},
  };
  for (size_t n = 0; n < ZS_COUNT_OF(cases); n++) {
    double lo[3], hi[3];
    const bool found = box_of(cases[n].text, lo, hi), expected = cases[n].lo[2] < 0;
    if (found != expected)
      fail_msg("%s: found %d", cases[n].text, found);
    for (int k = 0; k < 3 && found; k++) {
      const double slack = 0.08 * fmax(cases[n].hi[0] - cases[n].lo[0],
                                       cases[n].hi[1] - cases[n].lo[1]) + 0.2;
      if (lo[k] > cases[n].lo[k] || lo[k] < cases[n].lo[k] - slack || hi[k] < cases[n].hi[k] ||
          hi[k] > cases[n].hi[k] + slack)
        fail_msg("%s: %g .. %g along %d", cases[n].text, lo[k], hi[k], k);
    }
  }
}

/* Far copies are as exact as the first, relative to an origin that is near. */
static void far_copies_are_exact(void **unused)
{
  (void)unused;
  zs_field *field =
    compile("<repeat-grid spacing='0.1 0 0' count='1000000 1 1'><sphere radius='0.04'/></repeat-grid>");
  zs_eval *eval = evaluator(field);
  const double origin[3] = {54321, 0, 0};
  for (int i = 0; i < 50; i++) {
    const float x = 0.01f * (float)i, y = 0.01f, z = 0;
    float f;
    zs_eval_values(eval, origin, 1, &x, &y, &z, &f);
    const double away = remainder((double)x, 0.1);
    assert_true(fabs(f - (0.04 - hypot(away, 0.01))) < 1e-6);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* ---- Bad input ------------------------------------------------------------------------- */

static void bad_input_is_refused(void **unused)
{
  (void)unused;
  refuses("<repeat-grid><sphere/></repeat-grid>", "missing");
  refuses("<repeat-grid spacing='-1 1 1'><sphere/></repeat-grid>", "-1");
  refuses("<repeat-grid spacing='1 nan 1'><sphere/></repeat-grid>", "nan");
  refuses("<repeat-grid spacing='3' count='2.5'><sphere/></repeat-grid>", "2.5 is not a whole");
  refuses("<repeat-grid spacing='3' count='1000001'><sphere/></repeat-grid>", "1000001 is not");
  refuses("<repeat-grid spacing='3' count='1e300'><sphere/></repeat-grid>", "1e+300 is not");
  refuses("<repeat-grid spacing='3' count='-2'><sphere/></repeat-grid>", "-2");
  refuses("<repeat-grid spacing='3 0 0' count='2 3 1'><sphere/></repeat-grid>", "along y");
  refuses("<repeat-grid spacing='3' anchor='last'><sphere/></repeat-grid>", "last");
  refuses("<repeat-grid spacing='3'></repeat-grid>", "");
  refuses("<repeat-grid spacing='3'><cylinder/></repeat-grid>", "along z");
  refuses("<repeat-grid spacing='1 1 0'><half-space normal='1 0 0'/></repeat-grid>", "along x");
  refuses("<repeat-grid spacing='1 0 0'><everything/></repeat-grid>", "along x");
  refuses("<repeat-grid spacing='0.001'><sphere/></repeat-grid>", "come together");
  refuses("<repeat-grid spacing='1e-300'><sphere/></repeat-grid>", "along");
  refuses("<repeat-grid spacing='1 0 0' count='5000 1 1'><half-space normal='0 0 1'/>"
          "</repeat-grid>", "come together");
  refuses("<repeat-grid spacing='0.2'><repeat-grid spacing='0.2' count='10'>"
          "<repeat-grid spacing='0.2' count='10'><sphere/></repeat-grid></repeat-grid>"
          "</repeat-grid>", "");
  refuses("<repeat-polar><sphere/></repeat-polar>", "missing");
  refuses("<repeat-polar count='0'><sphere/></repeat-polar>", "0");
  refuses("<repeat-polar count='5000'><sphere/></repeat-polar>", "come together");
  refuses("<repeat-polar count='3' axis='w'><sphere/></repeat-polar>", "w");
}

/* What is nothing stays nothing, and one copy is the child. */
static void trivial_cases(void **unused)
{
  (void)unused;
  assert_true(value_in("<repeat-grid spacing='3'><empty/></repeat-grid>", 1, 2, 3) < 0);
  assert_true(value_in("<repeat-polar count='9'><empty/></repeat-polar>", 1, 2, 3) < 0);
  assert_true(value_in("<repeat-grid spacing='0'><cylinder/></repeat-grid>", 3, 0, 9) == -2);
  assert_true(value_in("<repeat-grid spacing='2' count='1'><cylinder/></repeat-grid>", 3, 0, 9) == -2);
  assert_true(value_in("<repeat-polar count='1'><sphere at='1 0 0'/></repeat-polar>", 4, 0, 0) == -2);
  assert_true(value_in("<repeat-polar count='9' angle='0'><sphere at='1 0 0'/></repeat-polar>", 4, 0,
                       0) == -2);
  /* Several children are their union, and places are applied after. */
  assert_true(fabs(value_in("<repeat-grid spacing='10 0 0' at='0 5 0'><sphere/><sphere at='4 0 0'/>"
                            "</repeat-grid>", 34, 5, 0) - 1) < 1e-12);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(grids_are_unions),     cmocka_unit_test(rings_are_unions),
    cmocka_unit_test(values_are_continuous), cmocka_unit_test(cost_is_that_of_a_few),
    cmocka_unit_test(boxes_are_found),      cmocka_unit_test(far_copies_are_exact),
    cmocka_unit_test(bad_input_is_refused), cmocka_unit_test(trivial_cases),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
