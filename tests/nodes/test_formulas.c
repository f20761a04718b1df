/* Kinds that emit operations of their own, against the formulas that define
 * them: every variant of every kind that has both. */
#include "random_nodes.h"

enum { POINTS = 400 };

/* The node's formula on values of its children, which are formulas too. */
static zs_eval *compiled_by_formula(const zs_node *node)
{
  zs_diag diag = {.report = print_diagnostic};
  zs_control control;
  zs_control_init(&control);
  control.scalar = true;
  zs_compiler *compiler = zs_compiler_new(&control, NULL, &diag);
  assert_non_null(compiler);
  zs_coordinates at = zs_coordinates_root();
  zs_value value = zs_kind_emit(compiler, node, &at);
  assert_int_equal(diag.errors, 0);
  zs_field *field = zs_compiler_finish(compiler, value, 1);
  assert_non_null(field);
  zs_eval *eval = zs_eval_new(field, &diag);
  assert_non_null(eval);
  zs_field_unref(field);
  return eval;
}

static void compare(const zs_node *node, uint64_t *state)
{
  zs_eval *fused = compiled(node), *formula = compiled_by_formula(node);
  for (int i = 0; i < POINTS; i++) {
    double p[3];
    for (int k = 0; k < 3; k++)
      p[k] = random_between(state, -2, 2);
    const double f = zs_eval_point(fused, p), g = zs_eval_point(formula, p);
    if (!(fabs(f - g) <= 1e-9 * (1 + fabs(g))))
      fail_msg("<%s> at %g %g %g: %.15g, by its formula %.15g", node->kind->name, p[0], p[1], p[2],
               f, g);
  }
  zs_eval_free(fused);
  zs_eval_free(formula);
}

/* Children whose values take both signs: two where the formula of a third would
 * cancel beyond comparison, three otherwise. */
static void add_children(zs_arena *arena, zs_node *node, uint64_t *state)
{
  const int count = strcmp(node->kind->name, "symmetric-difference") ? 3 : 2;
  for (int i = 0; i < count; i++) {
    const double at[3] = {random_between(state, -1, 1), random_between(state, -1, 1),
                          random_between(state, -1, 1)};
    zs_node *child = node_named(arena, i == 1 ? "box" : "sphere");
    adopt(arena, node, place_at(arena, child, at, random_between(state, -180, 180), 1));
  }
}

static void compare_variants(const char *name, const char *attribute, uint64_t *state,
                             void (*vary)(zs_node *, uint64_t *))
{
  const zs_kind *kind = zs_kind_find(name);
  const char *const *choices = attribute ? attribute_named(kind, attribute)->choices : NULL;
  for (size_t i = 0; i == 0 || (choices && choices[i]); i++)
    for (int repeat = 0; repeat < 10; repeat++) {
      zs_arena arena = {0};
      zs_node *node = node_of_kind(&arena, kind);
      if (choices)
        choose(node, attribute, choices[i]);
      vary(node, state);
      add_children(&arena, node, state);
      compare(node, state);
      zs_arena_free(&arena);
    }
}

static void vary_set(zs_node *node, uint64_t *state)
{
  set(node, "alpha", random_between(state, -0.9, 1));
  set(node, "m", 2 * (1 + random_below(state, 2)));
}

static void vary_blend(zs_node *node, uint64_t *state)
{
  set(node, "a0", random_between(state, -1, 1));
  set(node, "a1", random_between(state, 0.2, 2));
  set(node, "a2", random_between(state, 0.2, 2));
}

static void vary_smooth(zs_node *node, uint64_t *state)
{
  set(node, "radius", random_between(state, 0.05, 1.5));
}

static void test_sets_and_blends(void **unused)
{
  (void)unused;
  uint64_t state = 1;
  static const char *const sets[] = {"union", "intersection", "difference",
                                     "symmetric-difference"};
  for (size_t i = 0; i < ZS_COUNT_OF(sets); i++)
    compare_variants(sets[i], "r-function", &state, vary_set);
  static const char *const blends[] = {"blend-union", "blend-intersection", "blend-difference"};
  for (size_t i = 0; i < ZS_COUNT_OF(blends); i++)
    compare_variants(blends[i], NULL, &state, vary_blend);
  static const char *const smooths[] = {"smooth-union", "smooth-intersection",
                                        "smooth-difference"};
  for (size_t i = 0; i < ZS_COUNT_OF(smooths); i++)
    compare_variants(smooths[i], "profile", &state, vary_smooth);
}

static void test_leaves(void **unused)
{
  (void)unused;
  uint64_t state = 2;
  for (int repeat = 0; repeat < 20; repeat++) {
    zs_arena arena = {0};
    double v[9];
    for (int i = 0; i < 9; i++)
      v[i] = random_between(&state, -1, 1);
    zs_node *capsule = set3(set3(node_named(&arena, "capsule"), "from", v[0], v[1], v[2]), "to",
                            v[3], v[4], v[5]);
    compare(set(capsule, "radius", 0.5), &state);
    /* Of no length, and along an axis. */
    compare(set3(capsule, "to", v[0], v[1], v[2]), &state);
    compare(set3(capsule, "to", v[0], v[1], v[2] - 1), &state);
    zs_node *half_space = set3(node_named(&arena, "half-space"), "normal", v[0], v[1], v[2]);
    compare(set3(half_space, "point", v[6], v[7], v[8]), &state);
    zs_node *box = set3(node_named(&arena, "box"), "size", 1 + v[0], 1 + v[1], 1 + v[2]);
    compare(set(box, "round", 0.02), &state);
    const double size[2] = {1.2 + v[0], 1.2 + v[1]};
    compare(set(set_vector(node_named(&arena, "rectangle"), "size", size), "round", 0.05), &state);
    compare(choose(set(node_named(&arena, "cylinder"), "height", 1.5 + v[0]), "axis",
                   repeat % 2 ? "x" : "y"),
            &state);
    zs_arena_free(&arena);
  }
}

/* Every primitive that has an operation of its own, at any place, turn and size,
 * and inside a map that is not affine. */
static void test_placed_primitives(void **unused)
{
  (void)unused;
  uint64_t state = 4;
  unsigned count = 0;
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    if (!(*kind)->fused || (*kind)->children != ZS_CHILDREN_NONE)
      continue;
    count++;
    for (int repeat = 0; repeat < 20; repeat++) {
      zs_arena arena = {0};
      const double at[3] = {random_between(&state, -1, 1), random_between(&state, -1, 1),
                            random_between(&state, -1, 1)};
      const double turn = repeat % 3 ? random_between(&state, -180, 180) : 0;
      const double scale = repeat % 2 ? random_between(&state, 0.4, 2) : 1;
      zs_node *leaf = place_at(&arena, random_node(&arena, *kind, &state), at, turn, scale);
      compare(adopt(&arena, node_named(&arena, "union"), leaf), &state);
      zs_node *twist = set(node_named(&arena, "twist"), "rate", 70);
      compare(adopt(&arena, node_named(&arena, "union"), adopt(&arena, twist, leaf)), &state);
      zs_arena_free(&arena);
    }
  }
  assert_true(count >= 8);
}

static void test_maps(void **unused)
{
  (void)unused;
  uint64_t state = 3;
  for (int repeat = 0; repeat < 20; repeat++) {
    zs_arena arena = {0};
    double v[6];
    for (int i = 0; i < 6; i++)
      v[i] = random_between(&state, 0.3, 1.5) * (random_below(&state, 2) ? 1 : -1);
    zs_node *child = set3(node_named(&arena, "box"), "size", 1, 1.5, 2);
    zs_node *node = set3(node_named(&arena, "translate"), "by", v[0], v[1], v[2]);
    compare(adopt(&arena, node, child), &state);
    node = set(node_named(&arena, "rotate"), "angle", 100 * v[0]);
    compare(adopt(&arena, node, child), &state);
    static const char *const axes[] = {"x", "y", "z"};
    compare(choose(node, "axis", axes[repeat % 3]), &state);
    node = set3(set3(node_named(&arena, "scale"), "by", v[0], v[1], v[2]), "about", v[3], v[4],
                v[5]);
    compare(adopt(&arena, node, child), &state);
    node = set3(set3(node_named(&arena, "mirror"), "normal", v[0], v[1], v[2]), "point", v[3],
                v[4], v[5]);
    compare(adopt(&arena, node, child), &state);
    zs_arena_free(&arena);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_sets_and_blends),
    cmocka_unit_test(test_leaves),
    cmocka_unit_test(test_placed_primitives),
    cmocka_unit_test(test_maps),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
