/* The field room: scalar operations, programs, regions, the walk, boxes. */
#include "../random.h"

#include "field/blend.h"
#include "field/compiler.h"
#include "field/field.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const ISAS[] = {"baseline", "avx2", "avx512"};

static zs_compiler *begin(zs_value xyz[3])
{
  zs_compiler *c = zs_compiler_new(NULL, NULL, NULL);
  assert_non_null(c);
  zs_coordinates at = zs_coordinates_root();
  for (int k = 0; k < 3; k++)
    xyz[k] = zs_emit_coordinate(c, &at, k);
  return c;
}

static zs_field *finish(zs_compiler *c, zs_value result)
{
  zs_field *field = zs_compiler_finish(c, result, 1);
  assert_non_null(field);
  return field;
}

static zs_eval *evaluator(zs_field *field)
{
  zs_eval *eval = zs_eval_new(field, NULL);
  assert_non_null(eval);
  return eval;
}

/* Where a function is defined and smooth enough to compare. */
static void domain_of(zs_function function, unsigned operand, double *lo, double *hi)
{
  *lo = -3;
  *hi = 3;
  switch (function) {
  case ZS_FUNCTION_LOGARITHM:
  case ZS_FUNCTION_SQUARE_ROOT:
    *lo = 0.05;
    break;
  case ZS_FUNCTION_ARC_SINE:
  case ZS_FUNCTION_ARC_COSINE:
    *lo = -0.95;
    *hi = 0.95;
    break;
  case ZS_FUNCTION_TANGENT:
    *lo = -1.4;
    *hi = 1.4;
    break;
  case ZS_FUNCTION_POWER:
    *lo = operand ? -3 : 0.1;
    break;
  case ZS_FUNCTION_DIVIDE:
  case ZS_FUNCTION_MODULO:
    *lo = operand ? 0.3 : -3;
    break;
  default:
    break;
  }
}

/* The field of one function of the coordinates; `constant` operands (one bit
 * each) are numbers. */
static zs_field *function_field(zs_function function, unsigned constant, const double number[3])
{
  zs_value xyz[3], in[3];
  zs_compiler *c = begin(xyz);
  for (unsigned k = 0; k < 3; k++)
    in[k] = constant >> k & 1 ? zs_emit_constant(c, number[k]) : xyz[k];
  return finish(c, zs_emit(c, function, in[0], in[1], in[2]));
}

static void check_values(zs_function function, zs_field *field, unsigned constant,
                         const double number[3], uint64_t *seed)
{
  enum { N = 300 };
  float p[3][N], f[N], g[4][N];
  zs_eval *eval = evaluator(field);
  for (unsigned k = 0; k < 3; k++) {
    double lo, hi;
    domain_of(function, k, &lo, &hi);
    for (int i = 0; i < N; i++)
      p[k][i] = (float)random_between(seed, lo, hi);
  }
  zs_eval_values(eval, NULL, N, p[0], p[1], p[2], f);
  zs_eval_gradients(eval, NULL, N, p[0], p[1], p[2], g[0], g[1], g[2], g[3]);
  for (int i = 0; i < N; i++) {
    double at[3];
    for (int k = 0; k < 3; k++)
      at[k] = constant >> k & 1 ? number[k] : (double)p[k][i];
    double exact = zs_function_value(function, at[0], at[1], at[2]);
    double point[3] = {p[0][i], p[1][i], p[2][i]};
    assert_true(fabs(zs_eval_point(eval, point) - exact) <= 1e-12 * (1 + fabs(exact)));
    assert_true(fabs(f[i] - exact) <= 1e-5 * (1 + fabs(exact)));
    assert_true(fabsf(f[i] - g[0][i]) <= 1e-6f * (1 + fabsf(f[i])));
    for (int k = 0; k < 3; k++) {
      const double h = 1e-6;
      double up[3] = {point[0], point[1], point[2]}, down[3] = {point[0], point[1], point[2]};
      up[k] += h;
      down[k] -= h;
      double left = (exact - zs_eval_point(eval, down)) / h;
      double right = (zs_eval_point(eval, up) - exact) / h;
      if (fabs(left - right) > 1e-3 * (1 + fabs(left)))
        continue; /* a kink or a jump */
      assert_true(fabs(g[k + 1][i] - (left + right) / 2) <= 2e-3 * (1 + fabs(left)));
    }
  }
  zs_eval_free(eval);
}

static void check_bounds(zs_function function, zs_field *field, uint64_t *seed)
{
  zs_eval *eval = evaluator(field);
  unsigned informative = 0;
  enum { BOXES = 160, SAMPLES = 60 };
  for (int b = 0; b < BOXES; b++) {
    double lo[1][3], hi[1][3];
    for (unsigned k = 0; k < 3; k++) {
      double from, to;
      domain_of(function, k, &from, &to);
      double u = random_between(seed, from, to), v = u;
      if (b % 4) /* every fourth is a point */
        v = random_between(seed, from, to);
      /* Snap to the corners that matter: zero, one, halves. */
      if (b % 3 == 0 && floor(u) > from)
        u = floor(u);
      lo[0][k] = fmin(u, v);
      hi[0][k] = fmax(u, v);
    }
    float f_lo, f_hi;
    zs_eval_bounds(eval, 1, (const double(*)[3])lo, (const double(*)[3])hi, &f_lo, &f_hi);
    if (isnan(f_lo) || isnan(f_hi)) {
      assert_true(isnan(f_lo) && isnan(f_hi));
      continue;
    }
    informative++;
    float p[3][SAMPLES], f[SAMPLES];
    for (int i = 0; i < SAMPLES; i++)
      for (int k = 0; k < 3; k++) {
        double t = i < 8 ? i >> k & 1 : random_between(seed, 0, 1);
        p[k][i] = (float)(lo[0][k] + t * (hi[0][k] - lo[0][k]));
        if ((double)p[k][i] < lo[0][k] || (double)p[k][i] > hi[0][k])
          p[k][i] = (float)lo[0][k];
      }
    zs_eval_values(eval, NULL, SAMPLES, p[0], p[1], p[2], f);
    for (int i = 0; i < SAMPLES; i++) {
      assert_true(f[i] >= f_lo && f[i] <= f_hi);
      double point[3] = {p[0][i], p[1][i], p[2][i]};
      double exact = zs_eval_point(eval, point);
      assert_true(exact >= (double)f_lo && exact <= (double)f_hi);
    }
  }
  assert_true(informative >= BOXES / 8);
  zs_eval_free(eval);
}

static void scalar_functions(void **state)
{
  (void)state;
  for (size_t isa = 0; isa < sizeof ISAS / sizeof *ISAS; isa++) {
    setenv("ZEROSET_ISA", ISAS[isa], 1);
    uint64_t seed = 1;
    for (int f = ZS_FUNCTION_ADD; f < ZS_FUNCTION_COUNT; f++) {
      zs_function function = (zs_function)f;
      unsigned forms = zs_function_arity(function) == 2 ? 3 : 1;
      for (unsigned constant = 0; constant < forms; constant++) {
        const double number[3] = {1.7, 2.3, 0};
        zs_field *field = function_field(function, constant, number);
        check_values(function, field, constant, number, &seed);
        check_bounds(function, field, &seed);
        zs_field_unref(field);
      }
    }
  }
  unsetenv("ZEROSET_ISA");
}

static void bounds_are_unknown_where_f_may_be(void **state)
{
  (void)state;
  const zs_function partial[] = {ZS_FUNCTION_LOGARITHM, ZS_FUNCTION_SQUARE_ROOT,
                                 ZS_FUNCTION_ARC_SINE, ZS_FUNCTION_DIVIDE};
  const double lo[1][3] = {{-2, -1, -1}}, hi[1][3] = {{2, 1, 1}};
  for (size_t i = 0; i < sizeof partial / sizeof *partial; i++) {
    const double number[3] = {0};
    zs_field *field = function_field(partial[i], 0, number);
    zs_eval *eval = evaluator(field);
    float f_lo, f_hi;
    zs_eval_bounds(eval, 1, lo, hi, &f_lo, &f_hi);
    assert_true(isnan(f_lo) && isnan(f_hi));
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* A random expression of `size` operations, rich in choices.  With `zeros` many constants are 0,
 * and no operation tells 0 from -0. */
static zs_field *random_field(uint64_t *seed, unsigned size, bool zeros)
{
  static const zs_function functions[] = {
    ZS_FUNCTION_MINIMUM, ZS_FUNCTION_MAXIMUM, ZS_FUNCTION_MINIMUM, ZS_FUNCTION_MAXIMUM,
    ZS_FUNCTION_ADD, ZS_FUNCTION_SUBTRACT, ZS_FUNCTION_MULTIPLY, ZS_FUNCTION_HYPOT,
    ZS_FUNCTION_NEGATE, ZS_FUNCTION_ABSOLUTE, ZS_FUNCTION_SQUARE_ROOT, ZS_FUNCTION_SINE,
    ZS_FUNCTION_SELECT, ZS_FUNCTION_LESS, ZS_FUNCTION_DIVIDE, ZS_FUNCTION_ATAN2,
  };
  const unsigned function_count = sizeof functions / sizeof *functions - (zeros ? 2 : 0);
  zs_value xyz[3];
  zs_compiler *c = begin(xyz);
  zs_value values[1000];
  assert_true(size + 3 <= 1000);
  memcpy(values, xyz, sizeof xyz);
  for (unsigned i = 3; i < size + 3; i++) {
    zs_value in[3];
    for (int k = 0; k < 3; k++) {
      unsigned recent = i < 12 ? i : 12;
      in[k] = random_below(seed, 5) ? values[i - 1 - random_below(seed, recent)]
                                    : zs_emit_constant(c, random_between(seed, -1, 1));
      if (zeros && !random_below(seed, 8))
        in[k] = zs_emit_constant(c, 0);
    }
    zs_function function = functions[random_below(seed, function_count)];
    values[i] = zs_emit(c, function, in[0], in[1], in[2]);
  }
  zs_value result = values[size + 2];
  for (unsigned i = 3; i < size + 2; i += 7) {
    const zs_blend join = {.side = i % 2 ? ZS_BLEND_UNION : ZS_BLEND_INTERSECTION,
                           .parameter = {i % 4 < 2 ? 0 : 0.5}};
    result = size % 2
               ? zs_emit_operation(c, &zs_r_alpha, &join, result, values[i], 0)
               : zs_emit(c, i % 2 ? ZS_FUNCTION_MAXIMUM : ZS_FUNCTION_MINIMUM, result, values[i], 0);
  }
  return finish(c, result);
}

static bool same(float a, float b)
{
  return a == b || (isnan(a) && isnan(b));
}

static void regions_equal_the_whole(void **state)
{
  (void)state;
  uint64_t seed = 7;
  for (int program = 0; program < 1000; program++) {
    zs_field *field = random_field(&seed, 5 + random_below(&seed, 200), program >= 600);
    zs_eval *whole = evaluator(field), *part = evaluator(field);
    for (int box = 0; box < 12; box++) {
      enum { N = 70 };
      double lo[3], hi[3];
      double size = box % 2 ? 0.1 : 1;
      for (int k = 0; k < 3; k++) {
        lo[k] = random_between(&seed, -2, 2);
        hi[k] = lo[k] + random_between(&seed, 0, size);
      }
      zs_request request = box % 3 ? ZS_REQUEST_SIGN : ZS_REQUEST_VALUE;
      assert_true(zs_eval_restrict(part, lo, hi, request));
      for (int k = 0; k < 3; k++) /* once more, nested */
        hi[k] = lo[k] + 0.7 * (hi[k] - lo[k]);
      assert_true(zs_eval_restrict(part, lo, hi, request));
      float p[3][N], a[N], b[N];
      for (int i = 0; i < N; i++)
        for (int k = 0; k < 3; k++) {
          p[k][i] = (float)random_between(&seed, lo[k], hi[k]);
          p[k][i] = fminf(fmaxf(p[k][i], nextafterf((float)lo[k], 9)), nextafterf((float)hi[k], -9));
        }
      zs_eval_values(whole, NULL, N, p[0], p[1], p[2], a);
      zs_eval_values(part, NULL, N, p[0], p[1], p[2], b);
      for (int i = 0; i < N; i++) {
        if (request == ZS_REQUEST_SIGN)
          assert_int_equal(a[i] >= 0, b[i] >= 0);
        else
          assert_true(same(a[i], b[i]));
      }
      zs_eval_release(part);
      zs_eval_release(part);
    }
    zs_eval_free(whole);
    zs_eval_free(part);
    zs_field_unref(field);
  }
}

static void regions_get_shorter(void **state)
{
  (void)state;
  /* A row of spheres under max: near one of them, only that one is left. */
  zs_value xyz[3], result = 0;
  zs_compiler *c = begin(xyz);
  for (int i = 0; i < 64; i++) {
    zs_value x = zs_emit(c, ZS_FUNCTION_SUBTRACT, xyz[0], zs_emit_constant(c, i), 0);
    zs_value r = zs_emit(c, ZS_FUNCTION_HYPOT, x, zs_emit(c, ZS_FUNCTION_HYPOT, xyz[1], xyz[2], 0), 0);
    zs_value ball = zs_emit(c, ZS_FUNCTION_SUBTRACT, zs_emit_constant(c, 0.4), r, 0);
    result = i ? zs_emit(c, ZS_FUNCTION_MAXIMUM, result, ball, 0) : ball;
  }
  zs_field *field = finish(c, result);
  zs_eval *eval = evaluator(field);
  const zs_program *whole = zs_field_program(field);
  zs_frame frame = zs_frame_at(NULL);
  zs_boxes boxes;
  zs_bounds f;
  for (unsigned l = 0; l < ZS_LANES; l++)
    for (int k = 0; k < 3; k++) {
      float middle = k ? 0 : (float)(l / 2); /* pairs of equal boxes */
      boxes.axis[k].lo[l] = middle - 0.1f;
      boxes.axis[k].hi[l] = middle + 0.1f;
    }
  zs_program_bounds(eval, whole, &frame, &boxes, &f);
  zs_arena arena = {0};
  const zs_program *parts[ZS_LANES];
  zs_program_restrict_lanes(eval, whole, 0xffff, ZS_REQUEST_VALUE, &arena, parts);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    assert_true(parts[l]->count < 12);
    assert_int_equal(parts[l]->choice_count, 0);
    if (l)
      assert_int_equal(parts[l] == parts[l - 1], l % 2);
  }
  zs_arena_free(&arena);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* What is nothing but 0 in a box takes what it was made of with it, and sums lose it; elsewhere
 * it stays. */
static void zeros_leave_regions(void **state)
{
  (void)state;
  zs_value xyz[3], above;
  zs_compiler *c = begin(xyz);
  above = zs_emit(c, ZS_FUNCTION_SUBTRACT, xyz[0], zs_emit_constant(c, 4), 0);
  above = zs_emit(c, ZS_FUNCTION_MAXIMUM, above, zs_emit_constant(c, 0), 0);
  above = zs_emit(c, ZS_FUNCTION_SQUARE, above, 0, 0);
  above = zs_emit(c, ZS_FUNCTION_MULTIPLY, above, zs_emit_constant(c, 3), 0);
  const zs_value rest = zs_emit(c, ZS_FUNCTION_HYPOT, xyz[1], xyz[2], 0);
  zs_value result = zs_emit(c, ZS_FUNCTION_SUBTRACT, rest, above, 0);
  result = zs_emit(c, ZS_FUNCTION_ADD, above, result, 0);
  /* What needs the 0 as a number has a constant for it. */
  result = zs_emit(c, ZS_FUNCTION_HYPOT, result, above, 0);
  zs_field *field = finish(c, result);
  zs_eval *eval = evaluator(field);
  const zs_program *whole = zs_field_program(field), *parts[ZS_LANES];
  zs_frame frame = zs_frame_at(NULL);
  zs_boxes boxes;
  zs_bounds f;
  for (unsigned l = 0; l < ZS_LANES; l++)
    for (int k = 0; k < 3; k++) {
      boxes.axis[k].lo[l] = k ? 1 : (float)l / 2; /* up to 4, but for rounding, in lane 7 */
      boxes.axis[k].hi[l] = boxes.axis[k].lo[l] + 0.5f;
    }
  zs_program_bounds(eval, whole, &frame, &boxes, &f);
  zs_arena arena = {0};
  zs_program_restrict_lanes(eval, whole, 0xffff, ZS_REQUEST_GRADIENT, &arena, parts);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    /* y, z, HYPOT, 0, HYPOT */
    if (l < 7)
      assert_int_equal(parts[l]->count, ZS_COORDINATES + 5);
    else
      assert_ptr_equal(parts[l], whole);
    float at[3][ZS_LANES], a[4 * ZS_BLOCK], b[4 * ZS_BLOCK];
    for (unsigned i = 0; i < ZS_LANES; i++)
      for (int k = 0; k < 3; k++)
        at[k][i] = boxes.axis[k].lo[l] + 0.5f * (float)((7 * i + (unsigned)k) % ZS_LANES) / ZS_LANES;
    zs_program_gradients(eval, whole, &frame, ZS_LANES, at[0], at[1], at[2], a);
    zs_program_gradients(eval, parts[l], &frame, ZS_LANES, at[0], at[1], at[2], b);
    for (unsigned row = 0; row < 4; row++)
      for (unsigned i = 0; i < ZS_LANES; i++)
        assert_true(a[row * ZS_BLOCK + i] == b[row * ZS_BLOCK + i]);
  }
  zs_arena_free(&arena);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* Where a 0 decides by its sign, as a divisor does, it stays what it is. */
static void zeros_keep_their_signs(void **state)
{
  (void)state;
  for (int i = 0; i < 3; i++) {
    zs_value xyz[3];
    zs_compiler *c = begin(xyz);
    const zs_value zero = zs_emit_constant(c, 0), one = zs_emit_constant(c, 1);
    zs_value product = zs_emit(c, ZS_FUNCTION_MAXIMUM, xyz[1], zero, 0);
    product = zs_emit(c, ZS_FUNCTION_MULTIPLY, xyz[2], product, 0); /* -0 */
    const zs_value result = i == 0   ? zs_emit(c, ZS_FUNCTION_DIVIDE, one, product, 0)
                            : i == 1 ? zs_emit(c, ZS_FUNCTION_DIVIDE, xyz[0], product, 0)
                                     : zs_emit(c, ZS_FUNCTION_ATAN2, product, xyz[0], 0);
    zs_field *field = finish(c, result);
    zs_eval *eval = evaluator(field);
    const double lo[3] = {-2, -1, -1}, hi[3] = {-1, -0.5, -0.5};
    const float x = -1.5f, y = -0.7f, z = -0.6f;
    float whole, part;
    zs_eval_values(eval, NULL, 1, &x, &y, &z, &whole);
    assert_true(zs_eval_restrict(eval, lo, hi, ZS_REQUEST_VALUE));
    zs_eval_values(eval, NULL, 1, &x, &y, &z, &part);
    assert_true(part == whole);
    zs_eval_free(eval);
    zs_field_unref(field);
  }
}

/* Many balls, joined in different ways; one of them may be no number but inside. */
static zs_field *many_balls(uint64_t *seed, unsigned count, bool numbers)
{
  zs_value xyz[3], result = 0;
  zs_compiler *c = begin(xyz);
  for (unsigned i = 0; i < count; i++) {
    zs_value away[3];
    for (int k = 0; k < 3; k++)
      away[k] = zs_emit(c, ZS_FUNCTION_SUBTRACT, xyz[k],
                        zs_emit_constant(c, random_between(seed, -1.5, 2.5)), 0);
    const zs_value r = zs_emit(c, ZS_FUNCTION_HYPOT, away[0],
                               zs_emit(c, ZS_FUNCTION_HYPOT, away[1], away[2], 0), 0);
    const zs_value radius = zs_emit_constant(c, random_between(seed, 0.05, 0.4));
    zs_value ball = zs_emit(c, ZS_FUNCTION_SUBTRACT, radius, r, 0);
    if (!numbers && i == 7)
      ball = zs_emit(c, ZS_FUNCTION_SQUARE_ROOT, ball, 0, 0);
    if (i % 5 == 4)
      result = zs_emit(c, ZS_FUNCTION_MINIMUM, result, zs_emit(c, ZS_FUNCTION_NEGATE, ball, 0, 0), 0);
    else
      result = i ? zs_emit(c, ZS_FUNCTION_MAXIMUM, result, ball, 0) : ball;
  }
  return finish(c, result);
}

/* Many points at once, which are grouped, have the results that they have one by one: near
 * together, all over, more than once, and where there is no number. */
static void many_points_equal_single_ones(void **state)
{
  (void)state;
  enum { N = 70000, PROGRAMS = 12 };
  static float p[3][N], f[4][N];
  uint64_t seed = 5;
  for (int program = 0; program < PROGRAMS; program++) {
    zs_field *field = many_balls(&seed, 150 + 20 * (unsigned)program, program % 4 < 3);
    zs_eval *many = evaluator(field), *one = evaluator(field);
    const size_t n = program ? 2048 + random_below(&seed, 8000) : N;
    assert_true(zs_scatter_pays(zs_field_program(field), n));
    for (size_t i = 0; i < n; i++) {
      const double reach = i % 3 ? 2 : i % 2 ? 1e-6 : 0;
      for (int k = 0; k < 3; k++)
        p[k][i] = (float)random_between(&seed, 0.5 - reach, 0.5 + reach);
      if (i % 97 == 0)
        p[i / 97 % 3][i] = i % 2 ? NAN : INFINITY;
    }
    zs_eval_gradients(many, NULL, n, p[0], p[1], p[2], f[0], f[1], f[2], f[3]);
    for (size_t i = 0; i < n; i += 7) {
      float g[4];
      zs_eval_gradients(one, NULL, 1, &p[0][i], &p[1][i], &p[2][i], &g[0], &g[1], &g[2], &g[3]);
      for (int k = 0; k < 4; k++)
        assert_true(same(f[k][i], g[k]));
    }
    for (size_t i = 0; i < n; i += 7)
      zs_eval_values(one, NULL, 1, &p[0][i], &p[1][i], &p[2][i], &f[1][i]);
    /* The result may be where a coordinate was. */
    zs_eval_values(many, NULL, n, p[0], p[1], p[2], p[0]);
    for (size_t i = 0; i < n; i += 7)
      assert_true(same(p[0][i], f[1][i]));
    zs_eval_free(many);
    zs_eval_free(one);
    zs_field_unref(field);
  }
}

static void equal_instructions_are_shared(void **state)
{
  (void)state;
  zs_value xyz[3];
  zs_compiler *c = begin(xyz);
  zs_value a = zs_emit(c, ZS_FUNCTION_SINE, xyz[0], 0, 0);
  for (int i = 0; i < 1000; i++)
    assert_int_equal(zs_emit(c, ZS_FUNCTION_SINE, xyz[0], 0, 0), a);
  zs_value folded = zs_emit(c, ZS_FUNCTION_ADD, zs_emit_constant(c, 1), zs_emit_constant(c, 2), 0);
  double number;
  assert_true(zs_value_constant(c, folded, &number));
  assert_true(number == 3);
  zs_field *field = finish(c, zs_emit(c, ZS_FUNCTION_MULTIPLY, a, a, 0));
  zs_field_info info;
  zs_field_describe(field, &info);
  assert_int_equal(info.instructions, 3); /* x, sin, square */
  char *listing = zs_field_listing(field);
  assert_non_null(strstr(listing, "SINE"));
  free(listing);
  zs_field_unref(field);
}

/* ---- The walk ------------------------------------------------------------------- */

enum { SIDE = 21, BRICKS = SIDE * SIDE * SIDE };

typedef struct coverage {
  unsigned char visits[BRICKS]; /* 1 brick, 2 inside, 3 outside; more is an error */
  zs_request request;
} coverage;

static void mark_uniform(void *visitor, const uint32_t lo[3], const uint32_t hi[3], bool inside)
{
  coverage *c = visitor;
  for (uint32_t z = lo[2]; z < hi[2]; z++)
    for (uint32_t y = lo[1]; y < hi[1]; y++)
      for (uint32_t x = lo[0]; x < hi[0]; x++) {
        unsigned char *v = &c->visits[(z * SIDE + y) * SIDE + x];
        *v = (unsigned char)(*v ? 9 : inside ? 2 : 3);
      }
}

static void mark_brick(void *visitor, unsigned thread, const uint32_t i[3], zs_eval *eval,
                       const zs_program *program)
{
  (void)thread, (void)eval, (void)program;
  unsigned char *v = &((coverage *)visitor)->visits[(i[2] * SIDE + i[1]) * SIDE + i[0]];
  *v = *v ? 9 : 1;
}

static void walk_covers_every_brick_once(void **state)
{
  (void)state;
  uint64_t seed = 3;
  zs_field *field = random_field(&seed, 40, false);
  zs_eval *eval = evaluator(field);
  for (int run = 0; run < 3; run++) {
    coverage *c = calloc(1, sizeof *c);
    assert_non_null(c);
    zs_control control;
    memset(&control, 0, sizeof control);
    control.threads = (unsigned)run + 1;
    control.brute = run == 2;
    zs_walk walk = {.field = field, .lo = {-2, -2, -2}, .size = {0.2, 0.2, 0.2},
                    .count = {SIDE, SIDE, SIDE}, .request = ZS_REQUEST_SIGN, .control = &control,
                    .visitor = c, .uniform = mark_uniform, .brick = mark_brick};
    assert_true(zs_walk_run(&walk, NULL));
    for (int i = 0; i < BRICKS; i++) {
      assert_in_range(c->visits[i], 1, 3);
      if (control.brute)
        assert_int_equal(c->visits[i], 1);
      if (c->visits[i] == 1)
        continue;
      double middle[3] = {-2 + 0.2 * (i % SIDE + 0.5), -2 + 0.2 * (i / SIDE % SIDE + 0.5),
                          -2 + 0.2 * (i / SIDE / SIDE + 0.5)};
      assert_int_equal(zs_eval_point(eval, middle) >= 0, c->visits[i] == 2);
    }
    free(c);
  }
  zs_eval_free(eval);
  zs_field_unref(field);
}

static void keep_program(void *visitor, unsigned thread, const uint32_t i[3], zs_eval *eval,
                         const zs_program *program)
{
  (void)thread, (void)eval;
  ((const zs_program **)visitor)[(i[2] * SIDE + i[1]) * SIDE + i[0]] = program;
}

/* Programs in the caller's arenas serve their bricks after the walk. */
static void programs_can_outlive_the_walk(void **state)
{
  (void)state;
  uint64_t seed = 6;
  zs_field *field = random_field(&seed, 40, false);
  zs_eval *eval = evaluator(field);
  zs_arena arenas[2] = {{0}};
  const zs_program **programs = calloc(BRICKS, sizeof *programs);
  assert_non_null(programs);
  zs_control control;
  memset(&control, 0, sizeof control);
  control.threads = 2;
  zs_walk walk = {.field = field, .lo = {-2, -2, -2}, .size = {0.2, 0.2, 0.2},
                  .count = {SIDE, SIDE, SIDE}, .request = ZS_REQUEST_VALUE, .control = &control,
                  .visitor = programs, .programs = arenas, .brick = keep_program};
  assert_true(zs_walk_run(&walk, NULL));
  for (int i = 0; i < BRICKS; i++) {
    double middle[3] = {-2 + 0.2 * (i % SIDE + 0.5), -2 + 0.2 * (i / SIDE % SIDE + 0.5),
                        -2 + 0.2 * (i / SIDE / SIDE + 0.5)};
    assert_non_null(programs[i]);
    double part = zs_program_point(eval, programs[i], middle), whole = zs_eval_point(eval, middle);
    assert_true(part == whole || (isnan(part) && isnan(whole)));
  }
  free(programs);
  for (int t = 0; t < 2; t++)
    zs_arena_free(&arenas[t]);
  zs_eval_free(eval);
  zs_field_unref(field);
}

static bool stop_at_once(void *context, const char *stage, double fraction)
{
  (void)stage, (void)fraction;
  ++*(int *)context;
  return false;
}

static void walk_can_be_cancelled(void **state)
{
  (void)state;
  uint64_t seed = 4;
  int calls = 0;
  zs_field *field = random_field(&seed, 10, false);
  coverage *c = calloc(1, sizeof *c);
  assert_non_null(c);
  zs_control control;
  memset(&control, 0, sizeof control);
  control.progress = stop_at_once;
  control.context = &calls;
  zs_walk walk = {.field = field, .size = {1, 1, 1}, .count = {SIDE, SIDE, SIDE},
                  .control = &control, .visitor = c, .brick = mark_brick};
  zs_diag diag = {0};
  assert_false(zs_walk_run(&walk, &diag));
  assert_int_equal(diag.status, ZS_CANCELLED);
  assert_int_equal(calls, 1);
  free(c);
  zs_field_unref(field);
}

/* ---- Boxes ------------------------------------------------------------------------ */

/* A ball, turned about z so that its coordinates are mixed. */
static zs_field *ball(const double centre[3], double radius)
{
  zs_value xyz[3], p[3];
  zs_compiler *c = begin(xyz);
  zs_coordinates at = zs_coordinates_root();
  const double turn[12] = {0.6, 0.8, 0, 0, -0.8, 0.6, 0, 0, 0, 0, 1, 0};
  const double move[12] = {1, 0, 0, -centre[0], 0, 1, 0, -centre[1], 0, 0, 1, -centre[2]};
  at = zs_coordinates_affine(&at, move);
  at = zs_coordinates_affine(&at, turn);
  for (int k = 0; k < 3; k++)
    p[k] = zs_emit_coordinate(c, &at, k);
  zs_value r = zs_emit(c, ZS_FUNCTION_HYPOT, zs_emit(c, ZS_FUNCTION_HYPOT, p[0], p[1], 0), p[2], 0);
  return finish(c, zs_emit(c, ZS_FUNCTION_SUBTRACT, zs_emit_constant(c, radius), r, 0));
}

static void boxes_hold_the_solid_tightly(void **state)
{
  (void)state;
  const double radii[] = {1e-8, 1e-4, 1, 300, 1e5, 1e8};
  for (size_t i = 0; i < sizeof radii / sizeof *radii; i++) {
    double r = radii[i], centre[3] = {3 * r, -7 * r, 0.3 * r}, lo[3], hi[3];
    zs_field *field = ball(centre, r);
    assert_true(zs_field_box(field, lo, hi, NULL));
    for (int k = 0; k < 3; k++) {
      assert_true(lo[k] <= centre[k] - r && lo[k] >= centre[k] - 1.25 * r);
      assert_true(hi[k] >= centre[k] + r && hi[k] <= centre[k] + 1.25 * r);
    }
    zs_field_unref(field);
  }
}

static void boxes_far_away_are_as_tight(void **state)
{
  (void)state;
  for (double far = 1e3; far <= 1e7; far *= 10) {
    const double centre[3] = {far, -far, 0};
    double lo[3], hi[3];
    zs_field *field = ball(centre, 1);
    assert_true(zs_field_box(field, lo, hi, NULL));
    for (int k = 0; k < 3; k++) {
      assert_true(lo[k] <= centre[k] - 1 && lo[k] >= centre[k] - 1.25);
      assert_true(hi[k] >= centre[k] + 1 && hi[k] <= centre[k] + 1.25);
    }
    zs_field_unref(field);
  }
}

static void unbounded_and_empty_are_told_apart(void **state)
{
  (void)state;
  double lo[3], hi[3];
  zs_value xyz[3];
  zs_diag diag = {0};
  zs_compiler *c = begin(xyz);
  zs_field *half = finish(c, xyz[0]);
  assert_false(zs_field_box(half, lo, hi, &diag));
  assert_int_equal(diag.status, ZS_ERROR_UNABLE);
  assert_int_equal(diag.errors, 1);
  zs_field_unref(half);
  zs_diag second = {0};
  const double centre[3] = {0, 0, 0};
  zs_field *none = ball(centre, -1);
  assert_false(zs_field_box(none, lo, hi, &second));
  assert_int_equal(second.status, ZS_ERROR_UNABLE);
  zs_field_unref(none);
}

static void far_from_the_origin_nothing_is_lost(void **state)
{
  (void)state;
  const double centre[3] = {1e6, -1e6, 1e6};
  zs_field *field = ball(centre, 1);
  zs_eval *eval = evaluator(field);
  float x[5] = {0, 1, 0.5f, 0, 2}, y[5] = {0, 0, 0, -1, 0}, z[5] = {0, 0, 0, 0, 0}, f[5];
  const float expected[5] = {1, 0, 0.5f, 0, -1};
  zs_eval_values(eval, centre, 5, x, y, z, f);
  for (int i = 0; i < 5; i++)
    assert_true(fabsf(f[i] - expected[i]) < 1e-6f);
  zs_eval_free(eval);
  zs_field_unref(field);
}

/* 0, or no control, is no limit. */
static void memory_is_allowed_up_to_the_limit(void **state)
{
  (void)state;
  const zs_control limited = {.memory_limit = 1000}, unlimited = {.memory_limit = 0};
  assert_true(zs_control_allows(&limited, 0));
  assert_true(zs_control_allows(&limited, 1000));
  assert_false(zs_control_allows(&limited, 1000.5));
  assert_false(zs_control_allows(&limited, INFINITY));
  assert_true(zs_control_allows(&unlimited, 1e30));
  assert_true(zs_control_allows(NULL, 1e30));
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(scalar_functions),
    cmocka_unit_test(bounds_are_unknown_where_f_may_be),
    cmocka_unit_test(regions_equal_the_whole),
    cmocka_unit_test(regions_get_shorter),
    cmocka_unit_test(zeros_leave_regions),
    cmocka_unit_test(zeros_keep_their_signs),
    cmocka_unit_test(many_points_equal_single_ones),
    cmocka_unit_test(equal_instructions_are_shared),
    cmocka_unit_test(walk_covers_every_brick_once),
    cmocka_unit_test(programs_can_outlive_the_walk),
    cmocka_unit_test(walk_can_be_cancelled),
    cmocka_unit_test(memory_is_allowed_up_to_the_limit),
    cmocka_unit_test(boxes_hold_the_solid_tightly),
    cmocka_unit_test(boxes_far_away_are_as_tight),
    cmocka_unit_test(unbounded_and_empty_are_told_apart),
    cmocka_unit_test(far_from_the_origin_nothing_is_lost),
  };
  return cmocka_run_group_tests_name("field", tests, NULL, NULL);
}
