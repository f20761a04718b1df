/* Random trees of all kinds, twelve deep: what a region's own program says of a
 * point is what the whole program says. */
#define _POSIX_C_SOURCE 200809L /* setenv */

#include "random_nodes.h"

#include "field/field.h"

enum { TREES = 2000, DEEPEST = 12, LEVELS = 3, POINTS = 48 };

/* Evaluates its children many times over: too much when nested. */
static bool is_slow(const zs_kind *kind)
{
  return !strcmp(kind->name, "normalize");
}

static const zs_kind *random_kind(uint64_t *state)
{
  unsigned count = 0;
  while (zs_kinds[count])
    count++;
  const zs_kind *kind;
  do
    kind = zs_kinds[random_below(state, count)];
  while (needs_data(kind) || is_slow(kind));
  return kind;
}

/* Copies of copies become too many when deep. */
static bool is_too_deep(const zs_kind *kind, int depth)
{
  return wants_ends(kind) && depth > 3;
}

/* A tree as deep as asked for along its first branch, shallow along others. */
static zs_node *random_tree(zs_arena *arena, int depth, uint64_t *state)
{
  const zs_kind *kind = random_kind(state);
  while (takes_children(kind) == (depth <= 1) || is_too_deep(kind, depth))
    kind = random_kind(state);
  zs_node *node = random_leaf(arena, kind, state);
  if (!takes_children(kind))
    return node;
  const int count = (has_children_in_parts(kind) ? 2 : 1) + (int)random_below(state, 2);
  double at = -1.5;
  for (int i = 0; i < count || wants_more(node); i++) {
    const int below = i ? 1 + (int)random_below(state, 2) : depth - 1;
    add_child(arena, node, random_tree(arena, below < depth ? below : depth - 1, state), at);
    at += random_between(state, 0.3, 1.5);
    assert_true(i < 9);
  }
  if (random_below(state, 3) == 0) {
    const double move[3] = {random_between(state, -0.4, 0.4), random_between(state, -0.4, 0.4),
                            random_between(state, -0.4, 0.4)};
    place_at(arena, node, move, random_between(state, -180, 180), random_between(state, 0.7, 1.4));
  }
  return node;
}

/* Whether rounding cannot change the sign: it is the same all around. */
static bool is_certain(zs_eval *eval, const double p[3], bool inside)
{
  const double h = 2e-5;
  for (int i = -1; i < 6; i++) {
    double q[3] = {p[0], p[1], p[2]};
    if (i >= 0)
      q[i / 2] += i % 2 ? h : -h;
    if ((zs_eval_point(eval, q) >= 0) != inside)
      return false;
  }
  return true;
}

static void shrink(double lo[3], double hi[3], uint64_t *state)
{
  for (int k = 0; k < 3; k++) {
    const double size = (hi[k] - lo[k]) / 4;
    lo[k] += size * (double)random_below(state, 4);
    hi[k] = lo[k] + size;
  }
}

typedef struct counts {
  int uncertain, points;
} counts;

/* One box: enclosed values, and signs as the whole program finds them. */
static void check_box(zs_eval *whole, zs_eval *regional, const double lo[3], const double hi[3],
                      counts *counts, uint64_t *state)
{
  float x[POINTS], y[POINTS], z[POINTS], f[POINTS], g[POINTS];
  for (int i = 0; i < POINTS; i++) {
    x[i] = (float)random_between(state, lo[0] + 1e-6, hi[0] - 1e-6);
    y[i] = (float)random_between(state, lo[1] + 1e-6, hi[1] - 1e-6);
    z[i] = (float)random_between(state, lo[2] + 1e-6, hi[2] - 1e-6);
  }
  zs_eval_values(whole, NULL, POINTS, x, y, z, f);
  zs_eval_values(regional, NULL, POINTS, x, y, z, g);
  float f_lo, f_hi;
  zs_eval_bounds(whole, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
  for (int i = 0; i < POINTS; i++) {
    counts->points++;
    if (!isnan(f_lo) && !(f[i] >= f_lo && f[i] <= f_hi))
      fail_msg("%.9g at %g %g %g is outside %.9g .. %.9g", f[i], x[i], y[i], z[i], f_lo, f_hi);
    if ((f[i] >= 0) == (g[i] >= 0))
      continue;
    const double p[3] = {x[i], y[i], z[i]};
    if (is_certain(whole, p, f[i] >= 0))
      fail_msg("at %.9g %.9g %.9g the whole program has %.9g, the region's %.9g", x[i], y[i], z[i],
               f[i], g[i]);
    counts->uncertain++;
  }
}

static void check_tree(const zs_node *root, counts *counts, uint64_t *state)
{
  zs_eval *whole = compiled(root), *regional = compiled(root);
  for (int path = 0; path < 3; path++) {
    double lo[3] = {-2, -2, -2}, hi[3] = {2, 2, 2};
    for (int level = 0; level < LEVELS; level++) {
      shrink(lo, hi, state);
      assert_true(zs_eval_restrict(regional, lo, hi, ZS_REQUEST_SIGN));
      check_box(whole, regional, lo, hi, counts, state);
    }
    for (int level = 0; level < LEVELS; level++)
      zs_eval_release(regional);
  }
  zs_eval_free(whole);
  zs_eval_free(regional);
}

static void test_pruned_is_unpruned(void **unused)
{
  (void)unused;
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  uint64_t state = 2024;
  counts counts = {0};
  for (int i = 0; i < TREES; i++) {
    zs_arena arena = {0};
    setenv("ZEROSET_ISA", isas[i % 3], 1);
    check_tree(random_tree(&arena, 1 + i % DEEPEST, &state), &counts, &state);
    zs_arena_free(&arena);
  }
  unsetenv("ZEROSET_ISA");
  /* Points so close to a surface are rare. */
  assert_true(counts.uncertain * 1000 < counts.points);
}

/* ---- Lattices ----------------------------------------------------------------- */

static zs_lattice random_lattice(uint64_t *state)
{
  double origin[3];
  for (int k = 0; k < 3; k++)
    origin[k] = random_between(state, -2, 2);
  zs_lattice lattice = {.frame = zs_frame_at(origin)};
  const double step = random_between(state, 0.002, 0.05);
  for (int k = 0; k < 3; k++) {
    lattice.count[k] =
      random_below(state, 3) ? ZS_LATTICE_SIDE : 1 + (unsigned)random_below(state, 16);
    for (unsigned i = 0; i < lattice.count[k]; i++)
      lattice.at[k][i] = (float)(step * ((double)i - 7.5));
  }
  return lattice;
}

/* Nothing is to be read that has not been written: not even 0 times NaN is 0. */
static void poison(const zs_eval *eval, const zs_program *program)
{
  const size_t stored = (size_t)program->register_count * ZS_EVAL_ROWS * ZS_BLOCK;
  for (size_t i = 0; i < stored; i++)
    eval->storage[i] = NAN;
  for (size_t i = 0; i < (size_t)ZS_MAXIMUM_KEPT * ZS_BLOCK; i++)
    eval->kept[i] = NAN;
}

/* The points of a layer by the whole program: the values for which a lattice
 * has short cuts. */
static void check_layer(zs_eval *eval, const zs_lattice *lattice, unsigned k, const float *values,
                        const float *signs)
{
  _Alignas(64) float x[ZS_BLOCK], y[ZS_BLOCK], z[ZS_BLOCK], f[ZS_BLOCK];
  unsigned n = 0;
  for (unsigned j = 0; j < lattice->count[1]; j++)
    for (unsigned i = 0; i < lattice->count[0]; i++, n++) {
      x[n] = lattice->at[0][i];
      y[n] = lattice->at[1][j];
      z[n] = lattice->at[2][k];
    }
  const zs_program *program = zs_field_program(zs_eval_field(eval));
  zs_program_values(eval, program, &lattice->frame, n, x, y, z, f);
  /* A polygon's distance is worked out about a point of each block: in a block of several
   * layers it is rounded in another way. */
  const float slack = program->regional_count ? 1e-5f : 0;
  n = 0;
  for (unsigned j = 0; j < lattice->count[1]; j++)
    for (unsigned i = 0; i < lattice->count[0]; i++, n++) {
      const size_t at = (k * ZS_LATTICE_SIDE + j) * ZS_LATTICE_SIDE + i;
      if (!(values[at] == f[n] || fabsf(values[at] - f[n]) <= slack * (1 + fabsf(f[n])) ||
            (isnan(values[at]) && isnan(f[n]))))
        fail_msg("point %u %u %u: %.9g, but by itself %.9g", i, j, k, values[at], f[n]);
      if (fabsf(f[n]) > 1e-6f && (signs[at] >= 0) != (f[n] >= 0))
        fail_msg("point %u %u %u: sign of %.9g, but by itself %.9g", i, j, k, signs[at], f[n]);
    }
}

static void test_lattices(void **unused)
{
  (void)unused;
  enum { POINTS_OF_LATTICE = ZS_LATTICE_SIDE * ZS_LATTICE_SIDE * ZS_LATTICE_SIDE };
  static float values[POINTS_OF_LATTICE], signs[POINTS_OF_LATTICE];
  uint64_t state = 99, evaluated = 0, all = 0;
  for (int i = 0; i < 600; i++) {
    zs_arena arena = {0};
    zs_eval *eval = compiled(random_tree(&arena, 1 + i % 8, &state));
    const zs_program *program = zs_field_program(zs_eval_field(eval));
    const zs_lattice lattice = random_lattice(&state);
    const unsigned points = lattice.count[0] * lattice.count[1] * lattice.count[2];
    poison(eval, program);
    assert_int_equal(
      zs_program_lattice(eval, program, &lattice, ZS_REQUEST_VALUE, i % 4 != 0, values), points);
    evaluated += zs_program_lattice(eval, program, &lattice, ZS_REQUEST_SIGN, true, signs);
    all += points;
    for (unsigned k = 0; k < lattice.count[2]; k++)
      check_layer(eval, &lattice, k, values, signs);
    zs_eval_free(eval);
    zs_arena_free(&arena);
  }
  assert_true(4 * evaluated < 3 * all); /* bounds do decide */
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_pruned_is_unpruned),
    cmocka_unit_test(test_lattices),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
