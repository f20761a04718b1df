/* Chains, against the same joints one by one. */
#include "../random.h"

#include "field/blend.h"
#include "field/compiler.h"
#include "field/program.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const ISAS[] = {"baseline", "avx2", "avx512"};

enum { MOST_LINKS = 150, PROFILES = 5 };

/* What a scene of a chain is made of. */
typedef struct recipe {
  unsigned links, profile;
  zs_blend_side side;
  bool goes_on;   /* from a value that is no primitive */
  bool bent;      /* in coordinates that are no affine map of the scene's */
  bool of_balls;  /* that are only moved */
  uint64_t seed;
} recipe;

static const zs_operation *const JOINTS[PROFILES] = {
  NULL, &zs_smooth_quadratic, &zs_smooth_cubic, &zs_smooth_circular, &zs_smooth_chamfer};

static zs_value join(zs_compiler *c, const recipe *r, zs_value a, zs_value b)
{
  if (!JOINTS[r->profile])
    return zs_emit(c, r->side > 0 ? ZS_FUNCTION_MAXIMUM : ZS_FUNCTION_MINIMUM, a, b, 0);
  const zs_blend data = {.side = r->side, .parameter = {0.15}};
  return zs_emit_operation(c, JOINTS[r->profile], &data, a, b, 0);
}

/* A rotation by a random angle about a random axis of the three, scaled and moved. */
static void random_map(uint64_t *seed, double m[12])
{
  const double angle = random_between(seed, 0, 6), scale = random_between(seed, 0.7, 1.4);
  const unsigned axis = random_below(seed, 3), u = (axis + 1) % 3, v = (axis + 2) % 3;
  memset(m, 0, 12 * sizeof *m);
  m[5 * axis] = scale;
  m[4 * u + u] = m[4 * v + v] = scale * cos(angle);
  m[4 * u + v] = scale * sin(angle);
  m[4 * v + u] = -m[4 * u + v];
  for (int k = 0; k < 3; k++)
    m[4 * k + 3] = random_between(seed, -1, 1);
}

static zs_value random_link(zs_compiler *c, const recipe *r, uint64_t *seed,
                            const zs_coordinates *at)
{
  double map[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, parameter[4];
  zs_primitive_shape shape = ZS_PRIMITIVE_BALL;
  if (r->of_balls || random_below(seed, 2))
    for (int k = 0; k < 3; k++)
      map[4 * k + 3] = random_between(seed, -1, 1);
  else
    random_map(seed, map);
  if (!r->of_balls)
    shape = (zs_primitive_shape)random_below(seed, ZS_PRIMITIVE_COUNT);
  for (int k = 0; k < 4; k++)
    parameter[k] = random_between(seed, 0.05, 0.3);
  const zs_coordinates placed = zs_coordinates_affine(at, map);
  const zs_value value = zs_emit_primitive(c, shape, parameter, &placed);
  const bool negated = !r->of_balls && random_below(seed, 3) == 0;
  return negated ? zs_emit(c, ZS_FUNCTION_NEGATE, value, 0, 0) : value;
}

/* The field of a recipe.  Primitives that have another use make no chain: not
 * `chained`, all of them have. */
static zs_field *cook(const recipe *r, bool chained)
{
  uint64_t seed = r->seed;
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  zs_coordinates at = zs_coordinates_root();
  zs_value xyz[3];
  for (int k = 0; k < 3; k++)
    xyz[k] = zs_emit_coordinate(c, &at, k);
  if (r->bent) {
    zs_value wave = zs_emit(c, ZS_FUNCTION_SINE, xyz[1], 0, 0);
    at = zs_coordinates_from(zs_emit(c, ZS_FUNCTION_ADD, xyz[0], wave, 0), xyz[1], xyz[2]);
  }
  zs_value f = zs_emit(c, ZS_FUNCTION_SUBTRACT, zs_emit(c, ZS_FUNCTION_COSINE, xyz[0], 0, 0),
                       zs_emit_constant(c, 0.9), 0);
  zs_value others = zs_emit_constant(c, 0);
  for (unsigned i = 0; i < r->links; i++) {
    const zs_value link = random_link(c, r, &seed, &at);
    others = zs_emit(c, ZS_FUNCTION_ADD, others, link, 0);
    if (!i && !r->goes_on)
      f = link;
    else
      f = join(c, r, i % 2 ? f : link, i % 2 ? link : f);
  }
  if (!chained) {
    const zs_value nothing =
      zs_emit(c, ZS_FUNCTION_MULTIPLY, others, zs_emit_constant(c, 1e-30), 0);
    f = zs_emit(c, ZS_FUNCTION_ADD, f, nothing, 0);
  }
  zs_field *field = zs_compiler_finish(c, f, 1);
  assert_non_null(field);
  char *listing = zs_field_listing(field);
  assert_non_null(listing);
  assert_int_equal(strstr(listing, " chain ") != NULL, chained && r->links > 1);
  free(listing);
  return field;
}

static recipe random_recipe(uint64_t *seed)
{
  static const unsigned links[] = {2, 3, 7, 20, 64, 65, MOST_LINKS};
  return (recipe){.links = links[random_below(seed, 7)],
                  .profile = random_below(seed, PROFILES),
                  .side = random_below(seed, 2) ? ZS_BLEND_UNION : ZS_BLEND_INTERSECTION,
                  .goes_on = random_below(seed, 2),
                  .bent = random_below(seed, 3) == 0,
                  .of_balls = random_below(seed, 3) == 0,
                  .seed = random_bits(seed)};
}

/* The two fields of a recipe, with an evaluator for each. */
typedef struct pair {
  zs_field *field[2];
  zs_eval *eval[2];
} pair;

static pair pair_of(const recipe *r)
{
  pair p;
  for (int i = 0; i < 2; i++) {
    p.field[i] = cook(r, i == 0);
    p.eval[i] = zs_eval_new(p.field[i], NULL);
    assert_non_null(p.eval[i]);
  }
  return p;
}

static void free_pair(pair *p)
{
  for (int i = 0; i < 2; i++) {
    zs_eval_free(p->eval[i]);
    zs_field_unref(p->field[i]);
  }
}

static bool is_close(double a, double b, double tolerance)
{
  return fabs(a - b) <= tolerance * (1 + fabs(b));
}

enum { POINTS = 200 };

static void values_and_gradients_agree(pair *p, uint64_t *seed)
{
  float at[3][POINTS], f[2][POINTS], g[2][4][POINTS];
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < POINTS; i++)
      at[k][i] = (float)random_between(seed, -1.5, 1.5);
  const double origin[3] = {0.25, -0.5, 0.125};
  for (int e = 0; e < 2; e++) {
    zs_eval_values(p->eval[e], origin, POINTS, at[0], at[1], at[2], f[e]);
    zs_eval_gradients(p->eval[e], origin, POINTS, at[0], at[1], at[2], g[e][0], g[e][1], g[e][2],
                      g[e][3]);
  }
  for (int i = 0; i < POINTS; i++) {
    const double point[3] = {origin[0] + at[0][i], origin[1] + at[1][i], origin[2] + at[2][i]};
    const double exact = zs_eval_point(p->eval[0], point);
    assert_true(is_close(exact, zs_eval_point(p->eval[1], point), 1e-12));
    assert_true(is_close(f[0][i], exact, 2e-6));
    assert_true(is_close(f[0][i], f[1][i], 1e-6));
    assert_true(is_close(g[0][0][i], f[0][i], 1e-6));
    for (int k = 1; k < 4; k++)
      assert_true(is_close(g[0][k][i], g[1][k][i], 2e-3));
  }
}

static void frames_agree(pair *p, bool perspective, uint64_t *seed)
{
  _Alignas(64) float at[3][ZS_BLOCK], f[2][ZS_BLOCK];
  zs_frame frame = {.origin = {0.5, 0.25, -2}, .perspective = perspective};
  for (int j = 0; j < 3; j++)
    for (int k = 0; k < 3; k++)
      frame.axes[j][k] = random_between(seed, -1, 1);
  for (int e = 0; e < 2; e++) {
    uint64_t same = *seed;
    for (int k = 0; k < 3; k++)
      for (int i = 0; i < POINTS; i++)
        at[k][i] = (float)random_between(&same, -1, 1);
    zs_program_values(p->eval[e], zs_field_program(p->field[e]), &frame, POINTS, at[0], at[1],
                      at[2], f[e]);
  }
  for (int i = 0; i < POINTS; i++)
    assert_true(is_close(f[0][i], f[1][i], 3e-6));
}

static zs_boxes random_boxes(uint64_t *seed, double size)
{
  zs_boxes boxes;
  for (unsigned l = 0; l < ZS_LANES; l++)
    for (int k = 0; k < 3; k++) {
      const double lo = random_between(seed, -1.2, 1.2);
      boxes.axis[k].lo[l] = l % 2 ? boxes.axis[k].lo[l - 1] : (float)lo;
      boxes.axis[k].hi[l] = boxes.axis[k].lo[l] + (float)size;
    }
  return boxes;
}

/* A regional program against the whole one, at points of its box; bounds hold them. */
static void region_agrees(zs_eval *eval, const zs_program *whole, const zs_program *part,
                          const zs_boxes *boxes, const zs_bounds *bounds, unsigned lane,
                          zs_request request, uint64_t *seed)
{
  _Alignas(64) float at[3][ZS_BLOCK], f[2][ZS_BLOCK];
  const zs_frame frame = zs_frame_at(NULL);
  for (int e = 0; e < 2; e++) {
    uint64_t same = *seed;
    for (int k = 0; k < 3; k++)
      for (int i = 0; i < POINTS; i++)
        at[k][i] = (float)random_between(&same, (double)boxes->axis[k].lo[lane],
                                         (double)boxes->axis[k].hi[lane]);
    zs_program_values(eval, e ? part : whole, &frame, POINTS, at[0], at[1], at[2], f[e]);
  }
  for (int i = 0; i < POINTS; i++) {
    assert_true(bounds->lo[lane] <= f[0][i] && f[0][i] <= bounds->hi[lane]);
    if (request == ZS_REQUEST_VALUE)
      assert_true(is_close(f[0][i], f[1][i], 1e-6));
    else if (fabsf(f[0][i]) > 1e-5f)
      assert_int_equal(f[0][i] >= 0, f[1][i] >= 0);
  }
}

static void regions_agree(const pair *p, zs_request request, uint64_t *seed)
{
  zs_eval *eval = p->eval[0];
  const zs_program *whole = zs_field_program(p->field[0]), *parts[ZS_LANES], *again[ZS_LANES];
  const zs_frame frame = zs_frame_at(NULL);
  const zs_boxes boxes = random_boxes(seed, random_between(seed, 0.05, 0.4));
  zs_bounds f, g;
  zs_arena arena = {0};
  zs_program_bounds(eval, whole, &frame, &boxes, &f);
  zs_program_restrict_lanes(eval, whole, 0xffff, request, &arena, parts);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    region_agrees(eval, whole, parts[l], &boxes, &f, l, request, seed);
    assert_true(zs_program_length(parts[l]) <= zs_program_length(whole));
    if (l % 2)
      assert_ptr_equal(parts[l], parts[l - 1]);
  }
  /* The program of a program. */
  for (unsigned l = 0; l < ZS_LANES; l += 5) {
    zs_program_bounds(eval, parts[l], &frame, &boxes, &g);
    zs_program_restrict_lanes(eval, parts[l], 1u << l, request, &arena, again);
    region_agrees(eval, whole, again[l], &boxes, &f, l, request, seed);
  }
  zs_arena_free(&arena);
}

static void chains_equal_joints(void **state)
{
  (void)state;
  uint64_t seed = 11;
  for (int round = 0; round < 40; round++)
    for (size_t i = 0; i < sizeof ISAS / sizeof *ISAS; i++) {
      const recipe r = random_recipe(&seed);
      setenv("ZEROSET_ISA", ISAS[i], 1);
      pair p = pair_of(&r);
      values_and_gradients_agree(&p, &seed);
      frames_agree(&p, false, &seed);
      frames_agree(&p, true, &seed);
      regions_agree(&p, ZS_REQUEST_VALUE, &seed);
      regions_agree(&p, ZS_REQUEST_SIGN, &seed);
      free_pair(&p);
      unsetenv("ZEROSET_ISA");
    }
}

/* Near one ball of many, a few are left. */
static void regions_get_shorter(void **state)
{
  (void)state;
  const recipe r = {.links = MOST_LINKS, .profile = 1, .side = ZS_BLEND_UNION, .of_balls = true,
                    .seed = 5};
  pair p = pair_of(&r);
  const zs_program *whole = zs_field_program(p.field[0]), *parts[ZS_LANES];
  const zs_frame frame = zs_frame_at(NULL);
  uint64_t seed = 7;
  const zs_boxes boxes = random_boxes(&seed, 0.01);
  zs_bounds f;
  zs_arena arena = {0};
  zs_program_bounds(p.eval[0], whole, &frame, &boxes, &f);
  zs_program_restrict_lanes(p.eval[0], whole, 0xffff, ZS_REQUEST_VALUE, &arena, parts);
  for (unsigned l = 0; l < ZS_LANES; l++)
    assert_true(zs_program_length(parts[l]) < MOST_LINKS / 5);
  zs_arena_free(&arena);
  free_pair(&p);
}

/* A union takes the parts of which it is made in any order: links that use the same
 * coordinates are together. */
static void sharp_chains_are_sorted(void **state)
{
  (void)state;
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  zs_value f = 0;
  for (int i = 0; i < 12; i++) {
    double map[12] = {0};
    for (int k = 0; k < 3; k++)
      map[4 * k + (i + k) % 3] = 1; /* the tube along z turns to each axis */
    map[3] = i;
    const zs_coordinates root = zs_coordinates_root(), at = zs_coordinates_affine(&root, map);
    const double parameter[4] = {0.1};
    const zs_value tube = zs_emit_primitive(c, ZS_PRIMITIVE_TUBE, parameter, &at);
    f = i ? zs_emit(c, ZS_FUNCTION_MAXIMUM, f, tube, 0) : tube;
  }
  zs_field *field = zs_compiler_finish(c, f, 1);
  assert_non_null(field);
  const zs_program *program = zs_field_program(field);
  assert_int_equal(program->count, ZS_COORDINATES + 3);
  assert_int_equal(program->link_count, 12);
  zs_field_unref(field);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(chains_equal_joints),
    cmocka_unit_test(regions_get_shorter),
    cmocka_unit_test(sharp_chains_are_sorted),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
