/* What set operations, maps and placement must satisfy whatever their operands. */
#include "laws.h"

#include "field/program.h"

/* ---- Set operations ------------------------------------------------------------ */

static zs_node *operand(zs_arena *arena, int which)
{
  const double at[3][3] = {{-0.4, 0, 0.1}, {0.5, 0.3, 0}, {0, -0.5, 0.4}};
  zs_node *node = which == 0   ? node_named(arena, "sphere")
                  : which == 1 ? node_named(arena, "box")
                               : set(node_named(arena, "torus"), "tube", 0.5);
  return place_at(arena, node, at[which], 30 * which, 1);
}

static zs_node *join(zs_arena *arena, const char *name, const char *function, zs_node *a,
                     zs_node *b)
{
  zs_node *node = choose(node_named(arena, name), "r-function", function);
  set(set(node, "alpha", 0.6), "m", 2);
  return adopt(arena, adopt(arena, node, a), b);
}

static zs_node *not(zs_arena *arena, zs_node *a)
{
  return adopt(arena, node_named(arena, "complement"), a);
}

static void check_set_laws(const char *r)
{
  zs_arena arena = {0}, *A = &arena;
  zs_node *a = operand(A, 0), *b = operand(A, 1), *c = operand(A, 2);
  check_law(EQUAL, "union commutes", join(A, "union", r, a, b), join(A, "union", r, b, a));
  check_law(EQUAL, "intersection commutes", join(A, "intersection", r, a, b),
            join(A, "intersection", r, b, a));
  check_law(EQUAL, "not (a or b) = not a and not b", not(A, join(A, "union", r, a, b)),
            join(A, "intersection", r, not(A, a), not(A, b)));
  check_law(EQUAL, "a without b = a and not b", join(A, "difference", r, a, b),
            join(A, "intersection", r, a, not(A, b)));
  check_law(EQUAL, "not not a = a", not(A, not(A, a)), a);
  check_law(EQUAL, "symmetric difference", join(A, "symmetric-difference", r, a, b),
            join(A, "union", r, join(A, "difference", r, a, b), join(A, "difference", r, b, a)));
  check_law(SAME_SIGN, "union associates", join(A, "union", r, join(A, "union", r, a, b), c),
            join(A, "union", r, a, join(A, "union", r, b, c)));
  check_law(SAME_SIGN, "intersection distributes",
            join(A, "intersection", r, a, join(A, "union", r, b, c)),
            join(A, "union", r, join(A, "intersection", r, a, b),
                 join(A, "intersection", r, a, c)));
  check_law(SAME_SIGN, "the solid does not depend on the R-function", join(A, "union", r, a, b),
            join(A, "union", "min-max", a, b));
  zs_node *three = adopt(A, join(A, "difference", r, a, b), c);
  check_law(EQUAL, "a difference takes away from the left", three,
            join(A, "difference", r, join(A, "difference", r, a, b), c));
  check_law(EQUAL, "nothing is neutral in unions",
            join(A, "union", r, a, node_named(A, "empty")), a);
  check_law(EQUAL, "everything is neutral in intersections",
            join(A, "intersection", r, node_named(A, "everything"), a), a);
  check_law(EQUAL, "taking nothing away", join(A, "difference", r, a, node_named(A, "empty")), a);
  zs_arena_free(&arena);
}

static void test_set_laws(void **unused)
{
  (void)unused;
  check_set_laws("min-max");
  check_set_laws("r0");
  check_set_laws("r-alpha");
  check_set_laws("r-m");
}

static void test_blend_laws(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *a = operand(A, 0), *b = operand(A, 1);
  static const char *const profiles[] = {"quadratic", "cubic", "circular", "chamfer",
                                         "exponential"};
  for (size_t i = 0; i < ZS_COUNT_OF(profiles); i++) {
    zs_node *s[3];
    static const char *const names[] = {"smooth-union", "smooth-intersection",
                                        "smooth-difference"};
    for (int k = 0; k < 3; k++) {
      s[k] = set(choose(node_named(A, names[k]), "profile", profiles[i]), "radius", 0.4);
      adopt(A, adopt(A, s[k], k == 1 ? not(A, a) : a), k == 1 ? not(A, b) : b);
    }
    check_law(EQUAL, "smooth De Morgan", not(A, s[0]), s[1]);
    zs_node *d = set(choose(node_named(A, "smooth-intersection"), "profile", profiles[i]), "radius",
                     0.4);
    check_law(EQUAL, "smooth difference", s[2], adopt(A, adopt(A, d, a), not(A, b)));
    zs_node *sharp = choose(node_named(A, "smooth-union"), "profile", profiles[i]);
    set(sharp, "radius", 0);
    check_law(EQUAL, "no radius", adopt(A, adopt(A, sharp, a), b),
              join(A, "union", "min-max", a, b));
  }
  zs_node *blend = set(node_named(A, "blend-union"), "a0", 0);
  check_law(EQUAL, "no displacement", adopt(A, adopt(A, blend, a), b),
            join(A, "union", "r0", a, b));
  zs_arena_free(&arena);
}

/* ---- Maps ------------------------------------------------------------------------ */

static void test_function_maps(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *ball = node_named(A, "sphere");
  check_law(EQUAL, "offset of a ball is a ball",
            wrap(A, set(node_named(A, "offset"), "by", 0.3), ball),
            set(node_named(A, "sphere"), "radius", 1.3));
  check_law(EQUAL, "offset of a torus is a torus",
            wrap(A, set(node_named(A, "offset"), "by", -0.1), node_named(A, "torus")),
            set(node_named(A, "torus"), "tube", 0.15));
  check_law(EQUAL, "offset there and back",
            wrap(A, set(node_named(A, "offset"), "by", 0.3),
                 wrap(A, set(node_named(A, "offset"), "by", -0.3), ball)),
            ball);
  static const char *const sides[] = {"both", "in", "out"};
  static const double outer[] = {0.1, 0, 0.2};
  for (int i = 0; i < 3; i++) {
    zs_node *shell = choose(set(node_named(A, "shell"), "thickness", 0.2), "side", sides[i]);
    check_law(EQUAL, "a shell is a difference of offsets", wrap(A, shell, ball),
              join(A, "difference", "min-max",
                   wrap(A, set(node_named(A, "offset"), "by", outer[i]), ball),
                   wrap(A, set(node_named(A, "offset"), "by", outer[i] - 0.2), ball)));
  }
  check_law(EQUAL, "scaled there and back",
            wrap(A, set(node_named(A, "scale-value"), "by", 4),
                 wrap(A, set(node_named(A, "scale-value"), "by", 0.25), ball)),
            ball);
  check_law(SAME_SIGN, "a scaled value is the same solid",
            wrap(A, set(node_named(A, "scale-value"), "by", 3), ball), ball);
  /* Displaced by a constant: an offset. */
  zs_node *constant = set_formula(A, node_named(A, "formula"), "formula", "0.2");
  check_law(EQUAL, "a constant displacement is an offset",
            adopt(A, adopt(A, node_named(A, "displace"), ball), constant),
            wrap(A, set(node_named(A, "offset"), "by", 0.2), ball));
  zs_arena_free(&arena);
}

static void test_slice(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *box = set3(node_named(A, "box"), "size", 2, 1, 8);
  const double size[2] = {2, 1};
  check_law(EQUAL, "a slice of a box is a rectangle",
            wrap(A, set(node_named(A, "slice"), "z", 0.5), box),
            set_vector(node_named(A, "rectangle"), "size", size));
  check_law(SAME_SIGN, "a slice of a ball is a disc",
            wrap(A, set(node_named(A, "slice"), "z", 0.6), node_named(A, "sphere")),
            set(node_named(A, "circle"), "radius", 0.8));
  zs_arena_free(&arena);
}

static void test_affine_maps(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *solid = set3(set3(node_named(A, "box"), "min", -1, -0.5, -0.2), "max", 1.2, 0.7, 0.9);
  zs_node *there = set3(node_named(A, "translate"), "by", 0.1, 0.2, 0.3);
  zs_node *back = set3(node_named(A, "translate"), "by", -0.1, -0.2, -0.3);
  check_law(EQUAL, "translate", wrap(A, back, wrap(A, there, solid)), solid);
  static const char *const axes[] = {"x", "y", "z"};
  for (int i = 0; i < 3; i++) {
    zs_node *turn = choose(set(node_named(A, "rotate"), "angle", 35), "axis", axes[i]);
    zs_node *turn_back = choose(set(node_named(A, "rotate"), "angle", -35), "axis", axes[i]);
    set3(turn, "about", 0.2, 0.3, 0.4);
    set3(turn_back, "about", 0.2, 0.3, 0.4);
    check_law(EQUAL, "rotate", wrap(A, turn_back, wrap(A, turn, solid)), solid);
  }
  zs_node *grow = set3(set3(node_named(A, "scale"), "by", 2, 2, 2), "about", 0.1, 0.2, 0.3);
  zs_node *shrink = set3(set3(node_named(A, "scale"), "by", 0.5, 0.5, 0.5), "about", 0.1, 0.2, 0.3);
  check_law(EQUAL, "scale", wrap(A, shrink, wrap(A, grow, solid)), solid);
  check_law(EQUAL, "a scaled ball is a ball",
            wrap(A, set3(node_named(A, "scale"), "by", 1.5, 1.5, -1.5), node_named(A, "sphere")),
            set(node_named(A, "sphere"), "radius", 1.5));
  zs_node *mirror = set3(set3(node_named(A, "mirror"), "normal", 1, 2, 3), "point", 0.1, 0, 0);
  zs_node *again = set3(set3(node_named(A, "mirror"), "normal", -2, -4, -6), "point", 0.1, 0, 0);
  check_law(EQUAL, "mirror", wrap(A, again, wrap(A, mirror, solid)), solid);
  zs_arena_free(&arena);
}

/* Which way things go, by a small ball far from the origin. */
static void assert_ball_at(zs_arena *arena, zs_node *outer, double x, double y, double z)
{
  const double at[3] = {1, 2, 3};
  zs_node *ball = place_at(arena, set(node_named(arena, "sphere"), "radius", 0.25), at, 0, 1);
  zs_eval *eval = compiled(wrap(arena, outer, ball));
  assert_true(fabs(value_at(eval, x, y, z) - 0.25) < 1e-12);
  zs_eval_free(eval);
}

static void test_directions(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  assert_ball_at(A, set3(node_named(A, "translate"), "by", 1, 0, -1), 2, 2, 2);
  zs_node *turn = set(node_named(A, "rotate"), "angle", 90);
  assert_ball_at(A, turn, -2, 1, 3);
  turn = set(choose(node_named(A, "rotate"), "axis", "x"), "angle", 90);
  assert_ball_at(A, turn, 1, -3, 2);
  turn = set(choose(node_named(A, "rotate"), "axis", "y"), "angle", -270);
  assert_ball_at(A, turn, 3, 2, -1);
  turn = set3(set(node_named(A, "rotate"), "angle", 180), "about", 1, 0, 0);
  assert_ball_at(A, turn, 1, -2, 3);
  assert_ball_at(A, set3(node_named(A, "mirror"), "normal", 0, 0, 2), 1, 2, -3);
  assert_ball_at(A, set3(set3(node_named(A, "mirror"), "normal", 1, 0, 0), "point", 2, 0, 0), 3, 2,
                 3);
  static const double rigid[] = {0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7};
  assert_ball_at(A, set_numbers(A, node_named(A, "matrix"), "values", rigid, 12), 3, 7, 10);
  /* A twist by 30 degrees per unit has turned by 90 at z = 3, to the left. */
  assert_ball_at(A, set(node_named(A, "twist"), "rate", 30), -2, 1, 3);
  zs_node *between = set(set(set(node_named(A, "twist"), "from", 0), "to", 2), "angle", 90);
  assert_ball_at(A, between, -2, 1, 3);
  between = set(set(set(node_named(A, "twist"), "from", 4), "to", 5), "angle", 90);
  assert_ball_at(A, between, 1, 2, 3);
  zs_node *map = set_formula(A, node_named(A, "map"), "x", "x - 3");
  assert_ball_at(A, map, 4, 2, 3);
  zs_arena_free(&arena);
}

static void test_matrix(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *solid = node_named(A, "torus");
  static const double scale[] = {2, 0, 0, 0.1, 0, 0.5, 0, 0.2, 0, 0, 1.5, 0.3, 0, 0, 0, 1};
  zs_node *matrix = set_numbers(A, node_named(A, "matrix"), "values", scale, 16);
  assert_true(matrix->kind->check(matrix, NULL));
  zs_node *same = set3(node_named(A, "translate"), "by", 0.1, 0.2, 0.3);
  wrap(A, same, wrap(A, set3(node_named(A, "scale"), "by", 2, 0.5, 1.5), solid));
  check_law(EQUAL, "a diagonal matrix scales", wrap(A, matrix, solid), same);
  /* The factor is the least stretch: a shear's is (sqrt(k^2 + 4) - k) / 2. */
  static const double shear[] = {1, 1.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  zs_node *sheared = set_numbers(A, node_named(A, "matrix"), "values", shear, 12);
  zs_eval *eval = compiled(wrap(A, sheared, solid)), *plain = compiled(solid);
  assert_true(fabs(value_at(eval, 1.5, 1, 0) - 0.5 * value_at(plain, 0, 1, 0)) < 1e-12);
  zs_eval_free(eval);
  zs_eval_free(plain);
  /* Refused: the wrong count, a projective row, no inverse. */
  static const double values[][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                      {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1},
                                      {1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0}};
  static const size_t counts[] = {11, 16, 12};
  for (int i = 0; i < 3; i++) {
    zs_node *bad = set_numbers(A, node_named(A, "matrix"), "values", values[i], counts[i]);
    zs_diag diag = {0};
    assert_false(bad->kind->check(bad, &diag));
    assert_int_equal(diag.errors, 1);
  }
  zs_arena_free(&arena);
}

static void test_deformations(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *solid = set3(node_named(A, "box"), "size", 2, 1, 3);
  static const char *const axes[] = {"x", "y", "z"};
  for (int i = 0; i < 3; i++) {
    zs_node *twist = choose(set(node_named(A, "twist"), "rate", 50), "axis", axes[i]);
    zs_node *back = choose(set(node_named(A, "twist"), "rate", -50), "axis", axes[i]);
    check_law(EQUAL, "twist", wrap(A, back, wrap(A, twist, solid)), solid);
    zs_node *taper = choose(set(set(set(set(node_named(A, "taper"), "from", -1), "to", 1), "start",
                                    0.5), "end", 2), "axis", axes[i]);
    zs_eval *eval = compiled(wrap(A, taper, solid)), *plain = compiled(solid);
    double at[3] = {0.2, 0.3, 0.4}, seen[3];
    at[i] = 0;
    for (int k = 0; k < 3; k++)
      seen[k] = k == i ? 0 : at[k] / 1.25;
    assert_true(fabs(zs_eval_point(eval, at) - zs_eval_point(plain, seen)) < 1e-12);
    zs_eval_free(eval);
    zs_eval_free(plain);
  }
  /* Savchenko and Pasko's three classes of mappings, and their order. */
  zs_node *map = set_formula(A, node_named(A, "map"), "x", "x*cos(z/2) + y*sin(z/2)");
  set_formula(A, set_formula(A, map, "y", "-x*sin(z/2) + y*cos(z/2)"), "value", "f - 0.1");
  zs_node *rate = set(node_named(A, "twist"), "rate", 90 / 3.14159265358979323846);
  zs_node *offset = set(node_named(A, "offset"), "by", -0.1);
  check_law(EQUAL, "a combined mapping", wrap(A, map, solid),
            wrap(A, offset, wrap(A, rate, solid)));
  zs_node *rate2 = set(node_named(A, "twist"), "rate", 90 / 3.14159265358979323846);
  zs_node *offset2 = set(node_named(A, "offset"), "by", -0.1);
  check_law(EQUAL, "function and coordinate maps commute", wrap(A, map, solid),
            wrap(A, rate2, wrap(A, offset2, solid)));
  zs_arena_free(&arena);
}

/* ---- Placement and children --------------------------------------------------------- */

static void test_placement(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  const double at[3] = {0.5, -0.2, 0.3};
  zs_node *placed = place_at(A, set3(node_named(A, "box"), "size", 1, 0.5, 0.8), at, 40, 1.5);
  zs_node *plain = set3(node_named(A, "box"), "size", 1, 0.5, 0.8);
  zs_node *nested = set3(node_named(A, "translate"), "by", at[0], at[1], at[2]);
  zs_node *turn = set(node_named(A, "rotate"), "angle", 40);
  zs_node *scale = set3(node_named(A, "scale"), "by", 1.5, 1.5, 1.5);
  wrap(A, nested, wrap(A, turn, wrap(A, scale, plain)));
  check_law(EQUAL, "scale, then rotate, then move", placed, nested);
  /* A placed node places its children. */
  zs_node *ball = node_named(A, "sphere");
  zs_node *outer = place_at(A, wrap(A, set(node_named(A, "offset"), "by", 0.2), ball), at, 0, 1);
  zs_node *direct = place_at(A, set(node_named(A, "sphere"), "radius", 1.2), at, 0, 1);
  check_law(EQUAL, "placement reaches the children", outer, direct);
  zs_arena_free(&arena);
}

static void test_several_children(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *a = operand(A, 0), *b = operand(A, 1);
  zs_node *both = adopt(A, adopt(A, set(node_named(A, "offset"), "by", 0.1), a), b);
  zs_node *joined = adopt(A, set(node_named(A, "offset"), "by", 0.1),
                          join(A, "union", "min-max", a, b));
  check_law(EQUAL, "several children are their union", both, joined);
  zs_arena_free(&arena);
}

/* A shared node is emitted once for the same coordinates: a chain of 60 unions
 * of a node with itself is no longer than its first link, and done at once. */
static void test_sharing(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *node = set3(node_named(A, "box"), "size", 1, 2, 3);
  for (int i = 0; i < 60; i++) {
    zs_node *pair = choose(node_named(A, "union"), "r-function", "r0");
    adopt(A, adopt(A, pair, node), node);
    node = pair;
  }
  zs_eval *eval = compiled(node);
  zs_field_info info;
  zs_field_describe(zs_eval_field(eval), &info);
  assert_true(info.instructions < 100);
  zs_eval_free(eval);
  zs_arena_free(&arena);
}

/* Nesting has a limit, reported once. */
static void test_depth(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  zs_node *node = node_named(A, "sphere");
  for (int i = 0; i < 5000; i++)
    node = adopt(A, node_named(A, "complement"), node);
  zs_diag diag = {0};
  zs_compiler *compiler = zs_compiler_new(NULL, NULL, &diag);
  assert_non_null(compiler);
  zs_coordinates at = zs_coordinates_root();
  zs_node_emit(compiler, node, &at);
  assert_int_equal(diag.errors, 1);
  assert_int_equal(diag.status, ZS_ERROR_UNABLE);
  zs_compiler_free(compiler);
  zs_arena_free(&arena);
}

/* What the attribute table cannot say. */
static void test_checks(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  expect_refused(set3(node_named(A, "box"), "min", 0, 0, 0));
  expect_refused(set3(set3(node_named(A, "box"), "min", 0, 0, 0), "max", 1, 1, 0));
  expect_refused(set3(set3(set3(node_named(A, "box"), "min", 0, 0, 0), "max", 1, 1, 1), "size", 1,
                      1, 1));
  expect_refused(set(set3(node_named(A, "box"), "size", 1, 1, 0.5), "round", 0.3));
  expect_refused(set(set(set(node_named(A, "cone"), "radius", 0), "top-radius", 0), "height", 1));
  expect_refused(set(set(node_named(A, "slab"), "min", 1), "max", 1));
  expect_refused(set3(node_named(A, "half-space"), "normal", 0, 0, 0));
  expect_refused(set3(node_named(A, "mirror"), "normal", 0, 0, 0));
  expect_refused(node_named(A, "extrude"));
  expect_refused(set(node_named(A, "extrude"), "min", 1));
  expect_refused(set(set(set(node_named(A, "extrude"), "min", 1), "max", 2), "height", 1));
  expect_refused(set(set(node_named(A, "extrude"), "min", 2), "max", 1));
  expect_refused(node_named(A, "twist"));
  expect_refused(set(set(node_named(A, "twist"), "from", 0), "to", 1));
  expect_refused(set(set(node_named(A, "twist"), "rate", 1), "angle", 1));
  expect_refused(set(set(set(node_named(A, "twist"), "from", 1), "to", 1), "angle", 1));
  expect_refused(set(set(set(node_named(A, "taper"), "from", 1), "to", 0), "end", 1));
  expect_refused(set(node_named(A, "union"), "alpha", -1));
  expect_refused(set(node_named(A, "union"), "m", 3));
  static const double points[] = {0, 0, 1, 1, 2, 2, 5, 5};
  expect_refused(set_numbers(A, node_named(A, "polygon"), "points", points, 8));
  expect_refused(set_numbers(A, node_named(A, "polygon"), "points", points, 7));
  expect_refused(set_numbers(A, node_named(A, "polygon"), "points", points, 0));
  zs_node *stack = node_named(A, "interpolate");
  expect_refused(stack);
  for (int i = 0; i < 2; i++)
    adopt(A, stack, set(node_of_kind(A, stack->kind->parts[0]), "at", 1));
  expect_refused(stack);
  zs_arena_free(&arena);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_set_laws),     cmocka_unit_test(test_blend_laws),
    cmocka_unit_test(test_function_maps), cmocka_unit_test(test_slice),
    cmocka_unit_test(test_affine_maps),
    cmocka_unit_test(test_directions),   cmocka_unit_test(test_matrix),
    cmocka_unit_test(test_deformations), cmocka_unit_test(test_placement),
    cmocka_unit_test(test_several_children), cmocka_unit_test(test_sharing),
    cmocka_unit_test(test_depth),        cmocka_unit_test(test_checks),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
