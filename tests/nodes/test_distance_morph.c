/* distance-morph: keyframes, rigid copies, anchors on their ways, what does not matter. */
#include "../random.h"
#include "laws.h"
#include "scene_text.h"

#include "nodes/extent.h"
#include "rbf/rigid.h"

#include <stdio.h>

/* ---- Morphs built by hand --------------------------------------------------------------- */

enum { MOST = 12 };
static const char *const radials[] = {"cubic", "thin-plate", "gaussian"};

static zs_node *formula(zs_arena *arena, const char *text)
{
  return set_formula(arena, node_named(arena, "formula"), "formula", text);
}

static zs_node *morph_at(zs_arena *arena, double time, const char *radial, bool rigid)
{
  zs_node *morph = choose(set(node_named(arena, "distance-morph"), "time", time), "radial", radial);
  *(bool *)field_of(morph, attribute_named(morph->kind, "rigid")) = rigid;
  return morph;
}

static zs_node *add_shape(zs_arena *arena, zs_node *morph, double at, zs_node *child)
{
  zs_node *shape = set(node_of_kind(arena, morph->kind->parts[0]), "at", at);
  return adopt(arena, morph, adopt(arena, shape, child));
}

static zs_node *add_pair(zs_arena *arena, zs_node *morph, const double *from, const double *to,
                         size_t shapes)
{
  zs_node *pair = set_vector(node_of_kind(arena, morph->kind->parts[1]), "from", from);
  return adopt(arena, morph, set_numbers(arena, pair, "to", to, 3 * (shapes - 1)));
}

static void apply(const double m[12], const double x[3], double y[3])
{
  for (int i = 0; i < 3; i++)
    y[i] = m[4 * i] * x[0] + m[4 * i + 1] * x[1] + m[4 * i + 2] * x[2] + m[4 * i + 3];
}

/* ---- Keyframes ------------------------------------------------------------------------------ */

#define KEYFRAMES(time) \
  "<distance-morph time='" time "'><shape at='-1'><box/></shape><shape at='0.5'><sphere/></shape>" \
  "<shape at='4'><torus radius='2' tube='0.5'/></shape>" \
  "<pair from='0.5 0.5 0.5' to='1 0 0  2.5 0 0'/><pair from='-0.5 0.5 0.5' to='0 1 0  0 2 0.5'/>" \
  "<pair from='0 0 -0.5' to='0 0 -1  -2 0 0.5'/></distance-morph>"

/* At its time, and before the first and after the last, the morph is the shape itself; and times
 * near to it give nearly the shape. */
static void keyframes_are_met(void **unused)
{
  (void)unused;
  static const struct {
    const char *morph, *shape;
    double off;
  } cases[] = {{KEYFRAMES("-1"), "<box/>", 0},
               {KEYFRAMES("-77"), "<box/>", 0},
               {KEYFRAMES("0.5"), "<sphere/>", 0},
               {KEYFRAMES("{1/2}"), "<sphere/>", 0},
               {KEYFRAMES("4"), "<torus radius='2' tube='0.5'/>", 0},
               {KEYFRAMES("1e9"), "<torus radius='2' tube='0.5'/>", 0},
               {KEYFRAMES("-0.999999"), "<box/>", 1e-5},
               {KEYFRAMES("0.499999"), "<sphere/>", 1e-5},
               {KEYFRAMES("0.500001"), "<sphere/>", 1e-5},
               {KEYFRAMES("3.999999"), "<torus radius='2' tube='0.5'/>", 1e-5}};
  for (size_t i = 0; i < ZS_COUNT_OF(cases); i++) {
    uint64_t state = 4;
    zs_field *a = compile(cases[i].morph), *b = compile(cases[i].shape);
    zs_eval *p = evaluator(a), *q = evaluator(b);
    for (int n = 0; n < 200; n++) {
      double x[3];
      for (int k = 0; k < 3; k++)
        x[k] = random_between(&state, -3, 3);
      assert_true(fabs(zs_eval_point(p, x) - zs_eval_point(q, x)) <= cases[i].off);
    }
    zs_eval_free(p);
    zs_eval_free(q);
    zs_field_unref(a);
    zs_field_unref(b);
  }
}

/* Parameters move the time; a scene compiles again and again. */
static void time_is_a_parameter(void **unused)
{
  (void)unused;
  seen s = {.message = ""};
  zs_diag diag = {.report = keep, .context = &s};
  zs_scene *scene = parse("<param name='t' value='0'/>" KEYFRAMES("{5*t - 1}"), &diag);
  assert_non_null(scene);
  double before = INFINITY;
  for (int i = 0; i <= 10; i++) {
    assert_true(zs_scene_set(scene, "t", i / 10.0, &diag));
    zs_field *field = zs_scene_compile(scene, NULL, NULL, &diag);
    zs_eval *eval = evaluator(field);
    const double f = zs_eval_point(eval, (const double[3]){2, 0.1, 0});
    assert_true(f != before);
    before = f;
    zs_eval_free(eval);
    zs_field_unref(field);
  }
  zs_scene_free(scene);
}

/* Without pairs, or with pairs that stay, f is interpolated linearly, between other times than 0
 * and 1 too; by the definition of any field. */
static void no_pairs_are_linear(void **unused)
{
  (void)unused;
  zs_arena arena = {0}, *A = &arena;
  const double points[4][3] = {{0, 0, 0}, {1, 0, 0.5}, {0, 1, 0}, {0.2, 0.3, 1}};
  for (int pairs = 0; pairs <= 4; pairs++) {
    zs_node *morph = morph_at(A, 2.3, radials[pairs % 3], pairs % 2);
    add_shape(A, morph, 2, formula(A, "1 - x^2 - y^2 - z^2"));
    add_shape(A, morph, 3, formula(A, "0.7 - abs(x) - 2 * y"));
    for (int i = 0; i < pairs; i++)
      add_pair(A, morph, points[i], points[i], 2);
    check_law(EQUAL, "linear", morph,
              formula(A, "0.7 * (1 - x^2 - y^2 - z^2) + 0.3 * (0.7 - abs(x) - 2 * y)"));
  }
  zs_arena_free(&arena);
}

/* ---- Rigid copies ------------------------------------------------------------------------------ */

/* A body that has no symmetry, and its copy, moved by `inverse`'s inverse. */
static zs_node *body(zs_arena *arena, const double *inverse)
{
  zs_node *all = node_named(arena, "union");
  adopt(arena, all, set3(node_named(arena, "box"), "size", 1, 0.6, 0.4));
  zs_node *knob = set(node_named(arena, "sphere"), "radius", 0.35);
  adopt(arena, all, place_at(arena, knob, (const double[3]){0.5, 0.3, 0.1}, 0, 1));
  if (inverse) {
    double *m = ZS_ARENA_NEW(arena, double, 12);
    memcpy(m, inverse, 12 * sizeof *m);
    all->placement = m;
  }
  return all;
}

/* A body that becomes its own moved copy is a moved copy all the time: f is the body's at the
 * place that the part of the motion, found here by other means, leads back to. */
static void copies_stay_congruent(void **unused)
{
  (void)unused;
  uint64_t state = 12;
  for (int t = 0; t < 40; t++) {
    zs_arena arena = {0}, *A = &arena;
    zs_rigid motion = {.axis = {random_between(&state, -1, 1), random_between(&state, -1, 1), 0.4},
                       .angle = random_between(&state, 0.1, 3)};
    const size_t count = 3 + random_below(&state, 8);
    double from[MOST][3], to[MOST][3], whole[12], back[12], part[12];
    double size = hypot(hypot(motion.axis[0], motion.axis[1]), motion.axis[2]);
    for (int k = 0; k < 3; k++) {
      motion.axis[k] /= size;
      motion.to[k] = random_between(&state, -3, 3);
      motion.from[k] = 0;
      for (size_t i = 0; i < count; i++) {
        from[i][k] = random_between(&state, -1, 1);
        motion.from[k] += from[i][k] / (double)count;
      }
    }
    const double time = random_between(&state, 0.05, 0.95);
    zs_rigid_at(&motion, 1, whole, back);
    zs_rigid_at(&motion, time, NULL, part);
    zs_node *morph = morph_at(A, time, radials[t % 3], true);
    add_shape(A, morph, 0, body(A, NULL));
    add_shape(A, morph, 1, body(A, back));
    for (size_t i = 0; i < count; i++) {
      apply(whole, from[i], to[i]);
      add_pair(A, morph, from[i], to[i], 2);
    }
    zs_eval *moving = compiled(morph), *still = compiled(body(A, NULL));
    for (int n = 0; n < 100; n++) {
      double x[3], y[3];
      for (int k = 0; k < 3; k++)
        x[k] = random_between(&state, -4, 4);
      apply(part, x, y);
      assert_true(fabs(zs_eval_point(moving, x) - zs_eval_point(still, y)) < 1e-9);
    }
    /* Its box is that of a body which turns: it holds the body, and is not endless. */
    const zs_box box = morph->kind->box(morph, NULL, 0);
    assert_true(zs_box_is_finite(&box));
    for (int n = 0; n < 300; n++) {
      double x[3];
      for (int k = 0; k < 3; k++)
        x[k] = random_between(&state, -4, 4);
      if (zs_eval_point(moving, x) >= 0)
        for (int k = 0; k < 3; k++)
          assert_true(x[k] >= box.lo[k] && x[k] <= box.hi[k]);
    }
    zs_eval_free(moving);
    zs_eval_free(still);
    zs_arena_free(&arena);
  }
}

/* One pair moves everything along; two turn it no more than needed; pairs on a line and in a
 * plane, and pairs that are given twice, do not squeeze it. */
static void few_pairs_move_bodies(void **unused)
{
  (void)unused;
  static const double p[5][3] = {{1, 0, 0.1}, {-1, 0, 0.1}, {0.5, 0, 0.1}, {0, 1, 0.1}, {1, 0, 0.1}};
  for (int count = 1; count <= 5; count++) {
    zs_arena arena = {0}, *A = &arena;
    /* A quarter turn about z and a move; what one pair knows of it is the move. */
    const double back[12] = {0, 1, 0, -3, -1, 0, 0, 2, 0, 0, 1, -1};
    double whole[12], from[3];
    zs_node *morph = morph_at(A, 0.5, radials[count % 3], true);
    add_shape(A, morph, 0, body(A, NULL));
    const double moved[12] = {1, 0, 0, -1, 0, 1, 0, -4, 0, 0, 1, -1};
    add_shape(A, morph, 1, body(A, count > 1 ? back : moved));
    for (int i = 0; i < count; i++) {
      const double to[3] = {2 - p[i][1], 3 + p[i][0], 1 + p[i][2]};
      add_pair(A, morph, p[i], to, 2);
    }
    zs_rigid motion = {.axis = {0, 0, 1}, .angle = count > 1 ? 1.5707963267948966 : 0};
    for (int k = 0; k < 3; k++) {
      motion.from[k] = 0;
      for (int i = 0; i < count; i++)
        motion.from[k] += p[i][k] / count;
    }
    const double *middle = motion.from;
    motion.to[0] = 2 - middle[1], motion.to[1] = 3 + middle[0], motion.to[2] = 1 + middle[2];
    zs_rigid_at(&motion, 0.5, whole, NULL);
    zs_eval *moving = compiled(morph), *still = compiled(body(A, NULL));
    uint64_t state = 2;
    for (int n = 0; n < 100; n++) {
      double x[3];
      for (int k = 0; k < 3; k++)
        from[k] = random_between(&state, -2, 2);
      apply(whole, from, x);
      assert_true(fabs(zs_eval_point(moving, x) - zs_eval_point(still, from)) < 1e-9);
    }
    zs_eval_free(moving);
    zs_eval_free(still);
    zs_arena_free(&arena);
  }
}

/* ---- Anchors ------------------------------------------------------------------------------------ */

/* What is at each anchor comes from where the pair says, in both shapes: with one of them 0
 * everywhere, f is the other's share.  And points between anchors cost no more than the test of
 * kinds allows. */
static void anchors_keep_to_their_ways(void **unused)
{
  (void)unused;
  uint64_t state = 5;
  for (int t = 0; t < 12; t++) {
    zs_arena arena = {0}, *A = &arena;
    const bool flat = t % 4 == 3, rigid = t % 2;
    const size_t count = 1 + random_below(&state, MOST);
    const double time = random_between(&state, 0.02, 0.98);
    double from[MOST][3], to[MOST][3];
    zs_node *morphs[2];
    for (int side = 0; side < 2; side++) {
      morphs[side] = morph_at(A, time, radials[t % 3], rigid);
      add_shape(A, morphs[side], 0, formula(A, side ? "0 * x" : "x + 7 * y - 30 * z"));
      add_shape(A, morphs[side], 1, formula(A, side ? "x + 7 * y - 30 * z" : "0 * x"));
    }
    for (size_t i = 0; i < count; i++) {
      for (int k = 0; k < 3; k++) {
        from[i][k] = flat && k == 2 ? 0 : random_between(&state, -2, 2);
        to[i][k] = flat && k == 2 ? 0 : 0.5 * k + from[i][k] + random_between(&state, -0.3, 0.3);
      }
      for (int side = 0; side < 2; side++)
        add_pair(A, morphs[side], from[i], to[i], 2);
    }
    zs_rigid motion = zs_rigid_identity();
    double part[12], back[12];
    if (rigid)
      assert_true(zs_rigid_fit(flat ? 2 : 3, *from, *to, count, &motion));
    zs_rigid_at(&motion, time, part, NULL);
    zs_rigid_at(&motion, 1, NULL, back);
    zs_eval *first = compiled(morphs[0]), *second = compiled(morphs[1]);
    for (size_t i = 0; i < count; i++) {
      double end[3], middle[3], m[3];
      apply(back, to[i], end);
      for (int k = 0; k < 3; k++)
        middle[k] = (1 - time) * from[i][k] + time * end[k];
      apply(part, middle, m);
      const double *p = from[i], *q = to[i];
      const double f = p[0] + 7 * p[1] - 30 * p[2], g = q[0] + 7 * q[1] - 30 * q[2];
      assert_true(fabs(zs_eval_point(first, m) - (1 - time) * f) < 3e-4);
      assert_true(fabs(zs_eval_point(second, m) - time * g) < 3e-4);
      if (!rigid)
        for (int k = 0; k < 3; k++)
          assert_true(fabs(m[k] - ((1 - time) * p[k] + time * q[k])) < 1e-12);
    }
    zs_eval_free(first);
    zs_eval_free(second);
    zs_arena_free(&arena);
  }
}

/* Neither which shape is the first nor where the origin is changes anything, where the anchors
 * span space and a Gaussian's reach is given: what is chosen is chosen for a box of theirs. */
static void origin_and_order_do_not_matter(void **unused)
{
  (void)unused;
  uint64_t state = 23;
  for (int t = 0; t < 6; t++) {
    zs_arena arena = {0}, *A = &arena;
    const double time = random_between(&state, 0.1, 0.9), off[3] = {40, -70, 20};
    const size_t count = 4 + random_below(&state, MOST - 3);
    zs_node *one = morph_at(A, time, radials[t % 3], true);
    zs_node *turned = morph_at(A, 1 - time, radials[t % 3], true);
    zs_node *away = morph_at(A, time, radials[t % 3], true);
    set(one, "sigma", 1.5), set(turned, "sigma", 1.5), set(away, "sigma", 1.5);
    zs_node *shapes[4] = {body(A, NULL), node_named(A, "torus"), body(A, NULL),
                          node_named(A, "torus")};
    place_at(A, shapes[2], off, 0, 1);
    place_at(A, shapes[3], off, 0, 1);
    add_shape(A, add_shape(A, one, 0, shapes[0]), 1, shapes[1]);
    add_shape(A, add_shape(A, turned, 0, shapes[1]), 1, shapes[0]);
    add_shape(A, add_shape(A, away, 0, shapes[2]), 1, shapes[3]);
    for (size_t i = 0; i < count; i++) {
      double from[2][3], to[2][3];
      for (int k = 0; k < 3; k++) {
        from[0][k] = random_between(&state, -1, 1);
        to[0][k] = from[0][(k + 1) % 3] + random_between(&state, -0.2, 0.2); /* a third of a turn */
        from[1][k] = from[0][k] + off[k];
        to[1][k] = to[0][k] + off[k];
      }
      add_pair(A, one, from[0], to[0], 2);
      add_pair(A, turned, to[0], from[0], 2);
      add_pair(A, away, from[1], to[1], 2);
    }
    zs_eval *f = compiled(one), *g = compiled(turned), *h = compiled(away);
    for (int n = 0; n < 100; n++) {
      double x[3], y[3];
      for (int k = 0; k < 3; k++) {
        x[k] = random_between(&state, -1.5, 1.5);
        y[k] = x[k] + off[k];
      }
      const double value = zs_eval_point(f, x), size = 1 + fabs(value);
      assert_true(fabs(zs_eval_point(g, x) - value) < 2e-5 * size);
      assert_true(fabs(zs_eval_point(h, y) - value) < 2e-5 * size);
    }
    zs_eval_free(f);
    zs_eval_free(g);
    zs_eval_free(h);
    zs_arena_free(&arena);
  }
}

/* ---- What is wrong -------------------------------------------------------------------------------- */

#define TWO "<shape at='0'><sphere/></shape><shape at='1'><box/></shape>"
#define MORPH(inside) "<distance-morph time='0.5'>" inside "</distance-morph>"

static void bad_input_is_refused(void **unused)
{
  (void)unused;
  static const struct {
    const char *scene, *message;
  } cases[] = {
    {"<distance-morph>" TWO "</distance-morph>", "missing; expected a number"},
    {"<distance-morph time='soon'>" TWO "</distance-morph>", "soon"},
    {"<distance-morph time='{1/0}'>" TWO "</distance-morph>", ""},
    {"<distance-morph time='0.5' radial='quintic'>" TWO "</distance-morph>", "quintic"},
    {"<distance-morph time='0.5' radial='gaussian' sigma='-1'>" TWO "</distance-morph>", "-1"},
    {"<distance-morph time='0.5' rigid='maybe'>" TWO "</distance-morph>", "maybe"},
    {MORPH(""), "found 0 of at least 2 shapes"},
    {MORPH("<shape at='0'><sphere/></shape>"), "found 1 of at least 2 shapes"},
    {MORPH("<shape at='0'/><shape at='1'><box/></shape>"), ""},
    {MORPH("<shape><sphere/></shape>" TWO), "missing; expected a number"},
    {MORPH(TWO "<shape at='1'><sphere/></shape>"), "1 is not after the time of the shape before, 1"},
    {MORPH(TWO "<shape at='-2'><sphere/></shape>"), "-2 is not after"},
    {MORPH(TWO "<sphere/>"), "takes no node inside"},
    {MORPH(TWO "<pair from='0 0 0'/>"), "missing"},
    {MORPH(TWO "<pair to='0 0 0'/>"), "missing"},
    {MORPH(TWO "<pair from='0 0' to='0 0 0'/>"), ""},
    {MORPH(TWO "<pair from='0 0 0' to='0 0'/>"), "there are 2 numbers; expected 3"},
    {MORPH(TWO "<pair from='0 0 0' to='0 0 0 1 1 1'/>"), "there are 6 numbers; expected 3"},
    {MORPH(TWO "<shape at='3'><sphere/></shape><pair from='0 0 0' to='0 0 0'/>"),
     "there are 3 numbers; expected 6"},
    {MORPH(TWO "<pair from='0 0 0' to='0 0 0'/><pair from='0 0 0' to='1 0 0'/>"),
     "(0 0 0) is where the pair in line 2 is in shape 1, but the two are apart in shape 2"},
    {MORPH(TWO "<pair from='0 0 0' to='1 0 0'/><pair from='2 0 0' to='1 0 0'/>"), "in shape 2"},
    /* They meet half-way, and have other ways to go. */
    {"<distance-morph time='0.5' rigid='false'>" TWO "<pair from='-1 0 0' to='1 0 0'/>"
     "<pair from='1 0 0' to='-1 0 0'/></distance-morph>", "at 0.5 of the way"},
  };
  for (size_t i = 0; i < ZS_COUNT_OF(cases); i++) {
    const seen s = refusal(cases[i].scene);
    if (!strstr(s.message, cases[i].message) || s.line != 2)
      fail_msg("%s: line %u: %s", cases[i].scene, s.line, s.message);
  }
  /* Pairs that are the same in all shapes are one. */
  value_in(MORPH(TWO "<pair from='0 0 0' to='1 0 0'/><pair from='0 0 0' to='1 0 0'/>"
                 "<pair from='0 1 0' to='1 1.5 0'/>"), 0, 0, 0);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(keyframes_are_met),
    cmocka_unit_test(time_is_a_parameter),
    cmocka_unit_test(no_pairs_are_linear),
    cmocka_unit_test(copies_stay_congruent),
    cmocka_unit_test(few_pairs_move_bodies),
    cmocka_unit_test(anchors_keep_to_their_ways),
    cmocka_unit_test(origin_and_order_do_not_matter),
    cmocka_unit_test(bad_input_is_refused),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
