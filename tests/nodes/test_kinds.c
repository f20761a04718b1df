#define _POSIX_C_SOURCE 200809L /* setenv */

/* Everything that must hold for every kind of node, from its table entry. */
#include "random_nodes.h"

#include "field/program.h"

/* Every kind has its own random numbers, whatever other kinds there are. */
static uint64_t seed_of(const zs_kind *kind)
{
  uint64_t seed = 42;
  for (const char *c = kind->name; *c; c++)
    seed = (seed ^ (unsigned char)*c) * UINT64_C(0x100000001b3);
  return seed;
}

/* Call `test` with random nodes of every kind, on every instruction set. */
static void for_every_kind(int repetitions, void (*test)(const zs_node *, uint64_t *))
{
  static const char *const isas[] = {"baseline", "avx2", "avx512"};
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    if (needs_data(*kind))
      continue;
    uint64_t state = seed_of(*kind);
    for (int i = 0; i < repetitions; i++) {
      zs_arena arena = {0};
      setenv("ZEROSET_ISA", isas[i % 3], 1);
      test(random_node(&arena, *kind, &state), &state);
      zs_arena_free(&arena);
    }
  }
  unsetenv("ZEROSET_ISA");
}

/* ---- The table ---------------------------------------------------------------- */

static void check_text(const char *element, const char *what, const char *text)
{
  if (!text || !*text)
    fail_msg("<%s>: %s is missing", element, what);
}

static void check_attribute(const zs_kind *kind, const zs_attribute *attribute)
{
  check_text(kind->name, attribute->name, attribute->doc);
  assert_non_null(attribute->unit);
  assert_true(attribute->offset < kind->parameters_size);
  if (attribute->type == ZS_CHOICE) {
    assert_non_null(attribute->choices);
    assert_non_null(attribute->initial);
    assert_true(choice_index(attribute, attribute->initial) >= 0);
  }
  double values[3];
  if (components(attribute) && attribute->initial && *attribute->initial && !is_word(attribute)) {
    int read = parse_numbers(attribute->initial, values, 3);
    assert_true(read == components(attribute) || (attribute->type == ZS_SCALE && read == 1));
  }
}

static void check_kind(const zs_kind *kind)
{
  check_text(kind->name, "the summary", kind->summary);
  assert_int_equal(strspn(kind->name, "abcdefghijklmnopqrstuvwxyz-"), strlen(kind->name));
  assert_true(kind->summary[strlen(kind->summary) - 1] != '.');
  assert_true(kind->attribute_count <= 64);
  for (size_t i = 0; i < kind->attribute_count; i++) {
    check_attribute(kind, &kind->attributes[i]);
    for (size_t j = 0; j < i; j++)
      assert_string_not_equal(kind->attributes[i].name, kind->attributes[j].name);
  }
  for (const zs_variant *v = kind->variants; v && v->formula; v++)
    if (v->attribute)
      assert_true(choice_index(attribute_named(kind, v->attribute), v->choice) >= 0);
  if (kind->family != ZS_FAMILY_PART)
    assert_true(kind->emit || kind->formula || kind->variants || kind->map[0]);
  for (const zs_kind *const *part = kind->parts; part && *part; part++) {
    assert_int_equal((*part)->family, ZS_FAMILY_PART);
    check_kind(*part);
  }
}

static void test_table(void **unused)
{
  (void)unused;
  for (const zs_kind *const *kind = zs_kinds; *kind; kind++) {
    check_kind(*kind);
    assert_ptr_equal(zs_kind_find((*kind)->name), *kind);
    assert_true((*kind)->family < ZS_FAMILY_PART);
  }
  assert_null(zs_kind_find("spher"));
  assert_null(zs_kind_find("spheres"));
  assert_null(zs_kind_find(""));
}

/* ---- Evaluation ----------------------------------------------------------------- */

enum { POINTS = 1000 };

typedef struct cloud {
  float x[POINTS], y[POINTS], z[POINTS], f[POINTS], g[3][POINTS];
} cloud;

static void random_points(cloud *c, const double lo[3], const double hi[3], uint64_t *state)
{
  for (int i = 0; i < POINTS; i++) {
    c->x[i] = (float)random_between(state, lo[0], hi[0]);
    c->y[i] = (float)random_between(state, lo[1], hi[1]);
    c->z[i] = (float)random_between(state, lo[2], hi[2]);
  }
}

static const double LO[3] = {-2, -2, -2}, HI[3] = {2, 2, 2};

static bool near(double a, double b, double tolerance)
{
  return a == b || fabs(a - b) <= tolerance;
}

/* Blocks, with and without gradients, against the definition in double. */
static void check_values(const zs_node *node, uint64_t *state)
{
  static cloud c;
  zs_eval *eval = compiled(node);
  float *values = malloc(sizeof c.f);
  assert_non_null(values);
  random_points(&c, LO, HI, state);
  zs_eval_values(eval, NULL, POINTS, c.x, c.y, c.z, values);
  zs_eval_gradients(eval, NULL, POINTS, c.x, c.y, c.z, c.f, c.g[0], c.g[1], c.g[2]);
  for (int i = 0; i < POINTS; i++) {
    const double f = value_at(eval, c.x[i], c.y[i], c.z[i]);
    /* Coordinates are rounded on the way: as good as f at a point 1e-6 away. */
    const double steep = fabs(c.g[0][i]) + fabs(c.g[1][i]) + fabs(c.g[2][i]);
    const double tolerance = 1e-5 * (1 + fabs(f)) + 4e-6 * steep;
    if (!near(values[i], f, tolerance) || !near(c.f[i], f, tolerance))
      fail_msg("<%s> at %g %g %g: block %.9g, with gradient %.9g, reference %.9g (%s)",
               node->kind->name, c.x[i], c.y[i], c.z[i], values[i], c.f[i], f, zs_isa());
  }
  free(values);
  zs_eval_free(eval);
}

static void test_values(void **unused)
{
  (void)unused;
  for_every_kind(18, check_values);
}

static void check_gradients(const zs_node *node, uint64_t *state)
{
  static cloud c;
  zs_eval *eval = compiled(node);
  random_points(&c, LO, HI, state);
  zs_eval_gradients(eval, NULL, POINTS, c.x, c.y, c.z, c.f, c.g[0], c.g[1], c.g[2]);
  int smooth = 0;
  for (int i = 0; i < POINTS; i++) {
    const double p[3] = {c.x[i], c.y[i], c.z[i]};
    double g[3];
    if (isinf(c.f[i]) || !difference_gradient(eval, p, 1e-6, g))
      continue;
    smooth++;
    const double size = 1 + fabs(g[0]) + fabs(g[1]) + fabs(g[2]);
    for (int k = 0; k < 3; k++)
      if (!near(c.g[k][i], g[k], 2e-3 * size))
        fail_msg("<%s> at %g %g %g: gradient %g %g %g, differences %g %g %g (%s)",
                 node->kind->name, p[0], p[1], p[2], c.g[0][i], c.g[1][i], c.g[2][i], g[0], g[1],
                 g[2], zs_isa());
  }
  if (smooth < POINTS / 2 && isfinite(c.f[0]))
    fail_msg("<%s> is smooth at %d of %d points only", node->kind->name, smooth, POINTS);
  zs_eval_free(eval);
}

static void test_gradients(void **unused)
{
  (void)unused;
  for_every_kind(9, check_gradients);
}

/* Boxes of all sizes and proportions about the origin. */
static void random_box(double lo[3], double hi[3], uint64_t *state)
{
  for (int k = 0; k < 3; k++) {
    const double size = exp(random_between(state, log(0.01), log(3)));
    lo[k] = random_between(state, -2, 2 - size / 2);
    hi[k] = lo[k] + size;
  }
}

enum { BOXES = 112, SAMPLES = POINTS / 10 };

static void check_bounds(const zs_node *node, uint64_t *state)
{
  static cloud c;
  static double lo[BOXES][3], hi[BOXES][3];
  static float f_lo[BOXES], f_hi[BOXES];
  zs_eval *eval = compiled(node);
  for (int b = 0; b < BOXES; b++)
    random_box(lo[b], hi[b], state);
  zs_eval_bounds(eval, BOXES, (const double(*)[3])lo, (const double(*)[3])hi, f_lo, f_hi);
  int known = 0;
  for (int b = 0; b < BOXES; b++) {
    if (isnan(f_lo[b]) || isnan(f_hi[b])) {
      assert_true(isnan(f_lo[b]) && isnan(f_hi[b]));
      continue;
    }
    known++;
    assert_true(f_lo[b] <= f_hi[b]);
    /* Corners and a few faces too, where the extremes often are. */
    random_points(&c, lo[b], hi[b], state);
    for (int i = 0; i < SAMPLES / 2; i++) {
      float *p[3] = {&c.x[i], &c.y[i], &c.z[i]};
      for (int k = 0; k < 3; k++)
        if (random_below(state, 2))
          *p[k] = random_below(state, 2) ? nextafterf((float)lo[b][k], INFINITY)
                                         : nextafterf((float)hi[b][k], -INFINITY);
    }
    zs_eval_values(eval, NULL, SAMPLES, c.x, c.y, c.z, c.f);
    for (int i = 0; i < SAMPLES; i++) {
      const double f = value_at(eval, c.x[i], c.y[i], c.z[i]);
      if (!(c.f[i] >= f_lo[b] && c.f[i] <= f_hi[b]) || !(f >= f_lo[b] && f <= f_hi[b]))
        fail_msg("<%s> at %g %g %g: block %.9g, reference %.9g, outside %.9g .. %.9g (%s)",
                 node->kind->name, c.x[i], c.y[i], c.z[i], c.f[i], f, f_lo[b], f_hi[b], zs_isa());
    }
  }
  if (known < BOXES / 2)
    fail_msg("<%s>: bounds are known of %d boxes out of %d", node->kind->name, known, BOXES);
  zs_eval_free(eval);
}

static void test_bounds(void **unused)
{
  (void)unused;
  for_every_kind(9, check_bounds);
}

/* To a float strictly between two numbers. */
static float inside(float x, double lo, double hi)
{
  const float least = nextafterf((float)lo, INFINITY), most = nextafterf((float)hi, -INFINITY);
  return x < least ? least : x > most ? most : x;
}

/* A box's own program against the whole one. */
static void check_regions(const zs_node *node, uint64_t *state)
{
  static cloud whole, part;
  zs_eval *eval = compiled(node), *regional = compiled(node);
  for (int b = 0; b < 12; b++) {
    double lo[3], hi[3];
    random_box(lo, hi, state);
    const zs_request request = (zs_request)random_below(state, 3);
    random_points(&whole, lo, hi, state);
    for (int i = 0; i < POINTS; i++) {
      whole.x[i] = inside(whole.x[i], lo[0], hi[0]);
      whole.y[i] = inside(whole.y[i], lo[1], hi[1]);
      whole.z[i] = inside(whole.z[i], lo[2], hi[2]);
    }
    part = whole;
    assert_true(zs_eval_restrict(regional, lo, hi, request));
    zs_eval_gradients(eval, NULL, POINTS, whole.x, whole.y, whole.z, whole.f, whole.g[0],
                      whole.g[1], whole.g[2]);
    if (request == ZS_REQUEST_GRADIENT)
      zs_eval_gradients(regional, NULL, POINTS, part.x, part.y, part.z, part.f, part.g[0],
                        part.g[1], part.g[2]);
    else
      zs_eval_values(regional, NULL, POINTS, part.x, part.y, part.z, part.f);
    zs_eval_release(regional);
    int rough = 0;
    for (int i = 0; i < POINTS; i++) {
      /* R-functions of R-functions are some ten times as steep as what they join. */
      const double tolerance = 1e-5 * (1 + fabs(whole.f[i]));
      const bool same = request == ZS_REQUEST_SIGN
                          ? (part.f[i] >= 0) == (whole.f[i] >= 0) || fabs(whole.f[i]) < tolerance
                          : near(part.f[i], whole.f[i], tolerance);
      if (!same)
        fail_msg("<%s> at %g %g %g: in a region %.9g, as a whole %.9g, request %d (%s)",
                 node->kind->name, whole.x[i], whole.y[i], whole.z[i], part.f[i], whole.f[i],
                 (int)request, zs_isa());
      if (request == ZS_REQUEST_GRADIENT)
        for (int k = 0; k < 3; k++)
          rough += !near(part.g[k][i], whole.g[k][i], 1e-4 * (1 + fabs(whole.g[k][i])));
    }
    /* Where two edges are equally near, rounding may choose the other one. */
    if (rough > POINTS / 50)
      fail_msg("<%s>: %d gradients differ in a region", node->kind->name, rough);
  }
  zs_eval_free(eval);
  zs_eval_free(regional);
}

static void test_regions(void **unused)
{
  (void)unused;
  for_every_kind(9, check_regions);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_table),     cmocka_unit_test(test_values),
    cmocka_unit_test(test_gradients), cmocka_unit_test(test_bounds),
    cmocka_unit_test(test_regions),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
